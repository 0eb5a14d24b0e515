"""Connections in files: read back as they were, predicting what the scene they came from predicts, and never believed."""

import contextlib
import dataclasses
import io
import json
import pickle
import re
import shutil
import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest
import xarray
from commands import geomech
from registry import SYSTEMS
from scipy.io import loadmat, netcdf_file, savemat
from tabled import of_json, tabled

import rft
from geomech import api, plots, scenes
from geomech.io import tables
from geomech.io.tables import base, mat, matlab, netcdf
from geomech.io.tables.base import checked_names
from geomech.io.tables.mat import ERROR
from geomech.mathematics.gaits import Butterfly, Circle, Ellipse, Fourier
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.systems import NoSlipSnake, Swimmer, Table
from geomech.mathematics.systems.base import length_unit
from geomech.mathematics.systems.capabilities import stored_table, table_error
from geomech.mathematics.systems.table import LENGTHS
from geomech.scenes import Numerics, Scene
from geomech.shell.describe.scene import description
from geomech.shell.describe.system import system_lines
from geomech.studies.displacement import choose, tiered
from geomech.studies.estimates import estimate
from geomech.studies.maps import fields
from geomech.studies.mechanics.single import diagnosed_velocity
from geomech.studies.scene_tables import SceneTables
from rft.bodies.base import body_size
from rft.core.refusal import Refusal
from rft.laws import CATALOGUE

pytestmark = pytest.mark.usefixtures("fastest")
GLASS, CLOSE = (CATALOGUE[f"glass-0.3mm-{x}"].medium for x in ("loose", "close"))
UNEVEN = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2))


def study(medium=GLASS, body=UNEVEN, **numerics):
    return SceneTables(
        Scene(
            Swimmer(medium, body),
            GAIT,
            Numerics(**{"grid": 9, "extent": 2.0, "harmonics": 5, **numerics}),
        )
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a.nc and a.mat of a table in a generic frame, and its study."""
    folder, s = tmp_path_factory.mktemp("tables"), study()
    fields.save_connection(folder / "a.nc", s)
    fields.save_connection(folder / "a.mat", s)
    return folder, s


def same(a: Connection, b: Connection):
    assert len(a.axes) == len(b.axes) and a.degree == b.degree
    assert a.size == b.size
    for x, y in zip(
        (*a.axes, a.A, a.residual, a.speed), (*b.axes, b.A, b.residual, b.speed)
    ):
        np.testing.assert_array_equal(x, y)


def test_netcdf_gives_back_every_digit(made):
    folder, s = made
    same(Connection.load(folder / "a.nc"), s.fitted)
    held = tables.load(folder / "a.nc")
    np.testing.assert_array_equal(
        held.harmonics.coefficients, s.table("harmonic").coefficients
    )
    np.testing.assert_array_equal(held.harmonics.residual, s.table("harmonic").residual)
    assert (held.length, held.unit, held.frame, held.sign, held.assumptions) == (
        0.3,
        "m",
        "link-1",
        "+",
        (),
    )
    assert held.mirror and not tables.load(folder / "a.mat").harmonics
    for off, mirror in (
        (1e-11, True),
        (1e-7, False),
    ):  # of the largest A, where some are 0
        A = held.connection.A + off * np.abs(held.connection.A).max() * (
            np.arange(s.fitted.A[0, 0].size) == 3
        ).reshape(s.fitted.A[0, 0].shape)
        moved = dataclasses.replace(
            held, connection=dataclasses.replace(held.connection, A=A)
        )
        assert moved.mirror == mirror and np.abs(A).min() < 1e-12


def test_netcdf_of_three_joints_and_of_singular_shapes(tmp_path):
    wave = Fourier(cos=((0.2,), (0.1,), (0.0,)), sin=((0.0,), (0.3,), (0.4,)))
    five = SceneTables(
        Scene(
            Swimmer(GLASS, rft.Chain((1, 2, 1.5, 1))),
            wave,
            Numerics(grid=5, extent=1.1, interpolation=2),
        )
    )
    fields.save_connection(tmp_path / "a.nc", five)
    same(Connection.load(tmp_path / "a.nc"), five.fitted)
    assert SceneTables(Scene(Table(tmp_path / "a.nc"), wave)).tiers == (
        "area",
        "adapted",
        "path",
        "direct",
    )
    snake = SceneTables(Scene(NoSlipSnake(), GAIT, Numerics(grid=7)))
    fields.save_connection(tmp_path / "b.nc", snake)
    same(Connection.load(tmp_path / "b.nc"), snake.fitted)
    fields.save_connection(tmp_path / "b.mat", snake)
    again = Connection.load(tmp_path / "b.mat")
    np.testing.assert_array_equal(again.A, snake.fitted.A)
    np.testing.assert_array_equal(again.residual, snake.fitted.residual)
    for name in ("b.nc", "b.mat"):
        with pytest.raises(
            ValueError,
            match="has singular shapes .nan., and nothing is looked up between those$",
        ):
            Table(tmp_path / name)


@pytest.mark.parametrize("sign", "+-")
@pytest.mark.parametrize("order", ["ndgrid", "meshgrid"])
def test_a_mat_round_trip_keeps_every_digit(sign, order, made, tmp_path):
    _, s = made
    fields.save_connection(tmp_path / "a.mat", s, sign=sign, order=order)
    found = loadmat(tmp_path / "a.mat")
    A = found["Ay2"] if order == "ndgrid" else found["Ay2"].T
    np.testing.assert_array_equal(A, (1 if sign == "+" else -1) * s.fitted.A[1, 1])
    run = np.meshgrid(*s.fitted.axes, indexing="ij" if order == "ndgrid" else "xy")
    np.testing.assert_array_equal([found["alpha1"], found["alpha2"]], run)
    again = SceneTables(Scene(Table(tmp_path / "a.mat"), GAIT))
    np.testing.assert_array_equal(again.fitted.A, s.fitted.A)
    np.testing.assert_array_equal(again.fitted.residual, s.fitted.residual)
    assert (
        length_unit(again.scene.system),
        body_size(again.scene.system),
        again.scene.frame,
    ) == ("m", 0.3, "link-1")
    fields.save_connection(tmp_path / "b.mat", again, sign=sign, order=order)
    more = loadmat(tmp_path / "b.mat")
    for name in ("alpha1", "alpha2", "Ax1", "Ax2", "Ay1", "Ay2", "Atheta1", "Atheta2"):
        np.testing.assert_array_equal(more[name], found[name])


@pytest.mark.parametrize("links", [2, 4])
def test_a_mat_file_takes_two_joints_and_says_why(links, tmp_path, monkeypatch):
    """Before anything is computed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(SceneTables, "compute_field", None)
    gait = Fourier(cos=((0.2,),) * (links - 1), sin=((0.1,),) * (links - 1))
    scene = Scene(
        Swimmer(rft.Viscous(2.0), rft.Chain((1,) * links)), gait, Numerics(grid=5)
    )
    Path("mine.toml").write_text(scenes.toml(scene))
    said = f"a .mat file has a layout of 2 joints, and this body has {links - 1}: write a .nc file"
    with pytest.raises(Refusal, match=said):
        fields.save_connection("a.mat", SceneTables(scene))
    for more in ((), ("--plot", "a.png")):
        code, _, err = geomech("connection", "mine.toml", "-o", "a.mat", *more)
        assert code == 2 and said in err and err.count("\n") == 1 and "maps" not in err
    assert [*tmp_path.iterdir()] == [tmp_path / "mine.toml"]


def test_a_connection_of_one_joint_is_not_drawn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = Scene(
        Swimmer(rft.Viscous(2.0), rft.Chain((1, 1))),
        Fourier(cos=((0.2,),), sin=((0.1,),)),
        Numerics(grid=5),
    )
    Path("mine.toml").write_text(scenes.toml(scene))
    for command in (
        ("connection", "mine.toml", "-o", "a.nc", "--plot", "a.png"),
        ("ccf", "mine.toml", "--plot", "a.png"),
    ):
        code, _, err = geomech(*command)
        assert (
            code == 2
            and "mine.toml: a body of one joint has no map, a loop of it encloses no area"
            in err
        )
    assert [*tmp_path.iterdir()] == [tmp_path / "mine.toml"]


@pytest.mark.parametrize("ending", [".nc", ".mat"])
def test_intervals_of_a_table_of_ones_own_are_kept_and_part_of_its_error(
    ending, made, tmp_path
):
    """Of whatever file has them beside A, on a grid of its own."""
    folder, s = made
    error = 0.01 * np.random.default_rng(0).uniform(1, 2, s.fitted.A.shape)
    path = tmp_path / f"a{ending}"
    if ending == ".nc":
        data = xarray.open_dataset(folder / "a.nc", engine="scipy").load()
        data["A_error"] = (data.A.dims, error)
        data.attrs["level"] = 0.9
        path.write_bytes(data.to_netcdf(engine="scipy", format="NETCDF3_64BIT"))
    else:
        plain_mat(
            path,
            s.fitted,
            geomech_A_error=error,
            geomech_about=json.dumps({"sign": "+", "level": 0.9}),
        )
        halves = stored_table(Table(path, body_length=2.0), "A_error")
        np.testing.assert_allclose(
            halves, error * np.array([0.5, 0.5, 1]).reshape(3, 1, 1, 1)
        )
    table = SceneTables(Scene(Table(path), GAIT))
    np.testing.assert_array_equal(fields.full_result(table).to_xarray().A_error, error)
    fields.save_connection(tmp_path / "b.nc", table)
    fields.save_connection(tmp_path / "b.mat", table, sign="-", order="meshgrid")
    for again in (tables.load(tmp_path / "b.nc"), tables.load(tmp_path / "b.mat")):
        np.testing.assert_array_equal(again.A_error, error)
        assert again.level == 0.9
    cycle = GAIT.cycle(64, 0.7)
    plain = dataclasses.replace(table.scene.system.stored, A_error=None)
    whole = table_error(table.scene.system, *cycle)
    object.__setattr__(table.scene.system, "stored", plain)
    more = whole - table_error(table.scene.system, *cycle)
    path_length = 2 * np.pi * np.linalg.norm(cycle[1], axis=-1).mean()
    low, high = (
        np.sqrt(2) * 0.01 * k * path_length for k in (1.0, 2.0)
    )  # of the heading, and of x and y in body lengths
    assert low < more[1] < high and more[0] * body_size(table.scene.system) > low


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            np.ones((3, 2, 9, 8)),
            r"A_error of shape \(3, 2, 9, 8\) where A has \(3, 2, 9, 9\)",
        ),
        (-np.ones((3, 2, 9, 9)), "A_error below 0"),
        (np.full((3, 2, 9, 9), np.nan), "A_error that is not finite"),
    ],
)
def test_intervals_that_are_none_are_refused(error, said, made, tmp_path):
    plain_mat(
        tmp_path / "a.mat",
        made[1].fitted,
        geomech_A_error=error,
        geomech_about=json.dumps({"sign": "+"}),
    )
    with pytest.raises(Refusal, match=said):
        tables.load(tmp_path / "a.mat")


