"""States are taken out and put back, copied, pickled and forked; whatever continues, continues with the same bits."""

import copy
import multiprocessing
import pickle

import gymnasium
import numpy as np
import pytest
from comparison import same

import ccr_gym
from solver import Circle

EVERY_ID = pytest.mark.parametrize("env_id", sorted(ccr_gym.ENV_IDS))
EVERY_SENSING = pytest.mark.parametrize("sensing", ["ideal", "realistic", "sensorless"])
STEPS = 80


def make(env_id, **kwargs):
    return gymnasium.make(env_id, disable_env_checker=True, **kwargs).unwrapped


def make_vec(env_id, count=4, **kwargs):
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", max_episode_steps=30, **kwargs)


def actions_of(env, steps=STEPS):
    generator = np.random.default_rng(5)
    return np.clip(generator.normal(0.3, 0.6, (steps, *env.action_space.shape)), -1, 1).astype(np.float32)


def go_on(env, actions):
    """Return what an environment returns from here on, a reset included."""
    return [*(env.step(action) for action in actions[:-1]), env.reset(), env.step(actions[-1])]


def go_on_elsewhere(pickled, state, actions, results):
    """Continue two copies in another process."""
    env = pickle.loads(pickled)
    other = copy.deepcopy(env)
    other.reset(seed=99)
    other.set_state(state)
    results.put((go_on(env, actions), go_on(other, actions)))


