"""The connection and the CCF of a scene over shape space: on the scene's grid, or on
planes where two joints move."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.periods import ends_differ, period_of
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.representations.plane import Plane
from geomech.mathematics.geometry.stretch import Stretch
from geomech.mathematics.geometry.stretch import stretch as stretch_to_metric
from geomech.mathematics.systems.base import shape_labels
from geomech.mathematics.systems.capabilities import stored_table
from geomech.mathematics.tiers.area import AREA
from geomech.mathematics.tiers.fitted import finest_grid, refuse
from geomech.mathematics.tiers.harmonic import is_looked_up
from geomech.runs.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.displacement.variables import COMPONENTS, POSE
from geomech.studies.estimates.cost import (
    Job,
    connection_jobs,
    even_part_jobs,
    frame_jobs,
    harmonic_jobs,
    metric_jobs,
    plane_jobs,
    study_jobs,
    total_cost,
)
from geomech.studies.estimates.effort import shares_velocities, why_no_metric
from geomech.studies.maps import fields
from geomech.studies.maps.fields import WHOLE, has_matrix
from geomech.studies.realised import commanded
from geomech.studies.scene_tables import SceneTables, refuse_outside
from rft.core.checks import is_whole, real_array
from rft.core.refusal import Refusal, located

NO_MAP_MESSAGE = (
    "a body with one joint has no map, because a loop of one joint encloses no area: "
    "add a joint, or leave the figure out"
)
MAX_PAIRS = 10  # of joints in a figure: as many as five joints have
ROUNDING = 1e-12  # largest size of a component that is nothing but roundoff
N_RAYS = 72  # directions from the gait's middle in which the zero line is looked for
N_STEPS = 200  # places along each
FIRST_STEP = 0.02  # place on a ray, of its length
LOOP_PHASE = "loop_phase"  # dimension of the loop of joints that give way


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

    study: the tables of the scene. file: contents of a file, one of `fields.CONTENTS`;
    "" for none. field: computed on the scene's grid. mapped: drawn on that grid.
    planes: drawn where two joints move, of ``pair``, such as "1,3" or (1, 3), or of all
    pairs; held: angles of the other joints, rad, the gait's middle if None. metric:
    with the cost of changes of shape. stretch: with shape space stretched to that cost.
    gait: the scene's gait is drawn, and must lie within. other_frame: name of another
    body frame."""

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
        return "request less"

    @cached_property
    def other(self) -> SceneTables | None:
        """Tables in the other frame."""
        if self.other_frame is None:
            return None
        return self.study.in_frame(self.other_frame)

    @property
    def _has_metric(self) -> bool:
        """Whether the metric is computed: if asked for, or if the file holds one."""
        if self.metric:
            return True
        if not self.file:
            return False
        if self.file == WHOLE:
            return not why_no_metric(self.scene.system)
        return has_matrix(self.scene.system)

    @property
    def _has_area(self) -> bool:
        """Whether the CCF is integrated over the scene's gait."""
        return self.gait and AREA.is_offered(self.scene.system)

    @property
    def _has_harmonics(self) -> bool:
        return self.file == WHOLE and is_looked_up(self.scene.system)

    @cached_property
    def pairs_and_origins(self) -> list[tuple[tuple[int, int], np.ndarray]]:
        """Pairs of joints of the planes, counted from 1, and the shape through which
        each plane goes."""
        if not self.planes:
            return []
        joints = self.scene.system.joints
        is_single = self.pair is not None
        if is_single:
            pairs = [_checked_pair(self.pair, joints)]
        else:
            pairs = list(combinations(range(1, joints + 1), 2))
        if len(pairs) > MAX_PAIRS:
            raise Refusal(
                f"{joints} joints have {len(pairs)} pairs",
                instead=f"choose one, such as ``pair`` 1,{joints}, or give the chain "
                "[body] modes",
            )
        return [
            (pair, plane_origin(self.scene, pair, self.held, is_single))
            for pair in pairs
        ]

    def check(self) -> None:
        """Refuse a computation that makes no sense for the scene."""
        system = self.scene.system
        with located(self.scene.name):
            refuse(system)
            if (self.mapped or self.planes) and system.joints == 1:
                raise Refusal(NO_MAP_MESSAGE)
            if self.gait:
                refuse_outside(self.scene)
            if self.metric:
                reason = why_no_metric(system)
                if reason:
                    raise Refusal(
                        reason,
                        where=self.scene.name,
                        instead="remove ``metric`` and ``stretch``",
                    )
            if self.other_frame is not None and len(self.pairs_and_origins) > 1:
                raise Refusal(
                    "``compare_frame`` draws one pair of joints",
                    instead="choose one with ``pair``",
                )
        _ = self.other

    def cost(self) -> Cost:
        jobs = []
        with located(self.scene.name):
            for study in self._studies:
                jobs += self._jobs(study)
            return total_cost(jobs)

    @property
    def _studies(self) -> list[SceneTables]:
        """Tables of the scene, and in the other frame if there is one."""
        if self.other is None:
            return [self.study]
        return [self.study, self.other]

    def _jobs(self, study: SceneTables) -> list[Job]:
        scene = study.scene
        jobs: list[Job] = []
        if self.pairs_and_origins:
            pairs, origins = zip(*self.pairs_and_origins)
            jobs += plane_jobs(scene, pairs, origins) + frame_jobs(scene)
        if not self.field:
            return jobs
        if study is not self.study:
            return jobs + connection_jobs(scene)

        if self._has_area:
            plans = {AREA.name: study.plan(AREA.name)}
            jobs += study_jobs(scene, plans, 1, tables=False)
        jobs += connection_jobs(scene)
        if self._has_metric:
            jobs += metric_jobs(scene)
        if self.file:
            jobs += even_part_jobs(scene)
        # The jobs of the metric have the harmonics already where both share velocities.
        comes_with_metric = self._has_metric and shares_velocities(scene.system)
        if self._has_harmonics and not comes_with_metric:
            jobs += harmonic_jobs(scene)
        return jobs

    def compute(self, progress: Callable) -> ShapeSpace:
        """Compute the planes and the tables. progress: called with the fraction
        done."""
        start = time.perf_counter()
        parts = self._parts()
        values = []
        for k, part in enumerate(parts):

            def report(fraction: float, k: int = k) -> None:
                progress((k + fraction) / len(parts))

            values.append(part(report))

        count = len(self.pairs_and_origins)
        other_planes = ()
        if self.other:
            other_planes = tuple(values[count : 2 * count])
        stretched = None
        if self.stretch:
            stretched = stretch_to_metric(self.study.metric)
        enclosed = None
        if self._has_area:
            amplitude = self.scene.gait.amplitude
            enclosed = self.study.displacements([amplitude], [AREA.name])
        return ShapeSpace(
            self.study,
            self.other,
            tuple(values[:count]),
            other_planes,
            stretched,
            enclosed,
            self.cost().balances,
            time.perf_counter() - start,
        )

    def _parts(self) -> list[Callable]:
        """Return the parts of the computation, functions of a report of progress, in
        order: planes first."""
        parts: list[Callable] = []
        for study in self._studies:
            for pair, origin in self.pairs_and_origins:
                parts.append(_plane_computation(study, pair, origin))
        if not self.field:
            return parts

        parts.append(self.study.compute_field)
        if self._has_metric:
            parts.append(self.study.compute_metric)
        if self._has_harmonics:
            parts.append(self.study.compute_harmonics)
        if self.other and not self.pairs_and_origins:
            parts.append(self.other.compute_field)
        return parts


