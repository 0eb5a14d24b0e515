"""The Python face: one study from a name or from parts, whose tables and pictures show
themselves."""

import doctest
import pkgutil
from importlib import import_module
from importlib.util import find_spec

import frozen
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refuses

import geomech
import rft
from geomech import plots
from geomech.mathematics.gaits import (
    Circle,
    Wave,
)
from geomech.scenes.parts import as_scene

SAND, CHAIN = rft.Granular(1.8, 0.24), rft.Chain((1, 1, 1))
SMALL = {"grid": 7, "phases": 32}


def slide(alpha, alphadot):
    """xi = (alphadot_1, alpha_1 alphadot_2, 0): dA = (0, 1, 0)."""
    return np.stack(
        [alphadot[..., 0], alpha[..., 0] * alphadot[..., 1], 0 * alphadot[..., 0]], -1
    )


@pytest.fixture(scope="module")
def study():
    return geomech.study("three-link-glass", **SMALL)


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        (("three-link-glass",), geomech.load("three-link-glass")),
        ((geomech.load("c-leg"),), geomech.load("c-leg")),
        (
            (SAND, CHAIN, Circle(0.5)),
            geomech.Scene(geomech.Swimmer(SAND, CHAIN), Circle(0.5)),
        ),
        (
            (Circle(0.5), CHAIN, "viscous-2"),
            geomech.Scene(geomech.Swimmer(rft.Viscous(), CHAIN), Circle(0.5)),
        ),
        (
            ((geomech.Swimmer(SAND, CHAIN), Circle(0.5)),),
            geomech.Scene(geomech.Swimmer(SAND, CHAIN), Circle(0.5)),
        ),
        ((slide,), geomech.Scene(slide, Circle())),
        (
            (SAND, rft.Chain((1,) * 5)),
            geomech.Scene(geomech.Swimmer(SAND, rft.Chain((1,) * 5)), Wave(joints=4)),
        ),
    ],
)
def test_a_scene_is_made_of_what_there_is(parts, expected):
    assert as_scene(*parts) == expected


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ((3,), "3 scene | instead"),
        ((CHAIN,), "Chain scene | instead"),
        ((SAND, CHAIN, 4), "Granular 4 scene | instead"),
        (("sand", CHAIN), "medium sand | where instead"),
        (
            ("viscous-2", rft.Backbone(30)),
            "gait 29 joints | instead",
        ),
        (("three-link-glas",), "did you mean three-link-glass | where instead"),
    ],
)
def test_what_makes_no_scene_is_refused(parts, says):
    with refuses(says):
        geomech.study(*parts)


def test_a_table_of_displacements_prints_and_plots_itself(study):
    table = study.displacement([0.5, 1.0], "direct")
    assert "displacement per cycle, direct tier" in repr(table)
    ax = table.plot(ax=plots.figure(3.0, 3.0)[1][0, 0])
    assert_allclose(ax.lines[0].get_ydata(), table["net_distance"].values[0])
    assert ax.get_ylabel() == "net distance per cycle (BL)"


def test_a_study_draws_and_films(study, tmp_path):
    drawn = study.ccf().plot(component="theta", ax=plots.figure(3.0, 3.0)[1][0, 0])
    assert drawn.get_title().endswith("turning")
    assert study.animate(tmp_path / "a.gif").read_bytes().startswith(b"GIF")


def test_the_best_gait_is_a_scene():
    best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    scene = geomech.best_scene(best)
    moved = geomech.displacement(scene, tiers="direct")
    assert_allclose(float(moved["net_distance"][0, 0]), float(best["value"]), rtol=1e-6)


def test_a_measured_gait_has_its_connection():
    assert "A" in geomech.fit_gait(frozen.FOLDER / "log.csv", harmonics=1)


def test_a_velocity_makes_a_study(study):
    moved = geomech.study(slide, Circle(0.5), **SMALL).displacement(tiers="direct")
    assert_allclose(moved["y"].values, np.pi / 4)
    options = {"limits": 1.0, "harmonics": 1}
    best = geomech.study(slide, **SMALL).optimize("displacement", **options)
    assert float(best["value"]) == pytest.approx(np.pi, rel=1e-3)


def test_a_medium_is_fitted_to_drag(tmp_path):
    fit = geomech.fit_medium("short-rod-drag")
    sand = geomech.fitted_medium(fit)
    assert sand.C == pytest.approx(1.49, abs=0.01)
    fit.save(tmp_path / "sand.toml")
    assert as_scene(str(tmp_path / "sand.toml"), CHAIN).system.medium == sand
    fit.save(tmp_path / "fit.nc")
    assert geomech.fitted_medium(geomech.load_result(tmp_path / "fit.nc")) == sand


def test_the_examples_of_a_study_run():
    assert doctest.testmod(import_module("geomech.api")).failed == 0


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (
            lambda: geomech.optimise("three-link-viscous", limits=0.0),
            "three-link-viscous limits number | where value",
        ),
        (lambda: geomech.fit_log("log.csv", body_length=-1), "body_length | value"),
        (
            lambda: geomech.fit_medium("short-rod-drag", raduis=0.1),
            "fit_medium raduis radius | instead",
        ),
        (
            lambda: geomech.displacement("three-link-viscous", tolerence=1e-3),
            "tolerence tolerance | instead",
        ),
    ],
)
def test_a_refusal_names_the_argument(ask, said):
    with refuses(said):
        ask()


def packages():
    for top in (geomech, rft):
        for module in pkgutil.walk_packages(top.__path__, f"{top.__name__}."):
            if module.ispkg and (
                module.name != "geomech.gym" or find_spec("gymnasium")
            ):
                yield module.name  # gym takes an extra


@pytest.mark.parametrize("name", [*packages()])
def test_packages_list_their_public_names(name):
    package = import_module(name)
    if hasattr(package, "__all__"):
        assert dir(package) == sorted(package.__all__)
        assert all(hasattr(package, x) for x in package.__all__)
