"""Intruder scenes: a body of given outline that moves in a given way through the vertical plane, and how their TOML is read."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core import summary
from geomech.core.errors import SceneError, choose, named, number, short
from geomech.io.files import read_text
from geomech.scene import solid
from geomech.scene.columns import columns
from geomech.scene.intruding import Intruding, as_table, checked_tables, located
from geomech.scene.parts import LARGEST, build, kind_in
from rft.ground import KINDS as EFFECTS
from rft.ground import GroundEffect
from rft.plates import (
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
from rft.plates.loads import ORDER
from rft.plates.stress import COEFFICIENTS, GRAZING

RADIANS = 3.2  # a table of angles within this is likely not in degrees


class Intrusion(NamedTuple):
    """Forces along a motion. t (T,) s; pose and twist (T, 3) as `rft.plates.loads` has them; force (T, 2) N; moment (T,) N m
    about the frame's origin; power (T,) W of the grains on the body. With effects that have a weight the
    force is that of both."""

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray

    def __repr__(self) -> str:
        (x, z), span = self.force.T, summary.span
        forces = f"force x {span(x)} N, z {span(z)} N; moment {span(self.moment)} N m; power {span(self.power)} W"
        return f"Intrusion({len(self.t)} poses, t {span(self.t)} s; {forces})"


@dataclass(frozen=True)
class IntruderScene(Intruding):
    """A stress map, a body and its motion, and effects. elements: of the outline. files: those that the scene names. text: its
    TOML."""

    medium: PlateStress
    intruder: Shape
    motion: Motion
    elements: int = 100
    effects: tuple[GroundEffect, ...] = ()
    name: str = "scene"
    text: str = field(default="", repr=False, compare=False)
    files: tuple[str, ...] = field(default=(), repr=False, compare=False)

    parts = "elements"
    takes = {
        "medium": (PlateStress, "a stress map such as StressMap(zeta=0.24)"),
        "intruder": (Shape, "a body such as RoundRod(radius=0.0127, width=0.1)"),
        "motion": (Motion, "a motion such as Drag(depth=0.05)"),
    }
    ladder = (12, 25, 50, 100, 200, 400, 3200)

    def __post_init__(self):
        with named(self.name):
            self._check()
            number("elements", self.elements, 1, 5000, whole=True)
            object.__setattr__(self, "elements", int(self.elements))
            _ = self.outline

    @property
    def outline(self) -> Outline:
        return self.intruder.outline(self.elements)

    @property
    def count(self) -> int:
        return self.outline.elements

    def used(self, count: int) -> int:
        return self.intruder.outline(count).elements

    @property
    def size(self) -> float:
        return float(np.ptp(self.outline.points, axis=0).max())

    @property
    def per_part(self) -> float:
        return 6e-8 * (2 if self.medium.tension == "cut" and not self.outline.closed else 1)

    @property
    def finer(self) -> tuple[int, ...]:
        """Twice as many; of first order also three times, for what one changes alone may be small by chance."""
        return (2,) if self.order == 2 else (2, 3)

    @property
    def order(self) -> int:
        return ORDER[self.medium.tension]

    def run(self, elements: int | None = None) -> Intrusion:
        """Forces along the motion, with as many elements if told so."""
        outline = self.outline if elements is None else self.intruder.outline(elements)
        t, pose, twist = self.motion.trajectory(outline)
        found: Loads = loads(self.medium, outline, pose, twist, self.effects)
        return Intrusion(t, pose, twist, self.weighed(found.force), found.moment, found.power(twist))

    def table(self, found: Intrusion) -> dict[str, np.ndarray]:
        """The columns of a result: t, angle (or x and z, if the body does not turn about a hub), force_x, force_z, moment."""
        place = {"angle": found.pose[:, 2]} if self.motion.turns else {"x": found.pose[:, 0], "z": found.pose[:, 1]}
        force = {"force_x": found.force[:, 0], "force_z": found.force[:, 1]}
        return {"t": found.t, **place, **force, "moment": found.moment}

    def tables(self) -> dict:
        """Of a scene file that reads the same; SceneError for measured drags and paths, which are files of their own."""
        if not isinstance(self.medium, StressMap) or MOTIONS["csv"] is type(self.motion):
            told = "plate drags and paths are CSV files: write the scene that names them by hand"
            raise SceneError(f"{self.name}: {told}")
        return {
            "medium": dataclasses.asdict(self.medium),
            "intruder": as_table(self.intruder, SHAPES),
            "motion": as_table(self.motion, MOTIONS),
            "numerics": {"elements": self.elements},
        } | ({"effects": [as_table(e, EFFECTS) for e in self.effects]} if self.effects else {})


def from_tables(tables: Mapping, name: str = "scene", text: str = "") -> Intruding:
    """The intruder scene of the tables of a TOML text; SceneError if they make none."""
    rest = checked_tables(tables, name)
    if tables["intruder"].get("kind") in [*solid.KINDS]:
        return solid.from_tables(tables, name, text, read_medium)
    place, folder, files = (lambda key: f"{name}: [{key}]"), Path(name).absolute().parent, []
    with_file = lambda key: located(tables[key], folder, files)
    for key in rest["numerics"]:
        choose(f"{place('numerics')} key", key, ("elements",))
    return IntruderScene(
        medium=read_medium(place("medium"), with_file("medium")),
        intruder=_intruder(place("intruder"), with_file("intruder")),
        motion=_motion(place("motion"), with_file("motion")),
        effects=rest["effects"],
        **rest["numerics"],
        name=name,
        text=text,
        files=tuple(files),
    )


def _intruder(place: str, table: dict) -> Shape:
    kind = SHAPES[kind_in(place, table, "kind", SHAPES | solid.KINDS)]
    rest = {k: v for k, v in table.items() if k != "kind"}
    if "file" in rest and "points" in (f.name for f in dataclasses.fields(kind)):
        if "points" in rest:
            raise SceneError(f"{place}: points are given twice: keep one of points and file")
        x, z = columns(place, rest.pop("file"), ("x", "z")).values()
        rest["points"] = np.stack([x, z], -1).tolist()
    return build(place, rest, kind)


def _motion(place: str, table: dict) -> Motion:
    name = kind_in(place, table, "kind", MOTIONS)
    rest = {k: v for k, v in table.items() if k != "kind"}
    if name == "csv":
        if {*rest} != {"file"}:
            told = "a motion of kind 'csv' takes 'file' and nothing else: a table t,x,z, and angle (rad) if it turns"
            raise SceneError(f"{place}: {told}")
        rest = {k: v.tolist() for k, v in columns(place, rest["file"], ("t", "x", "z"), ("angle",)).items()}
    return build(place, rest, MOTIONS[name])


@dataclass(frozen=True)
class _Choices:
    """What any medium may be given besides its numbers.

    zeta (-): strength of the medium, which multiplies what its other keys say. grazing (rad): between motion and face, over
    which the stress on the face of a closed body rises, 0 for a jump. tension (-): "keep", or "cut" for no stress on faces
    that the map pulls on.
    """

    zeta: float = 1.0
    grazing: float = GRAZING
    tension: str = "keep"
    angles = ("grazing",)


def read_medium(place: str, table: Mapping) -> PlateStress:
    """Of a [medium] of the vertical plane: a name, nine coefficients, or a file, TOML or of plate drags; with zeta,
    grazing(_deg), tension. Without any of the first three it is the generic set."""
    own = {f.name for f in dataclasses.fields(_Choices)} | {"grazing_deg"}
    given = {k.replace("-", "m"): v for k, v in table.items() if k not in own}  # B-11 is Bm11
    if twice := [key for key in COEFFICIENTS if "m" in key and {key, key.replace("m", "-")} <= {*table}]:
        raise SceneError(f"{place}: {twice[0]} is {twice[0].replace('m', '-')}: keep one")
    for key in given:
        choose(f"{place} key", key, ["name", "file", *COEFFICIENTS, *sorted(own)])
    choices = build(place, {k: v for k, v in table.items() if k in own}, _Choices)
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
        base = build(place, given, StressMap)
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
