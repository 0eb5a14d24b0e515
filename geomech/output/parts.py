"""Files that scenes take their parts from: connections, media, and scenes themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech import text
from geomech.core.errors import choose
from geomech.core.variables import Result, Variable
from geomech.io.files import note, write_text
from geomech.io.results import write_csv, write_netcdf
from geomech.io.tables import FORMATS, LAYOUTS, ORDERS, SIGNS
from geomech.measured import results
from geomech.text import optimum
from rft.refusal import Refusal


@dataclass(frozen=True)
class Connection:
    """A writer of a connection in the format that an ending names, with this sign, order and layout where it takes them."""

    out: Path | None
    sign: str | None = None
    order: str | None = None
    layout: str | None = None

    def __post_init__(self) -> None:
        if self.out and not hasattr(self.format, "write"):
            endings = [
                ending for ending, known in FORMATS.items() if hasattr(known, "write")
            ]
            raise Refusal(
                f"cannot write {self.out}",
                instead=f"end the name of a connection in {' or '.join(endings)}",
            )
        for name, word, known in (
            ("sign", self.sign, SIGNS),
            ("order", self.order, ORDERS),
            ("layout", self.layout, LAYOUTS),
        ):
            if word is not None:
                choose(f"--{name}", word, known)
                if name not in self._settings(self.format):
                    taking = " or ".join(
                        ending
                        for ending, other in FORMATS.items()
                        if name in self._settings(other)
                    )
                    instead = (
                        f"drop it, a {self.out.suffix} file says what it has"
                        if self.out
                        else "drop it"
                    )
                    raise Refusal(
                        f"--{name} is that of a {taking} file", instead=instead
                    )
        if self.layout == LAYOUTS[1] and (self.sign or self.order):
            raise Refusal(
                "a struct s has its own sign and order",
                instead="drop --sign and --order",
            )

    @property
    def format(self) -> Callable | None:
        """The format, None of no file, or of one with another ending."""
        return FORMATS.get(self.out.suffix) if self.out else None

    @staticmethod
    def _settings(file: Callable | None) -> tuple[str, ...]:
        return getattr(file, "settings", ())

    def __call__(self, result: Result, path: Path) -> None:
        given = {
            name: word
            for name in ("sign", "order", "layout")
            if (word := getattr(self, name))
        }
        self.format.write(path, result, **given)
        if (
            "sign" in self._settings(self.format)
            and not self.sign
            and self.layout != LAYOUTS[1]
        ):
            note(f"{path} has {SIGNS['+']}; --sign - gives the other")


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


def write_best(result: Result, path: Path) -> None:
    """Write a scene with the best gait."""
    write_text(path, optimum.scene_toml(result))


def check_forces(path: Path) -> None:
    """Refuse a name that is none of a NetCDF file or a table."""
    if path.suffix not in (".nc", ".csv"):
        raise Refusal(f"cannot write {path}", instead="end the name in .nc or .csv")


def write_forces(result: Result, path: Path) -> None:
    """Write forces along a body: all variables as NetCDF, or those over phase and place as a table with a row for each."""
    if path.suffix == ".nc":
        write_netcdf(path, result)
        return
    over = [v for v in result.variables if v.dims == ("phase", "s")]
    phase, s = np.meshgrid(result["phase"].values, result["s"].values, indexing="ij")
    columns = [Variable("phase", (), phase), Variable("s", (), s), *over]
    rows = [replace(v, dims=("row",), values=v.values.ravel()) for v in columns]
    write_csv(path, replace(result, variables=tuple(rows)))


def write_medium(result: Result, path: Path) -> None:
    """Write a medium that was calibrated."""
    write_text(path, text.medium(result))


def about_medium(result: Result, path: Path) -> str:
    """Return the line that says how a scene takes a medium."""
    scene = "a scene" if result.kind == "rod_drag" else "an intruder scene"
    return f'medium in {path}: in {scene}, [medium] file = "{path.name}"'
