"""The command line as a user meets it: in the tests' own process, and a few commands in processes of their own."""

import contextlib
import math
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
import xarray
from commands import as_process, geomech
from tabled import of_json, tabled, tabled_json

from geomech import plots, scenes
from geomech.core.variables import Result
from geomech.io import files
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import curvature
from geomech.questions.swimmers import run
from geomech.results.files import load
from geomech.studies.report import (
    compared_gaits,
    gait_tables,
    reachable_amplitudes,
    round_amplitudes,
)
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

SMALL = ["--grid", "9"]


@pytest.mark.parametrize(
    "args",
    [
        [
            "velocity",
            "three-link-viscous",
            "--alpha",
            "0,0",
            "--alphadot",
            "-1,0",
            "--json",
        ],
        ["fly"],
    ],
)
def test_a_process_says_what_the_tests_see(args):
    assert as_process(*args) == geomech(*args)


def test_velocity_speaks_json():
    code, out, err = geomech(
        "velocity",
        "three-link-viscous",
        "--alpha",
        "0,0",
        "--alphadot",
        "-1,0",
        "--json",
    )
    assert (code, err) == (0, "")
    result = of_json(out)
    np.testing.assert_allclose(result["xi"], [0, 1 / 18, -7 / 27], atol=1e-14)
    assert str(result["status"].values) == "sliding"
    assert float(result["residual"]) < 1e-12


def test_connection_is_a_self_describing_file(tmp_path):
    file, plot = tmp_path / "a.nc", tmp_path / "a.svg"
    code, _, err = geomech(
        "connection",
        "three-link-glass",
        *SMALL,
        "--extent",
        "2.0",
        "-o",
        file,
        "--plot",
        plot,
    )
    assert (code, err) == (0, "")
    with xarray.open_dataset(file) as data:
        assert data.A.dims == ("component", "joint", "alpha_1", "alpha_2")
        assert (
            data.ccf.dims
            == data.fit_residual.dims
            == ("component", "alpha_1", "alpha_2")
        )
        assert data.component.values.tolist() == ["x", "y", "theta"]
        assert (data.alpha_1.values[[0, -1]] == [-2.0, 2.0]).all()
        assert all(
            "units" in data[v].attrs for v in ("A", "ccf", "fit_residual", "alpha_1")
        )
        again = SceneTables(
            scenes.parse(data.attrs["scene_toml"]).with_numerics(grid=9, extent=2.0)
        ).fitted
        np.testing.assert_array_equal(data.A, again.A)
        np.testing.assert_array_equal(data.fit_residual, again.residual)
        np.testing.assert_allclose(data.ccf, curvature.ccf(again).values, rtol=1e-13)
        assert np.abs(data.ccf).max() > 0.05
    assert plot.read_text().lstrip().startswith("<?xml")
    assert {p.name for p in tmp_path.iterdir()} == {"a.nc", "a.svg"}


def test_displacement_by_every_tier(tmp_path):
    plot = tmp_path / "d.png"
    code, out, err = geomech(
        "displacement",
        "three-link-glass",
        "--amplitudes",
        "0.5:1.0:2",
        *SMALL,
        "--json",
        "--plot",
        plot,
    )
    assert (code, err) == (0, "")
    table = tabled_json(out)
    assert table["amplitude"] == [0.5, 1.0]
    assert {m: np.shape(table[m]) for m in ("area", "path", "direct")} == dict.fromkeys(
        ("area", "path", "direct"), (2, 3)
    )
    assert math.hypot(*table["direct"][1][:2]) == pytest.approx(0.0638, rel=0.01)
    assert {m: len(e) for m, e in table["estimate_heading"].items()} == dict.fromkeys(
        table["estimate"], 2
    )
    assert plot.is_file()
    code, out, _ = geomech(
        "displacement", "three-link-glass", "--amplitudes", "3.0", "--tiers", "direct"
    )
    assert code == 0
    assert "direct" in out
    assert "area" not in out


