"""Rows of a batch: the robots it moves, each with its scene and equilibrium, taken out and put back."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from operator import attrgetter
from typing import Any, ClassVar, Generic, NamedTuple, Self, cast

import numpy as np

from solver.common.checks import check_core, check_memory, check_scene
from solver.common.equilibrium import RobotT_co
from solver.common.exclusive import ExclusiveUse
from solver.common.layout import Layout
from solver.common.robot import AnyRobot
from solver.common.scene import Scene
from solver.common.validation import check_instance, check_sequence, check_whole, shown

Kernel = Any  # a batch, its arrays or a scene of the kernel, whose classes for the plane and for space share no base
SIZES = ("model", "segments", "number of cables", "number of lines that can touch", "positions")
NUMBERS = ("blocks", "statuses", "iterations", "factorizations", "commands")
NUMBERS_OF = attrgetter(*NUMBERS)


class Rows(NamedTuple):
    """States of robots of a batch: all that their next step depends on.

    Attributes:
        robot: The robot of the batch.
        robots: Robot of each that has one of its own, ``None`` where it is that of the batch, k of them.
        scenes: Scene of each, ``None`` where none was assigned, k of them.
        rested: Whether each was brought to rest in its scene and may move, ``(k,)`` bool.
        blocks: Their equilibria, ``(k, size)``.
        statuses: How their last steps ended, ``(k,)``.
        iterations: Newton iterations of these steps, ``(k,)``.
        factorizations: Factorisations of the Hessian in these steps, ``(k,)``.
        commands: Cable displacements and length that they are moved to, ``(k, cables + 1)`` [mm].
    """

    robot: AnyRobot
    robots: tuple[AnyRobot | None, ...]
    scenes: tuple[Scene | None, ...]
    rested: np.ndarray
    blocks: np.ndarray
    statuses: np.ndarray
    iterations: np.ndarray
    factorizations: np.ndarray
    commands: np.ndarray


def copies(arrays: Iterable[np.ndarray], at: slice | list[int]) -> list[np.ndarray]:
    """Return copies of the same rows of arrays."""
    if isinstance(at, slice):
        return [array[at].copy() for array in arrays]
    return [array[at] for array in arrays]


def as_slice(indices: list[int]) -> slice | list[int]:
    """Return indices as a slice if they follow each other, whose rows are found faster."""
    first, count = indices[0] if indices else 0, len(indices)
    return slice(first, first + count) if count < 2 or indices == list(range(first, first + count)) else indices


class Motion(NamedTuple):
    """Obstacles of a robot of a batch that move within a step.

    Attributes:
        robot: Index of the robot.
        scene: Where they move to.
        obstacles: The same as the kernel takes it.
        bounds: Bounds on how far the surface of each moves [mm].
    """

    robot: int
    scene: Scene
    obstacles: Kernel
    bounds: list[float]


class RowBatch(ABC, Generic[RobotT_co]):
    """Base class of a batch: its rows, which are copied, pickled and restored with it."""

    space: ClassVar[int]
    robot_kind: ClassVar[type]

    def __init__(self, robot: RobotT_co, count: int, layout: Layout, threads: int) -> None:
        self.robot, self.count, self.layout, self.threads = robot, count, layout, threads
        self.cables = len(robot.cables)
        check_memory(count, layout.size)
        self.blocks = np.zeros((count, layout.size))
        self.statuses = np.zeros(count, np.int64)
        self.iterations = np.zeros(count, np.int64)
        self.factorizations = np.zeros(count, np.int64)
        self.commands = np.zeros((count, self.cables + 1))
        self._robots: list[RobotT_co | None] = [None] * count  # those that differ from the batch's
        self._scenes: list[Scene | None] = [None] * count
        self._compiled: list[Kernel] = [None] * count  # the same as the kernel takes them
        self._limits = np.tile(_limits(robot), (count, 1))  # of each robot, as _limits returns them
        self._others: set[int] = set()  # whose robots differ from the batch's
        least, most, *_ = _limits(robot)
        self._bounds = least, most, f"from {least:.6g} to {most:.6g} (robot.max_cable_mm)"
        self._all = list(range(count))
        self._unrested = set(self._all)  # must be brought to rest before they move
        self._exclusive = ExclusiveUse()
        self._kernel_batch = self._make_kernel(layout.obstacles, threads)

    @abstractmethod
    def _make_kernel(self, obstacles: int, threads: int) -> Kernel:
        """Return the kernel's batch."""

    @abstractmethod
    def _kernel_robot(self, robot: Any) -> Kernel:
        """Return a robot as the kernel takes it."""

    @abstractmethod
    def _kernel_obstacles(self, robot: Any, scene: Scene) -> Kernel:
        """Return the obstacles of a scene around a robot as the kernel takes them."""

    def robot_of(self, index: int) -> RobotT_co:
        """Return what a robot of the batch is: the robot assigned to its index, or that of the batch.

        Raises:
            ValueError: If the index is out of range.
        """
        return self._robots[self._check_index(index)] or self.robot

    def get_rows(self, robots: Sequence[int]) -> Rows:
        """Return the states of some robots, as copies, which :meth:`set_rows` puts back, here or in another batch.

        Args:
            robots: Indices of the robots; one that is repeated has several rows.

        Raises:
            ValueError: If an index is out of range.
        """
        indices = list(map(self._check_index, _listed(robots)))
        at = as_slice(indices)
        with self._exclusive:
            rested = np.array([index not in self._unrested for index in indices], bool)
            own = tuple([self._robots[index] for index in indices])
            scenes = tuple([self._scenes[index] for index in indices])
            return Rows(self.robot, own, scenes, rested, *copies(NUMBERS_OF(self), at))

    def set_rows(self, robots: Sequence[int], rows: Rows) -> None:
        """Put robots into states of :meth:`get_rows`, from which they go on as those robots would, bit for bit.

        ``forks.set_rows(range(8), batch.get_rows([3] * 8))`` makes eight robots of one.

        Args:
            robots: Indices of the robots, one for each row.
            rows: Their new states.

        Raises:
            ValueError: If an index is out of range or repeated, or the rows are of another robot, of another number of
                robots or obstacles, or hold numbers that no state has; nothing has changed then.
            TypeError: If ``rows`` is not what :meth:`get_rows` returns.
        """
        indices = self._check_indices(robots)
        self._check_rows(rows, len(indices))
        entries = list(zip(indices, rows.robots, rows.scenes, rows.rested.tolist(), strict=True))
        changed = [entry[:3] for entry in entries if entry[1:3] != (self._robots[entry[0]], self._scenes[entry[0]])]
        compiled, made = self._prepare(changed) if changed else ({}, {})
        with self._exclusive:
            for index, robot, scene in changed:
                self._become(index, robot, None if robot is None else made.get(robot))
                if scene is None:
                    self._scenes[index] = None
                else:
                    self._put(index, scene, compiled[robot, scene])
            for index, _, scene, rested in entries:
                (self._unrested.discard if rested and scene is not None else self._unrested.add)(index)
            at = as_slice(indices)
            for own, given in zip(NUMBERS_OF(self), cast("Any", rows[-len(NUMBERS) :]), strict=True):
                own[at] = given

    def _prepare(self, changed: list[tuple[int, Any, Scene | None]]) -> tuple[dict[Any, Kernel], dict[Any, Kernel]]:
        """Return scenes, by robot and scene, and robots that indices are to have, as the kernel takes them."""
        others = {robot for index, robot, _ in changed if robot is not None and robot != self._robots[index]}
        for other in others:
            self._check_own(other)
        places = {(robot, scene) for _, robot, scene in changed if scene is not None}
        compiled = {(robot, scene): self._compile(robot or self.robot, scene) for robot, scene in places}
        return compiled, {other: self._kernel_robot(other) for other in others}

    def _become(self, index: int, robot: Any, made: Kernel) -> None:
        """Make a robot of the batch another one, given as the kernel takes it too; ``None`` for the batch's."""
        if robot != self._robots[index]:
            self._kernel_batch.set_robot(index, made)
            self._robots[index], self._limits[index] = robot, _limits(robot or self.robot)
            (self._others.discard if robot is None else self._others.add)(index)

    def _check_own(self, robot: AnyRobot) -> None:
        """Check that a robot can be one of this batch.

        Raises:
            ValueError: Naming what differs.
            TypeError: If it is not a robot of the batch's space.
        """
        check_scene(robot, self.robot_kind, Scene(), self.space)
        for name, own, wanted in zip(SIZES, _sizes(robot), _sizes(self.robot), strict=True):
            if own != wanted:
                raise ValueError(f"{name} of the robot is {own}; robots of this batch must have {wanted}, as its robot")

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...], Rows]:
        arguments = self.robot, self.count, self.layout.obstacles, self.threads
        return type(self), arguments, self.get_rows(self._all)

    def __setstate__(self, rows: Rows) -> None:
        self.set_rows(self._all, rows)

    def _check_rows(self, rows: Rows, count: int) -> None:
        """Check that rows are states of robots of this batch.

        Raises:
            ValueError: Naming what differs.
            TypeError: If they are no rows.
        """
        check_instance("rows", rows, Rows, "take those of get_rows")
        if rows.robot is not self.robot and rows.robot != self.robot:
            raise ValueError("the rows are of another robot; take those of a batch of an equal robot")
        if len(rows.robots) != count:
            raise ValueError(f"rows has {len(rows.robots)} robots; it must have one for each of the {count} robots")
        if len(rows.scenes) != count or np.shape(rows.rested) != (count,):
            raise ValueError(f"rows has {len(rows.scenes)} scenes; it must have one for each of the {count} robots")
        given = cast("Any", rows[-len(NUMBERS) :])
        for name, numbers, present in zip(NUMBERS, given, NUMBERS_OF(self), strict=True):
            if numbers.shape != (count, *present.shape[1:]) or numbers.dtype != present.dtype:
                raise ValueError(
                    f"{name} of rows has the shape {numbers.shape} of {numbers.dtype}; it must be "
                    f"{(count, *present.shape[1:])} of {present.dtype}: take the rows of get_rows"
                )

    def _motions(self, robots: list[int], scenes: Sequence[Scene] | None) -> list[Motion]:
        """Return the motions of obstacles to given scenes, of the robots whose obstacles move.

        Raises:
            ValueError: If there is not a scene for each robot, or obstacles cannot move to it.
        """
        if scenes is None:
            return []
        scenes = [scene for scene in check_sequence("scenes", scenes, "a list of scenes") if isinstance(scene, Scene)]
        if len(scenes) != len(robots):
            raise ValueError(f"scenes holds {len(scenes)} scenes; it must hold one for each of {len(robots)} robots")
        moving = [(robot, scene) for robot, scene in zip(robots, scenes, strict=True) if scene != self.scene(robot)]
        bounds = [self.scene(robot).check_motion(scene) for robot, scene in moving]
        return [
            Motion(robot, scene, self._compile(self.robot_of(robot), scene), moved)
            for (robot, scene), moved in zip(moving, bounds, strict=True)
        ]

    def _place(self, motion: Motion, part: float) -> None:
        """Put the obstacles of a robot where they have moved to."""
        reached = self.scene(motion.robot).moved_towards(motion.scene, part)
        robot = self.robot_of(motion.robot)
        compiled = motion.obstacles if part == 1 else self._kernel_obstacles(robot, reached)
        self._put(motion.robot, reached, compiled)

    def _put(self, index: int, scene: Scene, compiled: Kernel) -> None:
        """Put a robot among the obstacles of a scene, given as the kernel takes them too."""
        self._kernel_batch.set_obstacles(index, compiled)
        self._scenes[index], self._compiled[index] = scene, compiled

    def _compile(self, robot: Any, scene: Scene) -> Kernel:
        """Return the obstacles of a scene around a robot as the kernel takes them.

        Raises:
            ValueError: If the scene is none for the robot, or does not have the batch's number of obstacles.
        """
        check_scene(robot, self.robot_kind, scene, self.space)
        if len(scene) != self.layout.obstacles:
            raise ValueError(f"scene has {len(scene)} obstacles; each of the batch's has {self.layout.obstacles}")
        check_core(robot, scene)
        return self._kernel_obstacles(robot, scene)

    def scene(self, index: int) -> Scene:
        """Return the scene of a robot.

        Raises:
            ValueError: If none was assigned.
        """
        scene = self._scenes[self._check_index(index)]
        if scene is None:
            raise ValueError(f"robot {index} has no scene; call assign({index}, scene)")
        return scene

    def _cable_bounds(self, robots: list[int]) -> tuple[Any, Any, str]:
        """Return least and largest displacements of the cables of some robots, and the bound as text."""
        if not self._others or self._others.isdisjoint(robots):
            return self._bounds
        least, most = (ends if self.cables == 1 else ends[:, None] for ends in self._limits[robots, :2].T)
        return least, most, "from least_cable_mm to max_cable_mm of each robot (robot_of(index))"

    def _check_lengths(self, robots: list[int]) -> None:
        """Check the lengths in blocks, which users may have written to."""
        lengths, limits = self.blocks[:, self.layout.length.at], self._limits
        if robots is not self._all:
            lengths, limits = lengths[robots], limits[robots]
        low, high = limits[:, 2], limits[:, 3]
        if not ((low <= lengths) & (lengths <= high)).all():
            raise ValueError(
                f"lengths in blocks are {shown(lengths)}; all must be from {low.min():.6g} to {high.max():.6g}: "
                "call rest(robots)"
            )

    def _check_index(self, index: object) -> int:
        if type(index) is int and 0 <= index < self.count:
            return index
        return check_whole("robot index", index, 0, self.count - 1, f"the batch has {self.count} robots")

    def _check_indices(self, robots: Sequence[int]) -> list[int]:
        """Return indices of robots, each named once."""
        indices = list(map(self._check_index, _listed(robots)))
        if len(set(indices)) != len(indices):
            raise ValueError(f"robots is {shown(robots)}; it must name each robot once")
        return indices

    def _check_assigned(self, robots: Sequence[int]) -> list[int]:
        """Return indices of robots that have scenes, each named once."""
        indices = self._check_indices(robots)
        for robot in indices:
            self.scene(robot)
        return indices

    def _check_rested(self, robots: list[int]) -> None:
        """Check that robots were brought to rest in their scenes."""
        for robot in self._unrested.intersection(robots):
            self.scene(robot)
            raise ValueError(
                f"robot {robot} has a new scene, or its rest was interrupted or refused; call rest([{robot}]) "
                "before it moves"
            )


def _listed(robots: Sequence[int]) -> Sequence[object]:
    """Return indices of robots, which may be of another type, to be checked one by one.

    Raises:
        ValueError: If they are no sequence.
    """
    return robots if type(robots) is list else check_sequence("robots", robots, "a list of indices")


def _limits(robot: AnyRobot) -> tuple[float, ...]:
    """Return the least and largest cable displacement of a robot, and its shortest and longest length [mm]."""
    return robot.least_cable_mm, robot.cable_limit_mm, robot.shortest_mm, robot.longest_mm


def _sizes(robot: AnyRobot) -> tuple[object, ...]:
    """Return what the memory layout of a robot depends on, in the order of :data:`SIZES`."""
    return robot.model, robot.segments, len(robot.cables), len(robot.lines_mm), robot.positions
