"""What accuracy costs: every approximation as a knob, swept for one scene, error against time.

A knob declares which tier it belongs to, its settings from coarse to fine, the order theory gives its error and what it
is measured against: the truth (the direct tier, far finer), or the limit of the knob alone, all else being equal.
Errors are distances between net positions in body lengths, rms over a few amplitudes up to the gait's own.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geomech.core.errors import SceneError, named
from geomech.run.cost import Cost
from geomech.run.jobs import runner
from geomech.scene.model import Scene, checked_scene
from geomech.study import cost as foretold
from geomech.study import estimate
from geomech.study.bench import Study
from geomech.study.offer import tiers
from geomech.systems.capabilities import is_closed, own_error, pieces_of, solver_of, stored
from geomech.tiers import TIERS, fitted, harmonic
from geomech.tiers.base import Plan
from geomech.tiers.direct import DIRECT

FRACTIONS = np.array([0.4, 0.55, 0.7, 0.85, 1.0])  # of the gait's amplitude
TOLERANCES = 10.0 ** -np.arange(1, 7)
ROUNDING = 1e-13  # errors below this are rounding, and say nothing about a knob
TRUTH_PHASES = 4096
TRUTH_STEPS = 1024  # of time stepping, which takes them one by one
FINE_PIECES = 320  # of body, where effects cut it
FINEST = {"loads": "exact", "regularisation": 1e-9, "directions": 192, "pieces": FINE_PIECES}
GRIDS = (7, 11, 15, 21, 31, 45, 61)


@dataclass(frozen=True)
class Knob:
    """One approximation. setting: the name of an entry of [numerics]; loads for rules, whose prefix is ``rule``."""

    name: str
    tier: str
    setting: str
    values: tuple
    order: str  # of the error in 1/value (in value for the regularisation)
    buys: str  # what turning it up buys, to complete a sentence
    against: str = "truth"
    rule: str = ""

    @property
    def label(self) -> str:
        return f"{self.tier}: {self.name}"

    def turned(self, scene: Scene, value) -> Scene:
        return scene.with_numerics(**{self.setting: f"{self.rule}:{value}" if self.rule else value})

    def applies(self, scene: Scene) -> bool:
        system = scene.system
        if system.traits.linear and self.setting in ("regularisation", "directions"):
            return False
        if self.setting == "regularisation" and solver_of(system) is None:
            return False
        of_a_field = self.setting in (*fitted.DEPENDS_ON, *harmonic.DEPENDS_ON)
        if of_a_field and (stored(system, "connection") or system.joints > 2):  # from 7 to 61 points a joint: hours
            return False
        if self.tier not in tiers(system) or (self.tier != DIRECT.name and _plan(scene, self.tier).exact):
            return False
        return self.setting != "pieces" or pieces_of(system) > 0


KNOBS = (
    Knob("phases", "direct", "phases", (16, 32, 64, 128, 256, 512), "spectral if smooth, else 2", "the true answer"),
    Knob("segments", "direct", "loads", (2, 4, 8, 16, 32, 64), "2; less with pivots in links",
         "nothing that exact link integrals do not give for less", "limit", "midpoint"),
    Knob("nodes", "direct", "loads", (2, 4, 8, 16, 32, 64), "spectral; about 1 to 2 with pivots in links",
         "nothing that exact link integrals do not give for less", "limit", "gauss"),
    Knob("regularisation", "direct", "regularisation", (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6), "1",
         "links that really stand still", "limit"),
    Knob("pieces", "direct", "pieces", (5, 10, 20, 40, 80), "2 in the mean, scattered by pivots",
         "effects that vary along long links", "limit"),
    Knob("curves", "adapted", "curves", (4, 6, 8, 12, 16, 24, 48), "4 if smooth, about 2 across kinks",
         "every amplitude of one family from one table"),
    Knob("grid", "harmonic", "grid", GRIDS, "4 if smooth, 1 to 2 across kinks", "any gait inside the field from one table"),
    Knob("harmonics", "harmonic", "harmonics", (1, 3, 5, 9, 15, 21), "1 to 2, set by the kinks",
         "the part of the velocity that is not linear in alphadot"),
    Knob("grid", "path", "grid", GRIDS, "4 if smooth, 1 to 2 across kinks", "the limit of linearity, no further"),
    Knob("directions", "path", "directions", (2, 4, 8, 16, 32, 64), "2, harmonics folding back", "a steadier fit", "limit"),
    Knob("interpolation", "path", "interpolation", (1, 2, 3, 5), "degree + 1 if smooth", "little where links stick", "limit"),
    Knob("grid", "area", "grid", GRIDS, "3 or 4 in amplitude, set by the gait", "a map to read, not digits"),
)  # fmt: skip


def study(scene: Scene, progress: Callable | None = None, runs: int = 2) -> dict:
    """{"scene", "amplitudes", "lines": [{"label", "tier", "knob", "order", "against", "value", "error", "seconds",
    "slope"}], "cheapest": [{"tolerance", "tier", "knob", "value", "error", "seconds"}], "units"}; of a system whose velocity
    is not exact besides {"own_error": body lengths}, the largest that no setting takes away: errors of the cheapest include it.

    runs: each setting is timed so often, and the quickest counts; time stepping once, it is long enough for that to tell.
    Seconds are of one thread's computing. Who computes: `geomech.run.workers`."""
    amplitudes = checked_scene(scene).gait.amplitude * FRACTIONS
    knobs, lines = _knobs(scene), []
    asked = [Asked(_finest(scene), "direct", 1)]
    for knob in knobs:
        asked += [Asked(_limit(scene, knob), knob.tier, 1)] if knob.against == "limit" else []
        asked += [Asked(knob.turned(scene, value), knob.tier, _runs(scene, runs)) for value in knob.values]
    found = runner().map(_answer, amplitudes, asked, len(asked), progress=progress)
    true, _ = next(found)
    for knob in knobs:
        truth = next(found)[0] if knob.against == "limit" else true
        lines.append(_line(scene, knob, truth, [next(found) for _ in knob.values]))
    own = float(own_error(scene.system, *scene.gait.cycle(scene.numerics.phases, amplitudes))[..., 0].max())
    return {
        "scene": scene.name,
        "amplitudes": amplitudes.tolist(),
        "lines": lines,
        "cheapest": [_cheapest(lines, tol, own) for tol in TOLERANCES],
        "units": {"error": "BL", "tolerance": "BL", "own_error": "BL", "seconds": "s"},
        **({"own_error": own} if own else {}),
    }


