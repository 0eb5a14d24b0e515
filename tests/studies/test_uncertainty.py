"""What an uncertain medium does to a displacement, against many media drawn from its covariance."""

import dataclasses
import json

import numpy as np
import pytest
from commands import geomech
from tabled import swept_table, tabled

from geomech import plots, scenes
from geomech.io.results import from_dict
from geomech.mathematics.gaits import Butterfly, Ellipse
from geomech.mathematics.systems import Swimmer, capability
from geomech.mathematics.systems.capabilities import Uncertain
from geomech.plots.displacement import sweeps
from geomech.scenes import Scene
from geomech.studies.displacement import sweep
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.displacement.variables import QUANTITIES, pose_quantities
from geomech.studies.estimates import uncertainty
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Granular, SkinFriction, Transient, Viscous
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GAIT = Ellipse(
    semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2)
)  # moves along, sideways and turns
BODY = Chain((1, 1.4, 0.8), length=0.3, frame="link-1")
COVARIANCE = ((0.012, -0.0012), (-0.0012, 0.0004))  # correlated


def scene(medium, **changes):
    return Scene(Swimmer(medium, BODY), GAIT, name="sand", **changes)


def granular(scale=1.0):
    return Granular(1.49, 0.22, covariance=scale**2 * np.array(COVARIANCE))


def drawn(sand, draws, amplitudes, phases=16):
    """QUANTITIES (draws, B, 4) in media of a scene with parameters off by the rows of ``draws``."""
    systems = [capability(sand.system, Uncertain).varied(d) for d in draws]
    nets = [s.run(*sand.gait.cycle(phases, np.array(amplitudes))).net for s in systems]
    return np.stack([np.stack(list(pose_quantities(n).values()), -1) for n in nets])


def whitened(count, size, seed):
    """Normal draws (count, size) whose own mean and covariance are exactly 0 and 1, so that few are many."""
    z = np.random.default_rng(seed).normal(size=(count, size))
    z -= z.mean(0)
    return (
        z
        @ np.linalg.inv(
            np.linalg.cholesky(np.cov(z.T, bias=True).reshape(size, size))
        ).T
    )


def test_media_drawn_from_the_covariance_scatter_as_told(monkeypatch):
    monkeypatch.setattr(uncertainty, "PHASES", 16)
    sand, amplitudes = scene(granular()), [0.7, 1.2]
    told = uncertainty.medium_spread(sand, GAIT, np.array(amplitudes))
    media = whitened(100, 2, seed=1) @ uncertainty.covariance_root(COVARIANCE).T
    nets = drawn(sand, np.concatenate([media, -media]), amplitudes)
    scatter, shift = (
        nets.std(0),
        nets.mean(0) - drawn(sand, [[0.0, 0.0]], amplitudes)[0],
    )
    assert told["rule"] == ["second order", "second order"]  # of the heading, 3 % of it
    for k, quantity in enumerate(QUANTITIES):
        np.testing.assert_allclose(told[quantity], scatter[:, k], rtol=0.03)
        np.testing.assert_allclose(
            told["shift"][quantity] / scatter[:, k],
            shift[:, k] / scatter[:, k],
            atol=0.03,
        )
    np.testing.assert_allclose(told["position"], np.hypot(told["x"], told["y"]))
    assert (scatter > 1e-4).all()  # of every quantity there is something to see


def test_in_a_frame_that_depends_on_the_medium_media_have_their_own(monkeypatch):
    monkeypatch.setattr(uncertainty, "PHASES", 16)
    sand, amplitudes = scene(granular()).with_numerics(grid=7), np.array([0.7, 1.2])
    in_frame = lambda system: (
        SceneTables(sand.changed(system=system)).in_frame("minimum-perturbation").scene
    )
    told = uncertainty.medium_spread(in_frame(sand.system), GAIT, amplitudes)
    media = whitened(12, 2, seed=2) @ uncertainty.covariance_root(COVARIANCE).T
    at = lambda d: (
        in_frame(Swimmer(Granular(1.49 + d[0], 0.22 + d[1]), BODY))
        .system.run(*GAIT.cycle(16, amplitudes))
        .net
    )
    nets = np.stack(
        [
            np.stack(list(pose_quantities(at(d)).values()), -1)
            for d in [[0.0, 0.0], *media, *-media]
        ]
    )
    for k, quantity in enumerate(QUANTITIES):
        scatter, shift = nets[1:, :, k].std(0), nets[1:, :, k].mean(0) - nets[0, :, k]
        np.testing.assert_allclose(told[quantity], scatter, rtol=0.03)
        np.testing.assert_allclose(
            told["shift"][quantity] / scatter, shift / scatter, atol=0.03
        )


