"""The area tier: exp of the CCF's integral over the area enclosed; winding numbers count, so figure-eights cancel. A loop of
three and more joints encloses no area but spans surfaces, and what hangs on their choice is told."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.core.errors import number, short
from geomech.gaits import Gait
from geomech.geometry.connection import SAMPLES_TOGETHER
from geomech.geometry.curvature import ccf
from geomech.geometry.field import Field
from geomech.geometry.gait import checked_gait
from geomech.geometry.two_form import RADII, spanned, spanned_by, two_form
from geomech.tiers.base import in_groups
from geomech.tiers.path import Path, zeros
from rft import se2

TIPS, AROUND = 2, 64  # surfaces besides the one that is taken; phases on one where there is no field


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
    """Shares the connection of the path tier. Of more than two joints it integrates the two-form over one of the surfaces that
    the loop spans (`geomech.geometry.two_form`), and tells how far others are from it."""

    name, label = "area", "area integral of the CCF"
    style = {"color": "#D55E00", "linestyle": "--"}
    joints, offered = range(2, 10_001), range(2, 6)
    takes_joints, instead = "takes two joints and more, of which a loop encloses area", "use path or direct"
    whole = True

    def is_direct(self, system) -> bool:
        return False

    def size(self, system, numerics) -> int:
        d = system.joints
        return super().size(system, numerics) + 3 * (d * (d - 1) // 2) * numerics.grid**d

    def sample(self, system, numerics) -> Callable | None:
        d, nodes = system.joints, 1 if system.joints == 2 else RADII
        field = zeros(system, numerics, (d * (d - 1) // 2, 3))
        return lambda n: field(np.zeros((n * nodes, d)))

    def predict(self, table, system, gait, amplitudes, numerics) -> np.ndarray:
        if system.joints == 2:
            return area(ccf(table), gait, amplitudes, numerics.phases)
        shape = np.shape(gait.amplitude if amplitudes is None else amplitudes)
        return self._spanned(table, system, gait, amplitudes, numerics, 0).net.reshape(*shape, 3)

    def choice(self, table, system, gait, amplitudes, numerics) -> np.ndarray | None:
        if system.joints == 2:
            return None
        return self._spanned(table, system, gait, amplitudes, numerics, TIPS).spread

    def along(self, system, numerics, count, phases) -> int:
        shapes = 2 * phases + (2 + TIPS) * RADII * AROUND  # for the displacement, and once more with its spread
        return count * shapes * (system.joints if system.traits.linear else self.directions(system, numerics))

    def _spanned(self, table, system, gait, amplitudes, numerics, tips: int):
        if table is None:
            return spanned_by(self.A(system, numerics), gait, amplitudes, numerics.phases, tips, AROUND)
        return spanned(two_form(table), gait, amplitudes, numerics.phases, tips)
