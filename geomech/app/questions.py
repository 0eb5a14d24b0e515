"""Questions about whatever `geomech.scenes.parts.as_scene` takes for a scene, with results that show themselves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from geomech import optimisation
from geomech.app.results import FittedMedium, FittedMidlines, Optimum, Swept
from geomech.core.errors import choose
from geomech.measured.midlines import fit
from geomech.measured.midlines import question as of_midlines
from geomech.optimisation.limits import LimitsArgument
from geomech.scenes.parts import as_scene
from geomech.studies import accuracy as accuracies
from geomech.studies import sweep as sweeps
from geomech.studies.calibration import SIZES, Calibration


def optimise(
    scene: Any, objective: str = "displacement", *, direction: str | None = None, harmonics: int | None = None,
    limits: LimitsArgument = None, starts: int | None = None, rate: float | None = None, power: float | None = None,
    progress: Callable | None = None,
) -> Optimum:  # fmt: skip
    """Return the gait of a scene with the largest displacement, efficiency, turning or speed.

    Parameters
    ----------
    scene : anything that `geomech.study` takes
        Its gait is the first start of the search.
    objective : "displacement", "efficiency", "turning" or "speed"
        Distance, distance over path length, net turn, or distance over time, per cycle.
    direction : "x" or "y"
        Only that component of the displacement counts; by default the distance.
    harmonics : int
        Harmonics of the Fourier series that is searched, 5 by default. A sine is searched among sines.
    limits : number, or (lowest, highest) for each joint
        Largest joint angles, rad; by default the extent of the scene's field.
    starts : int
        Loops from which the search starts; by default 1, or about 9 for two joints in dry media.
    rate, power : number
        Limits of "speed": largest joint rate, rad/s; mean power, in drag x BL/s.
    progress : function of the fraction done

    Examples
    --------
    >>> import geomech
    >>> best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    >>> round(best.value, 3), best.estimate < 1e-3  # body lengths per cycle, and its error
    (0.101, True)
    """
    found = optimisation.optimise(
        as_scene(scene),
        objective,
        direction,
        harmonics,
        limits,
        starts,
        rate=rate,
        power=power,
        progress=progress,
    )
    return Optimum(**vars(found))


def sweep(scene: Any, over: Mapping[str, Sequence[float]], **options: Any) -> Swept:
    """Return the displacement of a scene's gait, or the speed of its robot, over a grid of parameters such as
    {"medium.C": [1, 2, 3]}; see `geomech.studies.sweep.sweep`.

    Examples
    --------
    >>> import geomech
    >>> table = geomech.sweep("three-link-viscous", {"medium.ratio": [1.5, 2.0], "gait.amplitude": [0.5, 1.0]})
    >>> table["displacement"][..., 1].round(3)  # y, by ratio and amplitude
    array([[0.001, 0.007],
           [0.002, 0.013]])
    """
    return Swept(sweeps.sweep(as_scene(scene), over, **options).result)


def accuracy(
    scene: Any, *, runs: int | None = None, progress: Callable | None = None
) -> dict[str, Any]:
    """Return error and seconds at every setting of a scene as a table; see `geomech.studies.accuracy.study`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", phases=32, grid=7)
    >>> table = geomech.accuracy(study.scene, runs=1)
    >>> sorted(table)
    ['amplitudes', 'cheapest', 'lines', 'scene', 'units']
    """
    return accuracies.study(as_scene(scene), progress, runs)


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
    >>> round(study.displacement(tiers="direct")["net_distance"]["direct"][0], 3)
    0.05
    """
    for name in sizes:
        choose("size", name, (*SIZES, "area"))
    return FittedMedium(
        Calibration(str(drag), law, tuple(sizes.items()), end_caps).ask()
    )
