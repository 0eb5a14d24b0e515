"""Continuous backbones: many short straight elements whose bends follow from a few
shape variables.

The elements are chords of the curve; errors are of order 2 in 1/elements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import BODIES, Elements, Length, numbered_labels
from rft.bodies.chain import Chain
from rft.core.checks import Number, check_numbers, unmasked
from rft.core.refusal import require


def _centres(count: int) -> np.ndarray:
    """Return the centres of ``count`` equal elements, 0 at the tail to 1 at the
    head."""
    return (np.arange(count) + 0.5) / count


@BODIES.register
@dataclass(frozen=True)
class Backbone:
    """A body of equal elements whose shape variables are the bends at the ``elements``
    - 1 points between them, for waves and measured centrelines.

    frame (-): "mean", centre of mass and mean heading, or "link-1", "link-2" ...,
    centre and heading of that element.

    Examples
    --------
    >>> from rft.bodies import Backbone
    >>> Backbone(elements=50).joints
    49
    """

    elements: Annotated[
        int,
        Number(3, 2000, "-", "number of elements of the body, 3 to 2000", whole=True),
    ] = 100
    length: Length = None
    frame: str = "mean"
    kind = "backbone"

    def __post_init__(self):
        check_numbers(self)
        self.chain  # noqa: B018 (checks length and frame)

    @cached_property
    def chain(self) -> Chain:
        return Chain((1.0,) * self.elements, self.length, self.frame)

    @property
    def joints(self) -> int:
        return self.elements - 1

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        return numbered_labels(self.joints)

    @property
    def bends(self) -> np.ndarray | None:
        """Bends at the points between elements for a unit of each shape variable,
        (elements - 1, joints); None where the bends are the shape variables
        themselves."""
        return None

    def with_elements(self, count: int) -> Backbone:
        """Return the body of ``count`` elements, in the frame "mean"; Refusal if there
        is none."""
        return replace(self, elements=count, frame="mean")

    def resampled(self, shape: ArrayLike, count: int) -> np.ndarray:
        """Return shapes, or rates, (..., joints) as those of `with_elements`.

        Headings of elements are headings of the curve at their centres: a spline
        through them, of order 4, gives those at other centres."""
        if self.bends is not None:
            return np.asarray(shape, float)
        from scipy.interpolate import CubicSpline

        heading = np.insert(np.cumsum(shape, -1), 0, 0.0, -1)
        spline = CubicSpline(_centres(self.elements), heading, axis=-1)
        return np.diff(spline(_centres(count)), axis=-1)

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        """Return the elements at shapes and rates (joints, B), with the body frame
        held."""
        if self.bends is None:
            return self.chain.motion(alpha, alphadot)
        return self.chain.motion(self.bends @ alpha, self.bends @ alphadot)

    def frame_pose(
        self, frame: str, alpha: np.ndarray, alphadot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose of another frame as `Chain.frame_pose` does; "link-k" is the
        k-th element."""
        if self.bends is None:
            return self.chain.frame_pose(frame, alpha, alphadot)
        return self.chain.frame_pose(
            frame,
            unmasked("alpha", alpha) @ self.bends.T,
            unmasked("alphadot", alphadot) @ self.bends.T,
        )

    def points(
        self, alpha: np.ndarray, pose: ArrayLike = (0.0, 0.0, 0.0)
    ) -> np.ndarray:
        """Return the ends of the elements in the world, (..., elements + 1, 2), as
        `Chain.points` does."""
        if self.bends is None:
            return self.chain.points(alpha, pose)
        return self.chain.points(unmasked("alpha", alpha) @ self.bends.T, pose)

    @classmethod
    def examples(cls) -> dict[str, Backbone]:
        return {"backbone": cls(elements=9, length=0.1)}


@BODIES.register
@dataclass(frozen=True)
class Serpenoid(Backbone):
    """A backbone of two curvature modes: curvature times length = alpha_1 cos(2 pi
    waves s) + alpha_2 sin(2 pi waves s), s from 0 at the tail to 1 at the head.

    A circle in (alpha_1, alpha_2) is a wave that travels towards the head; the reversed
    circle is one that travels towards the tail and drives the body head first.

    Examples
    --------
    >>> from rft.bodies import Serpenoid
    >>> body = Serpenoid(elements=40, waves=1.5)
    >>> body.joints, body.points([3.0, 0.0]).shape
    (2, (41, 2))
    """

    waves: Annotated[
        float,
        Number(
            0, 500, "-", "number of waves on the body, > 0 and at most elements / 4"
        ),
    ] = 1.0
    kind = "serpenoid"

    def __post_init__(self):
        super().__post_init__()
        in_bounds = 0 < self.waves <= self.elements / 4
        require(
            in_bounds, "waves must be > 0 and at most elements / 4", value=self.waves
        )

    @property
    def joints(self) -> int:
        return 2

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        cosine = ("cosine of curvature x length", "rad")
        sine = ("sine of curvature x length", "rad")
        return cosine, sine

    @cached_property
    def bends(self) -> np.ndarray:
        phase = 2 * np.pi * self.waves * np.arange(1, self.elements) / self.elements
        return np.stack([np.cos(phase), np.sin(phase)], -1) / self.elements

    @classmethod
    def examples(cls) -> dict[str, Backbone]:
        return {"serpenoid": cls(elements=24, waves=1.5)}


@BODIES.register
@dataclass(frozen=True)
class ConstantCurvature(Backbone):
    """A backbone of sections of equal length, each an arc; alpha_k is the angle through
    which section k bends (rad).

    Examples
    --------
    >>> from rft.bodies import ConstantCurvature
    >>> body = ConstantCurvature(elements=40, sections=2)
    >>> body.joints, body.points([1.0, -1.0]).shape
    (2, (41, 2))
    """

    sections: Annotated[
        int, Number(1, 2000, "-", "number of arcs, a divisor of elements", whole=True)
    ] = 2
    kind = "constant-curvature"

    def __post_init__(self):
        super().__post_init__()
        divides = self.elements % self.sections == 0
        require(
            divides,
            f"sections must divide elements ({self.elements})",
            value=self.sections,
        )

    @property
    def joints(self) -> int:
        return self.sections

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        return numbered_labels(self.sections, "bend of section {}")

    @cached_property
    def bends(self) -> np.ndarray:
        # Half of the bend between two elements belongs to the section of either.
        per = self.elements // self.sections
        owner = np.repeat(np.eye(self.sections), per, axis=0)
        return (owner[:-1] + owner[1:]) / (2 * per)

    @classmethod
    def examples(cls) -> dict[str, Backbone]:
        return {"arcs": cls(elements=12, sections=3, frame="link-4")}
