"""What results say of themselves: a line, HTML and pictures for notebooks, data sets of
xarray."""

import dataclasses
import itertools
import pickle
import re
import sys

import numpy as np
import pytest
import xarray
from matplotlib import pyplot

import geomech
import rft
from geomech import plots
from geomech.core import summary
from geomech.mathematics.gaits import Ellipse
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Numerics, Scene
from geomech.shell import notebook
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.laws import CATALOGUE

pytestmark = pytest.mark.usefixtures("fastest")
GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2))
UNEVEN = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
PNG = b"\x89PNG\r\n"


@pytest.fixture(scope="module")
def study():
    swimmer = Swimmer(CATALOGUE["glass-0.3mm-loose"].medium, UNEVEN)
    numerics = Numerics(grid=7, extent=2.0, harmonics=5)
    tables = SceneTables(Scene(swimmer, GAIT, numerics))
    tables.compute_field()
    return tables


@pytest.fixture(scope="module")
def table(study):
    return study.displacements([0.5, 1.0, 1.5], ["area", "direct"])


def told(thing, quantity):
    """Return the numbers that the repr of a thing tells of a quantity: one, or its
    least and most."""
    number = r"(-?[\d.]+(?:e-?\d+)?)"
    pattern = rf"{quantity} {number}(?: to {number})?"
    found = re.search(pattern, repr(thing))
    return [float(x) for x in found.groups() if x]


def test_a_repr_tells_the_ranges_of_what_it_shows(study):
    cycle = study.scene.cycle(phases=32, work=True)
    shown = [
        (cycle, "x", cycle.net[..., :1]),
        (cycle, "theta", cycle.net[..., 2:]),
        (cycle.work, "power", cycle.work.power),
        (cycle.work, "slip", cycle.work.slip),
        (study.fitted, "A x", study.fitted.A[0]),
        (study.curvature, "theta", study.curvature.values[2]),
    ]
    for thing, quantity, values in shown:
        numbers = told(thing, quantity)
        limits = [np.min(values), np.max(values)][: len(numbers)]
        assert numbers == pytest.approx(limits, rel=5e-3), (quantity, repr(thing))


def test_nothing_is_computed_to_show_a_study(study):
    fresh = SceneTables(study.scene)
    assert "nothing yet" in notebook.study(fresh)
    assert fresh.computed == ()


def test_data_sets_are_those_of_the_files(study, tmp_path):
    fields.save_connection(tmp_path / "a.nc", study)
    fitted = study.fitted.to_xarray()
    curvature = study.curvature.to_xarray().to_dataset()
    assert {*fitted} == {"A", "fit_residual", "xi_rms"} and {*curvature} == {"ccf"}
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        for name, variable in {**fitted, **curvature}.items():
            xarray.testing.assert_equal(variable, data[name])
            assert variable.attrs == data[name].attrs


def of_length(length):
    """Return the study of a swimmer in an uncertain medium, and its displacements."""
    sand = rft.Granular(C=1.5, gamma0=0.22, covariance=((0.02, 0.001), (0.001, 0.002)))
    body = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=length)
    gait = dataclasses.replace(GAIT, frequency=2.5)
    numerics = Numerics(grid=7, extent=2.0, phases=32)
    tables = SceneTables(Scene(Swimmer(sand, body), gait, numerics))
    return tables, tables.displacements([0.5, 1.0], ["area", "path", "direct"])


def units_of(variable):
    return np.atleast_1d(variable.unit).tolist()


def assert_scaled(found, plain, length):
    """Assert that variables are those of a body of length 1, times its length where
    their unit has an m."""
    for variable in found.variables:
        if variable.values.dtype.kind != "f" or variable.name == "seconds":
            continue
        factors = [length if u.startswith("m") else 1.0 for u in units_of(variable)]
        factor = np.array(factors).reshape(
            -1, *np.ones(max(variable.values.ndim - 1, 0), int)
        )
        for name in ("values", "error", "spread"):
            expected = getattr(plain[variable.name], name)
            if expected is not None:
                given = getattr(variable, name)
                np.testing.assert_allclose(given, expected * factor, 1e-6, 1e-13)


