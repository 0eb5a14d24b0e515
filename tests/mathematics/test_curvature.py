"""The CCF of any pair of joints, its estimated error near kinks, and what a file says of both."""

import dataclasses

import numpy as np
import pytest
import sympy as sp
import xarray

from geomech import scenes
from geomech.core.variables import Result, Variable
from geomech.mathematics import symbolic
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.tiers import fitted
from geomech.questions.swimmers.ccf import zero_line_words
from geomech.results import show
from geomech.studies.maps import fields
from geomech.studies.maps.shape_space import zero_line
from geomech.studies.scene_tables import SceneTables
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass")
BENCH = SceneTables(GLASS)


def local(scene, shapes, h=2e-4):
    """The CCF (..., 3) of the scene's own fit at shapes (..., 2), by differences over 2 h of A solved there."""
    unit = connection.directions(2, fitted.directions(scene.system, scene.numerics))

    def A(alpha):
        return np.einsum(
            "jc,...ci->...ij",
            np.linalg.pinv(unit),
            scene.system.velocity(alpha[..., None, :], unit),
        )

    d1, d2 = ((A(shapes + step) - A(shapes - step)) / (2 * h) for step in h * np.eye(2))
    here = A(shapes)
    return d1[..., 1] - d2[..., 0] + se2.bracket(here[..., 0], here[..., 1])


def test_every_pair_of_three_joints():
    """Against SymPy, for a connection of three joints in which no two columns are alike; pairs are antisymmetric."""
    a, b, c = alpha = sp.symbols("alpha_1:4", real=True)
    A = sp.Matrix(
        [
            [sp.cos(a + b), b * c, 1 + a],
            [sp.sin(c), a - c, b * b],
            [1 + a * b, 2 + c, sp.cos(a) - b],
        ]
    )
    fitted = connection.fit(
        symbolic.velocity(A, alpha), (np.linspace(-0.5, 0.6, 13),) * 3, 16, degree=5
    )
    shapes = np.meshgrid(*fitted.axes, indexing="ij")
    for i, j in ((0, 1), (0, 2), (1, 2)):
        exact = np.broadcast_arrays(
            *sp.lambdify(alpha, list(symbolic.ccf(A, alpha, i, j)), "numpy")(*shapes)
        )
        found = curvature.ccf(fitted, i, j).values
        np.testing.assert_allclose(found, exact, atol=1e-6)
        np.testing.assert_allclose(
            curvature.ccf(fitted, j, i).values, -found, atol=1e-14
        )
        error = curvature.error(fitted, i, j).values
        assert error.shape == found.shape
        assert (np.abs(found - exact) <= error + 1e-12).all()


@pytest.mark.parametrize(
    ("name", "numerics", "least", "most"),
    [
        ("three-link-glass", {}, 0.9, 20),
        ("three-link-glass-close", {"grid": 22}, 0.9, 20),
        ("three-link-coulomb", {"grid": 15, "interpolation": 1}, 0.9, 20),
        ("three-link-viscous", {"grid": 20}, 0.99, 100),
    ],
)
def test_the_error_of_the_ccf_covers_the_truth(name, numerics, least, most):
    """At random grid points, each component, in a share of ``least``; and in the median by no more than ``most`` errors."""
    scene, rng = scenes.load(name).with_numerics(**numerics), np.random.default_rng(4)
    i, j = rng.integers(0, scene.numerics.grid, (2, 300))
    study = SceneTables(scene)
    axes = study.fitted.axes
    truth = local(scene, np.stack([axes[0][i], axes[1][j]], -1)).T
    estimate = study.curvature_error.values[:, i, j]
    error = np.abs(study.curvature.values[:, i, j] - truth)
    assert ((error <= estimate + 1e-12).mean(1) >= least).all()
    assert (np.median(estimate / np.maximum(error, 1e-16), 1) <= most).all()


def test_wrong_signs_near_kinks_are_known_to_be_unknown():
    """Where the default grid gives the turn a sign that the local derivative does not have, the error says so; likewise at
    (-1, -5/6), beside a kink, where the sign is right."""
    assert GLASS.numerics.grid == 31
    shapes = np.stack(np.meshgrid(*BENCH.fitted.axes, indexing="ij"), -1)[1:-1, 1:-1]
    truth = np.moveaxis(local(GLASS, shapes), -1, 0)
    field, error = (
        x.values[:, 1:-1, 1:-1] for x in (BENCH.curvature, BENCH.curvature_error)
    )
    wrong = (field * truth < 0) & (np.minimum(np.abs(field), np.abs(truth)) > 0.003)
    assert wrong[2].sum() >= 8
    assert (error > np.abs(field))[wrong].all()
    beside = 8, 9  # without the edges
    assert shapes[beside] == pytest.approx([-1, -5 / 6])
    assert (np.abs(field - truth)[:, *beside] <= error[:, *beside]).all()


def test_the_smallest_grid_has_an_error_too():
    small = GLASS.with_numerics(grid=4)
    assert np.isfinite(SceneTables(small).curvature_error.values).all()
    assert SceneTables(small).curvature_error.values.max() > 0.01


