"""Measured midlines: closed forms, files as trackers write them, slips that are refused, coverage of intervals."""

import dataclasses
import json
import math
import re

import numpy as np
import pytest
from commands import geomech as command
from scipy.interpolate import CubicSpline
from scipy.io import netcdf_file
from scipy.special import ellipe

import geomech
from geomech.gaits import Sine
from geomech.measured.midlines import fit, intervals, kinematics, predicted, reader, smooth, synthetic
from geomech.measured.midlines.kinematics import QUANTITIES
from geomech.measured.midlines.trial import Trial
from geomech.scenes import Numerics, Scene
from geomech.studies.undulation import performance
from geomech.systems import Swimmer
from geomech.systems.swimmer import MEDIA
from rft import Backbone, Viscous
from rft.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = Swimmer(MEDIA["glass-0.3mm-loose"], Backbone(40))
USUAL, REPEATING = {"spread": 0.05, "jitter": 0.02}, {"spread": 0.0, "jitter": 0.0}
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
    return synthetic.made(GLASS, 3.3, 30, 16, noise=0.0, spread=0.0, jitter=0.0, seed=2)


@pytest.fixture(scope="module")
def noisy():
    return synthetic.made(GLASS, 4.4, 30, 30, seed=8)


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
    u = np.concatenate([[0.0], np.cumsum((np.hypot(1, rise)[1:] + np.hypot(1, rise)[:-1]) / 2 * np.diff(x))])
    t = np.arange(int(cycles * frames) + 1) / frames
    at = CubicSpline(u, x)(arc * (4 + t[:, None] + waves * np.linspace(0, 1, count)))
    z = wavelength * (at + 1j * amplitude * np.sin(2 * np.pi * at)) * np.exp(0.3j)
    return t, np.stack([z.real, z.imag], -1), wavelength


@pytest.mark.parametrize(("amplitude", "waves"), [(0.2, 1.0), (0.1, 1.6)])
def test_a_body_that_slides_along_a_sine_has_the_numbers_of_the_sine(amplitude, waves):
    t, points, wavelength = along_a_sine(amplitude, waves)
    f = fit.fit_midlines(dataclasses.replace(trial_of(t, points), unit="m"))
    expected = {"frequency": 1.0, "length": 1.0, "stride": wavelength, "heading": 0.3, "drift": 0.0, "turn": 0.0,
                "efficiency": 1.0, "wavelength": wavelength, "arc_wavelength": 1 / waves,
                "amplitude": amplitude * wavelength}  # fmt: skip
    for name, value in expected.items():
        assert f.value(name)[0] == pytest.approx(value, abs=0.012 * max(abs(value), 0.3)), name
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
    width, error = f.intervals.half_width[:n], (f.intervals.value - noiseless(exact))[:n]
    assert (np.abs(error) <= width + 2e-4).all() and width.max() < 0.04


# Files.


def test_heads_of_files_tell_midlines_from_logs():
    assert reader.is_midlines(("scorer", "a", "b")) and reader.is_midlines(("frame", "x", "y"))
    assert not reader.is_midlines(("t", "coords", "alpha_1")) and not reader.is_midlines(("t", "x", "y", "theta"))


def wide(trial, names=None, t="t", unit=""):
    names = names or [f"p{k + 1}" for k in range(trial.points.shape[1])]
    rows = [",".join([t, *(f"{n}_{c}{unit}" for n in names for c in "xy")])]
    return "\n".join(rows + [",".join(f"{v:.8g}" for v in (x, *p.ravel())) for x, p in zip(trial.t, trial.points)])


def deeplabcut(trial, score=0.99):
    """A film of 600 pixels, in which the body is 300 long and y runs down."""
    names = [f"part{k}" for k in range(trial.points.shape[1])]
    heads = {"scorer": ["net"] * 3, "bodyparts": None, "coords": ["x", "y", "likelihood"]}
    rows = [",".join([word, *(x for n in names for x in cells or [n] * 3)]) for word, cells in heads.items()]
    for k, p in enumerate(trial.points):
        cells = [f"{v:.8g}" for x, y in p for v in (100 + 300 * x, 700 - 300 * y, score)]
        rows.append(",".join([str(k), *cells]))
    return "\n".join(rows)


