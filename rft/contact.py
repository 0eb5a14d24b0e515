"""The balance of forces as a value: records of arrays, which effects change and which both drivers take.

Every array has the samples on its last axis, or one column there for all of them. So one function each takes samples
out of a record (`take`), and applies a function to its arrays (`mapped`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rft.balance.newton import Frame
from rft.bodies.base import Body, Elements, checked_body, joint_speed
from rft.bodies.pieces import subdivide
from rft.checks import in_range
from rft.laws.base import cached_if_immutable, is_linear, require_drag, speed_exponent
from rft.laws.records import record
from rft.link import Factor, Incline, Memory
from rft.momentum import Momenta

MOST_PIECES = 10_000  # to a body length
ONE, ZERO = np.ones((1, 1)), np.zeros((1, 1))
NO_FACTOR = Factor(ONE, ONE, ONE)
NO_INCLINE = Incline(ONE, ZERO, ONE, ZERO, ZERO)
NO_MEMORY = Memory(ONE, ONE, ZERO, ONE, ONE, -ONE, ZERO)


class Contact(NamedTuple):
    """Elements (n, B) on the ground. station: (n, 1), their centres along the body, 0 at its tail, 1 at its head.
    buried: (n, 1), 1 where they lie at the body's depth, else 0. factor: of their drag. incline: of the ground."""

    elements: Elements
    station: np.ndarray
    buried: np.ndarray
    factor: Factor = NO_FACTOR
    incline: Incline = NO_INCLINE

    def multiplied(self, forward, backward, across) -> Contact:
        """Return the contact with its drag times these factors, numbers or arrays that broadcast to (n, B)."""
        f = self.factor
        products = f.forward * forward, f.backward * backward, f.across * across
        return self._replace(factor=Factor(*(np.atleast_2d(x) for x in products)))

    def joined(self, other: Contact) -> Contact:
        """Return the elements of both contacts, those of the other last."""

        def one(a, b):
            columns = max(a.shape[-1], b.shape[-1])
            return np.concatenate([np.broadcast_to(a, (n, columns)), np.broadcast_to(b, (m, columns))])

        n, m = len(self.station), len(other.station)
        return mapped(one, self, other) if n else other


class Problem(NamedTuple):
    """A body in balance.

    medium: the law, as given. law: its record (`rft.laws.records`). unit: of force, the drag of the medium on the
    whole straight body along itself at unit speed (across where it has none along). lateral: the same across.
    homogeneous, linear: whether doubled velocities have the same drag, or twice of it. sides: the body's own elements,
    under the law. points: others fixed to them, under dry terms that face along them, point_terms (T, 3, n, 1). square:
    (1, 1) or (1, B), drag over |v_n| v_n. memory: of the ground beside the sides. momenta: of the body, None without
    mass. frame: measures of the samples."""

    medium: Any
    law: Any
    unit: float
    lateral: float
    homogeneous: bool
    linear: bool
    sides: Contact
    points: Contact
    point_terms: np.ndarray
    square: np.ndarray
    memory: Memory
    momenta: Momenta | None
    frame: Frame

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.frame.speed.shape[-1]

    @property
    def acts(self) -> tuple[bool, bool, bool, bool]:
        """Whether factors, drag with the square of the speed, memory and a slope act on the body's sides."""
        sides = self.sides
        plain = sides.factor is NO_FACTOR, self.square is ZERO, self.memory is NO_MEMORY, sides.incline is NO_INCLINE
        return tuple(not x for x in plain)

    @property
    def speed(self) -> np.ndarray:
        """Scale (1, B or 1) that makes velocities true ones: 1 where doubled velocities give the same drag."""
        same = self.homogeneous and not any(self.acts[1:3]) and self.momenta is None
        return ONE if same else self.frame.speed

    def take(self, index) -> Problem:
        """Return the problem of the samples ``index``."""
        return Problem(*self[:6], *take(self[6:], index))  # a law is the same for all samples

    def with_points(self, points: Contact, terms: Sequence[tuple[float, float, float]]) -> Problem:
        """Return the problem with more points, all of these dry terms (q, k_t, k_n)."""
        new = np.repeat(np.array(terms, float)[:, :, None, None], len(points.station), 2)
        count = max(len(self.point_terms), len(new))
        missing = lambda x: np.broadcast_to(NO_TERM, (count - len(x), 3, x.shape[2], 1))
        both = [np.concatenate([x, missing(x)]) for x in (self.point_terms, new)]
        return self._replace(points=self.points.joined(points), point_terms=np.concatenate(both, 2))


NO_TERM = np.array([1.0, 0.0, 0.0])[:, None, None]  # (q, k_t, k_n)
NO_POINTS = np.zeros((0, 3, 0, 1))


def mapped(function: Callable, *trees):
    """Return the record of function(array, ...) for the arrays of one record, or of several alike; the same record if
    none changes."""
    first = trees[0]
    if not isinstance(first, tuple):
        return function(*trees) if isinstance(first, np.ndarray) else first
    parts = [mapped(function, *same) for same in zip(*trees)]
    if all(a is b for a, b in zip(parts, first)):
        return first
    return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)


