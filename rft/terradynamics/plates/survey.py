"""Survey of a stress map over all tilts and directions: where it dissipates power, and where it pulls."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rft.terradynamics.plates.stress import PlateStress


@dataclass(frozen=True, eq=False)
class Survey:
    """A map over all tilts and directions, before any cut of tension.

    beta: (B,), within +-pi/2, and gamma: (G,), within +-pi, rad, midpoints of equal cells. alpha_x, alpha_z, normal,
    power: (B, G), N/cm^3. normal: stress along the leading normal, positive where the grains pull. power: power of the
    stress at unit speed, negative where the grains dissipate, as they should.

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
        """Share of the plane (beta, gamma) where the map drives the motion, which no ground can."""
        return float((self.power > 0.0).mean())

    def description(self) -> str:
        """Return one line on where the map drives motion and where it pulls."""
        pulls = (
            f"pulls on {100 * self.pulling:.1f} % of the plane"
            if self.pulling
            else "pulls nowhere"
        )
        if not self.pushing:
            return f"takes power at all angles, {pulls}"
        b, g = np.unravel_index(self.power.argmax(), self.power.shape)
        most = f"most at beta = {np.degrees(self.beta[b]):.0f}, gamma = {np.degrees(self.gamma[g]):.0f} degrees"
        return f"drives motion on over {100 * self.pushing:.1f} % of the plane, {most}; {pulls}"


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
    n, v = (
        (np.sin(beta)[:, None], -np.cos(beta)[:, None]),
        (np.cos(gamma), -np.sin(gamma)),
    )
    a_x, a_z = replace(stress, tension="keep").alpha(n, v)
    leading = np.sign((n[0] * v[0] + n[1] * v[1]).round(12))  # 0 at grazing incidence
    normal, power = leading * (n[1] * a_z - n[0] * a_x), v[1] * a_z - v[0] * a_x
    return Survey(beta, gamma, a_x, a_z, normal, power)
