"""Sweeps over a scene's parameters: right at every point, kept when interrupted, taken up again."""

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray
from test_cli import geomech

from geomech import scene as scenes
from geomech import terminal
from geomech.errors import SceneError
from geomech.output import sweeps
from geomech.study import estimate, kept, sweep
from geomech.study.bench import Study
from rft import CATALOGUE, Granular

GLASS = scenes.load("three-link-glass").with_numerics(phases=32)


def test_every_point_is_the_scene_there():
    results = sweep.sweep(GLASS, {"gait.amplitude": [0.5, 1.0, 1.5], "body.length": [1.0, 2.0]})
    assert results["displacement"].shape == (3, 2, 3)
    alone = scenes.parse(GLASS.text.replace("length = 1.0 ", "length = 2.0 ")).with_numerics(phases=32)
    poses, error = estimate.direct(alone, alone.gait, np.array([1.5]), alone.numerics.phases)
    np.testing.assert_allclose(results["displacement"][2, 1], poses[0], atol=1e-12)
    np.testing.assert_allclose(results["estimate"][2, 1], 2 * error[0, 0], rtol=1e-6)
    np.testing.assert_allclose(results["estimate_heading"][2, 1], error[0, 1], rtol=1e-6)
    np.testing.assert_allclose(results["displacement"][:, 1, 0], 2 * results["displacement"][:, 0, 0], rtol=1e-9)


def test_parameters_of_a_medium_given_by_name_can_be_swept():
    """As if its law stood in the scene; what is not swept stays that of the name."""
    named, over = GLASS.text.partition("[medium]"), {"medium.gamma0_deg": [10.0, 20.0], "gait.amplitude": [1.0]}
    text = named[0] + '[medium]\nname = "glass-0.3mm-close"\n[body]' + named[2].partition("[body]")[2]
    results = sweep.sweep(scenes.parse(text).with_numerics(phases=32), over)
    alone = GLASS.changed(medium=Granular(C=CATALOGUE["glass-0.3mm-close"].medium.C, gamma0=np.radians(20.0)))
    np.testing.assert_allclose(results["displacement"][1, 0], Study(alone).displacement("direct"), rtol=1e-9)


def test_effects_and_whole_numbers_can_be_swept():
    fish = scenes.load("sandfish-loose")
    results = sweep.sweep(fish, {"effects.end-caps.radius": [0.0, 0.1], "numerics.phases": [32, 64]})
    assert (results["displacement"][0, :, 0] > results["displacement"][1, :, 0]).all()


PAST = "\n[[effects]]\nkind = "
BATCHES = {
    "wave number": ("", {"gait.waves": [0.8, 1.0, 1.5], "gait.amplitude": [0.1, 0.2]}),
    "friction": (PAST + '"skin-friction"', {"effects.skin-friction.forward": [0.05, 0.1, 0.2]}),
    "frequency": (
        PAST + '"body-inertia"\nmass = 0.02\nfrequency = 1.0\nlength = 0.1\ndrag = 1.0',
        {"effects.body-inertia.frequency": [0.0, 5.0], "gait.amplitude": [0.1, 0.2]},
    ),
    "frequency of grains": (
        PAST + '"grain-inertia"\nfrequency = 1.0\nlength = 0.1\ndepth = 0.05',
        {"effects.grain-inertia.frequency": [0.0, 2.0, 5.0]},
    ),
    "travel": (PAST + '"transient"\ntravel = 0.1', {"effects.transient.travel": [0.05, 0.1]}),
    "ground": (
        PAST + '"disturbed-ground"\nradius = 0.05\nweakening = 0.0',
        {"effects.disturbed-ground.weakening": [0.05, 0.1]},
    ),
    "slope": (PAST + '"depth-profile"\nslope = 0.1', {"effects.depth-profile.slope": [0.05, 0.1]}),
}


