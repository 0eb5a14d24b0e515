"""Studies of scenes whose joints give way: tiers along the loop that the shape makes,
its limit cycles, and the best stiffness."""

import math

import numpy as np
import pytest

import geomech
from geomech import scenes
from geomech.core.variables import Result
from geomech.mathematics.gaits import Circle
from geomech.questions.swimmers.sweep import Sweep
from geomech.studies.maps import charts
from geomech.studies.realised import limit_cycles, realised
from rft import Chain, Granular, Slope, Springs
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
compiled = pytest.mark.usefixtures("compiled_code")  # many steps
TAIL = scenes.load("three-link-tail")
M22, M21, CCF = 0.0073160, 0.0050297, 5 / 243  # three equal links, ratio 2
OMEGA = 2 * math.pi  # at 1 Hz


def test_the_geometry_explains_a_tail_that_gives_way():
    """The path tier is exact in a linear medium, and area is near it, along the loop
    that the shape makes; along the command both would be zero."""
    study = geomech.study(TAIL)
    found = study.displacement(0.5, ["direct", "path", "area"])
    x = dict(zip(found["tier"].values, found["x"].values[:, 0]))
    error = dict(zip(found["tier"].values, found["x"].error[:, 0]))
    assert x["path"] == pytest.approx(x["direct"], abs=1e-7)
    assert abs(x["area"] - x["direct"]) < error["area"] < 0.02 * abs(x["direct"])
    assert x["direct"] > 100 * error["direct"]


def test_a_table_of_a_family_of_gaits_is_not_for_springs():
    study = geomech.study(TAIL)
    assert "adapted" not in study.tables.tiers
    with pytest.raises(Refusal, match="adapted"):
        study.displacement(0.5, "adapted")


@compiled
def test_the_best_stiffness_is_that_of_the_drag():
    """k = omega M22 at small amplitude, where the displacement is CCF pi A^2 M21 / (2
    M22)."""
    small = TAIL.changed(gait=Circle(0.1)).with_numerics(phases=128)
    found = geomech.sweep(
        small,
        over={"effects.springs.stiffness": [0.01, 0.03, 0.06, 0.1]},
        best="net_distance",
    )
    best = found["best_effects_springs_stiffness"]
    assert abs(best.values - OMEGA * M22) < best.error < 0.01
    largest = CCF * math.pi * 0.1**2 * M21 / (2 * M22)
    assert found["best_net_distance"].values == pytest.approx(largest, rel=0.01)


def test_a_best_point_needs_points_to_either_side():
    over = {"effects.springs.stiffness": [0.01, 0.1]}
    with pytest.raises(Refusal, match="effects.springs.stiffness"):
        geomech.sweep(TAIL, over=over, best="net_distance")
    with pytest.raises(Refusal, match="best"):
        geomech.sweep(TAIL, over=over, best="heading")


def test_a_best_speed_needs_a_frequency_and_finer_grids_count():
    cable = scenes.load("three-link-cable")
    over = {"effects.springs.stiffness": [0.5, 1.0, 2.0]}
    with pytest.raises(Refusal, match="frequency"):
        geomech.sweep(cable, over=over, best="speed")
    plain = Sweep(TAIL, over).cost()
    assert Sweep(TAIL, over, "speed").cost().balances > 9 * plain.balances


def test_on_a_slope_springs_move_as_far_as_the_run_says():
    slope = Slope(angle=0.3)
    scene = scenes.load("three-link-cable").with_numerics(phases=64)
    scene = scene.changed(effects=(*scene.system.effects, slope))
    motion = geomech.trajectory(scene)
    assert "limit_cycle" not in motion
    net = scene.system.run(*scene.gait.cycle(64)).net
    found = [float(motion[f"final_{name}"].values) for name in ("x", "y", "heading")]
    np.testing.assert_allclose(found, net, atol=1e-9)
    with pytest.raises(Refusal, match="place"):
        geomech.trajectory(scene, cycles=2)


