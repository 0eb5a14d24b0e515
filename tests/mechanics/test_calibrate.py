"""Laws fitted to drag: parameters, covariance and band against closed forms; the
sample; what is no drag is refused."""

import dataclasses
import math

import numpy as np
import pytest
from commands import geomech
from tabled import of_json

from geomech import scenes
from geomech.io.rows import Rows
from geomech.scenes.data import drag
from geomech.studies.terradynamics import calibration
from rft import Coulomb, Granular, Viscous
from rft.fits.rods import Fit, fit
from rft.laws.drag import Rod, rod_drag

PSI = np.array([0.0, 4, 9, 15, 30, 48, 60, 75, 90])
ROD = Rod(0.007, 0.09, 0.04, 640.0)
STRESS = 3.7 / (2 * 0.007 * 0.09)  # Pa
UNIT = 2 * 640.0 * 9.81 * 0.007 * 0.04 * 0.09  # N, of k = 1 in Eq. 2


def exact(medium, force=3.7, psi=PSI):
    return force * np.array(
        medium.traction(np.cos(np.radians(psi)), np.sin(np.radians(psi)))
    )


def noisy(seed=0, psi=PSI, size=0.03, medium=Granular(1.8, 0.24)):  # noqa: B008
    return rod_drag(
        psi,
        *(
            exact(medium, 0.7, psi)
            + np.random.default_rng(seed).normal(0, size, (2, psi.size))
        ),
    )


def test_the_sample_has_its_published_fit():
    found = of_json(geomech("fit-medium", "short-rod-drag", "--json")[1])
    values = found["value"].values  # C, gamma0 (deg), k
    assert values == pytest.approx([1.49, 12.6, 2.49], rel=0.005)
    assert float(found["rms"]) == pytest.approx(0.056, abs=0.001)
    assert found["value"].error[1] == pytest.approx((17.7 - 7.5) / 2, abs=0.5)
    # Eq. 2, with sizes of the file's header.
    stress = values[2] * 0.588 * 1030 * 9.81 * 0.030
    assert float(found["axial_stress"]) == pytest.approx(stress)
    assert float(found["axial_force"]) == pytest.approx(stress * 2 * 0.008 * 0.080)


@pytest.mark.parametrize("C", [0.1, 1.8, 40.0])
@pytest.mark.parametrize("gamma0_deg", [1.0, 13.8, 55.0])
def test_exact_drag_gives_its_law_back(C, gamma0_deg):
    gamma0 = math.radians(gamma0_deg)
    found = fit("granular", rod_drag(PSI, *exact(Granular(C, gamma0))), ROD)
    assert found.names == ("C", "gamma0", "k")
    np.testing.assert_allclose(found.values, [C, gamma0, 3.7 / UNIT], rtol=1e-6)
    assert found.axial_stress == pytest.approx(STRESS)
    assert dataclasses.replace(found.medium, covariance=None) == Granular(*found.values)


@pytest.mark.parametrize(
    ("law", "medium", "names", "values"),
    [
        ("viscous", Viscous(1.7), ("ratio", "axial_stress"), [1.7, STRESS]),
        ("coulomb", Coulomb(), ("k",), [3.7 / UNIT]),
    ],
)
def test_other_laws(law, medium, names, values):
    """In a fluid there is no weight of grains."""
    found = fit(law, rod_drag(PSI, *exact(medium)), ROD)
    assert found.names == names
    np.testing.assert_allclose(found.values, values, rtol=1e-9)
    assert type(found.medium) is type(medium)


@pytest.mark.parametrize(
    ("rod", "name", "size"),
    [
        (Rod(), "axial_force", 3.7),
        (Rod(0.007, None, 0.04, 640.0), "axial_force", 3.7),
        (Rod(0.007, 0.09), "axial_stress", STRESS),
        (Rod(0.007, 0.09, 0.04), "axial_stress", STRESS),
    ],
)
def test_axial_drag_is_told_as_far_as_sizes_are_known(rod, name, size):
    found = fit("granular", rod_drag(PSI, *exact(Granular(1.8, 0.24))), rod)
    assert found.names[2] == name
    assert found.values[2] == pytest.approx(size)
    assert found.k is found.medium.k is None


def by_hand(found: Fit, psi):
    """(2, N, 3): slopes of both forces in C, gamma0 and k, from Eq. 3 differentiated on
    paper."""
    (C, g, k), s, c = found.values, np.sin(psi), np.cos(psi)
    root = np.sqrt(math.tan(g) ** 2 + s**2)
    across = UNIT * np.array(
        [
            k * s / root,
            -k * C * s * math.tan(g) / math.cos(g) ** 2 / root**3,
            s + C * s / root,
        ]
    )
    return np.array([UNIT * np.array([0 * c, 0 * c, c]).T, across.T])


