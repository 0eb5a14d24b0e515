"""Sizes that a scene file gives once for all parts that have them: [physical], the
frame and the frequency."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from geomech.core.errors import choose
from rft.core.refusal import Refusal

# Kinds of parts with a size of that name which is not the body's, by key.
NOT_OF_THE_BODY = {
    "radius": ("disturbed-ground",),  # of its track
    "radius_m": ("disturbed-ground",),
}


@dataclasses.dataclass(frozen=True)
class Physical:
    """Sizes that the body and the effects share, given once for all of them.

    length (m): length of the body. frequency (1/s): cycles per second. mass (kg): mass
    of the body. radius (body lengths): radius of the body. radius_m (m): radius of a
    body with a length, instead of radius.
    """

    length: float | None = None
    frequency: float | None = None
    mass: float | None = None
    radius: float | None = None
    radius_m: float | None = None


class Sizes:
    """Values that apply to the whole scene: [physical], the frame, and the frequency,
    which may also stand in [gait].

    name: of the scene. values: by key. places: where each stands, for a Refusal.
    unused: keys that no part has so far."""

    def __init__(self, name: str, tables: Mapping):
        self.name = name
        physical = tables.get("physical", {})
        for key in physical:
            choose(f"{name}: [physical] key", key, Physical.__dataclass_fields__)
        self.values = dict(physical)
        self.unused = {*physical}
        self.places = {key: f"[physical] {key}" for key in physical}
        self.places["frame"] = "the scene's frame"
        frame = tables.get("frame")
        if frame is not None:
            self.values["frame"] = frame
            self.unused.add("frame")
        frequency = tables["gait"].get("frequency")
        if frequency is not None:
            self._check(f"{name}: [gait]", "frequency", frequency)
            self.values["frequency"] = frequency
            self.places["frequency"] = "[gait] frequency"

    def _check(self, place: str, key: str, value: Any) -> None:
        """Raise Refusal if a value at a place contradicts that of the whole scene."""
        given = self.values.get(key, value)
        # A nan, which differs from itself, is refused by the bounds of its own section.
        if given is not value and given != value:
            raise Refusal(
                f"{key} = {value!r}, but {self.places[key]} = {given!r}",
                where=place,
                instead="keep one of them",
            )

    def fill(self, place: str, table: dict, kind: type) -> dict:
        """Return the table of a part with the values that its class has; Refusal if the
        table contradicts them."""
        fields = {field.name for field in dataclasses.fields(kind)}
        name = getattr(kind, "kind", "")
        for key, value in self.values.items():
            if key not in fields or name in NOT_OF_THE_BODY.get(key, ()):
                continue
            self.unused.discard(key)
            self._check(place, key, table.get(key, value))
            table = {**table, key: value}
        return table

    def check_all_used(self) -> None:
        """Raise Refusal for a value that no part of the scene has."""
        if self.unused:
            key = sorted(self.unused)[0]
            raise Refusal(
                key if key == "frame" else f"[physical] {key}",
                where=self.name,
                because="no part of this scene uses it",
                instead="remove it, or add a part that uses it",
            )
