"""Results of measured gaits as the objects that scenes and pictures take."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from geomech.core.variables import Result
from geomech.mathematics.gaits import Fourier
from geomech.mathematics.geometry.representations.tube import Loop, TaylorSeries
from geomech.results.scenes import require_result
from geomech.scenes.write import gait_table, table
from rft.core.refusal import Refusal


def series_of(result: Result) -> TaylorSeries:
    """Return the connection near the mean gait of a log."""
    _refuse_other(result)
    return TaylorSeries(
        Loop(result["gait"].values),
        result["gait_A"].values,
        result["gait_slope"].values,
        result["gait_errors"].values,
        result["gait_spread"].values,
        result["gait_beyond"].values,
        result["gait_off"].values,
        float(result.attributes["error_factor"]),
        float(result.attributes["level"]),
    )


def fitted_gait(result: Result) -> Fourier:
    """Return the mean gait of a log, from a result of `fit_gait`: of amplitude 1, with
    the log's frequency if its t is a time.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import geomech
    >>> from geomech.studies.measured import synthetic
    >>> velocity = geomech.load("three-link-viscous").system.velocity
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "log.csv"
    >>> gait = geomech.mathematics.gaits.Circle(0.8)
    >>> synthetic.save(file, synthetic.synthetic_log(velocity, gait, cycles=20, seed=1))
    >>> geomech.fitted_gait(geomech.fit_gait(file, harmonics=2)).joints
    2
    """
    _refuse_other(result)
    # Columns: the mean, then cos and sin of each harmonic in turn.
    series = result["gait"].values
    frequency = None
    if result["frequency"].unit == "Hz":
        frequency = float(result["frequency"])
    return Fourier(
        cos=tuple(map(tuple, series[:, 1::2].tolist())),
        sin=tuple(map(tuple, series[:, 2::2].tolist())),
        centre=tuple(series[:, 0].tolist()),
        frequency=frequency,
    )


def scene_text(result: Result, field: Path, scene: Path) -> str:
    """Return the text of a scene of the mean gait of a log. field: file of the result,
    which is named relative to that of the scene."""
    file = os.path.relpath(field.resolve(), scene.resolve().parent)
    facts = result.attributes
    parts: dict[str, Any] = {
        "system": {"kind": "table", "file": file},
        "gait": gait_table(fitted_gait(result)),
    }
    comment = (
        f"# The mean gait of {facts['cycles']} cycles of {facts['file']}, and the "
        "connection near it.\n"
    )
    tables = [table(name, keys) for name, keys in parts.items()]
    return "\n".join([comment, *tables])


def _refuse_other(result: Result) -> None:
    """Refuse a result that is not of a log of joint angles."""
    require_result(result)
    if "gait" not in result or "gait_A" not in result:
        raise Refusal(
            "this result has no mean gait",
            instead="give a result of ``fit_gait`` for a log of joint angles",
        )
