"""A gait with shape variables that advance with the phase, such as that of a
contact."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.gait import Gait, checked_gait
from geomech.mathematics.geometry.periods import Periods, checked_periods
from rft.core.checks import is_whole, real_array
from rft.core.refusal import Refusal

TURN = 2 * np.pi  # rad: the period unless others are given


@dataclass(frozen=True)
class Wound(Gait):
    """A gait of the first shape variables, with further ones after them that advance in
    proportion to the phase.

    Each further variable starts at 0 and advances by ``turns`` of its periods per
    cycle, backwards where the gait is reversed. The curve closes modulo the periods.
    The amplitude scales the gait alone: at amplitude 0 it rests at its centre while the
    further variables advance, which is the *loop at rest*.

    gait: of the first variables. turns: whole numbers, one for each further variable.
    periods: of the further variables, rad; 2 pi each if left out. amplitude, centre,
    reverse, frequency: those of the gait; given, they replace them. Other attributes
    are the gait's.

    Examples
    --------
    >>> import math
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.mathematics.gaits.wound import Wound
    >>> gait = Wound(Circle(0.5))
    >>> gait.joints, gait.shape(math.pi / 2).round(3)  # the third is the phase
    (3, array([0.   , 0.5  , 1.571]))
    """

    gait: Gait
    turns: tuple[int, ...] = (1,)
    periods: tuple[float, ...] = ()
    _: KW_ONLY
    amplitude: Any = field(default=None, repr=False)
    centre: Any = field(default=None, repr=False)
    reverse: Any = field(default=None, repr=False)
    frequency: Any = field(default=None, repr=False)

    def __post_init__(self):
        inner = checked_gait(unwound(self.gait))
        changes = {}
        for name in ("amplitude", "centre", "reverse", "frequency"):
            value = getattr(self, name)
            if value is not None and value is not getattr(inner, name, None):
                changes[name] = value
        if changes:
            inner = replace(inner, **changes)
        object.__setattr__(self, "gait", inner)
        for name in ("amplitude", "centre", "reverse", "frequency"):
            object.__setattr__(self, name, getattr(inner, name, None))

        turns = tuple(self.turns)
        if not turns or not all(is_whole(n) for n in turns):
            raise Refusal(
                "turns must be whole numbers, one for each variable that advances",
                value=self.turns,
            )
        periods = checked_periods(self.periods, len(turns)) or (TURN,) * len(turns)
        if None in periods:
            raise Refusal(
                "each variable that advances needs a period", value=self.periods
            )
        object.__setattr__(self, "turns", tuple(int(n) for n in turns))
        object.__setattr__(self, "periods", periods)

    def __getattr__(self, name: str) -> Any:
        # Only for names that this class does not define.
        if name.startswith("__") or name == "gait":
            raise AttributeError(name)
        return getattr(self.gait, name)

    @property
    def joints(self) -> int:
        return self.gait.joints + len(self.turns)

    @property
    def harmonics(self) -> int:  # type: ignore[override]  # a number of most classes
        """The highest harmonic of the gait, and of the further variables."""
        return max([self.gait.harmonics, *map(abs, self.turns)])

    @property
    def estimate_is(self) -> str:  # type: ignore[override]
        return getattr(self.gait, "estimate_is", "")

    @property
    def middle(self) -> np.ndarray:
        """The gait's middle, and the further variables at phase 0."""
        return np.concatenate([self.gait.middle, np.zeros(len(self.turns))])

    @property
    def amplitude_label(self) -> str:
        return self.gait.amplitude_label

    @property
    def _advances(self) -> np.ndarray:
        """Change of the further variables per rad of phase."""
        sign = -1.0 if getattr(self.gait, "reverse", False) else 1.0
        return sign * np.array(self.turns) * np.array(self.periods) / TURN

    def largest(self, amplitudes: ArrayLike | None = None) -> float:
        """Return the largest |alpha_k| of the gait's own variables."""
        return self.gait.largest(amplitudes)

    def shape(self, t: ArrayLike, amplitudes: ArrayLike | None = None) -> np.ndarray:
        t = real_array("t", t)
        own = self.gait.shape(t, amplitudes)
        return _joined(own, t[..., None] * self._advances)

    def rate(self, t: ArrayLike, amplitudes: ArrayLike | None = None) -> np.ndarray:
        return _joined(self.gait.rate(t, amplitudes), self._advances)

    def cycle(
        self, phases: int, amplitudes: ArrayLike | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        own, own_rate = self.gait.cycle(phases, amplitudes)
        t = TURN * np.arange(phases) / phases
        alpha = _joined(own, t[:, None] * self._advances)
        return alpha, _joined(own_rate, self._advances)

    def unit(self, t: ArrayLike) -> np.ndarray:
        # A gait has only one amplitude, and the further variables take none.
        raise TypeError("a wound gait is no scaled curve: use shape(t, amplitudes)")

    unit_rate = unit

    def with_elements(self, count: int) -> Wound:
        """Return the gait of a body of ``count`` elements, where the gait is one."""
        inner: Any = self.gait
        return Wound(inner.with_elements(count), self.turns, self.periods)


def _joined(own: np.ndarray, further: np.ndarray) -> np.ndarray:
    """Return variables (..., d) with further ones (..., k) after them."""
    shape = (*own.shape[:-1], further.shape[-1])
    return np.concatenate([own, np.broadcast_to(further, shape)], -1)


def unwound(gait: Any) -> Any:
    """Return the gait inside a `Wound` one; any other gait as it is."""
    return gait.gait if isinstance(gait, Wound) else gait


def wound_for(gait: Any, joints: int, periods: Periods) -> Any:
    """Return a gait for a system of ``joints`` variables with these periods.

    Where the gait moves all but the last variables, and these have periods, each
    advances by its period per cycle, as does a contact phase. Any other gait is
    returned as it is, without what advanced for another system."""
    if gait.joints == joints:
        return gait
    inner = unwound(gait)
    own = inner.joints
    further = [period for period in periods[own:] if period is not None]
    if not own < joints or not periods or len(further) < joints - own:
        return inner
    return Wound(inner, (1,) * (joints - own), tuple(further))
