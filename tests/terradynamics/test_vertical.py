"""The vertical plane: the stress map against its definition, loads against adaptive
quadrature, mirror images and far finer computations."""

import dataclasses
import itertools

import numpy as np
import pytest
from refusals import refuses
from registry import OUTLINES, STRESSES
from scipy.integrate import quad

from rft.formulas.vectors import formula
from rft.terradynamics.ground import (
    Aeration,
    DisturbedGround,
    GrainInertia,
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
    loads,
    survey,
)
from rft.terradynamics.plates.loads import ORDER

pytestmark = pytest.mark.usefixtures("fastest")

RAD = np.pi / 180
M0 = StressMap()
# Table S2 of Li, Zhang and Goldman (2013).
GENERIC = (0.206, 0.169, 0.212, 0.358, 0.055, -0.124, 0.253, 0.007, 0.088)
LOOSE = (0.051, 0.047, 0.053, 0.083, 0.020, -0.026, 0.057, 0.0, 0.025)
CLOSE = (0.094, 0.092, 0.092, 0.151, 0.035, -0.039, 0.086, 0.018, 0.046)


def by_definition(beta, gamma, coefficients=GENERIC):
    """Return alpha_x, alpha_z for angles within +-pi/2, term by term."""
    A00, A10, B11, B01, Bm11, C11, C01, Cm11, D10 = coefficients
    up = A00 + A10 * np.cos(2 * beta) + B11 * np.sin(2 * beta + gamma)
    up = up + B01 * np.sin(gamma) + Bm11 * np.sin(-2 * beta + gamma)
    back = C11 * np.cos(2 * beta + gamma) + C01 * np.cos(gamma)
    back = back + Cm11 * np.cos(-2 * beta + gamma) + D10 * np.sin(2 * beta)
    return back, up


def random_motions(count, seed=0):
    """Return poses about the surface and twists that mix travel and turning."""
    rng = np.random.default_rng(seed)
    pose = rng.uniform([[-1], [-0.08], [-3]], [[1], [0.04], [3]], (3, count)).T
    twist = rng.normal(size=(count, 3)) * [0.05, 0.05, 1.0]
    return pose, twist * 10 ** rng.uniform(-2, 2, (count, 1))


@pytest.mark.parametrize(
    ("stress", "coefficients", "zeta"),
    [
        (StressMap(zeta=0.3), GENERIC, 0.3),
        (StressMap(*range(1, 10)), range(1, 10), 1),
        (VERTICAL["glass-3mm"].stress, GENERIC, 0.224),
        (VERTICAL["poppy-seeds-loose"].stress, LOOSE, 1),
        (VERTICAL["poppy-seeds-close"].stress, CLOSE, 1),
    ],
)
def test_the_map_is_its_fourier_sum(stress, coefficients, zeta):
    angles = np.random.default_rng(1).uniform(-np.pi / 2, np.pi / 2, (2, 1000))
    expected = zeta * np.array(by_definition(*angles, coefficients))
    np.testing.assert_allclose(stress(*angles), expected, atol=1e-13)


@pytest.mark.parametrize("name", STRESSES)
def test_all_angles_follow_by_mirror_symmetry_and_half_a_turn(name):
    beta, gamma = np.random.default_rng(2).uniform(-7, 7, (2, 500))
    stress = STRESSES[name]
    a_x, a_z = stress(beta, gamma)
    assert np.isfinite([a_x, a_z]).all()
    rounding = 1e-9 if name == "measured" else 1e-13
    for angles, side in (
        ((beta + np.pi, gamma), 1),
        ((beta - np.pi, gamma), 1),
        ((beta, gamma - 2 * np.pi), 1),
        ((-beta, np.pi - gamma), -1),
        ((-beta, -np.pi - gamma), -1),
    ):
        np.testing.assert_allclose(stress(*angles), [side * a_x, a_z], atol=rounding)


# N/cm^3, on a level plate that is pushed down.
DOWN = {
    "generic": 1.0,
    "poppy-seeds-loose": 0.254,
    "poppy-seeds-close": 0.464,
    "glass-3mm": 0.224,
    "poppy-seeds-loose-scaled": 0.24,
    "poppy-seeds-close-scaled": 0.422,
}


