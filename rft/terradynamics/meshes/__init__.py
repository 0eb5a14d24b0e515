"""Forces of grains on bodies of any form in three dimensions: the law, triangle meshes,
and their motions."""

from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.meshes.intrusion import Faces, Wrench, bearing, wrench
from rft.terradynamics.meshes.motions import (
    MOTIONS,
    Drag,
    Motion,
    Path,
    Penetrate,
    Rotate,
    Trajectory,
)
from rft.terradynamics.meshes.solids import (
    SOLIDS,
    Cylinder,
    Leg,
    MeshFile,
    Screw,
    Solid,
    Sphere,
)
from rft.terradynamics.meshes.surfaces.files import read
from rft.terradynamics.meshes.surfaces.mesh import Mesh, below
from rft.terradynamics.meshes.surfaces.sound import Sound, sound

__all__ = [
    "MOTIONS",
    "SOLIDS",
    "Cylinder",
    "Drag",
    "Faces",
    "Leg",
    "Mesh",
    "MeshFile",
    "Motion",
    "Path",
    "Penetrate",
    "Rotate",
    "Screw",
    "Solid",
    "Sound",
    "Spatial",
    "Sphere",
    "Trajectory",
    "Wrench",
    "bearing",
    "below",
    "read",
    "sound",
    "wrench",
]


def __dir__() -> list[str]:
    return __all__
