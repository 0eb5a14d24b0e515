"""Pictures that are wider than a telephone: they scroll there instead of shrinking."""

from __future__ import annotations

import struct
from pathlib import Path

from docutils import nodes

UNKNOWN_DPI = 100.0  # matplotlib's, which films have
NARROW, WIDE = 5, 12  # inches from which a picture scrolls, and at which it stays


def inches(path: Path) -> float:
    """Return the width at which a PNG or GIF was drawn; 0 of another file."""
    head = path.read_bytes()[:1024] if path.is_file() else b""
    if head.startswith(b"GIF8"):
        return struct.unpack("<H", head[6:8])[0] / UNKNOWN_DPI
    if not head.startswith(b"\x89PNG"):
        return 0.0
    dpi = UNKNOWN_DPI
    resolution = head.find(b"pHYs")
    if resolution > 0:
        per_metre = struct.unpack(">I", head[resolution + 4 : resolution + 8])[0]
        dpi = 0.0254 * per_metre
    return struct.unpack(">I", head[16:20])[0] / dpi


def mark(app, doctree: nodes.document, docname: str) -> None:
    """Give each wide picture of a page the class inches-N, for which `site.css` has a
    width on telephones, and what holds it the class scrolls."""
    for image in doctree.findall(nodes.image):
        if "sd-card-img-top" in image["classes"]:
            continue
        width = round(inches(Path(app.srcdir) / image["uri"]))
        if width >= NARROW:
            image["classes"].append(f"inches-{min(width, WIDE)}")
            image.parent["classes"].append("scrolls")
