"""The connection and the CCF of a scene over shape space: on the scene's grid, or on planes where two joints move."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.representations.plane import Plane
from geomech.mathematics.geometry.stretch import Stretch
from geomech.mathematics.geometry.stretch import stretch as stretch_to_metric
from geomech.mathematics.systems.capabilities import stored_table
from geomech.mathematics.tiers.area import AREA
from geomech.mathematics.tiers.fitted import finest_grid, refuse
from geomech.mathematics.tiers.harmonic import is_looked_up
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.estimates.cost import (
    Job,
    even_part_jobs,
    frame_jobs,
    harmonic_jobs,
    metric_jobs,
    plane_jobs,
    total_cost,
)
from geomech.studies.estimates.cost import connection_jobs as fitted
from geomech.studies.estimates.cost import study_jobs as displacement
from geomech.studies.estimates.effort import shares_velocities, why_no_metric
from geomech.studies.maps import fields
from geomech.studies.maps.fields import WHOLE, has_matrix
from geomech.studies.scene_tables import SceneTables, refuse_outside
from geomech.studies.tables import COMPONENTS, POSE
from rft.core.checks import is_whole
from rft.core.refusal import Refusal, located

NO_MAP_MESSAGE = "a body of one joint has no map, a loop of it encloses no area: give it one joint more, or drop the figure"
MAX_PAIRS = 10  # of joints in a figure: as many as five joints have


class ShapeSpace(NamedTuple):
    """What is computed over shape space.

    study: the tables of the scene. other, other_planes: the tables and the planes in
    another body frame. planes: where two joints move. stretch: of shape space, to equal
    effort. enclosed: the displacement of the scene's gait by the area tier. balances,
    seconds: of the computation."""

    study: SceneTables
    other: SceneTables | None
    planes: tuple[Plane, ...]
    other_planes: tuple[Plane, ...]
    stretch: Stretch | None
    enclosed: Result | None
    balances: int
    seconds: float


@dataclass(frozen=True)
class Plan:
    """The computation of a connection or a CCF.

    study: the tables of the scene. file: contents of a file, one of `fields.CONTENTS`; ""
    for none. field: computed on the scene's grid. mapped: drawn on that grid. planes:
    drawn where two joints move, of ``pair``, such as "1,3" or (1, 3), or of all pairs;
    held: angles of the other joints, rad, the gait's middle if None. metric: with the cost
    of changes of shape. stretch: with shape space stretched to that cost. gait: the
    scene's gait is drawn, and must lie within. other_frame: name of another body frame."""

    study: SceneTables
    file: str = ""
    field: bool = True
    mapped: bool = False
    planes: bool = False
    pair: Any = None
    held: tuple[float, ...] | None = None
    metric: bool = False
    stretch: bool = False
    gait: bool = False
    other_frame: str | None = None

    @property
    def scene(self) -> Scene:
        return self.study.scene

    @property
    def cheaper_alternative(self) -> str:
        """Advice where it costs too much."""
        joints = self.scene.system.joints
        if joints > 2 and self.field:
            return f"lower ``grid``, to {finest_grid(joints)} or less"
        return "ask for less"

    @cached_property
    def other(self) -> SceneTables | None:
        """Tables in the other frame."""
        if self.other_frame is None:
            return None
        return self.study.in_frame(self.other_frame)

    @property
    def _costed(self) -> bool:
        """Whether the metric is computed."""
        system = self.scene.system
        needed = {"": False, WHOLE: not why_no_metric(system)}
        return self.metric or needed.get(self.file, has_matrix(system))

    @property
    def _enclosed(self) -> bool:
        """Whether the CCF is integrated over the scene's gait."""
        return self.gait and AREA.is_offered(self.scene.system)

    @property
    def _harmonics(self) -> bool:
        return self.file == WHOLE and is_looked_up(self.scene.system)

    @cached_property
    def at(self) -> list[tuple[tuple[int, int], np.ndarray]]:
        """Pairs of joints of the planes, from 0, and the shape through which each plane
        goes."""
        if not self.planes:
            return []
        joints = self.scene.system.joints
        pairs = list(combinations(range(joints), 2))
        if self.pair is not None:
            pairs = [_checked_pair(self.pair, joints)]
        if len(pairs) > MAX_PAIRS:
            raise Refusal(
                f"{joints} joints have {len(pairs)} pairs",
                instead=f"say which, such as ``pair`` 1,{joints}, or give a chain [body] "
                "modes",
            )
        alone = self.pair is not None
        return [(one, plane_origin(self.scene, one, self.held, alone)) for one in pairs]

    def check(self) -> None:
        system, name = self.scene.system, self.scene.name
        with located(name):
            refuse(system)
            if (self.mapped or self.planes) and system.joints == 1:
                raise Refusal(NO_MAP_MESSAGE)
            if self.gait:
                refuse_outside(self.scene)
            if self.metric and (reason := why_no_metric(system)):
                raise Refusal(reason, where=name)
            if self.other_frame is not None and len(self.at) > 1:
                raise Refusal(
                    "``compare_frame`` draws one pair of joints",
                    instead="say which with ``pair``",
                )
        _ = self.other

    def cost(self) -> Cost:
        with located(self.scene.name):
            return total_cost(
                [
                    job
                    for study in filter(None, (self.study, self.other))
                    for job in self._jobs(study)
                ]
            )

    def _jobs(self, study: SceneTables) -> list[Job]:
        scene = study.scene
        jobs = (
            [*plane_jobs(scene, *zip(*self.at)), *frame_jobs(scene)] if self.at else []
        )
        if not self.field:
            return jobs
        if self._enclosed and study is self.study:
            jobs += displacement(
                scene, {AREA.name: study.plan(AREA.name)}, 1, tables=False
            )
        jobs += fitted(scene)
        if study is self.study:
            jobs += metric_jobs(scene) if self._costed else []
            jobs += even_part_jobs(scene) if self.file else []
            jobs += (
                harmonic_jobs(scene)
                if self._harmonics
                and not (self._costed and shares_velocities(scene.system))
                else []
            )
        return jobs

    def compute(self, progress: Callable) -> ShapeSpace:
        """Return what is computed."""
        study, parts, start = self.study, self._parts(), time.perf_counter()
        values = [
            part(lambda done, k=k: progress((k + done) / len(parts)))
            for k, part in enumerate(parts)
        ]
        count = len(self.at)
        other_planes = ()
        if self.other:
            other_planes = tuple(values[count : 2 * count])
        stretched = stretch_to_metric(study.metric) if self.stretch else None
        enclosed = None
        if self._enclosed:
            amplitude = self.scene.gait.amplitude
            enclosed = study.displacements([amplitude], [AREA.name])
        return ShapeSpace(
            study,
            self.other,
            tuple(values[:count]),
            other_planes,
            stretched,
            enclosed,
            self.cost().balances,
            time.perf_counter() - start,
        )

    def _parts(self) -> list[Callable]:
        """Return the parts of the computation, in order: planes first."""
        studies = [self.study, *filter(None, [self.other])]
        parts: list[Callable] = [
            lambda progress, s=s, pair=pair, at=at: s.plane(pair, at, progress=progress)
            for s in studies
            for pair, at in self.at
        ]
        if not self.field:
            return parts
        parts.append(self.study.compute_field)
        parts += [self.study.compute_metric] if self._costed else []
        parts += [self.study.compute_harmonics] if self._harmonics else []
        return parts + (
            [self.other.compute_field] if self.other and not self.at else []
        )


