"""Builds the kernels of balances ahead of time into a wheel, where GEOMECH_KERNELS is
set: a hook of hatchling, which needs numba, setuptools and a C compiler.

The wheel is then one of this platform and this version of Python, for processors with
the instructions of x86-64-v3; others take NumPy or numba (`rft.balance.ahead`)."""

from __future__ import annotations

import math
import os
import sys
import tempfile
import warnings
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

NAME = "_kernels"
PROCESSOR = "x86-64-v3"


class Kernels(BuildHookInterface):
    """The hook: adds `rft/balance/_kernels` to the wheel."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict) -> None:
        if self.target_name != "wheel" or not os.environ.get("GEOMECH_KERNELS"):
            return
        self.folder = tempfile.TemporaryDirectory()
        built = build(Path(self.folder.name), Path(self.root))
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
        build_data["force_include"][str(built)] = f"rft/balance/{built.name}"

    def finalize(self, version: str, build_data: dict, artifact_path: str) -> None:
        if hasattr(self, "folder"):
            self.folder.cleanup()


def build(folder: Path, root: Path) -> Path:
    """Compile the kernels of laws in closed form into a module in a folder, and return
    its file. root: the checkout."""
    sys.path.insert(0, str(root))
    os.environ.setdefault("NUMBA_CACHE_DIR", str(folder))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that numba may replace pycc one day
        from numba.pycc import CC
    import numpy as np

    from rft import Chain, Granular, body_velocity, time_steps
    from rft.balance import joints, kernels, walks
    from rft.effects import EFFECTS, Springs
    from rft.laws.records import Terms

    # Kernels know their types once they are called; solutions of this law fold at this
    # shape, so that all are.
    law = Granular(8.0, math.radians(35.0))
    shape = (-1.47053323, -1.9356507)
    rate = (-0.99735926, -0.07262584)
    body_velocity(law, Chain(), shape, rate, backend="numba")
    updated = [EFFECTS[name] for name in sorted(EFFECTS.built_in)]
    updated = [effect for effect in updated if effect.element_update is not None]
    phase = np.linspace(0.0, 2 * np.pi, 8, endpoint=False)[:, None]
    for kind in updated:
        effects = [kind.examples()[kind.kind]]
        gait = np.cos(phase + shape), -np.sin(phase + shape)
        options = {"effects": effects, "cycles": 1, "backend": "numba"}
        time_steps(Granular(1.8, 0.24), Chain(), *gait, **options)
    springs = {"effects": [Springs(stiffness=0.1)], "cycles": 1, "backend": "numba"}
    time_steps(Granular(1.8, 0.24), Chain(), *gait, **springs)
    code = CC(NAME)
    code.output_dir = str(folder)
    code.target_cpu = PROCESSOR
    for name, kernel in (
        ("solve", kernels.kernel(Terms)),
        ("velocities", kernels.chain_kernel(Terms)),
        ("walk", walks.walk_kernel(Terms)),
        ("joint_steps", joints.step_kernel(Terms)),
        ("velocities_of_elements", kernels.velocity_kernel()),
        *(
            (kind.element_update.__name__, kernels.element_kernel(kind.element_update))
            for kind in updated
        ),
    ):
        code.export(name, kernel.signatures[0])(kernel.py_func)
    code.compile()
    (file,) = folder.glob(f"{NAME}.*")
    return file
