"""Published figures, one importable script each: compute() -> numbers, draw(numbers) -> Figure.

`python -m figures.fig11e_displacement [FILE]` draws one to FILE (.png, .pdf or .svg).
"""

from __future__ import annotations

import sys
from collections.abc import Callable


def main(name: str, compute: Callable, draw: Callable) -> None:
    """Compute, draw and save to the file named on the command line, or to <name>.png."""
    from geomech import plots

    path = sys.argv[1] if len(sys.argv) > 1 else f"{name}.png"
    plots.save(draw(compute()), path)
    print(path)