@pytest.mark.parametrize("name", BATCHES)
def test_sweeps_are_batches(name, monkeypatch):
    """Points that differ in gait and effects are one call of the engine, and each is what it is alone."""
    effect, over = BATCHES[name]
    text = scenes.load("sandfish-loose").text.partition("[[effects]]")[0].replace("elements = 100", "elements = 16")
    fish = scenes.parse(text + effect).with_numerics(phases=32, pieces=12)
    if name != "frequency":  # of which all settle
        fish = fish.with_numerics(cycles=1)
    calls, direct = [], estimate.direct
    monkeypatch.setattr(estimate, "direct", lambda *args: calls.append(args) or direct(*args))
    at_once = sweep.sweep(fish, over)
    assert len(calls) == 1
    last = tuple(len(values) - 1 for values in over.values())
    alone = sweep.sweep(fish, {name: values[-1:] for name, values in over.items()})
    assert np.abs(at_once["displacement"][last] - at_once["displacement"][(0,) * len(over)]).max() > 1e-4
    # Side by side all settle before any stops; the rest is rounding.
    np.testing.assert_allclose(at_once["displacement"][last], alone["displacement"].ravel(), atol=2e-6)
    np.testing.assert_allclose(at_once["estimate"][last], alone["estimate"].ravel(), rtol=0.2, atol=2e-6)


@pytest.fixture
def without_estimates(monkeypatch):
    def direct(scene, gait, amplitudes, phases):
        net = scene.system.run(*gait.cycle(phases, amplitudes)).net
        return net, np.zeros((len(net), 2))

    monkeypatch.setattr(estimate, "direct", direct)


def test_a_level_ground_is_no_gentle_slope(without_estimates):
    """Without a slope cycles become periodic, with one there is one cycle: they do not share a batch."""
    text = scenes.load("sandfish-loose").text.partition("[[effects]]")[0].replace("elements = 100", "elements = 16")
    effects = PAST + '"transient"\ntravel = 0.03' + PAST + '"depth-profile"\nslope = 0.0'
    parse = lambda text: scenes.parse(text).with_numerics(phases=64, pieces=12)
    found = sweep.sweep(parse(text + effects), {"effects.depth-profile.slope": [0.0, 0.05]})
    level = Study(parse(text + PAST + '"transient"\ntravel = 0.03')).displacement("direct")
    np.testing.assert_allclose(found["displacement"][0], level, atol=2e-6)


def test_a_scene_changed_since_it_was_read_is_swept_as_it_is():
    fish = scenes.load("sandfish-loose").with_numerics(phases=32)
    plain = fish.changed(effects=())
    found = sweep.sweep(plain, {"gait.amplitude": [0.1], "medium.C": [1.8, 3.0]})["displacement"]
    assert Study(plain).displacement("direct", None, 0.1) == pytest.approx(found[0, 0], abs=1e-9)
    assert np.abs(found[0, 0] - Study(fish).displacement("direct", None, 0.1))[0] > 0.01
    with pytest.raises(SceneError, match="the scene has no effect 'end-caps'"):
        sweep.sweep(plain, {"effects.end-caps.radius": [0.1]})


def test_one_frequency_for_all_effects(without_estimates):
    both = scenes.load("sandfish-heavy").text.replace("elements = 100", "elements = 12") + (
        PAST + '"grain-inertia"\nfrequency = 3.0\nlength = 0.1\ndepth = 0.05'
    )
    swimmer = scenes.parse(both).with_numerics(phases=64)
    found = sweep.sweep(swimmer, {"effects.frequency": [0.0, 3.0, 9.0]})["displacement"]
    np.testing.assert_allclose(found[1], Study(swimmer).displacement("direct"), atol=1e-9)
    assert np.abs(found[0] - found[2]).max() > 3e-3
    with pytest.raises(SceneError, match="body-inertia gives frequency = 3.0 and grain-inertia 2.0: it is one swimmer"):
        sweep.sweep(scenes.parse(both), {"effects.grain-inertia.frequency": [2.0]})
    with pytest.raises(SceneError, match=r"\[body\] gives length = 0.2 and body-inertia 0.1"):
        sweep.sweep(scenes.parse(both), {"body.length": [0.2]})
    with pytest.raises(SceneError, match="no effect of the scene gives 'speed'"):
        sweep.sweep(scenes.parse(both), {"effects.speed": [2.0]})


