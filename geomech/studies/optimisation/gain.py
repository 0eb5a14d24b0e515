"""The CCF whose area the best loop of a search gains."""

from __future__ import annotations

from typing import NamedTuple

from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.minimum_perturbation import minimum_perturbation
from geomech.mathematics.geometry.representations.field import Field
from geomech.studies.optimisation.evaluate import Evaluation


class Gained(NamedTuple):
    """The CCF whose area an objective gains.

    field: the CCF, (3, N_1, N_2), with its own sign. component: index of the component
    that counts."""

    field: Field
    component: int


def gained_ccf(fitted: Connection, best: Evaluation, is_turning: bool) -> Gained:
    """Return the CCF whose area the best loop gains, in the minimum-perturbation frame
    or, where singular shapes leave none, in the connection's own.

    fitted: the connection of the scene. The component is the one along the larger of
    the displacements x and y of the loop; of the heading for turning."""
    connection = fitted
    x, y, _ = best.displacement
    if not fitted.field.masked:
        frame = minimum_perturbation(fitted)
        A = frame.connection(fitted)
        connection = Connection(
            fitted.axes, A, fitted.residual, fitted.speed, fitted.degree, **fitted.size
        )
        x, y, _ = frame.net(best.displacement, best.gait.shape(0.0))
    component = int(abs(y) > abs(x))
    if is_turning:
        component = 2
    return Gained(ccf(connection), component)
