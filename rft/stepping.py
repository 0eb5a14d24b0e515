"""Time stepping through a gait, for what shape and its rate of change leave open: place, past and mass.

At every phase the balance of forces is solved for the body velocity. Each step is implicit: memory is taken at its end,
momentum by BDF2, the backward difference of order 2, which damps errors at any step. So without memory,
slope or mass the answer is that of `rft.body_velocity` at every phase, and with them it comes near as they go to zero.
All samples (amplitudes, parameters) go side by side. Time stepping starts from that answer on untouched ground and goes
round the gait until the displacement of a cycle is that of the cycle before.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rft import limit_cycle
from rft.balance import checked_input
from rft.balance.arrays import moved, net_of, velocities
from rft.balance.backend import check
from rft.balance.newton import carried
from rft.balance.solver import Accuracy, Solved, solve
from rft.bodies.base import Body, half_lengths, joint_speed
from rft.bodies.pieces import PIECES
from rft.checks import in_range, require
from rft.contact import Assembly, Problem, assemble
from rft.effects.base import PAST, Effect, Site, broken_premises, stepwise_effects
from rft.laws.base import Medium
from rft.premise import Premise
from rft.work import Work, done_by

MOST_CYCLES = 60
MOST_KEPT = 100_000  # elements at all phases, whose balances are assembled once: some 8 MB
PAUSE = 1e-9  # of the usual joint speed, below which a phase is a pause and has no scale of its own


class TimeSteps(NamedTuple):
    """The last cycle of time stepping at N phases. xi: (..., N, 3), body frame, length/rad, length/rad, 1. pose: (...,
    N + 1, 3), on the ground, whose origin and x axis are the frame's at the first step. residual: (...), the largest,
    as in `rft.Solution`. status: (...), "periodic", "running" (as many cycles as were asked for, but not periodic),
    "not periodic" or "unconverged". drift: (...), how much displacement, body lengths, and heading, rad, will yet
    change in all cycles to come. cycles: how many. work: (..., N) each, None unless asked for. path: (..., cycles N +
    1, 3), all poses since the first step, None unless asked for."""

    xi: np.ndarray
    pose: np.ndarray
    residual: np.ndarray
    status: np.ndarray
    drift: np.ndarray
    cycles: int
    work: Work | None
    path: np.ndarray | None = None

    def __repr__(self) -> str:
        kinds = ", ".join(f"{n} {kind}" for kind, n in zip(*np.unique(self.status, return_counts=True)))
        count = np.size(self.status)
        size = f"{count} gait{'s' * (count != 1)} of {np.shape(self.xi)[-2]} phases, {self.cycles} cycles: {kinds}"
        return f"TimeSteps({size}; residual up to {np.max(self.residual, initial=0.0):.1e})"

    @property
    def displacement(self) -> np.ndarray:
        """(..., 3): pose after the cycle in the frame at its start."""
        return np.moveaxis(_between(*(np.moveaxis(self.pose[..., k, :], -1, 0) for k in (0, -1))), 0, -1)

    def checked(self) -> TimeSteps:
        """These steps, or RuntimeError if any sample is unconverged or not periodic."""
        if (self.status == "unconverged").any():
            raise RuntimeError(
                f"a force balance did not converge in time stepping (residual {np.max(self.residual):.1e}): "
                "raise 'regularisation', or report the scene"
            )
        if (self.status == "not periodic").any():
            raise RuntimeError(
                f"after {self.cycles} cycles displacement is still {np.max(self.drift):.1e} body lengths from its limit: "
                "give 'cycles' to take it as it is, or lower the mass or the ground's weakening"
            )
        return self


def time_steps(
    medium: Medium,
    body: Body,
    alpha,
    alphadot,
    *,
    effects: Sequence[Effect] = (),
    cycles: int | None = None,
    loads: str = "exact",
    regularisation: float = 1e-6,
    tolerance: float = 1e-10,
    pieces: int = PIECES,
    with_work: bool = False,
    with_path: bool = False,
    backend: str = "auto",
    advance: Callable | None = None,
) -> TimeSteps:
    """Body velocities through a gait given over one cycle: alpha, alphadot (..., N, joints), rad and per rad of phase,
    at N >= 8 equally spaced phases. Of order 2 in 1/N.

    cycles: exactly so many; if left out, as many as it takes to reach the limit cycle, and one where effects break
    symmetry (there no cycle is like another). advance: takes the steps of a cycle, by default `advanced`; another one
    may store states in between, and resume from them. Other arguments as in `rft.body_velocity`. ValueError for what
    makes no sense."""
    lost = broken_premises(effects)
    assembly = assemble(medium, body, effects, loads, pieces)
    alpha, alphadot = checked_input(body, alpha, alphadot, regularisation, tolerance)
    check(backend)
    require(alpha.ndim >= 2 and alpha.shape[-2] >= 8, f"time stepping takes 8 phases or more, got alpha {alpha.shape}")
    if cycles is not None:
        in_range("cycles", cycles, 1, 10_000, whole=True)
    batch, (phases, joints) = alpha.shape[:-2], alpha.shape[-2:]
    if 0 in batch:
        return _nothing(batch, phases)
    if cycles is None and lost & Premise.SE2_SYMMETRIC:
        cycles = 1
    shapes = (np.moveaxis(x.reshape(-1, phases, joints), 0, -1) for x in (alpha, alphadot))  # (N, joints, B)
    stepping = Stepping(
        assembly, *shapes, Accuracy(regularisation, tolerance), backend, cycles is None, half_lengths(body)
    )
    found = _cycles(stepping, cycles, with_work, with_path, advance or advanced)
    return _shaped(found, batch, body.length)


def _nothing(batch: tuple, phases: int) -> TimeSteps:
    """The steps of no samples."""
    none = np.zeros(batch)
    return TimeSteps(
        np.zeros((*batch, phases, 3)), np.zeros((*batch, phases + 1, 3)), none, none.astype(str), none, 0, None
    )


def advanced(stepping: Stepping, state: State, count: int, with_work: bool = False) -> tuple[State, list[Row]]:
    """Return the state after so many steps, and their rows."""
    rows = []
    for _ in range(count):
        state, row = stepping.step(state, with_work)
        rows.append(row)
    return state, rows


def _cycles(stepping: Stepping, cycles: int | None, with_work: bool, with_path: bool, advance: Callable) -> TimeSteps:
    """Return the last of the cycles until they repeat, or of as many as asked for; samples on the last axis."""
    path, state = [], stepping.begin()
    for done in itertools.count(1):
        state, rows = advance(stepping, state, stepping.phases, with_work)
        pose = np.stack([*(row.pose for row in rows), stepping.site(state).pose])
        path += [pose[:-1]] if with_path else []
        if done == (cycles or MOST_CYCLES) or (cycles is None and stepping.is_periodic(state)):
            break
    xi, residual, limit = (np.stack([x[i] for x in rows]) for i in (0, 2, 3))
    work = Work(*map(np.stack, zip(*(row.work for row in rows)))) if with_work else None
    worst, drift = np.max(residual, 0), state.cycles.drift
    status = np.where(drift <= stepping.enough, "periodic", "not periodic" if cycles is None else "running")
    status = np.where(worst <= limit.max(), status, "unconverged")
    whole = np.concatenate([*path, pose[-1:]]) if with_path else None
    return TimeSteps(xi, pose, worst, status, drift, done, work, whole)


def _between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pose b (3, B) seen from pose a."""
    z = ((b[0] - a[0]) + 1j * (b[1] - a[1])) * np.exp(-1j * a[2])
    return np.stack([z.real, z.imag, b[2] - a[2]])


