"""Sweeps over a scene's parameters: right at every point, in as few batches as may
be."""

import itertools

import numpy as np
import pytest
from refusals import refuses
from tabled import swept_table

from geomech import scenes
from geomech.scenes import kinds
from geomech.studies import grid
from geomech.studies.displacement import sweep
from geomech.studies.estimates import estimate
from rft import CATALOGUE, Chain, Granular

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass").with_numerics(phases=32)
SANDFISH = scenes.load("sandfish-loose")
PLAIN = SANDFISH.text.partition("[[effects]]")[0].replace("= 100", "= 16")


def swept(scene, over):
    return swept_table(sweep.sweep(scene, over))


def net(scene, amplitude=None):
    amplitudes = np.array([amplitude or scene.gait.amplitude])
    poses, _ = estimate.direct(scene, scene.gait, amplitudes, scene.numerics.phases)
    return poses[0]


def with_effects(*effects):
    """Return a coarse fish with effects, as TOML without its first line."""
    text = "".join(f"\n[[effects]]\nkind = {effect}" for effect in effects)
    return scenes.parse(PLAIN + text)


def test_every_point_is_the_scene_there():
    over = {"gait.amplitude": [0.5, 1.0, 1.5], "body.length": [1.0, 2.0]}
    found = swept(GLASS, over)
    assert found["displacement"].shape == (3, 2, 3)
    twice = GLASS.changed(body=Chain(length=2.0))
    poses, errors = estimate.direct(twice, twice.gait, np.array([1.5]), 32)
    np.testing.assert_allclose(found["displacement"][2, 1], poses[0], atol=1e-12)
    np.testing.assert_allclose(found["estimate"][2, 1], 2 * errors[0, 0], rtol=1e-6)


def test_parameters_of_a_medium_given_by_name_can_be_swept():
    """As if its law stood in the scene; what is not swept stays that of the name."""
    head, _, rest = GLASS.text.partition("[medium]")
    body = rest.partition("[body]")[2]
    text = f'{head}[medium]\nname = "glass-0.3mm-close"\n[body]{body}'
    scene = scenes.parse(text).with_numerics(phases=32)
    found = swept(scene, {"medium.gamma0_deg": [10.0, 20.0]})["displacement"]
    C = CATALOGUE["glass-0.3mm-close"].medium.C
    alone = GLASS.changed(medium=Granular(C=C, gamma0=np.radians(20.0)))
    np.testing.assert_allclose(found[1], net(alone), rtol=1e-9, atol=1e-12)


OWN = """
import math
from dataclasses import dataclass
from rft.laws import TermLaw
from rft.effects import Effect

@dataclass(frozen=True)
class Steps(TermLaw):
    C: float = 1.0
    law = "own-sum"

    @property
    def dry(self):
        q = 0.1 if self.C < 1 else 0.3
        return (1.0, 1.0, 1.0), (q, 0.0, self.C * math.sqrt(1 - q * q))

@dataclass(frozen=True)
class Power:
    power: float = 0.0
    law = "own-law"

    def traction(self, v_t, v_n, eps=0.0):
        factor = (v_t**2 + v_n**2 + eps**2) ** (0.5 * self.power)
        return factor * v_t, (2.0 if self.power > 0 else 3.0) * factor * v_n

@dataclass(frozen=True)
class Heavier(Effect):
    kind = "own-effect"

    def apply(self, problem, site=None, state=None):
        across = 1.0 + math.sqrt(problem.medium.C)
        return problem._replace(sides=problem.sides.with_factors(1.0, 1.0, across))
"""


GRAINS = '"grain-inertia"\nfrequency = 1.0\nlength = 0.1\ndepth = 0.05'
SAND = '"granular"\nC = 1.8\ngamma0 = 0.24'
CAPS = '"end-caps"\nradius = 0.05'
MEDIA = {
    "granular": (SAND, "", {"C": [0.0, 1.8, 40.0], "gamma0_deg": [3.0, 30.0]}),
    "viscous": ('"viscous"', "", {"ratio": [1.0, 2.0, 50.0]}),
    "surface": (
        '"surface"\nC = 1\ngamma0 = 0.1\nacross = 1',
        "",
        {"across": [0.5, 9.0]},
    ),
    "end caps": (SAND, CAPS, {"C": [0.0, 1.8], "gamma0": [0.1, 0.3]}),
    "grains' k": (SAND, GRAINS, {"k": [1.0, 3.0]}),
    "own sum": ('"own-sum"', "", {"C": [0.5, 1.5, 3.0]}),
    "own law": ('"own-law"', "", {"power": [-0.5, 0.3]}),
    "own effect": (SAND, '"own-effect"', {"C": [0.0, 1.8]}),
}


