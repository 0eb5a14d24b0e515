"""What results say of themselves: a line, HTML and pictures for notebooks, data sets of xarray."""

import base64
import builtins
import inspect
import json
import pickle
import re
import sys

import numpy as np
import pytest
import xarray
from registry import SYSTEMS
from tabled import swept_table, tabled

import geomech
import rft
from geomech import Study, plots
from geomech.app import Displacements
from geomech.gaits import Circle, Ellipse
from geomech.geometry import connection, curvature
from geomech.io.results import write_netcdf
from geomech.scenes import Numerics, Scene, load
from geomech.studies import fields, sweep, tables
from geomech.systems import NoSlipSnake, Swimmer
from rft.laws import CATALOGUE

pytestmark = pytest.mark.usefixtures("fastest")
GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2))
UNEVEN = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
PNG = b"\x89PNG\r\n"


@pytest.fixture(scope="module")
def study():
    made = Study(
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
    return tabled(study.displacements([0.5, 1.0, 1.5], ["area", "direct"]))


@pytest.fixture(scope="module")
def swept(study):
    return swept_table(
        geomech.sweep(
            study.scene, {"gait.amplitude": [0.5, 1.0, 1.2], "body.length": [0.3, 0.6]}
        )
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
    assert told.startswith("Passed(11 poses, t 0 to 10 s; force x -") and told.endswith(
        " W)"
    )
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
        (
            swept,
            "Swept(scene over gait.amplitude (3: 0.5 to 1.2) x body.length (2: 0.3 to 0.6); net x ",
        ),
    ):
        text = repr(value)
        assert len(text) < 600 and "\n" not in text
        assert [x for x in said if x not in text] == [], text
    assert re.search(r"; residual up to \d\.\de-\d\d; with work\)$", repr(cycle))
    assert repr(table).splitlines()[0].startswith("scene: displacement per cycle (m)")
    snake = Study(Scene(NoSlipSnake(), GAIT, Numerics(grid=7)))
    assert "rad; 7 singular; A x" in repr(snake.fitted) and " singular; values" in repr(
        snake.curvature
    )
    three = Study(
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
    from geomech.gaits import Fourier

    return Fourier(cos=((0.2,), (0.1,), (0.0,)), sin=((0.0,), (0.3,), (0.4,)))


def pictures(html):
    return [
        base64.b64decode(x)
        for x in re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    ]


def test_notebooks_get_tables_and_pictures(study, table, swept):
    for value in (study.fitted, study.curvature, swept):
        html = value._repr_html_()
        (picture,) = pictures(html)
        assert (
            picture.startswith(PNG) and html.count("<div>") == html.count("</div>") == 1
        )
    html = table._repr_html_()
    cells = re.findall(r"<t[hd]>(.*?)</t[hd]>", html)
    assert cells[:3] == ["amplitude", "tier", "x (m)"] and len(cells) == 7 * (1 + 3 * 2)
    assert [float(x) for x in cells[9:12]] == pytest.approx(
        table["area"][0], rel=1e-3, abs=1e-9
    )
    fresh = Study(study.scene)
    assert pictures(fresh._repr_html_()) == [] and "nothing yet" in fresh._repr_html_()
    assert fresh.computed == ()  # nothing is computed to be shown
    assert (
        study.curvature.values is not None and study.curvature_error.values is not None
    )
    assert len(pictures(study._repr_html_())) == 1
    assert "<script>" not in Study(study.scene.changed(name="<script>"))._repr_html_()
    none = {"area": np.zeros((50, 3))}, {"area": np.zeros((50, 2))}
    many = Displacements(
        tables.result(study.scene, GAIT, [0.1] * 50, *none)
    )._repr_html_()
    assert many.count("<tr>") == 41 and "and 10 rows more" in many


def test_results_remain_dicts(study, table, swept):
    assert isinstance(table, dict) and json.loads(json.dumps(table)) == dict(table)
    again = pickle.loads(pickle.dumps(table))
    assert again == table and again.scene == study.scene
    assert set(swept) == {
        "over",
        "displacement",
        "estimate",
        "estimate_heading",
        "length",
        "units",
    }


def test_data_sets_are_those_of_the_files(study, swept, tmp_path):
    fields.save_connection(tmp_path / "a.nc", study)
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        xarray.testing.assert_identical(study.to_xarray(), data.load())
        for mine in (
            study.fitted.to_xarray(),
            study.curvature.to_xarray().to_dataset(),
        ):
            assert {"A", "fit_residual", "speed"} == set(mine) or {"ccf"} == set(mine)
            for name in mine:
                xarray.testing.assert_identical(mine[name], data[name])
    modes = Swimmer(rft.Viscous(2.0), rft.Chain(modes=((1.0, 0.5), (0.2, -0.9))))
    moved = Study(Scene(modes, GAIT).with_numerics(grid=7, phases=16))
    for data in (moved.to_xarray(), moved.fitted.to_xarray(shapes=["m_1", "m_2"])):
        assert [data[f"alpha_{k}"].long_name for k in (1, 2)] == [
            "shape variable m_1",
            "shape variable m_2",
        ]
    write_netcdf(tmp_path / "b.nc", sweep.as_stored(swept.result))
    with xarray.open_dataset(tmp_path / "b.nc") as data:
        xarray.testing.assert_identical(swept.to_xarray(), data.load())
    bare = Study(Scene(SYSTEMS["table"], GAIT))
    fields.save_connection(tmp_path / "c.nc", bare)
    with xarray.open_dataset(tmp_path / "c.nc") as data:
        xarray.testing.assert_identical(bare.to_xarray(), data.load())
    other = study.fitted.field.to_xarray("A")
    assert (
        other.dims == ("dimension_0", "dimension_1", "alpha_1", "alpha_2")
        and other.name == "A"
    )


def test_displacements_as_a_data_set(study, table):
    data = table.to_xarray()
    assert data.displacement.dims == ("tier", "amplitude", "component")
    assert (
        data.displacement.sel(tier="area", amplitude=1.0, component="y")
        == table["area"][1][1]
    )
    np.testing.assert_array_equal(
        data.estimate.sel(tier="direct"), table["estimate"]["direct"]
    )
    np.testing.assert_array_equal(
        data.estimate_heading.sel(tier="area"), table["estimate_heading"]["area"]
    )
    assert (
        data.displacement.units == "m (x, y), rad (theta)"
        and data.estimate.units == "m"
    )
    assert (
        data.amplitude.long_name == GAIT.amplitude_label
        and data.attrs["frame"] == "link-1"
    )
    one = study.displacement([0.5, 1.0], tolerance=1e-2)
    assert one.to_xarray().tier.values == [one["tier"]]
    assert "displacement per cycle" in repr(one) and one["tier"] in one._repr_html_()


def of_length(length):
    """Studies and their tables, of the same swimmer and gait with a frequency in an uncertain medium, but for its length."""
    sand = rft.Granular(C=1.5, gamma0=0.22, covariance=((0.02, 0.001), (0.001, 0.002)))
    gait = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2), frequency=2.5)
    body = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=length)
    made = Study(
        Scene(Swimmer(sand, body), gait, Numerics(grid=7, extent=2.0, phases=32))
    )
    return made, tabled(made.displacements([0.5, 1.0], ["area", "path", "direct"]))


