"""Questions to grains: the drag of flank and ends becomes a law, a scene's swimmer a
table, without LAMMPS."""

import contextvars
import dataclasses

import beds
import numpy as np
import pytest
from tabled import tabled

from figures.grains import beds as beds_figure
from figures.grains import plates as plates_figure
from figures.grains.campaigns import grains as campaign
from figures.paper.fig08a_rods import face_stress
from geomech import load_result, scenes
from geomech.questions.grains.drag_grains import DragGrains
from geomech.questions.grains.grains import Grains
from geomech.questions.measured.fit_medium import FitMedium
from geomech.run.backend import prefer, prefer_for, preferred
from geomech.scenes.data import drag
from geomech.studies.grains import drag as grains
from geomech.studies.grains import swim as grain_swim
from geomech.studies.scene_tables import SceneTables
from geomech.studies.terradynamics.calibration import rod_fit
from rft import EndCaps, Granular
from rft.effects.transient import AT_ONCE, AT_ONCE_ALONG, RATIO
from rft.fits.rods import fit
from rft.grains import Bed
from rft.laws.drag import Rod, rod_drag
from rft.terradynamics.plates import StressMap

pytestmark = pytest.mark.usefixtures("fastest")

PSI = np.array([0.0, 10, 20, 40, 65, 90])
WAY = (np.cos(np.radians(PSI)), np.sin(np.radians(PSI)))
LAW = Granular(3.1, 0.3)
ROD = Rod(0.007, 0.2, 0.03, 600.0)
FLANK = 0.4 * np.array(LAW.traction(*WAY))


def ends(across=0.8):
    """Return forces (2, N), N, on both ends of the rod."""
    caps = EndCaps(ROD.radius / ROD.length, head=1.7, tail=0.0, across=across)
    return 0.4 * np.array(caps.traction(LAW, *WAY))


def test_flank_and_ends_give_the_law_and_its_caps():
    found = fit("granular", rod_drag(PSI, *FLANK, ends=ends()), ROD, "fitted")
    assert found.names == ("C", "gamma0", "k", "end_caps", "end_caps_across")
    k = 0.4 / ROD.area / ROD.pressure
    np.testing.assert_allclose(found.values, [3.1, 0.3, k, 1.7, 0.8], rtol=1e-5)
    half = found.end_caps / 2
    assert found.caps(0.04) == EndCaps(0.04, half, half, found.values[-1])
    np.testing.assert_allclose(found.forces(np.radians(PSI)), FLANK, rtol=1e-5)
    # The sum, as of a rod without the columns, with flat ends.
    whole = fit("granular", rod_drag(PSI, *(FLANK + ends(None))), ROD, "fitted")
    np.testing.assert_allclose(whole.values, found.values[:4], rtol=1e-4)
    back = np.array([[-1], [1]])
    mirrored = rod_drag(180 - PSI, *(back * FLANK), ends=back * ends())
    folded = fit("granular", mirrored, ROD, "fitted")
    np.testing.assert_allclose(folded.values, found.values, rtol=1e-6)


@pytest.mark.parametrize(
    ("sign", "caps", "said"),
    [
        (1, 1.0, "leave end_caps out or say 'fitted'"),
        (1, 0.5, "leave end_caps out or say 'fitted'"),
        (-1, "fitted", r"that of -1.7 flat ends: e is 0 to 10"),
    ],
)
def test_ends_that_were_measured_are_fitted(sign, caps, said):
    with pytest.raises(ValueError, match=said):
        fit("granular", rod_drag(PSI, *FLANK, ends=sign * ends()), ROD, caps)


@pytest.mark.soak
def test_the_error_of_caps_is_their_scatter_over_many_fits():
    """With the covariance of e and the law, over 300 samples of noise, within 20 %."""
    rng = np.random.default_rng(1)
    values = []
    covariance = []
    for _ in range(300):
        noise = rng.normal(0, 0.01, (4, PSI.size))
        noisy = rod_drag(PSI, *(FLANK + noise[:2]), ends=ends() + 2 * noise[2:])
        found = fit("granular", noisy, ROD, "fitted")
        values.append(found.values)
        covariance.append(found.covariance)
    errors = np.sqrt(np.diag(np.mean(covariance, 0)))
    np.testing.assert_allclose(errors, np.std(values, 0), rtol=0.2)
    expected = np.mean(covariance, 0)[3] / errors[3] / errors
    found = np.corrcoef(np.transpose(values))[3]
    np.testing.assert_allclose(expected, found, atol=0.2)


