"""Wrong Python types are refused like wrong numbers: a ValueError of one line, from
every public constructor."""

import dataclasses
import itertools
import math
import pickle

import numpy as np
import pytest
from refusals import refuses
from registry import GAITS, OUTLINES, STRESSES, SYSTEMS

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
    "None": None,
    "text": "x",
    "digits": "12",
    "bytes": b"1",
    "empty": [],
    "list": [1.0, 2.0, 3.0, 4.0, 5.0],
    "deep": [[1.0]],
    "ragged": [[1.0], 2.0],
    "words": ["1", "2"],
    "dict": {"a": 1},
    "object": object(),
    "function": lambda x: x,
    "class": Chain,
    "complex": 1j,
    "nan": math.nan,
    "inf": math.inf,
    "true": True,
    "huge": 10**400,
    "endless": 10**5000,
    "array": np.eye(2),
    "many": np.zeros((40, 40)),
    "numpy nan": np.float32("nan"),
    "set": {1.0, 2.0},
    "date": np.datetime64("2020"),
}
RHEX = Rhex(0.2, 0.15, 0.03, 0.06, OUTLINES["c-leg"], (-0.05, 0.05))
SCREWS = Screws(0.2, 0.15, 0.12, 0.03, meshes.Screw(0.03, 0.01, 0.02, 0.1, 0.003), 0.1)
PARTS = {
    "Granular": Granular(1.8, 0.24),
    "Surface": rft.Surface(0.2, 0.06, 9.0),
    "Viscous": Viscous(),
    "Table": rft.Table((0, 0.4, 0.8, 1.5), (1, 1, 0.7, 0), (0, 1, 2, 3)),
    "Chain": Chain(),
    "Backbone": rft.Backbone(8),
    "Serpenoid": rft.Serpenoid(8),
    "ConstantCurvature": rft.ConstantCurvature(8),
    "LeggedChain": rft.LeggedChain(),
    "WaveContact": rft.WaveContact(),
    "LinkContact": rft.LinkContact(),
    "FunctionContact": rft.FunctionContact(
        function=lambda s, phase: 1.0 + 0 * s * phase
    ),
    "Touching": rft.Touching(Chain(), rft.WaveContact()),
    "SkinFriction": rft.SkinFriction(),
    "EndCaps": rft.EndCaps(0.06),
    "DepthProfile": rft.DepthProfile(),
    "GrainInertia": rft.GrainInertia(1.0, 0.1, 0.1),
    "BodyInertia": rft.BodyInertia(1.0, 1.0, 1.0, 1.0),
    "Transient": rft.Transient(0.1),
    "TowedSled": rft.TowedSled(0.1),
    "Springs": rft.Springs(stiffness=0.1),
    "Incline": rft.Slope(0.2),
    "DisturbedGround": rft.DisturbedGround(0.05, 0.1),
    "Numerics": Numerics(),
    "Solver": Solver(),
    "Swimmer": Swimmer(Coulomb(), Chain()),
    "Scene": Scene(Swimmer(Coulomb(), Chain()), Circle()),
    "table, system": SYSTEMS["table"],
    **{
        name: SYSTEMS[name]
        for name in (
            "no-slip-snake",
            "differential-drive",
            "ideal-fluid-swimmer",
            "floating-chain",
        )
    },
    "Sine": Sine(elements=8),
    **{type(gait).__name__: gait for gait in GAITS.values()},
    **{name: OUTLINES[name] for name in SHAPES},
    **{name: STRESSES[name] for name in ("generic", "measured")},
    "Outline": OUTLINES["c-leg"].outline(3),
    "Drag": Drag(0.1),
    "Penetrate": Penetrate(0.1),
    "Rotate": Rotate(0.1),
    "Path": Path((0, 1, 2), (0, 1, 2), (0, 1, 0)),
    "IntruderScene": IntruderScene(STRESSES["generic"], OUTLINES["plate"], Drag(0.1)),
    "Aeration": ground.Aeration(0.01, 0.03),
    "GrainPressure": ground.GrainInertia(),
    "Slope": ground.Slope(0.1),
    "DisturbedPlaces": ground.DisturbedGround((0.0,), 0.02, 0.5),
    "Spatial": meshes.Spatial(3e5),
    "Sphere": meshes.Sphere(0.02),
    "Cylinder": meshes.Cylinder(0.02, 0.1),
    "Screw": meshes.Screw(0.03, 0.01, 0.02, 0.1),
    "Leg": meshes.Leg(0.04, 0.02, 0.003),
    "SpatialDrag": meshes.Drag(0.1),
    "SpatialPenetrate": meshes.Penetrate(0.1),
    "SpatialRotate": meshes.Rotate(0.1),
    "SpatialPath": meshes.Path(*[(0, 1, 2)] * 4),
    "MeshScene": MeshScene(
        meshes.Spatial(3e5), meshes.Sphere(0.02), meshes.Drag(0.1), triangles=20
    ),
    "Tripod": Tripod(2.0),
    "Rhex": RHEX,
    "Roller": Roller(1.0, OUTLINES["wheel"]),
    "Screws": SCREWS,
    "Fineness": Fineness(),
    "Walker": Walker(RHEX, Tripod(2.0), STRESSES["generic"]),
    "WalkerScene": WalkerScene(STRESSES["generic"], RHEX, Tripod(2.0)),
}
RIGHT = {  # what looks wrong and is not
    ("Rhex", "inertia", "None"),
    ("Rhex", "aside", "None"),
    ("Fineness", "engine", "None"),
    ("harmonics", "None"),
    ("centre", "empty"),
    ("reverse", "true"),
    ("directions", "None"),
    ("cycles", "None"),
    ("effects", "empty"),
    ("k", "None"),
    ("covariance", "None"),
    ("Granular", "covariance", "array"),
    ("Viscous", "covariance", "deep"),
    ("Viscous", "slenderness", "None"),
    *(
        (type(gait).__name__, "frequency", "None")
        for gait in (*GAITS.values(), Sine(elements=8))
    ),
    ("Chain", "lengths", "list"),
    ("masses", "empty"),
    ("inertias", "empty"),
    ("along", "list"),
    ("cos", "array"),
    ("sin", "array"),
    ("modes", "None"),
    ("modes", "array"),
    ("Chain", "waves", "None"),
    ("EndCaps", "across", "None"),
    ("differential-drive", "track", "None"),
    *(
        (name, "length", "None")
        for name in ("Chain", "Backbone", "Serpenoid", "ConstantCurvature", "Positions")
    ),
    ("LeggedChain", "phases", "None"),
    ("Swimmer", "contact", "None"),
    *itertools.product(("WaveContact", "LinkContact"), ("width",), ("None",)),
    ("FunctionContact", "width", "None"),
    ("LeggedChain", "length", "None"),
    ("LeggedChain", "lengths", "list"),
    *(
        (name, "length", "None")
        for name in ("no-slip-snake", "ideal-fluid-swimmer", "floating-chain")
    ),
    *((name, "None") for name in ("radius_m", "travel_m", "distance_m", "slope_per_m")),
    ("stiffness", "list"),
    ("stiffness", "inf"),
    ("bending", "None"),
    ("damping", "list"),
    ("rest", "list"),
    ("dead_band", "list"),
    *itertools.product(("passive", "prescribed"), ("empty", "list")),
    ("Springs", "frequency", "None"),
    ("unit", "None"),
    ("closed", "true"),
    ("Path", "angle", "empty"),
    ("places", "list"),
    *itertools.product(("SpatialPath",), ("rx", "ry", "rz"), ("empty",)),
    ("smooth_normals", "None"),
    ("body_length", "None"),
    ("table, system", "body", "None"),
    ("table, system", "medium", "None"),
    ("Shchf", "file", "None"),
    *itertools.product(("name", "text", "matched"), ("text", "digits")),
}


