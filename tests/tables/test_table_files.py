"""What files of tables hold, part by part, and what is wrong with bad ones."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray
from refusals import refuses
from scipy.io import savemat

from geomech.io import tables
from rft.core.refusal import Refusal

AXES = np.linspace(-1.0, 1.0, 5), np.array([-0.5, 0.0, 0.2, 0.9])
GRID = ("alpha_1", "alpha_2")
ENTRIES = ("Ax1", "Ax2", "Ay1", "Ay2", "Atheta1", "Atheta2")


def assert_refused(path, said, **options):
    """Assert that a table is refused by its name and these words, in their order."""
    with refuses(said, str(path)):
        tables.load(path, **options)


# NetCDF.

LEADS = {
    "A": ("component", "joint"),
    "fit_residual": ("component",),
    "speed": ("component",),
    "even_part": ("component",),
    "harmonics": ("component", "coefficient"),
    "harmonics_residual": ("component",),
    "A_error": ("component", "joint"),
    "norm": ("norm_coefficient",),
    "norm_residual": (),
    "ccf_pairs": ("pair", "component"),
}
SIZES = {"component": 3, "joint": 2, "coefficient": 4, "norm_coefficient": 5, "pair": 1}


def netcdf(path, change=None):
    """Write a table of 5 by 4 shapes with all that a file may have."""
    rng = np.random.default_rng(0)
    parts = {name: ((name,), axis) for name, axis in zip(GRID, AXES)}
    parts["joint"] = ("joint",), np.arange(2)
    parts["component"] = ("component",), ["x", "y", "theta"]
    parts["pair_joints"] = ("pair", "pair_joint"), np.array([[1.0, 2.0]])
    for name, lead in LEADS.items():
        shape = [*(SIZES[dimension] for dimension in lead), 5, 4]
        parts[name] = (*lead, *GRID), rng.uniform(0.1, 1.0, shape)
    attributes = {
        "length_unit": "m",
        "body_length": 0.3,
        "interpolation": 2,
        "frame": "mean",
        "level": 0.9,
        "power_degree": 1.5,
    }
    if change:
        change(parts, attributes)
    data = xarray.Dataset(parts, attrs=attributes)
    data.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")
    return {name: values for name, (_, values, *_) in parts.items()}


def attributes(**values):
    return lambda parts, attributes: attributes.update(values)


def part(name, dims, values, **about):
    return lambda parts, attributes: parts.update({name: (dims, values, about)})


def cut(name, index, dims=None):
    """A part with some of its values, over other dimensions if they are given."""

    def change(parts, attributes):
        before, values = parts[name]
        parts[name] = dims or before, values[index]

    return change


def put(name, index, value):
    return lambda parts, attributes: parts[name][1].__setitem__(index, value)


def less(*names):
    def change(parts, attributes):
        for name in names:
            parts.pop(name, None)
            attributes.pop(name, None)

    return change


def both(*changes):
    def change(parts, attributes):
        for one in changes:
            one(parts, attributes)

    return change


def masked(*names, **said):
    """The shape (1, 2) is singular in some parts."""
    return both(*(put(name, (..., 1, 2), np.nan) for name in names), attributes(**said))


SINGULAR = {"singular_shapes": "nan"}


@pytest.mark.parametrize(
    ("sign", "stated", "turn"),
    [
        ("", "", 1),
        ("-", "", -1),
        ("", "xi = - A alphadot", -1),
        ("+", "xi = - A alphadot", 1),
    ],
)
def test_every_part_of_a_netcdf_file_is_where_it_belongs(sign, stated, turn, tmp_path):
    parts = netcdf(tmp_path / "a.nc", attributes(sign_of_A=stated))
    held = tables.load(tmp_path / "a.nc", sign)
    c = held.connection
    found = {
        "alpha_1": c.axes[0],
        "alpha_2": c.axes[1],
        "A": turn * c.A,
        "fit_residual": c.residual,
        "speed": c.speed,
        "harmonics": turn * held.harmonics.coefficients,
        "harmonics_residual": held.harmonics.residual,
        "even_part": held.even,
        "A_error": held.A_error,
        "norm": held.metric.coefficients,
        "norm_residual": held.metric.residual,
    }
    for name, values in found.items():
        np.testing.assert_array_equal(values, parts[name], name)
    assert c.size == {"unit": "m", "length": 0.3}
    assert (c.degree, held.harmonics.degree, held.metric.degree) == (2, 2, 2)
    assert (held.length, held.unit, held.sized) == (0.3, "m", True)
    assert (held.frame, held.level, held.power_degree) == ("mean", 0.9, 1.5)
    assert (held.sign, held.order, held.body) == ("+-"[turn < 0], "ndgrid", None)


def test_parts_that_a_netcdf_file_lacks_are_none(tmp_path):
    netcdf(tmp_path / "a.nc", less("harmonics", "even_part", "A_error", "power_degree"))
    held = tables.load(tmp_path / "a.nc")
    assert held.harmonics is held.even is held.A_error is None
    assert held.metric is held.power_degree is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (less("joint"), "joint missing | instead"),
        (less("fit_residual"), "fit_residual missing | instead"),
        (
            part("joint", ("joint", "k"), np.zeros((2, 1))),
            "A dimensions component | instead",
        ),
        (part("joint", ("k",), np.arange(3)), "alpha_3 missing | instead"),
        (
            part("alpha_2", ("alpha_2",), AXES[1], units="rads"),
            "alpha_2 unit rads | because",
        ),
        (part("alpha_1", ("alpha_1",), 20 * AXES[0][::-1]), "grid alpha_1 | instead"),
        (part("alpha_1", ("alpha_1",), 57 * AXES[0]), "alpha_1 up 57 | instead"),
        (
            both(less("A_error"), cut("A", np.s_[:, :1], ("component", "one", *GRID))),
            "A dimensions component one alpha_1 alpha_2 | instead",
        ),
        (
            both(
                part("joint", ("k",), np.arange(2)),
                less("A_error"),
                cut("A", np.s_[:, :1]),
            ),
            "A shape 3 1 5 4 3 2 rows x y t",
        ),
        (
            part("component", ("component",), ["theta", "y", "x"]),
            "A shape 3 2",
        ),
        (
            part("A", ("component", "joint", *GRID), np.ones((3, 2, 5, 4), "i4")),
            "A shape 3 2 5 4 grid | instead",
        ),
        (put("A", (0, 1, 2, 3), np.inf), "A finite | instead"),
        (put("A", (0, 1, 2, 3), 2e9), "A above 1e+09 0 1 2 3 | instead"),
        (attributes(length_unit="feet"), "body_length length_unit | instead"),
        (attributes(body_length=1e9), "body_length | instead"),
        (attributes(body_length=0), "body_length | instead"),
        (attributes(body_length=[0.3, 0.3]), "body_length | instead"),
        (attributes(body_length="1"), "body_length | instead"),
        (attributes(interpolation=4), "few shapes spline degree 4 | instead"),
        (cut("harmonics", np.s_[:, :3]), "harmonics shape 3 3 5 4"),
        (put("harmonics", (1, 2, 3, 0), np.nan), "harmonics finite | instead"),
        (put("even_part", (1, 2, 3), np.nan), "even_part finite | instead"),
        (
            cut("even_part", np.s_[:2], ("two", *GRID)),
            "even_part dimensions two alpha_1 alpha_2 | instead",
        ),
        (
            cut("A_error", np.s_[:, :1], ("component", "one", *GRID)),
            "A_error dimensions component one | instead",
        ),
        (put("A_error", (0, 1, 2, 3), -1e-9), "A_error below 0"),
        (
            cut("pair_joints", np.s_[:, ::-1]),
            "pair_joints [[1 2]] | instead",
        ),
        (
            both(less("pair_joints"), cut("ccf_pairs", np.s_[[0, 0]])),
            "ccf_pairs shape 2 3 5 4 1 3 | instead",
        ),
        (put("ccf_pairs", (0, 2, 1, 1), np.nan), "ccf_pairs finite | instead"),
        (attributes(power_degree=100.0), "power_degree valid | instead"),
        (attributes(power_degree=0), "power_degree | instead"),
        (attributes(power_degree=[1.0, 2.0]), "power_degree | instead"),
        (
            cut("norm", np.s_[:4]),
            "norm shape 4 5 4",
        ),
        (
            part(
                "metric",
                ("joint", "other_joint", *GRID),
                np.reshape([[1, 0.5], [0.6, 1]], (2, 2, 1, 1)) * np.ones((5, 4)),
            ),
            "metric shape 2 2 5 4 2 2 symmetric",
        ),
        (
            masked("A", "fit_residual", "speed", "A_error"),
            "A finite 0 0 1 2 | instead",
        ),
        (masked("A", "A_error", **SINGULAR), "fit_residual singular shapes | instead"),
        (masked("A", "fit_residual", **SINGULAR), "A_error singular shapes | instead"),
        (masked("fit_residual", **SINGULAR), "fit_residual finite | instead"),
        (masked("A_error", **SINGULAR), "A_error finite | instead"),
    ],
)
def test_parts_of_a_netcdf_file_that_do_not_fit_are_refused(change, said, tmp_path):
    netcdf(tmp_path / "a.nc", change)
    assert_refused(tmp_path / "a.nc", said)


@pytest.mark.parametrize(
    "change",
    [
        part("alpha_2", ("alpha_2",), AXES[1], units="radians"),
        part("alpha_1", ("alpha_1",), 31.4 * AXES[0]),
        attributes(body_length=0.99e9),
        attributes(interpolation=3),
        attributes(interpolation=6),
        attributes(interpolation=0),
        cut("harmonics", np.s_[:, :2]),
        put("A_error", ..., 0.0),
        put("fit_residual", ..., np.nan),
        attributes(power_degree=99),
        attributes(power_degree=0.1),
        cut("norm", np.s_[:3]),
        masked("A", "fit_residual", "speed", "A_error", **SINGULAR),
    ],
)
def test_parts_of_a_netcdf_file_within_their_bounds_are_read(change, tmp_path):
    netcdf(tmp_path / "a.nc", change)
    assert tables.load(tmp_path / "a.nc").connection.A.shape == (3, 2, 5, 4)


# NetCDF of a measured gait: A about it, of two joints and with two harmonics.

GAIT_SHAPES = {
    "gait": (2, 3),
    "gait_A": (3, 2, 5),
    "gait_slope": (3, 2, 1, 5),
    "gait_errors": (4, 3, 2, 2, 5),
    "gait_off": (3, 2, 7),
}
GAIT = {"level": 0.9, "error_factor": 2.1}


def gait_netcdf(path, changes, **facts):
    rng = np.random.default_rng(0)
    values = {name: rng.normal(size=shape) for name, shape in GAIT_SHAPES.items()}
    values["gait_spread"] = np.eye(2)[..., None] * [1.0, 2.0, 3.0]
    values["gait_beyond"] = np.array([-0.1, 0.2, 0.3])
    values |= changes

    def change(parts, attributes):
        for name, array in values.items():
            if array is not None:
                dims = [f"{name}_{k}" for k in range(np.ndim(array))]
                parts[name] = dims, array
        attributes.update({**GAIT, **facts})

    netcdf(path, change)
    return values


@pytest.mark.parametrize(("sign", "turn"), [("+", 1.0), ("-", -1.0)])
def test_parts_of_a_gait_are_where_they_belong(sign, turn, tmp_path):
    parts = gait_netcdf(tmp_path / "a.nc", {})
    found = tables.load(tmp_path / "a.nc", sign).connection.taylor
    for values, expected in (
        (found.loop.coefficients, parts["gait"]),
        (found.A, turn * parts["gait_A"]),
        (found.slope, turn * parts["gait_slope"]),
        (found.errors, turn * parts["gait_errors"]),
        (found.spread, parts["gait_spread"]),
        (found.beyond, [0.1, 0.2, 0.3]),
        (found.standard_error, np.abs(parts["gait_off"])),
    ):
        np.testing.assert_array_equal(values, expected)
    assert (found.level, found.factor) == (0.9, 2.1)


UNFIT = "gait parts geomech fit-gait | instead"
EVEN = {
    "gait_A": np.ones((3, 2, 4)),
    "gait_slope": np.ones((3, 2, 1, 4)),
    "gait_errors": np.ones((1, 3, 2, 2, 4)),
}


@pytest.mark.parametrize(
    ("changes", "facts", "said"),
    [
        (
            {"gait_A": np.ones((3, 2))},
            {},
            "gait gait_A | instead",
        ),
        ({"gait_spread": None}, {}, "gait gait_spread | instead"),
        (
            {"gait": np.ones((2, 1))},
            {},
            "gait move | instead",
        ),
        ({"gait": np.zeros((2, 3))}, {}, "gait move | instead"),
        ({"gait": np.ones((2, 4))}, {}, UNFIT),
        ({"gait_A": np.ones((2, 2, 5))}, {}, UNFIT),
        ({"gait_A": np.ones((3, 3, 5))}, {}, UNFIT),
        ({"gait_A": np.ones((3, 2, 7))}, {}, UNFIT),
        ({"gait_slope": np.ones((3, 2, 2, 5))}, {}, UNFIT),
        ({"gait_errors": np.ones((4, 2, 2, 2, 5))}, {}, UNFIT),
        ({"gait_spread": np.ones((2, 1, 3))}, {}, UNFIT),
        ({"gait_spread": np.ones((2, 2, 3))}, {}, UNFIT),
        ({"gait_spread": np.eye(3)[..., None]}, {}, UNFIT),
        ({"gait_beyond": np.ones(2)}, {}, UNFIT),
        ({"gait_off": np.ones((3, 2))}, {}, UNFIT),
        ({"gait_off": np.ones((3, 1, 7))}, {}, UNFIT),
        ({"gait_off": np.ones((2, 2, 7))}, {}, UNFIT),
        (EVEN, {}, UNFIT),
        ({}, {"level": 0.0}, UNFIT),
        ({}, {"level": 1.0}, UNFIT),
        ({}, {"level": "1"}, UNFIT),
        ({}, {"error_factor": 0.0}, UNFIT),
        ({}, {"error_factor": 1e6}, UNFIT),
        ({}, {"error_factor": [2.0, 3.0]}, UNFIT),
    ],
)
def test_parts_of_a_gait_that_do_not_fit_are_refused(changes, facts, said, tmp_path):
    gait_netcdf(tmp_path / "a.nc", changes, **facts)
    assert_refused(tmp_path / "a.nc", said)


# MATLAB.

PLAIN = np.arange(20.0).reshape(5, 4)
ROWS = {
    "alpha1": np.linspace(0, 1, 5)[:, None],
    "alpha2": np.linspace(0, 1, 4)[None],
}
FULL = {
    "unit": "m",
    "length": 0.3,
    "interpolation": 2,
    "frame": "mean",
    "level": 0.9,
    "power_degree": 1.5,
    "sign": "-",
    "shapes": ["a", "b"],
}


def matlab(path, changes=None, about=None):
    """Write a table of 5 by 4 shapes as of ndgrid; return its arrays."""
    first, second = np.meshgrid(*AXES, indexing="ij")
    arrays = {"alpha1": first, "alpha2": second}
    for k, name in enumerate(ENTRIES, 1):
        arrays[name] = k + 0.1 * PLAIN
    arrays |= {"M11": 2 + PLAIN, "M12": np.full((5, 4), 0.5), "M22": 1 + PLAIN}
    arrays["geomech_fit_residual"] = np.stack([PLAIN, PLAIN + 1, PLAIN + 2])
    arrays["geomech_A_error"] = np.full((3, 2, 5, 4), 0.1)
    if about is not None:
        arrays["geomech_about"] = json.dumps(about)
    arrays |= changes or {}
    savemat(path, {name: x for name, x in arrays.items() if x is not None})
    return arrays


@pytest.mark.parametrize(("sign", "turn"), [("", -1), ("-", -1), ("+", 1)])
def test_every_part_of_a_matlab_file_is_where_it_belongs(sign, turn, tmp_path):
    arrays = matlab(tmp_path / "a.mat", about=FULL)
    held = tables.load(tmp_path / "a.mat", sign)
    c = held.connection
    A = np.reshape([arrays[name] for name in ENTRIES], (3, 2, 5, 4))
    residual = arrays["geomech_fit_residual"]
    M = [[arrays["M11"], arrays["M12"]], [arrays["M12"], arrays["M22"]]]
    np.testing.assert_array_equal(turn * c.A, A)
    np.testing.assert_array_equal(c.residual, residual)
    np.testing.assert_array_equal(held.metric.M, M)
    np.testing.assert_array_equal(held.A_error, arrays["geomech_A_error"])
    assert c.size == {"unit": "m", "length": 0.3}
    assert (c.degree, held.metric.degree) == (2, 2)
    assert (held.length, held.unit, held.sized) == (0.3, "m", True)
    assert (held.frame, held.level, held.power_degree) == ("mean", 0.9, 1.5)
    assert (held.sign, held.order) == ("+-"[turn < 0], "ndgrid")
    assert (held.shapes, held.assumptions, held.body) == (("a", "b"), (), None)


def test_what_a_matlab_file_does_not_state_is_the_usual(tmp_path):
    matlab(tmp_path / "a.mat", dict.fromkeys(("M12", "geomech_fit_residual")))
    held = tables.load(tmp_path / "a.mat", "+")
    assert held.metric is held.power_degree is held.level is None
    assert np.isnan(held.connection.residual).all()
    assert (held.unit, held.length, held.sized) == ("BL", 1.0, False)
    assert (held.connection.degree, held.frame) == (3, "that of the table")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            ROWS,
            "alpha1 alpha2 rows order order = | instead",
        ),
        (
            {"Ay2": PLAIN[:, :3]},
            "Ay2 shape 5 3 alpha1 alpha2",
        ),
        ({"Ax1": np.full((5, 4), np.nan)}, "Ax1 finite | instead"),
        ({"Ax1": np.full((5, 4), 1j)}, "Ax1 real"),
        ({"Ax1": "text"}, "Ax1 real"),
        ({"Ax1": {"a": 1}}, "Ax1 real"),
        (dict.fromkeys(ENTRIES, 0 * PLAIN), "connection zero"),
        (
            {"alpha1": PLAIN[:, :3]},
            "alpha1 5 3 alpha2 5 4",
        ),
        (
            {"alpha1": np.ones((3, 3, 3))},
            "alpha1 3 3 3 alpha2 5 4",
        ),
        (
            {"alpha1": np.ones((5, 4))},
            "grid alpha1 4 ascending | instead",
        ),
        (
            {"alpha1": PLAIN},
            "alpha1 alpha2 grid | because",
        ),
        (
            {"alpha1": AXES[0][:, None] + 2e-9 * np.arange(4)},
            "alpha1 alpha2 grid | because",
        ),
        (
            {"alpha1": 6.4 * AXES[0][:, None] + 0 * PLAIN},
            "alpha1 up 6.4 rad rad | instead",
        ),
        (
            {"M11": 0.25 / (1 + PLAIN)},
            "M11 M12 M22 metric | because",
        ),
        (
            {"M11": -1 - PLAIN, "M22": -1 - PLAIN},
            "M11 M12 M22 metric | because",
        ),
        (
            {"M22": 0 * PLAIN},
            "M11 M12 M22 metric 0 0 | because",
        ),
        (
            {"M12": PLAIN[:4]},
            "M12 shape 4 4 alpha1 alpha2",
        ),
        (
            {"geomech_A_error": np.ones((3, 2, 4, 5))},
            "geomech_A_error shape 3 2 4 5 A 3 2 5 4",
        ),
        ({"geomech_A_error": -np.ones((3, 2, 5, 4))}, "geomech_A_error below 0"),
        (
            {"geomech_A_error": np.full((3, 2, 5, 4), np.nan)},
            "geomech_A_error finite | instead",
        ),
        (
            {"geomech_fit_residual": np.full((3, 5, 4), np.inf)},
            "geomech_fit_residual finite | instead",
        ),
    ],
)
def test_parts_of_a_matlab_file_that_do_not_fit_are_refused(changes, said, tmp_path):
    matlab(tmp_path / "a.mat", changes)
    assert_refused(tmp_path / "a.mat", said, sign="+")


def test_a_connection_without_x_does_not_tell_its_sign(tmp_path):
    matlab(tmp_path / "a.mat", {"Ax1": 0 * PLAIN, "Ax2": 0 * PLAIN})
    assert_refused(tmp_path / "a.mat", "sign A sign | instead")


@pytest.mark.parametrize(
    ("changes", "about", "order"),
    [
        ({}, None, "ndgrid"),
        (ROWS, None, "ndgrid"),
        ({"M11": 0.26 / (1 + PLAIN)}, None, ""),
        ({"M11": None, "M12": PLAIN[:4]}, None, ""),
        ({"geomech_A_error": "none"}, None, ""),
        ({"geomech_fit_residual": np.zeros((3, 4, 5))}, None, ""),
        ({"alpha1": 6.2 * AXES[0][:, None] + 0 * PLAIN}, None, ""),
        ({"alpha1": 6.4 * AXES[0][:, None] + 0 * PLAIN}, {}, ""),
        ({"alpha1": AXES[0][:, None] + 2e-10 * np.arange(4)}, None, ""),
    ],
)
def test_parts_of_a_matlab_file_within_their_bounds_are_read(
    changes, about, order, tmp_path
):
    matlab(tmp_path / "a.mat", changes, about)
    A = tables.load(tmp_path / "a.mat", "+", order).connection.A
    np.testing.assert_array_equal(A[2, 1], 6 + 0.1 * PLAIN)


@pytest.mark.parametrize("options", [{"do_compression": True}, {"format": "4"}])
def test_a_matlab_file_may_be_compressed_or_of_version_4(options, tmp_path):
    arrays = matlab(tmp_path / "a.mat")
    flat = {name: x for name, x in arrays.items() if np.ndim(x) == 2}
    savemat(tmp_path / "b.mat", flat, **options)
    A = tables.load(tmp_path / "b.mat", "+").connection.A
    np.testing.assert_array_equal(A, tables.load(tmp_path / "a.mat", "+").connection.A)


# Damage.


DATA = Path(__file__).parents[1] / "data"
SAVED = [DATA / "uneven.nc", DATA / "frozen" / "field.mat"]


@pytest.mark.parametrize("path", SAVED, ids=lambda path: path.name)
@pytest.mark.filterwarnings("error")
def test_damaged_files_are_refused_or_read_as_finite_tables(path, tmp_path):
    """Cut short, and with up to five bytes changed 150 times."""
    raw = path.read_bytes()
    files = []
    for size in (0, 3, 10, 127, 130, 500, 2000, len(raw) // 2, len(raw) - 9):
        files.append(raw[:size])
    rng = np.random.default_rng(1)
    for _ in range(150):
        damaged = bytearray(raw)
        for k in rng.integers(0, 4000, rng.integers(1, 6)):
            damaged[k % len(raw)] = rng.integers(256)
        files.append(damaged)
    outcomes = []
    for file in files:
        (tmp_path / path.name).write_bytes(file)
        try:
            held = tables.load(tmp_path / path.name)
            outcomes.append(np.isfinite(held.connection.A).all())
        except Refusal:
            outcomes.append("refused")
    assert set(outcomes[:9]) == {"refused"}
    assert set(outcomes) == {"refused", True}
