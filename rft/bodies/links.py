"""Bodies of straight links, whatever their poses follow from: frames, motion and
drawing."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import Elements, body_size
from rft.core.checks import real_array, unmasked
from rft.core.refusal import require
from rft.formulas.se2 import rotated


class Links:
    """Base of bodies of n straight links. Subclasses are frozen dataclasses with
    lengths (relative), length, frame and joints, and give `_links`."""

    lengths: tuple[float, ...]
    length: float | None
    frame: str
    joints: Any  # a number, or a property

    def _check_lengths(self) -> None:
        """Store the lengths as a tuple; ValueError unless they are lengths of two links
        or more."""
        lengths = real_array("lengths", self.lengths)
        require(
            lengths.ndim == 1, "lengths must be a list of numbers", value=self.lengths
        )
        object.__setattr__(self, "lengths", tuple(lengths.tolist()))
        require(
            len(self.lengths) >= 2,
            "lengths must have at least two links",
            value=len(self.lengths),
        )
        are_positive = all(0 < x < math.inf for x in self.lengths)
        require(
            are_positive and sum(self.lengths) < 1e100,
            "lengths must all be finite and > 0",
            value=list(self.lengths),
        )
        shortest = min(self.lengths) / sum(self.lengths)
        require(
            shortest >= 1e-12,
            "the shortest link must be at least 1e-12 of the body length, got "
            f"{shortest:.3g}",
        )

    def __getstate__(self) -> dict:
        """Return the fields alone for copies and workers, without cached properties."""
        own = fields(self)  # type: ignore[arg-type]  # subclasses are dataclasses
        return {field.name: getattr(self, field.name) for field in own}

    def _links(self, alpha: np.ndarray, alphadot: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return five arrays (n, B) of the links in the body frame at shapes and rates
        (joints, B): exp(i theta), rates of theta, centres x + i y, velocities of the
        centres, and headings theta."""
        raise NotImplementedError

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
        """Return the index of the link that carries a frame, None for "mean";
        ValueError for no frame of this body."""
        n = len(self.lengths)
        number = 0
        if isinstance(frame, str):
            if frame == "mean":
                return None
            match = re.fullmatch(r"link-([1-9]\d{0,6})", frame)
            if match:
                number = int(match[1])
        require(
            0 < number <= n,
            f"frame must be 'mean' or 'link-1' ... 'link-{n}'",
            value=frame,
        )
        return number - 1

    @cached_property
    def frame_link(self) -> int | None:
        """Index of the link that carries the frame, None for "mean"."""
        return self._frame_link(self.frame)

    def _frame_value(self, x: np.ndarray, link: int | None) -> np.ndarray:
        """Return a frame's value from values of the links (n, ...): its link's, or the
        length-weighted mean."""
        if link is None:
            return self.fractions @ x
        return x[link]

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        """Return the links at shapes (rad) and rates (rad per unit time), (joints, B)
        each, with the body frame held."""
        heading, rotation, centre, velocity, _ = self._links(alpha, alphadot)
        return Elements.from_complex(
            heading, centre, velocity, rotation, self._half_lengths
        )

    def frame_pose(
        self, frame: str, alpha: np.ndarray, alphadot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose h of another frame of this body in the body frame, and dh/dt:
        each (..., 3), in length units and rad.

        alpha, alphadot: (..., joints). `geomech.mathematics.geometry.coordinates` uses
        it to change the frame of velocities and connections.
        """
        alpha, alphadot = np.broadcast_arrays(
            unmasked("alpha", alpha), unmasked("alphadot", alphadot)
        )
        flat = alpha.reshape(-1, self.joints).T
        flat_rate = alphadot.reshape(-1, self.joints).T
        _, *links = self._links(flat, flat_rate)
        link = self._frame_link(frame)
        rotation, centre, velocity, theta = (
            self._frame_value(x, link).reshape(alpha.shape[:-1]) for x in links
        )
        centre = body_size(self) * centre
        velocity = body_size(self) * velocity
        h = (centre.real, centre.imag, theta)
        hdot = (velocity.real, velocity.imag, rotation)
        return np.stack(h, -1), np.stack(hdot, -1)

    def points(
        self, alpha: np.ndarray, pose: ArrayLike = (0.0, 0.0, 0.0)
    ) -> np.ndarray:
        """Return the ends of the links in the world, tail to head, (..., links + 1, 2),
        in length units.

        alpha: (..., joints), rad. pose: (..., 3), pose of the body frame in the world,
        (x, y) in length units, theta in rad."""
        alpha = unmasked("alpha", alpha)
        pose = unmasked("pose", pose)
        require(
            alpha.shape[-1:] == (self.joints,),
            f"alpha must have {self.joints} angles on its last axis",
            value=alpha.shape,
        )
        require(pose.shape[-1:] == (3,), "pose must be (x, y, theta)", value=pose.shape)
        flat = alpha.reshape(-1, self.joints).T
        heading, _, centre, *_ = self._links(flat, np.zeros_like(flat))
        half = self._half_lengths * heading
        ends = np.concatenate([centre - half, (centre + half)[-1:]])
        ends = body_size(self) * ends.T.reshape(*alpha.shape[:-1], -1)
        x, y, theta = np.moveaxis(pose[..., None], -2, 0)
        dx, dy = rotated(theta, ends.real, ends.imag)
        return np.stack([x + dx, y + dy], -1)
