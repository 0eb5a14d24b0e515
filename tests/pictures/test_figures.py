"""The scripts of figures/: their sourced numbers, and that they draw these."""

import dataclasses
import importlib
import inspect
import math
import pkgutil
import sys

import numpy as np
import pytest
from artists import curve, curves, drawn
from scipy.integrate import trapezoid

import figures
from figures.paper import (
    fig05c_force_law,
    fig06b_plate_stress,
    fig07_stress_maps,
    fig08a_rods,
    fig08b_legs,
    fig11c_connection,
    fig11d_ccf,
    fig11e_displacement,
)
from figures.swimmers import compliance, fluid_models, frames_area
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables

pytestmark = pytest.mark.usefixtures("fastest")
SCRIPTS = {
    info.name
    for info in pkgutil.walk_packages(figures.__path__, "figures.")
    if not info.ispkg and ".campaigns." not in info.name
} - {
    "figures.style",
    "figures.peers",
    "figures.plain_loop",
    "figures.accuracy.others",
}


# All of them


@pytest.mark.parametrize("name", sorted(SCRIPTS))
def test_every_script_computes_and_draws(name):
    module = importlib.import_module(name)
    assert module.__doc__ and module.compute.__doc__
    assert list(inspect.signature(module.draw).parameters) == ["numbers"]


def test_a_script_writes_the_file_it_is_asked_for(tmp_path, monkeypatch):
    file = tmp_path / "mine.pdf"
    monkeypatch.setattr(sys, "argv", ["fig05c_force_law.py", str(file)])
    numbers = fig05c_force_law.compute(3)
    figures.main("fig05c", lambda: numbers, fig05c_force_law.draw, lambda _: "3 angles")
    assert file.exists()


# Scripts, what they compute coarsely, the axes, the label of a curve, its numbers.
CURVES = [
    (
        fig08a_rods,
        {"depths": 3},
        1,
        "square",
        lambda found: found["rods"]["square"]["keep"]["drag"],
    ),
    (
        fig11e_displacement,
        {"amplitudes": {"circle": [0.5, 1.0]}},
        0,
        "force balance",
        lambda found: found["tables"]["circle"].at(tier="direct")["x"].values,
    ),
    (
        frames_area,
        {"count": 2},
        0,
        "area, link-2 frame",
        lambda found: np.hypot(*found["circle"]["link-2"]["area"][:, :2].T),
    ),
    (
        compliance,
        {"ratios": (0.5, 1.0), "slacks": (0.0, 0.3)},
        2,
        "$A$ = 1 rad",
        lambda found: found["cable"]["x"][0],
    ),
    (
        fluid_models,
        {"amplitudes": (0.5, 1.0), "slendernesses": (24, 48), "segments": (4, 8)},
        0,
        "touching beads",
        lambda found: found["by_amplitude"]["touching beads"],
    ),
]


@pytest.mark.parametrize(("module", "coarse", "axes", "label", "expected"), CURVES)
def test_a_curve_shows_its_numbers(module, coarse, axes, label, expected, tmp_path):
    numbers = module.compute(**coarse)
    ax = drawn(module, numbers, tmp_path).axes[axes]
    np.testing.assert_allclose(curve(ax, label)[1], expected(numbers))


# Scripts whose numbers other tests hold, and what is enough for a picture.
COARSE = {
    "accuracy.kinks": {"grid": 21, "directions": 24},
    "swimmers.optimal_gaits": {"harmonics": 1, "starts": 1, "grid": 7, "phases": 16},
    "robots.sand_gaits": {"generations": 1, "walks": 4, "seconds": 0.3},
    "robots.flipper_steps": {
        "cycles": 1,
        "shown": (0.02,),
        "depths": (0.02,),
        "sweeps": (80,),
        "weakenings": (0.5,),
        "radii": (1.0,),
        "rates": (8.0,),
        "strengths": (1.0,),
    },
    "robots.walking_mujoco": {
        "study": {"steps": (8, 10)},
        "finest": {"steps": 12},
        "frequencies": {},
    },
    "robots.walking_slopes": {
        "angles": (0, 5),
        "frequencies": (2.0, 4.0),
        "mapped": (0, 20),
        "fine": {"steps": 12, "elements": 6},
    },
}