def long(trial, order=1):
    rows = [f"{t:.8g},{k + 1},{x:.8g},{y:.8g}" for t, p in zip(trial.t, trial.points) for k, (x, y) in enumerate(p)]
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
        (re.sub("(?m)^([^,]*),[^,]*,", r"\1,", long(exact)).replace("t,", "time,"), {}, 1.0),  # points have no numbers
        (re.sub("(?m)^([^,t]+)", lambda t: f"{1e3 * float(t[1]):.9g}", long(exact)).replace("t,", "t_ms,", 1), {}, 1.0),
    )
    for text, options, size in forms:
        file.write_text(text)
        trial = reader.read(file, **options)
        np.testing.assert_allclose(trial.points, exact.points * size, atol=1e-6)
        np.testing.assert_allclose(trial.t, exact.t, atol=1e-6)
        assert trial.unit == ("m" if size < 1 else "BL") and trial.timed
    file.write_text(deeplabcut(exact))
    trial = reader.read(file, fps=30.0, scale=0.4)
    assert trial.names[:2] == ("part0", "part1") and any("y is taken to run down" in x for x in trial.notes)
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
        ("t,point,x_BL,y_BL\n0,1,", "t,point,x_BL,y_BL\n0,1,one", "line 2, column x_bl"),
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
def test_slips_of_tracking_are_refused_by_place_and_mended_on_request(noisy, fitted, said):
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
    return lambda t: changed(t, lambda p: p.__setitem__(places, value(p) if callable(value) else value))


def standing(trial):
    """A body that bends to and fro in one shape."""
    s, bend = np.linspace(-0.5, 0.5, 20), np.sin(2 * np.pi * trial.t)[:, None]
    return trial_of(trial.t, np.stack([s - 0.4 * bend**2 * s**3, bend * s**2], -1))


def without(trial, left_out):
    kept = ~left_out
    return dataclasses.replace(trial, t=trial.t[kept], points=trial.points[kept], lines=trial.lines[kept])


def backwards(_):
    """A swimmer that its wave takes along, as where drag is less across the body than along it."""
    return synthetic.made(Swimmer(Viscous(0.4), Backbone(20)), 3.4, 30, 20).trial()


ALSO_REFUSED = {
    "the body bends in one shape to and fro": standing,
    "the body is 2.01 body lengths long": lambda t: dataclasses.replace(t, points=2 * t.points),
    "point 4 never moves": at((slice(None), 3), 0.0),
    "points 4 and 5 are in one place": at((slice(None), 4), lambda p: p[:, 3]),
    "10 frames have most of their points": at(np.indices((133, 30)).sum(0) % 2 * (np.arange(133) > 9)[:, None] > 0, np.nan),
    "line 542 .t = 0.6.: no frames for 0.2 after this one, and so in every cycle":
        lambda t: without(t, (np.arange(len(t.t)) >= 19) & ((np.arange(len(t.t)) - 19) % 30 < 5)),
    "the cycle from t = 1.168 to 3.542 takes 1.8 times as long as most":
        lambda t: dataclasses.replace(t, t=t.t + 2 * np.clip(t.t - 1.5, 0, 1)),
    "the body moves towards its point 1, and so does its wave": backwards,
}  # fmt: skip


@pytest.mark.parametrize("said", ALSO_REFUSED)
def test_trials_of_other_faults_are_refused(noisy, said):
    with pytest.raises(Refusal, match=said):
        fit.fit_midlines(ALSO_REFUSED[said](noisy.trial()), mend=True)


def test_another_motion_within_a_trial_is_refused_by_its_times(noisy, fitted):
    other = synthetic.made(GLASS, 1.5, 30, waves=2.4, swing=0.5, seed=1)
    shift = noisy.points[-1].mean(0) - other.points[0].mean(0)
    points = np.concatenate([noisy.points, other.points + shift])
    with pytest.raises(Refusal, match="the motion stands, or is another one, after t = [45]"):
        fit.fit_midlines(trial_of(np.arange(len(points)) / 30, points), mend=True)
    t = (cycles := fitted.cycles(fitted.curve)).tangent
    mirrored = dataclasses.replace(cycles, tangent=np.stack([*t[:2], t[2].conj(), t[3]]))
    with pytest.raises(Refusal, match=r"the cycle from t = 2\.\d+ to 3\.\d+ does not repeat .* \(correlation -0\.9"):
        fit._check_alike(fitted.trial, mirrored)


def test_the_head_is_found_from_the_motion_and_said(exact, noisy, fitted):
    found = fit.fit_midlines(noisy.trial().reversed())
    assert found.head.startswith("30, by the motion") and fitted.head.startswith("30")
    np.testing.assert_allclose(found.sample.value, fitted.sample.value, atol=1e-6)
    assert "tail first" in fit.fit_midlines(exact.trial(), head="first").head
    back = dataclasses.replace(exact.trial(), t=exact.t, points=exact.points[::-1])  # a film run backwards
    assert fit.fit_midlines(back).head.startswith("1,")


