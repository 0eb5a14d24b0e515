"""The CCF of three joints as a two-form, and the area tier by spanning surfaces."""

import numpy as np
import pytest
import xarray

import geomech
from geomech.io.results import to_xarray
from geomech.mathematics.gaits import Circle, Fourier
from geomech.mathematics.geometry import connection, curvature
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.two_form import spanned, two_form
from geomech.mathematics.systems import Swimmer, Table
from geomech.mathematics.tiers.area import area
from geomech.mathematics.tiers.direct import direct
from geomech.studies.maps import fields
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Viscous
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
SYSTEM = Swimmer(Viscous(2.3), Chain((0.7, 1.4, 0.9, 0.6)))
GAIT = Fourier(
    cos=((1.0, 0.0), (0.2, 0.3), (-0.5, 0.2)),
    sin=((0.1, 0.2), (0.9, 0.0), (0.4, -0.4)),
    centre=(0.1, -0.2, 0.15),
)  # in no plane


@pytest.fixture(scope="module")
def form():
    return two_form(
        connection.fit(
            SYSTEM.velocity, connection.grid(3, 13, 1.2), 48, 5, traits=SYSTEM.traits
        )
    )


def test_pairs_are_antisymmetric_and_those_of_curvature(form):
    fitted = connection.fit(
        SYSTEM.velocity, connection.grid(3, 13, 1.2), 48, 5, traits=SYSTEM.traits
    )
    assert form.pairs == ((0, 1), (0, 2), (1, 2))
    for i, j in form.pairs:
        assert np.array_equal(
            form.pair(i, j).values, curvature.ccf(fitted, i, j).values
        )
        assert np.array_equal(form.pair(j, i).values, -form.pair(i, j).values)
    rng = np.random.default_rng(0)
    alpha, u, v = rng.uniform(-1, 1, (5, 3)), *rng.normal(size=(2, 5, 3))
    assert form(alpha, u, v) == pytest.approx(-form(alpha, v, u), abs=1e-14)
    assert form(alpha, u, 2 * v + 3 * u) == pytest.approx(
        2 * form(alpha, u, v), abs=1e-13
    )


def test_a_slice_is_the_field_on_a_plane(form):
    at = np.array([0.3, -0.2, 0.4])
    cut = form.slice(2, 0, at)
    assert cut.axes == (
        form.field.axes[2],
        form.field.axes[0],
    ) and cut.values.shape == (3, 13, 13)
    shape = np.array([form.field.axes[0][4], -0.2, form.field.axes[2][9]])
    assert cut.values[:, 9, 4] == pytest.approx(-form.pair(0, 2)(shape), abs=1e-12)


def test_with_two_joints_every_surface_is_the_area():
    system = Swimmer(Viscous(2.3), Chain((0.7, 1.4, 0.9)))
    fitted, gait = (
        connection.fit(
            system.velocity, connection.grid(2, 31, 1.5), 8, 5, traits=system.traits
        ),
        Circle(centre=(0.1, -0.2)),
    )
    found = spanned(two_form(fitted), gait, [0.4, 1.0])
    assert found.net == pytest.approx(
        area(curvature.ccf(fitted), gait, [0.4, 1.0]), abs=1e-8
    )
    assert found.spread.max() < 1e-8


def test_it_misses_by_order_3_and_hangs_on_the_surface_by_as_much(form):
    sizes = np.array([0.1, 0.2])
    found = spanned(form, GAIT, sizes)
    off = np.hypot(*(found.net - direct(SYSTEM.velocity, GAIT, sizes))[:, :2].T)
    assert np.log2(off[1] / off[0]) == pytest.approx(3, abs=0.25)
    assert np.log2(found.spread[1, 0] / found.spread[0, 0]) == pytest.approx(3, abs=0.3)
    assert (found.spread[:, 0] < off).all()
    assert (
        found.spread[:, 1] < 1e-6 * np.abs(found.net[:, 2])
    ).all()  # turning is closed
    plane = Fourier(cos=((1.0,), (0.2,), (-0.5,)), sin=((0.1,), (0.9,), (0.4,)))
    assert spanned(form, plane, [0.2]).spread.max() < 1e-4 * found.spread[:, 0].min()


