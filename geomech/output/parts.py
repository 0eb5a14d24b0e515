"""Files that scenes take their parts from: connections, media, and scenes themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geomech import text
from geomech.core.errors import choose
from geomech.core.variables import Result
from geomech.io.files import note, write_text
from geomech.io.results import write_netcdf
from geomech.io.tables import ORDERS, SIGNS
from geomech.measured import results
from geomech.output import mat
from geomech.text import optimum
from rft.refusal import Refusal


@dataclass(frozen=True)
class Connection:
    """A writer of a connection, as NetCDF or, with an ending of .mat, in sysplotter's layout with this sign and order."""

    ending: str
    sign: str | None = None
    order: str | None = None

    def __post_init__(self) -> None:
        for option, word, known in (("--sign", self.sign, SIGNS), ("--order", self.order, ORDERS)):
            if word is not None:
                choose(option, word, known)
                if self.ending in ("", ".nc"):
                    raise Refusal(f"{option} is that of a .mat file", instead="drop it, a .nc file says what it has")

    @property
    def matlab(self) -> bool:
        return self.ending == ".mat"

    def __call__(self, result: Result, path: Path) -> None:
        if not self.matlab:
            write_netcdf(path, result)
            return
        mat.save_connection(path, result.subject.study, self.sign or "+", self.order or "ndgrid")
        if not self.sign:
            note(f"{path} has {SIGNS['+']}; --sign - gives the other")


def write_tube(result: Result, path: Path) -> None:
    """Write the connection near a measured gait."""
    write_netcdf(path, results.of_fit(result.subject))


def mean_gait(field: Path | None) -> tuple[Callable[[Result, Path], None], Callable[[Path], Any]]:
    """Return a function that writes a scene of a measured gait, whose connection is in the file ``field``, and a check of the
    name of that scene."""

    def check(path: Path) -> None:
        if path.suffix != ".toml":
            raise Refusal(f"cannot write {path}", instead="end the name of a scene in .toml")
        if field is None:
            raise Refusal("--scene names the field's file", instead="say -o FIELD.nc, too")

    return lambda result, path: write_text(path, results.scene_toml(result.subject, field, path)), check


def write_best(result: Result, path: Path) -> None:
    """Write a scene with the best gait."""
    write_text(path, optimum.scene_toml(result))


def write_medium(result: Result, path: Path) -> None:
    """Write a medium that was calibrated."""
    write_text(path, text.medium(result))


def about_medium(result: Result, path: Path) -> str:
    """Return the line that says how a scene takes a medium."""
    scene = "a scene" if result.kind == "rod_drag" else "an intruder scene"
    return f'medium in {path}: in {scene}, [medium] file = "{path.name}"'
