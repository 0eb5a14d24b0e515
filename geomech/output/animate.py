"""A motion as a film: GIF by Pillow, MP4 by ffmpeg where that is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from geomech import plots
from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.plots.style import styled
from geomech.run.cost import Cost
from geomech.run.progress import counted
from geomech.run.progress import progress as progress_bar
from geomech.studies.motion import Motion
from rft.refusal import Refusal

FILMS, STRIPS = (".gif", ".mp4"), (".png", ".pdf", ".svg")
FRAMES = 48  # of a cycle, at most
RATE = 25  # frames a second: a cycle takes some two
DOTS = 100  # an inch
DRAWING = 0.012  # s a frame takes, some two times what it took
FRAME = 4e5  # bytes a frame holds until the film is written


def check_format(path: Path, *others: str) -> None:
    """Refuse a name that does not end as a film or a figure, or a film that nothing here can write. others: endings of other
    outputs, such as .csv for a table."""
    ending = path.suffix.lower()
    if ending not in FILMS + STRIPS:
        endings = [".gif or .mp4 for a film", ".png, .pdf or .svg for a strip", *others]
        raise Refusal(f"cannot draw {path}", instead=f"end the name in {', '.join(endings)}")
    if ending == ".mp4" and shutil.which("ffmpeg") is None:
        raise Refusal(
            f"cannot write {path}",
            because="an .mp4 takes ffmpeg, which is not installed",
            instead="end the name in .gif",
        )


def is_film(path: Path) -> bool:
    return path.suffix.lower() in FILMS


def rows(phases: int, cycles: int) -> np.ndarray:
    """Return the rows of a motion that are drawn: a cycle's end is the next one's start, and the last end is left out."""
    step = max(1, -(-phases // FRAMES))
    return np.arange(0, phases * cycles, step)


def cost(phases: int, cycles: int) -> Cost:
    """Return the cost of drawing a film."""
    frames = len(rows(phases, cycles))
    return Cost(0, DRAWING * frames, FRAME * frames, DRAWING * frames)


def write(result: Result, path: Path) -> None:
    """Write the film or strip of a motion."""
    with progress_bar(f"film of {result.subject.motion.scene.name}") as bar:
        save(path, *result.subject, progress=bar)


def save(path: Path, motion: Motion, field=None, error=None, progress: Callable | None = None) -> None:
    """Write the film or strip of a motion, next to its shapes on a map of the CCF if there is one; whole or not at all."""
    if not is_film(path):
        plots.save(plots.filmstrip(motion, field, error), path)
        return
    drawn = rows(motion.scene.numerics.phases, motion.cycles)
    film = counted(_frames(motion, drawn, field, error), len(drawn), progress)
    with atomic_file(path) as part:
        (_gif if path.suffix.lower() == ".gif" else _mp4)(part, film)


def _frames(motion: Motion, rows: np.ndarray, field, error) -> Iterator[np.ndarray]:
    """Yield pictures (height, width, 3), bytes. Artists that stand still are drawn once."""
    canvas, update, background = _set(motion, rows, field, error)
    for row in rows:
        canvas.restore_region(background)
        for artist in update(row):
            artist.axes.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())[..., :3]


@styled
def _set(motion: Motion, rows: np.ndarray, field, error):
    """Return (canvas, function that moves the artists to a row, background)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, update = plots.stage(motion, rows, field, error)
    fig.set_dpi(DOTS)
    canvas = FigureCanvasAgg(fig)
    moving = update(rows[0])
    canvas.draw()  # lays out with the longest text in place
    fig.set_layout_engine("none")
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    return canvas, update, canvas.copy_from_bbox(fig.bbox)


def _gif(path: Path, frames: Iterator[np.ndarray]) -> None:
    """Write a GIF with one palette for all frames, so that nothing flickers."""
    from PIL import Image

    first = Image.fromarray(next(frames)).quantize(255, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    rest = (Image.fromarray(frame).quantize(palette=first, dither=Image.Dither.NONE) for frame in frames)
    with path.open("wb") as file:
        first.save(file, "GIF", save_all=True, append_images=rest, duration=1000 // RATE, loop=0)


def _mp4(path: Path, frames: Iterator[np.ndarray]) -> None:
    """Write an MP4 by handing frames to ffmpeg one by one; Refusal with its last line if it fails."""
    first = next(frames)
    tall, wide = (2 * (x // 2) for x in first.shape[:2])  # its usual colours take even sizes
    raw_input = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{wide}x{tall}", "-r", str(RATE), "-i", "-"]
    encoding = ["-an", "-pix_fmt", "yuv420p", "-y", str(path)]
    command = ["ffmpeg", "-loglevel", "error", *raw_input, *encoding]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
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
        words = message.decode(errors="replace").strip().splitlines()[-1:] or ["it says nothing"]
        raise Refusal(f"cannot write {path.name}", because=f"ffmpeg failed: {words[0]}", instead="end the name in .gif")


def _hand(pipe, first: np.ndarray, rest: Iterator[np.ndarray], tall: int, wide: int) -> None:
    pipe.write(first[:tall, :wide].tobytes())
    for frame in rest:
        pipe.write(frame[:tall, :wide].tobytes())
