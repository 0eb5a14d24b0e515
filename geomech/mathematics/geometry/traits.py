"""Facts about a velocity: fits, images and tiers use them to save work and to
refuse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from geomech.mathematics.geometry.periods import checked_periods
from rft.core.premise import NONE, SHAPE_ALONE, Premise

MEAN = "mean"  # the frame at the centre of mass, with the mean heading


@dataclass(frozen=True)
class Traits:
    """Facts about a velocity xi(alpha, alphadot) that algorithms may use.

    Each is an equation that a test can check. A system that claims nothing is only
    assumed to be odd and smooth, as every table of a connection assumes.

    Attributes
    ----------
    linear : xi(alpha, alphadot) = A(alpha) alphadot, exactly.
    odd : xi(alpha, -alphadot) = -xi(alpha, alphadot).
    mirror : xi(-alpha, -alphadot) = (xi_x, -xi_y, -xi_theta): left and right are alike.
    reversible : xi(P alpha, P alphadot) = (-xi_x, -xi_y, xi_theta), (P alpha)_k =
        -alpha_(d + 1 - k): head and tail are alike.
    smooth : xi has no kinks in shape or direction, so that errors fall faster than with
        the
        square of the phases.
    jumps : xi jumps between some shapes, as where a contact switches at once. Errors
        then allow for switches that fall between two phases.
    power_degree : P(alpha, c alphadot) = c^power_degree P(alpha, alphadot) for c > 0; 2
        in a
        fluid, 1 in sand. None where the system has no power, or a power of no single
        degree.
    lacks : premises that do not hold. Without those of SHAPE_ALONE a single shape has
        no
        velocity; there are only runs.
    singularity : a function of shapes (..., d) that passes through 0 where the velocity
        does
        not exist, or None.
    singular : where that is, in words that follow "where".
    joint_angles : shape variables are angles of joints, so that one beyond a full turn
        is
        likely in the wrong unit.
    frame : name of the body frame whose velocity xi is.
    unit : of lengths in xi, "BL" (body lengths) or "m"; if left out by the system's
        ``length`` (`unit_of`).
    labels : (name, unit) of each shape variable; alpha_1, alpha_2 ... in rad if left
        out.
    frequency : cycles per second, where xi depends on it.
    compliant : joints give way, so that the shape is not that of the gait. The velocity
        is that of the shape which the body really takes; a run finds both.
    periods : period of each shape variable, None for one without, or empty for none:
        xi(alpha + period e_k, alphadot) = xi(alpha, alphadot).
    """

    linear: bool = False
    odd: bool = True
    mirror: bool = False
    reversible: bool = False
    smooth: bool = True
    power_degree: float | None = None
    lacks: Premise = NONE
    singularity: Callable | None = None
    singular: str = ""
    joint_angles: bool = False
    frame: str = MEAN
    unit: str = ""
    labels: tuple[tuple[str, str], ...] = ()
    frequency: float | None = None
    compliant: bool = False
    periods: tuple[float | None, ...] = ()
    jumps: bool = False

    def __post_init__(self):
        periods = checked_periods(self.periods, len(self.periods))
        object.__setattr__(self, "periods", periods)

    @property
    def halved(self) -> bool:
        """Whether velocities at one half of a symmetric grid give those at the
        other."""
        return self.mirror and self.odd

    @property
    def steps(self) -> bool:
        """Whether a cycle is run phase after phase, as no velocity follows from shape
        alone, or no shape from the phase."""
        return self.compliant or bool(self.lacks & SHAPE_ALONE)


NOTHING = Traits()


def unit_of(length: float | None) -> str:
    """Return the unit of lengths of a body with a length, m, or without one: "m" or
    "BL", body lengths."""
    return "BL" if length is None else "m"