def _plane_computation(
    study: SceneTables, pair: tuple[int, int], origin: np.ndarray
) -> Callable[[Callable], Plane]:
    def compute(progress: Callable) -> Plane:
        return study.plane(pair, origin, progress=progress)

    return compute


def ccf_variables(name: str, planes: Sequence[Plane]) -> list[Variable]:
    """Return the CCFs of planes as variables such as NAME_1_3, with their errors."""
    found = []
    for plane in planes:
        ccf = plane.ccf
        first, second = plane.pair
        found.append(
            Variable(
                name + joint_suffix(plane),
                plane_dims(plane),
                ccf.values,
                fields.component_units(ccf.unit, "rad2"),
                f"CCF of joints {first} and {second}",
                plane.error.values,
            )
        )
    return found


def connection_variables(planes: Sequence[Plane]) -> list[Variable]:
    """Return the connections of the two joints of planes as variables A_1_3."""
    found = []
    for plane in planes:
        component, *angles = plane_dims(plane)
        dims = (component, "moving_joint", *angles)
        units = fields.component_units(plane.connection.unit, "rad")
        label = "columns of A for the joints that move"
        values = plane.connection.A
        found.append(Variable(f"A{joint_suffix(plane)}", dims, values, units, label))
    return found


def slice_variables(planes: Sequence[Plane]) -> list[Variable]:
    """Return the axes of planes, and the shapes through which they go, such as
    slice_1_3."""
    axes: dict[str, np.ndarray] = {}
    periods: dict[str, float | None] = {}
    shapes = []
    for plane in planes:
        _, *angles = plane_dims(plane)
        axes.update(zip(angles, plane.connection.axes))
        periods.update(zip(angles, plane.connection.periods or (None, None)))
        name = f"slice{joint_suffix(plane)}"
        label = "shape through which the plane goes"
        shapes.append(Variable(name, ("joint",), plane.at, "rad", label))

    coordinates = [Variable(name, (name,), axis, "rad") for name, axis in axes.items()]
    joints = np.arange(1, len(planes[0].at) + 1)
    component = Variable("component", ("component",), [*COMPONENTS])
    joint = Variable("joint", ("joint",), joints)
    around = fields.period_variables([*periods], tuple(periods.values()))
    return [component, joint, *coordinates, *around, *shapes]


