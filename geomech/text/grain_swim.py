"""A swim in grains beside the tiers of resistive force theory: in lines, as JSON has it, and as a CSV file of the motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result
from rft.core.refusal import in_line


def numbers(result: Result) -> dict[str, Any]:
    """Return displacements by method and by cycle as JSON has them."""
    return {
        **result.attributes,
        **{v.name: v.values.tolist() for v in result.variables},
        "errors": {
            v.name: v.error.tolist() for v in result.variables if v.error is not None
        },
        "units": {v.name: v.unit for v in result.variables if v.unit},
    }


def text(result: Result) -> str:
    """Return the displacement of a cycle by every tier and by the grains, in lines."""
    facts = result.attributes
    lines = [
        f"{facts['name']} in {facts['grains']:,} grains, seed {facts['seed']}: body {1e3 * facts['size']:g} mm long, "
        f"{2e3 * facts['radius']:g} mm wide, {facts['frequency']:g} Hz",
        f"{'BL per cycle':24}{'x':>18}{'y':>18}{'heading (rad)':>18}",
    ]
    rows = zip(
        result["method"].values,
        *(zip(result[n].values, result[n].error) for n in ("x", "y", "heading")),
    )
    lines += [
        f"{name:24}" + "".join(f"{_cell(value, error):>18}" for value, error in cells)
        for name, *cells in rows
    ]
    for k, *pose in zip(
        *(result[n].values for n in ("cycle", "cycle_x", "cycle_y", "cycle_heading"))
    ):
        lines.append(
            f"{f'  cycle {k}':24}"
            + "".join(f"{f'{x:.4f}          ':>18}" for x in pose).rstrip()
        )
    lines.append(
        "+-: error of tiers with that of the medium, deviation of cycles in grains; beds"
    )
    lines.append("differ by more than cycles: take other seeds, too")
    lines.append(
        f"work {facts['work']:.3g} J a cycle; packing {facts['packing']:.3f}; largest overlap {facts['overlap']:.3f} "
        "of a grain"
    )
    return "\n".join(lines)


def _cell(value: float, error: float) -> str:
    return f"{round(value, 4) + 0.0:.4f}" + (
        f" +- {error:.4f}" if np.isfinite(error) else ""
    )


def csv(result: Result) -> str:
    """Return the motion in time: pose of the frame, shape, force of the grains, moment, work; SI units."""
    _, run = result.subject
    joints = [f"alpha_{k + 1}" for k in range(run.alpha.shape[1])]
    columns = np.column_stack(
        [run.t, run.pose, run.alpha, run.force, run.moment, run.work, run.kinetic]
    )
    lines = [
        f"# {command(result)}",
        ",".join(
            [
                "t",
                "x",
                "y",
                "theta",
                *joints,
                "F_x",
                "F_y",
                "F_z",
                "M",
                "work",
                "kinetic",
            ]
        ),
    ]
    return (
        "\n".join([*lines, *(",".join(f"{x:.6g}" for x in row) for row in columns)])
        + "\n"
    )


def command(result: Result) -> str:
    """Return the command that gives the result, without its output."""
    question, _ = result.subject
    sizes = f"--length {result.attributes['size']:g} --radius {result.attributes['radius']:g}"
    return f"geomech grains {in_line(question.scene.name)} --cycles {question.cycles} --seed {question.seed} {sizes}"
