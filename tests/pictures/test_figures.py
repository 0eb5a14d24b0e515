"""The scripts of figures/: their sourced numbers, and that they draw these."""

import dataclasses
import importlib
import inspect
import math
import pkgutil
import subprocess
import sys

import numpy as np
import pytest
from artists import curve, curves, drawn
from scipy.integrate import trapezoid

import figures
from figures import style
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
from figures.swimmers import frames_area
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables

pytestmark = pytest.mark.usefixtures("fastest")
SCRIPTS = {
    info.name
    for info in pkgutil.walk_packages(figures.__path__, "figures.")
    if not info.ispkg and ".campaigns." not in info.name
} - {"figures.style"}


# All of them


@pytest.mark.parametrize("name", sorted(SCRIPTS))
def test_every_script_computes_and_draws(name):
    module = importlib.import_module(name)
    assert module.__doc__ and module.compute.__doc__
    assert list(inspect.signature(module.draw).parameters) == ["numbers"]


def test_figures_load_nothing_when_imported():
    """A figure reads and computes when it is asked to."""
    code = (
        "import importlib, rft, geomech.scenes as s\n"
        "def refuse(*args, **kwargs): raise AssertionError('loaded on import')\n"
        "s.load = s.parse = rft.body_velocity = refuse\n"
        f"for name in {sorted(SCRIPTS)}: importlib.import_module(name)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("arguments", "file"), [([], "fig05c.png"), (["mine.pdf"], "mine.pdf")]
)
def test_a_script_writes_the_file_it_is_asked_for(
    arguments, file, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["fig05c_force_law.py", *arguments])
    numbers = fig05c_force_law.compute(3)
    figures.main("fig05c", lambda: numbers, fig05c_force_law.draw, lambda _: "3 angles")
    assert capsys.readouterr().out == f"3 angles\n{file}\n"
    assert [p.name for p in tmp_path.iterdir()] == [file]


def test_a_name_that_is_no_pictures_is_refused_before_anything_is_computed(
    monkeypatch, capsys
):
    monkeypatch.setattr(sys, "argv", ["fig05c_force_law.py", "mine.txt"])
    with pytest.raises(SystemExit):
        figures.main("fig05c", None, None)
    told = "cannot draw mine.txt: end the name in .png, .pdf, .svg\n"
    assert capsys.readouterr().err == told


def test_a_table_has_its_cells_under_their_heads():
    rows = [("round", "+0.81", "up"), ("half, flat down", "-10.54", "")]
    assert style.table(("rod", "lift", "measured"), rows).splitlines() == [
        "rod                 lift   measured",
        "round              +0.81         up",
        "half, flat down   -10.54",
    ]


