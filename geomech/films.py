"""Films of results: GIF by Pillow, MP4 by ffmpeg where that is installed.

A film is drawn from a result, computed or read from a file.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from geomech import plots
from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.plots.walking import rows_at, walk_stage
from geomech.results.scenes import scene_of
from geomech.run.cost import Cost
from geomech.run.progress import counted
from geomech.run.progress import progress as progress_bar
from geomech.studies import walking
from rft.core.refusal import Refusal

RATE, SLOW_RATE = 25, 10  # frames a second; of cycles that take long
LONG = 4.0  # s: the longest cycle at RATE
CYCLE = 2.0  # s that a cycle takes without a frequency
# s that a cycle takes: ten pictures to see it by, and patience
SHORTEST, LONGEST = 0.4, 10.0
STEPS = (1.0, 2.0, 5.0)  # of speeds, times a power of ten
SLACK = 1 + 1e-9  # factor by which a time may miss a limit by rounding
DOTS = 100  # an inch
DRAWING = 0.012  # s a frame takes, some two times what it took
FRAME = 4e5  # bytes a frame holds until the film is written
MOST = 100  # pictures of the film of a walk
WIDE, TALL = 6.4, (1.8, 3.6)  # in, of the film of a walk, and the limits of its height
LABELS = 0.95  # in, of these, for the labels

Frames = Iterator[np.ndarray]  # pictures (height, width, 3), bytes


def check_format(path: Path) -> None:
    """Refuse a film that nothing here can write."""
    if path.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise Refusal(
            f"cannot write {path}",
            because="an .mp4 takes ffmpeg, which is not installed",
            instead="end the name in .gif",
        )


# Speed


class Pace(NamedTuple):
    """Speed of a film. cycle: s of film that a cycle takes. rate: frames a second.
    caption: tells the speed."""

    cycle: float
    rate: int
    caption: str


def pace(frequency: float | None) -> Pace:
    """Return the speed of a film of a gait: real time where a cycle then takes from
    `SHORTEST` to `LONGEST`, else the nearest round multiple of it; `CYCLE` for a gait
    without a frequency (Hz)."""
    if not frequency:
        return Pace(CYCLE, RATE, f"1 cycle = {CYCLE:g} s")
    speed = speed_of(1 / frequency)
    cycle = 1 / frequency / speed
    rate = RATE
    if cycle > LONG:
        rate = SLOW_RATE
    caption = "real time"
    if speed != 1.0:
        caption = f"{speed:g} × real time"
    return Pace(cycle, rate, caption)


def speed_of(takes: float) -> float:
    """Return the speed of a film of cycles that take so long, s: 1, or the nearest of 2,
    5, 10 ... or 0.5, 0.2, 0.1 ... with which they are seen."""
    if SHORTEST <= takes <= LONGEST:
        return 1.0
    speeds = np.outer(10.0 ** np.arange(-12, 13), STEPS).ravel()
    if takes > LONGEST:
        return float(speeds[takes / speeds <= LONGEST * SLACK].min())
    return float(speeds[takes / speeds >= SHORTEST / SLACK].max())


def rows(phases: int, cycles: int, frequency: float | None = None) -> np.ndarray:
    """Return the row of a motion that each picture shows: a cycle's end is the next one's
    start, and the last end is left out."""
    at = pace(frequency)
    count = max(1, round(cycles * at.cycle * at.rate))
    places = np.arange(count) * phases / (at.cycle * at.rate)
    return np.minimum(places, phases * cycles - 1).astype(int)


def cost(phases: int, cycles: int, frequency: float | None = None) -> Cost:
    """Return the cost of drawing a film."""
    frames = len(rows(phases, cycles, frequency))
    return Cost(0, DRAWING * frames, FRAME * frames, DRAWING * frames)


# Motions


def write_motion(path: Path, result: Result) -> None:
    """Write the film of a motion, with its shapes on the CCF if the result has that; whole
    or not at all."""
    scene = scene_of(result)
    phases, cycles = scene.numerics.phases, result.attributes["cycles"]
    frequency = result.attributes.get("frequency")
    at, shown = pace(frequency), rows(phases, cycles, frequency)
    pictures = motion_frames(result, shown, at.caption)
    with progress_bar(f"film of {scene.name}") as progress:
        write(path, counted(pictures, len(shown), progress), at.rate)


def motion_frames(result: Result, rows: np.ndarray, caption: str) -> Frames:
    """Yield the pictures of a motion. Artists that stand still are drawn once."""
    canvas, update, background = set_up(result, rows, caption)
    for row in rows:
        canvas.restore_region(background)
        for artist in update(row):
            artist.axes.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


@plots.styled
def set_up(result: Result, rows: np.ndarray, caption: str) -> Any:
    """Return (canvas, function that moves the artists to a row, background)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, update = plots.stage(result, rows, caption)
    fig.set_dpi(DOTS)
    canvas = FigureCanvasAgg(fig)
    moving = update(rows[0])
    fig.get_layout_engine().execute(fig)  # with the longest text in place
    fig.set_layout_engine("none")
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    return canvas, update, canvas.copy_from_bbox(fig.bbox)


# Walks


def write_walk(path: Path, result: Result, follow: bool = False) -> None:
    """Write the film of a walk; whole or not at all. follow: the camera goes with the
    robot."""
    at = pace(scene_of(result).gait.frequency)
    write(path, walk_frames(result, at, follow), at.rate)


