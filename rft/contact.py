"""A body meets the ground in contacts: groups of elements that share a force law. Effects change a `Model` of them.

Velocities are true ones everywhere here, body lengths (and rad) per unit of the time of alphadot: an element slides along
itself with v_t and sideways with v_n + s spin, s in [-1, 1] from its tail's end to its head's, so spin is its rate of
turning times its half length. A load is (3, 4, n, B) as in `rft.loads`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np

from rft.bodies.base import Kinematics
from rft.loads import element_load, rule_for
from rft.media.base import Medium, dry_terms, is_closed, viscous_terms
from rft.sides import sided


class PerSample:
    """Base of what holds parameters: an array has the samples of a batch on its last axis, or one element there for all."""

    def take(self, index) -> Self:
        """The same for the samples ``index``; itself where nothing differs from sample to sample."""
        return self.having(**{f.name: x[..., index] for f in fields(self) if _differs(x := getattr(self, f.name))})

    def having(self, **values) -> Self:
        """The same with some parameters set, to arrays for one; checks, which are for single numbers, are not repeated."""
        if not values:
            return self
        new = object.__new__(type(self))
        new.__dict__.update({**self.__dict__, **values})
        return new


def _differs(x) -> bool:
    return isinstance(x, np.ndarray) and x.ndim > 0 and x.shape[-1] != 1


class Law(Protocol):
    """Averages of the drag on elements, and their tangent, (3, 4, n, B). Its parameters may differ from sample to sample but
    not from element to element: that is a factor, or another contact. rate_independent: doubled velocities, and eps, give
    the same drag."""

    rate_independent: bool

    def __call__(self, v_t, v_n, spin, eps) -> np.ndarray: ...
    def take(self, index) -> Law: ...


class Factor(Protocol):
    """What a contact's load is multiplied by, (along, across), arrays that broadcast to (n, B) or None for 1. It has no slope
    but may jump where v_t = 0, and doubled velocities do not change it. Factors commute."""

    def __call__(self, v_t, v_n, spin) -> tuple: ...
    def take(self, index) -> Factor: ...


class Share(Protocol):
    """What is left of the drag across on the parts of elements that move to the left, and to the right: (2, n, B), and its
    slopes in v_n and in spin, or None where there are none. Shares commute, and share one split of every element."""

    def __call__(self, v_n, spin) -> tuple: ...
    def take(self, index) -> Share: ...


class Term(Protocol):
    """A wrench on the frame that its motion xi (3, B) brings about, and the tangent, (3, 4, B), positive as drag is. size:
    (B,) or a number, of its largest slope, for the rounding it brings."""

    size: np.ndarray | float

    def __call__(self, xi) -> np.ndarray: ...
    def take(self, index) -> Term: ...
    def on_elements(self, xi, motion: Kinematics, v) -> np.ndarray:
        """(3, n, B): the part of it that each element of the body's side bears, velocities v (3, n, B)."""


@dataclass(frozen=True)
class Averages(PerSample):
    """A medium's law on straight elements, integrated as ``rule`` says (`rft.loads`). nodes: points it takes an element."""

    medium: Medium
    rule: str = "exact"
    averages: Callable = field(init=False, repr=False, compare=False)
    nodes: int = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        object.__setattr__(self, "averages", element_load(self.medium, self.rule))
        object.__setattr__(self, "nodes", rule_for(self.medium, self.rule)[1])

    @property
    def rate_independent(self) -> bool:
        return bool(dry_terms(self.medium)) and not any(viscous_terms(self.medium) or ())

    @property
    def numbers(self) -> tuple | None:
        """For compiled code: dry terms, viscous coefficients, and whether it is a point's; None where it is no closed form."""
        if self.rule != "exact" or not is_closed(self.medium):
            return None
        return sorted(self.medium.dry, key=lambda term: term[1] == 0.0), self.medium.viscous, False

    def __call__(self, v_t, v_n, spin, eps) -> np.ndarray:
        return self.averages(v_t, v_n, spin, eps)


def everywhere(motion: Kinematics) -> Kinematics:
    return motion


@dataclass(frozen=True)
class Contact:
    """A group of elements and what acts on them: factors x (the law, each side of it times its shares) + additions.

    elements: of the plain body's `Kinematics`, that of the contact's own elements. stations: (n,), where they hang on the body,
    0 its tail, 1 its head; None for the body's elements themselves, each at its centre. buried: whether it lies at the
    body's depth.
    """

    law: Law
    elements: Callable[[Kinematics], Kinematics] = everywhere
    stations: tuple[float, ...] | None = None
    buried: bool = True
    factors: tuple[Factor, ...] = ()
    shares: tuple[Share, ...] = ()
    additions: tuple[Law, ...] = ()

    @property
    def rate_independent(self) -> bool:
        return self.law.rate_independent and not self.shares and not self.additions

    @property
    def is_plain(self) -> bool:
        """Whether it is a law in closed form and no more."""
        closed = isinstance(self.law, Averages) and self.law.nodes == 1
        return closed and not (self.factors or self.shares or self.additions)

    def load(self, v_t, v_n, spin, eps) -> np.ndarray:
        """(3, 4, n, B) at the velocities of its elements, (n, B) each."""
        out = sided(self.law, self.shares, v_t, v_n, spin, eps) if self.shares else self.law(v_t, v_n, spin, eps)
        for factor in self.factors:
            along, across = factor(v_t, v_n, spin)
            if along is not None:
                out[0] *= along
            if across is not None:
                out[1:] *= across
        for extra in self.additions:
            out += extra(v_t, v_n, spin, eps)
        return out

    def places(self, motion: Kinematics) -> np.ndarray:
        """(n,): stations of the elements, whose `Kinematics` is given."""
        if self.stations is not None:
            return np.array(self.stations)
        half = motion.half[:, 0]
        return np.cumsum(2 * half) - half

    def take(self, index) -> Contact:
        kept = {name: getattr(self, name) for name in ("factors", "shares", "additions")}
        new = {name: _taken(parts, index) for name, parts in kept.items()}
        law = self.law.take(index)
        if law is self.law and all(new[name] is kept[name] for name in kept):
            return self
        return replace(self, law=law, **new)


