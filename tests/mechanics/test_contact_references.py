"""Chains on dry ground, with and without contact that comes and goes, against programs
that share no code: data/contact.json."""

import json
from pathlib import Path

import numpy as np
import pytest

from geomech.mathematics.geometry.reconstruct import displacement
from rft import (
    Chain,
    Coulomb,
    FunctionContact,
    Granular,
    Serpenoid,
    Touching,
    WaveContact,
    body_velocity,
    work_done,
)
from rft.contacts.loads import balanced_loads
from rft.effects import SkinFriction
from rft.laws import Surface

DATA = Path(__file__).parents[1] / "data"
REFERENCE = json.loads((DATA / "contact.json").read_text())
CHAINS = REFERENCE["chains"]["cases"]
FULL = [case for case in CHAINS if case["wave"] is None]
SMOOTH = REFERENCE["kinematic_snake"]["quasi_static"]["cases"][0]
ROUNDING = 1e-9


def shapes(gait, phases):
    """Shapes and rates (phases, joints) of a gait (kind, links, amplitude)."""
    kind, links, amplitude = gait
    t = phases[:, None]
    if kind == "circle":
        lead = np.array([0.0, -np.pi / 2])
    else:
        lead = 2 * np.pi * np.arange(1, links) / links
    return amplitude * np.cos(t + lead), -amplitude * np.sin(t + lead)


def friction(law):
    """The medium and the effects of a law of the reference."""
    if law["kind"] == "granular":
        return Granular(law["C"], law["gamma0"]), []
    if law["kind"] == "isotropic":
        return Coulomb(), []
    skin = SkinFriction(law["forward"], law["backward"], reference=1.0)
    return Surface(C=0.0, gamma0=0.24, across=law["transverse"]), [skin]


@pytest.mark.parametrize("case", FULL, ids=lambda case: case["name"])
def test_full_contact_moves_as_least_dissipation_and_reweighted_drag_say(case):
    links = case["gait"][1]
    alpha, alphadot = shapes(case["gait"], 2 * np.pi * np.arange(16) / 16)
    medium, effects = friction(case["law"])
    solution = body_velocity(
        medium,
        Chain((1,) * links),
        alpha,
        alphadot,
        effects=effects,
        regularisation=ROUNDING,
    )
    error = max(case["xi_error"], 2 * ROUNDING)
    np.testing.assert_allclose(solution.xi, case["xi"], atol=error)


def test_chains_of_more_and_more_links_slither_as_the_smooth_snake():
    """The waves of kinematic-snake without its inertia: curvature 7 cos 2 pi (s + t),
    friction 1 forward, 1.5 backward, 2 across."""
    medium, effects = friction(
        {"kind": "anisotropic", "forward": 1.0, "backward": 1.5, "transverse": 2.0}
    )
    count = 256
    phases = 2 * np.pi * (np.arange(count)[:, None] + 0.5) / count
    nets = []
    for links in (20, 40):
        # A joint bends by the integral of the curvature between two middles.
        place = 2 * np.pi * np.arange(1, links) / links
        bend = 7 / np.pi * np.sin(np.pi / links)
        alpha = bend * np.cos(phases + place)
        alphadot = -bend * np.sin(phases + place)
        solution = body_velocity(
            medium, Chain((1,) * links), alpha, alphadot, effects=effects
        )
        nets.append(forward(solution.xi, 2 * np.pi / count))
    coarse, fine = nets
    # The difference falls with the square of a link's length.
    limit = fine + (fine - coarse) / 3
    np.testing.assert_allclose(limit, SMOOTH["net"], atol=1e-5)


def forward(xi, step):
    """The pose (x, y, heading) at the end of a path of constant velocities."""
    end = 0.0
    heading = 0.0
    for v_x, v_y, turn in xi:
        # The velocity at the middle of a step has the heading of the middle.
        end += step * (v_x + 1j * v_y) * np.exp(1j * (heading + turn * step / 2))
        heading += turn * step
    return np.array([end.real, end.imag, heading])


LIFTED = [case for case in CHAINS if case["wave"] is not None]


