"""The motion of a body through its gait: pose, shape and ends of the links at every
phase; as a film or a strip of pictures, too."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import POSE, Result
from geomech.questions.shared import loading, names
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.tools import FILMS, check_films, is_film
from geomech.runs.cost import Cost

if TYPE_CHECKING:
    from geomech.scenes.model import Scene

FINAL = ("final_x", "final_y", "final_heading")
CYCLES_OF_FILM = 3  # by default
WITHOUT_MAP = (".csv", ".txt")  # files from which nothing is drawn


def write_film(path: Path, result: Result) -> None:
    """Write a film of the motion."""
    from geomech.plots import films

    films.write_motion(path, result)


def contact_remarks(result: Result) -> list[str]:
    """Return the outcome on a slope, and how often a body of which parts are lifted
    would tip over."""
    lines = []
    outcome = result.attributes.get("outcome")
    if outcome is not None:
        from geomech.studies.mechanics.outcome import OUTCOMES

        lines.append(f"{outcome}: {OUTCOMES[outcome]}")
    if "support_margin" in result:
        margin = result["support_margin"].values
        beyond = int((margin < 0).sum())
        if beyond:
            lines.append(
                f"the centre of mass lies beyond what touches the ground at {beyond} "
                f"of {len(margin)} phases"
            )
    return lines


@dataclass(frozen=True)
class Trajectory(Question):
    """Follow the body through its gait. A table has the pose, the joint angles and the
    ends of all links at every phase. A film (-o FILE.gif) or a strip of pictures
    (--plot) shows the body on its track next to its shape on the CCF."""

    scene: Annotated["Scene", Subject(loading.load_scene, names.scene_names)]
    cycles: Annotated[
        int | None,
        Option("cycles of the gait (default 1, in a film 3)", "N"),
    ] = None
    # Whether the CCF is computed, on which pictures show the shape; whether a film is
    # drawn, whose cost counts.
    mapped: bool = field(default=True, kw_only=True)
    filmed: bool = field(default=False, kw_only=True, compare=False)

    name: ClassVar[str] = "trajectory"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    table: ClassVar[tuple[str, ...]] = ("phase",)

    @property
    def title(self) -> str:
        return f"motion of {self.scene.name}"

    @property
    def count(self) -> int:
        """The number of cycles."""
        if self.cycles is None:
            return 1
        return self.cycles

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> Question:
        check_films(paths)
        drawn = [path for path in paths if path.suffix.lower() not in WITHOUT_MAP]
        filmed = any(map(is_film, paths))
        cycles = self.cycles
        if filmed and cycles is None:
            cycles = CYCLES_OF_FILM
        return replace(self, cycles=cycles, mapped=bool(drawn), filmed=filmed)

    def for_picture(self, **options: Any) -> Question:
        return replace(self, mapped=True)

    def check(self) -> None:
        from geomech.studies.mechanics import motion

        motion.refuse_cycles(self.count)

    def cost(self) -> Cost:
        from geomech.studies.mechanics import motion

        cost = motion.cost(self.scene, self.count, self.mapped)
        if not self.filmed:
            return cost
        from geomech.plots import films

        phases = self.scene.numerics.phases
        frequency = motion.frequency_of(self.scene)
        return motion.summed([cost, films.cost(phases, self.count, frequency)])

    def compute(self, run: Run) -> Result:
        from geomech.studies.mechanics import motion

        tables = run.tables_of(self.scene)
        return motion.answer(tables, self.count, self.mapped, run.shown_progress)

    @staticmethod
    def files() -> dict[str, Any]:
        return dict.fromkeys(FILMS, write_film)

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        count = facts["cycles"]
        cycles = "1 cycle"
        if count > 1:
            cycles = f"{count} cycles"
        return [
            f"{facts['scene']}: motion of the frame {facts['frame']} over {cycles}",
            "x ahead, y to the left, along the frame at phase 0",
        ]

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only(*FINAL, "final_uphill", "actuator_work", "time", *POSE)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        lines = contact_remarks(result)
        if "limit_cycle" not in result:
            return lines
        count = len(result["limit_cycle"].values)
        if count > 1:
            x = result["cycle_x"].values
            lines.append(
                f"from four starts the shape settles into {count} different cycles, "
                f"with x from {x.min():.4g} to {x.max():.4g} {result['x'].units}; this "
                "is the one from the command's shape"
            )
        unsettled = int(result["unsettled_starts"].values)
        if unsettled:
            lines.append(f"from {unsettled} of four starts no cycle is reached")
        ambiguous = int(result["ambiguous_steps"].values)
        if ambiguous:
            lines.append(
                f"the balance of {ambiguous} steps has more solutions than the one "
                "taken"
            )
        return lines

    @staticmethod
    def draw(result: Result, *, pictures: int = 6) -> Any:
        """Draw the body at some phases and its shapes beside it; return the Figure.

        pictures: how many."""
        from geomech import plots

        return plots.filmstrip(result, pictures)
