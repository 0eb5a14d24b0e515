"""Environments of any MJCF in sand: observation, reward, start and end by keyword and
by function, for one robot and for many."""

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
import rft  # noqa: E402

pytestmark = pytest.mark.usefixtures("fastest")
NAME = "geomech/Sand-v0"
needs_batch = pytest.mark.skipif(
    int(mujoco.__version__.partition(".")[0]) < 4, reason="needs mujoco.batch"
)
LEG = """<body pos="{x} {y} 0"><joint name="hip_{k}" axis="0 1 0" range="-1.2 1.2"
armature="0.001"/><geom name="leg_{k}" type="capsule" size="0.01" mass="0.03"
fromto="0 0 0 0 0 -0.06"/><geom name="toe_{k}" type="sphere" size="0.015"
pos="0 0 -0.086" mass="0.01"/></body>"""
MOTOR = '<position joint="hip_{k}" kp="3" kv="0.05" ctrlrange="-1 0.5"/>'
QUADRUPED = """<mujoco><compiler angle="radian"/><option timestep="0.002"/>
<worldbody><body name="trunk" pos="0 0 0.11"><freejoint/>
<geom name="trunk" type="box" size="0.08 0.04 0.015" mass="0.5"/>
<site name="trunk"/>{}</body></worldbody>
<actuator>{}</actuator><sensor><gyro site="trunk"/></sensor></mujoco>""".format(
    "".join(
        LEG.format(x=x, y=y, k=k)
        for k, (x, y) in enumerate(
            [(0.06, 0.05), (0.06, -0.05), (-0.06, 0.05), (-0.06, -0.05)]
        )
    ),
    "".join(MOTOR.format(k=k) for k in range(4)),
)
GEOMS = ["leg_*", "toe_*", "trunk"]
SWING = """<mujoco><worldbody><body pos="0 0 0.05"><joint axis="0 1 0"/>
<geom type="capsule" size="0.01" fromto="0 0 0 0 0 -0.08"/></body></worldbody>
<actuator><motor joint="{}" ctrlrange="-1 1"/></actuator></mujoco>"""
SWING = SWING.replace('axis="0 1 0"', 'name="j" axis="0 1 0"').format("j")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "quadruped.xml"
    path.write_text(QUADRUPED)
    return path


@pytest.fixture
def make():
    """Function that makes an environment, which the end of the test closes."""
    made = []

    def of(xml=QUADRUPED, geoms=GEOMS, **options):
        env = gymnasium.make(NAME, xml=xml, geoms=geoms, **options)
        made.append(env)
        return env.unwrapped

    yield of
    for env in made:
        env.close()


def run(env, actions, seed=1):
    """Return observations, rewards and ends of actions."""
    rows = [env.reset(seed=seed)[0]]
    rewards = []
    for action in actions:
        seen, reward, ended, cut, _ = env.step(action)
        rows.append(seen)
        rewards.append(reward)
        assert not ended and not cut
    return np.array(rows), np.array(rewards)


@pytest.mark.filterwarnings("ignore")  # the checker's advice about infinite bounds
def test_the_checker_has_nothing_to_say(file):
    env = gymnasium.make(NAME, xml=file, geoms=GEOMS, reset=0.1)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()
    assert mujoco.get_mjcb_passive() is None


def test_steps_are_those_of_attach_by_hand(make, file):
    """To the last digit, with the actions scaled to the ctrlrange; also from the text,
    and from a compiled model."""
    actions = np.random.default_rng(0).uniform(-1, 1, (30, 4))
    model = mujoco.MjModel.from_xml_path(str(file))
    envs = [make(xml, slope=0.1) for xml in (file, str(file), QUADRUPED, model)]
    for env in envs:
        run(env, actions)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with rft.mujoco.attach(model, "poppy-seeds-loose", GEOMS, slope=0.1) as sand:
        for action in actions:
            data.ctrl[:] = -0.25 + 0.75 * action
            mujoco.mj_step(model, data, 10)
        assert sand.geoms == envs[0].sand.geoms and len(sand.geoms) == 9
    for env in envs:
        np.testing.assert_array_equal(env.data.qpos, data.qpos)
        np.testing.assert_array_equal(env.data.qvel, data.qvel)
    assert data.qpos[2] < 0.11


