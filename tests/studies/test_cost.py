"""Large requests: foretold, refused without --yes, stopped at once, kept as far as they got, and bounded in memory."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from commands import geomech as run
from scipy.io import netcdf_file
from tabled import swept_table, tabled_json

from geomech import plots, scenes
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.representations.field import Field
from geomech.run import cost as run_cost
from geomech.shell import terminal
from geomech.studies.displacement import cycles, sweep
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables

GLASS = scenes.load("three-link-glass")
VISCOUS = scenes.load("three-link-viscous")
SLOPING = scenes.parse(
    scenes.load("sandfish-loose")
    .text.partition("[[effects]]")[0]
    .replace("elements = 100", "elements = 10")
    + '\n[[effects]]\nkind = "transient"\ntravel = 0.1'
)
FIVE_LINKS = (
    GLASS.text.partition("[gait]")[0].replace("[1, 1, 1]", "[1, 1.2, 1, 0.8, 1]")
    + '[gait]\nkind = "wave"\njoints = 4\namplitude = 0.4\n'
)
FIVE = scenes.parse(FIVE_LINKS)


LARGE = {
    "values of a sweep": [
        "sweep",
        "sandfish-transient",
        "--over",
        "medium.C=1:2:99999",
        "-o",
        "out.nc",
    ],
    "amplitudes of a sweep": [
        "sweep",
        "sandfish-loose",
        "--over",
        "gait.amplitude=0.1:2:99999",
        "-o",
        "out.nc",
    ],
    "a grid": ["connection", "three-link-glass", "--grid", "1414", "-o", "out.nc"],
    "a field of four joints": [
        "connection",
        "finest.toml",
        "--grid",
        "36",
        "-o",
        "out.nc",
    ],
    "a connection around a gait": [
        "displacement",
        "five.toml",
        "--amplitudes",
        "0.1:0.5:99999",
        "--tiers",
        "path",
    ],
    "a map": ["ccf", "directions.toml", "--grid", "301", "--plot", "out.png"],
    "directions": ["connection", "directions.toml", "-o", "out.nc", "--grid", "301"],
    "harmonics": [
        "displacement",
        "harmonics.toml",
        "--amplitudes",
        "1",
        "--tiers",
        "harmonic",
        "--grid",
        "201",
    ],
    "phases": ["run", "phases.toml", "-o", "out"],
    "phases of many amplitudes": [
        "displacement",
        "phases.toml",
        "--amplitudes",
        "0.1:1:1000",
    ],
    "elements": ["displacement", "elements.toml", "--amplitudes", "0.1:0.2:2000"],
    "time stepping": [
        "displacement",
        "sandfish-transient",
        "--amplitudes",
        "0.1:0.2:9999",
    ],
    "a tolerance": [
        "displacement",
        "butterfly-glass",
        "--amplitudes",
        "0.1:1:99999",
        "--tol",
        "1e-5",
    ],
    "accuracy": ["accuracy", "phases.toml", "-o", "out.nc"],
}


@pytest.fixture
def large(tmp_path, monkeypatch):
    """A folder with scenes that ask for much."""
    for name, value in (
        ("directions", 2048),
        ("harmonics", 999),
        ("phases", 1_000_000),
    ):
        (tmp_path / f"{name}.toml").write_text(
            f"{GLASS.text}\n[numerics]\n{name} = {value}\n"
        )
    (tmp_path / "five.toml").write_text(FIVE_LINKS)
    (tmp_path / "finest.toml").write_text(f"{FIVE_LINKS}[numerics]\ndirections = 128\n")
    fish = scenes.load("sandfish-loose").text
    (tmp_path / "elements.toml").write_text(
        fish.replace("elements = 100", "elements = 2000")
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", [n for n in LARGE if n != "phases"])
def test_large_requests_are_refused_without_yes(name, large, monkeypatch):
    monkeypatch.setattr(
        run_cost, "TIMED_SECONDS", 0.05
    )  # what is refused is far beyond what may be
    monkeypatch.setattr(
        connection, "SAMPLES_TOGETHER", 2000
    )  # three small batches tell
    monkeypatch.setattr(cycles, "BATCH_SIZE", 4)
    monkeypatch.setattr(
        "geomech.mathematics.systems.capabilities.VALUES_TOGETHER", 1 << 15
    )
    before = sorted(p.name for p in large.iterdir())
    code, out, err = run(*LARGE[name])
    assert (code, out) == (2, "")
    *_, last = err.splitlines()
    assert " force balances, about " in last
    assert "of memory: to compute for more than 60 s or 2 GB say --yes" in last
    assert sorted(p.name for p in large.iterdir()) == before


def test_yes_computes_and_says_what_is_to_come(large, monkeypatch):
    monkeypatch.setattr(run_cost, "LONGEST", 0.0)
    monkeypatch.setattr(run_cost, "WORTH_SAYING", 0.0)
    args = [
        "displacement",
        "three-link-viscous",
        "--amplitudes",
        "1",
        "--tiers",
        "direct",
        "--json",
    ]
    assert run(*args)[0] == 2
    code, out, err = run(*args, "--yes")
    assert code == 0
    assert err.startswith(
        "three-link-viscous: 65 force balances, about 1 s of computing and 16"
    )
    assert np.hypot(*tabled_json(out)["direct"][0][:2]) == pytest.approx(
        0.0512808, abs=1e-6
    )
    for args in (
        ["run", "three-link-viscous", "-o", "d"],
        ["accuracy", "three-link-viscous", "-o", "d.nc"],
    ):
        assert "say --yes" in run(*args)[2]


def test_a_field_of_four_joints_is_written(large, monkeypatch):
    """Said before it begins once it takes a second; least squares over the same directions at one of its shapes."""
    monkeypatch.setattr(
        "geomech.questions.swimmers.connection.Connection.report_above", 0.0
    )
    code, out, err = run(
        "connection", "five.toml", "--grid", "4", "--extent", "1.2", "-o", "out.nc"
    )
    assert code == 0 and out.startswith("five.toml: local connection A")
    assert "\ncost: 8,704 force balances, " in out
    assert err.startswith(
        "five.toml: 8,704 force balances, about 1 s of computing and 16"
    )
    with netcdf_file(large / "out.nc", mmap=False) as file:
        A, axes = (
            file.variables["A"][:].copy(),
            [file.variables[f"alpha_{k}"][:].copy() for k in (1, 2, 3, 4)],
        )
        assert file.variables["A"].dimensions == (
            "component",
            "joint",
            "alpha_1",
            "alpha_2",
            "alpha_3",
            "alpha_4",
        )
        assert (
            file.variables["fit_residual"].shape == (3, 4, 4, 4, 4)
            and "ccf" not in file.variables
        )
    unit, alpha = (
        connection.directions(4, 64),
        np.array([axis[k] for axis, k in zip(axes, (3, 0, 2, 1))]),
    )
    wanted = np.linalg.lstsq(unit, FIVE.system.velocity(alpha, unit), rcond=None)[0].T
    np.testing.assert_allclose(A[:, :, 3, 0, 2, 1], wanted, atol=1e-12)


@pytest.mark.usefixtures("fastest")
def test_pieces_change_no_numbers(monkeypatch):
    """What is computed in groups is what it is at once."""
    scene = GLASS.with_numerics(grid=7, phases=48, harmonics=5)
    amplitudes = np.linspace(0.3, 1.4, 4)

    def everything():
        fresh = SceneTables(scene.with_numerics(grid=7))
        tiers = [
            fresh.poses(m, None, amplitudes)
            for m in ("area", "adapted", "path", "harmonic", "direct")
        ]
        fields = (
            fresh.fitted.A,
            fresh.fitted.residual,
            fresh.fitted.speed,
            fresh.table("harmonic").residual,
        )
        marched = SceneTables(SLOPING.with_numerics(phases=16, cycles=2)).poses(
            "direct", None, amplitudes / 5
        )
        return [
            *tiers,
            *fields,
            marched,
            *estimate.direct(scene, scene.gait, amplitudes, 32),
        ]

    whole = everything()
    monkeypatch.setattr("geomech.mathematics.systems.capabilities.VALUES_TOGETHER", 1)
    monkeypatch.setattr("geomech.mathematics.systems.capabilities.STEPPED_TOGETHER", 1)
    for module in (
        connection,
        *(
            sys.modules[f"geomech.mathematics.{name}"]
            for name in ("tiers.area", "tiers.direct", "geometry.family")
        ),
    ):
        monkeypatch.setattr(module, "SAMPLES_TOGETHER", 17)
    monkeypatch.setattr(harmonics, "VALUES_TOGETHER", 23)
    for a, b in zip(whole, everything(), strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-13)


def test_a_large_map_is_drawn_on_fewer_points():
    axes = np.linspace(-1, 1, 1001), np.linspace(-2, 2, 31)
    drawn = plots.drawable(Field(axes, np.add.outer(axes[0], 2 * axes[1])[None]))
    assert [len(a) for a in drawn.axes] == [plots.FINEST, 31]
    np.testing.assert_array_equal([a[[0, -1]] for a in drawn.axes], [[-1, 1], [-2, 2]])
    np.testing.assert_allclose(
        drawn.values[0], np.add.outer(drawn.axes[0], 2 * drawn.axes[1])
    )


def test_a_sweep_over_amplitude_goes_in_groups(tmp_path, monkeypatch):
    """Many amplitudes are many batches: a stop keeps those that are done, in the middle of a row too."""
    over = {
        "medium.ratio": [2.0, 3.0],
        "gait.amplitude": np.linspace(0.2, 1.5, 7).tolist(),
    }
    whole, kept = swept_table(sweep.sweep(VISCOUS, over)), tmp_path / ".s.partial"
    monkeypatch.setattr(cycles, "BATCH_SIZE", 3)
    rows, calls = cycles._rows, []

    def stopping(at, amplitudes):
        calls.append((at[0].system.medium.ratio, len(amplitudes)))
        if len(calls) == 5:
            raise terminal.Stopped(signal.SIGTERM)
        return rows(at, amplitudes)

    monkeypatch.setattr(cycles, "_rows", stopping)
    with pytest.raises(terminal.Stopped):
        swept_table(sweep.sweep(VISCOUS, over, kept))
    again = swept_table(sweep.sweep(VISCOUS, over, kept))
    assert calls == [
        (2.0, 3),
        (2.0, 3),
        (2.0, 1),
        (3.0, 3),
        (3.0, 3),
        (3.0, 3),
        (3.0, 1),
    ]
    np.testing.assert_allclose(
        again["displacement"], whole["displacement"], rtol=1e-12, atol=1e-13
    )
    np.testing.assert_allclose(
        again["estimate"], whole["estimate"], rtol=1e-6, atol=1e-14
    )


# Stopping.


def started(args, cwd):
    """A command as a process, with the signals of a terminal whatever those of the tests are."""
    before = [signal.signal(n, signal.SIG_DFL) for n in (signal.SIGHUP, signal.SIGTERM)]
    interrupt = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(
            [sys.executable, "-m", "geomech", *args],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd,
        )  # fmt: skip
    finally:
        for number, handler in zip(
            (signal.SIGHUP, signal.SIGTERM, signal.SIGINT), (*before, interrupt)
        ):
            signal.signal(number, handler)


def test_a_signal_stops_the_solvers_threads(large):
    """One batch of half a million balances, solved on both cores: nobody waits for its shares."""
    code = """if True:
        import os, signal, sys, threading, numpy as np
        from geomech.shell import terminal
        from geomech.shell.terminal import stoppable
        from rft import Chain, Granular, body_velocity
        shapes = np.random.default_rng(0).uniform(-2, 2, (2, 500_000, 2))
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGTERM)).start()
        try:
            with stoppable():
                body_velocity(Granular(1.8, .24), Chain(), *shapes, threads=2)
        except terminal.Stopped as stopped:
            print(stopped.code)
    """
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=20
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "143\n", "")


@pytest.mark.parametrize(
    "raised", [KeyboardInterrupt(), terminal.Stopped(signal.SIGINT)]
)
def test_an_interrupt_is_no_success(raised, monkeypatch):
    def stop(name):
        raise raised

    monkeypatch.setattr(scenes, "load", stop)
    code, out, err = run("explain", "three-link-glass")
    again = "the same command starts anew: geomech explain three-link-glass"
    assert (code, out, err) == (
        130,
        "",
        f"error: stopped by SIGINT: nothing is kept; {again}\n",
    )


def test_what_was_ignored_stays_ignored():
    """nohup geomech ... outlives its terminal."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with terminal.stoppable():
            os.kill(os.getpid(), signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_second_signal_does_not_disturb_the_keeping():
    def work():  # a shell's background jobs ignore INT, under nohup HUP too
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(5)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.01)

    with pytest.raises(terminal.Stopped) as stopped, terminal.stoppable():
        work()
    assert stopped.value.code == 143


