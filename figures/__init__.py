"""Published figures, one importable script each: compute() -> numbers, draw(numbers) -> Figure.

`python -m figures.fig11e_displacement [FILE]` draws one to FILE (.png, .pdf or .svg). Some have table(numbers) -> text,
which is printed too.
"""

from __future__ import annotations

import sys
from collections.abc import Callable


def main(name: str, compute: Callable, draw: Callable, table: Callable | None = None) -> None:
    """Compute, draw and save to the file named on the command line, or to <name>.png; print the table if there is one."""
    from geomech.output import plots

    path = sys.argv[1] if len(sys.argv) > 1 else f"{name}.png"
    numbers = compute()
    if table is not None:
        print(table(numbers))
    plots.save(draw(numbers), path)
    print(path)