def plain_mat(path, c: Connection, sign=1.0, order="ndgrid", **more):
    """As sysplotter has it, and nothing beside."""
    run = (lambda x: x) if order == "ndgrid" else np.transpose
    shapes = np.meshgrid(*c.axes, indexing="ij")
    rows = {
        f"A{row}{k + 1}": run(sign * c.A[i, k])
        for i, row in enumerate(("x", "y", "theta"))
        for k in (0, 1)
    }
    savemat(path, {"alpha1": run(shapes[0]), "alpha2": run(shapes[1]), **rows, **more})


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-2", "link-3"])
@pytest.mark.parametrize("medium", [GLASS, rft.Viscous(2.0), rft.Granular(6.0, 0.3)])
def test_the_sign_of_a_bare_mat_file_is_made_out(frame, medium, tmp_path):
    c = study(medium, rft.Chain((1, 1.3, 0.8), frame=frame)).fitted
    for sign, order in ((1.0, "meshgrid"), (-1.0, "ndgrid")):
        plain_mat(tmp_path / "a.mat", c, sign, order)
        held = tables.load(tmp_path / "a.mat")
        assert (held.sign, held.order) == ("+" if sign > 0 else "-", order)
        assert "its sign is made out as xi = " + held.sign in held.assumptions[-1]
        np.testing.assert_array_equal(held.connection.A, c.A)
        assert np.isnan(held.connection.residual).all() and not held.has_residual
        told = tables.load(tmp_path / "a.mat", sign="+")
        np.testing.assert_array_equal(told.connection.A, sign * c.A)
        assert not [line for line in told.assumptions if "sign" in line]


@pytest.mark.parametrize(
    "args",
    [
        ["explain"], ["displacement", "--amplitudes", "0.3"], ["sweep", "--over", "gait.amplitude=0.3", "-o", "s.nc"],
        ["connection", "-o", "c.nc"], ["ccf", "--plot", "c.png"],
    ],
    ids=lambda args: args[0],
)  # fmt: skip
def test_a_sign_that_is_made_out_is_noted_once(args, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plain_mat("a.mat", study().fitted)
    (tmp_path / "t.toml").write_text(
        '[system]\nkind = "table"\nfile = "a.mat"\n[gait]\nkind = "circle"\namplitude = 0.3\n'
    )
    code, _, err = geomech(args[0], "t.toml", *args[1:])
    assert code == 0 and err.count("its sign is made out as") == 1


def test_a_sign_that_cannot_be_made_out_is_asked_for(tmp_path):
    c = study().fitted
    plain_mat(
        tmp_path / "a.mat", Connection(c.axes, np.ones_like(c.A), c.residual, c.speed)
    )
    with pytest.raises(
        Refusal, match=r"a\.mat does not tell the sign of A: say sign = '\+'"
    ):
        tables.load(tmp_path / "a.mat")
    assert tables.load(tmp_path / "a.mat", "-").connection.A[0, 0, 0, 0] == -1


def test_rows_of_angles_need_an_order(tmp_path):
    c = study(grid=7).fitted
    plain_mat(tmp_path / "a.mat", c)
    found = {k: v for k, v in loadmat(tmp_path / "a.mat").items() if k[0] != "_"}
    savemat(tmp_path / "a.mat", {**found, "alpha1": c.axes[0], "alpha2": c.axes[1]})
    with pytest.raises(Refusal, match="leave the order open: say order"):
        tables.load(tmp_path / "a.mat")
    np.testing.assert_array_equal(
        tables.load(tmp_path / "a.mat", order="ndgrid").connection.A, c.A
    )
    plain_mat(tmp_path / "a.mat", c)
    with pytest.raises(Refusal, match="arrays that run as ndgrid's"):
        tables.load(tmp_path / "a.mat", order="meshgrid")


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


@pytest.mark.parametrize(
    ("body", "medium", "ending"),
    [
        ("even", GLASS, ".nc"), ("uneven", GLASS, ".nc"), ("short head", CLOSE, ".nc"), ("uneven", rft.Viscous(2.0), ".nc"),
        ("uneven", CLOSE, ".mat"), ("even", rft.Viscous(3.0), ".mat"),
    ],
)  # fmt: skip
def test_a_table_predicts_what_its_scene_predicts_within_its_error(
    body, medium, ending, tmp_path
):
    source = study(medium, BODIES[body], grid=21, extent=2.3, harmonics=9)
    fields.save_connection(tmp_path / f"a{ending}", source)
    table = SceneTables(Scene(Table(tmp_path / f"a{ending}"), GAIT))
    ratios, length = [], body_size(source.scene.system)  # of the body, m in one of them
    for gait in GAITS:
        amplitudes = [0.3, 0.8, 1.2]
        true = source.poses("direct", gait, amplitudes)
        told = tabled(
            table.displacements(
                amplitudes, ["area", "path", "harmonic", "direct"], gait
            )
        )
        for tier in ("area", "path", "harmonic", "direct"):
            off = np.array(told[tier]) - true
            assert (
                np.hypot(*off.T[:2]) <= np.array(told["estimate"][tier]) + 1e-12
            ).all(), (tier, gait)
            assert (
                np.abs(off[:, 2]) <= np.array(told["estimate_heading"][tier]) + 1e-12
            ).all(), (tier, gait)
        ratios += list(
            np.array(told["estimate"]["direct"])
            / np.hypot(*(np.array(told["direct"]) - true).T[:2])
        )
        for tier in ("area", "path"):  # of the same connection
            np.testing.assert_allclose(
                told[tier],
                source.with_numerics(interpolation=3).poses(tier, gait, amplitudes),
                atol=2e-5,
            )
    assert np.median(ratios) < 60  # honest, not helpless
    if ending == ".nc" and medium.dry:
        assert (
            max(told["estimate"]["direct"]) < 0.02 * length
        )  # by its harmonics: of A alone it is 0.1 or more


def random_scene(rng):
    """A three-link swimmer in any medium, half of those in sand with skin friction, a gait that reaches the field's edge."""
    k = rng.integers(4)
    sands = (
        rft.Granular(10 ** rng.uniform(-1, 1), rng.uniform(0.1, 1.2)),
        GLASS,
        rft.Coulomb(),
    )
    medium = sands[k] if k < 3 else rft.Viscous(10 ** rng.uniform(0.1, 1.5))
    skin = rft.SkinFriction(*rng.uniform(0.05, 0.3, 2))
    body = rft.Chain(
        tuple(rng.uniform(0.5, 2, 3)),
        rng.uniform(0.1, 3),
        ("mean", "link-1", "link-2", "link-3")[rng.integers(4)],
    )
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
    ellipse = Ellipse(
        semi_axes=tuple(rng.uniform(0.2, 1, 2)), tilt=rng.uniform(0, 3), **where
    )
    fourier = Fourier(
        cos=((0.5, 0.1), (0.0, 0.2)), sin=((0.0, 0.3), (0.6, 0.0)), **where
    )
    gait = (Circle(**where), ellipse, Butterfly(**where), fourier)[rng.integers(4)]
    room = (
        0.98
        * (extent - np.abs(gait.centre).max())
        / np.abs(gait.unit(np.linspace(0, 2 * np.pi, 500))).max()
    )
    effects = (skin,) if k < 3 and rng.integers(2) else ()
    return Scene(
        Swimmer(medium, body, effects),
        dataclasses.replace(gait, amplitude=room),
        numerics,
    )


@pytest.mark.soak
def test_errors_of_tables_of_random_scenes_cover(tmp_path):
    ratios = {".nc": [], ".mat": []}
    for seed in range(100):
        source = SceneTables(random_scene(np.random.default_rng(seed)))
        gait, length = source.scene.gait, body_size(source.scene.system)
        amplitudes = gait.amplitude * np.array([0.3, 0.7, 1.0])
        for ending in ratios:
            fields.save_connection(tmp_path / f"a{ending}", source)
            poses, errors = estimate.direct(
                Scene(Table(tmp_path / f"a{ending}"), gait), gait, amplitudes, 256
            )
            off = estimate.pose_distance(
                poses, source.poses("direct", None, amplitudes), length
            )
            ratios[ending].append(errors / np.maximum(off, 1e-12))
    for ending, found in ratios.items():
        found = np.array(found)
        covered, median = (found >= 1).mean((0, 1)), np.median(found[..., 0])
        print(
            f"{ending}: {found.size // 2} positions and headings, covered {covered}, median {median:.3g} errors"
        )
        assert (covered >= 0.98).all() and median < 25


@pytest.mark.parametrize("ending", [".nc", ".mat"])
def test_what_is_even_in_alphadot_is_part_of_the_error(ending, tmp_path):
    """Skin friction that tells forwards from backwards: A, and odd harmonics, know nothing of it."""
    swimmer = Swimmer(GLASS, UNEVEN, (rft.SkinFriction(0.05, 0.25),))
    source = SceneTables(
        Scene(swimmer, GAIT, Numerics(grid=15, extent=2.0, harmonics=9))
    )
    alpha, unit = (
        np.array([source.fitted.axes[0][3], source.fitted.axes[1][10]]),
        connection.directions(2, 8),
    )
    both = swimmer.velocity(alpha, unit) + swimmer.velocity(alpha, -unit)
    np.testing.assert_allclose(
        source.even_part[:, 3, 10], np.sqrt((both**2).mean(0)), rtol=1e-6
    )
    assert study().even_part is None
    fields.save_connection(tmp_path / f"a{ending}", source)
    table = Scene(Table(tmp_path / f"a{ending}"), GAIT)
    assert ("xi is not odd in alphadot" in description(table)) == (ending == ".nc")
    for gait in (GAIT, Circle(amplitude=1.2), Butterfly(amplitude=0.8)):
        amplitudes = gait.amplitude * np.array([0.3, 0.8, 1.1])
        poses, errors = estimate.direct(table, gait, amplitudes, 128)
        off = estimate.pose_distance(
            poses, source.poses("direct", gait, amplitudes), 0.3
        )
        assert (off <= errors).all()
    if ending == ".nc":
        fields.save_connection(tmp_path / "b.nc", SceneTables(table))
        np.testing.assert_array_equal(
            tables.load(tmp_path / "b.nc").even, source.even_part
        )


def test_a_bare_mat_file_becomes_netcdf_that_says_what_it_does_not_know(made, tmp_path):
    plain_mat(tmp_path / "a.mat", made[1].fitted)
    bare = SceneTables(Scene(Table(tmp_path / "a.mat"), GAIT))
    assert diagnosed_velocity(bare.scene.system, [0.2, 0.3], [1, 0])["residual"] is None
    fields.save_connection(tmp_path / "a.nc", bare)
    held = tables.load(tmp_path / "a.nc")
    np.testing.assert_array_equal(held.connection.A, made[1].fitted.A)
    assert not held.has_residual and "fit residual unknown" in repr(held.connection)
    fields.save_connection(tmp_path / "b.mat", bare)
    assert not tables.load(tmp_path / "b.mat").has_residual


def test_every_command_works_on_a_table_or_says_why_not(made, tmp_path, monkeypatch):
    folder, s = made
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        plots, "save", lambda fig, *paths: [Path(path).touch() for path in paths]
    )
    (tmp_path / "t").mkdir()
    (tmp_path / "t" / "a.nc").write_bytes((folder / "a.nc").read_bytes())
    text = '[system]\nkind = "table"\nfile = "a.nc"\n[gait]\nkind = "circle"\namplitude = 0.8\n'
    (tmp_path / "t" / "t.toml").write_text(text)

    for args in (
        ("velocity", "t/t.toml", "--alpha", "0.5,0.3", "--alphadot", "1,0", "--json"),
        ("connection", "t/t.toml", "-o", "b.nc"),
        ("connection", "t/t.toml", "-o", "b.mat", "--sign", "-"),
        ("ccf", "t/t.toml", "--plot", "a.png"),
        ("displacement", "t/t.toml", "--amplitudes", "0.4,0.8", "--json"),
        ("sweep", "t/t.toml", "--over", "gait.amplitude=0.4,0.8", "-o", "s.nc"),
        ("explain", "t/t.toml"),
        ("displacement", "t/t.toml", "--amplitudes", "0.4,0.8", "--tol", "0.3"),
        ("run", "t/t.toml", "-o", "out"),
    ):
        code, out, err = geomech(*args)
        assert (code, err) == (0, ""), (args, err)
        if args[0] == "velocity":
            xi = tables.load(folder / "a.nc").harmonics.velocity(
                np.array([0.5, 0.3]), np.array([1.0, 0.0])
            )
            np.testing.assert_allclose(of_json(out)["xi"].values, xi)
    same(Connection.load("b.nc"), s.fitted)
    assert geomech("displacement", "t/t.toml", "--amplitudes", "5")[0] == 2
    before = (tmp_path / "t" / "a.nc").read_bytes()
    for args, said in (
        (("connection", "t/t.toml", "-o", "t/a.nc"), "it is an input"),
        (
            ("ccf", "t/t.toml", "--plot", "a.png", "--grid", "9"),
            "has its file's own grid: drop --grid",
        ),
        (
            ("connection", "t/t.toml", "-o", "c.nc", "--sign", "-"),
            "--sign is for a .mat file",
        ),
        (("connection", "t/t.toml", "-o", "c.mat", "--sign", "x"), "use one of +, -"),
    ):
        code, out, err = geomech(*args)
        assert (code, out) == (2, "") and said in err and err.count("\n") == 1
    assert (tmp_path / "t" / "a.nc").read_bytes() == before
    told = description(scenes.load("t/t.toml"))
    assert "fit leaves x" in told and "odd harmonics" in told and "frame link-1" in told
    assert [k.label for k in tiered.Settings(scenes.load("t/t.toml")).settings()] == [
        "direct: phases",
        "adapted: curves",
    ]
    written = scenes.toml(Scene(Table("t/a.nc"), Circle()))
    assert scenes.parse(written).system == Table("t/a.nc")
    again = pickle.loads(pickle.dumps(Table("t/a.nc")))
    assert again == Table("t/a.nc") and len(pickle.dumps(again)) < 1000


