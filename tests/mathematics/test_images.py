"""Shapes whose velocities follow from others by symmetry, and bodies that are alike in no such way."""

import dataclasses
import time

import numpy as np
import pytest
from registry import BODIES, GAITS

from geomech.mathematics.gaits import Butterfly, Circle, Fourier, Sine
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.representations.images import (
    cycle_images,
    images,
    solved_count,
    to_solve,
)
from geomech.mathematics.geometry.traits import NOTHING, Traits
from geomech.mathematics.systems.swimmer import Swimmer
from rft import CATALOGUE, Chain, EndCaps, GrainInertia, SkinFriction
from rft.bodies.base import is_reversible
from rft.laws.base import TermLaw, is_odd

pytestmark = pytest.mark.usefixtures("fastest")

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
MIRROR, BACKWARDS, BOTH = (
    Traits(mirror=True),
    Traits(reversible=True),
    Traits(mirror=True, reversible=True),
)
REVERSIBLE = {
    "two": False, "three": True, "three-middle": True, "uneven": False, "five": True, "modes": False,
    "serpenoid": False, "arcs": False, "backbone": True,
}  # fmt: skip


@pytest.mark.parametrize("name", BODIES)
def test_which_bodies_are_reversible(name):
    """By their own elements: a link longer at one end, a frame that sits at one end, modes that are not."""
    assert is_reversible(BODIES[name]) == REVERSIBLE[name]


def test_what_else_tells_head_from_tail():
    chain = Chain((1, 2, 1))
    assert Swimmer(GLASS, chain).traits.reversible
    assert not Swimmer(GLASS, chain, (EndCaps(radius=0.06),)).traits.reversible
    assert not Swimmer(
        GLASS, chain, (SkinFriction(forward=0.109, backward=0.137),)
    ).traits.reversible
    assert not Swimmer(
        GLASS, dataclasses.replace(chain, frame="link-1")
    ).traits.reversible
    assert not Swimmer(Scales(), chain).traits.reversible
    assert is_odd(GLASS)
    assert not is_reversible(Chain((1, 2, 1 + 1e-9)))


@dataclasses.dataclass(frozen=True)
class Scales(TermLaw):
    """Drag that is less forwards."""

    def traction(self, v_t, v_n, eps=0.0):
        R = np.sqrt(v_t**2 + v_n**2 + eps**2) + 1e-300
        return np.where(v_t > 0, 0.8, 1.0) * v_t / R, 2.0 * v_n / R


@pytest.mark.parametrize(("body", "points", "count"), [
    (Chain((1, 2, 1)), 8, 8), (Chain((1, 1, 1), length=0.3, frame="link-2"), 9, 6), (Chain((1, 2, 2, 1)), 4, 12),
])  # fmt: skip
def test_fields_are_those_of_all_shapes(body, points, count):
    """With fewer balances: a quarter, or half where the directions of three joints are not their own images."""
    asked = []

    def velocity(alpha, alphadot):
        xi = Swimmer(GLASS, body).velocity(alpha, alphadot)
        asked.append(xi[..., 0].size)
        return xi

    axes = connection.grid(body.joints, points, 2.2)
    whole, part = (
        connection.fit(velocity, axes, count, trusted=True, traits=traits)
        for traits in (NOTHING, BOTH)
    )
    for name in ("A", "residual", "speed"):
        np.testing.assert_allclose(
            getattr(part, name), getattr(whole, name), rtol=0, atol=1e-9
        )
    if body.joints == 2:
        odd, alike = (
            harmonics.fit(velocity, axes, count, highest=3, traits=traits)
            for traits in (NOTHING, BOTH)
        )
        np.testing.assert_allclose(
            alike.coefficients, odd.coefficients, rtol=0, atol=1e-9
        )
    share = 4 if body.joints == 2 else 2
    assert asked[1] / asked[0] < 1 / share + 0.6 / points
    assert to_solve([], 5).all()


@pytest.mark.parametrize(("medium", "effects"), [
    (GLASS, (SkinFriction(forward=0.109, backward=0.137),)), (Scales(), ()), (GLASS, (EndCaps(radius=0.06, tail=3.0),)),
])  # fmt: skip
def test_fields_of_bodies_that_slide_more_easily_forwards(medium, effects):
    """Their velocity does not turn round with the rates, so that a mirror tells nothing of the same directions."""
    swimmer, axes = (
        Swimmer(medium, Chain((1, 2, 1)), effects),
        connection.grid(2, 5, 1.5),
    )
    assert swimmer.traits.mirror and swimmer.traits.halved == (
        type(effects[0]) is EndCaps if effects else False
    )
    whole, part = (
        connection.fit(swimmer.velocity, axes, 5, trusted=True),
        connection.fit(swimmer.velocity, axes, 5, traits=swimmer.traits, trusted=True),
    )
    for name in ("A", "residual", "speed"):
        np.testing.assert_allclose(
            getattr(part, name), getattr(whole, name), rtol=0, atol=1e-9
        )


