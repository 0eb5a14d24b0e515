"""Names of the numbers that compiled code reads of a bed, in the order in which they
stand in its `Layout`.

`rft.mujoco.installed` writes them, `rft.mujoco.step.compiled` reads them by
``AT.name``."""

from __future__ import annotations

from collections import namedtuple

from rft.mujoco.memory.addresses import ARRAYS, COUNTS, FUNCTIONS, Contacts

SIZES = ("nv", "ngeom", "nbody", "n_table", "n_geoms", "n_dofs", "n_derivative")
SHAPES = ("disturbed_rows", "disturbed_columns", "hill_rows", "hill_columns")
COUNTED = ("n_zones", "n_planes", "n_numbers")
# Addresses of the bed's arrays, and of numbers in the model's own memory.
OWN = (
    "table", "row_spheres", "first", "geoms", "spheres", "dofs", "first_dof", "bodies",
    "parents", "trees",
    "laws", "ground", "disturbed", "surface", "hills", "hill_frame", "planes",
    "first_plane",
    "derivative_rows", "derivative_columns", "shapes", "counts", "largest", "watch",
    "watched", "unsolved",
)  # fmt: skip
MODEL = (
    "model", "timestep", "integrator", "disableflags", "damping", "geom_size",
    "geom_type", "geom_dataid",
)  # fmt: skip
FLAGS = (
    "is_sparse", "full_takes_data", "no_euler_damping", "report",
    "report_changed", "element_code", "solver_code",
)  # fmt: skip
PRINTS = (
    "recorder", "memory_start", "print_rows", "print_columns", "print_grid",
    "print_surface", "print_points", "print_first",
)  # fmt: skip
IN_DATA = (
    *ARRAYS, "time", *COUNTS, *(f"contact_{name}" for name in Contacts._fields),
)  # fmt: skip
NAMES = (
    *SIZES, *SHAPES, *COUNTED, *OWN, *MODEL, *FLAGS, *PRINTS, *IN_DATA, *FUNCTIONS,
)  # fmt: skip
At = namedtuple("At", NAMES)
AT = At(*range(len(NAMES)))

# Places in the array "counts".
STEPS, ITERATIONS, MOST_ITERATIONS, COARSER_STEPS, UNSOLVED_STEPS = range(5)
N_COUNTS = 5
# Places in the array "unsolved": what the report of the first unsolved step says.
TIME, RESIDUAL, GEOM = range(3)
# Places in the array "watched" before the wrenches and twists of all geoms.
WATCHED_RESIDUAL, WATCHED_STATUS, WATCHED_ROUNDING, WATCHED_HEAD = range(4)