def _moved(pose: np.ndarray, xi: np.ndarray, dt: float) -> np.ndarray:
    """Pose (3, B) after moving with xi (3, B) for dt."""
    half = 0.5 * dt * xi[2]
    z = dt * np.sinc(half / np.pi) * np.exp(1j * (pose[2] + half)) * (xi[0] + 1j * xi[1])
    return pose + np.array([z.real, z.imag, dt * xi[2]])


def _shaped(found: TimeSteps, batch: tuple, length: float) -> TimeSteps:
    """Samples to the leading axes, body lengths to the body's unit."""
    units = np.array([length, length, 1.0])
    samples_first = lambda x: np.moveaxis(x, -1, 0).reshape(*batch, -1, 3) * units
    xi, pose = map(samples_first, found[:2])
    path = None if found.path is None else samples_first(found.path)
    work = found.work
    if work is not None:  # (N, B, ...)
        power, moment, slip = (np.moveaxis(x, 1, 0).reshape((*batch, len(x), *x.shape[2:])) for x in work)
        work = Work(power * length, moment, slip)
    residual, status, drift = (x.reshape(batch) for x in found[2:5])
    return TimeSteps(xi, pose, residual, status, drift, found.cycles, work, path)


class State(NamedTuple):
    """All that the steps to come follow from: arrays, samples on the last axis.

    count: (1, 1), steps so far. pose: (3, B), of the frame on the ground. xi, earlier: (3, B), velocities at the last
    step and the one before. v: (v_t, v_n, v_w) of the body's elements at the last step, (n, B) each. pasts: what
    effects remember. cycles: how far the limit cycle is (`rft.limit_cycle`)."""

    count: np.ndarray
    pose: np.ndarray
    xi: np.ndarray
    earlier: np.ndarray
    v: tuple
    pasts: tuple
    cycles: Any


