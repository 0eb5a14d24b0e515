"""Extent of the data of a log about its mean gait."""

from __future__ import annotations

import numpy as np

from geomech.mathematics.geometry.representations.tube import Loop
from geomech.studies.measured.regression import Samples

DEVIATIONS = 2.5  # standard deviations of the samples about the mean gait
PLACES = 64  # phases of the spread
WIDTH = 0.3  # rad of phase, over which it is averaged
LEAST_REACH = 0.02  # of the gait's size: reach of A where cycles do not vary


def spread(
    loop: Loop, samples: Samples, limits: float | None, varied: bool
) -> np.ndarray:
    """Return the spread (d, d, P) of `tube.TaylorSeries`: DEVIATIONS^2 times the
    covariance of deviations without noise, by phase; or the square of ``limits``, rad,
    in all directions.

    Along the gait, where nothing deviates, it is the mean of the spread across it."""
    d = samples.alpha.shape[1]
    least = LEAST_REACH * np.sqrt((loop.coefficients[:, 1:] ** 2).sum() / 2)
    if limits is not None or not varied:
        reach = least if limits is None else limits
        return np.repeat((np.eye(d) * reach**2)[..., None], PLACES, -1)

    (alpha_1, _), (alpha_2, _) = samples.halves
    theta = loop.shape(samples.phase)
    normals = loop.normals(samples.phase)
    one = np.einsum("nik,ni->nk", normals, alpha_1 - theta)
    other = np.einsum("nik,ni->nk", normals, alpha_2 - theta)
    matrices = []
    for t in 2 * np.pi * np.arange(PLACES) / PLACES:
        weight = np.exp((np.cos(samples.phase - t) - 1) / WIDTH**2)
        square = np.einsum("n,ni,nj->ij", weight / weight.sum(), one, other)
        sizes, axes = np.linalg.eigh((square + square.T) / 2)
        sizes = np.maximum(DEVIATIONS**2 * sizes, least**2)
        N = loop.normals(np.array(t)) @ axes
        matrices.append((N * sizes) @ N.T + sizes.mean() * (np.eye(d) - N @ N.T))
    return np.moveaxis(np.array(matrices), 0, -1)
