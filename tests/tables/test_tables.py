"""Connections in files: read back as they were, and predicting what the scene they came
from predicts."""

import dataclasses
import json
import pickle

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from tabled import tabled

import rft
from geomech import api
from geomech.io import tables
from geomech.mathematics.gaits import Butterfly, Circle, Ellipse, Fourier
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.systems import NoSlipSnake, Swimmer, Table
from geomech.mathematics.systems.base import length_unit
from geomech.mathematics.systems.capabilities import table_error
from geomech.mathematics.systems.table import LENGTHS
from geomech.scenes import Numerics, Scene
from geomech.studies.estimates import estimate
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.bodies.base import body_size
from rft.laws import CATALOGUE

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
CLOSE = CATALOGUE["glass-0.3mm-close"].medium
UNEVEN = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2))
ENDINGS = (".nc", ".mat")


def study(medium=GLASS, body=UNEVEN, effects=(), **numerics):
    settings = {"grid": 9, "extent": 2.0, "harmonics": 5, **numerics}
    return SceneTables(
        Scene(Swimmer(medium, body, effects), GAIT, Numerics(**settings))
    )


def on(path, gait=GAIT):
    return SceneTables(Scene(Table(path), gait))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a.nc and a.mat of a table, and its study."""
    folder = tmp_path_factory.mktemp("tables")
    source = study()
    for ending in ENDINGS:
        fields.save_connection(folder / f"a{ending}", source)
    return folder, source


def plain_mat(path, c, sign=1.0, order="ndgrid", **more):
    """Write a .mat file as sysplotter does, and nothing beside its arrays."""
    arrays = dict(zip(("alpha1", "alpha2"), np.meshgrid(*c.axes, indexing="ij")))
    for row, entries in zip(("x", "y", "theta"), sign * c.A):
        arrays |= {f"A{row}{k}": values for k, values in enumerate(entries, 1)}
    if order == "meshgrid":
        arrays = {name: values.T for name, values in arrays.items()}
    savemat(path, {**arrays, **more})


def test_netcdf_gives_back_every_digit(made):
    folder, source = made
    held = tables.load(folder / "a.nc")
    for name in ("axes", "A", "residual", "speed"):
        expected = getattr(source.fitted, name)
        np.testing.assert_array_equal(getattr(held.connection, name), expected)
    harmonics = source.table("harmonic")
    np.testing.assert_array_equal(held.harmonics.coefficients, harmonics.coefficients)
    assert (held.length, held.unit, held.frame) == (0.3, "m", "link-1")
    assert (held.sign, held.assumptions) == ("+", ())


@pytest.mark.parametrize("ending", ENDINGS)
def test_singular_shapes_go_through_files_as_nan(ending, tmp_path):
    snake = SceneTables(Scene(NoSlipSnake(), GAIT, Numerics(grid=7)))
    fields.save_connection(tmp_path / f"a{ending}", snake)
    again = Connection.load(tmp_path / f"a{ending}")
    np.testing.assert_array_equal(again.A, snake.fitted.A)


@pytest.mark.parametrize("sign", "+-")
@pytest.mark.parametrize("order", ["ndgrid", "meshgrid"])
def test_a_mat_round_trip_keeps_every_digit(sign, order, made, tmp_path):
    source = made[1]
    fields.save_connection(tmp_path / "a.mat", source, sign=sign, order=order)
    plain_mat(tmp_path / "plain.mat", source.fitted, float(f"{sign}1"), order)
    found = loadmat(tmp_path / "a.mat")
    for name, values in loadmat(tmp_path / "plain.mat").items():
        if not name.startswith("__"):
            np.testing.assert_array_equal(found[name], values)
    held = tables.load(tmp_path / "a.mat")
    np.testing.assert_array_equal(held.connection.A, source.fitted.A)
    np.testing.assert_array_equal(held.connection.residual, source.fitted.residual)
    assert (held.length, held.unit, held.frame) == (0.3, "m", "link-1")


# Intervals of A, half as wide as these.
A_ERROR = 0.01 * np.random.default_rng(0).uniform(1, 2, (3, 2, 9, 9))


@pytest.fixture
def with_intervals(made, tmp_path):
    """A file of another program, to which intervals were added."""
    path = tmp_path / "intervals.mat"
    about = json.dumps({"sign": "+", "level": 0.9})
    c = made[1].fitted
    plain_mat(path, c, geomech_A_error=A_ERROR, geomech_about=about)
    return path


@pytest.mark.parametrize(
    ("name", "settings"),
    [("b.nc", {}), ("b.mat", {"sign": "-", "order": "meshgrid"})],
)
def test_intervals_of_a_table_are_kept(name, settings, with_intervals, tmp_path):
    fields.save_connection(tmp_path / name, on(with_intervals), **settings)
    again = tables.load(tmp_path / name)
    np.testing.assert_array_equal(again.A_error, A_ERROR)
    assert again.level == 0.9


def test_intervals_of_a_table_are_part_of_its_error(with_intervals, made):
    """As if all of them had one sign along the path, and in body lengths."""
    plain_mat(with_intervals.with_name("plain.mat"), made[1].fitted)
    cycle = GAIT.cycle(64, 0.7)
    path_length = 2 * np.pi * np.linalg.norm(cycle[1], axis=-1).mean()
    least = np.sqrt(2) * 0.01 * path_length
    table = Table(with_intervals, body_length=2.0)
    plain = Table(with_intervals.with_name("plain.mat"), body_length=2.0)
    more = table_error(table, *cycle) - table_error(plain, *cycle)
    assert least < more[1] < 2 * least
    assert least < 2.0 * more[0] < 3 * least


# Signs.


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-2", "link-3"])
@pytest.mark.parametrize("medium", [GLASS, rft.Viscous(2.0), rft.Granular(6.0, 0.3)])
def test_the_sign_of_a_bare_mat_file_is_made_out(frame, medium, tmp_path):
    c = study(medium, rft.Chain((1, 1.3, 0.8), frame=frame)).fitted
    for sign, order, factor in (("+", "meshgrid", 1.0), ("-", "ndgrid", -1.0)):
        plain_mat(tmp_path / "a.mat", c, factor, order)
        held = tables.load(tmp_path / "a.mat")
        assert (held.sign, held.order) == (sign, order)
        assert "its sign was inferred as xi = " + sign in held.assumptions[-1]
        np.testing.assert_array_equal(held.connection.A, c.A)


# Predictions.

BODIES = {
    "even": rft.Chain((1, 1, 1)),
    "uneven": UNEVEN,
    "short head": rft.Chain((1, 1.3, 0.6), frame="link-2"),
}
GAITS = (
    Circle(),
    Circle(centre=(0.4, -0.3), reverse=True),
    Butterfly(),
    Ellipse(semi_axes=(1, 0.4), tilt=0.7, centre=(-0.3, 0.2)),
)


SCALY = (rft.SkinFriction(0.05, 0.25),)  # tells forwards from backwards


@pytest.mark.parametrize(
    ("body", "medium", "effects", "ending"),
    [
        ("even", GLASS, (), ".nc"),
        ("uneven", GLASS, (), ".nc"),
        ("short head", CLOSE, (), ".nc"),
        ("uneven", rft.Viscous(2.0), (), ".nc"),
        ("uneven", CLOSE, (), ".mat"),
        ("even", rft.Viscous(3.0), (), ".mat"),
        ("uneven", GLASS, SCALY, ".nc"),
        ("uneven", GLASS, SCALY, ".mat"),
    ],
)
def test_a_table_predicts_what_its_scene_predicts_within_its_error(
    body, medium, effects, ending, tmp_path
):
    source = study(medium, BODIES[body], effects, grid=21, extent=2.3, harmonics=9)
    fields.save_connection(tmp_path / f"a{ending}", source)
    table = on(tmp_path / f"a{ending}")
    amplitudes = [0.3, 0.8, 1.2]
    for gait in GAITS:
        true = source.poses("direct", gait, amplitudes)
        tiers = ["area", "path", "harmonic", "direct"]
        told = tabled(table.displacements(amplitudes, tiers, gait))
        for tier in tiers:
            off = np.abs(told[tier] - true)
            errors = np.array(told["estimate"][tier])
            headings = np.array(told["estimate_heading"][tier])
            assert (np.hypot(off[:, 0], off[:, 1]) <= errors + 1e-12).all()
            assert (off[:, 2] <= headings + 1e-12).all()
    if (
        ending == ".nc" and medium.dry and not effects
    ):  # by its harmonics: of A alone it is 0.1 or more
        size = body_size(source.scene.system)
        assert max(told["estimate"]["direct"]) < 0.02 * size


def random_scene(rng):
    """A three-link swimmer in any medium, half of those in sand with skin friction, and
    a gait that reaches the field's edge."""
    granular = rft.Granular(10 ** rng.uniform(-1, 1), rng.uniform(0.1, 1.2))
    fluid = rft.Viscous(10 ** rng.uniform(0.1, 1.5))
    medium = (granular, GLASS, rft.Coulomb(), fluid)[rng.integers(4)]
    skin = rft.SkinFriction(*rng.uniform(0.05, 0.3, 2))
    effects = (skin,) if medium.dry and rng.integers(2) else ()
    frame = ("mean", "link-1", "link-2", "link-3")[rng.integers(4)]
    body = rft.Chain(tuple(rng.uniform(0.5, 2, 3)), rng.uniform(0.1, 3), frame)
    extent = rng.uniform(1.2, 2.6)
    numerics = Numerics(
        grid=int(rng.integers(9, 33)),
        extent=extent,
        harmonics=int(2 * rng.integers(0, 8) + 1),
    )
    where = {
        "centre": tuple(0.3 * extent * rng.uniform(-1, 1, 2)),
        "reverse": bool(rng.integers(2)),
    }
    axes = tuple(rng.uniform(0.2, 1, 2))
    gaits = (
        Circle(**where),
        Ellipse(semi_axes=axes, tilt=rng.uniform(0, 3), **where),
        Butterfly(**where),
        Fourier(cos=((0.5, 0.1), (0.0, 0.2)), sin=((0.0, 0.3), (0.6, 0.0)), **where),
    )
    gait = gaits[rng.integers(4)]
    size = np.abs(gait.unit(np.linspace(0, 2 * np.pi, 500))).max()
    largest = 0.98 * (extent - np.abs(gait.centre).max()) / size
    gait = dataclasses.replace(gait, amplitude=largest)
    return Scene(Swimmer(medium, body, effects), gait, numerics)


