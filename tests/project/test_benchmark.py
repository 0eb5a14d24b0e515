"""Ratios measured in one run: pytest -m benchmark -s. Nothing here asserts a wall-clock
time."""

import contextlib
import importlib.util
import os
import resource
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

from figures.accuracy.cost_scaling import (
    NAMES,
    backends,
    one_scipy_solve,
    shortest_time,
)
from geomech.mathematics.gaits import Butterfly, Circle, Sine
from geomech.mathematics.geometry import connection
from geomech.mathematics.systems import Solver, Swimmer
from geomech.mathematics.tiers.direct import direct
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE, Backbone, Chain, Transient, body_velocity, time_steps

pytestmark = pytest.mark.benchmark
CALLS = 50  # of a small batch in a row, as an optimiser makes them
GLASS, MIDDLE = CATALOGUE["glass-0.3mm-loose"].medium, Chain(frame="link-2")


def field_samples(points=31, count=8, extent=2.5):
    axis, angle = np.linspace(-extent, extent, points), np.pi * np.arange(count) / count
    alpha = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)[:, :, None]
    return np.broadcast_arrays(alpha, np.stack([np.cos(angle), np.sin(angle)], -1))


def in_turn(asked: dict, rounds: int = 5) -> dict[str, float]:
    """Median seconds of functions that take turns, so that all meet the same moods of
    the machine."""
    times = {name: [] for name in asked}
    for _ in range(rounds):
        for name, f in asked.items():
            times[name].append(shortest_time(f, 1))
    return {name: float(np.median(t)) for name, t in times.items()}


def test_against_a_loop_of_fsolve():
    """The built-in field (a quarter of it solved, the rest by symmetry), all of it, a
    gait of 64 phases by symmetry, with its displacement, and all of its phases solved,
    a single velocity."""
    alpha, alphadot = (x.reshape(-1, 2) for x in field_samples())
    some = np.random.default_rng(0).choice(len(alpha), 100, replace=False)
    gait = Circle().cycle(64)
    alike = {"traits": Swimmer(GLASS, MIDDLE).traits}

    def field(how, threads, **known):
        return connection.fit(
            lambda a, d: (
                body_velocity(GLASS, MIDDLE, a, d, backend=how, threads=threads).xi
            ),
            connection.grid(2),
            8,
            trusted=True,
            **known,
        )

    asked, samples = (
        {"loop": lambda: [one_scipy_solve(alpha[i], alphadot[i]) for i in some]},
        {"loop": len(some)},
    )
    for how in backends():
        for threads in sorted({1, os.cpu_count()}):
            for what, known in (("field", alike), ("field without symmetry", {})):
                name = f"{what}, {NAMES[how]}, {threads} core{'s' * (threads > 1)}"

                def solve(how=how, threads=threads, known=known):
                    return field(how, threads, **known)

                asked[name], samples[name] = solve, len(alpha)
        swimmer = Swimmer(GLASS, MIDDLE, solver=Solver(backend=how))
        for name, f, (a, d) in (
            ("gait of 64 phases, its displacement", swimmer.run, gait),
            ("gait of 64 phases, all solved", swimmer.solve, gait),
            ("one velocity", swimmer.solve, (gait[0][3], gait[1][3])),
        ):

            def solve(f=f, a=a, d=d):
                return [f(a, d) for _ in range(CALLS)]

            asked[f"{name}, {NAMES[how]}"], samples[f"{name}, {NAMES[how]}"] = (
                solve,
                CALLS * a[..., 0].size,
            )
    for f in asked.values():
        f()  # loads what is loaded once
    took = in_turn(asked)
    a_loop = took["loop"] / samples["loop"]
    print(
        f"\nfsolve, 20 midpoints a link: {1e6 * a_loop:.0f} us a sample; what takes its time over ours:"
    )
    for name in list(asked)[1:]:
        ours = took[name] / samples[name]
        print(f"  {name:44} {a_loop / ours:8.0f}   ({1e6 * ours:.2f} us a sample)")
    assert a_loop * samples["field, NumPy, 1 core"] / took["field, NumPy, 1 core"] > 50
    answers = [one_scipy_solve(alpha[i], alphadot[i]) for i in some]
    solution = body_velocity(GLASS, MIDDLE, alpha, alphadot)
    flags = np.array([a[2] == 1 for a in answers])
    off = np.abs(np.array([a[0] for a in answers]) - solution.xi[some]).max(-1)
    print(
        f"  the loop says it failed in {100 * np.mean(~flags):.0f} %, is off by more than 0.01 in",
        end=" ",
    )
    print(f"{100 * np.mean(off > 0.01):.0f} %; ours all converged")
    assert (solution.status != "unconverged").all()


