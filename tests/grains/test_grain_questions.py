"""Questions to grains: the drag of flank and ends becomes a law, a scene's swimmer a table, without LAMMPS."""

import contextvars
import dataclasses
import types

import numpy as np
import pytest
from commands import geomech
from tabled import tabled

from geomech import load_result, scenes
from geomech.questions.grains.drag_grains import DragGrains
from geomech.questions.grains.grains import Grains
from geomech.results import show
from geomech.run.backend import prefer, prefer_for, preferred
from geomech.scenes.data import drag
from geomech.studies.grains import drag as grains
from geomech.studies.grains import swim as grain_swim
from geomech.studies.terradynamics.calibration import rod_fit
from rft import EndCaps, Granular
from rft.effects.transient import AT_ONCE, AT_ONCE_ALONG, RATIO
from rft.fits.rods import fit
from rft.grains import Bed, Experiment, Run
from rft.grains.reversal import recovery
from rft.laws.drag import Rod, rod_drag
from rft.terradynamics.plates import StressMap

pytestmark = pytest.mark.usefixtures("fastest")

# Pure numbers, amplitudes of gaits and covariances have none.
UNITLESS = {"amplitude", "covariance"}
PSI = np.array([0.0, 10, 20, 40, 65, 90])
LAW, ROD = Granular(3.1, 0.3), Rod(0.007, 0.2, 0.03, 600.0)


def forces(e=1.7, axial=0.4, across=0.8):
    """On the flank and on both ends of the rod (2, N), N, by the law and caps of e together."""
    v = np.cos(np.radians(PSI)), np.sin(np.radians(PSI))
    caps = EndCaps(ROD.radius / ROD.length, head=e, tail=0.0, across=across)
    return axial * np.array(LAW.traction(*v)), axial * np.array(caps.traction(LAW, *v))


def test_flank_and_ends_give_the_law_and_its_caps():
    flank, ends = forces()
    found = fit("granular", rod_drag(PSI, *flank, ends=ends), ROD, "fitted")
    assert found.names == ("C", "gamma0", "k", "end_caps", "end_caps_across")
    np.testing.assert_allclose(
        found.values, [3.1, 0.3, 0.4 / ROD.area / ROD.pressure, 1.7, 0.8], rtol=1e-5
    )
    assert found.caps(0.04) == EndCaps(
        0.04, found.end_caps / 2, found.end_caps / 2, found.values[-1]
    )
    np.testing.assert_allclose(found.forces(np.radians(PSI)), flank, rtol=1e-5)
    flat = (
        flank + forces(across=None)[1]
    )  # the sum, as a rod without the columns has it, and flat ends
    whole = fit("granular", rod_drag(PSI, *flat), ROD, "fitted")
    np.testing.assert_allclose(whole.values, found.values[:4], rtol=1e-4)
    folded = fit(
        "granular",
        rod_drag(180 - PSI, *(flank * [[-1], [1]]), ends=ends * [[-1], [1]]),
        ROD,
        "fitted",
    )
    np.testing.assert_allclose(folded.values, found.values, rtol=1e-6)
    for caps in (1.0, 0.5):
        with pytest.raises(
            ValueError,
            match="forces on the flank and on the ends: leave end_caps out or say 'fitted'",
        ):
            fit("granular", rod_drag(PSI, *flank, ends=ends), ROD, caps)
    with pytest.raises(ValueError, match=r"that of -1.7 flat ends: e is 0 to 10"):
        fit("granular", rod_drag(PSI, *flank, ends=-ends), ROD, "fitted")


@pytest.mark.soak
def test_the_error_of_caps_is_their_scatter_over_many_fits():
    """With the covariance of e and the law, over 300 samples of noise, within 20 %."""
    flank, ends = forces()
    rng, values, covariance = np.random.default_rng(1), [], []
    for _ in range(300):
        noise = rng.normal(0, 0.01, (4, PSI.size))
        found = fit(
            "granular",
            rod_drag(PSI, *(flank + noise[:2]), ends=ends + 2 * noise[2:]),
            ROD,
            "fitted",
        )
        values.append(found.values)
        covariance.append(found.covariance)
    expected, spread = np.mean(covariance, 0), np.cov(np.transpose(values))
    np.testing.assert_allclose(
        np.sqrt(np.diag(expected)), np.sqrt(np.diag(spread)), rtol=0.2
    )
    correlation = lambda m: m[3] / np.sqrt(m[3, 3] * np.diag(m))
    np.testing.assert_allclose(correlation(expected), correlation(spread), atol=0.2)


