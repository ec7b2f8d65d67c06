"""Algorithms of sb3-contrib: recurrent PPO, TQC, TRPO and CrossQ."""

import sb3_contrib
from sb3_contrib import TQC, TRPO, CrossQ, RecurrentPPO
from stable_baselines3.common.env_util import make_vec_env

import ccr_gym  # noqa: F401 - registers the ids

IDS = ("CCR/PushObstacle-v1", "CCR/TrackForce-v1", "CCR/SpatialPush-v1")
for env_id in IDS:
    RecurrentPPO("MlpLstmPolicy", make_vec_env(env_id, 2), n_steps=32, batch_size=32, n_epochs=1, device="cpu").learn(
        128
    )
    TRPO("MlpPolicy", make_vec_env(env_id, 2), n_steps=64, device="cpu").learn(256)
    for algorithm in (TQC, CrossQ):
        algorithm("MlpPolicy", env_id, learning_starts=64, buffer_size=1000, device="cpu").learn(120)
print(f"sb3-contrib {sb3_contrib.__version__}: RecurrentPPO, TRPO, TQC, CrossQ on {', '.join(IDS)}")
