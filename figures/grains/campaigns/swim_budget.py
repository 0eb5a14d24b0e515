"""The forces that make a swim in grains longer or shorter than by the direct tier, as a
CSV file.

    python -m figures.grains.campaigns.swim_budget STORE

STORE is the folder of runs of `figures.grains.campaigns.grains`; swims that are not
complete there are left out, none is computed.

At every phase the law is evaluated at the velocity xi that the body had in the grains.
The forces of the grains minus those of the law sum to a wrench on every part of the
body. With W(xi) the wrench of the law, W(xi_0) = 0 in its own balance and W(xi) = -sum
of the parts (the momentum of the body is one of them). With J the mean of dW/dxi
between xi_0 and xi,

    xi - xi_0 = -J^-1 sum of the parts,

so that each part has its share of xi - xi_0, and, by the integral over the cycle, of
the difference in displacement. The row "rest" has the errors of the quadratures of J
and of the displacement.

Where the connection A is singular in x and y, no joint rates move the body in one
direction. The row "near a singularity" has the contribution of the quarter of the cycle
with the smallest singular values of A there; it is part of the others. The rows "flank
across, 3 mm" are no distances but ratios: the force of the grains on the flank over
that of the law, both across and against the motion, where the flank has moved by up to
3 mm since its last reversal, and by more than in the row before."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from figures.grains.campaigns.grains import (
    BEDS,
    FOLDER,
    SWIMS,
    csv_line,
    quoted,
    swim_question,
)
from geomech.io.files import write_text
from geomech.mathematics.systems.swimmer import Swimmer
from geomech.studies.grains.swim import FLANK, RAMP, GrainSwim
from geomech.studies.terradynamics.calibration import rod_fit
from rft.effects import EndCaps
from rft.fits.rods import Fit
from rft.grains.drag import END
from rft.grains.experiment import Run

PHASES = 64
# m/s, below which dry friction is linear here; points of the body move at some 0.1 m/s
ROUNDING = 1e-4
# of the Gauss-Legendre rule on the unit interval
NODES = (np.polynomial.legendre.leggauss(6)[0] + 1) / 2
WEIGHTS = np.polynomial.legendre.leggauss(6)[1] / 2
TRAVELS = (1, 2, 3, 6, 9, 15, 40)  # mm since a reversal
# of joint rates, to which A is fitted
DIRECTIONS = 2 * np.pi * (np.arange(24) + 0.5) / 24
COLUMNS = ("scene", "amplitude", "frequency_Hz", "bed", "cycle", "part", "value")


class Points(NamedTuple):
    """Points of a body at N phases: its spheres from tail to head, between the tips of
    its tail and its head.

    heading (N, P): exp(i heading) of their links in the body frame. place, velocity
    (N, P): in the frame at rest, m and m/s. length (P,): of body that each stands for,
    m, 0 of a tip. is_end (P,): within `END` half widths of a tip."""

    heading: np.ndarray
    place: np.ndarray
    velocity: np.ndarray
    length: np.ndarray
    is_end: np.ndarray

    def velocities(self, xi: np.ndarray) -> np.ndarray:
        """Return v_t + i v_n (N, P), m/s, at body velocities xi (N, 3), m/s and
        rad/s."""
        v = (xi[:, :1] + 1j * xi[:, 1:2]) + 1j * xi[:, 2:] * self.place + self.velocity
        return v * self.heading.conj()

    def wrench(self, force: np.ndarray) -> np.ndarray:
        """Return force, N, and moment about the frame's origin, N m, (N, 3) of forces
        f_t + i f_n (N, P), N."""
        f = force * self.heading
        moment = (self.place.conj() * f).imag
        return np.stack([f.real.sum(1), f.imag.sum(1), moment.sum(1)], 1)


def points(question: GrainSwim, phases: int = PHASES) -> Points:
    """Return the points of the body at the middles of ``phases`` equal parts of a
    cycle."""
    body = question.experiment.body
    half = body.half_lengths
    times = (RAMP + (np.arange(phases) + 0.5) / phases) / question.frequency
    motion = question.experiment.motion
    links = [body.links(*motion.joint_angles(t)) for t in times]
    heading, rates, centres, velocities = (np.array(x) for x in zip(*links))

    # The tip of the tail, the spheres and the tip of the head.
    link = np.r_[0, body.link, body.n_links - 1]
    offset = np.r_[-half[0], body.offsets[:, 0], half[-1]]
    lever = heading[:, link] * offset

    # Each sphere stands for the body up to the middles between it and its neighbours.
    tail = -body.size / 2
    head = body.size / 2
    middles = (body.arc_length[1:] + body.arc_length[:-1]) / 2
    length = np.diff(np.r_[tail, middles, head])
    from_middle = np.abs(np.r_[tail, body.arc_length, head])
    return Points(
        heading=heading[:, link],
        place=centres[:, link] + lever,
        velocity=velocities[:, link] + 1j * rates[:, link] * lever,
        length=np.r_[0.0, length, 0.0],
        is_end=from_middle > head - END * body.half_width,
    )


def law_forces(body: Points, law: Fit, caps: EndCaps, xi: np.ndarray) -> np.ndarray:
    """Return the forces f_t + i f_n (N, P) of a law and its end caps at body velocities
    xi (N, 3), N."""
    v = body.velocities(xi)
    axial = law.axial_force / law.rod.length
    t, n = law.medium.traction(v.real, v.imag, ROUNDING)
    force = -axial * body.length * (t + 1j * n)
    for tip, e in ((0, caps.tail), (-1, caps.head)):
        cap = replace(caps, head=e, tail=0.0)
        v_tip = v[:, tip]
        t, n = cap.traction(law.medium, v_tip.real, v_tip.imag, ROUNDING)
        force[:, tip] = -axial * body.length.sum() * (t + 1j * n)
    return force


def measured_cycles(
    question: GrainSwim, run: Run, body: Points
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield xi (N, 3), m/s and rad/s, and forces f_t + i f_n (N, P), N, of every cycle,
    as means over the N equal parts of it."""
    phases = len(body.place)
    f = question.frequency
    step = run.t[1] - run.t[0]
    impulse = np.cumsum(run.profile[..., 0] + 1j * run.profile[..., 1], 0) * step
    impulse = np.concatenate([0 * impulse[:1], impulse])
    times = np.r_[run.t[0] - step, run.t]
    for cycle in range(question.cycles):
        edges = (RAMP + cycle + np.arange(phases + 1) / phases) / f
        x, y, theta = (np.interp(edges, run.t, run.pose[:, k]) for k in range(3))

        # The mean force is the difference of the impulse, which is interpolated.
        k = np.clip(np.searchsorted(times, edges) - 1, 0, len(times) - 2)
        weight = ((edges - times[k]) / step)[:, None]
        impulse_at_edges = impulse[k] * (1 - weight) + impulse[k + 1] * weight
        force = np.diff(impulse_at_edges, axis=0) * phases * f

        # From the frame at rest to the body frame, and to the links.
        turn = np.exp(-1j * (theta[1:] + theta[:-1]) / 2)
        v = np.diff(x + 1j * y) * turn * phases * f
        force = np.pad(force, ((0, 0), (1, 1))) * turn[:, None] * body.heading.conj()
        yield np.column_stack([v.real, v.imag, np.diff(theta) * phases * f]), force


