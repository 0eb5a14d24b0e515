"""The balance of forces as a value: records of arrays that effects change and both
drivers solve.

The last axis of every array is that of the samples, or has one column for all of them.
`take` selects samples of any record, and `mapped` applies a function to its arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import Body, Elements, checked_body, joint_speed
from rft.bodies.pieces import subdivide
from rft.core.checks import in_range
from rft.core.refusal import require
from rft.formulas.link import Additions, Factor, Incline, Memory
from rft.formulas.momentum import MomentumRate
from rft.formulas.newton import Frame
from rft.laws.base import cached_if_immutable, is_linear, require_drag, speed_exponent
from rft.laws.batch import MediumBatch, members
from rft.laws.records import record

MOST_PIECES = 10_000  # to a body length
ONE = np.ones((1, 1))
ZERO = np.zeros((1, 1))
NO_FACTOR = Factor(ONE, ONE, ONE)
NO_INCLINE = Incline(ONE, ZERO, ONE, ZERO, ZERO)
NO_MEMORY = Memory(ZERO, ZERO, ZERO, ZERO, ONE, ONE, ONE, ONE, ZERO, ZERO)


class Contact(NamedTuple):
    """Elements (n, B) in contact with the ground.

    station: (n, 1), their centres along the body, 0 at its tail, 1 at its head. buried:
    (n, 1), 1 at the body's depth, 0 on the surface. factor: of their drag. incline:
    slope of the ground."""

    elements: Elements
    station: np.ndarray
    buried: np.ndarray
    factor: Factor = NO_FACTOR
    incline: Incline = NO_INCLINE

    def with_factors(self, forward, backward, across) -> Contact:
        """Return the contact with its drag multiplied by these factors, numbers or
        arrays that broadcast to (n, B)."""
        factor = Factor(
            np.atleast_2d(self.factor.forward * forward),
            np.atleast_2d(self.factor.backward * backward),
            np.atleast_2d(self.factor.across * across),
        )
        return self._replace(factor=factor)

    def joined(self, other: Contact) -> Contact:
        """Return the elements of this contact followed by those of the other."""

        n = len(self.station)
        m = len(other.station)
        if n == 0:
            return other

        def concatenated(a, b):
            columns = max(a.shape[-1], b.shape[-1])
            a = np.broadcast_to(a, (n, columns))
            b = np.broadcast_to(b, (m, columns))
            return np.concatenate([a, b])

        return mapped(concatenated, self, other)


class Problem(NamedTuple):
    """The balance of forces on a body, for a batch of samples.

    medium: the law, as given, or a batch of media (`rft.laws.batch`). law: its record
    (`rft.laws.records`). axial_drag: unit of force, the drag on the whole straight body
    along itself at unit speed (across if there is none along), (B,) for a batch of
    media. lateral_drag: that drag across. homogeneous, linear: whether drag stays, or
    doubles, when velocities double. sides: the body's elements, under the law. points:
    points attached to them, under dry terms that face along the body, point_terms
    (T, 3, n, B or 1). quadratic_drag: (1, 1) or (1, B), force over |v_n| v_n.
    memory: of the ground at the elements. momentum_rate: of the body, None without
    mass. frame: means and scales of the samples."""

    medium: Any
    law: Any
    axial_drag: float | np.ndarray
    lateral_drag: float | np.ndarray
    homogeneous: bool
    linear: bool
    sides: Contact
    points: Contact
    point_terms: np.ndarray
    quadratic_drag: np.ndarray
    memory: Memory
    momentum_rate: MomentumRate | None
    frame: Frame

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return self.frame.speed_scale.shape[-1]

    @property
    def additions(self) -> Additions:
        """Additions to the law that apply to the body's sides."""
        return Additions(
            self.sides.factor is not NO_FACTOR,
            self.quadratic_drag is not ZERO,
            self.memory is not NO_MEMORY,
            self.sides.incline is not NO_INCLINE,
            self.momentum_rate is not None,
        )

    @property
    def law_speed_scale(self) -> np.ndarray:
        """Scale (1, B or 1) of the velocities that loads are computed at; 1 where drag
        does not depend on the speed."""
        return ONE if self.is_scale_free else self.frame.speed_scale

    @property
    def is_scale_free(self) -> bool:
        """Whether drag stays if all velocities, and the rounding, double."""
        a = self.additions
        return self.homogeneous and not (a.quadratic or a.memory or a.momentum)

    def take(self, index) -> Problem:
        """Return the problem of the samples ``index``."""
        return Problem(*take_law(self[:6], index), *take(self[6:], index))

    def split(self, count: int) -> list[Problem]:
        """Return ``count`` problems with equal numbers of samples in a row."""
        return [Problem(*self[:6], *rest) for rest in split(self[6:], count)]

    def by_medium(self) -> Iterator[tuple[Problem, slice]]:
        """Yield the problem of each run of samples in one medium, and the run."""
        if not isinstance(self.medium, MediumBatch):
            yield self, slice(0, self.n_samples)
            return
        media, runs = zip(*self.medium.runs())
        samples = self[6:]
        if len({run.stop - run.start for run in runs}) == 1:
            parts = split(samples, len(runs))
        else:
            parts = [take(samples, run) for run in runs]
        law = self.law
        for medium, run, part in zip(media, runs, parts):
            i = run.start
            law_and_units = (
                medium,
                law._replace(viscous=law.viscous[..., i], dry=law.dry[..., i]),
                float(self.axial_drag[i]),
                float(self.lateral_drag[i]),
                self.homogeneous,
                self.linear,
            )
            yield Problem(*law_and_units, *part), run

    def with_points(self, points: Contact, terms: ArrayLike) -> Problem:
        """Return the problem with more points, each with all of these dry terms
        (q, k_t, k_n), (T, 3), or (T, 3, B) for each sample."""
        new = np.array(terms, float)
        new = np.repeat(new.reshape(*new.shape[:2], 1, -1), len(points.station), 2)
        if len(self.points.station):
            old = self.point_terms
            count = max(len(old), len(new))
            columns = max(old.shape[-1], new.shape[-1])
            both = [_padded(old, count, columns), _padded(new, count, columns)]
            new = np.concatenate(both, 2)
        return self._replace(points=self.points.joined(points), point_terms=new)


