"""A study alone remembers; a scene is a small value; its TOML is true, however it was made."""

import dataclasses
import pickle

import numpy as np
import pytest
from registry import BODIES, EFFECTS, GAITS, MEDIA, SYSTEMS

import rft
from geomech import scenes
from geomech.mathematics.gaits import Circle, Fourier, Sine
from geomech.mathematics.geometry import connection
from geomech.mathematics.systems import Solver, Swimmer
from geomech.mathematics.systems.base import length_unit
from geomech.mathematics.systems.capabilities import solver_of
from geomech.mathematics.systems.framed import in_frame
from geomech.scenes import Numerics, Scene
from geomech.studies.scene_tables import SceneTables, refuse_outside
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass").with_numerics(grid=7)


@pytest.fixture
def fits(monkeypatch):
    counts, fit = [], connection.fit
    monkeypatch.setattr(
        connection,
        "fit",
        lambda *args, **options: counts.append(1) or fit(*args, **options),
    )
    return counts


def test_tables_are_kept_under_what_they_depend_on(fits):
    study = SceneTables(GLASS)
    first = study.poses("path")
    study.poses("area", amplitudes=[0.3, 0.5])
    finer = study.with_numerics(phases=64)
    assert finer.fitted is study.fitted and finer.scene.numerics.phases == 64
    (
        finer.poses("area"),
        finer.with_numerics(harmonics=5, curves=9, tolerance=None).curvature,
        study.curvature_error,
    )
    assert len(fits) == 1
    for changes in (
        {"grid": 9},
        {"extent": 2.0},
        {"directions": 4},
        {"interpolation": 2},
        {"regularisation": 1e-4},
    ):
        before = len(fits)
        other = study.with_numerics(**changes)
        assert np.abs(other.poses("path") - first).max() > 1e-9
        other.poses("path")
        assert len(fits) == before + 1
    assert (study.poses("path") == first).all() and len(fits) == 6
    table = study.table("adapted", None, [0.5, 1.0])
    assert study.table("adapted", amplitudes=[1.0]) is table
    assert study.table("adapted", amplitudes=[0.9]) is not table
    assert study.table("adapted", Circle(), [1.0]) is not table
    assert study.with_numerics(phases=64).table("adapted", None, [1.0]) is not table
    assert study.table("harmonic") is study.with_numerics(phases=64).table("harmonic")


def test_a_scene_is_small_and_remembers_nothing():
    """After use, too; a gait from a file holds that, and is none of the built-in ones."""
    for name in scenes.builtin_names():
        scene = scenes.load(name)
        held = dict(scene.__dict__)
        study = SceneTables(
            scene.with_numerics(phases=32, grid=5) if solver_of(scene.system) else scene
        )
        study.poses("direct", amplitudes=[scene.gait.amplitude / 2])
        if "path" in study.tiers:
            study.compute_field()
        for value in (scene, study.scene):
            assert len(pickle.dumps(value)) < 5000
            assert pickle.loads(pickle.dumps(value)) == value
        assert scene.__dict__ == held


def made():
    """Scenes of every medium, body, gait, effect and system of the registry."""
    numerics = Numerics(grid=9, extent=1.7, directions=12, phases=40)
    solver = Solver("gauss:7", 1e-4, 1e-9, 3, 21)
    for medium in MEDIA.values():
        yield Scene(
            Swimmer(medium, rft.Chain(), solver=solver), Circle(amplitude=0.3), numerics
        )
    for body in BODIES.values():
        wave = tuple((0.1 * k,) for k in range(body.joints))
        yield Scene(Swimmer(rft.Viscous(3.0), body), Fourier(cos=wave, sin=wave))
    for gait in GAITS.values():
        yield Scene(Swimmer(rft.Coulomb(), rft.Chain((1, 2, 1))), gait)
    for effect, _ in EFFECTS.values():
        yield Scene(
            Swimmer(
                MEDIA["glass-0.3mm-loose"],
                rft.Chain(),
                (effect(0.3), rft.EndCaps(0.1))[: 1 + (effect(0.3).kind != "end-caps")],
            ),
            Circle(),
        )
    for system in SYSTEMS.values():
        yield Scene(system, GAITS["ellipse"], numerics)
    yield from map(scenes.load, scenes.builtin_names())
    for name in scenes.builtin_names():
        yield scenes.load(name).with_numerics(phases=48)


def test_what_is_written_reads_the_same():
    for scene in made():
        text = scenes.toml(scene)
        again = scenes.parse(text, scene.name)
        assert again == scene and scenes.toml(again) == text
        assert scenes.from_tables(scenes.tables(scene), scene.name) == scene
        if not scene.text:
            anew = scenes.toml(
                dataclasses.replace(
                    scene, text="# not its own\n" + scenes.load("three-link-glass").text
                )
            )
            assert scenes.parse(anew, scene.name) == scene


def test_a_text_that_holds_is_kept_with_its_comments():
    glass = scenes.load("three-link-glass")
    assert scenes.toml(glass) == glass.text
    assert scenes.toml(glass.with_numerics(grid=31)) == glass.text
    assert "#" not in scenes.toml(
        glass.with_numerics(grid=30)
    ) and "grid = 30" in scenes.toml(glass.with_numerics(grid=30))
    changed = glass.changed(gait=Sine(elements=3, waves=0.5), body=rft.Backbone(3))
    assert scenes.parse(scenes.toml(changed), "three-link-glass") == changed


PLAIN = """
[medium]
name = "glass-0.3mm-loose"
[body]
kind = "chain"
[gait]
kind = "circle"
"""
MASS = (
    '[[effects]]\nkind = "body-inertia"\ndrag = 2.1\n[[effects]]\nkind = "end-caps"\n'
)
SIZES = "[physical]\nlength = 0.1\nfrequency = 3\nmass = 0.016\nradius_m = 0.006\n"