def test_starts():
    """Evaluations of a load a sample, from nothing and from velocities that are at hand
    anyway."""
    for name, gait in {"circle": Circle(), "butterfly": Butterfly()}.items():
        alpha, alphadot = gait.cycle(64)

        def solve(step, first=0, alpha=alpha, alphadot=alphadot, **given):
            return body_velocity(
                GLASS, MIDDLE, alpha[first::step], alphadot[first::step], **given
            )

        xi = solve(1).xi
        between = (xi[::2] + np.roll(xi[::2], -1, 0)) / 2
        ways = {
            "rounding ten times finer, from the usual one": (
                solve(4, regularisation=1e-7),
                {"start": xi[::4]},
                4,
                0,
            ),
            "every other phase, from its neighbours": (
                solve(2, 1),
                {"start": between},
                2,
                1,
            ),
        }
        for what, (cold, start, step, first) in ways.items():
            warm = solve(
                step, first, **start, **({"regularisation": 1e-7} if step == 4 else {})
            )
            np.testing.assert_allclose(warm.xi, cold.xi, atol=1e-8)
            counts = cold.iterations.mean(), warm.iterations.mean()
            print(
                f"\n{name}, {what}: {counts[0]:.1f} evaluations cold, {counts[1]:.1f} warm",
                end="",
            )
            assert counts[1] <= counts[0]


def test_a_march_of_a_hundred_elements():
    """Steps with a transient, by both back ends."""
    alpha, alphadot = Sine(elements=100).cycle(32, 0.2)
    given = {"effects": (Transient(travel=0.05),), "cycles": 2}

    def march(how):
        return time_steps(GLASS, Backbone(100), alpha, alphadot, backend=how, **given)

    answers = [march(how).xi for how in backends()]
    for other in answers[1:]:
        np.testing.assert_allclose(other, answers[0], atol=1e-10)
    took = in_turn({how: lambda how=how: march(how) for how in backends()})
    for how, seconds in took.items():
        ratio = took["numpy"] / seconds
        print(
            f"\n100 elements, transient, {NAMES[how]}: {1e3 * seconds / 64:.2f} ms a step, ratio {ratio:.1f}",
            end="",
        )


def test_direct_tier_of_a_circle_to_four_digits():
    """One circle at the fewest phases that bring it within 1e-4 body lengths of the
    truth."""
    for how in backends():

        def swimmer(a, d):
            return body_velocity(GLASS, Chain(), a, d, backend=how).xi

        for radius in (0.5, 1.0, 1.75):
            gait, n = Circle(amplitude=radius), 16
            truth = direct(swimmer, gait, phases=4096)
            while np.linalg.norm(direct(swimmer, gait, phases=n) - truth) > 1e-4:
                n *= 2
            times = []
            for _ in range(20):
                start = time.perf_counter()
                direct(swimmer, gait, phases=n)
                times.append(time.perf_counter() - start)
            told = f"{n} phases, {1e3 * np.median(times):.2f} ms"
            print(f"\n{NAMES[how]}: circle of {radius} rad to 1e-4: {told}", end="")
            assert n <= 128


def test_the_geometers_pipeline():
    """Connection, metric, CCF, minimum-perturbation coordinates and the displacement on
    a circle of the viscous three-link swimmer, 31 x 31, against an fsolve loop that
    gives nothing but a connection, that of loose glass."""
    scene = load("three-link-viscous").with_numerics(grid=31)

    def pipeline():
        study = SceneTables(scene)
        seen = study.in_frame("minimum-perturbation")
        tables = (
            study.fitted,
            study.metric,
            study.curvature,
            seen.fitted,
            seen.curvature,
        )
        return (
            tables,
            seen.poses("area", amplitudes=[1.0]),
            study.poses("direct", amplitudes=[1.0]),
        )

    def cpu(f, count=1):
        start = time.process_time()
        for _ in range(count):
            f()
        return (time.process_time() - start) / count

    alpha, alphadot = (x.reshape(-1, 2) for x in field_samples(count=2))
    some = np.random.default_rng(0).choice(len(alpha), 50, replace=False)

    def loop():
        return [one_scipy_solve(alpha[i], alphadot[i]) for i in some]

    pipeline(), loop()  # loads what is loaded once
    a_loop, ours = (
        cpu(loop) * len(alpha) / len(some),
        min(cpu(pipeline) for _ in range(5)),
    )
    print(
        f"\npipeline: {ours:.3f} CPU seconds, the loop for A alone {a_loop:.1f}, ratio {a_loop / ours:.0f}"
    )
    assert a_loop > 10 * ours


