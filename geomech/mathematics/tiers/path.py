"""The path tier: the fitted connection integrated along the gait."""

from __future__ import annotations

import numpy as np

from geomech.core.setting import Setting
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import Connection, Velocity
from geomech.mathematics.tiers import fitted
from geomech.mathematics.tiers.base import Plan, Tier
from geomech.mathematics.tiers.direct import direct, direct_plan


def path(
    A: Connection | Velocity, gait: Gait, amplitudes=None, phases: int = 256
) -> np.ndarray:
    """Return the net poses (..., 3) by the connection integrated along the gait, for
    amplitudes (...,) or the gait's own."""
    velocity = A.velocity if isinstance(A, Connection) else A
    return direct(velocity, gait, amplitudes, phases)


def _plan(system, numerics, gait, amplitudes) -> Plan:
    """Return the plan of the tier."""
    if system.traits.linear:  # xi = A alphadot holds exactly
        return direct_plan(system, numerics, gait)
    if fitted.is_too_large(system, numerics):
        return _plan_without_field(system, numerics, gait)

    def predict(table, amplitudes):
        return path(table, gait, amplitudes, numerics.phases)

    read = 3 * system.joints * (numerics.interpolation + 1) ** system.joints
    return Plan(predict, fitted.table(system, numerics), read=read)


def _plan_without_field(system, numerics, gait) -> Plan:
    """Return the plan with A solved at the shapes of the gait alone."""
    A = fitted.without_field(system, numerics)

    def velocity(alpha, alphadot):
        return np.einsum("...ij,...j->...i", A(alpha), alphadot)

    def predict(table, amplitudes):
        return path(velocity, gait, amplitudes, numerics.phases)

    def balances(count, phases):
        return count * phases * fitted.balances_per_shape(system, numerics)

    return Plan(predict, balances=balances)


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
            "a more stable fit",
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
