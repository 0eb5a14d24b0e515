"""Time stepping of a body whose joints give way: its shape is part of the state.

At every phase the rates of the joints that give way are unknowns beside the body
velocity (`rft.balance.compliant`). The deviation of the shape from the command follows
by BDF2, the backward difference of order 2, which damps stiff springs at any step; the
first step is of order 1. The geometry is that at the end of the step: the balance is
solved with the shape that its own rates lead to."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rft.balance.compliant import (
    DESCENTS,
    MOST_GEOMETRIES,
    ROUNDOFF,
    SHAPE_TOLERANCE,
    WARM,
    WARM_MOVING,
    CompliantSolutions,
    Geometry,
    JointStep,
    Places,
    descend,
    descend_with_shape,
    joint_load,
)
from rft.balance.listening import listener
from rft.balance.solver import begin, limits_of, problem_limits
from rft.bodies.base import joint_speed
from rft.core.refusal import require
from rft.effects.base import Effect, Site
from rft.effects.contact import Assembly, Problem, take
from rft.effects.springs import JointSprings, Springs, joint_rows
from rft.formulas.newton import Limits
from rft.formulas.springs import extrapolated_rate, held_shape, mixing_weight
from rft.laws.batch import MediumBatch
from rft.motion.compiled_steps import StepsAhead, takes
from rft.motion.stepping import Row, State, Stepping, integrated_pose
from rft.motion.work import Work, element_work


class SpringMotion(NamedTuple):
    """What the joints of a body with springs do, at N phases of the last cycle.

    alpha, alphadot: (..., N, d), the shape that the body really takes, rad, and its
    rate, rad per radian of phase. torque: (..., N, E), of each joint's spring and
    damper on the body, in axial drags times the body's length; nan at prescribed
    joints. actuator: (..., N, E), torque of each joint's actuator: that of the spring
    where it is in series with one, 0 where the joint is passive, nan where it is
    prescribed. actuator_power: (..., N, E), that torque times the rate of the command.
    stored: (..., N), energy of all springs. several: (...), number of steps whose
    balance certainly has more solutions than the one taken."""

    alpha: np.ndarray
    alphadot: np.ndarray
    torque: np.ndarray
    actuator: np.ndarray
    actuator_power: np.ndarray
    stored: np.ndarray
    several: np.ndarray


class CompliantStepping(Stepping):
    """Steps through gaits of a body with springs.

    Arguments as of `Stepping`; alpha and alphadot are those of the command. start:
    (d, B), shape one step before the first phase; by default the command's, and the
    angle of rest of passive joints."""

    def __init__(self, *arguments: Any, start: np.ndarray | None = None):
        super().__init__(*arguments)
        self._stores_problems = False
        self.heavy = False  # cycles are run one after another, without extrapolation
        self.place = next(
            k for k, effect in enumerate(self.effects) if isinstance(effect, Springs)
        )
        self.springs = of_samples(
            self.effects[self.place], self.assembly, self.alpha.shape[-1]
        )
        s = self.springs
        passive = np.flatnonzero(s.actuated[:, 0] == 0)
        if len(passive):
            self.alpha = self.alpha.copy()
            self.alphadot = self.alphadot.copy()
            self.alpha[:, passive] = 0.0
            self.alphadot[:, passive] = 0.0
        self._check_steps()
        self.start = start
        if start is None:
            self.start = self.alpha[-1].copy()
            if len(passive):
                self.start[passive] += s.rest[passive]
        self._ahead: StepsAhead | None = None
        if takes(self):
            self._ahead = StepsAhead(self)
        self.has_mass = any(hasattr(effect, "mass") for effect in self.effects)

    def _check_steps(self) -> None:
        """Raise ValueError if a command turns a joint by more than half a turn from
        one phase to the next, which no step resolves."""
        angles = joint_rows(self.assembly.body) @ self.alpha
        largest = np.abs(angles - np.roll(angles, 1, axis=0)).max(initial=0.0)
        require(
            largest <= np.pi,
            f"the command turns a joint by {largest:.3g} rad between two phases",
            because="springs follow half a turn at most",
            instead="raise phases, or lower the amplitude",
        )

    @cached_property
    def scales(self) -> np.ndarray:
        """Scales of speed, (N, B): the command's root mean square over the cycle, for
        joints move while the command pauses."""
        speed = np.stack([joint_speed(self.assembly.body, x) for x in self.alphadot])
        rms = np.sqrt((speed**2).mean(0))
        return np.broadcast_to(np.where(rms > 0, rms, 1.0), speed.shape)

    def begin(self) -> State:
        state = super().begin()
        start = self.start
        zero = np.zeros_like(start)
        own = np.stack([start, start, zero, start])
        return state._replace(effect_states=_replaced(state, self.place, own))

    def joint_step(self, k: int, own: np.ndarray, first: bool) -> JointStep:
        """Return the implicit step of the springs to the phase 2 pi k / N, from their
        state."""
        shape, before, *_ = own
        held = shape if first else held_shape(shape, before)
        s = self.springs
        base = self.alpha[k].copy()
        base[s.unknown] = (held + self.lead(k, first))[s.unknown]
        reach = self.dt if first else 2 * self.dt / 3
        command = s.rows @ self.alpha[k]
        return JointStep(s, base, reach, command, self.assembly.axial_drag)

    def lead(self, k: int, first: bool) -> np.ndarray:
        """Return by how much the shape (d, B) at the phase 2 pi k / N changes because
        the command does, beside what its own rates change.

        What is differenced is the deviation from the command, whose rate is known: so
        stiff springs follow the command exactly, with few phases, too."""
        now, last, older = (self.alpha[(k - j) % self.phases] for j in range(3))
        if first:
            return now - last - self.dt * self.alphadot[k]
        return now - held_shape(last, older) - 2 * self.dt / 3 * self.alphadot[k]

    def step(self, s: State, with_work: bool = False) -> tuple[State, Row]:
        found = self._ahead.step(s) if self._ahead else None
        if found is None:
            return self._step_by_numpy(s, with_work)
        after, row = found
        after = after._replace(cycles=s.cycles)
        if with_work:
            k = int(s.count[0, 0]) % self.phases
            alpha, _, alphadot, _ = after.effect_states[self.place]
            problem = self.assembly.problem(alpha, alphadot, self.scales[k])
            row = row._replace(work=self._work(k, problem, after.xi))
        after = self._with_cycles(s, after)
        self._ahead.goes_on(after)
        return after, row

    def _step_by_numpy(self, s: State, with_work: bool) -> tuple[State, Row]:
        """Return the state after the next step, and its row, by NumPy."""
        guess = self.guess(s)
        site = self.site(s, guess)
        first = site.count == 0
        k = site.count % self.phases
        own = s.effect_states[self.place]
        step = self.joint_step(k, own, first)

        def finish(problem: Problem) -> Problem:
            for effect, state, acts in zip(
                self.effects, s.effect_states, self.first_effects
            ):
                if acts or not first:
                    problem = effect.apply(problem, site, state)
            return problem

        fixed_rates = self.alphadot[k].copy()
        fixed_rates[self.springs.unknown] = 0.0
        rates = self._rate_guess(k, own, first)
        start = None if first else np.concatenate([guess, rates]) / self.scales[k]
        places = Places(self.assembly, step, fixed_rates, self.scales[k], finish)
        solved, g, limits = self._solved_shape(places, step.shape(rates), start)
        y = solved.y * self.scales[k]
        xi = y[:3]
        alpha = step.shape(y[3:])
        alphadot = fixed_rates
        alphadot[self.springs.unknown] = y[3:]

        pose = s.pose
        if not first:
            pose = integrated_pose(pose, (s.xi + xi) / 2, self.dt)
        v = tuple(self.scales[k] * x for x in solved.v)
        states = []
        for j, (effect, state) in enumerate(zip(self.effects, s.effect_states)):
            if j == self.place:
                states.append(np.stack([alpha, own[0], alphadot, own[3]]))
            else:
                states.append(effect.after(g.problem, site, state, v))

        work = None
        if with_work:
            problem = self.assembly.problem(alpha, alphadot, self.scales[k])
            work = self._work(k, finish(problem), xi)
        after = State(s.count + 1, pose, xi, s.xi, v, tuple(states), s.cycles)
        of_step = self.motion(k, alpha[None], alphadot[None], solved.several[None])
        motion = SpringMotion(*(x[0] for x in of_step))
        row = Row(xi, pose, solved.residual, np.array([limits]), work, motion)
        return self._with_cycles(s, after), row

    def _work(self, k: int, problem: Problem, xi: np.ndarray) -> Work:
        """Return the work of the step to the phase 2 pi k / N."""
        rounding = self.accuracy.rounding * self.scales[k]
        return element_work(problem, self.body_halves, xi, rounding)

    def _with_cycles(self, s: State, after: State) -> State:
        """Return the state after a step with the record of cycles brought up to date
        where a cycle begins or ends."""
        k = int(s.count[0, 0]) % self.phases
        if k == 0:
            after = after._replace(cycles=after.cycles._replace(pose=after.pose))
        if k == self.phases - 1:
            after = self._after_cycle(after, None, None)
        return after

    def _rate_guess(self, k: int, own: np.ndarray, first: bool) -> np.ndarray:
        """Return a guess of the unknown rates (m, B), by linear extrapolation."""
        unknown = self.springs.unknown
        if first:
            return self.alphadot[k][unknown]
        shape, before, rate, _ = own[:, unknown]
        return extrapolated_rate(shape, before, rate, self.dt)

    def _solved_shape(
        self, places: Places, alpha: np.ndarray, guess: np.ndarray | None
    ) -> tuple[CompliantSolutions, Geometry, float]:
        """Return the solution at the shape that its own rates lead to, the balance
        there, and the largest residual of a solution.

        alpha: (d, B), a guess of that shape. guess: (P, B), of the solution, over the
        scale of speed, None before the first step."""
        assembly = self.assembly
        g = places.at(alpha)
        limits = self._limits(g.problem)
        warm = begin(WARM_MOVING, assembly.linear, limits)
        best = None
        if guess is not None:
            best, there = descend_with_shape(places, g, alpha, warm, limits, guess)
        if best is None or not (best.residual <= limits.residual).all():
            # Of the others at this shape, then while it moves.
            y = self._with_rest(best, g, places.step, limits)
            reached = places.step.shape(places.scale * y[3:])
            first = places.at(reached)
            found, there = descend_with_shape(places, first, reached, warm, limits, y)
            best, there = self._joined(best, found, there, places, limits)
        if not (best.residual <= limits.residual).all():
            found, there = self._fixed_point(places, alpha)
            best, there = self._joined(best, found, there, places, limits)
        listener()(alpha.shape[1], assembly.n_law_points, assembly.linear)
        return best, there, limits.residual

    def _joined(
        self,
        best: CompliantSolutions | None,
        found: CompliantSolutions,
        there: Geometry,
        places: Places,
        limits: Limits,
    ) -> tuple[CompliantSolutions, Geometry]:
        """Return the first solution of each sample, so that its digits do not depend on
        the others, and the balance at their shapes."""
        if best is None:
            return found, there
        are_solved = best.residual <= limits.residual
        if not are_solved.any():
            return found, there
        joined = _with_others(found, best, are_solved)
        return joined, places.at(places.step.shape(places.scale * joined.y[3:]))

    def _fixed_point(
        self, places: Places, alpha: np.ndarray
    ) -> tuple[CompliantSolutions, Geometry]:
        """Return the solution at the shape that its own rates lead to by solutions at
        one shape after the other, which a secant accelerates."""
        step = places.step
        stays = np.zeros(alpha.shape[1], bool)
        last = None
        guess = None
        for _ in range(MOST_GEOMETRIES):
            g = places.at(alpha)
            limits = self._limits(g.problem)
            solved = self._solved_at(g, step, limits, guess)
            reached = step.shape(places.scale * solved.y[3:])
            change = reached - alpha
            stays |= ~(np.abs(change).max(0) > SHAPE_TOLERANCE)
            if stays.all():
                break
            mixed = reached
            if last is not None:
                difference = change - last[1]
                product = (change * difference).sum(0)
                weight = mixing_weight(product, (difference**2).sum(0))
                mixed = reached - weight * (reached - last[0])
            last = reached, change
            # A shape that stays is not touched, whatever other samples take.
            alpha = np.where(stays, alpha, mixed)
            guess = solved.y
        else:
            residual = np.where(stays, solved.residual, np.inf)
            solved = solved._replace(residual=residual)
        return solved, g

    def _with_rest(
        self,
        best: CompliantSolutions | None,
        g: Geometry,
        step: JointStep,
        limits: Limits,
    ) -> np.ndarray:
        """Return the unknowns (P, B) of solutions, with those of unsolved samples, or
        of all, solved anew at one shape."""
        if best is None:
            return self._solved_at(g, step, limits, None).y
        rest = np.flatnonzero(~(best.residual <= limits.residual))
        own = take(limits, rest)
        y = best.y.copy()
        y[:, rest] = self._solved_at(g.take(rest), step.take(rest), own, None).y
        return y

    def _solved_at(
        self, g: Geometry, step: JointStep, limits: Limits, guess: np.ndarray | None
    ) -> CompliantSolutions:
        """Return the solutions at one shape by the first descent that finds them."""
        linear = self.assembly.linear
        warm, *others = (begin(x, linear, limits) for x in (WARM, *DESCENTS))
        if guess is None:
            best = descend(g, step, others.pop(0), limits, None)
        else:
            best = descend(g, step, warm, limits, guess)
        for descent in others:
            rest = np.flatnonzero(~(best.residual <= limits.residual))
            if not rest.size:
                break
            own = take(limits, rest)
            found = descend(g.take(rest), step.take(rest), descent, own, None)
            best = _with_better(best, found, rest)
        return best

    @property
    def limits(self) -> Limits:
        """The limits of a body without mass in one medium."""
        return self._with_roundoff(limits_of(self.assembly, self.accuracy))

    def _limits(self, problem: Problem) -> Limits:
        return self._with_roundoff(problem_limits(problem, self.accuracy))

    def _with_roundoff(self, limits: Limits) -> Limits:
        """Return limits that allow for roundoff of the largest torque of a spring."""
        s = self.springs
        largest = float(np.max(s.finite_stiffness + s.damping / self.dt))
        return limits._replace(residual=limits.residual + ROUNDOFF * largest)

    def motion(
        self, k: int, alpha: np.ndarray, alphadot: np.ndarray, several: np.ndarray
    ) -> SpringMotion:
        """Return what the joints do at n phases from 2 pi k / N on, phases first,
        samples last.

        alpha, alphadot: (n, d, B). several: (n, B), whether the balance has more
        solutions."""
        s = self.springs
        phases = slice(k, k + len(alpha))
        command = s.rows @ self.alpha[phases]
        torque, _, energy = joint_load(s, alpha, command)
        is_rigid = np.isinf(s.stiffness)
        actuator = np.where(is_rigid, np.nan, -torque * s.actuated)
        total = torque + s.damping * (s.rows @ alphadot)
        command_rate = s.rows @ self.alphadot[phases]
        return SpringMotion(
            alpha,
            alphadot,
            np.where(is_rigid, np.nan, -total),
            actuator,
            actuator * command_rate,
            energy.sum(1),
            several.astype(float),
        )

    def _after_cycle(self, s: State, problem: Problem | None, site: Site | None):
        """Return the state at the end of a cycle, whose drift covers the shape."""
        s = super()._after_cycle(s, problem, site)
        own = s.effect_states[self.place].copy()
        drift = np.maximum(s.cycles.drift, np.abs(own[0] - own[3]).max(0))
        own[3] = own[0]
        return s._replace(
            cycles=s.cycles._replace(drift=drift),
            effect_states=_replaced(s, self.place, own),
        )

    def memory(self, s: State) -> np.ndarray:
        if self.has_mass:
            return np.zeros((0, self.alpha.shape[-1]))
        return super().memory(self._with_shapes_alone(s))

    def with_memory(self, s: State, memory: np.ndarray) -> State:
        own = s.effect_states[self.place]
        mixed = super().with_memory(self._with_shapes_alone(s), memory)
        shapes = mixed.effect_states[self.place]
        whole = np.concatenate([shapes, own[2:]])
        return mixed._replace(effect_states=_replaced(mixed, self.place, whole))

    def _with_shapes_alone(self, s: State) -> State:
        """Return the state with the last two shapes as all that springs store."""
        own = s.effect_states[self.place]
        return s._replace(effect_states=_replaced(s, self.place, own[:2]))


def of_samples(springs: Springs, assembly: Assembly, count: int) -> JointSprings:
    """Return the springs of ``count`` samples, which may be in different media."""
    medium = assembly.medium
    if not isinstance(medium, MediumBatch):
        return springs.of_body(assembly.body, medium)
    parts = []
    for one, run in medium.runs():
        parts.append(springs.take(run).of_body(assembly.body, one))
    widths = [run.stop - run.start for _, run in medium.runs()]

    def joined(name: str) -> np.ndarray:
        rows = [getattr(part, name) for part in parts]
        wide = [np.broadcast_to(x, (len(x), width)) for x, width in zip(rows, widths)]
        return np.concatenate(wide, 1)

    return parts[0]._replace(stiffness=joined("stiffness"), damping=joined("damping"))


def with_springs(effects: Sequence[Effect]) -> bool:
    """Return whether some joints give way."""
    return any(isinstance(effect, Springs) for effect in effects)


def _with_others(
    solved: CompliantSolutions, others: CompliantSolutions, are_better: np.ndarray
) -> CompliantSolutions:
    """Return solutions with others in place of some samples."""
    return CompliantSolutions(
        *(np.where(are_better, b, a) for a, b in zip(solved, others))
    )


def _with_better(
    best: CompliantSolutions, found: CompliantSolutions, index: np.ndarray
) -> CompliantSolutions:
    """Return solutions with those of the samples ``index`` that have smaller
    residuals in place of their own."""
    is_better = found.residual < best.residual[index]
    index = index[is_better]
    best.y[:, index] = found.y[:, is_better]
    best.residual[index] = found.residual[is_better]
    best.several[index] = found.several[is_better]
    best.v[..., index] = found.v[..., is_better]
    return best


def _replaced(state: State, place: int, own: np.ndarray) -> tuple:
    """Return the states of effects with another one of the springs."""
    states = list(state.effect_states)
    states[place] = own
    return tuple(states)
