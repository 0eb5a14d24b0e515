"""A hexapod that learns to walk in sand: one robot in MuJoCo, and many in a Batch."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.vector.utils import batch_space

from rft.core.notes import Note
from rft.core.refusal import require
from rft.mujoco import Sand, attach
from rft.mujoco.example import hexapod

STEPS = 10  # time steps for one action
FASTEST_LEG = 20.0  # rad/s, for the action 1
EFFORT = 0.02  # reward for a power of -1 W
FALL = 2.0  # reward lost by turning over
NOISE = 0.3  # rad, of the angles at the start
SIZE = 28  # of an observation
PARTS = "forward", "effort", "fall"
NO_ACTION = "the action must be finite numbers"
NO_MOTION = "the motion is not finite: MuJoCo has reset the simulation"


def _sand(medium: Any) -> tuple[mujoco.MjModel, Sand]:
    """Return the robot and the sand under it."""
    model = hexapod()
    with warnings.catch_warnings():
        # The legs pass through the floor on purpose.
        warnings.simplefilter("ignore", Note)
        return model, attach(model, medium)


def _require_open(sand: Sand) -> None:
    """Raise Refusal for an environment that is closed."""
    require(sand.is_attached, "the environment is closed", instead="create a new one")


def _is_sound(passed, seconds: float, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    """Return whether states are numbers and the time of an action has passed; MuJoCo
    begins anew, at time 0, where a motion is no number."""
    finite = np.isfinite(qpos).all(-1) & np.isfinite(qvel).all(-1)
    return finite & (np.abs(passed - seconds) < 1e-6)


def observation(qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    """Return observations (..., 28) from positions (..., 13) and velocities (..., 12).

    In order: height; the vertical, and the velocity of the trunk, along its axes; its
    angular velocity; cosines, sines and rates of the legs."""
    w, x, y, z = np.moveaxis(qpos[..., 3:7], -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    turn = np.stack([np.stack(row, -1) for row in rows], -2)
    velocity = np.einsum("...ij,...i->...j", turn, qvel[..., :3])
    legs = qpos[..., 7:]
    parts = (
        qpos[..., 2:3],
        turn[..., 2, :],
        velocity,
        qvel[..., 3:6],
        np.cos(legs),
        np.sin(legs),
        qvel[..., 6:],
    )
    return np.concatenate(parts, -1).astype(np.float32)


def rewards(
    distance: np.ndarray,
    seconds: float,
    force: np.ndarray,
    rate: np.ndarray,
    upright: np.ndarray,
) -> dict:
    """Return the parts of the reward (...,): progress along x, m/s; the motors' work;
    and a fall.

    distance: along x, m. force, rate: of the legs, N m and rad/s. upright: cosine of
    the trunk's tilt."""
    power = np.maximum(force * rate, 0.0).sum(-1)
    return {
        "forward": distance / seconds,
        "effort": -EFFORT * power,
        "fall": np.where(upright < 0.0, -FALL, 0.0),
    }


