"""Shapes whose velocities follow from others by symmetry, and what is 0 by symmetry."""

import dataclasses

import numpy as np
import pytest
from registry import BODIES, GAITS, SYSTEMS
from tabled import tabled

from geomech.mathematics.gaits import Butterfly, Circle, Fourier, Sine, Wave
from geomech.mathematics.geometry import connection, symmetry
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.representations.images import (
    cycle_images,
    images,
    solved_count,
)
from geomech.mathematics.geometry.traits import NOTHING, Traits
from geomech.mathematics.systems.swimmer import Swimmer
from geomech.scenes.model import Scene
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE, Chain, EndCaps, SkinFriction
from rft.bodies.base import body_size, is_reversible
from rft.core.premise import Premise
from rft.core.refusal import Refusal
from rft.laws.base import TermLaw

pytestmark = pytest.mark.usefixtures("fastest")

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
MIRROR = Traits(mirror=True)
BACKWARDS = Traits(reversible=True)
BOTH = Traits(mirror=True, reversible=True)
REVERSIBLE = {"three", "three-middle", "five", "backbone"}


@pytest.mark.parametrize("name", BODIES)
def test_which_bodies_are_reversible(name):
    assert is_reversible(BODIES[name]) == (name in REVERSIBLE)


@dataclasses.dataclass(frozen=True)
class Scales(TermLaw):
    """Drag that is less forwards."""

    def traction(self, v_t, v_n, eps=0.0):
        R = np.sqrt(v_t**2 + v_n**2 + eps**2) + 1e-300
        return np.where(v_t > 0, 0.8, 1.0) * v_t / R, 2.0 * v_n / R


SCALES = (SkinFriction(forward=0.109, backward=0.137),)
HEAVY_TAIL = (EndCaps(radius=0.06, tail=3.0),)


@pytest.mark.parametrize(
    ("medium", "body", "effects", "expected"),
    [
        (GLASS, Chain((1, 2, 1)), (), True),
        (GLASS, Chain((1, 2, 1)), (EndCaps(radius=0.06),), False),
        (GLASS, Chain((1, 2, 1)), SCALES, False),
        (GLASS, Chain((1, 2, 1), frame="link-1"), (), False),
        (GLASS, Chain((1, 2, 1 + 1e-9)), (), False),
        (Scales(), Chain((1, 2, 1)), (), False),
    ],
)
def test_what_else_tells_head_from_tail(medium, body, effects, expected):
    assert Swimmer(medium, body, effects).traits.reversible == expected


@pytest.mark.parametrize(
    ("body", "points", "count", "share"),
    [
        (Chain((1, 2, 1)), 8, 8, 4),
        (Chain((1, 1, 1), length=0.3, frame="link-2"), 9, 6, 4),
        (Chain((1, 2, 2, 1)), 4, 12, 2),  # no directions are others' images
    ],
)
def test_fields_are_those_of_all_shapes_with_fewer_balances(body, points, count, share):
    solved = []

    def velocity(alpha, alphadot):
        xi = Swimmer(GLASS, body).velocity(alpha, alphadot)
        solved.append(xi[..., 0].size)
        return xi

    axes = connection.grid(body.joints, points, 2.2)
    whole, part = (
        connection.fit(velocity, axes, count, trusted=True, traits=traits)
        for traits in (NOTHING, BOTH)
    )
    for name in ("A", "residual", "speed"):
        found = getattr(part, name)
        np.testing.assert_allclose(found, getattr(whole, name), rtol=0, atol=1e-9)
    assert solved[1] / solved[0] < 1 / share + 0.6 / points


def test_harmonics_are_those_of_all_shapes():
    velocity = Swimmer(GLASS, Chain((1, 2, 1))).velocity
    axes = connection.grid(2, 8, 2.2)
    whole, part = (
        harmonics.fit(velocity, axes, 8, highest=3, traits=traits).coefficients
        for traits in (NOTHING, BOTH)
    )
    np.testing.assert_allclose(part, whole, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("medium", "effects", "halved"),
    [(GLASS, SCALES, False), (Scales(), (), False), (GLASS, HEAVY_TAIL, True)],
)
def test_fields_of_bodies_that_slide_more_easily_forwards(medium, effects, halved):
    """Their velocity does not turn round with the rates, so that a mirror tells nothing
    of the same directions."""
    swimmer = Swimmer(medium, Chain((1, 2, 1)), effects)
    axes = connection.grid(2, 5, 1.5)
    assert swimmer.traits.mirror
    assert swimmer.traits.halved == halved
    whole, part = (
        connection.fit(swimmer.velocity, axes, 5, traits=traits, trusted=True)
        for traits in (NOTHING, swimmer.traits)
    )
    np.testing.assert_allclose(part.A, whole.A, rtol=0, atol=1e-9)
    np.testing.assert_allclose(part.residual, whole.residual, rtol=0, atol=1e-9)


