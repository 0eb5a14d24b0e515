"""`python -m rft` compiles code, so that no later run has to.

It compiles the solver, the contact with the ground, the steps of robots and, where
MuJoCo is installed, the forces of grains in it."""

import importlib.util
import sys
from math import radians

import numpy as np

from rft import CATALOGUE, Chain, Granular, Transient, body_velocity, time_steps
from rft.balance.backend import check, preferring
from rft.effects import Springs
from rft.laws.records import record
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.meshes.forces import contact as faces
from rft.terradynamics.meshes.forces.blocks import Blocks
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.plates import VERTICAL, CLeg, loads
from rft.terradynamics.walking import Fineness, Rhex, Tripod, Walker, engine

LAW = CATALOGUE["glass-0.3mm-loose"].medium
STRESS = VERTICAL["generic"].stress
LEG = CLeg(0.02, 0.01)
# The solutions of this law fold at this shape, so they are followed along their curve.
FOLDING_LAW = Granular(8.0, radians(35.0))
FOLDING_SHAPE = (-1.47053323, -1.9356507)
FOLDING_RATE = (-0.99735926, -0.07262584)


def compile_balances() -> None:
    """Compile the balance of forces in the horizontal plane, and its time steps."""
    body_velocity(LAW, Chain(), (1.0, 1.0), (1.0, 1.0))
    body_velocity(FOLDING_LAW, Chain(), FOLDING_SHAPE, FOLDING_RATE)
    phase = np.linspace(0.0, 2 * np.pi, 8, endpoint=False)[:, None]
    circle = np.cos(phase - FOLDING_SHAPE), -np.sin(phase - FOLDING_SHAPE)
    for effect in (Transient(travel=0.1), Springs(stiffness=0.1)):
        time_steps(LAW, Chain(), *circle, effects=[effect], cycles=1)


def compile_plates() -> None:
    """Compile the contact of plates with the ground, and the steps of robots."""
    loads(STRESS, LEG.outline(8), (0.0, -0.1, 0.0), (1.0, 0.0, 0.0))
    robot = Rhex(0.1, 0.1, 0.02, 0.05, LEG, (0.0,))
    walker = Walker(robot, Tripod(1.0), STRESS)
    engine("planar").step_cost([walker], Fineness(), seconds=0.0)


def compile_faces() -> None:
    """Compile the contact of meshes with the ground, by themselves and in MuJoCo."""
    box = shapes.box((1.0, 1.0, 1.0))
    zeros = np.zeros((1, 1, 3))
    zero = zeros[..., 0]
    at_rest = faces.Motion(zeros, zeros, zero, zeros, zeros, zero)
    for law in (Extruded(STRESS), Spatial(1e5)):
        blocks = Blocks([faces.faces(box.vertices[box.faces], box.normals)])
        blocks.loads(law, Ground(), at_rest)
        if importlib.util.find_spec("mujoco"):
            compile_mujoco(law)


def compile_mujoco(law: Extruded | Spatial) -> None:
    """Compile the forces of grains in MuJoCo."""
    from rft.mujoco.step.compiled import kernel, recorder
    from rft.mujoco.step.compiled_parts import element_code
    from rft.mujoco.step.compiled_solver import solver_code

    solver_code()
    kernel()
    recorder()
    element_code(type(faces.record(law)))


def report_cache() -> None:
    """Print where the compiled code is stored."""
    # Only after the check: the import loads numba.
    from rft.balance.kernels import kernel

    path = kernel(type(record(LAW)))._cache.path
    if path.exists():
        print(f"compiled code is stored in {path.parent}")
    else:
        print(
            "compiled code is not stored: set NUMBA_CACHE_DIR to a folder with enough "
            "space"
        )


try:
    check("numba")
except ValueError as error:
    sys.exit(str(error))
with preferring("numba"):
    compile_balances()
    compile_plates()
    compile_faces()
report_cache()
