"""What is drawn is what was computed: the data in the artists, not the look."""

from dataclasses import replace

import numpy as np
import pytest
from artists import curve, mesh, only
from matplotlib.collections import QuadMesh
from matplotlib.quiver import Quiver
from PIL import Image
from tabled import of_swept, of_table

import geomech
from geomech import plots, scenes
from geomech.mathematics.gaits import Ellipse, Wave
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.tiers import TIERS
from geomech.scenes.data.measurements import read
from geomech.studies.scene_tables import SceneTables

AXES = np.linspace(-1.0, 1.5, 11), np.linspace(-0.5, 2.0, 9)
X, Y = np.meshgrid(*AXES, indexing="ij")
NAMES = ("forward", "sideways", "turning")
A = np.random.default_rng(1).normal(size=(3, 2, 11, 9))
A *= np.array([1.0, 20.0, 300.0])[:, None, None, None]
FITTED = Connection(AXES, A, np.abs(A[:, 0]), np.abs(A[:, 0]), unit="m")


def texts(artists):
    return [x.get_text() for x in artists]


def titles(figure):
    """The part of each title behind its symbol."""
    found = (ax.get_title().partition("$: ")[2] for ax in figure.axes)
    return [title for title in found if title]


# Connections


@pytest.mark.parametrize("row", [0, 1, 2])
def test_arrows_are_a_row_of_the_connection(row):
    arrows = only(plots.vector_field(FITTED, row, every=2), Quiver)
    places = np.stack([X[1::2, 1::2].ravel(), Y[1::2, 1::2].ravel()], -1)
    np.testing.assert_allclose(arrows.get_offsets(), places)
    drawn = [arrows.U, arrows.V]
    np.testing.assert_allclose(drawn, A[row, :, 1::2, 1::2].reshape(2, -1))
    label = arrows.colorbar.ax.get_ylabel()
    assert ("(rad/rad)" if row == 2 else "(m/rad)") in label


# Fields


PLANE = X + 2 * Y
FIELD = Field(AXES, np.stack([PLANE, 3 * PLANE, -PLANE]), unit="m")
UNSURE = Field(AXES, np.where(Y > 1.2, 50.0, 1e-3) * np.ones((3, 1, 1)))


@pytest.mark.parametrize("row", [0, 1, 2])
def test_the_map_of_a_field_lies_as_the_field(row):
    """Mesh, line of zeros, hatching and gait of a field that is no mirror image."""
    gait = Ellipse(centre=(0.2, 0.5), semi_axes=(0.6, 0.2), tilt=0.4)
    ax = plots.ccf_map(FIELD, row, [gait], error=UNSURE)
    x, y, values = mesh(ax)
    np.testing.assert_allclose(values, (1, 3, -1)[row] * (x + 2 * y))
    hatched, zeros = (c for c in ax.collections if not isinstance(c, QuadMesh))
    line = np.concatenate([p.vertices for p in zeros.get_paths()])
    np.testing.assert_allclose(line @ [1, 2], 0, atol=1e-12)
    points = [[0.9, 1.6], [-0.7, 1.5], [0.9, 0.9], [-0.7, 0.9]]
    inside = [p.contains_points(points) for p in hatched.get_paths()]
    assert np.any(inside, axis=0).tolist() == [True, True, False, False]
    loop = gait.shape(np.linspace(0, 2 * np.pi, 400))
    np.testing.assert_allclose(ax.lines[0].get_xydata(), loop)
    label = only(ax, QuadMesh).colorbar.ax.get_ylabel()
    assert ("(rad/rad$^2$)" if row == 2 else "(m/rad$^2$)") in label


def test_the_line_of_zeros_leaves_noise_alone():
    """Specks of one sign without a known value are not outlined, known ones are."""
    values = np.repeat([1.0, -1.0], 10)[:, None] * np.ones(20)
    small = (3, 3)
    large = (slice(14, 17), slice(4, 9))
    sure = (4, 15)
    values[small] = values[sure] = -0.4
    values[large] = 0.9
    error = np.full((20, 20), 0.1)
    error[small] = error[large] = 1.0
    kept = plots.certain(values, error)
    assert kept[small] > 0 and (kept[large] < 0).all() and kept[sure] < 0
    known = error == 0.1
    np.testing.assert_array_equal(kept[known], values[known])


