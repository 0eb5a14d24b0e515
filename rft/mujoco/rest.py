"""Bodies that come to rest: a force that remembers.

Without memory none does. A force that depends on the velocity v alone vanishes at rest, so it bears a weight m g only while
the body sinks. Where steps of h are explicit, it may rise by at most 2 m / h for each m/s, else it chatters; hence the body
sinks at g h / 2 at least, or chatters as fast (`rft.mujoco.steps`).

With memory, each geom holds a wrench H. It follows the wrench w of the moving grains, which has no rounding, over a distance
d that the geom moves at the speed s, and stays as it is at rest:

    H' = (w - H) s / d,    wrench = H + q w s / sqrt(s^2 + e^2) / (1 + s^2 / e^2)^2.

The second term damps slow motion and vanishes at speeds above e. For s, velocity and spin are joined by the radius of the
sphere around the geom. With S the sum of the loads on all geoms of the robot, as these move in the grains, and m the mass
that the geom's body has, as joints let it move,

    e = q h S / m,    d = 10 h^2 S / m:

a step takes what is left of the motion away, and the stiffness S / d is a tenth of m / h^2. A geom that moves out of the
grains has no such load; half of what it holds counts then. H is at most w, so that a body rests no higher than where the
grains just bear it. The numbers were found on a box and a hexapod in steps of 0.5 and 2 ms, and hold for other bodies in
steps of up to 5 ms; with the stiffness ten times as high, bodies do not come to rest."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rft.vectors import formula, sqrt

PER_GEOM = 9  # numbers that a simulation remembers for a geom, beside the time
STIFFNESS = 10.0  # m / h^2 over S / d
SHARE = 0.25  # q
RELEASE = 0.5  # of what is held: the least that counts as load, where a geom moves out of the grains
ROUNDING = 1e-3  # m/s, assumed: of the stress on elements, in place of what a force without memory needs


class Rest(NamedTuple):
    """What holding follows from. inverse_masses, radii: (G,), 1/kg and m. robots: (G,), the first geom of each geom's robot.
    step: (1,), h, s; in compiled code, in the model's own memory, as it may change."""

    inverse_masses: np.ndarray
    radii: np.ndarray
    robots: np.ndarray
    step: np.ndarray = np.zeros(1)

    @property
    def numbers(self) -> int:
        """How many numbers of userdata hold the memory."""
        return 1 + PER_GEOM * len(self.robots)


class Held(NamedTuple):
    """What a simulation remembers, views of its userdata. time: (1,), s. wrenches: (G, 6), N and N m. speeds: (G,), e, m/s.
    loads: (G,), of each geom, N. totals: (G,), S in the last step, N, in the place of the first geom of each robot."""

    time: np.ndarray
    wrenches: np.ndarray
    speeds: np.ndarray
    loads: np.ndarray
    totals: np.ndarray


def held_of(numbers, geoms) -> Held:
    """Return the memory in an array of numbers."""
    return Held(
        numbers[:1],
        numbers[1 : 1 + 6 * geoms].reshape(geoms, 6),
        numbers[1 + 6 * geoms : 1 + 7 * geoms],
        numbers[1 + 7 * geoms : 1 + 8 * geoms],
        numbers[1 + 8 * geoms : 1 + 9 * geoms],
    )


def begin(held, rest, time) -> float:
    """Return the time, s, since the last step, 0 if it is the same. At time 0 nothing is held."""
    passed = time - held.time[0]
    if passed == 0.0:
        return 0.0
    if time == 0.0:
        held.wrenches[:] = 0.0
        held.loads[:] = 0.0
    held.time[0] = time
    held.totals[:] = 0.0
    for k in range(len(rest.robots)):
        held.totals[rest.robots[k]] += held.loads[k]
    return min(max(passed, 0.0), rest.step[0])


def hold(held, rest, k, passed, speed, rounding, wrench) -> None:
    """Let geom k hold, after a time, s, what the grains exert on it; wrench: six numbers, rounded."""
    if passed == 0.0:
        return
    size, own = math.sqrt(speed * speed + rounding * rounding), held.wrenches[k]
    moving = (
        math.sqrt(wrench[0] ** 2 + wrench[1] ** 2 + wrench[2] ** 2)
        * size
        / max(speed, 1e-9)
    )
    load = max(moving, RELEASE * math.sqrt(own[0] ** 2 + own[1] ** 2 + own[2] ** 2))
    total = (
        held.totals[rest.robots[k]] - held.loads[k] + load
    )  # of other geoms in the last step
    held.loads[k], held.speeds[k] = (
        load,
        SHARE * rest.step[0] * total * rest.inverse_masses[k],
    )
    share = passed / max(STIFFNESS / SHARE * rest.step[0] * held.speeds[k], 1e-9)
    for i in range(6):
        own[i] = (own[i] + share * wrench[i] * size) / (1.0 + share * speed)


def let_go(held, k) -> None:
    """Let geom k, out of the ground, hold nothing."""
    held.wrenches[k] = 0.0
    held.loads[k] = 0.0


@formula
def damping(speed, own_speed, rounding):
    """Return the factor of a rounded wrench that damps slow motion. own_speed: e, m/s."""
    ratio = speed / (own_speed + 1e-9)
    fade = 1.0 / (1.0 + ratio * ratio)
    return (
        SHARE
        * fade
        * fade
        * sqrt(
            (speed * speed + rounding * rounding)
            / (speed * speed + own_speed * own_speed + 1e-18)
        )
    )


COMPILED = held_of, begin, hold, let_go
