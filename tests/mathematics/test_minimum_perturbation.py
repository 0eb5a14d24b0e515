"""Minimum-perturbation frames: what they minimise, that they do not depend on where
one starts, that they converge."""

import dataclasses

import numpy as np
import pytest
from scipy.io import netcdf_file

from geomech import scenes
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.geometry.minimum_perturbation import (
    Basis,
    minimum_perturbation,
)
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.tiers.area import area
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes.frames import framed
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Viscous
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
    """Return the connection in its minimum-perturbation frame."""
    return dataclasses.replace(first, A=minimum_perturbation(first).connection(first))


def test_viscous_three_link_swimmer():
    """Published values, of a coarser discretisation: CCF_x(0, 0) = -0.0204, area
    integral 0.0510; converged -0.020576, 0.0516. Where the frames are parallel and the
    body straight the CCF is that of any of them."""
    ccf = curvature.ccf(smallest(fitted(Chain())))
    assert ccf.values[:, 15, 15] == pytest.approx([-0.0205761, 0, 0], abs=1e-6)
    assert area(ccf, Circle(), 1.0) == pytest.approx([-0.05164, 0, 0], abs=1e-4)


@pytest.mark.parametrize("body", [Chain((0.7, 1.4, 0.9), length=0.3), Chain((1, 2, 3))])
def test_it_is_the_same_frame_wherever_one_starts(body):
    middle = np.zeros((1, 2))
    poses = []
    found = []
    for name in ("mean", "link-1", "link-3"):
        first = fitted(dataclasses.replace(body, frame=name), 41)
        frame = minimum_perturbation(first)
        own = body.frame_pose(name, middle, middle)[0]
        poses.append(se2.compose(own, frame.pose(middle))[0])
        found.append(frame.connection(first))
    spread = np.ptp(poses, axis=0)
    assert spread == pytest.approx(np.zeros(3), abs=2e-6 * body_size(body))
    assert np.ptp(found, axis=0).max() < 4e-3 * np.abs(found[0]).max()


@pytest.mark.parametrize(("moved", "rows"), [(0, (0, 1)), (1, (0, 1)), (2, (2,))])
@pytest.mark.parametrize("seed", range(2))
def test_no_frame_nearby_has_a_smaller_connection(moved, rows, seed):
    first = fitted(Chain((0.7, 1.4, 0.9)))
    frame = minimum_perturbation(first)
    c = dataclasses.replace(first, A=frame.connection(first))
    basis = Basis(first.axes, 3)
    rng = np.random.default_rng(seed)
    alpha = np.stack(np.meshgrid(*first.axes, indexing="ij"), -1)
    wave = np.cos(alpha @ rng.normal(size=2) + rng.normal())
    sizes = []
    for step in (-1e-3, 0.0, 1e-3):
        values = np.zeros((3, *wave.shape))
        values[moved] = step * wave
        near = dataclasses.replace(frame, field=Field(first.axes, values)).connection(c)
        nodes = basis.at_nodes(basis.coefficients(near[list(rows)]))
        sizes.append(basis.weighted(nodes**2).sum())
    assert sizes[1] < min(sizes[0], sizes[2])


SCENE = """frame = "minimum-perturbation"
[medium]\nlaw = "{law}"\n{numbers}
[body]\nkind = "chain"\nlengths = [0.7, 1.4, 0.9]\nlength = 0.3
[gait]\nkind = "ellipse"\nsemi_axes = [0.9, 0.5]\ntilt = 0.4\ncentre = [0.2, -0.1]
[numerics]\ngrid = 15\nphases = 64\nextent = 1.6\n"""
LAWS = {"viscous": "ratio = 2.0", "granular": "C = 1.8\ngamma0 = 0.24"}


@pytest.mark.parametrize("law", LAWS)
def test_a_scene_in_it(law):
    scene = scenes.parse(SCENE.format(law=law, numbers=LAWS[law]))
    study = SceneTables(scene)
    plain = SceneTables(scene.changed(system=scene.system.inner))
    frame = scene.system.field
    start = scene.gait.shape(np.zeros(1))[0]
    for tier, atol in (("direct", 1e-14), ("path", 1e-3), ("harmonic", 1e-3)):
        carried = frame.net(plain.poses(tier), start)
        np.testing.assert_allclose(study.poses(tier)[:2], carried[:2], atol=atol)
    expected = frame.connection(plain.fitted)
    assert study.fitted.A == pytest.approx(expected, abs=1e-12)


def test_a_scene_in_it_is_read_back_and_solved_anew_where_its_grid_changes():
    scene = scenes.parse(SCENE.format(law="viscous", numbers=LAWS["viscous"]))
    assert scenes.parse(scenes.toml(scene)) == scene
    assert scene.with_numerics(grid=9).system.axes != scene.system.axes
    assert scene.with_numerics(phases=32).system is scene.system
    assert scene.with_numerics(tolerance=1e-8).system.inner.solver.tolerance == 1e-8


def test_its_file_has_the_pose_of_the_frame(tmp_path):
    scene = scenes.parse(SCENE.format(law="viscous", numbers=LAWS["viscous"]))
    fields.save_connection(tmp_path / "c.nc", SceneTables(scene))
    with netcdf_file(tmp_path / "c.nc", mmap=False) as file:
        pose = file.variables["frame_pose"]
        assert np.array(pose[:]) == pytest.approx(scene.system.field.field.values)
        assert pose.units == b"m, m, rad"


def test_frames_that_contradict_each_other_are_refused():
    text = SCENE.format(law="viscous", numbers=LAWS["viscous"])
    text = text.replace("minimum-perturbation", "link-2")
    with pytest.raises(Refusal, match="but the scene's frame = 'link-2'"):
        scenes.parse(text.replace('"chain"', '"chain"\nframe = "minimum-perturbation"'))


@pytest.mark.parametrize(("joints", "most"), [(2, 1414), (3, 125), (4, 13), (6, 5)])
def test_it_is_refused_on_a_grid_that_takes_too_long(joints, most):
    """Beyond 2 million shapes, of more than three joints beyond 30,000."""
    swimmer = Swimmer(FLUID, Chain((1.0,) * (joints + 1)))
    framed(swimmer, Numerics(grid=most))
    with pytest.raises(Refusal, match="grid"):
        framed(swimmer, Numerics(grid=most + 1))
