"""geomech trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech import terminal
from geomech.commands.asked import allow, loaded, storing
from geomech.commands.options import CyclesOption, SceneArgument, YesOption, check_outputs


def trajectory(
    name: SceneArgument,
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.csv", help="table to write")],
    cycles: CyclesOption = 1,
    yes: YesOption = False,
):
    """Where the body is at every phase of the scene's gait: pose, joint angles and ends of all links, as CSV."""
    from geomech.output import trajectories
    from geomech.study import motion
    from geomech.systems.base import length_unit

    trajectories.check_csv(out)
    scene = loaded(name)
    check_outputs(scene, out, None)
    with terminal.progress(f"motion of {scene.name}") as bar:
        takes = motion.cost(scene, cycles)
        allow(scene, takes, yes)
        with storing(scene, out, command="trajectory", cycles=cycles):
            found = motion.motion(scene, cycles)
            trajectories.save(out, found, bar)
    (x, y, theta), unit = found.pose[-1], length_unit(scene.system)
    ends = f"after {cycles} cycle{'s' * (cycles > 1)} x {x:.6g} {unit}, y {y:.6g} {unit}, theta {theta:.6g} rad"
    print(f"{ends}; {len(found.phase)} rows of {len(found.columns)} columns in {out}")
