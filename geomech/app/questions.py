"""Questions of measurements, with results that show themselves."""

from __future__ import annotations

from typing import Any

from geomech.app.results import FittedMedium, FittedMidlines
from geomech.core.errors import choose
from geomech.measured.midlines import fit
from geomech.measured.midlines import question as of_midlines
from geomech.studies.calibration import SIZES, Calibration


def fit_midlines(midlines: Any, medium: Any = None, **options: Any) -> FittedMidlines:
    """Return the kinematics of tracked midlines with intervals, as `geomech fit-gait` does.

    Parameters
    ----------
    midlines : path, or `geomech.measured.midlines.trial.Trial`
        CSV file of points along the body over whole cycles.
    medium : medium, name or file
        In which the motion of the measured shapes is predicted; none if left out.
    **options : columns, units, scale, fps, y, head, least_score, individual, body_length,
        mend, level
        See `geomech.measured.midlines.fit.fit_midlines`.
    """
    fitted = FittedMidlines(
        of_midlines.result_of(fit.fit_midlines(midlines, **options))
    )
    return fitted if medium is None else fitted.against(medium)


def fit_medium(
    drag: Any, law: str | None = None, *, end_caps: float | str = 0.0, **sizes: float
) -> FittedMedium:
    """Return the medium fitted to drag measurements, as `geomech fit-medium` does.

    Parameters
    ----------
    drag : path
        A CSV file, whose columns say which law is fitted: psi_deg, F_parallel_N, F_perpendicular_N of a rod; beta,
        gamma, alpha_x, alpha_z of plates; depth_m, force_N of a plate pushed down. Or "short-rod-drag" or
        "flank-drag", the samples.
    law : "granular", "viscous", "coulomb", "stress-map" or "zeta"
    end_caps : number or "fitted"
        Drag on the rod's ends, 1 for one flat end; by default left out.
    **sizes : radius, length, depth (m), density (kg/m^3) of a rod; area (m^2) of a plate
        In place of those that the file says.

    Examples
    --------
    >>> import geomech
    >>> sand = geomech.fit_medium("short-rod-drag")
    >>> round(sand.medium.C, 2), round(sand.medium.gamma0, 2)
    (1.49, 0.22)
    >>> study = geomech.study(sand.medium, geomech.bodies.Chain(), geomech.gaits.Circle(1.0))
    >>> float(study.displacement(tiers="direct")["net_distance"].values[0, 0].round(3))
    0.05
    """
    for name in sizes:
        choose("size", name, (*SIZES, "area"))
    return FittedMedium(
        Calibration(str(drag), law, tuple(sizes.items()), end_caps).ask()
    )
