"""Any robot of an MJCF file that learns to move in sand: one in MuJoCo, and many in a
Batch."""

from __future__ import annotations

import copy
import difflib
import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.vector.utils import batch_space

from geomech.gym.state import State
from geomech.gym.task import Task
from rft.core.refusal import Refusal, formatted, require
from rft.mujoco import Sand, attach
from rft.mujoco.errors import RunError
from rft.terradynamics.walking.spatial.mjcf import read_model

NO_ACTION = "the action must be finite numbers"
NO_MOTION = "the motion is not finite: MuJoCo has reset the simulation"
# Arguments of `attach` that environments pass on.
OF_SAND = tuple(inspect.signature(attach).parameters)[3:]


def robot_model(xml: str | Path | mujoco.MjModel) -> mujoco.MjModel:
    """Return a model of its own from the name of an MJCF or URDF file, the text of an
    MJCF, or a compiled model; Refusal of one line for what MuJoCo cannot read."""
    if isinstance(xml, mujoco.MjModel):
        return copy.copy(xml)
    require(
        isinstance(xml, str | Path),
        "xml must be the name of an MJCF file, its text, or a mujoco.MjModel",
        value=xml,
    )
    if not str(xml).lstrip().startswith("<"):
        return read_model(xml)
    try:
        return mujoco.MjModel.from_xml_string(str(xml))
    # MuJoCo raises many kinds of errors for a text that is no MJCF.
    except Exception as error:
        message = " ".join(str(error).split())
        raise Refusal(
            "xml is not an MJCF that MuJoCo can read", because=message[:300]
        ) from None


def _require_of_sand(names: Mapping[str, Any]) -> None:
    """Raise Refusal for a keyword that neither the environment nor `attach` knows."""
    for name in names:
        if name in OF_SAND:
            continue
        known = [*inspect.signature(SandEnv).parameters, *OF_SAND]
        near = difflib.get_close_matches(name, known, 1, 0.5)
        cure = f"of the sand there are {', '.join(OF_SAND)}"
        if near:
            cure = f"did you mean {near[0]}?"
        raise Refusal(f"there is no argument {formatted(name)}", instead=cure)


def _require_open(sand: Sand) -> None:
    """Raise Refusal for an environment that is closed."""
    require(sand.is_attached, "the environment is closed", instead="create a new one")


def _require_size(actions: np.ndarray, shape: tuple[int, ...]) -> None:
    """Raise Refusal for actions of another shape."""
    require(
        np.shape(actions) == shape,
        f"an action must have the shape {shape}, not {np.shape(actions)}",
    )


