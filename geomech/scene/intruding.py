"""What scenes of bodies that move in a prescribed way through grains have in common, of outlines and of meshes."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from rft.checks import check_numbers
from rft.ground import GroundEffect, checked_effects, weight
from rft.refusal import Refusal, located


class Intruding:
    """Base of such scenes. parts: what the body is made of, in the plural. finer: times as many, that tell
    the error. takes: {field: (class, what to give instead)}. per_part: s for a part at a pose, measured."""

    parts = "parts"
    finer: tuple[int, ...] = (2,)
    takes: Mapping[str, tuple[type, str]] = {}
    per_part = 0.0
    example: ClassVar[str] = "c-leg"
    effects: tuple[GroundEffect, ...]
    files: tuple[str, ...]

    def _check(self) -> None:
        """ValueError for fields of wrong types."""
        for what, (kind, such) in {**self.takes, "name": (str, "text"), "text": (str, "text")}.items():
            if not isinstance(getattr(self, what), kind):
                raise Refusal(f"{what} must be {such}", value=getattr(self, what))
        if not (isinstance(self.files, tuple) and all(isinstance(x, str) for x in self.files)):
            raise Refusal("files must be a tuple of names", value=self.files)
        check_numbers(self)
        with located("[[effects]]"):
            object.__setattr__(self, "effects", checked_effects(self.effects))

    @property
    def count(self) -> int:
        """Of the body's parts."""
        raise NotImplementedError

    def used(self, count: int) -> int:
        """Of the parts that it has where so many are asked for."""
        raise NotImplementedError

    @property
    def ladder(self) -> tuple[int, ...]:
        """Numbers of parts to ask for where one asks how many are enough; the last is the truth."""
        raise NotImplementedError

    @property
    def size(self) -> float:
        """The body's largest, m."""
        raise NotImplementedError

    @property
    def order(self) -> int:
        """Of the error, in 1 / parts."""
        raise NotImplementedError

    def changed(self, **parts) -> Intruding:
        """The scene with other parts."""
        return dataclasses.replace(self, **parts)

    def weighed(self, force: np.ndarray) -> np.ndarray:
        """Forces (T, k) along x, (y,) z with those that are not the grains'."""
        x, z = weight(self.effects)
        if not (x or z):
            return force
        return force + np.array([x, *[0.0] * (force.shape[1] - 2), z])
