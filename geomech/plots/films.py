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
from geomech.plots.look import font_points
from geomech.plots.terradynamics.walking import rows_at, walk_stage
from geomech.results.scenes import scene_of
from geomech.runs.cost import Cost
from geomech.runs.progress import counted
from geomech.runs.progress import progress as progress_bar
from geomech.studies.terradynamics import walking
from rft.core.refusal import Refusal

RATE = 25  # frames per second
SLOW_RATE = 10  # frames per second, of long cycles
LONG_CYCLE = 4.0  # s of film: the longest cycle at RATE
CYCLE = 2.0  # s of film that a cycle takes without a frequency
SHORTEST = 0.4  # s of film of a cycle: ten pictures, of which one can see it
LONGEST = 10.0  # s of film of a cycle, assumed bearable
STEPS = (1.0, 2.0, 5.0)  # of speeds, times a power of ten
SLACK = 1 + 1e-9  # factor by which a time may miss a limit by rounding
DPI = 100
SECONDS_PER_FRAME = 0.012  # to draw one: twice the measured time
BYTES_PER_FRAME = 4e5  # held until the film is written
WALK_PICTURES = 100  # of the film of a walk, at most
WALK_WIDTH = 6.4  # in, of the film of a walk
WALK_HEIGHTS = (1.8, 3.6)  # in, lowest and highest
LABELS = 0.95  # in, of width and height, for the labels

Frames = Iterator[np.ndarray]  # pictures (height, width, 3), bytes


def check_format(path: Path) -> None:
    """Refuse a film in a format that needs a program which is not installed."""
    if path.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise Refusal(
            f"cannot write {path}",
            because="an .mp4 takes ffmpeg, which is not installed",
            instead="end the name in .gif",
        )


# Speed


class Pace(NamedTuple):
    """The speed of a film.

    cycle: s of film that a cycle takes. rate: frames per second. caption: states the
    speed."""

    cycle: float
    rate: int
    caption: str


def pace(frequency: float | None) -> Pace:
    """Return the speed of a film of a gait.

    It is real time where a cycle then takes from `SHORTEST` to `LONGEST`, else the
    nearest round multiple of it. frequency: Hz; without one a cycle takes `CYCLE`."""
    if not frequency:
        return Pace(CYCLE, RATE, f"1 cycle = {CYCLE:g} s")
    speed = speed_of(1 / frequency)
    cycle = 1 / frequency / speed
    rate = RATE
    if cycle > LONG_CYCLE:
        rate = SLOW_RATE
    caption = "real time"
    if speed != 1.0:
        caption = f"{speed:g} × real time"
    return Pace(cycle, rate, caption)


def speed_of(period: float) -> float:
    """Return the speed of a film of cycles of a period, s, as a multiple of real time.

    It is 1, or the nearest of 2, 5, 10 ... or of 0.5, 0.2, 0.1 ... with which a cycle
    takes from `SHORTEST` to `LONGEST`."""
    if SHORTEST <= period <= LONGEST:
        return 1.0
    speeds = np.outer(10.0 ** np.arange(-12, 13), STEPS).ravel()
    if period > LONGEST:
        return float(speeds[period / speeds <= LONGEST * SLACK].min())
    return float(speeds[period / speeds >= SHORTEST / SLACK].max())


def rows(phases: int, cycles: int, frequency: float | None = None) -> np.ndarray:
    """Return the row of a motion that each picture shows.

    The end of a cycle is the start of the next one; the last end is not shown."""
    speed = pace(frequency)
    pictures_per_cycle = speed.cycle * speed.rate
    count = max(1, round(cycles * pictures_per_cycle))
    places = np.arange(count) * phases / pictures_per_cycle
    return np.minimum(places, phases * cycles - 1).astype(int)


def cost(phases: int, cycles: int, frequency: float | None = None) -> Cost:
    """Return the cost of drawing a film."""
    frames = len(rows(phases, cycles, frequency))
    seconds = SECONDS_PER_FRAME * frames
    return Cost(0, seconds, BYTES_PER_FRAME * frames, seconds)


# Motions


def write_motion(path: Path, result: Result) -> None:
    """Write the film of a motion, with its shapes on the CCF if the result has one. The
    file appears whole or not at all."""
    scene = scene_of(result)
    cycles = result.attributes["cycles"]
    frequency = result.attributes.get("frequency")
    speed = pace(frequency)
    picture_rows = rows(scene.numerics.phases, cycles, frequency)
    pictures = motion_frames(result, picture_rows, speed.caption)
    with progress_bar(f"film of {scene.name}") as progress:
        write(path, counted(pictures, len(picture_rows), progress), speed.rate)


