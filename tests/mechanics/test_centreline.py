"""Measured centrelines: what was measured comes back, to the order claimed; bad files
are refused by line."""

import dataclasses

import numpy as np
import pytest
from scipy.special import ellipe

from geomech import scenes
from geomech.mathematics.gaits import Centreline, Sine
from geomech.mathematics.gaits.waves import arc_to_phase
from geomech.studies.scene_tables import SceneTables
from rft import Backbone
from rft.core.notes import Note

pytestmark = pytest.mark.usefixtures("fastest")
T = np.linspace(0, 2 * np.pi, 97)
ELEMENTS = 40
HEADERS = {"curvature": "t,s,curvature", "points": "t,x,y", "numbered": "t,point,x,y"}


def sine_curvature(t, s, amplitude):
    """rad per body length of the wave of `Sine` at s (0 tail, 1 head), one wave on the
    body."""
    slope = 2 * np.pi * amplitude
    p = arc_to_phase(2 * np.pi * s + t, slope)
    arc = np.sqrt(1 + slope**2) * 4 * ellipe(slope**2 / (1 + slope**2))
    return -slope * np.sin(p) / (1 + (slope * np.cos(p)) ** 2) ** 1.5 * arc


def sine_points(t, s, amplitude):
    """The same body in the plane, complex, in units of lambda / 2 pi."""
    p = arc_to_phase(2 * np.pi * s + t, 2 * np.pi * amplitude)
    return p + 2j * np.pi * amplitude * np.sin(p)


def rows(kind, count=32, places=40, amplitude=0.1, noise=0.0, phases=None, seed=0):
    """Rows of one period of a sine, period 1; midlines somewhere else, turned, in every
    frame, 80 mm or so long."""
    rng, s = np.random.default_rng(seed), np.linspace(0, 1, places)
    for share in np.arange(count) / count if phases is None else phases:
        if kind == "curvature":
            values = sine_curvature(
                2 * np.pi * share, s, amplitude
            ) + noise * rng.normal(size=places)
            yield from ((share, *pair) for pair in zip(s, values))
            continue
        z = (
            12
            * np.exp(1j * rng.uniform(0, 6))
            * sine_points(2 * np.pi * share, s, amplitude)
            + 100 * rng.normal()
        )
        z += (
            noise
            * np.abs(np.diff(z)).sum()
            * (rng.normal(size=places) + 1j * rng.normal(size=places))
        )
        number = (
            [[k] for k in range(1, places + 1)] if kind == "numbered" else [[]] * places
        )
        yield from ((share, *n, x.real, x.imag) for n, x in zip(number, z))


def write(folder, kind, table=None, name="swim.csv", **sizes):
    lines = [
        ",".join(f"{x:.17g}" for x in row)
        for row in (rows(kind, **sizes) if table is None else table)
    ]
    path = folder / name
    path.write_text("\n".join(["# t in s, x and y in mm", HEADERS[kind], *lines, ""]))
    return path


def gait(path, **options):
    return Centreline(file=path, **{"elements": ELEMENTS, **options})


def off(path, amplitude=0.1, joints=slice(None), **options):
    """Largest error of the bends against `Sine`, as curvature, rad per body length."""
    exact = Sine(amplitude=amplitude, elements=ELEMENTS).shape(T)
    return np.abs(gait(path, **options).shape(T) - exact)[:, joints].max() * ELEMENTS


def order(errors, counts):
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


def test_order_in_frames(tmp_path):
    errors = []
    for n in (40, 80):
        path = write(tmp_path, "curvature", count=n, places=120, amplitude=0.05)
        errors.append(off(path, 0.05))
    assert order(errors, [40, 80]) == pytest.approx(4.0, abs=0.4)
    assert errors[-1] < 2e-6


@pytest.mark.parametrize("kind", ["curvature", "points"])
def test_order_along_the_body(kind, tmp_path):
    middle = []
    for n in (28, 112):
        path = write(tmp_path, kind, count=96, places=n + 1, amplitude=0.05)
        middle.append(off(path, 0.05, slice(10, -10)))
    assert order(middle, [28, 112]) == pytest.approx(4.0, abs=0.4)
    assert off(path, 0.05) < 5e-4