def ccf_variables(name: str, planes: Sequence[Plane]) -> list[Variable]:
    """Return the CCFs of planes as variables NAME_1_3, with their errors, and the shapes
    through which the planes go, as slice_1_3."""
    found = []
    for plane in planes:
        dims, ending = plane_dims(plane), joint_suffix(plane)
        units = fields.component_units(plane.ccf.unit, "rad2")
        label = f"CCF of joints {plane.pair[0] + 1} and {plane.pair[1] + 1}"
        error = plane.error.values
        values = plane.ccf.values
        found.append(Variable(name + ending, dims, values, units, label, error))
    return found


def connection_variables(planes: Sequence[Plane]) -> list[Variable]:
    """Return the connections of the two joints of planes as variables A_1_3."""
    found = []
    for plane in planes:
        component, *angles = plane_dims(plane)
        dims = (component, "moving_joint", *angles)
        units = fields.component_units(plane.connection.unit, "rad")
        label = "columns of A of the joints that move"
        values = plane.connection.A
        found.append(Variable(f"A{joint_suffix(plane)}", dims, values, units, label))
    return found


def slice_variables(planes: Sequence[Plane]) -> list[Variable]:
    """Return the axes of planes, and the shapes through which they go."""
    axes, shapes = {}, []
    for plane in planes:
        _, *angles = plane_dims(plane)
        axes.update(zip(angles, plane.connection.axes))
        name = f"slice{joint_suffix(plane)}"
        label = "shape through which the plane goes"
        shapes.append(Variable(name, ("joint",), plane.at, "rad", label))
    coordinates = [Variable(name, (name,), axis, "rad") for name, axis in axes.items()]
    joints = np.arange(1, len(planes[0].at) + 1)
    component = Variable("component", ("component",), [*COMPONENTS])
    joint = Variable("joint", ("joint",), joints)
    return [component, joint, *coordinates, *shapes]


