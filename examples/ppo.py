"""Proximal policy optimisation in one file, on the vector environments of ccr-gym.

    pip install '.[agents]'
    python examples/ppo.py --seed 1

Read from top to bottom: settings, running moments, networks, experience, update, evaluation, main.
"""

import time
from collections import deque
from dataclasses import dataclass

import gymnasium
import numpy as np
import torch
import tyro
from torch import Tensor, nn
from torch.distributions import Normal

import ccr_gym  # noqa: F401 - registers the ids

TEST_SEED = 1_000_000  # beyond the seeds of training


@dataclass(frozen=True)
class Args:
    """Train PPO on a contact-force task; the defaults solve CCR/PushObstacle-v0."""

    env_id: str = "CCR/PushObstacle-v0"
    """Environment to train on."""
    seed: int = 0
    """Seed of the learner and of the first environment's scenes."""
    steps: int = 160_000
    """Environment steps to train for, rounded up to whole updates."""
    envs: int = 32
    """Environments stepped side by side."""
    rollout: int = 64
    """Steps of each environment between updates."""
    minibatch: int = 512
    """Samples of one gradient step."""
    epochs: int = 8
    """Passes over a rollout."""
    learning_rate: float = 1e-3
    """Of Adam, decaying linearly to zero."""
    gamma: float = 0.9
    """Discount of rewards."""
    gae_lambda: float = 0.9
    """Decay of advantages."""
    clip: float = 0.2
    """Change of a probability ratio beyond which the policy gains nothing."""
    max_grad_norm: float = 0.5
    """Norm to which gradients are cut."""
    log_std_init: float = -0.5
    """Logarithm of the first exploration noise."""
    width: int = 64
    """Units in each of the two hidden layers."""
    log_every: int = 10
    """Updates between printed lines."""


class Moments:
    """Mean and variance of all rows seen so far."""

    def __init__(self, shape: tuple[int, ...] = ()) -> None:
        self.mean, self.variance, self.count = np.zeros(shape), np.ones(shape), 0

    def update(self, rows: np.ndarray) -> None:
        """Take in more rows."""
        self.count += len(rows)
        share, shift = len(rows) / self.count, rows.mean(0) - self.mean
        self.variance = (1 - share) * (self.variance + share * shift**2) + share * rows.var(0)
        self.mean = self.mean + share * shift

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviation."""
        return np.sqrt(self.variance + 1e-8)


class Agent(nn.Module):
    """A Gaussian policy and a value function, over scaled observations."""

    def __init__(self, observations: int, actions: int, args: Args) -> None:
        super().__init__()
        self.moments = Moments((observations,))
        self.mean = network(observations, args.width, actions, gain=0.01)
        self.critic = network(observations, args.width, 1, gain=1.0)
        self.log_std = nn.Parameter(torch.full((actions,), args.log_std_init))

    def scale(self, observation: np.ndarray) -> Tensor:
        """What the networks see of an observation."""
        scaled = (observation - self.moments.mean) / self.moments.deviation
        return torch.as_tensor(scaled.clip(-10, 10), dtype=torch.float32)

    def policy(self, scaled: Tensor) -> Normal:
        """Distribution of the action."""
        return Normal(self.mean(scaled), self.log_std.exp(), validate_args=False)

    def value(self, scaled: Tensor) -> Tensor:
        """Return to be expected."""
        return self.critic(scaled).squeeze(-1)


def network(inputs: int, width: int, outputs: int, gain: float) -> nn.Sequential:
    """Two hidden layers of tanh, orthogonal at first; ``gain`` is that of the last layer."""
    layers = [nn.Linear(inputs, width), nn.Linear(width, width), nn.Linear(width, outputs)]
    for layer, scale in zip(layers, (2**0.5, 2**0.5, gain), strict=True):
        nn.init.orthogonal_(layer.weight, scale)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])


def make(env_id: str, count: int) -> gymnasium.vector.VectorEnv:
    """Environments whose last step of an episode is the first of the next, the last observation being in the infos."""
    settings = {"obs_mode": "flat", "autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP}
    return gymnasium.make_vec(env_id, count, vectorization_mode="vector_entry_point", **settings)


def final_errors(infos: dict) -> np.ndarray:
    """Relative force errors at the end of the episodes that ended in this step."""
    final, ended = infos["final_info"], infos["_final_info"]
    force = np.linalg.norm(final["force_true"][ended], axis=1)
    return np.abs(force / final["desired_force"][ended] - 1.0)


class Experience:
    """Environments that go on from rollout to rollout."""

    def __init__(self, args: Args) -> None:
        self.args, self.envs = args, make(args.env_id, args.envs)
        self.errors: deque[float] = deque(maxlen=100)
        self.returns, self.return_moments = np.zeros(args.envs), Moments()
        self.observation, _ = self.envs.reset(seed=args.seed)

    @torch.no_grad()
    def rollout(self, agent: Agent) -> tuple[Tensor, ...]:
        """Scaled observations, actions, their log-probabilities, advantages and returns, one row for each step."""
        seen, acted, log_probs, rewards, followed, ended = [], [], [], [], [], []
        for _ in range(self.args.rollout):
            agent.moments.update(self.observation)
            seen.append(agent.scale(self.observation))
            policy = agent.policy(seen[-1])
            acted.append(policy.sample())
            log_probs.append(policy.log_prob(acted[-1]).sum(-1))
            reward, following, done = self._step(acted[-1].numpy())
            rewards.append(torch.as_tensor(reward, dtype=torch.float32))
            followed.append(agent.scale(following))
            ended.append(torch.as_tensor(done))
        values, following_values = agent.value(torch.stack(seen)), agent.value(torch.stack(followed))
        advantages = self._advantages(torch.stack(rewards), values, following_values, torch.stack(ended))
        columns = torch.stack(seen), torch.stack(acted), torch.stack(log_probs), advantages, advantages + values
        return tuple(column.flatten(0, 1) for column in columns)

    def _step(self, action: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Scaled rewards, the observations that follow in the same episodes, and which of these ended."""
        self.observation, reward, _, done, infos = self.envs.step(action.clip(-1, 1))
        following = self.observation
        if done.any():
            following = following.copy()
            following[done] = np.stack(infos["final_obs"][done])
            self.errors.extend(final_errors(infos))
        self.returns = self.args.gamma * self.returns + reward
        self.return_moments.update(self.returns)
        self.returns[done] = 0.0
        return reward / self.return_moments.deviation, following, done

    def _advantages(self, rewards: Tensor, values: Tensor, following_values: Tensor, ended: Tensor) -> Tensor:
        """Generalised advantage estimates; episodes are cut off, never terminal, so that a value follows every step."""
        surprise = rewards + self.args.gamma * following_values - values
        decay = self.args.gamma * self.args.gae_lambda * ~ended
        advantages = torch.zeros_like(surprise)
        later = torch.zeros_like(surprise[0])
        for t in reversed(range(len(surprise))):
            advantages[t] = later = surprise[t] + decay[t] * later
        return advantages