@pytest.fixture
def obeyed(monkeypatch):
    """Runs of bodies that obey a law, in place of those of LAMMPS."""
    beds.obey(monkeypatch)


def question(store, **fields):
    sizes = {"length": 0.18, "radius": 0.007, "beds": 2, "speed": 0.2, "seed": 4}
    bed = Bed(length=0.3, width=0.3)
    fields = {**sizes, "angles": tuple(PSI), "bed": bed, **fields}
    return DragGrains(**fields, store=store)


def test_a_drag_is_that_of_the_law_that_the_rod_obeys(obeyed, tmp_path):
    """In the second bed by 5 % more."""
    result = question(tmp_path).ask()
    flank = result["flank"].values
    assert result["bed"].values.tolist() == [4, 5]
    np.testing.assert_allclose(flank[0, :, 0], [2.0, 2.1], rtol=1e-6)
    np.testing.assert_allclose(result["lift"].values, 0.5)
    law = dict(zip(result["parameter"].values, result["value"].values))
    found = [law["C"], law["gamma0_deg"], law["end_caps"]]
    np.testing.assert_allclose(found, [3.1, np.degrees(0.3), 1.7], rtol=2e-3)
    mean = result["mean_flank"]
    np.testing.assert_allclose(mean.values, flank.mean(1))
    np.testing.assert_allclose(mean.error, np.abs(np.diff(flank, axis=1))[:, 0] / 2)
    alone = question(tmp_path, beds=1).ask()
    np.testing.assert_allclose(alone["mean_flank"].error, alone["flank"].error[:, 0])


def test_a_drag_is_a_file_that_fit_medium_reads(obeyed, tmp_path):
    result = question(tmp_path).ask()
    path = tmp_path / "drag.csv"
    result.save(path)
    told = path.read_text().splitlines()
    assert "geomech drag-grains --length 0.18 --radius 0.007 --angles 0,10" in told[0]
    assert "packing 0.6000; rod 14 mm diameter x 180 mm" in told[2]
    assert told[11].startswith("65,0.1521,1.3824,0.0935,0.0339,0.5000,4,")
    read = drag.read(path)
    sizes = {"radius": 0.007, "length": 0.18, "depth": 0.0255, "density": 618.0}
    assert read.sizes == pytest.approx(sizes)
    flank = 0.18 * result["flank"].values.reshape(2, -1)
    np.testing.assert_allclose(read.rows[1:3], flank, atol=6e-5)
    fitted = FitMedium(path, end_caps="fitted").ask()
    assert "Both ends together" in fitted.attributes["medium_toml"]
    result.save(tmp_path / "drag.nc")
    load_result(tmp_path / "drag.nc").save(tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_text() == path.read_text()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"angles": (0.0, 30.0, 100.0)}, "angles must be 0 to 90 degrees"),
        ({"speed": 0.0}, "speed must be > 0"),
        ({"radius": 0.01}, "ten times as long as it is wide"),
        ({"length": 0.25}, "the bed is too small"),
    ],
)
def test_drags_that_cannot_be_are_refused(change, words, obeyed, tmp_path):
    with pytest.raises(ValueError, match=words):
        DragGrains(**change, store=tmp_path).check()


def test_the_cost_of_a_drag_is_that_of_its_grains_and_steps(tmp_path):
    one = DragGrains(beds=1, angles=(0.0, 30.0, 90.0), store=tmp_path)
    run = one.study.experiments()[0]
    steps = 3 * run.n_steps + 0.7 / run.bed.step
    assert one.cost().balances == pytest.approx((16225 + 102) * steps, rel=1e-3)
    assert str(one.cost()).endswith("about 3.2 min of computing")


SWIMMER = scenes.parse("""
[medium]
name = "glass-0.3mm-loose"
[body]
kind = "chain"
lengths = [1, 1.5, 1]
length = 0.3
[gait]
kind = "circle"
amplitude = 0.9
frequency = 2.0
reverse = true
[[effects]]
kind = "end-caps"
radius_m = 0.009
[numerics]
phases = 32
grid = 7
""")


