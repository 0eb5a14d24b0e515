"""Forces along a body: they balance, do the work of the joints, are those of a closed
form, and have units."""

import dataclasses

import numpy as np
import pytest
from scipy.interpolate import interp1d

import geomech
from geomech.mathematics.gaits import Centreline, Circle, Sine, Wave
from geomech.mathematics.geometry.reconstruct import poses
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Scene
from geomech.scenes.frames import framed
from geomech.studies.mechanics.forces import answer, forces
from geomech.studies.mechanics.newtons import Sizes
from rft import (
    Backbone,
    Chain,
    ConstantCurvature,
    DepthProfile,
    Granular,
    SkinFriction,
    Slope,
    Transient,
    Viscous,
)
from rft.bodies.base import body_size

pytestmark = pytest.mark.usefixtures("fastest")
PARTS = ("normal", "tangential", "ends")
SAND = Granular(C=1.8, gamma0=0.24)
FLUID = Viscous(3.0)
# A law without exact integrals.
MEASURED = geomech.media.Table(
    (0.0, 0.5, 1.0, 1.5), (1.0, 0.9, 0.6, 0.1), (0.0, 1.8, 2.4, 2.7)
)
FISH = geomech.load("sandfish-loose")
HEAVY = geomech.load("sandfish-heavy")
CHAIN = Swimmer(SAND, Chain((0.7, 1.4, 0.9), length=0.3, frame="link-1"))
SUNK = (DepthProfile((1.0, 1.6)), SkinFriction(0.1, 0.2))
TURNING = Wave(0.6, 1.0, offset=0.3, joints=4)


def midline(folder):
    """Return a bend that runs to the tail, measured as curvature at 21 places of 16
    frames."""
    t, s = np.meshgrid(np.arange(16) / 16, np.linspace(0, 1, 21), indexing="ij")
    curvature = 5 * (1 - s / 2) * np.cos(2 * np.pi * (s + t))
    table = np.stack([t, s, curvature], -1).reshape(-1, 3)
    path = folder / "swim.csv"
    np.savetxt(path, table, delimiter=",", header="t,s,curvature", comments="")
    return Centreline(str(path), elements=30)


SCENES = {
    "sine": lambda folder: FISH,
    "past": lambda folder: FISH.changed(
        effects=(Transient(0.1),), body=Backbone(20), gait=Sine(elements=20)
    ),
    "serpenoid": lambda folder: geomech.load("serpenoid-glass"),
    "arcs": lambda folder: Scene(
        Swimmer(FLUID, ConstantCurvature(24, sections=2)), Circle(1.5)
    ),
    "links": lambda folder: Scene(CHAIN, Circle(1.2)),
    "measured law": lambda folder: Scene(Swimmer(MEASURED, Chain()), Circle(0.8)),
    "sunk": lambda folder: Scene(dataclasses.replace(CHAIN, effects=SUNK), Circle(1.2)),
    "turning": lambda folder: Scene(Swimmer(SAND, Chain((1,) * 5)), TURNING),
    "midline": lambda folder: Scene(Swimmer(SAND, Backbone(30)), midline(folder)),
}


def values(scene):
    """Return the values of all forces by name, and the run."""
    result, run = forces(scene)
    return {name: variable.values for name, variable in result.items()}, run


def net(v):
    return sum(v[f"{kind}_{part}"] for kind in ("thrust", "drag") for part in PARTS)


@pytest.mark.parametrize("name", SCENES)
def test_thrust_and_drag_balance_and_forces_do_the_work_of_the_joints(name, tmp_path):
    v, _ = values(SCENES[name](tmp_path).with_numerics(phases=24))
    thrust = sum(v[f"thrust_{part}"] for part in PARTS)
    assert np.abs(net(v)).max() < 1e-8 < thrust.min()
    assert v["medium_power"] == pytest.approx(v["joint_power"], rel=1e-6)
    ends = v["tail_forward"] + v["head_forward"]
    along = (v["forward"] * v["length"]).sum(-1)
    assert along + ends == pytest.approx(0.0, abs=1e-8)
    both = v["forward_normal"] + v["forward_tangential"]
    assert v["forward"] == pytest.approx(both)


