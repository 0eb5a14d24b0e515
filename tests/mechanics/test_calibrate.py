"""Laws fitted to drag: parameters, covariance and band against closed forms; the sample; what is no drag is refused."""

import dataclasses
import math

import former
import numpy as np
import pytest
from commands import geomech
from scipy.stats import norm, qmc

from geomech import scenes as scene
from geomech.io.rows import Rows
from geomech.scenes.data import drag
from geomech.studies.terradynamics import calibration
from rft import Coulomb, Granular, Viscous
from rft.fits.rods import Fit, fit
from rft.laws.drag import Rod, rod_drag

PSI = np.array([0.0, 4, 9, 15, 30, 48, 60, 75, 90])
ROD = Rod(0.007, 0.09, 0.04, 640.0)
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
    code, out, err = geomech("fit-medium", "short-rod-drag", "--json")
    found = former.medium(out)
    assert (code, err) == (0, "")
    assert (found["law"], found["repeats_rms"]) == ("granular", None)
    assert (found["C"], found["gamma0_deg"], found["k"]) == pytest.approx(
        (1.49, 12.6, 2.49), rel=0.005
    )
    assert found["rms"] == pytest.approx(0.056, abs=0.001)
    assert found["parameters"] == ["C", "gamma0", "k"]
    assert list(found["intervals"]) == list(found["errors"]) == ["C", "gamma0_deg", "k"]
    assert found["intervals"]["gamma0_deg"] == pytest.approx([7.5, 17.7], abs=0.5)
    assert found["errors"]["gamma0_deg"] == pytest.approx(
        math.degrees(math.sqrt(found["covariance"][1][1]))
    )
    assert found["axial_stress_Pa"] == pytest.approx(
        found["k"] * 0.588 * 1030 * 9.81 * 0.030
    )  # Eq. 2, the file's header
    assert found["axial_force_N"] == pytest.approx(
        found["axial_stress_Pa"] * 2 * 0.008 * 0.080
    )
    left = found["residuals"]
    assert left["F_parallel_N"][0] == pytest.approx(0.470 - found["axial_force_N"])
    both = np.array([left["F_parallel_N"], left["F_perpendicular_N"]])
    assert found["rms"] == pytest.approx(math.sqrt((both**2).mean()))


@pytest.mark.parametrize("C", [0.1, 1.8, 40.0])
@pytest.mark.parametrize("gamma0_deg", [1.0, 13.8, 55.0])
def test_exact_drag_gives_its_law_back(C, gamma0_deg):
    medium = Granular(C, math.radians(gamma0_deg))
    found = fit("granular", rod_drag(PSI, *exact(medium)), ROD)
    np.testing.assert_allclose(
        found.values, [C, math.radians(gamma0_deg), 3.7 / UNIT], rtol=1e-6
    )
    assert found.names == ("C", "gamma0", "k") and found.rms < 1e-7
    assert found.axial_force == pytest.approx(
        3.7
    ) and found.axial_stress == pytest.approx(3.7 / (2 * 0.007 * 0.09))
    assert dataclasses.replace(found.medium, covariance=None) == Granular(*found.values)


def test_the_unit_of_force_does_not_matter():
    drag = noisy(2)
    want = fit("granular", drag)
    for unit in (1e-6, 1e3, 1e6):
        found = fit("granular", dataclasses.replace(drag, forces=unit * drag.forces))
        np.testing.assert_allclose(found.values, want.values * [1, 1, unit], rtol=1e-5)
        np.testing.assert_allclose(found.errors, want.errors * [1, 1, unit], rtol=1e-4)


def test_other_laws():
    found = fit("viscous", rod_drag(PSI, *exact(Viscous(1.7))), ROD)
    assert (
        found.names == ("ratio", "axial_stress") and found.k is None
    )  # no weight of grains in a fluid
    np.testing.assert_allclose(found.values, [1.7, 3.7 / (2 * 0.007 * 0.09)], rtol=1e-9)
    assert (
        found.medium.ratio == pytest.approx(1.7) and len(found.medium.covariance) == 1
    )
    found = fit("coulomb", rod_drag(PSI, *exact(Coulomb())), ROD)
    assert found.names == ("k",) and found.medium == Coulomb()
    np.testing.assert_allclose(found.values, [3.7 / UNIT], rtol=1e-9)


