"""The local connection of a scene on a grid, as numbers, arrows and files that other
programs read."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from geomech.core.errors import choose
from geomech.core.summary import percent
from geomech.core.variables import COMPONENTS, Result, Variable
from geomech.io.files import note
from geomech.questions.shared import loading, names, parsing, tools
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.common import ColourLimit, OtherFrame, Pair, Panels, Slice
from geomech.runs.cost import Cost
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene
    from geomech.studies.maps.shape_space import Plan
    from geomech.studies.scene_tables import SceneTables

SHOWN = ("A",)


def write_table(
    path: Path,
    result: Result,
    *,
    sign: Annotated[
        str | None, Option("sign of A in a .mat file: + (default) or -", "+|-")
    ] = None,
    order: Annotated[
        str | None,
        Option("array order of a .mat file: ndgrid (default) or meshgrid", "ORDER"),
    ] = None,
    layout: Annotated[
        str | None,
        Option(
            "layout of a .mat file: arrays (default), or sysplotter's struct",
            "LAYOUT",
        ),
    ] = None,
) -> None:
    """Write the connection in a layout of sysplotter's, or in a format of a plug-in
    (`geomech.io.tables.FORMATS`)."""
    from geomech.io.tables import FORMATS, LAYOUTS, SIGNS

    ending = path.suffix.lower()
    file = FORMATS[ending]
    given = {"sign": sign, "order": order, "layout": layout}
    settings = {name: word for name, word in given.items() if word}
    file.write(path, with_contents(result, ending, layout), **settings)
    has_sign = "sign" in getattr(file, "settings", ())
    if has_sign and not sign and layout != LAYOUTS[1]:
        note(f"{path} has {SIGNS['+']}; ``sign`` - writes the other sign")


def with_contents(result: Result, ending: str, layout: str | None = None) -> Result:
    """Return the result with all that a format has; what it lacks is computed again."""
    from geomech.io.tables import FORMATS
    from geomech.results.scenes import scene_of
    from geomech.studies.maps.fields import CONTENTS, contents
    from geomech.studies.scene_tables import SceneTables

    kind = contents(FORMATS[ending], layout)
    if kind in result.attributes.get("contents", "").split():
        return result
    more = CONTENTS[kind](SceneTables(scene_of(result)))
    facts = {**result.attributes, **more.attributes}
    return replace(result.with_variables(*more.variables), attributes=facts)


@dataclass(frozen=True)
class Connection(Question):
    """Compute the local connection on a grid. A NetCDF file also has the residual of
    the fit and the CCF; a .mat file has A and the metric, in a layout that sysplotter
    reads."""

    scene: Annotated[
        "Scene", Subject(loading.load_scene, names.scene_names, ("grid", "extent"))
    ]
    pair: Pair = None
    slice: Slice = None
    compare_frame: OtherFrame = None
    # Contents of files, of `geomech.studies.maps.fields.CONTENTS`, and whether it is
    # drawn.
    contents: tuple[str, ...] = field(default=(), kw_only=True)
    drawn: bool = field(default=False, kw_only=True)

    name: ClassVar[str] = "connection"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    report_above: ClassVar[float] = 1.0
    parallel: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self.slice is not None:
            self._set(slice=tools.as_numbers(self.slice))

    @property
    def sliced(self) -> bool:
        """Whether planes of shape space are drawn, in place of all of it."""
        joints = self.scene.system.joints
        held = self.pair is not None or self.slice is not None
        return held or (self.drawn and joints > 2)

    @property
    def title(self) -> str:
        return f"field of {self.scene.name}"

    @property
    def cheaper_alternative(self) -> str:  # type: ignore[override]
        return self.plan.cheaper_alternative

    @cached_property
    def plan(self) -> "Plan":
        return self._plan(Run())

    def _plan(self, run: Run) -> "Plan":
        from geomech.studies.maps.fields import WHOLE
        from geomech.studies.maps.shape_space import Plan

        file = ""
        if WHOLE in self.contents:
            file = WHOLE
        elif self.contents:
            file = self.contents[0]
        return Plan(
            run.tables_of(self.scene),
            file,
            mapped=self.drawn and not self.sliced,
            planes=self.sliced,
            pair=self.pair,
            held=self.slice,
            other_frame=self.compare_frame,
        )

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> Question:
        from geomech.io.tables import FORMATS
        from geomech.studies.maps import fields

        found = []
        for path in paths:
            ending = path.suffix.lower()
            if ending in self.files() or ending == ".nc":
                check_settings(self.scene, ending, options)
                layout = options.get("layout")
                found.append(fields.contents(FORMATS[ending], layout))
        return replace(self, contents=tuple(dict.fromkeys(found)))

    def for_picture(self, **options: Any) -> Question:
        return replace(self, drawn=True)

    def check(self) -> None:
        if self.sliced and self.compare_frame is not None:
            raise Refusal(
                "``compare_frame`` draws maps of two joints",
                instead="remove it, or compare the CCFs of the pair ('geomech ccf')",
            )
        self.plan.check()

    def cost(self) -> Cost:
        return self.plan.cost()

    def check_draw(
        self, style: str = "quiver", component: Any = (), clim: Any = None
    ) -> None:
        from geomech import plots

        parsing.one_limit(clim, component)
        choose("``style``", style, plots.CONNECTION_STYLES)

    def compute(self, run: Run) -> Result:
        from geomech.studies.maps import fields, shape_space

        space = self._plan(run).compute(run.progress)
        tables = space.study
        found = fields.fitted_result(tables)
        for kind in self.contents:
            found = found.with_variables(*fields.CONTENTS[kind](tables).variables)
        more = [
            *fields.fit_variables(tables),
            *cost_variables(space.balances, space.seconds),
        ]
        if space.planes:
            dims = {v.name for v in found.variables}
            slices = shape_space.slice_variables(space.planes)
            more += [v for v in slices if v.name not in dims]
            more += shape_space.connection_variables(space.planes)
        facts = {**found.attributes, **facts_of(tables)}
        if self.scene.system.traits.compliant:
            facts["shape"] = "taken"
        if self.contents:
            facts["contents"] = " ".join(self.contents)
        if space.other is not None:
            facts["other_frame"] = self.compare_frame
            A, *_ = fields.connection_variables(space.other.fitted)
            more.append(replace(A, name="other_A", error=None))
        found = found.with_variables(*more)
        return Result("connection", found.variables, facts)

    @staticmethod
    def files() -> dict[str, Callable]:
        """Return the formats of tables: MATLAB's, and those of plug-ins."""
        from geomech.io.tables import FORMATS

        found = Connection.own_files()
        for ending, known in FORMATS.items():
            if ending not in (".nc", ".mat") and hasattr(known, "write"):
                found[ending] = write_table
        return found

    @classmethod
    def own_files(cls) -> dict[str, Callable]:
        return {".mat": write_table}

    @staticmethod
    def ways() -> Iterable[str]:
        from geomech import plots

        return plots.CONNECTION_STYLES

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        about = f"local connection A, xi = A alphadot, in the frame {facts['frame']}"
        return [f"{facts['scene']}: {about}"]

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only(*SHOWN)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        facts = result.attributes
        lines = [f"fit: {fit_words(result)}"]
        if facts.get("shape") == "taken":
            lines.append(
                "alpha: the shape that the body takes; with springs a gait is only a "
                "command"
            )
        if "direction_share" in result:
            lines += direction_words(result["direction_share"].values)
        if facts.get("symmetries"):
            lines += [f"symmetry: {one}" for one in facts["symmetries"].split("; ")]
        if "balances" in result and int(result["balances"].values):
            balances = int(result["balances"].values)
            seconds = float(result["seconds"])
            lines.append(f"cost: {balances:,} force balances, {seconds:.2g} s")
        return lines

    @staticmethod
    def draw(
        result: Result,
        *,
        style: Annotated[
            str,
            Option(
                "arrows (quiver, the default) or streamlines; after a comma, a style "
                "of matplotlib",
                "STYLE",
            ),
        ] = "quiver",
        component: Panels = (),
        clim: ColourLimit = None,
        ax: Any = None,
    ) -> Any:
        """Draw the rows of A as arrows or streamlines over shape space; return the
        Figure.

        On Axes that are given draw one row, x by default; return the Axes."""
        from geomech import plots
        from geomech.mathematics.systems.base import shape_labels
        from geomech.results.fields import connection_of, pairs_of, slices_of
        from geomech.results.scenes import scene_of

        labels = shape_labels(scene_of(result).system)
        options = {
            "labels": labels,
            "style": style,
            "components": component,
            "clim": clim,
        }
        if pairs_of(result, "A"):
            return plots.plane_connection_figure(slices_of(result, "A"), **options)
        if len(labels) != 2:
            raise Refusal(
                f"a body of {len(labels)} joints has no single map",
                instead="use ``pair``, or ``drawn`` for all pairs",
            )
        connection = connection_of(result)
        if ax is not None:
            number = tools.component_number(component)
            return plots.vector_field(connection, number, ax=ax, labels=labels)
        if "other_A" in result:
            options["other"] = connection_of(result, "other_A")
            facts = result.attributes
            options["names"] = [facts["frame"], facts["other_frame"]]
        return plots.connection_figure(connection, **options)


