"""Ratios measured in one run: pytest -m benchmark -s. Nothing here asserts a wall-clock time."""

import math
import time

import numpy as np
import pytest
from scipy.optimize import fsolve

from geomech import connection
from geomech.gaits import Circle
from geomech.tiers.direct import direct
from rft import CATALOGUE, Chain, body_velocity
from rft.vertical import CLeg, Rotate, StressMap, loads

pytestmark = pytest.mark.benchmark
GLASS = CATALOGUE["glass-0.3mm-loose"].medium


def field_samples(points=31, count=8, extent=2.5):
    axis, angle = np.linspace(-extent, extent, points), np.pi * np.arange(count) / count
    alpha = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)[:, :, None]
    return np.broadcast_arrays(alpha, np.stack([np.cos(angle), np.sin(angle)], -1))


TAN2, C = np.tan(np.radians(13.8)) ** 2, 1.8


def one_scipy_solve(alpha, alphadot, segments=20):
    """What a user writes today: midpoint segments in the middle link's frame, Eqs. 2-3 as printed, fsolve."""
    half = 1 / 6
    s = ((np.arange(segments) + 0.5) / segments * 2 - 1) * half
    headings = np.array([-alpha[0], 0.0, alpha[1]])
    turns = np.array([-alphadot[0], 0.0, alphadot[1]])
    t = np.stack([np.cos(headings), np.sin(headings)], -1)[:, None]
    n = np.stack([-t[..., 1], t[..., 0]], -1)
    joints = np.array([[-half, 0.0], [0.0, 0.0], [half, 0.0]])[:, None]
    arms = (s + np.array([-half, 0.0, half])[:, None])[..., None] * t
    place = joints + arms

    def force(xi):
        spin = xi[2] * np.stack([-place[..., 1], place[..., 0]], -1)
        swing = turns[:, None, None] * np.stack([-arms[..., 1], arms[..., 0]], -1)
        v = xi[:2] + spin + swing
        v = v / (np.sqrt((v**2).sum(-1, keepdims=True)) + 1e-12)
        vn, vt = (v * n).sum(-1, keepdims=True), (v * t).sum(-1, keepdims=True)
        f = (1 + C / np.sqrt(TAN2 + vn**2)) * vn * n + vt * t
        moment = place[..., 0] * f[..., 1] - place[..., 1] * f[..., 0]
        return [f[..., 0].sum(), f[..., 1].sum(), moment.sum()]

    return fsolve(force, [0.02, 0.01, 0.1], full_output=True)  # off zero, where a link may stand still


def test_field_against_a_loop_of_fsolve():
    alpha, alphadot = field_samples()
    flat = alpha.reshape(-1, 2), alphadot.reshape(-1, 2)
    some = np.random.default_rng(0).choice(len(flat[0]), 400, replace=False)
    middle = Chain(frame="link-2")
    plain, ours, theirs = [], [], []
    for part in np.split(some, 4):  # in turn, so that both meet the same moods of the machine
        start = time.perf_counter()
        solution = body_velocity(GLASS, middle, *flat)
        plain.append((time.perf_counter() - start) / len(flat[0]))
        start = time.perf_counter()
        connection.fit(lambda a, d: body_velocity(GLASS, middle, a, d).xi, connection.grid(2), 8, mirror=True)
        ours.append((time.perf_counter() - start) / len(flat[0]))
        start = time.perf_counter()
        answers = [one_scipy_solve(flat[0][i], flat[1][i]) for i in part]
        theirs.append((time.perf_counter() - start) / len(part))
    flags = np.array([a[2] == 1 for a in answers])
    off = np.abs(np.array([a[0] for a in answers]) - solution.xi[part]).max(-1)
    ratio, ratio_plain = (np.median(theirs) / np.median(x) for x in (ours, plain))
    us = {k: 1e6 * np.median(v) for k, v in (("field", ours), ("plain", plain), ("loop", theirs))}
    failed, wrong = 100 * np.mean(~flags), 100 * np.mean(off > 0.01)
    print(f"\n31 x 31 x 8 loose glass at exact integrals: {us['field']:.1f} us a sample (half by mirror symmetry),")
    print(f"  {us['plain']:.1f} us with every sample solved; all converged")
    print(f"fsolve, 20 midpoints a link: {us['loop']:.0f} us a sample; says it failed in {failed:.0f} %,")
    print(f"  is off by more than 0.01 in {wrong:.0f} %")
    print(f"ratio {ratio:.0f} for the field, {ratio_plain:.0f} with every sample solved")
    assert (solution.status != "unconverged").all()
    assert ratio > 200


