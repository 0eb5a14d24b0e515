"""The drag on flank and ends of a rod in grains: in lines, as JSON has it, and as a CSV file."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result


def numbers(result: Result) -> dict[str, Any]:
    """Return the drags and the law as JSON has them; errors are standard errors in time."""
    _, law = result.subject
    return {
        **result.attributes,
        **{v.name: v.values.tolist() for v in result.variables},
        "errors": {
            v.name: v.error.tolist() for v in result.variables if v.error is not None
        },
        "law": dict(zip(law.names, law.values.tolist())),
        "law_errors": dict(zip(law.names, law.errors.tolist())),
        "units": {v.name: v.unit for v in result.variables if v.unit},
    }


def text(result: Result) -> str:
    """Return means over beds with their errors, and the law, in lines."""
    question, law = result.subject
    facts, beds = result.attributes, question.beds
    head = f"rod {2e3 * question.radius:g} x {1e3 * question.length:g} mm, {1e3 * facts['depth']:.1f} mm deep"
    lines = [
        f"{head}, in {beds} beds of {facts['grains']:,} grains, packing {facts['packing']:.3f}; mean +- error over beds"
        if beds > 1
        else f"{head}, in a bed of {facts['grains']:,} grains, packing {facts['packing']:.3f}; +- error in time",
        f"psi_deg{'flank along':>15}{'across (N/m)':>15}{'ends along':>13}{'across (mN)':>13}{'lift (mN)':>13}",
    ]
    forms = (1.0, "6.2f", "4.2f"), (1.0, "6.2f", "4.2f"), *[(1e3, "5.0f", "3.0f")] * 3
    columns = [
        x for name in ("flank", "ends", "lift") for x in _with_errors(result, name)
    ]
    for psi, *cells in zip(result["angle"].values, *columns):
        words = [
            f" {unit * v:{form}} +- {unit * e:{short}}"
            for (v, e), (unit, form, short) in zip(cells, forms)
        ]
        lines.append(f"{psi:7.4g}" + "".join(words))
    for name, x, (low, high) in zip(law.names, law.values, law.intervals):
        scale, unit = (np.degrees(1.0), " degrees") if name == "gamma0" else (1.0, "")
        lines.append(
            f"{name:9}{x * scale:9.3g}, {low * scale:.3g} to {high * scale:.3g}{unit} with 95 %"
        )
    lines.append(
        f"ends: e = {law.end_caps:.2f} of both together; largest overlap {facts['overlap']:.3f} grain diameters"
    )
    return "\n".join(lines)


def _with_errors(result: Result, name: str) -> list[list[tuple[float, float]]]:
    """Return (value, error) by angle, of each component: over beds, or in time where there is one bed."""
    over = (-1, *result["lift"].values.shape)
    values, errors = (
        x.reshape(over) for x in (result[name].values, result[name].error)
    )
    beds = over[1]
    errors = values.std(1, ddof=1) / np.sqrt(beds) if beds > 1 else errors[:, 0]
    return [list(zip(v, e)) for v, e in zip(values.mean(1).tolist(), errors.tolist())]


def csv(result: Result) -> str:
    """Return the file that ``fit-medium`` reads: a line for each bed and angle, the drag of a flank as long as the rod."""
    question, _ = result.subject
    facts, bed, length = result.attributes, question.bed, question.length
    walls = "walled" if bed.walled else "periodic"
    settled = (
        ""
        if bed.settling_friction is None
        else f", settled with friction {bed.settling_friction:g}"
    )
    lines = [
        f"# {command(result)}",
        "# Drag on the flank of a rod, and on both its ends together beyond that, in beds of grains (LAMMPS "
        f"{facts['lammps']}, Hertz-Mindlin); mean after {1e3 * 2.5 * question.radius:g} mm of travel",
        f"# grains {1e3 * bed.diameter:g} mm +-{100 * bed.spread:g} %, density {bed.density:g} kg/m^3, packing "
        f"{facts['packing']:.4f}; rod {2e3 * question.radius:g} mm diameter x {1e3 * length:g} mm, axis "
        f"{1e3 * facts['depth']:.2f} mm deep, {question.speed:g} m/s",
        f"# young {bed.young:g} Pa, poisson {bed.poisson:g}, restitution {bed.restitution:g}; friction {bed.friction:g}"
        f"{settled}, with the rod {bed.body_friction:g}, with the floor {bed.floor_friction:g}",
        f"# {facts['grains']} grains in {1e3 * bed.length:g} mm by {1e3 * bed.width:g} mm, {walls}; time step "
        f"{1e6 * facts['step']:.3g} us; largest overlap {facts['overlap']:.3f} of a grain",
        "# errors: standard errors in time",
        "psi_deg,F_parallel_N,F_perpendicular_N,end_parallel_N,end_perpendicular_N,lift_N,bed,F_parallel_error_N,"
        "F_perpendicular_error_N,end_parallel_error_N,end_perpendicular_error_N",
    ]
    flank, ends, lift = (result[name] for name in ("flank", "ends", "lift"))
    for i, seed in enumerate(result["bed"].values):
        for j, psi in enumerate(result["angle"].values):
            cells = [
                *(length * flank.values[:, i, j]),
                *ends.values[:, i, j],
                lift.values[i, j],
            ]
            errors = [*(length * flank.error[:, i, j]), *ends.error[:, i, j]]
            numbers_ = [
                f"{psi:g}",
                *(f"{x:.4f}" for x in cells),
                f"{seed}",
                *(f"{x:.4f}" for x in errors),
            ]
            lines.append(",".join(numbers_))
    return "\n".join(lines) + "\n"


def command(result: Result) -> str:
    """Return the command that gives the result, without its output; numbers of the bed that no option has stand in the
    file."""
    question, _ = result.subject
    angles = ",".join(f"{x:g}" for x in question.angles)
    sizes = f"--length {question.length:g} --radius {question.radius:g} --speed {question.speed:g}"
    depth = "" if question.depth is None else f" --depth {question.depth:g}"
    return f"geomech drag-grains {sizes}{depth} --angles {angles} --beds {question.beds} --seed {question.seed}"
