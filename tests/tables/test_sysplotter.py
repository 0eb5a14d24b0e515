"""The struct s of sysplotter: read as it saves it, and written for its scripts."""

import contextlib
import functools
import operator
import sys

import numpy as np
import pytest
from refusals import refuses
from scipy.io import loadmat
from structs import cell, computed, save, struct

import rft
from geomech.io import tables
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry import connection
from geomech.mathematics.systems import IdealFluidSwimmer, Swimmer, Table
from geomech.scenes import Scene
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

FLUID = rft.Viscous(2.0)
SWIMMER = Swimmer(FLUID, rft.Chain((1, 1, 1), frame="link-2"))


def write(path, version=5, **changes):
    if version != 5:
        pytest.importorskip("h5py")
    save(path, struct(**changes), version, tspan=[0.0, 1.0])
    return path


def study(system):
    return SceneTables(Scene(system, Circle()))


def h5py():
    return pytest.importorskip("h5py")


@pytest.mark.parametrize("version", [5, 7.3])
def test_a_struct_of_every_version_is_read(version, tmp_path):
    table = Table(write(tmp_path / "s.mat", version))
    np.testing.assert_array_equal(table.stored.connection.A, computed()[0].A)
    np.testing.assert_array_equal(table.stored.computed.beta, computed()[3])
    assert (table.chain, table.assumed) == (SWIMMER.body, ())
    with pytest.raises(
        Refusal, match="states the length of the body itself, 1 BL: leave body"
    ):
        Table(table.file, body_length=0.3)
    with pytest.raises(Refusal, match="describes its body itself: leave the body"):
        Table(table.file, body=rft.Chain())
    with pytest.raises(Refusal, match="defines sign and order itself: leave sign and"):
        Table(table.file, sign="-")


def test_a_table_predicts_what_its_swimmer_does(tmp_path):
    """On 15 points over +-3 rad; CCF and area integral in minimum-perturbation
    coordinates are near the published -0.0204 and 0.0510."""
    source = study(SWIMMER).with_numerics(grid=61, extent=3.0, phases=64)
    table = study(Table(write(tmp_path / "s.mat"))).with_numerics(phases=64)
    amplitudes = [0.5, 1.0, 1.3]
    lengths = [x.effort(None, amplitudes)["path_length"] for x in (table, source)]
    np.testing.assert_allclose(*lengths, rtol=2e-3)
    poses = [x.poses("direct", None, amplitudes) for x in (table, source)]
    np.testing.assert_allclose(*poses, atol=2e-4)
    best = table.in_frame("minimum-perturbation")
    assert best.curvature.values[0, 7, 7] == pytest.approx(-0.0206, abs=2e-4)
    assert best.poses("area", None, [1.0])[0, 0] == pytest.approx(-0.0518, abs=3e-4)


def test_a_struct_of_three_joints_is_read(tmp_path):
    """Without a length the links are lengths in the file's unit."""
    four = Swimmer(FLUID, rft.Chain((1, 1, 1, 1), frame="link-2"))
    axes = connection.grid(3, 5, 1.0)
    fitted = connection.fit(four.velocity, axes, 12, traits=four.traits)
    grid = cell(np.array(np.meshgrid(*axes, indexing="ij")), (3,))
    s = {
        "geometry": {"linklengths": [1.0, 1, 1, 1], "baseframe": 2.0},
        "grid": {"eval": grid},
        "vecfield": {"eval": {"content": {"Avec": cell(fitted.A, (3, 3))}}},
    }
    save(tmp_path / "s.mat", s)
    table = Table(tmp_path / "s.mat")
    assert (table.joints, table.traits.frame, table.chain) == (3, "link-2", four.body)
    scaled = table.stored.connection.A * np.reshape([4, 4, 1], (3, 1, 1, 1, 1))
    np.testing.assert_allclose(scaled, fitted.A, rtol=1e-13)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda A: A, None),
        (lambda A: -A, "with the opposite sign"),
        (lambda A: A[:, ::-1].swapaxes(-1, -2), "with alpha1 and alpha2 swapped"),
        (lambda A: A[..., ::-1, ::-1], "with both axes reversed"),
        (
            lambda A: -A[..., ::-1, ::-1],
            "with angles, or y and heading, positive clockwise",
        ),
    ],
)
def test_a_connection_that_its_body_would_have_with_other_axes_is_noted(
    change, said, tmp_path
):
    A = change(computed()[0].A)
    content = {"A_num": cell(-A, (3, 2)), "Avec": cell(A, (3, 2))}
    table = Table(write(tmp_path / "s.mat", vecfield={"eval": {"content": content}}))
    np.testing.assert_array_equal(table.stored.connection.A, A)
    noted = (
        f"its A resembles that of a body of links {said} (correlation 1.00; as read "
    )
    assert [x.startswith(noted) for x in table.assumed] == [True] * bool(said)


