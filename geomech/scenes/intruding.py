"""The base of scenes of bodies that move through grains in a prescribed way, of outlines and of meshes."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from rft.core.checks import check_numbers
from rft.core.refusal import Refusal, located
from rft.terradynamics.ground import GroundEffect, checked_effects, weight


class Intruding:
    """Base of such scenes. parts: name of the body's parts, in the plural. finer: factors of refinement that yield the
    error. field_types: {field: (class, what to give instead)}. per_part: s for a part at a pose, measured."""

    parts = "parts"
    finer: tuple[int, ...] = (2,)
    field_types: Mapping[str, tuple[type, str]] = {}
    per_part = 0.0
    example: ClassVar[str] = "c-leg"
    effects: tuple[GroundEffect, ...]
    name: str
    text: str
    files: tuple[str, ...]

    def _check(self) -> None:
        """Raise Refusal for fields of wrong types."""
        for name, (kind, example) in {
            **self.field_types,
            "name": (str, "text"),
            "text": (str, "text"),
        }.items():
            if not isinstance(getattr(self, name), kind):
                raise Refusal(f"{name} must be {example}", value=getattr(self, name))
        if not (
            isinstance(self.files, tuple)
            and all(isinstance(x, str) for x in self.files)
        ):
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

    def changed(self: Any, **parts: Any) -> Any:
        """Return the scene with other parts."""
        return dataclasses.replace(self, **parts)

    def weighed(self, force: np.ndarray) -> np.ndarray:
        """Return forces (T, k) along x, (y,) z with those of effects that are not the grains'."""
        x, z = weight(self.effects)
        if not (x or z):
            return force
        return force + np.array([x, *[0.0] * (force.shape[1] - 2), z])
