"""A stress map interpolated between measured plate drags."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.core.checks import real_array
from rft.core.refusal import require
from rft.terradynamics.plates.stress import GRAZING, Grazing, PlateStress, Zeta

# degrees from any pair of angles to the nearest measured one, assumed: 32 in a grid of
# 45 degrees
FARTHEST = 35.0
MOST_PLATES = 5000
FEWEST_PLATES = 6


@dataclass(frozen=True)
class PlateDrags(PlateStress):
    """Linear interpolation, on a triangulation of the plane (beta, gamma), of measured
    alpha_x and alpha_z in N/cm^3.

    beta, gamma: radians, of any size. zeta, grazing, tension: see `StressMap`.

    Each drag also counts for its mirror image and for the plate rotated by pi, so beta
    and gamma within +-pi/2 suffice. Drags at the same angles are averaged. The error is
    of order 2 in the spacing. Refused: fewer than 6 drags, more than 5000, and gaps in
    which angles are more than 35 degrees from all drags.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.plates import PlateDrags, StressMap
    >>> angles = np.radians(np.arange(-90, 91, 30.0))
    >>> beta, gamma = np.meshgrid(angles, angles)
    >>> alpha_x, alpha_z = StressMap()(beta, gamma)
    >>> columns = [tuple(x.ravel()) for x in (beta, gamma, alpha_x, alpha_z)]
    >>> drags = PlateDrags(*columns)
    >>> round(float(drags(0.0, np.pi / 2)[1]), 3)  # N/cm^3, a level plate pushed down
    1.0
    """

    beta: tuple[float, ...]
    gamma: tuple[float, ...]
    alpha_x: tuple[float, ...]
    alpha_z: tuple[float, ...]
    zeta: Zeta = 1.0
    grazing: Grazing = GRAZING
    tension: str = "keep"

    def __post_init__(self):
        for name in ("beta", "gamma", "alpha_x", "alpha_z"):
            values = real_array(name, getattr(self, name))
            require(values.ndim == 1, f"{name} must be a list of numbers")
            require(
                bool((np.abs(values) <= 1e6).all()),
                f"{name} must be finite numbers of at most 1e6",
            )
            object.__setattr__(self, name, tuple(map(float, values)))
        sizes = {len(x) for x in (self.beta, self.gamma, self.alpha_x, self.alpha_z)}
        require(
            len(sizes) == 1,
            "beta, gamma, alpha_x and alpha_z must have the same length",
        )
        count = sizes.pop()
        require(
            FEWEST_PLATES <= count <= MOST_PLATES,
            f"plate drags must be {FEWEST_PLATES} to {MOST_PLATES}, got {count}",
        )
        self._check()
        interpolant = _interpolant(self.beta, self.gamma, self.alpha_x, self.alpha_z)
        object.__setattr__(self, "_interpolant", interpolant)

    def alpha_ahead(self, n, v) -> tuple[np.ndarray, np.ndarray]:
        beta = _principal_tilt(np.arctan2(n[0], -n[1]))
        gamma = np.arctan2(-v[1], v[0])
        angles = np.stack(np.broadcast_arrays(beta, gamma), axis=-1)
        alpha = self._interpolant(angles).reshape(angles.shape)
        return self.zeta * alpha[..., 0], self.zeta * alpha[..., 1]


def _principal_tilt(beta):
    """Return the tilt within +-pi/2 of the same plate."""
    return beta - np.pi * np.round(beta / np.pi)


def _interpolant(beta, gamma, alpha_x, alpha_z):
    """Return the function of (beta, gamma), each within +-pi/2, that interpolates
    (alpha_x, alpha_z).

    It rests on the drags, their mirror images and the rotated plates, in that square
    and around it."""
    from scipy.interpolate import LinearNDInterpolator

    # Rows are (beta, gamma, alpha_x, alpha_z).
    gamma = np.asarray(gamma)
    gamma = gamma - 2 * np.pi * np.round(gamma / (2 * np.pi))
    drags = np.stack([beta, gamma, alpha_x, alpha_z], -1)
    mirrored = drags * [-1, -1, -1, 1] + [0, np.pi, 0, 0]
    rows = _periodic_copies(drags, [0, 2 * np.pi, 0, 0])
    rows = np.concatenate([rows, _periodic_copies(mirrored, [0, 2 * np.pi, 0, 0])])
    rows[:, 0] = _principal_tilt(rows[:, 0])
    rows = _periodic_copies(rows, [np.pi, 0, 0, 0])
    is_near = (np.abs(rows[:, :2]) < np.pi + 1e-9).all(1)
    rows = rows[is_near]

    angles, index = np.unique(rows[:, :2].round(9), axis=0, return_inverse=True)
    index = index.ravel()
    count = np.bincount(index)
    sums = [np.bincount(index, rows[:, column]) for column in (2, 3)]
    means = np.stack(sums, -1) / count[:, None]
    _check_gaps(angles)
    return LinearNDInterpolator(angles, means)


def _periodic_copies(rows, period) -> np.ndarray:
    """Return rows (N, 4), one after another shifted by -1, 0 and 1 times a period."""
    return np.concatenate([rows + k * np.array(period) for k in (-1, 0, 1)])


def _check_gaps(angles) -> None:
    """Raise ValueError where a pair of angles within +-pi/2 is more than `FARTHEST`
    from all of ``angles`` (N, 2), rad."""
    from scipy.spatial import cKDTree

    line = np.linspace(-np.pi / 2, np.pi / 2, 61)
    square = np.stack(np.meshgrid(line, line, indexing="ij"), -1).reshape(-1, 2)
    distance, _ = cKDTree(angles).query(square)
    b, g = np.degrees(square[distance.argmax()])
    require(
        np.degrees(distance.max()) <= FARTHEST,
        f"no plate drag lies within {FARTHEST:g} degrees of beta = {b:.0f}, gamma = "
        f"{g:.0f} degrees: measure some there",
    )
