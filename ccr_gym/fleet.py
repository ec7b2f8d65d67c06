"""Episodes of one task side by side: the transition, what is seen of it and what it is worth.

Every environment, single or vector, is a shell around a fleet, so that they cannot drift apart.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ccr_gym.bodies import Which, plain
from ccr_gym.observation import Observer
from ccr_gym.reward import TERMS, reward_terms
from ccr_gym.settings import Settings, require
from ccr_gym.tasks import Assignment, Task, assign
from solver.layout import SPACE
from solver.solve import Solver
from solver.spatial import SpatialSolver

ALL = slice(None)


class Reading(NamedTuple):
    """What one robot feels, or what all of them do.

    Attributes:
        blocks: Their equilibria, ``(..., size)``.
        force_true: Contact force on the robot, ``(..., d)`` [N].
        force_est: The same by virtual work, ``(..., d)`` [N].
        force: Magnitude of the true one [N].
        desired: Magnitude of the set-point [N].
        goal: The set-point, its magnitude or ``(..., d)`` [N].
        lacking: Set-point minus measured, of magnitudes or ``(..., d)`` [N].
        error: Relative force error.
    """

    blocks: np.ndarray
    force_true: np.ndarray
    force_est: np.ndarray
    force: Any
    desired: Any
    goal: Any
    lacking: Any
    error: Any


class Fleet:
    """Robots, each with a scene and a force to push with.

    Args:
        task: What the episodes ask.
        settings: What the environments were told.
        count: Number N of episodes.
        threads: Threads of the solver.
    """

    def __init__(self, task: Task, settings: Settings, count: int, threads: int = 1) -> None:
        self._task, self._settings, self.body = task, settings, task.body
        self.count, self._threads = count, threads
        space, cables = self.body.model.space, self.body.model.cables
        self.desired = np.ones(count)
        self._goals = np.ones((count, space))  # set-points that are vectors
        self._effort = np.zeros(count) if cables == 1 else np.zeros((count, cables))
        self._seen = np.zeros((count, self.body.obstacle_size))
        self._enter(task.obstacles)

    def _enter(self, obstacles: int) -> None:
        """Make room for scenes of so many obstacles."""
        self.solver = self.body.batch(self._settings, self.count, obstacles, self._threads)
        self._layout = self.solver.layout
        self.observer = Observer(self.body, self._settings, self._layout, self._task.force_vector)

    def draw(self, robots: Sequence[int], generators: Sequence[np.random.Generator]) -> None:
        """Start new episodes of some robots, each drawn by its own generator."""
        forces = assign(self._task, self.solver, robots, generators, self._settings.cable_limit_mm)
        self._aim(robots, forces)

    def give(self, robot: int, assignment: Assignment) -> None:
        """Start a given episode of a robot.

        Raises:
            ValueError: As the solver; the episode goes on as it was.
        """
        solver: Any = SpatialSolver if self.body.model is SPACE else Solver
        solver(self._settings.robot, assignment.scene)
        if len(assignment.scene) != self._layout.obstacles:
            require(self.count == 1, f"all scenes of several robots must have {self._layout.obstacles} obstacles")
            self._enter(len(assignment.scene))
        self.solver.assign(robot, assignment.scene)
        self._aim([robot], np.atleast_2d(assignment.desired_force))

    def _aim(self, robots: Sequence[int], forces: np.ndarray) -> None:
        """Begin episodes with set-points, magnitudes ``(k, 1)`` or vectors ``(k, d)`` [N]."""
        self.desired[robots] = forces[:, 0]
        if self._task.force_vector:
            self._goals[robots] = forces
            self.desired[robots] = _norm(forces)
        self.solver.rest(robots)
        self._effort[robots] = 0.0
        for robot in robots if self.body.obstacle_size else ():
            self._seen[robot] = self.body.obstacle(self.solver.scene(robot))

    def step(self, effort: Any, which: Which = ALL) -> None:
        """Move the cables of all robots, or of some, by ``effort · max_increment_mm``.

        Args:
            effort: Normalised cable increments of these robots, as :meth:`ccr_gym.bodies.Body.effort` gives them.
            which: One robot, a list of them, or all.
        """
        body, solver = self.body, self.solver
        solver.commands[which, body.place] = body.command(solver.blocks, effort, which, self._settings)
        self._effort[which] = effort
        solver.move(which)

    def read(self, which: int | slice = ALL) -> Reading:
        """What one robot or all of them feel now."""
        blocks = self.solver.blocks[which]
        force_true = self._layout.force(blocks).copy()
        force, desired = plain(_norm(force_true), which), plain(self.desired[which], which)
        force_est = self.body.estimate(blocks, self._layout, force_true, which, self._settings)
        if self._task.force_vector:
            goal = self._goals[which].copy()
            lacking = goal - force_true
            error = plain(_norm(lacking), which) / desired
        else:
            goal, lacking = desired, desired - force
            error = abs(lacking) / desired
        return Reading(blocks, force_true, force_est, force, desired, goal, lacking, error)

    def observe(self, reading: Reading, which: int | slice = ALL) -> np.ndarray:
        """What is seen, in the flat form, ``(k,)`` or ``(N, k)`` float32."""
        told = {"desired_force": reading.goal, "force_error": reading.lacking, "force_est": reading.force_est}
        return self.observer.flat(reading.blocks, told, self._seen[which])

    def rewards(self, reading: Reading, which: int | slice = ALL) -> tuple[Any, ...]:
        """Terms of the reward of the last step."""
        clearance = plain(reading.blocks[..., self._layout.clearance_at], which)
        effort = self.body.square(plain(self._effort[which], which) if self._effort.ndim == 1 else self._effort[which])
        operations = self.body.operations(which)
        weights, force, desired = self._settings.weights, reading.force, reading.desired
        return reward_terms(weights, force, desired, reading.error, clearance, effort, operations)

    def infos(self, reading: Reading, terms: tuple[Any, ...], which: int | slice = ALL) -> dict[str, Any]:
        """What is told beside the observation, a plain number for one robot and an array for many."""
        return {
            "force_true": reading.force_true,
            "force_est": reading.force_est,
            "desired_force": reading.goal,
            **self.body.told(reading.blocks, which),
            "solver_status": plain(self.solver.statuses[which], which),
            "cost": self.body.operations(which).maximum(0.0, reading.force - self._settings.force_limit),
            "is_success": reading.error <= 0.05,
            "reward_terms": dict(zip(TERMS, terms, strict=True)),
        }

    def equilibrium(self, robot: int) -> Any:
        """A robot's present equilibrium; immutable."""
        return self.solver.equilibrium(robot)


def _norm(forces: np.ndarray) -> Any:
    """Magnitudes of forces ``(..., d)``."""
    if forces.shape[-1] == 2:
        return np.hypot(forces[..., 0], forces[..., 1])
    return np.sqrt(forces[..., 0] ** 2 + forces[..., 1] ** 2 + forces[..., 2] ** 2)
