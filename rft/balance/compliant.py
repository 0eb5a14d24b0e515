"""The balance of a body whose joints give way: force, moment, and the torques on its
joints vanish (Eq. 5, with joint rates among the unknowns).

An element's velocity is linear in the frame's velocity and in the joint rates, v = v_0
+ D y, with D the columns of both. So the balance is D^T f(v) = 0 for the frame, and
D^T f(v) + spring = 0 for the joints, with the loads f of the law as they are. Newton's
steps, levels of rounding and limits are those of `rft.formulas.newton`, for 3 + m
unknowns.

Samples are on the first axis here, for products of small matrices."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rft.balance.arrays import loads, row, slowest2
from rft.effects.contact import Assembly, Problem
from rft.effects.springs import JointSprings
from rft.formulas.newton import (
    FASTEST,
    VISCOUS,
    Descent,
    Limits,
    Progress,
    compliant_fraction,
    judge_step,
    progress_after,
    residual_norm,
)
from rft.formulas.springs import SpringLoad, resistance, spring_load

# On the last level alone, from a guess: at one shape, and while the shape moves, where
# a guess that takes more evaluations than these is most often none.
WARM = Descent(0.0, 0.0, 0.0, np.inf, 16.0)
WARM_MOVING = Descent(0.0, 0.0, 0.0, np.inf, 8.0)
DESCENTS = (
    Descent(0.011, 0.32, 0.08, 4.0, 60.0),
    Descent(0.1, 0.1, 1e-4, 1e3, 200.0),
    Descent(0.3, 0.3, 1e-6, np.inf, 600.0),
    Descent(1.0, 0.6, 1e-8, np.inf, 4000.0),
)
SHAPE_TOLERANCE = 1e-9  # rad, of the shape at the end of a step
MOST_GEOMETRIES = 25  # at which one step is solved
SHIFT = 1e-6  # rad, of shapes whose differences give the slopes of forces in the shape
SHIFTED_TOGETHER = 200_000  # elements x unknowns x samples at shifted shapes
ROUNDOFF = 4e-16  # of the largest torque of a spring, that residuals allow for


# Arguments of the compiled steps (`rft.balance.joints`).


class Links(NamedTuple):
    """A chain of links as numbers; fields as of `rft.balance.chains.ChainNumbers`."""

    fractions: np.ndarray
    modes: np.ndarray
    frame_link: int


class Gait(NamedTuple):
    """What is given at each of N steps, for B samples.

    command: (N, E, B), angles of the joints that the gait commands. shape, rate:
    (N, d, B), of the command. change: (N, d, B), by which the shape changes beside what
    its own rates change, for the command changes (`CompliantStepping.lead`). scale,
    force_scale, law_speed: (N, B), scale of speed, unit of residuals, and scale of the
    speeds that loads are computed at."""

    command: np.ndarray
    shape: np.ndarray
    rate: np.ndarray
    change: np.ndarray
    scale: np.ndarray
    force_scale: np.ndarray
    law_speed: np.ndarray


class History(NamedTuple):
    """What steps read and write.

    shape: (N + 2, d, B), the first two before the first step. rate: (N + 1, d, B), the
    first before it. xi: (N + 2, 3, B), the first two before it. v: (N, 3, n, B),
    velocities (v_t, v_n, v_w) of the links. residual, several: (N, B), as in
    `rft.balance.compliant.CompliantSolutions`."""

    shape: np.ndarray
    rate: np.ndarray
    xi: np.ndarray
    v: np.ndarray
    residual: np.ndarray
    several: np.ndarray


# The steps by NumPy.


class JointStep(NamedTuple):
    """One implicit step of the springs, alpha = base + reach (rate), for B samples.

    springs: of the body. base: (d, B), shape that no rate would change; of a
    prescribed shape variable its angle. reach: (), phase that a rate acts for.
    command: (E, B), angles of the joints that the gait commands. torque_unit: (B,) or
    (), axial drag, in the law's unit of force."""

    springs: JointSprings
    base: np.ndarray
    reach: float
    command: np.ndarray
    torque_unit: np.ndarray | float

    def shape(self, rates: np.ndarray) -> np.ndarray:
        """Return the shape (d, B) at rates (m, B) of the unknown variables."""
        alpha = self.base.copy()
        alpha[self.springs.unknown] += self.reach * rates
        return alpha

    def take(self, index: np.ndarray) -> JointStep:
        """Return the step of some samples."""
        unit = self.torque_unit
        return self._replace(
            springs=self.springs.take(index),
            base=self.base[:, index],
            command=self.command[:, index],
            torque_unit=unit[index] if isinstance(unit, np.ndarray) else unit,
        )

    def resistance(
        self, rates: np.ndarray, columns: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the torques of springs and dampers (B, m) on the unknown variables at
        rates (m, B), and their slopes (B, m, m) in these.

        columns: (E, m), angles of the joints per unit of the unknown variables."""
        load = joint_load(self.springs, self.shape(rates), self.command)
        damping = self.springs.damping
        torque, slope = resistance(load, columns @ rates, damping, self.reach)
        on_variables = (columns.T @ (self.torque_unit * torque)).T
        weighted = columns[:, :, None] * (self.torque_unit * slope)[:, None]
        return on_variables, weighted.transpose(2, 1, 0) @ columns


def joint_load(s: JointSprings, alpha: np.ndarray, command: np.ndarray) -> SpringLoad:
    """Return the load of the joints' springs in axial drags, (..., E, B) each, 0 at
    prescribed joints.

    alpha: (..., d, B), shape. command: (..., E, B), angles that the gait commands."""
    deviation = s.rows @ alpha - s.rest - s.actuated * command
    return spring_load(deviation, s.finite_stiffness, s.low, s.high)


class CompliantSolutions(NamedTuple):
    """Solutions. y: (3 + m, B), velocity of the frame and rates of the unknown shape
    variables. residual: (B,), the largest of force, moment and torques over the unit of
    residuals. several: (B,), whether the balance certainly has other solutions as
    well. v: (3, n, B), velocities of the body's sides over the scale of speed."""

    y: np.ndarray
    residual: np.ndarray
    several: np.ndarray
    v: np.ndarray


class Geometry(NamedTuple):
    """The balance with the geometry of one shape.

    problem: with the velocities of the prescribed joints alone. columns: for the sides
    and for the points, (B, n, 3, P) each, velocities of elements per unknown."""

    problem: Problem
    columns: tuple[np.ndarray, np.ndarray]

    def take(self, index: np.ndarray) -> Geometry:
        """Return the balance of some samples."""
        columns = tuple(x[index] for x in self.columns)
        return Geometry(self.problem.take(index), columns)

    def velocities(self, y: np.ndarray) -> list[np.ndarray]:
        """Return the velocities (3, n, B) of sides and points at unknowns (B, P), all
        over the scale of speed."""
        scale = self.problem.frame.speed_scale
        found = []
        for contact, columns in zip(_contacts(self.problem), self.columns):
            v = contact.elements.v / scale
            found.append(v + _applied(columns, y))
        return found


class Places(NamedTuple):
    """The balances of one step at all shapes.

    alphadot: (d, B), rates of the prescribed shape variables, 0 of the others. scale:
    (B,), of speed. finish(problem): the problem with the effects of one time step."""

    assembly: Assembly
    step: JointStep
    alphadot: np.ndarray
    scale: np.ndarray
    finish: Callable[[Problem], Problem]

    def at(self, alpha: np.ndarray) -> Geometry:
        """Return the balance at a shape (d, B)."""
        unknown = self.step.springs.unknown
        g = geometry(self.assembly, unknown, alpha, self.alphadot, self.scale)
        return g._replace(problem=self.finish(g.problem))

    def slope(
        self, g: Geometry, alpha: np.ndarray, y: np.ndarray, forces: Forces
    ) -> np.ndarray:
        """Return the slopes (B, P, m) of forces in the unknown rates that follow from
        the shape, a difference of neighbouring shapes; parameters of effects are taken
        as constant. y: (B, P), over the scale of speed."""
        unknown = self.step.springs.unknown
        size, unknowns = y.shape
        slope = np.zeros((size, unknowns, len(unknown)))
        per_shape = size * unknowns * len(g.columns[0][0])
        count = max(1, SHIFTED_TOGETHER // per_shape)
        for first in range(0, len(unknown), count):
            part = unknown[first : first + count]
            samples = np.arange(len(part) * size)
            owner = samples % size
            shifted = alpha[:, owner]
            shifted[np.repeat(part, size), samples] += SHIFT
            near = geometry(
                self.assembly.take(owner),
                unknown,
                shifted,
                self.alphadot[:, owner],
                self.scale[owner],
            )
            v_near = near.velocities(y[owner])
            v_here = g.velocities(y)
            for c_near, c, v, u, (force, by_v) in zip(
                near.columns, g.columns, v_near, v_here, forces.loads
            ):
                flat = c.reshape(size, -1, unknowns)
                change = c_near.reshape(len(part), *flat.shape) - flat
                dv = v.reshape(*u.shape[:2], len(part), size) - u[:, :, None]
                right = by_v @ dv.transpose(2, 3, 1, 0)[..., None]
                right = right.reshape(len(part), size, -1, 1)
                there = change.swapaxes(2, 3) @ force.reshape(size, -1, 1)
                total = there + flat.swapaxes(1, 2) @ right
                slope[:, :, first : first + count] += total[..., 0].transpose(1, 2, 0)
        return slope * (self.step.reach / SHIFT * self.scale)[:, None, None]


def geometry(
    assembly: Assembly,
    unknown: np.ndarray,
    alpha: np.ndarray,
    alphadot: np.ndarray,
    scale: np.ndarray,
) -> Geometry:
    """Return the balance at a shape (d, B), without effects of one time step.

    unknown: (m,), shape variables with unknown rates. Others as of `Places`."""
    size = alpha.shape[1]
    count = 1 + len(unknown)
    rates = np.zeros((len(alpha), count, size))
    rates[:, 0] = alphadot
    rates[unknown, 1 + np.arange(len(unknown))] = 1.0
    samples = np.arange(count * size) % size
    together = assembly.take(samples).problem(
        alpha[:, samples], rates.reshape(len(alpha), -1), scale[samples]
    )
    problem = together.take(np.arange(size))
    columns = []
    for all_rates, contact in zip(_contacts(together), _contacts(problem)):
        e = contact.elements
        n = len(e.c)
        own = np.zeros((size, n, 3, 2 + count))
        own[:, :, 0, 0] = own[:, :, 1, 1] = e.c.T
        own[:, :, 0, 1] = e.s.T
        own[:, :, 1, 0] = -e.s.T
        own[:, :, 0, 2] = e.r_t.T
        own[:, :, 1, 2] = e.r_n.T
        own[:, :, 2, 2] = e.half.T
        v = all_rates.elements.v.reshape(3, n, count, size)
        own[..., 3:] = v[:, :, 1:].transpose(3, 1, 0, 2)
        columns.append(own)
    return Geometry(problem, tuple(columns))


def _contacts(problem: Problem) -> tuple:
    return problem.sides, problem.points


def _applied(columns: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the velocities (3, n, B) due to unknowns (B, P)."""
    size, n, _, unknowns = columns.shape
    v = columns.reshape(size, -1, unknowns) @ y[:, :, None]
    return v.reshape(size, n, 3).transpose(2, 1, 0)


class Forces(NamedTuple):
    """Generalised forces (B, P), their slopes (B, P, P) in the unknowns at one shape,
    their slope (B, P) in the logarithm of all velocities, and, for sides and points,
    forces (B, n, 3, 1) on elements and their slopes (B, n, 3, 3) in velocities over the
    scale of speed."""

    force: np.ndarray
    slope: np.ndarray
    by_speed: np.ndarray
    loads: list


def _forces(
    g: Geometry, step: JointStep, v: list[np.ndarray], y: np.ndarray, rounding
) -> Forces:
    """Return the forces at velocities (3, n, B) of elements and unknowns (B, P), over
    the scale of speed."""
    problem = g.problem
    speed = problem.law_speed_scale[0]
    size, unknowns = y.shape
    # Force, slope in the logarithm of all velocities, slopes in the unknowns.
    total = np.zeros((size, unknowns, 2 + unknowns))
    on_elements = []
    pairs = loads(problem, [tuple(x) for x in v], rounding)
    for (e, load), columns, u in zip(pairs, g.columns, v):
        average, by_v = _stacked(load, u.shape[1:])
        moved = np.concatenate([u.transpose(2, 1, 0)[..., None], columns], -1)
        by_v = (speed * e.weight * by_v).transpose(3, 2, 0, 1)
        force = (e.weight * average).transpose(2, 1, 0)[..., None]
        on_elements.append((force, by_v))
        right = np.concatenate([force, by_v @ moved], -1)
        right = right.reshape(size, -1, 2 + unknowns)
        total += columns.reshape(size, -1, unknowns).transpose(0, 2, 1) @ right
    force = total[:, :, 0]
    by_speed = total[:, :, 1]
    slope = total[:, :, 2:]
    if problem.momentum_rate is not None:
        inertial, mass = _inertia(g, v[0])
        force += inertial
        slope += mass
    scale = problem.frame.speed_scale[0]
    s = step.springs
    columns = s.rows[:, s.unknown]
    torque, torque_slope = step.resistance(scale * y[:, 3:].T, columns)
    # With wide rounding drag is weak, and the full torque would lead far away.
    less = np.sqrt(1.0 + rounding**2)[:, None]
    force[:, 3:] += torque / less
    factor = np.broadcast_to(scale, (size,))[:, None] / less
    slope[:, 3:, 3:] += torque_slope * factor[:, :, None]
    return Forces(force, slope, by_speed, on_elements)


def _stacked(load, shape: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Return the averages (3, n, B) of a load and their slopes (3, 3, n, B)."""
    values = np.empty((12, *shape))
    for value, x in zip(values, load):
        value[:] = x
    values = values.reshape(3, 4, *shape)
    return values[:, 0], values[:, 1:]


def _inertia(g: Geometry, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rate of change of momentum on the unknowns (B, P), and its slopes, of
    a body with mass at velocities (3, n, B) of its sides over the scale of speed."""
    problem = g.problem
    e = problem.sides.elements
    m = problem.momentum_rate
    scale = problem.frame.speed_scale[0]
    columns = g.columns[0]
    mass = 2 * e.half * np.array([1.0, 1.0, 1.0 / 3.0])[:, None, None]
    # Earlier momenta about the origin of the frame, along and across each element.
    centre = e.centres
    turn = m.past_t - (centre.real * m.past_y - centre.imag * m.past_x)
    past = np.stack(
        [
            e.c * m.past_x + e.s * m.past_y,
            e.c * m.past_y - e.s * m.past_x,
            turn / e.half,
        ]
    )
    strength = np.broadcast_to(m.strength[0], (len(columns),))
    rate = float(m.rate[0, 0])
    value = strength * (rate * scale * mass * v - past)
    force = np.einsum("bnap,anb->bp", columns, value)
    weight = np.broadcast_to(rate * strength * scale, (len(columns),))
    heavy = columns * mass.transpose(2, 1, 0)[..., None]
    slope = np.einsum("bnap,bnaq->bpq", columns, heavy) * weight[:, None, None]
    return force, slope


def _residual(forces: Forces, problem: Problem) -> np.ndarray:
    """Return the largest of force, moment about the body's mean place, and torques on
    the unknown shape variables, over the unit of residuals, (B,)."""
    frame = row(problem.frame)
    on_frame = residual_norm(forces.force[:, :3].T, frame)
    torque = np.abs(forces.force[:, 3:]).max(1, initial=0.0)
    return np.maximum(on_frame, torque / frame.force_scale)


def descend(
    g: Geometry,
    step: JointStep,
    descent: Descent,
    limits: Limits,
    guess: np.ndarray | None,
) -> CompliantSolutions:
    """Return the solutions of all samples at one shape after one descent, from a guess
    (P, B) over the scale of speed, or from the viscous solution."""
    return _descend(g, step, descent, limits, guess, None, None)[0]


def descend_with_shape(
    places: Places,
    g: Geometry,
    alpha: np.ndarray,
    warm: Descent,
    limits: Limits,
    guess: np.ndarray,
) -> tuple[CompliantSolutions, Geometry]:
    """Return the solutions of all samples at the shapes that their own rates lead to
    after one descent from a guess (P, B) over the scale of speed, and the balance
    there. g, alpha: the balance at the guess, and its shape (d, B)."""
    return _descend(g, places.step, warm, limits, guess, places, alpha)


def _descend(
    g: Geometry,
    step: JointStep,
    descent: Descent,
    limits: Limits,
    guess: np.ndarray | None,
    places: Places | None,
    alpha: np.ndarray | None,
) -> tuple[CompliantSolutions, Geometry]:
    """Return the solutions after a descent at one shape, or, with places, at the shapes
    that rates lead to, and the balance there."""
    size, _, _, unknowns = g.columns[0].shape
    fresh = guess is None
    y = np.zeros((size, unknowns))
    dy = np.zeros((size, unknowns))
    if guess is not None:
        dy = np.ascontiguousarray(guess.T)
    v = g.velocities(y)
    first = np.full(size, float(descent.first))
    wide = np.full(size, VISCOUS if fresh else float(descent.first))
    zero = np.zeros(size)
    it = Progress(first, wide, zero + 1, zero + np.inf, zero, zero, zero + fresh)
    residual = zero + np.inf
    several = np.zeros(size, bool)
    active = np.ones(size, bool)
    out = np.zeros((size, unknowns))
    out_v = np.zeros_like(v[0])
    by_shape = None
    while active.any():
        v_next = [u + _applied(c, dy) for u, c in zip(v, g.columns)]
        y_next = y + dy
        if places is not None:
            reached = step.shape(places.scale * y_next[:, 3:].T)
            moves = (np.abs(reached - alpha) > SHAPE_TOLERANCE).any(0) & active
            if moves.any():
                alpha = np.where(moves, reached, alpha)
                g = places.at(alpha)
                there = g.velocities(y_next)
                v_next = [np.where(moves, a, b) for a, b in zip(there, v_next)]
        forces = _forces(g, step, v_next, y_next, it.rounding_next)
        found = _residual(forces, g.problem)
        slowest = np.sqrt(slowest2([tuple(u) for u in v_next]))
        judged = judge_step(it, found, slowest, descent, limits)
        accepted = judged.accepted
        y = np.where(accepted[:, None], y_next, y)
        v = [np.where(accepted, a, b) for a, b in zip(v_next, v)]
        is_last = accepted & (it.rounding_next <= limits.rounding)
        it = progress_after(it, found, slowest, judged, descent)
        solved = is_last & (it.residual <= limits.residual)
        ended = active & (solved | (it.evaluations >= descent.budget))
        if ended.any():
            possible = (np.abs(y) < FASTEST).all(1) & np.isfinite(y).all(1)
            valid = possible & (it.rounding <= limits.rounding)
            out[ended] = y[ended]
            out_v[..., ended] = v[0][..., ended]
            residual[ended] = np.where(valid, it.residual, np.inf)[ended]
            folded = np.linalg.slogdet(forces.slope[ended])[0] < 0
            several[ended] = folded & solved[ended]
            active &= ~ended
            if not active.any():
                break
        slope = forces.slope
        if places is not None:
            if by_shape is None:  # it changes little while the shape moves
                by_shape = places.slope(g, alpha, y_next, forces)
            slope = slope.copy()
            slope[:, :, 3:] += by_shape
        right = judged.prediction[:, None] * forces.by_speed
        newton = _solved(slope, right - judged.damping[:, None] * forces.force)
        fraction = np.where(judged.fresh, 1.0, _fraction(newton, g.problem, limits))
        renewed = accepted | judged.fresh
        dy = np.where(renewed[:, None], fraction[:, None] * newton, 0.5 * dy)
    return CompliantSolutions(out.T, residual, several, out_v), g


def _solved(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solutions (B, P) of linear equations; 0 where a matrix is singular or
    not finite."""
    finite = np.isfinite(matrices).all((1, 2)) & np.isfinite(right).all(1)
    if not finite.all():
        one = np.eye(matrices.shape[1])
        matrices = np.where(finite[:, None, None], matrices, one)
        right = np.where(finite[:, None], right, 0.0)
    try:
        return np.linalg.solve(matrices, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return (np.linalg.pinv(matrices) @ right[..., None])[..., 0]


def _fraction(newton: np.ndarray, problem: Problem, limits: Limits) -> np.ndarray:
    """Return the fraction of a step (B,) that changes no velocity by more than
    `Limits.largest_step`."""
    rates2 = (newton[:, 3:] ** 2).sum(1)
    frame = row(problem.frame)
    return compliant_fraction(*newton[:, :3].T, rates2, frame, limits.largest_step)
