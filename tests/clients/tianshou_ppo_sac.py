"""Tianshou: PPO and SAC from its experiment builders, on environments in this process and in others."""

from importlib.metadata import version

from tianshou.highlevel.config import OffPolicyTrainingConfig, OnPolicyTrainingConfig
from tianshou.highlevel.env import EnvFactoryRegistered, VectorEnvType
from tianshou.highlevel.experiment import ExperimentConfig, PPOExperimentBuilder, SACExperimentBuilder

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/InsertAndPush-v1", "CCR/SpatialPush-v1")
SIZES = {"max_epochs": 1, "epoch_num_steps": 256, "num_training_envs": 2, "num_test_envs": 1, "batch_size": 64}


def train(builder, training, env_id: str, kind: VectorEnvType) -> float:
    envs = EnvFactoryRegistered(task=env_id, venv_type=kind)
    quiet = ExperimentConfig(persistence_enabled=False, watch=False, device="cpu")
    return builder(envs, quiet, training).build().run().trainer_result.best_reward


if __name__ == "__main__":
    on = OnPolicyTrainingConfig(**SIZES, collection_step_num_env_steps=128, update_step_num_repetitions=1)
    off = OffPolicyTrainingConfig(**SIZES, collection_step_num_env_steps=16, buffer_size=1000, start_timesteps=64)
    for env_id in IDS:
        train(PPOExperimentBuilder, on, env_id, VectorEnvType.DUMMY)
        train(SACExperimentBuilder, off, env_id, VectorEnvType.DUMMY)
    train(PPOExperimentBuilder, on, f"ccr_gym:{IDS[0]}", VectorEnvType.SUBPROC)
    print(f"Tianshou {version('tianshou')}: PPO, SAC, SubprocVectorEnv on {', '.join(IDS)}")
