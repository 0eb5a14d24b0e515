"""The charts of a gait lab in lines."""

from __future__ import annotations

from typing import Any

from geomech.core.variables import Result
from rft.core.refusal import in_line


def text(result: Result) -> str:
    """Return a line a scene, and one for a family."""
    names = [in_line(name) for name in result["scene"].values]
    wide = max(map(len, names))
    lines = [
        f"{name:{wide}}  {shapes} shapes, harmonics to {highest}"
        for name, shapes, highest in zip(
            names, result["shapes"].values, result["highest"].values
        )
    ]
    if over := result.attributes.get("over"):
        error, members = (
            result.attributes["between_members"],
            result.attributes["members"],
        )
        lines.append(
            f"{names[0]} over {over}: {members} members, interpolated between them to {error:.1e} BL"
        )
    return "\n".join(lines)


def numbers(result: Result) -> dict[str, Any]:
    """Return the lines as numbers."""
    return {
        **{v.name: v.values.tolist() for v in result.variables},
        **result.attributes,
    }
