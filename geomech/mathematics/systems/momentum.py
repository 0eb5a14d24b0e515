"""Chains of links whose momentum is zero and stays zero: inertia moves them, without an
outer force.

Link i has inertia along itself, across itself and about its centre, G_i = diag(m_t,
m_n, I). With its velocity v_i = J_i xi + B_i alphadot the kinetic energy is T = 1/2 sum
v_i^T G_i v_i; momentum, its derivative with respect to xi, is zero if

    xi = A alphadot,    A = -(sum J_i^T G_i J_i)^-1 sum J_i^T G_i B_i,

the mechanical connection (J. E. Marsden, R. Montgomery and T. S. Ratiu, Memoirs of the
AMS 436 (1990)). Then T = 1/2 alphadot^T M(alpha) alphadot, with the kinetic-energy
metric M of shape space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems.base import integrated
from rft.bodies import Chain
from rft.bodies.base import Elements, Length, body_size
from rft.core.checks import check_numbers, real_array, unmasked
from rft.core.refusal import Refusal
from rft.formulas.newton import to_element


@dataclass(frozen=True)
class Linkage(Chain):
    """A chain whose frame "mean" is the centre of mass and the mean heading by mass."""

    masses: tuple[float, ...] = ()

    def _frame_value(self, x: np.ndarray, link: int | None) -> np.ndarray:
        if link is not None:
            return x[link]
        masses = np.asarray(self.masses)
        return masses @ x / masses.sum()


@dataclass(frozen=True)
class Momentum:
    """Base of chains without momentum.

    lengths (-): relative link lengths, tail to head, all > 0, at least two. frame (-):
    "mean", centre of mass and mass-weighted mean heading, or "link-1", "link-2" ...,
    those of that link."""

    lengths: tuple[float, ...] = (1.0, 1.0, 1.0)
    length: Length = None
    frame: str = "mean"

    run = integrated

    def __post_init__(self):
        check_numbers(self)
        chain = Chain(self.lengths, self.length, self.frame)
        object.__setattr__(self, "lengths", chain.lengths)

    def check_per_link(self, name: str, least: float, most: float) -> None:
        """Refuse a field of this name that is neither empty nor a number from least to
        most for each link."""
        links = len(self.lengths)
        x = real_array(name, getattr(self, name))
        in_bounds = (least <= x) & (x <= most)
        if x.shape not in ((0,), (links,)) or not in_bounds.all():
            raise Refusal(
                f"{name} must be {links} numbers from {least:g} to {most:g}, one for"
                " each link, or left out",
                value=x.tolist(),
            )
        object.__setattr__(self, name, tuple(x.tolist()))

    def inertia(self, number: int = float) -> tuple[list[Any], list[list[Any]]]:
        """Return masses of the links, and [along, across, about the centre] of each:
        its inertia with the fluid's, in any single unit and body lengths.

        number: `float`, or `geomech.mathematics.symbolic.connections.exact` for
        formulas."""
        raise NotImplementedError

    @property
    def traits(self) -> Traits:
        return Traits(linear=True, mirror=True, joint_angles=True, frame=self.frame)

    @property
    def joints(self) -> int:
        return len(self.lengths) - 1

    @property
    def _chain(self) -> Linkage:
        masses, _ = self.inertia()
        return Linkage(self.lengths, self.length, self.frame, masses=tuple(masses))

    def points(self, alpha: ArrayLike, pose: ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the ends of the links in the world, as `rft.Chain.points`."""
        return self._chain.points(alpha, pose)

    def frame_pose(
        self, frame: str, alpha: ArrayLike, alphadot: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose of a frame and its rate, as `rft.Chain.frame_pose`."""
        return self._chain.frame_pose(frame, alpha, alphadot)

    def _weights(self, motion: Elements) -> np.ndarray:
        """Return G (3, n, 1) for velocities (v_t, v_n, v_w); v_w is the rotation rate
        times half the length."""
        along, across, about = np.array(self.inertia()[1]).T
        return np.stack([along, across, about / motion.half[:, 0] ** 2])[..., None]

    def _moving(self, alpha, alphadot) -> tuple[Elements, np.ndarray, np.ndarray]:
        """Return the links, G, and xi (3, B) in body lengths, for shapes (B,
        joints)."""
        motion = self._chain.motion(alpha.T, alphadot.T)
        weights = self._weights(motion)
        zero = np.zeros_like(motion.c)
        half = motion.half * np.ones_like(motion.c)
        J = np.array(  # (v, xi, n, B)
            [
                [motion.c, motion.s, motion.r_t],
                [-motion.s, motion.c, motion.r_n],
                [zero, zero, half],
            ]
        )
        weighted = weights[:, None] * J
        locked = np.einsum("vinb,vjnb->bij", weighted, J)
        momentum = np.einsum("vinb,vnb->bi", weighted, motion.v)
        xi = -np.linalg.solve(locked, momentum[..., None])[..., 0].T
        return motion, weights, xi

    def _flat(self, alpha, alphadot) -> tuple[np.ndarray, np.ndarray, tuple[int, ...]]:
        """Return shapes and rates (B, joints), and their leading axes."""
        alpha = unmasked("alpha", alpha)
        alphadot = unmasked("alphadot", alphadot)
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        lead = alpha.shape[:-1]
        return alpha.reshape(-1, self.joints), alphadot.reshape(-1, self.joints), lead

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return xi (..., 3) in the frame, (length/time, length/time, rad/time)."""
        alpha, alphadot, shape = self._flat(alpha, alphadot)
        xi = self._moving(alpha, alphadot)[2].T.reshape(*shape, 3)
        return xi * [body_size(self), body_size(self), 1.0]

    def squared_speed(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return alphadot^T M alphadot (...,): twice the kinetic energy, in the unit of
        `inertia` and body lengths."""
        alpha, alphadot, shape = self._flat(alpha, alphadot)
        motion, weights, xi = self._moving(alpha, alphadot)
        carried = np.stack(np.broadcast_arrays(*to_element(motion, *xi)))
        velocity = motion.v + carried
        return (weights * velocity**2).sum((0, 1)).reshape(shape)

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        """Return A (3, joints) as a sympy Matrix, and its angles
        (`geomech.mathematics.symbolic`)."""
        from geomech.mathematics.symbolic import connections

        masses, inertia = self.inertia(connections.exact)
        A, alpha = connections.chain_connection(
            self.lengths, inertia, self.frame, masses
        )
        return connections.in_length(body_size(self), A), alpha