def check_settings(scene: Any, ending: str, options: dict[str, Any]) -> None:
    """Refuse a file that cannot have what is asked of it."""
    from geomech.io.tables import FORMATS, LAYOUTS, ORDERS, SIGNS
    from geomech.studies.maps import fields

    file = FORMATS[ending]
    fields.check_joints(scene, file)
    taken = getattr(file, "settings", ())
    for name, known in (("sign", SIGNS), ("order", ORDERS), ("layout", LAYOUTS)):
        if name not in options:
            continue
        choose(f"``{name}``", options[name], known)
        if name not in taken:
            others = [
                other
                for other, one in FORMATS.items()
                if name in getattr(one, "settings", ())
            ]
            raise Refusal(
                f"``{name}`` applies to a {' or '.join(others)} file",
                instead=f"remove it: a {ending} file stores its layout",
            )
    struct = options.get("layout") == LAYOUTS[1]
    if struct and ("sign" in options or "order" in options):
        raise Refusal(
            "a struct s has its own sign and order",
            instead="remove ``sign`` and ``order``",
        )


def cost_variables(balances: int, seconds: float) -> list[Any]:
    """Return what the computation took."""
    return [
        Variable("balances", (), balances, "1", "number of force balances solved"),
        Variable("seconds", (), seconds, "s", "computing time"),
    ]


