"""Errors of continuous bodies contain what the number of their elements changes."""

import numpy as np
import pytest

import rft
from geomech.mathematics.gaits import Circle, Fourier, Sine
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.systems.swimmer import MEDIA
from geomech.scenes.model import Scene
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.estimates import estimate
from geomech.studies.estimates.effort import effort
from geomech.studies.optimisation.evaluate import evaluate_gait
from geomech.studies.optimisation.request import build_request
from geomech.studies.scene_tables import SceneTables
from rft.bodies import Backbone, ConstantCurvature, Positions, Serpenoid
from rft.effects import Transient

pytestmark = pytest.mark.usefixtures("fastest")
FLUID = rft.Viscous(2.0)
GLASS = MEDIA["glass-0.3mm-loose"]
FINE = 240
CIRCLE = Circle(5.0, centre=(1.0, 0.5))


def arcs(count, **options):
    """Return two arcs as a function of shape, of ``count`` links whose poses it
    returns."""
    s = (np.arange(count) + 0.5) / count

    def positions(alpha):
        bend = np.where(s < 0.5, s - 0.5, 0.0) * alpha[..., :1]
        heading = bend + np.where(s < 0.5, 0.0, s - 0.5) * alpha[..., 1:]
        step = np.stack([np.cos(heading), np.sin(heading)], -1) / count
        centre = np.cumsum(step, -2) - step / 2
        return np.concatenate([centre, heading[..., None]], -1)

    return Positions(positions, 2, (1 / count,) * count, **options)


def bends(count):
    """Return a wave as a Fourier series of the bends of so many elements."""
    s = np.arange(1, count) / count
    wave = np.exp(2j * np.pi * s) * 4 / count
    return Fourier(cos=wave.real[:, None], sin=wave.imag[:, None])


def with_frame(n):
    return Serpenoid(elements=n, frame=f"link-{n // 2 + n // 4 + 1}")


BODIES = {
    "serpenoid": (lambda n: Serpenoid(elements=n), lambda n: CIRCLE),
    "element-frame": (with_frame, lambda n: CIRCLE),
    "arcs": (lambda n: ConstantCurvature(elements=n), lambda n: Circle(2.0)),
    "sine": (lambda n: Backbone(elements=n), lambda n: Sine(0.25, elements=n)),
    "bends": (lambda n: Backbone(elements=n), bends),
    "function": (arcs, lambda n: Circle(2.5, centre=(0.4, 0.2))),
}


def scene(kind, medium, count):
    body, gait = BODIES[kind]
    return Scene(Swimmer(medium, body(count)), gait(count))


def direct(scene, phases=128):
    """Return the net pose and its errors."""
    amplitudes = np.array([scene.gait.amplitude])
    (net,), (error,) = estimate.direct(scene, scene.gait, amplitudes, phases)
    return net, error


def poses(result):
    return np.stack([result[name].values for name in ("x", "y", "heading")], -1)


@pytest.mark.parametrize("kind", [kind for kind in BODIES if kind != "element-frame"])
@pytest.mark.parametrize("medium", [FLUID, GLASS], ids=["fluid", "sand"])
@pytest.mark.parametrize("count", [12, 40])
def test_errors_cover_what_more_elements_change(kind, medium, count):
    net, error = direct(scene(kind, medium, count))
    true, _ = direct(scene(kind, medium, FINE))
    off, heading = estimate.pose_distance(net, true, 1.0)
    assert 1e-5 < off < error[0] < 30 * off
    assert heading < error[1] + 1e-12


@pytest.mark.parametrize("medium", [FLUID, GLASS], ids=["fluid", "sand"])
@pytest.mark.parametrize("count", [12, 40])
def test_errors_in_the_frame_of_an_element_cover_the_distance(medium, count):
    """Other elements have other frames."""
    net, error = direct(scene("element-frame", medium, count))
    true, _ = direct(scene("element-frame", medium, FINE))
    off = abs(np.hypot(*net[:2]) - np.hypot(*true[:2]))
    assert 1e-5 < off < error[0]


def test_errors_of_all_tiers_contain_it():
    coarse, fine = (
        Scene(Swimmer(FLUID, Serpenoid(elements=n)), Circle(2.0)) for n in (12, FINE)
    )
    true, _ = direct(fine, 64)
    tables = SceneTables(coarse.with_numerics(grid=9, phases=64))
    found = tables.displacements([2.0], ["area", "path", "direct"])
    off = estimate.distance(poses(found)[:, 0], true)
    assert (off < found["x"].error[:, 0]).all()


def test_errors_of_time_stepping_contain_it():
    coarse, fine = (
        Scene(Swimmer(GLASS, Serpenoid(elements=n), (Transient(travel=0.1),)), CIRCLE)
        for n in (8, 16)
    )
    net, error = direct(coarse, 64)
    off = estimate.distance(net, fine.cycle(phases=64).net)
    assert off < error[0] < 30 * off


def test_a_tolerance_refines_elements():
    coarse, fine = (
        Scene(Swimmer(FLUID, Backbone(elements=n)), Sine(0.2, elements=n))
        for n in (20, FINE)
    )
    found = cheapest_displacements(coarse, [0.2], 1e-3)
    assert found["chosen_elements"].values in (40, 80)
    true, _ = direct(fine)
    assert estimate.distance(poses(found)[0, 0], true) < 1e-3


def test_path_length_work_and_efficiency_contain_it():
    coarse, fine = (
        Scene(Swimmer(FLUID, Serpenoid(elements=n)), CIRCLE) for n in (16, FINE)
    )
    found = effort(coarse)
    true = effort(fine)
    for name in ("path_length", "work"):
        error = found[f"{name}_error"]
        assert abs(found[name] - true[name]) < error < 0.2 * found[name]
    values = [
        evaluate_gait(build_request(one, "efficiency", None, 1, None, 1), CIRCLE)
        for one in (coarse, fine)
    ]
    assert abs(values[0].value - values[1].value) < values[0].error
