"""Screws that rotate in the ground, and craft on two of them: mean forces over a turn,
without inertia.

A screw rotates about its axis, x, so that it drives to +x, and moves forwards at
(1 - slip) rate pitch / (2 pi). The law depends on the direction of velocities alone, so
all results hold at any rate, as an advance per turn. A craft moves steadily with one
body velocity, height, pitch and roll, at which the mean force of the grains bears its
weight and their mean moment about its centre of mass is zero. Changes of height and
pitch within a turn are neglected; an engine computes them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
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
# Largest residual of a balance, over the weight, and over the weight times the screws'
# length.
BALANCED = 1e-5
FIRST_SPEED = 0.7  # first guess, over the speed without slip
# First guess of the pitch, rad, nose up: at 0 upright faces begin to look down all at
# once, and the law jumps.
FIRST_PITCH = -0.03
# First guesses of the height, screw radii above `_SteadyCraft.floating_height`: there
# the box touches down.
FIRST_HEIGHTS = (0.3, 0.0)
DEEPEST = 20.0  # depth of the axes that is searched, screw radii
# Halvings of the interval that holds a slip; half as many of one that holds a height,
# a first guess.
HALVINGS = 16
MOST_STEPS = 30  # of Newton's method
LONGEST_STEP = 0.3  # of Newton's method, in units of `_SteadyCraft`
MOST_SHORTENINGS = 6  # of a step, each to half of it
NUDGE = 1e-3  # change for differences, in the same units


class Turning(NamedTuple):
    """Means over a turn of a screw, (...,) for each slip.

    thrust, side, lift: N, of the
    grains along x, y, z. torque: N m, of the motor. pitching: N m, moment about y at
    the screw's middle, positive nose down. efficiency: thrust times speed over the
    motor's power, nan for a screw out of the ground.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw, Spatial
    >>> from rft.terradynamics.walking import turning
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> medium = Spatial(xi_n=1e5)
    >>> mean = turning(medium, screw, height=0.0, slip=[0.2, 0.6], triangles=500)
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
    medium: Spatial,
    screw: Screw,
    height: float,
    slip,
    rate: float = 1.0,
    triangles: int = TRIANGLES,
    angles: int = ANGLES,
) -> Turning:
    """Return the mean forces on a level screw with its axis ``height``, m, above the
    surface.

    slip: (...,), 0 as in a nut, 1 where the screw rotates without moving. rate: rad/s.
    triangles: number of them, about. angles: number of angles of a turn.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw, Spatial
    >>> from rft.terradynamics.walking import turning
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> medium = Spatial(xi_n=1e5)
    >>> mean = turning(medium, screw, height=0.0, slip=[0.2, 0.6], triangles=500)
    >>> bool(mean.thrust[1] > mean.thrust[0])  # N
    True
    """
    slip = real_array("slip", slip)
    require(bool((np.abs(slip) <= 100).all()), "slip must be within +-100", value=slip)
    in_range("height", height, -10.0, 10.0)
    in_range("rate", rate, 1e-9, 1e4)

    speed = ((1.0 - slip) * rate * screw.pitch / (2 * np.pi))[..., None]
    on_screw = wrench(
        medium,
        screw.mesh(triangles),
        _turns(angles),
        [0.0, 0.0, height],
        speed[..., None] * [1.0, 0.0, 0.0],
        [screw.sense * rate, 0.0, 0.0],
    )
    force = on_screw.force.mean(-2)
    moment = on_screw.moment.mean(-2)
    thrust, side, lift = np.moveaxis(force, -1, 0)
    torque = -screw.sense * moment[..., 0]
    power = np.where(torque == 0.0, np.nan, torque * rate)
    return Turning(
        slip,
        thrust,
        side,
        lift,
        torque,
        pitching=moment[..., 1],
        efficiency=thrust * speed[..., 0] / power,
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
    >>> mean = free_turning(Spatial(xi_n=1e5), screw, height=0.0, triangles=500)
    >>> float(mean.slip) < 1
    True
    """

    def forces(slip):
        return turning(medium, screw, height, slip, 1.0, triangles, angles)

    low = 0.0
    high = 1.0
    if not forces(high).thrust > 0.0:
        return Turning(*np.full(len(Turning._fields), np.nan))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if forces(middle).thrust > 0.0:
            high = middle
        else:
            low = middle
    return forces((low + high) / 2)


def _turns(angles: int) -> np.ndarray:
    """Return the rotations (angles, 3, 3) of a turn about x."""
    angle = 2 * np.pi * np.arange(angles) / angles
    return rotations(np.outer(angle, [1.0, 0.0, 0.0])).as_matrix()


class Cruise(NamedTuple):
    """Steady motion of a craft.

    height: m, of the centre of mass above the surface. roll, pitch: rad, about its x
    and the level y; positive nose down. velocity: (2,), m/s, forwards and to its left.
    yaw_rate: rad/s, to its left. advance: m, path length per turn of the screws. slip:
    1 - velocity forwards over that in a nut. torque: (2,), N m, of the motors, left and
    right. residual: of the balance, over the weight. All others are nan without a
    balance, for example where the craft sinks.

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
    """Return the steady motion of a craft on level ground whose screws make
    ``frequency`` turns per second.

    Two equal screws push a craft sideways. It has one balance where it screws forwards
    and drifts a little, and, if it is light, another where it rolls sideways on them;
    the search begins near the first.

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
    steady = _SteadyCraft(medium, craft, frequency, triangles, angles)
    q, residual = steady.balance()
    if not residual < BALANCED:
        return _no_cruise(residual)

    height, roll, pitch, v_x, v_y, yaw_rate = (float(x) for x in q * steady.units)
    _, torques = steady.sums(q)
    return Cruise(
        height,
        roll,
        pitch,
        velocity=np.array([v_x, v_y]),
        yaw_rate=yaw_rate,
        advance=float(np.hypot(v_x, v_y)) / frequency,
        slip=1.0 - v_x / (craft.screw.pitch * frequency),
        torque=torques,
        residual=residual,
    )


def _no_cruise(residual: float) -> Cruise:
    """Return the result for a craft without a balance."""
    return Cruise(
        height=np.nan,
        roll=np.nan,
        pitch=np.nan,
        velocity=np.full(2, np.nan),
        yaw_rate=np.nan,
        advance=np.nan,
        slip=np.nan,
        torque=np.full(2, np.nan),
        residual=residual,
    )


class _SteadyCraft:
    """A craft that moves steadily at q (6,): height, roll, pitch, velocity forwards and
    to the left, and yaw rate.

    ``units`` (6,) of q: a screw's radius, radians, the velocity in a nut, and that over
    the screws' length."""

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
            (screw.sense, screw.mesh(triangles), np.array(place))
            for screw, place in craft.screws
        ]
        self.turns = _turns(angles)
        self.hull = craft.hull(6)

    def balance(self) -> tuple[np.ndarray, float]:
        """Return q at which weight and forces are balanced, and the residual there.

        The last q that was tried has a residual of `BALANCED` or more if none is."""
        # Mirrored screws leave roll, velocity to the left and yaw rate at 0.
        is_mirrored = self.craft.pair == "mirrored"
        free = [0, 2, 3] if is_mirrored else [*range(6)]
        equations = [2, 4, 0] if is_mirrored else [*range(6)]

        def full(x):
            q = np.zeros(6)
            q[free] = x
            return q

        def residuals(x):
            return self.residual(full(x))[equations]

        for start in self._starts(is_mirrored):
            x, residual = _solve(residuals, start[free])
            if residual < BALANCED:
                break
        return full(x), residual

    def _starts(self, is_mirrored: bool) -> Iterator[np.ndarray]:
        """Yield first guesses of q: screwing forwards, then, for equal screws, rolling
        sideways on their cores."""
        screw = self.craft.screw
        on_cores = 2 * np.pi * screw.core / screw.pitch
        speeds = (0.0,) if is_mirrored else (0.1, on_cores)
        floating = self.floating_height()
        for sideways, height in itertools.product(speeds, FIRST_HEIGHTS):
            v_y = -screw.sense * sideways
            yield np.array([floating + height, 0.0, FIRST_PITCH, FIRST_SPEED, v_y, 0.0])

    def sums(self, q) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean force and moment over a turn of the grains about the centre
        of mass (6,), and the motors' mean torques (2,)."""
        height, roll, pitch, v_x, v_y, yaw_rate = q * self.units
        about_y = rotations([0.0, pitch, 0.0]).as_matrix()
        about_x = rotations([roll, 0.0, 0.0]).as_matrix()
        body = about_y @ about_x
        velocity = np.array([v_x, v_y, 0.0])
        spin = np.array([0.0, 0.0, yaw_rate])
        centre = [0.0, 0.0, height]
        on_hull = wrench(self.medium, self.hull, body, centre, velocity, spin)
        total = np.concatenate([on_hull.force, on_hull.moment])

        torques = []
        for sense, mesh, place in self.screws:
            arm = body @ place
            own_spin = sense * self.rate * body[:, 0]
            on_screw = wrench(
                self.medium,
                mesh,
                body @ self.turns,
                centre + arm,
                velocity + np.cross(spin, arm),
                spin + own_spin,
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
        sums, _ = self.sums(q)
        scaled = sums / (self.weight * np.array([1.0, 1.0, 1.0, arm, arm, arm]))
        return scaled - np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])

    def floating_height(self) -> float:
        """Return the height, screw radii, at which the grains bear the craft at the
        first guess of the speed, or the deepest one searched."""
        axes = self.craft.drop / self.units[0]
        low = axes - DEEPEST
        high = axes + 1.0
        for _ in range(HALVINGS // 2):
            middle = (low + high) / 2
            q = np.array([middle, 0.0, FIRST_PITCH, FIRST_SPEED, 0.0, 0.0])
            if self.residual(q)[2] >= 0.0:
                low = middle
            else:
                high = middle
        return (low + high) / 2


def _solve(function, x: np.ndarray) -> tuple[np.ndarray, float]:
    """Return a zero of a function and the residual there, by Newton's method with
    differences and shortened steps."""
    f = function(x)
    for _ in range(MOST_STEPS):
        if np.abs(f).max() < BALANCED:
            break
        slopes = _slopes(function, x, f)
        step = -np.linalg.lstsq(slopes, f, rcond=None)[0]
        step *= min(1.0, LONGEST_STEP / max(np.abs(step).max(), 1e-300))
        for _ in range(MOST_SHORTENINGS):
            new = function(x + step)
            if np.linalg.norm(new) < np.linalg.norm(f):
                break
            step = step / 2
        else:
            break
        x = x + step
        f = new
    return x, float(np.abs(f).max())


def _slopes(function, x: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Return the derivatives (m, n) of a function (m,) with the value f at x (n,), by
    differences."""
    columns = [(function(x + h) - f) / NUDGE for h in NUDGE * np.eye(len(x))]
    return np.stack(columns, -1)
