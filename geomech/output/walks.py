"""How a robot walks as text, a table, JSON, a picture and a film."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from geomech.files import whole_file
from geomech.output import animate, plots
from geomech.scene.walker import WalkerScene
from geomech.study.walking import Walked

FRAMES, STRIP = 100, 6  # pictures of a film, at most, and of a strip
COLUMNS = ("t", "x", "z", "pitch", "v_x", "v_z", "rate", "work", "loss", "energy")


def columns(found: Walked) -> dict[str, np.ndarray]:
    """Of the table: SI units, radians, a positive pitch nose down."""
    w = found.walk
    return dict(zip(COLUMNS, (w.t, *w.pose.T, *w.twist.T, w.work, w.loss, w.energy)))


def as_json(found: Walked) -> str:
    w = found.walk
    series = {name: values.tolist() for name, values in columns(found).items() if name in ("t", "x", "z", "pitch")}
    numbers = {"cycles": w.cycles, "estimate": found.estimate, "periodic": w.periodic, "unsolved": w.unsolved}
    return json.dumps({"speed": w.speed, "status": w.status, **series, **numbers})


def told(scene: WalkerScene, found: Walked) -> str:
    """Speed, status, energy."""
    w, f = found.walk, scene.gait.frequency
    turned = scene.robot.mass * 9.81 * w.speed
    regular = "limit cycle" if w.periodic else "no limit cycle found: mean of what there is"
    share = f", {(w.work[-1] / w.t[-1]) / turned:.3g} times weight times speed" if w.status == "walking" else ""
    return "\n".join([
        f"{scene.name}: {w.status} at {w.speed:.4g} +- {found.estimate:.1g} m/s ({regular}, {w.cycles:g} cycles at {f:g} Hz)",
        f"t = 0 to {w.t[-1]:.4g} s: x to {w.pose[-1, 0]:.4g} m, z {w.pose[:, 1].min():.4g} to {w.pose[:, 1].max():.4g} m, "
        f"pitch {np.degrees(w.pose[:, 2].min()):.3g} to {np.degrees(w.pose[:, 2].max()):.3g} degrees (positive: nose down)",
        f"work of the motors {w.work[-1]:.4g} J{share}; into the ground {w.loss[-1]:.4g} J",
        *([f"{w.unsolved} steps were taken unsolved: raise [numerics] steps or rounding"] if w.unsolved else []),
    ])  # fmt: skip


def save(folder: Path, scene: WalkerScene, found: Walked) -> None:
    """walk.json, walk.csv, walk.txt and walk.png."""
    table = columns(found)
    rows = [",".join(table), *(",".join(map(repr, row)) for row in np.stack(list(table.values()), -1).tolist())]
    (folder / "walk.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (folder / "walk.json").write_text(as_json(found) + "\n", encoding="utf-8")
    (folder / "walk.txt").write_text(told(scene, found) + "\n", encoding="utf-8", errors="backslashreplace")
    plots.save(draw(scene, found), folder / "walk.png")


@plots.styled
def draw(scene: WalkerScene, found: Walked):
    """Forward speed, height and pitch in time, and the robot at its end."""
    w = found.walk
    fig, axes = plots.figure(7.2, 4.6, 2, 2)
    lines = (
        (r"forward speed (m/s)", w.twist[:, 0]),
        (r"height $z$ (m)", w.pose[:, 1]),
        ("pitch (degrees)", np.degrees(w.pose[:, 2])),
    )
    for ax, (label, values) in zip(axes.ravel(), lines):
        ax.plot(w.t, values, color="black", lw=0.8)
        ax.set(xlabel="$t$ (s)", ylabel=label, xlim=(0, w.t[-1]))
    axes[0, 0].axhline(w.speed, color="C3", lw=1.0, ls="--")
    axes[0, 0].set_title(f"mean {w.speed:.3g} m/s, {w.status}", color="C3")
    put = _stage(axes[1, 1], scene, w.pose[-1:, 0])
    put(w.pose[-1], w.t[-1])
    return fig


def film(path: Path, scene: WalkerScene, found: Walked) -> None:
    """A film (.gif, .mp4) of the walk, or a strip of its last cycle (.png, .pdf, .svg); whole or not at all."""
    if not animate.is_film(path):
        plots.save(strip(scene, found), path)
        return
    frames = _frames(scene, found)
    with whole_file(path) as part:
        (animate._gif if path.suffix.lower() == ".gif" else animate._mp4)(part, frames)


@plots.styled
def strip(scene: WalkerScene, found: Walked):
    """The last cycle in pictures."""
    w = found.walk
    times = np.linspace(max(0.0, w.t[-1] - 1 / scene.gait.frequency), w.t[-1], STRIP)
    rows = np.searchsorted(w.t, times - 1e-9).clip(0, len(w.t) - 1)
    fig, axes = plots.figure(3.2 * 3, 1.9 * 2, 3, 2)
    for ax, row in zip(axes.ravel(), rows):
        _stage(ax, scene, w.pose[[row], 0])(w.pose[row], w.t[row])
    return fig


@plots.styled
def _frames(scene: WalkerScene, found: Walked) -> Iterator[np.ndarray]:
    """Pictures (height, width, 3), bytes, at the pace of the film."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    w = found.walk
    last = min(w.t[-1], FRAMES / animate.RATE)
    times = np.arange(0.0, last, max(1 / animate.RATE, last / FRAMES))
    rows = np.searchsorted(w.t, times - 1e-9).clip(0, len(w.t) - 1)
    fig, axes = plots.figure(6.4, 2.4)
    put = _stage(axes[0, 0], scene, w.pose[rows, 0])
    fig.set_dpi(animate.DOTS)
    canvas = FigureCanvasAgg(fig)
    for row in rows:
        put(w.pose[row], w.t[row])
        canvas.draw()
        yield np.array(canvas.buffer_rgba())[..., :3]


