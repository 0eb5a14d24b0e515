"""What grains do to a face besides the stress of the plain law, and what an effect is that a scene asks for.

On a face at x, with the unit normal n and the unit velocity v, that leads with v_n m/s across itself, the stress is

    share(x, v) x |z| x alpha(n, v) x lead  -  flux v_n^2 n,

alpha that of the law per unit depth, lead one of `rft.ground.lead`. An effect changes the `Ground`, from which share
and flux follow; any effects commute, and they are the same on plates and on triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rft.checks import require, shown
from rft.premise import NONE
from rft.vectors import absolute, formula, maximum, minimum, sqrt, where

UNDISTURBED = np.zeros((0, 3))


class Ground(NamedTuple):
    """Numbers of the ground, or arrays where samples differ.

    strength: times the stress of the law. flux: lambda rho of the grains' inertia, kg/m^3. rounding: m/s; the stress on
    a face of speed v is that of the law times v / sqrt(v^2 + rounding^2), since the law jumps at rest. sine: of the
    grazing angle, over which a face begins to lead; 0 for a jump. fall: share of the strength that is lost to motion
    along +x, if positive, or along -x. disturbed: (G, 2 + P), one row for each effect: radius, m, weakening, and places
    x, m, of which infinite ones do not count."""

    strength: float = 1.0
    flux: float = 0.0
    rounding: float = 0.0
    sine: float = 0.0
    fall: float = 0.0
    disturbed: np.ndarray = UNDISTURBED


@formula
def share(ground, x, ahead):
    """Return the factor of the strength at places x along the ground, m, for unit velocities with the part ``ahead``
    along x."""
    left = ground.strength * (1.0 - maximum(ground.fall * ahead, 0.0))
    for g in range(len(ground.disturbed)):
        disturbance = 0.0 * x
        for p in range(2, ground.disturbed.shape[1]):
            near = 1.5 - absolute(x - ground.disturbed[g, p]) / ground.disturbed[g, 0]
            disturbance = maximum(disturbance, minimum(maximum(near, 0.0), 1.0))
        left = left * (1.0 - ground.disturbed[g, 1] * disturbance)
    return left


@formula
def per_speed(ground, speed):
    """Return 1 / sqrt(speed^2 + rounding^2), 0 at rest: times the speed it is the share of the stress that a face bears."""
    still = speed == 0.0
    fast = sqrt(speed * speed + ground.rounding * ground.rounding)
    return where(still, 0.0, 1.0) / where(still, 1.0, fast)


@dataclass(frozen=True)
class GroundEffect:
    """Base of effects on the ground; each of them is a frozen dataclass. As its parameter goes to ``limit`` the plain
    law comes back at ``order``.

    kind: its name in scenes and messages. breaks: the premises of the plain law that it takes away. walks: whether
    robots walk on such ground.
    """

    kind = "effect"
    breaks = NONE
    limit = ""
    order = 1
    cost = ""
    walks = False

    def apply(self, ground: Ground) -> Ground:
        """Return the ground with this effect."""
        raise NotImplementedError

    def weight(self) -> tuple[float, float]:
        """Return the force (x, z), N, that it adds at the body's origin besides that of the grains."""
        return 0.0, 0.0

    @property
    def assumes(self) -> str:
        """What it takes for granted because the scene does not say; nothing by default."""
        return ""


def ground_of(effects: Sequence[GroundEffect], ground: Ground | None = None) -> Ground:
    """Return the ground with all effects; ValueError for what is no list of effects."""
    ground = ground or Ground()
    for effect in checked(effects):
        ground = effect.apply(ground)
    return ground


def weight(effects: Sequence[GroundEffect]) -> np.ndarray:
    """Return (2,): the sum of the forces (x, z) at the body's origin that are not the grains', N."""
    return np.sum([effect.weight() for effect in effects] or [(0.0, 0.0)], axis=0)


def checked(effects) -> tuple[GroundEffect, ...]:
    """Return the effects as a tuple; ValueError for what is none, and for two of a kind that may stand once."""
    good = isinstance(effects, Sequence) and all(isinstance(e, GroundEffect) for e in effects)
    require(good, f"effects must be a list of effects such as Aeration(0.01, 0.03), got {shown(effects)}")
    kinds = [e.kind for e in effects]
    double = sorted({k for k in kinds if kinds.count(k) > 1 and k != "disturbed-ground"})
    require(not double, f"{', '.join(double)} stands twice in effects: keep one")
    return tuple(effects)
