"""sysplotter's struct s: read as it saves it, and what it computed agrees with ours of the same swimmer."""

import numpy as np
import pytest
from scipy.io import loadmat
from structs import cell, computed, save, struct

import rft
from geomech.io import tables
from geomech.io.tables import sysplotter
from geomech.io.tables.base import Stored
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.minimum_perturbation import minimum_perturbation
from geomech.mathematics.systems import (
    DifferentialDrive,
    IdealFluidSwimmer,
    NoSlipSnake,
    Swimmer,
    Table,
)
from geomech.mathematics.systems.capabilities import table_error
from geomech.mathematics.systems.table import LENGTHS
from geomech.scenes import Scene
from geomech.shell.describe.system import system_lines
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.bodies.base import body_size
from rft.core.refusal import Refusal

SWIMMER = Swimmer(rft.Viscous(2.0), rft.Chain((1, 1, 1), frame="link-2"))
VERSIONS = [5, 7.3]


def write(path, version=5, **changes):
    if version != 5:
        pytest.importorskip("h5py")
    save(path, struct(**changes), version, tspan=[0.0, 1.0])
    return path


def study(path, **settings):
    return SceneTables(Scene(Table(path, **settings), Circle()))


@pytest.mark.parametrize("version", VERSIONS)
def test_a_struct_is_read_whole(version, tmp_path):
    fitted, own, A, pose = computed()
    stored = tables.load(write(tmp_path / "s.mat", version))
    np.testing.assert_array_equal(stored.connection.A, fitted.A)
    np.testing.assert_array_equal(stored.connection.axes, fitted.axes)
    assert (stored.frame, stored.unit, stored.length) == ("link-2", "BL", 1.0)
    assert Table(tmp_path / "s.mat").chain == SWIMMER.body
    assert stored.connection.size == {"unit": "BL", "length": 1.0}
    assert stored.assumptions == () and stored.sized and stored.power_degree == 2
    np.testing.assert_array_equal(stored.computed.A_optimised, A)
    np.testing.assert_array_equal(stored.computed.beta, pose)
    np.testing.assert_array_equal(stored.computed.metric, own.M)
    np.testing.assert_allclose(
        stored.metric.field(np.zeros(2)),
        [[0.0073160, 0.0050297], [0.0050297, 0.0073160]],
        atol=6e-8,
    )


@pytest.mark.parametrize(("length", "drag"), [(0.3, 1.0), (3.0, 2.5)])
def test_lengths_and_drag_are_those_of_its_geometry_and_physics(length, drag, tmp_path):
    """In body lengths and drags of the body along itself, whatever its unit."""
    one = study(write(tmp_path / "a.mat"))
    other = study(write(tmp_path / "b.mat", length=length, drag=drag))
    np.testing.assert_allclose(other.fitted.A, one.fitted.A, rtol=1e-13)
    np.testing.assert_allclose(other.metric.M, one.metric.M, rtol=1e-13)
    computed, true = (
        other.scene.system.stored.computed,
        one.scene.system.stored.computed,
    )
    np.testing.assert_allclose(computed.ccf, true.ccf, rtol=1e-13)
    with pytest.raises(
        Refusal, match="says the body's length itself, 1 BL: drop body_length"
    ):
        Table(tmp_path / "b.mat", body_length=length)


@pytest.mark.parametrize(
    ("base", "frame"),
    [
        ("centered", "link-2"),
        ("tail", "link-1"),
        ("head", "link-3"),
        ("com-mean", "mean"),
        (np.array([[1.0]]), "link-1"),
        (np.array([[3.0]]), "link-3"),
    ],
)
def test_base_frames_have_our_names(base, frame, tmp_path):
    table = Table(write(tmp_path / "s.mat", base=base, frame=frame))
    assert table.traits.frame == table.chain.frame == frame
    np.testing.assert_allclose(
        table.in_frame("link-2").stored.connection.A, computed()[0].A, atol=1e-12
    )


def test_a_base_frame_without_our_name_keeps_its_own(tmp_path):
    table = Table(write(tmp_path / "s.mat", base="tail-tip"))
    assert table.traits.frame == "tail-tip of sysplotter"
    for base in (
        [[2.0, 0.5]],
        [[np.nan]],
        [[4.0]],
    ):  # as a damaged one, or a matrix, reads
        start = Table(write(tmp_path / "t.mat", base=np.array(base)))
        assert start.traits.frame == "that of the table" and start.chain is None
    with pytest.raises(
        Refusal,
        match=r"no frame 'mean' of a table whose frame is 'tail-tip of sysplotter'",
    ):
        table.in_frame("mean")
    assert study(tmp_path / "s.mat", frame="minimum-perturbation").fitted.A.any()