def test_covariance_and_band_are_those_of_the_law_linearised():
    weight = np.array([1.0, 2, 1, 1, 3, 1, 1, 0, 1])
    drag = noisy(3)
    drag = dataclasses.replace(drag, weight=weight / weight[weight > 0].mean())
    found = fit("granular", drag, ROD)
    slopes = by_hand(found, drag.psi)
    normal = np.einsum("n,knp,knq->pq", drag.weight, slopes, slopes)
    scatter = (drag.weight * found.residuals**2).sum() / (
        2 * 8 - 3
    )  # the row that weighs nothing is no measurement
    np.testing.assert_allclose(
        found.covariance, scatter * np.linalg.inv(normal), rtol=1e-4
    )
    psi = np.radians([5.0, 20.0, 80.0])
    spread = np.einsum(
        "knp,pq,knq->kn", by_hand(found, psi), found.covariance, by_hand(found, psi)
    )
    assert found.degrees_of_freedom == 13
    np.testing.assert_allclose(
        found.band(psi), 2.1604 * np.sqrt(spread), rtol=1e-4, atol=1e-12
    )  # Student's, 95 %
    np.testing.assert_allclose(
        found.intervals[:, 1] - found.values, 2.1604 * found.errors, rtol=1e-4
    )
    np.testing.assert_allclose(
        found.medium.covariance, 1.0400**2 * found.covariance, rtol=1e-4
    )  # and 68 %


