"""The report of a scene: its connection, and displacements of its gait and of those it is compared with, by all tiers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from geomech.core.variables import Result
from geomech.gaits import Butterfly, Circle, Gait
from geomech.geometry.plane import Plane
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies import effort
from geomech.studies.available import default_tiers
from geomech.studies.cost import Job, of_even_part, of_metric, of_planes, price
from geomech.studies.cost import study as jobs
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.study import Study
from geomech.systems.base import System, refuse_singular
from geomech.systems.capabilities import near_gait
from geomech.systems.swimmer import is_three_link
from geomech.tiers.area import AREA
from geomech.tiers.fitted import axes as field_axes
from geomech.tiers.fitted import is_too_large
from geomech.tiers.path import PATH
from rft.core.refusal import Refusal, located

AMPLITUDES = 10  # or so, for each gait
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)  # of round amplitudes, times a power of ten
ADDED = "not in the scene, added to compare the two gaits of Fig. 11(e)"


@dataclass(frozen=True)
class Reported:
    """Contents of a report. tables: displacements by the gait's kind, each with its ``gaits``. mapped: whether there
    are maps; for three joints, planes of every pair."""

    study: Study
    gaits: list[Gait]
    tables: dict[str, Result]
    mapped: bool
    planes: list[Plane]


@dataclass(frozen=True)
class Report(Question):
    """The report of a scene."""

    scene: Scene

    @property
    def title(self) -> str:
        return f"field of {self.scene.name}"

    @cached_property
    def study(self) -> Study:
        return Study(self.scene)

    def cost(self) -> Cost:
        return cost(self.scene)

    def answer(self, progress: Progress, allow: Allow) -> Result:
        study, scene, gaits = self.study, self.scene, _gaits(self.scene)
        amplitudes = [reachable(scene, gait) for gait in gaits]
        mapped = is_mapped(scene.system)
        if mapped:
            study.compute_field(progress)
        tables = {}
        for gait, values in zip(gaits, amplitudes):
            result = study.displacements(values, gait=gait)
            title = type(gait).__name__.lower()
            facts = {**result.attributes, "scene": f"{scene.name}, {title}"}
            if gait is not scene.gait:
                facts["note"] = ADDED
            tables[title] = replace(result, attributes=facts)
        pairs = combinations(range(3), 2) if mapped and scene.system.joints == 3 else ()
        planes = [study.plane(pair) for pair in pairs]
        first = next(iter(tables.values()))
        return replace(
            first, kind="report", subject=Reported(study, gaits, tables, mapped, planes)
        )


def is_mapped(system: System) -> bool:
    """Return whether all of shape space is drawn; for more joints there is `geomech ccf --pair`."""
    return (
        {2: PATH, 3: AREA}[system.joints].is_offered(system)
        if system.joints in (2, 3)
        else False
    )


def cost(scene: Scene) -> Cost:
    """Return the cost of a report; Refusal as in the report itself."""
    study, system = Study(scene), scene.system
    parts: list[Job] = []
    for k, gait in enumerate(_gaits(scene)):
        amplitudes = reachable(scene, gait)
        plans = {m: study.plan(m, gait, amplitudes) for m in default_tiers(system)}
        parts += jobs(scene, plans, len(amplitudes), gait, tables=k == 0)
    if is_mapped(system):
        pairs = [*combinations(range(3), 2)] if system.joints == 3 else []
        parts += of_even_part(scene) + of_planes(
            scene, pairs, [scene.gait.middle] * len(pairs)
        )
        parts += (
            [] if effort.why_none(system) or effort.shared(system) else of_metric(scene)
        )
    return price(parts)


def _gaits(scene: Scene) -> list[Gait]:
    """Return the scene's gait and, for the three-link swimmer, those of Fig. 11(e), at the same frequency."""
    more = (
        Circle(reverse=True, frequency=scene.frequency),
        Butterfly(frequency=scene.frequency),
    )
    return [
        scene.gait,
        *(
            g
            for g in more
            if type(g) is not type(scene.gait) and is_three_link(scene.system)
        ),
    ]


def reachable(scene: Scene, gait: Gait) -> list[float]:
    """Return round amplitudes (`steps`), with the sign of the gait's own, up to the largest that lies inside the field.

    Without a field, or with singular shapes, the last is the gait's own. Refusal for a gait that does not move or lies
    outside."""
    system, n = scene.system, scene.numerics
    own = (
        not PATH.is_offered(system)
        or system.traits.singularity is not None
        or is_too_large(system, n)
    )
    unit = gait.unit(np.linspace(0, 2 * np.pi, 721))
    if np.ptp(unit, axis=0).max() == 0 or (own and gait.amplitude == 0):
        raise Refusal(
            "[gait] does not move", where=scene.name, instead="give it a size"
        )
    if own:
        size = abs(gait.amplitude)
        if near_gait(scene.system):
            return _near(scene, gait)
        amplitudes = [a for a in steps(size) if a < size * (1 - 1e-9)] + [size]
        return [float(np.copysign(a, gait.amplitude)) for a in amplitudes]
    room = min(
        min(a[-1] - x, x - a[0])
        for a, x in zip(field_axes(scene.system, scene.numerics), gait.middle)
    )
    if room <= 0:
        raise Refusal(
            "the gait's centre lies outside the field",
            where=scene.name,
            instead="raise [numerics] extent",
        )
    return [
        float(np.copysign(a, gait.amplitude)) for a in steps(room / np.abs(unit).max())
    ]


def _near(scene: Scene, gait: Gait) -> list[float]:
    """Return amplitudes about the gait's own for which the system is known; Refusal where there are none."""
    amplitudes = [
        round(1 + 0.05 * k, 2) * gait.amplitude
        for k in range(-AMPLITUDES, AMPLITUDES + 1)
    ]
    with located(scene.name):
        refuse_singular(scene.system, gait.cycle(scene.numerics.phases)[0])
    reached = lambda a: (
        scene.system.traits.singularity(gait.cycle(scene.numerics.phases, a)[0]) >= 0
    ).all()
    return [a for a in amplitudes if reached(a)]


def steps(top: float) -> list[float]:
    """Return multiples of a round number, about AMPLITUDES of them, up to ``top``."""
    exact = top / AMPLITUDES
    power = 10.0 ** np.floor(np.log10(exact))
    step = min(STEPS, key=lambda s: abs(np.log(s * power / exact))) * power
    count = int(top / step * (1 + 1e-12))
    return [float(f"{k * step:.10g}") for k in range(1, count + 1)]
