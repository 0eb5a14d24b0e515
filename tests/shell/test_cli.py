"""The command line as a user meets it: in the tests' own process, and a few commands in
processes of their own."""

import contextlib
import itertools
import math
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from commands import as_process, geomech
from scipy.io import netcdf_file
from tabled import tabled, tabled_json

from geomech import plots, scenes
from geomech.mathematics.gaits import Butterfly, Circle, Ellipse
from geomech.results.files import load
from geomech.studies.report import (
    compared_gaits,
    gait_tables,
    reachable_amplitudes,
    round_amplitudes,
)
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

VELOCITY = ["velocity", "three-link-viscous", "--alpha", "0,0", "--alphadot", "-1,0"]


@pytest.mark.parametrize("args", [[*VELOCITY, "--json"], ["fly"]])
def test_a_process_says_what_the_tests_see(args):
    assert as_process(*args) == geomech(*args)


def test_displacement_to_a_tolerance():
    amplitudes = ["displacement", "three-link-glass", "--amplitudes", "0.5,1.0"]
    code, out, err = geomech(*amplitudes, "--tol", "1e-3", "--json")
    assert (code, err) == (0, "")
    answer = tabled_json(out)
    assert max(answer["estimate"][answer["tier"]]) <= 1e-3
    # It has the form of an answer without a tolerance.
    plain = tabled_json(geomech(*amplitudes, "--tiers", "direct", "--json")[1])
    assert set(answer) - set(plain) == {"tier", "tolerance", "settings"}
    assert set(plain) <= set(answer)


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are not drawn, which takes half a second each: data/commands.txt has
    those of these commands."""

    def touch(figure, *paths):
        for path in paths:
            path.touch()

    monkeypatch.setattr(plots, "save", touch)


def test_run_leaves_everything(undrawn, tmp_path):
    text = scenes.load("three-link-glass").text + "\n[numerics]\ngrid = 9\n"
    (tmp_path / "s.toml").write_text(text)
    code, out, err = geomech("run", "s.toml", "-o", "deep/dir", cwd=tmp_path)
    assert (code, err) == (0, "")
    folder = tmp_path / "deep" / "dir"
    assert {p.name for p in folder.iterdir()} == {
        "scene.toml", "connection.nc", "displacement.json",
        *(f"{stem}.{end}" for stem in ("connection", "ccf", "displacement") for end in ("png", "pdf")),
    }  # fmt: skip
    assert (folder / "scene.toml").read_text() == text
    tables = gait_tables(load(folder / "displacement.json"))
    gaits = {"circle": "three-link-glass", "butterfly": "butterfly-glass"}
    assert set(tables) == set(gaits)
    for gait, result in tables.items():
        table = tabled(result)
        amplitudes = np.array(table["amplitude"])
        study = SceneTables(scenes.parse(text))
        expected = study.poses("direct", scenes.load(gaits[gait]).gait, amplitudes)
        np.testing.assert_allclose(table["direct"], expected, atol=1e-9)
        assert f"{expected[-1, 0]:.9f}"[:6] in out
        assert ("note" in result.attributes) == (gait == "butterfly")


PLAIN = '[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n'
BAD = [  # what frozen refusals cannot hold: files of other kinds, and what is long
    (
        ["connection", "three-link-glass", "-o", "pipe.nc"],
        "cannot write pipe.nc: it is no ordinary file",
    ),
    (["run", "broken.toml"], "broken.toml is not TOML"),
    (["run", "-o", "broken.toml"], "cannot write the folder broken.toml"),
    (["explain", "a" * 5000], "scene"),
    (
        ["displacement", "deep.toml", "--amplitudes", "1", "--grid", "9" * 5000],
        "--grid",
    ),
    (["explain", "deep.toml"], "deep.toml is not TOML"),
    (["explain", "digits.toml"], "digits.toml is not TOML"),
    (["explain", "key.toml"], "key.toml: [gait]"),
    *(
        (["explain", name], f"cannot read scene '{name}': ")
        for name in ("/dev/zero", ".", "pipe.nc", "large.toml", "latin.toml")
    ),
]


@pytest.mark.parametrize(
    ("args", "said"), BAD, ids=[" ".join(args)[:40] for args, _ in BAD]
)
def test_bad_input_gets_one_line_and_exit_code_2(args, said, tmp_path):
    (tmp_path / "broken.toml").write_text("[medium\n")
    (tmp_path / "deep.toml").write_text(PLAIN + "amplitude = " + "[" * 2000)
    (tmp_path / "digits.toml").write_text(PLAIN + "[numerics]\nphases = " + "9" * 5000)
    (tmp_path / "key.toml").write_text(PLAIN + "x" * 5000 + " = 1")
    (tmp_path / "latin.toml").write_bytes(b"# \xe9")
    os.mkfifo(tmp_path / "pipe.nc")
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(1 << 40)
    before = sorted(tmp_path.iterdir())
    code, out, err = geomech(*args, cwd=tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: ") and said in err
    assert len(err) < 600
    assert sorted(tmp_path.iterdir()) == before


def test_letters_of_any_alphabet_are_kept(tmp_path):
    text = scenes.load("three-link-viscous").text + "# schön ☃\n"
    (tmp_path / "schön.toml").write_text(text, encoding="utf-8")
    assert geomech("connection", "schön.toml", "-o", "ö.nc", cwd=tmp_path)[0] == 0
    with netcdf_file(tmp_path / "ö.nc", mmap=False) as data:
        assert data.scene_toml.decode() == text


BACKBONE = '[medium]\nname = "coulomb"\n[body]\nkind = "backbone"\nelements = 8\n[gait]\nkind = "sine"\nelements = 8\n'


def test_run_says_what_it_replaces(undrawn, tmp_path):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "mine.txt").write_text("mine")
    assert geomech("run", "three-link-ideal-fluid", cwd=tmp_path)[::2] == (0, "")
    code, _, err = geomech("run", "three-link-viscous", cwd=tmp_path)
    assert code == 0 and err.startswith("note: replaced in results: ")
    text = scenes.load("three-link-viscous").text
    assert (tmp_path / "results" / "scene.toml").read_text() == text
    assert (tmp_path / "results" / "mine.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("three-link-viscous", "another scene stands there"),
        ("scene.toml", "it is an input"),
    ],
)
def test_run_replaces_no_scene_that_it_did_not_leave(name, said, tmp_path):
    mine = scenes.load("three-link-glass").text
    (tmp_path / "scene.toml").write_text(mine)
    code, _, err = geomech("run", name, "-o", ".", cwd=tmp_path)
    assert code == 2 and said in err
    assert (tmp_path / "scene.toml").read_text() == mine


def linked(how, source, target):
    if how == "itself":
        return source
    (target.hardlink_to if how == "hard link" else target.symlink_to)(source)
    return target


@pytest.mark.parametrize("how", ["itself", "hard link", "symlink"])
@pytest.mark.parametrize(
    "command", ["sweep in.nc --over gait.amplitude=0.5", "connection in.nc --grid 9"]
)
def test_a_scene_is_not_written_over(command, how, tmp_path):
    text = scenes.load("three-link-viscous").text
    (tmp_path / "in.nc").write_text(text)
    out = linked(how, tmp_path / "in.nc", tmp_path / "out.nc").name
    code, _, err = geomech(*command.split(), "-o", out, cwd=tmp_path)
    assert code == 2
    assert f"cannot write {out}: it is an input, in.nc" in err
    assert (tmp_path / "in.nc").read_text() == text


@pytest.mark.parametrize(
    "ask",
    [
        "sweep s.toml --over body.length=1,2 -o s.nc --plot swim.svg",
        "displacement s.toml --amplitudes 0.1 --plot swim.svg",
    ],
)
def test_neither_are_its_measurements(ask, tmp_path):
    rows = ["t,s,curvature"]
    for k, s in itertools.product(range(16), (0, 0.25, 0.5, 0.75, 1)):
        rows.append(f"{k / 16},{s},{2 * math.sin(2 * math.pi * (k / 16 + s))}")
    (tmp_path / "swim.svg").write_text("\n".join(rows))
    text = BACKBONE.replace('"sine"', '"centreline"\nfile = "swim.svg"')
    (tmp_path / "s.toml").write_text(text)
    code, _, err = geomech(*ask.split(), cwd=tmp_path)
    assert code == 2
    assert "cannot write swim.svg: it is an input" in err
    assert (tmp_path / "swim.svg").read_text() == "\n".join(rows)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
@pytest.mark.parametrize(
    "ask",
    [
        "sweep NAME --over gait.amplitude=0.5,1 -o NAME.nc --plot NAME.png",
        "connection NAME --grid 9 -o NAME.nc",
        "displacement NAME --amplitudes 0.5 --tiers direct --plot NAME.pdf",
        "explain NAME",
    ],
)
def test_names_that_are_not_text_are_kept(ask, tmp_path):
    name = os.fsdecode(b"caf\xe9.toml")
    (tmp_path / name).write_text(scenes.load("three-link-viscous").text)
    code, _, err = geomech(*ask.replace("NAME", name).split(), cwd=tmp_path)
    assert (code, err) == (0, "")
    for file in tmp_path.glob("*.nc"):
        with netcdf_file(file, mmap=False) as data:
            assert data.scene == rb"caf\udce9.toml"


@contextlib.contextmanager
def pipe(content, endless=False):
    """The name of a pipe that brings these bytes, once or for as long as it is read."""
    read, write = os.pipe()

    def bring():
        with (
            contextlib.suppress(BrokenPipeError),
            open(write, "wb", buffering=0) as file,
        ):
            file.write(content)
            while endless:
                file.write(content)

    (writer := threading.Thread(target=bring)).start()
    try:
        yield f"/dev/fd/{read}"
    finally:
        os.close(read)
        writer.join()


@pytest.mark.parametrize(
    ("content", "endless", "said"),
    [
        (b"y\n" * 5000, True, "cannot read scene '{}': it is larger than 10 MB"),
        (b"", False, "cannot read scene '{}': nothing came through this pipe"),
        (b"[medium\n", False, "pipe is not TOML"),
    ],
)
def test_neither_is_a_pipe_that_brings_none(content, endless, said):
    with pipe(content, endless) as name:
        code, out, err = geomech("explain", name)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"error: {said.format(name)}")


def test_a_scene_comes_through_a_pipe_once(tmp_path):
    """Also for commands that ask what it is first."""
    text = scenes.load("three-link-viscous").text.encode()
    with pipe(text) as name:
        ask = ["connection", name, "--grid", "5", "-o", "a.nc"]
        assert geomech(*ask, cwd=tmp_path)[::2] == (0, "")
    # Its files are looked for from the current folder.
    table = b'[system]\nkind = "table"\nfile = "a.nc"\n[gait]\nkind = "circle"\n'
    with pipe(table) as name:
        code, out, err = geomech("explain", name, cwd=tmp_path)
    assert (code, err) == (0, "") and "pipe: table (" in " ".join(out.split())


def test_a_scene_comes_through_the_standard_input(tmp_path):
    text = scenes.load("three-link-viscous").text
    options = ["--over", "gait.amplitude=0.5,1", "-o", "b.nc"]
    command = [sys.executable, "-m", "geomech", "sweep", "/dev/stdin", *options]
    done = subprocess.run(
        command, input=text, capture_output=True, cwd=tmp_path, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "2 points" in done.stdout


USED = [
    "velocity three-link-glass --alpha 0.5,0.3 --alphadot 1,0",
    "explain three-link-glass",
    "scenes",
    "displacement three-link-viscous --amplitudes 0.5 --tiers direct",
    "trajectory three-link-viscous -o t.csv",
    "sweep three-link-viscous --over gait.amplitude=0.5,1 -o s.nc",
]


HEAVY = [
    *("matplotlib", "scipy.interpolate", "scipy.optimize", "scipy.spatial", "sympy"),
    *("numba", "distributed", "concurrent.futures.process", "rich.progress"),
    *("rft.terradynamics.walking", "rft.terradynamics.meshes"),
    "geomech.scenes.terradynamics.walker",
]


LOADED = f"""
import os, sys
from geomech.shell import cli
os.environ["OPENBLAS_NUM_THREADS"] = "7"
for line in {USED}:
    try:
        cli.main(line.split())
    except SystemExit as left:
        assert left.code == 0, line
    found = [m for m in {HEAVY} if m in sys.modules]
    assert not found, (line, found)
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
"""


def test_commands_load_what_they_use_and_no_more(tmp_path):
    """Nothing that draws, splines or computes formulas, no walking, no cluster."""
    command = [sys.executable, "-c", LOADED]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("top", "step", "count"),
    [
        (1.0, 0.1, 10),
        (1.3, 0.1, 13),
        (1.5, 0.2, 7),
        (0.07, 0.005, 14),
        (25.0, 2.5, 10),
        (3.0, 0.25, 12),
        (9.0, 1.0, 9),
    ],
)
def test_amplitudes_of_a_report_are_round_and_about_ten(top, step, count):
    expected = step * np.arange(1, count + 1)
    assert round_amplitudes(top) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("centre", "amplitude"), [((0.4, -0.8), 0.7), ((0.8, -0.4), -0.7)]
)
def test_amplitudes_of_a_report_fill_the_field(centre, amplitude):
    """Up to the side that is nearest to the gait's centre, with the gait's sign."""
    gait = Circle(amplitude=amplitude, centre=centre, frequency=3.0)
    scene = scenes.load("three-link-glass").with_numerics(extent=2.0).changed(gait=gait)
    expected = np.sign(amplitude) * np.array(round_amplitudes(1.2))
    assert reachable_amplitudes(scene, gait) == pytest.approx(expected)
    own, other = compared_gaits(scene)
    assert own is gait
    assert (type(other), other.frequency) == (Butterfly, 3.0)


def test_amplitudes_of_a_report_end_with_the_gaits_own_where_shapes_are_singular():
    snake = scenes.load("no-slip-snake")
    gait = Circle(amplitude=-0.33, centre=snake.gait.centre)
    expected = [*(-np.array(round_amplitudes(0.33))), -0.33]
    assert reachable_amplitudes(snake, gait) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("scene", "gait", "said"),
    [
        ("three-link-glass", Circle(centre=(0.0, 3.0)), r"raise \[numerics\] extent"),
        ("no-slip-snake", Circle(amplitude=0.0), "does not move: give it a size"),
        ("no-slip-snake", Ellipse((0.0, 0.0)), "does not move: give it a size"),
    ],
)
def test_a_gait_without_amplitudes_has_no_report(scene, gait, said):
    with pytest.raises(Refusal, match=said):
        reachable_amplitudes(scenes.load(scene), gait)