def test_a_table_is_told_its_unit_once(made, tmp_path):
    folder, s = made
    with pytest.raises(
        ValueError, match="says the body's length itself, 0.3 m: drop body_length"
    ):
        Table(folder / "a.mat", body_length=3.0)
    with pytest.raises(ValueError, match="is not the file whose sha256 is given"):
        Table(folder / "a.mat", sha256="0" * 64)
    plain_mat(tmp_path / "a.mat", s.fitted)
    thirds, ones = Table(tmp_path / "a.mat", body_length=3.0), Table(tmp_path / "a.mat")
    assert length_unit(thirds) == length_unit(ones) == "BL"
    xi = ones.velocity([0.2, 0.4], [1.0, -0.5])
    np.testing.assert_allclose(
        thirds.velocity([0.2, 0.4], [1.0, -0.5]), xi / [3, 3, 1], rtol=1e-13
    )
    with pytest.raises(
        ValueError,
        match="no frame .mean. of a table whose frame is .that of the table.: drop frame, or take",
    ):
        ones.in_frame("mean")


def test_lengths_that_a_file_does_not_tell_are_assumed_in_a_note(
    made, tmp_path, capsys
):
    """As the sign that is made out; nothing is noted of what the scene or the file says."""
    folder, s = made
    plain_mat(tmp_path / "a.mat", s.fitted)
    with netcdf_file(folder / "a.nc", mmap=False) as data:
        assert data.length_unit == b"m"
    raw = (
        (folder / "a.nc")
        .read_bytes()
        .replace(b"length_unit", b"length_UNIT")
        .replace(b"body_length", b"body_LENGTH")
    )
    (tmp_path / "a.nc").write_bytes(raw)
    for ending in ("mat", "nc"):
        file = tmp_path / f"a.{ending}"
        bare = Table(file)
        told = [line for line in bare.assumed if "body_length" in line]
        assert told == [LENGTHS] and LENGTHS in system_lines(bare)
        assert (length_unit(bare), bare.length) == ("BL", 1.0)
        assert (bare.stored.connection.unit, bare.stored.connection.length) == (
            "BL",
            1.0,
        )
        assert (Connection.load(file).unit, Connection.load(file).length) == (
            "length",
            None,
        )
        for length in (1.0, 3.0):
            said = Table(file, body_length=length)
            assert not [
                line for line in said.assumed if "body_length" in line
            ] and LENGTHS not in system_lines(said)
            np.testing.assert_allclose(
                said.stored.connection.A[0] * length,
                bare.stored.connection.A[0],
                rtol=1e-13,
            )
    for file in ("a.nc", "a.mat"):
        whole = Table(folder / file)
        assert whole.assumed == () and (
            whole.stored.connection.unit,
            whole.stored.connection.length,
        ) == ("m", 0.3)
    (tmp_path / "a.toml").write_text(
        '[system]\nkind = "table"\nfile = "a.mat"\n[gait]\nkind = "circle"\n'
    )
    assert scenes.load(tmp_path / "a.toml").system.body_length is None
    noted = capsys.readouterr().err.splitlines()
    assert [("sign" in line, LENGTHS in line) for line in noted] == [
        (True, False),
        (False, True),
    ]


def altered(raw, **changes):
    """The bytes of a NetCDF file with variables replaced, renamed or left out (None), or their dimensions turned round."""
    out = io.BytesIO()
    with (
        netcdf_file(io.BytesIO(raw), mmap=False) as old,
        netcdf_file(out, "w", version=2) as new,
    ):
        for key, value in vars(old).items():
            if key.startswith("_") or key in (
                "fp",
                "filename",
                "mode",
                "dimensions",
                "variables",
                "version_byte",
                "use_mmap",
                "maskandscale",
            ):
                continue
            setattr(new, key, changes.pop(key, value))
        for name, size in old.dimensions.items():
            new.createDimension(name, changes.get("size", {}).get(name, size))
        for name, v in old.variables.items():
            change = changes.get(name, lambda x: x)
            if change is None:
                continue
            dims = (
                tuple(reversed(v.dimensions))
                if changes.get("turned") == name
                else v.dimensions
            )
            values = np.asarray(change(v[:].copy()))
            w = new.createVariable(name, v.typecode(), dims)
            w[:] = values.transpose() if changes.get("turned") == name else values
            w.units = changes.get("units", {}).get(name, getattr(v, "units", b""))
        new.flush()
        return out.getvalue()


