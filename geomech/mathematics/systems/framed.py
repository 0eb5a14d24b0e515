"""Any system seen from its minimum-perturbation frame
(`geomech.mathematics.geometry.minimum_perturbation`)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.coordinates import change_velocity, frame_velocity
from geomech.mathematics.geometry.minimum_perturbation import (
    Frame,
    minimum_perturbation,
)
from geomech.mathematics.geometry.reconstruct import poses, repeated
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems.base import Cycle, System, kind_of, length_unit
from geomech.mathematics.systems.capabilities import (
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
from geomech.mathematics.systems.premises import refuse
from rft.core.checks import unmasked
from rft.core.premise import SHAPE_ALONE
from rft.core.refusal import Refusal
from rft.formulas import se2

NAME = "minimum-perturbation"


@dataclass(frozen=True)
class Framed:
    """A system in the frame in which its own connection, fitted on a grid, is smallest.

    Other members are those of the inner system. axes, directions, degree: of that fit.
    The frame is a field over the grid, so shapes outside have none. Results of the
    direct tier and of time stepping are transformed to it, and agree with other frames
    to roundoff."""

    inner: System
    axes: tuple[tuple[float, ...], ...]
    directions: int
    degree: int

    def __post_init__(self):
        refuse(
            self.inner,
            "minimum-perturbation frame",
            SHAPE_ALONE,
            f"remove frame = {NAME!r}",
        )
        if self.inner.traits.singularity is not None:
            raise Refusal(
                f"no minimum-perturbation frame exists for the {kind_of(self.inner)}, "
                "which has singular shapes",
                instead="remove frame",
            )
        if self.inner.traits.periods:
            raise Refusal(
                f"no minimum-perturbation frame is known for the {kind_of(self.inner)},"
                " which has shape variables that repeat",
                instead="remove frame",
            )
        if stored_table(self.inner, "connection"):
            raise Refusal(
                "a table keeps the frame in which it was computed",
                instead=f"remove frame = {NAME!r}, or compute the table in that frame",
            )

    settling = 0.0

    @property
    def kind(self) -> str:
        return kind_of(self.inner)

    @property
    def joints(self) -> int:
        return self.inner.joints

    @property
    def length(self) -> float | None:
        return self.inner.length

    @property
    def closed(self) -> bool:
        return self.inner.closed

    def capability(self, kind: type) -> Any:
        """Return the ability of the inner system, transformed to this frame where that
        makes a difference."""
        if kind is Stepped:
            # The frame turns with the shape: poses are transformed, not integrated.
            return self
        inner = capability(self.inner, kind)
        if inner is None or kind is Symbolic:
            return None
        if kind in (Dissipative, Drawable, Refinable, Diagnosed, Uncertain):
            return self
        return inner

    @property
    def traits(self) -> Traits:
        return dataclasses.replace(self.inner.traits, frame=NAME, reversible=False)

    @cached_property
    def _frame_and_connection(self) -> tuple[Frame, Connection]:
        return self._build(None)

    def _build(self, progress: Callable | None) -> tuple[Frame, Connection]:
        """Return the frame, and the connection in it: of the same velocities,
        transformed."""
        axes = tuple(map(np.array, self.axes))
        unit = connection.directions(self.joints, self.directions)
        inverse = np.linalg.pinv(unit)

        def reduce(xi):
            A = np.einsum("jc,sci->ijs", inverse, xi)
            return A, xi.transpose(1, 2, 0)

        A, xi = connection.sampled(
            self.inner.velocity,
            axes,
            unit,
            reduce,
            self.degree,
            progress,
            self.inner.traits,
        )
        zero = np.zeros_like(A[:, 0])
        size = {"unit": length_unit(self), "length": self.length}
        inner = Connection(axes, A, zero, zero, self.degree, **size)
        frame = minimum_perturbation(inner)

        # The velocities (C, N_1, ..., 3) in the frame, and their fit.
        h = np.moveaxis(frame.field.values, 0, -1)
        dh = frame.grid_slopes
        transformed = []
        for x, u in zip(xi, unit):
            transformed.append(change_velocity(np.moveaxis(x, 0, -1), h, dh @ u))
        xi = np.stack(transformed)
        A = np.einsum("jc,c...i->ij...", inverse, xi)
        residual = _rms(xi - np.einsum("ij...,cj->c...i", A, unit))
        return frame, Connection(axes, A, residual, _rms(xi), self.degree, **size)

    @property
    def field(self) -> Frame:
        """The frame's pose in the inner system's, over shape space."""
        return self._frame_and_connection[0]

    def fitted(self, progress: Callable | None = None) -> Connection:
        """Return the connection, on this frame's own grid."""
        if "_frame_and_connection" not in self.__dict__:
            self.__dict__["_frame_and_connection"] = self._build(progress)
        return self._frame_and_connection[1]

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """Return xi (..., 3) in the frame; ValueError outside its grid."""
        h, hdot = self.field(alpha, alphadot)
        return change_velocity(self.inner.velocity(alpha, alphadot), h, hdot)

    def power(self, alpha, alphadot, xi) -> np.ndarray:
        # Power is the same in every frame; xi (..., 3) is in this one.
        h, hdot = self.field(alpha, alphadot)
        relative = unmasked("xi", xi) - frame_velocity(h, hdot)
        inner_xi = np.einsum("...ij,...j->...i", se2.adjoint(h), relative)
        return capability(self.inner, Dissipative).power(alpha, alphadot, inner_xi)

    def diagnosed(self, alpha, alphadot) -> dict:
        facts = capability(self.inner, Diagnosed).diagnosed(alpha, alphadot)
        h, hdot = self.field(alpha, alphadot)
        return {**facts, "xi": change_velocity(facts["xi"], h, hdot).tolist()}

    def run(self, alpha, alphadot, work: bool = False, start=None) -> Cycle:
        """Return the inner system's cycle, transformed; ``start``, velocities in this
        frame, is not used."""
        arguments = (work,) if work else ()  # custom systems may not take it
        cycle = self.inner.run(alpha, alphadot, *arguments)
        h, hdot = self.field(alpha, alphadot)
        xi = change_velocity(cycle.xi, h, hdot)
        net = self.field.net(cycle.net, np.asarray(alpha)[..., 0, :])
        return cycle._replace(xi=xi, net=net)

    def path(self, alpha, alphadot, cycles: int = 1) -> np.ndarray:
        """Return the poses g h (cycles N + 1, 3) relative to the first, with g the
        poses of the inner frame."""
        inner = repeated(poses(self.inner.run(alpha, alphadot).xi), cycles)
        h = self.field.pose(np.concatenate([np.tile(alpha, (cycles, 1)), alpha[:1]]))
        return se2.compose(se2.inverse(h[0]), se2.compose(inner, h))

    def points(self, alpha, pose) -> np.ndarray:
        inner_pose = se2.compose(pose, se2.inverse(self.field.pose(alpha)))
        return capability(self.inner, Drawable).points(alpha, inner_pose)

    def refined(self) -> System | None:
        inner = refined(self.inner)
        if inner is None:
            return None
        return dataclasses.replace(self, inner=inner)

    @property
    def covariance(self) -> Any:
        return capability(self.inner, Uncertain).covariance

    def varied(self, step) -> Framed:
        # The varied system has its own minimum-perturbation frame.
        inner = capability(self.inner, Uncertain).varied(step)
        return dataclasses.replace(self, inner=inner)

    def with_solver(self, solver) -> Framed:
        return dataclasses.replace(self, inner=self.inner.with_solver(solver))


