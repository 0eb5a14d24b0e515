"""Wrong Python types are refused like wrong numbers: a ValueError of one line, from every public constructor."""

import dataclasses
import importlib
import inspect
import itertools
import math
import pickle

import numpy as np
import pytest
from registry import GAITS, OUTLINES, STRESSES, SYSTEMS
from tabled import swept_table, tabled

import geomech
import rft
from geomech import scenes
from geomech.mathematics.gaits import KINDS, Centreline, Circle, Sine
from geomech.mathematics.geometry import connection, curvature, family, reconstruct
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.systems import Solver, Swimmer
from geomech.mathematics.tiers.area import area
from geomech.mathematics.tiers.direct import direct
from geomech.mathematics.tiers.path import path
from geomech.scenes import IntruderScene, MeshScene, Numerics, Scene, WalkerScene, kinds
from geomech.shell.describe.scene import description
from geomech.studies.displacement import sweep
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.mechanics import undulation
from geomech.studies.mechanics.single import diagnosed_velocity
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Coulomb, Granular, Viscous, body_velocity
from rft.core.refusal import Refusal, located
from rft.formulas import se2
from rft.terradynamics import ground, meshes
from rft.terradynamics.plates import SHAPES, Drag, Path, Penetrate, Rotate
from rft.terradynamics.walking import Fineness, Rhex, Roller, Screws, Tripod, Walker

