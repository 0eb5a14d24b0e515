"""Systems: what the geometry asks of them; the no-slip snake against its closed form, its singular shapes left out."""

import dataclasses

import numpy as np
import pytest
import sympy as sp
import xarray
from registry import GAITS, SYSTEMS
from tabled import tabled

from geomech import scenes
from geomech.mathematics import symbolic
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection, coordinates
from geomech.mathematics.geometry.connection import sign_changes
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems import KINDS, NoSlipSnake, Swimmer
from geomech.mathematics.systems.base import WrappedSystem, kind_of, length_unit
from geomech.mathematics.systems.capabilities import stored_table
from geomech.mathematics.systems.framed import in_frame
from geomech.mathematics.systems.swimmer import Solver, is_three_link
from geomech.mathematics.tiers.direct import direct
from geomech.scenes import Scene
from geomech.shell.describe.scene import description
from geomech.studies.available import default_tiers
from geomech.studies.estimates import cost, estimate
from geomech.studies.maps import fields
from geomech.studies.mechanics.single import diagnosed_velocity
from geomech.studies.scene_tables import SceneTables
from rft import Backbone, Chain, Coulomb, Serpenoid, Transient
from rft.core.refusal import Refusal
from rft.formulas import se2
from rft.formulas.newton import to_element

AWAY = Ellipse(
    semi_axes=(0.6, 0.4), tilt=0.3, centre=(1.0, -0.7)
)  # from alpha_1 = alpha_2


def closed_form():
    """A (3, 2) of three equal links of 1/3 in the middle link's frame, and its shape angles, by hand.

    The middle wheel: xi_y = 0. With h = 1/6 the head's (s = sin, c = cos of alpha_2) and the tail's (of alpha_1) say
    -s_2 xi_x + h (1 + c_2) xi_theta + h alphadot_2 = 0 and s_1 xi_x - h (1 + c_1) xi_theta + h alphadot_1 = 0."""
    a = sp.symbols("alpha_1 alpha_2")
    (s1, s2), (c1, c2), h = map(sp.sin, a), map(sp.cos, a), sp.Rational(1, 6)
    D = s1 * (1 + c2) - s2 * (1 + c1)
    return sp.Matrix(
        [[-h * (1 + c2) / D, -h * (1 + c1) / D], [0, 0], [-s2 / D, -s1 / D]]
    ), a


@pytest.mark.parametrize("length", [1.0, 0.3])
def test_the_snake_moves_as_its_closed_form(length):
    exact = symbolic.velocity(*closed_form())
    rng = np.random.default_rng(0)
    alpha, alphadot = rng.uniform(-2.5, 2.5, (2, 200, 2))
    wanted = exact(alpha, alphadot) * [length, length, 1]
    found = NoSlipSnake(length=length, frame="link-2").velocity(alpha, alphadot)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12)


def test_a_cycle_tells_the_mean_rate_of_each_gait():
    """|alphadot| over the joints, averaged over the phases, of gaits side by side and of one alone."""
    alpha, alphadot = AWAY.cycle(16, np.array([0.5, 0.8]))
    wanted = [np.mean([np.hypot(*rate) for rate in gait]) for gait in alphadot]
    np.testing.assert_allclose(
        NoSlipSnake().run(alpha, alphadot).speed, wanted, rtol=1e-14
    )
    np.testing.assert_allclose(
        NoSlipSnake().run(alpha[1], alphadot[1]).speed, wanted[1], rtol=1e-14
    )


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-3"])
def test_no_wheel_slips_in_any_frame(frame):
    """Uneven links; and the same motion as the middle link's, told in another frame."""
    snake, (alpha, alphadot) = (
        NoSlipSnake((0.8, 1.3, 1.0), 0.4, frame),
        np.random.default_rng(1).normal(size=(2, 50, 2)),
    )
    xi = snake.velocity(alpha, alphadot)
    body = Chain((0.8, 1.3, 1.0), 0.4, frame)
    motion = body.motion(alpha.T, alphadot.T)
    across = motion.v_n + to_element(motion, *(xi / [0.4, 0.4, 1.0]).T)[1]
    assert np.abs(across).max() < 1e-10 * np.abs(xi).max()
    h, hdot = Chain((0.8, 1.3, 1.0), 0.4, "link-2").frame_pose(frame, alpha, alphadot)
    middle = NoSlipSnake((0.8, 1.3, 1.0), 0.4, "link-2").velocity(alpha, alphadot)
    np.testing.assert_allclose(
        xi, coordinates.change_velocity(middle, h, hdot), rtol=1e-8, atol=1e-10
    )


