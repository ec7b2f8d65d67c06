import numpy as np
import pytest

from agents.benchmark.evaluate import run_episodes
from agents.controllers.force import ForceController
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
@pytest.mark.parametrize("kind", [ForceController.tuned, ForceController.proportional_only])
def test_with_ideal_sensing_it_reaches_the_set_point(env_id, kind):
    last = np.array([episode.error[-1] for episode in run_episodes(kind(env_id), env_id, seed=50, count=20)])
    median, share = 0.01, 0.8
    if "Track" in env_id:  # a set-point that it follows with a delay
        median, share = 0.15, 0.15
    elif "Moving" in env_id:  # an obstacle that does not wait for it
        median, share = 0.02, 0.6
    assert np.median(last) < median
    assert (last <= 0.05).mean() >= share


def test_it_searches_until_something_touches_and_forgets():
    controller, goal, cable = ForceController(), np.array([0.3], np.float32), np.zeros(1, np.float32)
    cable = np.zeros(1, np.float32)

    def sensor(force):
        return {"force_measured": np.array([0.0, force], np.float32), "desired_force": goal, "cable": cable}

    free = {**sensor(0.0), "contact": np.zeros(38, np.float32)}
    touching, less = ({**sensor(force), "contact": np.ones(38, np.float32)} for force in (0.28, 0.26))
    assert controller.act(free) == 1
    first = controller.act(touching)
    assert 0 < first < 1
    assert controller.act(less) > 2 * first
    controller.reset()
    assert controller.act(touching) == first
    assert controller.act({**sensor(1.3), "contact": np.ones(38, np.float32)}) == -1


def test_what_the_sensor_reads_without_contact_is_taken_off():
    controller, goal, cable = ForceController(), np.array([0.3], np.float32), np.zeros(1, np.float32)
    for reading, touching in (([0.02, -0.01], 0.0), ([0.04, -0.03], 0.0), ([0.03, 0.28], 1.0)):
        seen = {
            "force_measured": np.array(reading, np.float32),
            "desired_force": goal,
            "cable": cable,
        }
        action = controller.act({**seen, "contact": np.full(38, touching, np.float32)})
    assert action == pytest.approx(0, abs=1e-6)


def test_the_same_episodes_give_the_same_numbers():
    first, second = (run_episodes(ForceController(), "CCR/PushObstacle-v1", seed=9, count=2) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.force, b.force)
        assert np.array_equal(a.estimated, b.estimated)
        assert a.statuses == b.statuses
