"""The contents of a file of a connection, and their checks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from geomech.geometry.connection import Connection
from geomech.geometry.harmonics import Harmonics
from geomech.geometry.metric import Finsler, Metric
from geomech.geometry.reconstruct import displacement
from geomech.geometry.tube import Tube
from rft.core.refusal import Refusal, printable
from rft.core.registry import Registry, functions_with

LONGEST_NAME = 60  # characters of what a file calls a frame, or a shape variable
MINIMUM_PERTURBATION = "minimum-perturbation"
UNKNOWN_FRAME = "that of the table"  # of a file that does not say it
LARGEST_ANGLE = (
    10 * np.pi
)  # rad of a shape variable, a joint angle or a bend; beyond it is taken for degrees
LARGEST_ENTRY = 1e9  # of A, body lengths or m or rad per rad
SIGNS = {"+": "xi = + A alphadot", "-": "xi = - A alphadot"}
BODY = ("lengths", "frame", "modes", "waves")  # what files say of a chain of links
LAYOUTS = ("arrays", "struct")
ORDERS = ("ndgrid", "meshgrid")
# Readers, parse(raw, sign, order, sha256) -> Stored. Their attributes: suffix; write, a function of (path, result, **settings),
# where a result as of `geomech.studies.fields.full_result` can be written; settings, names of those that it takes ("sign",
# "order", "layout"); joints, the only number that it takes; whole, False where it takes no more than A, what is known of its
# error, and a quadratic metric.
FORMATS = Registry(
    "geomech.formats", "suffix", "a file format", functions_with("suffix")
)
ROWS = ("x", "y", "theta")
ROUNDING = 1e-9  # of the largest velocity: a displacement below it has no sign


@dataclass(frozen=True, eq=False)
class Stored:
    """A connection read from a file, converted to xi = + A alphadot and to axes (alpha_1, alpha_2, ...).

    harmonics: the odd harmonics of xi, where the file has them. even: (3, N_1, ...), rms of xi(alphadot) +
    xi(-alphadot), if that is not 0. metric: of shape space, where the file has it, in body lengths; power is its norm
    to power_degree. length: of the body, in ``unit``, "BL" or "m". frame: of xi, in words. sign, order: as in the file.
    assumptions: facts inferred because the file does not state them. sha256: of the file. shapes: names of the shape
    variables, alpha_k where the file has none. A_error: (3, d, N_1, ...), half widths of intervals of A, which cover it
    in a share ``level`` of cases, where the file has them. sized: whether the file states length and unit; body lengths
    are assumed where it does not. body: the chain that the table is of, as arguments of `rft.Chain`, where the file
    says it; its frame is the one in which A is, unless ``frame`` is another.
    computed: what another program computed of the table (`geomech.io.tables.sysplotter.Computed`), in the file's frame,
    where the file has it.
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
        object.__setattr__(
            self, "frame", printable(" ".join(self.frame.split()))[:LONGEST_NAME]
        )

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
        """`table` on every second point of each axis, from the first and from the second, with both ends kept."""
        return self.table.half(0), self.table.half(1)

    @cached_property
    def mirror(self) -> bool:
        """Whether left and right are alike: A_x even, A_y and A_theta of A odd times odd, to rounding."""
        c = self.connection
        if not all(np.allclose(a, -a[::-1], rtol=0, atol=1e-12) for a in c.axes):
            return False
        mirrored = np.flip(c.A, tuple(range(2, c.A.ndim))) * np.array(
            [-1.0, 1.0, 1.0]
        ).reshape(3, 1, *[1] * len(c.axes))
        return bool(np.abs(mirrored - c.A).max() <= 1e-9 * np.abs(c.A).max())


def scaled(stored: Stored, factor: float) -> Stored:
    """Return the table with all lengths times ``factor``, then in the unit that ``stored`` has."""
    if factor == 1.0 and stored.sized:
        return stored
    by = np.array([factor, factor, 1.0])
    times = lambda x: x * by.reshape(3, *[1] * (x.ndim - 1))
    c, h = stored.connection, stored.harmonics
    size = {"unit": stored.unit, "length": stored.length}
    if isinstance(c, Tube):
        series = {
            name: times(getattr(c.taylor, name))
            for name in ("A", "slope", "beyond", "standard_error")
        }
        size["taylor"] = replace(
            c.taylor, errors=c.taylor.errors * by[:, None, None, None], **series
        )
    c = type(c)(c.axes, times(c.A), times(c.residual), times(c.speed), c.degree, **size)
    h = h and Harmonics(h.axes, times(h.coefficients), times(h.residual), h.degree)
    even, error = (x if x is None else times(x) for x in (stored.even, stored.A_error))
    return replace(stored, connection=c, harmonics=h, even=even, A_error=error)


def checked_axis(
    name: str, values: np.ndarray, largest: float = LARGEST_ANGLE
) -> np.ndarray:
    """Return values (N,) as ascending angles; Refusal if they are none."""
    axis = numbers(name, values)
    if axis.ndim != 1 or len(axis) < 4 or not (np.diff(axis) > 0).all():
        raise Refusal(
            "has no grid", instead=f"{name} must be at least 4 ascending angles in rad"
        )
    if np.abs(axis).max() > largest:
        raise Refusal(
            f"has {name} up to {np.abs(axis).max():.4g} where angles are in rad",
            instead="convert it if these are degrees",
        )
    return axis


