"""Three joints and more: planes on which two of them move, the CCF as a two-form, and
the area tier by surfaces that span a loop."""

import dataclasses

import numpy as np
import pytest
from commands import geomech
from registry import DATA
from tabled import tabled

from geomech import Numerics, Scene
from geomech.io.results import to_xarray
from geomech.mathematics.gaits import Fourier, Wave
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations.plane import (
    interpolated_plane,
    plane,
)
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.tiers.fitted import finest_grid, is_too_large
from geomech.questions.swimmers.run import Run
from geomech.studies.maps import fields
from geomech.studies.maps.shape_space import plane_origin
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE, Chain, Viscous
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
FOUR_LINKS = Chain((0.7, 1.4, 0.9, 0.6))
LOOP = Fourier(
    cos=((0.5, 0.0), (0.1, 0.1), (-0.3, 0.1)),
    sin=((0.1, 0.1), (0.6, 0.0), (0.2, -0.2)),
    centre=(0.1, -0.2, 0.15),
)
COARSE = Numerics(grid=7, extent=1.2)
PAIRS = ((0, 1), (0, 2), (1, 2))


@dataclasses.dataclass(frozen=True)
class Cubic:
    """A of three joints in closed form. turns (-): scales its row of headings."""

    turns: float = 1.0
    kind = "cubic"
    joints = 3
    traits = Traits(linear=True)
    length = 0.5

    def A(self, alpha):
        a, b, c = np.moveaxis(np.asarray(alpha, float), -1, 0)
        rows = [
            [b * c, 0.3 * a**2, 0.4 * b],
            [0.2 * c, 0.1 * a, a * b],
            [0.7 * b, a * c, 0.5 * b**2],
        ]
        A = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
        return A * [[1], [1], [self.turns]]

    def velocity(self, alpha, alphadot):
        return np.einsum("...ij,...j->...i", self.A(alpha), alphadot)

    def ccf(self, alpha, i, j):
        """By hand."""
        a, b, c = np.moveaxis(np.asarray(alpha, float), -1, 0)
        dA = {
            (0, 1): [0.6 * a - c, 0.1 + 0 * a, self.turns * (c - 0.7)],
            (0, 2): [-b, b - 0.2, 0 * a],
            (1, 2): [0.4 + 0 * a, a, self.turns * (b - a)],
        }[i, j]
        A = self.A(alpha)
        x = A[..., i]
        y = A[..., j]
        bracket = [
            y[..., 2] * x[..., 1] - x[..., 2] * y[..., 1],
            x[..., 2] * y[..., 0] - y[..., 2] * x[..., 0],
            0 * a,
        ]
        return np.moveaxis(np.array(dA) + np.array(bracket), 0, -1)


def of_cubic(turns=1.0, **numerics):
    return SceneTables(Scene(Cubic(turns), LOOP, COARSE)).with_numerics(**numerics)


# Planes.


@pytest.mark.parametrize("pair", [*PAIRS, (2, 0)])
def test_planes_have_the_curvature_of_the_pair(pair):
    at = [0.3, -0.2, 0.4]
    study = of_cubic()
    numbers = [k + 1 for k in pair]
    cut = study.plane(numbers, at)
    shapes = np.broadcast_to(at, (7, 7, 3)).copy()
    shapes[..., pair] = np.stack(np.meshgrid(*cut.ccf.axes, indexing="ij"), -1)
    sign = 1 if pair[0] < pair[1] else -1
    right = np.moveaxis(sign * Cubic().ccf(shapes, *sorted(pair)), -1, 0)
    np.testing.assert_allclose(cut.ccf.values, right, atol=1e-12)
    sliced = study.two_form.slice(*numbers, at).values
    np.testing.assert_allclose(sliced, right, atol=1e-12)
    looked_up = interpolated_plane(study.fitted, numbers, at).connection.A
    np.testing.assert_allclose(looked_up, cut.connection.A, atol=1e-12)


