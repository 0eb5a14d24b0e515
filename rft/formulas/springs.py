"""Torque of a joint's spring, with slack, the energy that it stores, and the implicit
steps of a shape that follows from its rates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.formulas.vectors import formula, maximum, minimum, where


class SpringLoad(NamedTuple):
    """Torque that drives a joint's deviation back, its slope, and the stored energy."""

    torque: np.ndarray
    slope: np.ndarray
    energy: np.ndarray


@formula
def spring_load(deviation, stiffness, low, high):
    """Return the load of a spring that is slack while its deviation is from ``low``
    to ``high``: stiffness times what exceeds these.

    deviation, low, high in rad; stiffness in torque per rad. Arrays that broadcast; low
    and high may be infinite.

    Examples
    --------
    >>> import numpy as np
    >>> spring_load(np.array([-0.3, 0.1, 0.3]), 2.0, -0.2, 0.2).torque.round(2)
    array([-0.2,  0. ,  0.2])
    """
    excess = deviation - minimum(maximum(deviation, low), high)
    is_taut = (deviation <= low) | (deviation >= high)
    return SpringLoad(
        stiffness * excess,
        where(is_taut, stiffness, 0.0),
        stiffness * excess * excess / 2.0,
    )


@formula
def resistance(load, rate, damping, reach):
    """Return the torque of a spring and a damper at a rate of the joint, and its slope
    in that rate, which acts for a phase ``reach``."""
    return load.torque + damping * rate, reach * load.slope + damping


@formula
def held_shape(shape, before):
    """Return the shape that a step of BDF2 leads to at rates of 0, from the last two
    shapes: alpha = (4 shape - before) / 3 + (2 dt / 3) d alpha / dt."""
    return (4.0 * shape - before) / 3.0


@formula
def extrapolated_rate(shape, before, rate, dt):
    """Return the next rate, by the parabola through the last two shapes and rate."""
    return 3.0 * rate - 2.0 * (shape - before) / dt


@formula
def mixing_weight(product, square):
    """Return the weight of the last step but one in a fixed-point iteration that is
    accelerated by a secant (Anderson's mixing of depth 1), at most 1 in size.

    product: of the last change and its difference from the change before. square: of
    that difference."""
    is_different = square > 0.0
    weight = product / where(is_different, square, 1.0)
    return where(is_different, minimum(maximum(weight, -1.0), 1.0), 0.0)