def test_no_other_start_ends_lower():
    """Against the best of a fine scan of gamma0, in which C and the axial drag are
    linear least squares."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        medium = Granular(
            10 ** rng.uniform(-0.5, 1.3), math.radians(rng.uniform(4, 40))
        )
        drag = noisy(seed, size=0.05, medium=medium)
        found, (c, s) = fit("granular", drag), (np.cos(drag.psi), np.sin(drag.psi))
        scan = []
        for tan in np.tan(np.radians(np.linspace(0.2, 89, 600))):
            columns = np.array(
                [
                    np.concatenate([c, s]),
                    np.concatenate([0 * s, s / np.sqrt(tan**2 + s**2)]),
                ]
            ).T
            size, *_ = np.linalg.lstsq(columns, drag.forces.ravel(), rcond=None)
            if (size >= 0).all():
                scan.append(((columns @ size - drag.forces.ravel()) ** 2).sum())
        assert (found.residuals**2).sum() <= min(scan) * (1 + 1e-6), seed


def test_a_weight_of_two_is_a_row_given_twice_and_of_zero_none():
    drag = noisy(1)
    weight = np.array([1, 1, 1, 2, 1, 1, 0, 1, 1])
    rows = np.repeat(np.arange(9), weight)
    some = rod_drag(np.degrees(drag.psi)[rows], *drag.forces[:, rows])
    weighed = dataclasses.replace(drag, weight=weight)
    expected = fit("granular", some).values
    np.testing.assert_allclose(fit("granular", weighed).values, expected, rtol=1e-6)


def test_angles_are_folded_by_symmetry():
    psi = np.array([-75.0, -20, 0, 10, 45, 90, 120, 170, 180, 200, 271, 330])
    folded = np.array([75.0, 20, 0, 10, 45, 90, 60, 10, 0, 20, 89, 30])
    forces = exact(
        Granular(1.8, 0.24), psi=psi
    )  # with the signs of the velocity's parts
    for given in (forces, np.abs(forces)):
        drag = rod_drag(psi, *given)
        np.testing.assert_allclose(np.degrees(drag.psi), folded, atol=1e-9)
        np.testing.assert_allclose(drag.forces, np.abs(forces), atol=1e-14)


def test_end_caps():
    """Fitted or fixed: the ends' forces as DESIGN of the effect has them, e =
    1.6 for both together, over the projected area of the side."""
    (C, g), e = (1.8, 0.24), 1.6
    v = np.cos(np.radians(PSI)), np.sin(np.radians(PSI))
    area = e * math.pi * 0.007**2 / (2 * 0.007 * 0.09)
    along, across = (x + C * np.sin(np.arctan(x / math.tan(g))) for x in v)
    along = v[0] + area * (along - v[0])
    drag = rod_drag(PSI, 3.7 * along, 3.7 * (across + area * v[1]))
    found = fit("granular", drag, ROD, "fitted")
    assert found.names == ("C", "gamma0", "k", "end_caps")
    np.testing.assert_allclose(found.values, [C, g, 3.7 / UNIT, e], rtol=1e-5)
    fixed = fit("granular", drag, ROD, e)
    np.testing.assert_allclose(fixed.values, [C, g, 3.7 / UNIT], rtol=1e-6)


@pytest.mark.parametrize(
    ("law", "medium", "psi", "said"),
    [
        ("granular", Coulomb(), PSI, "the bound C = 0"),
        ("granular", Viscous(3.0), PSI, "the bound|distinguish|converge"),
        ("granular", Granular(1.8, 5e-4), PSI, "the bound gamma0"),
        (
            "granular",
            Granular(1.8, 0.24),
            np.array([0.0, 90.0]),
            "do not distinguish C, gamma0|at the bound",
        ),
        (
            "granular",
            Granular(1.8, 0.24),
            np.array([30.0]),
            "2 forces are too few for C, gamma0",
        ),
        ("viscous", Granular(1.8, 0.24), np.array([90.0]), "few|distinguish|bound"),
    ],
)
def test_what_data_do_not_settle_is_refused(law, medium, psi, said):
    with pytest.raises(ValueError, match=said):
        fit(law, rod_drag(psi, *exact(medium, psi=psi)))


@pytest.mark.parametrize(
    ("lines", "sizes"),
    [
        (
            ["radius = 8 mm, length = 80 mm, depth = 30 mm, density = 605 kg/m^3"],
            (0.008, 0.08, 0.03, 605),
        ),
        (
            [
                "radius_mm: 8",
                "length_m = .08",
                "depth cm: 3",
                "bulk density 0.605 g/cm3, packing 0.6",
            ],
            (0.008, 0.08, 0.03, 605),
        ),
        (
            ["radius: 0.008", "length = 0.08", "depth: 0.03", "density 1,605"],
            (0.008, 0.08, 0.03, 1605),
        ),
        (
            [
                "Rod radius 8 mm and length 80 mm at a depth of 3 cm in beads of diameter 0.3 mm, density 2500 kg/m3, volume "
                "fraction 58 %"
            ],
            (0.008, 0.08, 0.03, 1450),
        ),
        (
            ["grain diameter 0.3 mm", "rod diameter 16 mm, 8 cm long, 30 mm deep"],
            (0.008, 0.08, 0.03, None),
        ),
        (
            ["16 mm diameter rod, 80 mm long, in 6 mm beads at 30 mm depth"],
            (0.008, 0.08, 0.03, None),
        ),
        (
            [
                "rod 16 mm diameter x 80 mm; bed 20 cm deep; density of the rod 2700 kg/m^3"
            ],
            (0.008, 0.08, None, None),
        ),
        (
            [
                "effective radius 8 mm",
                "density 2500 kg/m^3, packing density 0.6, void fraction 0.4",
            ],
            (0.008, None, None, 1500),
        ),
        (["radius 8000 um, length 8 cm"], (0.008, 0.08, None, None)),
        (["nothing", "mean after 30 mm of travel, 0.1 m/s"], (None, None, None, None)),
    ],
)
def test_sizes_of_header_lines(lines, sizes):
    found = drag.sizes(Rows("f", "", 1, (), [], lines))
    names = ("radius", "length", "depth", "density")
    assert found == pytest.approx(
        {name: x for name, x in zip(names, sizes) if x is not None}
    )


SCENE = '[medium]\nfile = "M.toml"\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n'


@pytest.mark.parametrize("law", ["granular", "viscous", "coulomb"])
def test_the_medium_written_is_the_one_fitted(law, tmp_path):
    geomech("fit-medium", "short-rod-drag", "-o", tmp_path / "M.toml", "--law", law)
    (tmp_path / "s.toml").write_text(SCENE)
    read = scenes.load(tmp_path / "s.toml").system.medium
    fitted = calibration.rod_fit("short-rod-drag", law).medium
    assert type(read) is type(fitted)
    for name, value in dataclasses.asdict(read).items():
        if value is None:
            assert getattr(fitted, name) is None
        else:
            np.testing.assert_allclose(value, getattr(fitted, name), rtol=1e-15)


def test_what_repeats_scatter_by_is_told_with_the_freedom_that_their_means_leave():
    """Of three angles, one of them once and one thrice: three of six rows are free, in
    two components."""
    psi = np.array([0.2, 0.5, 0.2, 0.9, 0.5, 0.5])
    off = [[1.0, 3.0, -1.0, 0.0, 0.0, -3.0], [-2.0, 1.0, 2.0, 0.0, -2.0, 1.0]]
    forces = np.array([[5.0], [7.0]]) + psi * [[2.0], [-3.0]] + off
    rms = calibration.repeats(psi + 1e-11 * np.arange(6), forces)
    assert rms == pytest.approx(np.sqrt((20.0 + 14.0) / 6))
