"""A system in words: its parts with their numbers and cost, its engine, and notes on how it is computed."""

from __future__ import annotations

import dataclasses

from geomech.core import summary
from geomech.io.tables.base import SIGNS
from geomech.io.tables.sysplotter import compared
from geomech.systems import Swimmer, Table
from geomech.systems.base import System, WrappedSystem, kind_of
from geomech.systems.framed import NAME, Framed
from geomech.systems.swimmer import effect_sizes, name_in
from rft.bodies import BODIES
from rft.core.premise import SHAPE_ALONE, negation
from rft.core.refusal import formatted, in_line
from rft.effects import EFFECTS, ENGINES
from rft.effects import engine as engine_of
from rft.formulas.quadrature import QUADRATURE
from rft.laws import LAWS
from rft.laws.records import is_compilable, record

NO_PAST = "nothing remembers, places are alike, no mass"


def described(system: System) -> list[str]:
    """Return a system in lines, part by part; the first continues the scene's name."""
    if isinstance(system, Framed):
        first, *rest = described(system.inner)
        return [f"{first}, seen from its {NAME} frame", *rest]
    if isinstance(system, WrappedSystem):
        return described(system.wrapped)
    if isinstance(system, Swimmer):
        return _swimmer(system)
    if isinstance(system, Table):
        return _table(system)
    fields = dataclasses.fields(system) if dataclasses.is_dataclass(system) else ()
    given = {f.name: getattr(system, f.name) for f in fields}
    numbers = ", ".join(
        f"{name} = {formatted(x)}" for name, x in given.items() if x is not None
    )
    return [f"{kind_of(system)} ({numbers})" if numbers else kind_of(system)]


def engine(system: System) -> str:
    """Return the name of a system's engine, its working, and the reason for it."""
    if isinstance(system, Framed):
        return engine(system.inner)
    if isinstance(system, Swimmer):
        name = engine_of(system.effects)
        broken = [
            (e.kind, e.breaks & SHAPE_ALONE)
            for e in system.effects
            if e.breaks & SHAPE_ALONE
        ]
        reasons = [
            f"with {kind} the scene is {negation(premises)}"
            for kind, premises in broken
        ]
        return f"{name} ({ENGINES[name]}): {'; '.join(reasons) or NO_PAST}"
    if isinstance(system, Table):
        return "algebraic (the velocity at every shape, looked up)"
    return f"algebraic (the velocity at every shape, all shapes at once): {NO_PAST}"


def notes(system: System) -> tuple[str, ...]:
    """Return notes on how a system is computed that its user may not expect."""
    if isinstance(system, Framed):
        return notes(system.inner)
    if (
        not isinstance(system, Swimmer)
        or system.closed
        or system.solver.loads != "exact"
    ):
        return ()
    return (
        f"the law {name_in(LAWS, system.medium)} has no closed form: its averages over an element are by quadrature "
        f"({QUADRATURE}) in place of exact integrals, which takes some five times as long and, where drag is dry, is off "
        "by 1 to 7 % of the displacement of three links, less of more; errors include it, and "
        '[numerics] loads = "gauss:96" lowers it tenfold',
    )


def _swimmer(system: Swimmer) -> list[str]:
    parts = ((LAWS, system.medium), (BODIES, system.body))
    medium, body = (summary.part(name_in(kinds, x), x) for kinds, x in parts)
    lines = [f"{medium}, {body}", *notes(system)]
    for effect in system.effects:
        cost = f"; costs {effect.cost}" if effect.cost else ""
        limit = (
            f"; gone at {effect.limit}, order {effect.order}" if effect.limit else ""
        )
        premises = negation(effect.breaks) or "keeps every premise"
        lines.append(
            f"on:  {summary.part(effect.kind, effect)}; {premises}{cost}{limit}"
        )
        if sizes := effect_sizes(effect, system.body):
            lines.append(f"     {sizes}")
        if assumed := effect.assumes(system.medium):
            lines.append(f"     assumes {assumed}")
    off = [name for name in EFFECTS if name not in [e.kind for e in system.effects]]
    compilable = is_compilable(record(system.medium, system.solver.loads))
    lines.append("off, not evaluated: " + (", ".join(off) or "none"))
    return [
        *lines,
        f"back end: {system.solver.computed(compilable, name_in(LAWS, system.medium))}",
    ]


def _table(system: Table) -> list[str]:
    held = system.stored
    lines = [f"table ({in_line(system.file)}: {held.connection!r})"]
    if system.tube is not None:
        lines.append(
            f"known near a measured gait alone; errors are those of {system.tube.taylor.level:.3g} of cases"
        )
    elif held.harmonics:
        lines.append(
            f"with the odd harmonics of xi in the direction of alphadot to {held.highest}: {held.harmonics!r}"
        )
    else:
        lines.append(
            "A alone: xi = A alphadot"
            + ", and what the fit left is part of every error" * held.has_residual
        )
    if held.even is not None:
        lines.append("xi is not odd in alphadot: what is even is part of every error")
    if held.A_error is not None and system.tube is None:
        lines.append("its file tells intervals of A: they are part of every error")
    if not held.has_residual:
        lines.append(
            "the file does not tell what its fit left: errors are those of the grid alone"
        )
    if held.computed is not None and (differences := compared(system.original)):
        found = ", ".join(f"{name} {100 * x:.2g} %" for name, x in differences.items())
        lines.append(
            f"largest difference of sysplotter's own from ours, in the middle half of the grid: {found}"
        )
    if system.swimmer:
        parts = ((LAWS, system.swimmer.medium), (BODIES, system.swimmer.body))
        medium, body = (summary.part(name_in(kinds, x), x) for kinds, x in parts)
        lines.append(f"changes of shape cost the drag of {medium} on {body}")
    own = system.original.frame
    frame = held.frame if held.frame == own else f"{held.frame}, from {own} in the file"
    lines.append(
        f"stored as {SIGNS[held.sign]}, arrays as {held.order}, lengths in {held.unit}, frame {frame}"
    )
    return [
        *lines,
        *system.assumed,
        "its field has the grid of the file; [numerics] grid, extent and directions say nothing",
    ]
