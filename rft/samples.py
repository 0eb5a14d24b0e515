"""What the solver works on: samples of a batch, their elements and their own parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.bodies.base import Kinematics
from rft.contact import Model


class Samples(NamedTuple):
    """Some samples of a batch. index: (B,), which of it these are. motion: of their elements, velocities over the scale.
    centre: (2, B), the body's mean place. scale: (B,). unit: (B,), of the residual. model: with their parameters."""

    index: np.ndarray
    motion: Kinematics
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
        return Samples(index, Kinematics.join(list(motions)), *rest, model.take(index))