# Terminals and folders.


def test_a_terminal_without_letters_and_a_home_without_folders(tmp_path):
    (tmp_path / "sch\u00f6n \u2603.toml").write_text(
        VISCOUS.text + "# \u2603\n", encoding="utf-8"
    )
    (tmp_path / "file").write_text("")
    poor = {
        "PYTHONIOENCODING": "ascii",
        "LC_ALL": "C",
        "MPLCONFIGDIR": str(tmp_path / "file" / "no"),
    }
    code = """if True:
        import sys
        from geomech.shell import cli
        for args in (
            "displacement/sch\\u00f6n \\u2603.toml/--amplitudes/1/--tiers/direct/--plot/\\u2603.png",
            "explain/\\u2603.toml",
        ):
            try:
                cli.main(args.split("/"))
            except SystemExit as ended:
                print("code", ended.code)
    """
    env = {k: v for k, v in os.environ.items() if k != "HOME"} | poor
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        cwd=tmp_path,
        env=env,
        timeout=120,
    )
    lines = done.stdout.decode("ascii").splitlines()
    assert [line for line in lines if line.startswith("code")] == ["code 0", "code 2"]
    assert any(
        line.startswith("sch\\xf6n \\u2603.toml: displacement per cycle")
        for line in lines
    )
    assert (tmp_path / "\u2603.png").stat().st_size > 10_000
    *_, error = done.stderr.decode(
        "ascii"
    ).splitlines()  # on a slow machine how far it is comes before
    assert error.startswith("error: cannot read scene")


