"""Measured midlines: closed forms, files as trackers write them, slips that are refused, coverage of intervals."""

import contextlib
import dataclasses
import math
import re

import numpy as np
import pytest
from commands import geomech as command
from scipy.interpolate import CubicSpline
from scipy.linalg import null_space
from scipy.special import ellipe
from scipy.stats import multivariate_normal, norm
from tabled import of_json

import geomech
from geomech.core.errors import Note
from geomech.mathematics.gaits import Sine
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.systems.swimmer import MEDIA
from geomech.questions.measured import trials
from geomech.results import show
from geomech.scenes import Numerics, Scene
from geomech.studies.measured.midlines import (
    fit,
    intervals,
    kinematics,
    predicted,
    reader,
    results,
    smooth,
    synthetic,
)
from geomech.studies.measured.midlines.kinematics import QUANTITIES
from geomech.studies.measured.midlines.trial import Trial
from geomech.studies.mechanics.undulation import performance
from rft import Backbone, Viscous
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = Swimmer(MEDIA["glass-0.3mm-loose"], Backbone(40))
USUAL, REPEATING = {"spread": 0.05, "jitter": 0.02}, {"spread": 0.0, "jitter": 0.0}
SLOW = {"spread": 0.05, "jitter": 0.02, "memory": 0.75}  # cycles alike by .68
VARYING = {"spread": 0.1, "jitter": 0.05, "swing": 0.7, "waves": 1.5}


@pytest.fixture(autouse=True)
def fast(request, monkeypatch):
    """Puts noise on a few times, but where intervals are to cover the truth."""
    if "cover" not in request.node.name:
        monkeypatch.setattr(intervals, "RESAMPLED", 6)
        monkeypatch.setattr(predicted, "RESAMPLED", 4)


def trial_of(t, points, name="trial.csv"):
    frames, count = points.shape[:2]
    lines = np.repeat(2 + np.arange(frames)[:, None], count, 1)
    return Trial(name, t, points, tuple(str(k + 1) for k in range(count)), lines, "BL")


@pytest.fixture(scope="module")
def exact():
    """A trial without noise: 3.3 cycles that repeat."""
    return synthetic.synthetic_midlines(
        GLASS, 3.3, 30, 16, noise=0.0, spread=0.0, jitter=0.0, seed=2
    )


@pytest.fixture(scope="module")
def noisy():
    return synthetic.synthetic_midlines(GLASS, 4.4, 30, 30, seed=8)


@pytest.fixture(scope="module")
def fitted(noisy):
    return fit.fit_midlines(noisy.trial())


def along_a_sine(amplitude, waves, cycles=3.0, frames=32, count=24):
    """Points of a body of length 1 that slides along a sine without slip, one wave a cycle, at 0.3 rad to x."""
    slope = 2 * np.pi * amplitude  # of a sine of wavelength 1
    arc = np.sqrt(1 + slope**2) * 4 * ellipe(slope**2 / (1 + slope**2)) / (2 * np.pi)
    wavelength = 1 / (waves * arc)
    x = np.linspace(-3, 9, 60001)
    rise = slope * np.cos(2 * np.pi * x)
    u = np.concatenate(
        [
            [0.0],
            np.cumsum(
                (np.hypot(1, rise)[1:] + np.hypot(1, rise)[:-1]) / 2 * np.diff(x)
            ),
        ]
    )
    t = np.arange(int(cycles * frames) + 1) / frames
    at = CubicSpline(u, x)(arc * (4 + t[:, None] + waves * np.linspace(0, 1, count)))
    z = wavelength * (at + 1j * amplitude * np.sin(2 * np.pi * at)) * np.exp(0.3j)
    return t, np.stack([z.real, z.imag], -1), wavelength


@pytest.mark.parametrize(("amplitude", "waves"), [(0.2, 1.0), (0.1, 1.6)])
def test_a_body_that_slides_along_a_sine_has_the_numbers_of_the_sine(amplitude, waves):
    t, points, wavelength = along_a_sine(amplitude, waves)
    f = fit.fit_midlines(dataclasses.replace(trial_of(t, points), unit="m"))
    expected = {"frequency": 1.0, "body_length": 1.0, "stride": wavelength, "heading": 0.3, "drift": 0.0, "turn": 0.0,
                "efficiency": 1.0, "wavelength": wavelength, "arc_wavelength": 1 / waves,
                "amplitude": amplitude * wavelength}  # fmt: skip
    for name, value in expected.items():
        assert f.value(name)[0] == pytest.approx(
            value, abs=0.012 * max(abs(value), 0.3)
        ), name
    assert f.value("slip")[0] < 0.03


def test_slip_and_efficiency_without_noise_are_those_of_the_balance():
    gait, body = Sine(amplitude=0.2, waves=1.0, elements=60), Backbone(60)
    swimmer = Swimmer(MEDIA["glass-0.3mm-loose"], body)
    known = performance(Scene(swimmer, gait, Numerics(phases=64)), [0.2])
    t = np.arange(97) / 32
    alpha, alphadot = gait.shape(2 * np.pi * t), gait.rate(2 * np.pi * t)
    xi = swimmer.velocity(alpha, alphadot) * 2 * np.pi
    fine = np.linspace(0, t[-1], 2000)
    heading = CubicSpline(t, xi[:, 2]).antiderivative()
    path = CubicSpline(
        fine, np.exp(1j * heading(fine)) * (CubicSpline(t, xi[:, :2])(fine) @ [1.0, 1j])
    ).antiderivative()(t)
    ends = body.points(alpha, np.stack([path.real, path.imag, heading(t)], -1))
    f = fit.fit_midlines(trial_of(t, ends[:, ::3]))
    assert f.value("slip")[0] == pytest.approx(known["slip"][0], rel=0.02)
    assert f.value("efficiency")[0] == pytest.approx(known["efficiency"][0], rel=0.02)
    assert f.value("stride")[0] == pytest.approx(known["progress"][0], rel=0.005)


def test_cycles_that_repeat_without_noise_have_small_errors(exact):
    f, n = fit.fit_midlines(exact.trial()), len(QUANTITIES)
    width, error = (
        f.intervals.half_width[:n],
        (f.intervals.value - noiseless(exact))[:n],
    )
    assert (np.abs(error) <= width + 1e-3).all() and width.max() < 0.04


# Files.


def test_heads_of_files_tell_midlines_from_logs():
    assert reader.is_midlines(("scorer", "a", "b")) and reader.is_midlines(
        ("frame", "x", "y")
    )
    assert not reader.is_midlines(
        ("t", "coords", "alpha_1")
    ) and not reader.is_midlines(("t", "x", "y", "theta"))


def wide(trial, names=None, t="t", unit=""):
    names = names or [f"p{k + 1}" for k in range(trial.points.shape[1])]
    rows = [",".join([t, *(f"{n}_{c}{unit}" for n in names for c in "xy")])]
    return "\n".join(
        rows
        + [
            ",".join(f"{v:.8g}" for v in (x, *p.ravel()))
            for x, p in zip(trial.t, trial.points)
        ]
    )


def deeplabcut(trial, score=0.99):
    """A film of 600 pixels, in which the body is 300 long and y runs down."""
    names = [f"part{k}" for k in range(trial.points.shape[1])]
    heads = {
        "scorer": ["net"] * 3,
        "bodyparts": None,
        "coords": ["x", "y", "likelihood"],
    }
    rows = [
        ",".join([word, *(x for n in names for x in cells or [n] * 3)])
        for word, cells in heads.items()
    ]
    for k, p in enumerate(trial.points):
        cells = [
            f"{v:.8g}" for x, y in p for v in (100 + 300 * x, 700 - 300 * y, score)
        ]
        rows.append(",".join([str(k), *cells]))
    return "\n".join(rows)


def long(trial, order=1):
    rows = [
        f"{t:.8g},{k + 1},{x:.8g},{y:.8g}"
        for t, p in zip(trial.t, trial.points)
        for k, (x, y) in enumerate(p)
    ]
    return "\n".join(["t,point,x_BL,y_BL", *rows[::order]])


def test_every_format_gives_the_same_trial(exact, tmp_path):
    file = tmp_path / "trial.csv"
    scaled = lambda size: dataclasses.replace(exact.trial(), points=exact.points * size)
    forms = (
        (long(exact), {}, 1.0),
        (long(exact, -1), {}, 1.0),
        (wide(exact, unit="_bl"), {}, 1.0),
        (wide(exact).replace("_x", ".x").replace("_y", ".y"), {"units": "BL"}, 1.0),
        (wide(scaled(120), unit="_mm"), {}, 0.12),
        (wide(scaled(12), unit=" (cm)"), {}, 0.12),
        (re.sub(r"p(\d+)_([xy])", r"\2_\1", wide(exact, unit="_bl")), {"y": "up"}, 1.0),
        (
            re.sub("(?m)^([^,]*),[^,]*,", r"\1,", long(exact)).replace("t,", "time,"),
            {},
            1.0,
        ),  # points have no numbers
        (
            re.sub(
                "(?m)^([^,t]+)", lambda t: f"{1e3 * float(t[1]):.9g}", long(exact)
            ).replace("t,", "t_ms,", 1),
            {},
            1.0,
        ),
    )
    for text, options, size in forms:
        file.write_text(text)
        trial = reader.read(file, **options)
        np.testing.assert_allclose(trial.points, exact.points * size, atol=1e-6)
        np.testing.assert_allclose(trial.t, exact.t, atol=1e-6)
        assert trial.unit == ("m" if size < 1 else "BL") and trial.timed
    file.write_text(deeplabcut(exact))
    trial = reader.read(file, fps=30.0, scale=0.4)
    assert trial.names[:2] == ("part0", "part1") and any(
        "y is taken to run down" in x for x in trial.notes
    )
    moved = (trial.points - trial.points[0, 0]) / 0.12
    np.testing.assert_allclose(moved, exact.points - exact.points[0, 0], atol=1e-5)
    file.write_text(deeplabcut(exact, 0.3))
    assert np.isnan(reader.read(file).points).all()
    assert not np.isnan(reader.read(file, least_score=0.2).points).any()


