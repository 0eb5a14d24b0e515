"""Robots by the name that scenes call their kind."""

from rft.walking.craft import Screws
from rft.walking.robot import Rhex, Robot, Roller

ROBOTS: dict[str, type[Robot]] = {"rhex": Rhex, "wheel": Roller, "screws": Screws}
