"""An optimal gait: its loop on the CCF map, coloured by its limits, and its angles over a cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.optimisation import Optimum
from geomech.optimisation.gain import PHASES, limiting
from geomech.plots.maps import ccf_map, shape_space
from geomech.plots.stretched import stretched_map
from geomech.plots.style import axes_of, figure, quantity, styled
from geomech.studies.effort import units
from geomech.systems.base import shape_labels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LONG = 12  # letters of a name: a legend of longer ones has a line for each
LIMITS = {  # of a loop: colour, text
    "zero": ("black", "runs along the zero line"),
    "limit": ("#D55E00", "at the joint limit"),
    "singular": ("#0072B2", "as near to singular shapes as it may"),
    "length": ("#009E73", "off the zero line: path length holds it back"),
    "else": ("#CC79A7", "off the zero line"),
    "loop": ("black", "best"),
}
RESIDUAL = {
    "length": ",\nand what A leaves of the law",
    "else": ": what A leaves of the law",
}  # where drag is not linear


@styled
def optimum_map(
    optimum: Optimum, ax: Axes | None = None, clim: float | str | None = None
) -> Axes:
    """Draw the best loop on the map of the CCF that it gains, coloured by what limits it; the start dashed. Sign and
    colours are those of `ccf_figure` in the same frame. Where the velocity does not follow from shape alone there is no CCF,
    and the map has the loop alone.

    clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> ax = geomech.plots.optimum_map(geomech.optimise("three-link-viscous", harmonics=1, starts=1))
    """
    ax, system = axes_of(ax, 4.6, 5.2), optimum.scene.system
    if optimum.gained is None:
        shape_space(
            ax,
            [np.linspace(-1, 1, 2) * optimum.scene.numerics.extent] * 2,
            shape_labels(system),
        )
        ax.set_title("no CCF: the velocity does not follow\nfrom shape alone")
    else:
        field, component = optimum.gained
        ccf_map(field, component, ax=ax, labels=shape_labels(system), clim=clim)
        frame = (
            f"frame {optimum.scene.frame}"
            if field.masked
            else "minimum-perturbation frame"
        )
        ax.set_title(f"{ax.get_title()},\n{frame}")
    draw_start_and_best(optimum, ax, lambda curve: curve)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1)
    return ax


@styled
def stretched_optimum(
    optimum: Optimum, ax: Axes | None = None, clim: float | str | None = None
) -> Axes:
    """Draw `optimum_map` on shape space redrawn so that equal lengths are equal path lengths. Refusal for a system without a
    metric."""
    ax, system, (field, component) = axes_of(ax), optimum.scene.system, optimum.gained
    plane = optimum.stretched
    look = {
        "labels": shape_labels(system),
        "unit": units(system)["path_length"],
        "clim": clim,
    }
    stretched_map(field, plane, component, ax=ax, **look)
    ax.set_title(
        f"the same, stretched to path lengths\n(lengths off by {100 * plane.rms:.2g} % rms)"
    )
    low, high = ([a[k] for a in plane.field.axes] for k in (0, -1))
    draw_start_and_best(optimum, ax, lambda curve: plane(np.clip(curve, low, high)))
    return ax


def draw_start_and_best(optimum: Optimum, ax, place) -> None:
    """Draw both loops, each shape where ``place`` puts it."""
    t = np.linspace(0, 2 * np.pi, PHASES)
    ax.plot(
        *place(optimum.start.gait.shape(t)).T,
        color="0.25",
        lw=0.9,
        ls="--",
        label="start",
    )
    nonlinear = optimum.gained is not None and not optimum.scene.system.traits.linear
    draw_limited(ax, place(optimum.gait.shape(t)), limiting(optimum), nonlinear)


def draw_limited(
    ax, curve: np.ndarray, kinds: np.ndarray, nonlinear: bool = False
) -> None:
    """Draw a curve (P, 2) in the colours of LIMITS, with a dot at its start and an arrow along it. nonlinear: drag is not
    linear, so that A is not all."""
    for kind, (colour, text) in LIMITS.items():
        mask = kinds == kind
        if mask.any():
            joined = mask | np.roll(mask, 1)
            ax.plot(
                *np.where(joined, curve.T, np.nan),
                color=colour,
                lw=1.8,
                label=text + RESIDUAL.get(kind, "") * nonlinear,
            )
    ax.plot(*curve[0], "o", color="black", ms=3)
    ax.annotate(
        "",
        curve[100],
        curve[90],
        arrowprops={"arrowstyle": "-|>", "color": "black", "shrinkA": 0, "shrinkB": 0},
    )


@styled
def optimum_angles(optimum: Optimum, ax: Axes | None = None) -> Axes:
    """Draw the shape variables of the best gait over a cycle, and the limits.

    Examples
    --------
    >>> import geomech
    >>> ax = geomech.plots.optimum_angles(geomech.optimise("three-link-viscous", harmonics=1, starts=1))
    """
    ax, gait = axes_of(ax, 4.0, 3.4), optimum.gait
    t = np.linspace(0, 2 * np.pi, PHASES)
    names = shape_labels(optimum.scene.system)
    step = max(1, gait.joints // 6)
    for k, curve in list(enumerate(gait.shape(t).T))[step // 2 :: step]:
        ax.plot(t, curve, label=quantity(names[k][0]))
    if any(x.startswith("alpha") for x in optimum.active):
        for side in np.unique(optimum.request.loops.box):
            ax.axhline(side, color=LIMITS["limit"][0], lw=0.8, ls=":")
    ax.set(
        xlabel="phase $t$ (rad)", ylabel=f"shape ({names[0][1]})", xlim=(0, 2 * np.pi)
    )
    ax.set(
        xticks=np.pi / 2 * np.arange(5),
        xticklabels=["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"],
    )
    best, objective = optimum.best, optimum.request.objective
    start = optimum.start.value
    ax.set_title(
        f"{objective.name}: {best.value:.4g} {objective.unit}\n(start {start if start > 1e-9 else 0.0:.4g})"
    )
    long = max(len(name) for name, _ in names) > LONG
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1 if long else 3)
    return ax


@styled
def optimum_figure(
    optimum: Optimum, stretched: bool = False, *, clim: float | str | None = None
) -> Figure:
    """Draw `optimum_map` and `optimum_angles` side by side; the angles alone where there are not two joints. stretched:
    `stretched_optimum` between them. clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> fig = geomech.plots.optimum_figure(geomech.optimise("three-link-viscous", harmonics=1, starts=1))
    """
    if optimum.scene.system.joints != 2:
        fig, axes = figure(3.8, 3.4)
        optimum_angles(optimum, axes[0, 0])
        return fig
    fig, axes = figure(11.8 if stretched else 7.6, 3.9, 3 if stretched else 2)
    optimum_map(optimum, axes[0, 0], clim)
    if stretched:
        stretched_optimum(optimum, axes[0, 1], clim)
    optimum_angles(optimum, axes[0, -1])
    return fig
