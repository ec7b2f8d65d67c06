"""Base class of batches: many robots of one layout, each in its own scene, moved by one call of the kernel."""

import os
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from solver.common.batch_moves import MoveBatch, SlopeArrays
from solver.common.checks import check_carried, check_clear, check_scene
from solver.common.equilibrium import BaseEquilibrium, RobotT_co
from solver.common.geometry import UnstressedRobot
from solver.common.layout import Layout
from solver.common.robot import AnyRobot
from solver.common.rows import RowBatch, as_slice
from solver.common.scene import MAX_OBSTACLES, Scene
from solver.common.status import Status
from solver.common.validation import (
    LARGEST,
    check_array,
    check_instance,
    check_positive,
    check_whole,
)

EquilibriumT_co = TypeVar("EquilibriumT_co", bound=BaseEquilibrium[AnyRobot], covariant=True)

MAX_PULL_STEPS = 100_000  # of a trial pull
GAVE_UP = int(Status.GAVE_UP)  # comparisons with a member of an enumeration take longer


class RobotBatch(MoveBatch[RobotT_co], Generic[RobotT_co, EquilibriumT_co]):
    """Moves many robots at once, each with results bit-identical to those of its solver.

    Unlike a solver, a batch keeps the present equilibria, as rows of arrays that are written in place.

    A batch is for one thread at a time: a call during another thread's raises RuntimeError and changes nothing. Ctrl-C,
    like any signal whose handler raises, ends a call within a fraction of a second, also amid a step. Robots whose
    steps had ended keep their new blocks, statuses and counts, the others stay where they were, and :attr:`commands`
    holds the new commands of all. After an interrupted :meth:`rest`, its robots do not move until it is repeated.

    A batch that is copied or pickled goes on with the same bits, in another process too. To copy single robots, use
    :meth:`get_rows` and :meth:`set_rows`.

    Attributes:
        blocks: Equilibria, ``(N, size)``, in the memory layout of :attr:`layout`.
        statuses: How the last step of each robot ended, values of :class:`solver.Status`, ``(N,)``.
        iterations: Newton iterations of these steps, ``(N,)``.
        factorizations: Factorisations of the Hessian in these steps, ``(N,)``.
        commands: Cable displacements and length that each robot is moved to, ``(N, cables + 1)`` [mm].

    Args:
        robot: The robot that all of them are but those that :meth:`assign` gives a robot of their own.
        count: Number N of robots.
        obstacles: Number of obstacles in every scene.
        threads: Threads that share the work; results do not depend on their number.

    Raises:
        ValueError: If a number is out of range, or the robots do not fit into memory.
        TypeError: If the robot is not one of the batch's space.
    """

    def __init__(self, robot: RobotT_co, count: int, obstacles: int, threads: int = 1) -> None:
        check_scene(robot, self.robot_kind, Scene(), self.space)
        count = check_whole("count", count, 1, 2**31 - 1)
        obstacles = check_whole("obstacles", obstacles, 0, MAX_OBSTACLES)
        threads = check_whole("threads", threads, 1, max(64, 4 * (os.cpu_count() or 1)), "more do not help")
        RowBatch.__init__(self, robot, count, self._make_layout(robot, obstacles), threads)
        self._work = self.statuses, self.iterations, self.factorizations
        self._unstressed = self._make_unstressed(robot)
        self._last_unstressed = self._unstressed  # of the last robot that was put among obstacles
        self._last_made: tuple[Any, Any] = (None, None)  # the last one that is not the batch's, as the kernel takes it

    @abstractmethod
    def _make_layout(self, robot: Any, obstacles: int) -> Layout:
        """Return the memory layout of a block of a robot."""

    @abstractmethod
    def _make_equilibrium(
        self, robot: Any, scene: Scene, block: np.ndarray, status: Status, *work: int
    ) -> EquilibriumT_co:
        """Return the equilibrium of a block."""

    @abstractmethod
    def _unstressed_points(self, robot: Any) -> np.ndarray:
        """Return the points that can touch of a robot that nothing strains, ``(p, k, d)`` [mm]."""

    def assign(self, index: int, scene: Scene, robot: RobotT_co | None = None) -> None:
        """Assign a scene to a robot, which must then be brought to rest by :meth:`rest` before it moves.

        A scene and a robot equal to the present ones change nothing.

        Args:
            index: Index of the robot.
            scene: Its obstacles.
            robot: What the robot is from now on, with the model and the numbers of segments, cables, lines and
                positions of the batch's robot; everything else may differ. ``None`` for the batch's robot.

        Raises:
            ValueError: As :class:`solver.Solver`, or if scene or robot do not have the numbers of the batch; nothing
                has changed then.
            TypeError: If ``scene`` is not a scene, or ``robot`` not one of the batch's space.
        """
        if not self.assign_if_clear(index, scene, robot):
            robot = robot or self.robot
            check_clear(robot, scene, self._unstressed_of(robot).gaps(scene))

    def assign_if_clear(self, index: int, scene: Scene, robot: RobotT_co | None = None) -> bool:
        """Assign a scene as :meth:`assign` if no obstacle overlaps the robot, and return whether none does.

        Raises:
            ValueError: As :meth:`assign`, but for obstacles that overlap; nothing has changed then.
            TypeError: As :meth:`assign`.
        """
        index, own = self._check_index(index), None if robot == self.robot else robot
        check_instance("scene", scene, Scene, "put the obstacles in one, Scene([…])")
        if (own, scene) == (self._robots[index], self._scenes[index]):
            return True
        changes = own != self._robots[index]
        if changes and own is not None and own is not self._last_made[0]:
            self._check_own(own)
        robot = own or self.robot
        compiled = self._compile(robot, scene)
        if len(scene) and not self._unstressed_of(robot).is_clear_of(scene):
            return False
        made = self._made(own) if changes and own is not None else None
        with self._exclusive:
            self._put(index, scene, compiled)
            self._become(index, own, made)
            self._unrested.add(index)
        return True

    def rest(self, robots: Sequence[int]) -> None:
        """Bring some robots to rest again, as ``rest()`` of their solver.

        Raises:
            ValueError: If an index is out of range or repeated, or a robot has no scene; nothing has changed then. If
                the motors of a robot cannot carry its loads, which then does not move, while the others are at rest.
        """
        indices = self._check_assigned(robots)
        at = as_slice(indices)
        with self._exclusive:
            self._unrested.update(indices)
            self._rest(indices)
            self.commands[at] = self.blocks[at, : self.cables + 1]  # cables and length
            refused = np.array(indices)[self.statuses[at] == GAVE_UP].tolist()
            self._unrested.difference_update(indices)
            self._unrested.update(refused)
        for index in refused:
            check_carried(self.robot_of(index), self.statuses[index])

    def step(
        self, cable_mm: np.ndarray, robots: Sequence[int] | None = None, scenes: Sequence[Scene] | None = None
    ) -> None:
        """Move the cables of all robots, or of some, as far as tension and obstacles allow.

        Args:
            cable_mm: Commanded cable displacement of each of them, ``(k,)``, of several cables ``(k, c)`` [mm].
            robots: Indices of the robots; ``None`` for all.
            scenes: Where the obstacles of each of them move to within the step, as in ``step`` of the solver; ``None``
                if none moves. Where they are then, :meth:`scene` tells.

        Raises:
            ValueError: If a command or a length in :attr:`blocks` is out of range, an index is out of range or
                repeated, a robot was not brought to rest in its scene, or obstacles cannot move to a scene; nothing
                has moved then.
        """
        self._step(cable_mm, robots, scenes)

    def _step(
        self,
        cable_mm: np.ndarray,
        robots: Sequence[int] | None,
        scenes: Sequence[Scene] | None,
        slopes: SlopeArrays | None = None,
    ) -> None:
        indices = self._all if robots is None else self._check_indices(robots)
        shape = (len(indices),) if self.cables == 1 else (len(indices), self.cables)
        commands = check_array("cable_mm", cable_mm, shape, *self._cable_bounds(indices))
        motions = self._motions(indices, scenes)
        with self._exclusive:
            self._check_rested(indices)
            self._check_lengths(indices)
            self.commands[indices, :-1] = commands.reshape(-1, self.cables)
            self._move_among(indices, motions, slopes)

    def move(self, robots: int | slice | list[int], scenes: Sequence[Scene] | None = None) -> None:
        """Move one robot, some or all to their :attr:`commands`, which must be in range.

        Args:
            robots: Their indices.
            scenes: Where the obstacles of each of them move to meanwhile, as in :meth:`step`.

        Raises:
            ValueError: If an index is out of range or repeated, a robot was not brought to rest in its scene, or
                obstacles cannot move to a scene; nothing has moved then.
        """
        self._move_to_commands(self._indices_of(robots), scenes)

    def _indices_of(self, robots: int | slice | list[int]) -> list[int]:
        if isinstance(robots, slice):
            return self._all[robots]
        return self._check_indices(robots) if isinstance(robots, list) else [self._check_index(robots)]

    def _move_to_commands(
        self, indices: list[int], scenes: Sequence[Scene] | None, slopes: SlopeArrays | None = None
    ) -> None:
        motions = self._motions(indices, scenes)
        with self._exclusive:
            self._check_rested(indices)
            self._move_among(indices, motions, slopes)

    def probe(self, commands: np.ndarray) -> np.ndarray:
        """Return the equilibria that all robots would move to, ``(N, size)``, without moving them.

        Args:
            commands: Commands like :attr:`commands`.

        Raises:
            ValueError: If a command or a length in :attr:`blocks` is out of range, or a robot was not brought to rest
                in its scene.
        """
        least, most, shortest, longest = self._limits.T
        low, high = (
            np.column_stack([np.tile(cable[:, None], self.cables), length])
            for cable, length in ((least, shortest), (most, longest))
        )
        bound = f"{self._cable_bounds(self._all)[-1]}, and lengths from {shortest.min():.6g} to {longest.max():.6g}"
        commands = check_array("commands", commands, self.commands.shape, low, high, bound)
        with self._exclusive:
            self._check_rested(self._all)
            self._check_lengths(self._all)
            blocks, scratch = self.blocks.copy(), [np.zeros(self.count, np.int64) for _ in range(3)]
            self._kernel_batch.step(self._all, commands, blocks, *scratch)
        return blocks

    def optimality(self) -> np.ndarray:
        """Return the optimality residuals of the present equilibria, in rows as :class:`solver.Optimality`, ``(N, 3)``.

        Raises:
            ValueError: If a robot was not brought to rest in its scene.
        """
        found = np.zeros((self.count, 3))
        with self._exclusive:
            self._check_rested(self._all)
            self._kernel_batch.optimality(self.blocks, found)
        return found

    def ramp_reaches_force(
        self,
        robots: Sequence[int],
        forces: np.ndarray,
        increment_mm: float,
        limit_mm: float,
        directions: np.ndarray | None = None,
        obstacle: int | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return whether a steady pull from rest brings each robot to a contact force, and the force it reaches.

        A pull whose steps do not all end in ``CONVERGED`` does not count.

        Args:
            robots: Indices of robots with scenes; their states are not changed.
            forces: Force for each robot, ``(k,)`` [N].
            increment_mm: Cable displacement of a step, at least a hundred thousandth of ``limit_mm`` [mm].
            limit_mm: Bound on the cable displacement, at most ``max_cable_mm`` of each robot [mm].
            directions: Displacements of the cables per millimetre of pull, at most 1 in size, in the plane not
                negative, ``(k, cables)``; ``None`` for ones.
            obstacle: Index of the obstacle whose contact force counts; ``None`` for the sum over all.

        Returns:
            ``(k,)`` bool, and the contact force on each robot at the end of its pull, ``(k, d)`` [N].

        Raises:
            ValueError: If a number or an index is out of range, an index is repeated, or a robot has no scene.
        """
        indices = self._check_assigned(robots)
        count, (lowest, highest, _) = len(indices), self._cable_bounds(indices)
        forces = check_array("forces", forces, (count,), 0.0, LARGEST, "finite and not negative")
        limit = check_positive("limit_mm", limit_mm, high=float(np.min(highest, initial=LARGEST)))
        increment = check_positive("increment_mm", increment_mm, limit / MAX_PULL_STEPS, LARGEST)
        given = np.ones((count, self.cables)) if directions is None else directions
        least = 0.0 if np.any(np.equal(lowest, 0)) else -1.0
        given = check_array("directions", given, (count, self.cables), least, 1.0, f"from {least:g} to 1")
        target = -1 if obstacle is None else check_whole("obstacle", obstacle, 0, self.layout.obstacles - 1)
        reached = np.zeros((count, self.space))
        with self._exclusive:
            found = self._kernel_batch.ramps_reach_forces(
                indices, forces, target, given, increment, limit, self._lengths_mm(indices), reached
            )
        return np.array(found, bool), reached

    def equilibrium(self, index: int) -> EquilibriumT_co:
        """Return the present equilibrium of a robot.

        Raises:
            ValueError: If the robot was not brought to rest in its scene, or its block is no equilibrium.
        """
        with self._exclusive:
            return self._equilibrium(index)

    def _equilibrium(self, index: int) -> EquilibriumT_co:
        scene = self.scene(index)
        self._check_rested([index])
        work = int(self.iterations[index]), int(self.factorizations[index])
        block, status = self.blocks[index].copy(), Status(self.statuses[index])
        return self._make_equilibrium(self.robot_of(index), scene, block, status, *work)

    def _unstressed_of(self, robot: Any) -> UnstressedRobot:
        """Return a robot that nothing strains, kept for the batch's robot and the last other one."""
        if robot is self.robot:
            return self._unstressed
        if robot is not self._last_unstressed.robot:
            self._last_unstressed = self._make_unstressed(robot)
        return self._last_unstressed

    def _made(self, robot: Any) -> Any:
        """Return a robot as the kernel takes it, kept for the last one."""
        if robot is not self._last_made[0]:
            self._last_made = robot, self._kernel_robot(robot)
        return self._last_made[1]

    def _make_unstressed(self, robot: Any) -> UnstressedRobot:
        return UnstressedRobot.of(robot, self._unstressed_points(robot))

    def _lengths_mm(self, robots: list[int]) -> list[float]:
        """Return the lengths at rest of some robots [mm]."""
        return [(self._robots[robot] or self.robot).length_mm for robot in robots]

    def _rest(self, robots: list[int]) -> None:
        self._kernel_batch.rest(robots, self._lengths_mm(robots), self.blocks, *self._work)


BaseBatch = RobotBatch[AnyRobot, BaseEquilibrium[AnyRobot]]  # for code that serves both the plane and space