def test_what_cannot_share_a_batch_gets_its_own(monkeypatch):
    fish = scenes.load("sandfish-loose").with_numerics(phases=32)
    calls, direct = [], estimate.direct
    monkeypatch.setattr(estimate, "direct", lambda *args: calls.append(args) or direct(*args))
    sweep.sweep(fish, {"effects.end-caps.radius": [0.02, 0.06], "gait.waves": [0.9, 1.1]})
    assert len(calls) == 2


OVER = {"body.length": [1.0, 2.0, 3.0, 4.0], "gait.amplitude": [0.5, 1.0]}


@pytest.fixture(scope="module")
def whole():
    return sweep.sweep(GLASS, OVER)


@pytest.fixture
def interrupted(tmp_path, monkeypatch):
    """(file, calls) of a sweep of GLASS over OVER, interrupted in its third batch of two points."""
    partial, rows, calls = tmp_path / ".s.nc.partial", sweep._rows, []

    def failing(at, amplitudes):
        calls.append(at[0].system.body.length)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return rows(at, amplitudes)

    monkeypatch.setattr(sweep, "_rows", failing)
    monkeypatch.setattr(sweep, "SAMPLES_TOGETHER", 2)  # both amplitudes of one length
    with pytest.raises(KeyboardInterrupt):
        sweep.sweep(GLASS, OVER, partial)
    assert np.shape(rows_in(partial)) == (4, 5)  # two lengths, two amplitudes each
    return partial, calls


def rows_in(path, points=99_999):
    """What a file keeps, as numbers (N, 5)."""
    with path.open("rb") as file:
        return kept._believed(file, {}, points, 5)[1]


def test_an_interrupted_sweep_is_taken_up(interrupted, whole):
    partial, calls = interrupted
    again = sweep.sweep(GLASS, OVER, partial)
    assert calls == [1.0, 2.0, 3.0, 3.0, 4.0]
    np.testing.assert_array_equal(again["displacement"], whole["displacement"])
    assert len(rows_in(partial)) == 8  # there until it is saved
    assert sweep.sweep(GLASS, OVER, partial)["estimate"].tolist() == again["estimate"].tolist()
    assert len(calls) == 5


def test_a_sweep_over_amplitude_alone_is_kept_too(tmp_path, monkeypatch):
    partial, over, rows = tmp_path / "p", {"gait.amplitude": [0.2, 0.4, 0.6, 0.8, 1.0]}, sweep._rows
    plain, calls = sweep.sweep(GLASS, over), []

    def failing(at, amplitudes):
        calls.append(amplitudes)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return rows(at, amplitudes)

    monkeypatch.setattr(sweep, "_rows", failing)
    monkeypatch.setattr(sweep, "SAMPLES_TOGETHER", 3)
    with pytest.raises(KeyboardInterrupt):
        sweep.sweep(GLASS, over, partial)
    again = sweep.sweep(GLASS, over, partial)
    assert calls == [[0.2, 0.4, 0.6], [0.8, 1.0], [0.8, 1.0]]
    np.testing.assert_allclose(again["displacement"], plain["displacement"], atol=1e-12)


