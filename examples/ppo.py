"""Proximal policy optimisation (PPO) in one file, on the vector environments of ccr-gym.

After ``pip install '.[agents]'`` run ``python examples/ppo.py --seed 1``; ``--help`` lists the settings.
"""

import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import torch
import tyro
from gymnasium.vector import AutoresetMode, VectorEnv
from torch import Tensor, nn
from torch.distributions import Normal

import ccr_gym  # noqa: F401 - registers the ids

TEST_SEED = 1_000_000  # above the seeds of training


@dataclass(frozen=True)
class Args:
    """Train PPO on a contact-force task; the defaults solve CCR/PushObstacle-v1."""

    env_id: str = "CCR/PushObstacle-v1"
    """Environment to train on."""
    seed: int = 0
    """Seed of the learner and of the first environment's scenes."""
    steps: int = 80_000
    """Environment steps to train for, rounded up to whole updates."""
    envs: int = 32
    """Environments stepped in parallel."""
    rollout: int = 64
    """Steps of each environment between updates."""
    minibatch: int = 256
    """Samples of one gradient step."""
    epochs: int = 8
    """Passes over a rollout."""
    learning_rate: float = 1e-3
    """Learning rate of Adam; decays linearly to zero."""
    gamma: float = 0.9
    """Discount factor of rewards."""
    gae_lambda: float = 0.9
    """Decay λ of generalised advantages."""
    clip: float = 0.2
    """Change of the probability ratio at which the objective is clipped."""
    max_grad_norm: float = 0.5
    """Norm to which gradients are clipped."""
    log_std_init: float = -0.5
    """Logarithm of the initial standard deviation of actions."""
    width: int = 64
    """Units per hidden layer (two layers)."""


