"""The contents of a file of a connection, and their checks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.geometry.representations.harmonics import Harmonics
from geomech.mathematics.geometry.representations.tube import Tube
from rft.core.refusal import Refusal, printable
from rft.core.registry import Registry, functions_with

LONGEST_NAME = 60  # characters of the name of a frame, or of a shape variable
MINIMUM_PERTURBATION = "minimum-perturbation"
UNKNOWN_FRAME = "that of the table"  # of a file that states none
LARGEST_ANGLE = 10 * np.pi  # rad of a shape variable; degrees are suspected beyond it
LARGEST_ENTRY = 1e9  # of A, body lengths or m or rad per rad
SIGNS = {"+": "xi = + A alphadot", "-": "xi = - A alphadot"}
BODY = ("lengths", "frame", "modes", "waves")  # the keys of a chain of links in a file
LAYOUTS = ("arrays", "struct")
ORDERS = ("ndgrid", "meshgrid")
# Readers, functions parse(raw, sign, order, sha256) -> Stored. Their attributes:
#   suffix    of the files' names
#   write     where results can be written: a function (path, result, **settings) of a
#             result of `geomech.studies.maps.fields`
#   settings  the names of its settings, of "sign", "order" and "layout"
#   joints    the only number of joints that it takes, if there is one
#   periods   whether it stores periods of shape variables; False if left out
#   whole     False where it takes A, its error and a quadratic metric alone
FORMATS = Registry(
    "geomech.formats", "suffix", "a file format", functions_with("suffix")
)
ROWS = ("x", "y", "theta")
PERIOD = "period_"  # before the name of an axis: a variable with its period
ROUNDING = 1e-9  # of the largest velocity: a displacement below it has no sign
MIRROR_SIGNS = np.array([-1.0, 1.0, 1.0])  # signs of the rows of A in a mirror


@dataclass(frozen=True, eq=False)
class Stored:
    """A connection read from a file, converted to xi = + A alphadot and to axes
    (alpha_1, alpha_2, ...).

    harmonics: the odd harmonics of xi, where the file has them. even: (3, N_1, ...),
    rms of xi(alphadot) + xi(-alphadot), if that is not 0. metric: of shape space, where
    the file has it, in body lengths; power is its norm to power_degree. length: of the
    body, in ``unit``, "BL" or "m". frame: of xi, in words. sign, order: as in the file.
    assumptions: facts inferred because the file does not state them. sha256: of the
    file. shapes: names of the shape variables, alpha_k where the file has none.
    A_error: (3, d, N_1, ...), half widths of intervals of A, which cover it in a share
    ``level`` of cases, where the file has them. sized: whether the file states length
    and unit; body lengths are assumed where it does not. body: the chain of the table,
    as arguments of `rft.Chain`, where the file has it; its frame is the one of A,
    unless ``frame`` is another. computed: what another program computed from the table
    (`geomech.io.tables.sysplotter.Computed`), in the file's frame, where the file has
    it.
    """

    connection: Connection
    harmonics: Harmonics | None = None
    even: np.ndarray | None = None
    length: float = 1.0
    unit: str = "BL"
    frame: str = UNKNOWN_FRAME
    sign: str = "+"
    order: str = "ndgrid"
    assumptions: tuple[str, ...] = ()
    sha256: str = ""
    shapes: tuple[str, ...] = ()
    metric: Metric | Finsler | None = None
    power_degree: float | None = None
    A_error: np.ndarray | None = None
    level: float | None = None
    sized: bool = True
    body: Mapping[str, Any] | None = None
    computed: Any = None

    def __post_init__(self):
        frame = printable(" ".join(self.frame.split()))[:LONGEST_NAME]
        object.__setattr__(self, "frame", frame)

    @property
    def table(self) -> Connection | Harmonics:
        """The table in which the velocity is interpolated."""
        return self.harmonics or self.connection

    @property
    def highest(self) -> int:
        """The highest harmonic; 1 for A alone."""
        return self.harmonics.highest if self.harmonics else 1

    @property
    def has_residual(self) -> bool:
        """Whether the file has the residual of its fit."""
        return bool(np.isfinite(self.table.residual).any())

    @cached_property
    def halves(self) -> tuple[Connection | Harmonics, ...]:
        """`table` on every second point of each axis, from the first and from the
        second; both have the ends of the axes."""
        return self.table.half(0), self.table.half(1)

    @cached_property
    def mirror(self) -> bool:
        """Whether left and right are symmetric, to rounding: A_x(-alpha) = -A_x(alpha),
        and A_y and A_theta are even."""
        c = self.connection
        if not all(np.allclose(a, -a[::-1], rtol=0, atol=1e-12) for a in c.axes):
            return False
        signs = MIRROR_SIGNS.reshape(3, 1, *[1] * len(c.axes))
        mirrored = signs * np.flip(c.A, tuple(range(2, c.A.ndim)))
        return bool(np.abs(mirrored - c.A).max() <= 1e-9 * np.abs(c.A).max())


def scaled(stored: Stored, factor: float) -> Stored:
    """Return the table with all lengths times ``factor``; its unit stays."""
    if factor == 1.0 and stored.sized:
        return stored
    by_row = np.array([factor, factor, 1.0])

    def times(values):
        return values * by_row.reshape(3, *[1] * (values.ndim - 1))

    c = stored.connection
    size: dict[str, Any] = {"unit": stored.unit, "length": stored.length}
    size["periods"] = c.periods
    if isinstance(c, Tube):
        series = c.taylor
        size["taylor"] = replace(
            series,
            A=times(series.A),
            slope=times(series.slope),
            errors=series.errors * by_row[:, None, None, None],
            beyond=times(series.beyond),
            standard_error=times(series.standard_error),
        )
    connection = type(c)(
        c.axes, times(c.A), times(c.residual), times(c.speed), c.degree, **size
    )
    harmonics = stored.harmonics
    if harmonics:
        harmonics = replace(
            harmonics,
            coefficients=times(harmonics.coefficients),
            residual=times(harmonics.residual),
        )
    even = stored.even
    if even is not None:
        even = times(even)
    error = stored.A_error
    if error is not None:
        error = times(error)
    return replace(
        stored, connection=connection, harmonics=harmonics, even=even, A_error=error
    )


# Checks of what files have.


def checked_axis(
    name: str, values: np.ndarray, largest: float = LARGEST_ANGLE
) -> np.ndarray:
    """Return values (N,) as ascending angles, rad; Refusal if they are none."""
    axis = checked_numbers(name, values)
    if axis.ndim != 1 or len(axis) < 4 or not (np.diff(axis) > 0).all():
        raise Refusal(
            "has no grid", instead=f"{name} must be at least 4 ascending angles in rad"
        )
    if np.abs(axis).max() > largest:
        raise Refusal(
            f"has {name} up to {np.abs(axis).max():.4g} where angles are in rad",
            instead="convert them to rad if these are degrees",
        )
    return axis


def checked_names(names: Any, defaults: list[str]) -> tuple[str, ...]:
    """Return names of shape variables from a file, or ``defaults`` where they make no
    sense."""
    if not isinstance(names, list) or not all(isinstance(x, str) for x in names):
        return tuple(defaults)
    is_distinct = len({*names}) == len(defaults)
    if is_distinct and all(_is_name(x) for x in names):
        return tuple(names)
    return tuple(defaults)


def _is_name(text: str) -> bool:
    # A $ would begin a formula in the labels of figures.
    return text.isprintable() and 0 < len(text) <= LONGEST_NAME and "$" not in text


def is_real_number(value: Any) -> bool:
    """Return whether an attribute of a file is one real number."""
    return np.ndim(value) == 0 and np.asarray(value).dtype.kind in "iuf"


def checked_numbers(name: str, values: Any) -> np.ndarray:
    """Return values as floats in the machine's order of bytes; Refusal if they are no
    numbers, not finite, or too large."""
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise Refusal(f"has {name} that is not an array of real numbers")
    array = array.astype(float)
    is_bad = ~np.isfinite(array)
    if is_bad.any():
        raise Refusal(
            f"has {name} that is not finite (nan or inf) at {_first_index(is_bad)}",
            instead="correct the file",
        )
    is_large = np.abs(array) > LARGEST_ENTRY
    if is_large.any():
        raise Refusal(
            f"has {name} above {LARGEST_ENTRY:g} at {_first_index(is_large)}",
            instead="correct the file",
        )
    return array


def _first_index(found: np.ndarray) -> str:
    return "index (" + ", ".join(map(str, np.argwhere(found)[0])) + ")"


def check_mask(
    name: str, values: np.ndarray, masked: np.ndarray, attributes: Mapping
) -> None:
    """Raise Refusal unless values (..., N_1, ...) are nan at all ``masked`` shapes
    (N_1, ...) and nowhere else. A file with such shapes must declare them, by
    ``singular_shapes`` among its ``attributes``."""
    if masked.any() and "singular_shapes" not in attributes:
        checked_numbers(name, values)
    if not np.isnan(values[..., masked]).all():
        raise Refusal(
            f"has {name} at singular shapes, where A is nan", instead="write it again"
        )
    checked_numbers(name, np.where(masked, 0.0, values))


def checked_error(
    name: str, error: np.ndarray, A: np.ndarray, attributes: Mapping
) -> np.ndarray:
    """Return half widths of intervals of A, both (3, d, N_1, ...) and nan at the same
    shapes; Refusal otherwise."""
    if error.shape != A.shape:
        raise Refusal(f"has {name} of shape {error.shape} where A has {A.shape}")
    check_mask(name, error, np.isnan(A).any((0, 1)), attributes)
    if (error < 0).any():
        raise Refusal(f"has {name} below 0 where it is half of an interval of A")
    return error.astype(float)


def body_text(body: Any) -> str:
    """Return a chain of links, and the frame of its A, as the text that files have;
    "" for another body. body: a chain, or its arguments as a dict."""
    if getattr(body, "kind", "") == "chain":
        body = {key: getattr(body, key) for key in BODY}
    if not isinstance(body, Mapping):
        return ""
    return json.dumps({key: x for key, x in body.items() if x is not None})


def checked_body(text: Any) -> dict | None:
    """Return the chain of `body_text` as arguments of `rft.Chain`; None where it makes
    no sense."""
    try:
        body = json.loads(text)
    except (ValueError, TypeError, RecursionError):
        return None
    if not isinstance(body, dict):
        return None
    return body if {"lengths", "frame"} <= {*body} <= {*BODY} else None


def checked_level(attributes: Mapping) -> float | None:
    """Return the share of cases that intervals cover, from a file's attributes; None
    where it makes no sense."""
    level = attributes.get("level")
    if is_real_number(level) and 0 < level < 1:
        return float(level)
    return None


def rms(A: np.ndarray, residual: np.ndarray | None = None) -> np.ndarray:
    """Return the rms (3, N_1, ...) of xi over uniform directions of alphadot, from A
    (3, d, N_1, ...) and the residual of its fit (3, N_1, ...)."""
    squares = (A**2).mean(1)
    if residual is not None:
        squares = squares + residual**2
    return np.sqrt(squares)


def detected_sign(connection: Connection) -> str:
    """Return "+" if xi = + A alphadot, "-" if xi = - A alphadot, for a body of two
    joints with more drag across than along.

    With alpha_k the heading of link k+1 minus that of link k, a counter-clockwise
    circle then moves it backwards, as its CCF_x is negative about the straight shape,
    in every frame of the body (Hatton et al., PRL 110, 078101 (2013)). Refusal where
    both signs, or neither, have this effect."""
    half = min(float(a[-1] - a[0]) / 2 for a in connection.axes)
    centre = np.array([a[0] + a[-1] for a in connection.axes]) / 2
    t = 2 * np.pi * np.arange(64) / 64
    radius = np.array([0.3, 0.5])[:, None, None] * half
    alpha = centre + radius * np.stack([np.cos(t), np.sin(t)], -1)
    alphadot = radius * np.stack([-np.sin(t), np.cos(t)], -1)
    xi = connection.velocity(alpha, alphadot)
    least = ROUNDING * np.abs(xi).max(initial=0.0)
    x_of_plus = displacement(xi)[:, 0]
    x_of_minus = displacement(-xi)[:, 0]
    if (x_of_plus < -least).all() and (x_of_minus > least).all():
        return "+"
    if (x_of_minus < -least).all() and (x_of_plus > least).all():
        return "-"
    raise Refusal(
        "does not state the sign of A",
        instead=(
            "add sign = '+' for xi = + A alphadot, or sign = '-' for xi = - A alphadot"
        ),
    )
