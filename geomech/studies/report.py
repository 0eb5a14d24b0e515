"""The study of a scene: its connection and CCF, and the displacements of its gait, and
of gaits that it is compared with, by all tiers."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Butterfly, Circle, Gait
from geomech.mathematics.gaits.wound import unwound
from geomech.mathematics.geometry.periods import period_of
from geomech.mathematics.systems.base import System, refuse_singular
from geomech.mathematics.systems.capabilities import near_gait
from geomech.mathematics.systems.swimmer import is_three_link
from geomech.mathematics.tiers.area import AREA
from geomech.mathematics.tiers.fitted import axes as field_axes
from geomech.mathematics.tiers.fitted import is_too_large
from geomech.mathematics.tiers.path import PATH
from geomech.runs.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.available import default_tiers
from geomech.studies.estimates import effort
from geomech.studies.estimates.cost import (
    Job,
    even_part_jobs,
    metric_jobs,
    plane_jobs,
    study_jobs,
    total_cost,
)
from geomech.studies.maps import fields, shape_space
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal, located

N_AMPLITUDES = 10  # about, for each gait
ROUND_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)  # between amplitudes, times a power of ten
ADDED_NOTE = "not in the scene, added to compare the two gaits of Fig. 11(e)"
PLANE = re.compile(r"(slice|A|ccf)_\d+_\d+")  # names of variables of planes
SHARED_COORDINATES = ("tier", "quantity")  # of the tables of all gaits
TABLE_DIMS = ("tier", "quantity", "amplitude", "part")
# Attributes of displacements that a connection does not have.
GAIT_FACTS = ("frequency", "error_is", "gait", "other_gaits")
COMMON_FACTS = ("frame", "body_length", "length_unit", "frequency", "scene_toml")


def answer(tables: SceneTables, progress: Callable | None = None) -> Result:
    """Return the study of a scene as a result.

    It has the displacements of the scene's gait, those of other gaits under names such
    as circle_x, and the fields of shape space, where all of it can be drawn; of three
    joints also the planes of every pair."""
    scene = tables.scene
    gaits = compared_gaits(scene)
    amplitudes = [reachable_amplitudes(scene, gait) for gait in gaits]
    mapped = is_mapped(scene.system)
    if mapped:
        tables.compute_field(progress)

    first = tables.displacements(amplitudes[0], gait=gaits[0])
    found = [*first.variables]
    facts = {**first.attributes, "gait": gait_name(gaits[0])}
    for gait, values in zip(gaits[1:], amplitudes[1:]):
        name = gait_name(gait)
        for variable in tables.displacements(values, gait=gait).variables:
            if is_of_one_gait(variable):
                found.append(with_gait_prefix(variable, name))
    if len(gaits) > 1:
        facts["other_gaits"] = " ".join(gait_name(gait) for gait in gaits[1:])

    if mapped:
        shapes = fields.full_result(tables)
        found += shapes.variables
        facts = {**shapes.attributes, **facts}
    if mapped and scene.system.joints == 3:
        found += pair_variables(tables, {variable.name for variable in found})
    return Result("run", tuple(found), facts)


def pair_variables(tables: SceneTables, present: set[str]) -> list[Variable]:
    """Return the planes of all pairs of three joints as variables, without those whose
    names are present already."""
    planes = [tables.plane(pair) for pair in combinations((1, 2, 3), 2)]
    found = [
        *shape_space.slice_variables(planes),
        *shape_space.connection_variables(planes),
        *shape_space.ccf_variables("ccf", planes),
    ]
    return [variable for variable in found if variable.name not in present]


# Tables of gaits


def gait_name(gait: Gait) -> str:
    """Return the name of a kind of gait."""
    return type(unwound(gait)).__name__.lower()


def is_of_one_gait(variable: Variable) -> bool:
    """Return whether a variable of a table differs between gaits."""
    return variable.name not in SHARED_COORDINATES


def is_of_scene_gait(variable: Variable) -> bool:
    """Return whether a variable is one of the displacements of the scene's gait."""
    return bool(variable.dims) and set(variable.dims) <= {*TABLE_DIMS}


