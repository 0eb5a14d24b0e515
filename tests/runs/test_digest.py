"""Digests are those of content: of values and not of where they are."""

import dataclasses
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import pytest

from geomech import scenes
from geomech.mathematics.systems.solver import Solver
from geomech.runs.digest import Undigestible, digest
from geomech.studies.optimisation import build_request
from geomech.studies.scene_tables import SceneTables

VISCOUS = scenes.load("three-link-viscous")
A = np.arange(6.0).reshape(2, 3)


@dataclasses.dataclass(frozen=True)
class Request:
    size: float
    progress: object = dataclasses.field(default=None, compare=False)


class Body:
    def __init__(self, size):
        self.size = size

    @cached_property
    def area(self):
        return self.size**2

    def scaled(self, x):
        return self.size * x


def adder(n):
    return lambda x: x + n


def used(value, attribute):
    """Return a value after one of its attributes has been computed."""
    getattr(value, attribute)
    return value


def used_scene():
    tables = SceneTables(VISCOUS)
    tables.compute_field()
    return tables.scene


AGAIN = scenes.load("three-link-viscous")
EQUAL = {
    "arrays in another order of memory": (A, np.asfortranarray(A)),
    "copies": (A, A.copy()),
    "scenes": (VISCOUS, AGAIN),
    "methods": (VISCOUS.system.velocity, AGAIN.system.velocity),
    "fields that are not compared": (Request(1.0, print), Request(1.0, len)),
    "functions made inside another": (adder(1), adder(1)),
    "sets": ({"a", "b", "c"}, {"c", "b", "a"}),
    "cached properties": (used(Body(2.0), "area"), Body(2.0)),
    "a request that knows its degree": (
        used(build_request(VISCOUS, "displacement"), "degree"),
        build_request(VISCOUS, "displacement"),
    ),
    "a scene with tables": (used_scene(), VISCOUS),
}
OTHER = [
    # numbers and text
    *(0, 0.0, -0.0, False, None, "0", b"0", np.nan, 1, 1 + 1e-15, "1;2", ""),
    # containers
    *((), [], (1,), [1], ((1,), 2), ((1, 2),), (1, 2), [1, 2], slice(1, 2)),
    *({"a": 1}, {"a": 2}, {"b": 1}, {"a"}, Path("a")),
    # arrays
    *(np.zeros(1), np.zeros((1, 1)), np.zeros(1, int), np.zeros(1, np.float32)),
    *(A, A + 1e-15, A[:, :2]),
    # functions
    *(np.sin, np.cos, len, max, np.add.reduce, np.multiply.reduce),
    *(adder, adder(1), adder(2), lambda: 0, lambda: 1),
    *(partial(max, 1), partial(max, 2), partial(max, key=len)),
    # objects and their methods
    *(Body, Request, Request(1.0), Request(2.0), Body(1.0), Body(2.0)),
    *(Body(1.0).scaled, Body(2.0).scaled, VISCOUS.system.velocity),
    *(VISCOUS, VISCOUS.with_numerics(grid=9), VISCOUS.system.power),
    *(VISCOUS.system.in_frame("mean").velocity, Solver(), Solver(backend="numpy")),
]


@pytest.mark.parametrize("name", EQUAL)
def test_equal_contents_have_one_digest(name):
    one, other = EQUAL[name]
    assert digest(one) == digest(other)


def test_other_contents_have_others():
    assert len({digest(x) for x in OTHER}) == len(OTHER)
    assert digest(1, 2) != digest((1, 2))


LOOP = []
LOOP.append(LOOP)


@pytest.mark.parametrize(
    "x", [iter([1]), np.random.default_rng(0), LOOP, (x for x in [1]), [object()]]
)
def test_what_cannot_be_told_is_not_guessed(x):
    with pytest.raises(Undigestible):
        digest(x)
