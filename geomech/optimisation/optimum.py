"""Results of an optimisation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.gaits import Gait, Sine
from geomech.geometry.stretch import Stretch, stretch
from geomech.optimisation.gain import Gained, gained_ccf
from geomech.optimisation.request import Request
from geomech.scenes.model import Scene
from geomech.studies.study import Study
from geomech.systems.capabilities import stored_table


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A gait as evaluated by the direct tier.

    value, error: of the objective. heading: error of the net turn, rad. displacement: net pose (3,) in the frame at the
    start, in the system's unit. length: of the path; work: of a cycle at a rad of phase per unit of time, in body drag
    x body length; None where these are not known, and for the work of a metric that is not one of drag. time: of a rad
    of phase. limits: names of those that set the time."""

    gait: Gait
    value: float
    error: float
    heading: float
    displacement: np.ndarray
    length: float | None
    work: float | None
    time: float
    limits: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Optimum:
    """Result of `optimise`.

    best, start: evaluated by the direct tier. active: limits that the best touches. answers: value and number of starts
    of every different local optimum, best first; others: the same of those that only a table led to, by the direct
    tier, unfinished. seconds: duration of the search.

    Examples
    --------
    >>> from geomech.optimisation import optimise
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

    value = property(lambda self: self.best.value)
    estimate = property(lambda self: self.best.error)
    gait = property(lambda self: self.best.gait)

    @cached_property
    def scene(self) -> Scene:
        """Scene with the best gait, and with a field that is large enough for it."""
        scene, gait = self.request.scene, self.best.gait
        scene = scene.changed(gait=gait)
        if isinstance(gait, Sine) or stored_table(scene.system, "connection"):
            return scene
        largest = np.abs(gait.shape(np.linspace(0, 2 * np.pi, 721))).max()
        return scene.with_numerics(
            extent=max(scene.numerics.extent, 1.0001 * float(largest))
        )

    @cached_property
    def study(self) -> Study:
        return Study(self.scene)

    @cached_property
    def gained(self) -> Gained | None:
        """CCF whose area the best gait gains; None where the velocity does not follow from shape alone."""
        return None if self.scene.system.traits.steps else gained_ccf(self)

    @cached_property
    def stretched(self) -> Stretch:
        """Coordinates of shape space in which equal lengths take equal effort. Refusal for a system without a metric."""
        return stretch(self.study.metric)
