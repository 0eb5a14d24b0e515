"""Media from files: what a calibration wrote, and tables of measured drag, whose curve is checked against the law
behind it."""

import math
import re

import numpy as np
import pytest
from commands import geomech
from tabled import tabled_json

from geomech import scenes as scene
from geomech.studies.displacement.sweep import sweep
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Granular, Table, body_velocity
from rft.core.refusal import Refusal
from rft.laws.base import require_drag

pytestmark = pytest.mark.usefixtures("fastest")

LOOSE = Granular(C=1.8, gamma0=math.radians(13.8))
REST = '[body]\nkind = "chain"\nlengths = [1, 1.3, 0.8]\n[gait]\nkind = "circle"\namplitude = 0.9\n'
GAUSS = '[numerics]\nloads = "gauss:12"\nphases = 32\ngrid = 7\nharmonics = 5\nextent = 1.5\n'
MEDIUM = '[medium]\nlaw = "granular"\nC = 1.4\ngamma0_deg = 12.0\nk = 2.4\ncovariance = [[0.02, 0.001], [0.001, 0.002]]\n'
WRITTEN = Granular(1.4, math.radians(12.0), 2.4, ((0.02, 0.001), (0.001, 0.002)))


def rows(count, law=LOOSE, unit=3.3):
    psi = np.linspace(0, np.pi / 2, count)
    return psi, *(unit * np.array(law.traction(np.cos(psi), np.sin(psi))))