def test_files_of_less_and_files_that_xarray_wrote_are_read(made, tmp_path):
    folder, s = made
    raw = (folder / "a.nc").read_bytes()
    (tmp_path / "a.nc").write_bytes(
        altered(raw, speed=None, harmonics=None, harmonics_residual=None)
    )
    held = tables.load(tmp_path / "a.nc")
    assert held.harmonics is None
    np.testing.assert_allclose(held.connection.speed, s.fitted.speed, rtol=1e-12)
    with xarray.open_dataset(folder / "a.nc") as data:
        turned = data.assign(A=-data.A, harmonics=-data.harmonics).assign_attrs(
            sign_of_A="xi = - A alphadot"
        )
        turned.to_netcdf(tmp_path / "b.nc", engine="scipy")
    assert tables.load(tmp_path / "b.nc").sign == "-"
    same(Connection.load(tmp_path / "b.nc"), s.fitted)
    harmonics = tables.load(tmp_path / "b.nc").harmonics
    np.testing.assert_array_equal(
        harmonics.coefficients, s.table("harmonic").coefficients
    )


def put(where, value):
    def change(x):
        x[where] = value
        return x

    return change


BAD = {
    "missing": ({"A": None}, "A is missing"),
    "no axis": ({"alpha_2": None}, "alpha_2 is missing"),
    "nan": (
        {"A": put((1, 0, 2, 3), np.nan)},
        r"A that is not finite \(nan or inf\) at index \(1, 0, 2, 3\)",
    ),
    "inf": (
        {"fit_residual": put((1, 2, 3), np.inf)},
        "fit_residual that is not finite",
    ),
    "nan of harmonics": (
        {"harmonics": put((1, 2, 3, 0), np.nan)},
        "harmonics that is not finite",
    ),
    "huge": ({"A": lambda x: 1e200 * x}, "above 1e\\+09"),
    "degrees": (
        {"alpha_1": np.degrees},
        "alpha_1 up to 114.6 where angles are in rad: convert it if these are degrees",
    ),
    "units": ({"units": {"alpha_1": "degrees"}}, "alpha_1 in 'degrees'"),
    "not ascending": (
        {"alpha_2": lambda x: x[::-1]},
        "alpha_2 must be at least 4 ascending",
    ),
    "turned": (
        {"turned": "A"},
        r"A over \(alpha_2, alpha_1, joint, component\) where it must be",
    ),
    "unit": ({"length_unit": b"furlong"}, "length_unit that makes no sense"),
    "length": ({"body_length": -1.0}, "body_length"),
    "lengths": ({"body_length": [0.3, 0.3]}, "body_length"),
    "length in words": ({"body_length": b"0.3"}, "body_length"),
    "component": ({"component": lambda x: x[::-1]}, "rows x, y, theta"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_netcdf_is_refused_in_one_line(name, made, tmp_path):
    changes, said = BAD[name]
    raw = (made[0] / "a.nc").read_bytes()
    (tmp_path / "a.nc").write_bytes(altered(raw))
    tables.load(tmp_path / "a.nc")  # as it is it is good
    (tmp_path / "a.nc").write_bytes(altered(raw, **changes))
    with pytest.raises(Refusal, match=said) as caught:
        tables.load(tmp_path / "a.nc")
    assert str(caught.value).startswith(f"the table {tmp_path / 'a.nc'} ")
    text = (
        f'[system]\nkind = "table"\nfile = "{tmp_path}/a.nc"\n[gait]\nkind = "circle"\n'
    )
    with pytest.raises(Refusal, match=said):
        scenes.parse(text, "s.toml")


def test_a_metric_of_a_file_is_a_quadratic_form(tmp_path):
    fields.save_connection(tmp_path / "a.nc", study(rft.Viscous(), grid=5))
    raw = (tmp_path / "a.nc").read_bytes()
    assert tables.load(tmp_path / "a.nc").metric is not None
    (tmp_path / "a.nc").write_bytes(altered(raw, metric=put((0, 1, 2, 3), 9.0)))
    with pytest.raises(
        Refusal,
        match=r"a metric of shape \(2, 2, 5, 5\) where it must be .* and symmetric",
    ):
        tables.load(tmp_path / "a.nc")


@pytest.mark.parametrize("ending", ["nc", "mat"])
def test_damaged_files_are_refused_in_one_line(ending, made, tmp_path):
    """Cut short anywhere, or with bytes changed: refused in one line, or read as a table that is finite."""
    raw, path = (made[0] / f"a.{ending}").read_bytes(), tmp_path / f"a.{ending}"
    rng = np.random.default_rng(1)
    cuts = [
        raw[:n] for n in (0, 3, 10, 127, 130, 500, 2000, len(raw) // 2, len(raw) - 9)
    ]
    some = [bytearray(raw) for _ in range(150)]
    for changed in some:
        for k in rng.integers(0, 4000, rng.integers(1, 6)):
            changed[k % len(raw)] = rng.integers(256)
    for k, bad in enumerate(cuts + some):
        path.write_bytes(bad)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            held, said = read(path)
        assert (held is None) != (said == "")
        assert said == "" or (
            said.startswith(f"the table {path} ") and "\n" not in said
        )
        assert held is None or (k >= len(cuts) and np.isfinite(held.connection.A).all())


def read(path):
    """(table, "") or (None, what is wrong with the file)."""
    try:
        return tables.load(path), ""
    except Refusal as error:
        return None, str(error)


@pytest.mark.parametrize("name", ["", "x" * 61, "a\x1b", "$x$", 3, "lower"])
def test_names_of_joints_that_make_no_sense_are_not_taken(name):
    """Empty, too long, not printable, formulas, none, or twice the same."""
    usual = ["alpha_1", "alpha_2"]
    assert checked_names(["lower", name], usual) == tuple(usual)
    assert checked_names(["lower", "x" * 60], usual) == ("lower", "x" * 60)


def test_endings_that_lie(made, tmp_path):
    folder, _ = made
    nc, mat_file = (folder / "a.nc").read_bytes(), (folder / "a.mat").read_bytes()
    hdf = b"\x89HDF\r\n\x1a\n" + bytes(600)
    old = (
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124)
        + b"\x00\x02IM"
        + bytes(384)
        + hdf
    )
    for name, raw, said in (
        ("a.mat", nc, "is no MATLAB file, but a NetCDF one: end its name in .nc"),
        ("a.nc", mat_file, "is no NetCDF file, but a MATLAB one: end its name in .mat"),
        ("a.nc", hdf, r"is NetCDF-4 \(HDF5\): save it as classic NetCDF"),
        (
            "a.mat",
            hdf,
            r"is a MATLAB 7.3 \(HDF5\) file: the package h5py|damaged MATLAB 7.3",
        ),
        (
            "a.mat",
            old,
            r"is a MATLAB 7.3 \(HDF5\) file: the package h5py|damaged MATLAB 7.3",
        ),
        ("a.mat", b"t,x,y\n1,2,3\n", "no MATLAB file"),
        ("a.nc", b"t,x,y\n1,2,3\n", "is no NetCDF file: write it anew"),
        ("a.csv", b"t,x,y\n1,2,3\n", r"end the name in .nc or .mat"),
    ):
        (tmp_path / name).write_bytes(raw)
        with pytest.raises(Refusal, match=said):
            Connection.load(tmp_path / name)
    with pytest.raises(Refusal, match="cannot read the table .*No such file"):
        Connection.load(tmp_path / "none.nc")
    (tmp_path / "d.nc").mkdir()
    with pytest.raises(Refusal, match="no ordinary file"):
        Connection.load(tmp_path / "d.nc")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"Ay2": None}, "has no Ay2: a connection is alpha1, alpha2, Ax1"),
        (
            {"Ay2": np.zeros((9, 8))},
            r"Ay2 of shape \(9, 8\) where alpha1 and alpha2 make it \(9, 9\)",
        ),
        ({"Ax1": np.full((9, 9), np.nan)}, "Ax1 that is not finite"),
        ({"Ax1": np.full((9, 9), 1j)}, "Ax1 that is no array of real numbers"),
        ({"Ax1": "text"}, "Ax1 that is no array of real numbers"),
        ({"Ax1": {"a": 1}}, "Ax1 that is no array of real numbers"),
        ({"alpha1": np.ones((9, 9))}, "alpha1 must be at least 4 ascending angles"),
        ({"alpha1": np.arange(81.0).reshape(9, 9) / 81}, "span no grid"),
        (
            {"alpha2": np.linspace(-2, 2, 9) + 0.01 * np.outer(*np.eye(9)[[0, 0]])},
            "span no grid",
        ),  # but for one corner
        ({"alpha1": np.ones((3, 3, 3))}, "span no grid"),
        ({"degrees": True}, "alpha1 up to 114.6 where angles are in rad"),
    ],
)
def test_bad_mat_is_refused_in_one_line(changes, said, made, tmp_path):
    plain_mat(tmp_path / "a.mat", made[1].fitted)
    found = {k: v for k, v in loadmat(tmp_path / "a.mat").items() if k[0] != "_"}
    if changes.pop("degrees", False):
        changes = {k: np.degrees(found[k]) for k in ("alpha1", "alpha2")}
    found = {k: v for k, v in {**found, **changes}.items() if v is not None}
    for compressed in (False, True):
        savemat(tmp_path / "a.mat", found, do_compression=compressed)
        with pytest.raises(Refusal, match=said):
            tables.load(tmp_path / "a.mat")


def test_a_mat_file_may_be_compressed_or_of_version_4_but_no_bomb(
    made, tmp_path, monkeypatch
):
    c = made[1].fitted
    plain_mat(tmp_path / "a.mat", c)
    found = {k: v for k, v in loadmat(tmp_path / "a.mat").items() if k[0] != "_"}
    for options in ({"do_compression": True}, {"format": "4"}):
        savemat(tmp_path / "a.mat", found, **options)
        np.testing.assert_array_equal(tables.load(tmp_path / "a.mat").connection.A, c.A)
    savemat(tmp_path / "a.mat", {"deep": np.full((1,) * 32, 2.5)})
    assert matlab.arrays((tmp_path / "a.mat").read_bytes())["deep"] == 2.5
    monkeypatch.setattr("geomech.io.tables.matlab.LARGEST", 100_000)
    savemat(tmp_path / "a.mat", {**found, "more": np.zeros(10**6)}, do_compression=True)
    with pytest.raises(Refusal, match="is damaged, cut short, or no MATLAB file"):
        tables.load(tmp_path / "a.mat")


