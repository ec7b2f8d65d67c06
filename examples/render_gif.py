"""Render an episode of a trained policy as ``runs/episode.gif``; run it after ``pip install '.[agents]'``."""

import sys
from pathlib import Path

import gymnasium
import imageio.v3 as imageio

import ccr_gym  # noqa: F401 - registers the ids
from agents import LearnedPolicy, trained

ENV_ID = "CCR/TrackForce-v1"


def main(path: Path, steps: int = 96) -> None:
    """Play one episode in a test scene and write every second picture."""
    policy = LearnedPolicy(trained("Distilled", ENV_ID)[0])  # comes with the package
    env = gymnasium.make(ENV_ID, obs_mode="dict", sensing="realistic", split="test", render_mode="rgb_array")
    observation, _ = env.reset(seed=3)
    policy.reset(env)
    pictures = [env.render()]
    for _ in range(steps):
        observation, *_ = env.step(policy.act(observation))
        pictures.append(env.render())
    path.parent.mkdir(parents=True, exist_ok=True)
    imageio.imwrite(path, pictures[::2], duration=100, loop=0)  # milliseconds a picture, repeated for ever
    print(f"{path}: {len(pictures[::2])} pictures, {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/episode.gif"))
