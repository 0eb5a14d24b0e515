"""Accuracy study of a scene with a gait: the displacement by every tier, at settings
from coarse to fine.

Errors are distances between net positions in body lengths, rms over a few amplitudes up
to the gait's own. The truth is the direct tier with far finer settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from geomech.core.setting import Setting
from geomech.core.variables import Variable
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.capabilities import (
    is_closed,
    pieces_per_length,
    solver_of,
    stored_table,
    table_error,
)
from geomech.mathematics.tiers import TIERS
from geomech.mathematics.tiers.base import Plan, Tier
from geomech.mathematics.tiers.direct import DIRECT
from geomech.runs.cost import Cost
from geomech.scenes.model import Scene, checked_scene
from geomech.studies.available import available_tiers
from geomech.studies.estimates import cost as cost_jobs
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables, refuse_outside
from geomech.studies.settings import Choice, Measurements, choice_variables
from rft.core.refusal import Refusal, located

AMPLITUDE_FRACTIONS = np.array([0.4, 0.55, 0.7, 0.85, 1.0])  # of the gait's amplitude
TOLERANCES = 10.0 ** -np.arange(1, 7)  # BL
TRUTH_PHASES = 4096
TRUTH_STEPS = 1024  # of time stepping, which is sequential
FINE_PIECES = 320  # of body, where effects cut it
FINEST_VALUES = {
    "loads": "exact",
    "regularisation": 1e-9,
    "directions": 192,
    "pieces": FINE_PIECES,
}


def _tier_settings() -> tuple[Setting, ...]:
    """Return the settings of the direct tier, then those of tiers of one gait's family,
    then those of fields."""
    names = [*TIERS]

    def rank(tier: Tier) -> tuple[bool, bool, int]:
        return tier is not DIRECT, tier.common, -names.index(tier.name)

    settings = []
    for tier in sorted(TIERS.values(), key=rank):
        settings += [replace(setting, tier=tier.name) for setting in tier.settings]
    return tuple(settings)


SETTINGS = _tier_settings()


@dataclass(frozen=True)
class Settings:
    """The displacement of a scene's gait at fractions of its amplitude, as the subject
    of an accuracy study. runs: of each setting; time stepping takes long enough to be
    timed in one."""

    scene: Scene
    runs: int = 2

    about: ClassVar[str] = (
        f"the displacement, rms over {len(AMPLITUDE_FRACTIONS)} amplitudes,"
    )
    unit: ClassVar[str] = "BL"
    measures: ClassVar[dict[str, str]] = {
        "error": "rms distance between positions over the amplitudes"
    }

    def __post_init__(self) -> None:
        if checked_scene(self.scene).system.traits.steps:
            object.__setattr__(self, "runs", 1)

    @property
    def amplitudes(self) -> np.ndarray:
        return self.scene.gait.amplitude * AMPLITUDE_FRACTIONS

    def check(self) -> None:
        """Refuse a gait that does not move, or leaves a field that a setting
        changes."""
        scene = self.scene
        if np.ptp(scene.gait.cycle(_truth_phases(scene))[0], axis=0).max() == 0:
            raise Refusal(
                "[gait] does not move", where=scene.name, instead="give it a size"
            )
        tables = [_plan(scene, setting.tier).table for setting in self.settings()]
        if any(table and table.axes for table in tables):
            with located(scene.name):
                refuse_outside(scene)

    def cost(self) -> Cost:
        jobs = self._direct_jobs(self.scene, _truth_phases(self.scene))
        for setting in self.settings():
            for value in setting.values:
                jobs += self.runs * self._jobs(setting, value)
            if setting.against == "limit":
                jobs += self._jobs(setting, None)
        return cost_jobs.total_cost(jobs)

    def _jobs(self, setting: Setting, value: Any) -> list[cost_jobs.Job]:
        """Return the jobs of a displacement at a setting."""
        scene = self.scene_with(setting, value)
        plan = _plan(scene, setting.tier)
        if plan.exact:
            return self._direct_jobs(scene, scene.numerics.phases)
        return cost_jobs.prediction_jobs(scene, plan, len(AMPLITUDE_FRACTIONS))

    @staticmethod
    def _direct_jobs(scene: Scene, phases: int) -> list[cost_jobs.Job]:
        count = len(AMPLITUDE_FRACTIONS)
        return cost_jobs.direct_jobs(scene, scene.gait, count, phases, with_error=False)

    def with_shared_data(self) -> Settings:
        return self

    def settings(self) -> list[Setting]:
        has_rules = is_closed(self.scene.system)
        found = []
        for setting in SETTINGS:
            if setting.rule and not has_rules:
                continue
            if is_applicable(setting, self.scene):
                found.append(setting)
        return found

    def scene_with(self, setting: Setting | None, value: Any) -> Scene:
        """Return the scene at a value of a setting. If the value is None, it is at the
        limit of the setting; without a setting, at the settings of the truth."""
        if setting is None:
            return self._scene_of_truth()
        scene = self.scene
        key = setting.key or setting.name
        if value is not None:
            if setting.rule:
                value = f"{setting.rule}:{value}"
            return scene.with_numerics(**{key: value})
        if key == "interpolation":
            # An exact fit at the gait's own shapes would cost more than a far finer
            # grid.
            grid = 4 * scene.numerics.grid - 3
            return scene.with_numerics(interpolation=5, grid=grid)
        return scene.with_numerics(**{key: FINEST_VALUES[key]})

    def _scene_of_truth(self) -> Scene:
        scene = self.scene
        if is_closed(scene.system):
            scene = scene.with_numerics(loads="exact", regularisation=1e-9)
        if pieces_per_length(scene.system):
            scene = scene.with_numerics(pieces=FINE_PIECES)
        return scene.with_numerics(phases=_truth_phases(self.scene))

    def evaluate(self, setting: Setting | None, value: Any) -> list[np.ndarray]:
        """Return net poses (B, 3), with tables built anew so that their cost is
        counted."""
        tier = setting.tier if setting else DIRECT.name
        tables = SceneTables(self.scene_with(setting, value))
        return [tables.poses(tier, None, self.amplitudes)]

    def errors(
        self, numbers: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        distance = estimate.distance(numbers[0], truth[0])
        distance = distance / body_size(self.scene.system)
        return {"error": float(np.sqrt(np.mean(distance**2)))}

    @property
    def own_error(self) -> float:
        """Largest error of the system itself, body lengths, which no setting
        reduces."""
        system = self.scene.system
        shapes = self.scene.gait.cycle(self.scene.numerics.phases, self.amplitudes)
        error = table_error(system, *shapes)[..., 0]
        if estimate.elements.n_elements(system):
            quarter = estimate.every_nth_phase(4, shapes)
            net = system.run(*quarter).net
            error = error + estimate.elements_error(system, quarter, net)[..., 0]
        return float(error.max())

    def choices(self, measured: Measurements) -> list[Variable]:
        """Return the cheapest values for tolerances, and the system's own error, which
        their errors include."""
        own = self.own_error
        errors = measured.errors["error"] + own

        def choose(tolerance: float) -> Choice | None:
            return quickest(measured, errors, tolerance)

        found = choice_variables(measured, errors, self.unit, TOLERANCES, choose)
        label = self.scene.gait.amplitude_label
        found.append(Variable("amplitude", ("amplitude",), self.amplitudes, "", label))
        if own:
            about = "error of the system itself, which no setting reduces"
            found.append(Variable("own_error", (), own, self.unit, about))
        return found

    def facts(self) -> dict[str, Any]:
        return {}


def is_applicable(setting: Setting, scene: Scene) -> bool:
    """Return whether a setting changes the displacement of a scene, and can be
    studied."""
    system = scene.system
    key = setting.key or setting.name
    if system.traits.linear and key in ("regularisation", "directions"):
        return False
    if key == "regularisation" and solver_of(system) is None:
        return False
    if setting.tier not in available_tiers(system):
        return False
    if setting.tier != DIRECT.name and not _has_studied_table(setting.tier, scene):
        return False
    return key != "pieces" or pieces_per_length(system) > 0


def _has_studied_table(tier: str, scene: Scene) -> bool:
    """Return whether a tier builds a table that takes no hours with the finest
    setting."""
    system = scene.system
    if TIERS[tier].common:
        if stored_table(system, "connection"):
            return False
        if system.joints > 2:  # from 7 to 61 points per joint: hours
            return False
    return not _plan(scene, tier).exact


def _plan(scene: Scene, tier: str) -> Plan:
    """Return the plan of a tier for the amplitudes of the study."""
    amplitudes = scene.gait.amplitude * AMPLITUDE_FRACTIONS
    return TIERS[tier].plan(scene.system, scene.numerics, scene.gait, amplitudes)


def _truth_phases(scene: Scene) -> int:
    return TRUTH_STEPS if scene.system.traits.steps else TRUTH_PHASES


def quickest(
    measured: Measurements, errors: np.ndarray, tolerance: float
) -> Choice | None:
    """Return the quickest value whose error against the truth is at most the tolerance,
    the first of several; None if there is none."""
    found = None
    for k, setting in enumerate(measured.settings):
        if setting.against != "truth":
            continue
        for j in np.flatnonzero(errors[k] <= tolerance):
            choice = Choice(k, int(j))
            if found is None or measured.seconds[choice] < measured.seconds[found]:
                found = choice
    return found
