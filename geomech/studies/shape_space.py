"""The connection and the CCF of a scene over shape space: on the scene's grid, or on planes where two joints move."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, ClassVar, NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry.plane import Plane
from geomech.geometry.stretch import Stretch
from geomech.geometry.stretch import stretch as stretch_to_metric
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies import fields
from geomech.studies.cost import (
    Job,
    frame,
    harmonics,
    of_even_part,
    of_metric,
    of_planes,
    price,
)
from geomech.studies.cost import connection as fitted
from geomech.studies.cost import study as displacement
from geomech.studies.effort import shared, why_none
from geomech.studies.fields import WHOLE, has_matrix
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.study import Study, refuse_outside
from geomech.systems.base import shape_labels
from geomech.systems.capabilities import stored_table
from geomech.tiers.area import AREA
from geomech.tiers.fitted import finest_grid, refuse
from geomech.tiers.harmonic import is_looked_up
from rft.refusal import Refusal, located

NO_MAP = "a body of one joint has no map, a loop of it encloses no area: give it one joint more, or drop the figure"
MOST_PAIRS = 10  # of joints in a figure: as many as five joints have


class Space(NamedTuple):
    """Subject of texts and pictures of shape space. other, other_planes: the study and its planes in another body frame.
    stretch: of shape space, to equal effort. enclosed: the displacement of the scene's gait by the area tier. balances,
    seconds: of the computation."""

    study: Study
    other: Study | None = None
    planes: tuple[Plane, ...] = ()
    other_planes: tuple[Plane, ...] = ()
    stretch: Stretch | None = None
    enclosed: Result | None = None
    balances: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class ShapeSpace(Question):
    """The connection or the CCF of a scene.

    kind: "connection" or "ccf", of the result.

    file: contents of a file, one of `fields.CONTENTS`; "" for none. field: computed on the scene's grid.
    map: drawn on that grid. planes: drawn where two joints move, of ``pair``, such as "1,3", or of all pairs; slice_angles:
    angles of the other joints, rad, the gait's middle if None. metric: with the cost of changes of shape. stretch: with shape
    space stretched to that cost. gait: the scene's gait is drawn, and must lie within. other_frame: name of another body frame,
    drawn below."""

    scene: Scene
    kind: str = "ccf"
    file: str = ""
    field: bool = True
    map: bool = False
    planes: bool = False
    pair: str | None = None
    slice_angles: tuple[float, ...] | None = None
    metric: bool = False
    stretch: bool = False
    gait: bool = False
    other_frame: str | None = None

    worth_saying: ClassVar[float] = 1.0

    @property
    def title(self) -> str:
        return f"{'field' if self.field else 'planes'} of {self.scene.name}"

    @property
    def less(self) -> str:
        joints = self.scene.system.joints
        return (
            f"lower ``grid``, to {finest_grid(joints)} or less"
            if joints > 2 and self.field
            else "ask for less"
        )

    @cached_property
    def study(self) -> Study:
        return Study(self.scene)

    @cached_property
    def other(self) -> Study | None:
        """Study in the other frame."""
        return (
            None if self.other_frame is None else self.study.in_frame(self.other_frame)
        )

    @property
    def _costed(self) -> bool:
        """Whether the metric is computed."""
        system = self.scene.system
        needed = {"": False, WHOLE: not why_none(system)}
        return self.metric or needed.get(self.file, has_matrix(system))

    @property
    def _enclosed(self) -> bool:
        """Whether the CCF is integrated over the scene's gait."""
        return self.gait and AREA.is_offered(self.scene.system)

    @property
    def _harmonics(self) -> bool:
        return self.file == WHOLE and is_looked_up(self.scene.system)

    @cached_property
    def _at(self) -> list[tuple[tuple[int, int], np.ndarray]]:
        """Pairs of joints of the planes, from 0, and the shape through which each plane goes."""
        if not self.planes:
            return []
        joints = self.scene.system.joints
        pairs = (
            [_pair(self.pair, joints)]
            if self.pair is not None
            else list(combinations(range(joints), 2))
        )
        if len(pairs) > MOST_PAIRS:
            raise Refusal(
                f"{joints} joints have {len(pairs)} pairs",
                instead=f"say which, such as ``pair`` 1,{joints}, or give a chain [body] modes",
            )
        return [
            (one, through(self.scene, one, self.slice_angles, self.pair is not None))
            for one in pairs
        ]

    def check(self) -> None:
        system, name = self.scene.system, self.scene.name
        with located(name):
            refuse(system)
            if (self.map or self.planes) and system.joints == 1:
                raise Refusal(NO_MAP)
            if self.gait:
                refuse_outside(self.scene)
            if self.metric and (reason := why_none(system)):
                raise Refusal(reason, where=name)
            if self.other_frame is not None and len(self._at) > 1:
                raise Refusal(
                    "``compare_frame`` draws one pair of joints",
                    instead="say which with ``pair``",
                )
        _ = self.other

    def cost(self) -> Cost:
        with located(self.scene.name):
            return price(
                [
                    job
                    for study in filter(None, (self.study, self.other))
                    for job in self._jobs(study)
                ]
            )

    def _jobs(self, study: Study) -> list[Job]:
        scene = study.scene
        jobs = [*of_planes(scene, *zip(*self._at)), *frame(scene)] if self._at else []
        if not self.field:
            return jobs
        if self._enclosed and study is self.study:
            jobs += displacement(
                scene, {AREA.name: study.plan(AREA.name)}, 1, tables=False
            )
        jobs += fitted(scene)
        if study is self.study:
            jobs += of_metric(scene) if self._costed else []
            jobs += of_even_part(scene) if self.file else []
            jobs += (
                harmonics(scene)
                if self._harmonics and not (self._costed and shared(scene.system))
                else []
            )
        return jobs

    def answer(self, progress: Progress, allow: Allow) -> Result:
        study, parts, start = self.study, self._parts(), time.perf_counter()
        values = [
            part(lambda done, k=k: progress((k + done) / len(parts)))
            for k, part in enumerate(parts)
        ]
        count = len(self._at)
        other_planes = tuple(values[count : 2 * count]) if self.other else ()
        stretched = stretch_to_metric(study.metric) if self.stretch else None
        amplitude = self.scene.gait.amplitude
        enclosed = (
            study.displacements([amplitude], [AREA.name]) if self._enclosed else None
        )
        spent = self.cost().balances, time.perf_counter() - start
        space = Space(
            study,
            self.other,
            tuple(values[:count]),
            other_planes,
            stretched,
            enclosed,
            *spent,
        )
        if self.file:
            file = fields.CONTENTS[self.file](study)
            return Result(file.kind, file.variables, file.attributes, space)
        if not self.field:
            return Result(
                self.kind,
                tuple(_of_plane(*x) for x in zip(self._at, space.planes)),
                {},
                space,
            )
        axes = fields.coordinates(study.fitted.axes, shape_labels(self.scene.system))
        if self.kind == "connection":
            return Result(
                self.kind, (*axes, *fields.of_connection(study.fitted)), {}, space
            )
        return Result(
            self.kind,
            (*axes, fields.of_ccf(study.curvature, study.curvature_error)),
            {},
            space,
        )

    def _parts(self) -> list[Callable[[Progress], Any]]:
        """Return the parts of the computation, in order: planes first."""
        studies = [self.study, *filter(None, [self.other])]
        parts: list[Callable] = [
            lambda progress, s=s, pair=pair, at=at: s.plane(pair, at, progress=progress)
            for s in studies
            for pair, at in self._at
        ]
        if not self.field:
            return parts
        parts.append(self.study.compute_field)
        parts += [self.study.compute_metric] if self._costed else []
        parts += [self.study.compute_harmonics] if self._harmonics else []
        return parts + (
            [self.other.compute_field] if self.other and not self._at else []
        )


