"""Shape space redrawn by what it costs: against planes that are known, and pictures of it."""

import numpy as np
import pytest
from matplotlib.axes import Axes

from geomech import plots
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry import connection, curvature, metric
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.stretch import (
    _inverted_fraction,
    _linear_map,
    stretch,
)


def constant(M, points=9, extent=1.5):
    axes = connection.grid(2, points, extent)
    return metric.Metric(
        axes,
        np.broadcast_to(np.asarray(M)[..., None, None], (2, 2, points, points)).copy(),
    )


def shapes(axes):
    return np.stack(np.meshgrid(*axes, indexing="ij"))


def test_the_euclidean_plane_stays():
    found = stretch(constant(np.eye(2)))
    assert np.abs(found.field.values - shapes(found.field.axes)).max() < 1e-12
    assert found.largest < 1e-12 and found.folded == 0
    assert np.abs(found.area.values - 1).max() < 1e-12


def test_a_constant_metric_becomes_its_root():
    M = np.array([[2.0, 0.7], [0.7, 0.5]])
    found = stretch(constant(M))
    values, vectors = np.linalg.eigh(M)
    root = (vectors * np.sqrt(values)) @ vectors.T
    assert found.field.values == pytest.approx(
        np.einsum("ij,jkl->ikl", root, shapes(found.field.axes)), abs=1e-10
    )
    assert found.area.values == pytest.approx(
        np.full((9, 9), np.sqrt(np.linalg.det(M))), rel=1e-9
    )


def test_what_costs_next_to_nothing_is_drawn_at_first_with_a_width():
    line = np.array([1.0, -0.3])
    first = _linear_map(
        constant(np.outer(line, line)),
        np.moveaxis(shapes(connection.grid(2, 9, 1.5)), 0, -1),
    )
    assert np.linalg.cond(first.reshape(-1, 2)) == pytest.approx(1e3)


def bent(alpha):
    """A plane in curved coordinates."""
    x, y = alpha[..., 0], alpha[..., 1]
    return np.stack(
        [x + 0.3 * np.sin(y) + 0.1 * x**2, 1.4 * y + 0.2 * x**2 - 0.2 * x], -1
    )


def pulled_back(alpha, rate):
    x, y = alpha[..., 0], alpha[..., 1]
    u, v = rate[..., 0], rate[..., 1]
    return ((1 + 0.2 * x) * u + 0.3 * np.cos(y) * v) ** 2 + (
        (0.4 * x - 0.2) * u + 1.4 * v
    ) ** 2


def test_a_flat_metric_in_disguise_is_flattened():
    off, left = [], []
    for points in (11, 21):
        found = stretch(metric.fit(pulled_back, connection.grid(2, points, 1.5)))
        assert (
            np.abs(found.field.values[:, points // 2, points // 2]).max() < 1e-12
        )  # the middle stays
        true = bent(np.moveaxis(shapes(found.field.axes), 0, -1)).reshape(-1, 2)
        u = np.moveaxis(found.field.values, 0, -1).reshape(-1, 2)
        true, u = true - true.mean(0), u - u.mean(0)
        turn = np.linalg.svd(u.T @ true)
        off.append(np.abs(u @ turn[0] @ turn[2] - true).max())
        left.append(found.rms)
    assert off[0] < 2e-3 and np.log2(off[0] / off[1]) > 1.8
    assert left[0] < 1e-3 and np.log2(left[0] / left[1]) > 1.8


def test_a_sphere_does_not_lie_flat():
    """A cap of the unit sphere in longitude and latitude: the residual tells it, and grows with the cap."""
    cap = lambda alpha, rate: (
        np.cos(alpha[..., 1]) ** 2 * rate[..., 0] ** 2 + rate[..., 1] ** 2
    )
    small, large = (
        stretch(metric.fit(cap, connection.grid(2, 15, extent)))
        for extent in (0.3, 0.9)
    )
    assert 1e-4 < small.rms < 0.02 < large.rms < 0.2
    assert np.log(large.rms / small.rms) / np.log(3) == pytest.approx(2, abs=0.3)
    assert large.distortion.max() <= large.largest and large.rms < large.largest


def test_displacement_is_density_times_area_on_paper():
    found = stretch(metric.fit(pulled_back, connection.grid(2, 21, 1.5)))
    x, y = shapes(connection.grid(2, 31, 1.5))
    field = Field(connection.grid(2, 31, 1.5), np.stack([1 + 0 * x, x, x * y]))
    density = found.density(field)
    assert density.shape == (3, 21, 21)
    assert density * found.area.values == pytest.approx(
        np.moveaxis(field(np.moveaxis(shapes(found.field.axes), 0, -1)), -1, 0)
    )
    u, v = found.field.values
    quads = 0.5 * (
        np.diff(u, axis=0)[:, :-1] * np.diff(v, axis=1)[:-1]
        - np.diff(u, axis=1)[:-1] * np.diff(v, axis=0)[:, :-1]
    )
    assert 2 * quads.sum() == pytest.approx(
        found.area.values[:-1, :-1].sum() * (3.0 / 20) ** 2, rel=0.05
    )


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: stretch(constant(np.eye(2)), 3), "points must be"),
        (lambda: stretch(constant(np.eye(2)), 7.5), "points must be"),
        (lambda: stretch(constant(np.zeros((2, 2)))), "costs nothing"),
        (
            lambda: stretch(
                metric.fit(
                    lambda a, u: (u**2).sum(-1) + 0 * a[..., 0], connection.grid(3, 5)
                )
            ),
            "two joints",
        ),
    ],
)
def test_what_cannot_be_redrawn_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def test_winding_numbers():
    t = np.linspace(0, 2 * np.pi, 400)
    eight = np.stack(
        [np.sin(t), np.sin(2 * t)], -1
    )  # up through its middle: clockwise on the right
    x, y = np.array([-1.5, -0.5, 0.5, 1.2]), np.array([-0.9, 0.1])
    assert plots.winding(eight, x, y).tolist() == [[0, 0], [0, 1], [0, -1], [0, 0]]
    twice = 0.5 * np.stack([np.cos(2 * t), np.sin(2 * t)], -1)
    assert plots.winding(twice, x, y + 0.1).tolist() == [[0, 0], [0, 0], [0, 0], [0, 0]]
    assert plots.winding(1.3 * twice, x, y).tolist() == [[0, 0], [0, 2], [0, 2], [0, 0]]


