"""The area tier: exp of the CCF's integral over the area enclosed; winding numbers count, so figure-eights cancel. A
loop of three and more joints encloses no area but spans surfaces; how much depends on their choice is reported."""

from __future__ import annotations

import numpy as np

from geomech.core.setting import Setting
from geomech.gaits import Gait
from geomech.geometry.connection import SAMPLES_TOGETHER
from geomech.geometry.curvature import ccf
from geomech.geometry.field import Field
from geomech.geometry.gait import checked_gait
from geomech.geometry.two_form import RADII, spanned, spanned_by, two_form
from geomech.tiers import fitted
from geomech.tiers.base import Plan, Tier, in_groups
from rft.core.checks import in_range
from rft.core.refusal import Refusal
from rft.formulas import se2

TIPS, AROUND = (
    2,
    64,
)  # surfaces besides the one that is taken; phases on one where there is no field


def area(field: Field, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """Return exp of the integral of a CCF (joints 1 and 2), (..., 3), for amplitudes (...,) or the gait's own. Refusal
    off the grid.

    By Green's theorem the integral is that of P d(alpha_2) along the gait, dP/d(alpha_1) = CCF. Order 3 in the gait's
    size in a generic frame, 4 where A vanishes at its centre.
    """
    checked_gait(gait)
    in_range("phases", phases, 1, 1e9, whole=True)
    if not isinstance(field, Field):
        raise Refusal(
            "the area tier sums up a Field, such as curvature.ccf gives", value=field
        )
    if field.joints != 2 or gait.joints != 2:
        raise Refusal(
            f"the area tier needs two joints, got a field of {field.joints} and a gait of {gait.joints}"
        )
    potential = field.antiderivative(0)

    def enclosed(batch):
        alpha, alphadot = gait.cycle(phases, batch)
        return se2.exp(
            (potential(field.inside(alpha)) * alphadot[..., 1:]).mean(-2) * 2 * np.pi
        )

    return in_groups(
        enclosed,
        gait.amplitude if amplitudes is None else amplitudes,
        SAMPLES_TOGETHER // phases,
    )


def _plan(system, numerics, gait, amplitudes) -> Plan:
    d, phases = system.joints, numerics.phases
    read = (
        3
        * (d * (d - 1) // 2)
        * (numerics.interpolation + 1) ** d
        * (1 if d == 2 else RADII)
    )
    memory = {"numbers": 3 * (d * (d - 1) // 2) * numerics.grid**d, "read": read}
    if d == 2:
        enclosed = lambda table, batch: area(ccf(table), gait, batch, phases)
        return Plan(enclosed, fitted.table(system, numerics), **memory)
    if not fitted.is_too_large(system, numerics):
        surfaces = lambda table, batch, tips: spanned(
            two_form(table), gait, batch, phases, tips
        )
        return _surface_plan(
            surfaces, gait, table=fitted.table(system, numerics), **memory
        )
    A = fitted.without_field(system, numerics)

    def balances(count, phases):
        on_cones = RADII * max(AROUND, 4 * gait.harmonics + 2)
        shapes = (
            2 * phases + (2 + TIPS) * on_cones
        )  # for the displacement, and once more with its spread
        return count * shapes * fitted.balances_per_shape(system, numerics)

    surfaces = lambda table, batch, tips: spanned_by(
        A, gait, batch, phases, tips, AROUND
    )
    return _surface_plan(surfaces, gait, balances=balances)


def _surface_plan(surfaces, gait, **plan) -> Plan:
    """Return the plan of a loop of three and more joints. surfaces: function of (table, amplitudes, tips)."""

    def net(table, amplitudes):
        shape = np.shape(gait.amplitude if amplitudes is None else amplitudes)
        return surfaces(table, amplitudes, 0).net.reshape(*shape, 3)

    return Plan(
        net, spread=lambda table, batch: surfaces(table, batch, TIPS).spread, **plan
    )


AREA = Tier(
    "area",
    "area integral of the CCF",
    {"color": "#D55E00", "linestyle": "--"},
    _plan,
    joints=range(2, 10_001),
    offered=range(2, 6),
    takes="takes two joints and more, of which a loop encloses area",
    instead="use path or direct",
    regular=True,
    settings=(
        Setting(
            "grid",
            fitted.GRIDS,
            "3 or 4 in amplitude, set by the gait",
            "a map to read, not digits",
        ),
    ),
)
