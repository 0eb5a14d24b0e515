"""Files of other programs that are no tables of text: their kinds, and what to export
instead."""

from __future__ import annotations

import json
from pathlib import Path

from rft.core.refusal import Refusal

TRACKS = (
    "export CSV from SLEAP by File > Export Analysis CSV, or from DeepLabCut by "
    "deeplabcut.analyze_videos_converth5_to_csv(folder); otherwise write rows "
    "t,point,x,y"
)
SPREADSHEET = "save the sheet as CSV"
BAG = "export its topic as CSV, for example with rostopic echo -p"
MATLAB = "write its columns as CSV with writematrix or writetable"
NUMPY = "write it with numpy.savetxt, with a header and comments=''"
TEXT = "write its columns as CSV, for example with pandas.DataFrame.to_csv"
SIGNATURES = (  # the first bytes of a file, what it is, and the cure
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file", TRACKS),
    (b"PK\x03\x04", "a spreadsheet or another zip file", SPREADSHEET),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Excel workbook", SPREADSHEET),
    (b"MATLAB 5.0 MAT-file", "a MATLAB file", MATLAB),
    (b"#ROSBAG", "a ROS bag", BAG),
    (b"\x89MCAP", "a ROS bag (MCAP)", BAG),
    (b"SQLite format 3\x00", "a database, such as a ROS 2 bag", BAG),
    (b"\x93NUMPY", "a NumPy array", NUMPY),
    (b"PAR1", "a Parquet file", TEXT),
    (b"\x1f\x8b", "a gzip file", "unpack it"),
)  # fmt: skip
PROGRAMS = {  # of MATLAB files of sysplotter, by the start of their names
    "sysf": "run sys_calcsystem on it and give the _calc.mat file that this saves, or "
    "write a scene with its s.geometry (linklengths, baseframe, length) and "
    "s.physics.drag_ratio",
    "shchf": 'give its XV to [gait] kind = "shchf", or save alpha1, alpha2, ... and t '
    "of its gait in a .mat file",
    "": "run it in MATLAB and give the .mat file or the table that it saves",
}


def refuse_program(path: str | Path) -> None:
    """Raise Refusal for a program of MATLAB, which is never run, with the values to
    take from it if it is one of sysplotter's."""
    path = Path(path)
    if path.suffix.lower() != ".m":
        return
    start = next(x for x in PROGRAMS if path.name.lower().startswith(x))
    raise Refusal(
        f"{path.name} is a MATLAB program, not its result",
        instead=PROGRAMS[start],
    )


def refuse_foreign(path: str | Path, raw: bytes) -> None:
    """Raise Refusal for a file of a kind that is known, and that is no table of text.
    raw: its bytes."""
    refuse_program(path)
    kind, cure = _kind_and_cure(path, raw)
    if kind:
        raise Refusal(f"it is {kind}", where=Path(path).name, instead=cure)


def _kind_and_cure(path: str | Path, raw: bytes) -> tuple[str, str]:
    """Return the kind of a file, and the cure; "" for both if it may be a table."""
    for start, kind, cure in SIGNATURES:
        if raw.startswith(start):
            return kind, cure
    if raw.lstrip()[:1] not in (b"{", b"["):
        return "", ""
    try:
        content = json.loads(raw)
    except (ValueError, RecursionError):
        return "", ""
    if isinstance(content, dict) and {"units", "data"} <= {*content}:
        return (
            "a WCON file (JSON)",
            "write one row t,point,x,y for each point in its data",
        )
    if Path(path).suffix.lower() == ".wcon":
        return "a WCON file (JSON)", "write its points as rows t,point,x,y"
    return "JSON", "write its values as a CSV file with one row for each time"
