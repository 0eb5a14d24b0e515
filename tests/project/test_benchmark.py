"""Ratios measured in one run: pytest -m benchmark -s. Nothing here asserts a wall-clock
time."""

import functools
import importlib.util
import os
import resource
import subprocess
import sys
import time
from unittest import mock

import numpy as np
import pytest
from quadruped import STANCE, quadruped

from figures import peers
from figures.accuracy import others
from figures.accuracy.cost_scaling import NAMES, backends, shortest_time
from geomech.mathematics.gaits import Butterfly, Circle, Sine
from geomech.mathematics.geometry import connection
from geomech.mathematics.systems import Solver, Swimmer
from geomech.mathematics.tiers.direct import direct
from geomech.scenes import load
from geomech.studies.displacement.sweep import sweep
from geomech.studies.scene_tables import SceneTables
from rft import (
    CATALOGUE,
    Backbone,
    BodyVelocity,
    Chain,
    Granular,
    Transient,
    body_velocity,
    time_steps,
)
from rft.balance import solver
from rft.balance.backend import preferring
from rft.balance.solver import QUICK
from rft.laws.records import Terms

pytestmark = [
    pytest.mark.benchmark,
    # Of a floor that is not touched.
    pytest.mark.filterwarnings("ignore::rft.core.notes.Note"),
]
CALLS = 50  # of a small batch in a row, as an optimiser makes them
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
MIDDLE = Chain(frame="link-2")


def field_samples(points=31, count=8, extent=2.5):
    axis = np.linspace(-extent, extent, points)
    angle = np.pi * np.arange(count) / count
    alpha = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)[:, :, None]
    rates = np.stack([np.cos(angle), np.sin(angle)], -1)
    return [x.reshape(-1, 2) for x in np.broadcast_arrays(alpha, rates)]


def in_turn(asked: dict, rounds: int = 5) -> dict[str, float]:
    """Median seconds of functions that take turns, so that all meet the same moods of
    the machine."""
    times = {name: [] for name in asked}
    for _ in range(rounds + 1):  # the first loads what is loaded once
        for name, f in asked.items():
            times[name].append(shortest_time(f, 1))
    return {name: float(np.median(t[1:])) for name, t in times.items()}


def least_in_turn(asked: dict, rounds: int = 40) -> dict[str, float]:
    """Least CPU seconds of functions that take turns, for what takes no longer than the
    pauses of a shared machine."""
    times = {name: [] for name in asked}
    for _ in range(rounds):
        for name, f in asked.items():
            start = time.process_time()
            f()
            times[name].append(time.process_time() - start)
    return {name: min(t) for name, t in times.items()}


def one_by_one(alpha, alphadot):
    return [peers.one_scipy_solve(*pair) for pair in zip(alpha, alphadot)]


def repeated(f, gait):
    for _ in range(CALLS):
        f(*gait)


def field(how, **known):
    """Fit the built-in field, by symmetry where the traits are known."""

    def velocity(alpha, alphadot):
        options = {"backend": how, "threads": 1}
        return body_velocity(GLASS, MIDDLE, alpha, alphadot, **options).xi

    return connection.fit(velocity, connection.grid(2), 8, trusted=True, **known)