class Moments:
    """Running mean and variance of rows."""

    def __init__(self, shape: tuple[int, ...] = ()) -> None:
        self.mean, self.variance, self.count = np.zeros(shape), np.ones(shape), 0

    def update(self, rows: np.ndarray) -> None:
        """Update the statistics with more rows."""
        self.count += len(rows)
        share, shift = len(rows) / self.count, rows.mean(0) - self.mean
        self.variance = (1 - share) * (self.variance + share * shift**2) + share * rows.var(0)
        self.mean = self.mean + share * shift

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviation."""
        return np.sqrt(self.variance + 1e-8)


class Agent(nn.Module):
    """A Gaussian policy and a value function of normalised observations."""

    def __init__(self, observations: int, actions: int, args: Args) -> None:
        super().__init__()
        self.moments = Moments((observations,))
        self.mean = network(observations, args.width, actions, gain=0.01)
        self.critic = network(observations, args.width, 1, gain=1.0)
        self.log_std = nn.Parameter(torch.full((actions,), args.log_std_init))

    def scale(self, observation: np.ndarray) -> Tensor:
        """Return an observation as the networks take it."""
        scaled = (observation - self.moments.mean) / self.moments.deviation
        return torch.from_numpy(scaled.clip(-10, 10)).float()

    def policy(self, scaled: Tensor) -> Normal:
        """Return the distribution of the action."""
        return Normal(self.mean(scaled), self.log_std.exp(), validate_args=False)

    def value(self, scaled: Tensor) -> Tensor:
        """Return the expected return."""
        return self.critic(scaled).squeeze(-1)


def network(inputs: int, width: int, outputs: int, gain: float) -> nn.Sequential:
    """Return a network with two tanh layers and orthogonal initial weights; ``gain`` scales those of the last layer."""
    layers = [nn.Linear(inputs, width), nn.Linear(width, width), nn.Linear(width, outputs)]
    for layer, scale in zip(layers, (2**0.5, 2**0.5, gain), strict=True):
        nn.init.orthogonal_(layer.weight, scale)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])


def make(env_id: str, count: int) -> VectorEnv:
    """Return environments that reset in the step that ends an episode; its last observation is in the infos."""
    settings: dict[str, Any] = {"obs_mode": "flat", "autoreset_mode": AutoresetMode.SAME_STEP}
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", **settings)


def final_errors(infos: dict[str, Any]) -> np.ndarray:
    """Return the relative force errors, counted up to 1, of the episodes that ended in this step."""
    return -infos["final_info"]["reward_force_error"][infos["_final_info"]]


class Experience:
    """Environments whose episodes continue from rollout to rollout."""

    def __init__(self, args: Args) -> None:
        self.args, self.envs = args, make(args.env_id, args.envs)
        self.errors: deque[float] = deque(maxlen=100)
        self.returns, self.return_moments = np.zeros(args.envs), Moments()
        self.observation, _ = self.envs.reset(seed=args.seed)

    @torch.no_grad()
    def rollout(self, agent: Agent) -> tuple[Tensor, ...]:
        """Return normalised observations, actions, their log-probabilities, advantages and returns, a row per step."""
        steps = []
        for _ in range(self.args.rollout):
            agent.moments.update(self.observation)
            scaled = agent.scale(self.observation)
            policy = agent.policy(scaled)
            action = policy.sample()
            reward, following, ended = self._step(action.numpy())
            steps.append((scaled, action, policy.log_prob(action).sum(-1), reward, agent.scale(following), ended))
        seen, actions, log_probs, rewards, followed, ends = map(torch.stack, zip(*steps, strict=True))
        values = agent.value(seen)
        advantages = self._advantages(rewards + self.args.gamma * agent.value(followed) - values, ends)
        return tuple(column.flatten(0, 1) for column in (seen, actions, log_probs, advantages, advantages + values))

    def _step(self, action: np.ndarray) -> tuple[Tensor, np.ndarray, Tensor]:
        """Return normalised rewards, the next observations of the same episodes, and which episodes ended."""
        self.observation, reward, _, ended, infos = self.envs.step(action.clip(-1, 1))
        following = self.observation.copy()
        if ended.any():
            following[ended] = np.stack(infos["final_obs"][infos["_final_obs"]])
            self.errors.extend(final_errors(infos))
        self.returns = self.args.gamma * self.returns + reward
        self.return_moments.update(self.returns)
        self.returns[ended] = 0
        return torch.from_numpy(reward / self.return_moments.deviation).float(), following, torch.from_numpy(ended)

    def _advantages(self, surprise: Tensor, ended: Tensor) -> Tensor:
        """Return generalised advantages; episodes are truncated, not terminated, so the last value counts."""
        decay = self.args.gamma * self.args.gae_lambda * ~ended
        advantages, later = torch.zeros_like(surprise), torch.zeros_like(surprise[0])
        for t in reversed(range(len(surprise))):
            advantages[t] = later = surprise[t] + decay[t] * later
        return advantages


def improve(agent: Agent, optimizer: torch.optim.Optimizer, batch: tuple[Tensor, ...], args: Args) -> None:
    """Train on a rollout for some epochs: clipped surrogate of the policy, squared error of the value."""
    for rows in (part for _ in range(args.epochs) for part in torch.randperm(len(batch[0])).split(args.minibatch)):
        scaled, action, log_prob, advantage, returns = (column[rows] for column in batch)
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        ratio = (agent.policy(scaled).log_prob(action).sum(-1) - log_prob).exp()
        gain = torch.minimum(ratio * advantage, ratio.clamp(1 - args.clip, 1 + args.clip) * advantage).mean()
        optimizer.zero_grad()
        (0.5 * (agent.value(scaled) - returns).square().mean() - gain).backward()
        nn.utils.clip_grad_norm_(agent.parameters(), args.max_grad_norm)
        optimizer.step()


@torch.no_grad()
def evaluate(agent: Agent, env_id: str, episodes: int = 100) -> np.ndarray:
    """Return the final force errors of the mean action, in scenes that were not trained on."""
    envs = make(env_id, episodes)
    observation, _ = envs.reset(seed=TEST_SEED)
    ended = np.zeros(episodes, bool)
    while not ended.all():  # all episodes start together and have the same length
        observation, _, _, ended, infos = envs.step(agent.mean(agent.scale(observation)).numpy().clip(-1, 1))
    return final_errors(infos)


def main(args: Args) -> None:
    """Train the agent and print its errors."""
    torch.set_num_threads(1)  # the fastest for networks this small
    torch.manual_seed(args.seed)
    experience, start = Experience(args), time.perf_counter()
    spaces = experience.envs.single_observation_space, experience.envs.single_action_space
    agent = Agent(spaces[0].shape[0], spaces[1].shape[0], args)
    optimizer = torch.optim.Adam(agent.parameters(), args.learning_rate, eps=1e-5)
    updates = -(-args.steps // (args.envs * args.rollout))
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = args.learning_rate * (1 - update / updates)
        improve(agent, optimizer, experience.rollout(agent), args)
        steps, error = (update + 1) * args.envs * args.rollout, np.median(experience.errors or np.nan)
        if update % 10 == 0:
            print(f"step {steps:6d}: median final error {error:7.2%}, action noise {agent.log_std.exp().mean():.2f}")
    print(f"{steps} steps in {time.perf_counter() - start:.1f} s")
    print(f"last {len(experience.errors)} training episodes: median final error {error:.2%}")
    errors = evaluate(agent, args.env_id)
    print(f"mean action, {len(errors)} unseen scenes: median final error {np.median(errors):.2%}")


if __name__ == "__main__":
    main(tyro.cli(Args))
