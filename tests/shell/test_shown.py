"""What results say of themselves: a line, HTML and pictures for notebooks, data sets of xarray."""

import base64
import builtins
import inspect
import pickle
import re
import sys

import numpy as np
import pytest
import xarray

import geomech
import rft
from geomech import plots
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.systems import NoSlipSnake, Swimmer
from geomech.scenes import Numerics, Scene, load
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.laws import CATALOGUE

pytestmark = pytest.mark.usefixtures("fastest")
GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2))
UNEVEN = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
PNG = b"\x89PNG\r\n"


@pytest.fixture(scope="module")
def study():
    made = SceneTables(
        Scene(
            Swimmer(CATALOGUE["glass-0.3mm-loose"].medium, UNEVEN),
            GAIT,
            Numerics(grid=7, extent=2.0, harmonics=5),
        )
    )
    made.compute_field()
    return made


@pytest.fixture(scope="module")
def table(study):
    return study.displacements([0.5, 1.0, 1.5], ["area", "direct"])


@pytest.fixture(scope="module")
def swept(study):
    return geomech.sweep(
        study.scene, {"gait.amplitude": [0.5, 1.0, 1.2], "body.length": [0.3, 0.6]}
    )


def test_an_intrusion_is_told_in_a_line():
    told = repr(load("half-cylinder").run())
    assert told.startswith(
        "Intrusion(11 poses, t 0 to 1 s; force x -"
    ) and told.endswith(" W)")
    assert "nothing" not in told and len(told) < 160


def test_an_intrusion_of_a_mesh_is_told_in_a_line():
    found = load("sphere").changed(triangles=80).run()
    told = repr(found)
    assert told.startswith(
        "MeshIntrusion(11 poses, t 0 to 10 s; force x -"
    ) and told.endswith(" W)")
    assert (
        f"z {found.force[:, 2].min():.3g}" in told
        and f"y {found.moment[:, 1].min():.3g}" in told
    )
    assert "nothing" not in told and "\n" not in told and len(told) < 250


def test_reprs_are_short_and_say_shapes_ranges_and_units(study, table, swept):
    system, alpha = study.scene.system, np.zeros((5, 2))
    cycle = study.scene.cycle(phases=32, work=True)
    steps = Swimmer(system.medium, rft.Chain(), (rft.Transient(0.1),)).time_steps(
        *Circle().cycle(16), 2, work=True
    )
    for value, *said in (
        (
            study.fitted,
            "Connection(7 x 7 shapes, alpha_1 and alpha_2 from -2 to 2 rad; A x -",
            "; fit leaves x ",
            " % of the rms",
        ),
        (study.curvature, "Field(3 components on 7 x 7 shapes", "theta "),
        (
            study.table("harmonic"),
            "Harmonics(7 x 7 shapes",
            "odd, up to 5",
            "fit leaves",
        ),
        (
            study.table("adapted"),
            "Family(25 curves of Ellipse(",
            "amplitudes 0 to 1",
            "128 phases",
        ),
        (
            system.solve(alpha, alpha + 1),
            "Solution((5,) samples: 5 sliding; residual up to",
        ),
        (system.solve([0.3, 0.2], [1, 0]), "Solution(xi = (", "stuck, residual"),
        (cycle, "Cycle(1 gait of 32 phases, net x ", "with work"),
        (cycle.work, "Work((32,) samples of 2 joints; power "),
        (steps, "TimeSteps(1 gait of 16 phases, 2 cycles: 1 "),
        (study.scene, "Scene(scene: Swimmer(medium=Granular(C=1.8", "grid=7"),
        (
            study,
            "Study(Scene(",
            "tiers area, adapted, path, harmonic, direct; computed: ",
            "connection",
        ),
    ):
        text = repr(value)
        assert len(text) < 600 and "\n" not in text
        assert [x for x in said if x not in text] == [], text
    assert re.search(r"; residual up to \d\.\de-\d\d; with work\)$", repr(cycle))
    assert repr(table).splitlines()[0].startswith("scene: displacement per cycle")
    snake = SceneTables(Scene(NoSlipSnake(), GAIT, Numerics(grid=7)))
    assert "rad; 7 singular; A x" in repr(snake.fitted) and " singular; values" in repr(
        snake.curvature
    )
    three = SceneTables(
        Scene(
            Swimmer(rft.Viscous(), rft.Chain((1, 1, 1, 1))),
            rft_wave(),
            Numerics(grid=4, extent=1.0),
        )
    )
    assert "4 x 4 x 4 shapes, alpha_1 to alpha_3 from -1 to 1 rad" in repr(three.fitted)
    assert (
        "fit leaves x 0 %, y 0 %, theta 0 %" in repr(three.fitted)
        and "<img" not in three.fitted._repr_html_()
    )


