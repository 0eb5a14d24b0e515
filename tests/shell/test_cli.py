"""The command line as a user meets it: in the tests' own process, and a few commands in
processes of their own."""

import contextlib
import os
import shutil
import subprocess
import sys
import threading

import frozen
import numpy as np
import pytest
from commands import as_process, geomech
from scipy.io import netcdf_file

from geomech import scenes
from geomech.mathematics.gaits import Circle
from geomech.studies.report import (
    reachable_amplitudes,
    round_amplitudes,
)

VELOCITY = ["velocity", "three-link-viscous", "--alpha", "0,0", "--alphadot", "-1,0"]


@pytest.mark.parametrize("args", [[*VELOCITY, "--json"], ["fly"]])
def test_a_process_says_what_the_tests_see(args):
    assert as_process(*args) == geomech(*args)


PLAIN = '[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n'
BAD = [  # what frozen refusals cannot hold: files of other kinds, and what is long
    (
        ["connection", "three-link-glass", "-o", "pipe.nc"],
        "cannot write pipe.nc: it is not an ordinary file",
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


def test_run_replaces_no_scene_that_it_did_not_leave(tmp_path):
    mine = scenes.load("three-link-glass").text
    (tmp_path / "scene.toml").write_text(mine)
    for name in ("three-link-viscous", "scene.toml"):
        code, _, _ = geomech("run", name, "-o", ".", cwd=tmp_path)
        assert code == 2
    assert (tmp_path / "scene.toml").read_text() == mine


@pytest.mark.parametrize("link", [os.link, os.symlink])
@pytest.mark.parametrize(
    "command",
    [
        "sweep bends.toml --over gait.amplitude=0.5 -o out.nc",
        "connection bends.toml --grid 9 -o out.nc",
        "displacement bends.toml --amplitudes 0.1 --plot out.svg",
    ],
)
@pytest.mark.parametrize("name", ["bends.toml", "bends.csv"])
def test_no_input_is_written_over(command, link, name, tmp_path):
    """Neither a scene nor its measurements, by another name."""
    shutil.copytree(frozen.FOLDER, tmp_path, dirs_exist_ok=True)
    text = (tmp_path / name).read_text()
    out = command.split()[-1]
    link(tmp_path / name, tmp_path / out)
    code, _, err = geomech(*command.split(), cwd=tmp_path)
    assert code == 2
    assert f"cannot write {out}: it is one of the inputs" in err
    assert (tmp_path / name).read_text() == text


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
@pytest.mark.parametrize(
    "ask",
    [
        "sweep NAME --over gait.amplitude=0.5,1 -o NAME.nc --plot NAME.png",
        "connection NAME --grid 9 -o NAME.nc",
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

    writer = threading.Thread(target=bring)
    writer.start()
    try:
        yield f"/dev/fd/{read}"
    finally:
        os.close(read)
        writer.join()


@pytest.mark.parametrize(
    ("content", "endless", "said"),
    [
        (b"y\n" * 5000, True, "cannot read scene '{}': it is larger than 10 MB"),
        (b"", False, "cannot read scene '{}': the pipe delivered no data"),
        (b"[medium\n", False, "pipe is not TOML"),
    ],
)
def test_neither_is_a_pipe_that_brings_none(content, endless, said):
    with pipe(content, endless) as name:
        code, out, err = geomech("explain", name)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"error: {said.format(name)}")


def test_a_scene_comes_through_a_pipe_once():
    """Its files are looked for from the current folder."""
    text = (frozen.FOLDER / "table.toml").read_bytes()
    with pipe(text) as name:
        code, out, err = geomech("explain", name, cwd=frozen.FOLDER)
    assert (code, err) == (0, "") and "pipe: table (" in " ".join(out.split())


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
    gait = Circle(amplitude=amplitude, centre=centre)
    scene = scenes.load("three-link-glass").with_numerics(extent=2.0).changed(gait=gait)
    expected = np.sign(amplitude) * np.array(round_amplitudes(1.2))
    assert reachable_amplitudes(scene, gait) == pytest.approx(expected)