@pytest.mark.parametrize("name", COARSE)
def test_a_script_draws_what_it_computes(name, tmp_path):
    if name.startswith("robots."):
        pytest.importorskip("mujoco.batch", reason="needs mujoco.batch")
    module = importlib.import_module(f"figures.{name}")
    assert drawn(module, module.compute(**COARSE[name]), tmp_path).axes


# Fig. 5(c), 11


def test_fig05c():
    numbers = fig05c_force_law.compute()
    # Eq. 3 at psi = 90 degrees with C = 1.8, gamma0 = 13.8 degrees.
    across = 1 + 1.8 * math.cos(math.radians(13.8))
    assert numbers["loose"][1, -1] == pytest.approx(across, rel=1e-12)
    # "F_perp is enhanced in GM"
    assert (numbers["loose"][1, 1:] > numbers["viscous"][1, 1:]).all()
    fit = numbers["fit"]  # that came with the data
    found = fit["C"], math.degrees(fit["gamma0"]), fit["k"]
    assert found == pytest.approx((1.49, 12.6, 2.49), rel=0.005)


def test_fig11c():
    closed = fig11c_connection.compute("three-link-viscous", grid=21, extent=1.0)
    straight = closed["connection"].A[:, :, 10, 10]
    expected = [[0, 0], [-1 / 18, -1 / 18], [7 / 27, -7 / 27]]
    np.testing.assert_allclose(straight, expected, atol=1e-14)


def test_the_misfit_of_the_plane_in_loose_glass():
    """26 to 33 % rms of each component in the middle-link frame."""
    glass = load("three-link-glass").with_numerics(directions=24)
    body = dataclasses.replace(glass.system.body, frame="link-2")
    fitted = SceneTables(glass.changed(body=body)).fitted
    squares = (fitted.residual**2).mean((1, 2)) / (fitted.speed**2).mean((1, 2))
    ends = np.sqrt([squares.min(), squares.max()])
    assert ends == pytest.approx([0.26, 0.33], abs=0.005)


def test_fig11d():
    coarse = {"grid": 41, "extent": 1.0, "interpolation": 5}
    closed = fig11d_ccf.compute("three-link-viscous", **coarse)
    assert closed["ccf"].values[0, 20, 20] == pytest.approx(-5 / 243, rel=1e-6)


def test_fig11e():
    """The butterfly outdoes every circle at its published size (Fig. 11(e))."""
    amplitudes = {"circle": [0.5, 1.0, 1.75], "butterfly": [1.0]}
    tables = fig11e_displacement.compute(amplitudes=amplitudes)["tables"]
    circle, butterfly = (
        tables[name].at(tier="direct")["net_distance"].values for name in amplitudes
    )
    np.testing.assert_allclose(circle, [0.0121, 0.0638, 0.1378], rtol=0.01)
    assert butterfly[0] > 1.5 * 0.1378


# Fig. 6 to 8: the vertical plane


def test_fig06b(tmp_path):
    """sigma = |z| alpha, once all of the plate is under."""
    angles = {
        (0, 90): (0, 1),
        (0, -90): (0, -0.25),
        (90, 0): (0.37, 0.037),
        (0, 0): (0.136, 0.375),
        (45, 45): (0.3595, 0.5702),
    }
    found = fig06b_plate_stress.compute("generic", tuple(angles))
    depth = found["depth"]
    under = depth > found["under"]
    for angle, alpha in angles.items():
        plate = found["plates"][angle]
        np.testing.assert_allclose(plate["alpha"], alpha, atol=5e-5)
        both = np.array([plate["sigma_x"], plate["sigma_z"]])[:, under]
        expected = 1e6 * np.outer(alpha, depth[under])
        np.testing.assert_allclose(both, expected, atol=5)
    ax = drawn(fig06b_plate_stress, found, tmp_path).axes[0]
    for line, plate in zip(curves(ax), found["plates"].values()):
        np.testing.assert_allclose(line.T, [1e2 * depth, 1e-3 * plate["sigma_x"]])


