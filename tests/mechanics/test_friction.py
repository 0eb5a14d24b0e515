"""Chains on dry ground that touch it at every point, against programs that share no
code: data/contact.json, whose cases without a wave have full contact."""

import json
from pathlib import Path

import numpy as np
import pytest

from rft import Chain, Coulomb, Granular, body_velocity
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
