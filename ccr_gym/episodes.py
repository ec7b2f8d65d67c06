"""Episodes of one task side by side: transition, observation, reward and info.

Single and vector environments are both shells around an :class:`EpisodeBatch`, so their results cannot differ.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.adapters import AnyAdapter
from ccr_gym.checks import require
from ccr_gym.observation import Observer
from ccr_gym.quantities import EnvIndex, Quantity, as_scalar, norm, operations
from ccr_gym.reward import SUCCESS_ERROR, TERMS, reward_terms
from ccr_gym.sampling import check_robot, sample_feasible
from ccr_gym.scales import AHEAD
from ccr_gym.sensing import SensorModel
from ccr_gym.settings import AnySettings
from ccr_gym.tasks import PROFILE_STEPS, AnyTask, Assignment
from solver import Equilibrium
from solver.common.batch import BaseBatch
from solver.spatial import SpatialEquilibrium

ALL = slice(None)


class ForceReading(NamedTuple):
    """Contact forces of one robot, or of many, and their set-points.

    Attributes:
        blocks: Equilibria, ``(..., size)``.
        force_true: Energy-based contact force on the robot that is regulated, ``(..., d)`` [N].
        force_est: Its virtual-work estimate, ``(..., d)`` [N].
        force: Magnitude of ``force_true`` [N].
        desired: Magnitude of the set-point [N].
        goal: The set-point, a magnitude or ``(..., d)`` [N].
        error: Relative force error.
    """

    blocks: np.ndarray
    force_true: np.ndarray
    force_est: np.ndarray
    force: Quantity
    desired: Quantity
    goal: Quantity
    error: Quantity


class PrivilegedState(NamedTuple):
    """The hidden state of one robot, or of many, for oracles and teachers; agents do not observe it.

    Attributes:
        force: Contact force on the robot that is regulated, ``(..., d)`` [N].
        rigidity_ratio: Rigidity over its nominal value.
        goal: Set-point after the next step, a magnitude or ``(..., d)`` [N].
        actuated_mm: Actuated coordinates of the robot, ``(..., actions)`` [mm].
        motor_mm: Positions of the motors, ``(..., actions)`` [mm].
        half_backlash_mm: How far both can be apart, ``(..., actions)`` [mm].
    """

    force: np.ndarray
    rigidity_ratio: Quantity
    goal: Quantity
    actuated_mm: np.ndarray
    motor_mm: np.ndarray
    half_backlash_mm: np.ndarray


class Pipeline(NamedTuple):
    """The chain from solver to observation, made for scenes of a fixed number of obstacles.

    Attributes:
        batch: The robots.
        adapter: Adapter of the robots.
        observer: Writer of observations.
        sensors: Model of the imperfections; ``None`` where sensing is ideal.
    """

    batch: BaseBatch
    adapter: AnyAdapter
    observer: Observer
    sensors: SensorModel | None


class EpisodeBatch:
    """Episodes of N robots, each with obstacles and a set-point of its own.

    Attributes:
        count: Number N of robots.
        batch: The robots.
        adapter: Adapter of the robots.
        observer: Writer of observations.

    Args:
        task: What an episode asks.
        settings: Settings of the environment.
        count: Number N of robots.
        threads: Threads of the solver.

    Raises:
        ValueError: If an obstacle of the task could slip through the robot.
    """

    def __init__(self, task: AnyTask, settings: AnySettings, count: int, threads: int = 1) -> None:
        check_robot(task, settings.robot)
        self._task, self._settings, self.count, self._threads = task, settings, count, threads
        self._target, self._vector = task.target, task.force_vector
        self._trial_batch = task.adapter.make_batch(settings, count, task.obstacles, threads)
        self._use(self._make_pipeline(task.obstacles))
        actions, space = self.adapter.actions.size, self.adapter.space
        self._desired_n = np.ones(count)  # magnitudes of the set-points, the largest ones where they move
        self._goal_n = np.ones((count, space))  # the set-points where they are vectors
        self._profiles = np.ones((count, PROFILE_STEPS)) if task.moving else None
        self._last_actions = np.zeros(count) if actions == 1 else np.zeros((count, actions))
        self._obstacle_features = np.zeros((count, self.adapter.obstacle_size))
        self._time = np.zeros(count, int)  # steps of the episode

    def _make_pipeline(self, obstacles: int) -> Pipeline:
        settings, count, space = self._settings, self.count, self._task.adapter.space
        batch = self._task.adapter.make_batch(settings, count, obstacles, self._threads)
        adapter = self._task.adapter(settings, batch.layout)
        observer = Observer(adapter, self._task)
        ranges = settings.sensors
        sensors = SensorModel(ranges, count, space, adapter.actions, observer.delayed) if ranges else None
        return Pipeline(batch, adapter, observer, sensors)

    def _pipeline_for(self, obstacles: int) -> Pipeline:
        """Return the present pipeline, or a new one for another number of obstacles."""
        present = self._pipeline.batch.layout.obstacles
        if obstacles == present:
            return self._pipeline
        require(self.count == 1, f"all scenes of several robots must have {present} obstacles")
        return self._make_pipeline(obstacles)

    def _use(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self.batch, self.adapter, self.observer, self._sensors = pipeline
        self._layout = self.batch.layout

    @property
    def actions(self) -> ActionSpec:
        """The actuated coordinates."""
        return self.adapter.actions

    def start_sampled(self, robots: Sequence[int], generators: Sequence[np.random.Generator]) -> None:
        """Start new episodes of some robots, each sampled by its own generator.

        Raises:
            RuntimeError: As :func:`ccr_gym.sampling.sample_feasible`; episodes and generators remain as they were.
        """
        task, settings = self._task, self._settings
        with _restored_on_error(generators):
            forces, assignments = sample_feasible(
                task, self._trial_batch, robots, generators, settings.cable_limit_mm, settings.split
            )
        self._use(self._pipeline_for(task.obstacles))
        for robot, assignment in zip(robots, assignments, strict=True):
            self.batch.assign(robot, assignment.scene)
        self._start(robots, forces, assignments, generators)

    def start_given(self, robot: int, assignment: Assignment, generator: np.random.Generator) -> None:
        """Start a given episode of a robot; its generator samples the imperfections.

        Raises:
            ValueError: As the solver; the present episode continues.
        """
        self.adapter.check_scene(self._settings, assignment.scene)
        obstacles, least = len(assignment.scene), 1 if self._target is None else self._target + 1
        require(obstacles >= least, f"the scene has {obstacles} obstacles; it must have at least {least}")
        pipeline = self._pipeline_for(obstacles)
        pipeline.batch.assign(robot, assignment.scene)
        self._use(pipeline)
        self._start([robot], np.atleast_2d(assignment.desired_force), [assignment], [generator])

    def _start(
        self,
        robots: Sequence[int],
        forces: np.ndarray,
        assignments: Sequence[Assignment],
        generators: Sequence[np.random.Generator],
    ) -> None:
        """Start episodes of robots that are among their obstacles, with set-points ``(k, 1)`` or ``(k, d)`` [N]."""
        self._desired_n[robots] = forces[:, 0]
        if self._vector:
            self._goal_n[robots] = forces
            self._desired_n[robots] = norm(forces)
        self.batch.rest(robots)
        self._last_actions[robots], self._time[robots] = 0.0, 0
        for robot, assignment, generator in zip(robots, assignments, generators, strict=True):
            if self._profiles is not None:
                self._profiles[robot] = 1.0 if assignment.profile is None else assignment.profile
            if self._sensors is not None:
                actuated_mm = self.batch.blocks[robot, self.adapter.actuated_columns]
                self._sensors.begin_episode(robot, generator, actuated_mm)
            if self.adapter.obstacle_size:
                self._obstacle_features[robot] = self.adapter.obstacle_features(assignment.scene)

    def step(self, actions: Quantity, index: EnvIndex = ALL) -> None:
        """Move the actuated coordinates of some robots by increments.

        Args:
            actions: Their actions, as :meth:`ccr_gym.adapters.RobotAdapter.clip` returns them.
            index: The robots.
        """
        adapter, batch = self.adapter, self.batch
        if self._sensors is None:
            command = adapter.command(batch.blocks, actions, index)
        else:
            actuated_mm = batch.blocks[index, adapter.actuated_columns]
            command = self._sensors.apply_backlash(actuated_mm, actions * adapter.actions.increment_mm, index)
        batch.commands[index, adapter.command_columns] = command
        self._last_actions[index] = actions
        self._time[index] += 1
        batch.move(index)

    def read(self, index: int | slice = ALL) -> ForceReading:
        """Return the present contact forces."""
        blocks = self.batch.blocks[index]
        force_true = self._forces(blocks).copy()
        force_est = self.adapter.estimate(blocks, force_true, index)
        if self._sensors is not None:
            rigidity_ratio = np.asarray(self._sensors.rigidity_ratio[index])[..., None]
            force_true *= rigidity_ratio
            force_est *= rigidity_ratio * np.asarray(self._sensors.measured_load_fraction[index])[..., None]
        force = as_scalar(norm(force_true), index)
        desired = self._desired(0, index)
        if self._vector:
            goal = self._goal_n[index].copy()
            error = as_scalar(norm(goal - force_true), index) / desired
        else:
            goal, error = desired, abs(force - desired) / desired
        return ForceReading(blocks, force_true, force_est, force, desired, goal, error)

    def _forces(self, blocks: np.ndarray) -> np.ndarray:
        """Return the regulated contact force of robots of nominal rigidity, ``(..., d)`` [N]."""
        if self._target is None:
            return self._layout.force(blocks)
        return self._layout.forces(blocks)[..., self._target, :]

    def _desired(self, ahead: int, index: int | slice) -> Quantity:
        """Return the magnitude of the set-point some steps ahead [N]."""
        if self._profiles is None:
            return as_scalar(self._desired_n[index], index)
        robots, time = np.arange(self.count)[index], np.minimum(self._time[index] + ahead, PROFILE_STEPS - 1)
        return as_scalar(self._desired_n[index] * self._profiles[robots, time], index)

    def observe(self, reading: ForceReading, index: int | slice = ALL) -> np.ndarray:
        """Return flat observations, ``(k,)`` or ``(N, k)`` float32."""
        inputs = {"desired_force": reading.goal, "force_est": reading.force_est}
        if self._profiles is not None:
            inputs["desired_ahead"] = np.stack([self._desired(steps, index) for steps in AHEAD], axis=-1)
        measured, force = reading.force_true, reading.force
        if self._sensors is not None:
            measured = inputs["force_measured"] = measured + self._sensors.force_error(self._time, index)
            force = as_scalar(norm(measured), index)
        inputs["force_error"] = reading.goal - (measured if self._vector else force)
        rows = self.observer.rows(reading.blocks, inputs, self._obstacle_features[index])
        if self._sensors is not None:
            rows = self._sensors.apply_latency(rows, self._time, index)
            self.observer.write_encoders(rows, self._sensors.motor_mm(index))
        return self.observer.clip(rows)

    def rewards(self, reading: ForceReading, index: int | slice = ALL) -> tuple[Quantity, ...]:
        """Return the reward terms of the last step."""
        clearance = as_scalar(reading.blocks[..., self.adapter.clearance_column], index)
        actions = self._last_actions[index]
        effort = self.adapter.mean_square(as_scalar(actions, index) if self._last_actions.ndim == 1 else actions)
        weights, force, desired = self._settings.weights, reading.force, reading.desired
        return reward_terms(weights, force, desired, reading.error, clearance, effort, operations(index))

    def infos(
        self, reading: ForceReading, terms: tuple[Quantity, ...], index: int | slice = ALL
    ) -> dict[str, Quantity]:
        """Return the info: Python numbers for one robot, arrays for many."""
        return {
            "force_true": reading.force_true,
            "force_est": reading.force_est,
            "desired_force": reading.goal,
            **self.adapter.info(reading.blocks, index),
            "solver_status": as_scalar(self.batch.statuses[index], index),
            "cost": operations(index).maximum(0.0, reading.force - self._settings.force_limit),
            "is_success": reading.error <= SUCCESS_ERROR,
            "reward_terms": dict(zip(TERMS, terms, strict=True)),
        }

    def privileged_state(self, index: int | slice = ALL) -> PrivilegedState:
        """Return the hidden state."""
        sensors, force = self._sensors, self.read(index).force_true
        goal = self._goal_n[index].copy() if self._vector else self._desired(1, index)
        actuated = self.batch.blocks[index, self.adapter.actuated_columns]
        actuated = np.reshape(actuated, (*force.shape[:-1], self.actions.size)).copy()
        if sensors is None:
            nominal = as_scalar(np.ones(self.count)[index], index)
            return PrivilegedState(force, nominal, goal, actuated, actuated, np.zeros(actuated.shape))
        rigidity_ratio = as_scalar(sensors.rigidity_ratio[index], index)
        motor, half_backlash = sensors.motor_mm(index), sensors.half_backlash_mm(index)
        return PrivilegedState(force, rigidity_ratio, goal, actuated, motor, half_backlash)

    def probe(self, actuated_mm: np.ndarray) -> np.ndarray:
        """Return the contact forces that all robots would have at other actuated coordinates; nothing moves.

        Args:
            actuated_mm: Actuated coordinates, ``(N, actions)`` [mm]; clipped to their bounds.

        Returns:
            Regulated contact forces, ``(N, d)`` [N].
        """
        commands, columns = self.batch.commands.copy(), self.adapter.command_columns
        clipped = np.clip(actuated_mm, self.actions.low_mm, self.actions.high_mm)
        commands[:, columns] = clipped.reshape(commands[:, columns].shape)
        forces = self._forces(self.batch.probe(commands))
        return forces * (1.0 if self._sensors is None else self._sensors.rigidity_ratio[:, None])

    def equilibrium(self, robot: int) -> Equilibrium | SpatialEquilibrium:
        """Return a robot's present equilibrium; it is immutable."""
        equilibrium = self.batch.equilibrium(robot)
        assert isinstance(equilibrium, Equilibrium | SpatialEquilibrium)
        return equilibrium


@contextmanager
def _restored_on_error(generators: Sequence[np.random.Generator]) -> Iterator[None]:
    """Restore the states of generators after any exception."""
    states = [generator.bit_generator.state for generator in generators]
    try:
        yield
    except BaseException:
        for generator, state in zip(generators, states, strict=True):
            generator.bit_generator.state = state
        raise