@pytest.mark.parametrize(
    ("place", "is_hatched"),
    [
        ((8, slice(None)), False),  # along the line of zeros
        ((2, slice(None)), True),
        ((14, slice(None)), True),  # beside shapes without a value
        ((slice(6, 9), slice(5, 8)), True),
        ((4, 11), False),  # a single point
    ],
)
def test_hatching_leaves_out_what_goes_along_with_a_line_of_zeros(place, is_hatched):
    values = np.repeat([1.0, -1.0], 8)[:, None] * np.ones(14)
    values[15] = np.nan
    error = np.zeros((16, 14))
    error[place] = 2.0
    expected = (error > 0) & is_hatched
    np.testing.assert_array_equal(plots.unknown(values, error), expected)


def test_a_gait_is_drawn_as_far_as_the_field_goes():
    beyond = Ellipse(centre=(0.2, 0.5), semi_axes=(1.6, 0.4))
    ax = plots.ccf_map(FIELD, 0, [beyond])
    drawn = ax.lines[0].get_xydata()
    loop = beyond.shape(np.linspace(0, 2 * np.pi, 400))
    loop[(loop[:, 0] < -1) | (loop[:, 0] > 1.5)] = np.nan
    np.testing.assert_allclose(drawn, loop)
    assert "gait leaves the field" in texts(ax.texts)


@pytest.mark.parametrize(
    ("name", "rows"), [("three-link-floating", [2]), ("differential-drive", [1])]
)
def test_what_is_nothing_but_rounding_is_drawn_as_nothing(name, rows):
    """Left out with a word."""
    study = SceneTables(scenes.load(name).with_numerics(grid=9, phases=16))
    figure = plots.ccf_figure(study.curvature, error=study.curvature_error)
    assert titles(figure) == [NAMES[k] for k in rows]
    assert figure.get_supxlabel().count("CCF") == 3 - len(rows)


@pytest.mark.parametrize(
    ("clim", "top"),
    [
        (None, np.abs(PLANE).max()),
        (0.25, 0.25),
        (5.0, 5.0),
        ("90%", np.percentile(np.abs(PLANE), 90)),
        ("20%:90%", np.percentile(PLANE, 90)),
    ],
)
def test_colours_have_a_limit_and_stay_centred_on_zero(clim, top):
    figure = plots.ccf_figure(FIELD, components=("x", "theta"), clim=clim)
    one, other = (only(ax, QuadMesh) for ax in figure.axes[:2])
    assert one.get_clim() == pytest.approx((-top, top))
    assert "%:" in str(clim) or other.get_clim() == pytest.approx((-top, top))


# Displacements


POSES = {"amplitude": [0.5, 1.0], "direct": [[-0.3, 0.4, 0.1], [0.6, 0.8, 9.0]]}
LINES = {
    "x": ("x per cycle (m)", [-0.3, 0.6], [0, 2], 0.5),
    "y": ("y per cycle (m)", [0.4, 0.8], [1, 0], 0.5),
    "heading": ("heading per cycle (rad)", [0.1, 9], [0, 0], 0.3),
    "net_distance": ("net distance per cycle (m)", [0.5, 1], [1, 2], 0.5),
}


