"""Sizes that a scene file gives once for all parts that have them: [physical], the frame and the frequency."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from geomech.core.errors import choose
from rft.core.refusal import Refusal

OF_THE_TRACK = ("disturbed-ground",)
NOT_OF_THE_BODY = {"radius": OF_THE_TRACK, "radius_m": OF_THE_TRACK}


@dataclasses.dataclass(frozen=True)
class Physical:
    """Sizes that a body and its effects share, given once for all that have them.

    length (m): of the body. frequency (1/s): cycles per second. mass (kg): of the body. radius (body lengths): of the body.
    radius_m (m): of a body with a length, in place of radius.
    """

    length: float | None = None
    frequency: float | None = None
    mass: float | None = None
    radius: float | None = None
    radius_m: float | None = None


class Sizes:
    """Values that apply to the whole scene: [physical], the frame, and the frequency, which may stand in [gait] as
    well."""

    def __init__(self, name: str, tables: Mapping):
        physical, frame, frequency = (
            tables.get("physical", {}),
            tables.get("frame"),
            tables["gait"].get("frequency"),
        )
        for key in physical:
            choose(f"{name}: [physical] key", key, Physical.__dataclass_fields__)
        self.name, self.given, self.unused = name, dict(physical), {*physical}
        self.places = {key: f"[physical] {key}" for key in physical} | {
            "frame": "the scene's frame"
        }
        if frame is not None:
            self.given["frame"] = frame
            self.unused.add("frame")
        if frequency is not None:
            self._check(f"{name}: [gait]", "frequency", frequency)
            self.given["frequency"], self.places["frequency"] = (
                frequency,
                "[gait] frequency",
            )

    def _check(self, place: str, key: str, value) -> None:
        given = self.given.get(key, value)
        if (
            given is not value and given != value
        ):  # a nan is left to the bounds of its own section
            raise Refusal(
                f"{key} = {value!r}, but {self.places[key]} = {self.given[key]!r}",
                where=place,
                instead="keep one",
            )

    def fill(self, place: str, table: dict, kind: type) -> dict:
        """Return the table with the sizes that its class has; Refusal if the table contradicts them."""
        names = [f.name for f in dataclasses.fields(kind)]
        for key, value in self.given.items():
            if key not in names or getattr(kind, "kind", "") in NOT_OF_THE_BODY.get(
                key, ()
            ):
                continue
            self.unused.discard(key)
            self._check(place, key, table.get(key, value))
            table = {**table, key: value}
        return table

    def all_used(self) -> None:
        if self.unused:
            key = sorted(self.unused)[0]
            place = "" if key == "frame" else "[physical] "
            raise Refusal(
                f"{place}{key}",
                where=self.name,
                because="nothing in this scene has one",
                instead="drop it, or add what has",
            )
