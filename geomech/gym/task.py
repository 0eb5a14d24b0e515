"""A task for a robot in sand: what it observes, what it is rewarded for, where an
episode starts and where it ends, in forms that serve one robot and many."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import mujoco
import numpy as np

from geomech.gym.state import State
from geomech.gym.trunk import Joints, Motors, observation, upright
from rft.core.checks import in_range
from rft.core.refusal import Refusal, formatted, require

WEIGHTS = {"forward": 1.0, "effort": 0.02, "fall": 2.0}
START = "qpos", "qvel", "act", "ctrl"
NO_TRUNK = "the robot has no trunk: no body has a freejoint"


class Task:
    """A task for the robot of a model. The arguments are those of
    `geomech.gym.SandEnv`.

    seconds: duration of an action. size: numbers in an observation."""

    def __init__(
        self,
        model: mujoco.MjModel,
        observation: str | Callable = "state",
        reward: Mapping[str, float] | Callable | None = None,
        terminated: str | Callable | None = "overturned",
        reset: float | Callable = 0.0,
        frame_skip: int = 10,
        control_rate: float | None = None,
    ):
        require(
            model.nu > 0,
            "the robot has no actuators, whose controls would be the actions",
            instead="add <actuator> to its MJCF",
        )
        in_range("frame_skip", frame_skip, 1, 100_000, whole=True)
        self.model = model
        self.frame_skip = int(frame_skip)
        self.seconds = self.frame_skip * model.opt.timestep
        self.joints = Joints.of_model(model)
        self.motors = Motors.of_model(model)
        self._scratch = mujoco.MjData(model)

        self._observe = self._observation_function(observation)
        self._reward = self._reward_function(reward)
        self._ends = self._end_function(terminated)
        self._starts = self._start_function(reset)
        self._next_controls = self._control_function(control_rate)
        self.parts = self._parts(reward)
        self.size = self._checked_size()

    @property
    def action_space(self) -> gymnasium.spaces.Box:
        """Actions of one robot, from -1 to 1."""
        return gymnasium.spaces.Box(-1.0, 1.0, (self.model.nu,), np.float32)

    @property
    def observation_space(self) -> gymnasium.spaces.Box:
        """Observations of one robot."""
        return gymnasium.spaces.Box(-np.inf, np.inf, (self.size,), np.float32)

    def controls(self, controls: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """Return the controls (..., nu) during actions (..., nu). controls: those so
        far."""
        return self._next_controls(controls, np.clip(actions, -1.0, 1.0))

    def start(self, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Return qpos, qvel, act and ctrl of one robot at the start of an episode."""
        data = self._scratch
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, data, 0)
        else:
            mujoco.mj_resetData(self.model, data)
        given = self._starts(self.model, data, rng)
        for name, values in given.items():
            getattr(data, name)[:] = values
        if "ctrl" not in given and not self.model.nkey:
            data.ctrl[:] = self._holding_controls(data)
        return {name: getattr(data, name).copy() for name in START}

    def observe(self, state: State, robots: tuple[int, ...] = ()) -> np.ndarray:
        """Return observations (*robots, size). robots: () for one, (n,) for n."""
        observed = np.asarray(self._observe(state), np.float32)
        _require_shape("observation", observed.shape, (*robots, self.size), robots)
        return observed

    def rewards(
        self,
        before: State,
        after: State,
        actions: np.ndarray,
        terminated: np.ndarray,
        robots: tuple[int, ...] = (),
    ) -> dict[str, np.ndarray]:
        """Return the parts of the reward (*robots,) by name; a reward without parts is
        called "reward"."""
        parts = self._reward(before, after, actions, terminated)
        if not isinstance(parts, Mapping):
            parts = {"reward": parts}
        out = {}
        for name, value in parts.items():
            values = np.asarray(value, float)
            _require_shape("reward", values.shape, robots, robots)
            out[name] = values
        return out

    def ends(self, state: State, robots: tuple[int, ...] = ()) -> np.ndarray:
        """Return whether episodes end in a state, (*robots,)."""
        ended = np.asarray(self._ends(state))
        _require_shape("terminated", ended.shape, robots, robots)
        return ended.astype(bool)

    def _observation_function(self, wanted: str | Callable) -> Callable:
        """Return the function state -> observation."""
        if callable(wanted):
            _require_takes("observation", wanted, ("state",))
            return wanted
        _require_word("observation", wanted, ("state", "sensors"))
        if wanted == "state":
            return lambda state: observation(self.joints, state.qpos, state.qvel)
        require(
            self.model.nsensordata > 0,
            "the robot has no sensors to observe",
            instead='add <sensor> to its MJCF, or use observation="state"',
        )
        return lambda state: state.sensordata

    def _reward_function(self, wanted: Mapping | Callable | None) -> Callable:
        """Return the function before, after, action, terminated -> parts."""
        if callable(wanted):
            _require_takes("reward", wanted, ("before", "after", "action"))
            return lambda before, after, action, _: wanted(before, after, action)
        weights = self._weights(wanted)
        trunk = self.joints.trunk

        def parts(before, after, action, terminated):
            out = {}
            for name, weight in weights.items():
                if name == "forward":
                    way = after.qpos[..., trunk[0]] - before.qpos[..., trunk[0]]
                    out[name] = weight * (way / self.seconds)
                elif name == "effort":
                    out[name] = -weight * self.motors.power(after)
                elif name == "fall":
                    out[name] = np.where(terminated, -weight, 0.0)
            return out

        return parts

    def _weights(self, wanted: Mapping | None) -> dict[str, float]:
        """Return the weights of the built-in parts of a reward."""
        require(
            wanted is None or isinstance(wanted, Mapping),
            "reward must be a function, or weights such as "
            '{"forward": 1, "effort": 0.02}',
            value=wanted,
        )
        weights = WEIGHTS if wanted is None else dict(wanted)
        for name, weight in weights.items():
            _require_word("reward", name, tuple(WEIGHTS))
            in_range(f"reward {name!r}", weight, -1e6, 1e6)
        require(
            self.joints.trunk is not None or "forward" not in weights,
            NO_TRUNK,
            because="``reward`` counts its progress along x",
            instead="give ``reward`` a function",
        )
        return weights

    def _parts(self, wanted: Mapping | Callable | None) -> tuple[str, ...]:
        """Return the names of the built-in parts of the reward."""
        return () if callable(wanted) else tuple(self._weights(wanted))

    def _end_function(self, wanted: str | Callable | None) -> Callable:
        """Return the function state -> whether the episode ends."""
        if callable(wanted):
            _require_takes("terminated", wanted, ("state",))
            return wanted
        if wanted is None:
            return lambda state: np.zeros(state.qpos.shape[:-1], bool)
        _require_word("terminated", wanted, ("overturned",))
        return lambda state: upright(self.joints, state.qpos) < 0.0

    def _start_function(self, wanted: float | Callable) -> Callable:
        """Return the function model, data, rng -> fields of the data at the start."""
        if callable(wanted):
            _require_takes("reset", wanted, ("model", "rng"))

            def given(model, data, rng):
                start = wanted(model, rng)
                if not isinstance(start, Mapping):
                    start = {"qpos": start}
                return _checked_start(start, data)

            return given
        in_range("reset", wanted, 0, 1e3)
        scalars = self.joints.scalars

        def noisy(model, data, rng):
            qpos = data.qpos.copy()
            qpos[scalars] += rng.uniform(-wanted, wanted, len(scalars))
            return {"qpos": qpos}

        return noisy

    def _control_function(self, rate: float | None) -> Callable:
        """Return the function controls, actions -> controls during the actions."""
        limited = self.model.actuator_ctrllimited.astype(bool)
        low, high = self.model.actuator_ctrlrange.T
        if rate is None:
            if not limited.all():
                number = int(np.flatnonzero(~limited)[0])
                kind = mujoco.mjtObj.mjOBJ_ACTUATOR
                name = mujoco.mj_id2name(self.model, kind, number) or f"{number}"
                raise Refusal(
                    f"the actuator {formatted(name)} has no ctrlrange, to which "
                    "actions from -1 to 1 are scaled",
                    instead="give it one in the MJCF, or set ``control_rate``",
                )
            return lambda _, actions: (low + high) / 2 + (high - low) / 2 * actions
        in_range("control_rate", rate, 0, 1e6, unit="per second")
        change = rate * self.seconds
        if not limited.any():
            return lambda controls, actions: controls + change * actions
        low = np.where(limited, low, -np.inf)
        high = np.where(limited, high, np.inf)
        return lambda controls, actions: np.clip(controls + change * actions, low, high)

    def _holding_controls(self, data: mujoco.MjData) -> np.ndarray:
        """Return controls with which servos hold the positions in the data; 0 for
        motors."""
        model = self.model
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        mujoco.mj_transmission(model, data)
        gain = model.actuator_gainprm[:, 0]
        is_servo = (model.actuator_biasprm[:, 1] == -gain) & (gain != 0.0)
        holding = np.where(is_servo, data.actuator_length, 0.0)
        limited = model.actuator_ctrllimited.astype(bool)
        clipped = np.clip(holding, *model.actuator_ctrlrange.T)
        return np.where(limited, clipped, holding)

    def _checked_size(self) -> int:
        """Return the number of numbers in an observation; Refusal where a function
        returns another shape than it should."""
        data = self._scratch
        self.start(np.random.default_rng(0))
        mujoco.mj_forward(self.model, data)
        state = State.of_data(data)
        observed = np.asarray(self._observe(state))
        has_row = observed.ndim == 1 and observed.dtype.kind in "fiub" and observed.size
        require(
            bool(has_row),
            "observation must return a row of numbers, (n,)",
            value=observed,
        )
        self.size = observed.size
        ended = self.ends(state)
        self.rewards(state.copy(), state, np.zeros(self.model.nu), ended)
        return observed.size


