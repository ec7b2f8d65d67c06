"""Episodes of one task side by side: the transition, what is seen of it and what it is worth, in whole arrays.

Every environment, single or vector, is a shell around a fleet, so that they cannot drift apart.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ccr_gym.observation import Observer
from ccr_gym.reward import TERMS, reward_terms
from ccr_gym.settings import Settings, require
from ccr_gym.tasks import Assignment, Task, assign
from solver import Equilibrium, Solver
from solver.batch import BatchSolver, ReferenceBatch
from solver.forces import virtual_work
from solver.layout import CABLE, TENSION


class Reading(NamedTuple):
    """What the robots feel, one row each.

    Attributes:
        force_true: Contact force on the robot, ``(N, 2)`` [N].
        force_est: The same by virtual work, ``(N, 2)`` [N].
        force: Magnitude of the true one, ``(N,)`` [N].
    """

    force_true: np.ndarray
    force_est: np.ndarray
    force: np.ndarray


class Fleet:
    """Robots, each with a scene and a force to push with.

    Args:
        task: What the episodes ask.
        settings: What the environments were told.
        count: Number N of episodes.
        threads: Threads of the solver.
    """

    def __init__(self, task: Task, settings: Settings, count: int, threads: int = 1) -> None:
        self._task, self._settings = task, settings
        self.count, self._threads = count, threads
        self.desired = np.ones(count)
        self._effort = np.zeros(count)
        self._enter(task.obstacles)

    def _enter(self, obstacles: int) -> None:
        """Make room for scenes of so many obstacles."""
        settings = self._settings
        solver = ReferenceBatch if settings.backend == "casadi" else BatchSolver
        self.solver = solver(settings.robot, self.count, obstacles, self._threads)
        self._layout = self.solver.layout
        self.observer = Observer(settings.robot, self._layout, settings.force_sensor, settings.cable_limit_mm)
        self._reading: Reading | None = None

    def draw(self, robots: Sequence[int], generators: Sequence[np.random.Generator]) -> None:
        """Start new episodes of some robots, each drawn by its own generator."""
        settings = self._settings
        assign(self._task, self.solver, robots, generators, settings.cable_limit_mm, self.desired)
        self._begin(robots)

    def give(self, robot: int, assignment: Assignment) -> None:
        """Start a given episode of a robot.

        Raises:
            ValueError: As :class:`solver.Solver`; the episode goes on as it was.
        """
        Solver(self._settings.robot, assignment.scene)
        if len(assignment.scene) != self._layout.obstacles:
            require(self.count == 1, f"all scenes of several robots must have {self._layout.obstacles} obstacles")
            self._enter(len(assignment.scene))
        self.solver.assign(robot, assignment.scene)
        self.desired[robot] = assignment.desired_force
        self._begin([robot])

    def _begin(self, robots: Sequence[int]) -> None:
        self.solver.rest(robots)
        self._effort[robots] = 0.0
        self._reading = None

    def step(self, effort: np.ndarray, robots: Sequence[int] | None = None) -> None:
        """Move the cables of all robots, or of some, by ``effort · max_increment_mm``.

        Args:
            effort: Normalised cable increments in [−1, 1] of these robots, ``(k,)``.
            robots: Which; ``None`` for all.
        """
        settings, blocks = self._settings, self.solver.blocks
        present = blocks[:, CABLE] if robots is None else blocks[robots, CABLE]
        command = present + effort * settings.max_increment_mm
        self.solver.step(np.minimum(np.maximum(command, 0.0), settings.cable_limit_mm), robots)
        self._effort[slice(None) if robots is None else robots] = effort
        self._reading = None

    @property
    def reading(self) -> Reading:
        """What the robots feel now."""
        if self._reading is None:
            blocks, settings = self.solver.blocks, self._settings
            force_true = self._layout.force(blocks).copy()
            force = np.hypot(force_true[:, 0], force_true[:, 1])
            force_est = np.zeros_like(force_true)
            touching = force > 0
            if touching.any():
                forces, slopes = self._layout.forces(blocks), self._layout.tip_slopes(blocks)
                load = blocks[:, TENSION] - self._layout.onset(blocks)[:, 0]
                offset = settings.robot.offset_mm
                force_est = virtual_work(forces, load, slopes, offset, settings.friction).sum(axis=1)
            self._reading = Reading(force_true, force_est, force)
        return self._reading

    def observe(self) -> np.ndarray:
        """What is seen, in the flat form, ``(N, k)`` float32."""
        reading = self.reading
        return self.observer.flat(self.solver.blocks, reading.force, reading.force_est, self.desired)

    def rewards(self) -> np.ndarray:
        """Terms of the reward of the last step, ``(5, N)``."""
        clearance = self._layout.clearance(self.solver.blocks)[:, 0]
        return reward_terms(self._settings.weights, self.reading.force, self.desired, clearance, self._effort)

    def infos(self, terms: np.ndarray) -> dict[str, Any]:
        """What is told beside the observation, an array over the robots for each name."""
        force_true, force_est, force = self.reading
        blocks = self.solver.blocks
        return {
            "force_true": force_true.copy(),
            "force_est": force_est.copy(),
            "desired_force": self.desired.copy(),
            "cable_mm": blocks[:, CABLE].copy(),
            "tension": blocks[:, TENSION].copy(),
            "solver_status": self.solver.statuses.astype(int),
            "cost": np.maximum(0.0, force - self._settings.force_limit),
            "is_success": np.abs(force - self.desired) <= 0.05 * self.desired,
            "reward_terms": dict(zip(TERMS, terms, strict=True)),
        }

    def equilibrium(self, robot: int) -> Equilibrium:
        """A robot's present equilibrium; immutable."""
        return self.solver.equilibrium(robot)
