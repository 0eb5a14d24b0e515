"""Questions to grains (`rft.grains`): the drag on the flank and on the ends of a rod, as a law can be fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.run import runner as runners
from geomech.run.cost import BASE, Cost, TooLong, duration
from geomech.run.store import cache_folder
from geomech.studies.question import Allow, Progress, Question
from rft.core.refusal import Refusal, require
from rft.fits.rods import Fit, fit
from rft.grains.bed import Bed
from rft.grains.drag import Drag, flank_and_ends
from rft.grains.engine import lammps
from rft.grains.experiment import SETTLING, Experiment, Run, settle
from rft.grains.motions import Tow
from rft.grains.spheres import Spheres, rod
from rft.laws.drag import Rod, rod_drag

RATE = 1.8e6  # steps of a grain a second; 1.9e6 measured on one core of the machine that this was written on
LONGEST = 600.0  # s of computing that a command begins without consent
TRAVEL = 7.5  # half widths that a rod is dragged, the first 2.5 of them not counted


class GrainSteps(Cost):
    """Cost of grains; balances counts the steps of all grains."""

    # Grains solve no balances of forces. What is left of them depends on the store, and
    # with it would the back end of the tiers beside them, and their last digits.
    as_balances = 0.0

    def __str__(self) -> str:
        return f"{self.balances:.1e} steps of grains, about {duration(self.seconds)} of computing"

    def check(self, place: str, yes: bool, less: str = "ask for less") -> None:
        if not yes and self.seconds > LONGEST:
            instead = (
                f"to compute for more than {duration(LONGEST)} say ``yes``, or {less}"
            )
            raise TooLong(str(self), where=place, instead=instead)


def price(experiments: Sequence[Experiment], store: Path) -> GrainSteps:
    """Return the cost of experiments, as far as their settled beds and runs are not in a store."""
    missing = {e.bed: e for e in experiments if not e.is_settled(store)}
    settling = sum(
        e.grain_steps / e.n_steps * sum(SETTLING) / e.bed.step for e in missing.values()
    )
    steps = (
        sum(e.grain_steps * e.steps_left(store) / e.n_steps for e in experiments)
        + settling
    )
    return GrainSteps(round(steps), steps / RATE, BASE, steps / RATE)


def store_folder(given: Path | None) -> Path:
    """Return the folder of settled beds and runs: the one given, else that in the user's cache folder."""
    if given is not None:
        return Path(given)
    folder = cache_folder()
    if folder is None:
        raise Refusal(
            "there is no cache folder for beds of grains",
            instead="name one with ``store``",
        )
    return folder / "grains"


class Titled(NamedTuple):
    """What a cost is said of, where there is no scene."""

    name: str


