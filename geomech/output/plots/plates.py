"""Measurements in the vertical plane and what was fitted to them: plate drags and penetration tests."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geomech.output.plots.style import figure, styled
from geomech.output.plots.terradynamics import square_of_angles


@styled
def plates_figure(numbers: Mapping):
    """What nine coefficients leave of plate drags, over their angles, and the coefficients with 95 % intervals. ``numbers`` as
    `geomech.study.stress_calibration.OfPlates.curves` gives them."""
    fig, axes = figure(12.0, 3.5, 3)
    beta, gamma, side = _ahead(numbers["beta_deg"], numbers["gamma_deg"])
    residuals = numbers["residuals"] * np.stack([side, np.ones_like(side)])
    for ax, name, left in zip(axes[0], "zx", residuals[::-1]):
        _residuals(ax, beta, gamma, left, np.abs(residuals).max(), name)
    axes[0, 0].set_title(f"rms of both {numbers['rms']:.3g} N/cm$^3$", loc="left", fontsize=8, pad=9)
    _coefficients(axes[0, 2], numbers)
    return fig


def _residuals(ax, beta, gamma, left, top: float, name: str) -> None:
    from cmcrameri import cm

    top = top or 1e-12
    style = {"cmap": cm.vik, "vmin": -top, "vmax": top, "s": 28, "edgecolors": "0.3", "linewidths": 0.4, "zorder": 3}
    dots = ax.scatter(beta, gamma, c=left, clip_on=False, **style)
    square_of_angles(ax)
    ax.set_facecolor("0.97")
    ax.figure.colorbar(dots, ax=ax, shrink=0.85).set_label(rf"data minus map, $\alpha_{name}$ (N/cm$^3$)")


def _ahead(beta, gamma):
    """Tilts and directions within +-90 degrees, and the sign of alpha_x there: motion backwards is the mirror image."""
    beta, gamma = beta - 180 * np.round(beta / 180), gamma - 360 * np.round(gamma / 360)
    back = np.abs(gamma) > 90
    turned = np.where(back, -beta, beta), np.where(back, np.copysign(180.0, gamma) - gamma, gamma)
    return *turned, np.where(back, -1.0, 1.0)


def _coefficients(ax, numbers: Mapping) -> None:
    at, low, high = np.arange(len(numbers["names"])), *numbers["intervals"].T
    ax.axhline(0.0, color="0.6", lw=0.6)
    ax.plot(at, numbers["generic"], "_", color="#D55E00", ms=12, label=rf"generic set, $\zeta$ = {numbers['zeta']:.3g}")
    for k, (value, name) in enumerate(zip(numbers["values"], numbers["names"])):
        told = name not in numbers["undetermined"]
        ax.plot([k, k], [low[k], high[k]], color="black", lw=1.0)
        ax.plot(k, value, "o", color="black", ms=4, mfc=None if told else "white")
    ax.plot([], [], "o-", color="black", ms=4, lw=1.0, label="fitted, with 95 %")
    if numbers["undetermined"]:
        ax.plot([], [], "o-", color="black", ms=4, lw=1.0, mfc="white", label="not determined")
    labels = [f"${name[0]}_{{{name[1:]}}}$" for name in numbers["names"]]
    ax.set(xticks=at, xticklabels=labels, ylabel="coefficient (N/cm$^3$)")
    ax.tick_params(axis="x", labelsize=7.5)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=7, ncols=2)


@styled
def penetration_figure(numbers: Mapping):
    """Force on a plate against depth with the law and its 95 % interval; below, what it leaves. ``numbers`` as
    `geomech.study.stress_calibration.OfPenetration.curves` gives them."""
    fig, axes = figure(4.4, 4.6, 1, 2)
    (top,), (bottom,) = axes
    depth = 1e2 * numbers["depth"]
    at = np.append(0.0, depth)
    from_zero = lambda y: np.append(0.0, numbers[y])
    top.fill_between(at, from_zero("low"), from_zero("high"), color="#0072B2", alpha=0.25, lw=0, label="95 %")
    top.plot(at, from_zero("law"), color="#0072B2", lw=1.2, label=r"$\zeta$ |z| A, in N and cm")
    top.plot(depth, numbers["force"], "o", color="black", ms=3, label="measured")
    top.set(ylabel="force upwards (N)", xlim=(0, None))
    top.legend(loc="upper left")
    bottom.plot(depth, numbers["force"] - numbers["law"], "o", color="black", ms=3)
    bottom.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    bottom.set(xlabel="depth (cm)", ylabel="data minus law (N)", xlim=(0, None))
    bottom.set_title(f"rms {numbers['rms']:.3g} N", loc="left", fontsize=8)
    fig.get_layout_engine().set(hspace=0.06)
    return fig
