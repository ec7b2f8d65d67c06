"""Estimates of the contact force from what a robot can measure, as factors on the forces of the nominal model.

Which points touch, the direction of the forces and how several share them are the model's knowledge; one factor on all
of them is unknown. Both estimates are virtual work. ``contact`` takes the motion of the points that touch, and the
tension that the free robot needs, at the displacement that the encoder reads; its rigidity is learnt before contact.
``paper``, eq. 10 and 11, takes the motion of the free tip, and the tension gained since the onset of contact.

Motions are differences between free robots, which a batch of the solver moves along, so that any cables, sections and
loads are served alike. The kernel computes the factors (``solver/native/transition/estimator.hpp``).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ccr_gym.adapters import AnyAdapter
from ccr_gym.state import Arrays, put, take
from solver import RigidityFit, Robot, Scene, fitted_slopes
from solver.common.batch import BaseBatch
from solver.common.rows import Rows, as_slice
from solver.common.transition import ESTIMATORS, EstimatorSettings, TipSlopes

DIFFERENCE = 1e-4  # of a command, for slopes [a]
LEAST_SLOPE = 0.02  # of a contact's motion against its force; below, a pull hardly presses on it [L/a]
TENSION_NOISE = 0.015  # standard deviation of the tensions that the rigidity is learnt from [EI/(aL)]
FITTED = 1.0  # largest displacement of the straight lines of Fig. 7 [a]


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


class FreeRobots:
    """N robots that nothing touches, each with companions that are pulled a little less.

    A robot of one section has a companion for each command. One of several sections has a single one, pulled less by
    all commands in proportion: bent alike, its sections are where cables of some just become slack, and only along the
    way that they were pulled do all slopes belong to one branch. Its slopes are projections onto that way.

    While nothing touches a robot, it is the free robot itself; they move on from there once something does.

    Attributes:
        batch: The free robots, each followed by its companions.
        lines_mm: Where the lines of points that can touch cross the disks of each robot, ``(N, lines, d − 1)`` [mm].

    Args:
        adapter: Adapter of the robots.
        count: Number N of robots.
        threads: Threads of the solver.
    """

    def __init__(self, adapter: AnyAdapter, count: int, threads: int) -> None:
        companions = 1 if adapter.actuation.sections > 1 else adapter.actions.commands
        self._rows = np.arange(count * (1 + companions)).reshape(count, 1 + companions)
        self.batch = adapter.make_batch(adapter.settings, self._rows.size, 0, threads)
        self._adapter = adapter
        self.lines_mm = np.tile(adapter.lines_mm(adapter.settings.robot), (count, 1, 1))
        for row in range(self._rows.size):
            self.batch.assign(row, Scene())
        self.batch.rest(range(self._rows.size))

    def rest(self, robots: Sequence[int], drawn: Sequence[Any], touching: np.ndarray) -> None:
        """Let some robots be those that are drawn, ``None`` for the nominal robot, and bring them to rest.

        A nominal one that nothing is ``touching``, ``(k,)`` bool, is to go to where its model is anyway.
        """
        for robot, own in zip(robots, drawn, strict=True):
            if own is not None:
                self.lines_mm[robot] = self._adapter.lines_mm(own)
                for row in self._rows[robot].tolist():
                    self.batch.assign(row, Scene(), own)
        resting = [robot for robot, own, met in zip(robots, drawn, touching, strict=True) if met or own is not None]
        if resting:
            self.batch.rest(self._rows_of(resting))

    def get_rows(self, robots: list[int]) -> Rows:
        """Return the states of some robots and their companions."""
        return self.batch.get_rows(self._rows_of(robots))

    def set_rows(self, robots: list[int], rows: Rows) -> None:
        """Put robots and their companions into states of :meth:`get_rows`."""
        self.batch.set_rows(self._rows_of(robots), rows)
        for robot, own in zip(robots, rows.robots[:: self._rows.shape[1]], strict=True):
            if own is not None:
                self.lines_mm[robot] = self._adapter.lines_mm(own)

    def move(self, robots: Sequence[int]) -> None:
        """Move some robots and their companions to their commands."""
        self.batch.move(self._rows_of(robots))

    def _rows_of(self, robots: Sequence[int]) -> list[int]:
        rows: list[int] = self._rows[np.asarray(robots, int)].ravel().tolist()
        return rows


class ForceEstimator:
    """Estimates the contact forces of N robots.

    Attributes:
        arrays: By name, ``chosen``, factors of the observed estimate on the nominal forces, and ``paper``, those of
            the ``paper`` estimate, ``(N,)``; ``free_forces``, tensions that the nominal robot needs where nothing
            touches it, as forces on the commands, ``(N, commands)`` [N]; ``levers``, by how far the points that touch
            move against a unit force when a command is pulled by a unit, with several sections the projection of that
            onto the way of the pull, 0 where nothing touches, ``(N, commands)``; ``products`` and ``squares`` of the
            fit of the rigidity, ``(N,)``.
        kernel: The kernel's part of it.

    Args:
        adapter: Adapter of the robots.
        model: What is known of the robots.
        learns: Whether the rigidity is unknown, and learnt from robots that nothing touches.
    """

    def __init__(self, adapter: AnyAdapter, model: BaseBatch, *, learns: bool) -> None:
        count, commands = model.count, adapter.actions.commands
        tip = _tip_slopes(adapter)
        needed = adapter.settings.estimator == "contact" or tip is TipSlopes.DIFFERENCES or learns
        self._free = FreeRobots(adapter, count, model.threads) if needed else None
        self.arrays: Arrays = {
            **{name: np.zeros(count) for name in ("chosen", "paper", "products", "squares")},
            **{name: np.zeros((count, commands)) for name in ("free_forces", "levers")},
        }
        self._adapter = adapter
        self.kernel = self._make(model, tip, learns)

    def _make(self, model: BaseBatch, tip: TipSlopes, learns: bool) -> Any:
        adapter, free = self._adapter, self._free
        settings, scales = adapter.settings, adapter.scales
        lines = adapter.lines_mm(settings.robot)
        return ESTIMATORS[adapter.space](
            settings=EstimatorSettings(
                actuation=adapter.kernel_actuation,
                learns=learns,
                by_contact=settings.estimator == "contact",
                alike=adapter.actuation.sections > 1,
                pairs=adapter.space == 3 and settings.robot.model == "paper",
                tip=tip,
                fitted=_straight_lines(adapter) if tip is TipSlopes.FITTED else [],
                friction=settings.estimator_friction,
                travel_mm=scales.travel_mm,
                step_mm=DIFFERENCE * scales.travel_mm,
                least_slope=LEAST_SLOPE * scales.length_mm / scales.travel_mm,
                tension_noise=TENSION_NOISE * scales.tension_n,
                between=settings.robot.between,
            ),
            model=model.kernel_arrays,
            free=None if free is None else free.batch.kernel_arrays,
            arrays=self.arrays | {"lines_mm": np.tile(lines, (model.count, 1, 1)) if free is None else free.lines_mm},
        )

    @property
    def chosen(self) -> np.ndarray:
        """Factors of the estimate that is observed, on the nominal forces, ``(N,)``."""
        return self.arrays["chosen"]

    def rest(self, robots: list[int], drawn: Sequence[Any], blocks: np.ndarray) -> None:
        """Begin new episodes of some robots, which are those that are drawn; ``None`` for the nominal robot.

        Args:
            robots: The robots.
            drawn: What they are.
            blocks: Equilibria of their model at rest, ``(k, size)``.
        """
        at = as_slice(robots)
        for entry in self.arrays.values():
            entry[at] = 0.0
        self.arrays["products"][at] = self.arrays["squares"][at] = RigidityFit.prior().products
        if self._free is not None:
            touching = np.asarray(self._adapter.layout.flags(blocks).any(axis=-1))
            self._free.rest(robots, drawn, touching)
            indices = np.array(robots, np.int64)
            if touching.any():
                indices, blocks = indices[~touching], blocks[~touching]
            self.kernel.prepare(indices, blocks, np.zeros((len(indices), self._adapter.actions.size)))

    def get_rows(self, robots: list[int]) -> tuple[Arrays, Rows | None]:
        """Return what was learnt of some robots, and the robots that nothing touches."""
        return take(self.arrays, list(self.arrays), robots), None if self._free is None else self._free.get_rows(robots)

    def set_rows(self, robots: list[int], learnt: Arrays, free: Rows | None) -> None:
        """Put robots into a state of :meth:`get_rows`."""
        put(self.arrays, learnt, robots)
        if self._free is not None and free is not None:
            self._free.set_rows(robots, free)

    def move_free(self, robots: np.ndarray, blocks: np.ndarray) -> None:
        """Move the free robots of those of some robots whose model, in blocks ``(k, size)``, touches something."""
        touching = self._adapter.layout.flags(blocks).any(axis=-1)
        if self._free is not None and touching.any():
            self._free.move(robots[touching].tolist())

    def probe(self, measured: Measured) -> np.ndarray:
        """Return the factors of the estimate that is observed for all robots elsewhere, ``(N,)``; nothing moves."""
        factors, free = np.zeros_like(self.chosen), None
        if self._free is not None:
            commands = self._free.batch.commands.copy()
            self.kernel.write_free_commands(measured.actuated_mm, commands)
            free = self._free.batch.probe(commands)
        self.kernel.factors(np.arange(len(factors)), *measured, free, factors)
        return factors


def _tip_slopes(adapter: AnyAdapter) -> TipSlopes:
    """Return where the slopes of the free tip are from.

    The solver tells them, those of a planar rod only where it bends evenly. For the paper's planar robot they are the
    straight lines of Fig. 7.
    """
    robot, kinds = adapter.settings.robot, TipSlopes
    evenly = not isinstance(robot, Robot) or robot.bends_evenly
    if not evenly or adapter.layout.tip_slopes.shape == (0,):
        return kinds.DIFFERENCES
    fitted = isinstance(robot, Robot) and robot.model == "paper" and robot.length_range_mm is None
    return kinds.FITTED if fitted else kinds.BLOCK


def _straight_lines(adapter: AnyAdapter) -> list[float]:
    """Return the slopes of Fig. 7."""
    slopes = fitted_slopes(adapter.settings.robot, 0.0, FITTED * adapter.scales.travel_mm)
    return list(map(float, slopes))
