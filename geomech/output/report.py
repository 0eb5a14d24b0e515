"""What `geomech run` leaves behind: figures, numbers and the scene, in one folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from geomech.errors import SceneError
from geomech.files import read, refuse_inputs
from geomech.gaits import Butterfly, Circle, Gait
from geomech.output import plots
from geomech.output.netcdf import save_connection
from geomech.scene.model import Scene
from geomech.scene.write import toml
from geomech.study.bench import Study
from geomech.study.cost import Cost, price
from geomech.study.cost import study as jobs
from geomech.study.offer import methods
from geomech.systems import Swimmer
from geomech.tiers import TIERS
from geomech.tiers.path import axes as field_axes

AMPLITUDES = 10  # in the study that `run` makes of each gait
SCENE, TABLES = "scene.toml", "displacement.json"


def refuse_folder(scene: Scene, folder: Path, inputs: Iterable[Path]) -> None:
    """SceneError if the files of `write` would replace an input, or a scene that no `run` has left in ``folder``."""
    there = folder / SCENE
    refuse_inputs([there, folder / TABLES], inputs)
    if os.path.lexists(there) and not os.path.lexists(folder / TABLES) and not _holds(there, toml(scene)):
        raise SceneError(f"cannot write {there}: another scene stands there; choose another folder with -o")


def _holds(path: Path, text: str) -> bool:
    try:
        return read(path, 4 * len(text) + 4) == text.encode()
    except (OSError, ValueError):
        return False


def write(study: Study, folder: Path, progress: Callable) -> dict[str, dict]:
    """Compute everything and write it; returns the displacement tables by gait."""
    scene, unit = study.scene, study.scene.system.unit
    gaits = _gaits(scene)
    amplitudes = [reachable(scene, gait) for gait in gaits]
    if "path" in study.methods and scene.system.joints == 2:
        study.compute_field(progress)
        labels = scene.system.shape_labels
        save_connection(folder / "connection.nc", study)
        _save(plots.connection_figure(study.fitted, unit, labels), folder / "connection")
        _save(plots.ccf_figure(study.curvature, gaits, unit, study.curvature_error, labels), folder / "ccf")
    tables = {type(g).__name__.lower(): study.study(a, study.methods, g) for g, a in zip(gaits, amplitudes)}
    fig, axes = plots.figure(3.6 * len(gaits), 3.7, len(gaits))
    for ax, gait, table in zip(axes[0], gaits, tables.values()):
        plots.displacement(table, unit, ax, gait=gait, marker="o")
    _save(fig, folder / "displacement")
    (folder / TABLES).write_text(json.dumps(tables, indent=1) + "\n")
    (folder / SCENE).write_text(toml(scene), encoding="utf-8")
    return tables


def cost(scene: Scene) -> Cost:
    """Of `write`; SceneError, before anything is computed, for what it refuses."""
    gaits = _gaits(scene)
    for gait in gaits:
        reachable(scene, gait)
    return price(
        [job for g in gaits for job in jobs(scene, methods(scene.system), AMPLITUDES, g, tables=g is gaits[0])]
    )


def _gaits(scene: Scene) -> list[Gait]:
    """The scene's own and, for the three-link swimmer, those of Fig. 11(e) beside it."""
    more = (Circle(reverse=True), Butterfly()) if isinstance(scene.system, Swimmer) and scene.system.three_link else ()
    return [scene.gait, *(g for g in more if type(g) is not type(scene.gait))]


def reachable(scene: Scene, gait: Gait) -> list[float]:
    """Amplitudes, of the sign of the gait's own, up to the largest that keeps it inside the field; up to its own where
    there is no field, or one with singular shapes.
    SceneError for a gait that does not move or lies outside."""
    own = "path" not in methods(scene.system) or scene.system.singularity is not None
    unit = gait.unit(np.linspace(0, 2 * np.pi, 721))
    if np.ptp(unit, axis=0).max() == 0 or (own and gait.amplitude == 0):
        raise SceneError(f"{scene.name}: [gait] does not move: give it a size")
    if own:
        return [float(f"{a:.3g}") for a in gait.amplitude * np.arange(1, AMPLITUDES + 1) / AMPLITUDES]
    centre = np.array(gait.centre or (0.0,) * gait.joints)
    room = min(min(a[-1] - x, x - a[0]) for a, x in zip(field_axes(scene.system, scene.numerics), centre))
    if room <= 0:
        raise SceneError(f"{scene.name}: the gait's centre lies outside the field: raise [numerics] extent")
    top = np.copysign(0.999 * room / np.abs(unit).max(), gait.amplitude)
    return [float(f"{a:.3g}") for a in top * np.arange(1, AMPLITUDES + 1) / AMPLITUDES]


def _save(fig, stem: Path) -> None:
    for ending in (".png", ".pdf"):
        plots.save(fig, stem.with_suffix(ending))


def text_table(title: str, table: dict, scene: Scene) -> str:
    """Amplitude against net displacement (`plots.net`) and heading with their errors by tier, as plain text."""
    tiers = [m for m in table if m in TIERS]
    lines = []
    for what, key, shown in (
        (f"displacement per cycle ({scene.system.unit}) +- estimated error (BL)", "estimate", plots.net),
        ("heading gained (rad) +- estimated error (rad)", "estimate_heading", _heading),
    ):
        lines += [f"{title}: {what}", "amplitude" + "".join(f"{m:>21}" for m in tiers)]
        errors = table[key] if isinstance(table[key], dict) else {tiers[0]: table[key]}
        columns = [zip(shown(table[m]), errors[m]) for m in tiers]
        for amplitude, *row in zip(table["amplitude"], *columns):
            lines.append(f"{amplitude:9.4g}" + "".join(f"{x:12.6f} +-{e:7.1e}" for x, e in row))
    seconds = ", ".join(f"{k} {v:.3g}" for k, v in table["seconds"].items())
    return "\n".join([*lines, f"seconds: {seconds}", ""])


def _heading(poses) -> np.ndarray:
    """theta (B,) of poses (B, 3), without the sign of a rounded zero."""
    return np.round(np.array(poses)[:, 2], 9) + 0.0