def test_missing_points_and_gaps_are_bridged_and_said(noisy, fitted):
    points = noisy.points.copy()
    points[np.random.default_rng(0).random(points.shape[:2]) < 0.05] = np.nan
    found = fit.fit_midlines(dataclasses.replace(noisy.trial(), points=points))
    assert (np.abs(found.intervals.value - fitted.intervals.value) <= fitted.intervals.half_width).all()
    some = np.sort(np.random.default_rng(1).choice(len(noisy.t), 100, replace=False))  # uneven in time
    t = noisy.trial()
    found = fit.fit_midlines(dataclasses.replace(t, t=t.t[some], points=t.points[some], lines=t.lines[some]))
    assert (np.abs(found.intervals.value - fitted.intervals.value) <= 1.5 * fitted.intervals.half_width).all()
    kept = np.r_[0:50, 62 : len(noisy.t)]
    gap = fit.fit_midlines(dataclasses.replace(t, t=t.t[kept], points=t.points[kept], lines=t.lines[kept]))
    assert len(gap.used) == len(fitted.used) - 1


def test_five_points_have_modes_enough(noisy, fitted):
    found = fit.fit_midlines(trial_of(noisy.t, noisy.points[:, [0, 7, 15, 22, 29]]))
    assert found.curve.modes == 4
    assert abs(found.value("speed")[0] - fitted.value("speed")[0]) < found.value("speed")[1]


def test_mirrored_trials_differ_in_the_sign_of_turns_alone(noisy, fitted):
    mirrored = fit.fit_midlines(dataclasses.replace(noisy.trial(), points=noisy.points * [1, -1]))
    sign = np.array([-1 if name in ("heading", "drift", "turn") else 1 for name in QUANTITIES])
    ours, theirs = (x.intervals.value[: len(QUANTITIES)] for x in (fitted, mirrored))
    assert (np.abs(theirs - sign * ours) < 0.3 * fitted.intervals.half_width[: len(QUANTITIES)]).all()


def test_two_animals_in_a_file_are_refused_and_tracks_are_no_points(exact, tmp_path):
    file, (head, *rows) = tmp_path / "trial.csv", wide(exact, t="frame_idx").splitlines()
    file.write_text("\n".join(["track," + head, *("a," + row for row in rows)]))
    assert reader.read(file, units="BL", fps=1.0).points.shape == exact.points.shape
    file.write_text("\n".join(["track," + head, *(f"{'ab'[k % 2]}," + row for k, row in enumerate(rows))]))
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
    return noiseless(synthetic.made(system, cycles, seed=99, noise=0.0, **options))


def noiseless(made):
    trial = smooth.filled(made._replace(points=made.exact).trial())
    curve = smooth.curve_of(trial, np.linspace(0, 1, trial.points.shape[1]), 14, 2)
    clock = kinematics.clock(curve, fit.period(trial))
    marks, used = fit.full_cycles(trial, curve, clock)
    each = kinematics.averages(fit.used_cycles(curve, clock, marks, used))
    return kinematics.quantities(each.weighted(np.full((1, len(used)), 1 / len(used))))[0]


def covered(system, known, seeds, cycles=8.4, frames=40, **options):
    """Errors and half widths (N, Q) of trials of 30 points with 1 % noise. The heading is that of the trial, to which the
    animal's drift is added."""
    errors, widths, k = [], [], QUANTITIES.index("heading")
    for seed in seeds:
        made = synthetic.made(system, cycles, frames, seed=seed, **options)
        f, own, expected = fit.fit_midlines(made.trial()), noiseless(made), known.copy()
        expected[k] = own[k] - own[k + 1] + known[k + 1]
        errors.append(f.intervals.value - expected)
        widths.append(f.intervals.half_width)
    return np.array(errors)[:, : len(QUANTITIES)], np.array(widths)[:, : len(QUANTITIES)]


def test_cycles_too_few_to_show_how_they_vary_are_noted():
    one, two, three = (fit._notes(np.zeros(count)) for count in (1, 2, 3))
    assert one[0].startswith("one full cycle") and two[0].startswith("two full cycles") and three == []


