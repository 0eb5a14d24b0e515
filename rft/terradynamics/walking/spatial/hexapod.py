"""Robots of the vertical plane as MuJoCo models: a box on rotary legs on both sides, in
an alternating tripod.

The left leg of a hip is the first of the planar engine's two, the right one half a
cycle behind. What the plane does not determine is assumed: legs touch the sides of the
body, and the moments of inertia about roll and yaw have the same ratio to those of the
box as that about pitch. Legs have hardly any mass. Servos rotate them, so stiff that
the weight of the robot at the end of a leg rotates it by 1e-4 rad.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from rft.core.metres import GRAVITY
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.walking.robot import Robot, Roller
from rft.terradynamics.walking.spatial.facets import Surface

LEG_MASS = 1e-6  # of a leg over the robot's
# Inertia of a motor about its axis, over the robot's mass times a reach squared,
# assumed: without it, light legs exceed the accelerations that MuJoCo allows.
MOTOR_INERTIA = 1e-3
DEFLECTION = 1e-4  # rad, of a leg with the robot's weight at its end
SERVO_TIME = 1e-2  # s, time constant of a servo; walks set it by their clock
LEAST_INERTIA = 1e-14  # kg m^2: MuJoCo accepts no moment of inertia below 1e-15
THICKNESS = 0.02  # of a leg as drawn, over its reach
NO_CONTACT = {"contype": "0", "conaffinity": "0"}
COLOURS = ("0.2 0.5 0.7 1", "0.8 0.35 0.2 1")  # of the two tripods
SKY = {
    "type": "skybox",
    "builtin": "flat",
    "rgb1": "1 1 1",
    "rgb2": "1 1 1",
    "width": "8",
    "height": "8",
}

# Joints of a hull that stays level, and of one that stays in the plane.
LEVEL_JOINTS = (("slide", "1 0 0"), ("slide", "0 0 1"))
PLANAR_JOINTS = (*LEVEL_JOINTS, ("hinge", "0 1 0"))


def mjcf(robot: Robot, elements: int = 12, planar: bool = False) -> str:
    """Return the model as XML: a body "hull" and "leg0", "leg1", ... hinged to it, hip
    by hip, the left leg before the right one, with position actuators of the same
    names.

    planar: whether the hull stays in the plane, without roll, yaw and sideways
    motion."""
    outline = robot.leg(elements)
    reach = float(np.abs(outline.points).max())
    root, hull = empty_model()
    _add_hull(hull, robot, reach, planar)

    stiffness = robot.mass * GRAVITY * reach / DEFLECTION
    mass = robot.mass * LEG_MASS
    motors = ET.SubElement(root, "actuator")
    for k, (place, phase) in enumerate(zip(hips(robot), leg_phases(robot))):
        name = f"leg{k}"
        leg = ET.SubElement(hull, "body", name=name, pos=to_text(place))
        add_axle(leg, name, (0.0, 1.0, 0.0), robot.mass * reach**2)
        add_inertia(leg, mass, np.full(3, mass * reach**2 / 3))
        colour = COLOURS[1] if phase else COLOURS[0]
        for geom in _leg_geoms(outline, THICKNESS * reach):
            ET.SubElement(leg, "geom", rgba=colour, **geom, **NO_CONTACT)
        add_servo(motors, name, stiffness)
    return ET.tostring(root, encoding="unicode")


def _add_hull(hull: ET.Element, robot: Robot, reach: float, planar: bool) -> None:
    """Add joints, inertia and the drawing of a robot's box to its hull."""
    is_level = isinstance(robot, Roller)
    if is_level:
        joints = LEVEL_JOINTS
    elif planar:
        joints = PLANAR_JOINTS
    else:
        joints = ()
        ET.SubElement(hull, "freejoint")
    for kind, axis in joints:
        ET.SubElement(hull, "joint", type=kind, axis=axis)

    mass = robot.mass * (1 - len(hips(robot)) * LEG_MASS)
    add_inertia(hull, mass, inertia(robot, reach))
    if not is_level:
        add_box(hull, [robot.length, robot.width, robot.height])


