"""Slips of tracking: frames in another unit, bodies that turn end for end, points that
swap or jump, points out of order."""

from __future__ import annotations

import numpy as np

from geomech.studies.measured.midlines.trial import Trial

OTHER_SCALE = 4.0  # ratio of the size of a frame in another unit to the usual size
REVERSED = 0.4  # of the distance to the frame before, that a reversed frame has
JUMP = 8.0  # times the usual distance of a point from where it is in the frames around
MOVES = 6.0  # times the distance of the frames around from each other
LEAST_JUMP = 0.03  # body lengths
NEAR = 3.5  # usual distances in time, within which frames are compared
KNOWN = 0.6  # of the points that a frame must have
LOST = 0.5  # of the frames, in which a point may be missing
NAMED = 3  # slips that a note names


def checked(trial: Trial, mend: bool) -> Trial:
    """Return the trial without frames of too few points; Refusal, with its place, for
    the first slip. mend: leave out points that jump or swap, and turn frames round, and
    note it."""
    _check_points(trial)
    trial = _without_poor_frames(trial)
    _check_scale(trial)
    _check_order(trial)
    return _without_jumps(_rotated(trial, mend), mend)


def usual_chords(points: np.ndarray) -> np.ndarray:
    """Return the usual distances (P - 1,) between neighbouring points."""
    return _median(np.hypot(*np.moveaxis(np.diff(points, axis=1), -1, 0)), 0)


