"""Stated limits of parameters, taken at the limit, refused next to it; and stated
defaults."""

import dataclasses
import functools
import math

import frozen
import numpy as np
import pytest
from loads import element_load
from registry import GAITS

from geomech.mathematics.gaits import Butterfly, Circle, Ellipse, Points, Sine
from geomech.mathematics.geometry import connection, family
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.representations.field import Field
from geomech.questions.measured.fit_gait import FitGait
from geomech.studies.optimisation.local.objectives import Objective
from rft import (
    Backbone,
    BodyInertia,
    Chain,
    ConstantCurvature,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    Granular,
    Serpenoid,
    SkinFriction,
    TowedSled,
    Transient,
    Viscous,
    body_velocity,
)
from rft.laws.drag import Rod
from rft.mujoco.media import sample
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.meshes.surfaces.shapes import leg
from rft.terradynamics.plates import CLeg
from rft.terradynamics.walking import Rhex
from rft.terradynamics.walking.spatial.facets import Grains

TRIAL = frozen.FOLDER / "trial.csv"
pytestmark = pytest.mark.filterwarnings("ignore::geomech.core.errors.UnitWarning")


def still(alpha, alphadot):
    return np.zeros((*np.broadcast_shapes(alpha.shape, alphadot.shape)[:-1], 3))


def having(kind, name, **others):
    return lambda x: kind(**others | {name: x})


def solved(name):
    return lambda x: body_velocity(
        Viscous(), Chain(), [0.1, 0.2], [1.0, 0.0], **{name: x}
    )


