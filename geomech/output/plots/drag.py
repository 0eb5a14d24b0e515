"""Drag on a rod and the law fitted to it."""

from __future__ import annotations

from collections.abc import Mapping

from geomech.output.plots.style import figure, styled

PARTS = (("across", "#D55E00", "o"), ("along", "#0072B2", "s"))


@styled
def drag_figure(numbers: Mapping):
    """Forces against the attack angle, with the law and the band it lies in with 95 %; below, what it leaves. ``numbers``
    as `geomech.study.calibration.OfDrag.curves` gives them."""
    fig, axes = figure(4.4, 4.6, 1, 2)
    (top,), (bottom,) = axes
    for name, colour, marker in PARTS:
        k = 1 if name == "across" else 0
        law, band = numbers["law"][k], numbers["band"][k]
        top.fill_between(numbers["fine_deg"], law - band, law + band, color=colour, alpha=0.2, lw=0)
        top.plot(numbers["fine_deg"], law, color=colour, lw=1.2)
        top.plot(numbers["psi_deg"], numbers["forces"][k], marker, color=colour, ms=4, label=f"{name} the rod")
        bottom.plot(numbers["psi_deg"], numbers["residuals"][k], marker, color=colour, ms=4)
    bottom.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    largest = 1.15 * max(abs(numbers["residuals"]).max(), 1e-6 * abs(numbers["forces"]).max())
    low = min(0.0, numbers["forces"].min()) - 0.03 * numbers["forces"].max()
    top.set(ylabel="drag (N)", xlim=(-2, 92), ylim=(low, None))
    top.plot([], [], color="0.3", lw=1.2, label=f"{numbers['label']},\n95 % band")
    top.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    bottom.set(
        xlabel=r"attack angle $\psi$ (degrees)", ylabel="data minus law (N)", xlim=(-2, 92), ylim=(-largest, largest),
    )  # fmt: skip
    bottom.set_title(f"rms {numbers['rms']:.3g} N", loc="left", fontsize=8)
    for ax in (top, bottom):
        ax.set_xticks(range(0, 91, 15))
    fig.get_layout_engine().set(hspace=0.06)
    return fig
