"""Motions of a body in a bed: towed, to and fro, and free in the plane with prescribed
joints.

A motion is a state, numbers that a stopped run keeps, and two functions of it: the next
state under the force of the grains, and the placement of the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, NamedTuple, Protocol

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.refusal import require
from rft.grains.spheres import Placement, Spheres

# shapes of a cycle that name a swim and are looked through for links that touch
SAMPLES = 256


class Moved(NamedTuple):
    """A body at a time. placement: of its spheres. pose: (3,), x and y of its frame, m,
    and heading, rad. centre: of mass, m, x + i y, about which moments are taken. alpha:
    joint angles, rad. kinetic: energy of the body, J."""

    placement: Placement
    pose: np.ndarray
    centre: complex
    alpha: np.ndarray
    kinetic: float


class Motion(Protocol):
    """A motion of a body. `named` returns all data that it consists of, `check` refuses
    what it cannot do."""

    def named(self) -> tuple: ...

    def check(self, body: Spheres) -> None: ...

    def start(self) -> np.ndarray:
        """Return the state at rest."""

    def push(
        self, state: np.ndarray, force: np.ndarray, moment: float, dt: float
    ) -> np.ndarray:
        """Return the state with the momentum that a force (3,), N, and a moment about
        z, N m, add in dt (s)."""

    def move(
        self,
        state: np.ndarray,
        t: float,
        dt: float,
        body: Spheres,
        mass: float,
        height: float,
    ) -> tuple[np.ndarray, Moved]:
        """Return the state at t (s), which is dt later, and the body there. mass: kg.
        height: of the axis, m."""


@dataclass(frozen=True)
class Tow:
    """A rigid body, or a straight chain, at constant velocity. speed (m/s). angle
    (rad): of the velocity from the body's axis, which lies along x.

    Examples
    --------
    >>> from rft.grains import Tow
    >>> Tow(speed=0.1, angle=1.2).path(0.5)  # m along its line, and m/s
    (0.05, 0.1)
    """

    speed: Annotated[float, Number(1e-9, 1e3, "m/s", "")]
    angle: Annotated[float, Number(-1e3, 1e3, "rad", "")] = 0.0

    def named(self) -> tuple:
        return type(self).__name__, self.speed, self.angle

    def check(self, body: Spheres) -> None:
        check_numbers(self)

    def path(self, t: float) -> tuple[float, float]:
        """Return how far the body is along its line, m, and its speed, m/s."""
        return self.speed * t, self.speed

    def start(self) -> np.ndarray:
        return np.zeros(0)

    def push(
        self, state: np.ndarray, force: np.ndarray, moment: float, dt: float
    ) -> np.ndarray:
        return state

    def move(
        self,
        state: np.ndarray,
        t: float,
        dt: float,
        body: Spheres,
        mass: float,
        height: float,
    ) -> tuple[np.ndarray, Moved]:
        zero = np.zeros(body.joints)
        direction = np.exp(1j * self.angle)
        distance, speed = self.path(t)
        links = body.links(zero, zero)
        place = distance * direction
        origin = place - body.half_lengths @ links.centres / body.half_lengths.sum()
        placement = body.placed(links, origin, 0.0, speed * direction, 0.0, height)
        return state, Moved(
            placement,
            np.array([origin.real, origin.imag, 0.0]),
            place,
            zero,
            mass * speed**2 / 2,
        )


@dataclass(frozen=True)
class Stroke(Tow):
    """A rigid body to and fro at constant speed: from the middle to amplitude (m), then
    to -amplitude, and so on.

    Examples
    --------
    >>> from rft.grains import Stroke
    >>> Stroke(speed=0.25, amplitude=0.125).path(0.75)  # on its way back
    (0.0625, -0.25)
    """

    amplitude: Annotated[float, Number(1e-9, 1e3, "m", "")] = 0.02

    def named(self) -> tuple:
        return (*super().named(), self.amplitude)

    def path(self, t: float) -> tuple[float, float]:
        a = self.amplitude
        q = (self.speed * t + a) % (4 * a)
        return (q - a, self.speed) if q < 2 * a else (3 * a - q, -self.speed)


@dataclass(frozen=True, eq=False)
class Swim:
    """A body free in the plane with prescribed joint angles; its height is held.

    shape: function of the phase (rad) that returns joint angles (joints,), rad, of
    period 2 pi. rate: its derivative. frequency (Hz). ramp (s): the shape grows
    smoothly from the straight body during it. phase (rad): at t = 0.

    Momentum and moment of momentum follow from force and moment of the grains by
    Euler's method, momentum first. The mass of a link is its share of the length.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.grains import Swim
    >>> circle = Swim(lambda t: np.array([np.cos(t), np.sin(t)]), lambda t: np.array([-np.sin(t), np.cos(t)]), ramp=0.5)
    >>> alpha, alphadot = circle.joint_angles(1.0)  # rad, rad/s
    >>> alpha.round(6), alphadot.round(3)
    (array([ 1., -0.]), array([0.   , 6.283]))
    """

    shape: Callable[[float], np.ndarray]
    rate: Callable[[float], np.ndarray]
    frequency: Annotated[float, Number(1e-9, 1e6, "Hz", "")] = 1.0
    ramp: Annotated[float, Number(1e-9, 1e6, "s", "")] = 0.5
    phase: Annotated[float, Number(-1e6, 1e6, "rad", "")] = 0.0

    def named(self) -> tuple:
        samples = np.array([self.shape(t) for t in self._phases()], float)
        return (
            type(self).__name__,
            samples.round(12).tolist(),
            self.frequency,
            self.ramp,
            self.phase,
        )

    def _phases(self) -> np.ndarray:
        return 2 * np.pi * np.arange(SAMPLES) / SAMPLES

    def check(self, body: Spheres) -> None:
        check_numbers(self)
        shapes = np.array([self.shape(t) for t in self._phases()], float)
        require(
            shapes.shape[1:] == (body.joints,),
            f"the gait has {shapes.shape[-1]} joint angles, and the body {body.joints}",
        )
        body.check_apart(shapes[::4])

    def joint_angles(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Return joint angles, rad, and their rates, rad/s, at t (s)."""
        w = 2 * np.pi * self.frequency
        q = min(t / self.ramp, 1.0)
        grown = q * q * (3 - 2 * q)
        growing = 6 * q * (1 - q) / self.ramp
        alpha, slope = (
            np.asarray(f(w * t + self.phase), float) for f in (self.shape, self.rate)
        )
        return grown * alpha, grown * w * slope + growing * alpha

    def start(self) -> np.ndarray:
        # x, y of the centre of mass, heading of the frame, momentum x and y, moment of
        # momentum about the centre.
        return np.zeros(6)

    def push(
        self, state: np.ndarray, force: np.ndarray, moment: float, dt: float
    ) -> np.ndarray:
        return state + dt * np.array([0.0, 0.0, 0.0, force[0], force[1], moment])

    def move(
        self,
        state: np.ndarray,
        t: float,
        dt: float,
        body: Spheres,
        mass: float,
        height: float,
    ) -> tuple[np.ndarray, Moved]:
        alpha, alphadot = self.joint_angles(t)
        links = body.links(alpha, alphadot)
        m = mass * body.half_lengths / body.half_lengths.sum()
        bars = (
            m * body.half_lengths**2 / 3
        )  # moments of inertia of thin links about their centres
        centre = m @ links.centres / mass
        drift = m @ links.velocities / mass
        lever = links.centres - centre
        inner = links.velocities - drift
        inertia = m @ np.abs(lever) ** 2 + bars.sum()
        spin = m @ (lever.conj() * inner).imag + bars @ links.rates
        x, y, theta, px, py, L = state
        v = complex(px, py) / mass
        rate = (L - spin) / inertia
        place = complex(x, y) + dt * v
        theta = theta + dt * rate
        turn = np.exp(1j * theta)
        origin = place - turn * centre
        speed = v - turn * (drift + 1j * rate * centre)
        placement = body.placed(links, origin, theta, speed, rate, height)
        rates = rate + links.rates
        link_v = v + turn * (inner + 1j * rate * lever)
        kinetic = (m @ np.abs(link_v) ** 2 + bars @ rates**2) / 2
        moved = Moved(
            placement,
            np.array([origin.real, origin.imag, theta]),
            place,
            alpha,
            float(kinetic),
        )
        return np.array([place.real, place.imag, theta, px, py, L]), moved
