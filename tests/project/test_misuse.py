"""Slips that are likely: of unit, sign and size, and what a velocity of one's own lacks."""

import copy
import dataclasses
import importlib
import math
import pkgutil
import warnings

import numpy as np
import pytest
from commands import geomech
from registry import MEDIA
from tabled import of_json, tabled

import geomech as geomech_package
from geomech import scenes
from geomech.core.errors import UnitWarning, VelocityWarning
from geomech.mathematics.gaits import Circle, Ellipse, Sine
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.geometry.stretch import stretch
from geomech.mathematics.systems import NoSlipSnake, Swimmer
from geomech.scenes import Numerics, Scene
from geomech.shell.describe.scene import description
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.mechanics.single import diagnosed_velocity as single_of
from geomech.studies.scene_tables import SceneTables
from rft import Backbone, Chain, Coulomb, EndCaps, Serpenoid, Viscous
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
VISCOUS, GLASS = scenes.load("three-link-viscous"), MEDIA["glass-0.3mm-loose"]
PLAIN = '[medium]\nlaw = "granular"\nC = 1.8\ngamma0_deg = 13.8\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n'
DIRECT = ["--tiers", "direct", "--json"]


def test_effects_in_a_list_are_those_in_a_tuple():
    """Tables are kept under the system, by its hash."""
    listed, made = (
        Swimmer(GLASS, Chain(), effects=kind([EndCaps(0.06)])) for kind in (list, tuple)
    )
    assert (
        listed == made
        and hash(listed) == hash(made)
        and listed.effects == (EndCaps(0.06),)
    )
    found = [
        tabled(
            SceneTables(Scene(s, Circle(), Numerics(grid=7, phases=16))).displacements(
                [0.5], ["path", "direct"]
            )
        )
        for s in (listed, made)
    ]
    assert (
        found[0]["path"] == found[1]["path"]
        and found[0]["direct"] == found[1]["direct"]
    )


def test_results_are_equal_to_themselves_alone_and_have_a_hash():
    """Those that hold arrays, of which == is no single answer."""
    study = SceneTables(VISCOUS.with_numerics(grid=7, phases=16))
    glass = SceneTables(
        scenes.load("three-link-glass").with_numerics(
            grid=7, phases=16, harmonics=3, curves=4
        )
    )
    for value in (
        study.fitted, study.curvature, study.two_form, study.plane((0, 1)), study.metric, glass.metric, stretch(study.metric),
        glass.table("harmonic"), glass.table("adapted"), study.in_frame("minimum-perturbation").scene.system.field,
    ):  # fmt: skip
        same, other = copy.copy(value), copy.deepcopy(value)
        assert (
            (value == value) is True
            and (value == same) is False
            and (value != other) is True
        )
        assert len({value, same, value}) == 2
    for module in pkgutil.walk_packages(geomech_package.__path__, "geomech."):
        if not module.name.endswith("__main__") and not module.name.startswith(
            "geomech.gym."
        ):  # takes an extra
            for kind in vars(importlib.import_module(module.name)).values():
                if dataclasses.is_dataclass(kind) and any(
                    "ndarray" in str(f.type) for f in dataclasses.fields(kind)
                ):
                    assert kind.__eq__ is object.__eq__, kind


def scene(folder, text, name="s.toml"):
    (folder / name).write_text(text)
    return name


