"""An optimal gait: its loop on the CCF map, coloured by what holds it there, and its angles over a cycle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geomech.geometry.connection import Connection
from geomech.geometry.curvature import ccf
from geomech.geometry.field import Field
from geomech.geometry.minimum_perturbation import minimum_perturbation
from geomech.geometry.stretch import stretch
from geomech.optimise import Optimum
from geomech.optimise.loops import TOUCHING
from geomech.output.plots.maps import ccf_map, drawable, shape_space
from geomech.output.plots.stretched import stretched_map
from geomech.output.plots.style import axes_of, figure, quantity, styled
from geomech.study.study import Study
from geomech.systems.base import shape_labels

NEAR_ZERO = 0.15  # of the CCF's largest value inside the loop's box: below it a loop runs along the line of zeros
NEAR_SINGULAR = 0.05  # of the least distance from singular shapes: a loop that is so near is held by them
PHASES = 721
LONG = 12  # letters of a name: a legend of longer ones has a line for each
HOLDS = {  # what holds a loop: colour, text
    "zero": ("black", "runs along the zero line"),
    "limit": ("#D55E00", "at the joint limit"),
    "singular": ("#0072B2", "as near to singular shapes as it may"),
    "length": ("#009E73", "off the zero line: path length holds it back"),
    "else": ("#CC79A7", "off the zero line"),
    "loop": ("black", "best"),
}
LEFT = {"length": ",\nand what A leaves of the law", "else": ": what A leaves of the law"}  # where drag is not linear


def along(optimum: Optimum, study: Study | None = None) -> Field:
    """The CCF that tells what the aim gains by area, values (1, N_1, N_2): along the displacement, or of the heading for
    turning, in the minimum-perturbation frame, or, where singular shapes leave none, in the scene's own."""
    fitted, best = (study or Study(optimum.scene)).fitted, optimum.best
    there, (x, y, _) = fitted, best.displacement
    if not fitted.field.masked:
        frame = minimum_perturbation(fitted)
        A = frame.connection(fitted)
        there = Connection(fitted.axes, A, fitted.residual, fitted.speed, fitted.degree, **fitted.size)
        x, y, _ = frame.net(best.displacement, best.gait.shape(0.0))
    found = ccf(there)
    turning = optimum.request.aim.name == "turning"
    share = np.array([0, 0, 1] if turning else [x, y, 0]) / (np.hypot(x, y) or 1.0)
    values = np.tensordot(share, found.values, 1)[None]
    return replace(found, values=values, unit="rad" if turning else found.unit)


def held(optimum: Optimum, field: Field | None) -> np.ndarray:
    """(PHASES,): what of HOLDS holds the best loop at each phase, from ``field``, that of `along`; None: without one."""
    alpha = optimum.gait.shape(np.linspace(0, 2 * np.pi, PHASES))
    rest = "length" if optimum.request.aim.name == "efficiency" else "else"
    out = np.full(PHASES, rest if field is not None else "loop", dtype="<U8")
    if field is not None:
        value = np.abs(_seen(field, alpha))
        inside = [(a >= lo) & (a <= hi) for a, lo, hi in zip(field.axes, alpha.min(0), alpha.max(0))]
        around = np.abs(field.values[0][np.ix_(*inside)])
        top = (
            np.nanmedian(around) if field.masked else around.max(initial=value.max())
        )  # beside singular shapes it is any
        out = np.where(value <= NEAR_ZERO * top, "zero", out)
    if "singular shapes" in optimum.active:
        away = np.abs(optimum.scene.system.traits.singularity(alpha))
        out = np.where(away <= away.min() * (1 + NEAR_SINGULAR), "singular", out)
    box = getattr(optimum.request.loops, "box", np.array([[-np.inf], [np.inf]]))
    near = TOUCHING * (box[1] - box[0]) / 2 if np.isfinite(box).all() else 0.0
    return np.where(((alpha <= box[0] + near) | (alpha >= box[1] - near)).any(-1), "limit", out)


def _seen(field: Field, alpha) -> np.ndarray:
    """The field at shapes, for those beyond it at its edge; beside singular shapes from its nearest points, or nan."""
    from scipy.interpolate import RegularGridInterpolator

    alpha = np.clip(alpha, [a[0] for a in field.axes], [a[-1] for a in field.axes])
    if field.masked:
        return RegularGridInterpolator(field.axes, field.values[0])(alpha)
    return field(alpha)[..., 0]


