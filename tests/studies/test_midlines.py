"""Measured midlines: closed forms, files as trackers write them, slips that are
refused, coverage of intervals."""

import contextlib
import dataclasses
import math
import re

import numpy as np
import pytest
from commands import geomech as command
from refusals import refuses
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.special import ellipe
from tabled import of_json

import geomech
from geomech.mathematics.gaits import Sine
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.systems.swimmer import MEDIA
from geomech.scenes import Numerics, Scene
from geomech.studies.measured.midlines import (
    fit,
    intervals,
    kinematics,
    predicted,
    reader,
    slips,
    smooth,
    synthetic,
)
from geomech.studies.measured.midlines.kinematics import QUANTITIES
from geomech.studies.measured.midlines.results import trial_result
from geomech.studies.measured.midlines.trial import Trial
from geomech.studies.mechanics.undulation import performance
from rft import Backbone, Viscous
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
LOOSE = MEDIA["glass-0.3mm-loose"]
GLASS = Swimmer(LOOSE, Backbone(40))
USUAL = {"spread": 0.05, "jitter": 0.02}
REPEATING = {"spread": 0.0, "jitter": 0.0}
SLOW = {"spread": 0.05, "jitter": 0.02, "memory": 0.75}  # cycles alike by .68
VARYING = {"spread": 0.1, "jitter": 0.05, "swing": 0.7, "waves": 1.5}
N = len(QUANTITIES)


@pytest.fixture(autouse=True)
def fast(request, monkeypatch):
    """Puts noise on a few times, but where intervals are to cover the truth."""
    if "cover" not in request.node.name:
        monkeypatch.setattr(intervals, "RESAMPLED", 6)
        monkeypatch.setattr(predicted, "RESAMPLED", 4)


def refused(said):
    """Whether a refusal with such a message is to come, or none, "", is."""
    if said:
        return pytest.raises(Refusal, match=said)
    return contextlib.nullcontext()


def trial_of(t, points, name="trial.csv"):
    frames, count = points.shape[:2]
    lines = np.repeat(2 + np.arange(frames)[:, None], count, 1)
    return Trial(name, t, points, tuple(str(k + 1) for k in range(count)), lines, "BL")


def sampled_cycles(seed, spread, noise, count=8, n_quantities=4):
    """Cycles that vary by ``spread`` about 0, measured with noise."""
    rng = np.random.default_rng(seed)
    cycles = spread * rng.normal(size=(count, n_quantities))
    measured = cycles + noise * rng.normal(size=cycles.shape)
    noisy = measured + noise * rng.normal(size=(40, *cycles.shape))
    no_change = np.zeros(n_quantities)
    return intervals.Sample(
        measured.mean(0), measured, noisy.mean(1), noisy, no_change, noisy[:, 0] * 0
    )


@pytest.mark.parametrize(
    ("spread", "noise", "least", "largest"),
    # Half widths over those of the true variance of the mean.
    [(0.0, 1.0, 1.0, 1.1), (1.0, 0.1, 1.35, 1.55), (1.0, 1.0, 1.15, 1.35)],
)
def test_intervals_of_cycles_cover_their_mean_and_are_hardly_wider(
    spread, noise, least, largest
):
    level = 0.9
    found = [
        intervals.intervals(sampled_cycles(seed, spread, noise), level)
        for seed in range(100)
    ]
    half_width = np.array([x.half_width for x in found])
    is_covered = np.abs([x.value for x in found]) < half_width
    assert level - 0.03 < is_covered.mean() < level + 0.08
    usual = 1.645 * np.hypot(spread, noise) / 8**0.5
    assert least * usual < half_width.mean() < largest * usual
    parts = [np.hypot(x.cycles, np.hypot(x.noise, x.smoothing)) for x in found]
    np.testing.assert_allclose(half_width, 1.6448536 * np.array(parts), rtol=1e-6)


def test_the_error_of_one_cycle_is_its_noise_and_what_smoothing_cuts_off():
    """Of noise of variance 1 about a bias of 1, and of a change of 3 by smoothing
    which noise makes 2 +- 1."""
    noisy = np.array([[10.0], [11.0], [12.0]])
    sample = intervals.Sample(
        value=np.array([10.0]),
        pseudo=np.array([[10.0]]),
        noisy=noisy,
        noisy_pseudo=noisy[:, None],
        change=np.array([3.0]),
        noisy_change=noisy - 9.0,
    )
    found = intervals.intervals(sample, 0.95)
    noise = 1.0 + intervals.UNSURE**2
    smoothing = (2 * 3 - 2) ** 2 - 1.0
    assert found.value == 9.0
    assert found.noise**2 == pytest.approx(noise)
    assert found.smoothing**2 == pytest.approx(smoothing)
    half_width = 1.959964 * (noise + smoothing) ** 0.5
    assert found.half_width == pytest.approx(half_width)
    assert found.cycles == pytest.approx(0.0)


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


def changed(trial, points):
    return dataclasses.replace(trial, points=points)


def frames_of(trial, kept):
    """Some frames of a trial."""
    parts = {name: getattr(trial, name)[kept] for name in ("t", "points", "lines")}
    return dataclasses.replace(trial, **parts)


# Kinematics.


