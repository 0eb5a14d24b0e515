"""What moving costs: metric and norm, path length, work and cost of transport of
gaits."""

import numpy as np
import pytest

import geomech
from geomech.mathematics.gaits import Circle, Ellipse, Fourier
from geomech.mathematics.geometry import metric
from geomech.mathematics.systems import NoSlipSnake, Swimmer, Table
from geomech.mathematics.systems.capabilities import (
    stored_table,
    velocity_and_power,
)
from geomech.scenes.frames import framed
from geomech.studies.estimates import effort
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft import (
    BodyInertia,
    Chain,
    DisturbedGround,
    Granular,
    SkinFriction,
    Transient,
    Viscous,
)
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
FLUID = Viscous(2.7)
SAND = Granular(C=1.8, gamma0=np.radians(13.8))
UNEVEN = Chain((0.7, 1.4, 0.9), length=0.3)
GAIT = Ellipse(semi_axes=(1.0, 0.6), tilt=0.5, centre=(0.2, -0.1))
NUMERICS = geomech.Numerics(grid=21, extent=1.8)
THREE_JOINTS = Fourier(cos=((1,), (0,), (0,)), sin=((0,), (1,), (0.5,)))


def scene(system, gait=GAIT):
    return geomech.Scene(system, gait, NUMERICS, "mine")


IN_FLUID = scene(Swimmer(FLUID, UNEVEN))
IN_SAND = scene(Swimmer(SAND, UNEVEN))


@pytest.mark.parametrize(("one", "tolerance"), [(IN_FLUID, 1e-5), (IN_SAND, 3e-3)])
def test_table_and_gait_agree_and_do_not_see_size_or_frame(one, tolerance):
    tables = SceneTables(one)
    found = tables.effort(amplitudes=[0.5, 1.2])
    length = metric.path_length(tables.metric.norm, GAIT, [0.5, 1.2])
    assert length == pytest.approx(found["path_length"], rel=tolerance)
    for options in ({}, {"length": 0.3, "frame": "link-2"}):
        other = one.changed(body=Chain((0.7, 1.4, 0.9), **options))
        again = SceneTables(other).effort(amplitudes=[0.5, 1.2])
        for name in ("path_length", "work"):
            assert again[name] == pytest.approx(found[name], rel=1e-9)


@pytest.mark.parametrize("inner", [IN_FLUID.system, IN_SAND.system])
def test_power_is_that_of_every_frame(inner):
    system = framed(inner, NUMERICS)
    rng = np.random.default_rng(0)
    alpha = rng.uniform(-1.5, 1.5, (30, 2))
    rate = rng.normal(size=(30, 2))
    xi, power = velocity_and_power(system, alpha, rate)
    assert power == pytest.approx(velocity_and_power(inner, alpha, rate)[1], rel=1e-12)
    assert xi == pytest.approx(system.velocity(alpha, rate), abs=1e-14)


def test_cost_of_transport_in_sand_is_work_over_distance():
    result = SceneTables(IN_SAND).displacements([0.5, 1.0], ["direct", "path"])
    result = effort.with_effort(result, IN_SAND)
    v = {name: variable.values for name, variable in result.items()}
    distance = v["net_distance"] / 0.3
    np.testing.assert_allclose(v["cost_of_transport"], v["work"] / distance)
    np.testing.assert_array_equal(v["path_length"], v["work"])


def test_viscous_circle_is_as_efficient_as_published():
    circle = scene(Swimmer(Viscous(2.0), Chain()), Circle())
    result = SceneTables(circle).displacements([1.0, 1.3], ["direct"])
    v = {x: y.values for x, y in effort.with_effort(result, circle).items()}
    assert v["path_length"][0] == pytest.approx(0.512235, abs=1e-6)
    assert v["efficiency"][0] == pytest.approx([0.1001, 0.1088], abs=6e-5)
    towed = v["net_distance"] ** 2 / (2 * np.pi)  # at constant speed, in the same time
    np.testing.assert_allclose(v["cost_of_transport"], v["work"] / towed)


def test_errors_cover_many_more_phases():
    coarse, fine = (
        effort.effort(IN_SAND, GAIT, [0.4, 0.9, 1.5], phases) for phases in (64, 512)
    )
    for name in ("path_length", "work"):
        error = coarse[f"{name}_error"]
        assert (np.abs(coarse[name] - fine[name]) <= error).all()
        assert (error < 1e-2 * fine[name]).all()


