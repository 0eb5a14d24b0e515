"""A motion as a table, CSV that pandas and NumPy read, or as a film or a strip of pictures, by the ending of its file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.output import animate
from geomech.run.progress import progress as progress_bar
from geomech.scenes.model import Scene
from geomech.studies.motion import Motion, Trajectory
from geomech.systems.base import body_size, length_unit, shape_labels
from rft.core.refusal import in_line


def question(scene: Scene, path: Path | None, cycles: int | None) -> Trajectory:
    """Return the question of so many cycles of a scene, by default 3 for a film, else 1."""
    film = path is not None and animate.is_film(path)
    count = (3 if film else 1) if cycles is None else cycles
    drawing = (
        animate.cost(
            scene.numerics.phases, count, getattr(scene.gait, "frequency", None)
        )
        if film
        else None
    )
    return Trajectory(scene, count, path is not None and not is_table(path), drawing)


def is_table(path: Path) -> bool:
    return path.suffix.lower() == ".csv"


def check_format(path: Path) -> None:
    """Refuse a name that ends neither as a table nor as a film or a figure."""
    if not is_table(path):
        animate.check_format(path, ".csv for a table")


def message(result: Result, path: Path) -> str:
    """Return the line that names the file."""
    return f"{'table' if is_table(path) else 'film' if animate.is_film(path) else 'pictures'} in {in_line(path)}"


def write(result: Result, path: Path) -> None:
    """Write the table, the film or the pictures of a motion with a progress bar."""
    if not is_table(path):
        animate.write(result, path)
        return
    with progress_bar(f"table of {result.subject.motion.scene.name}") as bar:
        save(path, result.subject.motion, bar)


def save(path: Path, motion: Motion, progress: Callable | None = None) -> None:
    """Write names of the columns, their meaning and units behind '#', then a row for each phase, with every digit."""
    written = 0
    with (
        atomic_file(path) as part,
        part.open("w", encoding="utf-8", newline="\n") as file,
    ):
        file.write(
            "\n".join(
                [",".join(motion.columns), *(f"# {line}" for line in about(motion))]
            )
            + "\n"
        )
        for table in motion.tables():
            for row in table.tolist():
                file.write(",".join(map(repr, row)) + "\n")
            written += len(table)
            if progress:
                progress(written / len(motion.phase))


def about(motion: Motion) -> list[str]:
    """Return the meaning of the columns, in lines."""
    scene, columns = motion.scene, motion.columns
    system, unit = scene.system, length_unit(scene.system)
    shapes = ", ".join(
        f"alpha_{k + 1} {name} ({u})"
        for k, (name, u) in enumerate(shape_labels(system)[:8])
    )
    if all(
        label == (f"alpha_{k + 1}", "rad")
        for k, label in enumerate(shape_labels(system))
    ):
        shapes = "alpha_k (rad): joint angle, heading of link k+1 less that of link k"
    name = " ".join(scene.name.split())
    lines = [
        f"motion of {name}, {type(scene.gait).__name__.lower()} of amplitude {scene.gait.amplitude:g}",
        "phase (rad): of the gait, 2 pi a cycle"
        + ("; time (s)" if "time" in columns else ""),
        f"x ({unit}), y ({unit}), theta (rad): pose of the frame {scene.frame}, seen from where it is at phase 0"
        f"; the body's length: {body_size(system):g} {unit}",
        shapes + (" ..." if len(shape_labels(system)) > 8 else ""),
    ]
    if "end_0_x" in columns:
        lines.append(
            f"end_k_x, end_k_y ({unit}): end of link k in the same axes, 0 the tail, the last the head"
        )
    return lines
