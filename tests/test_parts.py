"""What workers give is kept when a request is stopped, and taken up again: to the last digit, and nothing else."""

import contextlib
import dataclasses
import io
import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from parts import doubled, who
from test_cli import geomech

from geomech import connection, terminal, workers
from geomech import scene as scenes
from geomech.commands.asked import keeping
from geomech.errors import SceneError
from geomech.optimise import checked, search
from geomech.study import accuracy, cost, kept, parts
from geomech.study.bench import Study
from geomech.study.parts import Parts, asking, mark

ASKED = {"geomech": "1", "solver": 1, "command": "test"}
GLASS, VISCOUS = scenes.load("three-link-glass"), scenes.load("three-link-viscous")
HARD = (
    np.array([[np.nan, -0.0, np.inf], [1e-310, 1 / 3, -5.0]]),
    (np.zeros((0, 3)), 0.1 + 0.2, 7),
    np.array(2.5),
    (),
    None,
)


def hard(_, x):
    return (*HARD, float(x))


def fails(by, x):
    if x == 2 / 7:
        raise ValueError("no such thing")
    return by * x


def within(by, x):
    """A part that asks for parts itself."""
    return sum(workers.each(doubled, by, [x, x], 2))


def calls(f=doubled, of=(3, 2)):
    """Requests of some parts each."""
    return [x for k, count in enumerate(of) for x in workers.each(f, np.array([k + 1.0]), np.arange(count) / 7, count)]


@contextlib.contextmanager
def counted(stop=None):
    """What is computed, in a list; stopped by a signal after so many."""
    computed, real = [], workers._computed

    def counting(*args):
        for x in real(*args):
            if workers._keeper.get():
                if len(computed) == stop:
                    raise terminal.Stopped(signal.SIGTERM)
                computed.append(x)
            yield x

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(workers, "_computed", counting)
        yield computed


def asked(path, ask=calls, question=ASKED):
    """(what it gives, how many parts of it are computed), with what is kept."""
    with counted() as computed, Parts(path, question) as some, workers.keeping(some):
        return ask(), len(computed)


def stopped(path, after, ask=calls, question=ASKED):
    """What the stop says."""
    with pytest.raises(terminal.Stopped) as ended, counted(after), Parts(path, question) as some, workers.keeping(some):
        ask()
    return "".join(getattr(ended.value, "__notes__", ""))


def same(a, b):
    """To the last bit, whatever they are made of."""
    if isinstance(a, (tuple, list)):
        return isinstance(b, type(a)) and len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and np.shape(a) == np.shape(b) and np.array(a).tobytes() == np.array(b).tobytes()


@pytest.mark.parametrize("f", [doubled, hard, within])
def test_what_is_stopped_goes_on_where_it_was(f, tmp_path):
    ask, path = lambda: calls(f), tmp_path / "p"
    whole = ask()
    for stop in (1, 2, 3, 4):
        said = stopped(path, stop, ask)
        assert (
            said
            == f"{stop} of {3 if stop < 3 else 5} parts so far are kept in {path}: the same command goes on from there"
        )
        again, computed = asked(path, ask)
        assert computed == 5 - stop and same(again, whole)
        path.unlink()


def test_a_request_that_ends_well_or_is_refused_soon_leaves_nothing(tmp_path):
    assert asked(tmp_path / "p")[1] == 5
    with pytest.raises(ValueError, match="no such"):
        asked(tmp_path / "p", lambda: calls(fails, (5,)))
    assert list(tmp_path.iterdir()) == []


def test_what_took_long_is_kept_whatever_ends_it(tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "SAVE_EVERY", 0.0)
    with pytest.raises(ValueError, match="no such") as ended:
        asked(tmp_path / "p", lambda: calls() + calls(fails, (5,)))
    assert ended.value.__notes__[0].startswith("7 of 10 parts so far are kept")
    assert asked(tmp_path / "p")[1] == 0


