"""A wave of contact that travels along the body, as in sidewinding and in the lifting
of slithering snakes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.contacts.base import CONTACTS, ContactRule, Rise
from rft.core.checks import Number
from rft.core.refusal import require
from rft.formulas.steps import on_weight


@CONTACTS.register
@dataclass(frozen=True, kw_only=True)
class WaveContact(ContactRule):
    """A part at s, 0 at the tail and 1 at the head, touches while the phase
    phi + 2 pi waves s + lag lies within pi duty of a multiple of 2 pi, with phi the
    phase of contact.

    It runs from head to tail as phi grows, as the joint angles of a wave do: with phi
    the phase of such a gait and lag = 0 those parts touch that bend to the left most. A
    part lifts off and touches down over the phase ``rise``, by a polynomial with two
    continuous derivatives (assumed).

    Examples
    --------
    >>> import numpy as np
    >>> from rft.contacts import WaveContact
    >>> wave = WaveContact(duty=0.5)
    >>> wave.weights(np.array([[0.0], [0.5]]), np.zeros(1))
    array([[1.],
           [0.]])
    """

    waves: Annotated[
        float, Number(-500, 500, "-", "number of waves of contact on the body")
    ] = 1.0
    lag: Annotated[
        float,
        Number(-1e6, 1e6, "rad", "phase of contact at the tail ahead of the gait's"),
    ] = 0.0
    duty: Annotated[
        float,
        Number(0.01, 1, "-", "share of a cycle for which a part touches; 1 is always"),
    ] = 0.5
    rise: Rise = 0.5

    kind = "wave"

    def __post_init__(self):
        super().__post_init__()
        room = 2 * np.pi * min(self.duty, 1 - self.duty)
        fits = self.duty == 1 or self.rise <= room
        require(
            fits,
            f"a rise of {self.rise:.3g} rad does not fit a duty of {self.duty:.3g}",
            because=f"a part has {room:.3g} rad to touch or to be lifted in",
            instead=f"lower rise to {room:.3g} rad or less, or use a duty of 1",
        )
        self._check_weights()

    def weights(self, station: np.ndarray, phase: np.ndarray) -> np.ndarray:
        local = phase + 2 * np.pi * self.waves * station + self.lag
        if self.duty == 1:
            return np.ones_like(local)
        return on_weight(local, np.pi * self.duty, self.rise)

    @classmethod
    def examples(cls) -> dict[str, WaveContact]:
        return {
            "wave": cls(waves=1.5, lag=0.4, duty=0.6),
            "wave-of-shape": cls(follows="shape", duty=0.7),
            "normalised-wave": cls(bearing="normalised", duty=0.4),
            "balanced-wave": cls(bearing="balanced", waves=2.0, width=0.05),
        }
