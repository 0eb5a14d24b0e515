"""A gait for sand: a hexapod in MuJoCo learns to walk in loose poppy seeds and on a
hard floor, and each gait is tried on both.

The cross-entropy method searches over the frequency, duty, sweep and middle angle of
the clock of a tripod gait, with a few hundred walks of three seconds on each ground,
all in `mujoco.batch.Batch` (MuJoCo 4). All sizes are assumed.
"""

from __future__ import annotations

import warnings

import numpy as np

from figures import main, style
from geomech import plots
from rft.terradynamics.walking import Tripod

PHASES = 0.5 * np.array([0, 1, 1, 0, 0, 1])  # of the legs, cycles: a tripod
MEDIUM = "poppy-seeds-loose"
# Hz, -, rad, rad: of the clock
LOW = np.array([1.0, 0.3, 0.6, -0.6])
HIGH = np.array([4.0, 0.8, 2.4, 0.6])
SNAPSHOTS = 6  # of one cycle


def leg_angles(clocks: np.ndarray, seconds: float, step: float) -> np.ndarray:
    """Return the angles (n, steps, 6) of the legs, rad, by clocks (n, 4)."""
    time = step * np.arange(round(seconds / step))[:, None]
    angles = []
    for clock in clocks:
        gait = Tripod(*map(float, clock))
        phase = gait.frequency * time + PHASES
        angles.append(gait.angle(phase, phase + 1e-9))
    return np.stack(angles)


