"""`python -m rft` compiles the solver, the contact with the ground, the steps of robots
and, where MuJoCo is installed, the forces of grains in it, so that no later run has
to."""

import importlib.util
import sys
from math import radians

import numpy as np

from rft import CATALOGUE, Chain, Granular, body_velocity
from rft.balance.backend import check, preferring
from rft.laws.records import record
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes import Spatial, shapes
from rft.terradynamics.meshes import contact as faces
from rft.terradynamics.meshes.blocks import Blocks
from rft.terradynamics.meshes.extruded import Extruded
from rft.terradynamics.plates import VERTICAL, CLeg, loads
from rft.terradynamics.walking import Fineness, Rhex, Tripod, Walker, engine

try:
    check("numba")
except ValueError as error:
    sys.exit(str(error))
FOLDED = Granular(
    8.0, radians(35.0)
)  # whose solutions fold at the shape below, so that a walk is taken along them
law = CATALOGUE["glass-0.3mm-loose"].medium
stress = VERTICAL["generic"].stress
leg = CLeg(0.02, 0.01)
with preferring("numba"):
    body_velocity(law, Chain(), (1.0, 1.0), (1.0, 1.0))
    body_velocity(
        FOLDED, Chain(), (-1.47053323, -1.9356507), (-0.99735926, -0.07262584)
    )
    loads(stress, leg.outline(8), (0.0, -0.1, 0.0), (1.0, 0.0, 0.0))
    engine("planar").step_cost(
        [Walker(Rhex(0.1, 0.1, 0.02, 0.05, leg, (0.0,)), Tripod(1.0), stress)],
        Fineness(),
        0.0,
    )

    box = shapes.box((1.0, 1.0, 1.0))
    still = np.zeros((1, 1, 3))
    for form in (Extruded(stress), Spatial(1e5)):
        blocks = Blocks([faces.faces(box.vertices[box.faces], box.normals)])
        blocks.loads(
            form,
            Ground(),
            faces.Motion(still, still, still[..., 0], still, still, still[..., 0]),
        )
        if importlib.util.find_spec("mujoco"):
            from rft.mujoco.compiled import kernel as kernel_of_mujoco
            from rft.mujoco.compiled import recorder
            from rft.mujoco.compiled_parts import element_code
            from rft.mujoco.compiled_solver import solver_code

            solver_code()
            kernel_of_mujoco()
            recorder()
            element_code(type(faces.record(form)))

from rft.balance.compiled import kernel  # noqa: E402  # after the check, for the import loads numba

path = kernel(type(record(law)))._cache.path
not_stored = (
    "compiled code is not kept: set NUMBA_CACHE_DIR to a folder that has room for it"
)
print(f"compiled code is kept in {path.parent}" if path.exists() else not_stored)