@pytest.mark.parametrize(
    ("args", "change", "said"),
    [
        (
            ["velocity", "s.toml", "--alpha", "30,17", "--alphadot", "1,0", "--json"],
            "",
            "a joint angle of 30 rad",
        ),
        (
            ["velocity", "s.toml", "--alpha", "0,-6.3", "--alphadot", "1,0", "--json"],
            "",
            "a joint angle of 6.3 rad",
        ),
        (
            ["displacement", "s.toml", "--amplitudes", "30,60", *DIRECT],
            "",
            "a joint angle of 60 rad",
        ),
        (
            ["displacement", "s.toml", "--amplitudes", "30", "--tol", "1", "--json"],
            "",
            "a joint angle of 30 rad",
        ),
        (
            ["displacement", "s.toml", "--amplitudes", "1", "--extent", "90", *DIRECT],
            "",
            "an extent of 90 rad",
        ),
        (["explain", "s.toml"], "amplitude = 20", "a joint angle of 20 rad"),
        (["explain", "s.toml"], "centre = [10, 17]", "a joint angle of 1"),
        (
            ["displacement", "s.toml", "--amplitudes", "1", *DIRECT],
            "[numerics]\nextent = 90",
            "an extent of 90 rad",
        ),
    ],
)
def test_angles_beyond_a_full_turn_are_noted_once_and_the_result_is_given(
    args, change, said, tmp_path
):
    scene(tmp_path, PLAIN + change)
    code, out, err = geomech(*args, cwd=tmp_path)
    assert code == 0
    assert err.startswith(f"note: {said}")
    assert err.count("\n") == 1
    assert "beyond a full turn, 2 pi: if that is in degrees" in err
    assert out


def test_gamma0_below_a_degree_is_noted(tmp_path):
    small = PLAIN.replace("gamma0_deg = 13.8", "gamma0_deg = 0.24")
    code, out, err = geomech("explain", scene(tmp_path, small), cwd=tmp_path)
    assert (code, bool(out)) == (0, True)
    assert err == (
        "note: s.toml: [medium] gamma0_deg = 0.24 is less than a degree: if that is in rad, write gamma0 = 0.24\n"
    )
    with pytest.warns(UnitWarning, match="gamma0_deg = 0.24 is less than a degree"):
        assert scenes.parse(small).system.medium.gamma0 == pytest.approx(
            math.radians(0.24)
        )


@pytest.mark.parametrize(
    ("given", "said", "hinted"),
    [
        ("gamma0 = 17", "lie between 0 and 90 degrees", True),
        ("gamma0 = inf", "be a number from", False),
        ("gamma0_deg = 117", "lie between 0 and 90 degrees", False),
    ],
)
def test_degrees_where_gamma0_is_in_rad_are_told_of_the_other_key(
    given, said, hinted, tmp_path
):
    code, _, err = geomech(
        "explain",
        scene(tmp_path, PLAIN.replace("gamma0_deg = 13.8", given)),
        cwd=tmp_path,
    )
    assert (code, err.count("\n")) == (2, 1)
    assert f"gamma0 must {said}" in err
    assert err.endswith(": gamma0 is in rad, write gamma0_deg for degrees\n") == hinted


def test_a_refusal_stays_one_line_and_keeps_the_note():
    code, out, err = geomech("displacement", "three-link-viscous", "--amplitudes", "30")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(
        "error: three-link-viscous: alpha_1 = 30 rad lies outside the field's -2.5 to 2.5: "
    )
    assert "; a joint angle of 30 rad is beyond a full turn" in err


def test_an_extent_that_is_refused_is_told_too():
    code, out, err = geomech(
        "displacement", "three-link-viscous", "--amplitudes", "1", "--extent", "120"
    )
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "extent must be a number from 1e-06 to 100 rad, got 120" in err
    assert "; an extent of 120 rad is beyond a full turn" in err


def test_from_python_units_are_warned_of_by_name():
    for make in (
        lambda: Scene(VISCOUS.system, Circle(amplitude=30)),
        lambda: Scene(NoSlipSnake(), Ellipse(centre=(7, 0))),
        lambda: SceneTables(VISCOUS).poses("direct", amplitudes=[1, -30]),
        lambda: tabled(SceneTables(VISCOUS).displacements([30], ["direct"])),
        lambda: tabled(cheapest_displacements(VISCOUS, [30.0], 1.0)),
        lambda: single_of(VISCOUS.system, [30, 17], [1, 0]),
        lambda: single_of(NoSlipSnake(), [30, 17], [1, 0]),
    ):
        with pytest.warns(
            UnitWarning, match="a joint angle of .* rad is beyond a full turn"
        ):
            make()