@pytest.mark.parametrize("case", LIFTED, ids=lambda case: case["name"])
def test_lifted_chains_move_as_least_dissipation_and_reweighted_drag_say(case):
    """Contact is constant along a piece, so that the error falls by four with twice
    the pieces, and the extrapolated velocity is that of contact along a whole link."""
    links = case["gait"][1]
    t = 2 * np.pi * np.arange(16) / 16
    alpha, alphadot = shapes(case["gait"], t)
    alpha = np.column_stack([alpha, t])
    alphadot = np.column_stack([alphadot, np.ones(16)])
    medium, effects = friction(case["law"])
    body = Touching(Chain((1,) * links), WaveContact(**case["wave"]))
    found = [
        body_velocity(
            medium,
            body,
            alpha,
            alphadot,
            effects=effects,
            regularisation=ROUNDING,
            pieces=pieces * links,
        ).xi
        for pieces in (20, 40, 80)
    ]
    xi = np.array(case["xi"])
    errors = [np.abs(x - xi).max() for x in found]
    assert errors[-1] < 2e-4
    assert errors[0] / errors[2] > 6
    extrapolated = found[2] + (found[2] - found[1]) / 3
    assert np.median(np.abs(extrapolated - xi).max(1)) < 3e-6


@pytest.mark.parametrize("case", LIFTED, ids=lambda case: case["name"])
def test_lifted_chains_dissipate_as_their_loads_say(case):
    """Power of loads that bear the whole weight; it is stationary in the velocity."""
    links = case["gait"][1]
    t = 2 * np.pi * np.arange(16) / 16
    alpha, alphadot = shapes(case["gait"], t)
    motion = np.column_stack([alpha, t]), np.column_stack([alphadot, np.ones(16)])
    medium, effects = friction(case["law"])
    wave = WaveContact(bearing="normalised", **case["wave"])
    body = Touching(Chain((1,) * links), wave)
    settings = {"effects": effects, "regularisation": ROUNDING, "pieces": 40 * links}
    xi = body_velocity(medium, body, *motion, **settings).xi
    power = work_done(medium, body, *motion, xi, **settings).power
    largest = np.max(case["power"])
    np.testing.assert_allclose(power, case["power"], atol=1e-3 * largest)


@pytest.mark.parametrize("case", REFERENCE["loads"]["cases"], ids=lambda x: x["name"])
def test_loads_are_those_of_least_squares_without_pull(case):
    """Pieces that all head along x: they have no width, and only their places count."""
    weights = np.array(case["c"])[:, None]
    count = len(weights)
    centres = (np.array(case["x"]) + 1j * np.array(case["y"]))[:, None]
    fraction = np.broadcast_to(case["length"], count).reshape(-1, 1)
    along = np.ones((count, 1), complex)
    for name, width in (("pitch", None), ("pitch_roll", 0.0)):
        if case[name] is None:
            continue
        loads = fraction * balanced_loads(weights, fraction, centres, along, width)
        np.testing.assert_allclose(loads[:, 0], case[name]["N"], atol=2e-7)


def lifting(phase):
    """The lifting of kinematic-snake, as weights that do not exceed 1."""

    def weight(s, t):
        raised = 1 + np.cos(t + 2 * np.pi * (s + phase))
        return np.maximum(0.0, raised) / 2

    return FunctionContact(function=weight, follows="shape", bearing="normalised")


@pytest.mark.parametrize(
    "case", REFERENCE["kinematic_snake"]["quasi_static"]["cases"][1:], ids=str
)
def test_a_snake_that_lifts_moves_as_the_smooth_snake_without_inertia(case):
    t = 2 * np.pi * np.arange(256) / 256
    alpha = 7.0 * np.stack([np.cos(t), -np.sin(t)], -1)
    rate = 7.0 * np.stack([-np.sin(t), -np.cos(t)], -1)
    skin = SkinFriction(1.0, 1.5, reference=1.0)
    medium = Surface(C=0.0, gamma0=0.24, across=2.0)
    nets = []
    for elements in (40, 80):
        body = Touching(Serpenoid(elements), lifting(case["phase"]))
        xi = body_velocity(medium, body, alpha, rate, effects=[skin]).xi
        nets.append(displacement(xi))
    net = nets[1] + (nets[1] - nets[0]) / 3
    turn = 2 * np.pi
    difference = net - case["net"]
    difference[2] = (difference[2] + np.pi) % turn - np.pi
    assert np.abs(difference).max() < 2e-4
