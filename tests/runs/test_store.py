"""What is stored is read back to the last bit or not at all, whatever became of the
file; and nobody fails for its sake."""

import os
import random
import sqlite3
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
import pytest

from geomech.runs import store
from geomech.runs.store import Store, cache_file, decode, partial_file
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
    for _ in range(2):
        stored = Store(tmp_path / "new" / "p")
        stored.put(key(1), HARD[kind], kind)
        stored.close(done=False)
        again = Store(tmp_path / "new" / "p")
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
    stored.close(done=True)
    assert names(tmp_path) == []


def test_one_at_a_time(tmp_path):
    first = Store(tmp_path / "p", hold=True)
    with pytest.raises(Refusal, match="another computation has .*p open"):
        Store(tmp_path / "p", hold=True)
    assert put(tmp_path / "p", 1)  # another, which need not store
    first.close(done=False)
    assert names(tmp_path) == []  # nothing was stored


@pytest.mark.parametrize(("count", "flips"), [(20, 300), (2000, 5)])
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
    assert len(said) == len(list(tmp_path.glob("p.unreadable*")))


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


def other_program(path):
    path.unlink()
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE mine (x)")
    other.close()
    return path.read_bytes()


DAMAGE = {
    "cut": lambda path: path.read_bytes()[:-5000],
    "index": lambda path: (
        path.read_bytes()[:4096] + bytes(8192) + path.read_bytes()[12288:]
    ),
    "text": lambda path: b"a scene\n",
    "other program": other_program,
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_or_foreign_file_is_renamed_and_another_begun(
    damage, tmp_path, capsys
):
    path = filled(tmp_path / "p", 2000)
    raw = DAMAGE[damage](path)
    path.write_bytes(raw)
    found(path, 2000)
    put(path, 1)
    assert found(path, 2) >= 1
    assert capsys.readouterr().err.endswith(": renamed to p.unreadable\n")
    assert (tmp_path / "p.unreadable").read_bytes() == raw


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
    assert capsys.readouterr().err.count("database or disk is full") == 1
    assert found(path, 200) >= 10


def test_a_folder_that_cannot_be_written_is_said_once(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    put(tmp_path / "file" / "p", 1)
    assert capsys.readouterr().err.startswith("note: results are not stored in ")


NO_FILES = {
    "fifo": os.mkfifo,
    "folder": Path.mkdir,
    "device": lambda path: path.symlink_to("/dev/zero"),
    "dangling": lambda path: path.symlink_to("nothing"),
}


@pytest.mark.parametrize("kind", NO_FILES)
def test_what_is_no_file_is_refused(kind, tmp_path):
    NO_FILES[kind](tmp_path / "p")
    with pytest.raises(Refusal, match="it is not an ordinary file; remove it"):
        Store(tmp_path / "p")


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


@pytest.mark.parametrize("length", [255, 246])
def test_names_may_be_as_long_as_the_file_system_takes(length, tmp_path):
    name = "a" * (length - 3) + ".nc"
    filled(partial_file(tmp_path / name)).with_name(name).touch()
    assert partial_file(tmp_path / name) != partial_file(tmp_path / f"b{name[1:]}")


def test_the_cache_is_the_users(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_file(key(0)) == tmp_path / "geomech" / f"{'0' * 16}.partial"
    monkeypatch.setenv("XDG_CACHE_HOME", "somewhere")
    assert cache_file(key(0)) is None
