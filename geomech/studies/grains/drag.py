"""The drag of grains on the flank and on the ends of a rod (`rft.grains`), and the law
that is fitted to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.runs.cost import BASE, Cost, TooLong, duration
from geomech.runs.runner import runner
from geomech.runs.store import cache_folder
from geomech.studies.terradynamics.calibration import fit_variables
from rft.core.checks import in_range, is_number, is_whole
from rft.core.refusal import Refusal, require
from rft.fits.rods import Fit, fit
from rft.grains.bed import Bed
from rft.grains.drag import UNSTEADY_TRAVEL, Drag, flank_and_ends
from rft.grains.engine import require_lammps
from rft.grains.experiment import SETTLING_TIMES, Experiment, Run, settle
from rft.grains.motions import Tow
from rft.grains.spheres import Spheres, rod
from rft.laws.drag import Rod, rod_drag

# Steps of a grain per second; 1.9e6 measured on one core.
RATE = 1.8e6
LONGEST = 600.0  # s of computing that a command begins without consent
# Half widths that a rod is dragged, without the first `UNSTEADY_TRAVEL`.
TRAVEL = 7.5
Progress = Callable[[float], None]


class GrainSteps(Cost):
    """Cost of grains; balances counts the steps of all grains.

    They solve no balances of forces, and ``numpy_seconds`` is 0. If their remaining
    steps counted, which depend on the store, so would the back end of the tiers beside
    them, and their last digits."""

    def __str__(self) -> str:
        seconds = duration(self.seconds)
        return f"{self.balances:.1e} steps of grains, about {seconds} of computing"

    def check(
        self, place: str, yes: bool, cheaper_alternative: str = "request less"
    ) -> None:
        if yes or self.seconds <= LONGEST:
            return
        longest = duration(LONGEST)
        raise TooLong(
            str(self),
            where=place,
            instead=f"to compute for more than {longest} use ``yes``, or "
            f"{cheaper_alternative}",
        )


def grain_cost(experiments: Sequence[Experiment], store: Path) -> GrainSteps:
    """Return the cost of experiments, as far as their settled beds and runs are not in
    a store."""
    steps = 0.0
    unsettled = {}
    for experiment in experiments:
        remaining = experiment.steps_left(store)
        steps += experiment.grain_steps * remaining / experiment.n_steps
        if not experiment.is_settled(store):
            unsettled[experiment.bed] = experiment
    for experiment in unsettled.values():
        settling = sum(SETTLING_TIMES) / experiment.bed.step
        steps += experiment.grain_steps * settling / experiment.n_steps
    return GrainSteps(round(steps), steps / RATE, BASE, steps / RATE)


def store_folder(given: Path | None) -> Path:
    """Return the folder of settled beds and runs: the one given, else that in the
    user's cache folder."""
    if given is not None:
        if not isinstance(given, (str, Path)):
            raise Refusal("``store`` must be the name of a folder", value=given)
        return Path(given)
    folder = cache_folder()
    if folder is None:
        raise Refusal(
            "there is no cache folder for beds of grains",
            instead="choose one with ``store``",
        )
    return folder / "grains"