@pytest.fixture
def towed(monkeypatch):
    """Runs of rods that obey the law, with 5 % more drag in the second bed, in place of those of LAMMPS."""
    monkeypatch.setattr(grains, "load_lammps", lambda: None)
    monkeypatch.setattr(
        grains,
        "settle",
        lambda *_: types.SimpleNamespace(facts={"packing": 0.6, "surface": 0.05}),
    )

    def run(experiment, folder, progress=None):
        tow, body = experiment.motion, experiment.body
        n, v = len(body.radius), (np.cos(tow.angle), np.sin(tow.angle))
        strength = 2.0 * (1.05 if experiment.bed.seed == 5 else 1.0)  # N/m
        caps = EndCaps(body.half_width / body.size, head=1.7, tail=0.0)
        profile = np.zeros((200, n, 3))
        spacing = np.diff(body.arc_length[1:-1]).mean()
        profile[..., :2] = -strength * spacing * np.array(LAW.traction(*v))
        rest = strength * (body.size - n * spacing) * np.array(LAW.traction(*v))
        profile[:, -1, :2] -= (
            strength * body.size * np.array(caps.traction(LAW, *v)) + rest
        )
        profile[..., 2] = 0.5 / n
        t = np.linspace(0, experiment.duration, 201)[1:]
        nothing = np.zeros((200, 3))
        overlaps = np.full((2, 2), 0.04)
        return Run(
            t,
            nothing,
            nothing,
            profile,
            body.arc_length,
            *[nothing] * 6,
            overlaps,
            {"lammps": 20250722, "grains": 16225},
        )

    monkeypatch.setattr(Experiment, "run", run)


def question(store, **fields):
    sizes = {"length": 0.18, "radius": 0.007, "beds": 2, "speed": 0.2, "seed": 4}
    bed = Bed(length=0.3, width=0.3)
    return DragGrains(
        **{**sizes, "angles": tuple(PSI), "bed": bed, **fields}, store=store
    )


def test_a_drag_is_that_of_the_law_that_the_rod_obeys(towed, tmp_path):
    result = question(tmp_path).ask()
    assert result["flank"].values.shape == (2, 2, 6)
    assert result["bed"].values.tolist() == [4, 5]
    np.testing.assert_allclose(result["flank"].values[0, :, 0], [2.0, 2.1], rtol=1e-6)
    np.testing.assert_allclose(result["lift"].values, 0.5)
    law = dict(zip(result["parameter"].values, result["value"].values))
    found = [law["C"], law["gamma0_deg"], law["end_caps"]]
    np.testing.assert_allclose(found, [3.1, np.degrees(0.3), 1.7], rtol=2e-3)
    mean, error = result["mean_flank"].values[:, 4], result["mean_flank"].error[:, 4]
    two = result["flank"].values[:, :, 4]
    np.testing.assert_allclose(mean, two.mean(1))
    np.testing.assert_allclose(error, np.abs(two[:, 1] - two[:, 0]) / 2)
    alone = question(tmp_path, beds=1).ask()
    np.testing.assert_allclose(alone["mean_flank"].error, alone["flank"].error[:, 0])


