"""What results say of themselves: a line, HTML and pictures for notebooks, data sets of
xarray."""

import base64
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
from geomech.mathematics.gaits import Circle, Ellipse, Fourier
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.systems import NoSlipSnake, Swimmer
from geomech.scenes import Numerics, Scene, load
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


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (load("half-cylinder"), "Intrusion(11 poses, t 0 to 1 s; force x -"),
        (
            load("sphere").changed(triangles=80),
            "MeshIntrusion(11 poses, t 0 to 10 s; force x -",
        ),
    ],
)
def test_an_intrusion_is_told_in_a_line(scene, said):
    told = repr(scene.run())
    assert told.startswith(said) and told.endswith(" W)")
    assert "nothing" not in told and len(told) < 250


REPRS = {
    "fitted": lambda s: s.fitted,
    "curvature": lambda s: s.curvature,
    "harmonics": lambda s: s.table("harmonic"),
    "family": lambda s: s.table("adapted"),
    "solution": lambda s: s.scene.system.solve(np.zeros((5, 2)), np.ones((5, 2))),
    "one": lambda s: s.scene.system.solve([0.3, 0.2], [1, 0]),
    "cycle": lambda s: s.scene.cycle(phases=32, work=True),
    "work": lambda s: s.scene.cycle(phases=32, work=True).work,
    "steps": lambda s: MARCHING.time_steps(*Circle().cycle(16), 2, work=True),
    "scene": lambda s: s.scene,
    "study": lambda s: s,
    "singular": lambda s: SceneTables(SNAKE).fitted,
    "no values": lambda s: SceneTables(SNAKE).curvature,
    "three joints": lambda s: SceneTables(THREE).fitted,
}


MARCHING = Swimmer(rft.Viscous(), rft.Chain(), (rft.Transient(0.1),))


SNAKE = Scene(NoSlipSnake(), GAIT, Numerics(grid=7))


THREE = Scene(
    Swimmer(rft.Viscous(), rft.Chain((1, 1, 1, 1))),
    Fourier(cos=((0.2,), (0.1,), (0.0,)), sin=((0.0,), (0.3,), (0.4,))),
    Numerics(grid=4, extent=1.0),
)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "fitted",
            ["Connection(7 x 7 shapes, alpha_1 and alpha_2 from -2 to 2 rad; A"],
        ),
        ("fitted", ["; fit leaves x ", " % of the rms"]),
        ("curvature", ["Field(3 components on 7 x 7 shapes", "theta "]),
        ("harmonics", ["Harmonics(7 x 7 shapes", "odd, up to 5", "fit leaves"]),
        ("family", ["Family(25 curves of Ellipse(", "amplitudes 0 to 1", "128 phases"]),
        ("solution", ["Solution((5,) samples: 5 sliding; residual up to"]),
        ("one", ["Solution(xi = (", "stuck, residual"]),
        ("cycle", ["Cycle(1 gait of 32 phases, net x ", "residual up to", "with work"]),
        ("work", ["Work((32,) samples of 2 joints; power "]),
        ("steps", ["TimeSteps(1 gait of 16 phases, 2 cycles: 1 "]),
        ("scene", ["Scene(scene: Swimmer(medium=Granular(C=1.8", "grid=7"]),
        (
            "study",
            ["Study(Scene(", "tiers area, adapted, path, harmonic, direct; comp"],
        ),
        ("singular", ["rad; 7 singular; A x"]),
        ("no values", [" singular; values"]),
        ("three joints", ["4 x 4 x 4 shapes, alpha_1 to alpha_3 from -1 to 1 rad"]),
        ("three joints", ["fit leaves x 0 %, y 0 %, theta 0 %"]),
    ],
)
def test_reprs_are_short_and_say_shapes_ranges_and_units(name, said, study):
    text = repr(REPRS[name](study))
    assert len(text) < 600 and "\n" not in text
    assert [x for x in said if x not in text] == [], text


def pictures(html):
    found = re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    return [base64.b64decode(x) for x in found]


@pytest.mark.parametrize("name", ["fitted", "curvature"])
def test_a_notebook_shows_a_map_as_one_picture(name, study):
    html = getattr(study, name)._repr_html_()
    (picture,) = pictures(html)
    assert picture.startswith(PNG)
    assert html.count("<div>") == html.count("</div>") == 1


def test_a_notebook_shows_displacements_as_a_table(table):
    cells = re.findall(r"<t[hd]>(.*?)</t[hd]>", table._repr_html_())
    assert cells[:3] == ["amplitude", "x (m)", "+- error"]
    assert float(cells[7]) == 0.5
    x = table["x"].values[1, 0]
    assert float(cells[8]) == pytest.approx(x, rel=1e-3, abs=1e-9)


def test_a_notebook_shows_of_a_study_what_is_computed(study):
    fresh = SceneTables(study.scene.changed(name="<script>"))
    html = notebook.study(fresh)
    assert "nothing yet" in html and "<script>" not in html
    assert fresh.computed == ()  # nothing is computed to be shown
    assert study.curvature.values is not None
    assert study.curvature_error.values is not None
    assert len(pictures(notebook.study(study))) == 1


def test_data_sets_are_those_of_the_files(study, tmp_path):
    fields.save_connection(tmp_path / "a.nc", study)
    fitted = study.fitted.to_xarray()
    curvature = study.curvature.to_xarray().to_dataset()
    assert {*fitted} == {"A", "fit_residual", "xi_rms"} and {*curvature} == {"ccf"}
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        for name, variable in {**fitted, **curvature}.items():
            xarray.testing.assert_equal(variable, data[name])
            assert variable.attrs == data[name].attrs