@pytest.mark.parametrize(
    ("variance", "alike", "width"), [(0.0, 0.0, 1.0), (0.3, 0.0, 1.32), (3.0, 0.0, 1.55), (30.0, 0.3, 1.6)]
)
def test_intervals_of_samples_whose_truth_is_zero(variance, alike, width):
    """Noise that ends one cycle too far begins the next too late: it is less in the mean than its scatter says."""
    rng, count, sigma = np.random.default_rng(0), 8, 0.7
    noise = lambda *lead: np.diff(sigma * rng.normal(size=(*lead, count + 1, 400)), axis=-2)
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    pseudo = np.sqrt(variance) * np.linalg.cholesky(alike**apart) @ rng.normal(size=(count, 400)) + noise()
    noisy, none = pseudo + noise(40), np.zeros(400)
    sample = intervals.Sample(pseudo.mean(0), pseudo, noisy.mean(1), noisy, none, np.zeros((40, 400)))
    found = intervals.intervals(sample, 0.95)
    assert 0.92 < (np.abs(found.value) <= found.half_width).mean() < 0.98
    assert np.median(found.noise) == pytest.approx(sigma * np.sqrt(2) / count, rel=0.05)
    deviation = np.sqrt(2 * sigma**2 / count**2 + variance / count)
    assert np.median(found.half_width) == pytest.approx(1.96 * width * deviation, rel=0.05)


