"""Pictures of the vertical plane: maps of stress per depth, and forces along a motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geomech.output.plots.maps import largest
from geomech.output.plots.style import figure, styled

POSES = 5  # of the body that are drawn


@styled
def stress_figure(survey, point: tuple[float, float] | None = None):
    """alpha_z and alpha_x over tilt and direction of motion (Fig. 7(c) and (d)) of an `rft.vertical.Survey`, hatched where the
    map pulls. point: (beta, gamma) in degrees to mark."""
    fig, axes = figure(8.6, 3.5, 2)
    for ax, name in zip(axes[0], "zx"):
        stress_map(ax, survey, name)
        if survey.pulling:
            ax.set_title("hatched: pulls on the leading face", loc="left", fontsize=8)
        if point:
            ax.plot(*_shown(*point), "o", mfc="white", mec="black", ms=5, clip_on=False, zorder=5)
    return fig


def stress_map(ax, survey, name: str):
    """alpha_x or alpha_z (``name`` "x" or "z") of an `rft.vertical.Survey` for motion forwards, hatched where it pulls. Colours
    are to the scale of both."""
    from cmcrameri import cm

    ahead = np.abs(survey.gamma) < np.pi / 2
    beta, gamma = np.degrees(survey.beta), np.degrees(survey.gamma[ahead])
    values, top = getattr(survey, f"alpha_{name}")[:, ahead].T, largest(np.stack([survey.alpha_x, survey.alpha_z]))
    colours = {"cmap": cm.vik, "vmin": -top, "vmax": top}
    image = ax.pcolormesh(beta, gamma, values, shading="nearest", rasterized=True, **colours)
    ax.contour(beta, gamma, values, levels=[0.0], colors="0.35", linewidths=0.6)
    if survey.pulling:
        pulled = (survey.normal[:, ahead] > 0).T
        ax.contourf(beta, gamma, pulled, levels=[0.5, 1.5], colors="none", hatches=["////"])
    square_of_angles(ax)
    ax.figure.colorbar(image, ax=ax, shrink=0.85).set_label(rf"$\alpha_{name}$ (N/cm$^3$)")
    return ax


def square_of_angles(ax) -> None:
    """Axes of tilt and direction of motion."""
    ticks = [-90, -45, 0, 45, 90]
    ax.set(xlabel=r"tilt $\beta$ (degrees)", ylabel=r"direction $\gamma$ below the horizontal (degrees)")
    ax.set(aspect="equal", xlim=(-90, 90), ylim=(-90, 90), xticks=ticks, yticks=ticks)


def _shown(beta: float, gamma: float) -> tuple[float, float]:
    """The point of the map for any angles: motion backwards is that of the mirror image."""
    beta, gamma = beta - 180 * round(beta / 180), gamma - 360 * round(gamma / 360)
    return (beta, gamma) if abs(gamma) <= 90 else (-beta, np.copysign(180, gamma) - gamma)


@styled
def intrusion_figure(columns: Mapping[str, np.ndarray], points: np.ndarray, pose: np.ndarray):
    """The body with its outline ``points`` (N, 2) at a few of its poses (T, 3), and force and moment along the motion."""
    fig, axes = figure(10.2, 3.2, 3)
    _poses(axes[0, 0], points, pose)
    place, label, scale = _abscissa(columns)
    at = scale * columns[place]
    for name, colour, text in (("force_x", "C0", "$F_x$, forwards"), ("force_z", "C3", "$F_z$, upwards")):
        axes[0, 1].plot(at, columns[name], color=colour, label=text)
    axes[0, 1].set(xlabel=label, ylabel="force (N)")
    axes[0, 1].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    axes[0, 2].plot(at, columns["moment"], color="0.2")
    axes[0, 2].set(xlabel=label, ylabel="moment about the origin (N m)")
    for ax in axes[0, 1:]:
        ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
        ax.margins(x=0.02)
    return fig


def _poses(ax, points, pose) -> None:
    for shade, k in zip(np.linspace(0.75, 0.0, POSES), np.linspace(0, len(pose) - 1, POSES).round().astype(int)):
        x, z, angle = pose[k]
        cos, sin = np.cos(angle), np.sin(angle)
        at = points @ np.array([[cos, -sin], [sin, cos]]) + [x, z]
        ax.plot(*at.T, color=str(shade), lw=1.0)
    ax.plot(
        pose[:, 0], pose[:, 1], color="C0", lw=0.8, ls=":", marker="o" if np.ptp(pose[:, :2], axis=0).max() == 0 else ""
    )
    ax.axhline(0.0, color="peru", lw=1.0, zorder=0)
    ax.set(xlabel="x (m)", ylabel="z (m)", aspect="equal", title="light to dark: poses in time; brown: surface")
    ax.title.set(fontsize=8)
    ax.margins(0.08)


def _abscissa(columns) -> tuple[str, str, float]:
    if "angle" in columns:
        return "angle", "angle (degrees)", 180 / np.pi
    back_and_forth = lambda name: np.unique(np.sign(np.diff(columns[name]))).size > 1
    if np.ptp(columns["z"]) > np.ptp(columns["x"]) and not back_and_forth("z"):
        return "z", "height of the origin, z (m)", 1.0
    return ("t", "t (s)", 1.0) if back_and_forth("x") else ("x", "x (m)", 1.0)


@styled
def elements_figure(results: Mapping):
    """Error of an intruder scene against the number of elements, and against seconds (`geomech.study.intrusion`)."""
    fig, axes = figure(7.2, 3.2, 2)
    for line, colour, marker in zip(results["lines"], ("C0", "0.2"), "os"):
        order = "" if line["slope"] is None else f", order {line['slope']:.1f}"
        for ax, at in zip(axes[0], (line["value"], line["seconds"])):
            error = np.maximum(line["error"], 1e-17)
            ax.loglog(at, error, color=colour, marker=marker, lw=1.0, label=line["label"] + order)
    for ax, label in zip(axes[0], ("elements", f"seconds for {results['poses']} poses")):
        ax.set(xlabel=label, ylabel="rms error / largest of the motion")
        ax.grid(True, which="major", lw=0.3, color="0.85")
    axes[0, 0].set_xticks(results["lines"][0]["value"], map(str, results["lines"][0]["value"]))
    axes[0, 0].minorticks_off()
    axes[0, 0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return fig
