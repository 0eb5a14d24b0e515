"""Limits of joints: one for all, one for each, or a lowest and a highest angle for
each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geomech.core.errors import check_angle
from geomech.mathematics.systems.base import System
from geomech.mathematics.systems.capabilities import stored_table
from geomech.mathematics.systems.framed import Framed
from geomech.scenes.model import Scene
from rft.core.checks import in_range, is_number, real_array
from rft.core.refusal import Refusal, formatted

LEAST_RANGE = 1e-6  # rad, between two limits; assumed
LARGEST_LIMIT = 100.0  # rad; assumed
Limits = float | tuple[tuple[float, float], ...]
LimitsArgument = float | Sequence[float] | Sequence[Sequence[float]] | None


def checked_limits(scene: Scene, limits: LimitsArgument, phases: int) -> Limits:
    """Return limits as `geomech.studies.optimisation.loops.Loops` takes them: a largest
    |alpha| for all joints, or (lowest, highest) for each, rad.

    None stands for the extent of the field, or of the scene's gait where that is
    larger; for the whole field of a stored table. Refusal for limits outside the field
    of a table or frame."""
    system = scene.system
    low, high = field_edges(system)
    if limits is None:
        if stored_table(system, "connection"):
            return _simplified(low, high)
        reach = float(np.abs(scene.gait.cycle(phases)[0]).max())
        available = float(np.minimum(-low, high).min())
        limits = min(max(scene.numerics.extent, reach), available)

    if is_number(limits):
        in_range("``limits``", limits, LEAST_RANGE, LARGEST_LIMIT)
        pairs = np.array([[-float(limits), float(limits)]] * system.joints)
    else:
        pairs = _pairs(limits, system.joints)
    if system.traits.joint_angles:
        check_angle("a limit of joints", float(np.abs(pairs).max()))

    lowest, highest = pairs.T
    slack = 1e-9 * (1 + np.abs(pairs.T))
    if (lowest < low - slack[0]).any() or (highest > high + slack[1]).any():
        field = ", ".join(f"{a:g} to {b:g}" for a, b in zip(low, high))
        text = formatted(limits)
        if is_number(limits):
            text = f"{limits:g}"
        raise Refusal(
            f"``limits`` {text} lies outside the field of the scene",
            instead=f"{field}; stay within it",
        )
    return _simplified(np.maximum(lowest, low), np.minimum(highest, high))


def field_edges(system: System) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest shapes, (joints,) each, of the field of a table
    or frame; infinite for a system without one."""
    table = stored_table(system, "connection")
    if table:
        axes = table.axes
    elif isinstance(system, Framed):
        axes = system.axes
    else:
        axes = [(-np.inf, np.inf)] * system.joints
    return np.array([a[0] for a in axes]), np.array([a[-1] for a in axes])


def _pairs(limits, joints: int) -> np.ndarray:
    """Return (joints, 2) from pairs, or from one number for each joint."""
    pairs = real_array("``limits``", limits)
    if pairs.ndim == 1:
        pairs = np.stack([-pairs, pairs], -1)
    if (
        pairs.shape != (joints, 2)
        or not (np.abs(pairs) <= LARGEST_LIMIT).all()
        or not (pairs[:, 1] - pairs[:, 0] >= LEAST_RANGE).all()
    ):
        raise Refusal(
            f"``limits`` takes one number, one for each of {joints} joints, or as "
            "many ranges from low to high",
            value=limits,
        )
    return pairs


def _simplified(low: np.ndarray, high: np.ndarray) -> Limits:
    """Return one number where all limits are equal and symmetric, else pairs."""
    if (low == -high[0]).all() and (high == high[0]).all():
        return float(high[0])
    return tuple(zip(low.tolist(), high.tolist()))
