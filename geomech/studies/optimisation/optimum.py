"""Results of an optimisation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.mathematics.gaits import Gait, Sine
from geomech.mathematics.geometry.stretch import Stretch, stretch
from geomech.mathematics.systems.capabilities import stored_table
from geomech.scenes.model import Scene
from geomech.studies.optimisation.evaluate import Evaluation
from geomech.studies.optimisation.gain import Gained, gained_ccf
from geomech.studies.optimisation.request import Request
from geomech.studies.scene_tables import SceneTables


@dataclass(frozen=True, eq=False)
class Optimum:
    """Result of `optimise`.

    best, start: evaluated by the direct tier. active: limits that the best touches.
    answers: value and number of starts of every different local optimum, best first;
    others: the same of those that only a table led to, by the direct tier, unfinished.
    evaluations: number of cycles. seconds: duration of the search.

    Examples
    --------
    >>> from geomech.studies.optimisation import optimise
    >>> from geomech.scenes import load
    >>> best = optimise(load("three-link-viscous"), harmonics=1, starts=1)
    >>> best.value > best.start.value, best.gait.joints
    (True, 2)
    """

    request: Request
    best: Evaluation
    start: Evaluation
    active: tuple[str, ...]
    answers: tuple[tuple[float, int], ...]
    others: tuple[tuple[float, int], ...]
    evaluations: int
    seconds: float

    @property
    def value(self) -> float:
        """Value of the objective for the best gait."""
        return self.best.value

    @property
    def estimate(self) -> float:
        """Error estimate of the value."""
        return self.best.error

    @property
    def gait(self) -> Gait:
        """The best gait."""
        return self.best.gait

    @cached_property
    def scene(self) -> Scene:
        """Scene with the best gait, and with a field that is large enough for it."""
        gait = self.best.gait
        scene = self.request.scene.changed(gait=gait)
        if isinstance(gait, Sine) or stored_table(scene.system, "connection"):
            return scene
        largest = float(np.abs(gait.shape(np.linspace(0, 2 * np.pi, 721))).max())
        extent = max(scene.numerics.extent, 1.0001 * largest)
        return scene.with_numerics(extent=extent)

    @cached_property
    def study(self) -> SceneTables:
        return SceneTables(self.scene)

    @cached_property
    def gained(self) -> Gained | None:
        """CCF whose area the best gait gains; None with other than two joints, or where
        the velocity does not follow from shape alone."""
        system = self.scene.system
        if system.joints != 2 or system.traits.steps:
            return None
        is_turning = self.request.objective.name == "turning"
        return gained_ccf(self.study.fitted, self.best, is_turning)

    @cached_property
    def stretched(self) -> Stretch:
        """Coordinates of shape space in which equal lengths take equal effort. Refusal
        for a system without a metric."""
        return stretch(self.study.metric)