SQUARE = connection.grid(2, 6, 1.0)


@pytest.mark.parametrize(
    ("axes", "count", "traits", "expected"),
    [
        (SQUARE, 8, BOTH, 3),
        (SQUARE, 8, BACKWARDS, 1),
        (SQUARE, 8, MIRROR, 1),
        (SQUARE, 5, BOTH, 1),  # the mirror alone
        (tuple(a + 0.1 for a in SQUARE), 8, BOTH, 1),
        ((SQUARE[0], SQUARE[1][:5]), 8, BOTH, 0),
    ],
)
def test_images_need_axes_and_directions_that_match(axes, count, traits, expected):
    found = images(axes, connection.directions(2, count), traits)
    assert len(found) == expected


ELLIPSE = Fourier(
    cos=((0.4,), (0.0,)), sin=((0.0,), (0.7,))
)  # its second half is the first in a mirror, and no more


THREE = Chain()
OTHER = Chain((1, 2, 0.5), 0.3, "link-2")
SIX = Chain((1,) * 6)
DIAGONAL = Circle(centre=(0.3, -0.3))
ACROSS = Circle(centre=(0.4, 0.4))
BACK = Circle(amplitude=0.7, reverse=True)


@pytest.mark.parametrize(
    ("body", "effects", "gait", "amplitudes", "phases", "count"),
    [
        (THREE, (), Circle(), None, 64, 17),
        (THREE, (), BACK, None, 48, 13),
        (THREE, (), Circle(), [0.0, -0.6, 1e-7, 1.4], 32, 9),
        (THREE, (), Circle(centre=(0.3, 0.1)), None, 32, 32),
        (THREE, (), DIAGONAL, None, 32, 17),
        (THREE, (), ACROSS, None, 32, 17),
        (THREE, (), Circle(), None, 45, 45),
        (THREE, (), Circle(), None, 42, 21),
        (OTHER, (), Circle(), None, 32, 16),
        (THREE, SCALES, Circle(), None, 32, 32),
        (THREE, HEAVY_TAIL, Circle(), None, 32, 16),
        (THREE, (), Butterfly(), [0.5, 1.2], 32, 9),
        (THREE, (), ELLIPSE, None, 32, 16),
        (THREE, (), GAITS["points"], None, 32, 32),
        (SIX, (), Sine(elements=6, waves=1.0), [0.1, 0.3], 32, 9),
    ],
)
def test_gaits_are_those_of_all_phases(body, effects, gait, amplitudes, phases, count):
    swimmer = Swimmer(GLASS, body, effects)
    alpha, alphadot = gait.cycle(phases, amplitudes)
    assert cycle_images(alpha, alphadot, swimmer.traits).count == count
    run = swimmer.run(alpha, alphadot, work=True)
    xi = swimmer.velocity(alpha, alphadot)
    size = np.abs(xi).max((-1, -2), keepdims=True) + 1e-300
    np.testing.assert_allclose(run.xi / size, xi / size, rtol=0, atol=1e-10)
    power = swimmer.work(alpha, alphadot, xi).power
    np.testing.assert_allclose(run.work.power, power, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("part", [0, 1])
@pytest.mark.parametrize(("gait", "off"), [(0, 1e-9), (1, 1e-15)])
@pytest.mark.parametrize("place", [(20, 1), (3, 0)])
def test_what_is_nearly_an_image_is_none(part, gait, off, place):
    """Neither shapes nor rates, of a large gait or of a small one beside it."""
    cycle = [x.copy() for x in Circle().cycle(32, [1.0, 1e-6])]
    assert cycle_images(*cycle, BOTH).count == 9
    cycle[part][gait][place] += off
    assert cycle_images(*cycle, BOTH).count == 32


@pytest.mark.parametrize("name", GAITS)
def test_few_phases_tell_how_many_are_solved(name):
    """Of any number; images lie on phases of some of these only."""
    for traits in (NOTHING, MIRROR, BACKWARDS, BOTH):
        for phases in (32, 201, 1024, 2049, 4096):
            solved = cycle_images(*GAITS[name].cycle(phases), traits).count
            assert solved_count(GAITS[name], phases, traits) == solved


def test_a_million_phases_are_counted():
    assert solved_count(Circle(), 1_000_000, BOTH) == 250_001
    assert solved_count(Sine(elements=100), 1_000_000, MIRROR) == 500_000


def test_gaits_side_by_side_have_the_images_that_all_have():
    cycles = zip(Circle().cycle(32), Butterfly().cycle(32))
    assert cycle_images(*map(np.stack, cycles), BOTH).count == 16


# Components of a displacement that are 0 by symmetry.

# Two harmonics: the second half of the cycle is the image of the first head for tail,
# and of nothing else.
HEAD_FOR_TAIL = Fourier(cos=((1.0, 0.3), (1.0, -0.3)), sin=((0.2, 0.1), (0.2, -0.1)))
ODD_WAVES = Fourier(
    cos=((0.5, 0.0, 0.1), (0.1, 0.0, 0.2)), sin=((0.2, 0.0, 0.05), (0.5, 0.0, 0.1))
)  # and else of no symmetry
ALIKE = Fourier(
    cos=((0.5, 0.0), (0.5, 0.0)), sin=((0.0, 0.2), (0.0, 0.2))
)  # alpha_1 = alpha_2
OPPOSITE = Fourier(
    cos=((0.5, 0.0), (-0.5, 0.0)), sin=((0.0, 0.2), (0.0, -0.2))
)  # alpha_1 = -alpha_2
SINES = Fourier(
    cos=((0.0, 0.0), (0.0, 0.0)), sin=((0.5, 0.2), (-0.5, 0.2))
)  # backwards their own mirror image
HALVES = Fourier(cos=((1, 0.4), (-1, 0.4)), sin=((0, 0.2), (0, 0.2)))
RESTING = Fourier(
    cos=((0.5, 0.0), (0.0, 0.0)), sin=((0.0, 0.0), (0.3, -0.15))
)  # at phase 0, and no retraced path
RETRACING = Fourier(
    cos=((0.5, 0.3), (0.4, 0.1)), sin=((0.0, 0.0), (0.0, 0.0))
)  # the same path there and back


@pytest.mark.parametrize(("gait", "traits", "zero"), [
    (Circle(), BOTH, ["heading"]),  # its y is that of a cycle from phase 0
    (Circle(), Traits(mirror=True, odd=False), ["heading"]),
    (Circle(), Traits(reversible=True), ["heading"]),
    (Circle(), Traits(reversible=True, odd=False), []),
    (Circle(), Traits(), []),
    (Circle(centre=(0.2, 0.1)), BOTH, []),
    (Circle(), dataclasses.replace(BOTH, lacks=Premise.MEMORYLESS), []),
    (Butterfly(), BOTH, ["y", "heading"]),
    (Butterfly(), Traits(reversible=True), ["heading"]),
    (Wave(joints=6), BOTH, ["y", "heading"]),
    (Wave(joints=6, offset=0.1), BOTH, []),
    (Wave(joints=2, waves=0.0), BOTH, ["x", "y", "heading"]),
    (HALVES, dataclasses.replace(BOTH, odd=False), ["heading"]),
    (RETRACING, Traits(), ["x", "y", "heading"]),
    (RETRACING, Traits(odd=False), []),
    (HEAD_FOR_TAIL, Traits(reversible=True), []),
    (ODD_WAVES, Traits(mirror=True), ["heading"]),
    (ALIKE, BOTH, ["x", "heading"]),
    (OPPOSITE, BOTH, ["x", "y"]),
    (RESTING, Traits(), []),
])  # fmt: skip
def test_zeros_follow_from_traits_and_curve(gait, traits, zero):
    assert list(symmetry.zero_components(traits, gait)) == zero
    assert list(symmetry.zero_components(traits, gait, [0.5, 1.0])) == zero


@pytest.mark.parametrize(("gait", "reasons"), [
    (Butterfly(), {"y": symmetry.BACKWARDS, "heading": symmetry.MIRRORED}),
    (ALIKE, {"x": symmetry.ALWAYS, "heading": symmetry.BACKWARDS}),
    (OPPOSITE, {"x": symmetry.ALWAYS, "y": symmetry.ALWAYS}),
    (SINES, {"x": symmetry.REFLECTED, "heading": symmetry.BACKWARDS}),
    (RETRACING, dict.fromkeys(("x", "y", "heading"), symmetry.RETRACED)),
])  # fmt: skip
def test_each_zero_has_its_reason(gait, reasons):
    assert symmetry.zero_components(BOTH, gait) == reasons


@pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))
@pytest.mark.parametrize("name", SYSTEMS)
def test_displacements_have_the_zeros_that_are_claimed(name, gait):
    system = SYSTEMS[name]
    small = dataclasses.replace(gait, amplitude=0.5 * gait.amplitude)
    try:
        study = SceneTables(Scene(system, small))
        found = tabled(study.displacements([small.amplitude], ["direct"]))
    except Refusal:
        return  # of other joints, or through singular shapes
    for component in found["zero_by_symmetry"]:
        assert abs(found[component]["direct"][0]) < 1e-9 * body_size(system)
