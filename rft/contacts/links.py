"""Links, or feet on them, that touch the ground at given phases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rft.bodies.base import innermost
from rft.contacts.base import CONTACTS, ContactRule, Rise
from rft.core.checks import real_array
from rft.core.refusal import Refusal, require
from rft.formulas.steps import on_weight


@CONTACTS.register
@dataclass(frozen=True, kw_only=True)
class LinkContact(ContactRule):
    """Each link touches the ground from one phase of a cycle to another.

    links (-): for each link, tail to head, the phases at which it touches down and
    lifts off, in cycles from 0 to 1; a link that touches down at 0.75 and lifts off at
    0.25 touches across the start of the cycle; [0, 1] touches always, and [] never.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.contacts import LinkContact
    >>> walk = LinkContact(links=((0.0, 0.5), (), (0.5, 1.0)), rise=0.2)
    >>> walk.weights(np.array([[0.1], [0.5], [0.9]]), np.array([np.pi / 2]))
    array([[1.],
           [0.],
           [0.]])
    """

    links: tuple[tuple[float, ...], ...] = ((0.0, 1.0),)
    rise: Rise = 0.2

    kind = "links"
    varies_along = False

    def __post_init__(self):
        super().__post_init__()
        require(
            isinstance(self.links, (tuple, list)),
            "links must be a list with an entry for each link",
            value=self.links,
        )
        object.__setattr__(self, "links", tuple(map(self._checked, self.links)))
        require(
            len(self.links) > 0,
            "links must have an entry for each link",
        )
        self._check_weights()

    def _checked(self, link: Any) -> tuple[float, ...]:
        """Return the phases of a link; ValueError unless there are none, or two."""
        phases = real_array("links", link)
        is_pair = phases.shape == (2,)
        in_bounds = bool(((phases >= 0) & (phases <= 1)).all())
        require(
            phases.size == 0 or (is_pair and in_bounds),
            "each entry of links must be [touches down, lifts off], from 0 to 1, or []",
            value=link,
        )
        on = tuple(phases.tolist())
        if on and self._length(on) < 1:
            room = 2 * np.pi * min(self._length(on), 1 - self._length(on))
            if self.rise > room:
                raise Refusal(
                    f"a rise of {self.rise:.3g} rad does not fit a link that touches "
                    f"from {on[0]:g} to {on[1]:g}",
                    instead=f"lower rise to {room:.3g} rad or less",
                )
        return on

    @staticmethod
    def _length(on: tuple[float, ...]) -> float:
        """Return the share of a cycle for which a link touches."""
        length = (on[1] - on[0]) % 1.0
        if length == 0.0 and on[0] != on[1]:
            return 1.0
        return length

    def check(self, body: Any) -> None:
        super().check(body)
        links = len(getattr(innermost(body), "lengths", ()))
        require(
            links == len(self.links),
            f"links has {len(self.links)} entries, and the body has {links} links",
            instead="give [touches down, lifts off] for each link, tail to head",
        )

    def placed(self, station: np.ndarray, body: Any) -> np.ndarray:
        """Return places along a body as if its links were of equal length."""
        ends = np.concatenate([[0.0], np.cumsum(innermost(body).fractions)])
        return np.interp(station, ends, np.linspace(0.0, 1.0, len(ends)))

    def weights(self, station: np.ndarray, phase: np.ndarray) -> np.ndarray:
        by_link = np.stack([self._weight(on, phase) for on in self.links])
        link = np.floor(station[:, 0] * len(self.links)).astype(int)
        return by_link[np.clip(link, 0, len(self.links) - 1)]

    def _weight(self, on: tuple[float, ...], phase: np.ndarray) -> np.ndarray:
        """Return the weight (B,) of a link at phases (B,)."""
        if not on:
            return np.zeros_like(phase)
        length = self._length(on)
        if length == 1:
            return np.ones_like(phase)
        middle = 2 * np.pi * (on[0] + length / 2)
        return on_weight(phase - middle, np.pi * length, self.rise)

    @classmethod
    def examples(cls) -> dict[str, LinkContact]:
        return {"links": cls(links=((0.0, 0.6), (0.0, 1.0), (0.5, 0.1)))}