# The struct part by part, on an uneven grid.

AXES = np.array([-1.0, -0.2, 0.1, 0.5, 1.0]), np.array([-0.6, 0.0, 0.3, 0.9])
OWN = np.linspace(-1.2, 1.0, 7), np.linspace(-0.7, 0.95, 6)
LINKS = {"linklengths": [0.1, 0.15, 0.25], "baseframe": "head", "length": 0.5}


def cubics(lead, seed, axes=AXES):
    """Return cubics of two angles (*lead, N, M), which splines of degree 3 keep."""
    a, b = np.meshgrid(*axes, indexing="ij")
    powers = np.array([a**0, a, b**2, a * b, a**3, a * b**2])
    coefficients = np.random.default_rng(seed).normal(size=(*lead, 6))
    return np.tensordot(coefficients, powers, 1)


def metric(axes):
    first, mixed, last = cubics((3,), 90, axes)
    return np.array([[first, mixed], [mixed, last]])


def uneven(path, *changes):
    """Write a struct in which every array is another."""
    content = {
        "Avec": cell(cubics((3, 2), 0), (3, 2)),
        "Avec_optimized": cell(cubics((3, 2), 10), (3, 2)),
    }
    M = {"content": {"metric": cell(metric(OWN), (2, 2))}}
    s = {
        "geometry": dict(LINKS),
        "physics": {"drag_coefficient": 2.0},
        "grid": {
            "eval": cell(np.array(np.meshgrid(*AXES, indexing="ij")), (2,)),
            "metric_eval": cell(np.array(np.meshgrid(*OWN, indexing="ij")), (2,)),
        },
        "vecfield": {"eval": {"content": content}},
        "metricfield": {"metric_eval": M},
        "DA": cell(cubics((3, 1), 20), (3, 1)),
        "DA_optimized": cell(cubics((3, 1), 30), (3, 1)),
        "B_optimized": {"eval": {"Beta": cell(cubics((3,), 40), (3,))}},
        "geomech_fit_residual": cell(cubics((3,), 50), (3,)),
        "system_type": "drag",
    }
    for (*outer, last), value in changes:
        node = functools.reduce(operator.getitem, outer, s)
        node[last] = value(node[last]) if callable(value) else value
        if value is None:
            del node[last]
    save(path, s)
    return path


def test_every_array_of_a_struct_is_where_it_belongs(tmp_path):
    """In body lengths, of a body 0.5 long; the metric is carried over to the grid of
    A."""
    held = tables.load(uneven(tmp_path / "s.mat"))
    c = held.connection
    scale = np.array([2.0, 2.0, 1.0]).reshape(3, 1, 1, 1)
    for found, expected in (
        (c.A, cubics((3, 2), 0)),
        (held.computed.A_optimised, cubics((3, 2), 10)),
        (held.computed.ccf, cubics((3, 1), 20)),
        (held.computed.ccf_optimised, cubics((3, 1), 30)),
        (held.computed.beta[:, None], cubics((3, 1), 40)),
        (c.residual[:, None], cubics((3, 1), 50)),
    ):
        np.testing.assert_allclose(found, scale * expected, rtol=1e-13)
    speed = np.sqrt((c.A**2).mean(1) + c.residual**2)
    np.testing.assert_allclose(c.speed, speed, rtol=1e-13)
    power = 2.0 * 0.5**3
    np.testing.assert_allclose(held.metric.M * power, metric(AXES), atol=1e-12)
    np.testing.assert_allclose(held.computed.metric * power, metric(OWN), rtol=1e-13)
    for found, expected in zip((*c.axes, *held.computed.metric_axes), (*AXES, *OWN)):
        np.testing.assert_array_equal(found, expected)
    assert (c.degree, held.metric.degree, held.power_degree) == (3, 3, 2.0)
    assert c.size == {"unit": "BL", "length": 1.0}
    assert (held.sized, held.frame, held.shapes) == (
        True,
        "link-3",
        ("alpha_1", "alpha_2"),
    )


