"""Text that others wrote, in files and their names, steers no terminal and no page: it
is shown with escapes."""

import json
import re
import shutil
import struct
import sys

import commands
import frozen
import pytest
import rich.progress
from scipy.io import netcdf_file

from geomech import scenes
from geomech.io import files, tables
from geomech.io.tables.mat import ABOUT
from geomech.run import progress
from geomech.shell import notebook
from geomech.shell.describe.scene import description
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.core import refusal as errors

# sets a title, rings, clears, in red, backwards, over what stood there
ESC = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e\r"
# in a string of TOML, which holds none as it is
TOML = "\\u001b]0;owned\\u0007\\u001b[2J\\u009b31m\\u202e\\r"
LONG = ESC + 1_000_000 * "x"
SWIM = scenes.load("three-link-viscous").text


def table(file):
    return f'[system]\nkind = "table"\nfile = "{file}"\n\n[gait]\nkind = "circle"\namplitude = 0.5\n'


def shown(*texts):
    """Assert that texts are nothing but lines of what is seen, and no megabyte."""
    for text in texts:
        assert set(text) - {"\n"} == {c for c in text if c.isprintable()}
        assert len(text) < 10_000


@pytest.mark.parametrize(
    "text",
    ["", "a b\n\tc", "Zürich, 東京, ± \N{GREEK SMALL LETTER ALPHA}", "a\xa0b", "\\x1b"],
)
def test_plain_text_stays_what_it_is(text):
    assert errors.printable(text) == text


def test_what_is_not_seen_is_an_escape():
    raw = "a\x1b[1mb\x07\x00\x7f\x9b\u202e\udce9\r"
    assert errors.printable(raw) == r"a\x1b[1mb\x07\x00\x7f\x9b\u202e\udce9\r"
    assert errors.line(" a\n\x1bb  c\n") == r"a \x1bb c"


def test_a_line_is_cut_where_it_is_long():
    assert errors.line("x" * 400) == "x" * 400
    assert len(errors.line(LONG)) < 400
    assert errors.line(LONG).startswith(r"\x1b]0;owned\x07")


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A folder with a.nc and a.mat of a small table, and a scene of each."""
    folder = tmp_path_factory.mktemp("tables")
    tables = SceneTables(scenes.load("three-link-viscous").with_numerics(grid=7))
    for name in ("a.nc", "a.mat"):
        fields.save_connection(folder / name, tables)
        (folder / f"{name}.toml").write_text(table(name))
    with netcdf_file(folder / "a.nc", "a", mmap=False) as file:
        for name in ("frame", "title", "scene", "length_note"):
            setattr(file, name, LONG.encode())
        file.variables["alpha_1"].long_name = ("shape variable " + ESC).encode()
    facts = {"frame": LONG, "shapes": [ESC, "b"], "sign": "+", "unit": "BL"}
    about = text_variable(ABOUT, json.dumps({**facts, "length": 1.0}))
    with (folder / "a.mat").open("ab") as file:
        file.write(about)
    return folder


@pytest.mark.parametrize("name", ["a.nc", "a.mat"])
def test_attributes_of_a_table_are_cut_and_escaped(name, stored):
    held = tables.load(stored / name)
    assert held.frame.startswith(r"\x1b]0;owned\x07") and len(held.frame) == 60
    assert held.shapes[0] == "alpha_1"
    explained = commands.geomech("explain", f"{name}.toml", cwd=stored)
    ask = ["displacement", f"{name}.toml", "--amplitudes", "0.5"]
    moved = commands.geomech(*ask, cwd=stored)
    assert explained[0] == moved[0] == 0
    shown(*explained[1:], *moved[1:])


def text_variable(name, text):
    """Return a line of text as MATLAB's version 5 has it, in UTF-8."""

    def element(kind, data):
        padding = b"\0" * (-len(data) % 8)
        return struct.pack("<II", kind, len(data)) + data + padding

    raw = text.encode()
    flags = element(6, struct.pack("<II", 4, 0))
    shape = element(5, struct.pack("<ii", 1, len(raw)))
    return element(14, flags + shape + element(1, name.encode()) + element(16, raw))


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere no file may be called so"
)
@pytest.mark.parametrize(
    ("ask", "ends"),
    [
        (("explain", "NAME"), 0),
        (("displacement", "NAME", "--amplitudes", "0.5"), 0),
        (("sweep", "NAME", "--over", "gait.amplitude=0.5,1", "-o", f"{ESC}.nc"), 0),
        (("explain", f"{ESC}-none.toml"), 2),
        (("displacement", "NAME", "--amplitudes", ESC), 2),
        (("explain", "bad-NAME"), 2),
    ],
)
def test_names_of_scene_files_are_escaped(ask, ends, geomech, tmp_path):
    name = f"{ESC}[red].toml"
    (tmp_path / name).write_text(SWIM)
    (tmp_path / f"bad-{name}").write_text(SWIM + "[x]\n")
    code, out, err = geomech(*(word.replace("NAME", name) for word in ask))
    assert code == ends, err
    shown(out, err)
    assert r"\x1b]0;owned\x07" in out + err


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere no file may be called so"
)
@pytest.mark.parametrize(
    "command",
    [
        ("explain",),
        ("displacement", "--amplitudes", "0.5"),
        ("connection", "--grid", "7"),
        ("ccf", "--grid", "7"),
        ("forces",),
        ("sweep", "--over", "gait.amplitude=0.5,1", "-o", "a\nb.nc"),
        ("lab", "-o", "a\nb.html"),
    ],
)
def test_names_of_files_stay_within_their_line(command, geomech, tmp_path):
    (tmp_path / "three\nb\tc.toml").write_text(SWIM)
    first, *rest = command
    code, out, err = geomech(first, "three\nb\tc.toml", *rest)
    assert code == 0, err
    assert not [x for x in out.splitlines() if x.startswith("b.") or "b\tc" in x]