@pytest.fixture(scope="module")
def sandfish():
    """The built-in sandfish with fewer elements, and its displacement."""
    sine = {"body": Backbone(ELEMENTS), "gait": Sine(amplitude=0.2, elements=ELEMENTS)}
    scene = scenes.load("sandfish-loose").with_numerics(phases=64).changed(**sine)
    return scene, SceneTables(scene).poses("direct")


@pytest.mark.parametrize("kind", HEADERS)
def test_displacement_is_that_of_the_sine(kind, sandfish, tmp_path):
    scene, exact = sandfish
    measured = gait(write(tmp_path, kind, count=64, places=80, amplitude=0.2))
    found = SceneTables(scene).poses("direct", measured)
    np.testing.assert_allclose(found, exact, atol=1e-5)


def parabola(share, s):
    wave = 2 * np.pi * share
    return (2 * s - 1) * np.cos(wave) + 3 * (s - s**2) * np.sin(wave)


def test_smoothing_is_least_squares(tmp_path):
    """With data in the span of the modes the fit is exact, and noise is left with its
    share of the degrees of freedom, three modes times three functions of time among all
    the numbers."""
    phases = np.sort(np.random.default_rng(1).uniform(0, 1, 80))
    share, places = np.repeat(phases, 60), np.tile(np.linspace(0, 1, 60), 80)
    exact, noise = parabola(share, places), np.random.default_rng(2).normal(size=4800)
    options = {"period": 1.0, "keep_harmonics": 1, "keep_modes": 3}
    clean, noisy = (
        gait(write(tmp_path, "curvature", zip(share, places, values)), **options).shape(
            T - 2 * np.pi * phases[0]  # phase 0 is the first frame
        )
        for values in (exact, exact + 0.5 * noise)
    )
    # The mean of a parabola over an element on either side is its value and 1/24 of its
    # second derivative.
    told = parabola(T[:, None] / (2 * np.pi), np.arange(1, ELEMENTS) / ELEMENTS)
    told -= 6 * np.sin(T[:, None]) / 24 / ELEMENTS**2
    np.testing.assert_allclose(clean * ELEMENTS, told, atol=1e-10)
    left = np.sqrt(np.mean((noisy - clean) ** 2)) * ELEMENTS
    assert left == pytest.approx(0.5 * np.sqrt(9 / 4800), rel=0.4)


@pytest.mark.parametrize(
    "options",
    [{}, {"reverse": True}, {"keep_harmonics": 4, "keep_modes": 6, "reverse": True}],
)
def test_it_is_a_gait(options, tmp_path):
    path = write(tmp_path, "points", amplitude=0.2)
    made = gait(path, amplitude=0.7, **options)
    slope = (made.shape(T + 1e-5) - made.shape(T - 1e-5)) / 2e-5
    np.testing.assert_allclose(made.rate(T), slope, atol=1e-8)
    np.testing.assert_allclose(made.shape(0.0), made.shape(2 * np.pi), atol=1e-12)
    forwards = gait(path, **(options | {"reverse": False})).shape(
        -T if made.reverse else T
    )
    np.testing.assert_allclose(made.shape(T), 0.7 * forwards, atol=1e-14)


@pytest.mark.parametrize("kind", HEADERS)
def test_order_of_rows_and_marks_of_the_editor_do_not_matter(kind, tmp_path):
    path = write(tmp_path, kind)
    plain, (comment, header, *lines) = gait(path).shape(T), path.read_text().split("\n")
    # Without numbers the order within a frame is all there is: every frame's first row,
    # every frame's second ...
    across = np.reshape(lines[:-1], (32, 40)).T.ravel()
    mixed = across if kind == "points" else np.random.default_rng(0).permutation(across)
    path.write_bytes(
        "\r\n".join(["\ufeff" + comment, "", header.upper(), *mixed, "# end"]).encode()
    )
    np.testing.assert_array_equal(gait(path).shape(T), plain)


@pytest.mark.parametrize(
    ("repeats", "period"), [(True, None), (True, 1.0), (False, 1.0)]
)
def test_ways_to_give_the_period(repeats, period, tmp_path):
    """By a frame that repeats the first, or as an option; in any unit of time, from any
    start."""
    table = list(rows("points"))
    plain = gait(write(tmp_path, "points", table)).shape(T)
    table += later(table[:40], 1.0) * repeats
    slower = [(7e5 + 20 * t, *z) for t, *z in table]
    found = gait(write(tmp_path, "points", slower), period=period and 20.0)
    np.testing.assert_allclose(found.shape(T), plain, atol=1e-8)


