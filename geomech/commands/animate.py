"""geomech animate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech import terminal
from geomech.commands.asked import allow, loaded, storing
from geomech.commands.options import SceneArgument, YesOption, check_outputs


def animate(
    name: SceneArgument,
    out: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="film: .gif, .mp4; strip: .png, .pdf, .svg")
    ],
    cycles: Annotated[Optional[int], typer.Option(metavar="N", help="of the gait; 3 in a film, 1 in a strip")] = None,
    yes: YesOption = False,
):
    """The body moving over its own track beside its shape on the CCF map: a film, or a strip of pictures for a page."""
    from geomech.output import animate as film
    from geomech.study import motion
    from geomech.study.bench import Study
    from geomech.study.cost import connection, price

    film.check_format(out)
    scene = loaded(name)
    count = (3 if film.is_film(out) else 1) if cycles is None else cycles
    check_outputs(scene, out, None)
    study = Study(scene)
    mapped = scene.system.joints == 2 and study.has_connection
    costs = [motion.cost(scene, count), *([price(connection(scene))] if mapped else [])]
    if film.is_film(out):
        costs.append(film.cost(scene.numerics.phases, count))
    balances, seconds, memory, besides = zip(*costs)
    takes = type(costs[0])(sum(balances), sum(seconds), max(memory), sum(besides))
    allow(scene, takes, yes)
    kept = storing(scene, out, command="animate", cycles=count)
    with kept, terminal.progress(f"motion of {scene.name}") as bar:
        found = motion.motion(scene, count)
        if mapped:
            study.compute_field()
        maps = (study.curvature, study.curvature_error) if mapped else ()
        film.save(out, found, *maps, progress=bar)
