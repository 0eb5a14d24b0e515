"""Body velocity for a shape and its rate of change: the zero of the medium's force and moment (paper Eq. 5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.balance.backend import check
from rft.balance.solver import Accuracy, Solved, solve
from rft.bodies.base import Body, joint_speed
from rft.bodies.pieces import PIECES
from rft.checks import in_range, real_array
from rft.contact import assemble
from rft.effects.base import Effect, broken_premises, engine
from rft.laws.base import Medium
from rft.premise import negated

STATUSES = np.array(["sliding", "stuck", "unconverged"])
UNCONVERGED = 2
LEAST = 1e-100  # of a rate that is not 0


class Solution(NamedTuple):
    """Body velocities. xi: (..., 3), body frame, (length/time, length/time, rad/time). residual: (...), the larger of
    force over the whole body's axial yield force (its drag at unit speed in a viscous medium) and moment about its mean
    place over that times the body's length. status: (...), "sliding", "stuck" (some element at rest) or "unconverged".
    iterations: (...), evaluations of the load."""

    xi: np.ndarray
    residual: np.ndarray
    status: np.ndarray
    iterations: np.ndarray

    def __repr__(self) -> str:
        if np.ndim(self.status) == 0:
            xi = ", ".join(f"{x:.6g}" for x in self.xi)
            return f"Solution(xi = ({xi}), {self.status}, residual {self.residual:.1e}, {self.iterations} iterations)"
        kinds = ", ".join(f"{n} {kind}" for kind, n in zip(*np.unique(self.status, return_counts=True)))
        worst = f"residual up to {np.max(self.residual, initial=0.0):.1e}"
        return f"Solution({self.status.shape} samples: {kinds or 'none'}; {worst})"

    def checked(self) -> Solution:
        """This solution, or RuntimeError if any sample is unconverged."""
        bad = int(np.count_nonzero(self.status == "unconverged"))
        if bad:
            worst = float(np.max(self.residual))
            raise RuntimeError(
                f"{bad} of {self.status.size} force balances did not converge (worst residual {worst:.1e}): "
                "raise 'regularisation', or report the scene"
            )
        return self


def body_velocity(
    medium: Medium,
    body: Body,
    alpha,
    alphadot,
    *,
    loads: str = "exact",
    regularisation: float = 1e-6,
    tolerance: float = 1e-10,
    threads: int | None = None,
    effects: Sequence[Effect] = (),
    pieces: int = PIECES,
    backend: str = "auto",
    start=None,
) -> Solution:
    """Body velocity at which the medium's net force and moment on the body vanish.

    alpha, alphadot: (..., joints), rad and rad/time; they broadcast. loads: "exact", or "midpoint:N", "gauss:N".
    regularisation: speed, in body lengths per radian of joint motion |alphadot|, below which dry friction is rounded
    off (v^2 -> v^2 + eps^2); an element at rest creeps at about this speed. tolerance: normalised residual to reach.
    threads: workers, by default one per core. effects: of `rft.effects`, those of the algebraic engine; what is not
    listed is not evaluated. pieces: to a body length, into which effects that vary along an element cut it. backend:
    "auto", "numpy" or "numba" (`rft.balance.backend`). start: (..., 3), body velocities to begin from, in the units of
    xi, such as those of a shape nearby; nan where none is known. A good one takes 5 evaluations in place of 10, a bad
    one costs 12 more, and the answer is the same. Raises ValueError for shapes or values that make no sense, and for a
    medium that pushes."""
    if engine(effects) != "algebraic":
        lost = negated(broken_premises(effects))
        raise ValueError(f"no body velocity follows from shape alone where effects are {lost}: use rft.time_steps")
    assembly = assemble(medium, body, effects, loads, pieces)
    alpha, alphadot = checked_input(body, alpha, alphadot, regularisation, tolerance)
    check(backend)
    if threads is not None:
        in_range("threads", threads, 1, 1024, whole=True)
    batch = alpha.shape[:-1]
    guess = None if start is None else _started(start, batch, body.length)
    alpha, alphadot = (np.ascontiguousarray(x.reshape(-1, body.joints).T) for x in (alpha, alphadot))
    speed = joint_speed(body, alphadot)
    moves = speed > 0
    if not moves.all():  # where joints are at rest so is the body
        moving = np.flatnonzero(moves)
        assembly, alpha, alphadot = assembly.take(moving), alpha[:, moving], alphadot[:, moving]
        guess = None if guess is None else guess[:, moving]

    def problem_at(index):
        if index.size == alpha.shape[1]:
            return assembly.at(alpha, alphadot)
        return assembly.take(index).at(alpha[:, index], alphadot[:, index])

    accuracy = Accuracy(regularisation, tolerance)
    solved = solve(problem_at, speed[moves], accuracy, assembly.law, assembly.points, backend, threads, guess)
    xi, residual, iterations, stuck, limit = solved if moves.all() else _with_rest(solved, moves)
    xi = (xi.T if body.length == 1.0 else xi.T * [body.length, body.length, 1.0]).reshape(*batch, 3)
    status = STATUSES[np.where(residual <= limit, stuck.astype(int), UNCONVERGED)]
    return Solution(xi, *(x.reshape(batch) for x in (residual, status, iterations)))


def _with_rest(solved: Solved, moves: np.ndarray) -> Solved:
    """Return the solution with the samples at rest besides those that move (B,)."""
    size = moves.size
    all_of = Solved(np.zeros((3, size)), np.zeros(size), np.zeros(size, int), np.ones(size, bool), solved.limit)
    for array, found in zip(all_of[:4], solved[:4]):
        array[..., moves] = found
    return all_of


def _started(start, batch: tuple, length: float) -> np.ndarray:
    """start as a guess (3, B) in body lengths; ValueError if it does not broadcast to xi."""
    start = real_array("start", start)
    good = start.shape[-1:] == (3,) and not np.isinf(start).any() and start.ndim <= len(batch) + 1
    try:
        start = np.broadcast_to(start, (*batch, 3)) if good else None
    except ValueError:
        start = None
    if start is None:
        raise ValueError(f"start must be body velocities, {(*batch, 3)}, finite or nan where none is known")
    with np.errstate(over="ignore"):
        return start.reshape(-1, 3).T / [[length], [length], [1.0]]


def checked_input(body, alpha, alphadot, regularisation, tolerance) -> list[np.ndarray]:
    in_range("regularisation", regularisation, 1e-15, 1e3)
    in_range("tolerance", tolerance, 1e-15, 1e3)
    arrays = []
    for name, x, largest in (("alpha", alpha, 1e6), ("alphadot", alphadot, 1e100)):
        x = real_array(name, x)
        if x.ndim == 0 or x.shape[-1] != body.joints:
            raise ValueError(f"{name} must have shape (..., {body.joints}) for this body, got {x.shape}")
        size = np.abs(x)
        if not size.max(initial=0.0) <= largest:
            if not np.isfinite(x).all():
                raise ValueError(f"{name} must be finite, got {float(x[~np.isfinite(x)][0])}")
            raise ValueError(f"{name} must be 0 or of a size that leaves digits to compute with, got {x.ravel()[:4]}")
        if name == "alphadot" and size.min(initial=1.0) < LEAST and size.min(initial=1.0, where=size > 0) < LEAST:
            raise ValueError(f"{name} must be 0 or of a size that leaves digits to compute with, got {x.ravel()[:4]}")
        arrays.append(x)
    if arrays[0].shape == arrays[1].shape:
        return arrays
    try:
        return np.broadcast_arrays(*arrays)
    except ValueError:
        raise ValueError(f"alpha {arrays[0].shape} and alphadot {arrays[1].shape} do not broadcast") from None
