"""The vertical plane: the stress map against its definition and its check values, loads against closed forms, adaptive
quadrature, mirror images and far finer computations."""

import dataclasses
import itertools

import numpy as np
import pytest
from registry import OUTLINES, STRESSES
from scipy.integrate import quad

from rft.formulas.vectors import formula
from rft.terradynamics.ground import (
    Aeration,
    DisturbedGround,
    GrainInertia,
    Ground,
    Slope,
)
from rft.terradynamics.plates import (
    SHAPES,
    VERTICAL,
    CLeg,
    Drag,
    HalfCylinder,
    Outline,
    Path,
    Penetrate,
    Plate,
    PlateDrags,
    PlateStress,
    Polygon,
    Rotate,
    RoundRod,
    Spline,
    SquareRod,
    StressMap,
    Wheel,
    contact,
    loads,
    survey,
)
from rft.terradynamics.plates.loads import ORDER

pytestmark = pytest.mark.usefixtures("fastest")

RAD = np.pi / 180
M0 = StressMap()


GENERIC = (
    0.206,
    0.169,
    0.212,
    0.358,
    0.055,
    -0.124,
    0.253,
    0.007,
    0.088,
)  # DESIGN section 4, from Table S2


def by_definition(beta, gamma, coefficients=GENERIC):
    """alpha_x, alpha_z for angles within +-pi/2, term by term."""
    A00, A10, B11, B01, Bm11, C11, C01, Cm11, D10 = coefficients
    phase = lambda m, n: 2 * m * beta + n * gamma
    a_z = (
        A00
        + A10 * np.cos(phase(1, 0))
        + B11 * np.sin(phase(1, 1))
        + B01 * np.sin(gamma)
        + Bm11 * np.sin(phase(-1, 1))
    )
    a_x = (
        C11 * np.cos(phase(1, 1))
        + C01 * np.cos(gamma)
        + Cm11 * np.cos(phase(-1, 1))
        + D10 * np.sin(phase(1, 0))
    )
    return a_x, a_z


def random_motions(count, seed=0):
    """Poses about the surface and twists that mix travel and turning."""
    rng = np.random.default_rng(seed)
    pose = np.stack(
        [
            rng.uniform(-1, 1, count),
            rng.uniform(-0.08, 0.04, count),
            rng.uniform(-3, 3, count),
        ],
        -1,
    )
    return pose, rng.normal(size=(count, 3)) * [0.05, 0.05, 1.0] * 10 ** rng.uniform(
        -2, 2, (count, 1)
    )


CHECKS = {
    (0, 90): (0, 1),
    (0, -90): (0, -0.25),
    (90, 0): (0.37, 0.037),
    (0, 0): (0.136, 0.375),
    (45, 45): (0.3595, 0.5702),
}


@pytest.mark.parametrize("zeta", [1.0, 0.24])
def test_check_values_of_the_generic_map(zeta):
    for (beta, gamma), wanted in CHECKS.items():
        found = StressMap(zeta=zeta)(beta * RAD, gamma * RAD)
        np.testing.assert_allclose(found, zeta * np.array(wanted), atol=5e-5)


def test_the_map_is_its_fourier_sum():
    rng = np.random.default_rng(1)
    beta, gamma = rng.uniform(-np.pi / 2, np.pi / 2, (2, 1000))
    loose = (0.051, 0.047, 0.053, 0.083, 0.020, -0.026, 0.057, 0.0, 0.025)
    close = (0.094, 0.092, 0.092, 0.151, 0.035, -0.039, 0.086, 0.018, 0.046)
    for stress, numbers, zeta in (
        (StressMap(zeta=0.3), GENERIC, 0.3), (StressMap(*range(1, 10)), range(1, 10), 1),
        (VERTICAL["glass-3mm"].stress, GENERIC, 0.224), (VERTICAL["poppy-seeds-loose"].stress, loose, 1),
        (VERTICAL["poppy-seeds-close"].stress, close, 1),
    ):  # fmt: skip
        found, wanted = (
            np.array(stress(beta, gamma)),
            zeta * np.array(by_definition(beta, gamma, numbers)),
        )
        np.testing.assert_allclose(found, wanted, atol=1e-14 * max(numbers))