def checked_names(names, defaults: list[str]) -> tuple[str, ...]:
    """Return names of shape variables from a file, or ``defaults`` where they make no sense."""
    words = (
        isinstance(names, list)
        and all(isinstance(x, str) for x in names)
        and len({*names}) == len(defaults)
    )
    good = words and all(
        x.isprintable() and 0 < len(x) <= LONGEST_NAME and "$" not in x for x in names
    )
    return tuple(names if good else defaults)


def numbers(name: str, values) -> np.ndarray:
    """Return values as floats in the machine's order of bytes; Refusal if they are none, or not finite."""
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise Refusal(f"has {name} that is no array of real numbers")
    array = array.astype(float)
    if not np.isfinite(array).all():
        raise Refusal(
            f"has {name} that is not finite (nan or inf) at {_first(~np.isfinite(array))}",
            instead="mend it",
        )
    if np.abs(array).max(initial=0.0) > LARGEST_ENTRY:
        raise Refusal(
            f"has {name} above {LARGEST_ENTRY:g} at {_first(np.abs(array) > LARGEST_ENTRY)}",
            instead="mend it",
        )
    return array


def masks(
    name: str, values: np.ndarray, masked: np.ndarray, attributes: Mapping
) -> None:
    """Raise Refusal where values (..., N_1, ...) are nan elsewhere than at ``masked`` shapes (N_1, ...), or not at all
    of them. The file must have singular shapes among its ``attributes``."""
    if masked.any() and "singular_shapes" not in attributes:
        numbers(name, values)
    if not np.isnan(values[..., masked]).all():
        raise Refusal(
            f"has {name} at singular shapes, where A is nan", instead="write it anew"
        )
    numbers(name, np.where(masked, 0.0, values))


def checked_error(
    name: str, error: np.ndarray, A: np.ndarray, attributes: Mapping
) -> np.ndarray:
    """Return half widths of intervals of A, both (3, d, N_1, ...) and nan at the same shapes; Refusal otherwise."""
    if error.shape != A.shape:
        raise Refusal(f"has {name} of shape {error.shape} where A has {A.shape}")
    masks(name, error, np.isnan(A).any((0, 1)), attributes)
    if (error < 0).any():
        raise Refusal(f"has {name} below 0 where it is half of an interval of A")
    return error.astype(float)


def body_text(body: Any) -> str:
    """Return a chain of links, and the frame in which A is, as the text that files have; "" for another body."""
    body = (
        {key: getattr(body, key) for key in BODY}
        if getattr(body, "kind", "") == "chain"
        else body
    )
    return (
        json.dumps({k: x for k, x in body.items() if x is not None})
        if isinstance(body, Mapping)
        else ""
    )


def checked_body(text: Any) -> dict | None:
    """Return the chain of `body_text` as arguments of `rft.Chain`; None where it makes no sense."""
    try:
        body = json.loads(text)
    except (ValueError, TypeError, RecursionError):
        return None
    return (
        body
        if isinstance(body, dict) and {"lengths", "frame"} <= {*body} <= {*BODY}
        else None
    )


def checked_level(attributes: Mapping) -> float | None:
    """Return the share of cases that intervals cover, from a file's attributes; None where it makes no sense."""
    level = attributes.get("level")
    good = (
        np.ndim(level) == 0 and np.asarray(level).dtype.kind in "iuf" and 0 < level < 1
    )
    return float(level) if good else None


def _first(bad: np.ndarray) -> str:
    return "index (" + ", ".join(map(str, np.argwhere(bad)[0])) + ")"


def rms(A: np.ndarray, residual: np.ndarray | None = None) -> np.ndarray:
    """Return the rms (3, N_1, ...) of xi over uniform directions of alphadot, from A (3, d, N_1, ...) and its fit
    residual."""
    return np.sqrt((A**2).mean(1) + (0.0 if residual is None else residual**2))


def detected_sign(connection: Connection) -> str:
    """Return "+" if xi = + A alphadot, "-" if xi = - A alphadot, for a body of two joints with more drag across than
    along.

    With alpha_k the heading of link k+1 minus that of link k, a counter-clockwise circle then carries it backwards, as
    its CCF_x is negative about the straight shape, in every frame of the body (Hatton et al., PRL 110, 078101 (2013)).
    ValueError where both signs, or neither, would have it so."""
    half = min(float(a[-1] - a[0]) / 2 for a in connection.axes)
    centre = np.array([a[0] + a[-1] for a in connection.axes]) / 2
    t, radius = (
        2 * np.pi * np.arange(64) / 64,
        np.array([0.3, 0.5])[:, None, None] * half,
    )
    alpha = centre + radius * np.stack([np.cos(t), np.sin(t)], -1)
    alphadot = radius * np.stack([-np.sin(t), np.cos(t)], -1)
    xi = connection.velocity(alpha, alphadot)
    least = ROUNDING * np.abs(xi).max(initial=0.0)
    for sign, value in (("+", 1.0), ("-", -1.0)):
        if (displacement(value * xi)[:, 0] < -least).all() and (
            displacement(-value * xi)[:, 0] > least
        ).all():
            return sign
    raise Refusal(
        "does not tell the sign of A",
        instead="say sign = '+' for xi = + A alphadot, '-' for xi = - A alphadot",
    )
