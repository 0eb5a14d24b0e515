"""What is drawn is what was computed: the data in the artists, not the look."""

from dataclasses import replace

import numpy as np
import pytest
from artists import mesh, only
from commands import geomech
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgba
from matplotlib.quiver import Quiver
from PIL import Image
from tabled import of_swept, of_table

from geomech import plots, scenes
from geomech.core.setting import Setting
from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Ellipse
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.systems.base import shape_labels
from geomech.mathematics.tiers import TIERS
from geomech.plots.displacement import sweeps
from geomech.plots.displacement.displacements import (
    ERROR,
    MEASURED,
    MEDIUM,
    TO_ROUNDING,
)
from geomech.plots.displacement.precision import PANELS
from geomech.plots.displacement.precision import SETTINGS as PRECISION
from geomech.questions.shared.texts import colour_limit
from geomech.scenes.data.measurements import read
from geomech.studies.displacement.tiered import SETTINGS
from geomech.studies.scene_tables import SceneTables
from geomech.studies.settings import Measurements, padded_array
from geomech.studies.settings import measurement_variables as of_measured
from rft.core.refusal import Refusal

AXES = np.linspace(-1.0, 1.5, 11), np.linspace(-0.5, 2.0, 9)
SHAPES = np.meshgrid(*AXES, indexing="ij")


def label_of(ax):
    """Of the colour bar."""
    return [a.get_ylabel() for a in ax.figure.axes if a is not ax][-1]


@pytest.mark.parametrize("component", [0, 1, 2])
def test_arrows_are_the_row_asked_for(component):
    A = np.random.default_rng(0).normal(size=(3, 2, 11, 9))
    found = Connection(AXES, A, np.abs(A[:, 0]), np.abs(A[:, 0]), unit="m")
    ax = plots.vector_field(found, component, every=2)
    arrows = only(ax, Quiver)
    x, y = (s[1::2, 1::2] for s in SHAPES)
    np.testing.assert_allclose(
        arrows.get_offsets(), np.stack([x.ravel(), y.ravel()], -1)
    )
    np.testing.assert_allclose(
        [arrows.U, arrows.V], A[component, :, 1::2, 1::2].reshape(2, -1)
    )
    assert plots.COMPONENTS[component] in label_of(ax)
    assert ("(rad/rad)" if component == 2 else "(m/rad)") in label_of(ax)


@pytest.mark.parametrize("component", [0, 1, 2])
def test_the_map_of_a_field_lies_as_the_field(component):
    """Mesh, line of zeros, hatching and gait of a field that is no mirror image of itself."""
    plane = SHAPES[0] + 2 * SHAPES[1]
    field = Field(AXES, np.stack([plane, 3 * plane, -plane]), unit="m")
    error = Field(AXES, np.where(SHAPES[1] > 1.2, 50.0, 1e-3) * np.ones((3, 1, 1)))
    gait = Ellipse(centre=(0.2, 0.5), semi_axes=(0.6, 0.2), tilt=0.4)
    plain = plots.ccf_map(field, component)
    ax = plots.ccf_map(field, component, [gait], error=error)
    x, y, values = mesh(ax)
    np.testing.assert_allclose(values, (1, 3, -1)[component] * (x + 2 * y))
    assert only(ax, QuadMesh).get_clim() == pytest.approx(
        (-np.abs(values).max(), np.abs(values).max())
    )
    hatched, zeros = (c for c in ax.collections if not isinstance(c, QuadMesh))
    line = np.concatenate([p.vertices for p in zeros.get_paths()])
    np.testing.assert_allclose(line[:, 0] + 2 * line[:, 1], 0, atol=1e-12)
    assert len(line) > 4
    assert hatched.hatches
    inside = lambda points: np.any(
        [p.contains_points(points) for p in hatched.get_paths()], axis=0
    )
    assert inside([[0.9, 1.6], [-0.7, 1.5]]).all()
    assert not inside([[0.9, 0.9], [-0.7, 0.9]]).any()
    assert [t.get_text() for t in ax.get_legend().get_texts()] == [plots.HATCHED]
    assert (
        ax.get_title()
        == f"CCF$_{{{plots.COMPONENTS[component]}}}$: {('forward', 'sideways', 'turning')[component]}"
    )
    curve = gait.shape(np.linspace(0, 2 * np.pi, 400))
    np.testing.assert_allclose(ax.lines[0].get_xydata(), curve)
    np.testing.assert_allclose(ax.lines[1].get_xydata(), curve[:1])
    assert ("(rad/rad$^2$)" if component == 2 else "(m/rad$^2$)") in label_of(ax)
    assert (ax.get_xlim(), ax.get_ylim()) == ((-1.0, 1.5), (-0.5, 2.0))
    assert len(plain.collections) == 2
    assert plain.get_legend() is None
    assert plain.get_title() == ax.get_title()