@pytest.mark.parametrize("name", MEDIA)
def test_a_medium_of_a_sweep_is_as_it_is_alone(name, solved_by, tmp_path, own_parts):
    """Whether it shares a batch or cannot, inside or outside of another parameter."""
    file = tmp_path / "own.py"
    file.write_text(OWN)
    kinds.load_file(file)
    law, effect, numbers = MEDIA[name]
    text = f'[medium]\nlaw = {law}\n[body]\nkind = "chain"\n[gait]\nkind = "circle"'
    if effect:
        text += f"\n[[effects]]\nkind = {effect}"
    scene = scenes.parse(text, "own").with_numerics(phases=32)
    media = {f"medium.{key}": values for key, values in numbers.items()}
    pieces = {"numerics.regularisation": [1e-5, 1e-6], "gait.amplitude": [0.4, 0.8]}
    for over in (media | pieces, pieces | media):
        together = swept(scene, over)
        shape = together["estimate"].shape
        for k in itertools.islice(np.ndindex(shape), None, None, 3):
            point = {key: [values[i]] for (key, values), i in zip(over.items(), k)}
            alone = swept(scene, point)
            for column in ("displacement", "estimate"):
                one = alone[column].reshape(together[column][k].shape)
                np.testing.assert_allclose(together[column][k], one, atol=1e-12)
        assert np.ptp(together["displacement"][..., 0]) > 1e-4


def test_effects_and_whole_numbers_can_be_swept():
    over = {"effects.end-caps.radius": [0.0, 0.1], "numerics.phases": [32, 64]}
    found = swept(SANDFISH, over)["displacement"]
    assert (found[0, :, 0] > found[1, :, 0]).all()


INERTIA = '"body-inertia"\nmass = 0.02\nfrequency = 1.0\nlength = 0.1\ndrag = 1.0'
GROUND = '"disturbed-ground"\nradius = 0.05\nweakening = 0.0'
BATCHES = {
    "gait.waves": ((), [0.8, 1.0, 1.5]),
    "effects.skin-friction.forward": (['"skin-friction"'], [0.05, 0.1, 0.2]),
    "effects.body-inertia.frequency": ([INERTIA], [0.0, 5.0]),
    "effects.grain-inertia.frequency": ([GRAINS], [0.0, 2.0, 5.0]),
    "effects.transient.travel": (['"transient"\ntravel = 0.1'], [0.05, 0.1]),
    "effects.disturbed-ground.weakening": ([GROUND], [0.05, 0.1]),
    "effects.depth-profile.slope": (['"depth-profile"\nslope = 0.1'], [0.05, 0.1]),
}


@pytest.mark.parametrize("key", BATCHES)
def test_points_that_differ_in_gait_and_effects_go_side_by_side(key):
    effects, values = BATCHES[key]
    fish = with_effects(*effects).with_numerics(phases=12, pieces=4)
    if "body-inertia" not in key:  # which settles
        fish = fish.with_numerics(cycles=1)
    over = {key: values, "gait.amplitude": [0.1, 0.2]}
    together = swept(fish, over)
    alone = swept(fish, {key: values[-1:], "gait.amplitude": [0.2]})
    poses = together["displacement"]
    assert np.abs(poses[-1, -1] - poses[0, 0]).max() > 1e-4
    # Side by side all settle before any stops; the rest is roundoff.
    np.testing.assert_allclose(poses[-1, -1], alone["displacement"][0, 0], atol=2e-6)


def test_a_level_ground_is_no_gentle_slope():
    """Without a slope cycles become periodic, with one there is one cycle: they do not
    share a batch."""
    travel = '"transient"\ntravel = 0.03'
    coarse = {"phases": 8, "pieces": 3}
    fish = with_effects(travel, '"depth-profile"\nslope = 0.0').with_numerics(**coarse)
    found = swept(fish, {"effects.depth-profile.slope": [0.0, 0.05]})["displacement"]
    level = net(with_effects(travel).with_numerics(**coarse))
    np.testing.assert_allclose(found[0], level, atol=2e-6)


