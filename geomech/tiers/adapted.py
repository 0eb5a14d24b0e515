"""The adapted tier: a connection made for one family of gaits, exact up to its table (`geomech.geometry.family`)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from geomech.core.setting import Setting
from geomech.geometry import family
from geomech.geometry.family import Family
from geomech.tiers.base import Plan, Table, Tier, solved_phases
from rft.core.checks import real_array
from rft.core.premise import SHAPE_ALONE


def table(system, numerics, gait, amplitudes) -> Table:
    """Return the family of scaled copies of a gait up to these amplitudes, as a table to build."""
    a = real_array("amplitudes", gait.amplitude if amplitudes is None else amplitudes)
    least, largest = float(a.min(initial=0.0)), float(a.max(initial=0.0))
    count, phases = numerics.curves, numerics.phases // 2
    sides = np.array([a for a in (least, largest) if a])
    return Table(
        "family",
        (numerics.curves, numerics.phases, gait, least, largest),
        len(sides) * count * solved_phases(system, gait, phases),
        len(sides) * count * phases * 3,
        partial(_build, system, gait, least, largest, count, phases),
        amplitudes=np.outer(sides, np.arange(1, count + 1) / count).ravel(),
    )


def _build(
    system, gait, least, largest, count, phases, progress: Callable | None
) -> Family:
    if least == largest:  # rest, and nothing else
        return Family(gait, np.zeros(1), np.zeros((1, phases, 3)))
    return family.fit(
        partial(_run, system), gait, largest, count, phases, progress, least=least
    )


def _run(system, alpha, alphadot) -> np.ndarray:
    return system.run(alpha, alphadot).xi


def _plan(system, numerics, gait, amplitudes) -> Plan:
    area = lambda curves, batch: curves.area(
        np.asarray(gait.amplitude if batch is None else batch, float)
    )
    return Plan(area, table(system, numerics, gait, amplitudes))


ADAPTED = Tier(
    "adapted",
    "area integral, adapted CCF",
    {"color": "#CC79A7", "linestyle": (0, (5, 1))},
    _plan,
    rests_on=SHAPE_ALONE,
    result="adapted tier",
    common=False,  # its table serves one family of gaits
    settings=(
        Setting(
            "curves",
            (4, 6, 8, 12, 16, 24, 48),
            "4 if smooth, about 2 across kinks",
            "every amplitude of one family from one table",
        ),
    ),
)
