"""What `geomech run` leaves behind: figures, numbers and the scene, in one folder."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from geomech import plots
from geomech.cost import Cost, price, study
from geomech.gaits import Butterfly, Circle, Gait
from geomech.netcdf import save_connection
from geomech.problem import SceneError
from geomech.scene import Scene

AMPLITUDES = 10  # in the study that `run` makes of each gait


@contextlib.contextmanager
def whole_folder(path: str | Path):
    """A folder to fill; its files move to ``path`` on success and vanish on failure. SceneError if that cannot be."""
    try:
        target = Path(path).resolve()
        if os.path.lexists(target) and not target.is_dir():
            raise OSError("it is not a folder")
        there = next(p for p in (target, *target.parents) if p.exists())
        part = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=there))
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"cannot write the folder {path}: {reason}; choose another with -o") from None
    try:
        yield part
        files = list(part.iterdir())
        if blocked := [f.name for f in files if (target / f.name).is_dir()]:
            raise SceneError(f"cannot write {target / blocked[0]}: it is a folder; choose another with -o")
        target.mkdir(parents=True, exist_ok=True)
        for file in files:
            file.replace(target / file.name)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def write(scene: Scene, folder: Path, progress: Callable) -> dict[str, dict]:
    """Compute everything and write it; returns the displacement tables by gait."""
    gaits = _gaits(scene)
    if "area" in scene.methods:
        scene.compute_field(progress)
        save_connection(folder / "connection.nc", scene)
        _save(plots.connection_figure(scene.fitted, scene.unit), folder / "connection")
        _save(plots.ccf_figure(scene.curvature, gaits, scene.unit, scene.curvature_error), folder / "ccf")
    tables = {type(g).__name__.lower(): scene.study(reachable(scene, g), scene.methods, g) for g in gaits}
    fig, axes = plots.figure(3.6 * len(gaits), 3.7, len(gaits))
    for ax, gait, table in zip(axes[0], gaits, tables.values()):
        plots.displacement(table, scene.unit, ax, gait=gait, marker="o")
    _save(fig, folder / "displacement")
    (folder / "displacement.json").write_text(json.dumps(tables, indent=1) + "\n")
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")
    return tables


def cost(scene: Scene) -> Cost:
    """Of `write`."""
    gaits = _gaits(scene)
    return price([job for g in gaits for job in study(scene, scene.methods, AMPLITUDES, g, tables=g is gaits[0])])


def _gaits(scene: Scene) -> list[Gait]:
    """The scene's own and, for the three-link swimmer, those of Fig. 11(e) beside it."""
    more = (Circle(reverse=True), Butterfly()) if scene.three_link else ()
    return [scene.gait, *(g for g in more if type(g) is not type(scene.gait))]


def reachable(scene: Scene, gait: Gait) -> list[float]:
    """Amplitudes up to the largest that keeps the gait inside the field; up to its own where the body has no field."""
    if "path" not in scene.methods:
        return [float(f"{a:.3g}") for a in gait.amplitude * np.arange(1, AMPLITUDES + 1) / AMPLITUDES]
    t = np.linspace(0, 2 * np.pi, 721)
    room = scene.numerics.extent - np.abs(np.array(gait.centre or 0.0)).max()
    reach = np.abs(gait.unit(t)).max()
    if reach == 0:
        raise SceneError(f"{scene.name}: [gait] does not move: give it a size")
    if room <= 0:
        raise SceneError(f"{scene.name}: the gait's centre lies outside the field: raise [numerics] extent")
    top = 0.999 * room / reach
    return [float(f"{a:.3g}") for a in top * np.arange(1, AMPLITUDES + 1) / AMPLITUDES]


def _save(fig, stem: Path) -> None:
    for ending in (".png", ".pdf"):
        plots.save(fig, stem.with_suffix(ending))


def text_table(title: str, table: dict, scene: Scene) -> str:
    """Amplitude against net displacement (`plots.net`) and heading with their errors by tier, as plain text."""
    methods = [m for m in table if m in plots.METHOD_STYLE]
    lines = []
    for what, key, shown in (
        (f"displacement per cycle ({scene.unit}) +- estimated error (BL)", "estimate", plots.net),
        ("heading gained (rad) +- estimated error (rad)", "estimate_heading", _heading),
    ):
        lines += [f"{title}: {what}", "amplitude" + "".join(f"{m:>21}" for m in methods)]
        errors = table[key] if isinstance(table[key], dict) else {methods[0]: table[key]}
        columns = [zip(shown(table[m]), errors[m]) for m in methods]
        for amplitude, *row in zip(table["amplitude"], *columns):
            lines.append(f"{amplitude:9.4g}" + "".join(f"{x:12.6f} +-{e:7.1e}" for x, e in row))
    seconds = ", ".join(f"{k} {v:.3g}" for k, v in table["seconds"].items())
    return "\n".join([*lines, f"seconds: {seconds}", ""])


def _heading(poses) -> np.ndarray:
    """theta (B,) of poses (B, 3), without the sign of a rounded zero."""
    return np.round(np.array(poses)[:, 2], 9) + 0.0