def along_a_sine(amplitude, waves, cycles=3.0, frames=32, count=24):
    """Points of a body of length 1 that slides along a sine without slip, one wave a
    cycle, at 0.3 rad to x."""
    slope = 2 * np.pi * amplitude  # of a sine of wavelength 1
    arc = np.sqrt(1 + slope**2) * 4 * ellipe(slope**2 / (1 + slope**2)) / (2 * np.pi)
    x = np.linspace(-3, 9, 60001)
    path = cumulative_trapezoid(
        np.hypot(1, slope * np.cos(2 * np.pi * x)), x, initial=0
    )
    t = np.arange(int(cycles * frames) + 1) / frames
    far = arc * (4 + t[:, None] + waves * np.linspace(0, 1, count))
    at = CubicSpline(path, x)(far)
    z = (at + 1j * amplitude * np.sin(2 * np.pi * at)) * np.exp(0.3j) / (waves * arc)
    return t, np.stack([z.real, z.imag], -1), 1 / (waves * arc)


@pytest.mark.parametrize(("amplitude", "waves"), [(0.2, 1.0), (0.1, 1.6)])
def test_a_body_that_slides_along_a_sine_has_the_numbers_of_the_sine(amplitude, waves):
    t, points, wavelength = along_a_sine(amplitude, waves)
    f = fit.fit_midlines(dataclasses.replace(trial_of(t, points), unit="m"))
    expected = {
        "frequency": 1.0,
        "body_length": 1.0,
        "stride": wavelength,
        "heading": 0.3,
        "drift": 0.0,
        "turn": 0.0,
        "efficiency": 1.0,
        "wavelength": wavelength,
        "arc_wavelength": 1 / waves,
        "amplitude": amplitude * wavelength,
    }
    for name, value in expected.items():
        size = max(abs(value), 0.3)
        assert f.value(name)[0] == pytest.approx(value, abs=0.012 * size), name
    assert f.value("slip")[0] < 0.03
    assert f.own_length == pytest.approx(1.0, rel=0.01)


def test_slip_and_efficiency_without_noise_are_those_of_the_balance():
    gait = Sine(amplitude=0.2, waves=1.0, elements=60)
    body = Backbone(60)
    swimmer = Swimmer(LOOSE, body)
    known = performance(Scene(swimmer, gait, Numerics(phases=64)), [0.2])
    t = np.arange(1921) / 640
    alpha = gait.shape(2 * np.pi * t)
    xi = swimmer.velocity(alpha, gait.rate(2 * np.pi * t)) * 2 * np.pi
    heading = CubicSpline(t, xi[:, 2]).antiderivative()(t)
    velocity = np.exp(1j * heading) * (xi[:, :2] @ [1.0, 1j])
    path = CubicSpline(t, velocity).antiderivative()(t)
    ends = body.points(alpha, np.stack([path.real, path.imag, heading], -1))
    f = fit.fit_midlines(trial_of(t[::20], ends[::20, ::3]))
    for name, of, tolerance in (
        ("slip", "slip", 0.02),
        ("efficiency", "efficiency", 0.02),
        ("stride", "progress", 0.005),
    ):
        assert f.value(name)[0] == pytest.approx(known[of][0], rel=tolerance)


def test_cycles_that_repeat_without_noise_have_small_errors(exact):
    found = fit.fit_midlines(exact.trial()).intervals
    width = found.half_width[:N]
    assert (np.abs(found.value - noiseless(exact))[:N] <= width + 1e-3).all()
    assert width.max() < 0.04


def test_the_head_is_found_from_the_motion_and_said(exact, noisy, fitted):
    found = fit.fit_midlines(noisy.trial().reversed())
    assert (
        fitted.head == "30, by the motion: the body moves towards it, against its wave"
    )
    np.testing.assert_allclose(found.sample.value, fitted.sample.value, atol=1e-6)
    first = fit.fit_midlines(exact.trial(), head="first")
    assert first.head == "1, as given; it moves tail first"
    film_run_backwards = changed(exact.trial(), exact.points[::-1])
    assert fit.fit_midlines(film_run_backwards).head.startswith("1, by the motion")


def test_missing_points_and_gaps_are_bridged(noisy, fitted):
    points = noisy.points.copy()
    points[np.random.default_rng(0).random(points.shape[:2]) < 0.05] = np.nan
    # Uneven in time.
    some = np.sort(np.random.default_rng(1).choice(len(noisy.t), 100, replace=False))
    for trial, wider in (
        (changed(noisy.trial(), points), 1.0),
        (frames_of(noisy.trial(), some), 1.5),
    ):
        found = fit.fit_midlines(trial).intervals.value
        off = np.abs(found - fitted.intervals.value)
        assert (off <= wider * fitted.intervals.half_width).all()
    gap = frames_of(noisy.trial(), np.r_[0:50, 62 : len(noisy.t)])
    assert len(fit.fit_midlines(gap).used) == len(fitted.used) - 1


def test_mirrored_trials_differ_in_the_sign_of_turns_alone(noisy, fitted):
    mirrored = fit.fit_midlines(changed(noisy.trial(), noisy.points * [1, -1]))
    turns = [name in ("heading", "drift", "turn") for name in QUANTITIES]
    theirs = np.where(turns, -1, 1) * mirrored.intervals.value[:N]
    off = np.abs(theirs - fitted.intervals.value[:N])
    assert (off < 0.3 * fitted.intervals.half_width[:N]).all()


