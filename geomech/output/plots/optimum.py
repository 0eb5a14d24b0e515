"""An optimal gait: its loop on the CCF map, coloured by what holds it there, and its angles over a cycle."""

from __future__ import annotations

import numpy as np

from geomech.connection import Connection
from geomech.curvature import ccf
from geomech.field import Field
from geomech.minimum_perturbation import minimum_perturbation
from geomech.optimise import Optimum
from geomech.optimise.loops import TOUCHING
from geomech.output.plots.maps import ccf_map, drawable
from geomech.output.plots.style import axes_of, figure, quantity, styled
from geomech.study.bench import Study

NEAR_ZERO = 0.15  # of the CCF's largest value inside the loop's box: below it a loop runs along the line of zeros
PHASES = 721
HOLDS = {  # what holds a loop: colour, text
    "zero": ("black", "runs along the zero line"),
    "limit": ("#D55E00", "at the joint limit"),
    "length": ("#009E73", "off the zero line: path length holds it back"),
    "else": ("#CC79A7", "off the zero line"),
}


def along(optimum: Optimum, study: Study | None = None) -> Field:
    """The CCF that tells what the aim gains by area, values (1, N_1, N_2): in the minimum-perturbation frame, along the
    displacement, or of the heading for turning. ValueError for singular shapes."""
    fitted, best = (study or Study(optimum.scene)).fitted, optimum.best
    frame = minimum_perturbation(fitted)
    there = ccf(Connection(fitted.axes, frame.connection(fitted), fitted.residual, fitted.speed, fitted.degree))
    if optimum.request.aim.name == "turning":
        return Field(there.axes, there.values[2:], there.degree)
    x, y, _ = frame.net(best.displacement, best.gait.shape(0.0))
    share = np.array([x, y]) / (np.hypot(x, y) or 1.0)
    return Field(there.axes, np.tensordot(share, there.values[:2], 1)[None], there.degree)


def held(optimum: Optimum, field: Field) -> np.ndarray:
    """(PHASES,): what of HOLDS holds the best loop at each phase, from ``field``, that of `along`."""
    alpha = optimum.gait.shape(np.linspace(0, 2 * np.pi, PHASES))
    value = np.abs(field(np.clip(alpha, [a[0] for a in field.axes], [a[-1] for a in field.axes]))[..., 0])
    low, high = alpha.min(0), alpha.max(0)
    inside = [(a >= lo) & (a <= hi) for a, lo, hi in zip(field.axes, low, high)]
    top = np.abs(field.values[0][np.ix_(*inside)]).max(initial=value.max())
    rest = "length" if optimum.request.aim.name == "efficiency" else "else"
    out = np.where(value <= NEAR_ZERO * top, "zero", rest)
    limit = getattr(optimum.request.loops, "within", np.inf)
    return np.where((np.abs(alpha) >= limit * (1 - TOUCHING)).any(-1), "limit", out)


@styled
def optimum_map(optimum: Optimum, ax=None, field: Field | None = None):
    """The best loop on the map of `along`, coloured by what holds it; the start dashed."""
    ax, scene = axes_of(ax), optimum.scene
    field = drawable(along(optimum) if field is None else field)
    unit = "rad" if optimum.request.aim.name == "turning" else scene.system.unit
    labels = scene.system.shape_labels
    ccf_map(field, 0, (), unit, ax, labels=labels)
    what = "heading" if optimum.request.aim.name == "turning" else "displacement"
    ax.set_title(f"CCF of the {what}, minimum-perturbation frame")
    bar = ax.collections[0].colorbar
    bar.set_label(bar.ax.get_ylabel().replace("$_{x}$", ""))
    t = np.linspace(0, 2 * np.pi, PHASES)
    ax.plot(*optimum.start.gait.shape(t).T, color="0.25", lw=0.9, ls="--", label="start")
    draw_held(ax, optimum.gait.shape(t), held(optimum, field))
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1)
    return ax


def draw_held(ax, curve: np.ndarray, kinds: np.ndarray) -> None:
    """A curve (P, 2) in the colours of HOLDS, with a dot at its start and an arrow along it."""
    for kind, (colour, text) in HOLDS.items():
        here = kinds == kind
        if here.any():
            whole = here | np.roll(here, 1)
            ax.plot(*np.where(whole, curve.T, np.nan), color=colour, lw=1.8, label=text)
    ax.plot(*curve[0], "o", color="black", ms=3)
    ax.annotate(
        "", curve[100], curve[90], arrowprops={"arrowstyle": "-|>", "color": "black", "shrinkA": 0, "shrinkB": 0}
    )


@styled
def angles(optimum: Optimum, ax=None):
    """Shape variables of the best gait over a cycle, and the limits."""
    ax, gait = axes_of(ax), optimum.gait
    t = np.linspace(0, 2 * np.pi, PHASES)
    names = optimum.scene.system.shape_labels
    every = max(1, gait.joints // 6)
    for k, curve in list(enumerate(gait.shape(t).T))[every // 2 :: every]:
        ax.plot(t, curve, label=quantity(names[k][0]))
    limit = getattr(optimum.request.loops, "within", None)
    if limit is not None and any(x.startswith("alpha") for x in optimum.active):
        for side in (-limit, limit):
            ax.axhline(side, color=HOLDS["limit"][0], lw=0.8, ls=":")
    ax.set(xlabel="phase $t$ (rad)", ylabel=f"shape ({names[0][1]})", xlim=(0, 2 * np.pi))
    ax.set(xticks=np.pi / 2 * np.arange(5), xticklabels=["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"])
    best, aim = optimum.best, optimum.request.aim
    ax.set_title(f"{aim.name}: {best.value:.4g} {aim.unit}\n(start {optimum.start.value:.4g})")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=3)
    return ax


@styled
def optimum_figure(optimum: Optimum):
    """`optimum_map` beside `angles`; the angles alone where there is no map."""
    scene = optimum.scene
    study = Study(scene)
    if scene.system.joints != 2 or "path" not in study.methods or scene.system.singularity is not None:
        fig, axes = figure(3.8, 3.4)
        angles(optimum, axes[0, 0])
        return fig
    fig, axes = figure(7.6, 3.9, 2)
    optimum_map(optimum, axes[0, 0], along(optimum, study))
    angles(optimum, axes[0, 1])
    return fig
