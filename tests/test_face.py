"""The Python face: one study from a name or from parts, whose tables and pictures show themselves."""

import doctest
import pkgutil
from importlib import import_module
from importlib.util import find_spec

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tabled import swept_table

import geomech
import rft
from geomech import Refusal, plots
from geomech.app import Study
from geomech.gaits import Butterfly, Circle, Ellipse, Fourier, Points, Sine, Wave
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


def test_effects_and_lengths_are_lists_too_and_sizes_have_places():
    scene = as_scene(
        SAND, rft.Chain([1, 1, 1]), effects=[rft.Transient(0.1)], phases=32
    )
    assert scene.system.effects == (rft.Transient(0.1),) and scene.numerics.phases == 32
    study = Study(SAND, rft.Chain([1, 1, 1]), effects=[rft.Transient(0.1)], phases=32)
    assert (study.scene.system, study.scene.numerics) == (scene.system, scene.numerics)
    assert hash(
        geomech.Swimmer(SAND, rft.Chain([1, 1, 1]), [rft.Transient(0.1)])
    ) == hash(scene.system)
    assert [g(0.3).amplitude for g in (Circle, Butterfly, Wave, Sine)] == [0.3] * 4
    assert hash(Ellipse([1.0, 0.5], 0.2)) == hash(
        Ellipse(semi_axes=(1.0, 0.5), tilt=0.2)
    )
    assert (
        Fourier([[1.0], [0.0]], [[0.0], [1.0]]).joints
        == Points([(1, 0), (0, 1), (-1, -1)]).joints
        == 2
    )


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ((3,), "no scene of 3: give the name"),
        ((CHAIN,), "no scene of Chain"),
        ((SAND, CHAIN, 4), "no scene of Granular.*, 4: give"),
        (("sand", CHAIN), "medium: 'sand' is unknown"),
        (("viscous-2", rft.Backbone(30)), "29 joints has no usual gait"),
        (("three-link-glas",), "did you mean"),
    ],
)
def test_what_makes_no_scene_is_refused(parts, says):
    with pytest.raises(Refusal, match=says):
        geomech.study(*parts)
    with pytest.raises(Refusal, match=says):
        geomech.optimise(parts)


def test_a_table_of_displacements_prints_and_plots_itself(study):
    table = study.displacement([0.5, 1.0], "direct")
    assert_allclose(
        table["direct"], study.poses("direct", amplitudes=[0.5, 1.0]), atol=1e-5
    )
    assert (
        "displacement per cycle (BL), direct tier" in repr(table)
        and "<table" in table._repr_html_()
    )
    (line, *_), ax = table.plot().lines, table.plot()
    assert_allclose(line.get_ydata(), table["net_distance"]["direct"])
    assert (ax.get_ylabel(), ax.get_xlabel()) == (
        "net distance per cycle (BL)",
        "radius of the circle (rad)",
    )
    assert study.displacement(tiers="direct")["amplitude"] == [
        study.scene.gait.amplitude
    ]
    cheap = study.displacement(0.5, tolerance=1e-2)
    assert max(cheap["estimate"][cheap["tier"]]) <= 1e-2
    with pytest.raises(Refusal, match="tolerance chooses the tier: drop tiers"):
        study.displacement(0.5, "direct", tolerance=1e-2)


def test_a_study_draws_and_films(study, tmp_path):
    assert study.plot_ccf("theta").get_title().endswith("turning")
    assert study.plot_connection("y").get_title().endswith("sideways")
    assert (
        len(study.plot_displacement(tiers=["path"], quantity="x").lines[0].get_xdata())
        == 10
    )
    assert study.animate(tmp_path / "a.gif").read_bytes().startswith(b"GIF")
    with pytest.raises(Refusal, match="component: 'z' is unknown"):
        study.plot_ccf("z")
    with pytest.raises(Refusal, match="end the name in"):
        study.animate("a.txt")


