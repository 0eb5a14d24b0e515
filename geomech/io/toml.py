"""Tables of TOML texts of other people, read within limits."""

from __future__ import annotations

import re
import tomllib
from typing import Any

MOST_PARTS = 64  # of a key with dots; Python's reader takes a time of their square
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
    if long := LONG_KEY.search(text):
        line = 1 + text.count("\n", 0, long.start())
        raise ValueError(f"a key has more than {MOST_PARTS} parts (at line {line})")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deep") from None
