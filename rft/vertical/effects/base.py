"""What an effect of the vertical plane is: something that an intruder scene may ask for beyond the plain law of stress.

Whatever the effect, the grains' stress on a face at x that leads with v_n m/s across itself is

    (product of all shares at x and v) x (stress of the plain law)  -  (sum of all pressures at v_n) n,

so any effects commute, and they are the same on outlines and on meshes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rft.media.base import require, shown
from rft.premise import NONE
from rft.vertical.stress import PlateStress


@dataclass(frozen=True)
class GroundEffect:
    """Base of effects on the ground; each of them is a frozen dataclass. As its parameter goes to ``limit`` the plain law
    comes back at ``order``.

    kind: its name in scenes and messages. breaks: the premises of the plain law that it takes away.
    """

    kind = "effect"
    breaks = NONE
    limit = ""
    order = 1
    cost = ""

    def share(self, x, ahead=0.0) -> np.ndarray:
        """What it leaves of the ground's strength at places x along the ground, m, for faces whose unit velocity has the part
        ``ahead`` along x; a number if it is the same everywhere."""
        return 1.0

    def pressure(self, v_n) -> np.ndarray:
        """What it adds across a face that leads with v_n >= 0, m/s; Pa."""
        return 0.0

    def weight(self) -> tuple[float, float]:
        """The force (x, z) that it adds at the body's origin besides that of the grains, N."""
        return 0.0, 0.0

    @property
    def assumes(self) -> str:
        """What it takes for granted because the scene does not say; nothing by default."""
        return ""


@dataclass(frozen=True)
class Ground:
    """A stress map with effects on, for `rft.vertical.loads` in place of the map alone."""

    stress: PlateStress
    effects: tuple[GroundEffect, ...]

    @property
    def grazing(self) -> float:
        return self.stress.grazing

    @property
    def tension(self) -> str:
        return self.stress.tension

    def on(self, parts) -> tuple[np.ndarray, np.ndarray]:
        """Stress (x, z) in Pa on `rft.vertical.loads.Parts`."""
        t_x, t_z = self.stress.on(parts)
        share = strength(self.effects, parts.x, parts.v[0])
        across = parts.n[0] * parts.v[0] + parts.n[1] * parts.v[1]
        push = np.sign(across) * pressure(self.effects, np.abs(across) * parts.speed)
        return share * t_x - push * parts.n[0], share * t_z - push * parts.n[1]


def strength(effects: Sequence[GroundEffect], x, ahead=0.0):
    """The product of what the effects leave of the ground's strength at places x, m, for unit velocities with the part
    ``ahead`` along x."""
    left = 1.0
    for effect in effects:
        left = left * effect.share(x, ahead)
    return left


def pressure(effects: Sequence[GroundEffect], v_n):
    """The sum of what the effects add across faces that lead with v_n >= 0, m/s; Pa."""
    return sum((effect.pressure(v_n) for effect in effects), 0.0)


def weight(effects: Sequence[GroundEffect]) -> np.ndarray:
    """(2,): the sum of the forces (x, z) at the body's origin that are not the grains', N."""
    return np.sum([effect.weight() for effect in effects] or [(0.0, 0.0)], axis=0)


def checked(effects) -> tuple[GroundEffect, ...]:
    """The effects as a tuple; ValueError for what is none, and for two of a kind that may stand once."""
    good = isinstance(effects, Sequence) and all(isinstance(e, GroundEffect) for e in effects)
    require(good, f"effects must be a list of effects such as Aeration(0.01, 0.03), got {shown(effects)}")
    kinds = [e.kind for e in effects]
    double = sorted({k for k in kinds if kinds.count(k) > 1 and k != "disturbed-ground"})
    require(not double, f"{', '.join(double)} stands twice in effects: keep one")
    return tuple(effects)


def folded(stress: PlateStress, effects: Sequence[GroundEffect]) -> PlateStress | Ground:
    """The map with the effects on; the map itself if there are none."""
    effects = checked(effects)
    return Ground(stress, effects) if effects else stress
