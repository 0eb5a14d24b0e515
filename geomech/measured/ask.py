"""The question of a measured file: a log of joint angles, or midlines, as its header says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from geomech.io.rows import read as read_rows
from geomech.measured.midlines import reader
from geomech.measured.midlines.question import Midlines
from geomech.measured.results import Fit
from rft.refusal import Refusal, line

OF_LOGS = "degrees", "harmonics", "limits", "scene"
OF_MIDLINES = "medium", "units", "scale", "fps", "y", "head", "least_score", "mend"


def question(file: Path, scene: Path | None = None, **options: Any) -> Fit | Midlines:
    """Return the question of a file; Refusal for options of the other kind. options: those that are None or False are left
    out."""
    given = {
        name: value
        for name, value in options.items()
        if value is not None and value is not False and value != ()
    }
    midlines = _is_midlines(file)
    wrong = [
        x
        for x in (OF_LOGS if midlines else OF_MIDLINES)
        if x in given or (x == "scene" and scene is not None)
    ]
    if midlines and wrong[:1] == ["scene"]:
        raise Refusal(
            "``scene`` is that of a log of joint angles",
            where=line(file.name),
            instead="give one cycle of the midlines to a scene whose [gait] has kind = "
            "'centreline' and file = ...",
        )
    if wrong:
        what = "a log of joint angles" if midlines else "midlines"
        raise Refusal(
            f"``{wrong[0]}`` is that of {what}",
            where=line(file.name),
            instead="drop it",
        )
    return Midlines(file, **given) if midlines else Fit(file, **given)


def _is_midlines(file: Path) -> bool:
    try:
        return reader.is_midlines(
            read_rows(file, reader.LARGEST_FILE, reader.WHAT).header[1]
        )
    except ValueError:
        return False
