"""Video of a policy."""

from pathlib import Path
from typing import Any

import gymnasium
import imageio.v2 as imageio

from agents.files import replacing
from agents.policy import Policy


def record(policy: Policy, env_id: str, seed: int, path: Path, **kwargs: Any) -> None:
    """Render an episode of an environment made with some arguments to an MP4 file."""
    env = gymnasium.make(env_id, obs_mode="dict", render_mode="rgb_array", disable_env_checker=True, **kwargs)
    try:
        with replacing(path) as partial, _writer(partial, env.metadata["render_fps"]) as writer:
            observation, _ = env.reset(seed=seed)
            policy.reset(env)
            truncated = False
            while not truncated:
                observation, _, _, truncated, _ = env.step(policy.act(observation))
                writer.append_data(env.render())
    finally:
        env.close()


def _writer(path: Path, fps: int) -> Any:
    return imageio.get_writer(path, fps=fps, macro_block_size=16)
