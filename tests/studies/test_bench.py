"""A study alone remembers; a scene is a small value; its TOML is true, however it was
made."""

import pickle

import numpy as np
import pytest
from refusals import refuses
from registry import BODIES, EFFECTS, GAITS, MEDIA, SYSTEMS

import rft
from geomech import scenes
from geomech.mathematics.gaits import Circle, Fourier, Sine
from geomech.mathematics.systems import Solver, Swimmer
from geomech.mathematics.systems.capabilities import solver_of
from geomech.mathematics.systems.framed import in_frame
from geomech.scenes import Numerics, Scene
from geomech.studies.scene_tables import SceneTables, refuse_outside
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass").with_numerics(grid=7)


def test_tables_are_kept_under_what_they_depend_on():
    tables = SceneTables(GLASS)
    finer = tables.with_numerics(phases=64)
    assert finer.fitted is tables.fitted
    assert tables.with_numerics(harmonics=5, curves=9).fitted is tables.fitted
    table = tables.table("adapted", None, [0.5, 1.0])
    assert tables.table("adapted", amplitudes=[1.0]) is table
    assert tables.table("adapted", amplitudes=[0.9]) is not table
    assert finer.table("adapted", None, [1.0]) is not table


@pytest.mark.parametrize(
    "changes",
    [
        {"grid": 9},
        {"extent": 2.0},
        {"directions": 4},
        {"interpolation": 2},
        {"regularisation": 1e-4},
    ],
)
def test_a_field_depends_on_these_settings(changes):
    tables = SceneTables(GLASS)
    other = tables.with_numerics(**changes)
    assert np.abs(other.poses("path") - tables.poses("path")).max() > 1e-9


@pytest.mark.parametrize("name", scenes.builtin_names())
def test_a_scene_is_small_and_remembers_nothing(name):
    scene = scenes.load(name)
    if solver_of(scene.system):
        scene = scene.with_numerics(phases=32, grid=5)
    tables = SceneTables(scene)
    tables.poses("direct", amplitudes=[scene.gait.amplitude / 2])
    if "path" in tables.tiers:
        tables.compute_field()
    assert len(pickle.dumps(tables.scene)) < 5000
    assert pickle.loads(pickle.dumps(tables.scene)) == scene


NUMERICS = Numerics(grid=9, extent=1.7, directions=12, phases=40)
SOLVER = Solver("gauss:7", 1e-4, 1e-9, 3, 21)
PARTS = {"medium": MEDIA, "body": BODIES, "gait": GAITS, "system": SYSTEMS}
NAMES = [(part, name) for part, names in PARTS.items() for name in names]
NAMES += [("effect", name) for name in EFFECTS]
NAMES += [("built in", name) for name in scenes.builtin_names()]


def with_part(part, name):
    """Return a scene with a part of the registry."""
    if part == "medium":
        system = Swimmer(MEDIA[name], rft.Chain(), solver=SOLVER)
        return Scene(system, Circle(amplitude=0.3), NUMERICS)
    if part == "body":
        body = BODIES[name]
        wave = tuple((0.1 * k,) for k in range(body.joints))
        return Scene(Swimmer(rft.Viscous(3.0), body), Fourier(cos=wave, sin=wave))
    if part == "gait":
        return Scene(Swimmer(rft.Coulomb(), rft.Chain((1, 2, 1))), GAITS[name])
    if part == "system":
        return Scene(SYSTEMS[name], GAITS["ellipse"], NUMERICS)
    if part == "built in":
        return scenes.load(name).with_numerics(phases=48)
    effects = [EFFECTS[name][0](0.3)]
    if effects[0].kind != "end-caps":
        effects.append(rft.EndCaps(0.1))
    glass = MEDIA["glass-0.3mm-loose"]
    return Scene(Swimmer(glass, rft.Chain(), tuple(effects)), Circle())


@pytest.mark.parametrize(("part", "name"), NAMES)
def test_what_is_written_reads_the_same(part, name):
    scene = with_part(part, name)
    text = scenes.toml(scene)
    again = scenes.parse(text, scene.name)
    assert again == scene
    assert scenes.from_tables(scenes.tables(scene), scene.name) == scene


