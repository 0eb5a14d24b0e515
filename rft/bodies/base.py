"""What a body is: straight elements, and how they move when the shape changes and the frame is held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple, Protocol

import numpy as np

from rft.checks import Number, require, shown
from rft.laws.base import remembered

Length = Annotated[
    float, Number(1e-15, 1e15, "m", "length of the body, in the unit wanted for displacement; 1 for body lengths")
]


class Elements(NamedTuple):
    """Straight elements of a body in its frame, arrays (n, B) for n elements and B samples, lengths in body lengths.

    c, s: cosine and sine of the heading. r_t, r_n: velocity of the centre along and across the element at a unit
    turning rate of the frame. half: (n, 1), half length, 0 for a point. weight: (n, 1), factor of the drag per length,
    which is the length of a piece of body. v_t, v_n, v_w: velocity with the frame held, along and across at the centre,
    and turning rate times half length."""

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
    def of(cls, along, place, velocity, turn, half) -> Elements:
        """Return the elements with complex headings, places and velocities (n, B), turning rates (n, B) and half
        lengths (n, 1)."""
        back = along.conj()
        own, lever = velocity * back, place * back
        c, s = along.real.copy(), along.imag.copy()
        return cls(
            c, s, -lever.imag, lever.real.copy(), half, 2.0 * half, own.real.copy(), own.imag.copy(), turn * half
        )

    @property
    def v(self) -> np.ndarray:
        """Velocities with the frame held, (3, n, B)."""
        return np.stack([self.v_t, self.v_n, self.v_w])

    @property
    def place(self) -> np.ndarray:
        """Complex places of the centres in the frame, (n, B); the lever (r_t, r_n) is i place conj(heading)."""
        return (self.r_t + 1j * self.r_n) * (self.c + 1j * self.s) / 1j

    def fixed(self, owner: list[int], ahead: np.ndarray, weight: np.ndarray) -> Elements:
        """Return points fixed to some of the elements, ``ahead`` of their centres, (k, 1); weight: (k, 1)."""
        c, s, r_t, r_n, half, _, v_t, v_n, v_w = (x[owner] for x in self)
        return Elements(c, s, r_t, r_n + ahead, 0.0 * ahead, weight, v_t, v_n + v_w * ahead / half, 0.0 * v_w)


class Body(Protocol):
    """Any body whose shape is ``joints`` numbers and which is made of straight elements. One that is to be drawn gives
    ``points`` besides, and ``shape_labels`` where its shape variables are no joint angles: see `rft.Chain`."""

    @property
    def length(self) -> float: ...

    @property
    def joints(self) -> int: ...

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements: ...


def checked_body(body) -> Body:
    """body, or ValueError if it is nothing of the kind."""
    good = all(hasattr(body, name) for name in ("joints", "length", "motion")) and not isinstance(body, type)
    require(good, f"body must be a body such as Chain((1, 1, 1)), got {shown(body)}")
    return body


@remembered
def is_reversible(body: Body) -> bool:
    """Whether a body with its head taken for its tail is the same one, its frame too: tried at a few shapes. Then the
    frame is turned by pi, and the joints of -alpha backwards are those of alpha."""
    rng = np.random.default_rng(0)
    alpha, rates = rng.uniform(-1.5, 1.5, (2, body.joints, 5))
    one, other = body.motion(alpha, rates), body.motion(-alpha[::-1], -rates[::-1])
    turned = one._replace(r_t=-one.r_t, r_n=-one.r_n, v_t=-one.v_t, v_n=-one.v_n)
    return all(bool((np.abs(x[::-1] - y) <= 1e-12).all()) for x, y in zip(turned, other))


def numbered(joints: int, name: str = "alpha_{}", unit: str = "rad") -> tuple[tuple[str, str], ...]:
    """(name, unit) of each of so many shape variables, numbered from 1."""
    return tuple((name.format(k + 1), unit) for k in range(joints))


@dataclass(frozen=True, eq=False)
class Wrapped:
    """Base of bodies that are another body with changed elements."""

    inner: Body

    @property
    def length(self) -> float:
        return self.inner.length

    @property
    def joints(self) -> int:
        return self.inner.joints

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        return _joint_angles(self.inner, shape)


def _joint_angles(body: Body, shape: np.ndarray) -> np.ndarray:
    """Angles of the joints where the shape variables are modes of them; else the shape variables."""
    return body.joint_angles(shape) if hasattr(body, "joint_angles") else shape


def pace(body: Body, alphadot: np.ndarray) -> np.ndarray:
    """(B,): the size of rates (joints, B), by which velocities are scaled; of the joints' own where a body has
    modes."""
    rates = _joint_angles(body, alphadot)
    return np.sqrt((rates * rates).sum(0))


def halves(body: Body) -> np.ndarray:
    """(n,): half lengths of a body's elements in body lengths."""
    zero = np.zeros((body.joints, 1))
    return body.motion(zero, zero).half[:, 0]