def velocity_shares(
    body: Points,
    law: Fit,
    caps: EndCaps,
    xi_0: np.ndarray,
    xi: np.ndarray,
    force: np.ndarray,
) -> dict[str, np.ndarray]:
    """Return the shares (N, 3) of xi - xi_0 by part of the body; xi_0 (N, 3): of the
    balance of the law."""
    excess = force - law_forces(body, law, caps, xi)
    ends = body.is_end
    wrenches = {
        "ends, along": body.wrench(np.where(ends, excess.real, 0.0)),
        "ends, across": body.wrench(np.where(ends, 1j * excess.imag, 0.0)),
        "flank, along": body.wrench(np.where(ends, 0.0, excess.real)),
        "flank, across": body.wrench(np.where(ends, 0.0, 1j * excess.imag)),
        "mass of the body": -body.wrench(force),
    }
    slope = 0.0
    for node, weight in zip(NODES, WEIGHTS):
        xi_node = xi_0 + node * (xi - xi_0)
        slope += weight * wrench_slopes(body, law, caps, xi_node)
    shares = {}
    for name, wrench in wrenches.items():
        shares[name] = -np.linalg.solve(slope, wrench[..., None])[..., 0]
    return shares


def wrench_slopes(body: Points, law: Fit, caps: EndCaps, xi: np.ndarray) -> np.ndarray:
    """Return dW/dxi (N, 3, 3) of the wrench of the law."""

    def wrench(xi):
        return body.wrench(law_forces(body, law, caps, xi))

    steps = 2 * ROUNDING * np.diag([1.0, 1.0, 2 / body.length.sum()])
    columns = [(wrench(xi + h) - wrench(xi - h)) / (2 * h.sum()) for h in steps]
    return np.stack(columns, -1)


