"""The Python reference: a page for each public package, from `__all__` and docstrings,
whose examples are run."""

from __future__ import annotations

import doctest
import importlib
import inspect
import io
import re
from pathlib import Path

from geomech.scenes.format.key import first_sentence
from rft.core.checks import number_fields

PACKAGES = {
    "From scene to result": [
        "geomech",
        "geomech.scenes",
        "geomech.studies.scene_tables",
        "geomech.mathematics.gaits",
        "geomech.mathematics.systems",
        "geomech.mathematics.tiers",
        "geomech.studies.optimisation",
        "geomech.studies.measured",
        "geomech.studies.mechanics.undulation",
        "geomech.plots",
        "geomech.runs.workers",
    ],
    "Geometry of any velocity": [
        "geomech.mathematics.geometry.connection",
        "geomech.mathematics.geometry.curvature",
        "geomech.mathematics.geometry.reconstruct",
        "geomech.mathematics.geometry.metric",
        "geomech.mathematics.symbolic",
    ],
    "Mechanics of the horizontal plane": [
        "rft",
        "rft.laws",
        "rft.bodies",
        "rft.effects",
        "rft.hydrodynamics",
        "rft.laws.drag",
        "rft.fits.rods",
    ],
    "Terradynamics": [
        "rft.terradynamics.plates",
        "rft.terradynamics.meshes",
        "rft.terradynamics.ground",
        "rft.terradynamics.walking",
        "rft.fits.plates",
        "rft.mujoco",
    ],
    "Robots that learn": ["geomech.gym"],
    "Simulated grains": ["rft.grains"],
}


def index() -> str:
    """Return the table of all pages and the tree of contents that leads to them."""
    parts = []
    for heading, names in PACKAGES.items():
        rows = [
            f"| [{name}](/generated/api/{name}.rst) | {_summary(name)} |"
            for name in names
        ]
        tree = "\n".join(f"/generated/api/{name}" for name in names)
        parts.append(
            f"## {heading}\n\n| module | contents |\n|---|---|\n" + "\n".join(rows)
        )
        parts.append(f"```{{toctree}}\n:hidden:\n\n{tree}\n```")
    return "\n\n".join(parts)


def write(folder: Path) -> None:
    """Write the page of every package, where its text has changed."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [name for group in PACKAGES.values() for name in group]
    for page in {*folder.iterdir()} - {folder / f"{name}.rst" for name in names}:
        page.unlink()  # of a package that is gone
    for name in names:
        page, text = folder / f"{name}.rst", _page(name)
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def readable(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Turn a docstring of plain sentences into reStructuredText: |x| is no
    substitution, and a table stays as it is."""

    def escaped(some):
        return [re.sub(r"(``.*?``)|\|", lambda x: x[1] or r"\|", line) for line in some]

    heads = {
        lines[k - 1].strip(): k - 1
        for k, line in enumerate(lines)
        if re.fullmatch(r"\s*-{3,}", line)
    }
    begin, examples = (
        min(heads.values(), default=len(lines)),
        heads.get("Examples", len(lines)),
    )
    sections = escaped(lines[begin:examples]) + lines[examples:]  # numpydoc's
    lines[:] = escaped(lines[:begin])
    table = {k for k, line in enumerate(lines) if line.startswith(" ")}
    table |= {k for k, line in enumerate(lines) if re.search(r"\S   +\S", line)}
    for k in reversed(range(len(lines))):
        if k in table:
            lines[k] = "   " + lines[k].replace(r"\|", "|")
            if k - 1 not in table:
                lines[k:k] = ["", "::", ""]
            if k + 1 not in table:
                lines.insert(k + 1 + 3 * (k - 1 not in table), "")
    lines += sections


def plain_types(
    app, what: str, name: str, obj, options, signature: str | None, returned: str | None
):
    """Drop bounds and meanings from the types of a signature, as they stand in the list
    of parameters."""
    return tuple(text and _without_annotations(text) for text in (signature, returned))


def _without_annotations(text: str) -> str:
    head, found, tail = text.partition("Annotated[")
    if not found:
        return text
    depth, quote, comma = 0, "", None
    for k, character in enumerate(tail):
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        elif character in "([{":
            depth += 1
        elif character == "," and depth == 0 and comma is None:
            comma = k
        elif character in ")]}":
            if depth == 0:
                return head + tail[:comma] + _without_annotations(tail[k + 1 :])
            depth -= 1
    return text


