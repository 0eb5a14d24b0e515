"""Fits of force laws to the drag on a rod, by least squares (paper Sec. II, Eqs. 2-3,
Fig. 5(c)).

A rod is dragged at the attack angle psi between its velocity and its axis. A law in
units of its own axial drag, times the rod's axial drag F, gives the forces along and
across the rod, F f_t(cos psi, sin psi) and F f_n(cos psi, sin psi). `FITS` has the laws
with their parameters, bounds and start values; F is fitted beside them.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rft.core.checks import in_range
from rft.core.refusal import Refusal, require
from rft.effects.end_caps import EndCaps
from rft.laws.base import Medium
from rft.laws.coulomb import Coulomb
from rft.laws.drag import Rod, RodDrag
from rft.laws.granular import Granular
from rft.laws.viscous import Viscous

CAPS = "end_caps"
ACROSS = "end_caps_across"
MOST_CAPS = 10.0  # e of a hemisphere is 4
AT_BOUND = 1e-6  # of a bound: a parameter that near lies on it
# relative change of parameters and of the sum of squares that ends a fit
CONVERGED = 1e-14
# smallest singular value of the slopes, over the largest, below which parameters are
# not determined
DEPENDENT = 1e-7
LEVEL = 0.95  # confidence of intervals and bands
ONE_SIGMA = 0.6827  # confidence of one standard deviation


def student_factor(degrees_of_freedom: float, level: float = LEVEL) -> float:
    """Return half the width of a confidence interval over the standard error, by
    Student's distribution.

    Examples
    --------
    >>> from rft.fits.rods import student_factor
    >>> round(student_factor(10), 3)
    2.228
    """
    from scipy.special import stdtrit

    return float(stdtrit(degrees_of_freedom, (1 + level) / 2))


@dataclass(frozen=True)
class FittedLaw:
    """A law with its parameters.

    names: of the parameters. build: class of the law, called with them. granular:
    whether drag is proportional to the weight of the grains above, with k of Eq. 2.
    bounds: (low, high) of each parameter. starts: start values of each; the best of all
    combinations are refined."""

    names: tuple[str, ...]
    build: Callable[..., Medium]
    granular: bool
    bounds: tuple[tuple[float, float], ...] = ()
    starts: tuple[tuple[float, ...], ...] = ()


UNKNOWN_ROD = Rod()
START_ANGLES = tuple(
    np.radians((1.0, 2.0, 4.0, 7.0, 10.0, 14.0, 20.0, 30.0, 45.0, 65.0)).tolist()
)
FITS = {
    "granular": FittedLaw(
        ("C", "gamma0"),
        Granular,
        True,
        ((0.0, 1e3), (math.radians(0.1), math.radians(89.0))),
        ((0.3, 1.0, 2.0, 5.0, 20.0), START_ANGLES),
    ),
    "viscous": FittedLaw(
        ("ratio",), Viscous, False, ((1e-6, 1e6),), ((0.3, 1.0, 2.0, 6.0),)
    ),
    "coulomb": FittedLaw((), Coulomb, True),
}


@dataclass(frozen=True, eq=False)
class Fit:
    """A law fitted to drag.

    names, values: of the fitted parameters: those of the law (gamma0 in rad), its axial
    drag, and `CAPS` where the end caps are fitted. The axial drag is, for a granular
    law, ``k`` of Eq. 2 where radius, length and depth of the rod and the density of the
    bed are known; else ``axial_stress`` (Pa, over the projected area) where radius and
    length are; else ``axial_force`` (N, on the whole rod). covariance: (n, n), of the
    parameters, from the scatter of the forces about the law, taken for independent
    noise. residuals: (2, N), measured minus fitted forces, N. end_caps: e of both ends
    together (`EndCaps`), 0 without. Where the data tell the ends from the flank, law
    and residuals are the flank's, and e follows from the ends with `EndCaps.across`,
    the last of the parameters.

    Examples
    --------
    >>> from rft.fits.rods import fit
    >>> from rft.laws.drag import rod_drag
    >>> along, across = [1.0, 0.9, 0.5, 0.0], [0.0, 1.0, 1.7, 2.0]  # N
    >>> drag = rod_drag([0, 30, 60, 90], along, across)  # at angles in degrees
    >>> found = fit("viscous", drag)
    >>> found.names, found.values.round(2), found.residuals.shape
    (('ratio', 'axial_force'), array([1.96, 1.01]), (2, 4))
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
        rows = zip(self.names, self.values, self.intervals)
        parameters = ", ".join(
            f"{name} {value:.4g} ({low:.4g} to {high:.4g})"
            for name, value, (low, high) in rows
        )
        return (
            f"Fit({self.law}, 95 %: {parameters}; {self.data.psi.size} rows, "
            f"rms {self.rms:.3g} N)"
        )

    @property
    def rms(self) -> float:
        """Root mean square of the residuals of positive weight, N."""
        return float(np.sqrt(np.mean(self.residuals[:, self.data.weight > 0] ** 2)))

    @property
    def errors(self) -> np.ndarray:
        """Standard errors of the parameters."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def degrees_of_freedom(self) -> int:
        """Number of forces of positive weight minus that of parameters."""
        return self.data.n_forces - len(self.names)

    @property
    def intervals(self) -> np.ndarray:
        """Confidence intervals of the parameters, 95 %, (n, 2)."""
        half = student_factor(self.degrees_of_freedom) * self.errors
        return np.stack([self.values - half, self.values + half], -1)

    @property
    def axial_force(self) -> float:
        """Drag on the whole rod at psi = 0 without its ends, N."""
        _, newton = _unit(self.law, self.rod)
        return float(self.values[len(FITS[self.law].names)]) * newton

    @property
    def axial_stress(self) -> float | None:
        """`axial_force` over the projected area 2 r L, Pa; None where the area is not
        known."""
        if self.rod.area:
            return self.axial_force / self.rod.area
        return None

    @property
    def k(self) -> float | None:
        """Factor k of Eq. 2; None where the rod's sizes or the density are not known,
        and for a fluid."""
        if "k" in self.names:
            return float(self.values[self.names.index("k")])
        return None

    @property
    def medium(self) -> Medium:
        """The law with the covariance of its parameters, widened by Student's
        distribution so that one standard deviation holds 68 %."""
        build = FITS[self.law].build
        values = {}
        for name, value in zip(self.names, self.values.tolist()):
            if name in build.__dataclass_fields__:  # k only where the law has it
                values[name] = value
        if not values:
            return build()
        n = len(values)
        factor = student_factor(self.degrees_of_freedom, ONE_SIGMA)
        return build(**values, covariance=factor**2 * self.covariance[:n, :n])

    def caps(self, radius: float) -> EndCaps:
        """Return the end caps, half of e at each end, of a body of that radius in body
        lengths."""
        across = dict(zip(self.names, self.values.tolist())).get(ACROSS)
        return EndCaps(radius, self.end_caps / 2, self.end_caps / 2, across)

    def forces(self, psi, values=None) -> np.ndarray:
        """Return the forces (2, ...) along and across the rod at attack angles psi
        (rad), N; values: parameters in place of the fitted ones."""
        if values is None:
            values = self.values
        values = _in_newton(self.law, self.rod, values)
        if self.data.ends is not None:
            of_flank = values[: len(FITS[self.law].names) + 1]
            return _forces(self.law, self.rod, 0.0, psi, of_flank)
        return _forces(self.law, self.rod, self.end_caps, psi, values)

    def band(self, psi) -> np.ndarray:
        """Return half the width (2, ...) of the 95 % confidence band of the law at
        angles psi (rad), N, by linear propagation of the covariance."""
        slopes = []
        steps = np.eye(len(self.values))
        for value, error, step in zip(self.values, self.errors, steps):
            h = max(1e-3 * error, 1e-9 * abs(value)) or 1e-12
            above = self.forces(psi, self.values + h * step)
            below = self.forces(psi, self.values - h * step)
            slopes.append((above - below) / (2 * h))
        slopes = np.array(slopes)
        variance = np.einsum("i...,ij,j...->...", slopes, self.covariance, slopes)
        error = np.sqrt(np.maximum(variance, 0.0))
        return student_factor(self.degrees_of_freedom) * error


def fit(
    law: str, data: RodDrag, rod: Rod = UNKNOWN_ROD, end_caps: float | str = 0.0
) -> Fit:
    """Return the law of that name in `FITS` fitted to drag, by weighted least squares
    of both components.

    end_caps: e of both ends together (`EndCaps`; 1 for one flat end), 0 for none, or
    "fitted"; other than 0 only for the granular law and a rod of known radius and
    length. Data that tell the ends from the flank take "fitted" or 0. Raises ValueError
    if the data do not determine the parameters, or if a parameter ends on a bound.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.fits.rods import fit
    >>> from rft.laws.drag import rod_drag
    >>> psi = np.array([0.0, 15.0, 30.0, 45.0, 60.0, 90.0])  # degrees
    >>> along, across = np.cos(np.radians(psi)), 2 * np.sin(np.radians(psi))  # N
    >>> found = fit("viscous", rod_drag(psi, along, across))
    >>> round(float(found.medium.ratio), 6)
    2.0
    """
    fitted_law = FITS[law]
    _check_end_caps(law, rod, end_caps)
    fits_caps = isinstance(end_caps, str)
    if data.ends is not None and end_caps:
        require(
            fits_caps,
            "the file has forces on the flank and on the ends",
            instead="leave ``end_caps`` out or use 'fitted'",
        )
        return _with_ends(fit(law, data, rod))
    names = (*fitted_law.names, "axial_force")
    bounds = [*fitted_law.bounds, (0.0, np.inf)]
    fixed_caps = 0.0
    if fits_caps:
        names = (*names, CAPS)
        bounds.append((0.0, MOST_CAPS))
    else:
        fixed_caps = float(end_caps)
    require(
        data.n_forces > len(names),
        f"{data.n_forces} forces are too few for {', '.join(names)}",
        instead="measure at more angles",
    )

    def residual(values):
        return _weighted(data, _forces(law, rod, fixed_caps, data.psi, values))

    low, high = np.array(bounds).T
    best = _best(residual, _starts(fitted_law, data, residual, fits_caps), low, high)
    require(
        best.success,
        f"the fit of {', '.join(map(_with_unit, names))} does not converge",
        instead="measure at more angles",
    )
    _check_inside(names, best.x, low, high)
    covariance = _covariance(names, best, data.n_forces)
    # The axial drag in its own unit, in place of a force.
    unit, newton = _unit(law, rod)
    axial = len(fitted_law.names)
    scale = np.ones(len(names))
    scale[axial] = 1.0 / newton
    return Fit(
        law,
        data,
        rod,
        names=(*names[:axial], unit, *names[axial + 1 :]),
        values=best.x * scale,
        covariance=covariance * np.outer(scale, scale),
        residuals=data.forces - _forces(law, rod, fixed_caps, data.psi, best.x),
        end_caps=float(best.x[-1]) if fits_caps else fixed_caps,
    )


def _check_end_caps(law: str, rod: Rod, end_caps: float | str) -> None:
    """Refuse end caps that are no number in range, and those without a law or a rod
    that can have them."""
    is_word = isinstance(end_caps, str)
    require(
        not is_word or end_caps == "fitted",
        "end caps must be 'fitted' or a number",
        value=end_caps,
    )
    if not is_word:
        in_range("end caps", end_caps, 0, MOST_CAPS)
    if end_caps:
        require(
            law == "granular",
            f"end caps need the granular law, got {law}",
            instead="leave them out",
        )
        require(
            rod.radius and rod.length,
            "end caps need the radius and the length of the rod",
            instead="give both, or leave the end caps out",
        )
        require(
            rod.radius <= rod.length,
            f"end caps need a rod longer than its radius, got {rod.length:g} m",
        )


def _with_ends(flank: Fit) -> Fit:
    """Return a fit to the flank with e and ``across`` of the ends, by least squares of
    the forces on them. Their variance has the scatter of these forces, and their
    covariance with the law what the law leaves uncertain."""
    from scipy.optimize import least_squares

    data = flank.data
    n = len(flank.values)
    n_law = len(FITS[flank.law].names)
    v = (np.cos(data.psi), np.sin(data.psi))
    names = (CAPS, ACROSS)

    def caps(values: np.ndarray):
        """Return the least-squares solution of e and ``across`` with parameters of the
        law."""
        values = _in_newton(flank.law, flank.rod, values)
        medium = FITS[flank.law].build(*map(float, values[:n_law]))

        def residual(x):
            end = _one_end(flank.rod, across=float(x[1]))
            force = values[n_law] * x[0] * np.array(end.traction(medium, *v))
            return _weighted(data, force, data.ends)

        start = [1.0, 1.0]
        bounds = ([-np.inf, 0.0], [np.inf, MOST_CAPS])
        return least_squares(
            residual,
            start,
            jac="3-point",
            bounds=bounds,
            xtol=CONVERGED,
            ftol=CONVERGED,
            gtol=CONVERGED,
        )

    best = caps(flank.values)
    e = float(best.x[0])
    require(
        0 < e < MOST_CAPS,
        f"the force on the ends corresponds to {e:.2g} flat ends",
        because=f"e must be 0 to {MOST_CAPS:g}",
    )
    sizes = np.where(flank.errors > 0, flank.errors, np.abs(flank.values))
    slopes = []
    for h in np.diag(1e-4 * sizes):
        change = caps(flank.values + h).x - caps(flank.values - h).x
        slopes.append(change / (2 * h.max()))
    slope = np.array(slopes)
    covariance = np.zeros((n + 2, n + 2))
    covariance[:n, :n] = flank.covariance
    covariance[:n, n:] = flank.covariance @ slope
    covariance[n:, :n] = covariance[:n, n:].T
    covariance[n:, n:] = slope.T @ flank.covariance @ slope + _covariance(
        names, best, data.n_forces
    )
    values = np.append(flank.values, best.x)
    return dataclasses.replace(
        flank,
        names=(*flank.names, *names),
        values=values,
        covariance=covariance,
        end_caps=e,
    )


def _one_end(rod: Rod, across: float | None = None) -> EndCaps:
    """Return the cap of one flat end of a rod, whose radius is over the length."""
    return EndCaps(rod.radius / rod.length, head=1.0, tail=0.0, across=across)


def _unit(law: str, rod: Rod) -> tuple[str, float]:
    """Return the name of the parameter for axial drag, and the force on the whole rod,
    N, where it is 1."""
    if FITS[law].granular and rod.area and rod.pressure:
        return "k", rod.area * rod.pressure
    if rod.area:
        return "axial_stress", rod.area
    return "axial_force", 1.0


def _in_newton(law: str, rod: Rod, values) -> np.ndarray:
    """Return the parameters with the axial drag as a force on the whole rod, N."""
    values = np.array(values, float)
    values[len(FITS[law].names)] *= _unit(law, rod)[1]
    return values


def _forces(law: str, rod: Rod, end_caps: float, psi, values) -> np.ndarray:
    """Return the forces (2, ...), N; values: parameters of the law, the axial force
    (N), and optionally e of the ends in place of ``end_caps``."""
    fitted_law = FITS[law]
    n = len(fitted_law.names)
    medium = fitted_law.build(*map(float, values[:n]))
    v = (np.cos(psi), np.sin(psi))
    force = np.array(medium.traction(*v))
    e = end_caps
    if len(values) > n + 1:
        e = float(values[n + 1])
    if e:
        force = force + np.array(_one_end(rod).traction(medium, *v)) * e
    return values[n] * force


def _weighted(
    data: RodDrag, forces: np.ndarray, measured: np.ndarray | None = None
) -> np.ndarray:
    """Return forces minus those measured, by default on the rod, in units of their
    errors."""
    if measured is None:
        measured = data.forces
    return (np.sqrt(data.weight) * (forces - measured))[:, data.weight > 0].ravel()


def _starts(
    fitted_law: FittedLaw, data: RodDrag, residual: Callable, fits_caps: bool
) -> list[np.ndarray]:
    """Return the best four of all combinations of start values, each with the axial
    force that fits it best."""
    starts = list(fitted_law.starts)
    if fits_caps:
        starts.append((0.5, 1.0, 3.0))
    candidates = []
    for values in itertools.product(*starts):
        law = values[: len(fitted_law.names)]
        caps = values[len(fitted_law.names) :]
        # Residuals are linear in the axial force.
        at_zero = residual(np.array([*law, 0.0, *caps]))
        slope = residual(np.array([*law, 1.0, *caps])) - at_zero
        best = -(slope @ at_zero) / (slope @ slope)
        force = max(best, 1e-9 * np.abs(data.forces).max())
        start = np.array([*law, force, *caps])
        candidates.append((float(np.sum((at_zero + force * slope) ** 2)), start))
    return [start for _, start in sorted(candidates, key=lambda x: x[0])[:4]]


def _best(residual: Callable, starts: list[np.ndarray], low, high):
    """Return the best of the least-squares solutions from several starts."""
    from scipy.optimize import least_squares

    solutions = [
        least_squares(
            residual,
            start,
            jac="3-point",
            bounds=(low, high),
            x_scale=start,
            max_nfev=200,
            xtol=CONVERGED,
            ftol=CONVERGED,
            gtol=CONVERGED,
        )
        for start in starts
    ]
    return min(solutions, key=lambda solution: solution.cost)


def _check_inside(names, values, low, high) -> None:
    """Raise ValueError if a parameter other than the axial drag ends on a bound."""
    for name, x, *bounds in zip(names, values, low, high):
        if name == "axial_force":
            continue
        cure = "measure at more angles, or fit another law"
        if name == CAPS:
            cure = "leave the end caps out"
        for bound in bounds:
            require(
                abs(x - bound) > AT_BOUND * max(abs(bound), 1.0),
                f"the fit ends at the bound {_with_unit(name)} = "
                f"{_degrees(name, bound):g}",
                because="these data do not determine it",
                instead=cure,
            )


def _with_unit(name: str) -> str:
    """Return the name of a parameter as messages show it, gamma0 in degrees."""
    return "gamma0 (degrees)" if name == "gamma0" else name


def _degrees(name: str, value: float) -> float:
    if name == "gamma0":
        return math.degrees(value)
    return value


def _covariance(names, best, count: int) -> np.ndarray:
    """Return the covariance of the parameters, from the slopes of the residuals and
    their scatter; ValueError if the data do not determine the parameters."""
    size = np.where(best.x > 0, best.x, 1.0)
    _, s, right = np.linalg.svd(best.jac * size, full_matrices=False)
    if s[-1] < DEPENDENT * s[0]:
        raise Refusal(
            f"these data do not distinguish {', '.join(map(_with_unit, names))}",
            instead="measure at more angles",
        )
    root = (right.T / s) * size[:, None]
    return root @ root.T * (2 * best.cost / (count - len(names)))
