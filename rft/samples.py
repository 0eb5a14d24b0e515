"""What the solver works on: samples of a batch, their elements, their own parameters, and how far they are."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from rft.bodies.base import Kinematics
from rft.contact import Model


class Jacobian(NamedTuple):
    """What `Kinematics` does with a frame's velocity, by one matrix. matrix: (3, 3, n, B), of the velocities (v_t, v_n, spin)
    that unit velocities of the frame add to every element's. weighed: the same times the weights of elements. v (3, n, B):
    that of the motion."""

    matrix: np.ndarray
    weighed: np.ndarray
    v: np.ndarray

    @classmethod
    def of(cls, motion: Kinematics) -> Jacobian:
        matrix = np.zeros((3, *motion.v.shape))
        matrix[0] = motion.c, motion.s, motion.r_t
        np.negative(motion.s, out=matrix[1, 0])
        matrix[1, 1:] = motion.c, motion.r_n
        matrix[2, 2] = motion.half
        return cls(matrix, motion.weight * matrix, motion.v)

    def carried(self, xi: np.ndarray) -> np.ndarray:
        """As `Kinematics.carried`."""
        return np.einsum("ijnb,jb->inb", self.matrix, xi)

    def wrench(self, force: np.ndarray) -> np.ndarray:
        """As `Kinematics.wrench`, of (3, n, B)."""
        return np.einsum("ijnb,inb->jb", self.weighed, force)

    def assembled(self, load: np.ndarray, v: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray | None]:
        """As `Kinematics.assembled`, and what the loads' tangents times velocities v (3, n, B) do to the frame, (3, B)."""
        columns = np.empty((3, 4 if v is None else 5, *load.shape[2:]))
        columns[:, 0] = load[:, 0]
        np.einsum("ijnb,jknb->iknb", load[:, 1:], self.matrix, out=columns[:, 1:4])
        if v is not None:
            np.einsum("ijnb,jnb->inb", load[:, 1:], v, out=columns[:, 4])
        net = np.einsum("ijnb,iknb->jkb", self.weighed, columns)
        return net[:, :4], None if v is None else net[:, 4]

    def take(self, keep: np.ndarray) -> Jacobian:
        return Jacobian(*(x[..., keep] for x in self))

    @staticmethod
    def join(some: list[Jacobian]) -> Jacobian:
        return Jacobian(*(np.concatenate(x, -1) for x in zip(*some)))


class Samples(NamedTuple):
    """Some samples of a batch. index: (B,), which of it these are. motion: of their elements, velocities over the scale.
    centre: (2, B), the body's mean place. scale: (B,). unit: (B,), of the residual. model: with their parameters."""

    index: np.ndarray
    motion: Kinematics | Jacobian
    centre: np.ndarray
    scale: np.ndarray
    unit: np.ndarray
    model: Model

    @property
    def size(self) -> int:
        return self.index.size

    def take(self, keep: np.ndarray) -> Samples:
        index, motion, centre, scale, unit, model = self
        return Samples(index[keep], motion.take(keep), centre[:, keep], scale[keep], unit[keep], model.take(keep))

    @staticmethod
    def join(some: list[Samples], model: Model) -> Samples:
        """Samples of one batch side by side; model: of the whole batch."""
        index, motions, centre, scale, unit, _ = zip(*some)
        index = np.concatenate(index)
        rest = (np.concatenate(x, -1) for x in (centre, scale, unit))
        return Samples(index, type(motions[0]).join(list(motions)), *rest, model.take(index))


@dataclass
class State:
    """Samples under way. Every array has them on its last axis."""

    of: Samples
    xi: np.ndarray  # (3, B)
    dx: np.ndarray  # (3, B) the step to try
    v: np.ndarray  # (3, n, B) element velocities at xi
    eps: np.ndarray  # the rounding at xi
    eps_next: np.ndarray  # the rounding to try
    stride: np.ndarray  # the part of a Newton step to try
    residual: np.ndarray
    iterations: np.ndarray
    going: np.ndarray  # whether it has not ended yet

    def take(self, keep: np.ndarray) -> State:
        parts = {f.name: getattr(self, f.name) for f in fields(self)}
        return State(**{k: x.take(keep) if k == "of" else x[..., keep] for k, x in parts.items()})

    @staticmethod
    def join(states: list[State], model: Model) -> State:
        parts = {f.name: [getattr(s, f.name) for s in states] for f in fields(State)}
        of = Samples.join(parts.pop("of"), model)
        return State(of=of, **{k: np.concatenate(x, -1) for k, x in parts.items()})
