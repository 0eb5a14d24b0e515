"""Tangents against differences, every column: of every law under every rule, every effect, and the mass. A wrong one costs
Newton's method its speed or its answer, and nothing else would say so."""

import numpy as np
import pytest
from registry import BODIES, DRY, EFFECTS, MEDIA
from test_balance import Mud
from test_loads import CubicDrag

from rft import Granular
from rft.effects.base import Here, applied
from rft.inertia import Mass
from rft.loads import Known, element_load
from rft.premise import Premise

LAWS = {**MEDIA, "mud": Mud(), "no closed form": CubicDrag()}
RULES = [(name, how) for name in LAWS for how in ("exact", "gauss:5", "midpoint:4")]
GLASS = Granular(C=1.8, gamma0=0.24)


def assert_is_slope(load, v, rtol=2e-6):
    """load: v (3, n, B) -> (3, 4, n, B), columns 1 to 3 the derivatives of column 0; each row by its own largest slope."""
    h = 1e-6
    tangent = load(v)[:, 1:]
    steps = h * np.eye(3)[:, :, None, None]
    slopes = np.stack([(load(v + step)[:, 0] - load(v - step)[:, 0]) / (2 * h) for step in steps], 1)
    for row, (got, wanted) in enumerate(zip(tangent, slopes)):
        assert np.abs(got - wanted).max() <= rtol * np.abs(wanted).max(), (row, np.abs(got - wanted).max((1, 2)))
    assert (np.abs(slopes).max((2, 3)) > 0).any(1).all()  # every row has something to tell


@pytest.mark.parametrize(("law", "how"), [r for r in RULES if r != ("no closed form", "exact")])
def test_laws(law, how):
    rng = np.random.default_rng(2)
    v, eps, speed = rng.normal(size=(3, 2, 30)), rng.uniform(0.05, 0.2, 30), rng.uniform(0.5, 3, 30)
    load = element_load(LAWS[law], how)
    assert_is_slope(lambda v: load(*v, eps, Known(speed)), v)


def at_one_step(effects, body, medium, samples, rng):
    """(load, body) of effects within a march whose ground, place and past are not those of its start."""
    alpha, alphadot = rng.uniform(-1, 1, (2, body.joints, samples))
    for effect in effects:
        if effect.breaks & (Premise.MEMORYLESS | Premise.SE2_SYMMETRIC):
            body = effect.body(body)
    motion = body.motion(alpha, alphadot)
    turn = np.exp(1j * rng.uniform(-0.5, 0.5, samples))
    scale = rng.uniform(0.5, 2.0, samples)
    here = Here(0.2, motion.place * turn, (motion.c + 1j * motion.s) * turn, motion, 0.4 * motion.v, scale)
    memories = [e.start(len(motion.half), samples) for e in effects]
    for step in (0.12j, -0.12j, 0.0):
        there = here._replace(place=here.place + step)
        memories = [e.after(m, there, rng.normal(size=motion.v.shape)) for e, m in zip(effects, memories)]
    now = [e.at(m, here) for e, m in zip(effects, memories)]
    load, body = applied(now, element_load(medium), medium, body)
    return load, body, scale


@pytest.mark.parametrize("medium", [GLASS, Mud()], ids=["glass", "mud"])
@pytest.mark.parametrize("name", [*EFFECTS, "all"])
def test_effects(name, medium):
    rng, samples = np.random.default_rng(3), 40
    effects = [make(0.4) for make, _ in (EFFECTS.values() if name == "all" else [EFFECTS[name]])]
    if name == "all":
        effects = [e for k, e in enumerate(effects) if type(e) not in {type(x) for x in effects[:k]}]
    if not isinstance(medium, Granular):
        effects = [e for e in effects if type(e).__name__ != "EndCaps"]
    load, body, scale = at_one_step(effects, BODIES["uneven"], medium, samples, rng)
    n = len(body.motion(np.zeros((2, 1)), np.zeros((2, 1))).half)
    v, eps = rng.normal(size=(3, n, samples)), rng.uniform(0.05, 0.2, samples)
    v[0] = np.sign(v[0]) * (0.01 + np.abs(v[0]))  # skin friction steps where an element slides neither way
    assert_is_slope(lambda v: load(*v, eps, Known(scale)), v)
    # Samples in another order have their own memories, places and scales.
    other = rng.permutation(samples)[:7]
    picked = load(*v[..., other], eps[other], Known(scale[other], other))
    np.testing.assert_allclose(picked, load(*v, eps, Known(scale))[..., other], rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("linear", [False, True])
def test_mass(linear):
    rng, body, samples = np.random.default_rng(4), BODIES["uneven"], 12
    mass = Mass(rng.uniform(0.5, 3.0, samples), 0.3)
    scale = rng.uniform(0.5, 2.0, samples)
    motion = body.motion(*rng.normal(size=(2, 2, samples)))
    for _ in range(2):
        mass.moved(motion, rng.normal(size=(3, samples)), scale, rng.normal(size=samples))
    term = mass.term(motion, scale, 1.7, linear)
    index = np.array([3, 0, 7, 11])
    xi = rng.normal(size=(3, samples))[:, index]
    assert_is_slope(lambda x: term(x[:, 0], index)[:, :, None], xi[:, None])


def test_every_dry_law_is_homogeneous():
    """eps dF/d(eps) = -(dF/dv) v: what the descent from one rounding to the next rests on."""
    rng = np.random.default_rng(5)
    v, eps, h = rng.normal(size=(3, 2, 30)), np.full(30, 0.1), 1e-6
    for name, medium in DRY.items():
        load = element_load(medium)
        change = (load(*v, eps + h)[:, 0] - load(*v, eps - h)[:, 0]) / (2 * h)
        along = np.einsum("ijnb,jnb->inb", load(*v, eps)[:, 1:], v)
        np.testing.assert_allclose(eps * change, -along, atol=1e-6 * np.abs(along).max(), err_msg=name)


def test_a_load_alone_takes_velocities_as_they_are():
    """Its speed is 1 and it has all samples, where a law has parts that know them."""
    rng = np.random.default_rng(6)
    v, eps = rng.normal(size=(3, 2, 30)), np.full(30, 0.1)
    load = element_load(Mud())
    np.testing.assert_array_equal(load(*v, eps), load(*v, eps, Known(1.0, np.arange(30))))
    assert np.abs(load(*v, eps, Known(2.0)) - load(*v, eps)).max() > 0.1