def test_noise_that_is_alike_from_frame_to_frame_is_found(noisy):
    # Noise of standard deviation 0.01 whose neighbours in time are correlated by
    # 0.6.
    noise = np.random.default_rng(0).normal(size=noisy.points.shape)
    for k in range(1, len(noise)):
        noise[k] = 0.6 * noise[k - 1] + 0.8 * noise[k]
    curve = fit.fit_midlines(changed(noisy.trial(), noisy.exact + 0.01 * noise)).curve
    assert curve.alike == pytest.approx(0.6, abs=0.03)
    assert curve.noise == pytest.approx(0.01, rel=0.03)


# Intervals.


def truth(system, **options):
    """Quantities of an animal: of many cycles without noise."""
    cycles = 400 if options["spread"] else 8.2
    made = synthetic.synthetic_midlines(system, cycles, seed=99, noise=0.0, **options)
    return noiseless(made)


def noiseless(made, modes=14, even=0.0):
    trial = smooth.filled(made._replace(points=made.exact).trial())
    places = np.linspace(0, 1, trial.points.shape[1])
    curve = smooth.curve_of(trial, places, modes, 2, even)
    clock = kinematics.clock(curve, fit.period(trial))
    marks, used = fit.full_cycles(trial, curve, clock)
    each = kinematics.averages(fit.used_cycles(curve, clock, marks, used))
    weights = np.full((1, len(used)), 1 / len(used))
    return kinematics.quantities(each.weighted(weights))[0]


def covered(system, known, seeds, cycles=8.4, frames=40, **options):
    """Errors and half widths (N, Q) of trials of 30 points with 1 % noise. The heading
    is that of the trial, to which the animal's drift is added."""
    errors = []
    widths = []
    k = QUANTITIES.index("heading")
    for seed in seeds:
        made = synthetic.synthetic_midlines(
            system, cycles, frames, seed=seed, **options
        )
        found = fit.fit_midlines(made.trial()).intervals
        own = noiseless(made)
        expected = known.copy()
        expected[k] = own[k] - own[k + 1] + known[k + 1]
        errors.append((found.value - expected)[:N])
        widths.append(found.half_width[:N])
    return np.array(errors), np.array(widths)


def test_intervals_cover_the_truth_in_a_few_trials():
    made = synthetic.synthetic_midlines(GLASS, 40, 30, seed=99, noise=0.0, **USUAL)
    error, width = covered(GLASS, noiseless(made), range(2), 4.4, 30, **USUAL)
    assert (np.abs(error) <= width).mean() > 0.8


@pytest.mark.soak
@pytest.mark.parametrize("cycles", [3.5, 8.4])
@pytest.mark.parametrize("options", [REPEATING, USUAL, SLOW, VARYING])
def test_intervals_cover_the_truth_in_90_to_99_percent(options, cycles):
    # Of 200 trials a share of 95 % has a standard error of 1.5 %. That few cycles may
    # be alike makes intervals of others too wide, and those of turns, whose ends two
    # cycles share.
    known = truth(GLASS, **options)
    error, width = covered(GLASS, known, range(40000, 40200), cycles, **options)
    share = (np.abs(error) <= width).mean(0)
    size = np.median(width, 0) / 1.96 / np.sqrt((error**2).mean(0))
    print(options, cycles, *zip(QUANTITIES, share.round(3), size.round(2)), sep="\n")
    assert (share >= 0.9).all()
    assert ((share <= 0.99) | (size < 3)).all()


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
    # Noise that ends one cycle too far begins the next too late: it is less in the
    # mean than its scatter says.
    rng = np.random.default_rng(0)

    def noise(*lead):
        return np.diff(0.7 * rng.normal(size=(*lead, 9, 400)), axis=-2)

    distance = np.abs(np.subtract.outer(np.arange(8), np.arange(8)))
    varied = np.linalg.cholesky(alike**distance) @ rng.normal(size=(8, 400))
    pseudo = np.sqrt(variance) * varied + noise()
    noisy = pseudo + noise(40)
    none = np.zeros((40, 400))
    sample = intervals.Sample(
        pseudo.mean(0), pseudo, noisy.mean(1), noisy, none[0], none
    )
    found = intervals.intervals(sample, 0.95)
    assert 0.89 < (np.abs(found.value) <= found.half_width).mean() < 0.99
    assert np.median(found.noise) == pytest.approx(0.7 * np.sqrt(2) / 8, rel=0.05)
    deviation = np.sqrt(2 * 0.7**2 / 8**2 + variance / 8)
    half_width = 1.96 * width * deviation
    assert np.median(found.half_width) == pytest.approx(half_width, rel=0.05)


def test_what_smoothing_cuts_off_is_judged_from_its_change():
    # A change of 0.7 that noise of 0.1 explains in small part, where 3 modes more
    # leave a seventh.
    noise = 0.1 * np.random.default_rng(0).normal(size=(4000, 50))
    one = np.ones((1, 50))
    change = np.full(50, 0.7)
    sample = intervals.Sample(
        one[0], one, 1 + noise, (1 + noise)[:, None], change, change + noise
    )
    found = intervals.intervals(sample, 0.95)
    np.testing.assert_allclose(found.smoothing, np.sqrt(0.7**2 - 0.1**2), rtol=0.01)
    np.testing.assert_allclose(found.half_width, 1.96 * 0.7, rtol=0.02)