FAMILY = family.fit(still, Circle(), 2.0, 4, 8)
GRAINS = {"frequency": 1.0, "length": 1.0, "depth": 1.0}
MASS = {"mass": 1e-9, "frequency": 1e-3, "length": 1e-3, "drag": 1e3}
ROBOT = functools.partial(Rhex, 0.15, 0.13, 0.03, 0.05, CLeg(0.02, 0.01))
LEAST, NEXT_TO_RIGHT = math.ulp(0.0), math.nextafter(math.pi / 2, 0)
NUMBERS = [
    # what, made of the number, the least and the largest that is taken; None: tested
    # elsewhere
    ("chain length", having(Chain, "length"), 1e-15, 1e15),
    ("waves", having(Serpenoid, "waves", elements=24), LEAST, 6.0),
    ("C", having(Granular, "C", gamma0=0.2), 0.0, 1e6),
    ("gamma0", having(Granular, "gamma0", C=1.0), LEAST, NEXT_TO_RIGHT),
    (
        "ratio",
        lambda x: body_velocity(Viscous(x), Chain(), [1.0, 0.2], [1.0, 0.3]),
        1e-8,
        1e8,
    ),
    *(
        (name, having(SkinFriction, name), 1e-3, 100.0)
        for name in ("forward", "backward", "reference")
    ),
    ("cap radius", having(EndCaps, "radius"), 0.0, 1.0),
    *(
        (name, having(EndCaps, name, radius=0.1), 0.0, 100.0)
        for name in ("head", "tail")
    ),
    ("frequency", having(GrainInertia, "frequency", **GRAINS), 0.0, 1e4),
    *(
        (name, having(GrainInertia, name, **GRAINS), 1e-9, 1e6)
        for name in ("length", "depth")
    ),
    ("strength", having(GrainInertia, "strength", **GRAINS), 0.0, 1e6),
    ("mass", having(BodyInertia, "mass", **MASS), 0.0, 1e9),
    ("mass's frequency", having(BodyInertia, "frequency", **MASS), 0.0, 1e4),
    ("mass's length", having(BodyInertia, "length", **MASS), 1e-9, 1e6),
    ("mass's drag", having(BodyInertia, "drag", **MASS), 1e-12, 1e12),
    ("slope", having(DepthProfile, "slope"), 0.0, 1000.0),
    ("depth", lambda x: DepthProfile(along=(1.0, x)), LEAST, 1000.0),
    ("towards", having(DepthProfile, "towards", slope=1.0), -1e6, 1e6),
    ("ground's radius", having(DisturbedGround, "radius", weakening=0.5), 0.01, 0.25),
    ("weakening", having(DisturbedGround, "weakening", radius=0.1), 0.0, 1.0),
    ("travel", having(Transient, "travel"), 0.0, 10.0),
    ("pull", having(TowedSled, "pull"), 0.0, 1000.0),
    ("distance", having(TowedSled, "distance", pull=0.1), 0.0, 10.0),
    ("regularisation", solved("regularisation"), 1e-15, 1e3),
    ("tolerance", solved("tolerance"), 1e-15, 1e3),
    ("gait's amplitude", having(Circle, "amplitude"), -1e6, 1e6),
    ("amplitudes", lambda x: Circle().shape(0.0, [x]), -1e6, 1e6),
    ("semi-axis", lambda x: Ellipse(semi_axes=(1.0, x)), -1e6, 1e6),
    ("sine's amplitude", having(Sine, "amplitude"), -10.0, 10.0),
    ("sine's amplitudes", lambda x: Sine(elements=4).shape(0.0, [x]), -10.0, 10.0),
    ("sine's waves", having(Sine, "waves", elements=12), LEAST, 3.0),
    ("extent", lambda x: connection.grid(2, 4, x), 1e-9, 1e6),
    (
        "family's amplitude",
        lambda x: family.fit(still, Circle(), x, 4, 8),
        1e-300,
        None,
    ),
    ("off the family", FAMILY.area, 0.0, None),
    ("hip", lambda x: ROBOT(hips=(0.0, x)), -0.13, 0.13),
    ("leg's distance", lambda x: ROBOT(hips=(0.0, 0.1), aside=(0.03, x)), 0.0, 10.0),
    ("grains' density", lambda x: Spatial.from_grains(x, 0.5), 1.0, 1e5),
    ("grains' friction", lambda x: Spatial.from_grains(1500.0, x), 0.05, 1.5),
    ("spread of media", lambda x: sample(Spatial(3e5), 1, spread=x), 0.0, 2.0),
    *(
        (f"rod's {name}", having(Rod, name), 1e-9, 1e3)
        for name in ("radius", "length", "depth")
    ),
    ("rod's density", having(Rod, "density"), 1e-9, 1e6),
    ("curvature of a leg", lambda x: leg(0.1, x, 1e-3, 0.02, 2, 2, 1), -1.0, 1.0),
    ("width of a leg", lambda x: leg(0.1, 0.5, 1e-3, x, 2, 2, 1), 1e-6, 1e3),
    *(
        (
            f"objective's {name}",
            having(functools.partial(Objective, "speed"), name),
            1e-9,
            1e9,
        )
        for name in ("rate", "power")
    ),
    (
        "body length of midlines",
        lambda x: FitGait(TRIAL, body_length=x).check(),
        1e-9,
        1e9,
    ),
    *(
        (f"grains' {name}", having(Grains, name, law=Spatial(3e5)), 0.0, 1e9)
        for name in ("strength", "flux")
    ),
    ("grains' rounding", having(Grains, "rounding", law=Spatial(3e5)), 1e-7, 10.0),
]
COUNTS = [
    # what, made of the number, its least and its largest; None: no limit of its own
    ("links", lambda n: Chain((1.0,) * n), 2, None),
    ("frame", lambda n: Chain(frame=f"link-{n}"), 1, 3),
    ("elements", lambda n: Backbone(elements=n), 3, 2000),
    ("sine's elements", lambda n: Sine(elements=n, waves=0.5), 3, 2000),
    ("sections", lambda n: ConstantCurvature(elements=12, sections=n), 1, None),
    ("depths", lambda n: DepthProfile(along=(1.0,) * n), 2, None),
    (
        "pieces",
        lambda n: body_velocity(Viscous(), Chain(), [0.1, 0.2], [1.0, 0.0], pieces=n),
        1,
        10_000,
    ),
    ("midpoints", lambda n: element_load(Viscous(), f"midpoint:{n}"), 1, 1000),
    ("grid", lambda n: connection.grid(2, n), 4, None),
    ("directions, one joint", lambda n: connection.directions(1, n), 1, None),
    ("directions, two joints", lambda n: connection.directions(2, n), 2, None),
    ("directions, three joints", lambda n: connection.directions(3, n), 12, None),
    (
        "points of a spline",
        lambda n: connection.fit(still, (np.arange(float(n)),), degree=5),
        6,
        None,
    ),
    (
        "directions of harmonics",
        lambda n: harmonics.fit(still, connection.grid(2, 4), n, highest=5),
        6,
        None,
    ),
    ("curves", lambda n: family.fit(still, Circle(), 1.0, n, 8), 4, None),
    ("phases", lambda n: Circle().cycle(n), 4, None),
    ("phases of the butterfly", lambda n: Butterfly().cycle(n), 11, None),
    ("hips", lambda n: ROBOT(hips=(0.05,) * n), 1, 20),
    (
        "degree of a fit",
        lambda n: connection.fit(still, (np.arange(9.0),), degree=n),
        1,
        5,
    ),
    ("degree of a field", lambda n: Field((np.arange(9.0),), np.zeros(9), n), 0, 5),
    (
        "axis of a field",
        Field((np.arange(4.0),) * 2, np.zeros((4, 4))).derivative,
        0,
        1,
    ),
    ("media", lambda n: sample(Spatial(3e5), n, spread=0.1), 1, None),
    ("quadrilaterals of a leg", lambda n: leg(0.1, 0.5, 1e-3, 0.02, n, 1, 1), 2, 4096),
    (
        "points of a gait",
        lambda n: Points(points=tuple((k, k * k) for k in range(n))),
        3,
        None,
    ),
]


