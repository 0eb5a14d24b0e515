"""Other programs compared with this package: CPU seconds for the same physical
problems, in one run.

`python -m figures.accuracy.others` prints rows of tables. Programs take turns, and the
quickest of several calls counts. Three of the programs are not dependencies of geomech.
They are left out if they are not installed:

- ElegansBot: `pip install elegansbot`
- PyElastica: `pip install pyelastica`
- sysplotter: a copy of github.com/OSU-LRAM/GeometricSystemPlotter, whose folder the
  environment names as SYSPLOTTER, and GNU Octave (`apt-get install octave`)
"""

from __future__ import annotations

import functools
import importlib.util
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.io import loadmat

from figures import peers
from figures.accuracy.cost_scaling import NAMES, backends
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.systems import Solver, Swimmer
from geomech.runs.threads import one_blas_thread
from rft import Backbone, Chain, Granular, Viscous, body_velocity
from rft.balance.backend import preferring
from rft.formulas import se2

ROUNDS = 5
SHORTEST = 0.1  # CPU seconds that a turn of short calls takes
GLASS = Granular(peers.C, peers.GAMMA0)
THREE_LINKS = Chain(frame="link-2")
WORM_PERIOD = 1.6  # s, of ElegansBot's example of a worm on agar
WORM_SETTLES = 9  # cycles until its shapes repeat to 1e-6 rad
WORM_PHASES = 1600  # times in a cycle at which its muscles are told what to do
ROD_ELEMENTS = 50
ROD_STEPS = 10_000  # in a cycle of PyElastica's flagellum, as in its example
ROD_PHASES = 400  # of them, whose shapes are recorded
ROD_EVERY = 10  # of these shapes our balance takes one in ten
ROD_SETTLES = 5  # cycles until its shapes repeat
PHASES = 32  # of our balance in a cycle of the worm


class Row(NamedTuple):
    """CPU seconds of a problem by another program, and by ours {back end: seconds}."""

    problem: str
    program: str
    theirs: float
    ours: dict[str, float]
    accuracy: str

    def __str__(self) -> str:
        cells = [self.problem, f"{self.program}: {in_words(self.theirs)}"]
        for name in backends():
            seconds = self.ours[name]
            ratio = two_digits(self.theirs / seconds)
            cells.append(f"{ratio} times, {in_words(seconds)}")
        return " | ".join(["", *cells, self.accuracy, ""]).strip()