@pytest.mark.parametrize("name", STRESSES)
def test_all_angles_follow_by_mirror_symmetry_and_half_a_turn(name):
    """To rounding, but where tension is cut: there rounding may decide on a jump."""
    rng = np.random.default_rng(2)
    beta, gamma = rng.uniform(-7, 7, (2, 500))
    stress, tiny = STRESSES[name], 1e-9 if name == "measured" else 1e-13
    a_x, a_z = stress(beta, gamma)
    assert np.isfinite([a_x, a_z]).all()
    for turned in (
        (beta + np.pi, gamma),
        (beta - np.pi, gamma),
        (beta, gamma - 2 * np.pi),
    ):
        np.testing.assert_allclose(stress(*turned), [a_x, a_z], atol=tiny)
    for side in (-np.pi, np.pi):
        np.testing.assert_allclose(stress(-beta, side - gamma), [-a_x, a_z], atol=tiny)


@pytest.mark.parametrize("name", [n for n in STRESSES if STRESSES[n].tension == "keep"])
def test_the_map_is_continuous_everywhere(name):
    line = np.linspace(-np.pi, np.pi, 721)
    a = np.stack(STRESSES[name](line[:, None], line))
    step = line[1] - line[0]
    steepest = 2.5 if name == "measured" else 4 * STRESSES[name](0.0, np.pi / 2)[1]
    assert max(np.abs(np.diff(a, axis=k)).max() for k in (1, 2)) < steepest * step
    assert (
        np.abs(a[:, 0] - a[:, -1]).max() < 1e-9
        and np.abs(a[..., 0] - a[..., -1]).max() < 1e-9
    )


def test_named_media_take_power_at_all_angles_and_the_generic_one_pulls_on_13_percent():
    """DESIGN: normal tension for horizontal motion wherever the normal points more than 53 degrees up."""
    for entry in VERTICAL.values():
        assert survey(entry.stress).pushing == 0
        assert "Science 339" in entry.source
    assert survey(M0).pulling == pytest.approx(0.13, abs=0.005)
    up = (
        np.linspace(1, 89, 177) * RAD
    )  # of the leading normal (cos, sin) of faces that move forwards
    a_x, a_z = M0.alpha((np.cos(up), np.sin(up)), (1.0, 0.0))
    pulled = np.sin(up) * a_z - np.cos(up) * a_x > 0
    assert up[pulled].min() / RAD == pytest.approx(53, abs=1)
    assert pulled.sum() == (up >= up[pulled].min()).sum()


def test_strength_straight_down_of_named_media():
    down = {
        name: float(entry.stress(0.0, np.pi / 2)[1]) for name, entry in VERTICAL.items()
    }
    wanted = {
        "generic": 1.0, "poppy-seeds-loose": 0.254, "poppy-seeds-close": 0.464, "glass-3mm": 0.224,
        "poppy-seeds-loose-scaled": 0.24, "poppy-seeds-close-scaled": 0.422,
    }  # fmt: skip
    assert down == pytest.approx(wanted, abs=1e-12)


def test_a_survey_finds_what_drives_a_motion_on():
    """As a map whose sign is lost in one coefficient: force times unit velocity, by the definition."""
    lost = (*GENERIC[:3], -0.358, *GENERIC[4:])
    bad, ahead = survey(StressMap(*lost, tension="cut"), cells=90), slice(45, 135)
    beta, gamma = np.meshgrid(bad.beta, bad.gamma[ahead], indexing="ij")
    a_x, a_z = by_definition(beta, gamma, lost)
    power = -a_x * np.cos(gamma) - a_z * np.sin(gamma)
    np.testing.assert_allclose(bad.power[:, ahead], power, atol=1e-14)
    assert bad.pushing == pytest.approx((power > 0).mean(), abs=1e-12)
    face = np.sign(np.sin(beta + gamma).round(12))
    pulled = (-np.sin(beta) * a_x - np.cos(beta) * a_z) * face > 0
    assert bad.pulling == pytest.approx(pulled.mean(), abs=1e-12)
    assert (
        f"drives motion on over {100 * (power > 0).mean():.1f} % of the plane, most at beta = "
        in bad.description()
    )


# Lift over drag at one depth: DESIGN section 9, with and without the cut.
LIFT = [
    (RoundRod, {}, 0.81, 0.68), (HalfCylinder, {}, 0.54, 0.04), (HalfCylinder, {"flat": "up"}, 0.99, 0.99),
    (SquareRod, {}, 0.1, 0.1),
]  # fmt: skip


@pytest.mark.parametrize("grazing", [0.0, M0.grazing])
@pytest.mark.parametrize(("kind", "more", "kept", "cut"), LIFT)
def test_lift_over_drag_of_rods(kind, more, kept, cut, grazing):
    outline = kind(1e-5, 1.0, **more).outline(400)
    for tension, wanted in (("keep", kept), ("cut", cut)):
        force = loads(
            StressMap(tension=tension, grazing=grazing, zeta=0.3),
            outline,
            (0, -1, 0),
            (0.2, 0, 0),
        ).force
        assert -force[1] / force[0] == pytest.approx(wanted, abs=0.005)


