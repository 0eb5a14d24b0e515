"""Forces along a body: they balance, do the work of the joints, are those of a closed form, and have units."""

import dataclasses

import numpy as np
import pytest
from commands import geomech as run
from scipy.interpolate import interp1d
from tabled import of_json

import geomech
from geomech.core.variables import Variable
from geomech.mathematics.gaits import Centreline, Circle, Sine, Wave
from geomech.mathematics.geometry.reconstruct import poses
from geomech.mathematics.systems import Swimmer
from geomech.questions.swimmers.forces import power_words
from geomech.scenes import Scene
from geomech.scenes.frames import framed
from geomech.studies.mechanics.forces import answer, check, cost, forces
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
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
PARTS = "normal", "tangential", "ends"
SAND, FLUID = Granular(C=1.8, gamma0=0.24), Viscous(3.0)
LAW = geomech.media.Table(
    (0.0, 0.5, 1.0, 1.5), (1.0, 0.9, 0.6, 0.1), (0.0, 1.8, 2.4, 2.7)
)  # without exact integrals


def midline(folder):
    """A bend that runs to the tail, as curvature at 21 places of 16 frames."""
    s = np.linspace(0, 1, 21)
    rows = [
        (t, x, 5 * (1 - x / 2) * np.cos(2 * np.pi * (x + t)))
        for t in np.arange(16) / 16
        for x in s
    ]
    path = folder / "swim.csv"
    path.write_text(
        "\n".join(
            ["t,s,curvature", *(",".join(map(repr, map(float, row))) for row in rows)]
        )
        + "\n"
    )
    return Centreline(str(path), elements=30)


def cases(folder):
    """Undulators of every kind, with every kind of effect that leaves them free."""
    fish, modes = geomech.load("sandfish-loose"), geomech.load("serpenoid-glass")
    chain = Swimmer(SAND, Chain((0.7, 1.4, 0.9), length=0.3, frame="link-1"))
    sunk = (DepthProfile((1.0, 1.6)), SkinFriction(0.1, 0.2))
    return {
        "sine": fish,
        "past": fish.changed(
            effects=(Transient(0.1),), body=Backbone(20), gait=Sine(elements=20)
        ),
        "serpenoid": modes,
        "arcs": Scene(Swimmer(FLUID, ConstantCurvature(24, sections=2)), Circle(1.5)),
        "links": Scene(chain, Circle(1.2)),
        "measured law": Scene(Swimmer(LAW, Chain()), Circle(0.8)),
        "sunk": Scene(dataclasses.replace(chain, effects=sunk), Circle(1.2)),
        "turning": Scene(
            Swimmer(SAND, Chain((1,) * 5)), Wave(0.6, 1.0, offset=0.3, joints=4)
        ),
        "midline": Scene(Swimmer(SAND, Backbone(30)), midline(folder)),
    }


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    scenes = cases(tmp_path_factory.mktemp("midline"))
    return {
        name: forces(scene.with_numerics(phases=24)) for name, scene in scenes.items()
    }


def places(scene, s):
    """Points s of the body in the world, complex (N, n), with the headings there, at the phases of a scene, by its drawing."""
    alpha, _ = scene.gait.cycle(scene.numerics.phases)
    pose = poses(scene.cycle().xi)[:-1]
    ends = scene.system.body.points(alpha, pose) @ [1, 1j] / body_size(scene.system)
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(ends[0])))])
    place = np.stack(
        [
            np.interp(s, along, row.real) + 1j * np.interp(s, along, row.imag)
            for row in ends
        ]
    )
    element = np.clip(np.searchsorted(along, s) - 1, 0, len(along) - 2)
    chord = np.diff(ends, axis=1)
    return place, (chord / np.abs(chord))[:, element], ends[:, -1]


NAMES = (
    "sine",
    "past",
    "serpenoid",
    "arcs",
    "links",
    "measured law",
    "sunk",
    "turning",
    "midline",
)


