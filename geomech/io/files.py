"""Files on disk: read within limits; written whole or not at all, never over an input,
and without leftovers."""

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
except ImportError:  # Windows has no such locks: folders of killed writers stay there
    fcntl = None

MARK = "owner"  # a file in a staging folder, locked while its owner lives
NEW = "new"  # a folder beside the mark, with the files being written
ABANDONED = 60.0  # s (assumed): an older staging folder without a mark has no owner
NAME_MARGIN = 24  # bytes of a name that are reserved for endings
DISK_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


def note(text: str) -> None:
    """Print a note on standard error."""
    print("note: " + printable(" ".join(text.split())), file=sys.stderr)


def read(path: str | Path, largest: int, pipes: bool = False) -> bytes:
    """Return the bytes of an ordinary file of at most ``largest`` bytes; OSError or
    ValueError otherwise. pipes: also read a pipe that another program writes to."""
    path = Path(path)
    path.stat()  # OSError where there is nothing of that name
    is_pipe = path.is_fifo()
    if not path.is_file() and not (pipes and is_pipe):
        raise OSError(errno.EINVAL, "it is not an ordinary file")
    too_large = OSError(errno.EFBIG, f"it is larger than {largest / 1e6:g} MB")
    with open(path, "rb", opener=_open_pipe if is_pipe else None) as file:
        if os.fstat(file.fileno()).st_size > largest:
            raise too_large
        raw = file.read(largest + 1)
        if len(raw) > largest:
            raise too_large
        if not raw and is_pipe:
            raise OSError(errno.EPIPE, "the pipe delivered no data")
    return raw


def _open_pipe(path: str, flags: int) -> int:
    """Return a descriptor of a pipe, without waiting for a writer."""
    pipe = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(pipe, True)
    return pipe


def read_text(path: str | Path, largest: int, pipes: bool = False) -> str:
    """Return the text of a file in UTF-8, read as by `read`, with line ends \\n."""
    text = read(path, largest, pipes).decode("utf-8-sig")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def reason_of(error: Exception) -> str:
    """Return the message of an error of the file system."""
    return getattr(error, "strerror", None) or str(error)


def hidden(path: Path, ending: str) -> Path:
    """Return the path of a hidden file beside ``path``, which depends on it alone; it
    is short where the file system would refuse a long name."""
    name = f".{path.name}{ending}"
    if len(os.fsencode(name)) + NAME_MARGIN > _longest_name(path.parent):
        name = f".geomech-{_digest(Path(path.name))}{ending}"
    return path.with_name(name)