@pytest.mark.parametrize("quantity", LINES)
def test_lines_of_displacement_are_a_quantity_of_each_tier(quantity):
    """With bands of the errors, and one of what the medium leaves open."""
    label, direct, area, error = LINES[quantity]
    errors = {"estimate": 0.5, "estimate_heading": 0.3}
    table = POSES | {"area": [[0.0, 1.0, 0], [2, 0, 0]]}
    table |= {k: {"direct": [x, x], "area": [x, x]} for k, x in errors.items()}
    table["medium_error_of"] = {quantity: [0.2, 0.4]}
    ax = plots.displacement(of_table(table, "m", "A (rad)"), quantity=quantity)
    assert ax.get_ylabel() == label
    for tier, values in (("direct", direct), ("area", area)):
        drawn = curve(ax, TIERS[tier].label)
        np.testing.assert_allclose(drawn, [[0.5, 1.0], values])
    bands = [edges(collection) for collection in ax.collections]
    for found, values, margin in zip(
        bands, (area, direct, direct), ([error] * 2, [error] * 2, [0.2, 0.4])
    ):
        limits = [np.subtract(values, margin), np.add(values, margin)]
        np.testing.assert_allclose(found, limits)


def edges(collection):
    """Lower and upper edge (2, B) of an area between two curves."""
    x, y = collection.get_paths()[0].vertices.T
    return [[f(y[x == a]) for a in np.unique(x)] for f in (np.min, np.max)]


MEASURED_DATA = {"amplitude": [0.4, 0.9], "value": [0.1, 0.2], "error": [0.02, 0.03]}


@pytest.mark.parametrize(
    ("data", "x", "y"),
    [
        (MEASURED_DATA, [0.4, 0.9], [0.1, 0.2]),
        ({"amplitude_deg": [30, 60], "value_cm": [1, 3]}, None, [0.01, 0.03]),
        ({"amplitude_deg": [30, 60], "value_BL": [1, 3]}, None, [2, 6]),
        ({"amplitude_deg": [30, 60], "value (mm)": [1, 3]}, None, [1e-3, 3e-3]),
    ],
)
def test_measurements_are_points_with_bars_in_the_units_they_name(data, x, y):
    result = of_table(POSES, "m", label="radius (rad)", body_length=2.0)
    ax = plots.displacement(result, data=data)
    points = ax.containers[-1].lines
    expected = np.transpose([x or np.radians([30, 60]), y])
    np.testing.assert_allclose(points[0].get_xydata(), expected)
    if "error" in data:
        (bars,) = points[2]
        ends = [bar[:, 1] for bar in bars.get_segments()]
        np.testing.assert_allclose(ends, [[0.08, 0.12], [0.17, 0.23]])


@pytest.mark.parametrize(
    ("header", "rows", "angle", "expected"),
    [
        ("amplitude,value,error", "1,2,3", False, [1, 2, 3]),
        ("error_bl,amplitude_deg,value (BL)", "0.5,180,2", False, [np.pi, 0.84, 0.21]),
        ('"value_mm","amplitude [rad]"', "30,1.5", False, [1.5, 0.03]),
        ("amplitude,value_deg,error_rad", "1,90,0.1", True, [1, np.pi / 2, 0.1]),
    ],
)
def test_measurements_are_read_in_the_units_of_the_results(
    header, rows, angle, expected, tmp_path
):
    (tmp_path / "m.csv").write_text(f"# from the lab\n{header}\n{rows}\n")
    glass = scenes.load("three-link-glass")
    scene = glass.changed(body=replace(glass.system.body, length=0.42))
    found = read(tmp_path / "m.csv", scene, angle)
    names = ("amplitude", "value", "error")
    assert [found[name][0] for name in names if name in found] == pytest.approx(
        expected
    )


BY_SYMMETRY = {"heading": "by mirror", "y": "by reversal"}


@pytest.mark.parametrize(
    ("zero", "components", "panels", "told"),
    [
        ({}, (), ["x", "net distance"], "y and heading: zero to rounding"),
        (BY_SYMMETRY, (), ["x", "net distance"], "heading: zero by mirror"),
        (BY_SYMMETRY, ("theta", "x"), ["heading", "x"], ""),
    ],
)
def test_panels_that_are_zero_are_left_out_with_a_reason(
    zero, components, panels, told
):
    """Unless one is asked for."""
    result = of_table({"amplitude": [0.5], "direct": [[0.1, 0.0, 0.0]]}, zero=zero)
    figure = plots.displacement_figure({"a": result}, components=components)
    assert [ax.get_ylabel().partition(" per")[0] for ax in figure.axes] == panels
    assert told in figure.get_supxlabel()