def test_what_it_computed_agrees_with_ours_but_for_its_elements(tmp_path):
    """On 15 points over +-3 rad differences of neighbours cost its CCF 3.8 % in the middle, linear elements its frame 1 to 2 %
    of the largest pose. A genuine file, on 31 points over +-pi, loses 0.9 and 0.5 %."""
    source = SceneTables(Scene(SWIMMER, Circle())).with_numerics(
        grid=61, extent=3.0, phases=64
    )
    table = study(write(tmp_path / "s.mat")).with_numerics(phases=64)
    stored, amplitudes = table.scene.system.stored, [0.5, 1.0, 1.3]
    middle = (slice(None), 7, 7)
    assert (
        abs(
            stored.computed.ccf[:, 0][middle][0] / source.curvature.values[:, 30, 30][0]
            - 1
        )
        < 0.04
    )
    ours = ccf(stored.connection).values
    inner = (slice(None), slice(3, 12), slice(3, 12))
    off = np.abs(ours - stored.computed.ccf[:, 0])[inner].max((1, 2)) / np.abs(
        ours
    ).max((1, 2))
    assert (off < [0.12, 0.08, 0.07]).all()
    pose = minimum_perturbation(stored.connection).field.values
    assert (
        np.abs(pose - stored.computed.beta).max((1, 2))
        < 0.02 * np.abs(pose).max((1, 2))
    ).all()
    lengths = [x.effort(None, amplitudes)["path_length"] for x in (table, source)]
    np.testing.assert_allclose(lengths[0], lengths[1], rtol=2e-3)
    for tier in ("path", "direct"):
        np.testing.assert_allclose(
            table.poses(tier, None, amplitudes),
            source.poses(tier, None, amplitudes),
            atol=2e-4,
        )
    best = table.in_frame("minimum-perturbation")
    assert (
        abs(best.curvature.values[0, 7, 7] + 0.0206) < 2e-4
        and abs(best.poses("area", None, [1.0])[0, 0] + 0.0518) < 3e-4
    )


def changed(path, value):
    """The struct with a field, a cell's entry or a number of it replaced; None drops it."""
    s, *names = struct(), *path
    node = s
    for name in names[:-1]:
        node = node[name]
    if value is None:
        del node[names[-1]]
    else:
        node[names[-1]] = value(node[names[-1]]) if callable(value) else value
    return s


def spoiled(index, number):
    """A function that puts a number into an array of a cell."""

    def put(cell):
        cell = cell.copy()
        cell[index] = cell[index].copy()
        cell[index][2, 5] = number
        return cell

    return put


