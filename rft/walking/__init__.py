"""Walking on grains: robots and their clocks, what computes how they walk, and wheels that are driven at a given slip."""

from rft.walking.engines import ENGINES, Fineness, Walker, engine
from rft.walking.mjcf import Mjcf
from rft.walking.robot import ROBOTS, Rhex, Robot, Roller, Tripod
from rft.walking.stride import Walk
from rft.walking.wheel import Rolling, rolling

__all__ = [
    "ENGINES",
    "ROBOTS",
    "Fineness",
    "Mjcf",
    "Rhex",
    "Robot",
    "Roller",
    "Rolling",
    "Tripod",
    "Walk",
    "Walker",
    "engine",
    "rolling",
]