def facts_of(tables: "SceneTables") -> dict[str, Any]:
    """Return which entries of A follow from others, and whether its fit is exact."""
    from geomech.mathematics.systems.capabilities import stored_table

    system = tables.scene.system
    is_exact = system.traits.linear and not stored_table(system, "connection")
    lines = []
    if system.traits.halved:
        lines.append("A_x is odd in alpha, A_y and A_theta even (left and right alike)")
    if system.traits.reversible:
        lines.append(
            "the last joint's column follows from the first's (head and tail alike)"
        )
    facts: dict[str, Any] = {"exact_fit": int(is_exact)}
    if lines:
        facts["symmetries"] = "; ".join(lines)
    return facts


def direction_words(shares: Any) -> list[str]:
    """Return by how much more directions of alphadot change A."""
    rows = []
    for name, share in zip(COMPONENTS, shares):
        if np.isfinite(share):
            rows.append(f"{name} {100 * share:.2g} %")
    if not rows:
        return []
    changes = ", ".join(rows)
    return [f"more directions of alphadot change A by about {changes} (rms)"]


def fit_words(result: Result) -> str:
    """Return what the linear fit leaves of the velocity."""
    if result.attributes.get("exact_fit"):
        return "exact, because xi is linear in alphadot"
    if "fit_share" not in result or np.isnan(result["fit_share"].values).all():
        return "residual of the fit unknown"
    parts = []
    for name, share in zip(COMPONENTS, result["fit_share"].values):
        parts.append(f"{name} {percent(share)}")
    words = f"leaves {', '.join(parts)} of the rms of xi unexplained"
    singular = int(result["singular_shapes"].values)
    if singular:
        words = f"{words}; {singular} singular shapes"
    return words