def test_one_limit_cycle_from_four_starts_where_drag_is_linear():
    found = limit_cycles(TAIL.system, TAIL.gait, 64)
    assert len(found.nets) == 1
    assert found.unsettled == 0


@compiled
def test_slack_that_friction_never_takes_up_leaves_many_limit_cycles():
    """In dry sand a joint that a slack cable does not reach stays where it starts."""
    slack = Springs(stiffness=5.0, dead_band=((-1.0, 1.0), (0.0, 0.0)))
    scene = scenes.load("three-link-glass").changed(
        effects=(slack,), gait=Circle(0.5), body=Chain()
    )
    found = limit_cycles(scene.system, scene.gait, 64)
    assert len(found.nets) > 1


@pytest.fixture(scope="module")
def motion() -> Result:
    return geomech.trajectory(TAIL)


def test_a_motion_has_the_shape_that_is_taken_beside_the_command(motion):
    t = motion["phase"].values
    np.testing.assert_allclose(motion["command_alpha_2"].values, np.sin(t), atol=1e-9)
    np.testing.assert_allclose(motion["alpha_2"].values, np.sin(t), atol=1e-6)
    assert (motion["command_alpha_1"].values == 0).all()  # no actuator
    assert 0.3 < np.abs(motion["alpha_1"].values).max() < 0.7
    # The spring turns the tail back.
    torque = motion["torque_1"].values
    stiffness = 0.046 / OMEGA  # per radian of phase
    np.testing.assert_allclose(torque, -stiffness * motion["alpha_1"].values, rtol=1e-9)
    stored = stiffness * motion["alpha_1"].values ** 2 / 2
    np.testing.assert_allclose(motion["stored"].values, stored, rtol=1e-9)


def test_actuators_of_prescribed_joints_do_the_work_on_the_medium(motion):
    run = TAIL.system.run(*TAIL.gait.cycle(TAIL.numerics.phases), True)
    on_medium = 2 * np.pi * run.work.power.mean()
    assert motion["actuator_work"].values == pytest.approx(on_medium, rel=1e-4)


def test_a_map_has_the_loop_that_is_made():
    found = geomech.ccf(TAIL)
    loop = realised(TAIL.system, TAIL.gait, TAIL.numerics.phases)
    alpha, _ = loop.cycle(TAIL.numerics.phases)
    np.testing.assert_allclose(found["loop_alpha_1"].values, alpha[:, 0], atol=1e-9)


def test_a_realised_loop_is_interpolated_between_its_phases():
    fine = realised(TAIL.system, TAIL.gait, 256)
    coarse = realised(TAIL.system, TAIL.gait, 128)
    np.testing.assert_allclose(coarse.cycle(256)[0], fine.cycle(256)[0], atol=2e-3)


def test_forces_are_those_of_the_true_shape():
    scene = scenes.load("three-link-cable").with_numerics(phases=64)
    found = geomech.forces(scene)
    run = scene.system.run(*scene.gait.cycle(64), True)
    power = found["power"].values.mean()
    assert power == pytest.approx(run.work.power.mean(), rel=2e-3)


def test_a_gait_lab_refuses_springs():
    with pytest.raises(Refusal, match="springs"):
        charts.chart(TAIL)


@compiled
def test_springs_of_unequal_stiffness_share_a_batch():
    """A sweep of a stiffness is that of each value alone."""
    values = [0.2, 0.5]
    medium = Granular(1.8, 0.24)
    scene = scenes.load("three-link-glass").changed(
        medium=medium, effects=(Springs(stiffness=0.5, prescribed=2),)
    )
    scene = scene.with_numerics(phases=64)
    together = geomech.sweep(scene, over={"effects.springs.stiffness": values})
    for k, value in enumerate(values):
        alone = geomech.sweep(scene, over={"effects.springs.stiffness": [value]})
        np.testing.assert_allclose(
            alone["x"].values[0], together["x"].values[k], atol=1e-9
        )
