"""Stress of the grains on a plate, by a stress map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.scenes.stress import medium as load_medium
from geomech.studies.question import Allow, Progress, Question
from rft.plates import survey
from rft.refusal import Refusal

LARGEST_ANGLE = 1e6  # degrees


@dataclass(frozen=True)
class Stress(Question):
    """Stress per unit depth at one tilt and direction, degrees, or, for a picture, over all of them."""

    medium: str
    beta: float | None = None
    gamma: float | None = None
    drawn: bool = False

    def inputs(self) -> list[Path]:
        return [Path(self.medium)]

    def check(self) -> None:
        if (self.beta is None) != (self.gamma is None) or (
            self.beta is None and not self.drawn
        ):
            raise Refusal(
                "give both ``beta`` and ``gamma``, in degrees, or ``drawn`` for all angles"
            )
        if not all(
            x is None or abs(x) <= LARGEST_ANGLE for x in (self.beta, self.gamma)
        ):
            raise Refusal(
                "``beta`` and ``gamma`` must be finite angles in degrees, of at most 1e6"
            )

    def answer(self, progress: Progress, allow: Allow) -> Result:
        law = load_medium(self.medium)
        overview = survey(law)
        description = f"{self.medium} {overview.description()}" + (
            ", which is cut" if law.tension == "cut" else ""
        )
        facts, angles = (
            {
                "description": description,
                "notes": [description] if overview.pushing else [],
            },
            None,
        )
        if self.beta is None:
            variables = [
                Variable(name, (), getattr(overview, name), "1")
                for name in ("pulling", "pushing")
            ]
        else:
            angles = self.beta, self.gamma
            values = [
                np.round(float(x), 12) + 0.0 for x in law(*map(math.radians, angles))
            ]
            labels = "against the motion's x", "upwards"
            names = "alpha_x", "alpha_z"
            variables = [
                Variable(*x, "N/cm^3", label)
                for *x, label in zip(names, ((), ()), values, labels)
            ]
        return Result("stress", tuple(variables), facts, (overview, angles))