def with_parameters(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Add the list of parameters of a class whose fields are annotated with bounds,
    unit and meaning."""
    if (
        what != "class"
        or not (numbers := number_fields(obj))
        or any(line.startswith("Parameters") for line in lines)
    ):
        return
    lines += ["", "Parameters", "----------"]
    for field, number in numbers.items():
        kind = "int" if number.whole else "float"
        unit = "" if number.unit == "-" else f", {number.unit}"
        meaning = number.meaning.replace("|", r"\|").replace("*", r"\*")
        lines += [
            f"{field} : {kind}{unit}",
            f"    {meaning[:1].upper()}{meaning[1:]}; {number.low:g} to {number.high:g}.",
        ]
    lines.append("")


def _summary(name: str) -> str:
    text = inspect.getdoc(importlib.import_module(name)) or ""
    return " ".join(text.partition("\n\n")[0].split()).replace("|", r"\|")


def _page(name: str) -> str:
    module = importlib.import_module(name)
    objects = {
        public: getattr(module, public)
        for public in _public(module)
        if not public.isupper()
    }
    objects = {public: value for public, value in objects.items() if _home(name, value)}
    classes = [public for public, value in objects.items() if inspect.isclass(value)]
    functions = [
        public for public, value in objects.items() if inspect.isroutine(value)
    ]
    lines = [name, "=" * len(name), "", _summary(name), ""]
    if name == "geomech":
        lines += [
            "Its names are those of the modules below, imported at their first use.",
            "",
            *_top(module),
            "",
        ]
        lines += [
            line
            for public in _nowhere_else(module)
            for line in (f".. autofunction:: geomech.{public}", "")
        ]
        return "\n".join(lines)
    for heading, names, directive in (
        ("Classes", classes, "autoclass"),
        ("Functions", functions, "autofunction"),
    ):
        if names:
            lines += [
                heading,
                "-" * len(heading),
                "",
                ".. list-table::",
                "   :widths: auto",
                "",
            ]
            for public in names:
                about = (
                    first_sentence(objects[public])
                    .replace("|", r"\|")
                    .replace("*", r"\*")
                )
                lines += [
                    f"   * - :py:obj:`~{name}.{public}`",
                    f"     - {about or '..'}",
                ]
            lines.append("")
            for public in names:
                lines += [f".. {directive}:: {name}.{public}", ""]
    return "\n".join(lines)


def _home(name: str, value) -> bool:
    """Return whether the page of a package is the one of all pages that documents an
    object it offers."""
    module = getattr(value, "__module__", name)
    pages = [
        page
        for group in PACKAGES.values()
        for page in group
        if f"{module}.".startswith(f"{page}.")
    ]
    return not pages or max(pages, key=len) == name


def _public(module) -> list[str]:
    """Return the names in __all__, else those that the module itself defines."""
    if hasattr(module, "__all__"):
        return sorted(module.__all__)

    def own(value):
        return getattr(value, "__module__", "") == module.__name__

    return sorted(
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and own(value)
    )


def _nowhere_else(module) -> list[str]:
    """Return the functions of `geomech` that no other page documents, each by its first
    name."""
    shown = {
        id(getattr(_imported(page), public))
        for page in _pages()
        if page != "geomech"
        for public in _public(_imported(page))
    }
    functions: dict[int, str] = {}
    for name in dir(module):
        value = getattr(module, name)
        if inspect.isfunction(value) and id(value) not in shown:
            functions.setdefault(id(value), name)
    return [*functions.values()]


def wrong_examples() -> list[str]:
    """Run the examples of all docstrings in the reference; return what those print that
    end otherwise than shown."""
    objects: dict[int, tuple[str, object]] = {}
    for page in _pages():
        module = _imported(page)
        for public in dir(module) if page == "geomech" else _public(module):
            value = getattr(module, public)
            if inspect.isclass(value) or inspect.isroutine(value):
                objects.setdefault(id(value), (f"{page}.{public}", value))
    finder, runner, failures = (
        doctest.DocTestFinder(exclude_empty=True),
        doctest.DocTestRunner(verbose=False),
        [],
    )
    for name, value in objects.values():
        for test in finder.find(value, name, globs={}):
            out = io.StringIO()
            if test.examples and runner.run(test, out=out.write).failed:
                failures.append(out.getvalue())
    return failures


def _pages() -> list[str]:
    return [name for names in PACKAGES.values() for name in names]


def _imported(page: str):
    return importlib.import_module(page)


def _top(module) -> list[str]:
    """Return a table of the names of `geomech` with the module that documents each."""
    rows = []
    for public in sorted(name for name in dir(module) if not name.startswith("_")):
        value = getattr(module, public)
        home = value.__name__ if inspect.ismodule(value) else value.__module__
        pages = [
            page
            for group in PACKAGES.values()
            for page in group
            if f"{home}.".startswith(f"{page}.")
        ]
        page = max(pages, key=len)
        rows += [
            f"   * - ``geomech.{public}``",
            f"     - :doc:`{page}`" if page != "geomech" else f"     - ``{home}``",
        ]
    return [
        ".. list-table::",
        "   :header-rows: 1",
        "",
        "   * - name",
        "     - defined in",
        *rows,
        "",
    ]