def test_the_line_of_zeros_leaves_noise_alone():
    """Specks of one sign without a known value are not outlined, nor pulled out of the sea they lie in; known ones are."""
    values = np.full((20, 20), 1.0)
    values[10:] = -1.0
    small, large, sure = (3, 3), (slice(14, 17), slice(4, 9)), (4, 15)
    values[small], values[large], values[sure] = -0.4, 0.9, -0.4
    error = np.full((20, 20), 0.1)
    error[small] = error[large] = 1.0
    kept = plots.certain(values, error)
    assert kept[small] > 0
    assert (kept[large] < 0).all()
    assert kept[sure] < 0
    np.testing.assert_array_equal(np.sign(kept[9:11]), [[1.0] * 20, [-1.0] * 20])
    known = error == 0.1
    np.testing.assert_array_equal(kept[known], values[known])


def test_no_specks_on_the_default_map():
    """In loose glass the turn's field has loops of zeros less than half a radian across and single points whose error
    exceeds them; on its map there are neither."""
    study = SceneTables(scenes.load("three-link-glass"))
    field, error = study.curvature, study.curvature_error
    raw = plots.figure(3, 3)[1][0, 0].contour(
        *field.axes, field.values[2].T, levels=[0.0]
    )
    assert min(sizes_of_loops(raw)) < 0.5
    for component in range(3):
        ax = plots.ccf_map(field, component, error=error)
        hatched, zeros = (c for c in ax.collections if not isinstance(c, QuadMesh))
        assert min(sizes_of_loops(zeros), default=1.0) > 0.5
        patches = [
            np.ptp(p, axis=0).max()
            for path in hatched.get_paths()
            for p in pieces(path)
        ]
        assert min(patches, default=1.0) > 0.2


def pieces(path):
    """Vertices of each unbroken part of a path, as they are."""
    return [
        p
        for p in np.split(path.vertices, np.flatnonzero(path.codes == path.MOVETO)[1:])
        if len(p)
    ]


def sizes_of_loops(contours):
    parts = [
        p for path in contours.get_paths() if len(path.vertices) for p in pieces(path)
    ]
    return [np.ptp(p, axis=0).max() for p in parts if np.allclose(p[0], p[-1])]


def test_hatching_leaves_out_what_goes_along_with_a_line_of_zeros():
    """A thin band where the sign changes is left out, one where it does not is kept, as are patches of three by three
    anywhere; single points are not. Shapes without a value are no change of sign."""
    values, error = np.ones((16, 14)), np.zeros((16, 14))
    values[8:] = -1.0
    values[15] = np.nan
    along, away, beside, patch, speck = (
        (8, slice(None)),
        (2, slice(None)),
        (14, slice(None)),
        (slice(6, 9), slice(5, 8)),
        (4, 11),
    )
    hatched = np.zeros((16, 14), bool)
    for where, kept in (
        (along, False),
        (away, True),
        (beside, True),
        (patch, True),
        (speck, False),
    ):
        error[where] = 2.0
        hatched[where] = kept
    np.testing.assert_array_equal(plots.unknown(values, error), hatched)
    np.testing.assert_array_equal(plots.unknown(-values, error), hatched)
    np.testing.assert_array_equal(plots.unknown(values.T, error.T), hatched.T)


def test_a_gait_is_drawn_as_far_as_the_field_goes():
    plane = SHAPES[0] + 0.3
    field = Field(AXES, np.stack([plane] * 3))
    beyond = Ellipse(centre=(0.2, 0.5), semi_axes=(1.6, 0.4))
    ax = plots.ccf_map(field, 0, [beyond])
    drawn, dot = (line.get_xydata() for line in ax.lines)
    inside = np.isfinite(drawn).all(1)
    curve = beyond.shape(np.linspace(0, 2 * np.pi, 400))
    np.testing.assert_allclose(drawn[inside], curve[inside])
    np.testing.assert_array_equal(inside, (curve[:, 0] >= -1) & (curve[:, 0] <= 1.5))
    assert 50 < inside.sum() < 350
    assert np.isnan(dot).all()  # it starts at 1.8
    (note,) = (t.get_text() for t in ax.texts if t.get_text())
    assert note == "gait leaves the field"
    (arrow,) = (t for t in ax.texts if getattr(t, "arrow_patch", None))
    assert -1 <= arrow.xy[0] <= 1.5
    within = plots.ccf_map(field, 0, [Ellipse(centre=(0.2, 0.5), semi_axes=(1.2, 0.4))])
    assert not [t for t in within.texts if t.get_text()]
    nowhere = plots.ccf_map(
        field, 0, [Ellipse(centre=(9.0, 0.5), semi_axes=(1.3, 0.4))]
    )
    assert not [t for t in nowhere.texts if getattr(t, "arrow_patch", None)]


