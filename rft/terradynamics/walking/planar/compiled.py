"""Time steps of walking robots in compiled code, one robot after another.

Importing this module loads numba."""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.formulas.newton import plus, times
from rft.formulas.simd import WIDTH, register_formulas
from rft.terradynamics.ground import Ground
from rft.terradynamics.plates.compiled import force_on_elements
from rft.terradynamics.plates.contact import Force
from rft.terradynamics.walking.planar.elements import BodyLoad, body_load, part_motion
from rft.terradynamics.walking.planar.equations import (
    Robots,
    difference_steps,
    stage_residual,
)
from rft.terradynamics.walking.planar.sdirk import (
    GAMMA,
    TOLERANCE,
    Effort,
    Step,
    has_ended,
    newton_step,
    next_problem,
    stage_time,
    start_of_step,
)


@register_jitable
def add_loads(a, b):
    """Return the sum of two loads on a body."""
    return BodyLoad(
        a.f_x + b.f_x,
        a.f_z + b.f_z,
        a.moment + b.moment,
        a.motor_power + b.motor_power,
        a.ground_power + b.ground_power,
    )


@register_jitable(error_model="numpy")
def load_on_robot(law, ground, disturbed, robot, pose, twist, angle, rate, sums):
    """Return the `BodyLoad` of the ground on one robot.

    robot: the table of elements, and of its parts the first and last rows, sides, legs,
    whether they are closed, hips (2, P), and shares of the force of undisturbed ground
    (P,). sums: space for sums of forces."""
    table, blocks, side, leg, closed, hips, shares = robot
    strength, flux, rounding, grazing_sine, downhill_loss = ground
    total = BodyLoad(0.0, 0.0, 0.0, 0.0, 0.0)

    for p in range(len(side)):
        leg_rate = rate[leg[p]]
        g, r_x, r_z = part_motion(
            pose, twist, hips[0, p], hips[1, p], angle[leg[p]], leg_rate
        )
        part_ground = Ground(
            strength, flux, rounding, grazing_sine * closed[p], downhill_loss, disturbed
        )
        f = force_on_elements(
            law, part_ground, table, blocks[p, 0], blocks[p, 1], g, side[p], True, sums
        )
        f = Force(f.x * shares[p], f.z * shares[p], f.moment * shares[p])
        total = add_loads(total, body_load(f, g, r_x, r_z, leg_rate))
    return total


@register_jitable(error_model="numpy")
def difference_quotient(residual, changed, nudge):
    """Return (changed - residual) / nudge of triples."""
    return (
        (changed[0] - residual[0]) / nudge,
        (changed[1] - residual[1]) / nudge,
        (changed[2] - residual[2]) / nudge,
    )


@register_jitable(error_model="numpy")
def residual_and_slopes(
    law, ground, disturbed, robot, body, step, k, angle, rate, sums
):
    """Return the residual of a robot's stage at its trial, the residual's slopes, three
    columns, and the powers of the motors and into the ground."""
    mass, inertia, reach, along, normal = body
    nudge = difference_steps(ground[2], reach)
    residual = by_x = by_z = by_pitch = (0.0, 0.0, 0.0)
    power = (0.0, 0.0)

    # The trial itself comes first, then trials with one of the three rates changed.
    for c in range(4):
        change = (
            nudge[0] if c == 1 else 0.0,
            nudge[1] if c == 2 else 0.0,
            nudge[2] if c == 3 else 0.0,
        )
        v = plus(step.newton.trial, change)
        pose = plus(step.stage.base, times(k, v))
        load = load_on_robot(law, ground, disturbed, robot, pose, v, angle, rate, sums)
        changed = stage_residual(
            load, v, step.stage.start, k, mass, inertia, (along, normal)
        )
        if c == 0:
            residual = changed
            power = (load.motor_power, load.ground_power)
        elif c == 1:
            by_x = difference_quotient(residual, changed, nudge[0])
        elif c == 2:
            by_z = difference_quotient(residual, changed, nudge[1])
        else:
            by_pitch = difference_quotient(residual, changed, nudge[2])
    return residual, (by_x, by_z, by_pitch), power


@register_jitable
def read_state(x):
    """Return a robot at the start of a time step from a row (11,) of its state."""
    return start_of_step(
        (x[0], x[1], x[2]), (x[3], x[4], x[5]), x[6], x[7], x[8], x[9], x[10]
    )


@register_jitable
def write_state(row, state):
    """Write an accepted state into a row (11,)."""
    row[0], row[1], row[2] = state.pose
    row[3], row[4], row[5] = state.twist
    row[6] = state.work
    row[7] = state.loss
    row[8] = state.unsolved
    row[9] = state.defect
    row[10] = state.residual