@pytest.mark.parametrize("done", range(1, 13))
def test_a_sweep_goes_on_anywhere(done, tmp_path, monkeypatch):
    """Whatever was done before, each point comes once, in order."""
    over = {"body.length": [1.0, 2.0, 3.0], "gait.amplitude": [0.1, 0.2, 0.3, 0.4]}
    every = [(p, a) for p in over["body.length"] for a in over["gait.amplitude"]]
    asked = sweep.question(GLASS, over)
    for at_once in (1, 3, 4, 9):
        found = []

        def rows(batch, amplitudes):
            found.extend((s.system.body.length, a) for s in batch for a in amplitudes)
            return [[s.system.body.length, a, 0.0, 0.0, 0.0] for s in batch for a in amplitudes]

        end = kept.begin(tmp_path / "p", asked)
        kept.append(tmp_path / "p", end, np.array([[*point, 0.0, 0.0, 0.0] for point in every[:done]]))
        monkeypatch.setattr(sweep, "_rows", rows)
        monkeypatch.setattr(sweep, "SAMPLES_TOGETHER", at_once)
        result = sweep.sweep(GLASS, over, tmp_path / "p")
        assert found == every[done:]
        assert [tuple(x) for x in result["displacement"][..., :2].reshape(-1, 2)] == every


def other_values(found):
    found["question"]["over"][0][1][0] = 9.0


def other_name(found):
    found["question"]["over"][0][0] = "gait.amplitude"


def other_solver(found):
    found["question"]["solver"] -= 1


def other_scene(found):
    found["question"]["scene"] += "# "


def too_many(found):
    found["rows"] = np.tile(found["rows"], (3, 1))


def not_finite(found):
    found["rows"][1][0] = float("nan")


def another_back_end(found):
    found["settled"] = "abacus"


def no_back_end(found):
    del found["settled"]


def no_question(found):
    found["question"] = [1]


@pytest.mark.parametrize(
    "change",
    [
        other_values,
        other_name,
        other_solver,
        other_scene,
        too_many,
        not_finite,
        another_back_end,
        no_back_end,
        no_question,
    ],
)
def test_what_is_kept_of_anything_else_is_set_aside(change, interrupted, whole, capsys):
    """With a checksum that is right, as another version or another sweep would leave it."""
    partial, calls = interrupted
    head = json.loads(partial.read_bytes().split(b"\n")[0])
    found = {**head, "rows": rows_in(partial)}
    change(found)
    body = {key: value for key, value in found.items() if key not in ("rows", "checksum")}
    line = json.dumps({**body, "checksum": kept._checksum(body)}).encode() + b"\n"
    partial.write_bytes(line)
    kept.append(partial, len(line), found["rows"])
    text = partial.read_bytes()
    again = sweep.sweep(GLASS, OVER, partial)
    assert calls[3:] == [1.0, 2.0, 3.0, 4.0]
    np.testing.assert_array_equal(again["displacement"], whole["displacement"])
    aside = partial.with_name(".s.nc.partial.set-aside")
    assert aside.read_bytes() == text
    said = capsys.readouterr().err
    assert said.startswith(f"note: {partial} is not taken up, ")
    assert said.endswith(f": set aside as {aside.name}\n")
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    "text", ["", "5", "[]", "null", "{}", '{"rows": 5}', "[" * 100_000, "9" * 5000, "\0", "\ud800"]
)
def test_no_text_is_a_traceback(text, interrupted, capsys):
    partial, _ = interrupted
    for k in range(3):
        partial.write_text(text, errors="surrogatepass")
        assert kept.taken_up(partial, {}, 8) is None
        assert not partial.exists()
        assert capsys.readouterr().err.endswith(f"set aside as {partial.name}.set-aside{f'-{k + 1}' if k else ''}\n")


def test_no_flipped_bit_is_believed(interrupted):
    """Every bit behind the question, and a thousand cuts: what is taken up is what was kept, or the beginning of it."""
    partial, _ = interrupted
    asked, rows = sweep.question(GLASS, OVER), rows_in(partial)
    end = partial.stat().st_size
    kept.append(partial, end, rows[:2] + 1.0)  # a second block
    raw, every = partial.read_bytes(), np.concatenate([rows, rows[:2] + 1.0])
    start = raw.index(b'"settled"')
    damaged = [raw[:k] + bytes([raw[k] ^ 1 << bit]) + raw[k + 1 :] for k in range(start, len(raw)) for bit in range(8)]
    damaged += [raw[:k] for k in np.linspace(0, len(raw), 1000).astype(int)]
    believed = []
    for some in damaged:
        with contextlib.suppress(ValueError, TypeError, KeyError, AttributeError):
            believed.append(kept._believed(io.BytesIO(some), asked, 8, 5)[1])
    assert all(np.array_equal(found, every[: len(found)]) for found in believed)
    assert {len(found) for found in believed} == {0, 4, 6}


