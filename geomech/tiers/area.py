"""The area tier: exp of the CCF's integral over the area enclosed; winding numbers count, so figure-eights cancel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.connection import SAMPLES_TOGETHER
from geomech.curvature import ccf
from geomech.errors import number, short
from geomech.field import Field
from geomech.gaits import Gait
from geomech.gaits.base import checked_gait
from geomech.tiers.base import in_groups
from geomech.tiers.path import Path, zeros
from rft import se2


def area(field: Field, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """exp of the integral of a CCF (joints 1 and 2), for amplitudes (..., ) or the gait's own. ValueError off the grid.

    By Green's theorem the integral is that of P d(alpha_2) along the gait, dP/d(alpha_1) = CCF. Order 3 in the gait's
    size in a generic frame, 4 where A vanishes at its centre.
    """
    checked_gait(gait)
    number("phases", phases, 1, 1e9, whole=True)
    if not isinstance(field, Field):
        raise ValueError(f"the area tier sums up a Field, such as curvature.ccf gives, got {short(field)}")
    if field.joints != 2 or gait.joints != 2:
        raise ValueError(f"the area tier needs two joints, got a field of {field.joints} and a gait of {gait.joints}")
    potential = field.antiderivative(0)

    def enclosed(some):
        alpha, alphadot = gait.cycle(phases, some)
        return se2.exp((potential(field.inside(alpha)) * alphadot[..., 1:]).mean(-2) * 2 * np.pi)

    return in_groups(enclosed, gait.amplitude if amplitudes is None else amplitudes, SAMPLES_TOGETHER // phases)


class Area(Path):
    """Shares the connection of the path tier."""

    name, label = "area", "area integral of the CCF"
    style = {"color": "#D55E00", "linestyle": "--"}
    joints = offered = range(2, 3)
    whole = True

    def is_direct(self, system) -> bool:
        return False

    def sample(self, system, numerics) -> Callable | None:
        field = zeros(system, numerics, (3, 1))
        return lambda n: field(np.zeros((n, 2)))

    def predict(self, table, system, gait, amplitudes, numerics) -> np.ndarray:
        return area(ccf(table), gait, amplitudes, numerics.phases)