@dataclass(frozen=True)
class DragGrains(Question):
    """The drag on a round rod in beds of grains, at several attack angles.

    length, radius (m): of the rod, from end to end. angles: between velocity and axis, degrees, 0 to 90. beds: how many,
    with seeds from ``seed`` on. speed (m/s). depth (m): of the axis below the surface, half of the bed's if None.
    store: folder of beds and runs."""

    length: float = 0.162
    radius: float = 6e-3
    angles: tuple[float, ...] = (0.0, 8.0, 16.0, 30.0, 55.0, 90.0)
    beds: int = 3
    speed: float = 0.1
    depth: float | None = None
    seed: int = 1
    bed: Bed = field(default_factory=Bed)
    store: Path | None = field(default=None, compare=False)

    less: ClassVar[str] = "take fewer ``beds`` or ``angles``"
    scene: ClassVar[Titled] = Titled("drag in grains")

    @property
    def title(self) -> str:
        return self.scene.name

    def inputs(self) -> list[Path]:
        return []

    @property
    def body(self) -> Spheres:
        return rod(self.length, self.radius)

    def experiments(self) -> list[Experiment]:
        """Return the experiments, bed by bed."""
        duration_ = round(TRAVEL * self.radius / self.speed, 9)
        return [
            Experiment(
                replace(self.bed, seed=self.seed + k), self.body, Tow(self.speed, math.radians(psi)), duration_,
                self.depth,
            )
            for k in range(self.beds)
            for psi in self.angles
        ]  # fmt: skip

    def check(self) -> None:
        require(
            len(set(self.angles)) >= 3,
            "a law takes three angles or more",
            value=list(self.angles),
        )
        require(
            all(0 <= psi <= 90 for psi in self.angles),
            "angles must be 0 to 90 degrees",
            value=list(self.angles),
        )
        require(1 <= self.beds <= 100, "beds must be 1 to 100", value=self.beds)
        require(self.speed > 0, "speed must be > 0", value=self.speed)
        require(
            self.length >= 20 * self.radius,
            "a rod must be ten times as long as it is wide",
            value=self.length,
        )
        for experiment in self.experiments()[: len(self.angles)]:
            experiment.check()
        store_folder(self.store)
        lammps()

    def cost(self) -> GrainSteps:
        return price(self.experiments(), store_folder(self.store))

    def answer(self, progress: Progress, allow: Allow) -> Result:
        folder, experiments = store_folder(self.store), self.experiments()
        first, runner, share = (
            experiments[:: len(self.angles)],
            runners.runner(),
            1.0 / (1 + len(self.angles)),
        )
        each = price(experiments, folder).seconds / (len(first) + len(experiments))
        settled = list(
            runner.map(
                _settle,
                folder,
                first,
                len(first),
                each * len(first),
                lambda done: progress(share * done),
            )
        )
        rest = lambda done: progress(share + (1 - share) * done)
        rows = runner.map(
            _drag, folder, experiments, len(experiments), each * len(experiments), rest
        )
        return self._result(
            np.array(settled),
            np.array(list(rows)).reshape(self.beds, len(self.angles), -1),
        )

    def _result(self, settled: np.ndarray, rows: np.ndarray) -> Result:
        """Return the result of settled beds (beds, packing and surface) and rows (beds, angles, numbers of a `Drag`)."""
        r = np.moveaxis(rows, -1, 0)
        drags = Drag(r[:2], r[2:4], r[4], r[5:7], r[7:9], r[9])
        packing, surface = settled.mean(0)
        height = self.experiments()[0].height
        facts = {
            "packing": float(packing), "depth": float(surface - height), "overlap": float(rows[..., 10].max()),
            "lammps": int(rows[0, 0, 11]), "grains": int(rows[0, 0, 12]), "step": self.bed.step,
        }  # fmt: skip
        across, over = ("component", "bed", "angle"), ("bed", "angle")
        variables = (
            Variable(
                "angle", ("angle",), np.array(self.angles), "degrees", "attack angle"
            ),
            Variable("bed", ("bed",), self.seed + np.arange(self.beds), "1", "seed"),
            Variable(
                "component", ("component",), np.array(["parallel", "perpendicular"])
            ),
            Variable(
                "flank",
                across,
                drags.flank,
                "N/m",
                "drag on the flank",
                drags.flank_error,
            ),
            Variable(
                "ends",
                across,
                drags.ends,
                "N",
                "drag on both ends beyond that",
                drags.ends_error,
            ),
            Variable(
                "lift", over, drags.lift, "N", "lift of the whole rod", drags.lift_error
            ),
        )
        return Result("drag_grains", variables, facts, (self, self.law(drags, facts)))

    def law(self, drags: Drag, facts: dict[str, float]) -> Fit:
        """Return the granular law of the flank with e of the ends, fitted to all beds."""
        psi = np.tile(self.angles, self.beds)
        flank, ends = (
            x.reshape(2, -1) for x in (self.length * drags.flank, drags.ends)
        )
        size = Rod(
            self.radius,
            self.length,
            facts["depth"],
            facts["packing"] * self.bed.density,
        )
        return fit("granular", rod_drag(psi, *flank, ends=ends), size, "fitted")


def _settle(folder: Path, experiment: Experiment) -> list[float]:
    """Return packing and surface (m) of the bed of an experiment, settled where it is not in the folder."""
    facts = settle(experiment.bed, experiment.body, experiment.height, folder).facts
    return [facts["packing"], facts["surface"]]


def _drag(folder: Path, experiment: Experiment) -> list[float]:
    """Return the numbers of the `Drag` of an experiment, the largest overlap, LAMMPS's version and the number of grains."""
    run: Run = experiment.run(folder)
    tow, body = experiment.motion, experiment.body
    drag = flank_and_ends(run, body.size, body.half_width, tow.angle, tow.speed)
    numbers = np.concatenate([np.atleast_1d(x) for x in drag]).tolist()
    return [
        *numbers,
        float(run.overlaps[:, 0].max()),
        float(run.facts["lammps"]),
        float(run.facts["grains"]),
    ]
