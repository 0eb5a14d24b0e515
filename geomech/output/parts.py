"""Files that scenes take their parts from: connections, and scenes themselves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from geomech.core.variables import Result
from geomech.io.files import write_text
from geomech.io.results import write_netcdf
from geomech.measured import results
from rft.core.refusal import Refusal


def write_measured(result: Result, path: Path) -> None:
    """Write the connection near a measured gait, or the kinematics of midlines."""
    write_netcdf(
        path, result if result.kind == "midlines" else results.of_fit(result.subject)
    )


def mean_gait(
    field: Path | None,
) -> tuple[Callable[[Result, Path], None], Callable[[Path], Any]]:
    """Return a function that writes a scene of a measured gait, whose connection is in the file ``field``, and a check of the
    name of that scene."""

    def check(path: Path) -> None:
        if path.suffix != ".toml":
            raise Refusal(
                f"cannot write {path}", instead="end the name of a scene in .toml"
            )
        if field is None:
            raise Refusal(
                "--scene names the field's file", instead="say -o FIELD.nc, too"
            )

    return lambda result, path: write_text(
        path, results.scene_toml(result.subject, field, path)
    ), check
