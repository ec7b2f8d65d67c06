"""The replay of a log: solver and estimator, row by row."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from agents.arguments import check_kind
from agents.estimation.robot import Knowledge, RobotEstimator
from agents.replay.commands import commands_mm
from agents.replay.correction import CORRECTION_ERROR, corrections
from agents.replay.limits import warnings_of
from agents.replay.log import Log
from agents.replay.model import AnyEquilibrium, Model, followed, positions
from agents.replay.observations import check_commands, observations, settings_of
from agents.replay.robots import AnyRobot, check_robot
from agents.replay.seen import seen_shapes
from agents.replay.sensing import Instruments
from ccr_gym import Scales
from solver import Scene

FORCE = ("force", "force_std")  # of agents.Knowledge


@dataclass(frozen=True, slots=True)
class Estimates:
    """What a log tells, in K rows; standard deviations are the estimator's own.

    Attributes:
        log: The log, averaged as asked for.
        commands_mm: Commands of the sections that the encoders read, ``(K, commands)`` [mm].
        known: What is known of the robot after each row, in natural units.
        scales: The natural units.
        force_n: Magnitude of the contact force, added over the obstacles, ``(K,)`` [N].
        force_std_n: Its standard deviation, ``(K,)`` [N].
        obstacle_forces_n: Force of each obstacle on the robot, in the direction and with the share that the model
            says, ``(K, m, d)`` [N].
        shapes: Shapes of the model where the cables are estimated to be.
        warnings: What is wrong with each estimate that ended at the end of its range, by its name.
    """

    log: Log
    commands_mm: np.ndarray
    known: tuple[Knowledge, ...]
    scales: Scales
    force_n: np.ndarray
    force_std_n: np.ndarray
    obstacle_forces_n: np.ndarray
    shapes: tuple[AnyEquilibrium, ...]
    warnings: Mapping[str, str] = field(default_factory=dict)

    def history(self, name: str) -> np.ndarray:
        """Return a number of :class:`agents.Knowledge` after each row, ``(K,)``."""
        return np.array([getattr(known, name) for known in self.known])

    @property
    def latency_rows(self) -> int:
        """Rows by which the positions come late, as found in the end; the estimate is a mean of whole numbers."""
        return round(float(self.known[-1].latency))

    @property
    def position_errors_mm(self) -> np.ndarray:
        """Root mean square distance of the measured positions from the shapes, ``(K,)``; NaN without any [mm].

        Positions are compared with the shape of some rows before, by the latency that was found in the end.
        """
        if not self.log.nodes.size:
            return np.full(len(self.shapes), np.nan)
        found = np.array([positions(shape, self.log.nodes) for shape in self.shapes])
        late = np.maximum(np.arange(len(found)) - self.latency_rows, 0)
        return np.asarray(np.sqrt(np.mean(np.sum((found[late] - self.log.positions_mm) ** 2, axis=-1), axis=-1)))


def estimate_log(log: Log, robot: AnyRobot, scene: Scene, instruments: Instruments, name: str = "log") -> Estimates:
    """Return what a log tells of shape, contacts and contact force.

    Each row is estimated from the rows up to it, as on the running robot.

    Args:
        log: The log.
        robot: The robot; its rigidity is the nominal one, to which the log adds a factor.
        scene: The obstacles.
        instruments: Imperfections of motors and sensors.
        name: Name of the log, for messages.

    Raises:
        TypeError: If an argument is of another class.
        ValueError: If the log is not one of this robot.
        UserError: If cables contradict each other.
    """
    check_robot(robot)
    check_kind("log", log, Log, "read_log(path, robot) reads one")
    log.check_fits(robot)
    check_kind("scene", scene, Scene, "it must be a Scene")
    check_kind("instruments", instruments, Instruments, "read_instruments(path, robot) reads one")
    robot, scales = followed(robot), Scales.of(robot)
    commands = commands_mm(log, robot, name)
    check_commands(commands, log, robot, name)
    nominal = list(Model(robot, scene).path(commands))
    seen = seen_shapes(log, Model(robot, scene), commands, nominal)
    settings = settings_of(robot, instruments, seen.deviation)
    estimator = RobotEstimator(settings, 1)
    rows = observations(log, settings, scene, commands, seen.shapes)
    known = tuple(estimator.update_one(observation) for observation in rows)
    ratio = corrections(log, robot, scene, commands, nominal)
    cables = scales.travel_mm * np.array([entry.cables for entry in known])
    shapes = tuple(Model(robot, scene).path(cables))
    read, spread = (scales.force_n * np.array([float(getattr(k, name)) for k in known]) for name in FORCE)
    force, deviation = ratio * read, np.hypot(ratio * spread, CORRECTION_ERROR * (ratio - 1) * read)
    shares = np.array([_shares(*pair) for pair in zip(shapes, nominal, strict=True)])
    warnings = warnings_of(known[-1], instruments, scales, bool(log.nodes.size))
    return Estimates(log, commands, known, scales, force, deviation, force[:, None, None] * shares, shapes, warnings)


def _shares(shape: AnyEquilibrium, nominal: AnyEquilibrium) -> np.ndarray:
    """Return the forces of the obstacles over the sum of their magnitudes, ``(m, d)``, zeros where nothing touches.

    They are those of the estimated shape; where that just does not touch, those of the model at the encoders.
    """
    for equilibrium in (shape, nominal):
        total = np.linalg.norm(equilibrium.forces, axis=1).sum()
        if total > 0:
            return np.asarray(equilibrium.forces / total)
    return np.zeros_like(nominal.forces)
