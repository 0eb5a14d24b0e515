"""A measured centreline as a gait: curvature or midline points from a CSV file, one
period of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.errors import UnitWarning
from geomech.io.rows import LARGEST_NUMBER
from geomech.mathematics.gaits import frames, midline
from geomech.mathematics.geometry.gait import GAITS, LARGEST, Gait
from rft.core.checks import Number, unmasked
from rft.core.notes import warn
from rft.core.refusal import Refusal

LARGEST_GAP = 0.25  # of the period, between neighbouring frames
UNEQUAL = 0.05  # spread of the frames' spacing over its mean that counts as equal
# Share of the headings' squares that differ, below which the body repeats its motion;
# noise makes less of a difference.
REPEATED = 0.1
N_PHASES = 240  # of the period, at which a repetition is searched
LATEST_REPETITION = 0.75  # of the period: a later one has too few frames to compare
# Times the largest move between neighbouring frames: a last frame that is further from
# the first lies beyond the period.
FAR_FROM_FIRST = 1.5
BACKWARDS = 1.0  # rad of phase along the body: such a wave runs from tail to head
FREQUENCY_TOLERANCE = 0.05  # of a period, between the frequency and the file


@GAITS.register
@dataclass(frozen=True, kw_only=True)
class Centreline(Gait):
    """The bends of a body of ``elements`` as measured, at amplitude 1; the amplitude
    scales them.

    file (-): name of a CSV file, relative to the folder of the scene file, or to the
    current folder if there is none.

    Its header line names the columns; rows may have any order:
      t,s,curvature   curvature in rad per body length at s, 0 at the tail to 1 at the
                      head; every s at every t
      t,point,x,y     points of the midline, numbered from the tail to the head; the
      same
                      points at every t
      t,x,y           points without numbers, in the order of the rows; their number may
                      differ between frames
    t, x and y may be in any unit; # starts a comment, which is a good place for the
    units. `frame` or `phase` may stand for t: it is then no time, and cannot contradict
    a frequency; a time that does is noted. Curvature is positive counter-clockwise and
    y runs upwards: pixels counted downwards give the mirror image. A midline keeps its
    length: each frame is scaled to its own, and its position and direction do not
    matter.

    In time the bends are a periodic cubic spline, of order 4 in the spacing of the
    frames. Along the body they are splines as well, of order 4 in the spacing of s, 3
    in the spacing of points.

    sha256 (-): checksum that the file must have; filled in if left out. centre (rad):
    not allowed, because a measured centreline has no centre.

    The file is read once, when the gait is built.

    Refused as mistakes of the tracking or in the file: neighbouring elements or chords
    that bend by more than pi/2, a frame 20 % longer or shorter than the mean, a quarter
    of the period without a frame, a gait that does not close, or that repeats within
    the period. Noted: a wave that runs from tail to head, as for points that were given
    from the head.

    Examples
    --------
    >>> import numpy as np, pathlib, tempfile
    >>> t, s = np.meshgrid(np.arange(20) / 20, np.linspace(0, 1, 21), indexing="ij")
    >>> curvature = 6 * np.cos(2 * np.pi * (s + t))
    >>> rows = np.column_stack([t.ravel(), s.ravel(), curvature.ravel()])
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "bends.csv"
    >>> np.savetxt(file, rows, delimiter=",", header="t,s,curvature", comments="")
    >>> from geomech.mathematics.gaits import Centreline
    >>> gait = Centreline(str(file), elements=30, period=1.0)
    >>> gait.shape(0.0).shape
    (29,)
    """

    kind = "centreline"
    _curve: ClassVar[Any]  # function of (phases, order), set once the file is read

    estimate_is = (
        "of the computation alone, without the errors of the measured midlines"
    )

    file: str = field(kw_only=False)
    elements: Annotated[
        int,
        Number(3, 2000, "-", "number of elements, the same as in the body", whole=True),
    ] = 100
    period: Annotated[
        float | None,
        Number(
            frames.SMALLEST_NUMBER,
            LARGEST_NUMBER,
            "unit of t",
            "period of the gait. If it is left out, the frames cover one period if "
            "the last repeats the first; otherwise, if they are equally spaced, the "
            "period is their number times their spacing",
        ),
    ] = None
    amplitude: Annotated[
        float,
        Number(-LARGEST, LARGEST, "-", "factor by which the bends are multiplied"),
    ] = 1.0
    keep_harmonics: Annotated[
        int,
        Number(
            0,
            2000,
            "-",
            "number of harmonics in time of a least-squares smoothing; 0 for none",
            whole=True,
        ),
    ] = 0
    keep_modes: Annotated[
        int,
        Number(
            0,
            2000,
            "-",
            "number of Legendre modes of the curvature along the body in that "
            "smoothing; 0 for none",
            whole=True,
        ),
    ] = 0
    sha256: str = ""

    def __post_init__(self):
        if not isinstance(self.file, (str, Path)):
            raise Refusal("file must be the name of a CSV file", value=self.file)
        object.__setattr__(self, "file", str(self.file))
        super().__post_init__()
        if self.centre:
            raise Refusal(
                "a measured centreline takes no centre",
                because="the gait undulates about the straight body",
                instead="leave centre out",
            )
        if not isinstance(self.sha256, str):
            raise Refusal("sha256 must be text", value=self.sha256)
        data = frames.read(self.file)
        if self.sha256.lower() not in ("", data.sha256):
            raise data.wrong(
                "the content of the file does not match sha256",
                instead="restore the file, or leave sha256 out",
            )
        object.__setattr__(self, "sha256", data.sha256)
        bends = midline.bends(data, self.elements, self.keep_modes)
        phase, bends = one_period(data, bends, self.period)
        object.__setattr__(self, "_curve", self._fit(data, phase, bends))
        period = 2 * np.pi * (data.t[1] - data.t[0]) / phase[1]
        _check_once(data, period, phase, bends)
        self._note(data, period, phase, bends)

    @property
    def joints(self) -> int:
        return self.elements - 1

    @property
    def harmonics(self) -> int:  # type: ignore[override]  # a number of most classes
        """The highest harmonic of the series; 1 for a spline, which has no highest."""
        return max(1, self.keep_harmonics)

    def _fit(self, data: frames.Frames, phase: np.ndarray, bends: np.ndarray):
        """Return a function of phases (T...) and an order of derivative, which returns
        the bends (T..., joints)."""
        _check_order(data, bends)
        # With two frames per wave, in the widest gap as well, least squares are well
        # posed.
        widest = np.diff(phase).max()
        most = min((len(bends) - 1) // 2, int(np.pi / widest * (1 + 1e-9)))
        if self.keep_harmonics not in range(most + 1):
            raise data.wrong(
                f"keep_harmonics must be a whole number from 0 to {most} for these"
                f" {len(bends)} frames",
                value=self.keep_harmonics,
            )
        if not self.keep_harmonics:
            return _periodic_spline(phase, bends)
        waves = _waves(phase[:-1], self.keep_harmonics, 0)
        coefficients = np.linalg.lstsq(waves, bends, rcond=None)[0]
        return partial(_series, coefficients)

    def _note(
        self, data: frames.Frames, period: float, phase: np.ndarray, bends: np.ndarray
    ) -> None:
        """Warn of a wave that runs to the head, and of a period that contradicts the
        frequency."""
        if self.frequency and data.timed:
            cycles = period * self.frequency
            if abs(cycles - 1) > FREQUENCY_TOLERANCE:
                warn(
                    f"{data.name}: the period is {period:.4g} in t, but frequency = "
                    f"{self.frequency:g} Hz makes it {1 / self.frequency:.4g} s: "
                    "correct one of them if t is in s; otherwise name the column "
                    "frame or phase",
                    UnitWarning,
                )

        # One or two modes make no travelling wave.
        if self.reverse or self.keep_modes in (1, 2):
            return
        heading = _headings(bends)
        harmonic = np.exp(-1j * phase[:-1]) * np.gradient(phase)[:-1] @ heading
        size = max((np.abs(harmonic) ** 2).mean(), 1e-300)
        lag = np.imag(harmonic[:-1].conj() @ harmonic[1:]) / size  # rad, from the tail
        if lag < -BACKWARDS:
            warn(
                f"{data.name}: the wave runs from the tail to the head, which drives "
                "the body backwards: if the animal swam forwards, give the points "
                "from the tail to the head, with s = 0 at the tail"
            )

    def unit(self, t: ArrayLike) -> np.ndarray:
        return self._curve(unmasked("t", t), 0)

    def unit_rate(self, t: ArrayLike) -> np.ndarray:
        return self._curve(unmasked("t", t), 1)

    @classmethod
    def examples(cls) -> dict[str, Centreline]:
        return {}  # of a file


def _series(coefficients: np.ndarray, t: np.ndarray, order: int) -> np.ndarray:
    """Return the series with coefficients (2 K + 1, joints) at phases t, or a
    derivative."""
    return _waves(t, len(coefficients) // 2, order) @ coefficients


def _periodic_spline(phase: np.ndarray, values: np.ndarray):
    """Return the periodic cubic spline through values (N, ...) at phases (N + 1,)."""
    from scipy.interpolate import CubicSpline

    closed = np.concatenate([values, values[:1]])
    return CubicSpline(phase, closed, bc_type="periodic")


def _waves(t: np.ndarray, harmonics: int, order: int) -> np.ndarray:
    """Return 1, cos t, cos 2t, ..., sin t, sin 2t, ... or, order 1, their derivatives:
    (..., 2 harmonics + 1)."""
    k = np.arange(1, harmonics + 1)
    kt = t[..., None] * k
    constant = np.full((*t.shape, 1), 1.0 - order)
    if order == 0:
        return np.concatenate([constant, np.cos(kt), np.sin(kt)], -1)
    return np.concatenate([constant, -k * np.sin(kt), k * np.cos(kt)], -1)


def one_period(
    data: frames.Frames, bends: np.ndarray, period: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return phases (N + 1,) from 0 to 2 pi and the bends (N, joints) at all but the
    last; Refusal if the frames do not make up one period. A frame that repeats the
    first is left out."""
    t = data.t - data.t[0]
    moves = np.abs(np.diff(bends, axis=0)).max(1)
    closing_gap = np.abs(bends[-1] - bends[0]).max()
    if period is None:
        repeats = closing_gap <= 0.1 * np.median(moves)
        period = t[-1]
        if not repeats:
            period = _period_of_equal_spacing(data, t, moves, closing_gap)
    else:
        repeats = abs(t[-1] - period) <= 1e-6 * period
        if t[-1] > period and not repeats:
            raise data.wrong(
                f"the frames cover {t[-1]:g} in t, more than period = {period:g}",
                instead="keep the frames of one period",
            )
    if repeats:
        t = t[:-1]
        bends = bends[:-1]
    gaps = np.diff(t, append=period) / period
    _check_gaps(data, gaps)

    # Without a repeated frame the first and the last are a gap apart, as neighbours
    # are.
    allowed = moves.max()
    if not repeats:
        allowed = 3 * moves.max() * max(1.0, gaps[-1] / gaps[:-1].max())
    if closing_gap > allowed + 1e-9:
        raise data.wrong(
            "the gait does not close",
            because="the bends of the first and the last frame differ by up to "
            f"{closing_gap:.2g} rad, those of neighbouring frames by up to "
            f"{moves.max():.2g}",
            instead="keep the frames of exactly one period, or correct period",
        )
    return 2 * np.pi * np.append(t / period, 1.0), bends


