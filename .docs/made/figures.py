"""The page of figures: every script of `figures/` with its picture."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
FIGURES = ROOT / "figures"
DRAWN = ROOT / ".docs" / "generated" / "figures"
GROUPS = {  # headings of the folders, in the order of the page
    "paper": "Figures of the paper",
    "swimmers": "Swimmers",
    "terradynamics": "Bodies in grains",
    "grains": "Beds of grains",
    "robots": "Robots",
    "accuracy": "Accuracy and cost",
    "": "README",
}
NO_FIGURES = {"__init__", "style", "peers", "plain_loop", "others"}


def draw_missing() -> None:
    """Draw the figures of which the repository has no picture."""
    for script in scripts():
        if script.with_suffix(".png").exists():
            continue
        target = _drawn(script)
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.exists() and target.stat().st_mtime >= script.stat().st_mtime:
            continue
        env = {**os.environ, "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-m", _module(script), str(target)]
        subprocess.run(
            command, check=True, cwd=ROOT, env=env, stdout=subprocess.DEVNULL
        )


def scripts() -> list[Path]:
    """Return all scripts that draw a figure, in the order of the page."""
    found = []
    for folder in GROUPS:
        found += sorted((FIGURES / folder).glob("*.py"))
    return [path for path in found if path.stem not in NO_FIGURES]


def page() -> str:
    """Return a section for each folder, with title, text, picture and command of every
    figure."""
    sections = []
    for folder, heading in GROUPS.items():
        of_folder = [x for x in scripts() if x.parent == FIGURES / folder]
        sections.append(f"## {heading}\n\n" + "\n\n".join(map(_figure, of_folder)))
    return "\n\n".join(sections)


def _module(script: Path) -> str:
    return ".".join(script.relative_to(ROOT).with_suffix("").parts)


def _drawn(script: Path) -> Path:
    return DRAWN / script.relative_to(FIGURES).with_suffix(".png")


def _figure(script: Path) -> str:
    text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    title, _, about = " ".join(text.partition("\n\n")[0].split()).partition(": ")
    about = about[:1].upper() + about[1:]
    picture = script.with_suffix(".png")
    if picture.exists():
        target = f"../../{picture.relative_to(ROOT).as_posix()}"
    else:
        drawn = _drawn(script).relative_to(ROOT / ".docs").as_posix()
        target = f"/{drawn}"
    alt = title.replace("[", "(").replace("]", ")")
    heading = title.rstrip(".")
    command = f"```sh\npython -m {_module(script)}\n```"
    return f"### {heading}\n\n{about}\n\n![{alt}]({target})\n\n{command}"
