"""Slips that are likely: of unit, sign and size, and what a velocity of one's own
lacks."""

import math
import re
import warnings

import frozen
import numpy as np
import pytest
from commands import geomech
from registry import MEDIA

from geomech import fit_gait, fit_medium, load_result, scenes, velocity
from geomech.core.errors import UnitWarning, VelocityWarning
from geomech.mathematics.gaits import Circle, Ellipse, Points, Sine
from geomech.mathematics.geometry import connection
from geomech.mathematics.systems import NoSlipSnake, Swimmer
from geomech.scenes import Scene
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.mechanics.single import diagnosed_velocity as single_of
from geomech.studies.scene_tables import SceneTables
from rft import Backbone, Chain, EndCaps, Serpenoid, Viscous
from rft.terradynamics.meshes import MeshFile

pytestmark = pytest.mark.usefixtures("fastest")
VISCOUS, GLASS = scenes.load("three-link-viscous"), MEDIA["glass-0.3mm-loose"]
PLAIN = '[medium]\nlaw = "granular"\nC = 1.8\ngamma0_deg = 13.8\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n'


def scene(folder, text):
    (folder / "s.toml").write_text(text)
    return folder


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
            ["displacement", "s.toml", "--amplitudes", "30", "--tol", "1", "--json"],
            "",
            "a joint angle of 30 rad",
        ),
        (["explain", "s.toml"], "amplitude = 20", "a joint angle of 20 rad"),
        (["explain", "s.toml"], "centre = [10, 17]", "a joint angle of 1"),
        (
            ["displacement", "s.toml", "--tiers", "direct"],
            "[numerics]\nextent = 90",
            "an extent of 90 rad",
        ),
    ],
)
def test_angles_beyond_a_full_turn_are_noted_once_and_the_result_is_given(
    args, change, said, tmp_path
):
    code, out, err = geomech(*args, cwd=scene(tmp_path, PLAIN + change))
    # A slow machine also shows progress.
    (note,) = [line for line in err.splitlines() if line.startswith("note: ")]
    assert code == 0
    assert note.startswith(f"note: {said}")
    assert "more than a full turn, 2 pi: if the value is in degrees" in note
    assert out


def test_a_gamma0_below_a_degree_is_noted():
    small = PLAIN.replace("gamma0_deg = 13.8", "gamma0_deg = 0.24")
    with pytest.warns(UnitWarning, match="0.24 is less than one degree"):
        scenes.parse(small)


@pytest.mark.parametrize(
    "ask",
    [
        lambda: Scene(VISCOUS.system, Circle(amplitude=30)),
        lambda: Scene(NoSlipSnake(), Ellipse(centre=(7, 0))),
        lambda: SceneTables(VISCOUS).poses("direct", amplitudes=[1, -30]),
        lambda: SceneTables(VISCOUS).displacements([30], ["direct"]),
        lambda: cheapest_displacements(VISCOUS, [30.0], 1.0),
        lambda: single_of(VISCOUS.system, [30, 17], [1, 0]),
        lambda: single_of(NoSlipSnake(), [30, 17], [1, 0]),
    ],
)
def test_from_python_units_are_warned_of_by_name(ask):
    with pytest.warns(UnitWarning, match="a joint angle of .* rad is more than a full"):
        ask()


def test_what_is_no_joint_angle_or_just_a_full_turn_is_not_noted():
    arcs = Swimmer(Viscous(), Serpenoid(elements=12))
    Scene(arcs, Circle(amplitude=9))  # curvature times length
    Scene(Swimmer(Viscous(), Chain()), Circle(amplitude=2 * math.pi))
    Scene(Swimmer(Viscous(), Backbone(8)), Sine(amplitude=10, elements=8))


IN_DEGREES = [
    "velocity s.toml --alpha 30deg,0.5 --alphadot -90deg,1",
    "displacement s.toml --amplitudes 30deg:90deg:3 --tiers direct",
    "sweep s.toml --over medium.gamma0=10deg,17deg --over gait.amplitude=30deg,60deg",
    "connection s.toml --extent 120deg --grid 5",
]


@pytest.mark.parametrize("line", IN_DEGREES)
def test_degrees_are_taken_wherever_angles_are(line, tmp_path):
    folder = scene(tmp_path, PLAIN)
    plain = re.sub(r"(\d+)deg", lambda x: f"{math.radians(float(x[1])):.17g}", line)
    results = []
    for words in (line, plain):
        code, _, err = geomech(*words.split(), "-o", "s.json", cwd=folder)
        assert (code, err) == (0, "")
        results.append(load_result(folder / "s.json"))
    for variable in results[0].variables:
        if variable.values.dtype.kind == "f" and variable.name != "seconds":
            other = results[1][variable.name].values
            np.testing.assert_allclose(variable.values, other, rtol=1e-9, atol=1e-12)