# Trials that are made.


def test_what_is_random_in_a_trial_has_its_size():
    swimmer = Swimmer(Viscous(2.0), Backbone(6))
    plain = {"noise": 0.0, **REPEATING, "frequency": 2.0, "seed": 4}

    def many(**other):
        return synthetic.synthetic_midlines(swimmer, 40, 8, 6, **{**plain, **other})

    still = many()
    noise = many(noise=0.02).points - still.points
    assert noise.std() == pytest.approx(0.02, rel=0.03)


# Files.


def wide(trial, t="t", unit=""):
    names = [f"p{k + 1}_{c}{unit}" for k in range(trial.points.shape[1]) for c in "xy"]
    rows = [[x, *p.ravel()] for x, p in zip(trial.t, trial.points)]
    lines = [",".join(f"{v:.8g}" for v in row) for row in rows]
    return "\n".join([",".join([t, *names]), *lines])


def deeplabcut(trial, score=0.99):
    """A film of 600 pixels, in which the body is 300 long and y runs down."""
    count = trial.points.shape[1]
    parts = [f"part{k}" for k in range(count) for _ in "xyl"]
    rows = [
        ",".join(["scorer", *["net"] * 3 * count]),
        ",".join(["bodyparts", *parts]),
        ",".join(["coords", *["x", "y", "likelihood"] * count]),
    ]
    for k, p in enumerate(trial.points):
        cells = [v for x, y in p for v in (100 + 300 * x, 700 - 300 * y, score)]
        rows.append(",".join(map(str, [k, *cells])))
    return "\n".join(rows)


def long(trial, order=1):
    rows = [
        f"{t:.8g},{k + 1},{x:.8g},{y:.8g}"
        for t, p in zip(trial.t, trial.points)
        for k, (x, y) in enumerate(p)
    ]
    return "\n".join(["t,point,x_BL,y_BL", *rows[::order]])


def reordered(text):
    return re.sub(r"p(\d+)_([xy])", r"\2_\1", text)


def in_ms(text):
    text = re.sub("(?m)^([^,t]+)", lambda t: f"{1e3 * float(t[1]):.9g}", text)
    return text.replace("t,", "t_ms,", 1)


@pytest.mark.parametrize(
    ("form", "options", "size"),
    [
        (long, {}, 1.0),
        (lambda x: long(x, -1), {}, 1.0),
        (lambda x: wide(x, unit="_bl"), {}, 1.0),
        (
            lambda x: wide(x).replace("_x", ".x").replace("_y", ".y"),
            {"units": "BL"},
            1.0,
        ),
        (lambda x: wide(x._replace(points=120 * x.points), unit="_mm"), {}, 0.12),
        (lambda x: wide(x._replace(points=12 * x.points), unit=" (cm)"), {}, 0.12),
        (lambda x: reordered(wide(x, unit="_bl")), {"y": "up"}, 1.0),
        # Points have no numbers.
        (lambda x: re.sub("(?m)^([^,]*),[^,]*,", r"\1,", long(x)), {}, 1.0),
        (lambda x: in_ms(long(x)), {}, 1.0),
        (
            lambda x: re.sub("(?m)^(?=[^t])", "a,", "track," + wide(x)),
            {"units": "BL"},
            1.0,
        ),
    ],
)
def test_every_format_gives_the_same_trial(form, options, size, exact, tmp_path):
    (tmp_path / "trial.csv").write_text(form(exact))
    trial = reader.read(tmp_path / "trial.csv", **options)
    np.testing.assert_allclose(trial.points, exact.points * size, atol=1e-6)
    np.testing.assert_allclose(trial.t, exact.t, atol=1e-6)
    assert trial.unit == ("m" if size < 1 else "BL") and trial.timed


def test_deeplabcut_counts_frames_and_pixels_downwards_and_scores_its_points(
    exact, tmp_path
):
    file = tmp_path / "trial.csv"
    file.write_text(deeplabcut(exact))
    trial = reader.read(file, fps=30.0, scale=0.4)
    moved = (trial.points - trial.points[0, 0]) / 0.12
    np.testing.assert_allclose(moved, exact.points - exact.points[0, 0], atol=1e-5)
    np.testing.assert_allclose(trial.t, exact.t)
    file.write_text(deeplabcut(exact, 0.3))
    assert np.isnan(reader.read(file).points).all()
    _, without_scorer = deeplabcut(exact).split("\n", 1)
    file.write_text(without_scorer)
    same = reader.read(file, fps=30.0, scale=0.4)
    np.testing.assert_array_equal(same.points, trial.points)


LONG = "\n".join(["t,point,x,y", *(f"{k // 5},{k % 5 + 1},{k},{k}" for k in range(60))])
NAMES = ",".join(f"x{k},y{k}" for k in range(5))
WIDE = "\n".join([f"t,{NAMES}", *(f"{k},0,1,2,3,4,5,6,7,8,{9 - k}" for k in range(12))])
TRACKS = "\n".join(
    ["track,t,point,x,y", *(f"{'ba'[k // 30]},{k // 5},1,1,1" for k in range(60))]
)
INDIVIDUALS = "scorer,net,net\nindividuals,one,two\nbodyparts,a,a\ncoords,x,y\n0,1,1"