def test_a_drag_is_a_file_that_fit_medium_reads(towed, tmp_path):
    result = question(tmp_path).ask()
    path = tmp_path / "drag.csv"
    result.save(path)
    told = path.read_text().splitlines()
    for line, said in (
        (0, "geomech drag-grains --length 0.18 --radius 0.007 --angles 0,10,20,40,65,90 --beds 2 --seed 4 --speed 0.2"),
        (1, "mean after 17.5 mm of travel"),
        (2, "grains 6 mm +-7 %, density 1030 kg/m^3, packing 0.6000; rod 14 mm diameter x 180 mm"),
        (2, ", axis 25.50 mm deep, 0.2 m/s"),
        (4, "16225 grains in 300 mm by 300 mm, periodic; time step 98 us; largest overlap 0.040"),
        (11, "65,0.1521,1.3824,0.0935,0.0339,0.5000,4,0.0000"), (17, "65,0.1597,1.4516,0.0982,0.0356,0.5000,5,0.0000"),
    ):  # fmt: skip
        assert said in told[line]
    read = drag.read(path)
    assert read.sizes == pytest.approx(
        {"radius": 0.007, "length": 0.18, "depth": 0.0255, "density": 618.0}
    )
    flank = 0.18 * result["flank"].values.reshape(2, -1)
    np.testing.assert_allclose(read.rows[1:3], flank, atol=6e-5)
    sand = tmp_path / "sand.toml"
    code, out, err = geomech("fit-medium", path, "--end-caps", "fitted", "-o", sand)
    assert (code, err) == (0, "") and "end_caps" in out
    assert "Both ends together" in sand.read_text()
    result.save(tmp_path / "drag.nc")  # and from a file of its own
    load_result(tmp_path / "drag.nc").save(tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_text() == path.read_text()


def test_results_of_grains_are_complete(towed, tmp_path):
    """Written, read back, shown within 80 columns, drawn, and each number with its unit."""
    check_complete(question(tmp_path).ask(), tmp_path)


def check_complete(result, folder):
    for ending in (".nc", ".json"):
        result.save(folder / f"a{ending}")
        again = load_result(folder / f"a{ending}")
        assert list(again) == list(result)
        for name in result:
            assert again[name].unit == result[name].unit
            np.testing.assert_array_equal(again[name].values, result[name].values)
        assert len(again.plot().axes) == 2
    assert max(map(len, show.text(result).splitlines())) <= 80
    for variable in result.variables:
        is_number = variable.values.dtype.kind == "f"
        assert not is_number or variable.unit or variable.name in UNITLESS, (
            variable.name
        )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"angles": (0.0, 90.0)}, "a law takes three angles or more"),
        ({"angles": (0.0, 30.0, 100.0)}, "angles must be 0 to 90 degrees"),
        ({"beds": 0}, "beds must be 1 to 100"),
        ({"speed": 0.0}, "speed must be > 0"),
        ({"radius": 0.01}, "ten times as long as it is wide"),
        ({"length": 0.25}, "the bed is too small"),
    ],
)
def test_drags_that_cannot_be_are_refused(change, words, towed, tmp_path):
    with pytest.raises(ValueError, match=words):
        dataclasses.replace(DragGrains(store=tmp_path), **change).check()


def test_the_cost_is_said_before_and_refused_beyond_ten_minutes(
    towed, monkeypatch, tmp_path
):
    one = DragGrains(beds=1, angles=(0.0, 30.0, 90.0), store=tmp_path)
    cost = one.cost()
    e = one.study.experiments()[0]
    assert cost.balances == pytest.approx(
        (16225 + 102) * (3 * e.n_steps + 0.7 / e.bed.step), rel=1e-3
    )
    assert str(cost).endswith("about 3.2 min of computing")
    code, _, err = geomech("drag-grains", "-o", tmp_path / "a.csv", "--store", tmp_path)
    assert (
        code == 2
        and "for more than 10 min say --yes, or take fewer --beds or --angles" in err
    )
    assert not (tmp_path / "a.csv").exists()


