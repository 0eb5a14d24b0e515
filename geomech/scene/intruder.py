"""Intruder scenes: a body of given outline that moves in a given way through the vertical plane, and how their TOML is read."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.errors import SceneError, choose, named, number, short
from geomech.files import read_text
from geomech.scene.columns import columns
from geomech.scene.read import LARGEST, _build, _kind
from rft.vertical import (
    MOTIONS,
    SHAPES,
    VERTICAL,
    Loads,
    Motion,
    Outline,
    PlateDrags,
    PlateStress,
    Shape,
    StressMap,
    loads,
)
from rft.vertical.loads import ORDER
from rft.vertical.stress import COEFFICIENTS, GRAZING

TABLES = ("medium", "intruder", "motion", "numerics")
RADIANS = 3.2  # a table of angles within this is likely not in degrees


class Intrusion(NamedTuple):
    """Forces along a motion. t (T,) s; pose and twist (T, 3) as `rft.vertical.loads` has them; force (T, 2) N; moment (T,) N m
    about the frame's origin; power (T,) W of the grains on the body."""

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray


@dataclass(frozen=True)
class IntruderScene:
    """A stress map, a body and its motion. elements: of the outline. files: those that the scene names. text: its TOML."""

    medium: PlateStress
    intruder: Shape
    motion: Motion
    elements: int = 100
    name: str = "scene"
    text: str = field(default="", repr=False, compare=False)
    files: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self):
        with named(self.name):
            for what, kind, such in (
                ("medium", PlateStress, "a stress map such as StressMap(zeta=0.24)"),
                ("intruder", Shape, "a body such as RoundRod(radius=0.0127, width=0.1)"),
                ("motion", Motion, "a motion such as Drag(depth=0.05)"),
                ("name", str, "text"),
                ("text", str, "text"),
            ):
                if not isinstance(getattr(self, what), kind):
                    raise ValueError(f"{what} must be {such}, got {short(getattr(self, what))}")
            if not (isinstance(self.files, tuple) and all(isinstance(x, str) for x in self.files)):
                raise ValueError(f"files must be a tuple of names, got {short(self.files)}")
            number("elements", self.elements, 1, 5000, whole=True)
            object.__setattr__(self, "elements", int(self.elements))
            _ = self.outline

    @property
    def outline(self) -> Outline:
        return self.intruder.outline(self.elements)

    @property
    def order(self) -> int:
        """Of the error in 1/elements."""
        return ORDER[self.medium.tension]

    def run(self, elements: int | None = None) -> Intrusion:
        """Forces along the motion, with as many elements if told so."""
        outline = self.outline if elements is None else self.intruder.outline(elements)
        t, pose, twist = self.motion.course(outline)
        found: Loads = loads(self.medium, outline, pose, twist)
        return Intrusion(t, pose, twist, found.force, found.moment, found.power(twist))


def table(scene: IntruderScene, found: Intrusion) -> dict[str, np.ndarray]:
    """The columns of a result: t, angle (or x and z, if the body does not turn about a hub), force_x, force_z, moment."""
    place = {"angle": found.pose[:, 2]} if scene.motion.turns else {"x": found.pose[:, 0], "z": found.pose[:, 1]}
    return {"t": found.t, **place, "force_x": found.force[:, 0], "force_z": found.force[:, 1], "moment": found.moment}


def from_tables(tables: Mapping, name: str = "scene", text: str = "") -> IntruderScene:
    """The intruder scene of the tables of a TOML text; SceneError if they make none."""
    for key in tables:
        choose(f"{name}: table", key, TABLES)
    for key in TABLES:
        if not isinstance(tables.get(key, {} if key == "numerics" else None), Mapping):
            told = "is missing: add it" if key not in tables else "must be a table"
            raise SceneError(f"{name}: the table [{key}] {told}, see 'geomech scenes --show c-leg'")
    place, folder, files = (lambda key: f"{name}: [{key}]"), Path(name).absolute().parent, []
    located = lambda key: _located(tables[key], folder, files)
    numerics = dict(tables.get("numerics", {}))
    for key in numerics:
        choose(f"{place('numerics')} key", key, ("elements",))
    return IntruderScene(
        medium=read_medium(place("medium"), located("medium")),
        intruder=_intruder(place("intruder"), located("intruder")),
        motion=_motion(place("motion"), located("motion")),
        **numerics,
        name=name,
        text=text,
        files=tuple(files),
    )


def as_tables(scene: IntruderScene) -> dict:
    """The tables of a scene file that reads the same; SceneError for measured drags and paths, which are files of their own."""
    if not isinstance(scene.medium, StressMap) or MOTIONS["csv"] is type(scene.motion):
        raise SceneError(f"{scene.name}: plate drags and paths are CSV files: write the scene that names them by hand")
    body = {"kind": next(k for k, v in SHAPES.items() if v is type(scene.intruder))} | dataclasses.asdict(
        scene.intruder
    )
    motion = {"kind": next(k for k, v in MOTIONS.items() if v is type(scene.motion))} | dataclasses.asdict(scene.motion)
    if "points" in body:
        body["points"] = [list(p) for p in body["points"]]
    numerics = {"elements": scene.elements}
    return {"medium": dataclasses.asdict(scene.medium), "intruder": body, "motion": motion, "numerics": numerics}


def _located(table: Mapping, folder: Path, files: list[str]) -> dict:
    """The table with its file, if it names one, looked for from the scene's folder, and noted."""
    if not isinstance(table.get("file"), str):
        return dict(table)
    files.append(str(folder / table["file"]))
    return {**table, "file": files[-1]}


