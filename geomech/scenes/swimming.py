"""The reader of scenes with a gait: values that apply to the whole scene, and the short
form of a swimmer."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from geomech.core.errors import choose
from geomech.mathematics.systems import KINDS as SYSTEMS
from geomech.mathematics.systems.base import System
from geomech.mathematics.systems.capabilities import solver_of
from geomech.mathematics.systems.framed import NAME as FITTED
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes.format import reader
from geomech.scenes.format.key import spellings
from geomech.scenes.format.sections import sections_of
from geomech.scenes.format.sizes import Sizes
from geomech.scenes.frames import framed
from geomech.scenes.model import SHORT, SWIMMER, Scene
from rft.core.refusal import Refusal, located


@dataclasses.dataclass(frozen=True)
class NoSolver:
    """The part of [numerics] of a system that has none."""


def from_tables(tables: Mapping, name: str, text: str) -> Scene:
    """Return the scene of the tables of a TOML text; Refusal if they make none."""
    source = reader.Source(name, Scene.example)
    reader.check(Scene, tables, source)
    tables, fitted = _without_fitted(tables, name)
    source.sizes = Sizes(name, tables)
    with located(name):
        gait_section = sections_of(Scene)["gait"].section
        # A gait knows its file itself: it is none of the scene's files.
        gait_source = dataclasses.replace(source, files=[])
        gait = reader.read_section(gait_source, "gait", tables["gait"], gait_section)
        table = {"system": _system_table(tables, name)}
        system = reader.read_sections(Scene, table, source)["system"]
        source.sizes.check_all_used()
        system, numerics = _with_numerics(system, tables.get("numerics", {}), source)
        if fitted:
            system = framed(system, numerics)
        own_file = getattr(system, "file", None)  # which the system knows itself
        files = tuple(file for file in source.files if file != own_file)
        return Scene(system, gait, numerics, name, text, files)


def with_medium(scene: Scene, table: Mapping) -> Scene:
    """Return the scene of a swimmer with the medium of a table [medium] in place of its
    own, as `from_tables` does, but in a tenth of the time: all else is checked
    already. Refusal if the table makes no medium that the swimmer takes."""
    source = reader.Source(scene.name, Scene.example)
    with located(scene.name):
        medium = reader.read_section(source, "medium", table, SWIMMER["medium"])
        return scene.in_medium(medium)


def _system_table(tables: Mapping, name: str) -> dict:
    """Return the table of the system. [medium], [body] and [[effects]] are the short
    form of a swimmer; they may also stand in its table [system]."""
    table = tables.get("system", {"kind": SHORT})
    kind = table.get("kind")
    short = {part: tables[part] for part in SWIMMER if part in tables}
    if short and isinstance(kind, str) and kind in {*SYSTEMS} - {SHORT}:
        raise Refusal(
            f"a {kind} takes no {sorted(short)[0]!r}",
            where=name,
            instead="remove it, or the table [system]",
        )
    return short | dict(table)


def _with_numerics(
    system: System, given: Mapping, source: reader.Source
) -> tuple[System, Numerics]:
    """Return a system with its part of [numerics], and the rest, for the tiers."""
    place = f"{source.name}: [numerics]"
    solver = solver_of(system)
    solver_class = NoSolver if solver is None else type(solver)
    fields = dataclasses.fields(Numerics) + dataclasses.fields(solver_class)
    names = [field.name for field in fields]
    of_solver = {}
    of_tiers = {}
    for key, value in given.items():
        if key in spellings(solver_class):
            of_solver[key] = value
        else:
            if key not in spellings(Numerics):
                choose(f"{place} key", key, names)
            of_tiers[key] = value
    if of_solver:
        solver = reader.build(source, place, of_solver, solver_class)
        system = system.with_solver(solver)
    return system, reader.build(source, place, of_tiers, Numerics)


def solvers() -> list[type]:
    """Return the classes of the keys in [numerics] that only some systems have."""
    classes = []
    for kind in SYSTEMS.values():
        solver = getattr(kind, "solver", None)
        if solver and type(solver) not in classes:
            classes.append(type(solver))
    return classes


def _without_fitted(tables: Mapping, name: str) -> tuple[dict, bool]:
    """Return the tables without the minimum-perturbation frame, and whether they
    request it: above all tables, in [body], in [system] or in [system.body]."""
    scene_frame = tables.get("frame")
    tables = dict(tables)
    places = []
    if scene_frame == FITTED:
        places.append("")
        del tables["frame"]
    for part in ("body", "system"):
        if _requests_fitted(tables.get(part)):
            places.append(part)
            tables[part] = _without_frame(tables[part])
    system = tables.get("system", {})
    if _requests_fitted(system.get("body")):
        places.append("system.body")
        tables["system"] = {**system, "body": _without_frame(system["body"])}
    if places and scene_frame not in (None, FITTED):
        raise Refusal(
            f"[{places[0]}] frame = {FITTED!r}, but the scene's frame = "
            f"{scene_frame!r}",
            where=name,
            instead="keep one of them",
        )
    return tables, bool(places)


def _requests_fitted(table: Any) -> bool:
    return isinstance(table, Mapping) and table.get("frame") == FITTED


def _without_frame(table: Mapping) -> dict:
    return {key: value for key, value in table.items() if key != "frame"}