def test_a_swim_stands_beside_the_tiers(monkeypatch, tmp_path):
    """A scene in metres, 0.3 m long, at 2 Hz; each cycle turns by 0.2 rad and moves by 24 mm ahead."""
    scene = scenes.parse(
        '[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\nlengths = [1, 1.5, 1]\nlength = 0.3\n[gait]\n'
        'kind = "circle"\namplitude = 0.9\nfrequency = 2.0\nreverse = true\n[[effects]]\nkind = "end-caps"\nradius_m = 0.009\n'
        "[numerics]\nphases = 32\ngrid = 7\n"
    )
    monkeypatch.setattr(grain_swim, "load_lammps", lambda: None)
    asked = []

    def run(experiment, folder, progress=None):
        asked.append(experiment)
        t = np.linspace(0, 1.25, 1001)[1:]
        theta = 0.4 * t + 0.3
        # An arc, whose chord of half a second, a cycle, is 24 mm.
        place = -1j * np.exp(1j * theta) * 0.024 / abs(np.exp(0.2j) - 1)
        pose = np.column_stack([place.real, place.imag, theta])
        alpha = np.array([experiment.motion.joint_angles(x)[0] for x in t])
        nothing, facts = (
            np.zeros((1000, 3)),
            {"grains": 100, "packing": 0.6, "lammps": 1, "mass": 0.1},
        )
        series = (
            t,
            nothing,
            t,
            np.zeros((1000, 1, 3)),
            np.zeros(1),
            pose,
            nothing[:, :2],
            alpha,
            0.5 * t,
            t,
            nothing,
        )
        return Run(*series, np.ones((2, 2)), facts)

    monkeypatch.setattr(Experiment, "run", run)
    result = Grains(scene, store=tmp_path).ask()
    (experiment,) = asked
    assert experiment.body.size == 0.3 and experiment.body.half_width == pytest.approx(
        0.009
    )
    assert experiment.bed.length == pytest.approx(
        0.418
    ) and experiment.duration == pytest.approx(1.25)
    alpha, _ = experiment.motion.joint_angles(0.25)
    np.testing.assert_allclose(
        alpha, scene.gait.shape(0.0), atol=1e-12
    )  # full grown, at phase 0
    assert result["method"].values.tolist()[-3:] == [
        "direct",
        grain_swim.GRAINS_LAW,
        "grains",
    ]
    assert show.text(result).startswith(
        "scene in 100 grains, seed 1: body 300 mm long, 18 mm wide, 2 Hz"
    )
    theta = 0.4 * 1.25 + 0.3
    last = [result[name][-1] for name in ("t", "frame_x", "frame_heading", "work_done")]
    expected = [1.25, 0.1201 * np.sin(theta), theta, 0.625]
    np.testing.assert_allclose(last, expected, rtol=2e-3)
    shape = [result["alpha_1"][-1], result["alpha_2"][-1]]
    np.testing.assert_allclose(
        shape, experiment.motion.joint_angles(1.25)[0], atol=1e-5
    )
    np.testing.assert_allclose(result["cycle_heading"].values, 0.2)
    np.testing.assert_allclose(
        np.hypot(result["cycle_x"].values, result["cycle_y"].values), 0.08, rtol=1e-6
    )
    np.testing.assert_allclose(result["cycle_y"].values, 0.08 * np.sin(0.1), rtol=1e-3)
    assert float(result["work"]) == pytest.approx(0.25)
    k = result["method"].values.tolist().index("direct")
    from geomech.studies.scene_tables import SceneTables

    own = tabled(SceneTables(scene).displacements([0.9], ("direct",)))
    assert result["x"].values[k] == pytest.approx(own["x"]["direct"][0] / 0.3)
    assert not np.isclose(result["x"].values[k], result["x"].values[k + 1])
    # Ends that both push half as much are one end that pushes, to 1 %.
    flank = rod_fit("flank-drag", end_caps="fitted")
    one = dataclasses.replace(
        flank.caps(0.03), head=flank.end_caps, tail=0.0
    ).in_metres(0.3)
    ahead = dataclasses.replace(scene.system, medium=flank.medium, effects=(one,))
    one_end = tabled(
        SceneTables(scene.changed(system=ahead)).displacements([0.9], ("direct",))
    )
    assert result["x"].values[k + 1] == pytest.approx(
        one_end["x"]["direct"][0] / 0.3, rel=0.03
    )
    check_complete(result, tmp_path)
    result.save(tmp_path / "motion.csv")
    columns, row, *_ = (tmp_path / "motion.csv").read_text().splitlines()
    assert {"t", "frame_x", "alpha_2", "force_z"} <= set(columns.split(","))
    assert len(columns.split(",")) == len(row.split(","))
    left, right = result.plot().axes
    rows = np.minimum(np.searchsorted(result["t"].values, (0.0, 0.25, 0.75, 1.25)), 999)
    alpha = np.column_stack([result["alpha_1"].values, result["alpha_2"].values])
    pose = np.column_stack([result[f"frame_{x}"].values for x in ("x", "y", "heading")])
    for line, row in zip(left.lines[1:], rows, strict=True):
        points = scene.system.body.points(alpha[row], pose[row])
        np.testing.assert_allclose(line.get_xydata(), points / 0.3, atol=1e-12)
    x, y = result["x"], result["y"]
    distance = np.hypot(x.values, y.values)
    np.testing.assert_allclose([bar.get_width() for bar in right.patches], distance)
    ends = np.array([bar[:, 0] for bar in right.collections[0].get_segments()])
    squares = 0.0
    for one in ("error", "spread"):
        parts = (
            np.hypot(x.values * getattr(x, one), y.values * getattr(y, one)) / distance
        )
        squares = squares + np.nan_to_num(parts) ** 2
    error = np.sqrt(squares)
    np.testing.assert_allclose(ends, np.transpose([distance - error, distance + error]))


