"""Limits of joints: one for all, one for each, or a lowest and a highest angle for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geomech.core.errors import check_angle
from geomech.scenes.model import Scene
from geomech.systems.base import System
from geomech.systems.capabilities import stored_table
from geomech.systems.framed import Framed
from rft.core.checks import in_range, is_number, real_array
from rft.core.refusal import Refusal, formatted

LEAST, MOST = 1e-6, 100.0  # rad: of the range between two limits, and of a limit
Limits = float | tuple[tuple[float, float], ...]
LimitsArgument = float | Sequence[float] | Sequence[Sequence[float]] | None


def checked_limits(scene: Scene, limits: LimitsArgument, phases: int) -> Limits:
    """Return ``limits`` as `geomech.optimisation.loops.Loops` takes it: a largest |alpha| for all joints, or (lowest,
    highest) for each.

    None stands for the extent of the field, or of the scene's gait where that is larger; for all of a stored table.
    Refusal for limits outside the field of a table or frame."""
    system = scene.system
    low, high = edges(system)
    if limits is None:
        if stored_table(system, "connection"):
            return _simplified(low, high)
        n = scene.numerics
        limits = min(
            max(n.extent, float(np.abs(scene.gait.cycle(phases)[0]).max())),
            float(np.minimum(-low, high).min()),
        )
    if is_number(limits):
        in_range("``limits``", limits, LEAST, MOST)
        pairs = np.array([[-float(limits), float(limits)]] * system.joints)
    else:
        pairs = _pairs(limits, system.joints)
    if system.traits.joint_angles:
        check_angle("a limit of joints", float(np.abs(pairs).max()))
    slack = 1e-9 * (1 + np.abs(pairs))
    if (pairs[:, 0] < low - slack[:, 0]).any() or (
        pairs[:, 1] > high + slack[:, 1]
    ).any():
        field = ", ".join(f"{a:g} to {b:g}" for a, b in zip(low, high))
        raise Refusal(
            f"``limits`` {_text(limits)} lies outside the field that the scene has",
            instead=f"{field}; keep to it",
        )
    return _simplified(np.maximum(pairs[:, 0], low), np.minimum(pairs[:, 1], high))


def edges(system: System) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest shapes, (joints,) each, of the field of a table or a frame; infinite without one."""
    own = stored_table(system, "connection")
    axes = (
        own.axes
        if own
        else system.axes
        if isinstance(system, Framed)
        else [(-np.inf, np.inf)] * system.joints
    )
    return np.array([a[0] for a in axes]), np.array([a[-1] for a in axes])


def _pairs(limits, joints: int) -> np.ndarray:
    """Return (joints, 2) from pairs, or from one number for each joint."""
    x = real_array("``limits``", limits)
    x = np.stack([-x, x], -1) if x.ndim == 1 else x
    good = (
        x.shape == (joints, 2)
        and (np.abs(x) <= MOST).all()
        and (x[:, 1] - x[:, 0] >= LEAST).all()
    )
    if not good:
        raise Refusal(
            f"``limits`` takes a number, one for each of {joints} joints, or as many from low to high",
            value=limits,
        )
    return x


def _simplified(low: np.ndarray, high: np.ndarray) -> Limits:
    """Return one number where all limits are equal and symmetric, else pairs."""
    if (low == -high[0]).all() and (high == high[0]).all():
        return float(high[0])
    return tuple(zip(low.tolist(), high.tolist()))


def _text(limits) -> str:
    return f"{limits:g}" if is_number(limits) else formatted(limits)
