"""The base of rules of contact: a weight between 0 and 1 for each element of a body, as
a function of its place along the body and of a phase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rft.contacts.loads import balanced_loads
from rft.core.checks import Number, Word, check_numbers
from rft.core.refusal import Refusal, require
from rft.core.registry import Registry, subclasses

FOLLOWS = {
    "phase": "a further shape variable, the last one, with a period of 2 pi",
    "shape": "minus the polar angle of the first two shape variables",
}
BEARINGS = {
    "buried": "the body lies in the ground, and its contact only switches drag",
    "normalised": "the weight rests on the parts that touch, in proportion to contact",
    "balanced": "the weight rests on the parts that touch, in balance of moments",
}


def _listed(what: str, choices: dict[str, str]) -> str:
    """Return the meaning of a key with its choices."""
    words = "; ".join(f"{name}: {meaning}" for name, meaning in choices.items())
    return f"{what}; {words}"


# Places along the body and phases at which a rule is checked.
CHECKED = 201, 240
LEAST_CONTACT = 1e-9  # of the body's length that must touch
Rise = Annotated[
    float,
    Number(
        0.001,
        np.pi,
        "rad",
        "phase over which a part lifts off, or touches down",
    ),
]


@dataclass(frozen=True, kw_only=True)
class ContactRule:
    """Which part of a body touches the ground, and how much.

    Subclasses define ``weights``. follows: where the phase of contact comes from,
    "phase" or "shape" (`FOLLOWS`). bearing: who bears the body (`BEARINGS`); in grains
    and on hard ground the drag is taken in proportion to the load (assumed). width:
    with bearing "balanced", the body's width; with it loads balance about the line from
    tail to head as well. height: of the centre of mass.

    Attributes
    ----------
    kind : name in scenes and messages.
    varies_along : whether the weight varies along an element.
    """

    follows: Annotated[
        str, Word(FOLLOWS, _listed("where its phase comes from", FOLLOWS))
    ] = "phase"
    bearing: Annotated[str, Word(BEARINGS, _listed("who bears the body", BEARINGS))] = (
        "buried"
    )
    width: Annotated[
        float | None,
        Number(
            0,
            1,
            "body lengths",
            "width of the body, over which its load balances from side to side",
        ),
    ] = None

    height: Annotated[
        float,
        Number(
            0,
            1,
            "body lengths",
            "height of the centre of mass above the ground, by which a body on a "
            "slope rolls over; it changes no load",
        ),
    ] = 0.0

    kind = "contact"
    varies_along = True

    def __post_init__(self):
        check_numbers(self)
        for name, choices in (("follows", FOLLOWS), ("bearing", BEARINGS)):
            value = getattr(self, name)
            known = isinstance(value, str) and value in choices
            require(
                known,
                f"{name} must be one of {', '.join(choices)}",
                value=value,
            )
        require(
            self.width is None or self.bearing == "balanced",
            "a width applies only to bearing = 'balanced'",
            instead="remove the width, or balance the loads",
        )

    @property
    def is_cut(self) -> bool:
        """Whether the balance of forces needs the body cut into pieces."""
        return self.varies_along or self.bearing == "balanced"

    def weights(self, station: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Return the weights (n, B), 0 to 1, of places (n, 1) along the body, 0 at the
        tail and 1 at the head, at phases (B,), rad."""
        raise TypeError(f"{type(self).__name__} defines no weights")

    def check(self, body: Any) -> None:
        """Raise ValueError unless the rule is one for this body."""
        require(
            self.follows == "phase" or body.joints >= 2,
            "contact that follows the shape needs two shape variables",
            value=body.joints,
            instead="use follows = 'phase'",
        )

    def placed(self, station: np.ndarray, body: Any) -> np.ndarray:
        """Return places (n, 1) along a body as ``weights`` takes them."""
        return station

    def _check_weights(self) -> None:
        """Raise ValueError unless weights lie between 0 and 1 and some part touches at
        every phase; subclasses call it once they are complete."""
        places, phases = CHECKED
        station = (np.arange(places) + 0.5)[:, None] / places
        phase = 2 * np.pi * np.arange(phases) / phases
        weights = self.checked_weights(station, phase)
        self._require_contact(weights.mean(0), phase)

    def checked_weights(self, station: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Return the weights; ValueError unless they are (n, B) and lie between 0 and
        1."""
        weights = np.asarray(self.weights(station, phase), float)
        shape = np.broadcast_shapes(station.shape, phase.shape)
        require(
            weights.shape == shape,
            f"weights of contact must have shape {shape} here",
            value=weights.shape,
        )
        in_bounds = bool(((weights >= 0.0) & (weights <= 1.0)).all())
        if not in_bounds:
            outside = weights[~((weights >= 0.0) & (weights <= 1.0))]
            raise Refusal(
                "weights of contact must lie from 0 to 1",
                value=float(outside[0]),
            )
        return weights

    def _require_contact(self, touching: np.ndarray, phase: np.ndarray) -> None:
        """Raise ValueError where no part (B,) of the body's length touches."""
        if touching.min(initial=1.0) > LEAST_CONTACT:
            return
        first = float(np.broadcast_to(phase, touching.shape)[touching.argmin()])
        raise Refusal(
            f"nothing touches the ground at a contact phase of {first:.3g} rad",
            because="no part would bear the body",
            instead="let parts touch for longer, or at other phases",
        )

    def factors(
        self,
        station: np.ndarray,
        fraction: np.ndarray,
        centres: np.ndarray,
        along: np.ndarray,
        phase: np.ndarray,
    ) -> np.ndarray:
        """Return the factors (n, B) of the drag on elements.

        station, fraction: (n, 1), their places and fractions of the body's length.
        centres: (n, B), x + i y in body lengths. along: (n, B), exp(i theta) of their
        headings. phase: (B,), of contact."""
        weights = self.checked_weights(station, phase)
        touching = (fraction * weights).sum(0)
        self._require_contact(touching, phase)
        if self.bearing == "buried":
            return weights
        if self.bearing == "normalised":
            return weights / touching
        return balanced_loads(weights, fraction, centres, along, self.width)


CONTACTS = Registry(
    "geomech.contacts", "kind", "a rule of contact", subclasses(ContactRule)
)
