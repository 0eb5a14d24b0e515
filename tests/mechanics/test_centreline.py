"""Measured centrelines: what was measured comes back, to the order claimed; bad files are refused by line."""

import dataclasses
import json

import numpy as np
import pytest
from commands import geomech
from scipy.special import ellipe
from tabled import swept_table

from geomech import scenes
from geomech.core.errors import Note, UnitWarning
from geomech.mathematics.gaits import Centreline, Sine
from geomech.mathematics.gaits.waves import arc_to_phase
from geomech.studies.displacement.sweep import sweep
from geomech.studies.scene_tables import SceneTables
from rft import Backbone
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
T = np.linspace(0, 2 * np.pi, 97)
ELEMENTS = 40
HEADERS = {"curvature": "t,s,curvature", "points": "t,x,y", "numbered": "t,point,x,y"}


def sine_curvature(t, s, amplitude):
    """rad per body length of the wave of `Sine` at s (0 tail, 1 head), one wave on the body."""
    slope = 2 * np.pi * amplitude
    p = arc_to_phase(2 * np.pi * s + t, slope)
    arc = np.sqrt(1 + slope**2) * 4 * ellipe(slope**2 / (1 + slope**2))
    return -slope * np.sin(p) / (1 + (slope * np.cos(p)) ** 2) ** 1.5 * arc


def sine_points(t, s, amplitude):
    """The same body in the plane, complex, in units of lambda / 2 pi."""
    p = arc_to_phase(2 * np.pi * s + t, 2 * np.pi * amplitude)
    return p + 2j * np.pi * amplitude * np.sin(p)


def rows(kind, count=32, places=40, amplitude=0.1, noise=0.0, phases=None, seed=0):
    """Rows of one period of a sine, period 1; midlines somewhere else, turned, in every frame, 80 mm or so long."""
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
    """A CSV file, and its path."""
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
    """Largest error of the bends against `Sine`, as curvature in rad per body length."""
    exact = Sine(amplitude=amplitude, elements=ELEMENTS).shape(T)
    return np.abs(gait(path, **options).shape(T) - exact)[:, joints].max() * ELEMENTS


def order(errors, counts):
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


def test_order_in_frames(tmp_path):
    counts = [20, 40, 80]
    errors = [
        off(write(tmp_path, "curvature", count=n, places=120, amplitude=0.05), 0.05)
        for n in counts
    ]
    assert order(errors, counts) == pytest.approx(4.0, abs=0.4)
    assert errors[-1] < 2e-6


@pytest.mark.parametrize("kind", ["curvature", "points"])
def test_order_along_the_body(kind, tmp_path):
    """4 in the middle of the body, no less than 3 at the ends."""
    spacings, middle, whole = np.array([28, 56, 112]), [], []
    for n in spacings:
        path = write(tmp_path, kind, count=112, places=n + 1, amplitude=0.05)
        middle.append(off(path, 0.05, slice(10, -10)))
        whole.append(off(path, 0.05))
    assert order(middle, spacings) == pytest.approx(4.0, abs=0.4)
    assert order(whole, spacings) > 3
    assert whole[-1] < 5e-4


@pytest.fixture(scope="module")
def sandfish():
    """The built-in sandfish with fewer elements, and its displacement."""
    full = scenes.load("sandfish-loose").with_numerics(phases=64)
    made = full.changed(
        body=Backbone(ELEMENTS), gait=Sine(amplitude=0.2, elements=ELEMENTS)
    )
    return made, SceneTables(made).poses("direct")


@pytest.mark.parametrize("kind", HEADERS)
def test_displacement_is_that_of_the_sine(kind, sandfish, tmp_path):
    made, exact = sandfish
    measured = gait(write(tmp_path, kind, count=64, places=80, amplitude=0.2))
    np.testing.assert_allclose(
        SceneTables(made).poses("direct", measured), exact, atol=1e-5
    )
    assert exact[0] > 0.3


@pytest.mark.parametrize(("kind", "noise"), [("curvature", 0.5), ("points", 1e-3)])
def test_smoothing_recovers_the_displacement(kind, noise, sandfish, tmp_path):
    """Noise of 5 % of the largest curvature, or of a thousandth of the body in every point; rms of two trials."""
    made, exact = sandfish
    paths = [
        write(
            tmp_path,
            kind,
            name=f"{k}.csv",
            count=64,
            places=50,
            amplitude=0.2,
            noise=noise,
            seed=k,
        )
        for k in range(2)
    ]

    def error(**options):
        poses = np.array(
            [SceneTables(made).poses("direct", gait(path, **options)) for path in paths]
        )
        return np.sqrt(np.mean((poses - exact)[:, :2] ** 2) * 2)

    plain = error()
    assert plain > 0.01
    assert error(keep_harmonics=5) < min(0.005, plain / 2)
    assert error(keep_harmonics=7, keep_modes=14) < min(0.006, plain / 2)


