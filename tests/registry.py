"""Everything the property tests run over. A new medium, body or gait is added here, in one line."""

import math
import pathlib

import numpy as np

from geomech.gaits import GAITS as kinds_of_gaits
from geomech.systems import SYSTEMS as kinds_of_systems
from geomech.systems import Table
from rft import (
    Backbone,
    BodyInertia,
    Chain,
    ConstantCurvature,
    Coulomb,
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
)
from rft import Slope as Incline
from rft.ground import Aeration, Slope
from rft.ground import DisturbedGround as DisturbedPlaces
from rft.ground import GrainInertia as GrainPressure
from rft.laws import CATALOGUE, is_closed
from rft.laws import Table as Measured
from rft.meshes import Cylinder, Leg, Screw, Sphere
from rft.plates import (
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
from rft.walking import Rhex, Roller, Tripod, Walker

DATA = pathlib.Path(__file__).parent / "data"
_PSI = np.linspace(0.0, math.pi / 2, 12)  # rad

MEDIA = {
    **{name: entry.medium for name, entry in CATALOGUE.items()},
    "sharp": Granular(C=1.8, gamma0=math.radians(0.1)),
    "blunt": Granular(C=1.8, gamma0=math.radians(89.9)),
    "no-extra": Granular(C=0.0, gamma0=0.3),
    "strong": Granular(C=1e3, gamma0=0.24),
    "viscous-1": Viscous(1.0),
    "viscous-slippery": Viscous(1e4),
    "measured": Measured(_PSI, *Granular(C=1.4, gamma0=0.25).traction(np.cos(_PSI), np.sin(_PSI))),
}
CLOSED = {k: m for k, m in MEDIA.items() if is_closed(m)}  # exact integrals over a link
LINEAR = {k: m for k, m in CLOSED.items() if not m.dry}
DRY = {k: m for k, m in MEDIA.items() if k not in LINEAR}

BODIES = {
    "two": Chain((1, 2)),
    "three": Chain((1, 1, 1)),
    "three-middle": Chain((1, 1, 1), frame="link-2"),
    "uneven": Chain((0.7, 1.4, 0.9), frame="link-1", length=0.3),
    "five": Chain((1,) * 5),
    "modes": Chain((0.8, 1.3, 1.0, 0.7), 0.3, "link-2", modes=((1.4, 0.3, -0.5), (-0.2, 0.9, 2.1))),
    "serpenoid": Serpenoid(elements=24, waves=1.5),
    "arcs": ConstantCurvature(elements=12, sections=3, frame="link-4"),
    "backbone": Backbone(elements=9, length=0.1),
}

GAITS = kinds_of_gaits.examples()
SYSTEMS = kinds_of_systems.examples() | {"table": Table(DATA / "uneven.nc")}  # of the swimmer; the file has its scene

# Stress maps and outlines of the vertical plane.
PLATES = np.radians(np.meshgrid(np.arange(-60, 91, 30), np.arange(-90, 91, 30))).reshape(2, -1)
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
    "wheel, lugs": Wheel(radius=0.03, width=0.02, lugs=5, lug_height=0.006, lug_width=0.004),
    "polygon": Polygon(points=((0.0, 0.0), (0.05, 0.01), (0.02, 0.02), (0.01, 0.05)), width=0.01),
    "polygon, open": Polygon(points=((0.0, 0.0), (0.05, 0.01), (0.02, 0.02)), width=0.01, closed=False),
    "spline": Spline(points=((0.0, 0.0), (0.0, 0.04), (0.03, 0.05), (0.04, 0.0)), width=0.01),
    "spline, open": Spline(points=((0.0, 0.0), (0.02, -0.01), (0.04, 0.01)), width=0.01, closed=False),
}

# Robots that walk, none like another in anything.
POPPY = StressMap(zeta=0.3, grazing=math.radians(5))
UNEVEN = Rhex(0.2, 0.15, 0.03, 0.06, CLeg(0.025, 0.012, 0.6), (-0.05, 0.01, 0.06), hip_height=-0.004, axle=0.002)
ROUND = Rhex(0.5, 0.2, 0.04, 0.08, RoundRod(0.025, 0.03), (-0.07, 0.08), inertia=4e-3, axle=0.015)
WALKERS = {
    "rhex, c-legs": Walker(UNEVEN, Tripod(2.0), POPPY),
    "rhex, round legs, tripod clock": Walker(ROUND, Tripod(1.3, 0.4, 1.1, 0.3), StressMap(zeta=0.5, tension="cut")),
    "rhex, air and grain inertia": Walker(UNEVEN, Tripod(3.0), POPPY, (Aeration(0.1, 0.4), GrainPressure(2.0))),
    "wheel, lugs": Walker(Roller(2.0, Wheel(0.1, 0.1, 12, 0.015, 0.006)), Tripod(1.0, 0.3, 1.0), POPPY),
}

# Bodies of three dimensions.
SOLIDS = {
    "sphere": Sphere(radius=0.02),
    "cylinder": Cylinder(radius=0.01, length=0.05),
    "screw": Screw(radius=0.03, core=0.015, pitch=0.06, length=0.12),
    "screw, blade": Screw(radius=0.03, core=0.018, pitch=0.05, length=0.11, thickness=0.006, nose=0.02, handed="left"),
    "leg": Leg(radius=0.03, width=0.02, thickness=0.004, relative_curvature=-0.6),
}

# name: (effect of a parameter that goes to zero, the order at which the plain scene comes back)
EFFECTS = {
    "skin-friction": (lambda x: SkinFriction(0.2 * (1 - x), 0.2 * (1 - 2 * x), 0.2), 1),
    "end-caps": (lambda x: EndCaps(radius=0.1 * x, tail=4.0), 1),
    "towed-sled": (lambda x: TowedSled(pull=x, distance=0.3), 1),
    "depth-profile": (lambda x: DepthProfile(along=(1, 1 + x)), 1),
    "depth-profile, slope": (lambda x: DepthProfile(slope=x, towards=1.0), 1),
    "slope": (lambda x: Incline(angle=x, towards=2.0, repose=0.6, weight=0.3), 1),
    "grain-inertia": (lambda x: GrainInertia(frequency=x, length=0.7, depth=0.07, strength=1.5), 2),
    "grain-inertia, strength": (lambda x: GrainInertia(frequency=1.2, length=0.4, depth=0.07, strength=x), 1),
    "body-inertia": (lambda x: BodyInertia(mass=x, frequency=0.6, length=0.8, drag=1.3), 1),
    "body-inertia, frequency": (lambda x: BodyInertia(mass=0.7, frequency=0.6 * x, length=0.8, drag=1.3), 2),
    "transient": (lambda x: Transient(travel=2 * x), 1),
    "disturbed-ground": (lambda x: DisturbedGround(radius=0.05, weakening=x), 1),
}

# Of the vertical plane, likewise.
GROUND_EFFECTS = {
    "aeration": (lambda x: Aeration(air_speed=0.03 * x, fluidisation=0.03), 1),
    "grain-inertia": (lambda x: GrainPressure(strength=2 * x, density=700.0), 1),
    "slope": (lambda x: Slope(angle=x, repose=0.6), 1),
    "disturbed-ground": (lambda x: DisturbedPlaces(places=(0.0, -0.1), radius=0.05, weakening=x), 1),
}

assert Coulomb in {type(m) for m in MEDIA.values()}
