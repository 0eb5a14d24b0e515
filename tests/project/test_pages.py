"""The pages: README, CONTRIBUTING and those of the site: links, pictures, commands and
code, as they stand there. The site's build (`.ci/docs`) runs the examples of the
gallery and the notebooks, and finds pages that no other leads to."""

import importlib.util
import itertools
import pathlib
import re
import shlex

import pytest
from commands import geomech
from frozen import read_commands

from geomech.questions.shared import names
from geomech.scenes.data import drag
from geomech.shell import cli
from rft.balance import backend
from rft.laws import CATALOGUE
from rft.terradynamics.plates import VERTICAL

pytestmark = pytest.mark.usefixtures("fastest")
ROOT = pathlib.Path(__file__).parents[2]
README, CONTRIBUTING = ROOT / "README.md", ROOT / "CONTRIBUTING.md"
SITE = ROOT / ".docs"
PAGES = [
    README,
    CONTRIBUTING,
    *sorted(p for p in SITE.rglob("*.md") if SITE / "generated" not in p.parents),
]
SHIPPED = {
    *names.scene_names(),
    *names.intruder_names(),
    *names.walker_names(),
    *CATALOGUE,
    *VERTICAL,
    *drag.SAMPLES,
}
COMMANDS = cli.Commands()
NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?"


def text(page):
    return page.read_text(encoding="utf-8")


def blocks(page, language=""):
    """Blocks of code on a page whose first line is ```language."""
    found = re.findall(r"(?ms)^```([^\n]*)\n(.*?)^```$", text(page))
    return [code for first, code in found if first == language]


def prose(page):
    """Lines of a page outside of its blocks of code, without code within them."""
    outside = re.sub(r"(?ms)^```.*?^```$", "", text(page))
    return re.sub(
        r"`[^`]*`",
        lambda code: code[0].strip("`") if "](" not in code[0] else "",
        outside,
    )


def anchors(page):
    """GitHub's anchors of the headings of a page; two headings of one name would have
    the same here."""
    titles = re.findall(r"^#+ (.+)$", prose(page), re.M)
    found = [
        re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles
    ]
    assert len(set(found)) == len(found), page
    return set(found)


def links(page):
    """Targets of the links and pictures of a page within the repository, as
    (file, anchor)."""
    for target in re.findall(r"\]\(([^)]+)\)", prose(page)):
        if not re.match(r"[a-z]+:|/generated/", target):  # which the build makes
            path, _, anchor = target.partition("#")
            yield (page.parent / path).resolve() if path else page, anchor


def commands(page):
    """Command lines of geomech on a page, as words: of blocks, of tables and in
    sentences; templates with their brackets."""
    code = [
        line
        for language in ("", "sh", "console")
        for block in blocks(page, language)
        for line in block.replace("\\\n", " ").splitlines()
    ]
    inline = re.findall(r"`([^`]+)`", re.sub(r"(?ms)^```.*?^```$", "", text(page)))
    for line in code + [" ".join(x.split()).replace("\\|", "|") for x in inline]:
        line = line.removeprefix("$ ")
        if re.match(r"(\.venv/bin/)?geomech [a-z][a-z-]*( |$)", line):
            for one in re.split(r" && ", line):
                yield shlex.split(one.partition(" > ")[0], comments=True)[1:]


def test_links_and_pictures_of_all_pages_lead_somewhere():
    headings = {page: {"", *anchors(page)} for page in PAGES}
    found = [(page, *link) for page in PAGES for link in links(page)]
    assert len(found) > 110
    for page, path, anchor in found:
        assert path.is_file(), (page, path)
        assert anchor in headings.get(path, {""}), (page, path, anchor)


def test_every_picture_is_shown_on_a_page():
    shown = {path for page in PAGES for path, _ in links(page)}
    assert set((ROOT / "figures").rglob("*.png")) <= shown


def is_name(word):
    return word in SHIPPED or not re.fullmatch(r"[a-z][\w-]+", word)


def test_commands_on_all_pages_exist_with_their_options_and_names():
    found = [line for page in PAGES for line in commands(page)]
    # `loop` is the example of a new command.
    assert {line[0] for line in found} == {*COMMANDS, "loop"}
    for name, *words in found:
        if name == "loop":
            continue
        options = {"--plugin"}
        for parameter in COMMANDS[name].params:
            options |= {*parameter.opts, *parameter.secondary_opts}
        used = re.findall(r"(?:^|[ \[|])(--?[a-z][\w-]*)", " ".join(words))
        assert {*used} <= options, (name, words)
        if name not in ("scenes", "reference"):
            assert not words or is_name(words[0]), (name, words)


