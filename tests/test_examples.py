import re
import runpy
import subprocess
import sys
from pathlib import Path

import gymnasium
import imageio.v3 as imageio
import numpy as np
import pytest
from stable_baselines3 import PPO

from agents import SB3VecEnv
from agents.tuned import PPO_IDEAL
from ccr_gym import ENV_IDS

EXAMPLES = Path(__file__).parents[1] / "examples"
SHORT = ("own_obstacle", "own_task", "plane", "render_gif", "sb3", "shooting", "space", "vector_ppo")


@pytest.mark.parametrize("name", SHORT)
def test_a_short_example_fits_a_screen(name):
    assert len((EXAMPLES / f"{name}.py").read_text().splitlines()) < 60


def printed(name, capsys, *args):
    runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"](*args)
    return capsys.readouterr().out


def test_both_circles_press_the_robot_in_the_plane(capsys):
    out = printed("plane", capsys)
    assert re.search(r"circle 0 presses with 0\.\d+ N on nodes \[10\]", out)
    assert re.search(r"circle 1 presses with 0\.\d+ N on nodes \[16\]", out)  # nodes of the paper's Fig. 5


def test_sphere_and_cylinder_press_the_robot_in_space(capsys):
    out = printed("space", capsys)
    assert "Sphere presses" in out
    assert "Cylinder presses" in out
    assert out.count("CONVERGED") == 8


def test_a_task_of_ones_own_is_solved_by_a_proportional_controller(capsys):
    try:
        out = printed("own_task", capsys)
    finally:
        gymnasium.registry.pop("Mine/PushTube-v1", None)
    force, goal = re.search(r"step 64: (\S+) N of (\S+) N", out).groups()
    assert force == goal
    assert "64 guidewires" in out


def test_an_obstacle_of_ones_own_is_pressed_in_the_solver_and_in_the_environment(capsys):
    out = printed("own_obstacle", capsys)
    force, goal = re.search(r"in the environment: (\S+) N of (\S+) N", out).groups()
    assert float(force) == pytest.approx(float(goal), rel=1e-3)
    gaps = [float(gap) for gap in re.findall(r"force 0\.[0-9]*[1-9][0-9]* N, smallest gap (\S+) mm", out)]
    assert len(gaps) == 3
    assert max(map(abs, gaps)) < 1e-9


def test_planning_on_copies_reaches_the_set_point(capsys):
    *_, force, _, _, goal = printed("shooting", capsys).split()
    assert float(force) == pytest.approx(float(goal), rel=0.05)


def test_a_gif_is_written(tmp_path, capsys):
    path = tmp_path / "episode.gif"
    assert "4 pictures" in printed("render_gif", capsys, path, 6)
    assert imageio.imread(path).shape == (4, 640, 640, 3)


def test_pictures_go_below_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    times = (EXAMPLES / "estimate/truth.csv").read_text().splitlines()[1:]
    rows = [f"{row.split(',')[0]},0.1,0.01" for row in times]
    (tmp_path / "estimate.csv").write_text("\n".join(["time_s,force_n,force_std_n", *rows]))
    check, probe = (runpy.run_path(str(EXAMPLES / f"{name}.py")) for name in ("estimate/check", "probe"))
    check["main"](check["Args"](results=tmp_path))
    probe["main"](probe["Args"](episodes=2))
    printed("render_gif", capsys, Path("runs/episode.gif"), 2)
    made = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.[pg][ni][gf]"))
    assert made == ["runs/episode.gif", "runs/estimate/check.png", "runs/probe.png"]


def test_stable_baselines_trains_and_is_evaluated(capsys):
    main = runpy.run_path(str(EXAMPLES / "sb3.py"))["main"]
    assert all(0 < error <= 1 for error in main(2048))


def test_ppo_on_the_vector_environment_learns(capsys):
    main = runpy.run_path(str(EXAMPLES / "vector_ppo.py"))["main"]
    before, after = main(updates=6)
    assert after < 0.6 < before


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
    for k, ratio in ((0, 0.5), (1, 0.95)):  # errors of the loss, and of the force
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