@pytest.mark.parametrize("kind", PARTS)
def test_no_constructor_takes_a_wrong_type(kind):
    names = [f.name for f in dataclasses.fields(PARTS[kind])]
    for field, (wrong, value) in itertools.product(names, WRONG.items()):
        if (field, wrong) in RIGHT or (kind, field, wrong) in RIGHT:
            dataclasses.replace(PARTS[kind], **{field: value})
        else:
            change = {field: value}
            assert_refused(
                lambda change=change: dataclasses.replace(PARTS[kind], **change),
                (field, wrong),
            )


def test_every_public_class_is_in_the_table():
    public = [*(getattr(rft, name) for name in rft.__all__), *KINDS.values()]
    kinds = {c for c in public if isinstance(c, type)}
    kinds = {c for c in kinds if not getattr(c, "_is_protocol", False)}
    outputs = {rft.LinkForce, rft.Refusal, rft.Solution, rft.TimeSteps, rft.Work}
    # Without parameters; with a file; with those of body_velocity.
    untried = {Coulomb, Centreline, rft.BodyVelocity}
    assert kinds - outputs - {type(part) for part in PARTS.values()} == untried


STILL = np.zeros(2)


TAKEN = {
    *itertools.product(
        ("threads", "cycles", "amplitudes", "gait of the scene", "a change"), ["None"]
    ),
    *itertools.product(["amplitudes"], ("empty", "list", "deep", "array", "many")),
    *itertools.product(["amplitudes of a study"], ("empty", "list")),
    ("tiers", "empty"),
    ("tiers", "None"),
    *itertools.product(("alpha", "alphadot", "shape"), ["array"]),
    *itertools.product(["times"], ("empty", "list")),
    ("effects", "empty"),
    ("progress", "None"),
    ("progress", "function"),
    ("a list", "list"),
    ("rate", "array"),
    *itertools.product(["family's amplitudes"], ("empty", "deep", "many")),
    ("rate", "deep"),
    # a body that is registered already
    ("family's amplitudes", "array"),
    ("part", "class"),
}


