"""The base of effects: additions to the plain force law, computed only where a scene
lists them."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from rft.core.checks import in_range, number_fields
from rft.core.premise import NONE, PHASE_ALONE, Premise
from rft.core.refusal import Refusal, located, require
from rft.core.registry import Registry, subclasses
from rft.effects.contact import Problem

# Engines and what they solve, the cheapest first.
ENGINES = {
    "algebraic": "the force balance, at all shapes together",
    "time stepping": "the balance of forces step after step through the gait, place "
    "and past carried along",
    "dynamic": "the equation of motion, phase after phase, implicit in time",
}
PAST = Premise.MEMORYLESS | Premise.QUASI_STATIC


class InMetres(NamedTuple):
    """The field that gives a length in metres, beside one in body lengths: its name,
    and the power of the length in both, 1, or -1 for a number per length."""

    name: str
    power: int = 1

    @property
    def unit(self) -> str:
        return "in m" if self.power == 1 else "per m"


class Site(NamedTuple):
    """Place and phase of one time step of B samples, in body lengths and rad.

    count: number of steps before this one. dt: phase since the previous step, rad, 0 at
    the first step. pose: (3, B), predicted pose of the frame on the ground (that at the
    previous step where no effect reads it). v_before: velocities (v_t, v_n, v_w) of the
    body's elements at the previous step, (n, B) each."""

    count: int
    dt: float
    pose: np.ndarray
    v_before: tuple[np.ndarray, np.ndarray, np.ndarray]

    def centres(self, elements: Any) -> np.ndarray:
        """Return the centres of elements on the ground as complex numbers x + i y,
        (n, B)."""
        x, y, theta = self.pose
        return x + 1j * y + np.exp(1j * theta) * elements.centres

    def headings(self, elements: Any) -> np.ndarray:
        """Return the headings of elements on the ground as complex numbers exp(i
        theta), (n, B)."""
        return np.exp(1j * self.pose[2]) * (elements.c + 1j * elements.s)