def test_a_scene_that_is_written_elsewhere_finds_its_file(tmp_path):
    shutil.copy(SYSTEMS["table"].file, tmp_path / "t.nc")
    text = (
        '# my table\n[system]\nkind = "table"\nfile = "{}"\n[gait]\nkind = "circle"\n'
    )
    (tmp_path / "s.toml").write_text(text.format("t.nc"))
    made = scenes.load(tmp_path / "s.toml")
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "scene.toml").write_text(scenes.toml(made))
    assert scenes.load(tmp_path / "results" / "scene.toml").system == made.system
    whole = scenes.parse(text.format(tmp_path / "t.nc"), "s.toml")
    assert scenes.toml(whole) == whole.text  # comments and all


def test_what_accuracy_costs_includes_the_tables_own_error(made, monkeypatch):
    scene = Scene(Table(made[0] / "a.nc"), GAIT).with_numerics(phases=64)
    monkeypatch.setattr(
        tiered, "SETTINGS", [k for k in tiered.SETTINGS if k.label == "direct: phases"]
    )
    found = api.accuracy(scene, runs=1)
    amplitudes = found["amplitude"].values
    own = table_error(scene.system, *GAIT.cycle(64, amplitudes))[:, 0].max()
    assert float(found["own_error"]) == own and 1e-4 < own < 0.1
    tolerances, error = found["tolerance"].values, found["best_error"].values
    np.testing.assert_array_equal(np.isnan(error), tolerances < own)
    assert (error[tolerances > own] > own).all()
    assert (error[tolerances > own] <= tolerances[tolerances > own]).all()
    assert f"the system's own, {own:.1e} BL" in str(found)
    monkeypatch.setattr(choose, "MAX_PHASES", 256)
    with pytest.raises(
        Refusal,
        match="no tier gets to 1e-06 .*: raise tolerance, or take a finer table",
    ):
        choose.cheapest_displacements(scene, [0.5], 1e-6)


# What a NetCDF file holds, part by part.


def parts_of_a_file():
    """Variables, with their dimensions, units and attributes of a table of 5 by 4 shapes of a body 0.3 m long."""
    rng = np.random.default_rng(0)
    axes, over = (
        (np.linspace(-1, 1, 5), np.array([-0.5, 0.0, 0.2, 0.9])),
        ("alpha_1", "alpha_2"),
    )
    sizes = {
        "component": 3,
        "joint": 2,
        "other_joint": 2,
        "coefficient": 4,
        "norm_coefficient": 5,
        "pair": 1,
    }
    lead = {
        "A": ("component", "joint"), "fit_residual": ("component",), "speed": ("component",), "even_part": ("component",),
        "harmonics": ("component", "coefficient"), "harmonics_residual": ("component",), "A_error": ("component", "joint"),
        "norm": ("norm_coefficient",), "norm_residual": (), "ccf_pairs": ("pair", "component"),
    }  # fmt: skip
    variables = {
        name: ((*x, *over), rng.uniform(0.1, 1.0, [*map(sizes.get, x), 5, 4]))
        for name, x in lead.items()
    }
    variables |= {name: ((name,), axis) for name, axis in zip(over, axes)} | {
        "joint": (("joint",), np.arange(2))
    }
    variables["component"] = (
        ("component", "component_length"),
        np.array(
            [list("x".ljust(5, "\0")), list("y".ljust(5, "\0")), list("theta")], "S1"
        ),
    )
    variables["pair_joints"] = (("pair", "pair_joint"), np.array([[1.0, 2.0]]))
    attributes = {
        "length_unit": b"m",
        "body_length": 0.3,
        "interpolation": 2,
        "frame": b"mean",
        "level": 0.9,
        "power_degree": 1.5,
    }
    return variables, dict.fromkeys(variables, ""), attributes


def read_parts(change=lambda variables, units, attributes: None, sign=""):
    parts = parts_of_a_file()
    change(*parts)
    return netcdf._stored(netcdf._Contents(*parts), sign, "0f")


def test_every_part_of_a_file_is_where_it_belongs():
    v = {name: values for name, (_, values) in parts_of_a_file()[0].items()}
    for sign, stated, turn in (
        ("", "", 1),
        ("-", "", -1),
        ("", "xi = - A alphadot", -1),
        ("+", "xi = - A alphadot", 1),
    ):
        held = read_parts(
            lambda v, u, a, stated=stated: a.update(sign_of_A=stated.encode()), sign
        )
        c = held.connection
        for found, wanted in zip(
            (*c.axes, c.A, c.residual, c.speed, held.harmonics.coefficients, held.harmonics.residual, held.even, held.A_error),
            (v["alpha_1"], v["alpha_2"], turn * v["A"], v["fit_residual"], v["speed"], turn * v["harmonics"],
             v["harmonics_residual"], v["even_part"], v["A_error"]),
        ):  # fmt: skip
            np.testing.assert_array_equal(found, wanted)
        assert held.sign == "+-"[turn < 0]
    assert (c.degree, held.harmonics.degree, c.unit, c.length, held.frame) == (
        2,
        2,
        "m",
        0.3,
        "mean",
    )
    assert (held.length, held.unit, held.order, held.sized, held.level) == (
        0.3,
        "m",
        "ndgrid",
        True,
        0.9,
    )
    assert (held.sha256, held.body, held.power_degree) == ("0f", None, 1.5)
    np.testing.assert_array_equal(held.metric.coefficients, v["norm"])
    np.testing.assert_array_equal(held.metric.residual, v["norm_residual"])


def less(*names):
    def change(variables, _, attributes):
        for name in names:
            variables.pop(name, None)
            attributes.pop(name, None)

    return change


def test_what_a_file_does_not_say_is_the_usual():
    v = {name: values for name, (_, values) in parts_of_a_file()[0].items()}
    held = read_parts(
        less(
            "speed",
            "harmonics_residual",
            "norm_residual",
            "length_unit",
            "body_length",
            "interpolation",
            "frame",
            "level",
        )
    )
    np.testing.assert_allclose(
        held.connection.speed,
        np.sqrt((v["A"] ** 2).mean(1) + v["fit_residual"] ** 2),
        rtol=1e-12,
    )
    np.testing.assert_array_equal(held.harmonics.residual, v["fit_residual"])
    assert (held.metric.residual == 0).all() and held.metric.residual.shape == (5, 4)
    assert (held.connection.degree, held.length, held.unit, held.sized, held.level) == (
        3,
        1.0,
        "BL",
        False,
        None,
    )
    assert held.connection.length is None and held.frame == "that of the table"
    held = read_parts(
        less(
            "harmonics",
            "even_part",
            "A_error",
            "power_degree",
            "component",
            "pair_joints",
            "ccf_pairs",
        )
    )
    assert (
        held.harmonics
        is held.even
        is held.A_error
        is held.metric
        is held.power_degree
        is None
    )
    metric = lambda v, u, a: v.update(
        metric=(("joint", "other_joint", "alpha_1", "alpha_2"), np.ones((2, 2, 5, 4)))
    )
    assert (read_parts(metric).power_degree, read_parts(metric).metric.M.shape) == (
        1.5,
        (2, 2, 5, 4),
    )
    assert (
        read_parts(
            lambda v, u, a: (metric(v, u, a), a.pop("power_degree"))
        ).power_degree
        is None
    )


def cut(name, where, dimensions=None):
    def change(variables, *_):
        over, values = variables[name]
        variables[name] = (dimensions or over, np.array(values[where]))

    return change


def attribute(**values):
    return lambda variables, units, attributes: attributes.update(values)


