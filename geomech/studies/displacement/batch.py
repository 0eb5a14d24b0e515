"""Batches of scenes: scenes that differ only in their gaits and in batched fields of
effects share one batch of the solver."""

from __future__ import annotations

import dataclasses

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems import Swimmer
from geomech.scenes.model import Scene
from rft.effects import batched_effect


def batch_key(scene: Scene) -> str:
    """Return a text that is equal for scenes that can share a batch."""
    system = scene.system
    effects = []
    for effect in getattr(system, "effects", ()):
        fields = [field.name for field in dataclasses.fields(effect)]
        common = [getattr(effect, x) for x in fields if x not in effect.batched]
        effects.append((type(effect), common))

    model: object = system
    if isinstance(system, Swimmer):
        model = (system.medium, system.body, system.solver)
    joints, lacks = scene.gait.joints, system.traits.lacks
    return repr((model, scene.numerics, joints, lacks, effects))


def joined_scene(scenes: list[Scene], amplitudes: list[float] | None = None) -> Scene:
    """Return one scene with the gaits and effects of several that share a batch, each
    gait for all amplitudes, or for its own one if None."""
    gaits = GaitBatch(tuple(scene.gait for scene in scenes), amplitudes)
    joined = dataclasses.replace(scenes[0], gait=gaits)
    if not isinstance(joined.system, Swimmer):
        return joined
    count = 1 if amplitudes is None else len(amplitudes)
    counts = [count] * len(scenes)
    by_effect = zip(*(scene.system.effects for scene in scenes))
    effects = tuple(batched_effect(same, counts) for same in by_effect)
    return joined.changed(effects=effects)


@dataclasses.dataclass(frozen=True)
class GaitBatch:
    """Several gaits in one batch, each for all ``amplitudes``, or for its own one if
    None."""

    gaits: tuple[Gait, ...]
    amplitudes: list[float] | None

    @property
    def joints(self) -> int:
        return self.gaits[0].joints

    @property
    def harmonics(self) -> int:
        return max(gait.harmonics for gait in self.gaits)

    def cycle(self, phases: int, amplitudes=None) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (gaits x amplitudes, phases, joints)."""
        cycles = []
        for gait in self.gaits:
            own = [gait.amplitude] if self.amplitudes is None else self.amplitudes
            cycles.append(gait.cycle(phases, own))
        alphas, alphadots = zip(*cycles)
        return np.concatenate(alphas), np.concatenate(alphadots)
