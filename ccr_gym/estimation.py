"""Estimates of the contact force from what a robot can measure, as factors on the forces of the nominal model.

Which points touch, the direction of the forces and how several share them are the model's knowledge; one factor on all
of them is unknown. Both estimates are virtual work. ``contact`` takes the motion of the points that touch, and the
tension that the free robot needs, at the displacement that the encoder reads; its rigidity is learnt before contact.
``paper``, eq. 10 and 11, takes the motion of the free tip, and the tension gained since the onset of contact.

Motions are differences between free robots, which a batch of the solver moves along, so that any cables, sections and
loads are served alike.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ccr_gym.adapters import AnyAdapter
from ccr_gym.quantities import EnvIndex
from ccr_gym.state import Arrays, put, take
from solver import RigidityFit, Robot, Scene, fitted_slopes, virtual_work
from solver.common.operations import ARRAYS, dot
from solver.common.rows import Rows
from solver.spatial import virtual_work as spatial_virtual_work
from solver.spatial import with_friction

DIFFERENCE = 1e-4  # of a command, for slopes [a]
LEAST_SLOPE = 0.02  # of a contact's motion against its force; below, a pull hardly presses on it [L/a]
TENSION_NOISE = 0.015  # standard deviation of the tensions that the rigidity is learnt from [EI/(aL)]
FITTED = 1.0  # largest displacement of the straight lines of Fig. 7 [a]
STATE = ("chosen", "paper", "free_forces", "levers", "_products", "_squares")  # arrays of a ForceEstimator
TINY = 1e-300  # keeps quotients defined where nothing touches


class Measured(NamedTuple):
    """What is known of k robots.

    Attributes:
        blocks: Equilibria of the nominal robot, ``(k, size)``.
        actuated_mm: Actuated coordinates that the encoders read, ``(k, actions)`` [mm].
        tensions: Tensions of the cables that the motors see, ``(k, cables)`` [N].
        onsets: Those at the onset of the present contact, signed as displacements of pairs, ``(k, cables)`` [N].
    """

    blocks: np.ndarray
    actuated_mm: np.ndarray
    tensions: np.ndarray
    onsets: np.ndarray


class FreeMotion(NamedTuple):
    """Free robots, and how they move with the commands.

    Attributes:
        tensions: Their tensions, signed as displacements of pairs, ``(k, cables)`` [N].
        points: Slopes of the points that can touch, ``(k, commands, lines, positions, d)`` [mm per mm].
        tips: Slopes of the tips, ``(k, commands, d)`` [mm per mm].
    """

    tensions: np.ndarray
    points: np.ndarray
    tips: np.ndarray


class Pressing(NamedTuple):
    """The nominal model's forces at the points that touch.

    Attributes:
        works: Their work per command, ``(k, commands)`` [N].
        sizes: Their magnitudes, added over the obstacles, ``(k,)`` [N].
    """

    works: np.ndarray
    sizes: np.ndarray


class FreeRobots:
    """N robots that nothing touches, each with companions that are pulled a little less.

    A robot of one section has a companion for each command. One of several sections has a single one, pulled less by
    all commands in proportion: bent alike, its sections are where cables of some just become slack, and only along the
    way that they were pulled do all slopes belong to one branch. Its slopes are projections onto that way.

    Args:
        adapter: Adapter of the robots.
        count: Number N of robots.
        threads: Threads of the solver.
    """

    def __init__(self, adapter: AnyAdapter, count: int, threads: int) -> None:
        self._alike = adapter.actuation.sections > 1
        companions = 1 if self._alike else adapter.actions.commands
        self._rows = np.arange(count * (1 + companions)).reshape(count, 1 + companions)
        self._batch = adapter.make_batch(adapter.settings, self._rows.size, 0, threads)
        self._adapter = type(adapter)(adapter.settings, self._batch.layout)
        self._step = DIFFERENCE * adapter.scales.travel_mm
        lines = adapter.lines_mm(adapter.settings.robot)
        self._lines_mm = np.tile(lines, (count, 1, 1, 1, 1))  # of each robot, alike for its companions
        for row in range(self._rows.size):
            self._batch.assign(row, Scene())
        self._batch.rest(range(self._rows.size))

    def rest(self, robots: Sequence[int], drawn: Sequence[Any]) -> None:
        """Bring some robots to rest, and let them be those that are drawn; ``None`` for the nominal robot."""
        for robot, own in zip(robots, drawn, strict=True):
            if own is not None:
                self._note_lines(robot, own)
                for row in self._rows[robot].tolist():
                    self._batch.assign(row, Scene(), own)
        self._batch.rest(self._rows[robots].ravel().tolist())

    def get_rows(self, robots: list[int]) -> Rows:
        """Return the states of some robots and their companions."""
        return self._batch.get_rows(self._rows[robots].ravel().tolist())

    def set_rows(self, robots: list[int], rows: Rows) -> None:
        """Put robots and their companions into states of :meth:`get_rows`."""
        self._batch.set_rows(self._rows[robots].ravel().tolist(), rows)
        for robot, own in zip(robots, rows.robots[:: self._rows.shape[1]], strict=True):
            if own is not None:
                self._note_lines(robot, own)

    def _note_lines(self, robot: int, own: Any) -> None:
        """Note the lines of a robot that differs from the nominal one."""
        self._lines_mm[robot] = self._adapter.lines_mm(own)

    def move(self, robots: np.ndarray, actuated_mm: np.ndarray) -> FreeMotion:
        """Move some robots to actuated coordinates ``(k, actions)`` [mm], and return their motion there."""
        rows = self._rows[robots].ravel().tolist()
        steps = self._steps(actuated_mm)
        self._command(self._batch.commands, rows, actuated_mm, steps)
        self._batch.move(rows)
        return self._motion(self._batch.blocks[rows], steps, self._lines_mm[robots])

    def probe(self, actuated_mm: np.ndarray) -> FreeMotion:
        """Return the motion of all robots at other actuated coordinates ``(N, actions)`` [mm]; nothing moves."""
        commands, steps = self._batch.commands.copy(), self._steps(actuated_mm)
        self._command(commands, self._rows.ravel().tolist(), actuated_mm, steps)
        return self._motion(self._batch.probe(commands), steps, self._lines_mm)

    def _steps(self, actuated_mm: np.ndarray) -> np.ndarray:
        """Return by how much the companions are pulled more by each command, ``(k, companions, commands)`` [mm]."""
        pulls = actuated_mm[:, : self._adapter.actions.commands]
        if self._alike:
            ways = np.where(pulls.any(axis=1, keepdims=True), pulls, -1.0)
            return np.asarray(-self._step * (ways / np.linalg.norm(ways, axis=1, keepdims=True))[:, None])
        return np.where(pulls > 0, -self._step, self._step)[:, None] * np.eye(pulls.shape[1])

    def _command(self, commands: np.ndarray, rows: list[int], actuated_mm: np.ndarray, steps: np.ndarray) -> None:
        """Write commands of robots and their companions."""
        places = np.repeat(actuated_mm[:, None], 1 + steps.shape[1], axis=1)
        places[:, 1:, : steps.shape[2]] += steps
        self._adapter.write_command(commands, places.reshape(len(rows), -1), rows)

    def _motion(self, rows: np.ndarray, steps: np.ndarray, lines_mm: np.ndarray) -> FreeMotion:
        """Return the motion from blocks of robots and their companions, ``(k (1 + companions), size)``."""
        blocks = rows.reshape(len(steps), -1, rows.shape[-1])
        layout, points = self._adapter.layout, self._adapter.points(blocks, lines_mm)
        tips = layout.nodes(blocks)[..., -1, : points.shape[-1]]
        slopes = (self._slopes(ends[:, 1:] - ends[:, :1], steps) for ends in (points, tips))
        return FreeMotion(self._adapter.signed(blocks[:, 0], layout.tensions(blocks[:, 0])), *slopes)

    def _slopes(self, moved: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Return slopes along each command from how far the companions have moved."""
        if self._alike:
            return np.asarray(_beside(steps[:, 0] / self._step**2, moved) * moved)
        return np.asarray(moved / _beside(np.diagonal(steps, axis1=1, axis2=2), moved))


