"""Executors of large requests: this process, as many others as there are cores, or a
Dask cluster.

Large requests are computed in tasks whose results do not depend on the executor, to the
last digit. `using` is written around a computation and is no argument of it:

    with geomech.workers.using(4):
        study.tables.compute_field()
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator

from geomech.runs.backend import at_most, cores, fastest
from geomech.runs.executors import Cluster, Executor, Processes
from geomech.runs.runner import runner, use_runner
from rft.core.checks import in_range
from rft.core.refusal import Refusal

__all__ = ["using"]

MOST_PROCESSES = 1024


@contextlib.contextmanager
def using(count: int | None = None, scheduler: str | None = None) -> Iterator[None]:
    """Compute large requests in the body of the statement by ``count`` processes, by
    default one per core, or on the Dask cluster of the ``scheduler`` at an address such
    as "tcp://10.0.0.1:8786".

    Processes start when a request turns out to be worth it. Refusal for wrong
    arguments, and at once for a scheduler that does not answer.

    Examples
    --------
    >>> import geomech
    >>> with geomech.workers.using(1):
    ...     A = geomech.study("three-link-viscous", grid=9).tables.fitted
    ...
    >>> A.A.shape
    (3, 2, 9, 9)
    """
    executor = _executor(count, scheduler)
    back_end = getattr(executor, "back_end", fastest())
    try:
        with (
            at_most(back_end),
            use_runner(dataclasses.replace(runner(), executor=executor)),
        ):
            yield
    finally:
        if executor:
            executor.close()


def _executor(count: int | None, scheduler: str | None) -> Executor | None:
    """Return the executor of these options; None for this process alone."""
    if count is not None:
        in_range("``workers``", count, 1, MOST_PROCESSES, whole=True)
    if scheduler is not None:
        if count is not None:
            raise Refusal(
                "``workers`` are processes of this machine, and ``scheduler`` has "
                "its own workers",
                instead="give one of the two",
            )
        return Cluster(scheduler)
    n_processes = int(count or cores())
    if n_processes == 1:
        return None
    return Processes(n_processes)