def csv(columns="psi_deg,f_t,f_n", count=13, law=LOOSE):
    psi, t, n = rows(count, law)
    angle = psi if columns.startswith("psi,") else np.degrees(psi)
    return f"# N\n{columns}\n" + "".join(
        f"{float(a)!r},{float(b)!r},{float(c)!r}\n" for a, b, c in zip(angle, t, n)
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a scene in it, which is not the current one."""
    (tmp_path / "lab").mkdir()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    return tmp_path / "lab"


def written(folder, medium, rest=REST, name="s.toml", **files):
    for file, text in files.items():
        path = folder / (file.replace("_", ".", 1))
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    (folder / name).write_text(f"[medium]\n{medium}\n{rest}")
    return folder / name


def test_a_medium_is_read_from_beside_its_scene(folder):
    file = written(folder, 'file = "M.toml"', M_toml=MEDIUM)
    found = scene.load(file)
    assert found.system.medium == WRITTEN
    assert scene.inputs(found) == [file, folder / "M.toml"]
    plain = written(folder, 'file = "M.toml"', M_toml=MEDIUM.replace("[medium]\n", ""))
    assert scene.load(plain).system.medium == WRITTEN
    named = written(folder, 'file = "M.toml"', M_toml='name = "glass-0.3mm-close"')
    assert (
        scene.load(named).system
        == scene.parse('[medium]\nname = "glass-0.3mm-close"\n' + REST).system
    )
    within = folder / "w.toml"
    within.write_text('[system]\nkind = "swimmer"\nmedium = {file = "M.toml"}\n' + REST)
    (folder / "M.toml").write_text(MEDIUM)
    assert scene.load(
        within
    ).system.medium == WRITTEN and folder / "M.toml" in scene.inputs(scene.load(within))


def test_a_scene_is_written_with_the_medium_in_it(folder):
    found = scene.load(written(folder, 'file = "M.toml"', M_toml=MEDIUM))
    for other in (found, found.with_numerics(grid=9)):
        again = scene.parse(scene.toml(other))
        assert (again.system, again.gait, again.numerics) == (
            other.system,
            other.gait,
            other.numerics,
        )
        assert again.files == () and "file" not in scene.toml(other)
    assert found.with_numerics(grid=9).files == found.files != ()


def test_parameters_of_a_medium_from_a_file_can_be_swept(folder):
    found = scene.load(
        written(
            folder, 'file = "M.toml"', REST + "[numerics]\nphases = 16\n", M_toml=MEDIUM
        )
    )
    plain = scene.parse(f"{MEDIUM}{REST}[numerics]\nphases = 16\n")
    got, want = (sweep(x, {"medium.C": [1.4, 3.0]})["x"] for x in (found, plain))
    np.testing.assert_array_equal(got, want)
    assert abs(got[1] - got[0]) > 1e-3


def test_a_scene_goes_into_the_medium_of_a_file(folder, monkeypatch):
    """What `geomech run --medium` does; the file is looked for from the current folder."""
    (folder / "M.toml").write_text(MEDIUM)
    (folder / "T.csv").write_text(csv())
    monkeypatch.chdir(folder)
    glass = scene.load("three-link-glass")
    own = scene.in_medium(glass, "M.toml")
    assert own == glass.changed(medium=WRITTEN) and scene.inputs(own) == [
        folder / "M.toml"
    ]
    assert (
        scene.parse(scene.toml(own)).system == own.system
    )  # and not the built-in text
    assert "1.4" in scene.toml(own) and scene.tables(own)["medium"]["C"] == 1.4
    table = scene.in_medium(glass.with_numerics(loads="gauss:12"), "T.csv")
    assert (
        table.system.medium
        == scene.load(written(folder, TABLE, REST + GAUSS)).system.medium
    )
    with pytest.raises(Refusal, match="a no-slip-snake takes no medium"):
        scene.in_medium(scene.load("no-slip-snake"), "M.toml")


TABLE = 'law = "table"\nfile = "T.csv"'
FILE = 'file = "M.toml"'
BAD = {
    "no such file": (FILE, {}, "cannot read 'M.toml': No such file"),
    "a folder": ('file = "."', {}, "ordinary file"),
    "no name": ('file = 3', {}, 'give text in "quotes" in place of 3'),
    "extra": (FILE + "\nC = 2.0", {"M_toml": MEDIUM}, "key: 'C' is unknown: use one of file"),
    "no TOML": (FILE, {"M_toml": "C = "}, "M.toml is not TOML"),
    "no text": (FILE, {"M_toml": b"\xff\xfe\x00"}, "it is not text"),
    "deep": (FILE, {"M_toml": "a = " + "[" * 5000}, "is not TOML"),
    "huge": (FILE, {"M_toml": MEDIUM + "#" * 1_000_001}, "larger than 1 MB"),
    "a CSV": ('file = "T.csv"', {"T_csv": csv()}, 'add law = "table"'),
    "a scene": (FILE, {"M_toml": MEDIUM + REST}, "must hold one table [medium] and nothing else"),
    "no medium": (FILE, {"M_toml": "x = 1"}, "names no medium"),
    "no table": (FILE, {"M_toml": "medium = 1"}, "must hold one table [medium]"),
    "itself": (FILE, {"M_toml": '[medium]\nfile = "M.toml"'}, "names no medium"),
    "wrong key": (FILE, {"M_toml": MEDIUM.replace("C =", "c =")}, "key: 'c' is unknown"),
    "wrong value": (FILE, {"M_toml": MEDIUM.replace("1.4", '"x"')}, "C"),
    "covariance": (FILE, {"M_toml": MEDIUM.replace("0.02,", "-0.02,")}, "covariance must be symmetric"),
    "table without": ('law = "table"', {}, "[medium]"),
    "table with": (TABLE + "\nf_t = [1]", {"T_csv": csv()}, "give either 'file' or 'psi', 'f_t', 'f_n'"),
    "no such table": (TABLE, {}, "No such file"),
    "columns": (TABLE, {"T_csv": csv("psi_deg,f_t,lift")}, "T.csv, line 2: the header has no column f_n"),
    "nan": (TABLE, {"T_csv": csv().replace("90.0,", "nan,")}, "T.csv, line 15: a row must be 3 finite numbers"),
    "short row": (TABLE, {"T_csv": csv().replace("82.5,", "82.5 ")}, "T.csv, line 14: a row must be 3"),
    "swapped": (TABLE, {"T_csv": csv("psi_deg,f_n,f_t")}, "the columns are exchanged"),
    "radians": (TABLE, {"T_csv": csv("psi,f_t,f_n").replace("psi,", "psi_deg,")}, "look like radians"),
    "degrees": (TABLE, {"T_csv": csv().replace("psi_deg,", "psi,")}, "write psi_deg for degrees"),
    "few": (TABLE, {"T_csv": "psi_deg,f_t,f_n\n0,1,0\n90,0,3\n"}, "rows of 3 to"),
    "half": (TABLE, {"T_csv": "psi_deg,f_t,f_n\n0,1,0\n20,1,1\n40,1,2\n60,0.4,2\n"}, "within 15 degrees of 0 and of 90"),
    "pushes": (TABLE, {"T_csv": csv() + "45,-9,1\n"}, "pushes"),
    "no drag": (TABLE, {"T_csv": "psi_deg,f_t,f_n\n0,0,0\n45,0,0\n90,0,0\n"}, "there is no drag"),
    "not text": (TABLE, {"T_csv": b"\x89PNG\x00\xff"}, "it is not text"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_media_get_one_line(name, folder):
    medium, files, said = BAD[name]
    file = written(folder, medium, **files)
    with pytest.raises(Refusal) as caught:
        scene.load(file)
    text = str(caught.value)
    assert said in text and "\n" not in text and len(text) < 410, text
    assert text.startswith(f"{file}: "), text


def test_outputs_do_not_replace_the_medium(folder):
    file = written(folder, TABLE, REST + GAUSS, T_csv=csv())
    for args in (["connection", "-o", "x.nc", "--plot", "p.png"], ["run", "-o", "."]):
        target = {"connection": "p.png", "run": "scene.toml"}[args[0]]
        (folder / target).hardlink_to(folder / "T.csv")
        where = [str(folder / a) if a[0] in ".xp" else a for a in args[1:]]
        code, _, err = geomech(args[0], file, *where)
        assert code == 2 and "it is an input" in err
    assert (folder / "T.csv").read_text() == csv()


@pytest.mark.parametrize(
    "columns",
    ["psi_deg,f_t,f_n", "psi,f_t,f_n", "psi_deg,F_parallel_N,F_perpendicular_N"],
)
def test_a_table_is_read_from_any_of_its_columns(columns, folder):
    found = scene.load(written(folder, TABLE, REST + GAUSS, T_csv=csv(columns)))
    want = Table(*rows(13))
    np.testing.assert_allclose(
        found.system.medium.traction(0.3, -0.4), want.traction(0.3, -0.4), rtol=1e-12
    )
    np.testing.assert_allclose(found.system.medium.f_n, want.f_n, rtol=1e-12)
    assert scene.inputs(found)[1:] == [folder / "T.csv"]
    inner = written(
        folder,
        'file = "M.toml"',
        REST + GAUSS,
        M_toml='[medium]\nlaw = "table"\nfile = "T.csv"',
    )
    assert scene.load(inner).system == found.system
    assert scene.inputs(scene.load(inner))[1:] == [folder / "M.toml", folder / "T.csv"]
    again = scene.parse(scene.toml(found))  # the numbers stand in it
    assert again.system == found.system and again.files == ()


def test_a_table_passes_through_its_rows_in_units_of_axial_drag():
    psi, f_t, f_n = (
        np.radians([0.0, 10, 30, 55, 70, 90]),
        [0.5, 0.6, 0.4, 0.3, 0.2, 0.01],
        [0.02, 0.6, 0.9, 1.2, 1.1, 1.3],
    )
    with pytest.raises(ValueError, match="f_n must be finite"):
        Table(psi, f_t, [*f_n[:-1], np.inf])
    table = Table(psi, f_t, f_n)
    for sign_t, sign_n, speed in (
        (1, 1, 1.0),
        (-1, 1, 1e-9),
        (1, -1, 1e9),
        (-1, -1, 3.0),
    ):
        got = np.array(
            table.traction(sign_t * speed * np.cos(psi), sign_n * speed * np.sin(psi))
        )
        want = (
            np.array(
                [np.append(f_t[:-1], 0.0) * sign_t, np.append(0.0, f_n[1:]) * sign_n]
            )
            / 0.5
        )
        np.testing.assert_allclose(got, want, rtol=1e-12, atol=1e-12)
    v = np.random.default_rng(0).normal(size=(2, 50))
    t, n = table.traction(*v)
    np.testing.assert_array_equal(
        table.traction(-v[0], v[1]), [-t, n]
    )  # and so mirror images mirror each other
    np.testing.assert_array_equal(table.traction(v[0], -v[1]), [t, -n])
    assert (t * v[0] + n * v[1] > 0).all()
    fine = np.linspace(0, np.pi / 2, 2001)
    across = table.traction(np.cos(fine), np.sin(fine))[1]
    for low, high, sign in zip(
        psi, psi[1:], np.sign(np.diff([0.0, *f_n[1:]]))
    ):  # monotone between rows: no overshoot
        between = across[(fine >= low) & (fine <= high)]
        assert (sign * np.diff(between) >= -1e-12).all()
    assert table.traction(0.0, 0.0) == (0.0, 0.0)
    again = Table(
        [*psi, psi[2], 2 * np.pi - psi[3]], [*f_t, 0.6, 0.5], [*f_n, 1.3, 1.4]
    )  # measured again: averaged
    got = again.traction(np.cos(psi[2:4]), np.sin(psi[2:4]))
    np.testing.assert_allclose(
        got, np.array([[0.5, 0.4], [1.1, 1.3]]) / 0.5, rtol=1e-12
    )


@pytest.mark.parametrize("eps", [0.0, 0.3])
def test_slopes_of_a_table_are_continuous_and_its_own(eps):
    table, h = Table(*rows(7)), 1e-6
    v = np.random.default_rng(2).normal(size=(2, 60))
    slopes = np.array(table.slopes(*v, eps))
    for k in range(2):
        step = h * np.eye(2)[k][:, None]
        up, down = (
            np.array(table.traction(*(v + sign * step), eps)) for sign in (1, -1)
        )
        np.testing.assert_allclose(
            slopes[k::2], (up - down) / (2 * h), rtol=1e-5, atol=1e-7
        )
    for psi in (*rows(7)[0], -np.pi / 6, np.pi):  # where the cubics meet
        sides = [
            np.array(table.slopes(np.cos(psi + d), np.sin(psi + d), eps))
            for d in (-1e-9, 1e-9)
        ]
        np.testing.assert_allclose(*sides, atol=1e-6)


def test_a_dense_table_is_the_law_it_came_from():
    """Drag, and body velocities by the same quadrature; of order 3 in the spacing."""
    rng, fine = np.random.default_rng(4), np.linspace(-np.pi, np.pi, 999)
    alpha, alphadot = rng.uniform(-1.5, 1.5, (2, 40, 2))
    body = Chain((1, 1.4, 0.8), frame="link-1")
    want = body_velocity(LOOSE, body, alpha, alphadot, loads="gauss:16")
    drag, motion = [], []
    for count in (46, 91, 181):
        table = Table(*rows(count))
        require_drag(table)
        error = np.array(table.traction(np.cos(fine), np.sin(fine))) - LOOSE.traction(
            np.cos(fine), np.sin(fine)
        )
        found = body_velocity(table, body, alpha, alphadot, loads="gauss:16")
        sliding = (want.status == "sliding") & (found.status == "sliding")
        assert sliding.sum() > 30 and not (found.status == "unconverged").any()
        drag.append(np.abs(error).max())
        motion.append(np.abs(found.xi - want.xi)[sliding].max())
    assert drag[2] < 1e-5 and motion[2] < 3e-6
    assert (np.log2(np.array(drag[:-1]) / drag[1:]) > 2.8).all()


def test_every_command_takes_a_table(folder):
    file = written(folder, TABLE, REST + GAUSS, T_csv=csv(count=181))
    plain = scene.parse(
        '[medium]\nlaw = "granular"\nC = 1.8\ngamma0_deg = 13.8\n' + REST + GAUSS
    )
    for args in (
        ["velocity", "--alpha", "0.5,0.3", "--alphadot", "1,0", "--json"],
        [
            "displacement",
            "--amplitudes",
            "0.5,0.9",
            "--json",
            "--tiers",
            "direct,path,area",
        ],
        ["explain"],
    ):
        code, out, err = geomech(args[0], file, *args[1:])
        assert code == 0, err
        if args[0] == "displacement":
            table = tabled_json(out)
            for tier in ("direct", "path", "area"):
                want = SceneTables(plain).poses(tier, amplitudes=[0.5, 0.9])
                np.testing.assert_allclose(table[tier], want, atol=3e-6)


@pytest.mark.parametrize("inner", ["nowhere.toml", "bad.toml", "to.toml"])
@pytest.mark.parametrize("name", ["three-link-glass", "c-leg", "xplorer"])
def test_a_file_within_a_scene_is_refused_with_its_place_once(name, inner, tmp_path):
    (tmp_path / "bad.toml").write_text("[medium]\nzeta = -1.0\nlaw = 'granular'\n")
    (tmp_path / "to.toml").write_text('[medium]\nfile = "nowhere.toml"\n')
    medium = f'[medium]\nfile = "{tmp_path / inner}"\n'
    text = re.sub(r"\[medium\][^\[]*", medium, scene.load(name).text)
    with pytest.raises(Refusal) as caught:
        scene.parse(text)
    told = str(caught.value)
    assert told.startswith("scene: [medium] ") and told.count("scene: ") == 1
    assert "::" not in told
