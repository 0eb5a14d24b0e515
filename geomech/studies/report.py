"""The study of a scene: its connection and CCF, and displacements of its gait and of those
it is compared with, by all tiers."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Butterfly, Circle, Gait
from geomech.mathematics.systems.base import System, refuse_singular
from geomech.mathematics.systems.capabilities import near_gait
from geomech.mathematics.systems.swimmer import is_three_link
from geomech.mathematics.tiers.area import AREA
from geomech.mathematics.tiers.fitted import axes as field_axes
from geomech.mathematics.tiers.fitted import is_too_large
from geomech.mathematics.tiers.path import PATH
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.available import default_tiers
from geomech.studies.estimates import effort
from geomech.studies.estimates.cost import (
    Job,
    even_part_jobs,
    metric_jobs,
    plane_jobs,
    total_cost,
)
from geomech.studies.estimates.cost import study_jobs as jobs
from geomech.studies.maps import fields, shape_space
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal, located

N_AMPLITUDES = 10  # or so, for each gait
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)  # of round amplitudes, times a power of ten
ADDED_NOTE = "not in the scene, added to compare the two gaits of Fig. 11(e)"
PLANE = re.compile(r"(slice|A|ccf)_\d+_\d+")  # names of variables of planes
SHARED_COORDINATES = (
    "tier",
    "quantity",
)  # coordinates that the tables of all gaits have
TABLE_DIMS = ("tier", "quantity", "amplitude", "part")  # dimensions of a table
# Facts about displacements that a connection does not have.
GAIT_FACTS = ("frequency", "error_is", "gait", "other_gaits")
COMMON_FACTS = ("frame", "body_length", "length_unit", "frequency", "scene_toml")


def answer(tables: SceneTables, progress: Callable | None = None) -> Result:
    """Return the study of a scene as a result: displacements of its gait, those of other
    gaits under names such as circle_x, and the fields of shape space, where all of it can
    be drawn; of three joints with the planes of every pair."""
    scene = tables.scene
    gaits = compared_gaits(scene)
    amplitudes = [reachable_amplitudes(scene, gait) for gait in gaits]
    mapped = is_mapped(scene.system)
    if mapped:
        tables.compute_field(progress)
    first = tables.displacements(amplitudes[0], gait=gaits[0])
    found, facts = [*first.variables], {**first.attributes, "gait": gait_name(gaits[0])}
    for gait, values in zip(gaits[1:], amplitudes[1:]):
        table = tables.displacements(values, gait=gait)
        found += [
            with_gait_prefix(v, gait_name(gait))
            for v in table.variables
            if is_of_one_gait(v)
        ]
    if len(gaits) > 1:
        facts["other_gaits"] = " ".join(gait_name(gait) for gait in gaits[1:])
    if mapped:
        shapes = fields.full_result(tables)
        found += shapes.variables
        facts = {**shapes.attributes, **facts}
    if mapped and scene.system.joints == 3:
        found += pair_variables(tables, {v.name for v in found})
    return Result("run", tuple(found), facts)


def pair_variables(tables: SceneTables, known: set[str]) -> list[Variable]:
    """Return the planes of all pairs of three joints, without variables that are known."""
    planes = [tables.plane(pair) for pair in combinations(range(3), 2)]
    found = [
        *shape_space.slice_variables(planes),
        *shape_space.connection_variables(planes),
        *shape_space.ccf_variables("ccf", planes),
    ]
    return [v for v in found if v.name not in known]


# Tables of gaits


def gait_name(gait: Gait) -> str:
    """Return the name of a kind of gait."""
    return type(gait).__name__.lower()


def is_of_one_gait(variable: Variable) -> bool:
    """Return whether the table of another gait has a variable of its own."""
    return variable.name not in SHARED_COORDINATES


def is_of_scene_gait(variable: Variable) -> bool:
    """Return whether a variable is of the displacements of the scene's gait."""
    return bool(variable.dims) and set(variable.dims) <= {*TABLE_DIMS}


def with_gait_prefix(variable: Variable, gait: str) -> Variable:
    """Return a variable of displacements under the name that it has for another gait."""
    dims = tuple(
        dim if dim in SHARED_COORDINATES else f"{gait}_{dim}" for dim in variable.dims
    )
    return replace(variable, name=f"{gait}_{variable.name}", dims=dims)


def gait_tables(result: Result) -> dict[str, Result]:
    """Return the displacements of each gait, by its name, the scene's own first."""
    own = result.attributes["gait"]
    found = {own: gait_table(result, own)}
    for gait in result.attributes.get("other_gaits", "").split():
        found[gait] = gait_table(result, gait)
    return found


def gait_table(result: Result, gait: str) -> Result:
    """Return the displacements of a gait as a result of their own."""
    known = result.attributes
    facts = {name: known[name] for name in COMMON_FACTS if name in known}
    facts["scene"] = f"{known['scene']}, {gait}"
    if gait == known["gait"]:
        variables = [v for v in result.variables if is_of_scene_gait(v)]
        if "error_is" in known:
            facts["error_is"] = known["error_is"]
        return Result("displacement", tuple(variables), facts)
    variables = [result[name] for name in SHARED_COORDINATES if name in result]
    start = f"{gait}_"
    for v in result.variables:
        if v.name.startswith(start):
            dims = tuple(dim.removeprefix(start) for dim in v.dims)
            variables.append(replace(v, name=v.name.removeprefix(start), dims=dims))
    return Result("displacement", tuple(variables), {**facts, "note": ADDED_NOTE})