def snake(**numerics):
    return SceneTables(
        Scene(NoSlipSnake(frame="link-2"), AWAY).with_numerics(**numerics)
    )


def test_tiers_of_the_snake_agree_with_its_closed_form():
    study, exact = (
        snake(),
        direct(symbolic.velocity(*closed_form()), AWAY, [0.5, 1.0], 512),
    )
    assert study.tiers == ("adapted", "path", "direct") and default_tiers(
        study.scene.system
    ) == ("path", "direct")
    assert np.abs(exact[1]).min() > 1e-3
    for tier, error in (("adapted", 1e-4), ("path", 1e-12), ("direct", 1e-12)):
        np.testing.assert_allclose(
            study.poses(tier, None, [0.5, 1.0]), exact, atol=error
        )
    table = tabled(study.displacements([0.5, 1.0], ["path", "direct"]))
    np.testing.assert_allclose(table["direct"], exact, atol=1e-12)


def test_the_built_in_snake_goes_where_its_closed_form_does():
    """Told in the mean frame: g h at both ends of the cycle, h the mean frame in the middle link's."""
    scene = scenes.load("no-slip-snake")
    assert scene.frame == "mean"
    net = direct(symbolic.velocity(*closed_form()), scene.gait, None, 512)
    h = Chain(frame="link-2").frame_pose("mean", scene.gait.shape(0.0), [0.0, 0.0])[0]
    wanted = se2.compose(se2.compose(se2.inverse(h), net), h)
    np.testing.assert_allclose(SceneTables(scene).poses("direct"), wanted, atol=1e-12)


@pytest.mark.parametrize("lengths", [(1, 1, 1), (1, 1.5, 0.7)])
def test_singular_shapes_are_left_out_of_fields(lengths):
    """The mask holds the zeros of the determinant and nothing farther off; elsewhere A and CCF are those of
    formulas."""
    system = NoSlipSnake(lengths, frame="link-2")
    study = SceneTables(Scene(system, AWAY).with_numerics(grid=41, extent=2.0))
    fitted, ccf, error = (
        study.fitted,
        study.curvature.values,
        study.curvature_error.values,
    )
    shapes = np.stack(np.meshgrid(*fitted.axes, indexing="ij"), -1)
    masked = np.isnan(fitted.A).all((0, 1))
    assert (np.isnan(fitted.A).any((0, 1)) == masked).all()
    assert 41 <= masked.sum() < 4 * 41
    d = system.traits.singularity(shapes)
    for axis in (0, 1):
        one, other = (np.moveaxis(x, axis, 0) for x in (d, masked))
        assert (other[1:] & other[:-1])[one[1:] * one[:-1] < 0].all()
    exact = np.stack([system.velocity(shapes, e) for e in np.eye(2)], -1)
    np.testing.assert_allclose(
        np.moveaxis(fitted.A, (0, 1), (-2, -1))[~masked],
        exact[~masked],
        rtol=1e-9,
        atol=1e-11,
    )
    assert (np.isnan(ccf[0]) >= masked).all() and np.isnan(
        ccf[0]
    ).sum() <= masked.sum() + 10
    assert (np.isnan(error) == np.isnan(ccf)).all()
    if lengths == (1, 1, 1):
        A, alpha = closed_form()
        far = np.abs(shapes[..., 0] - shapes[..., 1]) > 1.0
        wanted = np.stack(
            sp.lambdify(alpha, list(symbolic.ccf(A, alpha)))(*shapes[far].T)
        )
        np.testing.assert_allclose(ccf[:, far], wanted, atol=2e-3)
        assert np.abs(wanted).max(1).min() > 0.1
        assert (np.abs(ccf[:, far] - wanted) <= error[:, far] + 1e-9).mean() > 0.9


