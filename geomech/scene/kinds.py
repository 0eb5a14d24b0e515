"""Parts of one's own in all registries: laws, bodies, gaits, effects, systems, tiers, ways to draw, file formats.

They come in by `register`, by a file that the person at the keyboard names (`--plugin FILE.py`, `load_file`), or by an
installed package, whose entry point of that name in the group of a registry is loaded when somebody first asks for it
(`geomech.core.entry_points`). What a scene file says never runs code by itself.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import sys
import sysconfig
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

from geomech import gaits, systems, tiers  # noqa: F401  which have registries
from geomech.io.files import read_text
from geomech.systems.functions import class_from_function
from rft.refusal import Refusal, formatted, located
from rft.registry import REGISTRIES, Registry, home, place

LARGEST = 1_000_000  # bytes of a file of one's own
PLUGIN = "geomech_plugin_"  # begins the names of modules made of such files
Part = TypeVar("Part")
_code: dict[str, str] = {}  # digests of sources, by module
_files: dict[str, str] = {}  # file of one's own: its text
INSTALLED = tuple({sysconfig.get_path(name) + os.sep for name in ("stdlib", "platstdlib", "purelib", "platlib")})


def register(part: Any = None, /, **members: Any) -> Any:
    """Let users name a part of their own, by its ``law`` (a force law), ``name`` (a tier) or ``kind`` (all else), and return
    it: also a decorator. Of the same module and name it takes the place of the one before.

    members: of a function ``velocity(alpha, alphadot)`` that is a system: its ``joints``, and ``kind``, ``length`` and
    ``traits`` if they are not its name, 1 and `Traits()`. Its other parameters are keys of a scene. ValueError for what is
    no part, no frozen dataclass where a class, or has a name that is taken."""
    if part is None and members:
        return lambda function: register(function, **members)
    for name, value in members.items():
        setattr(part, name, value)
    registered = class_from_function(part) if isinstance(part, types.FunctionType) and hasattr(part, "joints") else part
    registry_of(registered).register(registered)
    return part


def registry_of(part: Any) -> Registry:
    """Return the registry that a part is for; ValueError if there is none."""
    for registry in REGISTRIES.values():
        if registry.admits(part):
            return registry
    raise Refusal(
        f"{formatted(part)} is no part of a scene",
        because="a law is a class with `traction`, a body one with `motion`, `joints` and `length`, "
        "a system one with `velocity`, `joints`, `length` and `traits`, or a function velocity(alpha, "
        "alphadot) with joints = ...; a gait is derived from geomech.gaits.Gait, an effect "
        "from rft.effects.Effect",
        instead="a tier is a geomech.tiers.Tier",
    )


def load_file(path: str | Path) -> list[str]:
    """Run a Python file and register the classes in it that have a ``law`` or ``kind`` of their own; their names. Refusal,
    one line, if it cannot be run, has none, or one cannot be registered; then none is."""
    if not isinstance(path, (str, Path)):
        raise Refusal("a file of one's own is named by text", value=path)
    path = Path(path)
    place = f"--plugin {path}"
    if path.suffix != ".py":
        raise Refusal("give a Python file, with a name that ends in .py", where=place)
    try:
        text = read_text(path, LARGEST)
    except (OSError, ValueError) as error:
        raise Refusal(getattr(error, "strerror", None) or "it is not text", where=place) from None
    return _load(path, str(path.resolve()), text)


def load_text(whole: str, text: str) -> None:
    """`load_file` of a file that need not be on this machine, by its whole name and its text, as `files` has them."""
    if _files.get(whole) != text:
        _load(Path(whole), whole, text)


def _module(whole: str) -> str:
    """Name of the module made of a file."""
    return f"{PLUGIN}{Path(whole).stem}_{hashlib.sha256(whole.encode()).hexdigest()[:8]}"


def _load(path: Path, whole: str, text: str) -> list[str]:
    place, name = f"--plugin {path}", _module(whole)
    module = types.ModuleType(name)
    module.__file__ = str(path)
    with _all_or_none(name, module):
        before = _named()
        _run(place, path, text, module)
        for part in vars(module).values():
            if isinstance(part, type) and part.__module__ == name and {"law", "kind"} & {*vars(part)}:
                with located(place):
                    register(part)
        own = [n for (_, n), part in _named().items() if home(part) == name and before.get((_, n)) is not part]
        if not own:
            raise Refusal('no class in it has a law = "..." (a force law) or kind = "..." (all else)', where=place)
    _code[name], _files[whole] = hashlib.sha256(text.encode()).hexdigest(), text
    return sorted(own)


def _named() -> dict[tuple[str, str], Any]:
    return {(group, name): part for group, registry in REGISTRIES.items() for name, part in registry.items()}


@contextlib.contextmanager
def _all_or_none(name: str, module: types.ModuleType) -> Iterator[None]:
    """The module is known while it is used; if it fails everything is as before."""
    before, parts = sys.modules.get(name), {group: dict(registry) for group, registry in REGISTRIES.items()}
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
        exec(compile(text, str(path), "exec", dont_inherit=True), module.__dict__)  # leaves no cache beside the file
    except (Exception, SystemExit) as error:
        lines = [f.lineno for f in _frames(error) if f.filename == str(path)]
        line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
        raise Refusal(type(error).__name__, where=f"{place}, line {line}", because=str(error)) from error


def _frames(error: BaseException):
    import traceback

    return traceback.extract_tb(error.__traceback__)


def code() -> dict[str, str]:
    """Return digests of the sources of classes of one's own, by module, and of what these modules take from others beside
    them: what was computed by other code is not resumed."""
    found, modules = {}, {home(part) for part in _own()}
    packages = {name.partition(".")[0] for name in modules}
    while left := sorted(modules - {*found}):
        for name in left:
            found[name] = _code.setdefault(name, _source(name))
            values = vars(sys.modules[name]).values() if name in sys.modules else ()
            used = {x.__name__ if isinstance(x, types.ModuleType) else getattr(x, "__module__", None) for x in values}
            modules |= {other for other in used if isinstance(other, str) and _is_beside(other, packages)}
    return found


def _source(module: str) -> str:
    """Return a digest of a module's file; of one without a file a number that no other process has."""
    file = getattr(sys.modules.get(module), "__file__", None)
    try:
        return hashlib.sha256(Path(file or "").read_bytes()).hexdigest()
    except OSError:
        return secrets.token_hex()


def _is_beside(module: str, packages: set[str]) -> bool:
    """Whether a module is of the same packages, or of no installed one."""
    if module.partition(".")[0] in ("rft", "geomech") or module not in sys.modules:
        return False
    file = getattr(sys.modules[module], "__file__", None)
    return module.partition(".")[0] in packages or bool(file and not file.startswith(INSTALLED))


def files() -> tuple[tuple[str, str], ...]:
    """(whole name, text) of the files of one's own whose classes scenes may name."""
    modules = {home(part) for part in _own()}
    return tuple((whole, text) for whole, text in _files.items() if _module(whole) in modules)


def registered() -> tuple[tuple[str, str], ...]:
    """(module, name) of the parts of one's own from elsewhere."""
    return tuple(place(part) for part in _own() if not home(part).startswith(PLUGIN))


def _own() -> list[Any]:
    return [part for registry in REGISTRIES.values() for part in registry.own]
