"""Text that others wrote, in files and their names, steers no terminal and no page: it
is shown with escapes."""

import json
import shutil
import sys

import commands
import frozen
import pytest
from scipy.io import netcdf_file

from geomech import scenes
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


def test_what_is_not_seen_is_an_escape():
    plain = "a b\n\tc Zürich, 東京, ± \N{GREEK SMALL LETTER ALPHA}\xa0\\x1b"
    assert errors.printable(plain) == plain
    raw = "a\x1b[1mb\x07\x00\x7f\x9b\u202e\udce9\r"
    assert errors.printable(raw) == r"a\x1b[1mb\x07\x00\x7f\x9b\u202e\udce9\r"
    assert errors.line(" a\n\x1bb  c\n") == r"a \x1bb c"
    assert len(errors.line(LONG)) < 400


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A folder with a.nc of a small table, and a scene of it."""
    folder = tmp_path_factory.mktemp("tables")
    tables = SceneTables(scenes.load("three-link-viscous").with_numerics(grid=7))
    fields.save_connection(folder / "a.nc", tables)
    (folder / "a.toml").write_text(table("a.nc"))
    with netcdf_file(folder / "a.nc", "a", mmap=False) as file:
        for name in ("frame", "title", "scene", "length_note"):
            setattr(file, name, LONG.encode())
        file.variables["alpha_1"].long_name = ("shape variable " + ESC).encode()
    return folder


@pytest.mark.parametrize("ask", ["explain a.toml", "displacement a.toml"])
def test_attributes_of_a_table_are_cut_and_escaped(ask, stored):
    code, out, err = commands.geomech(*ask.split(), cwd=stored)
    assert code == 0
    shown(out, err)


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
    "ask", ["fit-gait a.csv", "fit-medium a.csv", "explain s.toml"]
)
def test_words_in_other_files_are_escaped(ask, geomech, tmp_path):
    (tmp_path / "a.csv").write_text(f"{LONG},speed\n1,2\n")
    text = (frozen.FOLDER / "cart.xml").read_text()
    (tmp_path / "cart.xml").write_text(text.replace('name="fl"', f'name="{ESC}"'))
    shutil.copy(frozen.FOLDER / "cart.toml", "s.toml")
    code, out, err = geomech(*ask.split())
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
    pages = notebook.page(ESC, [(ESC,)]), notebook.study(study)
    assert not any("<b>" in page for page in pages)
    shown(*pages, repr(study), repr(study.scene), description(study.scene))