def test_against_a_loop_of_fsolve():
    """The built-in field (a quarter of it solved, the rest by symmetry), all of it, a
    gait of 64 phases by symmetry, with its displacement, and all of its phases solved,
    a single velocity; in CPU seconds."""
    alpha, alphadot = field_samples()
    some = np.random.default_rng(0).choice(len(alpha), 100, replace=False)
    loop = functools.partial(one_by_one, alpha[some], alphadot[some])
    gait = Circle().cycle(64)
    one = gait[0][3], gait[1][3]
    traits = Swimmer(GLASS, MIDDLE).traits
    asked = {"loop": loop}
    samples = {"loop": len(some)}
    if "numba" in backends():
        from figures.plain_loop import solve

        asked["plain compiled loop"] = functools.partial(solve, alpha, alphadot)
        samples["plain compiled loop"] = len(alpha)
    for how in backends():
        name = f"field, {NAMES[how]}"
        asked[name] = functools.partial(field, how, traits=traits)
        asked[f"whole {name}"] = functools.partial(field, how)
        samples |= dict.fromkeys((name, f"whole {name}"), len(alpha))
        swimmer = Swimmer(GLASS, MIDDLE, solver=Solver(backend=how))
        for name, f, rows in (
            ("gait of 64 phases, its displacement", swimmer.run, gait),
            ("gait of 64 phases, all solved", swimmer.solve, gait),
            ("one velocity", swimmer.solve, one),
        ):
            asked[f"{name}, {NAMES[how]}"] = functools.partial(repeated, f, rows)
            samples[f"{name}, {NAMES[how]}"] = CALLS * rows[0][..., 0].size
    took = others.in_turn(asked)
    each = {name: took[name] / samples[name] for name in asked}
    print(
        f"\nus a sample; of fsolve, 20 midpoints per link, over it: {each['loop']:.1e} s"
    )
    for name, seconds in each.items():
        print(f"  {name:44} {1e6 * seconds:8.2f} {each['loop'] / seconds:8.0f}")
    assert each["loop"] > 50 * each["field, NumPy"]
    answers = loop()
    solution = body_velocity(GLASS, MIDDLE, alpha, alphadot)
    if "numba" in backends():
        assert each["plain compiled loop"] > 3 * each["whole field, compiled"]
        np.testing.assert_allclose(
            solve(alpha, alphadot), solution.xi, rtol=0, atol=1e-6
        )
    failed = np.mean([answer[2] != 1 for answer in answers])
    off = np.abs([answer[0] for answer in answers] - solution.xi[some]).max(-1)
    print(f"  the loop says that it fails in {failed:.0%}", end=", ")
    print(f"is off by more than 0.01 in {np.mean(off > 0.01):.0%}")
    assert (solution.status != "unconverged").all()


@pytest.mark.skipif("numba" not in backends(), reason="numba is missing")
def test_one_velocity_against_a_plain_loop():
    """By `body_velocity`, by a call that is prepared, and by the plain loop for one
    sample, which checks and assembles nothing."""
    from figures.plain_loop import solve

    asked_of = GLASS, MIDDLE
    how = {"backend": "numba"}
    one = [0.5, 0.3], [1.0, 0.0]
    arrays = [np.array([x]) for x in one]
    asked = {
        "plain compiled loop": functools.partial(solve, *arrays),
        "body_velocity": functools.partial(body_velocity, *asked_of, *one, **how),
        "prepared": functools.partial(BodyVelocity(*asked_of, **how), *one),
    }
    calls = {k: functools.partial(repeated, f, ()) for k, f in asked.items()}
    took = least_in_turn(calls)
    for name, seconds in took.items():
        ratio = seconds / took["plain compiled loop"]
        print(f"\n{name:20} {1e6 * seconds / CALLS:7.1f} us, ratio {ratio:.1f}", end="")
    assert took["prepared"] < 6 * took["plain compiled loop"]
    assert took["body_velocity"] < 8 * took["plain compiled loop"]


@pytest.mark.skipif("numba" not in backends(), reason="numba is missing")
def test_hard_samples_take_little_of_a_batch():
    """Batches of a law far from monotone, whose curves of solutions fold, over the same
    without the samples that are followed along their curves."""
    law = Granular(8.0, np.radians(35.0))
    rng = np.random.default_rng(5)
    alpha = rng.uniform(-3, 3, (20_000, 2))
    alphadot = rng.normal(size=(20_000, 2))
    velocity = BodyVelocity(law, Chain(), backend="numba", threads=1)
    walked = velocity(alpha, alphadot).checked().iterations > QUICK.budget
    took = least_in_turn({
        "all": functools.partial(velocity, alpha, alphadot),
        "without": functools.partial(velocity, alpha[~walked], alphadot[~walked]),
    })  # fmt: skip
    ratio = took["all"] / took["without"]
    print(f"\n{walked.sum()} of 20,000 are walked: ratio {ratio:.2f}")
    assert walked.sum() > 0 and ratio < 1.5


@pytest.mark.timeout(1800)
def test_against_programs_of_others():
    """The rows of `python -m figures.accuracy.others`, of programs that are at hand."""
    rows, steps = others.compute()
    for row in rows:
        print(f"\n{row}", end="")
        assert row.theirs > 3 * row.ours[backends()[-1]]
    for name, took in steps.items():
        share = 1 - steps["nothing"] / took
        print(f"\na step of MuJoCo, {name}: {1e6 * took:.0f} us, {share:.0%}", end="")
        assert took >= steps["nothing"]