def test_too_many_open_files_are_said_and_nothing_is_left(tmp_path):
    """Where a folder of ours needs two more to go than the file that is to be written."""
    line = f"ulimit -n 6; exec {sys.executable} -m geomech trajectory three-link-viscous -o a.csv"
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, cwd=tmp_path, timeout=60
    )
    assert done.returncode == 2
    assert done.stderr.startswith(
        "error: too many files are open at once: raise the limit, as by 'ulimit -n 1024'"
    )
    assert [p.name for p in tmp_path.iterdir() if not p.name.endswith(".partial")] == []


FULL = "No space left on device; make room, or send it elsewhere"


def test_nobody_need_listen(tmp_path):
    """A pipe that is closed, as by head, and no standard output at all, are no failures; a full disk is one."""
    told = f"{sys.executable} -m geomech"
    full = f"error: cannot write to standard output: {FULL}\n"
    for line, code, err in (
        (f"{told} scenes | true; exit ${{PIPESTATUS[0]}}", 0, ""),
        (f"{told} --version >&-", 0, ""),
        (f"{told} --version 2>&- >/dev/null", 0, ""),
        (f"{told} --version > /dev/full", 2, full),
    ):
        done = subprocess.run(
            ["bash", "-c", line],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            timeout=60,
        )
        assert (done.returncode, done.stderr) == (code, err), line