CONTENT = ("vecfield", "eval", "content")
AVEC, METRIC = (
    "s.vecfield.eval.content.Avec",
    ("metricfield", "metric_eval", "content", "metric"),
)
BAD = {
    "not computed": (("vecfield",), None, f"has no {AVEC}: save it by sys_calcsystem, .* _calc.mat$"),
    "no grid": (("grid", "eval"), None, "has no s.grid.eval: save it by"),
    "nan": ((*CONTENT, "Avec"), spoiled((1, 0), np.nan), rf"has {AVEC}\{{2, 1\}} that is not finite .* \(3, 6\)"),
    "nan in the grid": (("grid", "eval"), spoiled((0, 0), np.nan), r"has s.grid.eval\{1\} that is not finite .* \(3, 6\)"),
    "a bit": (
        (*CONTENT, "A_num"), spoiled((0, 1), 0.25),
        rf"is damaged: {AVEC}\{{1, 2\}} is not the negative of A_num at \(3, 6\)",
    ),
    "meshgrid": (
        ("grid", "eval"), lambda x: cell(np.array([y.T for y in x.ravel()]), (2,)),
        r"s.grid.eval\{1\} that does not change along dimension 1 alone: as ndgrid's does; permute",
    ),
    "mirrored": (("grid", "eval"), lambda x: -x, r"s.grid.eval\{1\} must be at least 4 ascending angles"),
    "degrees": (("grid", "eval"), lambda x: 57.3 * x, r"s.grid.eval\{1\} up to 171.9 where angles are in rad"),
    "rows": ((*CONTENT, "Avec"), lambda x: x[:2], f"has {AVEC} that is no cell of 3 x 2 arrays"),
    "shape": (
        ("DA",), lambda x: cell(np.zeros((3, 1, 4, 4)), (3, 1)),
        r"has s.DA\{1, 1\} of shape \(4, 4\) where its grid makes it \(15, 15\)",
    ),
    "symmetric": (METRIC, spoiled((0, 1), 1.0), r"metric that is not symmetric: \{1, 2\} at \(3, 6\)"),
    "metric too low": (("grid", "metric_eval"), lambda x: x - 0.5, "s.grid.metric_eval that does not cover s.grid.eval"),
    "metric too high": (("grid", "metric_eval"), lambda x: x + 0.5, "s.grid.metric_eval that does not cover s.grid.eval"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_struct_is_refused_by_place_and_cure(name, tmp_path):
    path, value, said = BAD[name]
    save(tmp_path / "s.mat", changed(path, value))
    with pytest.raises(Refusal, match=said):
        tables.load(tmp_path / "s.mat")


def test_a_struct_without_geometry_is_one_of_unknown_lengths_and_frame(tmp_path):
    save(tmp_path / "s.mat", changed(("geometry",), None))
    table = Table(tmp_path / "s.mat")
    assert (table.assumed, table.traits.frame, table.chain) == (
        (LENGTHS,),
        "that of the table",
        None,
    )
    np.testing.assert_array_equal(table.stored.connection.A, computed()[0].A)
    np.testing.assert_allclose(
        Table(tmp_path / "s.mat", body_length=2.0).stored.connection.A[:2],
        computed()[0].A[:2] / 2,
        rtol=1e-13,
    )


def test_singular_shapes_are_not_exported(tmp_path):
    source = SceneTables(
        Scene(NoSlipSnake(), Circle(amplitude=0.5, centre=(1.5, -1.5)))
    ).with_numerics(grid=7, extent=2.5)
    with pytest.raises(
        Refusal,
        match="no minimum-perturbation frame of a field with singular shapes: shrink",
    ):
        fields.save_connection(tmp_path / "s.mat", source, layout="struct")
    assert not (tmp_path / "s.mat").exists()


def test_sign_and_order_are_its_own(tmp_path):
    with pytest.raises(
        Refusal,
        match="has a struct s, which says sign and order itself: drop sign and order",
    ):
        tables.load(write(tmp_path / "s.mat"), sign="-")


def test_a_struct_of_inertia_has_a_metric_without_power(tmp_path):
    table = study(write(tmp_path / "s.mat", system_type="inertia"))
    assert table.scene.system.traits.power_degree is None and table.metric.M.shape == (
        2,
        2,
        15,
        15,
    )
    assert (
        np.isnan(table.effort()["work"]).all()
        and np.isfinite(table.effort()["path_length"]).all()
    )


def test_a_file_of_version_7_3_is_refused_in_one_line_where_h5py_is_missing(
    tmp_path, monkeypatch
):
    (tmp_path / "s.mat").write_bytes(
        b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n" + bytes(600)
    )
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(
        Refusal,
        match=r"is a MATLAB 7.3 \(HDF5\) file: .* h5py, .* is missing; pip install 'geomech\[hdf5\]', or save",
    ):
        tables.load(tmp_path / "s.mat")


def test_damaged_files_of_version_7_3_are_refused_in_one_line(tmp_path):
    """12 bits at random, or cut short: refused in one line, or read as a table that is finite."""
    raw, rng = write(tmp_path / "s.mat", 7.3).read_bytes(), np.random.default_rng(0)
    for k in range(60):
        bad = bytearray(raw[: rng.integers(600, len(raw))] if k < 10 else raw)
        for place in rng.integers(512, len(bad), 12 if k >= 10 else 0):
            bad[place] ^= 1 << rng.integers(8)
        (tmp_path / "s.mat").write_bytes(bad)
        said = ""
        try:
            assert np.isfinite(tables.load(tmp_path / "s.mat").connection.A).all()
        except Refusal as refusal:
            said = str(refusal)
        assert not said or (
            said.startswith(f"the table {tmp_path / 's.mat'} ") and "\n" not in said
        )


def test_parts_of_version_7_3_are_refused_by_place(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = write(tmp_path / "s.mat", 7.3)
    with h5py.File(path, "r+") as file:
        del file["s/DA"]
        file["s/DA"] = h5py.ExternalLink("/etc/passwd", "/x")
    with pytest.raises(Refusal, match="has s.DA in another file"):
        tables.load(path)
    write(path, 7.3)
    with h5py.File(path, "r+") as file:
        file["s/B_optimized/self"] = file["s"]
    with pytest.raises(
        Refusal,
        match="is damaged at s.B_optimized.self.*: it lies in itself; save it in MATLAB again",
    ):
        tables.load(path)
    write(path, 7.3)
    with h5py.File(path, "r+") as file:
        place = file[file["s/grid/eval"][0, 0]].id.get_chunk_info(0).byte_offset
    raw = bytearray(path.read_bytes())
    raw[place + 40] ^= 8
    path.write_bytes(raw)
    with pytest.raises(
        Refusal, match=r"is damaged at s.grid.eval\{1, 1\}: save it in MATLAB again"
    ):
        tables.load(path)


@pytest.mark.parametrize(
    "frame", ["mean", "link-1", "link-2", "link-3", "minimum-perturbation"]
)
def test_an_exported_struct_has_all_that_its_scripts_read(frame, tmp_path):
    """Of a body of 0.3 m: read again it is what it was, and loaded by SciPy it has the fields, shapes and signs."""
    uneven = Swimmer(rft.Viscous(2.0), rft.Chain((0.7, 1.4, 0.9), 0.3))
    source = SceneTables(Scene(uneven, Circle())).with_numerics(grid=21, extent=1.5)
    source = source if frame == "mean" else source.in_frame(frame)
    fields.save_connection(tmp_path / "s.mat", source, layout="struct")
    again = study(tmp_path / "s.mat")
    assert again.scene.frame == frame and again.scene.system.stored.power_degree == 2
    lengths = np.array([0.3, 0.3, 1.0]).reshape(3, 1, 1, 1)
    np.testing.assert_allclose(
        again.fitted.A * lengths, source.fitted.A, rtol=1e-13, atol=1e-16
    )
    np.testing.assert_allclose(again.metric.M, source.metric.M, rtol=1e-13)
    np.testing.assert_allclose(
        again.fitted.residual * lengths[..., 0],
        source.fitted.residual,
        rtol=1e-13,
        atol=1e-16,
    )
    known = again.scene.system.stored.computed
    np.testing.assert_allclose(
        known.ccf[:, 0] * lengths[..., 0],
        source.curvature.values,
        rtol=1e-12,
        atol=1e-15,
    )
    if frame != "minimum-perturbation":  # which is kept but for the spline
        np.testing.assert_allclose(
            known.A_optimised,
            again.in_frame("minimum-perturbation").fitted.A,
            atol=1e-9,
        )
    s = loadmat(tmp_path / "s.mat", simplify_cells=True)["s"]
    assert {"vector", "scalar", "eval", "metric_eval", "metric_display"} <= {
        *s["grid"]
    } and s["singularity"] == 0
    for place, grid in (
        ("eval", "eval"),
        ("display", "vector"),
        ("finite_element", "finite_element"),
    ):
        content = s["vecfield"][place]["content"]
        assert s["vecfield"][place]["type"] == grid and content["Avec"].shape == (3, 2)
        np.testing.assert_array_equal(
            np.array(content["Avec"].tolist()), -np.array(content["A_num"].tolist())
        )
    for ending in ("", "_optimized"):
        DA, dA, lb = (
            np.array(s[f"{name}{ending}"].tolist()) for name in ("DA", "dA", "lb")
        )
        np.testing.assert_allclose(DA, dA - lb, atol=1e-15)
    assert (
        s["metricfield"]["metric_display"]["content"]["metric"][0, 0].shape
        == s["grid"]["metric_display"][0].shape
    )


def test_an_exported_struct_of_sand_keeps_what_its_fit_left(tmp_path):
    source = SceneTables(
        Scene(Swimmer(rft.Granular(1.8, 0.24), SWIMMER.body), Circle())
    ).with_numerics(grid=7, extent=1.5)
    fields.save_connection(tmp_path / "s.mat", source, layout="struct")
    again = study(tmp_path / "s.mat")
    np.testing.assert_array_equal(again.fitted.residual, source.fitted.residual)
    assert (
        again.scene.system.stored.metric is None
        and table_error(again.scene.system, *Circle().cycle(32, 1.0))[0] > 0.05
    )


def test_a_struct_of_three_joints_is_read(tmp_path):
    four = Swimmer(rft.Viscous(2.0), rft.Chain((1, 1, 1, 1), frame="link-2"))
    fitted = connection.fit(
        four.velocity, connection.grid(3, 5, 1.0), 12, traits=four.traits
    )
    grid = cell(np.array(np.meshgrid(*fitted.axes, indexing="ij")), (3,))
    content = {"Avec": cell(fitted.A, (3, 3))}
    geometry = {
        "linklengths": [1.0, 1, 1, 1],
        "baseframe": 2.0,
    }  # without a length links are not scaled
    save(
        tmp_path / "s.mat",
        {
            "geometry": geometry,
            "grid": {"eval": grid},
            "vecfield": {"eval": {"content": content}},
        },
    )
    table = Table(tmp_path / "s.mat")
    assert (table.joints, table.traits.frame, table.chain) == (3, "link-2", four.body)
    np.testing.assert_allclose(
        table.stored.connection.A[:2], fitted.A[:2] / 4, rtol=1e-13
    )
    np.testing.assert_array_equal(table.stored.connection.A[2], fitted.A[2])
    assert not [line for line in system_lines(table) if "sysplotter's own" in line]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda A: A, None),
        (lambda A: -A, "of the other sign"),
        (lambda A: A[:, ::-1].swapaxes(-1, -2), "with alpha1 and alpha2 swapped"),
        (lambda A: A[..., ::-1, ::-1], "with both axes mirrored"),
        (
            lambda A: -A[..., ::-1, ::-1],
            "with angles, or y and heading, positive clockwise",
        ),
    ],
)
def test_a_connection_that_its_body_would_have_with_other_axes_is_noted(
    change, said, tmp_path
):
    """By the swimmer in a fluid that its links are; nothing is changed, and a scene that loads it says so in a line."""
    A = change(computed()[0].A)
    content = {"A_num": cell(-A, (3, 2)), "Avec": cell(A, (3, 2))}
    table = Table(write(tmp_path / "s.mat", vecfield={"eval": {"content": content}}))
    np.testing.assert_array_equal(table.stored.connection.A, A)
    line = f"its A is that of a body of links {said} (correlation 1.00, as it stands "
    assert table.assumed == () if said is None else table.assumed[0].startswith(line)
    assert said is None or table.assumed[0].endswith("): check sign, axes and angles")


