"""The software paper on the site.

The page is in the form that the Journal of Open Source Software asks for: a title in
its front matter, sections of the first level, and citations by the keys of `paper.bib`,
in brackets. Here it gets the form of MyST and of sphinxcontrib-bibtex.
"""

from __future__ import annotations

import re

CITED = re.compile(r"\[(@\w+(?:;\s@\w+)*)\]")
REFERENCES = "```{bibliography}\n:filter: docname in docnames\n```"


def shown(text: str) -> str:
    """Return the paper as a page of the site, with its title and its references."""
    _, head, body = text.split("---\n", 2)
    title = re.search(r'(?m)^title: "(.*)"$', head)[1]
    body = re.sub(r"(?m)^# ", "## ", CITED.sub(_cited, body))
    return f"# {title}\n\n{body.rstrip()}\n\n{REFERENCES}\n"


def _cited(citation: re.Match) -> str:
    """Return the role for citations such as [@hatton2011; @hatton2013]."""
    keys = [key.strip().removeprefix("@") for key in citation[1].split(";")]
    return f"{{cite:p}}`{','.join(keys)}`"