@pytest.mark.parametrize(
    ("geometry", "body", "frame", "length"),
    [
        ({"baseframe": "center"}, None, "center of sysplotter", 1.0),
        ({"length": 0.3}, None, "center of sysplotter", 0.3),
        ({"baseframe": 2.0}, None, "that of the table", 1.0),
        ({"baseframe": "minimum-perturbation"}, None, "minimum-perturbation", 1.0),
        ({"linklengths": [1.0, 2.0]}, None, "center of sysplotter", 3.0),
        ({**LINKS, "baseframe": 4.0}, None, "that of the table", 0.5),
        ({**LINKS, "baseframe": 0.0}, None, "that of the table", 0.5),
        (
            {**LINKS, "baseframe": np.array([[2.0, 0.5]])},
            None,
            "that of the table",
            0.5,
        ),
        ({**LINKS, "baseframe": np.nan}, None, "that of the table", 0.5),
        ({"linklengths": [1.0, 2.0, 4.0]}, {}, "link-2", 7.0),
        ({**LINKS, "baseframe": "centered"}, {}, "link-2", 0.5),
        ({**LINKS, "length": 0.99e9}, {}, "link-3", 0.99e9),
        ({**LINKS, "length": 1e9}, {}, "link-3", 0.5),
        ({**LINKS, "length": -1.0}, {}, "link-3", 0.5),
        ({**LINKS, "length": [1.0, 2.0]}, {}, "link-3", 0.5),
        ({**LINKS, "baseframe": "com-mean"}, {}, "mean", 0.5),
        ({**LINKS, "baseframe": "tail"}, {}, "link-1", 0.5),
        ({**LINKS, "baseframe": 1.0}, {}, "link-1", 0.5),
        ({**LINKS, "baseframe": np.array([[3.0]])}, {}, "link-3", 0.5),
        ({**LINKS, "modes": np.zeros((0, 0))}, {}, "link-3", 0.5),
        ({**LINKS, "modes": [[1.0], [2.0]]}, {"modes": [[1.0, 2.0]]}, "link-3", 0.5),
    ],
)
def test_the_body_of_a_struct_is_a_chain_where_its_frame_is_known(
    geometry, body, frame, length, tmp_path
):
    held = tables.load(uneven(tmp_path / "s.mat", (("geometry",), geometry)))
    if body is not None:
        body = {"lengths": geometry["linklengths"], "frame": frame, **body}
    assert (held.body, held.frame) == (body, frame)
    found = held.connection.A[0] * length
    np.testing.assert_allclose(found, cubics((3, 2), 0)[0], rtol=1e-12)


CONTENT = ("vecfield", "eval", "content")
METRIC = ("metricfield", "metric_eval", "content", "metric")
NEGATIVE = -cubics((3, 2), 0)


