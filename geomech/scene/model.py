"""Scenes: a medium, a body, a gait, effects and how finely to compute. The one place that joins rft and geomech."""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import rft
from geomech import connection as conn
from geomech import family as fam
from geomech import harmonics as harm
from geomech import predict
from geomech.curvature import ccf
from geomech.curvature import error as ccf_error
from geomech.errors import SceneError, choose, real_array, short
from geomech.field import Field
from geomech.gaits import Gait
from geomech.gaits.base import checked_gait
from geomech.reconstruct import displacement
from geomech.study import estimate
from rft.balance import checked_body
from rft.bodies.base import halves
from rft.bodies.pieces import PIECES
from rft.contact import Model
from rft.effects.base import MOST_PIECES, pieced
from rft.loads import element_load, parse
from rft.media import is_linear
from rft.media.base import check_ranges, in_range
from rft.premise import ALL, SHAPE_ALONE, Premise, not_so

if TYPE_CHECKING:
    from geomech.study.cost import Cost

METHODS = ("area", "adapted", "path", "harmonic", "direct")  # cheapest look-up first
LARGEST_GRID = 2_000_000  # shapes; a finer field is a slip of the pen
VALUES_TOGETHER = (
    1 << 22
)  # of a gait run side by side, angles and velocities: some 500 MB with all that is made of them


WHOLE = {  # numbers of [numerics], from and to
    "directions": (2, 4096), "grid": (4, 4096), "interpolation": (1, 5), "phases": (8, 1_000_000),
    "harmonics": (1, 999), "curves": (4, 4096), "cycles": (1, 10_000), "pieces": (1, MOST_PIECES),
}  # fmt: skip


@dataclass(frozen=True)
class Numerics:
    """How finely to compute; all optional. loads: "exact", "midpoint:N", "gauss:N" (rft.loads). regularisation: body
    lengths per radian (rft.balance). tolerance: normalised residual. directions: of alphadot in the least-squares
    fit; if left out 8 for up to two joints, 16 a joint beyond. grid: points per joint, extent: rad on either side.
    interpolation: spline degree. phases: per cycle. harmonics: the highest kept (odd). curves: in a family's table.
    cycles: of a march (rft.march); if left out until they repeat, one where effects break symmetry. pieces: to a body
    length, 1 to 10,000, into which effects that vary along an element cut it (`rft.effects`)."""

    loads: str = "exact"
    regularisation: float = 1e-6
    tolerance: float = 1e-10
    directions: int | None = None
    grid: int = 31
    extent: float = 2.5
    interpolation: int = 3
    phases: int = 256
    harmonics: int = 15
    curves: int = 24
    cycles: int | None = None
    pieces: int = PIECES

    def __post_init__(self):
        parse(self.loads)
        check_ranges(self, regularisation=(1e-12, 1), tolerance=(1e-13, 1), extent=(1e-6, 100))
        for name, (low, high) in WHOLE.items():
            if name not in ("directions", "cycles") or getattr(self, name) is not None:
                in_range(name, getattr(self, name), low, high, whole=True)
        if self.harmonics % 2 == 0:
            raise ValueError(f"harmonics must be an odd number from 1 to 999, got {self.harmonics!r}")
        if self.interpolation >= self.grid:
            raise ValueError(f"interpolation must be from 1 to 5 and less than grid, got {self.interpolation!r}")


class Cycle(NamedTuple):
    """A gait run once, for amplitudes (...,). xi: (..., N, 3), body velocity by phase. net: (..., 3), pose after the cycle
    in the frame at its start. residual: (...), the largest of the cycle. speed: (...), mean |alphadot|, 1. work:
    `rft.Work`, (..., N) each, or None. cycles: how many a march took, 1 without one. to_come: (...), change of displacement
    still to come in a march that goes on until cycles repeat, body lengths or rad; 0 elsewhere."""

    xi: np.ndarray
    net: np.ndarray
    residual: np.ndarray
    speed: np.ndarray
    work: rft.Work | None
    cycles: int
    to_come: np.ndarray


