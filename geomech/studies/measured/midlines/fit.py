"""From a trial to kinematics with intervals: checks, period, smoothing, head and tail,
cycles."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geomech.core.errors import choose
from geomech.studies.measured import phase
from geomech.studies.measured.midlines import (
    intervals,
    kinematics,
    reader,
    slips,
    smooth,
)
from geomech.studies.measured.midlines.trial import Trial
from rft.core.checks import in_range

GAP = 1 / 8  # of a cycle without a frame, at most
ROWS = 10  # frames per cycle, at least
FEWEST = 3  # cycles that show their scatter
LEAST_AHEAD = 0.4 * np.pi  # rad of phase in half a cycle
LIKE = 0.5  # correlation of a cycle with the mean of all, at least
PACE = 1.6  # ratio of a cycle's duration to the median, at most
EVEN = 0.7  # rad, by which the phase of few cycles may stray from a line
LONGEST = 30.0  # m: longer bodies are in another unit
SHORTEST = 1e-4  # m: shorter bodies are in another unit
LEAST_STRIDE = 0.02  # body lengths per cycle: less does not show where a body goes
# Prior probability that a body keeps its length where its motion varies, assumed.
CONSTANT_LENGTH = 0.6
WHOLE = 0.995  # of the body's length: such points are taken to reach both ends
CRUDE_LENGTH = 0.1  # largest relative error of a length from few modes, assumed
LARGEST_RATIO = 1.4  # of the points' length to a given body length


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Kinematics of a trial.

    trial: points from tail to head. curve, coarse: smooth midlines, and the same with
    fewer modes and knots. clock: phase. marks: phases that begin and end the full
    cycles, of which ``used`` (C,) are without gaps. sample, intervals: of
    `kinematics.QUANTITIES`. level: share of cases in which intervals cover the truth.
    head: how the head was found."""

    trial: Trial
    curve: smooth.Curve
    coarse: smooth.Curve
    clock: kinematics.Clock
    marks: np.ndarray
    used: np.ndarray
    sample: intervals.Sample
    intervals: intervals.Intervals
    level: float
    head: str

    def cycles(
        self, curve: smooth.Curve, near: np.ndarray | None = None
    ) -> kinematics.Cycles:
        """Return the used cycles of a curve. near: as of `kinematics.Clock.phase`."""
        return used_cycles(curve, self.clock, self.marks, self.used, near)

    @property
    def own_length(self) -> float:
        """Length of the piece of the body from its first point to its last, in the
        trial's unit."""
        return float(kinematics.averages(self.cycles(self.curve)).numbers[:, 1].mean())

    def value(self, name: str) -> tuple[float, float]:
        """Return a quantity and half the width of its interval."""
        k = kinematics.QUANTITIES.index(name)
        return float(self.intervals.value[k]), float(self.intervals.half_width[k])


def fit_midlines(
    midlines: str | Path | Trial,
    *,
    columns: Sequence[str] = (),
    units: str | None = None,
    scale: float | None = None,
    fps: float | None = None,
    y: str | None = None,
    head: str | None = None,
    least_score: float | None = None,
    individual: str | None = None,
    body_length: float | None = None,
    mend: bool = False,
    level: float = 0.95,
) -> Kinematics:
    """Return the kinematics of a trial; Refusal, with its place, for data that do not
    give it.

    Parameters
    ----------
    midlines : path or Trial
        CSV file of points along the body (`geomech.studies.measured.midlines.reader`).
    columns : list of names
        Points to take, in their order along the body; by default all.
    units : "m", "cm", "mm", "px" or "BL"
        Unit of x and y, where the header does not say.
    scale : number
        mm per pixel.
    fps : number
        Frames per second, of a file that counts frames.
    y : "up" or "down"
        Sense of y; down, as in images, is taken for pixels.
    head : "first" or "last"
        Which of the points is the head; by default as the motion shows.
    least_score : number
        Points of a lower score are taken for missing; by default of a likelihood below
        0.6, and of no other score.
    individual : name
        The animal to take, of several.
    body_length : number
        In ``units``, where the points do not reach both ends.
    mend : bool
        Leave out points that jump or swap, and turn frames round that run the other
        way; both are noted.
    level : number
        Share of cases in which intervals cover the truth.
    """
    in_range("``level``", level, 0.5, 0.999)
    if head is not None:
        choose("``head``", head, ("first", "last"))
    trial = midlines
    if not isinstance(trial, Trial):
        trial = reader.read(
            midlines,
            points=columns,
            units=units,
            scale=scale,
            fps=fps,
            y=y,
            least_score=least_score,
            individual=individual,
            body_length=body_length,
        )
    trial = smooth.filled(slips.checked(trial, mend))
    # A wrong unit is refused before the smoothing, which takes seconds.
    _check_length(trial, smooth.crude_length(trial), CRUDE_LENGTH)
    repeat = period(trial)
    curve, trial = smooth.fitted(trial, repeat)
    _check_length(trial, _length(curve))
    clock = kinematics.clock(curve, repeat)
    if clock.ratio < kinematics.STANDING:
        raise trial.wrong(
            "the body bends back and forth in one shape",
            because="no wave runs along it",
            instead="give a trial of a body with a travelling wave",
        )
    marks, used = full_cycles(trial, curve, clock)
    turn, words = _head(trial, used_cycles(curve, clock, marks, used), head)
    if turn:
        curve, trial = smooth.fitted(trial.reversed(), repeat)
        clock = kinematics.clock(curve, repeat)
        marks, used = full_cycles(trial, curve, clock)
    trial = trial.with_notes(*_notes(used), *_ends_note(trial, curve))
    coarse = smooth.coarser(trial, curve)
    near = clock.phase(curve)

    def values(curve: smooth.Curve) -> tuple[np.ndarray, np.ndarray]:
        averages = kinematics.averages(used_cycles(curve, clock, marks, used, near))

        def weighted(weights):
            return kinematics.quantities(
                averages.weighted(weights), trial.length, trial.unit == "m"
            )

        return kinematics.pseudo_values(weighted, len(used))

    sample = intervals.sampled(curve, coarse, values, clock.frame_phases(curve))
    constant = np.full(len(sample.value), intervals.CONSTANT)
    constant[kinematics.QUANTITIES.index("body_length")] = CONSTANT_LENGTH
    found = intervals.intervals(sample, level, constant)
    return Kinematics(
        trial, curve, coarse, clock, marks, used, sample, found, level, words
    )