def in_words(seconds: float) -> str:
    """Return a time with its unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{two_digits(seconds / size)} {unit}"
    return f"{two_digits(1e6 * seconds)} us"


def two_digits(x: float) -> str:
    """Return a number rounded to two significant digits."""
    rounded = float(f"{x:.1e}")
    if rounded < 10:
        return f"{rounded:.1f}"
    return f"{rounded:,.0f}"


def in_turn(programs: dict[str, Callable], rounds: int = ROUNDS) -> dict[str, float]:
    """Return the CPU seconds of the quickest call of several programs, which take turns
    of several calls each."""
    quickest = dict.fromkeys(programs, np.inf)
    for program in programs.values():
        program()  # loads and compiles
    for _ in range(rounds):
        for name, program in programs.items():
            total = 0.0
            while total < SHORTEST:
                start = time.process_time()
                program()
                seconds = time.process_time() - start
                quickest[name] = min(quickest[name], seconds)
                total += seconds
    return quickest


# A sample of the field of the three-link swimmer in loose glass


def samples() -> list[Row]:
    """Return rows of velocities of single samples: of a hundred by SciPy's solvers, of
    all in a batch by the plain loop and ours."""
    axis = np.linspace(-2.5, 2.5, 31)
    angle = np.pi * np.arange(8) / 8
    grid = np.meshgrid(axis, axis, angle, indexing="ij")
    first, second, direction = (x.ravel() for x in grid)
    alpha = np.stack([first, second], -1)
    alphadot = np.stack([np.cos(direction), np.sin(direction)], -1)
    some = np.random.default_rng(0).choice(len(alpha), 100, replace=False)
    right = body_velocity(GLASS, THREE_LINKS, alpha, alphadot).xi

    def one_by_one(solve):
        return [solve(*pair) for pair in zip(alpha[some], alphadot[some])]

    programs = {
        "fsolve": functools.partial(one_by_one, peers.one_scipy_solve),
        "least_squares": functools.partial(one_by_one, peers.one_least_squares),
    }
    if "numba" in backends():
        from figures.plain_loop import solve

        programs["plain"] = functools.partial(solve, alpha, alphadot)
    for how in backends():
        options = {"backend": how, "threads": 1}
        programs[how] = functools.partial(
            body_velocity, GLASS, THREE_LINKS, alpha, alphadot, **options
        )
    took = in_turn(programs)
    ours = {how: took[how] / len(alpha) for how in backends()}
    problem = "a velocity, three links in loose glass"
    midpoints = "20 midpoints per link; off by more than 0.01 in {:.0%}"
    by_fsolve = [answer[0] for answer in programs["fsolve"]()]
    by_squares = [answer.x for answer in programs["least_squares"]()]
    rows = []
    for name, found in (("fsolve", by_fsolve), ("least_squares", by_squares)):
        off = np.abs(np.array(found) - right[some]).max(-1)
        accuracy = midpoints.format(np.mean(off > 0.01))
        program = f"`scipy.optimize.{name}`"
        rows.append(Row(problem, program, took[name] / 100, ours, accuracy))
    if "plain" in took:
        off = np.abs(programs["plain"]() - right).max()
        each = took["plain"] / len(alpha)
        accuracy = f"within {off:.0e} of each other"
        rows.append(Row(problem, "plain numba loop", each, ours, accuracy))
    return rows


# A cycle of ElegansBot's worm


def worm() -> list[Row]:
    """Return rows of a cycle on agar: ElegansBot moves 25 rods by muscles, we move the
    rods through the shapes that it found."""
    if importlib.util.find_spec("elegansbot") is None:
        print("ElegansBot is missing: pip install elegansbot")
        return []
    from elegansbot import Worm

    rows = []
    for step, whose in ((1e-5, "its default"), (5e-5, "of its demonstration")):
        bot = Worm(dt=step, simTime=None)
        bot.dt_snapshot = WORM_PERIOD / WORM_PHASES
        for _ in range(WORM_SETTLES):
            worm_cycle(bot)
        rods, net = worm_cycle(bot)
        alpha, alphadot = periodic(np.diff(rods[:-1], axis=1))
        every = slice(None, None, WORM_PHASES // PHASES)

        def our_cycle(how, shapes=alpha[every], rates=alphadot[every]):
            solution = body_velocity(
                Viscous(40.0), Backbone(bot.n), shapes, rates, backend=how
            )
            return displacement(solution.xi)

        programs = {"theirs": functools.partial(worm_cycle, bot)}
        for how in backends():
            programs[how] = functools.partial(our_cycle, how)
        took = in_turn(programs)
        apart = np.hypot(*(our_cycle("numpy") - net)[:2])
        steps = f"steps of {1e6 * step:.0f} us, {whose}"
        rows.append(
            Row(
                "a cycle of 25 rods on agar, drag ratio 40",
                f"ElegansBot {version('elegansbot')}, {steps}",
                took["theirs"],
                {how: took[how] for how in backends()},
                f"{np.hypot(*net[:2]):.4f} BL, {apart:.0e} from ours",
            )
        )
    return rows


def worm_cycle(bot) -> tuple[np.ndarray, np.ndarray]:
    """Move the worm for a cycle as its example does; return the headings of its rods at
    all times, both ends included, and the net pose (3,) in body lengths."""
    place = np.linspace(0, 1, bot.n - 1)
    start = np.array([bot.xc, bot.yc, bot.s.mean()])
    headings = [bot.s.copy()]
    for _ in range(WORM_PHASES):
        wave = 1.832 * place - bot.t / WORM_PERIOD
        bot.act = 0.7 * np.cos(2 * np.pi * wave)
        bot.steps()
        headings.append(bot.s.copy())
    end = np.array([bot.xc, bot.yc, bot.s.mean()])
    return np.array(headings), se2.compose(se2.inverse(start), end)


def periodic(shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shapes (N, joints) of a cycle and their rates per rad of phase."""
    order = np.fft.fftfreq(len(shapes), 1 / len(shapes))
    waves = np.fft.fft(shapes, axis=0)
    return shapes, np.fft.ifft(1j * order[:, None] * waves, axis=0).real


# A cycle of PyElastica's flagellum


