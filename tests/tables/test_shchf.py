"""Gaits of sysplotter: numbers, coefficients, points, and paths that it computed."""

import hashlib

import numpy as np
import pytest
from refusals import refuses
from scipy.io import savemat
from structs import cell, save

import rft
from geomech import scenes
from geomech.io import shchf
from geomech.mathematics.gaits import Butterfly, Circle, Shchf
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Scene
from geomech.studies.scene_tables import SceneTables

T = np.linspace(0, 2 * np.pi, 201)
CIRCLE = Circle(amplitude=0.8, centre=(0.3, -0.2))
# Of shchf_LowRe_MaxDisplacement.m and shchf_LowRe_MaxEfficiency.m
# (GeometricSystemPlotter, MIT).
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
    ("XV", "distance"), [(DISPLACEMENT, 0.1035), (EFFICIENCY, 0.0873)]
)
def test_its_optima_move_as_published(XV, distance):
    """Distance of the published optima (Ramasamy and Hatton)."""
    scene = Scene(Swimmer(rft.Viscous(2.0), rft.Chain()), Shchf(XV=XV))
    study = SceneTables(scene).with_numerics(phases=64)
    found = np.hypot(*study.poses("direct", None, [1.0])[0, :2])
    assert found == pytest.approx(distance, abs=5e-5)


def test_numbers_run_as_its_function_of_time():
    """stroke = Rot45 (sum a_k cos k t, sum b_k sin k t) at -t."""
    gait = Shchf(XV=EFFICIENCY)
    k = np.array([1, 3, 5])[:, None]
    a, b = np.reshape(EFFICIENCY, (3, 2)).T
    u = a @ np.cos(-k * T)
    v = b @ np.sin(-k * T)
    stroke = np.stack([u - v, u + v], -1) / np.sqrt(2)
    np.testing.assert_allclose(gait.shape(T), stroke, atol=1e-14)


def points(path, **changes):
    """Shapes at times, from any one on and in any unit."""
    alpha = CIRCLE.shape(T)
    t = 3.0 + 2.5 * T[:, None]
    savemat(path, {"alpha1": alpha[:, 0], "alpha2": alpha[:, 1], "t": t, **changes})
    return path


def coefficients(path):
    cos, sin = Butterfly().coefficients()
    first = {"A1": [0.0, *cos[0]], "B1": [0.0, *sin[0]]}
    savemat(path, {**first, "A2": [0.1, *cos[1]], "B2": [0.0, *sin[1]]})
    return path


def paths(path):
    """Two paths that it computed."""
    loci = np.empty((2, 1), object)
    loci[:, 0] = [{"shape": CIRCLE.shape(T, a)} for a in (0.4, 0.8)]
    save(path, {"x": 1.0}, p={"phi_locus_full": loci, "time_def": [0.0, 6.28]})
    return path


@pytest.mark.parametrize("form", [points, paths])
def test_points_make_the_curve_that_they_came_from(form, tmp_path):
    gait = Shchf(file=form(tmp_path / "a.mat"), number=1 if form is points else 2)
    np.testing.assert_allclose(gait.shape(T), CIRCLE.shape(T), atol=1e-7)
    np.testing.assert_allclose(gait.rate(T), CIRCLE.rate(T), atol=1e-5)


def test_points_are_reached_at_their_times(tmp_path):
    """From the first time to the last; and the last shape is the first."""
    t = np.array([2.0, 3.0, 5.0, 6.0, 10.0])
    alpha = np.array([[0.1, 0.2], [1, 0], [0.5, -1], [-0.5, 0.5], [0.1005, 0.2005]])
    variables = {"alpha1": alpha[:, 0], "alpha2": alpha[:, 1]}
    for times, phase in (({"t": t}, [0, 1, 3, 4, 8]), ({}, [0, 2, 4, 6, 8])):
        savemat(tmp_path / "a.mat", {**variables, **times})
        curve = shchf.read(tmp_path / "a.mat", 1)
        np.testing.assert_allclose(curve.phase, np.pi * np.array(phase) / 4, rtol=1e-12)
        np.testing.assert_array_equal(curve.points, [*alpha[:4], alpha[0]])


def test_coefficients_are_a_series_about_their_mean(tmp_path):
    gait = Shchf(file=coefficients(tmp_path / "a.mat"))
    butterfly = Butterfly(centre=(0.0, 0.1))
    np.testing.assert_allclose(gait.shape(T), butterfly.shape(T), atol=1e-14)
    np.testing.assert_allclose(gait.rate(T, 0.5), butterfly.rate(T, 0.5), atol=1e-14)
    assert (gait.harmonics, gait.centre) == (5, (0.0, 0.1))


