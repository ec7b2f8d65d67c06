"""PPO on the vector environment, an episode of each an update; run it after ``pip install '.[agents]'``."""

import gymnasium
import numpy as np
import torch
from gymnasium.vector import VectorEnv
from torch import Tensor, nn
from torch.distributions import Normal

ENV_ID, ENVS, EPOCHS, BATCH, GAMMA, LAMBDA, CLIP = "ccr_gym:CCR/PushObstacle-v1", 64, 8, 256, 0.9, 0.9, 0.2


def network(inputs: int) -> nn.Sequential:
    """Return a network with two hidden layers and one output."""
    return nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1))


@torch.no_grad()
def play(envs: VectorEnv, actor: nn.Module, std: float, seed: int | None) -> tuple[Tensor, Tensor, Tensor, float]:
    """Return ``T + 1`` observations, ``T`` actions and rewards, and the median relative force error at the end."""
    seen, actions, rewards, done = [envs.reset(seed=seed)[0]], [], [], False
    while not done:
        actions.append(actor(torch.as_tensor(seen[-1])) + std * torch.randn(ENVS, 1))
        observation, reward, _, truncated, infos = envs.step(actions[-1].numpy().clip(-1, 1))
        seen, rewards, done = [*seen, observation], [*rewards, torch.as_tensor(reward).float()], truncated.all()
    played = torch.as_tensor(np.array(seen)), torch.stack(actions).squeeze(-1), torch.stack(rewards)
    return *played, np.median(-infos["reward_force_error"])


def main(updates: int = 30) -> tuple[float, float]:
    """Train a policy; return its median force error in test scenes before and after."""
    torch.manual_seed(0)
    train, test = (gymnasium.make_vec(ENV_ID, ENVS, split=s, autoreset_mode="Disabled") for s in ("train", "test"))
    actor, critic = (network(train.single_observation_space.shape[0]) for _ in range(2))
    log_std = nn.Parameter(torch.tensor(-0.5))
    adam = torch.optim.Adam([*actor.parameters(), *critic.parameters(), log_std], lr=1e-3)
    before = play(test, actor, 0.0, seed=1)[-1]
    for update in range(updates):
        seen, actions, rewards, final = play(train, actor, log_std.exp().item(), seed=None if update else 0)
        before_update = Normal(actor(seen[:-1]).squeeze(-1), log_std.exp()).log_prob(actions).detach()
        values = critic(seen).squeeze(-1).detach()
        gain = rewards + GAMMA * values[1:] - values[:-1]  # episodes are truncated, so the value of the end counts
        for t in reversed(range(len(gain) - 1)):
            gain[t] += GAMMA * LAMBDA * gain[t + 1]
        data = [x.flatten(0, 1) for x in (seen[:-1], actions, before_update, gain, gain + values[:-1])]
        for chosen in (rows for _ in range(EPOCHS) for rows in torch.randperm(rewards.numel()).split(BATCH)):
            observation, action, log_prob, gain, target = (rows[chosen] for rows in data)
            policy, gain = Normal(actor(observation).squeeze(-1), log_std.exp()), (gain - gain.mean()) / gain.std()
            ratio, error = (policy.log_prob(action) - log_prob).exp(), critic(observation).squeeze(-1) - target
            surrogate = torch.minimum(ratio * gain, ratio.clamp(1 - CLIP, 1 + CLIP) * gain)
            adam.zero_grad()
            (0.5 * error.square() - surrogate).mean().backward()
            adam.step()
        print(f"update {update + 1:2d}: median force error {final:6.1%}, exploration {log_std.exp():.2f}")
    return before, play(test, actor, 0.0, seed=1)[-1]


if __name__ == "__main__":
    print("in test scenes before and after: {:.1%}, {:.1%}".format(*main()))
