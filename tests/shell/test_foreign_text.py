"""Text that others wrote, in files and their names, steers no terminal and no page: it is shown with escapes."""

import json
import re
import struct
import sys

import pytest
import rich.progress
from scipy.io import netcdf_file
from test_mjcf import CART
from test_mjcf import SCENE as WALKER

import geomech as package
from geomech import scenes
from geomech.io import files, tables
from geomech.io.tables.mat import ABOUT
from geomech.run import progress
from geomech.scenes import Numerics, Scene
from geomech.shell import notebook
from geomech.shell.describe.scene import description
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.core import refusal as errors

ESC = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e\r"  # sets a title, rings, clears, in red, backwards, over what stood there
TOML = "\\u001b]0;owned\\u0007\\u001b[2J\\u009b31m\\u202e\\r"  # in a string of TOML, which holds none as it is
LONG = ESC + 1_000_000 * "x"
SWIM = scenes.load("three-link-viscous").text


def shown(*texts):
    """Whether all that was said may be: nothing but lines of what is seen, and not a megabyte of them."""
    for text in texts:
        assert set(text) - {"\n"} == {c for c in text if c.isprintable()}
        assert len(text) < 10_000


def test_plain_text_stays_what_it_is():
    for text in (
        "",
        "a b\n\tc",
        "Zürich, 東京, 0.3 ± 0.1 \N{GREEK SMALL LETTER ALPHA}",
        "no\N{NO-BREAK SPACE}break",
        "\\x1b",
    ):
        assert errors.printable(text) == text
    assert (
        errors.printable("a\x1b[1mb\x07\x00\x7f\x9b\u202e\udce9\r")
        == r"a\x1b[1mb\x07\x00\x7f\x9b\u202e\udce9\r"
    )
    assert errors.line(" a\n\x1bb  c\n") == r"a \x1bb c"
    assert errors.line("x" * 400) == "x" * 400
    assert len(errors.line(LONG)) < 400 and errors.line(LONG).startswith(
        r"\x1b]0;owned\x07"
    )


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A folder with a.nc and a.mat of a small table."""
    folder = tmp_path_factory.mktemp("tables")
    bench = SceneTables(scenes.load("three-link-viscous").with_numerics(grid=7))
    fields.save_connection(folder / "a.nc", bench)
    fields.save_connection(folder / "a.mat", bench)
    return folder


def table(file):
    return f'[system]\nkind = "table"\nfile = "{file}"\n\n[gait]\nkind = "circle"\namplitude = 0.5\n'


@pytest.mark.parametrize("kind", ["nc", "mat"])
def test_attributes_of_a_table(kind, stored, geomech, tmp_path):
    (tmp_path / "a.nc").write_bytes((stored / "a.nc").read_bytes())
    if kind == "nc":
        with netcdf_file(tmp_path / "a.nc", "a", mmap=False) as file:
            for name in ("frame", "title", "scene", "length_note"):
                setattr(file, name, LONG.encode())
            file.variables["alpha_1"].long_name = ("shape variable " + ESC).encode()
    else:
        about = json.dumps(
            {
                "frame": LONG,
                "shapes": [ESC, "b"],
                "sign": "+",
                "unit": "BL",
                "length": 1.0,
            }
        )
        (tmp_path / "a.mat").write_bytes(
            (stored / "a.mat").read_bytes() + text_variable(ABOUT, about)
        )
    held = tables.load(tmp_path / f"a.{kind}")
    assert held.frame.startswith(r"\x1b]0;owned\x07") and len(held.frame) == 60
    assert held.shapes[0] == "alpha_1"
    (tmp_path / "s.toml").write_text(table(f"a.{kind}"))
    for command in (
        ("explain", "s.toml"),
        ("displacement", "s.toml", "--amplitudes", "0.5"),
    ):
        code, out, err = geomech(*command)
        assert code == 0
        shown(out, err)
    shown(description(scenes.load(tmp_path / "s.toml")))


def text_variable(name, text):
    """A line of text as MATLAB's version 5 has it, in UTF-8."""
    element = lambda kind, data: (
        struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)
    )
    raw = text.encode()
    parts = element(6, struct.pack("<II", 4, 0)) + element(
        5, struct.pack("<ii", 1, len(raw))
    )
    parts += element(1, name.encode()) + element(16, raw)
    return element(14, parts)


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere no file may be called so"
)
def test_names_of_scene_files(geomech, tmp_path):
    file = f"{ESC}[red].toml"
    (tmp_path / file).write_text(SWIM)
    (tmp_path / f"{ESC}-bad.toml").write_text(SWIM + "[x]\n")
    for *command, ends in (
        ("explain", file, 0),
        ("displacement", file, "--amplitudes", "0.5", 0),
        ("sweep", file, "--over", "gait.amplitude=0.5,1", "-o", f"{ESC}.nc", 0),
        ("connection", file, "--grid", "7", "-o", f"{ESC}.nc", 0),
        ("explain", f"{ESC}-bad.toml", 2),
        ("explain", f"{ESC}-none.toml", 2),
        ("displacement", file, "--amplitudes", ESC, 2),
    ):
        code, out, err = geomech(*command)
        assert code == ends, err
        shown(out, err)
        assert (
            command[0] == "connection" or r"\x1b]0;owned\x07" in out + err
        )  # which says nothing
    with pytest.raises(errors.Refusal) as error:
        scenes.load(tmp_path / f"{ESC}-bad.toml")
    shown(str(error.value))
    assert str(error.value).count("-bad.toml") == 1  # named once


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
    name = "three\nb\tc.toml"
    (tmp_path / name).write_text(SWIM)
    first, *rest = command
    code, out, err = geomech(first, name, *rest)
    assert code == 0, err
    lines = out.splitlines()
    assert not [line for line in lines if line.startswith("b.") or "b\tc" in line]


