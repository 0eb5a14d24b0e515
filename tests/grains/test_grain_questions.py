"""Questions to grains: the drag of flank and ends becomes a law, a scene's swimmer a
table, without LAMMPS."""

import dataclasses

import beds
import numpy as np
import pytest
from tabled import tabled

from figures.grains import beds as beds_figure
from figures.grains import plates as plates_figure
from figures.grains.campaigns import grains as campaign
from figures.paper.fig08a_rods import face_stress
from geomech import scenes
from geomech.core.variables import Variable
from geomech.questions.grains.drag_grains import DragGrains
from geomech.questions.grains.grains import Grains
from geomech.questions.measured.fit_medium import FitMedium
from geomech.scenes.data import drag
from geomech.studies.grains import swim as grain_swim
from geomech.studies.grains.drag import mean_over_beds
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


def ends():
    """Return forces (2, N), N, on both ends of the rod."""
    caps = EndCaps(ROD.radius / ROD.length, head=1.7, tail=0.0, across=0.8)
    return 0.4 * np.array(caps.traction(LAW, *WAY))


@pytest.mark.parametrize("beds_drawn", [1, 3])
def test_the_error_of_a_mean_over_beds_is_that_of_its_scatter_or_of_the_one_bed(
    beds_drawn,
):
    values = np.random.default_rng(1).normal(size=(2, beds_drawn, 4))
    dims = ("component", "bed", "attack_angle")
    drags = Variable("flank", dims, values, "N/m", error=0.1 + 0 * values)
    found = mean_over_beds(drags)
    np.testing.assert_allclose(found.values, values.sum(1) / beds_drawn)
    errors = np.full((2, 4), 0.1)
    if beds_drawn == 3:
        a, b, c = np.moveaxis(values, 1, 0)
        errors = np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 18)
    np.testing.assert_allclose(found.error, errors)


def test_flank_and_ends_give_the_law_and_its_caps():
    found = fit("granular", rod_drag(PSI, *FLANK, ends=ends()), ROD, "fitted")
    assert found.names == ("C", "gamma0", "k", "end_caps", "end_caps_across")
    k = 0.4 / ROD.area / ROD.pressure
    np.testing.assert_allclose(found.values, [3.1, 0.3, k, 1.7, 0.8], rtol=1e-5)
    half = found.end_caps / 2
    assert found.caps(0.04) == EndCaps(0.04, half, half, found.values[-1])
    np.testing.assert_allclose(found.forces(np.radians(PSI)), FLANK, rtol=1e-5)
    back = np.array([[-1], [1]])
    mirrored = rod_drag(180 - PSI, *(back * FLANK), ends=back * ends())
    folded = fit("granular", mirrored, ROD, "fitted")
    np.testing.assert_allclose(folded.values, found.values, rtol=1e-6)


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
    np.testing.assert_allclose(flank[0, :, 0], [2.0, 2.1], rtol=1e-6)
    law = dict(zip(result["parameter"].values, result["value"].values))
    found = [law["C"], law["gamma0_deg"], law["end_caps"]]
    np.testing.assert_allclose(found, [3.1, np.degrees(0.3), 1.7], rtol=2e-3)
    mean = result["mean_flank"]
    np.testing.assert_allclose(mean.values, flank.mean(1))
    np.testing.assert_allclose(mean.error, np.abs(np.diff(flank, axis=1))[:, 0] / 2)


def test_a_drag_is_a_file_that_fit_medium_reads(obeyed, tmp_path):
    result = question(tmp_path).ask()
    path = tmp_path / "drag.csv"
    result.save(path)
    read = drag.read(path)
    sizes = {"radius": 0.007, "length": 0.18, "depth": 0.0255, "density": 618.0}
    assert read.sizes == pytest.approx(sizes)
    flank = 0.18 * result["flank"].values.reshape(2, -1)
    np.testing.assert_allclose(read.rows[1:3], flank, atol=6e-5)
    fitted = FitMedium(path, end_caps="fitted").ask()
    assert "Both ends together" in fitted.attributes["medium_toml"]


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
    end = 0.4 * 1.25 + 0.3
    last = [result[name].values[-1] for name in ("t", "frame_x", "frame_heading")]
    np.testing.assert_allclose(last, [1.25, 0.1201 * np.sin(end), end], rtol=2e-3)
    x = result["cycle_x"].values
    y = result["cycle_y"].values
    np.testing.assert_allclose(np.hypot(x, y), 0.08, rtol=1e-6)
    np.testing.assert_allclose(y, 0.08 * np.sin(0.1), rtol=1e-3)
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


def test_what_comes_back_after_a_reversal_is_that_of_the_effect():
    """In the figure of grains, which is drawn from its numbers."""
    numbers = beds_figure.compute([1.0], others=[], travels=[])
    across, along = (numbers["reversal"][0.0245, psi, "flank"] for psi in (90, 0))
    ratio = along["travel"][0] / across["travel"][0]
    found = (across["at_once"][0], along["at_once"][0], ratio)
    assert found == pytest.approx((AT_ONCE, AT_ONCE_ALONG, RATIO), abs=0.006)
    circles = beds_figure.draw(numbers).axes[0]
    drawn = circles.lines[2].get_ydata()
    np.testing.assert_array_equal(drawn, numbers["curves"]["direct"]["distance"])


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
    assert maps["cut"]["misfit"][1] < 0.75 * maps["keep"]["misfit"][1]


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
