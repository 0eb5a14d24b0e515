"""Systems, one in each file: objects with a velocity(alpha, alphadot) and their
traits.

A new file in this folder is found by itself (`rft.core.registry.load_all`); imports
here are the public names. `geomech.mathematics.systems.diff_drive` is a short
example."""

from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems.base import (
    SYSTEMS,
    Cycle,
    System,
    as_system,
    integrated,
)
from geomech.mathematics.systems.capabilities import capability
from geomech.mathematics.systems.diff_drive import DifferentialDrive
from geomech.mathematics.systems.floating import FloatingChain
from geomech.mathematics.systems.ideal_fluid import IdealFluidSwimmer
from geomech.mathematics.systems.no_slip import NoSlipSnake
from geomech.mathematics.systems.solver import Solver
from geomech.mathematics.systems.stokes_flow import BeadSwimmer, StokesletSwimmer
from geomech.mathematics.systems.swimmer import Swimmer
from geomech.mathematics.systems.table import Table
from rft.core.premise import Premise
from rft.core.registry import load_all

load_all(__name__, __path__)
KINDS = SYSTEMS

__all__ = [
    "KINDS",
    "SYSTEMS",
    "BeadSwimmer",
    "Cycle",
    "DifferentialDrive",
    "FloatingChain",
    "IdealFluidSwimmer",
    "NoSlipSnake",
    "Premise",
    "Solver",
    "StokesletSwimmer",
    "Swimmer",
    "System",
    "Table",
    "Traits",
    "as_system",
    "capability",
    "integrated",
]


def __dir__() -> list[str]:
    return __all__
