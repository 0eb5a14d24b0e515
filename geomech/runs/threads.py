"""One thread for the linear algebra below NumPy and SciPy."""

from __future__ import annotations

import contextlib
import functools
import os
from collections.abc import Iterator

from threadpoolctl import ThreadpoolController

from geomech.runs import THREAD_VARIABLES


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS and LAPACK take one thread in the body of the statement.

    The matrices here are small: more threads only wait for each other in busy loops,
    and sums that they share end in other digits. The number that there was is restored.
    It belongs to the process: of several threads of Python that ask for it at once, the
    first decides."""
    with _libraries().limit(limits=1, user_api="blas"):
        yield


@functools.cache
def _libraries() -> ThreadpoolController:
    """Return what controls the libraries, which takes milliseconds to find.

    SciPy has a library of its own, which is found only once it is loaded. Where the
    environment says one thread, as in commands and workers, it will take one when it is
    needed, and is not loaded for this: that takes longer than many tasks."""
    import numpy  # noqa: F401

    if any(os.environ.get(name) != "1" for name in THREAD_VARIABLES):
        import scipy.linalg  # noqa: F401

    return ThreadpoolController()