def test_sizes_that_are_none_are_refused():
    for option, said in (
        ("--length", "length must be > 0"),
        ("--radius", "radius must be > 0"),
    ):
        code, _, err = geomech("grains", "three-link-glass", option, "0")
        assert code == 2 and said in err and err.count("\n") == 1


def test_scenes_without_rigid_links_are_refused():
    code, _, err = geomech("grains", "sandfish-loose")
    assert code == 2 and "grains take a body of rigid links" in err
    code, _, err = geomech("grains", "three-link-floating")
    assert code == 2 and "grains take a body of rigid links" in err


def test_samples_have_names_that_say_what_they_are():
    old, short = (rod_fit(name) for name in ("dem-rod-drag", "short-rod-drag"))
    np.testing.assert_array_equal(old.values, short.values)
    flank = rod_fit("flank-drag", end_caps="fitted")
    assert flank.data.n_angles == 6 and flank.rod.length == 0.162
    np.testing.assert_allclose(
        flank.values, [4.54, 0.260, 0.981, 1.96, 1.21], rtol=3e-3
    )  # as written with the sample
    assert flank.errors[-1] == pytest.approx(
        0.33, abs=0.02
    )  # flat ends have sin gamma0, 0.257: 2.9 of these less


def test_the_figure_of_grains_shows_beds_beside_laws():
    """Three beds of two cycles each; lift and reversals as they were computed, over beds."""
    from figures.grains import beds as figure
    from figures.grains.campaigns.grains import CIRCLE, read

    numbers = figure.compute([0.5, 1.0], others=[], travels=[])
    curves, swims = numbers["curves"], numbers["swims"]
    area, harmonic, direct, flat = (c["distance"][1] for c in curves.values())
    assert (area, harmonic, direct, flat) == pytest.approx(
        (0.177, 0.152, 0.151, 0.107), abs=2e-3
    )
    assert curves["direct"]["spread"][1] == pytest.approx(0.008, abs=1e-3)
    numbers["others"] = {
        (CIRCLE, 0.5): {
            name: (c["distance"][0], c["spread"][0]) for name, c in curves.items()
        }
    }
    data = read("swims")
    one = (
        (data["scene"] == CIRCLE)
        & (data["amplitude"] == 1.0)
        & (data["frequency_Hz"] == 1.0)
    )
    of = lambda bed: np.hypot(data["x_BL"], data["y_BL"])[
        one & (data["bed"] == bed)
    ].mean()
    means = [of(bed) for bed in (1, 2, 3)]
    assert swims[CIRCLE, 1.0, 1.0] == pytest.approx(
        (np.mean(means), np.std(means, ddof=1) / np.sqrt(3))
    )
    assert {(CIRCLE, a, 1.0) for a in (0.5, 1.0, 1.5, 1.7, 2.0)} <= set(swims)
    lift = numbers["lift"]
    assert list(lift) == list(figure.BARS) and lift["round"]["grains"] == pytest.approx(
        0.43, abs=0.1
    )
    assert (lift["half round"]["keep"], lift["half round"]["cut"]) == pytest.approx(
        (0.54, 0.04), abs=0.01
    )
    across, along = (numbers["reversal"][0.0245, angle, "flank"] for angle in (90, 0))
    measured = AT_ONCE, AT_ONCE_ALONG, RATIO
    ratio = along["travel"][0] / across["travel"][0]
    assert (across["at_once"][0], along["at_once"][0], ratio) == pytest.approx(
        measured, abs=0.006
    )
    rows = read("reversals")
    fits = []
    for bed in (1, 2, 3):
        mine = [
            (rows["amplitude_m"] == a)
            & (rows["depth_m"] == 0.0245)
            & (rows["angle_deg"] == 90)
            & (rows["bed"] == bed)
            for a in (0.01, 0.02, 0.04)
        ]
        fits.append(
            recovery(
                [
                    (rows["amplitude_m"][m][0], rows["travel_m"][m], rows["flank_N"][m])
                    for m in mine
                ]
            )
        )
    travel = np.array([fit.travel for fit in fits])
    assert across["travel"] == pytest.approx(
        (travel.mean(), travel.std(ddof=1) / np.sqrt(3))
    )
    late = {
        case: (x["at_once"][0], 1e3 * x["travel"][0])
        for case, x in numbers["last_strokes"].items()
    }
    assert late[0.04, 0.0245, 90] == pytest.approx((0.32, 61.4), abs=0.05)
    assert late[0.02, 0.0150, 90] == pytest.approx((-0.03, 36.8), abs=0.05)
    for (a, angle), way in numbers["after_reversal"].items():  # fitted at 20 mm
        assert np.sqrt(np.mean((way["grains"] - way["law"]) ** 2)) < 0.11, (a, angle)
    assert "circle 1 rad" in figure.table(numbers)
    circles, others, lifts, right = figure.draw(numbers).axes
    assert (
        circles.lines[2].get_ydata().tolist() == curves["direct"]["distance"].tolist()
    )
    assert others.lines[2].get_xdata()[0] == numbers["others"][CIRCLE, 0.5]["direct"][0]
    assert others.containers[0].lines[0].get_xdata()[0] == swims[CIRCLE, 0.5, 1.0][0]
    assert len(lifts.get_yticklabels()) == 3 and len(right.lines) == 8