def motion_frames(result: Result, rows: np.ndarray, caption: str) -> Frames:
    """Yield the pictures of a motion. Artists that do not move are drawn once."""
    canvas, update, background = motion_canvas(result, rows, caption)
    for row in rows:
        canvas.restore_region(background)
        for artist in update(row):
            artist.axes.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


@plots.styled
def motion_canvas(result: Result, rows: np.ndarray, caption: str) -> Any:
    """Return (canvas, function that moves the artists to a row, background)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, update = plots.stage(result, rows, caption)
    fig.set_dpi(DPI)
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
    """Write the film of a walk. The file appears whole or not at all. follow: the
    camera moves with the robot."""
    speed = pace(scene_of(result).gait.frequency)
    write(path, walk_frames(result, speed, follow), speed.rate)


def walk_frames(result: Result, speed: Pace, follow: bool) -> Frames:
    """Return the pictures of a walk at the rate of its film.

    MuJoCo draws a walk in three dimensions where there is a GL to draw with."""
    t = result["t"].values
    frequency = float(result["frequency"])
    multiple = 1 / (frequency * speed.cycle)  # of real time
    count = min(WALK_PICTURES, 1 + int(t[-1] / multiple * speed.rate))
    rows = rows_at(t, np.arange(count) * multiple / speed.rate)
    if "states" in result:
        states = result["states"].values[rows]
        pictures = walking.view(scene_of(result)).pictures(states)
        if pictures:
            return with_captions(pictures, t[rows], speed.caption)
    return side_view_frames(result, rows, speed.caption, follow)


def with_captions(pictures: Frames, times: np.ndarray, caption: str) -> Frames:
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


def side_view_frames(
    result: Result, rows: np.ndarray, caption: str, follow: bool
) -> Frames:
    """Yield pictures of a walk from the side."""
    canvas, update = walk_canvas(result, rows, caption, follow)
    for row in rows:
        update(row)
        canvas.draw()
        # Further layouts would move the axes.
        canvas.figure.set_layout_engine("none")
        yield np.array(canvas.buffer_rgba())[..., :3]


@plots.styled
def walk_canvas(result: Result, rows: np.ndarray, caption: str, follow: bool) -> Any:
    """Return (canvas, function that moves the robot to a row)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, axes = plots.figure(WALK_WIDTH, WALK_HEIGHTS[1])
    ax = axes[0, 0]
    update = walk_stage(ax, result, rows, follow)
    left, right = ax.get_xlim()
    low, high = ax.get_ylim()
    height = (WALK_WIDTH - LABELS) * (high - low) / (right - left) + LABELS
    fig.set_figheight(float(np.clip(height, *WALK_HEIGHTS)))
    ax.set_title(caption, loc="right", fontsize=font_points(8), color="0.3")
    fig.set_dpi(DPI)
    return FigureCanvasAgg(fig), update


# Files


def write(path: Path, frames: Frames, rate: int) -> None:
    """Write pictures at a rate (1/s) as a film in the format of the ending. The file
    appears whole or not at all."""
    encode: Callable[[Path, Frames, int], None] = write_gif
    if path.suffix.lower() == ".mp4":
        encode = write_mp4
    with atomic_file(path) as part:
        encode(part, frames, rate)


def write_gif(path: Path, frames: Frames, rate: int) -> None:
    """Write a GIF with one palette for all frames, which avoids flicker."""
    from PIL import Image

    undithered = Image.Dither.NONE
    coverage = Image.Quantize.MAXCOVERAGE
    first = Image.fromarray(next(frames)).quantize(255, coverage, dither=undithered)
    rest = (
        Image.fromarray(frame).quantize(palette=first, dither=undithered)
        for frame in frames
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
    """Write an MP4 by handing frames to ffmpeg one by one; if it fails, raise Refusal
    with its last line."""
    first = next(frames)
    # The usual pixel format of ffmpeg needs even sizes.
    height, width = (2 * (size // 2) for size in first.shape[:2])
    pipes: dict[str, Any] = {
        "stdin": subprocess.PIPE,
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.PIPE,
    }
    command = ffmpeg_command(path, width, height, rate)
    with subprocess.Popen(command, **pipes) as ffmpeg:
        try:
            write_raw(ffmpeg.stdin, first, frames, height, width)
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


def ffmpeg_command(path: Path, width: int, height: int, rate: int) -> list[str]:
    """Return the command that encodes raw pictures from its standard input."""
    pictures = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
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


def write_raw(
    pipe: Any, first: np.ndarray, rest: Frames, height: int, width: int
) -> None:
    """Write pictures, cut to a size, into a pipe."""
    pipe.write(first[:height, :width].tobytes())
    for frame in rest:
        pipe.write(frame[:height, :width].tobytes())
