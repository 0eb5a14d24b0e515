"""Components of a displacement that are 0 by symmetry, by the traits of the velocity and the curve of the gait."""

import dataclasses

import numpy as np
import pytest
from registry import GAITS, SYSTEMS

from geomech.gaits import Butterfly, Circle, Fourier, Wave
from geomech.geometry.symmetry import zero_components
from geomech.geometry.traits import Traits
from geomech.scenes.model import Scene
from geomech.studies.study import Study
from rft.premise import Premise
from rft.refusal import Refusal

BOTH = Traits(mirror=True, reversible=True)
BACK = Fourier(cos=((0.5, 0.3), (0.4, 0.1)), sin=((0.0, 0.0), (0.0, 0.0)))  # the same path there and back


@pytest.mark.parametrize(("gait", "traits", "zero"), [
    (Circle(), BOTH, ["heading"]),  # its y is that of a cycle from phase 0
    (Circle(), Traits(mirror=True, odd=False), ["heading"]),
    (Circle(), Traits(reversible=True), ["heading"]),
    (Circle(), Traits(reversible=True, odd=False), []),
    (Circle(), Traits(), []),
    (Circle(centre=(0.2, 0.1)), BOTH, []),
    (Circle(), dataclasses.replace(BOTH, lacks=Premise.MEMORYLESS), []),
    (Butterfly(), BOTH, ["y", "heading"]),
    (Butterfly(), Traits(reversible=True), ["heading"]),
    (Wave(joints=6), BOTH, ["y", "heading"]),
    (Wave(joints=6, offset=0.1), BOTH, []),
    (Wave(joints=2, waves=0.0), BOTH, ["x", "y", "heading"]),
    (Fourier(cos=((1, 0.4), (-1, 0.4)), sin=((0, 0.2), (0, 0.2))), dataclasses.replace(BOTH, odd=False), ["heading"]),  # halves
    (BACK, Traits(), ["x", "y", "heading"]),
    (BACK, Traits(odd=False), []),
])  # fmt: skip
def test_zeros_follow_from_traits_and_curve(gait, traits, zero):
    assert [*zero_components(traits, gait, [0.5, 1.0])] == zero


@pytest.mark.parametrize("name", SYSTEMS)
def test_displacements_have_the_zeros_that_are_claimed(name):
    system = SYSTEMS[name]
    for gait in GAITS.values():
        if gait.joints != system.joints:
            continue
        small = dataclasses.replace(gait, amplitude=0.5 * gait.amplitude)
        try:
            table = Study(Scene(system, small, name="s")).study([small.amplitude], ["direct"])
        except Refusal:
            continue
        for component in table["zero_by_symmetry"]:
            assert np.abs(table[component]["direct"]).max() < 1e-9 * system.length
