"""A body of which parts touch the ground, and others are lifted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import (
    Body,
    Elements,
    checked_body,
    half_lengths,
    joint_angles,
    numbered_labels,
)
from rft.bodies.pieces import PIECES, subdivide
from rft.contacts.base import ContactRule
from rft.core.checks import unmasked
from rft.core.refusal import require
from rft.formulas.support import ContactState, support_margin

PHASE_LABEL = ("contact phase", "rad")
PERIOD = 2 * np.pi


@dataclass(frozen=True)
class Touching:
    """The body ``inner`` with a rule of ``contact``.

    Its shape variables are those of the inner body and, where contact follows the
    phase, the phase of contact, which moves nothing by itself.

    Examples
    --------
    >>> from rft import Chain, Granular, body_velocity
    >>> from rft.contacts import Touching, WaveContact
    >>> body = Touching(Chain((1,) * 5), WaveContact(duty=0.6))
    >>> body.joints, body.shape_labels[-1]
    (5, ('contact phase', 'rad'))
    >>> shape = [0.3, -0.2, -0.3, 0.2, 0.5]  # four joints, and the phase of contact
    >>> rate = [0.2, 0.3, -0.2, -0.3, 1.0]
    >>> body_velocity(Granular(1.8, 0.24), body, shape, rate).xi.shape
    (3,)
    """

    inner: Body
    contact: ContactRule

    def __post_init__(self):
        checked_body(self.inner)
        require(
            isinstance(self.contact, ContactRule),
            "contact must be a rule such as WaveContact()",
            value=self.contact,
        )
        require(
            not hasattr(self.inner, "contact_factors"),
            "this body has a contact of its own",
            instead="remove the rule of contact",
        )
        self.contact.check(self.inner)

    @property
    def length(self) -> float | None:
        return self.inner.length

    @property
    def follows_phase(self) -> bool:
        """Whether the phase of contact is the last shape variable."""
        return self.contact.follows == "phase"

    @property
    def joints(self) -> int:
        return self.inner.joints + int(self.follows_phase)

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        labels = getattr(self.inner, "shape_labels", None)
        if labels is None:
            labels = numbered_labels(self.inner.joints)
        if self.follows_phase:
            return (*labels, PHASE_LABEL)
        return labels

    @property
    def shape_periods(self) -> tuple[float | None, ...]:
        """Period of each shape variable, None for none; () where none has one."""
        if self.follows_phase:
            return (*(None,) * self.inner.joints, PERIOD)
        return ()

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        """Return the joint angles of shapes (joints, B), or the joint rates of
        rates."""
        return joint_angles(self.inner, shape[: self.inner.joints])

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        """Return the elements of the inner body at shapes and rates (joints, B)."""
        joints = self.inner.joints
        return self.inner.motion(alpha[:joints], alphadot[:joints])

    def contact_phase(self, alpha: np.ndarray) -> np.ndarray:
        """Return the phase of contact (B,) at shapes (joints, B), rad."""
        if self.follows_phase:
            return alpha[-1]
        return -np.arctan2(alpha[1], alpha[0])

    def contact_factors(
        self,
        alpha: np.ndarray,
        elements: Elements,
        station: np.ndarray,
        fraction: np.ndarray,
    ) -> np.ndarray:
        """Return the factors (n, B) of the drag on elements, of this body or cut into
        pieces, at shapes (joints, B).

        station, fraction: (n, 1), their places and fractions of the body's length."""
        along = elements.c + 1j * elements.s
        phase = self.contact_phase(alpha)
        size = (len(station), np.size(phase))
        station = self.contact.placed(station, self.inner)
        centres = np.broadcast_to(elements.centres, size)
        along = np.broadcast_to(along, size)
        return self.contact.factors(station, fraction, centres, along, phase)

    @property
    def rests(self) -> bool:
        """Whether the body lies on the ground, so that it may roll over: the ground
        holds one that is buried, unless its height is given."""
        return self.contact.bearing != "buried" or self.contact.height > 0

    @property
    def height(self) -> float:
        """Height of the centre of mass above the ground, body lengths."""
        return self.contact.height

    def contact_state(
        self,
        alpha: np.ndarray,
        shift: np.ndarray | complex = 0.0,
        pieces: int = PIECES,
    ) -> ContactState:
        """Return the contact of the elements of the inner body at shapes (B, joints).

        shift: (B,), as of `rft.support_margin`. pieces: to a body length, into which
        elements are cut, and over which weights and loads of an element are means.

        Examples
        --------
        >>> import numpy as np
        >>> from rft import Chain
        >>> from rft.contacts import LinkContact, Touching
        >>> feet = LinkContact(links=((0.0, 0.6), (), (0.5, 0.1)), bearing="normalised")
        >>> body = Touching(Chain(), feet)
        >>> state = body.contact_state(np.array([[0.3, 0.3, np.pi / 2]]))
        >>> state.weight, state.load  # of a body that rests on its tail link
        (array([[1., 0., 0.]]), array([[3., 0., 0.]]))
        """
        shapes = np.ascontiguousarray(alpha.T)
        cut = subdivide(self, pieces)
        elements = cut.motion(shapes, np.zeros_like(shapes))
        half = elements.half
        station = np.cumsum(2 * half, 0) - half
        fraction = half / half.sum()
        size = (len(half), shapes.shape[1])
        centres = np.broadcast_to(elements.centres, size)
        along = np.broadcast_to(elements.c + 1j * elements.s, size)
        rule = self.contact
        phase = self.contact_phase(shapes)
        weight = rule.checked_weights(rule.placed(station, self.inner), phase)
        load = self.contact_factors(shapes, elements, station, fraction)
        width = rule.width or 0.0
        margin = support_margin(weight, fraction, centres, along, width, shift)

        ends = np.cumsum(2 * half_lengths(self.inner))
        owner = np.searchsorted(ends, station[:, 0] - 1e-12)
        owned = fraction[:, 0] * (owner == np.arange(len(ends))[:, None])
        means = owned / owned.sum(1, keepdims=True)
        return ContactState((means @ weight).T, (means @ load).T, margin)

    def points(self, alpha: ArrayLike, pose: ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the ends of the links in the world, as the inner body does."""
        inner: Any = self.inner
        return inner.points(unmasked("alpha", alpha)[..., : inner.joints], pose)

    def frame_pose(
        self, frame: str, alpha: ArrayLike, alphadot: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose of another frame, and its rate, as the inner body does."""
        inner: Any = self.inner
        joints = inner.joints
        alpha = unmasked("alpha", alpha)[..., :joints]
        return inner.frame_pose(
            frame, alpha, unmasked("alphadot", alphadot)[..., :joints]
        )

    @cached_property
    def frame(self) -> str:
        """The name of the inner body's frame."""
        return getattr(self.inner, "frame", "mean")
