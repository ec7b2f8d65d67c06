"""Trial pulls that are to reach an estimated force: the kernel does what the parts of an environment do one by one."""

import gymnasium
import numpy as np
import pytest

from ccr_gym.estimation import ForceEstimator
from ccr_gym.quantities import norm
from ccr_gym.sampling import MARGIN, PULL, Trials
from solver import Status

COUNT = 24
CASES = (
    ("PushObstacle-Paper", {}),
    ("SpatialPush-Paper", {}),
    ("SpatialPush-Paper", {"task": {"force_vector": True}}),
    ("BracedPush", {"regulate": "estimate"}),
    ("InsertAndPush", {"regulate": "estimate"}),
    ("SpatialPush", {"regulate": "estimate", "estimator": "paper"}),
    ("PushObstacle", {"regulate": "estimate", "randomize": {"length": (0.8, 1.2), "offset": (0.8, 1.2)}}),
)


def pulled_step_by_step(adapter, batch, robots, drawn, wanted, commands, limit, target):
    """Whether the estimated forces of robots reach those wanted, and what they are in the end."""
    estimator, layout = ForceEstimator(adapter, batch, learns=False), adapter.layout
    batch.rest(robots)
    estimator.rest(robots, [own.robot for own in drawn], batch.blocks)
    lengths, pulled, going = layout.length(batch.blocks).copy(), 0.0, list(robots)
    found, reached = np.zeros(len(robots), bool), np.zeros((len(robots), adapter.space))
    while going and pulled < limit:
        pulled, at = min(pulled + PULL * adapter.scales.travel_mm, limit), np.array(going)
        spare = adapter.actions.size - commands.shape[1]
        actuated = adapter.bounded(np.concatenate([pulled * commands[at], lengths[at, :spare]], axis=1))
        adapter.write_command(batch.commands, actuated, going)
        batch.move(going)
        blocks = batch.blocks[at]
        tensions, onsets = (np.ascontiguousarray(field(blocks)) for field in (layout.tensions, layout.onset))
        estimator.kernel.prepare(at, blocks, actuated)
        estimator.move_free(at, blocks)
        estimator.kernel.update(at, blocks, actuated, tensions, onsets)
        reached[at] = estimator.chosen[at, None] * adapter.force(blocks, target)
        converged = batch.statuses[at] == Status.CONVERGED
        found[at] = converged & (norm(reached[at]) >= wanted[at])
        going = at[converged & ~found[at]].tolist()
    return found, reached


@pytest.mark.parametrize(("name", "settings"), CASES)
def test_pulls_by_estimate_do_what_steps_and_estimates_do(name, settings):
    made = (gymnasium.make_vec, {"num_envs": COUNT, "vectorization_mode": "vector_entry_point"})
    env = made[0](f"CCR/{name}-v1", **made[1], **settings)
    env.reset(seed=1)
    episodes, generator = env.unwrapped._episodes, np.random.default_rng(2)
    task, batch, adapter = env.unwrapped.task, episodes.batch, episodes.adapter
    trials = Trials(task, env.unwrapped.settings, batch, adapter)
    robots, (_, drawn) = list(range(COUNT)), episodes._sample_hidden([generator] * COUNT)
    sampled = []
    for robot in robots:
        while True:
            assignment = task.sample(drawn[robot].robot or batch.robot, generator)
            if batch.assign_if_clear(robot, assignment.scene, drawn[robot].robot):
                sampled.append(assignment)
                break
    wanted = MARGIN * np.array([assignment.desired_force for assignment in sampled])
    commands = adapter.actuation.steady(np.array([assignment.direction for assignment in sampled]))
    found, reached = trials._pull_by_estimate(robots, drawn, wanted, commands)
    at_rest = batch.blocks.copy()
    arguments = adapter, batch, robots, drawn, wanted, commands, trials._limit_mm, task.target
    expected_found, expected = pulled_step_by_step(*arguments)
    assert np.array_equal(found, expected_found)
    assert found.any()
    assert np.array_equal(reached, expected)
    batch.rest(robots)
    assert np.array_equal(batch.blocks, at_rest)  # the pulls have left the robots at rest