def test_explain_says_how_far_its_own_numbers_are_from_ours(tmp_path):
    lines = system_lines(Table(write(tmp_path / "s.mat")))
    (line,) = [
        line
        for line in lines
        if line.startswith("largest difference of sysplotter's own from ours")
    ]
    assert "CCF of joints 1 and 2 11 %, minimum-perturbation frame 1.6 %" in line


def test_a_connection_with_a_denominator_is_that_of_avec(tmp_path):
    """A_num is then no negative of it."""
    content = {
        name: cell(x, (3, 2))
        for name, x in (("A_num", -2 * computed()[0].A), ("Avec", computed()[0].A))
    }
    content["A_den"] = cell(np.full_like(computed()[0].A, 2.0), (3, 2))
    stored = tables.load(
        write(tmp_path / "s.mat", vecfield={"eval": {"content": content}})
    )
    np.testing.assert_array_equal(stored.connection.A, computed()[0].A)


@pytest.mark.parametrize(
    ("system", "kind"),
    [
        (DifferentialDrive(), "drag"),
        (IdealFluidSwimmer(), "inertia"),
        (Swimmer(rft.Viscous(2.0), rft.Chain((1,) * 4, modes="serpenoid")), "drag"),
        (
            Swimmer(
                rft.Viscous(2.0),
                rft.Chain((1,) * 4, frame="link-2", modes=((1, 0, -1), (0, 1, 0))),
            ),
            "drag",
        ),
    ],
)
def test_systems_of_other_kinds_are_exported_with_what_is_known_of_them(
    system, kind, tmp_path
):
    source = SceneTables(Scene(system, Circle(amplitude=0.5))).with_numerics(
        grid=9, extent=1.0
    )
    fields.save_connection(tmp_path / "s.mat", source, layout="struct")
    s, again = (
        loadmat(tmp_path / "s.mat", simplify_cells=True)["s"],
        study(tmp_path / "s.mat"),
    )
    assert s["system_type"] == kind
    np.testing.assert_allclose(
        again.fitted.A,
        source.fitted.A / [[[[body_size(system)]]], [[[body_size(system)]]], [[[1.0]]]],
    )
    metric = again.scene.system.stored.metric
    if kind == "inertia":
        np.testing.assert_allclose(metric.M, source.metric.M)
    assert again.scene.system.stored.power_degree == (
        2 if kind == "drag" and metric else None
    )
    modes = getattr(getattr(system, "body", None), "modes", None)
    assert (
        again.scene.system.chain
        == (None if modes is None or isinstance(modes, str) else system.body)
        or kind == "inertia"
    )


