"""Kinematics of the cycles of smooth midlines: one row of numbers for each cycle.

The body frame is that of swimmers: the mean of the body's points and its mean
heading."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from geomech.studies.measured.midlines.smooth import NODES, Curve, placed

PHASES = 48  # of a cycle
PLACES = 12  # along the MIDDLE of the body, whose headings make the phase
QUANTITIES = (
    "frequency",
    "body_length",
    "speed",
    "stride",
    "heading",
    "drift",
    "turn",
    "slip",
    "efficiency",
    "amplitude",
    "wavelength",
    "arc_wavelength",
)
PARTS = (
    10  # of the body, from tail to head, for each of which there are slip and amplitude
)
WAVES = np.arange(0.3, 8.001, 0.05)  # wave numbers that are tried, per body
# Of the body, where wave and phase are found: slopes at its ends have most noise.
MIDDLE = (0.1, 0.9)
# Second over first principal size of the headings, below which a wave stands.
STANDING = 0.15


@dataclass(frozen=True, eq=False)
class Clock:
    """Phase of a body: where its headings lie in the plane of their two largest
    principal components.

    mean: (PLACES,). plane: (PLACES, 2), scaled so that the cycle is about a circle.
    standing: there is but one."""

    mean: np.ndarray
    plane: np.ndarray
    t: np.ndarray
    ratio: float

    def phase(self, curve: Curve, near: np.ndarray | None = None) -> np.ndarray:
        """Return the phase (T,) of a curve at the times t, rad. near: another phase,
        less than half a turn away."""
        z = (relative_headings(curve, self.t) - self.mean) @ self.plane @ [1.0, 1j]
        if near is None:
            return np.unwrap(np.angle(z))
        return near + np.angle(z * np.exp(-1j * near))

    def frame_phases(self, curve: Curve) -> np.ndarray:
        """Return the phase (F,) of a curve at the frames, rad, which grows."""
        phase = np.maximum.accumulate(self.phase(curve))
        return np.interp(curve.t, self.t, phase)


def relative_headings(curve: Curve, t: np.ndarray) -> np.ndarray:
    """Return headings (T, PLACES) along the MIDDLE of the body at times t, less their
    mean, rad."""
    first, last = MIDDLE
    places = first + (last - first) * (np.arange(PLACES) + 0.5) / PLACES
    tangent = placed(curve.basis(places, 1), curve.at(t))
    heading = np.unwrap(np.angle(tangent), axis=1)
    return heading - heading.mean(1, keepdims=True)


def clock(curve: Curve, period: float) -> Clock:
    """Return the clock of a curve."""
    cycles = (curve.t[-1] - curve.t[0]) / period
    t = np.linspace(curve.t[0], curve.t[-1], int(np.ceil(cycles * PHASES)) + 1)
    headings = relative_headings(curve, t)
    mean = headings.mean(0)
    scores, sizes, axes = np.linalg.svd(headings - mean, full_matrices=False)
    plane = axes[:2].T / sizes[:2]
    phase = np.unwrap(np.arctan2(*(scores[:, 1::-1].T)))
    if phase[-1] < phase[0]:
        plane[:, 1] *= -1
    return Clock(mean, plane, t, float(sizes[1] / sizes[0]))


def marks(clock: Clock, phase: np.ndarray) -> np.ndarray:
    """Return the phases (C + 1,) that begin and end the full cycles, in the middle of
    the trial."""
    turns = (phase[-1] - phase[0]) / (2 * np.pi)
    count = int(np.floor(turns + 1e-9))
    return phase[0] + np.pi * (turns - count) + 2 * np.pi * np.arange(count + 1)


def times(clock: Clock, phase: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the times (C + 1,) of phases."""
    return np.interp(at, np.maximum.accumulate(phase), clock.t)


