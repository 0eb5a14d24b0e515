"""Published figures, one importable script each: compute() -> numbers, draw(numbers) ->
Figure.

`python -m figures.paper.fig11e_displacement [FILE]` draws one to FILE (.png, .pdf or
.svg). Some have table(numbers) -> text, which is printed. Their common look is in
`figures.style`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable


def main(
    name: str, compute: Callable, draw: Callable, table: Callable | None = None
) -> None:
    """Compute, draw and save to the file named on the command line, or to <name>.png;
    print the table if there is one."""
    from geomech import plots

    file = f"{name}.png"
    if len(sys.argv) > 1:
        file = sys.argv[1]
    try:
        path = plots.check_format(file)
    except ValueError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    numbers = compute()
    if table is not None:
        print(table(numbers))
    plots.save(draw(numbers), path)
    print(path)
