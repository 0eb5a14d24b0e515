"""What is drawn is what was computed: the data in the artists, not the look."""

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.quiver import Quiver

from figures import fig05c_force_law, fig10_neuromechanics
from geomech import scene as scenes
from geomech.connection import Connection
from geomech.field import Field
from geomech.gaits import Ellipse
from geomech.output import plots, sweeps
from geomech.study.bench import Study
from geomech.tiers import TIERS
from rft import CATALOGUE

AXES = np.linspace(-1.0, 1.5, 11), np.linspace(-0.5, 2.0, 9)
SHAPES = np.meshgrid(*AXES, indexing="ij")


def only(ax, kind):
    (found,) = (x for x in ax.collections if isinstance(x, kind))
    return found


def mesh(ax):
    """(alpha_1, alpha_2, values) at the corners or centres of the one mesh, as drawn."""
    drawn = only(ax, QuadMesh)
    x, y = np.moveaxis(drawn.get_coordinates(), -1, 0)
    if x.size > drawn.get_array().size:  # cells about the points
        x, y = ((c[1:, 1:] + c[:-1, :-1]) / 2 for c in (x, y))
    return x, y, np.reshape(drawn.get_array(), x.shape)


def label_of(ax):
    """Of the colour bar."""
    return [a.get_ylabel() for a in ax.figure.axes if a is not ax][-1]


@pytest.mark.parametrize("component", [0, 1, 2])
def test_arrows_are_the_row_asked_for(component):
    A = np.random.default_rng(0).normal(size=(3, 2, 11, 9))
    found = Connection(AXES, A, np.abs(A[:, 0]), np.abs(A[:, 0]))
    ax = plots.vector_field(found, component, "m", every=2)
    arrows = only(ax, Quiver)
    x, y = (s[1::2, 1::2] for s in SHAPES)
    np.testing.assert_allclose(arrows.get_offsets(), np.stack([x.ravel(), y.ravel()], -1))
    np.testing.assert_allclose([arrows.U, arrows.V], A[component, :, 1::2, 1::2].reshape(2, -1))
    assert plots.COMPONENTS[component] in label_of(ax)
    assert ("(rad/rad)" if component == 2 else "(m/rad)") in label_of(ax)


@pytest.mark.parametrize("component", [0, 1, 2])
def test_the_map_of_a_field_lies_as_the_field(component):
    """Mesh, line of zeros, hatching and gait of a field that is no mirror image of itself."""
    plane = SHAPES[0] + 2 * SHAPES[1]
    field = Field(AXES, np.stack([plane, 3 * plane, -plane]))
    error = Field(AXES, np.where(SHAPES[1] > 1.2, 50.0, 1e-3) * np.ones((3, 1, 1)))
    gait = Ellipse(centre=(0.2, 0.5), semi_axes=(0.6, 0.2), tilt=0.4)
    plain = plots.ccf_map(field, component, unit="m")
    ax = plots.ccf_map(field, component, [gait], "m", error=error)
    x, y, values = mesh(ax)
    np.testing.assert_allclose(values, (1, 3, -1)[component] * (x + 2 * y))
    assert only(ax, QuadMesh).get_clim() == pytest.approx((-np.abs(values).max(), np.abs(values).max()))
    hatched, zeros = (c for c in ax.collections if not isinstance(c, QuadMesh))
    line = np.concatenate([p.vertices for p in zeros.get_paths()])
    np.testing.assert_allclose(line[:, 0] + 2 * line[:, 1], 0, atol=1e-12)
    assert len(line) > 4
    assert hatched.hatches
    inside = lambda points: np.any([p.contains_points(points) for p in hatched.get_paths()], axis=0)
    assert inside([[0.9, 1.6], [-0.7, 1.5]]).all()
    assert not inside([[0.9, 0.9], [-0.7, 0.9]]).any()
    assert "hatched" in ax.get_title("left")
    curve = gait.shape(np.linspace(0, 2 * np.pi, 400))
    np.testing.assert_allclose(ax.lines[0].get_xydata(), curve)
    np.testing.assert_allclose(ax.lines[1].get_xydata(), curve[:1])
    assert ("(rad/rad$^2$)" if component == 2 else "(m/rad$^2$)") in label_of(ax)
    assert (ax.get_xlim(), ax.get_ylim()) == ((-1.0, 1.5), (-0.5, 2.0))
    assert len(plain.collections) == 2
    assert plain.get_title("left") == ""


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
    """In loose glass the turn's map has closed loops of zeros less than half a radian across, with its error it has none."""
    glass, found = scenes.load("three-link-glass"), {}
    for key, error in (("plain", None), ("known", Study(glass).curvature_error)):
        (path,) = plots.ccf_map(Study(glass).curvature, 2, error=error).collections[-1].get_paths()
        loops = [p for p in path.to_polygons(closed_only=False) if np.allclose(p[0], p[-1])]
        found[key] = [np.ptp(p, axis=0).max() for p in loops]
    assert min(found["plain"]) < 0.5
    assert min(found["known"], default=1.0) > 0.5


def test_lines_of_displacement_are_the_net_of_each_tier():
    table = {"amplitude": [0.5, 1.0], "direct": [[-0.3, 0.4, 0.1], [0.6, 0.8, 9.0]], "area": [[0.0, 1.0, 0], [2, 0, 0]]}
    ax = plots.displacement(table, "m", gait=Ellipse())
    lines = {line.get_label(): line for line in ax.lines}
    for tier, net in (("direct", [-0.5, 1.0]), ("area", [1.0, 2.0])):
        np.testing.assert_allclose(lines[TIERS[tier].label].get_xydata(), np.transpose([[0.5, 1.0], net]))
    assert len(lines) == 3
    assert ax.get_ylabel() == "displacement per cycle (m)"
    assert ax.get_xlabel() == Ellipse().amplitude_label