def with_gait_prefix(variable: Variable, gait: str) -> Variable:
    """Return a variable of displacements under the name that it has for another gait,
    such as circle_x."""
    dims = []
    for dim in variable.dims:
        dims.append(dim if dim in SHARED_COORDINATES else f"{gait}_{dim}")
    return replace(variable, name=f"{gait}_{variable.name}", dims=tuple(dims))


def gait_tables(result: Result) -> dict[str, Result]:
    """Return the displacements of each gait by its name, those of the scene's gait
    first."""
    own = result.attributes["gait"]
    names = [own, *_other_gaits(result)]
    return {name: gait_table(result, name) for name in names}


def _other_gaits(result: Result) -> list[str]:
    return result.attributes.get("other_gaits", "").split()


def gait_table(result: Result, gait: str) -> Result:
    """Return the displacements of one gait as a separate result."""
    attributes = result.attributes
    facts = {name: attributes[name] for name in COMMON_FACTS if name in attributes}
    facts["scene"] = f"{attributes['scene']}, {gait}"
    if gait == attributes["gait"]:
        if "error_is" in attributes:
            facts["error_is"] = attributes["error_is"]
        variables = [v for v in result.variables if is_of_scene_gait(v)]
        return Result("displacement", tuple(variables), facts)

    facts["note"] = ADDED_NOTE
    variables = [result[name] for name in SHARED_COORDINATES if name in result]
    prefix = f"{gait}_"
    for v in result.variables:
        if v.name.startswith(prefix):
            dims = tuple(dim.removeprefix(prefix) for dim in v.dims)
            variables.append(replace(v, name=v.name.removeprefix(prefix), dims=dims))
    return Result("displacement", tuple(variables), facts)


def displacements_only(result: Result) -> Result:
    """Return a result without its fields of shape space."""
    names = ("scene", *COMMON_FACTS, *GAIT_FACTS)
    facts = {name: x for name, x in result.attributes.items() if name in names}
    return replace(result.only(*displacement_names(result)), attributes=facts)


def displacement_names(result: Result) -> list[str]:
    """Return the names of the variables of all tables of displacements."""
    prefixes = tuple(f"{name}_" for name in _other_gaits(result))
    found = []
    for v in result.variables:
        if is_of_scene_gait(v) or v.name.startswith(prefixes):
            found.append(v.name)
    return found


def connection_only(result: Result) -> Result:
    """Return the fields of shape space as a separate result, without planes; without
    variables if there are none."""
    in_tables = {*displacement_names(result)}
    variables = []
    for v in result.variables:
        if v.name not in in_tables and not PLANE.fullmatch(v.name):
            variables.append(v)
    facts = {name: x for name, x in result.attributes.items() if name not in GAIT_FACTS}
    return Result("connection", tuple(variables), facts)


def is_mapped(system: System) -> bool:
    """Return whether all of shape space is drawn; for more joints there is `geomech ccf
    --pair`."""
    if system.joints == 2:
        return PATH.is_offered(system)
    if system.joints == 3:
        return AREA.is_offered(system)
    return False


def cost(scene: Scene) -> Cost:
    """Return the cost of a report; Refusal as in the report itself."""
    study = SceneTables(scene)
    system = scene.system
    parts: list[Job] = []
    for k, gait in enumerate(compared_gaits(scene)):
        amplitudes = reachable_amplitudes(scene, gait)
        plans = {}
        for tier in default_tiers(system):
            plans[tier] = study.plan(tier, gait, amplitudes)
        parts += study_jobs(scene, plans, len(amplitudes), gait, tables=k == 0)

    if is_mapped(system):
        parts += even_part_jobs(scene)
        if system.joints == 3:
            pairs = [*combinations((1, 2, 3), 2)]
            parts += plane_jobs(scene, pairs, [scene.gait.middle] * len(pairs))
        # A metric from the velocities of the harmonic table costs nothing more.
        if not (effort.why_no_metric(system) or effort.shares_velocities(system)):
            parts += metric_jobs(scene)
    return total_cost(parts)


