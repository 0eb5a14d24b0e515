"""What the tests of workers give away: functions of a module that loads at once."""

import os
import signal
import time
import warnings
from pathlib import Path

from geomech.core.errors import UnitWarning
from geomech.runs.runner import runner
from rft.balance import backend
from rft.core.refusal import Refusal
from rft.core.threads import thread_count


def doubled(by, x):
    return by * x


def who(_, x):
    """What a worker is, and what it may take."""
    return (
        os.getpid(),
        thread_count(None, 100),
        backend._preferred.get(),
        runner().executor,
        x,
    )


def meets(folder, x):
    """What a worker is, once a second one has come to the same place."""
    (Path(folder) / str(os.getpid())).touch()
    until = time.monotonic() + 60
    while len(list(Path(folder).iterdir())) < 2 and time.monotonic() < until:
        time.sleep(0.01)
    return who(None, x)


def dies(folder, x):
    """Ends its own process, by its own id, the first time that it is asked for 3."""
    mark = Path(folder) / "died"
    if x == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def always_dies(_, x):
    os.kill(os.getpid(), signal.SIGKILL)


def fails(_, x):
    if x == 2:
        raise Refusal("no such thing as 2")
    return x


class Odd(Exception):
    """An error that cannot be sent."""

    def __init__(self, a, b):
        super().__init__(f"{a} and {b}")


def fails_oddly(_, x):
    raise Odd(1, x)


def notes(_, x):
    warnings.warn("an angle of 400 rad is large", UnitWarning, stacklevel=1)
    print("said aside")
    return x


def waits(folder, x):
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(60)
