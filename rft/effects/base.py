"""What an effect is: something a scene may ask for beyond the plain force law, and pays for only then."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from rft.bodies.base import Body, Kinematics, checked_body
from rft.bodies.pieces import PIECES, subdivide
from rft.contact import Model, PerSample, rows
from rft.media.base import in_range, remembered, require, require_drag, shown
from rft.premise import NONE, SHAPE_ALONE, Premise

MOST_PIECES = 10_000  # to a body length

ENGINES = {
    "algebraic": "the balance of forces at every shape, all shapes at once",
    "time stepping": "the balance of forces step after step through the gait, place and past carried along",
    "dynamic": "the equation of motion phase after phase, implicit in time",
}


class Site(NamedTuple):
    """Where and when a step takes place, as a process may ask for it, in body lengths; B samples.

    dt: phase since the step before, rad, 0 at the first. pose: (3, B), of the frame on the ground, as foreseen. motions: of
    every contact's elements while the frame is held. before: (3, n, B), their velocities one step earlier.
    """

    dt: float
    pose: np.ndarray
    motions: dict[str, Kinematics]
    before: dict[str, np.ndarray]

    def place(self, name: str) -> np.ndarray:
        """(n, B), complex: centres of a contact's elements on the ground."""
        x, y, heading = self.pose
        return x + 1j * y + np.exp(1j * heading) * self.motions[name].place

    def along(self, name: str) -> np.ndarray:
        """(n, B), complex: their headings on the ground."""
        motion = self.motions[name]
        return np.exp(1j * self.pose[2]) * (motion.c + 1j * motion.s)


@dataclass(frozen=True)
class Effect(PerSample):
    """Base of all effects: each changes a `Model`, and any two commute. As its parameter goes to ``limit`` the scene without
    it comes back at ``order``.

    kind: its name in scenes and messages. breaks: the premises it takes away, and with them an engine or a result.
    batched: parameters that may be arrays (B,), one for each sample of a batch. settles: change of displacement from cycle
    to cycle, body lengths, below which cycles with this effect count as periodic. held: numbers that time stepping
    remembers for each sample, beside some for each element. varies: whether it differs along an element, of which it takes
    means, so that longer elements are cut into pieces (`pieced`). odd: what it adds or changes turns round with velocities, as
    far as is known.
    """

    kind = "effect"
    breaks = NONE
    limit = ""
    order = 1
    cost = ""
    batched = ()
    settles = 1e-6
    held = 0
    varies = odd = False

    def apply(self, model: Model) -> Model:
        """The model with what always holds of this effect; ValueError for a medium it does not take."""
        return model

    def assumes(self, medium) -> str:
        """What the effect takes for granted because neither it nor the medium says; nothing by default."""
        return ""


@dataclass(frozen=True)
class Process(Effect):
    """An effect with a past, or a place on the body or on the ground: what holds of it differs from site to site."""

    def begin(self, site: Site) -> Any:
        """What is remembered before the first step; nothing by default."""
        return None

    def at(self, state, site: Site) -> Any:
        """What holds at one step: something with `apply`, as an effect has."""
        raise NotImplementedError

    def after(self, state, site: Site, v: dict[str, np.ndarray]) -> Any:
        """What is remembered after a step that ended with velocities v (3, n, B) of every contact's elements."""
        return state

    def numbers(self, state) -> Any:
        """What is remembered as numbers, arrays of them, None and tuples of these, to be kept; by default what is such
        already. Of anything else nothing is kept."""
        return state

    def state(self, numbers) -> Any:
        """The other way."""
        return numbers

    def kicked(self, state, site: Site, change, drag) -> Any:
        """What is remembered as if the body had moved faster by ``change`` (3, B) at the last steps, of which that at ``site``
        was the last, with so much more drag (3, B), over the model's unit; the ground does not notice."""
        return state


class Prepared(NamedTuple):
    """What is solved for: a body as its effects cut it, its model, and where its contacts' elements are (`rft.contact`)."""

    body: Body
    model: Model
    rows: list[slice]

    @classmethod
    def of(cls, medium, body: Body, effects: Sequence[Effect], rule: str, pieces: int) -> Prepared:
        """Remembered, checks and all, for the last few that cannot change: small batches take no longer to solve than to
        prepare. ValueError for what is no body, and for a medium that pushes."""
        return _prepared(medium, body, tuple(effects), rule, pieces)


@remembered
def _prepared(medium, body, effects, rule, pieces) -> Prepared:
    require_drag(medium)
    body = pieced(checked_body(body), effects, pieces)
    model, zero = folded(effects, medium, body, rule), np.zeros((body.joints, 1))
    return Prepared(body, model, rows(model.motions(body.motion(zero, zero))))


def folded(effects: Sequence[Effect], medium, body: Body, rule: str = "exact") -> Model:
    """The model of a body in a medium, with all that effects do wherever and whenever it is."""
    model = Model.of(medium, rule)
    for effect in effects:
        model = effect.apply(model)
    still = [e for e in effects if isinstance(e, Process) and not e.breaks & SHAPE_ALONE]
    if still:
        zero = np.zeros((body.joints, 1))
        site = Site(0.0, np.zeros((3, 1)), model.motions(body.motion(zero, zero)), {})
        for process in still:
            model = process.at(process.begin(site), site).apply(model)
    return model


def under_way(effects: Sequence[Effect]) -> list[Process]:
    """The processes that differ from step to step."""
    return [e for e in effects if isinstance(e, Process) and e.breaks & SHAPE_ALONE]


def side_by_side(effects: Sequence[Effect], counts: Sequence[int]) -> Effect:
    """One effect with the parameters of several of its kind, each for ``count`` samples of a batch. ValueError if they differ
    in a parameter that cannot differ within a batch."""
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


def pieced(body: Body, effects: Sequence[Effect], pieces: int = PIECES) -> Body:
    """The body as finely cut as its effects need. ValueError for no number of pieces."""
    in_range("pieces", pieces, 1, MOST_PIECES, whole=True)
    return subdivide(body, pieces) if any(e.varies for e in effects) else body
