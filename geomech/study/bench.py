"""The workbench of a scene: displacements by every tier. The one thing that remembers what was computed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from geomech.core.errors import SceneError, choose, named, real_array, short
from geomech.core.face import Faced
from geomech.gaits import Gait
from geomech.geometry.connection import Connection, even_part
from geomech.geometry.curvature import ccf
from geomech.geometry.curvature import error as ccf_error
from geomech.geometry.field import Field, inside
from geomech.geometry.gait import checked_gait
from geomech.geometry.metric import Finsler, Metric
from geomech.geometry.plane import Plane
from geomech.geometry.two_form import TwoForm, two_form
from geomech.run.progress import progress as shown
from geomech.scene.frames import framed
from geomech.scene.model import Scene, frequency_of
from geomech.study import cost, effort, estimate, tables, uncertainty
from geomech.study.offer import METHODS, lookups, methods, tiers
from geomech.study.results import Displacements
from geomech.systems.framed import NAME as MINIMUM_PERTURBATION
from geomech.tiers import TIERS
from geomech.tiers.base import in_groups
from geomech.tiers.path import axes, plane


class Study(Faced):
    """A scene and the tables computed for it so far, kept under what they depend on: the system, some entries of
    [numerics], for a family also the gait. `turned` gives a bench with other numerics that shares them."""

    def __init__(self, scene: Scene, tables: dict | None = None):
        if not isinstance(scene, Scene):
            raise ValueError(f"a study is that of a Scene, got {short(scene)}")
        self.scene, self._tables = scene, {} if tables is None else tables

    def __repr__(self) -> str:
        held = sorted({str(key[0]) for key in self.computed})
        return f"Study({self.scene!r}; tiers {', '.join(self.tiers)}; computed: {', '.join(held) or 'nothing yet'})"

    @property
    def computed(self) -> tuple:
        """What tables there are, each (name, system, ...), all that it depends on."""
        return tuple(self._tables)

    def turned(self, **numerics) -> Study:
        """The bench of the scene with some of its [numerics] changed; None keeps a value."""
        return Study(self.scene.with_numerics(**numerics), self._tables)

    def in_frame(self, frame: str) -> Study:
        """The bench of the scene in another body frame; SceneError for one of no such name, or the scene's own."""
        s = self.scene
        with named(s.name):
            if frame == s.frame:
                raise ValueError(f"the frame is {frame!r} already: name another")
            system = framed(s.system, s.numerics) if frame == MINIMUM_PERTURBATION else s.system.in_frame(frame)
            return Study(s.changed(system=system), self._tables)

    methods = property(lambda self: methods(self.scene.system))
    tiers = property(lambda self: tiers(self.scene.system))
    lookups = property(lambda self: lookups(self.scene.system))

    def _kept(self, what: str, depends_on: Sequence[str], reach: tuple, make: Callable):
        """(what was made, the seconds that took, whether it was there before)."""
        s = self.scene
        key = what, s.system, *(getattr(s.numerics, name) for name in depends_on), *reach
        if not (there := key in self._tables):
            import scipy.interpolate  # noqa: F401  which every look-up needs: loading it is no part of any

            self._tables[key] = timed(make)
        return *self._tables[key], there

    def table(self, tier: str, gait: Gait | None = None, amplitudes=None, progress: Callable | None = None) -> Any:
        """What a tier looks up, computed once: a Connection, Harmonics or a Family; SceneError if it has none."""
        return self._table(tier, gait, amplitudes, progress)[0]

    def _table(self, tier: str, gait: Gait | None, amplitudes, progress: Callable | None = None):
        with named(self.scene.name):
            how = TIERS[choose("methods", tier, METHODS)]
            how.refuse(self.scene.system)
            reach = how.reach(self.scene.gait if gait is None else checked_gait(gait), amplitudes)
            make = lambda: self._made(how, reach, progress)
            return self._kept(how.looks_up, how.depends_on, reach, make)

    def _made(self, how, reach: tuple, progress: Callable | None):
        """The table of a tier; how far it is, if nobody wants to be told, is shown where it takes long."""
        if progress:
            return how.table(self.scene.system, self.scene.numerics, *reach, progress=progress)
        s = self.scene
        solves = how.solves(s.system, s.numerics, s.gait, 1, s.numerics.phases)
        with shown(f"{how.looks_up} of {s.name}, {solves:,} force balances", bar=False) as bar:
            return how.table(s.system, s.numerics, *reach, progress=bar)

    def needs_field(self, method: str) -> bool:
        """Whether a tier looks the fitted connection up on the grid."""
        tier = TIERS[choose("methods", method, METHODS)]
        return tier.looks_up == "connection" and self._looked_up(tier)

    def _looked_up(self, tier) -> bool:
        return not (tier.is_direct(self.scene.system) or tier.around(self.scene.system, self.scene.numerics))

    def compute_field(self, progress: Callable | None = None) -> None:
        """Fill `fitted` now, telling ``progress`` the fraction done."""
        self.table("path", progress=progress)

    @property
    def fitted(self) -> Connection:
        """The least-squares connection on the scene's grid."""
        return self.table("path")

    def plane(self, pair: Sequence[int], at=None, progress: Callable | None = None) -> Plane:
        """Shape space where two joints move, from 0, and the others are those of a shape, or of the gait's middle: the CCF of
        that pair, without a field of all joints (`geomech.geometry.plane`)."""
        s, at = self.scene, self.scene.gait.middle if at is None else at
        with named(s.name):
            make = lambda: plane(s.system, s.numerics, tuple(pair), at, progress)
            return self._kept("plane", TIERS["path"].depends_on, (*pair, *at), make)[0]

    @property
    def two_form(self) -> TwoForm:
        """The CCF of all pairs of joints, of any number (`geomech.geometry.two_form`)."""
        return self._kept("two-form", TIERS["path"].depends_on, (), lambda: two_form(self.fitted))[0]

    def compute_metric(self, progress: Callable | None = None) -> Metric | Finsler:
        """`metric`, telling ``progress`` the fraction done. Where it takes the velocities of the harmonic table, that is
        made beside it, if it is not there yet."""
        s = self.scene
        with named(s.name):
            return self._kept("metric", effort.DEPENDS_ON, (), lambda: self._made_metric(progress))[0]

    def _made_metric(self, progress: Callable | None) -> Metric | Finsler:
        system, n, tier = self.scene.system, self.scene.numerics, TIERS["harmonic"]
        key = tier.looks_up, system, *(getattr(n, name) for name in tier.depends_on)
        if key in self._tables or not effort.shared(system):
            return effort.table(system, n, progress)
        (harmonics, norm), took = timed(lambda: effort.with_harmonics(system, n, progress))
        self._tables[key] = harmonics, took
        return norm

    @property
    def metric(self) -> Metric | Finsler:
        """What a change of shape costs, on the field's grid (`geomech.geometry.metric`): a quadratic form where xi = A
        alphadot, else a norm. SceneError if the system has none."""
        return self.compute_metric()

    def effort(self, gait: Gait | None = None, amplitudes=None) -> dict[str, np.ndarray]:
        """Path length and work of a gait, or the scene's own, with their errors: `geomech.study.effort.effort`."""
        with named(self.scene.name):
            self.scene.note_turns(self.scene.gait if gait is None else checked_gait(gait), amplitudes)
            return effort.effort(self.scene, gait, amplitudes)

    @property
    def even_part(self) -> np.ndarray | None:
        """What of the velocity is even in alphadot, as skin friction makes it (`connection.even_part`): None if nothing."""
        system = self.scene.system
        if system.stored("connection"):
            return system.stored("even part")
        make = lambda: even_part(system.velocity, self.fitted.axes, system.singularity)
        return self._kept("even part", ("grid", "extent"), (), make)[0]

    @property
    def curvature(self) -> Field:
        """The CCF of `fitted`, for joints 1 and 2."""
        return self._kept("ccf", TIERS["path"].depends_on, (), lambda: ccf(self.fitted))[0]

    @property
    def curvature_error(self) -> Field:
        """The estimated error of `curvature`."""
        return self._kept("error of the ccf", TIERS["path"].depends_on, (), lambda: ccf_error(self.fitted))[0]

    def displacement(self, method: str, gait: Gait | None = None, amplitudes=None) -> np.ndarray:
        """Net pose per cycle (..., 3) by one tier of METHODS for amplitudes (...,), of a gait or the scene's own."""
        scene, gait = self.scene, self.scene.gait if gait is None else checked_gait(gait)
        with named(scene.name):
            tier = TIERS[choose("methods", method, METHODS)]
            tier.refuse(scene.system)
            scene.note_turns(gait, amplitudes)
            self._refuse_singular(tier, gait, amplitudes)
            table = self.table(method, gait, amplitudes) if self._looked_up(tier) else None
            return tier.predict(table, scene.system, gait, amplitudes, scene.numerics)

    def choice(self, method: str, gait: Gait | None = None, amplitudes=None) -> np.ndarray | None:
        """(B, 2), the system's unit and rad: how far `displacement` hangs on a choice of the tier's own, such as a surface
        that the loop spans; None without one. Part of every estimate."""
        s, tier, gait = self.scene, TIERS[method], self.scene.gait if gait is None else gait
        table = self.table(method, gait, amplitudes) if self._looked_up(tier) else None
        return tier.choice(table, s.system, gait, amplitudes, s.numerics)

    def refuse_outside(self, gait: Gait | None = None, amplitudes=None) -> None:
        """ValueError if the gait, or the scene's own, leaves the field that is looked up."""
        system, n, gait = self.scene.system, self.scene.numerics, self.scene.gait if gait is None else gait
        field, every = axes(system, n), gait.amplitude if amplitudes is None else amplitudes
        shapes = lambda some: inside(field, gait.cycle(n.phases, some)[0], [x for x, _ in system.shape_labels])[:, 0]
        in_groups(shapes, every, system.at_once(n.phases))

    def _refuse_singular(self, tier, gait: Gait, amplitudes) -> None:
        """ValueError if the gait, or a curve of the family that is looked up, meets a singular shape."""
        system, n = self.scene.system, self.scene.numerics
        if system.singularity is not None:
            a = real_array("amplitudes", gait.amplitude if amplitudes is None else amplitudes)
            if reach := tier.reach(gait, a):
                a = np.outer([x for x in reach[1:] if x], np.arange(1, n.curves + 1) / n.curves).ravel()
            system.refuse_singular(gait.cycle(n.phases, a)[0])

    def study(
        self, amplitudes: Sequence[float], methods: Sequence[str], gait: Gait | None = None, progress=None
    ) -> dict:
        """A table (`geomech.study.tables.table`) of the net poses by tiers of METHODS, with their errors, and besides
        {"seconds": {...}, "kept": [...]}.

        estimate, estimate_heading: errors (`geomech.study.estimate`), in the unit of the poses, and rad.
        seconds: what building each table took, by its name ("field", "harmonic table" ...), whenever that was, and what each
        tier took from there, the direct one with its errors; "errors" of the others, where it is not asked for; "medium" of
        the errors of an uncertain one. kept: the tables that were there before, whose seconds are not of this call.
        """
        gait, amplitudes, chosen = self._asked(gait, amplitudes, methods)
        medium, took = timed(lambda: uncertainty.of_medium(self.scene, gait, amplitudes))  # refuses, before the rest
        seconds, kept = self._built(chosen, gait, amplitudes, progress)
        if medium:
            seconds["medium"] = took
        poses, errors, choices, reference = {}, {}, {}, None
        size = [self.scene.system.length, 1.0]  # estimates are in body lengths
        for method in sorted(chosen, key=METHODS.index, reverse=True):  # direct first: the others are checked with it
            if chosen[method].is_direct(self.scene.system):
                direct = lambda: estimate.direct(self.scene, gait, amplitudes, self.scene.numerics.phases)
                reference, seconds[method] = timed(direct)
                poses[method], errors[method] = reference
            else:
                poses[method], seconds[method] = timed(lambda m=method: self.displacement(m, gait, amplitudes))
                check = lambda m=method: estimate.against_direct(self.scene, poses[m], gait, amplitudes, reference)
                errors[method], took = timed(check)
                if (choice := self.choice(method, gait, amplitudes)) is not None:
                    choices[method], errors[method] = choice, np.maximum(errors[method], choice / size)
                if reference is None:
                    seconds["errors"] = seconds.get("errors", 0.0) + took
        poses, errors = ({m: x[m] for m in methods} for x in (poses, errors))
        told = {"seconds": seconds, "kept": kept}
        return Displacements(tables.result(self.scene, gait, amplitudes, poses, errors, medium, choices, **told))

    def _built(self, chosen: dict, gait: Gait, amplitudes, progress) -> tuple[dict[str, float], list[str]]:
        """The tables of tiers, built: seconds that each took, whenever that was, and the names of those that were there."""
        seconds, kept = {}, []
        looked_up = [m for m in chosen if self._looked_up(chosen[m])]
        for method in sorted(
            looked_up, key=lambda m: chosen[m].looks_up != "connection"
        ):  # the field is the picture, too
            name = "field" if self.needs_field(method) else f"{method} table"
            if name not in seconds:
                _, seconds[name], there = self._table(method, gait, amplitudes, progress)
                kept += [name] * there
        return seconds, kept

    def cost(self, amplitudes: Sequence[float], methods: Sequence[str], gait: Gait | None = None, more=()) -> cost.Cost:
        """What `study` would take, and ``more`` jobs: force balances, seconds on this machine and memory; see
        `geomech.study.cost`."""
        gait, amplitudes, _ = self._asked(gait, amplitudes, methods)
        with named(self.scene.name):
            return cost.price([*cost.study(self.scene, methods, len(amplitudes), gait), *more])

    def _asked(self, gait, amplitudes, methods):
        """(gait, or the scene's own, amplitudes (B,), tiers by name) of a request; SceneError for what makes none."""
        scene = self.scene
        gait, amplitudes = checked_gait(scene.gait if gait is None else gait), real_array("amplitudes", amplitudes)
        if amplitudes.ndim != 1:
            raise SceneError(f"{scene.name}: amplitudes must be a list of numbers, got {short(amplitudes)}")
        if isinstance(methods, str) or not isinstance(methods, Sequence):
            raise SceneError(f"{scene.name}: methods must be a list of {', '.join(METHODS)}, got {short(methods)}")
        with named(scene.name):
            frequency_of(scene.system, gait)
            scene.note_turns(gait, amplitudes)
            chosen = {m: TIERS[choose("methods", m, METHODS)] for m in methods}
            for tier in chosen.values():
                tier.refuse(scene.system)
                self._refuse_singular(tier, gait, amplitudes)
                if tier.on_grid and self._looked_up(tier):
                    self.refuse_outside(gait, amplitudes)
        return gait, amplitudes, chosen


def timed(f: Callable) -> tuple[Any, float]:
    """(value, seconds)."""
    start = time.perf_counter()
    value = f()
    return value, time.perf_counter() - start
