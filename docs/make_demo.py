"""Write ``demo.gif`` and ``thumbnails/``.

In the animation a policy that comes with the package tracks a force on a test scene, with realistic sensing. A
thumbnail shows the robot of an environment after some steps of the oracle.
"""

from pathlib import Path

import gymnasium
import numpy as np
from PIL import Image

import ccr_gym
from agents import LearnedPolicy, NewtonController, trained

ENV_ID, LEARNER, SEED = "CCR/TrackForce-v1", "Distilled", 2
COLOURS = 256  # fewer lose the red of contacts and of the tension limit
FRAME_MS, LAST_MS = 50, 1500  # how long each picture is shown, and the last one
PATH = Path(__file__).with_name("demo.gif")
THUMBNAILS = Path(__file__).with_name("thumbnails")
THUMBNAIL_SEED, STEPS = 3, 40
PLANE, SPACE = (0.17, 0.09, 0.67, 0.72), (0.13, 0.09, 0.63, 0.72)  # where the robot is, as parts of a picture
HEIGHT = 240


def main() -> None:
    """Write all pictures."""
    write_demo()
    THUMBNAILS.mkdir(exist_ok=True)
    for env_id in ccr_gym.ENV_IDS:
        path = THUMBNAILS / f"{env_id.split('/')[1]}.png"
        thumbnail(env_id).save(path, optimize=True)
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


def write_demo() -> None:
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


def thumbnail(env_id: str) -> Image.Image:
    """Return a small picture of the robot among its obstacles."""
    env = gymnasium.make(env_id, render_mode="rgb_array", obs_mode="dict")
    policy = NewtonController.knowing()
    observation, _ = env.reset(seed=THUMBNAIL_SEED)
    policy.reset(env)
    for _ in range(STEPS):
        observation, *_ = env.step(policy.act(observation))
    picture = Image.fromarray(env.render())
    box = SPACE if "Spatial" in env_id else PLANE
    scene = picture.crop(tuple(round(part * size) for part, size in zip(box, picture.size * 2, strict=True)))
    small = scene.resize((round(HEIGHT * scene.width / scene.height), HEIGHT), Image.Resampling.LANCZOS)
    return small.quantize(64, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)


if __name__ == "__main__":
    main()