@pytest.mark.parametrize("elements", [1, 7])
def test_a_plate_that_crosses_the_surface_is_cut_there_exactly(elements):
    """The integral of depth over what is below is width d^2 / (2 sin beta), d the depth of the lower edge."""
    plate, z, beta = Plate(length=0.06, width=0.02, tilt=0.7), -0.004, 0.7
    gamma = 0.4
    lowest = 0.03 * np.sin(beta) - z
    found = loads(
        M0,
        plate.outline(elements),
        (0.3, z, 0),
        (0.1 * np.cos(gamma), -0.1 * np.sin(gamma), 0),
    )
    a_x, a_z = by_definition(beta, gamma)
    below = 0.02 * lowest**2 / (2 * np.sin(beta)) * 1e6
    np.testing.assert_allclose(found.force, (-a_x * below, a_z * below), rtol=1e-12)
    sunk = loads(M0, plate.outline(elements), (0.3, -0.2, 0), (0.1, 0, 0))
    a_x, a_z = by_definition(beta, 0.0)
    np.testing.assert_allclose(
        sunk.force, np.array([-a_x, a_z]) * 0.06 * 0.02 * 0.2 * 1e6, rtol=1e-12
    )


def test_a_turning_plate_against_adaptive_quadrature():
    """Flat leg about a hub above the surface and, at the same time, moving: every point has its own direction."""
    R, width, hub, angle, twist = 0.03, 0.02, 0.015, 0.4, (0.05, -0.02, 3.0)
    down = np.array(
        [-np.sin(angle), -np.cos(angle)]
    )  # of a leg that a positive angle has swept backwards

    def stress(s):
        r = s * down
        z = hub + r[1]
        if z >= 0:
            return np.zeros(3)
        v = twist[0] + twist[2] * r[1], twist[1] - twist[2] * r[0]
        beta, gamma = np.arctan2(down[1], down[0]), np.arctan2(-v[1], v[0])
        beta -= np.pi * np.round(beta / np.pi)
        back = abs(gamma) > np.pi / 2
        a_x, a_z = by_definition(
            *((-beta, np.sign(gamma) * np.pi - gamma) if back else (beta, gamma))
        )
        f = -z * 1e6 * np.array([a_x if back else -a_x, a_z])
        return np.array([*f, r[1] * f[0] - r[0] * f[1]])

    edges = sorted({0.0, hub / np.cos(angle), 2 * R, *np.linspace(0, 2 * R, 9)})
    wanted = [
        width
        * sum(
            quad(lambda s: stress(s)[k], a, b, epsabs=1e-13)[0]
            for a, b in itertools.pairwise(edges)
        )
        for k in range(3)
    ]
    found = loads(M0, CLeg(R, width, 0.0).outline(4000), (0, hub, angle), twist)
    np.testing.assert_allclose([*found.force, found.moment], wanted, rtol=2e-6)


@pytest.mark.parametrize("tension", ["keep", "cut"])
@pytest.mark.parametrize(
    "shape", [name for name, shape in OUTLINES.items() if not shape.outline(60).closed]
)
def test_either_side_of_a_sheet_may_lead(shape, tension):
    """Its points come in either order."""
    sheet, stress = (
        OUTLINES[shape].outline(60),
        dataclasses.replace(STRESSES["jumping"], tension=tension),
    )
    normals = (
        None if sheet.smooth_normals is None else -sheet.smooth_normals[::-1, ::-1]
    )
    other = Outline(sheet.points[::-1], sheet.width, normals)
    there, here = (
        loads(stress, outline, *random_motions(200, 3)) for outline in (other, sheet)
    )
    np.testing.assert_allclose(
        there.force, here.force, atol=1e-11 * np.abs(here.force).max()
    )
    assert (np.abs(here.force).max(-1) > 0).mean() > 0.5


@pytest.mark.parametrize("shape", OUTLINES)
def test_the_mirrored_scene_has_the_mirrored_force(shape):
    outline = OUTLINES[shape].outline(60)
    normals = (
        None
        if outline.smooth_normals is None
        else outline.smooth_normals[::-1, ::-1] * [-1, 1]
    )
    mirrored = Outline(outline.points[::-1] * [-1, 1], outline.width, normals)
    pose, twist = random_motions(200, 3)
    for stress in (M0, STRESSES["jumping"]):
        there, here = (
            loads(stress, mirrored, pose * [-1, 1, -1], twist * [-1, 1, -1]),
            loads(stress, outline, pose, twist),
        )
        size = np.abs(here.force).max()
        np.testing.assert_allclose(there.force, here.force * [-1, 1], atol=1e-11 * size)
        np.testing.assert_allclose(there.moment, -here.moment, atol=1e-12 * size)


