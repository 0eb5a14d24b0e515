"""A gait for sand: a hexapod in MuJoCo learns to walk in loose poppy seeds and on a
hard floor, and each gait is tried on both.

A search by the cross-entropy method over frequency, duty, sweep and middle angle of a
tripod's clock, a few hundred walks of three seconds on each ground, all in
`mujoco.batch.Batch` (MuJoCo 4). All sizes are assumed.
"""

from __future__ import annotations

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


def controls(clock: np.ndarray, seconds: float, step: float) -> np.ndarray:
    """Return the angles (n, steps, 6) of the legs, rad, by clocks (n, 4)."""
    time = step * np.arange(round(seconds / step))[:, None]
    gaits = [Tripod(*map(float, one)) for one in clock]
    return np.stack(
        [
            g.angle(g.frequency * time + PHASES, g.frequency * time + PHASES + 1e-9)
            for g in gaits
        ]
    )


def walk(
    batch, clock: np.ndarray, seconds: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return speeds (n,), m/s, over the last two thirds of walks, 0 for those that end
    upside down, and positions."""
    batch.reset()
    angles = controls(clock, seconds, step)
    path = batch.rollout(angles.shape[1], control=angles)["qpos"]
    upright = 1.0 - 2.0 * (path[:, -1, 4] ** 2 + path[:, -1, 5] ** 2)
    third = angles.shape[1] // 3
    speed = (path[:, -1, 0] - path[:, third, 0]) / (
        seconds * (1 - third / angles.shape[1])
    )
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
        clock = np.clip(mean + deviation * rng.standard_normal((n, 4)), LOW, HIGH)
        if best is not None:
            clock[0] = best
        speed, _ = walk(batch, clock, seconds, step)
        elite = clock[np.argsort(-speed)[: max(2, n // 5)]]
        mean = elite.mean(0)
        deviation = elite.std(0) + 0.02 * (HIGH - LOW)
        best = elite[0]
        speeds.append(float(speed.max()))
    return best, np.array(speeds)


def compute(generations: int = 8, walks: int = 32, seconds: float = 3.0) -> dict:
    """Return "clocks": {ground: (4,)}, "found": {ground: best speed by generation},
    "speeds": (2, 2), m/s, of the gaits for sand and floor (rows) in sand and on the
    floor (columns), and "strip", a cycle of the gait for sand in it."""
    import warnings

    import mujoco
    from mujoco.batch import Batch

    from rft.mujoco import attach
    from rft.mujoco.example import hexapod

    hard = hexapod()
    soft = hexapod()
    step = float(soft.opt.timestep)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the legs touch the floor no more
        sand = attach(soft, MEDIUM, element=0.03)
    with sand:
        batches = {
            "sand": sand.batch(walks, persistent=True),
            "floor": Batch(hard, walks, persistent=True),
        }
        results = {
            name: search(batch, generations, seconds, step)
            for name, batch in batches.items()
        }
        clocks = {name: clock for name, (clock, _) in results.items()}
        both = np.stack([*clocks.values(), *[clocks["sand"]] * (walks - 2)])
        tried = {
            name: walk(batch, both, seconds, step) for name, batch in batches.items()
        }
    path = tried["sand"][1][0]
    data = mujoco.MjData(soft)
    cycle = round(1 / (clocks["sand"][0] * step))
    shapes = []
    for k in np.linspace(len(path) - cycle - 1, len(path) - 1, SNAPSHOTS).astype(int):
        data.qpos[:] = path[k]
        mujoco.mj_kinematics(soft, data)
        shapes.append(_outline(soft, data))
    speeds = np.stack([speed[:2] for speed, _ in tried.values()], 1)
    return {
        "clocks": clocks,
        "found": {k: x for k, (_, x) in results.items()},
        "speeds": speeds,
        "strip": shapes,
    }


def _outline(robot, data) -> tuple[np.ndarray, np.ndarray]:
    """Return the trunk's corners (4, 2) and the legs' ends (6, 2, 2) as seen from the
    side, x and z, m."""
    turn = data.geom_xmat[1].reshape(3, 3)
    place = data.geom_xpos[1]
    half = robot.geom_size[1]
    corners = (
        place
        + np.array(
            [
                (a * half[0], 0, b * half[2])
                for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
        )
        @ turn.T
    )
    axes = data.geom_xmat[2:].reshape(-1, 3, 3)[:, :, 2] * robot.geom_size[2:, 1:2]
    legs = np.stack([data.geom_xpos[2:] - axes, data.geom_xpos[2:] + axes], 1)
    return corners[:, [0, 2]], legs[:, :, [0, 2]]


def table(numbers: dict) -> str:
    """Return the speeds of both gaits on both grounds, and their clocks."""
    rows = [
        (
            f"for {name}",
            *(f"{x:.3f}" for x in speeds),
            *(f"{x:.2f}" for x in numbers["clocks"][name]),
        )
        for name, speeds in zip(("sand", "floor"), numbers["speeds"])
    ]
    return style.table(
        (
            "gait",
            "in sand (m/s)",
            "on floor (m/s)",
            "Hz",
            "duty",
            "sweep (rad)",
            "middle (rad)",
        ),
        rows,
    )


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.4, 3.9, 2, 2)
    grid = axes[0, 0].get_gridspec()
    grid.set_height_ratios([3.0, 1.0])
    for ax in axes[1]:
        ax.remove()
    strip = fig.add_subplot(grid[1, :])
    colours = {"sand": style.LOOSE, "floor": style.BLUE}
    for (name, speeds), marker in zip(numbers["found"].items(), style.MARKERS):
        axes[0, 0].plot(
            np.arange(1, len(speeds) + 1),
            speeds,
            color=colours[name],
            marker=marker,
            ms=4,
            label=name,
        )
    axes[0, 0].set(xlabel="generation", ylabel="best speed (m/s)", title="search")
    axes[0, 0].legend(title="ground")
    for row, (name, colour) in enumerate(colours.items()):
        speeds = numbers["speeds"][row]
        x = np.arange(2) + 0.4 * row - 0.2
        axes[0, 1].bar(x, speeds, 0.38, color=colour, label=f"for {name}")
        for overturned in x[speeds == 0.0]:
            # `walk` counts a robot that ends upside down as 0 m/s.
            axes[0, 1].text(
                overturned,
                0.02,
                "overturns",
                color=colour,
                rotation=90,
                ha="center",
                va="bottom",
            )
    axes[0, 1].set(ylabel="speed (m/s)", title="both gaits on both grounds")
    axes[0, 1].set_xticks([0, 1], ["in sand", "on the floor"])
    axes[0, 1].legend()
    left = 0.0
    for corners, legs in numbers["strip"]:
        shift = np.array([left - corners[0, 0] + 0.1, 0.0])
        strip.fill(*(corners + shift).T, color="0.8", ec="0.3", lw=0.8)
        for k, leg in enumerate(legs):
            strip.plot(
                *(leg + shift).T,
                color=style.SEQUENCE[1 + int(2 * PHASES[k])],
                lw=2.0,
                solid_capstyle="round",
            )
        left += 0.34
    strip.axhline(0.0, **style.SURFACE)
    strip.set(
        aspect="equal",
        xlabel="a cycle of the gait for sand, in sand, from left to right",
        ylabel="z (m)",
        xticks=[],
    )
    return fig


if __name__ == "__main__":
    main("sand_gaits", compute, draw, table)
