"""The base of force laws: drag per unit length on a body that slides along and across
itself."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from rft.core.checks import unmasked
from rft.core.refusal import Refusal, require
from rft.core.registry import Registry, classes_with
from rft.formulas.vectors import formula, sqrt, where

LAWS = Registry("geomech.media", "law", "a law", classes_with("traction"))


class Medium(Protocol):
    """A force law of the horizontal plane. Forces are in units of the medium's own
    axial drag.

    ``dry`` holds rate-independent terms (q, k_t, k_n), each of which adds

        f_t = k_t v_t / R,   f_n = k_n v_n / R,
        R = sqrt(q^2 v_t^2 + v_n^2 + rounding^2),

    and ``viscous`` the coefficients (c_t, c_n) of f_t = c_t v_t, f_n = c_n v_n.
    Together they give the exact averages of `rft.formulas.link`. A law of another form
    has neither (or None) and is averaged by quadrature.

    Only `traction` is required. Optional members:

    slopes(v_t, v_n, rounding): (df_t/dv_t, df_t/dv_n, df_n/dv_t, df_n/dv_n); by default
    central differences. mirror: True if f_n is odd and f_t even in v_n, so that left
    and right are alike.
    k: the factor k of Eq. 2.
    covariance: (n, n), of the parameters named in ``uncertain``; it changes no force.

    A law runs in compiled code if its traction, and its slopes if it has them, are
    formulas (`rft.formulas.vectors.formula`) of its number fields.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from rft import Chain, body_velocity
    >>> @dataclass(frozen=True)
    ... class Drag:
    ...     ratio: float = 2.0
    ...
    ...     def traction(self, v_t, v_n, eps=0.0):
    ...         return v_t, self.ratio * v_n
    ...
    >>> # The same as by Viscous(2):
    >>> body_velocity(Drag(), Chain(), [0.5, 0.3], [1.0, 0.0]).xi.round(4)
    array([-0.0014, -0.0035, -0.0817])
    """

    def traction(
        self, v_t: Any, v_n: Any, rounding: Any = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the drag per unit length (f_t, f_n) opposing the velocity (v_t, v_n);
        arrays broadcast together."""
        ...


@formula
def terms_traction(law, v_t, v_n, rounding):
    """Return the traction (f_t, f_n) of a law's viscous and dry terms, zero at rest."""
    f_t = law.viscous[0, 0] * v_t
    f_n = law.viscous[0, 1] * v_n
    for j in range(len(law.dry)):
        q = law.dry[j, 0]
        k_t = law.dry[j, 1]
        k_n = law.dry[j, 2]
        R2 = q * q * v_t * v_t + v_n * v_n + rounding * rounding
        R = sqrt(where(R2 > 0.0, R2, 1.0))
        f_t = f_t + k_t * v_t / R
        f_n = f_n + k_n * v_n / R
    return f_t, f_n


@formula
def terms_slopes(law, v_t, v_n, rounding):
    """Return (df_t/dv_t, df_t/dv_n, df_n/dv_t, df_n/dv_n) of viscous and dry terms;
    infinite slopes at rest are returned as 0."""
    zero = 0.0 * v_t
    tt = zero + law.viscous[0, 0]
    tn = zero
    nt = zero
    nn = zero + law.viscous[0, 1]
    for j in range(len(law.dry)):
        q = law.dry[j, 0]
        k_t = law.dry[j, 1]
        k_n = law.dry[j, 2]
        R2 = q * q * v_t * v_t + v_n * v_n + rounding * rounding
        inverse = where(R2 > 0.0, 1.0, 0.0) / sqrt(where(R2 > 0.0, R2, 1.0))
        e_t = v_t * inverse
        e_n = v_n * inverse
        e = rounding * inverse
        tt = tt + k_t * (e_n * e_n + e * e) * inverse
        tn = tn - k_t * e_t * e_n * inverse
        nt = nt - k_n * q * q * e_t * e_n * inverse
        nn = nn + k_n * (q * q * e_t * e_t + e * e) * inverse
    return tt, tn, nt, nn