# The struct part by part, on an uneven grid.

AXES = np.array([-1.0, -0.2, 0.1, 0.5, 1.0]), np.array([-0.6, 0.0, 0.3, 0.9])
OWN = np.linspace(-1.2, 1.0, 7), np.linspace(-0.7, 0.95, 6)


def cubic(axes, seed):
    """A cubic of two angles on a grid, which splines of degree 3 keep."""
    a, b = np.meshgrid(*axes, indexing="ij")
    c = np.random.default_rng(seed).normal(size=6)
    return c[0] + c[1] * a + c[2] * b**2 + c[3] * a * b + c[4] * a**3 + c[5] * a * b**2


def uneven(change=lambda s: None):
    """A struct in which every array is another, of a body of three links 0.5 long in all."""
    many = lambda lead, seed, axes=AXES: cell(
        np.array([cubic(axes, seed + k) for k in range(np.prod(lead))]).reshape(
            *lead, *map(len, axes)
        ),
        lead,
    )
    metric = [many((1,), k, OWN)[0, 0] for k in (90, 91, 92)]
    M = np.array([[metric[0], metric[1]], [metric[1], metric[2]]])
    s = {
        "geometry": {"linklengths": np.array([0.1, 0.15, 0.25]), "baseframe": "head", "length": 0.5},
        "physics": {"drag_coefficient": 2.0},
        "grid": {name: cell(np.array(np.meshgrid(*x, indexing="ij")), (2,)) for name,
         x in (("eval", AXES), ("metric_eval", OWN))},
        "vecfield": {"eval": {"content": {"Avec": many((3, 2), 0), "Avec_optimized": many((3, 2), 10)}}},
        "DA": many((3, 1), 20),
        "DA_optimized": many((3, 1), 30), "B_optimized": {"eval": {"Beta": many((3,), 40)}}, "system_type": "drag",
        "geomech_fit_residual": many((3,), 50), "metricfield": {"metric_eval": {"content": {"metric": cell(M, (2, 2))}}},
    }  # fmt: skip
    change(s)
    return s


