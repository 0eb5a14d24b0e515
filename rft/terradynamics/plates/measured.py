"""A stress map interpolated between measured plate drags."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.core.checks import real_array
from rft.core.refusal import require
from rft.terradynamics.plates.stress import GRAZING, Grazing, PlateStress, Zeta

FARTHEST = 35.0  # degrees from any pair of angles to the nearest measured one, assumed: 32 in a grid of 45 degrees
MOST_PLATES = 5000
FEWEST_PLATES = 6


@dataclass(frozen=True)
class PlateDrags(PlateStress):
    """Linear interpolation, on a triangulation of the plane (beta, gamma), of measured alpha_x and alpha_z in N/cm^3.

    beta, gamma: radians, of any size. Each drag counts for its mirror image, too, and for the plate rotated by pi, so beta
    and gamma within +-pi/2 suffice. Drags at the same angles are averaged. The error is of order 2 in the spacing.
    Refused: fewer than 6 drags, more than 5000, angles more than 35 degrees from all of them. zeta, grazing, tension: see
    `StressMap`.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.plates import PlateDrags, StressMap
    >>> beta, gamma = (x.ravel() for x in np.meshgrid(*[np.radians(np.arange(-90, 91, 30.0))] * 2))
    >>> drags = PlateDrags(tuple(beta), tuple(gamma), *map(tuple, StressMap()(beta, gamma)))
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
                bool((np.abs(values) <= 1000000.0).all()),
                f"{name} must be finite numbers of at most 1e6",
            )
            object.__setattr__(self, name, tuple(map(float, values)))
        sizes = {len(x) for x in (self.beta, self.gamma, self.alpha_x, self.alpha_z)}
        require(
            len(sizes) == 1, "beta, gamma, alpha_x and alpha_z must be equally many"
        )
        count = sizes.pop()
        message = f"plate drags must be {FEWEST_PLATES} to {MOST_PLATES}, got {count}"
        require(FEWEST_PLATES <= count <= MOST_PLATES, message)
        self._check()
        object.__setattr__(
            self,
            "_interpolant",
            _interpolant(self.beta, self.gamma, self.alpha_x, self.alpha_z),
        )

    def alpha_ahead(self, n, v) -> tuple[np.ndarray, np.ndarray]:
        beta, gamma = np.broadcast_arrays(
            np.arctan2(n[0], -n[1]), np.arctan2(-v[1], v[0])
        )
        alpha = self._interpolant(np.stack([_wrapped(beta), gamma], axis=-1)).reshape(
            *beta.shape, 2
        )
        return self.zeta * alpha[..., 0], self.zeta * alpha[..., 1]


def _wrapped(beta):
    """Return the tilt within +-pi/2 of the same plate."""
    return beta - np.pi * np.round(beta / np.pi)


def _interpolant(beta, gamma, a_x, a_z):
    """Return the function of (beta, gamma), each within +-pi/2, that interpolates (alpha_x, alpha_z).

    It rests on the drags, their mirror images and the rotated plates, in that square and around it."""
    from scipy.interpolate import LinearNDInterpolator

    beta, gamma, a_x, a_z = (np.asarray(x) for x in (beta, gamma, a_x, a_z))
    gamma = gamma - 2 * np.pi * np.round(gamma / (2 * np.pi))
    rows = np.stack([beta, gamma, a_x, a_z], -1)
    mirrored = np.stack([-beta, np.pi - gamma, -a_x, a_z], -1)
    rows = np.concatenate(
        [
            rows + [0, 2 * np.pi * k, 0, 0]
            for rows in (rows, mirrored)
            for k in (-1, 0, 1)
        ]
    )
    rows[:, 0] = _wrapped(rows[:, 0])
    rows = np.concatenate([rows + [np.pi * k, 0, 0, 0] for k in (-1, 0, 1)])
    rows = rows[
        (np.abs(rows[:, 0]) < np.pi + 1e-9) & (np.abs(rows[:, 1]) < np.pi + 1e-9)
    ]
    angles, index = np.unique(rows[:, :2].round(9), axis=0, return_inverse=True)
    index = index.ravel()
    means = (
        np.stack([np.bincount(index, rows[:, k]) for k in (2, 3)], -1)
        / np.bincount(index)[:, None]
    )
    _check_gaps(angles)
    return LinearNDInterpolator(angles, means)


def _check_gaps(angles) -> None:
    """Raise ValueError where a pair of angles within +-pi/2 is more than `FARTHEST` from all of ``angles`` (N, 2)."""
    from scipy.spatial import cKDTree

    line = np.linspace(-np.pi / 2, np.pi / 2, 61)
    square = np.stack(np.meshgrid(line, line, indexing="ij"), -1)
    distance = cKDTree(angles).query(square.reshape(-1, 2))[0]
    b, g = np.degrees(square.reshape(-1, 2)[distance.argmax()])
    message = f"no plate drag within {FARTHEST:g} degrees of beta = {b:.0f}, gamma = {g:.0f} degrees: measure some there"
    require(np.degrees(distance.max()) <= FARTHEST, message)
