"""A chain of straight links joined by hinges: the three-link swimmer and its longer relatives (paper Fig. 11)."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Annotated

import numpy as np

from rft.bodies.base import Elements, Length, numbered
from rft.bodies.modes import checked, rows
from rft.checks import Number, check_numbers, real_array, require, shown
from rft.se2 import rotated


@dataclass(frozen=True)
class Chain:
    """n straight links, tail to head; alpha_k is the heading of link k+1 minus that of link k, counter-clockwise.

    lengths (-): relative link lengths, all > 0, at least two. frame (-): "mean", centre of mass of a uniform body and
    length-weighted mean heading (the paper's), or "link-1", "link-2" ..., centre and heading of that link.

    modes (-): rows of joint angles; then the shape variables are the modes' amplitudes m_1, m_2 ... in place of the
    joint angles, alpha_k = sum over j of m_j modes[j][k]. "serpenoid": the cosine and the sine of ``waves`` waves on
    the body (`rft.bodies.modes`), of which a circle is a travelling wave. Speeds, and with them the regularisation,
    stay those of the joints."""

    lengths: tuple[float, ...] = (1.0, 1.0, 1.0)
    length: Length = 1.0
    frame: str = "mean"
    modes: tuple[tuple[float, ...], ...] | str | None = None
    waves: Annotated[float | None, Number(1e-6, 1e6, "-", "waves on the body, of serpenoid modes, 1 if left out")] = (
        None
    )

    def __post_init__(self):
        lengths = real_array("lengths", self.lengths)
        require(lengths.ndim == 1, f"lengths must be a list of numbers, got {shown(self.lengths)}")
        object.__setattr__(self, "lengths", tuple(lengths.tolist()))
        require(len(self.lengths) >= 2, f"lengths needs at least two links, got {len(self.lengths)}")
        good = all(0 < x < math.inf for x in self.lengths) and sum(self.lengths) < 1e100
        require(good, f"lengths must all be finite and > 0, got {shown(list(self.lengths))}")
        short = min(self.lengths) / sum(self.lengths)
        require(short >= 1e-12, f"the shortest link must be at least 1e-12 of the body, got {short:.3g}")
        object.__setattr__(self, "modes", checked(self.modes, self.waves, len(self.lengths)))
        check_numbers(self)
        self._link_of(self.frame)

    def __getstate__(self) -> dict:
        """What a copy or a worker is sent: the fields, without what is worked out from them."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def joints(self) -> int:
        """Shape variables: joints between links, or modes of them."""
        return len(self.lengths) - 1 if self.modes is None else len(self._rows)

    @cached_property
    def _rows(self) -> np.ndarray:
        return rows(self.modes, self.waves, len(self.lengths))

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        """Joint angles (n - 1, B) of shapes (joints, B), or of rates alike."""
        return shape if self.modes is None else self._rows.T @ shape

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of each shape variable, for the axes of pictures."""
        return numbered(self.joints, "alpha_{}" if self.modes is None else "m_{}")

    @cached_property
    def fractions(self) -> np.ndarray:
        """Link lengths over the body's, shape (n,)."""
        lengths = np.asarray(self.lengths)
        return lengths / lengths.sum()

    @cached_property
    def _halves(self) -> np.ndarray:
        """Half lengths of the links, (n, 1), never written to."""
        return (self.fractions / 2)[:, None]

    def _link_of(self, frame: str) -> int | None:
        """Index of the link that carries a frame, None for "mean"; ValueError for no frame of this body."""
        text = frame if isinstance(frame, str) else ""
        if text == "mean":
            return None
        found = re.fullmatch(r"link-([1-9]\d{0,6})", text)
        n = len(self.lengths)
        require(
            bool(found) and int(found[1]) <= n,
            f"frame must be 'mean' or 'link-1' ... 'link-{n}', got {shown(frame)}",
        )
        return int(found[1]) - 1

    @cached_property
    def _link(self) -> int | None:
        return self._link_of(self.frame)

    def _of_link(self, x: np.ndarray, link: int | None) -> np.ndarray:
        """A frame's own value from per-link values (n, ...): its link's, or the length-weighted mean."""
        return x[link] if link is not None else self.fractions @ x

    def _in_frame(self, steps: np.ndarray, link: int | None) -> np.ndarray:
        """Values of all links, (n, B), from what each has more than the one before, less the frame's own."""
        x = np.zeros((len(self.lengths), steps.shape[1]), steps.dtype)
        np.cumsum(steps, 0, out=x[1:])
        x -= self._of_link(x, link)
        return x

    def _links(self, alpha, alphadot):
        """Of the links in the body frame: complex headings (n, B), the headings' rates, and complex places and
        velocities of the centres; and heading angles."""
        size, link = alpha.shape[1], self._link
        both = self._in_frame(np.concatenate([self.joint_angles(alpha), self.joint_angles(alphadot)], 1), link)
        heading, turn = both[:, :size], both[:, size:]
        along = np.empty(heading.shape, complex)  # complex numbers carry the plane here
        np.cos(heading, out=along.real)
        np.sin(heading, out=along.imag)
        halves = np.empty((len(heading), 2 * size), complex)  # half links, and how they turn
        np.multiply(self._halves, along, out=halves[:, :size])
        np.multiply(1j * turn, halves[:, :size], out=halves[:, size:])
        centres = self._in_frame(halves[:-1] + halves[1:], link)
        return along, turn, centres[:, :size], centres[:, size:], heading

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        """Links in the body frame while that is held still. alpha (rad), alphadot (rad per unit time): (joints, B)."""
        along, turn, place, velocity, _ = self._links(alpha, alphadot)
        return Elements.of(along, place, velocity, turn, self._halves)

    def frame_pose(self, frame: str, alpha, alphadot) -> tuple[np.ndarray, np.ndarray]:
        """Pose h of another frame of this body in the body's own, and dh/dt: each (..., 3), in length units and rad.

        alpha, alphadot: (..., joints). With `geomech.geometry.coordinates` this changes velocities and connections of frame.
        """
        alpha, alphadot = np.broadcast_arrays(np.asarray(alpha, float), np.asarray(alphadot, float))
        _, *links = self._links(*(x.reshape(-1, self.joints).T for x in (alpha, alphadot)))
        link = self._link_of(frame)
        turn, place, velocity, heading = (self._of_link(x, link).reshape(alpha.shape[:-1]) for x in links)
        place, velocity = self.length * place, self.length * velocity
        h, hdot = (place.real, place.imag, heading), (velocity.real, velocity.imag, turn)
        return np.stack(h, -1), np.stack(hdot, -1)

    def points(self, alpha, pose=(0.0, 0.0, 0.0)) -> np.ndarray:
        """Ends of the links in the world, tail to head, (..., links + 1, 2), in length units.

        alpha: (..., joints), rad. pose: (..., 3), of the body's own frame in the world, (x, y) in length units, theta
        in rad."""
        alpha, pose = np.asarray(alpha, float), np.asarray(pose, float)
        require(alpha.shape[-1:] == (self.joints,), f"alpha must have {self.joints} angles last, got {alpha.shape}")
        require(pose.shape[-1:] == (3,), f"pose must be (x, y, theta), got {pose.shape}")
        flat = alpha.reshape(-1, self.joints).T
        along, _, place, *_ = self._links(flat, np.zeros_like(flat))
        half = (self.fractions / 2)[:, None] * along
        ends = self.length * np.concatenate([place - half, (place + half)[-1:]]).T.reshape(*alpha.shape[:-1], -1)
        x, y, theta = np.moveaxis(pose[..., None], -2, 0)
        across, up = rotated(theta, ends.real, ends.imag)
        return np.stack([x + across, y + up], -1)
