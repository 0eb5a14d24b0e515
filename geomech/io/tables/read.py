"""The connection in a file of any of the formats."""

from __future__ import annotations

import hashlib
from pathlib import Path

from geomech.core.errors import choose
from geomech.io.files import read, reason_of
from geomech.io.foreign import refuse_program
from geomech.io.tables.base import FORMATS, ORDERS, SIGNS, Stored
from rft.core.refusal import Refusal

LARGEST = 2_000_000_000  # bytes of a file, enough for the finest field


def load(path: str | Path, sign: str = "", order: str = "") -> Stored:
    """Return the connection in a .nc or .mat file, as `geomech connection` writes them;
    Refusal if it has none.

    sign: "+" or "-" for xi = + or - A alphadot; if left out the sign that the file
    states, or that its values tell (`detected_sign`). order: "ndgrid" or "meshgrid", in
    which arrays of a .mat file run; if left out the order of its alpha1 and alpha2."""
    if not isinstance(path, (str, Path)):
        raise Refusal("a table must be a .nc or .mat file", value=path)
    path = Path(path)
    refuse_program(path)
    if path.suffix.lower() not in FORMATS:
        raise Refusal(
            f"cannot read the table {path}",
            instead=f"end the name in {' or '.join(FORMATS)}",
        )
    for key, value, choices in (("sign", sign, SIGNS), ("order", order, ORDERS)):
        if value != "":
            choose(key, value, choices)
    try:
        raw = read(path, LARGEST)
    except (OSError, ValueError) as error:
        raise Refusal(
            f"cannot read the table {path}", because=reason_of(error)
        ) from None
    parse = FORMATS[path.suffix.lower()]
    try:
        return parse(raw, sign, order, hashlib.sha256(raw).hexdigest())
    except Refusal as refusal:
        refusal.what = f"the table {path} {refusal.what}"
        raise