def test_maps_of_many_joints_are_slices():
    four = geomech.study("viscous-2", rft.Chain((1, 1, 1, 1)), grid=5)
    assert_allclose(four.ccf((1, 3)).values, four.plane((0, 2)).ccf.values)
    ax = four.plot_ccf("x", (2, 3))
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        r"$\alpha_{2}$ (rad)",
        r"$\alpha_{3}$ (rad)",
    )
    with pytest.raises(Refusal, match=r"3 joints has no one map: give pair=\(1, 2\)"):
        four.ccf()


def test_a_study_with_other_numerics_or_frame_is_one_too(study):
    assert (
        type(study.with_numerics(phases=64)) is type(study.in_frame("link-1")) is Study
    )
    assert study.with_numerics(phases=64).fitted is study.fitted


def test_functions_take_whatever_makes_a_scene(study):
    assert_allclose(
        geomech.study(slide, Circle(0.5), **SMALL).displacement(tiers="direct")["y"][
            "direct"
        ],
        np.pi / 4,
    )
    best = geomech.study(slide, grid=7).optimize(
        "displacement", limits=1.0, harmonics=1
    )
    assert best.value == pytest.approx(np.pi, rel=1e-3) and repr(best).startswith(
        "scene: displacement 3.14"
    )
    assert best.plot().get_xlabel() == r"$\alpha_{1}$ (rad)"
    swept = swept_table(geomech.sweep(study, {"medium.C": [1.0, 2.0]}))
    assert_allclose(
        swept["displacement"], study.sweep({"medium.C": [1.0, 2.0]})["displacement"]
    )
    assert swept.plot().axes


def test_a_medium_is_fitted_to_drag(tmp_path):
    sand = geomech.fit_medium("short-rod-drag")
    assert sand.medium.C == pytest.approx(1.49, abs=0.01) and "granular law" in repr(
        sand
    )
    sand.save(tmp_path / "sand.toml")
    assert as_scene(
        str(tmp_path / "sand.toml"), CHAIN
    ).system.medium.C == pytest.approx(sand.medium.C)
    assert sand.plot().axes
    with pytest.raises(Refusal, match="size: 'width' is unknown"):
        geomech.fit_medium("short-rod-drag", width=0.1)


@pytest.mark.parametrize(
    "draw", [plots.ccf_map, plots.vector_field, plots.displacement, plots.optimum_map]
)
def test_a_picture_of_something_else_says_what_it_draws(draw, study):
    with pytest.raises(Refusal, match=f"{draw.__name__} draws an? .*, got Study"):
        draw(study)


def test_the_examples_of_a_study_run():
    assert doctest.testmod(import_module("geomech.app.study")).failed == 0


def test_a_refusal_names_the_argument_and_a_command_its_option():
    from commands import geomech as command

    with pytest.raises(
        Refusal, match="three-link-viscous: limits must be a number from"
    ):
        geomech.optimise("three-link-viscous", limits=0.0)
    code, _, err = command(
        "optimize", "three-link-viscous", "--objective", "turning", "--starts", "0"
    )
    assert (
        code == 2
        and "three-link-viscous: --starts must be a whole number from 1 to 1000, got 0"
        in err
    )
    with pytest.raises(Refusal, match="body_length must be"):
        geomech.fit_log("log.csv", body_length=-1)
    code, _, err = command(
        "displacement", "three-link-viscous", "--amplitudes", "1", "--tol", "0"
    )
    assert code == 2 and "--tol must be a number > 0" in err


def test_packages_list_their_public_names():
    for top in (geomech, rft):
        for module in pkgutil.walk_packages(top.__path__, f"{top.__name__}."):
            if module.ispkg and hasattr(
                package := import_module(module.name), "__all__"
            ):
                assert dir(package) == sorted(package.__all__), module.name
                if module.name != "geomech.gym" or find_spec("gymnasium"):  # an extra
                    assert all(hasattr(package, name) for name in package.__all__), (
                        module.name
                    )
    assert {"sweep", "accuracy", "motion"} <= set(dir(geomech.studies)) and not hasattr(
        geomech.studies, "sweeps"
    )
    assert {"Chain", "laws", "walking"} <= set(dir(rft)) and "importlib" not in dir(rft)