def read(change=lambda s: None):
    return sysplotter.parse(uneven(change), "", "", "0f")


def of(lead, seed):
    return np.array([cubic(AXES, seed + k) for k in range(np.prod(lead))]).reshape(
        *lead, 5, 4
    )


def test_every_array_of_a_struct_is_where_it_belongs():
    """In body lengths, of a body 0.5 long; its metric is carried over to the grid of A."""
    held, lengths = read(), np.array([2.0, 2.0, 1.0])
    two, one = lengths[:, None, None, None], lengths[:, None, None]
    for found, wanted in (
        (held.connection.A, two * of((3, 2), 0)), (held.computed.A_optimised, two * of((3, 2), 10)),
        (held.computed.ccf, two * of((3, 1), 20)), (held.computed.ccf_optimised, two * of((3, 1), 30)),
        (held.computed.beta, one * of((3,), 40)), (held.connection.residual, one * of((3,), 50)),
    ):  # fmt: skip
        np.testing.assert_allclose(found, wanted, rtol=1e-13)
    speed = np.sqrt((held.connection.A**2).mean(1) + held.connection.residual**2)
    np.testing.assert_allclose(held.connection.speed, speed, rtol=1e-13)
    scale = 2.0 * 0.5**3
    M = [[cubic(AXES, 90), cubic(AXES, 91)], [cubic(AXES, 91), cubic(AXES, 92)]]
    np.testing.assert_allclose(held.metric.M * scale, M, atol=1e-12)
    for found, wanted in zip(
        (*held.connection.axes, *held.computed.metric_axes), (*AXES, *OWN)
    ):
        np.testing.assert_array_equal(found, wanted)
    np.testing.assert_allclose(
        held.computed.metric[0, 1] * scale, cubic(OWN, 91), rtol=1e-13
    )
    assert (
        held.connection.degree,
        held.metric.degree,
        held.power_degree,
        held.sha256,
    ) == (3, 3, 2.0, "0f")
    assert (
        held.body == {"lengths": [0.1, 0.15, 0.25], "frame": "link-3"}
        and held.frame == "link-3"
    )
    assert (held.sized, held.connection.unit, held.connection.length, held.shapes) == (
        True,
        "BL",
        1.0,
        ("alpha_1", "alpha_2"),
    )

    def less(s):
        del (
            s["DA"],
            s["B_optimized"],
            s["metricfield"],
            s["geomech_fit_residual"],
            s["geometry"]["length"],
        )
        del s["DA_optimized"], s["vecfield"]["eval"]["content"]["Avec_optimized"]

    bare = read(less)
    assert (
        np.isnan(bare.connection.residual).all()
        and bare.metric is bare.power_degree is None
    )
    assert all(
        x is None
        for x in (
            bare.computed.A_optimised,
            bare.computed.beta,
            bare.computed.ccf,
            bare.computed.ccf_optimised,
        )
    )
    np.testing.assert_allclose(
        bare.connection.A, two * of((3, 2), 0), rtol=1e-13
    )  # by the lengths of its links
    del (unknown := uneven(less))["geometry"]
    plain = sysplotter.parse(unknown, "", "", "")
    assert (plain.sized, plain.body, plain.frame, plain.connection.length) == (
        False,
        None,
        "that of the table",
        None,
    )
    np.testing.assert_array_equal(plain.connection.A, of((3, 2), 0))
    inertia = read(lambda s: s.update(system_type="inertia"))
    assert inertia.power_degree is None
    np.testing.assert_allclose(inertia.metric.M, M, atol=1e-12)


