"""Walking on grains: robots and their clocks, engines that compute walks, and wheels
and screws at a given slip."""

from rft.terradynamics.walking.craft import Screws
from rft.terradynamics.walking.engines import ENGINES, Fineness, Walker, engine
from rft.terradynamics.walking.flippers import Flippers
from rft.terradynamics.walking.planar.stride import Walk
from rft.terradynamics.walking.prints import PrintedGround
from rft.terradynamics.walking.robot import Rhex, Robot, Roller, Tripod
from rft.terradynamics.walking.screws import (
    Cruise,
    Turning,
    cruise,
    free_turning,
    turning,
)
from rft.terradynamics.walking.spatial.mjcf import Mjcf
from rft.terradynamics.walking.wheel import Rolling, rolling

ROBOTS: dict[str, type[Robot]] = {
    "rhex": Rhex,
    "wheel": Roller,
    "screws": Screws,
    "flippers": Flippers,
}  # by the name that scenes give

__all__ = [
    "ENGINES",
    "ROBOTS",
    "Cruise",
    "Fineness",
    "Flippers",
    "Mjcf",
    "PrintedGround",
    "Rhex",
    "Robot",
    "Roller",
    "Rolling",
    "Screws",
    "Tripod",
    "Turning",
    "Walk",
    "Walker",
    "cruise",
    "engine",
    "free_turning",
    "rolling",
    "turning",
]


def __dir__() -> list[str]:
    return __all__
