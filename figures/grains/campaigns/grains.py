"""Swims, reversals and lift in beds of grains, as CSV files; hours of computing, run by
hand.

    python -m figures.grains.campaigns.grains swims STORE             three and seven links
    python -m figures.grains.campaigns.grains swim-convergence STORE  three links with another
    step, stiffness or bed python -m figures.grains.campaigns.grains swim-depth STORE
    three links deeper below the surface python -m figures.grains.campaigns.grains reversals
    STORE         a rod to and fro, across its axis and along python -m
    figures.grains.campaigns.grains lift STORE              bars of three sections python -m
    figures.grains.campaigns.grains plates STORE            plates at the angles of a round
    bar's leading face python -m figures.grains.campaigns.grains faces STORE             stress
    around the bars of `lift`, and around a shell python -m figures.grains.campaigns.grains
    convergence STORE       a bar with another step, stiffness, width or depth

STORE is a folder for settled beds and runs. What is there is read and what is missing
computed, so that a stopped campaign goes on. Each prints what it has as it comes and
writes its file at the end. `BEDS`, `SWIMS`, `STROKES` and `BARS` say what is computed.
Needs the extra grains.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from geomech.io.files import write_text
from geomech.scenes import load
from geomech.studies.grains.swim import RAMP, GrainSwim, cycle_poses
from rft.grains import Bed, Experiment, Run, Spheres, Stroke, Tow, plate, rod
from rft.grains.drag import SteadyForce, steady_force
from rft.grains.reversal import drags

FOLDER = Path(__file__).parent
BEDS = (1, 2, 3)  # seeds
CIRCLE = "three-link-glass"
BUTTERFLY = "butterfly-glass"
WAVE = "seven-link-modes"
SWIMS = (  # scene, amplitude, rad, frequency, Hz
    *((CIRCLE, amplitude, 1.0) for amplitude in (1.0, 1.7, 0.5, 1.5, 2.0)),
    (BUTTERFLY, 1.0, 1.0),
    *((WAVE, amplitude, 1.0) for amplitude in (0.5, 0.87, 1.2)),
    (CIRCLE, 1.0, 0.5),
    (CIRCLE, 1.7, 0.5),
)
# amplitude, m, depth, m, and angle from its axis, degrees, of the ways of a rod 12 mm
# in diameter
STROKES = (
    (0.02, 0.0245, 90),
    (0.01, 0.0245, 90),
    (0.02, 0.0245, 0),
    (0.02, 0.0150, 90),
    (0.04, 0.0245, 90),
    (0.01, 0.0245, 0),
    (0.01, 0.0150, 90),
    (0.04, 0.0150, 90),
    (0.04, 0.0245, 0),
)
BARS = ("round", "half round", "half round, flat up")
SHELL = "half shell, hollow ahead"
DEEPER = 0.016  # m of bed above a swimmer, or below
SPEED = 0.1  # m/s of rods
LONGEST_BIN = 2e-3  # m of the way of a rod to and fro
TROUGH = Bed(length=0.06, width=0.30, depth=0.048)  # for bars across it
# m, radius and depth of the axis
BAR = 8e-3
BAR_DEPTH = 0.016
# height, m, and tilts of the face from the underside of a cylinder, degrees; 90 is
# upright, 180 its top
PLATES = ((0.016, (15, 30, 50, 90, 130, 150, 165)),)
# m, of plates, and of the strips along their edges that are no middle: half a grain
THICKNESS = 3e-3
EDGE = 3e-3
GRAIN = 1e-3  # m, radius of the spheres of bars and plates
TEXTS = "scene", "change", "shape", "part"  # columns that are no numbers
Rows = Iterator[tuple]


def swims(store: Path) -> Rows:
    """Yield the displacement of every cycle of the swimmers of `SWIMS`, 162 x 12 mm, in
    every bed."""
    yield (
        "scene",
        "amplitude",
        "frequency_Hz",
        "bed",
        "cycle",
        "x_BL",
        "y_BL",
        "heading_rad",
        "work_J",
        "packing",
        "surface_m",
    )
    for scene, amplitude, frequency in SWIMS:
        for seed in BEDS:
            question = swim(scene, amplitude, frequency, seed)
            run = question.experiment.run(store)
            for cycle in cycles(question, run):
                facts = run.facts["packing"], run.facts["surface"]
                yield scene, amplitude, frequency, seed, *cycle, *facts


def swim(scene: str, amplitude: float, frequency: float, seed: int) -> GrainSwim:
    """Return a swim of a built-in scene with another amplitude (rad) and frequency
    (Hz)."""
    built_in = load(scene)
    gait = replace(
        built_in.gait,
        amplitude=amplitude,
        frequency=None if frequency == 1.0 else frequency,
    )
    return GrainSwim(built_in.changed(gait=gait), seed=seed)


def cycles(question: GrainSwim, run: Run) -> Rows:
    """Yield number, displacement (x and y in body lengths, heading in rad) and work, J,
    of every cycle of a swim."""
    starts = (RAMP + np.arange(question.cycles + 1)) / question.frequency
    size = question.experiment.body.size
    work = np.diff(np.interp(starts, run.t, run.work))
    for k, (pose, joule) in enumerate(
        zip(cycle_poses(run, starts) / [size, size, 1.0], work), 1
    ):
        yield k, *pose, joule


def swim_convergence(store: Path) -> Rows:
    """Yield the displacement of every cycle of a circle of 1 rad, with one number of
    its bed changed at a time."""
    yield (
        "change",
        "cycle",
        "x_BL",
        "y_BL",
        "heading_rad",
        "work_J",
        "mean_overlap",
        "largest_overlap",
    )
    question = swim(CIRCLE, 1.0, 1.0, BEDS[0])
    experiment = question.experiment
    bed = question.experiment.bed
    changes = {
        "none": bed,
        "half the time step": replace(bed, time_step=bed.step / 2),
        "young 5 MPa": replace(bed, young=5e6),
        "16 mm deeper": replace(bed, depth=bed.depth + DEEPER),
        "60 mm longer and wider": replace(
            bed, length=bed.length + 0.06, width=bed.width + 0.06
        ),
    }
    for name, changed in changes.items():
        run = replace(experiment, bed=changed, depth=bed.depth / 2).run(store)
        overlaps = run.overlaps[:, 1].mean(), run.overlaps[:, 0].max()
        for cycle in cycles(question, run):
            yield f'"{name}"', *cycle, *overlaps


def swim_depth(store: Path) -> Rows:
    """Yield the displacement of every cycle of a circle of 1 rad in beds that are
    deeper above the body."""
    yield "depth_m", "bed", "cycle", "x_BL", "y_BL", "heading_rad", "work_J"
    for seed in BEDS:
        question = swim(CIRCLE, 1.0, 1.0, seed)
        bed = question.experiment.bed
        deep = replace(bed, depth=bed.depth + DEEPER)
        depth = bed.depth / 2 + DEEPER
        run = replace(question.experiment, bed=deep, depth=depth).run(store)
        for cycle in cycles(question, run):
            yield depth, seed, *cycle


def reversals(store: Path) -> Rows:
    """Yield the drag along the way of a rod to and fro; it turns at one amplitude,
    three and five."""
    yield "amplitude_m", "depth_m", "angle_deg", "bed", "travel_m", "flank_N", "ends_N"
    radius = 6e-3
    for amplitude, depth, angle in STROKES:
        for seed in BEDS:
            stroke = Stroke(SPEED, math.radians(angle), amplitude)
            duration = round(5 * amplitude / SPEED, 6)  # out, and twice across
            run = Experiment(
                Bed(seed=seed), rod(0.162, radius), stroke, duration, depth
            ).run(store)
            found = drags(run, stroke, radius, min(amplitude / 10, LONGEST_BIN))
            for row in zip(*(x.tolist() for x in found[1:])):
                yield amplitude, depth, angle, seed, *row


def lift(store: Path) -> Rows:
    """Yield drag and lift on bars that span a trough, 16 mm in diameter, 16 mm deep."""
    yield "shape", "bed", "drag_N", "lift_N", "lift_over_drag", "error_in_time"
    for shape in BARS:
        for seed in BEDS:
            bar = rod(TROUGH.length, BAR, shape, through=True, grain=GRAIN)
            found = steady_towed(bar, seed, store)
            yield (
                f'"{shape}"',
                seed,
                -found.force[1],
                found.force[2],
                found.lift,
                found.lift_error,
            )


def plates(store: Path) -> Rows:
    """Yield stress over depth on plates that are towed level: in the middle of the
    leading face and of the rear one, without the edges, and on the whole plate, both
    faces and edges, over the area of one face.

    Of either face, normal stress is positive where grains push the plate back,
    tangential stress where they push it up."""
    names = [
        f"{part}_{way}_N/cm3"
        for part in ("face", "rear", "whole")
        for way in ("normal", "tangent")
    ]
    yield "height_m", "beta_deg", "bed", *names
    for height, beta in ((height, beta) for height, tilts in PLATES for beta in tilts):
        body = plate(
            TROUGH.length,
            height,
            math.radians(beta - 90),
            grain=GRAIN,
            thickness=THICKNESS,
        )
        sin, cos = math.sin(math.radians(beta)), math.cos(math.radians(beta))
        back, up = np.array([-sin, cos]), np.array([cos, sin])
        middle = np.abs(body.offsets[:, 1:] @ up) < height / 2 - EDGE
        front = np.arange(len(middle)) < len(middle) // 2
        patch = GRAIN * (height - 2 * GRAIN) / round(height / GRAIN)  # m^2 of a sphere
        parts = [(m, m.sum() * patch) for m in (middle & front, middle & ~front)]
        parts.append((middle | True, TROUGH.length * height))
        for seed in BEDS:
            force = steady_towed(body, seed, store).profile[:, 1:]
            over_depth = 1e-6 * force / (BAR_DEPTH - body.offsets[:, 2:])
            stress = [
                over_depth[mine].sum(0) @ way / area
                for mine, area in parts
                for way in (back, up)
            ]
            yield height, beta, seed, *map(float, stress)


def faces(store: Path) -> Rows:
    """Yield the force on every row of spheres along the bars of `lift` and a shell, at
    y and z from the axis."""
    yield "shape", "bed", "y_m", "z_m", "drag_N", "lift_N"
    bars = {
        shape: rod(TROUGH.length, BAR, shape, through=True, grain=GRAIN)
        for shape in BARS
    }
    for shape, bar in {**bars, SHELL: rear_half(bars["round"])}.items():
        rows = np.unique(bar.offsets[:, 1:], axis=0)
        for seed in BEDS[:2] if shape == SHELL else BEDS:
            force = steady_towed(bar, seed, store).profile[:, 1:]
            for row in rows:
                on_row = force[(bar.offsets[:, 1:] == row).all(1)].sum(0)
                yield f'"{shape}"', seed, *map(float, (*row, -on_row[0], on_row[1]))


def rear_half(bar: Spheres) -> Spheres:
    """Return the rear half of a round bar: a thin sheet whose hollow leads."""
    is_rear = bar.offsets[:, 1] < 1e-9
    offsets = bar.offsets[is_rear] + [0.0, (BAR - GRAIN) / 2, 0.0]
    offsets = offsets[np.lexsort((offsets[:, 2], offsets[:, 0]))]
    n = len(offsets)
    return replace(bar, offsets=offsets, link=bar.link[:n], radius=bar.radius[:n])


def steady_towed(body: Spheres, seed: int, store: Path) -> SteadyForce:
    """Return the steady force on a body that is towed across the trough."""
    tow = Tow(SPEED, math.pi / 2)
    run = Experiment(replace(TROUGH, seed=seed), body, tow, 0.6, depth=BAR_DEPTH).run(
        store
    )
    return steady_force(run, body.half_width, tow.angle, SPEED)


def convergence(store: Path) -> Rows:
    """Yield drag and lift on a round bar in one bed, with one number of the bed changed
    at a time."""
    yield (
        "change",
        "drag_N",
        "drag_error_N",
        "lift_N",
        "lift_error_N",
        "lift_over_drag",
        "largest_overlap",
    )
    changes = {
        "none": TROUGH,
        "half the time step": replace(TROUGH, time_step=TROUGH.step / 2),
        "young 5 MPa": replace(TROUGH, young=5e6),
        "width 0.45 m": replace(TROUGH, width=0.45),
        "16 mm deeper": replace(TROUGH, depth=TROUGH.depth + 0.016),
    }
    bar = rod(TROUGH.length, BAR, through=True, grain=GRAIN)
    tow = Tow(SPEED, math.pi / 2)
    for name, bed in changes.items():
        run = Experiment(bed, bar, tow, 0.6, depth=BAR_DEPTH).run(store)
        found = steady_force(run, BAR, tow.angle, SPEED)
        force, error = found.force, found.error
        overlap = float(run.overlaps[:, 0].max())
        yield f'"{name}"', -force[1], error[1], force[2], error[2], found.lift, overlap


CAMPAIGNS: dict[str, Callable[[Path], Rows]] = {
    "swims": swims,
    "swim-convergence": swim_convergence,
    "swim-depth": swim_depth,
    "reversals": reversals,
    "lift": lift,
    "plates": plates,
    "faces": faces,
    "convergence": convergence,
}


def main(name: str, store: str) -> None:
    """Run a campaign and write its file."""
    bed = TROUGH if name in ("lift", "plates", "faces", "convergence") else Bed()
    seeds = "" if name.endswith("convergence") else f", seeds {BEDS}"
    lines = [
        f"# python -m figures.grains.campaigns.grains {name} STORE",
        f"# {replace(bed, seed=BEDS[0])!r}{seeds}",
    ]
    for row in CAMPAIGNS[name](Path(store)):
        lines.append(
            ",".join(f"{x:.5g}" if isinstance(x, float) else str(x) for x in row)
        )
        print(lines[-1], flush=True)
    write_text(FOLDER / f"grains_{name.replace('-', '_')}.csv", "\n".join(lines) + "\n")


def read(name: str) -> dict[str, np.ndarray]:
    """Return the columns of a campaign's file."""
    from csv import DictReader

    with open(FOLDER / f"grains_{name}.csv") as file:
        rows = list(DictReader(line for line in file if not line.startswith("#")))
    as_column = lambda key: np.array([row[key] for row in rows])
    return {
        key: as_column(key) if key in TEXTS else as_column(key).astype(float)
        for key in rows[0]
    }


if __name__ == "__main__":
    main(*sys.argv[1:])
