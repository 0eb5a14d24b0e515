"""Bodies in the world, trajectories, films and strips: against kinematics drawn link by link and the direct tier."""

import contextlib
import os
import signal
import stat

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.layout_engine import ConstrainedLayoutEngine
from PIL import Image, ImageSequence
from registry import BODIES, SYSTEMS

from geomech import plots, scenes
from geomech.io import results as io
from geomech.mathematics.gaits import Circle, Ellipse, Fourier, Sine
from geomech.mathematics.geometry import reconstruct
from geomech.mathematics.systems import NoSlipSnake, Solver, Swimmer
from geomech.mathematics.systems.capabilities import solver_of
from geomech.plots import films
from geomech.plots.style import STYLE
from geomech.questions.swimmers.trajectory import Trajectory
from geomech.scenes import Numerics, Scene
from geomech.studies.mechanics import motion as moving
from geomech.studies.scene_tables import SceneTables
from rft import (
    Backbone,
    BodyInertia,
    Chain,
    ConstantCurvature,
    DepthProfile,
    Granular,
    Serpenoid,
    Transient,
    time_steps,
)
from rft.core.refusal import Refusal
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
SAND = Granular(1.8, 0.24)


def drawn(lengths, bends, length, frame, pose):
    """Ends of links (n + 1, 2) laid one after the other from the tail, then moved so that the frame is at the pose."""
    parts = length * np.array(lengths) / sum(lengths)
    headings = np.concatenate([[0.0], np.cumsum(bends)])
    ends = np.zeros((len(parts) + 1, 2))
    for k, part in enumerate(parts):
        ends[k + 1] = ends[k] + part * np.array(
            [np.cos(headings[k]), np.sin(headings[k])]
        )
    centres = (ends[1:] + ends[:-1]) / 2
    if frame == "mean":
        origin, heading = parts @ centres / length, parts @ headings / length
    else:
        origin, heading = centres[int(frame[5:]) - 1], headings[int(frame[5:]) - 1]
    x, y, theta = pose
    c, s = np.cos(theta - heading), np.sin(theta - heading)
    return (ends - origin) @ np.array([[c, s], [-s, c]]) + [x, y]


