"""A model as plain arrays, for compiled code (`rft.lanes`): what its parts tell of themselves as ``numbers``."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from rft.contact import SIDE, Model
from rft.media.base import is_frozen
from rft.samples import Samples


def foreign(model: Model):
    """The first part of a model that is not numbers alone, such as a law that is integrated by quadrature; None if all are."""
    parts = [p for c in model.contacts.values() for p in (c.law, *c.factors, *c.shares, *c.additions)]
    return next((part for part in (*parts, *model.terms) if getattr(part, "numbers", None) is None), None)


class Numbers(NamedTuple):
    """A model as `rft.lanes.attempt` takes it. law: dry terms (T, 3), viscous coefficients (n, 2), which terms each element
    has and whether it is a point (n, 3). factors: (4, n, B or 1). pasts, rates, masses: see there."""

    law: tuple[np.ndarray, np.ndarray, np.ndarray]
    factors: np.ndarray
    pasts: np.ndarray
    rates: np.ndarray
    masses: np.ndarray


def numbers(model: Model, rows: list[slice], size: int) -> Numbers:
    """Of a model that has nothing foreign, for so many samples. rows: of each contact's elements among all of them."""
    counts = [here.stop - here.start for here in rows]
    laws = tuple(contact.law for contact in model.contacts.values())
    lasting = all(is_frozen(law) and is_frozen(getattr(law, "medium", law)) for law in laws)
    law = (_law if lasting else _law.__wrapped__)(laws, tuple(counts))
    factors = [_factors(contact, count) for contact, count in zip(model.contacts.values(), counts)]
    side = model.contacts[SIDE]
    pasts, rates = _shared(side.shares, counts[0], size)
    masses = sum(np.stack([np.broadcast_to(x, size) for x in term.numbers]) for term in model.terms)
    if len(factors) > 1:
        samples = max(f.shape[-1] for f in factors)
        factors = [np.concatenate([np.broadcast_to(f, (*f.shape[:-1], samples)) for f in factors], 1)]
    return Numbers(law, factors[0], pasts, rates, masses if model.terms else np.zeros((0, size)))


@functools.lru_cache(maxsize=32)
def _law(laws: tuple, counts: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The law of every element, of contacts with so many elements each; never written to."""
    terms, viscous, which = [], [], []
    for law, count in zip(laws, counts):
        dry, smooth, point = law.numbers
        first = len(terms)
        terms += dry
        viscous += [smooth] * count
        which += [(first, len(terms), point)] * count
    return np.array(terms, float).reshape(-1, 3), np.array(viscous, float), np.array(which, np.int64)


def _shared(shares: tuple, count: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """What the shares of the side's elements come to: (5, count or 0, B), and (2, B or 1)."""
    if not shares:
        return np.zeros((5, 0, size)), np.array([[-1.0], [0.0]])
    pasts, rates = np.ones((5, count, size)), np.array([[-1.0], [0.0]])
    for share in shares:
        given, growing = share.numbers
        if given is not None:
            pasts[3:] *= given
        if growing is not None:
            (pasts[:2], pasts[2]), (dt, rate) = growing[:2], growing[2:]
            rates = np.array([np.full(np.size(rate), dt), np.ravel(rate)])
    return pasts, rates


@functools.cache
def _no_factors(count: int) -> np.ndarray:
    """(4, count, 1), never written to."""
    return np.array([1.0, 1.0, 1.0, 0.0])[:, None, None] * np.ones((count, 1))


def _factors(contact, count: int) -> np.ndarray:
    """(4, count, B or 1): of drag along, forwards and backwards, and across, and of the square of speed across."""
    if not contact.factors and not contact.additions:
        return _no_factors(count)
    along, back, across, square = _no_factors(count)
    for factor in contact.factors:
        f, b, a = factor.numbers
        along, back, across = along * f, back * b, across * a
    for addition in contact.additions:
        square = square + addition.numbers
    return np.stack(np.broadcast_arrays(along, back, across, square))


def attempt(of: Samples, rows: list[slice], descent: tuple, limits: list, guess: np.ndarray, scaled: bool) -> tuple:
    """A descent of samples by compiled code, as `rft.lanes.attempt` returns it; scaled: whether their drag knows speed."""
    from rft.lanes import attempt

    size = of.size
    scale = of.scale if scaled else np.ones(size)
    given = numbers(of.model, rows, size)
    asked = _plain((of.motion, of.centre, scale, of.unit, guess))
    out = np.empty((3, size)), np.empty(size), np.empty(size, np.int64), np.empty(size)
    attempt(np.array(descent), np.array(limits), given.law, asked[0], *given[1:], *asked[1:], out)
    return out


def _plain(x) -> np.ndarray | tuple[np.ndarray, ...]:
    """An array, or a tuple of them, of one's own, rows one after the other: code is compiled for these alone."""
    return tuple(map(_plain, x)) if isinstance(x, tuple) else np.array(x, order="C")