def empty_model() -> tuple[ET.Element, ET.Element]:
    """Return a model, and the body "hull" in it, without joints and geoms."""
    root = ET.Element("mujoco", model="robot")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity=f"0 0 {-GRAVITY!r}")
    visual = ET.SubElement(root, "visual")
    ET.SubElement(visual, "global", offwidth="1280", offheight="960")
    assets = ET.SubElement(root, "asset")
    ET.SubElement(assets, "texture", **SKY)
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 0 2", dir="0.2 0.3 -1", directional="true")
    return root, ET.SubElement(world, "body", name="hull")


def add_box(hull: ET.Element, sides) -> None:
    """Add a box with these sides (3,), m, about the hull's middle, which is drawn and
    touches nothing."""
    ET.SubElement(
        hull,
        "geom",
        type="box",
        size=to_text(np.array(sides) / 2),
        rgba="0.25 0.3 0.4 1",
        **NO_CONTACT,
    )


def add_axle(body: ET.Element, name: str, axis, inertia: float) -> None:
    """Add a hinge with the inertia of a motor, which the hull does not feel. inertia:
    kg m^2, of the robot's mass."""
    armature = repr(float(MOTOR_INERTIA * inertia))
    ET.SubElement(
        body, "joint", name=name, type="hinge", axis=to_text(axis), armature=armature
    )


def add_servo(motors: ET.Element, name: str, stiffness: float) -> None:
    """Add a position actuator of the joint of the same name. stiffness: N m/rad."""
    damping = repr(stiffness * SERVO_TIME)
    ET.SubElement(
        motors, "position", name=name, joint=name, kp=repr(stiffness), kv=damping
    )


def inertia(robot: Robot, reach: float) -> np.ndarray:
    """Return moments of inertia (3,), kg m^2, about x, y, z: those of the box, scaled
    so that the one about y is the robot's.

    reach: m, of the legs. The moments of a robot that is kept level do not matter."""
    if isinstance(robot, Roller):
        return np.full(3, robot.mass * reach**2)
    square = np.array([robot.length, robot.width, robot.height]) ** 2
    box = square.sum() - square
    return robot.inertia * box / box[1]


def hips(robot: Robot) -> list[tuple[float, float, float]]:
    """Return the hip of each leg from the hull's middle, m: left (y > 0) and right of
    one hip after the other."""
    distances = (0.0,) if isinstance(robot, Roller) else robot.sides
    places = []
    for x, y in zip(robot.hips, distances):
        places += [(x, side * y, robot.hip_height) for side in _sides(robot)]
    return places


def _sides(robot: Robot) -> tuple[int, ...]:
    """Return the sides of the legs at a hip: 1 for left, -1 for right."""
    return (1, -1)[: len(robot.hip_phases)]


def leg_phases(robot: Robot) -> np.ndarray:
    """Return the phases of all legs, cycles: they alternate at a hip, and from hip to
    hip."""
    count = len(robot.hip_phases)
    leg = np.arange(count * len(robot.hips))
    return (leg // count + leg % count) % count / count


def surfaces(robot: Robot, elements: int) -> list[Surface]:
    """Return the surfaces that touch the ground: the hull, body 1 of the model, and its
    legs."""
    leg = robot.leg(elements)
    belly = robot.belly(elements)
    sides = _sides(robot)
    out = []
    if belly:
        out.append(Surface.from_outline(1, belly))
    for k in range(len(hips(robot))):
        out.append(Surface.from_outline(2 + k, leg, side=sides[k % len(sides)]))
    return out


def _leg_geoms(outline: Outline, thickness: float):
    """Yield the XML attributes of geoms that draw an outline, a box for each of its
    elements. thickness: m."""
    steps = np.diff(outline.points, axis=0)
    for (x, z), (dx, dz), length in zip(outline.midpoints, steps, outline.lengths):
        size = np.array([length, outline.width, thickness]) / 2
        yield {
            "type": "box",
            "size": to_text(size),
            "pos": to_text((x, 0.0, z)),
            "euler": to_text((0.0, -np.arctan2(dz, dx), 0.0)),
        }


def add_inertia(body: ET.Element, mass: float, moments) -> None:
    """Add a mass, kg, and moments of inertia (3,), kg m^2, about the body's origin."""
    moments = to_text(np.maximum(moments, LEAST_INERTIA))
    ET.SubElement(
        body, "inertial", pos="0 0 0", mass=repr(float(mass)), diaginertia=moments
    )


def to_text(numbers) -> str:
    """Return numbers as MuJoCo reads them, to the last digit."""
    return " ".join(repr(float(x)) for x in numbers)
