"""A chain of straight links joined by hinges: the three-link swimmer and its longer relatives (paper Fig. 11)."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import BODIES, Elements, Length, numbered_labels
from rft.bodies.modes import checked_modes, mode_rows
from rft.checks import Number, check_numbers, real_array
from rft.refusal import require
from rft.se2 import rotated


@BODIES.register
@dataclass(frozen=True)
class Chain:
    """n straight links, tail to head; alpha_k is the heading of link k+1 minus that of link k, counter-clockwise.

    lengths (-): relative link lengths, all > 0, at least two. frame (-): "mean", centre of mass of a uniform body and
    length-weighted mean heading (the paper's), or "link-1", "link-2" ..., centre and heading of that link.

    modes (-): rows of joint angles; the shape variables are then the amplitudes m_1, m_2 ... of these modes in place of
    the joint angles, alpha_k = sum over j of m_j modes[j][k]. "serpenoid": the cosine and the sine of ``waves`` waves on
    the body (`rft.bodies.modes`), whose circle is a travelling wave. Joint speeds, and with them the regularisation,
    are the same as without modes.

    Examples
    --------
    >>> from rft import Chain
    >>> chain = Chain(lengths=(1, 2, 1))
    >>> chain.joints, chain.lengths
    (2, (1.0, 2.0, 1.0))
    >>> chain.points([0.0, 0.0]).round(3)  # the straight body, tail to head
    array([[-0.5 ,  0.  ],
           [-0.25,  0.  ],
           [ 0.25,  0.  ],
           [ 0.5 ,  0.  ]])
    """

    lengths: tuple[float, ...] = (1.0, 1.0, 1.0)
    length: Length = 1.0
    frame: str = "mean"
    modes: tuple[tuple[float, ...], ...] | str | None = None
    waves: Annotated[float | None, Number(1e-6, 1e6, "-", "waves on the body, of serpenoid modes, 1 if left out")] = (
        None
    )
    kind = "chain"

    def __post_init__(self):
        lengths = real_array("lengths", self.lengths)
        require(lengths.ndim == 1, "lengths must be a list of numbers", value=self.lengths)
        object.__setattr__(self, "lengths", tuple(lengths.tolist()))
        require(len(self.lengths) >= 2, "lengths needs at least two links", value=len(self.lengths))
        are_lengths = all(0 < x < math.inf for x in self.lengths) and sum(self.lengths) < 1e100
        require(are_lengths, "lengths must all be finite and > 0", value=list(self.lengths))
        shortest = min(self.lengths) / sum(self.lengths)
        require(shortest >= 1e-12, f"the shortest link must be at least 1e-12 of the body, got {shortest:.3g}")
        object.__setattr__(self, "modes", checked_modes(self.modes, self.waves, len(self.lengths)))
        check_numbers(self)
        self._frame_link(self.frame)

    def __getstate__(self) -> dict:
        """Return the fields alone for copies and workers, without cached properties."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def joints(self) -> int:
        """Number of shape variables: joints between links, or modes."""
        return len(self.lengths) - 1 if self.modes is None else len(self._mode_rows)

    @cached_property
    def _mode_rows(self) -> np.ndarray:
        return mode_rows(self.modes, self.waves, len(self.lengths))

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        """Return the joint angles (n - 1, B) of shapes (joints, B), or the joint rates of rates."""
        return shape if self.modes is None else self._mode_rows.T @ shape

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of each shape variable, for the axes of pictures."""
        return numbered_labels(self.joints, "alpha_{}" if self.modes is None else "m_{}")

    @cached_property
    def fractions(self) -> np.ndarray:
        """Link lengths over the length of the body, (n,)."""
        lengths = np.asarray(self.lengths)
        return lengths / lengths.sum()

    @cached_property
    def _half_lengths(self) -> np.ndarray:
        """Half lengths of the links, (n, 1)."""
        return (self.fractions / 2)[:, None]

    def _frame_link(self, frame: str) -> int | None:
        """Return the index of the link that carries a frame, None for "mean"; ValueError for no frame of this body."""
        text = frame if isinstance(frame, str) else ""
        if text == "mean":
            return None
        found, n = re.fullmatch(r"link-([1-9]\d{0,6})", text), len(self.lengths)
        number = int(found[1]) if found else 0
        require(0 < number <= n, f"frame must be 'mean' or 'link-1' ... 'link-{n}'", value=frame)
        return number - 1

    @cached_property
    def _link(self) -> int | None:
        return self._frame_link(self.frame)

    def _frame_value(self, x: np.ndarray, link: int | None) -> np.ndarray:
        """Return a frame's value from values of the links (n, ...): its link's, or the length-weighted mean."""
        return x[link] if link is not None else self.fractions @ x

    def _in_frame(self, differences: np.ndarray, link: int | None) -> np.ndarray:
        """Return values of all links (n, B), less the frame's, from the differences (n - 1, B) between neighbours."""
        x = np.zeros((len(self.lengths), differences.shape[1]), differences.dtype)
        np.add.accumulate(differences, 0, out=x[1:])
        x -= self._frame_value(x, link)
        return x

    def _links(self, alpha, alphadot):
        """Return of the links in the body frame, (n, B) each: exp(i theta), rates of theta, centres x + i y, velocities of
        the centres, and headings theta."""
        size, link = alpha.shape[1], self._link
        angles = self._in_frame(np.concatenate([self.joint_angles(alpha), self.joint_angles(alphadot)], 1), link)
        theta, rotation = angles[:, :size], angles[:, size:]
        heading = np.empty(theta.shape, complex)
        np.cos(theta, out=heading.real)
        np.sin(theta, out=heading.imag)
        halves = np.empty((len(theta), 2 * size), complex)  # half links as vectors, and their velocities
        np.multiply(self._half_lengths, heading, out=halves[:, :size])
        np.multiply(1j * rotation, halves[:, :size], out=halves[:, size:])
        centres = self._in_frame(halves[:-1] + halves[1:], link)
        return heading, rotation, centres[:, :size], centres[:, size:], theta

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        """Return the links at shapes (rad) and rates (rad per unit time), (joints, B) each, with the body frame held."""
        heading, rotation, centre, velocity, _ = self._links(alpha, alphadot)
        return Elements.from_complex(heading, centre, velocity, rotation, self._half_lengths)

    def frame_pose(self, frame: str, alpha: np.ndarray, alphadot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose h of another frame of this body in the body frame, and dh/dt: each (..., 3), in length units and
        rad.

        alpha, alphadot: (..., joints). `geomech.geometry.coordinates` uses it to change the frame of velocities and
        connections.
        """
        alpha, alphadot = np.broadcast_arrays(np.asarray(alpha, float), np.asarray(alphadot, float))
        _, *links = self._links(*(x.reshape(-1, self.joints).T for x in (alpha, alphadot)))
        link = self._frame_link(frame)
        rotation, centre, velocity, theta = (self._frame_value(x, link).reshape(alpha.shape[:-1]) for x in links)
        centre, velocity = self.length * centre, self.length * velocity
        h, hdot = (centre.real, centre.imag, theta), (velocity.real, velocity.imag, rotation)
        return np.stack(h, -1), np.stack(hdot, -1)

    def points(self, alpha: np.ndarray, pose: ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the ends of the links in the world, tail to head, (..., links + 1, 2), in length units.

        alpha: (..., joints), rad. pose: (..., 3), pose of the body frame in the world, (x, y) in length units, theta in
        rad."""
        alpha, pose = np.asarray(alpha, float), np.asarray(pose, float)
        require(alpha.shape[-1:] == (self.joints,), f"alpha must have {self.joints} angles last", value=alpha.shape)
        require(pose.shape[-1:] == (3,), "pose must be (x, y, theta)", value=pose.shape)
        flat = alpha.reshape(-1, self.joints).T
        heading, _, centre, *_ = self._links(flat, np.zeros_like(flat))
        half = self._half_lengths * heading
        ends = self.length * np.concatenate([centre - half, (centre + half)[-1:]]).T.reshape(*alpha.shape[:-1], -1)
        x, y, theta = np.moveaxis(pose[..., None], -2, 0)
        dx, dy = rotated(theta, ends.real, ends.imag)
        return np.stack([x + dx, y + dy], -1)

    @classmethod
    def examples(cls) -> dict[str, Chain]:
        return {
            "two": cls((1, 2)),
            "three": cls((1, 1, 1)),
            "three-middle": cls((1, 1, 1), frame="link-2"),
            "uneven": cls((0.7, 1.4, 0.9), frame="link-1", length=0.3),
            "five": cls((1,) * 5),
            "modes": cls((0.8, 1.3, 1.0, 0.7), 0.3, "link-2", modes=((1.4, 0.3, -0.5), (-0.2, 0.9, 2.1))),
        }