@register_jitable(error_model="numpy")
def advance_stage(
    law, ground, disturbed, robot, body, step, length, start_angle, angle, rate, effort,
    sums,
):  # fmt: skip
    """Return a robot after one evaluation of forces, and whether its time step is over.

    length: s, of the time step. start_angle: rad, of the legs at the beginning of the
    step. angle: space for their angles at the stage. rate: of the legs, rad/s."""
    time = stage_time(step.stage) * length
    for j in range(len(angle)):
        angle[j] = start_angle[j] + time * rate[j]

    h = step.stage.part * length
    k = GAMMA * h
    width = effort.widths[int(step.newton.width), 0]
    strength, flux, rounding, grazing_sine, downhill_loss = ground
    tolerance = TOLERANCE * (rounding * width)
    wide_ground = (
        strength,
        flux,
        rounding * width,
        grazing_sine * np.sqrt(width),
        downhill_loss,
    )
    residual, slopes, power = residual_and_slopes(
        law, wide_ground, disturbed, robot, body, step, k, angle, rate, sums
    )
    newton, is_solved, has_failed = newton_step(
        step.newton, residual, slopes, power, k, body[2], tolerance, effort
    )
    step = Step(step.accepted, step.stage, newton)
    is_over = False
    if is_solved or has_failed:
        step, is_over = next_problem(
            step, is_solved, has_failed, tolerance, k, h, effort
        )
    return step, is_over


@functools.cache
def kernel(Law: type):
    """Return the compiled stepper for stress maps whose records have one class."""
    register_formulas()

    @njit(nogil=True, error_model="numpy")
    def run(
        numbers, grounds, disturbed, elements, parts, bodies, start, clock, lengths,
        end_heights, effort, states, evaluations,
    ):  # fmt: skip
        law = Law(*numbers)
        table, blocks, hips, shares = elements
        side, leg, closed = parts
        angles, rates = clock
        count = len(lengths)
        # Space that all evaluations share.
        sums = np.zeros((3, WIDTH))
        angle = np.zeros(angles.shape[2])

        for b in range(len(start)):
            step = read_state(start[b])
            robot = (table, blocks[b], side, leg, closed, hips[:, b], shares[b])
            s = 0
            while s < count:
                step, is_over = advance_stage(
                    law, grounds[b], disturbed, robot, bodies[b], step, lengths[s, b],
                    angles[s, b], angle, rates[s, b], effort, sums,
                )  # fmt: skip
                evaluations[b] += 1
                if not is_over:
                    continue

                # A robot at an end stays there for the rest of the steps.
                last = has_ended(
                    step.accepted.pose[1], step.accepted.pose[2], end_heights[:, b]
                )
                next_step = count if last else s + 1
                for i in range(s, next_step):
                    write_state(states[i, b], step.accepted)
                s = next_step

    return cached(run, f"the steps of robots on ground of the form {Law.__name__}")


def run_steps(
    robots: Robots,
    index,
    start: np.ndarray,
    angles,
    rates,
    lengths,
    end_heights,
    effort: Effort,
    shares=None,
):
    """Return the same states and evaluations as
    `rft.terradynamics.walking.planar.march.run_steps_by_numpy`."""
    elements = robots.elements
    ground = robots.ground_under(index)
    states = np.empty((len(lengths), *start.shape))
    evaluations = np.zeros(len(start), int)
    grounds = np.stack([np.broadcast_to(x, len(index)) for x in ground[:-1]], -1)
    bodies = np.column_stack(
        [robots.masses[index][:, [0, 2]], robots.reach[index], robots.gravity[index]]
    )

    # The belly is the last "leg" and does not rotate.
    angles = np.concatenate([angles, np.zeros_like(angles[..., :1])], -1)
    rates = np.concatenate([rates, np.zeros_like(rates[..., :1])], -1)

    table, blocks = elements.table
    hips = np.ascontiguousarray(elements.hips[:, index])
    if shares is None:
        shares = np.ones((len(index), len(robots.leg_phases)))
    of_parts = np.ascontiguousarray(elements.shares_of_parts(shares))
    kernel(type(elements.law))(
        tuple(elements.law),
        grounds,
        ground.disturbed,
        (table, blocks[index], hips, of_parts),
        (elements.side, elements.leg, elements.closed),
        bodies,
        np.ascontiguousarray(start),
        (angles, rates),
        lengths,
        end_heights,
        effort,
        states,
        evaluations,
    )
    return states, evaluations
