"""Formulas: they are what the numbers are, in lowest terms, and what is known by hand."""

import numpy as np
import pytest
import sympy as sp
from commands import geomech
from registry import SYSTEMS

from geomech import scenes
from geomech.mathematics import symbolic
from geomech.mathematics.gaits import Circle
from geomech.mathematics.symbolic import connections
from geomech.mathematics.systems import (
    DifferentialDrive,
    FloatingChain,
    IdealFluidSwimmer,
    NoSlipSnake,
    Swimmer,
)
from geomech.mathematics.systems.framed import formula
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes import Scene
from geomech.studies.scene_tables import SceneTables
from rft import Backbone, Chain, Coulomb, SkinFriction, Viscous
from rft.formulas import se2

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


@pytest.mark.parametrize("name", EXACT)
def test_formulas_give_the_numbers(name):
    """To rounding, as they come and in lowest terms, and so does the CCF; by local differences, of order 8, of A."""
    system, rng = EXACT[name], np.random.default_rng(0)
    A, alpha = formula(system)
    short = symbolic.simplified(A, alpha)
    shapes, rates = rng.uniform(-2.5, 2.5, (2, 40, system.joints))
    wanted = system.velocity(shapes, rates)
    for matrix in (A, short):
        found = symbolic.velocity(matrix, alpha)(shapes, rates)
        assert (
            np.abs(found - wanted).max(-1) < 1e-11 * (1 + np.abs(wanted).max(-1))
        ).all()
    if system.joints == 1:
        return
    ccf = symbolic.ccf(short, alpha)
    if name == "snake":  # of the others it takes as long as all else here
        ccf = symbolic.simplified(ccf, alpha)
    here = np.array([1.1, -0.4])
    of = lambda shape: np.stack([system.velocity(shape, e) for e in np.eye(2)], -1)
    weights, h = (4 / 5, -1 / 5, 4 / 105, -1 / 280), 1e-2
    slope = lambda e: (
        sum(
            w * (of(here + k * h * e) - of(here - k * h * e))
            for k, w in enumerate(weights, 1)
        )
        / h
    )
    (first, second), columns = np.eye(2), of(here).T
    dA = slope(first)[:, 1] - slope(second)[:, 0]
    (x1, y1, t1), (x2, y2, t2) = columns
    bracket = [t2 * y1 - t1 * y2, t1 * x2 - t2 * x1, 0]
    found = np.array(sp.lambdify(alpha, list(ccf))(*here), float)
    np.testing.assert_allclose(
        found, dA + bracket, atol=1e-9 * np.abs(dA).max() + 1e-12
    )


def test_what_floats_is_as_by_hand():
    A, alpha = FloatingChain().symbolic()
    a, b = alpha
    D = 13 + 6 * sp.cos(a) + 6 * sp.cos(b) + 2 * sp.cos(a + b)
    A = symbolic.simplified(A, alpha)
    ccf = symbolic.simplified(symbolic.ccf(A, alpha), alpha)
    wanted = sp.Mul(
        -4, 3 * sp.sin(a) + 3 * sp.sin(b) + sp.sin(a + b), D**-2, evaluate=False
    )
    assert [str(x) for x in ccf] == ["0", "0", str(wanted)]
    assert A[:2, :] == sp.zeros(2, 2)


def test_the_snake_and_the_cart_are_as_by_hand():
    A, (a, b) = connections.no_slip_snake(frame="link-2")
    ccf = symbolic.simplified(symbolic.ccf(A, (a, b)), (a, b))
    assert ccf[0] == 1 / (12 * sp.sin(a / 2 - b / 2) ** 2)
    A, alpha = connections.differential_drive()
    r, w = sorted(A.free_symbols, key=str)
    assert symbolic.ccf(A, alpha) == sp.Matrix([0, -(r**2) / w, 0])
    assert DifferentialDrive(0.3, 1.5).symbolic()[0] == A.subs(
        {r: sp.Rational(3, 10), w: sp.Rational(3, 2)}
    )


def test_symbols_stay():
    """A viscous chain of any ratio about the straight shape: as its numbers are for two of them."""
    ratio = sp.Symbol("r", positive=True)
    A, alpha = connections.viscous_chain((1, 2), ratio, "link-1")
    short = symbolic.simplified(A, alpha)
    assert short.free_symbols == {ratio, *alpha}
    for value in (1.5, 4.0):
        xi = Swimmer(Viscous(value), Chain((1, 2), frame="link-1")).velocity(
            [0.7], [1.0]
        )
        np.testing.assert_allclose(
            np.array(short.subs({ratio: value, alpha[0]: 0.7}), float)[:, 0],
            xi,
            atol=1e-13,
        )


def test_one_function_has_one_formula():
    """Written in two ways, by products and powers or by sums; what is not even, nor odd, nor of waves alone stays."""
    a, b = alpha = sp.symbols("alpha_1 alpha_2", real=True)
    one = (
        (sp.sin(a) * sp.cos(b) + sp.cos(a) * sp.sin(b))
        * sp.sin(a + b)
        / (1 + sp.cos(a)) ** 2
    )
    other = (1 - sp.cos(2 * a + 2 * b)) / (8 * sp.cos(a / 2) ** 4)
    made = [
        symbolic.simplified(sp.Matrix([x]), alpha)[0] for x in (one, other, one - other)
    ]
    assert made == [made[0], made[0], 0] and made[0] != 0
    assert (
        symbolic.simplified(
            sp.Matrix([sp.sin(a) / sp.tan(b) ** 0 - sp.sin(b + a - b)]), alpha
        )[0]
        == 0
    )
    odd = [
        sp.sin(a) + sp.cos(b),
        a * sp.sin(b),
        sp.exp(a),
        sp.sin(a**2),
        sp.sin(a + 1),
        sp.sqrt(2) * sp.cos(a),
        0.1 * a,
    ]
    assert symbolic.simplified(sp.Matrix(odd), alpha) == sp.Matrix(odd)
    third = (
        sp.sin(a / 3) ** 2
        + sp.cos(a / 3) ** 2
        + sp.sin(a / 5) ** 2
        + sp.cos(a / 5) ** 2
    )
    assert symbolic.simplified(sp.Matrix([third]), alpha)[0] == 2