def masked(*names, singular=True):
    """The shape (1, 2) is singular, in some variables."""

    def change(variables, units, attributes):
        for name in names:
            variables[name][1][..., 1, 2] = np.nan
        attributes.update({"singular_shapes": b"nan"} if singular else {})

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (less("joint"), "holds no connection, joint is missing: write it anew"),
        (less("alpha_2"), "holds no connection, alpha_2 is"),
        (cut("joint", np.s_[:, None]), "has A over"), (less("fit_residual"), "holds no connection, fit_residual is missing"),
        (lambda v, u, a: u.update(alpha_2="degrees"), "has alpha_2 in 'degrees': shapes are angles in rad"),
        (lambda v, u, a: u.update(alpha_2="radians", alpha_1="rad"), ""),
        (cut("A", np.s_[:2]), r"has A of shape (2, 2, 5, 4) where"),
        (cut("A", np.s_[:, :1]), "has A of shape (3, 1, 5, 4) where it must be (3, 2, ...), rows x, y, theta"),
        (cut("fit_residual", np.s_[:2]), "has A of shape (3, 2, 5, 4) where"),
        (cut("component", np.s_[::-1]), "has A of shape"),
        (cut("A", np.s_[..., :3]), "has A of shape (3, 2, 5, 3) that does not fit its grid"),
        (cut("A", (), ("joint", "component", "alpha_1", "alpha_2")), "has A over (joint, component, alpha_1, alpha_2) where"),
        (lambda v, u, a: v.update(A=(v["A"][0], np.ones((3, 2, 5, 4), int))), "has A of shape (3, 2, 5, 4) that"),
        (attribute(length_unit=b"feet"), "has a body_length or length_unit that makes no sense"),
        (attribute(body_length=1e9), "has a body"),
        (attribute(body_length=0), "has a body_length"), (attribute(body_length=0.99e9), ""),
        (attribute(body_length=b"1"), "has a body"),
        (attribute(interpolation=4), "has too few shapes for a spline of degree 4: write"), (attribute(interpolation=3), ""),
        (attribute(interpolation=6), ""), (attribute(interpolation=0), ""),
        (cut("harmonics", np.s_[:, :3]), "has harmonics of shape (3, 3, 5"),
        (cut("harmonics", np.s_[:2]), "has harmonics of shape (2, 4, 5, 4)"),
        (cut("harmonics", np.s_[:, :0]), "has harmonics of shape (3, 0"),
        (cut("harmonics_residual", np.s_[:2]), "has harmonics of shape"), (cut("harmonics", np.s_[:, :2]), ""),
        (cut("even_part", np.s_[:2]), "has even_part of shape (2, 5, 4) where it must be (3, ...)"),
        (cut("A_error", np.s_[:, :1]), "has A_error of shape (3, 1, 5, 4) where A has (3, 2, 5, 4)"),
        (lambda v, u, a: v["A_error"][1].__setitem__((0, 1, 2, 3), -1e-9),
        "has A_error below 0 where it is half of an interval of A"),
        (lambda v, u, a: v["A_error"][1].fill(0.0), ""),
        (cut("pair_joints", np.s_[:, ::-1]), "has pair_joints other than [[1, 2]]"),
        (cut("ccf_pairs", np.s_[:, :2]), "has ccf_pairs of shape (1, 2, 5, 4) where it must be (1, 3, ...)"),
        (cut("ccf_pairs", np.s_[[0, 0]]), "has ccf_pairs of shape (2, 3, 5, 4)"),
        (lambda v, u, a: v["ccf_pairs"][1].__setitem__((0, 2, 1, 1), np.nan), "has ccf_pairs that is not finite"),
        (attribute(power_degree=100.0), "has a power_degree that makes no sense"), (attribute(power_degree=99), ""),
        (attribute(power_degree=0), "has a power_degree"), (attribute(power_degree=[1.0, 2.0]), "has a power_degree"),
        (attribute(power_degree=b"1"), "has a power_degree"), (attribute(power_degree=0.1), ""),
        (cut("norm", np.s_[:4]), "has a norm of shape (4, 5, 4) where it must be (an odd number, ...) of two joints"),
        (cut("norm", np.s_[:3]), ""), (masked("A", "fit_residual", "speed", "A_error"), ""),
        (masked("A", "fit_residual", "speed", "A_error", singular=False),
        "has A that is not finite (nan or inf) at index (0, 0, 1, 2)"),
        (masked("A", "A_error"), "has fit_residual at singular shapes, where A is nan: write it anew"),
        (masked("A", "fit_residual"), "has A_error at singular shapes"),
        (masked("fit_residual"), "has fit_residual that is not finite"),
        (lambda v, u, a: v["fit_residual"][1].fill(np.nan), ""), (masked("A_error"), "has A_error that is not finite"),
    ],
)  # fmt: skip
def test_parts_of_a_file_fit_each_other_or_are_refused(change, said):
    if not said:
        read_parts(change)
        return
    with pytest.raises(Refusal) as found:
        read_parts(change)
    assert str(found.value).startswith(said)


def test_singular_shapes_leave_no_harmonics_nor_even_part():
    held = read_parts(masked("A", "fit_residual", "harmonics", "even_part", "A_error"))
    assert held.harmonics is held.even is None
    assert (
        np.argwhere(np.isnan(held.connection.A[0, 0])).tolist() == [[1, 2]]
        and np.isnan(held.A_error).sum() == 6
    )


def parts_of_a_gait(**changes):
    """Of two joints, with one harmonic of the gait and two of A."""
    rng = np.random.default_rng(0)
    shapes = {
        "gait": (2, 3),
        "gait_A": (3, 2, 5),
        "gait_slope": (3, 2, 1, 5),
        "gait_errors": (4, 3, 2, 2, 5),
        "gait_off": (3, 2, 7),
    }
    parts = {name: rng.normal(size=shape) for name, shape in shapes.items()}
    parts |= {
        "gait_spread": np.eye(2)[..., None] * [1.0, 2.0, 3.0],
        "gait_beyond": np.array([-0.1, 0.2, 0.3]),
    } | changes
    return {name: ((), values) for name, values in parts.items() if values is not None}


OF_A_GAIT = {"level": 0.9, "error_factor": 2.1}


def taylor_series(variables, attributes, factor):
    return netcdf._taylor_series(netcdf._Contents(variables, {}, attributes), factor)


def test_parts_of_a_gait_are_where_they_belong():
    parts = {name: values for name, (_, values) in parts_of_a_gait().items()}
    for turn in (1.0, -1.0):
        found = taylor_series(parts_of_a_gait(), OF_A_GAIT, turn)
        for name, values in (
            ("A", turn * parts["gait_A"]), ("slope", turn * parts["gait_slope"]), ("errors", turn * parts["gait_errors"]),
            ("spread", parts["gait_spread"]), ("beyond", [0.1, 0.2, 0.3]), ("standard_error", np.abs(parts["gait_off"])),
        ):  # fmt: skip
            np.testing.assert_array_equal(getattr(found, name), values)
        np.testing.assert_array_equal(found.loop.coefficients, parts["gait"])
        assert (found.level, found.factor) == (0.9, 2.1)
    assert (
        taylor_series(parts_of_a_gait(gait_off=None), OF_A_GAIT, 1.0).standard_error
        == np.zeros((3, 2, 1))
    ).all()


@pytest.mark.parametrize(
    ("changes", "facts", "said"),
    [
        ({"gait_A": np.ones((3, 2))}, {}, "has a gait, but no gait_A that fits it: write it anew with 'geomech fit-gait"),
        ({"gait_spread": None}, {}, "has a gait, but no gait_spread"),
        ({"gait": np.ones((1, 2, 3))}, {}, "has a gait, but no gait that"),
        ({"gait_A": np.ones((2, 2, 5))}, {}, "parts"), ({"gait_A": np.ones((3, 3, 5))}, {}, "parts"),
        ({"gait_A": np.ones((3, 2, 7))}, {}, "parts"),
        ({"gait_slope": np.ones((3, 2, 2, 5))}, {}, "parts"), ({"gait_slope": np.ones((3, 2, 1, 3))}, {}, "parts"),
        ({"gait_slope": np.ones((2, 2, 1, 5))}, {}, "parts"), ({"gait_errors": np.ones((4, 2, 2, 2, 5))}, {}, "parts"),
        ({"gait_errors": np.ones((4, 3, 2, 1, 5))}, {}, "parts"), ({"gait_errors": np.ones((0, 3, 2, 2, 5))}, {}, ""),
        ({"gait_spread": np.ones((2, 1, 3))}, {}, "parts"), ({"gait_spread": np.ones((2, 2, 3))}, {}, "parts"),
        ({"gait_spread": np.eye(3)[..., None]}, {}, "parts"), ({"gait_beyond": np.ones(2)}, {}, "parts"),
        ({"gait_off": np.ones((3, 2))}, {}, "parts"), ({"gait_off": np.ones((3, 1, 7))}, {}, "parts"),
        ({"gait_off": np.ones((3, 2, 0))}, {}, "parts"),
        ({"gait_off": np.ones((2, 2, 7))}, {}, "parts"), ({"gait": np.ones((2, 4))}, {}, "parts"),
        ({"gait": np.ones((2, 5))}, {}, ""),
        ({"gait": np.ones((2, 1))}, {}, "has a gait that does not move: write it"),
        ({"gait": np.eye(2, 3)[:, ::-1] * 0}, {}, "has a gait that"),
        ({"gait_A": np.ones((3, 2, 4)), "gait_slope": np.ones((3, 2, 1, 4)), "gait_errors": np.ones((1, 3, 2, 2, 4))}, {},
         "parts"),
        ({"gait": np.ones((1, 3)), "gait_A": np.ones((3, 1, 5)), "gait_slope": np.ones((3, 1, 0, 5)),
        "gait_errors": np.ones((1, 3, 1, 1, 5)),
          "gait_spread": np.ones((1, 1, 3))}, {}, "has a gait that does not move"),
        ({}, {"level": 0.0}, "parts"), ({}, {"level": 1.0}, "parts"), ({}, {"level": 0.01, "error_factor": 0.99e6}, ""),
        ({}, {"error_factor": 0.0}, "parts"), ({}, {"error_factor": 1e6}, "parts"), ({}, {"level": [0.9]}, "parts"),
        ({}, {"level": b"1"}, "parts"),
        ({}, {"error_factor": b"2"}, "parts"), ({}, {"error_factor": [2.0]}, "parts"), ({}, {"level": None}, "parts"),
    ],
)  # fmt: skip
def test_parts_of_a_gait_fit_each_other_or_are_refused(changes, facts, said):
    read = lambda: taylor_series(
        parts_of_a_gait(**changes), {**OF_A_GAIT, **facts}, 1.0
    )
    if not said:
        read()
        return
    with pytest.raises(Refusal) as found:
        read()
    assert str(found.value).startswith(
        said.replace(
            "parts", "has a gait whose parts do not fit each other: write it anew"
        )
    )


# Checks of what any file holds.


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([0.0, 1.0, 2.0, 31.4], ""),
        ([-31.42, 0.0, 1.0, 2.0], "has a up to 31.42 where angles are in rad: convert it if these are degrees"),
        ([0.0, 1.0, 2.0], "has no grid: a must be at least 4 ascending angles in rad"), ([0.0, 1.0, 1.0, 2.0], "has no grid"),
        ([[0.0, 1.0, 2.0, 3.0]] * 4, "has no grid"), ([0.0, 1.0, 2.0, 1e9 + 10], "has a above 1e+09 at index (3)"),
        ([3, 4, 5, 6], ""),
        (["a", "b", "c", "d"], "has a that is no array of real numbers"), ([1j, 2j, 3j, 4j], "has a that is no array"),
    ],
)  # fmt: skip
def test_axes_are_ascending_angles(values, said):
    with (
        pytest.raises(Refusal, match=f"^{re.escape(said)}")
        if said
        else contextlib.nullcontext()
    ):
        np.testing.assert_array_equal(base.checked_axis("a", np.array(values)), values)


