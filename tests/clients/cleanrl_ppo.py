"""PPO in a single file, in the manner of CleanRL, on the wrapped vectors of ``gymnasium.make_vec``."""

import gymnasium
import torch
from gymnasium.wrappers import vector
from torch import nn

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/InsertAndPush-v1", "CCR/SpatialPush-v1")
ENVS, STEPS, UPDATES, EPOCHS, GAMMA, LAMBDA, CLIP = 8, 32, 4, 4, 0.99, 0.95, 0.2


def train(env_id: str, mode: str) -> int:
    envs = gymnasium.make_vec(env_id, ENVS, vectorization_mode=mode)
    envs = vector.NormalizeReward(vector.NormalizeObservation(vector.RecordEpisodeStatistics(vector.ClipAction(envs))))
    inputs, outputs = envs.single_observation_space.shape[0], envs.single_action_space.shape[0]
    actor = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, outputs))
    critic = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 1))
    log_std = nn.Parameter(torch.zeros(outputs))
    weights = [*actor.parameters(), *critic.parameters(), log_std]
    optimizer, episodes = torch.optim.Adam(weights, 1e-3), 0
    rows, _ = envs.reset(seed=0)
    done = torch.zeros(ENVS)
    for _ in range(UPDATES):
        seen, acts, logs, rewards, dones = [], [], [], [], []
        for _ in range(STEPS):
            seen.append(torch.as_tensor(rows, dtype=torch.float32))
            with torch.no_grad():
                policy = torch.distributions.Normal(actor(seen[-1]), log_std.exp())
                acts.append(policy.sample())
                logs.append(policy.log_prob(acts[-1]).sum(1))
            dones.append(done)
            rows, reward, terminated, truncated, info = envs.step(acts[-1].numpy())
            rewards.append(torch.as_tensor(reward, dtype=torch.float32))
            done = torch.as_tensor(terminated | truncated).float()
            episodes += int(info["_episode"].sum()) if "_episode" in info else 0
        seen, acts, logs, dones = torch.stack(seen), torch.stack(acts), torch.stack(logs), torch.stack([*dones, done])
        with torch.no_grad():
            values = critic(torch.cat([seen, torch.as_tensor(rows, dtype=torch.float32)[None]])).squeeze(2)
            advantage, ahead = torch.zeros(STEPS, ENVS), torch.zeros(ENVS)
            for t in reversed(range(STEPS)):
                alive = 1 - dones[t + 1]
                ahead = rewards[t] + GAMMA * values[t + 1] * alive - values[t] + GAMMA * LAMBDA * alive * ahead
                advantage[t] = ahead
        for _ in range(EPOCHS):
            policy = torch.distributions.Normal(actor(seen), log_std.exp())
            ratio = (policy.log_prob(acts).sum(2) - logs).exp()
            gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
            loss = (critic(seen).squeeze(2) - advantage - values[:-1]).square().mean() - gain
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
        assert loss.isfinite()
    envs.close()
    return episodes


if __name__ == "__main__":
    counts = [train(env_id, mode) for env_id in IDS for mode in ("sync", "vector_entry_point")]
    assert all(counts), counts
    print(f"torch {torch.__version__}: CleanRL-style PPO, sync and vector_entry_point, {sum(counts)} episodes")