def take(tree, index) -> Any:
    """Return the record of the samples ``index``."""
    return mapped(lambda x: x if x.shape[-1] == 1 and x.ndim > 1 else x[..., index], tree)


class Assembly(NamedTuple):
    """A law, a body as its effects cut it, and the effects: what does not depend on the shape. Made by `assemble`.

    station, fraction: (n, 1), the elements' centres along the body and their shares of its length. elements: how many
    there are in all, added points among them.
    """

    medium: Any
    law: Any
    unit: float
    lateral: float
    homogeneous: bool
    linear: bool
    body: Body
    effects: tuple
    station: np.ndarray
    fraction: np.ndarray
    ones: np.ndarray
    none: Contact
    elements: int

    def at(self, alpha: np.ndarray, alphadot: np.ndarray, site=None) -> Problem:
        """Return the balance at shapes and rates (joints, B). Effects that add points act first, so that their order is
        free."""
        problem = self.plain(alpha, alphadot)
        for effect in self.effects:
            problem = effect.apply(problem, site, None)
        return problem

    @property
    def points(self) -> int:
        """Number of places of a sample at which the law is evaluated."""
        return self.elements * np.size(getattr(self.law, "nodes", 0.0))

    def take(self, index) -> Assembly:
        """Return the same with the effects' parameters for the samples ``index``."""
        effects = tuple(effect.take(index) for effect in self.effects)
        same = all(a is b for a, b in zip(effects, self.effects))
        return self if same else self._replace(effects=effects)

    def plain(self, alpha, alphadot) -> Problem:
        """Return the balance without effects."""
        e = self.body.motion(alpha, alphadot)
        x, y = e.r_t * e.s + e.r_n * e.c, e.r_n * e.s - e.r_t * e.c
        speed, mean = joint_speed(self.body, alphadot)[None], self.fraction.T
        frame = Frame(mean @ x, mean @ y, force_unit(self, speed), speed)
        sides = Contact(e, self.station, self.ones)
        return Problem(*self[:6], sides, self.none, NO_POINTS, ZERO, NO_MEMORY, None, frame)

    def rescaled(self, problem: Problem, speed: np.ndarray) -> Problem:
        """Return the problem with another scale of speed (B,)."""
        speed = speed[None]
        return problem._replace(frame=problem.frame._replace(speed=speed, force=force_unit(self, speed)))


def assemble(medium, body: Body, effects: Sequence = (), rule: str = "exact", pieces: int = 40) -> Assembly:
    """Return what is solved for. ValueError for what is no body, for a medium that pushes, or one that an effect does
    not take.

    The result is remembered for the last few arguments that cannot change, since small batches take no longer to solve
    than to prepare."""
    return _assembled(medium, body, tuple(effects), rule, pieces)


@cached_if_immutable
def _assembled(medium, body, effects, rule, pieces) -> Assembly:
    require_drag(medium)
    body = pieced(checked_body(body), effects, pieces)
    for effect in effects:
        effect.check(medium)
    zero = np.zeros((body.joints, 1))
    e = body.motion(zero, zero)
    station = np.cumsum(2 * e.half, 0) - e.half
    none = Contact(Elements(*(x[:0] for x in e)), station[:0], station[:0])
    ordered = tuple(sorted(effects, key=lambda effect: not effect.adds_points))
    fraction = e.half / e.half.sum()
    along, across = (abs(float(medium.traction(*v)[i])) for i, v in enumerate(((1.0, 0.0), (0.0, 1.0))))
    given = medium, record(medium, rule), along or across, across, speed_exponent(medium) == 0, is_linear(medium)
    plain = Assembly(
        *given, body, tuple(e for e in ordered if e.adds_points), station, fraction, np.ones_like(station), none, 0
    )
    count = len(station) + len(plain.at(zero, zero + 1.0).points.station)
    return plain._replace(effects=ordered, elements=count)


def pieced(body: Body, effects: Sequence, pieces: int = 40) -> Body:
    """Return the body as finely cut as its effects need. ValueError for no number of pieces."""
    in_range("pieces", pieces, 1, MOST_PIECES, whole=True)
    return subdivide(body, pieces) if any(e.varies_along for e in effects) else body


def force_unit(assembly: Assembly, speed: np.ndarray) -> np.ndarray:
    """Return the unit of residuals (1, B): drag at the samples' speeds, in dry media not below the drag at unit
    speed."""
    medium, unit = assembly.medium, assembly.unit
    if assembly.linear:
        return unit * speed
    closed = getattr(medium, "viscous", None)
    if closed is None:
        along, across = (np.abs(medium.traction(*v)[k]) for k, v in enumerate(((speed, 0 * speed), (0 * speed, speed))))
        return np.where(along > 0, along, across)
    return unit + closed[0] * np.maximum(speed - 1.0, 0.0)