@pytest.mark.parametrize("name", NAMES)
def test_thrust_and_drag_balance_and_forces_do_the_work_of_the_joints(found, name):
    result, _ = found[name]
    v = lambda key: result[key].values
    assert v("thrust_normal").shape == v("drag_ends").shape == v("phase").shape
    thrust, drag = (
        sum(v(f"{kind}_{part}") for part in PARTS) for kind in ("thrust", "drag")
    )
    assert np.abs(thrust + drag).max() < 1e-8 < thrust.min()
    assert (
        v("medium_power") == pytest.approx(v("joint_power"), rel=1e-6)
        and v("medium_power").min() > 0
    )
    ends = v("tail_forward") + v("head_forward")
    assert (v("forward") * v("length")).sum(-1) + ends == pytest.approx(0.0, abs=1e-8)
    assert v("forward") == pytest.approx(v("forward_normal") + v("forward_tangential"))
    mean = sum(
        v(f"mean_{kind}_{part}") for kind in ("thrust", "drag") for part in PARTS[:2]
    )
    assert mean == pytest.approx(v("forward").mean(0), abs=1e-12)
    assert len(v("s")) >= 40 and v("length").sum() == pytest.approx(1.0)
    assert not (v("tangential") > 0).all() and {x.unit for x in result.variables} >= {
        "drag",
        "drag/BL",
        "drag x BL/rad",
    }


@pytest.mark.parametrize("name", ["links", "serpenoid", "turning"])
def test_forces_laid_out_in_the_plane_hold_the_moments_and_do_the_power(found, name):
    """By the drawing of the body: net force and moment vanish, the moment at a point is that of the forces behind it, and
    power is minus force times the velocity of the points, by differences in phase."""
    result, run = found[name]
    scene = run.scene
    place, heading, head = places(scene, result["s"].values)
    force = (
        (result["tangential"].values + 1j * result["normal"].values)
        * heading
        * result["length"].values
    )
    assert np.abs(force.sum(1)).max() < 1e-8
    about = lambda point: ((place - point[:, None]).conj() * force).imag
    assert (
        np.abs(about(head).sum(1)).max() < 1e-3
    )  # elements have forces at their centres here
    k = 17
    point, _, _ = places(scene, result["point"].values[[k]])
    moment = about(point[:, 0])[:, : k + 1].sum(1)
    assert moment == pytest.approx(result["bending_moment"].values[:, k], abs=1e-3)
    assert (
        np.abs(result["bending_moment"].values[:, [0, -1]]).max()
        < 0.05 * np.abs(moment).max()
    )
    h, forwards = 1e-4, run
    angle = forwards.direction + forwards.net[2] * (np.arange(24) / 24 - 0.5)
    assert (force * np.exp(-1j * angle)[:, None]).real == pytest.approx(
        result["forward"].values * result["length"].values, abs=1e-8
    )
    alpha, rate = scene.gait.cycle(24)
    xi, pose = (
        scene.cycle().xi / [body_size(scene.system), body_size(scene.system), 1],
        poses(scene.cycle().xi)[:-1],
    )
    frame = np.exp(1j * pose[:, 2])[:, None]
    moved = []
    for step in (h, -h):
        ends = (
            scene.system.body.points(alpha + step * rate)
            @ [1, 1j]
            / body_size(scene.system)
        )
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(ends[0])))])
        s = result["s"].values
        moved.append(
            np.stack(
                [
                    np.interp(s, along, e.real) + 1j * np.interp(s, along, e.imag)
                    for e in ends
                ]
            )
        )
    inside = (moved[0] + moved[1]) / 2
    velocity = (
        (moved[0] - moved[1]) / (2 * h)
        + xi[:, :1]
        + 1j * xi[:, 1:2]
        + 1j * xi[:, 2:] * inside
    )
    power = -(force * (frame * velocity).conj()).real.sum(1)
    assert power == pytest.approx(
        result["medium_power"].values, rel=0.01
    )  # as do rotations here


