"""The end of a motion, in a line."""

from __future__ import annotations

from geomech.core.summary import format_pose
from geomech.core.variables import Result
from geomech.geometry.symmetry import zero_components


def text(result: Result) -> str:
    """Return the last pose, and the size of the table."""
    motion = result.subject.motion
    zero = [*zero_components(motion.scene.system.traits, motion.scene.gait)]
    if "heading" not in zero:  # else x and y of one cycle are those of all
        zero = zero if motion.cycles == 1 else []
    pose = format_pose(
        [
            (v.values[-1], v.unit)
            for v in (result[name] for name in ("x", "y", "theta"))
        ],
        zero,
    )
    ends = f"after {motion.cycles} cycle{'s' * (motion.cycles > 1)}: {pose}"
    return f"{ends}\n{len(motion.phase)} rows of {len(motion.columns)} columns"
