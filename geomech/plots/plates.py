"""Measurements in the vertical plane with their fits: plate drags and penetration tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.plots.style import figure, styled
from geomech.plots.terradynamics import square_of_angles

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def plates_figure(result: Result) -> Figure:
    """Draw the residuals of plate drags over their angles, and the nine coefficients with 95 % intervals."""
    fig, axes = figure(12.0, 3.5, 3)
    beta, gamma, side = _ahead(result["beta"].values, result["gamma"].values)
    residuals = result["residual"].values * np.stack([side, np.ones_like(side)])
    for ax, name, residual in zip(axes[0], "zx", residuals[::-1]):
        _residuals(ax, beta, gamma, residual, np.abs(residuals).max(), name)
    axes[0, 0].set_title(
        f"rms of both {float(result['rms']):.3g} N/cm$^3$",
        loc="left",
        fontsize=8,
        pad=9,
    )
    _coefficients(axes[0, 2], result)
    return fig


def _residuals(ax, beta, gamma, residual, top: float, name: str) -> None:
    from cmcrameri import cm

    top = top or 1e-12
    style = {
        "cmap": cm.vik,
        "vmin": -top,
        "vmax": top,
        "s": 28,
        "edgecolors": "0.3",
        "linewidths": 0.4,
        "zorder": 3,
    }
    dots = ax.scatter(beta, gamma, c=residual, clip_on=False, **style)
    square_of_angles(ax)
    ax.set_facecolor("0.97")
    ax.figure.colorbar(dots, ax=ax, shrink=0.85).set_label(
        rf"data minus map, $\alpha_{name}$ (N/cm$^3$)"
    )


def _ahead(beta, gamma):
    """Return tilts and directions within +-90 degrees, and the sign of alpha_x there: motion backwards is the mirror image."""
    beta, gamma = beta - 180 * np.round(beta / 180), gamma - 360 * np.round(gamma / 360)
    back = np.abs(gamma) > 90
    mirrored = (
        np.where(back, -beta, beta),
        np.where(back, np.copysign(180.0, gamma) - gamma, gamma),
    )
    return *mirrored, np.where(back, -1.0, 1.0)


def _coefficients(ax, result: Result) -> None:
    names, fitted = result["parameter"].values, result["value"]
    undetermined = result["undetermined"].values > 0
    low, high = fitted.values - fitted.error, fitted.values + fitted.error
    at = np.arange(len(names))
    ax.axhline(0.0, color="0.6", lw=0.6)
    generic = rf"generic set, $\zeta$ = {float(result['zeta']):.3g}"
    ax.plot(at, result["generic"].values, "_", color="#D55E00", ms=12, label=generic)
    for k, value in enumerate(fitted.values):
        ax.plot([k, k], [low[k], high[k]], color="black", lw=1.0)
        ax.plot(
            k,
            value,
            "o",
            color="black",
            ms=4,
            mfc="white" if undetermined[k] else None,
        )
    ax.plot([], [], "o-", color="black", ms=4, lw=1.0, label="fitted, with 95 %")
    if undetermined.any():
        ax.plot(
            [],
            [],
            "o-",
            color="black",
            ms=4,
            lw=1.0,
            mfc="white",
            label="not determined",
        )
    labels = [f"${name[0]}_{{{name[1:]}}}$" for name in names]
    ax.set(xticks=at, xticklabels=labels, ylabel="coefficient (N/cm$^3$)")
    ax.tick_params(axis="x", labelsize=7.5)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=7, ncols=2)


@styled
def penetration_figure(result: Result) -> Figure:
    """Draw the force on a plate against depth with the law and its 95 % interval, and the residuals below."""
    fig, axes = figure(4.4, 4.6, 1, 2)
    (top,), (bottom,) = axes
    depth, force = 1e2 * result["depth"].values, result["force"].values
    law = result["fitted"].values
    from_zero = lambda y: np.append(0.0, y)
    at, centre, half_width = map(from_zero, (depth, law, result["fitted"].error))
    top.fill_between(
        at,
        centre - half_width,
        centre + half_width,
        color="#0072B2",
        alpha=0.25,
        lw=0,
        label="95 %",
    )
    top.plot(at, centre, color="#0072B2", lw=1.2, label=r"$\zeta$ |z| A, in N and cm")
    top.plot(depth, force, "o", color="black", ms=3, label="measured")
    top.set(ylabel="force upwards (N)", xlim=(0, None))
    top.legend(loc="upper left")
    bottom.plot(depth, force - law, "o", color="black", ms=3)
    bottom.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    bottom.set(xlabel="depth (cm)", ylabel="data minus law (N)", xlim=(0, None))
    bottom.set_title(f"rms {float(result['rms']):.3g} N", loc="left", fontsize=8)
    fig.get_layout_engine().set(hspace=0.06)
    return fig
