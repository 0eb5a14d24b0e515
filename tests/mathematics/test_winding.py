"""Gaits that wind around shape variables with periods, and their displacements."""

import dataclasses
import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from registry import GAITS
from rolling import TURN, Lifted, Slider, Unicycle

import geomech
from geomech.mathematics.gaits import Circle, Fourier, Gait, Wave, Wound
from geomech.mathematics.geometry import connection, curvature, family
from geomech.mathematics.geometry.gait import loop_area
from geomech.mathematics.geometry.loop_at_rest import wound_area, wound_area_by
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.geometry.two_form import spanned, spanned_by, two_form
from geomech.mathematics.tiers.area import area
from geomech.mathematics.tiers.direct import direct
from geomech.scenes import Numerics, Scene
from geomech.scenes.write import gait_table
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal
from rft.formulas import se2

SINE = Fourier(cos=((0.0,),), sin=((1.0,),), amplitude=0.5)
UNEVEN = Fourier(cos=((0.3, 0.1),), sin=((1.0, 0.4),), centre=(0.2,), amplitude=0.4)
TIERS = ("area", "adapted", "path", "harmonic", "direct")
AMPLITUDES = np.array([0.0, 0.2, 0.5, -0.3])
HALVED = 0.2 / 2 ** np.arange(5)


def study(system, gait=SINE, **numerics):
    numerics = {"grid": 41, "extent": 1.0, **numerics}
    return SceneTables(Scene(system, gait, Numerics(**numerics)))


def fitted_connection(system, points=61, extent=1.0, degree=5):
    axes = connection.grid(system.joints, points, extent, system.traits.periods)
    count = 4 * system.joints
    return connection.fit(
        system.velocity, axes, count, degree, traits=system.traits, trusted=True
    )


@pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))
@pytest.mark.parametrize("turns", [(1,), (-2, 3)])
def test_a_wound_gait_is_its_gait_with_variables_that_advance(gait, turns):
    wound = Wound(gait, turns, (np.pi,) * len(turns))
    alpha, alphadot = wound.cycle(64, [0.5, 1.0])
    own, own_rate = gait.cycle(64, [0.5, 1.0])
    t = TURN * np.arange(64)[:, None] / 64
    sign = -1.0 if gait.reverse else 1.0
    np.testing.assert_array_equal(alpha[..., : gait.joints], own)
    np.testing.assert_array_equal(alphadot[..., : gait.joints], own_rate)
    advance = sign * np.array(turns) / 2
    np.testing.assert_allclose(alpha[1, :, gait.joints :], t * advance)
    np.testing.assert_allclose(wound.shape(t[:, 0], 0.5), alpha[0])
    np.testing.assert_allclose(wound.rate(t[:, 0], 0.5), alphadot[0])
    for name in ("amplitude", "centre", "frequency", "amplitude_label", "kind"):
        assert getattr(wound, name) == getattr(gait, name)
    assert wound.largest(0.7) == gait.largest(0.7)
    assert wound.harmonics >= gait.harmonics


def test_a_wound_gait_is_replaced_stored_and_compared_as_its_gait():
    wound = Wound(Circle(0.5, centre=(0.1, 0.2)))
    changed = dataclasses.replace(wound, amplitude=0.7, frequency=2.0, reverse=True)
    inner = Circle(0.7, centre=(0.1, 0.2), frequency=2.0, reverse=True)
    assert changed == Wound(inner)
    assert hash(changed) == hash(Wound(inner)) and changed != wound
    assert pickle.loads(pickle.dumps(changed)) == changed
    assert eval(repr(changed)) == changed
    assert Wound(Wave(joints=3)).waves == 1.0
    assert not hasattr(Wound(Circle()), "waves")


@pytest.mark.parametrize("turns", [(), (0.5,), ("1",)])
def test_turns_are_whole_numbers(turns):
    with pytest.raises(Refusal, match="turns"):
        Wound(Circle(), turns)


