"""geomech connection."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.asked import beside_field, field, loaded, planes, storing
from geomech.commands.options import (
    BesideOption,
    ExtentOption,
    GridOption,
    PairOption,
    PlotOption,
    SceneArgument,
    SliceOption,
    YesOption,
    check_netcdf,
    check_outputs,
    with_workers,
)
from geomech.core.errors import SceneError, choose


@with_workers
def connection(
    name: SceneArgument,
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="FILE.nc (NetCDF) or FILE.mat to write")],
    grid: GridOption = None,
    extent: ExtentOption = None,
    plot: PlotOption = None,
    sign: Annotated[Optional[str], typer.Option(help="of a .mat file: + for xi = + A alphadot (as is), or -")] = None,
    order: Annotated[Optional[str], typer.Option(help="of a .mat file: ndgrid (as is) or meshgrid")] = None,
    style: Annotated[Optional[str], typer.Option(help="of the plot: quiver or streamlines")] = None,
    pair: PairOption = None,
    slice_: SliceOption = None,
    beside: BesideOption = None,
    yes: YesOption = False,
):
    """The local connection on a grid, with its fit residual and CCF, as NetCDF; or A alone in sysplotter's layout, as .mat."""
    from geomech.io.files import note
    from geomech.io.tables import ORDERS, SIGNS
    from geomech.output import mat, netcdf, plots
    from geomech.study.bench import Study
    from geomech.systems.base import shape_labels

    check_netcdf(out, matlab=True)
    for option, word, known in (("--sign", sign, SIGNS), ("--order", order, ORDERS)):
        if word is not None:
            choose(option, word, known)
            if out.suffix == ".nc":
                raise SceneError(f"{option} is that of a .mat file: drop it, a .nc file says what it has")
    if plot is None and not (style, pair, slice_, beside) == (None,) * 4:
        raise SceneError("--style, --pair, --slice and --beside are those of a figure: say --plot FILE")
    if style is not None:
        choose("--style", style, plots.CONNECTION_STYLES)
    scene = loaded(name, grid, extent)
    if out.suffix == ".mat":
        mat.check_joints(scene)
    sliced = plot and (scene.system.joints > 2 or pair is not None or slice_ is not None)
    if sliced and beside is not None:
        raise SceneError("--beside draws maps of two joints: drop it, or see 'geomech ccf --pair'")
    check_outputs(scene, out, plot)
    asked = {"file": out.suffix, "plot": plot is not None, "pair": pair, "slice": slice_, "beside": beside}
    with storing(scene, out, command="connection", **asked):
        if sliced:
            found = planes(Study(scene), pair, slice_, yes)
        study = field(scene, grid, extent, out, plot, bool(plot) and not sliced, yes, harmonics=out.suffix == ".nc")
        if out.suffix == ".nc":
            netcdf.save_connection(out, study)
        else:
            mat.save_connection(out, study, sign or "+", order or "ndgrid")
            if not sign:
                note(f"{out} has {SIGNS['+']}; --sign - gives the other")
        if plot:
            told = {"labels": shape_labels(study.scene.system), "style": style or "quiver"}
            if sliced:
                plots.save(plots.plane_connection_figure(found, **told), plot)
                return
            if beside is not None:
                told |= {"beside": beside_field(study, beside, yes).fitted, "names": [study.scene.frame, beside]}
            plots.save(plots.connection_figure(study.fitted, **told), plot)