@pytest.mark.parametrize(
    ("old", "new", "names"),
    [
        ("t,point", "s,place", "no column t or frame"),
        ("x_BL,y_BL", "x_mm,y_m", "columns in m and in mm"),
        ("t,point,x_BL,y_BL", "t,s,curvature,y_BL", "centreline"),
        (
            "t,point,x_BL,y_BL\n0,1,",
            "t,point,x_BL,y_BL\n0,1,one",
            "line 2, column x_bl",
        ),
        ("\n0,2,", "\n0,1,", "line 3: point 1 is given twice"),
        ("t,point,x_BL,y_BL", "t,point,x_BL,x_BL", "the column 'x_bl' is there twice"),
        ("t,point", "t_mm,point", "line 1: t_mm is in mm: give t in s or ms"),
        (
            "t,point,x_BL,y_BL\n0,",
            "t,colour,x_BL,y_BL\n0.033333333,",
            "line 3: 15 points at t = 0, and 16 at most others",
        ),
    ],
)
def test_bad_files_are_refused_by_place(exact, tmp_path, old, new, names):
    text = long(exact)
    assert old in text
    (tmp_path / "trial.csv").write_text(text.replace(old, new, 1))
    with pytest.raises(Refusal, match=names):
        reader.read(tmp_path / "trial.csv")


def changed(trial, change):
    points = trial.points.copy()
    change(points)
    return dataclasses.replace(trial, points=points)


def swap(points):
    points[40, [4, 12]] = points[40, [12, 4]]


def turn_round(points):
    for some in (slice(50, 56), slice(70, 74)):
        points[some] = points[some, ::-1]


def jump(points):
    points[30, 7] += 0.3


SLIPS = {
    "points 5 and 13 swap": swap,
    "10 frames run from the other end": turn_round,
    "jumps by 0.[34]": jump,
}


@pytest.mark.parametrize("said", SLIPS)
def test_slips_of_tracking_are_refused_by_place_and_mended_on_request(
    noisy, fitted, said
):
    trial = changed(noisy.trial(), SLIPS[said])
    with pytest.raises(Refusal, match=r"line \d+ .*" + said + ".* mend"):
        fit.slips.checked(trial, False)
    mended = fit.slips.checked(trial, True)
    assert len(mended.notes) == 1 and "line" in mended.notes[0]
    left = smooth.filled(mended).points
    assert np.abs(left - noisy.points).max() < 0.12  # what is filled in lies near


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: changed(t, lambda p: p.__setitem__(30, 1000 * p[30])), "times as long as in most frames: mm for m"),
        (lambda t: dataclasses.replace(t, points=t.points * 120, unit="m"), "the body is 1.. m long"),
        (lambda t: dataclasses.replace(t, length=0.1), "body is 0.1 long"),
        (lambda t: changed(t, lambda p: p.__setitem__((slice(80), 4), np.nan)), "point 5 is missing in"),
        (lambda t: changed(t, lambda p: p.__setitem__((slice(None), [3, 20]), p[:, [20, 3]])), "turns back"),
        (lambda t: dataclasses.replace(t, t=t.t[::4], points=t.points[::4], lines=t.lines[::4]), "frames a cycle"),
        (lambda t: dataclasses.replace(t, t=t.t[:20], points=t.points[:20], lines=t.lines[:20]), "0.8"),
    ],
)  # fmt: skip
def test_trials_that_do_not_tell_are_refused(noisy, change, said):
    with pytest.raises(Refusal, match=said):
        fit.fit_midlines(change(noisy.trial()))


def at(places, value):
    """A change of a trial: its points at some places, (frames, points), have other values."""
    return lambda t: changed(
        t, lambda p: p.__setitem__(places, value(p) if callable(value) else value)
    )


def standing(trial):
    """A body that bends to and fro in one shape."""
    s, bend = np.linspace(-0.5, 0.5, 20), np.sin(2 * np.pi * trial.t)[:, None]
    return trial_of(trial.t, np.stack([s - 0.4 * bend**2 * s**3, bend * s**2], -1))


def without(trial, left_out):
    kept = ~left_out
    return dataclasses.replace(
        trial, t=trial.t[kept], points=trial.points[kept], lines=trial.lines[kept]
    )


def backwards(_):
    """A swimmer that its wave takes along, as where drag is less across the body than along it."""
    return synthetic.synthetic_midlines(
        Swimmer(Viscous(0.4), Backbone(20)), 3.4, 30, 20
    ).trial()


ALSO_REFUSED = {
    "the body bends in one shape to and fro": standing,
    "the body is 2.01 body lengths long": lambda t: dataclasses.replace(t, points=2 * t.points),
    "point 4 never moves": at((slice(None), 3), 0.0),
    "points 4 and 5 are in one place": at((slice(None), 4), lambda p: p[:, 3]),
    "10 frames have most of their points": at(np.indices((133, 30)).sum(0) % 2 * (np.arange(133) > 9)[:, None] > 0, np.nan),
    "line 542 .t = 0.6.: no frames for 0.2 after this one, and so in every cycle":
        lambda t: without(t, (np.arange(len(t.t)) >= 19) & ((np.arange(len(t.t)) - 19) % 30 < 5)),
    "the cycle from t = 1.16 to 3.499 takes 1.7 times as long as most":
        lambda t: dataclasses.replace(t, t=t.t + 2 * np.clip(t.t - 1.5, 0, 1)),
    "the body moves towards its point 1, and so does its wave": backwards,
}  # fmt: skip


@pytest.mark.parametrize("said", ALSO_REFUSED)
def test_trials_of_other_faults_are_refused(noisy, said):
    with pytest.raises(Refusal, match=said):
        fit.fit_midlines(ALSO_REFUSED[said](noisy.trial()), mend=True)


def test_another_motion_within_a_trial_is_refused_by_its_times(noisy, fitted):
    other = synthetic.synthetic_midlines(GLASS, 1.5, 30, waves=2.4, swing=0.5, seed=1)
    shift = noisy.points[-1].mean(0) - other.points[0].mean(0)
    points = np.concatenate([noisy.points, other.points + shift])
    with pytest.raises(
        Refusal, match="the motion stands, or is another one, after t = [45]"
    ):
        fit.fit_midlines(trial_of(np.arange(len(points)) / 30, points), mend=True)
    t = (cycles := fitted.cycles(fitted.curve)).tangent
    mirrored = dataclasses.replace(
        cycles, tangent=np.stack([*t[:2], t[2].conj(), t[3]])
    )
    with pytest.raises(
        Refusal,
        match=r"the cycle from t = 2\.\d+ to 3\.\d+ does not repeat .* \(correlation -0\.9",
    ):
        fit._check_alike(fitted.trial, mirrored)


def test_the_head_is_found_from_the_motion_and_said(exact, noisy, fitted):
    found = fit.fit_midlines(noisy.trial().reversed())
    assert found.head.startswith("30, by the motion") and fitted.head.startswith("30")
    np.testing.assert_allclose(found.sample.value, fitted.sample.value, atol=1e-6)
    assert "tail first" in fit.fit_midlines(exact.trial(), head="first").head
    back = dataclasses.replace(
        exact.trial(), t=exact.t, points=exact.points[::-1]
    )  # a film run backwards
    assert fit.fit_midlines(back).head.startswith("1,")


def test_missing_points_and_gaps_are_bridged_and_said(noisy, fitted):
    points = noisy.points.copy()
    points[np.random.default_rng(0).random(points.shape[:2]) < 0.05] = np.nan
    found = fit.fit_midlines(dataclasses.replace(noisy.trial(), points=points))
    assert (
        np.abs(found.intervals.value - fitted.intervals.value)
        <= fitted.intervals.half_width
    ).all()
    some = np.sort(
        np.random.default_rng(1).choice(len(noisy.t), 100, replace=False)
    )  # uneven in time
    t = noisy.trial()
    found = fit.fit_midlines(
        dataclasses.replace(t, t=t.t[some], points=t.points[some], lines=t.lines[some])
    )
    assert (
        np.abs(found.intervals.value - fitted.intervals.value)
        <= 1.5 * fitted.intervals.half_width
    ).all()
    kept = np.r_[0:50, 62 : len(noisy.t)]
    gap = fit.fit_midlines(
        dataclasses.replace(t, t=t.t[kept], points=t.points[kept], lines=t.lines[kept])
    )
    assert len(gap.used) == len(fitted.used) - 1