@pytest.mark.parametrize(
    ("text", "old", "new", "options", "said"),
    [
        (
            LONG,
            "\n1,3,7,7\n",
            "\n1,3\n",
            {},
            "line 9 2 4 columns row | where instead",
        ),
        (
            LONG,
            "\n0,4,",
            "\n,4,",
            {},
            "line 5 column t time time | where instead",
        ),
        (
            LONG,
            "\n0,4,3,3",
            "\n0,4,3,1e13",
            {},
            "line 5 column y 1e13 number most 1e+12 | where instead",
        ),
        (
            LONG,
            "\n1,4,8,8",
            "\n1,2,8,8",
            {},
            "line 10 point 2 twice t = 1 | where instead",
        ),
        (
            LONG.replace("point", "other"),
            "\n0,4,3,3",
            "\n5,4,3,3",
            {},
            "line 2 4 points t = 0 most 5 times | where instead",
        ),
        (LONG, "x,y", "x,x", {}, "line 1 column x twice | where instead"),
        (LONG, "t,", "t_mm,", {}, "line 1 t_mm mm t s ms | where instead"),
        (
            WIDE,
            ",y1,x2,y2,x3,y3,x4,y4",
            "",
            {},
            "line 1 columns points columns t x0 y0 x1 CSV file | where because instead",
        ),
        (
            WIDE,
            "t,",
            "s,",
            {},
            "line 1 column t frame columns s x0 column time t | where because instead",
        ),
        (
            WIDE,
            "x0,y0",
            "x_0_mm,y_0_mm",
            {},
            "line 1 columns mm unit x y unit | where instead",
        ),
        (
            WIDE,
            "\n3,",
            "\n2,",
            {},
            "line 5 t = 2 twice rows | where instead",
        ),
        (
            WIDE,
            "\n3,",
            "\n1.5,",
            {},
            "line 5 t = 1.5 2 rows time | where instead",
        ),
        (
            WIDE,
            "t,",
            "frame,",
            {"points": ["3", "2", "1", "3", "4"]},
            "columns point twice | where instead",
        ),
        (
            WIDE,
            "",
            "",
            {"points": ["0", "1", "2", "3", "7"]},
            "7 | where instead",
        ),
        (
            WIDE,
            "",
            "",
            {"points": ["0", "1", "2", "3"]},
            "4 points body 5 1000 10 | where instead",
        ),
        (WIDE, "\n11,0,1,2,3,4,5,6,7,8,-2", "", {}, "11 frames | where instead"),
        (
            WIDE,
            "",
            "",
            {"fps": 50.0},
            "fps file frames file time | instead",
        ),
        (
            LONG,
            "x,y",
            "x_mm,y_mm",
            {"units": "cm"},
            "column x y mm units | where instead",
        ),
        (
            LONG,
            "x,y",
            "x_mm,y_mm",
            {"scale": 0.4},
            "scale pixels x y mm | where instead",
        ),
        (
            LONG,
            "",
            "",
            {"units": "cm", "scale": 0.4},
            "scale pixels x y cm | where instead",
        ),
        (TRACKS, "", "", {}, "2 animals b a | where instead"),
        (INDIVIDUALS, "", "", {}, "2 individuals one two | where instead"),
    ],
)
def test_bad_files_are_refused_by_place(text, old, new, options, said, tmp_path):
    (tmp_path / "f.csv").write_text(text.replace(old, new, 1))
    with refuses(said):
        reader.read(tmp_path / "f.csv", **options)


@pytest.mark.parametrize(
    ("columns", "options", "unit", "size", "note"),
    [
        ("x_mm,y_mm", {}, "m", 1e-3, ""),
        ("x,y", {"units": "cm"}, "m", 1e-2, ""),
        ("x_m,y_m", {"units": "m"}, "m", 1.0, ""),
        ("x_BL,y_BL", {}, "BL", 1.0, ""),
        ("x,y", {"units": "BL"}, "BL", 1.0, ""),
        ("x_px,y_px", {"scale": 0.4}, "m", 4e-4, ""),
        ("x,y", {"scale": 0.4}, "m", 4e-4, ""),
        ("x_px,y_px", {"units": "mm"}, "m", 1e-3, ""),
        ("x,y", {}, "", 1.0, "``units``"),
        ("x_px,y_px", {}, "", 1.0, "``scale``"),
    ],
)
def test_units_of_lengths_are_those_of_the_header_or_of_options(
    columns, options, unit, size, note, tmp_path
):
    (tmp_path / "f.csv").write_text(LONG.replace("x,y", columns))
    trial = reader.read(tmp_path / "f.csv", **options)
    assert trial.unit == unit
    np.testing.assert_allclose(trial.points[..., 0].ravel(), size * np.arange(60))
    assert note in "\n".join(trial.notes)


