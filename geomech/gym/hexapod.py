"""A hexapod that learns to walk in sand: one robot in MuJoCo, and many in a Batch."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

from geomech.gym.sand import SandEnv, SandVectorEnv
from rft.core.notes import Note
from rft.mujoco.example import hexapod

FASTEST_LEG = 20.0  # rad/s, for the action 1
NOISE = 0.3  # rad, of the angles at the start


class HexapodSand(SandEnv):
    """A hexapod in sand. An action is the rates of its six legs, over 20 rad/s; it
    lasts 20 ms.

    medium: name, stress map or law, as of `rft.mujoco.attach`. Observation (28,),
    reward, end and truncation are the built-in ones of `SandEnv`. The legs start at
    angles up to 0.3 rad."""

    def __init__(
        self, medium: Any = "poppy-seeds-loose", render_mode: str | None = None
    ):
        with warnings.catch_warnings():
            # The legs pass through the floor on purpose.
            warnings.simplefilter("ignore", Note)
            super().__init__(
                hexapod(),
                medium,
                reset=NOISE,
                control_rate=FASTEST_LEG,
                render_mode=render_mode,
            )


class HexapodSands(SandVectorEnv):
    """Many hexapods in sand, in one `mujoco.batch.Batch` on all cores (MuJoCo 4);
    spaces and rewards are those of `HexapodSand`.

    media: one for each robot, such as `rft.mujoco.sample` draws; None for the one
    medium of all. An episode that has ended begins anew with the next step."""

    def __init__(
        self,
        num_envs: int = 64,
        medium: Any = "poppy-seeds-loose",
        media: Sequence[Any] | None = None,
        max_episode_steps: int = 250,
        render_mode: str | None = None,
    ):
        with warnings.catch_warnings():
            # The legs pass through the floor on purpose.
            warnings.simplefilter("ignore", Note)
            super().__init__(
                hexapod(),
                num_envs,
                medium,
                media=media,
                max_episode_steps=max_episode_steps,
                reset=NOISE,
                control_rate=FASTEST_LEG,
                render_mode=render_mode,
            )
