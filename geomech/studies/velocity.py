"""The body velocity at one shape, for one rate of change of shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.scenes.model import Scene
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.single import single
from geomech.systems.base import length_unit
from rft.refusal import located


@dataclass(frozen=True)
class Velocity(Question):
    """Body velocity xi at a shape, with its residual and status."""

    scene: Scene
    alpha: tuple[float, ...]
    alphadot: tuple[float, ...]

    def answer(self, progress: Progress, allow: Allow) -> Result:
        with located(self.scene.name):
            solution = single(self.scene.system, self.alpha, self.alphadot)
        unit = length_unit(self.scene.system)
        xi = Variable(
            "xi",
            ("component",),
            np.array(solution["xi"]),
            f"{unit}, {unit}, rad",
            "per unit time",
        )
        return Result(
            "velocity",
            (xi,),
            {"found": solution, "units": {"xi": [unit, unit, "rad"]}},
            self.scene,
        )
