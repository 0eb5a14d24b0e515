"""Golden numbers of every medium, body, effect and built-in scene, in data/golden.json.

    python tests/tools/golden.py            tells which entries changed, and how much
    python tests/tools/golden.py --write    records them, and what `frozen` has; what
    did
                                            not change keeps its digits

They guard against a change that nobody meant; other tests say what is right. `frozen`
keeps words and files likewise, and is written with them. Everything goes through the
command line, `geomech` and the doors of rft that are named below.

Regularisation is 1e-3 in place of 1e-6: an element at rest, or one that slides along
itself, makes a balance as badly conditioned as 1 / regularisation, and the last digits
would be those of the solver's path. For the same reason balances are solved to the
smallest tolerance there is: along another path all come out within 6e-13. Only errors
contain the residual, which is rounding.
"""

import contextlib
import itertools
import json
import pathlib
import re
import sys
import warnings

import beds
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
from geomech.io.results import from_dict
from geomech.mathematics.systems.capabilities import solver_of
from geomech.questions.shared import names
from geomech.runs import cost
from geomech.shell import pipeline
from rft.balance import backend
from rft.terradynamics.meshes import Spatial, wrench
from rft.terradynamics.plates import loads
from rft.terradynamics.walking import Fineness, engine

FILE = pathlib.Path(__file__).parents[1] / "data" / "golden.json"
# Tolerances, relative to the largest number of an entry: the least, that of errors and
# of what is solved or fitted to a tolerance, and that of the residuals of rod.csv, 2e-5
# N of forces of 3.7 N, whose roundoff differs between processors by 4e-12 N.
TOLERANCE = 1e-12
LOOSE_TOLERANCE = 1e-8
RESIDUAL_TOLERANCE = 1e-6
LOOSE = ("walk", "measured, log", "measured, rod", "measured, plates")
LOOSE += ("form", "picture", "grains")
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
    """Return alpha, alphadot (4, joints): a generic pose, a straight body of which one
    joint moves, a curled one whose joints move alike (links stick), and a zigzag with
    joints of very different speed."""
    k = np.arange(joints)
    alpha = [0.8 * np.cos(1.7 * k + 0.4), 0.0 * k, 0.0 * k + 1.5, 2.0 * (-1.0) ** k]
    alphadot = [np.sin(2.3 * k + 0.9), k == 0, 0.0 * k + 0.3, 10.0 ** (-2.0 * (k % 3))]
    return np.stack(alpha), np.stack(alphadot).astype(float)


def velocities():
    for (medium, law), (name, body) in itertools.product(MEDIA.items(), BODIES.items()):
        alpha, alphadot = shapes(body.joints)
        xi = rft.body_velocity(law, body, alpha, alphadot, **SOLVED).checked().xi
        yield f"velocity, {medium}, {name}", xi
        at_first = alpha[:1], alphadot[:1], xi[:1]
        work = rft.work_done(law, body, *at_first, regularisation=1e-3)
        numbers = [*work.power, *work.slip, *work.bending_moment[0]]
        yield f"work, {medium}, {name}", numbers


def tiers():
    for name in names.scene_names():
        scene = geomech.load(name)
        numerics = COARSE
        if not solver_of(scene.system):
            numerics = {key: COARSE[key] for key in GEOMETRY}
        study = geomech.Study(scene.with_numerics(**numerics)).tables
        amplitudes = scene.gait.amplitude * np.array([0.6, 1.0])
        for tier in study.tiers:
            yield f"tier, {name}, {tier}", study.poses(tier, None, amplitudes)


