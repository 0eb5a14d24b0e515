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
    """Legs that turn all alike drive the robot forwards, at a cost; the trunk's velocity is along its own axes."""
    env = geomech.gym.HexapodSand()
    seen, _ = env.reset(seed=1)
    total = dict.fromkeys(("forward", "effort", "fall"), 0.0)
    for _ in range(40):
        seen, reward, ended, cut, parts = env.step(np.full(6, 0.5))
        assert reward == pytest.approx(sum(parts.values())) and not ended and not cut
        total = {name: total[name] + parts[name] for name in total}
    assert (
        0.02 * total["forward"] == pytest.approx(env.data.qpos[0], abs=1e-9)
        and env.data.qpos[0] > 0.02
    )
    assert total["effort"] < 0.0 == total["fall"]
    mujoco.mj_forward(env.model, env.data)
    turn = env.data.xmat[1].reshape(3, 3)
    np.testing.assert_allclose(seen[1:4], turn[2], atol=1e-6)
    np.testing.assert_allclose(seen[4:7], turn.T @ env.data.qvel[:3], atol=1e-6)
    env.data.qpos[3:7] = [0, 1, 0, 0]
    _, reward, ended, _, parts = env.step(np.zeros(6))
    assert ended and parts["fall"] == -2.0
    env.close()


@needs_batch
def test_many_robots_go_as_each_alone():
    """Also in media of their own; an episode that has ended begins anew with the next step."""
    media = [
        VERTICAL[name].stress for name in ("poppy-seeds-loose", "poppy-seeds-close")
    ]
    many = gymnasium.make_vec(
        NAME, 2, "vector_entry_point", media=media, max_episode_steps=20
    )
    many.reset(seed=3)
    starts, rng = many.unwrapped.qpos.copy(), np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (20, 2, 6)).astype(np.float32)
    rows = [many.step(action) for action in actions]
    spaces = many.unwrapped.single_observation_space, many.unwrapped.single_action_space
    for k, medium in enumerate(media):
        one = geomech.gym.HexapodSand(medium)
        assert spaces == (one.observation_space, one.action_space)
        one.reset()
        one.data.qpos[:], one.data.ctrl[:] = starts[k], starts[k, 7:]
        for row, action in zip(rows, actions):
            seen, reward, *_ = one.step(action[k])
            np.testing.assert_allclose(row[0][k], seen, atol=2e-5)
            assert row[1][k] == pytest.approx(reward, abs=1e-9)
        one.close()
    assert not rows[-2][3].any() and rows[-1][3].all() and not rows[-1][2].any()
    seen, reward, ended, cut, _ = many.step(actions[0])
    assert (
        not reward.any()
        and not ended.any()
        and not cut.any()
        and seen[0, 0] == pytest.approx(0.09)
    )
    many.close()


def test_what_is_no_number_truncates_an_episode():
    env = geomech.gym.HexapodSand()
    env.reset(seed=1)
    seen, reward, ended, cut, info = env.step(np.full(6, np.nan))
    assert cut and not ended and reward == 0.0 and np.isfinite(seen).all()
    assert info["reason"] == "the action is no number"
    env.reset(seed=1)
    env.data.qvel[0] = np.nan
    seen, _, ended, cut, info = env.step(np.zeros(6))
    assert cut and not ended and "the motion is no number" in info["reason"]
    env.close()
    for call in (env.reset, lambda: env.step(np.zeros(6))):
        with pytest.raises(ValueError, match="the environment is closed: make it anew"):
            call()


@needs_batch
def test_what_is_no_number_truncates_one_of_many_episodes():
    env = geomech.gym.HexapodSands(3)
    env.reset(seed=1)
    actions = np.zeros((3, 6))
    actions[1] = np.nan
    seen, reward, ended, cut, info = env.step(actions)
    assert cut.tolist() == [False, True, False] and not ended.any()
    assert [*info["reason"]] == ["", "the action is no number", ""]
    assert np.isfinite(seen).all() and np.isfinite(reward).all()
    env.qvel[2, 0] = np.nan
    _, _, _, cut, info = env.step(np.zeros((3, 6)))
    assert cut.tolist() == [False, False, True]
    env.close()
