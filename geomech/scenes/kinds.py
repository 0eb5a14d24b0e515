"""Custom parts in all registries: laws, bodies, gaits, effects, systems, tiers,
drawings, file formats.

They are added by `register`; by a file that the user names (`--plugin FILE.py`,
`load_file`); or by an installed package, whose entry point in the group of a registry
is loaded when its name is first used (`geomech.core.entry_points`). A scene file never
runs code by itself.
"""

from __future__ import annotations

import contextlib
import hashlib
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from geomech.io.files import read_text

# These have registries.
from geomech.mathematics import gaits, systems, tiers  # noqa: F401
from geomech.mathematics.systems.functions import class_from_function
from geomech.scenes import sources
from rft.core.refusal import Refusal, formatted, located
from rft.core.registry import REGISTRIES, Registry, home, place

LARGEST = 1_000_000  # bytes of a custom file
PLUGIN = "geomech_plugin_"  # first letters of the names of modules of such files
_sources: dict[str, bytes] = {}  # sources of modules, by name
_files: dict[str, str] = {}  # texts of custom files, by full name


def register(part: Any = None, /, **members: Any) -> Any:
    """Register a custom part under its name in scenes, and return it. The name is its
    ``law`` (a force law), ``name`` (a tier) or ``kind`` (all others). A part of the
    same module and name is replaced. Also a decorator.

    members: of a function. ``velocity(alpha, alphadot)`` is a system: it needs
    ``joints``, and ``kind``, ``length`` and ``traits`` if they are not its name, 1 and
    `Traits()`. ``positions(alpha)``, which returns the poses of the links of a body,
    needs ``joints`` and ``lengths``. Other parameters of the function are keys of a
    scene. ValueError for an object that is no part, a class that is no frozen
    dataclass, or a name that another part has.

    Examples
    --------
    >>> import numpy as np
    >>> import geomech
    >>> @geomech.register(joints=2)
    ... def drift(alpha, alphadot):
    ...     xi_x = alphadot[..., 0] * np.sin(alpha[..., 1])
    ...     return np.stack([xi_x, 0 * xi_x, 0 * xi_x], -1)
    ...
    >>> study = geomech.study(drift, geomech.mathematics.gaits.Circle(0.5))
    >>> table = study.displacement(tiers="direct")
    >>> table["net_distance"].values.round(3)
    array([[0.761]])
    """
    if part is None and members:
        return lambda function: register(function, **members)
    for name, value in members.items():
        setattr(part, name, value)
    kind = part
    if isinstance(part, types.FunctionType) and hasattr(part, "joints"):
        kind = class_from_function(part)
    registry_of(kind).register(kind)
    return part


def registry_of(part: Any) -> Registry:
    """Return the registry that a part is for; Refusal if there is none."""
    for registry in REGISTRIES.values():
        if registry.admits(part):
            return registry
    raise Refusal(
        f"{formatted(part)} cannot be a part of a scene",
        because="a law is a class with `traction`; a body is a class with `motion`, "
        "`joints` and `length`, or a function positions(alpha) with joints "
        "and lengths = ...; a system is a class with `velocity`, `joints`, "
        "`length` and `traits`, or a function velocity(alpha, alphadot) with "
        "joints = ...; a gait is derived from geomech.mathematics.gaits.Gait "
        "and an effect from rft.effects.Effect",
        instead="a tier is a geomech.mathematics.tiers.Tier",
    )


def load_file(path: str | Path) -> list[str]:
    """Run a Python file, register the classes in it that define a ``law`` or ``kind``,
    and return the names. Refusal if it cannot be run, has no such class, or one of them
    cannot be registered; then none is registered."""
    if not isinstance(path, (str, Path)):
        raise Refusal(
            "a file with your own parts must be given by its name", value=path
        )
    path = Path(path)
    place = f"``plugin`` {path}"
    if path.suffix != ".py":
        raise Refusal("give a Python file whose name ends in .py", where=place)
    try:
        text = read_text(path, LARGEST)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise Refusal(reason, where=place) from None
    return _load(path, str(path.resolve()), text)


