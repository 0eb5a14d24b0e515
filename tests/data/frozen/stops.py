"""A law of one's own that stops the command which computes it, as a signal or a fault
would."""

import signal
from dataclasses import dataclass


@dataclass(frozen=True)
class Stops:
    """by (-): the number of a signal; 0 for a full memory, -1 for a fault of the
    program."""

    by: int
    law = "stops"

    def traction(self, v_t, v_n, eps=0.0):
        if self.by > 0:
            signal.raise_signal(self.by)
        if self.by == 0:
            raise MemoryError
        return 1 // (self.by + 1) * v_t, v_n
