"""Survey of a stress map over all tilts and directions: where it dissipates power, and
where it pulls."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rft.terradynamics.plates.stress import PlateStress


@dataclass(frozen=True, eq=False)
class Survey:
    """A stress map over all tilts and directions, before any cut of tension.

    beta: (B,), within +-pi/2, and gamma: (G,), within +-pi, rad, midpoints of equal
    cells. alpha_x, alpha_z, normal, power: (B, G), N/cm^3. normal: stress along the
    leading normal, positive where the grains pull. power: power of the stress at unit
    speed, negative where the grains dissipate, as they should everywhere.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, survey
    >>> overview = survey(StressMap(), cells=30)
    >>> overview.beta.shape, overview.alpha_z.shape
    ((30,), (30, 60))
    """

    beta: np.ndarray
    gamma: np.ndarray
    alpha_x: np.ndarray
    alpha_z: np.ndarray
    normal: np.ndarray
    power: np.ndarray

    @property
    def pulling(self) -> float:
        """Share of the plane (beta, gamma) where the map pulls."""
        return float((self.normal > 0.0).mean())

    @property
    def pushing(self) -> float:
        """Share of the plane (beta, gamma) where the map drives the motion, which no
        ground can."""
        return float((self.power > 0.0).mean())

    def description(self) -> str:
        """Return one line on where the map drives motion and where it pulls."""
        pulls = "pulls nowhere"
        if self.pulling:
            pulls = f"pulls on {100 * self.pulling:.1f} % of the plane"
        if not self.pushing:
            return f"dissipates at all angles, {pulls}"
        row, column = np.unravel_index(self.power.argmax(), self.power.shape)
        beta = np.degrees(self.beta[row])
        gamma = np.degrees(self.gamma[column])
        return (
            f"drives the motion on {100 * self.pushing:.1f} % of the plane, most at "
            f"beta = {beta:.0f}, gamma = {gamma:.0f} degrees; {pulls}"
        )


def survey(stress: PlateStress, cells: int = 180) -> Survey:
    """Return the survey of a map on ``cells`` tilts and twice as many directions.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, survey
    >>> overview = survey(StressMap(), cells=30)
    >>> round(float(overview.pulling), 3)  # share of directions in which the map pulls
    0.116
    """
    beta = (np.arange(cells) + 0.5) / cells * np.pi - np.pi / 2
    gamma = (np.arange(2 * cells) + 0.5) / cells * np.pi - np.pi
    n_x = np.sin(beta)[:, None]
    n_z = -np.cos(beta)[:, None]
    v_x = np.cos(gamma)
    v_z = -np.sin(gamma)
    a_x, a_z = replace(stress, tension="keep").alpha((n_x, n_z), (v_x, v_z))
    # The sign of the normal that leads; 0 where a plate slides along itself.
    leading = np.sign((n_x * v_x + n_z * v_z).round(12))
    normal = leading * (n_z * a_z - n_x * a_x)
    power = v_z * a_z - v_x * a_x
    return Survey(beta, gamma, a_x, a_z, normal, power)
