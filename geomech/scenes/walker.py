"""Scenes of walking: a robot, the clock of its legs and the grains it walks on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from geomech.scenes.intruder import OUTLINES
from geomech.scenes.sections import Each, Keys, OneOf
from geomech.scenes.stress import SpatialKeys, StressKeys
from rft.core.refusal import Refusal, formatted, located
from rft.terradynamics.ground import GROUND_EFFECTS, GroundEffect
from rft.terradynamics.meshes import Screw, Spatial
from rft.terradynamics.plates import PlateStress
from rft.terradynamics.walking import (
    ROBOTS,
    Fineness,
    Mjcf,
    Robot,
    Screws,
    Tripod,
    Walker,
)

ATTACH = "use rft.mujoco.attach(model, medium, {} = ...) in a loop of your own"
ELSEWHERE = {
    "slope": ATTACH.format("slope"),
    "disturbed-ground": ATTACH.format("footprints"),
}
KINDS = {kind: effect for kind, effect in GROUND_EFFECTS.items() if effect.walks}
LAWS = {"planar": StressKeys, "3d": SpatialKeys}
OF_THREE = {
    "xi_n",
    "density",
    "internal_friction",
    "surface_friction",
}  # keys of a [medium] of three dimensions alone
LEGS = {"legs": OUTLINES}
SCREW = {"screw": OneOf({"screw": Screw}, implied=("screw",))}
LAW = "stress maps of the vertical plane, or the law of three dimensions, for the engine mujoco; if left out what the keys tell"
OWNER = "a robot that walks"


@dataclass(frozen=True)
class WalkerScene:
    """A stress map or a law of three dimensions, a robot and its gait, and effects on the ground. numerics: how finely. text:
    its TOML. files: those that the scene names.

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
    effects: Annotated[tuple[GroundEffect, ...], Each(KINDS, elsewhere=ELSEWHERE)] = ()
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
                if not isinstance(getattr(self, name), kind):
                    raise Refusal(
                        f"{name} must be {kind.__name__}", value=getattr(self, name)
                    )
            if not (
                isinstance(self.files, tuple)
                and all(isinstance(x, str) for x in self.files)
            ):
                raise Refusal("files must be a tuple of names", value=self.files)
            object.__setattr__(self, "effects", self.walker.effects)
            self.robot.check(self.numerics.elements)

    @property
    def engine(self) -> str:
        """The engine that computes it by default."""
        spatial = isinstance(self.robot, Mjcf | Screws) or isinstance(
            self.medium, Spatial
        )
        return self.numerics.engine or ("mujoco" if spatial else "planar")

    @property
    def walker(self) -> Walker:
        return Walker(self.robot, self.gait, self.medium, self.effects)


def spelled_out(tables: Mapping, name: str) -> dict:
    """Return the tables of a scene with the names that they omit: those of the robot's kind, its screw, and the law."""
    tables = {
        key: dict(table) if isinstance(table, Mapping) else table
        for key, table in tables.items()
    }
    for section, table in tables.items():
        keys = table if isinstance(table, Mapping) else (section,)
        if {"slope", "slope_deg"} & {*keys}:
            place = f"[{section}] slope" if isinstance(table, Mapping) else "slope"
            raise Refusal(
                place,
                where=name,
                because="a walking scene has level ground",
                instead=ELSEWHERE["slope"],
            )
    medium, robot = (
        tables.get(key) if isinstance(tables.get(key), dict) else {}
        for key in ("medium", "robot")
    )
    if "mjcf" in robot and robot.setdefault("kind", "mjcf") != "mjcf":
        raise Refusal(
            "[robot]",
            where=name,
            because=f"kind = {formatted(robot['kind'])} has sizes, mjcf a file",
            instead="drop one",
        )
    if isinstance(robot.get("screw"), Mapping):
        robot["screw"] = {"kind": "screw", **robot["screw"]}
    if medium is not None:
        spatial = {*medium} & OF_THREE or robot.get("kind") == "screws"
        medium.setdefault("law", "3d" if spatial else "planar")
    return tables