def test_levels_and_bodies_that_make_no_sense_are_left_out():
    for level, found in (
        (0.5, 0.5),
        (np.float32(0.25), 0.25),
        (0, None),
        (1, None),
        (1.5, None),
        (-0.5, None),
        ([0.5], None),
        (b"1", None),
        (None, None),
    ):
        assert base.checked_level({} if level is None else {"level": level}) == found
    chain = {"lengths": [1, 2], "frame": "mean", "modes": [[1.0]], "waves": 1.0}
    for body, found in (
        (json.dumps(chain), chain), (json.dumps({"lengths": [1], "frame": "link-1"}), {"lengths": [1], "frame": "link-1"}),
        (json.dumps({"lengths": [1]}), None), (json.dumps({"frame": "mean"}), None), (json.dumps({**chain, "radius": 1}), None),
        ("[1, 2]", None), ("{", None), (None, None), ("[" * 100_000, None),
    ):  # fmt: skip
        assert base.checked_body(body) == found


@pytest.mark.parametrize(
    ("zero", "sign"), [(0.55, "+"), (0.49, ""), (0.31, ""), (0.29, "-")]
)
def test_the_sign_is_that_of_loops_of_three_and_five_tenths_of_the_grid(zero, sign):
    """Of a field by which a loop about the grid's middle moves by - r^2 (1 - r^2 / zero^2); none where their signs differ."""
    axes = np.linspace(-1, 3, 9), np.linspace(0, 2, 7)
    a, b = np.meshgrid(axes[0] - 1.0, axes[1] - 1.0, indexing="ij")
    g = 1 - (a**2 + b**2) / zero**2
    A = np.zeros((3, 2, 9, 7))
    A[0] = g * b, -g * a
    A[1, 0], A[1, 1] = 0.3, 0.5
    for turn in (1.0, -1.0):
        c = Connection(axes, turn * A, np.zeros((3, 9, 7)), np.ones((3, 9, 7)), 3)
        if sign:
            assert base.detected_sign(c) == (sign if turn > 0 else "+-"[sign == "+"])
        else:
            with pytest.raises(Refusal, match="does not tell the sign of A: say sign"):
                base.detected_sign(c)
    with pytest.raises(Refusal, match="does not tell the sign of A: say sign"):
        base.detected_sign(
            Connection(axes, 0 * A, np.zeros((3, 9, 7)), np.ones((3, 9, 7)), 3)
        )


# MATLAB files, byte by byte.


def element(kind, data, order="<", small=False):
    """An element of a file; a small one has up to four bytes in the place of its size."""
    if small:
        return struct.pack(f"{order}I", kind | len(data) << 16) + data.ljust(4, b"\0")
    return struct.pack(f"{order}II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(kind, shape, *parts, name=b"abc", flags=0, order="<", lead=None):
    """The bytes of a matrix of a class and a shape, without its own tag."""
    lead = lead or [
        element(6, struct.pack(f"{order}II", kind | flags, 0), order),
        element(5, struct.pack(f"{order}{len(shape)}i", *shape), order), element(1, name, order, small=len(name) < 5),
    ]  # fmt: skip
    return b"".join([*lead, *parts])


def number(value=1.5, order="<"):
    return element(
        14,
        matrix(
            6,
            (1, 1),
            element(9, struct.pack(f"{order}d", value), order),
            name=b"",
            order=order,
        ),
        order,
    )


@pytest.mark.parametrize("order", "<>")
def test_matrices_of_numbers_and_texts_are_read_in_either_order_of_bytes(order):
    read = lambda *args, **others: matlab._matrix(
        matrix(*args, **others, order=order), matlab.Source(order), 1
    )
    for kind, code, values in (
        (9, "d", range(6)),
        (7, "f", range(6)),
        (3, "h", range(-3, 3)),
        (2, "B", range(250, 256)),
        (13, "Q", range(6)),
    ):
        data = element(kind, struct.pack(f"{order}6{code}", *values), order)
        name, found = read(6, (2, 3), data)
        assert (
            name == "abc"
            and found.tolist() == np.reshape(values, (2, 3), order="F").tolist()
            and found.dtype.kind == ("f" if kind in (7, 9) else "iu"[code in "BQ"])
        )
    assert (
        read(
            6,
            (1, 2),
            element(4, struct.pack(f"{order}2H", 7, 300), order, small=True),
            name=b"longer name",
        )[0]
        == "longer name"
    )
    end = "le" if order == "<" else "be"
    for kind, raw in ((16, "\u00e4b".encode()), (17, "\u00e4b".encode(f"utf-16-{end}")),
    (4, "\u00e4b".encode(f"utf-16-{end}")), (2, b"\xe4b"),
                      (18, "\u00e4b".encode(f"utf-32-{end}"))):  # fmt: skip
        assert read(4, (1, 2), element(kind, raw, order)) == ("abc", "\u00e4b")
    assert read(6, (0, 3), element(9, b"", order))[1].shape == (0, 3)


ONE = element(9, struct.pack("<d", 1.0))


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (matrix(6, (1, 1), ONE, flags=0x0800), None), (matrix(6, (1,), ONE), None), (matrix(6, (1,) * 32, ONE), 32),
        (matrix(6, (1,) * 33, ONE), None), (matrix(6, (-1, 1), ONE), None), (matrix(6, (1, 1), ONE, ONE), None),
        (matrix(5, (1, 1), ONE), None),
        (matrix(16, (1, 1), ONE), None), (matrix(15, (1, 1), ONE), 2), (matrix(6, (1, 1), element(8, b"12345678")), None),
        (matrix(4, (1, 1), element(5, b"1234")), None), (matrix(6, (1, 2), ONE), "damaged"),
        (matrix(6, (1, 1), element(9, b"1234567")), "damaged"),
        (matrix(17, (1,), lead=[element(6, struct.pack("<II", 17, 0)), element(1, b"obj"), element(1, b"x")]), None),
        (matrix(6, (), lead=[element(6, struct.pack("<II", 6, 0)), element(5, b"12345678")]), "damaged"),
        (matrix(6, (), lead=[element(6, b"1234"), element(5, b"12345678"), element(1, b"a")]), "damaged"),
        (matrix(6, (), lead=[element(6, struct.pack("<II", 6, 0)), element(5, b"123456"), element(1, b"a")]), "damaged"),
    ],
)  # fmt: skip
def test_what_is_no_plain_array_is_skipped_and_what_does_not_fit_is_damaged(
    data, found
):
    if found == "damaged":
        with pytest.raises(Refusal, match="^damaged$"):
            matlab._matrix(data, matlab.Source("<"), 1)
        return
    name, values = matlab._matrix(data, matlab.Source("<"), 1)
    assert (values is None) if found is None else values.ndim == found
    assert name == ("obj" if data[8] == 17 else "abc")


def test_cells_and_structs_hold_others_to_a_depth():
    cell = matrix(1, (2, 1), number(1.5), element(14, b""))
    name, values = matlab._matrix(cell, matlab.Source("<"), 2)
    assert (
        name == "abc"
        and values.shape == (2, 1)
        and values[0, 0] == 1.5
        and values[1, 0].shape == (0, 0)
    )
    with pytest.raises(Refusal, match="^damaged$"):
        matlab._matrix(cell, matlab.Source("<"), 1)
    fields = element(5, struct.pack("<i", 4), small=True), element(1, b"ab\0\0c\0\0\0")
    found = matlab._matrix(
        matrix(2, (1, 1), *fields, number(2.5), number(3.5)), matlab.Source("<"), 2
    )[1]
    assert {key: float(x.item()) for key, x in found.items()} == {"ab": 2.5, "c": 3.5}
    assert (
        matlab._matrix(
            matrix(2, (1, 2), *fields, *[number()] * 4), matlab.Source("<"), 2
        )[1]
        is None
    )
    for bad in (
        matrix(1, (2, 2), number()), matrix(1, (1, 1), ONE), matrix(2, (1, 1), *fields, number()), matrix(2, (1, 1), fields[0]),
        matrix(2, (1, 1), element(5, struct.pack("<i", 0), small=True), fields[1], number()), matrix(2, (1,
         1), *fields, ONE, ONE),
        matrix(2, (1, 1), element(5, struct.pack("<i", -4), small=True), fields[1], number(), number()),
        matrix(2, (1, 1), element(5, struct.pack("<i", 3), small=True), fields[1], number(), number()),
        matrix(2, (1, 1), element(5, b"12", small=True), fields[1], number(), number()),
    ):  # fmt: skip
        with pytest.raises(Refusal, match="^damaged$"):
            matlab._matrix(bad, matlab.Source("<"), 2)


def test_handles_and_instances_are_skipped_and_never_run():
    """A function handle (class 16) and an instance of a class (17, which has no dimensions), in a struct and by themselves."""
    whole = lambda kind, name, *parts, shape=(1, 1): element(
        14, matrix(kind, shape, *parts, name=name)
    )
    double = whole(6, b"", ONE)
    handle = whole(
        16,
        b"f",
        whole(
            4, b"", element(4, "sf%0@()delete('*')".encode("utf-16-le")), shape=(1, 18)
        ),
    )
    lead = [
        element(6, struct.pack("<II", 17, 0)),
        element(1, b"space"),
        element(1, b"MCOS"),
        element(1, b"LieGroups"),
    ]
    instance = element(14, matrix(17, (), double, lead=lead))
    names = b"".join(name.ljust(8, b"\0") for name in (b"run", b"space", b"x"))
    fields = (
        element(5, struct.pack("<i", 8)),
        element(1, names),
        handle,
        instance,
        double,
    )
    head = bytes(124) + b"\x00\x01IM"
    found = {"f": None, "space": None, "s": {"run": None, "space": None, "x": 1.0}}
    assert matlab.arrays(head + handle + instance + whole(2, b"s", *fields)) == found
    deep = double
    for _ in range(40):
        deep = whole(1, b"c", deep)
    with pytest.raises(Refusal, match="damaged"):
        matlab.arrays(head + deep)


