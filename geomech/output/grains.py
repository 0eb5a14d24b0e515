"""Results of grains as folders of files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from geomech import plots, text
from geomech.core.variables import Result
from geomech.io.files import write_text
from geomech.systems.base import body_size
from geomech.text import drag_grains, grain_swim


def write_drag(result: Result, folder: Path) -> None:
    """Write drag.csv, which ``fit-medium`` reads, drag.json and drag.txt."""
    write_text(folder / "drag.csv", drag_grains.csv(result))
    write_text(folder / "drag.json", json.dumps(text.numbers(result)) + "\n")
    write_text(folder / "drag.txt", text.text(result) + "\n")


def about_drag(result: Result, folder: Path) -> str:
    """Return what to do with the files."""
    return f"wrote {folder}/drag.csv: geomech fit-medium {folder}/drag.csv --end-caps fitted -o sand.toml"


def write_swim(result: Result, folder: Path) -> None:
    """Write motion.csv, grains.json, grains.txt and grains.png."""
    write_text(folder / "motion.csv", grain_swim.csv(result))
    write_text(folder / "grains.json", json.dumps(text.numbers(result)) + "\n")
    write_text(folder / "grains.txt", text.text(result) + "\n")
    plots.save(draw_swim(result), folder / "grains.png")


@plots.styled
def draw_swim(result: Result):
    """Draw the body at the start of every cycle with the path of its frame, and the distance per cycle by every method."""
    question, run = result.subject
    fig, axes = plots.figure(7.2, 3.0, 2, 1)
    left, right = axes[0]
    size, body = result.attributes["size"], question.swimmer.body
    unit = size / body_size(body)
    starts = [0.0, *((0.5 + np.arange(question.cycles + 1)) / question.frequency)]
    left.plot(*(run.pose[:, :2].T / size), color="0.5", lw=0.6)
    for k, t in enumerate(starts):
        row = min(np.searchsorted(run.t, t), len(run.t) - 1)
        pose = run.pose[row] / [unit, unit, 1.0]
        points = unit / size * body.points(run.alpha[row], pose)
        left.plot(*points.T, color="black", lw=1.2, alpha=0.3 + 0.7 * k / len(starts))
    left.set(xlabel="$x$ (BL)", ylabel="$y$ (BL)", aspect="equal")
    names = result["method"].values.tolist()
    x, y, dx, dy = (
        v
        for v in (
            result["x"].values,
            result["y"].values,
            result["x"].error,
            result["y"].error,
        )
    )
    distance = np.hypot(x, y)
    error = np.nan_to_num(
        np.hypot(x * dx, y * dy) / np.where(distance > 0, distance, 1.0)
    )
    colours = ["0.6"] * (len(names) - 1) + ["#D55E00"]
    right.barh(range(len(names)), distance, xerr=error, color=colours, height=0.6)
    right.set_yticks(range(len(names)), names)
    right.invert_yaxis()
    right.set(
        xlabel="distance per cycle (BL)",
        xlim=(0, 1.15 * (distance + error).max() or None),
    )
    right.locator_params(axis="x", nbins=5)
    return fig