def distance(xi: np.ndarray, step: float) -> tuple[float, np.ndarray]:
    """Return the distance of a cycle of body velocities xi (N, 3), m, by the midpoint
    rule with ``step`` (s) between phases, and its slopes (N, 3)."""
    heading = np.exp(1j * step * (np.cumsum(xi[:, 2]) - xi[:, 2] / 2))
    moves = step * heading * (xi[:, 0] + 1j * xi[:, 1])
    net = moves.sum()
    # A rotation at a phase rotates the rest of the path.
    rest_of_path = net - np.cumsum(moves) + moves / 2
    slopes = step * np.stack([heading, 1j * heading, 1j * rest_of_path], 1)
    return abs(net), (slopes * net.conj() / abs(net)).real


def distance_shares(
    xi_0: np.ndarray, xi: np.ndarray, parts: dict[str, np.ndarray], step: float
) -> dict[str, np.ndarray]:
    """Return the shares (N,) of phases and parts of the body in the difference between
    the distances of xi and xi_0, m."""
    slope = 0.0
    for node, weight in zip(NODES, WEIGHTS):
        slope += weight * distance(xi_0 + node * (xi - xi_0), step)[1]
    shares = {name: (slope * part).sum(1) for name, part in parts.items()}
    difference = distance(xi, step)[0] - distance(xi_0, step)[0]
    rest = difference - sum(share.sum() for share in shares.values())
    return {**shares, "rest": np.full(len(xi), rest / len(xi))}


class CycleBudget(NamedTuple):
    """A cycle in grains and by the law.

    xi_0, xi (N, 3): body velocities by the law and in grains, m/s and rad/s. shares
    (N,): m, by part. forces (2, N, P): N, of the grains and of the law at xi."""

    xi_0: np.ndarray
    xi: np.ndarray
    shares: dict[str, np.ndarray]
    forces: np.ndarray


def budget(
    question: GrainSwim, run: Run, law: Fit, caps: EndCaps
) -> Iterator[CycleBudget]:
    """Yield every cycle, compared with the direct tier by a law and its end caps."""
    body = points(question)
    f = question.frequency
    size = question.experiment.body.size
    swimmer = swimmer_with_law(question, law, caps)
    # From body lengths and rad per rad of phase to m/s and rad/s.
    xi_0 = swimmer.velocity(*gait_samples(question)) * 2 * np.pi * f * [size, size, 1.0]
    for xi, force in measured_cycles(question, run, body):
        parts = velocity_shares(body, law, caps, xi_0, xi, force)
        shares = distance_shares(xi_0, xi, parts, 1 / (PHASES * f))
        forces = np.array([force, law_forces(body, law, caps, xi)])
        yield CycleBudget(xi_0, xi, shares, forces)


def swimmer_with_law(question: GrainSwim, law: Fit, caps: EndCaps) -> Swimmer:
    """Return the swimmer with a law and end caps."""
    return replace(question.swimmer, medium=law.medium, effects=(caps,))


def gait_samples(question: GrainSwim) -> tuple[np.ndarray, np.ndarray]:
    """Return shapes and rates (N, joints) at the phases."""
    phases = 2 * np.pi * (np.arange(PHASES) + 0.5) / PHASES
    gait = question.scene.gait
    shapes = np.array([gait.shape(t) for t in phases])
    rates = np.array([gait.rate(t) for t in phases])
    return shapes, rates