def test_bars(monkeypatch):
    """Nor does a name that looks like rich's own marks of colours, or the end of one
    that was never opened, stop a bar."""
    bars = []

    class Bars(rich.progress.Progress):
        def add_task(self, title, **more):
            bars.append(self)
            return super().add_task(title, **more)

    monkeypatch.setattr(rich.progress, "Progress", Bars)
    with progress._show_on_terminal(progress.Computation(f"{ESC} [red]a[/b].toml")):
        (task,) = bars[0].tasks
        (row,) = (bars[0].columns[0].render(task),)
    assert row.plain == errors.printable(ESC) + " [red]a[/b].toml"
    assert str(progress.Computation(ESC)).startswith(errors.printable(ESC))


@pytest.mark.parametrize(
    "text",
    [
        SWIM + f'["{TOML}"]\na = 1\n',
        SWIM.replace("[gait]", f'[gait]\n"{TOML}" = 1'),
        SWIM.replace("[gait]", f'[gait]\nkind = "{TOML}"\n[x]'),
        SWIM + f'[numerics]\nframe = "{TOML}"\n',
        SWIM + f'[numerics]\n"{TOML}{"x" * 100_000}" = 1\n',
        table(TOML + ".nc"),
        table(TOML),
        SWIM.replace("[gait]", f"[gait]\n{ESC}"),
    ],
    ids=range(8),
)
def test_keys_and_strings_of_a_scene_are_escaped(text, geomech, tmp_path):
    (tmp_path / "s.toml").write_text(text)
    code, out, err = geomech("explain", "s.toml")
    assert (code, out, err.count("\n")) == (2, "", 1)
    shown(err)


@pytest.mark.parametrize(
    "ask",
    [
        "fit-gait a.csv -o a.nc",
        "fit-medium a.csv",
        "explain three-link-viscous --medium a.csv",
    ],
)
def test_words_in_headers_of_csv_files_are_escaped(ask, geomech, tmp_path):
    (tmp_path / "a.csv").write_text(f"{LONG},speed\n1,2\n")
    code, out, err = geomech(*ask.split())
    assert (code, out) == (2, "")
    shown(err)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<geom name="fl"', f'<geom name="{ESC}"'),
        ('name="trunk" type="box"', f'type="{ESC}"'),
    ],
    ids=["name", "type"],
)
def test_names_in_an_mjcf_are_escaped(old, new, geomech, tmp_path):
    pytest.importorskip("mujoco")
    text = (frozen.FOLDER / "cart.xml").read_text()
    (tmp_path / "cart.xml").write_text(text.replace(old, new))
    shutil.copy(frozen.FOLDER / "cart.toml", "s.toml")
    code, out, err = geomech("explain", "s.toml")
    assert (code, out) == (2, "")
    shown(err)


def test_what_is_kept_of_a_request_is_escaped(geomech, tmp_path):
    kept = {"question": {ESC: ESC}, "settled": ESC, "checksum": ESC}
    (tmp_path / f".{ESC}.nc.partial").write_text(json.dumps(kept) + "\n")
    over = ["--over", "gait.amplitude=0.5,1", "-o", f"{ESC}.nc"]
    code, out, err = geomech("sweep", "three-link-viscous", *over)
    assert code == 0
    shown(out, err)


def test_pages_of_a_notebook_are_escaped():
    scene = scenes.load("three-link-viscous").with_numerics(grid=7)
    study = SceneTables(scene.changed(name=f"<b>{ESC}"))
    found = study.displacements([0.5], ["direct"])
    html = re.sub(r'src="data:[^"]+"', "", found._repr_html_())
    pages = notebook.page(ESC, [(ESC,)]), notebook.study(study), html
    assert not any("<b>" in page for page in pages)
    shown(*pages, repr(study), repr(study.scene), repr(found), description(study.scene))


def test_notes_are_escaped(capsys):
    files.note(f"a\n{ESC} b")
    assert capsys.readouterr() == ("", f"note: a {errors.line(ESC)} b\n")


def test_a_message_is_no_longer_than_may_be_read(geomech, monkeypatch):
    """Whatever raises it."""

    def fails(*_, **__):
        raise ValueError(LONG)

    monkeypatch.setattr(SceneTables, "displacements", fails)
    ask = ["displacement", "three-link-viscous", "--amplitudes", "0.5"]
    code, out, err = geomech(*ask)
    assert (code, out, err.count("\n")) == (2, "", 1)
    shown(err)
    assert len(err) < 3000