def joint_suffix(plane: Plane) -> str:
    """Return the ending of names for the joints of a plane, such as _1_3."""
    i, j = plane.pair
    return f"_{i}_{j}"


def plane_dims(plane: Plane) -> tuple[str, str, str]:
    """Return the dimensions of the CCF of a plane."""
    i, j = plane.pair
    return ("component", f"alpha_{i}", f"alpha_{j}")


def zero_line(ccf: Field, gait: Gait) -> list[Variable]:
    """Return how far from the gait's middle the x component changes sign: the nearest
    and the farthest place, and the share of directions in which there is one; nan
    without any. Nothing for a field with gaps, or one that is zero, or for a gait that
    winds around a variable and so has no middle."""
    x = Field(ccf.axes, ccf.values[0], ccf.degree, periods=ccf.periods)
    if x.masked or np.abs(x.values).max() < ROUNDING or ends_differ(gait):
        return []
    middle = gait.middle
    reach = np.inf
    for k, (axis, m) in enumerate(zip(x.axes, middle)):
        period = period_of(ccf.periods, k)
        if period is None:
            reach = min(reach, axis[-1] - m, m - axis[0])
        else:
            reach = min(reach, period / 2)
    has_zero_line, distances = _sign_changes(x, middle, reach)
    nearest = farthest = np.nan
    if has_zero_line.any():
        nearest, farthest = distances.min(), distances.max()

    place = "from the gait's middle to the zero line of x"
    share = "share of directions from the gait's middle with a zero line of x"
    scalars = (
        ("zero_line_nearest", nearest, "rad", f"least distance {place}"),
        ("zero_line_farthest", farthest, "rad", f"largest distance {place}"),
        ("zero_line_share", has_zero_line.mean(), "1", share),
        ("zero_line_reach", reach, "rad", "largest distance that was searched"),
    )
    return [
        Variable(name, (), value, unit, label) for name, value, unit, label in scalars
    ]


