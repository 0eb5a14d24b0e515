"""Chains that move in modes, and waves of joint angles: the plain chain along the same angles, circles and backbones."""

import numpy as np
import pytest
from commands import geomech
from scipy.io import netcdf_file
from tabled import swept_table, tabled, tabled_json

import rft
from geomech import scenes
from geomech.mathematics.gaits import Circle, Fourier, Wave
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.geometry.coordinates import change_velocity
from geomech.mathematics.systems import Swimmer, Table
from geomech.mathematics.systems.base import shape_labels
from geomech.mathematics.systems.swimmer import is_three_link
from geomech.scenes import Scene
from geomech.studies.available import available_tiers
from geomech.studies.displacement import sweep
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables, refuse_outside
from rft import Chain, EndCaps, Granular, Serpenoid, SkinFriction, Transient, Viscous

pytestmark = pytest.mark.usefixtures("fastest")
LENGTHS, FRAME = (0.8, 1.3, 1.0, 0.7), "link-2"
ROWS = ((1.4, 0.3, -0.5), (-0.2, 0.9, 2.1))
MODES = Chain(LENGTHS, 0.3, FRAME, modes=ROWS)
PLAIN = Chain(LENGTHS, 0.3, FRAME)
SAND = Granular(1.8, 0.24)
COS, SIN, CENTRE = (
    np.array([[0.5, 0.1], [0.0, 0.2]]),
    np.array([[0.0, 0.1], [0.6, 0.0]]),
    np.array([0.1, -0.2]),
)
GAIT = Fourier(cos=COS.tolist(), sin=SIN.tolist(), centre=CENTRE.tolist())
SAME = Fourier(cos=(np.transpose(ROWS) @ COS).tolist(), sin=(np.transpose(ROWS) @ SIN).tolist(),
               centre=(CENTRE @ ROWS).tolist())  # fmt: skip
ROBOT = scenes.load("seven-link-wave")
RNG = np.random.default_rng(5)
SHAPE, RATE = RNG.uniform(-0.7, 0.7, (2, 30, 2))


def test_body_velocity_and_work_are_those_of_the_plain_chain():
    effects = SkinFriction(0.1, 0.15, 0.2), EndCaps(radius_m=0.018)
    settings = {"effects": effects, "pieces": 7}
    found = rft.body_velocity(SAND, MODES, SHAPE, RATE, **settings).checked()
    wanted = rft.body_velocity(
        SAND, PLAIN, SHAPE @ ROWS, RATE @ ROWS, **settings
    ).checked()
    np.testing.assert_allclose(found.xi, wanted.xi, atol=1e-13)
    assert (found.status == wanted.status).all()
    work = rft.work_done(SAND, MODES, SHAPE, RATE, found.xi, **settings)
    for a, b in zip(
        work,
        rft.work_done(SAND, PLAIN, SHAPE @ ROWS, RATE @ ROWS, found.xi, **settings),
        strict=True,
    ):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14)
    assert work.bending_moment.shape == (30, 3)


@pytest.mark.parametrize(
    "effects",
    [(), (EndCaps(radius_m=0.018),), (Transient(travel_m=0.03),)],
    ids=["plain", "caps", "transient"],
)
@pytest.mark.parametrize("tier", ["direct", "adapted"])
def test_tiers_are_those_of_the_plain_chain(tier, effects):
    of_modes, plain = (
        SceneTables(
            Scene(Swimmer(SAND, body, effects), gait).with_numerics(
                phases=24, curves=6, cycles=1, pieces=9
            )
        )
        for body, gait in ((MODES, GAIT), (PLAIN, SAME))
    )
    if tier not in of_modes.tiers:
        assert effects and effects[0].kind == "transient"
        return
    a = [0.5, 1.0]
    np.testing.assert_allclose(
        of_modes.poses(tier, None, a), plain.poses(tier, None, a), atol=1e-13
    )
    if tier == "direct" and not of_modes.scene.system.traits.steps:
        estimates = [
            tabled(s.displacements(a, ["direct"]))["estimate"]["direct"]
            for s in (of_modes, plain)
        ]
        np.testing.assert_allclose(*estimates, rtol=1e-6, atol=1e-13)


