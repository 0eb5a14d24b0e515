"""Resistive force theory: force laws, bodies and the balance of forces.

`link_force` is the force on a link at a velocity, `body_velocity` the velocity at which
the forces on a body vanish. Gaits are in `geomech`."""

import importlib
import pkgutil
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rft.balance.force import LinkForce, link_force
    from rft.balance.velocity import BodyVelocity, Solution, body_velocity
    from rft.bodies import (
        Backbone,
        Body,
        Chain,
        ConstantCurvature,
        LeggedChain,
        Serpenoid,
    )
    from rft.contacts import (
        FunctionContact,
        LinkContact,
        Touching,
        WaveContact,
        support_margin,
    )
    from rft.core.refusal import Refusal
    from rft.effects import (
        BodyInertia,
        DepthProfile,
        DisturbedGround,
        EndCaps,
        GrainInertia,
        SkinFriction,
        Slope,
        Springs,
        TowedSled,
        Transient,
    )
    from rft.laws import CATALOGUE, Coulomb, Granular, Medium, Surface, Table, Viscous
    from rft.motion.cycles import TimeSteps, time_steps
    from rft.motion.work import Work, work_done

# Version of the numbers, raised with every change of one; results of other versions are
# not resumed.
SOLVER = 15
_NAMES = {
    "rft.balance.force": "LinkForce link_force",
    "rft.balance.velocity": "BodyVelocity Solution body_velocity",
    "rft.bodies": "Backbone Body Chain ConstantCurvature LeggedChain Serpenoid",
    "rft.contacts": "FunctionContact LinkContact Touching WaveContact support_margin",
    "rft.effects": "BodyInertia DepthProfile DisturbedGround EndCaps GrainInertia "
    "SkinFriction Slope Springs TowedSled Transient",
    "rft.laws": "CATALOGUE Coulomb Granular Medium Surface Table Viscous",
    "rft.core.refusal": "Refusal",
    "rft.motion.cycles": "TimeSteps time_steps",
    "rft.motion.work": "Work work_done",
}
# Modules by the names that they define.
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Import a name at its first use: a command that refuses needs no mechanics."""
    if name in _MODULES:
        return getattr(importlib.import_module(_MODULES[name]), name)
    packages = {module.name for module in pkgutil.iter_modules(__path__)}
    if name in packages:
        return importlib.import_module(f"rft.{name}")
    raise AttributeError(f"module 'rft' has no attribute {name!r}")


def __dir__() -> list[str]:
    modules = pkgutil.iter_modules(__path__)
    return [*__all__, *(module.name for module in modules if module.ispkg)]


__all__ = [
    "CATALOGUE",
    "SOLVER",
    "Backbone",
    "Body",
    "BodyInertia",
    "BodyVelocity",
    "Chain",
    "ConstantCurvature",
    "Coulomb",
    "DepthProfile",
    "DisturbedGround",
    "EndCaps",
    "FunctionContact",
    "GrainInertia",
    "Granular",
    "LeggedChain",
    "LinkContact",
    "LinkForce",
    "Medium",
    "Refusal",
    "Serpenoid",
    "SkinFriction",
    "Slope",
    "Solution",
    "Springs",
    "Surface",
    "Table",
    "TimeSteps",
    "Touching",
    "TowedSled",
    "Transient",
    "Viscous",
    "WaveContact",
    "Work",
    "body_velocity",
    "link_force",
    "support_margin",
    "time_steps",
    "work_done",
]