def near_singular(question: GrainSwim, law: Fit, caps: EndCaps) -> np.ndarray:
    """Return a mask (N,) of the quarter of the phases with shapes nearest to those
    where A, fitted by least squares over directions, is singular in x and y; of no
    phase for a number of joints other than two."""
    if question.experiment.body.joints != 2:
        return np.zeros(PHASES, bool)
    rates = np.stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)], -1)
    shapes, _ = gait_samples(question)
    alpha, alphadot = np.broadcast_arrays(shapes[:, None], rates)
    xi = swimmer_with_law(question, law, caps).velocity(alpha, alphadot)
    A = np.linalg.pinv(rates) @ xi[..., :2]
    least = np.linalg.svd(A, compute_uv=False)[:, -1]
    return least <= np.sort(least)[PHASES // 4 - 1]


def recovery(body: Points, cycle: CycleBudget, step: float) -> Iterator[float]:
    """Yield the force of the grains across the flank over that of the law, by travel
    since a reversal up to `TRAVELS`; step (s): between phases."""
    flank = ~body.is_end
    v = body.velocities(cycle.xi).imag[:, flank]
    grains, law = cycle.forces[..., flank].imag * -np.sign(v)
    travel = travel_since_reversal(v, step)
    for low, high in zip((0.0, *TRAVELS), TRAVELS):
        inside = (travel > 1e-3 * low) & (travel <= 1e-3 * high)
        yield float(grains[inside].sum() / law[inside].sum())


def travel_since_reversal(v: np.ndarray, step: float) -> np.ndarray:
    """Return the travel (N, P), m, since the sign of velocities v (N, P), m/s, changed
    last, at the middles of the phases of a cycle that repeats."""
    travel = np.zeros_like(v)
    since = np.zeros(v.shape[1])
    # Twice round the cycle: the first phases need the travel of the last ones.
    for k in 2 * list(range(len(v))):
        has_same_sign = np.sign(v[k]) == np.sign(v[k - 1])
        since = np.where(has_same_sign, since, 0.0) + np.abs(v[k]) * step
        travel[k] = since - np.abs(v[k]) * step / 2
    return travel


def rows(store: Path) -> Iterator[tuple]:
    """Yield the distance by the law and in grains, and the shares of parts, body
    lengths, for swims that are in the store."""
    yield COLUMNS
    law = rod_fit(FLANK, end_caps="fitted")
    for scene, amplitude, frequency in SWIMS:
        for seed in BEDS:
            question = swim_question(scene, amplitude, frequency, seed)
            if question.experiment.steps_left(store):
                continue
            run = question.experiment.run(store)
            for cycle, values in enumerate(cycle_values(question, run, law), 1):
                case = (scene, amplitude, frequency, seed, cycle)
                for part, value in values.items():
                    yield *case, quoted(part), float(value)


def cycle_values(question: GrainSwim, run: Run, law: Fit) -> Iterator[dict[str, float]]:
    """Yield, for every cycle, the values in the file by part."""
    body = question.experiment.body
    caps = law.caps(body.half_width / body.size)
    step = 1 / (PHASES * question.frequency)
    is_near = near_singular(question, law, caps)
    body_points = points(question)
    for cycle in budget(question, run, law, caps):
        metres = {
            "law": distance(cycle.xi_0, step)[0],
            "grains": distance(cycle.xi, step)[0],
        }
        for part, share in cycle.shares.items():
            metres[part] = share.sum()
        near_shares = [share[is_near].sum() for share in cycle.shares.values()]
        metres["near a singularity"] = sum(near_shares)

        values = {part: x / body.size for part, x in metres.items()}
        ratios = recovery(body_points, cycle, step)
        for travel, ratio in zip(TRAVELS, ratios):
            values[f"flank across, {travel} mm"] = ratio
        yield values


def main(store: str) -> None:
    """Compute the budgets and write the file."""
    lines = ["# python -m figures.grains.campaigns.swim_budget STORE"]
    for row in rows(Path(store)):
        lines.append(csv_line(row))
    write_text(FOLDER / "grains_swim_budget.csv", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
