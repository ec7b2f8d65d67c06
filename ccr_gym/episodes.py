"""Episodes of one task side by side: the transition, what is seen of it and what it is worth.

Every environment, single or vector, is a shell around a fleet, so that they cannot drift apart.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from ccr_gym.bodies import Which, plain
from ccr_gym.checks import require
from ccr_gym.observation import AHEAD, Observer
from ccr_gym.reward import TERMS, reward_terms
from ccr_gym.sensing import SensorModel
from ccr_gym.settings import Settings
from ccr_gym.tasks import COURSE_STEPS, Assignment, Task, assign, check_robot
from solver import Solver
from solver.common.batch import BaseBatch
from solver.common.layout import SPACE, Layout
from solver.spatial import SpatialSolver

ALL = slice(None)


class ForceReading(NamedTuple):
    """What one robot feels, or what all of them do.

    Attributes:
        blocks: Their equilibria, ``(..., size)``.
        force_true: Contact force that counts, on the robot, ``(..., d)`` [N].
        force_est: The same by virtual work, ``(..., d)`` [N].
        force: Magnitude of the true one [N].
        desired: Magnitude of the set-point [N].
        goal: The set-point, its magnitude or ``(..., d)`` [N].
        error: Relative force error.
    """

    blocks: np.ndarray
    force_true: np.ndarray
    force_est: np.ndarray
    force: Any
    desired: Any
    goal: Any
    error: Any


class PrivilegedState(NamedTuple):
    """What no agent sees of a robot, or of all, for controllers that bound what agents can do and for their teachers.

    Attributes:
        force: Contact force on the robot that counts, ``(..., d)`` [N].
        rigidity_ratio: Rigidity over the one that is known.
        goal: Set-point after the next step, a magnitude or ``(..., d)`` [N].
        places: Where the motors have left what they move, ``(..., actions)`` [mm].
        motors: Where the motors are, ``(..., actions)`` [mm].
        slack: Half of their play, ``(..., actions)`` [mm].
    """

    force: np.ndarray
    rigidity_ratio: Any
    goal: Any
    places: np.ndarray
    motors: np.ndarray
    slack: np.ndarray


class Room(NamedTuple):
    """What depends on the number of obstacles of a scene.

    Attributes:
        solver: The robots.
        layout: Where the numbers of an equilibrium stand.
        observer: What is seen of it.
        sensors: What is not ideal, if anything is.
    """

    solver: BaseBatch
    layout: Layout
    observer: Observer
    sensors: SensorModel | None


class EpisodeBatch:
    """Robots, each with a scene and a force to push with.

    Args:
        task: What the episodes ask.
        settings: What the environments were told.
        count: Number N of episodes.
        threads: Threads of the solver.

    Raises:
        ValueError: If an obstacle of the task could slip through the robot.
    """

    def __init__(self, task: Task, settings: Settings, count: int, threads: int = 1) -> None:
        check_robot(task, settings.robot)
        self._task, self._settings, self.body = task, settings, task.body
        self._target, self._vector = task.target, task.force_vector
        self.count, self._threads = count, threads
        self.peaks = np.ones(count)  # magnitude of the set-point, or the highest of one that moves
        self._courses = np.ones((count, COURSE_STEPS)) if task.moving else None
        self._goals = np.ones((count, self.body.model.space))  # set-points that are vectors
        self._effort = np.zeros(count) if self.body.actions == 1 else np.zeros((count, self.body.actions))
        self._seen = np.zeros((count, self.body.obstacle_size))
        self._time = np.zeros(count, int)  # steps of the episode
        self._trial = self.body.batch(settings, count, task.obstacles, threads)  # where scenes are tried out
        self._enter(self._make_room(task.obstacles))

    def _make_room(self, obstacles: int) -> Room:
        """Make room for scenes of so many obstacles."""
        solver = self.body.batch(self._settings, self.count, obstacles, self._threads)
        observer = Observer(self.body, self._settings, solver.layout, self._task)
        ranges = self._settings.sensors
        sensors = SensorModel(ranges, self.count, self.body, observer.delayed) if ranges else None
        return Room(solver, solver.layout, observer, sensors)

    def _room_for(self, obstacles: int) -> Room:
        """The present room, or another one where the number of obstacles is another."""
        if obstacles == self._layout.obstacles:
            return Room(self.solver, self._layout, self.observer, self._sensors)
        require(self.count == 1, f"all scenes of several robots must have {self._layout.obstacles} obstacles")
        return self._make_room(obstacles)

    def _enter(self, room: Room) -> None:
        self.solver, self._layout, self.observer, self._sensors = room

    def draw(self, robots: Sequence[int], generators: Sequence[np.random.Generator]) -> None:
        """Start new episodes of some robots, each drawn by its own generator.

        Raises:
            RuntimeError: As :func:`ccr_gym.tasks.assign`; episodes and generators stay as they were.
        """
        settings = self._settings
        with _restored_on_error(generators):
            forces, drawn = assign(self._task, self._trial, robots, generators, settings.cable_limit_mm, settings.split)
        self._enter(self._room_for(self._task.obstacles))
        for robot, assignment in zip(robots, drawn, strict=True):
            self.solver.assign(robot, assignment.scene)
        self._begin(robots, forces, drawn, generators)

    def give(self, robot: int, assignment: Assignment, generator: np.random.Generator) -> None:
        """Start a given episode of a robot; what else there is of it is drawn by its generator.

        Raises:
            ValueError: As the solver; the episode goes on as it was.
        """
        solver: Any = SpatialSolver if self.body.model is SPACE else Solver
        solver(self._settings.robot, assignment.scene)
        least = 1 if self._target is None else self._target + 1
        require(len(assignment.scene) >= least, f"the scene has {len(assignment.scene)} obstacles; it needs {least}")
        room = self._room_for(len(assignment.scene))
        room.solver.assign(robot, assignment.scene)
        self._enter(room)
        self._begin([robot], np.atleast_2d(assignment.desired_force), [assignment], [generator])

    def _begin(
        self,
        robots: Sequence[int],
        forces: np.ndarray,
        assignments: Sequence[Assignment],
        generators: Sequence[np.random.Generator],
    ) -> None:
        """Begin episodes with set-points, magnitudes ``(k, 1)`` or vectors ``(k, d)`` [N]."""
        self.peaks[robots] = forces[:, 0]
        if self._vector:
            self._goals[robots] = forces
            self.peaks[robots] = _norm(forces)
        self.solver.rest(robots)
        self._effort[robots], self._time[robots] = 0.0, 0
        if self._courses is None and self._sensors is None and not self.body.obstacle_size:
            return
        for robot, assignment, generator in zip(robots, assignments, generators, strict=True):
            if self._courses is not None:
                self._courses[robot] = 1.0 if assignment.course is None else assignment.course
            if self._sensors is not None:
                self._sensors.begin(robot, generator, self.solver.blocks[robot, self.body.place])
            if self.body.obstacle_size:
                self._seen[robot] = self.body.obstacle(assignment.scene)

    def step(self, effort: Any, which: Which = ALL) -> None:
        """Move what the actions of all robots, or of some, move, by ``effort`` times its full increment.

        Args:
            effort: Normalised increments of these robots, as :meth:`ccr_gym.bodies.Body.effort` gives them.
            which: One robot, a list of them, or all.
        """
        body, solver, settings = self.body, self.solver, self._settings
        if self._sensors is None:
            solver.commands[which, body.place] = body.command(solver.blocks, effort, which, settings)
        else:
            solver.commands[which, body.place] = self._sensors.drive(
                solver.blocks[which, body.place], effort * body.increments(settings), body.bounds(settings), which
            )
        self._effort[which] = effort
        self._time[which] += 1
        solver.move(which)

    def read(self, which: int | slice = ALL) -> ForceReading:
        """What one robot or all of them feel now."""
        blocks = self.solver.blocks[which]
        force_true = self._forces(blocks).copy()
        force_est = self.body.estimate(blocks, self._layout, force_true, which, self._settings)
        if self._sensors is not None:
            rigidity_ratio = np.asarray(self._sensors.rigidity_ratio[which])[..., None]
            force_true *= rigidity_ratio
            force_est *= rigidity_ratio * np.asarray(self._sensors.measured_load_fraction[which])[..., None]
        force = plain(_norm(force_true), which)
        desired = plain(self.peaks[which], which) if self._courses is None else self._desired(0, which)
        if self._vector:
            goal = self._goals[which].copy()
            error = plain(_norm(goal - force_true), which) / desired
        else:
            goal, error = desired, abs(force - desired) / desired
        return ForceReading(blocks, force_true, force_est, force, desired, goal, error)

    def _desired(self, ahead: int, which: int | slice) -> Any:
        """Magnitude of the set-point some steps ahead [N]."""
        if self._courses is None:
            return plain(self.peaks[which], which)
        robots, time = np.arange(self.count)[which], np.minimum(self._time[which] + ahead, COURSE_STEPS - 1)
        return plain(self.peaks[which] * self._courses[robots, time], which)

    def observe(self, reading: ForceReading, which: int | slice = ALL) -> np.ndarray:
        """What is seen, in the flat form, ``(k,)`` or ``(N, k)`` float32."""
        told = {"desired_force": reading.goal, "force_est": reading.force_est}
        if self._courses is not None:
            told["desired_ahead"] = np.stack([self._desired(steps, which) for steps in AHEAD], axis=-1)
        measured = reading.force_true
        if self._sensors is not None:
            measured = told["force_measured"] = measured + self._sensors.noise(self._time, which)
        if self._vector:
            told["force_error"] = reading.goal - measured
        else:
            told["force_error"] = reading.goal - (
                reading.force if self._sensors is None else plain(_norm(measured), which)
            )
        rows = self.observer.rows(reading.blocks, told, self._seen[which])
        if self._sensors is not None:
            rows = self._sensors.late(rows, self._time, which)
            self.observer.correct(rows, self._sensors.motors(which))
        return self.observer.bounded(rows)

    def rewards(self, reading: ForceReading, which: int | slice = ALL) -> tuple[Any, ...]:
        """Terms of the reward of the last step."""
        clearance = plain(reading.blocks[..., self._layout.clearance.at], which)
        effort = self.body.square(plain(self._effort[which], which) if self._effort.ndim == 1 else self._effort[which])
        operations = self.body.operations(which)
        weights, force, desired = self._settings.weights, reading.force, reading.desired
        return reward_terms(weights, force, desired, reading.error, clearance, effort, operations)

    def infos(self, reading: ForceReading, terms: tuple[Any, ...], which: int | slice = ALL) -> dict[str, Any]:
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

    def privileged_state(self, which: int | slice = ALL) -> PrivilegedState:
        """What is hidden of a robot, or of all."""
        sensors, force = self._sensors, self.read(which).force_true
        goal = self._goals[which].copy() if self._vector else self._desired(1, which)
        places = np.reshape(self.solver.blocks[which, self.body.place], (*force.shape[:-1], self.body.actions)).copy()
        if sensors is None:
            return PrivilegedState(
                force, plain(np.ones(self.count)[which], which), goal, places, places, np.zeros(places.shape)
            )
        rigidity_ratio = plain(sensors.rigidity_ratio[which], which)
        return PrivilegedState(force, rigidity_ratio, goal, places, sensors.motors(which), sensors.slack(which))

    def probe(self, places: np.ndarray) -> np.ndarray:
        """Forces that all robots would feel, ``(N, d)`` [N], if what their motors move were elsewhere.

        Args:
            places: Where, ``(N, actions)`` [mm], cut to what is possible; nothing moves.
        """
        commands = self.solver.commands.copy()
        places = np.clip(places, *self.body.bounds(self._settings))
        commands[:, self.body.place] = places.reshape(commands[:, self.body.place].shape)
        forces = self._forces(self.solver.probe(commands))
        return forces * (1.0 if self._sensors is None else self._sensors.rigidity_ratio[:, None])

    def _forces(self, blocks: np.ndarray) -> np.ndarray:
        """Contact forces that count, of a robot of the known rigidity, ``(..., d)`` [N]."""
        if self._target is None:
            return self._layout.force(blocks)
        return self._layout.forces(blocks)[..., self._target, :]

    def equilibrium(self, robot: int) -> Any:
        """A robot's present equilibrium; immutable."""
        return self.solver.equilibrium(robot)


@contextmanager
def _restored_on_error(generators: Sequence[np.random.Generator]) -> Iterator[None]:
    """Put generators back to where they were after any exception."""
    states = [generator.bit_generator.state for generator in generators]
    try:
        yield
    except BaseException:
        for generator, state in zip(generators, states, strict=True):
            generator.bit_generator.state = state
        raise


def _norm(forces: np.ndarray) -> Any:
    """Magnitudes of forces ``(..., d)``."""
    if forces.shape[-1] == 2:
        return np.hypot(forces[..., 0], forces[..., 1])
    return np.sqrt(forces[..., 0] ** 2 + forces[..., 1] ** 2 + forces[..., 2] ** 2)
