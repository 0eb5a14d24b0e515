"""Craft on two screws as MuJoCo models: a box that moves freely, on screws that servos
rotate.

Screws have hardly any mass. Their servos are as stiff as those of legs
(`rft.terradynamics.walking.spatial.hexapod`), so that angles are those of the clock.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from rft.core.metres import GRAVITY
from rft.terradynamics.meshes.surfaces.mesh import Mesh
from rft.terradynamics.walking.craft import Screws
from rft.terradynamics.walking.spatial.facets import Surface
from rft.terradynamics.walking.spatial.hexapod import (
    COLOURS,
    DEFLECTION,
    LEG_MASS,
    NO_CONTACT,
    add_axle,
    add_box,
    add_inertia,
    add_servo,
    empty_model,
    to_text,
)

DRAWN_TRIANGLES = 2000  # triangles of a screw as drawn


def mjcf(robot: Screws) -> str:
    """Return the model as XML: a body "hull", and "screw0" and "screw1" hinged to it,
    left and right, with position actuators of the same names.

    At a positive rate a screw drives forwards."""
    root, hull = empty_model()
    ET.SubElement(hull, "freejoint")
    add_inertia(hull, robot.mass * (1 - 2 * LEG_MASS), robot.inertia)
    add_box(hull, [robot.length, robot.width, robot.height])

    assets = root.find("asset")
    motors = ET.SubElement(root, "actuator")
    mass = robot.mass * LEG_MASS
    stiffness = robot.mass * GRAVITY * robot.screw.radius / DEFLECTION
    for k, (screw, place) in enumerate(robot.screws):
        name = f"screw{k}"
        mesh = _mesh_attributes(screw.mesh(DRAWN_TRIANGLES))
        ET.SubElement(assets, "mesh", name=name, inertia="shell", **mesh)
        body = ET.SubElement(hull, "body", name=name, pos=to_text(place))
        axis = (screw.sense, 0.0, 0.0)
        add_axle(body, name, axis, robot.mass * robot.screw.radius**2)
        add_inertia(body, mass, np.full(3, mass * screw.length**2 / 12))
        ET.SubElement(
            body, "geom", type="mesh", mesh=name, rgba=COLOURS[k], **NO_CONTACT
        )
        add_servo(motors, name, stiffness)
    return ET.tostring(root, encoding="unicode")


def surfaces(robot: Screws, elements: int) -> list[Surface]:
    """Return the surfaces that touch the ground: the hull, body 1 of the model, and its
    screws."""
    screws = [
        Surface.from_mesh(2 + k, mesh) for k, mesh in enumerate(robot.meshes(elements))
    ]
    return [Surface.from_mesh(1, robot.hull(elements)), *screws]


def _mesh_attributes(mesh: Mesh) -> dict[str, str]:
    """Return the XML attributes of a mesh."""
    return {
        "vertex": to_text(mesh.vertices.ravel()),
        "face": " ".join(map(str, mesh.faces.ravel())),
    }
