"""What moving costs: tables of metric and norm, path length, work and cost of transport of gaits, on file and by command."""

import numpy as np
import pytest
from tabled import of_json, tabled

import geomech
from geomech.io.results import to_xarray
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import metric
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.systems import NoSlipSnake, Swimmer, Table
from geomech.mathematics.systems.capabilities import (
    refined,
    stored_table,
    velocity_and_power,
)
from geomech.scenes.frames import framed
from geomech.studies.estimates import cost, effort
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft import (
    BodyInertia,
    Chain,
    DisturbedGround,
    Granular,
    Serpenoid,
    SkinFriction,
    Transient,
    Viscous,
)
from rft.balance.listening import listening
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
FLUID, SAND = Viscous(2.7), Granular(C=1.8, gamma0=np.radians(13.8))
UNEVEN = Chain((0.7, 1.4, 0.9), length=0.3)
GAIT = Ellipse(semi_axes=(1.0, 0.6), tilt=0.5, centre=(0.2, -0.1))
NUMERICS = geomech.Numerics(grid=21, extent=1.8)


def scene(system, gait=GAIT):
    return geomech.Scene(system, gait, NUMERICS, "mine")


@pytest.mark.parametrize("medium", [FLUID, SAND])
def test_table_and_gait_agree_and_do_not_see_size_or_frame(medium):
    study = SceneTables(scene(Swimmer(medium, UNEVEN)))
    found = study.effort(amplitudes=[0.5, 1.2])
    looked_up = metric.path_length(study.metric.norm, GAIT, [0.5, 1.2])
    assert looked_up == pytest.approx(
        found["path_length"], rel=1e-5 if medium is FLUID else 3e-3
    )
    for other in (
        Chain((0.7, 1.4, 0.9)),
        Chain((0.7, 1.4, 0.9), length=0.3, frame="link-2"),
    ):
        again = SceneTables(scene(Swimmer(medium, other))).effort(amplitudes=[0.5, 1.2])
        for key in ("path_length", "work"):
            assert again[key] == pytest.approx(found[key], rel=1e-9)


@pytest.mark.parametrize("medium", [FLUID, SAND])
def test_power_is_that_of_every_frame(medium):
    inner = Swimmer(medium, UNEVEN)
    system = framed(inner, NUMERICS)
    rng = np.random.default_rng(0)
    alpha, rate = rng.uniform(-1.5, 1.5, (30, 2)), rng.normal(size=(30, 2))
    xi, power = velocity_and_power(system, alpha, rate)
    assert power == pytest.approx(velocity_and_power(inner, alpha, rate)[1], rel=1e-12)
    assert xi == pytest.approx(system.velocity(alpha, rate), abs=1e-14)
    assert (finer := refined(system)) is None or finer.inner == refined(inner) != inner
    assert (finer is None) == (refined(inner) is None) == (medium is FLUID)


def test_a_norm_shares_the_velocities_of_the_harmonics():
    study, calls = SceneTables(scene(Swimmer(SAND, UNEVEN))), []
    whole = Swimmer.velocity
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            Swimmer,
            "velocity",
            lambda self, a, u: (
                calls.append(np.broadcast(a, u).size) or whole(self, a, u)
            ),
        )
        norm = study.metric
        before = sum(calls)
        table = study.table("harmonic")
        assert sum(calls) == before
    alone = SceneTables(study.scene)
    assert np.array_equal(alone.table("harmonic").coefficients, table.coefficients)
    assert (
        np.abs(alone.metric.coefficients - norm.coefficients).max()
        < 1e-12 * norm.coefficients.max()
    )
    assert study.metric is norm
    assert study.with_numerics(grid=15).metric is not norm
    assert study.with_numerics(phases=64).metric is norm


def test_work_and_cost_of_transport_of_known_motions():
    """Viscous: work over that of towing is path length^2 at best over distance^2, with equality at constant power."""
    found = SceneTables(scene(Swimmer(FLUID, Chain()), Circle())).effort(
        amplitudes=[0.05]
    )
    assert found["work"] * 2 * np.pi == pytest.approx(
        found["path_length"] ** 2, rel=0.1
    )
    assert found["work"] * 2 * np.pi >= found["path_length"] ** 2
    study = SceneTables(scene(Swimmer(SAND, UNEVEN)))
    result = study.displacements([0.5, 1.0], ["direct", "path"])
    result = effort.with_effort(result, study.scene)
    table = tabled(result)
    distance = np.array(table["net_distance"]["path"]) / 0.3
    assert table["cost_of_transport"]["path"] == pytest.approx(
        np.array(table["work"]) / distance
    )
    assert table["efficiency"]["path"] == pytest.approx(
        distance / np.array(table["path_length"])
    )
    assert table["path_length"] == table["work"]
    for name, unit in effort.units(study.scene.system).items():
        assert result[name].unit == unit


