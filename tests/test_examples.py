import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from stable_baselines3 import PPO

from agents import SB3VecEnv
from agents.tuned import PPO_IDEAL
from ccr_gym import ENV_IDS

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_ppo_trains_and_prints_its_error():
    command = [sys.executable, str(EXAMPLES / "ppo.py"), "--steps", "2048", "--envs", "16", "--epochs", "1"]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    training, test = run.stdout.splitlines()[-2:]
    assert re.fullmatch(r"last 32 training episodes: median final error \d+\.\d\d%", training)
    assert re.fullmatch(r"mean action, 100 unseen scenes: median final error \d+\.\d\d%", test)


def test_a_reversal_tells_the_loss(tmp_path):
    example = runpy.run_path(str(EXAMPLES / "probe.py"))
    args = example["Args"](episodes=40, out=tmp_path / "probe.png")
    alone, reversed_once = (example["play"](args, probing=probing) for probing in (False, True))
    for k, ratio in ((0, 0.5), (1, 0.9)):  # errors of the loss, and of the force
        assert np.median(reversed_once[k][-16:]) < ratio * np.median(alone[k][-16:])
    example["main"](args)
    assert args.out.stat().st_size > 10_000


def test_in_ppo_the_last_observation_of_an_episode_follows_its_last_step():
    example = runpy.run_path(str(EXAMPLES / "ppo.py"))
    experience = example["Experience"](example["Args"](envs=3))
    for step in range(1, 65):
        _, following, ended = experience._step(np.ones((3, 1)))
        assert bool(ended.all()) == bool(ended.any()) == (step == 64)
    assert (following[:, 0] > 0).all()  # the cable is pulled
    assert (experience.observation[:, 0] == 0).all()  # and slack in the next episode


@pytest.mark.parametrize("env_id", ["CCR/LoadCell-v1", "CCR/PushObstacle-v1"])
def test_the_settings_for_the_zoo_are_those_for_ideal_sensing(env_id):
    yaml = pytest.importorskip("yaml")
    by_id = yaml.safe_load((EXAMPLES / "rl_zoo_ppo.yml").read_text())
    assert by_id.keys() <= set(ENV_IDS)
    settings, config = by_id[env_id], PPO_IDEAL
    assert settings.pop("normalize") is True
    assert (settings.pop("n_timesteps"), settings.pop("n_envs")) == (config.steps, config.envs)
    assert settings.pop("learning_rate") == f"lin_{config.learning_rate}"
    settings["policy_kwargs"] = eval(settings["policy_kwargs"])
    assert settings["policy_kwargs"] == {"net_arch": [config.width] * 2, "log_std_init": config.log_std_init}
    model = PPO(env=SB3VecEnv(env_id, 1), device="cpu", **settings | {"batch_size": settings["n_steps"]})
    assert (model.n_steps, settings["batch_size"], model.n_epochs) == (config.rollout, config.batch_size, config.epochs)
    assert (model.gamma, model.gae_lambda) == (config.gamma, config.gae_lambda)
