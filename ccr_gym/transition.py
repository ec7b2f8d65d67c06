"""How episodes of one task side by side begin and move: scenes, set-points, robots, estimates."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.adapters import AnyAdapter
from ccr_gym.checks import require
from ccr_gym.estimation import ForceEstimator, Measured
from ccr_gym.observation import Observer
from ccr_gym.quantities import EnvIndex, norm
from ccr_gym.randomization import DRAWN_SIZE, Drawn
from ccr_gym.sampling import Trials, check_robot
from ccr_gym.sensing import Imperfections, SensorModel, sample_imperfections
from ccr_gym.settings import AnySettings
from ccr_gym.state import EpisodeState, check_alike, put, take
from ccr_gym.task import PROFILE_STEPS, AnyTask, Assignment
from solver import Equilibrium, Scene
from solver.common.batch import BaseBatch
from solver.spatial import SpatialEquilibrium

ALL = slice(None)
SEEDS = 2**32
STATE = (
    "_desired_n",
    "_goal_n",
    "_profiles",
    "_motions_mm",
    "_actuated_mm",
    "_last_actions",
    "_obstacle_features",
    "_drawn",
    "_robot_features",
    "_time",
    "_tensions",
    "_onsets",
)


class Pipeline(NamedTuple):
    """The chain from solver to observation, made for scenes of a fixed number of obstacles.

    Attributes:
        batch: The robots.
        adapter: Adapter of the robots.
        observer: Writer of observations.
        estimator: Estimator of the contact forces.
        model: What is known of the robots: themselves where sensing is ideal, otherwise robots of the nominal rigidity
            in the known scenes, at what the encoders read.
        sensors: Model of the imperfections; ``None`` where sensing is ideal.
    """

    batch: BaseBatch
    adapter: AnyAdapter
    observer: Observer
    estimator: ForceEstimator
    model: BaseBatch
    sensors: SensorModel | None


class Transition:
    """Robots of N episodes, each with obstacles and a set-point of its own, and how they move.

    Attributes:
        count: Number N of robots.
        batch: The robots.
        model: What is known of them, the same where sensing is ideal.
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
        for robot in [settings.robot] if settings.randomize is None else settings.randomize.corners(settings.robot):
            check_robot(task, robot)
        self._task, self._settings, self.count, self._threads = task, settings, count, threads
        self._ranges = settings.sensors  # which are made and checked at each access
        self._target, self._vector = task.target, task.force_vector
        self._kind = {"task": type(task).__name__, "force_vector": task.force_vector, **settings.kind}
        self._own = self._make_pipeline(task.obstacles)
        self._trials = Trials(task, settings, self._own.batch, self._own.adapter)
        self._use(self._own)
        actions, space = self.adapter.actions.size, self.adapter.space
        self._desired_n = np.ones(count)  # magnitudes of the set-points, the largest ones where they move
        self._goal_n = np.ones((count, space))  # the set-points where they are vectors
        self._profiles = np.ones((count, PROFILE_STEPS)) if task.moving else None
        self._motions_mm = np.zeros((count, PROFILE_STEPS, space)) if task.obstacles_move else None
        self._starts: list[Scene | None] = [None] * count  # scenes at the start of the episodes
        self._actuated_mm, self._last_actions = np.zeros((count, actions)), np.zeros((count, actions))
        self._obstacle_features = np.zeros((count, self.adapter.obstacle_size))
        self._drawn = np.ones((count, DRAWN_SIZE))  # what the robots are
        self._robot_features = np.zeros((count, DRAWN_SIZE))
        self._time = np.zeros(count, int)  # steps of the episode
        self._tensions = np.zeros((count, self.batch.cables))  # as the motors see them [N]
        self._onsets = np.zeros((count, self.batch.cables))  # those before the model's present contact [N]
        fixed = [] if self._vector else ["_goal_n"]
        fixed += [] if settings.randomize else ["_drawn", "_robot_features"]
        self._kept = tuple(name for name in STATE if name not in fixed and getattr(self, name) is not None)

    def _make_pipeline(self, obstacles: int) -> Pipeline:
        settings, count, ranges = self._settings, self.count, self._ranges
        batch = self._task.adapter.make_batch(settings, count, obstacles, self._threads)
        adapter = self._task.adapter(settings, batch.layout)
        observer = Observer(adapter, self._task)
        estimator = ForceEstimator(adapter, count, self._threads, learns=ranges is not None)
        if ranges is None:
            return Pipeline(batch, adapter, observer, estimator, batch, None)
        model = self._task.adapter.make_batch(settings, count, obstacles, self._threads)
        sensors = SensorModel(count, adapter.body, adapter.actions, observer.delayed)
        return Pipeline(batch, adapter, observer, estimator, model, sensors)

    def _pipeline_for(self, obstacles: int) -> Pipeline:
        """Return the present pipeline, that of the task, or a new one for another number of obstacles."""
        present = self._pipeline.batch.layout.obstacles
        for pipeline in (self._pipeline, self._own):
            if obstacles == pipeline.batch.layout.obstacles:
                return pipeline
        require(self.count == 1, f"all scenes of several robots must have {present} obstacles")
        return self._make_pipeline(obstacles)

    def _use(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self.batch, self.adapter, self.observer, self._estimator, self.model, self._sensors = pipeline
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
        with _restored_on_error(generators, self._own.batch, robots):
            imperfections, drawn = zip(*map(self._sample_hidden, generators), strict=True)
            forces, assignments = self._trials.sample_feasible(robots, generators, imperfections, drawn)
        self._use(self._own)
        self._start(robots, forces, assignments, imperfections, drawn)

    def _sample_hidden(self, generator: np.random.Generator) -> tuple[Imperfections | None, Drawn]:
        """Return imperfections and robot of an episode, sampled aside so that scenes are the same whatever they are."""
        settings, ranges, seed = self._settings, self._ranges, int(generator.integers(SEEDS))
        if ranges is None and settings.randomize is None:
            return None, Drawn()
        aside, sampled, drawn = np.random.default_rng(seed), None, Drawn()
        if settings.randomize is not None:
            drawn = settings.randomize.sample(settings.robot, aside)
        if ranges is not None:
            sampled = sample_imperfections(ranges, self.adapter.scales, self.adapter.body, aside)
        return sampled, drawn

    def start_given(self, robot: int, assignment: Assignment, generator: np.random.Generator) -> None:
        """Start a given episode of a robot; its generator samples the imperfections.

        Raises:
            ValueError: As the solver; the present episode continues.
        """
        self.adapter.check_scene(self._settings, assignment.scene)
        obstacles, least = len(assignment.scene), 1 if self._target is None else self._target + 1
        require(obstacles >= least, f"the scene has {obstacles} obstacles; it must have at least {least}")
        pipeline = self._pipeline_for(obstacles)
        with _restored_on_error([generator], pipeline.batch, [robot]):
            imperfections, drawn = self._sample_hidden(generator)
            pipeline.batch.assign(robot, assignment.scene, drawn.robot)
        self._use(pipeline)
        self._start([robot], np.atleast_2d(assignment.desired_force), [assignment], [imperfections], [drawn])

    def _start(
        self,
        robots: Sequence[int],
        forces: np.ndarray,
        assignments: Sequence[Assignment],
        imperfections: Sequence[Imperfections | None],
        drawn: Sequence[Drawn],
    ) -> None:
        """Start episodes of robots that are among their obstacles, with set-points ``(k, 1)`` or ``(k, d)`` [N]."""
        self._desired_n[robots] = forces[:, 0]
        if self._vector:
            self._goal_n[robots] = forces
            self._desired_n[robots] = norm(forces)
        self.batch.rest(robots)
        if self._sensors is not None:
            for robot in robots:
                self.model.assign_alike(robot, self.batch)
            self.model.rest(robots)
        self._estimator.rest(robots, [own.robot for own in drawn])
        self._last_actions[robots], self._time[robots] = 0.0, 0
        self._onsets[robots] = 0.0
        self._actuated_mm[robots] = self.adapter.actuated_mm(self.batch.blocks[robots], self._actuated_mm[robots] * 0.0)
        if self._settings.randomize is not None:
            self._note_drawn(robots, imperfections, drawn)
        for robot, assignment, sampled in zip(robots, assignments, imperfections, strict=True):
            self._starts[robot] = assignment.scene
            if self._motions_mm is not None:
                self._motions_mm[robot] = 0.0 if assignment.motion is None else assignment.motion
            if self._profiles is not None:
                self._profiles[robot] = 1.0 if assignment.profile is None else assignment.profile
            if self._sensors is not None and sampled is not None:
                self._sensors.begin_episode(robot, sampled, self._actuated_mm[robot])
            if self.adapter.obstacle_size:
                self._obstacle_features[robot] = self.adapter.obstacle_features(assignment.scene)
        self._sense(list(robots))

    def _note_drawn(
        self, robots: Sequence[int], imperfections: Sequence[Imperfections | None], drawn: Sequence[Drawn]
    ) -> None:
        """Note what robots are, for observation and info."""
        ranges, sensing = self._settings.randomize, self._ranges
        assert ranges is not None
        losses = [0.0 if sampled is None else sampled.tendon_loss for sampled in imperfections]
        self._drawn[robots] = [(*own.ratios, loss) for own, loss in zip(drawn, losses, strict=True)]
        loss_range = (0.0, 0.0) if sensing is None else sensing.tendon_loss
        self._robot_features[robots] = ranges.features(self._drawn[robots], loss_range)

    def step(self, actions: np.ndarray, index: EnvIndex = ALL) -> None:
        """Move the actuated coordinates of some robots by increments.

        Args:
            actions: Their actions, as :meth:`ccr_gym.adapters.RobotAdapter.clip` returns them, ``(..., actions)``.
            index: The robots.
        """
        adapter, batch, sensors = self.adapter, self.batch, self._sensors
        increment_mm = actions * adapter.actions.increment_mm
        if sensors is None:
            commanded = adapter.bounded(self._actuated_mm[index] + increment_mm)
        else:
            commanded = sensors.apply_backlash(self._actuated_mm[index], increment_mm, index)
            before = self._layout.cables(batch.blocks[index]).copy()
        adapter.write_command(batch.commands, commanded, index)
        self._last_actions[index] = actions
        self._time[index] += 1
        batch.move(index, self._scenes_ahead(index))
        blocks = batch.blocks[index]
        self._actuated_mm[index] = adapter.actuated_mm(blocks, commanded)
        if sensors is not None:
            self._note_moves(sensors, before, blocks, index)
            adapter.write_command(self.model.commands, sensors.motor_mm(index), index)
            self.model.move(index)
        self._sense(index)
        self._estimate(index)

    def _note_moves(self, sensors: SensorModel, before_mm: np.ndarray, blocks: np.ndarray, index: EnvIndex) -> None:
        """Note which way cables have moved from displacements ``(..., cables)`` [mm]."""
        sides = self.adapter.signed(blocks, np.ones(before_mm.shape))  # of a pair the other cable moves the other way
        sensors.move_cables(sides * before_mm, sides * self._layout.cables(blocks), index)

    def _sense(self, index: EnvIndex) -> None:
        """Read the tensions, and note those of robots of the model that nothing touches."""
        blocks, tensions = self.model.blocks[index], self._layout.tensions(self.batch.blocks[index])
        if self._sensors is None:
            self._tensions[index], self._onsets[index] = tensions, self._layout.onset(blocks)
            return
        self._tensions[index] = tensions = self._sensors.measured_tensions(tensions, self._time, index)
        touching = np.asarray(self._layout.flags(blocks).any(axis=-1))[..., None]
        self._onsets[index] = np.where(touching, self._onsets[index], self.adapter.signed(blocks, tensions))

    def _scenes_ahead(self, index: EnvIndex) -> list[Scene] | None:
        """Return where the obstacles of robots are to be after the step, None where they stay."""
        if self._motions_mm is None:
            return None
        robots = np.atleast_1d(np.arange(self.count)[index]).tolist()
        times = np.minimum(self._time, PROFILE_STEPS - 1)
        return [self._shifted(robot, self._motions_mm[robot, times[robot]]) for robot in robots]

    def _shifted(self, robot: int, by_mm: np.ndarray) -> Scene:
        start = self._starts[robot]
        assert start is not None
        return Scene(obstacle.shifted(by_mm.tolist()) for obstacle in start)

    def start_scene(self, robot: int) -> Scene | None:
        """Return the scene of a robot at the start of its episode."""
        return self._starts[robot]

    def _estimate(self, index: EnvIndex) -> None:
        """Estimate the forces of robots that have moved."""
        if not (self._estimator.learns or self._layout.flags(self.model.blocks[index]).any()):
            self._estimator.clear(index)  # by far the most frequent case
            return
        robots = np.atleast_1d(np.arange(self.count)[index]).tolist()
        measured = Measured(
            self.model.blocks[robots], self._encoders(robots), self._tensions[robots], self._onsets[robots]
        )
        self._estimator.update(robots, measured)

    def _encoders(self, index: EnvIndex) -> np.ndarray:
        """Return the actuated coordinates that the encoders of the motors read, ``(..., actions)`` [mm]."""
        return np.asarray(self._actuated_mm[index] if self._sensors is None else self._sensors.motor_mm(index))

    def get_rows(self, robots: list[int]) -> EpisodeState:
        """Return the states of the episodes of some robots."""
        learnt, free = self._estimator.get_rows(robots)
        sensors = {} if self._sensors is None else self._sensors.get_rows(robots)
        starts = tuple(self._starts[robot] for robot in robots)
        model = None if self._sensors is None else self.model.get_rows(robots)
        episode, rows = take(self, self._kept, robots), self.batch.get_rows(robots)
        return EpisodeState(self._kind, rows, model, starts, free, episode, learnt, sensors)

    def set_rows(self, robots: list[int], state: EpisodeState) -> None:
        """Put robots into states of :meth:`get_rows`, from which they go on with the same bits.

        Raises:
            ValueError: If they are states of other robots, or of an environment of another kind; nothing has changed.
        """
        check_alike(self._kind, state.kind)
        scenes = {len(scene) for scene in state.rows.scenes if scene is not None}
        pipeline = self._pipeline_for(scenes.pop() if scenes else self._task.obstacles)
        pipeline.batch.set_rows(robots, state.rows)
        self._use(pipeline)
        self._estimator.set_rows(robots, state.estimator, state.free)
        put(self, state.episode, robots)
        for robot, start in zip(robots, state.starts, strict=True):
            self._starts[robot] = start
        if self._sensors is not None and state.model is not None:
            self._sensors.set_rows(robots, state.sensors)
            self.model.set_rows(robots, state.model)

    def equilibrium(self, robot: int) -> Equilibrium | SpatialEquilibrium:
        """Return a robot's present equilibrium; it is immutable."""
        equilibrium = self.batch.equilibrium(robot)
        assert isinstance(equilibrium, Equilibrium | SpatialEquilibrium)
        return equilibrium


@contextmanager
def _restored_on_error(
    generators: Sequence[np.random.Generator], batch: BaseBatch, robots: Sequence[int]
) -> Iterator[None]:
    """Restore the states of generators and robots after any exception."""
    states, rows = [generator.bit_generator.state for generator in generators], batch.get_rows(list(robots))
    try:
        yield
    except BaseException:
        for generator, state in zip(generators, states, strict=True):
            generator.bit_generator.state = state
        batch.set_rows(list(robots), rows)
        raise