def test_what_is_kept_behind_a_torn_block_is_written_over(interrupted, whole):
    """A kill in the middle of a block: the rows before it count, and those that come are read back."""
    partial, _ = interrupted
    with partial.open("ab") as file:
        file.write(kept.BLOCK.pack(3, 5) + b"half a row")
    again = sweep.sweep(GLASS, OVER, partial)
    np.testing.assert_array_equal(again["displacement"], whole["displacement"])
    np.testing.assert_array_equal(rows_in(partial)[:, :3], whole["displacement"].reshape(-1, 3))


def test_a_sweep_of_another_axis_of_the_same_shape_is_another(tmp_path, capsys):
    partial = tmp_path / "p"
    sweep.sweep(GLASS, {"gait.amplitude": [0.5, 1.0]}, partial)
    for over in ({"gait.amplitude": [0.5, 1.5]}, {"body.length": [0.5, 1.0]}, {"numerics.extent": [0.5, 1.0]}):
        found = sweep.sweep(GLASS, over, partial)
        np.testing.assert_array_equal(found["displacement"], sweep.sweep(GLASS, over)["displacement"])
        assert "it is of another sweep (over)" in capsys.readouterr().err
    sweep.sweep(GLASS.with_numerics(phases=64), over, partial)
    assert "it is of another sweep (numerics)" in capsys.readouterr().err
    assert len(list(tmp_path.iterdir())) == 5


@pytest.mark.parametrize("kind", ["fifo", "folder", "device", "dangling"])
def test_what_is_no_file_keeps_nothing(kind, tmp_path):
    partial = tmp_path / "p"
    if kind == "fifo":
        os.mkfifo(partial)
    elif kind == "folder":
        partial.mkdir()
    else:
        partial.symlink_to("/dev/zero" if kind == "device" else tmp_path / "nothing")
    with pytest.raises(SceneError, match="it is no ordinary file; remove it"):
        sweep.sweep(GLASS, {"gait.amplitude": [1.0]}, partial)


def test_a_full_disk_loses_nothing_that_is_computed(tmp_path, monkeypatch, capsys):
    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(kept, "append", full)
    monkeypatch.setattr(kept, "SAVE_EVERY", 0.0)
    monkeypatch.setattr(sweep, "SAMPLES_TOGETHER", 1)
    over = {"gait.amplitude": [0.5, 1.0]}
    found = sweep.sweep(GLASS, over, tmp_path / "p")
    assert np.isfinite(found["displacement"]).all()
    assert capsys.readouterr().err.count("note: what is done of the sweep is not kept: ") == 1


def test_a_sweep_stays_until_it_is_saved(tmp_path, monkeypatch):
    """A failure to save, or to draw, costs no computing."""

    def full(*args):
        raise OSError(28, "No space left on device")

    args = ["three-link-viscous", "--over", "gait.amplitude=0.5,1", "-o", "s.nc", "--plot", "s.png"]
    for what in ("save", "draw"):
        with monkeypatch.context() as patch:
            patch.setattr(sweeps, what, full)
            code, _, err = geomech("sweep", *args, cwd=tmp_path)
        assert code == 2
        assert err.endswith(
            "left on device; what is done is kept in .s.nc.partial: the same command goes on from there\n"
        )
        assert (tmp_path / ".s.nc.partial").exists()
    monkeypatch.setattr(sweep, "_rows", full)
    assert geomech("sweep", *args, cwd=tmp_path)[::2] == (0, "")
    assert {p.name for p in tmp_path.iterdir()} == {"s.nc", "s.png"}


