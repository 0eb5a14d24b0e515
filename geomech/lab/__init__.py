"""The page of the gait lab: one file that needs no server, no network and nothing installed.

Its tables are base64 texts of numbers in single precision, its script and style stand in it and are allowed by their hashes
alone, so that nothing else runs and nothing is fetched. Names and texts of scenes are data, never markup."""

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
from geomech.gaits import KINDS as GAITS
from geomech.gaits import Gait, Points
from geomech.geometry.gait import LARGEST
from geomech.io.files import atomic_file
from geomech.scenes.key import keys_of
from geomech.scenes.write import text_of, without_gait
from geomech.studies.charts import RESIDUAL_SHARES, Chart, fourier_series
from geomech.systems.base import body_size, length_unit, shape_labels
from rft.core.refusal import Refusal

FOLDER = Path(__file__).parent
SCRIPTS = (
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
)  # in this order
READ = (
    "circle",
    "ellipse",
    "butterfly",
    "fourier",
    "points",
)  # kinds of gaits of files that the page opens
COLOURS = 65  # of the map's scale
ESCAPED = {
    "<": "\\u003c",
    ">": "\\u003e",
    "&": "\\u0026",
}  # in JSON, so that no text can end its element


def check_format(path: Path) -> None:
    """Refuse a name of another format."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise Refusal(
            "the gait lab is a page",
            value=str(path),
            instead="name a file that ends in .html",
        )


@contextmanager
def opened(path: Path | None) -> Iterator[Path]:
    """Give a path to write the page to: the one named, or one in a temporary folder that a browser then opens."""
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
    script = "".join(
        ['"use strict";\n(() => {\n', *(_script(name) for name in SCRIPTS), "})();\n"]
    )
    parts = {
        "STYLE_HASH": _hash(style), "SCRIPT_HASH": _hash(script), "STYLE": style, "SCRIPT": script, "DATA": _json(data(charts)),
    }  # fmt: skip
    pieces = (
        (FOLDER / "lab.html").read_text(encoding="utf-8").split("%%")
    )  # text, name, text, name ...
    return "".join(parts[x] if k % 2 else x for k, x in enumerate(pieces))


def _script(name: str) -> str:
    return (FOLDER / f"{name}.js").read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _checksum(text: str) -> str:
    # a name of a file may hold bytes that are no text
    raw = text.encode(errors="backslashreplace")
    return hashlib.sha256(raw).hexdigest()[:12]


def _json(values: Any) -> str:
    text = json.dumps(values, separators=(",", ":"), allow_nan=False)
    for letter, escaped in ESCAPED.items():
        text = text.replace(letter, escaped)
    return text


def data(charts: list[Chart]) -> dict[str, Any]:
    """Return what the script of the page reads: scenes, and their tables, each once, by a name that they share."""
    from cmcrameri import cm

    tables: dict[str, str] = {}
    colours = (
        (255 * cm.vik(np.linspace(0, 1, COLOURS))[:, :3]).round().astype(int).tolist()
    )
    scenes = [_scene(chart, tables) for chart in charts]
    return {
        "version": VERSION,
        "colours": colours,
        "shares": RESIDUAL_SHARES,
        "gaits": _declared(),
        "largest": LARGEST,
        "scenes": scenes,
        "tables": tables,
    }


def _scene(chart: Chart, tables: dict[str, str]) -> dict[str, Any]:
    scene, system = chart.scene, chart.scene.system
    family = chart.family
    is_varied = family is not None and family.key.startswith("medium.")
    text = text_of(without_gait(scene, spell_out=is_varied))
    first = scene.text.split("\n", 1)[0]

    def stored(values: np.ndarray) -> str:
        text = base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode()
        name = hashlib.sha256(text.encode()).hexdigest()[:12]
        tables[name] = text
        return name

    parts = ("A", "ccf", "ccf_error", "pose")
    frames = {
        name: {
            part: stored(x) for part in parts if (x := getattr(frame, part)) is not None
        }
        for name, frame in chart.frames.items()
    }
    return {
        "name": scene.name,
        "about": first.lstrip("# ") if first.startswith("#") else "",
        "toml": [text] if family is None else _around_value(text, family.key),
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
        "family": None if family is None else {
            "key": family.key, "values": family.values.tolist(), "knots": family.knots.tolist(), "degree": family.degree,
            "own": family.own, "error": family.error,
        },
    }  # fmt: skip


def _gait(gait: Gait) -> dict[str, Any]:
    """Return a gait as the page has loops: a Fourier series, or points."""
    shared = {
        "kind": type(gait).__name__.lower(), "amplitude": gait.amplitude, "centre": gait.middle.tolist(),
        "reverse": bool(gait.reverse), "frequency": gait.frequency,
    }  # fmt: skip
    if isinstance(gait, Points):
        return {**shared, "points": [list(p) for p in gait.points]}
    mean, cos, sin = fourier_series(gait)
    shared["centre"] = (gait.middle + gait.amplitude * mean).tolist()
    return {**shared, "cos": cos.tolist(), "sin": sin.tolist()}


def _declared() -> dict[str, dict[str, Any]]:
    """Return what the [gait] of each kind that the page reads may say, by kind and key,
    as the scenes' reader has it. degrees: the key may be given as KEY_deg."""
    return {
        kind: {
            key.name: {
                "schema": key.schema,
                "required": key.required,
                "default": key.default,
                "degrees": key.degrees,
            }
            for key in keys_of(GAITS[kind])
        }
        for kind in READ
    }


def _around_value(text: str, name: str) -> list[str]:
    """Return a scene's text before and after the value of ``SECTION.KEY``. The text is
    of our own writer, which puts each key of a section on a line."""
    section, _, key = name.partition(".")
    lines = text.split("\n")
    first = lines.index(f"[{section}]") + 1
    place = next(
        k for k in range(first, len(lines)) if lines[k].startswith(f"{key} = ")
    )
    before = "\n".join([*lines[:place], f"{key} = "])
    after = "\n".join(["", *lines[place + 1 :]])
    return [before, after]