def test_axes_and_directions_that_do_not_match():
    square, unit = connection.grid(2, 6, 1.0), connection.directions(2, 8)
    assert len(images(square, unit, BOTH)) == 3
    assert (
        len(images(square, unit, BACKWARDS)) == len(images(square, unit, MIRROR)) == 1
    )
    assert (
        len(images(square, connection.directions(2, 5), BOTH)) == 1
    )  # the mirror alone
    shifted = tuple(a + 0.1 for a in square)
    assert [x.factor[0].tolist() for x in images(shifted, unit, BOTH)] == [
        [-1.0, 1.0, -1.0]
    ]
    assert images((square[0], square[1][:5]), unit, BOTH) == []


def test_the_table_says_what_it_took():
    """Foreseen balances are those that are solved."""
    from geomech import scenes
    from geomech.mathematics.tiers import fitted, harmonic

    for name in ("three-link-glass", "butterfly-glass"):
        scene = scenes.load(name).with_numerics(grid=7)
        seen, swimmer = [], scene.system
        velocity = Swimmer.velocity

        def counted(self, alpha, alphadot):
            xi = velocity(self, alpha, alphadot)
            seen.append(xi[..., 0].size)
            return xi

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Swimmer, "velocity", counted)
            for table in (
                fitted.table(swimmer, scene.numerics),
                harmonic.table(swimmer, scene.numerics),
            ):
                seen.clear()
                table.build(None)
                assert sum(seen) == table.balances


ELLIPSE = Fourier(
    cos=((0.4,), (0.0,)), sin=((0.0,), (0.7,))
)  # its second half is the first in a mirror, and no more


def cycles():
    """name: (body, effects, gait, amplitudes, phases, how many of these are solved)."""
    uneven, three = Chain((1, 2, 0.5), 0.3, "link-2"), Chain()
    skin, caps = (
        (SkinFriction(forward=0.109, backward=0.137),),
        (EndCaps(radius=0.06, tail=3.0),),
    )
    return {
        "circle": (three, (), Circle(), None, 64, 17),
        "circle backwards": (
            three,
            (),
            Circle(amplitude=0.7, reverse=True),
            None,
            48,
            13,
        ),
        "circles, one at rest": (three, (), Circle(), [0.0, -0.6, 1e-7, 1.4], 32, 9),
        "circle off the centre": (three, (), Circle(centre=(0.3, 0.1)), None, 32, 32),
        "circle along the diagonal": (
            three,
            (),
            Circle(centre=(0.3, -0.3)),
            None,
            32,
            17,
        ),
        "circle across the diagonal": (
            three,
            (),
            Circle(centre=(0.4, 0.4)),
            None,
            32,
            17,
        ),
        "circle of an odd number": (three, (), Circle(), None, 45, 45),
        "circle of two halves": (three, (), Circle(), None, 42, 21),
        "circle of a body of three links that differ": (
            uneven,
            (),
            Circle(),
            None,
            32,
            16,
        ),
        "circle of a skin that drags less forwards": (
            three,
            skin,
            Circle(),
            None,
            32,
            32,
        ),
        "circle of a body with a heavier tail": (three, caps, Circle(), None, 32, 16),
        "butterfly": (three, (), Butterfly(), [0.5, 1.2], 32, 9),
        "ellipse": (three, (), ELLIPSE, None, 32, 16),
        "points": (three, (), GAITS["points"], None, 32, 32),
        "travelling wave": (
            Chain((1,) * 6),
            (),
            Sine(elements=6, waves=1.0),
            [0.1, 0.3],
            32,
            9,
        ),
    }


@pytest.mark.parametrize("name", cycles())
def test_gaits_are_those_of_all_phases(name):
    body, effects, gait, amplitudes, phases, count = cycles()[name]
    swimmer, (alpha, alphadot) = (
        Swimmer(GLASS, body, effects),
        gait.cycle(phases, amplitudes),
    )
    assert cycle_images(alpha, alphadot, swimmer.traits).count == count
    run, xi = swimmer.run(alpha, alphadot, work=True), swimmer.velocity(alpha, alphadot)
    size = np.abs(xi).max((-1, -2), keepdims=True) + 1e-300
    np.testing.assert_allclose(run.xi / size, xi / size, rtol=0, atol=1e-10)
    power = swimmer.work(alpha, alphadot, xi).power
    np.testing.assert_allclose(run.work.power, power, rtol=1e-8, atol=1e-12)


SHARES = {  # one over that of the phases that are solved, without traits, mirrored, reversible and both
    "none 3": [1, 1, 1, 1], "mirrored 3": [1, 2, 1, 2], "backwards 3": [1, 1, 2, 2],
    "backwards in a mirror 3": [1, 1, 1, 2], "both 3": [1, 2, 2, 4],
}  # fmt: skip


