"""Figures for a page: they keep to their width, nothing leaves them or lies on
something else, and they have the units, fonts and points that they are asked for."""

import itertools
import os
import subprocess
import sys

import golden
import numpy as np
import pytest
from artists import only
from commands import geomech as command
from matplotlib.collections import QuadMesh

import geomech
from geomech import plots
from geomech.results.lengths import in_lengths
from geomech.studies.measured import synthetic

COLUMN = "3.4in"
ONE_OF_A_KIND = [  # others have more panels of the same
    "ccf",
    "ccf, stretched",
    "ccf, slices in frames",
    "connection",
    "displacement",
    "displacement, data",
    "forces",
    "trajectory",
    "sweep",
    "sweep of two",
    "walk",
    "strip",
    "intrude",
    "intrude, solid",
    "rod",
    "plates",
    "push",
    "log",
    "trial",
]


def written(figure):
    """The boxes of titles, labels and legends, by what they say."""
    found = {}
    texts = [getattr(figure, "_suptitle", None), getattr(figure, "_supxlabel", None)]
    legends = [*figure.legends]
    for ax in figure.axes:
        texts += [ax.title, ax._left_title, ax._right_title]
        legends.append(ax.get_legend())
        if ax.axison and not hasattr(ax, "get_zlim"):
            texts += [ax.xaxis.label, ax.yaxis.label]
    for k, text in enumerate(filter(None, texts)):
        if text.get_text() and text.get_visible():
            found[f"{text.get_text()} ({k})"] = text.get_window_extent()
    for k, legend in enumerate(filter(None, legends)):
        found[f"legend {k}"] = legend.get_window_extent()
    return found


def overlapping(figure):
    """Pairs of texts of which one lies on the other by more than 1.5 pixels."""
    found = []
    for (one, a), (other, b) in itertools.combinations(written(figure).items(), 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        down = min(a.y1, b.y1) - max(a.y0, b.y0)
        if min(across, down) > 1.5:
            found.append((one, other))
    return found


@pytest.mark.parametrize("name", ONE_OF_A_KIND)
def test_a_figure_fits_the_column_of_a_journal(name):
    for _, result, options in golden.pictured(name):
        figure = result.plot(**options, width=COLUMN)
    figure.draw_without_rendering()
    assert figure.get_figwidth() == 3.4
    box = figure.get_tightbbox()
    height = figure.get_figheight()
    outside = (-box.x0, -box.y0, box.x1 - 3.4, box.y1 - height)
    assert max(outside) <= 0.0
    assert overlapping(figure) == []


# A body of 0.2 m in metres.
CHAIN = geomech.bodies.Chain((1, 1, 1), length=0.2)
CIRCLE = geomech.mathematics.gaits.Circle(1.0)
STUDY = geomech.study(geomech.media.Viscous(2.0), CHAIN, CIRCLE, grid=5, phases=16)


@pytest.fixture(scope="module")
def moved():
    """Its displacements."""
    return STUDY.displacement([0.5, 1.5], ["direct"])


def test_letters_stay_text(moved, tmp_path):
    figure = moved.plot(width="86mm", font="STIXGeneral,8")
    plots.save(figure, tmp_path / "a.pdf", tmp_path / "a.svg")
    pdf = (tmp_path / "a.pdf").read_bytes()
    assert b"/Type3" not in pdf and b"STIXGeneral" in pdf
    svg = (tmp_path / "a.svg").read_text()
    assert "radius of the circle (rad)</text>" in svg and "STIXGeneral" in svg
    # As matplotlib itself writes it.
    figure.savefig(tmp_path / "b.pdf")
    assert b"/Type3" not in (tmp_path / "b.pdf").read_bytes()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"width": 3.4}, "3.4in, 3.4cm or 3.4mm"),
        ({"width": "3.4 ft"}, "86mm"),
        ({"width": "2000mm"}, "40 inches"),
        ({"unit": "yd"}, "m, cm, mm, BL"),
        ({"font": "Arail,8"}, "DejaVu Sans"),
        ({"font": "200"}, "points"),
        ({"style": "gplot"}, "'ggplot'"),
        ({"style": "none.mplstyle"}, "style file"),
        ({"legend": "left"}, "outside, inside, none"),
        ({"widht": COLUMN}, "'width'"),
        ({"cmap": "viridis"}, "component, data"),
        ({"component": ["x"], "strip": True}, "strip"),
    ],
)
def test_what_makes_no_sense_is_refused_with_what_there_is(options, told, moved):
    with pytest.raises(geomech.Refusal, match=told):
        moved.plot(**options)


