"""Laws, bodies, gaits, effects and systems by the names that scenes give them: those built in, and those of one's own.

One's own come in by `register`, by a file that the person at the keyboard names (`--plugin FILE.py`, `load_file`), or by an
installed package, whose entry point of that name in a group of `FAMILIES` is loaded when a scene first asks for it. What
a scene file says never runs code by itself.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import importlib.metadata
import os
import secrets
import sys
import sysconfig
import types
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, TypeVar

from geomech.core.errors import SceneError, choose, short
from geomech.gaits import KINDS as GAITS
from geomech.gaits import Gait
from geomech.io.files import read_text
from geomech.systems import KINDS as SYSTEMS
from geomech.systems.swimmer import PARTS
from rft.effects import Effect

LARGEST = 1_000_000  # bytes of a file of one's own
PLUGIN = "geomech_plugin_"  # begins the names of modules made of such files
Part = TypeVar("Part", bound=type)


class Family(NamedTuple):
    """What a scene names classes of. key: of its table, and of the class, that holds the name. kinds: the classes by name.
    base: what one of them is derived from, or else has, so that it is told from those of other families."""

    key: str
    kinds: dict[str, type]
    base: type | None
    has: str
    told: str


FAMILIES = {  # by the group of entry points
    "geomech.effects": Family(*PARTS["effects"], Effect, "apply", "an effect"),
    "geomech.gaits": Family("kind", GAITS, Gait, "unit", "a gait"),
    "geomech.systems": Family("kind", SYSTEMS, None, "velocity", "a system"),
    "geomech.media": Family(*PARTS["medium"], None, "traction", "a law"),
    "geomech.bodies": Family(*PARTS["body"], None, "motion", "a body"),
}
BUILT_IN = {group: frozenset(family.kinds) for group, family in FAMILIES.items()}
NAMELESS = {Effect.kind}
_code: dict[str, str] = {}  # digests of sources, by module
_files: dict[str, str] = {}  # file of one's own: its text
INSTALLED = tuple({sysconfig.get_path(name) + os.sep for name in ("stdlib", "platstdlib", "purelib", "platlib")})


def register(part: Part) -> Part:
    """Let scenes name a class of one's own, by its ``law`` (a force law) or ``kind`` (all else), and return it: also a
    decorator. Of the same module and name it takes the place of the one before. ValueError if it is no frozen dataclass, no
    part of a scene, or its name is taken."""
    group = _group(part)
    _put(part, group, getattr(part, FAMILIES[group].key, None))
    return part


def _group(part) -> str:
    for group, family in FAMILIES.items():
        if isinstance(part, type) and (issubclass(part, family.base) if family.base else hasattr(part, family.has)):
            return group
    raise ValueError(
        f"{short(part)} is no part of a scene: a law is a class with `traction`, a body one with `motion`, `joints` and "
        "`length`, a system one with `velocity`, `joints`, `length` and `traits`; a gait is derived from geomech.gaits.Gait, "
        "an effect from rft.effects.Effect"
    )


def _put(part: type, group: str, name: object) -> None:
    """Into its family, under that name, unless that must not be."""
    family = FAMILIES[group]
    who = f"{family.told} of one's own, {part.__name__},"
    if not dataclasses.is_dataclass(part) or not part.__dataclass_params__.frozen:
        raise ValueError(f"{who} must be a value: put @dataclass(frozen=True) above it")
    if not isinstance(name, str) or not name.strip() or name in NAMELESS:
        raise ValueError(f'{who} has no name: give the class {family.key} = "..."')
    if family.key in {f.name for f in dataclasses.fields(part)}:
        raise ValueError(f"{who} has {family.key} as a parameter: write {family.key} = {name!r} without a type")
    if name in BUILT_IN[group]:
        raise ValueError(f"{who} is named {name!r}, as one that is built in: give it another name")
    there = family.kinds.get(name, part)
    if (there.__module__, there.__qualname__) != (part.__module__, part.__qualname__):
        raise ValueError(f"{who} is named {name!r}, as the {there.__qualname__} of {there.__module__}: rename one")
    family.kinds[name] = part


def load_file(path: str | Path) -> list[str]:
    """Run a Python file and register the classes in it that have a ``law`` or ``kind`` of their own; their names. SceneError,
    one line, if it cannot be run, has none, or one cannot be registered; then none is."""
    if not isinstance(path, (str, Path)):
        raise SceneError(f"a file of one's own is named by text, got {short(path)}")
    path = Path(path)
    place = f"--plugin {path}"
    if path.suffix != ".py":
        raise SceneError(f"{place}: give a Python file, with a name that ends in .py")
    try:
        text = read_text(path, LARGEST)
    except (OSError, ValueError) as error:
        raise SceneError(f"{place}: {getattr(error, 'strerror', None) or 'it is not text'}") from None
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
        before = _names()
        _run(place, path, text, module)
        for part in vars(module).values():
            if isinstance(part, type) and part.__module__ == name and {"law", "kind"} & {*vars(part)}:
                with _said(place):
                    register(part)
        own = [n for _, n, part in _names() - before if part.__module__ == name]
        if not own:
            raise SceneError(f'{place}: no class in it has a law = "..." (a force law) or kind = "..." (all else)')
    _code[name], _files[whole] = hashlib.sha256(text.encode()).hexdigest(), text
    return sorted(own)


def _names() -> set[tuple[str, str, type]]:
    return {(group, name, part) for group, family in FAMILIES.items() for name, part in family.kinds.items()}


@contextlib.contextmanager
def _all_or_none(name: str, module: types.ModuleType) -> Iterator[None]:
    """The module is known while it is used; if it fails everything is as before."""
    before, kinds = sys.modules.get(name), {group: dict(family.kinds) for group, family in FAMILIES.items()}
    sys.modules[name] = module  # where dataclasses look their types up
    try:
        yield
    except BaseException:
        sys.modules.pop(name)
        if before is not None:
            sys.modules[name] = before
        for group, family in FAMILIES.items():
            family.kinds.clear()
            family.kinds.update(kinds[group])
        raise


def _run(place: str, path: Path, text: str, module: types.ModuleType) -> None:
    try:
        exec(compile(text, str(path), "exec", dont_inherit=True), module.__dict__)  # leaves no cache beside the file
    except (Exception, SystemExit) as error:
        lines = [f.lineno for f in _frames(error) if f.filename == str(path)]
        line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
        raise SceneError(f"{place}, line {line}: {type(error).__name__}: {error}") from error


def _frames(error: BaseException):
    import traceback

    return traceback.extract_tb(error.__traceback__)


@contextlib.contextmanager
def _said(place: str) -> Iterator[None]:
    try:
        yield
    except ValueError as error:
        raise SceneError(f"{place}: {error}") from None


def offered(group: str) -> dict[str, list[importlib.metadata.EntryPoint]]:
    """What installed packages offer of a family, by name, not loaded."""
    found: dict[str, list] = {}
    for entry in importlib.metadata.entry_points(group=group):
        found.setdefault(entry.name, []).append(entry)
    return found


def unloaded(group: str) -> tuple[dict[str, str], dict[str, str]]:
    """Names that installed packages offer and no scene has asked for yet, with their packages: new ones, and those that are
    refused because one of that name is built in."""
    packages = {name: " and ".join(map(_package, entries)) for name, entries in offered(group).items()}
    known = FAMILIES[group].kinds
    new = {name: package for name, package in packages.items() if name not in known}
    return new, {name: package for name, package in packages.items() if name in BUILT_IN[group]}


def choose_kind(place: str, word: object, kinds: dict[str, type]) -> str:
    """word if it names one of the kinds, or one that an installed package offers, which is then loaded; else SceneError."""
    group = next((g for g, family in FAMILIES.items() if family.kinds is kinds), None)
    if group is None or (isinstance(word, str) and word in kinds):
        return choose(place, word, kinds)
    packages = offered(group)
    try:
        name = choose(place, word, [*kinds, *packages])
    except SceneError as error:
        own = " (or add --plugin FILE.py, a file that has it)" if isinstance(word, str) else ""
        raise SceneError(f"{error}{own}") from None
    entries = packages[name]
    who = " and ".join(_package(entry) for entry in entries)
    if len(entries) > 1:
        raise SceneError(f"{place}: {name!r} is offered by {who}: uninstall one")
    try:
        part = entries[0].load()
    except (Exception, SystemExit) as error:
        raise SceneError(f"{place}: {name!r} of {who} cannot be loaded: {type(error).__name__}: {error}") from error
    with _said(f"{place}: {name!r} of {who}"):
        if _group(part) != group:
            raise ValueError(f"{part.__name__} is not {FAMILIES[group].told}")
        if getattr(part, FAMILIES[group].key, name) != name:
            raise ValueError(f"its {FAMILIES[group].key} is {getattr(part, FAMILIES[group].key)!r}: give both one name")
        _put(part, group, name)
    return name


def _package(entry: importlib.metadata.EntryPoint) -> str:
    return f"the package {entry.dist.name} {entry.dist.version}" if entry.dist else f"the package of {entry.value}"


def code() -> dict[str, str]:
    """Return digests of the sources of classes of one's own, by module, and of what these modules take from others beside
    them: what was computed by other code is not resumed."""
    found, modules = {}, {part.__module__ for part in _own()}
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
    modules = {part.__module__ for part in _own()}
    return tuple((whole, text) for whole, text in _files.items() if _module(whole) in modules)


def registered() -> tuple[tuple[str, str], ...]:
    """(module, name) of the classes of one's own from elsewhere."""
    return tuple((p.__module__, p.__qualname__) for p in _own() if not p.__module__.startswith(PLUGIN))


def _own() -> list[type]:
    return [p for group, family in FAMILIES.items() for name, p in family.kinds.items() if name not in BUILT_IN[group]]
