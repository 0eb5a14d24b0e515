"""Time stepping through a gait, for what shape and its rate of change leave open: place, past and mass.

At every phase the balance of forces is solved for the body velocity. Each step is implicit: memory is taken at its end,
momentum by BDF2, the backward difference of order 2, which damps errors at any step. So without memory,
slope or mass the answer is that of `rft.body_velocity` at every phase, and with them it comes near as they go to zero.
All samples (amplitudes, parameters) go side by side. Time stepping starts from that answer on untouched ground and goes
round the gait until the displacement of a cycle is that of the cycle before.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft import in_turn
from rft.backend import check, settled_on
from rft.balance import checked_input
from rft.bodies.base import Body, Kinematics, halves, pace
from rft.bodies.pieces import PIECES
from rft.contact import Model
from rft.effects.base import Effect, Prepared, Site, broken, under_way
from rft.limit_cycle import Approach, HeavyApproach
from rft.media.base import Medium, in_range, require
from rft.newton import Balance
from rft.premise import Premise
from rft.work import Work, done_by

MOST_CYCLES = 60
MOST_KEPT = 100_000  # elements at all phases, whose motion is kept: some 8 MB
PAUSE = 1e-9  # of the usual joint speed, below which a phase is a pause and has no scale of its own


class TimeSteps(NamedTuple):
    """The last cycle of time stepping at N phases. xi: (..., N, 3), body frame, length/rad, length/rad, 1. pose: (...,
    N + 1, 3), on the ground, whose origin and x axis are the frame's at the first step. residual: (...), the largest,
    as in `rft.Solution`. status: (...), "periodic", "running" (as many cycles as were asked for, but not periodic),
    "not periodic" or "unconverged". drift: (...), how much displacement, body lengths, and heading, rad, will yet
    change in all cycles to come. cycles: how many. work: (..., N) each, None unless asked for. path: (..., cycles N + 1, 3),
    all poses since the first step, None unless asked for."""

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
) -> TimeSteps:
    """Body velocities through a gait given over one cycle: alpha, alphadot (..., N, joints), rad and per rad of phase, at
    N >= 8 equally spaced phases. Of order 2 in 1/N.

    cycles: exactly so many; if left out, as many as it takes to reach the limit cycle, and one where effects break
    symmetry (there no cycle is like another). Other arguments as in `rft.body_velocity`. ValueError for what makes no sense.
    """
    lost = broken(effects)
    cut, model, rows = Prepared.of(medium, body, effects, loads, pieces)
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
    problem = Balance(model, rows, regularisation, tolerance, backend)
    steps = _Steps(problem, cut, halves(body), *shapes, effects)
    found = _round_and_round(steps, phases, cycles, with_work, with_path)
    return _shaped(found, batch, body.length)


def _nothing(batch: tuple, phases: int) -> TimeSteps:
    """The steps of no samples."""
    none = np.zeros(batch)
    return TimeSteps(
        np.zeros((*batch, phases, 3)), np.zeros((*batch, phases + 1, 3)), none, none.astype(str), none, 0, None
    )


def _round_and_round(steps: _Steps, phases: int, cycles: int | None, with_work: bool, with_path: bool) -> TimeSteps:
    """Cycles until they repeat, or as many as asked for; samples on the last axis."""
    enough = max([1e-6, *(e.settles for e in steps.effects)])
    path = []
    approach = (HeavyApproach if steps.heavy else Approach)(steps.pose.shape[1])
    for done in itertools.count(1):
        start = steps.xi[-1] if steps.xi else None
        xi, pose, residual, work = steps.cycle(with_work)
        pose = np.stack([*pose, steps.foreseen()[1]])
        path += [pose[:-1]] if with_path else []
        moved = _between(pose[0], pose[-1])
        drift = approach.after(start, steps.xi[-1], moved)
        periodic = drift <= enough
        if done == (cycles or MOST_CYCLES) or (cycles is None and periodic.all()):
            break
        if cycles is None and steps.heavy:
            steps.kick(approach.kick(~periodic))
    worst = np.max(residual, 0)
    status = np.where(periodic, "periodic", "not periodic" if cycles is None else "running")
    status = np.where(worst <= steps.limit, status, "unconverged")
    whole = np.concatenate([*path, pose[-1:]]) if with_path else None
    return TimeSteps(xi, pose, worst, status, drift, done, Work(*work) if with_work else None, whole)


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


class _Steps:
    """The steps themselves: `next` takes one. All lengths in body lengths, samples on the last axis. whole: (n,), half
    lengths of the body's elements, of which ``body`` may be pieces."""

    def __init__(self, problem: Balance, body: Body, whole: np.ndarray, alpha, alphadot, effects):
        self.balance, self.body, self.whole, self.alpha, self.alphadot = problem, body, whole, alpha, alphadot
        self.model, self.effects, self.processes = problem.model, effects, under_way(effects)
        self.phases, samples = len(alpha), alpha.shape[-1]
        self.dt = 2 * np.pi / self.phases
        self.heavy = bool(broken(effects) & Premise.QUASI_STATIC)
        speed = np.stack([pace(body, rates) for rates in alphadot])
        usual = np.sqrt((speed**2).mean(0))
        usual = np.where(usual > 0, usual, 1.0)
        self.scales = np.where(speed > PAUSE * usual, speed, usual)
        if self.heavy:  # a heavy body moves while its joints pause
            self.scales = np.broadcast_to(usual, speed.shape)
        self.step, self.pose, self.xi = 0, np.zeros((3, samples)), []
        self.v, self.states, self.site, self.limit, self.kept = {}, [], None, 0.0, []

    def foreseen(self):
        """(velocity, pose) at the step to come, the velocity by straight extrapolation."""
        if len(self.xi) < 2:
            xi = self.xi[-1] if self.xi else np.zeros_like(self.pose)
        else:
            xi = 2 * self.xi[-1] - self.xi[-2]
        before = self.xi[-1] if self.xi else xi
        return xi, _moved(self.pose, (before + xi) / 2, self.dt if self.xi else 0.0)

    def motions(self, k: int) -> dict[str, Kinematics]:
        """Of every contact's elements at a phase. Those of all phases and cycles are computed at once where they are few."""
        samples = self.alpha.shape[-1]
        if self.balance.rows[-1].stop * self.phases * samples > MOST_KEPT:
            return self.model.motions(self.body.motion(self.alpha[k], self.alphadot[k]))
        if not self.kept:
            all_phases = (np.concatenate(list(x), -1) for x in (self.alpha, self.alphadot))
            whole = self.body.motion(*all_phases)
            phases = (slice(i * samples, (i + 1) * samples) for i in range(self.phases))
            self.kept = [self.model.motions(whole.take(phase)) for phase in phases]
        return self.kept[k]

    def cycle(self, with_work: bool) -> list:
        """Take all steps of a cycle: [xi (N, 3, B), pose (N, 3, B), residual (N, B), work, a tuple of such arrays, empty
        unless asked for]."""
        sure, pieces, left = self.balance.backend != "auto" or bool(settled_on()), [], self.phases
        while left:
            some, start = lambda: (self._some(left, with_work), self.numbers()), lambda: (left, self.numbers())
            found, numbers = in_turn.known("steps", some, start, sure)
            self.go_on(numbers)
            pieces, left = [*pieces, found], left - len(found[0])
        *plain, work = zip(*pieces)
        return [*map(np.concatenate, plain), tuple(map(np.concatenate, zip(*work)))]

    def _some(self, most: int, with_work: bool) -> tuple:
        """As `cycle`, of a piece of it."""
        *plain, work = zip(*in_turn.piece(lambda: self.next(with_work), most))
        return *map(np.stack, plain), tuple(map(np.stack, zip(*work))) if with_work else ()

    def numbers(self) -> tuple:
        """All that steps to come follow from."""
        states = tuple(p.numbers(state) for p, state in zip(self.processes, self.states))
        site = (self.site.pose, *self.site.before.values()) if self.site else ()
        return self.step, float(self.limit), self.pose, tuple(self.xi), tuple(self.v.values()), states, site

    def go_on(self, numbers: tuple) -> None:
        """From where `numbers` were."""
        self.step, self.limit, self.pose, xi, v, states, (pose, *before) = numbers
        motions, dt = self.motions((self.step - 1) % self.phases), 0.0 if self.step == 1 else self.dt
        self.xi, self.v = list(xi), dict(zip(motions, v))
        self.states = [p.state(x) for p, x in zip(self.processes, states)]
        self.site = Site(dt, pose, motions, dict(zip(motions, before)))

    def next(self, with_work: bool):
        """Take a step: (xi, pose, residual, work) at it."""
        k, first = self.step % self.phases, not self.xi
        guess, pose = self.foreseen()
        motions = self.motions(k)
        if first:
            self.v = {name: np.zeros_like(m.v) for name, m in motions.items()}
        site = Site(0.0 if first else self.dt, pose, motions, self.v)
        if first:
            self.states = [p.begin(site) for p in self.processes]
        model = self._model(site)
        whole = Kinematics.stacked(list(motions.values()))
        solved = self.balance.solve(
            lambda index: whole if index.size == len(self.scales[k]) else whole.take(index),
            self.scales[k],
            1,
            guess=None if first else guess,
            model=model,
        )
        self.limit = max(self.limit, self.balance.limit)
        xi = solved.xi
        if not first:
            self.pose = _moved(self.pose, (self.xi[-1] + xi) / 2, self.dt)
        v = {name: m.v + m.carried(xi) for name, m in motions.items()}
        self.states = [p.after(state, site, v) for p, state in zip(self.processes, self.states)]
        self.xi, self.v, self.site, self.step = [*self.xi[-1:], xi], v, site, self.step + 1
        eps = self.balance.regularisation * self.scales[k]
        work = done_by(model, self.whole, motions, xi, eps) if with_work else None
        return xi, self.pose, solved.residual, work

    def _model(self, site: Site) -> Model:
        """What holds at one step; at the first nothing has passed yet, and mass does not act."""
        model, past = self.model, Premise.MEMORYLESS | Premise.QUASI_STATIC
        for process, state in zip(self.processes, self.states):
            if site.dt > 0 or not process.breaks & past:
                model = process.at(state, site).apply(model)
        return model

    def kick(self, change: np.ndarray) -> None:
        """Go on as if the body had been moving faster by so much, (3, B), for the last steps; the ground does not notice."""
        motions = self.site.motions
        v = {name: old + motions[name].carried(change) for name, old in self.v.items()}
        drag = (self._drag(v) - self._drag(self.v)) / self.model.unit
        self.states = [p.kicked(s, self.site, change, drag) for p, s in zip(self.processes, self.states)]
        self.xi, self.v = [x + change for x in self.xi], v

    def _drag(self, v: dict[str, np.ndarray]) -> np.ndarray:
        """(3, B): on the frame, of untouched ground at velocities of all contacts' elements at the last step."""
        eps = self.balance.regularisation * self.scales[(self.step - 1) % self.phases]
        load = self.model.load(np.concatenate(list(v.values()), 1), self.balance.rows, eps)
        return Kinematics.stacked(list(self.site.motions.values())).wrench(load[:, 0])
