"""Newtons and watts: what turns forces in axial drags, moments and powers into SI units, where sizes are known.

The axial drag is that on the straight body along itself, stress x 2 radius x length. The stress of a named medium was
measured at one depth and grows in proportion to it (paper Eq. 2). In a fluid it is the drag at one body length per radian of
phase, and its stress must be given."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Annotated, NamedTuple

from geomech.scenes.model import Scene
from geomech.systems.base import body_size, length_unit
from geomech.systems.capabilities import Loaded
from rft.core.checks import Number, check_numbers
from rft.core.refusal import Refusal

UNITS = {  # power of the body's length in a unit of drag, BL and rad of phase; that unit in SI, with a frequency, without
    "drag": (0, "N", "N"),
    "drag/BL": (-1, "N/m", "N/m"),
    "drag x BL": (1, "N m", "N m"),
    "drag x BL/rad": (1, "W", "J/rad"),
    "drag/rad": (0, "W/m", "N/rad"),
}


@dataclass(frozen=True)
class Sizes:
    """Sizes of a body and its bed, for a scene that does not have them."""

    length: Annotated[float | None, Number(1e-9, 1e6, "m", "length of the body")] = None
    radius: Annotated[float | None, Number(1e-9, 1e6, "m", "radius of the body")] = None
    depth: Annotated[
        float | None, Number(1e-9, 1e6, "m", "depth of the body's axis")
    ] = None
    stress: Annotated[
        float | None,
        Number(1e-12, 1e12, "Pa", "axial drag over 2 radius x length, at that depth"),
    ] = None
    frequency: Annotated[
        float | None, Number(1e-12, 1e4, "Hz", "cycles per second")
    ] = None

    def __post_init__(self) -> None:
        check_numbers(self)


class Newtons(NamedTuple):
    """Axial drag of a body, N, its length, m, and frequency, Hz; None for what is unknown. how: the drag in words. lacks:
    sizes that would make it known."""

    drag: float | None
    length: float | None
    frequency: float | None
    how: str
    lacks: tuple[str, ...] = ()

    def convert(self, unit: str) -> tuple[float, str]:
        """Return the factor that a quantity in a unit of UNITS takes, and its unit in SI; 1 and the unit where the drag or
        the length is unknown."""
        if self.drag is None or self.length is None or unit not in UNITS:
            return 1.0, unit
        power, timed, untimed = UNITS[unit]
        factor = self.drag * self.length**power
        per_second = timed != untimed and self.frequency
        return (
            (factor * 2 * math.pi * self.frequency, timed)
            if per_second
            else (factor, untimed)
        )


def newtons(scene: Scene, system: Loaded, sizes: Sizes) -> Newtons:
    """Return the axial drag of a scene's body, from the scene and from sizes that it does not have. Refusal where the two
    contradict each other."""
    given = _merged(scene, sizes)
    effects = getattr(scene.system, "effects", ())
    drag = next((e.drag for e in effects if hasattr(e, "drag")), None)
    length, radius, depth = given["length"], given["radius"], given["depth"]
    stress, place = given["stress"], ""
    if stress is None and depth is not None:
        stress, place = system.axial_stress(depth), f" at a depth of {depth:g} m"
    if stress is not None and None not in (length, radius):
        how = f"stress {stress:.4g} Pa{place} x 2 x radius {radius:g} m x length {length:g} m"
        return Newtons(stress * 2 * radius * length, length, given["frequency"], how)
    if drag is not None and length is not None:
        return Newtons(
            float(drag), length, given["frequency"], "as the effect body-inertia has it"
        )
    lacks = [name for name in ("length", "radius") if given[name] is None]
    lacks += (
        []
        if stress is not None
        else ["depth" if system.axial_stress(1.0) else "stress"]
    )
    return Newtons(None, length, given["frequency"], "unknown in N", tuple(lacks))


def _merged(scene: Scene, sizes: Sizes) -> dict[str, float | None]:
    """Return the sizes in the scene and those given besides, by name; None for what neither has."""
    effects = getattr(scene.system, "effects", ())
    of_effects = lambda name: next(
        (getattr(e, name) for e in effects if hasattr(e, name)), None
    )
    length = (
        body_size(scene.system)
        if length_unit(scene.system) == "m"
        else of_effects("length")
    )
    caps = next((e for e in effects if e.kind == "end-caps"), None)
    radius = None if caps is None else caps.radius_m
    known = sizes.length if length is None else length
    if caps is not None and radius is None and known is not None:
        radius = caps.radius * known
    own = {
        "length": length,
        "radius": radius,
        "depth": of_effects("depth"),
        "frequency": scene.frequency,
    }
    for name, value in asdict(sizes).items():
        if None not in (value, own.get(name)) and not math.isclose(
            value, own[name], rel_tol=1e-6
        ):
            raise Refusal(
                f"``{name}`` is {value:g}, but the scene has {own[name]:g}",
                instead=f"drop ``{name}``",
            )
    return {
        name: value if own.get(name) is None else own[name]
        for name, value in asdict(sizes).items()
    }