def test_a_closed_form_does_not_see_the_surface(form):
    """The exact form d(alpha_1 alpha_2 dalpha_3) has the same integral over all surfaces: that along the loop."""
    from dataclasses import replace

    x, y, _ = np.meshgrid(*form.field.axes, indexing="ij")
    values = np.zeros_like(form.field.values)
    values[1, 2], values[2, 2] = y, x  # on (0, 2) and (1, 2), turning
    found = spanned(
        replace(form, field=replace(form.field, values=values)), GAIT, [0.3, 0.8]
    )
    alpha, alphadot = GAIT.cycle(256, [0.3, 0.8])
    along = (alpha[..., 0] * alpha[..., 1] * alphadot[..., 2]).mean(-1) * 2 * np.pi
    assert found.net[:, 2] == pytest.approx(along, abs=1e-12)
    assert found.spread.max() < 1e-12 and np.abs(along).min() > 1e-4


def test_what_spans_nothing_is_refused(form):
    with pytest.raises(ValueError, match="two of the joints"):
        form.pair(1, 1)
    with pytest.raises(ValueError, match="moves 2 joints"):
        spanned(form, Circle())
    with pytest.raises(ValueError, match="outside the field"):
        spanned(form, GAIT, [3.0])


def test_pairs_are_drawn(form):
    from geomech import plots

    fig = plots.pairs_figure(form, at=[0.2, -0.1, 0.3], component=2)
    titles = [ax.get_title() for ax in fig.axes if ax.get_title()]
    assert (
        len(titles) == 3
        and "0.3" in titles[0]
        and "-0.1" in titles[1].replace("\N{MINUS SIGN}", "-")
    )
    assert (
        fig.axes[1].get_xlabel() == r"$\alpha_{1}$ (rad)"
        and fig.axes[1].get_ylabel() == r"$\alpha_{3}$ (rad)"
    )


def test_the_file_has_all_pairs(form, tmp_path):
    study = SceneTables(
        geomech.Scene(SYSTEM, GAIT, geomech.Numerics(grid=7, extent=1.2))
    )
    fields.save_connection(tmp_path / "made.nc", study)
    assert np.array_equal(Connection.load(tmp_path / "made.nc").A, study.fitted.A)
    saved = to_xarray(fields.full_result(study))["ccf_pairs"]
    assert (
        saved.dims[:2] == ("pair", "component") and "1 2, 1 3, 2 3" in saved.long_name
    )
    assert np.array_equal(saved[1], study.two_form.pair(0, 2).values)
    assert "metric" in to_xarray(fields.full_result(study))
    apart = to_xarray(fields.full_result(study))["ccf_pairs_error"]
    assert (
        np.array_equal(apart[2], curvature.error(study.fitted, 1, 2).values)
        and apart.dims == saved.dims
    )
    assert to_xarray(fields.full_result(study))["pair_joints"].values.tolist() == [
        [1, 2],
        [1, 3],
        [2, 3],
    ]


@pytest.mark.parametrize(
    ("name", "spoilt", "said"),
    [
        (
            "pair_joints",
            lambda x: x[::-1],
            r"pair_joints other than \[\[1, 2\], \[1, 3\], \[2, 3\]\]",
        ),
        (
            "ccf_pairs",
            lambda x: x[:2],
            r"ccf_pairs of shape \(2, 3, 5, 5, 5\) where it must be \(3, 3, ...\)",
        ),
        (
            "ccf_pairs",
            lambda x: x.transpose("component", "pair", ...),
            "ccf_pairs over .component, pair, ",
        ),
        (
            "ccf_pairs_error",
            lambda x: x.where(x < x.max()),
            "ccf_pairs_error that is not finite",
        ),
    ],
)
def test_a_file_with_pairs_that_are_none_is_refused(name, spoilt, said, tmp_path):
    study = SceneTables(
        geomech.Scene(SYSTEM, GAIT, geomech.Numerics(grid=5, extent=1.2))
    )
    fields.save_connection(tmp_path / "a.nc", study)
    assert Table(tmp_path / "a.nc").joints == 3
    with xarray.open_dataset(tmp_path / "a.nc", engine="scipy") as file:
        rest = file.drop_vars(["ccf_pairs", "ccf_pairs_error", "pair_joints"]).assign(
            {name: spoilt(file[name])}
        )
        rest.to_netcdf(tmp_path / "b.nc", engine="scipy", format="NETCDF3_64BIT")
    with pytest.raises(Refusal, match=said):
        Table(tmp_path / "b.nc")
