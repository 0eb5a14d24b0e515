"""A table of the connection read from a file: the result of another run, another
program or an experiment.

Where the file has the odd harmonics of the velocity beside A
(`geomech.mathematics.geometry.representations.harmonics`), xi depends on the direction
of alphadot as in the scene it came from, and A is its linear part; else xi = A
alphadot. Abilities that depend on the file are classes below `Table`;
`Table.capability` returns them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.io import tables
from geomech.io.tables.base import BODY, UNKNOWN_FRAME
from geomech.mathematics.geometry.reconstruct import displacement, trajectory
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.representations.tube import BEYOND, Tube
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.geometry.velocity import evaluate
from geomech.mathematics.systems.base import SYSTEMS, integrated
from geomech.mathematics.systems.capabilities import (
    Diagnosed,
    Dissipative,
    OwnMetric,
    Recorded,
    Tabulated,
)
from geomech.mathematics.systems.misread import misread
from geomech.mathematics.systems.swimmer import Swimmer
from rft.bodies import Chain
from rft.core.checks import Number, check_numbers
from rft.core.refusal import Refusal

LENGTHS = (
    "its lengths are assumed to be in body lengths; add body_length = 1 if they are, "
    "or 3 if the unit is one of three equal links"
)
# The likely bodies of a file that does not say its body.
THREE_LINKS = [Chain(frame=frame) for frame in ("mean", "link-1", "link-2", "link-3")]


def _is_in_body_lengths(stored: tables.Stored) -> bool:
    """Return whether the lengths of a table are body lengths."""
    return (stored.unit, stored.length) == ("BL", 1.0)


def _chain(stored: tables.Stored) -> Chain | None:
    """Return the body of a table, with its length; None where it is unknown, or no
    chain."""
    if stored.body is None:
        return None
    length = None if _is_in_body_lengths(stored) else stored.length
    try:
        chain = Chain(**{**stored.body, "length": length})
    except (ValueError, TypeError):
        return None
    if chain.joints != len(stored.connection.axes):
        return None
    return chain


@SYSTEMS.register
@dataclass(frozen=True)
class Table:
    """A file of `geomech connection`, .nc or .mat, or a file of sysplotter.

    file (-): name of the file, relative to the folder of the scene file, or to the
    current folder if there is none. sign (-): "+" or "-" for xi = + or - A alphadot in
    the file. order (-): "ndgrid" or "meshgrid"; if left out, the order that the file
    states or shows (`tables.load`). sha256 (-): checksum that the file must have;
    filled in if left out. frame (-): frame of xi, "mean", "link-1" ... or
    "minimum-perturbation"; if left out, the frame of the file. Another frame needs a
    body, from the file or the scene.

    body: the chain of the table, in the frame of its A, where the file does not say it.
    medium: its law on that body gives the power of a change of shape, in place of a
    metric in the file.

    A file of `geomech fit-gait` holds A near a mean gait alone: gaits that leave the
    data are refused, and no area tier exists.

    The file is read once, when the system is built. Its field has the file's own grid;
    [numerics] grid, extent, directions, harmonics and interpolation have no effect
    here."""

    file: str
    sign: str = ""
    order: str = ""
    body_length: Annotated[
        float | None,
        Number(
            1e-9,
            1e9,
            "the file's unit",
            "length of the body, where the file does not give it; results are then in "
            "body lengths. If it is left out, lengths in the file are taken for body "
            "lengths, with a note",
        ),
    ] = None
    sha256: str = ""
    frame: str = ""
    body: Any = None
    medium: Any = None

    kind = "table"
    run = integrated

    def __post_init__(self):
        if not isinstance(self.file, (str, Path)):
            raise Refusal(
                "file must be the name of a .nc or .mat file", value=self.file
            )
        object.__setattr__(self, "file", str(Path(self.file).absolute()))
        for name in ("sign", "order", "sha256", "frame"):
            if not isinstance(getattr(self, name), str):
                raise Refusal(f"{name} must be text", value=getattr(self, name))
        check_numbers(self)
        stored = tables.load(self.file, self.sign, self.order)
        self._check(stored)
        object.__setattr__(self, "sha256", stored.sha256)
        scaled = tables.scaled(stored, 1.0 / (self.body_length or 1.0))
        original = self._with_body(scaled)
        object.__setattr__(self, "original", original)
        object.__setattr__(self, "chain", _chain(original))
        in_frame = tables.in_frame(original, self.frame, self.chain)
        object.__setattr__(self, "stored", in_frame)
        object.__setattr__(self, "swimmer", self._swimmer())

    def _check(self, stored: tables.Stored) -> None:
        """Refuse another file than the given one, a field with gaps, and a body length
        that the file has itself."""
        if self.sha256.lower() not in ("", stored.sha256):
            raise Refusal(
                f"the content of {self.file} does not match sha256",
                instead="restore the file, or leave sha256 out",
            )
        if stored.connection.field.masked and not isinstance(stored.connection, Tube):
            cure = ""
            if stored.A_error is not None:
                cure = ": give the .nc file of the measured gait, which contains them"
            raise Refusal(
                f"{self.file} has singular shapes (nan), and its values cannot be "
                f"interpolated between them{cure}"
            )
        is_stated = stored.sized and stored.computed is not None
        if not _is_in_body_lengths(stored):
            is_stated = True
        if self.body_length is not None and is_stated:
            raise Refusal(
                f"{self.file} states the length of the body itself, {stored.length:g} "
                f"{stored.unit}",
                instead="leave body_length out",
            )

    def _with_body(self, stored: tables.Stored) -> tables.Stored:
        """Return the table with the scene's body; Refusal if the file has a body
        itself, or the body has not the table's joints."""
        if self.body is None:
            return stored
        if not isinstance(self.body, Chain):
            raise Refusal("the body of a table must be a Chain", value=self.body)
        if stored.body is not None:
            raise Refusal(
                f"{self.file} describes its body itself", instead=("leave the body out")
            )
        joints = len(stored.connection.axes)
        if joints != self.body.joints:
            raise Refusal(
                f"the numbers of shape variables differ: {self.body.joints} of the "
                f"body, {joints} of {self.file}",
                instead="correct one of them",
            )
        if self.body.length is not None:
            raise Refusal(
                "the body of a table must not have a length",
                value=self.body.length,
                instead="give body_length instead",
            )
        if stored.frame not in (UNKNOWN_FRAME, self.body.frame):
            raise Refusal(
                f"the body has the frame {self.body.frame!r}, but {self.file} has "
                f"{stored.frame!r}",
                instead="correct one of them",
            )
        known = {name: getattr(self.body, name) for name in BODY}
        return replace(stored, frame=self.body.frame, body=known)

    def _swimmer(self) -> Swimmer | None:
        """Return the body of the table in the medium of the scene, None without one."""
        if self.medium is None:
            return None
        if self.chain is None or self.chain.frame != self.original.frame:
            raise Refusal(
                f"a medium needs a body, which {self.file} does not describe",
                instead="add [system.body], in the frame of A",
            )
        return Swimmer(self.medium, self.chain)

    def __reduce__(self):
        values = (
            self.file,
            self.sign,
            self.order,
            self.body_length,
            self.sha256,
            self.frame,
            self.body,
            self.medium,
        )
        return Table, values

    @property
    def tube(self) -> Tube | None:
        """The connection near a measured gait; None for other files."""
        connection = self.stored.connection
        return connection if isinstance(connection, Tube) else None

    @property
    def joints(self) -> int:
        """Number of shape variables."""
        return len(self.stored.connection.axes)

    @property
    def length(self) -> float:
        """Length of the body, in the table's unit."""
        return self.stored.length

    @property
    def traits(self) -> Traits:
        stored = self.stored
        degree = stored.power_degree
        if self.swimmer:
            degree = self.swimmer.traits.power_degree
        traits = Traits(
            linear=stored.harmonics is None,
            mirror=stored.mirror,
            smooth=False,
            power_degree=degree,
            frame=stored.frame,
            unit=stored.unit,
            labels=tuple((name, "rad") for name in stored.shapes),
            periods=stored.connection.periods,
        )
        if self.tube is None:
            return traits
        return replace(
            traits,
            singularity=self._beyond,
            singular="the data of the log do not reach",
        )

    def capability(self, kind: type) -> Any:
        """Return the object with an ability: power or a metric where the file, or a
        medium, has them."""
        stored = self.stored
        if kind is Tabulated:
            return _Tables(self)
        if kind in (Diagnosed, Recorded):
            return _Facts(self)
        has_power = stored.metric is not None and stored.power_degree is not None
        if kind is Dissipative:
            return _Drag(self) if self.swimmer or has_power else None
        if kind is OwnMetric:
            if self.swimmer or stored.metric is None or has_power:
                return None
            return _StoredMetric(self)
        return self if isinstance(self, kind) else None

    def _beyond(self, alpha) -> np.ndarray:
        """Return (...), which passes through 0 where the data of a measured gait
        end."""
        return 1 - self.tube.reach(alpha)

    def in_frame(self, frame: str) -> Table:
        """Return the table in another frame of its body."""
        return replace(self, frame=frame)

    def refuse_singular(self, alpha: ArrayLike) -> None:
        """Refuse shapes that the data of a measured gait do not reach, and say how far
        away they are."""
        if self.tube is not None:
            self.tube.checked(alpha)

    @cached_property
    def A_error(self) -> np.ndarray | None:
        """Half widths (3, joints, N_1, ...) of intervals of A on the file's grid, from
        the file, else from the Taylor series about a measured gait; None where there
        are none."""
        if self.stored.A_error is None and self.tube is not None:
            return self.tube.on_grid(self.tube.taylor.connection_error)
        return self.stored.A_error

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return the interpolated xi (..., 3); Refusal outside the table's grid."""
        return self.stored.table.velocity(alpha, alphadot)

    def _residual(self, values, alpha, alphadot) -> np.ndarray:
        """Return values (3, N_1, ...), for |alphadot| = 1, at shapes and rates (...,
        d): (..., 3). Near a measured gait they are the same everywhere."""
        speed = np.linalg.norm(alphadot, axis=-1)[..., None]
        if self.tube is None:
            table = self.stored.table
            field = Field(table.axes, values, 1, periods=table.periods)
            return field(alpha) * speed
        # The data may reach no point of the grid.
        known = values[:, np.isfinite(values[0])]
        if not known.size:
            return np.zeros(3) * speed
        return known[:, 0] * speed

    @cached_property
    def assumed(self) -> tuple[str, ...]:
        """Assumptions about facts that the file does not state, and contradictions to
        those that it states, one a line."""
        stored = self.original
        lines = stored.assumptions
        if not stored.sized and self.body_length is None:
            lines = (*lines, LENGTHS)

        # Only a connection by drag of another program is compared with a body of links.
        is_from_geomech = stored.sized and stored.computed is None
        has_own_metric = stored.metric is not None and stored.power_degree is None
        if self.tube is not None or is_from_geomech:
            return lines
        if has_own_metric and stored.sized:
            return lines
        bodies = [self.chain] if self.chain else THREE_LINKS
        reading = misread(stored.connection, bodies)
        if reading:
            lines = (*lines, reading)
        return lines

    @classmethod
    def examples(cls) -> dict[str, Table]:
        return {}  # a table needs a file