def cost(scene: Scene, runs: int = 2) -> Cost:
    """Of `study`; SceneError for a gait that does not move."""
    if np.ptp(checked_scene(scene).gait.cycle(_truth_phases(scene))[0], axis=0).max() == 0:
        raise SceneError(f"{scene.name}: [gait] does not move: give it a size")
    tables = [_plan(scene, knob.tier).table for knob in _knobs(scene)]
    if any(table and table.axes for table in tables):
        with named(scene.name):
            Study(scene).refuse_outside()
    jobs = foretold.direct(scene, scene.gait, len(FRACTIONS), _truth_phases(scene), checked=False)
    for knob in _knobs(scene):
        jobs += [job for value in knob.values for job in _runs(scene, runs) * _jobs(knob, knob.turned(scene, value))]
        jobs += _jobs(knob, _limit(scene, knob)) if knob.against == "limit" else []
    return foretold.price(jobs)


def _jobs(knob: Knob, scene: Scene) -> list[foretold.Job]:
    """Those of a displacement by the knob's tier."""
    plan = _plan(scene, knob.tier)
    if not plan.exact:
        return foretold.predicted(scene, plan, len(FRACTIONS))
    return foretold.direct(scene, scene.gait, len(FRACTIONS), scene.numerics.phases, checked=False)


def _plan(scene: Scene, tier: str) -> Plan:
    """How a tier predicts what a knob of it is swept for."""
    return TIERS[tier].plan(scene.system, scene.numerics, scene.gait, scene.gait.amplitude * FRACTIONS)


def _truth_phases(scene: Scene) -> int:
    return TRUTH_STEPS if scene.system.traits.steps else TRUTH_PHASES


def _knobs(scene: Scene) -> list[Knob]:
    return [k for k in KNOBS if k.applies(scene) and not (k.rule and not is_closed(scene.system))]


def _runs(scene: Scene, runs: int) -> int:
    return 1 if scene.system.traits.steps else runs


class Asked(NamedTuple):
    """Displacements of a scene by a tier, timed ``runs`` times."""

    scene: Scene
    tier: str
    runs: int


