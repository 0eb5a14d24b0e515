"""The walk of a robot in pictures and films."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgba

from geomech import plots, text
from geomech.core.variables import Result
from geomech.io.files import atomic_file, write_text
from geomech.io.results import write_csv
from geomech.output import animate
from geomech.scenes.walker import WalkerScene
from geomech.studies import walking
from geomech.studies.walking import Walked

TRIPODS = ("0.2", "C0")  # colours of the legs in step
FRAMES, STRIP = 100, 6  # pictures of a film, at most, and of a strip
WIDE, TALL = 6.4, (1.8, 3.6)  # in, of a film and the limits of its height
LABELS = 0.95  # in, of these, for the labels
ROOM = 2.4  # robots to either side of one that is followed


def write(result: Result, folder: Path) -> None:
    """Write walk.json, walk.csv, walk.txt and walk.png."""
    write_csv(folder / "walk.csv", result)
    write_text(folder / "walk.json", json.dumps(text.numbers(result)) + "\n")
    write_text(folder / "walk.txt", text.text(result) + "\n")
    plots.save(draw(*result.subject), folder / "walk.png")


@plots.styled
def draw(scene: WalkerScene, found: Walked):
    """Draw forward speed, height and pitch in time, and the robot at its end."""
    w = found.walk
    fig, axes = plots.figure(7.2, 4.6, 2, 2)
    lines = (
        (r"forward speed (m/s)", w.twist[:, 0]),
        (r"height $z$ (m)", w.pose[:, 1]),
        ("pitch (degrees)", np.degrees(w.pose[:, 2])),
    )
    for ax, (label, values) in zip(axes.ravel(), lines):
        ax.plot(w.t, values, color="black", lw=0.8)
        ax.set(
            xlabel="$t$ (s)", ylabel=label, xlim=(0, w.t[-1] or scene.numerics.duration)
        )
    axes[0, 0].axhline(w.speed, color="C3", lw=1.0, ls="--")
    axes[0, 0].set_title(f"mean {w.speed:.3g} m/s, {w.status}", color="C3")
    _stage(axes[1, 1], scene, found, np.array([len(w.t) - 1]))(len(w.t) - 1)
    return fig


def film(result: Result, path: Path, follow: bool = False) -> None:
    """Write a film (.gif, .mp4) of a walk, or a strip of its last cycle (.png, .pdf, .svg); whole or not at all. follow: the
    camera goes with the robot."""
    scene, found = result.subject
    if not animate.is_film(path):
        plots.save(strip(scene, found), path)
        return
    at = animate.pace(scene.gait.frequency)
    with atomic_file(path) as part:
        animate.encode(
            part, _frames(scene, found, at, follow), at.rate, path.suffix.lower()
        )


@plots.styled
def strip(scene: WalkerScene, found: Walked):
    """Draw the last cycle in pictures."""
    w = found.walk
    times = np.linspace(max(0.0, w.t[-1] - 1 / scene.gait.frequency), w.t[-1], STRIP)
    rows = np.searchsorted(w.t, times - 1e-9).clip(0, len(w.t) - 1)
    fig, axes = plots.figure(2.3 * 3, 1.9 * 2, 3, 2, layout="compressed")
    for ax, row in zip(axes.ravel(), rows):
        _stage(ax, scene, found, np.array([row]))(row)
        ax.label_outer(remove_inner_ticks=False)
        ax.tick_params(labelbottom=True)
    return fig


def _frames(
    scene: WalkerScene, found: Walked, at: animate.Pace, follow: bool
) -> Iterator[np.ndarray]:
    """Yield pictures (height, width, 3), bytes, at the rate of the film: by MuJoCo for a walk of three dimensions where there
    is a GL to draw with."""
    w, speed = found.walk, 1 / (scene.gait.frequency * at.cycle)
    times = np.arange(min(FRAMES, 1 + int(w.t[-1] / speed * at.rate))) * speed / at.rate
    rows = np.searchsorted(w.t, times - 1e-9).clip(0, len(w.t) - 1)
    pictures = w.spatial and walking.view(scene).pictures(w.spatial["states"][rows])
    return (
        _captioned(pictures, w.t[rows], at.caption)
        if pictures
        else _drawn(scene, found, rows, at.caption, follow)
    )


def _captioned(
    pictures: Iterator[np.ndarray], times: np.ndarray, caption: str
) -> Iterator[np.ndarray]:
    """Yield pictures with the time and the speed of the film in their upper corners."""
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.load_default(14)
    for picture, t in zip(pictures, times):
        image = Image.fromarray(picture)
        draw, words = (
            ImageDraw.Draw(image),
            {"fill": "white", "font": font, "stroke_width": 1, "stroke_fill": "black"},
        )
        draw.text((10, 8), f"t = {t:.2f} s", **words)
        draw.text((image.width - 10, 8), caption, anchor="ra", **words)
        yield np.array(image)


@plots.styled
def _drawn(
    scene: WalkerScene, found: Walked, rows: np.ndarray, caption: str, follow: bool
) -> Iterator[np.ndarray]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, axes = plots.figure(WIDE, TALL[1])
    ax = axes[0, 0]
    update = _stage(ax, scene, found, rows, follow)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    fig.set_figheight(
        float(np.clip((WIDE - LABELS) * (high - low) / (right - left) + LABELS, *TALL))
    )
    ax.set_title(caption, loc="right", fontsize=8, color="0.3")
    fig.set_dpi(animate.DOTS)
    canvas = FigureCanvasAgg(fig)
    for row in rows:
        update(row)
        canvas.draw()
        fig.set_layout_engine("none")  # so that the axes stand still
        yield np.array(canvas.buffer_rgba())[..., :3]


def _stage(
    ax, scene: WalkerScene, found: Walked, rows: np.ndarray, follow: bool = False
):
    """Draw the ground on axes that hold the robot at these rows of its walk; return a function that draws it at one. follow:
    the axes move with the robot."""
    robot = _Solid(scene, found) if found.walk.spatial else _Flat(scene, found)
    room, reach = robot.room * (ROOM if follow else 1.1), robot.reach
    x = found.walk.pose[rows, 0]
    ax.axhspan(-3 * reach, 0.0, color="peru", alpha=0.35, lw=0)
    seen = x[:1] if follow else x
    limits = {
        "xlim": (seen.min() - room, seen.max() + room),
        "ylim": (-1.2 * reach, 3.2 * reach),
    }
    ax.set(**limits, aspect="equal", xlabel="$x$ (m)", ylabel="$z$ (m)")
    draw, label = robot.on(ax), ax.set_title("", loc="left", fontsize=8)

    def update(row):
        draw(row)
        label.set_text(f"t = {found.walk.t[row]:.2f} s")
        if follow:
            ax.set_xlim(found.walk.pose[row, 0] - room, found.walk.pose[row, 0] + room)

    return update


class _Flat:
    """Outlines of a robot in the vertical plane. room: that it takes to both sides; reach: of its legs, m."""

    def __init__(self, scene: WalkerScene, found: Walked):
        self.robot, self.gait, self.walk = scene.robot, scene.gait, found.walk
        self.leg, self.belly = scene.robot.leg(40).points, scene.robot.belly(8)
        self.reach, self.hips = (
            np.abs(self.leg).max(),
            [(h, scene.robot.hip_height) for h in scene.robot.hips],
        )
        extents = [
            self.reach,
            *(abs(h) + self.reach for h, _ in self.hips),
            getattr(scene.robot, "length", 0.0) / 2,
        ]
        self.room = max(extents)

    def on(self, ax):
        legs = [(k, at) for k in range(len(self.hips)) for at in self.robot.hip_phases]
        lines = [
            ax.plot([], [], color=TRIPODS[int((k + 2 * at) % 2)], lw=1.2)[0]
            for k, at in legs
        ]
        box = ax.plot([], [], color="black", lw=1.2)[0]

        def draw(row):
            pose, t = self.walk.pose[row], self.walk.t[row]
            for line, (k, at) in zip(lines, legs):
                phase = (
                    self.gait.frequency * t + (k * self.robot.hip_phases[-1] + at) % 1.0
                )
                hip = _rotated(np.array([self.hips[k]]), pose[2]) + pose[:2]
                line.set_data(
                    *(
                        _rotated(
                            self.leg, pose[2] + float(self.gait.angle(phase, phase))
                        )
                        + hip
                    ).T
                )
            if self.belly is not None:
                box.set_data(*(_rotated(self.belly.points, pose[2]) + pose[:2]).T)

        return draw


class _Solid:
    """Triangles of a robot in three dimensions, seen from its right. room, reach: as for `_Flat`."""

    def __init__(self, scene: WalkerScene, found: Walked):
        self.view, self.walk = walking.view(scene), found.walk
        first = self.view.triangles(self.walk.spatial["states"][0]).reshape(-1, 3)
        self.room = float(np.abs(first[:, [0, 1]] - [self.walk.pose[0, 0], 0.0]).max())
        self.reach = max(float(np.ptp(first[:, 2])), self.room / 4) / 2

    def on(self, ax):
        from matplotlib.collections import PolyCollection

        colours = np.array([to_rgba(c) for c in ("0.75", *TRIPODS)])[self.view.groups]
        drawn = ax.add_collection(
            PolyCollection([], lw=1.0)
        )  # sheets are seen by their edges

        def draw(row):
            triangles = self.view.triangles(self.walk.spatial["states"][row])
            order = np.argsort(
                -triangles[..., 1].mean(1), kind="stable"
            )  # what is farther off first
            drawn.set_verts(triangles[order][..., [0, 2]])
            drawn.set_facecolor(colours[order])
            drawn.set_edgecolor(colours[order])

        return draw


def _rotated(points: np.ndarray, angle: float) -> np.ndarray:
    return points @ np.array(
        [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    )