def symmetric_gaits():
    """Return random gaits, with two rows of cosines and two of sines, by the symmetries that their curves have."""
    found, rng = {}, np.random.default_rng(5)
    for n in (1, 3):
        cos, sin = rng.normal(size=(2, 2, n))
        odd = np.arange(1, n + 1) % 2
        found |= {
            f"none {n}": (cos, sin),
            f"mirrored {n}": (cos * odd, sin * odd),
            f"backwards {n}": (cos[[0, 0]] * [[-1], [1]], sin[[0, 0]]),
            f"backwards in a mirror {n}": (cos[[0, 0]], sin[[0, 0]] * [[1], [-1]]),
            f"both {n}": (cos[[0, 0]] * odd, sin[[0, 0]] * odd * [[1], [-1]]),
        }
    return {
        name: Fourier(cos=cos.tolist(), sin=sin.tolist())
        for name, (cos, sin) in found.items()
    }


class Late(Fourier):
    """A gait that begins a part of a cycle later."""

    def unit(self, t):
        return super().unit(np.asarray(t) + self.start)

    def unit_rate(self, t):
        return super().unit_rate(np.asarray(t) + self.start)


@pytest.mark.parametrize("name", symmetric_gaits())
def test_few_phases_tell_how_many_are_solved(name, monkeypatch):
    """Of gaits that begin anywhere, at numbers of phases of all remainders: images lie on phases of some of these only."""
    monkeypatch.setattr(
        "geomech.mathematics.geometry.representations.images.SAMPLED_PHASES", 32
    )
    gait, shares = symmetric_gaits()[name], []
    for traits in (NOTHING, MIRROR, BACKWARDS, BOTH):
        share = 0
        for start in (0.0, 0.1):
            late = Late(cos=gait.cos, sin=gait.sin)
            object.__setattr__(late, "start", 2 * np.pi * start)
            for phases in (*range(8, 33), *range(33, 201, 13)):
                solved = cycle_images(*late.cycle(phases), traits).count
                assert solved_count(late, phases, traits) == solved, (start, phases)
                share = max(share, round(phases / solved))
        shares.append(share)
    assert shares == SHARES.get(name, shares)


def test_a_million_phases_are_counted_at_once():
    began = time.process_time()
    assert solved_count(Circle(), 1_000_000, BOTH) == 250_001
    assert solved_count(Sine(elements=100), 1_000_000, MIRROR) == 500_000
    assert time.process_time() - began < 2.0


def test_what_is_nearly_an_image_is_none():
    """Neither shapes nor rates, neither of a large gait nor of a small one beside it; nor gaits that differ in their images."""
    count = lambda *cycle: cycle_images(*cycle, BOTH).count
    both = Circle().cycle(32, [1.0, 1e-6])
    assert count(*both) == 9
    for part in (0, 1):
        for gait, off in ((0, 1e-9), (1, 1e-15)):
            for where in ((gait, 20, 1), (gait, 3, 0)):
                moved = [x.copy() for x in both]
                moved[part][where] += off
                assert count(*moved) == 32, (part, where)
    circle, butterfly = Circle().cycle(32), Butterfly().cycle(32)
    assert count(*map(np.stack, zip(circle, butterfly))) == 16
    backwards = cycle_images(*circle, BACKWARDS)
    assert cycle_images(*circle, NOTHING).count == 32 and backwards.count == 17
    assert {*map(tuple, backwards.factor.tolist())} == {
        (1.0, 1.0, 1.0),
        (1.0, 1.0, -1.0),
    }


def test_gaits_side_by_side_have_their_own_parameters(monkeypatch):
    """Of an effect with a parameter for each gait, of which some phases are solved; begun from what is known of all phases."""
    frequencies, body = np.array([0.5, 3.0]), Chain((1, 2, 1))
    effect = GrainInertia(frequency=1.0, length=0.3, depth=0.07)
    both = Swimmer(GLASS, body, (effect.with_parameters(frequency=frequencies),))
    alpha, alphadot = Circle().cycle(32, [0.5, 0.9])
    assert cycle_images(alpha, alphadot, both.traits).count == 16
    run = both.run(alpha, alphadot)
    for k in range(2):
        own = Swimmer(
            GLASS, body, (dataclasses.replace(effect, frequency=frequencies[k]),)
        )
        np.testing.assert_allclose(
            run.xi[k], own.velocity(alpha[k], alphadot[k]), rtol=0, atol=1e-10
        )
    plain, solve, taken = Swimmer(GLASS, body), Swimmer.solve, []

    def watched(self, *asked):
        taken.append(solve(self, *asked))
        return taken[-1]

    xi = plain.velocity(alpha, alphadot)
    monkeypatch.setattr(Swimmer, "solve", watched)
    runs = [plain.run(alpha, alphadot, start=start) for start in (None, xi)]
    np.testing.assert_allclose(runs[1].xi, xi, rtol=0, atol=1e-10)
    assert taken[1].iterations.max() == 1 and taken[0].iterations.min() > 3
