"""The adapted tier: a connection made for one family of gaits, exact up to its table (`geomech.geometry.family`)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from geomech.core.errors import real_array
from geomech.geometry import family
from geomech.systems.base import SHAPE_ALONE
from geomech.tiers.base import Tier, solved


class Adapted(Tier):
    """Asked for by name only: its table serves the scaled copies of one gait and no other."""

    name, label = "adapted", "area integral, adapted CCF"
    style = {"color": "#CC79A7", "linestyle": (0, (5, 1))}
    rests_on = SHAPE_ALONE
    needs = "adapted tier"
    looks_up = "family"
    plain = False
    depends_on = ("curves", "phases")

    def reach(self, gait, amplitudes) -> tuple:
        """(gait, least <= 0, largest >= 0)."""
        a = real_array("amplitudes", gait.amplitude if amplitudes is None else amplitudes)
        return gait, float(a.min(initial=0.0)), float(a.max(initial=0.0))

    def table(self, system, numerics, gait, least, largest, progress=None) -> Any:
        if least == largest:  # rest, and nothing else
            return family.Family(gait, np.zeros(1), np.zeros((1, numerics.phases // 2, 3)))
        count, phases = numerics.curves, numerics.phases // 2
        return family.fit(partial(_run, system), gait, largest, count, phases, progress, least=least)

    def solves(self, system, numerics, gait, count, phases) -> int:
        return numerics.curves * solved(system, gait, numerics.phases // 2)

    def size(self, system, numerics) -> int:
        return numerics.curves * (numerics.phases // 2) * 3

    def predict(self, table, system, gait, amplitudes, numerics) -> np.ndarray:
        return table.area(np.asarray(gait.amplitude if amplitudes is None else amplitudes, float))


def _run(system, alpha, alphadot) -> np.ndarray:
    return system.run(alpha, alphadot).xi
