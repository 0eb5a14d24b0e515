"""Large requests have the same digits wherever they were stopped, whoever computes
them."""

import contextlib
import dataclasses

import numpy as np
import pytest
from test_runner import calls, resumed, stopped, within
from test_store import same

import geomech
from geomech import scenes
from geomech.mathematics.geometry import connection, metric
from geomech.mathematics.systems import Solver, Swimmer
from geomech.runs import pending, runner
from geomech.runs.executors import Processes
from geomech.studies.displacement import cycles, tiered
from geomech.studies.scene_tables import SceneTables
from geomech.studies.terradynamics import walking
from rft import Backbone, BodyInertia, DisturbedGround, Granular
from rft.terradynamics.walking import engine

GLASS = scenes.load("three-link-glass").with_numerics(grid=5, phases=32, harmonics=3)
VISCOUS = scenes.load("three-link-viscous").with_numerics(grid=5, phases=32)
XPLORER = scenes.load("xplorer")
XPLORER = dataclasses.replace(
    XPLORER,
    numerics=dataclasses.replace(XPLORER.numerics, steps=8, elements=4, duration=0.1),
)
HEAVY = BodyInertia(mass=0.4, frequency=0.7, length=0.3, drag=2.1)
DISTURBED = DisturbedGround(weakening=0.6, radius_m=0.024)
TIMES = {"seconds", "best_setting", "best_value", "best_error", "best_seconds"}
OVER = {
    "body.length": [1.0, 2.0, 3.0],
    "medium.C": [1.5, 2.5],
    "gait.amplitude": [0.4, 0.8, 1.2],
}


def numbers(result):
    """Values and errors of a result, except those of times."""
    kept = [x for x in result.variables if x.name not in TIMES]
    return [(x.values, x.error) for x in kept]


def field(scene):
    tables = SceneTables(scene)
    cost = tables.compute_metric().norm([[0.3, 0.5]], [[1, 2]])
    return [tables.fitted.A, tables.fitted.residual, cost]


def search():
    return numbers(
        geomech.optimize(VISCOUS, objective="displacement", harmonics=1, starts=2)
    )


def march(*effects, cycles=None):
    """The whole run of two gaits of a body whose ground or speed remembers."""
    body = Backbone(elements=5, length=0.3)
    solver = Solver(cycles=cycles, pieces=5, backend="numpy")
    system = Swimmer(Granular(C=1.6, gamma0=0.3), body, effects, solver)
    phase = 2 * np.pi * np.arange(8)[:, None] / 8 - 0.9 * np.arange(body.joints)
    size = np.array([0.5, -0.7])[:, None, None]
    alpha = np.cos(phase) * size + 0.05
    return [*system.time_steps(alpha, -np.sin(phase) * size, cycles, True, True)]


def walk_with_errors():
    (walked,) = walking.walked([XPLORER], "planar", settling=True)
    return [*walked.walk[:6], *walked[1:]]


def walk_in_space():
    pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")
    given = [XPLORER.walker], XPLORER.numerics, 1
    (walked,) = engine("mujoco").walk(*given, advance=runner.runner().call)
    return [*walked[:6]]


REQUESTS = {
    "tasks": lambda: calls(counts=(8, 8)),
    "tasks within tasks": lambda: calls(within),
    "sweep": lambda: numbers(geomech.sweep(GLASS, over=OVER)),
    "dry field": lambda: field(GLASS),
    "linear field": lambda: field(VISCOUS),
    "accuracy of tiers": lambda: numbers(geomech.accuracy(VISCOUS, runs=1)),
    "accuracy of a leg": lambda: numbers(geomech.accuracy("c-leg")),
    "search": search,
    "heavy march": lambda: march(HEAVY),
    "heavy march in disturbed ground": lambda: march(HEAVY, DISTURBED, cycles=3),
    "walk in the plane": walk_with_errors,
    "walk in space": walk_in_space,
}
SHARED = ("sweep", "dry field", "linear field", "accuracy of tiers", "search")


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    """Small requests have many parts, each stored at once."""
    few = [setting for setting in tiered.SETTINGS if setting.tier == "direct"]
    few = [dataclasses.replace(setting, values=setting.values[:2]) for setting in few]
    monkeypatch.setattr(tiered, "SETTINGS", few)
    monkeypatch.setattr(tiered, "TRUTH_PHASES", 64)
    monkeypatch.setattr(type(scenes.load("c-leg")), "ladder", (4, 8, 16, 32))
    monkeypatch.setattr(cycles, "BATCH_SIZE", 2)
    for module in (connection, metric):
        monkeypatch.setattr(module, "SAMPLES_TOGETHER", 20)
    monkeypatch.setattr(runner, "CHECKPOINT", -1.0)


@pytest.mark.parametrize("name", REQUESTS)
def test_a_stopped_request_resumes_to_the_last_digit(name, tmp_path):
    undisturbed, n_parts = resumed(tmp_path / "whole", REQUESTS[name])
    after = n_parts // 2
    stopped(tmp_path / "p", after, REQUESTS[name])
    result, n_rest = resumed(tmp_path / "p", REQUESTS[name])
    assert same(result, undisturbed)
    assert n_rest == n_parts - after > 0


@pytest.fixture(scope="module")
def two():
    with contextlib.closing(Processes(2)) as executor:
        yield executor


@pytest.mark.parametrize("name", SHARED)
def test_processes_give_the_digits_of_one_which_resumes(
    name, two, tmp_path, monkeypatch
):
    monkeypatch.setattr(pending, "WORTH_PROCESSES", 0.0)
    undisturbed = REQUESTS[name]()
    with runner.use_runner(runner.Runner(executor=two)):
        assert same(REQUESTS[name](), undisturbed)
        assert two.pool is not None
        stopped(tmp_path / "p", 2, REQUESTS[name])
    assert same(resumed(tmp_path / "p", REQUESTS[name])[0], undisturbed)