@dataclass(frozen=True)
class Scene:
    """A medium, a body and a gait. text: the TOML it was read from, kept with every result."""

    medium: rft.Medium
    body: rft.Body
    gait: Gait
    numerics: Numerics = Numerics()
    effects: tuple[rft.effects.Effect, ...] = ()
    name: str = "scene"
    text: str = ""

    def __post_init__(self):
        self._check_types()
        if self.gait.joints != self.body.joints:
            kind = type(self.gait).__name__.lower()
            raise SceneError(
                f"{self.name}: [gait] {kind} moves {self.gait.joints} joints but [body] has {self.body.joints}: "
                "give the body one link more than the gait has joints, or another gait"
            )
        try:
            element_load(self.medium, self.numerics.loads)
        except ValueError as error:
            raise SceneError(f"{self.name}: [numerics] {error}") from None
        self._agree()
        kinds = [type(e) for e in self.effects]
        for effect in self.effects:
            if kinds.count(type(effect)) > 1:
                raise SceneError(f"{self.name}: [[effects]] {effect.kind} is asked for twice: keep one")
            try:
                effect.apply(Model.of(self.medium))
            except ValueError as error:
                raise SceneError(f"{self.name}: [[effects]] {error}: drop it, or change the medium") from None

    def _check_types(self) -> None:
        """SceneError if a part is nothing of its kind."""
        try:
            for name in ("name", "text"):
                if not isinstance(getattr(self, name), str):
                    raise ValueError(f"{name} must be text, got {short(getattr(self, name))}")
            if not isinstance(self.numerics, Numerics):
                raise ValueError(f"numerics must be Numerics(...), got {short(self.numerics)}")
            element_load(self.medium)
            checked_body(self.body)
            checked_gait(self.gait)
            rft.effects.broken(self.effects)
        except ValueError as error:
            raise SceneError(f"{self.name}: {error}") from None

    def _agree(self) -> None:
        """SceneError if effects, or the body, say different things of the same swimmer."""
        sized = self.body.length != 1.0
        for what, said in (("frequency", []), ("length", [("[body]", self.body.length)] if sized else [])):
            said += [(e.kind, getattr(e, what)) for e in self.effects if hasattr(e, what)]
            for name, value in said[1:]:
                if np.any(np.asarray(value) != said[0][1]):
                    raise SceneError(
                        f"{self.name}: {said[0][0]} gives {what} = {said[0][1]!r} and {name} {value!r}: it is one swimmer"
                    )

    def solve(self, alpha, alphadot) -> rft.Solution:
        """Body velocities with residual and status for alpha, alphadot (..., joints); see `rft.body_velocity`. SceneError
        if shape alone does not settle them."""
        self._refuse("body velocity from shape alone", SHAPE_ALONE, "run a whole gait by the direct tier")
        n = self.numerics
        return rft.body_velocity(
            self.medium, self.body, alpha, alphadot,
            loads=n.loads, regularisation=n.regularisation, tolerance=n.tolerance, effects=self.effects,
            pieces=n.pieces,
        )  # fmt: skip

    def work(self, alpha, alphadot, xi) -> rft.Work:
        """Power, internal moments and slip of a solution of `solve`; see `rft.work`."""
        n = self.numerics
        return rft.work(
            self.medium, self.body, alpha, alphadot, xi,
            loads=n.loads, regularisation=n.regularisation, effects=self.effects, pieces=n.pieces,
        )  # fmt: skip

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """xi (..., 3) in the body's frame; RuntimeError if any sample did not converge."""
        return self.solve(alpha, alphadot).checked().xi

    @property
    def engine(self) -> str:
        """Of `rft.effects.ENGINES`, the cheapest that is right for the scene's effects."""
        return rft.effects.engine(self.effects)

    def cycle(self, gait: Gait | None = None, amplitudes=None, phases: int | None = None, work: bool = False) -> Cycle:
        """A gait, or the scene's own, run by the scene's engine for amplitudes (...,), all at once; see `run`."""
        gait = checked_gait(self.gait if gait is None else gait)
        return self.run(*gait.cycle(phases or self.numerics.phases, amplitudes), work)

    def run(self, alpha, alphadot, work: bool = False) -> Cycle:
        """A gait given by alpha, alphadot (..., N, joints) at N equally spaced phases, run by the scene's engine.
        RuntimeError if a force balance did not converge or a march did not settle."""
        n = self.numerics
        speed = np.sqrt((alphadot**2).sum(-1)).mean(-1)
        if self.engine == "algebraic":
            samples = np.repeat(np.arange(speed.size), alpha.shape[-2])  # of every phase
            each = dataclasses.replace(self, effects=tuple(e.take(samples) for e in self.effects))
            solution = each.solve(alpha, alphadot).checked()
            done = each.work(alpha, alphadot, solution.xi) if work else None
            return Cycle(solution.xi, displacement(solution.xi), solution.residual.max(-1), speed, done, 1, 0.0 * speed)
        march = rft.march(
            self.medium, self.body, alpha, alphadot, effects=self.effects, cycles=n.cycles, with_work=work,
            loads=n.loads, regularisation=n.regularisation, tolerance=n.tolerance, pieces=n.pieces,
        ).checked()  # fmt: skip
        # Where cycles repeat the velocity is periodic, and its integral exact for the series through it.
        repeats = not rft.effects.broken(self.effects) & Premise.SE2_SYMMETRIC and (march.status == "settled").all()
        net = displacement(march.xi) if repeats else march.displacement
        to_come = march.drift if self.settles else 0.0 * speed
        return Cycle(march.xi, net, march.residual, speed, march.work, march.cycles, to_come)

    @property
    def settles(self) -> bool:
        """Whether its cycles are run until they repeat."""
        place_matters = rft.effects.broken(self.effects) & Premise.SE2_SYMMETRIC
        return self.engine != "algebraic" and self.numerics.cycles is None and not place_matters

    @property
    def pieces(self) -> int:
        """To a body length, that effects which vary along elements see: as asked for, or whole elements where these are
        shorter; 0 without such effects."""
        if not any(e.varies for e in self.effects):
            return 0
        return max(self.numerics.pieces, int(np.ceil(0.5 / halves(self.body).max() - 1e-9)))

    @property
    def elements(self) -> int:
        """Straight elements of the body, as its effects cut it."""
        body = pieced(self.body, self.effects, self.numerics.pieces)
        motion = body.motion(*np.zeros((2, body.joints, 1)))
        model = rft.effects.folded(self.effects, self.medium, body)
        return sum(len(m.half) for m in model.motions(motion).values())

    def at_once(self, phases: int) -> int:
        """Amplitudes of a gait that are run side by side, at least one: more would take more memory and no less time."""
        batched = [getattr(e, name) for e in self.effects for name in e.batched]
        if any(map(np.ndim, batched)):
            return sys.maxsize  # a parameter for each amplitude: they belong together
        # A march has some thirty arrays of elements beside what effects hold, where a gait has some ten of angles.
        marched = 0 if self.engine == "algebraic" else 4 * self.elements + sum(e.held for e in self.effects) // 8
        return max(1, VALUES_TOGETHER // max(phases * (self.body.joints + 6), marched))

    @property
    def linear(self) -> bool:
        """Whether xi = A alphadot holds exactly, so that path and direct tier are one."""
        return is_linear(self.medium) and not self.effects

    @property
    def three_link(self) -> bool:
        """Whether the body is the three-link swimmer, for which the published gaits were made."""
        return isinstance(self.body, rft.Chain) and self.body.joints == 2

    @property
    def unit(self) -> str:
        """Of lengths in this scene: body lengths, or metres where the body has a size."""
        return "BL" if self.body.length == 1.0 else "m"

    @property
    def methods(self) -> tuple[str, ...]:
        """The tiers of a plain study: area and harmonic take two joints, path no more than a grid can span."""
        if any(e.breaks for e in self.effects):
            return ("direct",)
        if self.body.joints == 2:
            return "area", "path", "harmonic", "direct"
        return ("path", "direct") if self.body.joints <= 3 else ("direct",)

    @property
    def lookups(self) -> tuple[str, ...]:
        """The tiers that look a precomputed table up; in a linear medium the path is the direct tier."""
        return tuple(m for m in self.tiers if m != "direct" and not (self.linear and m in ("path", "harmonic")))

    @property
    def tiers(self) -> tuple[str, ...]:
        """All of METHODS that this scene allows."""
        adapted = ("adapted",) if self.engine == "algebraic" else ()
        return tuple(m for m in METHODS if m in (*self.methods, *adapted))

    @property
    def direction_count(self) -> int:
        """Directions of alphadot in the least-squares fit."""
        joints = self.body.joints
        return self.numerics.directions or (8 if joints <= 2 else 16 * joints)

    @property
    def harmonic_directions(self) -> int:
        """Directions behind the harmonics: enough above the highest for folding to stay small."""
        return max(24, (8 * self.numerics.harmonics) // 5)

    def axes(self) -> tuple[np.ndarray, ...]:
        """Of the scene's field; SceneError if it has none, or one too large."""
        self.require_connection()
        n, joints = self.numerics, self.body.joints
        if n.grid**joints > LARGEST_GRID:
            raise SceneError(
                f"{self.name}: a field of {n.grid}^{joints} shapes is too large: lower [numerics] grid, or use "
                "methods = direct, which needs no field"
            )
        return conn.grid(joints, n.grid, n.extent)

    def connection(self, progress: Callable | None = None) -> conn.Connection:
        """The least-squares connection on the scene's grid."""
        degree, mirror = self.numerics.interpolation, self.medium.mirror
        return conn.fit(self.velocity, self.axes(), self.direction_count, degree, progress, mirror)

    @cached_property
    def fitted(self) -> conn.Connection:
        """`connection`, computed once."""
        return self.connection()

    def compute_field(self, progress: Callable | None = None) -> None:
        """Fill `fitted` now, telling ``progress`` the fraction done."""
        if "fitted" not in self.__dict__:
            self.__dict__["fitted"] = self.connection(progress)

    @cached_property
    def curvature(self) -> Field:
        """The CCF of `fitted`, for joints 1 and 2."""
        return ccf(self.fitted)

    @cached_property
    def curvature_error(self) -> Field:
        """The estimated error of `curvature`."""
        return ccf_error(self.fitted)

    @cached_property
    def harmonics(self) -> harm.Harmonics:
        """The odd harmonics of the velocity on the scene's grid, computed once."""
        n, mirror = self.numerics, self.medium.mirror
        count = self.harmonic_directions
        return harm.fit(self.velocity, self.axes(), count, n.interpolation, mirror=mirror, highest=n.harmonics)

    def family(self, gait: Gait, largest: float) -> fam.Family:
        """The connection adapted to the scaled copies of ``gait`` up to an amplitude; computed once for each."""
        kept = self.__dict__.setdefault("_families", {})
        if (gait, largest) not in kept:
            n = self.numerics
            kept[gait, largest] = fam.fit(self.velocity, gait, largest, n.curves, n.phases // 2)
        return kept[gait, largest]

    def displacement(self, method: str, gait: Gait | None = None, amplitudes=None) -> np.ndarray:
        """Net pose per cycle (..., 3) by one tier of METHODS for amplitudes (...,), of a gait or the scene's own."""
        gait, phases = self.gait if gait is None else checked_gait(gait), self.numerics.phases
        self._allow(method)
        if method == "area":
            return predict.area(self.curvature, gait, amplitudes, phases)
        if method == "adapted":
            a = np.asarray(gait.amplitude if amplitudes is None else amplitudes, float)
            if (a < 0).any():
                raise SceneError(f"{self.name}: the adapted tier takes amplitudes >= 0: use the direct tier below")
            return self.family(gait, float(a.max(initial=0.0))).area(a)
        if method == "path" and self.needs_field(method):
            return predict.path(self.fitted, gait, amplitudes, phases)
        if method == "harmonic" and not self.linear:
            return predict.path(self.harmonics.velocity, gait, amplitudes, phases)
        if self.engine != "algebraic":
            if amplitudes is None:
                return self.cycle(gait).net
            return predict.in_groups(lambda some: self.cycle(gait, some).net, amplitudes, self.at_once(phases))
        # In a linear medium xi = A alphadot holds exactly: path and harmonics need no field, and are the direct tier.
        return predict.direct(self.velocity, gait, amplitudes, phases)

    def require_connection(self) -> None:
        """SceneError naming the effect if one that is on breaks what a connection and its CCF rest on."""
        self._refuse("connection or CCF", ALL, "use the direct tier")

    def _refuse(self, what: str, premises: Premise, instead: str) -> None:
        for effect in self.effects:
            if effect.breaks & premises:
                raise SceneError(
                    f"{self.name}: no {what} with the effect {effect.kind}, which is "
                    f"{not_so(effect.breaks)}: {instead}, or drop the effect"
                )

    def _allow(self, method: str) -> None:
        """SceneError if this scene has no such tier."""
        choose("methods", method, METHODS)
        if method not in ("direct", "adapted"):
            self.require_connection()
        if method in ("area", "harmonic") and self.body.joints != 2:
            raise SceneError(f"{self.name}: the {method} tier takes a body of two joints: use path, adapted or direct")
        if method == "adapted":
            self._refuse("adapted tier", SHAPE_ALONE, "use the direct tier")

    def needs_field(self, method: str) -> bool:
        """Whether a tier looks the fitted connection up on the grid."""
        return method == "area" or (method == "path" and not self.linear)

    def study(
        self, amplitudes: Sequence[float], methods: Sequence[str], gait: Gait | None = None, progress=None
    ) -> dict:
        """{"amplitude": [...], method: [[x, y, theta], ...], ..., "estimate": {method: [...]}, "estimate_heading":
        {method: [...]}, "seconds": {...}}.

        estimate: error of each position, body lengths; estimate_heading: of each theta, rad (`geomech.study.estimate`). Fields
        are timed on their own.
        """
        gait, amplitudes = checked_gait(self.gait if gait is None else gait), real_array("amplitudes", amplitudes)
        if amplitudes.ndim != 1:
            raise SceneError(f"{self.name}: amplitudes must be a list of numbers, got {short(amplitudes)}")
        for method in methods:
            self._allow(method)
        out: dict = {"amplitude": amplitudes.tolist()}
        seconds, errors, reference = {}, {}, None
        if any(map(self.needs_field, methods)):
            seconds["field"] = _timed(lambda: self.compute_field(progress))[1]
        for method in sorted(methods, key=METHODS.index, reverse=True):  # direct first: the others are checked with it
            if method == "direct" or (self.linear and method not in ("area", "adapted")):
                (poses, errors[method]), seconds[method] = _timed(
                    lambda: estimate.direct(self, gait, amplitudes, self.numerics.phases)
                )
                reference = poses, errors[method]
            else:
                poses, seconds[method] = _timed(lambda m=method: self.displacement(m, gait, amplitudes))
                errors[method] = estimate.against_direct(self, poses, gait, amplitudes, reference)
            out[method] = poses.tolist()
        ordered = {m: out[m] for m in methods}
        estimates = {
            key: {m: errors[m][:, k].tolist() for m in methods}
            for k, key in enumerate(("estimate", "estimate_heading"))
        }
        return {"amplitude": out["amplitude"], **ordered, **estimates, "seconds": seconds}

    def cost(self, amplitudes: Sequence[float], methods: Sequence[str], gait: Gait | None = None) -> Cost:
        """What `study` would take: force balances, seconds on this machine and memory; see `geomech.study.cost`."""
        from geomech.study import cost

        return cost.price(cost.study(self, methods, len(amplitudes), gait))

    def with_numerics(self, **changes) -> Scene:
        """This scene with some of its [numerics] changed; None keeps a value."""
        changes = {k: v for k, v in changes.items() if v is not None}
        try:
            return dataclasses.replace(self, numerics=dataclasses.replace(self.numerics, **changes))
        except ValueError as error:
            raise SceneError(f"{self.name}: {error}") from None


def _timed(f: Callable):
    start = time.perf_counter()
    value = f()
    return value, time.perf_counter() - start
