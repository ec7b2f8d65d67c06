"""TorchRL: checks of specs, parallel environments, and PPO from a collector."""

import torch
import torchrl
from tensordict.nn import NormalParamExtractor, TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymEnv, ParallelEnv, RewardSum, StepCounter, TransformedEnv
from torchrl.envs.utils import check_env_specs
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/InsertAndPush-v1", "CCR/SpatialPush-v1")


def train(env_id: str) -> None:
    env = TransformedEnv(GymEnv(env_id))
    env.append_transform(RewardSum())
    env.append_transform(StepCounter())
    check_env_specs(env)
    inputs, outputs = env.observation_spec["observation"].shape[-1], env.action_spec.shape[-1]
    body = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 2 * outputs), NormalParamExtractor())
    module = TensorDictModule(body, in_keys=["observation"], out_keys=["loc", "scale"])
    kwargs = {"distribution_class": TanhNormal, "return_log_prob": True}
    actor = ProbabilisticActor(module, in_keys=["loc", "scale"], spec=env.action_spec, **kwargs)
    critic = ValueOperator(nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 1)), in_keys=["observation"])
    advantage, loss = GAE(gamma=0.99, lmbda=0.95, value_network=critic), ClipPPOLoss(actor, critic)
    optimizer = torch.optim.Adam(loss.parameters(), 1e-3)
    for data in Collector(env, actor, frames_per_batch=128, total_frames=256):
        advantage(data)
        terms = loss(data)
        sum(value for name, value in terms.items() if name.startswith("loss_")).backward()
        optimizer.step()
        optimizer.zero_grad()


if __name__ == "__main__":
    for env_id in IDS:
        train(env_id)
    check_env_specs(GymEnv(IDS[0], obs_mode="dict"))
    check_env_specs(GymEnv(IDS[0], obs_mode="goal"))
    workers = ParallelEnv(2, lambda: GymEnv(f"ccr_gym:{IDS[0]}"), mp_start_method="spawn")
    assert workers.rollout(80, break_when_any_done=False).shape == (2, 80)
    workers.close()
    pixels = GymEnv(IDS[0], render_mode="rgb_array", from_pixels=True, pixels_only=False).rollout(3)["pixels"]
    print(f"TorchRL {torchrl.__version__}: check_env_specs, PPO, ParallelEnv, pixels {tuple(pixels.shape)}")
