"""python -m rft: make the compiled code of the solver now, so that no later run has to."""

import sys

from rft import compiled

try:
    kept = compiled.make()
except ValueError as error:
    sys.exit(str(error))
none = "compiled code is not kept: set NUMBA_CACHE_DIR to a folder that has room for it"
print(f"compiled code is kept in {compiled.folder()}" if kept else none)