def bends_of(body, alpha):
    """Angles between elements, from what each body's docstring says."""
    if getattr(body, "modes", None) is not None:
        return np.asarray(alpha) @ body.modes
    if isinstance(body, Serpenoid):
        at = 2 * np.pi * body.waves * np.arange(1, body.elements) / body.elements
        return (alpha[0] * np.cos(at) + alpha[1] * np.sin(at)) / body.elements
    if isinstance(body, ConstantCurvature):
        curvature = (
            np.repeat(alpha, body.elements // body.sections)
            * body.sections
            / body.elements
        )  # of each element
        return (curvature[1:] + curvature[:-1]) / 2
    return alpha


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-2"])
@pytest.mark.parametrize("name", BODIES)
def test_points_are_the_links_in_the_world(name, frame):
    """Poses and shapes side by side, in every frame, to rounding."""
    import dataclasses

    rng = np.random.default_rng(0)
    for length in (1.0, 0.37):
        body = dataclasses.replace(BODIES[name], frame=frame, length=length)
        alpha, pose = (
            rng.uniform(-2, 2, (2, 3, body.joints)),
            rng.uniform(-4, 4, (3, 3)),
        )
        points = body.points(alpha, pose)
        lengths = getattr(body, "lengths", (1.0,) * getattr(body, "elements", 0))
        assert points.shape == (2, 3, len(lengths) + 1, 2)
        for at in np.ndindex(2, 3):
            expected = drawn(
                lengths, bends_of(body, alpha[at]), length, frame, pose[at[1]]
            )
            np.testing.assert_allclose(points[at], expected, atol=1e-13)
        np.testing.assert_allclose(
            body.points(alpha[1, 2], pose), body.points(alpha[1, 2:], pose), atol=1e-15
        )
        here = drawn(lengths, bends_of(body, alpha[0, 0]), length, frame, np.zeros(3))
        np.testing.assert_allclose(body.points(alpha[0, 0]), here, atol=1e-13)


def test_points_refuse_what_is_no_shape_or_pose():
    with pytest.raises(ValueError, match="alpha must have 2 angles last"):
        Chain((1, 2, 3)).points([0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match="pose must be"):
        Chain((1, 2, 3)).points([0.1, 0.2], [0.0, 1.0])


def test_poses_are_the_trajectory_at_the_samples():
    """Without rotation, with half turns and many turns a cycle, for few samples and even and odd numbers of them."""
    rng = np.random.default_rng(1)
    for n in (3, 8, 9, 40):
        xi = rng.normal(size=(6, n, 3))
        xi[..., 2] += np.array([0.0, 0.3, 0.5, -1.0, 3.2, 40.0])[:, None]
        xi[..., 2] -= np.array([1.0, 0, 0, 0, 0, 0])[:, None] * xi[..., 2].mean(
            -1, keepdims=True
        )
        found = reconstruct.poses(xi)
        np.testing.assert_allclose(
            found,
            reconstruct.trajectory(xi, 2 * np.pi * np.arange(n + 1) / n),
            atol=1e-12,
        )
        np.testing.assert_allclose(
            found[:, -1], reconstruct.displacement(xi), atol=1e-12
        )


def test_cycles_follow_one_another():
    path = np.random.default_rng(2).normal(size=(5, 3))
    path[0] = 0
    for cycles in (1, 2, 5, 8):
        end, expected = np.zeros(3), []
        for _ in range(cycles):
            expected += [se2.compose(end, pose) for pose in path[:-1]]
            end = se2.compose(end, path[-1])
        np.testing.assert_allclose(
            reconstruct.repeated(path, cycles), [*expected, end], atol=1e-12
        )


OVAL = Ellipse(semi_axes=(0.9, 0.5), centre=(0.2, -0.1), tilt=0.3)
ZIGZAG = Circle(amplitude=0.4, centre=(1.0, -1.0))
UNEVEN = Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
SLOPED = DepthProfile(slope_per_m=5.0, towards=0.4)
HEAVY = BodyInertia(mass=0.4, frequency=0.8, length=0.3, drag=1.3)
SCENES = {
    "swimmer": Scene(SYSTEMS["swimmer"], OVAL, Numerics(phases=33)),
    "no-slip": Scene(NoSlipSnake((0.8, 1.3, 1.0), 0.4, "link-1"), ZIGZAG, Numerics(phases=64)),
    "transient": Scene(Swimmer(SAND, UNEVEN, (Transient(travel_m=0.006),), Solver(pieces=3)), OVAL, Numerics(phases=16)),
    "heavy": Scene(Swimmer(SAND, UNEVEN, (HEAVY,)), OVAL, Numerics(phases=32)),
    "first cycle": Scene(Swimmer(SAND, UNEVEN, (HEAVY,), Solver(cycles=1)), OVAL, Numerics(phases=32)),
    "slope": Scene(Swimmer(SAND, UNEVEN, (SLOPED,), Solver(pieces=6)), OVAL, Numerics(phases=32)),
    "second on a slope": Scene(
        Swimmer(SAND, UNEVEN, (SLOPED,), Solver(pieces=6, cycles=2)), OVAL, Numerics(phases=32)
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_a_cycle_ends_where_the_direct_tier_says(name):
    scene = SCENES[name]
    n = scene.numerics.phases
    net = SceneTables(scene).poses("direct")
    one, two = moving.compute_motion(scene), moving.compute_motion(scene, 2)
    np.testing.assert_allclose(one.pose[-1], net, atol=1e-13)
    np.testing.assert_allclose(two.pose[:n], one.pose[:n], atol=1e-13)
    repeats = name in ("swimmer", "no-slip", "transient", "heavy")
    # The end of a cycle is foreseen, by an error of order 2 in 1/phases, where another follows it is solved for.
    np.testing.assert_allclose(two.pose[n], net, atol=1e-13 if repeats else 5e-3)
    np.testing.assert_array_equal(one.pose[0], 0.0)
    assert two.pose.shape == (2 * n + 1, 3) and two.cycles == 2
    np.testing.assert_allclose(
        two.phase, np.linspace(0, 4 * np.pi, 2 * n + 1), atol=1e-13
    )
    np.testing.assert_allclose(two.alpha, scene.gait.shape(two.phase), atol=1e-13)
    again = np.abs(two.pose[-1] - se2.compose(net, net)).max()
    assert (again < 1e-12) == repeats, again


@pytest.mark.parametrize("name", ["first cycle", "second on a slope"])
def test_where_cycles_differ_each_goes_on_from_the_one_before(name):
    """As time stepping has it, from the cycle that `displacement` gives."""
    scene = SCENES[name]
    system, n = scene.system, scene.numerics.phases
    last = {}
    for cycles in (solver_of(system).cycles, solver_of(system).cycles + 1):
        last[cycles] = time_steps(
            system.medium,
            system.body,
            *scene.gait.cycle(n),
            effects=system.effects,
            cycles=cycles,
            pieces=solver_of(system).pieces,
        ).pose
    ground = np.concatenate([last[cycles - 1][:-1], last[cycles]])
    expected = se2.compose(se2.inverse(ground[:1]), ground)
    np.testing.assert_allclose(
        moving.compute_motion(scene, 2).pose, expected, atol=1e-13
    )


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-3"])
def test_wheels_do_not_slip_in_the_world(frame):
    """Of the no-slip snake: centres of links move along their links, by differences of order 8 of the ends in the world."""
    snake = NoSlipSnake((0.8, 1.3, 1.0), 0.4, frame)
    found = moving.compute_motion(Scene(snake, ZIGZAG, Numerics(phases=256)), 2)
    ends = found.points()
    step, weights = found.phase[1], (4 / 5, -1 / 5, 4 / 105, -1 / 280)
    rate = (
        sum(
            w * (np.roll(ends, -k, 0) - np.roll(ends, k, 0))
            for k, w in enumerate(weights, 1)
        )
        / step
    )
    centre, along = (
        ((rate[:, 1:] + rate[:, :-1]) / 2)[4:-4],
        np.diff(ends, axis=1)[4:-4],
    )
    across = centre[..., 1] * along[..., 0] - centre[..., 0] * along[..., 1]
    assert np.abs(centre).max() > 0.02
    assert np.abs(across).max() < 1e-10
    lengths = np.broadcast_to(0.4 * np.array([0.8, 1.3, 1.0]) / 3.1, along.shape[:2])
    np.testing.assert_allclose(
        np.hypot(*np.moveaxis(along, -1, 0)), lengths, rtol=1e-12
    )


def at_bench(scene, hertz):
    object.__setattr__(scene.gait, "frequency", hertz)
    return scene


@pytest.mark.parametrize("name", ["swimmer", "no-slip", "second on a slope"])
def test_a_table_reads_back_with_every_digit(name, tmp_path):
    pandas = pytest.importorskip("pandas")
    found, path = moving.compute_motion(SCENES[name], 2), tmp_path / "out.csv"
    Trajectory(SCENES[name], 2).ask().save(path)
    frame = pandas.read_csv(path)
    numpy = np.genfromtxt(path, delimiter=",", names=True)
    assert list(frame.columns) == list(numpy.dtype.names)
    plain = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(frame.to_numpy(), plain, rtol=1e-15, atol=1e-300)
    columns = lambda *names: np.stack([numpy[name] for name in names], -1)
    np.testing.assert_array_equal(columns(*numpy.dtype.names), plain)
    np.testing.assert_array_equal(columns("x", "y", "heading"), found.pose)
    np.testing.assert_array_equal(columns("alpha_1", "alpha_2"), found.alpha)
    np.testing.assert_array_equal(numpy["phase"], found.phase)
    ends = columns(*(f"end_{k}_{axis}" for k in range(4) for axis in "xy"))
    np.testing.assert_array_equal(ends.reshape(-1, 4, 2), found.points())
    assert "time" not in frame.columns


def test_time_where_the_gait_has_a_frequency(tmp_path):
    scene = at_bench(scenes.parse(SCENE.format("")), 2.5)
    found = moving.compute_motion(scene, 3)
    np.testing.assert_allclose(found.time[-1], 3 / 2.5)
    result = Trajectory(scene, 3).ask()
    assert list(result.only("time", "x")) == ["phase", "time", "x"]
    times = found.phase / (2 * np.pi * 2.5)
    np.testing.assert_allclose(result["time"].values, times)
    titles = [ax.get_title("left") for ax in result.plot().axes]
    assert titles[1].endswith(f"t = {found.time[19]:.3g} s")


SCENE = """[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\nlengths = [1, 1.4, 0.8]\n
[gait]\nkind = "ellipse"\nsemi_axes = [0.8, 0.5]\n[numerics]\ngrid = 9\nphases = 32\n{}"""


def test_long_tables_are_written_piece_by_piece(monkeypatch, tmp_path):
    """Where fewer rows are held as text at a time than there are the file is the same."""
    result = Trajectory(SCENES["swimmer"], 2, mapped=False).ask()
    result.save(tmp_path / "whole.csv")
    monkeypatch.setattr(io, "ROWS_TOGETHER", 7)
    result.save(tmp_path / "pieces.csv")
    whole = (tmp_path / "whole.csv").read_text()
    assert whole.count("\n") == 68
    assert (tmp_path / "pieces.csv").read_text() == whole


@pytest.mark.parametrize("cycles", [1, 3])
def test_the_final_pose_says_what_a_symmetry_makes_zero(cycles):
    """A mirrored second half turns the body back; then, and after one cycle, x and y are
    those of all; else each cycle starts in a direction of its own."""
    mirrored = Trajectory(scenes.load("three-link-viscous"), cycles).ask()
    assert mirrored["final_heading"].zero.startswith("by symmetry, as")
    assert abs(float(mirrored["final_heading"])) < 1e-12
    assert not mirrored["final_x"].zero
    turning = Trajectory(SCENES["swimmer"], cycles).ask()
    assert not any(turning[f"final_{name}"].zero for name in ("x", "y", "heading"))
    for name in ("x", "y", "heading"):
        assert float(turning[f"final_{name}"]) == turning[name].values[-1]


def test_too_much_is_refused_before_it_begins(tmp_path):
    scene = scenes.load("sandfish-transient")
    for cycles in (0, 10_001, 1.5, True, "2", None):
        with pytest.raises(Refusal, match="whole number from 1 to 10000"):
            moving.compute_motion(scene, cycles)
    with pytest.raises(Refusal, match="a motion is that of a Scene, got 'sandfish'"):
        moving.compute_motion("sandfish")
    with pytest.raises(Refusal, match="say yes"):
        moving.cost(scene, 10_000).check("scene", False)
    moving.cost(scene, 10).check("scene", False)
    for name, balances in (
        ("swimmer", 33),
        ("slope", 100 * 32),
    ):  # cycles that repeat are solved once
        assert moving.cost(SCENES[name], 100).balances == balances
        assert (
            moving.cost(SCENES[name], 100).seconds
            > moving.cost(SCENES[name], 1).seconds
        )
    with pytest.raises(Refusal, match="say yes"):
        films.cost(256, 2000).check("scene", False)


@pytest.fixture(scope="module")
def chain():
    return Trajectory(scenes.parse(SCENE.format(""))).ask()


@pytest.fixture(scope="module")
def field(chain):
    return SceneTables(chain.question.scene).curvature


def test_a_film_shows_body_track_and_shape(chain, field):
    scene = chain.question.scene
    found = moving.compute_motion(scene, 2)
    shown = films.rows(32, 2)
    np.testing.assert_array_equal(
        shown, np.arange(100) * 32 // 50
    )  # 25 a second, 2 s a cycle
    np.testing.assert_array_equal(films.rows(100, 2, 1.0), np.arange(0, 200, 4))
    fig, put = plots.stage(Trajectory(scene, 2).ask(), shown)
    world, shapes = fig.axes[:2]
    for row in (0, 20, 51):
        behind, body, head, dot, text = put(row)
        np.testing.assert_array_equal(behind.get_xydata(), found.pose[: row + 1, :2])
        np.testing.assert_array_equal(body.get_xydata(), found.points()[row])
        np.testing.assert_array_equal(head.get_xydata(), found.points()[row, -1:])
        np.testing.assert_array_equal(dot.get_xydata(), found.alpha[row : row + 1])
        assert text.get_text() == f"cycle {row / 32:.2f}"
        assert body.axes is world and dot.axes is shapes
    (mesh,) = (c for c in shapes.collections if isinstance(c, QuadMesh))
    np.testing.assert_array_equal(np.ravel(mesh.get_array()), field.values[0].T.ravel())
    low, high = np.transpose([world.get_xlim(), world.get_ylim()])
    assert (found.points()[shown] > low).all() and (found.points()[shown] < high).all()
    assert (world.get_xlabel(), world.get_ylabel(), world.get_aspect()) == (
        "x (BL)",
        "y (BL)",
        1.0,
    )


@pytest.mark.parametrize(
    ("frequency", "cycle", "caption"),
    [
        (None, 2.0, "1 cycle = 2 s"),
        (1.0, 1.0, "real time"),
        (2.5, 0.4, "real time"),
        (3.0, 2 / 3, "0.5 × real time"),
        (20.0, 0.5, "0.1 × real time"),
        (0.1, 10.0, "real time"),
        (0.04, 5.0, "5 × real time"),
    ],
)
def test_films_are_in_real_time_or_tell_their_speed(frequency, cycle, caption):
    at = films.pace(frequency)
    assert (at.cycle, at.caption) == (pytest.approx(cycle), caption)
    shown = films.rows(256, 3, frequency)
    assert len(shown) / at.rate == pytest.approx(3 * cycle, abs=1.0 / at.rate)
    np.testing.assert_allclose(
        shown, np.arange(len(shown)) / at.rate / cycle * 256, atol=1.0
    )
    assert len(shown) <= 302


def test_the_caption_of_a_film_is_beside_its_clock(chain):
    fig, _ = plots.stage(chain, [0], caption="0.5 × real time")
    assert fig.axes[0].get_title("right") == "0.5 × real time"


def test_a_gif_shows_its_phases_and_takes_as_long_as_it_says(
    chain, tmp_path, monkeypatch
):
    told = []
    shown = lambda title: contextlib.nullcontext(told.append)
    monkeypatch.setattr(films, "progress_bar", shown)
    chain.save(tmp_path / "out.gif")
    with Image.open(tmp_path / "out.gif") as film:
        assert (
            film.n_frames in (32, 33) and len(told) == 50
        )  # a picture that is shown twice is stored once
        assert film.size == (800, 360)
        assert (
            sum(frame.info["duration"] for frame in ImageSequence.Iterator(film))
            == 2000
        )
        film.seek(0)
        first = np.array(film.convert("RGB"), int)
        film.seek(10)
        later = np.array(film.convert("RGB"), int)
    moved = (np.abs(later - first).sum(-1) > 60).any(0)
    assert moved[:400].any() and moved[400:].any()
    red = (
        np.abs(first - [209, 73, 91]).sum(-1) < 40
    )  # the head, and the point on the map
    assert red[:, :400].any() and red[:, 400:].any()
    assert told[-1] == 1.0


def test_a_strip_numbers_bodies_and_shapes_alike(chain, tmp_path):
    found = moving.compute_motion(chain.question.scene)
    fig = chain.plot()
    rows = np.linspace(0, 32, 6).round().astype(int)
    pictures = [ax for ax in fig.axes if "cycle" in ax.get_title("left")]
    assert len(pictures) == 6
    for k, (ax, row) in enumerate(zip(pictures, rows)):
        assert ax.get_title("left") == rf"$\bf{{{k + 1}}}$  cycle {row / 32:.2f}"
        np.testing.assert_array_equal(ax.lines[2].get_xydata(), found.points()[row])
        assert (ax.get_xlim(), ax.get_ylim()) == (
            pictures[0].get_xlim(),
            pictures[0].get_ylim(),
        )
    numbers = {
        t.get_text(): t.xy
        for ax in fig.axes
        for t in ax.texts
        if t.get_text().strip("0123456789,") == "" and t.get_text()
    }
    assert list(numbers) == ["1,6", "2", "3", "4", "5"]
    for k, xy in zip((0, 1, 2, 3, 4), numbers.values()):
        np.testing.assert_allclose(xy, found.alpha[rows[k]], atol=1e-8)
    plots.save(fig, tmp_path / "out.png")
    with Image.open(tmp_path / "out.png") as picture:
        assert picture.size[0] == round(7.2 * STYLE["savefig.dpi"])


WAVE = Fourier(sin=((0.8,), (0.1,), (0.0,)), cos=((0.0,), (0.5,), (0.8,)))
OTHERS = {
    "two links": Scene(Swimmer(SAND, Chain((1, 2))), Fourier(cos=((0.0,),), sin=((0.8,),)), Numerics(phases=16)),
    "four links": Scene(Swimmer(SAND, Chain((1, 2, 1, 1))), WAVE, Numerics(phases=16)),
    "backbone": Scene(Swimmer(SAND, Backbone(12, length=0.3)), Sine(elements=12), Numerics(phases=32)),
    "memory": Scene(Swimmer(SAND, UNEVEN, (Transient(travel_m=0.015),), Solver(cycles=1, pieces=8)), OVAL, Numerics(phases=16)),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
def test_systems_without_a_map_are_shown_all_the_same(name, tmp_path):
    found = moving.compute_motion(OTHERS[name], 2)
    result = Trajectory(OTHERS[name], 2).ask()
    fig, put = plots.stage(result, films.rows(found.scene.numerics.phases, 2))
    shapes, joints = fig.axes[1], found.scene.system.joints
    *_, mark, _ = put(found.scene.numerics.phases + 5)
    if joints == 2:
        np.testing.assert_array_equal(mark.get_xydata(), found.alpha[5:6])
        assert (
            shapes.get_xlim()[0]
            < found.alpha[:, 0].min()
            < found.alpha[:, 0].max()
            < shapes.get_xlim()[1]
        )
        assert (
            shapes.get_ylim()[0]
            < found.alpha[:, 1].min()
            < found.alpha[:, 1].max()
            < shapes.get_ylim()[1]
        )
    else:
        np.testing.assert_allclose(mark.get_xdata(), 5 / found.scene.numerics.phases)
        assert shapes.get_xlabel() == "phase (cycles)"
    if joints == 3:
        once = slice(0, found.scene.numerics.phases + 1)
        for k in range(3):
            np.testing.assert_array_equal(
                shapes.lines[k].get_ydata(), found.alpha[once, k]
            )
    if joints > plots.LINES:
        (mesh,) = (c for c in shapes.collections if isinstance(c, QuadMesh))
        curvature = (
            found.alpha[: found.scene.numerics.phases + 1].T * (joints + 1) / 0.3
        )
        np.testing.assert_allclose(
            np.reshape(mesh.get_array(), curvature.shape), curvature, rtol=1e-9
        )
        np.testing.assert_allclose(
            mesh.get_coordinates()[:, 0, 1], np.arange(1, joints + 1) / (joints + 1)
        )
        assert fig.axes[2].get_ylabel() == "curvature (rad/m)"
    plots.save(result.plot(), tmp_path / "out.png")


class Sled:
    """Nothing but a velocity."""

    joints, length = 2, 0.5

    def velocity(self, alpha, alphadot):
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        return np.stack(
            [
                alphadot[..., 0] ** 2,
                0.3 * alphadot[..., 1],
                alpha[..., 0] * alphadot[..., 1],
            ],
            -1,
        )


def test_a_system_without_a_body_is_an_arrow():
    scene = Scene(Sled(), OVAL, Numerics(phases=24))
    found = moving.compute_motion(scene)
    assert found.points() is None
    result = Trajectory(scene, mapped=False).ask()
    table = result.to_dataframe()
    assert list(table.columns) == ["x", "y", "heading", "alpha_1", "alpha_2"]
    _, put = plots.stage(result, films.rows(24, 1))
    body, (x, y, theta) = put(7)[1].get_xydata(), found.pose[7]
    np.testing.assert_allclose(body.mean(0), [x, y], atol=1e-14)
    np.testing.assert_allclose(
        body[1] - body[0], 0.5 * np.array([np.cos(theta), np.sin(theta)]), atol=1e-14
    )


FFMPEG = """#!/bin/sh
echo "$@" > "{folder}/said"
for last; do :; done
{does}
"""


def installed(folder, monkeypatch, does):
    """An ffmpeg of our own, and no other."""
    path = folder / "bin" / "ffmpeg"
    path.parent.mkdir()
    path.write_text(FFMPEG.format(folder=folder, does=does))
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{path.parent}{os.pathsep}/usr/bin{os.pathsep}/bin")


@pytest.fixture
def brief(monkeypatch):
    """Films of twelve pictures: a gif has all of them."""
    monkeypatch.setattr(films, "rows", lambda *_: np.arange(12))


@pytest.mark.usefixtures("brief")
def test_an_mp4_hands_its_pictures_to_ffmpeg(chain, tmp_path, monkeypatch):
    installed(tmp_path, monkeypatch, 'cat > "$last"')
    films.check_format(tmp_path / "out.mp4")
    laid_out = []
    monkeypatch.setattr(
        ConstrainedLayoutEngine, "execute", lambda *_: laid_out.append(True)
    )
    chain.save(tmp_path / "out.mp4")
    assert laid_out == [True]  # once, and stays for all pictures
    raw = np.fromfile(tmp_path / "out.mp4", np.uint8).reshape(12, 360, 800, 3)
    assert "-s 800x360" in (tmp_path / "said").read_text()
    assert (raw[0, 0, 0] == 255).all() and (raw[0] != raw[10]).any()


def test_an_mp4_says_what_it_lacks(chain, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        Refusal, match="takes ffmpeg, which is not installed; end the name in .gif"
    ):
        films.check_format(tmp_path / "out.mp4")


@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize(
    "does",
    [
        'cat > /dev/null; echo "first" >&2; echo "no such codec" >&2; exit 1',
        "echo no such codec >&2; exit 1",
    ],
)
def test_an_mp4_that_ffmpeg_refuses_is_not_left(does, chain, tmp_path, monkeypatch):
    installed(tmp_path, monkeypatch, does)
    with pytest.raises(
        Refusal,
        match=r"cannot write out.mp4: ffmpeg failed: no such codec; end the name in .gif",
    ):
        chain.save(tmp_path / "out.mp4")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bin", "said"]


@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize("ending", ["gif", "mp4"])
def test_a_film_that_is_stopped_leaves_nothing(ending, chain, tmp_path, monkeypatch):
    installed(tmp_path, monkeypatch, 'cat > "$last"')

    def stop(fraction):
        if fraction > 0.3:
            signal.raise_signal(signal.SIGINT)

    shown = lambda title: contextlib.nullcontext(stop)
    monkeypatch.setattr(films, "progress_bar", shown)
    before = signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # which a job in the background does not have
    try:
        with pytest.raises(KeyboardInterrupt):
            chain.save(tmp_path / f"out.{ending}")
    finally:
        signal.signal(signal.SIGINT, before)
    assert {p.name for p in tmp_path.iterdir()} <= {"bin", "said"}
