"""Intruder scenes: a body with an outline that moves through the vertical plane in a
prescribed way."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np

from geomech.core import summary
from geomech.scenes.format.columns import columns_reader, rows_reader
from geomech.scenes.format.sections import Each, FromFile, Keys, OneOf, Within
from geomech.scenes.terradynamics.intruding import Intruding
from geomech.scenes.terradynamics.stress import StressKeys
from rft.core.checks import Number
from rft.core.refusal import located
from rft.terradynamics.ground import GROUND_EFFECTS, GroundEffect
from rft.terradynamics.plates import (
    MOTIONS,
    SHAPES,
    Loads,
    Motion,
    Outline,
    PlateStress,
    Shape,
    loads,
)
from rft.terradynamics.plates.loads import ORDER

POINTS = FromFile(
    rows_reader("points", ("x", "z")),
    "CSV with the header x,z (m), instead of points",
    ("points",),
)
COURSE = FromFile(
    columns_reader(("t", "x", "z"), ("angle",)),
    "CSV with the header t,x,z or t,x,z,angle (s, m, rad); velocities are finite "
    "differences, with an error of order 2 in the spacing of t",
)
ELEMENTS = (
    "approximate number of elements of the outline, 1 to 5000; the error is of order "
    "2 in this number, or of order 1 with tension cut"
)
OUTLINES = OneOf(SHAPES, files={"polygon": POINTS, "spline": POINTS})


class Intrusion(NamedTuple):
    """Forces along a motion.

    t: (T,), s. pose, twist: (T, 3), as for `rft.terradynamics.plates.loads`. force:
    (T, 2), N, with the weights of effects. moment: (T,), N m, about the frame's origin.
    power: (T,), W, of the grains on the body."""

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray

    def __repr__(self) -> str:
        span = summary.span
        x, z = self.force.T
        described = (
            f"force x {span(x)} N, z {span(z)} N; moment {span(self.moment)} N m; "
            f"power {span(self.power)} W"
        )
        return f"Intrusion({len(self.t)} poses, t {span(self.t)} s; {described})"


@dataclass(frozen=True)
class IntruderScene(Intruding):
    """A stress map, a body and its motion, and effects.

    elements: of the outline. files: that the scene names. text: its TOML.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> forces = load("c-leg").run()
    >>> forces.force.shape, forces.moment.shape
    ((271, 2), (271,))
    """

    medium: Annotated[PlateStress, Keys(StressKeys, owner="an intruder scene")]
    intruder: Annotated[Shape, OUTLINES]
    motion: Annotated[Motion, OneOf(MOTIONS, files={"csv": COURSE})]
    elements: Annotated[
        int,
        Within("numerics", owner="an intruder scene"),
        Number(1, 5000, "-", ELEMENTS, whole=True),
    ] = 100
    effects: Annotated[
        tuple[GroundEffect, ...], Each(GROUND_EFFECTS, owner="an intruder scene")
    ] = ()
    name: str = "scene"
    text: str = field(default="", repr=False, compare=False)
    files: tuple[str, ...] = field(default=(), repr=False, compare=False)

    parts = "elements"
    field_types = {
        "medium": (PlateStress, "a stress map such as StressMap(zeta=0.24)"),
        "intruder": (Shape, "a body such as RoundRod(radius=0.0127, width=0.1)"),
        "motion": (Motion, "a motion such as Drag(depth=0.05)"),
    }
    ladder = (12, 25, 50, 100, 200, 400, 3200)

    def __post_init__(self):
        with located(self.name):
            self._check()
            _ = self.outline

    @property
    def outline(self) -> Outline:
        return self.intruder.outline(self.elements)

    @property
    def count(self) -> int:
        return self.outline.elements

    def actual_count(self, count: int) -> int:
        return self.intruder.outline(count).elements

    @property
    def size(self) -> float:
        return float(np.ptp(self.outline.points, axis=0).max())

    @property
    def per_part(self) -> float:
        seconds = 6e-8
        if self.medium.tension == "cut" and not self.outline.closed:
            return 2 * seconds
        return seconds

    @property
    def finer(self) -> tuple[int, ...]:
        """Factors of refinement."""
        if self.order == 2:
            return (2,)
        # Of first order the change by one factor alone may be small by chance.
        return (2, 3)

    @property
    def order(self) -> int:
        return ORDER[self.medium.tension]

    def run(self, elements: int | None = None) -> Intrusion:
        """Return forces along the motion. elements: in place of the scene's."""
        outline = self.outline
        if elements is not None:
            outline = self.intruder.outline(elements)
        t, pose, twist = self.motion.trajectory(outline)
        result: Loads = loads(self.medium, outline, pose, twist, self.effects)
        return Intrusion(
            t,
            pose,
            twist,
            self.weighed(result.force),
            result.moment,
            result.power(twist),
        )

    def table(self, result: Intrusion) -> dict[str, np.ndarray]:
        """Return the columns of a result: t; angle, or x and z if the body does not
        turn about a hub; force_x, force_z, moment."""
        columns = {"t": result.t}
        if self.motion.turns:
            columns["angle"] = result.pose[:, 2]
        else:
            columns["x"] = result.pose[:, 0]
            columns["z"] = result.pose[:, 1]
        columns["force_x"] = result.force[:, 0]
        columns["force_z"] = result.force[:, 1]
        columns["moment"] = result.moment
        return columns