def test_modes_are_named_on_the_axes():
    """Shape variables that are no joint angles, on maps, arrows and in the units of the colours."""
    system = scenes.load("serpenoid-glass").system
    names = [f"{name} ({unit})" for name, unit in shape_labels(system)]
    assert "cosine" in names[0] and "sine" in names[1] and "rad" in names[0]
    field = Field(AXES, np.stack([SHAPES[0]] * 3))
    labels = (("bend", "deg"), ("roll", "m"))
    fitted = Connection(AXES, np.ones((3, 2, 11, 9)), SHAPES[0], SHAPES[0])
    for axes, bar in (
        (plots.ccf_figure(field, labels=shape_labels(system)).axes[:3], None),
        (plots.ccf_figure(field, labels=labels).axes[:3], "(length/(deg m))"),
        (
            plots.connection_figure(fitted, labels=labels).axes[:3],
            "(length/deg)",
        ),
    ):
        expected = names if bar is None else ["bend (deg)", "roll (m)"]
        for ax in axes:
            assert [ax.get_xlabel(), ax.get_ylabel()] == expected
        assert bar is None or bar in axes[0].figure.axes[3].get_ylabel()
    assert plots.quantity("alpha_12", "rad") == r"$\alpha_{12}$ (rad)"
    assert plots.quantity("m_12", "rad") == "$m_{12}$ (rad)"
    assert plots.quantity("drag_ratio", "-") == "drag_ratio (-)"


LINES = {
    "x": ("x per cycle (m)", [-0.3, 0.6], [0, 2], 0.5),
    "y": ("y per cycle (m)", [0.4, 0.8], [1, 0], 0.5),
    "heading": ("heading per cycle (rad)", [0.1, 9], [0, 0], 0.3),
    "net_distance": ("net distance per cycle (m)", [0.5, 1], [1, 2], 0.5),
}


@pytest.mark.parametrize("quantity", LINES)
def test_lines_of_displacement_are_a_quantity_of_each_tier(quantity):
    """With bands of the errors, in the unit of the quantity and the colour of the tier, and one of what the medium leaves
    open; the legend tells them apart."""
    label, direct, area, error = LINES[quantity]
    table = {
        "amplitude": [0.5, 1.0],
        "direct": [[-0.3, 0.4, 0.1], [0.6, 0.8, 9.0]],
        "area": [[0.0, 1.0, 0], [2, 0, 0]],
    }
    both = lambda x: {"direct": [x, x], "area": [x, x]}
    table |= {
        "units": dict.fromkeys(("x", "y", "net_distance"), "m"),
        "body_length": 2.0,
        "estimate": both(0.5),
        "estimate_heading": both(0.3),
        "medium_error_of": {quantity: [0.2, 0.4]},
    }
    label_of = Ellipse().amplitude_label
    told = of_table(table, "m", label_of)
    ax = plots.displacement(told, quantity=quantity)
    lines = {line.get_label(): line for line in ax.lines}
    for tier, values in (("direct", direct), ("area", area)):
        np.testing.assert_allclose(
            lines[TIERS[tier].label].get_xydata(), np.transpose([[0.5, 1.0], values])
        )
    assert (ax.get_xlabel(), ax.get_ylabel()) == (Ellipse().amplitude_label, label)
    bands = {c.get_label(): band(c) for c in ax.collections}
    np.testing.assert_allclose(
        bands.pop(MEDIUM), [np.subtract(direct, [0.2, 0.4]), np.add(direct, [0.2, 0.4])]
    )
    (of_area, of_direct) = bands.values()
    for found, values in ((of_area, area), (of_direct, direct)):
        np.testing.assert_allclose(
            found, [np.subtract(values, error), np.add(values, error)]
        )
    colours = [tuple(c.get_facecolor()[0]) for c in ax.collections]
    assert (
        colours[:2] == [to_rgba(TIERS[t].colour, 0.14) for t in ("area", "direct")]
        and len({*colours}) == 3
    )
    legend = [t.get_text() for t in ax.get_legend().get_texts()]
    assert legend == [TIERS["area"].label, TIERS["direct"].label, ERROR, MEDIUM]
    alone = plots.displacement(of_table(one(table), "m"), quantity=quantity)
    assert [t.get_text() for t in alone.get_legend().get_texts()] == legend


def one(entry):
    """What a table has of its first amplitude alone."""
    if isinstance(entry, dict):
        return {k: one(v) for k, v in entry.items()}
    return entry[:1] if isinstance(entry, list) else entry


def band(collection):
    """Lower and upper edge (2, B) of an area between two curves."""
    (path,) = collection.get_paths()
    x, y = path.vertices.T
    at = np.unique(x)
    return np.array([[f(y[x == a]) for a in at] for f in (np.min, np.max)])