@pytest.mark.parametrize("at", [[0.6, 0.6, -1.2], [0.0, 0.0, 0.0]])
def test_a_plane_is_that_of_the_whole_field_in_sand(at):
    system = Swimmer(GLASS, FOUR_LINKS)
    axes = connection.grid(3, 5, 1.2)
    options = {"traits": system.traits, "trusted": True}
    fitted = connection.fit(system.velocity, axes, 16, **options)
    given = system.velocity, (axes[0], axes[2]), (1, 3), at, 16
    cut = plane(*given, traits=Traits(mirror=True))
    k = np.abs(axes[1] - at[1]).argmin()
    A = fitted.A[:, [0, 2]][..., k, :]
    np.testing.assert_allclose(cut.connection.A, A, atol=1e-9)
    residual = fitted.residual[..., k, :]
    np.testing.assert_allclose(cut.connection.residual, residual, atol=1e-9)
    looked_up = interpolated_plane(fitted, (1, 3), at).connection
    for name in ("A", "residual", "speed"):
        found, same = getattr(looked_up, name), getattr(cut.connection, name)
        np.testing.assert_allclose(found, same, atol=1e-9, err_msg=name)


def test_many_joints_have_planes_and_no_field():
    swimmer = Swimmer(Viscous(2.0), Chain((1,) * 9))
    numerics = Numerics(grid=5, extent=1.0)
    study = SceneTables(Scene(swimmer, Wave(amplitude=0.5, joints=8), numerics))
    assert study.plane((7, 3)).ccf.values.shape == (3, 5, 5)
    with pytest.raises(ValueError, match="lies outside the field"):
        study.plane((1, 2), np.full(8, 1.1))


@pytest.mark.parametrize(
    ("pair", "at", "held"),
    [
        ((4, 2), [0.3, -0.1], [0.3, 0.7, -0.1, 0.7]),
        ((4, 2), [0.3], [0.3, 0.7, 0.3, 0.7]),
        ((4, 2), [0.3, 0.1, 0.2, 0.4], [0.3, 0.1, 0.2, 0.4]),
        ((1, 3), None, [0.7] * 4),
    ],
)
def test_slices_hold_joints_in_their_order(pair, at, held):
    scene = Scene(Sandy(), Wave(joints=4, offset=0.7))
    assert plane_origin(scene, pair, at, True).tolist() == held


# Surfaces.


def test_the_area_of_three_joints_is_the_line_integral_where_nothing_turns():
    """Of A, by Stokes, on every surface."""
    sizes = [0.4, 1.0]
    found = tabled(of_cubic(turns=0.0).displacements(sizes, ["area"]))
    along = Cubic(turns=0.0).velocity(*LOOP.cycle(64, sizes)).mean(1) * 2 * np.pi
    np.testing.assert_allclose(found["area"], along, atol=1e-12)
    assert np.max(found["surface_spread"]["area"]) < 1e-12


def test_positions_depend_on_the_surface_by_order_three_and_turning_does_not():
    study = of_cubic()
    found = tabled(study.displacements([0.05, 0.1, 0.8], ["area", "direct"]))
    spread = np.array(found["surface_spread"]["area"])
    estimates = np.array(found["estimate"]["area"])
    off = np.array(found["area"]) - found["direct"]
    assert (estimates >= spread).all()
    np.testing.assert_allclose(estimates, np.hypot(*off[:, :2].T), rtol=1e-6)
    np.testing.assert_allclose(off[:, 2], 0.0, atol=1e-12)
    assert np.log2(estimates[1] / estimates[0]) == pytest.approx(3.0, abs=0.15)


def over_cone(tip):
    """Return the pose by the CCF summed over the cone from a tip to LOOP."""
    alpha, alphadot = LOOP.cycle(256, 0.8)
    total = np.zeros(3)
    for s in (np.arange(40) + 0.5) / 40:
        u = alpha - tip
        v = s * alphadot
        for i, j in PAIRS:
            area = u[:, i] * v[:, j] - u[:, j] * v[:, i]
            total += (Cubic().ccf(tip + s * u, i, j) * area[:, None]).mean(0)
    return se2.exp(2 * np.pi * total / 40)