NO_TERM = np.array([1.0, 0.0, 0.0])[:, None, None]  # (q, k_t, k_n)
NO_POINT_TERMS = np.zeros((0, 3, 0, 1))


def _padded(terms: np.ndarray, count: int, columns: int) -> np.ndarray:
    """Return dry terms (T, 3, n, B or 1) of points as ``count`` terms, the added ones
    without drag, with ``columns`` samples."""
    terms = np.broadcast_to(terms, (*terms.shape[:3], columns))
    return np.concatenate(
        [terms, np.broadcast_to(NO_TERM, (count - len(terms), *terms.shape[1:]))]
    )


def mapped(function: Callable, *records) -> Any:
    """Return the record of function(array, ...) over the arrays of one record, or of
    several records of one class; the first record itself if no array changes."""
    first = records[0]
    if isinstance(first, np.ndarray):
        return function(*records)
    if not isinstance(first, tuple):
        return first
    values = [mapped(function, *fields) for fields in zip(*records)]
    if all(a is b for a, b in zip(values, first)):
        return first
    if hasattr(first, "_fields"):
        return type(first)(*values)
    return tuple(values)


def take(record, index) -> Any:
    """Return a record with the samples ``index`` of its arrays; arrays of one column
    stay as they are."""

    def selected(x):
        if x.shape[-1] == 1 and x.ndim > 1:
            return x
        return x[..., index]

    return mapped(selected, record)