def rft_wave():
    from geomech.mathematics.gaits import Fourier

    return Fourier(cos=((0.2,), (0.1,), (0.0,)), sin=((0.0,), (0.3,), (0.4,)))


def pictures(html):
    return [
        base64.b64decode(x)
        for x in re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    ]


def test_notebooks_get_tables_and_pictures(study, table):
    for value in (study.fitted, study.curvature):
        html = value._repr_html_()
        (picture,) = pictures(html)
        assert picture.startswith(PNG)
        assert html.count("<div>") == html.count("</div>") == 1
    html = table._repr_html_()
    cells = re.findall(r"<t[hd]>(.*?)</t[hd]>", html)
    assert cells[:3] == ["amplitude", "x (m)", "+- error"]
    assert float(cells[7]) == 0.5
    x = table["x"].values[1, 0]
    assert float(cells[8]) == pytest.approx(x, rel=1e-3, abs=1e-9)
    from geomech.shell import notebook

    fresh = SceneTables(study.scene)
    assert pictures(notebook.study(fresh)) == []
    assert "nothing yet" in notebook.study(fresh)
    assert fresh.computed == ()  # nothing is computed to be shown
    assert study.curvature.values is not None
    assert study.curvature_error.values is not None
    assert len(pictures(notebook.study(study))) == 1
    named = SceneTables(study.scene.changed(name="<script>"))
    assert "<script>" not in notebook.study(named)


def test_data_sets_are_those_of_the_files(study, tmp_path):
    fields.save_connection(tmp_path / "a.nc", study)
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        data.load()
        for mine in (
            study.fitted.to_xarray(),
            study.curvature.to_xarray().to_dataset(),
        ):
            assert {"A", "fit_residual", "xi_rms"} == set(mine) or {"ccf"} == set(mine)
            for name in mine:
                xarray.testing.assert_equal(mine[name], data[name])
                assert mine[name].attrs == data[name].attrs
    modes = Swimmer(rft.Viscous(2.0), rft.Chain(modes=((1.0, 0.5), (0.2, -0.9))))
    moved = SceneTables(Scene(modes, GAIT).with_numerics(grid=7, phases=16))
    data = moved.fitted.to_xarray(shapes=["m_1", "m_2"])
    names = ["shape variable m_1", "shape variable m_2"]
    assert [data[f"alpha_{k}"].long_name for k in (1, 2)] == names
    other = study.fitted.field.to_xarray("A")
    assert other.dims == ("dimension_0", "dimension_1", "alpha_1", "alpha_2")
    assert other.name == "A"


def of_length(length):
    """Studies and their tables, of the same swimmer and gait with a frequency in an uncertain medium, but for its length."""
    sand = rft.Granular(C=1.5, gamma0=0.22, covariance=((0.02, 0.001), (0.001, 0.002)))
    gait = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2), frequency=2.5)
    body = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=length)
    numerics = Numerics(grid=7, extent=2.0, phases=32)
    made = SceneTables(Scene(Swimmer(sand, body), gait, numerics))
    return made, made.displacements([0.5, 1.0], ["area", "path", "direct"])


