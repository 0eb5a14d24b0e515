"""Golden numbers: what every medium, body, effect and built-in scene of the registry gives, kept in data/golden.json.

    python tests/tools/golden.py            which entries changed, appeared or went, and by how much
    python tests/tools/golden.py --write    records them, and what `frozen` has; lines that did not change stay as they are

They guard against a change nobody meant; what is right, other tests say. `frozen` keeps words and files likewise, and
is written with them. Everything goes through the command line, `geomech` and the doors of rft that are named below, so
that a move of modules needs no other change here.

Regularisation is 1e-3 in place of 1e-6: an element at rest, or one that slides along itself, makes a balance as badly
conditioned as 1 / regularisation, and the last digits would be the solver's path, not the solution's. For the same
reason balances are solved to the smallest tolerance there is: solved along another path all come out within 6e-13. Only
error estimates contain the residual, which is rounding.
"""

import itertools
import json
import pathlib
import re
import sys
import tempfile

import former
import frozen
import numpy as np
import pytest
from registry import (
    BODIES,
    EFFECTS,
    GROUND_EFFECTS,
    MEDIA,
    OUTLINES,
    SOLIDS,
    STRESSES,
    WALKERS,
)
from scipy.spatial.transform import Rotation

import geomech
import rft
from geomech.mathematics.systems.capabilities import solver_of
from geomech.run import cost
from geomech.shell import pipeline
from rft.balance import backend
from rft.terradynamics.meshes import Spatial, wrench
from rft.terradynamics.plates import loads
from rft.terradynamics.walking import Fineness, engine

FILE = pathlib.Path(__file__).parents[1] / "data" / "golden.json"
TOLERANCE, OF_ESTIMATES = (
    1e-12,
    1e-8,
)  # relative, of the largest number of an entry; the second for walks too
OF_RESIDUALS = 1e-6  # of rod.csv: 2e-5 N of forces of 3.7 N, whose roundoff differs between processors by 4e-12 N
SOLVED = {"regularisation": 1e-3, "tolerance": 1e-15}
COARSE = {
    "regularisation": 1e-3,
    "tolerance": 1e-13,
    "grid": 7,
    "phases": 32,
    "curves": 6,
    "harmonics": 5,
    "cycles": 2,
}
GEOMETRY = ("grid", "phases", "curves", "harmonics")
SCENE = """[medium]\nlaw = "granular"\nC = 1.8\ngamma0_deg = 13.8
[body]\nkind = "chain"\nlengths = [1, 1.4, 0.8]\nlength = 0.3\nframe = "link-1"
[gait]\nkind = "ellipse"\nsemi_axes = [1.0, 0.6]\ntilt = 0.4\ncentre = [0.3, -0.2]
[numerics]\nregularisation = 1e-3\ntolerance = 1e-13\nphases = 32\ngrid = 6\nextent = 2.0
"""


def shapes(joints: int) -> tuple[np.ndarray, np.ndarray]:
    """alpha, alphadot (4, joints): a generic pose, a straight body with one joint moving, a curled one whose joints move
    alike (links stick), and a zigzag with joints of very different speed."""
    k = np.arange(joints)
    alpha = (
        0.8 * np.cos(1.7 * k + 0.4),
        0.0 * k,
        np.full(joints, 1.5),
        2.0 * (-1.0) ** k,
    )
    alphadot = (
        np.sin(2.3 * k + 0.9),
        k == 0,
        np.full(joints, 0.3),
        10.0 ** (-2.0 * (k % 3)),
    )
    return np.stack(alpha), np.stack(alphadot).astype(float)


def velocities():
    for (medium, law), (name, body) in itertools.product(MEDIA.items(), BODIES.items()):
        alpha, alphadot = shapes(body.joints)
        xi = rft.body_velocity(law, body, alpha, alphadot, **SOLVED).checked().xi
        yield f"velocity, {medium}, {name}", xi
        done = rft.work_done(
            law,
            body,
            alpha[:1],
            alphadot[:1],
            xi[:1],
            regularisation=SOLVED["regularisation"],
        )
        yield (
            f"work, {medium}, {name}",
            [*done.power, *done.slip, *done.bending_moment[0]],
        )


def tiers():
    for name in shipped("gait"):
        scene = geomech.load(name)
        own = (
            COARSE
            if solver_of(scene.system)
            else {k: v for k, v in COARSE.items() if k in GEOMETRY}
        )
        study = geomech.Study(scene.with_numerics(**own)).tables
        amplitudes = scene.gait.amplitude * np.array([0.6, 1.0])
        for tier in study.tiers:
            yield f"tier, {name}, {tier}", study.poses(tier, None, amplitudes)


