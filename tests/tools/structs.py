"""sysplotter's struct s, written as `sys_calcsystem` saves it: of the viscous
three-link swimmer, by its methods."""

import functools

import numpy as np
from scipy.io import savemat

import rft
from geomech.mathematics.geometry import connection, metric
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.minimum_perturbation import minimum_perturbation
from geomech.mathematics.systems import Swimmer
from rft.formulas import se2


def cell(values, lead):
    """A cell (lead) of the arrays values (*lead, ...)."""
    out = np.empty(lead if len(lead) > 1 else (*lead, 1), object)
    for index in np.ndindex(*lead):
        out[index if len(lead) > 1 else (*index, 0)] = np.array(values[index])
    return out


def differences(axes, A):
    """CCF by differences of neighbours, one-sided at the edge, as calc_ccf.m takes
    them: (3, 1, N, M)."""
    dA = np.gradient(A[:, 1], axes[0], axis=1) - np.gradient(A[:, 0], axes[1], axis=2)
    return (dA + np.moveaxis(se2.bracket(*np.moveaxis(A, (1, 0), (0, -1))), -1, 0))[
        :, None
    ]


@functools.cache
def computed(points=15, coarse=7, extent=3.0, frame="link-2"):
    """(fitted connection, metric on a grid of its own, A and pose of the frame in
    linear elements)."""
    swimmer = Swimmer(rft.Viscous(2.0), rft.Chain((1, 1, 1), frame=frame))
    fitted = connection.fit(
        swimmer.velocity, connection.grid(2, points, extent), 2, traits=swimmer.traits
    )
    own = metric.fit(
        lambda alpha, rates: swimmer.power(
            *np.broadcast_arrays(alpha, rates), swimmer.velocity(alpha, rates)
        ),
        connection.grid(2, coarse, extent),
    )
    linear = minimum_perturbation(
        Connection(fitted.axes, fitted.A, fitted.residual, fitted.speed, 1)
    )
    return fitted, own, linear.connection(fitted), linear.field.values


def struct(length=1.0, drag=1.0, frame="link-2", base="center", **more):
    """The struct, with lengths in a unit of which the body has ``length``."""
    fitted, own, A, pose = computed(frame=frame)
    unit = np.array([length, length, 1.0]).reshape(3, 1, 1, 1)
    grids = [
        cell(np.array(np.meshgrid(*x.axes, indexing="ij")), (2,)) for x in (fitted, own)
    ]
    DA, DA_optimised = (
        cell(unit * differences(fitted.axes, x), (3, 1)) for x in (fitted.A, A)
    )
    content = {
        "A_num": cell(-unit * fitted.A, (3, 2)),
        "Avec": cell(unit * fitted.A, (3, 2)),
    }
    content["Avec_optimized"] = cell(unit * A, (3, 2))
    return {
        "geometry": {
            "type": "n-link chain",
            "linklengths": [1, 1, 1],
            "baseframe": base,
            "length": length,
        },
        "physics": {"drag_ratio": 2, "drag_coefficient": drag},
        "grid": {"eval": grids[0], "metric_eval": grids[1]},
        "vecfield": {"eval": {"content": content, "type": "eval"}},
        "metricfield": {
            "metric_eval": {
                "content": {"metric": cell(drag * length**3 * own.M, (2, 2))}
            }
        },
        "B_optimized": {"eval": {"Beta": cell(unit[..., 0] * pose, (3,))}},
        "DA": DA,
        "DA_optimized": DA_optimised,
        "singularity": 0,
        "system_type": "drag",
        **more,
    }


def save(path, s, version=5, **more):
    """Write s, and other variables, to a MAT file of version 5 or 7.3."""
    if version == 5:
        savemat(path, {"s": s, **more})
        return
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in {"s": s, **more}.items():
            _write(file, file, name, value)
    with open(path, "r+b") as file:
        file.write(
            b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Wed Nov 25 12:00:00 2026 HDF5 schema 1.00 ."
        )


def _write(file, group, name, value):
    import h5py

    if isinstance(value, dict):
        node = group.create_group(name)
        node.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, x in value.items():
            _write(file, node, key, x)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        store = file.require_group("#refs#")
        references = np.empty(value.T.shape, h5py.ref_dtype)
        for index, x in np.ndenumerate(value.T):
            key = f"x{len(store)}"
            _write(file, store, key, x)
            references[index] = store[key].ref
        node = group.create_dataset(name, data=references, dtype=h5py.ref_dtype)
        node.attrs["MATLAB_class"] = np.bytes_("cell")
    elif isinstance(value, str):
        node = group.create_dataset(
            name, data=np.frombuffer(value.encode("utf-16-le"), "<u2")[:, None]
        )
        node.attrs["MATLAB_class"] = np.bytes_("char")
    else:
        node = group.create_dataset(
            name, data=np.atleast_2d(np.asarray(value, float)).T, compression="gzip"
        )
        node.attrs["MATLAB_class"] = np.bytes_("double")