def walk(
    batch, clocks: np.ndarray, seconds: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return speeds (n,), m/s, over the last two thirds of walks, 0 for those that end
    upside down, and positions (n, steps, 7 + joints) by clocks (n, 4)."""
    batch.reset()
    angles = leg_angles(clocks, seconds, step)
    n_steps = angles.shape[1]
    path = batch.rollout(n_steps, control=angles)["qpos"]
    # Entry (3, 3) of the trunk's rotation matrix, by its quaternion.
    upright = 1.0 - 2.0 * (path[:, -1, 4] ** 2 + path[:, -1, 5] ** 2)
    third = n_steps // 3
    duration = seconds * (1 - third / n_steps)
    speed = (path[:, -1, 0] - path[:, third, 0]) / duration
    return np.where((upright > 0.5) & np.isfinite(speed), speed, 0.0), path


def search(
    batch, generations: int, seconds: float, step: float, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the best clock (4,) and the best speed of each generation, by the
    cross-entropy method."""
    rng = np.random.default_rng(seed)
    n = batch.nsim
    mean = (LOW + HIGH) / 2
    deviation = (HIGH - LOW) / 4
    best = None
    speeds = []
    for _ in range(generations):
        clocks = np.clip(mean + deviation * rng.standard_normal((n, 4)), LOW, HIGH)
        if best is not None:
            clocks[0] = best
        speed, _ = walk(batch, clocks, seconds, step)
        elite = clocks[np.argsort(-speed)[: max(2, n // 5)]]
        mean = elite.mean(0)
        deviation = elite.std(0) + 0.02 * (HIGH - LOW)
        best = elite[0]
        speeds.append(float(speed.max()))
    return best, np.array(speeds)


def compute(generations: int = 8, walks: int = 32, seconds: float = 3.0) -> dict:
    """Return "clocks": {ground: (4,)}, "best_speeds": {ground: by generation, m/s},
    "speeds": (2, 2), m/s, of the gaits for sand and floor (rows) in sand and on the
    floor (columns), and "strip", a cycle of the gait for sand in it."""
    # MuJoCo is an extra, and heavy.
    from mujoco.batch import Batch

    from rft.mujoco import attach
    from rft.mujoco.example import hexapod

    hard = hexapod()
    soft = hexapod()
    step = float(soft.opt.timestep)
    with warnings.catch_warnings():
        # `attach` warns that the legs no longer touch the floor.
        warnings.simplefilter("ignore")
        sand = attach(soft, MEDIUM, element=0.03)
    with sand:
        batches = {
            "sand": sand.batch(walks, persistent=True),
            "floor": Batch(hard, walks, persistent=True),
        }
        clocks = {}
        best_speeds = {}
        for name, batch in batches.items():
            clocks[name], best_speeds[name] = search(batch, generations, seconds, step)

        # A batch always runs all of its walks: the rest are copies.
        copies = [clocks["sand"]] * (walks - 2)
        all_clocks = np.stack([clocks["sand"], clocks["floor"], *copies])
        sand_speeds, path = walk(batches["sand"], all_clocks, seconds, step)
        floor_speeds, _ = walk(batches["floor"], all_clocks, seconds, step)

    steps_per_cycle = round(1 / (clocks["sand"][0] * step))
    return {
        "clocks": clocks,
        "best_speeds": best_speeds,
        "speeds": np.stack([sand_speeds[:2], floor_speeds[:2]], 1),
        "strip": snapshots(soft, path[0], steps_per_cycle),
    }


def snapshots(robot, path: np.ndarray, steps_per_cycle: int) -> list[tuple]:
    """Return outlines of a robot at times in the last cycle of its path (steps, 7 +
    joints)."""
    import mujoco

    data = mujoco.MjData(robot)
    last = len(path) - 1
    outlines = []
    for k in np.linspace(last - steps_per_cycle, last, SNAPSHOTS).astype(int):
        data.qpos[:] = path[k]
        mujoco.mj_kinematics(robot, data)
        outlines.append(outline(robot, data))
    return outlines


def outline(robot, data) -> tuple[np.ndarray, np.ndarray]:
    """Return the trunk's corners (4, 2) and the legs' ends (6, 2, 2) as seen from the
    side, x and z, m."""
    rotation = data.geom_xmat[1].reshape(3, 3)
    half_x, _, half_z = robot.geom_size[1]
    signs = np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)])
    corners = data.geom_xpos[1] + signs * [half_x, 0, half_z] @ rotation.T

    middles = data.geom_xpos[2:]
    axes = data.geom_xmat[2:].reshape(-1, 3, 3)[:, :, 2] * robot.geom_size[2:, 1:2]
    legs = np.stack([middles - axes, middles + axes], 1)
    return corners[:, [0, 2]], legs[:, :, [0, 2]]


def table(numbers: dict) -> str:
    """Return the speeds of both gaits on both grounds, and their clocks."""
    heads = (
        "gait",
        "in sand (m/s)",
        "on floor (m/s)",
        "Hz",
        "duty",
        "sweep (rad)",
        "middle (rad)",
    )
    rows = []
    for name, speeds in zip(("sand", "floor"), numbers["speeds"]):
        row = [f"for {name}"]
        row += [f"{speed:.3f}" for speed in speeds]
        row += [f"{x:.2f}" for x in numbers["clocks"][name]]
        rows.append(row)
    return style.table(heads, rows)


COLOURS = {"sand": style.LOOSE, "floor": style.BLUE}


@plots.styled
def draw(numbers: dict):
    """Draw the search, the speeds of both gaits, and a cycle of the gait for sand."""
    fig, axes = plots.figure(7.4, 3.9, 2, 2)
    grid = axes[0, 0].get_gridspec()
    grid.set_height_ratios([3.0, 1.0])
    for ax in axes[1]:
        ax.remove()
    draw_search(axes[0, 0], numbers["best_speeds"])
    draw_speeds(axes[0, 1], numbers["speeds"])
    draw_strip(fig.add_subplot(grid[1, :]), numbers["strip"])
    return fig


def draw_search(ax, best_speeds: dict) -> None:
    """Draw the best speed of each generation on both grounds."""
    for (name, speeds), marker in zip(best_speeds.items(), style.MARKERS):
        generation = np.arange(1, len(speeds) + 1)
        look = {"color": COLOURS[name], "marker": marker, "ms": 4, "label": name}
        ax.plot(generation, speeds, **look)
    ax.set(xlabel="generation", ylabel="best speed (m/s)", title="search")
    ax.legend(title="ground")


def draw_speeds(ax, speeds: np.ndarray) -> None:
    """Draw the speeds (2, 2) of both gaits on both grounds."""
    for row, (name, colour) in enumerate(COLOURS.items()):
        x = np.arange(2) + 0.4 * row - 0.2
        ax.bar(x, speeds[row], 0.38, color=colour, label=f"for {name}")
        # `walk` counts a robot that ends upside down as 0 m/s.
        note = {"color": colour, "rotation": 90, "ha": "center", "va": "bottom"}
        for overturned in x[speeds[row] == 0.0]:
            ax.text(overturned, 0.02, "overturns", **note)
    ax.set(ylabel="speed (m/s)", title="both gaits on both grounds")
    ax.set_xticks([0, 1], ["in sand", "on the floor"])
    ax.legend()


def draw_strip(ax, outlines: list[tuple]) -> None:
    """Draw outlines of the robot next to each other, a colour for each tripod."""
    start = 0.0
    for corners, legs in outlines:
        shift = np.array([start - corners[0, 0] + 0.1, 0.0])
        ax.fill(*(corners + shift).T, color="0.8", ec="0.3", lw=0.8)
        for phase, leg in zip(PHASES, legs):
            look = {"color": style.SEQUENCE[1 + int(2 * phase)], "lw": 2.0}
            ax.plot(*(leg + shift).T, solid_capstyle="round", **look)
        start += 0.34
    ax.axhline(0.0, **style.SURFACE)
    ax.set(
        aspect="equal",
        xlabel="a cycle of the gait for sand, in sand, from left to right",
        ylabel="z (m)",
        xticks=[],
    )


if __name__ == "__main__":
    main("sand_gaits", compute, draw, table)
