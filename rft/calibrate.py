"""The parameters of a force law from the drag on a rod, by least squares (paper Sec. II, Eqs. 2-3, Fig. 5(c)).

A rod is dragged at the attack angle psi between its velocity and its axis. A law in units of its own axial drag, times the
rod's axial drag F, gives the forces along and across it: F f_t(cos psi, sin psi) and F f_n(cos psi, sin psi). A law enters
`FITS` with its parameters, their bounds and the starts that are tried; F is fitted beside them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rft.checks import in_range, require, shown
from rft.drag import Rod, RodDrag
from rft.effects.end_caps import EndCaps
from rft.laws.base import Medium
from rft.laws.coulomb import Coulomb
from rft.laws.granular import Granular
from rft.laws.viscous import Viscous

CAPS = "end_caps"
MOST_CAPS = 10.0  # e of a hemisphere is 4
LEVELS = 1e-6  # of its bound, within which a parameter counts as lying on it
EXACT = 1e-14  # of steps and sums of squares, at which a fit has arrived
UNTOLD = 1e-7  # smallest singular value, over the largest, of the slopes that still tell the parameters apart
LEVEL, ONE = 0.95, 0.6827  # of intervals and bands, and within one standard deviation


def widening(free: float, level: float = LEVEL) -> float:
    """Half an interval over the standard error, with so many degrees of freedom (Student)."""
    from scipy.special import stdtrit

    return float(stdtrit(free, (1 + level) / 2))


@dataclass(frozen=True)
class Kind:
    """How a law is fitted. names: its parameters. make: a medium of them. grains: whether drag grows with the weight of grains
    above, by k of Eq. 2. bounds: (low, high) of each parameter. starts: values of each; all combinations are tried, and the
    best refined."""

    names: tuple[str, ...]
    make: Callable[..., Medium]
    grains: bool
    bounds: tuple[tuple[float, float], ...] = ()
    starts: tuple[tuple[float, ...], ...] = ()


UNKNOWN = Rod()
STEEP = tuple(np.radians((1.0, 2.0, 4.0, 7.0, 10.0, 14.0, 20.0, 30.0, 45.0, 65.0)).tolist())
FITS = {
    "granular": Kind(
        ("C", "gamma0"),
        Granular,
        True,
        ((0.0, 1e3), (math.radians(0.1), math.radians(89.0))),
        ((0.3, 1.0, 2.0, 5.0, 20.0), STEEP),
    ),
    "viscous": Kind(("ratio",), Viscous, False, ((1e-6, 1e6),), ((0.3, 1.0, 2.0, 6.0),)),
    "coulomb": Kind((), Coulomb, True),
}


@dataclass(frozen=True, eq=False)
class Fit:
    """A law fitted to drag. names, values: of the fitted parameters, those of the law (gamma0 in rad), then its axial drag,
    then `CAPS` where these are fitted.

    The axial drag is, for a law of grains, ``k`` of Eq. 2 where radius, length and depth of the rod and the density of the
    bed are known; else ``axial_stress`` (Pa, over the projected area) where radius and length are; else ``axial_force`` (N,
    on the whole rod). covariance: (n, n), theirs, from the scatter about the law as if that was noise, independent from
    force to force. residuals: (2, N), measured minus fitted, N. end_caps: e of both ends together (`EndCaps`), 0 left out.
    """

    law: str
    data: RodDrag
    rod: Rod
    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    residuals: np.ndarray
    end_caps: float

    def __repr__(self) -> str:
        both = zip(self.names, self.values, self.intervals)
        told = ", ".join(f"{name} {value:.4g} ({low:.4g} to {high:.4g})" for name, value, (low, high) in both)
        return f"Fit({self.law}, 95 %: {told}; {self.data.psi.size} rows, rms {self.rms:.3g} N)"

    @property
    def rms(self) -> float:
        """Root mean square of the residuals of all rows that weigh something, N."""
        return float(np.sqrt(np.mean(self.residuals[:, self.data.weight > 0] ** 2)))

    @property
    def errors(self) -> np.ndarray:
        """Standard errors of the parameters."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def free(self) -> int:
        """Degrees of freedom: forces that weigh something beyond the parameters."""
        return self.data.count - len(self.names)

    @property
    def intervals(self) -> np.ndarray:
        """(n, 2), each with 95 %."""
        return self.values[:, None] + widening(self.free) * self.errors[:, None] * [-1.0, 1.0]

    @property
    def axial_force(self) -> float:
        """Drag on the whole rod at psi = 0 without its ends, N."""
        return float(self.values[len(FITS[self.law].names)]) * _unit(self.law, self.rod)[1]

    @property
    def axial_stress(self) -> float | None:
        """`axial_force` over the projected area 2 r L, Pa; None where that is not known."""
        return self.axial_force / self.rod.area if self.rod.area else None

    @property
    def k(self) -> float | None:
        """k of Eq. 2; None where the rod's sizes or the density are not known, and in a fluid."""
        return float(self.values[self.names.index("k")]) if "k" in self.names else None

    @property
    def medium(self) -> Medium:
        """The law, with the covariance of its own parameters, widened (Student) so that a standard deviation holds 68 %."""
        kind = FITS[self.law]
        own = [name for name in self.names if name in kind.make.__dataclass_fields__]  # k only where the law has it
        values, n = dict(zip(self.names, self.values.tolist())), len(own)
        wide = widening(self.free, ONE) ** 2 * self.covariance[:n, :n]
        return kind.make(**{x: values[x] for x in own}, **({"covariance": wide} if own else {}))

    def forces(self, psi, values=None) -> np.ndarray:
        """(2, ...): forces along and across the rod at attack angles psi (rad), N; values: other ones of the parameters."""
        values = self.values if values is None else values
        return _forces(self.law, self.rod, self.end_caps, psi, _in_newton(self.law, self.rod, values))

    def band(self, psi) -> np.ndarray:
        """(2, ...): half the width of the band in which the law lies with 95 % by its covariance, N; linear in it."""
        slopes = []
        for value, error, step in zip(self.values, self.errors, np.eye(len(self.values))):
            h = max(1e-3 * error, 1e-9 * abs(value)) or 1e-12
            slopes.append(
                (self.forces(psi, self.values + h * step) - self.forces(psi, self.values - h * step)) / (2 * h)
            )
        slopes = np.array(slopes)
        return widening(self.free) * np.sqrt(
            np.maximum(np.einsum("i...,ij,j...->...", slopes, self.covariance, slopes), 0.0)
        )


