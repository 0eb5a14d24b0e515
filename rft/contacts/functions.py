"""Contact by a function of one's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rft.contacts.base import ContactRule
from rft.core.refusal import Refusal, require


@dataclass(frozen=True, kw_only=True)
class FunctionContact(ContactRule):
    """Weights by ``function``, which takes places (n, 1) along the body, 0 at the tail
    and 1 at the head, and phases (B,) in rad, and returns weights (n, B) from 0 to 1.

    For Python only: a scene runs no code.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.contacts import FunctionContact
    >>> def lifted(s, phase):
    ...     return 0.5 + 0.5 * np.cos(phase + 2 * np.pi * s)
    ...
    >>> rule = FunctionContact(function=lifted, bearing="normalised")
    >>> rule.weights(np.array([[0.25]]), np.array([0.0])).round(3)
    array([[0.5]])
    """

    function: Callable[[np.ndarray, np.ndarray], np.ndarray]

    kind = "function"

    def __post_init__(self):
        super().__post_init__()
        require(
            callable(self.function),
            "function must be a function of places and phases",
            value=self.function,
        )
        try:
            self._check_weights()
        except Refusal:
            raise
        except Exception as error:
            raise Refusal(
                "function fails",
                because=f"{type(error).__name__}: {error}",
            ) from error

    def weights(self, station: np.ndarray, phase: np.ndarray) -> np.ndarray:
        return self.function(station, phase)
