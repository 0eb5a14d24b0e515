"""The CCF of any pair of joints, its estimated error near kinks, and its file."""

import numpy as np
import pytest
import sympy as sp
import xarray

from geomech import scenes
from geomech.mathematics import symbolic
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.tiers import fitted
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft import Chain
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass")


def local(scene, shapes, h=2e-4):
    """Return the CCF (3, ...) of the scene's own fit at shapes (..., 2), by differences
    over 2 h of A solved there."""
    unit = connection.directions(2, fitted.directions(scene.system, scene.numerics))

    def A(alpha):
        xi = scene.system.velocity(alpha[..., None, :], unit)
        return np.einsum("jc,...ci->...ij", np.linalg.pinv(unit), xi)

    d1, d2 = ((A(shapes + step) - A(shapes - step)) / (2 * h) for step in h * np.eye(2))
    here = A(shapes)
    bracket = se2.bracket(here[..., 0], here[..., 1])
    return np.moveaxis(d1[..., 1] - d2[..., 0] + bracket, -1, 0)


@pytest.mark.parametrize(("i", "j"), [(1, 2), (1, 3), (2, 3)])
def test_every_pair_of_three_joints(i, j):
    """Against SymPy, for a connection in which no two columns are alike; pairs are
    antisymmetric."""
    a, b, c = alpha = sp.symbols("alpha_1:4", real=True)
    rows = [
        [sp.cos(a + b), b * c, 1 + a],
        [sp.sin(c), a - c, b * b],
        [1 + a * b, 2 + c, sp.cos(a) - b],
    ]
    A = sp.Matrix(rows)
    axes = (np.linspace(-0.5, 0.6, 13),) * 3
    fitted = connection.fit(symbolic.velocity(A, alpha), axes, 16, degree=5)
    formula = sp.lambdify(alpha, list(symbolic.ccf(A, alpha, i, j)), "numpy")
    exact = np.broadcast_arrays(*formula(*np.meshgrid(*axes, indexing="ij")))
    found = curvature.ccf(fitted, i, j).values
    np.testing.assert_allclose(found, exact, atol=1e-6)
    np.testing.assert_allclose(curvature.ccf(fitted, j, i).values, -found, atol=1e-14)
    error = curvature.error(fitted, i, j).values
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
    """At random grid points, each component, in a share of ``least``; and in the median
    by no more than ``most`` errors."""
    scene = scenes.load(name).with_numerics(**numerics)
    study = SceneTables(scene)
    i, j = np.random.default_rng(4).integers(0, scene.numerics.grid, (2, 300))
    first, second = study.fitted.axes
    truth = local(scene, np.stack([first[i], second[j]], -1))
    estimate = study.curvature_error.values[:, i, j]
    error = np.abs(study.curvature.values[:, i, j] - truth)
    assert ((error <= estimate + 1e-12).mean(1) >= least).all()
    assert (np.median(estimate / np.maximum(error, 1e-16), 1) <= most).all()


@pytest.mark.parametrize(("length", "unit"), [(None, "BL"), (0.4, "m")])
def test_files_have_values_units_and_conventions(tmp_path, length, unit):
    body = Chain((1, 2, 3), length=length, frame="link-2")
    study = SceneTables(GLASS.changed(body=body).with_numerics(grid=4, extent=2.0))
    fields.save_connection(tmp_path / "a.nc", study)
    per = f"{unit}/rad, {unit}/rad, rad/rad"
    per2 = f"{unit}/rad2, {unit}/rad2, rad/rad2"
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        data.load()
    for name, values, units in (
        ("A", study.fitted.A, per),
        ("fit_residual", study.fitted.residual, per),
        ("ccf", study.curvature.values, per2),
        ("ccf_error", study.curvature_error.values, per2),
        ("alpha_2", study.fitted.axes[1], "rad"),
    ):
        np.testing.assert_array_equal(data[name], values)
        assert data[name].attrs["units"] == units
    assert (data.frame, data.length_unit) == ("link-2", unit)
    assert data.sign_of_A == "xi = + A alphadot"