class HexapodSand(gymnasium.Env):
    """A hexapod in sand. An action is the rates of its six legs, over 20 rad/s; it
    lasts 20 ms.

    medium: name, stress map or law, as of `rft.mujoco.attach`. The reward is the sum of
    its parts, which stand in ``info``: "forward", m/s, "effort" and "fall". An episode
    ends when the robot turns over; it is truncated, with a "reason" in ``info``, by an
    action that is no number, or by a motion that is none."""

    metadata = {"render_modes": []}

    def __init__(
        self, medium: Any = "poppy-seeds-loose", render_mode: str | None = None
    ):
        self.render_mode = render_mode
        self.model, self.sand = _sand(medium)
        self.data = mujoco.MjData(self.model)
        self.action_space = gymnasium.spaces.Box(
            -1.0, 1.0, (self.model.nu,), np.float32
        )
        self.observation_space = gymnasium.spaces.Box(
            -np.inf, np.inf, (SIZE,), np.float32
        )

    def reset(
        self, *, seed: int | None = None, options: dict | None = None
    ) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        _require_open(self.sand)
        mujoco.mj_resetData(self.model, self.data)
        angles = self.np_random.uniform(-NOISE, NOISE, self.model.nu)
        self.data.qpos[7:] = angles
        self.data.ctrl[:] = angles
        mujoco.mj_forward(self.model, self.data)
        return observation(self.data.qpos, self.data.qvel), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        _require_open(self.sand)
        if not np.isfinite(action).all():
            return self._truncated(NO_ACTION)
        if not _is_sound(0.0, 0.0, self.data.qpos, self.data.qvel):
            return self._truncated(NO_MOTION)
        before = self.data.qpos[0]
        time = self.data.time
        seconds = STEPS * self.model.opt.timestep
        self.data.ctrl[:] += FASTEST_LEG * seconds * np.clip(action, -1.0, 1.0)
        mujoco.mj_step(self.model, self.data, STEPS)
        passed = self.data.time - time
        if not _is_sound(passed, seconds, self.data.qpos, self.data.qvel):
            return self._truncated(NO_MOTION)
        observed = observation(self.data.qpos, self.data.qvel)
        upright = observed[3]
        parts = rewards(
            self.data.qpos[0] - before,
            seconds,
            self.data.actuator_force,
            self.data.qvel[6:],
            upright,
        )
        parts = {name: float(x) for name, x in parts.items()}
        return observed, sum(parts.values()), bool(upright < 0.0), False, parts

    def _truncated(self, reason: str) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Return a step that truncates the episode, with zeros in place of nan."""
        observed = np.nan_to_num(observation(self.data.qpos, self.data.qvel))
        info = dict.fromkeys(PARTS, 0.0) | {"reason": reason}
        return observed, 0.0, False, True, info

    def close(self) -> None:
        self.sand.detach()


class HexapodSands(gymnasium.vector.VectorEnv):
    """Many hexapods in sand, in one `mujoco.batch.Batch` on all cores (MuJoCo 4);
    spaces and rewards are those of `HexapodSand`.

    media: one for each robot, such as `rft.mujoco.sample` draws; None for the one
    medium of all. An episode that has ended begins anew with the next step."""

    metadata = {
        "render_modes": [],
        "autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 64,
        medium: Any = "poppy-seeds-loose",
        media: Sequence[Any] | None = None,
        max_episode_steps: int = 250,
        render_mode: str | None = None,
    ):
        self.num_envs = num_envs
        self.max_episode_steps = max_episode_steps
        self.render_mode = render_mode
        self.model, self.sand = _sand(medium)
        self.batch = self.sand.batch(num_envs, persistent=True, media=media)
        self.qpos = self.batch.bind("qpos")
        self.qvel = self.batch.bind("qvel")
        self.ctrl = self.batch.bind("ctrl")
        self.force = self.batch.bind("actuator_force")
        self.time = self.batch.bind("time")
        self.single_action_space = gymnasium.spaces.Box(
            -1.0, 1.0, (self.model.nu,), np.float32
        )
        self.single_observation_space = gymnasium.spaces.Box(
            -np.inf, np.inf, (SIZE,), np.float32
        )
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
        return observation(self.qpos, self.qvel), {}

    def _begin(self, robots: np.ndarray) -> None:
        """Set some robots to the start of an episode."""
        self.batch.reset(robots)
        self.qpos[robots, 7:] = self.np_random.uniform(
            -NOISE, NOISE, (len(robots), self.model.nu)
        )
        self.ctrl[robots] = self.qpos[robots, 7:]
        self.ended[robots] = False
        self.age[robots] = 0

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
        _require_open(self.sand)
        before = self.qpos[:, 0].copy()
        times = np.array(self.time).reshape(-1)
        seconds = STEPS * self.model.opt.timestep

        # Robots whose episode has ended begin anew; the others step, where they can.
        is_new = self.ended.copy()
        has_action = np.isfinite(actions).all(-1)
        is_sound = _is_sound(0.0, 0.0, self.qpos, self.qvel)
        stepping = np.flatnonzero(~is_new & has_action & is_sound)
        change = FASTEST_LEG * seconds * np.clip(actions[stepping], -1.0, 1.0)
        self.ctrl[stepping] += change
        if len(stepping):
            self.batch.step(stepping, STEPS)
        self.age[stepping] += 1
        passed = np.array(self.time).reshape(-1) - times
        is_sound &= _is_sound(passed, seconds, self.qpos, self.qvel)
        is_lost = ~is_new & ~(has_action & is_sound)
        if is_new.any():
            self._begin(np.flatnonzero(is_new))

        observed = np.nan_to_num(observation(self.qpos, self.qvel))
        upright = observed[:, 3]
        parts = rewards(
            self.qpos[:, 0] - before, seconds, self.force, self.qvel[:, 6:], upright
        )
        for name, values in parts.items():
            parts[name] = np.where(is_new | is_lost, 0.0, values)
        total = sum(parts.values())

        has_fallen = (upright < 0.0) & ~is_lost & ~is_new
        is_late = self.age >= self.max_episode_steps
        is_truncated = (is_late | is_lost) & ~has_fallen & ~is_new
        self.ended = has_fallen | is_truncated
        if is_lost.any():
            reason = np.where(has_action, NO_MOTION, NO_ACTION).astype(object)
            parts["reason"] = np.where(is_lost, reason, "")
        return observed, total, has_fallen, is_truncated, parts

    def close_extras(self, **_: Any) -> None:
        self.sand.detach()
