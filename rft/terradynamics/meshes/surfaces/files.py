"""Triangle meshes from files, read by trimesh."""

from __future__ import annotations

import contextlib
import io
import logging
import re
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rft.core.metres import LARGEST
from rft.core.notes import warn
from rft.core.refusal import Refusal, formatted, located, require
from rft.terradynamics.meshes.surfaces.mesh import Mesh, require_vertices
from rft.terradynamics.meshes.surfaces.sound import OPEN_CURE, size_note, sound

KINDS = ("stl", "obj", "ply")
LARGEST_FILE = 500_000_000  # bytes
UTF_16 = (b"\xff\xfe", b"\xfe\xff")

# Lines of an OBJ file: a face with a vertex 0, a face with a vertex below 0, a vertex,
# and a face without spaces before it.
ZERO = re.compile(rb"^[ \t]*f[^\n]*[ \t]0+(?=[/\s]|\Z)", re.M)
BACK = re.compile(rb"^[ \t]*f[^\n]*[ \t]-", re.M)
VERTEX = re.compile(rb"^[ \t]*v[ \t]", re.M)
FACE = re.compile(rb"^f[ \t].*", re.M)
# Lines of an STL file and of the head of a PLY file that announce triangles.
FACET = re.compile(rb"^[ \t]*facet\b", re.M | re.I)
POLYGONS = re.compile(rb"^element[ \t]+face[ \t]+(\d{1,18})", re.M)


def read(path, closed: bool = True, scale: float = 1.0) -> Mesh:
    """Return the mesh of an STL, OBJ or PLY file, with lengths times ``scale``, 0.001
    for millimetres. Needs trimesh.

    closed: False for a sheet. The mesh is mended by `sound`; a warning of one line, a
    `Note`, says what was mended.
    """
    kind = str(path).rpartition(".")[2].lower()
    require(kind in KINDS, "a mesh must be an .stl, .obj or .ply file", where=path)
    vertices, faces = _load(Path(path), kind)
    require(
        faces.ndim == 2 and len(faces) > 0,
        f"{path} is not a valid {kind.upper()} mesh",
        because="it has no triangles",
    )
    with located(path):
        require_vertices(faces, len(vertices))
        require(bool(np.isfinite(vertices).all()), "vertices must be finite")
        size = scale * float(np.ptp(vertices[faces], axis=(0, 1)).max())
        require(
            not size > LARGEST,
            f"the mesh is {size:.4g} m large, beyond {LARGEST:g} m",
            instead="give scale, which is 0.001 for a mesh in mm",
        )
        mesh, notes = sound(vertices * scale, faces, closed, OPEN_CURE)
    notes = [*notes, *size_note(mesh, f"is scale = {scale:g} correct?")]
    if notes:
        warn(f"{path}: {'; '.join(notes)}")
    return mesh


def _require_readable(data: bytes) -> None:
    """Raise ValueError for an OBJ file that trimesh misreads.

    It takes vertex 0 for the last one, and counts vertices below 0 back from the end of
    the file, where OBJ counts back from the face."""
    require(
        not ZERO.search(data),
        "a face names vertex 0, where vertices count from 1",
        instead="correct the mesh",
    )
    back = BACK.search(data)
    require(
        back is None or not VERTEX.search(data, back.end()),
        "a face counts vertices backwards, but vertices follow it",
        instead="count from 1, or put all vertices first",
    )


