"""The folder that `geomech run` writes: figures, numbers and the scene."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from geomech import plots
from geomech.core.variables import Result
from geomech.io.files import read, refuse_inputs
from geomech.io.results import write_netcdf
from geomech.scenes import inputs
from geomech.scenes.model import Scene
from geomech.scenes.write import toml
from geomech.studies import fields
from geomech.studies.report import Reported
from geomech.systems.base import shape_labels
from geomech.systems.framed import Framed
from rft.core.refusal import Refusal, in_line

SCENE, TABLES = "scene.toml", "displacement.json"


def refuse_folder(scene: Scene, folder: Path) -> None:
    """Refuse a folder in which `write` would replace an input, or a scene that no `run` has written."""
    path = folder / SCENE
    refuse_inputs([path, folder / TABLES], inputs(scene))
    if (
        os.path.lexists(path)
        and not os.path.lexists(folder / TABLES)
        and not _holds(path, toml(scene))
    ):
        raise Refusal(
            f"cannot write {path}",
            because="another scene stands there",
            instead="choose another folder with -o",
        )


def _holds(path: Path, text: str) -> bool:
    try:
        return read(path, 4 * len(text) + 4) == text.encode()
    except (OSError, ValueError):
        return False


class Drawn(NamedTuple):
    """Options of the figures. components: panels, all but zero ones if there are none. clim: limit of the CCF's colours. data:
    measurements beside the displacements of the scene's gait (`geomech.scenes.measurements`)."""

    components: Sequence[str] = ()
    clim: float | str | None = None
    data: Mapping | None = None


ALL = Drawn()


def write(result: Result, folder: Path, drawn: Drawn = ALL) -> None:
    """Write everything of a scene into a folder."""
    found: Reported = result.subject
    scene = found.study.scene
    if found.mapped:
        write_netcdf(folder / "connection.nc", fields.of_study(found.study))
        _maps(found, folder, drawn)
    numbers = {title: table.to_dict() for title, table in found.tables.items()}
    options = {"components": drawn.components, "data": drawn.data}
    figure = plots.displacement_figure(found.tables, **options)
    _save(figure, folder / "displacement")
    (folder / TABLES).write_text(json.dumps(numbers, indent=1) + "\n")
    (folder / SCENE).write_text(toml(scene), encoding="utf-8")


def _maps(found: Reported, folder: Path, drawn: Drawn) -> None:
    """Draw the connection and the CCF, of three joints for every pair."""
    study, scene = found.study, found.study.scene
    options: dict[str, Any] = {
        "labels": shape_labels(scene.system),
        "components": drawn.components,
    }
    if found.planes:
        _save(
            plots.plane_connection_figure(found.planes, **options),
            folder / "connection",
        )
        _save(
            plots.planes_figure(found.planes, scene.gait, clim=drawn.clim, **options),
            folder / "ccf",
        )
        return
    _save(plots.connection_figure(study.fitted, **options), folder / "connection")
    if isinstance(scene.system, Framed):
        _save(
            plots.frame_figure(scene.system.field.field, labels=options["labels"]),
            folder / "frame",
        )
    maps = plots.ccf_figure(
        study.curvature,
        found.gaits,
        error=study.curvature_error,
        clim=drawn.clim,
        **options,
    )
    _save(maps, folder / "ccf")


def files(result: Result, folder: Path) -> str:
    """Return the names of the files in a folder."""
    names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    return f"files in {in_line(folder)}: {', '.join(map(in_line, names))}"


def _save(fig, stem: Path) -> None:
    plots.save(fig, *(stem.with_suffix(ending) for ending in (".png", ".pdf")))