def _taken(parts: tuple, index) -> tuple:
    """The parts for these samples; the very same tuple where none differs from sample to sample."""
    new = tuple(part.take(index) for part in parts)
    return parts if all(a is b for a, b in zip(new, parts)) else new


SIDE = "side"  # the contact that every body has: its own elements


@dataclass(frozen=True)
class Model:
    """What touches the ground, by name, and what else pulls at the frame. unit: of forces, the drag of the medium on the
    whole straight body along itself at unit speed (across where it has none along)."""

    medium: Medium
    contacts: dict[str, Contact]
    unit: float
    terms: tuple[Term, ...] = ()

    @classmethod
    def of(cls, medium: Medium, rule: str = "exact") -> Model:
        """A body's sides in a medium, and nothing else."""
        law = Averages(medium, rule)
        axial, lateral = (abs(float(medium.traction(*v)[i])) for i, v in enumerate(((1.0, 0.0), (0.0, 1.0))))
        return cls(medium, {SIDE: Contact(law)}, axial or lateral)

    def touching(self, name: str, contact: Contact) -> Model:
        """With one contact more."""
        return replace(self, contacts={**self.contacts, name: contact})

    def changed(self, name: str, **more: tuple) -> Model:
        """With more factors, shares or additions at a contact."""
        old = self.contacts[name]
        new = replace(old, **{what: getattr(old, what) + parts for what, parts in more.items()})
        return replace(self, contacts={**self.contacts, name: new})

    def pulled(self, term: Term) -> Model:
        """With one term more."""
        return replace(self, terms=(*self.terms, term))

    @cached_property
    def numbers(self) -> dict:
        """What `rft.numbers` has made of it."""
        return {}

    @cached_property
    def lateral(self) -> float:
        """The drag across at unit speed, (-) as traction has it."""
        return abs(float(self.medium.traction(0.0, 1.0)[1]))

    @cached_property
    def rate_independent(self) -> bool:
        return not self.terms and all(c.rate_independent for c in self.contacts.values())

    def motions(self, plain: Kinematics) -> dict[str, Kinematics]:
        """Elements of every contact, from those of the plain body."""
        return {name: contact.elements(plain) for name, contact in self.contacts.items()}

    def load(self, v: np.ndarray, rows: list[slice], eps) -> np.ndarray:
        """(3, 4, n, B) of all contacts' elements, one contact after the other in the given rows of v (3, n, B)."""
        loads = [c.load(*v[:, which], eps) for c, which in zip(self.contacts.values(), rows)]
        return loads[0] if len(loads) == 1 else np.concatenate(loads, 2)

    def drag(self, rows: list[slice], eps: float) -> np.ndarray | None:
        """(3, 4, n, 1), the load at rest, with its tangents, which is all there is to know of it where it is rounded off so
        far: of laws in closed form that are the same for all samples, with nothing else; None for other models."""
        size = rows[-1].stop
        if (size, eps) not in self._drags:
            plain = self.alike and not self.terms and all(c.is_plain for c in self.contacts.values())
            self._drags[size, eps] = self.load(np.zeros((3, size, 1)), rows, np.array([eps])) if plain else None
        return self._drags[size, eps]

    @cached_property
    def _drags(self) -> dict:
        return {}

    def take(self, index) -> Model:
        """For the samples ``index``; itself where nothing differs from sample to sample."""
        return self if self.alike else self._taken(index)

    @cached_property
    def alike(self) -> bool:
        """Whether it holds the same for all samples of a batch."""
        return self._taken(slice(0, 0)) is self

    def _taken(self, index) -> Model:
        old = tuple(self.contacts.values())
        contacts, terms = _taken(old, index), _taken(self.terms, index)
        if contacts is old and terms is self.terms:
            return self
        return replace(self, contacts=dict(zip(self.contacts, contacts)), terms=terms)


def rows(motions: dict[str, Kinematics]) -> list[slice]:
    """Where every contact's elements are among all of them, one contact after the other."""
    ends = np.cumsum([0, *(len(m.half) for m in motions.values())]).tolist()
    return [slice(*pair) for pair in itertools.pairwise(ends)]
