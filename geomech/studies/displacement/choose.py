"""The cheapest tier and settings for a displacement within a tolerance."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.gait import checked_gait
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.capabilities import (
    pieces_per_length,
    settling,
    solver_of,
)
from geomech.mathematics.tiers.base import solved_phases
from geomech.mathematics.tiers.direct import DIRECT
from geomech.scenes.model import Scene
from geomech.studies import tables
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
    pose_distance,
)
from geomech.studies.scene_tables import SceneTables
from rft.core.checks import is_number, real_array
from rft.core.refusal import Refusal

MAX_PHASES = 1 << 16
MAX_PIECES = 640  # of body, for a tolerance


def cheapest_displacements(
    scene: Scene,
    amplitudes: Sequence[float],
    tol: float,
    gait: Gait | None = None,
    ask: Callable = lambda jobs: None,
) -> Result:
    """Return displacements as `SceneTables.displacements` does for the cheapest tier with errors
    of position of at most ``tol`` body lengths, with the settings chosen_phases,
    chosen_pieces or chosen_grid.

    For the direct tier, the fewest phases are found. Its seconds include the search. Look-up tiers are tried in the
    order of their cost, as long as that is below the direct tier's. ask: called with the jobs to come
    (`geomech.studies.estimates.cost`) before each. Refusal if no tier is accurate enough."""
    if not (is_number(tol) and 0 < tol <= 1e300):
        raise Refusal("``tolerance`` must be a number > 0 in body lengths", value=tol)
    study, start = SceneTables(scene), time.perf_counter()
    system, gait = scene.system, checked_gait(scene.gait if gait is None else gait)
    amplitudes = real_array("amplitudes", amplitudes)
    if amplitudes.ndim != 1 or not amplitudes.size:
        raise Refusal(
            "amplitudes must be a list of numbers",
            value=amplitudes.tolist(),
            where=scene.name,
        )
    scene.note_turns(gait, amplitudes)
    if tol <= settling(system):
        raise Refusal(
            f"cycles with these effects repeat to {settling(system):g} only",
            where=scene.name,
            instead="raise ``tolerance``",
        )
    ask(cost.medium_jobs(scene, gait, len(amplitudes)))
    medium = uncertainty.medium_spread(scene, gait, amplitudes)

    def answer(tier: str, poses, error, settings: dict) -> Result:
        took = {tier: time.perf_counter() - start}
        more = tables.timing_variables(took, ())
        for name, value in settings.items():
            label = "chosen for the tolerance"
            more.append(Variable(f"chosen_{name}", (), value, "1", label))
        return tables.displacement_result(
            scene,
            gait,
            amplitudes,
            {tier: poses},
            {tier: error},
            medium,
            more=more,
            tolerance=float(tol),
        )

    sampled = np.unique(
        np.linspace(0, len(amplitudes) - 1, min(N_COMPARED, 9)).round().astype(int)
    )
    phases = max(MIN_STEPS if system.traits.steps else 32, 8 * gait.harmonics)
    plans = {
        m: plan
        for m in study.tiers
        if not (plan := study.plan(m, gait, amplitudes)).exact
    }
    if plans:
        pilot, settings = _refined(
            scene, gait, amplitudes[sampled], tol / 4, phases, ask
        )
        phases = settings["phases"]
    balances = {
        m: cost.n_balances(plan, len(amplitudes), phases) for m, plan in plans.items()
    }
    enough = len(amplitudes) * solved_phases(
        system, gait, phases
    )  # of the system itself
    for tier in sorted(plans, key=balances.get):
        if balances[tier] >= enough:
            break
        ask(cost.prediction_jobs(scene, plans[tier], len(amplitudes)))
        try:
            checked = study.poses(tier, gait, amplitudes[sampled])
        except ValueError:  # the gait leaves the field or the family of this tier
            continue
        if (pose_distance(checked, pilot[0], body_size(system)) + pilot[1])[
            :, 0
        ].max() <= tol:
            poses = study.poses(tier, gait, amplitudes)
            error, spread = (
                errors_from_direct(scene, poses, gait, amplitudes),
                study.spread(tier, gait, amplitudes),
            )
            if spread is not None:
                error = np.maximum(error, spread / [body_size(system), 1.0])
            if error[:, 0].max() <= tol:
                return answer(tier, poses, error, {"grid": scene.numerics.grid})
    (poses, error), settings = _refined(scene, gait, amplitudes, tol, phases, ask)
    if error[:, 0].max() > tol:
        settings_text = " and ".join(f"{n} {name}" for name, n in settings.items())
        finer = (
            "lower [numerics] regularisation and tolerance"
            if solver_of(system)
            else "take a finer table"
        )
        raise Refusal(
            f"no tier gets to {tol:g} body lengths (best estimate {error[:, 0].max():.1e} with {settings_text})",
            where=scene.name,
            instead=f"raise ``tolerance``, or {finer}",
        )
    return answer(DIRECT.name, poses, error, settings)


def _refined(
    scene: Scene, gait: Gait, amplitudes, tol: float, phases: int, ask: Callable
):
    """Return (poses, errors) of the direct tier with twice the phases, or the pieces or elements of the body where these
    cause the largest error, again and again, and {"phases": ..., "pieces": ..., "elements": ... if any}.

    Only amplitudes that need it are refined, until all positions are within ``tol`` or doubling no longer helps."""
    ask(cost.direct_jobs(scene, gait, len(amplitudes), phases))
    poses, *errors = direct_with_error_parts(scene, gait, amplitudes, phases)
    shares = np.array(errors)  # of phases and rounding, of pieces, of elements
    counts = {
        "phases": phases,
        "pieces": getattr(solver_of(scene.system), "pieces", 0),
        "elements": n_elements(scene.system),
    }
    most = {"phases": MAX_PHASES, "pieces": MAX_PIECES, "elements": MAX_ELEMENTS}
    if not is_refinable(scene.system):
        most["elements"] = 0
    open_ = np.arange(len(amplitudes))
    while (worse := open_[shares.sum(0)[open_, 0] > tol]).size:
        largest = shares[1:, worse, 0].max(-1)
        coarse = [*counts][1 + int(largest.argmax())]
        if largest.max() <= 0.5 * shares.sum(0)[worse, 0].max():
            coarse = "phases"
        if 2 * counts[coarse] > most[coarse]:
            break
        counts[coarse] *= 2
        finer_scene, finer_gait = _finer(scene, gait, counts)
        ask(cost.direct_jobs(finer_scene, finer_gait, len(worse), counts["phases"]))
        finer, *finer_errors = direct_with_error_parts(
            finer_scene, finer_gait, amplitudes[worse], counts["phases"]
        )
        finer_shares = np.array(finer_errors)
        before = shares.sum(0)[worse, 0]
        stalled = (finer_shares.sum(0)[:, 0] > 0.9 * before).all()
        poses[worse], shares[:, worse], open_ = finer, finer_shares, worse
        if stalled and counts["phases"] > 1024:
            break
    needed = {
        "phases": True,
        "pieces": pieces_per_length(scene.system) > 0,
        "elements": counts["elements"] > 0,
    }
    return (poses, shares.sum(0)), {n: k for n, k in counts.items() if needed[n]}


def _finer(scene: Scene, gait: Gait, counts: dict[str, int]) -> tuple[Scene, Gait]:
    """Return a scene and a gait with so many pieces and elements of the body."""
    if pieces_per_length(scene.system):
        scene = scene.with_numerics(pieces=counts["pieces"])
    count, system = counts["elements"], scene.system
    if count == n_elements(system):
        return scene, gait
    gait = gait_with_elements(gait, system, count)
    return scene.changed(system=with_elements(system, count), gait=gait), gait