def flagellum() -> list[Row]:
    """Return a row of a cycle in a viscous fluid: PyElastica bends 50 elements by
    muscles, we move the elements through the shapes that it found."""
    if importlib.util.find_spec("elastica") is None:
        print("PyElastica is missing: pip install pyelastica")
        return []
    rod = Flagellum()
    for _ in range(ROD_SETTLES):
        rod.cycle()
    headings, net = rod.cycle()
    alpha, alphadot = periodic(np.diff(headings[:-1], axis=1))
    shapes = alpha[::ROD_EVERY]
    rates = alphadot[::ROD_EVERY]

    def our_cycle(how):
        solution = body_velocity(
            Viscous(2.0), Backbone(ROD_ELEMENTS), shapes, rates, backend=how
        )
        return displacement(solution.xi)

    programs = {"theirs": rod.cycle}
    for how in backends():
        programs[how] = functools.partial(our_cycle, how)
    took = in_turn(programs)
    off = np.hypot(*(our_cycle("numpy") - net)[:2])
    return [
        Row(
            "a cycle of 50 elements in a viscous fluid, drag ratio 2",
            f"PyElastica {version('pyelastica')}, {ROD_STEPS:,} steps, its example's",
            took["theirs"],
            {how: took[how] for how in backends()},
            f"{np.hypot(*net[:2]):.4f} BL, {off:.0e} from ours",
        )
    ]


