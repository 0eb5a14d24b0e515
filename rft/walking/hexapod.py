"""Robots of the vertical plane as MuJoCo models: a box on rotary legs on both sides, in an alternating tripod.

The left leg of a hip is the first of the planar engine's two, the right one half a cycle behind. What the plane does not
tell is assumed: legs are beside the body, with no room between, and roll and yaw have the inertia of the box, or what is to
that as the pitch inertia is to the box's. Legs have hardly any mass, and are turned by servos so stiff that the weight of
the robot at the end of a leg turns it by 1e-4 rad.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from rft.laws.catalogue import GRAVITY
from rft.walking.facets import Surface
from rft.walking.robot import Robot, Roller

LIGHT = 1e-6  # of the robot's mass, that of a leg
GIVES = 1e-4  # rad, that a leg turns by with the robot's weight at its end
QUICK = 1e-3  # s, in which a servo settles
LEAST = 1e-14  # kg m^2, of any moment of inertia: MuJoCo takes none below 1e-15
THICK = 0.02  # of a leg's reach, as drawn
UNTOUCHED = {"contype": "0", "conaffinity": "0"}
COLOURS = "0.2 0.5 0.7 1", "0.8 0.35 0.2 1"  # of the two tripods

PLANAR = (("slide", "1 0 0"), ("slide", "0 0 1"), ("hinge", "0 1 0"))


def mjcf(robot: Robot, elements: int = 12, planar: bool = False) -> str:
    """The model as XML: a body "hull", "leg0", "leg1", ... hinged to it at hips from the first to the last, left and right in
    turn, with position actuators of the same names. planar: the hull keeps to the plane: no roll, no yaw, nothing sideways."""
    legs = robot.leg(elements)
    reach = float(np.abs(legs.points).max())
    root, hull = begun()
    level = isinstance(robot, Roller)
    for kind, axis in PLANAR[: 2 if level else 3] if planar or level else ():
        ET.SubElement(hull, "joint", type=kind, axis=axis)
    if not (planar or level):
        ET.SubElement(hull, "freejoint")
    inertial(hull, robot.mass * (1 - len(hips(robot)) * LIGHT), inertia(robot, reach))
    if not level:
        boxed(hull, [robot.length, robot.width, robot.height])
    stiff = robot.mass * GRAVITY * reach / GIVES
    motors = ET.SubElement(root, "actuator")
    for k, (place, phase) in enumerate(zip(hips(robot), phases(robot))):
        leg = ET.SubElement(hull, "body", name=f"leg{k}", pos=text(place))
        ET.SubElement(leg, "joint", name=f"leg{k}", type="hinge", axis="0 1 0")
        light = robot.mass * LIGHT
        inertial(leg, light, np.full(3, light * reach**2 / 3))
        for geom in _drawn(legs, THICK * reach):
            ET.SubElement(leg, "geom", rgba=COLOURS[bool(phase)], **geom, **UNTOUCHED)
        ET.SubElement(motors, "position", name=f"leg{k}", joint=f"leg{k}", kp=repr(stiff), kv=repr(stiff * QUICK))
    return ET.tostring(root, encoding="unicode")


def begun() -> tuple[ET.Element, ET.Element]:
    """(the model, its body "hull", in which nothing is)."""
    root = ET.Element("mujoco", model="robot")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity=f"0 0 {-GRAVITY!r}")
    ET.SubElement(ET.SubElement(root, "visual"), "global", offwidth="1280", offheight="960")
    sky = {"type": "skybox", "builtin": "flat", "rgb1": "1 1 1", "rgb2": "1 1 1", "width": "8", "height": "8"}
    ET.SubElement(ET.SubElement(root, "asset"), "texture", **sky)
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 0 2", dir="0.2 0.3 -1", directional="true")
    return root, ET.SubElement(world, "body", name="hull")


def boxed(hull: ET.Element, sides) -> None:
    """A box is drawn about the hull's middle."""
    ET.SubElement(hull, "geom", type="box", size=text(np.array(sides) / 2), rgba="0.25 0.3 0.4 1", **UNTOUCHED)


def inertia(robot: Robot, reach: float) -> np.ndarray:
    """(3,): about x, y, z; that of the box, as far as it is that about y. Of one that is kept level it does not count."""
    if isinstance(robot, Roller):
        return np.full(3, robot.mass * reach**2)
    square = np.array([robot.length, robot.width, robot.height]) ** 2
    box = square.sum() - square
    return robot.inertia * box / box[1]


def hips(robot: Robot) -> list[tuple[float, float, float]]:
    """Of each leg, from the hull's middle: left (y > 0) and right of hip after hip."""
    sides = (0.0,) if isinstance(robot, Roller) else robot.sides
    return [(x, side * y, robot.hip_height) for x, y in zip(robot.hips, sides) for side in _sides(robot)]


def _sides(robot: Robot) -> tuple[int, ...]:
    return (1, -1)[: len(robot.apart)]


def phases(robot: Robot) -> np.ndarray:
    """Of each leg, in cycles."""
    each = len(robot.apart)
    return np.array([(k // each + k % each) % each / each for k in range(each * len(robot.hips))])


def surfaces(robot: Robot, elements: int = 12) -> list[Surface]:
    """What touches the ground: the hull, body 1 of the model, and its legs."""
    leg, belly, sides = robot.leg(elements), robot.belly(elements), _sides(robot)
    hull = [Surface.of_outline(1, belly)] if belly else []
    return hull + [Surface.of_outline(2 + k, leg, side=sides[k % len(sides)]) for k in range(len(hips(robot)))]


def _drawn(legs, thick: float):
    """Geoms that show an outline: a box for each of its elements."""
    along = np.diff(legs.points, axis=0)
    for (x, z), (dx, dz), length in zip(legs.midpoints, along, legs.lengths):
        size = np.array([length, legs.width, thick]) / 2
        yield {
            "type": "box",
            "size": text(size),
            "pos": text((x, 0.0, z)),
            "euler": text((0.0, -np.arctan2(dz, dx), 0.0)),
        }


def inertial(body: ET.Element, mass: float, sides) -> None:
    """Mass, kg, and moments of inertia (3,), kg m^2, about the body's origin."""
    ET.SubElement(body, "inertial", pos="0 0 0", mass=repr(float(mass)), diaginertia=text(np.maximum(sides, LEAST)))


def text(numbers) -> str:
    return " ".join(repr(float(x)) for x in numbers)
