"""Minimum-perturbation frames: what they minimise, that they do not depend on where one starts, that they converge."""

import dataclasses

import numpy as np
import pytest
from commands import geomech

from geomech import scenes
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection, coordinates, curvature
from geomech.mathematics.geometry.minimum_perturbation import (
    Basis,
    minimum_perturbation,
)
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.systems import NoSlipSnake, Swimmer
from geomech.mathematics.tiers.area import area
from geomech.mathematics.tiers.direct import direct
from geomech.mathematics.tiers.path import path
from geomech.studies.scene_tables import SceneTables
from rft import Chain, ConstantCurvature, Granular, Serpenoid, Viscous
from rft.bodies.base import body_size
from rft.core.refusal import Refusal
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
FLUID = Viscous(2.0)


def fitted(body, points=31, extent=2.5, medium=FLUID, degree=3):
    return connection.fit(
        Swimmer(medium, body).velocity,
        connection.grid(body.joints, points, extent),
        16,
        degree,
    )


def smallest(first):
    """(frame, the connection in it)."""
    frame = minimum_perturbation(first)
    return frame, dataclasses.replace(first, A=frame.connection(first))


def size(c, rows=(0, 1)):
    return np.sqrt(sum((c.A[k] ** 2).mean() for k in rows))


def test_viscous_three_link_swimmer():
    """Published values, of a coarser discretisation: CCF_x(0, 0) = -0.0204, area integral 0.0510; converged -0.020576, 0.0516.
    The CCF where the frames are parallel and the body straight is that of any of them."""
    _, c = smallest(fitted(Chain()))
    ccf = curvature.ccf(c)
    assert ccf.values[:, 15, 15] == pytest.approx([-0.0205761, 0, 0], abs=1e-6)
    assert area(ccf, Circle(), 1.0) == pytest.approx([-0.05164, 0, 0], abs=1e-4)
    assert np.hypot(
        *direct(Swimmer(FLUID, Chain()).velocity, Circle(), 1.0)[:2]
    ) == pytest.approx(0.0513, abs=1e-4)


def test_work_is_the_same_in_every_frame():
    """Power and internal moments belong to no frame, whichever the velocity is told in."""
    scene = scenes.load("three-link-viscous").with_numerics(grid=9, extent=1.0)
    scene = scene.changed(system=Swimmer(FLUID, Chain((0.7, 1.4, 0.9), length=0.3)))
    inner, outer = (
        scene.system,
        SceneTables(scene).in_frame("minimum-perturbation").scene.system,
    )
    alpha, alphadot = np.random.default_rng(4).uniform(-0.8, 0.8, (2, 20, 2))
    here, there = (
        system.power(alpha, alphadot, system.velocity(alpha, alphadot))
        for system in (inner, outer)
    )
    np.testing.assert_allclose(there, here, rtol=1e-9)
    assert (
        np.abs(outer.velocity(alpha, alphadot) - inner.velocity(alpha, alphadot)).max()
        > 1e-3
    )


@pytest.mark.parametrize("body", [Chain((0.7, 1.4, 0.9), length=0.3), Chain((1, 2, 3))])
def test_it_is_the_same_frame_wherever_one_starts(body):
    poses, found = [], []
    for name in ("mean", "link-1", "link-3"):
        first = fitted(dataclasses.replace(body, frame=name), 41)
        frame, c = smallest(first)
        middle = np.zeros((1, 2))
        own = body.frame_pose(name, middle, middle)[
            0
        ]  # of the first frame in the mean one, whose x they share at the middle
        poses.append(se2.compose(own, frame.pose(middle))[0])
        found.append(c.A)
    assert np.ptp(poses, axis=0) == pytest.approx(
        np.zeros(3), abs=2e-6 * body_size(body)
    )
    for other in found[1:]:
        assert np.abs(other - found[0]).max() < 2e-3 * np.abs(found[0]).max()


def test_no_frame_nearby_has_a_smaller_connection():
    first = fitted(Chain((0.7, 1.4, 0.9)))
    frame, c = smallest(first)
    rng, basis = np.random.default_rng(3), Basis(first.axes, 3)
    weight = lambda rows: sum(
        basis.weighted(basis.at_nodes(basis.coefficients(c2.A[k])) ** 2).sum()
        for k in rows
    )
    alpha = np.stack(np.meshgrid(*first.axes, indexing="ij"), -1)
    for _ in range(4):
        waves = sum(
            rng.normal() * np.cos(alpha @ rng.normal(size=2) + rng.normal())
            for _ in range(5)
        )
        for k, rows in ((0, (0, 1)), (1, (0, 1)), (2, (2,))):
            around = []
            for step in (-1e-3, 0.0, 1e-3):
                values = np.zeros((3, *waves.shape))
                values[k] = step * waves
                h = dataclasses.replace(frame, field=Field(first.axes, values))
                c2 = dataclasses.replace(c, A=h.connection(c))
                around.append(weight(rows))
            assert around[1] < min(around[0], around[2])
            slope = (around[2] - around[0]) / (around[2] + around[0] - 2 * around[1])
            assert abs(slope) < 2e-2  # flat at the minimum: first order is gone