def used_cycles(
    curve, clock: kinematics.Clock, marks, used, near=None
) -> kinematics.Cycles:
    """Return the cycles that have no gap. near: as of `kinematics.Clock.phase`."""
    times = kinematics.times(clock, clock.phase(curve, near), marks)
    return kinematics.cycles(curve, times).selected(used)


def period(trial: Trial) -> float:
    """Return the period of the body's bends; Refusal if they do not repeat, or too few
    frames show them."""
    headings = smooth.crude(trial)
    t = np.linspace(trial.t[0], trial.t[-1], len(trial.t))
    even = np.stack([np.interp(t, trial.t, x) for x in headings.T], -1)
    repeat = phase.period_of(t, even) or _turning(t, even)
    if not repeat:
        raise trial.wrong(
            "the body does not repeat its motion",
            instead="give at least one cycle of one gait, preferably eight",
        )
    rows = repeat / np.median(np.diff(trial.t))
    if rows < ROWS:
        raise trial.wrong(
            f"{rows:.2g} frames per cycle are too few",
            instead=f"give at least {ROWS}, preferably 30",
        )
    return repeat


def _turning(t: np.ndarray, headings: np.ndarray) -> float:
    """Return the period of headings (T, 8) that turn evenly in the plane of their
    principal components; 0 if they do not. It serves trials of less than two cycles."""
    scores = np.linalg.svd(headings - headings.mean(0), full_matrices=False)[0]
    angle = np.unwrap(np.arctan2(scores[:, 1], scores[:, 0]))
    slope, start = np.polyfit(t, angle, 1)
    if np.std(angle - slope * t - start) >= EVEN:
        return 0.0
    return 2 * np.pi / abs(slope)


def _length(curve: smooth.Curve) -> float:
    """Return the mean length of smooth midlines."""
    tangent = smooth.placed(curve.basis(curve.places, 1), curve.at(curve.t))
    return float(np.abs(tangent).mean())


def _check_length(trial: Trial, length: float, error: float = 0.0) -> None:
    """Refuse lengths that no body has, or that contradict each other.

    length: of the points, in the trial's unit. error: its largest relative error."""
    least = (1 - error) * length
    most = (1 + error) * length
    if trial.unit == "m" and not (SHORTEST < most and least < LONGEST):
        raise trial.wrong(
            f"the body is {length:.3g} m long",
            instead="give the unit of x and y with ``units``: mm, cm or px",
        )
    if trial.unit == "BL" and not (1 / LARGEST_RATIO < most and least < LARGEST_RATIO):
        raise trial.wrong(
            f"the body is {length:.3g} body lengths long",
            instead="give the unit of x and y with ``units``",
        )
    if trial.length is not None and least > LARGEST_RATIO * trial.length:
        raise trial.wrong(
            f"the points extend over {length:.3g}, but the body is {trial.length:.3g} "
            "long",
            instead="give ``body_length`` in the unit of x and y, which ``units`` sets",
        )


def full_cycles(
    trial: Trial, curve, clock: kinematics.Clock
) -> tuple[np.ndarray, np.ndarray]:
    """Return the phases that begin and end full cycles, and the numbers of those that
    have no gap and are like the others."""
    phase = clock.phase(curve)
    _check_growing(trial, clock.t, phase)
    marks = kinematics.marks(clock, phase)
    if len(marks) < 2:
        turns = (phase[-1] - phase[0]) / (2 * np.pi)
        raise trial.wrong(
            f"the trial has {turns:.2g} cycles",
            instead="give at least one full cycle, preferably eight",
        )
    times = kinematics.times(clock, phase, marks)
    _check_pace(trial, times)
    spans = itertools.pairwise(times)
    complete = [k for k, span in enumerate(spans) if not _has_gap(trial, *span)]
    used = np.array(complete, int)
    if not used.size:
        gaps = np.diff(trial.t)
        widest = int(gaps.argmax())
        raise trial.wrong(
            f"no frames follow for {gaps[widest]:.3g} after this one, so that "
            "every cycle has a gap",
            widest,
            instead="give a trial with at least one cycle without a gap",
        )
    _check_alike(trial, kinematics.cycles(curve, times).selected(used))
    return marks, used


