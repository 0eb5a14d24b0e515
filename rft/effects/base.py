"""What an effect is: something a scene may ask for beyond the plain force law, and pays for only then."""

from __future__ import annotations

from dataclasses import dataclass

from rft.bodies.base import Body

# What an effect may break. Each premise lost takes an engine, or a result, with it.
PREMISES = {
    "rate independence": "speed along the gait matters",
    "symmetry": "place and heading matter: no connection, no CCF",
    "no memory": "the past matters: marching in time",
    "no inertia": "mass matters: an equation of motion",
}


@dataclass(frozen=True)
class Effect:
    """Base of all effects. breaks: premises of `PREMISES` it takes away. An effect of the algebraic engine changes the
    load of an element, the elements of the body, or both; as its parameter goes to ``limit`` the scene without it
    comes back at ``order``."""

    breaks = frozenset()
    limit = ""
    order = 1
    cost = ""

    def load(self, load, medium):
        """The load law (`rft.loads`) with this effect; the same one by default."""
        return load

    def body(self, body: Body) -> Body:
        """The body with this effect; the same one by default."""
        return body