def test_displacement_to_a_tolerance():
    code, out, err = geomech(
        "displacement",
        "three-link-glass",
        "--amplitudes",
        "0.5,1.0",
        "--tol",
        "1e-3",
        "--json",
    )
    assert (code, err) == (0, "")
    answer = tabled_json(out)
    assert max(answer["estimate"][answer["tier"]]) <= 1e-3
    assert {
        len(answer[key][answer["tier"]])
        for key in ("estimate", "estimate_heading", "net_distance")
    } == {2}
    plain = (
        "displacement",
        "three-link-glass",
        "--amplitudes",
        "0.5,1.0",
        "--tiers",
        "direct",
        "--json",
    )
    without = tabled_json(geomech(*plain)[1])  # of one form, with a tolerance or not
    assert set(answer) - set(without) == {"tier", "tolerance", "settings"}
    assert set(without) <= set(answer)
    code, out, _ = geomech(
        "displacement", "three-link-viscous", "--amplitudes", "1", "--tol", "1e-9"
    )
    assert code == 0
    assert "direct" in out


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are made and not drawn, which takes half a second each: data/commands.txt has those of these commands."""
    monkeypatch.setattr(
        plots, "save", lambda fig, *paths: [path.touch() for path in paths]
    )


def test_run_leaves_everything(undrawn, tmp_path):
    glass = scenes.parse(
        scenes.load("three-link-glass").text + "\n[numerics]\ngrid = 9\n"
    )
    (tmp_path / "s.toml").write_text(glass.text)
    code, out, err = geomech(
        "run", tmp_path / "s.toml", "-o", tmp_path / "deep" / "dir"
    )
    assert (code, err) == (0, "")
    files = {p.name for p in (tmp_path / "deep" / "dir").iterdir()}
    assert files == {
        "scene.toml", "connection.nc", "displacement.json",
        *(f"{stem}.{end}" for stem in ("connection", "ccf", "displacement") for end in ("png", "pdf")),
    }  # fmt: skip
    said = " ".join(out.split())
    assert "s.toml, circle: displacement per cycle, direct tier" in said
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["dir"]
    tables = gait_tables(load(tmp_path / "deep" / "dir" / "displacement.json"))
    assert set(tables) == {"circle", "butterfly"}
    for gait, result in tables.items():
        table = tabled(result)
        run = {"circle": glass.gait, "butterfly": scenes.load("butterfly-glass").gait}[
            gait
        ]
        wanted = SceneTables(glass).poses("direct", run, np.array(table["amplitude"]))
        np.testing.assert_allclose(table["direct"], wanted, atol=1e-9)
        assert f"{wanted[-1, 0]:.9f}"[:6] in out
        assert ("note" in result.attributes) == (gait == "butterfly")
    np.testing.assert_array_equal(
        tables["circle"]["amplitude"].values, 0.25 * np.arange(1, 11)
    )
    np.testing.assert_array_equal(
        tables["butterfly"]["amplitude"].values, [k / 10 for k in range(1, 14)]
    )
    told = "butterfly, direct tier, most exact of 4: not in the scene, added to compare"
    assert told in said
    assert "zero by symmetry" in out and "circle: not in" not in out
    assert (tmp_path / "deep" / "dir" / "scene.toml").read_text() == glass.text


def test_scenes_are_listed():
    code, out, _ = geomech("scenes")
    assert code == 0
    heads = [line.split()[0] for line in out.splitlines() if line[:1].strip()]
    assert {
        *scenes.builtin_names(),
        "c-leg",
        "xplorer",
        "glass-0.3mm-loose",
        "poppy-seeds-close",
    } <= {*heads}
    assert (
        geomech("scenes", "--show", "three-link-glass")[1]
        == scenes.load("three-link-glass").text
    )


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
]


@pytest.mark.parametrize(
    ("args", "said"), BAD, ids=[" ".join(args)[:40] for args, _ in BAD]
)
def test_bad_input_gets_one_line_and_exit_code_2(args, said, tmp_path):
    (tmp_path / "broken.toml").write_text("[medium\n")
    (tmp_path / "deep.toml").write_text(PLAIN + "amplitude = " + "[" * 2000)
    (tmp_path / "digits.toml").write_text(PLAIN + "[numerics]\nphases = " + "9" * 5000)
    (tmp_path / "key.toml").write_text(PLAIN + "x" * 5000 + " = 1")
    os.mkfifo(tmp_path / "pipe.nc")
    before = sorted(p.name for p in tmp_path.iterdir())
    code, out, err = geomech(*args, cwd=tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: ")
    assert said in err
    assert len(err) < 600
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_letters_of_any_alphabet_are_kept(tmp_path):
    text = scenes.load("three-link-viscous").text + "# schön ☃\n"
    (tmp_path / "schön.toml").write_text(text, encoding="utf-8")
    assert geomech("connection", "schön.toml", "-o", "ö.nc", cwd=tmp_path)[0] == 0
    with xarray.open_dataset(tmp_path / "ö.nc") as data:
        kept = data.attrs["scene_toml"]
    assert (kept.decode() if isinstance(kept, bytes) else kept) == text


def test_a_failure_half_way_leaves_nothing(undrawn, tmp_path, monkeypatch):
    from geomech import plots

    def fail(*args, **kwargs):
        raise ValueError("half way")

    monkeypatch.setattr(plots, "displacement_figure", fail)
    small = scenes.load("three-link-viscous").with_numerics(grid=5)
    result = run.Run(small).ask()
    with (
        pytest.raises(ValueError, match="half way"),
        files.atomic_folder(tmp_path / "out") as folder,
    ):
        run.Run.fill(result, folder)
    assert list(tmp_path.iterdir()) == []


def test_without_arguments_the_help():
    code, out, err = geomech()
    assert (code, err) == (0, "")
    assert out == geomech("--help")[1]
    assert "Analyse:" in out


BACKBONE = '[medium]\nname = "coulomb"\n[body]\nkind = "backbone"\nelements = 8\n[gait]\nkind = "sine"\nelements = 8\n'


@pytest.fixture
def quick(monkeypatch):
    """`run` without its numbers."""

    def fill(result, folder, **options):
        (folder / run.SCENE).write_text(result.question.scene.text)
        (folder / run.TABLES).write_text("{}")

    shown = "headline", "summary", "remarks"
    for name, value in zip(shown, ([], Result("run", ()), [])):
        monkeypatch.setattr(run.Run, name, staticmethod(lambda _, value=value: value))
    monkeypatch.setattr(run.Run, "fill", staticmethod(fill))
    monkeypatch.setattr(run.Run, "compute", lambda self, _: Result("run", ()))


def test_run_says_what_it_replaces(quick, tmp_path):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "mine.txt").write_text("mine")
    assert geomech("run", cwd=tmp_path)[::2] == (0, "")
    code, _, err = geomech("run", "three-link-viscous", cwd=tmp_path)
    assert (code, err) == (
        0,
        "note: replaced in results: displacement.json, scene.toml\n",
    )
    assert (tmp_path / "results" / "scene.toml").read_text() == scenes.load(
        "three-link-viscous"
    ).text
    assert (tmp_path / "results" / "mine.txt").read_text() == "mine"


def test_run_replaces_no_scene_that_it_did_not_leave(quick, tmp_path):
    mine = scenes.load("three-link-glass").text
    (tmp_path / "scene.toml").write_text(mine)
    for name, said in (
        ("three-link-viscous", "another scene stands there"),
        ("scene.toml", "it is an input"),
    ):
        code, _, err = geomech("run", name, "-o", ".", cwd=tmp_path)
        assert code == 2
        assert said in err
    assert (
        geomech("run", "three-link-glass", "-o", ".", cwd=tmp_path)[0] == 0
    )  # the same text
    assert (tmp_path / "scene.toml").read_text() == mine


def test_no_folder_is_not_this_folder(tmp_path):
    code, _, err = geomech("run", "-o", "", cwd=tmp_path)
    assert code == 2
    assert "an empty name" in err
    assert list(tmp_path.iterdir()) == []


def linked(how, source, target):
    if how == "itself":
        return source
    (target.hardlink_to if how == "hard link" else target.symlink_to)(source)
    return target


@pytest.mark.parametrize("how", ["itself", "hard link", "symlink"])
@pytest.mark.parametrize("command", ["sweep", "connection"])
def test_a_scene_is_not_written_over(command, how, tmp_path):
    text = scenes.load("three-link-viscous").text
    (tmp_path / "in.nc").write_text(text)
    out = linked(how, tmp_path / "in.nc", tmp_path / "out.nc")
    args = ["--over", "gait.amplitude=0.5"] if command == "sweep" else SMALL
    before = sorted(tmp_path.iterdir())
    code, _, err = geomech(command, "in.nc", *args, "-o", out.name, cwd=tmp_path)
    assert code == 2
    assert f"cannot write {out.name}: it is an input, in.nc" in err
    assert (tmp_path / "in.nc").read_text() == text
    assert sorted(tmp_path.iterdir()) == before


def test_neither_are_its_measurements(tmp_path):
    rows = [
        f"{k / 16},{s},{2 * math.sin(2 * math.pi * (k / 16 + s))}"
        for k in range(16)
        for s in (0, 0.25, 0.5, 0.75, 1)
    ]
    (tmp_path / "swim.svg").write_text("\n".join(["t,s,curvature", *rows]))
    text = BACKBONE.replace('"sine"', '"centreline"\nfile = "swim.svg"')
    (tmp_path / "s.toml").write_text(text)
    args = ["s.toml", "--over", "body.length=1,2", "-o", "s.nc", "--plot", "swim.svg"]
    code, _, err = geomech("sweep", *args, cwd=tmp_path)
    assert code == 2
    assert "cannot write swim.svg: it is an input" in err
    code, _, err = geomech(
        "displacement",
        "s.toml",
        "--amplitudes",
        "0.1",
        "--plot",
        "swim.svg",
        cwd=tmp_path,
    )
    assert code == 2
    assert "cannot write swim.svg: it is an input" in err
    assert (tmp_path / "swim.svg").read_text().startswith("t,s,curvature")


def test_one_file_is_not_two_outputs(tmp_path):
    (tmp_path / "a.nc").write_text("")
    (tmp_path / "a.svg").symlink_to("a.nc")
    code, _, err = geomech(
        "connection",
        "three-link-viscous",
        *SMALL,
        "-o",
        "a.nc",
        "--plot",
        "a.svg",
        cwd=tmp_path,
    )
    assert code == 2
    assert "cannot write" in err


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
def test_names_that_are_not_text_are_kept(tmp_path):
    name = os.fsdecode(b"caf\xe9.toml")
    (tmp_path / name).write_text(scenes.load("three-link-viscous").text)
    for args in (
        (
            "sweep",
            name,
            "--over",
            "gait.amplitude=0.5,1",
            "-o",
            os.fsdecode(b"\xe9.nc"),
            "--plot",
            os.fsdecode(b"\xe9.png"),
        ),
        ("connection", name, *SMALL, "-o", "a.nc"),
        (
            "displacement",
            name,
            "--amplitudes",
            "0.5",
            "--tiers",
            "direct",
            "--plot",
            "d.pdf",
        ),
        ("displacement", name, "--amplitudes", "0.5", "--tol", "0.1", "--json"),
        ("explain", name),
    ):
        code, _, err = geomech(*args, cwd=tmp_path)
        assert (code, err) == (0, "")
    for file in (os.fsdecode(b"\xe9.nc"), "a.nc"):
        with xarray.open_dataset(
            tmp_path / file, engine="scipy"
        ) as data:  # netCDF4, if it is there, takes text alone
            assert data.attrs["scene"] == "caf\\udce9.toml"
            said = scenes.parse(data.attrs["scene_toml"], "three-link-viscous")
            wanted = scenes.load("three-link-viscous")
            assert said == (
                wanted
                if file != "a.nc"
                else wanted.with_numerics(
                    grid=int(SMALL[1]), extent=said.numerics.extent
                )
            )
    assert not any(p.name.startswith(".") for p in tmp_path.iterdir())


@pytest.mark.parametrize("path", ["/dev/zero", ".", "pipe", "large.toml", "latin.toml"])
def test_what_is_no_scene_file_is_refused_at_once(path, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(1 << 40)
    (tmp_path / "latin.toml").write_bytes(b"# \xe9")
    code, out, err = geomech("explain", path, cwd=tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"error: cannot read scene '{path}': ")


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


def test_a_scene_comes_through_a_pipe(tmp_path):
    """Once: also for commands that ask what it is first. Its files are looked for from the current folder."""
    text = scenes.load("three-link-viscous").text.encode()
    for args, content, said in (
        (["explain"], text, "pipe: viscous (ratio = 2.0)"),
        (["connection", "--grid", "5", "-o", "a.nc"], text, ""),
        (
            ["explain"],
            b'[system]\nkind = "table"\nfile = "a.nc"\n[gait]\nkind = "circle"\n',
            "pipe: table (",
        ),
    ):
        with pipe(content) as name:
            code, out, err = geomech(args[0], name, *args[1:], cwd=tmp_path)
        assert (code, err) == (0, "") and " ".join(out.split()).startswith(said)
    sweep = [
        sys.executable,
        "-m",
        "geomech",
        "sweep",
        "/dev/stdin",
        "--over",
        "gait.amplitude=0.5,1",
        "-o",
        "b.nc",
    ]
    done = subprocess.run(
        sweep, input=text, capture_output=True, cwd=tmp_path, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"2 points" in done.stdout


def test_the_command_starts_without_the_heavy_libraries():
    heavy = ("numpy", "scipy", "matplotlib", "sympy", "rich.progress")
    code = f"import sys, geomech.shell.cli; print([m for m in {heavy} if m in sys.modules])"
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True
        ).stdout
        == "[]\n"
    )


def test_commands_load_what_they_use_and_no_more(tmp_path):
    """A start of a few tenths of a second: nothing that draws, splines or computes formulas, no walking, no cluster."""
    used = [
        ["velocity", "three-link-glass", "--alpha", "0.5,0.3", "--alphadot", "1,0"],
        ["explain", "three-link-glass"],
        ["scenes"],
        [
            "displacement",
            "three-link-viscous",
            "--amplitudes",
            "0.5",
            "--tiers",
            "direct",
        ],
        ["trajectory", "three-link-viscous", "-o", "t.csv"],
        ["sweep", "three-link-viscous", "--over", "gait.amplitude=0.5,1", "-o", "s.nc"],
    ]
    heavy = (
        "matplotlib",
        "scipy.interpolate",
        "scipy.optimize",
        "scipy.spatial",
        "sympy",
        "numba",
        "distributed",
    )
    heavy += (
        "rft.terradynamics.walking",
        "rft.terradynamics.meshes",
        "geomech.scenes.terradynamics.walker",
        "concurrent.futures.process",
        "rich.progress",
    )
    code = f"""if True:
        import os, sys
        from geomech.shell import cli
        os.environ["OPENBLAS_NUM_THREADS"] = "7"
        for args in {used!r}:
            try:
                cli.main(args)
            except SystemExit as left:
                assert left.code == 0, args
            found = [m for m in {heavy} if m in sys.modules]
            assert not found, (args, found)
            assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
    """
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path
    )
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
    assert round_amplitudes(top) == pytest.approx(
        step * np.arange(1, count + 1), rel=1e-9
    )


def test_amplitudes_of_a_report_fill_the_field():
    """Up to the side that is nearest to the gait's centre, with the sign of the gait's own; and those of both gaits of the
    paper's figure are compared, the scene's own first."""
    scene = scenes.load("three-link-glass").with_numerics(extent=2.0)
    for centre, amplitude, room in (((0.4, -0.8), 0.7, 1.2), ((0.8, -0.4), -0.7, 1.2)):
        gait = Circle(amplitude=amplitude, centre=centre, frequency=3.0)
        moved = scene.changed(gait=gait)
        assert reachable_amplitudes(moved, gait) == pytest.approx(
            np.sign(amplitude) * np.array(round_amplitudes(room))
        )
        own, other = compared_gaits(moved)
        assert own is gait and (type(other).__name__, other.frequency) == (
            "Butterfly",
            3.0,
        )
    with pytest.raises(
        Refusal,
        match="the gait's centre lies outside the field: raise \\[numerics\\] extent",
    ):
        reachable_amplitudes(scene, Circle(centre=(0.0, 2.0)))
    snake = scenes.load(
        "no-slip-snake"
    )  # with singular shapes the gait's own is the last
    gait = Circle(amplitude=-0.33, centre=snake.gait.centre)
    assert reachable_amplitudes(snake, gait) == pytest.approx(
        [*(-np.array(round_amplitudes(0.33))), -0.33]
    )
    for still in (Circle(amplitude=0.0), Ellipse(semi_axes=(0.0, 0.0))):
        with pytest.raises(Refusal, match="does not move: give it a size"):
            reachable_amplitudes(snake, still)
