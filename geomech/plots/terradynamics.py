"""Pictures of the vertical plane: maps of stress per depth, and forces along a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.plots.maps import largest
from geomech.plots.style import figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POSES = 5  # of the body that are drawn
COLOURS = {"x": "C0", "y": "C2", "z": "C3"}


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
            ax.set_title("hatched: pulls on the leading face", loc="left", fontsize=8)
        if point:
            ax.plot(
                *_point_on_map(*point),
                "o",
                mfc="white",
                mec="black",
                ms=5,
                clip_on=False,
                zorder=5,
            )
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
    from cmcrameri import cm

    ahead = np.abs(survey.gamma) < np.pi / 2
    beta, gamma = np.degrees(survey.beta), np.degrees(survey.gamma[ahead])
    values, top = (
        getattr(survey, f"alpha_{name}")[:, ahead].T,
        largest(np.stack([survey.alpha_x, survey.alpha_z])),
    )
    colours = {"cmap": cm.vik, "vmin": -top, "vmax": top}
    image = ax.pcolormesh(
        beta, gamma, values, shading="nearest", rasterized=True, **colours
    )
    ax.contour(beta, gamma, values, levels=[0.0], colors="0.35", linewidths=0.6)
    if survey.pulling:
        pulled = (survey.normal[:, ahead] > 0).T
        ax.contourf(
            beta, gamma, pulled, levels=[0.5, 1.5], colors="none", hatches=["////"]
        )
    square_of_angles(ax)
    ax.figure.colorbar(image, ax=ax, shrink=0.85).set_label(
        rf"$\alpha_{name}$ (N/cm$^3$)"
    )
    return ax


def square_of_angles(ax: Axes) -> None:
    """Set the axes of tilt and direction of motion."""
    ticks = [-90, -45, 0, 45, 90]
    ax.set(
        xlabel=r"tilt $\beta$ (degrees)",
        ylabel=r"direction $\gamma$ below the horizontal (degrees)",
    )
    ax.set(aspect="equal", xlim=(-90, 90), ylim=(-90, 90), xticks=ticks, yticks=ticks)


def _point_on_map(beta: float, gamma: float) -> tuple[float, float]:
    """Return the point of the map for any angles: motion backwards is the mirror image."""
    beta, gamma = beta - 180 * round(beta / 180), gamma - 360 * round(gamma / 360)
    return (
        (beta, gamma) if abs(gamma) <= 90 else (-beta, np.copysign(180, gamma) - gamma)
    )


@styled
def intrusion_figure(scene: Any, result: Any) -> Any:
    """Draw an intruder scene and the result of its motion: the body, and force and moment
    along the motion. An outline is drawn at a few of its poses, a mesh where the force is
    largest, with the stress on its faces.

    Examples
    --------
    >>> import geomech
    >>> forces = geomech.study("c-leg").intrude()
    >>> fig = geomech.plots.intrusion_figure(geomech.load("c-leg"), forces)
    """
    fig, axes = figure(10.2, 3.2, 3)
    columns = {name: v.values for name, v in result.items() if v.dims == ("t",)}
    if hasattr(scene, "mesh"):
        from geomech.scenes.solid import MeshIntrusion

        force = np.stack([columns[f"force_{axis}"] for axis in "xyz"], -1)
        step = int(np.linalg.norm(force, axis=-1).argmax())
        axes[0, 0].remove()
        ax = fig.add_subplot(1, 3, 1, projection="3d")
        trajectory = scene.motion.trajectory(scene.mesh)
        run = MeshIntrusion(trajectory, force, columns["moment"], columns["power"])
        draw_stress(ax, *scene.faces(run, step))
        title = f"where the force is largest, t = {columns['t'][step]:.3g} s"
        ax.set_title(title, fontsize=8)
        names = {
            "force": [f"force_{a}" for a in "xyz"],
            "moment": [f"moment_{a}" for a in "xyz"],
        }
    else:
        _, pose, _ = scene.motion.trajectory(scene.outline)
        _poses(axes[0, 0], scene.outline.points, pose)
        names = {"force": ["force_x", "force_z"], "moment": ["moment"]}
    place, label, scale = _abscissa(columns)
    for ax, (what, unit), letter in zip(
        axes[0, 1:], (("force", "N"), ("moment", "N m")), "FM"
    ):
        for name in names[what]:
            axis = name[-1]
            text = f"${letter}_{axis}$" + {
                "force_x": ", forwards",
                "force_z": ", upwards",
            }.get(name, "")
            ax.plot(
                scale * columns[place],
                columns[name],
                color=COLOURS.get(axis, "0.2"),
                label=text,
            )
        if len(names[what]) > 1:
            ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
        ax.set(
            xlabel=label,
            ylabel=f"{what} ({unit})"
            if what == "force"
            else f"moment about the origin ({unit})",
        )
        ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
        ax.margins(x=0.02)
    return fig


def draw_stress(ax: Any, faces: Any, above: np.ndarray, unit: float = 1e3) -> None:
    """Draw the faces below the surface (`rft.terradynamics.meshes.Faces`) on 3-D axes,
    coloured by the size of the stress on them, and the triangles ``above`` it (Q, 3, 3)
    in grey."""
    from cmcrameri import cm
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    a, b, c = faces.corners.swapaxes(0, 1)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2
    stress = (
        np.linalg.norm(faces.force, axis=-1) / np.where(areas > 0, areas, 1.0) / unit
    )
    shades = ScalarMappable(
        Normalize(0.0, max(stress.max(initial=0.0), 1e-12)), cm.lajolla_r
    )
    colours = np.concatenate(
        [shades.to_rgba(stress), np.full((len(above), 4), [0.87, 0.87, 0.87, 1.0])]
    )
    corners = np.concatenate([faces.corners, above])
    ax.add_collection3d(
        Poly3DCollection(
            corners, facecolors=colours, edgecolors=colours, lw=0.2, rasterized=True
        )
    )
    x, y, z = faces.force.sum(0)  # seen a little from the side of what bears it
    if x or y or z:
        ax.view_init(
            elev=-np.degrees(np.arctan2(z, 2 * np.hypot(x, y))) / 2,
            azim=np.degrees(np.arctan2(-y, -x)) - 35,
        )
    low, high = corners.min((0, 1)), corners.max((0, 1))
    _scale(ax, low, high - low)
    ax.figure.colorbar(shades, ax=ax, shrink=0.7, pad=0.02).set_label(
        "stress below the surface (kPa)"
    )


def _scale(ax, low, span) -> None:
    """Set axes that hold a body that begins at ``low`` and is as large as ``span``, with arrows of a round length in place of
    ticks."""
    length = 0.3 * span.max()
    length = max(
        k for k in (10.0 ** np.arange(-9, 3)[:, None] * [1, 2, 5]).flat if k <= length
    )
    corner = low - 0.1 * length
    for axis, arrow in zip("xyz", np.eye(3) * length):
        ax.plot(*np.stack([corner, corner + arrow], 1), color="0.3", lw=1.0)
        ax.text(
            *(corner + 1.25 * arrow),
            f"${axis}$",
            color="0.3",
            fontsize=8,
            ha="center",
            va="center",
        )
    low = corner - 0.1 * length
    high = np.maximum(low + span + 0.2 * length, corner + 1.3 * length)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low, zoom=0.95)
    ax.set_axis_off()
    ax.text2D(
        0.0,
        0.02,
        f"axes: {1e3 * length:g} mm",
        transform=ax.transAxes,
        fontsize=8,
        color="0.3",
    )


def _poses(ax, points, pose) -> None:
    for shade, k in zip(
        np.linspace(0.75, 0.0, POSES),
        np.linspace(0, len(pose) - 1, POSES).round().astype(int),
    ):
        x, z, angle = pose[k]
        cos, sin = np.cos(angle), np.sin(angle)
        at = points @ np.array([[cos, -sin], [sin, cos]]) + [x, z]
        ax.plot(*at.T, color=str(shade), lw=1.0)
    ax.plot(
        pose[:, 0],
        pose[:, 1],
        color="C0",
        lw=0.8,
        ls=":",
        marker="o" if np.ptp(pose[:, :2], axis=0).max() == 0 else "",
    )
    ax.axhline(0.0, color="peru", lw=1.0, zorder=0)
    ax.set(
        xlabel="x (m)",
        ylabel="z (m)",
        aspect="equal",
        title="light to dark: poses in time; brown: surface",
    )
    ax.title.set(fontsize=8)
    ax.margins(0.08)


def _abscissa(columns) -> tuple[str, str, float]:
    if "angle" in columns:
        return "angle", "angle (degrees)", 180 / np.pi
    if np.ptp(columns.get("y", 0.0)) > max(np.ptp(columns["x"]), np.ptp(columns["z"])):
        return "t", "t (s)", 1.0
    back_and_forth = lambda name: np.unique(np.sign(np.diff(columns[name]))).size > 1
    if np.ptp(columns["z"]) > np.ptp(columns["x"]) and not back_and_forth("z"):
        return "z", "height of the origin, z (m)", 1.0
    return ("t", "t (s)", 1.0) if back_and_forth("x") else ("x", "x (m)", 1.0)