# Sweeps and accuracy


GLASS = scenes.load("three-link-glass")
ORDERED = np.array([[1, -2], [3, 4], [5, 6.0]])


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1]])
def test_the_map_of_a_sweep_lies_as_its_parameters(order):
    """In whatever order they were computed."""
    moved = np.zeros((3, 2, 3))
    moved[..., 0] = ORDERED[order]
    amplitudes = np.array([0.5, 1.0, 1.5])
    over = {"gait.amplitude": amplitudes[order].tolist(), "body.length": [2.0, 5.0]}
    table = {"over": over, "displacement": moved, "estimate": np.ones((3, 2))}
    figure = plots.sweep_figure(GLASS, of_swept(table))
    ax = figure.axes[0]
    x, y, values = mesh(ax)
    np.testing.assert_allclose(x[0], amplitudes)
    np.testing.assert_allclose(y[:, 0], [2.0, 5.0])
    np.testing.assert_allclose(values, ORDERED.T)


@pytest.mark.parametrize(
    ("more", "y", "label"),
    [
        ({}, [1, -2], "net distance per cycle (m),\nbackwards < 0"),
        (
            {"frequency": np.array([3.0, 4.0]), "speed": np.array([3.0, 8.0])},
            [3, -8],
            "speed (m/s),\nbackwards < 0",
        ),
    ],
)
def test_a_sweep_over_one_parameter_is_a_line_with_bars(more, y, label):
    moved = np.array([[1.0, 0, 0], [-2, 0, 0]])
    table = {"over": {"body.length": [2.0, 5.0]}, "displacement": moved, **more}
    table["estimate"] = np.array([0.2, 1.0])
    ax = plots.sweep_figure(GLASS, of_swept(table)).axes[0]
    np.testing.assert_allclose(ax.lines[0].get_xydata(), np.transpose([[2, 5], y]))
    assert ax.get_ylabel() == label
    if not more:
        bars = ax.collections[0].get_segments()
        np.testing.assert_allclose(bars[1], [[5, -3], [5, -1]])


# Options


@pytest.mark.parametrize(
    ("question", "options", "titled"),
    [
        ("ccf", {"component": "theta", "clim": "0.5"}, ["turning"]),
        ("connection", {"component": ("y", "x")}, ["sideways", "forward"]),
    ],
)
def test_options_of_pictures_reach_them(question, options, titled):
    study = geomech.study(scenes.load("three-link-viscous").with_numerics(grid=7))
    figure = getattr(study, question)().plot(**options)
    assert titles(figure) == titled
    if "clim" in options:
        assert only(figure.axes[0], QuadMesh).get_clim() == (-0.5, 0.5)


def test_a_slice_has_its_own_joints_on_its_axes():
    scene = scenes.load("three-link-viscous").with_numerics(grid=5, phases=16)
    four = scene.changed(body=geomech.bodies.Chain((1, 1, 1, 1)), gait=Wave(joints=3))
    ax = geomech.study(four).ccf(pair="1,3").plot().axes[0]
    labels = (ax.get_xlabel(), ax.get_ylabel())
    assert labels == (r"$\alpha_{1}$ (rad)", r"$\alpha_{3}$ (rad)")


def test_measurements_of_a_file_are_drawn_where_they_belong(tmp_path):
    (tmp_path / "own.csv").write_text("amplitude_deg,value\n30,-0.01\n60,-0.05\n")
    result = geomech.displacement("three-link-viscous", [0.5, 1], tiers=["direct"])
    (ax,) = result.plot(component="x", data=str(tmp_path / "own.csv")).axes
    expected = np.transpose([np.radians([30, 60]), [-0.01, -0.05]])
    np.testing.assert_allclose(ax.containers[-1].lines[0].get_xydata(), expected)


def test_a_picture_in_a_file_has_200_dots_an_inch(tmp_path):
    plots.save(plots.figure(3.0, 2.0)[0], tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (600, 400)
