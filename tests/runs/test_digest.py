"""Digests are those of content: of values and not of where they are, and of nothing that is left out."""

import dataclasses
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import pytest

from geomech import scenes
from geomech.mathematics.systems.solver import Solver
from geomech.run.digest import Undigestible, digest
from geomech.studies.estimates.effort import _RecordedVelocity
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


EQUAL = {
    "arrays in another order of memory": (A, np.asfortranarray(A)),
    "copies": (A, A.copy()),
    "scenes": (VISCOUS, scenes.load("three-link-viscous")),
    "methods": (
        VISCOUS.system.velocity,
        scenes.load("three-link-viscous").system.velocity,
    ),
    "what takes no part in comparisons": (Request(1.0, print), Request(1.0, len)),
    "functions made inside another": (adder(1), adder(1)),
    "sets": ({"a", "b", "c"}, {"c", "b", "a"}),
}
OTHER = [
    *(
        0,
        0.0,
        -0.0,
        False,
        None,
        "0",
        b"0",
        (),
        [],
        "",
        np.nan,
        1,
        1 + 1e-15,
        (1,),
        [1],
        ((1,), 2),
        ((1, 2),),
        "1;2",
    ),
    *(
        np.zeros(1),
        np.zeros((1, 1)),
        np.zeros(1, int),
        np.zeros(1, np.float32),
        A,
        A + 1e-15,
        A[:, :2],
    ),
    *(
        {"a": 1},
        {"a": 2},
        {"b": 1},
        {"a"},
        Path("a"),
        slice(1, 2),
        np.sin,
        np.cos,
        len,
        max,
        Body,
        Request,
    ),
    *(
        Request(1.0),
        Request(2.0),
        Body(1.0),
        Body(2.0),
        Body(1.0).scaled,
        Body(2.0).scaled,
        adder,
        adder(1),
        adder(2),
    ),
    *(
        lambda: 0,
        lambda: 1,
        partial(max, 1),
        partial(max, 2),
        partial(max, key=len),
        np.add.reduce,
        np.multiply.reduce,
    ),
    *(
        VISCOUS,
        VISCOUS.with_numerics(grid=9),
        VISCOUS.system.velocity,
        VISCOUS.system.in_frame("mean").velocity,
    ),
    *(
        Solver(),
        Solver(backend="numpy"),
        VISCOUS.system.power,
        _RecordedVelocity(VISCOUS.system, []),
    ),
]


@pytest.mark.parametrize("name", EQUAL)
def test_equal_contents_have_one_digest(name):
    assert digest(EQUAL[name][0]) == digest(EQUAL[name][1])


def test_other_contents_have_others():
    assert len({digest(x) for x in OTHER}) == len(OTHER)
    assert digest(1, 2) != digest((1, 2)) != digest([1, 2])


def test_what_an_object_remembers_is_no_part_of_it():
    body, fresh = Body(2.0), Body(2.0)
    assert body.area == 4.0 and digest(body) == digest(fresh)
    driven = _RecordedVelocity(VISCOUS.system, [])
    driven.receive(A)
    assert digest(driven) == digest(_RecordedVelocity(VISCOUS.system, []))
    request = build_request(VISCOUS, "displacement")
    before = digest(request)
    assert request.degree == 2.0 and digest(request) == before
    study = SceneTables(VISCOUS).in_frame("minimum-perturbation")
    before = digest(study.scene)
    study.compute_field()
    assert digest(study.scene) == before


def test_what_cannot_be_told_is_not_guessed():
    loop = []
    loop.append(loop)
    for x in (iter([1]), np.random.default_rng(0), loop, (x for x in [1]), [object()]):
        with pytest.raises(Undigestible):
            digest(x)