def test_a_picture_takes_a_way_to_draw_and_a_style_together():
    ((_, result, _),) = golden.pictured("ccf, one")
    figure = result.plot(style="contours,grayscale", component="x", clim=0.1)
    assert not any(ax.get_label() == "<colorbar>" for ax in figure.axes)
    assert figure.rc["image.cmap"] == "gray"
    with pytest.raises(geomech.Refusal, match="'contours'"):
        result.plot(style="countours")
    with pytest.raises(geomech.Refusal, match="'vik'"):
        result.plot(cmap="vikk")
    figure = result.plot(cmap="RdBu_r", component="x")
    assert only(figure.axes[0], QuadMesh).get_cmap().name == "RdBu_r"


OWN_RC = """
import geomech
study = geomech.study("three-link-viscous", grid=5)
for options in ({}, {"font": "11"}, {"style": "own.mplstyle"}):
    ax = study.connection().plot(**options).axes[0]
    print(ax.xaxis.label.get_size(), ax.title.get_size(), ax.spines["top"].get_visible())
"""


def test_the_users_matplotlibrc_and_style_have_their_way(tmp_path):
    """A font of the call beats the style, and both beat the user's file; what neither
    sets is the project's."""
    (tmp_path / "matplotlibrc").write_text("font.size: 6\naxes.spines.top: True\n")
    (tmp_path / "own.mplstyle").write_text("font.size: 7\naxes.titlesize: 5\n")
    env = {**os.environ, "MATPLOTLIBRC": str(tmp_path / "matplotlibrc")}
    run = subprocess.run(
        [sys.executable, "-c", OWN_RC],
        cwd=tmp_path,
        env=env,
        capture_output=True,
        text=True,
        check=True,
    )
    lines = [line.split() for line in run.stdout.splitlines()]
    sizes = [[float(x) for x in line[:2]] for line in lines]
    assert sizes == [[6.0, 6.0], [11.0, 11.0], [7.0, 5.0]]


def test_legends_go_where_they_are_asked_to(moved):
    legends = {
        place: moved.plot(legend=place) for place in (None, "outside", "inside", "none")
    }
    in_panels = {
        place: sum(ax.get_legend() is not None for ax in figure.axes)
        for place, figure in legends.items()
    }
    of_figure = {place: len(figure.legends) for place, figure in legends.items()}
    assert of_figure == {None: 1, "outside": 1, "inside": 0, "none": 0}
    assert in_panels == {None: 0, "outside": 0, "inside": 1, "none": 0}


# Units


@pytest.mark.parametrize(("unit", "factor"), [("cm", 100.0), ("BL", 5.0)])
def test_lengths_are_shown_in_another_unit(unit, factor, moved):
    (ax,) = moved.plot(component="x", unit=unit).axes
    np.testing.assert_allclose(ax.lines[0].get_ydata(), factor * moved["x"].values[0])
    assert ax.get_ylabel() == f"x per cycle ({unit})"

    ccf = STUDY.ccf()
    own = only(ccf.plot(component="x").axes[0], QuadMesh)
    shown = only(ccf.plot(component="x", unit=unit).axes[0], QuadMesh)
    np.testing.assert_allclose(shown.get_array(), factor * own.get_array())
    assert f"({unit}/rad$^2$)" in shown.colorbar.ax.get_ylabel()

    track = STUDY.trajectory()
    own = track.plot(pictures=2).axes[1]
    shown = track.plot(pictures=2, unit=unit).axes[1]
    for line, other in zip(own.lines, shown.lines):
        np.testing.assert_allclose(
            other.get_xydata(), factor * line.get_xydata(), atol=1e-12
        )


def test_angles_and_the_result_itself_keep_their_units(moved):
    shown = in_lengths(moved, "mm")
    np.testing.assert_array_equal(shown["heading"].values, moved["heading"].values)
    assert moved["x"].unit == "m" and shown["loop_area"].unit == "rad2"


# Measurements