def test_singular_shapes_are_refused_by_name_in_integrals():
    study, crossing = snake(), Circle(amplitude=0.9, centre=(0.6, 0.0))
    for tier in study.tiers:
        with pytest.raises(
            Refusal,
            match=r"the gait meets the singular shape near alpha = \(.*axles meet",
        ):
            study.poses(tier, crossing)
        with pytest.raises(Refusal, match="meets the singular shape"):
            tabled(study.displacements([0.9], [tier], crossing))
        assert np.isfinite(study.poses(tier, crossing, [0.3])).all()
    with pytest.raises(ValueError, match="meets the singular shape"):
        study.scene.cycle(crossing)
    with pytest.raises(
        Refusal,
        match="the area tier sums a field up, and the no-slip-snake has singular shapes",
    ):
        study.poses("area")
    with pytest.raises(
        ValueError, match="a field with singular shapes is not looked up"
    ):
        study.fitted([1.0, -1.0])
    with pytest.raises(ValueError, match="velocity is not finite at alpha"):
        connection.fit(study.scene.system.velocity, connection.grid(2, 5))
    with pytest.raises(Refusal, match="numerics: 'regularisation' is unknown"):
        study.with_numerics(regularisation=1e-3)
    with pytest.raises(
        ValueError, match="the shape is singular: the wheels' axles meet in one point"
    ):
        diagnosed_velocity(study.scene.system, [0.4, 0.4], [1.0, 0.0])


def test_files_and_words_say_what_is_singular(tmp_path):
    study = snake(grid=9, extent=2.0)
    fields.save_connection(tmp_path / "a.nc", study)
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        assert np.isnan(data.A.values[:, :, range(9), range(9)]).all()
        assert np.isnan(data.ccf.values[:, range(9), range(9)]).all()
        assert np.isfinite(data.A.values).sum() == 6 * (81 - 9)
        assert data.attrs["singular_shapes"].startswith(
            "nan, where the wheels' axles meet"
        )
        assert scenes.parse(data.attrs["scene_toml"]) == study.scene
    told = description(scenes.load("no-slip-snake"))
    assert (
        "tiers: adapted, path, direct\n" in told
        and "gaits that meet one are refused" in told
    )


@pytest.mark.parametrize("name", SYSTEMS)
def test_what_a_system_says_of_itself_holds(name):
    """Mirror, linearity, rate-independence, frame and unit; a run integrates the velocity; its cost is told."""
    system, rng = SYSTEMS[name], np.random.default_rng(2)
    alpha, alphadot = rng.uniform(-1.2, 1.2, (2, 30, system.joints))
    xi = system.velocity(alpha, alphadot)
    other_side = system.velocity(-alpha, -alphadot)
    assert (
        np.allclose(other_side, xi * [1, -1, -1], rtol=1e-6, atol=1e-8)
        == system.traits.mirror
        == (name != "differential-drive")
    )
    np.testing.assert_allclose(
        system.velocity(alpha, 3 * alphadot), 3 * xi, rtol=1e-5, atol=1e-6
    )
    columns = np.stack([system.velocity(alpha, e) for e in np.eye(system.joints)], -1)
    linear = (
        np.abs(np.einsum("bij,bj->bi", columns, alphadot) - xi).max()
        < 1e-9 * np.abs(columns).max()
    )
    assert linear == system.traits.linear
    assert length_unit(system) == "m"
    if system.traits.mirror and not stored_table(
        system, "connection"
    ):  # a cart has one frame, a table that it was made in
        assert in_frame(system, "link-2").traits.frame == "link-2"
    assert KINDS[kind_of(system)] is type(system)
    scene = Scene(system, AWAY)
    run = scene.cycle(phases=64)
    np.testing.assert_allclose(
        run.net, direct(system.velocity, AWAY, None, 64), atol=1e-9
    )
    poses, errors = estimate.direct(scene, AWAY, np.array([0.5, 1.0]), 64)
    assert poses.shape == (2, 3) and errors.shape == (2, 2)
    assert cost.total_cost(cost.direct_jobs(scene, AWAY, 2, 64)).balances >= 128


