"""The connection in a file, whichever of the formats it has."""

from __future__ import annotations

import hashlib
from pathlib import Path

from geomech.core.errors import SceneError, choose, short
from geomech.io.files import read, why
from geomech.io.tables.base import FORMATS, ORDERS, SIGNS, Stored

LARGEST = 2_000_000_000  # bytes of a file: the finest field there is


def load(path: str | Path, sign: str = "", order: str = "") -> Stored:
    """The connection in a file of `geomech connection`, .nc or .mat; SceneError, one line, if it holds none.

    sign: "+" or "-" for xi = + or - A alphadot; if left out as the file says, or made out (`detected_sign`). order:
    "ndgrid" or "meshgrid", the way arrays of a .mat file run; if left out as alpha1 and alpha2 in it run."""
    if not isinstance(path, (str, Path)):
        raise SceneError(f"a table is a .nc or .mat file, got {short(path)}")
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise SceneError(f"cannot read the table {path}: end the name in {' or '.join(FORMATS)}")
    for what, word, known in (("sign", sign, SIGNS), ("order", order, ORDERS)):
        if word != "":
            choose(what, word, known)
    try:
        raw = read(path, LARGEST)
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot read the table {path}: {why(error)}") from None
    try:
        return FORMATS[path.suffix.lower()](raw, sign, order, hashlib.sha256(raw).hexdigest())
    except ValueError as error:
        raise SceneError(f"the table {path} {error}") from None
