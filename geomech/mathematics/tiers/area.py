"""The area tier: exp of the CCF's integral over the enclosed area.

A gait that winds around a variable with a period encloses none: it is compared with the
loop at rest (`geomech.mathematics.geometry.loop_at_rest`).

Winding numbers count, so figure-eights cancel. A loop of three and more joints encloses
no area but spans surfaces; how much the result depends on their choice is reported."""

from __future__ import annotations

import numpy as np

from geomech.core.setting import Setting
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import SAMPLES_TOGETHER
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.gait import checked_gait
from geomech.mathematics.geometry.loop_at_rest import (
    NODES,
    STEPS,
    wound_area,
    wound_area_by,
)
from geomech.mathematics.geometry.periods import winding
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.two_form import (
    RADII,
    refuse_winding,
    spanned,
    spanned_by,
    two_form,
)
from geomech.mathematics.tiers import fitted
from geomech.mathematics.tiers.base import Plan, Tier, in_groups
from rft.core.checks import in_range
from rft.core.refusal import Refusal
from rft.formulas import se2

TIPS = 2  # surfaces besides the one that is taken
AROUND = 64  # phases on a surface where there is no field


def area(field: Field, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """Return exp of the integral of a CCF (joints 1 and 2), (..., 3), for amplitudes
    (...,) or the gait's own. Refusal off the grid.

    By Green's theorem it is the integral of P d(alpha_2) along the gait, with
    dP/d(alpha_1) = CCF. The estimate is of order 3 in the gait's size in a generic
    frame, 4 where A vanishes at its centre."""
    checked_gait(gait)
    in_range("phases", phases, 1, 1e9, whole=True)
    if not isinstance(field, Field):
        raise Refusal(
            "the area tier integrates a Field, such as the result of curvature.ccf",
            value=field,
        )
    if field.joints != 2 or gait.joints != 2:
        raise Refusal(
            "the area tier needs two joints, got a field of"
            f" {field.joints} and a gait of {gait.joints}"
        )
    refuse_winding(gait)
    if amplitudes is None:
        amplitudes = gait.amplitude
    potential = field.antiderivative(0)

    def enclosed(batch):
        alpha, alphadot = gait.cycle(phases, batch)
        field.inside(alpha)
        integrand = potential(alpha) * alphadot[..., 1:]
        return se2.exp(integrand.mean(-2) * 2 * np.pi)

    return in_groups(enclosed, amplitudes, SAMPLES_TOGETHER // phases)


def _plan(system, numerics, gait, amplitudes) -> Plan:
    """Return the plan of the tier: by the enclosed area of two joints, by surfaces of
    more."""
    d = system.joints
    phases = numerics.phases
    components = 3 * (d * (d - 1) // 2)
    read = components * (numerics.interpolation + 1) ** d
    numbers = components * numerics.grid**d

    if winding(gait, system.traits.periods, amplitudes):
        return _wound_plan(system, numerics, gait, numbers, read)

    if d == 2:

        def predict(table, amplitudes):
            return area(ccf(table), gait, amplitudes, phases)

        table = fitted.table(system, numerics)
        return Plan(predict, table, numbers=numbers, read=read)

    if fitted.is_too_large(system, numerics):
        return _plan_without_field(system, numerics, gait)

    def surfaces(table, amplitudes, tips):
        return spanned(two_form(table), gait, amplitudes, phases, tips)

    return _surface_plan(
        surfaces,
        gait,
        table=fitted.table(system, numerics),
        numbers=numbers,
        read=read * RADII,
    )


def _wound_plan(system, numerics, gait, numbers: int, read: int) -> Plan:
    """Return the plan of a gait that winds around variables with periods: the line
    integral along the loop at rest, and the strip from there to the gait.

    numbers, read: entries of `Plan`."""
    if fitted.is_too_large(system, numerics):
        return _wound_plan_without_field(system, numerics, gait)

    def strips(table, amplitudes, tips):
        return wound_area(table, gait, amplitudes, numerics.phases, tips)

    nodes = RADII
    if system.joints == 2:
        nodes = NODES
    return _surface_plan(
        strips,
        gait,
        has_choice=system.joints > 2,
        table=fitted.table(system, numerics),
        numbers=numbers,
        read=read * nodes,
    )


def _wound_plan_without_field(system, numerics, gait) -> Plan:
    """Return `_wound_plan` with A solved on the strips alone."""
    A = fitted.without_field(system, numerics)
    phases = max(AROUND, 4 * gait.harmonics + 2)

    def strips(table, amplitudes, tips):
        periods = system.traits.periods
        return wound_area_by(A, gait, periods, amplitudes, phases, tips)

    def balances(count, _):
        # A and its differences on a strip; twice that on those through other loops.
        on_strip = 5 * RADII * phases + STEPS
        shapes = 2 * (phases + on_strip) + TIPS * 2 * on_strip
        return count * shapes * fitted.balances_per_shape(system, numerics)

    return _surface_plan(strips, gait, balances=balances)


def _plan_without_field(system, numerics, gait) -> Plan:
    """Return the plan of a loop of many joints, with A solved on its surfaces alone."""
    A = fitted.without_field(system, numerics)

    def surfaces(table, amplitudes, tips):
        return spanned_by(A, gait, amplitudes, numerics.phases, tips, AROUND)

    def balances(count, phases):
        # For the displacement, and once more with its spread.
        on_cone = RADII * max(AROUND, 4 * gait.harmonics + 2)
        shapes = 2 * phases + (2 + TIPS) * on_cone
        return count * shapes * fitted.balances_per_shape(system, numerics)

    return _surface_plan(surfaces, gait, balances=balances)


def _surface_plan(surfaces, gait, has_choice: bool = True, **plan) -> Plan:
    """Return the plan of a loop of three and more joints, or of one that winds.

    surfaces: function of (table, amplitudes, tips), which returns a
    `geomech.mathematics.geometry.two_form.Spanned`. has_choice: whether there is more
    than one surface. plan: other entries of `Plan`."""

    def predict(table, amplitudes):
        shape = np.shape(amplitudes)
        if amplitudes is None:
            shape = np.shape(gait.amplitude)
        return surfaces(table, amplitudes, 0).net.reshape(*shape, 3)

    def spread(table, amplitudes):
        return surfaces(table, amplitudes, TIPS).spread

    if not has_choice:
        return Plan(predict, **plan)
    return Plan(predict, spread=spread, **plan)


AREA = Tier(
    "area",
    "area integral of the CCF",
    {"color": "#D55E00", "linestyle": "--"},
    _plan,
    joints=range(2, 10_001),
    offered=range(2, 6),
    takes="needs two or more joints, because only then does a loop enclose area",
    instead="use path or direct",
    regular=True,
    settings=(
        Setting(
            "grid",
            fitted.GRIDS,
            "3 or 4 in amplitude, set by the gait",
            "a map that can be read, rather than digits",
        ),
    ),
)