def test_a_scene_lets_the_last_variables_advance():
    scene = Scene(Lifted(links=2), Circle(0.4, reverse=True))
    np.testing.assert_allclose(scene.gait.shape(np.pi), [-0.4, 0.0, -np.pi], atol=1e-15)
    assert gait_table(scene.gait) == gait_table(Circle(0.4, reverse=True))
    other = scene.changed(gait=Circle(0.1))
    assert other.gait == Wound(Circle(0.1))
    given = SceneTables(scene).poses("direct", Circle(0.1))
    np.testing.assert_array_equal(given, SceneTables(other).poses("direct"))
    plain = scene.changed(system=geomech.scenes.load("three-link-viscous").system)
    assert plain.gait == Circle(0.4, reverse=True)


def test_a_gait_of_all_variables_stays_as_it_is():
    scene = Scene(Slider(), Circle(0.4))
    assert scene.gait == Circle(0.4)
    with pytest.raises(Refusal, match="joints"):
        Scene(Lifted(links=3), SINE)


@dataclass(frozen=True)
class Spiral(Gait):
    """tau advances by ``turns`` and wobbles; alpha swings."""

    turns: float = 1.0

    def shape(self, t, amplitudes=None):
        a = np.asarray(self._amplitudes(amplitudes))[..., None]
        t = np.asarray(t, float)
        return np.stack([a * np.sin(t), self.turns * t + a * np.cos(2 * t)], -1)

    def rate(self, t, amplitudes=None):
        a = np.asarray(self._amplitudes(amplitudes))[..., None]
        t = np.asarray(t, float)
        return np.stack([a * np.cos(t), self.turns - 2 * a * np.sin(2 * t)], -1)

    harmonics = 2


def test_a_gait_that_ends_whole_periods_on_is_closed():
    found = study(Unicycle(), Spiral(amplitude=0.3), grid=61)
    truth = Unicycle().pose(Spiral(), [0.1, 0.3])
    direct_poses = found.poses("direct", amplitudes=[0.1, 0.3])
    np.testing.assert_allclose(direct_poses, truth, atol=1e-12)
    errors = np.abs(found.poses("area", amplitudes=[0.1, 0.3]) - truth).max(-1)
    assert errors[1] < 0.02 and errors[0] < errors[1] / 20
    with pytest.raises(Refusal, match="not closed"):
        study(Unicycle(), Spiral(amplitude=0.3, turns=0.5))


@pytest.mark.parametrize("rolling", [0.0, 1.0])
@pytest.mark.parametrize("tier", TIERS)
def test_tiers_add_the_loop_at_rest_and_the_strip(tier, rolling):
    """Without a turn the area tier is exact: pi a of the strip where A_tau = 0, and 2
    pi of the loop at rest besides."""
    system = Slider(rolling=rolling)
    poses = study(system).poses(tier, amplitudes=AMPLITUDES)
    np.testing.assert_allclose(poses[:, 0], system.distance(AMPLITUDES), atol=1e-4)
    np.testing.assert_allclose(poses[:, 1:], 0.0, atol=1e-12)


def test_the_loop_at_rest_alone_is_what_a_gait_at_rest_does():
    system = Lifted(drift=0.8)
    A = fitted_connection(system)
    gait = Wound(SINE)
    net = wound_area(A, gait, [0.0]).net
    np.testing.assert_allclose(net, direct(system.velocity, gait, [0.0]), atol=1e-6)
    assert np.abs(net).max() > 1


def test_a_reversed_gait_goes_back():
    found = study(Lifted(1.0))
    back = dataclasses.replace(found.scene.gait, reverse=True)
    for tier in ("path", "direct", "area"):
        ahead = found.poses(tier)
        behind = found.poses(tier, back)
        np.testing.assert_allclose(behind, se2.inverse(ahead), atol=1e-9)


