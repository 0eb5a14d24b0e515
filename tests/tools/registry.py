"""Everything the property tests run over: the examples of all parts, and shapes,
stresses and robots."""

import math
import pathlib

import numpy as np

from geomech.mathematics.gaits import GAITS as kinds_of_gaits
from geomech.mathematics.systems import SYSTEMS as kinds_of_systems
from geomech.mathematics.systems import Table
from rft.bodies import BODIES as kinds_of_bodies
from rft.effects import EFFECTS as kinds_of_effects
from rft.laws import CATALOGUE, LAWS, is_closed
from rft.terradynamics.ground import GROUND_EFFECTS as kinds_of_ground_effects
from rft.terradynamics.ground import Aeration, Slope
from rft.terradynamics.ground import GrainInertia as GrainPressure
from rft.terradynamics.meshes import Cylinder, Leg, Screw, Sphere
from rft.terradynamics.plates import (
    VERTICAL,
    CLeg,
    FlatLeg,
    HalfCylinder,
    Plate,
    PlateDrags,
    Polygon,
    RoundRod,
    Spline,
    SquareRod,
    StressMap,
    Wheel,
)
from rft.terradynamics.walking import Rhex, Roller, Tripod, Walker

DATA = pathlib.Path(__file__).parents[1] / "data"

MEDIA = {name: entry.medium for name, entry in CATALOGUE.items()} | LAWS.examples()
CLOSED = {k: m for k, m in MEDIA.items() if is_closed(m)}  # exact integrals over a link
LINEAR = {k: m for k, m in CLOSED.items() if not m.dry}
DRY = {k: m for k, m in MEDIA.items() if k not in LINEAR}

BODIES = kinds_of_bodies.examples()
GAITS = kinds_of_gaits.examples()
SYSTEMS = kinds_of_systems.examples() | {
    "table": Table(DATA / "uneven.nc")
}  # of the swimmer; the file has its scene

# Stress maps and outlines of the vertical plane.
PLATES = np.radians(
    np.meshgrid(np.arange(-60, 91, 30), np.arange(-90, 91, 30))
).reshape(2, -1)
STRESSES = {
    **{name: entry.stress for name, entry in VERTICAL.items()},
    "jumping": StressMap(zeta=0.7, grazing=0.0),
    "no-tension": StressMap(zeta=1.3, tension="cut"),
    "measured": PlateDrags(*PLATES, *StressMap(zeta=0.5, D10=0.1)(*PLATES)),
}
OUTLINES = {
    "plate": Plate(length=0.04, width=0.02, tilt=0.3),
    "round-rod": RoundRod(radius=0.02, width=0.03),
    "half-cylinder": HalfCylinder(radius=0.02, width=0.03),
    "half-cylinder, flat up": HalfCylinder(radius=0.02, width=0.03, flat="up"),
    "square-rod": SquareRod(side=0.03, width=0.02),
    "c-leg": CLeg(radius=0.038, width=0.025),
    "c-leg, reversed": CLeg(radius=0.03, width=0.025, relative_curvature=-0.6),
    "flat-leg": FlatLeg(radius=0.038, width=0.025),
    "wheel": Wheel(radius=0.03, width=0.02),
    "wheel, lugs": Wheel(
        radius=0.03, width=0.02, lugs=5, lug_height=0.006, lug_width=0.004
    ),
    "polygon": Polygon(
        points=((0.0, 0.0), (0.05, 0.01), (0.02, 0.02), (0.01, 0.05)), width=0.01
    ),
    "polygon, open": Polygon(
        points=((0.0, 0.0), (0.05, 0.01), (0.02, 0.02)), width=0.01, closed=False
    ),
    "spline": Spline(
        points=((0.0, 0.0), (0.0, 0.04), (0.03, 0.05), (0.04, 0.0)), width=0.01
    ),
    "spline, open": Spline(
        points=((0.0, 0.0), (0.02, -0.01), (0.04, 0.01)), width=0.01, closed=False
    ),
}

# Robots that walk, none like another in anything.
POPPY = StressMap(zeta=0.3, grazing=math.radians(5))
UNEVEN = Rhex(
    0.2,
    0.15,
    0.03,
    0.06,
    CLeg(0.025, 0.012, 0.6),
    (-0.05, 0.01, 0.06),
    hip_height=-0.004,
    axle=0.002,
)
ROUND = Rhex(
    0.5, 0.2, 0.04, 0.08, RoundRod(0.025, 0.03), (-0.07, 0.08), inertia=4e-3, axle=0.015
)
WALKERS = {
    "rhex, c-legs": Walker(UNEVEN, Tripod(2.0), POPPY),
    "rhex, round legs, tripod clock": Walker(
        ROUND, Tripod(1.3, 0.4, 1.1, 0.3), StressMap(zeta=0.5, tension="cut")
    ),
    "rhex, air and grain inertia": Walker(
        UNEVEN, Tripod(3.0), POPPY, (Aeration(0.1, 0.4), GrainPressure(2.0))
    ),
    "rhex, on a slope": Walker(UNEVEN, Tripod(2.0), POPPY, (Slope(0.1, 0.6),)),
    "wheel, lugs": Walker(
        Roller(2.0, Wheel(0.1, 0.1, 12, 0.015, 0.006)), Tripod(1.0, 0.3, 1.0), POPPY
    ),
}

# Bodies of three dimensions.
SOLIDS = {
    "sphere": Sphere(radius=0.02),
    "cylinder": Cylinder(radius=0.01, length=0.05),
    "screw": Screw(radius=0.03, core=0.015, pitch=0.06, length=0.12),
    "screw, blade": Screw(
        radius=0.03,
        core=0.018,
        pitch=0.05,
        length=0.11,
        thickness=0.006,
        nose=0.02,
        handed="left",
    ),
    "leg": Leg(radius=0.03, width=0.02, thickness=0.004, relative_curvature=-0.6),
}

ORDERS = {
    "grain-inertia, strength": 1,
    "body-inertia, frequency": 2,
}  # other than that of the class


def vanishing(kinds):
    """Return functions of x whose effects vanish as x goes to 0, with the order at
    which they do, by name."""
    return {
        name: (
            lambda x, kind=kind, name=name: kind.examples(x)[name],
            ORDERS.get(name, kind.order),
        )
        for kind in kinds.values()
        for name in kind.examples()
    }


EFFECTS, GROUND_EFFECTS = (
    vanishing(kinds_of_effects),
    vanishing(kinds_of_ground_effects),
)