@pytest.mark.parametrize("name", VERTICAL)
def test_named_media_have_their_strength_and_take_power_at_all_angles(name):
    stress = VERTICAL[name].stress
    assert stress(0.0, np.pi / 2)[1] == pytest.approx(DOWN[name], abs=1e-12)
    assert survey(stress).pushing == 0


def test_a_survey_finds_what_drives_a_motion_on():
    """As a map whose sign is lost in one coefficient: force times unit velocity."""
    lost = (*GENERIC[:3], -0.358, *GENERIC[4:])
    found = survey(StressMap(*lost, tension="cut"), cells=90)
    ahead = slice(45, 135)
    beta, gamma = np.meshgrid(found.beta, found.gamma[ahead], indexing="ij")
    a_x, a_z = by_definition(beta, gamma, lost)
    power = -a_x * np.cos(gamma) - a_z * np.sin(gamma)
    np.testing.assert_allclose(found.power[:, ahead], power, atol=1e-14)
    assert found.pushing == pytest.approx((power > 0).mean(), abs=1e-12)
    face = np.sign(np.sin(beta + gamma).round(12))
    pulled = (-np.sin(beta) * a_x - np.cos(beta) * a_z) * face > 0
    assert found.pulling == pytest.approx(pulled.mean(), abs=1e-12)


def test_a_survey_says_where_most_is_driven():
    found = survey(StressMap(zeta=0.3), cells=90)
    power = np.full((90, 180), -1.0)
    power[60, 10] = 0.5
    power[20, 110:119] = 0.25
    described = dataclasses.replace(found, power=power).description()
    beta = np.degrees(found.beta[60])
    gamma = np.degrees(found.gamma[10])
    assert f"beta = {beta:.0f}, gamma = {gamma:.0f} " in described
    assert f"{100 * 10 / power.size:.1f} %" in described
    assert f"{100 * found.pulling:.1f} %" in described
    still = dataclasses.replace(found, power=0 * power, normal=0 * power)
    assert "%" not in still.description()


@pytest.mark.parametrize("grazing", [0.0, M0.grazing])
@pytest.mark.parametrize(
    ("rod", "tension", "expected"),
    [
        (RoundRod(1e-5, 1.0), "keep", 0.81),
        (RoundRod(1e-5, 1.0), "cut", 0.68),
        (HalfCylinder(1e-5, 1.0), "keep", 0.54),
        (HalfCylinder(1e-5, 1.0), "cut", 0.04),
        (HalfCylinder(1e-5, 1.0, flat="up"), "keep", 0.99),
        (HalfCylinder(1e-5, 1.0, flat="up"), "cut", 0.99),
        (SquareRod(1e-5, 1.0), "keep", 0.1),
        (SquareRod(1e-5, 1.0), "cut", 0.1),
    ],
)
def test_lift_over_drag_of_rods_at_one_depth(rod, tension, expected, grazing):
    stress = StressMap(tension=tension, grazing=grazing, zeta=0.3)
    x, z = loads(stress, rod.outline(400), (0, -1, 0), (0.2, 0, 0)).force
    assert -z / x == pytest.approx(expected, abs=0.005)


def test_a_turning_plate_against_adaptive_quadrature():
    """Flat leg about a hub above the surface that moves, too: every point has its own
    direction."""
    hub = 0.015
    angle = 0.4
    twist = (0.05, -0.02, 3.0)
    # A positive angle has swept the leg backwards.
    down = np.array([-np.sin(angle), -np.cos(angle)])

    def load(s, k):
        r = s * down
        v = (twist[0] + twist[2] * r[1], twist[1] - twist[2] * r[0])
        gamma = np.arctan2(-v[1], v[0])
        beta = np.arctan2(down[1], down[0]) + np.pi
        back = abs(gamma) > np.pi / 2
        if back:
            beta = np.pi - beta
            gamma = np.sign(gamma) * np.pi - gamma
        a_x, a_z = by_definition(beta, gamma)
        f = -min(hub + r[1], 0) * 2e4 * np.array([a_x if back else -a_x, a_z])
        return [*f, r[1] * f[0] - r[0] * f[1]][k]

    edges = sorted({hub / np.cos(angle), *np.linspace(0, 0.06, 9)})
    expected = [
        sum(quad(load, *ends, k, epsabs=1e-13)[0] for ends in itertools.pairwise(edges))
        for k in range(3)
    ]
    found = loads(M0, CLeg(0.03, 0.02, 0.0).outline(4000), (0, hub, angle), twist)
    np.testing.assert_allclose([*found.force, found.moment], expected, rtol=2e-6)


