"""A chain of straight links joined by hinges: the three-link swimmer and its longer
relatives (paper Fig. 11)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from rft.bodies.base import BODIES, Elements, Length, numbered_labels
from rft.bodies.links import Links
from rft.bodies.modes import checked_modes, mode_rows
from rft.core.checks import Number, check_numbers

SHORT = 16  # links up to which sums over them are products with a matrix


@BODIES.register
@dataclass(frozen=True)
class Chain(Links):
    """n straight links, tail to head; alpha_k is the heading of link k+1 minus that of
    link k, counter-clockwise.

    lengths (-): relative link lengths, all > 0, at least two. frame (-): "mean", centre
    of mass of a uniform body and length-weighted mean heading (the paper's), or
    "link-1", "link-2" ..., centre and heading of that link.

    modes (-): rows of joint angles. The shape variables are then the amplitudes m_1,
    m_2 ... of these modes instead of the joint angles: alpha_k = sum over j of m_j
    modes[j][k]. "serpenoid" selects the cosine and the sine of ``waves`` waves on the
    body (`rft.bodies.modes`), in whose amplitudes a circle is a travelling wave. Joint
    speeds, and with them the regularisation, are the same as without modes.

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
        Number(
            1e-6,
            1e6,
            "-",
            "number of waves of serpenoid modes on the body; 1 if left out",
        ),
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
        return len(self.mode_rows)

    @cached_property
    def mode_rows(self) -> np.ndarray:
        """The modes, (joints, n - 1): rows of joint angles."""
        return mode_rows(self.modes, self.waves, len(self.lengths))

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        """Return the joint angles (n - 1, B) of shapes (joints, B), or the joint rates
        of rates."""
        if self.modes is None:
            return shape
        return self.mode_rows.T @ shape

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of each shape variable, for the axes of pictures."""
        name = "alpha_{}" if self.modes is None else "m_{}"
        return numbered_labels(self.joints, name)

    def _in_frame(self, differences: np.ndarray) -> np.ndarray:
        """Return values of all links (k, n, B), less the frame's, from the differences
        (k, n - 1, B) between neighbours."""
        if len(self.lengths) <= SHORT:
            return self._sums @ differences
        return self._summed(differences)

    def _summed(self, differences: np.ndarray) -> np.ndarray:
        """Return the same by sums from the tail on."""
        k, _, size = differences.shape
        x = np.zeros((k, len(self.lengths), size))
        np.add.accumulate(differences, 1, out=x[:, 1:])
        if self.frame_link is None:
            return x - (self.fractions @ x)[:, None]
        return x - x[:, self.frame_link, None]

    @cached_property
    def _sums(self) -> np.ndarray:
        """The matrix (n, n - 1) of these sums."""
        return self._summed(np.eye(len(self.lengths) - 1)[None])[0]

    def _lines(
        self, alpha: np.ndarray, alphadot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return three arrays of the links in the body frame at shapes and rates
        (joints, B): headings and their rates (2, n, B); unit vectors along the links
        and the rates of these, (c, s, dc/dt, ds/dt), (4, n, B); centres and their
        velocities, (x, y, dx/dt, dy/dt), (4, n, B)."""
        n = len(self.lengths)
        joints = np.empty((2, n - 1, alpha.shape[1]))
        joints[0] = self.joint_angles(alpha)
        joints[1] = self.joint_angles(alphadot)
        headings = self._in_frame(joints)
        theta, rotation = headings
        units = np.empty((4, *theta.shape))
        c, s, c_rate, s_rate = units
        np.cos(theta, out=c)
        np.sin(theta, out=s)
        np.multiply(rotation, -s, out=c_rate)
        np.multiply(rotation, c, out=s_rate)
        halves = self._half_lengths * units
        return headings, units, self._in_frame(halves[:, :-1] + halves[:, 1:])

    def _links(self, alpha, alphadot):
        (theta, rotation), (c, s, *_), (x, y, v_x, v_y) = self._lines(alpha, alphadot)
        return c + 1j * s, rotation, x + 1j * y, v_x + 1j * v_y, theta

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        (_, rotation), (c, s, *_), centres = self._lines(alpha, alphadot)
        # Each of (x, dx/dt) and (y, dy/dt), in turn along and across the links.
        x = centres[::2]
        y = centres[1::2]
        along = x * c + y * s
        across = y * c - x * s
        half = self._half_lengths
        return Elements(
            c,
            s,
            -across[0],
            along[0],
            half,
            self._weights,
            along[1],
            across[1],
            rotation * half,
        )

    @cached_property
    def _weights(self) -> np.ndarray:
        return 2.0 * self._half_lengths

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
