"""The base of bodies: straight elements, and their motion when the shape changes and
the frame is held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np

from rft.core.checks import Number
from rft.core.refusal import require
from rft.core.registry import Registry, classes_with
from rft.laws.base import cached_if_immutable

BODIES = Registry("geomech.bodies", "kind", "a body", classes_with("motion"))

Length = Annotated[
    float | None,
    Number(
        1e-15,
        1e15,
        "m",
        "length of the body; if it is left out, lengths are in body lengths",
    ),
]


class Elements(NamedTuple):
    """Straight elements of a body in its frame, arrays (n, B) for n elements and B
    samples, lengths in body lengths.

    c, s: cosine and sine of the heading. r_t, r_n: velocity of the centre along and
    across the element at a unit rotation rate of the frame. half: (n, 1), half length,
    0 for a point. weight: (n, 1), factor of the drag per length, which is the length of
    a piece of body. v_t, v_n, v_w: velocity with the frame held, along and across at
    the centre, and rotation rate times half length.

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Chain
    >>> elements = Chain().motion(np.zeros((2, 1)), np.ones((2, 1)))
    >>> elements.half[:, 0].round(4), elements.v_w.shape
    (array([0.1667, 0.1667, 0.1667]), (3, 1))
    """

    c: np.ndarray
    s: np.ndarray
    r_t: np.ndarray
    r_n: np.ndarray
    half: np.ndarray
    weight: np.ndarray
    v_t: np.ndarray
    v_n: np.ndarray
    v_w: np.ndarray

    @classmethod
    def from_complex(
        cls, heading: Any, centre: Any, velocity: Any, rotation: Any, half: Any
    ) -> Elements:
        """Return elements from complex numbers (n, B): exp(i theta) of their headings,
        their centres x + i y and the velocities of the centres. rotation: (n, B), rates
        of theta. half: (n, 1), half lengths."""
        back = heading.conj()
        v = velocity * back
        lever = centre * back
        c = heading.real.copy()
        s = heading.imag.copy()
        return cls(
            c,
            s,
            -lever.imag,
            lever.real.copy(),
            half,
            2.0 * half,
            v.real.copy(),
            v.imag.copy(),
            rotation * half,
        )

    @property
    def v(self) -> np.ndarray:
        """Velocities (v_t, v_n, v_w) with the frame held, (3, n, B)."""
        return np.stack([self.v_t, self.v_n, self.v_w])

    @property
    def centres(self) -> np.ndarray:
        """Centres in the frame, complex (n, B): r_t + i r_n = i centre
        conj(heading)."""
        return (self.r_t + 1j * self.r_n) * (self.c + 1j * self.s) / 1j

    def attached_points(
        self, owner: list[int], ahead: np.ndarray, weight: np.ndarray
    ) -> Elements:
        """Return k points attached to the elements ``owner``, each a distance ``ahead``
        (k, 1) before the centre; weight: (k, 1), factors of their drag."""
        indices = np.array(owner)
        c, s, r_t, r_n, half, _, v_t, v_n, v_w = (x[indices] for x in self)
        return Elements(
            c,
            s,
            r_t,
            r_n + ahead,
            0.0 * ahead,
            weight,
            v_t,
            v_n + v_w * ahead / half,
            0.0 * v_w,
        )


class Body(Protocol):
    """A body of straight elements whose shape is ``joints`` numbers.

    joints: number of shape variables. length: of the body, m, None where lengths are in
    body lengths. motion(alpha, alphadot): its `Elements` at shapes and rates
    (joints, B), with the frame held. A body that is drawn also has ``points``, and
    ``shape_labels`` if its shape variables are no joint angles: see `rft.Chain`.

    Examples
    --------
    >>> from rft import Chain
    >>> import numpy as np
    >>> chain = Chain()
    >>> elements = chain.motion(np.zeros((2, 1)), np.ones((2, 1)))
    >>> chain.joints, elements.c.shape
    (2, (3, 1))
    """

    @property
    def length(self) -> float | None: ...

    @property
    def joints(self) -> int: ...

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements: ...


def body_size(body: Any) -> float:
    """Return the length of a body or a system in the unit of displacements: m, or 1
    body length where it has no ``length``.

    Examples
    --------
    >>> from rft import Chain
    >>> from rft.bodies.base import body_size
    >>> body_size(Chain()), body_size(Chain(length=0.3))
    (1.0, 0.3)
    """
    return 1.0 if body.length is None else body.length


def checked_body(body) -> Body:
    """Return the body; ValueError unless it has the members of `Body`."""
    has_members = all(hasattr(body, name) for name in ("joints", "length", "motion"))
    require(
        has_members and not isinstance(body, type),
        "body must be a body such as Chain((1, 1, 1))",
        value=body,
    )
    return body


@cached_if_immutable
def is_reversible(body: Body) -> bool:
    """Return whether exchanging head and tail leaves the body and its frame as they
    are, from a few random shapes.

    The exchange rotates the frame by pi and maps the joints alpha_1 ... alpha_d to
    -alpha_d ... -alpha_1."""
    rng = np.random.default_rng(0)
    alpha, rates = rng.uniform(-1.5, 1.5, (2, body.joints, 5))
    elements = body.motion(alpha, rates)
    exchanged = body.motion(-alpha[::-1], -rates[::-1])
    rotated = elements._replace(
        r_t=-elements.r_t, r_n=-elements.r_n, v_t=-elements.v_t, v_n=-elements.v_n
    )
    return all(
        bool((np.abs(x[::-1] - y) <= 1e-12).all()) for x, y in zip(rotated, exchanged)
    )


@cached_if_immutable
def is_symmetric(body: Body) -> bool:
    """Return whether a body of shape -alpha is its mirror image of shape alpha, left
    and right exchanged, from a few random shapes; a custom body may be bent where its
    shape is zero."""
    rng = np.random.default_rng(0)
    alpha, rates = rng.uniform(-1.5, 1.5, (2, body.joints, 5))
    elements = body.motion(alpha, rates)
    other = body.motion(-alpha, -rates)
    image = other._replace(s=-other.s, r_t=-other.r_t, v_n=-other.v_n, v_w=-other.v_w)
    return all(bool((np.abs(x - y) <= 1e-10).all()) for x, y in zip(elements, image))


def numbered_labels(
    joints: int, name: str = "alpha_{}", unit: str = "rad"
) -> tuple[tuple[str, str], ...]:
    """Return (name, unit) of each shape variable, numbered from 1."""
    return tuple((name.format(k + 1), unit) for k in range(joints))


@dataclass(frozen=True, eq=False)
class WrappedBody:
    """Base of bodies that change the elements of an ``inner`` body."""

    inner: Body

    @property
    def length(self) -> float | None:
        return self.inner.length

    @property
    def joints(self) -> int:
        return self.inner.joints

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        return joint_angles(self.inner, shape)


def innermost(body: Any) -> Any:
    """Return the body inside those that wrap it, before its elements were cut into
    pieces."""
    while hasattr(body, "inner"):
        body = body.inner
    return body


def joint_angles(body: Body, shape: np.ndarray) -> np.ndarray:
    """Return the joint angles of a shape whose variables are modes; else the shape
    variables themselves."""
    if hasattr(body, "joint_angles"):
        return body.joint_angles(shape)
    return shape


def joint_speed(body: Body, alphadot: np.ndarray) -> np.ndarray:
    """Return the size (B,) of the joint rates at rates (joints, B) of the shape
    variables, by which velocities are scaled."""
    rates = joint_angles(body, alphadot)
    return np.sqrt(np.add.reduce(rates * rates))


def half_lengths(body: Body) -> np.ndarray:
    """Return the half lengths (n,) of a body's elements, in body lengths."""
    zero = np.zeros((body.joints, 1))
    return body.motion(zero, zero).half[:, 0]
