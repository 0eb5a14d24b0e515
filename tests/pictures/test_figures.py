"""Each published figure: its sourced numbers, and that it draws."""

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

import figures
from figures import style
from figures.accuracy import kinks
from figures.paper import (
    fig05c_force_law,
    fig11c_connection,
    fig11d_ccf,
    fig11e_displacement,
)
from figures.swimmers import frames_area, optimal_gaits
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE, Granular

pytestmark = pytest.mark.usefixtures("fastest")


def test_fig05c():
    numbers = fig05c_force_law.compute()
    # Eq. 3 at psi = 90 degrees with C = 1.8, gamma0 = 13.8 degrees.
    assert numbers["loose"][1, -1] == pytest.approx(
        1 + 1.8 * math.cos(math.radians(13.8)), rel=1e-12
    )
    assert numbers["viscous"][1, -1] == pytest.approx(2.0)
    assert (
        numbers["loose"][1, 1:] > numbers["viscous"][1, 1:]
    ).all()  # "F_perp is enhanced in GM"
    fit = numbers[
        "fit"
    ]  # C = 1.49, gamma0 = 12.6 degrees, k = 2.49, 0.056 N: the fit that came with the data
    assert (fit["C"], math.degrees(fit["gamma0"]), fit["k"]) == pytest.approx(
        (1.49, 12.6, 2.49), rel=0.005
    )
    assert fit["rms_N"] == pytest.approx(0.056, abs=0.001)


def test_fig05c_draws_across_solid_and_along_dashed(tmp_path):
    numbers = fig05c_force_law.compute(angles=7)
    ax = drawn(fig05c_force_law, numbers, tmp_path).axes[0]
    psi = np.linspace(0, np.pi / 2, 7)
    for k, name in enumerate(("glass-0.3mm-loose", "glass-0.3mm-close", "viscous-2")):
        along, across = CATALOGUE[name].medium.traction(np.cos(psi), np.sin(psi))
        for line, values, dashes in (
            (ax.lines[2 * k], across, "-"),
            (ax.lines[2 * k + 1], along, "--"),
        ):
            np.testing.assert_allclose(
                line.get_xydata(), np.transpose([np.degrees(psi), values]), atol=1e-12
            )
            assert line.get_linestyle() == dashes
    scale = (
        numbers["fit"]["k"] * 2 * (0.588 * 1030) * 9.81 * 0.008 * 0.030 * 0.080
    )  # N, Eq. 2 and the header of the data
    across, along = ax.lines[6:8]
    np.testing.assert_allclose(
        across.get_ydata(), numbers["bed"]["perpendicular"] / scale
    )
    np.testing.assert_allclose(along.get_ydata(), numbers["bed"]["parallel"] / scale)
    assert across.get_markerfacecolor() != "white" == along.get_markerfacecolor()


def test_fig11c(tmp_path):
    closed = fig11c_connection.compute("three-link-viscous", grid=21, extent=1.0)[
        "connection"
    ]
    np.testing.assert_allclose(
        closed.A[:, :, 10, 10],
        [[0, 0], [-1 / 18, -1 / 18], [7 / 27, -7 / 27]],
        atol=1e-14,
    )
    numbers = fig11c_connection.compute()
    ax = drawn(fig11c_connection, numbers, tmp_path).axes[0]
    loop = numbers["gait"].shape(np.linspace(0, 2 * np.pi, 2000))
    assert all(np.hypot(*(loop - x).T).min() < 1e-2 for x in ax.lines[0].get_xydata())
    assert ax.collections[0].N > 100  # arrows


def test_the_misfit_of_the_plane_in_loose_glass(tmp_path):
    """26 to 33 % rms of each component in the middle-link frame."""
    glass = load("three-link-glass").with_numerics(directions=24)
    fitted = SceneTables(
        glass.changed(body=dataclasses.replace(glass.system.body, frame="link-2"))
    ).fitted
    misfit = np.sqrt((fitted.residual**2).mean((1, 2)) / (fitted.speed**2).mean((1, 2)))
    assert misfit.min() == pytest.approx(0.26, abs=0.005)
    assert misfit.max() == pytest.approx(0.33, abs=0.005)