def march(names, cycles=2):
    """Net pose, velocities, power and moments of a march under effects strong enough to matter."""
    body, gait = (
        rft.Chain((1, 1.4, 0.8), frame="link-2"),
        geomech.mathematics.gaits.Ellipse(
            semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2)
        ),
    )
    effects = [EFFECTS[name][0](0.05) for name in names]
    found = rft.time_steps(
        MEDIA["glass-0.3mm-loose"],
        body,
        *gait.cycle(8),
        effects=effects,
        cycles=cycles,
        with_work=True,
        **SOLVED,
    )
    return [
        *found.displacement,
        *found.xi[3],
        *found.work.power[[2, 6]],
        *found.work.bending_moment[[2, 6]].ravel(),
    ]


def marches():
    """Every effect."""
    for name in EFFECTS:
        yield f"march, {name}", march([name])


def pairs():
    """Every two effects that differ in kind, for a cycle."""
    for pair in itertools.combinations(EFFECTS, 2):
        if len({name.partition(",")[0] for name in pair}) == 2:
            yield f"pair, {' + '.join(pair)}", march(pair, 1)


def command(*args: str) -> str:
    """What a command of geomech prints; it must end well."""
    code, out, err = frozen.geomech(*args)
    if code != "0":
        raise RuntimeError(f"geomech {' '.join(args)} ended with {code}: {err}")
    return out


def shipped(kind: str) -> list[str]:
    """Names of the scenes that ship: of a "gait", an "intruder" or a "walker"."""
    sections = command("scenes").split("\n\n")  # each but the first under a heading
    lines = sections[("gait", "intruder", "walker").index(kind)].splitlines()
    own = [
        line for line in lines[kind != "gait" :] if not line.startswith(" ")
    ]  # others go on with a description
    return [line.split()[0] for line in own]


def commands():
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        (here / "scene.toml").write_text(SCENE)
        scene, file = str(here / "scene.toml"), str(here / "out.nc")
        command("connection", scene, "-o", file)
        for name, values in former.connection(here / "out.nc").items():
            yield f"connection, {name}", values
        command(
            "sweep",
            scene,
            "--over",
            "gait.amplitude=0.5,1.0",
            "--over",
            "medium.C=1,3",
            "-o",
            file,
        )
        poses, errors = former.sweep(here / "out.nc")
        yield "sweep", poses
        yield "sweep, estimate", errors
        told = json.loads(
            command(
                "velocity",
                scene,
                "--alpha",
                "0.4,-0.9",
                "--alphadot",
                "1,0.5",
                "--json",
            )
        )
        yield "command, velocity", told["data_vars"]["xi"]["data"]
        told = former.displacement(
            command("displacement", scene, "--amplitudes", "0.5,1.0", "--json")
        )
        for tier, errors in told["estimate"].items():
            yield f"command, displacement, {tier}", told[tier]
            yield f"command, displacement, {tier}, estimate", errors


def intrusions():
    """Every stress map and outline: out of the ground, across the surface, deep and turning about itself, and at an angle."""
    pose = [(0.0, 0.1, 0.3), (0.1, -0.01, 0.7), (0.0, -0.2, -1.2), (-0.3, -0.04, 2.5)]
    twist = [(1.0, 0.0, 0.0), (0.02, -0.03, 1.1), (0.0, 0.0, -2.0), (-0.1, 0.04, 0.3)]
    for (medium, stress), (name, shape) in itertools.product(
        STRESSES.items(), OUTLINES.items()
    ):
        found = loads(stress, shape.outline(30), pose, twist)
        yield (
            f"intrusion, {medium}, {name}",
            np.column_stack([found.force, found.moment]),
        )


def solids():
    """Every body of three dimensions, under the ground and across its surface, plain and with each effect."""
    medium, place = Spatial(3e5, 0.3), [(0.02, 0.1, -0.01), (-0.05, 0.0, -0.2)]
    turn = Rotation.from_rotvec([(0.3, -0.7, 0.2), (1.0, 2.0, -0.4)]).as_matrix()
    effects = {name: [make(0.4)] for name, (make, _) in GROUND_EFFECTS.items()}
    for (name, body), (effect, some) in itertools.product(
        SOLIDS.items(), {"plain": [], **effects}.items()
    ):
        found = wrench(
            medium,
            body.mesh(300),
            turn,
            place,
            [-0.3, 0.1, -0.4],
            [2.0, 9.0, 1.0],
            some,
        )
        yield (
            f"solid, {name}, {effect}",
            np.column_stack([found.force, found.moment, found.power]),
        )