@pytest.mark.parametrize("over", [
    ["medium.C=1:3:100", "medium.gamma0=0.15:0.4:100"],
    ["gait.amplitude=0.2:2:20", "medium.C=1:3:25", "medium.gamma0=0.15:0.4:20"],
], ids=["media", "media at 20 amplitudes"])  # fmt: skip
def test_a_sweep_of_ten_thousand_points_on_two_cores(over, tmp_path):
    """By processes against one: wall-clock time, which hangs on who else is at work,
    and by computing alone, of which two cores could do no better than half. Amplitudes
    share a batch, and so little is left that a second process would not help."""
    args = [
        sys.executable,
        "-m",
        "geomech",
        "sweep",
        "three-link-glass",
        "--yes",
        *(x for o in over for x in ("--over", o)),
    ]
    wall, computing = {}, {}
    for count in (1, 2):
        before, start = (
            resource.getrusage(resource.RUSAGE_CHILDREN),
            time.perf_counter(),
        )
        subprocess.run(
            [*args, "-o", f"{count}.nc", "--workers", str(count)],
            cwd=tmp_path,
            check=True,
            capture_output=True,
        )
        wall[count], after = (
            time.perf_counter() - start,
            resource.getrusage(resource.RUSAGE_CHILDREN),
        )
        computing[count] = (
            after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        )
    assert (tmp_path / "1.nc").read_bytes() == (tmp_path / "2.nc").read_bytes()
    print(
        f"\n10,000 points: one process {wall[1]:.1f} s, two {wall[2]:.1f} s, ratio {wall[1] / wall[2]:.2f};",
        end=" ",
    )
    print(
        f"computing {computing[1]:.1f} and {computing[2]:.1f} s, at best {2 * computing[1] / computing[2]:.2f}",
        end="",
    )


HEXAPOD = """<mujoco><option timestep="0.0005"/><worldbody><geom type="plane" size="5 5 1"/><body pos="0 0 .09"><freejoint/>
<geom type="box" size=".1 .05 .03" mass="1"/>{}</body></worldbody><actuator>{}</actuator></mujoco>"""
LEG = """<body pos="{} {} 0"><joint name="j{}" axis="0 1 0" armature="0.001"/><geom type="capsule" size=".012" mass=".05"
fromto="0 0 0 0 0 -.08"/></body>"""
MOTOR = '<velocity joint="j{}" kv="0.05" ctrlrange="-20 20"/>'


def test_sand_under_a_hexapod():
    """Steps and elements a second on one core: MuJoCo alone, the compiled callback, the
    same elements by NumPy, and 64 robots in a Batch on all cores; a line each for
    README."""
    mujoco = pytest.importorskip("mujoco")
    from rft import mujoco as sands
    from rft.balance.backend import preferring
    from rft.terradynamics.meshes import Spatial

    hips = [(x, y) for x in (-0.08, 0.0, 0.08) for y in (-0.07, 0.07)]
    legs = "".join(LEG.format(x, y, k) for k, (x, y) in enumerate(hips))
    text = HEXAPOD.format(legs, "".join(map(MOTOR.format, range(6))))

    @contextlib.contextmanager
    def sand_under(model, law, how, **more):
        with warnings.catch_warnings(), preferring(how):
            warnings.simplefilter("ignore")  # a floor that is not touched
            with sands.attach(model, law, element=0.035, **more) as sand:
                yield sand

    def rate(model, steps, height=0.0):
        data = mujoco.MjData(model)
        data.qpos[2] += height
        data.ctrl[:] = 8.0
        mujoco.mj_step(model, data, 200)
        begin = time.perf_counter()
        mujoco.mj_step(model, data, steps)
        return steps / (time.perf_counter() - begin)

    for law in ("poppy-seeds-loose", Spatial(3e5)):
        rates = {}
        model, bare = (mujoco.MjModel.from_xml_string(text) for _ in range(2))
        rates["rigid floor"] = max(rate(bare, 4000) for _ in range(3))
        bare.geom_contype[0] = bare.geom_conaffinity[0] = 0
        rates["no floor"] = max(rate(bare, 4000) for _ in range(3))
        for name, how, steps in (("compiled", "numba", 4000), ("NumPy", "numpy", 150)):
            with sand_under(model, law, how) as sand:
                rates[name] = max(rate(model, steps) for _ in range(3))
                if how == "numba":
                    rates["compiled, above the sand"] = max(
                        rate(model, steps, 30.0) for _ in range(3)
                    )
        printed = mujoco.MjModel.from_xml_string(
            text.replace("<mujoco>", '<mujoco><size nuserdata="310000"/>')
        )
        for spacing in (0.02, 0.01):
            with sand_under(
                printed, law, "numba", footprints=sands.Footprints(spacing, 3.0, 2.0)
            ):
                rates[f"compiled, footprints of {100 * spacing:.0f} cm"] = max(
                    rate(printed, 4000) for _ in range(3)
                )
        with sand_under(model, law, "numba", regions={"y > 0": law}):
            rates["compiled, a boundary below the robot"] = max(
                rate(model, 4000) for _ in range(3)
            )
        share = 1 / rates["compiled"] - 1 / rates["no floor"]  # s a step
        print(
            f"\n{type(law).__name__}: {sand.elements} elements, of which {sand.elements / share / 1e6:.0f} M a second"
        )
        if int(mujoco.__version__.partition(".")[0]) >= 4:
            with sand_under(model, law, "numba") as sand:
                batch = sand.batch(64, persistent=True)
                batch.ctrl = 8.0
                batch.step(nstep=50)
                begin = time.perf_counter()
                batch.step(nstep=200)
                rates[f"64 in a Batch on {os.cpu_count()} cores"] = (
                    64 * 200 / (time.perf_counter() - begin)
                )
        for name, x in rates.items():
            print(f"| {name} | {x:,.0f} | {x / rates['NumPy']:.1f} |")
        assert rates["compiled"] > 10 * rates["NumPy"]