def test_tiers_of_one_amplitude_stand_side_by_side():
    scene = scenes.load("three-link-viscous").with_numerics(grid=9)
    table = SceneTables(scene).displacements([0.5])
    ax = plots.displacement(table)
    points = [line.get_xdata().item() for line in ax.lines if line.get_marker() == "o"]
    bars = [bar.get_segments()[0][0, 0] for bar in ax.collections]
    assert len({*points}) == len(points) == table.sizes["tier"] and bars == points
    assert np.mean(points) == pytest.approx(0.5) and ax.get_xticks().tolist() == [0.5]


def test_measurements_are_points_with_bars_of_their_errors():
    table = {"amplitude": [0.5, 1.0], "direct": [[-0.3, 0.4, 0.1], [0.6, 0.8, 9.0]]}
    data = {"amplitude": [0.4, 0.9], "value": [0.1, 0.2], "error": [0.02, 0.03]}
    ax = plots.displacement(of_table(table), data=data)
    (points,) = (c for c in ax.containers if c.get_label() == MEASURED)
    np.testing.assert_allclose(points.lines[0].get_xydata(), [[0.4, 0.1], [0.9, 0.2]])
    (bars,) = points.lines[2]
    np.testing.assert_allclose(
        [s[:, 1] for s in bars.get_segments()], [[0.08, 0.12], [0.17, 0.23]]
    )
    assert [t.get_text() for t in ax.get_legend().get_texts()] == [
        TIERS["direct"].label,
        MEASURED,
    ]
    for names, where in (((), 0), (("y", "x"), 0)):
        fig = plots.displacement_figure(
            {"circle": of_table(table)}, components=names, data=data
        )
        assert [
            any(c.get_label() == MEASURED for c in ax.containers) for ax in fig.axes
        ].index(True) == where


def test_measurements_may_say_their_units_as_those_of_a_file_do():
    table = {"amplitude": [0.5, 1.0], "direct": [[-0.3, 0.4, 0.1], [0.6, 0.8, 9.0]]}
    result = of_table(table, "m", label="radius (rad)", body_length=2.0)
    for name, size in (("value_cm", 0.01), ("value_BL", 2.0), ("value (mm)", 1e-3)):
        data = {"amplitude_deg": [30.0, 60.0], name: [1.0, 3.0], "trial": ["a", "b"]}
        ax = plots.displacement(result, data=data)
        (points,) = (c for c in ax.containers if c.get_label() == MEASURED)
        expected = np.transpose([np.radians([30, 60]), [size, 3 * size]])
        np.testing.assert_allclose(points.lines[0].get_xydata(), expected)
    for wrong in ({"amplitude": [1.0]}, {"amplitude": [1.0], "value_kg": [1.0]}):
        with pytest.raises(Refusal, match="data"):
            plots.displacement(result, data=wrong)


def test_panels_that_are_zero_are_left_out_with_a_reason():
    """By symmetry, whatever a coarse tier says; to rounding; in one row of two; not where
    one is asked for."""
    turns = "by symmetry, as the second half of the cycle mirrors the first"
    back = "by symmetry, as the cycle run backwards is its own image, head for tail"
    poses = {"direct": [[0.1, 0.02, 1e-17]], "area": [[0.1, 0.0, 1e-7]]}
    moves = of_table({"amplitude": [0.5], **poses}, zero={"heading": turns})
    alone = {"amplitude": [0.5], "direct": [[0.1, 0.0, 0.0]]}
    shift = of_table(alone, zero={"heading": turns, "y": back})

    def titles(fig):
        return [ax.get_ylabel().partition(" per")[0] for ax in fig.axes]

    fig = plots.displacement_figure({"circle": moves})
    assert titles(fig) == ["x", "y", "net distance"]
    assert fig.get_supxlabel() == f"heading: zero {turns}"
    fig = plots.displacement_figure({"circle": moves, "butterfly": shift})
    assert titles(fig) == ["x", "y", "net distance", "x", "", "net distance"]
    (word,) = (" ".join(t.get_text().split()) for t in fig.axes[4].texts)
    assert word == f"y: zero {back}"
    fig = plots.displacement_figure({"butterfly": shift})
    assert titles(fig) == ["x", "net distance"]
    assert {f"y: zero {back}", f"heading: zero {turns}"} == set(
        fig.get_supxlabel().split("\n")
    )
    fig = plots.displacement_figure({"a": of_table(alone)})  # to rounding alone
    assert titles(fig) == ["x", "net distance"]
    assert fig.get_supxlabel() == f"y and heading: zero {TO_ROUNDING}"
    fig = plots.displacement_figure({"a": shift}, components=("theta", "x"))
    assert titles(fig) == ["heading", "x"] and not fig.get_supxlabel()
    with pytest.raises(Refusal, match="component: 'z' is unknown"):
        plots.displacement_figure({"a": shift}, components=("z",))


