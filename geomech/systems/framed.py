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
from geomech.geometry.reconstruct import poses, repeated
from geomech.geometry.traits import Traits
from geomech.systems.base import Cycle, System, kind_of, length_unit
from geomech.systems.capabilities import (
    Diagnosed,
    Dissipative,
    Drawable,
    Refinable,
    Stepped,
    Symbolic,
    Uncertain,
    capability,
    refined,
    stored_table,
)
from geomech.systems.premises import refuse
from rft.core.checks import unmasked
from rft.core.premise import SHAPE_ALONE
from rft.core.refusal import Refusal
from rft.formulas import se2

NAME = "minimum-perturbation"


@dataclass(frozen=True)
class Framed:
    """A system in the frame in which its own connection, fitted on a grid, is smallest. Other members are the inner
    system's. axes, directions, degree: of that fit. The frame is a field over the grid, so shapes outside have none.
    Results of the direct tier and of time stepping are transformed to it, and agree with other frames to roundoff."""

    inner: System
    axes: tuple[tuple[float, ...], ...]
    directions: int
    degree: int

    def __post_init__(self):
        refuse(
            self.inner,
            "minimum-perturbation frame",
            SHAPE_ALONE,
            f"drop frame = {NAME!r}",
        )
        if self.inner.traits.singularity is not None:
            raise Refusal(
                f"no minimum-perturbation frame of the {kind_of(self.inner)}, which has singular shapes",
                instead="drop frame",
            )
        if stored_table(self.inner, "connection"):
            raise Refusal(
                "a table keeps the frame it was made in",
                instead=f"drop frame = {NAME!r}, or make the table in it",
            )

    kind = property(lambda self: kind_of(self.inner))
    joints = property(lambda self: self.inner.joints)
    length = property(lambda self: self.inner.length)
    closed = property(lambda self: self.inner.closed)
    settling = 0.0

    def capability(self, kind: type) -> Any:
        """Return the ability of the inner system, transformed to this frame where that makes a difference."""
        inner = capability(self.inner, kind)
        if (
            kind is Stepped
        ):  # its frame turns with the shape: poses are carried over, not integrated
            return self
        carried_over = (Dissipative, Drawable, Refinable, Diagnosed, Uncertain)
        return (
            None
            if inner is None or kind is Symbolic
            else self
            if kind in carried_over
            else inner
        )

    @property
    def traits(self) -> Traits:
        return dataclasses.replace(self.inner.traits, frame=NAME, reversible=False)

    @cached_property
    def _frame_and_connection(self) -> tuple[Frame, Connection]:
        return self._build(None)

    def _build(self, progress: Callable | None) -> tuple[Frame, Connection]:
        """Return the frame, and the connection in it: of the same velocities, transformed."""
        axes, unit = (
            tuple(map(np.array, self.axes)),
            connection.directions(self.joints, self.directions),
        )
        inverse = np.linalg.pinv(unit)
        reduce = lambda xi: (
            np.einsum("jc,sci->ijs", inverse, xi),
            xi.transpose(1, 2, 0),
        )
        A, xi = connection.sampled(
            self.inner.velocity,
            axes,
            unit,
            reduce,
            self.degree,
            progress,
            self.inner.traits,
        )
        nothing = np.zeros_like(A[:, 0])
        size = {"unit": length_unit(self), "length": self.length}
        frame = minimum_perturbation(
            Connection(axes, A, nothing, nothing, self.degree, **size)
        )
        h, dh = np.moveaxis(frame.field.values, 0, -1), frame.grid_slopes
        in_frame_xi = np.stack(
            [
                change_velocity(np.moveaxis(x, 0, -1), h, dh @ u)
                for x, u in zip(xi, unit)
            ]
        )
        A = np.einsum("jc,c...i->ij...", inverse, in_frame_xi)
        remainder = in_frame_xi - np.einsum("ij...,cj->c...i", A, unit)
        rms = [
            np.moveaxis(np.sqrt((x**2).mean(0)), -1, 0)
            for x in (remainder, in_frame_xi)
        ]
        return frame, Connection(axes, A, *rms, self.degree, **size)

    @property
    def field(self) -> Frame:
        """The frame's pose in the inner system's, over shape space."""
        return self._frame_and_connection[0]

    def fitted(self, progress: Callable | None = None) -> Connection:
        """Return the connection, on this frame's own grid."""
        if "_made" not in self.__dict__:
            self.__dict__["_made"] = self._build(progress)
        return self._frame_and_connection[1]

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """Return xi (..., 3) in the frame; ValueError outside its grid."""
        return change_velocity(
            self.inner.velocity(alpha, alphadot), *self.field(alpha, alphadot)
        )

    def power(self, alpha, alphadot, xi) -> np.ndarray:
        # The same in every frame, for xi (..., 3) in this one.
        h, hdot = self.field(alpha, alphadot)
        inner = np.einsum(
            "...ij,...j->...i",
            se2.adjoint(h),
            unmasked("xi", xi) - frame_velocity(h, hdot),
        )
        return capability(self.inner, Dissipative).power(alpha, alphadot, inner)

    def diagnosed(self, alpha, alphadot) -> dict:
        inner = capability(self.inner, Diagnosed).diagnosed(alpha, alphadot)
        return {
            **inner,
            "xi": change_velocity(inner["xi"], *self.field(alpha, alphadot)).tolist(),
        }

    def run(self, alpha, alphadot, work: bool = False, start=None) -> Cycle:
        """Return the inner system's cycle, transformed; ``start``, of this frame's velocities, is of no use to that."""
        cycle = (
            self.inner.run(alpha, alphadot, work)
            if work
            else self.inner.run(alpha, alphadot)
        )
        xi = change_velocity(cycle.xi, *self.field(alpha, alphadot))
        return cycle._replace(
            xi=xi, net=self.field.net(cycle.net, np.asarray(alpha)[..., 0, :])
        )

    def path(self, alpha, alphadot, cycles: int = 1) -> np.ndarray:
        """Return the poses g h (cycles N + 1, 3), with g those of the inner frame, relative to the first."""
        inner = repeated(poses(self.inner.run(alpha, alphadot).xi), cycles)
        h = self.field.pose(np.concatenate([np.tile(alpha, (cycles, 1)), alpha[:1]]))
        return se2.compose(se2.inverse(h[0]), se2.compose(inner, h))

    def points(self, alpha, pose) -> np.ndarray:
        place = se2.compose(pose, se2.inverse(self.field.pose(alpha)))
        return capability(self.inner, Drawable).points(alpha, place)

    def refined(self) -> System | None:
        inner = refined(self.inner)
        return None if inner is None else dataclasses.replace(self, inner=inner)

    @property
    def covariance(self) -> Any:
        return capability(self.inner, Uncertain).covariance

    def varied(self, step) -> Framed:
        # With a frame of its own, as the system would have if its parameters were these.
        return dataclasses.replace(
            self, inner=capability(self.inner, Uncertain).varied(step)
        )

    def with_solver(self, solver) -> Framed:
        return dataclasses.replace(self, inner=self.inner.with_solver(solver))


def in_frame(system: System, frame: str) -> System:
    """Return a system in another of its frames; Refusal if it has none of that name."""
    if isinstance(system, Framed):
        return system if frame == NAME else in_frame(system.inner, frame)
    if method := getattr(system, "in_frame", None):
        return method(frame)
    if dataclasses.is_dataclass(system) and "frame" in {
        f.name for f in dataclasses.fields(system)
    }:
        return dataclasses.replace(system, frame=frame)
    raise Refusal(
        f"the {kind_of(system)} has one frame, {system.traits.frame!r}, and no {frame!r}"
    )


def formula(system: System) -> tuple[Any, tuple[Any, ...]]:
    """Return A (3, joints) as a sympy Matrix and its shape variables (`geomech.symbolic`); Refusal if there is none."""
    if isinstance(system, Framed):
        raise Refusal(
            f"no formula in the {NAME} frame, which is a field of numbers",
            instead="take another frame",
        )
    if (symbolic := capability(system, Symbolic)) is None:
        raise Refusal(
            f"no formula of the connection of a {kind_of(system)}",
            because="'geomech connection' has its numbers",
        )
    return symbolic.symbolic()