def test_a_small_sine_in_a_fluid_has_the_forces_of_its_closed_form():
    """y = A sin(k x + t) in drag 1 along and r across: forwards r k A^2 cos^2 by normal forces, of mean r k A^2 / 2, as much
    backwards by tangential ones, and power r A^2 cos^2; far from the ends, to the square of the slope."""
    r, waves, slope = 3.0, 8.0, 0.02
    gait = Sine(amplitude=slope / (2 * np.pi), waves=waves, elements=320)
    scene = Scene(Swimmer(Viscous(r), Backbone(320)), gait).with_numerics(phases=16)
    result, run = forces(scene)
    k, s, t = 2 * np.pi * waves, result["s"].values, result["phase"].values
    A = slope / k
    middle = (
        np.abs(s - 0.5) < 0.5 / waves
    )  # a wave, where the body's yaw, which a long one has little of, moves least
    cos2 = (np.cos(k * s + t[:, None]) ** 2)[:, middle]
    inner = lambda name: result[name].values[:, middle]
    size = r * k * A**2
    assert inner("forward_normal") == pytest.approx(size * cos2, abs=0.02 * size)
    assert inner("power") == pytest.approx(r * A**2 * cos2, abs=0.02 * r * A**2)
    assert inner("forward_tangential").mean() == pytest.approx(-size / 2, rel=0.02)
    assert result["thrust_normal"].values == pytest.approx(size / 2, rel=0.03)
    assert np.hypot(*run.net[:2]) == pytest.approx(
        (r - 1) * k * A**2 / 2 * 2 * np.pi, rel=0.03
    )


@dataclasses.dataclass(frozen=True)
class Doubled:
    """A fluid whose drag is told in another unit."""

    def traction(self, v_t, v_n, rounding=0.0):
        return 2.0 * v_t, 6.0 * v_n


def test_forces_are_in_axial_drags_whatever_the_unit_of_a_law():
    one, two = (
        forces(Scene(Swimmer(law, Chain()), Circle(0.7)).with_numerics(phases=8))[0]
        for law in (FLUID, Doubled())
    )
    for name in ("forward", "bending_moment", "medium_power"):
        np.testing.assert_allclose(two[name].values, one[name].values, atol=1e-9)


def test_forces_do_not_see_the_frame():
    scene = geomech.load("three-link-viscous").with_numerics(phases=16, grid=9)
    one, _ = forces(scene)
    link = scene.changed(body=Chain(frame="link-3"))
    other = scene.changed(system=framed(scene.system, scene.numerics))
    for two, _ in (forces(link), forces(other)):
        for name in ("normal", "forward", "bending_moment", "fundamental_lag"):
            np.testing.assert_allclose(two[name].values, one[name].values, atol=1e-6)


def test_a_heavy_body_is_pushed_by_what_accelerates_it():
    """Thrust and drag balance in the mean alone; so do the powers."""
    heavy = geomech.load("sandfish-heavy")
    small = heavy.changed(
        body=Backbone(20), gait=dataclasses.replace(heavy.gait, elements=20)
    ).with_numerics(phases=32)
    v = {k: x.values for k, x in forces(small)[0].items()}
    net = sum(v[f"{kind}_{part}"] for kind in ("thrust", "drag") for part in PARTS)
    assert (
        np.abs(net).max() > 0.01
        and abs(net.mean()) < 2e-4 * np.abs(v["drag_tangential"]).max()
    )
    assert v["joint_power"].mean() == pytest.approx(v["medium_power"].mean(), rel=1e-3)
    assert np.abs(v["joint_power"] - v["medium_power"]).max() > 1e-3


def test_on_a_slope_forces_hold_the_weight_in_the_world():
    """Where the place matters headings are those of the steps; the weight pulls downhill, and the ground holds it."""
    slope = Slope(angle=0.3, towards=2.0, weight=0.4)
    scene = Scene(
        Swimmer(SAND, Chain((1,) * 5), (slope,)), Wave(0.6, 1.0, offset=0.3, joints=4)
    ).with_numerics(phases=32)
    result, run = forces(scene)
    v = {k: x.values for k, x in result.items()}
    net = sum(v[f"{kind}_{part}"] for kind in ("thrust", "drag") for part in PARTS)
    ahead = run.direction + run.net[2] * (np.arange(32) / 32 - 0.5)
    assert net == pytest.approx(0.4 * np.sin(0.3) * np.cos(ahead - 2.0), abs=2e-3)
    assert abs(run.net[2]) > 0.1