@pytest.mark.parametrize(
    ("rod", "name", "size"),
    [
        (Rod(), "axial_force", 3.7),
        (Rod(0.007, None, 0.04, 640.0), "axial_force", 3.7),
        (Rod(0.007, 0.09), "axial_stress", 3.7 / (2 * 0.007 * 0.09)),
        (Rod(0.007, 0.09, 0.04), "axial_stress", 3.7 / (2 * 0.007 * 0.09)),
    ],
)
def test_axial_drag_is_told_as_far_as_sizes_are_known(rod, name, size):
    found = fit("granular", rod_drag(PSI, *exact(Granular(1.8, 0.24))), rod)
    assert found.names[2] == name and found.k is None
    assert found.values[2] == pytest.approx(size)
    assert found.medium.k is None and found.medium.uncertain == ("C", "gamma0")


def by_hand(found: Fit, psi):
    """(2, N, 3): slopes of both forces in C, gamma0 and k, from Eq. 3 differentiated on paper."""
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
    np.testing.assert_allclose(
        np.einsum("n,knp,kn->p", drag.weight, slopes, found.residuals) / UNIT,
        0,
        atol=1e-6,
    )
    np.testing.assert_allclose(found.errors**2, np.diag(found.covariance))
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
    np.testing.assert_allclose(found.intervals.mean(1), found.values)
    np.testing.assert_allclose(
        found.medium.covariance, 1.0400**2 * found.covariance, rtol=1e-4
    )  # and 68 %


def test_intervals_of_few_forces_hold_as_often_as_they_say():
    """95 and 68 % of the noise, spread evenly over its distribution, with two degrees of freedom; twice the standard error
    and one of it would hold the true value in 82 and 58 %."""
    noise = 0.02 * norm.ppf(qmc.Sobol(4, seed=1).random_base2(6)).reshape(-1, 2, 2)
    held, near = [], []
    for some in noise:
        found = fit(
            "viscous",
            rod_drag(
                np.array([0.0, 90.0]), *(np.array([[3.0, 0.0], [0.0, 7.5]]) + some)
            ),
        )
        held.append(
            np.abs(found.values - [2.5, 3.0]) <= found.intervals[:, 1] - found.values
        )
        near.append(
            abs(found.values[0] - 2.5) <= math.sqrt(found.medium.covariance[0][0])
        )
    assert found.degrees_of_freedom == 2 and found.names == ("ratio", "axial_force")
    np.testing.assert_allclose(np.mean(held, 0), 0.95, atol=0.025)
    assert np.mean(near) == pytest.approx(0.68, abs=0.04)


def test_no_other_start_ends_lower():
    """Against the best of a fine scan of gamma0, in which C and the axial drag are linear least squares."""
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


def test_weights_and_repeats():
    drag = noisy(1)
    twice = dataclasses.replace(
        drag, psi=np.append(drag.psi, drag.psi[3]), forces=np.column_stack([drag.forces, drag.forces[:, 3]]),
        weight=np.ones(10),
    )  # fmt: skip
    double = dataclasses.replace(drag, weight=np.where(np.arange(9) == 3, 2.0, 1.0))
    np.testing.assert_allclose(
        fit("granular", twice).values, fit("granular", double).values, rtol=1e-6
    )
    forces = drag.forces.copy()
    forces[:, 5] *= 40.0
    without = np.where(np.arange(9) == 5, 0.0, 1.0)
    struck = fit("granular", dataclasses.replace(drag, forces=forces, weight=without))
    np.testing.assert_allclose(
        struck.values, fit("granular", noisy_without(drag, 5)).values, rtol=1e-6
    )
    spread = np.array([[1.0, 3.0, 5.0, 5.0], [0.0, 2.0, 7.0, 7.0]])
    assert calibration.repeats(np.array([0.1, 0.1, 0.2, 0.3]), spread) == pytest.approx(
        math.sqrt((2 + 2) / 2)
    )
    assert calibration.repeats(np.array([0.1, 0.2]), np.ones((2, 2))) is None