@EVERY_ID
@EVERY_SENSING
def test_copies_continue_with_the_same_bits(env_id, sensing):
    env = make(env_id, sensing=sensing)
    env.reset(seed=2)
    actions = actions_of(env)
    for action in actions[:25]:
        env.step(action)
    state, copies = env.get_state(), [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    fresh = make(env_id, sensing=sensing)
    fresh.set_state(pickle.loads(pickle.dumps(state)))
    going = go_on(env, actions[25:])
    for other in (*copies, fresh):
        same(tuple(going), tuple(go_on(other, actions[25:])))
    env.set_state(state)
    same(tuple(going), tuple(go_on(env, actions[25:])))


@pytest.mark.parametrize("env_id", ["CCR/PushObstacle-v1", "CCR/SpatialPush-v1"])
def test_copies_continue_in_another_process(env_id):
    env = make(env_id, sensing="realistic")
    env.reset(seed=2)
    actions = actions_of(env, 40)
    for action in actions[:20]:
        env.step(action)
    context = multiprocessing.get_context("spawn")
    results = context.Queue()
    arguments = pickle.dumps(env), env.get_state(), actions[20:], results
    process = context.Process(target=go_on_elsewhere, args=arguments)
    process.start()
    elsewhere = results.get(timeout=120)
    process.join()
    going = go_on(env, actions[20:])
    for other in elsewhere:
        same(tuple(going), tuple(other))


@EVERY_ID
@pytest.mark.parametrize("sensing", ["ideal", "realistic"])
def test_vector_environments_continue_with_the_same_bits(env_id, sensing):
    env = make_vec(env_id, sensing=sensing)
    env.reset(seed=2)
    actions = actions_of(env)
    for action in actions[:25]:
        env.step(action)
    copies = [copy.deepcopy(env), pickle.loads(pickle.dumps(env)), make_vec(env_id, sensing=sensing)]
    copies[-1].set_state(env.get_state())
    going = go_on(env, actions[25:])
    for other in copies:
        same(tuple(going), tuple(go_on(other, actions[25:])))


@EVERY_SENSING
def test_forks_are_copies_that_part_by_their_actions(sensing):
    env = make_vec("CCR/PushObstacle-v1", sensing=sensing)
    env.reset(seed=1)
    for action in actions_of(env, 20):
        env.step(action)
    twin = copy.deepcopy(env)
    env.fork([2, 2, 0, 3])
    action = np.full((4, 1), 0.5, np.float32)
    forked, going = env.step(action)[0], twin.step(action)[0]
    assert np.array_equal(forked, going[[2, 2, 0, 3]])
    action[1] = -0.5
    forked = env.step(action)[0]
    assert not np.array_equal(forked[0], forked[1])
    assert np.array_equal(env.reset()[0][:2], twin.reset()[0][[2, 2]])  # the generators are copies, too


def test_generators_of_another_kind_go_on_too():
    env, fresh, used = (make("CCR/PushObstacle-v1") for _ in range(3))
    env.np_random = np.random.Generator(np.random.MT19937(3))
    used.reset(seed=1)
    env.reset()
    state = env.get_state()
    for other in (fresh, used):
        other.set_state(state)
    going = env.reset()
    for other in (fresh, used):
        same(going, other.reset())


class ForeignBits(np.random.PCG64):
    """Bits of another package, of which a state holds the name alone."""


@pytest.mark.parametrize("vector", [False, True])
def test_a_generator_that_cannot_be_made_is_refused_and_changes_nothing(vector):
    env, other = (make_vec("CCR/PushObstacle-v1", 1) if vector else make("CCR/PushObstacle-v1") for _ in range(2))
    for each in (env, other):
        each.reset(seed=1)
    foreign = np.random.Generator(ForeignBits(3))
    if vector:
        other._generators = [foreign]
    else:
        other.np_random = foreign
    other.reset()
    state, twin = other.get_state(), copy.deepcopy(env)
    with pytest.raises(ValueError, match="generator 'ForeignBits'; it must be one of MT19937"):
        env.set_state(state)
    same(env.step(env.action_space.sample() * 0), twin.step(env.action_space.sample() * 0))
    same(env.reset(), twin.reset())
    going = other.reset()
    other.set_state(state)  # its own generator is of that kind
    same(going, other.reset())


def test_pictures_begin_anew_with_a_state():
    env, fresh = (make("CCR/PushObstacle-v1", render_mode="rgb_array") for _ in range(2))
    action = np.ones(1, np.float32)
    env.reset(seed=0)
    for _ in range(5):
        env.step(action)
    state = env.get_state()
    for _ in range(7):
        env.step(action)
    for each in (env, fresh):
        each.set_state(state)
    assert np.array_equal(env.render(), fresh.render())


def test_pictures_of_a_fork_are_of_the_episode_that_it_copies():
    env = make_vec("CCR/PushObstacle-v1", 2, render_mode="rgb_array")
    env.reset(seed=0)
    for action in actions_of(env, 5):
        env.step(action)
    env.fork([1, 1])
    first, second = env.render()
    assert np.array_equal(first, second)


def test_states_hold_scenes_of_another_number_of_obstacles():
    env = make("CCR/PushObstacle-v1")
    scene = [Circle(center=(44.0, 104.0), radius=12), Circle(center=(60.0, 150.0), radius=12)]
    env.reset(options={"scene": scene, "desired_force": 0.1})
    env.step(np.ones(1, np.float32))
    state = env.get_state()
    env.reset(seed=0)
    env.set_state(state)
    assert len(env.equilibrium.scene) == 2
    assert env.equilibrium.cable_mm == 0.5


@pytest.mark.parametrize(
    ("state", "error", "message"),
    [
        (lambda: None, TypeError, "what get_state"),
        (lambda: make_vec("CCR/PushObstacle-v1").get_state(), ValueError, "4 environments; it must be of 1"),
    ],
)
def test_other_states_are_refused_and_change_nothing(state, error, message):
    env = make("CCR/PushObstacle-v1")
    env.reset(seed=0)
    before = env.step(np.ones(1, np.float32))[0]
    with pytest.raises(error, match=message):
        env.set_state(state())
    other = make("CCR/PushObstacle-v1", robot="guidewire")
    other.reset(seed=0)
    with pytest.raises(ValueError, match="another robot"):
        env.set_state(other.get_state())
    assert np.array_equal(env.step(np.zeros(1, np.float32))[0], before)


@pytest.mark.parametrize(
    ("kwargs", "names"),
    [
        ({"env_id": "CCR/MovingObstacle-v1"}, "task 'MovingObstacle'"),
        ({"env_id": "CCR/TrackForce-v1"}, "task 'TrackForce'"),
        ({"env_id": "CCR/SoftObstacle-v1"}, "task 'SoftObstacle'"),
        ({"sensing": "ideal"}, "sensing 'ideal'"),
        ({"sensing": "sensorless"}, "sensing 'sensorless'"),
        ({"regulate": "estimate"}, "regulate 'estimate'"),
        ({"estimator": "paper"}, "estimator 'paper'"),
        ({"randomize": {"offset": (0.8, 1.25)}}, "randomize Randomization"),
    ],
)
def test_states_of_another_kind_are_refused_and_change_nothing(kwargs, names):
    usual = {"env_id": "CCR/PushObstacle-v1", "sensing": "realistic"}
    env, other = make(**usual), make(**{**usual, **kwargs})
    for one, two in ((env, other), (other, env)):
        one.reset(seed=0)
        two.reset(seed=1)
        action = np.full(one.action_space.shape, 0.7, np.float32)
        for _ in range(20):
            one.step(action)
            two.step(action)
        twin = copy.deepcopy(one)
        with pytest.raises(ValueError, match="the state is of an environment with") as caught:
            one.set_state(two.get_state())
        assert names in str(caught.value)
        same(one.step(action), twin.step(action))


def test_a_state_of_another_robot_among_other_obstacles_changes_nothing():
    env, other = make("CCR/PushObstacle-v1"), make("CCR/PushObstacle-v1", robot="guidewire")
    far = 4 * other.settings.robot.length_mm
    scene = [Circle(center=(side * far, far), radius=far / 9) for side in (-1, 1)]
    env.reset(seed=0)
    other.reset(options={"scene": scene, "desired_force": other.settings.scales.force_n})
    with pytest.raises(ValueError, match="another robot"):
        env.set_state(other.get_state())
    assert len(env.equilibrium.scene) == 1


@pytest.mark.parametrize("indices", [[0, 1], [0, 1, 2, 4], [-1, 0, 0, 0], [0.5, 0, 0, 0], None])
def test_forks_of_no_environment_are_refused(indices):
    env = make_vec("CCR/PushObstacle-v1")
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.fork([0, 1, 2, 3])
    env.reset(seed=0)
    with pytest.raises(ValueError, match="indices is"):
        env.fork(indices)
