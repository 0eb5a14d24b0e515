"""The page of the gait lab: one file that needs no server, no network and nothing
installed.

Its tables are base64 texts of numbers in single precision. Its script and style are
part of it and are allowed by their hashes alone, so that nothing else runs and nothing
is fetched. Names and texts of scenes are data, never markup."""

from __future__ import annotations

import base64
import hashlib
import json
import shutil
import tempfile
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.version import VERSION
from geomech.io.files import atomic_file
from geomech.mathematics.gaits import KINDS as GAITS
from geomech.mathematics.gaits import Gait, Points
from geomech.mathematics.geometry.gait import LARGEST
from geomech.mathematics.systems.base import body_size, length_unit, shape_labels
from geomech.scenes.format.key import keys_of
from geomech.scenes.write import text_of, without_gait
from geomech.studies.maps.charts import RESIDUAL_SHARES, Chart, Family, fourier_series
from rft.core.refusal import Refusal

FOLDER = Path(__file__).parent
SCRIPTS = (  # in the order in which they run
    "numbers",
    "toml",
    "loops",
    "chart",
    "state",
    "files",
    "map",
    "swimmer",
    "curve",
    "page",
)
# Kinds of gaits that the page can open from a file.
FILE_GAITS = ("circle", "ellipse", "butterfly", "fourier", "points")
COLOURS = 65  # of the map's scale
# Escapes in JSON, without which a text could end its HTML element.
ESCAPES = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026"}
FRAME_PARTS = ("A", "ccf", "ccf_error", "pose")


def check_format(path: Path) -> None:
    """Refuse a name of another format."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise Refusal(
            "the gait lab is an HTML page",
            value=str(path),
            instead="give a file name that ends in .html",
        )


@contextmanager
def page_path(path: Path | None) -> Iterator[Path]:
    """Yield a path to write the page to: the one given, or one in a temporary folder,
    which a browser opens at the end."""
    if path is not None:
        yield path
        return
    page = Path(tempfile.mkdtemp(prefix="geomech-")) / "lab.html"
    try:
        yield page
    except BaseException:
        shutil.rmtree(page.parent)
        raise
    webbrowser.open(page.as_uri())


def write(charts: list[Chart], path: Path) -> None:
    """Write the page."""
    with atomic_file(path) as part:
        part.write_text(page(charts), encoding="utf-8")


def page(charts: list[Chart]) -> str:
    """Return the page of some charts as HTML."""
    style = (FOLDER / "lab.css").read_text(encoding="utf-8")
    scripts = "".join(_script(name) for name in SCRIPTS)
    script = f'"use strict";\n(() => {{\n{scripts}}})();\n'
    parts = {
        "STYLE_HASH": _hash(style),
        "SCRIPT_HASH": _hash(script),
        "STYLE": style,
        "SCRIPT": script,
        "DATA": _json(data(charts)),
    }
    # The template alternates between text and the name of a part.
    pieces = (FOLDER / "lab.html").read_text(encoding="utf-8").split("%%")
    pieces[1::2] = [parts[name] for name in pieces[1::2]]
    return "".join(pieces)


def _script(name: str) -> str:
    return (FOLDER / f"{name}.js").read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _checksum(text: str) -> str:
    # The name of a file may hold bytes that are not text.
    raw = text.encode(errors="backslashreplace")
    return hashlib.sha256(raw).hexdigest()[:12]


def _json(values: Any) -> str:
    text = json.dumps(values, separators=(",", ":"), allow_nan=False)
    for letter, escape in ESCAPES.items():
        text = text.replace(letter, escape)
    return text


def data(charts: list[Chart]) -> dict[str, Any]:
    """Return what the script of the page reads: scenes that name their tables, and the
    tables by name, each once."""
    from cmcrameri import cm

    tables: dict[str, str] = {}
    rgb = 255 * cm.vik(np.linspace(0, 1, COLOURS))[:, :3]
    colours = rgb.round().astype(int).tolist()
    scenes = [_scene(chart, tables) for chart in charts]
    return {
        "version": VERSION,
        "colours": colours,
        "shares": RESIDUAL_SHARES,
        "gaits": _gait_keys(),
        "largest": LARGEST,
        "scenes": scenes,
        "tables": tables,
    }


def _scene(chart: Chart, tables: dict[str, str]) -> dict[str, Any]:
    """Return a scene as the page reads it, and add its tables to ``tables``."""
    scene = chart.scene
    system = scene.system
    family = chart.family
    is_varied = family is not None and family.key.startswith("medium.")
    text = text_of(without_gait(scene, spell_out=is_varied))
    toml = [text]
    if family is not None:
        toml = _around_value(text, family.key)

    def stored(values: np.ndarray) -> str:
        text = base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode()
        name = hashlib.sha256(text.encode()).hexdigest()[:12]
        tables[name] = text
        return name

    frames: dict[str, dict[str, str]] = {}
    for name, frame in chart.frames.items():
        frames[name] = {}
        for part in FRAME_PARTS:
            values = getattr(frame, part)
            if values is not None:
                frames[name][part] = stored(values)
    return {
        "name": scene.name,
        "about": _about(scene.text),
        "toml": toml,
        "checksum": _checksum(text),
        "unit": length_unit(system),
        "length": body_size(system),
        "labels": [list(label) for label in shape_labels(system)],
        "frame": scene.frame,
        "gait": _gait(scene.gait),
        "axes": [axis.tolist() for axis in chart.axes],
        "knots": [knots.tolist() for knots in chart.knots],
        "degree": chart.degree,
        "grid_error": chart.grid_error,
        "harmonics": stored(chart.harmonics),
        "residual": stored(chart.residual),
        "outline": stored(chart.outline),
        "frames": frames,
        "family": _family(family),
    }


def _about(text: str) -> str:
    """Return the comment on the first line of a scene's text, or ""."""
    first = text.split("\n", 1)[0]
    if first.startswith("#"):
        return first.lstrip("# ")
    return ""


