"""What an effect is: something a scene may ask for beyond the plain force law, and pays for only then."""

from __future__ import annotations

import copy
import functools
import operator
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from rft.bodies.base import Body, Motion
from rft.bodies.pieces import PIECES, cut
from rft.media.base import in_range, require, shown
from rft.premise import NONE, SHAPE_ALONE, Premise

MOST_PIECES = 10_000  # to a body length

ENGINES = {
    "algebraic": "the balance of forces at every shape, all shapes at once",
    "marching": "the balance of forces phase after phase, place and past carried along",
    "dynamic": "the equation of motion phase after phase, implicit in time",
}


class Here(NamedTuple):
    """One step of a march, as an effect may ask for it; n elements by B samples, lengths in body lengths.

    dt: phase since the step before, rad. place, along: (n, B) complex, centres and headings of the elements on the
    ground, as foreseen. motion: of the elements while the frame is held. before: (3, n, B), their velocities (a, m, w) one
    step earlier, body lengths per rad. scale: (B,), what the velocities of this step are divided by.
    """

    dt: float
    place: np.ndarray
    along: np.ndarray
    motion: Motion
    before: np.ndarray
    scale: np.ndarray


@dataclass(frozen=True)
class Effect:
    """Base of all effects. kind: its name in scenes and messages. breaks: premises it takes away; each takes an
    engine, or a result, with it. An effect
    changes the load of an element, the elements of the body, or both; as its parameter goes to ``limit`` the scene without
    it comes back at ``order``.

    rank: effects act in this order, whatever the scene's. batched: parameters that may be arrays (B,), one for each
    sample of a batch. inertia: mass of the body x length x (rad/s of phase)^2 over its axial drag. settles: change of
    displacement from cycle to cycle, body lengths, below which a march with this effect has settled. held: numbers that a
    march remembers for each sample, beside some for each element. varies: along an element, of which it takes means:
    longer elements are cut into pieces (`pieced`).
    """

    kind = "effect"
    breaks = NONE
    limit = ""
    order = 1
    cost = ""
    rank = 0
    batched = ()
    inertia = 0.0
    settles = 1e-6
    held = 0
    varies = False

    def load(self, load, medium, body: Body):
        """The load law (`rft.loads`) of the body's elements with this effect; the same one by default."""
        return load

    def assumes(self, medium) -> str:
        """What the effect takes for granted because neither it nor the medium says; nothing by default."""
        return ""

    def body(self, body: Body) -> Body:
        """The body with this effect; the same one by default."""
        return body

    def start(self, elements: int, samples: int):
        """What the effect remembers before a march; nothing by default."""
        return None

    def at(self, memory, here: Here) -> Effect:
        """The effect at one step of a march, its memory known; the same one by default."""
        return self

    def after(self, memory, here: Here, v: np.ndarray):
        """What is remembered after a step that ended with element velocities v (3, n, B), body lengths per rad."""
        return memory


def together(effects: Sequence[Effect], counts: Sequence[int]) -> Effect:
    """One effect with the parameters of several of its kind, each for ``count`` samples of a batch, side by side.
    ValueError if they differ in a parameter that cannot differ within a batch."""
    first = effects[0]
    joined = {}
    for field in fields(first):
        values = [getattr(e, field.name) for e in effects]
        if any(v != values[0] for v in values):
            if field.name not in first.batched:
                raise ValueError(f"{first.kind}: {field.name} cannot differ within a batch")
            joined[field.name] = np.repeat(np.array(values, float), counts)
    return _with(first, joined)


def repeated(effects: Sequence[Effect], times: int) -> list[Effect]:
    """Effects for a batch in which each sample is ``times`` samples, one after the other."""
    arrays = [{f.name: getattr(e, f.name) for f in fields(e) if np.ndim(getattr(e, f.name))} for e in effects]
    return [_with(e, {k: np.repeat(x, times) for k, x in a.items() if k in e.batched}) for e, a in zip(effects, arrays)]


def _with(effect: Effect, values: dict) -> Effect:
    """The effect with some parameters set to arrays; its own checks are for single numbers, and were made."""
    if not values:
        return effect
    changed = copy.copy(effect)
    for name, value in values.items():
        object.__setattr__(changed, name, value)
    return changed


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
    return "marching" if lost & SHAPE_ALONE else "algebraic"


def pieced(body: Body, effects: Sequence[Effect], pieces: int = PIECES) -> Body:
    """The body as finely cut as its effects need. ValueError for no number of pieces."""
    in_range("pieces", pieces, 1, MOST_PIECES, whole=True)
    return cut(body, pieces) if any(e.varies for e in effects) else body


def applied(effects: Sequence[Effect], load, medium, body: Body):
    """(load, body) with the effects on, in the order of their rank."""
    for effect in sorted(effects, key=lambda e: e.rank):
        load, body = effect.load(load, medium, body), effect.body(body)
    return load, body
