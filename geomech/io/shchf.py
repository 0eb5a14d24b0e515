"""Gaits in MATLAB files of sysplotter: points over time, Fourier coefficients, or the
paths that it computed. Function handles are skipped, never run.

    alpha1, alpha2, ..., t        shapes at times, as its gait window saves them for a
                                  shchf_ file
    A1, B1, A2, B2, ...           coefficients of cos and sin, from the mean on, of each
                                  shape variable, as in butterfly_params.mat
    p.phi_locus_full{i}.shape     shapes (N, d) of its ith gait, as sys_calcpath saves
                                  them in SYSTEM__SHCHF.mat
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
from geomech.io.tables.base import LARGEST_ANGLE, checked_numbers
from rft.core.refusal import Refusal

LARGEST = 100_000_000  # bytes
MOST_JOINTS = 100
CLOSED = 1e-3  # distance of the last shape from the first over the size of the loop
FORMS = "alpha1, alpha2, ... with t, A1, B1, A2, B2, ..., or p of sys_calcpath"


class Curve(NamedTuple):
    """A closed curve of shapes, by points or by Fourier coefficients.

    phase: (N,), from 0 to 2 pi. points: (N, d), rad, of which the last is the first.
    cos, sin: coefficients (d, K + 1), from the mean on."""

    sha256: str
    phase: np.ndarray | None = None
    points: np.ndarray | None = None
    cos: np.ndarray | None = None
    sin: np.ndarray | None = None


def read(path: str | Path, number: int) -> Curve:
    """Return a gait of a file; Refusal if there is none. number: of the gait in a file
    with several, from 1."""
    refuse_program(path)
    try:
        raw = read_bytes(Path(path), LARGEST)
    except (OSError, ValueError) as error:
        raise Refusal(
            f"cannot read the gait {path}", because=reason_of(error)
        ) from None
    names = ["t", "p"]
    for letter in ("alpha", "A", "B"):
        names += [f"{letter}{k}" for k in range(1, MOST_JOINTS)]
    try:
        curve = _curve(mat.variables(raw, names), number)
    except Refusal as refusal:
        refusal.what = f"the gait {path} {refusal.what}"
        raise
    return curve._replace(sha256=hashlib.sha256(raw).hexdigest())


def _curve(variables: Mapping, number: int) -> Curve:
    """Return the gait of whichever form the file has; its digest is still empty."""
    p = variables.get("p")
    if isinstance(p, dict):
        path = _path(p, number)
        if path is not None:
            t = np.linspace(0.0, 1.0, len(path))
            return _curve_through("p.phi_locus_full", t, path)
    if number != 1:
        raise Refusal(f"has one gait, but no number {number}", instead="remove number")
    columns = _columns(variables, "alpha")
    if columns:
        t = np.linspace(0.0, 1.0, len(columns[0]))
        if "t" in variables:
            t = checked_numbers("t", variables["t"]).ravel()
        fits = all(len(x) == len(t) for x in columns)
        if not fits or len(t) < 4 or not (np.diff(t) > 0).all():
            raise Refusal(
                "has alpha1, alpha2, ... and t that are not four or more shapes at "
                "increasing times",
                instead="correct the file",
            )
        return _curve_through("alpha1, alpha2, ...", t, np.stack(columns, -1))
    cos = _columns(variables, "A")
    sin = _columns(variables, "B")
    has_one_length = len({len(x) for x in (*cos, *sin)}) == 1
    if not cos or len(cos) != len(sin) or not has_one_length or len(cos[0]) < 2:
        raise Refusal(
            "has no gait",
            because=f"a gait is {FORMS}",
            instead="save one of these: function handles cannot be read",
        )
    return Curve("", cos=np.array(cos), sin=np.array(sin))


def _columns(variables: Mapping, letter: str) -> list[np.ndarray]:
    """Return the vectors X1, X2, ..., up to the first that is missing."""
    columns = []
    name = f"{letter}1"
    while name in variables:
        values = variables[name]
        columns.append(
            checked_numbers(name, np.nan if values is None else values).ravel()
        )
        name = f"{letter}{len(columns) + 1}"
    return columns


def _path(p: Mapping, number: int) -> np.ndarray | None:
    """Return the shapes (N, d) of a computed path; None for a p without paths."""
    paths = p.get("phi_locus_full")
    if not isinstance(paths, np.ndarray) or paths.dtype != object:
        return None
    if not 1 <= number <= paths.size:
        raise Refusal(
            f"has {paths.size} gaits, but no number {number}",
            instead=f"use number = 1 to {paths.size}",
        )
    path = paths.ravel(order="F")[number - 1]
    shape = path.get("shape") if isinstance(path, dict) else None
    if not isinstance(shape, np.ndarray) or shape.ndim != 2:
        raise Refusal(
            f"has p.phi_locus_full{{{number}}} without shapes",
            instead="compute the path again in sysplotter",
        )
    return checked_numbers(f"p.phi_locus_full{{{number}}}.shape", shape)


def _curve_through(name: str, t: np.ndarray, points: np.ndarray) -> Curve:
    """Return the closed curve through points at times t; Refusal if it does not close,
    or is in degrees."""
    if np.abs(points).max() > LARGEST_ANGLE:
        raise Refusal(
            f"has {name} up to {np.abs(points).max():.4g} where angles are in rad",
            instead="convert them to rad",
        )
    gap = np.linalg.norm(points[-1] - points[0])
    size = np.ptp(points, axis=0).max()
    if len(points) < 4 or not gap <= CLOSED * size:
        raise Refusal(
            f"has {name} that do not form a closed curve",
            because=f"the last shape is {gap:.3g} rad away from the first",
            instead="let it end where it begins",
        )
    points = np.concatenate([points[:-1], points[:1]])
    return Curve("", 2 * np.pi * (t - t[0]) / (t[-1] - t[0]), points)
