"""The built-in scenes: what they say against their sources, and their displacement
against an independent sum of forces over points, solved and integrated here from
numbers written here."""

import math

import numpy as np
import pytest
from scipy.optimize import root

from geomech import scenes
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE

pytestmark = pytest.mark.usefixtures("fastest")


def test_constants_of_the_scenes():
    """What a displacement shows only weakly: the mass of Sec. II C, and a fifth of the
    wave's amplitude (Sec. IV A)."""
    _, mass = scenes.load("sandfish-heavy").system.effects
    inertia = 0.016 * 0.1 * (6 * math.pi) ** 2 / 2.1
    assert mass.inertia == pytest.approx(inertia, rel=1e-12)
    # Eq. 2: 2 k rho g r |z| L with the numbers beside it in the scene.
    drag = 2 * 2.5 * 1450 * 9.81 * 0.006 * 0.05 * 0.1
    assert mass.drag == pytest.approx(drag, rel=0.02)
    slowed = scenes.load("sandfish-transient")
    wave = 0.22 * float(slowed.gait.wavelength())
    assert slowed.system.effects[1].travel == pytest.approx(wave / 5, rel=0.01)


# C and tan^2(gamma0) of Eq. 3; axial stress, Pa; drag across over that along, where it
# is not 1.
CONSTANTS = {
    "glass-0.3mm-loose": (1.8, math.tan(math.radians(13.8)) ** 2, 2710.0),
    "glass-0.3mm-loose-fitted": (0.5108 / 0.2770, 4.0587**-2, 2770.0),
    "glass-0.3mm-close": (0.77 / 0.59, math.tan(math.radians(12.21)) ** 2, 5900.0),
    "glass-0.3mm-surface": (0.198, 0.00389, None, 0.15 / 0.017),
    "coulomb": (0.0, 1.0, None),
}


@pytest.mark.parametrize("name", [*CATALOGUE])
def test_constants_of_the_catalogue(name):
    medium = CATALOGUE[name].medium
    sine = np.array([1e-3, 0.1, 0.5, 1.0])
    cosine = np.sqrt(1 - sine**2)
    if name == "viscous-2":
        np.testing.assert_allclose(medium.traction(cosine, sine), [cosine, 2 * sine])
        return
    first, tan2, stress, *across = CONSTANTS[name]
    f_t, f_n = medium.traction(7 * cosine, 7 * sine)
    enhanced = math.prod(across) * (1 + first / np.sqrt(tan2 + sine**2)) * sine
    np.testing.assert_allclose(f_n, enhanced, rtol=1e-13)
    np.testing.assert_allclose(f_t, cosine, rtol=1e-13)
    assert CATALOGUE[name].axial_stress == stress


def granular(C, gamma0_deg):
    """Eq. 3 with its square root: drag along and across at velocity (a, u), rounded off
    below the speed eps."""
    tan2 = math.tan(math.radians(gamma0_deg)) ** 2

    def law(a, u, eps):
        speed = np.sqrt(a * a + u * u + eps * eps)
        a, u = a / speed, u / speed
        return a, (1 + C / np.sqrt(tan2 + u * u)) * u

    return law


LOOSE = granular(1.8, 13.8)


def viscous(a, u, eps):
    return a, 2 * u


def head(radius, C, gamma0_deg):
    """Drag along and across on a flat end: pi r^2 C_S sin(atan(cot gamma0 cos psi)), pi
    r^2 C_F sin psi, C_S / C_F = C, in units of the body's own 2 r L C_F."""
    cot = 1 / math.tan(math.radians(gamma0_deg))
    part = math.pi * radius / 2

    def law(a, u, eps):
        speed = np.sqrt(a * a + u * u + eps * eps)
        return part * C * np.sin(np.arctan(cot * a / speed)), part * u / speed

    return law


def snake_skin(a, u, eps):
    along, across = LOOSE(a, u, eps)
    return along * np.where(a > 0, 0.109, 0.137) / 0.15, across


def three_links(alpha):
    """(t -> headings (P, 3)) of links joined at alpha(t) = (alpha_1, alpha_2)."""

    def headings(t):
        return np.stack([0 * t, *np.cumsum(alpha(t), 0)], -1)

    return headings


def sine(ratio, waves, elements):
    """Headings of equal pieces of a body along y = A sin(k x), A / lambda = ratio, that
    moves on along it towards +x."""
    p = np.linspace(-1, waves + 2, 40001) * 2 * np.pi
    slope = 2 * np.pi * ratio
    steps = np.sqrt(1 + (slope * np.cos((p[1:] + p[:-1]) / 2)) ** 2) * np.diff(p)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    a_wave = arc[-1] / (waves + 3)
    s = waves * (np.arange(elements) + 0.5) / elements

    def headings(t):
        places = (s + t[:, None] / (2 * np.pi) + 1) * a_wave
        return np.arctan(slope * np.cos(np.interp(places, arc, p)))

    return headings


