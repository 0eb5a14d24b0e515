"""A chain of elliptical links in an ideal fluid: no drag, no wake; the fluid's inertia is all that it pushes against.

Started from rest the fluid's motion is potential flow, and the momentum of body and fluid stays zero. Each link carries the
added mass of a single ellipse: that flow links set up for each other is left out, which E. Kanso, J. E. Marsden,
C. W. Rowley and J. B. Melli-Huber, J. Nonlinear Science 15, 255 (2005), include, and J. B. Melli, C. W. Rowley and D. S. Rufat,
SIAM J. Applied Dynamical Systems 5, 650 (2006), and R. L. Hatton and H. Choset, IEEE Trans. Robotics 29, 615 (2013), do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from geomech.systems.base import SYSTEMS
from geomech.systems.momentum import Momentum
from rft.core.checks import Number


@SYSTEMS.register
@dataclass(frozen=True)
class IdealFluidSwimmer(Momentum):
    """Elliptical links joined at their tips.

    masses (-): of each link, over that of the fluid in its place;
    1, neutrally buoyant, if left out. inertias (-): of each link about its centre, over its mass and the square of its
    length; (1 + aspect^2) / 16, that of a uniform ellipse, if left out.

    Added mass of an ellipse with semi-axes a along and b across, per unit depth: pi rho b^2 along, pi rho a^2 across, and
    pi rho (a^2 - b^2)^2 / 8 about the centre (H. Lamb, Hydrodynamics, 6th ed., Art. 71).

    Examples
    --------
    >>> from geomech.systems import IdealFluidSwimmer
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
        """Return masses and inertias of the links (`Momentum.inertia`), in units of pi rho times the square of the
        body's length, per unit depth."""
        body, aspect = sum(number(x) for x in self.lengths), number(self.aspect)
        a = [number(x) / body / 2 for x in self.lengths]
        b = [aspect * x for x in a]
        relative_masses = [number(x) for x in self.masses] or [number(1)] * len(a)
        inertias = [number(x) for x in self.inertias] or [(1 + aspect**2) / 16] * len(a)
        masses = [k * x * y for k, x, y in zip(relative_masses, a, b)]
        return masses, [
            [m + y**2, m + x**2, k * m * 4 * x**2 + (x**2 - y**2) ** 2 / 8]
            for m, k, x, y in zip(masses, inertias, a, b)
        ]

    @classmethod
    def examples(cls) -> dict[str, IdealFluidSwimmer]:
        return {
            "ideal-fluid-swimmer": cls(
                (0.8, 1.3, 1.0), 0.4, "link-1", 0.2, (1.0, 0.5, 2.0)
            )
        }