def march(some, cycles=2):
    """Return net pose, velocities, power and moments of a march under effects that are
    strong enough to matter."""
    body = rft.Chain((1, 1.4, 0.8), frame="link-2")
    gait = geomech.mathematics.gaits.Ellipse(
        semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2)
    )
    effects = [EFFECTS[name][0](0.05) for name in some]
    options = {**SOLVED, "effects": effects, "cycles": cycles, "with_work": True}
    medium = MEDIA["glass-0.3mm-loose"]
    steps = rft.time_steps(medium, body, *gait.cycle(8), **options)
    work = steps.work
    moments = work.bending_moment[[2, 6]].ravel()
    return [*steps.displacement, *steps.xi[3], *work.power[[2, 6]], *moments]


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
    """Return what a command of geomech prints; it must end well."""
    code, out, err = frozen.geomech(*args)
    if code != "0":
        raise RuntimeError(f"geomech {' '.join(args)} ended with {code}: {err}")
    return out


def digest(values) -> list[float]:
    """Return an array in few numbers: some of it, its root mean square, and a mean with
    weights, which any change alters. What is below 1e-9 is rounding, or nearly."""
    flat = np.ravel(np.array(values, float))
    if flat.size > 12:
        some = flat[np.linspace(0, flat.size - 1, 7).astype(int)]
        known = np.nan_to_num(flat)
        weighted = known * np.cos(1.0 + np.arange(flat.size))
        flat = np.array([*some, np.sqrt((known**2).mean()), weighted.mean()])
    return np.where(np.abs(flat) < 1e-9, 0.0, flat).tolist()


# Components of one vector make one entry: one that vanishes is rounding of the others.
VECTORS = {"x": "place", "y": "place", "z": "place"}
VECTORS |= {"pitch": "attitude", "roll": "attitude", "yaw": "attitude"}
# Times, what is chosen by them, and how a solver came to its end.
UNRECORDED = {"seconds", "computed_before", "iterations", "evaluations", "kept"}
UNRECORDED |= {"best_value", "best_error", "best_seconds"}


def of_result(name: str, result, digest=digest):
    """Yield an entry for each variable of a result, or vector of variables, and one for
    its error."""
    found: dict[str, list] = {}
    for variable in result.variables:
        key = variable.name
        if key in UNRECORDED or variable.is_text:
            continue
        if key == "residual" and variable.values.ndim == 0:
            continue
        vector = VECTORS.get(key, re.sub("_[xyz]$", "", key))
        for part, values in (("", variable.values), (", error", variable.error)):
            if values is not None:
                entry = found.setdefault(f"{name}, {vector}{part}", [])
                entry.extend(digest(values))
    yield from found.items()


def printed(name: str, *args: str):
    """Yield the entries of the result that a command prints as JSON."""
    result = from_dict(json.loads(command(*args, "--json")))
    yield from of_result(name, result)


def commands():
    """A connection and a sweep from their files; what two commands print."""
    with frozen.place() as here:
        (here / "scene.toml").write_text(SCENE)
        command("connection", "scene.toml", "-o", "out.nc")
        yield from of_result("connection", geomech.load_result("out.nc"), np.ravel)
        over = ["--over", "gait.amplitude=0.5,1.0", "--over", "medium.C=1,3"]
        command("sweep", "scene.toml", *over, "-o", "out.nc")
        yield from of_result("sweep", geomech.load_result("out.nc"))
        shape = ["--alpha", "0.4,-0.9", "--alphadot", "1,0.5"]
        yield from printed("command, velocity", "velocity", "scene.toml", *shape)
        ask = ["displacement", "scene.toml", "--amplitudes", "0.5,1.0"]
        yield from printed("command, displacement", *ask)


def intrusions():
    """Every stress map and outline: out of the ground, across the surface, deep and
    turning about itself, and at an angle."""
    pose = [(0.0, 0.1, 0.3), (0.1, -0.01, 0.7), (0.0, -0.2, -1.2), (-0.3, -0.04, 2.5)]
    twist = [(1.0, 0.0, 0.0), (0.02, -0.03, 1.1), (0.0, 0.0, -2.0), (-0.1, 0.04, 0.3)]
    pairs = itertools.product(STRESSES.items(), OUTLINES.items())
    for (medium, stress), (name, shape) in pairs:
        load = loads(stress, shape.outline(30), pose, twist)
        numbers = np.column_stack([load.force, load.moment])
        yield f"intrusion, {medium}, {name}", numbers


