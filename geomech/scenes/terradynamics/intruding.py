"""The base of scenes of bodies, outlines or meshes, that move through grains in a
prescribed way."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from rft.core.checks import check_numbers
from rft.core.refusal import Refusal, located
from rft.terradynamics.ground import GroundEffect, checked_effects, weight


class Intruding:
    """A scene of a body that moves through grains in a prescribed way.

    parts: name of the body's parts, in the plural. finer: factors of refinement that
    yield the error. field_types: {field: (class, what to give instead)}. per_part: s
    for a part at a pose, measured."""

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
        """Raise Refusal for fields of wrong types, and check the effects."""
        text = (str, "text")
        field_types = {**self.field_types, "name": text, "text": text}
        for name, (kind, example) in field_types.items():
            value = getattr(self, name)
            if not isinstance(value, kind):
                raise Refusal(f"{name} must be {example}", value=value)
        check_files(self.files)
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
        """Return forces (T, 2 or 3), N, with the weights of effects. Their columns are
        x and z, or x, y and z."""
        x, z = weight(self.effects)
        if not (x or z):
            return force
        added = np.zeros(force.shape[1])
        added[0] = x
        added[-1] = z
        return force + added


def check_files(files: Any) -> None:
    """Raise Refusal unless the files of a scene are a tuple of names."""
    if not isinstance(files, tuple) or not all(isinstance(x, str) for x in files):
        raise Refusal("files must be a tuple of names", value=files)
