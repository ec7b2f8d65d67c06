"""RL Baselines3 Zoo from its command line, with the settings of ``examples/``."""

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

ENV_ID = "CCR/PushObstacle-v1"
SETTINGS = Path(__file__).parents[2] / "examples" / "rl_zoo_ppo.yml"
SHARED = ["--algo", "ppo", "--env", ENV_ID, "--gym-packages", "ccr_gym", "--num-threads", "1", "--device", "cpu"]
TRAIN = ["--conf-file", str(SETTINGS), "--n-timesteps", "2048", "--eval-freq", "-1", "--log-folder", "zoo"]
ENJOY = ["--folder", "zoo", "--n-timesteps", "100", "--no-render"]

subprocess.run([sys.executable, "-m", "rl_zoo3.train", *SHARED, *TRAIN], check=True)
subprocess.run([sys.executable, "-m", "rl_zoo3.enjoy", *SHARED, *ENJOY], check=True)
print(f"RL Zoo {version('rl_zoo3')}: train and enjoy on {ENV_ID}")
