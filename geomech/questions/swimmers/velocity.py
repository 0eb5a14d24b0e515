"""The body velocity at one shape, for one rate of change of shape."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from geomech.core.variables import Result
from geomech.questions.shared import loading, names, parsing, tools
from geomech.questions.shared.base import Option, Question, Run, Subject
from rft.core.refusal import located

if TYPE_CHECKING:
    from geomech.scenes.model import Scene


@dataclass(frozen=True)
class Velocity(Question):
    """Compute the body velocity of one shape and its rate. The result includes the
    residual and the status of the force balance."""

    scene: Annotated["Scene", Subject(loading.load_with_gait, names.scene_names)]
    alpha: Annotated[
        tuple[float, ...],
        Option(
            "joint angles in rad, such as 0.5,0.3 or 30deg,20deg",
            "ANGLES",
            parsing.angles,
        ),
    ]
    alphadot: Annotated[
        tuple[float, ...],
        Option(
            "joint rates in rad per unit of time, such as 1,0", "RATES", parsing.angles
        ),
    ]

    name: ClassVar[str] = "velocity"

    def __post_init__(self) -> None:
        self._set(
            alpha=tools.as_numbers(self.alpha), alphadot=tools.as_numbers(self.alphadot)
        )

    def compute(self, run: Run) -> Result:
        from geomech.studies.mechanics.single import velocity

        with located(self.scene.name):
            found = velocity(self.scene.system, self.alpha, self.alphadot)
        return Result("velocity", (tools.component(), *found))

    @staticmethod
    def headline(result: Result) -> list[str]:
        return [f"{result.attributes['scene']}: body velocity xi per unit of time"]