@dataclass(frozen=True)
class Effect:
    """Base of all effects; an effect is one change of a `rft.effects.contact.Problem`,
    and any two effects commute.

    Attributes
    ----------
    kind : name in scenes and messages.
    breaks : premises that no longer hold with the effect, and with them an engine or a
        result.
    adds_points : whether the effect adds points to the body; other effects then act on
        these points, too.
    limit : values of the parameters at which the effect vanishes, as text.
    order : order at which it vanishes there.
    cost : work beyond that of the plain force law, as text.
    mixes_media : whether samples of a batch may be in different media: `apply` then
        reads any number of the medium by `rft.laws.batch.for_samples`, and drags of the
        problem are arrays.
    batched : names of parameters that may be arrays (B,), one number for each sample of
        a batch.
    drift_tolerance : change of displacement from cycle to cycle, body lengths, below
        which cycles are periodic.
    memory_bounds : least and largest number of a state that is an array of memory, of
        which those at the starts of cycles may be mixed to reach the limit cycle
        sooner; None for a state of another kind.
    memory_size : numbers that time stepping stores for each sample, beside a few for
        each element.
    reads_place : whether the effect reads `Site.pose`, which is not predicted where no
        effect does.
    varies_along : whether the effect varies along an element; it then acts by its mean
        over each piece of an element.
    knows_contact : whether the effect is right where parts of the body are lifted
        (`rft.contacts`).
    odd : whether the loads that it adds change sign with all velocities (assumed, not
        proven).
    metres : fields in body lengths, and for each the field that gives it in metres, of
        a body with a ``length``.
    required : fields without a default that follow one with.
    element_update : for an effect whose state is numbers of the body's elements
        (k, n, B), a formula of one element in place of `after` (a function that
        ``rft.formulas.vectors.formula`` marks, as a staticmethod): its arguments are
        those of `element_arguments`, then v_t, v_n and v_w after the step, and it
        returns the k new numbers. It is compiled where balances are.

    Examples
    --------
    >>> from rft.effects import Effect, SkinFriction
    >>> isinstance(SkinFriction(), Effect), SkinFriction().kind
    (True, 'skin-friction')
    """

    kind = "effect"
    breaks = NONE
    adds_points = False
    mixes_media = False
    limit = ""
    order = 1
    cost = ""
    batched = ()
    drift_tolerance = 1e-6
    memory_bounds: ClassVar[tuple[float, float] | None] = None
    memory_size = 0
    reads_place = True
    varies_along = odd = False
    knows_contact = False
    metres: ClassVar[Mapping[str, InMetres]] = {}
    required = ()
    element_update: ClassVar[Callable[..., tuple] | None] = None

    def check_lengths(self) -> None:
        """Raise ValueError unless each length is given once, in body lengths or in
        metres, where it has no default, and all of ``required`` are given."""
        defaults = {f.name: f.default for f in fields(self)}
        for name in self.required:
            if getattr(self, name) is None:
                raise Refusal(f"{self.kind} has no {name}", instead=f"give {name}")
        for name, other in self.metres.items():
            given = getattr(self, name)
            left_out = given is None or given is defaults[name]
            cure = (
                f"give {name} in body lengths, or {other.name} for a body with a "
                "length in m"
            )
            if getattr(self, other.name) is not None:
                require(left_out, f"{name} is given twice", instead=cure)
            elif given is None:
                raise Refusal(f"{self.kind} has no {name}", instead=cure)

    def in_body_lengths(self, length: float | None) -> Self:
        """Return the effect with its lengths in body lengths, on a body of a length
        (m), None for one without.

        Raises ValueError for metres on a body without a length, for body lengths on a
        body that has one, where they are easily taken for metres, and for values out
        of bounds. 0 is the same in both.

        Examples
        --------
        >>> from rft.effects import EndCaps
        >>> EndCaps(radius_m=0.012).in_body_lengths(0.24).radius
        0.05
        """
        values = {}
        for name, other in self.metres.items():
            number = number_fields(type(self))[name]
            own = getattr(self, name)
            in_metres = getattr(self, other.name)
            if in_metres is None:
                if length is not None and np.any(own):
                    largest = np.max(own)
                    scaled = largest * length**other.power
                    raise Refusal(
                        f"{name} = {largest:.6g} is in {number.unit}",
                        where=self.kind,
                        because=f"the body has a length, {length:g} m",
                        instead=f"give {other.name} instead: {largest:.6g} if the "
                        f"value is {other.unit}, otherwise {scaled:.6g}",
                    )
                continue
            if length is None:
                raise Refusal(
                    other.name,
                    where=self.kind,
                    because="the body has no length",
                    instead=(
                        f"give the body a length in m, or give {name} in {number.unit}"
                    ),
                )
            values[other.name] = None
            values[name] = in_metres / length**other.power
            with located(f"{self.kind} {other.name} on a body of {length:g} m"):
                for x in (np.min(values[name]), np.max(values[name])):
                    in_range(name, float(x), number.low, number.high, unit=number.unit)
        return self.with_parameters(**values)

    def in_metres(self, length: float | None) -> Self:
        """Return the effect with its lengths in metres, for a body of a length (m);
        unchanged for None.

        Examples
        --------
        >>> from rft.effects import EndCaps
        >>> EndCaps(radius=0.05).in_metres(0.24).radius_m
        0.012
        """
        defaults = {f.name: f.default for f in fields(self)}
        values = {}
        for name, other in self.metres.items():
            own = getattr(self, name)
            if length is not None and own is not None and np.any(own):
                values[other.name] = own * length**other.power
                values[name] = defaults[name]
        return self.with_parameters(**values)

    def check(self, medium: Any) -> None:
        """Raise ValueError for a medium that the effect does not take."""

    def check_body(self, body: Any, medium: Any) -> None:
        """Raise ValueError for a body that the effect does not take in a medium."""

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Self]:
        """Return effects by name, the one of ``order`` by ``kind`` alone, that vanish
        as x goes to 0."""
        return {cls.kind: cls()}

    def apply(self, problem: Problem, site: Site | None, state: Any) -> Problem:
        """Return the problem with this effect; site and state are None unless the
        effect breaks a premise of `rft.core.premise.PHASE_ALONE`."""
        raise NotImplementedError

    def begin(self, problem: Problem, site: Site) -> Any:
        """Return the state of the effect before the first step: a record of arrays,
        samples on the last axis."""
        return ()

    def after(self, problem: Problem, site: Site, state: Any, v: tuple) -> Any:
        """Return the state after a step that ended with velocities v = (v_t, v_n, v_w)
        of the body's elements."""
        if self.element_update is None:
            return state
        return np.array(
            self.element_update(*self.element_arguments(problem, site, state), *v)
        )

    def element_arguments(
        self, problem: Problem, site: Site, state: Any
    ) -> tuple[np.ndarray, ...]:
        """Return the first arguments of `element_update`, arrays that broadcast to
        (n, B)."""
        raise NotImplementedError

    def with_velocity_change(
        self,
        problem: Problem,
        site: Site,
        state: Any,
        change: np.ndarray,
        drag: np.ndarray,
    ) -> Any:
        """Return the state as if the body had moved faster by ``change`` (3, B) up to
        and including the step at ``site``, with an additional ``drag`` (3, B) over the
        axial drag; the state of the ground stays as it is."""
        return state

    def assumes(self, medium: Any) -> str:
        """Return, as text, what is assumed because neither the effect nor the medium
        gives it; "" for nothing."""
        return ""

    def take(self, index: Any) -> Self:
        """Return the effect with its parameters at the samples ``index``."""
        selected = {}
        for field in fields(self):
            x = getattr(self, field.name)
            if isinstance(x, np.ndarray) and x.ndim > 0 and x.shape[-1] != 1:
                selected[field.name] = x[..., index]
        return self.with_parameters(**selected)

    def with_parameters(self, **values: Any) -> Self:
        """Return the effect with other parameters, which may be arrays (B,); nothing is
        checked."""
        if not values:
            return self
        new = object.__new__(type(self))
        new.__dict__.update({**self.__dict__, **values})
        return new