def fit(law: str, data: RodDrag, rod: Rod = UNKNOWN, end_caps: float | str = 0.0) -> Fit:
    """The law of that name in `FITS` that comes nearest to the drag, by weighted least squares of both components.

    end_caps: e of both ends together (`EndCaps`: 1 for one flat end), 0 to leave them out, or "fitted"; other than 0 it takes
    the granular law and the rod's radius and length. ValueError if the data do not settle the parameters, or at the edge
    of what these may be."""
    kind = FITS[law]
    fitted = isinstance(end_caps, str)
    require(not fitted or end_caps == "fitted", f"end caps must be 'fitted' or a number, got {shown(end_caps)}")
    if not fitted:
        in_range("end caps", end_caps, 0, MOST_CAPS)
    if end_caps:
        require(law == "granular", f"end caps take the granular law, got {law}: leave them out")
        require(
            rod.radius and rod.length, "end caps take the rod's radius and length: give both, or leave the caps out"
        )
        require(rod.radius <= rod.length, f"end caps take a rod longer than its radius, got {rod.length:g} m")
    names = (*kind.names, "axial_force", *([CAPS] if fitted else []))
    require(data.count > len(names), f"{data.count} forces are too few for {', '.join(names)}: measure at more angles")
    residual = lambda x: _weighted(data, _forces(law, rod, 0.0 if fitted else float(end_caps), data.psi, x))
    low, high = np.array([*kind.bounds, (0.0, np.inf), *([(0.0, MOST_CAPS)] if fitted else [])]).T
    best = _best(residual, _starts(kind, data, residual, fitted), low, high)
    require(best.success, f"the fit of {', '.join(map(_told, names))} does not settle: measure at more angles")
    _check_inside(names, best.x, low, high)
    covariance = _covariance(names, best, data.count)
    unit, newton = _unit(law, rod)
    scale = np.array([1.0] * len(kind.names) + [1.0 / newton] + [1.0] * fitted)
    return Fit(
        law,
        data,
        rod,
        tuple(unit if name == "axial_force" else name for name in names),
        best.x * scale,
        covariance * np.outer(scale, scale),
        data.forces - _forces(law, rod, 0.0 if fitted else float(end_caps), data.psi, best.x),
        float(best.x[-1]) if fitted else float(end_caps),
    )