@pytest.mark.parametrize(("copies", "least", "most"), [(1, 0.0, 0.2), (12, 0.6, 0.8)])
def test_contrasts_that_are_one_thing_seen_often_are_weak_evidence(copies, least, most):
    """Of 84 contrasts a mean square 1.5 times that of noise shows that cycles vary; of 7, twelve times over, it does not."""
    drawn = 2 * np.random.default_rng(0).normal(size=(400, 12 // copies, 7))
    assert least < intervals._repeating(np.full((12, 7), np.sqrt(1.5)), np.repeat(drawn, copies, 1)) < most


def test_noise_that_is_alike_from_frame_to_frame_is_found(noisy):
    """Noise of standard deviation 0.01 whose neighbours in time are correlated by 0.6."""
    fresh = np.random.default_rng(0).normal(size=noisy.points.shape)
    noise = 0.01 * smooth._alike(fresh, 0.6)
    f = fit.fit_midlines(noisy._replace(points=noisy.exact + noise).trial())
    assert f.curve.alike == pytest.approx(0.6, abs=0.03) and f.curve.noise == pytest.approx(0.01, rel=0.03)
    put_on = np.array([f.curve.noisy(np.random.default_rng(k)).coefficients - f.curve.coefficients for k in range(40)])
    slow = 0.01 * np.sqrt((1 + 0.6) / (1 - 0.6) / len(noisy.t))  # mean over the trial
    assert put_on.mean(1).std() == pytest.approx(slow, rel=0.1)


def test_more_modes_and_knots_are_taken_than_leave_an_error_beside_that_of_noise(exact, fitted):
    found, n = fitted.intervals, len(QUANTITIES)
    assert (found.smoothing < found.noise)[:n].all()
    few = dataclasses.replace(exact.trial(), points=exact.points[:, ::3], lines=exact.trial().lines[:, ::3])
    curve, few = smooth.fitted(smooth.filled(few), 1.0)
    assert (curve.modes, smooth.coarser(few, curve).modes) == (5, 4)


def test_bodies_are_taken_to_keep_their_length(fitted):
    alike = intervals.intervals(fitted.sample, 0.95).half_width / fitted.intervals.half_width
    assert alike[1] > 1.02 and (np.delete(alike, 1) == 1).all() and QUANTITIES[1] == "length"


def test_what_smoothing_cuts_off_is_judged_from_its_change():
    """A change of 0.7 that noise of 0.1 explains in small part, where 3 modes more leave a seventh."""
    rng, one = np.random.default_rng(0), np.ones((1, 50))
    noise = 0.1 * rng.normal(size=(4000, 50))
    sample = intervals.Sample(one[0], one, 1 + noise, (1 + noise)[:, None], 0.7 * one[0], 0.7 + noise)
    found = intervals.intervals(sample, 0.95)
    np.testing.assert_allclose(found.smoothing, np.sqrt(0.7**2 - 0.1**2), rtol=0.01)
    np.testing.assert_allclose(found.half_width, 1.96 * 0.7, rtol=0.02)


def test_intervals_cover_the_truth_in_a_few_trials():
    known = noiseless(synthetic.made(GLASS, 40, 30, seed=99, noise=0.0, **USUAL))
    error, width = covered(GLASS, known, range(2), 4.4, 30, **USUAL)
    assert (np.abs(error) <= width).mean() > 0.8


@pytest.mark.soak
@pytest.mark.parametrize("cycles", [3.5, 8.4])
@pytest.mark.parametrize("options", [REPEATING, USUAL, VARYING])
def test_intervals_cover_the_truth_in_90_to_98_percent(options, cycles):
    """Of 200 trials a share of 95 % has a standard error of 1.5 %. Turns of cycles that vary share their ends, as heading
    is what turns: few cycles do not show that, and their intervals are too wide."""
    error, width = covered(GLASS, truth(GLASS, **options), range(40000, 40200), cycles, **options)
    share, size = (np.abs(error) <= width).mean(0), np.median(width, 0) / 1.96 / np.sqrt((error**2).mean(0))
    print(options, cycles, *zip(QUANTITIES, share.round(3), size.round(2)), sep="\n")
    turn = QUANTITIES.index("turn")
    assert (share >= 0.9).all() and (np.delete(share, turn) <= 0.99).all()
    assert share[turn] <= 0.98 or (options["spread"] and size[turn] < 2.5)


# Prediction.


def test_the_medium_of_the_trial_predicts_it_and_another_does_not(fitted):
    same = predicted.compare(fitted, MEDIA["glass-0.3mm-loose"])
    apart = np.abs(same.measured - same.predicted) / np.hypot(same.measured_error, same.predicted_error)
    assert (apart < 1).all()
    other = predicted.compare(fitted, MEDIA["glass-0.3mm-close"])
    speed, slip = predicted.COMPARED.index("speed"), predicted.COMPARED.index("slip")
    assert other.predicted[speed] + other.predicted_error[speed] < other.measured[speed] - other.measured_error[speed]
    assert other.predicted[slip] > other.measured[slip]
    C, gamma0 = other.closing
    assert (C.name, gamma0.name) == ("C", "gamma0") and 1.5 < C.value < 2.0 and np.isnan(gamma0.value)
    assert 0.01 < C.error < 0.3
    closed = predicted.compare(fitted, dataclasses.replace(other.medium, C=C.value))
    assert closed.predicted[speed] == pytest.approx(closed.measured[speed], rel=0.02)


def test_the_command_prints_writes_and_draws(noisy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    synthetic.save("mid.csv", noisy)
    code, out, _ = command(
        "fit-gait", "mid.csv", "--medium", "glass-0.3mm-close", "-o", "mid.nc", "--plot", "mid.svg", "--json"
    )
    numbers = json.loads(out)
    assert not code and numbers["cycles"] == 4 and {*numbers["quantities"]} == {*QUANTITIES}
    speed = numbers["quantities"]["speed"]
    assert {x["unit"] for x in numbers["quantities"].values()} == {"Hz", "BL", "BL/s", "rad", "1"}
    assert math.hypot(*speed["standard_error"].values()) < speed["half_width"]
    assert (
        len(numbers["along"]["slip"]["value"]) == len(numbers["along"]["amplitude"]["half_width"]) == kinematics.PARTS
    )
    assert np.mean(numbers["per_cycle"]["speed"]) == pytest.approx(speed["value"], rel=0.01)
    assert numbers["predicted"]["speed"]["value"] < speed["value"] and numbers["predicted"]["heading"]["unit"] == "rad"
    C, gamma0 = numbers["closing"]
    assert C["tried"][0] < C["present"] < C["value"] < C["tried"][1] and 0 < C["half_width"] < 0.5
    assert gamma0["unit"] == "rad" and gamma0["value"] is None is gamma0["half_width"]
    with netcdf_file("mid.nc", mmap=False) as file:
        assert float(file.variables["speed"].data) == numbers["quantities"]["speed"]["value"]
        assert float(file.variables["speed_error"].data) == numbers["quantities"]["speed"]["half_width"]
        assert file.variables["slip_along"].shape == (kinematics.PARTS,)
    assert "measured" in (tmp_path / "mid.svg").read_text()
    found = geomech.fit_midlines("mid.csv", "glass-0.3mm-close")
    assert found["speed"][0] == numbers["quantities"]["speed"]["value"]
    assert "C = 1.305: " in repr(found) and "gives the measured distance" in repr(found) and "none from" in repr(found)
    assert found.to_xarray()["slip_along"].attrs["units"] == "rad"
    code, _, err = command("fit-gait", "mid.csv", "--degrees")
    assert code == 2 and "--degrees" in err
