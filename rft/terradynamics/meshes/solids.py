"""Solid bodies as meshes, one class per kind; sizes in m."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers, in_range
from rft.core.metres import metres
from rft.core.refusal import require
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.meshes.surfaces.blade import blade
from rft.terradynamics.meshes.surfaces.files import read
from rft.terradynamics.meshes.surfaces.mesh import (
    MOST_TRIANGLES,
    Mesh,
    mirror_image,
    quartered_mesh,
)
from rft.terradynamics.meshes.surfaces.smooth import smooth

# Triangles of the finest mesh in studies of accuracy, which stands for the exact
# surface.
FINEST = 327_680
HANDS = ("right", "left")
MOST_TURNS = 100  # of a thread: more turns need more than `MOST_TRIANGLES` triangles


class Solid:
    """Base of bodies that have a mesh.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Solid, Sphere
    >>> isinstance(Sphere(0.02), Solid)
    True
    """

    def __post_init__(self):
        check_numbers(self)

    def mesh(self, triangles: int = 5000) -> Mesh:
        """Return the mesh of about ``triangles`` triangles, at least as many as the
        body needs, with smooth normals."""
        in_range("triangles", triangles, 1, MOST_TRIANGLES, whole=True)
        mesh = self.build(int(triangles))
        if mesh.smooth_normals is None:
            return smooth(mesh)
        return mesh

    def build(self, triangles: int) -> Mesh:
        """Return the mesh, of flat triangles or with the normals of the body's exact
        surface."""
        raise NotImplementedError

    @property
    def ladder(self) -> tuple[int, ...]:
        """Numbers of triangles with which a study of accuracy computes; the results of
        the last stand for the exact ones."""
        return 80, 320, 1280, 5120, 20_480, FINEST


@dataclass(frozen=True)
class Sphere(Solid):
    """A ball about the origin, of 20, 80, 320, ..., or 327680 triangles: the least of
    these numbers that is at least ``triangles``.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Sphere
    >>> Sphere(radius=0.02).mesh(300).faces.shape
    (320, 3)
    """

    radius: Annotated[float, metres("radius of the sphere")]

    def mesh(self, triangles: int = 5000) -> Mesh:
        in_range("triangles", triangles, 1, MOST_TRIANGLES, whole=True)
        flat = self.build(int(triangles))
        normals = flat.vertices[flat.faces] / self.radius
        return dataclasses.replace(flat, smooth_normals=normals)

    def build(self, triangles: int) -> Mesh:
        fineness = math.ceil(math.log(triangles / 20, 4) - 0.01)
        return shapes.sphere(self.radius, min(7, max(0, fineness)))


@dataclass(frozen=True)
class Cylinder(Solid):
    """A rod along y, about the origin, across the plane of x and z.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Cylinder
    >>> Cylinder(radius=0.01, length=0.1).mesh(500).closed
    True
    """

    radius: Annotated[float, metres("radius of the rod")]
    length: Annotated[float, metres("length along y")]

    def build(self, triangles: int) -> Mesh:
        size = math.sqrt(
            4 * math.pi * self.radius * (self.length + 2 * self.radius) / triangles
        )
        counts = _divisions(
            size, (2 * math.pi * self.radius, 8), (self.length, 1), (self.radius, 1)
        )
        return shapes.cylinder(self.radius, self.length, *counts)


@dataclass(frozen=True)
class Screw(Solid):
    """An Archimedean screw along x, about the origin: a core with one thread, which is
    a blade or has a smooth profile.

    handed (-): "right", which drives to +x as it rotates about +x by the right hand, or
    "left", its mirror image.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw
    >>> screw = Screw(0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> screw.mesh(2000).closed
    True
    """

    radius: Annotated[float, metres("radius of the thread")]
    core: Annotated[
        float, metres("radius of the core, less than the radius of the thread")
    ]
    pitch: Annotated[float, metres("axial length of one turn of the thread")]
    length: Annotated[float, metres("axial length of core and thread")]
    thickness: Annotated[
        float,
        metres(
            "axial thickness of the blade, less than the pitch; 0 for a thread with a "
            "smooth profile",
            0,
        ),
    ] = 0.0
    nose: Annotated[
        float,
        metres(
            "length of a cone at each end of the core, beyond the thread; 0 for flat "
            "ends",
            0,
        ),
    ] = 0.0
    handed: str = "right"

    def __post_init__(self):
        super().__post_init__()
        require(
            self.core < self.radius,
            f"core must be less than the radius, got {self.core:g} and {self.radius:g}",
        )
        is_allowed = 1e-3 * self.pitch <= self.thickness < self.pitch
        require(
            self.thickness == 0 or is_allowed,
            "thickness must be 0, or at least a thousandth of the pitch and less than "
            f"the pitch, got {self.thickness:g} and {self.pitch:g}",
        )
        require(
            self.handed in HANDS,
            f"handed must be one of {', '.join(HANDS)}",
            value=self.handed,
        )
        require(
            self.turns <= MOST_TURNS,
            f"the thread has {self.turns:.4g} turns, more than {MOST_TURNS}",
            instead="lower length / pitch",
        )

    @property
    def turns(self) -> float:
        """Number of turns of the thread from end to end."""
        return self.length / self.pitch

    @property
    def sense(self) -> float:
        """Sign, 1 or -1, of the rate about x at which the screw drives to +x."""
        return 1.0 if self.handed == "right" else -1.0

    @property
    def mirrored(self) -> Screw:
        """The screw of the other hand."""
        handed = "left" if self.handed == "right" else "right"
        return dataclasses.replace(self, handed=handed)

    def build(self, triangles: int) -> Mesh:
        if self.thickness:
            mesh = self._with_blade(triangles)
        else:
            mesh = self._with_smooth_thread(triangles)
        if self.handed == "left":
            return mirror_image(mesh)
        return mesh

    def _with_smooth_thread(self, triangles: int) -> Mesh:
        """Return the right-handed screw with a thread of a smooth profile."""
        size = math.sqrt(
            4 * math.pi * self.core * (self.length + 2 * self.core) / triangles
        )
        around = 2 * math.pi * self.core
        slant = math.hypot(self.core, self.nose)  # from the rim of an end to its middle
        counts = _divisions(size, (around, 12), (self.length, 4), (slant, 1))
        return shapes.screw(
            self.radius, self.core, self.pitch, self.length, *counts, self.nose
        )

    def _with_blade(self, triangles: int) -> Mesh:
        """Return the right-handed screw whose thread is a blade."""
        around = 2 * math.pi * self.core
        slope = 2 * math.pi * self.radius / self.pitch
        high = self.radius - self.core
        edge = self.length * math.hypot(1.0, slope)
        slant = math.hypot(self.core, self.nose)  # from the rim of an end to its middle
        area = edge * (around + 2 * high + self.thickness) + around * slant
        counts = _divisions(
            math.sqrt(2 * area / triangles),
            (around, 8),
            (edge, 8),
            (slant, 1),
            (high, 1),
            (self.thickness * slope, 1),
        )
        return blade(
            self.radius,
            self.core,
            self.pitch,
            self.length,
            self.thickness,
            self.nose,
            *counts,
        )


@dataclass(frozen=True)
class Leg(Solid):
    """The c-leg of the vertical plane, extruded across it: hip at the origin, free end
    at z = -2 R.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Leg
    >>> Leg(radius=0.038, width=0.02, thickness=0.002).mesh(500).closed
    True
    """

    radius: Annotated[
        float, metres("R, half the distance from the hip to the free end")
    ]
    width: Annotated[float, metres("width across the plane, along y")]
    thickness: Annotated[float, metres("thickness of the strip, less than the radius")]
    relative_curvature: Annotated[
        float,
        Number(
            -1, 1, "-",
            "R / r, -1 to 1; 1 is half a circle that bulges to -x, which leads when a "
            "positive rate about y sweeps the leg backwards",
        ),
    ] = 1.0  # fmt: skip

    def __post_init__(self):
        super().__post_init__()
        require(
            self.thickness < self.radius,
            "thickness must be less than the radius, "
            f"got {self.thickness:g} and {self.radius:g}",
        )

    def build(self, triangles: int) -> Mesh:
        bend = math.asin(abs(self.relative_curvature))
        length = 2 * self.radius
        if bend:
            length *= bend / math.sin(bend)
        size = math.sqrt(4 * length * (self.width + self.thickness) / triangles)
        counts = _divisions(size, (length, 4), (self.width, 1), (self.thickness, 1))
        return shapes.leg(
            self.radius, -self.relative_curvature, self.thickness, self.width, *counts
        )


@dataclass(frozen=True)
class MeshFile(Solid):
    """The mesh of an STL, OBJ or PLY file (needs trimesh), in its own frame.

    file (-): name of the file, relative to the folder of a scene file. closed (-):
    whether the mesh must have an inside; either side of an open mesh may lead. smooth
    (-): whether the triangles represent a curved surface, with edges where they meet at
    more than 40 degrees.

    Where more triangles are wanted than the file has, each is cut in four; the form
    stays the same.
    """

    file: str
    scale: Annotated[
        float,
        Number(
            1e-9, 1e9, "m", "length of one unit of the file; 0.001 for a file in mm"
        ),
    ] = 1.0
    closed: bool = True
    smooth: bool = False

    def __post_init__(self):
        require(
            isinstance(self.file, str),
            "file must be the name of a mesh",
            value=self.file,
        )
        check_numbers(self)
        require(
            isinstance(self.closed, bool),
            "closed must be true or false",
            value=self.closed,
        )
        require(
            isinstance(self.smooth, bool),
            "smooth must be true or false",
            value=self.smooth,
        )
        mesh = read(self.file, self.closed, self.scale)
        if self.smooth:
            mesh = smooth(mesh)
        if not self.closed:
            mesh = mesh.two_sided
        object.__setattr__(self, "_mesh", mesh)

    def mesh(self, triangles: int = 5000) -> Mesh:
        in_range("triangles", triangles, 1, MOST_TRIANGLES, whole=True)
        mesh = self._mesh
        while 4 * len(mesh.faces) <= triangles:
            mesh = quartered_mesh(mesh)
        return mesh

    @property
    def ladder(self) -> tuple[int, ...]:
        coarsest = len(self._mesh.faces)
        ladder = [coarsest]
        while 4 * ladder[-1] <= FINEST and len(ladder) < 8:
            ladder.append(4 * ladder[-1])
        if len(ladder) == 1:
            return coarsest, coarsest
        return tuple(ladder)


SOLIDS = {"sphere": Sphere, "cylinder": Cylinder, "screw": Screw, "c-leg": Leg}


def _divisions(size: float, *lengths: tuple[float, int]) -> list[int]:
    """Return the numbers of pieces of about ``size``, m, into which lengths, m, are
    cut.
    lengths: pairs of a length and its least number of pieces."""
    return [
        int(np.clip(round(length / size), fewest, 4096)) for length, fewest in lengths
    ]