def serpenoid(size, elements):
    """Curvature x length = size (cos t cos 2 pi s - sin t sin 2 pi s): a circle run
    clockwise."""
    s = np.arange(1, elements) / elements

    def headings(t):
        bends = size * np.cos(2 * np.pi * s + t[:, None]) / elements
        return np.concatenate([0 * t[:, None], np.cumsum(bends, -1)], -1)

    return headings


def circle(t):
    """Of viscous fluid; that of sand runs clockwise."""
    return np.array([np.cos(t), np.sin(t)])


def butterfly(t):
    both = 1.0908 * np.cos(t) - 0.2508 * np.cos(3 * t) - 0.18 * np.cos(5 * t)
    one = 1.052 * np.sin(t) + 0.0859 * np.sin(3 * t)
    return np.array([both + one, both - one])


# name: law, headings(t), law of the head if it has one, link that carries the frame or
# None for the mean
INDEPENDENT = {
    "three-link-coulomb": (
        granular(0.0, 10.0),
        three_links(lambda t: circle(-t)),
        None,
        None,
    ),
    "three-link-viscous": (viscous, three_links(circle), None, 1),
    "butterfly-glass": (LOOSE, three_links(butterfly), None, None),
    "serpenoid-glass": (LOOSE, serpenoid(6.0, 40), None, None),
    "sandfish-close": (
        granular(0.77 / 0.59, 12.21),
        sine(0.22, 1.0, 100),
        head(0.06, 0.77 / 0.59, 12.21),
        None,
    ),
    "seven-link-modes": (granular(1.49, 12.6), serpenoid(7 * 0.87, 7), None, None),
    "shovel-nosed-snake": (
        snake_skin,
        sine(0.2, 3.5, 140),
        head(0.014, 1.8, 13.8),
        None,
    ),
}


def moving(headings, t, frame, points):
    """Places and directions (P, n) of points along the body as complex numbers in its
    frame, and of its head's tip last."""
    heading = headings(t)
    n = heading.shape[1]

    def middle(x):
        return (x.mean(1) if frame is None else x[:, frame])[:, None]

    heading = heading - middle(heading)
    ends = np.concatenate([0 * t[:, None], np.cumsum(np.exp(1j * heading) / n, 1)], 1)
    ends = ends - middle((ends[:, 1:] + ends[:, :-1]) / 2)
    share = (np.arange(points) + 0.5) / points
    place = (ends[:, :-1, None] + share * np.diff(ends)[:, :, None]).reshape(len(t), -1)
    along = np.repeat(np.exp(1j * heading), points, 1)
    place = np.concatenate([place, ends[:, -1:]], 1)
    return place, np.concatenate([along, along[:, -1:]], 1)


def independent(law, headings, cap, frame, phases, points):
    """Net (x, y, theta) over a cycle: a root of the forces at every phase, rounding off
    ever less."""
    t = 2 * np.pi * np.arange(phases) / phases
    points = max(2, points // headings(t).shape[1])
    before, _ = moving(headings, t - 1e-4, frame, points)
    places, directions = moving(headings, t, frame, points)
    after, _ = moving(headings, t + 1e-4, frame, points)
    own = (after - before) / 2e-4

    def net(xi, k, eps):
        x, y, turn = xi
        v = (own[k] + x + 1j * y + 1j * turn * places[k]) * directions[k].conj()
        along, across = law(v.real, v.imag, eps)
        f = (along + 1j * across) / (len(v) - 1)
        f[-1] = complex(*cap(v[-1].real, v[-1].imag, eps)) if cap else 0
        f = f * directions[k]
        return [f.real.sum(), f.imag.sum(), (places[k].conj() * f).imag.sum()]

    xi = np.zeros((3, phases))
    for k in range(phases):
        for eps in np.geomspace(1.0, 1e-4, 6):
            solution = root(net, xi[:, k], args=(k, eps))
            xi[:, k] = solution.x
        assert np.abs(solution.fun).max() < 1e-6, "this sum found no balance of its own"
    return around(xi, 2 * np.pi / phases)


def around(xi, dt):
    """Pose (3,) at the end of a cycle of velocities (3, P), by the trapezoidal rule."""
    x = np.concatenate([xi, xi[:, :1]], 1)
    theta = np.concatenate([[0.0], np.cumsum((x[2, 1:] + x[2, :-1]) / 2 * dt)])
    flow = (x[0] + 1j * x[1]) * np.exp(1j * theta)
    z = ((flow[1:] + flow[:-1]) / 2 * dt).sum()
    return np.array([z.real, z.imag, theta[-1]])


@pytest.mark.parametrize("name", INDEPENDENT)
def test_displacement_by_an_independent_sum(name):
    found = SceneTables(scenes.load(name)).poses("direct")
    points = 600 if name == "three-link-coulomb" else 240
    expected = independent(*INDEPENDENT[name], phases=64, points=points)
    np.testing.assert_allclose(found, expected, atol=3e-3 * np.abs(expected).max())