def solids():
    """Every body of three dimensions, under the ground and across its surface, plain
    and with each effect."""
    medium = Spatial(3e5, 0.3)
    place = [(0.02, 0.1, -0.01), (-0.05, 0.0, -0.2)]
    turn = Rotation.from_rotvec([(0.3, -0.7, 0.2), (1.0, 2.0, -0.4)]).as_matrix()
    moving = [-0.3, 0.1, -0.4], [2.0, 9.0, 1.0]
    effects = {name: [make(0.4)] for name, (make, _) in GROUND_EFFECTS.items()}
    pairs = itertools.product(SOLIDS.items(), {"plain": [], **effects}.items())
    for (name, body), (effect, some) in pairs:
        load = wrench(medium, body.mesh(300), turn, place, *moving, some)
        numbers = np.column_stack([load.force, load.moment, load.power])
        yield f"solid, {name}, {effect}", numbers


def walks():
    """Every robot after a cycle, and its speed in the end; steps are solved to 1e-3 of
    the rounding, not to the last digit."""
    coarse = Fineness(steps=8, elements=4, rounding=0.01)
    walks = engine("planar").walk(list(WALKERS.values()), coarse, 1)
    for name, walk in zip(WALKERS, walks):
        ends = [*walk.pose[-1], *walk.twist[-1], walk.work[-1], walk.loss[-1]]
        yield f"walk, {name}", [*ends, walk.speed]


def intruders():
    """The intruder scenes that ship, of few pieces."""
    with frozen.place() as here:
        for name in names.intruder_names():
            numerics = "elements = 40"
            if hasattr(geomech.load(name), "mesh"):
                numerics = "triangles = 400"
            text = command("scenes", "--show", name)
            (here / "scene.toml").write_text(f"{text}\n[numerics]\n{numerics}\n")
            yield from printed(f"intruder, {name}", "intrude", "scene.toml")


def walkers():
    """The robots that ship, coarsely: a fifth of a second, in few steps."""
    coarse = "[numerics]\nsteps = 8\nelements = 4\nrounding = 0.02\nduration = 0.2\n"
    with frozen.place() as here:
        for name in names.walker_names():
            text = re.sub(r"\[numerics\][^[]*", "", command("scenes", "--show", name))
            (here / "scene.toml").write_text(f"{text}\n{coarse}")
            yield from printed(f"walker, {name}", "walk", "scene.toml", "--yes")


MEASURED = {
    "table.toml": "displacement table.toml --amplitudes 0.4,0.8",
    "matrix.toml": "displacement matrix.toml --amplitudes 0.4,0.8",
    "snake.toml": "displacement snake.toml --amplitudes 0.5,1",
    "log.csv": "fit-gait log.csv --harmonics 1",
    "plates.csv": "fit-medium plates.csv",
    "push.csv": "fit-medium push.csv",
    "rod.csv": "fit-medium rod.csv",
}


def measurements():
    """Tables and measured gaits of data/frozen: what they predict, and what is fitted
    to measurements."""
    with frozen.place():
        for name, line in MEASURED.items():
            yield from printed(f"measured, {name}", *line.split())