def _stage(ax, scene: WalkerScene, x: np.ndarray):
    """Ground and axes that hold these places; a function that puts the robot there."""
    robot, gait = scene.robot, scene.gait
    leg, belly = robot.leg(40).points, robot.belly(8)
    reach, hips = np.abs(leg).max(), [(h, robot.hip_height) for h in robot.hips]
    room = max([reach, *(abs(h) + reach for h, _ in hips), getattr(robot, "length", 0.0) / 2]) * 1.1
    low, high = x.min() - room, x.max() + room
    ax.axhspan(-3 * reach, 0.0, color="peru", alpha=0.35, lw=0)
    ax.set(xlim=(low, high), ylim=(-1.2 * reach, 3.2 * reach), aspect="equal", xlabel="$x$ (m)", ylabel="$z$ (m)")
    turned = lambda points, angle: points @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    legs = [(k, at) for k in range(len(hips)) for at in robot.apart]
    lines = [ax.plot([], [], color="C0" if (k + 2 * at) % 2 else "0.2", lw=1.2)[0] for k, at in legs]
    box = ax.plot([], [], color="black", lw=1.2)[0]
    label = ax.set_title("", loc="left", fontsize=8)

    def put(pose, t):
        for line, (k, at) in zip(lines, legs):
            phase = gait.frequency * t + (k * robot.apart[-1] + at) % 1.0
            hip = turned(np.array([hips[k]]), pose[2]) + pose[:2]
            line.set_data(*(turned(leg, pose[2] + float(gait.angle(phase, phase))) + hip).T)
        if belly is not None:
            box.set_data(*(turned(belly.points, pose[2]) + pose[:2]).T)
        label.set_text(f"t = {t:.2f} s")

    return put


@plots.styled
def accuracy_figure(results: dict):
    """Error of the speed against each knob (`geomech.study.walking.study`)."""
    fig, axes = plots.figure(8.4, 2.9, len(results["lines"]))
    labels = {"steps": "steps of a cycle", "elements": "elements of an outline", "rounding": "rounding (m/s)"}
    for ax, line in zip(axes[0], results["lines"]):
        value, error = np.array(line["value"], float), np.maximum(line["error"], 1e-12)
        ax.loglog(value, error, "o-", color="black", lw=1.0)
        sign = 1 if line["label"] == "rounding" else -1
        slope = error.max() * (value / value[error.argmax()]) ** (sign * line["order"])
        ax.loglog(value, slope, color="0.6", ls="--", lw=0.8, label=f"order {line['order']}")
        ax.set(xlabel=labels[line["label"]], ylabel="error of the speed (m/s)")
        ax.set_xticks(value, [f"{v:g}" for v in value], rotation=45)
        ax.minorticks_off()
        ax.legend(loc="best")
    return fig
