"""What a scene's connection and its CCF are over shape space: on the scene's grid, or on planes where two joints move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, ClassVar, NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry.plane import Plane
from geomech.run.cost import Cost
from geomech.scene.model import Scene
from geomech.study import fields
from geomech.study.bench import Study
from geomech.study.cost import Job, frame, harmonics, of_even_part, of_metric, of_planes, price
from geomech.study.cost import connection as fitted
from geomech.study.effort import shared, why_none
from geomech.study.question import Allow, Progress, Question
from geomech.systems.base import shape_labels
from geomech.systems.capabilities import stored_table
from geomech.tiers.fitted import finest_grid
from rft.refusal import Refusal, located

NO_MAP = "a body of one joint has no map, a loop of it encloses no area: give it one joint more, or drop the figure"
MOST_PAIRS = 10  # of joints in a figure: those of five


class Space(NamedTuple):
    """What pictures of shape space are drawn from. beside, planes_beside: the same in another body frame."""

    study: Study
    beside: Study | None = None
    planes: tuple[Plane, ...] = ()
    planes_beside: tuple[Plane, ...] = ()


@dataclass(frozen=True)
class ShapeSpace(Question):
    """The connection or the CCF of a scene.

    file: with all that a file has, metric and harmonics included; else the CCF alone. field: it is computed on the scene's
    grid. map: that is drawn. planes: those where two joints move are drawn, of ``pair``, such as "1,3", or of all pairs;
    held: angles of the other joints, rad, the gait's middle if None. metric: what a change of shape costs, too. gait: the
    scene's is drawn, and must lie within. beside: another body frame, in which it is drawn, too."""

    scene: Scene
    file: bool = False
    field: bool = True
    map: bool = False
    planes: bool = False
    pair: str | None = None
    held: tuple[float, ...] | None = None
    metric: bool = False
    gait: bool = False
    beside: str | None = None

    worth_saying: ClassVar[float] = 1.0

    @property
    def title(self) -> str:
        return f"{'field' if self.field else 'planes'} of {self.scene.name}"

    @property
    def less(self) -> str:
        joints = self.scene.system.joints
        return f"lower --grid, to {finest_grid(joints)} or less" if joints > 2 and self.field else "ask for less"

    @cached_property
    def study(self) -> Study:
        return Study(self.scene)

    @cached_property
    def other(self) -> Study | None:
        """The study in the other frame."""
        return None if self.beside is None else self.study.in_frame(self.beside)

    @property
    def _costed(self) -> bool:
        """Whether the metric is computed."""
        return self.metric or (self.file and not why_none(self.scene.system))

    @property
    def _harmonics(self) -> bool:
        return self.file and self.study.has_harmonics

    @cached_property
    def _at(self) -> list[tuple[tuple[int, int], np.ndarray]]:
        """The pairs of joints of planes, from 0, and the shape through which each goes."""
        if not self.planes:
            return []
        joints = self.scene.system.joints
        pairs = [_pair(self.pair, joints)] if self.pair is not None else list(combinations(range(joints), 2))
        if len(pairs) > MOST_PAIRS:
            raise Refusal(
                f"{joints} joints have {len(pairs)} pairs",
                instead=f"say which, such as --pair 1,{joints}, or give a chain [body] modes",
            )
        return [(one, through(self.scene, one, self.held, self.pair is not None)) for one in pairs]

    def check(self) -> None:
        system, name = self.scene.system, self.scene.name
        with located(name):
            self.study.refuse_connection()
            if (self.map or self.planes) and system.joints == 1:
                raise Refusal(NO_MAP)
            if self.gait:
                self.study.refuse_outside()
            if self.metric and (reason := why_none(system)):
                raise Refusal(reason, where=name)
            if self.beside is not None and len(self._at) > 1:
                raise Refusal("--beside draws one pair of joints", instead="say which with --pair")
        _ = self.other

    def cost(self) -> Cost:
        with located(self.scene.name):
            return price([job for study in filter(None, (self.study, self.other)) for job in self._jobs(study)])

    def _jobs(self, study: Study) -> list[Job]:
        scene = study.scene
        jobs = [*of_planes(scene, *zip(*self._at)), *frame(scene)] if self._at else []
        if not self.field:
            return jobs
        jobs += fitted(scene)
        if study is self.study:
            jobs += of_metric(scene) if self._costed else []
            jobs += of_even_part(scene) if self.file else []
            jobs += harmonics(scene) if self._harmonics and not (self._costed and shared(scene.system)) else []
        return jobs

    def answer(self, progress: Progress, allow: Allow) -> Result:
        study, parts = self.study, self._parts()
        found = [part(lambda done, k=k: progress((k + done) / len(parts))) for k, part in enumerate(parts)]
        count = len(self._at)
        space = Space(study, self.other, tuple(found[:count]), tuple(found[count : 2 * count]) if self.other else ())
        if self.file:
            whole = fields.of_study(study)
            return Result(whole.kind, whole.variables, whole.attributes, space)
        if not self.field:
            return Result("shape_space", tuple(_of_plane(*x) for x in zip(self._at, space.planes)), {}, space)
        axes = fields.coordinates(study.fitted.axes, shape_labels(self.scene.system))
        return Result("shape_space", (*axes, fields.of_ccf(study.curvature, study.curvature_error)), {}, space)

    def _parts(self) -> list[Callable[[Progress], Any]]:
        """Return what is computed one after the other: planes first."""
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
        return parts + ([self.other.compute_field] if self.other and not self._at else [])