def test_a_seed_repeats_and_another_differs(make):
    """Also after an episode."""
    actions = np.random.default_rng(0).uniform(-1, 1, (5, 4))
    env = make(reset=0.2)
    first = run(env, actions)
    again = run(env, actions)
    for a, b in zip(first, again):
        np.testing.assert_array_equal(a, b)
    assert (run(env, actions, seed=2)[0] != first[0]).any()
    assert np.abs(first[0][0, 10:14]).max() <= 0.2


def test_the_state_that_is_observed(make):
    """Height, vertical, velocities, positions and rates of the joints; a hinge without
    a range counts up to a turn."""
    env = make()
    env.reset(seed=0)
    env.data.qpos[3:7] = [np.cos(0.1), 0.0, np.sin(0.1), 0.0]
    env.data.qvel[:] = np.arange(10.0)
    seen = env.task.observe(env.state)
    own = [2 * np.cos(0.2), 1.0, 2 * np.sin(0.2)]  # of the velocity 0, 1, 2
    own[0] = -2 * np.sin(0.2)
    own[2] = 2 * np.cos(0.2)
    vertical = [-np.sin(0.2), 0.0, np.cos(0.2)]
    joints = [*env.data.qpos[7:], *range(6, 10)]
    expected = [0.11, *vertical, *own, 3, 4, 5, *joints]
    np.testing.assert_allclose(seen, expected, atol=1e-6)
    swing = make(SWING, None, reward={"effort": 1.0})
    swing.reset(seed=0)
    swing.data.qpos[0] = 0.3 + 4 * np.pi
    seen = swing.task.observe(swing.state)
    np.testing.assert_allclose(seen, [np.cos(0.3), np.sin(0.3), 0.0], atol=1e-6)


def depth(state):
    """Return height of the trunk, and all joints, of one robot or of many."""
    return np.concatenate([state.qpos[..., 2:3], state.qpos[..., 7:]], -1)


def sideways(before, after, action):
    return {
        "way": after.qpos[..., 1] - before.qpos[..., 1],
        "calm": -(np.asarray(action) ** 2).sum(-1),
    }


def crouch(model, rng):
    qpos = model.qpos0.copy()
    qpos[7:] = rng.uniform(0.1, 0.3, 4)
    return qpos


def is_low(state):
    return state.qpos[..., 2] < 0.09


FUNCTIONS = {
    "observation": depth,
    "reward": sideways,
    "reset": crouch,
    "terminated": is_low,
}


def test_functions_observe_reward_start_and_end(make):
    env = make(**FUNCTIONS)
    seen, _ = env.reset(seed=4)
    assert env.observation_space.shape == (5,)
    assert seen[0] == np.float32(0.11) and (seen[1:] >= 0.1).all()
    np.testing.assert_array_equal(env.data.ctrl, env.data.qpos[7:])
    y = env.data.qpos[1]
    action = np.full(4, 0.5)
    ended = False
    while not ended:
        _, reward, ended, cut, info = env.step(action)
        assert info["calm"] == -1.0 and not cut
        assert reward == info["way"] + info["calm"]
        assert info["way"] == env.data.qpos[1] - y
        y = env.data.qpos[1]
        assert ended == (env.data.qpos[2] < 0.09) and env.data.time < 2.0
    assert 0.02 < env.data.time


def test_words_choose_sensors_weights_and_no_end(make):
    actions = np.random.default_rng(0).uniform(-1, 1, (6, 4))
    plain = make()
    _, rewards = run(plain, actions)
    env = make(observation="sensors", reward={"forward": 3.0}, terminated=None)
    seen, forward = run(env, actions)
    np.testing.assert_array_equal(seen[-1], np.float32(env.data.sensordata))
    x = env.data.qpos[0]
    assert 0.02 * forward.sum() == pytest.approx(3 * x, abs=1e-12)
    assert 0.02 * rewards.sum() < x
    env.data.qpos[3:7] = plain.data.qpos[3:7] = [0, 1, 0, 0]
    assert not env.step(actions[0])[2]
    *_, ended, _, info = plain.step(actions[0])
    assert ended and info["fall"] == -2.0