def test_a_frame_that_only_turns_or_shifts_is_undone():
    """A connection that is all gauge, -h^-1 dh seen from h, vanishes in the frame that is found."""
    axes = connection.grid(2, 41, 1.5)
    a, b = np.meshgrid(*axes, indexing="ij")
    values = np.stack(
        [
            0.2 * np.sin(a - 0.5 * b),
            0.3 * np.cos(0.7 * a) - 0.1 * b,
            0.5 * np.sin(a + 0.4 * b),
        ]
    )
    nothing = connection.Connection(
        axes, np.zeros((3, 2, 41, 41)), np.zeros((3, 41, 41)), np.zeros((3, 41, 41))
    )
    gauge = dataclasses.replace(
        minimum_perturbation(nothing), field=Field(axes, values)
    )
    _, c = smallest(dataclasses.replace(nothing, A=gauge.connection(nothing)))
    assert np.abs(gauge.connection(nothing)).max() > 0.4
    assert np.abs(c.A).max() < 1e-4


def test_it_converges_with_the_grid():
    poses = []
    for points in (9, 17, 33, 65):
        frame = minimum_perturbation(fitted(Chain((0.7, 1.4, 0.9)), points))
        poses.append(frame.pose(np.array([[0.9, -1.3], [2.2, 1.7], [-0.4, 0.3]])))
        assert frame.residual < 1e-10
    errors = [np.abs(p - poses[-1]).max() for p in poses[:-1]]
    assert errors[-1] < 1e-5
    assert np.log2(errors[0] / errors[-1]) / 2 > 2.8


@pytest.mark.parametrize(
    "gait",
    [
        Circle(amplitude=0.9, centre=(0.2, -0.1)),
        Ellipse(semi_axes=(1.0, 0.4), tilt=0.7),
    ],
)
def test_displacements_agree_with_other_frames(gait):
    body = Chain((0.7, 1.4, 0.9), frame="link-1")
    first, system = fitted(body, 61), Swimmer(FLUID, body)
    frame, c = smallest(first)
    own, start = direct(system.velocity, gait), gait.shape(np.zeros(1))[0]
    there = frame.net(own, start)
    around = [
        direct(coordinates.in_frame(system.velocity, frame), gait, phases=n) - there
        for n in (128, 512)
    ]
    assert np.abs(around[1]).max() < 1e-8  # all but the spline's own kinks
    assert np.abs(around[1]).max() < np.abs(around[0]).max()
    assert path(c, gait) == pytest.approx(there, abs=2e-5)
    assert np.abs(there - own).max() > 1e-3


@pytest.mark.parametrize(
    "body",
    [
        Serpenoid(elements=12, waves=1.2),
        ConstantCurvature(elements=12, sections=2),
        Chain((1, 1, 1, 2)),
    ],
)
def test_other_bodies(body):
    points = 11 if body.joints == 3 else 21
    first = fitted(body, points, 1.5)
    _, c = smallest(first)
    assert size(c) <= 1.001 * size(first)
    assert size(c, [2]) <= 1.001 * size(first, [2])


def test_sand_is_closer_to_its_area_integral():
    body, medium = Chain(frame="link-2"), Granular(C=1.8, gamma0=np.radians(13.8))
    first = fitted(body, medium=medium)
    _, c = smallest(first)
    off = []
    for where in (first, c):
        exact = path(where, Circle(), [1.0, 1.5])
        off.append(
            np.abs(area(curvature.ccf(where), Circle(), [1.0, 1.5]) - exact)[:, :2].max(
                -1
            )
        )
    assert (off[1] < 0.5 * off[0]).all()


def test_singular_shapes_are_refused():
    snake = NoSlipSnake((1, 1, 1))
    first = connection.fit(
        snake.velocity, connection.grid(2, 21, 1.5), 4, traits=snake.traits
    )
    with pytest.raises(ValueError, match="singular shapes"):
        minimum_perturbation(first)


SCENE = """frame = "minimum-perturbation"
[medium]\nlaw = "{law}"\n{numbers}
[body]\nkind = "chain"\nlengths = [0.7, 1.4, 0.9]\nlength = 0.3
[gait]\nkind = "ellipse"\nsemi_axes = [0.9, 0.5]\ntilt = 0.4\ncentre = [0.2, -0.1]
[numerics]\ngrid = 15\nphases = 64\nextent = 1.6\n"""
LAWS = {"viscous": "ratio = 2.0", "granular": "C = 1.8\ngamma0 = 0.24"}


