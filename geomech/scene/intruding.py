"""The base of scenes of bodies that move through grains in a prescribed way, of outlines and of meshes."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from geomech.core.summary import part
from rft.checks import check_numbers
from rft.ground import GROUND_EFFECTS, GroundEffect, checked_effects, weight
from rft.premise import negated
from rft.refusal import Refusal, located


class Intruding:
    """Base of such scenes. parts: name of the body's parts, in the plural. finer: factors of refinement that yield the
    error. field_types: {field: (class, what to give instead)}. per_part: s for a part at a pose, measured."""

    parts = "parts"
    finer: tuple[int, ...] = (2,)
    field_types: Mapping[str, tuple[type, str]] = {}
    per_part = 0.0
    example: ClassVar[str] = "c-leg"
    effects: tuple[GroundEffect, ...]
    files: tuple[str, ...]

    def _check(self) -> None:
        """Raise Refusal for fields of wrong types."""
        for name, (kind, example) in {**self.field_types, "name": (str, "text"), "text": (str, "text")}.items():
            if not isinstance(getattr(self, name), kind):
                raise Refusal(f"{name} must be {example}", value=getattr(self, name))
        if not (isinstance(self.files, tuple) and all(isinstance(x, str) for x in self.files)):
            raise Refusal("files must be a tuple of names", value=self.files)
        check_numbers(self)
        with located("[[effects]]"):
            object.__setattr__(self, "effects", checked_effects(self.effects))

    @property
    def count(self) -> int:
        """Number of the body's parts."""
        raise NotImplementedError

    def actual_count(self, count: int) -> int:
        """Return the number of parts of the body when ``count`` are requested."""
        raise NotImplementedError

    @property
    def ladder(self) -> tuple[int, ...]:
        """Numbers of parts for a study of refinement; the last counts as the truth."""
        raise NotImplementedError

    @property
    def size(self) -> float:
        """The body's largest extent, m."""
        raise NotImplementedError

    @property
    def order(self) -> int:
        """Order of the error in 1 / parts."""
        raise NotImplementedError

    def changed(self, **parts) -> Intruding:
        """Return the scene with other parts."""
        return dataclasses.replace(self, **parts)

    def description(self) -> list[str]:
        """Return lines about the law, the body and its motion, and which effects are on and off."""
        medium, body, motion = (part(type(x).__name__, x) for x in (self.medium, self.intruder, self.motion))
        lines = [f"{self.name}: {body} of {self.count:,} {self.parts}", f"motion: {motion}", f"medium: {medium}"]
        lines += self.effects_description()
        inactive = [kind for kind in GROUND_EFFECTS if kind not in [e.kind for e in self.effects]]
        return [*lines, "off, not evaluated: " + (", ".join(inactive) or "none")]

    def effects_description(self) -> list[str]:
        """Return a line for each effect, and one more for its assumptions."""
        return describe_effects(self.effects)

    def weighed(self, force: np.ndarray) -> np.ndarray:
        """Return forces (T, k) along x, (y,) z with those of effects that are not the grains'."""
        x, z = weight(self.effects)
        if not (x or z):
            return force
        return force + np.array([x, *[0.0] * (force.shape[1] - 2), z])


def describe_effects(effects) -> list[str]:
    """Return a line for each effect on the ground, and one more for its assumptions."""
    lines = []
    for effect in effects:
        lines.append(
            f"on:  {part(effect.kind, effect)}; {negated(effect.breaks) or 'keeps every premise'}; costs {effect.cost}; "
            f"gone at {effect.limit}, order {effect.order}"
        )
        if effect.assumes:
            lines.append(f"     assumes {effect.assumes}")
    return lines
