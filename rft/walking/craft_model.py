"""Craft on two screws as MuJoCo models: a box that is free to go anywhere, on screws that servos turn.

Screws have hardly any mass. Their servos are as stiff as those of legs (`rft.walking.hexapod`), so that angles are as told.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from rft.laws.catalogue import GRAVITY
from rft.meshes.mesh import Mesh
from rft.walking.craft import Screws
from rft.walking.facets import Surface
from rft.walking.hexapod import COLOURS, GIVES, LIGHT, QUICK, UNTOUCHED, begun, boxed, inertial, text

DRAWN = 2000  # triangles of a screw, as drawn


def mjcf(robot: Screws) -> str:
    """The model as XML: a body "hull", "screw0" and "screw1" hinged to it, left and right, with position actuators of the same
    names, at a positive rate of which the screw drives forwards."""
    root, hull = begun()
    ET.SubElement(hull, "freejoint")
    inertial(hull, robot.mass * (1 - 2 * LIGHT), robot.inertia)
    boxed(hull, [robot.length, robot.width, robot.height])
    assets, motors = root.find("asset"), ET.SubElement(root, "actuator")
    stiff = robot.mass * GRAVITY * robot.screw.radius / GIVES
    for k, (screw, place) in enumerate(robot.screws):
        name = f"screw{k}"
        ET.SubElement(assets, "mesh", name=name, inertia="shell", **_written(screw.mesh(DRAWN)))
        body = ET.SubElement(hull, "body", name=name, pos=text(place))
        ET.SubElement(body, "joint", name=name, type="hinge", axis=text((screw.sense, 0.0, 0.0)))
        light = robot.mass * LIGHT
        inertial(body, light, np.full(3, light * screw.length**2 / 12))
        ET.SubElement(body, "geom", type="mesh", mesh=name, rgba=COLOURS[k], **UNTOUCHED)
        ET.SubElement(motors, "position", name=name, joint=name, kp=repr(stiff), kv=repr(stiff * QUICK))
    return ET.tostring(root, encoding="unicode")


def surfaces(robot: Screws, elements: int = 12) -> list[Surface]:
    """What touches the ground: the hull, body 1 of the model, and its screws."""
    screws = [Surface.of_mesh(2 + k, mesh) for k, mesh in enumerate(robot.meshes(elements))]
    return [Surface.of_mesh(1, robot.hull(elements)), *screws]


def _written(mesh: Mesh) -> dict[str, str]:
    return {"vertex": text(mesh.vertices.ravel()), "face": " ".join(map(str, mesh.faces.ravel()))}
