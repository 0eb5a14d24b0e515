"""The path tier: the fitted connection integrated along the gait."""

from __future__ import annotations

import numpy as np

from geomech.core.setting import Setting
from geomech.gaits import Gait
from geomech.geometry.connection import Connection, Velocity
from geomech.tiers import fitted
from geomech.tiers.base import Plan, Tier
from geomech.tiers.direct import direct, direct_plan


def path(
    A: Connection | Velocity, gait: Gait, amplitudes=None, phases: int = 256
) -> np.ndarray:
    """Return net poses (..., 3) by the connection integrated along the gait, for amplitudes (...,) or the gait's own."""
    return direct(
        A.velocity if isinstance(A, Connection) else A, gait, amplitudes, phases
    )


def _plan(system, numerics, gait, amplitudes) -> Plan:
    if system.traits.linear:  # xi = A alphadot holds exactly
        return direct_plan(system, numerics, gait)
    if fitted.is_too_large(system, numerics):
        A = fitted.without_field(system, numerics)
        xi = lambda alpha, alphadot: np.einsum("...ij,...j->...i", A(alpha), alphadot)
        balances = lambda count, phases: (
            count * phases * fitted.balances_per_shape(system, numerics)
        )
        return Plan(
            lambda table, batch: path(xi, gait, batch, numerics.phases),
            balances=balances,
        )
    read = 3 * system.joints * (numerics.interpolation + 1) ** system.joints
    predict = lambda table, batch: path(table, gait, batch, numerics.phases)
    return Plan(predict, fitted.table(system, numerics), read=read)


PATH = Tier(
    "path",
    "path integral of A",
    {"color": "#0072B2", "linestyle": "-."},
    _plan,
    offered=range(1, 6),
    settings=(
        Setting(
            "grid",
            fitted.GRIDS,
            "4 if smooth, 1 to 2 across kinks",
            "the limit of linearity, no further",
        ),
        Setting(
            "directions",
            (2, 4, 8, 16, 32, 64),
            "2, harmonics folding back",
            "a steadier fit",
            "limit",
        ),
        Setting(
            "interpolation",
            (1, 2, 3, 5),
            "degree + 1 if smooth",
            "little where links stick",
            "limit",
        ),
    ),
)