@dataclass(frozen=True)
class DraggedRod:
    """A round rod that is dragged through beds of grains at several attack angles.

    length, radius (m): of the rod, from end to end. angles: between velocity and axis,
    degrees, 0 to 90. beds: their number, with seeds from ``seed`` on. speed (m/s).
    depth (m): of the axis below the surface, half of the bed's if None."""

    length: float
    radius: float
    angles: tuple[float, ...]
    beds: int
    speed: float
    depth: float | None
    seed: int
    bed: Bed = field(default_factory=Bed)

    @property
    def body(self) -> Spheres:
        return rod(self.length, self.radius)

    def experiments(self) -> list[Experiment]:
        """Return the experiments, bed by bed."""
        seconds = round(TRAVEL * self.radius / self.speed, 9)
        found = []
        for k in range(self.beds):
            bed = replace(self.bed, seed=self.seed + k)
            for psi in self.angles:
                tow = Tow(self.speed, math.radians(psi))
                found.append(Experiment(bed, self.body, tow, seconds, self.depth))
        return found

    def check(self) -> None:
        """Refuse sizes that make no sense, and beds without the engine of grains."""
        angles = list(self.angles)
        enough = len(set(angles)) >= 3
        require(enough, "a law needs three angles or more", value=angles)
        require(
            all(0 <= psi <= 90 for psi in angles),
            "angles must be 0 to 90 degrees",
            value=angles,
        )
        in_range("beds", self.beds, 1, 100, whole=True)
        require(is_whole(self.seed), "seed must be a whole number", value=self.seed)
        for name in ("length", "radius", "speed"):
            value = getattr(self, name)
            require(
                is_number(value) and 0 < value < math.inf,
                f"{name} must be a number above 0",
                value=value,
            )
        require(isinstance(self.bed, Bed), "bed must be Bed(...)", value=self.bed)
        require(
            self.length >= 20 * self.radius,
            "a rod must be at least ten times as long as it is wide",
            value=self.length,
        )
        for experiment in self.experiments()[: len(angles)]:
            experiment.check()
        require_lammps()

    def cost(self, store: Path) -> GrainSteps:
        return grain_cost(self.experiments(), store)

    def answer(self, store: Path, progress: Progress) -> Result:
        """Return the drag in every bed, its mean, and the law of the flank with the
        drag on the ends."""
        experiments = self.experiments()
        first_of_bed = experiments[:: len(self.angles)]
        n_tasks = len(first_of_bed) + len(experiments)
        seconds_each = grain_cost(experiments, store).seconds / n_tasks
        # Beds are settled first, as one run of an angle each in the progress.
        share = 1.0 / (1 + len(self.angles))

        def report_settling(done: float) -> None:
            progress(share * done)

        def report_drags(done: float) -> None:
            progress(share + (1 - share) * done)

        beds = runner().map(
            _settle,
            store,
            first_of_bed,
            len(first_of_bed),
            seconds_each * len(first_of_bed),
            report_settling,
        )
        packing, surface = np.array(list(beds)).mean(0)
        drags = runner().map(
            _drag,
            store,
            experiments,
            len(experiments),
            seconds_each * len(experiments),
            report_drags,
        )
        rows = np.array(list(drags)).reshape(self.beds, len(self.angles), -1)
        depth = float(surface - experiments[0].height)
        return self._result(float(packing), depth, rows)

    def _result(self, packing: float, depth: float, rows: np.ndarray) -> Result:
        """Return the result. packing, depth (m): means over beds. rows: (beds, angles,
        numbers of `_drag`)."""
        columns = np.moveaxis(rows, -1, 0)
        drags = Drag(
            columns[:2],
            columns[2:4],
            columns[4],
            columns[5:7],
            columns[7:9],
            columns[9],
        )
        overlap = float(columns[10].max())
        law = self.law(drags, packing, depth)
        facts = {
            "beds": self.beds,
            "grains": int(rows[0, 0, 12]),
            "lammps": int(rows[0, 0, 11]),
            "law": law.law,
            "drag_about": self.file_head(packing, depth, overlap, rows),
        }
        over = ("bed", "attack_angle")
        by_component = ("component", *over)
        in_time = "standard error over time"
        psi = np.tile(self.angles, self.beds)
        variables = [
            Variable("bed", ("bed",), self.seed + np.arange(self.beds), "1", "seed"),
            Variable(
                "attack_angle", ("attack_angle",), np.array(self.angles), "degrees"
            ),
            Variable(
                "flank", by_component, drags.flank, "N/m", "drag on the flank",
                drags.flank_error, error_label=in_time,
            ),
            Variable(
                "ends", by_component, drags.ends, "N", "drag on both ends in addition",
                drags.ends_error, error_label=in_time,
            ),
            Variable(
                "lift", over, drags.lift, "N", "lift of the whole rod",
                drags.lift_error, error_label=in_time,
            ),
        ]  # fmt: skip
        for variable in variables[2:]:
            variables.append(mean_over_beds(variable))
        variables += [
            Variable("rod_diameter", (), 2 * self.radius, "m"),
            Variable("speed", (), self.speed, "m/s", "speed of the rod"),
            Variable("packing", (), packing, "1", "mean over the beds"),
            Variable(
                "largest_overlap",
                (),
                overlap,
                "1",
                "largest overlap in grain diameters",
            ),
            *fit_variables(law, psi),
        ]
        return Result("drag_grains", tuple(variables), facts)

    def law(self, drags: Drag, packing: float, depth: float) -> Fit:
        """Return the granular law of the flank with e of the ends, fitted to all
        beds."""
        psi = np.tile(self.angles, self.beds)
        flank = self.length * drags.flank.reshape(2, -1)
        ends = drags.ends.reshape(2, -1)
        size = Rod(self.radius, self.length, depth, packing * self.bed.density)
        return fit("granular", rod_drag(psi, *flank, ends=ends), size, "fitted")

    def file_head(
        self, packing: float, depth: float, overlap: float, rows: np.ndarray
    ) -> str:
        """Return the head of a file of the drag. A fit of the medium reads its sizes
        from it."""
        bed = self.bed
        mm = 1e3  # per m
        walls = "walled" if bed.walled else "periodic"
        friction = f"friction {bed.friction:g}"
        if bed.settling_friction is not None:
            friction += f", settled with friction {bed.settling_friction:g}"
        lines = [
            "Drag on the flank of a rod, and on both its ends together beyond that, in "
            f"beds of grains (LAMMPS {int(rows[0, 0, 11])}, Hertz-Mindlin); mean after "
            f"{mm * UNSTEADY_TRAVEL * self.radius:g} mm of travel",
            f"grains {mm * bed.diameter:g} mm +-{100 * bed.spread:g} %, density "
            f"{bed.density:g} kg/m^3, packing {packing:.4f}; rod "
            f"{2 * mm * self.radius:g} mm diameter x {mm * self.length:g} mm, axis "
            f"{mm * depth:.2f} mm deep, {self.speed:g} m/s",
            f"young {bed.young:g} Pa, poisson {bed.poisson:g}, restitution "
            f"{bed.restitution:g}; {friction}, with the rod {bed.body_friction:g}, "
            f"with the floor {bed.floor_friction:g}",
            f"{int(rows[0, 0, 12])} grains in {mm * bed.length:g} mm by "
            f"{mm * bed.width:g} mm, {walls}; time step {1e6 * bed.step:.3g} us; "
            f"largest overlap {overlap:.3f} of a grain",
            "errors: standard errors in time",
        ]
        return "\n".join(lines)


