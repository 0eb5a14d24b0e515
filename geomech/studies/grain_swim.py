"""A scene's body of rigid links swims in a bed of grains, beside what the tiers of resistive force theory predict."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.run.backend import prefer_backend
from geomech.scenes.model import Scene
from geomech.studies.calibration import rod_fit
from geomech.studies.grains import GrainSteps, price, store_folder
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.study import Study
from geomech.systems.swimmer import Swimmer
from rft.bodies.links import Links
from rft.core.refusal import Refusal, located, require
from rft.effects import EndCaps
from rft.grains.bed import Bed
from rft.grains.engine import lammps
from rft.grains.experiment import Experiment, Run
from rft.grains.motions import Swim
from rft.grains.spheres import chain

RAMP = 0.5  # cycles in which the gait grows from the straight body
SIZE, RADIUS, FREQUENCY = (
    0.162,
    6e-3,
    1.0,
)  # m, m and Hz of a scene that gives none: those of the shipped flank's rod
ROOM = 0.118, 0.078  # m of bed beyond the body along and across it
DEPTH = 0.049  # m of bed, or as much as a thick body takes
FLANK = "flank-drag"  # the sample of drag in such beds
GRAINS_LAW = "direct, law of grains"


@dataclass(frozen=True)
class GrainSwim(Question):
    """A swimmer of rigid links in a bed of grains, for some cycles of its gait after it has grown from the straight body.

    cycles: how many. seed: of the bed. size, radius (m): of the body; by default the scene's length and the radius of its
    end caps, or `SIZE` and `RADIUS` where the scene is in body lengths. depth (m): of its axis, half of the bed's if None.
    store: folder of beds and runs."""

    scene: Scene
    cycles: int = 2
    seed: int = 1
    size: float | None = None
    radius: float | None = None
    depth: float | None = None
    store: Path | None = field(default=None, compare=False)

    less: ClassVar[str] = "take fewer ``cycles``"

    @property
    def title(self) -> str:
        return f"grains around {self.scene.name}"

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
                "grains take a body of rigid links",
                where=self.scene.name,
                instead='give a scene with [body] kind = "chain"',
            )
        return system

    @cached_property
    def experiment(self) -> Experiment:
        body = self.swimmer.body
        caps = next((e for e in self.swimmer.effects if isinstance(e, EndCaps)), None)
        size = self.size
        if size is None:
            size = SIZE if body.length is None else body.length
        require(0 < size < np.inf, "length must be > 0", value=size)
        radius = self.radius
        if radius is None:
            radius = RADIUS
            if caps is not None:
                own_size = body.length  # None where the radius is in body lengths
                radius = caps.in_body_lengths(own_size).radius * size
        require(
            0 < radius < size / 2,
            "radius must be > 0 and below half of the length",
            value=radius,
        )
        bed = Bed(seed=self.seed)
        depth = max(DEPTH, round(2 * radius + 6 * bed.diameter, 6))
        bed = replace(
            bed,
            length=round(size + ROOM[0], 6),
            width=round(size + ROOM[1], 6),
            depth=depth,
        )
        gait, f = self.scene.gait, self.frequency
        swim = Swim(gait.shape, gait.rate, f, RAMP / f, -2 * np.pi * RAMP)
        return Experiment(
            bed, chain(body, size, radius), swim, (RAMP + self.cycles) / f, self.depth
        )

    def check(self) -> None:
        require(1 <= self.cycles <= 1000, "cycles must be 1 to 1000", value=self.cycles)
        with located(self.scene.name):
            self.experiment.check()
        lammps()
        store_folder(self.store)

    def cost(self) -> GrainSteps:
        return price([self.experiment], store_folder(self.store))

    def answer(self, progress: Progress, allow: Allow) -> Result:
        # Before the grains: a scene that no tier takes is refused at once.
        balances = Study(self.scene).cost([self.scene.gait.amplitude]).as_balances
        with prefer_backend(balances):
            tiers = predictions(self)
        return result(
            self, self.experiment.run(store_folder(self.store), progress), tiers
        )


Predictions = dict[
    str, tuple[list[float], list[float]]
]  # (x, y, heading) in body lengths and rad, and errors, by tier


def result(question: GrainSwim, run: Run, tiers: Predictions) -> Result:
    """Return the displacement by cycle and its mean, in body lengths, beside the tiers of the scene and the direct tier with
    the law of the sample `FLANK` and its end caps."""
    scene, experiment = question.scene, question.experiment
    starts = (RAMP + np.arange(question.cycles + 1)) / question.frequency
    poses = cycle_poses(run, starts) / [experiment.body.size, experiment.body.size, 1.0]
    names = [*tiers, "grains"]
    spread = poses.std(0, ddof=1) if len(poses) > 1 else np.full(3, np.nan)
    values = np.array([*(x for x, _ in tiers.values()), poses.mean(0)])
    errors = np.array([*(e for _, e in tiers.values()), spread])
    columns = [
        Variable(name, ("method",), values[:, k], unit, error=errors[:, k])
        for k, (name, unit) in enumerate((("x", "BL"), ("y", "BL"), ("heading", "rad")))
    ]
    facts = {
        "name": scene.name, "amplitude": scene.gait.amplitude, "frequency": question.frequency, "seed": question.seed,
        "size": experiment.body.size, "radius": experiment.body.half_width, "overlap": float(run.overlaps[:, 0].max()),
        "work": float((np.interp(starts[-1], run.t, run.work) - np.interp(starts[0], run.t, run.work)) / question.cycles),
        **run.facts,
    }  # fmt: skip
    variables = (
        Variable("method", ("method",), np.array(names)),
        *columns,
        Variable("cycle", ("cycle",), np.arange(1, question.cycles + 1)),
        Variable(
            "cycle_x", ("cycle",), poses[:, 0], "BL", "displacement of each cycle"
        ),
        Variable("cycle_y", ("cycle",), poses[:, 1], "BL"),
        Variable("cycle_heading", ("cycle",), poses[:, 2], "rad"),
    )
    return Result("grain_swim", variables, facts, (question, run))


def cycle_poses(run: Run, starts: np.ndarray) -> np.ndarray:
    """Return the net displacement (cycles, 3) between successive times, x and y in m in the frame at the start of each."""
    pose = np.column_stack([np.interp(starts, run.t, run.pose[:, k]) for k in range(3)])
    d, theta = np.diff(pose, axis=0), pose[:-1, 2]
    c, s = np.cos(theta), np.sin(theta)
    return np.column_stack(
        [c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0], d[:, 2]]
    )


def predictions(question: GrainSwim) -> Predictions:
    """Return what the tiers of the scene say, and the direct tier with the law and the ends of the sample `FLANK`."""
    scene = question.scene
    found = dict(_predicted(scene))
    body = question.experiment.body
    law = rod_fit(FLANK, end_caps="fitted")
    caps = law.caps(body.half_width / body.size)
    caps = caps.in_metres(question.swimmer.body.length)
    others = tuple(e for e in question.swimmer.effects if not isinstance(e, EndCaps))
    system = replace(
        question.swimmer,
        medium=law.medium,
        effects=(*others, caps),
    )
    found[GRAINS_LAW] = dict(_predicted(scene.changed(system=system), ("direct",)))[
        "direct"
    ]
    return found


def _predicted(scene: Scene, tiers: tuple[str, ...] | None = None):
    """Yield (tier, ((x, y, heading), errors)) of a scene's own gait. The error of a position has that of an uncertain
    medium."""
    of_study = Study(scene).displacements([scene.gait.amplitude], tiers)
    length = of_study.attributes["body_length"]
    for k, tier in enumerate(of_study["tier"].values.tolist()):
        values, errors = [], []
        for name, unit in (("x", length), ("y", length), ("heading", 1.0)):
            v = of_study[name]
            spread = 0.0 if v.spread is None else v.spread[k, 0]
            values.append(float(v.values[k, 0] / unit))
            errors.append(float(np.hypot(v.error[k, 0], spread) / unit))
        yield tier, (values, errors)
