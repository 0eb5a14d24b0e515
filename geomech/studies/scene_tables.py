"""The tables of a scene: displacements by every tier, and what is computed for them, each
table once."""

from __future__ import annotations

import copy
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.errors import choose
from geomech.core.variables import Result
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
from geomech.scenes.frames import framed
from geomech.scenes.model import Scene, frequency_of
from geomech.studies import cost, effort, estimate, tables, uncertainty
from geomech.studies.available import available_tiers, default_tiers
from geomech.systems.base import body_size, refuse_singular, shape_labels
from geomech.systems.capabilities import gaits_per_batch, stored_table
from geomech.systems.framed import NAME as MINIMUM_PERTURBATION
from geomech.systems.framed import in_frame
from geomech.tiers import TIERS, fitted, harmonic
from geomech.tiers.base import Plan, Table, Tier, in_groups
from rft.core.checks import real_array
from rft.core.refusal import Refusal, located

FEW_PHASES = 4096  # that tell whether a gait is far from leaving the field
SAMPLES = 64, FEW_PHASES  # amplitudes and phases that `cost` checks, of all


class SceneTables:
    """A scene and the tables computed for it so far, each stored under its name, the system
    and all other data that it depends on. `with_numerics` returns those of the scene with
    other numerics, which shares them. `geomech.Study` asks them."""

    def __init__(self, scene: Scene, tables: dict | None = None):
        if not isinstance(scene, Scene):
            raise Refusal("a study is that of a Scene", value=scene)
        self.scene, self._tables = scene, {} if tables is None else tables

    def __repr__(self) -> str:
        names = sorted({str(key[0]) for key in self.computed})
        return f"Study({self.scene!r}; tiers {', '.join(self.tiers)}; computed: {', '.join(names) or 'nothing yet'})"

    @property
    def computed(self) -> tuple:
        """Keys (name, system, key) of the tables computed so far."""
        return tuple(self._tables)

    def with_numerics(self, **numerics: Any) -> Self:
        """Return the study with other [numerics] and the same stored tables; an entry given as None stays as it is."""
        return self._of(self.scene.with_numerics(**numerics))

    def in_frame(self, frame: str) -> Self:
        """Return the study in another body frame; Refusal for an unknown one, or the scene's own."""
        s = self.scene
        with located(s.name):
            if frame == s.frame:
                raise Refusal(f"the frame is {frame!r} already", instead="name another")
            if frame == MINIMUM_PERTURBATION:
                system = framed(s.system, s.numerics)
            else:
                try:
                    system = in_frame(s.system, frame)
                except Refusal as refusal:
                    refusal.instead = f"or take {MINIMUM_PERTURBATION!r}"
                    raise
            return self._of(s.changed(system=system))

    def _of(self, scene: Scene) -> Self:
        """Return the study of another scene with the same stored tables."""
        study = copy.copy(self)
        study.scene = scene
        return study

    tiers = property(lambda self: available_tiers(self.scene.system))

    def _stored(self, name: str, key: tuple, build: Callable):
        """Return the value of build(), the seconds that it took, and whether it was stored before."""
        key = name, self.scene.system, key
        if not (exists := key in self._tables):
            import scipy.interpolate  # noqa: F401  loaded here, so that no look-up is charged for it

            self._tables[key] = timed(build)
        return *self._tables[key], exists

    def _built(self, table: Table, progress: Callable | None = None):
        """Return what `_stored` returns, for a table. Without ``progress`` a line shows it where it takes long."""

        def build():
            if progress:
                return table.build(progress)
            with shown(
                f"{table.name} of {self.scene.name}, {table.balances:,} force balances",
                bar=False,
            ) as bar:
                return table.build(bar)

        return self._stored(table.name, table.key, build)

    def _connection(self) -> Table:
        return fitted.table(self.scene.system, self.scene.numerics)

    def plan(
        self, tier: str, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> Plan:
        """Return how a tier predicts displacements of a gait, or of the scene's own; Refusal if it is not available."""
        with located(self.scene.name):
            chosen = _tier(tier)
            chosen.refuse(self.scene.system)
            return self._plan(
                chosen,
                self.scene.gait if gait is None else checked_gait(gait),
                amplitudes,
            )

    def _plan(self, tier: Tier, gait: Gait, amplitudes) -> Plan:
        return tier.plan(self.scene.system, self.scene.numerics, gait, amplitudes)

    def table(
        self,
        tier: str,
        gait: Gait | None = None,
        amplitudes: ArrayLike | None = None,
        progress: Callable | None = None,
    ) -> Any:
        """Return the table of a tier, computed once: a Connection, Harmonics or a Family; None for a tier without one.
        Refusal if the tier is not available."""
        return self._table_of(self.plan(tier, gait, amplitudes), progress)

    def _table_of(self, plan: Plan, progress: Callable | None = None) -> Any:
        with located(self.scene.name):
            return self._built(plan.table, progress)[0] if plan.table else None

    @property
    def fitted(self) -> Connection:
        """Least-squares connection on the scene's grid."""
        return self.compute_field()

    def compute_field(self, progress: Callable | None = None) -> Connection:
        """Return `fitted`. progress: called with the fraction done."""
        with located(self.scene.name):
            fitted.refuse(self.scene.system)
            return self._built(self._connection(), progress)[0]

    def compute_harmonics(self, progress: Callable | None = None) -> Harmonics:
        """Return the odd harmonics of the velocity on the scene's grid. progress: called with the fraction done."""
        with located(self.scene.name):
            return self._built(
                harmonic.table(self.scene.system, self.scene.numerics), progress
            )[0]

    @property
    def harmonics(self) -> Harmonics | None:
        """Harmonics of the velocity in a plain study; None where it is linear, or has too many joints."""
        return (
            self.compute_harmonics()
            if harmonic.is_looked_up(self.scene.system)
            else None
        )

    def plane(
        self,
        pair: Sequence[int],
        at: ArrayLike | None = None,
        progress: Callable | None = None,
    ) -> Plane:
        """Return a plane of shape space in which two joints move, counted from 0, through a shape or the gait's middle:
        the CCF of that pair, without a field of all joints (`geomech.geometry.plane`)."""
        s, both = self.scene, cast(tuple[int, int], tuple(pair))
        place: Any = s.gait.middle if at is None else at
        with located(s.name):
            build = lambda: fitted.plane(s.system, s.numerics, both, place, progress)
            return self._stored(
                "plane", (*self._connection().key, *both, *place), build
            )[0]

    @property
    def two_form(self) -> TwoForm:
        """CCF of all pairs of joints, of any number (`geomech.geometry.two_form`)."""
        return self._stored(
            "two-form", self._connection().key, lambda: two_form(self.fitted)
        )[0]

    def compute_metric(self, progress: Callable | None = None) -> Metric | Finsler:
        """Return `metric`. progress: called with the fraction done. Where it needs the velocities of the harmonic
        table, that table is stored, too."""
        s = self.scene
        with located(s.name):
            key = fitted.key(s.numerics, effort.DEPENDS_ON)
            return self._stored("metric", key, lambda: self._new_metric(progress))[0]

    def _new_metric(self, progress: Callable | None) -> Metric | Finsler:
        system, n = self.scene.system, self.scene.numerics
        shared = harmonic.table(system, n)
        if (
            not effort.shares_velocities(system)
            or (shared.name, system, shared.key) in self._tables
        ):
            return effort.fit_metric(system, n, progress)
        (harmonics, norm), took = timed(
            lambda: effort.fit_with_harmonics(system, n, progress)
        )
        self._tables[shared.name, system, shared.key] = harmonics, took
        return norm

    @property
    def metric(self) -> Metric | Finsler:
        """Cost of changes of shape on the field's grid (`geomech.geometry.metric`): a quadratic form where xi = A
        alphadot, else a norm. Refusal if the system has none."""
        return self.compute_metric()

    def effort(
        self, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> dict[str, np.ndarray]:
        """Return path length and work of a gait, or the scene's own, with their errors: see
        `geomech.studies.effort.effort`."""
        with located(self.scene.name):
            self.scene.note_turns(
                self.scene.gait if gait is None else checked_gait(gait), amplitudes
            )
            return effort.effort(self.scene, gait, amplitudes)

    @property
    def even_part(self) -> np.ndarray | None:
        """Part of the velocity that is even in alphadot, as with skin friction (`connection.even_part`); None if there
        is none."""
        system = self.scene.system
        if stored_table(system, "connection"):
            return stored_table(system, "even part")
        build = lambda: even_part(system.velocity, self.fitted.axes, system.traits)
        return self._stored(
            "even part", fitted.key(self.scene.numerics, ("grid", "extent")), build
        )[0]

    @property
    def curvature(self) -> Field:
        """CCF of `fitted`, for joints 1 and 2."""
        return self._stored("ccf", self._connection().key, lambda: ccf(self.fitted))[0]

    @property
    def curvature_error(self) -> Field:
        """Estimated error of `curvature`."""
        return self._stored(
            "error of the ccf", self._connection().key, lambda: ccf_error(self.fitted)
        )[0]

    def poses(
        self, tier: str, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> np.ndarray:
        """Return the net pose per cycle (..., 3) by one tier of TIERS for amplitudes (...,), of a gait or the scene's
        own."""
        scene, gait = (
            self.scene,
            self.scene.gait if gait is None else checked_gait(gait),
        )
        with located(scene.name):
            plan = self.plan(tier, gait, amplitudes)
            scene.note_turns(gait, amplitudes)
            self._refuse_singular(plan, gait, amplitudes)
            return plan.predict(self._table_of(plan), amplitudes)

    def spread(
        self, tier: str, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> np.ndarray | None:
        """Return how far `poses` depend on an arbitrary choice of the tier, such as a surface spanned by the
        loop: (B, 2), in the system's unit and rad; None without one. Estimates include it."""
        plan = self.plan(tier, gait, amplitudes)
        return plan.spread(self._table_of(plan), amplitudes)

    def _refuse_singular(
        self, plan: Plan, gait: Gait, amplitudes, phases: int | None = None
    ) -> None:
        """Refuse a gait, or a curve of the family of the table, that meets a singular shape."""
        system, phases = self.scene.system, phases or self.scene.numerics.phases
        if system.traits.singularity is not None:
            a = real_array(
                "amplitudes", gait.amplitude if amplitudes is None else amplitudes
            )
            if plan.table and plan.table.amplitudes is not None:
                a = plan.table.amplitudes
            refuse_singular(system, gait.cycle(phases, a)[0])

    def displacements(
        self,
        amplitudes: Sequence[float],
        tiers: Sequence[str] | None = None,
        gait: Gait | None = None,
        progress: Callable | None = None,
    ) -> Result:
        """Return the net poses (`geomech.studies.tables.displacement_result`) by tiers of TIERS
        (`default_tiers` if None), with their errors (`geomech.studies.estimate`).

        seconds, by part: time to build each table ("field", "harmonic table" ...), even
        if it was built before, and time of each tier from there, of the direct one with
        its errors; "errors" of the others, without the direct tier; "medium" of the
        errors of an uncertain one. computed_before: of tables that were stored, whose
        seconds are not part of this call."""
        gait, values, chosen = self._checked(gait, amplitudes, tiers)
        medium, took = timed(
            lambda: uncertainty.medium_spread(self.scene, gait, values)
        )  # first, as it may refuse
        seconds, stored = self._build_all(chosen, progress)
        if medium:
            seconds["medium"] = took
        poses, errors, spreads, reference = {}, {}, {}, None
        size = [body_size(self.scene.system), 1.0]  # estimates are in body lengths
        order = [*TIERS]
        for tier in sorted(
            chosen, key=lambda m: (not chosen[m].exact, -order.index(m))
        ):  # the direct tier first, as the reference of others
            if chosen[tier].exact:
                direct = lambda: estimate.direct(
                    self.scene, gait, values, self.scene.numerics.phases
                )
                reference, seconds[tier] = timed(direct)
                poses[tier], errors[tier] = reference
            else:
                poses[tier], seconds[tier] = timed(
                    lambda m=tier: self.poses(m, gait, values)
                )
                check = lambda m=tier: estimate.errors_from_direct(
                    self.scene, poses[m], gait, values, reference
                )
                errors[tier], took = timed(check)
                if (spread := self.spread(tier, gait, values)) is not None:
                    spreads[tier], errors[tier] = (
                        spread,
                        np.maximum(errors[tier], spread / size),
                    )
                if reference is None:
                    seconds["errors"] = seconds.get("errors", 0.0) + took
        poses, errors = ({m: x[m] for m in chosen} for x in (poses, errors))
        more = tables.timing_variables(seconds, stored)
        return tables.displacement_result(
            self.scene, gait, values, poses, errors, medium, spreads, more
        )

    def _build_all(
        self, chosen: dict[str, Plan], progress
    ) -> tuple[dict[str, float], list[str]]:
        """Build the tables of tiers; return the seconds that each took, even if before, and the names of those that
        were stored."""
        field, seconds, stored = self._connection(), {}, []
        tables = {m: plan.table for m, plan in chosen.items() if plan.table}
        of_field = lambda m: tables[m].name == field.name
        for tier in sorted(
            tables, key=of_field, reverse=True
        ):  # the field first, as it is also drawn
            name = "field" if of_field(tier) else f"{tier} table"
            if name not in seconds:
                with located(self.scene.name):
                    _, seconds[name], exists = self._built(tables[tier], progress)
                stored += [name] * exists
        return seconds, stored

    def cost(
        self,
        amplitudes: Sequence[float],
        tiers: Sequence[str] | None = None,
        gait: Gait | None = None,
        more: Sequence[cost.Job] = (),
    ) -> cost.Cost:
        """Return the cost of `displacements`, and of ``more`` jobs: force balances, seconds on this machine and memory; see
        `geomech.studies.cost`."""
        gait, amplitudes, plans = self._checked(gait, amplitudes, tiers, *SAMPLES)
        with located(self.scene.name):
            return cost.total_cost(
                [*cost.study_jobs(self.scene, plans, len(amplitudes), gait), *more]
            )

    def _checked(
        self,
        gait,
        amplitudes,
        tiers,
        samples: int = sys.maxsize,
        phases: int = sys.maxsize,
    ):
        """Return the gait, or the scene's own, amplitudes (B,) and plans by tier of a request.

        Refusal for one that makes no sense, such as a gait that leaves the field at one of ``samples`` amplitudes, at so
        many phases."""
        scene = self.scene
        gait, amplitudes = (
            checked_gait(scene.gait if gait is None else gait),
            real_array("amplitudes", amplitudes),
        )
        if amplitudes.ndim != 1:
            raise Refusal(
                "amplitudes must be a list of numbers",
                value=amplitudes,
                where=scene.name,
            )
        tiers = default_tiers(scene.system) if tiers is None else tiers
        if isinstance(tiers, str) or not isinstance(tiers, Sequence):
            raise Refusal(
                f"tiers must be a list of {', '.join(TIERS)}",
                value=tiers,
                where=scene.name,
            )
        with located(scene.name):
            frequency_of(scene.system, gait)
            scene.note_turns(gait, amplitudes)
            sampled = np.sort(amplitudes)[
                np.linspace(
                    0, len(amplitudes) - 1, min(len(amplitudes), samples)
                ).astype(int)
            ]
            phases, chosen = (
                min(scene.numerics.phases, max(phases, 4 * gait.harmonics)),
                {},
            )
            for tier in [_tier(m) for m in tiers]:
                tier.refuse(scene.system)
                chosen[tier.name] = plan = self._plan(tier, gait, amplitudes)
                self._refuse_singular(plan, gait, sampled, phases)
            if any(plan.table and plan.table.axes for plan in chosen.values()):
                refuse_outside(scene, gait, sampled, phases)
        return gait, amplitudes, chosen


def refuse_outside(
    scene: Scene, gait: Gait | None = None, amplitudes=None, phases: int | None = None
) -> None:
    """Refuse a gait, or the scene's own, that leaves the field of the tables. phases: the scene's if None."""
    system, n, gait = scene.system, scene.numerics, scene.gait if gait is None else gait
    field, chosen = (
        fitted.axes(system, n),
        np.atleast_1d(gait.amplitude if amplitudes is None else amplitudes),
    )
    names, phases = [name for name, _ in shape_labels(system)], phases or n.phases
    few = max(FEW_PHASES, 64 * gait.harmonics)
    if phases > few:
        leaves = lambda group: _may_leave(field, *gait.cycle(few, group))[:, None]
        chosen = chosen[
            in_groups(leaves, chosen, gaits_per_batch(system, few))[:, 0] > 0
        ]
    shapes = lambda group: inside(field, gait.cycle(phases, group)[0], names)[:, 0]
    in_groups(shapes, chosen, gaits_per_batch(system, phases))


def _may_leave(field, alpha: np.ndarray, alphadot: np.ndarray) -> np.ndarray:
    """Return (B,), whether gaits alpha, alphadot (B, N, d) may leave the field between N phases: whether they come as near
    to its edge as they move, at twice the fastest of their rates there, in half of the time from phase to phase."""
    step = 2 * np.pi / alpha.shape[1]
    margin = step * np.abs(alphadot).max(1)
    low, high = np.array([(axis[0], axis[-1]) for axis in field]).T
    return ((alpha.min(1) - margin < low) | (alpha.max(1) + margin > high)).any(-1)


def _tier(name: str) -> Tier:
    return TIERS[choose("tier", name, TIERS)]


def timed(f: Callable) -> tuple[Any, float]:
    """Return (value, seconds)."""
    start = time.perf_counter()
    value = f()
    return value, time.perf_counter() - start
