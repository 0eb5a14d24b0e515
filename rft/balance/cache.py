"""Compiled kernels on disk, each under a digest of everything that it computes with.

numba's own cache depends on the file of the function alone: after a change of a formula
in another file, or with another law, it would return old code. The digest here covers
the code and the constants of every function that a kernel names, the versions of numba
and LLVM, and the processor. A file that is damaged, or cannot be read or written, is
ignored."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import linecache
import os
import pickle
import re
import secrets
import sys
import types
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.misc.appdirs import user_cache_dir

from rft.core.notes import warn
from rft.core.refusal import Refusal
from rft.formulas import simd, vectors

PACKAGE = Path(__file__).parents[1]  # all of rft
KNOWN = {
    "math",
    "numba",
    "numpy",
}  # packages whose functions numba has its own code for


def folder() -> Path:
    """Return the folder of compiled code: NUMBA_CACHE_DIR where that is set, else the
    user's own."""
    return Path(numba.config.CACHE_DIR or user_cache_dir("geomech")) / "rft"


class Cache(_Cache):
    """The compiled code of one function in one file, with the interface of numba's
    cache; no fault of the file keeps the function from running."""

    def __init__(self, function, *modules):
        self.key = digest(function, *modules)
        self.path = folder() / f"{self.key}.code"

    @property
    def cache_path(self) -> str:
        return str(self.path.parent)

    def read(self) -> bytes | None:
        """Return the code; None if there is none. A damaged file is renamed."""
        try:
            raw = self.path.read_bytes()
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            return self.rename(error.strerror)
        if hashlib.sha256(raw[32:]).digest() != raw[:32]:
            return self.rename("it is damaged")
        return raw[32:]

    def load_overload(self, sig, target_context) -> CompileResult | None:
        """Return the compiled code for a signature; None if it has yet to be
        compiled."""
        data = self.read()
        if data is None:
            return None
        target_context.refresh()
        try:
            saved, reduced = pickle.loads(data)
            if saved != str(sig):
                return None
            return CompileResult._rebuild(target_context, *reduced)
        except Exception as error:
            # An undamaged file may still be one that LLVM or pickle cannot load.
            return self.rename(f"it cannot be loaded ({type(error).__name__})")

    def save_overload(self, sig, data) -> None:
        """Write the compiled code at once (a part is never read); a note if it cannot
        be written."""
        body = dumps((str(sig), data._reduce()))
        part = self.path.with_name(f"{self.path.name}.{secrets.token_hex(8)}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(hashlib.sha256(body).digest() + body)
            os.replace(part, self.path)
        except OSError as error:
            cure = "free some disk space there, or set NUMBA_CACHE_DIR"
            warn(
                f"compiled code is not stored in {self.path.parent}: "
                f"{error.strerror}; {cure}"
            )
        finally:
            with contextlib.suppress(OSError):
                part.unlink()

    def rename(self, why: str) -> None:
        """Rename a file that cannot be used, with a note."""
        other = self.path.with_name(self.path.name + ".damaged")
        try:
            os.replace(self.path, other)
        except FileNotFoundError:  # another process has renamed it
            return
        except OSError as error:
            action = f"it cannot be renamed ({error.strerror}): remove it"
        else:
            action = (
                f"renamed to {other.name}; it is compiled again (at once with python "
                "-m rft)"
            )
        warn(f"the compiled code in {self.path} is not used because {why}: {action}")

    def enable(self) -> None:
        """Do nothing: the file is always used."""

    def disable(self) -> None:
        """Do nothing: the file is always used."""

    def flush(self) -> None:
        """Remove the file."""
        self.path.unlink(missing_ok=True)


def cached(kernel: Any, purpose: str) -> Any:
    """Return a kernel whose compiled code is stored on disk; print one line with its
    purpose if it has yet to be compiled."""
    kernel._cache = Cache(kernel.py_func)
    kernel.compile = _naming_faults(kernel.compile)
    if not kernel._cache.path.exists():
        print(f"compiling {purpose} (once, a few seconds)", file=sys.stderr)
    return kernel


def _naming_faults(compile_):
    """Return a kernel's ``compile`` that refuses a formula with a slip in one line, in
    place of the compiler's report."""

    @functools.wraps(compile_)
    def compiled(signature):
        try:
            return compile_(signature)
        except numba.core.errors.NumbaError as error:
            place, words = _fault(str(error))
        raise Refusal(
            f"{place} cannot be compiled",
            because=words,
            instead=f"{vectors.ALLOWED}; without @formula NumPy computes it",
        )

    return compiled


def _fault(report: str) -> tuple[str, str]:
    """Return the place of the innermost fault that a report of the compiler names, of a
    formula that is not ours if there is one, and the text of its line."""
    places = []
    for file, number in re.findall(r'File "([^"<]+)", line (\d+)', report):
        path = Path(file).absolute().resolve()
        ours = path.is_relative_to(PACKAGE)
        places.append((ours, str(path), int(number)))
    if not places:
        return "a formula", report.strip().partition("\n")[0]
    _, path, number = min(places, key=lambda place: place[0])
    lines = linecache.getlines(path)
    text = "".join(lines[number - 1 : number]).strip()
    name = _function_at("".join(lines), number)
    return f"{name} ({Path(path).name}, line {number})", text


def _function_at(source: str, number: int) -> str:
    """Return the name of the function around a line, with that of its class."""
    names: list[str] = []

    def visit(node: ast.AST, outer: tuple[str, ...]) -> None:
        for child in ast.iter_child_nodes(node):
            kinds = ast.FunctionDef | ast.ClassDef
            inside = isinstance(child, kinds) and (
                child.lineno <= number <= (child.end_lineno or child.lineno)
            )
            if inside:
                names[:] = [*outer, child.name]
                visit(child, tuple(names))

    with contextlib.suppress(SyntaxError):
        visit(ast.parse(source), ())
    return ".".join(names) or "a formula"


def digest(function, *modules) -> str:
    """Return a digest of the code and the constants of a function and, recursively, of
    every function that it names. modules: those whose whole source counts, as they
    define functions a second time for compiled code."""
    sources = vectors, simd, *modules
    parts = [Path(module.__file__).read_bytes() for module in sources]
    seen = set()

    def visit(x):
        x = getattr(x, "py_func", x)
        if isinstance(x, types.FunctionType):
            is_in_source = x.__module__ in (vectors.__name__, simd.__name__)
            if id(x) not in seen and not is_in_source:
                seen.add(id(x))
                visit_code(x.__code__, x)
                for cell in x.__closure__ or ():
                    visit(cell.cell_contents)
                visit(x.__defaults__)
        elif isinstance(x, type) and issubclass(x, tuple):
            # Compiled code refers to the module of a record's class.
            identity = x.__module__, x.__name__, getattr(x, "_fields", ())
            parts.append(repr(identity).encode())
            for name, value in sorted(vars(x).items()):
                if isinstance(value, types.FunctionType) and not name.startswith("_"):
                    parts.append(name.encode())
                    visit(value)
        elif isinstance(x, np.ndarray):
            parts.append(x.tobytes())
        elif isinstance(x, (int, float, str, tuple, type(None))):
            parts.append(repr(x).encode())

    def visit_code(code, function):
        parts.append(code.co_code)
        for constant in code.co_consts:
            if isinstance(constant, types.CodeType):
                visit_code(constant, function)
            else:
                parts.append(repr(constant).encode())
        named = [function.__globals__.get(name) for name in code.co_names]
        modules = [
            x
            for x in named
            if isinstance(x, types.ModuleType)
            and x.__name__.partition(".")[0] not in KNOWN
        ]
        for name, value in zip(code.co_names, named):
            parts.append(name.encode())
            visit(value)
            for module in modules:  # module.name
                visit(getattr(module, name, None))

    visit(function)
    processor = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    parts += [repr((numba.__version__, llvm.llvm_version_info, *processor)).encode()]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:32]