def _rms(xi: np.ndarray) -> np.ndarray:
    """Return the rms (3, N_1, ...) over directions of velocities (C, N_1, ..., 3)."""
    return np.moveaxis(np.sqrt((xi**2).mean(0)), -1, 0)


def in_frame(system: System, frame: str) -> System:
    """Return a system in another of its frames; Refusal if it has none of that name."""
    if isinstance(system, Framed):
        if frame == NAME:
            return system
        return in_frame(system.inner, frame)
    method = getattr(system, "in_frame", None)
    if method:
        return method(frame)
    if dataclasses.is_dataclass(system):
        names = [field.name for field in dataclasses.fields(system)]
        if "frame" in names:
            return dataclasses.replace(system, frame=frame)
    raise Refusal(
        f"the {kind_of(system)} has only the frame {system.traits.frame!r}, not "
        f"{frame!r}"
    )


def formula(system: System) -> tuple[Any, tuple[Any, ...]]:
    """Return A (3, joints) as a sympy Matrix and its shape variables
    (`geomech.mathematics.symbolic`); Refusal for a system without a formula."""
    if isinstance(system, Framed):
        raise Refusal(
            f"no formula exists in the {NAME} frame, which is known only numerically",
            instead="use another frame",
        )
    symbolic = capability(system, Symbolic)
    if symbolic is None:
        raise Refusal(
            f"no formula is known for the connection of a {kind_of(system)}",
            instead="use 'geomech connection' for its numerical values",
        )
    return symbolic.symbolic()