@dataclass(frozen=True, eq=False)
class Cycles:
    """Smooth midlines of cycles, at PHASES times each, and at NODES places along the
    body.

    t: (C, PHASES). place, tangent, velocity: (C, PHASES, NODES) complex: x + i y, its
    derivatives by s and by t. starts, ends: (C, 3), poses when they begin and end.
    duration: (C,)."""

    t: np.ndarray
    place: np.ndarray
    tangent: np.ndarray
    velocity: np.ndarray
    starts: np.ndarray
    ends: np.ndarray
    duration: np.ndarray

    def selected(self, numbers: np.ndarray) -> Cycles:
        """Return some of the cycles."""
        return Cycles(**{f.name: getattr(self, f.name)[numbers] for f in fields(self)})

    @property
    def headings(self) -> np.ndarray:
        """Headings (C, PHASES, NODES), rad, continuous."""
        angle = np.unwrap(np.angle(self.tangent), axis=-1)
        mean = angle.mean(-1).ravel()
        turns = np.unwrap(mean) - mean
        return angle + turns.reshape(*angle.shape[:2], 1)


def cycles(curve: Curve, at: np.ndarray) -> Cycles:
    """Return the cycles between the times ``at`` (C + 1,)."""
    t = at[:-1, None] + np.diff(at)[:, None] * (np.arange(PHASES) + 0.5) / PHASES
    z = curve.at(t.ravel())
    rate = curve.at(t.ravel(), 1)
    ends = curve.at(at)
    value = curve.basis(curve.places)
    slope = curve.basis(curve.places, 1)
    poses = _poses(placed(value, ends), placed(slope, ends))
    shape = (*t.shape, len(curve.places))
    return Cycles(
        t=t,
        place=placed(value, z).reshape(shape),
        tangent=placed(slope, z).reshape(shape),
        velocity=placed(value, rate).reshape(shape),
        starts=poses[:-1],
        ends=poses[1:],
        duration=np.diff(at),
    )