@pytest.mark.parametrize(("fps", "last"), [(50.0, 11 / 50), (None, 11)])
def test_times_are_those_of_frames(fps, last, tmp_path):
    (tmp_path / "f.csv").write_text(WIDE.replace("t,", "frame,"))
    trial = reader.read(tmp_path / "f.csv", fps=fps)
    assert (trial.t[-1], trial.timed) == (pytest.approx(last), fps is not None)


def test_points_are_taken_by_name_in_their_order_and_with_the_bodys_length(tmp_path):
    # In mm, of a body of which the points are half; a likelihood at the limit is
    # enough.
    scores = np.full((12, 6), 0.6)
    scores[3, 4] = 0.59
    x = np.arange(6) + 0.1 * np.arange(12)[:, None]
    y = 10 * np.arange(6) + 0 * x
    rows = np.stack([x, y, scores], -1).reshape(12, 18)
    names = ",".join(f"P{p}_x_mm,P{p}_y_mm,P{p}_likelihood" for p in range(6))
    table = np.column_stack([np.arange(12), rows, np.full(12, 7)])
    np.savetxt(
        tmp_path / "f.csv", table, "%.6g", ",", header=f"t,{names},more", comments=""
    )
    points = ["p5", "P4 ", "p3", "p2", "p0"]
    trial = reader.read(tmp_path / "f.csv", points=points, body_length=10.0, y="down")
    assert trial.length == pytest.approx(0.01)
    wanted = 1e-3 * np.stack([x, -y], -1)[:, [5, 4, 3, 2, 0]]
    wanted[3, 1] = np.nan
    np.testing.assert_allclose(trial.points, wanted, atol=1e-12)


@pytest.mark.parametrize(
    ("header", "midlines"),
    [
        (("scorer", "a", "b"), True),
        (("frame", "x", "y"), True),
        (("t", "coords", "alpha_1"), False),
        (("t", "x", "y", "theta"), False),
    ],
)
def test_heads_of_files_tell_midlines_from_logs(header, midlines):
    assert reader.is_midlines(header) == midlines


def test_a_given_length_of_the_body_has_no_error(noisy):
    result = trial_result(
        fit.fit_midlines(dataclasses.replace(noisy.trial(), length=1.2))
    )
    assert float(result["body_length"]) == 1.2 and result["body_length"].error is None


def test_notes_in_json_name_arguments_without_backticks(noisy, tmp_path):
    trial = noisy.trial().with_notes("give ``y`` up")
    result = trial_result(fit.fit_midlines(trial))
    result.save(tmp_path / "trial.json")
    for lines in (
        result.to_dict()["data_vars"]["note"]["data"],
        geomech.load_result(tmp_path / "trial.json")["note"].values.tolist(),
    ):
        assert "give y up" in lines


# Slips of tracking, and trials that do not tell.


def line_of(frames=40, count=11):
    """A straight body of length 1, tail at the origin and head at x = 1, that creeps
    along y."""
    x = np.linspace(0, 1, count)
    y = 1e-6 * np.arange(frames)[:, None]
    points = np.stack(np.broadcast_arrays(x, y), -1)
    return trial_of(np.arange(frames) / 10, points)


def at(places, value):
    """A change of a trial: its points at some places, (frames, points), have other
    values, or value(all of them)."""

    def change(trial):
        points = trial.points.copy()
        points[places] = value(points) if callable(value) else value
        return changed(trial, points)

    return change


def moved(wobble, move, jump):
    """A change: y wobbles from frame to frame, moves, and jumps in point 4 of frame
    20."""

    def change(trial):
        points = trial.points.copy()
        k = np.arange(len(points))[:, None]
        points[..., 1] += wobble * (-1.0) ** k + move * k
        points[20, 3, 1] = jump + 20 * move
        return changed(trial, points)

    return change


def turned_beside(aside):
    """A change: most frames run from the other end, so far beside the first."""
    return at(slice(12, None), lambda p: p[12:, ::-1] + [0.0, aside])


