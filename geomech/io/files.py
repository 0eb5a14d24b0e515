"""Files on disk: read within limits, written whole or not at all, never over an input, and without leftovers."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from rft.core.refusal import Refusal, printable

try:
    import fcntl
except ImportError:  # no such locks on Windows: what a kill leaves there is left
    fcntl = None

MARK = "owner"  # in a folder of ours, locked while its owner lives
NEW = "new"  # beside the mark: what is being written
ABANDONED = 60.0  # seconds after which a folder of ours without a mark has no owner who is about to set one
NAME_MARGIN = 24  # bytes of a name left for what is added to it
DISK_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


def note(text: str) -> None:
    """Print a note on standard error."""
    print("note: " + printable(" ".join(text.split())), file=sys.stderr)


def read(path: str | Path, largest: int, pipes: bool = False) -> bytes:
    """Return the bytes of an ordinary file of at most ``largest`` bytes; OSError or ValueError otherwise, before
    anything is read. pipes: take a pipe that somebody writes to, too."""
    path = Path(path)
    if path.stat() and not (path.is_file() or (pipes and path.is_fifo())):
        raise OSError(errno.EINVAL, "it is no ordinary file")
    with open(path, "rb", opener=_opened if path.is_fifo() else None) as file:
        if (
            os.fstat(file.fileno()).st_size > largest
            or len(raw := file.read(largest + 1)) > largest
        ):
            raise OSError(errno.EFBIG, f"it is larger than {largest / 1e6:g} MB")
        if not raw and path.is_fifo():
            raise OSError(errno.EPIPE, "nothing came through this pipe")
    return raw


def _opened(path: str, flags: int) -> int:
    """Return a descriptor of a pipe, without waiting for a writer."""
    pipe = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(pipe, True)
    return pipe


def read_text(path: str | Path, largest: int, pipes: bool = False) -> str:
    """Return the text of an ordinary file, or a pipe, in UTF-8, as `read`, with equal line ends."""
    return (
        read(path, largest, pipes)
        .decode("utf-8-sig")
        .replace("\r\n", "\n")
        .replace("\r", "\n")
    )


def reason_of(error: Exception) -> str:
    """Return the message of an error of the file system."""
    return getattr(error, "strerror", None) or str(error)


def hidden(path: Path, ending: str) -> Path:
    """Return a hidden name beside ``path`` that depends on it alone; short where the file system would refuse the long
    one."""
    name = f".{path.name}{ending}"
    if len(os.fsencode(name)) + NAME_MARGIN > _longest_name(path.parent):
        name = f".geomech-{_key(Path(path.name))}{ending}"
    return path.with_name(name)


def _longest_name(folder: Path) -> int:
    try:
        return os.pathconf(folder, "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):
        return 255


def refuse_inputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise Refusal if an output is the same file as an input, by whatever name or link."""
    inputs = list(inputs)
    for output in outputs:
        for source in inputs:
            with contextlib.suppress(OSError):
                if os.path.samefile(output, source):
                    raise Refusal(
                        f"cannot write {output}",
                        because=f"it is an input, {source}",
                        instead="choose another output",
                    )


@contextlib.contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """Yield a path to write to, of the same name; moved to ``path`` on success, removed on failure. Refusal if nothing
    can be written there."""
    refused = lambda error: Refusal(
        f"cannot write {path}",
        because=reason_of(error),
        instead="choose another output",
    )
    try:
        target = Path(path).resolve()
        if target.exists() and not target.is_file():
            raise OSError("it is no ordinary file")
        displayed = target.name if target.parent.name == NEW else path
    except (OSError, RuntimeError, ValueError) as error:
        raise refused(error) from None
    with _StagingFolder(target, target.parent, refused) as new:
        try:
            yield new / target.name
            os.replace(new / target.name, target)
        except OSError as error:
            raise _unwritten(displayed, error) from None


def write_text(path: str | Path, text: str) -> None:
    """Write text in UTF-8, other characters escaped; the file appears whole or not at all."""
    with atomic_file(path) as part:
        part.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


