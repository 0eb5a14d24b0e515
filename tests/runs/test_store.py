"""What is stored is read back to the last bit or not at all, whatever has become of the file; and nobody fails for its
sake."""

import errno
import os
import random
import sqlite3
import subprocess
import sys
import threading
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
import pytest

from geomech.run import runner as runners
from geomech.run import store
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
    """To the last bit, and of the same types."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, (tuple, list)):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    one, two = np.array(a), np.array(b)
    return (
        type(a) is type(b)
        and one.dtype == two.dtype
        and one.shape == two.shape
        and one.tobytes() == two.tobytes()
    )


def key(k):
    return k.to_bytes(32, "big")


def filled(path, count=20):
    """A file of so many results."""
    some = Store(path)
    for k in range(count):
        some.put(key(k), value(k), np.ndarray)
    some.close(done=False)
    return path


def value(k):
    return np.random.default_rng(k).normal(size=(8, 5))


def found(path, count=20):
    """How many of them are found; all are right."""
    some = Store(path)
    results = [some.get(key(k), np.ndarray) for k in range(count)]
    some.close(done=False)
    assert all(x is None or same(x[0], value(k)) for k, x in enumerate(results))
    return sum(x is not None for x in results)


@pytest.mark.parametrize("kind", HARD)
def test_results_come_back_to_the_last_bit(kind, tmp_path):
    assert same(decode(encode(HARD[kind]), kind), HARD[kind])
    for _ in range(2):
        some = Store(tmp_path / "p")
        some.put(key(1), HARD[kind], kind)
        some.close(done=False)
        some = Store(tmp_path / "p")
        assert same(some.get(key(1), kind)[0], HARD[kind])
        some.close(done=False)


def test_what_is_no_data_is_not_stored_and_another_type_than_declared_is_an_error(
    tmp_path,
):
    some = Store(tmp_path / "p")
    some.put(key(1), lambda: 0, float)
    assert some.get(key(1), float) is None
    with pytest.raises(TypeError, match="a task declares"):
        some.put(key(2), "text", np.ndarray)
    some.put(key(3), 1.5, float)
    assert some.get(key(3), str) is None and some.get(key(3), float) == (1.5,)
    some.close(done=True)
    assert list(tmp_path.iterdir()) == []


def test_a_request_that_is_soon_done_touches_no_disk(tmp_path):
    some = Store(tmp_path / "new" / "p")
    some.put(key(1), 1.0, float)
    assert some.get(key(1), float) == (1.0,) and list(tmp_path.iterdir()) == []
    some.close(done=False)
    assert [p.name for p in tmp_path.rglob("*")] == ["new", "p"]
    Store(tmp_path / "new" / "p").close(done=True)
    assert [p.name for p in tmp_path.rglob("*")] == ["new"]


def test_what_is_there_is_kept_by_a_request_that_adds_nothing(tmp_path):
    path = filled(tmp_path / "p")
    Store(path).close(done=False)
    assert found(path) == 20
    held = Store(tmp_path / "q", hold=True)
    held.close(done=False)
    assert [p.name for p in tmp_path.iterdir()] == ["p"]


def test_one_at_a_time(tmp_path):
    first = Store(tmp_path / "p", hold=True)
    assert first.db.execute("PRAGMA busy_timeout").fetchone() == (
        0,
    )  # none waits for the other
    for again in (
        lambda: Store(tmp_path / "p", hold=True),
        lambda: _elsewhere(tmp_path / "p"),
    ):
        with pytest.raises(Refusal, match="another computation has .*p open"):
            again()
    second = Store(tmp_path / "p")  # which need not store
    assert second.lost
    second.put(key(1), 1.0, float)
    second.close(done=False)
    first.put(key(1), 2.0, float)
    first.close(done=False)
    assert Store(tmp_path / "p").get(key(1), float) == (2.0,)


def _elsewhere(path):
    code = f"from pathlib import Path; from geomech.run.store import Store; Store(Path({str(path)!r}), hold=True)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    raise Refusal(done.stderr.splitlines()[-1])


def test_the_mark_of_a_file_stays(tmp_path):
    some = Store(tmp_path / "p", mark=1)
    some.put(key(1), 1.0, float)
    some.close(done=False)
    assert Store(tmp_path / "p", mark=0).mark == 1
    assert Store(tmp_path / "q", mark=0).mark == 0


@pytest.mark.parametrize("count", [20, 2000])
def test_no_flipped_bit_is_believed(count, tmp_path, capsys):
    """Of a file of a few pages, and of one with a deep index: what is found is right, the rest is computed again."""
    raw, random_ = filled(tmp_path / "p", count).read_bytes(), random.Random(0)
    counts = []
    for _ in range(300 if count == 20 else 10):
        flipped = bytearray(raw)
        flipped[random_.randrange(len(raw))] ^= 1 << random_.randrange(8)
        (tmp_path / "p").write_bytes(flipped)
        counts.append(found(tmp_path / "p", count))
    assert max(counts) == count and np.mean(np.array(counts) >= 0.9 * count) > 0.5
    said = capsys.readouterr().err.splitlines()
    assert all(
        line.startswith(f"note: {tmp_path / 'p'} cannot be resumed, it is ")
        for line in said
    )
    assert len(said) == len(list(tmp_path.glob("p.unreadable*")))


@pytest.mark.parametrize("place", [18, 60])
def test_every_bit_of_the_header_may_be_flipped(place, tmp_path):
    """That of the version that may write, and that of the mark, which is then none."""
    raw = filled(tmp_path / "p").read_bytes()
    for bit in range(8):
        flipped = bytearray(raw)
        flipped[place] ^= 1 << bit
        (tmp_path / "p").write_bytes(flipped)
        with runners.store_results(tmp_path / "p", keep=True) as runner:
            runner.store.put(key(0), value(0), np.ndarray)
            runner.store.commit()
            assert not runner.store.lost
        assert found(tmp_path / "p", 1) == 1


@pytest.mark.parametrize("column", ["value", "checksum"])
@pytest.mark.parametrize("other", ["NULL", "7", "1.5", "'text'"])
def test_a_value_that_is_none_of_ours_is_damage(column, other, tmp_path, capsys):
    with sqlite3.connect(filled(tmp_path / "p")) as file:
        file.execute(f"UPDATE result SET {column} = {other}")
    file.close()
    some = Store(tmp_path / "p")
    assert some.get(key(3), np.ndarray) is None
    some.put(key(3), value(3), np.ndarray)
    some.close(done=False)
    assert found(tmp_path / "p", 4) == 1 and (tmp_path / "p.unreadable").exists()


@pytest.mark.parametrize(
    "parts",
    [("O8", [1], b"x" * 8), (["<f8"], [1], b"x" * 8), ("<f8", [2], b"x" * 8),
     ("<f8", 1, b"x" * 8), ("<f8,", [1], b"x" * 8), ("<U999999999", [1], b""), 3],
)  # fmt: skip
def test_a_value_that_is_no_array_is_not_read(parts):
    raw = msgspec.msgpack.encode(
        msgspec.msgpack.Ext(store.ARRAY_CODE, msgspec.msgpack.encode(parts))
    )
    with pytest.raises(store.UNREADABLE):
        decode(raw, np.ndarray)
    nested = b"\x91" * 100_000 + b"\x01"
    with pytest.raises(store.UNREADABLE):
        decode(nested, object)


@pytest.mark.parametrize(
    "damage", ["cut", "index", "text", "empty", "other program", "other table"]
)
def test_a_damaged_or_foreign_file_is_renamed_and_another_begun(
    damage, tmp_path, capsys
):
    path = filled(tmp_path / "p", 2000)
    raw = path.read_bytes()
    if damage in ("other program", "other table"):
        path.unlink()
        with sqlite3.connect(path) as other:
            other.execute("CREATE TABLE mine (x)")
            if damage == "other table":
                other.execute(f"PRAGMA application_id = {store.APPLICATION_ID}")
        other.close()
        raw = path.read_bytes()
    else:
        raw = {
            "cut": raw[:-5000],
            "index": raw[:4096] + bytes(8192) + raw[12288:],
            "text": b"a scene\n",
            "empty": b"",
        }[damage]
        path.write_bytes(raw)
    for _ in range(2):
        some = Store(path)
        for k in range(2000):
            some.get(key(k), np.ndarray)
        some.put(key(1), value(1), np.ndarray)
        some.close(done=False)
        assert found(path, 2) >= 1
    said = capsys.readouterr().err
    if damage == "empty":
        assert said == ""
    else:
        assert said.endswith(": renamed to p.unreadable\n") and said.count("\n") == 1
        assert (tmp_path / "p.unreadable").read_bytes() == raw


def test_a_full_disk_is_said_once_and_what_is_there_stays(
    tmp_path, capsys, monkeypatch
):
    path = filled(tmp_path / "p", 10)
    monkeypatch.setattr(store, "CHECKPOINT", -1.0)
    some = Store(path)
    (pages,) = some.db.execute("PRAGMA page_count").fetchone()
    some.db.execute(f"PRAGMA max_page_count = {pages}")
    for k in range(10, 200):
        some.put(key(k), value(k), np.ndarray)
    assert some.lost and not some.new
    some.close(done=False)
    said = capsys.readouterr().err
    assert said.startswith(
        f"note: what is done is not kept in {path}: database or disk is full"
    )
    assert said.count("\n") == 1
    assert found(path, 200) >= 10


def test_a_file_that_may_grow_no_more_is_said_once(tmp_path):
    """By the system's own limit, in a process of its own."""
    code = f"""if True:
        import resource, sys
        sys.path[:0] = {[str(Path(__file__).parent)]!r}
        from test_store import *
        store.CHECKPOINT = -1.0
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
        some = Store(Path({str(tmp_path / "p")!r}))
        for k in range(300):
            some.put(key(k), value(k), np.ndarray)
        some.close(done=False)
        print(some.lost)
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (
        0,
        "True\n",
        1,
    ), done.stderr
    assert done.stderr.startswith(
        f"note: what is done is not kept in {tmp_path / 'p'}: "
    )
    assert found(tmp_path / "p", 300) > 5


def test_a_file_system_without_locks_is_said_once(tmp_path, capsys, monkeypatch):
    class Connection(sqlite3.Connection):
        def execute(self, sql, *arguments):
            if sql.startswith("BEGIN"):
                error = sqlite3.OperationalError("locking protocol")
                error.sqlite_errorcode = sqlite3.SQLITE_PROTOCOL
                raise error
            return super().execute(sql, *arguments)

    real = sqlite3.connect
    monkeypatch.setattr(
        sqlite3,
        "connect",
        lambda *some, **options: real(*some, factory=Connection, **options),
    )
    some = Store(tmp_path / "p", hold=True)
    some.put(key(1), 1.0, float)
    some.close(done=False)
    assert (
        capsys.readouterr().err
        == f"note: what is done is not kept in {tmp_path / 'p'}: locking protocol\n"
    )


def test_a_folder_that_cannot_be_written_is_said_once(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    some = Store(tmp_path / "file" / "p")
    some.put(key(1), 1.0, float)
    some.close(done=False)
    said = capsys.readouterr().err
    assert (
        said.startswith("note: what is done is not kept in ")
        and os.strerror(errno.EEXIST) in said
    )


@pytest.mark.parametrize("kind", ["fifo", "folder", "device", "dangling"])
def test_what_is_no_file_is_refused(kind, tmp_path):
    path = tmp_path / "p"
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero" if kind == "device" else tmp_path / "nothing")
    with pytest.raises(Refusal, match="it is no ordinary file; remove it"):
        Store(path)


def test_a_file_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "LARGEST", 5000)
    assert 10 < found(filled(tmp_path / "p", 100), 100) < 20


def test_another_thread_may_store(tmp_path):
    some = Store(tmp_path / "p", hold=True)
    thread = threading.Thread(target=some.put, args=(key(1), 1.0, float))
    thread.start()
    thread.join()
    some.close(done=False)
    assert Store(tmp_path / "p").get(key(1), float) == (1.0,)


@pytest.mark.parametrize("folder", [".", "out", "a/b", "there"])
def test_what_is_kept_for_a_folder_is_in_or_beside_it(folder, tmp_path, monkeypatch):
    (tmp_path / "there").mkdir()
    monkeypatch.chdir(tmp_path)
    places = {
        ".": f".{tmp_path.name}.partial",
        "out": ".out.partial",
        "a/b": ".a-b.partial",
    }
    place = Path(places.get(folder, "there/.there.partial"))
    assert partial_file(Path(folder)) == place
    assert partial_file(Path(folder).absolute()) == place.absolute()


def test_names_of_one_file_keep_one_file(tmp_path):
    """Links to it, also those to a file that is not there yet; and names as long as may be."""
    (tmp_path / "there").mkdir()
    for k, real in enumerate((tmp_path / "there" / "a.nc", tmp_path / "b.nc")):
        link = tmp_path / f"link{k}.nc"
        link.symlink_to(real)
        assert (
            partial_file(link)
            == partial_file(real)
            == partial_file(tmp_path / "there" / ".." / real.relative_to(tmp_path))
        )
    for length in (255, 246):
        name = "a" * (length - 3) + ".nc"
        filled(partial_file(tmp_path / name)).with_name(name).touch()
        assert partial_file(tmp_path / name) != partial_file(
            tmp_path / ("b" + name[1:])
        )


def test_the_cache_is_the_users(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_file(key(0)) == tmp_path / "geomech" / f"{'0' * 16}.partial"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_file(key(0)).is_relative_to(tmp_path / "home")
    monkeypatch.setenv("XDG_CACHE_HOME", "somewhere")
    assert cache_file(key(0)) is None
