"""Bodies in the world, trajectories, films and strips, against kinematics drawn link by
link and the direct tier."""

import contextlib
import dataclasses
import os
import signal

import numpy as np
import pytest
from PIL import Image, ImageSequence
from registry import BODIES, SYSTEMS

from geomech import plots
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import reconstruct
from geomech.mathematics.systems import NoSlipSnake, Solver, Swimmer
from geomech.mathematics.systems.capabilities import solver_of
from geomech.plots import films
from geomech.questions.swimmers.trajectory import Trajectory
from geomech.scenes import Numerics, Scene
from geomech.studies.mechanics.motion import compute_motion
from geomech.studies.scene_tables import SceneTables
from rft import (
    BodyInertia,
    Chain,
    ConstantCurvature,
    DepthProfile,
    Granular,
    LeggedChain,
    Serpenoid,
    Transient,
    time_steps,
)
from rft.core.refusal import Refusal
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
SAND = Granular(1.8, 0.24)


def drawn(lengths, bends, length, frame, pose):
    """Return the ends of links (n + 1, 2), laid one after the other from the tail and
    moved so that the frame is at the pose."""
    parts = length * np.array(lengths) / sum(lengths)
    headings = np.concatenate([[0.0], np.cumsum(bends)])
    steps = parts[:, None] * np.stack([np.cos(headings), np.sin(headings)], -1)
    ends = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, 0)])
    centres = (ends[1:] + ends[:-1]) / 2
    weights = parts / length
    if frame != "mean":
        weights = np.arange(1, len(parts) + 1) == int(frame[5:])
    turn = pose[2] - weights @ headings
    c, s = np.cos(turn), np.sin(turn)
    return (ends - weights @ centres) @ np.array([[c, s], [-s, c]]) + pose[:2]


def bends_of(body, alpha):
    """Return the angles between elements, from what each body's docstring says."""
    if getattr(body, "modes", None) is not None:
        return np.asarray(alpha) @ body.modes
    if isinstance(body, Serpenoid):
        s = 2 * np.pi * body.waves * np.arange(1, body.elements) / body.elements
        return (alpha[0] * np.cos(s) + alpha[1] * np.sin(s)) / body.elements
    if isinstance(body, ConstantCurvature):
        n_each = body.elements // body.sections
        curvature = np.repeat(alpha, n_each) / n_each  # of each element
        return (curvature[1:] + curvature[:-1]) / 2
    if isinstance(body, LeggedChain):
        return alpha[:-1]
    return alpha


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-2"])
@pytest.mark.parametrize("length", [1.0, 0.37])
@pytest.mark.parametrize("name", BODIES)
def test_points_are_the_links_in_the_world(name, length, frame):
    body = dataclasses.replace(BODIES[name], frame=frame, length=length)
    lengths = getattr(body, "lengths", (1.0,) * getattr(body, "elements", 0))
    rng = np.random.default_rng(0)
    alpha = rng.uniform(-2, 2, (2, 3, body.joints))
    pose = rng.uniform(-4, 4, (3, 3))
    points = body.points(alpha, pose)
    for k in np.ndindex(2, 3):
        bends = bends_of(body, alpha[k])
        expected = drawn(lengths, bends, length, frame, pose[k[1]])
        np.testing.assert_allclose(points[k], expected, atol=1e-13)


@pytest.mark.parametrize("n", [3, 8, 9, 40])
def test_poses_are_the_trajectory_at_the_samples(n):
    xi = np.random.default_rng(1).normal(size=(6, n, 3))
    xi[..., 2] += np.array([0.0, 0.3, 0.5, -1.0, 3.2, 40.0])[:, None]
    poses = reconstruct.poses(xi)
    phases = 2 * np.pi * np.arange(n + 1) / n
    path = reconstruct.trajectory(xi, phases)
    np.testing.assert_allclose(poses, path, atol=1e-12)