def test_frames_need_not_be_equally_spaced(tmp_path):
    phases = np.arange(64) / 64
    phases[1:] += 0.005 * np.random.default_rng(0).uniform(-1, 1, 63)
    path = write(tmp_path, "curvature", phases=phases, places=100)
    assert off(path, period=1.0) < 2e-3


def test_equal_if_the_file_is(tmp_path):
    first = gait(write(tmp_path, "points"))
    assert first == gait(write(tmp_path, "points"))
    assert first != gait(write(tmp_path, "points", amplitude=0.12))  # the same path
    with pytest.raises(ValueError, match="does not match sha256"):
        dataclasses.replace(first, amplitude=0.5)


SCENE = """
[medium]
name = "glass-0.3mm-loose"
[body]
kind = "backbone"
elements = 40
[gait]
kind = "centreline"
file = "data/swim.csv"
elements = 40
"""


def test_file_lies_beside_the_scene(tmp_path, monkeypatch):
    for name in ("data", "elsewhere"):
        (tmp_path / name).mkdir()
    path = write(tmp_path / "data", "points")
    (tmp_path / "snake.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path / "elsewhere")
    found = scenes.load("../snake.toml").gait
    np.testing.assert_array_equal(found.shape(T), gait(path).shape(T))


def edited(kind, edit, **sizes):
    """A writer of a file whose rows went through ``edit``."""
    table = list(rows(kind, **{"count": 12, "places": 12, **sizes}))
    return lambda path: write(path.parent, kind, edit(table))


def without(test):
    return lambda table: [row for row in table if not test(row)]


def later(table, by):
    return [(row[0] + by, *row[1:]) for row in table]


def with_repeats(count, more):
    """Rows of two periods and a part of a third, or of one and a part, at so many
    frames a period."""

    def edit(table):
        periods = [*table, *later(table, 1.0)] if more > 1 else table
        return [*periods, *later(table, float(1 + (more > 1)))[:48]]

    return edited("points", edit, count=count)


PHASES = np.arange(12) / 12
POINTS = edited("points", list)
BAD = {  # what makes the file, options, and what is said
    "point lost": (
        edited("numbered", lambda t: [*t[:15], *t[16:]]),
        {},
        "line 15: the frame .* has no point = 4",
    ),
    "point twice": (
        edited("numbered", lambda t: [*t, t[3]]),
        {},
        "line 147: t = 0, point = 4 is given twice",
    ),
    "few places": (
        edited("curvature", without(lambda row: 0.1 < row[1] < 0.99)),
        {},
        "line 3: .* t = 0 has 3 values of s",
    ),
    "many frames": (
        lambda path: path.write_text(
            "t,s,curvature\n" + "".join(f"{t},0,0\n" for t in range(10001))
        ),
        {},
        "4 to 10000 .*got 10001",
    ),
    "length": (
        edited("points", lambda t: [*t[:24], *t[28:]]),
        {},
        "line 27: the midline at t = 0.1666.* is 0.6",
    ),
    "turned round": (
        edited("points", lambda t: [*t[:36], *t[36:48][::-1], *t[48:]]),
        {},
        "t = 0.25 appears to run from head to tail",
    ),
    "half": (edited("points", lambda t: t[:84]), {}, "the gait does not close"),
    "not closed": (
        edited("points", lambda t: t[:84]),
        {"period": 0.55},
        "the gait does not close",
    ),
    "uneven": (
        edited("points", without(lambda row: row[0] == 0.25)),
        {},
        "not equally spaced in t: give period",
    ),
    "nearly": (
        edited("points", list, phases=[*PHASES * 0.985, 0.985]),
        {},
        "almost repeats .*give period",
    ),
    "same time": (
        edited("points", list, phases=[*PHASES, 1e-9]),
        {"period": 1.0},
        "after t = 0 follows at almost the same",
    ),
    "two": (
        edited("points", lambda t: [*t, *later(t, 1.0)]),
        {},
        "the motion repeats after 1 in t, 2 times within the period of 2: give the",
    ),
    "two and repeated": (
        edited("numbered", lambda t: [*t, *later(t, 1.0), *later(t[:12], 2.0)]),
        {"period": 2.0},
        "2 times within the",
    ),
    "two and a half": (with_repeats(8, 1.5), {}, "2.5 times within the period of 2.5"),
    "one and a half": (
        with_repeats(8, 0.5),
        {},
        "the frame at t = 1 repeats the first, and 3 more",
    ),
    "one and a quarter": (
        with_repeats(16, 0.25),
        {},
        "the frame at t = 1 repeats the first, and 3 more frames follow",
    ),
    "few elements": (
        POINTS,
        {"elements": 2},
        "elements must be a whole number from 3 to 2000",
    ),
    "half an element": (
        POINTS,
        {"elements": 3.5},
        "elements must be a whole number from 3 to 2000",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused(name, tmp_path):
    make, options, said = BAD[name]
    make(tmp_path / "swim.csv")
    with pytest.raises(ValueError, match=said):
        gait(tmp_path / "swim.csv", **options)


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_a_wave_to_the_head_is_noted(noise, tmp_path):
    table = list(rows("curvature", count=16, amplitude=0.2, noise=noise))
    gait(write(tmp_path, "curvature", table))  # warnings are errors here
    table = [(t, 1 - s, -value) for t, s, value in table]
    path = write(tmp_path, "curvature", table)
    with pytest.warns(Note, match="the wave runs from the tail to the head, .* from"):
        gait(path)
    gait(path, reverse=True)


@pytest.mark.parametrize("share", [1.0, 0.25])
def test_a_standing_wave_runs_nowhere_and_a_pause_is_no_end(share, tmp_path):
    """One bends and stretches again, in a part of the period or all of it."""
    bends = np.sin(np.pi * np.minimum(np.arange(24) / 24 / share, 1)) ** 2
    places = np.linspace(0, 1, 12)
    table = [
        (k / 24, x, 5 * bends[k] * np.cos(3 * x)) for k in range(24) for x in places
    ]
    gait(write(tmp_path, "curvature", table))


VALUES = [
    "nan",
    "",
    "0",
    "-1",
    "1e12",
    "1e-320",
    "0.5",
    "x",
    "1,2",
    "#",
    "0.0833333333333",
    "1e400",
    "٣",
]


def mutated(rng, text):
    """Text with one or two lines moved or values replaced."""
    lines = [line.split(",") for line in text.split("\n")]
    for _ in range(rng.integers(1, 3)):
        row = rng.integers(1, len(lines))
        if rng.random() < 0.3:
            lines.insert(rng.integers(1, len(lines)), lines.pop(row))
        else:
            lines[row][rng.integers(len(lines[row]))] = VALUES[rng.integers(13)]
    return "\n".join(map(",".join, lines))


def test_mutated_files_run_or_are_refused(tmp_path):
    """Any warning is an error in the tests: nothing but a gait or a ValueError of one
    line comes out."""
    rng, said = np.random.default_rng(0), []
    for k in range(60):
        path = write(tmp_path, list(HEADERS)[k % 3], count=8, places=6)
        path.write_text(mutated(rng, path.read_text()))
        options = {"keep_modes": k % 4, "keep_harmonics": k % 3}
        try:
            made = gait(path, period=[None, 1.0][k % 2], **options)
            assert np.isfinite(made.cycle(16)).all()
        except ValueError as error:
            said.append(str(error))
    assert 5 < len(said) < 55
    assert all(line.startswith("swim.csv") and "\n" not in line for line in said)


@pytest.mark.parametrize(
    "line",
    [
        "root:x:0:0:secret",
        "secret",
        "password = secret",
        "t;secret",
        "secret,x",
        "[secret]",
    ],
)
def test_files_that_do_not_look_like_ours_are_not_quoted(line, tmp_path):
    (tmp_path / "theirs").write_text(f"{line}\nmore secret\n")
    with pytest.raises(ValueError, match="header must be t,s,curvature or") as caught:
        Centreline(file=str(tmp_path / "theirs"))
    assert "secret" not in str(caught.value)