def joint_suffix(plane: Plane) -> str:
    i, j = plane.pair
    return f"_{i + 1}_{j + 1}"


def plane_dims(plane: Plane) -> tuple[str, str, str]:
    i, j = plane.pair
    return ("component", f"alpha_{i + 1}", f"alpha_{j + 1}")


ROUNDING = 1e-12  # largest size of a component that is nothing but roundoff
N_RAYS = 72  # directions from the gait's middle in which the zero line is looked for
N_STEPS = 200  # places along each
FIRST_STEP = 0.02  # place on a ray, of its length


def zero_line(ccf: Field, middle: np.ndarray) -> list[Variable]:
    """Return how far from the gait's middle the x component changes sign: the nearest and
    the farthest place, and the share of directions in which there is one; nan without
    any. Nothing for a field with gaps, or one that is zero."""
    x = Field(ccf.axes, ccf.values[0], ccf.degree)
    if x.masked or np.abs(x.values).max() < ROUNDING:
        return []
    reach = min(min(a[-1] - m, m - a[0]) for a, m in zip(x.axes, middle))
    angles = 2 * np.pi * np.arange(N_RAYS) / N_RAYS
    steps = np.linspace(FIRST_STEP, 1, N_STEPS) * reach
    rays = np.stack([np.cos(angles), np.sin(angles)], -1)[:, None] * steps[:, None]
    changed = np.zeros((N_RAYS, N_STEPS - 1), bool)
    if x.values.min() < 0 < x.values.max():
        changed = np.diff(np.sign(x(middle + rays)), axis=1) != 0
    some = changed.any(1)
    nearest = farthest = np.nan
    if some.any():
        first = steps[changed.argmax(1)[some]]
        nearest, farthest = first.min(), first.max()
    place = "from the gait's middle to the zero line of x"
    share = "share of directions from the gait's middle with a zero line of x"
    return [
        Variable("zero_line_nearest", (), nearest, "rad", f"least distance {place}"),
        Variable(
            "zero_line_farthest", (), farthest, "rad", f"largest distance {place}"
        ),
        Variable("zero_line_share", (), some.mean(), "1", share),
        Variable("zero_line_reach", (), reach, "rad", "distance that was looked at"),
    ]


def enclosed_area(area: Result) -> list[Variable]:
    """Return the displacement of the scene's gait by the area that it encloses."""
    amplitude = area["amplitude"]
    value, label = amplitude.values[0], amplitude.label
    variables = [Variable("gait_amplitude", (), value, label=label)]
    for name in POSE:
        one = area[name].at("tier", 0).at("amplitude", 0)
        label = f"{name} by the area tier, over the scene's gait"
        variables.append(replace(one, label=label))
    return variables


def _checked_pair(pair: Any, joints: int) -> tuple[int, int]:
    """Return the joints, counted from 0, of a text such as 1,3 or of two numbers."""
    names = pair
    if isinstance(pair, str):
        names = pair.split(",")
        if len(names) != 2 or not all(x.strip().isdecimal() for x in names):
            raise Refusal(
                f"{pair!r} is not two joints such as 1,{joints}", where="``pair``"
            )
    elif np.ndim(pair) != 1 or len(pair) != 2 or not all(map(is_whole, pair)):
        raise Refusal("pair must be two joints such as (1, 2)", value=pair)
    i, j = (int(x) - 1 for x in names)
    if i == j or not all(0 <= k < joints for k in (i, j)):
        raise Refusal(
            f"{pair!r} must be two different joints from 1 to {joints}",
            where="``pair``",
        )
    return i, j


def plane_origin(
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