def law_of_units(found, plain, length):
    """Variables are those of a body of length 1 times its length where their unit has an m;
    the rest are the same."""
    for variable in found.variables:
        if variable.values.dtype.kind != "f" or variable.name == "seconds":
            continue
        units = np.atleast_1d(variable.unit)
        factors = [length if u.partition("/")[0] == "m" else 1.0 for u in units]
        if len(factors) > 1:
            factors = np.array(factors)[:, None]
        else:
            (factors,) = factors
        other = plain[variable.name]
        for name in ("values", "error", "spread"):
            mine, its = getattr(variable, name), getattr(other, name)
            if mine is not None:
                told = f"{variable.name} {name}"
                np.testing.assert_allclose(
                    mine, its * factors, 1e-6, 1e-13, err_msg=told
                )


def test_what_leaves_the_library_has_one_unit_and_says_it():
    """Of a body of another length than 1 every number of a table and of a sweep is in the
    unit that is told beside it, and these units are one, but for speeds in body lengths."""
    length = 7.5
    (one, plain), (made, table) = of_length(None), of_length(length)
    lengths = {u for v in table.variables for u in np.atleast_1d(v.unit)}
    assert lengths == {"", "m", "m/s", "BL/s", "rad", "rad/s", "rad2", "s", "1"}
    assert [v.name for v in table.variables if v.unit == "BL/s"] == [
        "speed_body_lengths"
    ]
    facts = table.attributes
    assert (facts["body_length"], facts["length_unit"]) == (length, "m")
    assert plain["x"].unit == "BL"
    law_of_units(table, plain, length)

    drawn = plots.displacement_figure({"ellipse": table}).axes[0]
    for k, shade in enumerate(drawn.collections[:3]):
        x, y = shade.get_paths()[0].vertices.T
        halves = [np.ptp(y[x == a]) / 2 for a in table["amplitude"].values]
        np.testing.assert_allclose(halves, table["x"].error[k], rtol=1e-6)
    assert drawn.get_ylabel() == "x per cycle (m)"

    over = {"gait.amplitude": [0.5, 1.0], "medium.C": [1.5]}
    swept, unswept = (geomech.sweep(s.scene, over) for s in (made, one))
    assert swept["x"].unit == "m" and (swept["body_length"].values == length).all()
    law_of_units(swept, unswept, length)
    sizes = {"body.length": [1.0, length], "gait.amplitude": [0.5]}
    every = geomech.sweep(one.scene, sizes)
    assert every["x"].unit == "m"  # though the scene itself has no size
    np.testing.assert_allclose(every["x"].error[1], swept["x"].error[0], rtol=1e-6)
    np.testing.assert_array_equal(every["body_length"].values, [1.0, length])


def test_fields_carry_their_unit_and_figures_take_it_from_them():
    made, length = of_length(0.42)[0], 0.42
    fitted, frame = made.fitted, made.in_frame("minimum-perturbation")
    for value in (
        fitted, fitted.field, fitted.half(0), made.curvature, made.curvature_error, made.two_form.field, frame.fitted,
        frame.curvature, frame.scene.system.field.field, made.plane((0, 1)).connection, made.plane((1, 0)).ccf,
        made.two_form.slice(0, 1, [0.1, 0.2]), pickle.loads(pickle.dumps(fitted)),
    ):  # fmt: skip
        assert (value.unit, value.length) == ("m", length)
        assert repr(value).endswith(f"; lengths in m, the body's {length:g})")
    labels = [ax.get_ylabel() for ax in plots.ccf_figure(made.curvature).axes[3:]]
    assert [x.partition("(")[2] for x in labels] == [
        "m/rad$^2$)",
        "m/rad$^2$)",
        "rad/rad$^2$)",
    ]
    labels = [ax.get_ylabel() for ax in plots.connection_figure(fitted).axes[3:]]
    assert [x.partition("(")[2] for x in labels] == ["m/rad)", "m/rad)", "rad/rad)"]
    for draw in (plots.ccf_map, plots.ccf_contours, plots.ccf_surface):
        ax = draw(made.curvature)
        told = [
            ax.get_title(),
            *(x.get_ylabel() for x in ax.figure.axes),
            getattr(ax, "get_zlabel", str)(),
        ]
        assert sum("(m/rad$^2$)" in x for x in told) == 1, told
    assert (
        "(m)" in plots.frame_figure(frame.scene.system.field.field).axes[3].get_ylabel()
    )
    data = fitted.to_xarray()
    assert (data.attrs["body_length"], data.attrs["length_unit"]) == (length, "m")
    assert made.curvature.to_xarray().units == "m/rad2, m/rad2, rad/rad2"