@pytest.mark.soak
@pytest.mark.parametrize("ending", ENDINGS)
def test_errors_of_tables_of_random_scenes_cover(ending, tmp_path):
    ratios = []
    for seed in range(100):
        source = SceneTables(random_scene(np.random.default_rng(seed)))
        gait = source.scene.gait
        amplitudes = gait.amplitude * np.array([0.3, 0.7, 1.0])
        fields.save_connection(tmp_path / f"a{ending}", source)
        table = Scene(Table(tmp_path / f"a{ending}"), gait)
        poses, errors = estimate.direct(table, gait, amplitudes, 256)
        true = source.poses("direct", None, amplitudes)
        off = estimate.pose_distance(poses, true, body_size(source.scene.system))
        ratios.append(errors / np.maximum(off, 1e-12))
    covered = (np.array(ratios) >= 1).mean((0, 1))
    assert (covered >= 0.98).all()
    assert np.median(np.array(ratios)[..., 0]) < 25


SCALY = (rft.SkinFriction(0.05, 0.25),)  # tells forwards from backwards


# Tables as systems.


def test_a_table_is_pickled_as_the_name_of_its_file(made):
    table = Table(made[0] / "a.nc")
    pickled = pickle.dumps(table)
    assert pickle.loads(pickled) == table
    assert len(pickled) < 1000


