"""Resistive force theory: force laws, bodies and the balance of forces. Knows nothing of gaits."""

from rft.balance import Solution, body_velocity
from rft.bodies import Backbone, Body, Chain, ConstantCurvature, Serpenoid
from rft.effects import EndCaps, GrainInertia, SkinFriction
from rft.media import CATALOGUE, Coulomb, Granular, Medium, Viscous
from rft.work import Work, work

__all__ = [
    "CATALOGUE",
    "Backbone",
    "Body",
    "Chain",
    "ConstantCurvature",
    "Coulomb",
    "EndCaps",
    "GrainInertia",
    "Granular",
    "Medium",
    "Serpenoid",
    "SkinFriction",
    "Solution",
    "Viscous",
    "Work",
    "body_velocity",
    "work",
]