def test_fig11d(tmp_path):
    closed = fig11d_ccf.compute(
        "three-link-viscous", grid=41, extent=1.0, interpolation=5
    )["ccf"]
    assert closed.values[0, 20, 20] == pytest.approx(-5 / 243, rel=1e-6)
    numbers = fig11d_ccf.compute()
    # Left and right are alike, and the field is computed by half: here every shape of a smaller one is solved.
    lopsided = type("Lopsided", (Granular,), {"mirror": False})
    small = load("three-link-glass").with_numerics(grid=8, extent=2.0)
    whole = SceneTables(
        small.changed(
            medium=lopsided(small.system.medium.C, small.system.medium.gamma0)
        )
    ).curvature.values
    np.testing.assert_allclose(whole, SceneTables(small).curvature.values, atol=1e-6)
    np.testing.assert_allclose(
        whole[:, ::-1, ::-1], whole * np.array([1, -1, -1])[:, None, None], atol=1e-6
    )
    assert np.abs(whole).max((1, 2)).min() > 0.01
    assert numbers["ccf"].values.shape == (3, 31, 31)
    ax = drawn(fig11d_ccf, numbers, tmp_path).axes[0]
    for gait, loop in zip(numbers["gaits"], curves(ax)):
        np.testing.assert_allclose(
            loop, gait.shape(np.linspace(0, 2 * np.pi, len(loop))), atol=1e-12
        )


def test_fig11e(tmp_path):
    amplitudes = {"circle": [0.5, 1.0, 1.75], "butterfly": [0.5, 1.0]}
    numbers = fig11e_displacement.compute(amplitudes=amplitudes)
    tables = numbers["tables"]
    np.testing.assert_allclose(
        tables["circle"].at(tier="direct")["net_distance"].values,
        [0.0121, 0.0638, 0.1378],
        rtol=0.01,
    )
    # The butterfly is the better gait (Fig. 11(e)): at its published size it outdoes every circle.
    assert (
        tables["butterfly"].at(tier="direct")["net_distance"].values[1] > 1.5 * 0.1378
    )
    for ax, (name, table) in zip(
        drawn(fig11e_displacement, numbers, tmp_path).axes, tables.items()
    ):
        np.testing.assert_allclose(
            curve(ax, "force balance"),
            [amplitudes[name], table.at(tier="direct")["x"].values],
        )


def test_frames_area(tmp_path):
    """In the minimum-perturbation frame the area is as good as the path; what the connection leaves no frame takes away."""
    numbers = frames_area.compute(count=2)
    for gait in numbers.values():
        distance = [
            np.hypot(*gait[frame]["direct"][:, :2].T) for frame in frames_area.FRAMES
        ]
        np.testing.assert_allclose(
            distance[1:], distance[:1] * np.ones((2, 1)), rtol=1e-5
        )
        of_path = frames_area.position_error(gait["mean"], "path")
        apart = {
            frame: np.abs(frames_area.position_error(gait[frame], "area") - of_path)[-1]
            for frame in frames_area.FRAMES
        }
        assert apart["minimum-perturbation"] < 0.25 * min(
            apart["mean"], apart["link-2"]
        )
        assert of_path[-1] > 0.01
    above, _, below, _ = drawn(frames_area, numbers, tmp_path).axes
    circle = numbers["circle"]
    far = np.hypot(*circle["link-2"]["area"][:, :2].T)
    np.testing.assert_allclose(
        curve(above, "area, link-2 frame"), [circle["amplitude"], far]
    )
    np.testing.assert_allclose(
        below.lines[1].get_ydata(), frames_area.position_error(circle["link-2"], "area")
    )
    np.testing.assert_allclose(
        below.lines[3].get_ydata(), frames_area.position_error(circle["mean"], "path")
    )


def test_kinks(tmp_path):
    numbers = kinks.compute(grid=21, directions=24)
    # Curled to (1.5, 1.5) the body stays put for joints driven alike; straight ahead nothing sticks for long.
    near = np.abs(numbers["axes"][0] - 1.5).argmin()
    assert numbers["stuck"][near, near] > 0.1
    assert numbers["stuck"].mean() < 0.1
    assert np.sqrt((numbers["residual"][15] ** 2).mean()) < 0.2 * np.sqrt(
        (numbers["residual"][1] ** 2).mean()
    )
    maps = [
        ax.collections[0].get_array() for ax in drawn(kinks, numbers, tmp_path).axes[:3]
    ]
    for values, wanted in zip(
        maps, (numbers["stuck"], numbers["residual"][1], numbers["residual"][15])
    ):
        np.testing.assert_array_equal(np.reshape(values, wanted.shape), wanted.T)