@pytest.mark.parametrize("stress", STRESSES)
def test_power_is_never_positive(stress):
    """Over more than 100,000 random motions of all outlines; that of the parts cannot be, either."""
    for k, shape in enumerate(OUTLINES.values()):
        pose, twist = random_motions(1000, k)
        found = loads(STRESSES[stress], shape.outline(40), pose, twist)
        size = np.abs(found.force).max() * np.abs(twist).max(1)
        assert (found.power(twist) <= 1e-14 * size).all()
        assert (found.power(twist) < 0).sum() > 300
    assert 1000 * len(OUTLINES) * len(STRESSES) > 100_000


@pytest.mark.parametrize("shape", OUTLINES)
def test_the_force_depends_on_direction_alone_and_on_depth(shape):
    outline, stress = OUTLINES[shape].outline(50), STRESSES["poppy-seeds-close"]
    pose, twist = random_motions(50, 5)
    here = loads(stress, outline, pose, twist)
    np.testing.assert_allclose(
        loads(stress, outline, pose, 1e4 * twist).force, here.force, rtol=1e-9
    )
    np.testing.assert_array_equal(loads(stress, outline, pose, 0 * twist).force, 0.0)
    np.testing.assert_array_equal(
        loads(stress, outline, pose + [0, 1, 0], twist).force, 0.0
    )
    np.testing.assert_array_equal(
        loads(stress, outline, pose + [5, 0, 0], twist).force, here.force
    )
    deep = [
        loads(stress, outline, pose * [1, 0, 1] - [0, d, 0], twist).force
        for d in (1.0, 2.0, 3.0)
    ]
    np.testing.assert_allclose(
        deep[2] - deep[1], deep[1] - deep[0], atol=1e-9 * np.abs(deep[0]).max()
    )


def test_moments_about_another_point():
    """A frame moved along with the outline sees the same force, and the moment moved by r x F."""
    outline = OUTLINES["polygon"].outline(40)
    pose, twist = random_motions(100, 6)
    pose[:, 2] = 0.0
    shift = np.array([0.013, -0.007])
    moved = Outline(outline.points - shift, outline.width)
    there = np.stack([pose[:, 0] + shift[0], pose[:, 1] + shift[1], pose[:, 2]], -1)
    v = np.stack(
        [
            twist[:, 0] + twist[:, 2] * shift[1],
            twist[:, 1] - twist[:, 2] * shift[0],
            twist[:, 2],
        ],
        -1,
    )
    here, found = loads(M0, outline, pose, twist), loads(M0, moved, there, v)
    np.testing.assert_allclose(found.force, here.force, atol=1e-10)
    wanted = here.moment - (shift[1] * here.force[:, 0] - shift[0] * here.force[:, 1])
    np.testing.assert_allclose(found.moment, wanted, atol=1e-11)
    np.testing.assert_allclose(found.power(v), here.power(twist), rtol=1e-9)


def test_leading_axes_are_a_batch():
    outline = OUTLINES["c-leg"].outline(30)
    pose, twist = random_motions(12, 7)
    whole = loads(M0, outline, pose.reshape(3, 4, 3), twist.reshape(3, 4, 3))
    assert whole.force.shape == (3, 4, 2) and whole.moment.shape == (3, 4)
    one = loads(M0, outline, pose[5], twist[5])
    np.testing.assert_allclose(whole.force[1, 1], one.force, rtol=1e-13)
    every = loads(M0, outline, pose[:, None], twist[:4])
    np.testing.assert_allclose(
        every.force[5, 2], loads(M0, outline, pose[5], twist[2]).force, rtol=1e-13
    )


GROUNDS = [], [
    GrainInertia(2.0, 700.0), Slope(-0.2, 0.6), DisturbedGround((0.0, 0.03, -0.4), 0.02, 0.6),
    DisturbedGround((-0.1,), 0.05, 0.4), Aeration(0.01, 0.03),
]  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Own(PlateStress):
    """A map of one's own: alpha_x and alpha_z grow with how steeply a plate moves."""

    steep: float = 0.7
    grazing: float = 0.02
    tension: str = "cut"

    @formula
    def alpha_ahead(self, n, v):
        return 0.3 * v[0] - self.steep * n[0] * n[1] * v[0], 0.2 - self.steep * v[1]


