"""The best gait of a scene for an objective, as a question."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from geomech.core.variables import Result, Variable
from geomech.geometry.symmetry import zero_components
from geomech.optimisation.limits import LimitsArgument
from geomech.optimisation.optimum import Optimum
from geomech.optimisation.request import Request, checked
from geomech.optimisation.search import search
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.effort import units, why_none
from geomech.studies.question import Allow, Progress, Question
from geomech.systems.base import length_unit
from rft.refusal import Refusal


@dataclass(frozen=True)
class Optimize(Question):
    """The best gait of a scene, see `optimise`. drawn: on its CCF, where that is a map; stretch: on the same map also in
    coordinates where equal lengths take equal effort."""

    scene: Scene
    objective: str
    direction: str | None = None
    harmonics: int | None = None
    limits: LimitsArgument = None
    starts: int | None = None
    rate: float | None = None
    power: float | None = None
    drawn: bool = False
    stretch: bool = False

    @property
    def title(self) -> str:
        return f"{self.objective} of {self.scene.name}"

    @cached_property
    def request(self) -> Request:
        return checked(
            self.scene,
            self.objective,
            self.direction,
            self.harmonics,
            self.limits,
            self.starts,
            self.rate,
            self.power,
        )

    def check(self) -> None:
        _ = self.request  # refuses what makes no sense
        name, joints = self.scene.name, self.scene.system.joints
        if self.stretch and joints != 2:
            raise Refusal(
                f"``stretch`` takes two joints, this one has {joints}",
                where=name,
                instead="drop it",
            )
        if self.stretch and (reason := why_none(self.scene.system)):
            raise Refusal(reason, where=name, instead="drop ``stretch``")

    def cost(self) -> Cost:
        return self.request.cost()

    def answer(self, progress: Progress, allow: Allow) -> Result:
        optimum = search(self.request, progress)
        if self.drawn and self.scene.system.joints == 2:
            _ = (optimum.gained, self.stretch and optimum.stretched)
        return result_of(optimum)


def result_of(optimum: Optimum) -> Result:
    """Return an optimum as variables; the value of a distance is over the body's length, the displacement is not."""
    best, objective, unit = (
        optimum.best,
        optimum.request.objective,
        length_unit(optimum.scene.system),
    )
    of_effort = units(optimum.scene.system)
    value_unit = (
        of_effort[objective.name] if objective.name == "efficiency" else objective.unit
    )
    variables = [
        Variable("value", (), best.value, value_unit, objective.name, best.error),
        Variable(
            "start_value",
            (),
            optimum.start.value,
            value_unit,
            f"{objective.name} of the scene's gait",
            optimum.start.error,
        ),
    ]
    for name, x, u in zip(("x", "y", "theta"), best.displacement, (unit, unit, "rad")):
        variables.append(Variable(name, (), x, u, "net displacement per cycle"))
    for name, x in (("path_length", best.length), ("work", best.work)):
        variables += (
            [] if x is None else [Variable(name, (), x, of_effort.get(name, ""))]
        )
    zero = [*zero_components(optimum.scene.system.traits, optimum.gait)]
    facts = {
        "active": optimum.active,
        "evaluations": optimum.evaluations,
        "zero_by_symmetry": zero,
    }
    return Result("optimum", tuple(variables), facts, optimum)
