"""Media from files: what a calibration wrote, and tables of measured drag, whose curve
is checked against the law behind it."""

import math

import numpy as np
import pytest

import geomech
from geomech import scenes as scene
from rft import CATALOGUE, Granular, Table
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")

LOOSE = Granular(C=1.8, gamma0=math.radians(13.8))
REST = '[body]\nkind = "chain"\nlengths = [1, 1.3, 0.8]\n[gait]\nkind = "circle"\namplitude = 0.9\n'
GAUSS = '[numerics]\nloads = "gauss:12"\nphases = 32\ngrid = 7\nharmonics = 5\nextent = 1.5\n'
MEDIUM = '[medium]\nlaw = "granular"\nC = 1.4\ngamma0_deg = 12.0\nk = 2.4\ncovariance = [[0.02, 0.001], [0.001, 0.002]]\n'
TABLE = 'law = "table"\nfile = "T.csv"'
FILE = 'file = "M.toml"'
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


@pytest.mark.parametrize(
    ("text", "medium"),
    [
        (MEDIUM, WRITTEN),
        (MEDIUM.replace("[medium]\n", ""), WRITTEN),
        ('name = "glass-0.3mm-close"', CATALOGUE["glass-0.3mm-close"].medium),
    ],
)
def test_a_medium_is_read_from_beside_its_scene(text, medium, folder):
    file = written(folder, FILE, M_toml=text)
    found = scene.load(file)
    assert found.system.medium == medium
    assert scene.inputs(found) == [file, folder / "M.toml"]
    file.write_text('[system]\nkind = "swimmer"\nmedium = {file = "M.toml"}\n' + REST)
    assert scene.load(file) == found.changed(text=scene.load(file).text)


def test_a_scene_goes_into_the_medium_of_a_file(folder, monkeypatch):
    """What `geomech run --medium` does; from the current folder."""
    table = written(folder, TABLE, M_toml=MEDIUM, T_csv=csv())
    monkeypatch.chdir(folder)
    glass = scene.load("three-link-glass")
    own = scene.in_medium(glass, "M.toml")
    assert own == glass.changed(medium=WRITTEN)
    assert scene.inputs(own) == [folder / "M.toml"]
    assert scene.parse(scene.toml(own)).system == own.system  # not the built-in text
    medium = scene.in_medium(glass, "T.csv").system.medium
    assert medium == scene.load(table).system.medium