@dataclasses.dataclass(frozen=True)
class Plain(Own):
    """The same without a formula."""

    def alpha_ahead(self, n, v):
        return 0.3 * np.asarray(v[0]) - self.steep * n[0] * n[1] * v[
            0
        ], 0.2 - self.steep * v[1]


@pytest.mark.parametrize("effects", GROUNDS, ids=["plain", "all effects"])
@pytest.mark.parametrize("shape", OUTLINES)
def test_compiled_loads_are_those_by_numpy(shape, effects):
    """Of every map, and of one's own, for elements that fill up eight or not."""
    pytest.importorskip("numba")
    pose, twist = random_motions(70, 3)
    for stress, elements in itertools.product([*STRESSES.values(), Own()], (5, 24)):
        outline = OUTLINES[shape].outline(elements)
        slow, fast = (
            loads(stress, outline, pose, twist, effects, backend)
            for backend in ("numpy", "numba")
        )
        for one, other in zip(slow, fast):
            np.testing.assert_allclose(
                other, one, rtol=0, atol=1e-13 * np.abs(one).max()
            )
    plain, own = (
        loads(Plain(), outline, pose, twist, effects),
        loads(Own(), outline, pose, twist, effects, "numpy"),
    )
    np.testing.assert_array_equal(plain.force, own.force)


@pytest.mark.parametrize("shape", OUTLINES)
def test_the_order_in_the_number_of_elements(shape):
    """rms over poses whose centre of rotation is not within the body: 2, and 1 where tension is cut, with the jump and
    with rounding."""
    pose, twist = random_motions(60, 8)
    twist[:, 2] = np.hypot(*twist[:, :2].T) * np.linspace(
        -5, 5, 60
    )  # centres 0.2 m away and more
    for stress in (
        STRESSES["jumping"],
        M0,
        StressMap(grazing=0.1),
        StressMap(tension="cut"),
    ):
        fine, errors = (
            loads(stress, OUTLINES[shape].outline(800), pose, twist).force,
            [],
        )
        for elements in (25, 50, 100, 200):
            found = loads(stress, OUTLINES[shape].outline(elements), pose, twist).force
            errors.append(np.sqrt(np.mean((found - fine) ** 2)) / np.abs(fine).max())
        slope = -np.polyfit(np.log([1, 2, 4, 8]), np.log(errors), 1)[0]
        assert slope > ORDER[stress.tension] - 0.3, errors
        assert errors[2] < 5e-4


def test_a_face_at_grazing_incidence_is_rounded_over_the_angle():
    """Of a square rod's underside: nothing as it slides along itself, all beyond the angle, straight in between."""
    rod, grazing = SquareRod(side=0.02, width=0.5).outline(8), 0.1
    share = lambda gamma: (
        _under(StressMap(grazing=grazing), rod, gamma)
        / _under(StressMap(grazing=0.0), rod, gamma)
    )
    assert (
        _under(StressMap(grazing=grazing), rod, 0.0)
        == _under(StressMap(grazing=0.0), rod, -1e-3)
        == 0.0
    )
    assert share(0.11) == pytest.approx(1.0, abs=1e-12)
    for gamma in (1e-6, 0.03, 0.09):
        assert share(gamma) == pytest.approx(np.sin(gamma) / np.sin(grazing), rel=1e-9)


def _under(stress, rod, gamma):
    """Upward force on the faces that look down."""
    at = contact.Motion(0.0, -0.3, 1.0, 0.0, np.cos(gamma), -np.sin(gamma), 0.0)
    ground = Ground(grazing_sine=np.sin(stress.grazing))
    force = contact.load(
        contact.record(stress), ground, contact.elements(rod), at, 1.0, True, False
    )
    return float(force.z[rod.normals[:, 1] < -0.5].sum())


def test_outlines_are_closed_face_outwards_and_have_their_size():
    """The area by normals (divergence theorem) is that of the shape."""
    lug = 0.004 * (0.006 + 0.03 * np.sqrt(1 - (0.004 / 0.06) ** 2))
    segment = 0.03**2 * (
        np.arcsin(0.004 / 0.06) - 0.004 / 0.06 * np.sqrt(1 - (0.004 / 0.06) ** 2)
    )
    areas = {
        "round-rod": np.pi * 4e-4, "half-cylinder": np.pi * 2e-4, "half-cylinder, flat up": np.pi * 2e-4, "square-rod": 9e-4,
        "wheel": np.pi * 9e-4,
        "wheel, lugs": np.pi * 9e-4 + 5 * (lug - 0.004 * 0.03 * np.sqrt(1 - (0.004 / 0.06) ** 2) - segment),
        "polygon": 0.5 * abs(0.05 * 0.02 - 0.02 * 0.01 + 0.02 * 0.05 - 0.01 * 0.02),
    }  # fmt: skip
    for name, shape in OUTLINES.items():
        outline = shape.outline(600)
        assert np.hypot(*outline.end_normals.T) == pytest.approx(1.0, abs=1e-12)
        assert (outline.end_normals * outline.normals[:, None]).sum(-1).min() > 0.99
        if outline.closed:
            flux = (outline.midpoints * outline.normals).sum(-1) @ outline.lengths / 2
            assert flux > 0
            if name in areas:
                assert flux == pytest.approx(areas[name], rel=2e-4), name
        assert 0.5 * 600 <= outline.elements <= 1.1 * 600 + 5


