"""Tables of TOML texts from anywhere, read within limits."""

from __future__ import annotations

import re
import tomllib
from typing import Any

MOST_PARTS = 64  # of a key with dots; the time to read it grows with their square
PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
LONG_KEY = re.compile(rf"(?<![\w-]){PART}(?:[ \t]*+\.[ \t]*+{PART}){{{MOST_PARTS}}}")


def tables_of(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text; ValueError if it is none, or nested too deep.

    Examples
    --------
    >>> from geomech.io.toml import tables_of
    >>> tables_of("gait.kind = 'circle'")
    {'gait': {'kind': 'circle'}}
    """
    long_key = LONG_KEY.search(text)
    if long_key:
        line = 1 + text.count("\n", 0, long_key.start())
        raise ValueError(f"a key has more than {MOST_PARTS} parts (at line {line})")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deep") from None
