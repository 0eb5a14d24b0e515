"""Environments of Gymnasium in which robots learn to walk in sand. Importing this module registers them.

import gymnasium
import geomech.gym

env = gymnasium.make("geomech/HexapodSand-v0")
many = gymnasium.make_vec("geomech/HexapodSand-v0", num_envs=64, vectorization_mode="vector_entry_point")
"""

from __future__ import annotations

from rft.refusal import Refusal

try:
    from gymnasium.envs.registration import register
except ModuleNotFoundError as _error:
    if _error.name != "gymnasium":
        raise
    raise Refusal("geomech.gym needs Gymnasium", instead="pip install 'geomech[gym]'") from None

from geomech.gym.hexapod import HexapodSand, HexapodSands

__all__ = ["HexapodSand", "HexapodSands"]

register(
    "geomech/HexapodSand-v0",
    entry_point="geomech.gym.hexapod:HexapodSand",
    vector_entry_point="geomech.gym.hexapod:HexapodSands",
    max_episode_steps=250,
)