def test_fig07():
    """ "A single scaling factor": the best one is the zeta of the table, to 5 %."""
    found = fig07_stress_maps.compute(cells=90)
    generic = found["generic"]
    expected = {
        "poppy-seeds-loose": (0.088, 0.051),
        "poppy-seeds-close": (0.161, 0.094),
    }
    for name, (off, first) in expected.items():
        medium = found["media"][name]
        assert medium["difference"] == pytest.approx(off, abs=5e-4)
        best = medium["coefficients"] @ generic / (generic @ generic)
        assert best == pytest.approx(1.0, rel=0.05)
        assert medium["coefficients"][0] * medium["zeta"] == pytest.approx(first)


def test_fig08a():
    """DESIGN section 9."""
    rods = fig08a_rods.compute(depths=3)["rods"]
    ratios = {
        name: [round(rod[tension]["ratio"], 2) for tension in ("keep", "cut")]
        for name, rod in rods.items()
    }
    assert ratios == {
        "round": [0.81, 0.68],
        "half, flat down": [0.54, 0.04],
        "half, flat up": [0.99, 0.99],
        "square": [0.10, 0.10],
    }


def test_fig08a_stress_around_the_cylinder_is_that_on_plates():
    found = fig08a_rods.compute(depths=3)
    around = found["cylinder"]
    beta = found["beta"]
    stress = fig08a_rods.VERTICAL["glass-3mm"].stress
    normal, tangent = fig08a_rods.face_stress(stress, beta)
    between = np.interp(around["beta"], beta, found["normal"])
    np.testing.assert_allclose(around["normal"], between, atol=1e-5)
    # Their sum over the leading half is the force: one depth, grazing faces apart.
    drag = trapezoid(normal * np.sin(beta) - tangent * np.cos(beta), beta)
    lift = trapezoid(normal * np.cos(beta) + tangent * np.sin(beta), beta)
    ratio = found["rods"]["round"]["keep"]["ratio"]
    assert lift / drag == pytest.approx(ratio, abs=0.003)


def test_fig08b():
    """Each leg has its own peak and its own phase, none is symmetric (Fig. 8(b))."""
    found = fig08b_legs.compute()
    c, flat, back = (fig08b_legs.peaks(found, name) for name in fig08b_legs.LEGS)
    assert c["z"]["peak"] > back["z"]["peak"] > flat["z"]["peak"] > 1
    assert c["x"]["peak"] > flat["x"]["peak"] > back["x"]["peak"] > 1
    for force in "xz":
        assert (
            c[force]["peak_angle"]
            < flat[force]["peak_angle"]
            < 0
            < back[force]["peak_angle"]
        )
        assert min(leg[force]["asymmetry"] for leg in (c, flat, back)) > 0.2
    assert flat["z"]["least"] < -0.5 and back["z"]["least"] < -0.2


@pytest.mark.parametrize("rate", [2 * np.pi, 4 * np.pi])
def test_fig08b_is_that_of_the_commands_scenes_at_any_rate(rate):
    """Doubling the rate does not affect the forces (caption of Fig. 8)."""
    found = fig08b_legs.compute(hubs=(0.0,))
    for name, leg in found["legs"].items():
        scene = load(name)
        motion = dataclasses.replace(scene.motion, rate=rate)
        run = dataclasses.replace(scene, motion=motion).run()
        force = leg["force"][0].T
        here = [np.interp(run.pose[:, 2], leg["angle"], values) for values in force]
        np.testing.assert_allclose(here, run.force.T, atol=0.01)