@dataclass(frozen=True)
class _StoredMetric:
    """`OwnMetric`: the metric in the file, where it is not one of drag."""

    system: Table

    def squared_speed(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        return self.system.stored.metric.norm(alpha, alphadot) ** 2


@dataclass(frozen=True)
class _Drag:
    """`Dissipative`: power by the scene's medium on the body, else by the file's
    metric."""

    system: Table

    def power(
        self, alpha: ArrayLike, alphadot: ArrayLike, xi: ArrayLike | None = None
    ) -> np.ndarray:
        stored = self.system.stored
        swimmer = self.system.swimmer
        if not swimmer:
            return stored.metric.norm(alpha, alphadot) ** stored.power_degree
        # Power is the same in every frame: the file's own velocity is in the body's.
        xi = self.system.original.table.velocity(alpha, alphadot)
        return swimmer.power(*np.broadcast_arrays(alpha, alphadot), xi)


@dataclass(frozen=True)
class _Tables:
    """`Tabulated`: the tables in the file, and the error of a gait that they cause."""

    system: Table

    @property
    def near_gait(self) -> str:
        if self.system.tube is None:
            return ""
        return f"the mean gait near which {self.system.file} was measured"

    def table(self, name: str) -> Any:
        stored = self.system.stored
        if name == "A_error":
            return self.system.A_error
        if name == "metric" and self.system.swimmer:
            return None
        tables = {
            "connection": stored.connection,
            "harmonics": stored.harmonics,
            "even part": stored.even,
            "metric": stored.metric,
        }
        return tables.get(name)

    def table_error(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return (..., 2), body lengths and rad: the fit's residual summed along the
        gait, the error of the heading times its lever, and the larger change with half
        the grid."""
        system = self.system
        stored = system.stored
        if system.tube is not None:
            error = system.tube.taylor.error(alpha, alphadot)
            return _distance_and_heading(error) / [system.length, 1.0]

        xi = system.velocity(alpha, alphadot)
        net = displacement(xi)
        differences = []
        for half in stored.halves:
            half_net = displacement(half.velocity(alpha, alphadot))
            differences.append(_distance_and_heading(half_net - net))
        error = np.maximum(*differences)

        # An error of the heading at a phase moves the end by its distance from there.
        phases = np.shape(alpha)[-2]
        pose = trajectory(xi, 2 * np.pi * np.arange(phases) / phases)
        lever = _distance_and_heading(net[..., None, :] - pose)[..., 0]
        for values, factor in self._contributions():
            residual = system._residual(values, alpha, alphadot)
            x, y, theta = np.moveaxis(residual, -1, 0)
            rate = np.stack([np.hypot(x, y) + lever * theta, theta], -1)
            error += 2 * np.pi * factor * rate.mean(-2)
        return error / [system.length, 1.0]

    def _contributions(self) -> list[tuple[np.ndarray, float]]:
        """Return fields (3, N_1, ...) of errors of xi for |alphadot| = 1, and the
        factors with which they add up along a gait."""
        stored = self.system.stored
        contributions = []
        if stored.has_residual:
            # The residual of harmonics up to k oscillates k times as fast as that of A,
            # and adds up like a random walk of k steps.
            factor = 1 / np.sqrt(stored.highest)
            contributions.append((stored.table.residual, factor))
        if stored.even is not None:
            # A gait may stay in directions where the even part is largest, sqrt(2)
            # times the rms of one harmonic.
            contributions.append((stored.even, np.sqrt(2)))
        if stored.A_error is not None:
            # Errors of A may have one sign along the whole gait.
            contributions.append((np.linalg.norm(stored.A_error, axis=1), 1.0))
        return contributions


@dataclass(frozen=True)
class _Facts:
    """`Diagnosed` and `Recorded`: facts about a table's velocity."""

    system: Table

    def diagnosed(self, alpha: ArrayLike, alphadot: ArrayLike) -> dict:
        """Return velocity, status and residual for one shape and rate (d,): the norm of
        the residual of the fit, rms over directions; None if the file has none."""
        stored = self.system.stored
        residual = None
        if stored.has_residual:
            values = self.system._residual(stored.table.residual, alpha, alphadot)
            residual = float(np.linalg.norm(values))
        xi = evaluate(self.system.velocity, alpha, alphadot)
        return {"xi": xi.tolist(), "status": "looked up", "residual": residual}

    def about(self) -> dict:
        """Return attributes for a file of the connection."""
        system = self.system
        attributes = {"table": system.file, "table_sha256": system.sha256}
        if system.tube is not None:
            taylor = system.tube.taylor
            attributes["singular_shapes"] = BEYOND
            attributes["level"] = taylor.level
            attributes["error_factor"] = taylor.factor
        elif system.stored.level is not None:
            attributes["level"] = system.stored.level
        return attributes


def _distance_and_heading(pose: np.ndarray) -> np.ndarray:
    """Return the distance and |heading| (..., 2) of poses (..., 3)."""
    x, y, theta = np.moveaxis(pose, -1, 0)
    return np.stack([np.hypot(x, y), np.abs(theta)], -1)