WRONG = {
    "None": None, "text": "x", "digits": "12", "bytes": b"1", "empty": [], "list": [1.0, 2.0, 3.0, 4.0, 5.0], "deep": [[1.0]],
    "ragged": [[1.0], 2.0], "words": ["1", "2"], "dict": {"a": 1}, "object": object(), "function": lambda x: x, "class": Chain,
    "complex": 1j, "nan": math.nan, "inf": math.inf, "true": True, "huge": 10**400, "endless": 10**5000,
    "array": np.eye(2), "many": np.zeros((40, 40)), "numpy nan": np.float32("nan"), "set": {1.0, 2.0},
    "date": np.datetime64("2020"),
}  # fmt: skip
RHEX = Rhex(0.2, 0.15, 0.03, 0.06, OUTLINES["c-leg"], (-0.05, 0.05))
SCREWS = Screws(0.2, 0.15, 0.12, 0.03, meshes.Screw(0.03, 0.01, 0.02, 0.1, 0.003), 0.1)
PARTS = {
    "Granular": Granular(1.8, 0.24), "Surface": rft.Surface(0.2, 0.06, 9.0), "Viscous": Viscous(),
    "Table": rft.Table((0, 0.4, 0.8, 1.5), (1, 1, 0.7, 0), (0, 1, 2, 3)), "Chain": Chain(), "Backbone": rft.Backbone(8),
    "Serpenoid": rft.Serpenoid(8), "ConstantCurvature": rft.ConstantCurvature(8), "SkinFriction": rft.SkinFriction(),
    "EndCaps": rft.EndCaps(0.06), "DepthProfile": rft.DepthProfile(), "GrainInertia": rft.GrainInertia(1.0, 0.1, 0.1),
    "BodyInertia": rft.BodyInertia(1.0, 1.0, 1.0, 1.0), "Transient": rft.Transient(0.1), "TowedSled": rft.TowedSled(0.1),
    "Incline": rft.Slope(0.2),
    "DisturbedGround": rft.DisturbedGround(0.05, 0.1), "Numerics": Numerics(), "Solver": Solver(),
    "Swimmer": Swimmer(Coulomb(), Chain()), "Scene": Scene(Swimmer(Coulomb(), Chain()), Circle()),
    "table, system": SYSTEMS["table"],
    **{name: SYSTEMS[name] for name in ("no-slip-snake", "differential-drive", "ideal-fluid-swimmer", "floating-chain")},
    "Sine": Sine(elements=8), **{type(gait).__name__: gait for gait in GAITS.values()},
    **{name: OUTLINES[name] for name in SHAPES}, **{name: STRESSES[name] for name in ("generic", "measured")},
    "Outline": OUTLINES["c-leg"].outline(3), "Drag": Drag(0.1), "Penetrate": Penetrate(0.1), "Rotate": Rotate(0.1),
    "Path": Path((0, 1, 2), (0, 1, 2), (0, 1, 0)),
    "IntruderScene": IntruderScene(STRESSES["generic"], OUTLINES["plate"], Drag(0.1)),
    "Aeration": ground.Aeration(0.01, 0.03), "GrainPressure": ground.GrainInertia(), "Slope": ground.Slope(0.1),
    "DisturbedPlaces": ground.DisturbedGround((0.0,), 0.02, 0.5), "Spatial": meshes.Spatial(3e5),
    "Sphere": meshes.Sphere(0.02), "Cylinder": meshes.Cylinder(0.02, 0.1), "Screw": meshes.Screw(0.03, 0.01, 0.02, 0.1),
    "Leg": meshes.Leg(0.04, 0.02, 0.003), "SpatialDrag": meshes.Drag(0.1), "SpatialPenetrate": meshes.Penetrate(0.1),
    "SpatialRotate": meshes.Rotate(0.1), "SpatialPath": meshes.Path(*[(0, 1, 2)] * 4),
    "MeshScene": MeshScene(meshes.Spatial(3e5), meshes.Sphere(0.02), meshes.Drag(0.1), triangles=20),
    "Tripod": Tripod(2.0), "Rhex": RHEX, "Roller": Roller(1.0, OUTLINES["wheel"]), "Screws": SCREWS, "Fineness": Fineness(),
    "Walker": Walker(RHEX, Tripod(2.0), STRESSES["generic"]),
    "WalkerScene": WalkerScene(STRESSES["generic"], RHEX, Tripod(2.0)),
}  # fmt: skip
RIGHT = {  # what looks wrong and is not
    ("Rhex", "inertia", "None"), ("Rhex", "aside", "None"), ("Fineness", "engine", "None"),
    ("harmonics", "None"),
    ("centre", "empty"), ("reverse", "true"), ("directions", "None"), ("cycles", "None"), ("effects", "empty"), ("k", "None"),
    ("covariance", "None"), ("Granular", "covariance", "array"), ("Viscous", "covariance", "deep"),
    *((type(gait).__name__, "frequency", "None") for gait in (*GAITS.values(), Sine(elements=8))),
    ("Chain", "lengths", "list"), ("masses", "empty"), ("inertias", "empty"),
    ("along", "list"), ("cos", "array"), ("sin", "array"), ("modes", "None"), ("modes", "array"),
    ("Chain", "waves", "None"), ("EndCaps", "across", "None"), ("differential-drive", "track", "None"),
    *((name, "length", "None") for name in ("Chain", "Backbone", "Serpenoid", "ConstantCurvature", "Positions")),
    *((name, "length", "None") for name in ("no-slip-snake", "ideal-fluid-swimmer", "floating-chain")),
    *((name, "None") for name in ("radius_m", "travel_m", "distance_m", "slope_per_m")),
    ("closed", "true"), ("Path", "angle", "empty"),
    ("places", "list"), *itertools.product(("SpatialPath",), ("rx", "ry", "rz"), ("empty",)),
    ("smooth_normals", "None"), ("body_length", "None"),
    ("table, system", "body", "None"), ("table, system", "medium", "None"), ("Shchf", "file", "None"),
    *itertools.product(("name", "text", "matched"), ("text", "digits")),
}  # fmt: skip


@pytest.mark.parametrize("kind", PARTS)
def test_no_constructor_takes_a_wrong_type(kind):
    names = [f.name for f in dataclasses.fields(PARTS[kind])]
    for field, (wrong, value) in itertools.product(names, WRONG.items()):
        if (field, wrong) in RIGHT or (kind, field, wrong) in RIGHT:
            dataclasses.replace(PARTS[kind], **{field: value})
            continue
        with pytest.raises(ValueError, match=".") as caught:
            dataclasses.replace(PARTS[kind], **{field: value})
        assert "\n" not in str(caught.value), (field, wrong)
        assert len(str(caught.value)) < 450, (field, wrong)


def test_every_public_class_is_in_the_table():
    public = [getattr(rft, name) for name in rft.__all__] + list(KINDS.values())
    outputs = {rft.Refusal, rft.Solution, rft.TimeSteps, rft.Work}
    made = {
        c
        for c in public
        if isinstance(c, type) and not getattr(c, "_is_protocol", False)
    } - outputs
    assert made - {type(part) for part in PARTS.values()} == {
        Coulomb,
        Centreline,
    }  # without parameters; with a file


