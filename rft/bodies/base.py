"""What a body is: straight elements, and how they move when the shape changes and the frame is held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from rft.media.base import remembered, require, shown


class Kinematics(NamedTuple):
    """Kinematics of n straight elements for B samples, in the body frame and in body lengths; arrays (n, B) if not said.

    c, s: cosine and sine of each element's heading. r_t, r_n: components along and across the element of the velocity
    that a unit turning rate of the frame gives its centre. half: (n, 1), half lengths, 0 for a point such as an end cap.
    weight: (n, 1), the factor of an element's drag per unit length, its length for a piece of body. v: (3, n, B), the
    velocities (v_t, v_n, spin) of `rft.loads` that the change of shape alone gives the element, the frame being held.
    """

    c: np.ndarray
    s: np.ndarray
    r_t: np.ndarray
    r_n: np.ndarray
    half: np.ndarray
    weight: np.ndarray
    v: np.ndarray

    @classmethod
    def of(cls, along, place, velocity, turn, half) -> Kinematics:
        """From complex headings, places and velocities (n, B), turning rates (n, B) and half lengths (n, 1)."""
        back = along.conj()
        own, lever = velocity * back, place * back
        v = np.array([own.real, own.imag, turn * half])
        return cls(along.real.copy(), along.imag.copy(), -lever.imag, lever.real.copy(), half, 2.0 * half, v)

    @property
    def place(self) -> np.ndarray:
        """(n, B), complex: the elements' centres; the lever (r_t, r_n) is i place conj(heading)."""
        return (self.r_t + 1j * self.r_n) * (self.c + 1j * self.s) / 1j

    @property
    def centre(self) -> np.ndarray:
        """(2, B): the mean place of the body's length."""
        part = self.half / self.half.sum()
        x, y = self.r_t * self.s + self.r_n * self.c, self.r_n * self.s - self.r_t * self.c
        return np.array([(part * x).sum(0), (part * y).sum(0)])

    def points(self, elements: list[int], ahead: np.ndarray, weight: np.ndarray) -> Kinematics:
        """Of points (k,) that are fixed to some of the elements, so far ahead of their centres, (k, 1) each."""
        at = np.array(elements)
        v_t, v_n, spin = self.v[:, at]
        v = np.stack([v_t, v_n + spin * ahead / self.half[at], np.zeros_like(v_t)])
        return Kinematics(self.c[at], self.s[at], self.r_t[at], self.r_n[at] + ahead, np.zeros_like(ahead), weight, v)

    @staticmethod
    def stacked(motions: list[Kinematics]) -> Kinematics:
        """The elements of several motions of the same samples, one after the other."""
        if len(motions) == 1:
            return motions[0]
        *parts, v = zip(*motions)
        return Kinematics(*(np.concatenate(x) for x in parts), np.concatenate(v, 1))

    def wrenches(self, force: np.ndarray) -> np.ndarray:
        """(3, n, B): force and moment on the frame of each element, from its averages; `wrench` is their sum."""
        f_t, f_n, f_s = self.weight * force
        c, s = self.c, self.s
        return np.stack([c * f_t - s * f_n, s * f_t + c * f_n, self.r_t * f_t + self.r_n * f_n + self.half * f_s])

    def take(self, keep: np.ndarray) -> Kinematics:
        """The samples that ``keep`` (an index or mask over B) selects."""
        c, s, r_t, r_n, half, weight, v = self
        return Kinematics(c[:, keep], s[:, keep], r_t[:, keep], r_n[:, keep], half, weight, v[:, :, keep])

    @staticmethod
    def join(motions: list[Kinematics]) -> Kinematics:
        """The samples of several motions of one body, side by side."""
        c, s, r_t, r_n, halves, weights, v = zip(*motions)
        fixed = halves[0], weights[0]
        return Kinematics(*(np.concatenate(x, -1) for x in (c, s, r_t, r_n)), *fixed, np.concatenate(v, -1))

    def carried(self, xi: np.ndarray) -> np.ndarray:
        """(3, n, B): what the body velocity xi (3, B) adds to every element's (v_t, v_n, spin)."""
        x, y, turn = xi
        out = np.empty_like(self.v)
        np.add(self.c * x + self.s * y, self.r_t * turn, out=out[0])
        np.add(self.c * y - self.s * x, self.r_n * turn, out=out[1])
        np.multiply(self.half, turn, out=out[2])
        return out

    def wrench(self, force: np.ndarray) -> np.ndarray:
        """(3, ..., B): force and moment on the frame from element averages (3, ..., n, B); the transpose of `carried`."""
        f_t, f_n, f_s = force
        weight = self.weight
        c, s = weight * self.c, weight * self.s
        parts = np.empty_like(force)
        np.subtract(c * f_t, s * f_n, out=parts[0])
        np.add(s * f_t, c * f_n, out=parts[1])
        np.add(weight * self.r_t * f_t + weight * self.r_n * f_n, weight * self.half * f_s, out=parts[2])
        return parts.sum(-2)

    def assembled(self, load: np.ndarray) -> np.ndarray:
        """(3, 4, B) from element loads (3, 4, n, B) as `rft.loads` gives them: net force and moment in column 0, their
        derivative with respect to xi, sum of J^T H J with J the matrix of `carried`, in columns 1 to 3."""
        to_t, to_n, to_w = load[:, 1], load[:, 2], load[:, 3]
        columns = np.empty_like(load)
        columns[:, 0] = load[:, 0]
        np.subtract(self.c * to_t, self.s * to_n, out=columns[:, 1])
        np.add(self.s * to_t, self.c * to_n, out=columns[:, 2])
        np.add(self.r_t * to_t + self.r_n * to_n, self.half * to_w, out=columns[:, 3])
        return self.wrench(columns)


class Body(Protocol):
    """Any body whose shape is ``joints`` numbers and which is made of straight elements. One that is to be drawn gives
    ``points`` besides, and ``shape_labels`` where its shape variables are no joint angles: see `rft.Chain`."""

    @property
    def length(self) -> float: ...

    @property
    def joints(self) -> int: ...

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Kinematics: ...


def checked_body(body) -> Body:
    """body, or ValueError if it is nothing of the kind."""
    good = all(hasattr(body, name) for name in ("joints", "length", "motion")) and not isinstance(body, type)
    require(good, f"body must be a body such as Chain((1, 1, 1)), got {shown(body)}")
    return body


@remembered
def is_reversible(body: Body) -> bool:
    """Whether a body with its head taken for its tail is the same one, its frame too: tried at a few shapes. Then the frame
    is turned by pi, and the joints of -alpha backwards are those of alpha."""
    rng = np.random.default_rng(0)
    alpha, rates = rng.uniform(-1.5, 1.5, (2, body.joints, 5))
    one, other = body.motion(alpha, rates), body.motion(-alpha[::-1], -rates[::-1])
    turned = Kinematics(one.c, one.s, -one.r_t, -one.r_n, one.half, one.weight, one.v * [[[-1.0]], [[-1.0]], [[1.0]]])
    pairs = zip([*turned[:6], *turned.v], [*other[:6], *other.v])
    return all(bool((np.abs(x[::-1] - y) <= 1e-12).all()) for x, y in pairs)


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
    """(B,): the size of rates (joints, B), by which velocities are scaled; of the joints' own where a body has modes."""
    rates = _joint_angles(body, alphadot)
    return np.sqrt((rates * rates).sum(0))


def halves(body: Body) -> np.ndarray:
    """(n,): half lengths of a body's elements in body lengths."""
    zero = np.zeros((body.joints, 1))
    return body.motion(zero, zero).half[:, 0]