# They draw for seconds each: commands.txt has some; their options and names are looked
# up above.
DRAWN = {"run", "ccf", "trajectory"}
FIRST = README, SITE / "start.md"  # pages for somebody who types a first command
TYPED = {
    " ".join(line): line
    for page in FIRST
    for line in commands(page)
    if len(line) > 1
    and line[0] not in DRAWN
    and not any(re.search(r"\b[A-Z]{3,}\b", word) for word in line)
}


@pytest.mark.parametrize(
    "line",
    [line for text, line in TYPED.items() if text not in read_commands()],
    ids=" ".join,
)
def test_what_readme_and_start_say_to_type_runs(line, tmp_path, monkeypatch):
    """What is no line of data/commands.txt."""
    monkeypatch.chdir(tmp_path)
    code, _, err = geomech(*line)
    assert code == 0, err
    files = {file for option, file in itertools.pairwise(line) if option in OUTPUTS}
    assert files == {p.name for p in tmp_path.iterdir()}


# Whose code the site's build runs.
BUILT = SITE / "gallery", SITE / "notebooks", SITE / "tour"
WITH_PYTHON = {page.relative_to(ROOT).as_posix(): page for page in PAGES
               if page.parent not in BUILT and blocks(page, "python")}  # fmt: skip


OUTPUTS = ("-o", "--plot")


@pytest.mark.parametrize("page", WITH_PYTHON.values(), ids=WITH_PYTHON)
def test_python_on_all_pages_runs(page, tmp_path, capsys, monkeypatch, own_parts):
    monkeypatch.chdir(tmp_path)
    if "import gymnasium" in text(page):
        pytest.importorskip("gymnasium", reason="needs: pip install 'geomech[gym]'")
    for name, code in re.findall(r"(?ms)^```\w+ ([\w.-]+)\n(.*?)^```$", text(page)):
        (tmp_path / name).write_text(code)
    for code in blocks(page, "python"):
        # A custom law is of no module, whose compiled code an earlier run could keep.
        how = "numpy" if "@formula" in code else backend.preferred()
        with backend.preferring(how):
            exec(code, {"__name__": "page"})
    if page == README:
        (said,) = blocks(page)
        out = capsys.readouterr().out
        assert re.sub(NUMBER, "#", out) == re.sub(NUMBER, "#", said)
        numbers = [[float(x) for x in re.findall(NUMBER, y)] for y in (out, said)]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-4)


@pytest.fixture(scope="module")
def cells():
    """The module of the site's build that turns pages into notebooks."""
    pytest.importorskip("nbformat", reason="of the extra docs")
    spec = importlib.util.spec_from_file_location("cells", SITE / "made" / "cells.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


OFFERED = {page.relative_to(ROOT).as_posix(): page for page in PAGES
           if SITE in page.parents and blocks(page, "python")
           and "file_format: mystnb" not in text(page)}  # fmt: skip


@pytest.mark.parametrize("page", OFFERED.values(), ids=OFFERED)
def test_the_notebook_of_a_page_has_its_files_commands_and_python(cells, page):
    notebook = cells.from_page(text(page))
    found = [x.source for x in notebook.cells if x.cell_type == "code"]
    assert [x for x in found if x[0] not in "%!"] == [
        code.strip() for code in blocks(page, "python")
    ]
    named = re.findall(r"(?m)^```\w+ ([\w.-]+)$", text(page))
    assert [x.split()[1] for x in found if x.startswith("%%writefile")] == named
    typed = "\n".join(blocks(page, "console")).replace("$ ", "!")
    assert "\n".join(x for x in found if x.startswith("!")).split() == typed.split()


@pytest.mark.parametrize("page", OFFERED.values(), ids=OFFERED)
def test_the_notebook_of_a_page_has_no_links_into_the_site(cells, page):
    notebook = cells.from_page(text(page))
    prose = "\n".join(x.source for x in notebook.cells if x.cell_type == "markdown")
    assert prose.startswith("# ")
    assert not re.search(r"\]\((?![a-z]+:)|^:::|^```\{|\{\w+\}`", prose, re.M)
