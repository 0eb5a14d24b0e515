"""Geometry on stored connections: body frames, metrics, and what is computed with them, as of the systems they came from."""

import dataclasses
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from commands import geomech
from scipy.io import loadmat, savemat

import rft
from geomech import plots, scenes
from geomech.io import tables
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.coordinates import change_velocity
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.systems import Swimmer, Table
from geomech.scenes import Numerics, Scene
from geomech.shell.describe.system import system_lines
from geomech.studies.estimates import effort, estimate
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
UNEVEN = rft.Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3)
GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.3, -0.2))
GLASS, VISCOUS = rft.Granular(1.8, np.radians(13.8)), rft.Viscous(2.0)
FRAMES = ["mean", "link-3", "minimum-perturbation"]


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """{medium: (study, its files by ending)} of one body of 0.3 m."""
    found = {}
    for name, medium in (("glass", GLASS), ("viscous", VISCOUS)):
        study = SceneTables(
            Scene(
                Swimmer(medium, UNEVEN),
                GAIT,
                Numerics(grid=15, extent=2.0, harmonics=5),
            )
        )
        files = {
            ending: tmp_path_factory.mktemp(name) / f"a{ending}"
            for ending in (".nc", ".mat")
        }
        for path in files.values():
            fields.save_connection(path, study)
        found[name] = study, files
    return found


def on(path, gait=GAIT, **settings):
    return SceneTables(Scene(Table(path, **settings), gait))


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize(
    ("medium", "ending"),
    [("glass", ".nc"), ("glass", ".mat"), ("viscous", ".nc"), ("viscous", ".mat")],
)
def test_a_table_in_another_frame_is_its_source_in_that_frame(
    medium, ending, frame, sources
):
    """A to rounding, or to the spline where the frame is one of numbers; displacements within their errors."""
    source, files = sources[medium]
    other, table = source.in_frame(frame), on(files[ending], frame=frame)
    assert table.scene.frame == frame == on(files[ending]).in_frame(frame).scene.frame
    np.testing.assert_allclose(table.fitted.A, other.fitted.A, atol=1e-9)
    assert (
        table.fitted.residual >= other.fitted.residual - 1e-12
    ).all()  # an upper bound
    amplitudes = [0.4, 0.9]
    poses, errors = estimate.direct(table.scene, GAIT, amplitudes, 64)
    distance = estimate.pose_distance(
        poses, other.poses("direct", GAIT, amplitudes), 0.3
    )
    assert (distance <= errors + 1e-9).all()
    assert table.poses("area", None, [0.4])[0, 0] == pytest.approx(
        other.poses("area", None, [0.4])[0, 0], abs=1e-5
    )
    again = scenes.parse(scenes.toml(table.scene), "again.toml")
    assert again.system == table.scene.system and again.frame == frame


@pytest.mark.parametrize("joints", [2, 3])
def test_harmonics_are_carried_over(joints):
    """The velocity at a grid point is that of the frame there, in every direction of alphadot, and back."""
    chain = rft.Chain((1, 2, 1.5, 1)[: joints + 1], frame="link-1")
    swimmer, axes = Swimmer(GLASS, chain), connection.grid(joints, 5, 1.0)
    A, series = (
        f(swimmer.velocity, axes, 24, traits=swimmer.traits)
        for f in (connection.fit, partial(harmonics.fit, highest=3))
    )
    errors = np.random.default_rng(1).uniform(0.1, 1.0, A.A.shape)
    body = {"lengths": chain.lengths, "frame": "link-1"}
    stored = tables.Stored(
        A, series, frame="link-1", body=body, A_error=errors, even=errors[:, 0]
    )
    alpha, rates = (
        np.full(joints, 0.5),
        np.random.default_rng(0).normal(size=(9, joints)),
    )
    here = (..., *[3] * joints)  # of alpha on the grid
    for frame in ("link-2", "mean"):
        other = tables.in_frame(stored, frame, chain)
        bound = np.abs(
            se2.adjoint(se2.inverse(chain.frame_pose(frame, alpha, rates[0])[0]))
        )
        np.testing.assert_allclose(
            other.A_error[here], bound @ errors[here], rtol=1e-12
        )
        for name in ("even", "residual"):
            ours, its = (
                getattr(x if name == "even" else x.connection, name)[here]
                for x in (other, stored)
            )
            np.testing.assert_allclose(ours, bound @ its, rtol=1e-12)
        xi = change_velocity(
            series.velocity(alpha, rates), *chain.frame_pose(frame, alpha, rates)
        )
        np.testing.assert_allclose(
            other.harmonics.velocity(alpha, rates), xi, atol=1e-12
        )
        back = tables.in_frame(other, "link-1", dataclasses.replace(chain, frame=frame))
        np.testing.assert_allclose(
            back.harmonics.coefficients, series.coefficients, atol=1e-12
        )
        np.testing.assert_allclose(back.connection.A, A.A, atol=1e-12)


