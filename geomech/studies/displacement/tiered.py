"""Accuracy study of a scene with a gait: the displacement by every tier, at settings from coarse to fine.

Errors are distances between net positions in body lengths, rms over a few amplitudes up to the gait's own; the truth is
the direct tier, far finer."""

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
from geomech.mathematics.tiers.base import Plan
from geomech.mathematics.tiers.direct import DIRECT
from geomech.run.cost import Cost
from geomech.scenes.model import Scene, checked_scene
from geomech.studies.available import available_tiers
from geomech.studies.estimates import cost as foretold
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
SETTINGS = tuple(
    replace(setting, tier=tier.name)
    for tier in sorted(
        TIERS.values(),
        key=lambda tier: (tier is not DIRECT, tier.common, -[*TIERS].index(tier.name)),
    )
    for setting in tier.settings
)  # the direct tier's first, then those of one gait's family, then those of fields


@dataclass(frozen=True)
class Settings:
    """A gait at fractions of its amplitude. runs: of each setting; time stepping takes long enough to be timed in one."""

    scene: Scene
    runs: int = 2

    about: ClassVar[str] = (
        f"the displacement, rms over {len(AMPLITUDE_FRACTIONS)} amplitudes,"
    )
    unit: ClassVar[str] = "BL"
    measures: ClassVar[dict[str, str]] = {
        "error": "rms distance of positions over the amplitudes"
    }

    def __post_init__(self) -> None:
        if checked_scene(self.scene).system.traits.steps:
            object.__setattr__(self, "runs", 1)

    @property
    def amplitudes(self) -> np.ndarray:
        return self.scene.gait.amplitude * AMPLITUDE_FRACTIONS

    def check(self) -> None:
        """Refuse a gait that does not move, or leaves a field that a setting changes."""
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
        scene = self.scene
        jobs = foretold.direct_jobs(
            scene,
            scene.gait,
            len(AMPLITUDE_FRACTIONS),
            _truth_phases(scene),
            checked=False,
        )
        for setting in self.settings():
            jobs += [
                job
                for value in setting.values
                for job in self.runs * self._jobs(setting, value)
            ]
            jobs += self._jobs(setting, None) if setting.against == "limit" else []
        return foretold.total_cost(jobs)

    def _jobs(self, setting: Setting, value: Any) -> list[foretold.Job]:
        """Return the jobs of a displacement at a setting."""
        scene = self.at(setting, value)
        plan = _plan(scene, setting.tier)
        if not plan.exact:
            return foretold.prediction_jobs(scene, plan, len(AMPLITUDE_FRACTIONS))
        return foretold.direct_jobs(
            scene,
            scene.gait,
            len(AMPLITUDE_FRACTIONS),
            scene.numerics.phases,
            checked=False,
        )

    def with_shared_data(self) -> Settings:
        return self

    def settings(self) -> list[Setting]:
        return [
            k
            for k in SETTINGS
            if is_applicable(k, self.scene)
            and not (k.rule and not is_closed(self.scene.system))
        ]

    def at(self, setting: Setting | None, value: Any) -> Scene:
        """Return the scene at a value of a setting; for None at the limit of the setting, without a setting at what the
        truth takes."""
        scene = self.scene
        if setting is None:
            finest = (
                scene.with_numerics(loads="exact", regularisation=1e-9)
                if is_closed(scene.system)
                else scene
            )
            finest = (
                finest.with_numerics(pieces=FINE_PIECES)
                if pieces_per_length(scene.system)
                else finest
            )
            return finest.with_numerics(phases=_truth_phases(scene))
        key = setting.key or setting.name
        if value is not None:
            return scene.with_numerics(
                **{key: f"{setting.rule}:{value}" if setting.rule else value}
            )
        if (
            key == "interpolation"
        ):  # an exact fit at the gait's own shapes would cost more than a far finer grid
            return scene.with_numerics(
                interpolation=5, grid=4 * scene.numerics.grid - 3
            )
        return scene.with_numerics(**{key: FINEST_VALUES[key]})

    def evaluate(self, setting: Setting | None, value: Any) -> list[np.ndarray]:
        """Return net poses (B, 3), with tables built anew so that their cost is counted."""
        tier = setting.tier if setting else DIRECT.name
        return [SceneTables(self.at(setting, value)).poses(tier, None, self.amplitudes)]

    def errors(
        self, numbers: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        distances = estimate.distance(numbers[0], truth[0]) / body_size(
            self.scene.system
        )
        return {"error": float(np.sqrt(np.mean(distances**2)))}

    @property
    def own_error(self) -> float:
        """Largest error of the system itself, body lengths, which no setting reduces."""
        system = self.scene.system
        shapes = self.scene.gait.cycle(self.scene.numerics.phases, self.amplitudes)
        error = table_error(system, *shapes)[..., 0]
        if estimate.elements.n_elements(system):
            fewer = shapes[0][:, ::4], shapes[1][:, ::4]
            net = system.run(*fewer).net
            error = error + estimate.elements_error(system, fewer, net)[..., 0]
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
            about = "of the system, which no setting takes away"
            found.append(Variable("own_error", (), own, self.unit, about))
        return found

    def facts(self) -> dict[str, Any]:
        return {}


def is_applicable(setting: Setting, scene: Scene) -> bool:
    """Return whether a setting applies to a scene."""
    system, key = scene.system, setting.key or setting.name
    if system.traits.linear and key in ("regularisation", "directions"):
        return False
    if key == "regularisation" and solver_of(system) is None:
        return False
    if setting.tier not in available_tiers(system):
        return False
    if setting.tier != DIRECT.name:
        of_a_field = TIERS[setting.tier].common and (
            stored_table(system, "connection") or system.joints > 2
        )
        if (
            of_a_field or _plan(scene, setting.tier).exact
        ):  # from 7 to 61 points per joint: hours
            return False
    return key != "pieces" or pieces_per_length(system) > 0


def _plan(scene: Scene, tier: str) -> Plan:
    """Return the plan of a tier for the amplitudes of the study."""
    return TIERS[tier].plan(
        scene.system,
        scene.numerics,
        scene.gait,
        scene.gait.amplitude * AMPLITUDE_FRACTIONS,
    )


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
