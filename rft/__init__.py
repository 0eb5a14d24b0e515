"""Resistive force theory: force laws, bodies and the balance of forces. Knows nothing of gaits."""

from rft.balance import Solution, body_velocity
from rft.bodies import Body, Chain
from rft.media import CATALOGUE, Coulomb, Granular, Medium, Viscous

__all__ = ["CATALOGUE", "Body", "Chain", "Coulomb", "Granular", "Medium", "Solution", "Viscous", "body_velocity"]
