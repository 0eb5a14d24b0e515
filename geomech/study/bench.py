"""The study of a scene: displacements by every tier. The one thing that remembers what was computed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from geomech.core.errors import choose
from geomech.core.face import Extensible
from geomech.gaits import Gait
from geomech.geometry.connection import Connection, even_part
from geomech.geometry.curvature import ccf
from geomech.geometry.curvature import error as ccf_error
from geomech.geometry.field import Field, inside
from geomech.geometry.gait import checked_gait
from geomech.geometry.harmonics import Harmonics
from geomech.geometry.metric import Finsler, Metric
from geomech.geometry.plane import Plane
from geomech.geometry.two_form import TwoForm, two_form
from geomech.run.progress import progress as shown
from geomech.scene.frames import framed
from geomech.scene.model import Scene, frequency_of
from geomech.study import cost, effort, estimate, tables, uncertainty
from geomech.study.offer import METHODS as METHODS
from geomech.study.offer import methods, tiers
from geomech.study.results import Displacements
from geomech.systems.base import refuse_singular, shape_labels
from geomech.systems.capabilities import gaits_per_batch, stored_table
from geomech.systems.framed import NAME as MINIMUM_PERTURBATION
from geomech.systems.framed import in_frame
from geomech.tiers import TIERS, fitted, harmonic
from geomech.tiers.base import Plan, Table, Tier, in_groups
from geomech.tiers.harmonic import HARMONIC
from geomech.tiers.path import PATH
from rft.checks import real_array
from rft.refusal import Refusal, located

LOOKED_AT = 64, 4096  # amplitudes and phases of a request whose cost is counted; all are where it is computed


class Study(Extensible):
    """A scene and the tables computed for it so far, each stored under its name, the system and all else that it depends
    on. `turned` gives a study with other numerics that shares them."""

    def __init__(self, scene: Scene, tables: dict | None = None):
        if not isinstance(scene, Scene):
            raise Refusal("a study is that of a Scene", value=scene)
        self.scene, self._tables = scene, {} if tables is None else tables

    def __repr__(self) -> str:
        held = sorted({str(key[0]) for key in self.computed})
        return f"Study({self.scene!r}; tiers {', '.join(self.tiers)}; computed: {', '.join(held) or 'nothing yet'})"

    @property
    def computed(self) -> tuple:
        """What tables there are, each (name, system, key), all that it depends on."""
        return tuple(self._tables)

    def turned(self, **numerics) -> Study:
        """The bench of the scene with some of its [numerics] changed; None keeps a value."""
        return Study(self.scene.with_numerics(**numerics), self._tables)

    def in_frame(self, frame: str) -> Study:
        """The bench of the scene in another body frame; Refusal for one of no such name, or the scene's own."""
        s = self.scene
        with located(s.name):
            if frame == s.frame:
                raise Refusal(f"the frame is {frame!r} already", instead="name another")
            system = framed(s.system, s.numerics) if frame == MINIMUM_PERTURBATION else in_frame(s.system, frame)
            return Study(s.changed(system=system), self._tables)

    methods = property(lambda self: methods(self.scene.system))
    tiers = property(lambda self: tiers(self.scene.system))

    @property
    def lookups(self) -> tuple[str, ...]:
        """Tiers that approximate the system's velocity, of those that say something of it."""
        s = self.scene
        return tuple(m for m in self.tiers if not TIERS[m].plan(s.system, s.numerics, s.gait, None).exact)

    def _stored(self, name: str, key: tuple, build: Callable):
        """Return (what is built, the seconds that took, whether it was there before)."""
        key = name, self.scene.system, key
        if not (there := key in self._tables):
            import scipy.interpolate  # noqa: F401  which every look-up needs: loading it is no part of any

            self._tables[key] = timed(build)
        return *self._tables[key], there

    def _built(self, table: Table, progress: Callable | None = None):
        """Return what `_stored` does of a table; how far it is, if nobody wants to be told, is shown where it takes long."""

        def build():
            if progress:
                return table.build(progress)
            with shown(f"{table.name} of {self.scene.name}, {table.balances:,} force balances", bar=False) as bar:
                return table.build(bar)

        return self._stored(table.name, table.key, build)

    def _connection(self) -> Table:
        return fitted.table(self.scene.system, self.scene.numerics)

    def plan(self, tier: str, gait: Gait | None = None, amplitudes=None) -> Plan:
        """How a tier predicts displacements of a gait, or of the scene's own; Refusal if it says nothing of the system."""
        with located(self.scene.name):
            how = _tier(tier)
            how.refuse(self.scene.system)
            return self._plan(how, self.scene.gait if gait is None else checked_gait(gait), amplitudes)

    def _plan(self, tier: Tier, gait: Gait, amplitudes) -> Plan:
        return tier.plan(self.scene.system, self.scene.numerics, gait, amplitudes)

    def table(self, tier: str, gait: Gait | None = None, amplitudes=None, progress: Callable | None = None) -> Any:
        """What a tier looks up, computed once: a Connection, Harmonics or a Family; None for nothing. Refusal if it says
        nothing of the system."""
        return self._looked_up(self.plan(tier, gait, amplitudes), progress)

    def _looked_up(self, plan: Plan, progress: Callable | None = None) -> Any:
        with located(self.scene.name):
            return self._built(plan.table, progress)[0] if plan.table else None

    def refuse_connection(self) -> None:
        """Refusal if the system has no connection."""
        with located(self.scene.name):
            fitted.refuse(self.scene.system)

    @property
    def has_connection(self) -> bool:
        """Whether the system has a connection, and joints so few that a plain study fits it."""
        return PATH.is_offered(self.scene.system)

    def compute_field(self, progress: Callable | None = None) -> None:
        """Fill `fitted` now, telling ``progress`` the fraction done."""
        self._fitted(progress)

    @property
    def fitted(self) -> Connection:
        """The least-squares connection on the scene's grid."""
        return self._fitted()

    def _fitted(self, progress: Callable | None = None) -> Connection:
        with located(self.scene.name):
            fitted.refuse(self.scene.system)
            return self._built(self._connection(), progress)[0]

    def compute_harmonics(self, progress: Callable | None = None) -> Harmonics:
        """The odd harmonics of the velocity on the scene's grid, telling ``progress`` the fraction done."""
        with located(self.scene.name):
            return self._built(harmonic.table(self.scene.system, self.scene.numerics), progress)[0]

    @property
    def harmonics(self) -> Harmonics | None:
        """What of the velocity a plain study knows beyond its linear part; None where it has no such part, or too many
        joints."""
        return self.compute_harmonics() if self.has_harmonics else None

    @property
    def has_harmonics(self) -> bool:
        """Whether there are `harmonics`."""
        system = self.scene.system
        return not system.traits.linear and HARMONIC.is_offered(system)

    def plane(self, pair: Sequence[int], at=None, progress: Callable | None = None) -> Plane:
        """Shape space where two joints move, from 0, and the others are those of a shape, or of the gait's middle: the CCF of
        that pair, without a field of all joints (`geomech.geometry.plane`)."""
        s, at = self.scene, self.scene.gait.middle if at is None else at
        with located(s.name):
            build = lambda: fitted.plane(s.system, s.numerics, tuple(pair), at, progress)
            return self._stored("plane", (*self._connection().key, *pair, *at), build)[0]

    @property
    def two_form(self) -> TwoForm:
        """The CCF of all pairs of joints, of any number (`geomech.geometry.two_form`)."""
        return self._stored("two-form", self._connection().key, lambda: two_form(self.fitted))[0]

    def compute_metric(self, progress: Callable | None = None) -> Metric | Finsler:
        """`metric`, telling ``progress`` the fraction done. Where it takes the velocities of the harmonic table, that is
        made beside it, if it is not there yet."""
        s = self.scene
        with located(s.name):
            key = fitted.key(s.numerics, effort.DEPENDS_ON)
            return self._stored("metric", key, lambda: self._new_metric(progress))[0]

    def _new_metric(self, progress: Callable | None) -> Metric | Finsler:
        system, n = self.scene.system, self.scene.numerics
        beside = harmonic.table(system, n)
        if not effort.shared(system) or (beside.name, system, beside.key) in self._tables:
            return effort.table(system, n, progress)
        (harmonics, norm), took = timed(lambda: effort.with_harmonics(system, n, progress))
        self._tables[beside.name, system, beside.key] = harmonics, took
        return norm

    @property
    def metric(self) -> Metric | Finsler:
        """What a change of shape costs, on the field's grid (`geomech.geometry.metric`): a quadratic form where xi = A
        alphadot, else a norm. Refusal if the system has none."""
        return self.compute_metric()

    def effort(self, gait: Gait | None = None, amplitudes=None) -> dict[str, np.ndarray]:
        """Path length and work of a gait, or the scene's own, with their errors: `geomech.study.effort.effort`."""
        with located(self.scene.name):
            self.scene.note_turns(self.scene.gait if gait is None else checked_gait(gait), amplitudes)
            return effort.effort(self.scene, gait, amplitudes)

    @property
    def even_part(self) -> np.ndarray | None:
        """What of the velocity is even in alphadot, as skin friction makes it (`connection.even_part`): None if nothing."""
        system = self.scene.system
        if stored_table(system, "connection"):
            return stored_table(system, "even part")
        build = lambda: even_part(system.velocity, self.fitted.axes, system.traits)
        return self._stored("even part", fitted.key(self.scene.numerics, ("grid", "extent")), build)[0]

    @property
    def curvature(self) -> Field:
        """The CCF of `fitted`, for joints 1 and 2."""
        return self._stored("ccf", self._connection().key, lambda: ccf(self.fitted))[0]

    @property
    def curvature_error(self) -> Field:
        """The estimated error of `curvature`."""
        return self._stored("error of the ccf", self._connection().key, lambda: ccf_error(self.fitted))[0]

    def displacement(self, method: str, gait: Gait | None = None, amplitudes=None) -> np.ndarray:
        """Net pose per cycle (..., 3) by one tier of TIERS for amplitudes (...,), of a gait or the scene's own."""
        scene, gait = self.scene, self.scene.gait if gait is None else checked_gait(gait)
        with located(scene.name):
            plan = self.plan(method, gait, amplitudes)
            scene.note_turns(gait, amplitudes)
            self._refuse_singular(plan, gait, amplitudes)
            return plan.predict(self._looked_up(plan), amplitudes)

    def spread(self, method: str, gait: Gait | None = None, amplitudes=None) -> np.ndarray | None:
        """(B, 2), the system's unit and rad: how far `displacement` depends on a choice of the tier's own, such as a surface
        that the loop spans; None without one. Part of every estimate."""
        plan = self.plan(method, gait, amplitudes)
        return plan.spread(self._looked_up(plan), amplitudes)

    def refuse_outside(self, gait: Gait | None = None, amplitudes=None, phases: int | None = None) -> None:
        """ValueError if the gait, or the scene's own, leaves the field that is looked up. phases: those of the scene."""
        system, n, gait = self.scene.system, self.scene.numerics, self.scene.gait if gait is None else gait
        field, every = fitted.axes(system, n), gait.amplitude if amplitudes is None else amplitudes
        names, phases = [name for name, _ in shape_labels(system)], phases or n.phases
        shapes = lambda some: inside(field, gait.cycle(phases, some)[0], names)[:, 0]
        in_groups(shapes, every, gaits_per_batch(system, phases))

    def _refuse_singular(self, plan: Plan, gait: Gait, amplitudes, phases: int | None = None) -> None:
        """ValueError if the gait, or a curve of the family that is looked up, meets a singular shape."""
        system, phases = self.scene.system, phases or self.scene.numerics.phases
        if system.traits.singularity is not None:
            a = real_array("amplitudes", gait.amplitude if amplitudes is None else amplitudes)
            if plan.table and plan.table.amplitudes is not None:
                a = plan.table.amplitudes
            refuse_singular(system, gait.cycle(phases, a)[0])

    def study(
        self, amplitudes: Sequence[float], methods: Sequence[str], gait: Gait | None = None, progress=None
    ) -> dict:
        """A table (`geomech.study.tables.table`) of the net poses by tiers of TIERS, with their errors, and besides
        {"seconds": {...}, "kept": [...]}.

        estimate, estimate_heading: errors (`geomech.study.estimate`), in the unit of the poses, and rad.
        seconds: what building each table took, by its name ("field", "harmonic table" ...), whenever that was, and what each
        tier took from there, the direct one with its errors; "errors" of the others, where it is not asked for; "medium" of
        the errors of an uncertain one. kept: the tables that were there before, whose seconds are not of this call.
        """
        gait, amplitudes, chosen = self._asked(gait, amplitudes, methods)
        medium, took = timed(lambda: uncertainty.of_medium(self.scene, gait, amplitudes))  # refuses, before the rest
        seconds, kept = self._build_all(chosen, progress)
        if medium:
            seconds["medium"] = took
        poses, errors, spreads, reference = {}, {}, {}, None
        size = [self.scene.system.length, 1.0]  # estimates are in body lengths
        order = [*TIERS]
        for method in sorted(
            chosen, key=lambda m: (not chosen[m].exact, -order.index(m))
        ):  # others are checked with direct
            if chosen[method].exact:
                direct = lambda: estimate.direct(self.scene, gait, amplitudes, self.scene.numerics.phases)
                reference, seconds[method] = timed(direct)
                poses[method], errors[method] = reference
            else:
                poses[method], seconds[method] = timed(lambda m=method: self.displacement(m, gait, amplitudes))
                check = lambda m=method: estimate.against_direct(self.scene, poses[m], gait, amplitudes, reference)
                errors[method], took = timed(check)
                if (spread := self.spread(method, gait, amplitudes)) is not None:
                    spreads[method], errors[method] = spread, np.maximum(errors[method], spread / size)
                if reference is None:
                    seconds["errors"] = seconds.get("errors", 0.0) + took
        poses, errors = ({m: x[m] for m in methods} for x in (poses, errors))
        told = {"seconds": seconds, "kept": kept}
        return Displacements(tables.result(self.scene, gait, amplitudes, poses, errors, medium, spreads, **told))

    def _build_all(self, chosen: dict[str, Plan], progress) -> tuple[dict[str, float], list[str]]:
        """Build the tables of tiers; return the seconds that each took, whenever that was, and the names of those that were
        there."""
        field, seconds, kept = self._connection(), {}, []
        tables = {m: plan.table for m, plan in chosen.items() if plan.table}
        of_field = lambda m: tables[m].name == field.name
        for method in sorted(tables, key=of_field, reverse=True):  # the field is the picture, too
            name = "field" if of_field(method) else f"{method} table"
            if name not in seconds:
                with located(self.scene.name):
                    _, seconds[name], there = self._built(tables[method], progress)
                kept += [name] * there
        return seconds, kept

    def cost(self, amplitudes: Sequence[float], methods: Sequence[str], gait: Gait | None = None, more=()) -> cost.Cost:
        """What `study` would take, and ``more`` jobs: force balances, seconds on this machine and memory; see
        `geomech.study.cost`."""
        gait, amplitudes, plans = self._asked(gait, amplitudes, methods, *LOOKED_AT)
        with located(self.scene.name):
            return cost.price([*cost.study(self.scene, plans, len(amplitudes), gait), *more])

    def _asked(self, gait, amplitudes, methods, looked_at: int = sys.maxsize, phases: int = sys.maxsize):
        """(gait, or the scene's own, amplitudes (B,), plans by tier) of a request; Refusal for what makes none, such as a
        gait that leaves the field at one of so many amplitudes and phases."""
        scene = self.scene
        gait, amplitudes = checked_gait(scene.gait if gait is None else gait), real_array("amplitudes", amplitudes)
        if amplitudes.ndim != 1:
            raise Refusal("amplitudes must be a list of numbers", value=amplitudes, where=scene.name)
        if isinstance(methods, str) or not isinstance(methods, Sequence):
            raise Refusal(f"methods must be a list of {', '.join(TIERS)}", value=methods, where=scene.name)
        with located(scene.name):
            frequency_of(scene.system, gait)
            scene.note_turns(gait, amplitudes)
            some = np.sort(amplitudes)[np.linspace(0, len(amplitudes) - 1, min(len(amplitudes), looked_at)).astype(int)]
            phases, chosen = min(scene.numerics.phases, max(phases, 4 * gait.harmonics)), {}
            for tier in [_tier(m) for m in methods]:
                tier.refuse(scene.system)
                chosen[tier.name] = plan = self._plan(tier, gait, amplitudes)
                self._refuse_singular(plan, gait, some, phases)
            if any(plan.table and plan.table.axes for plan in chosen.values()):
                self.refuse_outside(gait, some, phases)
        return gait, amplitudes, chosen


def _tier(name: str) -> Tier:
    return TIERS[choose("methods", name, TIERS)]


def timed(f: Callable) -> tuple[Any, float]:
    """(value, seconds)."""
    start = time.perf_counter()
    value = f()
    return value, time.perf_counter() - start
