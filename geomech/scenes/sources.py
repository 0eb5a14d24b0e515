"""Digests of the sources of custom code: results that other code computed are not
resumed."""

from __future__ import annotations

import ast
import hashlib
import itertools
import secrets
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from importlib.machinery import PathFinder
from pathlib import Path

LIBRARY = tuple({sysconfig.get_path(name) for name in ("stdlib", "platstdlib")})
# Folders of installed packages, wherever they are: of this environment, of the user, of
# the system below an environment.
PACKAGES = {"site-packages", "dist-packages"}
# Digest of a module without a file, as of a notebook; no other process has it.
UNKNOWN = secrets.token_hex()


def digests(modules: Iterable[str], texts: dict[str, bytes]) -> dict[str, str]:
    """Return digests of modules, and of the modules that they import, by name. Imported
    modules count if they are of the same packages, or of no installed one.

    texts: sources of modules as they were first read, to which this adds. A module
    counts wherever it is imported: a function may import it only when it is called."""
    result: dict[str, str] = {}
    packages = {name.partition(".")[0] for name in modules}
    remaining = sorted(modules)
    while remaining:
        for name in remaining:
            text = texts.get(name) or texts.setdefault(name, _text(name))
            result[name] = hashlib.sha256(text).hexdigest() if text else UNKNOWN
        imported: set[str] = set()
        for name in remaining:
            imported.update(_imported_names(name, texts[name]))
        new = imported - {*result}
        remaining = sorted(name for name in new if _is_own(name, packages))
    return result


def _imported_names(module: str, text: bytes) -> Iterator[str]:
    """Yield the names in the import statements of a module that may be modules."""
    try:
        nodes = ast.walk(ast.parse(text))
    except (SyntaxError, ValueError):  # it is compiled code
        return
    package = module.split(".")
    if not (_file(module) or "").endswith("__init__.py"):
        package = package[:-1]
    for node in nodes:
        if not isinstance(node, ast.Import | ast.ImportFrom):
            continue
        base: list[str] = []
        if isinstance(node, ast.ImportFrom):
            if node.level:  # a relative import
                base += package[: len(package) + 1 - node.level]
            if node.module:
                base.append(node.module)
        for alias in node.names:
            yield from _with_packages(".".join([*base, alias.name]))


def _with_packages(module: str) -> Iterator[str]:
    """Yield the names of the packages in which a module is, then its own."""
    return itertools.accumulate(module.split("."), "{}.{}".format)


def _file(module: str) -> str | None:
    """Return the file of a module, without loading it; None if there is none."""
    if module in sys.modules:
        return getattr(sys.modules[module], "__file__", None)
    path = None
    spec = None
    for name in _with_packages(module):
        spec = PathFinder.find_spec(name, path)
        if spec is None:
            return None
        path = spec.submodule_search_locations
        if path is None:  # a module, in which there are no others
            break
    return spec.origin if spec and spec.name == module else None


def _text(module: str) -> bytes:
    try:
        return Path(_file(module) or "").read_bytes()
    except OSError:
        return b""


def _is_own(module: str, packages: set[str]) -> bool:
    """Return whether a module is of the same packages, or of no installed one."""
    package = module.partition(".")[0]
    if package in ("rft", "geomech"):
        return False
    file = _file(module)
    if not file:
        return False
    if package in packages:
        return True
    path = Path(file)
    in_library = any(path.is_relative_to(folder) for folder in LIBRARY)
    return not in_library and PACKAGES.isdisjoint(path.parts)