def test_legs_of_any_curvature_have_the_same_projected_length_and_a_smooth_family():
    for c in (-1.0, -0.5, -1e-9, 0.0, 1e-9, 0.3, 1.0):
        outline = CLeg(0.04, 0.02, c).outline(400)
        np.testing.assert_allclose(
            outline.points[[0, -1]], [(0, 0), (0, -0.08)], atol=1e-15
        )
        arc = 0.08 * (np.arcsin(c) / c if c else 1.0)
        assert outline.lengths.sum() == pytest.approx(arc, rel=1e-5)
        deepest = outline.points[200, 0]
        assert deepest == pytest.approx(-0.04 * c / (1 + np.sqrt(1 - c * c)), abs=1e-15)
    np.testing.assert_allclose(
        CLeg(0.04, 0.02, 0.7).outline(50).points * [-1, 1],
        CLeg(0.04, 0.02, -0.7).outline(50).points,
        atol=1e-15,
    )
    circle = CLeg(0.04, 0.02).outline(40).points - [0, -0.04]
    np.testing.assert_allclose(np.hypot(*circle.T), 0.04, rtol=1e-12)


def test_a_leg_that_turns_forwards_drives_forwards():
    leg, loose = CLeg(0.038, 0.025).outline(), VERTICAL["poppy-seeds-loose"].stress
    _, pose, twist = Rotate(hub_height=0.02).trajectory(leg)
    found = loads(loose, leg, pose, twist)
    assert found.force[:, 0].max() > 4 and found.force[:, 1].max() > 8
    assert found.moment.min() < -0.4 and found.moment.max() == 0  # against the rotation
    other = Rotate(
        hub_height=0.02, rate=-2 * np.pi, start=np.pi, stop=-np.pi
    ).trajectory(leg)
    assert loads(loose, leg, other.pose, other.twist).force[:, 0].min() < -2


def test_courses_have_the_velocities_of_their_poses():
    leg = OUTLINES["c-leg"].outline(20)
    t = np.linspace(0.0, 2.0, 4001)
    motions = [
        Drag(depth=0.03, direction=0.3, speed=0.2, distance=0.5, attitude=0.1),
        Penetrate(depth=0.05, direction=1.2, attitude=-0.4),
        Rotate(hub_height=0.02, rate=-3.0, start=1.0, stop=-2.0, speed=0.1), Path(t, np.sin(t), np.cos(2 * t), t**2),
    ]  # fmt: skip
    for motion in motions:
        t, pose, twist = motion.trajectory(leg)
        np.testing.assert_allclose(
            np.gradient(pose, t, axis=0, edge_order=2), twist, atol=1e-9
        )
    assert Drag(depth=0.03).trajectory(leg).pose[0].tolist() == [0.0, -0.03, 0.0]
    np.testing.assert_allclose(
        motions[3].trajectory(leg).twist[2000],
        (np.cos(1.0), -2 * np.sin(2.0), 2.0),
        atol=1e-5,
    )


def test_penetration_begins_at_the_surface_and_ends_at_its_depth():
    for name in ("half-cylinder", "c-leg", "wheel, lugs"):
        outline = OUTLINES[name].outline(300)
        motion = Penetrate(depth=0.04, attitude=0.7, direction=1.1)
        pose = motion.trajectory(outline).pose
        lowest = lambda p: (
            p[1]
            + outline.points[:, 1] * np.cos(p[2])
            - outline.points[:, 0] * np.sin(p[2])
        ).min()
        assert lowest(pose[0]) == pytest.approx(0.0, abs=1e-15)
        assert lowest(pose[-1]) == pytest.approx(-0.04, abs=1e-15)