@pytest.mark.parametrize(
    "effect",
    [
        BodyInertia(mass=1.5, frequency=1 / (2 * np.pi), length=1.0, drag=1.0),
        DisturbedGround(0.1, 0.6),
    ],
    ids=lambda effect: effect.kind,
)
def test_errors_of_work_in_time_stepping_cover_steps_and_pieces(effect):
    """The mean over every other step of the same march knows of neither."""
    one = scene(Swimmer(Viscous(2.5), Chain((1, 1.4, 0.7)), (effect,)))
    found = effort.effort(one.with_numerics(pieces=20), GAIT, [0.7], 32)
    fine = effort.effort(one.with_numerics(pieces=40), GAIT, [0.7], 48)
    off = np.abs(found["work"] - fine["work"])
    assert off <= found["work_error"] < 0.05 * fine["work"]


@pytest.mark.parametrize(
    ("system", "gait", "said"),
    [
        (NoSlipSnake(), GAIT, "nothing defines what moving costs"),
        (Swimmer(SAND, Chain((1, 1, 1, 1))), THREE_JOINTS, "of 3 joints"),
        (
            Swimmer(SAND, Chain(), (SkinFriction(0.3, 0.6),)),
            GAIT,
            "differs between opposite directions",
        ),
        (Swimmer(SAND, Chain(), (Transient(travel=0.1),)), GAIT, "not memoryless"),
    ],
)
def test_what_has_no_metric_says_why(system, gait, said):
    assert said in effort.why_no_metric(system)
    with pytest.raises(Refusal, match=said):
        SceneTables(scene(system, gait)).metric  # noqa: B018


def test_gaits_with_a_past_cost_work_all_the_same():
    past = scene(Swimmer(SAND, Chain(), (Transient(travel=1e-9),)))
    plain = scene(Swimmer(SAND, Chain()))
    with_past, without = (
        effort.effort(one, Circle(), [1.0], 32)["work"] for one in (past, plain)
    )
    assert with_past == pytest.approx(without, rel=0.02)


@pytest.mark.parametrize(
    ("one", "array", "degree"), [(IN_FLUID, "M", 2), (IN_SAND, "coefficients", 1)]
)
def test_the_file_has_what_a_change_of_shape_costs(one, array, degree, tmp_path):
    tables = SceneTables(one)
    path = tmp_path / "field.nc"
    fields.save_connection(path, tables)
    table = Table(str(path))
    stored = getattr(stored_table(table, "metric"), array)
    np.testing.assert_array_equal(stored, getattr(tables.metric, array))
    assert table.traits.power_degree == degree
    again = SceneTables(scene(table)).effort(amplitudes=[1.0])
    found = tables.effort(amplitudes=[1.0])
    for name in ("path_length", "work"):
        assert again[name] == pytest.approx(found[name], rel=5e-3)


@pytest.mark.parametrize("name", ["three-link-floating", "three-link-ideal-fluid"])
def test_a_metric_of_the_systems_own_has_lengths_and_no_work(name):
    own = geomech.load(name).with_numerics(grid=31, extent=2.5)
    tables = SceneTables(own)
    speed2 = own.system.squared_speed(*own.gait.cycle(256, 0.8))
    length = 2 * np.pi * np.sqrt(speed2).mean()
    found = tables.effort(amplitudes=[0.8])
    assert found["path_length"] == pytest.approx([length], rel=1e-12)
    assert np.isnan(found["work"]).all()
    looked_up = metric.path_length(tables.metric.norm, own.gait, [0.8])
    assert looked_up == pytest.approx([length], rel=1e-4)


PAST = scene(Swimmer(SAND, UNEVEN, (Transient(travel_m=0.03),)))


@pytest.mark.parametrize(
    ("one", "phases", "expected"),
    [(IN_FLUID, 9, 12), (IN_FLUID, 12, 12), (PAST, 8, 32), (PAST, 33, 36)],
)
def test_phases_of_a_cost_are_fours_and_of_steps_no_fewer_than_32(
    one, phases, expected
):
    assert effort.effort_phases(one, phases) == expected