def _intruder(place: str, table: dict) -> Shape:
    kind = SHAPES[_kind(place, table, "kind", SHAPES)]
    rest = {k: v for k, v in table.items() if k != "kind"}
    if "file" in rest and "points" in (f.name for f in dataclasses.fields(kind)):
        if "points" in rest:
            raise SceneError(f"{place}: points are given twice: keep one of points and file")
        x, z = columns(place, rest.pop("file"), ("x", "z")).values()
        rest["points"] = np.stack([x, z], -1).tolist()
    return _build(place, rest, kind)


def _motion(place: str, table: dict) -> Motion:
    name = _kind(place, table, "kind", MOTIONS)
    rest = {k: v for k, v in table.items() if k != "kind"}
    if name == "csv":
        if {*rest} != {"file"}:
            told = "a motion of kind 'csv' takes 'file' and nothing else: a table t,x,z, and angle (rad) if it turns"
            raise SceneError(f"{place}: {told}")
        rest = {k: v.tolist() for k, v in columns(place, rest["file"], ("t", "x", "z"), ("angle",)).items()}
    return _build(place, rest, MOTIONS[name])


@dataclass(frozen=True)
class _Choices:
    """What any medium may be given besides its numbers; zeta multiplies what it has."""

    zeta: float = 1.0
    grazing: float = GRAZING
    tension: str = "keep"
    angles = ("grazing",)


def read_medium(place: str, table: Mapping) -> PlateStress:
    """Of a [medium] of the vertical plane: a name, nine coefficients, or a file, TOML or of plate drags; with zeta,
    grazing(_deg), tension. Without any of the first three it is the generic set."""
    own = {f.name for f in dataclasses.fields(_Choices)} | {"grazing_deg"}
    given = {k.replace("-", "m"): v for k, v in table.items() if k not in own}  # B-11 is Bm11
    for key in given:
        choose(f"{place} key", key, ["name", "file", *COEFFICIENTS, *sorted(own)])
    choices = _build(place, {k: v for k, v in table.items() if k in own}, _Choices)
    if len({*given} & {"name", "file"}) + bool({*given} & {*COEFFICIENTS}) > 1:
        raise SceneError(f"{place}: keep one of 'name', 'file' and the nine coefficients")
    if "name" in given:
        base = VERTICAL[choose(f"{place} name", given["name"], VERTICAL)].stress
    elif "file" in given:
        base = _of_file(place, given["file"])
    else:
        if given and (lacking := [c for c in COEFFICIENTS if c not in given]):
            raise SceneError(
                f"{place} has no {', '.join(lacking)}: give all nine coefficients in N/cm^3, or none and zeta"
            )
        base = _build(place, given, StressMap)
    with named(place):
        if not 0 < choices.zeta < float("inf"):
            raise ValueError(f"zeta must be a number above 0, got {short(choices.zeta)}")
        said = {k.removesuffix("_deg") for k in table} & {"grazing", "tension"}
        return dataclasses.replace(base, zeta=base.zeta * choices.zeta, **{k: getattr(choices, k) for k in said})


def plate_rows(place: str, file) -> np.ndarray:
    """(4, N), plate drags of a CSV file: beta, gamma in degrees, alpha_x, alpha_z in N/cm^3."""
    found = columns(place, file, (("beta", "beta_deg"), ("gamma", "gamma_deg"), "alpha_x", "alpha_z"))
    rows = np.stack(list(found.values()))
    if rows.size and np.abs(rows[:2]).max() < RADIANS:
        raise SceneError(f"{place}: {Path(file).name}: beta and gamma look like radians: give degrees")
    if rows.size and (largest := np.abs(rows[:2]).max()) > 360:
        raise SceneError(
            f"{place}: {Path(file).name}: beta and gamma must be from -360 to 360 degrees, got {largest:g}"
        )
    return rows


def plate_drags(place: str, file) -> PlateDrags:
    """The stress map through the plate drags of a CSV file (`plate_rows`)."""
    beta, gamma, a_x, a_z = plate_rows(place, file)
    with named(f"{place}: {Path(file).name}"):
        return PlateDrags(*map(tuple, (np.radians(beta), np.radians(gamma), a_x, a_z)))


def load_medium(medium: str) -> PlateStress:
    """Of a name of the catalogue, a TOML file with a table [medium] (or nothing but one), or a CSV file of plate drags."""
    if medium in VERTICAL:
        return VERTICAL[medium].stress
    if Path(medium).suffix not in (".toml", ".csv") and not Path(medium).exists():
        choose("medium", medium, VERTICAL)
    return _of_file("medium", medium)


def _of_file(place: str, file) -> PlateStress:
    """Of a TOML file, if its name ends so, or a CSV file of plate drags."""
    if not isinstance(file, str) or Path(file).suffix == ".csv":
        return plate_drags(place, file)
    path = Path(file)
    try:
        tables = tomllib.loads(read_text(path, LARGEST))
    except (OSError, ValueError, RecursionError) as error:
        reason = getattr(error, "strerror", None) or "it is not TOML"
        told = f"{reason}; give a TOML or CSV file or one of {', '.join(VERTICAL)}"
        raise SceneError(f"{place}: cannot read {file!r}: {told}") from None
    table = tables.get("medium", tables)
    if not isinstance(table, Mapping):
        raise SceneError(f"{place}: {path.name}: medium must be a table [medium], got {type(table).__name__}")
    if isinstance(table.get("file"), str):
        table = {**table, "file": str(path.absolute().parent / table["file"])}
        if not table["file"].endswith(".csv"):
            raise SceneError(
                f"{place}: {path.name} names another file, {Path(table['file']).name}: copy the coefficients"
            )
    return read_medium(f"{place}: {path.name}:", table)
