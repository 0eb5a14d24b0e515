"""Body frames and metrics of stored connections, as of the systems they came from."""

import numpy as np
import pytest
from scipy.io import loadmat, savemat

import rft
from geomech import scenes
from geomech.io import tables
from geomech.mathematics.gaits import Ellipse
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.coordinates import change_velocity
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.systems import Swimmer, Table
from geomech.scenes import Numerics, Scene
from geomech.studies.estimates import estimate
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
UNEVEN = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2))
GLASS = rft.Granular(1.8, np.radians(13.8))
VISCOUS = rft.Viscous(2.0)
MEDIA = {"glass": GLASS, "viscous": VISCOUS}
FRAMES = ["mean", "link-3", "minimum-perturbation"]


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """The study of a body of 0.3 m and its files by ending, by medium."""
    found = {}
    for name, medium in MEDIA.items():
        numerics = Numerics(grid=15, extent=2.0, harmonics=5)
        study = SceneTables(Scene(Swimmer(medium, UNEVEN), GAIT, numerics))
        folder = tmp_path_factory.mktemp(name)
        files = {ending: folder / f"a{ending}" for ending in (".nc", ".mat")}
        for path in files.values():
            fields.save_connection(path, study)
        found[name] = study, files
    return found


def on(path, gait=GAIT, **settings):
    return SceneTables(Scene(Table(path, **settings), gait))


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("medium", MEDIA)
@pytest.mark.parametrize("ending", [".nc", ".mat"])
def test_a_table_in_another_frame_is_its_source_in_that_frame(
    medium, ending, frame, sources
):
    """A to rounding, or to the spline where the frame is one of numbers; displacements
    within their errors."""
    source, files = sources[medium]
    other = source.in_frame(frame)
    table = on(files[ending], frame=frame)
    assert table.scene.frame == frame == on(files[ending]).in_frame(frame).scene.frame
    np.testing.assert_allclose(table.fitted.A, other.fitted.A, atol=1e-9)
    assert (table.fitted.residual >= other.fitted.residual - 1e-12).all()  # a bound
    poses, errors = estimate.direct(table.scene, GAIT, [0.4, 0.9], 64)
    true = other.poses("direct", GAIT, [0.4, 0.9])
    assert (estimate.pose_distance(poses, true, 0.3) <= errors + 1e-9).all()
    assert scenes.parse(scenes.toml(table.scene)).system == table.scene.system


@pytest.mark.parametrize("frame", ["link-2", "mean"])
@pytest.mark.parametrize("joints", [2, 3])
def test_a_table_is_carried_over_to_a_frame(joints, frame):
    """Velocities as those of the frame, in every direction of alphadot; bounds of
    errors by |Ad|."""
    chain = rft.Chain((1, 2, 1.5, 1)[: joints + 1], frame="link-1")
    swimmer = Swimmer(GLASS, chain)
    axes = connection.grid(joints, 5, 1.0)
    A = connection.fit(swimmer.velocity, axes, 24, traits=swimmer.traits)
    series = harmonics.fit(swimmer.velocity, axes, 24, highest=3)
    errors = np.random.default_rng(1).uniform(0.1, 1.0, A.A.shape)
    stored = tables.Stored(A, series, frame="link-1", A_error=errors, even=errors[:, 0])
    other = tables.in_frame(stored, frame, chain)
    alpha = np.full(joints, 0.5)
    rates = np.random.default_rng(0).normal(size=(9, joints))
    h, hdot = chain.frame_pose(frame, alpha, rates)
    bound = np.abs(se2.adjoint(se2.inverse(h[0])))
    here = (..., *[3] * joints)  # of alpha on the grid
    for found, size in (
        (other.A_error, stored.A_error),
        (other.even, stored.even),
        (other.connection.residual, A.residual),
    ):
        np.testing.assert_allclose(found[here], bound @ size[here], rtol=1e-12)
    xi = change_velocity(series.velocity(alpha, rates), h, hdot)
    np.testing.assert_allclose(other.harmonics.velocity(alpha, rates), xi, atol=1e-12)


@pytest.mark.parametrize("ending", [".nc", ".mat"])
def test_a_quadratic_metric_of_a_table_is_that_of_its_source_in_every_frame(
    ending, sources
):
    source, files = sources["viscous"]
    for frame in ("link-1", "mean"):
        table = on(files[ending], frame=frame)
        np.testing.assert_array_equal(table.metric.M, source.metric.M)


@pytest.mark.parametrize(("medium", "rtol"), [("glass", 0.15), ("viscous", 1e-4)])
def test_a_medium_gives_a_table_its_metric(medium, rtol, sources, tmp_path):
    """By the law on the file's body, or the scene's, that moves as the table says: in
    sand a norm, within what A leaves of the velocity."""
    source, files = sources[medium]
    bare(files[".mat"], tmp_path / "bare.mat")
    body = rft.Chain((0.7, 1.4, 0.9), frame="link-1")
    law = MEDIA[medium]
    told = {"sign": "+", "body_length": 0.3, "medium": law, "body": body}
    table = on(files[".mat"], medium=law)
    assert type(table.metric) is type(source.metric)
    found, its, of_bare = (
        x.effort(None, [0.4, 0.9])["path_length"]
        for x in (table, source, on(tmp_path / "bare.mat", **told))
    )
    np.testing.assert_allclose(found, its, rtol=rtol)
    np.testing.assert_allclose(of_bare, found, rtol=1e-12)


def bare(path, to):
    """Write a .mat file as another program does: the arrays, and nothing else."""
    arrays = loadmat(path)
    savemat(to, {x: arrays[x] for x in arrays if x.startswith(("alpha", "A"))})


@pytest.mark.parametrize(
    ("line", "frame"), [("", "link-1"), ('frame = "mean"', "mean")]
)
def test_a_scene_gives_a_table_its_body_and_medium(line, frame, sources, tmp_path):
    bare(sources["viscous"][1][".mat"], tmp_path / "a.mat")
    text = f"""{line}
[system]
kind = "table"
file = "a.mat"
sign = "+"
body_length = 0.3
[system.body]
kind = "chain"
lengths = [0.7, 1.4, 0.9]
frame = "link-1"
[system.medium]
law = "viscous"
ratio = 2.0
[gait]
kind = "circle"
"""
    (tmp_path / "t.toml").write_text(text)
    scene = scenes.load(tmp_path / "t.toml")
    assert (scene.frame, scene.system.medium) == (frame, VISCOUS)
    assert scenes.parse(scenes.toml(scene)).system == scene.system
