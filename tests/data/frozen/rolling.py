"""A velocity of one's own, as slow as a large one would be, that leaves word of the process which computes it."""

import os
import pathlib
import time

import numpy as np


def velocity(alpha, alphadot):
    if alpha.size > 1000:
        pathlib.Path(f"process-{os.getpid()}").touch()
        time.sleep(0.6)
    turn = 0.1 * np.cos(alpha[..., 0] - alpha[..., 1]) * (alphadot[..., 0] + alphadot[..., 1])
    return np.stack([0.2 * np.sin(alpha[..., 1]) * alphadot[..., 0], 0.1 * alphadot[..., 1] + 0 * turn, turn], -1)