def test_numbers_are_taken_as_they_are_written():
    assert [connections.exact(x) for x in (1 / 3, 0.1, 1e-9, 2, 0.123456789)] == [
        sp.Rational(1, 3), sp.Rational(1, 10), sp.Rational(1, 10**9), 2, sp.Rational(123456789, 10**9),
    ]  # fmt: skip
    assert connections.exact(sp.Symbol("x")) == sp.Symbol("x")


def test_the_area_is_that_of_the_formula():
    """The integral of the exact CCF over a disc is the area tier's."""
    swimmer, gait = (
        IdealFluidSwimmer(frame="link-2"),
        Circle(amplitude=0.5, centre=(0.4, -0.1)),
    )
    A, alpha = swimmer.symbolic()
    density = sp.lambdify(
        alpha,
        list(symbolic.ccf(symbolic.simplified(A, alpha), alpha)),
        "numpy",
        cse=True,
    )
    nodes, weights = np.polynomial.legendre.leggauss(12)
    r, t = 0.25 * (nodes + 1)[:, None], 2 * np.pi * np.arange(24) / 24
    values = np.stack(
        np.broadcast_arrays(*density(0.4 + r * np.cos(t), -0.1 + r * np.sin(t)))
    )
    total = (values * r * 0.25 * weights[:, None]).sum((1, 2)) * 2 * np.pi / 24
    area = SceneTables(Scene(swimmer, gait, Numerics(grid=61, extent=1.5))).poses(
        "area"
    )
    np.testing.assert_allclose(area, se2.exp(total), atol=2e-7)


def test_latex_has_one_denominator_in_front():
    A, alpha = FloatingChain().symbolic()
    text = symbolic.latex(symbolic.simplified(A, alpha))
    assert text.startswith(
        "A = \\frac{1}{D} \\begin{pmatrix}\n0 &\n0 \\\\\n0 &\n0 \\\\\n"
    )
    cos = r"\cos{\left(%s \right)}"
    one, two, both = (
        cos % x for x in (r"\alpha_{1}", r"\alpha_{2}", r"\alpha_{1} + \alpha_{2}")
    )
    assert text.endswith(f"D = 6 {one} + 6 {two} + 2 {both} + 13")
    assert text.count(r"\frac{1}{D}") == 1
    cart = symbolic.latex(DifferentialDrive(0.5).symbolic()[0], "B")
    assert (
        cart.splitlines()[:2] == [r"B = \begin{pmatrix}", r"\frac{1}{4} &"]
        and "D" not in cart
    )
    lone = symbolic.latex(sp.Matrix([1 / sp.cos(alpha[0]), 2 / sp.cos(alpha[0])]))
    lines = [
        r"A = \frac{1}{D} \begin{pmatrix}",
        r"1 \\",
        "2",
        r"\end{pmatrix},",
        r"\qquad D = \cos{\left(\alpha_{1} \right)}",
    ]
    assert lone.splitlines() == lines


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
    code, out, err = geomech("symbolic", "three-link-floating")
    assert (code, err) == (0, "")
    told = dict(line.split(" = ") for line in out.splitlines())
    assert list(told) == [f"A_{x}_{k}" for x in ("x", "y", "theta") for k in (1, 2)] + [
        f"CCF_12_{x}" for x in ("x", "y", "theta")
    ]
    read = sp.lambdify(sp.symbols("alpha_1 alpha_2"), sp.sympify(told["A_theta_2"]))
    assert read(0.3, -0.8) == pytest.approx(
        scenes.load("three-link-floating").system.velocity([0.3, -0.8], [0, 1])[2]
    )
    code, out, err = geomech("symbolic", "differential-drive", "--latex")
    assert (code, err) == (0, "")
    assert [line for line in out.splitlines() if "=" in line] == [
        r"A = \begin{pmatrix}",
        r"F_{12} = \begin{pmatrix}",
    ]
    assert len(out.splitlines()) == 2 * 2 + 6 + 3  # an entry a line
    assert "CCF" not in geomech("symbolic", "differential-drive", "--no-ccf")[1]
    code, out, err = geomech("symbolic", "three-link-glass")
    assert (code, out) == (
        2,
        "",
    ) and "three-link-glass: a formula is that of a chain" in err


def test_a_frame_of_numbers_has_no_formula(tmp_path):
    file = tmp_path / "s.toml"
    file.write_text(
        'frame = "minimum-perturbation"\n[system]\nkind = "floating-chain"\n[gait]\nkind = "circle"\n'
    )
    code, out, err = geomech("symbolic", str(file))
    assert (
        (code, out) == (2, "")
        and "no formula in the minimum-perturbation frame, which is a field of numbers"
        in err
    )