def drawn_points(figure):
    """The measured points of each panel, by its quantity."""
    found = {}
    for ax in figure.axes:
        for bars in ax.containers:
            name = ax.get_ylabel().partition(" per")[0]
            found[name] = bars.lines[0].get_xydata().tolist()
    return found


@pytest.mark.parametrize(
    ("data", "points"),
    [
        (
            {"value": [-0.02], "error": [0.01]},
            {"x": [[1, -0.02]], "net distance": [[1, 0.02]]},
        ),
        (
            {"x": [0.03], "y_cm": [4.0], "x_error": [0.01]},
            {"x": [[1, 0.03]], "y": [[1, 0.04]], "net distance": [[1, 0.05]]},
        ),
        (
            {"heading_deg": [90.0], "distance_mm": [30.0]},
            {"heading": [[1, np.pi / 2]], "net distance": [[1, 0.03]]},
        ),
    ],
)
def test_measurements_are_drawn_in_every_panel_that_has_their_quantity(
    data, points, moved
):
    figure = plots.displacement_figure(
        {"a": moved},
        components=("x", "y", "theta", "distance") if "value" not in data else (),
        data={"amplitude": [1.0], **data},
    )
    found = drawn_points(figure)
    assert {*found} == {*points}
    for name, expected in points.items():
        np.testing.assert_allclose(found[name], expected, rtol=1e-12)


def test_points_of_a_file_are_in_the_unit_of_the_figure(moved, tmp_path):
    (tmp_path / "own.csv").write_text("amplitude,x_mm,x_error_mm\n1,30,5\n")
    figure = moved.plot(data=str(tmp_path / "own.csv"), unit="cm")
    np.testing.assert_allclose(drawn_points(figure)["x"], [[1, 3]])


# Robots


def test_the_whole_robot_is_seen_wherever_it_is():
    ((_, result, _),) = golden.pictured("walk")
    for height in (-0.2, 0.3):
        z = result["z"].with_arrays(lambda x, dz=height: x + dz)
        ax = result.with_variables(z).plot().axes[3]
        robot = np.concatenate([line.get_xydata() for line in ax.lines])
        low = (ax.get_xlim()[0], ax.get_ylim()[0])
        high = (ax.get_xlim()[1], ax.get_ylim()[1])
        assert (robot >= low).all() and (robot <= high).all()


# The command line


def test_a_command_draws_for_a_page(tmp_path):
    words = ["displacement", "three-link-viscous", "--amplitudes", "0.5", "--tiers"]
    words += ["direct", "--plot", "a.svg", "--width", "3.4in", "--font", "STIXGeneral"]
    code, _, told = command(*words, cwd=tmp_path)
    assert (code, told) == (0, "")
    svg = (tmp_path / "a.svg").read_text()
    assert 'width="244.8pt"' in svg and "STIXGeneral" in svg


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--plot", "a.pdf", "--width", "3.4"], "--width"),
        (["--width", "3.4in"], "--plot"),
        (["--plot", "a.pdf", "--unit", "cm"], "length"),
    ],
)
def test_a_command_refuses_before_it_computes(options, told, tmp_path):
    code, out, error = command("ccf", "three-link-glass", *options, cwd=tmp_path)
    assert code == 2 and out == "" and told in error


def test_measurements_lie_at_their_parameter_of_a_sweep():
    swept = geomech.sweep("three-link-viscous", {"medium.ratio": [1.5, 2.0]})
    data = {"ratio": [1.7], "distance_BL": [0.03], "error": [0.01]}
    axes = swept.plot(data=data).axes[0]
    measured = axes.containers[-1]
    np.testing.assert_allclose(measured.lines[0].get_xydata(), [[1.7, 0.03]])


def test_a_speed_in_cm_of_a_robot_lies_among_its_speeds(tmp_path):
    file = tmp_path / "speeds.csv"
    file.write_text("frequency,speed (cm/s),speed_error\n2,31,2\n")
    swept = geomech.sweep("xplorer", {"gait.frequency": [2.0]})
    for unit, value, half_length in (("m", 0.31, 0.02), ("mm", 310, 20)):
        bars = swept.plot(data=file, unit=unit).axes[0].containers[-1]
        np.testing.assert_allclose(bars.lines[0].get_xydata(), [[2, value]])
        (segment,) = bars.lines[2][0].get_segments()
        np.testing.assert_allclose(np.ptp(segment[:, 1]), 2 * half_length)


