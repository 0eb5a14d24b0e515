"""A chain with legs in pairs, such as a salamander: the phase of its legs is a shape
variable."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import BODIES, Elements, Length, body_size, numbered_labels
from rft.bodies.chain import Chain
from rft.core.checks import Number, check_numbers, real_array, unmasked
from rft.core.refusal import Refusal, require
from rft.formulas.se2 import rotated
from rft.formulas.steps import on_weight
from rft.formulas.support import ContactState, support_margin

PHASE_LABEL = ("leg phase", "rad")
PERIOD = 2 * np.pi
SIDES = np.array([1.0, -1.0])  # left and right
MOST_LEGS = 200


@BODIES.register
@dataclass(frozen=True)
class LeggedChain:
    """Straight links, some of which carry a pair of legs that swing to and fro and
    touch the ground for a share of each cycle.

    Shape variables are the angles between links, as of a chain, and last the phase phi
    of the legs. A leg points away from its link; its foot is swing cos(psi) forward of
    that, rad about the shoulder, with psi = phi + lag + 2 pi phase of the leg. It
    touches while it swings backwards: while psi lies within pi duty of pi / 2. Feet are
    short rods along the legs; legs and feet have no mass. Legs of a pair that swing
    half a cycle apart lie on one line: while both touch alike, dry friction may leave
    their speed along it open, and the rounding decides.

    lengths (-): relative link lengths, tail to head. frame (-): as of a chain, of the
    links alone. legs (-): numbers of the links that carry a pair, from the tail, 1 for
    the last link. phases (-): for each pair, those of its left and right leg, in
    cycles; half a cycle apart, and diagonal legs alike, if left out.

    Examples
    --------
    >>> from rft.bodies import LeggedChain
    >>> salamander = LeggedChain(lengths=(1, 1), legs=(1, 2))
    >>> salamander.joints, salamander.shape_labels[-1]
    (2, ('leg phase', 'rad'))
    """

    lengths: tuple[float, ...] = (1.0, 1.0)
    length: Length = None
    frame: str = "mean"
    legs: tuple[int, ...] = (1, 2)
    phases: tuple[tuple[float, ...], ...] | None = None
    lag: Annotated[
        float, Number(-1e6, 1e6, "rad", "phase of all legs ahead of the leg phase")
    ] = 0.0
    duty: Annotated[
        float, Number(0.05, 1, "-", "share of a cycle for which a foot touches")
    ] = 0.5
    rise: Annotated[
        float,
        Number(
            0.001, np.pi, "rad", "phase over which a foot lifts off, or touches down"
        ),
    ] = 0.5
    swing: Annotated[
        float,
        Number(0, 1.5, "rad", "largest angle of a leg before and behind its link"),
    ] = 0.5
    reach: Annotated[
        float,
        Number(0, 2, "body lengths", "distance of a foot from its shoulder"),
    ] = 0.15
    foot: Annotated[
        float,
        Number(0.001, 1, "body lengths", "length of a foot, along its leg"),
    ] = 0.05
    belly: Annotated[
        float,
        Number(
            0, 1, "-", "factor of the drag on the links, 0 of a body that is lifted"
        ),
    ] = 0.0
    kind = "legged-chain"

    def __post_init__(self):
        check_numbers(self)
        links = len(self.chain.lengths)
        object.__setattr__(self, "lengths", self.chain.lengths)
        legs = real_array("legs", self.legs)
        whole = legs.ndim == 1 and bool((legs == np.floor(legs)).all())
        in_bounds = whole and bool(((legs >= 1) & (legs <= links)).all())
        require(
            in_bounds and 0 < len(legs) <= MOST_LEGS,
            f"legs must be numbers of links, from 1 to {links}",
            value=self.legs,
        )
        object.__setattr__(self, "legs", tuple(int(k) for k in legs))
        if self.phases is not None:
            phases = real_array("phases", self.phases)
            require(
                phases.shape == (len(self.legs), 2) and bool(np.isfinite(phases).all()),
                "phases must be [left, right] in cycles for each pair of legs",
                value=self.phases,
            )
            pairs = tuple(tuple(pair) for pair in phases.tolist())
            object.__setattr__(self, "phases", pairs)
        room = PERIOD * min(self.duty, 1 - self.duty)
        require(
            self.duty == 1 or self.rise <= room,
            f"a rise of {self.rise:.3g} rad does not fit a duty of {self.duty:.3g}",
            instead=f"lower rise to {room:.3g} rad or less, or use a duty of 1",
        )
        self._require_contact()

    def _require_contact(self) -> None:
        """Raise ValueError if at some phase nothing touches the ground."""
        if self.belly > 0:
            return
        phase = np.linspace(0.0, PERIOD, 240, endpoint=False)
        weights = self.foot_weights(phase).sum(0)
        if weights.min() <= 1e-6:
            raise Refusal(
                "nothing touches the ground at a leg phase of "
                f"{phase[weights.argmin()]:.3g} rad",
                because="no foot would bear the body",
                instead="raise the duty, change the phases, or give the belly drag",
            )

    def __getstate__(self) -> dict:
        names = self.__dataclass_fields__
        return {name: getattr(self, name) for name in names}

    @cached_property
    def chain(self) -> Chain:
        """The links without legs."""
        return Chain(self.lengths, self.length, self.frame)

    @property
    def joints(self) -> int:
        return self.chain.joints + 1

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        return (*numbered_labels(self.chain.joints), PHASE_LABEL)

    @property
    def shape_periods(self) -> tuple[float | None, ...]:
        """Period of each shape variable, None for none."""
        return (*(None,) * self.chain.joints, PERIOD)

    def joint_angles(self, shape: np.ndarray) -> np.ndarray:
        """Return the angles, or rates, of joints (d - 1, B), and those of the legs,
        whose phase moves them by their swing."""
        return np.concatenate([shape[:-1], self.swing * shape[-1:]])

    @cached_property
    def leg_phases(self) -> np.ndarray:
        """Phases (legs,) of the legs, rad, left and right of each pair."""
        half = 0.5 * (np.arange(len(self.legs)) % 2)
        phases = np.stack([half, half + 0.5], -1)
        if self.phases is not None:
            phases = np.asarray(self.phases)
        return PERIOD * phases.ravel() + self.lag

    def foot_weights(self, phase: np.ndarray) -> np.ndarray:
        """Return the weights of contact (legs, B) at phases (B,) of the legs, rad."""
        local = phase + self.leg_phases[:, None]
        if self.duty == 1:
            return np.ones_like(local)
        return on_weight(local - np.pi / 2, np.pi * self.duty, self.rise)

    def _feet(
        self, alpha: np.ndarray, alphadot: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the feet (legs, B) at shapes and rates (joints, B): shoulders x + i y,
        directions of the legs, their rotation rates, places and velocities."""
        heading, rotation, centre, velocity, _ = self.chain._links(
            alpha[:-1], alphadot[:-1]
        )
        link = np.repeat(np.array(self.legs) - 1, 2)
        side = np.tile(SIDES, len(self.legs))[:, None]
        psi = alpha[-1] + self.leg_phases[:, None]
        angle = self.swing * np.cos(psi)
        rate = -self.swing * np.sin(psi) * alphadot[-1]
        leg = heading[link] * np.exp(1j * side * (np.pi / 2 - angle))
        turning = rotation[link] - side * rate
        shoulder = centre[link]
        place = shoulder + self.reach * leg
        moved = velocity[link] + 1j * turning * self.reach * leg
        return shoulder, leg, turning, place, moved

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        """Return the links, and after them the feet, at shapes and rates (joints,
        B)."""
        links = self.chain.motion(alpha[:-1], alphadot[:-1])
        _, leg, turning, place, moved = self._feet(alpha, alphadot)
        half = np.full((len(leg), 1), self.foot / 2)
        feet = Elements.from_complex(leg, place, moved, turning, half)
        return Elements(*(np.concatenate(pair) for pair in zip(links, feet)))

    @property
    def stations(self) -> np.ndarray:
        """Places (n, 1) of the elements along the body, 0 at its tail: those of links,
        and of feet that of their shoulders."""
        half = self.chain.fractions[:, None] / 2
        along = np.cumsum(2 * half, 0) - half
        link = np.repeat(np.array(self.legs) - 1, 2)
        return np.concatenate([along, along[link]])

    def contact_factors(
        self,
        alpha: np.ndarray,
        elements: Elements,
        station: np.ndarray,
        fraction: np.ndarray,
    ) -> np.ndarray:
        """Return the factors (n, B) of the drag on the elements at shapes (joints,
        B)."""
        feet = self.foot_weights(alpha[-1])
        links = np.full((len(self.lengths), feet.shape[1]), self.belly)
        return np.concatenate([links, feet])

    @property
    def rests(self) -> bool:
        """Whether the body stands on its feet, so that it may tip over."""
        return self.belly == 0

    def contact_state(
        self, alpha: np.ndarray, shift: np.ndarray | complex = 0.0, pieces: int = 0
    ) -> ContactState:
        """Return the contact of the legs at shapes (B, joints), with equal loads on
        feet that touch alike.

        shift: (B,), as of `rft.support_margin`. pieces: not used, as feet are
        short."""
        shapes = np.ascontiguousarray(alpha.T)
        weight = self.foot_weights(shapes[-1])
        _, leg, _, place, _ = self._feet(shapes, np.zeros_like(shapes))
        links = self.chain.motion(shapes[:-1], np.zeros_like(shapes[:-1]))
        fraction = self.chain.fractions[:, None]
        middle = (fraction * links.centres).sum(0)
        equal = np.full((len(leg), 1), 1 / len(leg))
        # Seen from the mean of the feet, the centre of mass of the links.
        offset = middle - place.mean(0) + shift
        margin = support_margin(weight, equal, place, 1j * leg, self.foot, offset)
        load = weight * len(leg) / np.maximum(weight.sum(0), 1e-300)
        return ContactState(weight.T, load.T, margin)

    def points(self, alpha: ArrayLike, pose: ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the ends of the links in the world, (..., links + 1, 2), as
        `Chain.points` does."""
        return self.chain.points(unmasked("alpha", alpha)[..., :-1], pose)

    def leg_points(
        self, alpha: ArrayLike, pose: ArrayLike = (0.0, 0.0, 0.0)
    ) -> np.ndarray:
        """Return shoulders and feet in the world, (..., legs, 2, 2), in length units.

        alpha: (..., joints), rad. pose: (..., 3), of the body frame."""
        alpha = unmasked("alpha", alpha)
        flat = alpha.reshape(-1, self.joints).T
        shoulder, _, _, place, _ = self._feet(flat, np.zeros_like(flat))
        z = body_size(self) * np.stack([shoulder, place], 1)  # (legs, 2, B)
        z = np.moveaxis(z, -1, 0).reshape(*alpha.shape[:-1], *z.shape[:2])
        x, y, theta = np.moveaxis(unmasked("pose", pose)[..., None, None], -3, 0)
        dx, dy = rotated(theta, z.real, z.imag)
        return np.stack([x + dx, y + dy], -1)

    def frame_pose(
        self, frame: str, alpha: ArrayLike, alphadot: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose of another frame, and its rate, as `Chain.frame_pose`
        does."""
        alpha = unmasked("alpha", alpha)[..., :-1]
        return self.chain.frame_pose(
            frame, alpha, unmasked("alphadot", alphadot)[..., :-1]
        )

    @classmethod
    def examples(cls) -> dict[str, Any]:
        phases = ((0.0, 0.42), (0.55, 0.9))
        body = cls((1.2, 0.8, 1.0), legs=(1, 3), phases=phases, lag=0.3, duty=0.6)
        return {"legged-chain": body}