def _of_plane(at: tuple[tuple[int, int], np.ndarray], plane: Plane) -> Variable:
    """Return the CCF of a plane, over its two joints."""
    (i, j), _ = at
    ccf = fields.of_ccf(plane.ccf)
    dims = ("component", f"alpha_{i + 1}", f"alpha_{j + 1}")
    return Variable(
        f"ccf_{i + 1}_{j + 1}",
        dims,
        ccf.values,
        ccf.unit,
        f"CCF of joints {i + 1} and {j + 1}",
    )


def _pair(text: str, joints: int) -> tuple[int, int]:
    """Return the joints, counted from 0, of a text such as 1,3."""
    names = text.split(",")
    if len(names) != 2 or not all(x.strip().isdecimal() for x in names):
        raise Refusal(
            f"{text!r} is not two joints such as 1,{joints}", where="``pair``"
        )
    i, j = (int(x) - 1 for x in names)
    if i == j or not all(0 <= k < joints for k in (i, j)):
        raise Refusal(
            f"{text!r} must be two different joints from 1 to {joints}",
            where="``pair``",
        )
    return i, j


def through(
    scene: Scene, pair: tuple[int, int], angles: tuple[float, ...] | None, alone: bool
) -> np.ndarray:
    """Return the shape through which the plane of a pair of joints goes. alone: angles may be those of the fixed joints
    only."""
    at, fixed = (
        scene.gait.middle.copy(),
        [k for k in range(scene.system.joints) if k not in pair],
    )
    if angles is not None and not fixed:
        raise Refusal(
            "``slice`` says where other joints are held, and this body has but two",
            instead="drop it",
        )
    if angles is None:
        return at
    extent = scene.numerics.extent
    if not (
        stored_table(scene.system, "connection")
        or all(abs(a) <= extent for a in angles)
    ):
        raise Refusal(
            f"the angles must lie within the field's {extent:g} rad",
            where="``slice``",
            instead="give others, or raise ``extent``",
        )
    if len(angles) == len(at) > 1:
        return np.array(angles)
    if len(angles) != 1 and not (alone and len(angles) == len(fixed)):
        choices = f"{len(fixed)} one by one, " * (alone and len(fixed) > 1) + "or "
        raise Refusal(
            f"``slice`` takes one angle for all joints that are held, {choices}{len(at)} for a shape",
            value=len(angles),
        )
    at[fixed] = angles
    return at