def test_every_script_computes_and_draws():
    scripts = {
        info.name
        for info in pkgutil.walk_packages(figures.__path__, "figures.")
        if not info.ispkg
    }
    scripts -= {name for name in scripts if ".campaigns." in name}
    scripts.remove("figures.style")
    assert len(scripts) == 32
    for name in scripts:
        module = importlib.import_module(name)
        assert (
            module.__doc__
            and module.compute.__doc__
            and list(inspect.signature(module.draw).parameters) == ["numbers"]
        )


def test_a_script_writes_the_file_it_is_asked_for(tmp_path, monkeypatch, capsys):
    """By default one of its own name; a name that is no picture's is refused before anything is computed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["fig05c_force_law.py"])
    asked = []
    compute = lambda: asked.append(1) or fig05c_force_law.compute(3)
    for argv in ([], ["mine.pdf"]):
        monkeypatch.setattr(sys, "argv", ["fig05c_force_law.py", *argv])
        figures.main(
            "fig05c",
            compute,
            fig05c_force_law.draw,
            lambda numbers: f"{len(numbers['psi'])} angles",
        )
    assert capsys.readouterr().out == "3 angles\nfig05c.png\n3 angles\nmine.pdf\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["fig05c.png", "mine.pdf"]
    monkeypatch.setattr(sys, "argv", ["fig05c_force_law.py", "mine.txt"])
    with pytest.raises(SystemExit) as stopped:
        figures.main("fig05c", compute, fig05c_force_law.draw)
    assert stopped.value.code == 2 and len(asked) == 2
    assert (
        capsys.readouterr().err
        == "cannot draw mine.txt: end the name in .png, .pdf, .svg\n"
    )


def test_a_table_has_its_cells_under_their_heads():
    rows = [("round", "+0.81", "up"), ("half, flat down", "-10.54", "")]
    assert style.table(("rod", "lift", "measured"), rows).splitlines() == [
        "rod                 lift   measured",
        "round              +0.81         up",
        "half, flat down   -10.54",
    ]


def test_figures_load_nothing_when_imported():
    """A figure reads and computes when it is asked to."""
    code = (
        "import importlib, pkgutil, figures, rft, geomech.scenes as s\n"
        "def refuse(*args, **kwargs): raise AssertionError('loaded on import')\n"
        "s.load = s.parse = rft.body_velocity = refuse\n"
        "for info in pkgutil.walk_packages(figures.__path__, 'figures.'):\n"
        "    importlib.import_module(info.name)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_optimal_gaits(tmp_path):
    """Sand's strokes reach further and bring more than the fluid's, and the cheap ones are shorter than the long."""
    numbers = optimal_gaits.compute(harmonics=2, starts=1, grid=11, phases=32)
    fluid, sand = numbers.values()
    for objective in optimal_gaits.OBJECTIVES:
        assert optimal_gaits.reach(sand[objective].gait) > 1.05 * optimal_gaits.reach(
            fluid[objective].gait
        )
        assert sand[objective].value > 1.1 * fluid[objective].value
    for found in numbers.values():
        assert found["efficiency"].best.length < found["displacement"].best.length
    row = optimal_gaits.table(numbers).splitlines()[3].split()
    best = sand["displacement"].best
    assert row[-4:-2] == [
        f"{np.hypot(*best.displacement[:2]):.4f}",
        f"{best.length:.4f}",
    ]
    ax = drawn(optimal_gaits, numbers, tmp_path).axes[1]
    loop = curve(
        ax,
        f"displacement: {np.hypot(*best.displacement[:2]):.3f} BL, path {best.length:.2f}",
    )
    np.testing.assert_allclose(loop[:, 0], best.gait.shape(0.0))
    assert np.abs(loop).max() == pytest.approx(optimal_gaits.reach(best.gait), rel=1e-3)