@pytest.mark.parametrize("length", [255, 246])  # of the target's name; 246: that of what is kept fits just so
def test_the_longest_name_has_room(length, tmp_path):
    name = "a" * (length - 3) + ".nc"
    args = ["three-link-viscous", "--over", "gait.amplitude=0.5,1", "-o", name]
    assert geomech("sweep", *args, cwd=tmp_path)[::2] == (0, "")
    assert [p.name for p in tmp_path.iterdir()] == [name]
    partial = kept.beside(tmp_path / name, {})
    assert partial == tmp_path / kept.beside(Path(name), {})
    assert partial != kept.beside(tmp_path / ("b" + name[1:]), {})
    partial.write_text("5")
    code, _, err = geomech("sweep", *args, cwd=tmp_path)
    assert code == 0
    assert err.endswith("set aside as " + partial.name + ".set-aside\n")


def test_a_sweep_killed_in_the_middle_is_taken_up(tmp_path):
    """SIGKILL while it computes, and while it saves: the next run has the same numbers, and leaves the target alone."""
    args = ["three-link-viscous", "--over", "gait.amplitude=0.5,1", "--over", "body.length=1:4:4", "-o", "s.nc"]
    script = """
import os, signal, sys
from geomech import cli
from geomech.study import kept, sweep
kept.SAVE_EVERY = 0
sweep.SAMPLES_TOGETHER = 2
append, done = kept.append, []
def killing(path, end, rows):
    done.append(end)
    if len(done) == 3:
        with path.open("ab") as file:
            file.write(b"half a block of rows")
        os.kill(os.getpid(), signal.SIGKILL)
    return append(path, end, rows)
kept.append = killing
cli.main()
"""
    first = subprocess.run([sys.executable, "-c", script, "sweep", *args], cwd=tmp_path)
    assert first.returncode == -signal.SIGKILL
    assert {p.name for p in tmp_path.iterdir()} == {".s.nc.partial", ".s.nc.lock"}
    assert len(rows_in(tmp_path / ".s.nc.partial")) == 4
    assert geomech("sweep", *args, cwd=tmp_path)[::2] == (0, "")
    assert [p.name for p in tmp_path.iterdir()] == ["s.nc"]


def test_the_command_writes_netcdf_and_a_plot(tmp_path):
    args = ["--over", "gait.amplitude=0.5:1.5:3", "--over", "medium.ratio=2,4", "-o", "s.nc", "--plot", "s.png"]
    code, out, err = geomech("sweep", "three-link-viscous", *args, cwd=tmp_path)
    assert (code, err) == (0, "")
    assert out.startswith("6 points")
    assert {p.name for p in tmp_path.iterdir()} == {"s.nc", "s.png"}
    with xarray.open_dataset(tmp_path / "s.nc") as data:
        assert data.displacement.dims == ("gait_amplitude", "medium_ratio", "component")
        found = data.displacement.sel(gait_amplitude=1.0, medium_ratio=2.0)
        assert float(np.hypot(*found[:2])) == pytest.approx(0.0512808243, abs=1e-9)
        units = {name: data[name].attrs["units"] for name in data.data_vars}
    assert units["displacement"] == "body length (x, y), rad (theta)"
    assert (units["estimate"], units["estimate_heading"]) == ("body length", "rad")


@pytest.mark.parametrize(
    ("over", "said"),
    [
        ({"gait.size": [1.0]}, "'size' is unknown"),
        ({"gait": [1.0]}, "name a parameter such as"),
        ({"effects.end-caps.radius": [0.1]}, "no effect 'end-caps'"),
        ({"body.length": [1.0, -1.0]}, "length must be a number from"),
        ({}, "must span 1 to"),
    ],
)
def test_bad_sweeps_are_refused_before_computing(over, said):
    with pytest.raises(SceneError, match=said):
        sweep.sweep(GLASS, over)