def test_five_points_have_modes_enough(noisy, fitted):
    found = fit.fit_midlines(trial_of(noisy.t, noisy.points[:, [0, 7, 15, 22, 29]]))
    assert found.curve.modes == 4
    assert (
        abs(found.value("speed")[0] - fitted.value("speed")[0])
        < found.value("speed")[1]
    )


def test_mirrored_trials_differ_in_the_sign_of_turns_alone(noisy, fitted):
    mirrored = fit.fit_midlines(
        dataclasses.replace(noisy.trial(), points=noisy.points * [1, -1])
    )
    sign = np.array(
        [-1 if name in ("heading", "drift", "turn") else 1 for name in QUANTITIES]
    )
    ours, theirs = (x.intervals.value[: len(QUANTITIES)] for x in (fitted, mirrored))
    assert (
        np.abs(theirs - sign * ours)
        < 0.3 * fitted.intervals.half_width[: len(QUANTITIES)]
    ).all()


def test_two_animals_in_a_file_are_refused_and_tracks_are_no_points(exact, tmp_path):
    file, (head, *rows) = (
        tmp_path / "trial.csv",
        wide(exact, t="frame_idx").splitlines(),
    )
    file.write_text("\n".join(["track," + head, *("a," + row for row in rows)]))
    assert reader.read(file, units="BL", fps=1.0).points.shape == exact.points.shape
    file.write_text(
        "\n".join(
            ["track," + head, *(f"{'ab'[k % 2]}," + row for k, row in enumerate(rows))]
        )
    )
    with pytest.raises(Refusal, match="2 animals are in it: a, b"):
        reader.read(file)
    scorer, *rest = deeplabcut(exact).splitlines()
    names = ["individuals", *["one"] * 24, *["two"] * 24]
    file.write_text("\n".join([scorer, ",".join(names), *rest]))
    with pytest.raises(Refusal, match="2 individuals are in it: one, two"):
        reader.read(file)


# Intervals.


def truth(system, **options):
    """Quantities of an animal: of many cycles without noise."""
    cycles = 8.2 if not options["spread"] else 400
    return noiseless(
        synthetic.synthetic_midlines(system, cycles, seed=99, noise=0.0, **options)
    )


def noiseless(made, modes=14, even=0.0):
    trial = smooth.filled(made._replace(points=made.exact).trial())
    places = np.linspace(0, 1, trial.points.shape[1])
    curve = smooth.curve_of(trial, places, modes, 2, even)
    clock = kinematics.clock(curve, fit.period(trial))
    marks, used = fit.full_cycles(trial, curve, clock)
    each = kinematics.averages(fit.used_cycles(curve, clock, marks, used))
    return kinematics.quantities(each.weighted(np.full((1, len(used)), 1 / len(used))))[
        0
    ]


def covered(system, known, seeds, cycles=8.4, frames=40, **options):
    """Errors and half widths (N, Q) of trials of 30 points with 1 % noise. The heading is that of the trial, to which the
    animal's drift is added."""
    errors, widths, k = [], [], QUANTITIES.index("heading")
    for seed in seeds:
        made = synthetic.synthetic_midlines(
            system, cycles, frames, seed=seed, **options
        )
        f, own, expected = fit.fit_midlines(made.trial()), noiseless(made), known.copy()
        expected[k] = own[k] - own[k + 1] + known[k + 1]
        errors.append(f.intervals.value - expected)
        widths.append(f.intervals.half_width)
    return np.array(errors)[:, : len(QUANTITIES)], np.array(widths)[
        :, : len(QUANTITIES)
    ]


def test_cycles_too_few_to_show_how_they_vary_are_noted():
    one, two, three = (fit._notes(np.zeros(count)) for count in (1, 2, 3))
    assert (
        one[0].startswith("one full cycle")
        and two[0].startswith("two full cycles")
        and three == []
    )


@pytest.mark.parametrize(
    ("variance", "alike", "width"),
    [
        (0.0, 0.0, 1.0),
        (0.3, 0.0, 1.5),
        (3.0, 0.0, 1.87),
        (30.0, 0.3, 1.99),
        (30.0, 0.68, 1.94),
    ],
)
def test_intervals_of_samples_whose_truth_is_zero(variance, alike, width):
    """Noise that ends one cycle too far begins the next too late: it is less in the mean than its scatter says."""
    rng, count, sigma = np.random.default_rng(0), 8, 0.7
    noise = lambda *lead: np.diff(
        sigma * rng.normal(size=(*lead, count + 1, 400)), axis=-2
    )
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    pseudo = (
        np.sqrt(variance)
        * np.linalg.cholesky(alike**apart)
        @ rng.normal(size=(count, 400))
        + noise()
    )
    noisy, none = pseudo + noise(40), np.zeros(400)
    sample = intervals.Sample(
        pseudo.mean(0), pseudo, noisy.mean(1), noisy, none, np.zeros((40, 400))
    )
    found = intervals.intervals(sample, 0.95)
    assert 0.89 < (np.abs(found.value) <= found.half_width).mean() < 0.99
    assert np.median(found.noise) == pytest.approx(sigma * np.sqrt(2) / count, rel=0.05)
    deviation = np.sqrt(2 * sigma**2 / count**2 + variance / count)
    assert np.median(found.half_width) == pytest.approx(
        1.96 * width * deviation, rel=0.05
    )