@pytest.mark.parametrize(
    ("geometry", "body", "frame", "length"),
    [
        ({"baseframe": "center"}, None, "center of sysplotter", None), ({}, None, "center of sysplotter", None),
        ({"baseframe": 2.0, "length": 0.3}, None, "that of the table", 0.3),
        ({"baseframe": "minimum-perturbation"}, None, "minimum-perturbation", None),
        ({"linklengths": [1.0, 2.0, 4.0]}, {"lengths": [1.0, 2.0, 4.0], "frame": "link-2"}, "link-2", 7.0),
        ({"linklengths": [1.0, 2.0], "baseframe": "center"}, None, "center of sysplotter", 3.0),
        ({"linklengths": [1.0, 2.0, 4.0], "baseframe": 4.0}, None, "that of the table", 7.0),
        ({"linklengths": [1.0, 2.0, 4.0], "baseframe": 0.0}, None, "that of the table", 7.0),
        ({"linklengths": [1.0, 2.0, 4.0], "baseframe": 1.0, "length": -1.0},
         {"lengths": [1.0, 2.0, 4.0], "frame": "link-1"}, "link-1", 7.0),
        ({"linklengths": [1.0, 2.0], "baseframe": "com-mean", "length": [1.0, 2.0]},
         {"lengths": [1.0, 2.0], "frame": "mean"}, "mean", 3.0),
        ({"linklengths": [1.0, 2.0, 3.0], "baseframe": "tail", "length": 1e9, "modes": [[1.0], [2.0]]},
         {"lengths": [1.0, 2.0, 3.0], "frame": "link-1", "modes": [[1.0, 2.0]]}, "link-1", 6.0),
        ({"linklengths": [1.0, 2.0, 3.0], "baseframe": "head", "length": 0.99e9, "modes": np.zeros((0, 0))},
         {"lengths": [1.0, 2.0, 3.0], "frame": "link-3"}, "link-3", 0.99e9),
    ],
)  # fmt: skip
def test_bodies_of_structs_are_chains_where_their_frame_is_known(
    geometry, body, frame, length
):
    assert sysplotter._body({"geometry": geometry}) == (body, frame, length)


def put(path, value):
    """A change of a struct: an entry at a path of names and indices."""

    def change(s):
        for name in path[:-1]:
            s = s[name]
        s[path[-1]] = value(s[path[-1]]) if callable(value) else value

    return change