def _family(family: Family | None) -> dict[str, Any] | None:
    """Return the key of a scene that the page can vary, with its values."""
    if family is None:
        return None
    return {
        "key": family.key,
        "values": family.values.tolist(),
        "knots": family.knots.tolist(),
        "degree": family.degree,
        "own": family.own,
        "error": family.error,
    }


def _gait(gait: Gait) -> dict[str, Any]:
    """Return a gait in the form of the page's loops: a Fourier series, or points."""
    shared = {
        "kind": type(gait).__name__.lower(),
        "amplitude": gait.amplitude,
        "centre": gait.middle.tolist(),
        "reverse": bool(gait.reverse),
        "frequency": gait.frequency,
    }
    if isinstance(gait, Points):
        return {**shared, "points": [list(p) for p in gait.points]}
    mean, cos, sin = fourier_series(gait)
    shared["centre"] = (gait.middle + gait.amplitude * mean).tolist()
    return {**shared, "cos": cos.tolist(), "sin": sin.tolist()}


def _gait_keys() -> dict[str, dict[str, Any]]:
    """Return the keys of [gait] by kind and name, for each kind that the page reads.

    They are those of the scenes' reader. degrees: the key may be given as KEY_deg."""
    gaits: dict[str, dict[str, Any]] = {}
    for kind in FILE_GAITS:
        gaits[kind] = {}
        for key in keys_of(GAITS[kind]):
            gaits[kind][key.name] = {
                "schema": key.schema,
                "required": key.required,
                "default": key.default,
                "degrees": key.degrees,
            }
    return gaits


def _around_value(text: str, name: str) -> list[str]:
    """Return a scene's text before and after the value of ``SECTION.KEY``.

    The text comes from `text_of`, which writes each key of a section on a line."""
    section, _, key = name.partition(".")
    lines = text.split("\n")
    first = lines.index(f"[{section}]") + 1
    place = first
    while not lines[place].startswith(f"{key} = "):
        place += 1
    before = "\n".join([*lines[:place], f"{key} = "])
    after = "\n".join(["", *lines[place + 1 :]])
    return [before, after]