def test_connection_and_ccf_are_pulled_back():
    """A_j = sum over k of modes[j][k] A_k, and the CCF is the plain chain's times the modes' area."""
    wide, turn = np.diag([0.5, 0.25]), np.array([[0.0, 1.0], [1.0, 0.0]])
    body = Chain((1, 1.5, 0.8), frame="link-1", modes=turn @ wide)
    axes = connection.grid(2, 9, 2.0)
    of = lambda body: (
        lambda alpha, rate: (
            rft.body_velocity(Viscous(3.0), body, alpha, rate).checked().xi
        )
    )
    fitted = connection.fit(of(body), axes)
    plain = connection.fit(
        of(Chain((1, 1.5, 0.8), frame="link-1")), (axes[0] / 2, axes[1] / 4)
    )
    # m_1 turns joint 2 by a quarter of itself, m_2 joint 1 by a half.
    np.testing.assert_allclose(
        fitted.A[:, 0], 0.25 * plain.A[:, 1].swapaxes(1, 2), atol=1e-13
    )
    np.testing.assert_allclose(
        fitted.A[:, 1], 0.5 * plain.A[:, 0].swapaxes(1, 2), atol=1e-13
    )
    found, wanted = (curvature.ccf(c).values for c in (fitted, plain))
    np.testing.assert_allclose(found, -wanted.swapaxes(1, 2) / 8, atol=1e-12)


@pytest.mark.parametrize("name", ["three-link-glass", "three-link-viscous"])
def test_identity_modes_are_todays_chain(name):
    scene = scenes.load(name).with_numerics(grid=5, phases=32, curves=6, harmonics=5)
    eye = scenes.parse(scene.text.replace("[body]", "[body]\nmodes = [[1, 0], [0, 1]]"))
    eye, n = (
        SceneTables(eye.with_numerics(grid=5, phases=32, curves=6, harmonics=5)),
        SceneTables(scene),
    )
    assert eye.tiers == n.tiers
    for tier in n.tiers:
        np.testing.assert_allclose(eye.poses(tier), n.poses(tier), atol=1e-15)
    for found, wanted in (
        (eye.curvature, n.curvature),
        (eye.curvature_error, n.curvature_error),
    ):
        np.testing.assert_allclose(found.values, wanted.values, atol=1e-13)


def test_one_mode_and_many_modes():
    """A single mode closes no loop that encloses anything: it goes nowhere; as many modes as joints lose nothing."""
    one = Swimmer(SAND, Chain(LENGTHS, modes=[[1, -0.5, 0.3]]))
    back_and_forth = Fourier(cos=[[0.5, 0.1]], sin=[[0.2, 0.3]])
    assert available_tiers(one) == ("adapted", "path", "direct")
    for tier in ("path", "direct"):
        moved = SceneTables(
            Scene(one, back_and_forth).with_numerics(grid=9, phases=256)
        ).poses(tier)
        np.testing.assert_allclose(moved, 0, atol=3e-5)
    all_of_them = Chain(LENGTHS, 0.3, FRAME, modes=(*ROWS, (1, -1, 1)))
    shape = np.linalg.solve(np.transpose(all_of_them.modes), (SHAPE @ ROWS).T).T
    rate = np.linalg.solve(np.transpose(all_of_them.modes), (RATE @ ROWS).T).T
    found = rft.body_velocity(SAND, all_of_them, shape, rate).checked().xi
    np.testing.assert_allclose(
        found, rft.body_velocity(SAND, MODES, SHAPE, RATE).xi, atol=1e-12
    )


