"""The adapted tier: a connection for one family of gaits, exact up to its table
(`geomech.mathematics.geometry.family`)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from geomech.core.setting import Setting
from geomech.mathematics.geometry import family
from geomech.mathematics.geometry.family import Family
from geomech.mathematics.geometry.periods import ends_differ
from geomech.mathematics.tiers.base import Plan, Table, Tier, solved_phases
from rft.core.checks import real_array
from rft.core.premise import SHAPE_ALONE


def table(system, numerics, gait, amplitudes) -> Table:
    """Return the family of scaled copies of a gait up to these amplitudes, as a table
    to build."""
    if amplitudes is None:
        amplitudes = gait.amplitude
    a = real_array("amplitudes", amplitudes)
    least = float(a.min(initial=0.0))
    largest = float(a.max(initial=0.0))
    count = numerics.curves
    phases = numerics.phases // 2
    ends = np.array([a for a in (least, largest) if a])
    curves = np.outer(ends, np.arange(1, count + 1) / count).ravel()
    if ends_differ(gait):  # so that it moves at amplitude 0 as well
        curves = np.append(curves, 0.0)
    return Table(
        "family",
        key=(numerics.curves, numerics.phases, gait, least, largest),
        balances=len(curves) * solved_phases(system, gait, phases),
        numbers=len(curves) * phases * 3,
        build=partial(_build, system, gait, least, largest, count, phases),
        amplitudes=curves,
    )


def _build(
    system, gait, least, largest, count, phases, progress: Callable | None
) -> Family:
    """Return the family of a gait from the amplitude least to largest."""
    velocity = partial(_run, system)
    if least == largest:  # both are 0: rest alone
        xi = np.zeros((1, phases, 3))
        if ends_differ(gait):
            xi = velocity(*gait.cycle(phases, np.zeros(1)))
        return Family(gait, np.zeros(1), xi)
    return family.fit(velocity, gait, largest, count, phases, progress, least=least)


def _run(system, alpha, alphadot) -> np.ndarray:
    """Return xi (..., N, 3) of the cycles of a system."""
    return system.run(alpha, alphadot).xi


def _plan(system, numerics, gait, amplitudes) -> Plan:
    """Return the plan of the tier."""

    def predict(curves, amplitudes):
        if amplitudes is None:
            amplitudes = gait.amplitude
        return curves.area(np.asarray(amplitudes, float))

    return Plan(predict, table(system, numerics, gait, amplitudes))


ADAPTED = Tier(
    "adapted",
    "area integral, adapted CCF",
    {"color": "#CC79A7", "linestyle": (0, (5, 1))},
    _plan,
    rests_on=SHAPE_ALONE,
    prescribed=True,
    result="adapted tier",
    common=False,  # its table serves one family of gaits
    settings=(
        Setting(
            "curves",
            (4, 6, 8, 12, 16, 24, 48),
            "4 if smooth, about 2 across kinks",
            "all amplitudes of one family from one table",
        ),
    ),
)
