"""Files on disk: whole or not at all, and nothing left behind, whatever happens to their writer."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import pytest

from geomech.io import files
from rft.core.refusal import Refusal

KILLED = """
import os, signal, sys
from pathlib import Path
from geomech.io import files
with getattr(files, sys.argv[1])(sys.argv[2]) as path:
    (path / "a.txt" if sys.argv[1] == "atomic_folder" else path).write_text("half")
    if sys.argv[3] == "wait":
        print("ready", flush=True)
        sys.stdin.read()
    os.kill(os.getpid(), getattr(signal, sys.argv[3]))
"""
WRITERS = ["atomic_file", "atomic_folder"]


def start(writer, target, how, **options):
    return subprocess.Popen(
        [sys.executable, "-c", KILLED, writer, str(target), how], **options
    )


def write(writer, target, text="new"):
    with getattr(files, writer)(target) as path:
        (path / "a.txt" if writer == "atomic_folder" else path).write_text(text)
    return target / "a.txt" if writer == "atomic_folder" else target


@pytest.mark.parametrize("writer", WRITERS)
def test_strays_of_a_kill_are_swept_by_the_next_writer(writer, tmp_path):
    for _ in range(2):
        assert start(writer, tmp_path / "out", "SIGKILL").wait() == -signal.SIGKILL
    assert [p.name.startswith(".geomech-") for p in tmp_path.iterdir()] == [
        True
    ]  # the second swept the first's
    assert start(writer, tmp_path / "another", "SIGKILL").wait() == -signal.SIGKILL
    assert write(writer, tmp_path / "out").read_text() == "new"
    assert (
        len(list(tmp_path.iterdir())) == 2
    )  # that of another target stays for its own


def test_a_stray_beside_a_folder_that_now_is_there(tmp_path):
    start("atomic_folder", tmp_path / "out", "SIGKILL").wait()
    (tmp_path / "out").mkdir()
    start("atomic_folder", tmp_path / "out", "SIGKILL").wait()
    write("atomic_folder", tmp_path / "out")
    assert [p.name for p in tmp_path.rglob("*")] == ["out", "a.txt"]


@pytest.mark.parametrize("writer", WRITERS)
def test_a_living_writer_keeps_its_folder(writer, tmp_path):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with start(writer, tmp_path / "out", "wait", **pipes) as living:
        assert living.stdout.readline() == "ready\n"
        write(writer, tmp_path / "out")
        assert len(list(tmp_path.iterdir())) == 2
        living.kill()


def test_what_is_not_ours_stays(tmp_path):
    """Names like ours, with a mark of something else, none, or behind a link; and an empty one that is not yet old."""
    prefix, target = files._prefix(tmp_path / "out"), tmp_path / "out"
    for name, words in (("other", b"mine"), ("empty", b""), ("none", None)):
        (tmp_path / (prefix + name)).mkdir()
        (tmp_path / (prefix + name) / "data").write_text("precious")
        if words is not None:
            (tmp_path / (prefix + name) / files.MARK).write_bytes(words)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / files.MARK).write_bytes(files._mark_text(target))
    (tmp_path / (prefix + "link")).symlink_to(tmp_path / "elsewhere")
    (tmp_path / (prefix + "file")).write_text("precious")
    (tmp_path / (prefix + "young")).mkdir()
    before = sorted(tmp_path.rglob("*"))
    files.sweep_strays(target)
    assert sorted(tmp_path.rglob("*")) == before
    old = time.time() - 2 * files.ABANDONED
    os.utime(tmp_path / (prefix + "young"), (old, old))
    files.sweep_strays(target)
    assert sorted(tmp_path.rglob("*")) == [
        p for p in before if not p.name.endswith("young")
    ]


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failure_leaves_what_was_there(writer, error, tmp_path):
    file = write(writer, tmp_path / "out", "old")

    def fail():
        with getattr(files, writer)(tmp_path / "out") as path:
            (path / "a.txt" if writer == "atomic_folder" else path).write_text("half")
            raise error

    with pytest.raises(error):
        fail()
    assert file.read_text() == "old"
    assert sorted(tmp_path.rglob("*")) == sorted({tmp_path / "out", file})


@pytest.mark.parametrize(
    "name", ["a" * 255, "é" * 127, "-", " ", "a\nb", ".hidden", "ä☃.nc"]
)
@pytest.mark.parametrize("writer", WRITERS)
def test_any_name_that_the_file_system_takes(writer, name, tmp_path):
    assert write(writer, tmp_path / name).read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_modes_are_the_usual_ones(tmp_path):
    (tmp_path / "plain").write_text("")
    assert (
        write("atomic_file", tmp_path / "out").stat().st_mode
        == (tmp_path / "plain").stat().st_mode
    )


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there" / "file")
    write("atomic_file", tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "there" / "file").read_text() == "new"


@pytest.mark.parametrize("writer", WRITERS)
def test_a_folder_goes_where_few_files_can_be_open(writer, tmp_path, monkeypatch):
    monkeypatch.setattr(
        files.shutil, "rmtree", lambda *_, **__: None
    )  # as it ends where none can be opened
    with (
        contextlib.suppress(KeyError),
        getattr(files, writer)(tmp_path / "out") as path,
    ):
        (path / "b.txt" if writer == "atomic_folder" else path).write_text("half")
        raise KeyError
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("kind", ["folder", "fifo"])
def test_a_folder_replaces_files_alone(kind, tmp_path):
    (tmp_path / "out").mkdir()
    if kind == "fifo":
        os.mkfifo(tmp_path / "out" / "a.txt")
    else:
        (tmp_path / "out" / "a.txt").mkdir()
    with pytest.raises(Refusal, match=r"a\.txt: it is no ordinary file"):
        write("atomic_folder", tmp_path / "out")


def test_a_folder_does_not_replace_an_input(tmp_path):
    file, source = write("atomic_folder", tmp_path / "out", "input"), tmp_path / "input"
    source.hardlink_to(file)
    with (
        pytest.raises(Refusal, match="it is an input"),
        files.atomic_folder(tmp_path / "out", [source]) as new,
    ):
        (new / "a.txt").write_text("new")
    assert file.read_text() == "input"


@pytest.fixture(scope="module")
def heard():
    """A list of functions that are told of every event of the file system; a hook of Python's cannot be taken out."""
    listeners = []

    def tell(event, args):
        if listeners and event.partition(".")[0] in ("os", "open", "shutil"):
            listeners[0](event, str(args))

    sys.addaudithook(tell)
    return listeners