@pytest.mark.parametrize(
    ("system", "gait"),
    [
        (Unicycle(), UNEVEN),
        (Lifted(0.0), UNEVEN),
        (Lifted(1.0), UNEVEN),
        (Lifted(0.0, links=2), Circle(0.4, centre=(0.1, -0.1))),
        (Lifted(1.0, links=2), Circle(0.4, centre=(0.1, -0.1))),
    ],
    ids=["unicycle", "lifted", "drifting", "two links", "two links, drifting"],
)
def test_the_line_and_area_sum_is_of_order_three(system, gait):
    """As the area of a small loop, halving the gait leaves an eighth of the error."""
    points = 61 if system.joints == 2 else 25
    A = fitted_connection(system, points, 0.6)
    gait = Wound(gait)
    truth = direct(system.velocity, gait, HALVED, 1024)
    errors = np.abs(wound_area(A, gait, HALVED, 64).net - truth).max(-1)
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders[-2:].min() > 2.9


def test_other_surfaces_differ_by_no_more_than_order_three():
    A = fitted_connection(Lifted(1.0, links=2), 25, 0.6)
    found = wound_area(A, Wound(Circle(centre=(0.1, -0.1))), HALVED, 64, 2)
    orders = np.log2(found.spread[:-1, 0] / found.spread[1:, 0])
    assert orders[-2:].min() > 2.9
    np.testing.assert_allclose(found.spread[:, 1], 0.0, atol=1e-6)


def test_several_variables_may_advance():
    """Each of two wheels rolls the body on, by other numbers of turns."""

    def rolled(alpha, alphadot):
        q, first, second = np.moveaxis(alpha, -1, 0)
        dq, dfirst, dsecond = np.moveaxis(alphadot, -1, 0)
        x = (1 + q) * dfirst + 0.5 * (1 + np.cos(second)) * dsecond
        x = x + np.cos(first - second) * dq
        return np.stack([x, 0 * x, 0 * x], -1)

    rolled.joints = 3
    rolled.traits = dataclasses.replace(Slider().traits, periods=(None, TURN, TURN))
    gait = Wound(SINE, (2, 1))
    found = SceneTables(Scene(rolled, gait, Numerics(grid=21, extent=0.6, phases=64)))
    expected = TURN * 2 + np.pi + np.pi * 0.5  # the last of cos(t) against cos(t)
    for tier in ("direct", "path", "area"):
        np.testing.assert_allclose(found.poses(tier)[0], expected, atol=2e-3)
    assert Scene(rolled, SINE).gait.turns == (1, 1)


@pytest.mark.parametrize("order", [1, -1], ids=["second axis", "first axis"])
def test_a_loop_across_the_seam_encloses_its_area(order):
    """A loop that does not wind has the same area wherever the seam lies."""
    system = Lifted(1.0)

    def velocity(alpha, alphadot):
        return system.velocity(alpha[..., ::order], alphadot[..., ::order])

    traits = dataclasses.replace(system.traits, periods=(None, TURN)[::order])
    axes = connection.grid(2, 61, 1.0, traits.periods)
    A = connection.fit(velocity, axes, degree=5, traits=traits)
    field = curvature.ccf(A)
    sizes = np.array([0.2, 0.1, 0.05])
    areas = []
    for turns in (0, 1, -2):
        on_seam = Circle(centre=(0.1, turns * TURN)[::order])
        areas.append(area(field, on_seam, sizes))
    np.testing.assert_allclose(areas[1:], [areas[0]] * 2, atol=1e-10)
    errors = np.abs(areas[0] - direct(velocity, on_seam, sizes)).max(-1)
    assert np.log2(errors[:-1] / errors[1:]).min() > 2.7


def test_the_area_of_a_strip_is_that_from_the_loop_at_rest():
    gait = Wound(Fourier(cos=((0.0,),), sin=((1.0,),), centre=(0.3,)))
    found, _ = loop_area(gait, 64, [0.5, 1.0])
    np.testing.assert_allclose(found, 0.0, atol=1e-12)
    # alpha swings by a cos t, and tau advances unevenly.
    found, _ = loop_area(Spiral(), 64, [0.2, 0.4])
    alpha, alphadot = Spiral().cycle(4096, [0.2, 0.4])
    truth = TURN * (alpha[..., 0] * alphadot[..., 1]).mean(-1)
    np.testing.assert_allclose(found, truth, atol=1e-12)


