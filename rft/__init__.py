"""Resistive force theory: force laws, bodies and the balance of forces. Gaits are in `geomech`."""

from rft.balance import Solution, body_velocity
from rft.bodies import Backbone, Body, Chain, ConstantCurvature, Serpenoid
from rft.effects import (
    BodyInertia,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    SkinFriction,
    Slope,
    TowedSled,
    Transient,
)
from rft.laws import CATALOGUE, Coulomb, Granular, Medium, Surface, Table, Viscous
from rft.stepping import TimeSteps, time_steps
from rft.work import Work, work_done

SOLVER = 8  # version of the numbers, raised with every change of one; results of other versions are not resumed

__all__ = [
    "CATALOGUE",
    "SOLVER",
    "Backbone",
    "Body",
    "BodyInertia",
    "Chain",
    "ConstantCurvature",
    "Coulomb",
    "DepthProfile",
    "DisturbedGround",
    "EndCaps",
    "GrainInertia",
    "Granular",
    "Medium",
    "Serpenoid",
    "SkinFriction",
    "Slope",
    "Solution",
    "Surface",
    "Table",
    "TimeSteps",
    "TowedSled",
    "Transient",
    "Viscous",
    "Work",
    "body_velocity",
    "time_steps",
    "work_done",
]