def test_smoothing_is_least_squares(tmp_path):
    """With data in the span of the modes the fit is exact, and noise is left with its share of the degrees of freedom,
    three modes times three functions of time among all the numbers."""
    phases, s = (
        np.sort(np.random.default_rng(1).uniform(0, 1, 80)),
        np.linspace(0, 1, 60),
    )
    curvature = lambda share, s: (
        (2 * s - 1) * np.cos(2 * np.pi * share)
        + 3 * (s - s**2) * np.sin(2 * np.pi * share)
    )
    share, places = np.repeat(phases, 60), np.tile(s, 80)
    options = {"period": 1.0, "keep_harmonics": 1, "keep_modes": 3}
    exact, noise = (
        curvature(share, places),
        0.5 * np.random.default_rng(2).normal(size=4800),
    )
    clean = gait(write(tmp_path, "curvature", zip(share, places, exact)), **options)
    t, joint = (
        T - 2 * np.pi * phases[0],
        np.arange(1, ELEMENTS) / ELEMENTS,
    )  # phase 0 is the first frame
    # The mean of a parabola over an element on either side is its value and 1/24 of its second derivative.
    told = (
        curvature(T[:, None] / (2 * np.pi), joint)
        - 6 * np.sin(T[:, None]) / 24 / ELEMENTS**2
    )
    np.testing.assert_allclose(clean.shape(t) * ELEMENTS, told, atol=1e-10)
    noisy = gait(
        write(tmp_path, "curvature", zip(share, places, exact + noise)), **options
    )
    left = np.sqrt(np.mean((noisy.shape(t) - clean.shape(t)) ** 2)) * ELEMENTS
    assert left == pytest.approx(0.5 * np.sqrt(9 / 4800), rel=0.4)


def test_modes_of_points_are_those_of_curvature(tmp_path):
    """Arcs of a circle: one mode is all there is."""
    s, table = np.linspace(-0.5, 0.5, 30), []
    for share in np.arange(40) / 40:
        k = 0.3 + np.cos(2 * np.pi * share)
        table += [(share, z.real, z.imag) for z in np.expm1(1j * k * s) / (1j * k)]
    found = (
        gait(write(tmp_path, "points", table), keep_modes=1, keep_harmonics=1).shape(T)
        * ELEMENTS
    )
    np.testing.assert_allclose(
        found, np.repeat(0.3 + np.cos(T)[:, None], ELEMENTS - 1, 1), atol=2e-5
    )


@pytest.mark.parametrize(
    "options",
    [{}, {"reverse": True}, {"keep_harmonics": 4, "keep_modes": 6, "reverse": True}],
)
def test_it_is_a_gait(options, tmp_path):
    made, h = (
        gait(write(tmp_path, "points", amplitude=0.2), amplitude=0.7, **options),
        1e-5,
    )
    slope = (made.shape(T + h) - made.shape(T - h)) / (2 * h)
    np.testing.assert_allclose(made.rate(T), slope, atol=1e-8)
    np.testing.assert_allclose(made.shape(0.0), made.shape(2 * np.pi), atol=1e-12)
    alpha, alphadot = made.cycle(16, [0.5, 2.0])
    assert alpha.shape == alphadot.shape == (2, 16, ELEMENTS - 1)
    np.testing.assert_allclose(alpha[1], 4 * alpha[0], atol=1e-14)
    np.testing.assert_allclose(
        made.shape(T),
        0.7 * dataclasses.replace(made, amplitude=1.0).shape(T),
        atol=1e-14,
    )
    forwards = dataclasses.replace(made, reverse=False)
    np.testing.assert_allclose(
        made.shape(T), forwards.shape(-T if made.reverse else T), atol=1e-14
    )
    assert made.amplitude_label == "amplitude of the centreline (scale)"