def test_modes_change_of_frame():
    h, hdot = MODES.frame_pose("link-4", SHAPE, RATE)
    np.testing.assert_allclose(
        h, PLAIN.frame_pose("link-4", SHAPE @ ROWS, RATE @ ROWS)[0], atol=1e-15
    )
    xi = rft.body_velocity(SAND, MODES, SHAPE, RATE).xi
    other = rft.body_velocity(
        SAND, Chain(LENGTHS, 0.3, "link-4", modes=ROWS), SHAPE, RATE
    ).xi
    np.testing.assert_allclose(change_velocity(xi, h, hdot), other, atol=1e-12)


@pytest.mark.parametrize("waves", [0.7, 1.0, 1.5])
def test_a_serpenoid_chain_of_many_links_is_the_serpenoid_backbone(waves):
    """Its amplitude is the angle of a joint: the backbone's, curvature times length, over the number of links."""
    of_backbone = lambda n: Swimmer(
        Viscous(2.5), Serpenoid(elements=n, waves=waves)
    ).run(*Circle(amplitude=5.0, centre=(1.0, -0.5), reverse=True).cycle(16))
    of_chain = lambda n: Swimmer(
        Viscous(2.5), Chain((1,) * n, modes="serpenoid", waves=waves)
    ).run(
        *Circle(amplitude=5.0 / n, centre=(1.0 / n, -0.5 / n), reverse=True).cycle(16)
    )
    np.testing.assert_allclose(of_chain(30).net, of_backbone(30).net, atol=1e-13)
    truth = of_backbone(960).net
    off = [np.abs(of_chain(n).net - truth).max() for n in (30, 60, 120)]
    assert 3.7 < off[0] / off[1] < 4.3 and 3.7 < off[1] / off[2] < 4.3


@pytest.mark.parametrize(
    ("modes", "waves", "said"),
    [
        ([[1, 2], [2, 4]], None, "the 2 modes are linearly dependent"),
        ([[1, 2], [0, 0]], None, "mode 2 is zero"),
        ([[1, 2], [0]], None, "modes must be real numbers in equal rows"),
        ([[1, 2, 3]], None, "modes must be rows of 2 joint angles"),
        (
            [[1, 0], [0, 1], [1, 1]],
            None,
            "3 modes of 2 joints are linearly dependent: give at most 2",
        ),
        ([], None, "modes must be rows of 2 joint angles"),
        (np.zeros((0, 2)), None, "modes must be rows of 2 joint angles"),
        ([[1, float("nan")]], None, "modes must be finite"),
        (
            "snake",
            None,
            "modes must be rows of joint angles or 'serpenoid', got 'snake'",
        ),
        (None, 1.0, "waves are those of modes = 'serpenoid'"),
        ([[1, 2]], 1.0, "waves are those of modes = 'serpenoid'"),
        ("serpenoid", 1.5, "mode 2 is zero"),
        ("serpenoid", 2.0, "waves must be a number from 1e-06 to 1.5"),
    ],
)
def test_modes_that_make_no_body_are_refused(modes, waves, said):
    with pytest.raises(ValueError, match=said) as caught:
        Chain(modes=modes, waves=waves)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("modes = [[1, 2], [0.5]]", "[body] modes must be"),
        ("modes = [[1, 2], [2, 4]]", "[body] the 2 modes are linearly dependent"),
        ("modes = [[0, 0]]", "[body] mode 1 is zero"),
        ("modes = 3", "[body] Expected"),
        ('modes = "serpenoids"', "'serpenoids'"),
        ("modes = [[1, 1]]", "[gait] circle moves 2 joints but [body] has 1"),
    ],
)
def test_scenes_with_bad_modes_get_one_line(line, said, tmp_path):
    file = tmp_path / "s.toml"
    file.write_text(
        scenes.load("three-link-glass").text.replace("[body]", f"[body]\n{line}")
    )
    code, out, err = geomech("displacement", file, "--amplitudes", "1")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_modes_go_through_files(tmp_path):
    """TOML there and back, NetCDF whose axes are amplitudes, a sweep over the waves of the modes."""
    scene = scenes.load("seven-link-modes").with_numerics(grid=5, phases=32)
    for body in (
        MODES,
        Chain((1,) * 5, modes="serpenoid", waves=1.2),
        Chain((1,) * 5, modes="serpenoid"),
    ):
        there = Scene(Swimmer(SAND, body), Circle())
        assert scenes.parse(scenes.toml(there)).system == there.system
    assert (
        geomech("connection", "seven-link-modes", "--grid", 5, "-o", tmp_path / "c.nc")[
            0
        ]
        == 0
    )
    with netcdf_file(tmp_path / "c.nc", mmap=False) as file:
        names = [file.variables[f"alpha_{k}"].long_name for k in (1, 2)]
        A = file.variables["A"][:].copy()
    assert names == [b"shape variable m_1", b"shape variable m_2"]
    np.testing.assert_allclose(A, SceneTables(scene).fitted.A, atol=1e-13)
    found = swept_table(sweep.sweep(scene, {"body.waves": [0.8, 1.2]}))["displacement"]
    for waves, pose in zip((0.8, 1.2), found):
        again = scene.changed(body=Chain((1,) * 7, modes="serpenoid", waves=waves))
        np.testing.assert_allclose(pose, SceneTables(again).poses("direct"), atol=1e-13)