@pytest.fixture(scope="module")
def fitted():
    def velocity(alpha, rate):
        x, y = alpha[..., 0], alpha[..., 1]
        return np.stack(
            [
                np.sin(y) * rate[..., 0],
                x * rate[..., 1],
                0.3 * rate[..., 0] - 0.2 * x * rate[..., 1],
            ],
            -1,
        )

    return connection.fit(velocity, connection.grid(2, 15, 1.5))


def test_pictures(fitted, monkeypatch):
    lines = Axes.streamplot
    monkeypatch.setattr(
        Axes,
        "streamplot",
        lambda *args, density, **look: lines(*args, density=0.2, **look),
    )
    field, gait = curvature.ccf(fitted), Circle(amplitude=0.8)
    plane = stretch(metric.fit(pulled_back, fitted.axes))
    figures = [
        plots.stretched_figure(field, plane, [gait], unit="BL"),
        plots.ccf_figure(
            field, [gait], style="contours", other=(field, None), names=["a", "b"]
        ),
        plots.ccf_figure(field, [gait], metric=metric.fit(pulled_back, fitted.axes)),
        plots.connection_figure(fitted, style="streamlines"),
        plots.ccf_surface(field, 1, [gait]).figure,
    ]
    for fig in figures:
        assert all(ax.get_title() for ax in fig.axes[:3])
    for fig in figures[::4]:
        fig.canvas.draw()
    rings = [t.get_text() for t in figures[2].legends[0].get_texts()]
    assert rings == [plots.RINGS]
    drawn = figures[0].axes[0].lines[-2].get_xydata()
    assert (
        np.nanmax(np.abs(drawn - plane(gait.shape(np.linspace(0, 2 * np.pi, 400)))))
        < 1e-12
    )
    with pytest.raises(ValueError, match="style"):
        plots.ccf_figure(field, style="surfaces")


def test_the_area_is_shaded_by_what_it_adds(fitted):
    """CCF_x = -cos y, negative: a counter-clockwise circle goes backwards, a clockwise one ahead."""
    field = curvature.ccf(fitted)
    for reverse, word in ((False, "backwards"), (True, "ahead")):
        ax = plots.ccf_contours(
            field,
            0,
            [Circle(amplitude=0.8, reverse=reverse)],
            ax=plots.figure(3, 3)[1][0, 0],
        )
        assert [t.get_text() for t in ax.get_legend().get_texts()] == [word]


def test_the_distortion_at_a_shape_is_that_of_the_edges_that_meet_there():
    """Each against the length of a straight line by a fine sum, of a cap of a sphere that is longer than it is wide."""
    cap = lambda alpha, rate: (
        np.cos(alpha[..., 1]) ** 2 * rate[..., 0] ** 2 + rate[..., 1] ** 2
    )
    axes = np.linspace(-0.9, 0.9, 7), np.linspace(-0.2, 1.2, 6)
    sphere, found = metric.fit(cap, axes), stretch(metric.fit(cap, axes))
    assert found.distortion.shape == (7, 6) and found.folded == 0.0
    u, alpha = (np.moveaxis(x, 0, -1) for x in (found.field.values, shapes(axes)))
    square, times, every = np.zeros((7, 6)), np.zeros((7, 6)), []
    for i, j in np.ndindex(7, 6):
        for k, m in ((i + 1, j), (i, j + 1), (i + 1, j + 1), (i + 1, j - 1)):
            if k < 7 and 0 <= m < 6:
                step = alpha[k, m] - alpha[i, j]
                along = alpha[i, j] + (np.arange(40)[:, None] + 0.5) / 40 * step
                off = (
                    np.linalg.norm(u[k, m] - u[i, j])
                    / sphere.norm(along, np.broadcast_to(step, along.shape)).mean()
                    - 1
                )
                every.append(off)
                for place in ((i, j), (k, m)):
                    square[place], times[place] = (
                        square[place] + off**2,
                        times[place] + 1,
                    )
    assert found.distortion == pytest.approx(np.sqrt(square / times), rel=2e-2)
    assert (found.rms, found.largest) == pytest.approx(
        (np.std([*every, *-np.array(every)]), np.abs(every).max()), rel=1e-2
    )


def test_cells_that_are_turned_over_are_counted_by_triangles():
    """Of a plane that is folded along the middle of its third column of four, all of the last column and half of the third."""
    x, y = shapes((np.arange(5.0), np.arange(4.0)))
    fold = np.stack([np.minimum(x, 6.0 - x), y], -1)
    assert (
        _inverted_fraction(np.stack([x, y], -1)) == 0.0
        and _inverted_fraction(np.stack([y, x], -1)) == 1.0
    )
    assert _inverted_fraction(fold) == 0.25
    sheared = np.stack([x, y], -1)
    sheared[2, 2] = 3.5, 0.5  # beyond the diagonal of the cell to the lower right
    assert 0 < _inverted_fraction(sheared) < 0.25