def test_lengths_of_a_table_are_in_the_unit_that_is_told_beside_them():
    _, plain = of_length(None)
    _, table = of_length(7.5)
    units = {*itertools.chain(*map(units_of, table.variables))}
    assert units == {"", "m", "m/s", "BL/s", "rad", "rad/s", "rad2", "s", "1"}
    assert plain["x"].unit == "BL"
    assert_scaled(table, plain, 7.5)


def test_lengths_of_a_sweep_are_in_the_unit_that_is_told_beside_them():
    one, _ = of_length(None)
    long, _ = of_length(7.5)
    over = {"gait.amplitude": [0.5]}
    swept = geomech.sweep(long.scene, over)
    assert_scaled(swept, geomech.sweep(one.scene, over), 7.5)
    # Of lengths that are swept, though the scene itself has none.
    sized = geomech.sweep(one.scene, {"body.length": [1.0, 7.5], **over})
    assert (sized["x"].unit, swept["x"].unit) == ("m", "m")
    np.testing.assert_allclose(sized["x"].error[1], swept["x"].error, rtol=1e-6)


FIELDS = {
    "fitted": lambda s: s.fitted,
    "field": lambda s: s.fitted.field,
    "half": lambda s: s.fitted.half(0),
    "curvature": lambda s: s.curvature,
    "its error": lambda s: s.curvature_error,
    "two-form": lambda s: s.two_form.field,
    "frame": lambda s: s.in_frame("minimum-perturbation").fitted,
    "frame's field": lambda s: (
        s.in_frame("minimum-perturbation").scene.system.field.field
    ),
    "plane": lambda s: s.plane((1, 2)).connection,
    "ccf of a plane": lambda s: s.plane((2, 1)).ccf,
    "slice": lambda s: s.two_form.slice(1, 2, [0.1, 0.2]),
    "pickled": lambda s: pickle.loads(pickle.dumps(s.fitted)),
}


def test_fields_carry_their_unit():
    short, _ = of_length(0.42)
    for name, made in FIELDS.items():
        value = made(short)
        assert (value.unit, value.length) == ("m", 0.42), name


def own(alpha, alphadot):
    """A velocity that turns with the second joint alone."""
    along = alphadot[..., :1] * [0.2, 0.1, 0.0]
    return along + np.sin(alpha[..., 1:]) * alphadot[..., 1:]


@pytest.mark.parametrize(
    ("said", "unit"), [({}, "length"), ({"unit": "m", "length": 0.42}, "m")]
)
def test_no_unit_is_made_up(said, unit):
    """A custom velocity is a length until its unit is said."""
    fitted = connection.fit(own, connection.grid(2, 7, 1.0), **said)
    assert (fitted.unit, fitted.length) == (unit, said.get("length"))
    assert fitted.to_xarray().A.units == f"{unit}/rad, {unit}/rad, rad/rad"
    bar = plots.ccf_map(curvature.ccf(fitted)).figure.axes[1]
    assert bar.get_ylabel() == f"CCF$_{{x}}$ ({unit}/rad$^2$)"


def test_without_xarray_it_is_said(study, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(
        ImportError, match="needs the package xarray: pip install xarray"
    ):
        study.fitted.to_xarray()


DRAW = {
    "ccf": lambda study, table, **where: plots.ccf_map(study.curvature, **where),
    "field": lambda study, table, **where: plots.vector_field(study.fitted, **where),
    "table": lambda study, table, **where: plots.displacement(table, **where),
    "gait": lambda study, table, **where: plots.draw_gait(GAIT, **where),
}


@pytest.mark.parametrize("name", DRAW)
def test_plots_draw_where_they_stand(name, study, table):
    """On the Axes given; else on pyplot's current ones, if there is a figure of pyplot;
    else on new ones that show."""
    draw = DRAW[name]
    pyplot.close("all")
    ax = draw(study, table)
    assert pyplot.get_fignums() == [] and ax._repr_png_().startswith(PNG)
    figure, (first, second) = pyplot.subplots(1, 2)
    assert draw(study, table, ax=first) is first
    assert not second.lines and not second.collections
    pyplot.sca(second)
    assert draw(study, table) is second and pyplot.gcf() is figure
    pyplot.close("all")


def test_of_places_that_are_alike_but_for_rounding_the_first_is_named():
    values = np.array([[0.1, 0.3], [0.3 * (1 + 1e-15), np.nan]])
    assert summary.first_place(values, np.nanmax(values)) == (0, 1)
    assert summary.first_place(-values, np.nanmin(-values)) == (0, 1)
