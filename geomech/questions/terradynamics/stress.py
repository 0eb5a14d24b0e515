"""The stress of grains on a plate, by a stress map."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.questions.shared import loading, names
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.results.numbers import number

HELP = "name (see 'geomech scenes'), TOML or CSV of plate drags"


@dataclass(frozen=True)
class Stress(Question):
    """Compute the stress of grains on a plate per unit depth. The stresses are
    backwards (alpha_x) and upwards (alpha_z), in N/cm^3, as in Fig. 7."""

    medium: Annotated[
        str, Subject(loading.as_typed, names.medium_names, (), "MEDIUM", HELP)
    ]
    beta: Annotated[
        float | None,
        Option("tilt of the plate in degrees (0 lies flat)", "ANGLE"),
    ] = None
    gamma: Annotated[
        float | None,
        Option("direction of motion, degrees below the horizontal", "ANGLE"),
    ] = None
    # Whether the map of all angles is computed, for pictures.
    drawn: bool = field(default=True, kw_only=True)

    name: ClassVar[str] = "stress"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "cmap")

    def inputs(self) -> list[Path]:
        return [Path(self.medium)]

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> Question:
        return replace(self, drawn=bool(paths))

    def for_picture(self, **options: Any) -> Question:
        return replace(self, drawn=True)

    def check(self) -> None:
        from geomech.studies.terradynamics import stress

        stress.check(self.beta, self.gamma, self.drawn)

    def compute(self, run: Run) -> Result:
        from geomech.studies.terradynamics import stress

        return stress.answer(self.medium, self.beta, self.gamma, self.drawn)

    @staticmethod
    def headline(result: Result) -> list[str]:
        parts = []
        for name in ("alpha_x", "alpha_z"):
            if name in result:
                v = result[name]
                value = number(float(v), digits=4)
                parts.append(f"{name} = {value} {v.unit}, {v.label}")
        about = result.attributes["description"]
        if not parts:
            return [about]
        return ["; ".join(parts), about]

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only()

    @staticmethod
    def draw(result: Result) -> Any:
        """Draw the stress map with the plate of the question; return the Figure."""
        from geomech import plots
        from geomech.studies.terradynamics import stress

        return plots.stress_figure(*stress.drawn(result))