@pytest.mark.parametrize(
    "value", [0.5, 1, np.float32(0.5), np.float64(0.5), np.int64(1)]
)
def test_numbers_of_every_make_are_taken(value):
    assert Granular(C=value, gamma0=0.24).C == value
    assert Chain(length=value).length == value
    assert repr(Circle(amplitude=value, frequency=value)) == repr(
        Circle(amplitude=float(value), frequency=float(value))
    )
    assert (
        rft.Backbone(np.int32(5)).joints
        == rft.Backbone(5.0).joints
        == Sine(elements=5.0, waves=1).joints
        == 4
    )
    assert Chain(np.array([1, 2])) == Chain([1, 2]) == Chain((1.0, 2.0))
    assert Numerics(grid=np.int64(9)).grid == 9


STILL = np.zeros(2)


def body_velocities(value):
    yield "medium", lambda: body_velocity(value, Chain(), STILL, STILL)
    yield "body", lambda: body_velocity(Coulomb(), value, STILL, STILL)
    yield "alpha", lambda: body_velocity(Coulomb(), Chain(), value, STILL)
    yield "alphadot", lambda: body_velocity(Coulomb(), Chain(), STILL, value)
    for name in ("loads", "regularisation", "tolerance", "threads", "effects"):
        yield (
            name,
            lambda name=name: body_velocity(
                Coulomb(), Chain(), STILL, STILL + 1, **{name: value}
            ),
        )
    still = np.zeros((8, 2))
    for name in ("loads", "regularisation", "tolerance", "cycles", "effects"):
        yield (
            name,
            lambda name=name: rft.time_steps(
                Coulomb(), Chain(), still, still + 1, **{name: value}
            ),
        )
    yield "medium", lambda: rft.time_steps(value, Chain(), still, still + 1)
    yield "body", lambda: rft.time_steps(Coulomb(), value, still, still)
    yield "alpha of a gait", lambda: rft.time_steps(Coulomb(), Chain(), value, still)
    yield "medium", lambda: rft.work_done(value, Chain(), STILL, STILL, np.zeros(3))
    yield "body", lambda: rft.work_done(Coulomb(), value, STILL, STILL, np.zeros(3))
    yield "xi", lambda: rft.work_done(Coulomb(), Chain(), STILL, STILL, value)


