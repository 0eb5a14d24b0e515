"""The net displacement of a gait per cycle: by each tier with its error, or by the
cheapest that is accurate enough. Its variables are made in
`geomech.studies.displacement.variables`."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, cast

import numpy as np

from geomech.core.variables import POSE, Result, Variable
from geomech.questions.shared import loading, names, parsing, tools
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.questions.shared.common import CurvePanels
from geomech.questions.shared.texts import measurements
from geomech.results.numbers import size
from geomech.runs.cost import Cost
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.mathematics.gaits import Gait
    from geomech.scenes.model import Scene

EFFORT = ("path_length", "work", "cost_of_transport")
LARGEST_COMPARED = 4  # amplitudes up to which the other tiers' x is shown
FRAME = "x ahead, y to the left, along the body frame at the start of the cycle"


@dataclass(frozen=True)
class Displacement(Question):
    """Compute the displacement of a gait by each tier. The result has x, y and heading
    after one cycle from phase t = 0, each with an estimated error."""

    scene: Annotated[
        "Scene",
        Subject(loading.load_scene, names.scene_names, ("grid", "extent", "medium")),
    ]
    amplitudes: Annotated[
        float | Sequence[float] | None,
        Option(
            "amplitudes: 0.5,1,30deg or START:STOP:COUNT",
            "LIST",
            parsing.amplitudes,
        ),
    ] = None
    tiers: Annotated[
        str | Sequence[str] | None,
        Option("tiers among area,adapted,path,harmonic,direct", "LIST", parsing.tiers),
    ] = None
    tolerance: Annotated[
        float | None,
        Option("use the cheapest tier with an error of at most E BL", "E", flag="tol"),
    ] = None
    effort: Annotated[
        bool, Option("also compute path length, work, cost of transport")
    ] = False
    # A gait has no text on the command line, where the scene has one.
    gait: "Gait | None" = field(default=None, kw_only=True)

    name: ClassVar[str] = "displacement"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit")
    table: ClassVar[tuple[str, ...]] = ("tier", "amplitude")
    parallel: ClassVar[bool] = True

    def __post_init__(self) -> None:
        amplitudes = self.amplitudes
        if amplitudes is None:
            amplitudes = getattr(self.gait or self.scene.gait, "amplitude", 1.0)
        tiers = self.tiers
        if tiers is not None:
            tiers = tools.as_words("tiers", tiers)
        self._set(amplitudes=tools.as_numbers(amplitudes), tiers=tiers)

    @property
    def values(self) -> Sequence[float]:
        """The amplitudes as a list."""
        return cast(Sequence[float], self.amplitudes)

    def check(self) -> None:
        if self.tolerance is not None and self.tiers is not None:
            raise Refusal("``tolerance`` chooses the tier", instead="remove ``tiers``")
        if self.effort:
            from geomech.studies.estimates.effort import refuse_costless

            refuse_costless(self.scene)

    def cost(self) -> Cost:
        from geomech.studies.estimates import cost

        jobs = []
        if self.effort:
            jobs = cost.effort_jobs(self.scene, len(self.values))
        if self.tolerance is None:
            tables = Run().tables_of(self.scene)
            return tables.cost(self.values, self.tiers, self.gait, more=jobs)
        # The cost of a tolerance is known only once a tier has run: `allow` is called
        # before each.
        return cost.total_cost(jobs)

    def compute(self, run: Run) -> Result:
        if self.tolerance is None:
            tables = run.tables_of(self.scene)
            found = tables.displacements(
                self.values, self.tiers, self.gait, run.shown_progress
            )
        else:
            found = self._cheapest(run)
        if self.effort:
            from geomech.studies.estimates.effort import with_effort

            found = with_effort(found, self.scene, self.gait)
        return found

    def _cheapest(self, run: Run) -> Result:
        from geomech.studies.displacement.choose import cheapest_displacements
        from geomech.studies.estimates import cost

        effort = []
        if self.effort:
            effort = cost.effort_jobs(self.scene, len(self.values))

        def ask(jobs: list) -> None:
            run.allow(cost.total_cost([*jobs, *effort]))

        tolerance = cast(float, self.tolerance)
        return cheapest_displacements(
            self.scene, self.values, tolerance, self.gait, ask
        )

    def check_draw(self, component: Sequence[str] = (), data: Any = None) -> None:
        measured_points(data, self.scene, component)

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        first = f"{facts['scene']}: displacement per cycle, {tier_words(result)}"
        lines = [first, f"amplitude: {amplitude_words(result)}; {FRAME}"]
        if "note" in facts:
            lines.append(f"{facts['scene']}: {facts['note']}")
        return lines

    @staticmethod
    def summary(result: Result) -> Result:
        """Return the pose by the most exact tier, and x by the others."""
        index = exact_tier(result)
        tiers = result["tier"].values.tolist()
        shown = result.at(tier=tiers[index]).only(*POSE, "speed", *EFFORT)
        others = [name for name in tiers if name != tiers[index]]
        is_short = result.sizes["amplitude"] <= LARGEST_COMPARED
        if not others or result["x"].zero or not is_short:
            return without_undefined(shown)
        is_other = [name in others for name in tiers]
        x = tools.selected(result["x"], "tier", is_other)
        coordinate = Variable("tier", ("tier",), others)
        x = replace(x, name="x_by_the_others", spread=None)
        return without_undefined(shown).with_variables(coordinate, x)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        facts = result.attributes
        lines = []
        if (
            result.sizes["amplitude"] > LARGEST_COMPARED
            and len(result["tier"].values) > 1
        ):
            lines.append(errors_of_others(result))
        if "speed" in result:
            frequency = facts["frequency"]
            lines.append(f"speed: net distance times frequency, {frequency:g} Hz")
        if "medium_error_rule" in result:
            lines.append("medium: one standard deviation, from its covariance")
            lines += shift_words(result)
        if "error_is" in facts:
            lines.append(f"estimated error: {facts['error_is']}")
        return lines

    @staticmethod
    def draw(
        result: Result,
        *,
        component: CurvePanels = (),
        data: Annotated[
            Any,
            Option(
                "points to draw, such as amplitude,value,error or amplitude,x,y",
                "FILE.csv",
            ),
        ] = None,
        ax: Any = None,
        quantity: str = "net_distance",
    ) -> Any:
        """Draw displacements against amplitude, a line a tier; return the Figure.

        On Axes that are given draw one quantity; return the Axes."""
        from geomech import plots

        if ax is not None:
            return plots.displacement(result, ax=ax, quantity=quantity, data=data)
        if isinstance(component, str):
            component = (component,)
        data = shown_points(data, result, component)
        name = result.attributes["scene"]
        return plots.displacement_figure(
            {name: result}, components=component, data=data
        )


def measured_points(data: Any, scene: Any, component: Sequence[str]) -> Any:
    """Return measurements to be drawn: those of a file, which are of the quantity of
    one panel, or values as they are."""
    from pathlib import Path

    if not isinstance(data, str | Path):
        return data
    return measurements(Path(data), scene, tuple(component))


def shown_points(data: Any, result: Result, component: Sequence[str]) -> Any:
    """Return measurements to be drawn next to a result, in its unit of length."""
    from pathlib import Path

    from geomech.results.lengths import shown_lengths
    from geomech.results.scenes import scene_of
    from geomech.scenes.data.measurements import scaled

    if not isinstance(data, str | Path):
        return data
    columns = measured_points(data, scene_of(result), component)
    _, factor = shown_lengths(result)
    return scaled(columns, factor, angle=tuple(component) == ("theta",))


def without_undefined(result: Result) -> Result:
    """Return the result without variables that are nothing but nan, such as the work of
    a system that has none."""
    undefined = []
    for v in result.variables:
        if v.values.dtype.kind == "f" and v.values.size and np.isnan(v.values).all():
            undefined.append(v.name)
    return result.without(*undefined)


def exact_tier(result: Result) -> int:
    """Return the number of the tier whose largest error of position is least, the last
    of several."""
    errors = np.nan_to_num(result["x"].error, nan=np.inf).max(1, initial=0.0)
    return len(errors) - 1 - int(errors[::-1].argmin())


def tier_words(result: Result) -> str:
    """Return the name of the tier that is shown, and why it is this one."""
    facts = result.attributes
    tiers = result["tier"].values.tolist()
    name = tiers[exact_tier(result)]
    if "tolerance" in facts:
        return f"{name} tier, cheapest within {facts['tolerance']:g} BL"
    if len(tiers) > 1:
        return f"{name} tier, the most accurate of {len(tiers)}"
    return f"{name} tier"


def amplitude_words(result: Result) -> str:
    """Return what an amplitude is, without the marks of formulas."""
    return re.sub(r"[$\\]", "", result["amplitude"].label)


def errors_of_others(result: Result) -> str:
    """Return the largest errors of the tiers that are not shown."""
    shown = exact_tier(result)
    x = result["x"]
    words = []
    for k, tier in enumerate(result["tier"].values.tolist()):
        if k != shown:
            words.append(f"{tier} {size(float(x.error[k].max(initial=0.0)))}")
    return f"largest errors of the other tiers ({x.unit}): {', '.join(words)}"


def shift_words(result: Result) -> Iterable[str]:
    """Yield how far uncertain media shift the mean of a quantity, where that
    matters."""
    from geomech.studies.estimates.uncertainty import SMALLEST_SHIFT, SMALLEST_SPREAD

    length = result.attributes["body_length"]
    for k, name in enumerate(result["quantity"].values.tolist()):
        shift = np.abs(result["medium_shift"].values[k])
        least = SMALLEST_SPREAD if name == "heading" else SMALLEST_SPREAD * length
        matters = shift > np.maximum(SMALLEST_SHIFT * result[name].spread[0], least)
        if matters.any():
            largest = size(float(shift.max()))
            title = name.replace("_", " ")
            yield f"mean over the media: {title} shifted by up to {largest}"