def ends(rows, below, above):
    """Yield what is made, its last number and the next one, at both ends of each
    row."""
    for name, make, least, most in rows:
        yield pytest.param(make, least, below(least), id=f"{name}, least")
        if most is not None:
            yield pytest.param(make, most, above(most), id=f"{name}, most")


LIMITS = [
    *ends(
        NUMBERS,
        below=lambda x: math.nextafter(x, -math.inf),
        above=lambda x: math.nextafter(x, math.inf),
    ),
    *ends(COUNTS, below=lambda n: n - 1, above=lambda n: n + 1),
]


@pytest.mark.parametrize(("make", "taken", "refused"), LIMITS)
def test_a_number_is_taken_at_its_limit_and_refused_next_to_it(make, taken, refused):
    make(taken)
    with pytest.raises(ValueError):  # noqa: PT011 (other tests see what it says)
        make(refused)


@pytest.mark.parametrize(
    ("make", "taken", "refused"),
    [
        (lambda x: Chain((x / 4, x / 4)), 1.999e100, 2.001e100),
        (lambda x: Chain((1.0, x)), 1.000001e-12, 0.999999e-12),
        (FAMILY.area, 2.0 * (1 + 1e-13), 2.0 * (1 + 1e-11)),
        (
            lambda x: Points(points=((0, 0), (x, 0), (0.5, 0), (0.5, 0.5))),
            1.8e-12,
            1.6e-12,
        ),
        (
            lambda x: BodyInertia(
                mass=x, frequency=1.0, length=1.0, drag=(2 * math.pi) ** 2
            ),
            0.999999e6,
            1.000001e6,
        ),
    ],
    ids=[
        "sum of lengths",
        "shortest link",
        "amplitude of a family",
        "distance of points",
        "inertia",
    ],
)
def test_limits_of_what_follows_from_numbers(make, taken, refused):
    make(taken)
    with pytest.raises(ValueError):  # noqa: PT011
        make(refused)


@pytest.mark.parametrize(
    "bad",
    [{"amplitude": math.nan}, {"centre": (1.0,)}, {"centre": (math.inf, 0.0)}],
    ids=["amplitude", "joints", "centre"],
)
@pytest.mark.parametrize("gait", [*GAITS.values(), Sine()], ids=[*GAITS, "sine"])
def test_every_gait_has_one_centre_and_one_amplitude(gait, bad):
    with pytest.raises(ValueError, match="amplitude|centre"):
        dataclasses.replace(gait, **bad)