def walk_frames(result: Result, at: Pace, follow: bool) -> Frames:
    """Return the pictures of a walk at the rate of its film: by MuJoCo for a walk of three
    dimensions where there is a GL to draw with."""
    t, frequency = result["t"].values, float(result["frequency"])
    speed = 1 / (frequency * at.cycle)
    count = min(MOST, 1 + int(t[-1] / speed * at.rate))
    rows = rows_at(t, np.arange(count) * speed / at.rate)
    if "states" in result:
        states = result["states"].values[rows]
        pictures = walking.view(scene_of(result)).pictures(states)
        if pictures:
            return captioned(pictures, t[rows], at.caption)
    return drawn_frames(result, rows, at.caption, follow)


def captioned(pictures: Frames, times: np.ndarray, caption: str) -> Frames:
    """Yield pictures with the time and the speed of the film in their upper corners."""
    from PIL import Image, ImageDraw, ImageFont

    look: dict[str, Any] = {
        "fill": "white",
        "font": ImageFont.load_default(14),
        "stroke_width": 1,
        "stroke_fill": "black",
    }
    for picture, t in zip(pictures, times):
        image = Image.fromarray(picture)
        draw = ImageDraw.Draw(image)
        draw.text((10, 8), f"t = {t:.2f} s", **look)
        draw.text((image.width - 10, 8), caption, anchor="ra", **look)
        yield np.array(image)


def drawn_frames(
    result: Result, rows: np.ndarray, caption: str, follow: bool
) -> Frames:
    """Yield pictures of a walk as they are drawn from the side."""
    canvas, update = walk_canvas(result, rows, caption, follow)
    for row in rows:
        update(row)
        canvas.draw()
        canvas.figure.set_layout_engine("none")  # so that the axes stand still
        yield np.array(canvas.buffer_rgba())[..., :3]


@plots.styled
def walk_canvas(result: Result, rows: np.ndarray, caption: str, follow: bool) -> Any:
    """Return (canvas, function that moves the robot to a row)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, axes = plots.figure(WIDE, TALL[1])
    ax = axes[0, 0]
    update = walk_stage(ax, result, rows, follow)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    height = (WIDE - LABELS) * (high - low) / (right - left) + LABELS
    fig.set_figheight(float(np.clip(height, *TALL)))
    ax.set_title(caption, loc="right", fontsize=8, color="0.3")
    fig.set_dpi(DOTS)
    return FigureCanvasAgg(fig), update


# Files


def write(path: Path, frames: Frames, rate: int) -> None:
    """Write pictures at a rate (1/s) as the film that the ending names; whole or not at
    all."""
    encode: Callable[[Path, Frames, int], None] = write_gif
    if path.suffix.lower() == ".mp4":
        encode = write_mp4
    with atomic_file(path) as part:
        encode(part, frames, rate)


def write_gif(path: Path, frames: Frames, rate: int) -> None:
    """Write a GIF with one palette for all frames, so that nothing flickers."""
    from PIL import Image

    plain = Image.Dither.NONE
    most = Image.Quantize.MAXCOVERAGE
    first = Image.fromarray(next(frames)).quantize(255, most, dither=plain)
    rest = (
        Image.fromarray(frame).quantize(palette=first, dither=plain) for frame in frames
    )
    with path.open("wb") as file:
        first.save(
            file,
            "GIF",
            save_all=True,
            append_images=rest,
            duration=1000 // rate,
            loop=0,
        )


def write_mp4(path: Path, frames: Frames, rate: int) -> None:
    """Write an MP4 by handing frames to ffmpeg one by one; Refusal with its last line if
    it fails."""
    first = next(frames)
    # The usual colours of ffmpeg take even sizes.
    tall, wide = (2 * (x // 2) for x in first.shape[:2])
    pipes: dict[str, Any] = {
        "stdin": subprocess.PIPE,
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.PIPE,
    }
    command = ffmpeg_command(path, wide, tall, rate)
    with subprocess.Popen(command, **pipes) as ffmpeg:
        try:
            hand(ffmpeg.stdin, first, frames, tall, wide)
            message = ffmpeg.communicate()[1]
        except BrokenPipeError:
            message = ffmpeg.stderr.read()
        except BaseException:
            ffmpeg.kill()
            raise
    if ffmpeg.returncode or not path.exists():
        words = message.decode(errors="replace").strip().splitlines()
        last = "it says nothing"
        if words:
            last = words[-1]
        raise Refusal(
            f"cannot write {path.name}",
            because=f"ffmpeg failed: {last}",
            instead="end the name in .gif",
        )


def ffmpeg_command(path: Path, wide: int, tall: int, rate: int) -> list[str]:
    """Return the command that encodes raw pictures from its standard input."""
    pictures = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{wide}x{tall}"]
    encoding = ["-an", "-pix_fmt", "yuv420p", "-y", str(path)]
    return [
        "ffmpeg",
        "-loglevel",
        "error",
        *pictures,
        "-r",
        str(rate),
        "-i",
        "-",
        *encoding,
    ]


def hand(pipe: Any, first: np.ndarray, rest: Frames, tall: int, wide: int) -> None:
    """Write pictures, cut to a size, into a pipe."""
    pipe.write(first[:tall, :wide].tobytes())
    for frame in rest:
        pipe.write(frame[:tall, :wide].tobytes())