class Row(NamedTuple):
    """One step. xi, pose: (3, B). residual: (B,). limit: (1,), of residuals that are solved. work: None unless asked
    for."""

    xi: np.ndarray
    pose: np.ndarray
    residual: np.ndarray
    limit: np.ndarray
    work: Work | None


class Stepping:
    """The steps of gaits: `begin` gives the state before the first one, `step` the state after the next one.

    alpha, alphadot: (N, joints, B). to_limit: whether cycles are to repeat; then a heavy body is led to its limit
    cycle. whole: (n,), half lengths of the body's own elements, of which those of the assembly may be pieces."""

    def __init__(self, assembly: Assembly, alpha, alphadot, accuracy: Accuracy, backend: str, to_limit: bool, whole):
        self.effects = stepwise_effects(assembly.effects)
        self.assembly = assembly._replace(effects=tuple(e for e in assembly.effects if e not in self.effects))
        self.alpha, self.alphadot, self.accuracy, self.backend = alpha, alphadot, accuracy, backend
        self.to_limit, self.whole, self.phases = to_limit, whole, len(alpha)
        self.dt = 2 * np.pi / self.phases
        self.heavy = bool(broken_premises(self.effects) & Premise.QUASI_STATIC)
        self.enough = max([1e-6, *(e.drift_tolerance for e in assembly.effects)])

    @cached_property
    def scales(self) -> np.ndarray:
        """Sizes of velocities at all phases, (N, B)."""
        speed = np.stack([joint_speed(self.assembly.body, rates) for rates in self.alphadot])
        usual = np.sqrt((speed**2).mean(0))
        usual = np.where(usual > 0, usual, 1.0)
        if self.heavy:  # a heavy body moves while its joints pause
            return np.broadcast_to(usual, speed.shape)
        return np.where(speed > PAUSE * usual, speed, usual)

    @cached_property
    def _few(self) -> list[Problem]:
        return [self._assembled(k) for k in range(self.phases)]

    def _assembled(self, k: int) -> Problem:
        return self.assembly.rescaled(self.assembly.at(self.alpha[k], self.alphadot[k]), self.scales[k])

    def problem(self, k: int) -> Problem:
        """Return the balance at a phase, without what depends on the past or the place."""
        few = self.assembly.points * self.phases * self.alpha.shape[-1] <= MOST_KEPT
        return self._few[k] if few else self._assembled(k)

    def guess(self, s: State) -> np.ndarray:
        """Return the velocity (3, B) at the next step, by straight extrapolation."""
        return 2 * s.xi - s.earlier if s.count[0, 0] > 1 else s.xi

    def site(self, s: State) -> Site:
        """Return when and where the next step takes place, as foreseen."""
        count = int(s.count[0, 0])
        dt = self.dt if count else 0.0
        return Site(count, dt, _moved(s.pose, (s.xi + self.guess(s)) / 2, dt), s.v)

    def begin(self) -> State:
        """Return the state before the first step: untouched ground, no velocity yet."""
        problem, zero = self.problem(0), np.zeros((3, self.alpha.shape[-1]))
        v = (np.zeros_like(problem.sides.elements.c),) * 3
        pasts = tuple(e.begin(problem, Site(0, 0.0, zero, v)) for e in self.effects)
        return State(np.zeros((1, 1), int), zero, zero, zero, v, pasts, limit_cycle.begin(zero.shape[-1]))

    def step(self, s: State, with_work: bool = False) -> tuple[State, Row]:
        """Return the state after the next step, and its row."""
        site, first = self.site(s), s.count[0, 0] == 0
        k = site.count % self.phases
        bare = problem = self.problem(k)
        for effect, past in zip(self.effects, s.pasts):
            if not first or not effect.breaks & PAST:  # at the first step nothing has passed yet, and mass does not act
                problem = effect.apply(problem, site, past)
        solved = self._solved(problem, self.scales[k], None if first else self.guess(s))
        xi = solved.xi
        pose = s.pose if first else _moved(s.pose, (s.xi + xi) / 2, self.dt)
        v = _velocities(problem, xi)
        pasts = tuple(e.after(problem, site, past, v) for e, past in zip(self.effects, s.pasts))
        rounding = self.accuracy.rounding * self.scales[k]
        work = done_by(problem, self.whole, xi, rounding) if with_work else None
        after = State(s.count + 1, pose, xi, s.xi, v, pasts, s.cycles)
        if k == 0:
            after = after._replace(cycles=s.cycles._replace(pose=pose, start=s.xi + np.where(first, np.nan, 0.0)))
        if k == self.phases - 1:
            after = self._cycle_ended(after, bare, site)
        return after, Row(xi, pose, solved.residual, np.array([solved.limit]), work)

    def _solved(self, problem: Problem, scale: np.ndarray, guess: np.ndarray | None) -> Solved:
        of = lambda index: problem if index.size == scale.size else problem.take(index)
        return solve(of, scale, self.accuracy, problem.law, self.assembly.points, self.backend, 1, guess)

    def _cycle_ended(self, s: State, problem: Problem, site: Site) -> State:
        """Return the state with what a cycle that has ended says of the limit."""
        displacement = _between(s.cycles.pose, self.site(s).pose)
        if not self.heavy:
            return s._replace(cycles=limit_cycle.light(s.cycles, displacement))
        s = s._replace(cycles=limit_cycle.heavy(s.cycles, displacement, s.xi, self.enough))
        return self.with_velocity_change(s, problem, site) if self.to_limit and not self.is_periodic(s) else s

    def is_periodic(self, s: State) -> bool:
        """Return whether the cycles of all samples repeat."""
        return bool((s.cycles.drift <= self.enough).all())

    def with_velocity_change(self, s: State, problem: Problem, site: Site) -> State:
        """Return the state as if the body had moved faster for the last steps, so that it comes to the limit cycle
        sooner."""
        change = s.cycles.kick
        v = tuple(a + b for a, b in zip(s.v, carried(problem.sides.elements, *change)))
        drag = (self._drag(problem, s.xi + change) - self._drag(problem, s.xi)) / problem.unit
        pasts = tuple(
            e.with_velocity_change(problem, site, past, change, drag) for e, past in zip(self.effects, s.pasts)
        )
        return s._replace(xi=s.xi + change, earlier=s.earlier + change, v=v, pasts=pasts)

    def _drag(self, problem: Problem, xi: np.ndarray) -> np.ndarray:
        """Return force and moment of untouched ground on the frame at a velocity, (3, B)."""
        scaled = xi / problem.frame.speed
        v = moved(problem, velocities(problem), *scaled)
        return np.stack(net_of(problem, v, np.full(xi.shape[1], self.accuracy.rounding), *scaled).force)


def _velocities(problem: Problem, xi: np.ndarray) -> tuple:
    """Return the velocities (v_t, v_n, v_w) of the body's elements, (n, B) each, at a body velocity xi (3, B)."""
    e = problem.sides.elements
    return tuple(a + b for a, b in zip((e.v_t, e.v_n, e.v_w), carried(e, *xi)))
