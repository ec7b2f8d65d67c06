"""Steps per second of the environments and of learning, next to peers measured in the same run."""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecMonitor
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.benchmark.evaluate import run_episodes
from agents.config import EVALUATION_SEED, TrainConfig
from agents.files import JsonObject
from agents.learning.actor import LearnedPolicy
from agents.learning.learners import make_learner, normalized_envs
from agents.learning.sb3_adapter import SB3VecEnv
from agents.learning.training import train
from agents.tuned import PPO_IDEAL

OURS, PEER = "CCR/PushObstacle-v1", "Pendulum-v1"
ROUNDS = 7  # the median counts


class IdleVecEnv(SB3VecEnv):
    """Environments of the same spaces and episodes in which nothing happens, to measure the learner alone."""

    def __init__(self, env_id: str, n_envs: int) -> None:
        super().__init__(env_id, n_envs, seed=0)
        self._still = np.asarray(super().reset())
        length = self.get_attr("max_episode_steps")[0]
        assert isinstance(length, int)
        self._steps, self._length = 0, length

    def step_wait(self) -> VecEnvStepReturn:
        """Return the first observation again, and the end of all episodes at once."""
        self._steps += 1
        ended = self._steps % self._length == 0
        end = {"terminal_observation": self._still[0], "TimeLimit.truncated": True}
        dones = np.full(self.num_envs, ended)
        infos = [dict(end) if ended else {} for _ in range(self.num_envs)]
        return self._still, np.zeros(self.num_envs, np.float32), dones, infos


def rates(runs: dict[str, Callable[[], int]]) -> dict[str, float]:
    """Return the steps per second of runs, which return their number of steps; medians of alternating rounds."""
    seconds: dict[str, list[float]] = {name: [] for name in runs}
    steps = {}
    for _ in range(ROUNDS):
        for name, run in runs.items():
            begin = time.perf_counter()
            steps[name] = run()
            seconds[name].append(time.perf_counter() - begin)
    return {name: steps[name] / float(np.median(times)) for name, times in seconds.items()}


def single(env_id: str, steps: int = 6400, **kwargs: object) -> Callable[[], int]:
    """Return a run of one environment from ``gymnasium.make``, resets included."""
    env = gymnasium.make(env_id, None, None, **kwargs)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(1000)]

    def run() -> int:
        for i in range(steps):
            *_, terminated, truncated, _ = env.step(actions[i % len(actions)])
            if terminated or truncated:
                env.reset()
        return steps

    return run


def vector(env_id: str, count: int, mode: str, steps: int = 130, **kwargs: object) -> Callable[[], int]:
    """Return a run of a vector environment, resets included; by default of two of our episodes."""
    env = gymnasium.make_vec(env_id, count, mode, None, None, **kwargs)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(64)]

    def run() -> int:
        for i in range(steps):
            env.step(actions[i % len(actions)])
        return count * steps

    return run


def environments(counts: tuple[int, ...] = (1, 4, 16, 64, 256, 1024)) -> JsonObject:
    """Measure single and vector environments, next to Pendulum."""
    ours = single(OURS, obs_mode="flat")
    alone = rates({"ours": ours, "peer": single(PEER)})
    runs = {f"{count} × {threads}": _ours(count, threads) for count in sorted({*counts, 256}) for threads in (1, 2)}
    many = rates({**runs, "peer": vector(PEER, 256, "sync", steps=40)})
    return {
        "single_steps_per_s": alone["ours"],
        "single_pendulum_steps_per_s": alone["peer"],
        "single_ratio": alone["ours"] / alone["peer"],
        "vector_steps_per_s": {name: many[name] for name in runs},
        "sync_256_pendulum_steps_per_s": many["peer"],
        "vector_256_ratio": {str(threads): many[f"256 × {threads}"] / many["peer"] for threads in (1, 2)},
    }


def _ours(count: int, threads: int) -> Callable[[], int]:
    return vector(OURS, count, "vector_entry_point", threads=threads, obs_mode="flat")


def learning(steps: int = 40_960) -> dict[str, float]:
    """Measure the frames per second of PPO without a memory, on our environment and on the idle one."""
    torch.set_num_threads(1)
    config, count = TrainConfig(sensing="ideal", learner=PPO_IDEAL), PPO_IDEAL.envs
    bare = {"ours": SB3VecEnv(OURS, count, 0), "idle": IdleVecEnv(OURS, count)}
    models = {name: make_learner(normalized_envs(VecMonitor(envs), config), config) for name, envs in bare.items()}
    found = rates({name: _learn(model, steps) for name, model in models.items()})
    return {
        "ppo_frames_per_s": found["ours"],
        "ppo_idle_frames_per_s": found["idle"],
        "ppo_ratio": found["ours"] / found["idle"],
    }


def solving(seeds: int, episodes: int = 60) -> JsonObject:
    """Measure the duration of training with ideal sensing, and the median final force error afterwards, by seed."""
    found: JsonObject = {"train_s": [], "median_final_error": []}
    for seed in range(seeds):
        with tempfile.TemporaryDirectory() as folder:
            config = TrainConfig(run=Path(folder), seed=seed, sensing="ideal", learner=PPO_IDEAL)
            begin = time.perf_counter()
            train(config, progress=False)
            found["train_s"].append(time.perf_counter() - begin)
            played = run_episodes(LearnedPolicy(config.run), config.env_id, EVALUATION_SEED, episodes)
            found["median_final_error"].append(float(np.median([episode.error[-1] for episode in played])))
    return found


def _learn(model: BaseAlgorithm, steps: int) -> Callable[[], int]:
    def run() -> int:
        before = model.num_timesteps
        model.learn(steps, reset_num_timesteps=False)
        return model.num_timesteps - before

    return run
