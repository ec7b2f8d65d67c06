"""Many robots alike, each in a scene of its own, moved by one call of the kernel."""

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from threading import Lock
from typing import Any, ClassVar

import numpy as np

from solver.common.checks import check_clear, check_core, check_scene
from solver.common.equilibrium import BaseEquilibrium
from solver.common.geometry import touching_gaps
from solver.common.layout import Layout, Model
from solver.common.scene import MAX_OBSTACLES, Scene
from solver.common.status import Status
from solver.common.validation import LARGEST, array, instance, positive, sequence, shown, whole

MAX_PULL_STEPS = 100_000  # of a trial pull


class _Turn:
    """Held by the thread that uses a batch; another that tries meanwhile is refused before it has changed anything."""

    def __init__(self) -> None:
        self._lock = Lock()

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise RuntimeError("the batch is in use by another thread; give each thread a batch of its own")

    def __exit__(self, *error: object) -> None:
        self._lock.release()


class BaseBatch(ABC):
    """Moves many robots at once; each is moved as its solver would, bit for bit.

    Unlike the solver it keeps the present equilibria, as rows of arrays that are written in place.

    One thread uses a batch at a time: a call while another thread is in one raises RuntimeError and changes nothing.
    Ctrl-C, like any signal whose handler raises, ends a call within a fraction of a second, between two robots. Those
    that have moved by then keep their new blocks, statuses and counts, the others are where they were, and
    :attr:`commands` holds the new commands of all. After a :meth:`rest` cut short, none of its robots moves until it is
    called again.

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
        ValueError: If a number is out of range, or so many robots do not fit into memory.
        TypeError: If the robot is something else.
    """

    model: ClassVar[Model]
    robot_kind: ClassVar[type]

    def __init__(self, robot: Any, count: int, obstacles: int, threads: int = 1) -> None:
        check_scene(robot, self.robot_kind, Scene(), self.model)
        self.robot, self.count = robot, whole("count", count, 1, 2**31 - 1)
        obstacles = whole("obstacles", obstacles, 0, MAX_OBSTACLES)
        threads = whole("threads", threads, 1, max(64, 4 * (os.cpu_count() or 1)), "; more do not help")
        self.layout = self._make_layout(obstacles)
        _check_memory(self.count, self.layout.size)
        self.blocks = np.zeros((self.count, self.layout.size))
        self.statuses = np.zeros(self.count, np.int64)
        self.iterations = np.zeros(self.count, np.int64)
        self.factorizations = np.zeros(self.count, np.int64)
        self._scenes: list[Scene | None] = [None] * self.count
        self.commands = np.zeros((self.count, self.model.cables + 1))
        self._kernel_batch = self._make_kernel(obstacles, threads)
        self._all = list(range(self.count))
        self._turn = _Turn()
        self._clear: Scene | None = None  # the scene last found to leave the straight robot clear
        self._straight: np.ndarray | None = None  # points of the straight robot, when they are first asked for
        self._unrested = set(self._all)  # must be put at rest before they move
        most = robot.cable_limit_mm
        least = 0.0 if self.model.cables == 1 else -most
        self._low = np.array(self.model.cables * [least] + [robot.shortest_mm])
        self._high = np.array(self.model.cables * [most] + [robot.longest_mm])
        self._bound = f"from {least:.6g} to {most:.6g} (robot.max_cable_mm)"

    @abstractmethod
    def _make_layout(self, obstacles: int) -> Layout:
        """The layout of a block."""

    @abstractmethod
    def _make_kernel(self, obstacles: int, threads: int) -> Any:
        """The robots in the kernel."""

    @abstractmethod
    def _kernel_obstacles(self, scene: Scene) -> Any:
        """Obstacles as the kernel takes them."""

    @abstractmethod
    def _make_equilibrium(self, scene: Scene, block: np.ndarray, status: Status, *work: int) -> BaseEquilibrium:
        """The result of a solve."""

    @abstractmethod
    def _straight_points(self) -> np.ndarray:
        """The points of the straight robot that can touch, ``(p, k, d)`` [mm]."""

    def assign(self, index: int, scene: Scene) -> None:
        """Put a robot among other obstacles; it must be put at rest, by :meth:`rest`, before it moves.

        The obstacles that it is among already change nothing.

        Raises:
            ValueError: As :class:`solver.Solver`, or if the scene has not as many obstacles as the batch was made for;
                nothing has changed then.
            TypeError: If ``scene`` is something else.
        """
        index = self._index(index)
        instance("scene", scene, Scene, "put the obstacles in one, Scene([…])")
        if scene == self._scenes[index]:
            return
        check_scene(self.robot, self.robot_kind, scene, self.model)
        if len(scene) != self.layout.obstacles:
            raise ValueError(
                f"scene has {len(scene)} obstacles; a scene of this batch must have as many obstacles as it was made "
                f"for, {self.layout.obstacles}"
            )
        check_core(self.robot, scene)
        if scene is not self._clear:
            check_clear(self.robot, scene, self._straight_gaps(scene))
        compiled = self._kernel_obstacles(scene)
        with self._turn:
            self._kernel_batch.set_obstacles(index, compiled)
            self._scenes[index] = scene
            self._unrested.add(index)

    def leaves_clear(self, scene: Scene) -> bool:
        """Whether no obstacle of a scene overlaps the straight robot.

        Raises:
            ValueError: If an obstacle is one of another space, or names a node that the robot does not have.
            TypeError: If ``scene`` is something else.
        """
        instance("scene", scene, Scene, "put the obstacles in one, Scene([…])")
        clear = bool((self._straight_gaps(scene) >= 0).all())
        self._clear = scene if clear else None
        return clear

    def rest(self, robots: Sequence[int]) -> None:
        """Make some robots straight and unactuated again.

        Raises:
            ValueError: If one is not there, named twice or not assigned to a scene; nothing has changed then.
        """
        which = self._indices(robots)
        for robot in which:
            self.scene(robot)
        with self._turn:
            self._unrested.update(which)
            self.blocks[which] = 0.0
            self.blocks[which, self.layout.length.at] = self.robot.length_mm
            self.commands[which] = 0.0
            self.commands[which, -1] = self.robot.length_mm
            self._move(which)
            self._unrested.difference_update(which)

    def step(self, cable_mm: np.ndarray, robots: Sequence[int] | None = None) -> None:
        """Move the cables of all robots, or of some, as far as tension and obstacles allow.

        Args:
            cable_mm: Commanded cable displacement of each of them, ``(k,)``, in space ``(k, 2)`` [mm].
            robots: Which; ``None`` for all.

        Raises:
            ValueError: If a command or a length in :attr:`blocks` is out of range, or a robot is not there, named twice
                or not at rest since it was put among other obstacles; nothing has moved then.
        """
        which = self._all if robots is None else self._indices(robots)
        cables = self.model.cables
        shape = (len(which),) if cables == 1 else (len(which), cables)
        commands = array("cable_mm", cable_mm, shape, self._low[0], self._high[0], self._bound)
        with self._turn:
            self._check_rested(which)
            self._check_lengths(which)
            self.commands[which, :-1] = commands.reshape(-1, cables)
            self._move(which)

    def move(self, which: int | slice | list[int]) -> None:
        """Move one robot, some or all to their commands, which must be in range.

        Raises:
            ValueError: If a robot is not there, named twice or not at rest since it was put among other obstacles;
                nothing has moved then.
        """
        if isinstance(which, slice):
            robots = self._all[which]
        elif isinstance(which, list):
            robots = self._indices(which)
        else:
            robots = [self._index(which)]
        with self._turn:
            self._check_rested(robots)
            self._move(robots)

    def probe(self, commands: np.ndarray) -> np.ndarray:
        """The equilibria that all robots would move to, ``(N, size)``; they stay where they are.

        Args:
            commands: As :attr:`commands`.

        Raises:
            ValueError: If a command or a length in :attr:`blocks` is out of range, or a robot is not at rest since it
                was put among other obstacles.
        """
        bound = f"{self._bound}, and lengths from {self._low[-1]:.6g} to {self._high[-1]:.6g}"
        commands = array("commands", commands, self.commands.shape, self._low, self._high, bound)
        with self._turn:
            self._check_rested(self._all)
            self._check_lengths(self._all)
            blocks, scratch = self.blocks.copy(), [np.zeros(self.count, np.int64) for _ in range(3)]
            self._kernel_batch.step(self._all, commands, blocks, *scratch)
        return blocks

    def optimality(self) -> np.ndarray:
        """How well the present equilibria meet their conditions, rows as :class:`solver.Optimality`, ``(N, 3)``.

        Raises:
            ValueError: If a robot is not at rest since it was put among other obstacles.
        """
        found = np.zeros((self.count, 3))
        with self._turn:
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
        """Whether pulling some robots steadily from rest gets each to a contact force, and the force it gets to.

        No step may end in anything but ``CONVERGED``.

        Args:
            robots: Which, assigned to their scenes; their states are left alone.
            forces: Force for each, ``(k,)`` [N].
            increment_mm: Cable displacement of a step, at least a hundred thousandth of the bound [mm].
            limit_mm: Bound on the cable displacement, at most ``robot.max_cable_mm`` [mm].
            directions: Displacements of the cables per millimetre of pull, at most 1 in size, in the plane not
                negative, ``(k, cables)``; ``None`` for ones.
            obstacle: The obstacle whose contact force is meant; ``None`` for all together.

        Returns:
            ``(k,)`` bool, and the contact force on each robot at the end of its pull, ``(k, d)`` [N].

        Raises:
            ValueError: If a number is out of range, or a robot is not there, named twice or not assigned to a scene.
        """
        which = self._indices(robots)
        for robot in which:
            self.scene(robot)
        count, most = len(which), self.robot.cable_limit_mm
        forces = array("forces", forces, (count,), 0.0, LARGEST, "finite and not negative")
        limit = positive("limit_mm", limit_mm, high=most)
        increment = positive("increment_mm", increment_mm, limit / MAX_PULL_STEPS, LARGEST)
        given = np.ones((count, self.model.cables)) if directions is None else directions
        least = 0.0 if self.model.cables == 1 else -1.0
        given = array("directions", given, (count, self.model.cables), least, 1.0, f"from {least:g} to 1")
        target = -1 if obstacle is None else whole("obstacle", obstacle, 0, self.layout.obstacles - 1)
        reached = np.zeros((count, self.model.space))
        length = self.robot.length_mm
        with self._turn:
            found = self._kernel_batch.ramps_reach_forces(
                which, forces, target, given, increment, limit, length, reached
            )
        return np.array(found, bool), reached

    def scene(self, index: int) -> Scene:
        """The obstacles a robot is among.

        Raises:
            ValueError: If it has not been assigned to a scene.
        """
        scene = self._scenes[self._index(index)]
        if scene is None:
            raise ValueError(f"robot {index} has not been assigned to a scene; call assign({index}, scene)")
        return scene

    def equilibrium(self, index: int) -> Any:
        """A robot's present equilibrium, on its own.

        Raises:
            ValueError: If it is not at rest since it was put among other obstacles, or its block is none.
        """
        with self._turn:
            return self._equilibrium(index)

    def _equilibrium(self, index: int) -> Any:
        scene = self.scene(index)
        self._check_rested([index])
        work = int(self.iterations[index]), int(self.factorizations[index])
        return self._make_equilibrium(scene, self.blocks[index].copy(), Status(self.statuses[index]), *work)

    def _index(self, index: int) -> int:
        if type(index) is int and 0 <= index < self.count:
            return index
        return whole("the index of a robot", index, 0, self.count - 1, f"; the batch has {self.count} robots")

    def _indices(self, robots: Sequence[int]) -> list[int]:
        """Indices of robots, each once."""
        which = list(map(self._index, sequence("robots", robots, "a list of indices")))
        if len(set(which)) != len(which):
            raise ValueError(f"robots is {shown(robots)}; it must name each robot once")
        return which

    def _check_rested(self, robots: list[int]) -> None:
        """Refuse robots that another scene waits for."""
        if not self._unrested:
            return
        for robot in self._unrested.intersection(robots):
            self.scene(robot)
            raise ValueError(
                f"robot {robot} was put among other obstacles, or its rest was cut short; call rest([{robot}]) before "
                "it moves"
            )

    def _check_lengths(self, robots: list[int]) -> None:
        """Refuse blocks that someone has written another length into, or what is none."""
        lengths = self.blocks[:, self.layout.length.at]
        lengths = lengths if robots is self._all else lengths[robots]
        low, high = self._low[-1], self._high[-1]
        if lengths.size and not (low <= lengths.min() and lengths.max() <= high):
            raise ValueError(
                f"lengths in blocks are {shown(lengths)}; all must be from {low:.6g} to {high:.6g}: call rest(robots)"
            )

    def _straight_gaps(self, scene: Scene) -> np.ndarray:
        if self._straight is None:
            self._straight = np.ascontiguousarray(self._straight_points())
        return touching_gaps(self.robot, scene, self._straight)

    def _move(self, robots: list[int]) -> None:
        self._kernel_batch.step(robots, self.commands, self.blocks, self.statuses, self.iterations, self.factorizations)


def _check_memory(count: int, size: int) -> None:
    """Refuse more robots than their blocks fit into memory.

    Raises:
        ValueError: Naming both.
    """
    needed, there = 8 * count * size, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > there:
        raise ValueError(
            f"count is {count}; their blocks need {needed / 1e9:.3g} GB and this machine has {there / 1e9:.3g} GB: "
            f"make batches of at most {there // (8 * size)}"
        )
