"""Screws that rotate in the ground, and craft on two of them: forces in the mean over a
turn, without inertia.

A screw rotates about its axis, x, so that it drives to +x, and moves forwards at (1 -
slip) rate pitch / (2 pi). The law depends on the direction of velocities alone, so all
results hold at any rate, as an advance per turn. A craft moves steadily with one body
velocity, height, pitch and roll, at which the mean force of the grains bears its weight
and their mean moment about its centre of mass is zero. Changes of height and pitch
within a turn are neglected; an engine computes them.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from rft.core.checks import in_range, real_array
from rft.core.metres import GRAVITY
from rft.core.refusal import require
from rft.terradynamics.meshes import Screw, Spatial, wrench
from rft.terradynamics.meshes.motions import rotations
from rft.terradynamics.walking.craft import Screws

TRIANGLES = 2000
ANGLES = 12  # of a turn; 24 change the means by 5e-4
BALANCED = (
    1e-5  # largest residual, of the weight, and of the weight times the screws' length
)
EASY = 0.7  # first guess of the speed, over that without slip
# rad, first guess of the pitch: at 0 upright faces begin to look down all at once, and
# the law jumps
NOSE_UP = -0.03
# first guesses of the height, screw radii above `_Steady.floating`: there the box
# touches down
ABOVE = (0.3, 0.0)
DEEPEST = 20.0  # depth of the axes that is searched, screw radii
# of the interval that holds a slip; half as many of that of a height, a first guess
HALVINGS = 16
STEPS = 30  # of Newton's method
FARTHEST = 0.3  # step of Newton's method, in units of `_Steady`
DIFFERENCE = 1e-3  # for slopes, in the same units


class Turning(NamedTuple):
    """Means over a turn of a screw, (...,) for each slip. thrust, side, lift: N, of the
    grains along x, y, z. torque: N m, of the motor. pitching: N m, moment about y at
    the screw's middle, positive nose down. efficiency: thrust times speed over the
    motor's power, nan for a screw out of the ground.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw, Spatial
    >>> from rft.terradynamics.walking import turning
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> mean = turning(Spatial(xi_n=1e5), screw, height=0.0, slip=[0.2, 0.6], triangles=500)
    >>> mean.thrust.shape, mean.efficiency.shape
    ((2,), (2,))
    """

    slip: np.ndarray
    thrust: np.ndarray
    side: np.ndarray
    lift: np.ndarray
    torque: np.ndarray
    pitching: np.ndarray
    efficiency: np.ndarray


def turning(
    medium: Spatial, screw: Screw, height: float, slip, rate: float = 1.0, triangles: int = TRIANGLES, angles: int = ANGLES
) -> Turning:  # fmt: skip
    """Return the mean forces on a level screw with its axis ``height``, m, above the
    surface. rate: rad/s. slip: (...,), 0 as in a nut, 1 where the screw rotates without
    moving.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw, Spatial
    >>> from rft.terradynamics.walking import turning
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> mean = turning(Spatial(xi_n=1e5), screw, height=0.0, slip=[0.2, 0.6], triangles=500)
    >>> bool(mean.thrust[1] > mean.thrust[0])  # N
    True
    """
    slip = real_array("slip", slip)
    require(bool((np.abs(slip) <= 100).all()), "slip must be within +-100", value=slip)
    in_range("height", height, -10.0, 10.0)
    in_range("rate", rate, 1e-9, 1e4)
    sense = screw.sense
    mesh = screw.mesh(triangles)
    speed = ((1.0 - slip) * rate * screw.pitch / (2 * np.pi))[..., None]
    turns = _turns(angles)
    force, moment, _, _ = wrench(
        medium,
        mesh,
        turns,
        [0.0, 0.0, height],
        speed[..., None] * [1.0, 0.0, 0.0],
        [sense * rate, 0.0, 0.0],
    )
    force = force.mean(-2)
    moment = moment.mean(-2)
    torque = -sense * moment[..., 0]
    power = np.where(torque == 0.0, np.nan, torque * rate)
    return Turning(
        slip,
        *np.moveaxis(force, -1, 0),
        torque,
        moment[..., 1],
        force[..., 0] * speed[..., 0] / power,
    )


def free_turning(
    medium: Spatial,
    screw: Screw,
    height: float,
    triangles: int = TRIANGLES,
    angles: int = ANGLES,
) -> Turning:
    """Return the mean forces of `turning` at the slip without thrust, where nothing
    pulls the screw and it pulls nothing; nan where that slip is beyond 1.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw, Spatial
    >>> from rft.terradynamics.walking import free_turning
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> float(free_turning(Spatial(xi_n=1e5), screw, height=0.0, triangles=500).slip) < 1
    True
    """

    def forces(slip):
        return turning(medium, screw, height, slip, 1.0, triangles, angles)

    low = 0.0
    high = 1.0
    moves = forces(high).thrust > 0.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if forces(middle).thrust > 0.0 else (middle, high)
    return (
        forces((low + high) / 2)
        if moves
        else Turning(*np.full(len(Turning._fields), np.nan))
    )


def _turns(angles: int) -> np.ndarray:
    """Return the rotations (angles, 3, 3) of a turn about x."""
    return rotations(
        np.outer(2 * np.pi * np.arange(angles) / angles, [1.0, 0.0, 0.0])
    ).as_matrix()


class Cruise(NamedTuple):
    """Steady motion of a craft. height: m, of the centre of mass above the surface.
    roll, pitch: rad, about its x and the level y; positive nose down. velocity: (2,),
    m/s, forwards and to its left. yaw_rate: rad/s, to its left. advance: m, path length
    per turn of the screws. slip: 1 - velocity forwards over that in a nut. torque:
    (2,), N m, of the motors, left and right. residual: of the balance, over the weight.
    All others are nan without a balance, as where the craft sinks.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw, Spatial
    >>> from rft.terradynamics.walking import Screws, cruise
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> craft = Screws(1.0, 0.2, 0.16, 0.04, screw, track=0.12, drop=0.055)
    >>> motion = cruise(Spatial(xi_n=1e5), craft, triangles=300)
    >>> motion.velocity.shape, motion.residual < 1e-3
    ((2,), True)
    """

    height: float
    roll: float
    pitch: float
    velocity: np.ndarray
    yaw_rate: float
    advance: float
    slip: float
    torque: np.ndarray
    residual: float


def cruise(
    medium: Spatial,
    craft: Screws,
    frequency: float = 1.0,
    triangles: int = TRIANGLES,
    angles: int = ANGLES,
) -> Cruise:
    """Return the steady motion of a craft on level ground whose screws turn
    ``frequency`` times a second.

    Two equal screws push a craft sideways. It has one balance where it screws forwards
    and drifts a little, and, if it is light, another where it rolls sideways on them;
    the first is tried first.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw, Spatial
    >>> from rft.terradynamics.walking import Screws, cruise
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> craft = Screws(1.0, 0.2, 0.16, 0.04, screw, track=0.12, drop=0.055)
    >>> motion = cruise(Spatial(xi_n=1e5), craft, triangles=300)
    >>> round(motion.advance, 3), round(motion.slip, 2)
    (0.029, 0.52)
    """
    in_range("frequency", frequency, 1e-9, 1e3)
    steady = _Steady(medium, craft, frequency, triangles, angles)
    mirrored = craft.pair == "mirrored"
    free, equations = (
        ([0, 2, 3], [2, 4, 0]) if mirrored else ([*range(6)], [*range(6)])
    )  # the rest is 0 by symmetry
    on_cores = 2 * np.pi * craft.screw.core / craft.screw.pitch

    def full(x):
        q = np.zeros(6)
        q[free] = x
        return q

    floating = steady.floating()
    for sideways, above in itertools.product(
        (0.0,) if mirrored else (0.1, on_cores), ABOVE
    ):
        start = np.array(
            [floating + above, 0.0, NOSE_UP, EASY, -craft.screw.sense * sideways, 0.0]
        )
        x, residual = _solve(lambda x: steady.residual(full(x))[equations], start[free])
        if residual < BALANCED:
            break
    else:
        return Cruise(
            *3 * [np.nan],
            np.full(2, np.nan),
            *3 * [np.nan],
            np.full(2, np.nan),
            residual,
        )
    height, roll, pitch, *velocity, yaw_rate = (
        float(value) for value in full(x) * steady.units
    )
    advance = float(np.hypot(*velocity)) / frequency
    slip = 1.0 - velocity[0] / (craft.screw.pitch * frequency)
    return Cruise(
        height,
        roll,
        pitch,
        np.array(velocity),
        yaw_rate,
        advance,
        slip,
        steady.sums(full(x))[1],
        residual,
    )


class _Steady:
    """A craft that moves steadily at q (6,): height, roll, pitch, velocity forwards and
    to the left, and yaw rate, in ``units``: a screw's radius, radians, the velocity in
    a nut, and that over the screws' length."""

    def __init__(
        self,
        medium: Spatial,
        craft: Screws,
        frequency: float,
        triangles: int,
        angles: int,
    ):
        self.medium = medium
        self.craft = craft
        self.rate = 2 * np.pi * frequency
        nut = craft.screw.pitch * frequency
        self.units = np.array(
            [craft.screw.radius, 1.0, 1.0, nut, nut, nut / craft.screw.length]
        )
        self.weight = craft.mass * GRAVITY
        self.screws = [
            (s.sense, s.mesh(triangles), np.array(place)) for s, place in craft.screws
        ]
        self.turns = _turns(angles)
        self.hull = craft.hull(6)

    def sums(self, q) -> tuple[np.ndarray, np.ndarray]:
        """Return force and moment of the grains about the centre of mass (6,), and the
        motors' torques (2,), in the mean over a turn."""
        height, roll, pitch, *velocity, yaw_rate = q * self.units
        body = (
            rotations([0.0, pitch, 0.0]).as_matrix()
            @ rotations([roll, 0.0, 0.0]).as_matrix()
        )
        velocity = np.array([*velocity, 0.0])
        spin = np.array([0.0, 0.0, yaw_rate])
        torques = []
        on_hull = wrench(
            self.medium, self.hull, body, [0.0, 0.0, height], velocity, spin
        )
        total = np.concatenate([on_hull.force, on_hull.moment])
        for sense, mesh, place in self.screws:
            arm = body @ place
            v = velocity + np.cross(spin, arm)
            relative_spin = sense * self.rate * body[:, 0]
            on_screw = wrench(
                self.medium,
                mesh,
                body @ self.turns,
                [0.0, 0.0, height] + arm,
                v,
                spin + relative_spin,
            )
            force = on_screw.force.mean(0)
            moment = on_screw.moment.mean(0)
            total += [*force, *(moment + np.cross(arm, force))]
            torques.append(-sense * moment @ body[:, 0])
        return total, np.array(torques)

    def residual(self, q) -> np.ndarray:
        """Return the sums with the weight (6,), over the weight, and over the weight
        times the screws' length."""
        arm = self.craft.screw.length
        scaled = self.sums(q)[0] / (
            self.weight * np.array([1.0, 1.0, 1.0, arm, arm, arm])
        )
        return scaled - np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])

    def floating(self) -> float:
        """Return the height, screw radii, at which the grains bear the craft at an easy
        speed, or the deepest one searched."""
        axes = self.craft.drop / self.units[0]
        low = axes - DEEPEST
        high = axes + 1.0
        for _ in range(HALVINGS // 2):
            middle = (low + high) / 2
            bears = (
                self.residual(np.array([middle, 0.0, NOSE_UP, EASY, 0.0, 0.0]))[2]
                >= 0.0
            )
            low, high = (middle, high) if bears else (low, middle)
        return (low + high) / 2


def _solve(function, x: np.ndarray) -> tuple[np.ndarray, float]:
    """Return a zero of a function and the residual there, by Newton's method with
    differences and shortened steps."""
    f = function(x)
    for _ in range(STEPS):
        if np.abs(f).max() < BALANCED:
            break
        slopes = np.stack(
            [(function(x + h) - f) / DIFFERENCE for h in DIFFERENCE * np.eye(len(x))],
            -1,
        )
        step = -np.linalg.lstsq(slopes, f, rcond=None)[0]
        step *= min(1.0, FARTHEST / max(np.abs(step).max(), 1e-300))
        for _ in range(6):
            new = function(x + step)
            if np.linalg.norm(new) < np.linalg.norm(f):
                break
            step = step / 2
        else:
            break
        x = x + step
        f = new
    return x, float(np.abs(f).max())
