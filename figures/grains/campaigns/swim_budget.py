"""Which forces make a swim in grains longer or shorter than the direct tier says, as a
CSV file.

    python -m figures.grains.campaigns.swim_budget STORE

STORE is the folder of runs of `figures.grains.campaigns.grains`; swims that are not whole
there are left out, none is computed.

At every phase the law is evaluated at the velocity xi that the body had in the grains.
The forces of the grains minus those of the law sum to a wrench on every part of the
body. With W(xi) the wrench of the law, W(xi_0) = 0 in its own balance and W(xi) = -sum
of the parts (the momentum of the body is one of them). With J the mean of dW/dxi
between xi_0 and xi,

    xi - xi_0 = -J^-1 sum of the parts,

so that each part has its share of xi - xi_0, and by the integral over the cycle of the
difference in displacement. What the quadratures of J and of the displacement leave is
the row "rest".

Where the connection A is singular in x and y, no joint rates move the body in one
direction. The row "near a singularity" has what the quarter of the cycle with the
smallest singular values of A there adds to the difference; it is part of the others.
The rows "flank across, 3 mm" are no distances but the force of the grains on the flank
over that of the law, both across and towards where the drag points, while it has moved
by up to 3 mm since its last reversal, and more than the row before."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from figures.grains.campaigns.grains import BEDS, FOLDER, SWIMS, swim
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
NODES, WEIGHTS = (
    x / 2 + 0.5 * (k == 0) for k, x in enumerate(np.polynomial.legendre.leggauss(6))
)
TRAVELS = 1, 2, 3, 6, 9, 15, 40  # mm since a reversal
DIRECTIONS = (
    2 * np.pi * (np.arange(24) + 0.5) / 24
)  # of joint rates, to which A is fitted
COLUMNS = "scene", "amplitude", "frequency_Hz", "bed", "cycle", "part", "value"


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
        return np.stack(
            [f.real.sum(1), f.imag.sum(1), (self.place.conj() * f).imag.sum(1)], 1
        )


def points(question: GrainSwim, phases: int = PHASES) -> Points:
    """Return the points of the body at the middles of ``phases`` equal parts of a
    cycle."""
    experiment = question.experiment
    f = question.frequency
    body = experiment.body
    half = experiment.body.half_lengths
    times = (RAMP + (np.arange(phases) + 0.5) / phases) / f
    links = [body.links(*experiment.motion.joint_angles(t)) for t in times]
    heading, rates, centres, velocities = (np.array(x) for x in zip(*links))
    link, at = (
        np.r_[0, body.link, body.n_links - 1],
        np.r_[-half[0], body.offsets[:, 0], half[-1]],
    )
    lever = heading[:, link] * at
    edges = np.r_[
        -body.size / 2, (body.arc_length[1:] + body.arc_length[:-1]) / 2, body.size / 2
    ]
    return Points(
        heading[:, link],
        centres[:, link] + lever,
        velocities[:, link] + 1j * rates[:, link] * lever,
        np.r_[0.0, np.diff(edges), 0.0],
        np.abs(np.r_[-body.size / 2, body.arc_length, body.size / 2])
        > body.size / 2 - END * body.half_width,
    )


def law_forces(body: Points, law: Fit, caps: EndCaps, xi: np.ndarray) -> np.ndarray:
    """Return the forces f_t + i f_n (N, P) of a law and its end caps at body velocities
    xi (N, 3), N."""
    v = body.velocities(xi)
    axial = law.axial_force / law.rod.length
    t, n = law.medium.traction(v.real, v.imag, ROUNDING)
    force = -axial * body.length * (t + 1j * n)
    for tip, e in ((0, caps.tail), (-1, caps.head)):
        t, n = replace(caps, head=e, tail=0.0).traction(
            law.medium, v[:, tip].real, v[:, tip].imag, ROUNDING
        )
        force[:, tip] = -axial * body.length.sum() * (t + 1j * n)
    return force


def measured(
    question: GrainSwim, run: Run, body: Points
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield xi (N, 3), m/s and rad/s, and forces f_t + i f_n (N, P), N, of every cycle,
    as means over the parts of it."""
    phases = len(body.place)
    f = question.frequency
    step = run.t[1] - run.t[0]
    impulse = np.cumsum(run.profile[..., 0] + 1j * run.profile[..., 1], 0) * step
    impulse = np.concatenate([0 * impulse[:1], impulse])
    times = np.r_[run.t[0] - step, run.t]
    for cycle in range(question.cycles):
        edges = (RAMP + cycle + np.arange(phases + 1) / phases) / f
        x, y, theta = (np.interp(edges, run.t, run.pose[:, k]) for k in range(3))
        k = np.clip(np.searchsorted(times, edges) - 1, 0, len(times) - 2)
        part = ((edges - times[k]) / step)[:, None]
        force = (
            np.diff(impulse[k] * (1 - part) + impulse[k + 1] * part, axis=0)
            * phases
            * f
        )
        turn = np.exp(-1j * (theta[1:] + theta[:-1]) / 2)
        v = np.diff(x + 1j * y) * turn * phases * f
        force = np.pad(force, ((0, 0), (1, 1))) * turn[:, None] * body.heading.conj()
        yield np.column_stack([v.real, v.imag, np.diff(theta) * phases * f]), force