def test_the_second_order_of_a_quadratic_is_exact(monkeypatch):
    """For a displacement quadratic in the parameters, y = a + b z + z C z / 2: variance |b|^2 + tr(C^2) / 2 over normal z."""
    bend, slope = np.array([[3.0, 1.0], [1.0, -2.0]]), np.array([0.4, -0.3])
    root = uncertainty.covariance_root(COVARIANCE)

    class Quadratic:
        length, covariance = 2.0, COVARIANCE

        def __init__(self, step=(0.0, 0.0)):
            self.step = np.array(step)

        varied = staticmethod(lambda step: Quadratic(step))

    def moved(system, gait, amplitudes):
        z = np.linalg.solve(root, system.step)
        return np.outer(amplitudes, [slope @ z, slope @ z + z @ bend @ z / 2, 0.0])

    monkeypatch.setattr(uncertainty, "_net_poses", moved)
    sand = type("Sand", (), {"system": Quadratic(), "name": "sand"})()
    told = uncertainty.medium_spread(sand, GAIT, np.array([1.0, 3.0]))
    assert told["rule"] == ["second order"] * 2
    np.testing.assert_allclose(told["x"], 0.5 * np.array([1, 3]))
    np.testing.assert_allclose(
        told["y"], np.sqrt(0.25 + np.trace(bend @ bend) / 2) * np.array([1, 3])
    )
    np.testing.assert_allclose(
        told["shift"]["y"], np.trace(bend) / 2 * np.array([1, 3])
    )
    np.testing.assert_allclose(told["shift"]["x"], 0.0, atol=1e-12)
    assert (told["heading"] == 0).all()
    bend *= 0.01
    told = uncertainty.medium_spread(sand, GAIT, np.array([1.0]))
    assert told["rule"] == ["linear"]
    np.testing.assert_allclose(told["y"], 0.5)


def test_a_wide_covariance_is_carried_on_to_second_order(monkeypatch):
    """Where the drag is almost the same in all directions, the turn of a viscous swimmer is far from linear in its ratio."""
    monkeypatch.setattr(uncertainty, "PHASES", 16)
    wide = scene(Viscous(1.15, ((0.3**2,),)))
    told = uncertainty.medium_spread(wide, GAIT, np.array([0.7]))
    near = uncertainty.medium_spread(
        scene(Viscous(1.15, ((0.03**2,),))), GAIT, np.array([0.7])
    )
    assert (told["rule"], near["rule"]) == (["second order"], ["linear"])
    scatter = drawn(wide, 0.3 * whitened(100, 1, seed=3), [0.7]).std(0)[0]
    linear = [10 * near[q][0] for q in ("x", "y", "heading")]
    np.testing.assert_allclose([told["x"][0], told["y"][0]], scatter[:2], rtol=0.02)
    assert linear[2] < 0.9 * told["heading"][0] < told["heading"][0] < scatter[2]


def test_wide_media_shift_the_mean_and_it_is_told(monkeypatch):
    """33 % on C and 25 % on gamma0, a strong butterfly: against media drawn from them, deviation and shift."""
    monkeypatch.setattr(uncertainty, "PHASES", 32)
    gait, spread = Butterfly(), np.array([0.33 * 1.8, 0.25 * 0.24])
    tables, errors = {}, {}
    for share in (1.0, 0.1):
        medium = Granular(1.8, 0.24, covariance=np.diag((share * spread) ** 2))
        sand = Scene(Swimmer(medium, Chain()), gait, name="sand").with_numerics(
            phases=64
        )
        told = uncertainty.medium_spread(sand, gait, np.array([1.2]))
        assert told["x"] == pytest.approx(told["net_distance"], rel=1e-3)
        media = np.concatenate([d := whitened(60, 2, seed=5), -d]) * share * spread
        media = media[(media + [1.8, 0.24] > [0.0, 0.001]).all(1)]
        nets = drawn(sand, media, [1.2], 32)[:, 0, 3]
        shift = nets.mean() - drawn(sand, [[0.0, 0.0]], [1.2], 32)[0, 0, 3]
        assert told["net_distance"][0] == pytest.approx(nets.std(), rel=0.06)
        assert told["shift"]["net_distance"][0] == pytest.approx(
            shift, abs=0.03 * nets.std()
        )
        tables[share] = SceneTables(sand).displacements([1.2], ["direct"])
        errors[share] = told["shift"]["net_distance"][0] / told["net_distance"][0]
    assert errors[1.0] < -0.3 and -uncertainty.SMALLEST_SHIFT < errors[0.1] < 0
    wide, narrow = (str(tables[share]) for share in (1.0, 0.1))
    size = abs(tables[1.0]["medium_shift"].values[3, 0])
    assert f"mean over the media: net distance shifted by up to {size:.1e}" in wide
    assert "mean over the media: net distance" not in narrow
    assert tables[1.0]["quantity"].values.tolist() == list(QUANTITIES)
    assert tables[1.0]["medium_shift"].unit == ("BL", "BL", "rad", "BL")


