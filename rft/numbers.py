"""A model as plain arrays, for compiled code (`rft.lanes`): what its parts tell of themselves as ``numbers``."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rft.contact import SIDE, Model
from rft.media.base import is_frozen


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
    """Of a model that has nothing foreign, for so many samples. rows: of each contact's elements among all of them. Those of
    a model that cannot change, and is the same for all samples, are made once."""
    counts = tuple(here.stop - here.start for here in rows)
    if counts not in model.numbers:
        made = _made(model, counts, size)
        if not _lasting(model):
            return made
        model.numbers[counts] = made
    return model.numbers[counts]


def _lasting(model: Model) -> bool:
    free = not model.terms and not model.contacts[SIDE].shares
    return free and model.alike and _fixed(tuple(contact.law for contact in model.contacts.values()))


def _fixed(laws: tuple) -> bool:
    return all(is_frozen(law) and is_frozen(getattr(law, "medium", law)) for law in laws)


def _made(model: Model, counts: tuple, size: int) -> Numbers:
    contacts = model.contacts.values()
    laws = tuple(contact.law for contact in contacts)
    law = (_law if _fixed(laws) else _law.__wrapped__)(laws, counts)
    factors = [_factors(contact, count) for contact, count in zip(contacts, counts)]
    pasts, rates = _shared(model.contacts[SIDE].shares, counts[0], size)
    masses = sum(np.stack([np.broadcast_to(x, size) for x in term.numbers]) for term in model.terms)
    if len(factors) > 1:
        samples = max(f.shape[-1] for f in factors)
        factors = [np.concatenate([np.broadcast_to(f, (*f.shape[:-1], samples)) for f in factors], 1)]
    return Numbers(law, factors[0], pasts, rates, masses if model.terms else np.zeros((0, 1)))


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
    """What the shares of the side's elements come to: (5, count, B) or (5, 0, 1), and (2, B or 1)."""
    if not shares:
        return np.zeros((5, 0, 1)), np.array([[-1.0], [0.0]])
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


NO_GUESS = np.zeros((3, 0))


@functools.cache
def _attempt() -> Callable:
    from rft.lanes import attempt  # which takes half a second

    return attempt


def attempt(motion, model: Model, rows, scale, unit, guess, descent: tuple, limits: np.ndarray, scaled: bool) -> tuple:
    """A descent by compiled code, as `rft.lanes.attempt` has it, of all samples of a motion: (xi (3, B) over the scale,
    residual, evaluations, the slowest element's speed). guess: (3, B), over the scale, or None. scaled: drag knows speed."""
    size, given = scale.size, numbers(model, rows, scale.size)
    asked = tuple(map(_plain, (*motion[:4], motion.half, motion.weight, motion.v)))
    own = given.factors, given.pasts, given.rates, given.masses, scale, unit, NO_GUESS if guess is None else guess
    out = np.empty((3, size)), np.empty(size), np.empty(size, np.int64), np.empty(size)
    _attempt()(np.array(descent), limits, given.law, asked, *map(_plain, own), scaled, out)
    return out


def _plain(x: np.ndarray) -> np.ndarray:
    """An array of one's own, rows one after the other: code is compiled for these alone."""
    return x if x.flags.carray and x.dtype == float else np.array(x, float, order="C")