def test_what_is_no_joint_angle_or_just_a_full_turn_is_not_noted():
    Scene(
        Swimmer(Viscous(), Serpenoid(elements=12)), Circle(amplitude=9)
    )  # curvature times length
    Scene(Swimmer(Viscous(), Chain()), Circle(amplitude=2 * math.pi))
    Scene(Swimmer(Viscous(), Backbone(8)), Sine(amplitude=10, elements=8))
    for name in scenes.builtin_names():
        code, _, err = geomech("explain", name)
        assert (code, err) == (0, "")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert SceneTables(VISCOUS).poses("direct", amplitudes=[30]).shape == (1, 3)


def test_degrees_are_taken_wherever_angles_are(tmp_path):
    name = scene(tmp_path, PLAIN)
    ask = lambda *args: geomech(*args, cwd=tmp_path)
    rad = [f"{math.radians(x):.17g}" for x in (30, 90)]
    for degrees, plain in (
        (["velocity", name, "--alpha", "30deg,0.5", "--alphadot", "-90deg,1"],
         ["velocity", name, "--alpha", f"{rad[0]},0.5", "--alphadot", f"-{rad[1]},1"]),
        (["displacement", name, "--amplitudes", "30deg:90deg:3", "--tiers", "direct"],
         ["displacement", name, "--amplitudes", f"{rad[0]}:{rad[1]}:3", "--tiers", "direct"]),
    ):  # fmt: skip
        found, wanted = (ask(*args, "--json") for args in (degrees, plain))
        assert found[::2] == wanted[::2] == (0, "")
        one, other = of_json(found[1]), of_json(wanted[1])
        assert list(one) == list(other)
        for key in {"xi", "x", "y"} & set(one):
            np.testing.assert_allclose(one[key], other[key], rtol=1e-12)
    assert ask(
        "connection",
        "three-link-viscous",
        "--extent",
        "120deg",
        "--grid",
        "5",
        "-o",
        "c.nc",
    )[::2] == (0, "")
    over = [
        "--over",
        "medium.gamma0=10deg,17deg",
        "--over",
        "gait.amplitude=30deg:90deg:2",
        "-o",
        "s.nc",
    ]
    assert ask("sweep", name, *over)[::2] == (0, "")


def test_what_degrees_were_swept_is_in_rad(tmp_path):
    import xarray

    name = scene(tmp_path, PLAIN.replace('"circle"', '"ellipse"'))
    over = [
        "--over",
        "medium.gamma0=10deg,17deg",
        "--over",
        "gait.tilt=30deg,60deg",
        "-o",
        "s.nc",
    ]
    assert geomech("sweep", name, *over, cwd=tmp_path)[::2] == (0, "")
    with xarray.open_dataset(tmp_path / "s.nc") as data:
        np.testing.assert_allclose(data.medium_gamma0, np.radians([10, 17]))
        np.testing.assert_allclose(data.gait_tilt, np.radians([30, 60]))


def test_a_circle_in_a_scene_may_be_told_in_degrees():
    assert scenes.parse(PLAIN + "amplitude_deg = 30").gait.amplitude == pytest.approx(
        math.pi / 6
    )