def test_keys_and_strings_of_a_scene(geomech, tmp_path):
    for text in (
        SWIM + f'["{TOML}"]\na = 1\n',
        SWIM.replace("[gait]", f'[gait]\n"{TOML}" = 1'),
        SWIM.replace("[gait]", f'[gait]\nkind = "{TOML}"\n[x]'),
        SWIM + f'[numerics]\nframe = "{TOML}"\n',
        SWIM + f'[numerics]\n"{TOML}{"x" * 100_000}" = 1\n',
        table(TOML + ".nc"),
        table(TOML),
        SWIM.replace("[gait]", f"[gait]\n{ESC}"),
    ):
        (tmp_path / "s.toml").write_text(text)
        code, out, err = geomech("explain", "s.toml")
        assert (code, out, err.count("\n")) == (2, "", 1)
        shown(err)


def test_words_in_headers_of_csv_files(geomech, tmp_path):
    (tmp_path / "a.csv").write_text(f"{LONG},speed\n1,2\n")
    (tmp_path / "s.toml").write_text(SWIM)
    for command in (
        ("fit-gait", "a.csv", "-o", "a.nc"),
        ("fit-medium", "a.csv"),
        ("explain", "s.toml", "--medium", "a.csv"),
    ):
        code, out, err = geomech(*command)
        assert (code, out) == (2, "")
        shown(err)


def test_names_in_an_mjcf(geomech, tmp_path):
    pytest.importorskip("mujoco")
    (tmp_path / "parts").mkdir()
    (tmp_path / "s.toml").write_text(WALKER)
    for text in (
        CART.replace('name="fl"', f'name="{ESC}"'),
        CART.replace('name="trunk" type="box"', f'type="{ESC}"'),
    ):
        assert text != CART
        (tmp_path / "parts" / "cart.xml").write_text(text)
        code, out, err = geomech("explain", "s.toml")
        assert (code, out) == (2, "")
        shown(err)


def test_what_is_kept_of_a_request(geomech, tmp_path):
    (tmp_path / "s.toml").write_text(SWIM)
    sweeping = "sweep", "s.toml", "--over", "gait.amplitude=0.5,1", "-o", f"{ESC}.nc"
    (tmp_path / f".{ESC}.nc.partial").write_text(
        json.dumps({"question": {ESC: ESC}, "settled": ESC, "checksum": ESC}) + "\n"
    )
    code, out, err = geomech(*sweeping)
    assert code == 0
    shown(out, err)


def test_pages_of_a_notebook():
    scene = scenes.load("three-link-viscous")
    made = SceneTables(
        Scene(scene.system, scene.gait, Numerics(grid=7), name=f"<b>{ESC}")
    )
    found = made.displacements([0.5], ["direct"])
    swept = package.sweep(made.scene, {"gait.amplitude": [0.5, 1.0]})
    for page in (
        notebook.page(ESC, [(ESC,)]),
        notebook.study(made),
        re.sub(r'src="data:[^"]+"', "", found._repr_html_()),
    ):
        assert "&lt;b&gt;" in page or "<b>" not in page
        shown(page)
    for text in (
        repr(made.scene),
        repr(made),
        repr(found),
        repr(swept),
        description(made.scene),
    ):
        shown(text)


def test_notes(capsys):
    files.note(f"a\n{ESC} b")
    assert capsys.readouterr() == ("", f"note: a {errors.line(ESC)} b\n")


def test_bars(monkeypatch):
    """Nor does a name that looks like rich's own marks of colours, or the end of one that was never opened, stop a bar."""
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


def test_messages_are_no_longer_than_may_be_read(geomech, tmp_path, monkeypatch):
    """Whatever raises them."""

    def fails(*_, **__):
        raise ValueError(LONG)

    monkeypatch.setattr(SceneTables, "displacements", fails)
    code, out, err = geomech(
        "displacement", "three-link-viscous", "--amplitudes", "0.5"
    )
    assert (code, out, err.count("\n")) == (2, "", 1)
    shown(err)
    assert len(err) < 3000
