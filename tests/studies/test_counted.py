"""Counted beforehand: the force balances of every tier, table, error, motion and sweep
are those that are solved, and a search solves no more."""

import dataclasses
import tracemalloc

import numpy as np
import pytest

from geomech import scenes
from geomech.mathematics.gaits import Fourier, Wave
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.tiers import TIERS
from geomech.questions.shared.base import Run as AskedRun
from geomech.questions.swimmers.accuracy import Accuracy
from geomech.questions.swimmers.ccf import Ccf
from geomech.questions.swimmers.connection import Connection
from geomech.questions.swimmers.displacement import Displacement
from geomech.questions.swimmers.run import Run
from geomech.questions.swimmers.sweep import Sweep
from geomech.runs.cost import BASE
from geomech.scenes import Scene
from geomech.studies.estimates import cost, effort
from geomech.studies.mechanics import motion
from geomech.studies.optimisation import build_request, search
from geomech.studies.scene_tables import SceneTables
from rft import Backbone, Chain, Viscous
from rft.balance.listening import listening
from rft.effects import SkinFriction, Slope, Transient

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass")
VISCOUS = scenes.load("three-link-viscous")
FIVE_LINKS = GLASS.text.partition("[gait]")[0].replace(
    "[1, 1, 1]", "[1, 1.2, 1, 0.8, 1]"
)
FIVE_LINKS += '[gait]\nkind = "wave"\njoints = 4\namplitude = 0.4\n'
FIVE = scenes.parse(FIVE_LINKS).with_numerics(grid=4, directions=16)
SANDFISH = scenes.load("sandfish-loose")
STEPS = SANDFISH.changed(
    body=Backbone(10),
    gait=dataclasses.replace(SANDFISH.gait, elements=10),
    effects=(Transient(travel=0.1),),
).with_numerics(phases=32, cycles=2)
SKIN = GLASS.changed(effects=(SkinFriction(0.109, 0.137, 1.0),))
SKIN = SKIN.with_numerics(grid=7, pieces=5)
PLACE = GLASS.changed(effects=(Slope(0.3, 2.0, 0.6, 0.3),)).with_numerics(phases=32)
FIFTH = Fourier(
    cos=((0.6, 0, 0.1, 0, 0.05), (0,) * 5), sin=((0,) * 5, (0.6, 0, -0.1, 0, 0.05))
)
UNSURE = dataclasses.replace(GLASS.system.medium, covariance=((0.01, 0.0), (0.0, 4e-4)))


def framed(scene):
    return SceneTables(scene).in_frame("minimum-perturbation").scene


@pytest.fixture
def solved():
    """The numbers of force balances that are solved."""
    counts = []
    with listening(lambda samples, points, linear: counts.append(samples)):
        yield counts


FOUR = ("area", "path", "harmonic", "direct")
TIERS_OF = {
    "tables": (GLASS.with_numerics(grid=9), FOUR),
    "no shape in the middle": (GLASS.with_numerics(grid=8), FOUR),
    "errors alone": (GLASS.with_numerics(grid=9, phases=40), ("path",)),
    "a family": (GLASS.with_numerics(grid=9, curves=5), ("adapted", "direct")),
    "four joints": (FIVE, ("path", "direct")),
    "four joints, errors alone": (FIVE, ("path",)),
    "few phases of a harmonic": (
        GLASS.changed(gait=FIFTH).with_numerics(phases=64),
        ("direct",),
    ),
    "around the gait": (
        FIVE.with_numerics(grid=15, phases=16),
        ("area", "path", "direct"),
    ),
    "linear": (VISCOUS, FOUR),
    "by a rule": (VISCOUS.with_numerics(loads="midpoint:3"), ("direct",)),
    "pieces": (SKIN, FOUR),
    "a backbone": (
        scenes.load("shovel-nosed-snake").with_numerics(phases=64),
        ("direct",),
    ),
    "a frame": (framed(GLASS.with_numerics(grid=9)), ("harmonic", "direct")),
    "a frame in sand that is not known": (
        framed(GLASS.with_numerics(grid=7).changed(medium=UNSURE)),
        ("direct",),
    ),
    "time stepping": (STEPS, ("direct",)),
    "place": (PLACE, ("direct",)),
}


@pytest.mark.parametrize("name", TIERS_OF)
def test_tiers_take_the_balances_foretold(name, solved):
    scene, tiers = TIERS_OF[name]
    foretold = SceneTables(scene).cost([0.1, 0.2, 0.3], tiers).balances
    SceneTables(scene).displacements([0.1, 0.2, 0.3], tiers)
    assert foretold == sum(solved)


@pytest.mark.parametrize("tier", TIERS)
@pytest.mark.parametrize("scene", [GLASS, VISCOUS, SKIN])
def test_a_plan_takes_its_balances(scene, tier, solved):
    tables = SceneTables(scene.with_numerics(grid=7, phases=32))
    amplitudes = np.array([0.2, 0.3])
    plan = tables.plan(tier, amplitudes=amplitudes)
    solved.clear()
    tables.poses(tier, amplitudes=amplitudes)
    assert cost.n_balances(plan, 2, 32) == sum(solved)