def _checked_start(start: Mapping, data: mujoco.MjData) -> dict[str, np.ndarray]:
    """Return the fields of a start; Refusal for others and for wrong sizes."""
    out = {}
    for name, values in start.items():
        _require_word("reset", name, START)
        expected = getattr(data, name).shape
        array = np.asarray(values, float)
        require(
            array.shape == expected and bool(np.isfinite(array).all()),
            f"reset must return {expected[0]} finite numbers for {name}",
            value=values,
        )
        out[name] = array
    return out


def _require_word(argument: str, word: Any, known: tuple[str, ...]) -> None:
    """Raise Refusal for a word that an argument does not know."""
    if word in known:
        return
    near = difflib.get_close_matches(str(word), known, 1, 0.5)
    cure = f"use {' or '.join(map(formatted, known))}"
    if near:
        cure = f"did you mean {formatted(near[0])}?"
    raise Refusal(f"{argument} does not know {formatted(word)}", instead=cure)


def _require_takes(argument: str, function: Callable, takes: tuple[str, ...]) -> None:
    """Raise Refusal for a function that cannot be called with these arguments."""
    try:
        inspect.signature(function).bind(*takes)
    except TypeError:
        raise Refusal(
            f"{argument} must be a function of ({', '.join(takes)})",
            value=function,
        ) from None
    except ValueError:  # some built-in functions do not tell
        return


def _require_shape(argument: str, shape: tuple, expected: tuple, robots: tuple) -> None:
    """Raise Refusal where the result of a function has another shape than it should."""
    cure = ""
    if robots:
        cure = "index the last axes, as in state.qpos[..., 7:]"
    require(
        shape == expected,
        f"{argument} must return the shape {expected}, not {shape}",
        instead=cure,
    )