@pytest.mark.parametrize("kind", HEADERS)
def test_order_of_rows_and_marks_of_the_editor_do_not_matter(kind, tmp_path):
    path = write(tmp_path, kind)
    plain, (comment, header, *lines) = gait(path).shape(T), path.read_text().split("\n")
    # Without numbers the order within a frame is all there is: every frame's first row, every frame's second ...
    across = np.reshape(lines[:-1], (32, 40)).T.ravel()
    mixed = across if kind == "points" else np.random.default_rng(0).permutation(across)
    path.write_bytes(
        "\r\n".join(["\ufeff" + comment, "", header.upper(), *mixed, "# end"]).encode()
    )
    np.testing.assert_array_equal(gait(path).shape(T), plain)


def test_ways_to_give_the_period(tmp_path):
    plain = gait(write(tmp_path, "points")).shape(T)
    again = [
        *rows("points"),
        *((1.0, *row[1:]) for row in rows("points") if row[0] == 0),
    ]
    for table, period in ((again, None), (again, 1.0), (list(rows("points")), 1.0)):
        np.testing.assert_allclose(
            gait(write(tmp_path, "points", table), period=period).shape(T),
            plain,
            atol=1e-12,
        )
        slower = [(7e5 + 20 * t, *z) for t, *z in table]
        found = gait(write(tmp_path, "points", slower), period=period and 20.0)
        np.testing.assert_allclose(found.shape(T), plain, atol=1e-8)
    uneven = np.arange(64) / 64 + 0.005 * np.random.default_rng(0).uniform(
        -1, 1, 64
    ) * (np.arange(64) > 0)
    assert (
        off(write(tmp_path, "curvature", phases=uneven, places=100), period=1.0) < 2e-3
    )


def test_equal_if_the_file_is(tmp_path):
    first, second = gait(write(tmp_path, "points")), gait(write(tmp_path, "points"))
    assert first == second
    assert hash(first) == hash(second)
    assert first != gait(write(tmp_path, "points", amplitude=0.12))  # the same path
    with pytest.raises(ValueError, match="not the one whose sha256 is given"):
        dataclasses.replace(first, amplitude=0.5)
    np.testing.assert_array_equal(
        first.shape(T), second.shape(T)
    )  # a gait that has been read keeps what it has read


@pytest.mark.parametrize("share", [0.24, 0.26])
def test_a_quarter_of_the_period_without_a_frame_is_too_much(share, tmp_path):
    phases = [*np.linspace(0, 1 - share, 20)]
    path = write(tmp_path, "curvature", phases=phases)
    if share < 0.25:
        assert np.isfinite(gait(path, period=1.0).shape(T)).all()
    else:
        with pytest.raises(
            ValueError,
            match="after t = 0.74 there is no frame for 0.26 of the period, more than 0.25",
        ):
            gait(path, period=1.0)


@pytest.mark.parametrize(
    ("first", "last", "good"),
    [
        (1e-6, 1, True),
        (1.001e-6, 1, False),
        (-1.001e-6, 1, False),
        (0, 1 + 9.99e-7, True),
        (0, 1 - 1.001e-6, False),
    ],
)
def test_ends_of_the_body_may_be_off_by_a_millionth(first, last, good, tmp_path):
    path = write(
        tmp_path,
        "curvature",
        [(t, {0: first, 1: last}.get(s, s), k) for t, s, k in rows("curvature")],
    )
    if good:
        assert off(path) < 1e-3
    else:
        with pytest.raises(ValueError, match="s must run from 0"):
            gait(path)


SCENE = """
[medium]
name = "glass-0.3mm-loose"
[body]
kind = "backbone"
elements = {n}
[gait]
kind = "centreline"
file = "data/swim.csv"
elements = {n}
{more}
[numerics]
phases = 64
"""


def scene_in(folder, n=ELEMENTS, more=""):
    (folder / "data").mkdir()
    (folder / "snake.toml").write_text(SCENE.format(n=n, more=more))
    return folder / "snake.toml"


def test_file_lies_beside_the_scene(tmp_path, monkeypatch):
    toml = scene_in(tmp_path)
    write(tmp_path / "data", "points", count=64, places=80)
    (tmp_path / "elsewhere").mkdir()
    code, out, err = geomech(
        "displacement", "../snake.toml", "--amplitudes", "1", cwd=tmp_path / "elsewhere"
    )
    assert (code, err) == (0, "")
    made = scenes.load(toml)
    sine = SceneTables(made).poses("direct", Sine(amplitude=0.1, elements=ELEMENTS))
    rows = [line.split() for line in out.splitlines()]
    (x,) = (row[1] for row in rows if row[:1] == ["1"])
    assert float(x) == pytest.approx(sine[0], abs=5e-5)  # its last digit
    with pytest.raises(Refusal, match="cannot read"):
        scenes.parse(toml.read_text())
    monkeypatch.chdir(tmp_path)
    assert scenes.parse(toml.read_text()).gait == made.gait


