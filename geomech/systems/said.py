"""What a swimmer says of itself: its parts with their numbers and price, its engine, and what it has not and who takes it."""

from __future__ import annotations

import dataclasses

from geomech.core.errors import short
from geomech.systems.base import SHAPE_ALONE, Premise, negated
from rft.bodies import KINDS as BODIES
from rft.effects import ENGINES
from rft.effects import KINDS as EFFECTS
from rft.laws import LAWS, is_rate_independent
from rft.laws.records import is_compilable, record
from rft.quadrature import QUADRATURE


class Said:
    """The words of a `geomech.systems.Swimmer`, as `System` has them."""

    @property
    def blames(self) -> str:
        law = [] if is_rate_independent(self.medium) else [f"the law {name_in(LAWS, self.medium)}"]
        return ", ".join(law + [e.kind for e in self.effects if e.breaks])

    def blame(self, premises: Premise) -> str:
        if Premise.RATE_INDEPENDENT in premises and not is_rate_independent(self.medium):
            return f"the law {name_in(LAWS, self.medium)}, whose drag is of no one power of the speed"
        for effect in self.effects:
            if effect.breaks & premises:
                return f"the effect {effect.kind}, which is {negated(effect.breaks)}"
        return ""

    def refuse(self, what: str, premises: Premise, instead: str) -> None:
        lawful = is_rate_independent(self.medium) or Premise.RATE_INDEPENDENT not in premises
        super().refuse(what, premises, f"{instead}, or {'drop the effect' if lawful else 'take another law'}")

    def about(self) -> dict:
        return {
            "loads": self.solver.loads if self.notes == () else QUADRATURE,
            "regularisation": float(self.solver.regularisation),
            "regularisation_unit": "body length rad-1",
        }

    @property
    def notes(self) -> tuple[str, ...]:
        if self.closed or self.solver.loads != "exact":
            return ()
        return (
            f"the law {name_in(LAWS, self.medium)} has no closed form: its averages over an element are by quadrature "
            f"({QUADRATURE}) in place of exact integrals, which takes some five times as long and, where drag is dry, is off "
            "by 1 to 7 % of the displacement of three links, less of more; errors include it, and "
            '[numerics] loads = "gauss:96" lowers it tenfold',
        )

    def told(self) -> list[str]:
        """Lines, of which the first continues the scene's name."""
        medium, body = (said(name_in(kinds, x), x) for kinds, x in ((LAWS, self.medium), (BODIES, self.body)))
        lines = [f"{medium}, {body}", *self.notes]
        for effect in self.effects:
            cost = f"; costs {effect.cost}" if effect.cost else ""
            gone = f"; gone at {effect.limit}, order {effect.order}" if effect.limit else ""
            premises = negated(effect.breaks) or "keeps every premise"
            lines.append(f"on:  {said(effect.kind, effect)}; {premises}{cost}{gone}")
            if assumed := effect.assumes(self.medium):
                lines.append(f"     assumes {assumed}")
        off = [name for name in EFFECTS if name not in [e.kind for e in self.effects]]
        compilable = is_compilable(record(self.medium, self.solver.loads))
        lines.append("off, not evaluated: " + (", ".join(off) or "none"))
        return [*lines, f"back end: {self.solver.computed(compilable, name_in(LAWS, self.medium))}"]

    @property
    def because(self) -> str:
        broken = [(e.kind, e.breaks & SHAPE_ALONE) for e in self.effects if e.breaks & SHAPE_ALONE]
        reasons = [f"with {kind} the scene is {negated(lost)}" for kind, lost in broken]
        return f"({ENGINES[self.engine]}): " + ("; ".join(reasons) or "nothing remembers, places are alike, no mass")


def said(kind: str, thing) -> str:
    """What a part of a scene is and its numbers, as a scene has them; a covariance only where there is one."""
    names = [f.name for f in dataclasses.fields(thing)] if dataclasses.is_dataclass(thing) else []
    given = [name for name in names if name != "covariance" or thing.covariance is not None]
    values = [f"{name} = {short(getattr(thing, name))}" for name in given]
    return f"{kind} ({', '.join(values)})" if values else kind


def name_in(kinds: dict, thing) -> str:
    """Its name in ``kinds``, or that of its class."""
    return next((name for name, kind in kinds.items() if type(thing) is kind), type(thing).__name__)