def test_media_that_end_before_the_points_are_carried_on_from_nearer_ones():
    """C = 1.49 +- 1: at sqrt(3) deviations there is no medium, at one there is."""
    sand = scene(Granular(1.49, 0.22, covariance=((1.0, 0.0), (0.0, 1e-6))))
    reach, near, both = uncertainty.sigma_points(sand)
    assert reach == 1.0 and sorted(
        round(s.medium.C, 9) for pair in near for s in pair
    ) == [0.49, 1.49, 1.49, 2.49]
    assert (
        len(both) == 1
        and uncertainty.sigma_points(scene(granular()))[0] == uncertainty.DEVIATIONS
    )
    assert np.isfinite(
        uncertainty.medium_spread(sand, GAIT, np.array([1.0]))["x"]
    ).all()


def test_roots():
    for matrix, rank in (
        (COVARIANCE, 2), (((4.0, 6.0), (6.0, 9.0)), 1), (((1e-12, 0.0), (0.0, 1e6)), 2), (((0.0, 0.0), (0.0, 2.0)), 1)
    ):  # fmt: skip
        root = uncertainty.covariance_root(matrix)
        np.testing.assert_allclose(root @ root.T, matrix, rtol=1e-12, atol=1e-30)
        assert root.shape == (2, rank)
    assert uncertainty.covariance_root(((0.0, 0.0), (0.0, 0.0))).shape == (2, 0)
    certain = uncertainty.medium_spread(
        scene(Granular(1.49, 0.22, covariance=np.zeros((2, 2)))), GAIT, np.array([1.0])
    )
    assert certain["position"] == [0.0] and certain["rule"] == ["linear"]


def test_every_tier_has_it_beside_its_own_error():
    sand = scene(granular()).with_numerics(grid=7, phases=64)
    table = tabled(SceneTables(sand).displacements([0.5, 1.0], ["area", "direct"]))
    told = uncertainty.medium_spread(sand, GAIT, np.array([0.5, 1.0]))
    for tier in ("area", "direct"):
        np.testing.assert_allclose(table["medium_error"][tier], told["position"])
        np.testing.assert_allclose(table["medium_error_heading"][tier], told["heading"])
    assert {q: table["medium_error_of"][q] for q in QUANTITIES} == {
        q: told[q].tolist() for q in QUANTITIES
    }
    plain = tabled(
        SceneTables(sand.changed(medium=Granular(1.49, 0.22))).displacements(
            [0.5, 1.0], ["area", "direct"]
        )
    )
    assert {k: plain[k] for k in ("area", "direct", "x")} == {
        k: table[k] for k in ("area", "direct", "x")
    }
    assert not [key for key in plain if key.startswith("medium")]
    answer = cheapest_displacements(sand, [0.5, 1.0], 1e-2)
    spread = np.hypot(answer["x"].spread, answer["y"].spread)
    np.testing.assert_allclose(spread[0], told["position"])
    shown = str(SceneTables(sand).displacements([0.5, 1.0], ["area", "direct"]))
    assert shown.count("+- medium") > 1
    assert "medium: one standard deviation by its covariance" in shown
    assert "mean over the media: " in shown


def test_effects_and_time_stepping_feel_it(monkeypatch):
    """By central differences of the whole cycle in the ratio, the one parameter of a viscous medium."""
    monkeypatch.setattr(uncertainty, "PHASES", 16)
    for effects in ((SkinFriction(0.1, 0.15),), (Transient(travel_m=0.03),)):
        sand = (
            scene(Viscous(2.5, ((0.04**2,),)))
            .changed(effects=effects)
            .with_numerics(cycles=1)
        )
        told = uncertainty.medium_spread(sand, GAIT, np.array([1.0]))
        nets = [
            sand.changed(medium=Viscous(2.5 + h)).cycle(phases=16).net
            for h in (0.01, -0.01)
        ]
        np.testing.assert_allclose(
            [told[q][0] for q in QUANTITIES[:3]],
            np.abs(nets[0] - nets[1]) * 2,
            rtol=0.01,
            atol=1e-7,
        )


def test_it_costs_what_is_told():
    sand = scene(granular()).with_numerics(phases=64)
    certain = sand.changed(medium=Granular(1.49, 0.22))
    more = (
        SceneTables(sand).cost([1.0, 1.5], ["direct"]).balances
        - SceneTables(certain).cost([1.0, 1.5], ["direct"]).balances
    )
    assert (
        more
        == 6 * 2 * uncertainty.PHASES
        == uncertainty.n_systems(sand.system) * 2 * uncertainty.PHASES
    )


