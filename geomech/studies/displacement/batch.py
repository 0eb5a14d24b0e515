"""Batches of scenes: scenes that differ only in their gaits and in batched fields of effects share one batch of the
solver."""

from __future__ import annotations

import dataclasses

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems import Swimmer
from geomech.scenes.model import Scene
from rft.effects import batched_effect


def batch_key(scene: Scene) -> str:
    """Return a text that is equal for scenes that can share a batch."""
    effects = [
        (
            type(e),
            [
                getattr(e, f.name)
                for f in dataclasses.fields(e)
                if f.name not in e.batched
            ],
        )
        for e in getattr(scene.system, "effects", ())
    ]
    s = scene.system
    rest = (s.medium, s.body, s.solver) if isinstance(s, Swimmer) else s
    return repr((rest, scene.numerics, scene.gait.joints, s.traits.lacks, effects))


def joined_scene(scenes: list[Scene], amplitudes=None) -> Scene:
    """Return one scene with the gaits and effects of several, each for all amplitudes or its own one."""
    count = 1 if amplitudes is None else len(amplitudes)
    gaits = GaitBatch(tuple(s.gait for s in scenes), amplitudes)
    joined = dataclasses.replace(scenes[0], gait=gaits)
    if not isinstance(joined.system, Swimmer):
        return joined
    effects = tuple(
        batched_effect(same, [count] * len(scenes))
        for same in zip(*(s.system.effects for s in scenes))
    )
    return joined.changed(effects=effects)


@dataclasses.dataclass(frozen=True)
class GaitBatch:
    """Several gaits in one batch, each for all ``amplitudes`` or its own one."""

    gaits: tuple[Gait, ...]
    amplitudes: list[float] | None

    @property
    def joints(self) -> int:
        return self.gaits[0].joints

    @property
    def harmonics(self) -> int:
        return max(g.harmonics for g in self.gaits)

    def cycle(self, phases: int, amplitudes=None) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (gaits x amplitudes, phases, joints)."""
        each = [
            g.cycle(
                phases, [g.amplitude] if self.amplitudes is None else self.amplitudes
            )
            for g in self.gaits
        ]
        return tuple(np.concatenate(x) for x in zip(*each))
