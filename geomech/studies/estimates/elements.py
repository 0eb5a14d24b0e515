"""Continuous bodies: the number of their straight elements is a numerical setting, and
error estimates cover it.

A body is continuous if it has ``elements``, a number, and ``with_elements``, which
returns the body with another number of them; ``resampled`` carries shapes over. Links
of a chain are elements that really exist, and cause no error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems.base import System
from geomech.mathematics.systems.framed import Framed
from rft.formulas import se2

MAX_ELEMENTS = 2000  # of a body
MIN_ELEMENTS = 3
# Times the error by theory. In a sample of serpenoids, arcs and sines in fluid and
# sand, of 8 elements and more per wave, it covers the change to 800 elements; the
# median estimate is 2.6 times that change.
SAFETY = 2.5
SLOWEST = 0.5  # factor of the error from halving elements; by theory 1/4


def continuous_body(system: System) -> Any:
    """Return the continuous body of a system; None without one."""
    swimmer = system.inner if isinstance(system, Framed) else system
    body = getattr(swimmer, "body", None)
    if not getattr(body, "elements", None):
        return None
    return body


def n_elements(system: System) -> int:
    """Return the number of elements of a continuous body; 0 for other systems."""
    body = continuous_body(system)
    return body.elements if body else 0


def is_refinable(system: System) -> bool:
    """Return whether a continuous body can have more elements and keep its frame, which
    must not be the frame of one element."""
    body = continuous_body(system)
    if body is None or getattr(body, "lengths", None) is not None:
        return False  # splines through given links hold no more than the links
    return isinstance(system, Framed) or body.frame == "mean"


def with_elements(system: System, count: int) -> System:
    """Return the system with its continuous body made of ``count`` elements; ValueError
    if there is no such body."""
    body = continuous_body(system).with_elements(count)
    if isinstance(system, Framed):
        return replace(system, inner=replace(system.inner, body=body))
    return replace(system, body=body)


@dataclass(frozen=True)
class ResampledGait:
    """The gait of a continuous body, for the same body of ``count`` elements."""

    gait: Any
    body: Any
    count: int

    def __getattr__(self, name: str) -> Any:
        return getattr(object.__getattribute__(self, "gait"), name)

    @property
    def joints(self) -> int:
        return self.count - 1

    @property
    def middle(self) -> np.ndarray:
        return self.body.resampled(self.gait.middle, self.count)

    def largest(self, amplitudes=None) -> float:
        """Return the largest bend, which more elements reduce."""
        if not hasattr(self.gait, "largest"):
            return 0.0
        return self.gait.largest(amplitudes)

    def cycle(self, phases: int, amplitudes=None) -> tuple[np.ndarray, ...]:
        """Return alpha and alphadot as `Gait.cycle` does."""
        shapes = self.gait.cycle(phases, amplitudes)
        return tuple(self.body.resampled(x, self.count) for x in shapes)


def gait_with_elements(gait: Gait, system: System, count: int) -> Any:
    """Return the gait of a system for its body of ``count`` elements."""
    if system.joints == with_elements(system, count).joints:
        return gait
    if hasattr(gait, "with_elements"):
        return gait.with_elements(count)
    return ResampledGait(gait, continuous_body(system), count)


class CoarserSystem(NamedTuple):
    """A system of fewer elements. ratio: elements of the finer one over its own."""

    system: System
    ratio: float


def coarser_systems(system: System) -> list[CoarserSystem]:
    """Return the system with half and a quarter of its elements, or about as many where
    the body takes other numbers only; fewer systems where it takes none. A body that
    cannot have half is returned with twice its elements, whose ratio is below 1."""
    count = n_elements(system)
    if not count:
        return []
    found: list[CoarserSystem] = []
    finer = count
    while len(found) < 2:
        fewer = _largest_number(system, finer // 2, -(-finer // 3))
        if fewer is None:
            break
        found.append(CoarserSystem(with_elements(system, fewer), count / fewer))
        finer = fewer

    if not found and 2 * count <= MAX_ELEMENTS and _can_have(system, 2 * count):
        found.append(CoarserSystem(with_elements(system, 2 * count), 0.5))
    return found


def _largest_number(system: System, most: int, least: int) -> int | None:
    """Return the largest number of elements within limits that the body takes."""
    for count in range(most, max(least, MIN_ELEMENTS) - 1, -1):
        if _can_have(system, count):
            return count
    return None


def _can_have(system: System, count: int) -> bool:
    try:
        with_elements(system, count)
    except ValueError:  # such as arcs that do not divide the elements
        return False
    return True


def error_by_elements(
    system: System,
    alpha,
    alphadot,
    values: np.ndarray,
    run: Callable,
    distance: Callable,
) -> np.ndarray:
    """Return the error of ``values`` that the elements cause, from runs with fewer.

    alpha, alphadot: (..., N, d), shapes and rates. values: run(system, alpha,
    alphadot).
    run: called with a system of other elements, and the shapes and rates for it.
    distance: called with two such values, returns their distances, >= 0."""
    body = continuous_body(system)
    changes: list[np.ndarray] = []
    ratios = [1.0]
    previous = values
    for coarser, ratio in coarser_systems(system):
        count = n_elements(coarser)
        result = run(
            coarser, body.resampled(alpha, count), body.resampled(alphadot, count)
        )
        changes.append(distance(previous, result))
        ratios.append(ratio)
        previous = result
    if not changes:
        return 0.0 * distance(values, values)
    return error_of_finest(changes, ratios)


def error_of_finest(changes: list[np.ndarray], ratios: list[float]) -> np.ndarray:
    """Return the error of the finest of some results from the changes between
    neighbours.

    ratios: elements of the finest over those of each result, 1 first. By theory the
    error is of order 2. The larger of the errors that both changes give by that order
    counts, and more where the changes fall more slowly, or where there is only one."""
    by_order = []
    for change, fine, coarse in zip(changes, ratios, ratios[1:]):
        by_order.append(change / abs(coarse**2 - fine**2))
    if ratios[1] < 1.0:  # a finer body shows three quarters of the error
        return SAFETY * by_order[0]
    if len(by_order) == 1:
        return SAFETY * by_order[0] * _slowness(np.array(SLOWEST))
    first, second = by_order
    r = np.clip(first / np.maximum(second, 1e-300) / 4, 0.25, SLOWEST)
    return SAFETY * np.maximum(first, second) * _slowness(r)


def _slowness(r: np.ndarray) -> np.ndarray:
    """Return the error r / (1 - r) that remains after a change, over that of r =
    1/4."""
    return 3 * r / (1 - r)


def mean_poses(system: System, net: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Return net poses (..., 3) in the frame "mean" of a continuous body, from those in
    the frame of one of its elements, which lies elsewhere if there are fewer. alpha:
    (..., d), the shape at the start."""
    body = continuous_body(system)
    if body is None or isinstance(system, Framed) or body.frame == "mean":
        return net
    h, _ = body.frame_pose("mean", alpha, 0.0 * alpha)
    return se2.compose(se2.inverse(h), se2.compose(net, h))
