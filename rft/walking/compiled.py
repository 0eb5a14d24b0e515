"""Steps in time in compiled code, one robot after the other. Importing this module loads numba."""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.balance.newton import plus, times
from rft.ground import Ground
from rft.plates.compiled import on_elements
from rft.simd import WIDTH, register_formulas
from rft.walking.elements import Sums, on_body, part_motion
from rft.walking.planar import Robots, imbalance, nudges
from rft.walking.sdirk import GAMMA, SOLVED, Effort, advanced, begun, ended, judged, when


@register_jitable
def added(a, b):
    """Return the sum of two `Sums`."""
    return Sums(a.f_x + b.f_x, a.f_z + b.f_z, a.moment + b.moment, a.motors + b.motors, a.into + b.into)


@register_jitable
def differences(off, change, nudge):
    """Return (change - off) / nudge of triples."""
    return (change[0] - off[0]) / nudge, (change[1] - off[1]) / nudge, (change[2] - off[2]) / nudge


@functools.cache
def kernel(Law: type):
    """Return the compiled stepper for maps of one form, which is the class of their records."""
    register_formulas()

    @njit(nogil=True, error_model="numpy")
    def on_robot(law, ground, disturbed, table, blocks, parts, hips, pose, twist, angle, rate, sums):
        """Return the sums over the parts of one robot."""
        total = Sums(0.0, 0.0, 0.0, 0.0, 0.0)
        side, leg, closed = parts
        strength, flux, rounding, sine, fall = ground
        for p in range(len(side)):
            turns = rate[leg[p]]
            at, r_x, r_z = part_motion(pose, twist, hips[0, p], hips[1, p], angle[leg[p]], turns)
            under = Ground(strength, flux, rounding, sine * closed[p], fall, disturbed)
            f = on_elements(law, under, table, blocks[p, 0], blocks[p, 1], at, side[p], True, sums)
            total = added(total, on_body(f, at, r_x, r_z, turns))
        return total

    @njit(nogil=True, error_model="numpy")
    def stepped(numbers, grounds, disturbed, own, parts, bodies, state, clock, lengths, ends, effort, states, tries):
        law, sums, count = Law(*numbers), np.zeros((3, WIDTH)), len(lengths)
        (table, blocks, hips), (angles, rates) = own, clock
        angle = np.zeros(angles.shape[2])
        for b in range(len(state)):
            x = state[b]
            w = begun((x[0], x[1], x[2]), (x[3], x[4], x[5]), x[6], x[7], x[8], x[9], x[10])
            mass, inertia, reach = bodies[b]
            strength, flux, narrow, sine, fall = grounds[b]
            s = 0
            while s < count:
                h, passed = w.part * lengths[s, b], when(w) * lengths[s, b]
                rate = rates[s, b]
                for j in range(len(angle)):
                    angle[j] = angles[s, b, j] + passed * rate[j]
                width, k = effort.widths[int(w.width), 0], GAMMA * h
                rounding = narrow * width
                ground, nudge = (strength, flux, rounding, sine * np.sqrt(width), fall), nudges(rounding, reach)
                off = by_x = by_z = by_pitch = (0.0, 0.0, 0.0)
                power, solved, over = (0.0, 0.0), SOLVED * rounding, False
                for c in range(4):
                    change = (nudge[0] if c == 1 else 0.0, nudge[1] if c == 2 else 0.0, nudge[2] if c == 3 else 0.0)
                    v = plus(w.trial, change)
                    pose = plus(w.base, times(k, v))
                    f = on_robot(
                        law, ground, disturbed, table, blocks[b], parts, hips[:, b], pose, v, angle, rate, sums
                    )
                    lacking = imbalance(f, v, w.start, k, mass, inertia)
                    if c == 0:
                        off, power = lacking, (f.motors, f.into)
                    elif c == 1:
                        by_x = differences(off, lacking, nudge[0])
                    elif c == 2:
                        by_z = differences(off, lacking, nudge[1])
                    else:
                        by_pitch = differences(off, lacking, nudge[2])
                w, good, lost = judged(w, off, (by_x, by_z, by_pitch), power, k, reach, solved, effort)
                if good or lost:
                    w, over = advanced(w, good, lost, solved, k, h, effort)
                tries[b] += 1
                if over:
                    last = ended(w.pose[1], w.pose[2], ends[:, b])
                    for i in range(s, count if last else s + 1):
                        out = states[i, b]
                        out[0], out[1], out[2] = w.pose
                        out[3], out[4], out[5] = w.twist
                        out[6], out[7], out[8], out[9], out[10] = w.work, w.loss, w.unsolved, w.defect, w.residual
                    s = count if last else s + 1

    return cached(stepped, f"the steps of robots on ground of the form {Law.__name__}")


def stepped(robots: Robots, which, state: np.ndarray, angles, rates, lengths, ends, effort: Effort):
    """As `rft.walking.march.stepped_by_numpy`."""
    own, ground = robots.elements, robots.ground_under(which)
    states, tries = np.empty((len(lengths), *state.shape)), np.zeros(len(state), int)
    grounds = np.stack([np.broadcast_to(x, len(which)) for x in ground[:-1]], -1)
    bodies = np.stack([robots.weighed[which, 0], robots.weighed[which, 2], robots.reach[which]], -1)
    with_belly = lambda x: np.concatenate([x, np.zeros_like(x[..., :1])], -1)
    (table, blocks), hips = own.table, np.ascontiguousarray(own.hips[:, which])
    kernel(type(own.law))(
        tuple(own.law), grounds, ground.disturbed, (table, blocks[which], hips), (own.side, own.leg, own.closed), bodies,
        np.ascontiguousarray(state), (with_belly(angles), with_belly(rates)), lengths, ends, effort, states, tries,
    )  # fmt: skip
    return states, tries
