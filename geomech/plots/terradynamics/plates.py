"""Measurements in the vertical plane with their fits: plate drags and penetration
tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.plots.look import colours, font_points
from geomech.plots.style import figure, styled
from geomech.plots.terradynamics.intruders import mirrored_ahead, square_of_angles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def plates_figure(result: Result) -> Figure:
    """Draw the residuals of plate drags over their angles, and the nine coefficients
    with 95 % intervals."""
    fig, axes = figure(12.0, 3.5, 3)
    left, middle, right = axes[0]
    beta, gamma, sign = mirrored_ahead(result["beta"].values, result["gamma"].values)
    residual_x, residual_z = result["residual"].values
    residual_x = residual_x * sign
    top = max(np.abs(residual_x).max(), np.abs(residual_z).max()) or 1e-12
    _draw_residuals(left, beta, gamma, residual_z, top, "z")
    _draw_residuals(middle, beta, gamma, residual_x, top, "x")
    rms = f"rms of both {float(result['rms']):.3g} N/cm$^3$"
    left.set_title(rms, loc="left", fontsize=font_points(8), pad=9)
    _draw_coefficients(right, result)
    return fig


def _draw_residuals(
    ax: Axes,
    beta: np.ndarray,
    gamma: np.ndarray,
    residual: np.ndarray,
    top: float,
    name: str,
) -> None:
    """Draw residuals (N,) of alpha_x or alpha_z as coloured dots over tilt and
    direction, in degrees; colours go from -top to top."""
    from cmcrameri import cm

    look = {
        "cmap": colours(cm.vik),
        "vmin": -top,
        "vmax": top,
        "s": 28,
        "edgecolors": "0.3",
        "linewidths": 0.4,
        "zorder": 3,
    }
    dots = ax.scatter(beta, gamma, c=residual, clip_on=False, **look)
    square_of_angles(ax)
    ax.set_facecolor("0.97")
    bar = ax.figure.colorbar(dots, ax=ax, shrink=0.85)
    bar.set_label(rf"data minus map, $\alpha_{name}$ (N/cm$^3$)")


def _draw_coefficients(ax: Axes, result: Result) -> None:
    """Draw the fitted coefficients with their intervals, open where the data do not
    determine them, and the generic set scaled to the same strength."""
    names = result["parameter"].values
    fitted = result["value"]
    undetermined = result["undetermined"].values > 0
    low = fitted.values - fitted.error
    high = fitted.values + fitted.error
    places = np.arange(len(names))
    ax.axhline(0.0, color="0.6", lw=0.6)
    label = rf"generic set, $\zeta$ = {float(result['zeta']):.3g}"
    generic = result["generic"].values
    ax.plot(places, generic, "_", color="#D55E00", ms=12, label=label)
    for k, value in enumerate(fitted.values):
        ax.plot([k, k], [low[k], high[k]], color="black", lw=1.0)
        fill = "white" if undetermined[k] else None
        ax.plot(k, value, "o", color="black", ms=4, mfc=fill)

    # The legend's entries.
    look = {"color": "black", "ms": 4, "lw": 1.0}
    ax.plot([], [], "o-", label="fitted, with 95 %", **look)
    if undetermined.any():
        ax.plot([], [], "o-", mfc="white", label="not determined", **look)
    labels = [f"${name[0]}_{{{name[1:]}}}$" for name in names]
    ax.set(xticks=places, xticklabels=labels, ylabel="coefficient (N/cm$^3$)")
    ax.tick_params(axis="x", labelsize=font_points(7.5))
    ax.legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=font_points(7), ncols=2
    )


@styled
def penetration_figure(result: Result) -> Figure:
    """Draw the force on a plate against depth with the law and its 95 % interval, and
    the residuals below."""
    fig, axes = figure(4.4, 4.6, 1, 2)
    (top,), (bottom,) = axes
    depth = 1e2 * result["depth"].values  # cm
    force = result["force"].values
    law = result["fitted"].values
    error = result["fitted"].error

    # The law begins with no force at the surface.
    x = np.append(0.0, depth)
    low = np.append(0.0, law - error)
    high = np.append(0.0, law + error)
    line = np.append(0.0, law)
    top.fill_between(x, low, high, color="#0072B2", alpha=0.25, lw=0, label="95 %")
    top.plot(x, line, color="#0072B2", lw=1.2, label=r"$\zeta$ |z| A, in N and cm")
    top.plot(depth, force, "o", color="black", ms=3, label="measured")
    top.set(ylabel="force upwards (N)", xlim=(0, None))
    top.legend(loc="upper left")
    bottom.plot(depth, force - law, "o", color="black", ms=3)
    bottom.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    bottom.set(xlabel="depth (cm)", ylabel="data minus law (N)", xlim=(0, None))
    bottom.set_title(
        f"rms {float(result['rms']):.3g} N", loc="left", fontsize=font_points(8)
    )
    fig.get_layout_engine().set(hspace=0.06)
    return fig
