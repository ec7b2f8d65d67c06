"""RLlib on remote workers, which find the environments by the module in front of the id."""

import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.algorithms.sac import SACConfig

IDS = ("ccr_gym:CCR/PushObstacle-v1", "ccr_gym:CCR/InsertAndPush-v1", "ccr_gym:CCR/SpatialPush-v1")


def train(config, env_id: str, **kwargs) -> int:
    config.environment(env_id, env_config=kwargs, clip_actions=True)
    config.env_runners(num_env_runners=1, num_envs_per_env_runner=2, rollout_fragment_length=64)
    algorithm = config.build_algo()
    result = algorithm.train()
    algorithm.stop()
    return int(result["env_runners"]["num_env_steps_sampled_lifetime"])


if __name__ == "__main__":
    ray.init(num_cpus=2, include_dashboard=False, object_store_memory=200_000_000, log_to_driver=False)
    ppo = {"train_batch_size_per_learner": 256, "minibatch_size": 64, "num_epochs": 1}
    steps = [train(PPOConfig().training(**ppo), env_id) for env_id in IDS]
    steps.append(train(PPOConfig().training(**ppo), IDS[0], robot="snake_arm", sensing="realistic"))
    sac = SACConfig().training(train_batch_size_per_learner=64, num_steps_sampled_before_learning_starts=64)
    steps.append(train(sac, IDS[-1]))
    assert all(steps), steps
    print(f"RLlib {ray.__version__}: PPO and SAC on remote workers, {sum(steps)} steps")
