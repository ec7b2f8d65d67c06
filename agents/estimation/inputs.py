"""Checks of what the estimator is given, before it takes any of it in."""

from collections.abc import Mapping

import numpy as np

from agents.environment import EnvIndex, require_entries
from ccr_gym import Settings, SpatialSettings


def entry_sizes(settings: Settings | SpatialSettings) -> tuple[dict[str, int], dict[str, int]]:
    """Return the sizes of the entries that every observation has, and of those that it may have."""
    robot, planar = settings.robot, isinstance(settings, Settings)
    commands, nodes = settings.actuation.matrix.shape[1], robot.segments + 1
    force = 2 if planar else 3
    touching = len(robot.lines_mm) * (robot.segments * (robot.between + 1) + 1)
    needed = {"cable": commands, "contact": touching, "force_est": force, "nodes": 3 * nodes}
    needed |= {} if planar else {"frames": 6 * nodes}
    tensions = {"tension": len(robot.cables), "free_tension": commands, "lever": commands}
    return needed, tensions | {"force_measured": force, "share": 1}


def check_robots(index: EnvIndex, count: int) -> int:
    """Return how many of ``count`` robots an index chooses.

    Raises:
        ValueError: If it chooses one that is not there, or one twice.
    """
    try:
        robots = np.arange(count)[index]
    except (IndexError, TypeError):
        robots = np.zeros((1, 1), int)
    if robots.ndim != 1 or len(set(robots.tolist())) < len(robots):
        raise ValueError(f"index is {index!r:.80}; it must choose robots from 0 to {count - 1}, each once")
    return len(robots)


def check_observation(
    observation: Mapping[str, np.ndarray], needed: Mapping[str, int], others: Mapping[str, int], count: int
) -> None:
    """Refuse observations that are not those of ``count`` robots of such sizes.

    Raises:
        ValueError: Naming the entry that is missing, or of another size, or not of finite numbers.
    """
    require_entries(observation, *needed)
    found = {name: size for name, size in {**needed, **others}.items() if name in observation}
    for name, size in found.items():
        entry = np.asarray(observation[name])
        if entry.shape != (count, size):
            raise ValueError(f"{name} has the shape {entry.shape}; it must be {(count, size)}, a row for each robot")
        if entry.dtype.kind not in "fiu" or not np.isfinite(entry).all():
            raise ValueError(f"{name} is {entry.tolist()!r:.80}; it must be finite numbers")