AT = ("vecfield", "eval", "content")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (put(("grid", "eval"), np.ones((5, 4))),
         "has s.grid.eval that is no cell of the grids of two angles or more: save it by"),
        (put(("grid", "eval"), lambda x: x[:1]), "has s.grid.eval that is no cell"),
        (put(("grid", "eval", (1, 0)), np.ones((4, 5))), "has s.grid.eval of shapes (5, 4), (4, 5)"),
        (put(("grid", "eval", (0, 0)), lambda x: x + 2e-9 * np.eye(5, 4)),
         "has s.grid.eval{1} that does not change along dimension 1 alone"),
        (put(("grid", "eval", (0, 0)), lambda x: x + 0.5e-9 * np.eye(5, 4)), ""),
        (put((*AT, "Avec", (2, 1)), np.ones((4, 5))),
         "has s.vecfield.eval.content.Avec{3, 2} of shape (4, 5) where its grid makes it (5, 4)"),
        (put((*AT, "Avec", (1, 0)), None), "has s.vecfield.eval.content.Avec{2, 1} that is not finite"),
        (put(("DA",), lambda x: x[:2]), "has s.DA that is no cell of 3 x 1 arrays: save it by"),
        (put((*AT, "A_num"), cell(-of((3, 2), 0), (3, 2))), ""),
        (put((*AT, "A_num"), cell(of((3, 2), 0), (3, 2))),
         "is damaged: s.vecfield.eval.content.Avec{1, 1} is not the negative of A_num at (1, 1)"),
        (put((*AT, "A_num"), cell(-of((3, 2), 0) * (1 + 1e-10), (3, 2))), ""),
        (put((*AT, "A_num"), cell(-of((3, 2), 0) * (1 + 1e-8), (3, 2))), "is damaged"),
        (put(("metricfield", "metric_eval", "content", "metric", (0, 1)), lambda x: x + 1e-10), ""),
        (put(("metricfield", "metric_eval", "content", "metric", (0, 1)), lambda x: x + 1e-7),
         "has s.metricfield.metric_eval.content.metric that is not symmetric: {1, 2} at (1, 1)"),
        (put(("grid", "metric_eval", (0, 0)), lambda x: x + 0.2 + 1e-9), ""),
        (put(("grid", "metric_eval", (0, 0)), lambda x: x + 0.2 + 4e-9),
         "has s.grid.metric_eval that does not cover s.grid.eval"),
        (put(("grid", "metric_eval", (1, 0)), lambda x: x - 0.05 - 1e-9), ""),
        (put(("grid", "metric_eval", (1, 0)), lambda x: x - 0.05 - 4e-9), "has s.grid.metric_eval that does"),
    ],
)  # fmt: skip
def test_arrays_of_a_struct_fit_each_other_or_are_refused(change, said):
    if not said:
        read(change)
        return
    with pytest.raises(Refusal) as found:
        read(change)
    assert str(found.value).startswith(said)


def test_what_is_compared_is_the_middle_half_of_the_grid():
    """What another program computed is off by a known share of the largest value at one place, and by more at the edge."""
    c = computed()[0]
    frame = minimum_perturbation(c)
    ours = (
        ccf(c).values,
        frame.field.values,
        ccf(
            Connection(c.axes, frame.connection(c), c.residual, c.speed, c.degree)
        ).values,
    )
    largest = [np.abs(x).max((1, 2)) for x in ours]
    assert min(x.max() for x in largest) > 1e-3
    for place, inside in ((3, True), (2, False), (11, True), (12, False)):
        theirs = [x.copy() for x in ours]
        for x, most, share in zip(theirs, largest, (0.02, -0.03, 0.04)):
            x[0, place, 7] += share * most[0]
            x[:, 0, 0] += 5 * most
        known = sysplotter.Computed(
            beta=theirs[1], ccf=theirs[0][:, None], ccf_optimised=theirs[2][:, None]
        )
        found = sysplotter.compared(Stored(c, computed=known))
        names = (
            "CCF of joints 1 and 2",
            "minimum-perturbation frame",
            "CCF in that frame",
        )
        assert tuple(found) == names
        np.testing.assert_allclose(
            [*found.values()], [0.02, 0.03, 0.04] if inside else 0.0, atol=1e-9
        )
    assert list(
        sysplotter.compared(Stored(c, computed=sysplotter.Computed(beta=ours[1])))
    ) == [names[1]]