def test_elements_fill_a_file_and_are_not_longer(monkeypatch):
    both = (
        element(1, b"abcde") + element(2, b"xy", small=True) + element(3, b"12345678")
    )
    assert list(matlab.Source("<").elements(both)) == [
        (1, b"abcde"),
        (2, b"xy"),
        (3, b"12345678"),
    ]
    for bad in (
        both + b"1234567",
        both[:-1],
        struct.pack("<I", 1 | 5 << 16) + b"12345678",
        element(1, b"a")[:4],
    ):
        with pytest.raises(Refusal, match="^cut short$"):
            list(matlab.Source("<").elements(bad))
    head, whole = (
        b"MATLAB".ljust(124) + b"\x00\x01IM",
        element(14, matrix(6, (1, 1), ONE)),
    )
    packed = lambda data: struct.pack("<II", 15, len(x := zlib.compress(data))) + x
    assert (
        matlab.arrays(head + whole)["abc"]
        == 1.0
        == matlab.arrays(head + packed(whole) + packed(whole))["abc"]
    )
    assert matlab.arrays(head + element(14, b"") + element(9, b"12345678")) == {}
    with pytest.raises(Refusal, match="^no MATLAB file of version 5 to 7$"):
        matlab.arrays(b"MATLAB".ljust(124) + b"\x00\x02IM" + whole)
    with pytest.raises(Refusal, match="^damaged$"):
        matlab.arrays(head + element(15, b"no zip at all..."))
    cut = zlib.compress(whole)[:-6]
    with pytest.raises(Refusal, match="^cut short, or too large$"):
        matlab.arrays(head + struct.pack("<II", 15, len(cut)) + cut)
    monkeypatch.setattr(matlab, "LARGEST", 2 * len(whole) + 1)
    assert matlab.arrays(head + packed(whole) * 2)["abc"] == 1.0
    monkeypatch.setattr(matlab, "LARGEST", 2 * len(whole))
    with pytest.raises(Refusal, match="^cut short, or too large$"):
        matlab.arrays(head + packed(whole) * 2)


def mat_with(monkeypatch, about=None, sign="+", order="", left_out=(), **changes):
    """A table of 5 by 4 shapes from variables of a MATLAB file, as of ndgrid, with A_x1 = 1, A_x2 = 2 ... at the first."""
    axes = np.linspace(-1, 1, 5), np.array([-0.5, 0.0, 0.2, 0.9])
    shapes = np.meshgrid(*axes, indexing="ij")
    plain = np.arange(20.0).reshape(5, 4)
    found = {"alpha1": shapes[0], "alpha2": shapes[1]}
    found |= {
        name: k + 0.1 * plain
        for k, name in enumerate(("Ax1", "Ax2", "Ay1", "Ay2", "Atheta1", "Atheta2"), 1)
    }
    found |= {
        "M11": 2 + plain,
        "M12": 0.5 + 0 * plain,
        "M22": 1 + plain,
        mat.RESIDUAL: np.stack([plain, plain + 1, plain + 2]),
    }
    found |= {ERROR: 0.1 + np.zeros((3, 2, 5, 4)), **changes}
    if about is not None:
        found[mat.ABOUT] = json.dumps(about)
    monkeypatch.setattr(
        mat,
        "variables",
        lambda raw, names: {k: x for k, x in found.items() if k not in left_out},
    )
    return mat.parse(b"", sign, order, "0f")


def test_parts_of_a_mat_file_are_where_they_belong(monkeypatch):
    about = {
        "unit": "m",
        "length": 0.3,
        "interpolation": 2,
        "frame": "mean",
        "level": 0.9,
        "power_degree": 1.5,
        "sign": "-",
        "shapes": ["a", "b"],
    }
    plain = np.arange(20.0).reshape(5, 4)
    for sign, turn in (("", -1), ("-", -1), ("+", 1)):
        held = mat_with(monkeypatch, about, sign)
        c = held.connection
        np.testing.assert_allclose(
            turn * c.A, np.arange(1, 7).reshape(3, 2, 1, 1) + 0.1 * plain, rtol=1e-12
        )
        assert held.sign == ("+" if turn > 0 else "-")
    np.testing.assert_array_equal(c.residual, [plain, plain + 1, plain + 2])
    np.testing.assert_allclose(
        c.speed, np.sqrt((c.A**2).mean(1) + c.residual**2), rtol=1e-12
    )
    np.testing.assert_array_equal(
        held.metric.M, [[2 + plain, 0.5 + 0 * plain], [0.5 + 0 * plain, 1 + plain]]
    )
    assert (c.degree, held.metric.degree, c.unit, c.length, held.length, held.unit) == (
        2,
        2,
        "m",
        0.3,
        0.3,
        "m",
    )
    assert (held.frame, held.level, held.power_degree, held.sized, held.shapes) == (
        "mean",
        0.9,
        1.5,
        True,
        ("a", "b"),
    )
    assert (held.order, held.assumptions, held.sha256, held.body) == (
        "ndgrid",
        (),
        "0f",
        None,
    )
    assert (held.A_error == 0.1).all() and held.A_error.shape == (3, 2, 5, 4)
    bare = mat_with(monkeypatch, left_out=("M12", mat.RESIDUAL, ERROR))
    assert (bare.unit, bare.length, bare.sized, bare.frame, bare.level) == (
        "BL",
        1.0,
        False,
        "that of the table",
        None,
    )
    assert (
        bare.metric is bare.A_error is bare.power_degree is None
        and np.isnan(bare.connection.residual).all()
    )
    assert bare.connection.degree == 3 and bare.shapes == ("alpha_1", "alpha_2")
    np.testing.assert_allclose(
        bare.connection.speed, np.sqrt((bare.connection.A**2).mean(1)), rtol=1e-12
    )


@pytest.mark.parametrize(
    ("about", "sized", "degree", "power"),
    [
        ({"unit": "m", "length": 0.99e9, "interpolation": 1, "power_degree": 99.0}, True, 1, 99.0),
        ({"unit": "m", "length": 1e9, "interpolation": 4, "power_degree": 100.0}, False, 3, None),
        ({"unit": "BL", "length": 1.0, "interpolation": 0, "power_degree": 0.0}, True, 3, None),
        ({"unit": "m", "length": 0.0, "interpolation": 3, "power_degree": 2}, False, 3, None),
        ({"unit": "m", "length": 2, "frame": 3, "level": "most"}, False, 3, None), ([1, 2], False, 3, None),
        ({"unit": "mm", "length": 2.0}, False, 3, None), ({"power_degree": 0.1}, False, 3, 0.1),
    ],
)  # fmt: skip
def test_what_a_mat_file_says_of_itself_is_taken_where_it_makes_sense(
    about, sized, degree, power, monkeypatch
):
    held = mat_with(monkeypatch, about)
    size = (about["unit"], about["length"]) if sized else ("BL", 1.0)
    assert (
        held.sized,
        held.unit,
        held.length,
        held.connection.degree,
        held.power_degree,
    ) == (
        sized,
        *size,
        degree,
        power,
    )
    assert held.frame == "that of the table" and held.level is None


GRID = np.zeros((5, 4))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"order": "meshgrid"}, "has arrays that run as ndgrid's: drop order"), ({"order": "ndgrid"}, ""),
        ({"alpha1": np.linspace(0, 1, 5)[:, None], "alpha2": np.linspace(0, 1, 4)[None]},
         "has alpha1 and alpha2 as rows, which leave the"),
        ({"alpha1": np.linspace(0, 1, 5)[:, None], "alpha2": np.linspace(0, 1, 4)[None], "order": "ndgrid"}, ""),
        ({"alpha1": np.linspace(0, 1, 5)[:, None], "alpha2": np.linspace(0, 1, 4)[None], "order": "meshgrid"},
         "has Ax1 of shape (5, 4) where"),
        ({"alpha1": GRID[:, :3]}, "has alpha1 (5, 3) and alpha2 (5, 4), which span no grid"),
        ({"M11": 0.25 / (1 + np.arange(20.0).reshape(5, 4))}, "has M11, M12 and M22 that are no metric at"),
        ({"M11": 0.26 / (1 + np.arange(20.0).reshape(5, 4))}, ""),
        ({"M11": -1 - GRID, "M22": -1 - GRID}, "has M11, M12 and M22 that are"),
        ({"M22": GRID}, "has M11, M12 and M22 that are no metric at"),
        ({"M12": GRID[:4]}, "has M12 of shape (4, 4) where alpha1 and alpha2"),
        ({"left_out": ("M11",), "M12": GRID[:4]}, ""),
        ({"left_out": ("Ay1",)}, "has no Ay1: a connection is alpha1, alpha2, Ax1"),
        (dict.fromkeys(("Ax1", "Ax2", "Ay1", "Ay2", "Atheta1", "Atheta2"), GRID), "has a connection that is zero everywhere"),
        ({ERROR: np.zeros((3, 2, 4, 5))}, "has geomech_A_error of shape (3, 2, 4, 5) where A has (3, 2, 5, 4)"),
        ({ERROR: "none"}, ""),
        ({mat.RESIDUAL: np.zeros((3, 4, 5))}, ""),
        ({mat.RESIDUAL: np.full((3, 5, 4), np.inf)}, "has geomech_fit_residual that is not finite"),
        ({"alpha1": 3.1 * np.linspace(-2, 2, 5)[:, None] + GRID}, ""),
        ({"alpha1": 3.2 * np.linspace(-2, 2, 5)[:, None] + GRID}, "has alpha1 up to"),
        ({"alpha1": 3.2 * np.linspace(-2, 2, 5)[:, None] + GRID, "about": {}}, ""),
        ({"alpha1": np.linspace(-1, 1, 5)[:, None] + GRID + 2e-9 * np.arange(4)},
         "has alpha1 and alpha2 that span no grid: one must"),
        ({"alpha1": np.linspace(-1, 1, 5)[:, None] + GRID + 2e-10 * np.arange(4)}, ""),
    ],
)  # fmt: skip
def test_parts_of_a_mat_file_fit_each_other_or_are_refused(changes, said, monkeypatch):
    if not said:
        mat_with(monkeypatch, **changes)
        return
    with pytest.raises(Refusal) as found:
        mat_with(monkeypatch, **changes)
    assert str(found.value).startswith(said)
