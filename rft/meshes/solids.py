"""Solid bodies, one class a kind; sizes in m. Each gives its `Mesh` of about so many triangles."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.checks import Number, check_numbers, in_range, require, shown
from rft.meshes import shapes
from rft.meshes.blade import blade
from rft.meshes.mesh import MOST, Mesh, mirrored, quartered, read
from rft.meshes.smooth import smooth
from rft.metres import metres

FINEST = 327_680  # triangles that a body is compared to
HANDS = ("right", "left")
MOST_TURNS = 100  # of a thread: more need more triangles than there are


class Solid:
    """Base of bodies: a mesh, and the numbers of triangles that are tried, and at last the truth, where one asks how many
    are enough."""

    def __post_init__(self):
        check_numbers(self)

    def mesh(self, triangles: int = 5000) -> Mesh:
        """Of about so many triangles, and at least those that the body takes."""
        in_range("triangles", triangles, 1, MOST, whole=True)
        made = self.made(int(triangles))
        return smooth(made) if made.bends is None else made

    def made(self, triangles: int) -> Mesh:
        """Of flat triangles, or with the normals of its surface."""
        raise NotImplementedError

    @property
    def ladder(self) -> tuple[int, ...]:
        return (*(80 * 4**k for k in range(5)), FINEST)


@dataclass(frozen=True)
class Sphere(Solid):
    """A ball about the origin; its triangles are 20, 80, 320, ..., 327680, the next number from the one required."""

    radius: Annotated[float, metres("radius of the sphere")]

    def mesh(self, triangles: int = 5000) -> Mesh:
        in_range("triangles", triangles, 1, MOST, whole=True)
        flat = self.made(int(triangles))
        return dataclasses.replace(flat, bends=flat.vertices[flat.faces] / self.radius)

    def made(self, triangles: int) -> Mesh:
        return shapes.sphere(self.radius, min(7, max(0, math.ceil(math.log(triangles / 20, 4) - 0.01))))


@dataclass(frozen=True)
class Cylinder(Solid):
    """A rod along y, about the origin, across the plane of x and z."""

    radius: Annotated[float, metres("radius of the rod")]
    length: Annotated[float, metres("length along y")]

    def made(self, triangles: int) -> Mesh:
        size = math.sqrt(4 * math.pi * self.radius * (self.length + 2 * self.radius) / triangles)
        counts = _divided(size, (2 * math.pi * self.radius, 8), (self.length, 1), (self.radius, 1))
        return shapes.cylinder(self.radius, self.length, *counts)


@dataclass(frozen=True)
class Screw(Solid):
    """An Archimedean screw along x, about the origin: a core with one thread, which is a blade or has a smooth profile.

    handed (-): "right", which drives to +x as it turns about +x by the right hand, or "left", its mirror image.
    """

    radius: Annotated[float, metres("radius of the thread")]
    core: Annotated[float, metres("radius of the core, less than that of the thread")]
    pitch: Annotated[float, metres("length along x of one turn of the thread")]
    length: Annotated[float, metres("length of core and thread along x")]
    thickness: Annotated[
        float, metres("thickness of the blade along x, less than the pitch; 0 for a thread of a smooth profile", 0)
    ] = 0.0
    nose: Annotated[
        float, metres("length of a cone at either end of the core, beyond the thread; 0 for flat ends", 0)
    ] = 0.0
    handed: str = "right"

    def __post_init__(self):
        super().__post_init__()
        require(self.core < self.radius, f"core must be less than the radius, got {self.core:g} and {self.radius:g}")
        told = f"{self.thickness:g} and {self.pitch:g}"
        told = f"thickness must be 0, or from a thousandth of the pitch to less than that, got {told}"
        require(self.thickness == 0 or 1e-3 * self.pitch <= self.thickness < self.pitch, told)
        require(self.handed in HANDS, f"handed must be one of {', '.join(HANDS)}, got {shown(self.handed)}")
        require(self.turns <= MOST_TURNS, f"the thread has {self.turns:.4g} turns, beyond {MOST_TURNS}: length / pitch")

    @property
    def turns(self) -> float:
        """Of the thread, from end to end."""
        return self.length / self.pitch

    @property
    def sense(self) -> float:
        """1 or -1: the sign of the rate about x at which it drives to +x."""
        return 1.0 if self.handed == "right" else -1.0

    @property
    def mirrored(self) -> Screw:
        """The screw of the other hand."""
        return dataclasses.replace(self, handed="left" if self.handed == "right" else "right")

    def made(self, triangles: int) -> Mesh:
        right = self._bladed(triangles) if self.thickness else self._smooth(triangles)
        return right if self.handed == "right" else mirrored(right)

    def _smooth(self, triangles: int) -> Mesh:
        size = math.sqrt(4 * math.pi * self.core * (self.length + 2 * self.core) / triangles)
        counts = _divided(size, (2 * math.pi * self.core, 12), (self.length, 4), (math.hypot(self.core, self.nose), 1))
        return shapes.screw(self.radius, self.core, self.pitch, self.length, *counts, self.nose)

    def _bladed(self, triangles: int) -> Mesh:
        high, slope = self.radius - self.core, 2 * math.pi * self.radius / self.pitch
        edge, slant = self.length * math.hypot(1.0, slope), math.hypot(self.core, self.nose)
        sides = edge * (2 * math.pi * self.core + 2 * high + self.thickness) + 2 * math.pi * self.core * slant
        lengths = (2 * math.pi * self.core, 8), (edge, 8), (slant, 1), (high, 1), (self.thickness * slope, 1)
        counts = _divided(math.sqrt(2 * sides / triangles), *lengths)
        return blade(self.radius, self.core, self.pitch, self.length, self.thickness, self.nose, *counts)


@dataclass(frozen=True)
class Leg(Solid):
    """The c-leg of the vertical plane, extruded across it: hip at the origin, its free end at z = -2 R below."""

    radius: Annotated[float, metres("R, half the distance from hip to free end")]
    width: Annotated[float, metres("width across the plane, along y")]
    thickness: Annotated[float, metres("thickness of the strip, less than the radius")]
    relative_curvature: Annotated[
        float,
        Number(
            -1, 1, "-",
            "R / r, -1 to 1, 1 for half a circle with its bulge to -x, ahead where a positive rate about y sweeps the leg "
            "backwards",
        ),
    ] = 1.0  # fmt: skip

    def __post_init__(self):
        super().__post_init__()
        told = f"thickness must be less than the radius, got {self.thickness:g} and {self.radius:g}"
        require(self.thickness < self.radius, told)

    def made(self, triangles: int) -> Mesh:
        bend = math.asin(abs(self.relative_curvature))
        length = 2 * self.radius * (bend / math.sin(bend) if bend else 1.0)
        size = math.sqrt(4 * length * (self.width + self.thickness) / triangles)
        counts = _divided(size, (length, 4), (self.width, 1), (self.thickness, 1))
        return shapes.leg(self.radius, -self.relative_curvature, self.thickness, self.width, *counts)


@dataclass(frozen=True)
class MeshFile(Solid):
    """The mesh of an STL, OBJ or PLY file (needs trimesh), in its own frame.

    file (-): its name; in a scene file, from the folder of that. closed (-): whether it has an inside, which is then
    required; of an open one either side may lead. smooth (-): whether its triangles stand for a curved surface, with edges
    where they meet at more than 40 degrees.

    More triangles than it has come of cutting each in four; its form stays.
    """

    file: str
    scale: Annotated[float, Number(1e-9, 1e9, "m", "length of a unit of the file, 0.001 if that is in mm")] = 1.0
    closed: bool = True
    smooth: bool = False

    def __post_init__(self):
        require(isinstance(self.file, str), f"file must be the name of a mesh, got {shown(self.file)}")
        check_numbers(self)
        require(isinstance(self.closed, bool), f"closed must be true or false, got {shown(self.closed)}")
        require(isinstance(self.smooth, bool), f"smooth must be true or false, got {shown(self.smooth)}")
        mesh = read(self.file, self.closed, self.scale)
        mesh = smooth(mesh) if self.smooth else mesh
        object.__setattr__(self, "_mesh", mesh if self.closed else mesh.two_sided)

    def mesh(self, triangles: int = 5000) -> Mesh:
        in_range("triangles", triangles, 1, MOST, whole=True)
        mesh = self._mesh
        while 4 * len(mesh.faces) <= triangles:
            mesh = quartered(mesh)
        return mesh

    @property
    def ladder(self) -> tuple[int, ...]:
        own = len(self._mesh.faces)
        finer = [own * 4**k for k in range(8) if own * 4**k <= max(FINEST, own)]
        return (*finer[:-1], finer[-1]) if len(finer) > 1 else (own, own)


SOLIDS = {"sphere": Sphere, "cylinder": Cylinder, "screw": Screw, "c-leg": Leg}


def _divided(size: float, *lengths: tuple[float, int]) -> list[int]:
    """How many pieces of a size each length is cut into, at least the number beside it."""
    return [int(np.clip(round(length / size), fewest, 4096)) for length, fewest in lengths]