def test_an_episode_starts_in_the_first_keyframe(make):
    key = '<keyframe><key qpos="0 0 .1 1 0 0 0 .1 .2 .1 .2" ctrl=".1 .1 .3 .2"/>'
    env = make(QUADRUPED.replace("</mujoco>", f"{key}</keyframe></mujoco>"))
    seen, _ = env.reset(seed=0)
    np.testing.assert_allclose(seen[10:14], [0.1, 0.2, 0.1, 0.2], atol=1e-7)
    np.testing.assert_array_equal(env.data.ctrl, [0.1, 0.1, 0.3, 0.2])


def test_rates_of_controls_stay_within_their_range(make):
    env = make(control_rate=5.0)
    env.reset(seed=0)
    env.step(np.array([1.0, -1.0, 0.5, 7.0]))
    np.testing.assert_allclose(env.data.ctrl, [0.1, -0.1, 0.05, 0.1])
    for _ in range(20):
        env.step(np.ones(4))
    np.testing.assert_array_equal(env.data.ctrl, 0.5)


@needs_batch
@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("options", [{"reset": 0.2}, FUNCTIONS])
def test_many_robots_go_as_each_alone(options, make):
    """With the same functions, which index the last axes."""
    many = gymnasium.make_vec(
        NAME, 3, "vector_entry_point", xml=QUADRUPED, geoms=GEOMS, **options
    )
    rows = [many.reset(seed=3)[0]]
    starts = many.unwrapped.qpos.copy()
    actions = np.random.default_rng(0).uniform(-1, 1, (3, 3, 4)).astype(np.float32)
    steps = [many.step(action) for action in actions]
    for k in range(3):
        one = make(**options)
        one.reset()
        one.data.qpos[:] = starts[k]
        one.data.ctrl[:] = starts[k, 7:]
        np.testing.assert_array_equal(one.task.observe(one.state), rows[0][k])
        for step, action in zip(steps, actions):
            seen, reward, ended, *_ = one.step(action[k])
            np.testing.assert_allclose(step[0][k], seen, atol=2e-5)
            assert step[1][k] == pytest.approx(reward, abs=1e-9)
            assert step[2][k] == ended
    many.close()


@needs_batch
def test_a_function_for_one_robot_is_refused_for_many():
    many = geomech.gym.SandVectorEnv(
        QUADRUPED, 3, geoms=GEOMS, observation=lambda state: state.qpos[2:]
    )
    with pytest.raises(ValueError, match=r"\(3, 9\), not \(1, 11\): index the last"):
        many.reset(seed=0)
    with pytest.raises(ValueError, match=r"have the shape \(3, 4\), not \(4,\)"):
        many.step(np.zeros(4))
    many.close()


def test_the_error_of_actions_falls_with_the_time_step(make):
    """As its order says, and is the distance to a finer run; the episode stays as it
    is."""
    actions = np.random.default_rng(0).uniform(-1, 1, (10, 4))
    errors = []
    places = []
    for timestep, skip in (("0.002", 10), ("0.0005", 40)):
        env = make(QUADRUPED.replace("0.002", timestep), frame_skip=skip)
        env.reset(seed=0)
        start = env.data.qpos.copy()
        errors.append(env.error(actions))
        np.testing.assert_array_equal(env.data.qpos, start)
        for action in actions:
            env.step(action)
        mujoco.mj_kinematics(env.model, env.data)
        places.append([env.data.geom(name).xpos.copy() for name in env.sand.geoms])
    coarse, fine = errors
    distance = np.linalg.norm(np.subtract(*places), axis=1).max()
    assert distance == pytest.approx(coarse.step - fine.step, rel=0.2)
    assert fine.step == pytest.approx(coarse.step / 4, rel=0.2)
    assert 0 < coarse.elements < coarse.moved


