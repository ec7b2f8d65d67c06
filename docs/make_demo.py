"""Write ``demo.gif``: a policy that comes with the package tracks a force on a test scene, with realistic sensing."""

from pathlib import Path

import gymnasium
import numpy as np
from PIL import Image

import ccr_gym  # noqa: F401 - registers the ids
from agents import LearnedPolicy, trained

ENV_ID, LEARNER, SEED = "CCR/TrackForce-v1", "Distilled", 2
COLOURS = 256  # fewer lose the red of contacts and of the tension limit
FRAME_MS, LAST_MS = 50, 1500  # how long each picture is shown, and the last one
PATH = Path(__file__).with_name("demo.gif")


def main() -> None:
    """Record an episode and write it, with one palette for all pictures."""
    frames = [Image.fromarray(frame) for frame in episode()]
    palette = frames[-1].quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    first, *others = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    times = [FRAME_MS] * len(others) + [LAST_MS]
    first.save(PATH, save_all=True, append_images=others, duration=times, loop=0, optimize=True)
    print(f"{PATH.name}: {len(frames)} pictures, {PATH.stat().st_size / 1e6:.2f} MB")


def episode() -> list[np.ndarray]:
    """Return the pictures of an episode, (640, 640, 3) each."""
    policy = LearnedPolicy(trained(LEARNER, ENV_ID)[0])
    env = gymnasium.make(ENV_ID, render_mode="rgb_array", obs_mode="dict", sensing="realistic", split="test")
    observation, _ = env.reset(seed=SEED)
    policy.reset(env)
    frames, ended = [env.render()], False
    while not ended:
        observation, _, _, ended, _ = env.step(policy.act(observation))
        frames.append(env.render())
    return frames


if __name__ == "__main__":
    main()