def test_sweeps_are_taken_up_only_with_the_same_file(tmp_path, monkeypatch):
    from geomech.studies.displacement import cycles, sweep

    toml, partial = scene_in(tmp_path, 12), tmp_path / "partial"
    write(tmp_path / "data", "points", count=12, places=20)
    over = {"body.length": [1.0, 2.0]}
    swept_table(sweep.sweep(scenes.load(toml), over, partial))
    calls, solve = [], cycles._rows
    monkeypatch.setattr(
        cycles, "_rows", lambda *some: calls.append(some) or solve(*some)
    )
    swept_table(sweep.sweep(scenes.load(toml), over, partial))
    assert calls == []
    write(tmp_path / "data", "points", count=12, places=20, amplitude=0.11)
    swept_table(sweep.sweep(scenes.load(toml), over, partial))
    assert calls
    swept = swept_table(
        sweep.sweep(
            scenes.load(toml), {"body.length": [1.0, 2.0], "gait.amplitude": [0.5, 1.0]}
        )
    )
    assert np.isfinite(swept["displacement"]).all()


def edited(kind, edit, **sizes):
    """A writer of a file whose rows went through ``edit``."""
    table = list(rows(kind, **{"count": 12, "places": 12, **sizes}))
    return lambda path: write(path.parent, kind, edit(table))


def text(content):
    return lambda path: path.write_bytes(
        content if isinstance(content, bytes) else content.encode()
    )


def huge(path):
    with path.open("wb") as file:
        file.truncate(200_000_000)


def good(path):
    write(path.parent, "points", count=12, places=12)


def at(k, *row):
    """The table with row k replaced."""
    return lambda table: [*table[:k], row, *table[k + 1 :]]


def without(test):
    return lambda table: [row for row in table if not test(row)]


def later(table, by):
    return [(row[0] + by, *row[1:]) for row in table]


def twice(table):
    return [*table, *later(table, 1.0)]


