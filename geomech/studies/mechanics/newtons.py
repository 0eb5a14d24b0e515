"""Newtons and watts: the factors that turn forces in axial drags, moments and powers
into SI units, where sizes are known.

The axial drag is the drag on the straight body along itself: stress x 2 radius x
length.
The stress of a named medium was measured at one depth and grows in proportion to it
(paper Eq. 2). In a fluid the axial drag is the one at one body length per radian of
phase, and its stress must be given."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Annotated, Any, NamedTuple

from geomech.mathematics.systems.base import body_size, length_unit
from geomech.mathematics.systems.capabilities import Loaded
from geomech.scenes.model import Scene
from rft.core.checks import Number, check_numbers
from rft.core.refusal import Refusal

# Units of drag, BL and rad of phase: the power of the body's length in each; the unit
# in SI with a frequency; the unit in SI without one.
UNITS = {
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


class ForceUnit(NamedTuple):
    """Axial drag of a body, N, its length, m, and frequency, Hz; None for an unknown
    one. source: of the drag, in words. missing: sizes that would make it known."""

    drag: float | None
    length: float | None
    frequency: float | None
    source: str
    missing: tuple[str, ...] = ()

    def convert(self, unit: str) -> tuple[float, str]:
        """Return the factor that turns a quantity in a unit of UNITS into SI, and the
        SI unit; 1 and the unit itself where the drag or the length is unknown."""
        if self.drag is None or self.length is None or unit not in UNITS:
            return 1.0, unit
        power, unit_with_frequency, plain_unit = UNITS[unit]
        factor = self.drag * self.length**power
        if unit_with_frequency != plain_unit and self.frequency:
            return factor * 2 * math.pi * self.frequency, unit_with_frequency
        return factor, plain_unit


def force_unit(scene: Scene, system: Loaded, sizes: Sizes) -> ForceUnit:
    """Return the axial drag of a scene's body, from the scene and from sizes that it
    does not have. Refusal where the two contradict each other."""
    known = _known_sizes(scene, sizes)
    length = known["length"]
    radius = known["radius"]
    depth = known["depth"]
    stress = known["stress"]
    frequency = known["frequency"]

    place = ""
    if stress is None and depth is not None:
        stress = system.axial_stress(depth)
        place = f" at a depth of {depth:g} m"
    if stress is not None and length is not None and radius is not None:
        source = (
            f"stress {stress:.4g} Pa{place} x 2 x radius {radius:g} m "
            f"x length {length:g} m"
        )
        return ForceUnit(stress * 2 * radius * length, length, frequency, source)

    drag = _effect_value(scene, "drag")
    if drag is not None and length is not None:
        source = "as given in the effect body-inertia"
        return ForceUnit(float(drag), length, frequency, source)

    missing = [name for name in ("length", "radius") if known[name] is None]
    if stress is None:
        # A medium with a measured stress needs the depth alone.
        measured = system.axial_stress(1.0)
        if measured:
            missing.append("depth")
        else:
            missing.append("stress")
    return ForceUnit(None, length, frequency, "unknown in N", tuple(missing))


def _known_sizes(scene: Scene, sizes: Sizes) -> dict[str, float | None]:
    """Return the sizes of the scene, completed with those given, by name; None for a
    size that neither has. Refusal where they differ."""
    own = _scene_sizes(scene, sizes.length)
    known = {}
    for name, given in asdict(sizes).items():
        value = own.get(name)
        if value is None:
            known[name] = given
            continue
        if given is not None and not math.isclose(given, value, rel_tol=1e-6):
            raise Refusal(
                f"``{name}`` is {given:g}, but the scene has {value:g}",
                instead=f"remove ``{name}``",
            )
        known[name] = value
    return known


def _scene_sizes(scene: Scene, given_length: float | None) -> dict[str, float | None]:
    """Return the sizes that a scene has, by name. given_length: m, for a radius in body
    lengths where the scene has no length in m."""
    system = scene.system
    length = _effect_value(scene, "length")
    if length_unit(system) == "m":
        length = body_size(system)

    effects = getattr(system, "effects", ())
    caps = next((effect for effect in effects if effect.kind == "end-caps"), None)
    radius = None
    if caps is not None:
        radius = caps.radius_m
        scale = given_length if length is None else length
        if radius is None and scale is not None:
            radius = caps.radius * scale
    return {
        "length": length,
        "radius": radius,
        "depth": _effect_value(scene, "depth"),
        "frequency": scene.frequency,
    }


def _effect_value(scene: Scene, name: str) -> Any:
    """Return an attribute of the first effect of a scene that has it; None without
    one."""
    for effect in getattr(scene.system, "effects", ()):
        if hasattr(effect, name):
            return getattr(effect, name)
    return None
