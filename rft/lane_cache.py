"""Where the compiled code of `rft.lanes` is kept: one file, which is believed only if it is what was written.

numba takes what its own cache holds for granted: one that is empty, cut short or changed stops what runs, or computes
something else, and one that cannot be written throws away what has been compiled. Here such a file is set aside, with a
note, and the code is compiled anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import re
import secrets
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from numba.core.caching import FunctionCache
from numba.core.serialize import dumps

from rft.compiled import STAMP, Note

DAMAGED = ".damaged"  # added to the name of a file that is set aside


class CodeFile:
    """A file of compiled code, for one Python, numba and processor: the stamp of its sources and the code's checksum, a line;
    the code. It has the methods that numba asks of a cache's file."""

    def __init__(self, folder: str, name: str):
        made_by = f"{sys.implementation.cache_tag}-numba{numba.__version__}-{llvmlite.binding.get_host_cpu_name()}"
        self.path = Path(folder) / f"{name}.{made_by}.code"

    def read(self) -> bytes | None:
        """Return the code; None if there is none of these sources. A damaged file is set aside."""
        try:
            raw = self.path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            return self.set_aside(error.strerror)
        head = re.match(rb"([0-9a-f]{16}) ([0-9a-f]{64})\n", raw)
        if head and head[1] != STAMP.encode():
            return None
        if not head or hashlib.sha256(body := raw[head.end() :]).hexdigest().encode() != head[2]:
            return self.set_aside("it is damaged")
        return body

    def load(self, key: tuple) -> Any:
        """Return what was saved under a key; None if nothing was."""
        if (body := self.read()) is None:
            return None
        saved, data = pickle.loads(body)
        return data if saved == key else None

    def save(self, key: tuple, data: Any) -> None:
        """Write the file whole, or leave it as it was; OSError if that cannot be."""
        body = dumps((key, data))
        part = self.path.with_name(f"{self.path.name}.{secrets.token_hex(8)}")
        try:
            part.write_bytes(f"{STAMP} {hashlib.sha256(body).hexdigest()}\n".encode() + body)
            os.replace(part, self.path)
        except BaseException:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)
            raise

    def flush(self) -> None:
        """Remove the file."""
        self.path.unlink(missing_ok=True)

    def set_aside(self, why: str) -> None:
        """Rename the file, and say so."""
        aside = self.path.with_name(self.path.name + DAMAGED)
        try:
            os.replace(self.path, aside)
        except FileNotFoundError:  # another process has
            return
        except OSError as error:
            told = f"it cannot be set aside ({error.strerror}): remove it"
        else:
            told = f"set aside as {aside.name}; it is made anew, python -m rft does that at once"
        warnings.warn(f"the compiled code in {self.path} is not taken, {why}: {told}", Note, stacklevel=1)


class CodeCache(FunctionCache):
    """numba's cache of a function, in a `CodeFile`; whatever goes wrong with it, the function is there."""

    def __init__(self, function: Callable, name: str):
        super().__init__(function)
        self._cache_file = self.file = CodeFile(self.cache_path, name)

    def load_overload(self, sig, target_context) -> Any:
        """Return the compiled code for a signature; None if it has to be compiled."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # undamaged, and yet nothing that LLVM or pickle can load
            return self.file.set_aside(f"it cannot be loaded ({type(error).__name__})")

    def save_overload(self, sig, data) -> None:
        """Keep what is compiled, if that can be."""
        try:
            super().save_overload(sig, data)
        except Exception as error:
            why = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
            cure = "make room there, or set NUMBA_CACHE_DIR"
            told = f"compiled code is not kept in {self.file.path.parent}: {why}; {cure}"
            warnings.warn(told, Note, stacklevel=1)


def kept(function: Any, name: str) -> Any:
    """Return a function of numba's that keeps its compiled code from run to run, where there is a folder for it: beside its
    source, the user's, or where NUMBA_CACHE_DIR points."""
    with contextlib.suppress(RuntimeError, AttributeError):  # none of these; or NUMBA_DISABLE_JIT compiles nothing
        function._cache = CodeCache(function.py_func, name)
    return function