CURVE, POINTS = "t,s,curvature\n", "t,x,y\n"
BAD = {
    "missing": (lambda path: None, "", "cannot read .*No such file"),
    "folder": (lambda path: path.mkdir(), "", "cannot read .*no ordinary file"),
    "bytes": (text(b"\x89\xfe\x00\x01"), "", "cannot read .*not text"),
    "huge": (huge, "", "cannot read .*larger than 100 MB"),
    "empty": (text(""), "", "swim.csv, line 1: the header must be t,s,curvature or"),
    "header": (text("# mm\n\ntime,x,z\n0,0,0\n"), "", "line 3: the header must be .*it has 'time, x, z'"),
    "no rows": (text(CURVE), "", "4 to 10000 frames .*got 0"),
    "word": (text(CURVE + "0,0,1\n0,one,2\n"), "", "line 3: a row must be 3 finite numbers .*got '0,one,2'"),
    "nan": (text(POINTS + "0,0,nan\n"), "", "line 2: a row must be 3 finite numbers"),
    "inf": (text(POINTS + "0,-inf,1\n"), "", "line 2: a row must be 3 finite numbers"),
    "too large": (text(POINTS + "0,1e200,1\n"), "", "line 2: a row must be 3 finite numbers"),
    "short row": (text(POINTS + "0,1\n"), "", "line 2: a row must be 3 finite numbers"),
    "grid": (edited("curvature", lambda t: [*t[:29], *t[30:]]), "", "line 27: the frame at .* has no s = 0.4545"),
    "point lost": (edited("numbered", lambda t: [*t[:15], *t[16:]]), "", "line 15: the frame .* has no point = 4"),
    "twice": (edited("curvature", lambda t: [*t, t[20]]), "", "line 147: t = 0.08333.* s = 0.7272.* is given twice"),
    "point twice": (edited("numbered", lambda t: [*t, t[3]]), "", "line 147: t = 0, point = 4 is given twice"),
    "few frames": (edited("points", lambda t: t[:36]), "", "4 to 10000 frames .*got 3"),
    "many frames": (text(CURVE + "".join(f"{t},0,0\n" for t in range(10001))), "", "4 to 10000 .*got 10001"),
    "few points": (edited("points", lambda t: t[:-9]), "", "line 135: the frame at t = 0.9166.* has 3 points"),
    "few places": (edited("curvature", without(lambda row: 0.1 < row[1] < 0.99)), "", "line 3: .* t = 0 has 3 values of s"),
    "same point": (edited("points", lambda t: [*t[:31], t[30], *t[31:]]), "", "line 34: the point is where its neigh"),
    "span": (edited("curvature", without(lambda row: row[1] == 0)), "", "s must run from 0 .* got 0.0909.* to 1"),
    "bend": (edited("curvature", at(30, 2 / 12, 6 / 11, 90.0)), "", "t = 0.1666.* and s = 0.583 .* bend by .* elements"),
    "turn": (edited("points", lambda t: [*t[:29], t[30], t[29], *t[31:]]), "", "line 3[2-4]: the midline turns by"),
    "length": (edited("points", lambda t: [*t[:24], *t[28:]]), "", "line 27: the midline at t = 0.1666.* is 0.6"),
    "turned round": (
        edited("points", lambda t: [*t[:36], *t[36:48][::-1], *t[48:]]), "", "t = 0.25 seems to run from head to tail"
    ),
    "half": (edited("points", lambda t: t[:84]), "", "the gait does not close"),
    "not closed": (edited("points", lambda t: t[:84]), "period = 0.55", "the gait does not close"),
    "not repeated": (edited("points", lambda t: t[:84]), "period = 0.5", "the gait does not close"),
    "too long": (edited("points", list), "period = 0.5", "run over 0.9166.* in t, more than period = 0.5"),
    "gap": (edited("points", list), "period = 2", "after t = 0.9166.* there is no frame for 0.5[0-9]* of the period"),
    "uneven": (edited("points", without(lambda row: row[0] == 0.25)), "", "not equally spaced in t: give period"),
    "nearly": (
        edited("points", list, phases=[*np.arange(12) / 12 * 0.985, 0.985]), "", "all but repeats .*give period"
    ),
    "same time": (
        edited("points", list, phases=[*np.arange(12) / 12, 1e-9]), "period = 1", "after t = 0 comes at almost the same"
    ),
    "centre": (good, "centre = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]", "takes no centre"),
    "harmonics": (good, "keep_harmonics = 6", "from 0 to 5 for these 12 frames, got 6"),
    "modes": (good, "keep_modes = 7", "from 0 to 6 for 12 places, got 7"),
    "period": (good, "period = 0", "period must be a number from"),
    "sha256": (good, 'sha256 = "0"', "not the one whose sha256 is given"),
    "two": (edited("points", twice), "", "the body does the same again after 1 in t, 2 times in the period of 2: give the"),
    "two and repeated": (
        edited("numbered", lambda t: [*twice(t), *([2.0, *row[1:]] for row in t[:12])]), "period = 2", "2 times in the"
    ),
    "two and a half": (
        edited("points", lambda t: [*twice(t), *later(t, 2.0)[:48]], count=8), "", "2.5 times in the period of 2.5"
    ),
    "one and a half": (
        edited("points", lambda t: [*t, *later(t, 1.0)[:48]], count=8), "", "the frame at t = 1 repeats the first, and 3 more"
    ),
    "one and a quarter": (
        edited("points", lambda t: [*t, *later(t, 1.0)[:48]], count=16), "",
        "the frame at t = 1 repeats the first, and 3 more come",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_files_get_one_line(name, tmp_path):
    make, more, said = BAD[name]
    toml = scene_in(tmp_path, 12, more)
    make(tmp_path / "data" / "swim.csv")
    with pytest.raises(ValueError, match=said):
        scenes.load(toml)
    code, out, err = geomech("displacement", toml, "--amplitudes", "1")
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize("kind", ["curvature", "points"])
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_wave_to_the_head_is_noted(kind, noise, tmp_path):
    """As of points that were given from the head, unless it is asked for."""
    table = list(
        rows(
            kind,
            count=16,
            amplitude=0.2,
            noise=noise * {"curvature": 0.5, "points": 1e-3}[kind],
        )
    )
    gait(write(tmp_path, kind, table))  # warnings are errors here
    if kind == "points":
        table = [
            row for k in range(0, len(table), 40) for row in table[k : k + 40][::-1]
        ]
    else:
        table = [(t, 1 - s, -value) for t, s, value in table]
    path = write(tmp_path, kind, table)
    with pytest.warns(
        Note,
        match="^swim.csv: the wave runs from the tail to the head, .* give the points from the tail",
    ):
        gait(path)
    gait(path, reverse=True)


def test_a_standing_wave_runs_nowhere_and_a_pause_is_no_end(tmp_path):
    """One bends and stretches again, in a part of the period or all of it."""
    s = np.linspace(0, 1, 12)
    for share in (1.0, 0.25):
        bend = [np.sin(np.pi * min(t / share, 1)) ** 2 for t in np.arange(24) / 24]
        gait(
            write(
                tmp_path,
                "curvature",
                [
                    (k / 24, x, 5 * b * np.cos(3 * x))
                    for k, b in enumerate(bend)
                    for x in s
                ],
            )
        )


@pytest.mark.parametrize(
    ("column", "frequency"),
    [("t", 2.0), ("t", 1.02), ("t", None), ("frame", 2.0), ("phase", 2.0)],
)
def test_a_frequency_that_is_not_that_of_t_is_noted(column, frequency, tmp_path):
    path = write(tmp_path, "points")
    path.write_text(path.read_text().replace("t,x,y", f"{column},x,y"))
    if (column, frequency) != ("t", 2.0):
        gait(path, frequency=frequency)
        return
    with pytest.warns(
        UnitWarning,
        match="^swim.csv: the period is 1 in t, and frequency = 2 Hz makes it 0.5 s: mend one",
    ):
        gait(path, frequency=frequency)


def test_what_an_estimate_leaves_out_is_told(tmp_path):
    """Of midlines that noise has moved by ten times the estimate and more."""
    toml, said = (
        scene_in(tmp_path, 12),
        "of the computation alone: what the measured midlines are off by is not in it",
    )
    write(tmp_path / "data", "points", count=12, places=20)
    for more in ([], ["--json"]):
        told = geomech("displacement", toml, "--amplitudes", "1", *more)[1]
        assert (
            json.loads(told)["attrs"]["error_is"] == said
            if more
            else f" estimated error: {said} " in " ".join(told.split())
        )
    measured = SceneTables(scenes.load(toml))
    swept = lambda scene: sweep(scene, {"gait.amplitude": [1.0]}).attributes
    assert (
        measured.displacements([1.0], ["direct"]).to_xarray().attrs["error_is"] == said
    )
    assert said in measured.displacements([1.0], ["direct"])._repr_html_()
    assert swept(measured.scene)["error_is"] == said
    plain = scenes.load("sandfish-loose").with_numerics(phases=32)
    assert "error_is" not in swept(plain)


@pytest.mark.parametrize("elements", [2, 2001, 3.5, "x"])
def test_elements_are_refused(elements, tmp_path):
    with pytest.raises(
        ValueError, match="elements must be a whole number from 3 to 2000"
    ):
        gait(write(tmp_path, "points"), elements=elements)


def test_mutated_files_run_or_are_refused(tmp_path):
    """Any warning is an error in the tests: nothing but a gait or a ValueError of one line comes out."""
    rng, ran, said = np.random.default_rng(0), 0, []
    values = [
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
    for k in range(60):
        path = write(tmp_path, list(HEADERS)[k % 3], count=8, places=6)
        lines = [line.split(",") for line in path.read_text().split("\n")]
        for _ in range(rng.integers(1, 3)):
            row = rng.integers(1, len(lines))
            if rng.random() < 0.3:
                lines.insert(rng.integers(1, len(lines)), lines.pop(row))
            else:
                lines[row][rng.integers(len(lines[row]))] = values[
                    rng.integers(len(values))
                ]
        path.write_text("\n".join(map(",".join, lines)))
        try:
            made = gait(
                path, period=[None, 1.0][k % 2], keep_modes=k % 4, keep_harmonics=k % 3
            )
        except ValueError as error:
            said.append(str(error))
            continue
        ran += 1
        assert np.isfinite(made.cycle(16)).all()
    assert 5 < ran < 55
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
    (tmp_path / "data").mkdir()
    path = tmp_path / "data" / "theirs"
    path.write_text(f"{line}\nmore secret\n")
    with pytest.raises(
        ValueError, match="the header must be t,s,curvature or"
    ) as caught:
        Centreline(file=str(path))
    assert "secret" not in str(caught.value)
    path.write_text("t,s,kappa\n0,0,0\n")
    with pytest.raises(ValueError, match="it has 't, s, kappa'"):
        Centreline(file=str(path))
