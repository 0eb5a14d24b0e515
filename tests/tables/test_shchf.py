"""Gaits of sysplotter's: in numbers, as coefficients, as points, and as the paths that it computed."""

import dataclasses

import numpy as np
import pytest
from commands import geomech
from scipy.io import savemat
from structs import cell, save

import rft
from geomech import scenes
from geomech.io import shchf
from geomech.mathematics.gaits import Butterfly, Circle, Shchf
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Scene
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

T = np.linspace(0, 2 * np.pi, 201)
CIRCLE = Circle(amplitude=0.8, centre=(0.3, -0.2))
# Of shchf_LowRe_MaxDisplacement.m and shchf_LowRe_MaxEfficiency.m (GeometricSystemPlotter, MIT).
DISPLACEMENT = (
    2.0179559064,
    1.3533851447,
    0.0131125198,
    0.2638237593,
    -0.0314561737,
    -0.0036262872,
)
EFFICIENCY = (
    1.4953987229,
    1.3266008863,
    0.0832538545,
    0.0892271481,
    -0.0346957506,
    -0.0447595518,
)


@pytest.mark.parametrize(
    ("XV", "distance", "length"),
    [(DISPLACEMENT, 0.1035, None), (EFFICIENCY, 0.0873, 0.7866)],
)
def test_its_optima_move_as_published(XV, distance, length):
    """Distance and path length of the published optima (Ramasamy and Hatton)."""
    study = SceneTables(
        Scene(Swimmer(rft.Viscous(2.0), rft.Chain()), Shchf(XV=XV))
    ).with_numerics(phases=64)
    assert np.hypot(*study.poses("direct", None, [1.0])[0, :2]) == pytest.approx(
        distance, abs=5e-5
    )
    assert length is None or study.effort()["path_length"][0] == pytest.approx(
        length, abs=5e-5
    )


def test_numbers_run_as_its_function_of_time():
    """stroke = Rot45 (sum a_k cos k t, sum b_k sin k t) at -t."""
    k, (a, b) = np.array([1, 3, 5])[:, None], np.reshape(EFFICIENCY, (3, 2)).T
    u, v = a @ np.cos(-k * T), b @ np.sin(-k * T)
    scene = Scene(Swimmer(rft.Viscous(2.0), rft.Chain()), Shchf(XV=EFFICIENCY))
    assert scenes.parse(scenes.toml(scene)).gait == scene.gait
    np.testing.assert_allclose(
        Shchf(XV=EFFICIENCY).shape(T),
        np.stack([u - v, u + v], -1) / np.sqrt(2),
        atol=1e-14,
    )


def points(path, **changes):
    alpha = CIRCLE.shape(T)
    t = 3.0 + 2.5 * T  # from any time on, in any unit
    savemat(
        path, {"alpha1": alpha[:, 0], "alpha2": alpha[:, 1], "t": t[:, None], **changes}
    )
    return path


def coefficients(path):
    cos, sin = Butterfly().coefficients()
    rows = {f"A{k + 1}": [0.1 * k, *cos[k]] for k in (0, 1)} | {
        f"B{k + 1}": [0.0, *sin[k]] for k in (0, 1)
    }
    savemat(path, {name: np.array(row)[:, None] for name, row in rows.items()})
    return path


def paths(path, version=5):
    loci = np.empty((2, 1), object)
    loci[:, 0] = [{"shape": CIRCLE.shape(T, a)} for a in (0.4, 0.8)]
    save(path, {"x": 1.0}, version, p={"phi_locus_full": loci, "time_def": [0.0, 6.28]})
    return path


@pytest.mark.parametrize("form", [points, paths, lambda path: paths(path, 7.3)])
def test_points_make_the_curve_that_they_came_from(form, tmp_path):
    if form is not points and form is not paths:
        pytest.importorskip("h5py")
    gait = Shchf(file=form(tmp_path / "a.mat"), number=1 if form is points else 2)
    np.testing.assert_allclose(gait.shape(T), CIRCLE.shape(T), atol=1e-7)
    np.testing.assert_allclose(gait.rate(T), CIRCLE.rate(T), atol=1e-5)
    assert gait.joints == 2


