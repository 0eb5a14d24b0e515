"""Tables of other people: one table in the forms that spreadsheets, loggers, robots and
trackers write it gives the same numbers, what is decided is told, and what cannot be
decided is refused."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from refusals import refuses

from geomech.io import rows
from geomech.mathematics.gaits import frames
from geomech.scenes.data import drag
from geomech.scenes.format.columns import columns
from geomech.scenes.terradynamics import penetration
from geomech.studies.measured import log as logs
from geomech.studies.measured.midlines import reader
from rft.core.notes import Note
from rft.core.refusal import Refusal

DEPTH = np.array([0.0, 0.5, 1.25, 2.0, 3.5])  # mm
FORCE = np.array([0.0, 3.5, 7.25, 11.0, 17.5])  # N
PLAIN = "depth_mm,force_N\n" + "".join(
    f"{d:.2f},{f:.2f}\n" for d, f in zip(DEPTH, FORCE)
)
GERMAN = PLAIN.replace(",", ";").replace(".", ",")
HEAD = "1/2/2024,10:00:00\nLatitude : 0.0 | Longitude : 0.0\nPlate Diameter: 4.00cm\n"
FORMS = {
    "plain": (PLAIN, ""),
    "no line end": (PLAIN.rstrip("\n"), ""),
    "empty lines": (PLAIN + "\n,\n  \n", ""),
    "semicolons": (PLAIN.replace(",", ";"), "semicolons"),
    "tabs": (PLAIN.replace(",", "\t"), "tabs"),
    "blanks": (PLAIN.replace(",", "   "), "blanks"),
    "decimal commas": (GERMAN, "decimal commas"),
    "commas and tabs": (GERMAN.replace(";", "\t"), "decimal commas"),
    "commas and blanks": (GERMAN.replace(";", " "), "decimal commas"),
    "quotes": (
        "depth_mm,force_N\n"
        + "".join(f'"{line}"\n'.replace(";", '","') for line in GERMAN.split()[1:]),
        "decimal commas",
    ),
    "mark": ("\ufeff" + PLAIN, ""),
    "UTF-16": (PLAIN.encode("utf-16"), "UTF-16"),
    "UTF-16, no mark": (PLAIN.encode("utf-16-le"), "UTF-16"),
    "line of units": (PLAIN.replace("_N\n", "_N\nmm,N\n"), "line 2 contains units"),
    "units below": (
        PLAIN.replace("depth_mm,force_N", "Depth,Force\n[mm],[N]"),
        "units",
    ),
    "logger": (
        HEAD + PLAIN + "End (:",
        "header in line 4.*line 10 at the end of the file",
    ),
    "cut off": (PLAIN + "3.75", "line 7 at the end of the file is incomplete"),
    "other names": (
        PLAIN.replace("depth_mm,force_N", "Sinkage (mm),Force / N"),
        "Sinkage",
    ),
    "ends": (PLAIN.replace("\n", ",\n"), ""),
    "comment": ("# " + PLAIN, "comment in line 1 is read as the header"),
    "letters": (
        PLAIN.replace("\n", ",µ\n").replace("_N,µ", "_N,größe").encode("cp1252"),
        "1252",
    ),
    "micrometres": (
        "depth (µm),force_N\n"
        + "".join(f"{1e3 * d:.2f},{f}\n" for d, f in zip(DEPTH, FORCE)),
        "",
    ),
    "MN": (
        "depth_mm,force (MN)\n"
        + "".join(f"{d},{1e-6 * f:.9f}\n" for d, f in zip(DEPTH, FORCE)),
        "",
    ),
}


def written(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize("form", FORMS)
def test_a_table_in_any_form_has_the_same_numbers_and_one_note(form, tmp_path):
    text, told = FORMS[form]
    source = rows.read(written(tmp_path / "push.csv", text), 10_000, "")
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        test = penetration.read(source)
    np.testing.assert_allclose(test.depth, 1e-3 * DEPTH, rtol=1e-12)
    np.testing.assert_allclose(test.force, FORCE, rtol=1e-12)
    assert len(notes) == bool(told)
    for note in notes:
        assert re.search(f"(?s)^push.csv: .*{told}", str(note.message))


@pytest.mark.parametrize(
    ("size", "head", "radius"),
    [
        ("8,5 mm", "psi_deg;F_parallel_N;F_perpendicular_N\n0;1,5;2\n90;2;3\n", 0.0085),
        ("8,5 mm", "psi_deg,F_parallel_N,F_perpendicular_N\n0,1,2\n90,2,3\n", None),
        ("8, long 80 mm", "psi_deg,F_parallel_N,F_perpendicular_N\n0,1,2\n90,2,3\n", 8),
    ],
)
@pytest.mark.filterwarnings("ignore::geomech.core.errors.Note")
def test_sizes_with_a_comma_are_no_metres(size, head, radius, tmp_path):
    path = written(tmp_path / "rod.csv", f"# radius = {size}\n{head}")
    if radius is None:
        with pytest.raises(Refusal, match="8,5 in the header lines"):
            drag.read(path)
    else:
        assert drag.read(path).sizes["radius"] == pytest.approx(radius)


@pytest.mark.parametrize("cell", ["1_5", "１５", "inf", "1,5", "0x1f"])
def test_cells_that_only_python_takes_for_numbers_are_refused(cell, tmp_path):
    push = written(tmp_path / "push.csv", PLAIN.replace("0.50,", cell + ","))
    with pytest.raises(Refusal, match="line 3"):
        penetration.read(rows.read(push, 10_000, ""))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "depth_mm\tforce_N\n1,234\t5,678\n2,345\t6,789\n",
            "line 2 1,234 decimal comma separators | where instead",
        ),
        (
            'depth_mm,force_N\n"1,234","5,678"\n2,3\n',
            "line 2 1,234 decimal comma separators | where instead",
        ),
        (
            "depth_mm;force_N\n0,5;1.5\n1,5;2,5\n",
            "line 2 row 2 finite | where value",
        ),
        (
            "depth_mm,force_N\nm,N\n1,2\n2,3\n",
            "line 2 depth_mm m | where instead",
        ),
        ("1,2\n2,3\n", "line 1 file header first line 2 | where instead"),
        (
            "t,force_N\n1,2\n",
            "depth columns t force_N depth_m,force_N | where because instead",
        ),
        (
            "depth (N),force_N\n1,2\n",
            "line 1 column depth N m cm | where instead",
        ),
        ("depth_mm,force_N\n1,2\n2\n3,4\n", "line 3 row 2 | where value"),
        ("Operator,5\ndepth_mm,force_N\n1,x\n2,3\n3,4\n", "line 3 row 2 | where value"),
    ],
)
def test_what_leaves_a_doubt_is_refused_by_place(text, said, tmp_path):
    with refuses(said):
        penetration.read(rows.read(written(tmp_path / "p.csv", text), 10_000, ""))


@pytest.mark.filterwarnings("ignore::geomech.core.errors.Note")
@pytest.mark.parametrize(
    ("text", "needed", "angles", "row"),
    [
        (
            "time (ms)\tx (mm)\tz [cm]\tangle_deg\n0\t0\t0\t90\n500\t1,5\t2,5\t180\n",
            ("t", "x", "z"),
            ("angle",),
            [0.5, 1.5e-3, 0.025, np.pi],
        ),
        (
            "beta (rad),gamma (rad),alpha_x (N/m^3),alpha_z (N/m³)\n0,0,0,0\n3,1,2e6,3e6",
            ("beta", "gamma", "alpha_x", "alpha_z"),
            (),
            [np.degrees(3), np.degrees(1), 2, 3],
        ),
    ],
)
def test_paths_and_plates_take_units_behind_names(text, needed, angles, row, tmp_path):
    path = written(tmp_path / "p.csv", text)
    values = columns("place", path, needed, angles)
    assert [x[1] for x in values.values()] == pytest.approx(row)


@pytest.mark.filterwarnings("ignore::geomech.core.errors.Note")
def test_drag_and_midlines_take_units_behind_names(tmp_path):
    rod = "psi (rad);F_par (mN);F_perp (mN)\n0;470;30\n1,5;9;1408\n"
    found = drag.read(written(tmp_path / "rod.csv", rod)).rows[:3].T
    np.testing.assert_allclose(found[1], [np.degrees(1.5), 0.009, 1.408])
    points = [f"{t};{k};{t * k},5" for t in range(4) for k in range(4)]
    bends = "\n".join(["t (ms);x_mm;y_mm", *points])
    read = frames.read(written(tmp_path / "b.csv", bends))
    assert read.rows[-1] == pytest.approx([0.003, 3e-3, 9.5e-3])


def log_text(times: list[str], head: str = "time,joint_1,joint_2,x,y,yaw") -> str:
    """120 rows of two joints that move and a body that drifts."""
    lines = [head]
    for k, t in enumerate(times):
        lines.append(
            f"{t},{np.sin(k / 3):.6f},{np.cos(k / 3):.6f},{k},{2 * k},{k / 100}"
        )
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("scale", "head", "told"),
    [
        (10**9, "time", "ns since 1970"),
        (10**9, "%time", "ns since 1970"),
        (10**9, "time_ns", "ns since 1970"),
        (10**6, "t", "us since 1970"),
        (10**3, "time", "ms since 1970"),
        (1, "time_s", "s since 1970"),
    ],
)
def test_times_since_1970_are_counted_from_the_first_row(scale, head, told, tmp_path):
    """Steps of 16 and 17 ms, which a float of ns since 1970 does not hold."""
    after = np.round(0.0166 * np.arange(120), 3) if scale > 1 else np.arange(120.0)
    times = [str(1506356466 * scale + round(x * scale)) for x in after]
    text = log_text(times).replace("time", head, 1)
    with pytest.warns(Note, match=told):
        log = logs.read(written(tmp_path / "log.csv", text))
    np.testing.assert_allclose(log.t, after, rtol=1e-12)


ROS = "%time,field.position0,field.position1,field.pose.x,field.pose.y,field.pose.theta"


def test_a_log_of_ros_is_read_by_its_columns_and_words_beside_them(tmp_path):
    times = [str(1506356466 * 10**9 + k * 10**7) for k in range(120)]
    lines = log_text(times, ROS).replace("\n", ",/world\n")
    path = written(tmp_path / "echo.csv", lines.replace("/world", "frame_id", 1))
    with pytest.warns(Note, match="ns since 1970"):
        log = logs.read(path, ROS.split(","))
    assert log.t[1] == 0.01 and log.joints == ("field.position0", "field.position1")


# Trackers.


def tracks(frames: int = 15) -> np.ndarray:
    """Five points (F, 5, 2) in pixels with y down."""
    f, p = np.meshgrid(np.arange(frames), np.arange(5), indexing="ij")
    return np.stack([100 + f + 20.0 * p, 300 - 2.0 * f + 3 * p], -1)


def sleap(instances: list[tuple[str, np.ndarray]], score: float = 0.4) -> str:
    names = ",".join(f"b{p}.x,b{p}.y,b{p}.score" for p in range(5))
    lines = [f"track,frame_idx,instance.score,{names}"]
    for frame in range(15):
        for track, points in instances:
            cells = [f"{x:.3f},{y:.3f},{score}" for x, y in points[frame]]
            lines.append(f"{track},{frame},0.9,{','.join(cells)}")
    return "\n".join(lines)


def deeplabcut(individuals: dict[str, np.ndarray | None], score: float = 0.97) -> str:
    """Points of animals; None for one that was never found."""
    heads = [["scorer"], ["individuals"], ["bodyparts"], ["coords"]]
    lines = [[str(k)] for k in range(15)]
    for name, points in individuals.items():
        found = np.full((15, 5, 2), "") if points is None else points.astype(str)
        for p in range(found.shape[1]):
            for head, word in zip(heads, ("net", name, f"b{p}")):
                head += [word] * 3
            heads[3] += ["x", "y", "likelihood"]
            for line, place in zip(lines, found[:, p]):
                line += [*place, "" if points is None else str(score)]
    return "\n".join(",".join(line) for line in (*heads, *lines))


def test_individuals_without_points_are_left_out(tmp_path):
    dish = np.broadcast_to([[40.0, 50.0], [640.0, 50.0]], (15, 2, 2))
    text = deeplabcut({"worm1": tracks(), "worm2": None, "single": dish})
    path = written(tmp_path / "d.csv", text)
    trial = reader.read(path)
    np.testing.assert_allclose(trial.points, tracks() * [1, -1])
    assert any("worm2" in note and "single" in note for note in trial.notes)


@pytest.mark.parametrize(
    "text",
    [
        deeplabcut({"a": tracks(), "b": tracks() + 9}),
        sleap(
            [("a", tracks()), ("b", tracks() + 9)]
        ),  # a score of 0.4 is no likelihood
    ],
    ids=["deeplabcut", "sleap"],
)
def test_one_of_several_animals_is_named(text, tmp_path):
    """y runs down in both."""
    path = written(tmp_path / "d.csv", text)
    with pytest.raises(Refusal, match="it contains 2 (individuals|animals): a, b"):
        reader.read(path)
    found = reader.read(path, individual="b")
    np.testing.assert_allclose(found.points, (tracks() + 9) * [1, -1])


WCON = {"units": {"t": "s", "x": "mm", "y": "mm"}, "data": [{"id": "1", "t": [0.0]}]}


@pytest.mark.parametrize(
    ("name", "raw", "said"),
    [
        (
            "a.h5",
            b"\x89HDF\r\n\x1a\n\0\0",
            "HDF5 file CSV SLEAP DeepLabCut | where instead",
        ),
        (
            "a.wcon",
            json.dumps(WCON).encode(),
            "WCON file row | where instead",
        ),
        ("a.json", b'[{"x": 1}]', "JSON | where instead"),
        ("a.xlsx", b"PK\x03\x04\x14\0", "spreadsheet CSV | where instead"),
        ("a.bag", b"#ROSBAG V2.0\n", "ROS | where instead"),
        (
            "sysf_three_link.m",
            b"function out = sysf()",
            "MATLAB drag_ratio | instead",
        ),
    ],
)
def test_files_of_other_programs_are_known(name, raw, said, tmp_path):
    with refuses(said):
        reader.read(written(tmp_path / name, raw))


# SI prefixes, and the words of one unit.
PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6, "": 1.0}
BASES = {
    "s sec secs seconds": 1.0,
    "min": 60.0,
    "m metres meters N newton rad radians": 1.0,
    "deg degree degrees °": np.pi / 180,
}
FACTORS = {word: factor for words, factor in BASES.items() for word in words.split()}


@pytest.mark.parametrize("kind", rows.UNITS)
def test_units_are_their_prefix_times_the_unit_of_the_si(kind):
    def factor(unit):
        if "/" in unit:
            above, below = unit.split("/")
            return factor(above) / factor(below)
        if unit[-1] in "23":
            return factor(unit[:-1]) ** int(unit[-1])
        if unit in FACTORS:
            return FACTORS[unit]
        return PREFIXES[unit[0]] * FACTORS[unit[1:]]

    for unit, value in rows.UNITS[kind].items():
        assert value == pytest.approx(factor(unit), rel=1e-15), unit
