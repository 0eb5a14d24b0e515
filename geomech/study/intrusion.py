"""What accuracy costs in an intruder scene: error of force and moment against the number of elements, and time."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from geomech.scene.intruder import IntruderScene
from geomech.study.cost import BASE, Cost

ELEMENTS = (12, 25, 50, 100, 200, 400)
FINEST = 3200  # elements of the truth
PER_PART = 6e-8  # s for an element at a pose, measured
TOLERANCES = 10.0 ** -np.arange(1, 7)
ROUNDING = 1e-13  # errors below say nothing


def study(scene: IntruderScene, progress: Callable | None = None, runs: int = 3) -> dict:
    """{"scene", "poses", "finest", "lines": [{"label", "order", "value", "error", "seconds", "slope"}], "cheapest":
    [{"tolerance", "elements", "error", "seconds"}]}, a line for the force and one for the moment. Errors are rms over the
    motion against the finest, over the largest of it; each setting is timed ``runs`` times, and the quickest counts."""
    truth, found, seconds = scene.run(FINEST), [], []
    for done, elements in enumerate(ELEMENTS):
        times = []
        for _ in range(runs):
            start = time.perf_counter()
            run = scene.run(elements)
            times.append(time.perf_counter() - start)
        found.append(run)
        seconds.append(min(times))
        if progress:
            progress((done + 1) / len(ELEMENTS))
    used = [scene.intruder.outline(n).elements for n in ELEMENTS]  # a shape may take more than it is asked for
    size = float(np.ptp(scene.outline.points, axis=0).max())
    lines = [_line(what, used, found, truth, size, seconds, scene.order) for what in ("force", "moment")]
    return {
        "scene": scene.name,
        "poses": len(truth.t),
        "finest": FINEST,
        "lines": lines,
        "cheapest": [_cheapest(lines, tolerance) for tolerance in TOLERANCES],
    }


def _line(what: str, used, found, truth, size: float, seconds, order: int) -> dict:
    """A moment that is nothing but rounding is compared to the force times the body's size."""
    exact, arm = getattr(truth, what), size if what == "moment" else 1.0
    largest, bound = np.abs(exact).max(), arm * np.abs(truth.force).max()
    largest = largest if largest > ROUNDING * bound else bound or 1.0
    errors = [float(np.sqrt(np.mean((getattr(run, what) - exact) ** 2)) / largest) for run in found]
    seen = np.array(errors) > ROUNDING
    slope = -np.polyfit(np.log(np.array(used)[seen]), np.log(np.array(errors)[seen]), 1)[0] if seen.sum() > 2 else None
    slope = None if slope is None else float(slope)
    return {"label": what, "order": order, "value": used, "error": errors, "seconds": seconds, "slope": slope}


def _cheapest(lines, tolerance: float) -> dict:
    """The fewest elements tried that meet a tolerance in force and moment."""
    for k, elements in enumerate(lines[0]["value"]):
        error = max(line["error"][k] for line in lines)
        if error <= tolerance:
            return {
                "tolerance": float(tolerance), "elements": elements, "error": error, "seconds": lines[0]["seconds"][k],
            }  # fmt: skip
    return {"tolerance": float(tolerance), "elements": None}


class Forces(Cost):
    """What forces along a motion cost; balances counts the elements, at every pose."""

    def __str__(self) -> str:
        return f"{self.balances:,} elements at a pose, about {max(1.0, self.seconds):.0f} s of computing"


def cost(scene: IntruderScene, runs: int = 3) -> Forces:
    """Of `study`."""
    return price(scene, FINEST + runs * sum(ELEMENTS))


def price(scene: IntruderScene, elements: int | None = None) -> Forces:
    """Of a run with so many elements, or the scene's own."""
    parts = scene.motion.samples * (elements or scene.outline.elements)
    sides = 2 if scene.medium.tension == "cut" and not scene.outline.closed else 1
    return Forces(parts, parts * sides * PER_PART, BASE)


def sentences(results: dict) -> list[str]:
    """One sentence each for force and moment: from the fewest elements to the most, and the measured order."""
    out = []
    for line in results["lines"]:
        e, t, v = line["error"], line["seconds"], line["value"]
        slope = "no slope, all rounding" if line["slope"] is None else f"measured order {line['slope']:.1f}"
        out.append(
            f"{line['label']}, {v[0]} to {v[-1]} elements: error {e[0]:.1e} to {e[-1]:.1e} of its largest for "
            f"{t[-1] / t[0]:.1f} times the time ({slope}; declared: {line['order']})."
        )
    return out


def table(results: dict) -> str:
    """The fewest elements by tolerance, as plain text."""
    rows = ["error / largest   elements     error   seconds"]
    for c in results["cheapest"]:
        if c["elements"] is None:
            rows.append(f"{c['tolerance']:15.0e}   none of those tried")
        else:
            rows.append(f"{c['tolerance']:15.0e}   {c['elements']:8} {c['error']:9.1e} {c['seconds']:9.4f}")
    return "\n".join(rows)