def walks():
    """Every robot after a cycle, and its speed in the end; steps are solved to 1e-3 of the rounding, not to the last digit."""
    walk, coarse = engine("planar").walk, Fineness(steps=8, elements=4, rounding=0.01)
    for name, one in zip(WALKERS, walk(list(WALKERS.values()), coarse, 1)):
        yield (
            f"walk, {name}",
            [*one.pose[-1], *one.twist[-1], one.work[-1], one.loss[-1], one.speed],
        )


def digest(values) -> list[float]:
    """An array in few numbers: some of it, its root mean square, and a mean with weights, which notices any change. What is
    below 1e-9 is rounding, or nearly."""
    flat = np.ravel(np.array(values, float))
    if flat.size > 12:
        some = flat[np.linspace(0, flat.size - 1, 7).astype(int)]
        flat = np.array(
            [
                *some,
                np.sqrt((flat**2).mean()),
                (flat * np.cos(1.0 + np.arange(flat.size))).mean(),
            ]
        )
    return np.where(np.abs(flat) < 1e-9, 0.0, flat).tolist()


TOGETHER = {
    "x": "place",
    "y": "place",
    "z": "place",
    "pitch": "attitude",
    "roll": "attitude",
    "yaw": "attitude",
}


def of_json(name: str, told: dict):
    """An entry for each list of numbers, or number, of an answer; components of one vector make one."""
    found: dict[str, list] = {}
    for key, value in told.items():
        if isinstance(value, dict):
            yield from of_json(f"{name}, {key}", value)
        elif np.array(value).dtype.kind in "if" and not re.fullmatch(
            "seconds|residual|evaluations|kept", key
        ):
            found.setdefault(TOGETHER.get(key, re.sub("_[xyz]$", "", key)), []).extend(
                digest(value)
            )
    yield from ((f"{name}, {key}", values) for key, values in found.items())


def intruders():
    """The intruder scenes that ship, of few pieces."""
    with tempfile.TemporaryDirectory() as folder:
        for name in shipped("intruder"):
            numerics = (
                "triangles = 400"
                if hasattr(geomech.load(name), "mesh")
                else "elements = 40"
            )
            file = pathlib.Path(folder) / f"{name}.toml"
            file.write_text(
                f"{command('scenes', '--show', name)}\n[numerics]\n{numerics}\n"
            )
            yield from of_json(
                f"intruder, {name}",
                former.intrusion(command("intrude", str(file), "--json")),
            )


def walkers():
    """The robots that ship, coarsely: a fifth of a second, in few steps."""
    coarse = "[numerics]\nsteps = 8\nelements = 4\nrounding = 0.02\nduration = 0.2\n"
    with tempfile.TemporaryDirectory() as folder:
        for name in shipped("walker"):
            text = re.sub(r"\[numerics\][^[]*", "", command("scenes", "--show", name))
            (pathlib.Path(folder) / f"{name}.toml").write_text(f"{text}\n{coarse}")
            told = former.walk(
                command("walk", f"{folder}/{name}.toml", "--json", "--yes")
            )
            yield from of_json(f"walker, {name}", told)


def measurements():
    """Tables and measured gaits of data/frozen: what they predict, and what is fitted to measurements."""
    lines = {
        "table.toml": "displacement table.toml --amplitudes 0.4,0.8 --json",
        "matrix.toml": "displacement matrix.toml --amplitudes 0.4,0.8 --json",
        "snake.toml": "displacement snake.toml --amplitudes 0.5,1 --json",
        "log.csv": "fit log.csv --harmonics 1 --json",
        "plates.csv": "calibrate plates.csv --json",
        "push.csv": "calibrate push.csv --json",
        "rod.csv": "calibrate rod.csv --json",
    }
    with frozen.place():
        for name, line in lines.items():
            out = command(*line.split())
            if "--amplitudes" in line:
                told = former.displacement(out)
            elif line.startswith("calibrate"):
                told = former.medium(out)
            elif line.startswith("fit "):
                told = former.gait(out)
            else:
                told = json.loads(out)
            yield from of_json(f"measured, {name}", told)


ASKED = {  # lines with costs that are known in some hundredths of a second, by what they are about
    "gait": (
        "displacement {} --amplitudes 0.3,0.9", "ccf {}", "connection {} -o x.nc", "run {} -o d", "lab {} -o x.html",
        "sweep {} --over gait.amplitude=0.3,0.6 -o x.nc", "trajectory {} --cycles 3", "forces {}", "accuracy {}",
        "optimize {} --objective speed", "optimize {} --objective efficiency --starts 3",
    ),
    "intruder": ("intrude {}", "accuracy {}"),
    "walker": ("walk {}", "sweep {} --over gait.frequency=1,2 -o x.nc", "accuracy {}"),
}  # fmt: skip
SLOW = re.compile(
    "(accuracy|optimize) (sandfish|shovel)|sandbot|(walk|sweep) screws|-close|coulomb"
)  # gaits or falls come first