def compared_gaits(scene: Scene) -> list[Gait]:
    """Return the scene's gait and, for the three-link swimmer, those of Fig. 11(e), at
    the same frequency."""
    if not is_three_link(scene.system):
        return [scene.gait]
    added = (
        Circle(reverse=True, frequency=scene.frequency),
        Butterfly(frequency=scene.frequency),
    )
    own_kind = type(unwound(scene.gait))
    return [scene.gait, *(gait for gait in added if type(gait) is not own_kind)]


def reachable_amplitudes(scene: Scene, gait: Gait) -> list[float]:
    """Return round amplitudes, with the sign of the gait's own, up to the largest that
    lies inside the field.

    Without a field, or with singular shapes, the last is the gait's own. Refusal for a
    gait that does not move or lies outside."""
    system = scene.system
    up_to_own = (
        not PATH.is_offered(system)
        or system.traits.singularity is not None
        or is_too_large(system, scene.numerics)
    )
    unit = unwound(gait).unit(np.linspace(0, 2 * np.pi, 721))
    is_still = np.ptp(unit, axis=0).max() == 0
    if is_still or (up_to_own and gait.amplitude == 0):
        raise Refusal(
            "[gait] does not move", where=scene.name, instead="give it a size"
        )

    if up_to_own:
        if near_gait(system):
            return _amplitudes_near(scene, gait)
        size = abs(gait.amplitude)
        sizes = [a for a in round_amplitudes(size) if a < size * (1 - 1e-9)] + [size]
    else:
        repeats = [p is not None for p in system.traits.periods]
        limited = np.delete(unit, np.flatnonzero(repeats[: unit.shape[1]]), axis=1)
        largest = np.abs(limited).max(initial=0.0)
        if not largest:  # it moves only variables that no field limits
            return [float(gait.amplitude)]
        sizes = round_amplitudes(_range_of_field(scene, gait) / largest)
    return [float(np.copysign(a, gait.amplitude)) for a in sizes]


def _range_of_field(scene: Scene, gait: Gait) -> float:
    """Return the least distance, rad, from the gait's middle to the edge of the field;
    Refusal if it lies outside."""
    ranges = []
    axes = field_axes(scene.system, scene.numerics)
    for k, (axis, x) in enumerate(zip(axes, gait.middle)):
        if period_of(scene.system.traits.periods, k) is None:
            ranges.append(min(axis[-1] - x, x - axis[0]))
    if min(ranges) <= 0:
        raise Refusal(
            "the gait's centre lies outside the field",
            where=scene.name,
            instead="raise [numerics] extent",
        )
    return min(ranges)


def _amplitudes_near(scene: Scene, gait: Gait) -> list[float]:
    """Return amplitudes about the gait's own for which the system is known; Refusal
    where there are none."""
    phases = scene.numerics.phases
    with located(scene.name):
        refuse_singular(scene.system, gait.cycle(phases)[0])

    found = []
    for k in range(-N_AMPLITUDES, N_AMPLITUDES + 1):
        amplitude = round(1 + 0.05 * k, 2) * gait.amplitude
        alpha, _ = gait.cycle(phases, amplitude)
        if (scene.system.traits.singularity(alpha) >= 0).all():
            found.append(amplitude)
    return found


def round_amplitudes(largest: float) -> list[float]:
    """Return multiples of a round number, about `N_AMPLITUDES` of them, up to
    ``largest``."""
    exact = largest / N_AMPLITUDES
    power = 10.0 ** np.floor(np.log10(exact))

    def distance(step: float) -> float:
        return abs(np.log(step * power / exact))

    step = min(ROUND_STEPS, key=distance) * power
    count = int(largest / step * (1 + 1e-12))
    return [float(f"{k * step:.10g}") for k in range(1, count + 1)]