def test_viscous_circle_is_as_efficient_as_published():
    study = SceneTables(scene(Swimmer(Viscous(2.0), Chain()), Circle()))
    result = study.displacements([1.0, 1.3], ["direct"])
    table = tabled(effort.with_effort(result, study.scene))
    assert table["path_length"][0] == pytest.approx(0.512235, abs=1e-6)
    assert table["efficiency"]["direct"] == pytest.approx([0.1001, 0.1088], abs=6e-5)
    towed = np.array(table["net_distance"]["direct"]) ** 2 / (
        2 * np.pi
    )  # at constant speed, through the same cycle
    assert table["cost_of_transport"]["direct"] == pytest.approx(
        np.array(table["work"]) / towed
    )


def test_errors_cover_four_times_as_many_phases():
    one = scene(Swimmer(SAND, UNEVEN))
    coarse, fine = (
        effort.effort(one, GAIT, [0.4, 0.9, 1.5], phases) for phases in (64, 512)
    )
    for key in ("path_length", "work"):
        assert (np.abs(coarse[key] - fine[key]) <= coarse[f"{key}_error"]).all()
        assert (coarse[f"{key}_error"] < 1e-2 * fine[key]).all()


@pytest.mark.parametrize(
    "effect",
    [
        BodyInertia(mass=1.5, frequency=1 / (2 * np.pi), length=1.0, drag=1.0),
        DisturbedGround(0.1, 0.6),
    ],
    ids=lambda e: e.kind,
)
def test_errors_of_work_in_time_stepping_cover_steps_and_pieces(effect):
    """The mean over every other step of the same march knows of neither."""
    one = scene(Swimmer(Viscous(2.5), Chain((1, 1.4, 0.7)), (effect,))).with_numerics(
        pieces=20
    )
    found, fine = (
        effort.effort(s, GAIT, [0.7], n)
        for s, n in ((one, 32), (one.with_numerics(pieces=80), 64))
    )
    off = np.abs(found["work"] - fine["work"])
    assert off <= found["work_error"] < 0.05 * fine["work"]


@pytest.mark.parametrize(
    ("system", "said"),
    [
        (NoSlipSnake(), "nothing says what moving costs"),
        (Swimmer(SAND, Chain((1, 1, 1, 1))), "of 3 joints"),
        (
            Swimmer(SAND, Chain(), (SkinFriction(0.3, 0.6),)),
            "another power than the way back",
        ),
        (Swimmer(SAND, Chain(), (Transient(travel=0.1),)), "not memoryless"),
    ],
)
def test_what_has_no_metric_says_why(system, said):
    gait = (
        Circle()
        if system.joints == 2
        else geomech.mathematics.gaits.Fourier(
            cos=((1,), (0,), (0,)), sin=((0,), (1,), (0.5,))
        )
    )
    study = SceneTables(scene(system, gait))
    with pytest.raises(Refusal, match=said):
        study.metric  # noqa: B018


def test_gaits_with_a_past_cost_work_all_the_same():
    past = Swimmer(SAND, Chain(), (Transient(travel=1e-9),))
    with_past, plain = (
        effort.effort(scene(s, Circle()), None, [1.0], 32)
        for s in (past, Swimmer(SAND, Chain()))
    )
    assert with_past["work"] == pytest.approx(plain["work"], rel=0.02)
    heavy = Swimmer(
        SAND,
        Chain(length=0.3),
        (BodyInertia(mass=0.01, drag=1.0, frequency=1.0, length=0.3),),
    )
    found = effort.effort(scene(heavy, Circle()), None, [0.5], 32)
    assert np.isnan(found["path_length"]).all() and (found["work"] > 0).all()


@pytest.mark.parametrize("medium", [FLUID, SAND])
def test_the_file_has_what_a_change_of_shape_costs(medium, tmp_path):
    study = SceneTables(scene(Swimmer(medium, UNEVEN)))
    fields.save_connection(tmp_path / "made.nc", study)
    assert np.array_equal(Connection.load(tmp_path / "made.nc").A, study.fitted.A)
    table = Table(str(tmp_path / "made.nc"))
    own, back = study.metric, stored_table(table, "metric")
    name = "M" if medium is FLUID else "coefficients"
    assert np.array_equal(
        getattr(back, name), getattr(own, name)
    ) and table.traits.power_degree == (2 if medium is FLUID else 1)
    again = SceneTables(scene(table)).effort(amplitudes=[1.0])
    there = study.effort(amplitudes=[1.0])
    assert again["path_length"] == pytest.approx(there["path_length"], rel=3e-3)
    assert again["work"] == pytest.approx(there["work"], rel=5e-3)
    saved = to_xarray(fields.full_result(study))
    assert saved.attrs["power_degree"] == table.traits.power_degree
    assert ("metric" if medium is FLUID else "norm") in saved