def test_a_serpenoid_has_one_wave_if_it_does_not_say():
    found, wanted = (
        Chain((1,) * 5, modes="serpenoid", waves=w).joint_angles(np.eye(2))
        for w in (None, 1.0)
    )
    np.testing.assert_array_equal(found, wanted)
    np.testing.assert_allclose(
        found[0], [np.cos(2 * np.pi / 5), np.sin(2 * np.pi / 5)], atol=1e-15
    )


def test_names_of_shape_variables():
    assert shape_labels(Swimmer(SAND, MODES)) == (("m_1", "rad"), ("m_2", "rad"))
    assert shape_labels(Swimmer(SAND, PLAIN)) == (
        ("alpha_1", "rad"),
        ("alpha_2", "rad"),
        ("alpha_3", "rad"),
    )
    assert not is_three_link(
        Swimmer(SAND, Chain(modes="serpenoid"))
    )  # no published gaits beside its own


# Waves.


@pytest.mark.parametrize("waves", [-1.3, 0.7, 1.0])
def test_a_wave_is_a_circle_in_serpenoid_modes(waves):
    a, links = 0.7, 6
    wave = Wave(amplitude=a, waves=waves, joints=links - 1)
    body = Chain((1, 1.3, 0.8, 1, 0.7, 1.1), modes="serpenoid", waves=abs(waves))
    circle = Circle(amplitude=a, reverse=waves > 0)
    for shapes, amplitudes in zip(
        wave.cycle(16, [0.3, a]), circle.cycle(16, [0.3, a]), strict=True
    ):
        np.testing.assert_allclose(shapes, np.moveaxis(body.joint_angles(np.moveaxis(amplitudes, -1, 0).reshape(2, -1))
                                   .reshape(links - 1, 2, 16), 0, -1), atol=1e-14)  # fmt: skip
    plain = Swimmer(SAND, Chain(body.lengths))
    for tier in ("direct", "adapted"):
        of_wave = SceneTables(
            Scene(plain, wave).with_numerics(phases=32, curves=6)
        ).poses(tier)
        of_modes = SceneTables(
            Scene(Swimmer(SAND, body), circle).with_numerics(phases=32, curves=6)
        ).poses(tier)
        np.testing.assert_allclose(of_wave, of_modes, atol=1e-13)


