"""Checks of the names of outputs, by their endings."""

from __future__ import annotations

from pathlib import Path

from rft.core.refusal import Refusal


def netcdf(path: Path) -> None:
    if path.suffix != ".nc":
        raise Refusal(
            f"cannot write {path}", instead="end the name of a NetCDF file in .nc"
        )


def csv(path: Path) -> None:
    if path.suffix.lower() != ".csv":
        raise Refusal(f"cannot write {path}", instead="end the name of a table in .csv")


def toml(path: Path) -> None:
    if path.suffix != ".toml":
        raise Refusal(
            f"cannot write {path}", instead="end the name of a scene in .toml"
        )