@pytest.mark.parametrize(
    "gait", ["amplitude = 2.7", "centre = [2.6, 0]\namplitude = 0.1"]
)
def test_a_gait_off_the_field_is_refused_by_every_command_alike(
    gait, tmp_path, monkeypatch
):
    def solve(*args):
        raise AssertionError("computed")

    name = scene(tmp_path, PLAIN + gait)
    said = geomech("displacement", name, "--amplitudes", gait.split()[-1], cwd=tmp_path)
    assert said[:2] == (2, "")
    assert (
        "lies outside the field's -2.5 to 2.5: widen the extent or lower the amplitude"
        in said[2]
    )
    monkeypatch.setattr(Swimmer, "solve", solve)
    assert geomech("ccf", name, "--plot", "c.png", cwd=tmp_path) == said
    assert (
        geomech("displacement", name, "--amplitudes", gait.split()[-1], cwd=tmp_path)
        == said
    )
    assert geomech("accuracy", name, cwd=tmp_path) == said
    if "centre" in gait:  # `run` takes amplitudes of its own
        code, _, err = geomech("run", name, cwd=tmp_path)
        assert code == 2 and "outside" in err
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_sine_of_negative_amplitude_is_the_mirrored_wave():
    gait, t = Sine(amplitude=0.2, waves=1.3, elements=9), np.linspace(0, 6, 5)
    assert Sine(amplitude=-0.2, waves=1.3, elements=9).shape(t) == pytest.approx(
        -gait.shape(t), abs=1e-14
    )
    assert gait.rate(t, [-0.2]) == pytest.approx(-gait.rate(t, [0.2]), abs=1e-14)
    assert gait.wavelength([-0.2]) == gait.wavelength([0.2])
    assert gait.relative_curvature([-0.2]) == gait.relative_curvature([0.2])


def test_time_stepping_takes_negative_and_zero_amplitudes_too():
    """Of a circle about the straight chain a negative one is the mirror image."""
    text = (
        PLAIN
        + '[[effects]]\nkind = "transient"\ntravel = 0.1\n[numerics]\ncycles = 1\nphases = 32\n'
    )
    below, rest, above = SceneTables(scenes.parse(text)).poses(
        "direct", None, [-0.2, 0.0, 0.2]
    )
    np.testing.assert_allclose(rest, 0.0, atol=1e-15)
    np.testing.assert_allclose(below * [1, -1, -1], above, rtol=1e-9, atol=1e-12)
    assert np.abs(above).min() > 1e-5


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ("run", PLAIN.replace('"circle"', '"ellipse"\nsemi_axes = [0, 0]')),
        (
            "run",
            PLAIN.replace('"chain"', '"backbone"\nelements = 8').replace(
                '"circle"', '"sine"\nelements = 8\namplitude = 0'
            ),
        ),
        ("accuracy", PLAIN + "amplitude = 0"),
    ],
)
def test_what_does_not_move_is_refused(command, text, tmp_path, monkeypatch):
    monkeypatch.setattr(Swimmer, "solve", None)  # nothing is computed
    code, out, err = geomech(command, scene(tmp_path, text), cwd=tmp_path)
    assert (code, out, err) == (
        2,
        "",
        "error: s.toml: [gait] does not move: give it a size\n",
    )
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]


def test_explain_names_the_tiers_that_are_lost_and_why():
    three = scenes.parse(PLAIN.replace('"circle"', '"fourier"\ncos = [[1], [0], [0]]\nsin = [[0], [1], [0]]').replace(
        'kind = "chain"', 'kind = "chain"\nlengths = [1, 1, 1, 1]'
    ))  # fmt: skip
    assert (
        "tiers: area, adapted, path, direct; by name: harmonic"
        == description(three).splitlines()[-1]
    )
    fish = description(scenes.load("sandfish-loose")).splitlines()
    assert "tiers: adapted, direct; by name: area, path" in fish
    assert (
        "not available: harmonic tier: they take 2 to 5 joints, this body has 99"
        in fish
    )
    two = PLAIN.replace('kind = "chain"', 'kind = "chain"\nlengths = [1, 1]').replace(
        '"circle"', '"wave"\njoints = 1'
    )
    one = description(scenes.parse(two)).splitlines()
    assert "not available: CCF maps: a loop of one joint encloses no area" in one
    assert (
        "not available: area tier: they take 2 joints and more, this body has 1" in one
    )
    assert (
        "not available: area and harmonic tiers: the field has singular shapes"
        in description(scenes.load("no-slip-snake"))
    )