def test_coefficients_are_a_series_about_their_mean(tmp_path):
    gait = Shchf(file=coefficients(tmp_path / "a.mat"))
    np.testing.assert_allclose(
        gait.shape(T), Butterfly(centre=(0.0, 0.1)).shape(T), atol=1e-14
    )
    np.testing.assert_allclose(
        gait.rate(T, 0.5), Butterfly(centre=(0.0, 0.1)).rate(T, 0.5), atol=1e-14
    )
    assert gait.harmonics == 5 and gait.centre == (0.0, 0.1)
    assert dataclasses.replace(gait, amplitude=0.5).middle.tolist() == [0.0, 0.1]


@pytest.mark.parametrize("form", [points, coefficients])
def test_a_scene_names_its_file(form, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    form(tmp_path / "a.mat")
    (tmp_path / "s.toml").write_text(
        '[medium]\nlaw = "viscous"\nratio = 2.0\n[body]\nkind = "chain"\nlengths = [1, 1, 1]\n'
        '[gait]\nkind = "shchf"\nfile = "a.mat"\n'
    )
    scene = scenes.load("s.toml")
    assert (
        scenes.parse(scenes.toml(scene)).gait
        == scene.gait
        == Shchf(file=tmp_path / "a.mat")
    )
    code, out, err = geomech(
        "displacement", "s.toml", "--amplitudes", "0.5,1", "--tiers", "direct"
    )
    assert (code, err) == (0, "") and "amplitude of the shchf (scale)" in out
    assert geomech("displacement", "s.toml", "--amplitudes", "1", "-o", "a.mat")[0] == 2


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"alpha1": T},
            r"a.mat has alpha1, alpha2, ... that do not close: .* 6.28 rad from the first; end it where it begins",
        ),
        (
            {"alpha1": 60 * np.sin(T)},
            "has alpha1, alpha2, ... up to 60 where angles are in rad: convert it",
        ),
        ({"alpha2": np.nan * T}, r"has alpha2 that is not finite .* \(0, 0\): mend it"),
        ({"t": -T}, "no four shapes or more at ascending times"),
        ({"t": T[:9]}, "no four shapes or more at ascending times"),
    ],
)
def test_points_that_make_no_gait_are_refused(changes, said, tmp_path):
    with pytest.raises(Refusal, match=said):
        Shchf(file=points(tmp_path / "a.mat", **changes))


@pytest.mark.parametrize(
    ("variables", "settings", "said"),
    [
        ({"x": 1.0}, {}, "a.mat has no gait: one is alpha1, alpha2"),
        ({"A1": [0.0, 1.0], "B1": [0.0]}, {}, "has no gait"),
        (
            {"A1": [0.0, 1.0], "B1": [0.0, 1.0]},
            {"number": 2},
            "has one gait, and no 2: drop number",
        ),
        ({"p": {"phi_def": 1.0}}, {}, "has no gait: .* function handles are not run"),
        (
            {"p": {"phi_locus_full": cell(np.zeros((1, 3, 3)), (1,))}},
            {},
            r"p.phi_locus_full\{1\} without shapes",
        ),
        (
            {"p": {"phi_locus_full": cell(np.zeros((1, 3, 3)), (1,))}},
            {"number": 2},
            "has 1 gaits, and no 2: take number",
        ),
        (
            {"A1": [0.0, 1.0], "B1": [0.0, 1.0]},
            {"sha256": "0"},
            "is not the file whose sha256 is given",
        ),
    ],
)
def test_files_without_a_gait_are_refused(variables, settings, said, tmp_path):
    savemat(tmp_path / "a.mat", variables)
    with pytest.raises(Refusal, match=said):
        Shchf(file=tmp_path / "a.mat", **settings)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "either XV or a file: give one"),
        ({"XV": (1.0, 1.0), "file": "a.mat"}, "either XV or a file: give one"),
        ({"XV": (1.0, 1.0, 0.1)}, "XV must be pairs a1, b1, a3, b3"),
        ({"file": "none.mat"}, "cannot read the gait none.mat: No such file"),
        ({"file": 3}, "file must be the name of a .mat file, got 3"),
    ],
)
def test_settings_that_make_no_gait_are_refused(settings, said):
    with pytest.raises(Refusal, match=said):
        Shchf(**settings)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"alpha1": 31.4 * np.sin(T)}, ""), ({"alpha1": 31.42 * np.sin(T)}, "up to 31.42 where angles are in rad: convert it"),
        ({"alpha2": np.sin(T) + 1.9e-3 * T / T[-1]}, ""),
        ({"alpha2": np.sin(T) + 2.1e-3 * T / T[-1]}, "do not close: .* is 0.0021 rad from"),
        ({"alpha1": [[0, 1, 1, 0]], "alpha2": [[0, 0, 1, 0]], "t": [[1, 2, 3, 4]]}, ""),
        ({"alpha1": [[0, 1, 0]], "alpha2": [[0, 0, 0]], "t": [[1, 2, 3]]}, "no four shapes or more"),
        ({"t": [*T[:100], *T[99:-1]]}, "no four shapes or more at ascending times"),
        ({"alpha2": np.sin(T[:-1])}, "no four shapes"),
        ({"A1": [0.0, 1.0]}, ""), ({"alpha1": "words"}, "has alpha1 that is no array of real numbers"),
    ],
)  # fmt: skip
def test_points_close_and_are_in_rad(changes, said, tmp_path):
    """A gap of a thousandth of the size of the loop, 2 here, is none."""
    if not said:
        assert Shchf(file=points(tmp_path / "a.mat", **changes)).joints == 2
        return
    with pytest.raises(Refusal, match=said):
        Shchf(file=points(tmp_path / "a.mat", **changes))