def test_a_swim_stands_beside_the_tiers(obeyed, tmp_path):
    """Each cycle turns by 0.2 rad and moves by 24 mm ahead, of 0.3 m."""
    result = Grains(SWIMMER, store=tmp_path).ask()
    methods = result["method"].values.tolist()
    assert methods[-3:] == ["direct", grain_swim.GRAINS_LAW, "grains"]
    end = 0.4 * 1.25 + 0.3
    last = [result[name].values[-1] for name in ("t", "frame_x", "frame_heading")]
    np.testing.assert_allclose(last, [1.25, 0.1201 * np.sin(end), end], rtol=2e-3)
    x = result["cycle_x"].values
    y = result["cycle_y"].values
    np.testing.assert_allclose(np.hypot(x, y), 0.08, rtol=1e-6)
    np.testing.assert_allclose(y, 0.08 * np.sin(0.1), rtol=1e-3)
    np.testing.assert_allclose(result["cycle_heading"].values, 0.2)
    assert float(result["work"]) == pytest.approx(0.25)
    # Ends that both push half as much are one end that pushes, to 3 %.
    flank = rod_fit("flank-drag", end_caps="fitted")
    one_end = dataclasses.replace(flank.caps(0.03), head=flank.end_caps, tail=0.0)
    by_flank = dataclasses.replace(
        SWIMMER.system, medium=flank.medium, effects=(one_end.in_metres(0.3),)
    )
    for system, method in (
        (SWIMMER.system, "direct"),
        (by_flank, grain_swim.GRAINS_LAW),
    ):
        tables = SceneTables(SWIMMER.changed(system=system))
        alone = tabled(tables.displacements([0.9], ("direct",)))["x"]["direct"][0]
        found = result["x"].values[methods.index(method)]
        assert found == pytest.approx(alone / 0.3, rel=0.03)


def test_a_swim_is_drawn_as_bodies_in_time_and_distances_by_method(obeyed, tmp_path):
    result = Grains(SWIMMER, store=tmp_path).ask()
    left, right = result.plot().axes
    rows = np.minimum(
        np.searchsorted(result["t"].values, (0.0, 0.25, 0.75, 1.25)), 1000
    )
    shapes = np.column_stack([result[name].values for name in ("alpha_1", "alpha_2")])
    frame = [result[f"frame_{axis}"].values for axis in ("x", "y", "heading")]
    poses = np.transpose(frame)
    for line, row in zip(left.lines[1:], rows, strict=True):
        points = SWIMMER.system.body.points(shapes[row], poses[row])
        np.testing.assert_allclose(line.get_xydata(), points / 0.3, atol=1e-12)
    distance = np.hypot(result["x"].values, result["y"].values)
    np.testing.assert_allclose([bar.get_width() for bar in right.patches], distance)
    ends = np.array([bar[:, 0] for bar in right.collections[0].get_segments()])
    np.testing.assert_allclose(np.nanmean(ends, 1), distance)


def test_samples_have_names_that_say_what_they_are():
    old = rod_fit("dem-rod-drag").values
    np.testing.assert_array_equal(old, rod_fit("short-rod-drag").values)
    flank = rod_fit("flank-drag", end_caps="fitted")
    # As written with the sample.
    expected = [4.54, 0.260, 0.981, 1.96, 1.21]
    np.testing.assert_allclose(flank.values, expected, rtol=3e-3)
    assert flank.errors[-1] == pytest.approx(0.33, abs=0.02)


def test_the_figure_of_grains_shows_beds_beside_laws():
    """Three beds of two cycles each."""
    numbers = beds_figure.compute([0.5, 1.0], others=[], travels=[])
    curves = numbers["curves"]
    distances = [curve["distance"][1] for curve in curves.values()]
    assert distances == pytest.approx([0.177, 0.152, 0.151, 0.107], abs=2e-3)
    data = campaign.read("swims")
    circle = campaign.CIRCLE
    one = (data["scene"] == circle) & (data["amplitude"] == 1.0)
    one &= data["frequency_Hz"] == 1.0
    distance = np.hypot(data["x_BL"], data["y_BL"])
    means = [distance[one & (data["bed"] == bed)].mean() for bed in (1, 2, 3)]
    expected = (np.mean(means), np.std(means, ddof=1) / np.sqrt(3))
    assert numbers["swims"][circle, 1.0, 1.0] == pytest.approx(expected)
    lift = numbers["lift"]
    assert lift["round"]["grains"] == pytest.approx(0.43, abs=0.1)
    across, along = (numbers["reversal"][0.0245, psi, "flank"] for psi in (90, 0))
    ratio = along["travel"][0] / across["travel"][0]
    found = (across["at_once"][0], along["at_once"][0], ratio)
    assert found == pytest.approx((AT_ONCE, AT_ONCE_ALONG, RATIO), abs=0.006)
    for way in numbers["after_reversal"].values():
        assert np.sqrt(np.mean((way["grains"] - way["law"]) ** 2)) < 0.11
    numbers["others"] = {}
    circles = beds_figure.draw(numbers).axes[0]
    drawn = circles.lines[2].get_ydata()
    np.testing.assert_array_equal(drawn, curves["direct"]["distance"])
    assert "circle 1 rad" in beds_figure.table(numbers)


