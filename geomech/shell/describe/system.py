"""A system in words: its parts with their numbers and cost, its engine, and notes on
how it is computed."""

from __future__ import annotations

import dataclasses

from geomech.core import summary
from geomech.io.tables.base import SIGNS
from geomech.io.tables.sysplotter import compared
from geomech.mathematics.systems import Swimmer, Table
from geomech.mathematics.systems.base import System, WrappedSystem, kind_of
from geomech.mathematics.systems.capabilities import Noted, capability
from geomech.mathematics.systems.framed import NAME, Framed
from geomech.mathematics.systems.swimmer import effect_sizes, name_in
from rft.bodies import BODIES
from rft.contacts import BEARINGS, FOLLOWS
from rft.core.premise import PHASE_ALONE, negation
from rft.core.refusal import formatted, in_line
from rft.effects import EFFECTS, ENGINES
from rft.effects import engine as engine_of
from rft.effects.base import Effect
from rft.formulas.cylinders import drag_ratio
from rft.formulas.quadrature import QUADRATURE
from rft.laws import LAWS, Medium, Viscous
from rft.laws.records import record
from rft.laws.viscous import LIMIT

NO_PREMISE_BROKEN = "no memory, no dependence on place, no mass"


def system_lines(system: System) -> list[str]:
    """Return a system in lines, part by part; the first continues the scene's name."""
    if isinstance(system, Framed):
        first, *rest = system_lines(system.inner)
        return [f"{first}, seen from its {NAME} frame", *rest]
    if isinstance(system, WrappedSystem):
        return system_lines(system.wrapped)
    if isinstance(system, Swimmer):
        return swimmer_lines(system)
    if isinstance(system, Table):
        return table_lines(system)
    entries = []
    if dataclasses.is_dataclass(system):
        for field in dataclasses.fields(system):
            value = getattr(system, field.name)
            if value is not None:
                entries.append(f"{field.name} = {formatted(value)}")
    first = kind_of(system)
    if entries:
        first = f"{first} ({', '.join(entries)})"
    noted = capability(system, Noted)
    return [first, *(() if noted is None else noted.notes)]


def engine(system: System) -> str:
    """Return the name of a system's engine, its working, and the reason for it."""
    if isinstance(system, Framed):
        return engine(system.inner)
    if isinstance(system, Table):
        return "algebraic (the velocity at every shape, interpolated from a table)"
    if not isinstance(system, Swimmer):
        return (
            "algebraic (the velocity at every shape, all shapes at once): "
            f"{NO_PREMISE_BROKEN}"
        )
    reasons = []
    for effect in system.effects:
        broken = effect.breaks & PHASE_ALONE
        if broken:
            reasons.append(f"with {effect.kind} the scene is {negation(broken)}")
    name = engine_of(system.effects)
    return f"{name} ({ENGINES[name]}): {'; '.join(reasons) or NO_PREMISE_BROKEN}"


def notes(system: System) -> tuple[str, ...]:
    """Return notes on how a system is computed that its user may not expect."""
    if isinstance(system, Framed):
        return notes(system.inner)
    if not isinstance(system, Swimmer):
        return ()
    if system.closed or system.solver.loads != "exact":
        return ()
    return (
        f"the law {name_in(LAWS, system.medium)} has no closed form: its averages "
        f"over an element are computed by quadrature ({QUADRATURE}) instead of exact "
        "integrals. This takes about five times as long and, where drag is dry, "
        "changes the displacement of three links by 1 to 7 %, and of more links by "
        'less; errors include this, and [numerics] loads = "gauss:96" reduces it '
        "tenfold",
    )


def swimmer_lines(system: Swimmer) -> list[str]:
    """Return medium and body, notes, the effects that are on and off, and the back
    end."""
    law = name_in(LAWS, system.medium)
    lines = [
        medium_and_body(system, ", "),
        *viscous_lines(system.medium),
        *contact_lines(system),
        *notes(system),
    ]
    for effect in system.effects:
        lines += effect_lines(effect, system)
    used = {effect.kind for effect in system.effects}
    off = [name for name in EFFECTS if name not in used]
    law_record = record(system.medium, system.solver.loads)
    return [
        *lines,
        f"off (not evaluated): {', '.join(off) or 'none'}",
        f"back end: {system.solver.computed(law_record, law)}",
    ]