@pytest.mark.parametrize(("scene", "starts"), [(GLASS, 2), (VISCOUS, 1)])
def test_a_search_takes_at_most_the_balances_foretold(scene, starts, solved):
    few = scene.with_numerics(grid=7, phases=32)
    request = build_request(few, "displacement", harmonics=1, starts=starts)
    foretold = request.cost().balances
    search(request)
    assert sum(solved) <= foretold <= 20 * sum(solved)


@pytest.mark.parametrize("scene", [GLASS, SKIN, STEPS])
def test_what_moving_costs_takes_the_balances_foretold(scene, solved):
    foretold = cost.total_cost(cost.effort_jobs(scene, 3)).balances
    effort.effort(scene, None, [0.1, 0.2, 0.3])
    assert foretold == sum(solved)


@pytest.mark.parametrize(
    ("scene", "cycles"), [(GLASS, 3), (PLACE, 3), (PLACE.with_numerics(cycles=2), 2)]
)
def test_a_motion_takes_the_balances_foretold(scene, cycles, solved):
    foretold = motion.cost(scene, cycles).balances
    motion.compute_motion(scene, cycles)
    assert foretold == sum(solved)


TABLES = {
    "connection": (cost.connection_jobs, lambda tables: tables.fitted),
    "harmonics": (cost.harmonic_jobs, lambda tables: tables.compute_harmonics()),
    "metric": (cost.metric_jobs, lambda tables: tables.metric),
    "even part": (cost.even_part_jobs, lambda tables: tables.even_part),
    "plane": (
        lambda s: cost.plane_jobs(s, [(0, 1)], [s.gait.middle]),
        lambda tables: tables.plane((1, 2)),
    ),
}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("grid", [7, 8])
@pytest.mark.parametrize("scene", [GLASS, VISCOUS, SKIN])
def test_a_table_takes_the_balances_foretold(scene, grid, name, solved):
    scene = scene.with_numerics(grid=grid)
    jobs, compute = TABLES[name]
    tables = SceneTables(scene)
    if name == "even part":
        tables.compute_field()  # on whose grid it is
    if name == "metric" and effort.why_no_metric(scene.system):
        pytest.skip("it has none")
    solved.clear()
    compute(tables)
    assert sum(solved) == cost.total_cost(jobs(scene)).balances


COARSE = {"grid": 7, "phases": 32}
FOUR_LINKS = Scene(Swimmer(Viscous(), Chain((1, 1, 1, 1))), Wave(joints=3))
MEDIA = {"medium.ratio": [2.0, 3.0], "gait.amplitude": [0.5, 1.0, 1.5]}
QUESTIONS = {
    "accuracy": Accuracy(VISCOUS.with_numerics(grid=5)),
    "sweep of media": Sweep(VISCOUS, MEDIA),
    "sweep of effects": Sweep(SKIN, {"effects.skin-friction.backward": [0.2, 0.3]}),
    "map and another frame": Ccf(GLASS.with_numerics(**COARSE), compare_frame="link-1"),
    "linear map": Ccf(VISCOUS.with_numerics(**COARSE), compare_frame="link-1"),
    "slice": Ccf(GLASS.with_numerics(**COARSE), "1,2"),
    "linear slice": Ccf(VISCOUS.with_numerics(**COARSE), "1,2"),
    "all of a scene": Run(VISCOUS.with_numerics(grid=9, phases=32)),
    "all of three joints": Run(FOUR_LINKS.with_numerics(grid=5, phases=16)),
}


@pytest.mark.parametrize("name", QUESTIONS)
def test_a_question_takes_the_balances_foretold(name, solved):
    question = QUESTIONS[name]
    question.check()
    foretold = question.cost().balances
    solved.clear()
    question.ask()
    assert foretold == sum(solved)


def test_what_moving_costs_is_told_and_counted_with_a_tolerance_as_without(solved):
    options = {"amplitudes": (0.3, 0.6), "effort": True}
    allowed = []
    within = Displacement(VISCOUS, tolerance=0.01, **options)
    found = within.compute(AskedRun(allow=allowed.append))
    assert sum(solved) <= sum(each.balances for each in allowed)
    full = Displacement(VISCOUS, tiers=("direct",), **options).ask()
    for name in ("work", "path_length"):
        np.testing.assert_array_equal(found[name].values, full[name].values)


@pytest.mark.parametrize("name", ["a.nc", "a.mat"])
def test_a_file_of_a_connection_takes_no_more_balances(name, solved, tmp_path):
    path = tmp_path / name
    question = Connection(VISCOUS.with_numerics(**COARSE)).for_files([path], {})
    foretold = question.cost().balances
    solved.clear()
    question.ask().save(path)
    assert foretold == sum(solved)


def test_memory_is_foretold_too_large_rather_than_too_small():
    """Of gaits that fill a batch, beside what is in memory anyway."""
    scene = GLASS.with_numerics(phases=4096)
    foretold = cost.direct_jobs(scene, scene.gait, 40, 4096)[0].memory - BASE
    tracemalloc.start()
    try:
        SceneTables(scene).displacements(np.linspace(0.1, 1, 40), ["direct"])
        used = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert used < foretold < 6 * used
