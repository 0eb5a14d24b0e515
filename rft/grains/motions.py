"""Motions of a body in a bed: towed, back and forth, and free in the plane with
prescribed joints.

A motion has a state, numbers from which an interrupted run is resumed, and two
functions of it: the next state under the force of the grains, and the placement of the
body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, NamedTuple, Protocol

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.refusal import require
from rft.grains.spheres import Placement, Spheres

# Shapes of a cycle, which identify a swim; one of four is checked for links that touch.
SAMPLES = 256


class BodyState(NamedTuple):
    """A body at a time.

    placement: of its spheres. pose: (3,), x and y of its frame, m, and heading, rad.
    centre: of mass, m, x + i y, about which moments are taken. alpha: joint angles,
    rad. kinetic: energy of the body, J."""

    placement: Placement
    pose: np.ndarray
    centre: complex
    alpha: np.ndarray
    kinetic: float


class Motion(Protocol):
    """A motion of a body."""

    def identity(self) -> tuple:
        """Return all numbers and names that the motion consists of."""

    def check(self, body: Spheres) -> None:
        """Raise ValueError for a motion that the body cannot do."""

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
    ) -> tuple[np.ndarray, BodyState]:
        """Return the state at t (s), which is dt later, and the body there. mass: kg.
        height: of the axis, m."""


@dataclass(frozen=True)
class Tow:
    """A rigid body, or a straight chain, at constant velocity.

    speed (m/s). angle (rad): of the velocity from the body's axis, which lies along x.

    Examples
    --------
    >>> from rft.grains import Tow
    >>> Tow(speed=0.1, angle=1.2).path(0.5)  # m along its line, and m/s
    (0.05, 0.1)
    """

    speed: Annotated[float, Number(1e-9, 1e3, "m/s", "")]
    angle: Annotated[float, Number(-1e3, 1e3, "rad", "")] = 0.0

    def identity(self) -> tuple:
        return type(self).__name__, self.speed, self.angle

    def check(self, body: Spheres) -> None:
        check_numbers(self)

    def path(self, t: float) -> tuple[float, float]:
        """Return the distance of the body along its line, m, and its speed, m/s."""
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
    ) -> tuple[np.ndarray, BodyState]:
        zero = np.zeros(body.joints)
        links = body.links(zero, zero)
        direction = np.exp(1j * self.angle)
        distance, speed = self.path(t)
        centre = distance * direction
        origin = centre - body.half_lengths @ links.centres / body.half_lengths.sum()
        velocity = speed * direction
        return state, BodyState(
            placement=body.placement(links, origin, 0.0, velocity, 0.0, height),
            pose=np.array([origin.real, origin.imag, 0.0]),
            centre=centre,
            alpha=zero,
            kinetic=mass * speed**2 / 2,
        )


@dataclass(frozen=True)
class Stroke(Tow):
    """A rigid body back and forth at constant speed: from the middle to amplitude (m),
    then to -amplitude, and so on.

    Examples
    --------
    >>> from rft.grains import Stroke
    >>> Stroke(speed=0.25, amplitude=0.125).path(0.75)  # on its way back
    (0.0625, -0.25)
    """

    amplitude: Annotated[float, Number(1e-9, 1e3, "m", "")] = 0.02

    def identity(self) -> tuple:
        return (*super().identity(), self.amplitude)

    def path(self, t: float) -> tuple[float, float]:
        a = self.amplitude
        q = (self.speed * t + a) % (4 * a)
        if q < 2 * a:
            return q - a, self.speed
        return 3 * a - q, -self.speed


@dataclass(frozen=True, eq=False)
class Swim:
    """A body free in the plane with prescribed joint angles, at a constant height.

    shape: function of the phase (rad) that returns joint angles (joints,), rad, of
    period 2 pi. rate: its derivative. frequency (Hz). ramp (s): the shape grows
    smoothly from the straight body during it. phase (rad): at t = 0.

    Momentum and moment of momentum follow from force and moment of the grains by
    Euler's method, momentum first. The mass of a link is its share of the length.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.grains import Swim
    >>> def shape(t):
    ...     return np.array([np.cos(t), np.sin(t)])
    >>> def rate(t):
    ...     return np.array([-np.sin(t), np.cos(t)])
    >>> circle = Swim(shape, rate, ramp=0.5)
    >>> alpha, alphadot = circle.joint_angles(1.0)  # rad, rad/s
    >>> alpha.round(6), alphadot.round(3)
    (array([ 1., -0.]), array([0.   , 6.283]))
    """

    shape: Callable[[float], np.ndarray]
    rate: Callable[[float], np.ndarray]
    frequency: Annotated[float, Number(1e-9, 1e6, "Hz", "")] = 1.0
    ramp: Annotated[float, Number(1e-9, 1e6, "s", "")] = 0.5
    phase: Annotated[float, Number(-1e6, 1e6, "rad", "")] = 0.0

    def identity(self) -> tuple:
        return (
            type(self).__name__,
            self._shapes().round(12).tolist(),
            self.frequency,
            self.ramp,
            self.phase,
        )

    def _shapes(self) -> np.ndarray:
        """Return the shapes of a cycle (SAMPLES, joints), rad."""
        phases = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        return np.array([self.shape(phase) for phase in phases], float)

    def check(self, body: Spheres) -> None:
        check_numbers(self)
        shapes = self._shapes()
        require(
            shapes.shape[1:] == (body.joints,),
            f"the gait has {shapes.shape[-1]} joint angles, but the body has "
            f"{body.joints} joints",
        )
        body.require_clearance(shapes[::4])

    def joint_angles(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Return joint angles, rad, and their rates, rad/s, at t (s)."""
        w = 2 * np.pi * self.frequency
        q = min(t / self.ramp, 1.0)
        factor = q * q * (3 - 2 * q)
        factor_rate = 6 * q * (1 - q) / self.ramp
        phase = w * t + self.phase
        alpha = np.asarray(self.shape(phase), float)
        slope = np.asarray(self.rate(phase), float)
        return factor * alpha, factor * w * slope + factor_rate * alpha

    # The state: x, y of the centre of mass, heading of the frame, momentum x and y,
    # moment of momentum about the centre.

    def start(self) -> np.ndarray:
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
    ) -> tuple[np.ndarray, BodyState]:
        alpha, alphadot = self.joint_angles(t)
        links = body.links(alpha, alphadot)
        m = mass * body.half_lengths / body.half_lengths.sum()
        # Moments of inertia of thin links about their centres.
        link_inertia = m * body.half_lengths**2 / 3

        # In a frame at rest: motion of the centre of mass, and of the links about it.
        centre = m @ links.centres / mass
        drift = m @ links.velocities / mass
        lever = links.centres - centre
        inner = links.velocities - drift
        inertia = m @ np.abs(lever) ** 2 + link_inertia.sum()
        inner_moment = m @ (lever.conj() * inner).imag + link_inertia @ links.rates

        # In the world: the frame moves so that the momenta are those of the state.
        x, y, theta, p_x, p_y, L = state
        v = complex(p_x, p_y) / mass
        rate = (L - inner_moment) / inertia
        place = complex(x, y) + dt * v
        theta = theta + dt * rate
        turn = np.exp(1j * theta)
        origin = place - turn * centre
        velocity = v - turn * (drift + 1j * rate * centre)

        link_v = v + turn * (inner + 1j * rate * lever)
        link_rates = rate + links.rates
        kinetic = (m @ np.abs(link_v) ** 2 + link_inertia @ link_rates**2) / 2
        new_state = np.array([place.real, place.imag, theta, p_x, p_y, L])
        return new_state, BodyState(
            placement=body.placement(links, origin, theta, velocity, rate, height),
            pose=np.array([origin.real, origin.imag, theta]),
            centre=place,
            alpha=alpha,
            kinetic=float(kinetic),
        )
