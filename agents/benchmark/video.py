"""Videos of policies."""

from pathlib import Path

import imageio.v2 as imageio

from agents.environment import make_env
from agents.files import replacing
from agents.policy import Policy


def record(policy: Policy, env_id: str, seed: int, path: Path, **kwargs: object) -> None:
    """Render one episode to an MP4 file.

    Args:
        policy: The policy.
        env_id: Id of the environment.
        seed: Seed of the episode.
        path: Path of the file.
        **kwargs: Arguments of the environment.
    """
    env = make_env(env_id, render_mode="rgb_array", **kwargs)
    fps = env.metadata["render_fps"]
    try:
        with replacing(path) as partial, imageio.get_writer(partial, fps=fps, macro_block_size=16) as writer:
            observation, _ = env.reset(seed=seed)
            policy.reset(env)
            truncated = False
            while not truncated:
                observation, _, _, truncated, _ = env.step(policy.act(observation))
                writer.append_data(env.render())  # type: ignore[attr-defined] # a Format.Writer
    finally:
        env.close()