def _check_growing(trial: Trial, t: np.ndarray, phase: np.ndarray) -> None:
    """Refuse a trial whose phase stands or runs back: over half a cycle it must grow by
    at least a fifth of one."""
    half = kinematics.PHASES // 2
    ahead = phase[half:] - phase[:-half]
    bad = np.flatnonzero(ahead < LEAST_AHEAD)
    if bad.size:
        raise trial.wrong(
            f"the motion pauses or changes after t = {t[bad[0]]:.4g}",
            instead=(
                "cut out pauses, starts and other gaits, and give each gait its own "
                "file"
            ),
        )


def _has_gap(trial: Trial, start: float, end: float) -> bool:
    """Return whether a cycle has a GAP without a frame."""
    inside = trial.t[(trial.t > start) & (trial.t < end)]
    return np.diff(inside, prepend=start, append=end).max() > GAP * (end - start)


def _check_pace(trial: Trial, times: np.ndarray) -> None:
    """Refuse a cycle that takes much longer or shorter than most."""
    duration = np.diff(times)
    ratio = duration / np.median(duration)
    k = int(np.abs(np.log(np.maximum(ratio, 1e-6))).argmax())
    if not 1 / PACE < ratio[k] < PACE:
        raise trial.wrong(
            f"the cycle from t = {times[k]:.4g} to {times[k + 1]:.4g} takes "
            f"{ratio[k]:.2g} times as long as most others",
            instead=(
                "cut out pauses, starts and other gaits, and give each gait its own "
                "file"
            ),
        )


def _check_alike(trial: Trial, cycles: kinematics.Cycles) -> None:
    """Refuse a cycle whose bends have little in common with the mean of all."""
    headings = cycles.headings - cycles.headings.mean(-1, keepdims=True)
    mean = np.median(headings, 0)
    size = np.sqrt((headings**2).sum((1, 2)) * (mean**2).sum())
    correlation = (headings * mean).sum((1, 2)) / size
    k = int(correlation.argmin())
    if correlation[k] < LIKE:
        start, end = cycles.t[k, [0, -1]]
        raise trial.wrong(
            f"the cycle from t = {start:.4g} to {end:.4g} does not repeat the others"
            f" (correlation {correlation[k]:.2g})",
            instead="cut it out, and give each gait its own file",
        )


def _head(
    trial: Trial, cycles: kinematics.Cycles, head: str | None
) -> tuple[bool, str]:
    """Return whether the first point is the head, and how that was found: a body moves
    head first, and the wave that drives it runs to the tail."""
    ends = (trial.names[0], trial.names[-1])
    averages = kinematics.averages(cycles)
    length = averages.numbers[:, 1].mean()
    distance = averages.numbers[:, 2]
    drift = averages.numbers[:, 3]
    forward = (np.cos(drift) * distance).mean() / length
    wave = kinematics.wave_sign(averages.first.mean(0))
    motion = 0
    if abs(forward) > LEAST_STRIDE:
        motion = int(np.sign(forward))
    if head is not None:
        is_first = head == "first"
        words = f"{ends[0] if is_first else ends[1]}, as given"
        moves_to_tail = motion < 0
        if is_first:
            moves_to_tail = motion > 0
        if moves_to_tail:
            words = f"{words}; it moves tail first"
        return is_first, words
    if motion and motion != wave:
        raise trial.wrong(
            f"the body moves towards its {ends[motion > 0]} point, and so does its "
            "wave",
            because="most swimmers move head first against their wave",
            instead="state which end is the head: ``head`` first or last",
        )
    evidence = "the wave travels away from it, and the body hardly moves"
    if motion:
        evidence = "the body moves towards it, against its wave"
    return wave < 0, f"{ends[wave > 0]}, by the motion: {evidence}"


def _ends_note(trial: Trial, curve: smooth.Curve) -> list[str]:
    """Note that a body has ends beyond its points."""
    if trial.length is None:
        return []
    tangent = smooth.placed(curve.basis(curve.places, 1), curve.at(curve.t))
    share = float(np.abs(tangent).mean()) / trial.length
    if share > WHOLE:
        return []
    return [
        f"the points cover {share:.0%} of the body: slip, amplitude, heading and turn "
        "are those of the covered part"
    ]


def _notes(used: np.ndarray) -> list[str]:
    """Return a note on too few cycles."""
    count = len(used)
    if count == 1:
        return [
            "one full cycle does not show how cycles vary: intervals include only the "
            "noise of the tracking"
        ]
    if count < FEWEST:
        return ["two full cycles hardly show how cycles vary"]
    return []