def test_whatever_has_a_velocity_is_a_system():
    """A system of one's own: a disc that is pushed along by its one joint, and turns."""

    class Disc:
        joints, traits, kind = 2, Traits(linear=True), "disc"

        def velocity(self, alpha, alphadot):
            alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
            return np.stack(
                [
                    np.cos(alpha[..., 1]) * alphadot[..., 0],
                    0 * alpha[..., 0],
                    alphadot[..., 1],
                ],
                -1,
            )

    study = SceneTables(Scene(Disc(), Circle(centre=(0.2, 0.6))))
    assert study.tiers == ("area", "adapted", "path", "harmonic", "direct")
    truth = study.poses("direct", None, [0.2])
    for tier in study.tiers:
        np.testing.assert_allclose(
            study.poses(tier, None, [0.2]), truth, atol=0.02 * np.hypot(*truth[0, :2])
        )
    with pytest.raises(Refusal, match="of no kind that a scene file can name"):
        scenes.toml(Scene(Disc(), GAITS["ellipse"]))


def test_three_links_are_a_chain_of_three_and_nothing_else():
    """The published gaits, circle and butterfly, are compared for these alone."""
    bodies = (
        Chain((1, 2, 1)),
        Chain((1,) * 4),
        Chain((1,) * 3, modes=((1.0, 0.5), (0.0, 1.0))),
        Serpenoid(12),
    )
    assert [is_three_link(Swimmer(Coulomb(), body)) for body in bodies] == [
        True,
        False,
        False,
        False,
    ]


def test_systems_of_users_have_one_to_ten_thousand_joints():
    forwards = lambda alpha, alphadot: alphadot[..., :1] * [1.0, 0.0, 0.0]
    assert WrappedSystem(forwards, 10_000).joints == 10_000
    for joints in (0, 10_001):
        with pytest.raises(
            Refusal, match="joints must be a whole number from 1 to 10000"
        ):
            WrappedSystem(forwards, joints)


def test_points_on_either_side_of_a_change_of_sign_are_crossed():
    assert sign_changes(np.array([-2.0, -1.0, 1.0, 2.0, 0.0, 3.0])).tolist() == [
        False,
        True,
        True,
        False,
        True,
        False,
    ]
    plane = np.array([[1.0, 2.0, 3.0], [1.0, -2.0, 3.0], [1.0, 2.0, 3.0]])
    assert sign_changes(plane).tolist() == [
        [False, True, False],
        [True, True, True],
        [False, True, False],
    ]


@pytest.mark.parametrize(
    ("body", "pieces", "seen"),
    [
        (Chain(), 40, 40),
        (Backbone(100), 40, 100),
        (Chain((1, 1)), 1, 2),
        (Chain(), 1, 3),
    ],
)
def test_effects_that_vary_see_pieces_or_whole_elements(body, pieces, seen):
    swimmer = Swimmer(Coulomb(), body, (Transient(travel=0.1),), Solver(pieces=pieces))
    assert swimmer.balance_size.pieces == seen
    assert dataclasses.replace(swimmer, effects=()).balance_size.pieces == 0
