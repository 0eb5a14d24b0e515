"""Custom parts in all registries: laws, bodies, gaits, effects, systems, tiers, ways to draw, file formats.

They are added by `register`, by a file that the person at the keyboard names (`--plugin FILE.py`, `load_file`), or by
an installed package, whose entry point in the group of a registry is loaded when its name is first used
(`geomech.core.entry_points`). A scene file never runs code by itself.
"""

from __future__ import annotations

import contextlib
import hashlib
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

from geomech import gaits, systems, tiers  # noqa: F401  which have registries
from geomech.io.files import read_text
from geomech.scenes import sources
from geomech.systems.functions import class_from_function
from rft.core.refusal import Refusal, formatted, located
from rft.core.registry import REGISTRIES, Registry, home, place

LARGEST = 1_000_000  # bytes of a file of one's own
PLUGIN = "geomech_plugin_"  # begins the names of modules made of such files
Part = TypeVar("Part")
_texts: dict[str, bytes] = {}  # sources, by module
_files: dict[str, str] = {}  # file of one's own: its text


def register(part: Any = None, /, **members: Any) -> Any:
    """Let users name a part of their own, by its ``law`` (a force law), ``name`` (a tier) or ``kind`` (all else), and return
    it: also a decorator. Of the same module and name it takes the place of the one before.

    members: of a function ``velocity(alpha, alphadot)`` that is a system: its ``joints``, and ``kind``, ``length`` and
    ``traits`` if they are not its name, 1 and `Traits()`; of a function ``positions(alpha)`` that returns the poses of the
    links of a body: ``joints`` and ``lengths``. Other parameters are keys of a scene. ValueError for what is no part, no
    frozen dataclass where a class, or has a name that is taken.

    Examples
    --------
    >>> import numpy as np
    >>> import geomech
    >>> @geomech.register(joints=2)
    ... def drift(alpha, alphadot):
    ...     return np.stack([alphadot[..., 0] * np.sin(alpha[..., 1]), 0 * alpha[..., 0], 0 * alpha[..., 0]], -1)
    ...
    >>> table = geomech.study(drift, geomech.gaits.Circle(0.5)).displacement(tiers="direct")
    >>> table["net_distance"].values.round(3)
    array([[0.761]])
    """
    if part is None and members:
        return lambda function: register(function, **members)
    for name, value in members.items():
        setattr(part, name, value)
    registered = (
        class_from_function(part)
        if isinstance(part, types.FunctionType) and hasattr(part, "joints")
        else part
    )
    registry_of(registered).register(registered)
    return part


def registry_of(part: Any) -> Registry:
    """Return the registry that a part is for; Refusal if there is none."""
    for registry in REGISTRIES.values():
        if registry.admits(part):
            return registry
    raise Refusal(
        f"{formatted(part)} is no part of a scene",
        because="a law is a class with `traction`, a body one with `motion`, `joints` and `length`, "
        "a system one with `velocity`, `joints`, `length` and `traits`, or a function velocity(alpha, "
        "alphadot) with joints = ...; a function positions(alpha) with joints and lengths = ... is a body; a gait "
        "is derived from geomech.gaits.Gait, an effect from rft.effects.Effect",
        instead="a tier is a geomech.tiers.Tier",
    )


def load_file(path: str | Path) -> list[str]:
    """Run a Python file, register the classes in it that have a ``law`` or ``kind`` of their own, and return their
    names. Refusal if it cannot be run, has none, or one cannot be registered; then none is."""
    if not isinstance(path, (str, Path)):
        raise Refusal("a file of one's own is named by text", value=path)
    path = Path(path)
    place = f"``plugin`` {path}"
    if path.suffix != ".py":
        raise Refusal("give a Python file, with a name that ends in .py", where=place)
    try:
        text = read_text(path, LARGEST)
    except (OSError, ValueError) as error:
        raise Refusal(
            getattr(error, "strerror", None) or "it is not text", where=place
        ) from None
    return _load(path, str(path.resolve()), text)


def load_text(full_name: str, text: str) -> None:
    """Load a file as `load_file` does from its full name and its text, as in `files`; it need not be on this
    machine."""
    if _files.get(full_name) != text:
        _load(Path(full_name), full_name, text)


def _module(full_name: str) -> str:
    """Return the name of the module made of a file."""
    return f"{PLUGIN}{Path(full_name).stem}_{hashlib.sha256(full_name.encode()).hexdigest()[:8]}"


def _load(path: Path, full_name: str, text: str) -> list[str]:
    place, name = f"``plugin`` {path}", _module(full_name)
    module = types.ModuleType(name)
    module.__file__ = str(path)
    with _all_or_none(name, module):
        before = _named()
        _run(place, path, text, module)
        for part in vars(module).values():
            if (
                isinstance(part, type)
                and part.__module__ == name
                and {"law", "kind"} & {*vars(part)}
            ):
                with located(place):
                    register(part)
        registered_names = [
            n
            for (_, n), part in _named().items()
            if home(part) == name and before.get((_, n)) is not part
        ]
        if not registered_names:
            raise Refusal(
                'no class in it has a law = "..." (a force law) or kind = "..." (all else)',
                where=place,
            )
    _texts[name], _files[full_name] = text.encode(), text
    return sorted(registered_names)


def _named() -> dict[tuple[str, str], Any]:
    return {
        (group, name): part
        for group, registry in REGISTRIES.items()
        for name, part in registry.items()
    }


@contextlib.contextmanager
def _all_or_none(name: str, module: types.ModuleType) -> Iterator[None]:
    """Add the module to `sys.modules` while it is used; on failure restore it and all registries."""
    before, parts = (
        sys.modules.get(name),
        {group: dict(registry) for group, registry in REGISTRIES.items()},
    )
    sys.modules[name] = module  # where dataclasses look their types up
    try:
        yield
    except BaseException:
        sys.modules.pop(name)
        if before is not None:
            sys.modules[name] = before
        for group, registry in REGISTRIES.items():
            registry.restore(parts.get(group, registry))
        raise


def _run(place: str, path: Path, text: str, module: types.ModuleType) -> None:
    try:
        exec(
            compile(text, str(path), "exec", dont_inherit=True), module.__dict__
        )  # leaves no cache beside the file
    except (Exception, SystemExit) as error:
        lines = [f.lineno for f in _frames(error) if f.filename == str(path)]
        line = (
            error.lineno
            if isinstance(error, SyntaxError)
            else lines[-1]
            if lines
            else None
        )
        raise Refusal(
            type(error).__name__, where=f"{place}, line {line}", because=str(error)
        ) from error


def _frames(error: BaseException):
    import traceback

    return traceback.extract_tb(error.__traceback__)


def code() -> dict[str, str]:
    """Return digests of the sources of custom classes, by module, and of modules that these use. Results computed by
    other code are not resumed."""
    return sources.digests({home(part) for part in _custom_parts()}, _texts)


def files() -> tuple[tuple[str, str], ...]:
    """Return (full name, text) of the custom files whose classes scenes may name."""
    modules = {home(part) for part in _custom_parts()}
    return tuple(
        (full_name, text)
        for full_name, text in _files.items()
        if _module(full_name) in modules
    )


def registered() -> tuple[tuple[str, str], ...]:
    """Return (module, name) of the custom parts that come from no such file."""
    return tuple(
        place(part) for part in _custom_parts() if not home(part).startswith(PLUGIN)
    )


def _custom_parts() -> list[Any]:
    return [part for registry in REGISTRIES.values() for part in registry.own]
