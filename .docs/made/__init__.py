"""What the site computes while it is built: reference pages, numbers, and pictures.

A page asks for it by an empty block of code, ```{made} NAME, which is replaced by the
Markdown that the function of that name returns. Blocks of the gallery's pages are run,
and their pictures shown.
"""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.util import logging

from . import (
    api,
    cells,
    command_line,
    conventions,
    examples,
    figures,
    keys,
    lab,
    paper,
    pictures,
    validation,
    words,
)


def notebooks() -> str:
    """Return the tree of contents of all notebooks, or that there are none."""
    folder = Path(__file__).parents[1] / "notebooks"
    names = sorted(path.stem for path in folder.glob("*.md") if path.stem != "index")
    return (
        "```{toctree}\n" + "\n".join(names) + "\n```"
        if names
        else "There are none yet."
    )


MADE = {
    "alpha": conventions.drawing,
    "api": api.index,
    "commands": command_line.page,
    "figures": figures.page,
    "keys": keys.index,
    "lab": lab.frame,
    "notebooks": notebooks,
    "thumbnails": examples.thumbnails,
    "validation": validation.table,
}


def fill_in(app, docname: str, source: list[str]) -> None:
    """Replace the blocks {made} of a page, and add what its commands print, or the
    pictures of the gallery; offer a page with Python as a notebook."""
    if docname.startswith("generated/"):
        return
    link = cells.link(docname, source[0])
    if docname.startswith("gallery/") and docname not in (
        "gallery/index",
        "gallery/figures",
    ):
        text = examples.shown(docname)
    elif docname == "paper":
        text = paper.shown(source[0])
    else:
        text = re.sub(
            r"(?m)^```\{made\} (\w+)\n```$", lambda block: MADE[block[1]](), source[0]
        )
        text = examples.with_output(words.with_entries(docname, text))
    source[0] = cells.with_line(text, link)


def compute(app) -> None:
    """Compute all pages and pictures to which others refer, before any is read."""
    generated = Path(app.srcdir) / "generated"
    generated.mkdir(exist_ok=True)
    api.write(generated / "api")
    keys.write(generated / "keys")
    for wrong in api.wrong_examples():
        logging.getLogger(__name__).warning(wrong)
    examples.compute_all()
    figures.draw_missing()
    lab.write()
    cells.prepare()


def setup(app) -> dict[str, bool]:
    """Register the computations with Sphinx."""
    app.connect("builder-inited", compute)
    app.connect("source-read", fill_in)
    app.connect("doctree-read", cells.clean)
    app.connect("env-updated", cells.join_tour)
    app.connect("doctree-resolved", pictures.mark)
    app.connect(
        "autodoc-process-docstring", api.readable, priority=400
    )  # before numpydoc
    app.connect("autodoc-process-docstring", api.with_parameters, priority=401)
    app.connect("autodoc-process-signature", api.plain_types)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
