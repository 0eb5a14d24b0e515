"""Files on disk: whole or not at all, and nothing left behind, whatever happens to
their writer."""

import contextlib
import os
import subprocess
import sys

import pytest

from geomech.io import files
from rft.core.refusal import Refusal

WRITERS = ["atomic_file", "atomic_folder"]
KILLED = """
import os, resource, signal, sys
from geomech.io import files
writer, target, how = sys.argv[1:]
with getattr(files, writer)(target) as path:
    (path / "a.txt" if writer == "atomic_folder" else path).write_text("half")
    if how == "wait":
        print("ready", flush=True)
        sys.stdin.read()
    os.kill(os.getpid(), getattr(signal, how))
"""
LIMITED = """
import resource, sys
from geomech.io import files
writer, target = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    with getattr(files, writer)(target) as path:
        (path / "a.txt" if writer == "atomic_folder" else path).write_text("x" * 5000)
except files.Refusal as error:
    print(error)
"""


def start(writer, target, how, **options):
    line = [sys.executable, "-c", KILLED, writer, target, how]
    return subprocess.Popen(line, **options)


def write(writer, target, text="new", error=None):
    """Write a file, or a file in a folder, and return its path; an error comes
    midway."""
    name = "a.txt" if writer == "atomic_folder" else ""
    with getattr(files, writer)(target) as path:
        (path / name).write_text(text)
        if error is not None:
            raise error
    return target / name


def paths(folder):
    return sorted(folder.rglob("*"))


@pytest.mark.parametrize("writer", WRITERS)
def test_the_next_writer_removes_what_a_kill_left(writer, tmp_path):
    for name in ("out", "out", "another"):
        start(writer, tmp_path / name, "SIGKILL").wait()
    assert len(list(tmp_path.glob(".geomech-*"))) == 2
    assert write(writer, tmp_path / "out").read_text() == "new"
    assert len(list(tmp_path.glob(".geomech-*"))) == 1  # of the other target


@pytest.mark.parametrize("writer", WRITERS)
def test_a_living_writer_keeps_its_folder(writer, tmp_path):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with start(writer, tmp_path / "out", "wait", **pipes) as living:
        assert living.stdout.readline() == "ready\n"
        write(writer, tmp_path / "out")
        assert len(list(tmp_path.iterdir())) == 2
        living.kill()


def test_what_is_not_ours_stays(tmp_path):
    """Names like ours, with a mark of something else, none, or behind a link."""
    start("atomic_file", tmp_path / "out", "SIGKILL").wait()
    (left,) = tmp_path.glob(".geomech-*")
    real = left.rename(tmp_path / "elsewhere")
    stem = left.name[:-3]
    (tmp_path / f"{stem}link").symlink_to(real)
    for name, mark in (("other", b"mine"), ("empty", b""), ("none", None)):
        (tmp_path / f"{stem}{name}").mkdir()
        (tmp_path / f"{stem}{name}" / "data").write_text("precious")
        if mark is not None:
            (tmp_path / f"{stem}{name}" / files.MARK).write_bytes(mark)
    before = paths(tmp_path)
    write("atomic_file", tmp_path / "out")
    assert paths(tmp_path) == sorted([*before, tmp_path / "out"])


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failure_leaves_what_was_there(writer, error, tmp_path):
    file = write(writer, tmp_path / "out", "old")
    before = paths(tmp_path)
    with pytest.raises(error):
        write(writer, tmp_path / "out", "half", error)
    assert file.read_text() == "old"
    assert paths(tmp_path) == before


@pytest.mark.parametrize(
    "name", ["a" * 255, "é" * 127, "-", " ", "a\nb", ".hidden", "ä☃.nc"]
)
@pytest.mark.parametrize("writer", WRITERS)
def test_any_name_that_the_file_system_takes(writer, name, tmp_path):
    assert write(writer, tmp_path / name).read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_file_has_the_usual_mode(tmp_path):
    (tmp_path / "plain").write_text("")
    mode = write("atomic_file", tmp_path / "out").stat().st_mode
    assert mode == (tmp_path / "plain").stat().st_mode


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there" / "file")
    write("atomic_file", tmp_path / "link")
    assert (tmp_path / "there" / "file").read_text() == "new"


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo])
def test_a_folder_replaces_files_alone(make, tmp_path):
    (tmp_path / "out").mkdir()
    make(tmp_path / "out" / "a.txt")
    with pytest.raises(Refusal, match=r"a\.txt: it is not an ordinary file"):
        write("atomic_folder", tmp_path / "out")


LISTENERS = []


@pytest.fixture(scope="module")
def audited():
    """Events of the file system are told to `LISTENERS`; Python's hooks stay for
    good."""

    def tell(event, args):
        if LISTENERS and event.partition(".")[0] in ("os", "open", "shutil"):
            LISTENERS[0](str(args))

    sys.addaudithook(tell)


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("call", range(1, 40))
def test_a_stop_at_any_moment_leaves_nothing(writer, call, audited, tmp_path):
    """At the n-th event of the file system: in making, writing and tidying up."""
    remaining = [call]

    def stop(args):
        remaining[0] -= str(tmp_path) in args
        if remaining[0] == 0:
            LISTENERS.clear()
            raise KeyboardInterrupt

    LISTENERS.append(stop)
    with contextlib.suppress(KeyboardInterrupt):
        write(writer, tmp_path / "out")
    LISTENERS.clear()
    assert list(tmp_path.rglob(".geomech-*")) == []


@pytest.mark.parametrize("writer", WRITERS)
def test_a_full_disk_is_named_and_leaves_what_was_there(writer, tmp_path):
    file = write(writer, tmp_path / "out", "old")
    before = paths(tmp_path)
    line = [sys.executable, "-c", LIMITED, writer, tmp_path / "out"]
    said = subprocess.run(line, capture_output=True, text=True).stdout
    assert f"{tmp_path / 'out'}: File too large; free" in said
    assert file.read_text() == "old"
    assert paths(tmp_path) == before


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("name", ["file/out", "out\0"])
def test_where_nothing_can_be_written(writer, name, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(Refusal, match="cannot write"):
        write(writer, tmp_path / name)


def test_text_is_read_without_its_mark_and_with_one_kind_of_lines(tmp_path):
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfa\r\nb\r")
    assert files.read_text(tmp_path / "a", 8) == "a\nb\n"


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("a", "larger than"),
        ("/proc/self/status", "larger than"),  # says that it is empty
        ("/dev/zero", "not an ordinary file"),
        ("", "not an ordinary file"),
        ("none", "No such file"),
    ],
)
def test_reading_stops_at_the_limit_and_at_what_is_no_file(name, error, tmp_path):
    (tmp_path / "a").write_text("7 bytes")
    with pytest.raises(OSError, match=error):
        files.read(tmp_path / name, 6)