def test_the_budget_of_a_swim_finds_which_force_is_another():
    """A body that obeys a law with five times the ends, in place of grains: the difference is theirs."""
    from figures.grains.campaigns import swim_budget as budget

    law = rod_fit("flank-drag", end_caps="fitted")
    question = grain_swim.GrainSwim(
        scenes.load("three-link-glass"), cycles=1, radius=2e-3
    )
    caps = law.caps(2e-3 / 0.162)
    body, n = budget.points(question), budget.PHASES
    system = dataclasses.replace(question.swimmer, medium=law.medium)
    phases = 2 * np.pi * (np.arange(n) + 0.5) / n
    alpha, alphadot = (
        np.array([g(t) for t in phases])
        for g in (question.scene.gait.shape, question.scene.gait.rate)
    )

    def found(other):
        """Return distances by the law and of a swimmer that obeys it with end caps ``other``, and shares by part, m."""
        xi = (
            dataclasses.replace(system, effects=(other,)).velocity(alpha, alphadot)
            * 2
            * np.pi
            * [0.162, 0.162, 1.0]
        )
        force = budget.law_forces(body, law, other, xi)
        force[:, 1] += force[:, 0]  # in grains the sphere at a tip bears its force
        force[:, -2] += force[:, -1]
        samples, before = 5, 5 * n // 2  # to a phase, and before the first
        h = 1 / (samples * n)
        later = lambda x: np.concatenate([np.zeros((before, *x.shape[1:]), x.dtype), x])
        theta = xi[:, 2].cumsum() / n
        turn = np.repeat(np.exp(1j * (theta - xi[:, 2] / n / 2)), samples)
        place = later(
            (np.repeat(xi[:, 0] + 1j * xi[:, 1], samples) * turn).cumsum() * h
        )
        heading = later(np.repeat(xi[:, 2], samples).cumsum() * h)
        world = later(
            np.repeat((force * body.heading)[:, 1:-1], samples, 0) * turn[:, None]
        )
        t, nothing = h * np.arange(1, len(place) + 1), np.zeros((len(place), 3))
        pose = np.column_stack([place.real, place.imag, heading])
        profile = np.stack([world.real, world.imag, 0 * world.real], -1)
        run = Run(
            t, nothing, t, profile, t, pose, *[nothing] * 2, t, t, *[nothing] * 2, {}
        )
        (swum,) = budget.budget(question, run, law, caps)
        assert list(budget.recovery(body, swum, 1 / n)) == pytest.approx(
            np.ones(len(budget.TRAVELS)), abs=0.05
        )
        distances = [budget.distance(x, 1 / n)[0] for x in (swum.xi_0, swum.xi)]
        return distances, {name: x.sum() for name, x in swum.shares.items()}

    (by_law, same), parts = found(caps)
    assert (
        same == pytest.approx(by_law, rel=2e-3)
        and max(map(abs, parts.values())) < 0.01 * by_law
    )
    (by_law, other), parts = found(
        dataclasses.replace(caps, head=5 * caps.head, tail=5 * caps.tail)
    )
    assert other < 0.85 * by_law
    ends = parts["ends, along"] + parts["ends, across"]
    assert ends == pytest.approx(other - by_law, rel=0.1) and parts["ends, along"] < 0
    assert (
        max(abs(parts[name]) for name in ("flank, along", "flank, across", "rest"))
        < 0.03 * by_law
    )
    assert sum(parts.values()) == pytest.approx(other - by_law, rel=1e-9)
    assert (
        16 <= budget.near_singular(question, law, caps).sum() <= 18
    )  # a quarter of 64, and pairs that are alike


