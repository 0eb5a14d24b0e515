"""The gait lab: charts of one scene or several, or of a family of scenes, as a
request."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

from geomech.runs.cost import WORTH_SAYING, Cost
from geomech.scenes.model import Scene
from geomech.studies.displacement.cycles import Cycles
from geomech.studies.estimates import cost
from geomech.studies.grid import Grid, checked_grid_values
from geomech.studies.maps import charts
from geomech.studies.maps.charts import Chart
from rft.core.refusal import Refusal

# Scenes that a page shows, in this order.
GALLERY = (
    "three-link-glass",
    "three-link-glass-close",
    "three-link-coulomb",
    "three-link-viscous",
    "serpenoid-glass",
    "seven-link-modes",
)
N_MEMBERS = range(2, 34)  # of a family
SECTIONS = ("medium", "body", "system", "physical")  # that a family may vary


@dataclass(frozen=True)
class Lab:
    """A request for charts of scenes with two shape variables.

    over: values of one parameter of the first scene, {"medium.C": [...]}, which makes
    that chart one of a family; the scene's own value is added to them."""

    scenes: tuple[Scene, ...]
    over: Mapping[str, Sequence[float]] = field(default_factory=dict)

    cheaper_alternative: ClassVar[str] = "request less"
    report_above: ClassVar[float] = WORTH_SAYING

    @property
    def scene(self) -> Scene:
        return self.scenes[0]

    @property
    def subject(self) -> Scene:
        """The scene whose cost is shown."""
        return self.scene

    @property
    def subject_name(self) -> str:
        return self.scene.name

    @property
    def title(self) -> str:
        """Name of the computation, shown during it."""
        return f"charts of {', '.join(scene.name for scene in self.scenes)}"

    def inputs(self) -> list:
        from geomech.scenes import inputs

        return [path for scene in self.scenes for path in inputs(scene)]

    def check(self) -> None:
        for scene in self.scenes:
            charts.refuse(scene)
        if self.over:
            _ = self._values

    @cached_property
    def _grid(self) -> Grid:
        return Cycles().grid(self.scene, checked_grid_values(self.over))

    @cached_property
    def _own(self) -> float:
        """Value of the parameter in the scene itself."""
        if len(self.over) != 1:
            raise Refusal(
                "a family varies exactly one parameter",
                value=list(self.over),
                instead="give ``over`` once",
            )
        key = next(iter(self.over))
        section, _, name = key.partition(".")
        if section not in SECTIONS:
            raise Refusal(
                f"a family can vary a key of {', '.join(SECTIONS)}, not {key}",
                where="``over``",
                instead="use 'geomech sweep' for others",
            )
        own = self._grid.tables.get(section, {}).get(name)
        if isinstance(own, bool) or not isinstance(own, (int, float)):
            raise Refusal(
                f"the scene has no number at {key}",
                where=self.scene.name,
                instead="use a key of its file",
            )
        return float(own)

    @cached_property
    def _values(self) -> list[float]:
        """Values of the members, with the scene's own."""
        given, *_ = checked_grid_values(self.over).values()
        values = sorted({*given, self._own})
        if len(values) not in N_MEMBERS:
            raise Refusal(
                f"a family has {N_MEMBERS[0]} to {N_MEMBERS[-1]} members, including "
                "the scene's own value",
                value=len(values),
                where="``over``",
                instead="give fewer or more values",
            )
        for value in (*values, *charts.midpoints(values)):
            charts.refuse(self._member_scene(value))
        return values

    def _member_scene(self, value: float) -> Scene:
        return self._grid.scene_factory((value,))

    def cost(self) -> Cost:
        n_family = 1
        if self.over:  # members, and the scenes halfway between them
            n_family = 2 * len(self._values) - 1
        jobs = n_family * _jobs(self.scene)
        for scene in self.scenes[1:]:
            jobs += _jobs(scene)
        return cost.total_cost(jobs)

    def charts(self, progress: Callable[[float], None]) -> list[Chart]:
        """Return a chart for each scene. progress: called with the fraction done."""
        found = []
        for k, scene in enumerate(self.scenes):
            if self.over and k == 0:
                found.append(self._family(progress))
            else:
                found.append(charts.chart(scene))
            progress((k + 1) / len(self.scenes))
        return found

    def _family(self, progress: Callable) -> Chart:
        """Return the chart of the family of the first scene."""
        values = self._values
        between = charts.midpoints(values)
        by_value = {}
        for value in (*values, *between):
            by_value[value] = charts.chart(self._member_scene(value))
            fraction = len(by_value) / (len(values) + len(between))
            progress(fraction / len(self.scenes))

        family = charts.family(
            self.scene,
            next(iter(self.over)),
            values,
            self._own,
            members=[by_value[value] for value in values],
            between=[by_value[value] for value in between],
        )
        return replace(family, scene=self.scene)


def _jobs(scene: Scene) -> list[cost.Job]:
    """Return the jobs of the chart of a scene."""
    jobs = cost.connection_jobs(scene)
    if not scene.system.traits.linear:
        jobs += cost.harmonic_jobs(scene)
    if scene.frame != charts.MINIMUM_PERTURBATION:
        jobs += cost.connection_jobs(scene)  # that of the minimum-perturbation frame
    return jobs
