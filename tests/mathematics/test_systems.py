"""Systems: what the geometry asks of them; the no-slip snake against its closed form,
its singular shapes left out."""

import numpy as np
import pytest
import sympy as sp
from registry import SYSTEMS

from geomech import scenes
from geomech.mathematics import symbolic
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems import KINDS, NoSlipSnake
from geomech.mathematics.systems.base import kind_of, length_unit
from geomech.mathematics.systems.framed import in_frame
from geomech.mathematics.tiers.direct import direct
from geomech.scenes import Scene
from geomech.studies.scene_tables import SceneTables
from rft import Chain
from rft.core.refusal import Refusal
from rft.formulas.newton import to_element

AWAY = Ellipse(
    semi_axes=(0.6, 0.4), tilt=0.3, centre=(1.0, -0.7)
)  # from alpha_1 = alpha_2


def closed_form():
    """A (3, 2) of three equal links of 1/3 in the middle link's frame, and its shape
    angles, by hand.

    The middle wheel: xi_y = 0. With h = 1/6 the head's (s = sin, c = cos of alpha_2)
    and the tail's (of alpha_1) say -s_2 xi_x + h (1 + c_2) xi_theta + h alphadot_2 = 0
    and s_1 xi_x - h (1 + c_1) xi_theta + h alphadot_1 = 0."""
    a = sp.symbols("alpha_1 alpha_2")
    s1, s2 = map(sp.sin, a)
    c1, c2 = map(sp.cos, a)
    h = sp.Rational(1, 6)
    D = s1 * (1 + c2) - s2 * (1 + c1)
    rows = [[-h * (1 + c2), -h * (1 + c1)], [0, 0], [-s2, -s1]]
    return sp.Matrix(rows) / D, a


@pytest.mark.parametrize("length", [1.0, 0.3])
def test_the_snake_moves_as_its_closed_form(length):
    exact = symbolic.velocity(*closed_form())
    alpha, alphadot = np.random.default_rng(0).uniform(-2.5, 2.5, (2, 200, 2))
    expected = exact(alpha, alphadot) * [length, length, 1]
    found = NoSlipSnake(length=length, frame="link-2").velocity(alpha, alphadot)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-3"])
def test_no_wheel_slips_in_any_frame(frame):
    lengths = (0.8, 1.3, 1.0)
    alpha, alphadot = np.random.default_rng(1).normal(size=(2, 50, 2))
    xi = NoSlipSnake(lengths, 0.4, frame).velocity(alpha, alphadot)
    motion = Chain(lengths, 0.4, frame).motion(alpha.T, alphadot.T)
    across = motion.v_n + to_element(motion, *(xi / [0.4, 0.4, 1.0]).T)[1]
    assert np.abs(across).max() < 1e-10 * np.abs(xi).max()


def snake():
    return SceneTables(Scene(NoSlipSnake(frame="link-2"), AWAY))


@pytest.mark.parametrize(
    ("tier", "atol"), [("adapted", 1e-4), ("path", 1e-12), ("direct", 1e-12)]
)
def test_tiers_of_the_snake_agree_with_its_closed_form(tier, atol):
    study = snake()
    exact = direct(symbolic.velocity(*closed_form()), AWAY, [0.5, 1.0], 512)
    found = study.poses(tier, None, [0.5, 1.0])
    np.testing.assert_allclose(found, exact, atol=atol)


@pytest.mark.parametrize("lengths", [(1, 1, 1), (1, 1.5, 0.7)])
def test_singular_shapes_are_left_out_of_fields(lengths):
    """The mask holds the zeros of the determinant and nothing farther off; elsewhere A
    is that of formulas."""
    system = NoSlipSnake(lengths, frame="link-2")
    study = SceneTables(Scene(system, AWAY).with_numerics(grid=41, extent=2.0))
    A = np.moveaxis(study.fitted.A, (0, 1), (-2, -1))
    masked = np.isnan(A).all((-2, -1))
    assert 41 <= masked.sum() < 4 * 41
    shapes = np.stack(np.meshgrid(*study.fitted.axes, indexing="ij"), -1)
    d = system.traits.singularity(shapes)
    assert (masked[1:] & masked[:-1])[d[1:] * d[:-1] < 0].all()
    assert (masked[:, 1:] & masked[:, :-1])[d[:, 1:] * d[:, :-1] < 0].all()
    exact = np.stack([system.velocity(shapes, e) for e in np.eye(2)], -1)
    np.testing.assert_allclose(A[~masked], exact[~masked], rtol=1e-9, atol=1e-11)
    unknown = np.isnan(study.curvature.values[0])
    assert (unknown >= masked).all()
    assert unknown.sum() <= masked.sum() + 10