# Scripts, what they compute coarsely, the axes, the label of a curve, its numbers.
CURVES = [
    (
        fig07_stress_maps,
        {"cells": 90},
        1,
        r"poppy seeds, close, $\zeta$ = 0.422",
        lambda found: found["media"]["poppy-seeds-close"]["coefficients"],
    ),
    (
        fig08a_rods,
        {"depths": 5},
        0,
        "tangential, cylinder",
        lambda found: found["cylinder"]["tangent"],
    ),
    (
        fig08a_rods,
        {"depths": 5},
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
]


@pytest.mark.parametrize(("module", "coarse", "axes", "label", "expected"), CURVES)
def test_a_curve_shows_its_numbers(module, coarse, axes, label, expected, tmp_path):
    numbers = module.compute(**coarse)
    ax = drawn(module, numbers, tmp_path).axes[axes]
    np.testing.assert_allclose(curve(ax, label)[1], expected(numbers))


# Scripts whose numbers other tests hold, and what is enough for a picture.
COARSE = {
    "accuracy.kinks": {"grid": 21, "directions": 24},
    "swimmers.optimal_gaits": {"harmonics": 2, "starts": 1, "grid": 11, "phases": 32},
    "robots.sand_gaits": {"generations": 2, "walks": 4, "seconds": 0.6},
    "robots.walking_mujoco": {
        "study": {"steps": (8, 12)},
        "finest": {"steps": 24},
        "frequencies": {},
    },
}


@pytest.mark.parametrize("name", COARSE)
def test_a_script_draws_what_it_computes(name, tmp_path):
    if name.startswith("robots."):
        pytest.importorskip("mujoco.batch", reason="needs mujoco.batch")
    module = importlib.import_module(f"figures.{name}")
    numbers = module.compute(**COARSE[name])
    assert drawn(module, numbers, tmp_path).axes
    if name == "accuracy.kinks":
        # Curled, the body stays put for joints driven alike; straight nothing sticks.
        near = np.abs(numbers["axes"][0] - 1.5).argmin()
        assert numbers["stuck"][near, near] > 0.1 > numbers["stuck"].mean()


# Fig. 5(c), 11


def test_fig05c():
    numbers = fig05c_force_law.compute()
    # Eq. 3 at psi = 90 degrees with C = 1.8, gamma0 = 13.8 degrees.
    across = 1 + 1.8 * math.cos(math.radians(13.8))
    assert numbers["loose"][1, -1] == pytest.approx(across, rel=1e-12)
    assert numbers["viscous"][1, -1] == pytest.approx(2.0)
    # "F_perp is enhanced in GM"
    assert (numbers["loose"][1, 1:] > numbers["viscous"][1, 1:]).all()
    fit = numbers["fit"]  # that came with the data
    found = fit["C"], math.degrees(fit["gamma0"]), fit["k"]
    assert found == pytest.approx((1.49, 12.6, 2.49), rel=0.005)
    assert fit["rms_N"] == pytest.approx(0.056, abs=0.001)


def test_fig11c(tmp_path):
    closed = fig11c_connection.compute("three-link-viscous", grid=21, extent=1.0)
    straight = closed["connection"].A[:, :, 10, 10]
    expected = [[0, 0], [-1 / 18, -1 / 18], [7 / 27, -7 / 27]]
    np.testing.assert_allclose(straight, expected, atol=1e-14)
    ax = drawn(fig11c_connection, closed, tmp_path).axes[0]
    loop = closed["gait"].shape(np.linspace(0, 2 * np.pi, 2000))
    places = ax.lines[0].get_xydata()
    places = places[np.isfinite(places).all(1)]
    assert max(np.hypot(*(loop - x).T).min() for x in places) < 1e-2


def test_the_misfit_of_the_plane_in_loose_glass():
    """26 to 33 % rms of each component in the middle-link frame."""
    glass = load("three-link-glass").with_numerics(directions=24)
    body = dataclasses.replace(glass.system.body, frame="link-2")
    fitted = SceneTables(glass.changed(body=body)).fitted
    squares = (fitted.residual**2).mean((1, 2)) / (fitted.speed**2).mean((1, 2))
    ends = np.sqrt([squares.min(), squares.max()])
    assert ends == pytest.approx([0.26, 0.33], abs=0.005)


def test_fig11d(tmp_path):
    coarse = {"grid": 41, "extent": 1.0, "interpolation": 5}
    closed = fig11d_ccf.compute("three-link-viscous", **coarse)
    assert closed["ccf"].values[0, 20, 20] == pytest.approx(-5 / 243, rel=1e-6)
    ax = drawn(fig11d_ccf, closed, tmp_path).axes[0]
    for gait, loop in zip(closed["gaits"], curves(ax)):
        inside = np.isfinite(loop).all(1)
        expected = gait.shape(np.linspace(0, 2 * np.pi, len(loop)))
        np.testing.assert_allclose(loop[inside], expected[inside], atol=1e-12)


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
    # Before, the mean depth of what is in, over the whole plate: (|z| + L/2)^2 / 2 L.
    length = fig06b_plate_stress.LENGTH
    square = (depth[~under] + length / 2) ** 2 / (2 * length)
    upright = found["plates"][90, 0]["sigma_x"][~under]
    np.testing.assert_allclose(upright, 0.37e6 * square, rtol=1e-9)
    ax = drawn(fig06b_plate_stress, found, tmp_path).axes[0]
    for line, plate in zip(curves(ax), found["plates"].values()):
        np.testing.assert_allclose(line.T, [1e2 * depth, 1e-3 * plate["sigma_x"]])


def test_fig07():
    """ "A single scaling factor": the best one is the zeta of the table, to 5 %."""
    found = fig07_stress_maps.compute(cells=90)
    assert found["survey"].pulling == pytest.approx(0.13, abs=0.005)  # DESIGN section 9
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
    """DESIGN section 9; drag and lift are straight lines of depth."""
    found = fig08a_rods.compute(depths=5)
    rods = found["rods"]
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
    assert [*found["measured"].values()] == [1, -1, 0, 1]
    assert np.degrees(found["pulled"]) == pytest.approx(90 + 53, abs=1)
    forces = [force for rod in rods.values() for force in rod.values()]
    drags = np.array([force["drag"] for force in forces])
    lifts = np.array([force["lift"] for force in forces])
    bends = np.abs(np.diff([drags, lifts], 2))
    assert bends.max() < 1e-9 * np.abs(drags).max() and (np.diff(drags) > 0).all()


def test_fig08a_stress_around_the_cylinder_is_that_on_plates():
    found = fig08a_rods.compute(depths=3)
    around = found["cylinder"]
    beta = found["beta"]
    stress = fig08a_rods.VERTICAL["glass-3mm"].stress
    normal, tangent = fig08a_rods.face_stress(stress, beta)
    for what in ("normal", "tangent"):
        between = np.interp(around["beta"], beta, found[what])
        np.testing.assert_allclose(around[what], between, atol=1e-5)
    ends = {0: (0.375, -0.136), 180: (-0.375, 0.136), 90: (0.37, 0.037)}
    for degrees, (n, t) in ends.items():  # alpha_z, alpha_x at (0, 0), both at (90, 0)
        both = normal[2 * degrees], tangent[2 * degrees]
        assert both == pytest.approx((0.224 * n, 0.224 * t), abs=2e-5)
    # Their sum over the leading half is the force: one depth, grazing faces apart.
    drag = trapezoid(normal * np.sin(beta) - tangent * np.cos(beta), beta)
    lift = trapezoid(normal * np.cos(beta) + tangent * np.sin(beta), beta)
    ratio = found["rods"]["round"]["keep"]["ratio"]
    assert lift / drag == pytest.approx(ratio, abs=0.003)


def test_fig08b(tmp_path):
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
    assert abs(c["z"]["least"]) < 1e-2
    ax = drawn(fig08b_legs, found, tmp_path).axes[3]
    own = [line.get_xydata().T for line in ax.lines if line.get_marker() in "os^"]
    for line, leg in zip(own, found["legs"].values(), strict=True):
        expected = [np.degrees(leg["angle"]), leg["force"][1, :, 0]]
        np.testing.assert_allclose(line, expected)


@pytest.mark.parametrize("rate", [2 * np.pi, 4 * np.pi])
def test_fig08b_is_that_of_the_commands_scenes_at_any_rate(rate):
    """Doubling the rate does not affect the forces (caption of Fig. 8)."""
    found = fig08b_legs.compute(hubs=(0.0,))
    for name, leg in found["legs"].items():
        scene = load(name)
        assert scene.intruder.radius == 0.038
        motion = dataclasses.replace(scene.motion, rate=rate)
        run = dataclasses.replace(scene, motion=motion).run()
        force = leg["force"][0].T
        here = [np.interp(run.pose[:, 2], leg["angle"], values) for values in force]
        np.testing.assert_allclose(here, run.force.T, atol=0.01)


def test_asymmetry_of_what_is_known():
    angle = np.linspace(-np.pi, np.pi, 2001)
    even = np.cos(angle)
    assert fig08b_legs.asymmetry(angle, even) == pytest.approx(0.0, abs=1e-12)
    uneven = 2 * even - 3 * np.sin(2 * angle)
    assert fig08b_legs.asymmetry(angle, uneven) == pytest.approx(1.5)