def test_parts_of_something_else_are_computed_again(tmp_path):
    path, whole = tmp_path / "p", calls()
    stopped(path, 4)
    assert asked(path, lambda: calls(hard))[1] == 5
    assert asked(path, lambda: calls(of=(2, 2)))[1] == 2 + 1
    own = parts.Part(0, 0, 3, 1, 0, mark((doubled, np.array([1.0]))), 0)
    for change in ({"parts": 4}, {"by": 2}, {"of": 0}, {"at": 0}, {"call": 2}, {"number": 3}, {}):
        with Parts(tmp_path / "q", ASKED) as some:
            for number in range(3):
                said = {"number": number, "at": mark(np.float64(number / 7)), **change}
                some._add(own._replace(**said), (doubled(np.array([1.0]), number / 7)))
            some.save(always=True)
        found, computed = asked(tmp_path / "q")
        assert computed == (5 if change else 2) and same(found, whole), change
        (tmp_path / "q").unlink()


def test_a_mark_is_that_of_values_and_not_of_where_they_are():
    a = np.arange(6.0).reshape(2, 3)
    assert mark(a) == mark(np.asfortranarray(a)) != mark(a.ravel()) != mark(a.ravel() + 1e-15)
    assert mark((VISCOUS.system.velocity, a)) == mark((scenes.load("three-link-viscous").system.velocity, a.copy()))
    other = VISCOUS.changed(medium=dataclasses.replace(VISCOUS.system.medium, ratio=2.0 + 1e-15))
    assert mark((VISCOUS.system.velocity,)) != mark((other.system.velocity,))
    assert mark((VISCOUS.system.velocity,)) != mark((VISCOUS.system.in_frame("mean").velocity,))
    assert len({mark((f,)) for f in ((lambda: 0), (lambda: 1))}) == 1


def test_a_back_end_goes_on(tmp_path, monkeypatch):
    """That of the first run, whatever lies ready in the second; what many parts have settled, others need not have."""
    ask = lambda: calls(of=(2, 5)) + [x[2] for x in workers.each(who, None, range(4), 4)]
    for k, (first, second) in enumerate((("numba", "numpy"), ("numpy", "numba"))):
        monkeypatch.setattr(workers, "at_hand", lambda first=first: first)
        stopped(tmp_path / str(k), 4, ask)
        monkeypatch.setattr(workers, "at_hand", lambda second=second: second)
        found, computed = asked(tmp_path / str(k), ask)
        assert computed == 7 and found[7:] == 4 * [first]
        assert ask()[7:] == 4 * [second]


def test_parts_of_others_are_kept_too(tmp_path, monkeypatch):
    """Of two processes, which go on with what one alone has left, and the other way round."""
    monkeypatch.setattr(workers, "WORTH", 0.0)
    ask, whole = lambda: calls(of=(8, 8)), calls(of=(8, 8))
    for first, second in ((2, 1), (1, 2)):
        with workers.using(first):
            stopped(tmp_path / str(first), 11, ask)
        with workers.using(second):
            found, computed = asked(tmp_path / str(first), ask)
        assert computed == 5 and same(found, whole)


def test_no_flipped_bit_is_believed(tmp_path):
    """Bits behind the question, and every cut: what is taken up is what was kept, or the beginning of it."""
    path = tmp_path / "p"
    stopped(path, 4)
    raw = path.read_bytes()
    whole = [*parts._index(io.BytesIO(raw), ASKED)[1].items()]
    start = raw.index(b'"settled"')
    flipped = [raw[:k] + bytes([raw[k] ^ 1 << k % 8]) + raw[k + 1 :] for k in range(start, len(raw))]
    found = []
    for some in [raw[:k] for k in range(len(raw))] + flipped:
        with contextlib.suppress(ValueError, TypeError, KeyError, AttributeError):
            found.append([*parts._index(io.BytesIO(some), ASKED)[1].items()])
    assert len(whole) == 4 and all(some == whole[: len(some)] for some in found)


