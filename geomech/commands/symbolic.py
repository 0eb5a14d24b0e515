"""geomech symbolic."""

from __future__ import annotations

from typing import Annotated

import typer

from geomech.commands.options import SceneArgument
from geomech.commands.pipeline import show
from geomech.questions.loading import load_scene


def symbolic(
    name: SceneArgument,
    latex: Annotated[bool, typer.Option("--latex", help="print LaTeX")] = False,
    ccf: Annotated[
        bool, typer.Option(help="print the CCF of every two joints, too")
    ] = True,
):
    """Print connection and CCF in closed form. Chains in a viscous or ideal fluid, afloat and on wheels have one."""
    from geomech.text.formulas import formulas

    show(formulas(load_scene(name), ccf, latex))