def test_plates_in_grains_stand_beside_bars_and_the_map():
    """The rows of a bar add up to it; stress on them is force over their area and depth; grains press where the map pulls."""
    from figures.grains import plates as figure
    from figures.grains.campaigns import grains as campaign
    from figures.paper.fig08a_rods import face_stress

    rows, lift = campaign.read("faces"), campaign.read("lift")
    for key in ("drag_N", "lift_N"):
        sums = [
            rows[key][(rows["shape"] == s) & (rows["bed"] == b)].sum()
            for s, b in zip(lift["shape"], lift["bed"])
        ]
        np.testing.assert_allclose(
            sums, lift[key], rtol=0, atol=4e-4
        )  # blocks of a mean differ by a sample
    numbers = figure.compute()
    bar, maps = numbers["bar"], numbers["maps"]
    # One depth for all rows: lift over drag of Fig. 8(a), and of the two kinds of stress the force on the rows.
    deep = bar | {
        "weight": bar["weight"]
        / (campaign.BAR_DEPTH + campaign.BAR * np.cos(bar["beta"]))
    }
    for rule, ratio in (("keep", 0.81), ("cut", 0.68)):
        stress = face_stress(StressMap(tension=rule), figure.BETA)
        assert figure.lift_over_drag(deep, figure.BETA, *stress) == pytest.approx(
            ratio, abs=0.01
        )
    assert deep["weight"].sum() == pytest.approx(
        np.pi * campaign.BAR * campaign.TROUGH.length
    )  # half the bar's surface
    one = figure.lift_over_drag(
        bar, bar["beta"], bar["normal"][:, 1], bar["tangent"][:, 1]
    )
    assert one == pytest.approx(bar["lift"][:, 1].sum() / bar["drag"][:, 1].sum())
    pulls = maps["keep"]["normal"] < 0
    assert (
        np.degrees(figure.BETA[pulls].min()) == pytest.approx(144, abs=1)
        and (maps["cut"]["normal"][pulls] == 0).all()
    )
    assert (
        bar["normal"][bar["beta"] > np.radians(143)].min() > 0.009
    )  # N/cm^3, in every bed
    plates = numbers["plates"][0.016]
    up = plates["beta"] > np.radians(143)
    assert (
        up.any()
        and plates["face"]["normal"][up].min() > 0.006
        and plates["whole"]["normal"][up].min() > 0.005
    )
    assert maps["cut"]["misfit"][1] < 0.75 * maps["keep"]["misfit"][1]
    bars = numbers["bars"]
    assert bars["half round"]["faces"] == pytest.approx((-0.62, 0.03), abs=0.01)
    assert (
        bars[campaign.SHELL]["whole"][0] == pytest.approx(0.27, abs=0.01)
        and bars[campaign.SHELL]["cut"] < 0.6
    )


