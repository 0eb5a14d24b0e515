"""All of a scene into a folder: connection, CCF, and displacements against amplitude,
as numbers and pictures."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.io.files import read, refuse_inputs, write_text
from geomech.questions.shared import base, loading, names, parsing
from geomech.questions.shared.base import Option, Question, Subject
from geomech.questions.shared.common import ColourLimit, Panels
from geomech.questions.swimmers.displacement import (
    Displacement,
    amplitude_words,
    measured_points,
    shown_points,
    tier_words,
)
from geomech.runs.cost import Cost
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene

# Files of the folder.
SCENE = "scene.toml"
TABLES = "displacement.json"
FIELD = "connection.nc"
FIGURES = (".png", ".pdf")
DEFAULT = "three-link-glass"
HELP = "built-in name or TOML file"

Data = Annotated[
    Any,
    Option(
        "points to draw, such as amplitude,value,error or amplitude,x,y",
        "FILE.csv",
    ),
]


@dataclass(frozen=True)
class Run(Question):
    """Compute connection, CCF and displacements into a folder. --plot draws the
    displacements against the amplitude."""

    scene: Annotated[
        "Scene",
        Subject(
            loading.load_scene,
            names.scene_names,
            ("medium",),
            help=HELP,
            default=DEFAULT,
        ),
    ]

    name: ClassVar[str] = "run"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    table: ClassVar[tuple[str, ...]] = ("tier", "amplitude")
    parallel: ClassVar[bool] = True
    folder: ClassVar[bool] = True
    default_folder: ClassVar[str] = "results"

    @property
    def title(self) -> str:
        return f"field of {self.scene.name}"

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> Question:
        for path in paths:
            refuse_folder(self.scene, path)
        return self

    def cost(self) -> Cost:
        from geomech.studies import report

        return report.cost(self.scene)

    def check_draw(
        self, component: Any = (), clim: Any = None, data: Any = None
    ) -> None:
        parsing.one_limit(clim, component)
        measured_points(data, self.scene, component)

    def compute(self, run: base.Run) -> Result:
        from geomech.studies import report

        return report.answer(run.tables_of(self.scene), run.shown_progress)

    @staticmethod
    def headline(result: Result) -> list[str]:
        """Return what the tables are: of the scene's own gait first."""
        from geomech.studies.report import gait_tables

        (_, own), *others = gait_tables(result).items()
        lines = Displacement.headline(own)
        for gait, table in others:
            lines += [
                f"{gait}, {tier_words(table)}: {table.attributes['note']}",
                f"{gait} amplitude: {amplitude_words(table)}",
            ]
        return lines

    @staticmethod
    def summary(result: Result) -> Result:
        """Return what is shown first of the displacements of each gait."""
        from geomech.studies.report import gait_tables, is_of_one_gait, with_gait_prefix

        (_, own), *others = gait_tables(result).items()
        variables = [*Displacement.summary(own).variables]
        for gait, table in others:
            shown = Displacement.summary(table).variables
            variables += [with_gait_prefix(v, gait) for v in shown if is_of_one_gait(v)]
        return replace(result, variables=tuple(variables))

    @staticmethod
    def remarks(result: "Result") -> list[str]:
        from geomech.studies.report import gait_tables

        (_, own), *others = gait_tables(result).items()
        lines = Displacement.remarks(own)
        for gait, table in others:
            remarks = Displacement.remarks(table)
            lines += [f"{gait}: {line}" for line in remarks if line not in lines]
        return lines

    @staticmethod
    def draw(result: Result, *, component: Panels = (), data: Data = None) -> Any:
        """Draw displacements against amplitude, a row a gait; return the Figure."""
        from geomech import plots
        from geomech.studies.report import gait_tables

        if isinstance(component, str):
            component = (component,)
        data = shown_points(data, result, component)
        return plots.displacement_figure(
            gait_tables(result), components=component, data=data
        )

    @staticmethod
    def fill(
        result: Result,
        folder: Path,
        *,
        component: Panels = (),
        clim: ColourLimit = None,
        data: Data = None,
    ) -> None:
        """Write the scene, the displacements and the connection with their pictures
        into a folder."""
        from geomech.results.files import save
        from geomech.results.scenes import scene_of
        from geomech.scenes.write import toml
        from geomech.studies import report

        shapes = report.connection_only(result)
        if "A" in shapes:
            save(shapes, folder / FIELD)
            save_maps(in_shown_unit(result), folder, component, clim)
        figure = result.plot(component=component, data=data)
        save_figure(figure, folder / "displacement")
        save(report.displacements_only(result), folder / TABLES)
        write_text(folder / SCENE, toml(scene_of(result)))


def save_maps(result: Result, folder: Path, component: Any, clim: Any) -> None:
    """Draw the connection and the CCF, of three joints for every pair, and the frame
    that was chosen, if it is one of those."""
    from geomech import plots
    from geomech.mathematics.systems.base import shape_labels
    from geomech.results.fields import connection_of, field_of, slices_of
    from geomech.results.scenes import scene_of
    from geomech.studies.report import compared_gaits

    scene = scene_of(result)
    labels = shape_labels(scene.system)
    options = {"labels": labels, "components": component}
    if scene.system.joints == 3:
        connection = plots.plane_connection_figure(slices_of(result, "A"), **options)
        planes = slices_of(result, "ccf")
        ccf = plots.planes_figure(planes, scene.gait, clim=clim, **options)
    else:
        connection = plots.connection_figure(connection_of(result), **options)
        field, error = field_of(result, "ccf")
        gaits = compared_gaits(scene)
        ccf = plots.ccf_figure(field, gaits, error=error, clim=clim, **options)
    save_figure(connection, folder / "connection")
    save_figure(ccf, folder / "ccf")
    if "frame_pose" in result and scene.system.joints == 2:
        frame, _ = field_of(result, "frame_pose")
        save_figure(plots.frame_figure(frame, labels=labels), folder / "frame")


def in_shown_unit(result: Result) -> Result:
    """Return the result in the unit of length of the look in use."""
    from geomech.plots.look import current
    from geomech.results.lengths import in_lengths

    unit = current().unit
    if unit is None:
        return result
    return in_lengths(result, unit)


def save_figure(figure: Any, stem: Path) -> None:
    """Write a figure in every format."""
    from geomech import plots

    plots.save(figure, *(stem.with_suffix(ending) for ending in FIGURES))


def refuse_folder(scene: Any, folder: Path) -> None:
    """Refuse a folder in which an input would be replaced, or a scene that no `run` has
    written."""
    from geomech.scenes import inputs
    from geomech.scenes.write import toml

    path = folder / SCENE
    refuse_inputs([path, folder / TABLES], inputs(scene))
    if not os.path.lexists(path) or os.path.lexists(folder / TABLES):
        return
    if not has_text(path, toml(scene)):
        raise Refusal(
            f"cannot write {path}",
            because="it holds the results of another scene",
            instead="choose another folder with -o",
        )


def has_text(path: Path, text: str) -> bool:
    """Return whether a file has this text and no more."""
    try:
        return read(path, 4 * len(text) + 4) == text.encode()
    except (OSError, ValueError):
        return False