@pytest.mark.parametrize(
    ("header", "rows", "angle", "expected"),
    [
        ("amplitude,value,error", "1,2,3", False, (1, 2, 3)),
        ("error_bl,amplitude_deg,value (BL)", "0.5,180,2", False, (np.pi, 0.84, 0.21)),
        ('"value_mm","amplitude [rad]"', "30,1.5", False, (1.5, 0.03, None)),
        ("amplitude,value_deg,error_rad", "1,90,0.1", True, (1, np.pi / 2, 0.1)),
    ],
)
def test_measurements_are_read_in_the_units_of_the_results(
    header, rows, angle, expected, tmp_path
):
    (tmp_path / "m.csv").write_text(f"# from the lab\n{header}\n{rows}\n")
    glass = scenes.load("three-link-glass")
    scene = glass.changed(
        system=replace(glass.system, body=replace(glass.system.body, length=0.42))
    )
    found = read(tmp_path / "m.csv", scene, angle)
    for name, value in zip(("amplitude", "value", "error"), expected):
        assert found.get(name, [None])[0] == (
            value if value is None else pytest.approx(value)
        )


def test_four_quantities_and_the_speed():
    glass = scenes.load("three-link-viscous").changed(gait=Ellipse(frequency=2.5))
    table = SceneTables(glass).displacements([0.5, 1.0], ["direct"])
    names = ("x", "y", "theta", "distance")
    fig = plots.displacement_figure({"ellipse": table}, components=names)
    assert [ax.get_ylabel() for ax in fig.axes] == [f"{q} per cycle ({u})" for q, u in (
        ("x", "BL"), ("y", "BL"), ("heading", "rad"), ("net distance", "BL"))]  # fmt: skip
    assert (
        len(plots.displacement_figure({"ellipse": table}).axes) == 3
    )  # its heading is zero
    (right,) = fig.axes[3].child_axes
    assert right.get_ylabel() == "speed (BL/s) at 2.5 Hz"
    fig.draw_without_rendering()
    np.testing.assert_allclose(right.get_ylim(), np.array(fig.axes[3].get_ylim()) * 2.5)


def fig_label(ax):
    """Of its colours."""
    return ax.figure.axes[1].get_ylabel()


def test_the_map_of_a_sweep_lies_as_its_parameters():
    scene = scenes.load("three-link-glass")
    over = {"gait.amplitude": [0.5, 1.0, 1.5], "body.length": [2.0, 5.0]}
    moved = np.zeros((3, 2, 3))
    moved[..., 0] = [[1, -2], [3, 4], [5, 6]]
    errors = np.ones((3, 2)), np.ones((3, 2))
    results = {
        "over": over,
        "displacement": moved,
        "estimate": errors[0],
        "estimate_heading": errors[1],
    }
    results["units"] = {"estimate": "m"}
    ax = plots.sweep_figure(scene, of_swept(results)).axes[0]
    x, y, values = mesh(ax)
    np.testing.assert_allclose(x[0], over["gait.amplitude"])
    np.testing.assert_allclose(y[:, 0], over["body.length"])
    np.testing.assert_allclose(values, moved[..., 0].T)
    assert fig_label(ax) == "net distance per cycle (m), backwards < 0"
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        scene.gait.amplitude_label,
        "length (m)",
    )
    assert (ax.get_xlim(), ax.get_ylim()) == ((0.5, 1.5), (2.0, 5.0))
    shuffled = {
        **results,
        "over": {"gait.amplitude": [1.5, 0.5, 1.0], "body.length": [5.0, 2.0]},
    }
    x, y, values = mesh(plots.sweep_figure(scene, of_swept(shuffled)).axes[0])
    np.testing.assert_allclose(x[0], [0.5, 1.0, 1.5])
    np.testing.assert_allclose(y[:, 0], [2.0, 5.0])
    np.testing.assert_allclose(values, np.array([[4, 3], [6, 5], [-2, 1]]).T)
    one = {
        "over": {"body.length": [2.0, 5.0]},
        "displacement": moved[0],
        "estimate": np.array([0.2, 1.0]),
    }
    one["units"] = {"estimate": "m"}
    ax = plots.sweep_figure(scene, of_swept(one)).axes[0]
    np.testing.assert_allclose(ax.lines[0].get_xydata(), [[2, 1], [5, -2]])
    np.testing.assert_allclose(
        ax.collections[0].get_segments(), [[[2, 0.8], [2, 1.2]], [[5, -3], [5, -1]]]
    )  # m
    timed = {**one, "frequency": np.array([3.0, 4.0]), "speed": np.array([3.0, 8.0])}
    ax = plots.sweep_figure(scene, of_swept(timed)).axes[0]
    np.testing.assert_allclose(ax.lines[0].get_xydata(), [[2, 3], [5, -8]])
    assert ax.get_ylabel() == "speed (m/s), backwards < 0"
    many = {
        "over": {"medium.C": np.arange(60.0)},
        "displacement": np.ones((60, 3)),
        "estimate": np.ones(60),
    }
    many["units"] = {"estimate": "BL"}
    drawn = [
        plots.sweep_figure(scene, of_swept(x)).axes[0].lines[0].get_marker()
        for x in (one, many)
    ]
    assert drawn == ["o", "None"]