def test_what_is_no_part_is_set_aside(tmp_path, capsys):
    """Numbers with a right checksum that are no results: a note, and nothing else."""
    own, rng = [0, 0, 3, 0, 0, 1, 2], np.random.default_rng(0)
    foreign = [[], own, [*own, 9, 1], [*own, 3, 1, 2**40], [*own, 0, 2**40, 1, 0], [*own, 3, 99, *[1] * 99, 0, 0]]
    foreign += [[*own, 2, -1.0], [*own, 2, 0.5], [*own, 2, np.nan], [*own, 3, 1, np.inf], [*own, 1, 5.0, 0.0]]
    foreign += [[*own[:3], 3, 0, 1, 2, 1, 5.0], [*own, *[0, 1] * 9_999, 1, 0.0]]
    sure = len(foreign)
    foreign += [[*own, *rng.choice([0, 1, 2, 3, 4, np.nan, 1e300], size)] for size in range(1, 20)]
    for k, numbers in enumerate(foreign):
        path = tmp_path / str(k)
        kept.append(path, kept.begin(path, ASKED), np.array(numbers, float))
        some = Parts(path, ASKED)
        said = capsys.readouterr().err
        assert bool(some.places) == (not said) and (said or k >= sure), numbers
        note = f"note: {path} is not taken up, it"
        assert not said or (said.startswith(note) and said.endswith(f": set aside as {k}.set-aside\n"))
        assert said.count("\n") <= 1


@pytest.mark.parametrize("every", [0.0, 9.0])
def test_what_a_file_takes_is_bounded(every, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(kept, "SAVE_EVERY", every)
    monkeypatch.setattr(parts, "LARGEST", 600)
    stopped(tmp_path / "p", 30, lambda: calls(of=(40,)))
    assert 500 < (tmp_path / "p").stat().st_size <= 600 + 250  # with the first line
    assert asked(tmp_path / "p", lambda: calls(of=(40,)))[1] >= 34
    monkeypatch.setattr(kept, "LARGEST", 1000)
    (tmp_path / "q").write_bytes(bytes(1601))
    assert Parts(tmp_path / "q", ASKED).places == {}
    assert "it is too large: set aside" in capsys.readouterr().err


def test_a_full_disk_fills_no_memory(tmp_path, monkeypatch, capsys):
    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(kept, "SAVE_EVERY", 0.0)
    with Parts(tmp_path / "p", ASKED) as some, workers.keeping(some):
        first = calls()
        monkeypatch.setattr(kept, "append", full)
        assert same(calls(), first) and some.fresh == []
    assert capsys.readouterr().err.count("note: what is done of the computation is not kept: ") == 1
    assert asked(tmp_path / "p")[1] == 0


def test_studies_go_on_to_the_last_digit(tmp_path, monkeypatch):
    """Error studies, searches from several starts, fields with what moving costs; seconds are those of the first time."""
    few = [dataclasses.replace(k, values=k.values[:2]) for k in accuracy.KNOBS if k.tier == "direct"]
    monkeypatch.setattr(accuracy, "KNOBS", few)
    monkeypatch.setattr(accuracy, "TRUTH_PHASES", 64)
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 100)
    scene = GLASS.with_numerics(grid=7, phases=32, harmonics=5)
    request = checked(VISCOUS.with_numerics(phases=32), "efficiency", harmonics=1, starts=2)

    def field():
        study = Study(scene)
        return [study.compute_metric().coefficients, study.fitted.A, study.fitted.residual]

    numbers = lambda: [json.dumps({**search(request).numbers(), "seconds": 0.0})]
    errors = lambda: [np.array(x["error"]) for x in accuracy.study(scene, runs=1)["lines"]]
    for ask, after, left in ((errors, 5, 7), (field, 4, 5), (numbers, 1, 1)):
        whole = ask()
        path = tmp_path / f"{after}"
        stopped(path, after, ask)
        again, computed = asked(path, ask)
        assert all(map(np.array_equal, again, whole)) and computed == left


@pytest.fixture
def fine(monkeypatch):
    """Small parts."""
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 40)


FIELD = ["connection", "three-link-viscous", "--grid", "9", "-o"]