@pytest.mark.parametrize("gait", [Circle(), Butterfly()])
def test_starts(gait):
    """Evaluations of a load a sample, from nothing and from velocities that are at hand
    anyway: those of a rounding ten times rougher, and those of neighbours."""
    alpha, alphadot = gait.cycle(64)
    xi = body_velocity(GLASS, MIDDLE, alpha, alphadot).xi
    between = (xi[::2] + np.roll(xi[::2], -1, 0)) / 2
    for phases, start, options in (
        (slice(0, None, 4), xi[::4], {"regularisation": 1e-7}),
        (slice(1, None, 2), between, {}),
    ):
        asked = GLASS, MIDDLE, alpha[phases], alphadot[phases]
        cold = body_velocity(*asked, **options)
        warm = body_velocity(*asked, start=start, **options)
        np.testing.assert_allclose(warm.xi, cold.xi, atol=1e-8)
        counts = cold.iterations.mean(), warm.iterations.mean()
        print(f"\n{gait.kind}: {counts[0]:.1f} cold, {counts[1]:.1f} warm", end="")
        assert counts[1] <= counts[0]


def test_a_march_of_a_hundred_elements():
    """Steps with a transient, by both back ends."""
    alpha, alphadot = Sine(elements=100).cycle(32, 0.2)
    given = {"effects": (Transient(travel=0.05),), "cycles": 2}

    def march(how):
        return time_steps(GLASS, Backbone(100), alpha, alphadot, backend=how, **given)

    for how in backends():
        np.testing.assert_allclose(march(how).xi, march("numpy").xi, atol=1e-10)
    took = in_turn({how: functools.partial(march, how) for how in backends()})
    for how, seconds in took.items():
        told = (
            f"{1e3 * seconds / 64:.2f} ms a step, ratio {took['numpy'] / seconds:.1f}"
        )
        print(f"\n100 elements, transient, {NAMES[how]}: {told}", end="")


def test_steps_over_the_kernel():
    """The cycle of the scene with a transient, over what its balances take in the
    kernel alone: where this is large, time is lost around it."""
    if "numba" not in backends():
        pytest.skip("numba is not installed")
    scene = load("sandfish-transient")
    cycle = scene.gait.cycle(64)
    solve = solver.compiled_driver().kernels_of(Terms).solve
    calls = []

    def kept(*arguments):
        calls.append(arguments)
        return solve(*arguments)

    def kernel():
        for arguments in calls:
            solve(*arguments)

    kernels = mock.Mock(solve=kept)
    with preferring("numba"):
        with mock.patch("rft.balance.compiled.kernels_of", return_value=kernels):
            scene.system.run(*cycle)
        steps = functools.partial(scene.system.run, *cycle)
        took = in_turn({"steps": steps, "kernel": kernel}, 15)
    ratio = took["steps"] / took["kernel"]
    each = 1e6 * took["steps"] / len(calls)
    print(f"\n{len(calls)} steps, {each:.0f} us each, over the kernel {ratio:.1f}")
    assert ratio < 8


@pytest.mark.parametrize("how", backends())
@pytest.mark.parametrize("radius", [0.5, 1.0, 1.75])
def test_direct_tier_of_a_circle_to_four_digits(how, radius):
    """At the fewest phases that bring it within 1e-4 body lengths of the truth."""

    def swimmer(a, d):
        return body_velocity(GLASS, Chain(), a, d, backend=how).xi

    gait = Circle(amplitude=radius)
    truth = direct(swimmer, gait, phases=4096)
    n = 16
    while np.linalg.norm(direct(swimmer, gait, phases=n) - truth) > 1e-4:
        n *= 2
    took = in_turn({"": lambda: direct(swimmer, gait, phases=n)}, 20)[""]
    print(f"\n{NAMES[how]}: circle of {radius} rad: {n} phases, {1e3 * took:.2f} ms")
    assert n <= 128