EFFECTS = Registry("geomech.effects", "kind", "an effect", subclasses(Effect))


def stepwise_effects(effects: Sequence[Effect]) -> list[Effect]:
    """Return the effects that depend on the past or on the place on the ground, and so
    take time stepping.

    Examples
    --------
    >>> from rft.effects import SkinFriction, Transient, stepwise_effects
    >>> effects = [SkinFriction(), Transient(travel=0.12)]
    >>> [effect.kind for effect in stepwise_effects(effects)]
    ['transient']
    """
    return [effect for effect in effects if effect.breaks & PHASE_ALONE]


def batched_effect(effects: Sequence[Effect], counts: Sequence[int]) -> Effect:
    """Return one effect for a batch, made from effects of one kind, each of them for
    ``count`` samples in a row.

    Raises ValueError if they differ in a parameter that is not `Effect.batched`.

    Examples
    --------
    >>> from rft.effects import SkinFriction, batched_effect
    >>> effects = [SkinFriction(0.1, 0.1), SkinFriction(0.1, 0.2)]
    >>> batched_effect(effects, counts=[1, 2]).backward
    array([0.1, 0.2, 0.2])
    """
    first = effects[0]
    joined = {}
    for field in fields(first):
        values = [getattr(e, field.name) for e in effects]
        if any(v != values[0] for v in values):
            if field.name not in first.batched:
                raise Refusal(
                    first.kind, instead=f"{field.name} cannot differ within a batch"
                )
            # Samples on the last axis.
            joined[field.name] = np.repeat(np.array(values, float).T, counts, -1)
    return first.with_parameters(**joined)


def broken_premises(effects: Sequence[Effect]) -> Premise:
    """Return the premises that the effects break; ValueError unless all are effects.

    Examples
    --------
    >>> from rft.effects import Transient, broken_premises
    >>> broken_premises([Transient(travel=0.12)])
    <Premise.MEMORYLESS: 4>
    """
    is_sequence = isinstance(effects, Sequence)
    require(
        is_sequence and all(isinstance(e, Effect) for e in effects),
        "effects must be a list of effects such as EndCaps(radius=0.06)",
        value=effects,
    )
    return functools.reduce(operator.or_, (e.breaks for e in effects), NONE)


def engine(effects: Sequence[Effect]) -> str:
    """Return the cheapest of ENGINES that is right with these effects.

    Examples
    --------
    >>> from rft.effects import SkinFriction, Transient, engine
    >>> engine([SkinFriction()]), engine([SkinFriction(), Transient(travel=0.12)])
    ('algebraic', 'time stepping')
    """
    broken = broken_premises(effects)
    if broken & Premise.QUASI_STATIC:
        return "dynamic"
    return "time stepping" if broken & PHASE_ALONE else "algebraic"
