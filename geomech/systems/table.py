"""A table of the connection read from a file: the result of another run, another program or an experiment.

Where the file has the odd harmonics of the velocity beside A (`geomech.geometry.harmonics`), xi depends on the direction of
alphadot as in the scene it came from, and A is its linear part; else xi = A alphadot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.geometry.field import Field
from geomech.geometry.reconstruct import displacement, trajectory
from geomech.geometry.traits import Traits
from geomech.geometry.tube import BEYOND, Tube
from geomech.geometry.velocity import evaluate
from geomech.io import tables
from geomech.io.tables.base import BODY, UNKNOWN_FRAME
from geomech.systems.base import SYSTEMS, integrated
from geomech.systems.capabilities import Dissipative, OwnMetric
from geomech.systems.misread import misread
from geomech.systems.swimmer import Swimmer
from rft.bodies import Chain
from rft.core.checks import Number, check_numbers
from rft.core.refusal import Refusal

LENGTHS = "its lengths are taken for body lengths; say body_length = 1 if they are, 3 if one is a link of three equal ones"
THREE_LINKS = [
    Chain(frame=frame) for frame in ("mean", "link-1", "link-2", "link-3")
]  # a bare file is likely of one


def _chain(stored: tables.Stored) -> Chain | None:
    """Return the body of a table, with its length; None where nothing says it, or no chain."""
    in_body_lengths = (stored.unit, stored.length) == ("BL", 1.0)
    length = None if in_body_lengths else stored.length
    try:
        chain = None
        if stored.body is not None:
            chain = Chain(**{**stored.body, "length": length})
    except (ValueError, TypeError):
        return None
    return chain if chain and chain.joints == len(stored.connection.axes) else None


@SYSTEMS.register
@dataclass(frozen=True)
class Table:
    """A file of `geomech connection`, .nc or .mat, or one of sysplotter's.

    file (-): in a scene from a file relative to that file's folder, else to the current one. sign (-): "+" or "-" for
    xi = + or - A alphadot in the file; order (-): "ndgrid" or "meshgrid"; if left out as the file says or shows
    (`tables.load`). sha256 (-): of the file, filled in if left out;
    given, the file must have it. frame (-): of xi, "mean", "link-1" ... or "minimum-perturbation", the file's own if
    left out; another one takes a body that the file or the scene says.

    body: the chain that the table is of, in the frame that its A has, where the file does not say it. medium: of the
    power that a change of shape takes, by its law on that body, in place of a metric in the file.

    A file of `geomech fit-gait` holds A near a mean gait alone: gaits that leave the data are refused, and no area tier
    exists.

    The file is read once, when the system is made.
    Its field has the file's own grid; [numerics] grid, extent, directions, harmonics and interpolation say nothing here.
    """

    file: str
    sign: str = ""
    order: str = ""
    body_length: Annotated[
        float | None,
        Number(
            1e-9, 1e9, "the file's unit",
            "of the body, where the file does not say it; results are then in body lengths, as which, with a note, its "
            "lengths are taken if left out",
        ),
    ] = None  # fmt: skip
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
        if self.sha256.lower() not in ("", stored.sha256):
            raise Refusal(
                f"{self.file} is not the file whose sha256 is given",
                instead="restore it, or leave sha256 out",
            )
        if stored.connection.field.masked and not isinstance(stored.connection, Tube):
            cure = (
                ""
                if stored.A_error is None
                else ": give the .nc file of the measured gait, which has what lies there"
            )
            raise Refusal(
                f"{self.file} has singular shapes (nan), and nothing is looked up between those{cure}"
            )
        stated = (stored.unit, stored.length) != ("BL", 1.0) or (
            stored.sized and stored.computed is not None
        )
        if self.body_length is not None and stated:
            raise Refusal(
                f"{self.file} says the body's length itself, {stored.length:g} {stored.unit}",
                instead="drop body_length",
            )
        object.__setattr__(self, "sha256", stored.sha256)
        original = self._with_body(
            tables.scaled(stored, 1.0 / (self.body_length or 1.0))
        )
        object.__setattr__(self, "original", original)
        object.__setattr__(self, "chain", _chain(original))
        object.__setattr__(
            self, "stored", tables.in_frame(original, self.frame, self.chain)
        )
        object.__setattr__(self, "swimmer", self._swimmer())

    def _with_body(self, stored: tables.Stored) -> tables.Stored:
        """Return the table with the scene's body; Refusal if the file says its own, or it has not the table's joints."""
        if self.body is None:
            return stored
        if not isinstance(self.body, Chain):
            raise Refusal("the body of a table must be a Chain", value=self.body)
        if stored.body is not None:
            raise Refusal(f"{self.file} says its body itself", instead="drop the body")
        if (joints := len(stored.connection.axes)) != self.body.joints:
            raise Refusal(
                f"the body has {self.body.joints} shape variables, {self.file} {joints}",
                instead="mend one",
            )
        if self.body.length is not None:
            raise Refusal(
                "the body of a table has no length",
                value=self.body.length,
                instead="say body_length",
            )
        if stored.frame not in (UNKNOWN_FRAME, self.body.frame):
            raise Refusal(
                f"the body has the frame {self.body.frame!r}, {self.file} {stored.frame!r}",
                instead="mend one",
            )
        known = {name: getattr(self.body, name) for name in BODY}
        return replace(stored, frame=self.body.frame, body=known)

    def _swimmer(self) -> Swimmer | None:
        """Return the body of the table in the medium of the scene, None without one."""
        if self.medium is None:
            return None
        if self.chain is None or self.chain.frame != self.original.frame:
            raise Refusal(
                f"a medium needs the body of {self.file}, which does not say it",
                instead="add [system.body], with the frame that A has",
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

    tube = property(
        lambda self: (
            self.stored.connection if isinstance(self.stored.connection, Tube) else None
        )
    )
    near_gait = property(
        lambda self: (
            f"the mean gait that {self.file} was measured at" if self.tube else ""
        )
    )
    joints = property(lambda self: len(self.stored.connection.axes))
    length = property(lambda self: self.stored.length)

    @property
    def traits(self) -> Traits:
        stored = self.stored
        limits = (
            {
                "singularity": self._beyond,
                "singular": "the data of the log do not reach",
            }
            if self.tube
            else {}
        )
        degree = (
            self.swimmer.traits.power_degree if self.swimmer else stored.power_degree
        )
        return Traits(
            linear=stored.harmonics is None, mirror=stored.mirror, smooth=False, power_degree=degree,
            frame=stored.frame, unit=stored.unit, labels=tuple((name, "rad") for name in stored.shapes), **limits,
        )  # fmt: skip

    def capability(self, kind: type) -> Table | None:
        """Return itself if it has the ability: power or a metric of its own where the file has them."""
        metric, degree = self.stored.metric, self.stored.power_degree
        absent = {
            Dissipative: self.swimmer is None and (metric is None or degree is None),
            OwnMetric: self.swimmer is not None or metric is None or degree is not None,
        }
        return self if isinstance(self, kind) and not absent.get(kind) else None

    def squared_speed(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        return self.stored.metric.norm(alpha, alphadot) ** 2

    def power(
        self, alpha: ArrayLike, alphadot: ArrayLike, xi: ArrayLike | None = None
    ) -> np.ndarray:
        if self.swimmer:  # of the file's own velocity, in the frame of the body; power is the same in every frame
            own = self.original.table.velocity(alpha, alphadot)
            return self.swimmer.power(*np.broadcast_arrays(alpha, alphadot), own)
        return self.stored.metric.norm(alpha, alphadot) ** self.stored.power_degree

    def _beyond(self, alpha) -> np.ndarray:
        """Return (...), which passes through 0 where the data of a measured gait end."""
        return 1 - self.tube.reach(alpha)

    def in_frame(self, frame: str) -> Table:
        return replace(self, frame=frame)

    def refuse_singular(self, alpha: ArrayLike) -> None:
        """Raise Refusal for shapes that the data of a measured gait do not reach; it says how far away they are."""
        if self.tube is not None:
            self.tube.checked(alpha)

    def table(self, name: str) -> Any:
        stored = self.stored
        tables = {
            "connection": stored.connection,
            "harmonics": stored.harmonics,
            "even part": stored.even,
        }
        metric = None if self.swimmer else stored.metric
        return (
            self.A_error
            if name == "A_error"
            else {**tables, "metric": metric}.get(name)
        )

    @cached_property
    def A_error(self) -> np.ndarray | None:
        """Half widths (3, joints, N_1, ...) of intervals of A on the file's grid, from the file, else from the Taylor
        series about a measured gait; None where there are none."""
        if self.stored.A_error is None and self.tube is not None:
            return self.tube.on_grid(self.tube.taylor.connection_error)
        return self.stored.A_error

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return the interpolated xi (..., 3); Refusal outside the table's grid."""
        return self.stored.table.velocity(alpha, alphadot)

    def diagnosed(self, alpha: ArrayLike, alphadot: ArrayLike) -> dict:
        """Return {"xi", "status", "residual"}: the residual is the norm of that of the fit, rms over directions; None
        if the file has none."""
        residual = (
            np.linalg.norm(self._times(self.stored.table.residual, alpha, alphadot))
            if self.stored.has_residual
            else None
        )
        xi = evaluate(self.velocity, alpha, alphadot).tolist()
        return {
            "xi": xi,
            "status": "looked up",
            "residual": residual if residual is None else float(residual),
        }

    def _times(self, values, alpha, alphadot) -> np.ndarray:
        """Return values (3, N_1, ...) at a shape times |alphadot|: (..., 3); near one gait they are the same
        everywhere."""
        if self.tube is not None:
            known = values[
                :, np.isfinite(values[0])
            ]  # nowhere, where the data reach no point of the grid
            return (known[:, 0] if known.size else np.zeros(3)) * np.linalg.norm(
                alphadot, axis=-1
            )[..., None]
        return (
            Field(self.stored.table.axes, values, 1)(alpha)
            * np.linalg.norm(alphadot, axis=-1)[..., None]
        )

    def table_error(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return (..., 2), body lengths and rad: the fit's residual summed along the gait, the error of the heading
        times its lever, and the larger change with half the grid.

        The residual of harmonics up to k oscillates k times as fast as that of A, and adds up like a random walk of k
        steps. The part that is even in alphadot does not: a gait may stay in directions where it is largest, sqrt(2)
        times the rms of one harmonic. Nor do intervals of A, whose errors may have one sign along the whole gait."""
        if self.tube is not None:
            x, y, theta = np.moveaxis(self.tube.taylor.error(alpha, alphadot), -1, 0)
            return np.stack([np.hypot(x, y) / self.length, theta], -1)
        xi, phases = self.velocity(alpha, alphadot), np.shape(alpha)[-2]
        net = displacement(xi)
        halves = [
            displacement(half.velocity(alpha, alphadot)) for half in self.stored.halves
        ]
        differences = [
            np.stack(
                [np.hypot(*np.moveaxis(h - net, -1, 0)[:2]), np.abs(h - net)[..., 2]],
                -1,
            )
            for h in halves
        ]
        error, stored = np.maximum(*differences), self.stored
        pose = trajectory(xi, 2 * np.pi * np.arange(phases) / phases)
        lever = np.hypot(*np.moveaxis(net[..., None, :] - pose, -1, 0)[:2])
        contributions = (
            [(stored.table.residual, 1 / np.sqrt(stored.highest))]
            if stored.has_residual
            else []
        )
        contributions += [(stored.even, np.sqrt(2))] if stored.even is not None else []
        contributions += (
            [(np.linalg.norm(stored.A_error, axis=1), 1.0)]
            if stored.A_error is not None
            else []
        )
        for values, factor in contributions:
            x, y, theta = np.moveaxis(self._times(values, alpha, alphadot), -1, 0)
            error += (
                2
                * np.pi
                * factor
                * np.stack([np.hypot(x, y) + lever * theta, theta], -1).mean(-2)
            )
        return error / [self.length, 1.0]

    def about(self) -> dict:
        attributes = {"table": self.file, "table_sha256": self.sha256}
        if self.tube is None:
            return (
                attributes
                if self.stored.level is None
                else {**attributes, "level": self.stored.level}
            )
        taylor = self.tube.taylor
        return {
            **attributes,
            "singular_shapes": BEYOND,
            "level": taylor.level,
            "error_factor": taylor.factor,
        }

    @cached_property
    def assumed(self) -> tuple[str, ...]:
        """Assumptions about facts that the file does not state, and what contradicts those that it states, one a line."""
        stored = self.original
        lines = (
            stored.assumptions
            if stored.sized or self.body_length is not None
            else (*stored.assumptions, LENGTHS)
        )
        ours = stored.sized and stored.computed is None  # a file of geomech's
        drag = (
            stored.metric is None or stored.power_degree is not None or not stored.sized
        )
        if self.tube is not None or ours or not drag:
            return lines
        misread_as = misread(
            stored.connection, [self.chain] if self.chain else THREE_LINKS
        )
        return (*lines, misread_as) if misread_as else lines

    @classmethod
    def examples(cls) -> dict[str, Table]:
        return {}  # of a file