@pytest.mark.parametrize(
    ("rows", "joints"),
    [
        ({"A1": [0.1, 1, 2], "A2": [0.2, 3, 4], "B1": [0, 5, 6], "B2": [0, 7, 8]}, 2),
        ({"A1": [0.1, 1], "B1": [0.0, 5]}, 1),
        ({"A1": [0.1, 1], "B1": [0.0, 5], "alpha3": 1.0}, 1),
    ],
)
def test_coefficients_may_be_of_any_number_of_joints(rows, joints, tmp_path):
    savemat(tmp_path / "a.mat", rows)
    assert Shchf(file=tmp_path / "a.mat").joints == joints


def test_a_scene_names_its_file(tmp_path):
    points(tmp_path / "a.mat")
    text = '[medium]\nlaw = "viscous"\n[body]\nkind = "chain"\n'
    text += '[gait]\nkind = "shchf"\nfile = "a.mat"\n'
    (tmp_path / "s.toml").write_text(text)
    scene = scenes.load(tmp_path / "s.toml")
    assert scene.gait == Shchf(file=tmp_path / "a.mat")
    assert tmp_path / "a.mat" in scenes.inputs(scene)
    digest = hashlib.sha256((tmp_path / "a.mat").read_bytes()).hexdigest()
    assert scene.gait.sha256 == digest


NO_PATH = {"p": {"phi_locus_full": cell(np.zeros((1, 3, 3)), (1,))}}
ONE_JOINT = {"A1": [0.0, 1.0], "B1": [0.0, 1.0]}


@pytest.mark.parametrize(
    ("variables", "settings", "said"),
    [
        ({"x": 1.0}, {}, "no gait alpha1 alpha2 | because instead"),
        ({"A1": [0.0, 1.0], "B1": [0.0]}, {}, "no gait | because instead"),
        ({"A1": [0.1], "B1": [0.0]}, {}, "no gait | because instead"),
        (
            {"A1": [0.1, 1], "A2": [0.1, 1], "B1": [0.0, 5]},
            {},
            "no gait | because instead",
        ),
        ({"A2": [0.1, 1], "B2": [0.0, 5]}, {}, "no gait | because instead"),
        (ONE_JOINT, {"number": 2}, "gait number 2 number | instead"),
        (
            {"p": {"phi_def": 1.0}},
            {},
            "no gait function handles | because instead",
        ),
        (NO_PATH, {}, "p.phi_locus_full{1} shapes | instead"),
        (NO_PATH, {"number": 2}, "1 gaits number 2 number = 1 1 | instead"),
        (NO_PATH, {"number": 0}, "1 gaits number 0 number = 1 1 | instead"),
        (ONE_JOINT, {"sha256": "0"}, "sha256 | instead"),
    ],
)
def test_files_without_a_gait_are_refused(variables, settings, said, tmp_path):
    savemat(tmp_path / "a.mat", variables)
    with refuses(said):
        Shchf(file=tmp_path / "a.mat", **settings)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "XV file | instead"),
        ({"XV": (1.0, 1.0), "file": "a.mat"}, "XV file | instead"),
        ({"XV": (1.0, 1.0, 0.1)}, "XV a1 b1 a3 b3 | value"),
        ({"file": "none.mat"}, "gait none.mat file | because"),
        ({"file": 3}, "file file 3 | value"),
    ],
)
def test_settings_that_make_no_gait_are_refused(settings, said):
    with refuses(said):
        Shchf(**settings)


SQUARE = {"alpha1": [0, 1, 1, 0], "alpha2": [0, 0, 1, 0], "t": [1, 2, 3, 4]}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"alpha1": 31.42 * np.sin(T)}, "up 31.42 rad | instead"),
        (
            {"alpha2": np.sin(T) + 2.1e-3 * T / T[-1]},
            "closed 0.0021 rad | because instead",
        ),
        (
            {"alpha1": [0, 1, 0], "alpha2": [0, 0, 0], "t": [1, 2, 3]},
            "four shapes | instead",
        ),
        ({"t": [*T[:100], *T[99:-1]]}, "four shapes times | instead"),
        ({"t": T[:9]}, "four shapes times | instead"),
        ({"alpha2": np.sin(T[:-1])}, "four shapes | instead"),
        (
            {"alpha2": np.nan * T},
            "alpha2 finite 0 0 file | instead",
        ),
        ({"alpha1": "words"}, "alpha1 real"),
    ],
)
def test_points_that_make_no_gait_are_refused(changes, said, tmp_path):
    with refuses(said):
        Shchf(file=points(tmp_path / "a.mat", **changes))


@pytest.mark.parametrize(
    "changes",
    [
        {"alpha1": 31.4 * np.sin(T)},
        {"alpha2": np.sin(T) + 1.9e-3 * T / T[-1]},
        SQUARE,
        {"A1": [0.0, 1.0]},
    ],
)
def test_points_within_their_bounds_are_a_gait(changes, tmp_path):
    """A gap of a thousandth of the size of the loop, 2 here, is none."""
    assert Shchf(file=points(tmp_path / "a.mat", **changes)).joints == 2