def test_a_scene_changed_since_it_was_read_is_swept_as_it_is():
    fish = SANDFISH.with_numerics(phases=32)
    plain = fish.changed(effects=())
    over = {"gait.amplitude": [0.1], "medium.C": [1.8, 3.0]}
    found = swept(plain, over)["displacement"][0, 0]
    np.testing.assert_allclose(found, net(plain, 0.1), atol=1e-9)


BOTH = with_effects(
    INERTIA.replace("1.0\nlength", "3.0\nlength"), GRAINS.replace("1.0", "3.0")
)


def test_one_frequency_is_that_of_all_effects():
    both = BOTH.with_numerics(phases=16)
    found = swept(both, {"effects.frequency": [0.0, 3.0, 9.0]})
    np.testing.assert_allclose(found["displacement"][1], net(both), atol=1e-6)


@pytest.mark.parametrize(
    ("scene", "over", "said"),
    [
        (GLASS, {"gait.size": [1.0]}, "size | where instead"),
        (GLASS, {"gait": [1.0]}, "over gait parameter gait. | where"),
        (GLASS, {"effects.end-caps.radius": [0.1]}, "effect end-caps | where instead"),
        (GLASS, {"body.length": [1.0, -1.0]}, "length number | where value"),
        (GLASS, {}, "over 1"),
        (
            BOTH,
            {"effects.grain-inertia.frequency": [2.0]},
            "grain-inertia | where because",
        ),
        (
            BOTH,
            {"body.length": [0.2]},
            "[body] length = 0.2 body-inertia | where because",
        ),
        (BOTH, {"effects.speed": [2.0]}, "effect speed | where instead"),
    ],
)
def test_bad_sweeps_are_refused(scene, over, said):
    with refuses(said):
        sweep.sweep(scene, over)


def test_a_sweep_resumes_from_the_file_that_it_is_given(tmp_path):
    """Which stays until its caller has saved the results."""
    over = {"gait.amplitude": [0.5, 1.0]}
    partial = tmp_path / "p"
    found = swept_table(sweep.sweep(GLASS, over, partial))
    again = swept_table(sweep.sweep(GLASS, over, partial))
    np.testing.assert_array_equal(again["displacement"], found["displacement"])
    assert partial.exists()


OVER = {
    "gait.amplitude": [0.5, 1.0, 1.5],
    "gait.frequency": [1.0, 2.0],
    "body.length": [1.0, 2.0, 3.0, 4.0],
}


def test_rows_find_their_points_whatever_varies_fastest_or_changes_nothing():
    """The amplitude is the innermost, wherever it is given, and a frequency that
    changes no row is computed once."""
    one = grid.Grid(None, OVER, {}, "gait.amplitude", ("gait.frequency",))
    assert one.total == 12
    points = [one.points[k] for k in range(one.points.total)]
    rows = [[10 * length, a, f] for f, length in points for a in one.inner_values]
    amplitude, frequency, length = np.meshgrid(*OVER.values(), indexing="ij")
    expected = np.stack([10 * length, amplitude, 0 * frequency + 1.0], -1)
    np.testing.assert_array_equal(one.arranged(np.array(rows)), expected)


@pytest.mark.parametrize("count", [200, 201, 1000, 1999])
def test_the_least_and_the_largest_of_many_values_are_tried_before_a_sweep(count):
    """Wherever they stand, and of many values not all."""
    values = np.random.default_rng(count).permutation(count).astype(float).tolist()
    over = {"gait.amplitude": [1.0], "body.length": values}
    tried = [*grid.Grid(None, over, {}, "gait.amplitude").corners()]
    assert {(0.0,), (count - 1.0,), (values[0],), (values[-1],)} <= {*tried}
    assert 100 <= len(tried) <= 204


def test_every_value_is_tried_with_the_first_of_the_others():
    one = grid.Grid(None, OVER, {}, "gait.amplitude")
    tried = {*one.corners()}
    assert tried == {(f, x) for f in (1.0, 2.0) for x in (1.0, 4.0)} | {
        (1.0, 2.0),
        (1.0, 3.0),
    }