def _headings(bends: np.ndarray) -> np.ndarray:
    """Return the headings (N, joints + 1) of the elements from bends (N, joints), less
    their mean. Noise is far less in them than in bends."""
    heading = np.cumsum(np.pad(bends, ((0, 0), (1, 0))), 1)
    return heading - heading.mean(1, keepdims=True)


def _check_once(
    data: frames.Frames, period: float, phase: np.ndarray, bends: np.ndarray
) -> None:
    """Refuse a body that repeats its motion within the period."""
    heading = _headings(bends)
    spline = _periodic_spline(phase, heading)
    shape = spline(2 * np.pi * np.arange(N_PHASES) / N_PHASES)
    difference = _differences(shape - shape.mean(0))
    has_differed = np.maximum.accumulate(difference) > 0.5
    repetitions = np.flatnonzero((difference < REPEATED) & has_differed)
    if repetitions.size:
        first = repetitions[0]
        least = first + int((np.diff(difference[first:]) > 0).argmax())
        lag = least / N_PHASES
        raise data.wrong(
            f"the motion repeats after {lag * period:.3g} in t, {1 / lag:.2g} times "
            f"within the period of {period:.4g}",
            instead="give the frames of exactly one period",
        )

    # A frame near the first, followed by others that move away from it again.
    distance = _rms(heading - heading[0])
    moves = _rms(np.diff(heading, axis=0))
    farthest = int(distance.argmax())
    closest = farthest + int(distance[farthest:].argmin())
    is_close = distance[closest] < 0.5 * distance[-1]
    if is_close and distance[-1] > FAR_FROM_FIRST * moves.max():
        raise data.wrong(
            f"the frame at t = {data.t[closest]:g} repeats the first, and "
            f"{len(distance) - 1 - closest} more frames follow",
            instead="give the frames of exactly one period",
        )


