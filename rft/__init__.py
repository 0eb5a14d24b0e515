"""Resistive force theory: force laws, bodies and the balance of forces. Knows nothing of gaits."""

from rft.balance import Solution, body_velocity
from rft.bodies import Backbone, Body, Chain, ConstantCurvature, Serpenoid
from rft.media import CATALOGUE, Coulomb, Granular, Medium, Viscous

__all__ = [
    "CATALOGUE", "Backbone", "Body", "Chain", "ConstantCurvature", "Coulomb", "Granular", "Medium", "Serpenoid", "Solution",
    "Viscous", "body_velocity",
]  # fmt: skip
