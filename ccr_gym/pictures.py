"""Pictures of environments: the last steps of some robots, kept while they are rendered."""

from collections import deque

import numpy as np

from ccr_gym.episodes import EpisodeBatch
from ccr_gym.quantities import norm
from ccr_gym.rendering import Frame, Renderer

SHOWN_STEPS = 64  # of the strip chart
TILE_PX = 360  # width and height of the picture of one of several


class Pictures:
    """Draws robots of a batch of episodes with the forces of their last steps.

    Args:
        episodes: The episodes.
        title: Text of the title.
        fps: Frame rate of a window [1/s].
    """

    def __init__(self, episodes: EpisodeBatch, title: str, fps: int) -> None:
        self._episodes, self._title = episodes, title
        self._renderer = Renderer(fps) if episodes.count == 1 else Renderer(fps, (TILE_PX, TILE_PX))
        self._steps: list[deque[tuple[float, float, float]]] = [
            deque(maxlen=SHOWN_STEPS) for _ in range(episodes.count)
        ]
        self._rewards: list[float | None] = [None] * episodes.count

    def start(self, robots: list[int]) -> None:
        """Begin the episodes of some robots anew."""
        for robot in robots:
            self._steps[robot].clear()
            self._rewards[robot] = None
            self._add(robot)

    def add(self, rewards: np.ndarray) -> None:
        """Note a step of all robots, with rewards ``(N,)``."""
        for robot in range(self._episodes.count):
            self._rewards[robot] = float(rewards[robot])
            self._add(robot)

    def draw(self, robot: int = 0) -> np.ndarray:
        """Return the picture of a robot, ``(H, W, 3)`` uint8."""
        return self._renderer.draw(self._frame(robot))

    def show(self) -> None:
        """Show the first robot in a window."""
        self._renderer.show(self._frame(0))

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()

    def _add(self, robot: int) -> None:
        reading = self._episodes.read(robot)
        true, estimate = float(norm(reading.force_true)), float(norm(reading.force_est))
        self._steps[robot].append((float(reading.desired), true, estimate))

    def _frame(self, robot: int) -> Frame:
        reading, episodes = self._episodes.read(robot), self._episodes
        desired, true, estimate = np.array(self._steps[robot]).T
        return Frame(
            episodes.equilibrium(robot),
            reading.force_true,
            reading.force_est,
            float(reading.desired),
            episodes.shown_force_n,
            target=episodes.target,
            start_scene=episodes.start_scene(robot),
            desired_history=desired,
            true_history=true,
            estimate_history=estimate,
            title=self._title,
            step=episodes.steps(robot),
            reward=self._rewards[robot],
        )