def test_a_urdf_stands_on_the_force_of_its_weight(make, tmp_path):
    """A box of 0.5 kg, with a freejoint and a motor that MjSpec adds; without these the
    file has no actuators."""
    size = '<geometry><box size="0.1 0.1 0.02"/></geometry>'
    text = f"""<robot name="r"><link name="base"><inertial><mass value="0.5"/>
<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
<collision name="sole">{size}</collision><visual>{size}</visual></link></robot>"""
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(ValueError, match="the robot has no actuators"):
        geomech.gym.SandEnv(path)
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    base = spec.body("base")
    base.add_freejoint(name="free")
    base.pos = [0, 0, 0.02]
    spec.add_actuator(
        target="free",
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        gear=[1, 0, 0, 0, 0, 0],
        ctrlrange=[-1, 1],
        ctrllimited=True,
    )
    env = make(spec.compile(), "sole")
    run(env, np.zeros((50, 1)))
    mujoco.mj_forward(env.model, env.data)
    force = env.sand.forces(env.data)
    np.testing.assert_allclose(force, [[0, 0, 0.5 * 9.81]], atol=1e-3)


def bad(**options):
    return lambda: geomech.gym.SandEnv(QUADRUPED, **options)


WRONG = {
    "there is no MJCF file none.xml: it is looked for in": lambda: geomech.gym.SandEnv(
        "none.xml"
    ),
    "xml is not an MJCF that MuJoCo can read": lambda: geomech.gym.SandEnv("<mu>"),
    "xml must be the name of an MJCF file, its text": lambda: geomech.gym.SandEnv(3),
    "the model has no geom 'leg-\\*': did you mean 'leg_": bad(geoms=["leg-*"]),
    "there is no medium 'poppy-seed-loose': did you mean": bad(
        medium="poppy-seed-loose"
    ),
    "observation must be a function of \\(state\\)": bad(observation=sideways),
    "observation must return a row of numbers": bad(observation=lambda state: "up"),
    "observation does not know 'sensor': did you mean 'sensors'": bad(
        observation="sensor"
    ),
    "reward must be a function of \\(before, after, action\\)": bad(reward=depth),
    "reward must return the shape \\(\\), not \\(11,\\)": bad(
        reward=lambda before, after, action: after.qpos
    ),
    "reward does not know 'foward': did you mean 'forward'": bad(
        reward={"foward": 1.0}
    ),
    "terminated must return the shape \\(\\), not \\(5,\\)": bad(terminated=depth),
    "reset must return 11 finite numbers for qpos": bad(
        reset=lambda model, rng: np.zeros(3)
    ),
    "reset must be a number": bad(reset=-1.0),
    "frame_skip must be": bad(frame_skip=0),
    "there is no argument 'levle': did you mean level": bad(levle=0.1),
    "has no ctrlrange.*give it one.*control_rate": lambda: geomech.gym.SandEnv(
        QUADRUPED.replace(' ctrlrange="-1 0.5"', "")
    ),
    "the robot has no actuators": lambda: geomech.gym.SandEnv(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody>"
        "</mujoco>"
    ),
    "no body has a freejoint": lambda: geomech.gym.SandEnv(SWING),
}


@pytest.mark.parametrize("message", WRONG)
def test_what_makes_no_sense_is_refused_in_one_line(message):
    with pytest.raises(ValueError, match=message) as refused:
        WRONG[message]()
    assert "\n" not in str(refused.value)
    assert mujoco.get_mjcb_passive() is None


def test_actions_that_do_not_fit(make):
    """A wrong number of them is refused; what is no number truncates."""
    env = make()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"an action must have the shape \(4,\)"):
        env.step(np.zeros(3))
    *_, ended, cut, info = env.step(np.full(4, np.nan))
    assert cut and not ended and "finite" in info["reason"]