def test_an_error_without_a_unit_has_that_of_its_quantity(moved):
    data = {"amplitude": [1.0], "x_cm": [2.0], "x_error": [0.5]}
    figure = moved.plot(component=["x"], data=data)
    (bars,) = [c for c in figure.axes[0].containers if "measured" in c.get_label()]
    (segment,) = bars.lines[2][0].get_segments()
    np.testing.assert_allclose(segment[:, 1], [0.015, 0.025])


# Maps on a page


@pytest.fixture(scope="module")
def study_in_fluid():
    return geomech.study("three-link-viscous", grid=9)


def maps_of(figure):
    return [ax for ax in figure.axes if ax.get_aspect() != "auto" and ax.collections]


def test_three_maps_side_by_side_fill_a_page(study_in_fluid):
    for result in (study_in_fluid.ccf(), study_in_fluid.connection()):
        figure = result.plot(width="7in")
        panels = [ax for ax in maps_of(figure) if ax.get_title()]
        widths = [ax.bbox.width / figure.dpi for ax in panels]
        assert len(widths) == 3 and min(widths) > 1.3


def test_the_name_of_a_frame_does_not_push_maps_apart(study_in_fluid):
    two = study_in_fluid.ccf(compare_frame="minimum-perturbation")
    figure = two.plot(width="7in")
    widths = [ax.bbox.width / figure.dpi for ax in maps_of(figure) if ax.get_title()]
    assert len(widths) == 6 and min(widths) > 1.0


def test_maps_between_a_legend_and_a_note_leave_no_empty_strip():
    body = geomech.bodies.Chain((1, 1, 1, 1), frame="link-2")
    gait = geomech.gaits.Wave(joints=3, amplitude=0.6)
    study = geomech.study(geomech.medium("glass-0.3mm-loose"), body, gait, grid=5)
    result = study.ccf(pair=(1, 3), compare_frame="mean")
    figure = result.plot(width="3.4in", component=["x"])
    (legend,) = figure.legends
    note = figure._supxlabel.get_window_extent()
    boxes = [ax.get_tightbbox() for ax in figure.axes if ax.get_visible()]
    above = legend.get_window_extent().y0 - max(box.y1 for box in boxes)
    below = min(box.y0 for box in boxes) - note.y1
    assert max(above, below) / figure.dpi < 0.35


# Units of what is printed


@pytest.mark.parametrize(
    ("ask", "name", "unit", "factor"),
    [
        (lambda: geomech.intrude("c-leg"), "moment", "N mm", 1e3),
        (lambda: geomech.walk("xplorer"), "speed", "mm/s", 1e3),
        (
            lambda: geomech.forces("sandfish-loose", length=0.2, depth=0.05),
            "forward",
            "N/mm",
            1e-3,
        ),
        (
            lambda: geomech.forces("sandfish-loose", length=0.2),
            "net_distance",
            "mm",
            200.0,
        ),
    ],
)
def test_lengths_of_every_kind_have_the_unit_that_is_asked_for(ask, name, unit, factor):
    result = ask()
    shown = in_lengths(result, "mm")
    assert shown[name].unit == unit
    np.testing.assert_allclose(shown[name].values, factor * result[name].values)


def test_a_command_prints_the_unit_that_it_draws():
    status, printed, _ = command("intrude", "c-leg", "--unit", "cm")
    assert status == 0 and "N cm" in printed


def test_rows_of_a_measured_connection_have_their_own_units(tmp_path):
    gait = geomech.gaits.Circle(0.8)
    velocity = geomech.load("three-link-viscous").system.velocity
    log = synthetic.synthetic_log(velocity, gait, cycles=20, seed=1)
    synthetic.save(tmp_path / "log.csv", log)
    text = (tmp_path / "log.csv").read_text().replace(",x,y,", ",x_m,y_m,", 1)
    (tmp_path / "log.csv").write_text(text)
    fitted = geomech.fit_gait(tmp_path / "log.csv", body_length=1.0, harmonics=2)
    A = fitted["gait_A"].values
    shown = in_lengths(fitted, "mm")["gait_A"]
    np.testing.assert_allclose(shown.values[:2], 1e3 * A[:2])
    np.testing.assert_array_equal(shown.values[2], A[2])
