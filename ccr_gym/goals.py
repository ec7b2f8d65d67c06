"""The goal-conditioned form of an environment, for hindsight relabelling: the goal is the desired force.

``observation`` is what the other forms observe: what sensors tell. ``achieved_goal`` is the regulated force itself,
exact at every ``sensing``, because the reward follows from it and relabelled rewards must be those of the environment.
It is for the replay buffer alone: a policy that is to run on sensors must not read it (docs/sensing.md).
"""

from typing import Any

import numpy as np
from gymnasium import spaces


def goal_space(flat: spaces.Box, size: int) -> spaces.Dict:
    """Return the space of goal-conditioned observations, with goals of a size, 1 or d over the span of forces."""
    goal = spaces.Box(np.full(size, -1.0 if size > 1 else 0.0, np.float32), np.ones(size, np.float32))
    return spaces.Dict({"achieved_goal": goal, "desired_goal": goal, "observation": flat})


def compute_reward(achieved_goal: np.ndarray, desired_goal: np.ndarray, info: Any = None) -> np.ndarray:
    """Return ``−min(|F − F_d| / |F_d|, 1)``, the reward of goal-conditioned environments, ``(...)``.

    Relabelled goals may be zero, those of a robot without contact: then it is 0 without a force, and −1 with one.

    Args:
        achieved_goal: Forces F, ``(..., 1)`` or ``(..., d)``, in any unit.
        desired_goal: Set-points F_d, likewise.
        info: Not used.
    """
    error, desired = achieved_goal.astype(float) - desired_goal, desired_goal.astype(float)
    distance, size = np.linalg.norm(error, axis=-1), np.linalg.norm(desired, axis=-1)
    relative = np.divide(distance, size, out=np.array(distance > 0, float), where=size > 0)
    return np.asarray(-np.minimum(relative, 1.0))
