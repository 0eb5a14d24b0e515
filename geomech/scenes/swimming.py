"""The reader of scenes with a gait: values that apply to the whole scene, and the short form of a swimmer."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from geomech.core.errors import choose
from geomech.scenes import reader
from geomech.scenes.frames import framed
from geomech.scenes.key import spellings
from geomech.scenes.model import SHORT, SWIMMER, Scene
from geomech.scenes.sections import sections_of
from geomech.scenes.sizes import Sizes
from geomech.systems import KINDS as SYSTEMS
from geomech.systems.base import System
from geomech.systems.capabilities import solver_of
from geomech.systems.framed import NAME as FITTED
from geomech.tiers.base import Numerics
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
        section = sections_of(Scene)["gait"].section
        gait = reader.read_section(
            dataclasses.replace(source, files=[]), "gait", tables["gait"], section
        )
        system = reader.read_sections(Scene, {"system": _system(tables, name)}, source)[
            "system"
        ]
        source.sizes.all_used()
        system, numerics = _with_numerics(system, tables.get("numerics", {}), source)
        files = tuple(
            file for file in source.files if file != getattr(system, "file", None)
        )  # which it knows itself
        return Scene(
            framed(system, numerics) if fitted else system,
            gait,
            numerics,
            name,
            text,
            files,
        )


def _system(tables: Mapping, name: str) -> dict:
    """Return the table of the system. [medium], [body] and [[effects]] are short for a swimmer, in whose own table they
    may also stand."""
    table = tables.get("system", {"kind": SHORT})
    short, kind = (
        {part: tables[part] for part in SWIMMER if part in tables},
        table.get("kind"),
    )
    if short and isinstance(kind, str) and kind in {*SYSTEMS} - {SHORT}:
        raise Refusal(
            f"a {kind} takes no {sorted(short)[0]!r}",
            where=name,
            instead="drop it, or the table [system]",
        )
    return short | dict(table)


def _with_numerics(
    system: System, given: Mapping, source: reader.Source
) -> tuple[System, Numerics]:
    """Return a system with its part of [numerics], and the rest, for the tiers."""
    place = f"{source.name}: [numerics]"
    solver_class = NoSolver if (solver := solver_of(system)) is None else type(solver)
    names = [
        field.name
        for kind in (Numerics, solver_class)
        for field in dataclasses.fields(kind)
    ]
    by_solver = {True: {}, False: {}}
    for key, value in given.items():
        if key not in spellings(Numerics) and key not in spellings(solver_class):
            choose(f"{place} key", key, names)
        by_solver[key in spellings(solver_class)][key] = value
    if by_solver[True]:
        system = system.with_solver(
            reader.build(source, place, by_solver[True], solver_class)
        )
    return system, reader.build(source, place, by_solver[False], Numerics)


def solvers() -> list[type]:
    """Return the classes of keys in [numerics] that systems have beside those of the tiers."""
    return [
        *dict.fromkeys(
            type(kind.solver)
            for kind in SYSTEMS.values()
            if getattr(kind, "solver", None)
        )
    ]


def _without_fitted(tables: Mapping, name: str) -> tuple[dict, bool]:
    """Return the tables without the minimum-perturbation frame, and whether they request it: above all tables, in
    [body] or in [system]."""
    scene_frame, places = tables.get("frame"), []

    def plain(place: str, table):
        if not isinstance(table, Mapping) or table.get("frame") != FITTED:
            return table
        places.append(place)
        return {k: v for k, v in table.items() if k != "frame"}

    tables = {
        k: plain(k, v) if k in ("body", "system") else v
        for k, v in plain("", tables).items()
    }
    if "body" in tables.get("system", {}):
        tables["system"] = {
            **tables["system"],
            "body": plain("system.body", tables["system"]["body"]),
        }
    if places and scene_frame not in (None, FITTED):
        raise Refusal(
            f"[{places[0]}] frame = {FITTED!r}, but the scene's frame = {scene_frame!r}",
            where=name,
            instead="keep one",
        )
    return tables, bool(places)