def test_names_that_are_none_get_a_hint():
    with pytest.raises(Refusal, match="numerics: 'nonsense' is unknown: use one of"):
        VISCOUS.with_numerics(nonsense=1)
    with pytest.raises(
        Refusal, match="part: 'meduim' is unknown: did you mean 'medium'"
    ):
        VISCOUS.changed(meduim=Coulomb())
    with pytest.raises(ValueError, match="a CCF is that of a Connection, .* got 'x'"):
        curvature.ccf("x")
    with pytest.raises(
        ValueError, match="i and j must be two of the joints 0 to 1, got 0 and 2"
    ):
        curvature.ccf(SceneTables(VISCOUS.with_numerics(grid=5)).fitted, 0, 2)


AXES = connection.grid(2, 5, 1.0)


def turning(alpha, alphadot):
    """Linear, odd, of every component, and depends on the shape."""
    a, r = np.broadcast_arrays(alpha, alphadot)
    x = np.cos(a[..., 0]) * r[..., 1] - np.sin(a[..., 1]) * r[..., 0]
    return np.stack([x, a[..., 0] * r[..., 0], r[..., 1] - 0.3 * r[..., 0]], -1)


@pytest.mark.parametrize(
    ("velocity", "said"),
    [
        (lambda a, r: turning(a, r) + 0.01, "is not odd in alphadot"),
        (lambda a, r: np.abs(turning(a, r)), "is not odd in alphadot"),
        (lambda a, r: turning(a, r) ** 3, "is not homogeneous in alphadot"),
        (
            lambda a, r: turning(a, r / np.linalg.norm(r, axis=-1, keepdims=True)),
            "is not homogeneous",
        ),
        (lambda a, r: turning(np.zeros(2), r), "ignores alpha"),
        (
            lambda a, r: [1.0, 2.0, 3.0],
            "is not odd .*; it is not homogeneous .*; it ignores alpha",
        ),
    ],
)
def test_a_velocity_is_told_what_it_lacks(velocity, said):
    with pytest.warns(VelocityWarning, match=f"this velocity {said}") as told:
        connection.fit(velocity, AXES)
    assert [str(x.message).count("\n") for x in told] == [0]
    connection.fit(velocity, AXES, trusted=True)


def single(alpha, alphadot):
    (a1, a2), (r1, r2) = alpha, alphadot
    return [math.cos(a1) * r2 - math.sin(a2) * r1, a1 * r1, r2 - 0.3 * r1]


@pytest.mark.parametrize(
    "velocity",
    [
        single,
        lambda a, r: np.array(single(a, r)),
        lambda a, r: np.stack(single(np.moveaxis(a, -1, 0), r)),
    ],
    ids=["list", "array", "first axis"],
)
def test_a_velocity_of_one_shape_is_asked_for_each(velocity):
    found, wanted = connection.fit(velocity, AXES), connection.fit(turning, AXES)
    np.testing.assert_allclose(found.A, wanted.A, atol=1e-14)
    np.testing.assert_allclose(found.residual, wanted.residual, atol=1e-14)


def test_what_lacks_batch_axes_is_broadcast():
    constant = np.array([0.1, -0.2, 0.3])
    with pytest.warns(VelocityWarning, match="ignores alpha"):
        fitted = connection.fit(
            lambda a, r: constant * (r[..., :1] - 2 * r[..., 1:]), AXES
        )  # (C, 3), no shapes
    np.testing.assert_allclose(
        fitted.A,
        np.multiply.outer(constant, [1, -2])[..., None, None] + np.zeros((5, 5)),
        atol=1e-14,
    )
    with pytest.raises(
        ValueError,
        match=r"must return shape \(25, 8, 3\) for these alpha and alphadot, got \(25, 8, 1\)",
    ):
        connection.fit(lambda a, r: turning(a, r)[..., :1], AXES)
    with pytest.raises(ValueError, match="what velocity returns must be real numbers"):
        connection.fit(lambda a, r: None, AXES)
    with pytest.raises(KeyError, match="own"):
        connection.fit(lambda a, r: {}["own"], AXES)


