"""A chain of elliptical links in an ideal fluid: without drag or wake, it pushes
against the fluid's inertia alone.

Started from rest the fluid's motion is potential flow, and the momentum of body and
fluid stays zero. Each link carries the added mass of a single ellipse, without the flow
that other links cause. E. Kanso, J. E. Marsden, C. W. Rowley and J. B. Melli-Huber, J.
Nonlinear Science 15, 255 (2005), include that flow; J. B. Melli, C. W. Rowley and D. S.
Rufat, SIAM J. Applied Dynamical Systems 5, 650 (2006), and R. L. Hatton and H. Choset,
IEEE Trans. Robotics 29, 615 (2013), do not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from geomech.mathematics.systems.base import SYSTEMS
from geomech.mathematics.systems.momentum import Momentum
from rft.core.checks import Number


@SYSTEMS.register
@dataclass(frozen=True)
class IdealFluidSwimmer(Momentum):
    """Elliptical links joined at their tips.

    masses (-): mass of each link over the mass of the fluid that it displaces; if left
    out 1, neutrally buoyant. inertias (-): moment of inertia of each link about its
    centre, over its mass and the square of its length; if left out (1 + aspect^2) / 16,
    the value of a uniform ellipse.

    Added mass of an ellipse with semi-axes a along and b across, per unit depth: pi rho
    b^2 along, pi rho a^2 across, and pi rho (a^2 - b^2)^2 / 8 about the centre (H.
    Lamb, Hydrodynamics, 6th ed., Art. 71).

    Examples
    --------
    >>> from geomech.mathematics.systems import IdealFluidSwimmer
    >>> IdealFluidSwimmer(aspect=0.1).velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0141, -0.0066, -0.0998])
    """

    aspect: Annotated[
        float, Number(1e-3, 1, "-", "width over length of every link, 0.001 to 1")
    ] = 0.1
    masses: tuple[float, ...] = ()
    inertias: tuple[float, ...] = ()

    kind = "ideal-fluid-swimmer"

    def __post_init__(self):
        super().__post_init__()
        self.check_per_link("masses", 1e-9, 1e9)
        self.check_per_link("inertias", 1e-6, 1e6)

    def inertia(self, number: int = float) -> tuple[list[Any], list[list[Any]]]:
        """Return masses and inertias of the links (`Momentum.inertia`), in units of pi
        rho times the square of the body's length, per unit depth."""
        lengths = list(map(number, self.lengths))
        n = len(lengths)
        body = sum(lengths)
        aspect = number(self.aspect)
        relative = list(map(number, self.masses)) or [number(1)] * n
        ellipse = (1 + aspect**2) / 16
        coefficients = list(map(number, self.inertias)) or [ellipse] * n
        masses = []
        inertias = []
        for length, density, coefficient in zip(lengths, relative, coefficients):
            a = length / body / 2
            b = aspect * a
            mass = density * a * b
            about = coefficient * mass * 4 * a**2 + (a**2 - b**2) ** 2 / 8
            masses.append(mass)
            inertias.append([mass + b**2, mass + a**2, about])
        return masses, inertias

    @classmethod
    def examples(cls) -> dict[str, IdealFluidSwimmer]:
        swimmer = cls(
            lengths=(0.8, 1.3, 1.0),
            length=0.4,
            frame="link-1",
            aspect=0.2,
            masses=(1.0, 0.5, 2.0),
        )
        return {"ideal-fluid-swimmer": swimmer}
