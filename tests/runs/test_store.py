"""What is stored is read back to the last bit or not at all, whatever became of the
file; and nobody fails for its sake."""

import errno
import os
import random
import sqlite3
import threading
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
import pytest

from geomech.run import store
from geomech.run.runner import store_results
from geomech.run.store import Store, cache_file, decode, encode, partial_file
from rft.core.refusal import Refusal


class Row(NamedTuple):
    x: np.ndarray
    more: tuple[np.ndarray, ...] | None


HARD = {
    np.ndarray: np.array([[np.nan, -0.0, np.inf], [1e-310, 1 / 3, -5.0]]),
    tuple[np.ndarray, float, int]: (np.zeros((0, 3)), 0.1 + 0.2, 7),
    list[Row]: [
        Row(np.array(2.5), None),
        Row(np.arange(3), (np.array([True]), np.array(["a", "bc"]))),
    ],
    dict[str, list[float]]: {"x": [np.nan, -np.inf]},
    tuple[float, str | None]: (5e-324, None),
}


def same(a, b):
    """Return whether two values are equal to the last bit, and of the same types."""
    if type(a) is not type(b):
        return False
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(map(same, a, b))
    one = np.array(a)
    two = np.array(b)
    is_alike = one.dtype == two.dtype and one.shape == two.shape
    return is_alike and one.tobytes() == two.tobytes()


def key(k):
    return k.to_bytes(32, "big")


def value(k):
    return np.random.default_rng(k).normal(size=(8, 5))


def put(path, *numbers):
    """Store the values of some numbers; return whether that was given up."""
    stored = Store(path)
    for k in numbers:
        stored.put(key(k), value(k), np.ndarray)
    stored.close(done=False)
    return stored.lost


def filled(path, count=20):
    put(path, *range(count))
    return path


def found(path, count=20):
    """Return how many of the values are found; all are right."""
    stored = Store(path)
    results = [stored.get(key(k), np.ndarray) for k in range(count)]
    stored.close(done=False)
    assert all(x is None or same(x[0], value(k)) for k, x in enumerate(results))
    return sum(x is not None for x in results)


def names(folder):
    return sorted(p.name for p in folder.rglob("*"))


@pytest.mark.parametrize("kind", HARD)
def test_results_come_back_to_the_last_bit(kind, tmp_path):
    assert same(decode(encode(HARD[kind]), kind), HARD[kind])
    for _ in range(2):
        stored = Store(tmp_path / "p")
        stored.put(key(1), HARD[kind], kind)
        stored.close(done=False)
        again = Store(tmp_path / "p")
        assert same(again.get(key(1), kind)[0], HARD[kind])
        again.close(done=False)


def test_only_data_of_the_declared_type_is_stored(tmp_path):
    stored = Store(tmp_path / "p")
    stored.put(key(1), lambda: 0, float)
    assert stored.get(key(1), float) is None
    with pytest.raises(TypeError, match="a task declares"):
        stored.put(key(2), "text", np.ndarray)
    stored.put(key(3), 1.5, float)
    assert stored.get(key(3), str) is None
    assert stored.get(key(3), float) == (1.5,)
    stored.close(done=True)
    assert names(tmp_path) == []


def test_a_file_begins_with_the_first_write_and_ends_with_the_request(tmp_path):
    path = tmp_path / "new" / "p"
    stored = Store(path)
    stored.put(key(1), 1.0, float)
    assert stored.get(key(1), float) == (1.0,)
    assert names(tmp_path) == []
    stored.close(done=False)
    assert names(tmp_path) == ["new", "p"]
    again = Store(path)
    assert again.get(key(1), float) == (1.0,)
    again.close(done=True)
    assert names(tmp_path) == ["new"]


def test_a_file_that_stays_without_results_is_removed(tmp_path):
    Store(tmp_path / "p", hold=True).close(done=False)
    assert names(tmp_path) == []


def test_one_at_a_time(tmp_path):
    first = Store(tmp_path / "p", hold=True)
    with pytest.raises(Refusal, match="another computation has .*p open"):
        Store(tmp_path / "p", hold=True)
    assert put(tmp_path / "p", 1)  # another, which need not store
    first.put(key(1), 2.0, float)
    first.close(done=False)
    assert Store(tmp_path / "p").get(key(1), float) == (2.0,)