# By hand.


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    "args",
    [
        *(LARGE[n] for n in ("a grid", "a map", "phases", "directions")),
        ["displacement", "three-link-viscous", "--amplitudes", "0.1:2:99999"],
        ["displacement", "elements.toml", "--amplitudes", "0.1:0.2:20"],
        ["displacement", "harmonics.toml", "--amplitudes", "1", "--tiers", "harmonic"],
    ],
    ids=lambda args: " ".join(args[:2]),
)
def test_memory_stays_below_what_was_said(args, large):
    code = "import atexit, resource, sys; from geomech.shell.cli import main; "
    code += "memory = lambda: resource.getrusage(0).ru_maxrss; "
    code += "atexit.register(lambda: print(memory() * 1024, file=sys.stderr)); main(sys.argv[1:])"
    done = subprocess.run(
        [sys.executable, "-c", code, *args, "--yes"], capture_output=True, text=True
    )
    used = int(done.stderr.splitlines()[-1])
    assert done.returncode == 0
    assert used < run_cost.LARGEST


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", LARGE)
@pytest.mark.parametrize("after", [0.5, 3.0, 9.0, 20.0])
def test_every_large_request_stops_within_two_seconds(name, after, large):
    process = started([*LARGE[name], "--yes"], large)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(after)
    if process.poll() is not None:
        pytest.skip("it had ended")
    process.send_signal(signal.SIGTERM)
    begun = time.monotonic()
    err = process.communicate(timeout=60)[1]
    took = time.monotonic() - begun
    assert process.returncode == (143 if "stopped by" in err else -15)
    print(f"{name} after {after} s: {took:.2f} s")
    assert took < 2.0