def studied(rows, amplitudes=1):
    """An accuracy study of rows (setting, errors, seconds)."""
    settings, errors, seconds = zip(*rows)
    measured = Measurements(
        settings,
        padded_array([setting.values for setting in settings]),
        padded_array(seconds),
        {"error": padded_array(errors)},
    )
    amplitude = Variable("amplitude", ("amplitude",), np.ones(amplitudes))
    found = of_measured(measured, "BL", {"error": "rms"})
    return Result("accuracy", (*found, amplitude), {"about": "the displacement"})


def test_a_work_precision_diagram_has_no_empty_axes_and_takes_errors_of_0(tmp_path):
    """As of systems that no setting approximates: warnings are errors here."""
    for against, title in PANELS.items():
        phases = Setting("phases", (16, 64, 128), 2, "", against, "direct")
        for error in ([1e-3, 1e-5, 0.0], [0.0, 0.0, 0.0]):
            fig = plots.accuracy_figure(studied([(phases, error, (0.1, 0.3, 0.5))]))
            fig.canvas.draw()
            (ax,) = fig.axes
            assert (ax.get_title(), ax.get_ylabel(), ax.get_yscale()) == (*title, "log")
            np.testing.assert_array_equal(
                ax.lines[0].get_ydata(), np.maximum(error, 1e-17)
            )


def test_the_work_precision_diagram_says_what_its_lines_are():
    phases = Setting("phases", (16, 32, 64), 2, tier="direct")
    grid = Setting("grid", (7, 31, 61), 4, tier="area")
    directions = Setting("directions", (2, 8), 2, "", "limit", "path")
    fine, coarse = 1e-3 * 4.0 ** -np.arange(3), [0.02, 0.0200001, 0.01999]
    rows = [
        (phases, fine, [0.1, 0.2, 0.3]),
        (grid, coarse, [0.2, 0.3, 0.4]),
        (directions, [0.1, 0], [1, 2]),
    ]
    fig = plots.accuracy_figure(studied(rows, amplitudes=3))
    left, right = fig.axes
    assert [t.get_text() for t in left.get_legend().get_texts()] == [
        "direct: phases a cycle, 16 to 64, order 2.0", "area: points a joint of the grid, 7 to 61, no gain",
    ]  # fmt: skip
    assert [t.get_text() for t in right.get_legend().get_texts()] == [
        "path: directions of the fit, 2 to 8"
    ]
    assert [(t.get_text(), t.xy) for t in left.texts[:2]] == [
        ("16", (0.1, 1e-3)),
        ("64", (0.3, 6.25e-5)),
    ]
    assert left.get_xlabel() == "time for 3 amplitudes, tables included (s)"
    assert (
        "finer force balance (BL)" in left.get_ylabel()
        and "the setting leads (BL)" in right.get_ylabel()
    )
    np.testing.assert_array_equal(
        left.lines[1].get_xydata().T, [[0.2, 0.3, 0.4], coarse]
    )
    assert set(PRECISION) <= {setting.name for setting in SETTINGS}
    assert left.get_title() and right.get_title()
    fig.canvas.draw()
    for ax in (
        left,
        right,
    ):  # two powers of ten on each axis, though the times span less than one
        for axis, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
            assert len([x for x in axis.get_majorticklocs() if low <= x <= high]) >= 2
            assert not any(t.get_text() for t in axis.get_minorticklabels())


def test_parameters_have_names_and_units():
    scene = scenes.load("sandfish-heavy")
    names = [
        "medium.C",
        "effects.frequency",
        "medium.gamma0_deg",
        "effects.end-caps.radius",
        "gait.amplitude",
    ]
    named = [
        "C (-)",
        "frequency (Hz)",
        r"$\gamma_{0}$ (deg)",
        "radius (BL)",
        scene.gait.amplitude_label,
    ]
    assert sweeps.axis_labels(scene, names) == named
    both = ["effects.end-caps.radius", "effects.disturbed-ground.radius"]
    assert sweeps.axis_labels(scene, both) == [
        "end-caps: radius (BL)",
        "disturbed-ground: radius (BL)",
    ]


def test_panels_are_x_y_and_theta():
    A = np.random.default_rng(1).normal(size=(3, 2, 11, 9))
    fitted = Connection(AXES, A, np.abs(A[:, 0]), np.abs(A[:, 0]))
    for component, ax in enumerate(plots.connection_figure(fitted).axes[:3]):
        np.testing.assert_allclose(only(ax, Quiver).V, A[component, 1].ravel())
    field = Field(AXES, A[:, 0])
    error = Field(AXES, np.abs(A[:, 1]))
    for component, ax in enumerate(plots.ccf_figure(field, error=error).axes[:3]):
        np.testing.assert_allclose(mesh(ax)[2], A[component, 0].T)
        assert ("forward", "sideways", "turning")[component] in ax.get_title()


