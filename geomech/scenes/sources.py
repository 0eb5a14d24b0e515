"""Digests of the sources of code of one's own: what other code computed is not resumed."""

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

INSTALLED = tuple(
    {
        sysconfig.get_path(name)
        for name in ("stdlib", "platstdlib", "purelib", "platlib")
    }
)
UNKNOWN = (
    secrets.token_hex()
)  # of a module without a file, as of a notebook: no other process has it


def digests(modules: Iterable[str], texts: dict[str, bytes]) -> dict[str, str]:
    """Return digests of modules, and of those of the same packages, or of no installed one, that these import, by name.

    texts: of modules as they were first read, to which this adds. A module counts wherever it is imported: its functions may
    stand in containers, its constants in formulas, and a function may import it only when it is called."""
    result: dict[str, str] = {}
    packages = {name.partition(".")[0] for name in modules}
    remaining = sorted(modules)
    while remaining:
        for name in remaining:
            text = texts.get(name) or texts.setdefault(name, _text(name))
            result[name] = hashlib.sha256(text).hexdigest() if text else UNKNOWN
        imported = {
            other for name in remaining for other in _imported(name, texts[name])
        }
        remaining = sorted(
            name for name in imported - {*result} if _is_own(name, packages)
        )
    return result


def _imported(module: str, text: bytes) -> Iterator[str]:
    """Yield the names of all that may be modules in the import statements of a module."""
    try:
        nodes = ast.walk(ast.parse(text))
    except (SyntaxError, ValueError):  # it is compiled code
        return
    package = module.split(".")
    package = package if (_file(module) or "").endswith("__init__.py") else package[:-1]
    for node in nodes:
        base: list[str] = []
        if isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] * bool(node.level) + [
                node.module or ""
            ] * bool(node.module)
        if isinstance(node, ast.Import | ast.ImportFrom):
            for alias in node.names:
                yield from _with_packages(".".join([*base, alias.name]))


def _with_packages(module: str) -> Iterator[str]:
    """Return a module's name after those of the packages it is in."""
    return itertools.accumulate(module.split("."), "{}.{}".format)


def _file(module: str) -> str | None:
    """Return the file of a module, which is not loaded for that; None if there is none."""
    if module in sys.modules:
        return getattr(sys.modules[module], "__file__", None)
    path = spec = None
    for name in _with_packages(module):
        if (spec := PathFinder.find_spec(name, path)) is None or (
            path := spec.submodule_search_locations
        ) is None:
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
    if package in ("rft", "geomech") or not (file := _file(module)):
        return False
    return package in packages or not any(
        Path(file).is_relative_to(folder) for folder in INSTALLED
    )