OVAL = Ellipse(semi_axes=(0.9, 0.5), centre=(0.2, -0.1), tilt=0.3)
ZIGZAG = Circle(amplitude=0.4, centre=(1.0, -1.0))
UNEVEN = Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
SLOPED = DepthProfile(slope_per_m=5.0, towards=0.4)
HEAVY = BodyInertia(mass=0.4, frequency=0.8, length=0.3, drag=1.3)


def uneven(effect, phases=32, **solver):
    system = Swimmer(SAND, UNEVEN, (effect,), Solver(**solver))
    return Scene(system, OVAL, Numerics(phases=phases))


REPEATING = {
    "swimmer": Scene(SYSTEMS["swimmer"], OVAL, Numerics(phases=33)),
    "no-slip": Scene(
        NoSlipSnake((0.8, 1.3, 1.0), 0.4, "link-1"), ZIGZAG, Numerics(phases=64)
    ),
    "transient": uneven(Transient(travel_m=0.006), 16, pieces=3),
    "heavy": uneven(HEAVY),
}
CHANGING = {
    "first cycle": uneven(HEAVY, cycles=1),
    "slope": uneven(SLOPED, pieces=6),
    "second on a slope": uneven(SLOPED, pieces=6, cycles=2),
}
SCENES = {**REPEATING, **CHANGING}


@pytest.mark.parametrize("name", SCENES)
def test_a_cycle_ends_where_the_direct_tier_says(name):
    scene = SCENES[name]
    n = scene.numerics.phases
    net = SceneTables(scene).poses("direct")
    one = compute_motion(scene)
    two = compute_motion(scene, 2)
    np.testing.assert_allclose(one.pose[-1], net, atol=1e-13)
    np.testing.assert_allclose(two.pose[:n], one.pose[:n], atol=1e-13)
    # The end of a cycle is foreseen, with an error of order 2 in 1/phases; where
    # another cycle follows it is solved for.
    tolerance = 1e-13 if name in REPEATING else 5e-3
    np.testing.assert_allclose(two.pose[n], net, atol=tolerance)
    again = se2.compose(net, one.pose)
    is_repeated = np.allclose(two.pose[n:], again, rtol=0, atol=1e-12)
    assert is_repeated == (name in REPEATING)


@pytest.mark.parametrize("name", ["first cycle", "second on a slope"])
def test_where_cycles_differ_each_goes_on_from_the_one_before(name):
    """As time stepping has it, from the cycle that `displacement` gives."""
    system = SCENES[name].system
    solver = solver_of(system)
    cycle = SCENES[name].gait.cycle(SCENES[name].numerics.phases)
    options = {"effects": system.effects, "pieces": solver.pieces}
    first, second = (
        time_steps(system.medium, system.body, *cycle, cycles=n, **options).pose
        for n in (solver.cycles, solver.cycles + 1)
    )
    ground = np.concatenate([first[:-1], second])
    expected = se2.compose(se2.inverse(ground[:1]), ground)
    motion = compute_motion(SCENES[name], 2)
    np.testing.assert_allclose(motion.pose, expected, atol=1e-13)


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-3"])
def test_wheels_do_not_slip_in_the_world(frame):
    """Centres of links move along their links, by differences of order 8 of their
    ends."""
    snake = NoSlipSnake((0.8, 1.3, 1.0), 0.4, frame)
    motion = compute_motion(Scene(snake, ZIGZAG, Numerics(phases=256)), 2)
    ends = motion.points()
    rate = 0.0
    for k, weight in enumerate((4 / 5, -1 / 5, 4 / 105, -1 / 280), 1):
        rate += weight * (np.roll(ends, -k, 0) - np.roll(ends, k, 0)) / motion.phase[1]
    centre = ((rate[:, 1:] + rate[:, :-1]) / 2)[4:-4]
    along = np.diff(ends, axis=1)[4:-4]
    across = centre[..., 1] * along[..., 0] - centre[..., 0] * along[..., 1]
    assert np.abs(across).max() < 1e-10 < 0.02 < np.abs(centre).max()


