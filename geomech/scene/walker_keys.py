"""Every key of the tables of a scene of a walking robot, as `geomech.scene.intruder_keys` has those of intruder scenes."""

from __future__ import annotations

from typing import Any

from geomech.scene import intruder_keys
from geomech.scene.intruder_keys import Part
from geomech.scene.key import Key, first, keys_of, option, table
from geomech.scene.walker import KINDS, LAWS, ROBOTS, SHAPES, Fineness, Mjcf, Screw, Tripod

PARTS = {
    "legs": "The table [robot.legs] is an outline, as [intruder] is; 'geomech keys intruder' has its keys.",
    "screw": "The table [robot.screw] is a screw, as [intruder] is; 'geomech keys intruder' has its keys.",
}
LAW = "stress maps of the vertical plane, or the law of three dimensions, for the engine mujoco; if left out what the keys tell"
NEEDED = ["medium", "robot", "gait"]


def sections() -> dict[str, list[Part]]:
    """Of the tables that no other scene has what they may be; media and effects are those of intruder scenes."""
    law = Key("law", {"type": "string", "enum": [*LAWS]}, "-", LAW, False, None, False)
    return {
        "medium": [Part("[medium] of a robot that walks", "Besides the keys of that of an intruder scene.", [law])],
        "robot": [
            *(_robot(kind, robot) for kind, robot in ROBOTS.items()),
            Part('[robot] mjcf = "FILE.xml"', first(Mjcf), keys_of(Mjcf)),
        ],
        "gait": [Part("[gait] of a robot that walks", first(Tripod), keys_of(Tripod))],
        "numerics": [Part("[numerics] of a robot that walks", "", keys_of(Fineness))],
    }


def _robot(kind: str, robot: type) -> Part:
    keys = [k for k in keys_of(robot) if k.name != robot.part]
    return Part(f'[robot] kind = "{kind}"', f"{first(robot)} {PARTS[robot.part]}", keys, {"kind": kind})


def schemas() -> dict[str, Any]:
    """JSON Schema of every table."""
    theirs, own = intruder_keys.schemas()["outlines"], sections()
    spatial = intruder_keys.schemas()["meshes"]["medium"]
    media = [_of_law(theirs["medium"], LAWS[0]), _of_law(spatial, LAWS[1])]
    effects = [x for x in theirs["effects"]["items"]["oneOf"] if x["properties"]["kind"]["const"] in KINDS]
    legs = {"oneOf": [x for x in theirs["intruder"]["oneOf"] if x["properties"]["kind"]["const"] in SHAPES]}
    screw = option("", "", "", keys_of(Screw))
    screw["properties"]["kind"] = {"const": "screw"}
    parts = {"legs": legs, "screw": screw}
    *made, of_file = own["robot"]
    robots = [option(part.about, "kind", part.named["kind"], part.keys) for part in made]
    for robot, kind in zip(robots, ROBOTS.values()):
        robot["properties"][kind.part] = parts[kind.part]
        robot["required"].append(kind.part)
    robots.append(option(of_file.about, "", "", of_file.keys))
    robots[-1]["properties"]["kind"] = {"const": "mjcf"}
    (gait,), (numerics,) = own["gait"], own["numerics"]
    return {
        "medium": {"anyOf": media},
        "robot": {"oneOf": robots},
        "gait": option(gait.about, "", "", gait.keys),
        "numerics": option(numerics.about, "", "", numerics.keys),
        "effects": {"type": "array", "items": {"oneOf": effects}},
    }


def _of_law(medium: dict[str, Any], law: str) -> dict[str, Any]:
    """The table of a medium, which may say whose law it follows."""
    return medium | {"properties": {**medium["properties"], "law": {"const": law}}}


def whole(tables: dict[str, Any]) -> dict[str, Any]:
    """JSON Schema of a scene of a walking robot of such tables."""
    return table("", tables, NEEDED)
