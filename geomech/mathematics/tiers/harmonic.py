"""The harmonic tier: the odd harmonics of the velocity in the direction of alphadot,
interpolated along the gait."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from geomech.core.setting import Setting
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.representations.harmonics import Harmonics
from geomech.mathematics.systems.capabilities import stored_table
from geomech.mathematics.tiers import fitted
from geomech.mathematics.tiers.base import Plan, Table, Tier
from geomech.mathematics.tiers.direct import direct_plan
from geomech.mathematics.tiers.path import path
from rft.core.refusal import Refusal

HIGHEST = {2: 15, 3: 9}  # by joints, if [numerics] harmonics is left out
# For more joints: 56 coefficients of each component of four joints, 126 of five.
HIGHEST_BEYOND = 5
DEPENDS_ON = ("grid", "extent", "harmonics", "interpolation")  # of [numerics]


def highest(system, numerics) -> int:
    """Return the highest harmonic of the series."""
    return numerics.harmonics or HIGHEST.get(system.joints, HIGHEST_BEYOND)


def directions(system, numerics) -> int:
    """Return the number of directions of alphadot at each shape: enough above the
    highest harmonic for aliasing to stay small."""
    k = highest(system, numerics)
    if system.joints == 2:
        return max(24, (8 * k) // 5)
    return 2 * harmonics.terms(system.joints, k)


def table(system, numerics) -> Table:
    """Return the harmonics on the scene's grid, as a table to build."""
    d = system.joints
    count = directions(system, numerics)
    terms = harmonics.terms(d, highest(system, numerics))
    return Table(
        "harmonics",
        key=fitted.key(numerics, DEPENDS_ON),
        balances=fitted.solved_shapes(system, numerics, count) * count,
        numbers=(terms + 1) * 3 * numerics.grid**d,
        build=partial(_build, system, numerics),
        axes=partial(_axes, system, numerics),
    )


def _axes(system, numerics) -> tuple[np.ndarray, ...]:
    """Return the axes of the field; Refusal for a field too large."""
    d = system.joints
    n = numerics.grid
    if fitted.is_too_large(system, numerics):
        raise Refusal(
            f"harmonics of {d} joint rates need a field, and one of {n}^{d} shapes"
            " is too large",
            instead=f"lower [numerics] grid, to {fitted.finest_grid(d)} or less, or "
            "use path, adapted or direct, which need no field",
        )
    return fitted.axes(system, numerics)


def _build(system, numerics, progress: Callable | None) -> Harmonics:
    """Return the harmonics: the stored ones, or a fit on the scene's grid."""
    stored = stored_table(system, "harmonics")
    if stored:
        return stored
    return harmonics.fit(
        system.velocity,
        _axes(system, numerics),
        directions(system, numerics),
        numerics.interpolation,
        progress,
        highest=highest(system, numerics),
        traits=system.traits,
    )


def _plan(system, numerics, gait, amplitudes) -> Plan:
    """Return the plan of the tier."""
    if system.traits.linear:  # no harmonics beyond the first
        return direct_plan(system, numerics, gait)
    d = system.joints
    terms = harmonics.terms(d, highest(system, numerics))

    def predict(fitted, amplitudes):
        return path(fitted.velocity, gait, amplitudes, numerics.phases)

    read = 3 * terms * (numerics.interpolation + 1) ** d
    return Plan(predict, table(system, numerics), read=read)


HARMONIC = Tier(
    "harmonic",
    "path integral, odd harmonics",
    {"color": "#009E73", "linestyle": ":"},
    _plan,
    joints=range(2, 6),
    offered=range(2, 3),  # of more joints by name: the table is large
    takes="needs two to five joints; more joints have too many harmonics",
    instead="use path, adapted or direct",
    regular=True,
    settings=(
        Setting(
            "grid",
            fitted.GRIDS,
            "4 if smooth, 1 to 2 across kinks",
            "any gait inside the field from one table",
        ),
        Setting(
            "harmonics",
            (1, 3, 5, 9, 15, 21),
            "1 to 2, set by the kinks",
            "the part of the velocity that is not linear in alphadot",
        ),
    ),
)


def is_looked_up(system) -> bool:
    """Return whether a plain study takes the harmonics of a system: where the velocity
    is not linear, and joints are few."""
    return not system.traits.linear and HARMONIC.is_offered(system)
