"""A velocity of one's own that leaves word of the process which computes it, and waits
there for a second one."""

import multiprocessing
import os
import pathlib
import time

import numpy as np


def velocity(alpha, alphadot):
    if alpha.size > 1000:
        pathlib.Path(f"process-{os.getpid()}").touch()
        until = time.monotonic() + 20
        while (
            multiprocessing.parent_process()
            and len(others()) < 2
            and time.monotonic() < until
        ):
            time.sleep(0.01)
    turn = (
        0.1
        * np.cos(alpha[..., 0] - alpha[..., 1])
        * (alphadot[..., 0] + alphadot[..., 1])
    )
    return np.stack(
        [
            0.2 * np.sin(alpha[..., 1]) * alphadot[..., 0],
            0.1 * alphadot[..., 1] + 0 * turn,
            turn,
        ],
        -1,
    )


def others():
    """Processes that have computed, but for the script's, which does the first two
    parts."""
    return [*pathlib.Path().glob("process-*")][1:]