# A chain whose field has a frame of its own, and one that is paced.
FRAMED = SCENE.replace('"link-1"', '"minimum-perturbation"')
PACED = SCENE.replace("[numerics]", "frequency = 2.0\n[numerics]")
FORMS = {
    "metric": "ccf viscous.toml --metric",
    "stretched": "ccf viscous.toml --stretch --plot a.png",
    "compared frames": "ccf scene.toml --compare-frame minimum-perturbation",
    "slice": "ccf four.toml --pair 1,3 --slice 0.2,0.1,-0.3",
    "all slices": "ccf four.toml",
    "connection of a slice": "connection four.toml --pair 2,3 --slice 0.2,0.1,-0.3",
    "connections compared": "connection scene.toml --compare-frame link-2",
    "velocity of a table": "velocity table.toml --alpha 0.3,0.2 --alphadot 1,0.5",
    "velocity in a frame": "velocity framed.toml --alpha 0.3,0.2 --alphadot 1,0.5",
    "displacement in a frame": "displacement framed.toml --amplitudes 0.5,1",
    "effort": "displacement paced.toml --amplitudes 0.5,1 --effort",
    "cycles": "trajectory paced.toml --cycles 2",
    "cycles in a frame": "trajectory framed.toml --cycles 2",
    "cycles of a table": "trajectory table.toml --cycles 2",
    "forces": "forces paced.toml --radius 0.02 --stress 900",
    "forces of a backbone": "forces bends.toml",
    "optimum, efficiency": (
        "optimize scene.toml --objective efficiency --harmonics 1 --starts 1"
    ),
    "optimum, speed": (
        "optimize viscous.toml --objective speed --harmonics 1 --rate 3 --power 2"
    ),
    "optimum, stretched": "optimize viscous.toml --harmonics 1 --stretch --plot a.png",
    "sweep of speeds": "sweep paced.toml --over medium.gamma0_deg=10:20:3",
    "sweep of lengths": "sweep scene.toml --over body.length=0.2,0.4",
    "stress": "stress grains.toml --beta 30 --gamma -50",
    "midlines": "fit-gait trial.csv --medium glass-0.3mm-close",
    "accuracy of a gait": "accuracy viscous.toml --runs 1",
    "accuracy of an intruder": "accuracy leg.toml --runs 1",
    "accuracy of a walker": "accuracy walk.toml --runs 1",
}


@contextlib.contextmanager
def scene_files():
    """A copy of data/frozen with the scenes of `forms` and `pictures`."""
    viscous = geomech.load("three-link-viscous").text + "\n[numerics]\nphases = 32\n"
    with frozen.place() as here:
        (here / "scene.toml").write_text(SCENE)
        (here / "framed.toml").write_text(FRAMED)
        (here / "paced.toml").write_text(PACED)
        (here / "viscous.toml").write_text(f"{viscous}grid = 9\nharmonics = 5\n")
        yield


def forms():
    """Questions in the forms that other entries leave out: slices, metrics, frames,
    other objectives, settings of each kind of scene. Of an optimum only values: where
    it lies is known to the root of their digits."""
    with scene_files():
        for name, line in FORMS.items():
            for entry, numbers in printed(f"form, {name}", *line.split()):
                if not name.startswith("optimum") or entry.endswith("value"):
                    yield entry, numbers
        for name in ("four", "table"):
            everything = geomech.study(f"{name}.toml").run()
            yield from of_result(f"form, all of {name}", everything)


def grains():
    """Runs of bodies that obey a law, in place of those of LAMMPS."""
    with scene_files(), pytest.MonkeyPatch.context() as patch:
        beds.obey(patch)
        swim = geomech.study("scene.toml").grains(cycles=2, store="swim")
        yield from of_result("grains, swim", swim)
        angles = (0.0, 20.0, 60.0, 90.0)
        drag = geomech.drag_grains(angles=angles, beds=2, store="drag")
        yield from of_result("grains, drag", drag)