def test_the_geometers_pipeline():
    """Connection, metric, CCF, minimum-perturbation coordinates and the displacement on
    a circle of the viscous three-link swimmer, 31 x 31, against an fsolve loop that
    gives nothing but a connection, that of loose glass."""
    scene = load("three-link-viscous").with_numerics(grid=31)
    alpha, alphadot = field_samples(count=2)
    some = np.random.default_rng(0).choice(len(alpha), 50, replace=False)

    def pipeline():
        study = SceneTables(scene)
        seen = study.in_frame("minimum-perturbation")
        for each in (study, seen):
            each.fitted, each.curvature  # noqa: B018
        study.metric  # noqa: B018
        seen.poses("area", amplitudes=[1.0])
        study.poses("direct", amplitudes=[1.0])

    loop = functools.partial(one_by_one, alpha[some], alphadot[some])
    took = in_turn({"ours": pipeline, "loop": loop})
    ratio = took["loop"] * len(alpha) / len(some) / took["ours"]
    print(f"\npipeline: {took['ours']:.3f} s, the loop for A alone over it {ratio:.0f}")
    assert ratio > 10


@pytest.mark.parametrize("over", [
    ["medium.C=1:3:100", "medium.gamma0=0.15:0.4:100"],
    ["gait.amplitude=0.2:2:20", "medium.C=1:3:25", "medium.gamma0=0.15:0.4:20"],
], ids=["media", "media at 20 amplitudes"])  # fmt: skip
def test_a_sweep_of_ten_thousand_points_on_two_cores(over, tmp_path):
    """By processes against one: wall-clock time, which hangs on who else is at work,
    and by computing alone, of which two cores could do no better than half. Amplitudes
    share a batch, and so little is left that a second process would not help."""
    sweep = [sys.executable, "-m", "geomech", "sweep", "three-link-glass", "--yes"]
    for option in over:
        sweep += ["--over", option]
    for count in (1, 2):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        start = time.perf_counter()
        workers = ["-o", f"{count}.nc", "--workers", str(count)]
        subprocess.run(
            [*sweep, *workers], cwd=tmp_path, check=True, capture_output=True
        )
        wall = time.perf_counter() - start
        computing = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        told = f"{count} processes {wall:.1f} s, computing {computing:.1f} s"
        print(f"\n10,000 points: {told}", end="")
    assert (tmp_path / "1.nc").read_bytes() == (tmp_path / "2.nc").read_bytes()


@pytest.mark.parametrize("how", backends())
def test_a_medium_of_a_sweep_over_one_asked_alone(how):
    """With the error of each: 256 media by a sweep, in batches of 64, and some of them
    each from the tables of its scene."""
    over = {
        "medium.C": np.linspace(1, 3, 16),
        "medium.gamma0": np.linspace(0.1, 0.4, 16),
    }
    scene = load("three-link-glass").with_numerics(backend=how)
    some = [{key: [values[k]] for key, values in over.items()} for k in (2, 7, 12)]

    def alone():
        for point in some:
            sweep(scene, point)

    took = in_turn({"together": lambda: sweep(scene, over), "alone": alone})
    each = took["together"] / 256
    ratio = took["alone"] / len(some) / each
    print(f"\n{how}: {1e3 * each:.2f} ms a medium, alone {ratio:.0f} times as long")
    assert ratio > 6


HEXAPOD = """<mujoco><size nuserdata="310000"/><option timestep="0.0005"/><worldbody><geom type="plane" size="5 5 1"/>
<body pos="0 0 .09"><freejoint/><geom type="box" size=".1 .05 .03" mass="1"/>{}</body></worldbody>
<actuator>{}</actuator></mujoco>"""
LEG = """<body pos="{} {} 0"><joint name="j{}" axis="0 1 0" armature="0.001"/><geom type="capsule" size=".012" mass=".05"
fromto="0 0 0 0 0 -.08"/></body>"""
MOTOR = '<velocity joint="j{}" kv="0.05" ctrlrange="-20 20"/>'


