"""Body frames: the area tier in loose glass beads, in the mean, middle-link and
minimum-perturbation frames, compared with the balance of forces.

Above: net distance per cycle by the area under the CCF in each frame, and by the
balance of forces, which is the same in all frames. Below: distance of the area tier
from the balance of forces in the same frame and, dotted, distance of the path tier,
which integrates the same fitted connection along the gait. No frame removes the error
of the path tier.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Butterfly, Circle
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables

FRAMES = ("mean", "link-2", "minimum-perturbation")
GAITS = {  # gait, largest amplitude, name of the amplitude
    "circle": (Circle(), 2.0, "radius of the circle (rad)"),
    "butterfly": (Butterfly(), 1.2, "scale of the butterfly"),
}
TIERS = ("area", "path", "direct")


def compute(scene: str = "three-link-glass", count: int = 20, grid: int = 31) -> dict:
    """Return {gait: {"amplitude": (B,), frame: {tier: (B, 3)}}} of net poses, body
    lengths and rad, each in its own frame.

    The grid covers the gaits.
    """
    tables = SceneTables(load(scene)).with_numerics(grid=grid, extent=2.7)
    numbers: dict = {}
    for name, (_, largest, _) in GAITS.items():
        numbers[name] = {"amplitude": np.linspace(0, largest, count + 1)[1:]}
    for frame in FRAMES:
        frame_tables = tables
        if frame != tables.scene.frame:
            frame_tables = tables.in_frame(frame)
        for name, (gait, _, _) in GAITS.items():
            amplitude = numbers[name]["amplitude"]
            poses = {tier: frame_tables.poses(tier, gait, amplitude) for tier in TIERS}
            numbers[name][frame] = poses
    return numbers


def net_distance(poses: np.ndarray) -> np.ndarray:
    """Return the distances (B,) of net poses (B, 3)."""
    return np.hypot(*poses[:, :2].T)


def position_error(poses: dict, tier: str) -> np.ndarray:
    """Return the distances (B,) of a tier's positions from those of the force
    balance."""
    return net_distance(poses[tier] - poses["direct"])


@plots.styled
def draw(numbers: dict):
    """Draw a column for each gait: distances above, errors below."""
    fig, axes = plots.figure(7.4, 5.2, 2, 2)
    for column, name in zip(axes.T, GAITS):
        draw_gait(column, name, numbers[name])
    fig.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3
    )
    return fig


def draw_gait(column, name: str, gait_numbers: dict) -> None:
    """Draw net distances by frame on the upper axes, and errors on the lower ones."""
    distance_ax, error_ax = column
    amplitude = gait_numbers["amplitude"]
    exact = net_distance(gait_numbers["mean"]["direct"])
    distance_ax.plot(amplitude, exact, color="0.72", lw=4, label="force balance")
    for k, frame in enumerate(FRAMES, 1):
        poses = gait_numbers[frame]
        look = style.curve_look(k, len(amplitude))
        by_area = net_distance(poses["area"])
        distance_ax.plot(amplitude, by_area, label=f"area, {frame} frame", **look)
        error_ax.plot(amplitude, position_error(poses, "area"), **look)
    path_error = position_error(gait_numbers["mean"], "path")
    error_ax.plot(amplitude, path_error, ":", color=style.BLACK)
    style.add_entry(distance_ax, "path, any frame", ls=":", color=style.BLACK)
    _, _, label = GAITS[name]
    distance_ax.set(title=name, ylabel="net distance (BL)", ylim=(0, None))
    error_ax.set(xlabel=label, ylabel="off the force balance by (BL)", ylim=(0, None))


if __name__ == "__main__":
    main("frames_area", compute, draw)
