"""A motion as a film: GIF by Pillow, MP4 by ffmpeg where that is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech import plots
from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.plots.style import styled
from geomech.run.cost import Cost
from geomech.run.progress import counted
from geomech.run.progress import progress as progress_bar
from geomech.studies.motion import Motion
from rft.core.refusal import Refusal

FILMS, STRIPS = (".gif", ".mp4"), (".png", ".pdf", ".svg")
RATE, SLOW_RATE = 25, 10  # frames a second; of cycles that take long
LONG = 4.0  # s: the longest cycle at RATE
CYCLE = 2.0  # s that a cycle takes without a frequency
SHORTEST, LONGEST = (
    0.4,
    10.0,
)  # s that a cycle takes: ten pictures to see it by, and patience
STEPS = (1.0, 2.0, 5.0)  # of speeds, times a power of ten
DOTS = 100  # an inch
DRAWING = 0.012  # s a frame takes, some two times what it took
FRAME = 4e5  # bytes a frame holds until the film is written


def check_format(path: Path, *others: str) -> None:
    """Refuse a name that does not end as a film or a figure, or a film that nothing here can write. others: endings of other
    outputs, such as .csv for a table."""
    ending = path.suffix.lower()
    if ending not in FILMS + STRIPS:
        endings = [".gif or .mp4 for a film", ".png, .pdf or .svg for a strip", *others]
        raise Refusal(
            f"cannot draw {path}", instead=f"end the name in {', '.join(endings)}"
        )
    if ending == ".mp4" and shutil.which("ffmpeg") is None:
        raise Refusal(
            f"cannot write {path}",
            because="an .mp4 takes ffmpeg, which is not installed",
            instead="end the name in .gif",
        )


def is_film(path: Path) -> bool:
    return path.suffix.lower() in FILMS


class Pace(NamedTuple):
    """Speed of a film. cycle: s of film that a cycle takes. rate: frames a second. caption: tells the speed."""

    cycle: float
    rate: int
    caption: str


def pace(frequency: float | None) -> Pace:
    """Return the speed of a film of a gait: real time where a cycle then takes from `SHORTEST` to `LONGEST`, else the nearest
    round multiple of it; `CYCLE` for a gait without a frequency (Hz)."""
    if not frequency:
        return Pace(CYCLE, RATE, f"1 cycle = {CYCLE:g} s")
    takes = 1 / frequency
    speed = _speed(takes)
    cycle = takes / speed
    return Pace(
        cycle,
        RATE if cycle <= LONG else SLOW_RATE,
        "real time" if speed == 1.0 else f"{speed:g} × real time",
    )


def _speed(takes: float) -> float:
    """Return the speed of a film of cycles that take so long, s: 1, or the nearest of 2, 5, 10 ... or 0.5, 0.2, 0.1 ... with
    which they are seen."""
    speeds, slack = np.outer(10.0 ** np.arange(-12, 13), STEPS).ravel(), 1 + 1e-9
    if takes > LONGEST:
        return float(speeds[takes / speeds <= LONGEST * slack].min())
    return (
        1.0
        if takes >= SHORTEST
        else float(speeds[takes / speeds >= SHORTEST / slack].max())
    )


def rows(phases: int, cycles: int, frequency: float | None = None) -> np.ndarray:
    """Return the row of a motion that each picture shows: a cycle's end is the next one's start, and the last end is left
    out."""
    at = pace(frequency)
    count = max(1, round(cycles * at.cycle * at.rate))
    return np.minimum(
        np.arange(count) * phases / (at.cycle * at.rate), phases * cycles - 1
    ).astype(int)


def cost(phases: int, cycles: int, frequency: float | None = None) -> Cost:
    """Return the cost of drawing a film."""
    frames = len(rows(phases, cycles, frequency))
    return Cost(0, DRAWING * frames, FRAME * frames, DRAWING * frames)


def write(result: Result, path: Path) -> None:
    """Write the film or strip of a motion."""
    with progress_bar(f"film of {result.subject.motion.scene.name}") as bar:
        save(path, *result.subject, progress=bar)


def save(
    path: Path, motion: Motion, field=None, error=None, progress: Callable | None = None
) -> None:
    """Write the film or strip of a motion, next to its shapes on a map of the CCF if there is one; whole or not at all."""
    if not is_film(path):
        plots.save(plots.filmstrip(motion, field, error), path)
        return
    at, drawn = (
        pace(motion.frequency),
        rows(motion.scene.numerics.phases, motion.cycles, motion.frequency),
    )
    film = counted(
        _frames(motion, drawn, field, error, at.caption), len(drawn), progress
    )
    with atomic_file(path) as part:
        encode(part, film, at.rate, path.suffix.lower())


def encode(path: Path, frames: Iterator[np.ndarray], rate: int, ending: str) -> None:
    """Write pictures at a rate (1/s) as the film that an ending names."""
    (_gif if ending == ".gif" else _mp4)(path, frames, rate)


def _frames(
    motion: Motion, rows: np.ndarray, field, error, caption: str
) -> Iterator[np.ndarray]:
    """Yield pictures (height, width, 3), bytes. Artists that stand still are drawn once."""
    canvas, update, background = _set(motion, rows, field, error, caption)
    for row in rows:
        canvas.restore_region(background)
        for artist in update(row):
            artist.axes.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


@styled
def _set(motion: Motion, rows: np.ndarray, field, error, caption: str):
    """Return (canvas, function that moves the artists to a row, background)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, update = plots.stage(motion, rows, field, error, caption)
    fig.set_dpi(DOTS)
    canvas = FigureCanvasAgg(fig)
    moving = update(rows[0])
    fig.get_layout_engine().execute(fig)  # with the longest text in place
    fig.set_layout_engine("none")
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    return canvas, update, canvas.copy_from_bbox(fig.bbox)