def seconds(model, steps=4000, runs=3, stance=8.0, speed=0.0, height=0.0):
    """The least time of a step: of each twenty of a run the least, summed. The controls
    are those of a stance, and grow with the time."""
    import mujoco

    times = np.empty((runs, steps // 20))
    for row in times:
        data = mujoco.MjData(model)
        data.qpos[2] += height
        data.qpos[7:] = stance
        for k in range(len(row)):
            data.ctrl[:] = speed * data.time + stance
            row[k] = shortest_time(lambda data=data: mujoco.mj_step(model, data, 20), 1)
    return times.min(0).sum() / steps


def test_sand_under_a_hexapod():
    """Steps and elements a second on one core: MuJoCo alone, the compiled callback, the
    same elements by NumPy, and 64 robots in a Batch on all cores; a line each for
    README."""
    mujoco = pytest.importorskip("mujoco")
    from rft import mujoco as sands
    from rft.terradynamics.meshes import Spatial

    hips = [(x, y) for x in (-0.08, 0.0, 0.08) for y in (-0.07, 0.07)]
    legs = "".join(LEG.format(x, y, k) for k, (x, y) in enumerate(hips))
    text = HEXAPOD.format(legs, "".join(map(MOTOR.format, range(6))))
    model = mujoco.MjModel.from_xml_string(text)
    bare = mujoco.MjModel.from_xml_string(text)
    took = {"rigid floor": seconds(bare)}
    bare.geom_contype[0] = 0
    bare.geom_conaffinity[0] = 0
    took["no floor"] = seconds(bare)
    for law in ("poppy-seeds-loose", Spatial(3e5)):
        forms = {"compiled": {}, "a boundary below": {"regions": {"y > 0": law}}}
        for spacing in (0.02, 0.01):
            prints = sands.Footprints(spacing, 3.0, 2.0)
            forms[f"footprints of {100 * spacing:.0f} cm"] = {"footprints": prints}
        with preferring("numpy"), sands.attach(model, law, element=0.035):
            took["NumPy"] = seconds(model, 600, 1)
        for name, more in forms.items():
            with preferring("numba"), sands.attach(model, law, element=0.035, **more):
                took[name] = seconds(model)
        with preferring("numba"), sands.attach(model, law, element=0.035) as sand:
            took["above the sand"] = seconds(model, height=30.0)
            if importlib.util.find_spec("mujoco.batch"):
                batch = sand.batch(64, persistent=True)
                batch.ctrl = 8.0
                batch.step(nstep=50)
                all_cores = f"64 in a Batch on {os.cpu_count()} cores"
                step = functools.partial(batch.step, nstep=200)
                took[all_cores] = shortest_time(step) / 64 / 200
        rate = sand.elements / (took["compiled"] - took["no floor"])
        print(f"\n{law}: {sand.elements} elements, {rate:.1e} a second")
        for name, x in took.items():
            print(f"| {name} | {1 / x:,.0f} | {took['NumPy'] / x:.1f} |")
        assert took["NumPy"] > 10 * took["compiled"]


TRIPOD = np.pi * np.array([0, 1, 1, 0, 0, 1])


@pytest.mark.parametrize(
    ("robot", "stance", "speed"),
    [("hexapod", TRIPOD, 4 * np.pi), ("quadruped", STANCE, 0.0)],
)
def test_a_step_in_sand_over_one_without(robot, stance, speed):
    """Of the hexapod that walks and of a quadruped that stands, at 2 ms, by elements of
    the geoms' own shapes: a step in sand over one in nothing, and NumPy over compiled
    code."""
    pytest.importorskip("mujoco")
    from rft import mujoco as sands
    from rft.mujoco.example import hexapod

    model = hexapod() if robot == "hexapod" else quadruped(0.002)
    how = {"stance": stance, "speed": speed}
    with preferring("numpy"), sands.attach(model, "poppy-seeds-loose"):
        by_numpy = seconds(model, 40, 1, **how)
    with preferring("numba"), sands.attach(model, "poppy-seeds-loose") as sand:
        took = seconds(model, 400, **how)
        slower = by_numpy / seconds(model, 40, **how)
        assert sand.effort.unsolved == 0
    model.geom_contype[:] = 0
    model.geom_conaffinity[:] = 0
    without = seconds(model, 400, **how)
    print(f"\n{robot}: {sand.elements} elements, {1e6 * took:.0f} us a step,", end=" ")
    print(f"over one in nothing {took / without:.1f}, by NumPy {slower:.0f} times")
    assert slower > 10
