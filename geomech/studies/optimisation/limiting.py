"""What limits the best loop of a search, phase by phase."""

from __future__ import annotations

import numpy as np

from geomech.mathematics.geometry.representations.field import Field
from geomech.studies.optimisation.gain import Gained
from geomech.studies.optimisation.loops import TOUCHING
from geomech.studies.optimisation.optimum import Optimum

# Of the CCF's largest value inside the loop's box: a smaller one is near the zero line.
NEAR_ZERO = 0.15
# Of the least distance from singular shapes: a loop so near is limited by them.
NEAR_SINGULAR = 0.05
PHASES = 721


def limiting(optimum: Optimum) -> np.ndarray:
    """Return what limits the best loop at each of PHASES phases, as words (PHASES,).

    "limit": a joint limit. "singular": singular shapes. "zero": the loop runs along the
    zero line of `Optimum.gained`. "length": it is off that line for the sake of path
    length. "else": off that line. "loop": not known, where there is no such CCF."""
    alpha = optimum.gait.shape(np.linspace(0, 2 * np.pi, PHASES))
    causes = np.full(PHASES, "loop", dtype="<U8")
    if optimum.gained is not None:
        is_efficiency = optimum.request.objective.name == "efficiency"
        causes[:] = "length" if is_efficiency else "else"
        causes[_is_near_zero(optimum.gained, alpha)] = "zero"
    if "singular shapes" in optimum.active:
        distance = np.abs(optimum.scene.system.traits.singularity(alpha))
        causes[distance <= distance.min() * (1 + NEAR_SINGULAR)] = "singular"

    box = getattr(optimum.request.loops, "box", None)
    if box is not None:
        low, high = box
        near = 0.0
        if np.isfinite(box).all():
            near = TOUCHING * (high - low) / 2
        touches = (alpha <= low + near) | (alpha >= high - near)
        causes[touches.any(-1)] = "limit"
    return causes


def _is_near_zero(gained: Gained, alpha: np.ndarray) -> np.ndarray:
    """Return at which shapes (N, d) of a loop the CCF that it gains is small, (N,)."""
    field = gained.field
    value = np.abs(_nearest_values(field, gained.component, alpha))
    inside = [
        (axis >= low) & (axis <= high)
        for axis, low, high in zip(field.axes, alpha.min(0), alpha.max(0))
    ]
    around = np.abs(field.values[gained.component][np.ix_(*inside)])
    if field.masked:
        # Next to singular shapes the largest value may be any.
        top = np.nanmedian(around)
    else:
        top = around.max(initial=value.max())
    return value <= NEAR_ZERO * top


def _nearest_values(field: Field, component: int, alpha) -> np.ndarray:
    """Return a component of the field at shapes (N, d), beyond the field the value at
    its edge; next to singular shapes from its nearest points, or nan."""
    from scipy.interpolate import RegularGridInterpolator

    low = [axis[0] for axis in field.axes]
    high = [axis[-1] for axis in field.axes]
    alpha = np.clip(alpha, low, high)
    if field.masked:
        return RegularGridInterpolator(field.axes, field.values[component])(alpha)
    return field(alpha)[..., component]