def contributions(
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
    slope = sum(
        w * slopes(body, law, caps, xi_0 + node * (xi - xi_0))
        for node, w in zip(NODES, WEIGHTS)
    )
    return {
        name: -np.linalg.solve(slope, wrench[..., None])[..., 0]
        for name, wrench in wrenches.items()
    }


def slopes(body: Points, law: Fit, caps: EndCaps, xi: np.ndarray) -> np.ndarray:
    """Return dW/dxi (N, 3, 3) of the wrench of the law."""
    steps = 2 * ROUNDING * np.diag([1.0, 1.0, 2 / body.length.sum()])
    wrench = lambda x: body.wrench(law_forces(body, law, caps, x))
    return np.stack(
        [(wrench(xi + h) - wrench(xi - h)) / (2 * h.sum()) for h in steps], -1
    )


def distance(xi: np.ndarray, step: float) -> tuple[float, np.ndarray]:
    """Return the distance of a cycle of body velocities xi (N, 3), m, by the midpoint
    rule with ``step`` (s) between phases, and its slopes (N, 3)."""
    heading = np.exp(1j * step * (np.cumsum(xi[:, 2]) - xi[:, 2] / 2))
    moves = step * heading * (xi[:, 0] + 1j * xi[:, 1])
    net = moves.sum()
    to_come = (
        net - np.cumsum(moves) + moves / 2
    )  # which a rotation at a phase carries along
    slopes = step * np.stack([heading, 1j * heading, 1j * to_come], 1)
    return abs(net), (slopes * net.conj() / abs(net)).real


def shares(
    xi_0: np.ndarray, xi: np.ndarray, parts: dict[str, np.ndarray], step: float
) -> dict[str, np.ndarray]:
    """Return the shares (N,) of phases and parts of the body in the difference between
    the distances of xi and xi_0, m."""
    slope = sum(
        w * distance(xi_0 + node * (xi - xi_0), step)[1]
        for node, w in zip(NODES, WEIGHTS)
    )
    found = {name: (slope * part).sum(1) for name, part in parts.items()}
    rest = (
        distance(xi, step)[0]
        - distance(xi_0, step)[0]
        - sum(x.sum() for x in found.values())
    )
    return {**found, "rest": np.full(len(xi), rest / len(xi))}


class Swum(NamedTuple):
    """A cycle. xi_0, xi (N, 3), m/s and rad/s, by the law and in grains. shares (N,),
    m, by part. forces: (2, N, P), N, of the grains and of the law at xi."""

    xi_0: np.ndarray
    xi: np.ndarray
    shares: dict[str, np.ndarray]
    forces: np.ndarray


def budget(question: GrainSwim, run: Run, law: Fit, caps: EndCaps) -> Iterator[Swum]:
    """Yield every cycle beside the direct tier with a law and its end caps."""
    body = points(question)
    f = question.frequency
    size = question.experiment.body.size
    alpha, alphadot = gait(question)
    xi_0 = (
        ruled(question, law, caps).velocity(alpha, alphadot)
        * 2
        * np.pi
        * f
        * [size, size, 1.0]
    )
    for xi, force in measured(question, run, body):
        parts = contributions(body, law, caps, xi_0, xi, force)
        forces = np.array([force, law_forces(body, law, caps, xi)])
        yield Swum(xi_0, xi, shares(xi_0, xi, parts, 1 / (PHASES * f)), forces)


def ruled(question: GrainSwim, law: Fit, caps: EndCaps) -> Swimmer:
    """Return the swimmer with a law and end caps."""
    return replace(question.swimmer, medium=law.medium, effects=(caps,))


def gait(question: GrainSwim) -> tuple[np.ndarray, np.ndarray]:
    """Return shapes and rates (N, joints) at the phases."""
    phases = 2 * np.pi * (np.arange(PHASES) + 0.5) / PHASES
    g = question.scene.gait
    return np.array([g.shape(t) for t in phases]), np.array([g.rate(t) for t in phases])


def near_singular(question: GrainSwim, law: Fit, caps: EndCaps) -> np.ndarray:
    """Return which quarter of the phases (N,) is nearest to shapes where A, fitted by
    least squares over directions, is singular in x and y."""
    rates = np.stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)], -1)
    alpha, _ = np.broadcast_arrays(gait(question)[0][:, None], rates)
    xi = ruled(question, law, caps).velocity(alpha, np.broadcast_to(rates, alpha.shape))
    A = np.linalg.pinv(rates) @ xi[..., :2]
    least = np.linalg.svd(A, compute_uv=False)[:, -1]
    return least <= np.sort(least)[PHASES // 4 - 1]


def recovery(body: Points, swum: Swum, step: float) -> Iterator[float]:
    """Yield the force of the grains across the flank over that of the law, by travel
    since a reversal up to `TRAVELS`."""
    flank = ~body.is_end
    v = body.velocities(swum.xi).imag[:, flank]
    grains, law = swum.forces[..., flank].imag * -np.sign(v)
    travel = np.zeros_like(v)
    since = np.zeros(v.shape[1])
    for k in 2 * list(range(len(v))):  # once more, for what came before the first phase
        since = (
            np.where(np.sign(v[k]) == np.sign(v[k - 1]), since, 0.0)
            + np.abs(v[k]) * step
        )
        travel[k] = since - np.abs(v[k]) * step / 2
    for low, high in zip((0.0, *TRAVELS), TRAVELS):
        inside = (travel > 1e-3 * low) & (travel <= 1e-3 * high)
        yield float(grains[inside].sum() / law[inside].sum())


def rows(store: Path) -> Iterator[tuple]:
    """Yield the distance by the law and in grains, and the shares of parts, body
    lengths, for swims that are in the store."""
    yield COLUMNS
    law = rod_fit(FLANK, end_caps="fitted")
    for scene, amplitude, frequency in SWIMS:
        questions = [swim(scene, amplitude, frequency, seed) for seed in BEDS]
        for question in questions:
            body = question.experiment.body
            if question.experiment.steps_left(store):
                continue
            run = question.experiment.run(store)
            step = 1 / (PHASES * frequency)
            caps = law.caps(body.half_width / body.size)
            points_of = points(question)
            near = (
                near_singular(question, law, caps)
                if body.joints == 2
                else np.zeros(PHASES, bool)
            )
            for cycle, swum in enumerate(budget(question, run, law, caps), 1):
                found = {
                    "law": distance(swum.xi_0, step)[0],
                    "grains": distance(swum.xi, step)[0],
                }
                found |= {part: x.sum() for part, x in swum.shares.items()}
                found["near a singularity"] = sum(
                    x[near].sum() for x in swum.shares.values()
                )
                ratios = zip(TRAVELS, recovery(points_of, swum, step))
                of_length = {part: x / body.size for part, x in found.items()}
                for part, x in (
                    of_length | {f"flank across, {t} mm": x for t, x in ratios}
                ).items():
                    yield (
                        scene,
                        amplitude,
                        frequency,
                        question.seed,
                        cycle,
                        f'"{part}"',
                        float(x),
                    )


def main(store: str) -> None:
    """Compute the budgets and write the file."""
    lines = ["# python -m figures.grains.campaigns.swim_budget STORE"]
    lines += [
        ",".join(f"{x:.5g}" if isinstance(x, float) else str(x) for x in row)
        for row in rows(Path(store))
    ]
    write_text(FOLDER / "grains_swim_budget.csv", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