def test_the_cost_counts_all_that_errors_take():
    """Balances over those of one run: a law computed more exactly, half the elements or pieces, half the steps."""
    fish, steps = geomech.load("sandfish-loose"), geomech.load("sandfish-heavy")
    solved = lambda scene: cost(scene.with_numerics(phases=32)).balances
    cycles = 3  # assumed, of what is run until it repeats
    once = 9  # of 32 phases, whose images the others are
    assert (
        solved(geomech.load("three-link-viscous")) == once
        and solved(geomech.load("three-link-glass")) == 2 * once
    )
    assert solved(fish) == 16 + 32 and solved(steps) == cycles * (3 * 32 + 16)


def test_newtons_and_watts_follow_from_sizes():
    """Stress x 2 r L; the catalogue's stress grows with depth; a heavy body says its own; a contradiction is refused."""
    fish = geomech.load("sandfish-loose").with_numerics(phases=16)
    plain, of_plain = forces(fish)
    known, _ = forces(fish, Sizes(length=0.1, depth=0.05, frequency=3.0))
    drag = 2710 * 0.05 / 0.0762 * 2 * 0.006 * 0.1
    scales = {
        "forward": (drag / 0.1, "N/m"), "drag_ends": (drag, "N"), "bending_moment": (drag * 0.1, "N m"),
        "medium_power": (drag * 0.1 * 6 * np.pi, "W"), "power": (drag * 6 * np.pi, "W/m"), "lag": (1.0, "rad"),
    }  # fmt: skip
    for name, (scale, unit) in scales.items():
        np.testing.assert_allclose(
            known[name].values, scale * plain[name].values, rtol=1e-12
        )
        assert known[name].unit == unit
    by_stress, _ = forces(fish, Sizes(length=0.1, stress=500.0))
    np.testing.assert_allclose(
        by_stress["drag_ends"].values, 500 * 2 * 0.006 * 0.1 * plain["drag_ends"].values
    )
    assert (
        by_stress["medium_power"].unit == "J/rad" and by_stress["power"].unit == "N/rad"
    )
    assert of_plain.unit.missing == ("length", "radius", "depth")
    fluid = (
        geomech.load("three-link-viscous")
        .changed(body=Chain(length=0.3))
        .with_numerics(phases=16)
    )
    assert forces(fluid)[1].unit.missing == ("radius", "stress")
    heavy = geomech.load("sandfish-heavy")
    with pytest.raises(
        Refusal,
        match="sandfish-heavy: length is 0.2, but the scene has 0.1: drop length",
    ):
        check(heavy, Sizes(length=0.2))
    with pytest.raises(
        Refusal,
        match="differential-drive: force along the body is that of a body in a medium",
    ):
        geomech.study("differential-drive").forces()


