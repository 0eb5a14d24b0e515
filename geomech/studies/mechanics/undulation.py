"""Undulatory swimmers: performance of a wave along the body (paper Sec. III B, Fig. 9),
closed cases as checks, and activation of the muscles (Sec. III C, Fig. 10).

Performance and activation are defined for any body and gait."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.gaits import Sine, Wave
from geomech.mathematics.gaits.wound import unwound
from geomech.mathematics.systems.base import body_size, kind_of
from geomech.mathematics.systems.capabilities import Loaded, capability
from geomech.studies.realised import true_shape
from rft.core.checks import real_array
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene

# Share of the body over which speeds of waves are fitted: at its ends the moment
# vanishes.
MIDDLE = (0.1, 0.9)
KINEMATICS = ("sliding", "sideways")


# Performance.


def performance(scene: Scene, amplitudes: ArrayLike) -> dict[str, np.ndarray]:
    """Return the performance of the scene's gait over a cycle, for amplitudes (B,) of
    that gait: A / lambda of a `Sine`, rad of a `Wave`, the factor that scales another.

    Each entry is (B,) but the velocities:

    progress: net distance, body lengths. efficiency: progress over the wavelength.
    Sec. III B and the caption of Fig. 9(c) define it so and show an optimum near the
    animal; here it has none, it grows with the amplitude. arc_efficiency: progress over
    the arc length of a wave, lambda_s, which has one. waves: on the body. wavelength:
    body lengths. relative_curvature: mean |curvature| x lambda_s. cost_of_transport:
    work against the medium over (the whole body's axial drag x distance); the drag is
    the plain medium's, without skin or ends. slip: mean angle between body and
    velocity, rad. velocity: (B, N, 3), body velocity at the scene's N phases, body
    lengths per rad of phase and rad per rad.

    Where the swimmer has a frequency, in the scene's own unit, body lengths or m:
    distance, net, per cycle; speed, per second; speed_body_lengths, body lengths per
    second; velocity_per_second: (B, N, 3), unit/s and rad/s.

    The wavelength of a `Sine`, and of a `Wave` about the straight chain of equal links,
    is known. The waves of any other gait are those of the bends' first harmonic, by a
    straight line through its phase along the body, and the wavelength is the mean
    distance from tail to head over the waves; nan of a single joint. Refusal for a
    system without a body in a medium.

    The elements are chords of the wave: 40 elements per wave cause errors of 2 % at A /
    lambda = 0.2, but above 0.4 they can feign an optimum of efficiency and slip. Use
    `refined` before believing an `optimum`.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> from geomech.studies.mechanics.undulation import performance
    >>> found = performance(load("seven-link-wave"), [0.3, 0.6])
    >>> found["progress"].round(3)  # body lengths per cycle
    array([0.026, 0.136])
    """
    system = loaded(scene, "performance")
    amplitudes = real_array("amplitudes", amplitudes)
    if amplitudes.ndim != 1:
        raise Refusal("amplitudes must be a list of numbers", value=amplitudes.tolist())

    alpha, alphadot = scene.gait.cycle(scene.numerics.phases, amplitudes)
    run = scene.system.run(alpha, alphadot, work=True)
    alpha, alphadot = true_shape(run, alpha, alphadot)
    length = body_size(scene.system)
    progress = np.hypot(run.net[:, 0], run.net[:, 1]) / length
    wave = None
    if run.springs is None:
        wave = _known_wave(scene, amplitudes)
    if wave is None:
        wave = _bending_wave(system, alpha, alphadot)
    energy = 2 * np.pi * run.work.power.mean(-1) / length
    found = {
        "amplitude": amplitudes,
        "progress": progress,
        "waves": wave.waves,
        "wavelength": wave.wavelength,
        "efficiency": progress / wave.wavelength,
        "arc_efficiency": progress * wave.waves,
        "relative_curvature": wave.relative_curvature,
        "cost_of_transport": energy / np.maximum(progress, 1e-300),
        "slip": run.work.slip.mean(-1),
        "velocity": run.xi / np.array([length, length, 1.0]),
    }

    frequency = scene.frequency
    if frequency is not None:
        distance = progress * length
        found["distance"] = distance
        found["speed"] = distance * frequency
        found["speed_body_lengths"] = progress * frequency
        found["velocity_per_second"] = run.xi * (2 * np.pi * frequency)
    return found


class BodyWave(NamedTuple):
    """A wave along the body, for amplitudes (B,). waves: their number on the body.
    wavelength: body lengths. relative_curvature: mean |curvature| times the arc length
    of a wave."""

    waves: np.ndarray
    wavelength: np.ndarray
    relative_curvature: np.ndarray


def _known_wave(scene: Scene, amplitudes: np.ndarray) -> BodyWave | None:
    """Return the wave of a gait whose wavelength is known: a `Sine`, or a `Wave` about
    the straight chain of equal links. None for other gaits and bodies."""
    gait = unwound(scene.gait)
    if isinstance(gait, Wave):
        body = getattr(scene.system, "body", None)
        equal_links = len({*getattr(body, "lengths", ())}) == 1 and body.modes is None
        straight = gait.offset == 0 and not any(gait.centre)
        if not (equal_links and straight and gait.waves != 0):
            return None
    elif not isinstance(gait, Sine):
        return None
    waves = np.full(amplitudes.shape, abs(gait.waves))
    wavelength = gait.wavelength(amplitudes)
    return BodyWave(waves, wavelength, gait.relative_curvature(amplitudes))


def _bending_wave(system: Loaded, alpha: np.ndarray, alphadot: np.ndarray) -> BodyWave:
    """Return the wave of the bends' first harmonic, of gaits (B, N, d)."""
    s, bend, _, chord = bends(system, alpha, alphadot)
    harmonics = np.fft.fft(bend, axis=-2)[:, 1]
    slopes = []
    for harmonic in harmonics:
        slope = np.nan
        if harmonic.any():
            slope = _slope(s, np.unwrap(np.angle(harmonic)))
        slopes.append(slope)
    waves = np.abs(np.array(slopes)) / (2 * np.pi)
    total_bend = np.abs(bend).mean((-2, -1)) * (len(s) + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return BodyWave(waves, chord.mean(-1) / waves, total_bend / waves)


class Bends(NamedTuple):
    """Bends of a body of n elements at N phases.

    s: (n - 1,), points between the elements, tail 0 to head 1. bend, rate:
    (..., N, n - 1), rad and rad per rad of phase, positive to the left. chord:
    (..., N), distance from tail to head, body lengths."""

    s: np.ndarray
    bend: np.ndarray
    rate: np.ndarray
    chord: np.ndarray


def bends(system: Loaded, alpha: np.ndarray, alphadot: np.ndarray) -> Bends:
    """Return the bends of a body at shapes and rates (..., N, d) of its own shape
    variables."""
    batch = alpha.shape[:-1]
    joints = alpha.shape[-1]
    elements = system.elements(alpha.reshape(-1, joints), alphadot.reshape(-1, joints))
    heading = elements.c + 1j * elements.s
    rotation = elements.v_w / elements.half
    length = 2 * elements.half

    bend = np.angle(heading[1:] * heading[:-1].conj()).T.reshape(*batch, -1)
    rate = np.diff(rotation, axis=0).T.reshape(*batch, -1)
    chord = np.abs((length * heading).sum(0)).reshape(batch)
    s = np.cumsum(length[:, 0])[:-1]
    return Bends(s, np.unwrap(bend, axis=-2), rate, chord)


def loaded(scene: Any, subject: str) -> Loaded:
    """Return the scene's system as a body under forces; Refusal of ``subject`` for a
    system that is none."""
    system = getattr(scene, "system", None)
    body = None
    if system is not None:
        body = capability(system, Loaded)
    if body is None:
        given = scene if system is None else system
        what = f"{subject} needs a body in a medium, got a {kind_of(given)}"
        if hasattr(getattr(given, "body", None), "leg_points"):
            what = f"{subject} is computed of bodies without legs"
        raise Refusal(what)
    return body


# Endless waves: closed cases.


def endless_efficiency(
    medium: Any, headings: np.ndarray, cap: Any = None, kinematics: str = "sliding"
) -> float:
    """Return the efficiency, progress over wavelength, of an endless wave by the
    balance of force along it alone: no yaw.

    headings: (N,) of pieces of equal arc length over one wave, rad. cap: an
    `rft.EndCaps` whose ends' drag, averaged over the cycle, joins the balance of a body
    of these headings. kinematics: velocity of the points of the body in a frame that
    moves with the swimmer, where the wave passes backwards at the mean cosine of the
    headings:

    sliding   an inextensible body that slides along its own curve at speed 1, as in a
              tube; the animal's, and `Sine`'s
    sideways  points that move across the direction of motion only, at the curve's slope
              times the speed of the wave: the textbook model of small waves, in which a
              body of finite waves is stretched and compressed

    Refusal for other kinematics.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.studies.mechanics.undulation import endless_efficiency
    >>> from rft import Viscous
    >>> s = np.arange(200) / 200
    >>> round(endless_efficiency(Viscous(2.0), 0.8 * np.cos(2 * np.pi * s)), 3)
    0.214
    """
    from scipy.optimize import brentq

    if kinematics not in KINEMATICS:
        raise Refusal(
            f"kinematics must be one of {', '.join(KINEMATICS)}", value=kinematics
        )
    sliding = kinematics == "sliding"
    c = np.cos(headings)
    s = np.sin(headings)
    wave_speed = c.mean()
    # Share of the cycle that an end of the body spends at each heading.
    share_of_end = 1.0 if sliding else c / wave_speed

    def forward_force(efficiency):
        if sliding:
            v_x = c - (1 - efficiency) * wave_speed
            v_y = s
        else:
            v_x = efficiency * wave_speed
            v_y = wave_speed * s / c
        v_t = v_x * c + v_y * s
        v_n = v_y * c - v_x * s
        f_t, f_n = medium.traction(v_t, v_n, 1e-12)
        if cap is not None:
            end_t, end_n = cap.traction(medium, v_t, v_n, 1e-12)
            f_t = f_t + share_of_end * end_t
            f_n = f_n + share_of_end * end_n
        return np.mean(f_t * c - f_n * s)

    return float(brentq(forward_force, -1.0, 1.0, xtol=1e-14))


def endless_sine(
    medium: Any,
    amplitude: float,
    cap: Any = None,
    elements: int = 2000,
    kinematics: str = "sliding",
) -> float:
    """Return `endless_efficiency` of a sine of this A / lambda, with one wave on the
    body where ends count. Sliding, it is the endless limit of the gait `Sine`.

    Progress over the wavelength has no optimum in either kinematics. Progress over the
    arc length of a wave, this times `Sine.wavelength`, is largest at A / lambda = 0.211
    (0.530) in loose glass and 0.243 (0.476) in close; sideways at 0.212 (0.515) and
    0.245 (0.460).

    Examples
    --------
    >>> from geomech.studies.mechanics.undulation import endless_sine
    >>> from rft import Granular
    >>> round(endless_sine(Granular(1.8, 0.24), 0.2), 3)  # progress over wavelength
    0.7
    """
    gait = Sine(amplitude=amplitude, waves=1.0, elements=elements)
    return endless_efficiency(medium, gait.headings(0.0), cap, kinematics)


# Optima and their accuracy.


def optimum(
    x: ArrayLike, values: ArrayLike, sign: int = 1
) -> tuple[float, float] | None:
    """Return the place and height of the largest (sign 1) or least (-1) of positive
    values (B,) at x (B,).

    Both are those of the parabola through the logarithms of that value and its
    neighbours. None if it is the first or the last of the values: the optimum lies
    outside the range, or there is none.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.studies.mechanics.undulation import optimum
    >>> x = np.linspace(0, 2, 9)
    >>> [round(v, 3) for v in optimum(x, np.exp(-((x - 0.9) ** 2)))]
    [0.9, 1.0]
    """
    x = np.asarray(x, float)
    heights = sign * np.log(values)
    k = int(np.argmax(heights))
    if k in (0, len(x) - 1):
        return None
    near = slice(k - 1, k + 2)
    a, b, c = np.polyfit(x[near] - x[k], heights[near], 2)
    place = x[k] - b / (2 * a)
    height = np.exp(sign * (c - b * b / (4 * a)))
    return float(place), float(height)


def refined(scene: Scene, finer: int) -> Scene:
    """Return the scene of a sine wave with ``finer`` times the elements, of the body
    and of its wave. Refusal for other gaits.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> from geomech.studies.mechanics.undulation import refined
    >>> refined(load("sandfish-loose"), 2).system.body.elements
    200
    """
    gait = unwound(getattr(scene, "gait", scene))
    if not isinstance(gait, Sine):
        kind = type(gait).__name__.lower()
        raise Refusal(
            f"refined needs a sine wave, got a {kind}",
            instead="give a scene with a sine wave",
        )
    elements = finer * gait.elements
    body = dataclasses.replace(scene.system.body, elements=elements)
    return scene.changed(body=body, gait=dataclasses.replace(gait, elements=elements))


# Activation.


def activation(scene: Scene) -> dict[str, np.ndarray | float]:
    """Return when the muscles of the right side work, over a cycle of the scene's gait,
    of amplitude other than 0.

    The internal moment against the medium is taken for the moment of the muscles, and
    its sign for the side that works: negative, the right (paper Sec. III C, Fig. 10;
    the left works for the other half of the cycle). At the S points between elements,
    or links, and the scene's N phases, angles of phase in rad:

    s: (S,), tail 0 to head 1. t: (N,). moment: (N, S), axial drag x length. bend,
    bend_rate: (N, S), rad and rad per rad of phase, positive to the left. onset,
    offset: (S,), the moment's falls and rises through zero, interpolated between
    phases; continuous along the body, at its middle onset lies from 0 to 2 pi and
    offset after it; nan where the moment changes sign other than twice a cycle, so that
    onset is not unique. changes: (S,), number of changes of sign. lag: (S,), phase by
    which the curvature's zeros come after the moment's: positive where activation is
    ahead of bending, pi / 2 where the side that works is the one that shortens, 0 where
    it is the one that is short. fundamental_lag: (S,), the lag between the two waves'
    first harmonics. speed_ratio, fundamental_speed_ratio: speed of the moment's wave
    over that of the curvature's, from straight lines through onset and offset, or
    through the phase of the first harmonic, over the MIDDLE of the body; nan if there
    is a place without an onset there, or only one joint. Refusal for a system without a
    body in a medium.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> from geomech.studies.mechanics.undulation import activation
    >>> found = activation(load("sandfish-loose"))
    >>> round(float(found["speed_ratio"]), 2)  # of the muscles' wave over the body's
    2.08
    """
    system = loaded(scene, "activation")
    alpha, alphadot = scene.gait.cycle(scene.numerics.phases)
    run = scene.system.run(alpha, alphadot, work=True)
    alpha, alphadot = true_shape(run, alpha, alphadot)
    return activation_of_bends(bends(system, alpha, alphadot), run.work.bending_moment)


def activation_of_bends(
    bent: Bends, moment: np.ndarray
) -> dict[str, np.ndarray | float]:
    """Return `activation` from the bends and the bending moments (N, S) of a cycle."""
    s = bent.s
    bend = bent.bend
    if not bend.any() or not np.ptp(bend, axis=0).any():
        raise Refusal(
            "activation needs a wave of amplitude > 0",
            because="a body at rest needs no muscles",
        )

    falls, rises, changes = _zeros(moment)
    onset = _continuous(falls)
    offset = onset + _continuous(rises - onset)
    falls, rises, _ = _zeros(bend)
    to_right = _continuous(falls)
    to_left = _continuous(rises)
    lag = (
        _continuous(to_right - onset, -np.pi) + _continuous(to_left - offset, -np.pi)
    ) / 2
    moment_slope = _slope(s, onset) + _slope(s, offset)
    bend_slope = _slope(s, to_right) + _slope(s, to_left)

    moment_wave = np.fft.fft(moment, axis=0)[1]
    bend_wave = np.fft.fft(bend, axis=0)[1]
    fundamental_lag = _continuous(np.angle(moment_wave * bend_wave.conj()), -np.pi)
    moment_harmonic_slope = _slope(s, np.unwrap(np.angle(moment_wave)))
    bend_harmonic_slope = _slope(s, np.unwrap(np.angle(bend_wave)))
    return {
        "s": s,
        "t": 2 * np.pi * np.arange(len(bend)) / len(bend),
        "moment": moment,
        "bend": bend,
        "bend_rate": bent.rate,
        "onset": onset,
        "offset": offset,
        "changes": changes,
        "lag": lag,
        "fundamental_lag": fundamental_lag,
        # The speed of a wave is the inverse of the slope of its phase.
        "speed_ratio": _ratio(bend_slope, moment_slope),
        "fundamental_speed_ratio": _ratio(bend_harmonic_slope, moment_harmonic_slope),
    }


def _ratio(a: float, b: float) -> float:
    """Return a / b; nan for b = 0."""
    if b:
        return a / b
    return np.nan


def _zeros(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the phases (rad) at which the columns of x (N, S), equally spaced over a
    cycle, fall and rise through zero, and the number of sign changes: each (S,).

    Phases are interpolated linearly between samples; nan for a column that does not
    fall, or rise, exactly once."""
    following = np.roll(x, -1, 0)
    falls, n_falls = _crossings(x, (x > 0) & (following <= 0))
    rises, n_rises = _crossings(x, (x <= 0) & (following > 0))
    return falls, rises, n_falls + n_rises


def _crossings(
    x: np.ndarray, sign_changes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the phase (S,) at which each column of x (N, S) crosses zero, nan if it
    does not do so exactly once, and the number of times.

    sign_changes: (N, S), whether a column crosses zero before the next sample."""
    columns = np.arange(x.shape[1])
    k = sign_changes.argmax(0)
    count = sign_changes.sum(0)
    before = x[k, columns]
    step = (x - np.roll(x, -1, 0))[k, columns]
    share = before / np.where(step == 0, 1.0, step)
    phase = (k + share) * 2 * np.pi / len(x)
    return np.where(count == 1, phase, np.nan), count


def _continuous(phase: np.ndarray, least: float = 0.0) -> np.ndarray:
    """Return phases (S,) without jumps of 2 pi along the body, at its middle from
    ``least`` to ``least`` + 2 pi; nan stays."""
    found = np.array(phase)
    known = np.flatnonzero(np.isfinite(phase))
    if len(known):
        found[known] = np.unwrap(found[known])
        middle = found[known[np.abs(known - len(found) // 2).argmin()]]
        found -= 2 * np.pi * np.floor((middle - least) / (2 * np.pi))
    return found


def _slope(s: np.ndarray, phase: np.ndarray) -> float:
    """Return the slope of the straight line through phase (S,) at s over the MIDDLE, as
    far as there are joints; nan if some of it is unknown, and of one joint.

    The line is fitted at fixed places, not at the joints, so that it converges with the
    joints at their own order."""
    if len(s) < 2:
        return np.nan
    places = np.linspace(max(MIDDLE[0], s[0]), min(MIDDLE[1], s[-1]), 81)
    line = np.interp(places, s, phase)
    if not np.isfinite(line).all():
        return np.nan
    return float(np.polyfit(places, line, 1)[0])
