"""Counted beforehand: the force balances of every tier, table, error, motion and sweep are those that are solved."""

import dataclasses
import tracemalloc

import numpy as np
import pytest
from tabled import swept_table, tabled

import geomech
from geomech import scenes
from geomech.mathematics.gaits import Fourier
from geomech.mathematics.tiers import TIERS
from geomech.questions.swimmers.accuracy import Accuracy
from geomech.questions.swimmers.ccf import Ccf
from geomech.questions.swimmers.run import Run
from geomech.run.cost import BASE
from geomech.studies.displacement import sweep
from geomech.studies.estimates import cost, effort
from geomech.studies.mechanics import motion
from geomech.studies.scene_tables import SceneTables
from rft import Chain, body_velocity
from rft.balance.listening import listening
from rft.effects import SkinFriction, Slope

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass")
VISCOUS = scenes.load("three-link-viscous")
SLOPING = scenes.parse(
    scenes.load("sandfish-loose")
    .text.partition("[[effects]]")[0]
    .replace("elements = 100", "elements = 10")
    + '\n[[effects]]\nkind = "transient"\ntravel = 0.1'
)
FIVE_LINKS = (
    GLASS.text.partition("[gait]")[0].replace("[1, 1, 1]", "[1, 1.2, 1, 0.8, 1]")
    + '[gait]\nkind = "wave"\njoints = 4\namplitude = 0.4\n'
)
FIVE = scenes.parse(FIVE_LINKS)


@pytest.fixture
def solved():
    """Counts the force balances that are solved."""
    counts = []
    with listening(lambda samples, points, linear: counts.append(samples)):
        yield counts


