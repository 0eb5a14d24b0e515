"""Scenes of walking: a robot, the clock of its legs and the grains it walks on, and how their TOML is read."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from geomech.core.errors import SceneError, choose, named, short
from geomech.core.summary import part
from geomech.scene import solid
from geomech.scene.intruder import _intruder, read_medium
from geomech.scene.intruding import located, of_effects
from geomech.scene.parts import build, kind_in
from rft.ground import KINDS as EFFECTS
from rft.ground import GroundEffect
from rft.meshes import Screw, Solid, Spatial
from rft.plates import SHAPES, PlateStress, Shape, StressMap
from rft.walking import ROBOTS, Fineness, Mjcf, Robot, Screws, Tripod, Walker

TABLES = ("medium", "robot", "gait", "numerics", "effects")
KINDS = {kind for kind, effect in EFFECTS.items() if effect.walks}
LAWS = ("planar", "3d")
OF_THREE = {"xi_n", "density", "internal_friction", "surface_friction"}  # keys of a [medium] of three dimensions alone
CURE = "see 'geomech scenes --show xplorer'"


@dataclass(frozen=True)
class WalkerScene:
    """A stress map or a law of three dimensions, a robot and its gait, and effects on the ground. numerics: how finely. text:
    its TOML. files: those that the scene names."""

    medium: PlateStress | Spatial
    robot: Robot
    gait: Tripod
    effects: tuple[GroundEffect, ...] = ()
    numerics: Fineness = field(default_factory=Fineness)
    name: str = "scene"
    text: str = field(default="", repr=False, compare=False)
    files: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self):
        with named(self.name):
            for what, kind in (("numerics", Fineness), ("name", str), ("text", str)):
                if not isinstance(getattr(self, what), kind):
                    raise ValueError(f"{what} must be {kind.__name__}, got {short(getattr(self, what))}")
            if not (isinstance(self.files, tuple) and all(isinstance(x, str) for x in self.files)):
                raise ValueError(f"files must be a tuple of names, got {short(self.files)}")
            object.__setattr__(self, "effects", self.walker.effects)
            self.robot.check(self.numerics.elements)

    @property
    def engine(self) -> str:
        """What computes it, where nothing else is asked for."""
        spatial = isinstance(self.robot, Mjcf | Screws) or isinstance(self.medium, Spatial)
        return self.numerics.engine or ("mujoco" if spatial else "planar")

    @property
    def walker(self) -> Walker:
        return Walker(self.robot, self.gait, self.medium, self.effects)

    def told(self) -> list[str]:
        """Lines about the robot, its clock, the law and the engine, and which effects are on and off."""
        robot, gait, medium = (part(type(x).__name__, x) for x in (self.robot, self.gait, self.medium))
        lines = [f"{self.name}: {robot}", f"gait: {gait}", f"medium: {medium}", f"engine: {self.engine}"]
        off = [kind for kind in sorted(KINDS) if kind not in [e.kind for e in self.effects]]
        return [*lines, *of_effects(self.effects), "off, not evaluated: " + (", ".join(off) or "none")]

    def tables(self) -> dict:
        """Those of a scene file that reads the same; SceneError for measured drags, which are files of their own."""
        if not isinstance(self.medium, StressMap | Spatial):
            raise SceneError(f"{self.name}: plate drags are CSV files: write the scene that names them by hand")
        kind = lambda thing, kinds: {"kind": next(k for k, v in kinds.items() if v is type(thing))}
        if isinstance(self.robot, Mjcf):
            robot = _plain(self.robot)
        else:
            robot, part = kind(self.robot, ROBOTS) | _plain(self.robot), getattr(self.robot, self.robot.part)
            robot[self.robot.part] = kind(part, SHAPES | solid.KINDS) | _plain(part)
        tables = {
            "medium": _plain(self.medium),
            "robot": robot,
            "gait": _plain(self.gait),
            "numerics": _plain(self.numerics),
        }
        if self.effects:
            tables["effects"] = [{"kind": e.kind} | _plain(e) for e in self.effects]
        return tables


def _plain(thing) -> dict:
    """Its fields, as they stand in a file."""
    names = {f.name for f in dataclasses.fields(thing) if f.init}
    fields = dataclasses.asdict(thing).items()
    return {k: list(v) if isinstance(v, tuple) else v for k, v in fields if v is not None and k in names}


def from_tables(tables: Mapping, name: str = "scene", text: str = "") -> WalkerScene:
    """The scene of the tables of a TOML text; SceneError if they make none."""
    for key in tables:
        choose(f"{name}: table", key, TABLES)
    for key in ("medium", "robot", "gait", "numerics"):
        if not isinstance(tables.get(key, {} if key == "numerics" else None), Mapping):
            told = "is missing: add it" if key not in tables else "must be a table"
            raise SceneError(f"{name}: the table [{key}] {told}, {CURE}")
    files: list[str] = []
    at = lambda table: located(table, Path(name).absolute().parent, files)
    with named(name):
        return WalkerScene(
            medium=_medium(f"{name}: [medium]", at(tables["medium"]), tables["robot"].get("kind")),
            robot=_robot(name, tables["robot"], at),
            gait=build(f"{name}: [gait]", _gait(name, tables["gait"]), Tripod),
            effects=tuple(_effects(name, tables.get("effects", []))),
            numerics=build(f"{name}: [numerics]", dict(tables.get("numerics", {})), Fineness),
            name=name,
            text=text,
            files=tuple(files),
        )


def _medium(place: str, table: dict, robot) -> PlateStress | Spatial:
    """A stress map, as of outlines, or the law of three dimensions, as of meshes: where law = "3d", or what tells its
    strength is of that alone, or, if no law is named, for a robot on screws."""
    law = choose(f"{place} law", table.pop("law"), LAWS) if "law" in table else None
    if law == "3d" or (law is None and ({*table} & OF_THREE or robot == "screws")):
        return solid.read_medium(place, table, read_medium)[0]
    return read_medium(place, table)


def _robot(name: str, table: Mapping, at) -> Robot:
    place, rest = f"{name}: [robot]", dict(table)
    if "mjcf" in rest:
        return _machine(place, rest, at)
    kind = ROBOTS[kind_in(place, rest, "kind", ROBOTS)]
    del rest["kind"]
    part, names = kind.part, [f.name for f in dataclasses.fields(kind)]
    for key in rest:
        choose(f"{place} key", key, names)
    if not rest.get(part) or not isinstance(rest[part], Mapping):
        raise SceneError(f"{place} is a robot without {kind.parts}: add the table [robot.{part}], {CURE}")
    made = _part(f"{name}: [robot.{part}]", at(rest.pop(part)), kind)
    needed = {f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING} - {part}
    if lacking := sorted(needed - {*rest}):
        raise SceneError(f"{place} has no {', '.join(lacking)}: add it, {CURE}")
    with named(place):
        return kind(**{part: made}, **{k: tuple(v) if isinstance(v, list) else v for k, v in rest.items()})


def _part(place: str, table: dict, robot: type[Robot]) -> Shape | Solid:
    """What a robot moves by: an outline, or a screw, which need not say its kind."""
    if robot is not Screws:
        kind_in(place, dict(table), "kind", SHAPES)
        return _intruder(place, table)
    choose(f"{place} kind", table.pop("kind", "screw"), ("screw",))
    return build(place, table, Screw)


def _machine(place: str, table: dict, at) -> Mjcf:
    """A robot of an MJCF file."""
    if (kind := table.pop("kind", "mjcf")) != "mjcf":
        raise SceneError(f"{place}: kind = {short(kind)} has sizes, mjcf a file: drop one")
    names = [f.name for f in dataclasses.fields(Mjcf) if f.init]
    for key in table:
        choose(f"{place} key", key, names)
    if not table.get("geoms"):
        raise SceneError(f"{place} is a robot without legs: give geoms, a list of those that touch the ground")
    if isinstance(table["mjcf"], str):
        table["mjcf"] = at({"file": table["mjcf"]})["file"]
    with named(place):
        return Mjcf(**{k: tuple(v) if isinstance(v, list) else v for k, v in table.items()})


def _gait(name: str, table: Mapping) -> dict:
    if "frequency" not in table:
        raise SceneError(f"{name}: [gait] has no frequency: add it, in Hz")
    return dict(table)


def _effects(name: str, effects) -> list[GroundEffect]:
    if not (isinstance(effects, list) and all(isinstance(e, Mapping) for e in effects)):
        raise SceneError(f"{name}: effects must be tables [[effects]], one for each")
    place, made = f"{name}: [[effects]]", []
    for table in effects:
        kind = EFFECTS[kind_in(place, dict(table), "kind", KINDS)]
        made.append(build(place, {k: v for k, v in table.items() if k != "kind"}, kind))
    return made
