"""A scene's body of rigid links that swims in a bed of grains, beside the predictions
of the tiers of resistive force theory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.swimmer import Swimmer
from geomech.runs.backend import prefer_backend
from geomech.scenes.model import Scene
from geomech.studies.grains.drag import GrainSteps, grain_cost, store_folder
from geomech.studies.scene_tables import SceneTables
from geomech.studies.terradynamics.calibration import rod_fit
from rft.bodies.links import Links
from rft.core.checks import in_range, is_number
from rft.core.refusal import Refusal, located, require
from rft.effects import EndCaps
from rft.grains.bed import Bed
from rft.grains.engine import require_lammps
from rft.grains.experiment import Experiment, Run
from rft.grains.motions import Swim
from rft.grains.spheres import chain

RAMP = 0.5  # cycles in which the gait grows from the straight body
# Of a scene without its own: those of the rod of the sample `FLANK`.
SIZE = 0.162  # m
RADIUS = 6e-3  # m
FREQUENCY = 1.0  # Hz, assumed
MARGIN_ALONG = 0.118  # m of bed beyond the body
MARGIN_ACROSS = 0.078  # m of bed beyond the body
DEPTH = 0.049  # m of bed, or as much as a thick body takes
FLANK = "flank-drag"  # the sample of drag in such beds
GRAINS_LAW = "law of grains"
GRAINS = "grains"
UNITS = {"x": "BL", "y": "BL", "heading": "rad"}
Progress = Callable[[float], None]


class Predicted(NamedTuple):
    """The displacement of a cycle by a method (3,): x and y in body lengths, heading in
    rad. error: estimated. spread: standard deviation by an uncertain medium, or of the
    cycles in grains. Both are nan where they are not known."""

    values: np.ndarray
    error: np.ndarray
    spread: np.ndarray

    @property
    def distance(self) -> tuple[float, float, float]:
        """Net distance with its error and spread, body lengths."""
        x, y = self.values[:2]
        distance = np.hypot(x, y)
        slope = np.ones(2)  # of the distance over x and y
        if distance > 0:
            slope = self.values[:2] / distance
        error = np.hypot(*(slope * self.error[:2]))
        spread = np.hypot(*(slope * self.spread[:2]))
        return float(distance), float(error), float(spread)


@dataclass(frozen=True)
class GrainSwim:
    """A swimmer of rigid links in a bed of grains, for some cycles of its gait after
    the gait has grown from the straight body.

    cycles: their number. seed: of the bed. size, radius (m): of the body; by default
    the scene's length and the radius of its end caps, or `SIZE` and `RADIUS` where the
    scene is in body lengths. depth (m): of its axis, half of the bed's if None. store:
    folder of beds and runs."""

    scene: Scene
    cycles: int = 2
    seed: int = 1
    size: float | None = None
    radius: float | None = None
    depth: float | None = None
    store: Path | None = field(default=None, compare=False)

    @property
    def frequency(self) -> float:
        """Cycles per second, `FREQUENCY` where the scene has none."""
        return self.scene.frequency or FREQUENCY

    @property
    def swimmer(self) -> Swimmer:
        """The system; Refusal for one that is no body of rigid links."""
        system = self.scene.system
        if not (isinstance(system, Swimmer) and isinstance(system.body, Links)):
            raise Refusal(
                "grains need a body of rigid links",
                where=self.scene.name,
                instead='give a scene with [body] kind = "chain"',
            )
        return system

    @cached_property
    def experiment(self) -> Experiment:
        """The bed, the body and its motion."""
        body = self.swimmer.body
        size = self._size()
        require(
            is_number(size) and 0 < size < np.inf,
            "length must be a number above 0",
            value=size,
        )
        radius = self._radius(size)
        require(
            is_number(radius) and 0 < radius < size / 2,
            "radius must be a number above 0 and below half of the length",
            value=radius,
        )

        bed = Bed(seed=self.seed)
        bed = replace(
            bed,
            length=round(size + MARGIN_ALONG, 6),
            width=round(size + MARGIN_ACROSS, 6),
            depth=max(DEPTH, round(2 * radius + 6 * bed.diameter, 6)),
        )
        gait = self.scene.gait
        f = self.frequency
        swim = Swim(gait.shape, gait.rate, f, RAMP / f, -2 * np.pi * RAMP)
        seconds = (RAMP + self.cycles) / f
        return Experiment(bed, chain(body, size, radius), swim, seconds, self.depth)

    def _size(self) -> float:
        """Return the length of the body, m."""
        own_size = self.swimmer.body.length
        if self.size is not None:
            return self.size
        if own_size is not None:
            return own_size
        return SIZE

    def _radius(self, size: float) -> float:
        """Return the radius, m, of a body of a size, m."""
        if self.radius is not None:
            return self.radius
        for effect in self.swimmer.effects:
            if isinstance(effect, EndCaps):
                # None where the radius is in body lengths.
                own_size = self.swimmer.body.length
                return effect.in_body_lengths(own_size).radius * size
        return RADIUS

    def check(self) -> None:
        """Refuse scenes and sizes that no bed takes, and beds without the engine of
        grains."""
        in_range("cycles", self.cycles, 1, 1000, whole=True)
        with located(self.scene.name):
            self.experiment.check()
        store_folder(self.store)  # refuses where there is none
        require_lammps()

    def cost(self) -> GrainSteps:
        return grain_cost([self.experiment], store_folder(self.store))

    def answer(self, progress: Progress) -> Result:
        """Return the displacement by every tier and in grains, and the motion in
        time."""
        # Before the grains: a scene that no tier takes is refused at once.
        cost = SceneTables(self.scene).cost([self.scene.gait.amplitude])
        with prefer_backend(cost.numpy_seconds):
            by_tier = predictions(self)
        run = self.experiment.run(store_folder(self.store), progress)
        return swim_result(self, run, by_tier)


def swim_result(question: GrainSwim, run: Run, by_tier: dict[str, Predicted]) -> Result:
    """Return the displacement by method and by cycle, and the motion in time."""
    size = question.experiment.body.size
    starts = (RAMP + np.arange(question.cycles + 1)) / question.frequency
    poses = cycle_poses(run, starts) / [size, size, 1.0]
    unknown = np.full(3, np.nan)
    scatter = unknown
    if len(poses) > 1:
        scatter = poses.std(0, ddof=1)
    methods = {**by_tier, GRAINS: Predicted(poses.mean(0), unknown, scatter)}
    facts = {"seed": question.seed, **run.facts}
    variables = [
        *_scalar_variables(question, run, starts),
        *_method_variables(methods),
        *_cycle_variables(poses),
        *_motion_variables(run),
        *_outline_variables(question, run, [0.0, *starts]),
    ]
    return Result("grains", tuple(variables), facts)


def _scalar_variables(
    question: GrainSwim, run: Run, starts: np.ndarray
) -> list[Variable]:
    body = question.experiment.body
    begin, end = np.interp(starts[[0, -1]], run.t, run.work)
    work = float((end - begin) / question.cycles)
    overlap = float(run.overlaps[:, 0].max())
    return [
        Variable("body_length", (), body.size, "m"),
        Variable("body_radius", (), body.half_width, "m"),
        Variable("frequency", (), question.frequency, "Hz"),
        Variable(
            "amplitude", (), question.scene.gait.amplitude, "", "amplitude of the gait"
        ),
        Variable("work", (), work, "J", "work of the body on the grains per cycle"),
        Variable(
            "largest_overlap", (), overlap, "1", "largest overlap in grain diameters"
        ),
    ]


def _method_variables(methods: dict[str, Predicted]) -> list[Variable]:
    """Return the displacement of a cycle by each method."""
    found = [Variable("method", ("method",), np.array([*methods]))]
    for k, (name, unit) in enumerate(UNITS.items()):
        values = [one.values[k] for one in methods.values()]
        error = [one.error[k] for one in methods.values()]
        spread = [one.spread[k] for one in methods.values()]
        found.append(
            Variable(
                name, ("method",), values, unit, "displacement per cycle", error, spread
            )
        )
    distance, error, spread = np.array([one.distance for one in methods.values()]).T
    found.append(
        Variable(
            "net_distance",
            ("method",),
            distance,
            "BL",
            "net distance per cycle",
            error,
            spread,
        )
    )
    return found


def _cycle_variables(poses: np.ndarray) -> list[Variable]:
    """Return the displacement of each cycle in grains."""
    found = [Variable("cycle", ("cycle",), np.arange(1, len(poses) + 1))]
    for k, (name, unit) in enumerate(UNITS.items()):
        label = "displacement of each cycle in grains"
        found.append(Variable(f"cycle_{name}", ("cycle",), poses[:, k], unit, label))
    return found


def _motion_variables(run: Run) -> list[Variable]:
    """Return the motion in time: pose of the frame, shape, force of the grains,
    work."""
    columns = [
        ("frame_x", run.pose[:, 0], "m", "x of the body frame"),
        ("frame_y", run.pose[:, 1], "m", "y of the body frame"),
        ("frame_heading", run.pose[:, 2], "rad", "heading of the body frame"),
    ]
    for k in range(run.alpha.shape[1]):
        columns.append((f"alpha_{k + 1}", run.alpha[:, k], "rad", "joint angle"))
    for k, axis in enumerate("xyz"):
        label = "force of the grains on the body"
        columns.append((f"force_{axis}", run.force[:, k], "N", label))
    columns += [
        ("moment", run.moment, "N m", "moment about the centre of mass"),
        ("work_done", run.work, "J", "work of the body on the grains so far"),
        ("kinetic_energy", run.kinetic, "J", "kinetic energy of the body"),
    ]
    found = [Variable("t", ("t",), run.t, "s", "time")]
    for name, values, unit, label in columns:
        found.append(Variable(name, ("t",), values, unit, label))
    return found


def _outline_variables(
    question: GrainSwim, run: Run, times: list[float]
) -> list[Variable]:
    """Return the body at some times, and the track of its frame, in body lengths."""
    size = question.experiment.body.size
    body = question.swimmer.body
    unit = size / body_size(body)  # m, of a length of the body
    rows = np.minimum(np.searchsorted(run.t, times), len(run.t) - 1)
    outlines = []
    for row in rows:
        pose = run.pose[row] / [unit, unit, 1.0]
        outlines.append(unit / size * body.points(run.alpha[row], pose))
    points = np.array(outlines)
    track = run.pose[:, :2].T / size
    found = [Variable("picture_t", ("picture_t",), np.array(times), "s", "time")]
    for k, axis in enumerate("xy"):
        over = ("picture_t", "point")
        found.append(
            Variable(f"body_{axis}", over, points[..., k], "BL", "position of the body")
        )
        found.append(
            Variable(f"track_{axis}", ("t",), track[k], "BL", "track of the body frame")
        )
    return found


def cycle_poses(run: Run, starts: np.ndarray) -> np.ndarray:
    """Return the net displacement (cycles, 3) between successive times, x and y in m in
    the frame at the start of each."""
    pose = np.column_stack([np.interp(starts, run.t, run.pose[:, k]) for k in range(3)])
    dx, dy, dtheta = np.diff(pose, axis=0).T
    theta = pose[:-1, 2]
    c, s = np.cos(theta), np.sin(theta)
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, dtheta])


def predictions(question: GrainSwim) -> dict[str, Predicted]:
    """Return the predictions by the tiers of the scene, and by the direct tier with the
    law and the ends of the sample `FLANK`, under `GRAINS_LAW`."""
    scene = question.scene
    found = _tier_predictions(scene)
    body = question.experiment.body
    law = rod_fit(FLANK, end_caps="fitted")
    caps = law.caps(body.half_width / body.size)
    caps = caps.in_metres(question.swimmer.body.length)
    others = [e for e in question.swimmer.effects if not isinstance(e, EndCaps)]
    system = replace(question.swimmer, medium=law.medium, effects=(*others, caps))
    by_grains_law = _tier_predictions(scene.changed(system=system), ("direct",))
    found[GRAINS_LAW] = by_grains_law["direct"]
    return found


def _tier_predictions(
    scene: Scene, tiers: tuple[str, ...] | None = None
) -> dict[str, Predicted]:
    """Return the displacement of a scene's own gait by tier."""
    amplitude = scene.gait.amplitude
    table = SceneTables(scene).displacements([amplitude], tiers)
    length = table.attributes["body_length"]
    units = np.array([length, length, 1.0])
    found = {}
    for tier in table["tier"].values.tolist():
        one = table.at(tier=tier, amplitude=amplitude)
        values = []
        errors = []
        spreads = []
        for name in UNITS:
            variable = one[name]
            values.append(float(variable.values))
            errors.append(float(variable.error))
            spread = 0.0
            if variable.spread is not None:
                spread = float(variable.spread)
            spreads.append(spread)
        found[tier] = Predicted(
            np.array(values) / units,
            np.array(errors) / units,
            np.array(spreads) / units,
        )
    return found
