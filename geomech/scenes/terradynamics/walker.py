"""Scenes of walking: a robot, the clock of its legs, and the grains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from geomech.scenes.format.sections import Each, Keys, OneOf
from geomech.scenes.terradynamics.intruder import OUTLINES
from geomech.scenes.terradynamics.intruding import check_files
from geomech.scenes.terradynamics.stress import SpatialKeys, StressKeys
from rft.core.refusal import Refusal, formatted, located
from rft.terradynamics.ground import GROUND_EFFECTS, GroundEffect
from rft.terradynamics.meshes import Screw, Spatial
from rft.terradynamics.plates import PlateStress
from rft.terradynamics.walking import (
    ROBOTS,
    Fineness,
    Flippers,
    Mjcf,
    PrintedGround,
    Robot,
    Screws,
    Tripod,
    Walker,
)

SLOPE = 'add [[effects]] with kind = "slope" and its angle'
KINDS = {kind: effect for kind, effect in GROUND_EFFECTS.items() if effect.walks}
KINDS[PrintedGround.kind] = PrintedGround
LAWS = {"planar": StressKeys, "3d": SpatialKeys}
# Keys that only a [medium] of three dimensions has.
SPATIAL_KEYS = {"xi_n", "density", "internal_friction", "surface_friction"}
LEGS = {"legs": OUTLINES}
SCREW = {"screw": OneOf({"screw": Screw}, implied=("screw",))}
LAW = (
    "stress maps of the vertical plane, or the law of three dimensions for the engine "
    "mujoco; if left out, the other keys decide"
)
OWNER = "a robot that walks"


@dataclass(frozen=True)
class WalkerScene:
    """A stress map or a law of three dimensions, a robot and its gait, and effects on
    the ground.

    numerics: how finely it is computed. text: its TOML. files: that the scene names.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> scene = load("xplorer")
    >>> scene.robot.mass, scene.gait.frequency  # kg, Hz
    (0.15, 2.0)
    """

    medium: Annotated[
        PlateStress | Spatial,
        OneOf(LAWS, "law", implied=tuple(LAWS), owner=OWNER, meaning=LAW),
    ]
    robot: Annotated[
        Robot,
        OneOf(
            ROBOTS | {"mjcf": Mjcf},
            inner={"rhex": LEGS, "wheel": LEGS, "screws": SCREW},
            implied=("mjcf",),
        ),
    ]
    gait: Annotated[Tripod, Keys(Tripod, owner=OWNER)]
    effects: Annotated[tuple[GroundEffect, ...], Each(KINDS, owner=OWNER)] = ()
    numerics: Annotated[Fineness, Keys(Fineness, owner=OWNER)] = field(
        default_factory=Fineness
    )
    name: str = "scene"
    text: str = field(default="", repr=False, compare=False)
    files: tuple[str, ...] = field(default=(), repr=False, compare=False)

    example: ClassVar[str] = "xplorer"

    def __post_init__(self):
        with located(self.name):
            for name, kind in (("numerics", Fineness), ("name", str), ("text", str)):
                value = getattr(self, name)
                if not isinstance(value, kind):
                    raise Refusal(f"{name} must be {kind.__name__}", value=value)
            check_files(self.files)
            object.__setattr__(self, "effects", self.walker.effects)
            self.robot.check(self.numerics.elements)

    @property
    def engine(self) -> str:
        """The engine that computes it by default."""
        if self.numerics.engine:
            return self.numerics.engine
        is_spatial = isinstance(self.robot, Mjcf | Screws | Flippers)
        if is_spatial or isinstance(self.medium, Spatial):
            return "mujoco"
        return "planar"

    @property
    def walker(self) -> Walker:
        return Walker(self.robot, self.gait, self.medium, self.effects)


def with_implied_names(tables: Mapping, name: str) -> dict:
    """Return the tables of a scene with the names that they omit: the kinds of the
    robot and its screw, and the law."""
    _refuse_slope_as_key(tables, name)
    tables = {
        key: dict(table) if isinstance(table, Mapping) else table
        for key, table in tables.items()
    }
    medium = tables.get("medium")
    if not isinstance(medium, dict):
        medium = {}
    robot = tables.get("robot")
    if not isinstance(robot, dict):
        robot = {}
    if "mjcf" in robot and robot.setdefault("kind", "mjcf") != "mjcf":
        raise Refusal(
            "[robot]",
            where=name,
            because=f"kind = {formatted(robot['kind'])} has sizes, mjcf a file",
            instead="remove one of them",
        )
    if isinstance(robot.get("screw"), Mapping):
        robot["screw"] = {"kind": "screw", **robot["screw"]}
    is_spatial = {*medium} & SPATIAL_KEYS or robot.get("kind") == "screws"
    medium.setdefault("law", "3d" if is_spatial else "planar")
    return tables


def _refuse_slope_as_key(tables: Mapping, name: str) -> None:
    """Raise Refusal for a key that is a slope, in any section or above all of them."""
    for section, table in tables.items():
        keys = {section}
        place = "slope"
        if isinstance(table, Mapping):
            keys = {*table}
            place = f"[{section}] slope"
        if {"slope", "slope_deg"} & keys:
            raise Refusal(
                place,
                where=name,
                because="the slope of walking scenes is an effect",
                instead=SLOPE,
            )
