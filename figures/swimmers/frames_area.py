"""The effect of the body frame on the area tier in loose glass: mean, middle-link and
minimum-perturbation frame against the force balance.

Above: net distance per cycle, by the area under the CCF in each frame and by the force
balance, which is the same in all. Below: how far the area tier is from the force
balance in its own frame, and, dotted, the path tier, which integrates the same fitted
connection along the gait: no frame removes its error.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Butterfly, Circle
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables

FRAMES = "mean", "link-2", "minimum-perturbation"
GAITS = {
    "circle": (Circle(), 2.0, "radius of the circle (rad)"),
    "butterfly": (Butterfly(), 1.2, "scale of the butterfly"),
}


def compute(scene: str = "three-link-glass", count: int = 20, grid: int = 31) -> dict:
    """Return {gait: {"amplitude": (B,), frame: {tier: (B, 3)}}} of net poses, body
    lengths and rad, each in its own frame.

    The field reaches as far as the gaits.
    """
    study = SceneTables(load(scene)).with_numerics(grid=grid, extent=2.7)
    found: dict = {
        name: {"amplitude": np.linspace(0, top, count + 1)[1:]}
        for name, (_, top, _) in GAITS.items()
    }
    for frame in FRAMES:
        bench = study if frame == study.scene.frame else study.in_frame(frame)
        for name, (gait, _, _) in GAITS.items():
            a = found[name]["amplitude"]
            found[name][frame] = {
                tier: bench.poses(tier, gait, a) for tier in ("area", "path", "direct")
            }
    return found


def missed(poses: dict, tier: str) -> np.ndarray:
    """Return the distances (B,) of a tier's positions from those of the force
    balance."""
    return np.hypot(*(poses[tier] - poses["direct"])[:, :2].T)


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.4, 5.2, 2, 2)
    for (name, (_, _, label)), above, below in zip(GAITS.items(), *axes):
        a = numbers[name]["amplitude"]
        above.plot(
            a,
            np.hypot(*numbers[name]["mean"]["direct"][:, :2].T),
            color="0.72",
            lw=4,
            label="force balance",
        )
        for k, frame in enumerate(FRAMES, 1):
            poses = numbers[name][frame]
            look = style.sparse(k, len(a))
            above.plot(
                a,
                np.hypot(*poses["area"][:, :2].T),
                label=f"area, {frame} frame",
                **look,
            )
            below.plot(a, missed(poses, "area"), **look)
        below.plot(a, missed(numbers[name]["mean"], "path"), ":", color=style.BLACK)
        style.entry(above, "path, any frame", ls=":", color=style.BLACK)
        above.set(title=name, ylabel="net distance (BL)", ylim=(0, None))
        below.set(xlabel=label, ylabel="off the force balance by (BL)", ylim=(0, None))
    fig.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3
    )
    return fig


if __name__ == "__main__":
    main("frames_area", compute, draw)