# A question, its subject, its fields, and options of its picture.
PICTURES = {
    "ccf": ("ccf", "scene.toml", {}, {}),
    "ccf, one": ("ccf", "viscous.toml", {}, {"component": "theta", "clim": 0.1}),
    "ccf, metric": ("ccf", "viscous.toml", {"metric": True}, {}),
    "ccf, stretched": ("ccf", "viscous.toml", {"stretched": True}, {"stretch": True}),
    "ccf, frames": ("ccf", "scene.toml", {"compare_frame": "link-2"}, {}),
    "ccf, slices": ("ccf", "four.toml", {}, {}),
    "ccf, slices in frames": (
        "ccf",
        "four.toml",
        {"pair": "1,3", "compare_frame": "link-1"},
        {"clim": "90%"},
    ),
    "connection": ("connection", "scene.toml", {}, {"component": ("y", "x")}),
    "connection, frames": (
        "connection",
        "scene.toml",
        {"compare_frame": "link-2"},
        {"clim": "95%"},
    ),
    "connection, slice": ("connection", "four.toml", {"pair": "2,3"}, {}),
    "displacement": ("displacement", "scene.toml", {"amplitudes": (0.5, 1.0)}, {}),
    "displacement, data": (
        "displacement",
        "plain.toml",
        {"amplitudes": (0.5, 1.0), "tiers": ("path", "direct")},
        {"component": "x", "data": "moved.csv"},
    ),
    "forces": (
        "forces",
        "paced.toml",
        {},
        {"component": ("normal", "moment"), "clim": "90%"},
    ),
    "trajectory": ("trajectory", "scene.toml", {"cycles": 2}, {}),
    "sweep": ("sweep", "scene.toml", {"over": {"gait.amplitude": [0.3, 0.8]}}, {}),
    "sweep of two": (
        "sweep",
        "paced.toml",
        {"over": {"gait.amplitude": [0.3, 0.8], "medium.C": [1.0, 2.0]}},
        {},
    ),
    "walk": ("walk", "walk.toml", {}, {}),
    "strip": ("walk", "walk.toml", {}, {"strip": True}),
    "intrude": ("intrude", "leg.toml", {}, {}),
    "intrude, solid": ("intrude", "wedge.toml", {}, {}),
    "rod": ("fit_medium", "rod.csv", {}, {}),
    "plates": ("fit_medium", "plates.csv", {}, {}),
    "push": ("fit_medium", "push.csv", {}, {}),
    "log": ("fit_gait", "log.csv", {"harmonics": 1}, {}),
    "trial": ("fit_gait", "trial.csv", {"medium": "glass-0.3mm-close"}, {}),
}


def drawn(axes) -> list[float]:
    """Return the data of an Axes' lines and collections in few numbers."""
    numbers: list[float] = []
    for line in axes.lines:
        numbers += digest(line.get_xydata())
    for collection in axes.collections:
        vertices = [path.vertices for path in collection.get_paths()]
        numbers += digest(np.concatenate([np.zeros((0, 2)), *vertices]))
        numbers += digest(np.ma.filled(collection.get_offsets(), np.nan))
        if collection.get_array() is not None:
            numbers += digest(np.ma.filled(collection.get_array(), np.nan))
    return numbers


def pictured(*names):
    """Yield the names of PICTURES, their results, and options of their pictures."""
    with scene_files(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in names or PICTURES:
            question, subject, fields, options = PICTURES[name]
            about = geomech
            given = [subject]
            if subject.endswith(".toml"):
                about = geomech.study(subject)
                given = []
            yield name, getattr(about, question)(*given, **fields), options


def pictures():
    """What every question draws."""
    for name, result, options in pictured():
        figure = result.plot(**options)
        for k, axes in enumerate(figure.axes):
            yield f"picture, {name}, axes {k + 1}", drawn(axes)


# Lines whose costs are known in some hundredths of a second, by what they are about.
ASKED = {
    "gait": (
        names.scene_names,
        "displacement {} --amplitudes 0.3,0.9",
        "ccf {}",
        "connection {} -o x.nc",
        "run {} -o d",
        "lab {} -o x.html",
        "sweep {} --over gait.amplitude=0.3,0.6 -o x.nc",
        "trajectory {} --cycles 3",
        "forces {}",
        "accuracy {}",
        "optimize {} --objective speed",
        "optimize {} --objective efficiency --starts 3",
    ),
    "intruder": (names.intruder_names, "intrude {}", "accuracy {}"),
    "walker": (
        names.walker_names,
        "walk {}",
        "sweep {} --over gait.frequency=1,2 -o x.nc",
        "accuracy {}",
    ),
}
# Lines whose gaits or falls come first.
SLOW = (
    "(accuracy|optimize) (sandfish|shovel)|sandbot|(walk|sweep) screws|-close|coulomb"
)


def costs():
    """What is needed before anything is computed: balances, memory, and, but for walks,
    of which some steps are timed, seconds, other seconds, and steps."""
    told: list[cost.Cost] = []

    def refuse(asked, _):
        told.append(asked)
        asked.check("", False)

    with (
        pytest.MonkeyPatch.context() as patch,
        backend.preferring("numpy"),
        frozen.place(),
    ):
        patch.setattr(pipeline, "decide", refuse)
        patch.setattr(cost, "LONGEST", 0.0)  # nothing is begun
        for kind, (known, *lines) in ASKED.items():
            for name, line in itertools.product(known(), lines):
                words = line.format(name)
                if re.search(SLOW, words):
                    continue
                frozen.geomech(*words.split())
                for asked in told:  # none of a scene that is refused
                    numbers = [asked.balances, asked.memory]
                    if kind != "walker":
                        numbers += [asked.seconds, asked.besides, asked.numpy_seconds]
                    yield f"cost, {words}", numbers
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
    forms: ("form",),
    pictures: ("picture",),
    grains: ("grains",),
    costs: ("cost",),
}