def spoilt(value):
    """A change of the number (3, 4) of an array."""

    def change(values):
        values = values.copy()
        values[2, 3] = value
        return values

    return change


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (
            ("vecfield",),
            None,
            "s.vecfield.eval.content.Avec sys_calc | instead",
        ),
        (("grid", "eval"), None, "s.grid.eval | instead"),
        (
            ("grid", "eval"),
            np.ones((5, 4)),
            "s.grid.eval cell | instead",
        ),
        (("grid", "eval"), lambda x: x[:1], "s.grid.eval cell | instead"),
        (
            ("grid", "eval"),
            lambda x: -x,
            "grid s.grid.eval{1} 4 ascending | instead",
        ),
        (
            ("grid", "eval"),
            lambda x: 57.3 * x,
            "s.grid.eval{1} up 57.3 rad | instead",
        ),
        (
            ("grid", "eval"),
            lambda x: cell(np.array([y.T for y in x.ravel()]), (2,)),
            "s.grid.eval{1} dimensions 1 | because instead",
        ),
        (
            ("grid", "eval", (0, 0)),
            lambda x: x + 2e-9 * np.eye(5, 4),
            "s.grid.eval{1} dimensions 1 | because instead",
        ),
        (
            ("grid", "eval", (0, 0)),
            spoilt(np.nan),
            "s.grid.eval{1} finite 3 4 file | instead",
        ),
        (
            ("grid", "eval", (1, 0)),
            np.ones((4, 5)),
            "s.grid.eval different shapes 5 4 | instead",
        ),
        (
            (*CONTENT, "Avec"),
            lambda x: x[:2],
            "s.vecfield.eval.content.Avec cell 3 x 2 | instead",
        ),
        (
            (*CONTENT, "Avec", (2, 1)),
            np.ones((4, 5)),
            "s.vecfield.eval.content.Avec{3 2} shape 4 5 grid | instead",
        ),
        (
            (*CONTENT, "Avec", (1, 0)),
            spoilt(np.nan),
            "s.vecfield.eval.content.Avec{2 1} finite | instead",
        ),
        (
            (*CONTENT, "A_num"),
            cell(-NEGATIVE, (3, 2)),
            "damaged s.vecfield.eval.content.Avec{1 1} negative A_n | instead",
        ),
        (
            (*CONTENT, "A_num"),
            cell(NEGATIVE * (1 + 1e-8), (3, 2)),
            "damaged s.vecf | instead",
        ),
        (
            ("DA",),
            lambda x: x[:2],
            "s.DA cell 3 x 1 | instead",
        ),
        (
            (*METRIC, (0, 1)),
            lambda x: x + 1e-7,
            "s.metricfield.metric_eval.content.metric symmetric {1 2 | instead",
        ),
        (
            ("grid", "metric_eval", (0, 0)),
            lambda x: x + 0.2 + 4e-9,
            "s.grid.metric_eval cover s.grid.eval | instead",
        ),
        (
            ("grid", "metric_eval", (1, 0)),
            lambda x: x - 0.05 - 4e-9,
            "s.grid.metric_eval cover | instead",
        ),
    ],
)
def test_a_bad_struct_is_refused_by_place_and_cure(place, value, said, tmp_path):
    path = uneven(tmp_path / "s.mat", (place, value))
    with refuses(said, str(path)):
        tables.load(path)


@pytest.mark.parametrize(
    "changes",
    [
        [(("grid", "eval", (0, 0)), lambda x: x + 0.5e-9 * np.eye(5, 4))],
        [((*CONTENT, "A_num"), cell(NEGATIVE * (1 + 1e-10), (3, 2)))],
        [
            ((*CONTENT, "A_num"), cell(2 * NEGATIVE, (3, 2))),
            ((*CONTENT, "A_den"), cell(2 + 0 * NEGATIVE, (3, 2))),
        ],
        [((*METRIC, (0, 1)), lambda x: x + 1e-10)],
        [(("grid", "metric_eval", (0, 0)), lambda x: x + 0.2 + 1e-9)],
        [(("grid", "metric_eval", (1, 0)), lambda x: x - 0.05 - 1e-9)],
    ],
)
def test_parts_of_a_struct_within_rounding_are_read(changes, tmp_path):
    held = tables.load(uneven(tmp_path / "s.mat", *changes))
    np.testing.assert_array_equal(held.connection.A[2], -NEGATIVE[2])


# Version 7.3, which is HDF5.