def _poses(place: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Return poses (N, 3) of the mean frame."""
    angle = np.unwrap(np.angle(tangent), axis=-1).mean(-1)
    centre = place.mean(-1)
    return np.stack([centre.real, centre.imag, np.unwrap(angle)], -1)


class Averages(NamedTuple):
    """What is averaged over cycles, the first axis of each.

    numbers: (C, 7): time, own length, distance, drift, mean heading of all cycles,
    turn, mean cosine of headings. first: (C, NODES), first harmonic of headings over
    the cycle, complex. slip: (C, NODES), mean over the cycle. width: (C, NODES), range
    across the path."""

    numbers: np.ndarray
    first: np.ndarray
    slip: np.ndarray
    width: np.ndarray

    def weighted(self, weights: np.ndarray) -> Averages:
        """Return averages with weights (R, C)."""
        return Averages(*(np.tensordot(weights, x, 1) for x in self))


def averages(c: Cycles) -> Averages:
    """Return what is averaged, of each cycle."""
    headings = c.headings
    start = c.starts[:, 0] + 1j * c.starts[:, 1]
    change = c.ends - c.starts
    step = change[:, 0] + 1j * change[:, 1]
    turn = change[:, 2]
    axis = headings.mean((1, 2))
    course = axis[:, None] + turn[:, None] * _share()
    relative = headings - course[..., None]
    slip = np.abs(np.angle(c.velocity / c.tangent))
    numbers = (
        c.duration,
        np.abs(c.tangent).mean((1, 2)),
        np.abs(step),
        np.angle(step * np.exp(-1j * axis)),
        np.full_like(axis, axis.mean()),
        turn,
        np.cos(relative).mean((1, 2)),
    )
    path = start[:, None] + step[:, None] * (_share() + 0.5)
    lateral = ((c.place - path[..., None]) * np.exp(-1j * course)[..., None]).imag
    slip = np.minimum(slip, np.pi - slip).mean(1)
    return Averages(
        np.stack(numbers, -1),
        np.exp(-2j * np.pi * _share()) @ relative,
        slip,
        np.ptp(lateral, axis=1),
    )


def quantities(
    a: Averages, length: float | None = None, absolute: bool = True
) -> np.ndarray:
    """Return the numbers of QUANTITIES, then slip and amplitude of PARTS of the body,
    (R, Q), of averages over cycles.

    length: of the body in the trial's unit; if None the midlines'. absolute: speed is
    in that unit, else in body lengths. frequency: 1/time. stride: distance of the mean
    frame per cycle in body lengths. drift: direction of the path less the mean heading
    of the body. heading: direction of the path in the world, drift and mean heading of
    all cycles; wandering of the body between cycles is no error of it. turn: of the
    body in a cycle. slip: mean angle between body and velocity. efficiency: distance
    over wavelength. amplitude: half the range across the path of each cycle, mean over
    the body. wavelength: along the path; arc_wavelength: along the body; body
    lengths."""
    time, own, distance, drift, axis, turn, cosine = a.numbers.T
    body = own
    if length is not None:
        body = np.full_like(own, length)
    speed = distance / time
    if not absolute:
        speed = speed / body
    arc = own * arc_waves(a.first)
    wavelength = arc * cosine
    slip = a.slip.reshape(len(a.slip), PARTS, -1).mean(-1)
    width = a.width.reshape(len(a.width), PARTS, -1).mean(-1)
    amplitude = width / 2 / body[:, None]
    numbers = {
        "frequency": 1 / time,
        "body_length": body,
        "speed": speed,
        "stride": distance / body,
        "heading": axis + drift,
        "drift": drift,
        "turn": turn,
        "slip": slip.mean(-1),
        "efficiency": distance / wavelength,
        "amplitude": amplitude.mean(-1),
        "wavelength": wavelength / body,
        "arc_wavelength": arc / body,
    }
    columns = np.stack([numbers[name] for name in QUANTITIES], -1)
    return np.concatenate([columns, slip, amplitude], -1)


def pseudo_values(
    values: Callable[[np.ndarray], np.ndarray], count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return quantities (Q,) of all cycles, and the pseudo-values (C, Q) of the
    jackknife: C times the quantities of all less C - 1 times those without one cycle.

    For a mean they are its terms; their scatter is the scatter of the quantity. values:
    returns quantities (R, Q) of averages over the cycles with weights (R, C)."""
    if count == 1:
        single = values(np.ones((1, 1)))
        return single[0], single
    equal = np.full((1, count), 1 / count)
    without_one = (1 - np.eye(count)) / (count - 1)
    all_cycles, *others = values(np.vstack([equal, without_one]))
    return all_cycles, count * all_cycles - (count - 1) * np.array(others)


def _share() -> np.ndarray:
    """Return the share (PHASES,) of a cycle at its phases, from its middle."""
    return (np.arange(PHASES) + 0.5) / PHASES - 0.5


def wave_sign(first: np.ndarray) -> int:
    """Return 1 for a wave of headings' first harmonic (NODES,) that runs to the point 0
    of the body, -1 for the opposite direction."""
    inside = first[_middle(len(first))]
    power = (np.abs(_waves(NODES) @ inside) ** 2).sum(-1).max()
    opposite = (np.abs(_waves(NODES) @ inside.conj()) ** 2).sum(-1).max()
    return 1 if power >= opposite else -1


def arc_waves(first: np.ndarray) -> np.ndarray:
    """Return the wavelength (R,) along the body, over the body's length, of the first
    harmonic (R, NODES) of headings.

    In the MIDDLE of the body a + b exp(2 pi i s / wavelength), a wave and a rotation of
    the whole body, is fitted for each of WAVES. The result is the vertex of the
    parabola through the least residual and its neighbours."""
    if wave_sign(first.mean(0)) < 0:
        first = first.conj()
    first = first[:, _middle(first.shape[1])]
    fitted = (np.abs(_waves(NODES) @ first.T) ** 2).sum(1)
    residual = (np.abs(first) ** 2).sum(-1) - fitted
    k = np.clip(residual.argmin(0), 1, len(WAVES) - 2)
    near = residual[k + np.arange(-1, 2)[:, None], np.arange(residual.shape[1])]
    before, least, after = near
    bend = np.maximum(before - 2 * least + after, 1e-300)
    waves = WAVES[k] + 0.5 * (WAVES[1] - WAVES[0]) * (before - after) / bend
    return 1 / np.abs(waves)


def _middle(nodes: int) -> np.ndarray:
    """Return which of the nodes along the body lie in its MIDDLE."""
    s = (np.arange(nodes) + 0.5) / nodes
    return (s > MIDDLE[0]) & (s < MIDDLE[1])


@functools.cache
def _waves(nodes: int) -> np.ndarray:
    """Return orthonormal rows (WAVES, 2, nodes) that project on what `arc_waves`
    fits."""
    s = (np.arange(nodes) + 0.5) / nodes
    wave = np.exp(2j * np.pi * WAVES[:, None] * s)
    columns = np.stack([np.ones_like(wave), wave], -1)
    return np.linalg.qr(columns[:, _middle(nodes)])[0].conj().transpose(0, 2, 1)
