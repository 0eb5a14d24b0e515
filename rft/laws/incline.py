"""Ground on a slope: how much weaker it is than level ground, and the pull of gravity
along it (Zhang and Goldman 2014, Sec. IV B)."""

from __future__ import annotations

import math

import numpy as np

from rft.core.metres import GRAVITY
from rft.core.refusal import require
from rft.laws.catalogue import REPOSE


def incline_factors(angle, repose):
    """Return the strength of ground on a slope over that of level ground, in motion
    that is not downhill, and how much less it is straight downhill.

    The first is cos(angle), the second sin|angle| / tan(repose), so that the strength
    straight downhill is sin(repose - |angle|) / sin(repose). Grains |z| deep can take a
    shear of rho g |z| cos(angle) tan(repose), of which their own weight along the slope
    takes rho g |z| sin|angle|.

    angle, repose: rad, numbers or arrays that broadcast."""
    return np.cos(angle), np.abs(np.sin(angle)) / np.tan(repose)


def gravity_on_incline(angle: float, gravity: float = GRAVITY) -> tuple[float, float]:
    """Return the components of gravity along the surface, in the direction in which it
    rises by ``angle``, rad, and along its normal, m/s^2."""
    return -gravity * math.sin(angle), -gravity * math.cos(angle)


def require_below_repose(angle: float, repose: float) -> None:
    """Raise Refusal unless the slope is below the angle of repose, both in rad."""
    require(
        abs(angle) < repose,
        f"a slope of {math.degrees(angle):.3g} degrees slides by itself",
        because="it must be below the angle of repose, "
        f"{math.degrees(repose):.3g} degrees",
    )


def assumed_of_incline(repose, mover: str) -> str:
    """Return what a slope assumes, as text. mover: what may move downhill."""
    weaker = f"weaker ground only where {mover} moves downhill"
    if not np.all(repose == REPOSE):
        return weaker
    return (
        f"an angle of repose of {math.degrees(REPOSE):.1f} degrees, from half the drag "
        f"downhill at 20 degrees, and {weaker}"
    )
