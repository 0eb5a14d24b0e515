"""The software paper on the site.

The page is in the form that the Journal of Open Source Software asks for: a title in
its front matter, sections of the first level, and citations by the keys of `paper.bib`.
"""

from __future__ import annotations

import re
from pathlib import Path

HERE = Path(__file__).parents[1]
ENTRY = re.compile(r"(?ms)^@\w+\{(\w+),\n(.*?)^\}")
FIELD = re.compile(r"(?m)^  (\w+) = \{(.*)\},?$")
CITED = re.compile(r"\[(@\w+(?:;\s@\w+)*)\]")


def shown(text: str) -> str:
    """Return the paper as a page of the site: with its title, citations by name and
    year, and the references that it cites."""
    _, head, body = text.split("---\n", 2)
    title = re.search(r'(?m)^title: "(.*)"$', head)[1]
    entries = bibliography()
    cited = sorted({key for keys in CITED.findall(body) for key in _keys(keys)})

    def by_name(citation: re.Match) -> str:
        names = [_name(entries[key]) for key in _keys(citation[1])]
        return f"({'; '.join(names)})"

    body = re.sub(r"(?m)^# ", "## ", CITED.sub(by_name, body))
    references = "\n".join(f"- {_reference(entries[key])}" for key in cited)
    return f"# {title}\n\n{body.rstrip()}\n\n{references}\n"


def bibliography() -> dict[str, dict[str, str]]:
    """Return the fields of each entry of `paper.bib`, without braces within them."""
    text = (HERE / "paper.bib").read_text(encoding="utf-8")
    entries = {}
    for key, lines in ENTRY.findall(text):
        fields = FIELD.findall(lines)
        entries[key] = {name: re.sub("[{}]", "", value) for name, value in fields}
    return entries


def _keys(citation: str) -> list[str]:
    return [key.removeprefix("@") for key in citation.replace("\n", " ").split("; ")]


def _name(entry: dict[str, str]) -> str:
    surnames = [name.partition(",")[0] for name in entry["author"].split(" and ")]
    if len(surnames) > 2 or surnames[-1] == "others":
        return f"{surnames[0]} et al. {entry['year']}"
    return f"{' and '.join(surnames)} {entry['year']}"


def _reference(entry: dict[str, str]) -> str:
    authors = entry["author"].replace(" and others", " et al.").replace(" and ", "; ")
    parts = [f"{authors} ({entry['year']}). {entry['title']}."]
    where = entry.get("journal") or entry.get("booktitle")
    if where:
        numbers = [entry[name] for name in ("volume", "pages") if name in entry]
        parts.append(f"*{where}* {', '.join(numbers).replace('--', '-')}.")
    if "doi" in entry:
        parts.append(f"[doi:{entry['doi']}](https://doi.org/{entry['doi']})")
    else:
        parts.append(f"<{entry['url']}>")
    return " ".join(parts)
