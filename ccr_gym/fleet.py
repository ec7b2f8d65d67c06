"""Episodes of one task side by side: the transition, what is seen of it and what it is worth.

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
from solver.operations import ARRAYS, NUMBERS, Operations

ALL = slice(None)
Which = int | slice | list[int]


class Reading(NamedTuple):
    """What one robot feels, or what all of them do.

    Attributes:
        blocks: Their equilibria, ``(..., size)``.
        force_true: Contact force on the robot, ``(..., 2)`` [N].
        force_est: The same by virtual work, ``(..., 2)`` [N].
        force: Magnitude of the true one [N].
        desired: Set-point [N].
    """

    blocks: np.ndarray
    force_true: np.ndarray
    force_est: np.ndarray
    force: Any
    desired: Any


def _operations(which: Which) -> Operations:
    return NUMBERS if isinstance(which, int) else ARRAYS


def _columns(values: np.ndarray, which: Which) -> Any:
    """The numbers of one robot, or those of many as arrays, each over all of them."""
    return values.tolist() if isinstance(which, int) else values.T


def _plain(value: Any, which: Which) -> Any:
    """A number of one robot as Python's own, those of many as an array of their own."""
    return value.item() if isinstance(which, int) else value.copy()


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

    def step(self, effort: Any, which: Which = ALL) -> None:
        """Move the cables of all robots, or of some, by ``effort · max_increment_mm``.

        Args:
            effort: Normalised cable increments in [−1, 1] of these robots, a number or ``(k,)``.
            which: One robot, a list of them, or all.
        """
        settings, (minimum, maximum, _) = self._settings, _operations(which)
        command = self.solver.blocks[which, CABLE] + effort * settings.max_increment_mm
        self.solver.commands[which, CABLE] = minimum(maximum(command, 0.0), settings.cable_limit_mm)
        self._effort[which] = effort
        self.solver.move(which)

    def read(self, which: int | slice = ALL) -> Reading:
        """What one robot or all of them feel now."""
        layout, settings, blocks = self._layout, self._settings, self.solver.blocks[which]
        force_true = layout.force(blocks).copy()
        force = _plain(np.hypot(force_true[..., 0], force_true[..., 1]), which)
        force_est = np.zeros(force_true.shape)
        if force > 0 if isinstance(which, int) else force.any():
            normal_x, normal_y = _columns(force_true, which)
            x, y = normal_x - settings.friction * normal_y, normal_y + settings.friction * normal_x
            slopes = _columns(layout.tip_slopes(blocks), which)
            load = _plain(blocks[..., TENSION] - layout.onset(blocks)[..., 0], which)
            ratio = virtual_work(x, y, load, slopes, settings.robot.offset_mm, _operations(which))
            force_est[..., 0], force_est[..., 1] = ratio * x, ratio * y
        return Reading(blocks, force_true, force_est, force, _plain(self.desired[which], which))

    def observe(self, reading: Reading) -> np.ndarray:
        """What is seen, in the flat form, ``(k,)`` or ``(N, k)`` float32."""
        return self.observer.flat(reading.blocks, reading.force, reading.force_est, reading.desired)

    def rewards(self, reading: Reading, which: int | slice = ALL) -> tuple[Any, ...]:
        """Terms of the reward of the last step."""
        clearance = _plain(reading.blocks[..., self._layout.clearance_at], which)
        told = clearance, _plain(self._effort[which], which)
        return reward_terms(self._settings.weights, reading.force, reading.desired, *told, _operations(which))

    def infos(self, reading: Reading, terms: tuple[Any, ...], which: int | slice = ALL) -> dict[str, Any]:
        """What is told beside the observation, a plain number for one robot and an array for many."""
        blocks, force_true, force_est, force, desired = reading
        return {
            "force_true": force_true,
            "force_est": force_est,
            "desired_force": desired,
            "cable_mm": _plain(blocks[..., CABLE], which),
            "tension": _plain(blocks[..., TENSION], which),
            "solver_status": _plain(self.solver.statuses[which], which),
            "cost": _operations(which).maximum(0.0, force - self._settings.force_limit),
            "is_success": abs(force - desired) <= 0.05 * desired,
            "reward_terms": dict(zip(TERMS, terms, strict=True)),
        }

    def equilibrium(self, robot: int) -> Equilibrium:
        """A robot's present equilibrium; immutable."""
        return self.solver.equilibrium(robot)
