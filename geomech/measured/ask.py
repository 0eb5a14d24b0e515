"""The question of a measured file: a log of joint angles, or midlines, as its header says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from geomech.io.rows import read as read_rows
from geomech.measured.midlines import reader
from geomech.measured.midlines.question import Midlines
from geomech.measured.results import Fit
from rft.core.refusal import Refusal, formatted, line

OF_LOGS = "degrees", "harmonics", "limits", "scene"
OF_MIDLINES = (
    "medium",
    "units",
    "scale",
    "fps",
    "y",
    "head",
    "least_score",
    "individual",
    "mend",
)
WHAT = (
    "give a CSV file with a header such as t,alpha_1,alpha_2,x,y,heading for joint "
    "angles, or t,point,x,y or t,x1,y1,x2,y2 for points along a body"
)
LOG, MIDLINES = "a log of joint angles", "midlines"


def question(file: Path, scene: Path | None = None, **options: Any) -> Fit | Midlines:
    """Return the question of a file: its header says which, else the options do. Refusal for options of the other kind.
    options: those that are None or False are left out."""
    given = {
        name: value
        for name, value in options.items()
        if value is not None and value is not False and value != ()
    }
    of_logs = [x for x in OF_LOGS if x in given or (x == "scene" and scene is not None)]
    of_midlines = [x for x in OF_MIDLINES if x in given]
    header = read_rows(file, reader.LARGEST_FILE, WHAT).header[1]
    kind = reader.kind_of(header)
    if not kind and of_logs and of_midlines:
        raise Refusal(
            f"``{of_logs[0]}`` belongs to {LOG}, and ``{of_midlines[0]}`` to {MIDLINES}",
            where=line(file.name),
            instead="drop one",
        )
    is_midlines = kind == "midlines" or (not kind and bool(of_midlines))
    wrong = of_logs if is_midlines else of_midlines
    if is_midlines and wrong[:1] == ["scene"]:
        raise Refusal(
            f"``scene`` belongs to {LOG}",
            where=line(file.name),
            instead="give one cycle of the midlines to a scene whose [gait] has kind = "
            "'centreline' and file = ...",
        )
    if wrong:
        theirs, ours = (LOG, MIDLINES) if is_midlines else (MIDLINES, LOG)
        raise Refusal(
            f"``{wrong[0]}`` belongs to {theirs}",
            where=line(file.name),
            because=f"by its header this is a file of {ours}: {formatted(', '.join(header), 120)}",
            instead="drop it, or rename the columns",
        )
    return Midlines(file, **given) if is_midlines else Fit(file, **given)
