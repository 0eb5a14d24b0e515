"""Body velocity at a shape and a rate of change of shape: the zero of the medium's
force and moment (paper Eq. 5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rft.balance.backend import check, solves_compiled
from rft.balance.chains import ChainBalance, chain_numbers
from rft.balance.solver import Accuracy, Solutions, solve
from rft.bodies.base import Body, body_size, joint_speed
from rft.bodies.pieces import PIECES
from rft.core.checks import in_range, real_array
from rft.core.premise import negation
from rft.core.refusal import Refusal, require
from rft.effects.base import Effect, broken_premises, engine
from rft.effects.contact import Assembly, Problem, assemble
from rft.formulas.newton import UNCONVERGED
from rft.laws.base import Medium, cached_if_immutable

STATUSES = np.array(["sliding", "stuck", "unconverged"])
SAMPLES_TOGETHER = 2**20  # that are solved at once, for the memory they take
LEAST_RATE = 1e-100  # other than 0
FEW = 16  # numbers, which Python compares sooner than NumPy


class Solution(NamedTuple):
    """Body velocities.

    xi: (..., 3), in the body frame, (length/time, length/time, rad/time). residual:
    (...), the larger of force and of moment about the body's mean place, over the axial
    yield force of the whole body (its drag at unit speed in a viscous medium) and over
    that times the body's length. code: (...), number of the status in STATUSES:
    "sliding", "stuck" (both ends of an element are slower than 10 times the
    regularisation) or "unconverged". iterations: (...), number of evaluations of the
    load. They take 37 bytes a sample.

    A sample is unconverged where its residual exceeds the tolerance plus 1e-14 of the
    largest force, the drag across the whole body over that along it: forces so large
    cancel to that many digits. With drag across 1e6 times as large, residuals reach
    1e-8 and velocities keep 13 digits.

    The residual is that of the regularised law. Near sticking, the regularisation moves
    velocities whose status is "sliding" by up to some 200 times itself, and those of
    one random shape in 300 by more than 10 times: a smaller regularisation shows by how
    much.

    Examples
    --------
    >>> from rft import Chain, Viscous, body_velocity
    >>> shapes = [[0.5, 0.3], [0.2, 0.1]]
    >>> solution = body_velocity(Viscous(), Chain(), shapes, [1.0, 0.0])
    >>> solution.xi.shape, bool((solution.residual < 1e-9).all())
    ((2, 3), True)
    """

    xi: np.ndarray
    residual: np.ndarray
    code: np.ndarray
    iterations: np.ndarray

    @property
    def status(self) -> np.ndarray:
        """The status (...) of each sample, in words."""
        return STATUSES[self.code]

    def __repr__(self) -> str:
        if np.ndim(self.code) == 0:
            xi = ", ".join(f"{x:.6g}" for x in self.xi)
            return (
                f"Solution(xi = ({xi}), {self.status}, residual {self.residual:.1e}, "
                f"{self.iterations} iterations)"
            )
        kinds = ", ".join(
            f"{n} {STATUSES[code]}"
            for code, n in zip(*np.unique(self.code, return_counts=True))
        )
        worst = f"residual up to {np.max(self.residual, initial=0.0):.1e}"
        return f"Solution({self.code.shape} samples: {kinds or 'none'}; {worst})"

    def checked(self) -> Solution:
        """Return this solution; RuntimeError if any sample is unconverged."""
        unconverged = int(np.count_nonzero(self.code == UNCONVERGED))
        if unconverged:
            worst = float(np.max(self.residual))
            raise RuntimeError(
                f"{unconverged} of {self.code.size} force balances did not converge "
                f"(worst residual {worst:.1e}): "
                "raise 'regularisation', or report the scene"
            )
        return self


def body_velocity(
    medium: Medium,
    body: Body,
    alpha: ArrayLike,
    alphadot: ArrayLike,
    *,
    loads: str = "exact",
    regularisation: float = 1e-6,
    tolerance: float = 1e-10,
    threads: int | None = None,
    effects: Sequence[Effect] = (),
    pieces: int = PIECES,
    backend: str = "auto",
    start: ArrayLike | None = None,
) -> Solution:
    """Return the body velocity at which the medium's net force and moment on the body
    vanish.

    Parameters
    ----------
    medium : a force law of `rft.laws`, or any `rft.laws.base.Medium`.
    body : a body of `rft.bodies`, or any `rft.bodies.base.Body`.
    alpha, alphadot : arrays (..., joints) that broadcast, shapes in rad and their rates
        in rad/time.
    loads : average of the law over an element, "exact", "midpoint:N" or "gauss:N"
        (`rft.formulas.quadrature`).
    regularisation : speed, body lengths per radian of joint motion |alphadot|, below
        which dry friction is rounded off (v^2 -> v^2 + rounding^2); an element at rest
        creeps at about this speed.
    tolerance : largest residual of a solution, to which roundoff is added, 1e-14 of the
        largest force (`Solution`).
    threads : most threads, by default one a core.
    effects : effects of `rft.effects` of the algebraic engine.
    pieces : number to a body length of the pieces into which effects that vary along an
        element cut it.
    backend : "auto", "numpy" or "numba" (`rft.balance.backend`).
    start : array (..., 3), body velocities to start from in the units of xi, such as
        those of a shape nearby; nan where none is known. The solution is the same; a
        good start takes 5 evaluations in place of 10, a bad one 12 more.

    Raises
    ------
    ValueError
        For arguments of another shape or out of bounds, for a medium that pushes, and
        for effects of another engine.

    Examples
    --------
    >>> from rft import Chain, Granular, body_velocity
    >>> solution = body_velocity(Granular(1.8, 0.24), Chain(), [0.5, 0.3], [1.0, 0.0])
    >>> solution.xi.round(4), str(solution.status)
    (array([ 0.015 ,  0.0161, -0.1929]), 'sliding')
    """
    check(backend)
    if effects != ():
        engine(effects)  # refuses what is no list of effects
    prepared = _prepared(
        medium,
        body,
        loads,
        regularisation,
        tolerance,
        threads,
        tuple(effects),
        pieces,
        backend,
    )
    return prepared(alpha, alphadot, start)


class BodyVelocity:
    """`body_velocity` of one body in one medium, for many calls: medium, body, effects
    and options are checked, and assembled, once.

    Parameters
    ----------
    medium, body, loads, regularisation, tolerance, threads, effects, pieces, backend :
        as in `body_velocity`.

    A call takes ``alpha`` and ``alphadot``, arrays (..., joints) that broadcast, shapes
    in rad and their rates in rad/time, and ``start`` where velocities are known; it
    returns a `Solution`, the same to the last digit as that of `body_velocity`.

    Raises
    ------
    ValueError
        As `body_velocity`, for shapes and rates at the call.

    Examples
    --------
    >>> from rft import BodyVelocity, Chain, Granular
    >>> velocity = BodyVelocity(Granular(1.8, 0.24), Chain())
    >>> velocity([0.5, 0.3], [1.0, 0.0]).xi.round(4)
    array([ 0.015 ,  0.0161, -0.1929])
    >>> velocity([[0.5, 0.3], [0.2, 0.1]], [1.0, 0.0]).xi.shape
    (2, 3)
    """

    def __init__(
        self,
        medium: Medium,
        body: Body,
        *,
        loads: str = "exact",
        regularisation: float = 1e-6,
        tolerance: float = 1e-10,
        threads: int | None = None,
        effects: Sequence[Effect] = (),
        pieces: int = PIECES,
        backend: str = "auto",
    ):
        if effects != () and engine(effects) != "algebraic":
            broken = negation(broken_premises(effects))
            raise Refusal(
                "no body velocity follows from shape alone because the effects "
                f"are {broken}",
                instead="use rft.time_steps",
            )
        self._assembly = assemble(medium, body, effects, loads, pieces)
        check_accuracy(regularisation, tolerance)
        check(backend)
        if threads is not None:
            in_range("threads", threads, 1, 1024, whole=True)
        self._body = body
        self._length = body_size(body)
        self._accuracy = Accuracy(regularisation, tolerance)
        self._threads = threads
        self._backend = backend
        numbers = chain_numbers(self._assembly, self._accuracy)
        self._chain = None
        if numbers is not None:
            self._chain = ChainBalance(self._assembly, numbers, self._accuracy)

    def __call__(
        self, alpha: ArrayLike, alphadot: ArrayLike, start: ArrayLike | None = None
    ) -> Solution:
        """Return the body velocity at shapes and rates."""
        alpha, alphadot = checked_motion(self._body, alpha, alphadot)
        batch = alpha.shape[:-1]
        guess = None
        if start is not None:
            guess = _guess(start, batch, self._length)
        alpha = alpha.reshape(-1, self._body.joints)
        alphadot = alphadot.reshape(-1, self._body.joints)
        size = len(alpha)
        compiled = solves_compiled(self._backend, self._assembly.law)
        if self._chain is not None and compiled and guess is None and size:
            found = self._of_chain(alpha, alphadot)
        else:
            found = self._solution_in_parts(alpha, alphadot, guess)
        return Solution(
            found.xi.reshape(*batch, 3), *[x.reshape(batch) for x in found[1:]]
        )

    def _of_chain(self, alpha: np.ndarray, alphadot: np.ndarray) -> Solution:
        """Return the solution at shapes and rates (B, joints) of a chain; what one
        descent leaves unsolved is solved as of any body."""
        fields, unsolved = self._chain.solve(alpha, alphadot, self._threads)
        found = Solution(*fields)
        if unsolved:
            i = np.flatnonzero(found.code == UNCONVERGED)
            rest = self._solution_in_parts(alpha[i], alphadot[i], None)
            for whole, values in zip(found, rest):
                whole[i] = values
        return found

    def _solution_in_parts(
        self, alpha: np.ndarray, alphadot: np.ndarray, guess: np.ndarray | None
    ) -> Solution:
        """Return the solution at shapes and rates (B, joints) from guesses (3, B) in
        body lengths, of `SAMPLES_TOGETHER` samples at a time."""
        size = len(alpha)
        if size <= SAMPLES_TOGETHER:
            return self._solution(self._assembly, alpha, alphadot, guess)
        found = Solution(
            np.empty((size, 3)),
            np.empty(size),
            np.empty(size, np.uint8),
            np.empty(size, np.int32),
        )
        for first in range(0, size, SAMPLES_TOGETHER):
            part = slice(first, first + SAMPLES_TOGETHER)
            part_guess = None
            if guess is not None:
                part_guess = guess[:, part]
            solution = self._solution(
                self._assembly.take(part), alpha[part], alphadot[part], part_guess
            )
            for whole, values in zip(found, solution):
                whole[part] = values
        return found

    def _solution(
        self,
        assembly: Assembly,
        alpha: np.ndarray,
        alphadot: np.ndarray,
        guess: np.ndarray | None,
    ) -> Solution:
        """Return the solution at shapes and rates (B, joints) from guesses (3, B) in
        body lengths."""
        alpha = np.ascontiguousarray(alpha.T)
        alphadot = np.ascontiguousarray(alphadot.T)
        speed = joint_speed(self._body, alphadot)
        samples = Samples(assembly, alpha, alphadot, speed, guess)
        solved = _solved(samples, self._accuracy, self._backend, self._threads)
        within_limit = solved.residual <= solved.limit
        xi = np.ascontiguousarray(solved.xi.T)
        if self._length != 1.0:
            xi[:, :2] *= self._length
        return Solution(
            xi,
            solved.residual,
            np.where(within_limit, solved.stuck, UNCONVERGED).astype(np.uint8),
            solved.iterations.astype(np.int32),
        )


@cached_if_immutable
def _prepared(
    medium,
    body,
    loads,
    regularisation,
    tolerance,
    threads,
    effects,
    pieces,
    backend,
) -> BodyVelocity:
    return BodyVelocity(
        medium,
        body,
        loads=loads,
        regularisation=regularisation,
        tolerance=tolerance,
        threads=threads,
        effects=effects,
        pieces=pieces,
        backend=backend,
    )


class Samples(NamedTuple):
    """Samples of a body's motion, to be solved.

    alpha, alphadot: (joints, B), shapes and rates. speed: (B,), of the joints. guess:
    (3, B), velocities in body lengths to start from; None for none."""

    assembly: Assembly
    alpha: np.ndarray
    alphadot: np.ndarray
    speed: np.ndarray
    guess: np.ndarray | None

    def take(self, index: np.ndarray) -> Samples:
        """Return some samples by their numbers."""
        guess = self.guess
        if guess is not None:
            guess = guess[:, index]
        return Samples(
            self.assembly.take(index),
            self.alpha[:, index],
            self.alphadot[:, index],
            self.speed[index],
            guess,
        )

    def problem(self, index: np.ndarray) -> Problem:
        """Return the problem of some samples by their numbers, in increasing order."""
        if index.size == self.speed.size:
            return self.assembly.problem(self.alpha, self.alphadot, self.speed)
        return self.assembly.take(index).problem(
            self.alpha[:, index], self.alphadot[:, index], self.speed[index]
        )


def _solved(
    samples: Samples, accuracy: Accuracy, backend: str, threads: int | None
) -> Solutions:
    """Return the solutions of samples; a body whose joints are at rest is at rest."""
    moving = samples.speed > 0
    if not moving.all():
        samples = samples.take(np.flatnonzero(moving))
    solved = solve(
        samples.problem,
        samples.speed,
        accuracy,
        samples.assembly,
        backend,
        threads,
        samples.guess,
    )
    return _with_samples_at_rest(solved, moving)


def _with_samples_at_rest(solved: Solutions, moving: np.ndarray) -> Solutions:
    """Return the solution of all samples from that of those which are ``moving``
    (B,)."""
    size = moving.size
    if solved.stuck.size == size:
        return solved
    full = Solutions(
        np.zeros((3, size)),
        np.zeros(size),
        np.zeros(size, int),
        np.ones(size, bool),
        solved.limit,
    )
    for array, values in zip(full[:4], solved[:4]):
        array[..., moving] = values
    return full


def _guess(start, batch: tuple, length: float) -> np.ndarray:
    """Return ``start`` as a guess (3, B) in body lengths; ValueError if it does not
    broadcast to xi."""
    start = real_array("start", start)
    shape = *batch, 3
    require(
        start.shape[-1:] == (3,)
        and _broadcasts(start.shape, shape)
        and not np.isinf(start).any(),
        f"start must be body velocities, {shape}, finite, or nan where unknown",
    )
    start = np.broadcast_to(start, shape)
    with np.errstate(over="ignore"):
        return start.reshape(-1, 3).T / [[length], [length], [1.0]]


def _broadcasts(shape: tuple, to: tuple) -> bool:
    """Return whether an array of one shape broadcasts to another."""
    try:
        return np.broadcast_shapes(shape, to) == to
    except ValueError:
        return False


def check_accuracy(regularisation: float, tolerance: float) -> None:
    """Raise ValueError unless regularisation and tolerance are within bounds."""
    in_range("regularisation", regularisation, 1e-15, 1e3)
    in_range("tolerance", tolerance, 1e-15, 1e3)


def checked_input(body, alpha, alphadot, regularisation, tolerance) -> list[np.ndarray]:
    """Return `checked_motion` of shapes and rates; ValueError unless regularisation and
    tolerance are within bounds, too."""
    check_accuracy(regularisation, tolerance)
    return checked_motion(body, alpha, alphadot)


def checked_motion(body, alpha, alphadot) -> list[np.ndarray]:
    """Return shapes and rates as arrays of one shape (..., joints); ValueError for
    arguments of another shape or out of bounds."""
    alpha = _checked("alpha", alpha, body.joints, 0.0, 1e6)
    alphadot = _checked("alphadot", alphadot, body.joints, LEAST_RATE, 1e100)
    if alpha.shape == alphadot.shape:
        return [alpha, alphadot]
    try:
        shape = np.broadcast_shapes(alpha.shape, alphadot.shape)
    except ValueError:
        raise Refusal(
            f"alpha {alpha.shape} and alphadot {alphadot.shape} do not broadcast"
        ) from None
    return [np.broadcast_to(alpha, shape), np.broadcast_to(alphadot, shape)]


def _checked(
    name: str, x: ArrayLike, joints: int, least: float, largest: float
) -> np.ndarray:
    """Return x as an array (..., joints) of floats; ValueError with its name unless its
    numbers are 0, or of a size from ``least`` to ``largest``."""
    x = real_array(name, x)
    if x.ndim == 0 or x.shape[-1] != joints:
        raise Refusal(
            f"{name} must have shape (..., {joints}) for this body", value=x.shape
        )
    if _has_digits(x, least, largest):
        return x
    if not np.isfinite(x).all():
        raise Refusal(f"{name} must be finite, got {float(x[~np.isfinite(x)][0])}")
    raise Refusal(
        f"{name} must be 0 or of a size that floating-point numbers resolve, got "
        f"{x.ravel()[:4]}"
    )


def _has_digits(x: np.ndarray, least: float, largest: float) -> bool:
    """Return whether all numbers are 0, or of a size from ``least`` to ``largest``."""
    if x.size <= FEW:
        return all(v == 0.0 or least <= abs(v) <= largest for v in x.ravel().tolist())
    size = np.abs(x)
    if not size.max() <= largest:
        return False
    # The second minimum takes longer, and is only needed where some number is 0.
    return bool(
        size.min() >= least or size.min(initial=np.inf, where=size > 0) >= least
    )