def _of_plane(at: tuple[tuple[int, int], np.ndarray], plane: Plane) -> Variable:
    """Return the CCF of a plane, over its two joints."""
    (i, j), _ = at
    ccf = fields.of_ccf(plane.ccf)
    dims = ("component", f"alpha_{i + 1}", f"alpha_{j + 1}")
    return Variable(f"ccf_{i + 1}_{j + 1}", dims, ccf.values, ccf.unit, f"CCF of joints {i + 1} and {j + 1}")


def _pair(text: str, joints: int) -> tuple[int, int]:
    """Return joints from 0 of 1,3."""
    found = text.split(",")
    if len(found) != 2 or not all(x.strip().isdecimal() for x in found):
        raise Refusal(f"{text!r} is not two joints such as 1,{joints}", where="--pair")
    i, j = (int(x) - 1 for x in found)
    if i == j or not all(0 <= k < joints for k in (i, j)):
        raise Refusal(f"{text!r} must be two different joints from 1 to {joints}", where="--pair")
    return i, j


def through(scene: Scene, pair: tuple[int, int], angles: tuple[float, ...] | None, alone: bool) -> np.ndarray:
    """Return the shape through which the plane of a pair of joints goes. alone: angles may be those of the joints that it
    holds."""
    at, held = scene.gait.middle.copy(), [k for k in range(scene.system.joints) if k not in pair]
    if angles is not None and not held:
        raise Refusal("--slice says where other joints are held, and this body has but two", instead="drop it")
    if angles is None:
        return at
    extent = scene.numerics.extent
    if not (stored_table(scene.system, "connection") or all(abs(a) <= extent for a in angles)):
        raise Refusal(
            f"the angles must lie within the field's {extent:g} rad",
            where="--slice",
            instead="give others, or raise --extent",
        )
    if len(angles) == len(at) > 1:
        return np.array(angles)
    if len(angles) != 1 and not (alone and len(angles) == len(held)):
        ways = f"{len(held)} one by one, " * (alone and len(held) > 1) + "or "
        raise Refusal(
            f"--slice takes one angle for all joints that are held, {ways}{len(at)} for a shape", value=len(angles)
        )
    at[held] = angles
    return at


def ccf(
    scene: Scene, pair: str | None, held: tuple[float, ...] | None, beside: str | None, metric: bool, stretch: bool
) -> ShapeSpace:
    """Return the question of the CCF's picture. metric, stretch: it takes what a change of shape costs."""
    sliced = scene.system.joints > 2 or pair is not None or held is not None
    if sliced and (metric or stretch):
        raise Refusal("--metric and --stretch are those of two joints", instead="drop them for slices")
    if sliced:
        return ShapeSpace(scene, field=False, planes=True, pair=pair, held=held, beside=beside)
    return ShapeSpace(scene, map=True, gait=True, metric=metric or stretch, beside=beside)


def connection(
    scene: Scene, matlab: bool, drawn: bool, pair: str | None, held: tuple[float, ...] | None, beside: str | None
) -> ShapeSpace:
    """Return the question of a connection's file, a .mat file if ``matlab``, and of its picture, if it is ``drawn``."""
    if matlab:
        check_two_joints(scene)
    sliced = drawn and (scene.system.joints > 2 or pair is not None or held is not None)
    if sliced and beside is not None:
        raise Refusal("--beside draws maps of two joints", instead="drop it, or see 'geomech ccf --pair'")
    picture = {"map": drawn and not sliced, "planes": sliced, "pair": pair, "held": held, "beside": beside}
    return ShapeSpace(scene, file=not matlab, **picture)


def check_two_joints(scene: Scene) -> None:
    """Refusal for other than the two joints that sysplotter's layout has arrays for."""
    if (joints := scene.system.joints) != 2:
        why = f"a .mat file has sysplotter's layout, which is of two joints, and this body has {joints}"
        raise Refusal(why, where=scene.name, instead="write a .nc file, which takes any number of joints")