def test_a_text_that_no_longer_holds_is_written_anew():
    glass = scenes.load("three-link-glass")
    assert scenes.toml(glass.with_numerics(grid=31)) == glass.text  # as it says
    changed = glass.changed(gait=Sine(elements=3, waves=0.5), body=rft.Backbone(3))
    assert scenes.parse(scenes.toml(changed), "three-link-glass") == changed


BODY = '[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\n'
PLAIN = BODY + '[gait]\nkind = "circle"\n'
MASS = '[[effects]]\nkind = "body-inertia"\ndrag = 2.1\n'
CAPS = '[[effects]]\nkind = "end-caps"\n'
GROUND = '[[effects]]\nkind = "disturbed-ground"\nradius_m = 0.02\nweakening = 0.1\n'
SIZES = "[physical]\nlength = 0.1\nfrequency = 3\nmass = 0.016\nradius_m = 0.006\n"


def test_sizes_stand_once():
    """The radius of disturbed ground is that of the track, not of the body."""
    scene = scenes.parse(PLAIN + SIZES + MASS + CAPS + GROUND)
    assert scene.system.body == rft.Chain(length=0.1)
    mass, caps, ground = scene.system.effects
    assert mass == rft.BodyInertia(0.016, 3.0, 0.1, 2.1)
    assert caps == rft.EndCaps(radius_m=0.006)
    assert ground == rft.DisturbedGround(weakening=0.1, radius_m=0.02)
    twice = PLAIN.replace('"chain"', '"chain"\nlength = 0.1')
    assert scenes.parse(twice + SIZES + MASS + CAPS + GROUND) == scene


SWIMMER = '[system]\nkind = "swimmer"'
SNAKE = '[system]\nkind = "no-slip-snake"'
GAIT = '\n[gait]\nkind = "circle"'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            PLAIN.replace('"chain"', '"chain"\nlength = 0.2') + SIZES,
            "[body] length = 0.2 [physical] length = 0.1 | where instead",
        ),
        (
            PLAIN + SIZES + CAPS + "radius_m = 1.0",
            "[[effects]] radius_m = 1.0 [physical] radius_m = 0.006 | where instead",
        ),
        (
            PLAIN + "[physical]\nmass = 1.0",
            "[physical] mass part | where because instead",
        ),
        (
            PLAIN + "[physical]\nmas = 1.0",
            "[physical] mas did you mean mass | where instead",
        ),
        ("frame = 3\n" + PLAIN, "[body] str int | where instead"),
        (
            'frame = "link-1"\n'
            + PLAIN.replace('"chain"', '"chain"\nframe = "link-2"'),
            "scene frame = 'link-1' | where instead",
        ),
        (PLAIN + SNAKE, "no-slip-snake body | where instead"),
        (SWIMMER + GAIT, "[medium] missing | where instead"),
        (
            SNAKE + GAIT + '\n[numerics]\nloads = "exact"',
            "loads unknown | where instead",
        ),
    ],
)
def test_contradictions_and_strangers_are_refused(text, said):
    with refuses(said):
        scenes.parse(text)


def test_the_frame_is_the_scenes():
    top = scenes.parse('frame = "link-2"\n' + PLAIN)
    own = PLAIN.replace('"chain"', '"chain"\nframe = "link-2"')
    assert scenes.parse(own) == top
    assert top.changed(system=in_frame(top.system, "link-3")).frame == "link-3"


@pytest.mark.parametrize("sign", [1, -1])
def test_a_gait_that_leaves_the_field_between_few_phases_is_refused(sign):
    """Its largest angle lies at phase pi / 4096, between two of 4096."""
    late = np.pi / 4096
    cos = ((sign * np.cos(late),), (0.5,))
    sin = ((sign * np.sin(late),), (0.0,))
    amplitude = 2.5 * (1 + 1e-7) - 0.1
    gait = Fourier(cos, sin, amplitude=amplitude, centre=(0.1 * sign, 0.0))
    refuse_outside(GLASS, gait, phases=4096)
    outside = (
        f"alpha_1 = {sign * 2.5} rad lies outside the field, which covers -2.5 to 2.5"
    )
    with pytest.raises(Refusal, match=outside):
        refuse_outside(GLASS, gait, phases=8192)