def bent_back(degrees):
    turn = np.exp(1j * np.radians(degrees) * (np.arange(10) >= 4))
    z = np.concatenate([[0], np.cumsum(turn)]) / 10
    return at(slice(None), lambda p: p + np.stack([z.real, z.imag], -1) - p[0])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (at(30, lambda p: 3.9 * p[30]), "jumps 0.29 | where instead"),
        (at(30, lambda p: p[30] / 3.9), "jumps 0.074 | where instead"),
        (
            at(30, lambda p: 4.1 * p[30]),
            "line 32 t = 3 body 4.1 times long most frames | where instead",
        ),
        (
            at(30, lambda p: p[30] / 4.1),
            "body 0.244 times long most frames | where instead",
        ),
        (at(30, lambda p: 12.9 * p[30]), "frames mm m another unit | where instead"),
        (at(30, lambda p: 13.1 * p[30]), "most frames | where instead"),
        (at(30, lambda p: p[30] / 129), "mm m | where instead"),
        (at(30, lambda p: p[30] / 132), "most frames | where instead"),
        (at(30, lambda p: 710 * p[30]), "mm m | where instead"),
        (bent_back(119), ""),
        (
            bent_back(121),
            "body turns back 4 5 6 most frames points | where because instead",
        ),
        (at((slice(20), 4), np.nan), ""),
        (
            at((slice(21), 4), np.nan),
            "trial.csv point 5 missing 52.5 % frames | where instead",
        ),
        (at((slice(None), 3), 0.0), "point 4 moves | where instead"),
        (
            at((slice(None), 4), lambda p: p[:, 3]),
            "points 4 5 coincide | where instead",
        ),
        (at((slice(20), [0, 1, 2, 3]), np.nan), ""),
        (turned_beside(0.25), ""),
        (
            turned_beside(0.22),
            "line 2 t = 0 12 frames body first | where instead",
        ),
        (moved(0.0, 0.0, 0.029), ""),
        (
            moved(0.0, 0.0, 0.031),
            "line 22 t = 2 point 4 jumps 0.031 body | where instead",
        ),
        (moved(0.01, 0.0, 0.079), ""),
        (moved(0.01, 0.0, 0.081), "jumps 0.081 | where instead"),
        (moved(0.0, 0.01, 0.089), ""),
        (moved(0.0, 0.01, 0.091), "jumps 0.091 | where instead"),
        (moved(0.0, 0.02, -0.25), "jumps 0.25 body | where instead"),
        (
            at((30, [2, 8]), lambda p: p[30, [8, 2]]),
            "line 32 t = 3 point 3 points 3 9 swap | where instead",
        ),
    ],
)
def test_slips_of_tracking_are_refused_by_place(change, said):
    with refuses(said):
        slips.checked(change(line_of()), False)


def turn_round(points):
    points[50:56] = points[50:56, ::-1]
    return points


@pytest.mark.parametrize(
    "change",
    [
        at((40, [4, 12]), lambda p: p[40, [12, 4]]),
        at(slice(None), turn_round),
        at((30, 7), lambda p: p[30, 7] + 0.3),
    ],
)
def test_a_trial_whose_slips_are_mended_is_the_trial(change, noisy):
    with refused("mend"):
        slips.checked(change(noisy.trial()), False)
    filled = smooth.filled(slips.checked(change(noisy.trial()), True))
    assert np.abs(filled.points - noisy.points).max() < 0.12


def standing(trial):
    """A body that bends to and fro in one shape."""
    s = np.linspace(-0.5, 0.5, 20)
    bend = np.sin(2 * np.pi * trial.t)[:, None]
    return trial_of(trial.t, np.stack([s - 0.4 * bend**2 * s**3, bend * s**2], -1))


def sized(size, **facts):
    """A change: points so much larger, with other facts."""
    return lambda t: dataclasses.replace(t, points=size * t.points, **facts)


def backwards(trial):
    """A body that is carried along its wave."""
    middle = trial.points.mean(1, keepdims=True)
    return changed(trial, trial.points - 2 * (middle - middle[0]))


def wandering(trial):
    """A body whose bends never repeat."""
    walk = np.cumsum(np.random.default_rng(0).normal(size=(3, len(trial.t), 1)), 1)
    a, b, c = 0.1 * walk
    s = np.linspace(-0.5, 0.5, 20) + 0 * a
    return trial_of(trial.t, np.stack([s, a * s**2 + b * s**3 + c * s**4], -1))


def rippling(trial):
    """A body along which, from the middle of the trial on, runs a shorter wave."""
    s = np.linspace(-0.5, 0.5, 20)
    waves = 1 + np.clip(2 * trial.t - 3, 0, 1)[:, None]
    y = 0.1 * np.sin(2 * np.pi * (waves * s + trial.t[:, None]))
    return trial_of(trial.t, np.stack([s + 0.3 * trial.t[:, None], y], -1))


def slower(by):
    """A change: a second of it takes so much longer."""
    return lambda t: dataclasses.replace(t, t=t.t + by * np.clip(t.t - 1.5, 0, 1))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (sized(120, unit="m"), "body 1 m long unit x y | where instead"),
        (sized(9e-5, unit="m"), "body m long | where instead"),
        (sized(2), "body body long unit | where instead"),
        (sized(0.69), "body 0.69 body | where instead"),
        (
            sized(1, length=0.7),
            "points 1 body 0.7 long body_length unit x y | where instead",
        ),
        (
            at((slice(None), [3, 20]), lambda p: p[:, [20, 3]]),
            "turns back | where because instead",
        ),
        (
            lambda t: frames_of(t, slice(None, None, 4)),
            "frames cycle few 10 | where instead",
        ),
        (
            lambda t: frames_of(t, slice(20)),
            "trial 0. cycles | where instead",
        ),
        (
            at(
                np.indices((133, 30)).sum(0) % 2 * (np.arange(133) > 9)[:, None] > 0,
                np.nan,
            ),
            "10 frames most | where instead",
        ),
        (standing, "body bends back shape | where because instead"),
        (
            backwards,
            "moves 1 point most head head first last | where because instead",
        ),
        (wandering, "body repeat cycle | where instead"),
        (
            rippling,
            "cycle t = 0.2371 1.215 repeat | where instead",
        ),
        (
            lambda t: frames_of(t, np.arange(133) % 30 < 20),
            "frames follow 0.367 cycle gap | where instead",
        ),
        (
            slower(2.0),
            "cycle t = 1.16 3.499 1.7 times long most | where instead",
        ),
    ],
)
def test_trials_that_do_not_tell_are_refused(change, said, noisy):
    with refuses(said):
        fit.fit_midlines(change(noisy.trial()), mend=True)


