"""Gaits in MATLAB files of sysplotter's: points over time, Fourier coefficients, or the paths that it computed. Function
handles are skipped, never run.

    alpha1, alpha2, ..., t        shapes at times, as its gait window saves them for a shchf_ file
    A1, B1, A2, B2, ...           coefficients of cos and sin, from the mean on, of each shape variable, as butterfly_params.mat
    p.phi_locus_full{i}.shape     shapes (N, d) of its ith gait, as sys_calcpath saves SYSTEM__SHCHF.mat
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.io.files import read as read_bytes
from geomech.io.files import reason_of
from geomech.io.foreign import refuse_program
from geomech.io.tables import mat
from geomech.io.tables.base import LARGEST_ANGLE, numbers
from rft.core.refusal import Refusal

LARGEST = 100_000_000  # bytes
MOST_JOINTS = 100
CLOSED = 1e-3  # distance of the last shape from the first, over the size of the loop, that counts as none
FORMS = "alpha1, alpha2, ... with t, A1, B1, A2, B2, ..., or p of sys_calcpath"


class Curve(NamedTuple):
    """A closed curve. phase: (N,), from 0 to 2 pi, and points: (N, d), the last the first, rad; or coefficients (d, K + 1) of
    cos and sin, from the mean on."""

    sha256: str
    phase: np.ndarray | None = None
    points: np.ndarray | None = None
    cos: np.ndarray | None = None
    sin: np.ndarray | None = None


def read(path: str | Path, number: int) -> Curve:
    """Return a gait of a file, of several the one of this number, from 1; Refusal if there is none."""
    refuse_program(path)
    try:
        raw = read_bytes(Path(path), LARGEST)
    except (OSError, ValueError) as error:
        raise Refusal(
            f"cannot read the gait {path}", because=reason_of(error)
        ) from None
    try:
        names = [
            f"{letter}{k}"
            for letter in ("alpha", "A", "B")
            for k in range(1, MOST_JOINTS)
        ]
        curve = _curve(mat.variables(raw, ("t", "p", *names)), number)
    except Refusal as refusal:
        refusal.what = f"the gait {path} {refusal.what}"
        raise
    return curve._replace(sha256=hashlib.sha256(raw).hexdigest())


def _curve(variables: Mapping, number: int) -> Curve:
    path = (
        _path(variables["p"], number) if isinstance(variables.get("p"), dict) else None
    )
    if path is not None:
        return _through("p.phi_locus_full", np.linspace(0.0, 1.0, len(path)), path)
    if number != 1:
        raise Refusal(f"has one gait, and no {number}", instead="drop number")
    if columns := _columns(variables, "alpha"):
        t = (
            numbers("t", variables["t"]).ravel()
            if "t" in variables
            else np.linspace(0.0, 1.0, len(columns[0]))
        )
        if (
            any(len(x) != len(t) for x in columns)
            or len(t) < 4
            or not (np.diff(t) > 0).all()
        ):
            raise Refusal(
                "has alpha1, alpha2, ... and t that are no four shapes or more at ascending times",
                instead="mend it",
            )
        return _through("alpha1, alpha2, ...", t, np.stack(columns, -1))
    cos, sin = _columns(variables, "A"), _columns(variables, "B")
    if (
        not cos
        or len(cos) != len(sin)
        or len({len(x) for x in (*cos, *sin)}) != 1
        or len(cos[0]) < 2
    ):
        raise Refusal(
            "has no gait",
            because=f"one is {FORMS}",
            instead="save one of these: function handles are not run",
        )
    return Curve("", cos=np.array(cos), sin=np.array(sin))


def _columns(variables: Mapping, letter: str) -> list[np.ndarray]:
    """Return the vectors X1, X2, ... as far as they go."""
    columns = []
    while (name := f"{letter}{len(columns) + 1}") in variables:
        columns.append(
            numbers(
                name, np.nan if variables[name] is None else variables[name]
            ).ravel()
        )
    return columns


def _path(p: Mapping, number: int) -> np.ndarray | None:
    """Return the shapes (N, d) of a path that was computed; None of a p without any."""
    paths = p.get("phi_locus_full")
    if not isinstance(paths, np.ndarray) or paths.dtype != object:
        return None
    if not 1 <= number <= paths.size:
        raise Refusal(
            f"has {paths.size} gaits, and no {number}",
            instead=f"take number = 1 to {paths.size}",
        )
    path = paths.ravel(order="F")[number - 1]
    if (
        not isinstance(path, dict)
        or not isinstance(path.get("shape"), np.ndarray)
        or path["shape"].ndim != 2
    ):
        raise Refusal(
            f"has p.phi_locus_full{{{number}}} without shapes",
            instead="compute the path anew in sysplotter",
        )
    return numbers(f"p.phi_locus_full{{{number}}}.shape", path["shape"])


def _through(name: str, t: np.ndarray, points: np.ndarray) -> Curve:
    """Return the closed curve through points at times t; Refusal if it does not close, or is in degrees."""
    if np.abs(points).max() > LARGEST_ANGLE:
        raise Refusal(
            f"has {name} up to {np.abs(points).max():.4g} where angles are in rad",
            instead="convert it",
        )
    gap, size = np.linalg.norm(points[-1] - points[0]), np.ptp(points, axis=0).max()
    if len(points) < 4 or not gap <= CLOSED * size:
        raise Refusal(
            f"has {name} that do not close", because=f"the last shape is {gap:.3g} rad from the first",
            instead="end it where it begins",
        )  # fmt: skip
    points = np.concatenate([points[:-1], points[:1]])
    return Curve("", 2 * np.pi * (t - t[0]) / (t[-1] - t[0]), points)
