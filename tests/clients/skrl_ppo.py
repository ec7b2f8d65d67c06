"""skrl: PPO on a single environment and on both kinds of vectors."""

import gymnasium
import skrl
import torch
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from torch import nn

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/InsertAndPush-v1", "CCR/SpatialPush-v1")


class Policy(GaussianMixin, Model):
    def __init__(self, **spaces) -> None:
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self)
        self.net = nn.Sequential(nn.Linear(self.num_observations, 64), nn.Tanh(), nn.Linear(64, self.num_actions))
        self.log_std = nn.Parameter(torch.zeros(self.num_actions))

    def compute(self, inputs, role):
        return self.net(inputs["observations"]), {"log_std": self.log_std}


class Value(DeterministicMixin, Model):
    def __init__(self, **spaces) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.net = nn.Sequential(nn.Linear(self.num_observations, 64), nn.Tanh(), nn.Linear(64, 1))

    def compute(self, inputs, role):
        return self.net(inputs["observations"]), {}


def train(made) -> None:
    env = wrap_env(made)
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space, "device": env.device}
    config = PPO_CFG()
    config.rollouts, config.learning_epochs, config.mini_batches = 64, 2, 2
    config.experiment.write_interval = config.experiment.checkpoint_interval = 0
    agent = PPO(
        models={"policy": Policy(**spaces), "value": Value(**spaces)},
        memory=RandomMemory(memory_size=64, num_envs=env.num_envs, device=env.device),
        cfg=config,
        **spaces,
    )
    SequentialTrainer(cfg={"timesteps": 130, "headless": True}, env=env, agents=agent).train()
    env.close()


if __name__ == "__main__":
    for env_id in IDS:
        train(gymnasium.make(env_id))
        for mode in ("sync", "vector_entry_point"):
            train(gymnasium.make_vec(env_id, 4, vectorization_mode=mode))
    print(f"skrl {skrl.__version__}: PPO on make and make_vec (sync, vector_entry_point) of {', '.join(IDS)}")