class ForceEstimator:
    """Estimates the contact forces of N robots.

    Attributes:
        chosen: Factors of the estimate that is observed, on the nominal forces, ``(N,)``.
        paper: Factors of the ``paper`` estimate, ``(N,)``.
        free_forces: Tensions that the nominal robot needs where nothing touches it, as forces on the commands,
            ``(N, commands)`` [N].
        levers: By how far the points that touch move against a unit force when a command is pulled by a unit,
            ``(N, commands)``; with several sections the projection of that onto the way of the pull. 0 where nothing
            touches.
        learns: Whether the rigidity is unknown, and learnt from robots that nothing touches.

    Args:
        adapter: Adapter of the robots.
        count: Number N of robots.
        threads: Threads of the solver.
        learns: Whether the rigidity is unknown.
    """

    def __init__(self, adapter: AnyAdapter, count: int, threads: int, *, learns: bool) -> None:
        self._adapter, self.learns = adapter, learns
        self._contact = adapter.settings.estimator == "contact"
        self._tip_known = _tip_known(adapter)
        needed = self._contact or not self._tip_known or learns
        self._free = FreeRobots(adapter, count, threads) if needed else None
        self._slopes = _straight_lines(adapter)
        self._products, self._squares = np.ones(count), np.ones(count)
        self.chosen, self.paper = np.zeros(count), np.zeros(count)
        commands = adapter.actions.commands
        self.free_forces, self.levers = np.zeros((count, commands)), np.zeros((count, commands))

    def rest(self, robots: Sequence[int], drawn: Sequence[Any]) -> None:
        """Begin new episodes of some robots, which are those that are drawn; ``None`` for the nominal robot."""
        for entry in (self.chosen, self.paper, self.free_forces, self.levers):
            entry[robots] = 0.0
        prior = RigidityFit.prior()
        self._products[robots], self._squares[robots] = prior.products, prior.squares
        if self._free is not None:
            self._free.rest(robots, drawn)

    def get_rows(self, robots: list[int]) -> tuple[Arrays, Rows | None]:
        """Return what was learnt of some robots, and the robots that nothing touches."""
        return take(self, STATE, robots), None if self._free is None else self._free.get_rows(robots)

    def set_rows(self, robots: list[int], learnt: Arrays, free: Rows | None) -> None:
        """Put robots into a state of :meth:`get_rows`."""
        put(self, learnt, robots)
        if self._free is not None and free is not None:
            self._free.set_rows(robots, free)

    def clear(self, index: EnvIndex) -> None:
        """Set the estimates of robots that nothing touches to zero."""
        self.chosen[index] = self.paper[index] = 0.0

    def update(self, robots: Sequence[int], measured: Measured) -> None:
        """Estimate anew for some robots that have moved."""
        indices = np.array(robots, int)
        touching = np.asarray(self._adapter.layout.flags(measured.blocks).any(axis=-1))
        for entry in (self.chosen, self.paper, self.levers):
            entry[indices[~touching]] = 0.0
        wanted = touching | self.learns
        if not wanted.any():
            return
        indices, touching = indices[wanted], touching[wanted]
        measured = self._signed(Measured(*(entry[wanted] for entry in measured)))
        motion = None if self._free is None else self._free.move(indices, measured.actuated_mm)
        pressing = None if motion is None else self._pressing(measured, motion)
        if self.learns and motion is not None and pressing is not None:
            self._learn(indices, measured, motion, touching)
            self.free_forces[indices] = self._adapter.actuation.forces(motion.tensions)
            self.levers[indices] = pressing.works / np.maximum(pressing.sizes, TINY)[:, None]
        self.paper[indices] = self._paper_factors(measured, motion)
        self.chosen[indices] = self._chosen_factors(indices, measured, motion, pressing)

    def probe(self, measured: Measured) -> np.ndarray:
        """Return the factors of the estimate that is observed for all robots elsewhere, ``(N,)``; nothing moves."""
        measured = self._signed(measured)
        motion = None if self._free is None else self._free.probe(measured.actuated_mm)
        pressing = None if motion is None else self._pressing(measured, motion)
        return self._chosen_factors(np.arange(len(self.chosen)), measured, motion, pressing)

    def _signed(self, measured: Measured) -> Measured:
        return measured._replace(tensions=self._adapter.signed(measured.blocks, measured.tensions))

    def _chosen_factors(
        self, robots: np.ndarray, measured: Measured, motion: FreeMotion | None, pressing: Pressing | None
    ) -> np.ndarray:
        if not self._contact or motion is None or pressing is None:
            return self._paper_factors(measured, motion)
        return self._contact_factors(measured, motion, pressing, self._products[robots] / self._squares[robots])

    def _learn(self, robots: np.ndarray, measured: Measured, motion: FreeMotion, touching: np.ndarray) -> None:
        """Learn the rigidity over its nominal value from robots that nothing touches."""
        fit = RigidityFit(self._products[robots], self._squares[robots])
        noise = TENSION_NOISE * self._adapter.scales.tension_n
        fit = fit.updated(measured.tensions, motion.tensions, touching, noise)
        self._products[robots], self._squares[robots] = fit.products, fit.squares

    def _contact_factors(
        self, measured: Measured, motion: FreeMotion, pressing: Pressing, ratio: np.ndarray
    ) -> np.ndarray:
        """Return the factors for which forces do the work at the points that touch that the cables lack, ``(k,)``."""
        adapter, scales = self._adapter, self._adapter.scales
        works = pressing.works
        lacking = adapter.actuation.forces(measured.tensions - ratio[:, None] * motion.tensions)
        least = LEAST_SLOPE * scales.length_mm / scales.travel_mm * pressing.sizes
        squares = np.maximum(np.maximum(dot(works, works), least**2), TINY)
        return np.asarray(np.maximum(dot(works, lacking), 0.0) / squares)

    def _pressing(self, measured: Measured, motion: FreeMotion) -> Pressing:
        """Return how the model's forces work at the points that touch."""
        forces = self._adapter.layout.forces(measured.blocks)
        multipliers = self._adapter.layout.multipliers(measured.blocks)
        shares = multipliers / np.maximum(multipliers.sum(axis=(-2, -1), keepdims=True), TINY)
        pressed = np.sum(shares[..., None] * forces[:, :, None, None], axis=1)
        works = -np.sum(pressed[:, None] * motion.points, axis=(-3, -2, -1))
        return Pressing(works, np.linalg.norm(forces, axis=-1).sum(axis=-1))

    def _paper_factors(self, measured: Measured, motion: FreeMotion | None) -> np.ndarray:
        """Return the factors for which the forces at the free tip do the work of the loads since onset, ``(k,)``."""
        adapter, blocks, friction = self._adapter, measured.blocks, self._adapter.settings.estimator_friction
        total, loads = adapter.layout.force(blocks), measured.tensions - measured.onsets
        planar = adapter.space == 2
        if planar:
            total = total + friction * np.stack([-total[:, 1], total[:, 0]], axis=-1)  # n + μ t, t the normal turned
        if planar and self._tip_known:
            slopes = adapter.layout.tip_slopes(blocks).T if self._slopes is None else self._slopes
            x, y, offset = total[:, 0], total[:, 1], adapter.scales.travel_mm
            return np.asarray(virtual_work(x, y, loads[:, 0], slopes, offset, ARRAYS))
        if self._tip_known:
            slopes = adapter.layout.tip_slopes(blocks) * np.array([1.0, 1.0, 1.0, *2 * [adapter.scales.travel_mm]])
            return spatial_virtual_work(with_friction(total, slopes[..., :3], friction), loads, slopes)
        assert motion is not None
        works = -np.stack([dot(total, motion.tips[:, k]) for k in range(motion.tips.shape[1])], axis=-1)
        given = adapter.actuation.forces(loads)
        return np.asarray(np.maximum(dot(works, given), 0.0) / np.maximum(dot(works, works), TINY))


def _tip_known(adapter: AnyAdapter) -> bool:
    """Return whether the solver tells the slopes of the free tip: those of a planar rod only where it bends evenly."""
    robot = adapter.settings.robot
    evenly = not isinstance(robot, Robot) or robot.bends_evenly
    return evenly and adapter.layout.tip_slopes.shape != (0,)


def _straight_lines(adapter: AnyAdapter) -> np.ndarray | None:
    """Return the slopes of Fig. 7 for the paper's planar robot, None for others, whose slopes are exact."""
    robot = adapter.settings.robot
    if not isinstance(robot, Robot) or robot.model != "paper" or robot.length_range_mm is not None:
        return None
    return fitted_slopes(robot, 0.0, FITTED * adapter.scales.travel_mm)


def _beside(steps: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return steps ``(k, commands)`` with axes of length 1 added to divide differences of ``ends``."""
    return steps.reshape(*steps.shape, *(1,) * (ends.ndim - 2))