def _gif(path: Path, frames: Iterator[np.ndarray], rate: int) -> None:
    """Write a GIF with one palette for all frames, so that nothing flickers."""
    from PIL import Image

    first = Image.fromarray(next(frames)).quantize(
        255, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
    rest = (
        Image.fromarray(frame).quantize(palette=first, dither=Image.Dither.NONE)
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


def _mp4(path: Path, frames: Iterator[np.ndarray], rate: int) -> None:
    """Write an MP4 by handing frames to ffmpeg one by one; Refusal with its last line if it fails."""
    first = next(frames)
    tall, wide = (
        2 * (x // 2) for x in first.shape[:2]
    )  # its usual colours take even sizes
    raw_input = [
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{wide}x{tall}",
        "-r",
        str(rate),
        "-i",
        "-",
    ]
    encoding = ["-an", "-pix_fmt", "yuv420p", "-y", str(path)]
    command = ["ffmpeg", "-loglevel", "error", *raw_input, *encoding]
    pipes = {
        "stdin": subprocess.PIPE,
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.PIPE,
    }
    with subprocess.Popen(command, **pipes) as ffmpeg:
        try:
            _hand(ffmpeg.stdin, first, frames, tall, wide)
            message = ffmpeg.communicate()[1]
        except BrokenPipeError:
            message = ffmpeg.stderr.read()
        except BaseException:
            ffmpeg.kill()
            raise
    if ffmpeg.returncode or not path.exists():
        words = message.decode(errors="replace").strip().splitlines()[-1:] or [
            "it says nothing"
        ]
        raise Refusal(
            f"cannot write {path.name}",
            because=f"ffmpeg failed: {words[0]}",
            instead="end the name in .gif",
        )


def _hand(
    pipe, first: np.ndarray, rest: Iterator[np.ndarray], tall: int, wide: int
) -> None:
    pipe.write(first[:tall, :wide].tobytes())
    for frame in rest:
        pipe.write(frame[:tall, :wide].tobytes())
