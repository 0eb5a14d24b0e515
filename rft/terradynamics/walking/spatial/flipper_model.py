"""Robots on flippers as MuJoCo models: a box that moves freely, with an arm and a
flipper on either side that servos move.

Arms and flippers have hardly any mass. Their servos are as stiff as those of legs
(`rft.terradynamics.walking.spatial.hexapod`)."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from rft.core.metres import GRAVITY
from rft.terradynamics.walking.flippers import Flippers
from rft.terradynamics.walking.spatial.facets import Surface
from rft.terradynamics.walking.spatial.hexapod import (
    COLOURS,
    DEFLECTION,
    LEG_MASS,
    MOTOR_INERTIA,
    NO_CONTACT,
    add_axle,
    add_box,
    add_inertia,
    add_servo,
    empty_model,
    to_text,
)

# Stiffness and damping time of a free wrist: moments over the weight times the arm,
# assumed, far less than the grains exert.
WRIST_STIFFNESS = 1e-3
WRIST_TIME = 0.1  # s
SIDES = (1.0, -1.0)  # left and right
FIRST_FLIPPER = 4  # body of the left flipper; its arm and lift come before it
BODIES = 3  # of one side


def mjcf(robot: Flippers) -> str:
    """Return the model as XML: a body "hull", and on each side "arm0", "lift0",
    "flipper0", with position actuators of arms and lifts."""
    root, hull = empty_model()
    ET.SubElement(hull, "freejoint")
    add_inertia(hull, robot.mass * (1 - 2 * BODIES * LEG_MASS), robot.inertia)
    add_box(hull, [robot.length, robot.width, robot.height])

    motors = ET.SubElement(root, "actuator")
    mass = robot.mass * LEG_MASS
    weight = robot.mass * GRAVITY
    square = robot.arm**2
    for k, (side, place) in enumerate(zip(SIDES, robot.shoulders)):
        arm = ET.SubElement(hull, "body", name=f"arm{k}", pos=to_text(place))
        # A positive angle is backwards on both sides.
        add_axle(arm, f"arm{k}", (0.0, 0.0, side), robot.mass * square)
        add_inertia(arm, mass, np.full(3, mass * square))
        add_servo(motors, f"arm{k}", weight * robot.arm / DEFLECTION)

        lift = ET.SubElement(arm, "body", name=f"lift{k}")
        armature = repr(MOTOR_INERTIA * robot.mass)
        ET.SubElement(
            lift,
            "joint",
            name=f"lift{k}",
            type="slide",
            axis="0 0 1",
            armature=armature,
        )
        add_inertia(lift, mass, np.full(3, mass * square))
        add_servo(motors, f"lift{k}", weight / (DEFLECTION * robot.arm))

        wrist = to_text((0.0, side * robot.arm, 0.0))
        flipper = ET.SubElement(lift, "body", name=f"flipper{k}", pos=wrist)
        if robot.wrist == "free":
            _add_wrist(flipper, f"wrist{k}", robot)
        add_inertia(flipper, mass, np.full(3, mass * square))
        sides = (robot.flipper_thickness, robot.flipper_width, robot.flipper_height)
        half = to_text(np.array(sides) / 2)
        ET.SubElement(
            flipper, "geom", type="box", size=half, rgba=COLOURS[k], **NO_CONTACT
        )
    return ET.tostring(root, encoding="unicode")


def _add_wrist(flipper: ET.Element, name: str, robot: Flippers) -> None:
    """Add a hinge to a flipper, with a weak spring and damper."""
    stiffness = WRIST_STIFFNESS * robot.mass * GRAVITY * robot.arm
    ET.SubElement(
        flipper,
        "joint",
        name=name,
        type="hinge",
        axis="0 0 1",
        armature=repr(MOTOR_INERTIA * robot.mass * robot.arm**2),
        stiffness=repr(stiffness),
        damping=repr(stiffness * WRIST_TIME),
    )


def surfaces(robot: Flippers, elements: int) -> list[Surface]:
    """Return the surfaces that touch the ground: the hull, body 1 of the model, and its
    flippers."""
    left = Surface.from_mesh(FIRST_FLIPPER, robot.flipper(elements))
    right = _mirrored(left)._replace(body=FIRST_FLIPPER + BODIES)
    return [_symmetric(Surface.from_mesh(1, robot.hull(elements))), left, right]


def _mirrored(surface: Surface) -> Surface:
    """Return the mirror image of a surface on the other side of y = 0."""
    flip = np.array([1.0, -1.0, 1.0])
    # In reverse order, corners run the same way about the normal again.
    return surface._replace(
        corners=surface.corners[:, ::-1] * flip, normals=surface.normals * flip
    )


def _symmetric(surface: Surface) -> Surface:
    """Return a surface whose triangles are mirror images: those to the left of y = 0,
    and their images. A robot whose sides differ would drift aside."""
    is_left = surface.corners[:, :, 1].mean(1) > 0.0
    left = surface._replace(
        corners=surface.corners[is_left], normals=surface.normals[is_left]
    )
    right = _mirrored(left)
    return surface._replace(
        corners=np.concatenate([left.corners, right.corners]),
        normals=np.concatenate([left.normals, right.normals]),
    )
