"""How episodes of one task side by side begin and move: scenes, set-points, robots, estimates."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from ccr_gym.actions import ActionSpec
from ccr_gym.arrays import EpisodeArrays, Readings, StepSlopes
from ccr_gym.checks import require
from ccr_gym.pipeline import Pipeline
from ccr_gym.quantities import norm
from ccr_gym.randomization import Drawn
from ccr_gym.sampling import Trials, check_robot
from ccr_gym.sensing import Imperfections, ImperfectionSampler
from ccr_gym.settings import AnySettings
from ccr_gym.state import EpisodeState, check_alike, put, take
from ccr_gym.task import PROFILE_STEPS, AnyTask, Assignment
from solver import Equilibrium, Scene
from solver.common.batch import BaseBatch
from solver.common.rows import as_slice
from solver.common.transition import Stage
from solver.spatial import SpatialEquilibrium

SEEDS = 2**32


class Transition:
    """Robots of N episodes, each with obstacles and a set-point of its own, and how they move.

    Attributes:
        count: Number N of robots.
        batch: The robots.
        model: What is known of them, the same where sensing is ideal.
        adapter: Adapter of the robots.
        observer: Columns of observations.
        readings: What was read of the robots after their last steps.
        slopes: Slopes of these steps; ``None`` where they are not differentiated.

    Args:
        task: What an episode asks.
        settings: Settings of the environment.
        count: Number N of robots.
        threads: Threads of the solver.
        derivatives: Whether steps are differentiated.

    Raises:
        ValueError: If an obstacle of the task could slip through the robot.
    """

    def __init__(
        self, task: AnyTask, settings: AnySettings, count: int, threads: int = 1, *, derivatives: bool = False
    ) -> None:
        for robot in [settings.robot] if settings.randomize is None else settings.randomize.corners(settings.robot):
            check_robot(task, robot)
        self._task, self._settings, self.count, self._threads = task, settings, count, threads
        self._ranges = settings.sensors  # which are made and checked at each access
        self._target, self._vector = task.target, task.force_vector
        self._kind = {"task": type(task).__name__, "force_vector": task.force_vector, **settings.kind}
        self._own = self._make_pipeline(task.obstacles)
        own, ranges = self._own.adapter, self._ranges
        self._sampler = None if ranges is None else ImperfectionSampler(ranges, own.scales, own.body)
        self._trials = Trials(task, settings, self._own.batch, self._own.adapter)
        self._starts: list[Scene | None] = [None] * count  # scenes at the start of the episodes
        self._state = EpisodeArrays.make(task, self._own.adapter, count)
        self.readings = Readings.make(task, self._own.adapter, self._own.observer.columns, count)
        self.slopes = StepSlopes.make(self._own.adapter, self._own.observer.columns, count) if derivatives else None
        self._pipeline: Pipeline | None = None
        self._use(self._own)
        self._robots, self._no_actions = np.arange(count), np.zeros((0, self.adapter.actions.size))
        fixed = set() if self._vector else {"goal_n"}
        fixed |= set() if settings.randomize else {"drawn", "robot_features"}
        self._kept = [name for name in self._state.given if name not in fixed]

    def _make_pipeline(self, obstacles: int) -> Pipeline:
        return Pipeline.make(self._task, self._settings, obstacles, self.count, self._threads)

    def _pipeline_for(self, obstacles: int) -> Pipeline:
        """Return the present pipeline, that of the task, or a new one for another number of obstacles."""
        present = self._layout.obstacles
        for pipeline in (self._pipeline, self._own):
            if pipeline is not None and obstacles == pipeline.batch.layout.obstacles:
                return pipeline
        require(self.count == 1, f"all scenes of several robots must have {present} obstacles")
        return self._make_pipeline(obstacles)

    def _use(self, pipeline: Pipeline) -> None:
        if pipeline is self._pipeline:
            return
        self._pipeline = pipeline
        self.batch, self.adapter, self.observer, self._estimator, self.model, self._sensors = pipeline
        self._layout = self.batch.layout
        self._kernel = self._make_kernel(self.slopes)
        self._slopes_here: tuple[Any, StepSlopes] | None = None

    @property
    def actions(self) -> ActionSpec:
        """The actuated coordinates."""
        return self.adapter.actions

    def start_sampled(self, robots: Sequence[int], generators: Sequence[np.random.Generator]) -> None:
        """Start new episodes of some robots, each sampled by its own generator.

        Raises:
            RuntimeError: As :func:`ccr_gym.sampling.sample_feasible`; episodes and generators remain as they were.
        """
        robots = list(robots)
        with _restored_on_error(generators, self._own.batch, robots):
            imperfections, drawn = self._sample_hidden(generators)
            forces, assignments = self._trials.sample_feasible(robots, generators, imperfections, drawn)
        self._use(self._own)
        self._start(robots, forces, assignments, imperfections, drawn)

    def _sample_hidden(self, generators: Sequence[np.random.Generator]) -> tuple[Imperfections | None, Sequence[Drawn]]:
        """Return imperfections and robots of episodes, sampled aside so that scenes are the same whatever they are."""
        randomize = self._settings.randomize
        seeds, drawn = [int(generator.integers(SEEDS)) for generator in generators], [Drawn()] * len(generators)
        if self._sampler is None and randomize is None:
            return None, drawn
        aside = list(map(np.random.default_rng, seeds))
        if randomize is not None:
            drawn = [randomize.sample(self._settings.robot, generator) for generator in aside]
        return None if self._sampler is None else self._sampler.sample(aside), drawn

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
            imperfections, drawn = self._sample_hidden([generator])
            pipeline.batch.assign(robot, assignment.scene, drawn[0].robot)
        self._use(pipeline)
        self._start([robot], np.atleast_2d(assignment.desired_force), [assignment], imperfections, drawn)

    def _start(
        self,
        robots: list[int],
        forces: np.ndarray,
        assignments: Sequence[Assignment],
        imperfections: Imperfections | None,
        drawn: Sequence[Drawn],
    ) -> None:
        """Start episodes of robots that are among their obstacles, with set-points ``(k, 1)`` or ``(k, d)`` [N]."""
        state, rows, indices = self._state, as_slice(robots), np.array(robots, np.int64)
        state.desired_n[rows] = forces[:, 0]
        if self._vector:
            state.goal_n[rows], state.desired_n[rows] = forces, norm(forces)
        self.batch.rest(robots)
        if self._sensors is not None:
            self.model.copy_rows(robots, self.batch)
        self._estimator.rest(robots, [own.robot for own in drawn], self.model.blocks[rows])
        for entry in (state.last_actions, state.time, state.onsets, state.actuated_mm, self.readings.numbers):
            entry[rows] = 0
        if self._settings.randomize is not None:
            self._note_drawn(robots, imperfections, drawn)
        if self.slopes is not None:
            self.slopes.clear(indices)
        self._run(indices, Stage.MARK)
        self._run(indices, Stage.REACH)
        self._note_starts(robots, assignments)
        if self._sensors is not None and imperfections is not None:
            self._sensors.begin_episodes(robots, imperfections, state.actuated_mm[rows])
        for stage in (Stage.SENSE, Stage.READ, Stage.OBSERVE):
            self._run(indices, stage)

    def _note_starts(self, robots: list[int], assignments: Sequence[Assignment]) -> None:
        """Note the scenes that episodes of robots begin with, and what is to change within them."""
        state, features = self._state, self.adapter.obstacle_size > 0
        for robot, assignment in zip(robots, assignments, strict=True):
            self._starts[robot] = assignment.scene
            if state.motions_mm is not None:
                state.motions_mm[robot] = 0.0 if assignment.motion is None else assignment.motion
            if state.profiles is not None:
                state.profiles[robot] = 1.0 if assignment.profile is None else assignment.profile
            if features:
                state.obstacle_features[robot] = self.adapter.obstacle_features(assignment.scene)

    def _note_drawn(self, robots: list[int], imperfections: Imperfections | None, drawn: Sequence[Drawn]) -> None:
        """Note what robots are, for observation and info."""
        ranges, sensing, state = self._settings.randomize, self._ranges, self._state
        assert ranges is not None
        losses = np.zeros(len(robots)) if imperfections is None else imperfections.number("tendon_loss")
        state.drawn[robots] = [(*own.ratios, loss) for own, loss in zip(drawn, losses, strict=True)]
        loss_range = (0.0, 0.0) if sensing is None else sensing.tendon_loss
        state.robot_features[robots] = ranges.features(state.drawn[robots], loss_range)

    def step(self, actions: np.ndarray, robots: np.ndarray | None = None) -> None:
        """Move the actuated coordinates of all robots, or of some, by increments.

        Args:
            actions: Their actions, ``(k, actions)``; clipped to [−1, 1].
            robots: The robots, ``(k,)`` int64; ``None`` for all.
        """
        robots = self._robots if robots is None else robots
        self.batch.check_rested(robots)
        last = Stage.OBSERVE if self.slopes is None else Stage.DERIVE
        if self._state.motions_mm is None and self._settings.backend == "native":
            self._kernel.run(robots, actions, Stage.MARK, last)
            return
        self._kernel.run(robots, actions, Stage.MARK, Stage.COMMAND)
        indices = robots.tolist()
        self.batch.move(indices, self._scenes_ahead(indices))
        if self._settings.backend == "native":
            self._run(robots, Stage.REACH, last)
            return
        self._run(robots, Stage.REACH)
        if self._sensors is not None:
            self.model.move(indices)
        self._run(robots, Stage.SENSE)
        self._estimator.move_free(robots, self.model.blocks[robots])
        self._run(robots, Stage.ESTIMATE, last)

    def _make_kernel(self, slopes: StepSlopes | None) -> Any:
        """Return the kernel's steps of the present pipeline, which write slopes or none."""
        assert self._pipeline is not None
        return self._pipeline.kernel(self._task, self._state, self.readings, slopes)

    def _differentiator(self) -> tuple[Any, StepSlopes]:
        """Return what differentiates robots where they are, and the slopes that it writes."""
        if self._slopes_here is None:
            slopes = StepSlopes.make(self.adapter, self.observer.columns, self.count)
            self._slopes_here = self._make_kernel(slopes), slopes
        return self._slopes_here

    def _run(self, robots: np.ndarray, first: Stage, last: Stage | None = None) -> None:
        """Go through stages of a step in which no action is taken."""
        self._kernel.run(robots, self._no_actions, first, first if last is None else last)

    def _scenes_ahead(self, robots: list[int]) -> list[Scene] | None:
        """Return where the obstacles of robots are to be after the step, None where they stay."""
        motions_mm = self._state.motions_mm
        if motions_mm is None:
            return None
        times = np.minimum(self._state.time, PROFILE_STEPS - 1)
        return [self._shifted(robot, motions_mm[robot, times[robot]]) for robot in robots]

    def _shifted(self, robot: int, by_mm: np.ndarray) -> Scene:
        start = self._starts[robot]
        assert start is not None
        return Scene(obstacle.shifted(by_mm.tolist()) for obstacle in start)

    def start_scene(self, robot: int) -> Scene | None:
        """Return the scene of a robot at the start of its episode."""
        return self._starts[robot]

    def _encoders(self) -> np.ndarray:
        """Return the actuated coordinates that the encoders of the motors read, ``(N, actions)`` [mm]."""
        return self._state.actuated_mm if self._sensors is None else self._sensors.motor_mm

    def get_rows(self, robots: list[int]) -> EpisodeState:
        """Return the states of the episodes of some robots."""
        learnt, free = self._estimator.get_rows(robots)
        sensors = {} if self._sensors is None else self._sensors.get_rows(robots)
        starts = tuple(self._starts[robot] for robot in robots)
        model = None if self._sensors is None else self.model.get_rows(robots)
        episode, rows = take(self._state.given, self._kept, robots), self.batch.get_rows(robots)
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
        put(self._state.given, state.episode, robots)
        for robot, start in zip(robots, state.starts, strict=True):
            self._starts[robot] = start
        if self._sensors is not None and state.model is not None:
            self._sensors.set_rows(robots, state.sensors)
            self.model.set_rows(robots, state.model)
        if self.slopes is not None:
            self.slopes.clear(np.array(robots, np.int64))
        started = np.array([robot for robot in robots if self._starts[robot] is not None], np.int64)
        self._run(started, Stage.READ)
        self._run(started, Stage.OBSERVE)

    def __reduce__(self) -> tuple[object, ...]:
        """Return what copies and pickles are made of; the kernel's parts are made anew."""
        arguments, robots = (self._task, self._settings, self.count, self._threads), list(range(self.count))
        make = partial(type(self), derivatives=self.slopes is not None)
        return make, arguments, (self.get_rows(robots), self.readings)

    def __setstate__(self, state: tuple[EpisodeState, Readings]) -> None:
        episodes, readings = state
        self.set_rows(list(range(self.count)), episodes)
        for own, given in zip(self.readings, readings, strict=True):
            own[:] = given

    def equilibrium(self, robot: int) -> Equilibrium | SpatialEquilibrium:
        """Return a robot's present equilibrium; it is immutable."""
        equilibrium = self.batch.equilibrium(robot)
        assert isinstance(equilibrium, Equilibrium | SpatialEquilibrium)
        return equilibrium


@contextmanager
def _restored_on_error(
    generators: Sequence[np.random.Generator], batch: BaseBatch, robots: list[int]
) -> Iterator[None]:
    """Restore the states of generators and robots after any exception."""
    states, rows = [generator.bit_generator.state for generator in generators], batch.get_rows(robots)
    try:
        yield
    except BaseException:
        for generator, state in zip(generators, states, strict=True):
            generator.bit_generator.state = state
        batch.set_rows(robots, rows)
        raise