def geometries(value):
    def velocity(alpha, alphadot):
        return np.zeros((*np.broadcast_shapes(alpha.shape, alphadot.shape)[:-1], 3))

    plain = scenes.load("three-link-viscous")
    fitted = connection.fit(velocity, connection.grid(2, 5))
    yield "joints", lambda: connection.grid(value, 5, 1.0)
    yield "grid", lambda: connection.grid(2, value, 1.0)
    yield "extent", lambda: connection.grid(2, 5, value)
    yield "joints", lambda: connection.directions(value, 64)
    yield "directions", lambda: connection.directions(2, value)
    axes, table = connection.grid(2, 6), family.fit(velocity, Circle(), 1.0, 4, 8)
    yield "velocity", lambda: connection.fit(value, axes)
    for fit in (connection.fit, harmonics.fit):
        yield "axes", lambda fit=fit: fit(velocity, value)
        yield "directions", lambda fit=fit: fit(velocity, axes, value)
        yield "degree", lambda fit=fit: fit(velocity, axes, 24, value)
        yield "progress", lambda fit=fit: fit(velocity, axes, progress=value)
    yield "highest", lambda: harmonics.fit(velocity, axes, highest=value)
    yield "phases", lambda: family.fit(velocity, Circle(), 1.0, 4, value)
    yield "least", lambda: family.fit(velocity, Circle(), 1.0, 4, 8, least=value)
    yield "family's amplitudes", lambda: table.area(value)
    for of in (
        curvature.ccf,
        curvature.error,
        curvature.exterior_derivative,
        curvature.lie_bracket,
    ):
        yield "connection", lambda of=of: of(value)
        yield "joint", lambda of=of: of(fitted, value)
    yield "axes", lambda: Field(value, fitted.A)
    yield "values", lambda: Field(fitted.axes, value)
    yield "degree", lambda: Field(fitted.axes, fitted.A, value)
    yield "axis", lambda: fitted.field.derivative(value)
    yield "rate", lambda: fitted.velocity(STILL, value)
    yield "field", lambda: area(value, Circle())
    yield "phases", lambda: area(curvature.ccf(fitted), Circle(), 0.5, value)
    yield "xi", lambda: reconstruct.turning(value)
    yield "pose", lambda: se2.exp(value)
    yield "a scene", lambda: description(value)
    for of in (
        scenes.toml,
        scenes.tables,
        scenes.inputs,
        geomech.accuracy,
        undulation.activation,
    ):
        yield "a scene", lambda of=of: of(value)
    yield "a scene", lambda: tabled(cheapest_displacements(value, [1.0], 0.1))
    yield "a scene", lambda: swept_table(sweep.sweep(value, {"gait.amplitude": [1.0]}))
    yield "over", lambda: swept_table(sweep.sweep(plain, value))
    yield "a list", lambda: swept_table(sweep.sweep(plain, {"gait.amplitude": value}))
    yield "a list", lambda: tabled(cheapest_displacements(plain, value, 0.1))
    yield (
        "gait of the scene",
        lambda: tabled(cheapest_displacements(plain, [1.0], 0.1, value)),
    )
    yield "gait of the scene", lambda: SceneTables(plain).table("adapted", value)
    yield "tier", lambda: SceneTables(plain).plan(value)
    yield "system", lambda: plain.changed(system=value)
    yield "one shape", lambda: diagnosed_velocity(plain.system, value, [1, 0])
    for tier in (path, direct):
        yield "velocity", lambda tier=tier: tier(value, Circle())
        yield "gait", lambda tier=tier: tier(velocity, value)
        yield "gait", lambda tier=tier: tier(velocity, value, [1.0])
        yield "phases", lambda tier=tier: tier(velocity, Circle(), phases=value)
    yield "amplitudes", lambda: direct(velocity, Circle(), amplitudes=value)
    yield "gait", lambda: area(curvature.ccf(fitted), value)
    yield "gait", lambda: family.fit(velocity, value, 1.0)
    yield "largest", lambda: family.fit(velocity, Circle(), value)
    yield "curves", lambda: family.fit(velocity, Circle(), 1.0, value)
    yield "gait of the scene", lambda: SceneTables(plain).poses("direct", value)
    yield "tier", lambda: SceneTables(plain).poses(value)
    yield "amplitudes", lambda: SceneTables(plain).poses("direct", amplitudes=value)
    for ask in (SceneTables(plain).displacements, SceneTables(plain).cost):
        yield "gait of the scene", lambda ask=ask: ask([1.0], ["direct"], value)
        yield "amplitudes of a study", lambda ask=ask: ask(value, ["direct"])
        yield "tiers", lambda ask=ask: ask([1.0], value)
    yield "gait of the scene", lambda: plain.cycle(value)
    yield "shape", lambda: fitted(value)
    yield "xi", lambda: reconstruct.displacement(value)
    yield "times", lambda: reconstruct.trajectory(np.zeros((4, 3)), value)
    yield "part", lambda: kinds.register(value)
    yield "plugin", lambda: kinds.load_file(value)
    yield "scene", lambda: scenes.load(value)
    yield "TOML", lambda: scenes.parse(value)
    yield "tables", lambda: scenes.from_tables(value)
    yield "file", lambda: Centreline(file=value)
    for name in ("loads", "grid", "phases", "extent"):
        yield "a change", lambda name=name: plain.with_numerics(**{name: value})
    yield "tolerance", lambda: tabled(cheapest_displacements(plain, [1.0], value))


TAKEN = {
    *itertools.product(("threads", "cycles", "amplitudes", "gait of the scene", "a change"), ["None"]),
    *itertools.product(["amplitudes"], ("empty", "list", "deep", "array", "many")),
    *itertools.product(["amplitudes of a study"], ("empty", "list")), ("tiers", "empty"), ("tiers", "None"),
    *itertools.product(("alpha", "alphadot", "shape"), ["array"]), *itertools.product(["times"], ("empty", "list")),
    ("effects", "empty"), ("progress", "None"), ("progress", "function"), ("a list", "list"), ("rate", "array"),
    *itertools.product(["family's amplitudes"], ("empty", "deep", "many")), ("rate", "deep"),
    ("family's amplitudes", "array"), ("part", "class"),  # a body that is registered already
}  # fmt: skip


@pytest.mark.parametrize("calls", [body_velocities, geometries])
@pytest.mark.parametrize("wrong", WRONG)
def test_no_function_takes_a_wrong_type(calls, wrong):
    for name, call in calls(WRONG[wrong]):
        if (name, wrong) in TAKEN:
            call()
        elif name != "velocity" or not callable(WRONG[wrong]):
            with pytest.raises(ValueError, match=".") as caught:
                call()
            assert "\n" not in str(caught.value), name
            assert len(str(caught.value)) < 450, (name, str(caught.value))