@pytest.mark.parametrize("writer", WRITERS)
def test_a_stop_at_any_moment_leaves_nothing(writer, heard, tmp_path):
    """An interrupt at the n-th event of the file system: in the making, the writing and the tidying up."""
    for call in range(1, 40):
        seen, folder = [], tmp_path / str(call)
        folder.mkdir()

        def stop(event, args):
            if str(folder) in args:
                seen.append(event)
                if len(seen) == call:
                    heard.clear()
                    raise KeyboardInterrupt

        heard.append(stop)
        with contextlib.suppress(KeyboardInterrupt):
            write(writer, folder / "out")
        heard.clear()
        assert not [p for p in folder.rglob("*") if p.name.startswith(".geomech-")], (
            seen
        )


LIMITED = """
import resource, sys
from geomech.io import files
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    with getattr(files, sys.argv[1])(sys.argv[2]) as path:
        (path / "a.txt" if sys.argv[1] == "atomic_folder" else path).write_text("x" * 5000)
except files.Refusal as error:
    print(error)
"""


@pytest.mark.parametrize("writer", WRITERS)
def test_a_full_disk_is_named_and_leaves_what_was_there(writer, tmp_path):
    file = write(writer, tmp_path / "out", "old")
    said = subprocess.run(
        [sys.executable, "-c", LIMITED, writer, str(tmp_path / "out")],
        capture_output=True,
        text=True,
    )
    assert said.stdout.startswith("cannot write ")
    assert f"{tmp_path / 'out'}: File too large; make room" in said.stdout
    assert file.read_text() == "old"
    assert sorted(tmp_path.rglob("*")) == sorted({tmp_path / "out", file})


@pytest.mark.parametrize("bad", ["missing/out", "file/out", "out\0", "loop"])
def test_where_nothing_can_be_written(bad, tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(Refusal, match="cannot write"):
        write("atomic_file", tmp_path / bad)
    if bad != "missing/out":
        with pytest.raises(Refusal, match="cannot write the folder"):
            write("atomic_folder", tmp_path / bad)


def test_reading_stops_at_the_limit(tmp_path):
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfa\r\nb\r")
    assert files.read_text(tmp_path / "a", 8) == "a\nb\n"
    with pytest.raises(OSError, match="larger than"):
        files.read(tmp_path / "a", 7)
    for path in ("/dev/zero", tmp_path):
        with pytest.raises(OSError, match="no ordinary file"):
            files.read(path, 10)
    if os.path.exists("/proc/self/status"):  # says that it is empty, and is not
        with pytest.raises(OSError, match="larger than"):
            files.read("/proc/self/status", 10)
    with contextlib.suppress(FileNotFoundError):
        files.read(tmp_path / "none", 10)
        pytest.fail("read what is not there")
