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

FLUID, GLASS = rft.Viscous(2.0), MEDIA["glass-0.3mm-loose"]
FINE = 240
CIRCLE = Circle(5.0, centre=(1.0, 0.5))


def arcs(count):
    """A function of shape: two arcs, of ``count`` links whose poses it returns."""
    s = (np.arange(count) + 0.5) / count

    def positions(alpha):
        bend = np.where(s < 0.5, s - 0.5, 0.0) * alpha[..., :1]
        heading = bend + np.where(s < 0.5, 0.0, s - 0.5) * alpha[..., 1:]
        x, y = (np.cumsum(f(heading), -1) / count for f in (np.cos, np.sin))
        return np.stack([x - np.cos(heading) / 2 / count,
                         y - np.sin(heading) / 2 / count, heading], -1)  # fmt: skip

    return Positions(positions, 2, (1 / count,) * count)


def bends(count):
    """A wave as a Fourier series of the bends of so many elements."""
    s = np.arange(1, count) / count
    wave = np.exp(2j * np.pi * s) * 4 / count
    return Fourier(cos=wave.real[:, None], sin=wave.imag[:, None])


BODIES = {
    "serpenoid": (lambda n: Serpenoid(elements=n), lambda n: CIRCLE),
    "element-frame": (
        lambda n: Serpenoid(elements=n, frame=f"link-{n // 2 + n // 4 + 1}"),
        lambda n: CIRCLE,
    ),
    "arcs": (lambda n: ConstantCurvature(elements=n), lambda n: Circle(2.0)),
    "sine": (lambda n: Backbone(elements=n), lambda n: Sine(0.25, elements=n)),
    "bends": (lambda n: Backbone(elements=n), bends),
    "function": (arcs, lambda n: Circle(2.5, centre=(0.4, 0.2))),
}


def scene(kind, medium, count):
    body, gait = BODIES[kind]
    return Scene(Swimmer(medium, body(count)), gait(count))


@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("medium", [FLUID, GLASS], ids=["fluid", "sand"])
@pytest.mark.parametrize("count", [12, 40])
def test_errors_cover_what_more_elements_change(kind, medium, count):
    coarse, fine = (scene(kind, medium, n) for n in (count, FINE))
    amplitude = np.array([coarse.gait.amplitude])
    (net,), (error,) = estimate.direct(coarse, coarse.gait, amplitude, 128)
    (true,), _ = estimate.direct(fine, fine.gait, amplitude, 128)
    off, heading = estimate.pose_distance(net, true, 1.0)
    if kind == "element-frame":  # other elements, other frames: the distance is none
        off = abs(np.hypot(*net[:2]) - np.hypot(*true[:2]))
    assert off > 1e-5
    assert off < error[0]
    if kind != "element-frame":
        assert error[0] < 30 * off
    assert heading < error[1] + 1e-12


def test_errors_of_all_tiers_contain_it():
    coarse, fine = (Scene(Swimmer(FLUID, Serpenoid(elements=n)), Circle(2.0))
                    for n in (12, FINE))  # fmt: skip
    (true,), _ = estimate.direct(fine, fine.gait, np.array([2.0]), 64)
    tables = SceneTables(coarse.with_numerics(grid=9, phases=64))
    found = tables.displacements([2.0], ["area", "path", "direct"])
    for k in range(3):
        net = [found[name].values[k, 0] for name in ("x", "y", "heading")]
        assert estimate.distance(np.array(net), true) < found["x"].error[k, 0]


def test_errors_of_time_stepping_contain_it():
    wake = (Transient(travel=0.1),)
    coarse, fine = (Scene(Swimmer(GLASS, Serpenoid(elements=n), wake), CIRCLE)
                    for n in (8, 16))  # fmt: skip
    (net,), (error,) = estimate.direct(coarse, CIRCLE, np.array([5.0]), 64)
    true = fine.cycle(phases=64).net
    off = estimate.distance(net, true)
    assert off < error[0] < 30 * off


def test_a_tolerance_refines_elements():
    swimmer = Scene(Swimmer(FLUID, Backbone(elements=20)), Sine(0.2, elements=20))
    found = cheapest_displacements(swimmer, [0.2], 1e-3)
    fine = Scene(Swimmer(FLUID, Backbone(elements=FINE)), Sine(0.2, elements=FINE))
    (true,), _ = estimate.direct(fine, fine.gait, np.array([0.2]), 128)
    assert found["chosen_elements"].values in (40, 80)
    net = [found[name].values[0, 0] for name in ("x", "y", "heading")]
    assert estimate.distance(np.array(net), true) < 1e-3


def test_path_length_work_and_efficiency_contain_it():
    coarse, fine = (
        Scene(Swimmer(FLUID, Serpenoid(elements=n)), CIRCLE) for n in (16, FINE)
    )
    found, true = effort(coarse), effort(fine)
    for name in ("path_length", "work"):
        assert abs(found[name] - true[name]) < found[f"{name}_error"]
        assert found[f"{name}_error"] < 0.2 * found[name]
    values = [
        evaluate_gait(build_request(s, "efficiency", None, 1, None, 1), CIRCLE)
        for s in (coarse, fine)
    ]
    assert abs(values[0].value - values[1].value) < values[0].error


def test_rigid_links_have_no_error_of_elements():
    chain = Scene(Swimmer(FLUID, rft.Chain()), Circle(1.0))
    _, (error,) = estimate.direct(chain, chain.gait, np.array([1.0]), 128)
    assert error[0] < 1e-9
    rigid = Positions(arcs(12).positions, 2, (1 / 12,) * 12, continuous=False)
    links = Scene(Swimmer(FLUID, rigid), Circle(1.0))
    _, (error,) = estimate.direct(links, links.gait, np.array([1.0]), 128)
    assert error[0] < 1e-9