def test_direct_tier_of_a_circle_to_four_digits():
    """One circle at the fewest phases that bring it within 1e-4 body lengths of the truth."""
    swimmer = lambda a, d: body_velocity(GLASS, Chain(), a, d).xi
    for radius in (0.5, 1.0, 1.75):
        gait, n = Circle(amplitude=radius), 16
        truth = direct(swimmer, gait, phases=4096)
        while np.linalg.norm(direct(swimmer, gait, phases=n) - truth) > 1e-4:
            n *= 2
        times = []
        for _ in range(20):
            start = time.perf_counter()
            direct(swimmer, gait, phases=n)
            times.append(time.perf_counter() - start)
        print(f"\ncircle of {radius} rad to 1e-4: {n} phases, {1e3 * np.median(times):.1f} ms", end="")
        assert n <= 128


def one_leg_pose(leg, coefficients, pose, twist):
    """Force on a leg the usual way: a loop over midpoints, each with its angles."""
    A00, A10, B11, B01, Bm11, C11, C01, Cm11, D10 = coefficients
    total, cos, sin = np.zeros(2), math.cos(pose[2]), math.sin(pose[2])
    for (x, z), (n_x, n_z), length in zip(leg.midpoints, leg.normals, leg.lengths):
        x, z, n_x, n_z = cos * x + sin * z, cos * z - sin * x, cos * n_x + sin * n_z, cos * n_z - sin * n_x
        depth = -(pose[1] + z)
        if depth <= 0:
            continue
        b, g = math.atan2(n_x, -n_z), math.atan2(-twist[1] + twist[2] * x, twist[0] + twist[2] * z)
        b, back = b - math.pi * round(b / math.pi), abs(g) > math.pi / 2
        if back:
            b, g = -b, math.copysign(math.pi, g) - g
        a_z = A00 + A10 * math.cos(2 * b) + B11 * math.sin(2 * b + g) + B01 * math.sin(g) + Bm11 * math.sin(g - 2 * b)
        a_x = C11 * math.cos(2 * b + g) + C01 * math.cos(g) + Cm11 * math.cos(g - 2 * b) + D10 * math.sin(2 * b)
        total += 1e6 * depth * length * leg.width * np.array([a_x if back else -a_x, a_z])
    return total


def test_a_leg_at_360_angles():
    """100 elements, against a loop over them."""
    leg, numbers = CLeg(0.038, 0.025).outline(100), (0.206, 0.169, 0.212, 0.358, 0.055, -0.124, 0.253, 0.007, 0.088)
    _, pose, twist = Rotate(hub_height=0.02, samples=360).course(leg)
    ours, theirs = [], []
    for _ in range(5):
        start = time.perf_counter()
        found = loads(StressMap(), leg, pose, twist)
        ours.append(time.perf_counter() - start)
        start = time.perf_counter()
        force = [one_leg_pose(leg, numbers, *at) for at in zip(pose, twist)]
        theirs.append(time.perf_counter() - start)
    off = np.abs(force - found.force).max() / np.abs(found.force).max()
    print(
        f"\nleg of 100 elements at 360 angles: {1e3 * min(ours):.1f} ms, a loop {min(theirs) / min(ours):.0f} times as long"
    )
    assert off < 2e-3
    assert min(theirs) > 15 * min(ours)