def reversed_outline(outline, signs=(1, 1)):
    """Return an outline with its points in the other order, and mirrored by signs."""
    normals = outline.smooth_normals
    if normals is not None:
        side = -np.prod(signs)
        normals = side * normals[::-1, ::-1] * signs
    return Outline(outline.points[::-1] * signs, outline.width, normals)


@pytest.mark.parametrize("stress", [M0, STRESSES["jumping"]])
@pytest.mark.parametrize("shape", OUTLINES)
def test_the_mirrored_scene_has_the_mirrored_force(shape, stress):
    outline = OUTLINES[shape].outline(60)
    mirrored = reversed_outline(outline, (-1, 1))
    pose, twist = random_motions(200, 3)
    there = loads(stress, mirrored, pose * [-1, 1, -1], twist * [-1, 1, -1])
    here = loads(stress, outline, pose, twist)
    size = np.abs(here.force).max()
    np.testing.assert_allclose(there.force, here.force * [-1, 1], atol=1e-11 * size)
    np.testing.assert_allclose(there.moment, -here.moment, atol=1e-12 * size)


@pytest.mark.parametrize("stress", STRESSES)
def test_power_is_never_positive(stress):
    """Over more than 100,000 random motions of all outlines; that of the parts cannot
    be, either."""
    for k, shape in enumerate(OUTLINES.values()):
        pose, twist = random_motions(1000, k)
        found = loads(STRESSES[stress], shape.outline(40), pose, twist)
        power = found.power(twist)
        size = np.abs(found.force).max() * np.abs(twist).max(1)
        assert (power <= 1e-14 * size).all()
        assert (power < 0).sum() > 300


@pytest.mark.parametrize("shape", OUTLINES)
def test_the_force_depends_on_the_direction_of_motion_below_the_surface(shape):
    outline = OUTLINES[shape].outline(50)
    pose, twist = random_motions(50, 5)

    def force(pose, factor=1.0):
        return loads(STRESSES["poppy-seeds-close"], outline, pose, factor * twist).force

    np.testing.assert_allclose(force(pose, 1e4), force(pose), rtol=1e-9)
    assert not force(pose, 0.0).any()
    assert not force(pose + [0, 1, 0]).any()


EFFECTS = [
    GrainInertia(2.0, 700.0),
    Slope(-0.2, 0.6),
    DisturbedGround((0.0, 0.03, -0.4), 0.02, 0.6),
    DisturbedGround((-0.1,), 0.05, 0.4),
    Aeration(0.01, 0.03),
]


@dataclasses.dataclass(frozen=True)
class Own(PlateStress):
    """Custom map: alpha_x and alpha_z grow with how steeply a plate moves."""

    grazing: float = 0.02
    tension: str = "cut"

    @formula
    def alpha_ahead(self, n, v):
        return 0.3 * v[0] - 0.7 * n[0] * n[1] * v[0], 0.2 - 0.7 * v[1]


class Plain(Own):
    """The same without a formula."""

    def alpha_ahead(self, n, v):
        return 0.3 * v[0] - 0.7 * n[0] * n[1] * v[0], 0.2 - 0.7 * v[1]


@pytest.mark.parametrize("elements", [5, 24])
@pytest.mark.parametrize("effects", [[], EFFECTS], ids=["plain", "all effects"])
@pytest.mark.parametrize("shape", OUTLINES)
@pytest.mark.usefixtures("compiled_code")
def test_compiled_loads_are_those_by_numpy(shape, effects, elements):
    """Of every map, and of custom ones, for elements that fill up eight or not."""
    outline = OUTLINES[shape].outline(elements)
    motions = random_motions(70, 3)
    for stress in (*STRESSES.values(), Own()):
        slow = loads(stress, outline, *motions, effects, "numpy")
        fast = loads(stress, outline, *motions, effects, "numba")
        for one, other in zip(slow, fast):
            np.testing.assert_allclose(other, one, atol=1e-13 * np.abs(one).max())
    plain = loads(Plain(), outline, *motions, effects)
    np.testing.assert_array_equal(plain.force, slow.force)