def test_a_wave_runs_to_the_tail_and_the_body_to_the_head():
    wave, t = Wave(joints=40, waves=1.5), np.linspace(0, 1, 5)
    crests = np.argmax(wave.shape(t)[:, 8:32], axis=-1)
    assert (np.diff(crests) <= 0).all() and crests[-1] < crests[0]
    forward = SceneTables(ROBOT).poses("direct")
    assert forward[0] > 0.2
    for backwards in (
        Wave(amplitude=0.87, waves=-1.0),
        Wave(amplitude=0.87, reverse=True),
    ):
        assert SceneTables(ROBOT.changed(gait=backwards)).poses("direct")[0] < -0.2
    still = SceneTables(ROBOT.changed(gait=Wave(amplitude=0.87, waves=0.0))).poses(
        "direct"
    )
    np.testing.assert_allclose(still, 0, atol=1e-6)


def test_an_offset_turns_the_body():
    """To the left where joints bend to the left; to the right it is the mirror image half a cycle later."""
    turned = {}
    for offset in (0.15, -0.15):
        study = SceneTables(ROBOT.changed(gait=Wave(amplitude=0.6, offset=offset)))
        turned[offset] = study.poses("direct")[2]
    assert turned[0.15] > 0.05
    assert turned[-0.15] == pytest.approx(-turned[0.15], abs=1e-12)
    wave = Wave(joints=3, amplitude=0.4, offset=0.2, centre=(0.1, 0.0, -0.1))
    np.testing.assert_allclose(wave.cycle(64)[0].mean(0), [0.3, 0.2, 0.1], atol=1e-15)
    np.testing.assert_allclose(wave.shape(0.3, 0.0), [0.3, 0.2, 0.1], atol=1e-15)
    assert scenes.parse(ROBOT.text + "offset_deg = 9.0\n").gait.offset == pytest.approx(
        np.pi / 20
    )


def test_a_wave_is_swept_and_asked_for(tmp_path):
    over = {
        "gait.waves": [0.8, 1.0],
        "gait.offset": [0.0, 0.1],
        "gait.amplitude": [0.5, 0.87],
    }
    coarse = ROBOT.with_numerics(phases=32)
    found = swept_table(sweep.sweep(coarse, over))
    one = coarse.changed(gait=Wave(amplitude=0.87, waves=0.8, offset=0.1))
    np.testing.assert_allclose(
        found["displacement"][0, 1, 1], SceneTables(one).poses("direct"), atol=1e-13
    )
    code, out, _ = geomech(
        "displacement", "seven-link-wave", "--amplitudes", "0.87", "--json"
    )
    assert code == 0
    net = np.hypot(*tabled_json(out)["direct"][0][:2])
    # Wave efficiency 0.34 +- 0.02 in grains (Maladen et al. 2011); a wave of A / lambda = 0.2 is 0.757 body lengths long.
    assert net / 0.757 == pytest.approx(0.34, abs=0.02)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"waves": 4.0}, "waves must be a number from -3.5 to 3.5, got 4.0"),
        ({"joints": 0}, "joints must be a whole number from 1"),
        ({"offset": float("nan")}, "offset must be a number"),
        ({"centre": (1.0,)}, "centre must have 6 angles"),
    ],
)
def test_waves_that_make_no_gait_are_refused(wrong, said):
    with pytest.raises(ValueError, match=said):
        Wave(**wrong)


@pytest.mark.parametrize("ending", ["nc", "mat"])
def test_a_table_keeps_the_names_of_modes(tmp_path, ending):
    scene = Scene(Swimmer(SAND, MODES), Circle(amplitude=0.4)).with_numerics(
        grid=5, extent=0.6, phases=16
    )
    study = SceneTables(scene)
    fields.save_connection(tmp_path / f"modes.{ending}", study)
    again = Table(tmp_path / f"modes.{ending}")
    assert shape_labels(again) == (("m_1", "rad"), ("m_2", "rad"))
    fields.save_connection(
        tmp_path / f"twice.{ending}", SceneTables(Scene(again, Circle()))
    )
    assert shape_labels(Table(tmp_path / f"twice.{ending}")) == shape_labels(again)
    with pytest.raises(ValueError, match="m_1 = .* lies outside"):
        refuse_outside(Scene(again, Circle(amplitude=9.0)))
