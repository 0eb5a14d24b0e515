"""What a swimmer is made of, in lines: its medium, its body and each effect with its numbers and its price."""

from __future__ import annotations

import dataclasses

from geomech.errors import short
from geomech.systems.base import not_so
from rft.backend import foreign_to
from rft.bodies import KINDS as BODIES
from rft.effects import KINDS as EFFECTS
from rft.media import LAWS


def told(swimmer) -> list[str]:
    """Lines, of which the first continues the scene's name."""
    medium, body = (said(name_in(kinds, x), x) for kinds, x in ((LAWS, swimmer.medium), (BODIES, swimmer.body)))
    lines = [f"{medium}, {body}", *swimmer.notes]
    for effect in swimmer.effects:
        cost = f"; costs {effect.cost}" if effect.cost else ""
        gone = f"; gone at {effect.limit}, order {effect.order}" if effect.limit else ""
        premises = not_so(effect.breaks) or "keeps every premise"
        lines.append(f"on:  {said(effect.kind, effect)}; {premises}{cost}{gone}")
        if assumed := effect.assumes(swimmer.medium):
            lines.append(f"     assumes {assumed}")
    off = [name for name in EFFECTS if name not in [e.kind for e in swimmer.effects]]
    alien = foreign_to(swimmer.medium, swimmer.body, swimmer.effects, swimmer.solver.loads)
    lines.append("off, not evaluated: " + (", ".join(off) or "none"))
    return [*lines, f"back end: {swimmer.solver.computed(alien, name_in(LAWS, swimmer.medium))}"]


def said(kind: str, thing) -> str:
    """What a part of a scene is and its numbers, as a scene has them; a covariance only where there is one."""
    names = [f.name for f in dataclasses.fields(thing)] if dataclasses.is_dataclass(thing) else []
    given = [name for name in names if name != "covariance" or thing.covariance is not None]
    values = [f"{name} = {short(getattr(thing, name))}" for name in given]
    return f"{kind} ({', '.join(values)})" if values else kind


def name_in(kinds: dict, thing) -> str:
    """Its name in ``kinds``, or that of its class."""
    return next((name for name, kind in kinds.items() if type(thing) is kind), type(thing).__name__)