def test_the_place_is_named():
    for call, said in (
        (lambda: scenes.load(3), "scene must be a name or a TOML file, got 3"),
        (
            lambda: scenes.load("three-link-glass").with_numerics(grid="a"),
            "three-link-glass: grid must be a whole number",
        ),
        (
            lambda: Chain(length="x"),
            "length must be a number from 1e-15 to 1e+15 m, got 'x'",
        ),
        (lambda: Chain(lengths=[[1]]), "lengths must be a list of numbers, got [[1]]"),
        (
            lambda: body_velocity("sand", Chain(), STILL, STILL),
            "medium must be a force law",
        ),
        (lambda: Swimmer(lambda v: v, Chain()), "medium must be a force law"),
        (
            lambda: Scene(Swimmer(Coulomb(), Chain()), [1, 2]),
            "gait must be a gait such as Circle(amplitude=0.5), got [1, 2]",
        ),
        (lambda: direct(len, [1, 2]), "gait must be a gait"),
        (
            lambda: connection.grid(2, 5, "a"),
            "extent must be a number from 1e-09 to 1e+06, got 'a'",
        ),
        (
            lambda: Swimmer(Coulomb(), Chain(), effects=["caps"]),
            "effects must be a list of effects",
        ),
    ):
        with pytest.raises(ValueError, match=".") as caught:
            call()
        assert said in str(caught.value)
    assert issubclass(Refusal, ValueError)


def test_refusals_carry_facts_and_go_to_other_processes():
    with (
        pytest.raises(Refusal) as caught,
        located("own.toml"),
        located("own.toml: [medium]"),
    ):
        raise Refusal(
            "C must be > 0",
            value=-3,
            because="it is a stress",
            instead="give a positive one",
        )
    refusal = pickle.loads(pickle.dumps(caught.value))
    assert (refusal.what, refusal.value, refusal.where) == (
        "C must be > 0",
        -3,
        ("own.toml: [medium]",),
    )
    assert (refusal.because, refusal.instead) == (
        "it is a stress",
        "give a positive one",
    )
    assert (
        str(refusal)
        == "own.toml: [medium] C must be > 0, got -3: it is a stress; give a positive one"
    )


PUBLIC = [
    "geomech",
    "geomech.mathematics.gaits",
    "geomech.mathematics.geometry.connection",
    "geomech.mathematics.geometry.curvature",
    "geomech.mathematics.geometry.reconstruct",
    "geomech.studies.measured",
    "geomech.studies.optimisation",
    "geomech.plots",
    "geomech.scenes",
    "geomech.studies.mechanics.undulation",
    "geomech.mathematics.symbolic",
    "geomech.mathematics.systems",
    "geomech.mathematics.tiers",
    "rft",
    "rft.bodies",
    "rft.effects",
    "rft.laws",
]


def own(part) -> bool:
    return getattr(part, "__module__", "").partition(".")[0] in ("geomech", "rft")


def functions(part):
    """The function that a public name is, or those of the class that it is, inherited ones too."""
    members = [part] if not inspect.isclass(part) else [
        member for base in part.__mro__ if own(base) for name, member in vars(base).items() if not name.startswith("_")
    ]  # fmt: skip
    for member in members:
        inner = (
            getattr(member, "fget", None)
            or getattr(member, "func", None)
            or getattr(member, "__func__", member)
        )
        if inspect.isfunction(inner) and own(inner) and inner.__name__ != "<lambda>":
            yield inspect.unwrap(inner)


@pytest.mark.parametrize("name", PUBLIC)
def test_public_signatures_are_annotated(name):
    """Every parameter and every returned value of what a user can name, so that editors and type checkers know them."""
    module = importlib.import_module(name)
    names = getattr(module, "__all__", None) or [
        x for x in dir(module) if not x.startswith("_")
    ]
    missing = []
    for function in {
        f for x in names if own(part := getattr(module, x)) for f in functions(part)
    }:
        signature = inspect.signature(function)
        parameters = [
            p for p in signature.parameters.values() if p.name not in ("self", "cls")
        ]
        known = {p.name: p.annotation for p in parameters} | {
            "return": signature.return_annotation
        }
        missing += [
            f"{function.__qualname__}: {k}"
            for k, x in known.items()
            if x is inspect.Signature.empty
        ]
    assert missing == []