def load_text(full_name: str, text: str) -> None:
    """Load a file as `load_file` does, but from its full name and its text, as `files`
    returns them. The file need not be on this machine."""
    if _files.get(full_name) != text:
        _load(Path(full_name), full_name, text)


def _module(full_name: str) -> str:
    """Return the name of the module of a file."""
    digest = hashlib.sha256(full_name.encode()).hexdigest()[:8]
    return f"{PLUGIN}{Path(full_name).stem}_{digest}"


def _load(path: Path, full_name: str, text: str) -> list[str]:
    place = f"``plugin`` {path}"
    module = types.ModuleType(_module(full_name))
    module.__file__ = str(path)
    with _all_or_none(module):
        before = _registered_parts()
        _run(place, path, text, module)
        for part in vars(module).values():
            if _is_part_of(module, part):
                with located(place):
                    register(part)
        names = []
        for key, part in _registered_parts().items():
            # The file may have called `register` itself.
            if home(part) == module.__name__ and before.get(key) is not part:
                _, name = key
                names.append(name)
        if not names:
            raise Refusal(
                'no class in it has a law = "..." (for a force law) or a kind = "..." '
                "(for other parts)",
                where=place,
            )
    _sources[module.__name__] = text.encode()
    _files[full_name] = text
    return sorted(names)


def _is_part_of(module: types.ModuleType, part: Any) -> bool:
    """Return whether an object is a class that a module defines as a part of scenes."""
    if not isinstance(part, type) or part.__module__ != module.__name__:
        return False
    return "law" in vars(part) or "kind" in vars(part)


def _registered_parts() -> dict[tuple[str, str], Any]:
    """Return all parts, by the group of their registry and their name in it."""
    parts = {}
    for group, registry in REGISTRIES.items():
        for name, part in registry.items():
            parts[group, name] = part
    return parts


@contextlib.contextmanager
def _all_or_none(module: types.ModuleType) -> Iterator[None]:
    """Add a module to `sys.modules`; on failure restore `sys.modules` and all
    registries."""
    name = module.__name__
    before = sys.modules.get(name)
    parts = {group: dict(registry) for group, registry in REGISTRIES.items()}
    sys.modules[name] = module  # where dataclasses look up their types
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
    """Run the text of a file in a module; Refusal with the line of an error."""
    try:
        # Unlike an import this leaves no cache beside the file.
        exec(compile(text, str(path), "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        raise Refusal(
            type(error).__name__,
            where=f"{place}, line {_line_of(error, path)}",
            because=str(error),
        ) from error


def _line_of(error: BaseException, path: Path) -> int | None:
    """Return the last line of a file that an error passed, None if it passed none."""
    import traceback

    if isinstance(error, SyntaxError):
        return error.lineno
    line = None
    for frame in traceback.extract_tb(error.__traceback__):
        if frame.filename == str(path):
            line = frame.lineno
    return line


def code() -> dict[str, str]:
    """Return digests of the sources of custom parts, and of the modules that these use,
    by module. Results that other code computed are not resumed."""
    return sources.digests({home(part) for part in _custom_parts()}, _sources)


def files() -> tuple[tuple[str, str], ...]:
    """Return (full name, text) of the custom files whose classes scenes may name."""
    modules = {home(part) for part in _custom_parts()}
    names = [name for name in _files if _module(name) in modules]
    return tuple((name, _files[name]) for name in names)


def registered() -> tuple[tuple[str, str], ...]:
    """Return (module, name) of the custom parts that come from no custom file."""
    parts = [part for part in _custom_parts() if not home(part).startswith(PLUGIN)]
    return tuple(map(place, parts))


def _custom_parts() -> list[Any]:
    parts: list[Any] = []
    for registry in REGISTRIES.values():
        parts += registry.own
    return parts
