"""Undulatory swimmers: what a wave along the body achieves (paper Sec. III B, Fig. 9), and closed cases to check it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.gaits import Sine
from geomech.simulate import displacement

if TYPE_CHECKING:
    from geomech.scene import Scene


def performance(scene: Scene, amplitudes) -> dict[str, np.ndarray]:
    """Over a cycle of the scene's sine wave, for amplitudes A / lambda (B,), each (B,):

    progress: net distance, body lengths. efficiency: that over the wavelength; arc_efficiency: over the arc length of a
    wave, lambda_s (the caption of Fig. 9(c) leaves open which). wavelength: body lengths. relative_curvature: mean
    |curvature| x lambda_s. cost_of_transport: work against the medium over (the whole body's axial drag x distance).
    slip: mean angle between body and velocity, rad.
    ValueError if the gait is no sine.
    """
    gait = scene.gait
    if not isinstance(gait, Sine):
        raise ValueError(f"performance is that of a sine wave, got a {type(gait).__name__.lower()}")
    amplitudes = np.asarray(amplitudes, float)
    alpha, alphadot = gait.cycle(scene.numerics.phases, amplitudes)
    xi = scene.velocity(alpha, alphadot)
    spent, length = scene.work(alpha, alphadot, xi), scene.body.length
    g = displacement(xi)
    progress = np.hypot(g[:, 0], g[:, 1]) / length
    wavelength = gait.wavelength(amplitudes)
    energy = 2 * np.pi * spent.power.mean(-1) / length
    return {
        "amplitude": amplitudes,
        "progress": progress,
        "wavelength": wavelength,
        "efficiency": progress / wavelength,
        "arc_efficiency": progress * gait.waves,
        "relative_curvature": gait.relative_curvature(amplitudes),
        "cost_of_transport": energy / np.maximum(progress, 1e-300),
        "slip": spent.slip.mean(-1),
    }


def endless_efficiency(medium, headings: np.ndarray, cap=None) -> float:
    """Efficiency of an endless wave by the balance of force along it alone: no yaw.

    cap: an `rft.EndCaps` whose ends' drag, averaged over the cycle, joins the balance of a body of these headings.

    headings: (N,) of pieces of equal arc length over one wave, rad. In the wave's frame the body slides along the curve
    at speed 1; that frame slips back at (1 - efficiency) times the wave's own speed, the mean cosine of the headings.
    """
    from scipy.optimize import brentq

    c, s = np.cos(headings), np.sin(headings)
    speed = c.mean()

    def along(efficiency):
        v_x, v_y = c - (1 - efficiency) * speed, s
        v_t, v_n = v_x * c + v_y * s, v_y * c - v_x * s
        f_t, f_n = medium.traction(v_t, v_n, 1e-12)
        if cap is not None:
            end_t, end_n = cap.traction(medium, v_t, v_n, 1e-12)
            f_t, f_n = f_t + end_t, f_n + end_n
        return np.mean(f_t * c - f_n * s)

    return float(brentq(along, -1.0, 1.0, xtol=1e-14))


def endless_sine(medium, amplitude: float, cap=None, elements: int = 2000) -> float:
    """`endless_efficiency` of a sine of that A / lambda, of one wave on the body where ends count."""
    gait = Sine(amplitude=amplitude, waves=1.0, elements=elements)
    return endless_efficiency(medium, gait.headings(0.0), cap)


def best(x, y) -> tuple[float, float]:
    """Place and height of the largest of samples y(x), by the parabola through it and its neighbours."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    k = int(np.clip(np.argmax(y), 1, len(y) - 2))
    a, b, c = np.polyfit(x[k - 1 : k + 2] - x[k], y[k - 1 : k + 2], 2)
    if k != np.argmax(y) or a >= 0:
        return float(x[np.argmax(y)]), float(y.max())
    return float(x[k] - b / (2 * a)), float(c - b * b / (4 * a))
