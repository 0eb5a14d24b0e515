"""Forces of grains on bodies of any form in three dimensions: law, triangle meshes, their motion."""

from rft.spatial.intrusion import Faces, Wrench, bearing, wrench
from rft.spatial.law import Spatial
from rft.spatial.mesh import Mesh, below, read
from rft.spatial.motions import MOTIONS, Drag, Motion, Passage, Path, Penetrate, Rotate
from rft.spatial.solids import SOLIDS, Cylinder, Leg, MeshFile, Screw, Solid, Sphere

__all__ = [
    "MOTIONS", "SOLIDS", "Cylinder", "Drag", "Faces", "Leg", "Mesh", "MeshFile", "Motion", "Passage", "Path", "Penetrate",
    "Rotate", "Screw", "Solid", "Spatial", "Sphere", "Wrench", "bearing", "below", "read",
    "wrench",
]  # fmt: skip
