"""The tables of a scene: displacements by every tier, and what is computed for them,
each table once."""

from __future__ import annotations

import copy
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.errors import choose
from geomech.core.variables import Result
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import Connection, even_part
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.curvature import error as ccf_error
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.periods import Periods, periodic_axes, winding
from geomech.mathematics.geometry.representations.field import Field, inside
from geomech.mathematics.geometry.representations.harmonics import Harmonics
from geomech.mathematics.geometry.representations.plane import Plane
from geomech.mathematics.geometry.two_form import TwoForm, two_form
from geomech.mathematics.systems.base import body_size, refuse_singular, shape_labels
from geomech.mathematics.systems.capabilities import gaits_per_batch, stored_table
from geomech.mathematics.systems.framed import NAME as MINIMUM_PERTURBATION
from geomech.mathematics.systems.framed import in_frame
from geomech.mathematics.tiers import TIERS, fitted, harmonic
from geomech.mathematics.tiers.base import Plan, Table, Tier, in_groups
from geomech.runs.progress import progress as shown_progress
from geomech.scenes.frames import framed
from geomech.scenes.model import Scene, frequency_of
from geomech.studies.available import available_tiers, default_tiers
from geomech.studies.displacement.variables import displacement_result, timing_variables
from geomech.studies.estimates import cost, effort, estimate, uncertainty
from geomech.studies.realised import RealisedGait, realised
from rft.core.checks import real_array
from rft.core.refusal import Refusal, located

# Phases that show whether a gait is far from leaving the field, and those that `cost`
# checks.
CHECKED_PHASES = 4096
CHECKED_AMPLITUDES = 64  # those that `cost` checks


class StoredTable(NamedTuple):
    """A table, the seconds that it took, and whether it was computed before."""

    table: Any
    seconds: float
    computed_before: bool


