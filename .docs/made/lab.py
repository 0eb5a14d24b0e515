"""The gait lab in pages of the site: the file itself, in a frame."""

from __future__ import annotations

from pathlib import Path

from geomech import lab, load
from geomech.studies.maps.lab import GALLERY, Lab

FILE = Path(__file__).parents[1] / "generated" / "extra" / "gait-lab.html"


def write() -> None:
    """Write the page of the gallery's scenes."""
    FILE.parent.mkdir(parents=True, exist_ok=True)
    lab.write(Lab(tuple(map(load, GALLERY))).charts(lambda done: None), FILE)


def frame() -> str:
    """Return the page in a frame."""
    return (
        "```{raw} html\n"
        '<iframe class="lab" src="gait-lab.html" title="Gait lab: drag the loop on the map and watch the swimmer"></iframe>\n'
        '<p><a href="gait-lab.html">Open the gait lab in its own window</a></p>\n'
        "```"
    )