def compute(*parts) -> dict[str, list[float]]:
    """Return every entry's numbers as the code gives them now, of all parts if none is
    named."""
    entries = itertools.chain.from_iterable(part() for part in parts or PARTS)
    return {name: [float(f"{x:.15g}") for x in np.ravel(v)] for name, v in entries}


def kept(*parts) -> dict[str, list[float]]:
    """Return what is recorded, of all parts if none is named."""
    begin = tuple(b for part in parts for b in PARTS[part]) or ""
    entries = json.loads(FILE.read_text())
    return {name: x for name, x in entries.items() if name.startswith(begin)}


def change(old: list[float] | None, new: list[float] | None) -> float:
    """Return the largest difference over the largest number; infinite where an entry is
    missing, has another size, or other places without a number."""
    if old is None or new is None or len(old) != len(new):
        return np.inf
    pair = np.array([old, new], float)
    unknown = np.isnan(pair)
    if (unknown[0] != unknown[1]).any():
        return np.inf
    difference = np.nanmax(np.abs(pair[0] - pair[1]), initial=0.0)
    if difference == 0.0:
        return 0.0
    return difference / np.nanmax(np.abs(pair))


def allowed(name: str) -> float:
    """Return the tolerance of an entry."""
    if name == "measured, rod.csv, residual":
        return RESIDUAL_TOLERANCE
    if name.endswith("error") or name.startswith(LOOSE):
        return LOOSE_TOLERANCE
    return TOLERANCE


def changed(old: dict, new: dict) -> dict[str, float]:
    """Return the entries that are not what they were, and by how much."""
    changes = {name: change(old.get(name), new.get(name)) for name in {*old, *new}}
    return {name: x for name, x in sorted(changes.items()) if not x <= allowed(name)}


def table(old: dict, new: dict) -> str:
    """Return a line for every entry that changed, with the relative change of its
    number that moved most."""
    lines = [
        f"{name}: {x:.1e}, {old.get(name)} -> {new.get(name)}"
        for name, x in changed(old, new).items()
    ]
    return "\n".join(lines) or f"all {len(new)} entries as recorded, to {TOLERANCE:g}"


def write(old: dict, new: dict) -> None:
    """Write one entry a line, sorted; what did not change keeps its digits."""
    moved = changed(old, new)
    entries = {name: new[name] if name in moved else old[name] for name in sorted(new)}
    lines = [f"{json.dumps(k)}: {json.dumps(x)}" for k, x in entries.items()]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    old = kept()
    new = compute()
    print(table(old, new))
    if "--write" in sys.argv[1:]:
        write(old, new)
        frozen.write()
        print(
            f"recorded in {FILE.parent}; raise rft.SOLVER too (now {rft.SOLVER}): "
            "unfinished sweeps of before are not gone on with"
        )
    elif changed(old, new):
        sys.exit("if that is meant: python tests/tools/golden.py --write")