class SceneTables:
    """A scene and the tables computed for it so far, each stored under its name, the
    system and all other data that it depends on. `with_numerics` returns the tables of
    the scene with other numerics, in the same store. `geomech.Study` reads them."""

    def __init__(self, scene: Scene, tables: dict | None = None):
        if not isinstance(scene, Scene):
            raise Refusal("a study needs a Scene", value=scene)
        self.scene = scene
        self._tables = {} if tables is None else tables

    def __repr__(self) -> str:
        names = sorted({str(key[0]) for key in self.computed})
        computed = ", ".join(names) or "nothing yet"
        tiers = ", ".join(self.tiers)
        return f"Study({self.scene!r}; tiers {tiers}; computed: {computed})"

    @property
    def computed(self) -> tuple:
        """Keys (name, system, key) of the tables computed so far."""
        return tuple(self._tables)

    @property
    def tiers(self) -> tuple[str, ...]:
        """Names of the tiers that predict the scene's system."""
        return available_tiers(self.scene.system)

    def with_numerics(self, **numerics: Any) -> Self:
        """Return the study with other [numerics] and the same stored tables; an entry
        given as None stays as it is."""
        return self._with_scene(self.scene.with_numerics(**numerics))

    def in_frame(self, frame: str) -> Self:
        """Return the study in another body frame; Refusal for an unknown one, or the
        scene's own."""
        scene = self.scene
        with located(scene.name):
            if frame == scene.frame:
                raise Refusal(
                    f"the frame is {frame!r} already", instead=("choose another")
                )
            if frame == MINIMUM_PERTURBATION:
                system = framed(scene.system, scene.numerics)
            else:
                try:
                    system = in_frame(scene.system, frame)
                except Refusal as refusal:
                    refusal.instead = f"or use {MINIMUM_PERTURBATION!r}"
                    raise
            return self._with_scene(scene.changed(system=system))

    def _with_scene(self, scene: Scene) -> Self:
        """Return the study of another scene with the same stored tables."""
        study = copy.copy(self)
        study.scene = scene
        return study

    # Tables: computed at their first use.

    def _stored(self, name: str, key: tuple, build: Callable) -> StoredTable:
        """Return the table of a name and key, by build() where it is not stored yet."""
        full_key = (name, self.scene.system, key)
        computed_before = full_key in self._tables
        if not computed_before:
            # Loaded before the clock starts, so that no table is charged for it.
            import scipy.interpolate  # noqa: F401

            self._tables[full_key] = timed_call(build)
        table, seconds = self._tables[full_key]
        return StoredTable(table, seconds, computed_before)

    def _build(self, table: Table, progress: Callable | None = None) -> StoredTable:
        """Return the data of a table of a tier. Without ``progress`` a line shows the
        progress of a table that takes long."""

        def build():
            if progress:
                return table.build(progress)
            balances = f"{table.balances:,} force balances"
            title = f"{table.name} of {self.scene.name}, {balances}"
            with shown_progress(title, bar=False) as report:
                return table.build(report)

        return self._stored(table.name, table.key, build)

    def plan(
        self, tier: str, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> Plan:
        """Return how a tier predicts displacements of a gait, or of the scene's own;
        Refusal if it is not available."""
        with located(self.scene.name):
            chosen = _tier(tier)
            chosen.refuse(self.scene.system)
            return self._plan(chosen, self._gait(gait), amplitudes)

    def _plan(self, tier: Tier, gait: Gait, amplitudes) -> Plan:
        scene = self.scene
        if tier.rests_on:  # what integrates a connection does so along the true loop
            gait = self._realised(gait)
        return tier.plan(scene.system, scene.numerics, gait, amplitudes)

    def realised(self, gait: Gait | None = None) -> Gait | RealisedGait:
        """Return the loop that the shape really makes under a gait, or the scene's own:
        the gait itself unless joints give way. It is computed when it is first asked
        for its shapes, once for each amplitude."""
        return self._realised(self._gait(gait))

    def _realised(self, gait: Gait) -> Any:
        scene = self.scene
        loop = realised(scene.system, gait, scene.numerics.phases)
        if loop is gait:
            return gait
        key = ("realised loop", scene.system, (gait, scene.numerics.phases))
        try:
            return self._tables.setdefault(key, loop)
        except TypeError:  # a gait that cannot be hashed
            return loop

    def _gait(self, gait: Gait | None) -> Gait:
        """Return the gait given, checked, or the scene's own."""
        if gait is None:
            return self.scene.gait
        return self.scene.fitting_gait(gait)

    def table(
        self,
        tier: str,
        gait: Gait | None = None,
        amplitudes: ArrayLike | None = None,
        progress: Callable | None = None,
    ) -> Any:
        """Return the table of a tier, computed once: a Connection, Harmonics or a
        Family; None for a tier without one. Refusal if the tier is not available."""
        return self._table_of_plan(self.plan(tier, gait, amplitudes), progress)

    def _table_of_plan(self, plan: Plan, progress: Callable | None = None) -> Any:
        if not plan.table:
            return None
        with located(self.scene.name):
            return self._build(plan.table, progress).table

    def _connection_table(self) -> Table:
        return fitted.table(self.scene.system, self.scene.numerics)

    @property
    def fitted(self) -> Connection:
        """Least-squares connection on the scene's grid."""
        return self.compute_field()

    def compute_field(self, progress: Callable | None = None) -> Connection:
        """Return `fitted`. progress: called with the fraction done."""
        with located(self.scene.name):
            fitted.refuse(self.scene.system)
            return self._build(self._connection_table(), progress).table

    @property
    def harmonics(self) -> Harmonics | None:
        """Harmonics of the velocity in a plain study; None where it is linear, or has
        too many joints."""
        if not harmonic.is_looked_up(self.scene.system):
            return None
        return self.compute_harmonics()

    def compute_harmonics(self, progress: Callable | None = None) -> Harmonics:
        """Return the odd harmonics of the velocity on the scene's grid. progress:
        called with the fraction done."""
        with located(self.scene.name):
            table = harmonic.table(self.scene.system, self.scene.numerics)
            return self._build(table, progress).table

    def plane(
        self,
        pair: Sequence[int],
        shape: ArrayLike | None = None,
        progress: Callable | None = None,
    ) -> Plane:
        """Return a plane of shape space in which two joints move, counted from 1,
        through a shape or the gait's middle: the CCF of that pair, without a field of
        all joints (`geomech.mathematics.geometry.representations.plane`)."""
        scene = self.scene
        joints = cast(tuple[int, int], tuple(pair))
        through: Any = scene.gait.middle if shape is None else shape
        with located(scene.name):

            def build():
                return fitted.plane(
                    scene.system, scene.numerics, joints, through, progress
                )

            key = (*self._connection_table().key, *joints, *through)
            return self._stored("plane", key, build).table

    @property
    def curvature(self) -> Field:
        """CCF of `fitted`, for joints 1 and 2."""
        key = self._connection_table().key
        return self._stored("ccf", key, lambda: ccf(self.fitted)).table

    @property
    def curvature_error(self) -> Field:
        """Estimated error of `curvature`."""
        key = self._connection_table().key
        name = "error of the ccf"
        return self._stored(name, key, lambda: ccf_error(self.fitted)).table

    @property
    def two_form(self) -> TwoForm:
        """CCF of all pairs of joints, of any number
        (`geomech.mathematics.geometry.two_form`)."""
        key = self._connection_table().key
        return self._stored("two-form", key, lambda: two_form(self.fitted)).table

    @property
    def even_part(self) -> np.ndarray | None:
        """Part of the velocity that is even in alphadot, as with skin friction
        (`connection.even_part`); None if there is none."""
        system = self.scene.system
        if stored_table(system, "connection"):
            return stored_table(system, "even part")

        def build():
            return even_part(system.velocity, self.fitted.axes, system.traits)

        key = fitted.key(self.scene.numerics, ("grid", "extent"))
        return self._stored("even part", key, build).table

    @property
    def metric(self) -> Metric | Finsler:
        """Cost of changes of shape on the field's grid
        (`geomech.mathematics.geometry.metric`): a quadratic form where xi = A alphadot,
        else a norm. Refusal if the system has none."""
        return self.compute_metric()

    def compute_metric(self, progress: Callable | None = None) -> Metric | Finsler:
        """Return `metric`. progress: called with the fraction done. Where it needs the
        velocities of the harmonic table, that table is stored as well."""
        scene = self.scene
        with located(scene.name):
            key = fitted.key(scene.numerics, effort.DEPENDS_ON)
            build = partial(self._new_metric, progress)
            return self._stored("metric", key, build).table

    def _new_metric(self, progress: Callable | None) -> Metric | Finsler:
        """Return `metric`, computed anew."""
        system = self.scene.system
        numerics = self.scene.numerics
        table = harmonic.table(system, numerics)
        key = (table.name, system, table.key)
        if not effort.shares_velocities(system) or key in self._tables:
            return effort.fit_metric(system, numerics, progress)
        # The velocities of the metric are those of the harmonics.
        both, seconds = timed_call(
            effort.fit_with_harmonics, system, numerics, progress
        )
        harmonics, norm = both
        self._tables[key] = (harmonics, seconds)
        return norm

    # Displacements and their cost.

    def effort(
        self, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> dict[str, np.ndarray]:
        """Return path length and work of a gait, or the scene's own, with their errors:
        see `geomech.studies.estimates.effort.effort`."""
        with located(self.scene.name):
            self.scene.note_turns(self._gait(gait), amplitudes)
            return effort.effort(self.scene, gait, amplitudes)

    def poses(
        self, tier: str, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> np.ndarray:
        """Return the net pose per cycle (..., 3) by one tier of TIERS for amplitudes
        (...,), of a gait or the scene's own."""
        scene = self.scene
        gait = self._gait(gait)
        with located(scene.name):
            plan = self.plan(tier, gait, amplitudes)
            scene.note_turns(gait, amplitudes)
            self._refuse_singular(plan, gait, amplitudes)
            return plan.predict(self._table_of_plan(plan), amplitudes)

    def spread(
        self, tier: str, gait: Gait | None = None, amplitudes: ArrayLike | None = None
    ) -> np.ndarray | None:
        """Return how far `poses` depend on an arbitrary choice of the tier, such as a
        surface spanned by the loop: (B, 2), in the system's unit and rad; None without
        one. Estimates include it."""
        plan = self.plan(tier, gait, amplitudes)
        return plan.spread(self._table_of_plan(plan), amplitudes)

    def _refuse_singular(
        self, plan: Plan, gait: Gait, amplitudes, phases: int | None = None
    ) -> None:
        """Refuse a gait, or a curve of the family of the table, that meets a singular
        shape. phases: the scene's if None."""
        system = self.scene.system
        if system.traits.singularity is None:
            return
        if phases is None:
            phases = self.scene.numerics.phases
        checked = gait.amplitude if amplitudes is None else amplitudes
        checked = real_array("amplitudes", checked)
        if plan.table and plan.table.amplitudes is not None:
            checked = plan.table.amplitudes
        alpha, _ = gait.cycle(phases, checked)
        refuse_singular(system, alpha)

    def displacements(
        self,
        amplitudes: Sequence[float],
        tiers: Sequence[str] | None = None,
        gait: Gait | None = None,
        progress: Callable | None = None,
    ) -> Result:
        """Return the net poses
        (`geomech.studies.displacement.variables.displacement_result`) by tiers of TIERS
        (`default_tiers` if None), with their errors
        (`geomech.studies.estimates.estimate`).

        seconds, by part: time to build each table ("field", "harmonic table" ...), even
        if it was built before, and time of each tier from there, of the direct one with
        its errors; "errors" of the others, without the direct tier; "medium" of the
        errors of an uncertain one. computed_before: of tables that were stored, whose
        seconds are not part of this call."""
        scene = self.scene
        gait, values, plans = self._checked_request(gait, amplitudes, tiers)
        # The medium first, as it may refuse.
        medium, took = timed_call(uncertainty.medium_spread, scene, gait, values)
        seconds, computed_before = self._build_all(plans, progress)
        if medium:
            seconds["medium"] = took
        poses, errors, spreads = self._predict(plans, gait, values, seconds)
        timings = timing_variables(seconds, computed_before)
        return displacement_result(
            scene, gait, values, poses, errors, medium, spreads, timings
        )

    def _build_all(
        self, plans: dict[str, Plan], progress: Callable | None
    ) -> tuple[dict[str, float], list[str]]:
        """Build the tables of plans by tier; return the seconds that each took, even if
        before, and the names of those that were stored."""
        field = self._connection_table().name

        # The field first, as it is also drawn.
        fields = []
        others = []
        for tier, plan in plans.items():
            if plan.table and plan.table.name == field:
                fields.append(("field", plan.table))
            elif plan.table:
                others.append((f"{tier} table", plan.table))

        seconds: dict[str, float] = {}
        computed_before = []
        for name, table in [*fields, *others]:
            if name in seconds:
                continue
            with located(self.scene.name):
                stored = self._build(table, progress)
            seconds[name] = stored.seconds
            if stored.computed_before:
                computed_before.append(name)
        return seconds, computed_before

    def _predict(
        self,
        plans: dict[str, Plan],
        gait: Gait,
        amplitudes: np.ndarray,
        seconds: dict[str, float],
    ) -> tuple[dict, dict, dict]:
        """Return net poses, their errors, and spreads, each by tier, and add to the
        seconds what each tier and the errors took."""
        scene = self.scene
        sizes = [body_size(scene.system), 1.0]  # errors are in body lengths
        poses = {}
        errors = {}
        spreads = {}
        reference = None
        for tier in _reference_first(plans):
            if plans[tier].exact:
                phases = scene.numerics.phases
                reference, seconds[tier] = timed_call(
                    estimate.direct, scene, gait, amplitudes, phases
                )
                poses[tier], errors[tier] = reference
                continue

            poses[tier], seconds[tier] = timed_call(self.poses, tier, gait, amplitudes)
            error, took = timed_call(
                estimate.errors_from_direct,
                scene, poses[tier], gait, amplitudes, reference,
            )  # fmt: skip
            spread = self.spread(tier, gait, amplitudes)
            if spread is not None:
                spreads[tier] = spread
                error = np.maximum(error, spread / sizes)
            errors[tier] = error
            if reference is None:
                seconds["errors"] = seconds.get("errors", 0.0) + took
        poses = {tier: poses[tier] for tier in plans}
        errors = {tier: errors[tier] for tier in plans}
        return poses, errors, spreads

    def cost(
        self,
        amplitudes: Sequence[float],
        tiers: Sequence[str] | None = None,
        gait: Gait | None = None,
        more: Sequence[cost.Job] = (),
    ) -> cost.Cost:
        """Return the cost of `displacements`, and of ``more`` jobs: force balances,
        seconds on this machine and memory; see `geomech.studies.estimates.cost`."""
        gait, values, plans = self._checked_request(
            gait, amplitudes, tiers, CHECKED_AMPLITUDES, CHECKED_PHASES
        )
        with located(self.scene.name):
            jobs = cost.study_jobs(self.scene, plans, len(values), gait)
            return cost.total_cost([*jobs, *more])

    def _checked_request(
        self,
        gait: Gait | None,
        amplitudes: ArrayLike,
        tiers: Sequence[str] | None,
        most_amplitudes: int = sys.maxsize,
        most_phases: int = sys.maxsize,
    ) -> tuple[Gait, np.ndarray, dict[str, Plan]]:
        """Return the gait, or the scene's own, amplitudes (B,) and plans by tier of a
        request.

        Refusal for one that makes no sense, such as a gait that leaves the field. At
        most so many amplitudes and phases are checked for that."""
        scene = self.scene
        gait = self._gait(gait)
        amplitudes = real_array("amplitudes", amplitudes)
        if amplitudes.ndim != 1:
            raise Refusal(
                "amplitudes must be a list of numbers",
                value=amplitudes,
                where=scene.name,
            )
        if tiers is None:
            tiers = default_tiers(scene.system)
        if isinstance(tiers, str) or not isinstance(tiers, Sequence):
            raise Refusal(
                f"tiers must be a list of {', '.join(TIERS)}",
                value=tiers,
                where=scene.name,
            )

        with located(scene.name):
            frequency_of(scene.system, gait)
            winding(gait, scene.system.traits.periods, amplitudes)  # or a refusal
            scene.note_turns(gait, amplitudes)
            checked = _evenly_sampled(np.sort(amplitudes), most_amplitudes)
            most_phases = max(most_phases, 4 * gait.harmonics)
            phases = min(scene.numerics.phases, most_phases)
            plans = {}
            for tier in [_tier(name) for name in tiers]:
                tier.refuse(scene.system)
                plan = self._plan(tier, gait, amplitudes)
                plans[tier.name] = plan
                self._refuse_singular(plan, gait, checked, phases)
            if any(plan.table and plan.table.axes for plan in plans.values()):
                refuse_outside(scene, gait, checked, phases)
        return gait, amplitudes, plans


def _reference_first(plans: dict[str, Plan]) -> list[str]:
    """Return the tiers of plans, the direct one first, as the reference of the others,
    then from the last of TIERS to the first."""
    names = [*TIERS]

    def order(tier: str) -> tuple[bool, int]:
        return not plans[tier].exact, -names.index(tier)

    return sorted(plans, key=order)


def _evenly_sampled(values: np.ndarray, most: int) -> np.ndarray:
    """Return at most ``most`` of values (B,), with the first and the last."""
    count = min(len(values), most)
    return values[np.linspace(0, len(values) - 1, count).astype(int)]


def _tier(name: str) -> Tier:
    return TIERS[choose("tier", name, TIERS)]


def refuse_outside(
    scene: Scene, gait: Gait | None = None, amplitudes=None, phases: int | None = None
) -> None:
    """Refuse a gait, or the scene's own, that leaves the field of the tables. phases:
    the scene's if None."""
    system = scene.system
    if gait is None:
        gait = scene.gait
    if phases is None:
        phases = scene.numerics.phases
    axes = fitted.axes(system, scene.numerics)
    names = [name for name, _ in shape_labels(system)]
    periods = system.traits.periods
    amplitudes = np.atleast_1d(gait.amplitude if amplitudes is None else amplitudes)

    # Of many phases a few show which amplitudes are far from leaving the field.
    few = max(CHECKED_PHASES, 64 * gait.harmonics)
    if phases > few:

        def may_leave(batch):
            alpha, alphadot = gait.cycle(few, batch)
            return _may_leave(axes, alpha, alphadot, periods)[:, None]

        near_edge = in_groups(may_leave, amplitudes, gaits_per_batch(system, few))
        amplitudes = amplitudes[near_edge[:, 0] > 0]

    def refuse_leaving(batch):
        alpha, _ = gait.cycle(phases, batch)
        return inside(axes, alpha, names, periods)[:, 0]

    in_groups(refuse_leaving, amplitudes, gaits_per_batch(system, phases))


def _may_leave(
    axes: Sequence[np.ndarray],
    alpha: np.ndarray,
    alphadot: np.ndarray,
    periods: Periods,
) -> np.ndarray:
    """Return whether gaits alpha, alphadot (B, N, d) may leave the field between N
    phases (B,).

    They may if they come as near to its edge as they move, at twice the fastest of
    their rates there, in half of the time from phase to phase."""
    step = 2 * np.pi / alpha.shape[1]
    margin = step * np.abs(alphadot).max(1)
    low = np.array([axis[0] for axis in axes])
    high = np.array([axis[-1] for axis in axes])
    around = periodic_axes(periods)  # which no gait leaves
    low[around] = -np.inf
    high[around] = np.inf
    below = alpha.min(1) - margin < low
    above = alpha.max(1) + margin > high
    return (below | above).any(-1)


def timed_call(function: Callable, *args: Any) -> tuple[Any, float]:
    """Return the value of a call, and the seconds that it took."""
    start = time.perf_counter()
    value = function(*args)
    return value, time.perf_counter() - start
