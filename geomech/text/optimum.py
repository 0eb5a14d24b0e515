"""The best gait of a scene, in lines and as a scene file."""

from __future__ import annotations

import textwrap
from typing import Any

from geomech.core.variables import Result
from geomech.optimise import Optimum
from geomech.scene.write import toml
from geomech.study.effort import METRIC
from geomech.systems.base import length_unit

SHOWN = 6  # answers that a table led to, of those that nobody finished


def numbers(result: Result) -> dict[str, Any]:
    """Return what was found as `Optimum.numbers` has it."""
    return result.subject.numbers()


def text(result: Result) -> str:
    """Return what was found."""
    return told(result.subject)


def told(optimum: Optimum) -> str:
    """Return what was found, in lines."""
    aim, best, system = optimum.request.aim, optimum.best, optimum.scene.system
    towards = f" along {aim.direction}" if aim.direction else ""
    (x, y, theta), unit = best.displacement, length_unit(system)
    lines = [
        f"{optimum.scene.name}: {aim.name}{towards} {best.value:.6g} {aim.unit}, error {best.error:.1g} "
        f"(the scene's gait: {optimum.start.value:.6g})",
        f"displacement per cycle: x {x:.6g} {unit}, y {y:.6g} {unit}, theta {theta:.6g} rad",
    ]
    if best.work is not None:
        lines.append(f"path length {best.length:.6g}, work {best.work:.6g} (body's axial drag x body length)")
    elif best.length is not None:
        lines.append(f"path length {best.length:.6g} ({METRIC})")
    if aim.timed:
        limits = {
            "rate": aim.rate and f"rates of shape up to {aim.rate:.6g} rad/s",
            "power": aim.power and f"mean power {aim.power:g}",
        }
        limited = " and ".join(filter(None, limits.values()))
        lines.append(f"frequency {best.gait.frequency:.6g} Hz, with {limited}")
    lines.append(f"limits that it touches: {', '.join(optimum.active) or 'none'}")
    if optimum.request.starts > 1:
        lines += _found(optimum)
    if optimum.best.value <= optimum.start.value * (1 + 1e-12):
        lines.append("nothing better than the scene's own gait was found")
    return "\n".join([*lines, f"{optimum.evaluations} cycles evaluated in {optimum.seconds:.2g} s"])


def _found(optimum: Optimum) -> list[str]:
    """What the starts led to."""
    listed = lambda answers: ", ".join(f"{value:.6g} (from {count})" for value, count in answers)
    led = sum(count for _, count in optimum.answers + optimum.others) - optimum.request.starts
    more = f", and {led} that narrower limits led to" if led > 0 else ""
    lines = [f"{optimum.request.starts} starts{more}, answers that differ: {listed(optimum.answers)}"]
    if optimum.others:
        rest = len(optimum.others) - SHOWN
        more = f" and {rest} more, down to {optimum.others[-1][0]:.6g}" if rest > 0 else ""
        lines.append(f"and by a table alone, less: {listed(optimum.others[:SHOWN])}{more}")
    return lines


def scene_toml(optimum: Optimum) -> str:
    """Return the scene with the best gait, and what it is, as a comment."""
    about = textwrap.wrap(" ".join(told(optimum).splitlines()[:1]), 110)
    return "".join(f"# {line}\n" for line in about) + "\n" + toml(optimum.scene)
