"""Formulas: they are what the numbers are, in lowest terms, and known by hand."""

import numpy as np
import pytest
import sympy as sp
from commands import geomech
from registry import SYSTEMS

from geomech import scenes
from geomech.mathematics import symbolic
from geomech.mathematics.symbolic import connections
from geomech.mathematics.systems import (
    FloatingChain,
    NoSlipSnake,
    Swimmer,
)
from geomech.mathematics.systems.framed import formula
from rft import Backbone, Chain, Coulomb, SkinFriction, Viscous

UNEVEN = Chain((1.0, 2.0, 1.5), 0.3, "link-1")
EXACT = {
    "viscous": Swimmer(Viscous(1.5), UNEVEN),
    "viscous, mean": Swimmer(Viscous(2.0), Chain((1, 1), 0.3)),
    "snake": SYSTEMS["no-slip-snake"],
    "snake, mean": NoSlipSnake((0.8, 1.3, 1.0)),
    "cart": SYSTEMS["differential-drive"],
    "ideal fluid": SYSTEMS["ideal-fluid-swimmer"],
    "afloat": FloatingChain((0.8, 1.3, 1.0), 0.4, "link-3", (1.0, 0.5, 2.0)),
}


@pytest.mark.parametrize(
    ("name", "in_lowest_terms"),
    [
        *((name, False) for name in EXACT),
        ("viscous, mean", True),
        ("snake, mean", True),
    ],
)
def test_formulas_give_the_numbers(name, in_lowest_terms):
    system = EXACT[name]
    A, alpha = formula(system)
    if in_lowest_terms:
        A = symbolic.simplified(A, alpha)
    rng = np.random.default_rng(0)
    shapes, rates = rng.uniform(-2.5, 2.5, (2, 40, system.joints))
    expected = system.velocity(shapes, rates)
    scale = 1 + np.abs(expected).max(-1, keepdims=True)
    found = symbolic.velocity(A, alpha)(shapes, rates)
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-11)


def test_what_floats_is_as_by_hand():
    A, (a, b) = FloatingChain().symbolic()
    short = symbolic.simplified(A, (a, b))
    ccf = symbolic.simplified(symbolic.ccf(short, (a, b)), (a, b))
    D = 13 + 6 * sp.cos(a) + 6 * sp.cos(b) + 2 * sp.cos(a + b)
    sines = 3 * sp.sin(a) + 3 * sp.sin(b) + sp.sin(a + b)
    expected = sp.Mul(-4, sines, D**-2, evaluate=False)
    assert [str(x) for x in ccf] == ["0", "0", str(expected)]
    assert short[:2, :] == sp.zeros(2, 2)


def test_the_snake_is_as_by_hand():
    A, (a, b) = connections.no_slip_snake(frame="link-2")
    ccf = symbolic.simplified(symbolic.ccf(A, (a, b)), (a, b))
    assert ccf[0] == 1 / (12 * sp.sin(a / 2 - b / 2) ** 2)


@pytest.mark.parametrize("ratio", [1.5, 4.0])
def test_symbols_stay(ratio):
    r = sp.Symbol("r", positive=True)
    A, (a,) = connections.viscous_chain((1, 2), r, "link-1")
    short = symbolic.simplified(A, (a,))
    assert short.free_symbols == {r, a}
    found = np.array(short.subs({r: ratio, a: 0.7}), float)[:, 0]
    swimmer = Swimmer(Viscous(ratio), Chain((1, 2), frame="link-1"))
    np.testing.assert_allclose(found, swimmer.velocity([0.7], [1.0]), atol=1e-13)


a, b = ALPHA = sp.symbols("alpha_1 alpha_2", real=True)
PRODUCTS = (sp.sin(a) * sp.cos(b) + sp.cos(a) * sp.sin(b)) * sp.sin(a + b)
PRODUCTS /= (1 + sp.cos(a)) ** 2
SUMS = (1 - sp.cos(2 * a + 2 * b)) / (8 * sp.cos(a / 2) ** 4)
ONES = sp.sin(a / 3) ** 2 + sp.cos(a / 3) ** 2 + sp.sin(a / 5) ** 2 + sp.cos(a / 5) ** 2


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (PRODUCTS - SUMS, 0),
        (sp.sin(a) - sp.sin(b + a - b), 0),
        (ONES, 2),
        # What is not even, nor odd, nor of waves alone stays.
        (sp.sin(a) + sp.cos(b), sp.sin(a) + sp.cos(b)),
        (a * sp.sin(b), a * sp.sin(b)),
        (sp.exp(a), sp.exp(a)),
        (sp.sin(a**2), sp.sin(a**2)),
        (sp.sin(a + 1), sp.sin(a + 1)),
        (sp.sqrt(2) * sp.cos(a), sp.sqrt(2) * sp.cos(a)),
        (0.1 * a, 0.1 * a),
    ],
)
def test_formulas_are_brought_to_lowest_terms(expression, expected):
    assert symbolic.simplified(sp.Matrix([expression]), ALPHA)[0] == expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (1 / 3, sp.Rational(1, 3)),
        (0.1, sp.Rational(1, 10)),
        (1e-9, sp.Rational(1, 10**9)),
        (0.123456789, sp.Rational(123456789, 10**9)),
        (2, 2),
        (sp.Symbol("x"), sp.Symbol("x")),
    ],
)
def test_numbers_are_taken_as_they_are_written(value, expected):
    assert connections.exact(value) == expected


NONE = {
    "glass": Swimmer(Coulomb(), Chain()),
    "skin": Swimmer(Viscous(), Chain(), (SkinFriction(),)),
    "backbone": Swimmer(Viscous(), Backbone(8)),
    "modes": Swimmer(
        Viscous(), Chain((1,) * 4, modes=((1.0, 0.0, 1.0), (0.0, 1.0, 0.0)))
    ),
    "table": SYSTEMS["table"],
}


@pytest.mark.parametrize("name", NONE)
def test_what_has_no_formula_says_so(name):
    with pytest.raises(ValueError, match="formula"):
        formula(NONE[name])


def test_the_command_prints_formulas_that_sympy_reads():
    out = geomech("symbolic", "three-link-floating")[1]
    told = dict(line.split(" = ") for line in out.splitlines())
    read = sp.lambdify(sp.symbols("alpha_1 alpha_2"), sp.sympify(told["A_theta_2"]))
    system = scenes.load("three-link-floating").system
    expected = system.velocity([0.3, -0.8], [0, 1])[2]
    assert read(0.3, -0.8) == pytest.approx(expected)