def displacements_only(result: Result) -> Result:
    """Return a result without its fields of shape space."""
    known = ("scene", *COMMON_FACTS, *GAIT_FACTS)
    facts = {k: x for k, x in result.attributes.items() if k in known}
    return replace(result.only(*displacement_names(result)), attributes=facts)


def displacement_names(result: Result) -> list[str]:
    """Return the names of the variables of all tables of displacements."""
    others = result.attributes.get("other_gaits", "").split()
    starts = tuple(f"{name}_" for name in others)
    found = []
    for v in result.variables:
        if is_of_scene_gait(v) or v.name.startswith(starts):
            found.append(v.name)
    return found


def connection_only(result: Result) -> Result:
    """Return the fields of shape space as a result of their own, without planes; without
    variables if there are none."""
    tables = {*displacement_names(result)}
    variables = []
    for v in result.variables:
        if v.name not in tables and not PLANE.fullmatch(v.name):
            variables.append(v)
    facts = {k: x for k, x in result.attributes.items() if k not in GAIT_FACTS}
    return Result("connection", tuple(variables), facts)


def is_mapped(system: System) -> bool:
    """Return whether all of shape space is drawn; for more joints there is `geomech ccf
    --pair`."""
    if system.joints not in (2, 3):
        return False
    return {2: PATH, 3: AREA}[system.joints].is_offered(system)


def cost(scene: Scene) -> Cost:
    """Return the cost of a report; Refusal as in the report itself."""
    study, system = SceneTables(scene), scene.system
    parts: list[Job] = []
    for k, gait in enumerate(compared_gaits(scene)):
        amplitudes = reachable_amplitudes(scene, gait)
        plans = {m: study.plan(m, gait, amplitudes) for m in default_tiers(system)}
        parts += jobs(scene, plans, len(amplitudes), gait, tables=k == 0)
    if is_mapped(system):
        pairs = [*combinations(range(3), 2)] if system.joints == 3 else []
        parts += even_part_jobs(scene) + plane_jobs(
            scene, pairs, [scene.gait.middle] * len(pairs)
        )
        parts += (
            []
            if effort.why_no_metric(system) or effort.shares_velocities(system)
            else metric_jobs(scene)
        )
    return total_cost(parts)


def compared_gaits(scene: Scene) -> list[Gait]:
    """Return the scene's gait and, for the three-link swimmer, those of Fig. 11(e), at the
    same frequency."""
    if not is_three_link(scene.system):
        return [scene.gait]
    more = (
        Circle(reverse=True, frequency=scene.frequency),
        Butterfly(frequency=scene.frequency),
    )
    return [scene.gait, *(g for g in more if type(g) is not type(scene.gait))]


def reachable_amplitudes(scene: Scene, gait: Gait) -> list[float]:
    """Return round amplitudes (`round_amplitudes`), with the sign of the gait's own, up
    to the largest that lies inside the field.

    Without a field, or with singular shapes, the last is the gait's own. Refusal for a gait that does not move or lies
    outside."""
    system, n = scene.system, scene.numerics
    own = (
        not PATH.is_offered(system)
        or system.traits.singularity is not None
        or is_too_large(system, n)
    )
    unit = gait.unit(np.linspace(0, 2 * np.pi, 721))
    if np.ptp(unit, axis=0).max() == 0 or (own and gait.amplitude == 0):
        raise Refusal(
            "[gait] does not move", where=scene.name, instead="give it a size"
        )
    if own:
        size = abs(gait.amplitude)
        if near_gait(scene.system):
            return _amplitudes_near(scene, gait)
        amplitudes = [a for a in round_amplitudes(size) if a < size * (1 - 1e-9)] + [
            size
        ]
        return [float(np.copysign(a, gait.amplitude)) for a in amplitudes]
    room = min(
        min(a[-1] - x, x - a[0])
        for a, x in zip(field_axes(scene.system, scene.numerics), gait.middle)
    )
    if room <= 0:
        raise Refusal(
            "the gait's centre lies outside the field",
            where=scene.name,
            instead="raise [numerics] extent",
        )
    return [
        float(np.copysign(a, gait.amplitude))
        for a in round_amplitudes(room / np.abs(unit).max())
    ]


def _amplitudes_near(scene: Scene, gait: Gait) -> list[float]:
    """Return amplitudes about the gait's own for which the system is known; Refusal where there are none."""
    amplitudes = [
        round(1 + 0.05 * k, 2) * gait.amplitude
        for k in range(-N_AMPLITUDES, N_AMPLITUDES + 1)
    ]
    with located(scene.name):
        refuse_singular(scene.system, gait.cycle(scene.numerics.phases)[0])
    reached = lambda a: (
        scene.system.traits.singularity(gait.cycle(scene.numerics.phases, a)[0]) >= 0
    ).all()
    return [a for a in amplitudes if reached(a)]


def round_amplitudes(top: float) -> list[float]:
    """Return multiples of a round number, about AMPLITUDES of them, up to ``top``."""
    exact = top / N_AMPLITUDES
    power = 10.0 ** np.floor(np.log10(exact))
    step = min(STEPS, key=lambda s: abs(np.log(s * power / exact))) * power
    count = int(top / step * (1 + 1e-12))
    return [float(f"{k * step:.10g}") for k in range(1, count + 1)]
