"""Velocities of chains without effects by compiled code, from shapes and rates at once:
for these, poses of links and records of the balance would take longer than its
solution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rft.balance.compiled import kernel_number, kernels_of, plain
from rft.balance.listening import Listener, listener
from rft.balance.solver import (
    COMPILED_WORTH,
    QUICK,
    STUCK_BELOW,
    Accuracy,
    begin,
    limits_of,
)
from rft.bodies.base import body_size
from rft.bodies.chain import Chain
from rft.core.threads import run_shares, thread_count
from rft.effects.contact import Assembly
from rft.formulas.link import Additions
from rft.laws.batch import MediumBatch
from rft.laws.records import is_compilable

NO_ADDITIONS = Additions(False, False, False, False, False)
NO_MODES = np.zeros((0, 0))
SAMPLES_TOGETHER = 32768  # after which a thread looks whether to stop
ALONE = 2 * COMPILED_WORTH - 1  # samples for which no second thread pays


class ChainNumbers(NamedTuple):
    """A chain and its balance without effects, as numbers.

    fractions: (n,), lengths of the links over that of the body. modes: (joints, n - 1),
    rows of joint angles, none where the shape is the joint angles. frame_link: index of
    the link that carries the frame, -1 for the mean. length: of the body. force,
    force_by_speed, force_above_1: unit of residuals at a speed v of the joints, force +
    force_by_speed v + force_above_1 max(v - 1, 0) (`rft.effects.contact.force_scale`).
    law_at_speed: whether loads are computed at that speed, else at 1. stuck_below:
    speed of an element at rest, 0 in a linear medium."""

    fractions: np.ndarray
    modes: np.ndarray
    frame_link: int
    length: float
    force: float
    force_by_speed: float
    force_above_1: float
    law_at_speed: bool
    stuck_below: float


def chain_numbers(assembly: Assembly, accuracy: Accuracy) -> ChainNumbers | None:
    """Return the numbers of an assembly; None unless it is a chain without effects
    under a law that compiles and whose unit of residuals is of that form."""
    body = assembly.body
    viscous = getattr(assembly.medium, "viscous", None)
    has_form = assembly.homogeneous or assembly.linear or viscous is not None
    is_plain = type(body) is Chain and not assembly.effects
    is_plain = is_plain and not isinstance(assembly.medium, MediumBatch)
    if not (is_plain and has_form and is_compilable(assembly.law)):
        return None
    unit = assembly.axial_drag
    force = (unit, 0.0, 0.0)
    if not assembly.homogeneous:
        force = (unit, 0.0, float(viscous[0]))
    if assembly.linear:
        force = (0.0, unit, 0.0)
    stuck_below = STUCK_BELOW * accuracy.rounding
    if assembly.linear:
        stuck_below = 0.0
    modes = NO_MODES
    if body.modes is not None:
        modes = body.mode_rows
    link = body.frame_link
    return ChainNumbers(
        plain(body.fractions),
        plain(modes),
        -1 if link is None else link,
        float(body_size(body)),
        *force,
        not assembly.homogeneous,
        stuck_below,
    )


class ChainBalance:
    """The balance of a chain, ready for many calls."""

    def __init__(self, assembly: Assembly, numbers: ChainNumbers, accuracy: Accuracy):
        limits = limits_of(assembly, accuracy)
        self._assembly = assembly
        self._arguments = (
            tuple(map(kernel_number, assembly.law)),
            numbers,
            NO_ADDITIONS,
            begin(QUICK, assembly.linear, limits),
            limits,
        )

    def solve(
        self, alpha: np.ndarray, alphadot: np.ndarray, threads: int | None
    ) -> tuple[tuple[np.ndarray, ...], int]:
        """Return the fields of a `rft.Solution` of one descent at shapes and rates
        (B, joints), and how many samples it leaves unsolved."""
        size = len(alpha)
        found = (
            np.empty((size, 3)),
            np.empty(size),
            np.empty(size, np.uint8),
            np.empty(size, np.int32),
        )
        report = listener()
        if size <= ALONE:
            return found, self._descend(alpha, alphadot, found, report)
        unsolved = []

        def descend(share: range, stop) -> None:
            for first in range(share.start, share.stop, SAMPLES_TOGETHER):
                if stop.is_set():
                    return
                part = slice(first, min(first + SAMPLES_TOGETHER, share.stop))
                here = tuple(x[part] for x in found)
                unsolved.append(
                    self._descend(alpha[part], alphadot[part], here, report)
                )

        step = math.ceil(size / thread_count(threads, size // COMPILED_WORTH))
        shares = [range(k, min(k + step, size)) for k in range(0, size, step)]
        run_shares(descend, shares)
        return found, sum(unsolved)

    def _descend(self, alpha, alphadot, found: tuple, report: Listener) -> int:
        """Write the solutions of one descent to ``found``, report how many there are,
        and return the number of samples that it leaves unsolved."""
        assembly = self._assembly
        velocities = kernels_of(type(assembly.law)).velocities
        # Copies: kernels take contiguous arrays that may be written to.
        motion = np.array(alpha, order="C"), np.array(alphadot, order="C")
        moving, unsolved = velocities(*self._arguments, *motion, found)
        if moving > unsolved:
            report(moving - unsolved, assembly.n_law_points, assembly.linear)
        return unsolved
