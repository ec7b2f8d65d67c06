"""Many robots alike, each in a scene of its own, moved by one call of the kernel."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from solver import _kernel
from solver.equilibrium import BaseEquilibrium, Equilibrium
from solver.layout import CABLE, PLANE, Layout, Model, layout
from solver.reference import ReferenceSolver
from solver.robot import Robot
from solver.scene import Scene
from solver.solve import check_core, kernel_robot, kernel_scene
from solver.status import Status


class BaseBatch(ABC):
    """Moves many robots at once; each is moved as its solver would, bit for bit.

    Unlike the solver it keeps the present equilibria, as rows of arrays that are written in place.

    Attributes:
        blocks: Equilibria, ``(N, size)``; :attr:`layout` tells where their numbers stand.
        statuses: How the last step of each ended, values of :class:`solver.Status`, ``(N,)``.
        iterations: Newton iterations of these steps, ``(N,)``.
        factorizations: Factorisations of the Hessian in these steps, ``(N,)``.
        commands: Cable displacements and length each is moved to, ``(N, cables + 1)`` [mm].

    Args:
        robot: What all robots are.
        count: Number N of robots.
        obstacles: Number of obstacles of every scene.
        threads: Threads that share the work; the answer does not depend on them.

    Raises:
        ValueError: If a number is not positive.
    """

    model: ClassVar[Model]

    def __init__(self, robot: Any, count: int, obstacles: int, threads: int = 1) -> None:
        for name, value in (("count", count), ("threads", threads)):
            if not (isinstance(value, int) and value > 0):
                raise ValueError(f"{name} is {value!r}; it must be a positive whole number")
        self.robot, self.count = robot, count
        self.layout = self._make_layout(obstacles)
        self.blocks = np.zeros((count, self.layout.size))
        self.statuses = np.zeros(count, np.int64)
        self.iterations = np.zeros(count, np.int64)
        self.factorizations = np.zeros(count, np.int64)
        self._scenes: list[Scene | None] = [None] * count
        self.commands = np.zeros((count, self.model.cables + 1))
        self._fleet = self._make_fleet(obstacles, threads)
        self._all = list(range(count))

    @abstractmethod
    def _make_layout(self, obstacles: int) -> Layout:
        """The layout of a block."""

    @abstractmethod
    def _make_fleet(self, obstacles: int, threads: int) -> Any:
        """The robots in the kernel."""

    @abstractmethod
    def _kernel_scene(self, scene: Scene) -> Any:
        """Obstacles as the kernel takes them."""

    @abstractmethod
    def _make_equilibrium(self, scene: Scene, block: np.ndarray, status: Status, *work: int) -> BaseEquilibrium:
        """The result of a solve."""

    def assign(self, index: int, scene: Scene) -> None:
        """Put a robot, straight and unactuated, among other obstacles.

        Raises:
            ValueError: If an obstacle is narrow enough to slip between its points or names a node it does not have.
        """
        check_core(self.robot, scene)
        self._fleet.assign(index, self._kernel_scene(scene))
        self._scenes[index] = scene

    def rest(self, robots: Sequence[int]) -> None:
        """Make some robots straight and unactuated again."""
        self.blocks[robots] = 0.0
        self.blocks[robots, self.layout.length_at] = self.robot.length_mm
        self.commands[robots] = 0.0
        self.commands[robots, -1] = self.robot.length_mm
        self._move(list(robots))

    def step(self, cable_mm: np.ndarray, robots: Sequence[int] | None = None) -> None:
        """Move the cables of all robots, or of some, as far as tension and obstacles allow.

        Args:
            cable_mm: Commanded cable displacement of each of them, ``(k,)``, in space ``(k, 2)`` [mm].
            robots: Which; ``None`` for all.

        Raises:
            ValueError: If a command is out of range; nothing has moved then.
        """
        high = self.robot.cable_limit_mm
        low = 0.0 if self.model.cables == 1 else -high
        if not ((cable_mm >= low) & (cable_mm <= high)).all():
            raise ValueError(f"cable_mm is {cable_mm}; all must be from {low:.6g} to {high:.6g}")
        which = self._all if robots is None else list(robots)
        self.commands[which, :-1] = np.reshape(cable_mm, (-1, self.model.cables))
        self.move(which)

    def move(self, which: int | slice | list[int]) -> None:
        """Move one robot, some or all to their commands, which must be in range."""
        self._move([which] if isinstance(which, int) else which if isinstance(which, list) else self._all[which])

    def probe(self, commands: np.ndarray) -> np.ndarray:
        """The equilibria that all robots would move to, ``(N, size)``; they stay where they are.

        Args:
            commands: As :attr:`commands`, in range.
        """
        blocks, scratch = self.blocks.copy(), [np.zeros(self.count, np.int64) for _ in range(3)]
        self._fleet.step(self._all, commands, blocks, *scratch)
        return blocks

    def optimality(self) -> np.ndarray:
        """How well the present equilibria meet their conditions, rows as :class:`solver.Optimality`, ``(N, 3)``."""
        found = np.zeros((self.count, 3))
        self._fleet.optimality(self.blocks, found)
        return found

    def reaches(
        self,
        robots: Sequence[int],
        forces: np.ndarray,
        increment_mm: float,
        limit_mm: float,
        directions: np.ndarray | None = None,
        obstacle: int | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Whether pulling some robots steadily from rest gets each to a contact force, and the force it gets to.

        No step may end in anything but ``CONVERGED``, and the straight robot must be clear of the obstacles.

        Args:
            robots: Which, assigned to their scenes; their states are left alone.
            forces: Force for each, ``(k,)`` [N].
            increment_mm: Cable displacement of a step [mm].
            limit_mm: Bound on the cable displacement [mm].
            directions: Displacements of the cables per millimetre of pull, ``(k, cables)``; ``None`` for ones.
            obstacle: The obstacle whose contact force is meant; ``None`` for all together.

        Returns:
            ``(k,)`` bool, and the contact force on each robot at the end of its pull, ``(k, d)`` [N].
        """
        forces = np.asarray(forces, float)
        directions = np.ones((len(forces), self.model.cables)) if directions is None else directions
        length = self.robot.length_mm
        reached = np.zeros((len(forces), self.model.space))
        target = -1 if obstacle is None else obstacle
        found = self._fleet.reaches(list(robots), forces, target, directions, increment_mm, limit_mm, length, reached)
        return np.array(found, bool), reached

    def scene(self, index: int) -> Scene:
        """The obstacles a robot is among.

        Raises:
            ValueError: If it has not been assigned to a scene.
        """
        scene = self._scenes[index]
        if scene is None:
            raise ValueError(f"robot {index} has not been assigned to a scene")
        return scene

    def equilibrium(self, index: int) -> Any:
        """A robot's present equilibrium, on its own."""
        scene = self.scene(index)
        work = int(self.iterations[index]), int(self.factorizations[index])
        return self._make_equilibrium(scene, self.blocks[index].copy(), Status(self.statuses[index]), *work)

    def _move(self, robots: list[int]) -> None:
        self._fleet.step(robots, self.commands, self.blocks, self.statuses, self.iterations, self.factorizations)