@pytest.mark.parametrize(("length", "unit"), [(None, "BL"), (0.4, "m")])
def test_files_have_values_units_and_conventions(tmp_path, length, unit):
    """All of the file against the objects: an uneven body in a frame of its own, off the defaults."""
    body = dataclasses.replace(
        GLASS.system.body, lengths=(1, 2, 3), length=length, frame="link-2"
    )
    scene = GLASS.changed(body=body).with_numerics(
        grid=7, extent=2.0, regularisation=1e-5
    )
    study = SceneTables(scene)
    fields.save_connection(tmp_path / "a.nc", study)
    per = f"{unit}/rad, {unit}/rad, rad/rad"
    per2 = f"{unit}/rad2, {unit}/rad2, rad/rad2"
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        for name, values, units in (
            ("A", study.fitted.A, per),
            ("fit_residual", study.fitted.residual, per),
            ("ccf", study.curvature.values, per2),
            ("ccf_error", study.curvature_error.values, per2),
            ("alpha_2", study.fitted.axes[1], "rad"),
        ):
            np.testing.assert_array_equal(data[name], values)
            assert data[name].attrs["units"] == units
        assert (
            data.ccf_error.dims == data.ccf.dims == ("component", "alpha_1", "alpha_2")
        )
        assert data.component.values.tolist() == ["x", "y", "theta"]
        said = data.attrs
    assert (said["frame"], said["length_unit"], said["body_length"]) == (
        "link-2",
        unit,
        length or 1.0,
    )
    assert (said["loads"], said["regularisation"]) == ("exact", 1e-5)
    assert said["sign_of_A"] == "xi = + A alphadot"
    assert said["pair_of_ccf"].startswith("CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2")
    assert "counter-clockwise" in said["sign_of_ccf"]
    assert "x, y, theta" in said["components"]


AXES = np.linspace(-1.0, 1.5, 11), np.linspace(-1.2, 1.0, 12)


def field_of(x, y=0.0, theta=0.0):
    """A CCF on AXES, x and y in metres."""
    values = [
        np.broadcast_to(
            f(*np.meshgrid(*AXES, indexing="ij")) if callable(f) else f, (11, 12)
        )
        for f in (x, y, theta)
    ]
    return Field(AXES, np.array(values, float), 3, unit="m", length=0.3)


@pytest.mark.parametrize(
    ("x", "middle", "said"),
    [
        (lambda a, b: 1 + a**2, (0.0, 0.0), "none, x has one sign"),
        (lambda a, b: -1 - b**2, (0.0, 0.0), "none, x has one sign"),
        (lambda a, b: (a - 0.25) ** 2 + (b + 0.1) ** 2 - 0.5**2, (0.25, -0.1), "0.5 to 0.5 rad from the gait's middle"),
        (lambda a, b: (a - 0.25) ** 2 + (b + 0.1) ** 2 - 0.5**2, (0.1, 0.1), "0.25 to 0.75 rad from the gait's middle"),
        (lambda a, b: 0.405 - a, (0.0, 0.0), "0.4 to 0.96 rad from the gait's middle, in 38 % of directions"),
        (lambda a, b: a - 1.2, (0.0, 0.0), "further than 1 rad from the gait's middle"),
        (lambda a, b: b + 1.1, (0.5, 0.1), "further than 0.9 rad from the gait's middle"),
        (lambda a, b: 1e-13 * a, (0.0, 0.0), None), (lambda a, b: np.where(a < -0.9, np.nan, a), (0.0, 0.0), None),
    ],
)  # fmt: skip
def test_the_zero_line_is_looked_for_around_the_gaits_middle(x, middle, said):
    """Up to the nearest edge, in 72 directions and 200 steps."""
    field = field_of(x)
    field = dataclasses.replace(
        field, values=np.where(np.isnan(field.values[0]), np.nan, field.values)
    )
    found = zero_line(field, np.array(middle))
    if said is None:
        assert found == []
        return
    ccf = Variable("ccf", (), field.values)
    result = Result("ccf", (*found, ccf))
    assert zero_line_words(result) == f"zero line of x: {said}"


def test_extremes_of_a_ccf_are_told_with_their_places_and_the_larger_error():
    field = field_of(
        lambda a, b: 2 * a - b, lambda a, b: -5e-13 + 0 * a, lambda a, b: a * b
    )
    errors = 1e-3 * np.arange(3 * 132.0).reshape(3, 11, 12)
    error = dataclasses.replace(field, values=errors)
    axes = [
        Variable(f"alpha_{k}", (f"alpha_{k}",), x, "rad") for k, x in enumerate(AXES, 1)
    ]
    component = Variable("component", ("component",), ["x", "y", "theta"])
    result = Result("", (component, *axes, fields.ccf_variable(field, error)))
    (table,) = (part for part in show.parts(result) if isinstance(part, show.Table))
    rows = [*zip(table.first, *(column for (column,) in table.blocks))]
    head, x, y, theta = rows
    assert head == ("component", "least", "at", "largest", "at", "+- error")
    assert x == ("x (m/rad2)", "-3", "-1, 1", "4.2", "1.5, -1.2", "1.2e-01")
    assert y[:4] == ("y (m/rad2)", "zero", "", "zero")
    assert theta[:3] == ("theta (rad/rad2)", "-1.8", "1.5, -1.2")
    assert theta[3:] == ("1.5", "1.5, 1", "4.0e-01")
