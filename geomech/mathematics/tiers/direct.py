"""The direct tier: the velocity itself at every phase, integrated along the gait."""

from __future__ import annotations

from functools import partial

import numpy as np

from geomech.core.setting import Setting
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import SAMPLES_TOGETHER, Velocity, evaluate
from geomech.mathematics.geometry.gait import checked_gait
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.systems.capabilities import gaits_per_batch
from geomech.mathematics.tiers.base import Plan, Tier, in_groups, solved_phases
from rft.core.checks import in_range
from rft.core.premise import NONE

COUNTS = (2, 4, 8, 16, 32, 64)  # of elements or nodes of a link
NOTHING = "nothing that exact link integrals do not give at lower cost"


def direct(
    velocity: Velocity, gait: Gait, amplitudes=None, phases: int = 256
) -> np.ndarray:
    """Return the net poses (..., 3) by the velocity integrated along the gait, for
    amplitudes (...,) or the gait's own, many phases in one batch."""
    checked_gait(gait)
    if amplitudes is None:
        amplitudes = gait.amplitude
    in_range("phases", phases, 1, 1e9, whole=True)
    step = SAMPLES_TOGETHER // int(phases)
    return in_groups(partial(_net, velocity, gait, phases), amplitudes, step)


def _net(velocity: Velocity, gait: Gait, phases: int, amplitudes) -> np.ndarray:
    """Return the net poses (B, 3) for amplitudes (B,)."""
    alpha, alphadot = gait.cycle(phases, amplitudes)
    xi = []
    for k in range(0, phases, SAMPLES_TOGETHER):
        part = slice(k, k + SAMPLES_TOGETHER)
        xi.append(evaluate(velocity, alpha[:, part], alphadot[:, part]))
    return displacement(np.concatenate(xi, -2))


def direct_plan(system, numerics, gait: Gait) -> Plan:
    """Return the plan of a tier that integrates the system's own velocity, without a
    table."""

    def predict(table, amplitudes):
        return direct(system.velocity, gait, amplitudes, numerics.phases)

    def balances(count, phases):
        return count * phases

    return Plan(predict, balances=balances, exact=True)


def _plan(system, numerics, gait: Gait, amplitudes) -> Plan:
    """Return the plan by which the system runs the gait (`System.run`), from as few of
    its phases as symmetry allows."""
    phases = numerics.phases

    def run(amplitudes):
        alpha, alphadot = gait.cycle(phases, amplitudes)
        return system.run(alpha, alphadot).net

    def predict(table, amplitudes):
        if amplitudes is None:
            return run(None)
        return in_groups(run, amplitudes, gaits_per_batch(system, phases))

    def balances(count, phases):
        return count * solved_phases(system, gait, phases)

    return Plan(predict, balances=balances, exact=True)


DIRECT = Tier(
    "direct",
    "force balance",
    # The others lie on its line, or do not.
    {"color": "0.72", "linestyle": "-", "linewidth": 4.0, "zorder": 1},
    _plan,
    rests_on=NONE,
    markers="black",
    settings=(
        Setting(
            "phases",
            (16, 32, 64, 128, 256, 512),
            "spectral if smooth, otherwise 2",
            "convergence to the true answer",
        ),
        Setting(
            "segments",
            COUNTS,
            "2; less with pivots in links",
            NOTHING,
            "limit",
            key="loads",
            rule="midpoint",
        ),
        Setting(
            "nodes",
            COUNTS,
            "spectral; about 1 to 2 with pivots in links",
            NOTHING,
            "limit",
            key="loads",
            rule="gauss",
        ),
        Setting(
            "regularisation",
            (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
            "1",
            "links that truly stand still",
            "limit",
        ),
        Setting(
            "pieces",
            (5, 10, 20, 40, 80),
            "2 on average, scattered by pivots",
            "resolution of effects that vary along long links",
            "limit",
        ),
    ),
)