def test_curves_run_from_the_first_time_to_the_last():
    """At uneven times, too; and the last shape is the first."""
    t = np.array([2.0, 3.0, 5.0, 6.0, 10.0])
    alpha = np.array(
        [[0.1, 0.2], [1.0, 0.0], [0.5, -1.0], [-0.5, 0.5], [0.1005, 0.2005]]
    )
    variables = {"alpha1": alpha[:, 0], "alpha2": alpha[:, 1]}
    found = shchf._curve({**variables, "t": t}, 1)
    np.testing.assert_allclose(
        found.phase, 2 * np.pi * np.array([0, 1, 3, 4, 8]) / 8, rtol=1e-12
    )
    np.testing.assert_array_equal(found.points, [*alpha[:4], alpha[0]])
    np.testing.assert_allclose(
        shchf._curve(variables, 1).phase, 2 * np.pi * np.arange(5) / 4, rtol=1e-12
    )


@pytest.mark.parametrize(("number", "size"), [(1, 0.4), (2, 0.8), (0, None), (3, None)])
def test_paths_are_counted_from_one(number, size, tmp_path):
    paths(tmp_path / "a.mat")
    if size:
        assert (
            np.abs(
                shchf.read(tmp_path / "a.mat", number).points - CIRCLE.shape(T, size)
            ).max()
            < 1e-12
        )
        return
    with pytest.raises(
        Refusal, match=f"has 2 gaits, and no {number}: take number = 1 to 2"
    ):
        shchf.read(tmp_path / "a.mat", number)


@pytest.mark.parametrize(
    ("rows", "joints"),
    [
        ({"A1": [0.1, 1, 2], "A2": [0.2, 3, 4], "B1": [0, 5, 6], "B2": [0, 7, 8]}, 2), ({"A1": [0.1, 1], "B1": [0.0, 5]}, 1),
        ({"A1": [0.1, 1, 2], "A2": [0.2, 3], "B1": [0, 5, 6], "B2": [0, 7, 8]}, 0), ({"A1": [0.1], "B1": [0.0]}, 0),
        ({"A1": [0.1, 1], "A2": [0.1, 1], "B1": [0.0, 5]}, 0), ({"A2": [0.1, 1], "B2": [0.0, 5]}, 0),
    ],
)  # fmt: skip
def test_coefficients_come_in_pairs_of_one_length(rows, joints):
    variables = {name: np.array(row, float) for name, row in rows.items()}
    if not joints:
        with pytest.raises(Refusal, match="has no gait: one is alpha1"):
            shchf._curve(variables, 1)
        return
    found = shchf._curve(variables, 1)
    for letter, values in (("A", found.cos), ("B", found.sin)):
        np.testing.assert_array_equal(
            values, [rows[f"{letter}{k + 1}"] for k in range(joints)]
        )