def test_sizes_stand_once():
    scene = scenes.parse(PLAIN + SIZES + MASS)
    assert (
        scene.system.body == rft.Chain(length=0.1) and length_unit(scene.system) == "m"
    )
    assert scene.system.effects == (
        rft.BodyInertia(0.016, 3.0, 0.1, 2.1),
        rft.EndCaps(radius_m=0.006),
    )
    ground = '[[effects]]\nkind = "disturbed-ground"\nradius_m = 0.02\nweakening = 0.1\n'  # of the track, not the body
    assert scenes.parse(PLAIN + SIZES + MASS + ground).system.effects[
        2
    ] == rft.DisturbedGround(weakening=0.1, radius_m=0.02)
    same = scenes.parse(
        PLAIN.replace('"chain"', '"chain"\nlength = 0.1') + SIZES + MASS
    )
    assert same == scene


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLAIN.replace('"chain"', '"chain"\nlength = 0.2') + SIZES, r"\[body\] length = 0.2, but \[physical\] length = 0.1"),
        (PLAIN + SIZES + MASS + "radius_m = 1.0", r"effects\]\] radius_m = 1.0, but \[physical\] radius_m = 0.006: keep one"),
        (PLAIN + "[physical]\nmass = 1.0", r"\[physical\] mass: nothing in this scene has one"),
        (PLAIN + "[physical]\nmas = 1.0", r"\[physical\] key: 'mas' is unknown: did you mean 'mass'"),
        (PLAIN + '[physical]\nlength = "x"', r"\[body\] Expected `float \| null`, got `str`"),
        ("frame = 3" + PLAIN, r"\[body\] Expected `str`, got `int`"),
        ('frame = "link-1"' + PLAIN.replace('"chain"', '"chain"\nframe = "link-2"'), "but the scene's frame = 'link-1'"),
        (PLAIN + '[system]\nkind = "no-slip-snake"', "a no-slip-snake takes no 'body'"),
        (PLAIN + '[system]\nkind = "car"', r"\[system\] kind: 'car' is unknown"),
        (PLAIN + "[system]\nlength = 1", r"\[system\] has no 'kind'"),
        (PLAIN + '[system]\nkind = "swimmer"\nwater = 1', r"\[system\] key: 'water' is unknown"),
        ('[system]\nkind = "swimmer"\n[gait]\nkind = "circle"', r"the table \[medium\] is missing"),
        ('[system]\nkind = "no-slip-snake"\nlengths = [1, 2]\n[gait]\nkind = "circle"', "Expected `array` of length 3"),
        ('[system]\nkind = "no-slip-snake"\n[gait]\nkind = "circle"\n[numerics]\nloads = "exact"', "'loads' is unknown"),
    ],
)  # fmt: skip
def test_contradictions_and_strangers_are_refused(text, said):
    with pytest.raises(Refusal, match=said) as caught:
        scenes.parse(text)
    assert "\n" not in str(caught.value)


def test_the_frame_is_the_scenes():
    top, own = (
        scenes.parse('frame = "link-2"' + PLAIN),
        scenes.parse(PLAIN.replace('"chain"', '"chain"\nframe = "link-2"')),
    )
    assert top == own and top.frame == "link-2"
    assert (
        "frame" in scenes.tables(top.changed(name="x", text=""))
        and "frame" not in scenes.tables(top.changed(text=""))["body"]
    )
    turned = top.changed(system=in_frame(top.system, "link-3"))
    assert turned.frame == "link-3" and SceneTables(
        turned.with_numerics(phases=32)
    ).poses("direct").shape == (3,)


def test_a_swimmer_may_be_told_in_full():
    nested = """
[system]
kind = "swimmer"
medium = {name = "glass-0.3mm-loose"}
body = {kind = "chain"}
effects = [{kind = "end-caps", radius = 0.1}]
[gait]
kind = "circle"
"""
    short = PLAIN + '[[effects]]\nkind = "end-caps"\nradius = 0.1\n'
    assert (
        scenes.parse(nested)
        == scenes.parse(short)
        == scenes.parse('[system]\nkind = "swimmer"' + short)
    )


def test_a_gait_that_leaves_the_field_between_few_phases_is_refused(monkeypatch):
    """Its largest angle lies at phase pi / 4096, between two of 4096; far inside the field not all phases are computed."""
    late, computed = np.pi / 4096, []
    gait = Fourier(
        cos=((np.cos(late),), (0.5,)),
        sin=((np.sin(late),), (0.0,)),
        amplitude=2.5 * (1 + 1e-7),
    )
    refuse_outside(GLASS, gait, phases=4096)
    with pytest.raises(
        Refusal, match="alpha_1 = 2.5 rad lies outside the field's -2.5 to 2.5"
    ):
        refuse_outside(GLASS, gait, phases=8192)
    mirrored = dataclasses.replace(
        gait,
        cos=((-np.cos(late),), (0.5,)),
        sin=((-np.sin(late),), (0.0,)),
        centre=(-0.1, 0.0),
    )
    mirrored = dataclasses.replace(mirrored, amplitude=gait.amplitude - 0.1)
    with pytest.raises(
        Refusal, match="alpha_1 = -2.5 rad lies outside the field's -2.5 to 2.5"
    ):
        refuse_outside(GLASS, mirrored, phases=8192)
    cycle = Fourier.cycle
    monkeypatch.setattr(
        Fourier, "cycle", lambda *of: computed.append(of[1]) or cycle(*of)
    )
    refuse_outside(GLASS, gait, [0.5, 2.0], phases=10**6)
    assert computed == [4096]