def places(scene, s):
    """Return points s of the drawn body in the world, complex (N, n), the headings
    there, and its head (N,)."""
    alpha, _ = scene.gait.cycle(scene.numerics.phases)
    pose = poses(scene.cycle().xi)[:-1]
    ends = scene.system.body.points(alpha, pose) @ [1, 1j] / body_size(scene.system)
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(ends[0])))])
    chord = np.diff(ends, axis=1)
    element = np.clip(np.searchsorted(along, s) - 1, 0, len(along) - 2)
    return interp1d(along, ends)(s), (chord / np.abs(chord))[:, element], ends[:, -1]


@pytest.mark.parametrize("name", ["links", "serpenoid", "turning"])
def test_forces_laid_out_in_the_plane_hold_the_moments(name, tmp_path):
    """Net force and moment vanish, and the moment at a point is that of the forces
    behind it."""
    scene = SCENES[name](tmp_path).with_numerics(phases=24)
    v, _ = values(scene)
    place, heading, head = places(scene, v["s"])
    force = (v["tangential"] + 1j * v["normal"]) * heading * v["length"]

    def moments(point):
        return ((place - point[:, None]).conj() * force).imag

    # Elements have forces at their centres here.
    assert np.abs(force.sum(1)).max() < 1e-8
    assert np.abs(moments(head).sum(1)).max() < 1e-3
    k = 17
    point, _, _ = places(scene, v["point"][[k]])
    moment = moments(point[:, 0])[:, : k + 1].sum(1)
    assert moment == pytest.approx(v["bending_moment"][:, k], abs=1e-3)
    ends = v["bending_moment"][:, [0, -1]]
    assert np.abs(ends).max() < 0.05 * np.abs(moment).max()


def test_a_small_sine_in_a_fluid_has_the_forces_of_its_closed_form():
    """y = A sin(k x + t) in drag 1 along and r across: forwards r k A^2 cos^2 by normal
    forces, of mean r k A^2 / 2, as much backwards by tangential ones, and power r A^2
    cos^2; far from the ends, to the square of the slope."""
    r = 3.0
    waves = 8.0
    slope = 0.02
    gait = Sine(amplitude=slope / (2 * np.pi), waves=waves, elements=320)
    scene = Scene(Swimmer(Viscous(r), Backbone(320)), gait).with_numerics(phases=16)
    v, _ = values(scene)
    k = 2 * np.pi * waves
    A = slope / k
    size = r * k * A**2
    # A wave, where the body's yaw, which a long one has little of, moves least.
    middle = np.abs(v["s"] - 0.5) < 0.5 / waves
    cos2 = (np.cos(k * v["s"] + v["phase"][:, None]) ** 2)[:, middle]
    normal = v["forward_normal"][:, middle]
    assert normal == pytest.approx(size * cos2, abs=0.02 * size)
    power = r * A**2
    assert v["power"][:, middle] == pytest.approx(power * cos2, abs=0.02 * power)
    tangential = v["forward_tangential"][:, middle].mean()
    assert tangential == pytest.approx(-size / 2, rel=0.02)


PLAIN = geomech.load("three-link-viscous").changed(medium=FLUID)
PLAIN = PLAIN.with_numerics(phases=16, grid=9)


@pytest.mark.parametrize(
    "other",
    [
        PLAIN.changed(body=Chain(frame="link-3")),
        PLAIN.changed(system=framed(PLAIN.system, PLAIN.numerics)),
    ],
    ids=["link", "frame"],
)
def test_forces_do_not_see_the_frame(other):
    one, _ = values(PLAIN)
    two, _ = values(other)
    for name in ("normal", "forward", "bending_moment", "medium_power"):
        np.testing.assert_allclose(two[name], one[name], atol=1e-6)


