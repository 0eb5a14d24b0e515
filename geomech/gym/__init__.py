"""Environments of Gymnasium in which robots learn to move in sand. Importing this
module registers them. Needs the extra `gym`.

    import gymnasium
    import geomech.gym

    env = gymnasium.make("geomech/Sand-v0", xml="robot.xml", geoms=["leg_*"])
    hexapod = gymnasium.make("geomech/HexapodSand-v0")
    many = gymnasium.make_vec(
        "geomech/HexapodSand-v0", num_envs=64, vectorization_mode="vector_entry_point"
    )
"""

from __future__ import annotations

import contextlib
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.gym.hexapod import HexapodSand, HexapodSands
    from geomech.gym.sand import SandEnv, SandVectorEnv
    from geomech.gym.state import State

__all__ = ["HexapodSand", "HexapodSands", "SandEnv", "SandVectorEnv", "State"]
MODULES = {
    "HexapodSand": "geomech.gym.hexapod",
    "HexapodSands": "geomech.gym.hexapod",
    "SandEnv": "geomech.gym.sand",
    "SandVectorEnv": "geomech.gym.sand",
    "State": "geomech.gym.state",
}

# Missing packages are named at the first use.
with contextlib.suppress(ModuleNotFoundError):
    from gymnasium.envs.registration import register

    register(
        "geomech/Sand-v0",
        entry_point="geomech.gym.sand:SandEnv",
        vector_entry_point="geomech.gym.sand:SandVectorEnv",
        max_episode_steps=250,
    )
    register(
        "geomech/HexapodSand-v0",
        entry_point="geomech.gym.hexapod:HexapodSand",
        vector_entry_point="geomech.gym.hexapod:HexapodSands",
        max_episode_steps=250,
    )


def __getattr__(name: str) -> Any:
    """Import a name at its first use, for that needs Gymnasium and MuJoCo."""
    if name not in __all__:
        raise AttributeError(f"module 'geomech.gym' has no attribute {name!r}")
    try:
        return getattr(import_module(MODULES[name]), name)
    except ModuleNotFoundError as error:
        if error.name not in ("gymnasium", "mujoco"):
            raise
        raise Refusal(
            "geomech.gym needs Gymnasium and MuJoCo",
            instead="pip install 'geomech[gym]'",
        ) from None


def __dir__() -> list[str]:
    return __all__