def test_a_cycle_in_grains_is_told_in_the_frame_at_its_start():
    """Of a body that goes ahead and aside in its own frame and turns faster and faster."""
    t = np.linspace(0, 3, 3001)
    heading, start = 0.3 + 0.7 * t**2, 0.3 + 0.7 * np.array([0.5, 1.5, 2.5]) ** 2
    place = np.array([complex(0.2, -0.1), complex(0.5, 0.4)]) * np.exp(1j * start[:2])
    way = np.interp(
        t, [0, 0.5, 1.5, 2.5, 3.0], np.cumsum([0.7j, 0.0, *place, 0.1]).real
    )
    aside = np.interp(
        t, [0, 0.5, 1.5, 2.5, 3.0], np.cumsum([0.7j, 0.0, *place, 0.1]).imag
    )
    run = types.SimpleNamespace(t=t, pose=np.stack([way, aside, heading], -1))
    found = grain_swim.cycle_poses(run, np.array([0.5, 1.5, 2.5]))
    np.testing.assert_allclose(
        found, [[0.2, -0.1, 0.7 * 2.0], [0.5, 0.4, 0.7 * 4.0]], atol=1e-9
    )


def test_sizes_of_a_swimmer_are_those_given_or_the_scenes():
    """Its length in metres, the radius of its caps, and a bed that is wide and deep enough."""
    chain = '[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\n{}[gait]\nkind = "circle"\n'
    caps = '[[effects]]\nkind = "end-caps"\nradius_m = 0.01\n'
    bare = caps.replace("radius_m = 0.01", "radius = 0.05")
    for text_, given, size, radius in (
        (chain.format(""), {}, 0.162, 6e-3), (chain.format("length = 0.2\n"), {}, 0.2, 6e-3),
        (chain.format("length = 0.2\n") + caps, {}, 0.2, 0.01), (chain.format("") + bare, {"size": 0.3}, 0.3, 0.015),
        (chain.format("") + bare, {"size": 0.3, "radius": 0.02}, 0.3, 0.02),
    ):  # fmt: skip
        question = grain_swim.GrainSwim(scenes.parse(text_), 3, 7, **given)
        one = question.experiment
        assert (one.body.size, one.body.half_width, one.bed.seed) == pytest.approx(
            (size, radius, 7)
        )
        assert (one.bed.length, one.bed.width) == pytest.approx(
            (size + 0.118, size + 0.078)
        )
        assert one.bed.depth == pytest.approx(
            max(0.049, 2 * radius + 6 * one.bed.diameter)
        )
        assert (question.frequency, one.duration) == (1.0, 3.5)


def test_the_back_end_does_not_depend_on_what_a_store_holds():
    """Else the last digits of the tiers beside grains differ when a run is resumed."""

    def chosen(steps):
        prefer("numpy")
        prefer_for(grains.GrainSteps(steps, steps / grains.RATE, 0.0).as_balances)
        return preferred()

    first, resumed = (contextvars.copy_context().run(chosen, n) for n in (10**12, 0))
    assert first == resumed == "numpy"