def test_a_field_is_as_wide_as_it_is_asked_for(tmp_path):
    ask = "connection s.toml --extent 120deg --grid 5 -o a.nc"
    geomech(*ask.split(), cwd=scene(tmp_path, PLAIN))
    axis = load_result(tmp_path / "a.nc")["alpha_1"].values
    np.testing.assert_allclose(axis, np.pi / 3 * np.arange(-2, 3), atol=1e-12)


@pytest.mark.parametrize(
    "gait", ["amplitude = 2.7", "centre = [2.6, 0]\namplitude = 0.1"]
)
def test_a_gait_off_the_field_is_refused_by_every_command_alike(gait, tmp_path):
    folder = scene(tmp_path, PLAIN + gait)
    told = geomech("displacement", "s.toml", cwd=folder)
    assert told[:2] == (2, "")
    assert (
        "lies outside the field, which covers -2.5 to 2.5: widen the extent" in told[2]
    )
    assert geomech("ccf", "s.toml", "--plot", "c.png", cwd=folder) == told
    assert geomech("accuracy", "s.toml", cwd=folder) == told


AXES = connection.grid(2, 5, 1.0)
CORNERS = (0, 0), (2, 0), (2, 0.02), (0, 0.02)
# Calls that warn, in a copy of data/frozen with the files of `warned_of`.
WARNING = [
    lambda: Scene(VISCOUS.system, Circle(amplitude=30)),
    lambda: Scene(VISCOUS.system, Points(CORNERS)),
    lambda: Scene(Swimmer(GLASS, Chain(), [EndCaps(0.5)]), Circle()),
    lambda: connection.fit(lambda a, r: [1.0, 2.0, 3.0], AXES),
    lambda: scenes.load("small.toml"),
    lambda: scenes.load("fast.toml"),
    lambda: MeshFile("wedge.stl", scale=0.1),
    lambda: fit_gait("trial.csv"),
    lambda: fit_gait("log.csv", degrees=True),
    lambda: fit_medium("push.csv"),
    lambda: velocity(VISCOUS, alpha=(30, 0), alphadot=(1, 0)),
]


def write_files_that_are_warned_of(folder):
    (folder / "small.toml").write_text(PLAIN.replace("13.8", "0.24"))
    snake = (folder / "snake.toml").read_text()
    (folder / "fast.toml").write_text(snake.replace("[gait]", "[gait]\nfrequency = 9"))
    rows = (folder / "push.csv").read_text().replace(",", ";")
    (folder / "push.csv").write_text(rows)


@pytest.mark.parametrize("call", WARNING)
def test_a_warning_points_at_the_line_of_the_caller(call):
    with frozen.place() as folder, warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        write_files_that_are_warned_of(folder)
        call()
    place = __file__, call.__code__.co_firstlineno
    assert {(x.filename, x.lineno) for x in told} == {place}


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
    fitted = connection.fit(velocity, AXES)
    expected = connection.fit(turning, AXES)
    np.testing.assert_allclose(fitted.A, expected.A, atol=1e-14)
    np.testing.assert_allclose(fitted.residual, expected.residual, atol=1e-14)


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
            "(at line 3, column 5): 'C = .8', a number needs a digit before its decimal point",
        ),
        ("C = 1.8", "C = 1,8", "'C = 1,8', a number has a decimal point, not a comma"),
        (
            "C = 1.8",
            "C = 1.8 # yes\nk = 2 Pa",
            "(at line 4, column 7): 'k = 2 Pa', write numbers without a unit",
        ),
        (
            "gamma0_deg = 13.8",
            "gamma0 = 13.8 deg",
            "write numbers without a unit: a key that ends in _deg takes degrees",
        ),
        ("C = 1.8", "C: 1.8", "'C: 1.8', write KEY = VALUE"),
        ("C = 1.8", "C =", "give the key a value"),
        ("C = 1.8\n", "", "[medium] has no `C`: add C = ..."),
        (
            "C = 1.8",
            'C = "big"',
            "Expected `float`, got `str` - at `.C`: give a number instead of 'big'",
        ),
        ('"chain"', '"chain"\nlengths = [1, "1", 1]', "give a number instead of '1'"),
        ('"chain"', '"chain"\nlengths = 3', "give a list in [ ] instead of 3"),
        ('"circle"', '"circle"\nreverse = 1', "give true or false instead of 1"),
        (
            '"circle"',
            '"circle"\ncentre_deg = ["a", 1]',
            "give a number instead of 'a'",
        ),
        (
            '"circle"',
            '"circle"\n[numerics]\ngrid = 31.5',
            "give a whole number without a point instead of 31.5",
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
    folder = scene(tmp_path, PLAIN.replace(old, new))
    code, out, err = geomech("explain", "s.toml", cwd=folder)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: s.toml")
    assert said in err