def split(record, count: int) -> list:
    """Return ``count`` records with equal numbers of samples in a row, which they share
    out of a record; arrays of one column stay as they are."""
    if isinstance(record, np.ndarray):
        if record.shape[-1] == 1 and record.ndim > 1:
            return [record] * count
        by_part = record.reshape(*record.shape[:-1], count, -1)
        return list(np.ascontiguousarray(np.moveaxis(by_part, -2, 0)))
    if not isinstance(record, tuple):
        return [record] * count
    parts = [split(field, count) for field in record]
    if all(part[0] is field for part, field in zip(parts, record)):
        return [record] * count
    if hasattr(record, "_fields"):
        return [type(record)(*fields) for fields in zip(*parts)]
    return list(zip(*parts))


def take_law(law_and_units: tuple, index) -> tuple:
    """Return the first six fields of a `Problem` or an `Assembly` for the samples
    ``index``: a law is the same for all, a batch of media is not."""
    medium, law, axial_drag, lateral_drag, *facts = law_and_units
    if not isinstance(medium, MediumBatch):
        return law_and_units
    drags = axial_drag[index], lateral_drag[index]
    return medium.take(index), take(law, index), *drags, *facts


class Assembly(NamedTuple):
    """A law, a subdivided body and effects: everything that does not depend on shapes
    and rates, built by `assemble`.

    touching: the body of which parts are lifted (`rft.contacts.Touching`), None where
    all of it touches. station, fraction: (n, 1), centres of the elements along the body
    and their fractions of its length. buried: (n, 1), of `Contact`. no_points: an empty
    contact. n_elements: number of elements and added points. n_law_points: number of
    points at which the law is evaluated, elements times nodes of the rule. Other fields
    as in `Problem`."""

    medium: Any
    law: Any
    axial_drag: float | np.ndarray
    lateral_drag: float | np.ndarray
    homogeneous: bool
    linear: bool
    body: Body
    touching: Any
    effects: tuple
    station: np.ndarray
    fraction: np.ndarray
    buried: np.ndarray
    no_points: Contact
    n_elements: int
    n_law_points: int

    def problem(
        self, alpha: np.ndarray, alphadot: np.ndarray, speed: np.ndarray | None = None
    ) -> Problem:
        """Return the balance at shapes and rates (joints, B), with a scale of speed
        (B,), by default the joint speed."""
        if speed is None:
            speed = joint_speed(self.body, alphadot)
        problem = self.without_effects(alpha, alphadot, speed)
        for effect in self.effects:
            problem = effect.apply(problem, None, None)
        return problem

    def take(self, index) -> Assembly:
        """Return the assembly with the media and the effects' parameters at the samples
        ``index``."""
        assembly = self
        if isinstance(self.medium, MediumBatch):
            assembly = Assembly(*take_law(self[:6], index), *self[6:])
        effects = tuple(effect.take(index) for effect in self.effects)
        if all(a is b for a, b in zip(effects, self.effects)):
            return assembly
        return assembly._replace(effects=effects)

    def without_effects(self, alpha, alphadot, speed) -> Problem:
        """Return the balance without effects."""
        e = self.body.motion(alpha, alphadot)
        x = e.r_t * e.s + e.r_n * e.c
        y = e.r_n * e.s - e.r_t * e.c
        speed = speed[None]
        mean = self.fraction.T
        frame = Frame(mean @ x, mean @ y, force_scale(self, speed), speed)
        sides = Contact(e, self.station, self.buried)
        if self.touching is not None:
            factor = self.touching.contact_factors(
                alpha, e, self.station, self.fraction
            )
            sides = sides.with_factors(factor, factor, factor)
        return Problem(
            *self[:6],
            sides,
            self.no_points,
            NO_POINT_TERMS,
            ZERO,
            NO_MEMORY,
            None,
            frame,
        )


def assemble(
    medium, body: Body, effects: Sequence = (), rule: str = "exact", pieces: int = 40
) -> Assembly:
    """Return the assembly of a medium, a body and effects, with averages by a rule
    ("exact", "midpoint:N", "gauss:N") and ``pieces`` to a body length where an effect
    varies along an element.

    Raises ValueError unless the body is a `Body`, the medium drags, and every effect
    takes the medium. Assemblies of immutable arguments are cached, for a small batch
    takes as long to assemble as to solve."""
    return _assembled(medium, body, tuple(effects), rule, pieces)


