"""`python -m rft` compiles the solver, the contact with the ground and the steps of robots, so that no later run has to."""

import sys
from math import radians

from rft import CATALOGUE, Chain, Granular, body_velocity
from rft.balance.backend import check, preferring
from rft.laws.records import record
from rft.plates import VERTICAL, CLeg, loads
from rft.walking import Fineness, Rhex, Tripod, Walker, engine

try:
    check("numba")
except ValueError as error:
    sys.exit(str(error))
FOLDED = Granular(8.0, radians(35.0))  # whose solutions fold at the shape below, so that a walk is taken along them
law, stress, leg = CATALOGUE["glass-0.3mm-loose"].medium, VERTICAL["generic"].stress, CLeg(0.02, 0.01)
with preferring("numba"):
    body_velocity(law, Chain(), (1.0, 1.0), (1.0, 1.0))
    body_velocity(FOLDED, Chain(), (-1.47053323, -1.9356507), (-0.99735926, -0.07262584))
    loads(stress, leg.outline(8), (0.0, -0.1, 0.0), (1.0, 0.0, 0.0))
    engine("planar").step_cost([Walker(Rhex(0.1, 0.1, 0.02, 0.05, leg, (0.0,)), Tripod(1.0), stress)], Fineness(), 0.0)

from rft.balance.compiled import kernel  # noqa: E402  # after the check, for the import loads numba

path = kernel(type(record(law)))._cache.path
not_stored = "compiled code is not kept: set NUMBA_CACHE_DIR to a folder that has room for it"
print(f"compiled code is kept in {path.parent}" if path.exists() else not_stored)
