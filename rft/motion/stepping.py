"""One step of time through a gait: the state of a body between steps, and the balance
of forces at the next one.

At every phase the balance of forces is solved for the body velocity. Steps are
implicit: memory is that at the end of the step, momentum follows BDF2, the backward
difference of order 2, which damps errors at any step. All samples (amplitudes,
parameters) take each step together."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from rft.balance import arrays
from rft.balance.arrays import frame_net, velocities, with_frame_velocity
from rft.balance.backend import solves_compiled, updates_compiled
from rft.balance.solver import (
    ELEMENTS_TOGETHER,
    Accuracy,
    Solutions,
    compiled_driver,
    from_guess,
    solve,
)
from rft.bodies.base import Elements, joint_speed
from rft.core.premise import Premise
from rft.effects.base import PAST, Effect, Site, broken_premises, stepwise_effects
from rft.effects.contact import Assembly, Problem
from rft.effects.slope import Slope
from rft.formulas.link import TINY
from rft.formulas.newton import to_element
from rft.motion import limit_cycle
from rft.motion.work import Work, element_work

# elements x nodes at all phases, up to which their balances are stored: some 8 MB
MOST_STORED = 100_000
# of the joint speed, beyond which a body without a balance is sliding away
RUNAWAY = 1e3
# of the rms joint speed, below which the joints pause and that speed is the scale
PAUSE = 1e-9


class State(NamedTuple):
    """State of time stepping between two steps: arrays, samples on the last axis.

    count: (1, 1), number of steps so far. pose: (3, B), of the frame on the ground. xi,
    xi_before: (3, B), velocities at the last step and at the previous one. v:
    (v_t, v_n, v_w) of the body's elements at the last step, (n, B) each. effect_states:
    of the effects that depend on the past. cycles: the record of
    `rft.motion.limit_cycle`."""

    count: np.ndarray
    pose: np.ndarray
    xi: np.ndarray
    xi_before: np.ndarray
    v: tuple
    effect_states: tuple
    cycles: Any


class Row(NamedTuple):
    """Results of one step. xi, pose: (3, B). residual: (B,). limit: (1,), largest
    residual of a solved sample. work: of the step, or None. springs: what joints do
    that give way (`rft.motion.compliance.SpringMotion`), or None."""

    xi: np.ndarray
    pose: np.ndarray
    residual: np.ndarray
    limit: np.ndarray
    work: Work | None
    springs: Any = None


class Stepping:
    """Steps through gaits: `begin` returns the state before the first step, `step` the
    state after the next one.

    alpha, alphadot: (N, joints, B). to_limit: whether to extrapolate a heavy body to
    its limit cycle. body_halves: (n,), half lengths of the body's elements before these
    were cut into pieces."""

    def __init__(
        self,
        assembly: Assembly,
        alpha,
        alphadot,
        accuracy: Accuracy,
        backend: str,
        to_limit: bool,
        body_halves,
    ):
        self.effects = stepwise_effects(assembly.effects)
        self.assembly = assembly._replace(
            effects=tuple(e for e in assembly.effects if e not in self.effects)
        )
        self.alpha = alpha
        self.alphadot = alphadot
        self.accuracy = accuracy
        self.backend = backend
        size = assembly.n_law_points * alpha.shape[0] * alpha.shape[-1]
        self._stores_problems = size <= MOST_STORED
        self._is_small = assembly.n_law_points * alpha.shape[-1] <= ELEMENTS_TOGETHER
        self._known: dict[int, Any] = {}  # what the compiled driver knows by phase
        self.is_compiled = solves_compiled(backend, assembly.law)
        self.to_limit = to_limit
        self.body_halves = body_halves
        self.phases = len(alpha)
        self.dt = 2 * np.pi / self.phases
        self.heavy = bool(broken_premises(self.effects) & Premise.QUASI_STATIC)
        # Memory and mass have no effect at the first step.
        self.first_effects = [not effect.breaks & PAST for effect in self.effects]
        self.reads_place = any(effect.reads_place for effect in self.effects)
        # Only a weight along the ground moves a body that no drag can hold.
        self.is_pulled = any(isinstance(effect, Slope) for effect in self.effects)
        self.compiled_updates = [
            updates_compiled(backend, effect, assembly.law) for effect in self.effects
        ]
        self.drift_tolerance = max(
            [1e-6, *(e.drift_tolerance for e in assembly.effects)]
        )

    @cached_property
    def scales(self) -> np.ndarray:
        """Scales of speed at all phases, (N, B)."""
        rates = _phase_after_phase(self.alphadot)
        speed = joint_speed(self.assembly.body, rates).reshape(self.phases, -1)
        rms = np.sqrt((speed**2).mean(0))
        rms = np.where(rms > 0, rms, 1.0)
        if self.heavy:  # a heavy body moves while its joints pause
            return np.broadcast_to(rms, speed.shape)
        return np.where(speed > PAUSE * rms, speed, rms)

    @cached_property
    def _stored_problems(self) -> list[Problem]:
        # As one batch, for many small ones take longer.
        samples = np.arange(self.alpha.shape[-1])
        assembly = self.assembly.take(np.tile(samples, self.phases))
        problem = assembly.problem(
            _phase_after_phase(self.alpha),
            _phase_after_phase(self.alphadot),
            self.scales.ravel(),
        )
        return problem.split(self.phases)

    def problem(self, k: int) -> Problem:
        """Return the balance at the phase 2 pi k / N, without effects that depend on
        the past or the place."""
        if self._stores_problems:
            return self._stored_problems[k]
        return self.assembly.problem(self.alpha[k], self.alphadot[k], self.scales[k])

    def guess(self, s: State) -> np.ndarray:
        """Return a guess of the velocity (3, B) at the next step, by linear
        extrapolation."""
        if s.count[0, 0] > 1:
            return 2 * s.xi - s.xi_before
        return s.xi

    def site(self, s: State, guess: np.ndarray) -> Site:
        """Return the site of the next step, predicted by a guess of its velocity."""
        count = int(s.count[0, 0])
        dt = self.dt if count else 0.0
        pose = s.pose
        if self.reads_place:
            pose = integrated_pose(pose, (s.xi + guess) / 2, dt)
        return Site(count, dt, pose, s.v)

    def next_pose(self, s: State) -> np.ndarray:
        """Return the predicted pose (3, B) at the next step."""
        return integrated_pose(s.pose, (s.xi + self.guess(s)) / 2, self.dt)

    def begin(self) -> State:
        """Return the state before the first step, on undisturbed ground."""
        problem = self.problem(0)
        zero = np.zeros((3, self.alpha.shape[-1]))
        v = (np.zeros_like(problem.sides.elements.c),) * 3
        states = tuple(e.begin(problem, Site(0, 0.0, zero, v)) for e in self.effects)
        return State(
            count=np.zeros((1, 1), int),
            pose=zero,
            xi=zero,
            xi_before=zero,
            v=v,
            effect_states=states,
            cycles=limit_cycle.begin(zero.shape[-1]),
        )

    def step(self, s: State, with_work: bool = False) -> tuple[State, Row]:
        """Return the state after the next step, and its row."""
        guess = self.guess(s)
        site = self.site(s, guess)
        first = site.count == 0
        k = site.count % self.phases
        undisturbed = self.problem(k)
        problem = undisturbed
        for effect, state, acts in zip(
            self.effects, s.effect_states, self.first_effects
        ):
            if acts or not first:
                problem = effect.apply(problem, site, state)

        if first:
            guess = None
        xi, residual, limit = self._solved(k, problem, guess, self._is_lost(s))
        pose = s.pose
        if not first:
            pose = integrated_pose(pose, (s.xi + xi) / 2, self.dt)
        v = self._velocities(problem.sides.elements, xi)
        states = tuple(
            self._state_after(e, is_compiled, problem, site, state, v)
            for e, is_compiled, state in zip(
                self.effects, self.compiled_updates, s.effect_states
            )
        )
        work = None
        if with_work:
            rounding = self.accuracy.rounding * self.scales[k]
            work = element_work(problem, self.body_halves, xi, rounding)

        cycles = s.cycles
        if k == 0:
            start = s.xi + np.where(first, np.nan, 0.0)
            cycles = cycles._replace(pose=pose, start=start)
        after = State(s.count + 1, pose, xi, s.xi, v, states, cycles)
        if k == self.phases - 1:
            after = self._after_cycle(after, undisturbed, site)
        return after, Row(xi, pose, residual, np.array([limit]), work)

    def _is_lost(self, s: State) -> np.ndarray:
        """Return whether samples (B,) had no balance at the last step and slid away: no
        time is spent on further steps of theirs."""
        if not self.is_pulled:
            return np.zeros(s.xi.shape[1], bool)
        k = (int(s.count[0, 0]) - 1) % self.phases
        return runs_away(s.xi, self.scales[k])

    def _solved(
        self, k: int, problem: Problem, guess: np.ndarray | None, lost: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return body velocities, residuals and the largest residual of a solution, of
        a balance at the phase 2 pi k / N."""
        scale = self.scales[k]
        if guess is None or not self._is_small:
            found = self._solve_all(problem, scale, np.arange(scale.size), guess)
            return found.xi, found.residual, found.limit
        xi, residual, limit = from_guess(
            problem, scale, self.accuracy, self.assembly, guess, self._solve_once(k)
        )
        rest = np.flatnonzero(~(residual <= limit) & ~lost)
        if rest.size:
            found = self._solve_all(problem, scale, rest)
            xi[:, rest] = found.xi
            residual[rest] = found.residual
            limit = max(limit, found.limit)
        return xi, residual, limit

    def _solve_all(
        self,
        problem: Problem,
        scale: np.ndarray,
        samples: np.ndarray,
        guess: np.ndarray | None = None,
    ) -> Solutions:
        """Return the solutions of some samples of a problem."""

        def problem_at(index):
            if index.size == scale.size:
                return problem
            return problem.take(samples[index])

        return solve(
            problem_at,
            scale[samples],
            self.accuracy,
            self.assembly,
            self.backend,
            1,
            guess,
        )

    def _solve_once(self, k: int) -> Callable:
        """Return the solver of one descent for balances at the phase 2 pi k / N."""
        if not self.is_compiled:
            return arrays.solve
        driver = compiled_driver()
        if not self._stores_problems:
            return driver.solve
        if k not in self._known:
            self._known[k] = driver.known_arguments(self._stored_problems[k])
        return partial(driver.solve, known=self._known[k])

    def _velocities(self, e: Elements, xi: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the velocities (v_t, v_n, v_w) of elements, (n, B) each, at a body
        velocity xi (3, B)."""
        if self.is_compiled:
            return compiled_driver().element_velocities(e, xi)
        return tuple(a + b for a, b in zip((e.v_t, e.v_n, e.v_w), to_element(e, *xi)))

    def _state_after(
        self,
        effect: Effect,
        is_compiled: bool,
        problem: Problem,
        site: Site,
        state: Any,
        v: tuple,
    ) -> Any:
        """Return `Effect.after`, by compiled code where that is asked for."""
        if not is_compiled:
            return effect.after(problem, site, state, v)
        arguments = effect.element_arguments(problem, site, state)
        return compiled_driver().element_update(
            effect.element_update, (*arguments, *v), state.shape
        )

    def _after_cycle(self, s: State, problem: Problem, site: Site) -> State:
        """Return the state at the end of a cycle with a new record of cycles,
        extrapolated if cycles are to repeat."""
        displacement = relative_pose(s.cycles.pose, self.next_pose(s))
        if not self.heavy:
            cycles = limit_cycle.after_massless_cycle(s.cycles, displacement)
            return s._replace(cycles=cycles)
        cycles = limit_cycle.after_heavy_cycle(
            s.cycles, displacement, s.xi, self.drift_tolerance
        )
        s = s._replace(cycles=cycles)
        if self.to_limit and not self.is_periodic(s):
            return self.with_velocity_change(s, problem, site)
        return s

    def is_periodic(self, s: State) -> bool:
        """Return whether the cycles of all samples repeat."""
        return bool((s.cycles.drift <= self.drift_tolerance).all())

    def with_velocity_change(self, s: State, problem: Problem, site: Site) -> State:
        """Return the state as if the body had moved faster in the last steps, by the
        extrapolation to the limit cycle."""
        change = s.cycles.extrapolation
        v_change = to_element(problem.sides.elements, *change)
        v = tuple(a + b for a, b in zip(s.v, v_change))
        drag = self._drag(problem, s.xi + change) - self._drag(problem, s.xi)
        drag = drag / problem.axial_drag
        states = tuple(
            e.with_velocity_change(problem, site, state, change, drag)
            for e, state in zip(self.effects, s.effect_states)
        )
        return s._replace(
            xi=s.xi + change, xi_before=s.xi_before + change, v=v, effect_states=states
        )

    def memory(self, s: State) -> np.ndarray:
        """Return the numbers (M, B) of the memories that may be mixed."""
        samples = self.alpha.shape[-1]
        numbers = [
            np.reshape(state, (-1, samples))
            for e, state in zip(self.effects, s.effect_states)
            if e.memory_bounds is not None
        ]
        return np.concatenate([np.zeros((0, samples)), *numbers])

    def with_memory(self, s: State, memory: np.ndarray) -> State:
        """Return the state with other numbers (M, B) in its memories, within their
        bounds."""
        states = []
        used = 0
        for effect, state in zip(self.effects, s.effect_states):
            if effect.memory_bounds is not None:
                count = state.size // memory.shape[-1]
                numbers = np.clip(memory[used : used + count], *effect.memory_bounds)
                state = numbers.reshape(state.shape)
                used += count
            states.append(state)
        return s._replace(effect_states=tuple(states))

    def _drag(self, problem: Problem, xi: np.ndarray) -> np.ndarray:
        """Return force and moment of undisturbed ground on the frame at a velocity,
        (3, B)."""
        scaled = xi / problem.frame.speed_scale
        v = with_frame_velocity(problem, velocities(problem), *scaled)
        rounding = np.full(xi.shape[1], self.accuracy.rounding)
        return np.stack(frame_net(problem, v, rounding, *scaled).force)


def runs_away(xi: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return whether velocities (3, B) are those of bodies (B,) that slide away, for a
    scale of speed (B,)."""
    return ~(np.abs(xi).max(0) < RUNAWAY * scale)


def _phase_after_phase(x: np.ndarray) -> np.ndarray:
    """Return values (N, joints, B) as those of N B samples, (joints, N B)."""
    return np.moveaxis(x, 0, 1).reshape(x.shape[1], -1)


def relative_pose(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return pose b (3, B) in the frame at pose a."""
    z = ((b[0] - a[0]) + 1j * (b[1] - a[1])) * np.exp(-1j * a[2])
    return np.stack([z.real, z.imag, b[2] - a[2]])


def integrated_pose(pose: np.ndarray, xi: np.ndarray, dt: float) -> np.ndarray:
    """Return the pose (3, B) reached from a pose at a constant body velocity xi (3, B)
    after dt."""
    moved = dt * xi
    half = 0.5 * moved[2]
    chord = np.sin(half + TINY) / (half + TINY)  # over the arc
    z = chord * np.exp(1j * (pose[2] + half)) * (moved[0] + 1j * moved[1])
    moved[0] = z.real
    moved[1] = z.imag
    return pose + moved