@pytest.mark.parametrize(("copies", "least", "most"), [(1, 0.0, 0.2), (12, 0.6, 0.8)])
def test_contrasts_that_are_one_thing_seen_often_are_weak_evidence(copies, least, most):
    """Of 84 contrasts a mean square 1.5 times that of noise shows that cycles vary; of 7, twelve times over, it does not."""
    drawn = 2 * np.random.default_rng(0).normal(size=(400, 12 // copies, 7))
    assert (
        least
        < intervals._repeating(
            np.full((12, 7), np.sqrt(1.5)), np.repeat(drawn, copies, 1)
        )
        < most
    )


def test_noise_that_is_alike_from_frame_to_frame_is_found(noisy):
    """Noise of standard deviation 0.01 whose neighbours in time are correlated by 0.6."""
    fresh = np.random.default_rng(0).normal(size=noisy.points.shape)
    noise = 0.01 * smooth._ar1_filtered(fresh, 0.6)
    f = fit.fit_midlines(noisy._replace(points=noisy.exact + noise).trial())
    assert f.curve.alike == pytest.approx(
        0.6, abs=0.03
    ) and f.curve.noise == pytest.approx(0.01, rel=0.03)
    put_on = np.array(
        [
            f.curve.noisy(np.random.default_rng(k)).coefficients - f.curve.coefficients
            for k in range(40)
        ]
    )
    slow = 0.01 * np.sqrt((1 + 0.6) / (1 - 0.6) / len(noisy.t))  # mean over the trial
    assert put_on.mean(1).std() == pytest.approx(slow, rel=0.1)


def test_more_modes_and_knots_are_taken_than_leave_an_error_beside_that_of_noise(
    exact, fitted
):
    found, n = fitted.intervals, len(QUANTITIES)
    assert (found.smoothing < found.noise)[:n].all()
    few = dataclasses.replace(
        exact.trial(), points=exact.points[:, ::3], lines=exact.trial().lines[:, ::3]
    )
    curve, few = smooth.fitted(smooth.filled(few), 1.0)
    assert (curve.modes, smooth.coarser(few, curve).modes) == (5, 4)


def test_bodies_are_taken_to_keep_their_length(fitted):
    alike = (
        intervals.intervals(fitted.sample, 0.95).half_width
        / fitted.intervals.half_width
    )
    assert (
        alike[1] > 1.02
        and (np.abs(np.delete(alike, 1) - 1) < 0.01).all()
        and QUANTITIES[1] == "body_length"
    )


def test_what_smoothing_cuts_off_is_judged_from_its_change():
    """A change of 0.7 that noise of 0.1 explains in small part, where 3 modes more leave a seventh."""
    rng, one = np.random.default_rng(0), np.ones((1, 50))
    noise = 0.1 * rng.normal(size=(4000, 50))
    sample = intervals.Sample(
        one[0], one, 1 + noise, (1 + noise)[:, None], 0.7 * one[0], 0.7 + noise
    )
    found = intervals.intervals(sample, 0.95)
    np.testing.assert_allclose(found.smoothing, np.sqrt(0.7**2 - 0.1**2), rtol=0.01)
    np.testing.assert_allclose(found.half_width, 1.96 * 0.7, rtol=0.02)


def test_intervals_cover_the_truth_in_a_few_trials():
    known = noiseless(
        synthetic.synthetic_midlines(GLASS, 40, 30, seed=99, noise=0.0, **USUAL)
    )
    error, width = covered(GLASS, known, range(2), 4.4, 30, **USUAL)
    assert (np.abs(error) <= width).mean() > 0.8


def two_waves(points, noise=0.003, **options):
    """A trial whose wave of 1.5 lengths has a third harmonic of 30 %, and what it is without noise at 100 points."""
    form = {"swing": 0.7, "waves": 1.5, "third": 0.3, "seed": 5, **REPEATING, **options}
    swimmer = Swimmer(Viscous(4.0), Backbone(40))
    exact = synthetic.synthetic_midlines(swimmer, 4.4, 40, 100, noise=0.0, **form)
    return synthetic.synthetic_midlines(
        swimmer, 4.4, 40, points, noise=noise, **form
    ), exact


def test_modes_cover_a_third_harmonic_that_the_points_resolve():
    """With 22 points its waves have 4.9 points each."""
    trial, exact = two_waves(22)
    f, known = fit.fit_midlines(trial.trial()), noiseless(exact, 30, smooth.EVEN)
    along = slice(len(QUANTITIES), None)
    error = np.abs(f.intervals.value - known)
    assert (error <= f.intervals.half_width)[along].mean() > 0.8
    for name, most in (("slip", 0.02), ("amplitude", 0.01)):
        k = QUANTITIES.index(name)
        assert error[k] < most * known[k] and error[k] < f.intervals.half_width[k]


def test_noise_alone_takes_no_more_modes(fitted):
    assert not fitted.curve.even or fitted.curve.modes < 18


def test_amplitude_is_the_mean_of_the_ranges_of_cycles():
    """Of a point that swings by 1 and 2 in turn, at other phases of the cycle: 1.5 in the mean."""
    t = 2 * np.pi * np.arange(96) / 48
    size, late = np.repeat([[1.0, 2.0], [0.0, 2.0]], 48, 1)
    wave = (size * np.sin(t + late)).reshape(2, 48, 1) * np.ones(kinematics.NODES)
    along = np.linspace(0, 1, kinematics.NODES) + 0 * wave
    x = along + np.arange(96).reshape(2, 48, 1) / 480
    starts = np.array([[0.0, 0, 0], [0.1, 0, 0]])
    cycles = kinematics.Cycles(
        t.reshape(2, 48), x + 1j * wave, np.ones_like(x, complex), np.ones_like(x, complex),
        starts, starts + [0.1, 0, 0], np.ones(2),
    )  # fmt: skip
    mean = kinematics.averages(cycles).weighted(np.full((1, 2), 0.5))
    found = kinematics.quantities(mean, 1.0)[0, QUANTITIES.index("amplitude")]
    assert found == pytest.approx(1.5, rel=0.005)


def test_a_point_missing_for_many_frames_is_bridged_without_a_warning(noisy, recwarn):
    points = noisy.points.copy()
    points[30:37, 5] = np.nan
    points[60:90, 11:13] = np.nan
    fit.fit_midlines(dataclasses.replace(noisy.trial(), points=points))
    assert not recwarn.list


def inner(trial, first, last):
    """The points ``first`` to ``last`` of a trial whose body has length 1."""
    some = slice(first, last)
    return dataclasses.replace(
        trial.trial(), points=trial.points[:, some], names=trial.trial().names[some],
        lines=trial.trial().lines[:, some], unit="m", length=1.0,
    )  # fmt: skip


def test_a_piece_of_a_body_is_predicted_in_its_own_unit(noisy):
    """With and without the body's length the piece goes as far, and its interval covers what the whole body does."""
    piece = inner(noisy, 3, 27)
    medium = MEDIA["glass-0.3mm-loose"]
    fits = [
        fit.fit_midlines(x) for x in (piece, dataclasses.replace(piece, length=None))
    ]
    long, short = (predicted.compare(f, medium) for f in fits)
    speed, stride = (predicted.COMPARED.index(x) for x in ("speed", "stride"))
    assert long.predicted[speed] == pytest.approx(short.predicted[speed], rel=1e-9)
    own = fits[1].value("body_length")[0]
    for of in ("predicted", "measured"):
        values = getattr(long, of)[stride], getattr(short, of)[stride]
        assert values[0] == pytest.approx(own * values[1], rel=0.002)
    efficiency = predicted.COMPARED.index("efficiency")
    np.testing.assert_allclose(
        long.predicted[efficiency], short.predicted[efficiency], rtol=1e-9
    )
    whole = fit.fit_midlines(dataclasses.replace(noisy.trial(), unit="m"))
    k = QUANTITIES.index("speed")
    difference = abs(long.predicted[speed] - whole.intervals.value[k])
    assert difference < long.predicted_error[speed]
    assert difference > short.predicted_error[speed] and not short.notes
    assert long.ends[stride] > 0 and "80%" in long.notes[0]


@pytest.mark.soak
@pytest.mark.parametrize("cycles", [3.5, 8.4])
@pytest.mark.parametrize("options", [REPEATING, USUAL, SLOW, VARYING])
def test_intervals_cover_the_truth_in_90_to_99_percent(options, cycles):
    """Of 200 trials a share of 95 % has a standard error of 1.5 %. That few cycles may be alike makes intervals of others
    too wide, and those of turns, whose ends two cycles share."""
    error, width = covered(
        GLASS, truth(GLASS, **options), range(40000, 40200), cycles, **options
    )
    share, size = (
        (np.abs(error) <= width).mean(0),
        np.median(width, 0) / 1.96 / np.sqrt((error**2).mean(0)),
    )
    print(options, cycles, *zip(QUANTITIES, share.round(3), size.round(2)), sep="\n")
    assert (share >= 0.9).all() and ((share <= 0.99) | (size < 3)).all()


# Prediction.


def test_the_medium_of_the_trial_predicts_it_and_another_does_not(fitted):
    same = predicted.compare(fitted, MEDIA["glass-0.3mm-loose"])
    apart = np.abs(same.measured - same.predicted) / np.hypot(
        same.measured_error, same.predicted_error
    )
    assert (apart < 1).all()
    other = predicted.compare(fitted, MEDIA["glass-0.3mm-close"])
    speed, slip = predicted.COMPARED.index("speed"), predicted.COMPARED.index("slip")
    assert (
        other.predicted[speed] + other.predicted_error[speed]
        < other.measured[speed] - other.measured_error[speed]
    )
    assert other.predicted[slip] > other.measured[slip]
    C, gamma0 = other.closing
    assert (
        (C.name, gamma0.name) == ("C", "gamma0")
        and 1.5 < C.value < 2.0
        and np.isnan(gamma0.value)
    )
    assert 0.01 < C.error < 0.5
    closed = predicted.compare(fitted, dataclasses.replace(other.medium, C=C.value))
    assert closed.predicted[speed] == pytest.approx(closed.measured[speed], rel=0.02)


def test_the_command_prints_writes_and_draws(noisy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    synthetic.save("mid.csv", noisy)
    line = "fit-gait mid.csv --medium glass-0.3mm-close -o mid.nc --plot mid.svg --json"
    code, out, _ = command(*line.split())
    found = of_json(out)
    assert not code and found.attributes["cycles"] == 4
    assert {found[name].unit for name in QUANTITIES} == {"Hz", "BL", "BL/s", "rad", "1"}
    speed, errors = found["speed"], found.at(quantity="speed")["standard_error"]
    assert math.hypot(*errors.values) < float(speed.error)
    assert found["slip_along"].values.size == kinematics.PARTS
    assert found["amplitude_along"].error.size == kinematics.PARTS
    each = found["speed_per_cycle"].values
    assert np.mean(each) == pytest.approx(float(speed), rel=0.01)
    assert float(found["speed_predicted"]) < float(speed)
    assert found["heading_predicted"].unit == "rad"
    C, gamma0 = (found.at(parameter=name) for name in ("C", "gamma0"))
    low, high = C["parameter_tried"].values
    closing = C["parameter_closing"]
    assert low < float(C["parameter_present"]) < float(closing) < high
    assert 0 < float(closing.error) < 0.5
    assert gamma0["parameter_closing"].unit == "rad"
    assert math.isnan(float(gamma0["parameter_closing"]))
    again = geomech.load_result("mid.nc")
    assert (float(again["speed"]), float(again["speed"].error)) == (
        float(speed),
        float(speed.error),
    )
    assert "measured" in (tmp_path / "mid.svg").read_text()
    with pytest.warns(Note, match="y is taken to run up"):
        asked = geomech.fit_gait("mid.csv", medium="glass-0.3mm-close")
    assert float(asked["speed"]) == float(speed)
    told = repr(asked)
    assert "C = 1.305" in told and "gives the measured distance" in told
    assert "none from" in told
    with pytest.raises(Refusal, match="this result has no mean gait"):
        geomech.fitted_gait(asked)
    code, _, err = command("fit-gait", "mid.csv", "--degrees")
    assert code == 2 and "--degrees" in err


# Parts against closed forms.


def test_trials_that_are_made_are_what_they_say():
    """Without what is random a wave of headings, and after a cycle the displacement of its shapes; then how it varies."""
    swimmer = Swimmer(Viscous(2.0), Backbone(24, length=0.4))
    plain = {"noise": 0.0, "spread": 0.0, "jitter": 0.0, "frequency": 2.0, "seed": 4}
    form = {"swing": 0.6, "waves": 1.3, "heading": 0.7, "bend": 0.3}
    made = synthetic.synthetic_midlines(swimmer, 2.2, 30, 24, **plain, **form)
    np.testing.assert_allclose(made.t, np.arange(67) / 60, atol=1e-12)
    np.testing.assert_array_equal(made.points, made.exact)
    z = made.exact @ [1.0, 1j]
    middle = np.arange(23) / 23 + 0.5 / 23  # of the body, between two points
    headings = np.unwrap(np.angle(np.diff(z)), axis=1)
    headings -= 0.3 * (middle - 0.5)
    basis = np.stack(
        [
            np.ones(23),
            np.sin(2 * np.pi * 1.3 * (middle - 0.5)),
            np.cos(2 * np.pi * 1.3 * (middle - 0.5)),
        ]
    )
    _, cos, sin = np.linalg.lstsq(basis.T, headings.T, rcond=None)[0]
    np.testing.assert_allclose(np.hypot(cos, sin), 0.6, rtol=0.01)
    np.testing.assert_allclose(
        np.unwrap(np.arctan2(sin, cos)) - np.arctan2(sin[0], cos[0]),
        4 * np.pi * made.t,
        atol=0.02,
    )
    net = displacement(
        swimmer.velocity(*one_cycle(swimmer, np.arctan2(sin[0], cos[0]), 0.6, 1.3, 0.3))
    )
    np.testing.assert_allclose(
        z[30],
        np.exp(1j * net[2]) * z[0] + np.exp(0.7j) * (net[0] + 1j * net[1]) / 0.4,
        atol=2e-3,
    )
    np.testing.assert_allclose(np.abs(np.diff(z, axis=1)).sum(1), 1.0, atol=0.01)

    swimmer = Swimmer(Viscous(2.0), Backbone(6))
    many = lambda **other: synthetic.synthetic_midlines(
        swimmer, 40, 8, 6, **{**plain, **other}
    )
    still, off = many(), many(noise=0.02)
    np.testing.assert_array_equal(still.exact, off.exact)
    assert (off.points - still.points).std() == pytest.approx(0.02, rel=0.03)
    varied = many(spread=1e-3)
    bend = lambda trial: np.diff(
        np.unwrap(np.angle(np.diff(trial.exact @ [1.0, 1j])), axis=1)
    )
    rates = [
        (bend(many(**{name: 1e-4 + value})) - bend(still)) / 1e-4
        for name, value in (("swing", 0.9), ("waves", 1.1))
    ]
    rows = np.stack(rates, -1) * [0.9, 1.1]
    found = np.array(
        [
            np.linalg.lstsq(a, b, rcond=None)[0]
            for a, b in zip(rows, bend(varied) - bend(still))
        ]
    )
    np.testing.assert_allclose(found.std(0), 1e-3, rtol=0.2)
    assert abs(np.corrcoef(found.T)[0, 1]) < 0.2
    np.testing.assert_allclose(
        (found[4:] * found[:-4]).mean(0) / (found**2).mean(0), math.exp(-1), atol=0.2
    )  # half a cycle
    with pytest.raises(Refusal, match="frames"):
        synthetic.synthetic_midlines(swimmer, 3.0, 7, 6, **plain)
    usual = {
        "swing": 0.9,
        "waves": 1.1,
        "frequency": 1.0,
        "noise": 0.01,
        "spread": 0.05,
        "jitter": 0.02,
        "heading": 0.5,
    }
    wanted = synthetic.synthetic_midlines(
        swimmer, 8.0, 40, 30, **usual, bend=0.0, seed=0
    )
    np.testing.assert_array_equal(
        synthetic.synthetic_midlines(swimmer).points, wanted.points
    )


def one_cycle(swimmer, start, swing, waves, bend):
    """Shapes and rates (64, d) of a wave of headings from the head of a body to its tail."""
    s = (np.arange(swimmer.joints + 1) + 0.5) / (swimmer.joints + 1) - 0.5
    at = start + 2 * np.pi * np.arange(64)[:, None] / 64 + 2 * np.pi * waves * s
    return np.diff(swing * np.sin(at) + bend * s), np.diff(swing * np.cos(at))


@pytest.mark.parametrize(
    ("level", "power", "bounds", "value", "root", "low", "high"),
    [
        (3.0, 0.5, (0.1, 10.0), 2.0, 3.0, 2 / 2**3.0, 2 * 2**2.0), (3.0, -0.5, (0.1, 10.0), 2.0, 3.0, 2 / 2**4, 2 * 2**2.0),
        (0.4, 0.5, (0.1, 100.0), 2.0, 0.4, 2 / 2**4.0, 2 * 2**5.5), (30.0, 1.0, (0.1, 10.0), 2.0, math.nan, 0.125, 8.0),
        (0.2, 1.0, (0.0, 900.0), 0.0, 0.2, 1e-3, 10**2.5),
    ],
)  # fmt: skip
def test_the_value_that_closes_a_gap_is_a_root(
    level, power, bounds, value, root, low, high
):
    """Of a stride that is a power of a parameter, which a medium takes within bounds."""

    def gap(x):
        if not bounds[0] <= x <= bounds[1]:
            raise Refusal("beyond the bounds")
        return x**power - level**power

    found = predicted._closed("C", "rad", value, gap, 0.01, 1.0)
    assert (found.name, found.unit, found.present) == ("C", "rad", value)
    slope = abs(power) * level ** (power - 1)
    wanted = (root, 0.01 / slope) if math.isfinite(root) else (math.nan, math.nan)
    np.testing.assert_allclose((found.value, found.error), wanted, rtol=2e-3)
    tried = (
        value * 2 ** (np.arange(25) / 2 - 6) if value else 10 ** (np.arange(13) / 2 - 3)
    )
    tried = tried[(tried >= bounds[0]) & (tried <= bounds[1])]
    np.testing.assert_allclose(
        (found.low, found.high), (tried[0], tried[-1]), rtol=1e-12
    )


def test_of_several_roots_the_one_nearest_to_the_present_value_closes_a_gap():
    wave = lambda x: math.sin(math.pi * math.log2(x) / 3)  # zero at powers of 8
    assert predicted._closed("C", "-", 3.0, wave, 0.1, 1.0).value == pytest.approx(
        8.0, rel=2e-3
    )
    assert predicted._closed("C", "-", 2.0, wave, 0.1, 1.0).value == pytest.approx(
        1.0, rel=2e-3
    )
    flat = lambda size: predicted._closed(
        "C", "-", 2.0, lambda x: size * wave(x), 0.1, 0.5
    )
    moves = np.ptp([wave(2 * x) for x in predicted.FACTORS])
    assert flat(0.49e-4 / moves) is None and flat(0.51e-4 / moves) is not None

    def alone(x):
        if abs(x - 2) > 0.1:
            raise Refusal("beyond the bounds")
        return wave(x)

    assert predicted._closed("C", "-", 2.0, alone, 0.1, 1.0) is None


@pytest.mark.parametrize("constant", [0.2, 0.6])
def test_the_variances_of_cycles_have_their_likelihood(constant):
    """By the normal density of what is left of the cycles without their mean, as it stands."""
    rng, count, number = np.random.default_rng(5), 5, 9
    values = rng.normal(size=(count, 2)) * [1.0, 0.2] + 3.0
    noise = rng.normal(size=(number, count, 2)) * 0.3 + 0.1
    deviation = noise - noise.mean(0)
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    contrasts = null_space(np.ones((1, count)))
    variances, weights, exact = [], [], None
    knowns = []
    for k in range(2):
        same = (deviation[..., k] ** 2).sum(0).mean() / (number - 1)
        near = (deviation[:, 1:, k] * deviation[:, :-1, k]).sum(0).mean() / (number - 1)
        scatter = values[:, k].var(ddof=1)
        knowns.append(
            (same + 1e-9 * scatter) * (apart == 0)
            + np.clip(near, -same / 2, same / 2) * (apart == 1)
        )
    white = [
        np.linalg.inv(np.linalg.cholesky(contrasts.T @ x @ contrasts)) @ contrasts.T
        for x in knowns
    ]
    drawn = np.stack([deviation[..., k] @ white[k].T for k in range(2)], 1)
    exact = intervals._repeating(
        np.stack([white[k] @ values[:, k] for k in range(2)]), drawn
    )
    exact += (1 - exact) * constant
    found, by_cycles = intervals._cycle_variances(values, noise, constant)
    for k, known in enumerate(knowns):
        scatter, same = (
            values[:, k].var(ddof=1),
            knowns[k][0, 0] - 1e-9 * values[:, k].var(ddof=1),
        )
        prior = intervals.TRIED * scatter / (intervals.TRIED * scatter + same)
        prior = [exact, *((1 - exact) * prior / prior.sum())]
        for correlation in intervals.CORRELATIONS:
            alike = correlation ** apart.astype(float)
            for v, p in zip([0.0, *(intervals.TRIED * scatter)], prior):
                covariance = contrasts.T @ (known + v * alike) @ contrasts
                weights.append(
                    p
                    * multivariate_normal.pdf(
                        contrasts.T @ values[:, k], cov=covariance
                    )
                )
                variances.append(v * alike.mean())
    weights = np.reshape(weights, (2, len(intervals.CORRELATIONS), -1))
    # Each quantity has the evidence of the other twice, as three deviations move both.
    evidence = weights.sum(-1)
    share = np.array([*intervals.CORRELATIONS.values()]) * evidence[::-1] ** 2
    weights = (weights * share[..., None]).reshape(2, -1).T
    np.testing.assert_allclose(found, weights / weights.sum(0), atol=1e-7)
    np.testing.assert_allclose(by_cycles, np.reshape(variances, (2, -1)).T, rtol=1e-9)


def test_an_interval_has_its_share_of_the_mixture_of_normals():
    """Of a sample whose parts are known one by one."""
    rng = np.random.default_rng(2)
    pseudo, noise = rng.normal(size=(4, 3)), 0.4 * rng.normal(size=(12, 4, 3))
    value, change = pseudo.mean(0) + 5.0, np.array([0.3, 0.0, -0.2])
    noisy, moved = (
        value + noise.mean(1) + [0.1, 0.0, -0.2],
        change + 0.05 * rng.normal(size=(12, 3)) + [0.0, 0.0, 0.05],
    )
    sample = intervals.Sample(value, pseudo, noisy, pseudo + noise, change, moved)
    for level in (0.9, 0.95):
        found = intervals.intervals(sample, level)
        np.testing.assert_allclose(found.value, 2 * value - noisy.mean(0), rtol=1e-12)
        by_noise = noisy.var(0, ddof=1) + (0.15 * (noisy.mean(0) - value)) ** 2
        np.testing.assert_allclose(found.noise, np.sqrt(by_noise), rtol=1e-12)
        left = np.maximum((2 * change - moved.mean(0)) ** 2 - moved.var(0, ddof=1), 0)
        np.testing.assert_allclose(found.smoothing, np.sqrt(left), rtol=1e-12)
        assert (found.smoothing > 0).sum() == 2
        weights, by_cycles = intervals._cycle_variances(pseudo, noise, 0.2)
        known = by_noise + left
        inside = 2 * norm.cdf(found.half_width / np.sqrt(by_cycles + known)) - 1
        np.testing.assert_allclose((weights * inside).sum(0), level, atol=1e-9)
        np.testing.assert_allclose(
            found.half_width / norm.ppf((1 + level) / 2),
            np.sqrt(found.cycles**2 + known),
            rtol=1e-9,
        )
        one = intervals.Sample(
            value, pseudo[:1], noisy, (pseudo + noise)[:, :1], change, moved
        )
        alone = intervals.intervals(one, level)
        np.testing.assert_allclose(
            alone.half_width, norm.ppf((1 + level) / 2) * np.sqrt(known), rtol=1e-12
        )
        np.testing.assert_allclose(alone.cycles, 0.0, atol=1e-7)
        np.testing.assert_array_equal(found.per_cycle, pseudo)


# Both sides of what trials are refused for.


def line_of(frames=40, count=11, move=0.0):
    """A straight body of length 1, tail at the origin and head at x = 1, that moves along y."""
    points = np.stack(
        np.broadcast_arrays(
            np.linspace(0, 1, count), move * np.arange(frames)[:, None]
        ),
        -1,
    )
    return trial_of(np.arange(frames) / 10, points)


def refused(said):
    return pytest.raises(Refusal, match=said) if said else contextlib.nullcontext()


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (3.9, ""), (1 / 3.9, ""),
        (4.1, r"line 32 \(t = 3\): the body is 4.1 times as long as in most frames: mend or drop that frame"),
        (1 / 4.1, "the body is 0.244 times as long as in most frames: mend"), (12.9, "frames: mm for m, or another such unit"),
        (13.1, "in most frames: mend"), (1 / 129, "mm for m"), (1 / 132, "most frames: mend"), (710, "mm for m"),
        (690, "frames: mend"),
    ],
)  # fmt: skip
def test_frames_are_of_one_size(factor, said):
    with refused(said):
        fit.slips._check_scale(at(30, lambda p: factor * p[30])(line_of()))


@pytest.mark.parametrize(
    ("degrees", "said"),
    [(119, ""), (121, "from 4 by 5 to 6 the body turns back in most frames: points")],
)
def test_points_run_along_the_body(degrees, said):
    turn = np.exp(1j * np.radians(degrees) * (np.arange(10) >= 4))
    z = np.concatenate([[0], np.cumsum(turn)]) / 10
    trial = trial_of(
        np.arange(20.0), np.broadcast_to(np.stack([z.real, z.imag], -1), (20, 11, 2))
    )
    with refused(said):
        fit.slips._check_order(trial)


def test_points_are_seen_in_half_of_the_frames_and_frames_have_most_of_their_points():
    fit.slips._check_points(at((slice(20), 4), np.nan)(line_of()))
    with pytest.raises(
        Refusal,
        match="trial.csv: point 5 is missing in 52.5 % of the frames: leave it out",
    ):
        fit.slips._check_points(at((slice(21), 4), np.nan)(line_of()))
    trial = at((slice(20), [0, 1, 2, 3]), np.nan)(line_of())
    assert fit.slips._without_poor_frames(trial) is trial
    poor = at((slice(7, 35), [0, 1, 2, 3, 4]), np.nan)(line_of(move=0.1))
    left = fit.slips._without_poor_frames(poor)
    kept = [*range(7), *range(35, 40)]
    assert left.notes == (
        "28 frames with fewer than 60% of the points are left out, the first at line 9",
    )
    for name in ("t", "points", "lines"):
        np.testing.assert_array_equal(getattr(left, name), getattr(poor, name)[kept])
    with pytest.raises(
        Refusal,
        match="11 frames have most of their points: track more points, or lower least_score",
    ):
        fit.slips._without_poor_frames(
            at((slice(7, 36), [0, 1, 2, 3, 4]), np.nan)(line_of())
        )


@pytest.mark.parametrize(
    ("aside", "turned"), [(0.22, True), (0.25, False)]
)  # 0.4 of what the turned frame is off, 0.24
def test_frames_that_run_the_other_way_are_turned_round(aside, turned):
    trial = line_of()
    points = trial.points.copy()
    points[12:] += [0.0, aside]
    points[12:] = points[12:, ::-1]
    trial = dataclasses.replace(trial, points=points)
    mended = fit.slips._rotated(trial, True)
    if not turned:
        assert mended is trial is fit.slips._rotated(trial, False)
        return
    np.testing.assert_array_equal(
        mended.points, np.concatenate([points[:12, ::-1], points[12:]])
    )  # the fewer
    assert mended.notes == (
        "12 frames run from the other end of the body and are turned round, the first at line 2",
    )
    with pytest.raises(
        Refusal,
        match=r"line 2 \(t = 0\): 12 frames run from the other end of the body, the first is this one: turn",
    ):
        fit.slips._rotated(trial, False)


@pytest.mark.parametrize(("wide", "turned"), [(0.21, True), (0.19, False)])
def test_ends_that_are_near_each_other_are_not_told_apart(wide, turned):
    """A hairpin whose legs are ``wide`` of its length apart."""
    height = np.array([1.0, 0.5, 0.0, 0.0, 0.5, 1.0]) * (1 - wide) / 2
    hairpin = np.stack([wide / 2 * np.array([-1, -1, -1, 1, 1, 1]), height], -1)
    points = np.repeat(hairpin[None], 20, 0)
    points[8:11] = points[8:11, ::-1]
    trial = trial_of(np.arange(20.0), points)
    assert (fit.slips._rotated(trial, True) is trial) != turned


@pytest.mark.parametrize(
    ("wobble", "move", "jump", "found"),
    [
        (0.0, 0.0, 0.029, 0), (0.0, 0.0, 0.031, 1), (0.01, 0.0, 0.079, 0), (0.01, 0.0, 0.081, 1), (0.0, 0.01, 0.089, 0),
        (0.0, 0.01, 0.091, 1), (0.0, 0.02, -0.25, 1),
    ],
)  # fmt: skip
def test_points_jump_from_where_they_are_in_the_frames_around(
    wobble, move, jump, found
):
    """By more than 0.03 lengths, 8 times what they are off otherwise, and 6 times what the frames around are."""
    trial = line_of()
    points = trial.points.copy()
    points[..., 1] += (wobble * (-1.0) ** np.arange(40) + move * np.arange(40))[:, None]
    points[20, 3, 1] = jump + 20 * move
    trial = dataclasses.replace(trial, points=points)
    mended = fit.slips._without_jumps(trial, True)
    if not found:
        assert mended is trial
        return
    assert mended.notes == (
        "1 points that jump or swap are taken for missing: 4 at line 22",
    )
    np.testing.assert_array_equal(
        np.argwhere(np.isnan(mended.points[..., 1])), [[20, 3]]
    )
    with pytest.raises(
        Refusal,
        match=rf"line 22 \(t = 2, point 4\): it jumps by {abs(jump):.2g} body lengths from where it is in",
    ):
        fit.slips._without_jumps(trial, False)


def test_many_jumps_are_counted():
    trial = at(([5, 15, 25, 35, 35], [1, 2, 3, 4, 7]), 0.5)(line_of())
    assert fit.slips._without_jumps(trial, True).notes == (
        "5 points that jump or swap are taken for missing: 2 at line 7, 3 at line 17, 4 at line 27 and 2 more",
    )


@pytest.mark.parametrize(
    ("longer", "said"),
    [
        (0.59, ""), (0.61, "the cycle from t = 2 to 3.61 takes 1.6 times as long as most: cut pauses"), (-0.37, ""),
        (-0.38, "the cycle from t = 2 to 2.62 takes 0.62 times as long"),
    ],
)  # fmt: skip
def test_cycles_are_of_one_pace(longer, said):
    with refused(said):
        fit._check_pace(
            line_of(),
            np.array([0.0, 1.0, 2.0, 3.0 + longer, 4.0 + longer, 5.0 + longer]),
        )


def test_a_cycle_has_a_gap_where_an_eighth_of_it_has_no_frame():
    t = np.arange(0, 5, 0.1)
    trial = dataclasses.replace(line_of(50), t=t)
    assert not fit._has_gap(trial, 1.02, 1.9)
    assert fit._has_gap(trial, 1.02, 1.8)
    for out, start, end, gap in (
        (12, 1.02, 2.7, False),
        (12, 1.02, 2.6, True),
        (10, 0.98, 2.0, False),
        (10, 0.96, 2.0, True),
    ):
        assert (
            fit._has_gap(dataclasses.replace(trial, t=np.delete(t, out)), start, end)
            == gap
        )


@pytest.mark.parametrize(
    ("unit", "size", "length", "said"),
    [
        ("m", 29.9, None, ""), ("m", 30.1, None, "the body is 30.1 m long: say the unit of x and y: mm, cm or px by units"),
        ("m", 1.01e-4, None, ""), ("m", 0.99e-4, None, "the body is 9.9e-05 m long"), ("BL", 1.39, None, ""),
        ("BL", 0.72, None, ""),
        ("BL", 1.41, None, "the body is 1.41 body lengths long: say the unit"),
        ("BL", 0.71, None, "the body is 0.71 body lengths"),
        ("m", 0.139, 0.1, ""), ("m", 0.02, 0.1, ""), ("", 100.0, None, ""),
        ("m", 0.141, 0.1, "the points lie along 0.141 and the body is 0.1 long: give body_length in the unit of x and y"),
    ],
)  # fmt: skip
def test_bodies_have_the_length_of_one(unit, size, length, said):
    trial = dataclasses.replace(
        line_of(), points=size * line_of().points, unit=unit, length=length
    )
    with refused(said):
        assert (
            fit._with_length(trial, smooth.curve_of(trial, np.linspace(0, 1, 11), 4, 4))
            is trial
        )


def test_motions_turn_evenly_or_have_no_period():
    t = np.arange(60) / 50
    at = lambda off: 2 * np.pi * t / 0.8 + off * np.sqrt(2) * np.cos(25 * t)
    headings = lambda at: np.stack(
        [np.cos(at), 0.9 * np.sin(at), 0.3 * np.cos(at + 1)], -1
    )
    for sign in (1, -1):
        assert fit._turning(t, headings(sign * at(0.0)) + 2.0) == pytest.approx(
            0.8, rel=0.05
        )
    assert fit._turning(t, headings(at(0.6))) > 0 == fit._turning(t, headings(at(0.85)))


def test_a_phase_grows_by_a_fifth_of_a_turn_in_half_a_cycle():
    t = np.arange(120) / 10
    for least, said in (
        (0.41, ""),
        (0.39, "the motion stands, or is another one, after t = 3.1: cut pauses"),
    ):
        phase = np.concatenate(
            [np.arange(31) * 2, 60 + 2 + least * np.pi / 24 * np.arange(89)]
        )
        with refused(said):
            fit._check_growing(line_of(), t, phase)


@pytest.mark.parametrize(
    ("course", "stride", "wave", "head", "turn", "said"),
    [
        (0.1, 0.3, -1, None, False, "11, by the motion: it moves there, against its wave"),
        (3.0, 0.3, 1, None, True, "1, by the motion: it moves there, against its wave"),
        (0.1, 0.015, 1, None, True, "1, by the motion: the wave runs away from it; the body hardly moves"),
        (0.1, 0.3, -1, "last", False, "11, as given"), (0.1, 0.3, -1, "first", True, "1, as given; it moves tail first"),
        (3.0, 0.3, -1, "last", False, "11, as given; it moves tail first"), (3.0, 0.3, 1, "first", True, "1, as given"),
        (0.1, 0.015, -1, "first", True, "1, as given"),
    ],
)  # fmt: skip
def test_a_body_moves_head_first_against_its_wave(
    course, stride, wave, head, turn, said, monkeypatch
):
    """A wave that runs to the head, 1, or away from it, of a body of length 2."""
    numbers = np.tile([1.0, 2.0, 2 * stride, course, 0.0, 0.0, 1.0], (3, 1))
    s = (np.arange(kinematics.NODES) + 0.5) / kinematics.NODES
    first = np.tile(np.exp(-wave * 2j * np.pi * 1.2 * s), (3, 1))
    monkeypatch.setattr(
        kinematics,
        "averages",
        lambda _: kinematics.Averages(numbers, first, None, None),
    )
    found = fit._head(line_of(), None, head)
    assert (bool(found[0]), found[1]) == (turn, said)
    if head is None and stride > 0.02:
        monkeypatch.setattr(
            kinematics,
            "averages",
            lambda _: kinematics.Averages(numbers, first.conj(), None, None),
        )
        end = "11" if course < 1 else "1"
        with pytest.raises(
            Refusal,
            match=f"the body moves towards its point {end}, and so does its wave: most swimmers",
        ):
            fit._head(line_of(), None, None)
        assert fit._head(line_of(), None, "last") == (
            False,
            "11, as given" + "; it moves tail first" * (course > 1),
        )


# Files: what is said of them.


def table_of(unit="", timed=True, frames=12, points=5):
    values = np.zeros((frames, points, 3))
    return reader.Table(
        np.arange(frames), values, tuple("abcde"[:points]), values[..., 0], unit, timed
    )


@pytest.mark.parametrize(
    ("unit", "units", "scale", "found"),
    [
        ("mm", None, None, ("m", 1e-3, "")), ("", "cm", None, ("m", 1e-2, "")), ("m", "m", None, ("m", 1.0, "")),
        ("BL", None, None, ("BL", 1.0, "")), ("", "BL", None, ("BL", 1.0, "")), ("px", None, 0.4, ("m", 4e-4, "")),
        ("", None, 0.4, ("m", 4e-4, "")), ("px", "mm", None, ("m", 1e-3, "")),
        ("", None, None, ("", 1.0, "lengths are in body lengths alone: nobody says the unit of x and y, say units")),
        ("px", None, None, ("", 1.0, "lengths are in body lengths alone: nobody says how long a pixel is")),
        ("mm", "cm", None, "f.csv: x and y are in mm by the names of their columns: drop units"),
        ("mm", None, 0.4, "f.csv: scale is that of pixels: drop it, x and y are in mm"),
        ("", "cm", 0.4, "f.csv: scale is that of pixels: drop it, x and y are in cm"),
    ],
)  # fmt: skip
def test_units_of_lengths_are_those_of_the_header_or_of_options(
    unit, units, scale, found
):
    if isinstance(found, str):
        with pytest.raises(Refusal) as said:
            reader._unit(table_of(unit), "f.csv", units, scale)
        assert str(said.value) == found
    else:
        name, size, notes = reader._unit(table_of(unit), "f.csv", units, scale)
        assert (name, size, "".join(notes)) == (
            found[0],
            pytest.approx(found[1]),
            found[2],
        )


def test_times_are_those_of_the_file_or_of_frames():
    t, timed, notes = reader._time(table_of(timed=False), 50.0)
    assert timed and not notes and t.tolist() == [k / 50 for k in range(12)]
    t, timed, notes = reader._time(table_of(timed=False), None)
    assert (
        not timed
        and t[-1] == 11
        and notes
        == ["times are in frames: nobody says how many there are in a second, say fps"]
    )
    assert reader._time(table_of(), None)[1:] == (True, [])
    with pytest.raises(
        Refusal,
        match="fps is that of a file that counts frames: drop it, the file has a time",
    ):
        reader._time(table_of(), 50.0)


@pytest.mark.parametrize(
    ("frames", "points", "said"),
    [
        (12, 5, ""), (11, 5, "f.csv: 11 frames: give a whole trial"),
        (12, 4, "f.csv: 4 points along the body: give 5 to 1000, better 10"),
        (12, 1000, ""), (12, 1001, "1001 points along"),
    ],
)  # fmt: skip
def test_trials_have_frames_and_points_enough(frames, points, said):
    with refused(said):
        reader._check(table_of(frames=frames, points=points), "f.csv")


def csv_of(header, rows):
    return "\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n"


def test_points_are_taken_by_name_in_their_order_and_with_the_bodys_length(tmp_path):
    """In mm, of a body of which the points are half; a likelihood at the limit is enough."""
    rows = [
        [
            k,
            *(
                x
                for p in range(6)
                for x in (p + 0.1 * k, 10 * p, 0.6 if (k, p) != (3, 4) else 0.59)
            ),
            7,
        ]
        for k in range(12)
    ]
    names = ",".join(f"P{p}_x_mm,P{p}_y_mm,P{p}_likelihood" for p in range(6))
    (tmp_path / "f.csv").write_text(csv_of(f"t,{names},more", rows))
    trial = reader.read(
        tmp_path / "f.csv",
        points=["p5", "P4 ", "p3", "p2", "p0"],
        body_length=10.0,
        y="down",
    )
    assert (trial.names, trial.unit, trial.timed, trial.length) == (
        ("p5", "p4", "p3", "p2", "p0"),
        "m",
        True,
        pytest.approx(0.01),
    )
    order = np.array([5, 4, 3, 2, 0])
    wanted = 1e-3 * np.stack(
        [order + 0.1 * np.arange(12)[:, None], np.broadcast_to(-10 * order, (12, 5))],
        -1,
    )
    wanted[3, 1] = np.nan
    np.testing.assert_allclose(trial.points, wanted, atol=1e-12)
    assert trial.lines.tolist() == [[k] * 5 for k in range(2, 14)]
    assert trial.notes == (
        "0.017 of all points are missing, 0.017 of all by their likelihood: modes along the body stand for them",
        "columns that are not used: more",
    )
    with pytest.raises(
        Refusal,
        match="f.csv: columns name a point twice: name each once, from one end of the body",
    ):
        reader.read(tmp_path / "f.csv", points=["p5", "p4", "p3", "p2", "p5"])
    with pytest.raises(Refusal, match="p7"):
        reader.read(tmp_path / "f.csv", points=["p5", "p4", "p3", "p2", "p7"])


@pytest.mark.parametrize(
    ("header", "change", "said"),
    [
        ("t,point,x,y", {7: [0, 5]}, "f.csv, line 9: 2 cells under 4 columns: mend that row"),
        ("t,point,x,y", {3: ["", 3, 0, 0]}, "f.csv, line 5, column t: '' is no time: give the time"),
        ("t,point,x,y", {3: [0, 3, 0, "1e13"]}, "f.csv, line 5, column y: '1e13' is no number up to 1e+12: mend it"),
        ("t,point,x,y", {8: [1, 2, 0, 0]}, "f.csv, line 10: point 2 is given twice at t = 1: keep one"),
        ("t,other,x,y", {3: [5, 3, 0, 0]}, "f.csv, line 2: 4 points at t = 0, and 5 at most others: number the points"),
        ("t,x1,y1,x2", {}, "f.csv, line 1: no columns of points: it has 't, x1, y1, x2'; give a CSV file"),
        ("s,x1,y1,x2,y2", {}, "f.csv, line 1: no column t or frame: it has 's, x1, y1, x2, y2'; name the column of the time t"),
        ("t,a_x_mm,a_y_mm,b_x_mm,b_y", {}, "f.csv, line 1: columns in mm and in no unit: give all x and y in one unit"),
    ],
)  # fmt: skip
def test_faults_of_files_are_told_by_line(header, change, said, tmp_path):
    rows = {k: [k // 5, k % 5 + 1, k, k] for k in range(60)} | change
    (tmp_path / "f.csv").write_text(csv_of(header, rows.values()))
    with pytest.raises(Refusal) as found:
        reader.read(tmp_path / "f.csv")
    assert str(found.value).startswith(said)


@pytest.mark.parametrize(
    ("t", "said"),
    [
        (2.0, "line 5: t = 2 is given twice: keep one of the rows"),
        (1.5, "line 5: t = 1.5 comes after 2: sort the rows by time"),
        ("", "line 5, column t: '' is no time"),
    ],
)
def test_frames_come_in_their_order(t, said, tmp_path):
    rows = [[k, *range(10)] for k in range(12)]
    rows[3][0] = t
    (tmp_path / "f.csv").write_text(
        csv_of("t," + ",".join(f"x{k},y{k}" for k in range(5)), rows)
    )
    with pytest.raises(Refusal, match=said):
        reader.read(tmp_path / "f.csv")


# Words.


@pytest.mark.parametrize(
    ("unit", "value", "said"),
    [
        ("-", 0.5, "0.250: 0.500 +- 2.0e-02 gives the measured distance"),
        ("rad", 0.5, "14.32[0-9]* degrees: 28.6 +- 1.1e.00 degrees gives the measured"),
        ("rad", math.nan, "14.32[0-9]* degrees: none from 0.707 to 68.8 degrees gives"),
    ],
)
def test_what_closes_the_gap_is_told_in_the_units_of_scenes(fitted, unit, value, said):
    count, error = len(predicted.COMPARED), value * 0.04
    values, each = np.full(count, 0.5), np.zeros((4, count))
    closing = predicted.Closing("gamma0", 0.25, unit, value, error, 0.012345, 1.2)
    comparison = predicted.Comparison(
        None, values, values / 10, values, values / 10, each, (closing,)
    )
    result = results.trial_result(fitted, comparison)
    told = trials.closing_words(result, "gamma0")
    assert re.match(
        f"gamma0 = {said}".replace("0.250", "0.25").replace("+", "[+]"), told
    )
    assert result["parameter_closing"].unit == unit.replace("-", "1")


@pytest.mark.parametrize("off", [0.0499, -0.0499, 0.0501, -0.0501])
def test_measured_and_predicted_agree_within_both_of_their_errors(fitted, off):
    names = predicted.COMPARED
    values, each = np.full(len(names), 0.5), np.zeros((4, len(names)))
    sizes = (np.full(len(names), x) for x in (0.03, 0.04))
    errors = dict(zip(("measured_error", "predicted_error"), sizes))
    comparison = predicted.Comparison(
        None, values, predicted=values + off, per_cycle=each, closing=(), **errors
    )
    result = results.trial_result(fitted, comparison)
    np.testing.assert_allclose(result["apart"].values, abs(off) / 0.05)
    said = "agree" if abs(off) < 0.05 else "differ"
    assert f"measured and predicted {said}: speed, stride, heading" in str(result)


def test_a_trial_is_told_in_lines(fitted):
    result = results.trial_result(fitted)
    first, head, *_ = show.lines(result)
    assert first == "synthetic: 4 full cycles of 30 points"
    assert head == f"head: {fitted.head}"
    per_cycle = (len(fitted.curve.knots) - 12 + 1) / (
        fitted.trial.t[-1] * fitted.value("frequency")[0]
    )
    facts, noise = result.attributes, float(result["noise"])
    assert facts["knots_per_cycle"] == pytest.approx(per_cycle)
    assert (facts["modes"], facts["level"]) == (fitted.curve.modes, 0.95)
    length = fitted.value("body_length")[0]
    assert noise == pytest.approx(fitted.curve.noise / length)
    short = dataclasses.replace(fitted, used=fitted.used[:3], level=0.9)
    told = str(results.trial_result(short))
    assert told.startswith(
        "synthetic: 3 full cycles of 30 points; 1 with gaps left out"
    )
    assert "with intervals of 90 % of cases:" in told
    pixels = dataclasses.replace(
        fitted, trial=dataclasses.replace(fitted.trial, timed=False, unit="")
    )
    assert [
        results.units_of(pixels)[x] for x in ("frequency", "body_length", "speed")
    ] == [
        "1/frame",
        "the file's unit",
        "BL/frame",
    ]
    metres = dataclasses.replace(
        fitted, trial=dataclasses.replace(fitted.trial, unit="m")
    )
    assert [
        results.units_of(metres)[x] for x in ("frequency", "body_length", "speed")
    ] == [
        "Hz",
        "m",
        "m/s",
    ]


def test_the_mean_cycle_and_the_times_of_cycles_are_those_of_the_curve(fitted):
    result, cycles = results.trial_result(fitted), fitted.cycles(fitted.curve)
    headings = np.unwrap(np.angle(cycles.tangent), axis=-1)
    headings -= headings.mean((1, 2), keepdims=True)
    np.testing.assert_allclose(result["mean_cycle"].values, headings.mean(0), atol=1e-9)
    raw = cycles.headings
    np.testing.assert_allclose(
        result["mean_cycle"].error, raw.std(0, ddof=1) / 2, atol=1e-9
    )
    np.testing.assert_allclose(
        result["phase"].values, np.pi * np.arange(1, 96, 2) / 48, rtol=1e-12
    )
    times = kinematics.times(
        fitted.clock, fitted.clock.phase(fitted.curve), fitted.marks
    )
    np.testing.assert_allclose(result["cycle_start"].values, times[:-1], atol=1e-9)
    np.testing.assert_allclose(result["s"].values, np.arange(0.05, 1, 0.1), atol=1e-12)
    n = len(QUANTITIES)
    for name, k in (("slip_along", n), ("amplitude_along", n + 10)):
        np.testing.assert_array_equal(
            result[name].values, fitted.intervals.value[k : k + 10]
        )
        np.testing.assert_array_equal(
            result[name].error, fitted.intervals.half_width[k : k + 10]
        )
    one = dataclasses.replace(fitted, used=fitted.used[:1])
    assert results._mean_cycle(one)[-1].error is None
