"""Pages as Jupyter notebooks, to download.

A page in MyST's format of notebooks is executed by MyST-NB; its notebook, with what its
cells print and draw, is cleaned of directives and of links within the site. Any other
page with Python becomes a notebook that is not executed: its text, the files that it
names, its Python, and its commands. The tour is one notebook as well.
"""

from __future__ import annotations

import re
from pathlib import Path

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

DOCS = Path(__file__).parents[1]
FOLDER = DOCS / "generated" / "notebooks"
FILES = DOCS / "generated" / "files"
EXECUTED = "file_format: mystnb"
TOUR = "tour"
LINK = "This page is a notebook as well: "
BLOCK = re.compile(r"(?ms)^```([^\n]*)\n(.*?)^```$")
WRITTEN = re.compile(r"(?ms)^%%writefile ([\w.-]+)\n(.*?)^```$")
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def is_executed(text: str) -> bool:
    """Return whether MyST-NB executes a page."""
    return text.startswith("---\n" + EXECUTED)


def link(docname: str, text: str) -> str:
    """Return the sentence that links to the notebook of a page, "" of the front page
    and of a page without Python; write the notebook, or the files that an executed page
    writes."""
    name = docname.rpartition("/")[2]
    if is_executed(text):
        for file, content in WRITTEN.findall(text):
            FILES.mkdir(parents=True, exist_ok=True)
            (FILES / file).write_text(content, encoding="utf-8")
        return f"{LINK}{{nb-download}}`{name}.ipynb <{name}.ipynb>`."
    if docname == "index" or not re.search(r"(?m)^```python( |$)", text):
        return ""
    path = FOLDER / f"{docname}.ipynb"
    path.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(from_page(text), path)
    return f"{LINK}{{download}}`{name}.ipynb </generated/notebooks/{docname}.ipynb>`."


def with_line(text: str, line: str) -> str:
    """Return a page with a line below its title."""
    if not line:
        return text
    title = re.search(r"(?m)^# .*\n", text)
    return f"{text[: title.end()]}\n{line}\n{text[title.end() :]}"


def from_page(text: str) -> nbformat.NotebookNode:
    """Return the notebook of a page that is not executed."""
    cells = []
    end = 0
    prose = ""
    for block in BLOCK.finditer(text):
        prose += text[end : block.start()]
        end = block.end()
        code = _code(*block.groups())
        if code is None:
            prose += block[0]
            continue
        cells += _markdown(prose)
        cells.append(new_code_cell(code))
        prose = ""
    cells += _markdown(prose + text[end:])
    return _notebook(cells)


def _code(first: str, content: str) -> str | None:
    """Return the code cell of a block, or None of one that stays text."""
    language, _, name = first.partition(" ")
    content = content.strip()
    if language.isalpha() and re.fullmatch(r"[\w.-]+", name):
        return f"%%writefile {name}\n{content}"
    if language == "python":
        return content
    if language == "console":
        # A command goes on after a backslash at the end of a line.
        commands = re.split(r"(?<!\\)\n", content)
        return "\n".join(f"!{command.removeprefix('$ ')}" for command in commands)
    return None


def _markdown(text: str) -> list:
    """Return a list of the cell of a text, empty where nothing remains of it."""
    text = plain(text)
    return [new_markdown_cell(text)] if text else []


def plain(text: str) -> str:
    """Return Markdown without what only this site understands: front matter,
    directives, roles, pictures and links to its pages, and without the link to the
    next page."""
    text = re.sub(r"(?s)\A---\n.*?\n---\n", "", text)
    text = re.sub(rf"(?m)^({re.escape(LINK)}|\*\*Next:\*\*).*\n?", "", text)
    text = re.sub(r"(?ms)^(`{3,}|:{3,})\{.*?^\1$\n?", "", text)
    text = re.sub(r"(?m)^(:{3,}.*|\([\w-]+\)=)$\n?", "", text)
    text = re.sub(r"\{[\w-]+\}`([^`<]*?)\s*(<[^`>]*>)?`", r"\1", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)\n?", "", text)
    text = re.sub(r"\[([^\]]+)\]\((?![a-z]+:)[^)]*\)", r"\1", text)
    return re.sub(r"\n{3,}", "\n\n", text).strip()


def clean(app, doctree) -> None:
    """Clean the executed notebook of a page that has been read."""
    path = _executed(app, app.env.docname)
    if path.exists():
        notebook = nbformat.read(path, as_version=4)
        nbformat.write(_notebook(_cleaned(notebook)), path)


def join_tour(app, env) -> None:
    """Write the pages of the tour as one notebook, in their order."""
    order = env.toctree_includes.get(f"{TOUR}/index", [])
    paths = [_executed(app, docname) for docname in order]
    cells = []
    for path in paths:
        if path.exists():
            cells += nbformat.read(path, as_version=4).cells
    nbformat.write(_notebook(cells), FOLDER / f"{TOUR}.ipynb")


def prepare() -> None:
    """Write an empty tour, to which its first page links before the others are read."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    nbformat.write(_notebook([]), FOLDER / f"{TOUR}.ipynb")


def _executed(app, docname: str) -> Path:
    return Path(app.env.mystnb_config.output_folder) / f"{docname}.ipynb"


def _cleaned(notebook: nbformat.NotebookNode) -> list:
    cells = []
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cells += _markdown(cell.source)
        else:
            cells.append(cell)
    return cells


def _notebook(cells: list) -> nbformat.NotebookNode:
    """Return the notebook of cells, numbered so that a build repeats itself."""
    for number, cell in enumerate(cells):
        cell.id = f"cell-{number}"
    return new_notebook(cells=cells, metadata={"kernelspec": KERNEL})