def test_shape_variables_have_their_names_in_data_sets(study):
    data = study.fitted.to_xarray(shapes=["m_1", "m_2"])
    names = [data[f"alpha_{k}"].long_name for k in (1, 2)]
    assert names == ["shape variable m_1", "shape variable m_2"]


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
    of_body = [v.name for v in table.variables if v.unit == "BL/s"]
    assert of_body == ["speed_body_lengths"]
    facts = table.attributes
    assert (facts["body_length"], facts["length_unit"]) == (7.5, "m")
    assert plain["x"].unit == "BL"
    assert_scaled(table, plain, 7.5)


def test_a_picture_has_the_errors_and_the_unit_of_its_table():
    _, table = of_length(7.5)
    drawn = plots.displacement_figure({"ellipse": table}).axes[0]
    for k, shade in enumerate(drawn.collections[:3]):
        x, y = shade.get_paths()[0].vertices.T
        halves = [np.ptp(y[x == a]) / 2 for a in table["amplitude"].values]
        np.testing.assert_allclose(halves, table["x"].error[k], rtol=1e-6)
    assert drawn.get_ylabel() == "x per cycle (m)"


def test_lengths_of_a_sweep_are_in_the_unit_that_is_told_beside_them():
    one, _ = of_length(None)
    long, _ = of_length(7.5)
    over = {"gait.amplitude": [0.5, 1.0], "medium.C": [1.5]}
    swept = geomech.sweep(long.scene, over)
    assert swept["x"].unit == "m" and (swept["body_length"].values == 7.5).all()
    assert_scaled(swept, geomech.sweep(one.scene, over), 7.5)
    # Of lengths that are swept, though the scene itself has none.
    sizes = {"body.length": [1.0, 7.5], "gait.amplitude": [0.5]}
    sized = geomech.sweep(one.scene, sizes)
    assert sized["x"].unit == "m"
    np.testing.assert_allclose(sized["x"].error[1], swept["x"].error[0], rtol=1e-6)
    np.testing.assert_array_equal(sized["body_length"].values, [1.0, 7.5])


@pytest.fixture(scope="module")
def short():
    return of_length(0.42)[0]


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
    "plane": lambda s: s.plane((0, 1)).connection,
    "ccf of a plane": lambda s: s.plane((1, 0)).ccf,
    "slice": lambda s: s.two_form.slice(0, 1, [0.1, 0.2]),
    "pickled": lambda s: pickle.loads(pickle.dumps(s.fitted)),
}


@pytest.mark.parametrize("name", FIELDS)
def test_fields_carry_their_unit(name, short):
    value = FIELDS[name](short)
    assert (value.unit, value.length) == ("m", 0.42)
    assert repr(value).endswith("; lengths in m, the body's 0.42)")


def test_figures_and_data_sets_take_their_unit_from_the_field(short):
    labels = [ax.get_ylabel() for ax in plots.ccf_figure(short.curvature).axes[3:]]
    per_area = [x.partition("(")[2] for x in labels]
    assert per_area == ["m/rad$^2$)", "m/rad$^2$)", "rad/rad$^2$)"]
    labels = [ax.get_ylabel() for ax in plots.connection_figure(short.fitted).axes[3:]]
    assert [x.partition("(")[2] for x in labels] == ["m/rad)", "m/rad)", "rad/rad)"]
    data = short.fitted.to_xarray()
    assert (data.attrs["body_length"], data.attrs["length_unit"]) == (0.42, "m")
    assert short.curvature.to_xarray().units == "m/rad2, m/rad2, rad/rad2"


@pytest.mark.parametrize("draw", [plots.ccf_map, plots.ccf_contours, plots.ccf_surface])
def test_every_style_tells_the_unit_once(draw, short):
    ax = draw(short.curvature)
    told = [ax.get_title(), getattr(ax, "get_zlabel", str)()]
    told += [x.get_ylabel() for x in ax.figure.axes]
    assert sum("(m/rad$^2$)" in x for x in told) == 1, told


class Kept:
    """A custom system that keeps a connection, of which it alone says the unit."""

    kind, joints, length, near_gait = "kept", 2, 0.42, ""

    def table_error(self, alpha, alphadot):
        return np.zeros((*alpha.shape[:-2], 2))

    def table(self, name):
        axes = connection.grid(2, 7, 1.0)
        return connection.fit(self.velocity, axes) if name == "connection" else None

    def velocity(self, alpha, alphadot):
        return own(alpha, alphadot)


def own(alpha, alphadot):
    """A velocity that turns with the second joint alone."""
    along = alphadot[..., :1] * [0.2, 0.1, 0.0]
    return along + np.sin(alpha[..., 1:]) * alphadot[..., 1:]


def test_a_kept_connection_has_the_unit_of_its_system():
    kept = SceneTables(Scene(Kept(), Circle(amplitude=0.5), Numerics(phases=16)))
    assert (kept.fitted.unit, kept.fitted.length) == ("m", 0.42)
    assert kept.curvature.unit == "m"


@pytest.mark.parametrize(
    ("said", "unit"), [({}, "length"), ({"unit": "m", "length": 0.42}, "m")]
)
def test_no_unit_is_made_up(said, unit):
    """A custom velocity is a length until its unit is said."""
    fitted = connection.fit(own, connection.grid(2, 7, 1.0), **said)
    assert (fitted.unit, fitted.length) == (unit, said.get("length"))
    data = fitted.to_xarray()
    assert data.A.units == f"{unit}/rad, {unit}/rad, rad/rad"
    assert ("length_unit" in data.attrs) == bool(said)
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