def test_version_7_3_without_h5py_is_refused_with_two_cures(tmp_path, monkeypatch):
    header = b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n" + bytes(600)
    (tmp_path / "s.mat").write_bytes(header)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(Refusal, match=r"is a MATLAB 7.3 .*'geomech\[hdf5\]', or save"):
        tables.load(tmp_path / "s.mat")


def test_damaged_files_of_version_7_3_are_refused_or_read_as_finite(tmp_path):
    """Cut short 10 times, and 50 times with 12 bits changed."""
    path = write(tmp_path / "s.mat", 7.3)
    raw = path.read_bytes()
    rng = np.random.default_rng(0)
    for k in range(60):
        bad = bytearray(raw[: rng.integers(600, len(raw))] if k < 10 else raw)
        for place in rng.integers(512, len(bad), 0 if k < 10 else 12):
            bad[place] ^= 1 << rng.integers(8)
        path.write_bytes(bad)
        with contextlib.suppress(Refusal):
            assert np.isfinite(tables.load(path).connection.A).all()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (
            lambda s: s.__setitem__("again", s),
            "damaged s.again.again | because instead",
        ),
        (
            lambda s: s.__setitem__("far", h5py().SoftLink("/s/x")),
            "s.far another",
        ),
    ],
)
def test_links_in_files_of_version_7_3_are_refused(spoil, said, tmp_path):
    path = write(tmp_path / "s.mat", 7.3)
    with h5py().File(path, "a") as file:
        spoil(file["s"])
    with refuses(said):
        tables.load(path)


# Structs that we write.


@pytest.mark.parametrize("frame", ["mean", "link-3", "minimum-perturbation"])
def test_an_exported_struct_is_read_as_it_was(frame, tmp_path):
    """In body lengths, of a body 0.3 m long."""
    swimmer = Swimmer(FLUID, rft.Chain((0.7, 1.4, 0.9), 0.3))
    source = study(swimmer).with_numerics(grid=21, extent=1.5)
    source = source if frame == "mean" else source.in_frame(frame)
    fields.save_connection(tmp_path / "s.mat", source, layout="struct")
    held = tables.load(tmp_path / "s.mat")
    assert (held.frame, held.power_degree) == (frame, 2)
    scale = np.array([0.3, 0.3, 1.0]).reshape(3, 1, 1, 1)
    for found, expected in (
        (held.connection.A, source.fitted.A),
        (held.connection.residual[:, None], source.fitted.residual[:, None]),
        (held.computed.ccf, source.curvature.values[:, None]),
    ):
        np.testing.assert_allclose(scale * found, expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(held.metric.M, source.metric.M, rtol=1e-12)


def test_an_exported_struct_has_what_its_scripts_read(tmp_path):
    source = study(SWIMMER).with_numerics(grid=21, extent=1.5)
    fields.save_connection(tmp_path / "s.mat", source, layout="struct")
    s = loadmat(tmp_path / "s.mat", simplify_cells=True)["s"]
    assert {"vector", "scalar", "eval", "metric_eval", "metric_display"} <= {*s["grid"]}
    assert (s["singularity"], s["system_type"]) == (0, "drag")
    for place in ("eval", "display", "finite_element"):
        content = s["vecfield"][place]["content"]
        for A, numerator in zip(content["Avec"].ravel(), content["A_num"].ravel()):
            np.testing.assert_array_equal(A, -numerator)
    for ending in ("", "_optimized"):
        DA, dA, lb = (np.stack(s[f"{name}{ending}"]) for name in ("DA", "dA", "lb"))
        np.testing.assert_allclose(DA, dA - lb, atol=1e-15)


def test_an_exported_metric_of_inertia_is_no_power(tmp_path):
    source = study(IdealFluidSwimmer()).with_numerics(grid=9, extent=1.0)
    fields.save_connection(tmp_path / "s.mat", source, layout="struct")
    held = tables.load(tmp_path / "s.mat")
    assert held.power_degree is None
    np.testing.assert_allclose(held.metric.M, source.metric.M)