def mean_over_beds(variable: Variable) -> Variable:
    """Return the mean of a drag over beds. Its error is the standard error of that
    mean, or the one in time where there is one bed."""
    axis = variable.dims.index("bed")
    beds = variable.values.shape[axis]
    if beds > 1:
        error = variable.values.std(axis, ddof=1) / np.sqrt(beds)
        error_label = "standard error over beds"
    else:
        error = variable.error.take(0, axis)
        error_label = variable.error_label
    return replace(
        variable,
        name=f"mean_{variable.name}",
        dims=tuple(name for name in variable.dims if name != "bed"),
        values=variable.values.mean(axis),
        label=f"{variable.label}, mean over the beds",
        error=error,
        error_label=error_label,
    )


def _settle(folder: Path, experiment: Experiment) -> list[float]:
    """Return packing and surface (m) of the bed of an experiment, settled where it is
    not in the folder."""
    bed = settle(experiment.bed, experiment.body, experiment.height, folder)
    return [bed.facts["packing"], bed.facts["surface"]]


def _drag(folder: Path, experiment: Experiment) -> list[float]:
    """Return the numbers of the `Drag` of an experiment, the largest overlap, LAMMPS's
    version and the number of grains."""
    run: Run = experiment.run(folder)
    tow = experiment.motion
    body = experiment.body
    drag = flank_and_ends(run, body.size, body.half_width, tow.angle, tow.speed)
    numbers = np.concatenate([np.atleast_1d(x) for x in drag]).tolist()
    return [
        *numbers,
        float(run.overlaps[:, 0].max()),
        float(run.facts["lammps"]),
        float(run.facts["grains"]),
    ]
