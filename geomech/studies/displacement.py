"""The net displacement of a gait per cycle: by each tier with its error, or by the cheapest that is accurate enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from geomech.core.errors import choose
from geomech.core.variables import Result
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies import cost
from geomech.studies.available import default_tiers
from geomech.studies.choose import cheapest
from geomech.studies.effort import refuse_costless, with_effort
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.study import Study
from geomech.tiers import TIERS
from rft.refusal import Refusal


@dataclass(frozen=True)
class Displacement(Question):
    """Net displacement of a gait by amplitude, by tiers of TIERS; without any by all of a plain study. effort: with
    path length, work and cost of transport."""

    scene: Scene
    amplitudes: tuple[float, ...]
    tiers: tuple[str, ...] = ()
    effort: bool = False

    @property
    def chosen(self) -> tuple[str, ...]:
        return self.tiers or default_tiers(self.scene.system)

    @cached_property
    def study(self) -> Study:
        return Study(self.scene)

    def check(self) -> None:
        if self.effort:
            refuse_costless(self.scene)

    def cost(self) -> Cost:
        effort_jobs = (
            cost.of_effort(self.scene, len(self.amplitudes)) if self.effort else []
        )
        return self.study.cost(self.amplitudes, self.chosen, more=effort_jobs)

    def answer(self, progress: Progress, allow: Allow) -> Result:
        result = self.study.study(
            self.amplitudes, self.chosen, progress=progress
        ).result
        return with_effort(result) if self.effort else result


@dataclass(frozen=True)
class Cheapest(Question):
    """Net displacement of a gait by the cheapest tier whose errors of position are at most ``tolerance``, body lengths."""

    scene: Scene
    amplitudes: tuple[float, ...]
    tolerance: float
    effort: bool = False

    @property
    def title(self) -> str:
        return f"displacement of {self.scene.name}"

    @property
    def _effort_jobs(self) -> list[cost.Job]:
        return cost.of_effort(self.scene, len(self.amplitudes)) if self.effort else []

    def check(self) -> None:
        if self.effort:
            refuse_costless(self.scene)

    def cost(self) -> Cost:
        # The cost of a tolerance is known only once a tier has run: `allow` is called before each.
        return cost.price(self._effort_jobs)

    def answer(self, progress: Progress, allow: Allow) -> Result:
        ask = lambda jobs: allow(cost.price([*jobs, *self._effort_jobs]))
        result = cheapest(self.scene, self.amplitudes, self.tolerance, ask=ask).result
        return with_effort(result) if self.effort else result


def displacement(
    scene: Scene,
    amplitudes: Sequence[float],
    tiers: str | None = None,
    tolerance: float | None = None,
    effort: bool = False,
) -> Question:
    """Return the question of a command. tiers: their names, with commas between them."""
    chosen = (
        ()
        if tiers is None
        else tuple(
            choose("``tiers``", name.strip(), TIERS) for name in tiers.split(",")
        )
    )
    if tolerance is None:
        return Displacement(scene, tuple(amplitudes), chosen, effort)
    if chosen:
        raise Refusal("``tolerance`` chooses the tier", instead="drop ``tiers``")
    return Cheapest(scene, tuple(amplitudes), tolerance, effort)