def test_a_row_of_rounding_has_no_arrows():
    """A snake that cannot slip sideways, in the frame of a wheeled link: A^y is nothing."""
    fitted = SceneTables(
        scenes.load("no-slip-snake").changed(frame="link-2").with_numerics(grid=8)
    ).fitted
    arrows = [plots.vector_field(fitted, row).collections[0] for row in range(3)]
    lengths = [np.hypot(a.U, a.V)[~np.broadcast_to(a.Umask, a.U.shape)] for a in arrows]
    assert not lengths[1].any()
    assert arrows[1].get_clim() == (0.0, 1.0)
    for k in (0, 2):
        assert lengths[k].max() == pytest.approx(arrows[k].get_clim()[1])


@pytest.mark.parametrize(
    ("name", "rows"), [("three-link-floating", [2]), ("differential-drive", [1])]
)
def test_what_is_nothing_but_rounding_is_drawn_as_nothing(name, rows):
    """No patterns of 1e-16, no hatching over them; left out with a word unless it is asked for."""
    study = SceneTables(scenes.load(name).with_numerics(grid=9, phases=16))
    draw = lambda **options: plots.ccf_figure(
        study.curvature, [study.scene.gait], error=study.curvature_error, **options
    )
    made = draw(components=("x", "y", "theta"))
    for k in range(3):
        colours = np.asarray(made.axes[k].collections[0].get_array())
        assert (np.abs(colours).max() > 1e-3) == (k in rows)
        assert (
            [x.get_text() for x in made.axes[3 + k].get_yticklabels()] == ["0"]
        ) == (k not in rows)
    assert not made.get_supxlabel()
    made = draw()
    titles = [ax.get_title() for ax in made.axes if ax.get_title()]
    assert [title.partition("$: ")[2] for title in titles] == [
        ("forward", "sideways", "turning")[k] for k in rows
    ]
    assert made.get_supxlabel().endswith(": zero everywhere")
    assert made.get_supxlabel().count("CCF") == 3 - len(rows)


def test_colours_have_a_limit():
    """A number or a percentile of the size; arrows of the bar say where there is more. One legend for all panels."""
    values = np.stack([SHAPES[0], 2 * SHAPES[1], SHAPES[0] + 9])
    field, error = (
        Field(AXES, values),
        Field(AXES, np.where(SHAPES[1] > 1.2, 50.0, 1e-3) * np.ones((3, 1, 1))),
    )
    limits = lambda **o: [
        only(ax, QuadMesh).get_clim()[1]
        for ax in plots.ccf_figure(field, **o).axes[: len(o["components"])]
    ]
    assert limits(components=("theta", "x"), clim=0.25) == [0.25, 0.25]
    expected = [np.percentile(np.abs(x), 90) for x in values]
    np.testing.assert_allclose(
        limits(components=("x", "y", "theta"), clim="90%"), expected
    )
    assert only(plots.ccf_map(field, 1, clim="90%"), QuadMesh).get_clim()[
        1
    ] == pytest.approx(expected[1])
    for clim, ends in ((None, "neither"), (1.2, "max"), (0.5, "both")):
        bar = only(
            plots.ccf_figure(field, components=("x",), clim=clim).axes[0], QuadMesh
        ).colorbar
        assert bar.extend == ends
    fig = plots.ccf_figure(field, error=error)
    assert [t.get_text() for legend in fig.legends for t in legend.get_texts()] == [
        plots.HATCHED
    ]
    assert not any(ax.get_legend() for ax in fig.axes)


def test_two_percentiles_are_ends_of_the_values():
    """Colours of a CCF stay centred on zero, as far as the further of the two; "5:9" and the like are no limits."""
    values = np.stack([SHAPES[0] + 0.5, SHAPES[1], SHAPES[0]])
    top = max(abs(np.percentile(values[0], p)) for p in (20, 90))
    limits = only(
        plots.ccf_map(Field(AXES, values), 0, clim="20%:90%"), QuadMesh
    ).get_clim()
    assert limits == pytest.approx((-top, top)) and top == pytest.approx(
        np.percentile(values[0], 90)
    )
    assert colour_limit("5%:95%") == "5%:95%"
    assert colour_limit("0.3", ("theta",)) == colour_limit("0.3", ("x", "y")) == 0.3
    with pytest.raises(ValueError, match="one limit"):
        colour_limit("0.3", ("theta", "x"))
    for text in ("5:9", "95%:5%", "5%:9", "5%:5%", "0%", "1%:2%:3%"):
        with pytest.raises(Refusal, match="is no limit"):
            colour_limit(text)