BAD = {
    "no such file": (FILE, {}, "cannot read 'M.toml': No such file"),
    "no name": ("file = 3", {}, 'give text in "quotes" instead of 3'),
    "no TOML": (FILE, {"M_toml": "C = "}, "M.toml is not TOML"),
    "deep": (FILE, {"M_toml": "a = " + "[" * 5000}, "is not TOML"),
    "huge": (FILE, {"M_toml": MEDIUM + "#" * 1_000_001}, "larger than 1 MB"),
    "a CSV": ('file = "T.csv"', {"T_csv": csv()}, 'add law = "table"'),
    "a scene": (
        FILE,
        {"M_toml": MEDIUM + REST},
        "must contain one table [medium] and nothing else",
    ),
    "no medium": (FILE, {"M_toml": "x = 1"}, "names no medium"),
    "wrong key": (
        FILE,
        {"M_toml": MEDIUM.replace("C =", "c =")},
        "key: 'c' is unknown",
    ),
    "covariance": (
        FILE,
        {"M_toml": MEDIUM.replace("0.02,", "-0.02,")},
        "covariance must be symmetric",
    ),
    "table without": ('law = "table"', {}, "[medium]"),
    "table with": (
        TABLE + "\nf_t = [1]",
        {"T_csv": csv()},
        "give either 'file' or 'psi', 'f_t', 'f_n'",
    ),
    "columns": (
        TABLE,
        {"T_csv": csv("psi_deg,f_t,lift")},
        "T.csv, line 2: the header has no column f_n",
    ),
    "nan": (
        TABLE,
        {"T_csv": csv().replace("90.0,", "nan,")},
        "T.csv, line 15: a row must be 3 finite numbers",
    ),
    "swapped": (TABLE, {"T_csv": csv("psi_deg,f_n,f_t")}, "the columns are swapped"),
    "radians": (
        TABLE,
        {"T_csv": csv("psi,f_t,f_n").replace("psi,", "psi_deg,")},
        "look like radians",
    ),
    "half": (
        TABLE,
        {"T_csv": "psi_deg,f_t,f_n\n0,1,0\n20,1,1\n40,1,2\n60,0.4,2\n"},
        "within 15 degrees of 0, one within 15 degrees of 90",
    ),
    "pushes": (TABLE, {"T_csv": csv() + "45,-9,1\n"}, "drives the motion"),
    "no drag": (
        TABLE,
        {"T_csv": "psi_deg,f_t,f_n\n0,0,0\n45,0,0\n90,0,0\n"},
        "there is no drag",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_media_get_one_line(name, folder):
    medium, files, said = BAD[name]
    file = written(folder, medium, **files)
    with pytest.raises(Refusal) as caught:
        scene.load(file)
    text = str(caught.value)
    assert text.startswith(f"{file}: ") and said in text


@pytest.mark.parametrize(
    "columns",
    ["psi_deg,f_t,f_n", "psi,f_t,f_n", "psi_deg,F_parallel_N,F_perpendicular_N"],
)
def test_a_table_is_read_from_any_of_its_columns(columns, folder):
    file = written(folder, TABLE, REST + GAUSS, T_csv=csv(columns))
    found = scene.load(file)
    medium = found.system.medium
    expected = Table(*rows(13))
    np.testing.assert_allclose(medium.f_n, expected.f_n, rtol=1e-12)
    np.testing.assert_allclose(medium.f_t, expected.f_t, rtol=1e-12)
    again = scene.parse(scene.toml(found))  # the numbers stand in it
    assert again.system == found.system and again.files == ()


def test_the_medium_of_a_file_may_name_a_table_in_another(folder):
    medium = f"[medium]\n{TABLE}"
    found = scene.load(written(folder, FILE, REST + GAUSS, M_toml=medium, T_csv=csv()))
    assert scene.inputs(found)[1:] == [folder / "M.toml", folder / "T.csv"]


PSI = np.radians([0.0, 10, 30, 55, 70, 90])
F_T = [0.5, 0.6, 0.4, 0.3, 0.2, 0.01]
F_N = [0.02, 0.6, 0.9, 1.2, 1.1, 1.3]


@pytest.mark.parametrize(
    ("t", "n", "speed"), [(1, 1, 1.0), (-1, 1, 1e-9), (1, -1, 1e9), (-1, -1, 3.0)]
)
def test_a_table_passes_through_its_rows_in_units_of_axial_drag(t, n, speed):
    """In all quadrants, and is zero across and along where it must be."""
    v = speed * np.array([t * np.cos(PSI), n * np.sin(PSI)])
    expected = np.array([t * np.append(F_T[:-1], 0.0), n * np.append(0.0, F_N[1:])])
    found = Table(PSI, F_T, F_N).traction(*v)
    np.testing.assert_allclose(found, expected / 0.5, rtol=1e-12, atol=1e-12)


def test_a_table_does_not_overshoot():
    """Between its rows it is monotone."""
    table = Table(PSI, F_T, F_N)
    fine = np.linspace(0, np.pi / 2, 2001)
    row = np.searchsorted(PSI, fine)
    rises = np.sign(np.diff([0.0, *F_N[1:]]))[row[1:] - 1]
    steps = np.diff(table.traction(np.cos(fine), np.sin(fine))[1])
    assert (rises * steps >= -1e-12)[row[1:] == row[:-1]].all()


def test_a_table_is_constant_beyond_its_last_angles():
    psi = np.radians([10, 40, 80])
    table = Table(psi, [1.0, 0.8, 0.1], [0.4, 1.9, 2.5])
    along = table.traction(np.cos([0.0, psi[0]]), np.sin([0.0, psi[0]]))[0]
    across = table.traction(np.cos([psi[2], np.pi / 2]), np.sin([psi[2], np.pi / 2]))[1]
    assert along[0] == pytest.approx(along[1])
    assert across[0] == pytest.approx(across[1])
    assert across[0] / along[0] == pytest.approx(2.5)


def test_rows_measured_again_are_averaged():
    again = [*PSI, PSI[2], 2 * np.pi - PSI[3]]
    table = Table(again, [*F_T, 0.6, 0.5], [*F_N, 1.3, 1.4])
    found = np.array(table.traction(np.cos(PSI[2:4]), np.sin(PSI[2:4])))
    np.testing.assert_allclose(0.5 * found, [[0.5, 0.4], [1.1, 1.3]], rtol=1e-12)


def test_a_dense_table_is_the_law_it_came_from():
    """To order 3 in the spacing."""
    fine = np.linspace(-np.pi, np.pi, 999)
    v = np.cos(fine), np.sin(fine)
    errors = []
    for count in (46, 91, 181):
        drag = np.subtract(Table(*rows(count)).traction(*v), LOOSE.traction(*v))
        errors.append(np.abs(drag).max())
    assert errors[-1] < 1e-5
    assert (np.diff(np.log2(errors)) < -2.8).all()


def test_a_medium_is_found_by_its_name_or_its_file(tmp_path):
    for name, law in geomech.media.CATALOGUE.items():
        assert geomech.medium(name) == law.medium
    assert geomech.medium("poppy-seeds-loose").zeta == 1.0
    file = tmp_path / "sand.toml"
    fit = geomech.fit_medium("short-rod-drag")
    fit.save(file)
    assert geomech.medium(file) == geomech.fitted_medium(fit)