def test_a_covariance_that_reaches_no_medium_is_refused_before_computing(
    monkeypatch, tmp_path
):
    wide = scene(Granular(1.49, 0.22, covariance=((4.0, 0.0), (0.0, 1e-4))))
    monkeypatch.setattr(Swimmer, "run", lambda *args: pytest.fail("computed"))
    with pytest.raises(
        Refusal,
        match=r"sand: \[medium\] covariance: a standard deviation away there is no medium \(C ",
    ):
        tabled(SceneTables(wide).displacements([1.0], ["direct"]))
    with pytest.raises(Refusal, match="there is no medium"):
        cheapest_displacements(wide, [1.0], 1e-2)
    with pytest.raises(Refusal, match="there is no medium"):
        swept_table(sweep.sweep(wide, {"gait.amplitude": [1.0]}))
    with pytest.raises(Refusal, match="there is no medium"):  # at one end only
        swept_table(sweep.sweep(scene(granular()), {"medium.C": [2.0, 1.0, 0.05]}))


def test_the_command_gives_it(tmp_path):
    (tmp_path / "s.toml").write_text(
        '[medium]\nlaw = "granular"\nC = 1.49\ngamma0_deg = 12.6\ncovariance = [[0.012, -0.0012], [-0.0012, 0.0004]]\n'
        '[body]\nkind = "chain"\n[gait]\nkind = "circle"\n[numerics]\nphases = 64\n'
    )
    args = (
        "displacement",
        "s.toml",
        "--amplitudes",
        "1.0",
        "--tiers",
        "direct",
        "--json",
        "--plot",
        "d.svg",
    )
    code, out, err = geomech(*args, cwd=tmp_path)
    assert (code, err) == (0, "")
    found, loaded = from_dict(json.loads(out)), scenes.load(tmp_path / "s.toml")
    told = uncertainty.medium_spread(loaded, loaded.gait, np.array([1.0]))
    spread = np.hypot(found["x"].spread, found["y"].spread)
    assert spread[0] == pytest.approx(told["position"])
    assert "medium, one standard deviation" in (tmp_path / "d.svg").read_text()


def test_sweeps_have_it(tmp_path):
    sand = (
        scene(granular())
        .with_numerics(phases=32)
        .changed(gait=dataclasses.replace(GAIT, frequency=2.0))
    )
    over = {"body.length": [0.3, 0.6], "gait.amplitude": [0.5, 1.0]}
    found = swept_table(sweep.sweep(sand, over))
    told = uncertainty.medium_spread(sand, GAIT, np.array([0.5, 1.0]))
    np.testing.assert_allclose(
        found["medium_error"], [told["position"], 2 * told["position"]], rtol=1e-6
    )
    np.testing.assert_allclose(
        found["medium_error_heading"], [told["heading"]] * 2, rtol=1e-6
    )
    again = swept_table(
        sweep.sweep(sand, {"gait.tilt": [0.4, 0.5], "gait.amplitude": [1.0]})
    )  # two gaits in one batch
    np.testing.assert_allclose(
        again["medium_error"][0, 0], told["position"][1], rtol=1e-6
    )
    turned = dataclasses.replace(GAIT, tilt=0.5)
    told = uncertainty.medium_spread(sand, turned, np.array([1.0]))["position"]
    np.testing.assert_allclose(again["medium_error"][1], told, rtol=1e-6)
    many = swept_table(
        sweep.sweep(sand, {"gait.amplitude": np.linspace(0.1, 1.0, 70).tolist()})
    )  # more than go together
    np.testing.assert_allclose(
        many["medium_error"][-1], found["medium_error"][0, 1], rtol=1e-6
    )
    result = sweep.sweep(sand, {"gait.frequency": [1.0, 3.0]})
    one = swept_table(result)
    (_, band) = plots.sweep_figure(sand, result).axes[0].collections
    net, _, medium, _ = sweeps.net_values(result)
    np.testing.assert_allclose(medium, one["frequency"] * one["medium_error"])
    box = band.get_datalim(band.axes.transData)
    assert (box.y0, box.y1) == (
        pytest.approx((net - medium).min()),
        pytest.approx((net + medium).max()),
    )
    assert "medium_error" not in swept_table(
        sweep.sweep(sand.changed(medium=Viscous()), {"gait.amplitude": [0.5]})
    )
    more = (
        sweep.Plan(sand, over).cost.balances
        - sweep.Plan(sand.changed(medium=Granular(1.49, 0.22)), over).cost.balances
    )
    assert more == 6 * 4 * uncertainty.PHASES