def test_rows_of_a_bar_in_grains_add_up_to_it():
    rows = campaign.read("faces")
    lift = campaign.read("lift")
    for key in ("drag_N", "lift_N"):
        sums = [
            rows[key][(rows["shape"] == shape) & (rows["bed"] == bed)].sum()
            for shape, bed in zip(lift["shape"], lift["bed"])
        ]
        # Blocks of a mean differ by a sample.
        np.testing.assert_allclose(sums, lift[key], rtol=0, atol=4e-4)


def test_plates_in_grains_stand_beside_bars_and_the_map():
    """Grains press where the map pulls."""
    numbers = plates_figure.compute()
    bar = numbers["bar"]
    maps = numbers["maps"]
    # At one depth for all rows the lift is that of the map for a rod.
    depth = campaign.BAR_DEPTH + campaign.BAR * np.cos(bar["beta"])
    deep = bar | {"weight": bar["weight"] / depth}
    stress = face_stress(StressMap(tension="keep"), plates_figure.BETA)
    lift = plates_figure.lift_over_drag(deep, plates_figure.BETA, *stress)
    assert lift == pytest.approx(0.81, abs=0.01)
    pulls = maps["keep"]["normal"] < 0
    assert np.degrees(plates_figure.BETA[pulls].min()) == pytest.approx(144, abs=1)
    assert not maps["cut"]["normal"][pulls].any()
    assert bar["normal"][bar["beta"] > np.radians(143)].min() > 0.009  # N/cm^3
    assert maps["cut"]["misfit"][1] < 0.75 * maps["keep"]["misfit"][1]
    halves = numbers["bars"]["half round"]["faces"]
    assert halves == pytest.approx((-0.62, 0.03), abs=0.01)


CHAIN = """[medium]
name = "glass-0.3mm-loose"
[body]
kind = "chain"
length = 0.2
[gait]
kind = "circle"
[[effects]]
kind = "end-caps"
radius_m = 0.01
"""
BARE = CHAIN.replace("length = 0.2\n", "").replace("radius_m = 0.01", "radius = 0.05")


@pytest.mark.parametrize(
    ("text", "given", "size", "radius"),
    [
        (CHAIN, {}, 0.2, 0.01),
        (CHAIN.partition("[[effects]]")[0], {}, 0.2, 6e-3),
        (BARE.partition("[[effects]]")[0], {}, 0.162, 6e-3),
        (BARE, {"size": 0.3}, 0.3, 0.015),
        (BARE, {"size": 0.3, "radius": 0.02}, 0.3, 0.02),
    ],
)
def test_sizes_of_a_swimmer_are_those_given_or_the_scenes(text, given, size, radius):
    """In a bed that is wide and deep enough."""
    study = grain_swim.GrainSwim(scenes.parse(text), 3, 7, **given)
    one = study.experiment
    assert (one.body.size, one.body.half_width) == pytest.approx((size, radius))
    depth = max(0.049, 2 * radius + 6 * one.bed.diameter)
    bed = (one.bed.length, one.bed.width, one.bed.depth)
    assert bed == pytest.approx((size + 0.118, size + 0.078, depth))
    assert (one.bed.seed, study.frequency, one.duration) == (7, 1.0, 3.5)


def test_the_back_end_does_not_depend_on_what_a_store_holds():
    """Else the last digits of the tiers beside grains differ when a run is resumed."""

    def chosen(steps):
        prefer("numpy")
        prefer_for(grains.GrainSteps(steps, steps / grains.RATE, 0.0).numpy_seconds)
        return preferred()

    first, resumed = (contextvars.copy_context().run(chosen, n) for n in (10**12, 0))
    assert first == resumed == "numpy"