@cached_if_immutable
def _assembled(medium, body, effects, rule, pieces) -> Assembly:
    for each in members(medium):
        require_drag(each)
    checked_body(body)
    in_range("pieces", pieces, 1, MOST_PIECES, whole=True)
    touching = body if hasattr(body, "contact_factors") else None
    if hasattr(touching, "leg_points"):
        for effect in effects:
            require(
                not (effect.adds_points or effect.varies_along),
                f"{effect.kind} does not know bodies with legs",
                instead="remove the effect",
            )
    if varies_along(body, effects):
        body = subdivide(body, pieces)
    if hasattr(body, "contact_factors"):
        touching = body
    effects = tuple(effect.in_body_lengths(body.length) for effect in effects)
    for each in members(medium):
        for effect in effects:
            effect.check(each)
    if touching is not None:
        for effect in effects:
            require(
                effect.knows_contact,
                f"{effect.kind} does not know parts of the body that are lifted",
                because="it follows the ground, or the joints, under a body that "
                "touches all along",
                instead="remove the effect, or the contact that comes and goes",
            )
    zero = np.zeros((body.joints, 1))
    e = body.motion(zero, zero)
    station = stations_of(body, e.half)
    no_points = Contact(Elements(*(x[:0] for x in e)), station[:0], station[:0])
    # Effects that add points act first, so that all others act on these points,
    # whatever their order.
    ordered = tuple(sorted(effects, key=lambda effect: not effect.adds_points))
    fraction = e.half / e.half.sum()
    law_and_units = (
        medium,
        record(medium, rule),
        *_drags(medium),
        speed_exponent(medium) == 0,
        is_linear(medium),
    )
    adding = tuple(effect for effect in ordered if effect.adds_points)
    assembly = Assembly(
        *law_and_units,
        body,
        touching,
        adding,
        station,
        fraction,
        np.ones_like(station),
        no_points,
        0,
        0,
    )
    n_elements = len(station) + len(assembly.problem(zero, zero + 1.0).points.station)
    n_law_points = n_elements * np.size(getattr(assembly.law, "nodes", 0.0))
    return assembly._replace(
        effects=ordered, n_elements=n_elements, n_law_points=n_law_points
    )


def stations_of(body: Body, half: np.ndarray) -> np.ndarray:
    """Return the places (n, 1) of a body's elements along it, 0 at its tail and 1 at
    its head, from their half lengths (n, 1): one after the other, unless the body has
    ``stations``, as one with legs has."""
    stations = getattr(body, "stations", None)
    if stations is not None:
        return stations
    return np.cumsum(2 * half, 0) - half


def varies_along(body: Body, effects: Sequence) -> bool:
    """Return whether loads vary along an element by effects, or by contact that comes
    and goes, so that a balance takes the elements cut into pieces."""
    contact = getattr(body, "contact", None)
    is_cut = contact is not None and contact.is_cut
    return is_cut or any(effect.varies_along for effect in effects)


def _drags(medium) -> tuple:
    """Return the axial and the lateral drag of `Problem`."""
    along = medium.traction(1.0, 0.0)[0]
    across = medium.traction(0.0, 1.0)[1]
    if isinstance(medium, MediumBatch):
        return np.where(along != 0, abs(along), abs(across)), abs(across)
    return abs(float(along)) or abs(float(across)), abs(float(across))


def force_scale(assembly: Assembly, speed: np.ndarray) -> np.ndarray:
    """Return the unit of residuals (1, B or 1): drag at the samples' speeds, in dry
    media not below the drag at unit speed."""
    medium = assembly.medium
    unit = assembly.axial_drag
    if assembly.homogeneous:
        return unit * ONE
    if assembly.linear:
        return unit * speed
    viscous = getattr(medium, "viscous", None)
    if viscous is None:
        zero = 0 * speed
        along = np.abs(medium.traction(speed, zero)[0])
        across = np.abs(medium.traction(zero, speed)[1])
        return np.where(along > 0, along, across)
    return unit + viscous[0] * np.maximum(speed - 1.0, 0.0)