CYCLE = np.zeros((8, 2))


def body_velocity_of(**options):
    return body_velocity(Coulomb(), Chain(), STILL, STILL + 1, **options)


def time_steps_of(**options):
    return rft.time_steps(Coulomb(), Chain(), CYCLE, CYCLE + 1, **options)


# Calls of a wrong value by what it stands for: in mechanics, in geometry and in
# studies.
MECHANICS = [
    ("medium", lambda x: body_velocity(x, Chain(), STILL, STILL)),
    ("body", lambda x: body_velocity(Coulomb(), x, STILL, STILL)),
    ("alpha", lambda x: body_velocity(Coulomb(), Chain(), x, STILL)),
    ("alphadot", lambda x: body_velocity(Coulomb(), Chain(), STILL, x)),
    ("loads", lambda x: body_velocity_of(loads=x)),
    ("regularisation", lambda x: body_velocity_of(regularisation=x)),
    ("tolerance", lambda x: body_velocity_of(tolerance=x)),
    ("threads", lambda x: body_velocity_of(threads=x)),
    ("effects", lambda x: body_velocity_of(effects=x)),
    ("loads", lambda x: time_steps_of(loads=x)),
    ("tolerance", lambda x: time_steps_of(tolerance=x)),
    ("cycles", lambda x: time_steps_of(cycles=x)),
    ("effects", lambda x: time_steps_of(effects=x)),
    ("medium", lambda x: rft.time_steps(x, Chain(), CYCLE, CYCLE + 1)),
    ("body", lambda x: rft.time_steps(Coulomb(), x, CYCLE, CYCLE)),
    ("alpha of a gait", lambda x: rft.time_steps(Coulomb(), Chain(), x, CYCLE)),
    ("medium", lambda x: rft.work_done(x, Chain(), STILL, STILL, np.zeros(3))),
    ("body", lambda x: rft.work_done(Coulomb(), x, STILL, STILL, np.zeros(3))),
    ("xi", lambda x: rft.work_done(Coulomb(), Chain(), STILL, STILL, x)),
    ("pose", se2.exp),
]


def motionless(alpha, alphadot):
    return np.zeros((*np.broadcast_shapes(alpha.shape, alphadot.shape)[:-1], 3))


AXES = connection.grid(2, 6)