def law_of_units(values, units, plain, length, key=""):
    """values (...) in ``units`` are those of a body of length 1 times its length, once for each m; the rest are the same."""
    if isinstance(values, dict):
        assert values.keys() == plain.keys()
        for name, x in values.items():
            law_of_units(x, units, plain[name], length, name)
        return
    times = [
        length if u.partition("/")[0] == "m" else 1.0 for u in np.atleast_1d(units)
    ]
    tolerance = 1e-6 if key != "direct" else 1e-9
    np.testing.assert_allclose(
        values,
        np.array(plain) * (times if len(times) > 1 else times[0]),
        tolerance,
        1e-13,
    )


def test_what_leaves_the_library_has_one_unit_and_says_it():
    """Of a body of another length than 1: every number of a table, of a sweep and of their data sets is in the unit that is
    told beside it, and these units are one, but for speeds in body lengths; so are pictures and what a notebook shows."""
    length = 7.5
    (one, plain), (made, table) = of_length(1.0), of_length(length)
    units, no_units = (
        table["units"],
        {"units", "seconds", "kept", "zero_by_symmetry", "medium_error_rule"},
    )
    no_units |= {"area", "path", "direct"}
    lengths = {u for u in units.values() if "m" in u.split("/")[0].split() or "BL" in u}
    assert lengths == {"m", "m/s", "BL/s"} and [
        k for k, u in units.items() if u == "BL/s"
    ] == ["speed_body_lengths"]
    assert table["body_length"] == length and plain["units"]["estimate"] == "BL"
    for key in (
        set(table) - no_units - {"medium_error_of", "medium_shift_of", "amplitude"}
    ):
        law_of_units(table[key], units[key], plain[key], length)
    for key in ("area", "path", "direct"):
        law_of_units(table[key], ["m", "m", "rad"], plain[key], length)
    for key in ("x", "y", "net_distance", "heading"):
        for of in ("medium_error_of", "medium_shift_of"):
            law_of_units(table[of][key], units[key], plain[of][key], length)

    data = table.to_xarray()
    assert (data.attrs["body_length"], data.attrs["length_unit"]) == (length, "m")
    assert {v.units for v in data.data_vars.values()} == {
        "m", "rad", "m (x, y), rad (theta)", "m s-1", "body length s-1", "rad s-1"
    }  # fmt: skip
    cells = re.findall(r"<t[hd]>(.*?)</t[hd]>", table._repr_html_())
    assert cells[2:8] == [
        "x (m)",
        "y (m)",
        "heading (rad)",
        "error (m)",
        "error of heading (rad)",
        "medium (m)",
    ]
    assert float(cells[15]) == pytest.approx(table["estimate"]["area"][0], rel=0.06)

    drawn = plots.displacement_figure({"ellipse": table}, [made.scene.gait]).axes[0]
    for shade, tier in zip(drawn.collections, ("area", "path", "direct")):
        x, y = shade.get_paths()[0].vertices.T
        halves = [np.ptp(y[x == a]) / 2 for a in table["amplitude"]]
        np.testing.assert_allclose(halves, table["estimate"][tier], rtol=1e-6)
    assert drawn.get_ylabel() == "x per cycle (m)"

    over = {"gait.amplitude": [0.5, 1.0], "medium.C": [1.5]}
    swept, unswept = (swept_table(geomech.sweep(s.scene, over)) for s in (made, one))
    assert (
        swept["units"]["estimate"] == "m"
        and (swept["length"] == length).all()
        and "m, rad" in repr(swept)
    )
    for key, unit in swept["units"].items():
        law_of_units(swept[key], unit, unswept[key], length)
    every = swept_table(
        geomech.sweep(
            one.scene, {"body.length": [1.0, length], "gait.amplitude": [0.5]}
        )
    )
    assert every["units"]["displacement"] == [
        "m",
        "m",
        "rad",
    ]  # though the scene itself has no size
    np.testing.assert_allclose(
        every["estimate"][1], swept["estimate"][:1, 0], rtol=1e-6
    )
    np.testing.assert_array_equal(every["length"], [[1.0], [length]])
    assert every.to_xarray().estimate.units == every.to_xarray().length.units == "m"


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
    assert made.curvature.to_xarray().units == "m rad-2 (x, y), rad rad-2 (theta)"


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
    kept = Study(Scene(Kept(), Circle(amplitude=0.5), Numerics(phases=16)))
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
        data.A.units == "length rad-1 (x, y), rad rad-1 (theta)"
        and "length_unit" not in data.attrs
    )
    for fitted, unit in ((bare, "length"), (said, "m")):
        assert (
            plots.ccf_map(curvature.ccf(fitted)).figure.axes[1].get_ylabel()
            == f"CCF$_{{x}}$ ({unit}/rad$^2$)"
        )
    told = {"amplitude": [0.5, 1.0], "direct": [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]}
    assert plots.displacement(told).get_ylabel() == "x per cycle (length)"
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


def test_speeds_and_what_the_medium_does_are_shown_too():
    sand = rft.Granular(C=1.5, gamma0=0.22, covariance=((0.02, 0.001), (0.001, 0.002)))
    gait = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2), frequency=2.5)
    made = tabled(
        Study(Scene(Swimmer(sand, UNEVEN), gait, Numerics(phases=32))).displacements(
            [0.5, 1.0], ["direct"]
        )
    )
    data = made.to_xarray()
    for key, units in (
        ("speed", "m s-1"), ("speed_body_lengths", "body length s-1"), ("turning_rate", "rad s-1"),
        ("medium_error", "m"), ("medium_error_heading", "rad"),
    ):  # fmt: skip
        np.testing.assert_array_equal(data[key].sel(tier="direct"), made[key]["direct"])
        assert data[key].units == units and (data[key] != 0).all()
    assert data.attrs["frequency"] == 2.5
    cells = re.findall(r"<t[hd]>(.*?)</t[hd]>", made._repr_html_())
    assert cells[7:10] == ["medium (m)", "medium, heading (rad)", "speed (m/s)"]
    assert float(cells[19]) == pytest.approx(made["speed"]["direct"][0], rel=1e-3)