def _unit(law: str, rod: Rod) -> tuple[str, float]:
    """(name, N): what axial drag is counted in, and the force on the whole rod that is 1 of it."""
    if FITS[law].grains and rod.area and rod.pressure:
        return "k", rod.area * rod.pressure
    return ("axial_stress", rod.area) if rod.area else ("axial_force", 1.0)


def _in_newton(law: str, rod: Rod, values) -> np.ndarray:
    """The parameters with the axial drag as a force on the whole rod."""
    values = np.array(values, float)
    values[len(FITS[law].names)] *= _unit(law, rod)[1]
    return values


def _forces(law: str, rod: Rod, end_caps: float, psi, values) -> np.ndarray:
    """(2, ...), N; values: of the law, the axial force (N) and, if one more, e of the ends in place of ``end_caps``."""
    kind = FITS[law]
    n = len(kind.names)
    medium, v = kind.make(*map(float, values[:n])), (np.cos(psi), np.sin(psi))
    force = np.array(medium.traction(*v))
    e = float(values[n + 1]) if len(values) > n + 1 else end_caps
    if e:
        force = force + EndCaps(rod.radius / rod.length, head=1.0, tail=0.0).traction(medium, *v) * np.array(e)
    return values[n] * force


def _weighted(data: RodDrag, forces: np.ndarray) -> np.ndarray:
    return (np.sqrt(data.weight) * (forces - data.forces))[:, data.weight > 0].ravel()


def _starts(kind: Kind, data: RodDrag, residual: Callable, fitted: bool) -> list[np.ndarray]:
    """The best few of all starts, each with the axial force that suits it best."""
    found = []
    for own in itertools.product(*kind.starts, *([(0.5, 1.0, 3.0)] if fitted else [])):
        law, caps = own[: len(kind.names)], own[len(kind.names) :]
        zero, one = (residual(np.array([*law, force, *caps])) for force in (0.0, 1.0))
        slope = one - zero
        force = max(-(slope @ zero) / (slope @ slope), 1e-9 * np.abs(data.forces).max())
        start = np.array([*law, force, *caps])
        found.append((float(np.sum((zero + force * slope) ** 2)), start))
    return [start for _, start in sorted(found, key=lambda x: x[0])[:4]]


def _best(residual: Callable, starts: list[np.ndarray], low, high):
    from scipy.optimize import least_squares

    ends = []
    for start in starts:
        ends.append(
            least_squares(
                residual, start, jac="3-point", bounds=(low, high), x_scale=start, max_nfev=200, xtol=EXACT, ftol=EXACT,
                gtol=EXACT,
            )
        )  # fmt: skip
    return min(ends, key=lambda end: end.cost)


def _check_inside(names, values, low, high) -> None:
    """ValueError if a parameter other than the axial drag ends on a bound."""
    for name, x, *bounds in zip(names, values, low, high):
        for bound in bounds if name != "axial_force" else ():
            if abs(x - bound) <= LEVELS * max(abs(bound), 1.0):
                instead = "leave the end caps out" if name == CAPS else "measure at more angles, or fit another law"
                told = f"the fit ends at the edge of {_told(name)}, {_degrees(name, bound):g}"
                raise ValueError(f"{told}: these data do not settle it; {instead}")


def _told(name: str) -> str:
    return f"{name} (degrees)" if name == "gamma0" else name


def _degrees(name: str, value: float) -> float:
    return math.degrees(value) if name == "gamma0" else value


def _covariance(names, best, count: int) -> np.ndarray:
    """Of the parameters, from the slopes of the residuals and their scatter; ValueError if they do not tell them apart."""
    size = np.where(best.x > 0, best.x, 1.0)
    _, s, turned = np.linalg.svd(best.jac * size, full_matrices=False)
    if s[-1] < UNTOLD * s[0]:
        raise ValueError(f"these data do not tell {', '.join(map(_told, names))} apart: measure at more angles")
    root = (turned.T / s) * size[:, None]
    return root @ root.T * (2 * best.cost / (count - len(names)))