class Kept:
    """A system of a user's own that keeps a connection, of which it alone says the unit."""

    kind, joints, length = "kept", 2, 0.42

    near_gait = ""

    def table_error(self, alpha, alphadot):
        return np.zeros((*alpha.shape[:-2], 2))

    def table(self, name):
        axes = connection.grid(2, 7, 1.0)
        return connection.fit(self.velocity, axes) if name == "connection" else None

    def velocity(self, alpha, alphadot):
        return 0.1 * alphadot[..., :1] * [1.0, 0.5, 0.2] + np.sin(
            alpha[..., :1]
        ) * alphadot[..., 1:] * [0.1, 0.3, 0.5]


def test_a_kept_connection_has_the_unit_of_its_system():
    kept = SceneTables(Scene(Kept(), Circle(amplitude=0.5), Numerics(phases=16)))
    assert (kept.fitted.unit, kept.fitted.length, kept.curvature.unit) == (
        "m",
        0.42,
        "m",
    )


def test_no_unit_is_made_up():
    """Of a velocity of one's own nobody says it: it is told as a length until it is said."""
    own = lambda alpha, alphadot: (
        alphadot[..., :1] * np.array([0.2, 0.1, 0.0])
        + np.sin(alpha[..., 1:]) * alphadot[..., 1:]
    )
    axes = connection.grid(2, 7, 1.0)
    bare, said = (
        connection.fit(own, axes),
        connection.fit(own, axes, unit="m", length=0.42),
    )
    assert (bare.unit, bare.length) == ("length", None) and "lengths" not in repr(bare)
    data = bare.to_xarray()
    assert (
        data.A.units == "length/rad, length/rad, rad/rad"
        and "length_unit" not in data.attrs
    )
    for fitted, unit in ((bare, "length"), (said, "m")):
        assert (
            plots.ccf_map(curvature.ccf(fitted)).figure.axes[1].get_ylabel()
            == f"CCF$_{{x}}$ ({unit}/rad$^2$)"
        )
    public = [getattr(plots, name) for name in plots.__all__]
    named = {
        name for f in public if callable(f) for name in inspect.signature(f).parameters
    }
    assert not named & {"unit", "length"} - set(
        inspect.signature(plots.quantity).parameters
    )


def test_without_xarray_it_is_said(study, monkeypatch):
    found = builtins.__import__

    def none(name, *args, **kwargs):
        if name == "xarray":
            raise ImportError(name)
        return found(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", none)
    with pytest.raises(
        ImportError, match="to_xarray needs the package xarray: pip install xarray"
    ):
        study.fitted.to_xarray()


def test_plots_draw_where_they_stand(study, table):
    """On the Axes given; else on pyplot's current ones, if there is a figure of pyplot; else on new ones that show."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    pyplot.close("all")
    draw = (
        lambda **where: plots.ccf_map(study.curvature, **where),
        lambda **where: plots.vector_field(study.fitted, **where),
        lambda **where: plots.displacement(table, **where),
        lambda **where: plots.draw_gait(GAIT, **where),
    )
    for one in draw:
        ax = one()
        assert pyplot.get_fignums() == [] and ax._repr_png_().startswith(PNG)
        figure, (first, second) = pyplot.subplots(1, 2)
        assert one(ax=first) is first and not second.lines and not second.collections
        pyplot.sca(second)
        assert one() is second and pyplot.gcf() is figure
        pyplot.close("all")
    assert ax.figure._repr_png_().startswith(PNG)
    assert "matplotlib.pyplot" in sys.modules
