"""Batches of scenes: scenes that differ only in their gaits, in the numbers of their
media and in batched fields of effects share one batch of the solver."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems import Swimmer, System
from geomech.scenes.model import Scene
from rft.effects import batched_effect, engine
from rft.laws.batch import batch_form, batched_medium


def grouped(scenes: Sequence[Scene]) -> list[list[int]]:
    """Return the numbers of scenes that can share a batch, in lists."""
    groups: dict[tuple, list[int]] = {}
    known: dict[tuple, tuple] = {}  # of parts that scenes share, as those of a sweep do
    for k, scene in enumerate(scenes):
        parts = tuple(map(id, _parts_but_medium(scene)))
        if parts not in known:
            known[parts] = _in_common(scene), _mixes_media(scene.system)
        in_common, mixes_media = known[parts]
        medium = _medium_in_common(scene.system, mixes_media)
        groups.setdefault((in_common, medium), []).append(k)
    return list(groups.values())


def _parts_but_medium(scene: Scene) -> list:
    """Return the parts of a scene, its name and a swimmer's medium left out."""
    system = scene.system
    parts: list = [system]
    if isinstance(system, Swimmer):
        parts = [system.body, system.contact, system.solver, *system.effects]
    return [*parts, scene.numerics, scene.gait]


def _in_common(scene: Scene) -> str:
    """Return a text that is equal for scenes that can share a batch if their media
    can."""
    system = scene.system
    effects = []
    for effect in getattr(system, "effects", ()):
        fields = [field.name for field in dataclasses.fields(effect)]
        common = [getattr(effect, x) for x in fields if x not in effect.batched]
        batched = [getattr(effect, x) for x in effect.batched]
        sizes = [x is None or np.shape(x) for x in batched]
        effects.append((type(effect), common, sizes))

    model: object = system
    if isinstance(system, Swimmer):
        model = (system.body, system.contact, system.solver)
    joints, lacks = scene.gait.joints, system.traits.lacks
    return repr((model, scene.numerics, joints, lacks, effects))


def _mixes_media(system: System) -> bool:
    """Return whether a system may share a batch with those in other media."""
    if not isinstance(system, Swimmer) or engine(system.effects) != "algebraic":
        return False
    return all(effect.mixes_media for effect in system.effects)


def _medium_in_common(system: System, mixes_media: bool) -> object:
    """Return what the media of systems in one batch have in common: the law, or, where
    media of other numbers cannot share a batch, all of its numbers."""
    medium = getattr(system, "medium", None)
    if mixes_media and getattr(medium, "covariance", None) is None:
        form = batch_form(medium)
        if form is not None:
            return form
    return repr(medium)


def joined_scene(scenes: list[Scene], amplitudes: list[float] | None = None) -> Scene:
    """Return one scene with the gaits, media and effects of several that share a batch,
    each gait for all amplitudes, or for its own one if None."""
    gaits = GaitBatch(tuple(scene.gait for scene in scenes), amplitudes)
    joined = dataclasses.replace(scenes[0], gait=gaits)
    if not isinstance(joined.system, Swimmer):
        return joined
    count = 1 if amplitudes is None else len(amplitudes)
    counts = [count] * len(scenes)
    by_effect = zip(*(scene.system.effects for scene in scenes))
    effects = tuple(batched_effect(same, counts) for same in by_effect)
    medium = batched_medium([scene.system.medium for scene in scenes], counts)
    return joined.changed(medium=medium, effects=effects)


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

    def shape(self, t: np.ndarray, amplitudes=None) -> np.ndarray:
        """Return alpha (gaits, T..., joints) of the gaits at their own amplitudes."""
        return np.stack([gait.shape(t) for gait in self.gaits])

    def cycle(self, phases: int, amplitudes=None) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (gaits x amplitudes, phases, joints)."""
        computed: dict[int, tuple] = {}  # scenes of a sweep may share their gait
        for gait in self.gaits:
            if id(gait) not in computed:
                own = [gait.amplitude] if self.amplitudes is None else self.amplitudes
                computed[id(gait)] = gait.cycle(phases, own)
        alphas, alphadots = zip(*(computed[id(gait)] for gait in self.gaits))
        return np.concatenate(alphas), np.concatenate(alphadots)