@contextlib.contextmanager
def atomic_folder(path: str | Path, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """Yield a folder to fill; its files move to ``path`` on success, with a note of the files they replace, and vanish
    on failure. Refusal if that is impossible, or if one would replace an input."""
    refused = lambda error: Refusal(
        f"cannot write the folder {path}",
        because=reason_of(error),
        instead="choose another with -o",
    )
    try:
        target = Path(path).resolve()
        if os.path.lexists(target) and not target.is_dir():
            raise OSError("it is not a folder")
        existing = next(p for p in (target, *target.parents) if p.exists())
    except (OSError, RuntimeError, ValueError) as error:
        raise refused(error) from None
    with _StagingFolder(target, existing, refused) as new:
        try:
            yield new
            _move(sorted(new.iterdir()), target, Path(path), inputs)
        except OSError as error:
            raise _unwritten(f"the folder {path}", error) from None


def _move(files: list[Path], target: Path, path: Path, inputs: Iterable[Path]) -> None:
    replaced = [file.name for file in files if os.path.lexists(target / file.name)]
    if blocked := [name for name in replaced if not (target / name).is_file()]:
        raise Refusal(
            f"cannot write {path / blocked[0]}",
            because="it is no ordinary file",
            instead="choose another with -o",
        )
    refuse_inputs([path / name for name in replaced], inputs)
    target.mkdir(parents=True, exist_ok=True)
    for file in files:
        file.replace(target / file.name)
    if replaced:
        note(f"replaced in {path}: {', '.join(replaced)}")


def _unwritten(what: object, error: OSError) -> Exception:
    """Return the error to raise: for a full disk a Refusal with the file's name; others unchanged."""
    if error.errno not in DISK_FULL:
        return error
    return Refusal(
        f"cannot write {what}",
        because=error.strerror,
        instead="make room, or choose another output",
    )


class _StagingFolder:
    """A hidden folder in ``parent`` in which the files for ``target`` are made; removed at the end.

    Its owner holds a lock on a mark in it. A kill leaves the folder and frees the lock: that is how the next writer to
    the same target recognises a stray, and removes it. The name is chosen before the folder exists, so a signal at any
    moment removes it, too. refused: returns the exception for an error of the file system at the start.
    """

    def __init__(
        self, target: Path, parent: Path, refused: Callable[[Exception], Exception]
    ):
        self.target, self.parent, self.refused = target, parent, refused
        self.folder = parent / f"{_prefix(target)}{secrets.token_hex(8)}"
        self.mark = None

    def __enter__(self) -> Path:
        try:
            sweep_strays(self.target, self.parent)
            self.folder.mkdir(0o700)
            self.mark = (self.folder / MARK).open("wb", buffering=0)
            if _locked(self.mark):
                self.mark.write(_mark_text(self.target))
            (self.folder / NEW).mkdir()
        except BaseException as error:
            self.__exit__()
            if isinstance(error, (OSError, ValueError)):
                raise self.refused(error) from None
            raise
        return self.folder / NEW

    def __exit__(self, *_) -> None:
        try:
            _discard(self.folder)
        except BaseException:  # a signal in the middle
            _discard(self.folder)
            raise
        finally:
            if self.mark:
                self.mark.close()
            if (
                self.folder.is_dir()
            ):  # too many files are open: now there is one fewer, which is enough
                _discard_plainly(self.folder)


def _key(target: Path) -> str:
    return hashlib.sha256(os.fsencode(target)).hexdigest()[:16]


def _prefix(target: Path) -> str:
    return f".geomech-{_key(target)}-"


def _mark_text(target: Path) -> bytes:
    return b"geomech is writing " + os.fsencode(target)


def _locked(file) -> bool:
    """Return whether the file is now locked by this process; False if by another, or on a system without locks."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (AttributeError, OSError):
        return False
    return True


def _discard(folder: Path) -> None:
    """Remove a folder of ours, its mark last."""
    shutil.rmtree(folder / NEW, ignore_errors=True)
    with contextlib.suppress(OSError):
        (folder / MARK).unlink(missing_ok=True)
        folder.rmdir()


def _discard_plainly(folder: Path) -> None:
    """Remove a folder of ours, with one open file at a time."""
    for place, folders, names in os.walk(folder, topdown=False):
        for remove, entries in ((os.unlink, names), (os.rmdir, folders)):
            for name in entries:
                with contextlib.suppress(OSError):
                    remove(os.path.join(place, name))
    with contextlib.suppress(OSError):
        folder.rmdir()


def sweep_strays(target: Path, *more: Path) -> None:
    """Remove the folders of killed writers to ``target``, and no others, from its folder and ``more``."""
    for place in {target.parent, *more}:
        with contextlib.suppress(OSError, ValueError):
            for path in [
                p for p in place.iterdir() if p.name.startswith(_prefix(target))
            ]:
                _sweep(path, target)


def _sweep(path: Path, target: Path) -> None:
    if path.is_symlink() or not path.is_dir():
        return
    with contextlib.suppress(OSError):
        if not any(path.iterdir()):
            if time.time() - path.stat().st_mtime > ABANDONED:
                path.rmdir()
            return
        with (path / MARK).open("r+b") as mark:
            if _locked(mark) and mark.read() == _mark_text(target):
                _discard(path)