def test_a_step_in_sand_over_one_without():
    """Of the hexapod that walks and of a quadruped that stands, at 2 ms, by elements of
    the geoms' own shapes: a step in sand over one in nothing, NumPy over compiled code,
    and 64 in a Batch over one after the other."""
    mujoco = pytest.importorskip("mujoco")
    from test_sand_steps import STANCE, quadruped, stand

    from rft import mujoco as sands
    from rft.balance.backend import preferring
    from rft.mujoco.example import HIPS, hexapod

    tripod = np.array([((k // 2) + k % 2) % 2 * np.pi for k in range(len(HIPS))])

    def legs(data):
        data.qpos[7:] = data.ctrl[:] = tripod

    def walk(data):
        data.ctrl[:] = 4 * np.pi * data.time + tripod

    def still(data):
        data.ctrl[:] = STANCE

    def seconds(model, start, control, steps, runs=5):
        """The least time of a step: of each twenty of a run the least, summed."""
        times = np.empty((runs, steps // 20))
        for row in times:
            data = mujoco.MjData(model)
            start(data)
            for k in range(len(row)):
                control(data)
                begin = time.thread_time()
                mujoco.mj_step(model, data, 20)
                row[k] = time.thread_time() - begin
        return times.min(0).sum() / steps

    for name, build, start, control in (
        ("hexapod", hexapod, legs, walk),
        ("quadruped", lambda: quadruped(0.002), stand, still),
    ):
        model, bare = build(), build()
        model.opt.timestep = bare.opt.timestep = 0.002
        bare.geom_contype[:] = bare.geom_conaffinity[:] = 0
        without = seconds(bare, start, control, 400)
        took, effort = {}, {}
        for how, steps, runs in (("numba", 400, 5), ("numpy", 40, 1)):
            with warnings.catch_warnings(), preferring(how):
                warnings.simplefilter("ignore")
                with sands.attach(model, "poppy-seeds-loose") as sand:
                    took[how] = seconds(model, start, control, steps, runs)
                    if how == "numba":
                        took["40"] = seconds(model, start, control, 40)
                        effort, elements = sand.effort, sand.elements
                        if importlib.util.find_spec("mujoco.batch"):
                            took["batch"] = _of_a_batch(sand, model, start)
        print(
            f"\n{name}: {elements} elements, {1e6 * took['numba']:.0f} us a step,",
            end=" ",
        )
        print(f"{effort.iterations / effort.steps:.2f} iterations;", end=" ")
        print(f"in sand over in nothing {took['numba'] / without:.1f},", end=" ")
        print(f"NumPy over compiled {took['numpy'] / took['40']:.0f}", end="")
        if "batch" in took:
            print(
                f", one after the other over a Batch of 64 on {os.cpu_count()}", end=" "
            )
            print(f"cores {took['batch']:.2f}", end="")
        assert took["numpy"] > 10 * took["40"] and effort.unsolved == 0


def _of_a_batch(sand, model, start):
    """Wall-clock time of steps one after the other, over that of the same steps of 64
    in a Batch."""
    import mujoco

    data = mujoco.MjData(model)
    start(data)
    ratios = []
    for _ in range(3):
        batch = sand.batch(64, persistent=True)
        batch.qpos, batch.ctrl = data.qpos, data.ctrl
        batch.step(nstep=20)
        begin = time.perf_counter()
        batch.step(nstep=50)
        together = (time.perf_counter() - begin) / 64
        one = mujoco.MjData(model)
        start(one)
        mujoco.mj_step(model, one, 20)
        begin = time.perf_counter()
        mujoco.mj_step(model, one, 50)
        ratios.append((time.perf_counter() - begin) / together)
    return max(ratios)