class BatchSolver(BaseBatch):
    """Many robots in the plane, each moved as :class:`solver.Solver` would; see :class:`BaseBatch`."""

    model = PLANE

    def _make_layout(self, obstacles: int) -> Layout:
        return layout(self.robot, obstacles)

    def _make_fleet(self, obstacles: int, threads: int) -> _kernel.Fleet:
        return _kernel.Fleet(kernel_robot(self.robot), self.count, obstacles, threads)

    def _kernel_scene(self, scene: Scene) -> _kernel.Scene:
        return kernel_scene(self.robot, scene)

    def _make_equilibrium(self, scene: Scene, block: np.ndarray, status: Status, *work: int) -> Equilibrium:
        return Equilibrium(self.robot, scene, block, status, *work)


class ReferenceBatch(BatchSolver):
    """The same robots moved by :class:`solver.ReferenceSolver`, one after the other and slowly.

    Trial pulls of :meth:`reaches` are the kernel's.
    """

    def _move(self, robots: list[int]) -> None:
        for robot in robots:
            scene = self._scenes[robot]
            assert scene is not None
            reference = _reference(self.robot, scene)
            if self.commands[robot, CABLE] == 0 and not self.blocks[robot, CABLE]:
                reached = reference.rest()
            else:
                reached = reference.step(self.equilibrium(robot), float(self.commands[robot, CABLE]))
            self.blocks[robot] = reached.block
            self.statuses[robot], self.iterations[robot] = reached.status, reached.iterations


@lru_cache(maxsize=64)
def _reference(robot: Robot, scene: Scene) -> ReferenceSolver:
    return ReferenceSolver(robot, scene)
