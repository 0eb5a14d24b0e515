"""Pictures of the vertical plane: maps of stress per depth, and forces along a
motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.plots.look import colours, font_points
from geomech.plots.maps import draw_colours, largest
from geomech.plots.style import figure, styled
from geomech.results.lengths import shown_lengths
from geomech.scenes.terradynamics.solid import MeshIntrusion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POSES = 5  # of the body that are drawn
COLOURS = {"x": "C0", "y": "C2", "z": "C3"}
DIRECTIONS = {"force_x": ", forwards", "force_z": ", upwards"}
ROUND_LENGTHS = (10.0 ** np.arange(-9, 3)[:, None] * [1, 2, 5]).ravel()  # m


@styled
def stress_figure(survey: Any, point: tuple[float, float] | None = None) -> Figure:
    """Draw alpha_z and alpha_x of an `rft.terradynamics.plates.Survey` over tilt and
    direction of motion (Fig. 7(c) and (d)), hatched where the map pulls.

    point: (beta, gamma) in degrees to mark.

    Examples
    --------
    >>> from geomech.plots import stress_figure
    >>> from rft.terradynamics.plates import StressMap, survey
    >>> fig = stress_figure(survey(StressMap(), cells=30))
    """
    fig, axes = figure(8.6, 3.5, 2)
    for ax, name in zip(axes[0], "zx"):
        stress_map(ax, survey, name)
        if survey.pulling:
            ax.set_title(
                "hatched: pulls on the leading face",
                loc="left",
                fontsize=font_points(8),
            )
        if point:
            beta, gamma, _ = mirrored_ahead(*point)
            look = {"mfc": "white", "mec": "black", "ms": 5, "zorder": 5}
            ax.plot(beta, gamma, "o", clip_on=False, **look)
    return fig


def stress_map(ax: Axes, survey: Any, name: str) -> Axes:
    """Draw alpha_x or alpha_z (``name`` "x" or "z") of an
    `rft.terradynamics.plates.Survey` for motion forwards, hatched where it pulls. Both
    have one scale of colours.

    Examples
    --------
    >>> from geomech.plots import figure, stress_map
    >>> from rft.terradynamics.plates import StressMap, survey
    >>> fig, axes = figure(3.5, 3.5)
    >>> ax = stress_map(axes[0, 0], survey(StressMap(), cells=30), "z")
    """
    is_ahead = np.abs(survey.gamma) < np.pi / 2
    beta = np.degrees(survey.beta)
    gamma = np.degrees(survey.gamma[is_ahead])
    values = getattr(survey, f"alpha_{name}")[:, is_ahead].T
    top = largest(np.stack([survey.alpha_x, survey.alpha_z]))
    image = draw_colours(ax, beta, gamma, values, top, "nearest")
    ax.contour(beta, gamma, values, levels=[0.0], colors="0.35", linewidths=0.6)
    if survey.pulling:
        pulls = (survey.normal[:, is_ahead] > 0).T
        hatching = {"levels": [0.5, 1.5], "colors": "none", "hatches": ["////"]}
        ax.contourf(beta, gamma, pulls, **hatching)
    square_of_angles(ax)
    bar = ax.figure.colorbar(image, ax=ax, shrink=0.85)
    bar.set_label(rf"$\alpha_{name}$ (N/cm$^3$)")
    return ax


def square_of_angles(ax: Axes) -> None:
    """Label the axes of tilt and direction of motion, in degrees, and set their
    limits."""
    ticks = [-90, -45, 0, 45, 90]
    ax.set(
        xlabel=r"tilt $\beta$ (degrees)",
        ylabel=r"direction $\gamma$ below the horizontal (degrees)",
    )
    ax.set(aspect="equal", xlim=(-90, 90), ylim=(-90, 90), xticks=ticks, yticks=ticks)


def mirrored_ahead(beta: Any, gamma: Any) -> tuple[Any, Any, Any]:
    """Return (tilt, direction, sign of alpha_x) of the same plate in motion ahead.

    Angles are in degrees, of any size at first and within +-90 then. Motion backwards
    is the mirror image, in which alpha_x changes sign: -1 there, else 1."""
    beta = beta - 180 * np.round(np.divide(beta, 180))
    gamma = gamma - 360 * np.round(np.divide(gamma, 360))
    is_back = np.abs(gamma) > 90
    mirrored_gamma = np.copysign(180.0, gamma) - gamma
    return (
        np.where(is_back, -beta, beta),
        np.where(is_back, mirrored_gamma, gamma),
        np.where(is_back, -1.0, 1.0),
    )


@styled
def intrusion_figure(scene: Any, result: Any) -> Any:
    """Draw an intruder scene and the result of its motion: the body, and force and
    moment along the motion. An outline is drawn at a few of its poses, a mesh where the
    force is largest, with the stress on its faces.

    Examples
    --------
    >>> import geomech
    >>> forces = geomech.study("c-leg").intrude()
    >>> fig = geomech.plots.intrusion_figure(geomech.load("c-leg"), forces)
    """
    fig, axes = figure(10.2, 3.2, 3)
    columns = {name: v.values for name, v in result.items() if v.dims == ("t",)}
    unit, factor = shown_lengths(result)
    if hasattr(scene, "mesh"):
        place = axes[0, 0].get_subplotspec()
        axes[0, 0].remove()
        ax = fig.add_subplot(place, projection="3d")
        _draw_largest_force(ax, scene, columns, unit, factor)
        forces = ["force_x", "force_y", "force_z"]
        moments = ["moment_x", "moment_y", "moment_z"]
    else:
        _, pose, _ = scene.motion.trajectory(scene.outline)
        pose = pose * [factor, factor, 1.0]
        _draw_poses(axes[0, 0], factor * scene.outline.points, pose, unit)
        forces = ["force_x", "force_z"]
        moments = ["moment"]

    variable, label, scale = _abscissa(columns, unit)
    x = scale * columns[variable]
    force_ax = axes[0, 1]
    moment_ax = axes[0, 2]
    _draw_columns(force_ax, x, columns, forces, "F")
    _draw_columns(moment_ax, x, columns, moments, "M")
    force_ax.set(xlabel=label, ylabel="force (N)")
    moment_unit = result[moments[0]].unit
    moment_ax.set(xlabel=label, ylabel=f"moment about the origin ({moment_unit})")
    return fig


def _draw_largest_force(
    ax: Any, scene: Any, columns: dict[str, np.ndarray], unit: str, factor: float
) -> None:
    """Draw the mesh of an intruder where the force is largest, on 3-D axes.

    unit: of the arrows beside it. factor: of lengths in m to it."""
    force = np.stack([columns[f"force_{axis}"] for axis in "xyz"], -1)
    step = int(np.linalg.norm(force, axis=-1).argmax())
    trajectory = scene.motion.trajectory(scene.mesh)
    run = MeshIntrusion(trajectory, force, columns["moment"], columns["power"])
    scale = ("mm", 1e3) if unit == "m" else (unit, factor)
    draw_stress(ax, *scene.faces(run, step), scale=scale)
    t = columns["t"][step]
    ax.set_title(f"where the force is largest, t = {t:.3g} s", fontsize=font_points(8))


def _draw_columns(
    ax: Axes,
    x: np.ndarray,
    columns: dict[str, np.ndarray],
    names: list[str],
    letter: str,
) -> None:
    """Draw some columns of a result over x, with a legend where there are several.

    letter: their symbol, which takes the last letter of each name as its index."""
    for name in names:
        axis = name[-1]
        label = f"${letter}_{axis}$" + DIRECTIONS.get(name, "")
        ax.plot(x, columns[name], color=COLOURS.get(axis, "0.2"), label=label)
    if len(names) > 1:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    ax.margins(x=0.02)


def draw_stress(
    ax: Any,
    faces: Any,
    above: np.ndarray,
    unit: float = 1e3,
    scale: tuple[str, float] = ("mm", 1e3),
) -> None:
    """Draw a mesh on 3-D axes, coloured by the size of the stress on its faces.

    faces: those below the surface (`rft.terradynamics.meshes.Faces`). above: triangles
    above it (Q, 3, 3), which are grey. unit: of the colours, Pa. scale: unit of the
    length that arrows show, and how many of it a metre has."""
    from cmcrameri import cm
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    a, b, c = faces.corners.swapaxes(0, 1)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2
    force = np.linalg.norm(faces.force, axis=-1)
    stress = force / np.where(areas > 0, areas, 1.0) / unit
    top = max(stress.max(initial=0.0), 1e-12)
    shades = ScalarMappable(Normalize(0.0, top), colours(cm.lajolla_r))
    grey = np.full((len(above), 4), [0.87, 0.87, 0.87, 1.0])
    face_colours = np.concatenate([shades.to_rgba(stress), grey])
    corners = np.concatenate([faces.corners, above])
    look = {"facecolors": face_colours, "edgecolors": face_colours, "lw": 0.2}
    ax.add_collection3d(Poly3DCollection(corners, rasterized=True, **look))

    x, y, z = faces.force.sum(0)
    if x or y or z:
        # Seen from the side that bears the force, a little turned.
        elevation = -np.degrees(np.arctan2(z, 2 * np.hypot(x, y))) / 2
        azimuth = np.degrees(np.arctan2(-y, -x)) - 35
        ax.view_init(elev=elevation, azim=azimuth)
    low = corners.min((0, 1))
    high = corners.max((0, 1))
    _draw_scale(ax, low, high - low, *scale)
    bar = ax.figure.colorbar(shades, ax=ax, shrink=0.7, pad=0.02)
    bar.set_label("stress below the surface (kPa)")


def _draw_scale(
    ax: Any, low: np.ndarray, span: np.ndarray, unit: str, factor: float
) -> None:
    """Set the limits of 3-D axes to a body, and draw arrows of a round length in place
    of ticks.

    low: the body's lowest coordinates (3,), m. span: its size along each axis, m. unit,
    factor: as of `draw_stress`."""
    longest = 0.3 * span.max()
    length = max(k for k in ROUND_LENGTHS if k <= longest)
    corner = low - 0.1 * length
    grey = {"color": "0.3"}
    for axis, arrow in zip("xyz", np.eye(3) * length):
        ax.plot(*np.stack([corner, corner + arrow], 1), lw=1.0, **grey)
        place = corner + 1.25 * arrow
        ax.text(
            *place,
            f"${axis}$",
            fontsize=font_points(8),
            ha="center",
            va="center",
            **grey,
        )
    low = corner - 0.1 * length
    high = np.maximum(low + span + 0.2 * length, corner + 1.3 * length)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low, zoom=0.95)
    ax.set_axis_off()
    text = f"axes: {factor * length:g} {unit}"
    ax.text2D(0.0, 0.02, text, transform=ax.transAxes, fontsize=font_points(8), **grey)


def _draw_poses(ax: Axes, points: np.ndarray, pose: np.ndarray, unit: str) -> None:
    """Draw an outline (N, 2) at some of its poses (T, 3), the track of its origin and
    the surface, all in a unit."""
    rows = np.linspace(0, len(pose) - 1, POSES).round().astype(int)
    for shade, k in zip(np.linspace(0.75, 0.0, POSES), rows):
        x, z, angle = pose[k]
        cos = np.cos(angle)
        sin = np.sin(angle)
        outline = points @ np.array([[cos, -sin], [sin, cos]]) + [x, z]
        ax.plot(*outline.T, color=str(shade), lw=1.0)
    is_still = np.ptp(pose[:, :2], axis=0).max() == 0
    marker = "o" if is_still else ""
    ax.plot(pose[:, 0], pose[:, 1], color="C0", lw=0.8, ls=":", marker=marker)
    ax.axhline(0.0, color="peru", lw=1.0, zorder=0)
    ax.set(xlabel=f"x ({unit})", ylabel=f"z ({unit})", aspect="equal")
    ax.set_title(
        "light to dark: poses in time; brown: surface", fontsize=font_points(8)
    )
    ax.margins(0.08)


def _abscissa(columns: dict[str, np.ndarray], unit: str) -> tuple[str, str, float]:
    """Return (column, label, factor of its values) of the quantity that a motion is
    drawn against: an angle, depth or x where it goes one way, else time. unit: of
    lengths."""
    time = ("t", "t (s)", 1.0)
    if "angle" in columns:
        return "angle", "angle (degrees)", 180 / np.pi
    x_range = np.ptp(columns["x"])
    z_range = np.ptp(columns["z"])
    if np.ptp(columns.get("y", 0.0)) > max(x_range, z_range):
        return time
    if z_range > x_range and not _reverses(columns["z"]):
        return "z", f"height of the origin, z ({unit})", 1.0
    if _reverses(columns["x"]):
        return time
    return "x", f"x ({unit})", 1.0


def _reverses(values: np.ndarray) -> bool:
    """Return whether values go back and forth."""
    return np.unique(np.sign(np.diff(values))).size > 1
