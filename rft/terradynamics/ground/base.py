"""The strength of the ground at a place, and the effects that change it.

On a face at x with the unit normal n, the unit velocity v and the speed v_n, m/s, along
its normal, the stress is

    strength(x, v) x |z| x alpha(n, v) x lead  -  flux v_n^2 n.

Here alpha is the law's stress per unit depth, and lead is a function of
`rft.terradynamics.ground.lead`. A scene names effects; each changes the `Ground`, which
holds strength and flux. Effects commute, and they are the same on plates and on
triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from rft.core.premise import NONE
from rft.core.refusal import require
from rft.core.registry import Registry, subclasses
from rft.formulas.vectors import absolute, formula, maximum, minimum, sqrt, where

UNDISTURBED = np.zeros((0, 3))


class Ground(NamedTuple):
    """State of the ground, in numbers, or in arrays where samples differ.

    strength: factor of the law's stress. flux: lambda rho of the grains' inertia,
    kg/m^3. rounding: m/s; a face of speed v bears v / sqrt(v^2 + rounding^2) times the
    law's stress, which jumps at rest. grazing_sine: sine of the grazing angle, over
    which a face begins to lead; 0 for a jump. downhill_loss: share of the strength lost
    in motion along +x, or along -x where it is negative. disturbed: (G, 2 + P), one row
    for each effect `DisturbedGround`: radius, m, weakening, and places x, m; places at
    infinity fill up short rows.

    Examples
    --------
    >>> from rft.terradynamics.ground import Ground
    >>> Ground(strength=0.6).strength
    0.6
    """

    strength: float = 1.0
    flux: float = 0.0
    rounding: float = 0.0
    grazing_sine: float = 0.0
    downhill_loss: float = 0.0
    disturbed: np.ndarray = UNDISTURBED


@formula
def strength_at(ground, x, v_x):
    """Return the strength of the ground at places x along it, m, for unit velocities
    with the component ``v_x`` along x.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.ground import Slope, ground_of, strength_at
    >>> slope = ground_of([Slope(angle=0.2)])
    >>> uphill_and_downhill = np.array([1.0, -1.0])
    >>> strength_at(slope, np.zeros(2), uphill_and_downhill).round(3)
    array([0.98 , 0.725])
    """
    strength = ground.strength * (1.0 - maximum(ground.downhill_loss * v_x, 0.0))
    for g in range(len(ground.disturbed)):
        disturbance = 0.0 * x
        for p in range(2, ground.disturbed.shape[1]):
            near = 1.5 - absolute(x - ground.disturbed[g, p]) / ground.disturbed[g, 0]
            disturbance = maximum(disturbance, minimum(maximum(near, 0.0), 1.0))
        strength = strength * (1.0 - ground.disturbed[g, 1] * disturbance)
    return strength


@formula
def inverse_speed(ground, speed):
    """Return 1 / sqrt(speed^2 + rounding^2), s/m, and 0 at rest.

    The speed times this value is the share of the law's stress that a face bears.

    Examples
    --------
    >>> from rft.terradynamics.ground import Ground, inverse_speed
    >>> float(inverse_speed(Ground(), 0.5))  # s/m
    2.0
    """
    at_rest = speed == 0.0
    rounded_speed = sqrt(speed * speed + ground.rounding * ground.rounding)
    return where(at_rest, 0.0, 1.0) / where(at_rest, 1.0, rounded_speed)


@dataclass(frozen=True)
class GroundEffect:
    """Base of effects on the ground; each effect is a frozen dataclass.

    kind: name of the effect in scenes and messages. breaks: premises of the plain law
    that the effect breaks. limit, order: as the parameter named in ``limit`` goes to
    its limit, forces approach those of the plain law at this order. cost: what the
    effect adds to a computation. walks: whether robots can walk on such ground.

    Examples
    --------
    >>> from rft.terradynamics.ground import Aeration, GroundEffect
    >>> isinstance(Aeration(0.1, 0.25), GroundEffect)
    True
    """

    kind = "effect"
    breaks = NONE
    limit = ""
    order = 1
    cost = ""
    walks = False

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Self]:
        """Return effects by name that vanish as x goes to 0; the one named ``kind``
        does so at ``order``."""
        return {cls.kind: cls()}

    def apply(self, ground: Ground) -> Ground:
        """Return the ground with this effect."""
        raise NotImplementedError

    def weight(self) -> tuple[float, float]:
        """Return the force (x, z), N, that the effect adds at the body's origin to the
        force of the grains."""
        return 0.0, 0.0

    @property
    def assumes(self) -> str:
        """Assumptions of the effect beyond what the scene states; empty by default."""
        return ""

    @property
    def rise(self) -> float:
        """Angle by which the effect lets the surface rise along x, rad."""
        return 0.0


GROUND_EFFECTS = Registry(
    "geomech.ground_effects",
    "kind",
    "an effect on the ground",
    subclasses(GroundEffect),
)


def ground_of(effects: Sequence[GroundEffect], ground: Ground | None = None) -> Ground:
    """Return the ground, or the default one, with all effects applied; ValueError for
    anything but a list of effects.

    Examples
    --------
    >>> from rft.terradynamics.ground import Aeration, GrainInertia, ground_of
    >>> ground = ground_of([Aeration(0.1, 0.25), GrainInertia()])
    >>> ground.strength, ground.flux
    (0.6, 638.0)
    """
    ground = ground or Ground()
    for effect in checked_effects(effects):
        ground = effect.apply(ground)
    return ground


def rise_of(effects: Sequence[GroundEffect]) -> float:
    """Return the angle by which the surface rises along x with all effects, rad.

    Examples
    --------
    >>> from rft.terradynamics.ground import Aeration, Slope, rise_of
    >>> rise_of([Slope(angle=0.2), Aeration(0.1, 0.25)])
    0.2
    """
    return sum(effect.rise for effect in effects)


def weight(effects: Sequence[GroundEffect]) -> np.ndarray:
    """Return the sum (2,) of the forces (x, z), N, that effects add at the body's
    origin to the force of the grains.

    Examples
    --------
    >>> from rft.terradynamics.ground import Slope, weight
    >>> weight([Slope(angle=0.2, mass=1.0)]).round(3)  # N
    array([-1.949,  0.   ])
    """
    forces = [effect.weight() for effect in effects]
    return np.sum(forces or [(0.0, 0.0)], axis=0)


def checked_effects(effects) -> tuple[GroundEffect, ...]:
    """Return the effects as a tuple; ValueError for anything but a list of effects, and
    for two effects of one kind, except disturbed ground.

    Examples
    --------
    >>> from rft.terradynamics.ground import Aeration, checked_effects
    >>> checked_effects([Aeration(0.1, 0.25)])[0].kind
    'aeration'
    """
    is_list = isinstance(effects, Sequence)
    require(
        is_list and all(isinstance(effect, GroundEffect) for effect in effects),
        "effects must be a list of effects such as Aeration(0.01, 0.03)",
        value=effects,
    )
    kinds = [effect.kind for effect in effects if effect.kind != "disturbed-ground"]
    duplicates = sorted({kind for kind in kinds if kinds.count(kind) > 1})
    require(
        not duplicates,
        f"{', '.join(duplicates)} appears twice in effects",
        instead="keep one of them",
    )
    return tuple(effects)
