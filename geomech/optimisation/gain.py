"""The CCF whose area an objective gains, and what limits the best loop on it, phase by phase."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from geomech.geometry.connection import Connection
from geomech.geometry.curvature import ccf
from geomech.geometry.field import Field
from geomech.geometry.minimum_perturbation import minimum_perturbation
from geomech.optimisation.loops import TOUCHING

if TYPE_CHECKING:
    from geomech.optimisation.optimum import Optimum

NEAR_ZERO = 0.15  # of the CCF's largest value inside the loop's box: below it a loop runs along the line of zeros
NEAR_SINGULAR = 0.05  # of the least distance from singular shapes: a loop that is so near is limited by them
PHASES = 721


class Gained(NamedTuple):
    """The CCF whose area an objective gains. field: the CCF, (3, N_1, N_2), with its own sign. component: of it, the one that
    counts."""

    field: Field
    component: int


def gained_ccf(optimum: Optimum) -> Gained:
    """Return the CCF in the minimum-perturbation frame or, where singular shapes leave none, in the scene's own; its component
    along the larger of the displacements x and y of the best loop, or that of the heading for turning."""
    fitted, best = optimum.study.fitted, optimum.best
    connection, (x, y, _) = fitted, best.displacement
    if not fitted.field.masked:
        frame = minimum_perturbation(fitted)
        A = frame.connection(fitted)
        connection = Connection(
            fitted.axes, A, fitted.residual, fitted.speed, fitted.degree, **fitted.size
        )
        x, y, _ = frame.net(best.displacement, best.gait.shape(0.0))
    turning = optimum.request.objective.name == "turning"
    return Gained(ccf(connection), 2 if turning else int(abs(y) > abs(x)))


def limiting(optimum: Optimum) -> np.ndarray:
    """Return what limits the best loop at each of PHASES phases, as words (PHASES,).

    "limit": a joint limit; "singular": singular shapes; "zero": it runs along the zero line of `Optimum.gained`; "length":
    it is off that line for the sake of path length; "else": off that line; "loop": not known, where there is no such CCF."""
    gained = optimum.gained
    alpha = optimum.gait.shape(np.linspace(0, 2 * np.pi, PHASES))
    rest = "length" if optimum.request.objective.name == "efficiency" else "else"
    causes = np.full(PHASES, "loop" if gained is None else rest, dtype="<U8")
    if gained is not None:
        field, value = gained.field, np.abs(_nearest_values(*gained, alpha))
        inside = [
            (a >= lo) & (a <= hi)
            for a, lo, hi in zip(field.axes, alpha.min(0), alpha.max(0))
        ]
        around = np.abs(field.values[gained.component][np.ix_(*inside)])
        # next to singular shapes the largest value may be any
        top = np.nanmedian(around) if field.masked else around.max(initial=value.max())
        causes = np.where(value <= NEAR_ZERO * top, "zero", causes)
    if "singular shapes" in optimum.active:
        distance = np.abs(optimum.scene.system.traits.singularity(alpha))
        causes = np.where(
            distance <= distance.min() * (1 + NEAR_SINGULAR), "singular", causes
        )
    box = getattr(optimum.request.loops, "box", np.array([[-np.inf], [np.inf]]))
    near = TOUCHING * (box[1] - box[0]) / 2 if np.isfinite(box).all() else 0.0
    return np.where(
        ((alpha <= box[0] + near) | (alpha >= box[1] - near)).any(-1), "limit", causes
    )


def _nearest_values(field: Field, component: int, alpha) -> np.ndarray:
    """Return a component of the field at shapes, for those beyond it at its edge; next to singular shapes from its nearest
    points, or nan."""
    from scipy.interpolate import RegularGridInterpolator

    alpha = np.clip(alpha, [a[0] for a in field.axes], [a[-1] for a in field.axes])
    if field.masked:
        return RegularGridInterpolator(field.axes, field.values[component])(alpha)
    return field(alpha)[..., component]