@pytest.mark.parametrize("length", [1.0, 3.0])
def test_lengths_that_a_file_does_not_state_are_assumed_or_given(
    length, made, tmp_path
):
    path = tmp_path / "a.mat"
    plain_mat(path, made[1].fitted)
    bare = Table(path)
    assert bare.assumed[-1] == LENGTHS
    assert (length_unit(bare), bare.length) == ("BL", 1.0)
    told = Table(path, body_length=length)
    assert LENGTHS not in told.assumed
    assert length_unit(told) == "BL"
    scaled = told.velocity([0.2, 0.4], [1.0, -0.5]) * [length, length, 1]
    xi = bare.velocity([0.2, 0.4], [1.0, -0.5])
    np.testing.assert_allclose(scaled, xi, rtol=1e-13)


def test_what_accuracy_costs_includes_the_tables_own_error(made):
    scene = Scene(Table(made[0] / "a.nc"), GAIT).with_numerics(phases=64)
    found = api.accuracy(scene, runs=1)
    own = table_error(scene.system, *GAIT.cycle(64, found["amplitude"].values))
    largest = own[:, 0].max()
    assert float(found["own_error"]) == largest
    met = found["tolerance"].values > largest
    best = found["best_error"].values
    np.testing.assert_array_equal(np.isfinite(best), met)
    assert (best[met] > largest).all()