CONSTANT = [
    "differential-drive"
]  # whose connection is the same at all angles of its wheels, which is told


@pytest.mark.parametrize(
    "name", [name for name in scenes.builtin_names() if name not in CONSTANT]
)
def test_no_system_of_ours_is_suspected(name):
    """Those of which a connection is to be had."""
    system = scenes.load(name).system
    if system.joints == 2 and not system.traits.lacks:
        small = connection.grid(2, 4, 1.2)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            connection.fit(system.velocity, small, traits=system.traits)


@pytest.mark.parametrize("name", MEDIA)
def test_no_medium_of_ours_is_suspected(name):
    system = Swimmer(MEDIA[name], Chain((0.7, 1.4, 0.9)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        connection.fit(system.velocity, connection.grid(2, 4, 2.5))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            '"circle"',
            "circle",
            "(at line 8, column 8): 'kind = circle', put text in \"quotes\"",
        ),
        ('"circle"', "“circle”", "'kind = “circle”', put text in straight \"quotes\""),
        ('"circle"', '"circle', "close the quotes"),
        (
            "C = 1.8",
            "C = .8",
            "(at line 3, column 5): 'C = .8', a number has a digit before its point",
        ),
        ("C = 1.8", "C = 1,8", "'C = 1,8', a number has a point, no comma"),
        (
            "C = 1.8",
            "C = 1.8 # yes\nk = 2 Pa",
            "(at line 4, column 7): 'k = 2 Pa', a number has no unit",
        ),
        (
            "gamma0_deg = 13.8",
            "gamma0 = 13.8 deg",
            "a number has no unit: a key that ends in _deg takes degrees",
        ),
        ("C = 1.8", "C: 1.8", "'C: 1.8', write KEY = VALUE"),
        ("C = 1.8", "C =", "give the key a value"),
        ("C = 1.8\n", "", "[medium] has no `C`: add C = ..."),
        (
            "C = 1.8",
            'C = "big"',
            "Expected `float`, got `str` - at `.C`: give a number in place of 'big'",
        ),
        ('"chain"', '"chain"\nlengths = [1, "1", 1]', "give a number in place of '1'"),
        ('"chain"', '"chain"\nlengths = 3', "give a list in [ ] in place of 3"),
        ('"circle"', '"circle"\nreverse = 1', "give true or false in place of 1"),
        (
            '"circle"',
            '"circle"\ncentre_deg = ["a", 1]',
            "give a number in place of 'a'",
        ),
        (
            '"circle"',
            '"circle"\n[numerics]\ngrid = 31.5',
            "give a whole number without a point in place of 31.5",
        ),
        (
            '"circle"',
            '"circle"\n[numerics]\nextent_deg = 1e9',
            "extent must be a number from 1e-06 to 100",
        ),
        (
            '"circle"',
            '"circle"\n[numerics]\ngrid_deg = 9',
            "[numerics] key: 'grid_deg' is unknown: did you mean 'grid'",
        ),
    ],
)
def test_a_slip_in_a_scene_is_shown_with_its_cure(old, new, said, tmp_path):
    code, out, err = geomech(
        "explain", scene(tmp_path, PLAIN.replace(old, new)), cwd=tmp_path
    )
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: s.toml")
    assert said in err


def test_an_extent_may_be_told_in_degrees():
    assert scenes.parse(
        PLAIN + "[numerics]\nextent_deg = 120\n"
    ).numerics.extent == pytest.approx(2 * math.pi / 3)
