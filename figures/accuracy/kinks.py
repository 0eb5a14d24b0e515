"""Errors near kinks of the velocity: misfit of the linear connection and of the odd
harmonics, as maps over shape space.

Left: fraction of the directions of alphadot for which some link stands still. Middle
and right: residual of the turning rate, rms over directions, for the first harmonic
(the connection) and for all odd harmonics up to the 15th.
"""

from __future__ import annotations

import functools

import numpy as np

from figures import main
from geomech import plots
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations import harmonics
from geomech.scenes import load


def compute(
    scene: str = "three-link-glass", grid: int = 51, directions: int = 48
) -> dict:
    """Return axes; stuck (N, N); residual: {1: (N, N), 15: (N, N)} in rad per rad."""
    loaded = load(scene).with_numerics(grid=grid)
    axes = connection.grid(2, grid, loaded.numerics.extent)
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)[:, :, None]
    solution = loaded.system.solve(
        alpha, connection.directions(2, directions)
    ).checked()
    fit = functools.partial(
        harmonics.fit,
        loaded.system.velocity,
        axes,
        directions,
        traits=loaded.system.traits,
    )
    residual = {k: fit(highest=k).residual[2] for k in (1, 15)}
    return {
        "axes": axes,
        "stuck": (solution.status == "stuck").mean(-1),
        "residual": residual,
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(10.8, 3.0, 3)
    residual = numbers["residual"]
    maps = (
        (numbers["stuck"], "directions with a link at rest", 1.0),
        (residual[1], "residual of the connection (rad/rad)", residual[1].max()),
        (residual[15], "residual of 15 harmonics (rad/rad)", residual[15].max()),
    )
    for ax, (values, label, top) in zip(axes[0], maps):
        image = ax.pcolormesh(
            *numbers["axes"],
            values.T,
            cmap="viridis",
            vmin=0,
            vmax=top,
            shading="nearest",
            rasterized=True,
        )
        fig.colorbar(image, ax=ax, shrink=0.85).set_label(label)
        plots.shape_space(ax, numbers["axes"])
    return fig


if __name__ == "__main__":
    main("kinks", compute, draw)