def test_the_ccf_of_the_snake_away_from_singular_shapes_is_that_of_its_formula():
    study = snake().with_numerics(grid=41, extent=2.0)
    first, second = np.meshgrid(*study.fitted.axes, indexing="ij")
    far = np.abs(first - second) > 1.0
    A, alpha = closed_form()
    formula = sp.lambdify(alpha, list(symbolic.ccf(A, alpha)))
    expected = np.stack(formula(first[far], second[far]))
    found = study.curvature.values[:, far]
    np.testing.assert_allclose(found, expected, atol=2e-3)


CROSSING = Circle(amplitude=0.9, centre=(0.6, 0.0))


@pytest.mark.parametrize("tier", ["adapted", "path", "direct"])
def test_a_gait_through_singular_shapes_is_refused_by_name(tier):
    study = snake()
    with pytest.raises(
        Refusal, match=r"passes the singular shape near alpha = \(.*axles"
    ):
        study.poses(tier, CROSSING)
    assert np.isfinite(study.poses(tier, CROSSING, [0.3])).all()


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda study: study.scene.cycle(CROSSING), "passes the singular shape"),
        (
            lambda study: study.poses("area"),
            "the area tier integrates a field, and the no",
        ),
        (
            lambda study: study.fitted([1.0, -1.0]),
            "a field with singular shapes cannot",
        ),
        (
            lambda study: connection.fit(
                study.scene.system.velocity, connection.grid(2, 5)
            ),
            "velocity is not finite at alpha",
        ),
        (
            lambda study: study.with_numerics(regularisation=1e-3),
            "numerics: 'regularisation' is unknown",
        ),
    ],
)
def test_what_has_singular_shapes_is_not_summed_nor_looked_up(ask, said):
    with pytest.raises(ValueError, match=said):
        ask(snake())


@pytest.mark.parametrize("name", SYSTEMS)
def test_what_a_system_says_of_itself_holds(name):
    system = SYSTEMS[name]
    rng = np.random.default_rng(2)
    alpha, alphadot = rng.uniform(-1.2, 1.2, (2, 30, system.joints))
    xi = system.velocity(alpha, alphadot)
    thrice = system.velocity(alpha, 3 * alphadot)
    np.testing.assert_allclose(thrice, 3 * xi, rtol=1e-5, atol=1e-6)
    mirrored = system.velocity(-alpha, -alphadot) * [1, -1, -1]
    assert np.allclose(mirrored, xi, rtol=1e-6, atol=1e-8) == system.traits.mirror
    assert system.traits.mirror == (name != "differential-drive")
    columns = np.stack([system.velocity(alpha, e) for e in np.eye(system.joints)], -1)
    residual = np.abs(np.einsum("bij,bj->bi", columns, alphadot) - xi).max()
    assert (residual < 1e-9 * np.abs(columns).max()) == system.traits.linear
    for k, period in enumerate(system.traits.periods):
        if period is not None:
            later = alpha + period * np.eye(system.joints)[k]
            repeated = system.velocity(later, alphadot)
            np.testing.assert_allclose(repeated, xi, rtol=1e-9, atol=1e-9)
    assert length_unit(system) == "m"
    assert KINDS[kind_of(system)] is type(system)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_run_of_a_system_integrates_its_velocity(name):
    scene = Scene(SYSTEMS[name], AWAY)
    net = direct(scene.system.velocity, AWAY, None, 64)
    np.testing.assert_allclose(scene.cycle(phases=64).net, net, atol=1e-9)


@pytest.mark.parametrize("name", sorted({*SYSTEMS} - {"differential-drive", "table"}))
def test_a_system_of_links_is_told_in_another_frame(name):
    assert in_frame(SYSTEMS[name], "link-2").traits.frame == "link-2"


class Disc:
    """It is pushed along by one joint and turned by the other."""

    joints = 2
    traits = Traits(linear=True)
    kind = "disc"

    def velocity(self, alpha, alphadot):
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        x = np.cos(alpha[..., 1]) * alphadot[..., 0]
        return np.stack([x, 0 * x, alphadot[..., 1]], -1)


@pytest.mark.parametrize("tier", ["area", "adapted", "path", "harmonic", "direct"])
def test_whatever_has_a_velocity_is_a_system(tier):
    study = SceneTables(Scene(Disc(), Circle(centre=(0.2, 0.6))))
    truth = study.poses("direct", None, [0.2])
    close = 0.02 * np.hypot(*truth[0, :2])
    np.testing.assert_allclose(study.poses(tier, None, [0.2]), truth, atol=close)
    with pytest.raises(Refusal, match="no kind that a scene file can name"):
        scenes.toml(study.scene)