@styled
def optimum_map(optimum: Optimum, ax=None, field: Field | None = None):
    """The best loop on the map of `along`, coloured by what holds it; the start dashed. Where the velocity does not follow
    from shape alone there is no CCF, and the map has the loop alone."""
    ax, system = axes_of(ax), optimum.scene.system
    if system.traits.steps:
        shape_space(ax, [np.linspace(-1, 1, 2) * optimum.scene.numerics.extent] * 2, shape_labels(system))
        ax.set_title("no CCF: the velocity does not follow\nfrom shape alone")
    else:
        field = drawable(along(optimum) if field is None else field)
        ccf_map(field, ax=ax, labels=shape_labels(system))
        frame = f"frame {optimum.scene.frame}" if field.masked else "minimum-perturbation frame"
        ax.set_title(f"CCF of the {gain(optimum)},\n{frame}")
        bar = ax.collections[0].colorbar
        bar.set_label(bar.ax.get_ylabel().replace("$_{x}$", ""))
    draw_start_and_best(optimum, ax, lambda curve: curve, field)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1)
    return ax


@styled
def stretched_optimum(optimum: Optimum, ax=None, field: Field | None = None, study: Study | None = None):
    """`optimum_map` on shape space redrawn so that equal lengths cost equal effort. ValueError for what has no metric."""
    ax, study, system = axes_of(ax), study or Study(optimum.scene), optimum.scene.system
    field, plane = along(optimum, study) if field is None else field, stretch(study.metric)
    effort = "BL" if system.traits.power_degree == 1 else "path length"
    stretched_map(field, plane, ax=ax, labels=shape_labels(system), effort=effort)
    ax.set_title(f"the same, stretched to its cost\n(lengths off by {100 * plane.rms:.2g} % rms)")
    bar = ax.collections[0].colorbar
    bar.set_label(bar.ax.get_ylabel().replace("$_{x}$", ""))
    low, high = ([a[k] for a in plane.field.axes] for k in (0, -1))
    draw_start_and_best(optimum, ax, lambda curve: plane(np.clip(curve, low, high)), field)
    return ax


def gain(optimum: Optimum) -> str:
    return "heading" if optimum.request.aim.name == "turning" else "displacement"


def draw_start_and_best(optimum: Optimum, ax, place, field: Field | None) -> None:
    """Both loops, each shape where ``place`` puts it."""
    t = np.linspace(0, 2 * np.pi, PHASES)
    ax.plot(*place(optimum.start.gait.shape(t)).T, color="0.25", lw=0.9, ls="--", label="start")
    left = field is not None and not optimum.scene.system.traits.linear
    draw_held(ax, place(optimum.gait.shape(t)), held(optimum, field), left)


def draw_held(ax, curve: np.ndarray, kinds: np.ndarray, left: bool = False) -> None:
    """A curve (P, 2) in the colours of HOLDS, with a dot at its start and an arrow along it. left: A is not all there is."""
    for kind, (colour, text) in HOLDS.items():
        here = kinds == kind
        if here.any():
            whole = here | np.roll(here, 1)
            ax.plot(*np.where(whole, curve.T, np.nan), color=colour, lw=1.8, label=text + LEFT.get(kind, "") * left)
    ax.plot(*curve[0], "o", color="black", ms=3)
    ax.annotate(
        "", curve[100], curve[90], arrowprops={"arrowstyle": "-|>", "color": "black", "shrinkA": 0, "shrinkB": 0}
    )


@styled
def angles(optimum: Optimum, ax=None):
    """Shape variables of the best gait over a cycle, and the limits."""
    ax, gait = axes_of(ax), optimum.gait
    t = np.linspace(0, 2 * np.pi, PHASES)
    names = shape_labels(optimum.scene.system)
    every = max(1, gait.joints // 6)
    for k, curve in list(enumerate(gait.shape(t).T))[every // 2 :: every]:
        ax.plot(t, curve, label=quantity(names[k][0]))
    if any(x.startswith("alpha") for x in optimum.active):
        for side in np.unique(optimum.request.loops.box):
            ax.axhline(side, color=HOLDS["limit"][0], lw=0.8, ls=":")
    ax.set(xlabel="phase $t$ (rad)", ylabel=f"shape ({names[0][1]})", xlim=(0, 2 * np.pi))
    ax.set(xticks=np.pi / 2 * np.arange(5), xticklabels=["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"])
    best, aim = optimum.best, optimum.request.aim
    start = optimum.start.value
    ax.set_title(f"{aim.name}: {best.value:.4g} {aim.unit}\n(start {start if start > 1e-9 else 0.0:.4g})")
    long = max(len(name) for name, _ in names) > LONG
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1 if long else 3)
    return ax


@styled
def optimum_figure(optimum: Optimum, stretched: bool = False):
    """`optimum_map` beside `angles`; the angles alone where there are not two joints. stretched: `stretched_optimum` between
    them."""
    system, study = optimum.scene.system, Study(optimum.scene)
    if system.joints != 2:
        fig, axes = figure(3.8, 3.4)
        angles(optimum, axes[0, 0])
        return fig
    fig, axes = figure(11.8 if stretched else 7.6, 3.9, 3 if stretched else 2)
    field = None if system.traits.steps else along(optimum, study)
    optimum_map(optimum, axes[0, 0], field)
    if stretched:
        stretched_optimum(optimum, axes[0, 1], field, study)
    angles(optimum, axes[0, -1])
    return fig