def test_the_spread_is_that_of_another_surface():
    """Of cones over shapes of the loop, by brute force."""
    study = of_cubic(phases=256)
    alpha = LOOP.cycle(256, 0.8)[0]
    middle = over_cone(alpha.mean(0))
    others = [over_cone(alpha[k]) - middle for k in (0, 64, 128, 192)]
    apart = max(np.hypot(*x[:2]) for x in others)
    spread = study.spread("area", amplitudes=[0.8])
    assert spread[0, 0] == pytest.approx(apart, rel=0.02)
    poses = study.poses("area", amplitudes=[0.8])
    np.testing.assert_allclose(poses[0], middle, atol=3e-4)


# Beyond a field.


@dataclasses.dataclass(frozen=True)
class Sandy:
    """Of four joints, not linear in alphadot."""

    kind = "sandy"
    joints = 4

    def velocity(self, alpha, alphadot):
        a, u = np.broadcast_arrays(alpha, alphadot)
        linear = np.stack(
            [
                np.cos(a[..., 1]) * u[..., 0] + 0.3 * u[..., 3],
                np.sin(a[..., 0]) * u[..., 2],
                a[..., 3] * u[..., 1],
            ],
            -1,
        )
        speed2 = (u**2).sum(-1, keepdims=True) + 1e-300
        return linear + 0.4 * (u**3 * np.cos(a))[..., :3] / speed2


def test_beyond_the_field_tiers_solve_around_the_gait():
    """As from a fine field: a grid of 15^4 is too large for one."""
    gait = Fourier(
        cos=((0.5, 0.1), (0.1, 0.2), (-0.3, 0.1), (0.2, 0.0)),
        sin=((0.1, 0.2), (0.6, 0.0), (0.2, 0.1), (-0.4, 0.0)),
        centre=(0.1, 0.2, 0.0, -0.1),
    )
    numerics = Numerics(grid=10, extent=1.0, interpolation=5, directions=64)
    asked = ([0.5, 0.9], ["area", "path"])
    study = SceneTables(Scene(Sandy(), gait, numerics))
    beyond = study.with_numerics(grid=15)
    found, around = (tabled(x.displacements(*asked)) for x in (study, beyond))
    assert "field" not in around["seconds"]
    for tier in ("area", "path"):
        np.testing.assert_allclose(around[tier], found[tier], atol=3e-5)


@pytest.mark.parametrize(
    ("system", "grid", "is_large"),
    [(Cubic(), 61, False), (Sandy(), 13, False), (Sandy(), 15, True)],
)
def test_three_joints_keep_their_field_and_more_have_one_that_fits(
    system, grid, is_large
):
    assert is_too_large(system, Numerics(grid=grid)) == is_large
    assert (finest_grid(4), finest_grid(5)) == (13, 7)


# Files and commands.


def test_a_file_of_three_joints_has_all_pairs():
    numerics = Numerics(grid=7, extent=1.2)
    study = SceneTables(Scene(Swimmer(Viscous(2.3), FOUR_LINKS), LOOP, numerics))
    data = to_xarray(fields.full_result(study))
    assert data["pair_joints"].values.tolist() == [[1, 2], [1, 3], [2, 3]]
    second = study.two_form.pair(1, 3).values
    np.testing.assert_array_equal(data["ccf_pairs"][1], second)


def test_pictures_tell_the_angle_of_a_slice(tmp_path):
    scene = DATA / "frozen" / "four.toml"
    options = ("--pair", "3,1", "--slice", "20deg", "--plot", "a.svg")
    code, _, err = geomech("ccf", str(scene), *options, cwd=tmp_path)
    assert (code, err) == (0, "")
    assert "0.349 rad" in (tmp_path / "a.svg").read_text()


def test_a_run_of_three_joints_has_its_field_and_tiers():
    scene = Scene(Swimmer(Viscous(2.3), FOUR_LINKS), LOOP, Numerics(grid=5, extent=1.2))
    assert {"area", "path", "direct"} <= {*Run(scene).ask()["tier"].values}
