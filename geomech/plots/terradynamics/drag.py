"""Drag on a rod and the law fitted to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geomech.core.variables import Result
from geomech.plots.look import font_points
from geomech.plots.style import figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIRECTIONS = (  # row of the result, name, colour, marker
    (1, "across", "#D55E00", "o"),
    (0, "along", "#0072B2", "s"),
)


@styled
def drag_figure(result: Result) -> Figure:
    """Draw forces against the attack angle with the fitted law and its 95 % band, and
    the residuals below.

    Examples
    --------
    >>> import geomech
    >>> fig = geomech.plots.drag_figure(geomech.fit_medium("short-rod-drag"))
    """
    fig, axes = figure(4.4, 4.6, 1, 2)
    (top,), (bottom,) = axes
    angle = result["angle"].values
    psi = result["folded_psi"].values
    forces = result["force"].values
    residuals = result["residual"].values
    laws = result["law_curve"]
    for k, name, colour, marker in DIRECTIONS:
        law = laws.values[k]
        band = laws.error[k]
        top.fill_between(angle, law - band, law + band, color=colour, alpha=0.2, lw=0)
        top.plot(angle, law, color=colour, lw=1.2)
        top.plot(psi, forces[k], marker, color=colour, ms=4, label=f"{name} the rod")
        bottom.plot(psi, residuals[k], marker, color=colour, ms=4)

    lowest = min(0.0, forces.min()) - 0.03 * forces.max()
    top.set(ylabel="drag (N)", xlim=(-2, 92), ylim=(lowest, None))
    law_name = result.attributes["law"]
    top.plot([], [], color="0.3", lw=1.2, label=f"{law_name} law,\n95 % band")
    top.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))

    bottom.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    largest = 1.15 * max(abs(residuals).max(), 1e-6 * abs(forces).max())
    bottom.set(
        xlabel=r"attack angle $\psi$ (degrees)",
        ylabel="data minus law (N)",
        xlim=(-2, 92),
        ylim=(-largest, largest),
    )
    bottom.set_title(
        f"rms {float(result['rms']):.3g} N", loc="left", fontsize=font_points(8)
    )
    for ax in (top, bottom):
        ax.set_xticks(range(0, 91, 15))
    fig.get_layout_engine().set(hspace=0.06)
    return fig
