"""The built-in scenes: what they say against their sources, and their displacement
pinned to the digits found first and to an independent sum of forces over points, solved
and integrated here from numbers written here."""

import math

import numpy as np
import pytest

from geomech import scenes
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE

pytestmark = pytest.mark.usefixtures("fastest")
# Net (x, y, theta) of a cycle of the scene's own gait by the direct tier at the scene's
# own numerics.
PINNED = {
    "butterfly-glass": (0.267792218, 0.0, 0.0),
    "differential-drive": (0.081690399, -0.264082852, 0.0),
    "no-slip-snake": (0.110055635, 0.0210151860, 0.0),
    "sandfish-close": (0.277242251, -0.0855674831, 0.0),
    "sandfish-heavy": (0.353167793, -0.087359391, 0.0),
    "sandfish-loose": (0.354014795, -0.0870573091, 0.0),
    "sandfish-transient": (0.3207214693, -0.08433930512, 0.0),
    "serpenoid-glass": (0.359597894, 0.0, 0.0),
    "seven-link-modes": (0.249123776, 0.0, 0.0),
    "seven-link-wave": (0.249123776, 0.0, 0.0),
    "shovel-nosed-snake": (0.166277665, -3.38213984e-05, 0.0),
    "three-link-coulomb": (-0.00628353877, -0.000775375048, 0.0),
    "three-link-floating": (0.0, 0.0, -0.25739213),
    "three-link-glass": (0.0634476015, 0.00687549129, 0.0),
    "three-link-glass-close": (0.0420145543, 0.00471086455, 0.0),
    "three-link-ideal-fluid": (-0.274035615, -0.011117928, 0.0),
    "three-link-viscous": (-0.0494990214, 0.0134003664, 0.0),
}


@pytest.mark.parametrize("name", scenes.builtin_names())
def test_displacement_is_pinned(name):
    expected = np.array(PINNED[name])
    # Where drag builds up, 64 phases and pieces of 1 / 100 leave some 1e-3, whose
    # digits are the scheme's.
    fine = 5e-4 if name == "sandfish-transient" else 2e-5
    found = SceneTables(scenes.load(name)).poses("direct")
    np.testing.assert_allclose(found, expected, atol=fine * np.abs(expected).max())


def test_constants_of_the_scenes():
    """What a displacement shows only weakly: the mass of Sec. II C, and a fifth of the
    wave's amplitude (Sec. IV A)."""
    _, mass = scenes.load("sandfish-heavy").system.effects
    assert (mass.mass, mass.frequency, mass.length, mass.drag) == (0.016, 3.0, 0.1, 2.1)
    inertia = 0.016 * 0.1 * (6 * math.pi) ** 2 / 2.1
    assert mass.inertia == pytest.approx(inertia, rel=1e-12)
    # Eq. 2: 2 k rho g r |z| L with the numbers beside it in the scene.
    drag = 2 * 2.5 * 1450 * 9.81 * 0.006 * 0.05 * 0.1
    assert mass.drag == pytest.approx(drag, rel=0.02)
    skin = scenes.load("shovel-nosed-snake").system.effects[
        0
    ]  # it slides forwards only
    assert (skin.forward, skin.backward, skin.reference) == (0.109, 0.137, 0.15)
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
CLOSE = granular(0.77 / 0.59, 12.21)
GRAINS = granular(1.49, 12.6)
COULOMB = granular(0.0, 10.0)


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
    return np.array([np.cos(t), np.sin(t)])


def clockwise(t):
    return circle(-t)


def butterfly(t):
    both = 1.0908 * np.cos(t) - 0.2508 * np.cos(3 * t) - 0.18 * np.cos(5 * t)
    one = 1.052 * np.sin(t) + 0.0859 * np.sin(3 * t)
    return np.array([both + one, both - one])


# name: law, headings(t), law of the head if it has one, link that carries the frame or
# None for the mean
INDEPENDENT = {
    "three-link-glass": (LOOSE, three_links(clockwise), None, None),
    "three-link-glass-close": (CLOSE, three_links(clockwise), None, None),
    "three-link-coulomb": (COULOMB, three_links(clockwise), None, None),
    "three-link-viscous": (viscous, three_links(circle), None, 1),
    "butterfly-glass": (LOOSE, three_links(butterfly), None, None),
    "serpenoid-glass": (LOOSE, serpenoid(6.0, 40), None, None),
    "sandfish-loose": (LOOSE, sine(0.22, 1.0, 100), head(0.06, 1.8, 13.8), None),
    "sandfish-close": (
        CLOSE,
        sine(0.22, 1.0, 100),
        head(0.06, 0.77 / 0.59, 12.21),
        None,
    ),
    "seven-link-modes": (GRAINS, serpenoid(7 * 0.87, 7), None, None),
    "seven-link-wave": (GRAINS, serpenoid(7 * 0.87, 7), None, None),
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
    """Net (x, y, theta) over a cycle: Newton with a Jacobian by differences at every
    phase, rounding off ever less."""
    t = 2 * np.pi * np.arange(phases) / phases
    points = max(2, points // headings(t).shape[1])
    before, _ = moving(headings, t - 1e-4, frame, points)
    place, along = moving(headings, t, frame, points)
    after, _ = moving(headings, t + 1e-4, frame, points)
    own = (after - before) / 2e-4

    def force(law, v, eps):
        a, u = law(v.real, v.imag, eps)
        return a + 1j * u

    def net(xi, eps):
        x, y, turn = xi[:, :, None]
        v = (own + x + 1j * y + 1j * turn * place) * along.conj()
        f = force(law, v, eps) / (place.shape[1] - 1)
        f[:, -1] = force(cap, v[:, -1], eps) if cap else 0
        f = f * along
        return np.stack([f.real.sum(1), f.imag.sum(1), (place.conj() * f).imag.sum(1)])

    xi = np.zeros((3, phases))
    for eps in np.geomspace(1.0, 1e-4, 6):
        for _ in range(12):
            f = net(xi, eps)
            d = 1e-3 * eps
            columns = [(net(xi + d * e[:, None], eps) - f) / d for e in np.eye(3)]
            jacobians = np.stack(columns, 1).transpose(2, 0, 1)
            step = -np.linalg.solve(jacobians, f.T[..., None])[..., 0].T
            part = np.ones(phases)
            for _ in range(8):
                worse = np.abs(net(xi + part * step, eps)).max(0) > np.abs(f).max(0)
                part = np.where(worse, part / 2, part)
                if not worse.any():
                    break
            xi = xi + part * step
            if np.abs(f).max() < 1e-9:
                break
    assert np.abs(f).max() < 1e-6, "this sum found no balance of its own"
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
    expected = np.array(PINNED[name])
    points = 600 if name == "three-link-coulomb" else 240
    found = independent(*INDEPENDENT[name], phases=64, points=points)
    np.testing.assert_allclose(found, expected, atol=3e-3 * np.abs(expected).max())
