"""What accuracy costs in an intruder scene: error of force and moment against the number of elements or triangles, and
time."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geomech.run.cost import BASE, Cost
from geomech.run.jobs import runner
from geomech.scene.intruding import Intruding

TOLERANCES = 10.0 ** -np.arange(1, 7)
ROUNDING = 1e-13  # errors below say nothing
MARGIN = 1.125  # of the estimate over what its order says: covers the error of 95 of 100 motions of outlines, measured


def study(scene: Intruding, progress: Callable | None = None, runs: int = 3) -> dict:
    """{"scene", "parts", "poses", "finest", "lines": [{"label", "order", "value", "error", "seconds", "slope"}], "cheapest":
    [{"tolerance", "elements", "error", "seconds"}]}, a line for the force and one for the moment; of a mesh "triangles"
    stands for "elements". Errors are rms over the motion against the finest of the scene's ladder, over the largest of it;
    each setting is timed ``runs`` times, and the quickest counts. Seconds are of one thread's computing. Who computes:
    `geomech.run.workers`."""
    *counts, finest = scene.ladder
    asked = [(finest, 1), *((count, runs) for count in counts)]
    answers = runner().map(_answer, scene, asked, len(asked), progress=progress)
    (truth, _), *found = ((Answer(*loads), seconds) for *loads, seconds in answers)
    used = [scene.used(n) for n in counts]  # a shape may take more than it is asked for
    lines = [_line(what, used, found, truth, scene.size, scene.order) for what in ("force", "moment")]
    return {
        "scene": scene.name,
        "parts": scene.parts,
        "poses": len(truth.force),
        "finest": scene.used(finest),
        "lines": lines,
        "cheapest": [_cheapest(lines, tolerance, scene.parts) for tolerance in TOLERANCES],
    }


class Estimate(NamedTuple):
    """Errors of force, N, and moment, N m, at most along the motion, from finer parts, at most ``count``. nan where so many
    are more than a body takes."""

    force: float
    moment: float
    count: int


def estimate(scene: Intruding, found) -> Estimate:
    """What finer parts change of a run, times all that yet finer ones would by the order of the error; the most."""
    change, counts = np.zeros(2), [times * scene.count for times in scene.finer]
    try:
        counts = [scene.used(count) for count in counts]
    except ValueError:
        counts = [scene.count]
    if counts[0] == scene.count:
        return Estimate(np.nan, np.nan, scene.count)
    for times, count in zip(scene.finer, counts):
        other, factor = scene.run(times * scene.count), MARGIN / (1.0 - (scene.count / count) ** scene.order)
        pairs = ((x.reshape(len(x), -1), y.reshape(len(y), -1)) for x, y in zip(_loads(other), _loads(found)))
        change = np.maximum(change, [factor * np.linalg.norm(x - y, axis=1).max() for x, y in pairs])
    return Estimate(*change.tolist(), counts[-1])


def _loads(found) -> tuple[np.ndarray, np.ndarray]:
    return found.force, found.moment


class Answer(NamedTuple):
    """Force (T, 2 or 3), N, and moment (T,) or (T, 3), N m, along the motion."""

    force: np.ndarray
    moment: np.ndarray


def _answer(scene: Intruding, asked: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, float]:
    """(force, moment, seconds) of so many parts; the quickest of so many runs counts."""
    (count, runs), times = asked, []
    for _ in range(runs):
        start = time.thread_time()
        found = scene.run(count)
        times.append(time.thread_time() - start)
    return found.force, found.moment, min(times)


def _line(what: str, used, found, truth: Answer, size: float, order: int) -> dict:
    """A moment that is nothing but rounding is compared to the force times the body's size. found: (answer, seconds) of the
    settings."""
    exact, arm = getattr(truth, what), size if what == "moment" else 1.0
    largest, bound = np.abs(exact).max(), arm * np.abs(truth.force).max()
    largest = largest if largest > ROUNDING * bound else bound or 1.0
    errors = [float(np.sqrt(np.mean((getattr(run, what) - exact) ** 2)) / largest) for run, _ in found]
    seconds = [took for _, took in found]
    seen = np.array(errors) > ROUNDING
    slope = -np.polyfit(np.log(np.array(used)[seen]), np.log(np.array(errors)[seen]), 1)[0] if seen.sum() > 2 else None
    slope = None if slope is None else float(slope)
    return {"label": what, "order": order, "value": used, "error": errors, "seconds": seconds, "slope": slope}


def _cheapest(lines, tolerance: float, parts: str) -> dict:
    """The fewest parts tried that meet a tolerance in force and moment."""
    for k, count in enumerate(lines[0]["value"]):
        error = max(line["error"][k] for line in lines)
        if error <= tolerance:
            return {
                "tolerance": float(tolerance), parts: count, "error": error, "seconds": lines[0]["seconds"][k],
            }  # fmt: skip
    return {"tolerance": float(tolerance), parts: None}


class Elements(Cost):
    """What forces along a motion cost; balances counts the elements, at every pose."""

    parts = "elements"

    @property
    def as_balances(self) -> float:
        """150 elements take NumPy as long as a balance; triangles are never compiled."""
        return self.balances / 150 if self.parts == "elements" else 0.0

    def __str__(self) -> str:
        return f"{self.balances:,} {self.parts} at a pose, about {max(1.0, self.seconds):.0f} s of computing"


class Triangles(Elements):
    """The same of a mesh."""

    parts = "triangles"


def cost(scene: Intruding, runs: int = 3) -> Elements:
    """Of `study`."""
    *counts, finest = scene.ladder
    return price(scene, finest + runs * sum(counts))


def price(scene: Intruding, count: int | None = None) -> Elements:
    """Of runs with so many parts in all, or of one with the scene's own."""
    parts = scene.motion.samples * (count or scene.count)
    kind = next(kind for kind in (Elements, Triangles) if kind.parts == scene.parts)
    seconds = parts * scene.per_part
    return kind(parts, seconds, BASE, seconds)


def sentences(results: dict) -> list[str]:
    """One sentence each for force and moment: from the fewest parts to the most, and the measured order."""
    out = []
    for line in results["lines"]:
        e, t, v = line["error"], line["seconds"], line["value"]
        slope = "no slope, all rounding" if line["slope"] is None else f"measured order {line['slope']:.1f}"
        out.append(
            f"{line['label']}, {v[0]} to {v[-1]} {results['parts']}: error {e[0]:.1e} to {e[-1]:.1e} of its largest for "
            f"{t[-1] / t[0]:.1f} times the time ({slope}; declared: {line['order']})."
        )
    return out


def table(results: dict) -> str:
    """The fewest parts by tolerance, as plain text."""
    parts = results["parts"]
    rows = [f"error / largest  {parts:>9}     error   seconds"]
    for c in results["cheapest"]:
        if c[parts] is None:
            rows.append(f"{c['tolerance']:15.0e}   none of those tried")
        else:
            rows.append(f"{c['tolerance']:15.0e}  {c[parts]:9} {c['error']:9.1e} {c['seconds']:9.4f}")
    return "\n".join(rows)