FITTED = connection.fit(motionless, connection.grid(2, 5))


FAMILY = family.fit(motionless, Circle(), 1.0, 4, 8)


GEOMETRY = [
    ("joints", lambda x: connection.grid(x, 5, 1.0)),
    ("grid", lambda x: connection.grid(2, x, 1.0)),
    ("extent", lambda x: connection.grid(2, 5, x)),
    ("joints", lambda x: connection.directions(x, 64)),
    ("directions", lambda x: connection.directions(2, x)),
    ("velocity", lambda x: connection.fit(x, AXES)),
    ("axes", lambda x: connection.fit(motionless, x)),
    ("directions", lambda x: connection.fit(motionless, AXES, x)),
    ("degree", lambda x: connection.fit(motionless, AXES, 24, x)),
    ("progress", lambda x: connection.fit(motionless, AXES, progress=x)),
    ("axes", lambda x: harmonics.fit(motionless, x)),
    ("directions", lambda x: harmonics.fit(motionless, AXES, x)),
    ("highest", lambda x: harmonics.fit(motionless, AXES, highest=x)),
    ("gait", lambda x: family.fit(motionless, x, 1.0)),
    ("largest", lambda x: family.fit(motionless, Circle(), x)),
    ("curves", lambda x: family.fit(motionless, Circle(), 1.0, x)),
    ("phases", lambda x: family.fit(motionless, Circle(), 1.0, 4, x)),
    ("least", lambda x: family.fit(motionless, Circle(), 1.0, 4, 8, least=x)),
    ("family's amplitudes", lambda x: FAMILY.area(x)),
    ("connection", curvature.ccf),
    ("joint", lambda x: curvature.ccf(FITTED, x)),
    ("connection", curvature.error),
    ("connection", curvature.exterior_derivative),
    ("connection", curvature.lie_bracket),
    ("axes", lambda x: Field(x, FITTED.A)),
    ("values", lambda x: Field(FITTED.axes, x)),
    ("degree", lambda x: Field(FITTED.axes, FITTED.A, x)),
    ("axis", lambda x: FITTED.field.derivative(x)),
    ("shape", lambda x: FITTED(x)),
    ("rate", lambda x: FITTED.velocity(STILL, x)),
    ("field", lambda x: area(x, Circle())),
    ("gait", lambda x: area(curvature.ccf(FITTED), x)),
    ("phases", lambda x: area(curvature.ccf(FITTED), Circle(), 0.5, x)),
    ("velocity", lambda x: path(x, Circle())),
    ("gait", lambda x: path(motionless, x)),
    ("phases", lambda x: path(motionless, Circle(), phases=x)),
    ("velocity", lambda x: direct(x, Circle())),
    ("gait", lambda x: direct(motionless, x, [1.0])),
    ("amplitudes", lambda x: direct(motionless, Circle(), amplitudes=x)),
    ("xi", reconstruct.turning),
    ("xi", reconstruct.displacement),
    ("times", lambda x: reconstruct.trajectory(np.zeros((4, 3)), x)),
]


PLAIN = scenes.load("three-link-viscous")