def test_measured_maps_return_what_was_measured_and_converge():
    rng, errors = np.random.default_rng(4), []
    asked = rng.uniform(-np.pi, np.pi, (2, 400))
    for count in (7, 13, 25):
        beta, gamma = (
            x.ravel() for x in np.meshgrid(*[np.linspace(-90, 90, count) * RAD] * 2)
        )
        drags = PlateDrags(beta, gamma, *M0(beta, gamma), zeta=2.0)
        np.testing.assert_allclose(
            drags(beta, gamma), 2 * np.array(M0(beta, gamma)), atol=1e-9
        )
        errors.append(np.abs(np.array(drags(*asked)) - 2 * np.array(M0(*asked))).max())
    assert errors[2] < 0.03
    assert np.log2(errors[0] / errors[1]) > 1.6 and np.log2(errors[1] / errors[2]) > 1.6


def test_drags_of_plates_given_at_any_turn_are_the_same_map():
    beta, gamma = (
        x.ravel()
        for x in np.meshgrid(np.arange(-75, 91, 15) * RAD, np.arange(-90, 91, 15) * RAD)
    )
    turns = np.random.default_rng(9).integers(-3, 4, (2, beta.size))
    plain = PlateDrags(beta, gamma, *M0(beta, gamma))
    turned = PlateDrags(
        beta + np.pi * turns[0], gamma + 2 * np.pi * turns[1], *M0(beta, gamma)
    )
    mirrored = PlateDrags(-beta, np.pi - gamma, -M0(beta, gamma)[0], M0(beta, gamma)[1])
    for other in (turned, mirrored):
        np.testing.assert_allclose(
            other(beta + 1.0, gamma + 1.0), plain(beta + 1.0, gamma + 1.0), atol=2e-2
        )
        np.testing.assert_allclose(other(beta, gamma), M0(beta, gamma), atol=1e-9)
    twice = PlateDrags(
        [*beta, 0.0],
        [*gamma, 0.0],
        [*M0(beta, gamma)[0], 1.136],
        [*M0(beta, gamma)[1], 0.375],
    )
    np.testing.assert_allclose(twice(0.0, 0.0), (0.636, 0.375), atol=1e-9)  # the mean


def test_numbers_of_elements():
    """As asked for, or the fewest that the shape takes."""
    fewest = {
        "plate": 1, "round-rod": 8, "half-cylinder": 5, "half-cylinder, flat up": 5, "square-rod": 4, "c-leg": 1,
        "c-leg, reversed": 1, "flat-leg": 1, "wheel": 8, "wheel, lugs": 30, "polygon": 4, "polygon, open": 2, "spline": 8,
        "spline, open": 8,
    }  # fmt: skip
    assert {
        name: shape.outline(1).elements for name, shape in OUTLINES.items()
    } == fewest
    assert (
        SquareRod(0.1, 0.1).outline(40).elements
        == 40
        == RoundRod(0.1, 0.1).outline(40).elements
    )
    assert HalfCylinder(0.1, 0.1).outline(51).elements == 51


LIMITS = {
    "depth": [(Drag, 10), (lambda x: Drag(-x), 10), (Penetrate, 10)],
    "speed": [(lambda x: Drag(1, speed=x), 1e3), (lambda x: Rotate(1, speed=-x), 1e3)],
    "direction": [(lambda x: Drag(1, direction=x), 10)],
    "attitude": [
        (lambda x: Drag(1, attitude=-x), 10),
        (lambda x: Penetrate(1, attitude=x), 10),
    ],
    "distance": [(lambda x: Drag(1, distance=x), 1e3)],
    "hub_height": [(Rotate, 10)],
    "rate": [(lambda x: Rotate(1, rate=x), 1e3)],
    "start": [(lambda x: Rotate(1, start=-x), 1e3)],
    "stop": [(lambda x: Rotate(1, stop=x), 1e3)],
    "radius": [(lambda x: RoundRod(x, 1), 10)],
    "width": [(lambda x: Plate(1, x), 10)],
    "side": [(lambda x: SquareRod(x, 1), 10)],
    "tilt": [(lambda x: Plate(1, 1, -x), 100)],
    "relative_curvature": [(lambda x: CLeg(1, 1, -x), 1)],
    "zeta": [(lambda x: StressMap(zeta=x), 1e6)],
    "D10": [(lambda x: StressMap(D10=-x), 1e6)],
    "grazing": [(lambda x: StressMap(grazing=x), np.pi / 4)],
}


@pytest.mark.parametrize("name", LIMITS)
def test_limits(name):
    for make, largest in LIMITS[name]:
        make(largest)
        with pytest.raises(ValueError, match=f"{name} must be a number from "):
            make(largest * (1 + 1e-9))


