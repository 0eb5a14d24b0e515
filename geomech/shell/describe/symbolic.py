"""geomech symbolic: a connection and its CCFs as formulas, lines of plain text or of
LaTeX."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from geomech.core.variables import COMPONENTS
from geomech.questions.shared.loading import load_scene
from geomech.shell import terminal
from geomech.shell.options import SceneArgument
from rft.core.refusal import located

if TYPE_CHECKING:
    from geomech.scenes import Scene


def symbolic(
    name: SceneArgument,
    latex: Annotated[bool, typer.Option("--latex", help="print LaTeX")] = False,
    ccf: Annotated[
        bool, typer.Option(help="also print the CCF of every pair of joints")
    ] = True,
) -> None:
    """Print connection and CCF in closed form. It exists for chains in a viscous or
    ideal fluid, floating chains, and chains on wheels."""
    terminal.show(formulas(load_scene(name), ccf, latex))


def formulas(scene: Scene, ccf: bool = True, latex: bool = False) -> Iterator[str]:
    """Yield A(alpha) of a scene, xi = A alphadot, and with ``ccf`` the CCF of every two
    joints, each as soon as it is found: an equation of LaTeX, or a line for each entry.
    Refusal for a system without closed form."""
    from geomech.mathematics import symbolic as closed_form
    from geomech.mathematics.systems.framed import formula

    formatted = entries
    if latex:
        formatted = closed_form.latex
    with located(scene.name):
        A, alpha = formula(scene.system)
    A = closed_form.simplified(A, alpha)
    yield formatted(A, "A")
    if not ccf:
        return
    for i, j in itertools.combinations(range(1, len(alpha) + 1), 2):
        of_two = closed_form.simplified(closed_form.ccf(A, alpha, i, j), alpha)
        name = f"CCF_{i}{j}"
        if latex:
            name = f"F_{{{i}{j}}}"
        yield formatted(of_two, name)


def entries(matrix: Any, name: str) -> str:
    """Return a line for each entry of a matrix; those of A by component and joint."""
    lines = []
    for r, row in enumerate(COMPONENTS):
        for k in range(matrix.shape[1]):
            entry = f"{name}_{row}"
            if name == "A":
                entry = f"{entry}_{k + 1}"
            lines.append(f"{entry} = {matrix[r, k]}")
    return "\n".join(lines)
