"""Undulatory swimmers: performance of a wave along the body (paper Sec. III B, Fig. 9), closed cases as checks, and
activation of the muscles (Sec. III C, Fig. 10). Performance and activation are those of any body and gait."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geomech.gaits import Sine, Wave
from geomech.systems.base import body_size, kind_of
from geomech.systems.capabilities import Loaded, capability
from rft.core.checks import real_array
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene

MIDDLE = (
    0.1,
    0.9,
)  # share of the body over which speeds of waves are fitted: at its ends the moment vanishes


def performance(scene: Scene, amplitudes: ArrayLike) -> dict[str, np.ndarray]:
    """Return the performance of the scene's gait over a cycle, for amplitudes (B,) of that gait: A / lambda of a `Sine`,
    rad of a `Wave`, whatever scales another. Each entry is (B,) but the velocity:

    progress: net distance, body lengths. efficiency: progress over the wavelength. Sec. III B and the caption of Fig.
    9(c) define it so and show an optimum near the animal; here it has none, it grows with the amplitude.
    arc_efficiency: progress over the arc length of a wave, lambda_s, which has one. waves: on the body. wavelength: body
    lengths. relative_curvature: mean |curvature| x lambda_s. cost_of_transport: work against the medium over (the whole
    body's axial drag x distance), the drag being the plain medium's, without skin or ends. slip: mean angle between body
    and velocity, rad. velocity: (B, N, 3), body velocity at the scene's N phases, body lengths per rad of phase and rad
    per rad. Where the swimmer has a frequency, in the scene's own unit, body lengths or m, besides: distance, net, per
    cycle; speed, per second; speed_body_lengths, body lengths per second; velocity_per_second: (B, N, 3), unit/s and
    rad/s.

    A `Sine`, and a `Wave` about the straight chain of equal links, tell their wavelength. Of any other gait the waves are
    those of the bends' first harmonic, by a straight line through its phase along the body, and the wavelength is the
    mean distance from tail to head over the waves; nan of a single joint. Refusal for a system without a body in a medium.

    The elements are chords of the wave: 40 elements per wave cause errors of 2 % at A / lambda = 0.2, but above 0.4
    enough to feign an optimum of efficiency and slip. Use `refined` before believing an `optimum`.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> from geomech.studies.undulation import performance
    >>> found = performance(load("seven-link-wave"), [0.3, 0.6])
    >>> found["progress"].round(3)  # body lengths per cycle
    array([0.026, 0.136])
    """
    gait, system = getattr(scene, "gait", None), loaded(scene, "performance")
    amplitudes = real_array("amplitudes", amplitudes)
    if amplitudes.ndim != 1:
        raise Refusal("amplitudes must be a list of numbers", value=amplitudes.tolist())
    alpha, alphadot = gait.cycle(scene.numerics.phases, amplitudes)
    run, length = scene.system.run(alpha, alphadot, work=True), body_size(scene.system)
    spent = run.work
    progress = np.hypot(run.net[:, 0], run.net[:, 1]) / length
    wave = _known_wave(scene, amplitudes) or _moving_wave(system, alpha, alphadot)
    energy = 2 * np.pi * spent.power.mean(-1) / length
    timed = {}
    if (frequency := scene.frequency) is not None:
        timed["distance"] = progress * length
        timed["speed"], timed["speed_body_lengths"] = (
            timed["distance"] * frequency,
            progress * frequency,
        )
        timed["velocity_per_second"] = run.xi * (2 * np.pi * frequency)
    return {
        "amplitude": amplitudes,
        "progress": progress,
        "waves": wave.waves,
        "wavelength": wave.wavelength,
        "efficiency": progress / wave.wavelength,
        "arc_efficiency": progress * wave.waves,
        "relative_curvature": wave.relative_curvature,
        "cost_of_transport": energy / np.maximum(progress, 1e-300),
        "slip": spent.slip.mean(-1),
        "velocity": run.xi / np.array([length, length, 1.0]),
        **timed,
    }


class BodyWave(NamedTuple):
    """A wave along the body, for amplitudes (B,). waves: their number on the body. wavelength: body lengths.
    relative_curvature: mean |curvature| times the arc length of a wave."""

    waves: np.ndarray
    wavelength: np.ndarray
    relative_curvature: np.ndarray


def _known_wave(scene: Scene, amplitudes: np.ndarray) -> BodyWave | None:
    """Return the wave of a gait that tells its wavelength; None for other gaits, and for other bodies than the gait's."""
    gait, body = scene.gait, getattr(scene.system, "body", None)
    if isinstance(gait, Wave):
        equal = len({*getattr(body, "lengths", ())}) == 1 and body.modes is None
        known = equal and gait.waves != 0 and gait.offset == 0 and not any(gait.centre)
    else:
        known = isinstance(gait, Sine)
    if not known:
        return None
    waves = np.full(amplitudes.shape, abs(gait.waves))
    return BodyWave(
        waves, gait.wavelength(amplitudes), gait.relative_curvature(amplitudes)
    )


def _moving_wave(system: Loaded, alpha: np.ndarray, alphadot: np.ndarray) -> BodyWave:
    """Return the wave that gaits (B, N, d) send along the body."""
    s, bend, _, chord = bends(system, alpha, alphadot)
    first = np.fft.fft(bend, axis=-2)[:, 1]
    slopes = np.array(
        [_slope(s, np.unwrap(np.angle(x))) if x.any() else np.nan for x in first]
    )
    waves = np.abs(slopes) / (2 * np.pi)
    curved = np.abs(bend).mean((-2, -1)) * (len(s) + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return BodyWave(waves, chord.mean(-1) / waves, curved / waves)


class Bends(NamedTuple):
    """Bends of a body. s: (n - 1,), points between its n elements, tail 0 to head 1. bend, rate: (..., N, n - 1), rad and
    rad per rad of phase, positive to the left. chord: (..., N), distance from tail to head, body lengths."""

    s: np.ndarray
    bend: np.ndarray
    rate: np.ndarray
    chord: np.ndarray


def bends(system: Loaded, alpha: np.ndarray, alphadot: np.ndarray) -> Bends:
    """Return the bends of a body at shapes and rates (..., N, d), whatever its shape variables are."""
    batch = alpha.shape[:-1]
    e = system.elements(*(x.reshape(-1, x.shape[-1]) for x in (alpha, alphadot)))
    heading, rotation = e.c + 1j * e.s, e.v_w / e.half
    bend, rate = np.angle(heading[1:] * heading[:-1].conj()), np.diff(rotation, axis=0)
    bend, rate = (x.T.reshape(*batch, -1) for x in (bend, rate))
    chord = np.abs((2 * e.half * heading).sum(0)).reshape(batch)
    return Bends(
        np.cumsum(2 * e.half[:, 0])[:-1], np.unwrap(bend, axis=-2), rate, chord
    )


def loaded(scene: Any, what: str) -> Loaded:
    """Return the scene's system as a body under forces; Refusal, which names ``what`` cannot be, without one."""
    system = getattr(scene, "system", None)
    if (found := system and capability(system, Loaded)) is None:
        raise Refusal(
            f"{what} is that of a body in a medium, got a {kind_of(scene if system is None else system)}"
        )
    return found


def _sine(scene: Scene, what: str) -> Sine:
    if not isinstance(getattr(scene, "gait", None), Sine):
        raise Refusal(
            f"{what} is that of a sine wave, got a {type(getattr(scene, 'gait', scene)).__name__.lower()}"
        )
    return scene.gait


KINEMATICS = ("sliding", "sideways")


def endless_efficiency(
    medium: Any, headings: np.ndarray, cap: Any = None, kinematics: str = "sliding"
) -> float:
    """Return the efficiency, progress over wavelength, of an endless wave by the balance of force along it alone: no
    yaw.

    headings: (N,) of pieces of equal arc length over one wave, rad. cap: an `rft.EndCaps` whose ends' drag, averaged
    over the cycle, joins the balance of a body of these headings. kinematics, of the points of the body in a frame that
    moves with the swimmer, the wave passing backwards at the mean cosine of the headings:

    sliding   an inextensible body that slides along its own curve at speed 1, as in a tube; the animal's, and `Sine`'s
    sideways  points that move across the direction of motion only, at the curve's slope times the speed of the wave: the
              textbook model of small waves, in which a body of finite waves is stretched and compressed

    Refusal for other kinematics.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.studies.undulation import endless_efficiency
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
    c, s = np.cos(headings), np.sin(headings)
    speed = c.mean()  # of the wave
    passing = (
        1.0 if sliding else c / speed
    )  # share of the cycle that an end of the body spends at each heading

    def along(efficiency):
        v_x, v_y = (
            (c - (1 - efficiency) * speed, s)
            if sliding
            else (efficiency * speed, speed * s / c)
        )
        v_t, v_n = v_x * c + v_y * s, v_y * c - v_x * s
        f_t, f_n = medium.traction(v_t, v_n, 1e-12)
        if cap is not None:
            end_t, end_n = cap.traction(medium, v_t, v_n, 1e-12)
            f_t, f_n = f_t + passing * end_t, f_n + passing * end_n
        return np.mean(f_t * c - f_n * s)

    return float(brentq(along, -1.0, 1.0, xtol=1e-14))


def endless_sine(
    medium: Any,
    amplitude: float,
    cap: Any = None,
    elements: int = 2000,
    kinematics: str = "sliding",
) -> float:
    """Return `endless_efficiency` of a sine of this A / lambda, with one wave on the body where ends count. Sliding, it
    is the endless limit of the gait `Sine`.

    Progress over the wavelength has no optimum in either kinematics. Progress over the arc length of a wave, this times
    `Sine.wavelength`, is largest at A / lambda = 0.211 (0.530) in loose glass and 0.243 (0.476) in close; sideways at
    0.212 (0.515) and 0.245 (0.460).

    Examples
    --------
    >>> from geomech.studies.undulation import endless_sine
    >>> from rft import Granular
    >>> round(endless_sine(Granular(1.8, 0.24), 0.2), 3)  # progress over wavelength
    0.7
    """
    gait = Sine(amplitude=amplitude, waves=1.0, elements=elements)
    return endless_efficiency(medium, gait.headings(0.0), cap, kinematics)


def optimum(
    x: ArrayLike, values: ArrayLike, sign: int = 1
) -> tuple[float, float] | None:
    """Return the place and height of the largest (sign 1) or least (-1) of positive values (B,) at x (B,).

    Both are those of the parabola through the logarithms of that value and its neighbours. None if it is the first or the
    last of the values: the optimum lies outside of the range, or there is none.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.studies.undulation import optimum
    >>> x = np.linspace(0, 2, 9)
    >>> [round(v, 3) for v in optimum(x, np.exp(-((x - 0.9) ** 2)))]
    [0.9, 1.0]
    """
    x, heights = np.asarray(x, float), sign * np.log(values)
    k = int(np.argmax(heights))
    if k in (0, len(x) - 1):
        return None
    near = slice(k - 1, k + 2)
    a, b, c = np.polyfit(x[near] - x[k], heights[near], 2)
    return float(x[k] - b / (2 * a)), float(np.exp(sign * (c - b * b / (4 * a))))


def refined(scene: Scene, finer: int) -> Scene:
    """Return the scene with ``finer`` times its elements, of the body and of its wave.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> from geomech.studies.undulation import refined
    >>> refined(load("sandfish-loose"), 2).system.body.elements
    200
    """
    elements = finer * _sine(scene, "refined").elements
    gait = dataclasses.replace(scene.gait, elements=elements)
    return scene.changed(
        body=dataclasses.replace(scene.system.body, elements=elements), gait=gait
    )


def activation(scene: Scene) -> dict[str, np.ndarray | float]:
    """Return when the muscles of the right side work, over a cycle of the scene's gait, of amplitude other than 0.

    The internal moment against the medium is taken for that of the muscles, and its sign for the side that works:
    negative, the right (paper Sec. III C, Fig. 10; the left works for the other half of the cycle). At the S points
    between elements, or links, and the scene's N phases, angles of phase in rad:

    s: (S,), tail 0 to head 1. t: (N,). moment: (N, S), axial drag x length. bend, bend_rate: (N, S), rad and rad per
    rad of phase, positive to the left. onset, offset: (S,), the moment's falls and rises through zero, interpolated
    between phases; continuous along the body, at its middle onset lies from 0 to 2 pi and offset after it; nan where
    the moment changes sign other than twice a cycle, so that onset is not unique. changes: (S,), number of changes of
    sign. lag: (S,), phase by which the curvature's zeros come after the moment's: positive where activation is ahead of
    bending, pi / 2 where the side that works is the one that shortens, 0 where it is the one that is short.
    fundamental_lag: (S,), the lag between the two waves' first harmonics. speed_ratio, fundamental_speed_ratio: speed
    of the moment's wave over that of the curvature's, from straight lines through onset and offset, or through the
    phase of the first harmonic, over the MIDDLE of the body; nan if there is a place without an onset there, or but one
    joint. Refusal for a system without a body in a medium.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> from geomech.studies.undulation import activation
    >>> round(float(activation(load("sandfish-loose"))["speed_ratio"]), 2)  # of the muscles' wave over the body's
    2.08
    """
    system = loaded(scene, "activation")
    cycle = scene.gait.cycle(scene.numerics.phases)
    return activation_of(
        bends(system, *cycle), scene.system.run(*cycle, work=True).work.bending_moment
    )


def activation_of(bent: Bends, moment: np.ndarray) -> dict[str, np.ndarray | float]:
    """Return `activation` from the bends and the bending moments (N, S) of a cycle."""
    s, bend, rate, _ = bent
    if not bend.any() or not np.ptp(bend, axis=0).any():
        raise Refusal(
            "activation takes a wave of amplitude > 0",
            because="a body at rest needs no muscles",
        )
    onset, offset, changes = _zeros(moment)
    to_right, to_left, _ = _zeros(bend)
    onset, to_right, to_left = (
        _continuous(onset),
        _continuous(to_right),
        _continuous(to_left),
    )
    offset = onset + _continuous(offset - onset)
    waves = [np.fft.fft(x, axis=0)[1] for x in (moment, bend)]
    slopes = [_slope(s, x) for x in (onset, offset, to_right, to_left)]
    harmonics = [_slope(s, np.unwrap(np.angle(x))) for x in waves]
    ratio = lambda a, b: a / b if b else np.nan
    return {
        "s": s,
        "t": 2 * np.pi * np.arange(len(bend)) / len(bend),
        "moment": moment,
        "bend": bend,
        "bend_rate": rate,
        "onset": onset,
        "offset": offset,
        "changes": changes,
        "lag": (
            _continuous(to_right - onset, -np.pi)
            + _continuous(to_left - offset, -np.pi)
        )
        / 2,
        "fundamental_lag": _continuous(np.angle(waves[0] * waves[1].conj()), -np.pi),
        "speed_ratio": ratio(slopes[2] + slopes[3], slopes[0] + slopes[1]),
        "fundamental_speed_ratio": ratio(harmonics[1], harmonics[0]),
    }


def _zeros(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the phases (rad) at which the columns of x (N, S), equally spaced over a cycle, fall and rise through
    zero, and the number of sign changes: each (S,).

    Phases are interpolated linearly between samples; nan for a column that does not fall, or rise, exactly once."""
    after, columns = np.roll(x, -1, 0), np.arange(x.shape[1])
    zeros, changes = [], 0
    for sign_changes in ((x > 0) & (after <= 0), (x <= 0) & (after > 0)):
        k, count = sign_changes.argmax(0), sign_changes.sum(0)
        before, step = x[k, columns], (x - after)[k, columns]
        share = before / np.where(step == 0, 1.0, step)
        zeros.append(np.where(count == 1, (k + share) * 2 * np.pi / len(x), np.nan))
        changes = changes + count
    return *zeros, changes


def _continuous(phase: np.ndarray, least: float = 0.0) -> np.ndarray:
    """Return phases (S,) without jumps of 2 pi along the body, at its middle from ``least`` to ``least`` + 2 pi; nan
    stays."""
    out, known = np.array(phase), np.flatnonzero(np.isfinite(phase))
    if len(known):
        out[known] = np.unwrap(out[known])
        middle = out[known[np.abs(known - len(out) // 2).argmin()]]
        out -= 2 * np.pi * np.floor((middle - least) / (2 * np.pi))
    return out


def _slope(s: np.ndarray, phase: np.ndarray) -> float:
    """Return the slope of the straight line through phase (S,) over the MIDDLE, as far as there are joints; nan if some
    of it is unknown, and of one joint. The line is fitted at fixed places, not at the joints, so that it converges with
    the joints at their own order."""
    if len(s) < 2:
        return np.nan
    places = np.linspace(max(MIDDLE[0], s[0]), min(MIDDLE[1], s[-1]), 81)
    line = np.interp(places, s, phase)
    return float(np.polyfit(places, line, 1)[0]) if np.isfinite(line).all() else np.nan
