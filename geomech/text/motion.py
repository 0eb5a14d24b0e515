"""The end of a motion, in a line."""

from __future__ import annotations

from geomech.core.variables import Result


def text(result: Result) -> str:
    """Return the last pose, and the size of the table."""
    motion = result.subject.motion
    pose = ", ".join(f"{name} {result[name].values[-1]:.6g} {result[name].unit}" for name in ("x", "y", "theta"))
    ends = f"after {motion.cycles} cycle{'s' * (motion.cycles > 1)} {pose}"
    return f"{ends}; {len(motion.phase)} rows of {len(motion.columns)} columns"