def _is_sound(passed, seconds: float, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    """Return whether states are numbers and the time of an action has passed; MuJoCo
    begins anew, at time 0, where a motion is no number."""
    finite = np.isfinite(qpos).all(-1) & np.isfinite(qvel).all(-1)
    return finite & (np.abs(passed - seconds) < 1e-6)


class SandEnv(gymnasium.Env):
    """A robot in sand. An action has one number from -1 to 1 for each actuator.

    Parameters
    ----------
    xml : str, Path or MjModel
        Name of an MJCF or URDF file, the text of an MJCF, or a compiled model, which is
        copied.
    medium, geoms
        As of `rft.mujoco.attach`.
    observation : str or function
        "state" (`geomech.gym.trunk.observation`), "sensors" (those of the MJCF), or a
        function of a `State` that returns a row of numbers (..., n).
    reward : dict or function
        Weights of parts: "forward", progress of the trunk along x, m/s; "effort", power
        of the actuators, W; "fall", lost where the episode terminates. Or a function of
        (before, after, action), two states and the action, that returns a number (...,)
        or several by name, which are added. By default forward - 0.02 effort - 2 fall.
    terminated : str, function or None
        "overturned", a function of the state that returns whether the episode ends, or
        None for episodes that never end.
    reset : float or function
        Largest change of each hinge and slide from the start, rad or m; or a function
        of (model, rng) that returns qpos, or a dict of some of qpos, qvel, act and
        ctrl. An episode starts in the first keyframe, or else as the MJCF places the
        robot, with servos that hold it there.
    frame_skip : int
        Time steps of an action.
    control_rate : float
        Change of the controls per second for the action 1; None for actions that set
        the controls, scaled to the ctrlrange.
    **sand : Any
        Further arguments of `rft.mujoco.attach`, such as slope, element or footprints.

    Notes
    -----
    The parts of the reward are in ``info``. An episode is truncated, with a "reason" in
    ``info``, by an action that is no number, or by a motion that is none.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        xml: str | Path | mujoco.MjModel,
        medium: Any = "poppy-seeds-loose",
        geoms: str | int | Sequence[str | int] | None = None,
        *,
        observation: str | Callable = "state",
        reward: Mapping[str, float] | Callable | None = None,
        terminated: str | Callable | None = "overturned",
        reset: float | Callable = 0.0,
        frame_skip: int = 10,
        control_rate: float | None = None,
        render_mode: str | None = None,
        **sand: Any,
    ):
        _require_of_sand(sand)
        self.render_mode = render_mode
        self.model = robot_model(xml)
        self.task = Task(
            self.model,
            observation,
            reward,
            terminated,
            reset,
            frame_skip,
            control_rate,
        )
        self.sand = attach(self.model, medium, geoms, **sand)
        self.data = mujoco.MjData(self.model)
        self.state = State.of_data(self.data)
        self.action_space = self.task.action_space
        self.observation_space = self.task.observation_space

    def reset(
        self, *, seed: int | None = None, options: dict | None = None
    ) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        _require_open(self.sand)
        mujoco.mj_resetData(self.model, self.data)
        for name, values in self.task.start(self.np_random).items():
            getattr(self.data, name)[:] = values
        mujoco.mj_forward(self.model, self.data)
        return self.task.observe(self.state), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        _require_open(self.sand)
        _require_size(action, (self.model.nu,))
        if not np.isfinite(action).all():
            return self._truncated(NO_ACTION)
        if not _is_sound(0.0, 0.0, self.data.qpos, self.data.qvel):
            return self._truncated(NO_MOTION)
        before = self.state.copy()
        self.data.ctrl[:] = self.task.controls(self.data.ctrl, action)
        mujoco.mj_step(self.model, self.data, self.task.frame_skip)
        passed = self.data.time - before.time
        if not _is_sound(passed, self.task.seconds, self.data.qpos, self.data.qvel):
            return self._truncated(NO_MOTION)
        observed = self.task.observe(self.state)
        ended = self.task.ends(self.state)
        parts = self.task.rewards(before, self.state, action, ended)
        parts = {name: float(x) for name, x in parts.items()}
        return observed, sum(parts.values()), bool(ended), False, parts

    def error(self, actions: np.ndarray) -> RunError:
        """Return the errors, m, of the places of the geoms after actions (T, nu) from
        the present state on, which stays as it is: that of the time step, and that of
        the elements. They are found by a run with time steps half as long, and one with
        elements half as long."""
        _require_open(self.sand)
        count = len(np.atleast_2d(actions))
        _require_size(actions, (count, self.model.nu))
        controls = [self.data.ctrl.copy()]
        for action in actions:
            controls.append(self.task.controls(controls[-1], action))
        seconds = self.task.seconds
        start = self.data.time

        def control(model: mujoco.MjModel, data: mujoco.MjData) -> None:
            # The time of a step is a sum, which rounding may leave below its action.
            number = int((data.time - start) / seconds + 1e-6)
            data.ctrl[:] = controls[min(number, count - 1) + 1]

        return self.sand.error(self.data, count * seconds, control)

    def _truncated(self, reason: str) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Return a step that truncates the episode, with zeros in place of nan."""
        observed = np.nan_to_num(self.task.observe(self.state))
        info = dict.fromkeys(self.task.parts, 0.0) | {"reason": reason}
        return observed, 0.0, False, True, info

    def close(self) -> None:
        self.sand.detach()


class SandVectorEnv(gymnasium.vector.VectorEnv):
    """Many robots in sand, in one `mujoco.batch.Batch` on all cores (MuJoCo 4); spaces,
    rewards and arguments are those of `SandEnv`. Functions receive a state with a
    leading axis of robots.

    media: one for each robot, such as `rft.mujoco.sample` draws; None for the one
    medium of all. An episode that has ended begins anew with the next step."""

    metadata = {
        "render_modes": [],
        "autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        xml: str | Path | mujoco.MjModel,
        num_envs: int = 64,
        medium: Any = "poppy-seeds-loose",
        geoms: str | int | Sequence[str | int] | None = None,
        *,
        media: Sequence[Any] | None = None,
        max_episode_steps: int = 250,
        observation: str | Callable = "state",
        reward: Mapping[str, float] | Callable | None = None,
        terminated: str | Callable | None = "overturned",
        reset: float | Callable = 0.0,
        frame_skip: int = 10,
        control_rate: float | None = None,
        render_mode: str | None = None,
        **sand: Any,
    ):
        _require_of_sand(sand)
        self.num_envs = num_envs
        self.max_episode_steps = max_episode_steps
        self.render_mode = render_mode
        self.model = robot_model(xml)
        self.task = Task(
            self.model,
            observation,
            reward,
            terminated,
            reset,
            frame_skip,
            control_rate,
        )
        self.sand = attach(self.model, medium, geoms, **sand)
        self.batch = self.sand.batch(num_envs, persistent=True, media=media)
        self.state = State(self.batch.bind)
        self.qpos = self.batch.bind("qpos")
        self.qvel = self.batch.bind("qvel")
        self.ctrl = self.batch.bind("ctrl")
        self.time = self.batch.bind("time")
        self.single_action_space = self.task.action_space
        self.single_observation_space = self.task.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.ended = np.zeros(num_envs, bool)
        self.age = np.zeros(num_envs, int)  # steps of each episode so far

    def reset(
        self, *, seed: int | None = None, options: dict | None = None
    ) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        _require_open(self.sand)
        self._begin(np.arange(self.num_envs))
        return self.task.observe(self.state, (self.num_envs,)), {}

    def _begin(self, robots: np.ndarray) -> None:
        """Set some robots to the start of an episode."""
        self.batch.reset(robots)
        for robot in robots:
            for name, values in self.task.start(self.np_random).items():
                self.batch.bind(name)[robot] = values
        self.batch.forward(robots)
        self.ended[robots] = False
        self.age[robots] = 0

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
        _require_open(self.sand)
        _require_size(actions, (self.num_envs, self.model.nu))
        robots = (self.num_envs,)
        before = self.state.copy()

        # Robots whose episode has ended begin anew; the others step, where they can.
        is_new = self.ended.copy()
        has_action = np.isfinite(actions).all(-1)
        is_sound = _is_sound(0.0, 0.0, self.qpos, self.qvel)
        stepping = np.flatnonzero(~is_new & has_action & is_sound)
        self.ctrl[stepping] = self.task.controls(self.ctrl[stepping], actions[stepping])
        if len(stepping):
            self.batch.step(stepping, self.task.frame_skip)
        self.age[stepping] += 1
        passed = self.time - before.time
        is_sound &= _is_sound(passed, self.task.seconds, self.qpos, self.qvel)
        is_lost = ~is_new & ~(has_action & is_sound)
        if is_new.any():
            self._begin(np.flatnonzero(is_new))

        observed = np.nan_to_num(self.task.observe(self.state, robots))
        has_ended = self.task.ends(self.state, robots) & ~is_lost & ~is_new
        parts = self.task.rewards(before, self.state, actions, has_ended, robots)
        for name, values in parts.items():
            parts[name] = np.where(is_new | is_lost, 0.0, values)
        total = sum(parts.values())

        is_late = self.age >= self.max_episode_steps
        is_truncated = (is_late | is_lost) & ~has_ended & ~is_new
        self.ended = has_ended | is_truncated
        info: dict[str, Any] = dict(parts)
        if is_lost.any():
            reason = np.where(has_action, NO_MOTION, NO_ACTION).astype(object)
            info["reason"] = np.where(is_lost, reason, "")
        return observed, total, has_ended, is_truncated, info

    def close_extras(self, **_: Any) -> None:
        self.sand.detach()
