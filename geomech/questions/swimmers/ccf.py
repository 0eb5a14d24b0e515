"""The curvature constraint function of a scene, and its integral over the scene's gait;
of more than two joints its slices, where two joints move."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.errors import choose
from geomech.core.variables import POSE, Result
from geomech.questions.shared import loading, names, parsing, tools
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.common import ColourLimit, OtherFrame, Pair, Panels, Slice
from geomech.results.show import scalar, zero_reason, zeros
from geomech.runs.cost import Cost
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene
    from geomech.studies.maps.shape_space import Plan

SIGN = "positive for counter-clockwise loops"


@dataclass(frozen=True)
class Ccf(Question):
    """Compute the CCF and its integral over the scene's gait. --plot draws both. A body
    with three or more joints has a slice for each pair of joints, with the other joints
    fixed."""

    scene: Annotated[
        "Scene", Subject(loading.load_scene, names.scene_names, ("grid", "extent"))
    ]
    pair: Pair = None
    slice: Slice = None
    metric: Annotated[bool, Option("draw rings of joint rates of equal effort")] = False
    compare_frame: OtherFrame = None
    # Whether shape space is redrawn to equal effort, for a picture.
    stretched: bool = field(default=False, kw_only=True)

    name: ClassVar[str] = "ccf"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    report_above: ClassVar[float] = 1.0
    parallel: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if self.slice is not None:
            self._set(slice=tools.as_numbers(self.slice))

    @property
    def sliced(self) -> bool:
        """Whether planes of shape space are computed, in place of all of it."""
        return (
            self.scene.system.joints > 2
            or self.pair is not None
            or self.slice is not None
        )

    @property
    def title(self) -> str:
        if self.sliced:
            return f"planes of {self.scene.name}"
        return f"field of {self.scene.name}"

    @property
    def cheaper_alternative(self) -> str:  # type: ignore[override]
        return self.plan.cheaper_alternative

    @cached_property
    def plan(self) -> "Plan":
        return self._plan(Run())

    def _plan(self, run: Run) -> "Plan":
        from geomech.studies.maps.shape_space import Plan

        tables = run.tables_of(self.scene)
        if self.sliced:
            return Plan(
                tables,
                field=False,
                planes=True,
                pair=self.pair,
                held=self.slice,
                other_frame=self.compare_frame,
            )
        return Plan(
            tables,
            mapped=True,
            gait=True,
            metric=self.metric or self.stretched,
            stretch=self.stretched,
            other_frame=self.compare_frame,
        )

    def for_picture(self, stretch: bool = False, **options: Any) -> Question:
        return replace(self, stretched=stretch)

    def check(self) -> None:
        if self.sliced and (self.metric or self.stretched):
            raise Refusal(
                "``metric`` and ``stretch`` need two joints",
                instead="remove them for slices",
            )
        self.plan.check()

    def cost(self) -> Cost:
        return self.plan.cost()

    def check_draw(
        self,
        style: str = "map",
        stretch: bool = False,
        component: Any = (),
        clim: Any = None,
    ) -> None:
        from geomech import plots

        parsing.one_limit(clim, component)
        choose("``style``", style, plots.CCF_STYLES)
        if stretch and (self.metric or self.compare_frame or style != "map"):
            raise Refusal(
                "``stretch`` draws a map of its own",
                instead="remove ``style``, ``metric`` and ``compare_frame``",
            )
        if self.metric and style != "map":
            raise Refusal(
                "``metric`` needs a map to draw on", instead=f"remove ``style`` {style}"
            )

    def compute(self, run: Run) -> Result:
        from geomech.mathematics.systems.base import shape_labels
        from geomech.studies.estimates.effort import units
        from geomech.studies.maps import fields, shape_space

        space = self._plan(run).compute(run.progress)
        facts = {
            "frame": self.scene.frame,
            "sign": SIGN,
            "interpolation": self.scene.numerics.interpolation,
        }
        if self.compare_frame is not None:
            facts["other_frame"] = self.compare_frame
        if self.sliced:
            facts["interpolation"] = space.planes[0].ccf.degree
            found = [
                *shape_space.slice_variables(space.planes),
                *shape_space.ccf_variables("ccf", space.planes),
                *shape_space.ccf_variables("other_ccf", space.other_planes),
            ]
            return Result("ccf", tuple(found), facts)
        tables = space.study
        ccf = tables.curvature
        facts["interpolation"] = ccf.degree
        labels = shape_labels(self.scene.system)
        found = [
            *fields.coordinates(ccf.axes, labels, ccf.periods),
            fields.ccf_variable(ccf, tables.curvature_error),
            *shape_space.zero_line(ccf, self.scene.gait),
        ]
        if space.enclosed is not None:
            found += shape_space.enclosed_area(space.enclosed)
            found += shape_space.loop_variables(tables)
        if self.metric:
            found += fields.metric_variables(tables.metric)
        if space.stretch is not None:
            found += fields.stretch_variables(
                space.stretch, units(self.scene.system)["path_length"]
            )
        if space.other is not None:
            ccf = space.other.curvature
            error = space.other.curvature_error
            found.append(fields.ccf_variable(ccf, error, name="other_ccf"))
        return Result("ccf", tuple(found), facts)

    @staticmethod
    def ways() -> Iterable[str]:
        from geomech import plots

        return plots.CCF_STYLES

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        return [f"{facts['scene']}: CCF in the frame {facts['frame']}, {facts['sign']}"]

    @staticmethod
    def summary(result: Result) -> Result:
        shown = [name for name in result if name.startswith("ccf")]
        return result.only(*shown)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        lines = []
        if "loop_alpha_1" in result:
            lines.append(
                "alpha: the shape that the body takes; with springs a gait is only a "
                "command"
            )
        if "zero_line_share" in result:
            lines.append(zero_line_words(result))
        if "gait_amplitude" in result:
            lines += integral_words(result)
        return lines

    @staticmethod
    def draw(
        result: Result,
        *,
        style: Annotated[
            str,
            Option(
                "map (coloured, the default), contours or surface; after a comma, a "
                "style of matplotlib",
                "STYLE",
            ),
        ] = "map",
        stretch: Annotated[
            bool, Option("stretch shape space so that equal lengths take equal effort")
        ] = False,
        component: Panels = (),
        clim: ColourLimit = None,
        ax: Any = None,
    ) -> Any:
        """Draw the CCF with the scene's gait on it, or slices; return the Figure.

        On Axes that are given draw one component, x by default; return the Axes."""
        from geomech import plots
        from geomech.mathematics.systems.base import shape_labels
        from geomech.results.fields import (
            field_of,
            loops_of,
            metric_of,
            slices_of,
            stretch_of,
        )
        from geomech.results.scenes import scene_of

        if stretch and "stretched_shape" not in result:
            raise Refusal(
                "the stretched shape space was not computed",
                instead="request ``stretched`` for a scene with two joints",
            )
        if stretch and ax is not None:
            raise Refusal("a stretched map fills a figure", instead="remove ``ax``")
        scene = scene_of(result)
        labels = shape_labels(scene.system)
        options = {"labels": labels, "components": component, "clim": clim}
        both = []
        if "other_frame" in result.attributes:
            both = [result.attributes["frame"], result.attributes["other_frame"]]
        if "ccf" not in result:
            if both:
                (options["other"],) = slices_of(result, "other_ccf")
            planes = slices_of(result, "ccf")
            if ax is not None:
                raise Refusal("slices fill a figure", instead="remove ``ax``")
            return plots.planes_figure(
                planes, scene.gait, style=style, names=both, **options
            )
        ccf, error = field_of(result, "ccf")
        gaits = loops_of(result, scene.gait)
        if ax is not None:
            number = tools.component_number(component)
            return plots.ccf_map(
                ccf,
                number,
                gaits,
                ax=ax,
                labels=labels,
                error=error,
                clim=clim,
            )
        options.update(gaits=gaits, error=error)
        if stretch:
            unit = result["stretched_shape"].units
            plane = stretch_of(result)
            return plots.stretched_figure(ccf, plane, unit=unit, **options)
        if both:
            options["other"] = field_of(result, "other_ccf")
        metric = None
        if "metric" in result or "norm" in result:
            metric = metric_of(result)
        return plots.ccf_figure(ccf, style=style, metric=metric, names=both, **options)


def zero_line_words(result: Result) -> str:
    """Return where the x component of the CCF changes sign."""
    share = float(result["zero_line_share"])
    if share == 0:
        ccf = result["ccf"].values[0]
        if not ccf.min() < 0 < ccf.max():
            return "zero line of x: none, because x has one sign"
        reach = float(result["zero_line_reach"])
        return f"zero line of x: more than {reach:.3g} rad from the middle of the gait"
    nearest = float(result["zero_line_nearest"])
    farthest = float(result["zero_line_farthest"])
    words = (
        f"zero line of x: {nearest:.2g} to {farthest:.2g} rad from the middle of "
        "the gait"
    )
    if share == 1:
        return words
    return f"{words}, in {100 * share:.0f} % of directions"


def integral_words(result: Result) -> list[str]:
    """Return the displacement of the scene's gait by the area that it encloses."""
    amplitude = float(result["gait_amplitude"])
    moved = []
    for name in POSE:
        if not zero_reason(result[name]):
            moved.append(f"{name} {scalar(result[name])}")
    about = (
        f"integral over the scene's gait at amplitude {amplitude:g} (the area tier):"
    )
    nothing = zeros(result.only(*POSE))
    if not moved:
        return [about, *nothing]
    return [f"{about} {', '.join(moved)}", *nothing]