def _differences(shape: np.ndarray) -> np.ndarray:
    """Return the share of the squares of shapes (P, n) that differ after each lag, up
    to LATEST_REPETITION; 0.5 where the body pauses."""
    products = shape @ shape.T
    square = products.diagonal()
    difference = np.full(int(LATEST_REPETITION * N_PHASES), 0.5)
    for k in range(1, len(difference)):
        late = square[k:].mean()
        early = square[:-k].mean()
        if min(late, early) > 0.5 * square.mean():
            difference[k] = 1 - 2 * products.diagonal(k).mean() / (late + early)
    return difference


def _rms(heading: np.ndarray) -> np.ndarray:
    """Return the rms (N,) of headings (N, n) along the body."""
    return np.sqrt((heading**2).mean(1))


def _period_of_equal_spacing(data: frames.Frames, t, moves, closing_gap) -> float:
    """Return the period of equally spaced frames of which the last is one spacing
    before the first repeats."""
    if np.ptp(np.diff(t)) > UNEQUAL * t[-1] / (len(t) - 1):
        raise data.wrong(
            "the last frame does not repeat the first, and the frames are not equally "
            "spaced in t",
            instead="give period",
        )
    if closing_gap < moves.min() / 3:
        raise data.wrong(
            "the last frame almost repeats the first (bends differ by up to "
            f"{closing_gap:.2g} rad, those of neighbouring frames by "
            f"{moves.min():.2g} or more)",
            instead="give period",
        )
    return t[-1] * len(t) / (len(t) - 1)


