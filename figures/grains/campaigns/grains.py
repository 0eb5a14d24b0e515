"""Campaigns of experiments in beds of grains: swims, reversals and lift, as CSV files.

Each takes hours of computing and is started by hand:

    python -m figures.grains.campaigns.grains CAMPAIGN STORE

    swims             three and seven links
    swim-convergence  three links with another time step, stiffness or bed
    swim-depth        three links deeper below the surface
    reversals         a rod that moves back and forth, across its axis and along it
    lift              bars of three sections
    plates            plates at the angles of a round bar's leading face
    faces             stress around the bars of `lift`, and around a shell
    convergence       a bar with another time step, stiffness, width or depth

STORE is a folder for settled beds and runs. Runs that are there are read and missing
ones computed, so that a stopped campaign goes on. Each campaign prints its rows as they
come and writes its file at the end. `BEDS`, `SWIMS`, `STROKES` and `BARS` list the
experiments. Needs the extra grains.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator
from csv import DictReader
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
    (CIRCLE, 1.0, 1.0),
    (CIRCLE, 1.7, 1.0),
    (CIRCLE, 0.5, 1.0),
    (CIRCLE, 1.5, 1.0),
    (CIRCLE, 2.0, 1.0),
    (BUTTERFLY, 1.0, 1.0),
    (WAVE, 0.5, 1.0),
    (WAVE, 0.87, 1.0),
    (WAVE, 1.2, 1.0),
    (CIRCLE, 1.0, 0.5),
    (CIRCLE, 1.7, 0.5),
)
# of a rod 12 mm in diameter: amplitude, m, depth, m, and angle from its axis, degrees
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
ROD_RADIUS = 6e-3  # m
ROD_LENGTH = 0.162  # m
BARS = ("round", "half round", "half round, flat up")
SHELL = "half shell, hollow ahead"
ADDED_DEPTH = 0.016  # m of bed above a swimmer, or below
SPEED = 0.1  # m/s of rods
TOW_DURATION = 0.6  # s
LONGEST_BIN = 2e-3  # m of the travel of a rod that moves back and forth
TROUGH = Bed(length=0.06, width=0.30, depth=0.048)  # for bars across it
# m, radius and depth of the axis
BAR = 8e-3
BAR_DEPTH = 0.016
# height, m, and tilts of the face from the underside of a cylinder, degrees; 90 is
# upright, 180 its top
PLATES = ((0.016, (15, 30, 50, 90, 130, 150, 165)),)
# m, of plates, and of the strips along their edges that are left out: half a grain
THICKNESS = 3e-3
EDGE = 3e-3
GRAIN = 1e-3  # m, radius of the spheres of bars and plates
TEXTS = ("scene", "change", "shape", "part")  # columns of text
Rows = Iterator[tuple]


# Swims


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
            question = swim_question(scene, amplitude, frequency, seed)
            run = question.experiment.run(store)
            facts = (run.facts["packing"], run.facts["surface"])
            for row in cycle_rows(question, run):
                yield scene, amplitude, frequency, seed, *row, *facts


def swim_question(
    scene: str, amplitude: float, frequency: float, seed: int
) -> GrainSwim:
    """Return a swim of a built-in scene with another amplitude (rad) and frequency
    (Hz)."""
    built_in = load(scene)
    # None stands for 1 Hz.
    own_frequency = None if frequency == 1.0 else frequency
    gait = replace(built_in.gait, amplitude=amplitude, frequency=own_frequency)
    return GrainSwim(built_in.changed(gait=gait), seed=seed)


def cycle_rows(question: GrainSwim, run: Run) -> Rows:
    """Yield number, displacement (x and y in body lengths, heading in rad) and work, J,
    of every cycle of a swim."""
    starts = (RAMP + np.arange(question.cycles + 1)) / question.frequency
    size = question.experiment.body.size
    poses = cycle_poses(run, starts) / [size, size, 1.0]
    works = np.diff(np.interp(starts, run.t, run.work))
    for k, (pose, work) in enumerate(zip(poses, works), 1):
        yield k, *pose, work


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
    question = swim_question(CIRCLE, 1.0, 1.0, BEDS[0])
    experiment = question.experiment
    bed = experiment.bed
    wide_bed = replace(bed, length=bed.length + 0.06, width=bed.width + 0.06)
    beds = {
        "none": bed,
        "half the time step": replace(bed, time_step=bed.step / 2),
        "young 5 MPa": replace(bed, young=5e6),
        "16 mm deeper": replace(bed, depth=bed.depth + ADDED_DEPTH),
        "60 mm longer and wider": wide_bed,
    }
    for name, changed_bed in beds.items():
        run = replace(experiment, bed=changed_bed, depth=bed.depth / 2).run(store)
        overlaps = (run.overlaps[:, 1].mean(), run.overlaps[:, 0].max())
        for row in cycle_rows(question, run):
            yield quoted(name), *row, *overlaps


def swim_depth(store: Path) -> Rows:
    """Yield the displacement of every cycle of a circle of 1 rad in beds that are
    deeper above the body."""
    yield "depth_m", "bed", "cycle", "x_BL", "y_BL", "heading_rad", "work_J"
    for seed in BEDS:
        question = swim_question(CIRCLE, 1.0, 1.0, seed)
        bed = question.experiment.bed
        deep_bed = replace(bed, depth=bed.depth + ADDED_DEPTH)
        depth = bed.depth / 2 + ADDED_DEPTH
        run = replace(question.experiment, bed=deep_bed, depth=depth).run(store)
        for row in cycle_rows(question, run):
            yield depth, seed, *row


# Rods


def reversals(store: Path) -> Rows:
    """Yield the drag along the travel of a rod that moves back and forth; it reverses
    after one amplitude, three and five."""
    yield "amplitude_m", "depth_m", "angle_deg", "bed", "travel_m", "flank_N", "ends_N"
    body = rod(ROD_LENGTH, ROD_RADIUS)
    for amplitude, depth, angle in STROKES:
        stroke = Stroke(SPEED, math.radians(angle), amplitude)
        duration = round(5 * amplitude / SPEED, 6)  # out, and twice across
        bin_width = min(amplitude / 10, LONGEST_BIN)
        for seed in BEDS:
            run = Experiment(Bed(seed=seed), body, stroke, duration, depth).run(store)
            _, *columns = drags(run, stroke, ROD_RADIUS, bin_width)
            for row in zip(*(column.tolist() for column in columns)):
                yield amplitude, depth, angle, seed, *row


def lift(store: Path) -> Rows:
    """Yield drag and lift on bars that span a trough, 16 mm in diameter, 16 mm deep."""
    yield "shape", "bed", "drag_N", "lift_N", "lift_over_drag", "error_in_time"
    for shape in BARS:
        bar = rod(TROUGH.length, BAR, shape, through=True, grain=GRAIN)
        for seed in BEDS:
            steady = towed_force(bar, replace(TROUGH, seed=seed), store)
            _, y, z = steady.force
            yield quoted(shape), seed, -y, z, steady.lift, steady.lift_error


def towed_force(body: Spheres, bed: Bed, store: Path) -> SteadyForce:
    """Return the steady force on a body that is towed across a trough."""
    tow = Tow(SPEED, math.pi / 2)
    run = Experiment(bed, body, tow, TOW_DURATION, depth=BAR_DEPTH).run(store)
    return steady_force(run, body.half_width, tow.angle, SPEED)


def plates(store: Path) -> Rows:
    """Yield stress over depth on plates that are towed level: in the middle of the
    leading face and of the rear one, without the edges, and on the whole plate, both
    faces and edges, over the area of one face.

    On either face, normal stress is positive where grains push the plate back,
    tangential stress where they push it up."""
    yield (
        "height_m",
        "beta_deg",
        "bed",
        "face_normal_N/cm3",
        "face_tangent_N/cm3",
        "rear_normal_N/cm3",
        "rear_tangent_N/cm3",
        "whole_normal_N/cm3",
        "whole_tangent_N/cm3",
    )
    for height, tilts in PLATES:
        for beta in tilts:
            tilt = math.radians(beta - 90)
            body = plate(TROUGH.length, height, tilt, grain=GRAIN, thickness=THICKNESS)
            for seed in BEDS:
                steady = towed_force(body, replace(TROUGH, seed=seed), store)
                stress = plate_stress(body, height, beta, steady.profile[:, 1:])
                yield height, beta, seed, *stress


def plate_stress(
    body: Spheres, height: float, beta: float, force: np.ndarray
) -> list[float]:
    """Return the six stresses over depth of `plates`, N/cm^3, by the force (n, 2) on
    each sphere, N, on y and z."""
    sin = math.sin(math.radians(beta))
    cos = math.cos(math.radians(beta))
    normal = np.array([-sin, cos])
    tangent = np.array([cos, sin])
    is_middle = np.abs(body.offsets[:, 1:] @ tangent) < height / 2 - EDGE
    # The spheres of the leading face come first.
    is_front = np.arange(len(is_middle)) < len(is_middle) // 2
    is_face = is_middle & is_front
    is_rear = is_middle & ~is_front
    sphere_area = GRAIN * (height - 2 * GRAIN) / round(height / GRAIN)  # m^2
    parts = (
        (is_face, is_face.sum() * sphere_area),
        (is_rear, is_rear.sum() * sphere_area),
        (np.ones_like(is_face), TROUGH.length * height),
    )
    over_depth = 1e-6 * force / (BAR_DEPTH - body.offsets[:, 2:])
    stress = []
    for is_part, area in parts:
        total = over_depth[is_part].sum(0)
        stress += [float(total @ normal / area), float(total @ tangent / area)]
    return stress


def faces(store: Path) -> Rows:
    """Yield the force on every row of spheres along the bars of `lift` and a shell, at
    y and z from the axis."""
    yield "shape", "bed", "y_m", "z_m", "drag_N", "lift_N"
    for shape in BARS:
        bar = rod(TROUGH.length, BAR, shape, through=True, grain=GRAIN)
        yield from row_forces(shape, bar, BEDS, store)
    shell = rear_half(rod(TROUGH.length, BAR, through=True, grain=GRAIN))
    yield from row_forces(SHELL, shell, BEDS[:2], store)


def row_forces(shape: str, body: Spheres, seeds: tuple[int, ...], store: Path) -> Rows:
    """Yield the rows of `faces` for one body."""
    places = body.offsets[:, 1:]
    for seed in seeds:
        force = towed_force(body, replace(TROUGH, seed=seed), store).profile[:, 1:]
        for place in np.unique(places, axis=0):
            y, z = place.tolist()
            on_row = force[(places == place).all(1)].sum(0)
            yield quoted(shape), seed, y, z, float(-on_row[0]), float(on_row[1])


def rear_half(bar: Spheres) -> Spheres:
    """Return the rear half of a round bar: a thin sheet whose hollow leads."""
    is_rear = bar.offsets[:, 1] < 1e-9
    offsets = bar.offsets[is_rear] + [0.0, (BAR - GRAIN) / 2, 0.0]
    offsets = offsets[np.lexsort((offsets[:, 2], offsets[:, 0]))]
    n = len(offsets)
    return replace(bar, offsets=offsets, link=bar.link[:n], radius=bar.radius[:n])


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
    beds = {
        "none": TROUGH,
        "half the time step": replace(TROUGH, time_step=TROUGH.step / 2),
        "young 5 MPa": replace(TROUGH, young=5e6),
        "width 0.45 m": replace(TROUGH, width=0.45),
        "16 mm deeper": replace(TROUGH, depth=TROUGH.depth + 0.016),
    }
    bar = rod(TROUGH.length, BAR, through=True, grain=GRAIN)
    tow = Tow(SPEED, math.pi / 2)
    for name, bed in beds.items():
        run = Experiment(bed, bar, tow, TOW_DURATION, depth=BAR_DEPTH).run(store)
        steady = steady_force(run, BAR, tow.angle, SPEED)
        yield (
            quoted(name),
            -steady.force[1],
            steady.error[1],
            steady.force[2],
            steady.error[2],
            steady.lift,
            float(run.overlaps[:, 0].max()),
        )


# Files

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
IN_TROUGH = ("lift", "plates", "faces", "convergence")


def main(name: str, store: str) -> None:
    """Run a campaign and write its file."""
    lines = [
        f"# python -m figures.grains.campaigns.grains {name} STORE",
        bed_line(name),
    ]
    for row in CAMPAIGNS[name](Path(store)):
        lines.append(csv_line(row))
        print(lines[-1], flush=True)
    write_text(FOLDER / f"grains_{name.replace('-', '_')}.csv", "\n".join(lines) + "\n")


def bed_line(name: str) -> str:
    """Return the comment that names the beds of a campaign."""
    bed = Bed()
    if name in IN_TROUGH:
        bed = TROUGH
    line = f"# {replace(bed, seed=BEDS[0])!r}"
    if name.endswith("convergence"):
        return line
    return f"{line}, seeds {BEDS}"


def csv_line(row: Iterable) -> str:
    """Return a row of a file, with five digits of each number."""
    cells = []
    for value in row:
        if isinstance(value, float):
            cells.append(f"{value:.5g}")
        else:
            cells.append(str(value))
    return ",".join(cells)


def quoted(name: str) -> str:
    """Return a name that may contain a comma as a cell of a file."""
    return f'"{name}"'


def read(name: str) -> dict[str, np.ndarray]:
    """Return the columns of a campaign's file."""
    with open(FOLDER / f"grains_{name}.csv") as file:
        rows = list(DictReader(line for line in file if not line.startswith("#")))
    columns = {}
    for key in rows[0]:
        column = np.array([row[key] for row in rows])
        if key not in TEXTS:
            column = column.astype(float)
        columns[key] = column
    return columns


if __name__ == "__main__":
    main(*sys.argv[1:])