@pytest.mark.parametrize("law", LAWS)
def test_a_scene_in_it(law):
    """All tiers agree with the frame of the body by carrying over; its text is read back; one solve makes frame and field."""
    scene = scenes.parse(SCENE.format(law=law, numbers=LAWS[law]))
    own = scene.changed(system=scene.system.inner)
    study, plain = SceneTables(scene), SceneTables(own)
    assert (scene.frame, own.frame) == ("minimum-perturbation", "mean")
    start = scene.gait.shape(np.zeros(1))[0]
    carried = lambda g: scene.system.field.net(g, start)
    assert study.poses("direct") == pytest.approx(
        carried(plain.poses("direct")), abs=1e-14
    )
    for tier in ("path", "harmonic", "adapted"):
        there, here = carried(plain.poses(tier)), study.poses(tier)
        assert np.abs(here - there)[:2].max() < 3e-3 * 0.3, tier
    assert np.abs(study.poses("direct") - plain.poses("direct")).max() > 3e-4
    found, first = study.fitted, plain.fitted
    assert found.A == pytest.approx(scene.system.field.connection(first), abs=1e-12)
    turned = np.abs(
        found.residual[2] - first.residual[2]
    ).max()  # the heading's rate does not hang on the frame
    assert turned < 1e-12 and size(found) < size(first)
    assert scenes.parse(scenes.toml(scene)) == scene
    assert scene.with_numerics(grid=9).system.axes != scene.system.axes
    assert scene.with_numerics(phases=32).system is scene.system
    assert scene.with_numerics(tolerance=1e-8).system.inner.solver.tolerance == 1e-8


def test_it_stands_wherever_any_frame_stands(tmp_path):
    """Above all tables, in [body], in [system] and its body; two that contradict each other are refused."""
    above = SCENE.format(law="viscous", numbers=LAWS["viscous"]).replace(
        "grid = 15", "grid = 7"
    )
    line, _, bare = above.partition("\n")
    scene = scenes.parse(above)
    within = bare.replace('kind = "chain"', f'kind = "chain"\n{line}')
    for text in (within, above.replace('kind = "chain"', f'kind = "chain"\n{line}')):
        found = scenes.parse(text)
        assert (
            found == scene
            and found.frame == "minimum-perturbation"
            and scenes.parse(scenes.toml(found)) == scene
        )
    nested = within.replace("[medium]", "[system.medium]").replace(
        "[body]", "[system.body]"
    )
    assert scenes.parse('[system]\nkind = "swimmer"\n' + nested) == scene
    afloat = '[system]\nkind = "floating-chain"\n{}\n[gait]\nkind = "circle"\n[numerics]\ngrid = 7\n'
    assert scenes.parse(afloat.format(line)) == scenes.parse(
        f"{line}\n{afloat.format('')}"
    )
    for frame in ("mean", "link-2"):
        with pytest.raises(
            Refusal,
            match=rf"\[body\] frame = 'minimum-perturbation', but the scene's frame = '{frame}'",
        ):
            scenes.parse(f'frame = "{frame}"\n{within}')
    (tmp_path / "a.toml").write_text(within)
    code, out, err = geomech("explain", "a.toml", cwd=tmp_path)
    assert (code, err) == (0, "") and "seen from its minimum-perturbation frame" in out


def test_no_such_frame_where_there_is_none():
    for extra, said in (
        ('[[effects]]\nkind = "transient"\ntravel = 0.1\n', "transient"),
        ("", "singular shapes"),
    ):
        text = SCENE.format(law="granular", numbers=LAWS["granular"]) + extra
        if not extra:
            text = (
                text[: text.index("[medium]")]
                + '[system]\nkind = "no-slip-snake"\n'
                + text[text.index("[gait]") :]
            )
        with pytest.raises(Refusal, match=said):
            scenes.parse(text)


def test_its_file_and_pictures(tmp_path):
    from scipy.io import netcdf_file

    from geomech import plots
    from geomech.studies.maps import fields

    scene = scenes.parse(SCENE.format(law="viscous", numbers=LAWS["viscous"]))
    fields.save_connection(tmp_path / "c.nc", SceneTables(scene))
    with netcdf_file(tmp_path / "c.nc", mmap=False) as file:
        pose = file.variables["frame_pose"]
        assert np.array(pose[:]) == pytest.approx(scene.system.field.field.values)
        assert (pose.units, file.frame) == (
            b"m, m, rad",
            b"minimum-perturbation",
        )
    fig = plots.frame_figure(scene.system.field.field)
    assert [ax.get_ylabel() for ax in fig.axes[3:]] == [
        "x (m)",
        "y (m)",
        "heading (rad)",
    ]
    for k, ax in enumerate(fig.axes[:3]):
        drawn = np.reshape(np.ma.getdata(ax.collections[0].get_array()), (15, 15)).T
        assert drawn == pytest.approx(scene.system.field.field.values[k])


def test_a_connection_that_turns_by_a_gradient_alone():
    """The differential drive: of A^theta nothing is left, and in the middle the CCF is the cart's own."""
    study = SceneTables(scenes.load("differential-drive"))
    frame, c = smallest(study.fitted)
    assert np.abs(c.A[2]).max() < 1e-10 * np.abs(study.fitted.A[2]).max()
    assert frame.residual < 1e-10
    assert size(c) < size(study.fitted)
    cart, n = study.scene.system, len(c.axes[0]) // 2
    middle = [0, -(cart.wheel_radius**2) / cart.track, 0]
    assert curvature.ccf(c).values[:, n, n] == pytest.approx(middle, abs=1e-4)
