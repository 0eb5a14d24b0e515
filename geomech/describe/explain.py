"""geomech explain: the system of a scene in words, its effects, its engine, and the results
that exist."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from geomech import terminal
from geomech.options import SceneArgument

if TYPE_CHECKING:
    from geomech.scenes import Intruding, Scene, WalkerScene
    from geomech.systems.base import System

MOST_JOINTS = 5  # of which all pairs are drawn side by side
MANY = 100  # joints: a tier that takes so many takes all


def explain(name: SceneArgument):
    """Print effects and engine of a scene, and what they cost. Results that the effects
    rule out are listed."""
    from geomech.core.summary import wrapped
    from geomech.scenes import load

    terminal.show(wrapped(explained(load(name)).splitlines()))


def explained(scene: Scene | Intruding | WalkerScene) -> str:
    """Return the system with its effects on and off, the engine and why, and the results
    that exist, as plain text.

    Of an intruder scene: its law, body and motion, and effects on and off; of a robot that
    walks its engine, too."""
    from geomech.describe import grains
    from geomech.scenes import Scene
    from geomech.scenes.model import checked_scene
    from rft.core.refusal import printable

    of_grains = not isinstance(scene, Scene) and hasattr(type(scene), "example")
    if of_grains:
        return printable("\n".join(grains.described(scene)))
    scene = checked_scene(scene)
    lines = [
        *system_lines(scene),
        *cost_lines(scene),
        tiers_line(scene.system),
        *missing_lines(scene.system),
    ]
    return printable("\n".join(lines))


def system_lines(scene: Scene) -> list[str]:
    """Return the scene's system, its gait and its engine."""
    from geomech.describe.system import described, engine
    from geomech.gaits import KINDS
    from rft.core.refusal import in_line

    first, *rest = described(scene.system)
    gait = type(scene.gait).__name__
    for name, kind in KINDS.items():
        if type(scene.gait) is kind:
            gait = name
    words = f"{in_line(scene.name)}: {first}, {gait} gait"
    if scene.frequency is not None:
        words = f"{words} at {scene.frequency:g} Hz"
    return [words, *rest, f"engine: {engine(scene.system)}"]


def cost_lines(scene: Scene) -> Iterator[str]:
    """Yield what a symmetry spares, and what errors from fewer elements cost."""
    from geomech.studies.elements import coarser_systems, n_elements
    from geomech.tiers.base import solved_phases

    system, phases = scene.system, scene.numerics.phases
    solved = solved_phases(system, scene.gait, phases)
    if solved < phases:
        yield (
            f"by symmetry: {solved} of {phases} phases of the gait are solved, the "
            "others are images of these"
        )
    elements = n_elements(system)
    fewer: list = []
    if elements:
        fewer = coarser_systems(system)
    if fewer:
        share = sum(1 / other.ratio for other in fewer) / 4
        numbers = " and ".join(f"{n_elements(other.system)}" for other in fewer)
        yield (
            f"errors: contain the change from {elements} to {numbers} elements, at a "
            f"quarter of the phases: {share:.0%} of the cost of the displacement"
        )


def tiers_line(system: System) -> str:
    """Return the tiers of a system, and those that are computed by name alone."""
    from geomech.studies.available import available_tiers
    from geomech.tiers import TIERS

    words = f"tiers: {', '.join(available_tiers(system))}"
    by_name = []
    for name, tier in TIERS.items():
        if tier.is_possible(system) and not tier.is_offered(system):
            by_name.append(name)
    if by_name:
        words = f"{words}; by name: {', '.join(by_name)}"
    return words


def missing_lines(system: System) -> list[str]:
    """Return a line for each reason for which results do not exist, with these results."""
    from geomech.tiers import TIERS
    from rft.core.premise import ALL

    reasons: dict[str, list[str]] = {}
    if system.traits.lacks & ALL:
        results = ["connection", "CCF"]
        if system.traits.steps:
            results.append("velocity at a single shape")
        reasons[missing_premises(system)] = results
    elif system.joints < 2:
        reasons["a loop of one joint encloses no area"] = ["CCF maps"]
    elif system.joints > MOST_JOINTS:
        slices = (
            f"of {system.joints} joints there are slices, pair by pair "
            "(geomech ccf --pair)"
        )
        reasons[slices] = ["CCF maps"]
    for tier in TIERS.values():
        if not tier.is_possible(system):
            reasons.setdefault(reason(tier, system), []).append(tier.name)
    lines = []
    for why, results in reasons.items():
        lines.append(f"not available: {listed(results)}: {why}")
    return lines


def listed(results: list[str]) -> str:
    """Return results, and tiers after them: "CCF maps, area and harmonic tiers"."""
    from geomech.tiers import TIERS

    words = [name for name in results if name not in TIERS]
    tiers = [name for name in results if name in TIERS]
    if len(tiers) == 1:
        words.append(f"{tiers[0]} tier")
    elif tiers:
        words.append(f"{', '.join(tiers[:-1])} and {tiers[-1]} tiers")
    return ", ".join(words)


def missing_premises(system: System) -> str:
    from geomech.systems.premises import listed
    from rft.core.premise import ALL

    return f"{listed(system, ALL)} takes away what they rest on"


def reason(tier: Any, system: System) -> str:
    """Return the reason why a tier does not apply to a system."""
    if system.traits.lacks & tier.rests_on:
        return missing_premises(system)
    if system.joints not in tier.joints:
        first, last = tier.joints[0], tier.joints[-1]
        taken = f"{first} joints and more"
        if last < MANY:
            taken = f"{first} to {last} joints"
        return f"they take {taken}, this body has {system.joints}"
    return (
        f"the field has singular shapes, where {system.traits.singular}; maps and files "
        "leave these out, and gaits that meet one are refused"
    )
