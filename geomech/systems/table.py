"""A table of the connection read from a file: what another run, another program or an experiment found.

Where the file has the odd harmonics of the velocity beside A (`geomech.geometry.harmonics`), xi depends on the direction of
alphadot as in the scene it came from, and A is its linear part; else xi = A alphadot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np

from geomech.core.errors import short
from geomech.geometry.field import Field
from geomech.geometry.reconstruct import displacement, trajectory
from geomech.geometry.traits import Traits
from geomech.geometry.tube import BEYOND, Tube
from geomech.io import tables
from geomech.systems.base import Plain
from rft.checks import Number, check_numbers

LENGTHS = (
    "its lengths are taken for body lengths; say body_length = 1 if they are, 3 if one is a link of three equal ones"
)


@dataclass(frozen=True)
class Table(Plain):
    """A file of `geomech connection`, .nc or .mat, or one in sysplotter's layout.

    file (-): in a scene from a file relative to that file's folder, else to the current one. sign (-): "+" or "-" for
    xi = + or - A alphadot in the file; order (-): "ndgrid" or "meshgrid"; if left out as the file says or shows
    (`tables.load`). sha256 (-): of the file, filled in if left out;
    given, the file must have it.

    A file of `geomech fit` holds A near a mean gait alone: gaits that leave the data are refused, and there is no area tier.

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

    kind = "table"
    together = 1 << 16

    def __post_init__(self):
        if not isinstance(self.file, (str, Path)):
            raise ValueError(f"file must be the name of a .nc or .mat file, got {short(self.file)}")
        object.__setattr__(self, "file", str(Path(self.file).absolute()))
        for name in ("sign", "order", "sha256"):
            if not isinstance(getattr(self, name), str):
                raise ValueError(f"{name} must be text, got {short(getattr(self, name))}")
        check_numbers(self)
        held = tables.load(self.file, self.sign, self.order)
        if self.sha256.lower() not in ("", held.sha256):
            raise ValueError(f"{self.file} is not the file whose sha256 is given: restore it, or leave sha256 out")
        if held.connection.field.masked and not isinstance(held.connection, Tube):
            cure = "" if held.A_error is None else ": give the .nc file of the measured gait, which has what lies there"
            raise ValueError(f"{self.file} has singular shapes (nan), and nothing is looked up between those{cure}")
        if self.body_length is not None and (held.unit, held.length) != ("BL", 1.0):
            raise ValueError(
                f"{self.file} says the body's length itself, {held.length:g} {held.unit}: drop body_length"
            )
        object.__setattr__(self, "sha256", held.sha256)
        object.__setattr__(self, "held", tables.scaled(held, 1.0 / (self.body_length or 1.0)))

    def __reduce__(self):
        return Table, (self.file, self.sign, self.order, self.body_length, self.sha256)

    tube = property(lambda self: self.held.connection if isinstance(self.held.connection, Tube) else None)
    near = property(lambda self: f"the mean gait that {self.file} was measured at" if self.tube else "")
    joints = property(lambda self: len(self.held.connection.axes))
    length = property(lambda self: self.held.length)

    @property
    def traits(self) -> Traits:
        held = self.held
        near = {"singularity": self._beyond, "singular": "the data of the log do not reach"} if self.tube else {}
        return Traits(
            linear=held.harmonics is None, mirror=held.mirror, smooth=False, power_degree=held.power_degree,
            frame=held.frame, unit=held.unit, labels=tuple((name, "rad") for name in held.shapes), **near,
        )  # fmt: skip

    @property
    def cost(self) -> Callable | None:
        """As `Plain.cost`, where the file has a metric that is not one of drag."""
        told = self.held.metric
        if told is None or self.held.power_degree is not None:
            return None
        return lambda alpha, alphadot: told.norm(alpha, alphadot) ** 2

    def _beyond(self, alpha) -> np.ndarray:
        """Return (...), which passes through 0 where the data of a measured gait end."""
        return 1 - self.tube.reach(alpha)

    def refuse_singular(self, alpha) -> None:
        if self.tube is not None:
            self.tube.checked(alpha)

    def in_frame(self, frame: str) -> Table:
        raise ValueError(
            f"a table has the frame it was made in, {self.held.frame!r}: make it anew in the frame {frame!r}"
        )

    def stored(self, name: str):
        held = self.held
        own = {"connection": held.connection, "harmonics": held.harmonics, "even part": held.even}
        return self.A_error if name == "A_error" else {**own, "metric": held.metric}.get(name)

    @cached_property
    def A_error(self) -> np.ndarray | None:
        """(3, joints, N_1, ...), half widths of intervals of A on the file's grid, as the file has them, else of what is known
        near a measured gait; None where nothing tells them."""
        if self.held.A_error is None and self.tube is not None:
            return self.tube.at_grid(self.tube.known.of_error)
        return self.held.A_error

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """xi (..., 3) looked up; ValueError outside the table's grid."""
        return self.held.table.velocity(alpha, alphadot)

    def driven(self, alpha, alphadot) -> tuple[np.ndarray, np.ndarray]:
        """As `Plain.driven`, where the file tells what moving costs."""
        if self.held.metric is None or self.held.power_degree is None:
            raise ValueError(f"no power with this table: {self.file} does not tell it; make it anew from its scene")
        return self.velocity(alpha, alphadot), self.held.metric.norm(alpha, alphadot) ** self.held.power_degree

    def single(self, alpha, alphadot) -> dict:
        """As `Plain.single`; residual: length of the vector of what the fit leaves, rms over directions, None if unknown."""
        told = super().single(alpha, alphadot)
        shapes = np.asarray(alpha, float), np.asarray(alphadot, float)
        left = np.linalg.norm(self._times(self.held.table.residual, *shapes)) if self.held.told else None
        return {**told, "status": "looked up", "residual": left if left is None else float(left)}

    def _times(self, values, alpha, alphadot) -> np.ndarray:
        """(..., 3): values (3, N_1, ...) at a shape times |alphadot|; near one gait they are the same everywhere."""
        if self.tube is not None:
            there = values[:, np.isfinite(values[0])]  # nowhere, where the data reach no point of the grid
            return (there[:, 0] if there.size else np.zeros(3)) * np.linalg.norm(alphadot, axis=-1)[..., None]
        return Field(self.held.table.axes, values, 1)(alpha) * np.linalg.norm(alphadot, axis=-1)[..., None]

    def own_error(self, alpha, alphadot) -> np.ndarray:
        """(..., 2), body lengths and rad: the fit's residual summed up along the gait, what is left of the heading with its
        lever, and the larger change with half the grid. What harmonics up to k leave swings k times as fast as A's, and
        sums up like a random walk of k steps; what is even in alphadot does not, and a gait may keep to directions where it is
        largest, sqrt(2) times the rms of one harmonic. Nor do intervals of A, which may be off the same way all along."""
        if self.tube is not None:
            x, y, theta = np.moveaxis(self.tube.known.error(alpha, alphadot), -1, 0)
            return np.stack([np.hypot(x, y) / self.length, theta], -1)
        xi, phases = self.velocity(alpha, alphadot), np.shape(alpha)[-2]
        net = displacement(xi)
        halves = [displacement(half.velocity(alpha, alphadot)) for half in self.held.halves]
        apart = [np.stack([np.hypot(*np.moveaxis(h - net, -1, 0)[:2]), np.abs(h - net)[..., 2]], -1) for h in halves]
        error, held = np.maximum(*apart), self.held
        pose = trajectory(xi, 2 * np.pi * np.arange(phases) / phases)
        lever = np.hypot(*np.moveaxis(net[..., None, :] - pose, -1, 0)[:2])
        left = [(held.table.residual, 1 / np.sqrt(held.highest))] if held.told else []
        left += [(held.even, np.sqrt(2))] if held.even is not None else []
        left += [(np.linalg.norm(held.A_error, axis=1), 1.0)] if held.A_error is not None else []
        for values, factor in left:
            x, y, theta = np.moveaxis(self._times(values, alpha, alphadot), -1, 0)
            error += 2 * np.pi * factor * np.stack([np.hypot(x, y) + lever * theta, theta], -1).mean(-2)
        return error / [self.length, 1.0]

    def about(self) -> dict:
        own = {"table": self.file, "table_sha256": self.sha256}
        if self.tube is None:
            return own if self.held.level is None else {**own, "level": self.held.level}
        known = self.tube.known
        return {**own, "singular_shapes": BEYOND, "level": known.level, "error_factor": known.factor}

    @property
    def assumed(self) -> tuple[str, ...]:
        """What the file leaves open, and how it is taken, in notes."""
        return tuple(f"{self.file}: {line}" for line in self._open)

    @property
    def _open(self) -> tuple[str, ...]:
        """The lines of `assumed`, without the file's name."""
        return self.held.said if self.held.sized or self.body_length is not None else (*self.held.said, LENGTHS)

    def told(self) -> list[str]:
        held = self.held
        lines = [f"table ({self.file}: {held.connection!r})"]
        if self.tube is not None:
            lines.append(f"known near a measured gait alone; errors are those of {self.tube.known.level:.3g} of cases")
        elif held.harmonics:
            lines.append(
                f"with the odd harmonics of xi in the direction of alphadot to {held.highest}: {held.harmonics!r}"
            )
        else:
            lines.append("A alone: xi = A alphadot" + ", and what the fit left is part of every error" * held.told)
        if held.even is not None:
            lines.append("xi is not odd in alphadot: what is even is part of every error")
        if held.A_error is not None and self.tube is None:
            lines.append("its file tells intervals of A: they are part of every error")
        if not held.told:
            lines.append("the file does not tell what its fit left: errors are those of the grid alone")
        lines.append(
            f"stored as {tables.SIGNS[held.sign]}, arrays as {held.order}, lengths in {held.unit}, frame {held.frame}"
        )
        return [
            *lines,
            *self._open,
            "its field has the grid of the file; [numerics] grid, extent and directions say nothing",
        ]

    @property
    def because(self) -> str:
        return "(the velocity at every shape, looked up)"
