"""Environments of Gymnasium: the checker's view, rewards, and many robots as one."""

import numpy as np
import pytest

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
gymnasium = pytest.importorskip(
    "gymnasium", reason="needs the extra: pip install 'geomech[gym]'"
)
from gymnasium.utils.env_checker import check_env  # noqa: E402

import geomech.gym  # noqa: E402
from rft.terradynamics.plates import VERTICAL  # noqa: E402

pytestmark = pytest.mark.usefixtures("fastest")
NAME = "geomech/HexapodSand-v0"
needs_batch = pytest.mark.skipif(
    int(mujoco.__version__.partition(".")[0]) < 4, reason="needs mujoco.batch"
)


@pytest.mark.filterwarnings("ignore")  # the checker's advice about infinite bounds
def test_the_checker_has_nothing_to_say():
    env = gymnasium.make(NAME)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()
    assert mujoco.get_mjcb_passive() is None


def test_the_reward_is_the_sum_of_its_parts():
    """Legs that turn all alike drive the robot forwards, at a cost; the trunk's
    velocity is along its own axes."""
    env = geomech.gym.HexapodSand()
    env.reset(seed=1)
    parts = []
    for _ in range(40):
        seen, reward, ended, cut, part = env.step(np.full(6, 0.5))
        assert reward == pytest.approx(sum(part.values())) and not ended and not cut
        parts.append([part["forward"], part["effort"], part["fall"]])
    forward, effort, fall = np.sum(parts, axis=0)
    assert 0.02 * forward == pytest.approx(env.data.qpos[0], abs=1e-9)
    assert env.data.qpos[0] > 0.02 and effort < 0.0 == fall
    mujoco.mj_forward(env.model, env.data)
    turn = env.data.xmat[1].reshape(3, 3)
    own = [*turn[2], *(turn.T @ env.data.qvel[:3])]
    np.testing.assert_allclose(seen[1:7], own, atol=1e-6)
    env.data.qpos[3:7] = [0, 1, 0, 0]
    _, _, ended, _, part = env.step(np.zeros(6))
    assert ended and part["fall"] == -2.0
    env.close()


@needs_batch
def test_many_robots_go_as_each_alone():
    """Also in media of their own; an episode that has ended begins anew."""
    names = ("poppy-seeds-loose", "poppy-seeds-close")
    media = [VERTICAL[name].stress for name in names]
    kind = {"media": media, "max_episode_steps": 20}
    many = gymnasium.make_vec(NAME, 2, "vector_entry_point", **kind)
    many.reset(seed=3)
    starts = many.unwrapped.qpos.copy()
    actions = np.random.default_rng(0).uniform(-1, 1, (20, 2, 6)).astype(np.float32)
    rows = [many.step(action) for action in actions]
    for k, medium in enumerate(media):
        one = geomech.gym.HexapodSand(medium)
        one.reset()
        one.data.qpos[:] = starts[k]
        one.data.ctrl[:] = starts[k, 7:]
        for row, action in zip(rows, actions):
            seen, reward, *_ = one.step(action[k])
            np.testing.assert_allclose(row[0][k], seen, atol=2e-5)
            assert row[1][k] == pytest.approx(reward, abs=1e-9)
        one.close()
    cuts = np.array([row[3] for row in rows])
    assert not cuts[:-1].any() and cuts[-1].all()
    seen, *rest, _ = many.step(actions[0])
    assert not np.any(rest) and seen[0, 0] == pytest.approx(0.09)
    many.unwrapped.qpos[0, 3:7] = [0, 1, 0, 0]
    falls = [many.step(0 * actions[0])[2].tolist() for _ in range(3)]
    assert falls == [[True, False], [False, False], [False, False]]
    many.close()


@pytest.mark.parametrize("count", [1, pytest.param(3, marks=needs_batch)])
def test_what_is_no_number_truncates_an_episode(count):
    """Of many robots only that one's."""
    env = geomech.gym.HexapodSand() if count == 1 else geomech.gym.HexapodSands(count)
    env.reset(seed=1)
    actions = np.zeros((count, 6))
    actions[0] = np.nan
    seen, reward, ended, cut, info = env.step(actions[0] if count == 1 else actions)
    assert np.ravel(cut).tolist() == [True, False, False][:count]
    assert not np.any(ended) and np.isfinite([*np.ravel(seen), *np.ravel(reward)]).all()
    assert np.ravel(info["reason"])[0] == "the action must be finite numbers"
    env.close()