def test_an_unfinished_sweep_belongs_to_its_own_question(tmp_path, monkeypatch):
    """Another sweep to the same file leaves it, and has its own; the same command goes on with either."""
    rows = sweep._rows

    def ask(*amplitudes, stop=False):
        calls = []

        def stopping(at, amplitudes):
            calls.append(amplitudes)
            if stop and len(calls) == 2:
                raise terminal.Stopped(signal.SIGINT)
            return rows(at, amplitudes)

        monkeypatch.setattr(sweep, "_rows", stopping)
        over = "gait.amplitude=" + ",".join(map(str, amplitudes))
        return *geomech("sweep", "three-link-viscous", "--over", over, "-o", "s.nc", cwd=tmp_path)[::2], len(calls)

    monkeypatch.setattr(sweep, "SAMPLES_TOGETHER", 1)
    code, err, _ = ask(0.5, 1, stop=True)
    same = "1 of 2 points are kept in .s.nc.partial: the same command goes on from there: "
    assert (code, err) == (
        130,
        f"error: stopped by SIGINT: {same}geomech sweep three-link-viscous --over gait.amplitude=0.5,1 -o s.nc\n",
    )
    first = (tmp_path / ".s.nc.partial").read_bytes()
    code, err, _ = ask(0.6, 0.9, 1.2, stop=True)
    own = kept.beside(
        tmp_path / "s.nc", json.loads(next(tmp_path.glob(".s.nc.?*.partial")).read_bytes().split(b"\n")[0])["question"]
    ).name
    assert code == 130
    assert err.startswith("note: another sweep to s.nc is unfinished: ")
    assert f"1 of 3 points are kept in {own}: the same command goes on from there: geomech sweep" in err
    assert own != ".s.nc.partial"
    assert ask(0.6, 0.9, 1.2)[::2] == (0, 2)
    assert (tmp_path / ".s.nc.partial").read_bytes() == first
    assert {p.name for p in tmp_path.iterdir()} == {".s.nc.partial", "s.nc"}
    assert ask(0.5, 1) == (0, "", 1)
    assert {p.name for p in tmp_path.iterdir()} == {"s.nc"}


HOLDS = """
import sys
from pathlib import Path
from geomech.study import kept
with kept.alone(Path("s.nc")):
    print("ready", flush=True)
    sys.stdin.read()
"""


def test_two_sweeps_do_not_write_one_file_and_a_killed_one_is_no_obstacle(tmp_path):
    args = ["three-link-viscous", "--over", "gait.amplitude=0.5,1", "-o"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", HOLDS], cwd=tmp_path, **pipes) as other:
        assert other.stdout.readline() == b"ready\n"
        for name in ("s.nc", "../" + tmp_path.name + "/s.nc"):
            code, out, err = geomech("sweep", *args, name, cwd=tmp_path)
            assert (code, out) == (2, "")
            assert err.startswith(f"error: another sweep to {name} is under way: wait for it")
        assert geomech("sweep", *args, "t.nc", cwd=tmp_path)[::2] == (0, "")
        other.kill()
    assert {p.name for p in tmp_path.iterdir()} == {".s.nc.lock", "t.nc"}
    assert geomech("sweep", *args, "s.nc", cwd=tmp_path)[::2] == (0, "")
    assert {p.name for p in tmp_path.iterdir()} == {"s.nc", "t.nc"}


@pytest.mark.parametrize("kind", ["folder", "dangling"])
def test_a_lock_that_is_no_file_is_refused(kind, tmp_path):
    lock = tmp_path / ".s.nc.lock"
    lock.mkdir() if kind == "folder" else lock.symlink_to(tmp_path / "nothing")
    code, _, err = geomech("sweep", "three-link-viscous", "--over", "gait.amplitude=1", "-o", "s.nc", cwd=tmp_path)
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith("error: cannot keep a sweep beside s.nc: ")
    assert [p.name for p in tmp_path.iterdir()] == [".s.nc.lock"]