CROSSES_BETWEEN_POINTS = [
    (0.026, 0),
    (0.003, 0.029),
    (-0.009, 0.023),
    (0.021, 0.043),
    (-0.039, 0.023),
]  # chords do not
REFUSED = [
    (lambda: StressMap(zeta=0), "zeta must be a number from 1e-06"),
    (lambda: StressMap(A00=np.nan), "A00 must be a number"),
    (lambda: StressMap(tension="half"), "tension must be 'keep' or 'cut', got 'half'"),
    (lambda: StressMap(grazing=1.0), "grazing must be a number from 0 to 0.785398"),
    (
        lambda: PlateDrags([0] * 5, [0] * 5, [0] * 5, [0] * 5),
        "plate drags must be 6 to 5000, got 5",
    ),
    (lambda: PlateDrags([0, 1], [0], [0], [0]), "must be equally many"),
    (
        lambda: PlateDrags(*[[0.1 * k for k in range(8)]] * 4),
        "no plate drag within 35 degrees of beta",
    ),
    (lambda: Plate(-1.0, 0.1), "length must be a number from 1e-06"),
    (lambda: CLeg(0.1, 0.1, 1.2), "relative_curvature must be a number from -1 to 1"),
    (
        lambda: Wheel(0.1, 0.1, lugs=40, lug_height=0.01, lug_width=0.02),
        "lug_width must be below 0.0157 m",
    ),
    (lambda: Wheel(0.1, 0.1, lug_height=0.01), "need lugs"),
    (lambda: CLeg(38, 0.02), "radius must be a number from 1e-06 to 10 m, got 38"),
    (
        lambda: Polygon([(0, 0), (40, 0), (0, 40)], 0.1),
        "points must be finite and within 10 m",
    ),
    (
        lambda: HalfCylinder(0.1, 0.1, flat="left"),
        "flat must be 'down' or 'up', got 'left'",
    ),
    (
        lambda: Polygon([(0, 0), (1, 1), (1, 0), (0, 1)], 0.1),
        "elements [0] and [2] of the outline cross or touch",
    ),
    (
        lambda: Polygon([(0, 0), (1, 0), (1, 0), (0, 1)], 0.1),
        "points [1] and the next are the same",
    ),
    (
        lambda: Polygon([(0, 0), (1, 0), (0.5, 0)], 0.1, closed=False),
        "turns back onto itself",
    ),
    (
        lambda: Polygon([(0, 0), (1, 0)], 0.1),
        "a closed outline takes 3 to 2000 points, got 2",
    ),
    (lambda: Polygon([(0, 0), (1, 0), (1, np.inf)], 0.1), "points must be finite"),
    (lambda: Polygon([(0, 0), (2, 0), (2, 1), (1, 0), (0, 1)], 0.1), "cross or touch"),
    (
        lambda: Spline(CROSSES_BETWEEN_POINTS, 0.1),
        "elements [3] and [6] of the outline cross or touch",
    ),
    (
        lambda: Polygon([(0, 0, 0), (1, 0, 0), (1, 1, 1)], 0.1),
        "points must be a list of (x, z)",
    ),
    (
        lambda: RoundRod(0.1, 0.1).outline(0),
        "elements must be a whole number from 1 to 5000",
    ),
    (lambda: Rotate(0.02, rate=1.0, start=1.0, stop=-1.0), "a rate from start to stop"),
    (lambda: Rotate(0.02, rate=0.0), "rate must not be 0"),
    (lambda: Penetrate(0.1, direction=-1.0), "direction must point downwards"),
    (lambda: Path([0, 1], [0, 1], [0, 1]), "a path takes 3 to 100000 poses, got 2"),
    (
        lambda: Path([0, 2, 1], [0, 1, 2], [0, 1, 2]),
        "t must ascend, but t = 2 is not before the next",
    ),
    (lambda: Path([0, 1, 2], [0, 1], [0, 1, 2]), "equally many"),
    (
        lambda: loads(M0, OUTLINES["plate"].outline(), (0, 0), (1, 0, 0)),
        "pose must have shape (..., 3), got (2,)",
    ),
    (
        lambda: loads(M0, OUTLINES["plate"].outline(), (0, 0, 0), (1, np.nan, 0)),
        "twist must be finite",
    ),
]


@pytest.mark.parametrize(("make", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_makes_no_sense_is_refused_with_one_line(make, said):
    with pytest.raises(ValueError, match=".") as caught:
        make()
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_kind_of_shape_is_in_the_registry():
    assert {type(shape) for shape in OUTLINES.values()} == set(SHAPES.values())