@pytest.mark.parametrize(
    "stress",
    [STRESSES["jumping"], M0, StressMap(grazing=0.1), StressMap(tension="cut")],
    ids=["jumping", "generic", "rounded", "cut"],
)
@pytest.mark.parametrize("shape", OUTLINES)
def test_the_order_in_the_number_of_elements(shape, stress):
    """rms over poses with a centre of rotation 0.2 m away or more: 2, with tension cut
    1."""
    pose, twist = random_motions(60, 8)
    twist[:, 2] = np.hypot(*twist[:, :2].T) * np.linspace(-5, 5, 60)
    counts = (25, 50, 100, 200, 800)
    outlines = [OUTLINES[shape].outline(count) for count in counts]
    *coarse, fine = (loads(stress, one, pose, twist).force for one in outlines)
    errors = np.sqrt(np.mean((coarse - fine) ** 2, (1, 2))) / np.abs(fine).max()
    slope = -np.polyfit(np.log(counts[:4]), np.log(errors), 1)[0]
    assert slope > ORDER[stress.tension] - 0.3
    assert errors[2] < 5e-4


@pytest.mark.parametrize("gamma", [1e-6, 0.03, 0.09, 0.11])
def test_a_face_at_grazing_incidence_is_rounded_over_the_angle(gamma):
    """The bottom of a square rod bears less in proportion to the sine of the angle."""
    rod = SquareRod(side=0.02, width=0.5).outline(8)
    bottom = Plate(length=0.02, width=0.5).outline(8)
    twist = (np.cos(gamma), -np.sin(gamma), 0)
    soft = loads(StressMap(grazing=0.1), rod, (0, -0.3, 0), twist).force
    sharp = loads(StressMap(grazing=0.0), rod, (0, -0.3, 0), twist).force
    full = loads(StressMap(grazing=0.0), bottom, (0, -0.31, 0), twist).force
    share = min(np.sin(gamma) / np.sin(0.1), 1.0)
    np.testing.assert_allclose(soft, sharp - (1 - share) * full, rtol=1e-9)


LUG = 0.004 / 0.06
CHORD = np.sqrt(1 - LUG**2)
AREAS = {
    "round-rod": np.pi * 4e-4,
    "half-cylinder": np.pi * 2e-4,
    "half-cylinder, flat up": np.pi * 2e-4,
    "square-rod": 9e-4,
    "wheel": np.pi * 9e-4,
    # The foot of a lug is the chord of a segment.
    "wheel, lugs": np.pi * 9e-4
    + 5 * (0.004 * 0.006 - 0.03**2 * (np.arcsin(LUG) - LUG * CHORD)),
    "polygon": 1e-3 * 0.5 * abs(1.0 - 0.2 + 1.0 - 0.2),
}


@pytest.mark.parametrize("name", OUTLINES)
def test_outlines_are_closed_face_outwards_and_have_their_size(name):
    """The area by normals (divergence theorem) is that of the shape."""
    outline = OUTLINES[name].outline(600)
    assert np.hypot(*outline.end_normals.T) == pytest.approx(1.0, abs=1e-12)
    assert (outline.end_normals * outline.normals[:, None]).sum(-1).min() > 0.99
    flux = (outline.midpoints * outline.normals).sum(-1) @ outline.lengths / 2
    if outline.closed:
        assert flux > 0
        assert flux == pytest.approx(AREAS.get(name, flux), rel=2e-4)
    assert 0.5 * 600 <= outline.elements <= 1.1 * 600 + 5


@pytest.mark.parametrize("curvature", [-1.0, -0.5, -1e-9, 0.0, 1e-9, 0.3, 1.0])
def test_legs_of_any_curvature_have_the_same_projected_length(curvature):
    outline = CLeg(0.04, 0.02, curvature).outline(400)
    ends = outline.points[[0, -1]]
    np.testing.assert_allclose(ends, [(0, 0), (0, -0.08)], atol=1e-15)
    arc = 0.08 * np.arcsin(curvature or 1e-9) / (curvature or 1e-9)
    assert outline.lengths.sum() == pytest.approx(arc, rel=1e-5)
    deepest = -0.04 * curvature / (1 + np.sqrt(1 - curvature**2))
    assert outline.points[200, 0] == pytest.approx(deepest, abs=1e-15)


T = np.linspace(0.0, 2.0, 4001)