def _sign_changes(
    field: Field, middle: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return whether a field changes sign along each ray from the middle, (`N_RAYS`,),
    and the distance, rad, of the first change on the rays that have one."""
    angles = 2 * np.pi * np.arange(N_RAYS) / N_RAYS
    steps = np.linspace(FIRST_STEP, 1, N_STEPS) * reach
    directions = np.stack([np.cos(angles), np.sin(angles)], -1)
    rays = directions[:, None] * steps[:, None]
    has_changed = np.zeros((N_RAYS, N_STEPS - 1), bool)
    if field.values.min() < 0 < field.values.max():
        has_changed = np.diff(np.sign(field(middle + rays)), axis=1) != 0
    has_zero_line = has_changed.any(1)
    return has_zero_line, steps[has_changed.argmax(1)[has_zero_line]]


def loop_variables(study: SceneTables) -> list[Variable]:
    """Return the loop that joints which give way really make under the scene's gait, a
    variable over ``loop_phase`` for each shape variable; none where the gait prescribes
    the shape."""
    scene = study.scene
    loop = study.realised()
    if loop is scene.gait:
        return []
    alpha, _ = loop.cycle(scene.numerics.phases)
    phase = 2 * np.pi * np.arange(len(alpha)) / len(alpha)
    dims = (LOOP_PHASE,)
    label = "phase of the gait, 2 pi per cycle"
    found = [Variable(LOOP_PHASE, dims, phase, "rad", label)]
    names = fields.angle_names(alpha.T)
    for name, values, (words, unit) in zip(names, alpha.T, shape_labels(scene.system)):
        label = f"{words} of the loop that the shape makes"
        found.append(Variable(f"loop_{name}", dims, values, unit, label))
    command, _ = scene.gait.cycle(len(alpha))
    for name, values in zip(names, commanded(scene.system, command).T):
        label = "command of the loop"
        found.append(Variable(f"loop_command_{name}", dims, values, "rad", label))
    return found


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
    """Return the joints, counted from 1, of a text such as 1,3 or of two numbers."""
    names = pair
    if isinstance(pair, str):
        names = pair.split(",")
        if len(names) != 2 or not all(x.strip().isdecimal() for x in names):
            raise Refusal(
                f"{pair!r} is not two joints such as 1,{joints}", where="``pair``"
            )
    elif np.ndim(pair) != 1 or len(pair) != 2 or not all(map(is_whole, pair)):
        raise Refusal("pair must be two joints such as (1, 2)", value=pair)

    i, j = (int(x) for x in names)
    if i == j or not all(1 <= k <= joints for k in (i, j)):
        raise Refusal(
            f"{pair!r} must be two different joints from 1 to {joints}",
            where="``pair``",
        )
    return i, j


def plane_origin(
    scene: Scene,
    pair: tuple[int, int],
    angles: tuple[float, ...] | None,
    is_single: bool,
) -> np.ndarray:
    """Return the shape (joints,) through which the plane of a pair of joints goes.

    angles: one for all other joints, or a whole shape; the gait's middle if None.
    is_single: there is no other plane, so that angles may also be those of the other
    joints one by one."""
    origin = scene.gait.middle.copy()
    fixed = [k for k in range(scene.system.joints) if k + 1 not in pair]
    if angles is not None and not fixed:
        raise Refusal(
            "``slice`` gives the angles of the other joints, and this body has "
            "only two",
            instead="leave it out",
        )
    if angles is None:
        return origin

    values = real_array("``slice``", angles)
    if values.ndim != 1:
        raise Refusal("``slice`` must be a list of angles", value=angles)
    extent = scene.numerics.extent
    has_own_field = stored_table(scene.system, "connection")
    if not (has_own_field or all(abs(angle) <= extent for angle in angles)):
        raise Refusal(
            f"the angles must lie within the field's {extent:g} rad",
            where="``slice``",
            instead="give smaller angles, or raise ``extent``",
        )
    if len(angles) == len(origin) > 1:
        return np.array(angles)

    is_one_by_one = is_single and len(angles) == len(fixed)
    if len(angles) != 1 and not is_one_by_one:
        choices = "or "
        if is_single and len(fixed) > 1:
            choices = f"{len(fixed)} one by one, or "
        raise Refusal(
            f"``slice`` takes one angle for all fixed joints, {choices}{len(origin)} "
            "for a shape",
            value=len(angles),
        )
    origin[fixed] = angles
    return origin
