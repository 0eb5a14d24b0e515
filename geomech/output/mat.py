"""Connections as MATLAB files in sysplotter's layout (`geomech.io.tables.mat`)."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from geomech.io.files import atomic_file
from geomech.io.tables.mat import ABOUT, ENTRIES, ERROR, RESIDUAL
from geomech.studies.fields import recorded
from geomech.studies.shape_space import check_two_joints
from geomech.studies.study import Study
from geomech.systems.base import length_unit, shape_labels
from geomech.systems.capabilities import stored_table


def save_connection(path: str | Path, study: Study, sign: str = "+", order: str = "ndgrid") -> None:
    """Write alpha1, alpha2, Ax1, Ax2, Ay1, Ay2, Atheta1, Atheta2, each (N, M), for xi = ``sign`` A alphadot; rows run over
    alpha1 as of ndgrid, or over alpha2 as of meshgrid.

    ABOUT is a JSON text of sign, frame, body length, unit and spline. The file has the fit residual (3, N, M), too, and of a
    table with intervals of A their half widths (3, 2, N, M). The file appears whole or not at all; Refusal for other than two
    joints."""
    from scipy.io import savemat

    scene = study.scene
    check_two_joints(scene)
    fitted = study.fitted
    ordered = (lambda x: x) if order == "ndgrid" else (lambda x: x.swapaxes(-1, -2))
    even = study.even_part  # counts at half of all directions
    residual = fitted.residual if even is None else np.sqrt(fitted.residual**2 + even**2 / 2)
    extra = {} if np.isnan(residual[:, ~np.isnan(fitted.A).any((0, 1))]).any() else {RESIDUAL: residual}
    if (error := stored_table(scene.system, "A_error")) is not None:
        extra[ERROR] = error
    factor = 1.0 if sign == "+" else -1.0
    shapes = dict(zip(("alpha1", "alpha2"), np.meshgrid(*fitted.axes, indexing="ij")))
    entries = dict(zip(ENTRIES, factor * fitted.A.reshape(6, *fitted.A.shape[2:])))
    s = scene.system
    names = [name for name, _ in shape_labels(s)]
    meaning = "alpha_k is the heading of link k+1 minus that of link k, link 1 the tail"
    if names != ["alpha_1", "alpha_2"]:
        meaning = f"alpha1 is {names[0]}, alpha2 {names[1]}"
    about = {
        "sign": sign, "frame": scene.frame, "length": float(s.length), "unit": length_unit(s), "interpolation": fitted.degree,
        "shapes": names, "conventions": f"xi = {sign} A alphadot; {meaning}",
        **{key: value for key, value in recorded(s).items() if key in ("singular_shapes", "level")},
    }  # fmt: skip
    arrays = {name: np.array(ordered(x)) for name, x in {**shapes, **entries, **extra}.items()}
    with atomic_file(path) as part:
        savemat(part, {**arrays, ABOUT: json.dumps(about)}, appendmat=False)
