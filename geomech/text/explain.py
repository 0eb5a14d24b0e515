"""The system of a scene in words: its effects, its engine, and the results that exist."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geomech.gaits import KINDS as GAITS
from geomech.scenes.model import Scene, checked_scene
from geomech.studies.available import tiers
from geomech.studies.elements import coarser, elements_of
from geomech.systems.premises import listed
from geomech.text import grains
from geomech.text.system import described, engine
from geomech.tiers import TIERS
from geomech.tiers.base import solved_phases
from rft.core.premise import ALL
from rft.core.refusal import in_line, printable

if TYPE_CHECKING:
    from geomech.scenes.intruding import Intruding
    from geomech.scenes.walker import WalkerScene

MOST_JOINTS = 5  # of which all pairs are drawn side by side


def explain(scene: Scene | Intruding | WalkerScene) -> str:
    """Return the system with its effects on and off, the engine and why, and the results that exist, as plain text.

    Of an intruder scene: its law, body and motion, and effects on and off; of a robot that walks its engine, too."""
    if not isinstance(scene, Scene) and hasattr(
        type(scene), "example"
    ):  # of bodies in grains
        return printable("\n".join(grains.described(scene)))
    system = checked_scene(scene).system
    first, *rest = described(system)
    gait = next(
        (name for name, kind in GAITS.items() if type(scene.gait) is kind),
        type(scene.gait).__name__,
    )
    timed = "" if scene.frequency is None else f" at {scene.frequency:g} Hz"
    lines = [f"{in_line(scene.name)}: {first}, {gait} gait{timed}", *rest]
    lines.append(f"engine: {engine(system)}")
    phases = scene.numerics.phases
    if (count := solved_phases(system, scene.gait, phases)) < phases:
        lines.append(
            f"by symmetry: {count} of {phases} phases of the gait are solved, the others are images of these"
        )
    if (count := elements_of(system)) and (fewer := coarser(system)):
        share = sum(1 / other.ratio for other in fewer) / 4
        numbers = " and ".join(f"{elements_of(other.system)}" for other in fewer)
        lines.append(
            f"errors: contain the change from {count} to {numbers} elements, at a quarter of the phases: {share:.0%} of "
            "the cost of the displacement"
        )
    by_name = [
        m
        for m, tier in TIERS.items()
        if tier.is_possible(system) and not tier.is_offered(system)
    ]
    lines.append(
        "tiers: "
        + ", ".join(tiers(system))
        + f"; by name: {', '.join(by_name)}" * bool(by_name)
    )
    return printable("\n".join([*lines, *_unavailable(system)]))


def _unavailable(system) -> list[str]:
    """Return a line for each reason for which results do not exist, with these results."""
    reasons: dict[str, list[str]] = {}
    if system.traits.lacks & ALL:
        first = reasons[f"{listed(system, ALL)} takes away what they rest on"] = [
            "connection",
            "CCF",
        ]
        first += ["velocity at a single shape"] if system.traits.steps else []
    elif system.joints < 2:
        reasons["a loop of one joint encloses no area"] = ["CCF maps"]
    elif system.joints > MOST_JOINTS:
        reasons[
            f"of {system.joints} joints there are slices, pair by pair (geomech ccf --pair)"
        ] = ["CCF maps"]
    for tier in TIERS.values():
        if not tier.is_possible(system):
            reasons.setdefault(_why(tier, system), []).append(tier.name)
    return [
        f"not available: {_listed(results)}: {why}" for why, results in reasons.items()
    ]


def _listed(results: list[str]) -> str:
    """Return results, and tiers after them: "CCF maps, area and harmonic tiers"."""
    tiers = [name for name in results if name in TIERS]
    names = " and ".join(filter(None, [", ".join(tiers[:-1]), *tiers[-1:]]))
    phrase = [f"{names} tier{'s' * (len(tiers) > 1)}"] if tiers else []
    return ", ".join([*(name for name in results if name not in TIERS), *phrase])


def _why(tier, system) -> str:
    """Return the reason why a tier does not apply to a system."""
    if system.traits.lacks & tier.rests_on:
        return f"{listed(system, ALL)} takes away what they rest on"
    if system.joints not in tier.joints:
        return _joints(system, tier.joints)
    return (
        f"the field has singular shapes, where {system.traits.singular}; maps and files leave these out, and gaits that meet "
        "one are refused"
    )


def _joints(system, taken: range) -> str:
    count = (
        f"{taken[0]} to {taken[-1]} joints"
        if taken[-1] < 100
        else f"{taken[0]} joints and more"
    )
    return f"they take {count}, this body has {system.joints}"
