"""The table of the validation page: numbers of geomech beside published ones, computed
while the site is built.

`python .docs/made/validation.py` prints the table alone.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import sympy as sp
from scipy.integrate import quad, solve_ivp

import geomech
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry import metric
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.minimum_perturbation import minimum_perturbation
from geomech.mathematics.symbolic import velocity, viscous_chain
from geomech.mathematics.symbolic.connections import links
from geomech.mathematics.tiers.area import area
from geomech.studies.mechanics import undulation
from rft.terradynamics.plates import VERTICAL

SWIMMER = "viscous three-link swimmer"
CLOSED = "the connection in closed form by sympy, integrated by SciPy to 1e-12"


def table() -> str:
    """Return the rows of all checks as a Markdown table."""
    rows = [
        row
        for check in (viscous_geometry, viscous_cost, strokes, stress, waves)
        for row in check()
    ]
    lines = [
        f"| {check} | {source} | {ours} | {theirs} |"
        for check, source, ours, theirs in rows
    ]
    return "\n".join(
        [
            "| quantity | reference | geomech | reference value |",
            "|---|---|---|---|",
            *lines,
        ]
    )


def viscous_geometry():
    """Yield the CCF and the area of the viscous swimmer in its minimum-perturbation
    frame, and its true displacement."""
    study = geomech.Study(
        geomech.load("three-link-viscous").with_numerics(grid=31, extent=2.5)
    ).tables
    field = dataclasses.replace(
        study.fitted, A=minimum_perturbation(study.fitted).connection(study.fitted)
    )
    source = "an earlier computation on a coarser discretisation, 31 x 31"
    curvature = ccf(field)
    yield (
        f"{SWIMMER}, minimum-perturbation frame: CCF_x(0, 0)",
        source,
        _(curvature([0.0, 0.0])[0], 5),
        "-0.0204",
    )
    moved = area(curvature, Circle(), [1.0])[0]
    yield (
        f"{SWIMMER}, minimum-perturbation frame: area integral over the circle of"
        " 1 rad (BL)",
        source,
        _(np.hypot(*moved[:2]), 4),
        "0.0510",
    )
    net = study.poses("direct", Circle(), [1.0])[0]
    yield (
        f"{SWIMMER}: net distance on the circle of 1 rad by the balance of forces (BL)",
        CLOSED,
        _(np.hypot(*net[:2]), 6),
        _(closed_distance(), 6),
    )


def viscous_cost():
    """Yield the dissipation metric of the straight viscous swimmer and the path length
    of a circle."""
    study = geomech.Study(geomech.load("three-link-viscous")).tables
    M = study.metric.field([0.0, 0.0])
    source = (
        "metric in the system that sysplotter saves; the closed forms are 16/2187 and"
        " 11/2187"
    )
    yield (
        f"{SWIMMER}: dissipation metric M(0, 0), diagonal entry",
        source,
        _(M.ravel()[0], 7),
        "0.0073160",
    )
    yield (
        f"{SWIMMER}: dissipation metric M(0, 0), off-diagonal entry",
        source,
        _(M.ravel()[1], 7),
        "0.0050297",
    )
    length = metric.path_length(study.metric.norm, Circle(), [1.0])[0]
    yield (
        f"{SWIMMER}: path length of the circle of 1 rad",
        CLOSED,
        _(length, 6),
        _(closed_path_length(), 6),
    )


def closed_distance() -> float:
    """Return the net distance of the viscous swimmer on the circle of 1 rad, without a
    balance of forces."""
    xi = velocity(*viscous_chain())

    def rate(t, pose):
        x, y, turn = xi(*_on_circle(t))
        c, s = np.cos(pose[2]), np.sin(pose[2])
        return [c * x - s * y, s * x + c * y, turn]

    path = solve_ivp(
        rate, (0.0, 2 * np.pi), [0.0, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-14
    )
    return float(np.hypot(*path.y[:2, -1]))


def closed_path_length() -> float:
    """Return the path length of the same circle: sqrt(power) by the drag of links on
    their velocities J A + B."""
    A, alpha = viscous_chain()
    third = sp.Rational(1, 3)
    drag = sp.diag(
        third, 2 * third, 2 * third**3 / 12
    )  # along, across and about the centre of a link
    columns = [link.J * A + link.B for link in links((1, 1, 1), 2)]
    M = sp.lambdify(alpha, sum((v.T * drag * v for v in columns), sp.zeros(2, 2)))

    def norm(t):
        shape, rate = _on_circle(t)
        return np.sqrt(rate @ np.array(M(*shape), float) @ rate)

    return quad(norm, 0.0, 2 * np.pi, epsabs=1e-12, limit=400)[0]


def _on_circle(t: float) -> tuple[np.ndarray, np.ndarray]:
    return np.array([np.cos(t), np.sin(t)]), np.array([-np.sin(t), np.cos(t)])


def strokes():
    """Yield the best strokes of the viscous swimmer."""
    scene = geomech.load("three-link-viscous")
    published = {
        "displacement (BL per cycle)": "0.1035",
        "efficiency (BL/BL)": "0.1109",
    }
    for what, value in published.items():
        best = geomech.optimise(scene, what.partition(" ")[0])
        yield (
            f"{SWIMMER}: best stroke for {what}",
            "the optimum published by Ramasamy and Hatton",
            _(float(best["value"].values), 4),
            value,
        )


def stress():
    """Yield the generic stress map at published angles."""
    source = "Li, Zhang and Goldman, Science 339, 1408 (2013), Table S2: check values of the coefficients"
    wanted = {(0, 90): (0.0, 1.0), (0, -90): (0.0, -0.25), (90, 0): (0.37, 0.037), (0, 0): (0.136, 0.375),
              (45, 45): (0.3595, 0.5702)}  # fmt: skip
    for (beta, gamma), (x, z) in wanted.items():
        found = VERTICAL["generic"].stress(np.radians(beta), np.radians(gamma))
        yield (f"generic stress map at beta = {beta}, gamma = {gamma} degrees: alpha_x, alpha_z (N/cm^3)", source,
               f"{_(found[0], 4)}, {_(found[1], 4)}", f"{x}, {z}")  # fmt: skip


def waves():
    """Yield progress of waves: a snake at the surface, a robot of seven segments."""
    medium = geomech.media.CATALOGUE["glass-0.3mm-surface"].medium
    headings = np.radians(48.4) * np.cos(2 * np.pi * (np.arange(2000) + 0.5) / 2000)
    speed = undulation.endless_efficiency(medium, headings) * np.cos(headings).mean()
    yield ("snake on the surface of 0.3 mm glass, endless wave of 48.4 degrees: speed over its speed along the track",
           "animals, Schiebel et al., eLife 9, e51412 (2020)", _(speed, 3), "0.81 (0.74 to 0.89)")  # fmt: skip
    study = geomech.Study(geomech.load("seven-link-wave")).tables
    net = np.hypot(*study.poses("direct")[:2])
    yield ("robot of seven segments in 6 mm grains: displacement per cycle over the length of its wave, 0.757 BL",
           "experiment, Maladen et al. (2011)", _(net / 0.757, 2), "0.34 +- 0.02")  # fmt: skip


def _(value: float, digits: int) -> str:
    return f"{value:.{digits}f}"


if __name__ == "__main__":
    print(table())
