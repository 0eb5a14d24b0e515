"""Digests of values by content: the keys under which results of tasks are stored."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import types
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np

PLAIN = type(None), bool, int, float, complex, str, bytes, PurePath, Enum, range, slice


class Undigestible(TypeError):
    """A value without digestible content, such as a generator."""


def digest(*values: Any) -> bytes:
    """Return the SHA-256 of values to the last digit: of arrays, numbers, text,
    containers, functions, and of objects by their fields.

    Dataclass fields that are not compared are left out, as are cached properties.
    `Undigestible` for other objects."""
    hashed = hashlib.sha256()
    try:
        _feed(hashed.update, values)
    except RecursionError:
        raise Undigestible("a value that contains itself") from None
    return hashed.digest()


def _feed(update: Callable[[bytes], None], x: Any) -> None:
    if isinstance(x, PLAIN):
        text = repr(x).encode(errors="surrogateescape")
        update(b"%s:%d:%s;" % (type(x).__qualname__.encode(), len(text), text))
    elif isinstance(x, np.ndarray | np.generic):
        _feed_array(update, np.asarray(x))
    elif isinstance(x, type):
        update(f"type {_name(x)};".encode())
    elif isinstance(x, tuple | list | Mapping | set | frozenset):
        _feed_items(update, x)
    else:
        _feed(update, _contents(x))


def _feed_array(update: Callable[[bytes], None], x: np.ndarray) -> None:
    if x.dtype.hasobject:
        _feed(update, ("objects", x.shape, x.ravel().tolist()))
    else:
        update(f"array {x.dtype.str}{x.shape}".encode())
        update(np.ascontiguousarray(x).tobytes())


def _feed_items(update: Callable[[bytes], None], x: Any) -> None:
    items = x
    if isinstance(x, Mapping):
        items = [part for pair in x.items() for part in pair]
    elif isinstance(x, set | frozenset):
        items = sorted(map(digest, x))
    update(f"{_name(type(x))} {len(items)}(".encode())
    if set(map(type, items)) == {float}:  # 100,000 amplitudes take 0.6 s one by one
        update(b"floats" + np.array(items).tobytes())
        items = ()
    for item in items:
        _feed(update, item)
    update(b")")


def _contents(x: Any) -> tuple:
    """Return everything that a function or an object consists of, its type first."""
    if isinstance(x, functools.partial):
        return "partial", x.func, x.args, x.keywords
    if isinstance(x, types.MethodType):
        return "method", x.__self__, x.__func__
    if isinstance(x, types.FunctionType):
        return _code(x)
    if isinstance(x, types.BuiltinFunctionType | np.ufunc):
        module = getattr(x, "__module__", "")
        owner = getattr(x, "__self__", None)
        return "built in", module, owner, x.__name__
    if isinstance(x, types.ModuleType):
        return "module", x.__name__
    if isinstance(x, types.CodeType):
        return "code", x.co_code, x.co_names, x.co_consts
    kind = type(x)
    if dataclasses.is_dataclass(kind):
        fields = [f.name for f in dataclasses.fields(x) if f.compare]
        return "object", kind, *(getattr(x, name) for name in fields)
    if isinstance(vars(kind).get("__reduce__"), types.FunctionType):
        return "object", kind, x.__reduce__()
    if kind.__module__ != "builtins" and hasattr(x, "__dict__"):
        cached = _cached_properties(kind)
        attributes = {}
        for name, value in sorted(vars(x).items()):
            if name not in cached:
                attributes[name] = value
        return "object", kind, attributes
    raise Undigestible(f"the content of a {kind.__qualname__} cannot be determined")


def _cached_properties(kind: type) -> set[str]:
    """Return the names of the cached properties of a class."""
    names = set()
    for base in kind.__mro__:
        for name, attribute in vars(base).items():
            if isinstance(attribute, functools.cached_property):
                names.add(name)
    return names


def _code(f: types.FunctionType) -> tuple:
    """Return the name of a function of a module; for a function defined inside another
    also its code and its closure."""
    if "<" not in f.__qualname__:
        return "function", _name(f)
    cells = [cell.cell_contents for cell in f.__closure__ or ()]
    return "function", _name(f), f.__code__, f.__defaults__, f.__kwdefaults__, cells


def _name(x: Any) -> str:
    return f"{x.__module__}.{x.__qualname__}"
