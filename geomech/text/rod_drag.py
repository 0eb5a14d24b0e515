"""A law fitted to the drag on a rod: in lines, as JSON has it, and as a medium."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.scenes.write import table
from rft.core.refusal import in_line

UNITS = {"axial_stress": "Pa", "axial_force": "N", "gamma0_deg": "degrees"}
SIZES = {"radius": "m", "length": "m", "depth": "m", "density": "kg/m^3"}
MOST_ROWS = 10  # of a table of residuals that fits a screen
RESIDUALS = "residuals: with --all or --json"


def numbers(result: Result) -> dict[str, Any]:
    """Return the law as JSON has it. covariance: of ``parameters``, gamma0 in rad; errors: the standard ones, of gamma0 in
    degrees, and intervals with 95 %, alike."""
    f, facts, names = (
        result.subject,
        result.attributes,
        result["parameter"].values.tolist(),
    )
    residuals = dict(
        zip(("F_parallel_N", "F_perpendicular_N"), result["residual"].values.tolist())
    )
    return {
        "law": f.law,
        **{
            k: x
            for k, x in facts["medium"].items()
            if k not in ("law", "k", "covariance")
        },
        "k": f.k,
        "covariance": f.covariance.tolist(),
        "rms": f.rms,
        "parameters": list(f.names),
        "errors": dict(zip(names, result["value"].error.tolist())),
        "intervals": dict(zip(names, result["interval"].values.tolist())),
        "axial_force_N": f.axial_force,
        "axial_stress_Pa": f.axial_stress,
        "end_caps": f.end_caps,
        "rod": facts["rod"],
        "repeats_rms": facts["repeats_rms"],
        "residuals": {"psi_deg": result["psi"].values.tolist(), **residuals},
        "status": "converged",
    }


def text(result: Result) -> str:
    """Return the law, its intervals and a few residuals in lines."""
    return _lines(result, MOST_ROWS)


def full(result: Result) -> str:
    """Return the law, its intervals and all residuals in lines."""
    return _lines(result, result["psi"].values.size)


def _lines(result: Result, most: int) -> str:
    f, facts = result.subject, result.attributes
    lines = [
        f"{f.law} law fitted to {in_line(facts['name'])}: {f.data.n_forces} forces at {f.data.n_angles} angles"
    ]
    for name, x, (low, high) in zip(
        *(result[v].values for v in ("parameter", "value", "interval"))
    ):
        unit = f" {UNITS[name]}" if name in UNITS else ""
        lines.append(
            f"{name.removesuffix('_deg'):13}{x:12.5g}, {low:.4g} to {high:.4g}{unit} with 95 %"
        )
    if f.axial_stress and "axial_stress" not in f.names:
        lines.append(f"{'axial_stress':13}{f.axial_stress:12.5g} Pa")
    if "axial_force" not in f.names:
        lines.append(f"{'axial_force':13}{f.axial_force:12.5g} N on the whole rod")
    caps = "left out" if not f.end_caps else f"{f.end_caps:.3g} flat ends"
    sizes = [f"{name} {x:g} {SIZES[name]}" for name, x in facts["rod"].items() if x]
    lines.append(
        f"end caps: {caps}; rod and bed: {', '.join(sizes) or 'sizes not known'}"
    )
    if lacks := facts["lacks"]:
        lines.append(
            f"k is not known without {', '.join(lacks)}: in the header lines, or as --{lacks[0]}"
        )
    repeats = (
        ""
        if facts["repeats_rms"] is None
        else f", among repeats {facts['repeats_rms']:.3g} N"
    )
    lines.append(f"rms residual {f.rms:.3g} N{repeats}")
    psi, force, residual = (
        result[name].values.T for name in ("psi", "force", "residual")
    )
    if psi.size > most:
        return "\n".join([*lines, RESIDUALS])
    lines.append("  psi_deg  F_parallel_N       law  F_perpendicular_N       law")
    for angle, (t, n), (law_t, law_n) in zip(
        psi, force, np.round(force - residual, 12) + 0.0
    ):
        lines.append(f"{angle:9.4g} {t:13.4g} {law_t:9.4g} {n:18.4g} {law_n:9.4g}")
    return "\n".join(lines)


def medium(result: Result) -> str:
    """Return a file that a scene takes as ``[medium] file``."""
    f, uncertain = result.subject, getattr(result.subject.medium, "uncertain", ())
    of = f"; covariance of {', '.join(uncertain)}" + (
        ", gamma0 in rad" if "gamma0" in uncertain else ""
    )
    of += f", widened for {f.degrees_of_freedom} degrees of freedom (Student)"
    fitted = f"# Fitted to {json.dumps(result.attributes['name'])}: {f.data.n_angles} angles, rms residual {f.rms:.3g} N"
    caps = ""
    if f.data.ends is not None and f.end_caps:
        e = ", ".join(
            f"{n} = {x:.3g} +- {d:.2g}"
            for n, x, d in zip(("e", "across"), f.values[-2:], f.errors[-2:])
        )
        caps = f'# Of the flank alone. Both ends together, in [[effects]] kind = "end-caps": {e}.\n'
    return f"{fitted}{of if uncertain else ''}.\n{caps}" + table(
        "medium", result.attributes["medium"]
    )