def test_a_heavy_body_is_pushed_by_what_accelerates_it():
    """Thrust and drag balance in the mean alone; so do the powers."""
    gait = dataclasses.replace(HEAVY.gait, elements=20)
    v, _ = values(HEAVY.changed(body=Backbone(20), gait=gait).with_numerics(phases=32))
    assert abs(net(v).mean()) < 2e-4 * np.abs(v["drag_tangential"]).max()
    assert v["joint_power"].mean() == pytest.approx(v["medium_power"].mean(), rel=1e-3)
    assert np.abs(v["joint_power"] - v["medium_power"]).max() > 1e-3


def test_on_a_slope_forces_hold_the_weight_in_the_world():
    slope = Slope(angle=0.3, towards=2.0, weight=0.4)
    scene = Scene(Swimmer(SAND, Chain((1,) * 5), (slope,)), TURNING)
    v, run = values(scene.with_numerics(phases=32))
    assert abs(run.net[2]) > 0.1
    ahead = run.direction + run.net[2] * (np.arange(32) / 32 - 0.5)
    weight = 0.4 * np.sin(0.3) * np.cos(ahead - 2.0)
    assert net(v) == pytest.approx(weight, abs=2e-3)


def test_newtons_and_watts_follow_from_sizes():
    """Stress x 2 r L; the catalogue's stress grows with depth; a heavy body says its
    own."""
    fish = FISH.with_numerics(phases=16)
    plain, _ = forces(fish)
    known, _ = forces(fish, Sizes(length=0.1, depth=0.05, frequency=3.0))
    drag = 2710 * 0.05 / 0.0762 * 2 * 0.006 * 0.1
    scales = {
        "forward": (drag / 0.1, "N/m"),
        "drag_ends": (drag, "N"),
        "bending_moment": (drag * 0.1, "N m"),
        "medium_power": (drag * 0.1 * 6 * np.pi, "W"),
        "power": (drag * 6 * np.pi, "W/m"),
        "lag": (1.0, "rad"),
    }
    for name, (scale, unit) in scales.items():
        expected = scale * plain[name].values
        np.testing.assert_allclose(known[name].values, expected, rtol=1e-12)
        assert known[name].unit == unit


def small_steps():
    """Return a body with a past, small enough to be computed again finely."""
    scene = geomech.load("sandfish-transient")
    gait = dataclasses.replace(scene.gait, elements=40)
    return scene.changed(body=Backbone(40), gait=gait).with_numerics(phases=16)


def finer(scene):
    """Return three times the elements, a hundredth of the regularisation and, of steps
    in time, four times as many."""
    n_phases = scene.numerics.phases * (4 if scene.system.traits.steps else 1)
    scene = scene.with_numerics(regularisation=1e-8, phases=n_phases)
    finer_parts = {}
    for name, part in (("body", scene.system.body), ("gait", scene.gait)):
        if hasattr(part, "elements"):
            more = dataclasses.replace(part, elements=3 * part.elements)
            finer_parts[name] = more
    return scene.changed(**finer_parts)


SUMS = ("thrust_normal", "drag_normal", "drag_tangential", "drag_ends")
POWERS = ("medium_power", "joint_power")
ALONG = ("forward", "tangential", "power", "bending_moment")


@pytest.mark.parametrize(
    "scene",
    [
        FISH.with_numerics(phases=32),
        geomech.load("serpenoid-glass").with_numerics(phases=32),
        geomech.load("three-link-glass").with_numerics(phases=32),
        small_steps(),
    ],
    ids=lambda scene: scene.name,
)
def test_errors_cover_what_finer_numerics_change(scene):
    """At nine points of ten, and in the mean 20 times as large at most, along the body
    30."""
    found = answer(scene, Sizes())
    truth, _ = forces(finer(scene))
    step = truth["phase"].values.size // scene.numerics.phases
    for name in (*SUMS, *POWERS, *ALONG):
        exact = truth[name].values[::step]
        for place in found[name].dims[1:]:
            at = truth[place].values
            exact = interp1d(at, exact, fill_value="extrapolate")(found[place].values)
        off = np.abs(exact - found[name].values)
        largest = 30 if name in ALONG else 20
        assert (off <= found[name].error + 1e-9).mean() >= 0.9, name
        mean = found[name].error.mean()
        assert off.mean() <= mean < largest * off.mean() + 1e-9, name
