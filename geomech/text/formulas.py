"""A connection and its CCFs as formulas: lines of plain text, or of LaTeX."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from geomech import symbolic
from geomech.scenes.model import Scene
from geomech.systems.framed import formula
from rft.core.refusal import located

ROWS = ("x", "y", "theta")


def formulas(scene: Scene, ccf: bool = True, latex: bool = False) -> Iterator[str]:
    """Yield A(alpha) of a scene, xi = A alphadot, and with ``ccf`` the CCF of every two joints, each as soon as it is found: an
    equation of LaTeX, or a line for each entry. Refusal for a system without closed form."""
    with located(scene.name):
        A, alpha = formula(scene.system)
    A = symbolic.simplified(A, alpha)
    formatted = symbolic.latex if latex else _text
    yield formatted(A, "A")
    if ccf:
        for i, j in itertools.combinations(range(len(alpha)), 2):
            of_two = symbolic.simplified(symbolic.ccf(A, alpha, i, j), alpha)
            yield formatted(
                of_two, f"F_{{{i + 1}{j + 1}}}" if latex else f"CCF_{i + 1}{j + 1}"
            )


def _text(matrix, name: str) -> str:
    entries = [(r, k) for r in range(3) for k in range(matrix.shape[1])]
    column = lambda k: f"_{k + 1}" if name == "A" else ""
    return "\n".join(
        f"{name}_{ROWS[r]}{column(k)} = {matrix[r, k]}" for r, k in entries
    )
