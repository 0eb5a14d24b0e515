"""Displacement of a gait, or speed of a robot, over a grid of parameters of the
scene."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from geomech.core.variables import Result
from geomech.questions.shared import loading, names, parsing
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.runs.cost import Cost
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes.model import Scene
    from geomech.studies.displacement.sweep import Plan

SHOWN = ("net_distance", "speed", "uphill", "slip", "sinkage", "status", "outcome")
LARGEST_DRAWN = 2  # parameters of a figure


@dataclass(frozen=True)
class Sweep(Question):
    """Compute displacement or speed over a grid of parameters. Scenes of walking robots
    give speeds. Repeating an interrupted command resumes it."""

    scene: Annotated["Scene", Subject(loading.load_moving, names.scene_names)]
    over: Annotated[
        Mapping[str, Sequence[float]],
        Option(
            "parameter and its values; may be repeated",
            "KEY=VALUES",
            parsing.parameters,
            repeated=True,
        ),
    ]
    best: Annotated[
        str | None,
        Option(
            "also find the point with the largest net_distance or speed, between the "
            "points of the grid",
            "NAME",
        ),
    ] = None
    # A file of finished batches, from which the same sweep resumes; a command has its
    # own.
    partial: Path | None = field(default=None, kw_only=True, compare=False)

    name: ClassVar[str] = "sweep"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    parallel: ClassVar[bool] = True

    @cached_property
    def plan(self) -> "Plan":
        from geomech.studies.displacement.sweep import Plan

        return Plan(self.scene, self.over)

    def check(self) -> None:
        if self.best is not None:
            from geomech.studies.displacement.best import check_best

            check_best(self.scene, self.over, self.best)
        _ = self.plan.grid  # refuses points that make no scene

    def check_draw(self, data: Any = None, maps: bool = False) -> None:
        if maps:
            from geomech.plots.displacement.sweeps import check_maps

            check_maps(len(self.over), hasattr(self.scene, "robot"))
        if len(self.over) > LARGEST_DRAWN:
            raise Refusal(
                f"cannot draw {len(self.over)} parameters",
                instead="sweep one or two parameters, or leave ``plot`` out",
            )
        if data is None:
            return
        if len(self.over) > 1:
            raise Refusal(
                "measured points are drawn over one parameter",
                instead="sweep one parameter, or leave ``data`` out",
            )
        from geomech.plots.displacement.sweeps import measured_units
        from geomech.results.length_units import own_unit
        from geomech.scenes.data.measurements import swept_points

        unit = own_unit(self.scene)
        units = measured_units(self.scene, "net_distance", unit)
        units |= measured_units(self.scene, "speed", unit)
        (parameter,) = self.over
        swept_points(data, parameter, units)  # refuses a file without points

    def cost(self) -> Cost:
        cost = self.plan.cost
        if self.best is None:
            return cost
        from geomech.studies.displacement.best import n_points

        times = 1 + n_points(self.over) / self.plan.grid.total
        return cost._replace(
            balances=round(times * cost.balances),
            seconds=times * cost.seconds,
            besides=times * cost.besides,
            numpy_seconds=times * cost.numpy_seconds,
        )

    def compute(self, run: Run) -> "Result":
        from geomech.studies.displacement.sweep import store_batches

        seconds = None
        if "cost" in vars(self.plan):  # a command has asked for it
            seconds = self.plan.cost.seconds
        with store_batches(self.partial, self.scene):
            result = self.plan.result(run.progress, seconds)
            if self.best is None:
                return result
            return self._with_best(result, self.best, run)

    def _with_best(self, result: Result, name: str, run: Run) -> Result:
        """Return the sweep with its point that has the largest value of a variable."""
        from geomech.studies.displacement.best import best_variables, find_best

        best = find_best(self.scene, self.over, result, name, run.progress)
        more = best_variables(best, result, name)
        return replace(result, variables=(*result.variables, *more))

    @staticmethod
    def headline(result: Result) -> list[str]:
        axes = [v for v in result.variables if v.is_coordinate]
        points = 1
        for axis in axes:
            points *= axis.values.size
        over = " x ".join(f"{v.label} ({v.values.size})" for v in axes)
        return [f"{result.attributes['scene']}: {points} points, {over}"]

    @staticmethod
    def remarks(result: Result) -> list[str]:
        if "outcome" not in result:
            return []
        outcomes = result["outcome"].values.ravel().tolist()
        names = dict.fromkeys(outcomes)
        counts = [f"{name} at {outcomes.count(name)}" for name in names]
        where = "on the slope it" if "uphill" in result else "it"
        return [f"{where} {', '.join(counts)} of {len(outcomes)} points"]

    @staticmethod
    def summary(result: Result) -> Result:
        best = [name for name in result if name.startswith("best_")]
        return result.only(*best, *SHOWN)

    @staticmethod
    def draw(
        result: Result,
        *,
        data: Annotated[
            Any,
            Option(
                "points to draw over a single KEY, such as C,value,error", "FILE.csv"
            ),
        ] = None,
        maps: Annotated[
            bool,
            Option("draw maps of a robot's speed, slip and sinkage over two KEYs"),
        ] = False,
    ) -> Any:
        """Draw curves over one parameter, or maps over two; return the Figure."""
        from geomech import plots
        from geomech.results.scenes import scene_of

        return plots.sweep_figure(scene_of(result), result, data, maps)
