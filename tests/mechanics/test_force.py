"""The force on a link that moves, against the integral of Eqs. 2 and 3."""

import numpy as np
import pytest

import rft

GLASS = rft.Granular(C=1.8, gamma0=np.radians(13.8))
PLACES, WEIGHTS = np.polynomial.legendre.leggauss(200)


def integrated(velocity, rotation, heading, length, axial_drag):
    """Return (force_x, force_y, moment) by quadrature of Eqs. 2 and 3."""
    t = np.array([np.cos(heading), np.sin(heading)])
    n = np.array([-t[1], t[0]])
    s = PLACES[:, None] * length / 2
    v = np.array(velocity) + rotation * s * n
    v = v / np.linalg.norm(v, axis=1, keepdims=True)
    f_n = (1 + 1.8 / np.sqrt(np.tan(np.radians(13.8)) ** 2 + (v @ n) ** 2)) * (v @ n)
    force = -axial_drag * (f_n[:, None] * n + (v @ t)[:, None] * t)
    moment = s[:, 0] * (force @ n)
    weights = WEIGHTS * length / 2
    return [*(weights @ force), weights @ moment]


@pytest.mark.parametrize("rotation", [0.0, 0.5, -0.5])
@pytest.mark.parametrize("heading", [0.0, 0.7, 3.0])
def test_the_force_on_a_link_is_the_integral_of_equations_2_and_3(rotation, heading):
    options = {"heading": heading, "length": 0.08, "axial_drag": 17.0}
    found = rft.link_force(GLASS, [0.1, -0.06], rotation, **options)
    expected = integrated([0.1, -0.06], rotation, *options.values())
    np.testing.assert_allclose(
        [*found.force, found.moment], expected, rtol=1e-12, atol=1e-12
    )


def test_forces_on_the_links_of_a_swimmer_balance():
    body = rft.Chain((1, 1.4, 0.8), frame="link-1")
    alpha, alphadot = np.array([0.5, -0.3]), np.array([1.0, 0.4])
    xi = rft.body_velocity(GLASS, body, alpha, alphadot).xi
    elements = body.motion(alpha[:, None], alphadot[:, None])
    centre = elements.centres[:, 0]
    heading = np.arctan2(elements.s, elements.c)[:, 0]
    turned = np.exp(1j * heading)
    held = turned * (elements.v_t + 1j * elements.v_n)[:, 0]
    v = held + xi[0] + 1j * xi[1] + 1j * xi[2] * centre
    length = 2 * elements.half[:, 0]
    rotation = (elements.v_w / elements.half)[:, 0] + xi[2]
    force = np.zeros(2)
    moment = 0.0
    for k in range(3):
        options = {"heading": heading[k], "length": length[k]}
        found = rft.link_force(GLASS, [v[k].real, v[k].imag], rotation[k], **options)
        force += found.force
        lever = centre[k].real * found.force[1] - centre[k].imag * found.force[0]
        moment += found.moment + lever
    np.testing.assert_allclose([*force, moment], 0.0, atol=1e-4)


def test_many_links_are_computed_at_once_and_one_at_rest_has_no_force():
    found = rft.link_force(GLASS, np.zeros((4, 5, 2)), heading=np.zeros(5))
    assert found.force.shape == (4, 5, 2) and found.moment.shape == (4, 5)
    assert not found.force.any() and not found.moment.any()


@pytest.mark.parametrize(
    ("velocity", "options", "said"),
    [
        ([1.0, 0.0, 0.0], {}, "velocity must have x and y"),
        ([np.nan, 0.0], {}, "velocity must be finite"),
        (np.ones((3, 2)), {"heading": np.zeros(2)}, "broadcast"),
        ([1.0, 0.0], {"axial_drag": -1.0}, "axial_drag"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(velocity, options, said):
    with pytest.raises(ValueError, match=said):
        rft.link_force(GLASS, velocity, **options)
