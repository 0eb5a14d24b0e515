"""Components of a displacement that are 0 by symmetry, by the traits of the velocity and the curve of the gait."""

import dataclasses

import numpy as np
import pytest
from registry import GAITS, SYSTEMS
from tabled import tabled

from geomech.mathematics.gaits import Butterfly, Circle, Fourier, Wave
from geomech.mathematics.geometry.symmetry import (
    ALWAYS,
    BACKWARDS,
    MIRRORED,
    REFLECTED,
    RETRACED,
    zero_components,
)
from geomech.mathematics.geometry.traits import Traits
from geomech.scenes.model import Scene
from geomech.studies.scene_tables import SceneTables
from rft.bodies.base import body_size
from rft.core.premise import Premise
from rft.core.refusal import Refusal

BOTH = Traits(mirror=True, reversible=True)
# Two harmonics, of which the second half of the cycle is the image of the first head for tail, and of nothing else.
HEAD_FOR_TAIL = Fourier(cos=((1.0, 0.3), (1.0, -0.3)), sin=((0.2, 0.1), (0.2, -0.1)))
ODD = Fourier(
    cos=((0.5, 0.0, 0.1), (0.1, 0.0, 0.2)), sin=((0.2, 0.0, 0.05), (0.5, 0.0, 0.1))
)  # and else of no symmetry
ALIKE = Fourier(
    cos=((0.5, 0.0), (0.5, 0.0)), sin=((0.0, 0.2), (0.0, 0.2))
)  # alpha_1 = alpha_2
OPPOSITE = Fourier(
    cos=((0.5, 0.0), (-0.5, 0.0)), sin=((0.0, 0.2), (0.0, -0.2))
)  # alpha_1 = -alpha_2
SINES = Fourier(
    cos=((0.0, 0.0), (0.0, 0.0)), sin=((0.5, 0.2), (-0.5, 0.2))
)  # backwards their own mirror image
RESTING = Fourier(
    cos=((0.5, 0.0), (0.0, 0.0)), sin=((0.0, 0.0), (0.3, -0.15))
)  # at phase 0, and no retraced path
BACK = Fourier(
    cos=((0.5, 0.3), (0.4, 0.1)), sin=((0.0, 0.0), (0.0, 0.0))
)  # the same path there and back


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
    (HEAD_FOR_TAIL, Traits(reversible=True), []),  # it turns twice as far as in half a cycle
    (ODD, Traits(mirror=True), ["heading"]),
    (ALIKE, BOTH, ["x", "heading"]),
    (OPPOSITE, BOTH, ["x", "y"]),
    (RESTING, Traits(), []),
])  # fmt: skip
def test_zeros_follow_from_traits_and_curve(gait, traits, zero):
    assert (
        [*zero_components(traits, gait, [0.5, 1.0])]
        == [*zero_components(traits, gait)]
        == zero
    )


@pytest.mark.parametrize(("gait", "reasons"), [
    (Butterfly(), {"y": BACKWARDS, "heading": MIRRORED}),
    (ALIKE, {"x": ALWAYS, "heading": BACKWARDS}),
    (OPPOSITE, {"x": ALWAYS, "y": ALWAYS}),
    (SINES, {"x": REFLECTED, "heading": BACKWARDS}),
    (BACK, dict.fromkeys(("x", "y", "heading"), RETRACED)),
])  # fmt: skip
def test_each_zero_has_its_reason(gait, reasons):
    assert zero_components(BOTH, gait) == reasons


@pytest.mark.parametrize("name", SYSTEMS)
def test_displacements_have_the_zeros_that_are_claimed(name):
    system = SYSTEMS[name]
    for gait in GAITS.values():
        if gait.joints != system.joints:
            continue
        small = dataclasses.replace(gait, amplitude=0.5 * gait.amplitude)
        try:
            table = tabled(
                SceneTables(Scene(system, small, name="s")).displacements(
                    [small.amplitude], ["direct"]
                )
            )
        except Refusal:
            continue
        for component in table["zero_by_symmetry"]:
            assert np.abs(table[component]["direct"]).max() < 1e-9 * body_size(system)