def _answer(amplitudes, asked: Asked) -> tuple[np.ndarray, float]:
    """(poses, seconds), tables built anew so that their cost is counted. The quickest run counts, so that what a first call
    loads and warms does not."""
    times = []
    for _ in range(asked.runs):
        start = time.thread_time()
        poses = Study(asked.scene).displacement(asked.tier, None, amplitudes)
        times.append(time.thread_time() - start)
    return poses, min(times)


def _finest(scene: Scene) -> Scene:
    """The scene as the truth has it."""
    finest = scene.with_numerics(loads="exact", regularisation=1e-9) if is_closed(scene.system) else scene
    finest = finest.with_numerics(pieces=FINE_PIECES) if pieces_of(scene.system) else finest
    return finest.with_numerics(phases=_truth_phases(scene))


def _line(scene: Scene, knob: Knob, truth: np.ndarray, found: list[tuple[np.ndarray, float]]) -> dict:
    """A knob's errors and seconds, by what `_answer` gave for its values."""
    rms = lambda poses: float(np.sqrt(np.mean((estimate.distance(poses, truth) / scene.system.length) ** 2)))
    errors, seconds = [rms(poses) for poses, _ in found], [took for _, took in found]
    entry = {"label": knob.label, "tier": knob.tier, "knob": knob.name, "order": knob.order, "against": knob.against}
    slope = _slope(knob, errors)
    return {**entry, "buys": knob.buys, "value": list(knob.values), "error": errors, "seconds": seconds, "slope": slope}


def _limit(scene: Scene, knob: Knob) -> Scene:
    """The scene with a knob as far as it goes."""
    if knob.setting == "interpolation":  # the fit at the gait's own shapes would cost more than a far finer grid
        return scene.with_numerics(interpolation=5, grid=4 * scene.numerics.grid - 3)
    return scene.with_numerics(**{knob.setting: FINEST[knob.setting]})


def _slope(knob: Knob, errors) -> float | None:
    """Measured order: of the error in 1/value, in value for the regularisation; None where all is rounding."""
    x, y = np.log(np.array(knob.values, float)), np.array(errors)
    seen = y > ROUNDING
    if seen.sum() < 3:
        return None
    p = np.polyfit(x[seen], np.log(y[seen]), 1)[0]
    return float(p if knob.setting == "regularisation" else -p)


def _cheapest(lines, tol: float, own: float = 0.0) -> dict:
    """The quickest measured setting whose error against the truth and the system's own together are at most ``tol``; no tier
    if there is none."""
    found = [
        (t, line, v, e + own)
        for line in lines
        if line["against"] == "truth"
        for v, e, t in zip(line["value"], line["error"], line["seconds"])
        if e + own <= tol
    ]
    if not found:
        return {"tolerance": float(tol), "tier": None}
    seconds, line, value, error = min(found, key=lambda f: f[0])
    return {
        "tolerance": float(tol),
        "tier": line["tier"],
        "knob": line["knob"],
        "value": value,
        "error": error,
        "seconds": seconds,
    }


def sentences(results: dict) -> list[str]:
    """One sentence a knob: what it buys, from coarsest to finest, and its measured order."""
    out = []
    for line in results["lines"]:
        e, t, v = line["error"], line["seconds"], line["value"]
        slope = "no slope, all rounding" if line["slope"] is None else f"measured order {line['slope']:.1f}"
        against = "" if line["against"] == "truth" else " of its own limit"
        out.append(
            f"{line['label']} {v[0]:g} to {v[-1]:g}: error {e[0]:.1e} to {e[-1]:.1e}{against} for "
            f"{t[-1] / t[0]:.1f} times the time; buys {line['buys']} ({slope}; theory: {line['order']})."
        )
    return out


def table(results: dict) -> str:
    """The cheapest measured settings by tolerance, as plain text."""
    rows = ["error in BL  cheapest setting                   error     seconds"]
    for c in results["cheapest"]:
        if c["tier"] is None:
            rows.append(f"{c['tolerance']:9.0e}    none of those tried")
        else:
            what = f"{c['tier']}, {c['knob']} = {c['value']:g}"
            rows.append(f"{c['tolerance']:9.0e}    {what:32} {c['error']:9.1e} {c['seconds']:9.4f}")
    if own := results.get("own_error"):
        rows.append(
            f"errors here include the table's own, {own:.1e} BL, which no setting takes away; those below do not"
        )
    return "\n".join(rows)