def viscous_lines(medium: Medium) -> list[str]:
    """Return how far a viscous law is from a flow between links."""
    if type(medium) is not Viscous:
        return []
    if medium.slenderness is not None:
        return [
            "viscous: the ratio is that of a straight cylinder (Tirado et al. 1984, "
            "for slenderness 2 to 30, extrapolated beyond). On the circle of 1 rad "
            "three equal links swim 13 to 15 % less with it than as touching beads, "
            "at slenderness 24 to 200"
        ]
    if medium.ratio != LIMIT:
        return []
    ratios = [f"{drag_ratio(p):.2f} at slenderness {p}" for p in (10, 50, 200)]
    return [
        f"viscous: a ratio of {LIMIT:g} is the limit of an infinitely thin body; a "
        f"straight cylinder has {', '.join(ratios)} ([medium] slenderness). On the "
        "circle of 1 rad three equal links swim 66 %, 46 % and 28 % more with this "
        "ratio than as touching beads at slenderness 24, 48 and 200 (geomech explain "
        "three-link-beads)"
    ]


def contact_lines(system: Swimmer) -> list[str]:
    """Return the rule of contact, where its phase comes from, and who bears the
    body."""
    contact = system.contact
    if contact is None:
        return []
    return [
        f"contact: {summary.part(contact.kind, contact)}",
        f"     phase of contact: {FOLLOWS[contact.follows]}",
        f"     loads: {BEARINGS[contact.bearing]}",
    ]


def medium_and_body(swimmer: Swimmer, link: str) -> str:
    """Return the medium and the body of a swimmer with their numbers.

    link: stands between them."""
    medium = summary.part(name_in(LAWS, swimmer.medium), swimmer.medium)
    body = summary.part(name_in(BODIES, swimmer.body), swimmer.body)
    return f"{medium}{link}{body}"


def effect_lines(effect: Effect, system: Swimmer) -> list[str]:
    """Return an effect with the premises that it breaks, its cost and its limit; its
    sizes for this body; and its assumptions."""
    premises = negation(effect.breaks) or "breaks no assumption"
    line = f"on:  {summary.part(effect.kind, effect)}; {premises}"
    if effect.cost:
        line = f"{line}; cost: {effect.cost}"
    if effect.limit:
        line = f"{line}; vanishes at {effect.limit} (order {effect.order})"
    lines = [line]
    sizes = effect_sizes(effect, system.body)
    if sizes:
        lines.append(f"     {sizes}")
    assumed = effect.assumes(system.medium)
    if assumed:
        lines.append(f"     assumption: {assumed}")
    return lines


def table_lines(system: Table) -> list[str]:
    """Return a table's file and arrays, what its errors include, and its
    conventions."""
    stored = system.stored
    lines = [
        f"table ({in_line(system.file)}: {stored.connection!r})",
        field_line(system),
    ]
    if stored.even is not None:
        lines.append(
            "xi is not odd in alphadot: its even part is included in every error"
        )
    if stored.A_error is not None and system.tube is None:
        lines.append("the file gives intervals of A: they are included in every error")
    if not stored.has_residual:
        lines.append(
            "the file does not give the residual of its fit: errors are those of the "
            "grid alone"
        )
    if stored.computed is not None:
        lines += comparison_lines(system)
    if system.swimmer:
        parts = medium_and_body(system.swimmer, " on ")
        lines.append(f"the cost of changing shape is the drag of {parts}")
    frame = stored.frame
    original_frame = system.original.frame
    if frame != original_frame:
        frame = f"{frame}, from {original_frame} in the file"
    return [
        *lines,
        f"stored as {SIGNS[stored.sign]}, arrays as {stored.order}, lengths in "
        f"{stored.unit}, frame {frame}",
        *system.assumed,
        "its field has the grid of the file; [numerics] grid, extent and directions "
        "have no effect",
    ]


def field_line(system: Table) -> str:
    """Return what a table has besides A: a tube around a gait, harmonics, or
    nothing."""
    stored = system.stored
    if system.tube is not None:
        level = system.tube.taylor.level
        return (
            f"known only near a measured gait; errors are {100 * level:.3g} % "
            "confidence intervals"
        )
    if stored.harmonics:
        return (
            "with the odd harmonics of xi in the direction of alphadot up to "
            f"{stored.highest}: {stored.harmonics!r}"
        )
    if stored.has_residual:
        return (
            "A alone: xi = A alphadot, and the residual of the fit is included in "
            "every error"
        )
    return "A alone: xi = A alphadot"


def comparison_lines(system: Table) -> list[str]:
    """Return how far the fields that sysplotter computed are from ours; [] where none
    is compared."""
    found = []
    for name, difference in compared(system.original).items():
        found.append(f"{name} {100 * difference:.2g} %")
    if not found:
        return []
    return [
        "largest difference between sysplotter's fields and ours, in the middle half "
        f"of the grid: {', '.join(found)}"
    ]
