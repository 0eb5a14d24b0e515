"""Blocks of code that the build runs.

On any page, a block ```LANGUAGE FILE is a file of that name. The commands of a block
```console, each after `$ `, are run in the folder of the page's files, after the
programs of the page, and are followed by what they print; a picture
/generated/pages/FILE is one that they draw there. An empty block ```printed becomes
what the last program ```python before it prints. On a page of the gallery the commands
of a block ```sh and the programs of a block ```python are run, the picture of the
command is shown, and the scene is added.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"(?ms)^```(\w+)(?: ([\w.-]+))?\n(.*?)^```$")
GALLERY = ROOT / ".docs" / "gallery"
DRAWN = ROOT / ".docs" / "generated" / "pages"
PICTURES = ROOT / ".docs" / "generated" / "gallery"
SHELL = f'geomech() {{ "{sys.executable}" -m geomech "$@"; }}\n'
LONGEST = 40  # lines of output that a page shows


def run(code: str, folder: Path, program: bool = False) -> str:
    """Return what a program, or commands, print in a folder; RuntimeError where they
    fail."""
    command = (
        [sys.executable, "-c", code] if program else ["bash", "-euc", SHELL + code]
    )
    paths = f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    env = {**os.environ, "PYTHONPATH": paths, "MPLBACKEND": "agg", "COLUMNS": "100"}
    ran = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)
    if ran.returncode:
        raise RuntimeError(f"{code}\nended with {ran.returncode}: {ran.stderr}")
    return ran.stdout


def with_output(text: str) -> str:
    """Return a page in which every command is followed by what it prints, and every
    program for which the page asks for it."""
    if "```console\n" not in text and "```printed\n" not in text:
        return text
    printed = ""
    parts = []
    end = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for block in BLOCK.finditer(text):
            if block[1] == "python":
                printed = run(block[3], folder, program=True)
            if block[1] == "printed":
                shown = f"```text\n{printed.rstrip()}\n```"
            else:
                shown = _shown(block, folder)
            parts += [text[end : block.start()], shown]
            end = block.end()
        for picture in re.findall(r"\]\(/generated/pages/([\w.-]+)\)", text):
            DRAWN.mkdir(parents=True, exist_ok=True)
            shutil.copy(folder / picture, DRAWN / picture)
    return "".join([*parts, text[end:]])


def _shown(block: re.Match, folder: Path) -> str:
    language, name, code = block.groups()
    if name:
        (folder / name).write_text(code)
    if language == "csv":
        return f"```text\n{code}```"
    if language != "console":
        return block[0]
    lines = []
    # A command may go on in the next line.
    for line in re.split(r"(?<!\\)\n", code.rstrip("\n")):
        lines.append(line)
        if line.startswith("$ geomech "):
            printed = run(line[2:], folder).rstrip().splitlines()
            lines += printed if len(printed) <= LONGEST else [*printed[:LONGEST], "..."]
    return "```text\n" + "\n".join(lines) + "\n```"


class Example:
    """One section of a page of the gallery: title, text, command, scene, program."""

    def __init__(self, page: str, text: str):
        self.page, self.title = page, text.partition("\n")[0].strip()
        self.anchor = re.sub(r"[^\w -]", "", self.title.lower()).replace(" ", "-")
        self.text = BLOCK.sub("", text.partition("\n")[2]).strip()
        self.blocks = {
            language: (name, code) for language, name, code in BLOCK.findall(text)
        }
        picture = re.search(r"[\w-]+\.(?:png|gif)\b", text)
        if picture is None or not {"sh", "python"} <= {*self.blocks}:
            raise ValueError(
                f"{page}.md, {self.title}: an example needs a block sh that draws a "
                "picture and a block python"
            )
        self.picture = picture[0]

    def compute(self) -> None:
        """Run the command and the program, and store the picture of the command."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for file, code in self.blocks.values():
                if file:
                    (folder / file).write_text(code)
            run(self.blocks["sh"][1], folder)
            (folder / self.picture).replace(PICTURES / self.picture)
            run(self.blocks["python"][1], folder, program=True)

    @property
    def scene(self) -> str:
        """The scene file of the command, or ""."""
        for language in {"toml", "csv"} & {*self.blocks}:
            return self.blocks[language][1]
        words = self.blocks["sh"][1].split()
        return (
            run(f"geomech scenes --show {words[2]}", ROOT)
            if words[1] not in ("stress", "fit-medium")
            else ""
        )

    def markdown(self) -> str:
        """Return the section of the site."""
        data = "Data" if "csv" in self.blocks else "Scene"
        tabs = {
            "Command": ("sh", self.blocks["sh"][1]),
            data: ("toml" if data == "Scene" else "text", self.scene),
        }
        tabs["Python"] = ("python", self.blocks["python"][1])
        items = [f":::{{tab-item}} {title}\n```{language}\n{code.strip()}\n```\n:::"
                 for title, (language, code) in tabs.items() if code]  # fmt: skip
        picture = f"![{self.title}](/generated/gallery/{self.picture})"
        inside = "\n".join(items)
        return f"## {self.title}\n\n{self.text}\n\n{picture}\n\n::::{{tab-set}}\n{inside}\n::::\n"


def sections(page: Path) -> tuple[str, list[Example]]:
    """Return the text before the first section of a page of the gallery, and the
    sections."""
    head, *parts = re.split(r"(?m)^## ", page.read_text(encoding="utf-8"))
    return head, [Example(page.stem, part) for part in parts]


def pages() -> list[Path]:
    """Return the pages of the gallery in the order of its index."""
    names = re.findall(
        r"(?m)^\w[\w-]*$", (GALLERY / "index.md").read_text().partition("{toctree}")[2]
    )
    return [GALLERY / f"{name}.md" for name in names if name != "figures"]


def compute_all(workers: int = 2) -> None:
    """Run all examples, and draw their pictures."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    all_examples = [example for page in pages() for example in sections(page)[1]]
    names = [example.picture for example in all_examples]
    assert len({*names}) == len(names), (
        f"two examples draw one picture: {sorted(names)}"
    )
    if os.environ.get("QUICK"):  # while pages are written
        all_examples = [
            example
            for example in all_examples
            if not (PICTURES / example.picture).exists()
        ]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(Example.compute, all_examples))


def shown(docname: str) -> str:
    """Return the text of a page of the gallery."""
    head, examples = sections(GALLERY / f"{docname.removeprefix('gallery/')}.md")
    return "\n".join([head, *(example.markdown() for example in examples)])


def thumbnails() -> str:
    """Return a grid of cards for each page of the gallery, with a card per example."""
    parts = []
    for page in pages():
        head, examples = sections(page)
        title = head.partition("\n")[0].lstrip("# ")
        cards = [f":::{{grid-item-card}} {x.title}\n:link: {x.page}.html#{x.anchor}\n:link-type: url\n"
                 f":img-top: /generated/gallery/{x.picture}\n:::" for x in examples]  # fmt: skip
        parts.append(
            f"## {title}\n\n::::{{grid}} 1 2 3 3\n:gutter: 2\n\n"
            + "\n".join(cards)
            + "\n::::"
        )
    return "\n\n".join(parts)