@pytest.mark.parametrize(
    "motion",
    [
        Drag(depth=0.03, direction=0.3, speed=0.2, distance=0.5, attitude=0.1),
        Penetrate(depth=0.05, direction=1.2, attitude=-0.4),
        Rotate(hub_height=0.02, rate=-3.0, start=1.0, stop=-2.0, speed=0.1),
        Path(T, np.sin(T), np.cos(2 * T), T**2),
    ],
    ids=lambda motion: type(motion).__name__,
)
def test_motions_have_the_velocities_of_their_poses(motion):
    t, pose, twist = motion.trajectory(OUTLINES["c-leg"].outline(20))
    rates = np.gradient(pose, t, axis=0, edge_order=2)
    np.testing.assert_allclose(rates, twist, atol=1e-9)


@pytest.mark.parametrize("name", ["half-cylinder", "c-leg", "wheel, lugs"])
def test_penetration_begins_at_the_surface_and_ends_at_its_depth(name):
    outline = OUTLINES[name].outline(300)
    motion = Penetrate(depth=0.04, attitude=0.7, direction=1.1)
    pose = motion.trajectory(outline).pose
    lowest = (outline.points @ [-np.sin(0.7), np.cos(0.7)]).min()
    np.testing.assert_allclose(pose[[0, -1], 1] + lowest, [0.0, -0.04], atol=1e-15)


def test_measured_maps_return_what_was_measured_and_are_smooth_between():
    """Of plates given at any turn, and mirrored."""
    rng = np.random.default_rng(4)
    line = np.linspace(-90, 90, 25) * RAD
    beta, gamma = (x.ravel() for x in np.meshgrid(line, line))
    turns = rng.integers(-3, 4, (2, beta.size)) * np.pi
    a_x, a_z = M0(beta, gamma)
    plain = PlateDrags(beta + turns[0], gamma + 2 * turns[1], a_x, a_z, zeta=2.0)
    mirrored = PlateDrags(-beta, np.pi - gamma, -a_x, a_z, zeta=2.0)
    asked = rng.uniform(-np.pi, np.pi, (2, 400))
    for drags in (plain, mirrored):
        np.testing.assert_allclose(drags(beta, gamma), (2 * a_x, 2 * a_z), atol=1e-9)
        np.testing.assert_allclose(drags(*asked), 2 * np.array(M0(*asked)), atol=0.03)


def test_every_kind_of_shape_is_in_the_registry():
    assert {type(shape) for shape in OUTLINES.values()} == set(SHAPES.values())


LINE = [0.1 * k for k in range(8)]
BOWTIE = [(0, 0), (1, 1), (1, 0), (0, 1)]
TOUCHES = [(0, 0), (2, 0), (2, 1), (1, 0), (0, 1)]
FLAT = OUTLINES["plate"].outline()
# The chords between its points do not cross.
LOOP = [(0.026, 0), (0.003, 0.029), (-0.009, 0.023), (0.021, 0.043), (-0.039, 0.023)]
REFUSED = [
    (lambda: PlateDrags(*[[0] * 5] * 4), "6 5000 5"),
    (lambda: PlateDrags([0, 1], [0], [0], [0]), "beta gamma alpha_x alpha_z length"),
    (lambda: PlateDrags(*[LINE] * 4), "35 degrees beta gamma"),
    (lambda: Wheel(0.1, 0.1, 40, 0.01, 0.02), "lug_width 0.0157 m"),
    (lambda: Wheel(0.1, 0.1, lug_height=0.01), "lugs | instead"),
    (
        lambda: Polygon(BOWTIE, 0.1),
        "[0] [2] | instead",
    ),
    (lambda: Polygon(TOUCHES, 0.1), "intersect | instead"),
    (lambda: Spline(LOOP, 0.1), "[3] [6] | instead"),
    (
        lambda: Polygon([(0, 0), (1, 0), (0.5, 0)], 0.1, closed=False),
        "[0] point | instead",
    ),
    (lambda: Rotate(0.02, rate=0.0), "rate 0 drag | instead"),
    (lambda: Path([0, 2, 1], [0, 1, 2], [0, 1, 2]), "t 2"),
    (lambda: Path([0, 1, 2], [0, 1], [0, 1, 2]), "t, x, z angle length"),
    (lambda: loads(M0, FLAT, (0, 0), (1, 0, 0)), "pose (..., 3) | value"),
    (lambda: loads(M0, FLAT, (0, 0, 0), (1, np.nan, 0)), "twist finite"),
]


@pytest.mark.parametrize(("build", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_makes_no_sense_is_refused_with_one_line(build, said):
    with refuses(said):
        build()
