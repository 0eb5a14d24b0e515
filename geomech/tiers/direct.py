"""The direct tier: the velocity itself at every phase, integrated along the gait."""

from __future__ import annotations

import numpy as np

from geomech.core.errors import number
from geomech.gaits import Gait
from geomech.geometry.connection import SAMPLES_TOGETHER, Velocity, evaluate
from geomech.geometry.gait import checked_gait
from geomech.geometry.reconstruct import displacement
from geomech.systems.base import NONE
from geomech.tiers.base import Tier, in_groups, solved


def direct(velocity: Velocity, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """The velocity integrated along the gait, for amplitudes (...,) or the gait's own, many phases in one batch."""
    checked_gait(gait)
    amplitudes = gait.amplitude if amplitudes is None else amplitudes
    number("phases", phases, 1, 1e9, whole=True)
    step = SAMPLES_TOGETHER // int(phases)
    return in_groups(lambda some: _cycle(velocity, gait, some, phases), amplitudes, step)


def _cycle(velocity: Velocity, gait: Gait, amplitudes, phases: int) -> np.ndarray:
    alpha, alphadot = gait.cycle(phases, amplitudes)
    parts = (slice(k, k + SAMPLES_TOGETHER) for k in range(0, phases, SAMPLES_TOGETHER))
    return displacement(np.concatenate([evaluate(velocity, alpha[:, p], alphadot[:, p]) for p in parts], -2))


class Direct(Tier):
    """No table: the system runs the gait (`System.run`), by symmetry from as few of its phases as tell the others."""

    name, label = "direct", "force balance"
    style = {"color": "0.72", "linestyle": "-", "linewidth": 4.0, "zorder": 1}  # the others lie on it, or do not
    colour = "black"
    rests_on = NONE

    def solves(self, system, numerics, gait, count, phases) -> int:
        return count * solved(system, gait, phases)

    def predict(self, table, system, gait, amplitudes, numerics) -> np.ndarray:
        phases = numerics.phases
        run = lambda some: system.run(*gait.cycle(phases, some)).net
        return run(None) if amplitudes is None else in_groups(run, amplitudes, system.at_once(phases))
