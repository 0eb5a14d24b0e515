"""The stress on a plate, in lines."""

from __future__ import annotations

from typing import Any

from geomech.core.variables import Result


def numbers(result: Result) -> dict[str, Any]:
    """Return both components at one plate, or the shares of the plane where a map pulls and pushes."""
    return {v.name: float(v.values) for v in result.variables}


def text(result: Result) -> str:
    """Return the stress at one plate, and the signs of the map over its whole plane."""
    at_one = result.subject[1] is not None
    parts = [
        f"{v.name} = {v.values:.4g} {v.unit}, {v.label}"
        for v in result.variables
        if at_one
    ]
    return "\n".join([*["; ".join(parts)] * at_one, result.attributes["description"]])