def test_the_metric_of_a_table_is_that_of_its_source(sources):
    """In .nc files whatever it is, in .mat files where it is a quadratic form; the same in every frame."""
    source, files = sources["viscous"]
    for path in files.values():
        np.testing.assert_array_equal(on(path).metric.M, source.metric.M)
        np.testing.assert_array_equal(on(path, frame="mean").metric.M, source.metric.M)
        ours, its = (x.effort(None, [0.4, 0.9]) for x in (on(path), source))
        for name in ("path_length", "work"):
            np.testing.assert_allclose(ours[name], its[name], rtol=1e-4)
    source, files = sources["glass"]
    np.testing.assert_array_equal(
        on(files[".nc"]).metric.coefficients, source.metric.coefficients
    )
    with pytest.raises(
        Refusal,
        match="no metric with this table: its file tells no power, and the scene no medium",
    ):
        on(files[".mat"]).metric  # noqa: B018


@pytest.mark.parametrize("medium", ["glass", "viscous"])
def test_a_medium_gives_a_table_its_metric(medium, sources, tmp_path):
    """By the law on the file's body, or the scene's, moved as the table says: in a fluid exactly; in sand a norm, within what
    A leaves of the velocity."""
    source, files = sources[medium]
    law = {"glass": GLASS, "viscous": VISCOUS}[medium]
    table = on(files[".mat"], medium=law)
    assert type(table.metric) is type(source.metric)
    ours, its = (x.effort(None, [0.4, 0.9])["path_length"] for x in (table, source))
    np.testing.assert_allclose(ours, its, rtol=1e-4 if medium == "viscous" else 0.15)
    framed = on(files[".mat"], medium=law, frame="minimum-perturbation")
    np.testing.assert_allclose(
        framed.effort(None, [0.4, 0.9])["path_length"], ours, rtol=1e-12
    )
    bare(files[".mat"], tmp_path / "bare.mat")
    told = on(
        tmp_path / "bare.mat",
        sign="+",
        body_length=0.3,
        medium=law,
        body=rft.Chain((0.7, 1.4, 0.9), frame="link-1"),
    )
    np.testing.assert_allclose(
        told.effort(None, [0.4, 0.9])["path_length"], ours, rtol=1e-12
    )
    np.testing.assert_allclose(
        told.in_frame("mean").fitted.A[2],
        on(files[".mat"], frame="mean").fitted.A[2],
        atol=1e-12,
    )


def bare(path, to, **more):
    """Write a .mat file as another program does: the arrays, and nothing else."""
    arrays = {
        k: v
        for k, v in loadmat(path).items()
        if k[0] != "_" and "geomech" not in k and k[0] != "M"
    }
    savemat(to, {**arrays, **more})