@pytest.mark.parametrize(
    "name",
    ["sandfish-loose", "serpenoid-glass", "three-link-glass", "sandfish-transient"],
)
def test_errors_cover_what_finer_numerics_change(name):
    """Three times the elements, a hundredth of the regularisation, four times the steps in time: they cover these at nine
    points of ten, and are in the mean 20 times as large at most, along the body 30."""
    scene, phases = geomech.load(name).with_numerics(phases=32), 32
    if name == "sandfish-transient":
        scene, phases = (
            scene.changed(
                body=Backbone(40), gait=dataclasses.replace(scene.gait, elements=40)
            ),
            16,
        )
        scene = scene.with_numerics(phases=phases)
    found, body = answer(scene, Sizes()), scene.system.body
    finer = scene.with_numerics(
        regularisation=1e-8, phases=4 * phases if scene.system.traits.steps else phases
    )
    if count := getattr(body, "elements", None):
        gait = dataclasses.replace(
            scene.gait,
            **{"elements": 3 * count} if hasattr(scene.gait, "elements") else {},
        )
        finer = finer.changed(
            body=dataclasses.replace(body, elements=3 * count), gait=gait
        )
    truth, _ = forces(finer)
    sums = (
        "thrust_normal",
        "drag_normal",
        "drag_tangential",
        "drag_ends",
        "medium_power",
        "joint_power",
    )
    for key in (*sums, "forward", "tangential", "power", "bending_moment"):
        values = truth[key].values[:: len(truth["phase"].values) // phases]
        for place in found[key].dims[1:]:
            values = interp1d(truth[place].values, values, fill_value="extrapolate")(
                found[place].values
            )
        off, error = np.abs(values - found[key].values), found[key].error
        assert (off <= error + 1e-9).mean() >= 0.9, key
        assert (
            off.mean()
            <= error.mean()
            < (30 if found[key].dims[1:] else 20) * off.mean() + 1e-9
        ), key


def test_a_stroke_that_goes_nowhere_says_so():
    still = geomech.study(
        SAND, Chain((1, 1, 1)), Wave(0.5, waves=0.0, joints=2), phases=16
    ).forces()
    assert "no net displacement; forwards is where the frame points" in repr(still)


def test_power_that_goes_elsewhere_is_said():
    values = {"mean_power": 1.5e-8, "largest_power": 2e-8, "mean_joint_power": 1.8e-8}
    found = {name: Variable(name, (), x, "W") for name, x in values.items()}
    assert (
        power_words(found)
        == "power 1.5e-08 W into the medium, largest 2e-08; at the joints 1.8e-08 W"
    )


def test_the_command_prints_writes_and_draws(tmp_path):
    out, table = tmp_path / "f.nc", tmp_path / "f.csv"
    given = (
        "forces",
        "three-link-glass",
        "--length",
        0.3,
        "--radius",
        0.02,
        "--depth",
        0.05,
    )
    code, text, err = run(*given, "--frequency", 1, "-o", table)
    assert (
        (code, err) == (0, "")
        and "W into the medium" in " ".join(text.split())
        and "at the joints the same" in " ".join(text.split())
    )
    data = np.genfromtxt(table, delimiter=",", names=True)
    code, text, _ = run(*given, "--json", "-o", out)
    found = of_json(text)
    assert (found["forward"].unit, found["medium_power"].unit) == ("N/m", "J/rad")
    forward = data["forward"].reshape(found["phase"].values.size, -1)
    np.testing.assert_allclose(forward, found["forward"])
    code, _, err = run("forces", "three-link-glass", "-o", tmp_path / "f.tab")
    assert code == 2 and "end the name in one of .nc, " in err


def test_pictures_show_the_numbers(found):
    result, _ = found["sine"]
    fig = geomech.plots.forces_figure(result)
    forward, phase, place = fig.axes[:3]
    image = forward.collections[0]
    np.testing.assert_allclose(image.get_array()[:-1], result["forward"].values)
    assert image.get_clim()[1] == np.abs(result["forward"].values).max()
    (total,) = (line for line in phase.lines if line.get_label() == "sum")
    assert np.abs(total.get_ydata()).max() < 1e-8
    tops = [c.get_paths()[0].vertices[:, 1].max() for c in phase.collections]
    assert max(tops) == pytest.approx(result["thrust_normal"].values.max())
    assert f"head {result['head_forward'].values.mean():.3g} drag" in place.get_title()
    fig = geomech.plots.forces_figure(result, ("moment", "power"), clim="90%")
    np.testing.assert_allclose(
        fig.axes[0].collections[0].get_array()[:-1, 1:-1],
        result["bending_moment"].values,
    )
    assert fig.axes[1].collections[0].get_clim()[1] == pytest.approx(
        np.percentile(result["power"].values, 90)
    )
    np.testing.assert_allclose(fig.axes[0].lines[1].get_ydata(), result["onset"].values)
    with pytest.raises(Refusal, match="'thrust' is unknown"):
        geomech.plots.forces_figure(result, ("thrust",))


def test_a_study_has_forces_too(tmp_path):
    forces = geomech.study("three-link-viscous", phases=16).forces()
    assert forces["forward"].values.shape == (16, 42)
    assert "activation ahead of bending" in repr(forces)
    assert len(forces.plot(component=("phase",)).axes) == 1
    assert forces.to_xarray()["medium_power"].attrs["units"] == "drag x BL/rad"
