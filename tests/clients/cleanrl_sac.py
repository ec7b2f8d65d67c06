"""SAC in a single file, in the manner of CleanRL, on ``gymnasium.make_vec`` with resets in the last step."""

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/InsertAndPush-v1", "CCR/SpatialPush-v1")
ENVS, STEPS, START, BATCH, GAMMA, TAU, ALPHA = 4, 150, 40, 64, 0.99, 0.005, 0.2


def network(inputs: int, outputs: int) -> nn.Module:
    return nn.Sequential(nn.Linear(inputs, 64), nn.ReLU(), nn.Linear(64, outputs))


def sample(actor: nn.Module, rows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    mean, log_std = actor(rows).chunk(2, 1)
    policy = torch.distributions.Normal(mean, log_std.clamp(-5, 2).exp())
    raw = policy.rsample()
    action = raw.tanh()
    return action, (policy.log_prob(raw) - (1 - action.square() + 1e-6).log()).sum(1, keepdim=True)


def train(env_id: str, mode: str) -> float:
    where = "autoreset_mode" if mode == "vector_entry_point" else "vector_kwargs"
    same = AutoresetMode.SAME_STEP if mode == "vector_entry_point" else {"autoreset_mode": AutoresetMode.SAME_STEP}
    envs = gymnasium.make_vec(env_id, ENVS, vectorization_mode=mode, **{where: same})
    inputs, outputs = envs.single_observation_space.shape[0], envs.single_action_space.shape[0]
    actor, critics = network(inputs, 2 * outputs), [network(inputs + outputs, 1) for _ in range(4)]
    for critic, target in zip(critics[:2], critics[2:], strict=True):
        target.load_state_dict(critic.state_dict())
    learn_q = torch.optim.Adam([*critics[0].parameters(), *critics[1].parameters()], 1e-3)
    learn_actor = torch.optim.Adam(actor.parameters(), 1e-3)
    envs.action_space.seed(0)
    memory, generator = [], np.random.default_rng(0)
    rows, _ = envs.reset(seed=0)
    for step in range(STEPS):
        with torch.no_grad():
            actions = envs.action_space.sample() if step < START else sample(actor, torch.as_tensor(rows))[0].numpy()
        after, rewards, terminated, truncated, info = envs.step(actions)
        following = after.copy()
        for i in np.flatnonzero(truncated):
            following[i] = info["final_obs"][i]
        memory += zip(rows, actions, rewards.astype(np.float32), terminated, following, strict=True)
        rows = after
        if step < START:
            continue
        picked = [memory[i] for i in generator.integers(len(memory), size=BATCH)]
        seen, acts, gains, ends, nexts = (torch.as_tensor(np.stack(part)) for part in zip(*picked, strict=True))
        with torch.no_grad():
            chosen, log = sample(actor, nexts)
            ahead = torch.min(*(target(torch.cat([nexts, chosen], 1)) for target in critics[2:])) - ALPHA * log
            wanted = gains[:, None] + GAMMA * (~ends[:, None]) * ahead
        loss = sum((critic(torch.cat([seen, acts], 1)) - wanted).square().mean() for critic in critics[:2])
        learn_q.zero_grad()
        loss.backward()
        learn_q.step()
        chosen, log = sample(actor, seen)
        learn_actor.zero_grad()
        (ALPHA * log - torch.min(*(critic(torch.cat([seen, chosen], 1)) for critic in critics[:2]))).mean().backward()
        learn_actor.step()
        for critic, target in zip(critics[:2], critics[2:], strict=True):
            for weight, slow in zip(critic.parameters(), target.parameters(), strict=True):
                slow.data.lerp_(weight.data, TAU)
    envs.close()
    return loss.item()


if __name__ == "__main__":
    losses = [train(env_id, mode) for env_id in IDS for mode in ("sync", "vector_entry_point")]
    assert np.isfinite(losses).all(), losses
    print(f"torch {torch.__version__}: CleanRL-style SAC, sync and vector_entry_point, {len(losses)} runs")
