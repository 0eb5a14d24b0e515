"""What a measured file holds, by its header: a log of joint angles, or midlines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from geomech.io.rows import read_header
from geomech.studies.measured.log import Log
from geomech.studies.measured.midlines import reader
from geomech.studies.measured.midlines.trial import Trial
from rft.core.refusal import Refusal, formatted, line

OF_LOGS = ("degrees", "harmonics", "limits", "scene")
OF_MIDLINES = (
    "medium",
    "effects",
    "units",
    "scale",
    "fps",
    "y",
    "head",
    "least_score",
    "individual",
    "mend",
)
HEADERS = (
    "give a CSV file with a header such as t,alpha_1,alpha_2,x,y,heading for joint "
    "angles, or t,point,x,y or t,x1,y1,x2,y2 for points along a body"
)
LOG = "log"
MIDLINES = "midlines"
WORDS = {LOG: "a log of joint angles", MIDLINES: "midlines"}
SCENE = (
    "give one cycle of the midlines to a scene whose [gait] has kind = 'centreline' "
    "and file = ..."
)


def form_of(measured: str | Path | Log | Trial, options: Mapping[str, Any]) -> str:
    """Return `LOG` or `MIDLINES`, of a file as its header says, else as the options do.

    Refusal for options of the other form. options: those that are None, False or empty
    are left out; "scene" stands for a scene that is to be written."""
    given = [
        name for name, x in options.items() if x is not None and x not in (False, ())
    ]
    of_logs = [name for name in OF_LOGS if name in given]
    of_midlines = [name for name in OF_MIDLINES if name in given]
    if isinstance(measured, Log):
        refuse(measured.name, LOG, of_midlines)
        return LOG
    if isinstance(measured, Trial):
        refuse(measured.name, MIDLINES, of_logs)
        return MIDLINES
    header = read_header(measured, reader.LARGEST_FILE, HEADERS)
    file = Path(measured)
    form = reader.kind_of(header)
    if not form and of_logs and of_midlines:
        raise Refusal(
            f"``{of_logs[0]}`` belongs to {WORDS[LOG]}, and ``{of_midlines[0]}`` to "
            f"{WORDS[MIDLINES]}",
            where=line(file.name),
            instead="remove one of them",
        )
    if not form:
        form = MIDLINES if of_midlines else LOG
    wrong = of_logs if form == MIDLINES else of_midlines
    columns = formatted(", ".join(header), 120)
    because = f"according to its header, this file contains {WORDS[form]}: {columns}"
    refuse(file.name, form, wrong, because)
    return form


def refuse(name: str, form: str, wrong: Sequence[str], because: str = "") -> None:
    """Refuse options of the other form, if there are any."""
    if not wrong:
        return
    if wrong[0] == "scene":
        raise Refusal(
            f"a scene can be written from {WORDS[LOG]}; this file contains "
            f"{WORDS[form]}",
            where=line(name),
            instead=SCENE,
        )
    other = MIDLINES if form == LOG else LOG
    raise Refusal(
        f"``{wrong[0]}`` belongs to {WORDS[other]}",
        where=line(name),
        because=because,
        instead="remove it, or rename the columns",
    )
