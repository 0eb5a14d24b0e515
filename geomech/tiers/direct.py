"""The direct tier: the velocity itself at every phase, integrated along the gait."""

from __future__ import annotations

import numpy as np

from geomech.core.setting import Setting
from geomech.gaits import Gait
from geomech.geometry.connection import SAMPLES_TOGETHER, Velocity, evaluate
from geomech.geometry.gait import checked_gait
from geomech.geometry.reconstruct import displacement
from geomech.systems.capabilities import gaits_per_batch
from geomech.tiers.base import Plan, Tier, in_groups, solved_phases
from rft.core.checks import in_range
from rft.core.premise import NONE

COUNTS = 2, 4, 8, 16, 32, 64  # of segments or nodes of a link
NOTHING = "nothing that exact link integrals do not give for less"


def direct(
    velocity: Velocity, gait: Gait, amplitudes=None, phases: int = 256
) -> np.ndarray:
    """Return the net poses (..., 3) by the velocity integrated along the gait, for amplitudes (...,) or the gait's own,
    many phases in one batch."""
    checked_gait(gait)
    amplitudes = gait.amplitude if amplitudes is None else amplitudes
    in_range("phases", phases, 1, 1e9, whole=True)
    step = SAMPLES_TOGETHER // int(phases)
    return in_groups(
        lambda batch: _cycle(velocity, gait, batch, phases), amplitudes, step
    )


def _cycle(velocity: Velocity, gait: Gait, amplitudes, phases: int) -> np.ndarray:
    alpha, alphadot = gait.cycle(phases, amplitudes)
    parts = (slice(k, k + SAMPLES_TOGETHER) for k in range(0, phases, SAMPLES_TOGETHER))
    return displacement(
        np.concatenate(
            [evaluate(velocity, alpha[:, p], alphadot[:, p]) for p in parts], -2
        )
    )


def direct_plan(system, numerics, gait: Gait) -> Plan:
    """Return the plan of a tier that integrates the system's own velocity, without a table."""
    predict = lambda table, batch: direct(system.velocity, gait, batch, numerics.phases)
    return Plan(predict, balances=_balances(system, gait), exact=True)


def _balances(system, gait: Gait):
    return lambda count, phases: count * solved_phases(system, gait, phases)


def _plan(system, numerics, gait: Gait, amplitudes) -> Plan:
    """Return the plan by which the system runs the gait (`System.run`), from as few of its phases as symmetry
    allows."""
    phases = numerics.phases
    run = lambda batch: system.run(*gait.cycle(phases, batch)).net
    predict = lambda table, batch: (
        run(None)
        if batch is None
        else in_groups(run, batch, gaits_per_batch(system, phases))
    )
    return Plan(predict, balances=_balances(system, gait), exact=True)


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
            "spectral if smooth, else 2",
            "the true answer",
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
            "links that really stand still",
            "limit",
        ),
        Setting(
            "pieces",
            (5, 10, 20, 40, 80),
            "2 in the mean, scattered by pivots",
            "effects that vary along long links",
            "limit",
        ),
    ),
)
