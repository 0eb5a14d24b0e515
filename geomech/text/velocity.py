"""A body velocity in two lines."""

from __future__ import annotations

from typing import Any

from geomech.core.variables import Result


def numbers(result: Result) -> dict[str, Any]:
    """Return the velocity with its residual and status."""
    numbers = {
        key: x for key, x in result.attributes["found"].items() if key != "iterations"
    }
    return {**numbers, "units": result.attributes["units"]}


def text(result: Result) -> str:
    """Return the velocity, its status, residual and iterations."""
    found, xi = result.attributes["found"], result["xi"]
    steps = f", {found['iterations']} iterations" if "iterations" in found else ""
    residual = "unknown" if found["residual"] is None else f"{found['residual']:.1e}"
    first = "xi = ({:.9g}, {:.9g}, {:.9g})".format(*xi.values)
    return (
        f"{first} {xi.unit} {xi.label}\n{found['status']}, residual {residual}{steps}"
    )
