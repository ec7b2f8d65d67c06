"""The state that one picture shows."""

from dataclasses import dataclass

import numpy as np

from solver import Equilibrium, Obstacle, Scene
from solver.spatial import SpatialEquilibrium


@dataclass(frozen=True, slots=True)
class Frame:
    """The state that one picture shows; what is not given is not drawn.

    Attributes:
        equilibrium: The robot among its obstacles.
        force_true: Energy-based contact force on the robot, base frame, ``(d,)`` [N].
        force_est: Estimated contact force on the robot, base frame, ``(d,)`` [N].
        desired_force: Magnitude of the set-point [N].
        force_scale: Force at which gauge, strip chart and arrows reach full length, positive [N].
        target: Index of the obstacle whose force is shown; ``None`` for the sum over all.
        start_scene: The obstacles at the start of the episode; of those that have moved since, the way is drawn.
        desired_history: Set-points of the last steps, the present one last, ``(N,)`` [N].
        true_history: Magnitudes of the true force at the same steps, ``(N,)`` [N].
        estimate_history: Magnitudes of the estimated or measured force at the same steps, ``(N,)`` [N].
        title: Text of the title, such as the id of the environment.
        step: Number of steps since the reset.
        reward: Reward of the last step.
    """

    equilibrium: Equilibrium | SpatialEquilibrium
    force_true: np.ndarray
    force_est: np.ndarray
    desired_force: float
    force_scale: float
    target: int | None = None
    start_scene: Scene | None = None
    desired_history: np.ndarray | None = None
    true_history: np.ndarray | None = None
    estimate_history: np.ndarray | None = None
    title: str = ""
    step: int | None = None
    reward: float | None = None

    @property
    def histories(self) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray | None]:
        """Histories of the true force, the estimated force and the set-point, each ``(N,)`` [N] or ``None``."""
        return self.true_history, self.estimate_history, self.desired_history

    @property
    def moved(self) -> list[tuple[Obstacle, Obstacle]]:
        """The obstacles that have moved since the start of the episode: as they were then, and as they rest now."""
        before, now = self.start_scene or Scene(), self.equilibrium.scene
        return [(old, new) for old, new in zip(before, now, strict=False) if old.parameters != new.parameters]

    @property
    def has_title(self) -> bool:
        """Whether the picture has a line with title, step or reward."""
        return bool(self.title) or self.step is not None or self.reward is not None

    @property
    def has_chart(self) -> bool:
        """Whether the picture has a strip chart."""
        return any(history is not None and len(history) > 0 for history in self.histories)
