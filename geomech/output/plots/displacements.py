"""Displacement against amplitude, a line a tier."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geomech.gaits import Gait
from geomech.output.plots.style import axes_of, styled
from geomech.tiers import TIERS


@styled
def displacement(table: Mapping, unit: str = "BL", ax=None, label: str = "", gait: Gait | None = None, **style):
    """Net displacement per cycle (`net`) against amplitude, a line a tier; ``table`` as `Study.study` gives it."""
    ax = axes_of(ax)
    for name, tier in TIERS.items():
        if name in table:
            title = f"{label}, {tier.label}" if label else tier.label
            ax.plot(table["amplitude"], net(table[name]), label=title, **{**tier.style, **style})
    ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    ax.set(xlabel=gait.amplitude_label if gait else "amplitude", ylabel=f"displacement per cycle ({unit})")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1)
    return ax


def net(poses) -> np.ndarray:
    """Signed displacement (...,) of poses (..., 3): the distance, negative where it points backwards (x < 0)."""
    poses = np.asarray(poses, float)
    return np.copysign(np.hypot(poses[..., 0], poses[..., 1]), poses[..., 0])