@pytest.mark.parametrize(
    "ask",
    [
        lambda A, gait: area(curvature.ccf(A), gait),
        lambda A, gait: spanned(two_form(A), gait),
        lambda A, gait: spanned_by(A, gait),
    ],
)
def test_an_area_without_the_loop_at_rest_is_refused(ask):
    with pytest.raises(Refusal, match="encloses no area"):
        ask(fitted_connection(Lifted(), 15), Wound(SINE))


def test_the_area_is_the_same_without_a_field():
    system = Lifted(0.7, links=2)
    gait = Wound(Circle(0.3))
    A = fitted_connection(system, 25, 0.6)
    with_field = wound_area(A, gait, tips=2)

    def alone(alpha):
        columns = [system.velocity(alpha, unit) for unit in np.eye(3)]
        return np.stack(columns, -1)

    without = wound_area_by(alone, gait, system.traits.periods, tips=2)
    np.testing.assert_allclose(without.net, with_field.net, atol=1e-4)
    np.testing.assert_allclose(without.spread, with_field.spread, atol=1e-4)


def test_a_plain_study_of_many_joints_has_the_area_of_a_wound_gait():
    system = Lifted(0.5, links=3)
    result = geomech.study(system, Wave(0.2, joints=3), phases=64).displacement([0.2])
    truth = direct(system.velocity, Wound(Wave(0.2, joints=3)), [0.2])
    assert "area" in result["tier"].values
    for k, name in enumerate(("x", "y", "heading")):
        true = np.abs(result[name].values - truth[:, k])
        assert (true <= result[name].error + 1e-12).all()


def test_a_family_of_wound_gaits_moves_at_amplitude_zero():
    system = Lifted(0.7)
    gait = Wound(UNEVEN)
    curves = family.fit(system.velocity, gait, 0.5, 16, 64, least=-0.5)
    amplitudes = np.array([-0.5, -0.21, 0.0, 0.13, 0.5])
    truth = direct(system.velocity, gait, amplitudes)
    np.testing.assert_allclose(curves.area(amplitudes), truth, atol=1e-5)


@pytest.mark.parametrize("system", [Slider(), Unicycle(), Lifted(1.0)])
def test_told_errors_of_tiers_cover_the_true_ones(system):
    result = geomech.study(system, SINE, grid=31, extent=1.0).displacement(
        [0.1, 0.3, 0.6], tiers=list(TIERS)
    )
    truth = direct(system.velocity, Wound(SINE), [0.1, 0.3, 0.6], 2048)
    for k, name in enumerate(("x", "y", "heading")):
        found = result[name]
        true = np.abs(found.values - truth[:, k])
        assert (true <= found.error + 1e-12).all()


@pytest.mark.parametrize("turning", [0.0, 1.0])
def test_told_errors_cover_switches_between_phases(turning):
    """A contact switches at once, at 20 random pairs of phases: x and the heading are
    those of the shapes at the two switches."""
    rng = np.random.default_rng(3)
    gait = Fourier(cos=((1.0,),), sin=((0.3,),))
    for first, duty in zip(rng.uniform(0, TURN, 20), rng.uniform(0.2, 0.8, 20)):

        def switching(alpha, alphadot, first=first, last=duty * TURN):
            touches = np.mod(alpha[..., 1] - first, TURN) < last
            moved = touches * alphadot[..., 0]
            return np.stack([(1 - turning) * moved, 0 * moved, turning * moved], -1)

        switching.traits = Traits(
            linear=True, smooth=False, jumps=True, periods=(None, TURN)
        )
        result = geomech.study(switching, gait, extent=1.0, grid=15).displacement(
            [0.2, 0.5], tiers=["area", "path", "direct"]
        )
        start, end = gait.shape(np.array([first, first + duty * TURN]), 1.0)[:, 0]
        name = "heading" if turning else "x"
        true = np.array([0.2, 0.5]) * (end - start)
        assert (np.abs(result[name].values - true) <= result[name].error).all()


def test_a_search_over_loops_is_refused():
    with pytest.raises(Refusal, match="sweep"):
        geomech.study(Slider(), SINE).optimize()