@pytest.mark.parametrize(("count", "flips"), [(20, 300), (2000, 10)])
def test_no_flipped_bit_is_believed(count, flips, tmp_path, capsys):
    """In a file of a few pages, and in one with a deep index."""
    raw = filled(tmp_path / "p", count).read_bytes()
    rng = random.Random(0)
    counts = []
    for _ in range(flips):
        flipped = bytearray(raw)
        flipped[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
        (tmp_path / "p").write_bytes(flipped)
        counts.append(found(tmp_path / "p", count))
    assert max(counts) == count
    assert np.mean(np.array(counts) >= 0.9 * count) > 0.5
    said = capsys.readouterr().err.splitlines()
    note = f"note: {tmp_path / 'p'} cannot be resumed, it is "
    assert all(line.startswith(note) for line in said)
    assert len(said) == len(list(tmp_path.glob("p.unreadable*")))


@pytest.mark.parametrize("place", [18, 60], ids=["version", "mark"])
@pytest.mark.parametrize("bit", range(8))
def test_every_bit_of_the_header_may_be_flipped(place, bit, tmp_path):
    flipped = bytearray(filled(tmp_path / "p").read_bytes())
    flipped[place] ^= 1 << bit
    (tmp_path / "p").write_bytes(flipped)
    with store_results(tmp_path / "p", keep=True) as runner:
        runner.store.put(key(0), value(0), np.ndarray)
        runner.store.commit()
        assert not runner.store.lost
    assert found(tmp_path / "p", 1) == 1


@pytest.mark.parametrize("column", ["value", "checksum"])
@pytest.mark.parametrize("other", ["NULL", "7", "1.5", "'text'"])
def test_a_value_of_another_type_is_damage(column, other, tmp_path):
    with sqlite3.connect(filled(tmp_path / "p")) as file:
        file.execute(f"UPDATE result SET {column} = {other}")
    file.close()
    stored = Store(tmp_path / "p")
    assert stored.get(key(3), np.ndarray) is None
    stored.put(key(3), value(3), np.ndarray)
    stored.close(done=False)
    assert found(tmp_path / "p", 4) == 1
    assert (tmp_path / "p.unreadable").exists()


def extension(*parts):
    code = store.ARRAY_CODE
    return msgspec.msgpack.encode(
        msgspec.msgpack.Ext(code, msgspec.msgpack.encode(parts))
    )


@pytest.mark.parametrize(
    "raw",
    [
        extension("O8", [1], b"x" * 8),
        extension(["<f8"], [1], b"x" * 8),
        extension("<f8", [2], b"x" * 8),
        extension("<f8", 1, b"x" * 8),
        extension("<f8,", [1], b"x" * 8),
        extension("<U999999999", [1], b""),
        extension(3),
        b"\x91" * 100_000 + b"\x01",
    ],
)
def test_a_value_that_is_no_array_is_not_read(raw):
    with pytest.raises(store.UNREADABLE):
        decode(raw, np.ndarray)


def other_program(path, application_id=0):
    path.unlink()
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE mine (x)")
        other.execute(f"PRAGMA application_id = {application_id}")
    other.close()
    return path.read_bytes()


DAMAGE = {
    "cut": lambda path: path.read_bytes()[:-5000],
    "index": lambda path: (
        path.read_bytes()[:4096] + bytes(8192) + path.read_bytes()[12288:]
    ),
    "text": lambda path: b"a scene\n",
    "other program": other_program,
    "other table": lambda path: other_program(path, store.APPLICATION_ID),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_or_foreign_file_is_renamed_and_another_begun(
    damage, tmp_path, capsys
):
    path = filled(tmp_path / "p", 2000)
    raw = DAMAGE[damage](path)
    path.write_bytes(raw)
    for _ in range(2):
        found(path, 2000)
        put(path, 1)
        assert found(path, 2) >= 1
    said = capsys.readouterr().err
    assert said.endswith(": renamed to p.unreadable\n")
    assert said.count("\n") == 1
    assert (tmp_path / "p.unreadable").read_bytes() == raw


def test_an_empty_file_is_used_without_a_word(tmp_path, capsys):
    (tmp_path / "p").touch()
    put(tmp_path / "p", 1)
    assert found(tmp_path / "p", 2) == 1
    assert capsys.readouterr().err == ""


def assert_given_up(path, reason, capsys):
    said = capsys.readouterr().err
    assert said.startswith(f"note: what is done is not kept in {path}: {reason}")
    assert said.count("\n") == 1


def test_a_full_disk_is_said_once_and_earlier_results_stay(
    tmp_path, capsys, monkeypatch
):
    path = filled(tmp_path / "p", 10)
    monkeypatch.setattr(store, "CHECKPOINT", -1.0)
    stored = Store(path)
    (pages,) = stored.db.execute("PRAGMA page_count").fetchone()
    stored.db.execute(f"PRAGMA max_page_count = {pages}")
    for k in range(10, 200):
        stored.put(key(k), value(k), np.ndarray)
    assert stored.lost
    stored.close(done=False)
    assert_given_up(path, "database or disk is full", capsys)
    assert found(path, 200) >= 10


def test_a_file_system_without_locks_is_said_once(tmp_path, capsys, monkeypatch):
    class WithoutLocks(sqlite3.Connection):
        def execute(self, sql, *arguments):
            if sql.startswith("BEGIN"):
                error = sqlite3.OperationalError("locking protocol")
                error.sqlite_errorcode = sqlite3.SQLITE_PROTOCOL
                raise error
            return super().execute(sql, *arguments)

    connect = sqlite3.connect

    def connect_without(*arguments, **options):
        return connect(*arguments, factory=WithoutLocks, **options)

    monkeypatch.setattr(sqlite3, "connect", connect_without)
    stored = Store(tmp_path / "p", hold=True)
    stored.put(key(1), 1.0, float)
    stored.close(done=False)
    assert_given_up(tmp_path / "p", "locking protocol\n", capsys)


def test_a_folder_that_cannot_be_written_is_said_once(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "p"
    put(path, 1)
    assert_given_up(path, f"[Errno {errno.EEXIST}] {os.strerror(errno.EEXIST)}", capsys)


NO_FILES = {
    "fifo": os.mkfifo,
    "folder": Path.mkdir,
    "device": lambda path: path.symlink_to("/dev/zero"),
    "dangling": lambda path: path.symlink_to("nothing"),
}


@pytest.mark.parametrize("kind", NO_FILES)
def test_what_is_no_file_is_refused(kind, tmp_path):
    NO_FILES[kind](tmp_path / "p")
    with pytest.raises(Refusal, match="it is no ordinary file; remove it"):
        Store(tmp_path / "p")


def test_a_file_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "LARGEST", 5000)
    assert 10 < found(filled(tmp_path / "p", 100), 100) < 20


def test_another_thread_may_store(tmp_path):
    stored = Store(tmp_path / "p", hold=True)
    thread = threading.Thread(target=stored.put, args=(key(1), 1.0, float))
    thread.start()
    thread.join()
    stored.close(done=False)
    assert Store(tmp_path / "p").get(key(1), float) == (1.0,)


@pytest.mark.parametrize(
    ("folder", "place"),
    [
        ("here", "here/.here.partial"),
        ("here/there", "here/.there.partial"),
        ("a/b", ".a-b.partial"),
    ],
)
def test_results_for_a_folder_are_kept_in_or_beside_it(
    folder, place, tmp_path, monkeypatch
):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path)
    assert partial_file(Path(folder)) == Path(place)
    assert partial_file(Path(folder).absolute()) == tmp_path / place
    monkeypatch.chdir("here")
    assert partial_file(Path()) == Path(".here.partial")


@pytest.mark.parametrize("real", ["there/a.nc", "b.nc"])
def test_all_names_of_an_output_keep_one_file(real, tmp_path):
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.nc"
    link.symlink_to(tmp_path / real)
    place = partial_file(tmp_path / real)
    assert partial_file(link) == place
    assert partial_file(tmp_path / "there" / ".." / real) == place


@pytest.mark.parametrize("length", [255, 246])
def test_names_may_be_as_long_as_the_file_system_takes(length, tmp_path):
    name = "a" * (length - 3) + ".nc"
    filled(partial_file(tmp_path / name)).with_name(name).touch()
    assert partial_file(tmp_path / name) != partial_file(tmp_path / f"b{name[1:]}")


def test_the_cache_is_the_users(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_file(key(0)) == tmp_path / "geomech" / f"{'0' * 16}.partial"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_file(key(0)).is_relative_to(tmp_path / "home")
    monkeypatch.setenv("XDG_CACHE_HOME", "somewhere")
    assert cache_file(key(0)) is None