SKIN = GLASS.changed(effects=(SkinFriction(0.109, 0.137, 1.0),)).with_numerics(
    grid=7, pieces=5
)
SNAKE = scenes.load("shovel-nosed-snake").with_numerics(phases=64)
FIFTH = Fourier(
    cos=((0.6, 0, 0.1, 0, 0.05), (0,) * 5), sin=((0,) * 5, (0.6, 0, -0.1, 0, 0.05))
)
UNSURE = dataclasses.replace(GLASS.system.medium, covariance=((0.01, 0.0), (0.0, 4e-4)))
FRAMED = (
    SceneTables(GLASS.with_numerics(grid=7).changed(medium=UNSURE))
    .in_frame("minimum-perturbation")
    .scene
)
FOUND = {
    "tables": (GLASS.with_numerics(grid=9), ("area", "path", "harmonic", "direct")),
    "no shape in the middle": (
        GLASS.with_numerics(grid=8),
        ("area", "path", "harmonic", "direct"),
    ),
    "errors alone": (GLASS.with_numerics(grid=9, phases=40), ("path",)),
    "a family": (GLASS.with_numerics(grid=9, curves=5), ("adapted", "direct")),
    "four joints": (FIVE.with_numerics(grid=4, directions=16), ("path", "direct")),
    "four joints, errors alone": (FIVE.with_numerics(grid=4, directions=16), ("path",)),
    "few phases of a harmonic": (
        GLASS.changed(gait=FIFTH).with_numerics(phases=64),
        ("direct",),
    ),
    "around the gait": (
        FIVE.with_numerics(grid=15, directions=16, phases=16),
        ("area", "path", "direct"),
    ),
    "linear": (VISCOUS, ("area", "path", "harmonic", "direct")),
    "by a rule": (VISCOUS.with_numerics(loads="midpoint:3"), ("direct",)),
    "pieces": (SKIN, ("area", "path", "harmonic", "direct")),
    "a backbone": (SNAKE, ("direct",)),
    "a frame": (
        SceneTables(GLASS.with_numerics(grid=9)).in_frame("minimum-perturbation").scene,
        ("harmonic", "direct"),
    ),
    "a frame in sand that is not known": (FRAMED, ("direct",)),
    "time stepping": (SLOPING.with_numerics(phases=32, cycles=2), ("direct",)),
    "place": (
        GLASS.changed(effects=(Slope(0.3, 2.0, 0.6, 0.3),)).with_numerics(phases=32),
        ("direct",),
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_the_balances_foretold_are_those_solved(name, solved):
    scene, tiers = FOUND[name]
    foretold = SceneTables(scene).cost([0.1, 0.2, 0.3], tiers).balances
    tabled(SceneTables(scene).displacements([0.1, 0.2, 0.3], tiers))
    assert foretold == sum(solved)


@pytest.mark.parametrize(
    "scene", [GLASS, SKIN, SLOPING.with_numerics(phases=32, cycles=2)]
)
def test_what_moving_costs_takes_the_balances_foretold(scene, solved):
    foretold = cost.total_cost(cost.effort_jobs(scene, 3)).balances
    effort.effort(scene, None, [0.1, 0.2, 0.3])
    assert foretold == sum(solved)


PLACE = FOUND["place"][0]


@pytest.mark.parametrize(
    ("scene", "cycles"), [(GLASS, 3), (PLACE, 3), (PLACE.with_numerics(cycles=2), 2)]
)
def test_a_motion_takes_the_balances_foretold(scene, cycles, solved):
    foretold = motion.cost(scene, cycles).balances
    motion.compute_motion(scene, cycles)
    assert foretold == sum(solved)


TABLES = {
    "connection": (cost.connection_jobs, lambda study: study.fitted),
    "harmonics": (cost.harmonic_jobs, lambda study: study.compute_harmonics()),
    "metric": (cost.metric_jobs, lambda study: study.metric),
    "even part": (cost.even_part_jobs, lambda study: study.even_part),
    "plane": (
        lambda s: cost.plane_jobs(s, [(0, 1)], [s.gait.middle]),
        lambda study: study.plane((0, 1)),
    ),
}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("grid", [7, 8])
@pytest.mark.parametrize("scene", [GLASS, VISCOUS, SKIN])
def test_a_table_takes_the_balances_foretold(scene, grid, name, solved):
    scene, (jobs, compute) = scene.with_numerics(grid=grid), TABLES[name]
    study = SceneTables(scene)
    if name == "even part":
        study.compute_field()  # on whose grid it is
    if name == "metric" and effort.why_no_metric(scene.system):
        pytest.skip("it has none")
    solved.clear()
    compute(study)
    assert sum(solved) == cost.total_cost(jobs(scene)).balances


def test_accuracy_and_sweep_say_what_they_cost(solved):
    scene = VISCOUS.with_numerics(grid=5)
    foretold = Accuracy(scene).cost().balances
    geomech.accuracy(scene)
    assert foretold == sum(solved)
    media = {"medium.ratio": [2.0, 3.0], "gait.amplitude": [0.5, 1.0, 1.5]}
    for scene, over in (
        (VISCOUS, media),
        (SKIN, {"effects.skin-friction.backward": [0.2, 0.3]}),
    ):
        foretold = sweep.Plan(scene, over).cost.balances
        solved.clear()
        swept_table(sweep.sweep(scene, over))
        assert foretold == sum(solved)


def test_a_balance_that_is_tried_twice_is_one(solved):
    """From starts of which all, some and none lead to the solution."""
    rng = np.random.default_rng(3)
    alpha, alphadot = rng.uniform(-1, 1, (2, 12, 2))
    answer = body_velocity(VISCOUS.system.medium, Chain(), alpha, alphadot).xi
    for start in (
        answer,
        np.where(np.arange(12)[:, None] < 6, answer, np.nan),
        1e7 * answer,
        None,
    ):
        solved.clear()
        body_velocity(GLASS.system.medium, Chain(), alpha, alphadot, start=start)
        assert sum(solved) == 12


@pytest.mark.parametrize("scene", [GLASS, VISCOUS])
@pytest.mark.parametrize(
    "question",
    [
        lambda s: Ccf(s, compare_frame="link-1"),
        lambda s: Ccf(s, "1,2"),
    ],
    ids=["map with gait and another frame", "slice"],
)
def test_a_map_takes_the_balances_foretold(scene, question, solved):
    asked = question(scene.with_numerics(grid=7))
    asked.check()
    foretold = asked.cost().balances
    solved.clear()
    asked.ask()
    assert foretold == sum(solved)


def test_all_of_a_scene_takes_as_much_as_foretold(solved):
    scene = VISCOUS.with_numerics(grid=9, phases=32)
    Run(scene).ask()
    assert Run(scene).cost().balances == sum(solved)


def test_memory_is_foretold_too_large_rather_than_too_small():
    """Of gaits that fill a batch, beside what is in memory anyway."""
    scene, amplitudes = GLASS.with_numerics(phases=4096), np.linspace(0.1, 1, 40)
    told = cost.direct_jobs(scene, scene.gait, len(amplitudes), 4096)[0].memory - BASE
    tracemalloc.start()
    try:
        tabled(SceneTables(scene).displacements(amplitudes, ["direct"]))
        used = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert used < told < 6 * used


def test_a_look_up_reads_the_numbers_of_the_nodes_around():
    """3 d at each of (degree + 1)^d nodes; of harmonics 3 for each of their terms, cosine and sine of 1, 3 and 5."""
    for scene, tier, count in (
        (FIVE, "path", 3 * 4 * 3**4),
        (GLASS, "path", 54),
        (GLASS, "harmonic", 3 * 6 * 9),
    ):
        numerics = scene.with_numerics(grid=4, interpolation=2, harmonics=5).numerics
        plan = TIERS[tier].plan(scene.system, numerics, scene.gait, None)
        assert (plan.read, plan.balances(3, 64)) == (count, 0)