def _load(path: Path, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return (vertices, faces) of an ordinary file of at most `LARGEST_FILE` bytes."""
    try:
        size = path.stat().st_size
        require(path.is_file(), f"{path} is not an ordinary file")
        require(
            size <= LARGEST_FILE,
            f"{path} is larger than {LARGEST_FILE / 1e6:.0f} MB",
            instead="give fewer triangles",
        )
        data = path.read_bytes()
    except OSError as error:
        raise Refusal(f"cannot read mesh {path}", because=error.strerror) from None
    with located(path):
        data = _plain(kind, data)
        if kind == "obj":
            _require_readable(data)
    with _silenced_trimesh():
        vertices, faces = _parse(path, kind, data)
    least, most = _announced_triangles(kind, data)
    require(
        least <= len(faces) <= most or not len(faces),
        f"{path} is not a complete {kind.upper()} mesh",
        because=f"it announces {least:,} triangles, and {len(faces):,} can be read",
        instead="export it again from the program that created it",
    )
    return vertices, faces


def _plain(kind: str, data: bytes) -> bytes:
    """Return a file in the form that trimesh reads correctly: binary files as they are,
    texts in UTF-8 with line feeds, without names and comments.

    Refusal for a binary STL file that is cut off."""
    is_text = kind == "obj" or b"\0" not in data or data[:2] in UTF_16
    if kind == "stl" and (not is_text or _has_records(data)):
        records = int.from_bytes(data[80:84], "little")
        require(
            _has_records(data),
            "the file is incomplete or is not an STL mesh",
            because=f"it announces {records:,} triangles in {len(data):,} bytes",
            instead="export it again from the program that created it",
        )
        return data
    is_binary_ply = kind == "ply" and b"format binary" in data[:200]
    if not is_text or is_binary_ply:
        return data

    encoding = "utf-16" if data[:2] in UTF_16 else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if kind == "stl":  # names may hold any word
        text = re.sub(r"^(\s*(?:end)?solid)\b.*$", r"\1", text, flags=re.M | re.I)
    if kind == "obj":
        text = text.replace("\\\n", " ")
        text = re.sub(r"[ \t]*#.*", "", text)
        text = re.sub(r"^[ \t]+", "", text, flags=re.M)
    return text.encode()


def _has_records(data: bytes) -> bool:
    """Return whether a file is as long as a binary STL file is with the number of
    triangles that it announces."""
    return len(data) == 84 + 50 * int.from_bytes(data[80:84], "little") > 84


def _parse(path: Path, kind: str, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Return (vertices, faces) as trimesh reads them."""
    try:
        import trimesh
    except ImportError:
        raise Refusal(
            "reading a mesh needs trimesh",
            where=path,
            instead="pip install 'geomech[mesh]'",
        ) from None
    try:
        mesh = trimesh.load(
            io.BytesIO(data), file_type=kind, force="mesh", process=False
        )
        faces = np.asarray(getattr(mesh, "faces", ()))
        return np.asarray(mesh.vertices, float), faces
    except Exception as error:
        # trimesh raises many kinds of errors for a file that is no mesh.
        reason = formatted(str(error))
        if "could not be read" in str(error):
            reason = "one of its numbers cannot be read"
        raise Refusal(
            f"{path} is not a valid {kind.upper()} mesh", because=reason
        ) from None


@contextlib.contextmanager
def _silenced_trimesh() -> Iterator[None]:
    """Keep trimesh from printing tracebacks, log records and warnings. A text of which
    NumPy can read only a part is an error, where NumPy would only warn."""
    with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", "string or file could not be read")
        with contextlib.suppress(ImportError):  # refused later
            import trimesh  # noqa: F401  (its loggers exist from here on)
        names = [*logging.root.manager.loggerDict]
        names = [name for name in names if name.split(".")[0] == "trimesh"]
        loggers = [logging.getLogger(name) for name in names]
        before = [logger.disabled for logger in loggers]
        for logger in loggers:
            logger.disabled = True
        try:
            yield
        finally:
            for logger, disabled in zip(loggers, before):
                logger.disabled = disabled


def _announced_triangles(kind: str, data: bytes) -> tuple[float, float]:
    """Return the least and the largest number of triangles that a file of `_plain` text
    announces."""
    if kind == "stl":
        if _has_records(data):
            return 0, np.inf
        count = len(FACET.findall(data))
        return count, count
    if kind == "obj":
        corners = [len(line.split()) - 1 for line in FACE.findall(data)]
        count = sum(max(0, n - 2) for n in corners)
        return count, count
    head = data[: data.find(b"end_header")]
    count = sum(map(int, POLYGONS.findall(head)))
    return count, np.inf
