"""Every key of a scene file, from the declarations that `geomech reference` prints: an
index, and a page for each section."""

from __future__ import annotations

import re
from pathlib import Path

from docutils.nodes import make_id

from geomech.scenes.format import keys

CONTENTS = {
    "frame": "the body frame of all velocities and displacements; the one key above all sections",
    "medium": "the force law of sand or fluid with its numbers; for intruders and robots, a stress map or a law in three dimensions",
    "body": "the links, modes or elements of the body",
    "contact": "which part of the body touches the ground when, and who bears it",
    "effects": "additions to the force law, such as end caps, mass or a slope",
    "system": "a system that replaces medium and body, such as a snake on wheels or a connection from a file",
    "gait": "the closed curve of shapes that the body repeats, or the clock of a robot's legs",
    "numerics": "numerical settings of predictions, all optional",
    "physical": "sizes that the body and the effects share",
    "intruder": "a rigid shape that moves through grains, and the shapes of robots' legs",
    "motion": "the motion of an intruder",
    "robot": "a robot that walks on grains",
}


# Before the build runs examples that add kinds.
SECTIONS = keys.sections()


def index() -> str:
    """Return a table of all sections with links to their kinds, and the tree of
    contents that leads to their pages.

    Each link has the anchors that its kind had when all keys were on this page."""
    seen: dict[str, int] = {}
    rows = []
    for name, parts in SECTIONS.items():
        page = f"{_anchors(name, seen)}[{_title(name)}](/generated/keys/{name}.md)"
        kinds = []
        for part in parts:
            link = ""
            if len(parts) > 1:
                link = f"[{_words(part)}](#{_target(name, part)})"
            kinds.append(_anchors(part.title, seen) + link)
        rows.append(f"| {page} | {CONTENTS[name]} | {', '.join(kinds)} |")
    tree = "\n".join(f"/generated/keys/{name}" for name in SECTIONS)
    return (
        "| section | contents | kinds |\n|---|---|---|\n"
        + "\n".join(rows)
        + f"\n\n```{{toctree}}\n:hidden:\n\n{tree}\n```"
    )


def write(folder: Path) -> None:
    """Write the page of every section, where its text has changed."""
    folder.mkdir(parents=True, exist_ok=True)
    for page in {*folder.iterdir()} - {folder / f"{name}.md" for name in SECTIONS}:
        page.unlink()  # of a section that is gone
    for name, parts in SECTIONS.items():
        page, text = folder / f"{name}.md", _page(name, parts)
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def _title(name: str) -> str:
    if name == "frame":
        return "`frame`"
    return "`[[effects]]`" if name == "effects" else f"`[{name}]`"


def _anchors(title: str, seen: dict[str, int]) -> str:
    """Return the anchors that a heading of a page has, those of Sphinx and of GitHub.
    seen: how often each came before on the page, to which this one is added."""
    slug = re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")
    found = []
    for anchor in dict.fromkeys([make_id(title), slug]):
        count = seen.get(anchor, 0)
        seen[anchor] = count + 1
        found.append(f"{anchor}-{count}" if count else anchor)
    return "".join(f'<span id="{anchor}"></span>' for anchor in found)


def _words(part: keys.Part) -> str:
    """Return a kind of a section in as few words as tell it from others."""
    label = re.sub(r"^\[+\w+\]+ ?", "", part.title)
    if label:
        return re.sub(r"(?:kind|law|shape) = ", "", label).replace('"', "")
    words = re.split("[,.]", part.about)[0]
    return words[:1].lower() + words[1:]


def _target(name: str, part: keys.Part) -> str:
    return make_id(f"{name} {_words(part)}")


def _page(name: str, parts: list[keys.Part]) -> str:
    """Return a heading for each kind of a section, and a table of its keys."""
    text = CONTENTS[name]
    head = f"# {_title(name)}\n\n{text[0].upper()}{text[1:]}. [Scene keys](/reference/keys.md) lists all sections."
    return "\n\n".join([head, *(_part(name, part) for part in parts)]) + "\n"


def _part(name: str, part: keys.Part) -> str:
    about = " ".join(part.about.split())
    about = re.sub(
        r"by 'geomech reference (\w+)'",
        r"on [the page of \1](/generated/keys/\1.md)",
        about,
    )
    head = f"({_target(name, part)})=\n## `{part.title}`\n\n{about}"
    if not part.keys:
        return head
    rows = [
        _row(
            key.name,
            keys.worded(key.schema),
            key.unit,
            key.value,
            key.meaning,
            key.degrees,
        )
        for key in part.keys
    ]
    table = "| key | type | unit | default | meaning |\n|---|---|---|---|---|\n"
    return f"{head}\n\n{table}" + "\n".join(rows)


def _row(
    name: str, kind: str, unit: str, value: str, meaning: str, degrees: bool
) -> str:
    def cell(text):
        return text.replace("|", r"\|")

    meaning += f"; in degrees as `{name}_deg`" * degrees
    value = value if value in ("required", "none") else f"`{cell(value)}`"
    return f"| `{name}` | {kind} | {cell(unit)} | {value} | {cell(meaning)} |"
