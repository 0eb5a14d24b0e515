"""The cheapest tier and settings for a displacement within a tolerance."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.capabilities import (
    pieces_per_length,
    settling,
    solver_of,
)
from geomech.mathematics.tiers.base import Plan, solved_phases
from geomech.mathematics.tiers.direct import DIRECT
from geomech.scenes.model import Scene
from geomech.studies.displacement.variables import displacement_result, timing_variables
from geomech.studies.estimates import cost, uncertainty
from geomech.studies.estimates.elements import (
    MAX_ELEMENTS,
    gait_with_elements,
    is_refinable,
    n_elements,
    with_elements,
)
from geomech.studies.estimates.estimate import (
    MIN_STEPS,
    N_COMPARED,
    direct_with_error_parts,
    errors_from_direct,
    evenly_spaced,
    pose_distance,
)
from geomech.studies.scene_tables import SceneTables
from rft.core.checks import is_number, real_array
from rft.core.refusal import Refusal

MAX_PHASES = 1 << 16
MAX_PIECES = 640  # of the body, for a tolerance
N_PILOT = 9  # amplitudes at which look-up tiers are tried first


@dataclass(frozen=True, eq=False)
class _Request:
    """Displacements (B, 3) that are wanted within ``tol`` body lengths.

    allow: called with the jobs (`geomech.studies.estimates.cost`) that are about to
    run."""

    study: SceneTables
    gait: Gait
    amplitudes: np.ndarray
    tol: float
    allow: Callable

    @property
    def scene(self) -> Scene:
        return self.study.scene


class _Answer(NamedTuple):
    """Poses (B, 3) of a tier, their errors (B, 2) in body lengths and rad, and the
    settings that were chosen."""

    tier: str
    poses: np.ndarray
    error: np.ndarray
    settings: Mapping[str, int]


class _Pilot(NamedTuple):
    """Reference of the direct tier at a few amplitudes, by their indices."""

    indices: np.ndarray
    poses: np.ndarray
    error: np.ndarray
    phases: int


def allow_all(jobs: list) -> None:
    """Let jobs run whatever they cost."""


def cheapest_displacements(
    scene: Scene,
    amplitudes: Sequence[float],
    tol: float,
    gait: Gait | None = None,
    allow: Callable = allow_all,
) -> Result:
    """Return the displacements of a gait by the cheapest tier whose position errors are
    at most ``tol`` body lengths.

    The result is that of `SceneTables.displacements`, with the settings found as
    chosen_phases, chosen_pieces, chosen_elements or chosen_grid. Look-up tiers are
    tried from the cheapest on, as long as they cost less than the direct tier. For the
    direct tier the fewest phases are found; its seconds include the search.

    allow: called with the jobs (`geomech.studies.estimates.cost`) that are about to
    run. Refusal if no tier is accurate enough."""
    if not (is_number(tol) and 0 < tol <= 1e300):
        raise Refusal("``tolerance`` must be a number > 0 in body lengths", value=tol)

    start = time.perf_counter()
    study = SceneTables(scene)
    gait = scene.fitting_gait(scene.gait if gait is None else gait)
    amplitudes = _checked_amplitudes(scene, amplitudes)
    request = _Request(study, gait, amplitudes, tol, allow)
    scene.note_turns(gait, amplitudes)
    _refuse_below_settling(request)

    allow(cost.medium_jobs(scene, gait, len(amplitudes)))
    medium = uncertainty.medium_spread(scene, gait, amplitudes)
    answer = _cheapest_answer(request)

    seconds = {answer.tier: time.perf_counter() - start}
    more = timing_variables(seconds, ())
    for name, value in answer.settings.items():
        label = "chosen for the tolerance"
        more.append(Variable(f"chosen_{name}", (), value, "1", label))
    return displacement_result(
        scene,
        gait,
        amplitudes,
        {answer.tier: answer.poses},
        {answer.tier: answer.error},
        medium,
        more=more,
        tolerance=float(tol),
    )


def _checked_amplitudes(scene: Scene, amplitudes: Sequence[float]) -> np.ndarray:
    amplitudes = real_array("amplitudes", amplitudes)
    if amplitudes.ndim != 1 or not amplitudes.size:
        raise Refusal(
            "amplitudes must be a list of numbers",
            value=amplitudes.tolist(),
            where=scene.name,
        )
    return amplitudes


def _refuse_below_settling(request: _Request) -> None:
    """Refuse a tolerance that cycles do not repeat to."""
    repeated_to = settling(request.scene.system)
    if request.tol <= repeated_to:
        raise Refusal(
            f"cycles with these effects repeat only to {repeated_to:g}",
            where=request.scene.name,
            instead="raise ``tolerance``",
        )


def _cheapest_answer(request: _Request) -> _Answer:
    """Return the answer of the first look-up tier that is accurate enough, else that of
    the direct tier; Refusal if that is not accurate enough either."""
    phases = 8 * request.gait.harmonics
    if request.scene.system.traits.steps:
        phases = max(MIN_STEPS, phases)
    else:
        phases = max(32, phases)

    plans = _lookup_plans(request)
    if plans:
        pilot = _run_pilot(request, phases)
        phases = pilot.phases
        answer = _cheapest_lookup(request, plans, pilot)
        if answer is not None:
            return answer

    answer = _refined_direct(request, phases)
    _refuse_inaccurate(request, answer)
    return answer


def _lookup_plans(request: _Request) -> dict[str, Plan]:
    """Return the plans of the tiers other than the direct one, by name."""
    plans = {}
    for tier in request.study.tiers:
        plan = request.study.plan(tier, request.gait, request.amplitudes)
        if not plan.exact:
            plans[tier] = plan
    return plans


def _run_pilot(request: _Request, phases: int) -> _Pilot:
    """Return the direct tier at a few amplitudes, within a quarter of the tolerance."""
    indices = evenly_spaced(len(request.amplitudes), min(N_COMPARED, N_PILOT))
    few = _Request(
        request.study,
        request.gait,
        request.amplitudes[indices],
        request.tol / 4,
        request.allow,
    )
    answer = _refined_direct(few, phases)
    return _Pilot(indices, answer.poses, answer.error, answer.settings["phases"])


def _cheapest_lookup(
    request: _Request, plans: Mapping[str, Plan], pilot: _Pilot
) -> _Answer | None:
    """Return the answer of the cheapest look-up tier within the tolerance; None if
    there is none that takes fewer balances than the direct tier."""
    scene, count = request.scene, len(request.amplitudes)
    balances = {}
    for tier, plan in plans.items():
        balances[tier] = cost.n_balances(plan, count, pilot.phases)
    direct_balances = count * solved_phases(scene.system, request.gait, pilot.phases)

    for tier in sorted(plans, key=balances.get):
        if balances[tier] >= direct_balances:
            return None
        request.allow(cost.prediction_jobs(scene, plans[tier], count))
        if not _passes_pilot(request, tier, pilot):
            continue

        poses = request.study.poses(tier, request.gait, request.amplitudes)
        error = _lookup_error(request, tier, poses)
        if error[:, 0].max() <= request.tol:
            return _Answer(tier, poses, error, {"grid": scene.numerics.grid})
    return None


def _passes_pilot(request: _Request, tier: str, pilot: _Pilot) -> bool:
    """Return whether a tier is accurate enough at the amplitudes of the pilot."""
    try:
        poses = request.study.poses(
            tier, request.gait, request.amplitudes[pilot.indices]
        )
    except ValueError:  # the gait leaves the field or the family of this tier
        return False
    length = body_size(request.scene.system)
    error = pose_distance(poses, pilot.poses, length) + pilot.error
    return error[:, 0].max() <= request.tol


def _lookup_error(request: _Request, tier: str, poses: np.ndarray) -> np.ndarray:
    """Return the errors (B, 2) of poses by a look-up tier. They cover the spread of
    tiers whose answer depends on the surface that a loop of three and more joints
    spans."""
    scene, gait, amplitudes = request.scene, request.gait, request.amplitudes
    error = errors_from_direct(scene, poses, gait, amplitudes)
    spread = request.study.spread(tier, gait, amplitudes)
    if spread is None:
        return error
    return np.maximum(error, spread / [body_size(scene.system), 1.0])


def _refuse_inaccurate(request: _Request, answer: _Answer) -> None:
    """Refuse where even the direct tier has errors beyond the tolerance."""
    largest = answer.error[:, 0].max()
    if largest <= request.tol:
        return
    finer = "use a finer table"
    if solver_of(request.scene.system):
        finer = "lower [numerics] regularisation and tolerance"
    settings = " and ".join(f"{n} {name}" for name, n in answer.settings.items())
    raise Refusal(
        f"no tier reaches {request.tol:g} body lengths (best estimate {largest:.1e} "
        f"with {settings})",
        where=request.scene.name,
        instead=f"raise ``tolerance``, or {finer}",
    )


def _refined_direct(request: _Request, phases: int) -> _Answer:
    """Return the direct tier with settings doubled until all positions are within the
    tolerance, or doubling no longer helps.

    Each time the setting with the largest error is doubled: the phases, or the pieces
    or elements of the body. Only amplitudes that need it are computed again."""
    scene, gait, amplitudes = request.scene, request.gait, request.amplitudes
    request.allow(cost.direct_jobs(scene, gait, len(amplitudes), phases))
    poses, *error_parts = direct_with_error_parts(scene, gait, amplitudes, phases)
    # Errors (3, B, 2) of phases and rounding, of pieces, and of elements.
    parts = np.array(error_parts)
    counts = _initial_counts(scene, phases)
    limits = _count_limits(scene)

    pending = np.arange(len(amplitudes))
    while True:
        error = parts.sum(0)
        pending = pending[error[pending, 0] > request.tol]
        if not pending.size:
            break
        coarsest = _coarsest_setting(parts[:, pending, 0], counts)
        if 2 * counts[coarsest] > limits[coarsest]:
            break

        counts[coarsest] *= 2
        finer = _finer(scene, gait, counts)
        jobs = cost.direct_jobs(*finer, len(pending), counts["phases"])
        request.allow(jobs)
        finer_poses, *finer_parts = direct_with_error_parts(
            *finer, amplitudes[pending], counts["phases"]
        )
        before = error[pending, 0]
        poses[pending] = finer_poses
        parts[:, pending] = np.array(finer_parts)
        has_stalled = (parts.sum(0)[pending, 0] > 0.9 * before).all()
        if has_stalled and counts["phases"] > 1024:
            break
    return _Answer(DIRECT.name, poses, parts.sum(0), _used_counts(scene, counts))


def _initial_counts(scene: Scene, phases: int) -> dict[str, int]:
    return {
        "phases": phases,
        "pieces": getattr(solver_of(scene.system), "pieces", 0),
        "elements": n_elements(scene.system),
    }


def _count_limits(scene: Scene) -> dict[str, int]:
    max_elements = MAX_ELEMENTS if is_refinable(scene.system) else 0
    return {"phases": MAX_PHASES, "pieces": MAX_PIECES, "elements": max_elements}


def _used_counts(scene: Scene, counts: Mapping[str, int]) -> dict[str, int]:
    """Return the counts that the scene's system has."""
    used = {"phases": counts["phases"]}
    if pieces_per_length(scene.system) > 0:
        used["pieces"] = counts["pieces"]
    if counts["elements"] > 0:
        used["elements"] = counts["elements"]
    return used


def _coarsest_setting(parts: np.ndarray, counts: Mapping[str, int]) -> str:
    """Return the name of the setting to double, from errors (3, B) of positions.

    The pieces or the elements count only where they cause more than half of the
    error."""
    largest = parts[1:].max(-1)
    if largest.max() <= 0.5 * parts.sum(0).max():
        return "phases"
    return [*counts][1 + int(largest.argmax())]


def _finer(scene: Scene, gait: Gait, counts: Mapping[str, int]) -> tuple[Scene, Gait]:
    """Return a scene and its gait with given numbers of pieces and elements."""
    if pieces_per_length(scene.system):
        scene = scene.with_numerics(pieces=counts["pieces"])
    count = counts["elements"]
    system = scene.system
    if count == n_elements(system):
        return scene, gait
    gait = gait_with_elements(gait, system, count)
    return scene.changed(system=with_elements(system, count), gait=gait), gait
