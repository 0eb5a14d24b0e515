"""Any system seen from its minimum-perturbation frame (`geomech.geometry.minimum_perturbation`)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from geomech.geometry import connection
from geomech.geometry.connection import Connection
from geomech.geometry.coordinates import change_velocity, frame_velocity
from geomech.geometry.minimum_perturbation import Frame, minimum_perturbation
from geomech.geometry.traits import Traits
from geomech.systems.base import SHAPE_ALONE, Cycle, System, length_unit
from rft import se2

NAME = "minimum-perturbation"


@dataclass(frozen=True)
class Framed:
    """A system in the frame in which its own connection, fitted on a grid, is smallest. What is not said here is the inner
    system's. axes, directions, degree: of that fit. The frame is a field over the grid, so shapes outside have none; what
    the direct tier and time stepping give is carried over to it, and agrees with other frames to rounding."""

    inner: System
    axes: tuple[tuple[float, ...], ...]
    directions: int
    degree: int

    carried, starts = True, False

    def __post_init__(self):
        self.inner.refuse("minimum-perturbation frame", SHAPE_ALONE, f"drop frame = {NAME!r}")
        if self.inner.traits.singularity is not None:
            raise ValueError(
                f"no minimum-perturbation frame of the {self.inner.kind}, which has singular shapes: drop frame"
            )
        if self.inner.stored("connection"):
            raise ValueError(f"a table keeps the frame it was made in: drop frame = {NAME!r}, or make the table in it")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.inner, name)

    @property
    def traits(self) -> Traits:
        return dataclasses.replace(self.inner.traits, frame=NAME, reversible=False)

    @cached_property
    def _made(self) -> tuple[Frame, Connection]:
        return self._make(None)

    def _make(self, progress: Callable | None) -> tuple[Frame, Connection]:
        """The frame, and the connection in it: of the same velocities, carried over."""
        axes, unit = tuple(map(np.array, self.axes)), connection.directions(self.joints, self.directions)
        inverse = np.linalg.pinv(unit)
        keep = lambda xi: (np.einsum("jc,sci->ijs", inverse, xi), xi.transpose(1, 2, 0))
        A, xi = connection.sampled(self.inner.velocity, axes, unit, keep, self.degree, progress, self.inner.traits)
        nothing = np.zeros_like(A[:, 0])
        size = {"unit": length_unit(self), "length": self.length}
        frame = minimum_perturbation(Connection(axes, A, nothing, nothing, self.degree, **size))
        h, dh = np.moveaxis(frame.field.values, 0, -1), frame.grid_slopes
        seen = np.stack([change_velocity(np.moveaxis(x, 0, -1), h, dh @ u) for x, u in zip(xi, unit)])
        A = np.einsum("jc,c...i->ij...", inverse, seen)
        left = seen - np.einsum("ij...,cj->c...i", A, unit)
        rms = [np.moveaxis(np.sqrt((x**2).mean(0)), -1, 0) for x in (left, seen)]
        return frame, Connection(axes, A, *rms, self.degree, **size)

    @property
    def field(self) -> Frame:
        """The frame's pose in the inner system's, over shape space."""
        return self._made[0]

    def fitted(self, axes, count: int, degree: int, progress: Callable | None = None) -> Connection:
        """As `Plain.fitted`; on this frame's own grid, and no other."""
        if "_made" not in self.__dict__:
            self.__dict__["_made"] = self._make(progress)
        return self._made[1]

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """xi (..., 3) in the frame; ValueError outside its grid."""
        return change_velocity(self.inner.velocity(alpha, alphadot), *self.field(alpha, alphadot))

    sample = velocity

    def driven(self, alpha, alphadot) -> tuple[np.ndarray, np.ndarray]:
        """As `Plain.driven`: power is the same in every frame."""
        xi, power = self.inner.driven(alpha, alphadot)
        return change_velocity(xi, *self.field(alpha, alphadot)), power

    def work(self, alpha, alphadot, xi) -> Any:
        """As the inner system's, for xi (..., 3) in this frame."""
        h, hdot = self.field(alpha, alphadot)
        inner = np.einsum("...ij,...j->...i", se2.adjoint(h), np.asarray(xi, float) - frame_velocity(h, hdot))
        return self.inner.work(alpha, alphadot, inner)

    def single(self, alpha, alphadot) -> dict:
        found = self.inner.single(alpha, alphadot)
        return {**found, "xi": change_velocity(found["xi"], *self.field(alpha, alphadot)).tolist()}

    def run(self, alpha, alphadot, work: bool = False) -> Cycle:
        done = self.inner.run(alpha, alphadot, work)
        xi = change_velocity(done.xi, *self.field(alpha, alphadot))
        return done._replace(xi=xi, net=self.field.net(done.net, np.asarray(alpha)[..., 0, :]))

    def path(self, alpha, alphadot, cycles: int = 1) -> np.ndarray:
        """As `Plain.path`: g h of the inner frame's poses g, seen from the first."""
        inner = self.inner.path(alpha, alphadot, cycles)
        h = self.field.pose(np.concatenate([np.tile(alpha, (cycles, 1)), alpha[:1]]))
        return se2.compose(se2.inverse(h[0]), se2.compose(inner, h))

    @property
    def points(self) -> Callable | None:
        inner = self.inner.points
        if inner is None:
            return None
        return lambda alpha, pose: inner(alpha, se2.compose(pose, se2.inverse(self.field.pose(alpha))))

    def finer(self) -> System | None:
        inner = self.inner.finer()
        return None if inner is None else dataclasses.replace(self, inner=inner)

    def with_solver(self, **changes) -> Framed:
        return dataclasses.replace(self, inner=self.inner.with_solver(**changes)) if changes else self

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        raise ValueError(f"no formula in the {NAME} frame, which is a field of numbers: take another frame")

    def in_frame(self, frame: str) -> System:
        return self if frame == NAME else self.inner.in_frame(frame)

    @property
    def costs_as(self) -> str:
        return f"{NAME} {self.inner.costs_as}"

    def told(self) -> list[str]:
        first, *rest = self.inner.told()
        return [f"{first}, seen from its {NAME} frame", *rest]
