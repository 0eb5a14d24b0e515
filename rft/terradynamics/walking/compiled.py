"""Steps in time in compiled code, one robot after the other. Importing this module
loads numba."""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.formulas.newton import plus, times
from rft.formulas.simd import WIDTH, register_formulas
from rft.terradynamics.ground import Ground
from rft.terradynamics.plates.compiled import on_elements
from rft.terradynamics.walking.elements import BodyLoad, body_load, part_motion
from rft.terradynamics.walking.planar import Robots, difference_steps, stage_residual
from rft.terradynamics.walking.sdirk import (
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
def added(a, b):
    """Return the sum of two loads on a body."""
    return BodyLoad(
        a.f_x + b.f_x, a.f_z + b.f_z, a.moment + b.moment, a.motor_power + b.motor_power, a.ground_power + b.ground_power
    )  # fmt: skip


@register_jitable(error_model="numpy")
def on_robot(law, ground, disturbed, robot, pose, twist, angle, rate, sums):
    """Return the `BodyLoad` on one robot: table, blocks, sides, legs and closed of its
    parts, and their hips (2, P)."""
    table, blocks, side, leg, closed, hips = robot
    total = BodyLoad(0.0, 0.0, 0.0, 0.0, 0.0)
    strength, flux, rounding, grazing_sine, downhill_loss = ground
    for p in range(len(side)):
        leg_rate = rate[leg[p]]
        g, r_x, r_z = part_motion(
            pose, twist, hips[0, p], hips[1, p], angle[leg[p]], leg_rate
        )
        part_ground = Ground(
            strength, flux, rounding, grazing_sine * closed[p], downhill_loss, disturbed
        )
        f = on_elements(
            law, part_ground, table, blocks[p, 0], blocks[p, 1], g, side[p], True, sums
        )
        total = added(total, body_load(f, g, r_x, r_z, leg_rate))
    return total


@register_jitable(error_model="numpy")
def difference(residual, changed, nudge):
    """Return (changed - residual) / nudge of triples."""
    return (
        (changed[0] - residual[0]) / nudge,
        (changed[1] - residual[1]) / nudge,
        (changed[2] - residual[2]) / nudge,
    )


@register_jitable(error_model="numpy")
def residual_of(law, ground, disturbed, robot, body, step, k, angle, rate, sums):
    """Return the residual of a robot's stage at its trial, the residual's slopes, three
    columns, and the powers."""
    mass, inertia, reach = body
    nudge = difference_steps(ground[2], reach)
    residual = by_x = by_z = by_pitch = (0.0, 0.0, 0.0)
    power = (0.0, 0.0)
    for c in range(4):
        change = (
            nudge[0] if c == 1 else 0.0,
            nudge[1] if c == 2 else 0.0,
            nudge[2] if c == 3 else 0.0,
        )
        v = plus(step.newton.trial, change)
        pose = plus(step.stage.base, times(k, v))
        load = on_robot(law, ground, disturbed, robot, pose, v, angle, rate, sums)
        changed = stage_residual(load, v, step.stage.start, k, mass, inertia)
        if c == 0:
            residual = changed
            power = (load.motor_power, load.ground_power)
        elif c == 1:
            by_x = difference(residual, changed, nudge[0])
        elif c == 2:
            by_z = difference(residual, changed, nudge[1])
        else:
            by_pitch = difference(residual, changed, nudge[2])
    return residual, (by_x, by_z, by_pitch), power


@register_jitable
def store(out, state):
    """Write an accepted state into a row (11,)."""
    out[0], out[1], out[2] = state.pose
    out[3], out[4], out[5] = state.twist
    out[6] = state.work
    out[7] = state.loss
    out[8] = state.unsolved
    out[9] = state.defect
    out[10] = state.residual


@functools.cache
def kernel(Law: type):
    """Return the compiled stepper for stress maps whose records have one class."""
    register_formulas()

    @njit(nogil=True, error_model="numpy")
    def run(
        numbers,
        grounds,
        disturbed,
        elements,
        parts,
        bodies,
        start,
        clock,
        lengths,
        ends,
        effort,
        states,
        tries,
    ):
        law = Law(*numbers)
        sums = np.zeros((3, WIDTH))
        count = len(lengths)
        (table, blocks, hips), (side, leg, closed), (angles, rates) = (
            elements,
            parts,
            clock,
        )
        angle = np.zeros(angles.shape[2])
        for b in range(len(start)):
            x = start[b]
            step = start_of_step(
                (x[0], x[1], x[2]), (x[3], x[4], x[5]), x[6], x[7], x[8], x[9], x[10]
            )
            robot = (table, blocks[b], side, leg, closed, hips[:, b])
            reach = bodies[b][2]
            strength, flux, rounding, grazing_sine, downhill_loss = grounds[b]
            s = 0
            while s < count:
                rate = rates[s, b]
                time = stage_time(step.stage) * lengths[s, b]
                for j in range(len(angle)):
                    angle[j] = angles[s, b, j] + time * rate[j]
                h = step.stage.part * lengths[s, b]
                width = effort.widths[int(step.newton.width), 0]
                over = False
                k = GAMMA * h
                tolerance = TOLERANCE * (rounding * width)
                ground = (
                    strength,
                    flux,
                    rounding * width,
                    grazing_sine * np.sqrt(width),
                    downhill_loss,
                )
                evaluation = residual_of(
                    law, ground, disturbed, robot, bodies[b], step, k, angle, rate, sums
                )
                residual, slopes, power = evaluation
                newton, solved, failed = newton_step(
                    step.newton, residual, slopes, power, k, reach, tolerance, effort
                )
                step = Step(step.accepted, step.stage, newton)
                if solved or failed:
                    step, over = next_problem(
                        step, solved, failed, tolerance, k, h, effort
                    )
                tries[b] += 1
                if over:
                    last = has_ended(
                        step.accepted.pose[1], step.accepted.pose[2], ends[:, b]
                    )
                    for i in range(s, count if last else s + 1):
                        store(states[i, b], step.accepted)
                    s = count if last else s + 1

    return cached(run, f"the steps of robots on ground of the form {Law.__name__}")


def run_steps(
    robots: Robots,
    index,
    start: np.ndarray,
    angles,
    rates,
    lengths,
    ends,
    effort: Effort,
):
    """Return (states, evaluations): the same as
    `rft.terradynamics.walking.march.run_steps_by_numpy`."""
    elements = robots.elements
    ground = robots.ground_under(index)
    states = np.empty((len(lengths), *start.shape))
    tries = np.zeros(len(start), int)
    grounds = np.stack([np.broadcast_to(x, len(index)) for x in ground[:-1]], -1)
    bodies = np.stack(
        [robots.masses[index, 0], robots.masses[index, 2], robots.reach[index]], -1
    )
    # The belly is the last "leg" and does not rotate.
    angles, rates = (
        np.concatenate([x, np.zeros_like(x[..., :1])], -1) for x in (angles, rates)
    )
    (table, blocks), hips = (
        elements.table,
        np.ascontiguousarray(elements.hips[:, index]),
    )
    kernel(type(elements.law))(
        tuple(elements.law), grounds, ground.disturbed, (table, blocks[index], hips),
        (elements.side, elements.leg, elements.closed), bodies, np.ascontiguousarray(start), (angles, rates), lengths, ends,
        effort, states, tries,
    )  # fmt: skip
    return states, tries