TURNING = Ellipse(semi_axes=(0.8, 0.5))
BODY = Chain((1, 1.4, 0.8))
SMALL = Scene(Swimmer(SAND, BODY), TURNING, Numerics(grid=9, phases=32), "small")


def test_a_table_longer_than_a_piece_of_text_is_written_whole(tmp_path):
    result = Trajectory(SCENES["swimmer"], 400, mapped=False).ask()
    result.save(tmp_path / "out.csv")
    x = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True)["x"]
    np.testing.assert_array_equal(x, result["x"].values)


@pytest.fixture(scope="module")
def chain():
    return Trajectory(SMALL).ask()


def test_a_film_shows_body_track_and_shape():
    motion = compute_motion(SMALL, 2)
    rows = films.rows(32, 2)
    _, put = plots.stage(Trajectory(SMALL, 2).ask(), rows)
    for row in (0, 20, 51):
        track, body, head, dot, _ = put(row)
        np.testing.assert_array_equal(track.get_xydata(), motion.pose[: row + 1, :2])
        points = motion.points()[row]
        np.testing.assert_allclose(body.get_xydata(), points, atol=1e-15)
        np.testing.assert_allclose(head.get_xydata(), points[-1:], atol=1e-15)
        np.testing.assert_array_equal(dot.get_xydata(), motion.alpha[row : row + 1])


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
    pace = films.pace(frequency)
    assert (pace.cycle, pace.caption) == (pytest.approx(cycle), caption)
    rows = films.rows(256, 3, frequency)
    expected = np.arange(len(rows)) / pace.rate / cycle * 256
    np.testing.assert_allclose(rows, expected, atol=1.0)


def test_a_gif_takes_as_long_as_it_says(chain, tmp_path):
    chain.save(tmp_path / "out.gif")
    with Image.open(tmp_path / "out.gif") as film:
        assert film.n_frames in (32, 33)  # a picture shown twice is stored once
        durations = [x.info["duration"] for x in ImageSequence.Iterator(film)]
    assert sum(durations) == 2000


FFMPEG = """#!/bin/sh
echo "$@" > "{folder}/said"
for last; do :; done
{does}
"""
COPIES = 'cat > "$last"'


@pytest.fixture
def ffmpeg(tmp_path, monkeypatch):
    """Install an ffmpeg that does as it is told, in place of any other."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", os.pathsep.join([str(folder), "/usr/bin", "/bin"]))

    def install(does):
        (folder / "ffmpeg").write_text(FFMPEG.format(folder=folder, does=does))
        (folder / "ffmpeg").chmod(0o755)
        return folder / "said"

    return install


def test_an_mp4_hands_its_pictures_to_ffmpeg(chain, ffmpeg, tmp_path):
    said = ffmpeg(COPIES)
    films.check_format(tmp_path / "out.mp4")
    chain.save(tmp_path / "out.mp4")
    raw = np.fromfile(tmp_path / "out.mp4", np.uint8).reshape(-1, 360, 800, 3)
    assert "-s 800x360" in said.read_text()
    assert len(raw) == len(films.rows(32, 1))
    assert (raw[0] != raw[10]).any()


def test_an_mp4_says_what_it_lacks(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    lacks = "takes ffmpeg, which is not installed; end the name in .gif"
    with pytest.raises(Refusal, match=lacks):
        films.check_format(tmp_path / "out.mp4")


@pytest.mark.parametrize("ending", ["gif", "mp4"])
def test_a_film_that_is_stopped_leaves_nothing(
    ending, chain, ffmpeg, tmp_path, monkeypatch
):
    def stop(fraction):
        if fraction > 0.3:
            signal.raise_signal(signal.SIGINT)

    ffmpeg(COPIES)
    monkeypatch.setattr(films, "progress_bar", lambda _: contextlib.nullcontext(stop))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            chain.save(tmp_path / f"out.{ending}")
    finally:
        signal.signal(signal.SIGINT, before)
    assert [p.name for p in tmp_path.iterdir()] == ["bin"]
