"""What an effect is: something a scene may ask for beyond the plain force law, and pays for only then."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Self

import numpy as np

from rft.checks import require, shown
from rft.contact import Problem
from rft.premise import NONE, SHAPE_ALONE, Premise

ENGINES = {
    "algebraic": "the balance of forces at every shape, all shapes at once",
    "time stepping": "the balance of forces step after step through the gait, place and past carried along",
    "dynamic": "the equation of motion phase after phase, implicit in time",
}
PAST = Premise.MEMORYLESS | Premise.QUASI_STATIC


class Site(NamedTuple):
    """Where and when a step takes place, in body lengths; B samples.

    count: steps before this one. dt: phase since the step before, rad, 0 at the first. pose: (3, B), of the frame on
    the ground, as foreseen. before: (v_t, v_n, v_w) of the body's elements one step earlier, (n, B) each."""

    count: int
    dt: float
    pose: np.ndarray
    before: tuple[np.ndarray, np.ndarray, np.ndarray]

    def place(self, elements) -> np.ndarray:
        """Return the complex places (n, B) of elements' centres on the ground."""
        x, y, theta = self.pose
        return x + 1j * y + np.exp(1j * theta) * elements.place

    def along(self, elements) -> np.ndarray:
        """Return the complex headings (n, B) of elements on the ground."""
        return np.exp(1j * self.pose[2]) * (elements.c + 1j * elements.s)


@dataclass(frozen=True)
class Effect:
    """Base of all effects: each is one change of a `rft.contact.Problem`, and any two commute. As its parameter goes to
    ``limit`` the scene without it comes back at ``order``.

    kind: its name in scenes and messages. breaks: the premises it takes away, and with them an engine or a result.
    adds: whether it adds points to the body, which other effects then change, too. batched: parameters that may be
    arrays (B,), one for each sample of a batch. settles: change of displacement from cycle to cycle, body lengths,
    below which cycles with this effect count as periodic. held: numbers that time stepping remembers for each sample,
    beside some for each element. varies: whether it differs along an element, of which it takes means, so that longer
    elements are cut into pieces. odd: what it adds or changes turns round with velocities, as far as is known."""

    kind = "effect"
    breaks = NONE
    adds = False
    limit = ""
    order = 1
    cost = ""
    batched = ()
    settles = 1e-6
    held = 0
    varies = odd = False

    def check(self, medium) -> None:
        """Raise ValueError for a medium that the effect does not take."""

    def apply(self, problem: Problem, site: Site | None, past: Any) -> Problem:
        """Return the problem with this effect. site and past are given where it breaks a premise of
        `rft.premise.SHAPE_ALONE`."""
        raise NotImplementedError

    def begin(self, problem: Problem, site: Site) -> Any:
        """Return what is remembered before the first step: a record of arrays with the samples on the last axis."""
        return ()

    def after(self, problem: Problem, site: Site, past: Any, v: tuple) -> Any:
        """Return what is remembered after a step that ended with velocities (v_t, v_n, v_w) of the body's elements."""
        return past

    def kicked(self, problem: Problem, site: Site, past: Any, change: np.ndarray, drag: np.ndarray) -> Any:
        """Return what is remembered as if the body had moved faster by ``change`` (3, B) at the last steps, of which
        the one at ``site`` was the last, with ``drag`` (3, B) more, over the unit of force; the ground does not
        notice."""
        return past

    def assumes(self, medium) -> str:
        """Return what the effect takes for granted because neither it nor the medium says; nothing by default."""
        return ""

    def take(self, index) -> Self:
        """Return the effect with its parameters for the samples ``index``; itself where none differs from sample to
        sample."""
        differs = lambda x: isinstance(x, np.ndarray) and x.ndim > 0 and x.shape[-1] != 1
        return self.having(**{f.name: x[..., index] for f in fields(self) if differs(x := getattr(self, f.name))})

    def having(self, **values) -> Self:
        """Return the effect with some parameters set, to arrays for one; checks, which are for single numbers, are not
        repeated."""
        if not values:
            return self
        new = object.__new__(type(self))
        new.__dict__.update({**self.__dict__, **values})
        return new


def by_steps(effects: Sequence[Effect]) -> list[Effect]:
    """Return the effects that depend on the past or on the place on the ground, which act step by step."""
    return [e for e in effects if e.breaks & SHAPE_ALONE]


def side_by_side(effects: Sequence[Effect], counts: Sequence[int]) -> Effect:
    """One effect with the parameters of several of its kind, each for ``count`` samples of a batch. ValueError if they
    differ in a parameter that cannot differ within a batch."""
    first = effects[0]
    joined = {}
    for field in fields(first):
        values = [getattr(e, field.name) for e in effects]
        if any(v != values[0] for v in values):
            if field.name not in first.batched:
                raise ValueError(f"{first.kind}: {field.name} cannot differ within a batch")
            joined[field.name] = np.repeat(np.array(values, float), counts)
    return first.having(**joined)


def broken(effects: Sequence[Effect]) -> Premise:
    """All that the effects break; ValueError for what is no effect."""
    good = isinstance(effects, Sequence) and all(isinstance(e, Effect) for e in effects)
    require(good, f"effects must be a list of effects such as EndCaps(radius=0.06), got {shown(effects)}")
    return functools.reduce(operator.or_, (e.breaks for e in effects), NONE)


def engine(effects: Sequence[Effect]) -> str:
    """The cheapest of ENGINES that is right with these effects."""
    lost = broken(effects)
    if lost & Premise.QUASI_STATIC:
        return "dynamic"
    return "time stepping" if lost & SHAPE_ALONE else "algebraic"
