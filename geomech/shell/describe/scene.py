"""A scene in lines: its system, effects and engine, its cost, and the results that
exist."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from geomech.mathematics.gaits import KINDS
from geomech.mathematics.gaits.wound import unwound
from geomech.mathematics.systems import premises
from geomech.mathematics.systems.base import System
from geomech.mathematics.tiers import TIERS
from geomech.mathematics.tiers.base import solved_phases
from geomech.scenes import Scene
from geomech.scenes.model import checked_scene
from geomech.shell.describe import grains
from geomech.shell.describe.system import engine, system_lines
from geomech.studies.available import available_tiers
from geomech.studies.estimates.elements import coarser_systems, n_elements
from rft.core.premise import ALL
from rft.core.refusal import in_line, printable

if TYPE_CHECKING:  # their mechanics takes long to load
    from geomech.scenes import Intruding, WalkerScene

LARGEST_MAPPED = 5  # joints, of which all pairs are drawn side by side
ANY_NUMBER = 100  # joints; a tier that takes this many takes any number


def description(scene: Scene | Intruding | WalkerScene) -> str:
    """Return a scene as plain text: the system with its effects on and off, the engine
    and why, and the results that exist.

    Of an intruder scene: law, body and motion, and effects on and off; of a robot that
    walks also its engine."""
    is_of_grains = not isinstance(scene, Scene) and hasattr(type(scene), "example")
    if is_of_grains:
        return printable("\n".join(grains.scene_lines(scene)))
    scene = checked_scene(scene)
    lines = [
        *scene_lines(scene),
        *cost_lines(scene),
        tiers_line(scene.system),
        *missing_lines(scene.system),
    ]
    return printable("\n".join(lines))


def scene_lines(scene: Scene) -> list[str]:
    """Return the scene's system, its gait and its engine."""
    first, *rest = system_lines(scene.system)
    gait = type(unwound(scene.gait)).__name__
    for name, kind in KINDS.items():
        if type(unwound(scene.gait)) is kind:
            gait = name
    words = f"{in_line(scene.name)}: {first}, {gait} gait"
    if scene.frequency is not None:
        words = f"{words} at {scene.frequency:g} Hz"
    return [words, *rest, f"engine: {engine(scene.system)}"]


def cost_lines(scene: Scene) -> Iterator[str]:
    """Yield what a symmetry spares, and what errors from fewer elements cost."""
    system = scene.system
    phases = scene.numerics.phases
    solved = solved_phases(system, scene.gait, phases)
    if solved < phases:
        yield (
            f"by symmetry: {solved} of {phases} phases of the gait are solved, and "
            "the others are their images"
        )
    elements = n_elements(system)
    fewer: list = []
    if elements:
        fewer = coarser_systems(system)
    if fewer:
        share = sum(1 / other.ratio for other in fewer) / 4
        numbers = " and ".join(f"{n_elements(other.system)}" for other in fewer)
        yield (
            f"errors: estimated from {elements} elements against {numbers} elements, "
            f"at a quarter of the phases, for {share:.0%} of the cost of the "
            "displacement"
        )


def tiers_line(system: System) -> str:
    """Return the tiers of a system, and those that are computed by name alone."""
    words = f"tiers: {', '.join(available_tiers(system))}"
    by_name = []
    for name, tier in TIERS.items():
        if tier.is_possible(system) and not tier.is_offered(system):
            by_name.append(name)
    if by_name:
        words = f"{words}; only by name: {', '.join(by_name)}"
    return words


def missing_lines(system: System) -> list[str]:
    """Return a line for each reason why results do not exist, with these results."""
    reasons: dict[str, list[str]] = {}
    if system.traits.lacks & ALL:
        results = ["connection", "CCF"]
        if system.traits.steps:
            results.append("velocity at a single shape")
        reasons[missing_premises(system)] = results
    elif system.joints < 2:
        reasons["a loop of one joint encloses no area"] = ["CCF maps"]
    elif system.joints > LARGEST_MAPPED:
        slices = (
            f"{system.joints} joints have slices, pair by pair (geomech ccf --pair)"
        )
        reasons[slices] = ["CCF maps"]
    for tier in TIERS.values():
        if not tier.is_possible(system):
            reasons.setdefault(why_no_tier(tier, system), []).append(tier.name)
    lines = []
    for why, results in reasons.items():
        lines.append(f"not available: {result_names(results)}: {why}")
    return lines


def result_names(results: list[str]) -> str:
    """Return results, and tiers after them: "CCF maps, area and harmonic tiers"."""
    words = [name for name in results if name not in TIERS]
    tiers = [name for name in results if name in TIERS]
    if len(tiers) == 1:
        words.append(f"{tiers[0]} tier")
    elif tiers:
        words.append(f"{', '.join(tiers[:-1])} and {tiers[-1]} tiers")
    return ", ".join(words)


def missing_premises(system: System) -> str:
    """Return the reason why a system has no connection."""
    return f"{premises.listed(system, ALL)} breaks an assumption that they need"


def why_no_tier(tier: Any, system: System) -> str:
    """Return the reason why a tier does not apply to a system."""
    if system.traits.lacks & tier.rests_on:
        return missing_premises(system)
    if tier.prescribed and system.traits.compliant:
        return "with springs a gait does not prescribe the shape"
    if system.joints not in tier.joints:
        first = tier.joints[0]
        last = tier.joints[-1]
        taken = f"{first} or more joints"
        if last < ANY_NUMBER:
            taken = f"{first} to {last} joints"
        return f"they need {taken}; this body has {system.joints}"
    return (
        f"the field has singular shapes, where {system.traits.singular}; maps and "
        "files leave these out, and gaits that pass one are refused"
    )