def _check_order(data: frames.Frames, bends: np.ndarray) -> None:
    """Refuse a frame whose points run from the head to the tail: it has the bends of
    its neighbours in reverse, with the other sign."""
    between = (np.roll(bends, 1, 0) + np.roll(bends, -1, 0)) / 2
    distance = np.abs(bends - between).max(1)
    reversed_distance = np.abs(-bends[:, ::-1] - between).max(1)
    bad = np.flatnonzero(3 * reversed_distance < distance)
    if bad.size:
        raise data.wrong(
            f"the frame at t = {data.t[bad[0]]:g} appears to run from head to tail",
            instead="reverse the order of its rows",
        )


def _check_gaps(data: frames.Frames, gaps: np.ndarray) -> None:
    """Refuse frames that are too far apart, or two at almost the same time."""
    widest = int(gaps.argmax())
    least = int(gaps.argmin())
    if gaps[widest] > LARGEST_GAP * (1 + 1e-6):
        raise data.wrong(
            f"after t = {data.t[widest]:g} no frame follows for {gaps[widest]:.3g} of "
            f"the period; the largest allowed gap is {LARGEST_GAP:g}",
            instead="give more frames, or correct period",
        )
    if gaps[least] < 0.01 / len(gaps):
        raise data.wrong(
            f"the frame after t = {data.t[least]:g} follows at almost the same time",
            instead="remove one of the two",
        )