def test_a_command_that_is_stopped_says_how_to_go_on(tmp_path, fine):
    assert geomech(*FIELD, "whole.nc", cwd=tmp_path)[0] == 0
    with counted() as all_of_it:
        geomech(*FIELD, "f.nc", cwd=tmp_path)
    with counted(4):
        code, out, err = geomech(*FIELD, "f.nc", cwd=tmp_path)
    said = "error: stopped by SIGTERM: 4 of "
    assert (code, out) == (143, "") and err.startswith(said)
    again = "parts so far are kept in .f.nc.partial: the same command goes on from there: geomech connection"
    assert f"{again} three-link-viscous --grid 9 -o f.nc\n" in err
    with counted() as computed:
        assert geomech(*FIELD, "f.nc", cwd=tmp_path)[::2] == (0, "")
    assert len(computed) == len(all_of_it) - 4
    assert (tmp_path / "f.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()
    assert {p.name for p in tmp_path.iterdir()} == {"f.nc", "whole.nc"}


COMMANDS = {
    "accuracy": ["-o", "out"],
    "ccf": ["--plot", "out.png"],
    "displacement": ["--amplitudes", "0.5", "--plot", "out.png"],
    "optimize": ["--for", "displacement", "--starts", "3", "--harmonics", "1", "--workers", "1", "-o", "out.toml"],
    "run": ["-o", "out"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_that_take_long_are_taken_up(command, tmp_path, fine, monkeypatch):
    monkeypatch.setattr(cost, "PILOT", 0.0)
    (tmp_path / "s.toml").write_text(VISCOUS.text + "[numerics]\nphases = 64\ngrid = 9\n")
    args = [command, "s.toml", *COMMANDS[command]]
    kept_of = []
    for _ in range(2):  # and neither is done again
        with counted(1) as computed:
            code, _, err = geomech(*args, cwd=tmp_path)
        (name,) = {p.name for p in tmp_path.iterdir()} - {"s.toml"}
        assert (code, len(computed), name) == (143, 1, f".{COMMANDS[command][-1]}.partial")
        assert f" are kept in {name}: " in err
        kept_of.append(int(re.match(r"error: stopped by SIGTERM: (\d+) of ", err)[1]))
    assert kept_of[1] == kept_of[0] + 1


def test_names_of_one_file_have_one_lock(tmp_path):
    """Links to it, also those to a file that is not there yet."""
    (tmp_path / "there").mkdir()
    for k, real in enumerate((tmp_path / "there" / "a.nc", tmp_path / "b.nc")):
        link = tmp_path / f"link{k}.nc"
        link.symlink_to(real)
        assert kept.beside(link, {"q": 1}) == kept.beside(real, {"q": 1})
        for first, second in ((real, link), (link, real)):
            with kept.alone(first), pytest.raises(SceneError, match="is under way: wait for it"), kept.alone(second):
                pass


def test_another_question_leaves_what_is_kept_alone(tmp_path, fine, monkeypatch):
    """Another grid, and a sweep, to the same file; the scene in another medium, of the same name, is another, too."""
    with counted(3):
        geomech(*FIELD, "f.nc", cwd=tmp_path)
    first = (tmp_path / ".f.nc.partial").read_bytes()
    other = [x.replace("9", "8") for x in FIELD]
    with counted(2):
        code, _, err = geomech(*other, "f.nc", cwd=tmp_path)
    assert code == 143 and "2 of " in err and ".f.nc.partial" not in err
    assert geomech(*other, "f.nc", cwd=tmp_path)[::2] == (0, "")
    assert geomech("sweep", "three-link-viscous", "--over", "gait.amplitude=1", "-o", "f.nc", cwd=tmp_path)[0] == 0
    assert {p.name for p in tmp_path.iterdir()} == {"f.nc", ".f.nc.partial"}
    assert (tmp_path / ".f.nc.partial").read_bytes() == first
    (tmp_path / ".f.nc.partial").write_bytes(first[:-3] + b"abc")
    code, _, err = geomech(*FIELD, "f.nc", cwd=tmp_path)
    assert code == 0
    aside = "it is damaged (checksum): set aside as .f.nc.partial.set-aside\n"
    assert err == f"note: .f.nc.partial is not taken up, {aside}"


def test_what_a_scene_is_read_from_belongs_to_the_question(tmp_path):
    """All that numbers follow from: its own text, its numerics, and what is in other files."""
    name = VISCOUS.text.replace('law = "viscous"', 'file = "m.toml"').replace("ratio = 2.0", "")
    (tmp_path / "s.toml").write_text(name)
    found = []
    for text in ("ratio = 2.0", "ratio = 3.0", "# ratio\nratio = 3.0"):
        (tmp_path / "m.toml").write_text(f'law = "viscous"\n{text}\n')
        scene = scenes.load(tmp_path / "s.toml")
        found += [asking(scene, command="run"), asking(scene.with_numerics(grid=9), command="run")]
    assert len(set(map(json.dumps, found))) == 6
    assert json.dumps(asking(scenes.load(tmp_path / "s.toml"), command="run")) == json.dumps(found[4])
    assert "files" not in asking(VISCOUS)


def test_two_do_not_write_one_file(tmp_path):
    with contextlib.chdir(tmp_path), kept.alone(Path("f.nc")):
        for args in (FIELD, ["sweep", "three-link-viscous", "--over", "gait.amplitude=1", "-o"]):
            code, out, err = geomech(*args, "f.nc")
            assert (code, out, err.count("\n")) == (2, "", 1) and " to f.nc is under way: wait for it" in err
    assert list(tmp_path.iterdir()) == []


def test_a_command_that_is_killed_is_taken_up(tmp_path, fine):
    """SIGKILL in the middle of writing."""
    script = """
import os, signal
from geomech import cli, connection
from geomech.study import kept
from rft import backend
kept.SAVE_EVERY, connection.SAMPLES_TOGETHER = 0, 40
backend.AUTO.worked = -1e9  # as in this process
append, done = kept.append, []
def killing(path, end, *blocks):
    done.append(end)
    if len(done) == 3:
        with path.open("ab") as file:
            file.write(b"half a part")
        os.kill(os.getpid(), signal.SIGKILL)
    return append(path, end, *blocks)
kept.append = killing
cli.main()
"""
    args = [*FIELD, "f.nc", "--workers", "1"]
    first = subprocess.run([sys.executable, "-c", script, *args], cwd=tmp_path, capture_output=True, text=True)
    assert (first.returncode, first.stderr) == (-signal.SIGKILL, "")
    assert {p.name for p in tmp_path.iterdir()} == {".f.nc.partial", ".f.nc.lock"}
    with counted() as all_of_it:
        assert geomech(*FIELD, "whole.nc", cwd=tmp_path)[0] == 0
    with counted() as computed:
        assert geomech(*args, cwd=tmp_path)[::2] == (0, "")
    assert len(computed) == len(all_of_it) - 2
    assert (tmp_path / "f.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()
    assert {p.name for p in tmp_path.iterdir()} == {"f.nc", "whole.nc"}


def as_command(output, large=True, stop=None, **known):
    """How many parts are computed by what a command does."""
    with counted(stop) as computed, keeping(VISCOUS, output, large, **{"command": "test", **known}):
        calls()
    return len(computed)


@pytest.mark.parametrize("output", ["f.nc", "out", "a/b", "there", None])
def test_what_a_command_keeps_is_there_until_it_ends_well(output, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    output = output and Path(output)
    with pytest.raises(terminal.Stopped) as ended:
        as_command(output, stop=2)
    (partial,) = tmp_path.rglob("*.partial")
    assert f" are kept in {partial.relative_to(tmp_path)}: " in ended.value.__notes__[0]
    assert as_command(output, amplitude=2.0) == 5
    assert as_command(output, large=False) == 3  # what is kept of it is large
    assert [p.name for p in tmp_path.rglob("*")] == ["there"]


def test_what_is_only_printed_is_no_obstacle_to_another(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with kept.alone(kept.printed(asking(VISCOUS, command="test"))):
        assert as_command(None, stop=None) == 0  # of which nothing is kept, so nothing is counted
    with pytest.raises(terminal.Stopped):
        as_command(None, stop=2)
    assert len(list(tmp_path.iterdir())) == 1


def test_small_requests_that_are_printed_make_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(kept, "alone", None)
    assert as_command(None, large=False) == 0


@pytest.mark.parametrize("folder", [".", "out", "a/b", "there"])
def test_folders_of_results_are_kept_in_or_beside(folder, tmp_path):
    (tmp_path / "there").mkdir()
    with contextlib.chdir(tmp_path):
        places = {".": tmp_path.name, "out": "out", "a/b": "a-b", "there": "there/there"}
        assert kept.stands_for(Path(folder)) == Path(places[folder])
        assert kept.stands_for(Path(folder).absolute()).absolute() == Path(places[folder]).absolute()