def test_a_scene_gives_a_table_its_body_and_medium(sources, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bare(sources["viscous"][1][".mat"], tmp_path / "a.mat")
    body = (
        '[system.body]\nkind = "chain"\nlengths = [0.7, 1.4, 0.9]\nframe = "link-1"\n'
    )
    text = '[system]\nkind = "table"\nfile = "a.mat"\nsign = "+"\nbody_length = 0.3\n'
    text += f'{body}[system.medium]\nlaw = "viscous"\nratio = 2.0\n'
    text += '[gait]\nkind = "circle"\namplitude = 0.8\n'
    (tmp_path / "t.toml").write_text(text)
    (tmp_path / "mean.toml").write_text(f'frame = "mean"\n{text}')
    for name, frame in (("t", "link-1"), ("mean", "mean")):
        scene = scenes.load(f"{name}.toml")
        assert scene.frame == frame and isinstance(scene.system.medium, rft.Viscous)
        assert scenes.parse(scenes.toml(scene)).system == scene.system
        lines = "\n".join(system_lines(scene.system))
        assert (
            "changes of shape cost the drag of viscous (ratio = 2.0) on chain ("
            in lines
        )
        assert ("frame mean, from link-1 in the file" in lines) == (frame == "mean")
    code, out, err = geomech(
        "displacement", "t.toml", "--amplitudes", "0.8", "--effort", "--json"
    )
    assert code == 0 and "path_length" in out, err


def test_metrics_of_files_from_elsewhere_are_their_own(sources, tmp_path):
    """Nothing says that M is a power: path lengths are in its own unit, and no work is known."""
    study, files = sources["viscous"]
    M = dict(zip(("M11", "M12", "M22"), study.metric.M[np.triu_indices(2)]))
    bare(files[".mat"], tmp_path / "a.mat", **M)
    table = on(tmp_path / "a.mat", sign="+")
    np.testing.assert_array_equal(table.metric.M, study.metric.M)
    assert effort.units(table.scene.system)["path_length"] == effort.METRIC_UNIT
    assert np.isnan(table.effort()["work"]).all()
    bare(files[".mat"], tmp_path / "a.mat", **{**M, "M12": 9.0 + M["M12"]})
    with pytest.raises(
        Refusal,
        match=r"has M11, M12 and M22 that are no metric at index \(0, 0\): it must be positive definite",
    ):
        tables.load(tmp_path / "a.mat")
    bare(files[".mat"], tmp_path / "a.mat", **{**M, "M12": M["M12"][1:]})
    with pytest.raises(
        Refusal,
        match=r"has M12 of shape \(14, 15\) where alpha1 and alpha2 make it \(15, 15\)",
    ):
        tables.load(tmp_path / "a.mat")


def test_a_stretched_picture_and_the_most_efficient_gait_of_a_table(
    sources, tmp_path, monkeypatch
):
    """From a .mat file alone, as from the scene that it came from."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        plots, "save", lambda fig, *paths: [Path(path).touch() for path in paths]
    )
    source, files = sources["viscous"]
    text = f'[system]\nkind = "table"\nfile = "{files[".mat"]}"\n[gait]\nkind = "circle"\namplitude = 0.8\n'
    (tmp_path / "t.toml").write_text(text)
    code, _, err = geomech("ccf", "t.toml", "--stretch", "--plot", "a.png")
    assert code == 0 and (tmp_path / "a.png").exists(), err
    code, _, err = geomech(
        "optimize",
        "t.toml",
        "--objective",
        "efficiency",
        "--harmonics",
        "1",
        "-o",
        "best.toml",
    )
    assert code == 0, err
    best = scenes.load("best.toml").gait
    efficiency = [
        np.hypot(*x.poses("direct", best, [1.0])[0, :2])
        / 0.3
        / x.effort(best, [1.0])["path_length"][0]
        for x in (on(files[".mat"]), source)
    ]
    assert efficiency[0] == pytest.approx(efficiency[1], rel=2e-3)
    best = [
        SceneTables(Scene(x.scene.system, Circle(amplitude=0.8), x.scene.numerics))
        for x in (on(files[".mat"]), source)
    ]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (
            {"frame": "link-4"},
            "frame must be 'mean' or 'link-1' ... 'link-3', got 'link-4'",
        ),
        ({"frame": 3}, "frame must be text"),
        ({"body": rft.Chain((1, 1, 1))}, "a.mat says its body itself: drop the body"),
    ],
)
def test_frames_and_bodies_that_do_not_fit_are_refused(settings, said, sources):
    with pytest.raises(Refusal, match=said):
        Table(sources["viscous"][1][".mat"], **settings)


def test_a_bare_table_asks_for_its_body(sources, tmp_path):
    bare(sources["viscous"][1][".mat"], tmp_path / "a.mat")
    plain = {"file": tmp_path / "a.mat", "sign": "+"}
    with pytest.raises(
        Refusal,
        match=r"no frame 'mean' of a table whose frame is 'that of the table': .* add \[system.body\]",
    ):
        Table(**plain, frame="mean")
    with pytest.raises(
        Refusal,
        match=r"a medium needs the body of .*a.mat, which does not say it: add \[system.body\]",
    ):
        Table(**plain, medium=VISCOUS)
    for body, said in (
        (rft.Chain((1, 1)), "the body has 1 shape variables, .*a.mat 2"),
        (
            rft.Chain((1, 1, 1), 0.3),
            "the body of a table has no length, got 0.3: say body_length",
        ),
    ):
        with pytest.raises(Refusal, match=said):
            Table(**plain, body=body)