def noisy_without(drag, row):
    keep = np.arange(drag.psi.size) != row
    return dataclasses.replace(
        drag,
        psi=drag.psi[keep],
        forces=drag.forces[:, keep],
        weight=np.ones(keep.sum()),
    )


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
    forces[1, 0] *= -1  # now neither
    with pytest.raises(
        ValueError,
        match="at psi = -75 degrees the force across the rod is .* and pushes",
    ):
        rod_drag(psi, *forces)


def test_end_caps():
    """Fitted, fixed or left out: the ends' forces as DESIGN of the effect has them, e = 1.6 for both together."""
    c, s, (C, g), e = np.cos(np.radians(PSI)), np.sin(np.radians(PSI)), (1.8, 0.24), 1.6
    weight = (
        e * math.pi * 0.007**2 / (2 * 0.007 * 0.09)
    )  # over the projected area of the side
    along = c + weight * C * np.sin(np.arctan(c / math.tan(g)))
    across = s + C * np.sin(np.arctan(s / math.tan(g))) + weight * s
    drag = rod_drag(PSI, 3.7 * along, 3.7 * across)
    found = fit("granular", drag, ROD, "fitted")
    assert found.names == (
        "C",
        "gamma0",
        "k",
        "end_caps",
    ) and found.end_caps == pytest.approx(e)
    np.testing.assert_allclose(found.values, [C, g, 3.7 / UNIT, e], rtol=1e-5)
    assert len(found.medium.covariance) == 3
    np.testing.assert_allclose(
        fit("granular", drag, ROD, e).values, [C, g, 3.7 / UNIT], rtol=1e-6
    )
    assert fit("granular", drag, ROD).rms > 0.01
    with pytest.raises(ValueError, match="leave the end caps out"):
        fit("granular", rod_drag(PSI, *exact(Granular(C, g))), ROD, "fitted")
    for law, rod, caps, said in (
        ("viscous", ROD, 1.0, "take the granular law"), ("granular", Rod(0.01), "fitted", "radius and length"),
        ("granular", Rod(0.1, 0.05), 1.0, "longer than its radius"), ("granular", ROD, -1.0, "from 0 to 10"),
        ("granular", ROD, math.nan, "from 0 to 10"), ("granular", ROD, "x", "fitted"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=said):
            fit(law, drag, rod, caps)


@pytest.mark.parametrize(
    ("law", "medium", "psi", "said"),
    [
        ("granular", Coulomb(), PSI, "edge of C, 0"),
        ("granular", Viscous(3.0), PSI, "edge of|apart|settle"),
        (
            "granular",
            Granular(1.8, 0.24),
            np.array([0.0, 90.0]),
            "do not tell C, gamma0|edge of",
        ),
        (
            "granular",
            Granular(1.8, 0.24),
            np.array([30.0]),
            "2 forces are too few for C, gamma0",
        ),
        ("viscous", Granular(1.8, 0.24), np.array([90.0]), "few|apart|edge"),
    ],
)
def test_what_data_do_not_settle_is_refused(law, medium, psi, said):
    with pytest.raises(ValueError, match=said):
        fit(law, rod_drag(psi, *exact(medium, psi=psi)))


GOOD = "psi_deg,F_parallel_N,F_perpendicular_N\n" + "".join(
    f"{p:g},{t:.4f},{n:.4f}\n" for p, t, n in zip(PSI, *exact(Granular(1.8, 0.24)))
)
SWAPPED = GOOD.replace(
    "F_parallel_N,F_perpendicular_N", "F_perpendicular_N,F_parallel_N"
)
BAD = {
    "missing column": (GOOD.replace("F_perpendicular_N", "lift_N"), "line 1: the header has no column F_perpendicular_N"),
    "missing header": (GOOD.split("\n", 1)[1], "line 1: it has no header: its first line has 3 numbers"),
    "twice": (GOOD.replace("psi_deg", "F_parallel_N").replace("F_parallel_N", "psi_deg"), "2 columns psi_deg"),
    "swapped": (SWAPPED, "the columns are exchanged"),
    "from the normal": ("\n".join([GOOD.split("\n")[0], *(f"{90 - p:g},{t:.4f},{n:.4f}" for p, t, n in zip(
        PSI, *exact(Granular(1.8, 0.24))))]), "psi is measured from the rod's normal"),
    "nan": (GOOD.replace("\n30,", "\nnan,"), "line 6: a row must be 3 finite numbers"),
    "inf": (GOOD + "30,inf,1\n", "line 11: a row must be 3 finite numbers"),
    "empty cell": (GOOD + "30,,1\n", "line 11"),
    "words": (GOOD + "thirty,1,1\n", "line 11"),
    "short row": (GOOD.replace("75,", "75;"), "line 9: a row must be 3"),
    "too wide": (GOOD + "30,1,1,1\n", "line 11"),
    "radians": ("\n".join([GOOD.split("\n")[0], *(f"{math.radians(p)},{t},{n}" for p, t, n in zip(
        PSI, *exact(Granular(1.8, 0.24))))]), "angles look like radians"),
    "far": (GOOD + "500,1,1\n", "line 11: psi_deg must be from -360 to 360, got 500"),
    "pushes": (GOOD + "45,-2,1\n", "at psi = 45 degrees the force along the rod is -2 N and pushes"),
    "all pushes": (GOOD.replace(",", ",-").replace(",-F", ",F"), "no force is positive"),
    "zeros": ("psi_deg,F_parallel_N,F_perpendicular_N\n0,0,0\n90,0,0\n", "all forces are zero"),
    "no rows": (GOOD.split("\n")[0], "1 to 100000 rows of drag, got 0"),
    "empty": ("", "line 1: the header has no column"),
    "bytes": (b"\x89\xfe\x00\x80", "it is not text"),
    "netcdf": (b"CDF\x01\x00\x00\x00", "it is not text"),
    "two depths": ("# depth 3 cm, depth 5 cm\n" + GOOD, "the header lines give depth = 0.03 and 0.05"),
    "no size": ("# radius 0 mm\n" + GOOD, "the rod's radius must be a number from 1e-09"),
    "weights": (GOOD.replace("\n", ",-1\n").replace("_N,-1", "_N,weight"), "weights must be 0 or more"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_files_get_one_line(name, tmp_path):
    text, said = BAD[name]
    file, out = tmp_path / "drag.csv", tmp_path / "m.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    code, printed_out, err = geomech(
        "fit-medium", file, "-o", out, "--plot", tmp_path / "m.png"
    )
    assert (code, printed_out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("error: ") and said in err and "drag.csv" in err
    assert [p.name for p in tmp_path.iterdir()] == ["drag.csv"]


def test_files_that_cannot_be_read(tmp_path, monkeypatch):
    huge = tmp_path / "huge.csv"
    with huge.open("wb") as file:
        file.truncate(drag.LARGEST_FILE + 1)
    for path, said in (
        (huge, "larger than 10 MB"),
        (tmp_path, "no ordinary file"),
        (tmp_path / "x.csv", "No such file"),
    ):
        code, _, err = geomech("fit-medium", path)
        assert code == 2 and said in err and err.count("\n") == 1
    code, _, err = geomech("fit-medium", "short-rod-dragg")
    assert code == 2 and "did you mean 'short-rod-drag'" in err


def test_other_spellings_of_a_good_file(tmp_path):
    plain = tmp_path / "plain.csv"
    plain.write_text(GOOD)
    want = former.medium(geomech("fit-medium", plain, "--json")[1])
    assert (want["C"], want["gamma0_deg"]) == pytest.approx(
        (1.8, math.degrees(0.24)), rel=1e-3
    )
    assert (
        want["k"] is None
        and want["axial_stress_Pa"] is None
        and want["axial_force_N"] == pytest.approx(3.7, rel=1e-3)
    )
    rows = [line.split(",") for line in GOOD.split()]
    order = "\r\n".join(",".join([n, "?", p, t]) for p, t, n in rows).replace(
        "?", "note", 1
    )
    for text in (
        "\ufeff" + GOOD,
        GOOD.replace("\n", "\r\n"),
        order,
        GOOD.upper(),
        "# a\n\n" + GOOD.replace(",", " , "),
    ):
        file = tmp_path / "other.csv"
        file.write_bytes(text.encode())
        found = former.medium(geomech("fit-medium", file, "--json")[1])
        assert (found["C"], found["rms"]) == (want["C"], want["rms"])


def test_weights_of_a_file(tmp_path):
    """A row that weighs nothing is as good as none, however wrong it is."""
    file, found = tmp_path / "drag.csv", []
    rows = GOOD.split()
    for extra in (["45,9.0,0.5,0"], []):
        file.write_text(
            "\n".join([rows[0] + ",weight", *(f"{row},2" for row in rows[1:]), *extra])
        )
        found.append(former.medium(geomech("fit-medium", file, "--json")[1]))
    for key in ("C", "covariance", "axial_force_N", "rms"):
        np.testing.assert_allclose(found[0][key], found[1][key], rtol=1e-5, atol=1e-15)
    assert (
        len(found[0]["residuals"]["psi_deg"])
        == len(found[1]["residuals"]["psi_deg"]) + 1
    )


@pytest.mark.parametrize(
    ("lines", "sizes"),
    [
        (["radius = 8 mm, length = 80 mm, depth = 30 mm, density = 605 kg/m^3"], (0.008, 0.08, 0.03, 605)),
        (["radius_mm: 8", "length_m = .08", "depth cm: 3", "bulk density 0.605 g/cm3, packing 0.6"], (0.008, 0.08, 0.03, 605)),
        (["radius: 0.008", "length = 0.08", "depth: 0.03", "density 1,605"], (0.008, 0.08, 0.03, 1605)),
        (
            ["Rod radius 8 mm and length 80 mm at a depth of 3 cm in beads of diameter 0.3 mm, density 2500 kg/m3, volume "
             "fraction 58 %"], (0.008, 0.08, 0.03, 1450),
        ),
        (["grain diameter 0.3 mm", "rod diameter 16 mm, 8 cm long, 30 mm deep"], (0.008, 0.08, 0.03, None)),
        (["16 mm diameter rod, 80 mm long, in 6 mm beads at 30 mm depth"], (0.008, 0.08, 0.03, None)),
        (["rod 16 mm diameter x 80 mm; bed 20 cm deep; density of the rod 2700 kg/m^3"], (0.008, 0.08, None, None)),
        (["effective radius 8 mm", "density 2500 kg/m^3, packing density 0.6, void fraction 0.4"], (0.008, None, None, 1500)),
        (["radius 8000 um, length 8 cm"], (0.008, 0.08, None, None)),
        (["nothing", "mean after 30 mm of travel, 0.1 m/s"], (None, None, None, None)),
    ],
)  # fmt: skip
def test_sizes_of_header_lines(lines, sizes):
    found = drag.sizes(Rows("f", "", 1, (), [], lines))
    names = ("radius", "length", "depth", "density")
    assert found == pytest.approx(
        {name: x for name, x in zip(names, sizes) if x is not None}
    )


def test_options_overrule_the_header():
    found = former.medium(
        geomech(
            "fit-medium",
            "short-rod-drag",
            "--json",
            "--depth",
            "0.06",
            "--density",
            "600",
        )[1]
    )
    assert found["rod"] == {
        "radius": 0.008,
        "length": 0.08,
        "depth": 0.06,
        "density": 600.0,
    }
    base = former.medium(geomech("fit-medium", "short-rod-drag", "--json")[1])
    assert found["k"] * 0.06 * 600 == pytest.approx(base["k"] * 0.03 * 0.588 * 1030)
    text = geomech("fit-medium", "short-rod-drag", "--law", "viscous")[1]
    assert (
        "ratio" in text
        and "psi (degrees)  along (N)" in text
        and "k is not known" not in text
    )
    assert geomech("fit-medium", "short-rod-drag", "--depth", "-1")[0] == 2
    code, _, err = geomech("fit-medium", "short-rod-drag", "--density", "0.6")
    assert (
        code == 2 and "short_rod_drag.csv: k must be a number from 0.001 to 1000" in err
    )
    assert (
        "neither left-out, fitted nor a number"
        in geomech("fit-medium", "short-rod-drag", "--end-caps", "flat")[2]
    )


def test_the_medium_written_is_the_one_fitted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for law, kind in (
        ("granular", Granular),
        ("viscous", Viscous),
        ("coulomb", Coulomb),
    ):
        assert (
            geomech("fit-medium", "short-rod-drag", "-o", "M.toml", "--law", law)[0]
            == 0
        )
        read = scene.parse(
            '[medium]\nfile = "M.toml"\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n',
            str(tmp_path / "s.toml"),
        ).system.medium
        want = calibration.rod_fit("short-rod-drag", law).medium
        assert type(read) is kind
        for field in dataclasses.fields(kind):
            np.testing.assert_allclose(
                *(getattr(m, field.name) for m in (read, want)), rtol=1e-15
            )


def test_outputs_never_replace_the_data(tmp_path):
    file = tmp_path / "drag.csv"
    file.write_text(GOOD)
    for option in ("-o", "--plot"):
        name = file if option == "-o" else tmp_path / "link.png"
        if option == "--plot":
            name.hardlink_to(file)
        code, _, err = geomech("fit-medium", file, option, name)
        assert code == 2 and "it is an input" in err
    assert file.read_text() == GOOD
    code, _, err = geomech(
        "fit-medium", file, "-o", tmp_path / "x.png", "--plot", tmp_path / "x.png"
    )
    assert code == 2 and "cannot write" in err and not (tmp_path / "x.png").exists()


def test_the_picture_shows_data_law_band_and_residuals():
    from geomech import plots

    result = calibration.answer("short-rod-drag")
    psi, force, residual, law = (
        result[name].values for name in ("psi", "force", "residual", "law_curve")
    )
    top, bottom = plots.drag_figure(result).axes
    across, data_across, along, data_along = top.lines[:4]
    np.testing.assert_allclose(across.get_ydata(), law[1])
    np.testing.assert_allclose(along.get_ydata(), law[0])
    np.testing.assert_allclose(data_across.get_xydata().T, [psi, force[1]])
    np.testing.assert_allclose(data_along.get_xydata().T, [psi, force[0]])
    edges = top.collections[0].get_paths()[0].vertices
    assert edges[:, 1].max() == pytest.approx(
        (law[1] + result["law_curve"].error[1]).max()
    )
    np.testing.assert_allclose(bottom.lines[0].get_ydata(), residual[1])
    np.testing.assert_allclose(force[0][0] - law[0][0], residual[0][0], rtol=1e-9)
    assert top.get_ylabel() == "drag (N)" and "degrees" in bottom.get_xlabel()


def test_a_fit_shows_itself_in_a_line_and_one_angle_settles_nothing():
    told = repr(fit("granular", noisy(size=0.01)))
    assert (
        told.startswith("Fit(granular, 95 %: C 1.781 (1.751 to 1.811)")
        and "gamma0 0.24" in told
        and len(told) < 150
        and "\n" not in told
    )
    with pytest.raises(ValueError, match="^(?!.*radians)"):
        fit("granular", rod_drag([0.0], [0.47], [0.0]))


def test_what_repeats_scatter_by_is_told_with_the_freedom_that_their_means_leave():
    """Of three angles, one of them once and one thrice: three of six rows are free, in two components."""
    psi, off = (
        np.array([0.2, 0.5, 0.2, 0.9, 0.5, 0.5]),
        np.array([[1.0, 3.0, -1.0, 0.0, 0.0, -3.0], [-2.0, 1.0, 2.0, 0.0, -2.0, 1.0]]),
    )
    forces = np.array([[5.0], [7.0]]) + psi * [[2.0], [-3.0]] + off
    assert calibration.repeats(psi, forces) == pytest.approx(np.sqrt((20.0 + 14.0) / 6))
    assert calibration.repeats(psi[[0, 1, 3]], forces[:, [0, 1, 3]]) is None
    assert calibration.repeats(psi + 1e-11 * np.arange(6), forces) == pytest.approx(
        calibration.repeats(psi, forces)
    )