def test_the_map_of_a_sweep_lies_as_its_parameters():
    scene = scenes.load("three-link-glass")
    over = {"gait.amplitude": [0.5, 1.0, 1.5], "body.length": [2.0, 5.0]}
    moved = np.zeros((3, 2, 3))
    moved[..., 0] = [[1, -2], [3, 4], [5, 6]]
    errors = np.ones((3, 2)), np.ones((3, 2))
    results = {"over": over, "displacement": moved, "estimate": errors[0], "estimate_heading": errors[1]}
    ax = sweeps.draw(scene, results).axes[0]
    x, y, values = mesh(ax)
    np.testing.assert_allclose(x[0], over["gait.amplitude"])
    np.testing.assert_allclose(y[:, 0], over["body.length"])
    np.testing.assert_allclose(values, moved[..., 0].T)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (scene.gait.amplitude_label, "body.length")
    one = {"over": {"body.length": [2.0, 5.0]}, "displacement": moved[0], "estimate": np.array([0.1, 0.2])}
    ax = sweeps.draw(scene, one).axes[0]
    np.testing.assert_allclose(ax.lines[0].get_xydata(), [[2, 1], [5, -2]])
    np.testing.assert_allclose(ax.collections[0].get_segments(), [[[2, 0.9], [2, 1.1]], [[5, -2.2], [5, -1.8]]])


def test_fig05c_draws_across_solid_and_along_dashed():
    numbers = fig05c_force_law.compute(angles=7)
    ax = fig05c_force_law.draw(numbers).axes[0]
    psi = np.linspace(0, np.pi / 2, 7)
    for k, name in enumerate(("glass-0.3mm-loose", "glass-0.3mm-close", "viscous-2")):
        along, across = CATALOGUE[name].medium.traction(np.cos(psi), np.sin(psi))
        for line, values, dashes in ((ax.lines[2 * k], across, "-"), (ax.lines[2 * k + 1], along, "--")):
            np.testing.assert_allclose(line.get_xydata(), np.transpose([np.degrees(psi), values]), atol=1e-12)
            assert line.get_linestyle() == dashes
    scale = (
        numbers["fit"]["k"] * 2 * (0.588 * 1030) * 9.81 * 0.008 * 0.030 * 0.080
    )  # N, Eq. 2 and the header of the data
    across, along = ax.lines[6:8]
    np.testing.assert_allclose(across.get_ydata(), numbers["bed"]["perpendicular"] / scale)
    np.testing.assert_allclose(along.get_ydata(), numbers["bed"]["parallel"] / scale)
    assert across.get_markerfacecolor() != "white" == along.get_markerfacecolor()


def test_fig10_traces_the_place_it_names():
    """70 % of the way from head to tail, the caption's 0.71 pi of pi as the module reads it."""
    numbers = fig10_neuromechanics.compute((1.0,), elements=20, phases=32)
    figure = fig10_neuromechanics.draw(numbers)
    one, ax = numbers["one"], figure.axes[1]
    k = np.abs(one["s"] - 0.3).argmin()
    assert one["s"][k] == pytest.approx(0.3)
    for line, key in zip(ax.lines, ("bend", "moment")):
        trace = np.append(one[key][:, k], one[key][0, k])
        np.testing.assert_allclose(line.get_ydata(), trace / np.abs(trace).max())
        assert line.get_label().startswith("curvature" if key == "bend" else key)
    assert ax.get_ylabel().endswith("s = 0.3")
    onset, offset = (line.get_xdata()[0] for line in ax.lines[2:4])
    np.testing.assert_allclose([onset, offset], np.mod([one["onset"][k], one["offset"][k]], 2 * np.pi))
    across = [line.get_xydata() for line in figure.axes[0].lines]
    np.testing.assert_allclose(across[1], np.stack([one["s"], one["onset"]], -1))
    np.testing.assert_allclose(across[4], np.stack([one["s"], one["offset"]], -1))


def test_panels_are_x_y_and_theta():
    A = np.random.default_rng(1).normal(size=(3, 2, 11, 9))
    fitted = Connection(AXES, A, np.abs(A[:, 0]), np.abs(A[:, 0]))
    for component, ax in enumerate(plots.connection_figure(fitted).axes[:3]):
        np.testing.assert_allclose(only(ax, Quiver).V, A[component, 1].ravel())
    field = Field(AXES, A[:, 0])
    error = Field(AXES, np.abs(A[:, 1]))
    for component, ax in enumerate(plots.ccf_figure(field, error=error).axes[:3]):
        np.testing.assert_allclose(mesh(ax)[2], A[component, 0].T)
        assert ax.get_title("left")


def test_a_row_of_rounding_has_no_arrows():
    """A snake that cannot slip sideways, in the frame of a wheeled link: A^y is nothing."""
    fitted = Study(scenes.load("no-slip-snake").changed(frame="link-2").with_numerics(grid=8)).fitted
    arrows = [plots.vector_field(fitted, row).collections[0] for row in range(3)]
    lengths = [np.hypot(a.U, a.V)[~np.broadcast_to(a.Umask, a.U.shape)] for a in arrows]
    assert not lengths[1].any()
    assert arrows[1].get_clim() == (0.0, 1.0)
    for k in (0, 2):
        assert lengths[k].max() == pytest.approx(arrows[k].get_clim()[1])
