"""Odd harmonics of the velocity on the sphere of directions, of three joint rates and more."""

import numpy as np
import pytest
from commands import geomech
from tabled import tabled, tabled_json

from geomech.mathematics.gaits import Fourier
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.tiers import harmonic
from geomech.scenes import Numerics, Scene
from geomech.studies.available import default_tiers
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE, Chain

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium


def cubic(alpha, alphadot):
    """Odd and of degree one in alphadot, a polynomial of degree 3 on the sphere; no two joints are alike."""
    a, u = np.broadcast_arrays(alpha, alphadot)
    square = (u**2).sum(-1)
    rows = [
        a[..., 0] * u[..., 0] + 0.3 * u[..., 0] ** 2 * u[..., 2] / square,
        u[..., 1] * a[..., 2] + 0.7 * u[..., 0] * u[..., 1] * u[..., -1] / square,
        0.2 * u[..., -1]
        + 0.5 * a[..., 1] * u[..., 1] ** 3 / square
        - 0.4 * u[..., -1] ** 2 * u[..., 1] / square,
    ]
    return np.stack(rows, -1)


@pytest.mark.parametrize(("joints", "highest"), [(3, 3), (3, 7), (4, 3), (5, 3)])
def test_polynomials_on_the_sphere_come_back(joints, highest):
    count = 2 * harmonics.terms(joints, highest)
    table = harmonics.fit(
        cubic, connection.grid(joints, 4, 1.0), count, 1, highest=highest
    )
    assert table.highest == highest and table.coefficients.shape[1] == count // 2
    rng = np.random.default_rng(0)
    alpha, u = rng.uniform(-1, 1, (20, joints)), 3.0 * rng.normal(size=(20, joints))
    np.testing.assert_allclose(table.velocity(alpha, u), cubic(alpha, u), atol=1e-10)
    np.testing.assert_allclose(
        table.velocity(alpha, -2.0 * u), -2.0 * cubic(alpha, u), atol=1e-10
    )
    assert table.residual.max() < 1e-10 and not table.velocity(alpha, 0 * u).any()
    np.testing.assert_allclose(
        table.half(0).velocity(alpha, u)[..., 0], cubic(alpha, u)[..., 0], atol=1e-10
    )


def test_the_first_degree_is_the_connection():
    system, axes = (
        Swimmer(GLASS, Chain((0.7, 1.4, 0.9, 0.6))),
        connection.grid(3, 4, 1.0),
    )
    fitted, table = (
        connection.fit(system.velocity, axes, 24, traits=system.traits),
        harmonics.fit(system.velocity, axes, 24, highest=1, traits=Traits(mirror=True)),
    )
    alpha, u = np.random.default_rng(1).uniform(-1, 1, (2, 9, 3))
    np.testing.assert_allclose(
        table.velocity(alpha, u), fitted.velocity(alpha, u), atol=1e-12
    )


def test_what_they_leave_is_that_of_other_directions_and_falls():
    system, axes, rng = (
        Swimmer(GLASS, Chain((0.7, 1.4, 0.9, 0.6))),
        connection.grid(3, 4, 1.0),
        np.random.default_rng(2),
    )
    alpha = np.stack([axes[0][rng.integers(0, 4, 400)] for _ in range(3)], -1)
    u = rng.normal(size=(400, 3))
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    truth, left = system.velocity(alpha, u), []
    for highest in (1, 5, 9):
        count = 2 * harmonics.terms(3, highest) if highest > 1 else 24
        table = harmonics.fit(system.velocity, axes, count, highest=highest)
        left.append(np.sqrt(((table.velocity(alpha, u) - truth) ** 2).mean(0)))
        np.testing.assert_allclose(
            np.sqrt((table.residual**2).mean((1, 2, 3))), left[-1], rtol=0.35
        )
    assert (left[1] < 0.6 * left[0]).all() and (left[2] < 0.25 * left[0]).all()


def test_three_joints_in_sand_within_a_few_percent():
    """Where the connection alone is out by half."""
    chain = Swimmer(GLASS, Chain((0.7, 1.4, 0.9, 0.6)))
    gait = Fourier(
        cos=((1.0, 0.0), (0.2, 0.3), (-0.5, 0.2)),
        sin=((0.1, 0.2), (0.9, 0.0), (0.4, -0.4)),
    )
    study = SceneTables(Scene(chain, gait, Numerics(grid=6, extent=0.6, phases=64)))
    assert (
        "harmonic" not in default_tiers(chain)
        and harmonic.directions(chain, study.scene.numerics) == 110
    )
    table = tabled(study.displacements([0.4], ["harmonic", "path", "direct"]))
    off = {
        m: np.hypot(*(np.array(table[m]) - table["direct"])[0, :2])
        for m in ("harmonic", "path")
    }
    size = table["net_distance"]["direct"][0]
    assert off["harmonic"] < 0.05 * size and off["path"] > 0.4 * size


def test_too_many_are_refused(tmp_path):
    with pytest.raises(
        ValueError,
        match="harmonics of 3 joints up to 5 take 21 directions or more, got 20",
    ):
        harmonics.fit(cubic, connection.grid(3, 4), 20, highest=5)
    chain = '[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\nlengths = [1, 1, 1, 1, 1{}]\n'
    for more, joints, said in (
        (
            "",
            4,
            "harmonics of 4 joint rates need a field, and one of 31^4 shapes is too large: lower [numerics] grid, to 13",
        ),
        (
            ", 1, 1",
            6,
            "the harmonic tier takes two to five joints, and of more there are too many harmonics, this body has 6",
        ),
    ):
        (tmp_path / "s.toml").write_text(
            chain.format(more) + f'[gait]\nkind = "wave"\njoints = {joints}\n'
        )
        code, _, err = geomech(
            "displacement",
            "s.toml",
            "--amplitudes",
            "1",
            "--tiers",
            "harmonic",
            cwd=tmp_path,
        )
        assert code == 2 and said in err and len(err.splitlines()) == 1
    told = geomech("explain", "s.toml", cwd=tmp_path)[1]
    assert (
        "tiers: adapted, direct; by name: area, path\n" in told
        and "harmonic tier" in told
    )
    assert tabled_json(
        geomech("displacement", "s.toml", "--amplitudes", "1", "--json", cwd=tmp_path)[
            1
        ]
    )["direct"]