class Flagellum:
    """The rod of PyElastica's example of a flagellum (Gazzola et al. 2018, section
    5.2.1): 1 m long, a period of 1 s, bent by a wave of muscle torques."""

    def __init__(self):
        import elastica as ea

        class Simulator(ea.BaseSystemCollection, ea.Forcing, ea.Damping):
            pass

        across = np.array([0.0, 1.0, 0.0])
        along = np.array([0.0, 0.0, 1.0])
        youngs = 1e7  # Pa
        self.rod = ea.CosseratRod.straight_rod(
            ROD_ELEMENTS,
            np.zeros(3),
            along,
            across,
            1.0,  # m long
            0.025,  # m in radius
            1000.0,  # kg/m^3
            youngs_modulus=youngs,
            shear_modulus=youngs / 1.5,
        )
        self.simulator = Simulator()
        self.simulator.append(self.rod)
        self.simulator.add_forcing_to(self.rod).using(
            ea.MuscleTorques,
            base_length=1.0,
            b_coeff=np.array([0.0, 17.4, 48.5, 5.4, 14.7, 0.0]),
            period=1.0,
            wave_number=2 * np.pi / 0.38,
            phase_shift=0.0,
            rest_lengths=self.rod.rest_lengths,
            ramp_up_time=1.0,
            direction=across,
            with_spline=True,
        )
        # Pa s: a Reynolds number of 1e-4 at a density of 1 kg/m^3
        self.simulator.add_forcing_to(self.rod).using(
            ea.SlenderBodyTheory, dynamic_viscosity=1e4
        )
        self.simulator.dampen(self.rod).using(
            ea.AnalyticalLinearDamper, damping_constant=0.625, time_step=1 / ROD_STEPS
        )
        self.simulator.finalize()
        self.stepper = ea.PositionVerlet()
        self.time = 0.0

    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the elements' headings, from the tail, and the pose of the body."""
        along, up = self.rod.position_collection[[2, 0]]
        headings = np.unwrap(np.arctan2(np.diff(up), np.diff(along)))
        middle = [np.mean((x[1:] + x[:-1]) / 2) for x in (along, up)]
        return headings, np.array([*middle, headings.mean()])

    def cycle(self) -> tuple[np.ndarray, np.ndarray]:
        """Move the rod for a cycle; return the headings at all phases, both ends
        included, and the net pose (3,) in body lengths."""
        first, start = self.pose()
        headings = [first]
        for _ in range(ROD_PHASES):
            for _ in range(ROD_STEPS // ROD_PHASES):
                self.time = self.stepper.step(self.simulator, self.time, 1 / ROD_STEPS)
            headings.append(self.pose()[0])
        return np.array(headings), se2.compose(se2.inverse(start), self.pose()[1])


# Connection and CCF by sysplotter


def connections() -> list[Row]:
    """Return rows of the viscous three-link swimmer on sysplotter's grid of 51 x 51."""
    folder = os.environ.get("SYSPLOTTER")
    if folder is None or shutil.which("octave-cli") is None:
        print("sysplotter is missing: name its folder as SYSPLOTTER, install Octave")
        return []
    axes = connection.grid(2, 51, 2 * np.pi)
    fine = ccf(viscous_connection(connection.grid(2, 401, 2 * np.pi), backends()[-1]))
    right = fine.values[:, ::8, ::8]
    theirs = {"connection": np.inf, "ccf": np.inf}
    ours = {name: dict.fromkeys(backends(), np.inf) for name in theirs}
    for _ in range(ROUNDS):
        found = by_octave(folder)
        for name in theirs:
            theirs[name] = min(theirs[name], found["seconds"][name])
        for how in backends():
            A = viscous_connection(axes, how)
            programs = {
                "connection": functools.partial(viscous_connection, axes, how),
                "ccf": functools.partial(ccf, A),
            }
            for name, seconds in in_turn(programs, 1).items():
                ours[name][how] = min(ours[name][how], seconds)
    off = np.abs(np.array(found["A"].tolist()) - A.A).max()
    error = np.abs(np.array(found["ccf"].tolist()) - right).max()
    our_error = np.abs(ccf(A).values - right).max()
    accuracy = {
        "connection": f"within {off:.0e} of each other",
        "ccf": f"errors {error:.1g} and {our_error:.1g} of {np.abs(right).max():.2g}",
    }
    problem = "{} of the viscous three-link swimmer, 51 x 51"
    titles = {"connection": "connection", "ccf": "CCF"}
    return [
        Row(
            problem.format(titles[name]),
            f"sysplotter in Octave {found['release']}",
            theirs[name],
            ours[name],
            accuracy[name],
        )
        for name in theirs
    ]


def viscous_connection(axes, how: str) -> connection.Connection:
    """Return the connection of the swimmer of sysplotter's sysf_three_link_lowRe."""
    swimmer = Swimmer(Viscous(2.0), THREE_LINKS, solver=Solver(backend=how))
    return connection.fit(swimmer.velocity, axes, traits=swimmer.traits, trusted=True)


def by_octave(folder: str) -> dict:
    """Return what `sysplotter.m` saves, from a run in Octave by one thread."""
    program = Path(__file__).with_name("sysplotter.m")
    with tempfile.TemporaryDirectory() as there:
        values = str(Path(there) / "values.mat")
        one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        env = {**os.environ, **one_thread, "SYSPLOTTER": folder, "VALUES": values}
        command = ["octave-cli", "--quiet", "--no-init-file", str(program)]
        subprocess.run(command, check=True, env=env, capture_output=True)
        return loadmat(values, simplify_cells=True)


# A step of MuJoCo


def hexapod_steps(count: int = 400, runs: int = ROUNDS) -> dict[str, float]:
    """Return CPU seconds of a step of 2 ms of the built-in hexapod that walks: in
    nothing, on MuJoCo's floor, and in our sand by each back end. Of each twenty steps
    the least of several runs counts."""
    if importlib.util.find_spec("mujoco") is None:
        print("MuJoCo is missing: pip install '.[mujoco]'")
        return {}
    from rft.mujoco import attach
    from rft.mujoco.example import hexapod

    falls = hexapod()
    falls.geom_contype[:] = 0
    falls.geom_conaffinity[:] = 0
    times = {name: [] for name in ("nothing", "floor", *backends())}
    for _ in range(runs):
        times["nothing"].append(walk(falls, count))
        times["floor"].append(walk(hexapod(), count))
        for how in backends():
            model = hexapod()
            with preferring(how), attach(model, "poppy-seeds-loose"):
                times[how].append(walk(model, count))
    return {name: np.min(rows, 0).mean() for name, rows in times.items()}


def walk(model, count: int) -> np.ndarray:
    """Return the CPU seconds of a step, of each twenty of a robot that walks by an
    alternating tripod."""
    import mujoco

    stance = np.pi * np.array([0, 1, 1, 0, 0, 1])
    data = mujoco.MjData(model)
    data.qpos[7:] = stance
    seconds = []
    for _ in range(count // 20):
        data.ctrl[:] = 4 * np.pi * data.time + stance
        start = time.process_time()
        mujoco.mj_step(model, data, 20)
        seconds.append((time.process_time() - start) / 20)
    return np.array(seconds)


def compute() -> tuple[list[Row], dict[str, float]]:
    """Return rows of all comparisons, and seconds of MuJoCo's steps."""
    with one_blas_thread():
        return samples() + worm() + flagellum() + connections(), hexapod_steps()


def main() -> None:
    rows, steps = compute()
    names = " | ".join(NAMES[how] for how in backends())
    print(f"| problem | by | {names} | accuracy |")
    print("|" + "---|" * (3 + len(backends())))
    print("\n".join(map(str, rows)))
    for name, seconds in steps.items():
        share = 1 - steps["nothing"] / seconds
        place = NAMES.get(name, name)
        print(f"MuJoCo, {place}: {in_words(seconds)}, {share:.1%} beyond its own")
    for package in ("numpy", "scipy", "numba", "mujoco"):
        if importlib.util.find_spec(package):
            print(package, version(package))


if __name__ == "__main__":
    main()
