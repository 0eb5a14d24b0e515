"""What functions of a task see of one robot, or of many at once."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

COPIED = "qpos", "qvel", "act", "ctrl", "time", "sensordata"


class State:
    """Fields of `mujoco.MjData` by their names, such as ``state.qpos`` or
    ``state.sensordata``: (n,) of one robot, (robots, n) of many. A function that
    indexes the last axes, as in ``state.qpos[..., 7:]``, serves both.

    qpos, qvel, act, ctrl and time are those of the end of an action; fields that follow
    from them, such as xpos and sensordata, are by one time step older, as after
    ``mj_step``. Before an action there are only qpos, qvel, act, ctrl, time and
    sensordata."""

    def __init__(self, field: Callable[[str], np.ndarray]):
        self._field = field

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_"):
            raise AttributeError(name)
        return self._field(name)

    @classmethod
    def of_data(cls, data: mujoco.MjData) -> State:
        """Return the state of one robot."""
        return cls(lambda name: getattr(data, name))

    def copy(self) -> State:
        """Return the state as it is now, with the fields that are there before an
        action."""
        copies = {name: np.array(getattr(self, name)) for name in COPIED}

        def field(name: str) -> np.ndarray:
            if name in copies:
                return copies[name]
            raise AttributeError(
                f"the state before an action has no {name}, only {', '.join(COPIED)}"
            )

        return State(field)
