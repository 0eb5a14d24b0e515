"""The exact link integral against 50-digit arithmetic and quadrature; derivatives;
orders of the quadratures."""

import mpmath as mp
import numpy as np
import pytest
from loads import element_load
from registry import CLOSED, MEDIA

from rft import Granular
from rft.formulas.link import k_function
from rft.laws.records import record

mp.mp.dps = 50
GLASS = MEDIA["glass-0.3mm-loose"]


def reference(medium, a, m, w, eps):
    """<f_t>, <f_n>, <s f_n> in 50 digits, from antiderivatives in s."""
    a, m, w, eps = (mp.mpf(float(x)) for x in (a, m, w, eps))
    total = [mp.mpf(0)] * 3
    for q, k_t, k_n in medium.dry:
        A2 = (mp.mpf(q) * a) ** 2 + eps**2
        if w == 0:
            R = mp.sqrt(A2 + m**2)
            inverse, u, su = 1 / R, m / R, mp.mpf(0)
        else:
            u1, u2 = m - w, m + w
            R1, R2 = mp.sqrt(A2 + u1**2), mp.sqrt(A2 + u2**2)
            inverse = (mp.asinh(u2 / mp.sqrt(A2)) - mp.asinh(u1 / mp.sqrt(A2))) / (
                2 * w
            )
            u = (R2 - R1) / (2 * w)
            square = (u2 * R2 - u1 * R1) / (4 * w) - A2 * inverse / 2  # <u^2 / R>
            su = (square - m * u) / w
        total = [t + x for t, x in zip(total, (k_t * a * inverse, k_n * u, k_n * su))]
    return [float(t) for t in total]


def on_one(load, a, m, w, eps):
    return load(*(np.array([[float(x)]]) for x in (a, m, w)), np.array([float(eps)]))


def test_over_sixteen_decades():
    """Every ratio of a, m, w from 1e-16 to 1, signs mixed: relative error below 1e-13
    of each force."""
    rng = np.random.default_rng(1)
    samples = rng.choice([-1.0, 1.0], (300, 3)) * 10.0 ** rng.uniform(-16, 0, (300, 3))
    samples[::10, 2] = samples[::10, 1]  # the pivot at the link's end
    samples[1::10, 2] = samples[1::10, 1] * (1 + 1e-12)
    samples[2::10, 2] = 0.0
    mp.mp.dps = 100  # the reference itself cancels
    for a, m, w in samples:
        got = on_one(element_load(GLASS), a, m, w, 1e-20)[:, 0, 0, 0]
        np.testing.assert_allclose(got, reference(GLASS, a, m, w, 1e-20), rtol=1e-13)


@pytest.mark.parametrize(
    "t", [1e-12, 1e-5, 0.1, 0.1999999, 0.2, 0.2000001, 0.5, 0.9, 0.99999]
)
def test_k_on_both_sides_of_its_branch(t):
    exact_k = (mp.atanh(mp.mpf(t)) - mp.mpf(t)) / mp.mpf(t) ** 3
    got = k_function(np.array([t]), np.array([(1 - t) * (1 + t)]))[0]
    assert got == pytest.approx(float(exact_k), rel=5e-14)


@pytest.mark.parametrize("name", CLOSED)
def test_gauss_agrees_where_the_law_is_smooth(name):
    rng = np.random.default_rng(4)
    v = rng.normal(size=(3, 2, 30))
    v[1] = 3.0 * np.sign(v[1]) * (1 + np.abs(v[2]))  # no pivot in the link
    fine, closed = (
        element_load(CLOSED[name], "gauss:40")(*v, np.full(30, 0.1)),
        element_load(CLOSED[name])(*v, np.full(30, 0.1)),
    )
    np.testing.assert_allclose(
        fine, closed, rtol=1e-8, atol=1e-11 * np.abs(closed).max()
    )


def test_midpoint_is_of_order_two():
    rng = np.random.default_rng(5)
    v, eps = rng.normal(size=(3, 1, 30)), np.full(30, 1e-2)
    v[1] = 2.0 + np.abs(v[1] + v[2])
    truth = element_load(GLASS)(*v, eps)[:, 0]
    counts = np.array([20, 40, 80, 160])
    errors = [
        np.abs(element_load(GLASS, f"midpoint:{n}")(*v, eps)[:, 0] - truth).max()
        for n in counts
    ]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(
        2.0, abs=0.1
    )


class CubicDrag:
    """A law with no closed form: drag grows with the cube root of speed."""

    dry = viscous = None
    mirror = True

    def traction(self, v_t, v_n, eps=0.0):
        speed = np.sqrt(v_t**2 + v_n**2 + eps**2)
        factor = speed ** (-2 / 3)
        return v_t * factor, 1.7 * v_n * factor


def test_a_law_without_closed_form_needs_only_its_traction():
    assert record(CubicDrag()).nodes.size == 24  # of Gauss's, in place of "exact"


def test_at_rest_there_is_no_force_and_no_nan():
    load = element_load(Granular(1.8, 0.24))(*np.zeros((3, 1, 1)), np.array([1e-6]))
    assert np.array_equal(load[:, 0], np.zeros((3, 1, 1)))
    assert np.isfinite(load).all()