STUDIES = [
    ("a scene", description),
    ("a scene", scenes.toml),
    ("a scene", scenes.tables),
    ("a scene", scenes.inputs),
    ("a scene", geomech.accuracy),
    ("a scene", undulation.activation),
    ("a scene", lambda x: cheapest_displacements(x, [1.0], 0.1)),
    ("a list", lambda x: cheapest_displacements(PLAIN, x, 0.1)),
    ("tolerance", lambda x: cheapest_displacements(PLAIN, [1.0], x)),
    ("gait of the scene", lambda x: cheapest_displacements(PLAIN, [1.0], 0.1, x)),
    ("a scene", lambda x: sweep.sweep(x, {"gait.amplitude": [1.0]})),
    ("over", lambda x: sweep.sweep(PLAIN, x)),
    ("a list", lambda x: sweep.sweep(PLAIN, {"gait.amplitude": x})),
    ("gait of the scene", lambda x: SceneTables(PLAIN).table("adapted", x)),
    ("tier", lambda x: SceneTables(PLAIN).plan(x)),
    ("tier", lambda x: SceneTables(PLAIN).poses(x)),
    ("gait of the scene", lambda x: SceneTables(PLAIN).poses("direct", x)),
    ("amplitudes", lambda x: SceneTables(PLAIN).poses("direct", amplitudes=x)),
    ("tiers", lambda x: SceneTables(PLAIN).displacements([1.0], x)),
    (
        "amplitudes of a study",
        lambda x: SceneTables(PLAIN).displacements(x, ["direct"]),
    ),
    (
        "gait of the scene",
        lambda x: SceneTables(PLAIN).displacements([1.0], ["direct"], x),
    ),
    ("tiers", lambda x: SceneTables(PLAIN).cost([1.0], x)),
    ("amplitudes of a study", lambda x: SceneTables(PLAIN).cost(x, ["direct"])),
    ("system", lambda x: PLAIN.changed(system=x)),
    ("one shape", lambda x: diagnosed_velocity(PLAIN.system, x, [1, 0])),
    ("gait of the scene", PLAIN.cycle),
    ("part", kinds.register),
    ("plugin", kinds.load_file),
    ("scene", scenes.load),
    ("TOML", scenes.parse),
    ("tables", scenes.from_tables),
    ("file", lambda x: Centreline(file=x)),
    ("a change", lambda x: PLAIN.with_numerics(loads=x)),
    ("a change", lambda x: PLAIN.with_numerics(grid=x)),
    ("a change", lambda x: PLAIN.with_numerics(extent=x)),
]


@pytest.mark.parametrize(
    "calls", [MECHANICS, GEOMETRY, STUDIES], ids=["mechanics", "geometry", "studies"]
)
@pytest.mark.parametrize("wrong", WRONG)
def test_no_function_takes_a_wrong_type(calls, wrong):
    for name, call in calls:
        if (name, wrong) in TAKEN:
            call(WRONG[wrong])
        elif name != "velocity" or not callable(WRONG[wrong]):
            assert_refused(lambda call=call: call(WRONG[wrong]), name)


def assert_refused(call, name):
    with pytest.raises(ValueError, match=".") as caught:
        call()
    assert "\n" not in str(caught.value), name
    assert len(str(caught.value)) < 450, name


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: scenes.load(3), "scene TOML 3 | value"),
        (
            lambda: PLAIN.with_numerics(grid="a"),
            "three-link-viscous grid | where value",
        ),
        (lambda: Chain(length="x"), "length 1e-15 1e+15 m | value"),
        (lambda: Chain(lengths=[[1]]), "lengths [[1]] | value"),
        (
            lambda: body_velocity("sand", Chain(), STILL, STILL),
            "medium force | value",
        ),
        (lambda: Swimmer(lambda v: v, Chain()), "medium force law | value"),
        (lambda: PLAIN.changed(gait=[1, 2]), "gait Circle | where value"),
        (lambda: direct(len, [1, 2]), "gait | value"),
        (
            lambda: Swimmer(Coulomb(), Chain(), effects=["caps"]),
            "effects list of effects | value",
        ),
    ],
)
def test_the_place_is_named(call, said):
    with refuses(said):
        call()


def test_refusals_carry_facts_and_go_to_other_processes():
    with (
        pytest.raises(ValueError, match="C must be > 0") as caught,
        located("own.toml"),
        located("own.toml: [medium]"),
    ):
        raise Refusal(
            "C must be > 0", value=-3, because="it is a stress", instead="raise it"
        )
    refusal = pickle.loads(pickle.dumps(caught.value))
    said = "own.toml: [medium] C must be > 0, got -3: it is a stress; raise it"
    assert str(refusal) == said


def test_counts_and_lists_of_every_make_are_taken():
    assert rft.Backbone(np.int32(5)).joints == rft.Backbone(5.0).joints == 4
    assert Chain(np.array([1, 2])) == Chain([1, 2]) == Chain((1.0, 2.0))
    assert repr(Circle(amplitude=np.float32(0.5))) == repr(Circle(amplitude=0.5))
