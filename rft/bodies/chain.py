"""A chain of straight links joined by hinges: the three-link swimmer and its longer
relatives (paper Fig. 11)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from rft.bodies.base import BODIES, Length, numbered_labels
from rft.bodies.links import Links
from rft.bodies.modes import checked_modes, mode_rows
from rft.core.checks import Number, check_numbers


@BODIES.register
@dataclass(frozen=True)
class Chain(Links):
    """n straight links, tail to head; alpha_k is the heading of link k+1 minus that of
    link k, counter-clockwise.

    lengths (-): relative link lengths, all > 0, at least two. frame (-): "mean", centre
    of mass of a uniform body and length-weighted mean heading (the paper's), or
    "link-1", "link-2" ..., centre and heading of that link.

    modes (-): rows of joint angles; the shape variables are then the amplitudes m_1,
    m_2 ... of these modes in place of the joint angles, alpha_k = sum over j of m_j
    modes[j][k]. "serpenoid": the cosine and the sine of ``waves`` waves on the body
    (`rft.bodies.modes`), whose circle is a travelling wave. Joint speeds, and with them
    the regularisation, are the same as without modes.

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
    length: Length = None
    frame: str = "mean"
    modes: tuple[tuple[float, ...], ...] | str | None = None
    waves: Annotated[
        float | None,
        Number(1e-6, 1e6, "-", "waves on the body, of serpenoid modes, 1 if left out"),
    ] = None
    kind = "chain"

    def __post_init__(self):
        self._check_lengths()
        object.__setattr__(
            self, "modes", checked_modes(self.modes, self.waves, len(self.lengths))
        )
        check_numbers(self)
        self._frame_link(self.frame)

    @property
    def joints(self) -> int:
        """Number of shape variables: joints between links, or modes."""
        if self.modes is None:
            return len(self.lengths) - 1
        return len(self._mode_rows)

    @cached_property
    def _mode_rows(self) -> np.ndarray:
        return mode_rows(self.modes, self.waves, len(self.lengths))

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        """Return the joint angles (n - 1, B) of shapes (joints, B), or the joint rates
        of rates."""
        if self.modes is None:
            return shape
        return self._mode_rows.T @ shape

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of each shape variable, for the axes of pictures."""
        name = "alpha_{}" if self.modes is None else "m_{}"
        return numbered_labels(self.joints, name)

    def _in_frame(self, differences: np.ndarray, link: int | None) -> np.ndarray:
        """Return values of all links (n, B), less the frame's, from the differences
        (n - 1, B) between neighbours."""
        x = np.zeros((len(self.lengths), differences.shape[1]), differences.dtype)
        np.add.accumulate(differences, 0, out=x[1:])
        x -= self._frame_value(x, link)
        return x

    def _links(self, alpha, alphadot):
        size = alpha.shape[1]
        link = self._link
        # Angles and their rates are summed as one array.
        joints = [self.joint_angles(alpha), self.joint_angles(alphadot)]
        angles = self._in_frame(np.concatenate(joints, 1), link)
        theta = angles[:, :size]
        rotation = angles[:, size:]
        heading = np.empty(theta.shape, complex)
        np.cos(theta, out=heading.real)
        np.sin(theta, out=heading.imag)
        # Half links as vectors, and their velocities.
        halves = np.empty((len(theta), 2 * size), complex)
        np.multiply(self._half_lengths, heading, out=halves[:, :size])
        np.multiply(1j * rotation, halves[:, :size], out=halves[:, size:])
        centres = self._in_frame(halves[:-1] + halves[1:], link)
        return heading, rotation, centres[:, :size], centres[:, size:], theta

    @classmethod
    def examples(cls) -> dict[str, Chain]:
        return {
            "two": cls((1, 2)),
            "three": cls((1, 1, 1)),
            "three-middle": cls((1, 1, 1), frame="link-2"),
            "uneven": cls((0.7, 1.4, 0.9), frame="link-1", length=0.3),
            "five": cls((1,) * 5),
            "modes": cls(
                (0.8, 1.3, 1.0, 0.7),
                0.3,
                "link-2",
                modes=((1.4, 0.3, -0.5), (-0.2, 0.9, 2.1)),
            ),
        }