def costs():
    """What is said to be needed before anything is computed: balances, memory, and, but for walks, of which some steps are
    timed, seconds, other seconds, and steps."""
    told: list[cost.Cost] = []
    with (
        pytest.MonkeyPatch.context() as patch,
        backend.preferring("numpy"),
        frozen.place(),
    ):
        patch.setattr(
            pipeline,
            "decide",
            lambda asked, judge: told.append(asked) or asked.check("", False),
        )
        patch.setattr(cost, "LONGEST", 0.0)  # nothing is begun
        for kind, lines in ASKED.items():
            for line in (line.format(name) for name in shipped(kind) for line in lines):
                if not SLOW.search(line):
                    frozen.geomech(*line.split())
                    for asked in told:
                        timed = (
                            ()
                            if kind == "walker"
                            else (asked.seconds, asked.besides, asked.steps)
                        )
                        yield f"cost, {line}", [asked.balances, asked.memory, *timed]
                    told.clear()


# The quick ones first, each with what the names of its entries begin with.
PARTS = {
    velocities: ("velocity", "work"),
    commands: ("connection", "sweep", "command"),
    tiers: ("tier",),
    marches: ("march",),
    pairs: ("pair",),
    intrusions: ("intrusion",),
    solids: ("solid",),
    walks: ("walk,",),
    intruders: ("intruder",),
    walkers: ("walker",),
    measurements: ("measured",),
    costs: ("cost",),
}


def compute(*parts) -> dict[str, list[float]]:
    """Every entry's numbers as the code gives them now, of all parts if none is named."""
    every = itertools.chain.from_iterable(part() for part in parts or PARTS)
    return {
        name: [float(f"{x:.15g}") for x in np.ravel(values)] for name, values in every
    }


def kept(*parts) -> dict[str, list[float]]:
    """What is recorded, of all parts if none is named."""
    every = json.loads(FILE.read_text()) if FILE.exists() else {}
    begin = tuple(b for part in parts for b in PARTS[part]) or ""
    return {name: x for name, x in every.items() if name.startswith(begin)}


def change(old: list[float] | None, new: list[float] | None) -> float:
    """Largest difference over the largest number; infinite where an entry is missing or has another size."""
    if old is None or new is None or len(old) != len(new):
        return np.inf
    off, size = (
        np.abs(np.subtract(old, new)).max(initial=0.0),
        np.abs([*old, *new]).max(initial=0.0),
    )
    return off / size if size else 0.0


def changed(old: dict, new: dict) -> dict[str, float]:
    """Entries that are not what they were, and by how much."""
    every = {
        name: change(old.get(name), new.get(name)) for name in sorted({*old, *new})
    }
    loose = lambda name: (
        "estimate" in name
        or name.startswith(
            ("walk", "measured, log", "measured, rod", "measured, plates")
        )
    )
    allowed = lambda name: (
        OF_RESIDUALS
        if "residuals, F_" in name
        else OF_ESTIMATES
        if loose(name)
        else TOLERANCE
    )
    return {k: x for k, x in every.items() if not x <= allowed(k)}


def table(old: dict, new: dict) -> str:
    """A line for every entry that changed: its number that moved most, old and new, and the relative change."""
    lines = [f"{'entry':64} {'old':>22} {'new':>22} {'change':>9}"]
    for name, x in changed(old, new).items():
        was, now = old.get(name), new.get(name)
        if was is None or now is None or len(was) != len(now):
            said = [
                f"{len(v)} numbers" if v is not None else "none" for v in (was, now)
            ]
        else:
            most = np.abs(np.subtract(was, now)).argmax()
            said = [f"{v[most]:.15g}" for v in (was, now)]
        lines.append(f"{name:64} {said[0]:>22} {said[1]:>22} {x:9.1e}")
    return (
        "\n".join(lines)
        if len(lines) > 1
        else f"all {len(new)} entries as recorded, to {TOLERANCE:g}"
    )


def write(old: dict, new: dict) -> None:
    """One entry a line, sorted; what did not change keeps its digits."""
    moved = changed(old, new)
    lines = [
        f"{json.dumps(name)}: {json.dumps(new[name] if name in moved else old[name])}"
        for name in sorted(new)
    ]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    old, new = kept(), compute()
    print(table(old, new))
    if "--write" in sys.argv[1:]:
        write(old, new)
        frozen.write()
        raised = f"raise rft.SOLVER too (now {rft.SOLVER}): unfinished sweeps of before are not gone on with"
        print(f"recorded in {FILE.parent}; {raised}")
    elif changed(old, new):
        sys.exit(
            "not as recorded; if that is meant: python tests/tools/golden.py --write"
        )
