"""Tangents against differences, every column: of every law under every rule, every
effect, and the mass. A wrong one costs Newton's method its speed or its answer, and
nothing else would say so."""

import numpy as np
import pytest
from loads import as_array, element_load
from registry import BODIES, EFFECTS, MEDIA
from test_balance import Mud
from test_loads import CubicDrag

from rft import Granular
from rft.balance.arrays import loads
from rft.effects.base import Site, stepwise_effects
from rft.effects.contact import assemble

LAWS = {**MEDIA, "mud": Mud(), "no closed form": CubicDrag()}
RULES = [(name, how) for name in LAWS for how in ("exact", "gauss:5", "midpoint:4")]
GLASS = Granular(C=1.8, gamma0=0.24)


def assert_is_slope(load, v, rtol=2e-6):
    """load: v (3, n, B) -> (3, 4, n, B), columns 1 to 3 the derivatives of column 0;
    each row by its own largest slope."""
    h = 1e-6
    tangent = load(v)[:, 1:]
    steps = h * np.eye(3)[:, :, None, None]
    slopes = np.stack(
        [(load(v + step)[:, 0] - load(v - step)[:, 0]) / (2 * h) for step in steps], 1
    )
    for k, (got, wanted) in enumerate(zip(tangent, slopes)):
        assert np.abs(got - wanted).max() <= rtol * np.abs(wanted).max(), k
    assert (
        (np.abs(slopes).max((2, 3)) > 0).any(1).all()
    )  # every row has something to tell


@pytest.mark.parametrize(
    ("law", "how"), [r for r in RULES if r != ("no closed form", "exact")]
)
def test_laws(law, how):
    rng = np.random.default_rng(2)
    v, eps = rng.normal(size=(3, 2, 30)), rng.uniform(0.05, 0.2, 30)
    load = element_load(LAWS[law], how)
    assert_is_slope(lambda v: load(*v, eps), v)


def at_one_step(effects, body, medium, samples, rng):
    """The balance with effects within a gait whose ground, place and past are not those
    of its start."""
    assembly = assemble(medium, body, effects)
    stepwise = stepwise_effects(assembly.effects)
    always = assembly._replace(
        effects=tuple(e for e in assembly.effects if e not in stepwise)
    )
    problem = always.problem(*rng.uniform(-1, 1, (2, body.joints, samples)))
    pose = np.stack(
        [*rng.uniform(-0.2, 0.2, (2, samples)), rng.uniform(-0.5, 0.5, samples)]
    )
    site = Site(5, 0.2, pose, tuple(0.4 * problem.sides.elements.v))
    pasts = [e.begin(problem, site) for e in stepwise]
    for count, step in enumerate((0.12, -0.12, 0.0)):
        there = site._replace(
            count=count + 1, pose=pose + np.array([0, step, 0])[:, None]
        )
        v = tuple(rng.normal(size=problem.sides.elements.v.shape))
        pasts = [e.after(problem, there, past, v) for e, past in zip(stepwise, pasts)]
    for effect, past in zip(stepwise, pasts):
        problem = effect.apply(problem, site, past)
    return problem


def loads_on(problem, v, eps):
    """Loads of all elements, those of the sides first, (3, 4, n, B), at true
    velocities."""
    n, scale = len(problem.sides.station), problem.law_speed_scale
    halves = tuple(v[:, :n] / scale), tuple(v[:, n:] / scale)
    found = loads(problem, halves, eps / scale)
    return np.concatenate(
        [as_array(load, part[0]) for (_, load), part in zip(found, halves)], 2
    )


@pytest.mark.parametrize("medium", [GLASS, Mud()], ids=["glass", "mud"])
@pytest.mark.parametrize("name", [*EFFECTS, "all"])
def test_effects(name, medium):
    rng, samples = np.random.default_rng(3), 40
    effects = [
        make(0.4)
        for make, _ in (EFFECTS.values() if name == "all" else [EFFECTS[name]])
    ]
    if name == "all":
        effects = [
            e
            for k, e in enumerate(effects)
            if type(e) not in {type(x) for x in effects[:k]}
        ]
    if not isinstance(medium, Granular):
        effects = [e for e in effects if e.kind not in ("end-caps", "towed-sled")]
    body = BODIES["uneven"]
    effects = [effect.in_metres(body.length) for effect in effects]
    problem = at_one_step(effects, body, medium, samples, rng)
    n = len(problem.sides.station) + len(problem.points.station)
    v, eps = rng.normal(size=(3, n, samples)), rng.uniform(0.05, 0.2, samples)
    v[0] = np.sign(v[0]) * (
        0.01 + np.abs(v[0])
    )  # skin friction steps where an element slides neither way

    def load(v):
        return loads_on(problem, v, eps)

    assert_is_slope(load, v)
    # Samples in another order have their own memories and places.
    other = rng.permutation(samples)[:7]
    picked = loads_on(problem.take(other), v[..., other], eps[other])
    np.testing.assert_allclose(picked, load(v)[..., other], rtol=1e-13, atol=1e-13)