def test_a_damaged_metric_is_refused(tmp_path):
    from scipy.io import netcdf_file

    study = SceneTables(scene(Swimmer(FLUID, UNEVEN)))
    for what in ("symmetry", "degree"):
        path = tmp_path / f"{what}.nc"
        fields.save_connection(path, study)
        with netcdf_file(path, "a", mmap=False) as file:
            if what == "symmetry":
                file.variables["metric"][0, 1] += 1.0
            else:
                file.power_degree = -1.0
        with pytest.raises(
            Refusal, match="symmetric" if what == "symmetry" else "power_degree"
        ):
            Table(str(path))


@pytest.mark.parametrize(
    ("medium", "body"),
    [(FLUID, UNEVEN), (SAND, UNEVEN), (FLUID, Serpenoid(elements=12))],
)
def test_what_it_takes_is_foretold(medium, body):
    one, counts = scene(Swimmer(medium, body), Circle()), []
    foretold = cost.total_cost(cost.metric_jobs(one)).balances
    assert effort.why_no_metric(one.system) == ""  # which is asked for once
    with listening(lambda samples, points, linear: counts.append(samples)):
        SceneTables(one).metric  # noqa: B018
    assert sum(counts) == foretold


def test_by_command(capsys):
    from geomech.shell.cli import main

    with pytest.raises(SystemExit) as ended:
        main(
            [
                "displacement",
                "three-link-viscous",
                "--amplitudes",
                "0,1",
                "--tiers",
                "direct",
                "--effort",
                "--json",
            ]
        )
    told = of_json(capsys.readouterr().out)
    assert ended.value.code == 0
    assert told["path_length"].values == pytest.approx([0.0, 0.512235], abs=1e-6)
    none, efficiency = told["efficiency"][0]
    assert np.isnan(none) and efficiency == pytest.approx(0.1001, abs=6e-5)
    assert np.isnan(told["cost_of_transport"][0, 0])
    with pytest.raises(SystemExit) as ended:
        main(["displacement", "no-slip-snake", "--amplitudes", "1", "--effort"])
    assert (
        ended.value.code == 2
        and "nothing says what moving costs" in capsys.readouterr().err
    )


@pytest.mark.parametrize("name", ["three-link-floating", "three-link-ideal-fluid"])
def test_a_metric_of_the_systems_own_has_lengths_and_no_work(name, capsys):
    from geomech.shell.cli import main

    study = SceneTables(geomech.load(name).with_numerics(grid=31, extent=2.5))
    alpha, alphadot = study.scene.gait.cycle(256, 0.8)
    length = (
        2 * np.pi * np.sqrt(study.scene.system.squared_speed(alpha, alphadot)).mean()
    )
    found = study.effort(amplitudes=[0.8])
    assert (
        found["path_length"] == pytest.approx([length], rel=1e-12)
        and np.isnan(found["work"]).all()
    )
    assert metric.path_length(
        study.metric.norm, study.scene.gait, [0.8]
    ) == pytest.approx([length], rel=1e-4)
    with pytest.raises(SystemExit) as ended:
        main(
            [
                "displacement",
                name,
                "--amplitudes",
                "0.8",
                "--tiers",
                "direct",
                "--effort",
            ]
        )
    assert (
        ended.value.code == 0
        and f"path length ({effort.METRIC_UNIT})" in capsys.readouterr().out
    )
    assert "metric" in to_xarray(fields.full_result(study))


def test_phases_of_a_cost_are_fours_and_its_errors_are_what_half_of_them_change():
    fluid, past = (
        scene(Swimmer(FLUID, UNEVEN)),
        scene(Swimmer(SAND, UNEVEN, (Transient(travel_m=0.03),))),
    )
    assert [effort.effort_phases(fluid, n) for n in (8, 9, 12, 13)] == [8, 12, 12, 16]
    assert [effort.effort_phases(past, n) for n in (8, 32, 33)] == [32, 32, 36]
    assert effort.effort_phases(fluid) == -(-fluid.numerics.phases // 4) * 4
    sand = scene(Swimmer(SAND, UNEVEN))
    fine, half = (effort.effort(sand, None, [0.4, 1.1], phases) for phases in (32, 16))
    for key in ("path_length", "work"):
        assert fine[f"{key}_error"] == pytest.approx(
            np.abs(fine[key] - half[key]), rel=1e-9
        )
        assert (fine[f"{key}_error"] > 1e-8).all()