def _median(values: np.ndarray, axis: int) -> np.ndarray:
    """Return the median of what is not nan; nan, without a warning of NumPy's, where
    there is nothing else."""
    ordered = np.sort(values, axis)  # nan comes last
    known = np.expand_dims((~np.isnan(values)).sum(axis), axis)
    low = np.take_along_axis(ordered, np.maximum(known - 1, 0) // 2, axis)
    high = np.take_along_axis(
        ordered, np.minimum(known // 2, values.shape[axis] - 1), axis
    )
    return ((low + high) / 2).squeeze(axis)


def _check_points(trial: Trial) -> None:
    """Refuse a point that is missing in most frames, or never moves."""
    lost = np.isnan(trial.points[..., 0]).mean(0)
    if lost.max() > LOST:
        k = int(lost.argmax())
        raise trial.wrong(
            f"point {trial.names[k]} is missing in {100 * lost[k]:.3g} % of the frames",
            instead="leave it out with ``columns``, or lower ``least_score``",
        )
    if lost.any():
        return
    ranges = np.nanmax(np.ptp(trial.points, axis=0), -1)
    if ranges.min() == 0:
        raise trial.wrong(
            f"point {trial.names[int(ranges.argmin())]} never moves",
            instead="leave it out with ``columns``",
        )


def _without_poor_frames(trial: Trial) -> Trial:
    """Return the trial without frames of too few points; Refusal for too few others."""
    known = (~np.isnan(trial.points[..., 0])).mean(1)
    poor = known < KNOWN
    if not poor.any():
        return trial
    enough = ~poor
    if enough.sum() < 12:
        raise trial.wrong(
            f"{enough.sum()} frames have most of their points",
            instead="track more points, or lower ``least_score``",
        )
    k = int(np.flatnonzero(poor)[0])
    return trial.with_notes(
        f"{poor.sum()} frames with fewer than {KNOWN:.0%} of the points are left out, "
        f"the first at line {trial.lines[k, 0]}",
        t=trial.t[enough],
        points=trial.points[enough],
        lines=trial.lines[enough],
    )


def _check_scale(trial: Trial) -> None:
    """Refuse frames in another unit than most."""
    chords = np.hypot(*np.moveaxis(np.diff(trial.points, axis=1), -1, 0))
    usual = usual_chords(trial.points)
    if (usual == 0).any():
        k = int(usual.argmin())
        raise trial.wrong(
            f"points {trial.names[k]} and {trial.names[k + 1]} coincide",
            instead="remove one with ``columns``",
        )
    expected = np.where(np.isnan(chords), np.nan, usual)
    size = np.nansum(chords, 1) / np.nansum(expected, 1)
    bad = np.flatnonzero((size > OTHER_SCALE) | (size < 1 / OTHER_SCALE))
    if bad.size:
        k = int(bad[0])
        factor = max(size[k], 1 / size[k])
        like = ""
        if any(abs(factor / x - 1) < 0.3 for x in (10, 100, 1000)):
            like = ": mm for m, or another such unit"
        raise trial.wrong(
            f"the body is {size[k]:.3g} times as long as in most frames{like}",
            k,
            instead="correct or remove that frame",
        )


def _check_order(trial: Trial) -> None:
    """Refuse points that are out of order along the body, as of its left and right
    sides."""
    difference = np.diff(trial.points, axis=1)
    chord = difference[..., 0] + 1j * difference[..., 1]
    forth = _median(np.cos(np.angle(chord[:, 1:]) - np.angle(chord[:, :-1])), 0)
    if forth.min() < -0.5:
        k = int(forth.argmin())
        raise trial.wrong(
            f"the body turns back from {trial.names[k]} by {trial.names[k + 1]} to "
            f"{trial.names[k + 2]} in most frames",
            because=(
                "points are out of order, or lie to the left and right of the midline"
            ),
            instead="give points of the midline in their order, with ``columns``",
        )


def _rotated(trial: Trial, mend: bool) -> Trial:
    """Return the trial with frames turned round that run from the other end, or refuse
    the first."""
    x = trial.points
    distance = np.nanmean(np.hypot(*np.moveaxis(x[1:] - x[:-1], -1, 0)), 1)
    other = np.nanmean(np.hypot(*np.moveaxis(x[1:, ::-1] - x[:-1], -1, 0)), 1)
    is_far = distance > 0.2 * np.nansum(usual_chords(x))
    flips = (other < REVERSED * distance) & is_far
    state = np.concatenate([[False], np.cumsum(flips) % 2 == 1])
    if state.mean() > 0.5:
        state = ~state
    if not state.any():
        return trial
    k = int(np.flatnonzero(state)[0])
    what = f"{state.sum()} frames start at the other end of the body"
    if not mend:
        raise trial.wrong(
            f"{what}, of which this is the first",
            k,
            instead="reverse the order of their points, or add ``mend``",
        )
    points = np.where(state[:, None, None], x[:, ::-1], x)
    return trial.with_notes(
        f"{what} and are reversed, the first at line {trial.lines[k, 0]}",
        points=points,
    )


def _without_jumps(trial: Trial, mend: bool) -> Trial:
    """Return the trial without points that jump away for a frame, or refuse the
    first."""
    x = trial.points
    near = NEAR * np.median(np.diff(trial.t))
    shifts = (-2, -1, 1, 2)
    around = np.stack([np.roll(x, k, 0) for k in shifts])
    for neighbour, k in zip(around, shifts):
        neighbour[np.abs(np.roll(trial.t, k) - trial.t) > near] = np.nan
    expected = _median(around, 0)
    moves = _median(np.hypot(*np.moveaxis(around - expected, -1, 0)), 0)
    distance = np.hypot(*np.moveaxis(x - expected, -1, 0))
    usual = _median(distance, 0)
    least = LEAST_JUMP * np.nansum(usual_chords(x))
    bad = distance > np.maximum(np.maximum(JUMP * usual, least), MOVES * moves)
    if not bad.any():
        return trial
    places = np.argwhere(bad)
    if not mend:
        raise _jump(trial, expected, bad, distance, *map(int, places[0]))
    named = [f"{trial.names[p]} at line {trial.lines[f, p]}" for f, p in places[:NAMED]]
    text = ", ".join(named)
    if len(places) > NAMED:
        text = f"{text} and {len(places) - NAMED} more"
    return trial.with_notes(
        f"{len(places)} points that jump or swap are treated as missing: {text}",
        points=np.where(bad[..., None], np.nan, x),
    )


def _jump(
    trial: Trial,
    expected: np.ndarray,
    bad: np.ndarray,
    distance: np.ndarray,
    frame: int,
    point: int,
):
    """Return the Refusal of a point that jumps, and with which other one it may have
    swapped."""
    x = trial.points[frame]
    others = np.flatnonzero(bad[frame])
    cure = (
        "correct them, leave their cells empty, or add ``mend`` to leave such points "
        "out"
    )
    for other in others[others != point]:
        swapped = (
            np.hypot(*(x[point] - expected[frame, other])),
            np.hypot(*(x[other] - expected[frame, point])),
        )
        if max(swapped) < 0.5 * min(distance[frame, point], distance[frame, other]):
            return trial.wrong(
                f"points {trial.names[point]} and {trial.names[other]} swap",
                frame,
                point,
                instead=cure,
            )
    size = distance[frame, point] / np.nansum(usual_chords(trial.points))
    return trial.wrong(
        f"it jumps by {size:.2g} body lengths from its place in the neighbouring "
        "frames",
        frame,
        point,
        instead=cure,
    )