class TermLaw:
    """Base of laws that are a sum of dry and viscous terms: `traction` follows from the
    terms.

    Examples
    --------
    >>> from rft import Granular
    >>> from rft.laws import TermLaw
    >>> isinstance(Granular(1.8, 0.24), TermLaw), len(Granular(1.8, 0.24).dry)
    (True, 2)
    """

    dry: tuple[tuple[float, float, float], ...] = ()
    viscous: tuple[float, float] = (0.0, 0.0)
    mirror = True

    def traction(
        self, v_t: Any, v_n: Any, rounding: Any = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the drag per unit length (f_t, f_n) opposing (v_t, v_n), in units of
        the axial drag; zero at rest."""
        v_t = unmasked("v_t", v_t)
        v_n = unmasked("v_n", v_n)
        return terms_traction(term_numbers(self), v_t, v_n, rounding)

    def slopes(self, v_t: Any, v_n: Any, rounding: Any = 0.0) -> tuple[np.ndarray, ...]:
        """Return (df_t/dv_t, df_t/dv_n, df_n/dv_t, df_n/dv_n); infinite slopes at rest
        are returned as 0."""
        v_t, v_n = np.broadcast_arrays(unmasked("v_t", v_t), unmasked("v_n", v_n))
        return terms_slopes(term_numbers(self), v_t, v_n, rounding)


class TermNumbers(NamedTuple):
    """Numbers of viscous and dry terms. viscous: (1, 2), coefficients (c_t, c_n). dry:
    (T, 3), terms (q, k_t, k_n)."""

    viscous: np.ndarray
    dry: np.ndarray


def term_numbers(medium) -> TermNumbers:
    """Return the terms of a medium in closed form as arrays, those that act along the
    element first; of a batch (`rft.laws.batch`) with the samples on a last axis."""
    if hasattr(medium, "terms_of_samples"):
        return medium.terms_of_samples
    terms = sorted(medium.dry, key=lambda term: term[1] == 0.0)
    return TermNumbers(
        np.array([medium.viscous], float), np.array(terms, float).reshape(-1, 3)
    )


def dry_terms(medium) -> tuple[tuple[float, float, float], ...] | None:
    """Return the dry terms (q, k_t, k_n) of a medium; None without a closed form."""
    return getattr(medium, "dry", None)


def viscous_terms(medium) -> tuple[float, float] | None:
    """Return the viscous coefficients (c_t, c_n) of a medium; None without a closed
    form."""
    return getattr(medium, "viscous", None)


def is_closed(medium: Any) -> bool:
    """Return whether a medium has a closed form, and so exact averages over a link.

    Examples
    --------
    >>> from rft.laws import Viscous, is_closed
    >>> is_closed(Viscous())
    True
    """
    return dry_terms(medium) is not None and viscous_terms(medium) is not None


def is_mirror(medium: Any) -> bool:
    """Return whether a medium claims that left and right are alike; a field then takes
    half the balances.

    Examples
    --------
    >>> from rft.laws import Viscous, is_mirror
    >>> is_mirror(Viscous())
    True
    """
    return bool(getattr(medium, "mirror", False))


def is_frozen(value) -> bool:
    """Return whether a value is a frozen dataclass of hashable fields (an array is not
    hashable)."""
    parameters = getattr(type(value), "__dataclass_params__", None)
    if parameters is None or not parameters.frozen:
        return False
    try:
        hash(value)
    except TypeError:
        return False
    return True


def cached_if_immutable(function: Callable) -> Callable:
    """Return the function with a cache of its last 32 calls; calls with an argument
    that may change are not cached.

    Immutable are frozen dataclasses (`is_frozen`), text, numbers, None, and tuples of
    these."""
    cached = functools.lru_cache(maxsize=32)(function)

    @functools.wraps(function)
    def call(*args):
        if _is_immutable(args):
            return cached(*args)
        return function(*args)

    return call


def _is_immutable(x) -> bool:
    if type(x) is tuple:
        return all(map(_is_immutable, x))
    return type(x) in (str, int, float, type(None)) or is_frozen(x)


# Velocities at which properties of a law are checked: 48 directions at 13 speeds,
# (13, 48).
SPEEDS = np.logspace(-12, 12, 13)[:, None]
DIRECTIONS = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
VELOCITIES = SPEEDS * np.cos(DIRECTIONS), SPEEDS * np.sin(DIRECTIONS)


@cached_if_immutable
def is_odd(medium: Medium) -> bool:
    """Return whether f(-v) = -f(v) at VELOCITIES, so that the ends of an element are
    alike."""
    if _is_sum_of_terms(medium):
        return True
    v_t, v_n = VELOCITIES
    with np.errstate(all="ignore"):
        forward = _traction(medium, v_t, v_n)
        backward = _traction(medium, -v_t, -v_n)
    return bool((np.abs(forward + backward) <= 1e-13 * np.abs(forward).max(0)).all())


def _traction(medium: Medium, v_t, v_n) -> np.ndarray:
    """Return the traction of a medium as one array (2, ...)."""
    return np.stack(np.broadcast_arrays(*medium.traction(v_t, v_n)))


def require_law(medium: Medium) -> None:
    """Raise ValueError unless a medium has a `traction` that takes and returns
    arrays."""
    is_law = hasattr(medium, "traction") and not isinstance(medium, type)
    require(
        is_law,
        "medium must be a force law such as Granular(C=1.8, gamma0=0.24)",
        value=medium,
    )
    if is_closed(medium):
        return
    name = f"{type(medium).__name__}.traction"
    try:
        with np.errstate(all="ignore"):
            f_t, f_n = medium.traction(1.0, 0.0)
            f_t, f_n = medium.traction(np.ones((2, 3)), np.zeros((2, 3)), 1e-6)
    except TypeError as error:
        raise Refusal(
            f"{name} must accept (v_t, v_n, rounding=0.0) and return (f_t, f_n), "
            "rounding being the speed below which dry friction is rounded off",
            because=str(error),
        ) from error
    except Exception as error:
        raise Refusal(
            f"{name} fails", because=f"{type(error).__name__}: {error}"
        ) from error
    shape_t = np.shape(f_t)
    shape_n = np.shape(f_n)
    require(
        {shape_t, shape_n} <= {(), (1,), (2, 3)},
        f"{name} must return arrays of the velocities' shape (2, 3), "
        f"got {shape_t} and {shape_n}",
    )


def _is_sum_of_terms(medium: Medium) -> bool:
    """Return whether the traction of a medium is the sum of its terms."""
    return getattr(type(medium), "traction", None) is TermLaw.traction


def has_only_drags(medium: TermLaw) -> bool:
    """Return whether no term of a closed form pushes and some term drags."""
    coefficients = [*medium.viscous]
    for _, k_t, k_n in medium.dry:
        coefficients += [k_t, k_n]
    return min(coefficients) >= 0.0 and 0.0 < max(coefficients) < np.inf


def require_drag(medium: Medium) -> None:
    """Raise ValueError if the medium pushes at one of VELOCITIES, that is if its force
    there has a part along the motion, or if it has no drag at all."""
    require_law(medium)
    if _is_sum_of_terms(medium) and has_only_drags(medium):
        return
    v_t, v_n = VELOCITIES
    with np.errstate(all="ignore"):
        f_t, f_n = medium.traction(v_t, v_n)
        cosine = (f_t * v_t + f_n * v_n) / (
            np.hypot(f_t, f_n) * SPEEDS
        )  # 1 straight against the motion
    name = type(medium).__name__
    cosine = np.nan_to_num(cosine)
    require(
        bool((cosine > 0).any()),
        f"{name} has no drag at any velocity",
        instead="its traction must be positive",
    )
    worst = np.unravel_index(np.argmin(cosine), cosine.shape)
    require(
        cosine[worst] > -1e-09,
        f"{name} pushes instead of drags at velocity ({v_t[worst]:.3g}, "
        f"{v_n[worst]:.3g}) along and across the body",
        because="drag is positive in the direction of the motion it opposes",
        instead="change its sign there",
    )


def is_linear(medium: Medium) -> bool:
    """Return whether drag is proportional to velocity, and so the body velocity linear
    in alphadot.

    Examples
    --------
    >>> from rft.laws import Coulomb, Viscous, is_linear
    >>> is_linear(Viscous()), is_linear(Coulomb())
    (True, False)
    """
    return dry_terms(medium) == () and is_closed(medium)


def is_rate_independent(medium: Medium) -> bool:
    """Return whether drag grows with one power of the speed in all directions, so that
    the speed of a gait does not matter.

    Examples
    --------
    >>> from rft.laws import Viscous, is_rate_independent
    >>> is_rate_independent(Viscous())
    True
    """
    return speed_exponent(medium) is not None


def speed_exponent(medium: Medium) -> float | None:
    """Return the power of the speed with which drag grows in all directions, 0 for dry
    media, 1 for viscous ones; None if it differs between speeds or directions.

    Examples
    --------
    >>> from rft.laws import Coulomb, Viscous, speed_exponent
    >>> speed_exponent(Coulomb()), speed_exponent(Viscous())
    (0.0, 1.0)
    """
    if is_closed(medium):
        if not medium.dry:
            return 1.0
        return None if np.any(medium.viscous) else 0.0
    speeds = np.logspace(-3, 1, 5)[:, None]
    with np.errstate(all="ignore"):
        f = _traction(medium, speeds * np.cos(DIRECTIONS), speeds * np.sin(DIRECTIONS))
    size = np.sqrt((f**2).sum((0, 2)))
    if not np.isfinite(size).all() or not size.all():
        return None
    form = f / size[:, None]
    growth = size[1:] / size[:-1]
    has_one_form = np.ptp(form, axis=1).max() < 1e-6
    has_one_growth = np.ptp(growth) < 1e-6 * growth.max()
    if not (has_one_form and has_one_growth):
        return None
    return round(float(np.log10(growth.mean())), 6) + 0.0
