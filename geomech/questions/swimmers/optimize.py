"""The best gait of a scene for an objective."""

import textwrap
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.io.files import write_text
from geomech.questions.shared import loading, names, parsing
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.common import ColourLimit
from geomech.results.show import scalar
from geomech.runs.cost import Cost
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene
    from geomech.studies.optimisation.request import Request

SHOWN = ("x", "y", "heading", "path_length", "work", "frequency")
ANSWERS = ("answer", "answer_value", "answer_starts", "answer_how")
COMMENT_WIDTH = 86  # characters of a line above the scene
BETTER = 1e-12  # relative difference from which on a value is better


def write_scene(path: Path, result: Result) -> None:
    """Write the scene with the best gait, behind a comment with its value."""
    if "best_scene_toml" not in result.attributes:
        raise Refusal(
            "the scene has parts that a file cannot name",
            instead="write the result in another format, such as .nc",
        )
    first, second, *_ = Optimize.headline(result)
    about = textwrap.wrap(f"{first} ({second})", COMMENT_WIDTH)
    comment = "".join(f"# {line}\n" for line in about)
    write_text(path, f"{comment}\n{result.attributes['best_scene_toml']}")


@dataclass(frozen=True)
class Optimize(Question):
    """Find the best gait for an objective. Its value has an estimated error; -o
    FILE.toml writes the gait as a scene, and --plot draws its loop on the CCF."""

    scene: Annotated["Scene", Subject(loading.load_scene, names.scene_names)]
    objective: Annotated[
        str, Option("displacement (default), efficiency, turning or speed", "NAME")
    ] = "displacement"
    direction: Annotated[
        str | None, Option("direction of the displacement, x or y of the body", "x|y")
    ] = None
    harmonics: Annotated[
        int | None, Option("harmonics of the Fourier series (default 5)", "N")
    ] = None
    limits: Annotated[
        Any,
        Option(
            "joint limits: 2.5, 120deg, -0.5:2, or 1,2 for each joint",
            "ANGLES",
            parsing.joint_limits,
        ),
    ] = None
    starts: Annotated[
        int | None,
        Option("number of starts (default 9 in dry media, otherwise 1)", "N"),
    ] = None
    rate: Annotated[
        float | None, Option("largest joint rate in rad/s, for speed", "RATE")
    ] = None
    power: Annotated[
        float | None, Option("largest mean power in drag x BL/s, for speed", "POWER")
    ] = None
    # For pictures: whether the CCF that the gait gains is computed, and the stretched
    # one.
    mapped: bool = field(default=True, kw_only=True, compare=False)
    stretched: bool = field(default=False, kw_only=True, compare=False)

    name: ClassVar[str] = "optimize"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    parallel: ClassVar[bool] = True

    @property
    def title(self) -> str:
        return f"{self.objective} of {self.scene.name}"

    @cached_property
    def request(self) -> "Request":
        from geomech.studies.optimisation.request import build_request

        return build_request(
            self.scene,
            self.objective,
            self.direction,
            self.harmonics,
            self.limits,
            self.starts,
            self.rate,
            self.power,
        )

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> Question:
        results = [path for path in paths if path.suffix != ".toml"]
        return replace(self, mapped=bool(results))

    def for_picture(self, stretch: bool = False, **options: Any) -> Question:
        return replace(self, mapped=True, stretched=stretch)

    def check(self) -> None:
        from geomech.studies.optimisation.variables import check_stretch

        _ = self.request  # refuses what makes no sense
        if self.stretched:
            check_stretch(self.scene)

    def cost(self) -> Cost:
        return self.request.cost()

    def compute(self, run: Run) -> Result:
        from geomech.studies.estimates.effort import units
        from geomech.studies.maps.fields import stretch_variables
        from geomech.studies.optimisation import search, variables

        optimum = search(self.request, run.progress)
        found = variables.variables(optimum)
        facts = variables.attributes(optimum)
        if self.mapped:
            of_ccf, about = variables.gained(optimum)
            found += [*variables.loop(optimum), *of_ccf]
            facts.update(about)
        if self.stretched:
            unit = units(self.scene.system)["path_length"]
            found += stretch_variables(optimum.stretched, unit)
        return Result("optimize", tuple(found), facts)

    @staticmethod
    def files() -> dict[str, Any]:
        return {".toml": write_scene}

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        value = result["value"]
        objective = facts["objective"]
        if "direction" in facts:
            objective = f"{objective} along {facts['direction']}"
        lines = [
            f"{facts['scene']}: best {objective} {scalar(value)}",
            f"the scene's gait: {scalar(result['start_value'])}",
        ]
        if float(value) <= float(result["start_value"]) * (1 + BETTER):
            lines.append("no better gait than the scene's own was found")
        return lines

    @staticmethod
    def summary(result: Result) -> Result:
        shown: tuple[str, ...] = SHOWN
        if result.attributes["starts"] > 1:
            shown = (*SHOWN, *ANSWERS)
        return result.only(*shown)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        facts = result.attributes
        lines = []
        if "largest_rate" in facts:
            rate = facts["largest_rate"]
            lines.append(f"joint rates up to {rate:.6g} rad/s")
        if "largest_power" in facts:
            power = facts["largest_power"]
            lines.append(f"mean power up to {power:g} drag x BL/s")
        touched = "none"
        if "limit_touched" in result:
            touched = ", ".join(result["limit_touched"].values.tolist())
        cycles = int(result["evaluations"].values)
        seconds = float(result["seconds"])
        return [
            *lines,
            f"limits reached: {touched}",
            f"{cycles} cycles evaluated in {seconds:.2g} s",
        ]

    @staticmethod
    def draw(
        result: Result,
        *,
        stretch: Annotated[
            bool, Option("also draw it stretched to equal effort")
        ] = False,
        clim: ColourLimit = None,
    ) -> Any:
        """Draw the loop on the CCF that it gains from, and its joint angles; return the
        Figure."""
        from geomech import plots

        if "loop" not in result:
            raise Refusal("its loop was not computed", instead="say ``mapped``")
        if stretch and "stretched_shape" not in result:
            raise Refusal(
                "the stretched shape space was not computed",
                instead="say ``stretched``",
            )
        return plots.optimum_figure(result, clim=clim)