def test_each_row_of_a_connection_has_its_scale_whose_top_may_be_a_percentile():
    A = (
        np.random.default_rng(1).normal(size=(3, 2, 11, 9))
        * np.array([1.0, 20.0, 300.0])[:, None, None, None]
    )
    fitted, sizes = (
        Connection(AXES, A, np.abs(A[:, 0]), np.abs(A[:, 0])),
        np.hypot(A[:, 0], A[:, 1]),
    )
    tops = lambda **o: [
        only(ax, Quiver).get_clim()[1]
        for ax in plots.connection_figure(fitted, **o).axes[:3]
    ]
    np.testing.assert_allclose(tops(), sizes.max((1, 2)))
    np.testing.assert_allclose(tops(clim="80%"), np.percentile(sizes, 80, axis=(1, 2)))
    np.testing.assert_allclose(tops(clim="5%:80%"), tops(clim="80%"))
    assert tops(clim=0.7) == [0.7] * 3
    arrows = only(plots.vector_field(fitted, 1, clim="80%"), Quiver)
    cut = np.fmin(1.0, np.percentile(sizes[1], 80) / sizes[1])
    np.testing.assert_allclose(arrows.U, (cut * A[1, 0]).ravel())
    assert (
        arrows.colorbar.extend == "max"
        and only(plots.vector_field(fitted, 1), Quiver).colorbar.extend == "neither"
    )


def test_components_choose_rows_of_the_connection():
    A = np.random.default_rng(1).normal(size=(3, 2, 11, 9))
    A[1] = 0.0
    fitted = Connection(AXES, A, np.abs(A[:, 0]), np.abs(A[:, 0]))
    titles = lambda **o: [
        ax.get_title().partition("$: ")[2]
        for ax in plots.connection_figure(fitted, **o).axes
        if ax.get_title()
    ]
    assert titles() == ["forward", "turning"]
    assert titles(components=("y", "theta")) == ["sideways", "turning"]
    assert (
        plots.connection_figure(fitted).get_supxlabel()
        == r"$\mathbf{A}^{y}$: zero everywhere"
    )


def test_options_of_figures_reach_them_from_commands(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(plots, "save", lambda fig, *paths: drawn.append(fig))
    (tmp_path / "own.csv").write_text(
        "amplitude_deg,value,error\n30,-0.01,0.002\n60,-0.05,0.004\n"
    )

    def figures(*args):
        drawn.clear()
        code, _, err = geomech(*args, cwd=tmp_path)
        assert code == 0, err
        return drawn

    limit = lambda fig: only(fig.axes[0], QuadMesh).get_clim()[1]
    args = ("--plot", "a.png", "--component", "x", "--data", "own.csv")
    (fig,) = figures(
        "displacement",
        "three-link-viscous",
        "--amplitudes",
        "0.5,1",
        "--tiers",
        "direct",
        *args,
    )
    (ax,) = fig.axes
    (points,) = (c for c in ax.containers if c.get_label() == MEASURED)
    np.testing.assert_allclose(
        points.lines[0].get_xydata(), [[np.pi / 6, -0.01], [np.pi / 3, -0.05]]
    )
    assert ax.get_ylabel() == "x per cycle (BL)"
    (fig,) = figures(
        "ccf",
        "three-link-viscous",
        "--grid",
        "7",
        "--plot",
        "a.png",
        "--component",
        "theta",
        "--clim",
        "0.5",
    )
    assert limit(fig) == 0.5 and "turning" in fig.axes[0].get_title()
    (fig,) = figures(
        "connection",
        "three-link-viscous",
        "--grid",
        "7",
        "-o",
        "a.nc",
        "--plot",
        "a.png",
        "--component",
        "y,x",
    )
    assert [
        "sideways" in fig.axes[0].get_title(),
        "forward" in fig.axes[1].get_title(),
    ] == [True, True]
    objective = ("--objective", "displacement", "--harmonics", "1")
    (fig,) = figures(
        "optimize",
        "three-link-viscous",
        *objective,
        "--plot",
        "a.png",
        "--clim",
        "0.01",
    )
    assert limit(fig) == 0.01
    rows, ccf, moved = figures(
        "run",
        "three-link-viscous",
        "-o",
        "out",
        "--component",
        "x",
        "--clim",
        "0.02",
        "--data",
        "own.csv",
    )
    assert (
        limit(ccf) == 0.02
        and sum(bool(ax.get_title()) for fig in (rows, ccf) for ax in fig.axes) == 2
    )
    assert [
        any(c.get_label() == MEASURED for c in ax.containers) for ax in moved.axes
    ] == [True, False]


def test_a_picture_in_a_file_has_200_dots_an_inch(tmp_path):
    plots.save(plots.figure(3.0, 2.0)[0], tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (600, 400)