def improve(agent: Agent, optimizer: torch.optim.Optimizer, batch: tuple[Tensor, ...], args: Args) -> None:
    """Go over a rollout a few times, in minibatches."""
    for _ in range(args.epochs):
        for rows in torch.randperm(len(batch[0])).split(args.minibatch):
            optimizer.zero_grad()
            loss(agent, *(column[rows] for column in batch), args.clip).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), args.max_grad_norm)
            optimizer.step()


def loss(
    agent: Agent, scaled: Tensor, action: Tensor, log_prob: Tensor, advantage: Tensor, returns: Tensor, clip: float
) -> Tensor:
    """Clipped surrogate of the policy, and squared error of the value."""
    advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    ratio = (agent.policy(scaled).log_prob(action).sum(-1) - log_prob).exp()
    gain = torch.minimum(ratio * advantage, ratio.clamp(1 - clip, 1 + clip) * advantage).mean()
    return 0.5 * (agent.value(scaled) - returns).square().mean() - gain


@torch.no_grad()
def evaluate(agent: Agent, env_id: str, episodes: int = 100) -> np.ndarray:
    """Final errors of the mean action, in scenes that training does not know."""
    envs = make(env_id, episodes)
    observation, _ = envs.reset(seed=TEST_SEED)
    done = np.zeros(episodes, bool)
    while not done.all():  # they all begin together and are as long
        action = agent.mean(agent.scale(observation)).numpy().clip(-1, 1)
        observation, _, _, done, infos = envs.step(action)
    return final_errors(infos)


def main(args: Args) -> None:
    """Train, and tell how it went."""
    torch.set_num_threads(1)  # faster than more for networks this small
    torch.manual_seed(args.seed)
    experience = Experience(args)
    spaces = experience.envs.single_observation_space, experience.envs.single_action_space
    agent = Agent(*(space.shape[0] for space in spaces), args)
    optimizer = torch.optim.Adam(agent.parameters(), args.learning_rate, eps=1e-5)
    batch_size = args.envs * args.rollout
    updates, start = -(-args.steps // batch_size), time.perf_counter()
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = args.learning_rate * (1 - update / updates)
        improve(agent, optimizer, experience.rollout(agent), args)
        if update % args.log_every == 0 and experience.errors:
            error, std = np.median(experience.errors), agent.log_std.exp().mean()
            print(f"step {(update + 1) * batch_size:7d}  median final error {error:7.2%}  action std {std:.3f}")
    seconds = time.perf_counter() - start
    print(f"{updates * batch_size} steps in {seconds:.1f} s")
    if experience.errors:
        print(f"last {len(experience.errors)} training episodes: median final error {np.median(experience.errors):.2%}")
    errors = evaluate(agent, args.env_id)
    within = np.mean(errors <= 0.05)
    print(
        f"mean action, {len(errors)} unseen scenes: median final error {np.median(errors):.2%}, {within:.0%} within 5 %"
    )


if __name__ == "__main__":
    main(tyro.cli(Args))