@pytest.mark.parametrize(
    "change",
    [
        sized(28, unit="m"),
        sized(1.1e-4, unit="m"),
        sized(1.38),
        sized(0.73),
        sized(1, length=0.73),
        sized(0.02, unit="m", length=0.1),
        slower(1.5),
        lambda t: frames_of(t, slice(None, None, 3)),
    ],
)
def test_trials_that_still_tell_are_fitted(change, noisy):
    assert fit.fit_midlines(change(noisy.trial())).used.size


def test_another_motion_within_a_trial_is_refused_by_its_times(noisy):
    other = synthetic.synthetic_midlines(GLASS, 1.5, 30, waves=2.4, swing=0.5, seed=1)
    shift = noisy.points[-1].mean(0) - other.points[0].mean(0)
    points = np.concatenate([noisy.points, other.points + shift])
    with refused("the motion pauses or changes after t = [45]"):
        fit.fit_midlines(trial_of(np.arange(len(points)) / 30, points), mend=True)


# Prediction.


def test_the_medium_of_the_trial_predicts_it_and_another_does_not(fitted):
    same = predicted.compare(fitted, LOOSE)
    both = np.hypot(same.measured_error, same.predicted_error)
    assert (np.abs(same.measured - same.predicted) < both).all()
    other = predicted.compare(fitted, MEDIA["glass-0.3mm-close"])
    less = other.measured - other.predicted
    sum_of_errors = other.measured_error + other.predicted_error
    speed = predicted.COMPARED.index("speed")
    assert less[speed] > sum_of_errors[speed]
    C, gamma0 = other.closing
    assert np.isnan(gamma0.value)
    closed = predicted.compare(fitted, dataclasses.replace(other.medium, C=C.value))
    assert closed.predicted[speed] == pytest.approx(closed.measured[speed], rel=0.02)


def test_a_piece_of_a_body_is_predicted_in_its_own_unit(noisy):
    # With and without the body's length the piece goes as far.
    piece = trial_of(noisy.t, noisy.points[:, 3:27])
    fits = [
        fit.fit_midlines(dataclasses.replace(piece, unit="m", length=length))
        for length in (1.0, None)
    ]
    long, short = (predicted.compare(f, LOOSE) for f in fits)
    speed, stride, efficiency = map(
        predicted.COMPARED.index, ("speed", "stride", "efficiency")
    )
    same = [speed, efficiency]
    np.testing.assert_allclose(long.predicted[same], short.predicted[same], rtol=1e-9)
    own = fits[1].value("body_length")[0]
    assert long.predicted[stride] == pytest.approx(
        own * short.predicted[stride], rel=0.002
    )


@pytest.mark.parametrize(
    ("level", "power", "bounds", "value", "root", "low", "high"),
    [
        (3.0, 0.5, (0.1, 10.0), 2.0, 3.0, 2 / 2**4, 2 * 2**2.0),
        (3.0, -0.5, (0.1, 10.0), 2.0, 3.0, 2 / 2**4, 2 * 2**2.0),
        (0.4, 0.5, (0.1, 100.0), 2.0, 0.4, 2 / 2**4.0, 2 * 2**5.5),
        (30.0, 1.0, (0.1, 10.0), 2.0, math.nan, 0.125, 8.0),
        (0.2, 1.0, (0.0, 900.0), 0.0, 0.2, 1e-3, 10**2.5),
        (7.0, 0.5, (0.1, 10.0), 2.0, 7.0, 2 / 2**4, 2 * 2**2.0),  # in the last interval
    ],
)
def test_the_value_that_closes_a_gap_is_a_root(
    level, power, bounds, value, root, low, high
):
    # Of a stride that is a power of a parameter, which a medium takes within
    # bounds.

    def gap(x):
        if not bounds[0] <= x <= bounds[1]:
            raise Refusal("beyond the bounds")
        return x**power - level**power

    found = predicted.closing_of("C", "rad", value, gap, 0.01, 1.0)
    assert (found.name, found.unit, found.present) == ("C", "rad", value)
    error = 0.01 / (abs(power) * level ** (power - 1)) * root / level
    np.testing.assert_allclose((found.value, found.error), (root, error), rtol=2e-3)
    np.testing.assert_allclose((found.low, found.high), (low, high), rtol=1e-12)


def test_of_several_roots_the_one_nearest_to_the_present_value_closes_a_gap():
    def wave(x):  # zero at powers of 8
        return math.sin(math.pi * math.log2(x) / 3)

    for value, root in ((3.0, 8.0), (2.0, 1.0)):
        found = predicted.closing_of("C", "-", value, wave, 0.1, 1.0)
        assert found.value == pytest.approx(root, rel=2e-3)


# What is said.


def test_the_command_compares_a_trial_with_a_medium(noisy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    synthetic.save("mid.csv", noisy)
    line = "fit-gait mid.csv --medium glass-0.3mm-close --plot mid.svg --json"
    code, out, _ = command(*line.split())
    found = of_json(out)
    assert not code
    assert float(found["speed_predicted"]) < float(found["speed"])
    assert "measured" in (tmp_path / "mid.svg").read_text()
