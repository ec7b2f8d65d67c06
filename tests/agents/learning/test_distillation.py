import numpy as np
import pytest

from agents.benchmark.evaluate import scores
from agents.config import TrainConfig
from agents.controllers.newton import NewtonController
from agents.environment import make_env
from agents.learning import distillation
from agents.learning.actor import LearnedPolicy
from agents.learning.distillation import REACHED, teacher_actions
from agents.learning.memory import MemoryVecEnv
from agents.learning.sb3_adapter import SB3VecEnv
from agents.learning.training import train
from agents.policy import natural
from agents.tuned import DistilledSettings, sensing_of
from ccr_gym import ENV_IDS


@pytest.mark.parametrize("env_id", sorted(ENV_IDS))
def test_the_teacher_is_exact_and_moves_nothing_by_trying(env_id):
    envs = MemoryVecEnv(SB3VecEnv(env_id, 6, 40, obs_mode="dict", sensing=sensing_of(env_id)))
    envs.reset()
    for _ in range(62):
        before = envs.get_attr("privileged_state", [0])[0]
        actions = teacher_actions(envs, envs.shown)
        after = envs.get_attr("privileged_state", [0])[0]
        assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
        assert np.abs(actions).max() <= 1
        envs.step(actions)
    state = envs.get_attr("privileged_state", [0])[0]
    missed = np.abs(np.linalg.norm(state.force, axis=1) / state.goal - 1)
    assert np.median(missed) < {"CCR/TrackForce-v1": 0.1, "CCR/MovingObstacle-v1": 0.005}.get(env_id, 0.002)


def test_the_teacher_does_what_newtons_controller_does():
    envs = MemoryVecEnv(SB3VecEnv("CCR/PushObstacle-v1", 1, 8, obs_mode="dict", sensing="realistic"))
    env, controller = make_env("CCR/PushObstacle-v1", sensing="realistic"), NewtonController.knowing()
    envs.reset()
    observation, _ = env.reset(seed=8)
    controller.reset(env)
    for _ in range(40):
        label, known = teacher_actions(envs, envs.shown)[0], controller.act(observation)
        state = natural(env.unwrapped.privileged_state, env.unwrapped.settings.scales)
        if abs(np.linalg.norm(state.force) - state.goal) < REACHED:
            break
        assert label == pytest.approx(known, abs=0.15)  # the slope of a trial move is not that at a point
        envs.step(known[None])
        observation, *_ = env.step(known)


def test_a_student_learns(tmp_path, monkeypatch):
    monkeypatch.setattr(distillation, "VALIDATION_EPISODES", 8)
    settings = DistilledSettings(steps=8 * 64 * 24, envs=24, gradient_steps=60, batch_size=256, width=32)
    config = TrainConfig(run=tmp_path, env_id="CCR/LoadCell-v1", learner=settings)
    student = LearnedPolicy(train(config, progress=False))
    assert student.name == "Distilled"
    assert student.training.curve.returns[-1] > student.training.curve.returns[0]
    kwargs = {"sensing": "realistic", "split": "train"}
    assert np.median(scores(student, config.env_id, 300, 12, **kwargs)) < 45  # mN, of set-points of 131
    assert any(tmp_path.glob("log_1/events*"))