def ccf(
    scene: Scene,
    pair: str | None,
    slice_angles: tuple[float, ...] | None,
    other_frame: str | None,
    metric: bool,
    stretch: bool,
) -> ShapeSpace:
    """Return the question of a CCF. metric, stretch: its picture needs the metric."""
    sliced = scene.system.joints > 2 or pair is not None or slice_angles is not None
    if sliced and (metric or stretch):
        raise Refusal(
            "``metric`` and ``stretch`` are those of two joints",
            instead="drop them for slices",
        )
    if sliced:
        return ShapeSpace(
            scene,
            field=False,
            planes=True,
            pair=pair,
            slice_angles=slice_angles,
            other_frame=other_frame,
        )
    return ShapeSpace(
        scene,
        map=True,
        gait=True,
        metric=metric or stretch,
        stretch=stretch,
        other_frame=other_frame,
    )


def connection(
    scene: Scene,
    file: Callable | None,
    layout: str | None,
    drawn: bool,
    pair: str | None,
    slice_angles: tuple[float, ...] | None,
    other_frame: str | None,
) -> ShapeSpace:
    """Return the question of a connection. file: the format of its file (`geomech.io.tables.FORMATS`), or None. layout: that
    of the file, None for its first. drawn: its picture is, too."""
    fields.check_joints(scene, file)
    sliced = drawn and (
        scene.system.joints > 2 or pair is not None or slice_angles is not None
    )
    if sliced and other_frame is not None:
        raise Refusal(
            "``compare_frame`` draws maps of two joints",
            instead="drop it, or see ``Study.ccf(pair=...)``",
        )
    picture = {
        "map": drawn and not sliced,
        "planes": sliced,
        "pair": pair,
        "slice_angles": slice_angles,
        "other_frame": other_frame,
    }
    contents = "" if file is None else fields.contents(file, layout)
    return ShapeSpace(scene, "connection", contents, **picture)