def _longest_name(folder: Path) -> int:
    try:
        return os.pathconf(folder, "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):
        return 255


def refuse_inputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise Refusal if an output is the same file as an input, under any name or
    link."""
    inputs = list(inputs)
    for output in outputs:
        for source in inputs:
            with contextlib.suppress(OSError):
                if os.path.samefile(output, source):
                    raise Refusal(
                        f"cannot write {output}",
                        because=f"it is one of the inputs, {source}",
                        instead="choose another output",
                    )


def _resolved(path: str | Path) -> Path:
    """Return a path without its links; OSError if they go round in a circle."""
    try:
        target = Path(path).resolve()
    except RuntimeError:  # before Python 3.13, which leaves such links as they are
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from None
    try:
        target.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise
    return target


@contextlib.contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """Yield a path to write to, with the same name. Its file moves to ``path`` on
    success, and is removed on failure. Refusal if nothing can be written there."""

    def refusal(error: Exception) -> Refusal:
        return Refusal(
            f"cannot write {path}",
            because=reason_of(error),
            instead="choose another output",
        )

    try:
        target = _resolved(path)
        if target.exists() and not target.is_file():
            raise OSError("it is not an ordinary file")
        # Within a staging folder the user knows the name alone.
        displayed = target.name if target.parent.name == NEW else path
    except (OSError, ValueError) as error:
        raise refusal(error) from None
    with _StagingFolder(target, target.parent, refusal) as new:
        try:
            yield new / target.name
            os.replace(new / target.name, target)
        except OSError as error:
            raise _write_error(displayed, error) from None


def write_text(path: str | Path, text: str) -> None:
    """Write text in UTF-8, with backslashes for characters that it cannot encode; the
    file appears whole or not at all."""
    with atomic_file(path) as part:
        part.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


@contextlib.contextmanager
def atomic_folder(path: str | Path, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """Yield a folder to fill. Its files move to ``path`` on success, with a note of the
    files that they replace, and are removed on failure. Refusal if they cannot be
    written there, or if one would replace an input."""

    def refusal(error: Exception) -> Refusal:
        return Refusal(
            f"cannot write the folder {path}",
            because=reason_of(error),
            instead="choose another folder with -o",
        )

    try:
        target = _resolved(path)
        if os.path.lexists(target) and not target.is_dir():
            raise OSError("it is not a folder")
        existing = next(p for p in (target, *target.parents) if p.exists())
    except (OSError, ValueError) as error:
        raise refusal(error) from None
    with _StagingFolder(target, existing, refusal) as new:
        try:
            yield new
            _move(sorted(new.iterdir()), target, Path(path), inputs)
        except OSError as error:
            raise _write_error(f"the folder {path}", error) from None


def _move(files: list[Path], target: Path, path: Path, inputs: Iterable[Path]) -> None:
    """Move files to the folder ``target``, which messages call ``path``."""
    replaced = [file.name for file in files if os.path.lexists(target / file.name)]
    for name in replaced:
        if not (target / name).is_file():
            raise Refusal(
                f"cannot write {path / name}",
                because="it is not an ordinary file",
                instead="choose another folder with -o",
            )
    refuse_inputs([path / name for name in replaced], inputs)
    target.mkdir(parents=True, exist_ok=True)
    for file in files:
        file.replace(target / file.name)
    if replaced:
        note(f"replaced in {path}: {', '.join(replaced)}")


def _write_error(what: object, error: OSError) -> Exception:
    """Return the error to raise: a Refusal with the name of the file for a full disk,
    else the error itself."""
    if error.errno not in DISK_FULL:
        return error
    return Refusal(
        f"cannot write {what}",
        because=error.strerror,
        instead="free some disk space, or choose another output",
    )


class _StagingFolder:
    """A hidden folder in ``parent`` in which the files for ``target`` are written;
    removed at the end.

    Its owner holds a lock on a mark in it. A kill leaves the folder and frees the lock;
    the next writer to the same target recognises a stray folder by that, and removes
    it.
    The name is chosen before the folder exists, so that it is also removed after a
    signal at any moment. refusal: returns the exception for an error of the file system
    at the start.
    """

    def __init__(
        self, target: Path, parent: Path, refusal: Callable[[Exception], Exception]
    ):
        self.target = target
        self.parent = parent
        self.refusal = refusal
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
                raise self.refusal(error) from None
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
            if self.folder.is_dir():
                # Too many files were open. Without the mark there is one fewer, which
                # is enough for a slower way.
                _discard_with_one_file(self.folder)


def _digest(target: Path) -> str:
    return hashlib.sha256(os.fsencode(target)).hexdigest()[:16]


def _prefix(target: Path) -> str:
    return f".geomech-{_digest(target)}-"


def _mark_text(target: Path) -> bytes:
    return b"geomech is writing " + os.fsencode(target)


def _locked(file) -> bool:
    """Lock a file, and return whether this process now has the lock; False if another
    one has it, or on a system without locks."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (AttributeError, OSError):
        return False
    return True


def _discard(folder: Path) -> None:
    """Remove a staging folder, its mark last."""
    shutil.rmtree(folder / NEW, ignore_errors=True)
    with contextlib.suppress(OSError):
        (folder / MARK).unlink(missing_ok=True)
        folder.rmdir()


def _discard_with_one_file(folder: Path) -> None:
    """Remove a staging folder, with one open file at a time."""
    for place, folders, names in os.walk(folder, topdown=False):
        for remove, entries in ((os.unlink, names), (os.rmdir, folders)):
            for name in entries:
                with contextlib.suppress(OSError):
                    remove(os.path.join(place, name))
    with contextlib.suppress(OSError):
        folder.rmdir()


def sweep_strays(target: Path, *more: Path) -> None:
    """Remove the staging folders of killed writers to ``target``, and no others, from
    its folder and ``more``."""
    prefix = _prefix(target)
    for folder in {target.parent, *more}:
        with contextlib.suppress(OSError, ValueError):
            strays = [path for path in folder.iterdir() if path.name.startswith(prefix)]
            for path in strays:
                _sweep(path, target)


def _sweep(path: Path, target: Path) -> None:
    """Remove a staging folder that no writer owns."""
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
