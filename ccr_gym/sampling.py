"""Sampling of feasible episodes: scenes that leave the unstressed robot clear, with set-points that it can hold."""

import zlib
from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np

from ccr_gym.adapters import AnyAdapter
from ccr_gym.checks import check_array, check_type, refusal
from ccr_gym.estimation import ForceEstimator
from ccr_gym.quantities import norm
from ccr_gym.randomization import Drawn
from ccr_gym.scales import Scales
from ccr_gym.sensing import Imperfections
from ccr_gym.settings import AnySettings
from ccr_gym.task import PROFILE_STEPS, AnyTask, Assignment, check_force, force_bounds
from solver import Scene
from solver.common.batch import BaseBatch
from solver.common.checks import check_core
from solver.common.robot import AnyRobot
from solver.common.rows import as_slice

MAX_SAMPLES = 1000
PULL = 1 / 16  # cable displacement between the equilibria of a trial pull, of all sections together [a]
MARGIN = 1.1  # force that a trial pull must reach, over the set-point
TEST_SHARE = 5  # one scene of this many is a test scene
HASHED = 8  # uniform numbers from which a scene is sampled that say which split it belongs to


class Trials:
    """Trial pulls of N robots, which tell whether an episode can be played.

    Args:
        task: The task that samples.
        settings: Settings of the environment.
        batch: The robots.
        adapter: Their adapter.
    """

    def __init__(self, task: AnyTask, settings: AnySettings, batch: BaseBatch, adapter: AnyAdapter) -> None:
        self._task, self._batch, self._adapter = task, batch, adapter
        self._split, self._limit_mm = settings.split, _limit_mm(settings, adapter)
        self._remedy = "widen the task's ranges, or either limit"
        if settings.randomize is not None:
            self._remedy += ", or narrow the ranges of randomize: not every robot that they allow can do it"
        self._shown_n = settings.force_span * adapter.scales.force_n  # which is made anew at each access
        self._increment_mm = PULL * adapter.scales.travel_mm
        self._estimator = None
        if settings.regulate == "estimate":
            self._estimator, self._arrays = ForceEstimator(adapter, batch, learns=False), batch.kernel_arrays

    def sample_feasible(
        self,
        robots: Sequence[int],
        generators: Sequence[np.random.Generator],
        imperfections: Imperfections | None,
        drawn: Sequence[Drawn],
    ) -> tuple[np.ndarray, list[Assignment]]:
        """Return a feasible assignment for each of some robots, sampled by a generator of its own.

        The robots are among the obstacles then, in no equilibrium yet; whatever is raised, they are where they were.

        An assignment is feasible if its obstacles leave the unstressed robot clear and pulling the cables steadily
        reaches the set-point, with a margin, without a stall, block or snap. Infeasible ones are sampled again.

        Args:
            robots: Indices of k robots.
            generators: One generator for each of them.
            imperfections: Imperfections of their episodes, whose rigidity and play limit what can be reached.
            drawn: What the robots of the episodes are.

        Returns:
            Set-points ``(k, 1)``, or ``(k, d)`` where they are vectors [N], and the assignments.

        Raises:
            RuntimeError: If none of many samples is feasible: the task does not suit the robot.
            TypeError: If the task samples something other than an :class:`Assignment`.
            ValueError: If it samples an invalid scene or set-point.
        """
        task, batch, split = self._task, self._batch, self._split
        desired = np.zeros((len(robots), self._adapter.space if task.force_vector else 1))
        ratios = np.ones(len(robots)) if imperfections is None else imperfections.number("rigidity_ratio")
        assignments: list[Any] = [None] * len(robots)
        waiting = list(range(len(robots)))
        for _ in range(MAX_SAMPLES):
            clear = []
            for k in waiting:
                own = drawn[k].robot
                assignments[k] = _sample_split(task, own or batch.robot, generators[k], split)
                if batch.assign_if_clear(robots[k], assignments[k].scene, own):
                    clear.append(k)
            if not clear:
                continue
            found, forces = self._pull(
                [robots[k] for k in clear], [assignments[k] for k in clear], [drawn[k] for k in clear], ratios[clear]
            )
            desired[clear] = forces
            done = {k for k, success in zip(clear, found.tolist(), strict=True) if success}
            waiting = [k for k in waiting if k not in done]
            if not waiting:
                return desired, assignments
        raise RuntimeError(
            f"none of {MAX_SAMPLES} samples of {self._task} can be pushed as desired within {self._limit_mm:.6g} mm of "
            f"cable and the tension limit; {self._remedy}"
        )

    def _pull(
        self, robots: list[int], assignments: list[Assignment], drawn: list[Drawn], ratios: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return whether trial pulls reach the set-points, ``(k,)`` bool, and the set-points, as sampled or reached."""
        forces = np.array([assignment.desired_force for assignment in assignments], float)
        bending = np.array([assignment.direction for assignment in assignments], float)
        commands = self._adapter.actuation.steady(bending)
        wanted = forces * MARGIN / ratios
        if self._estimator is not None:
            found, reached = self._pull_by_estimate(robots, drawn, wanted, commands)
        else:
            pulls = self._adapter.actuation.cables_mm(commands)
            found, reached = self._batch.ramp_reaches_force(
                robots, wanted, self._increment_mm, self._limit_mm, pulls, self._task.target
            )
        if not self._task.force_vector:
            return found & (forces <= self._shown_n), forces[:, None]
        goals = reached * (ratios / MARGIN)[:, None]
        return found & (norm(goals) <= self._shown_n), goals

    def _pull_by_estimate(
        self, robots: list[int], drawn: list[Drawn], wanted: np.ndarray, commands: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return whether steady pulls bring the estimated forces to those wanted, and the forces they reach."""
        batch, estimator = self._batch, self._estimator
        assert estimator is not None
        batch.rest(robots)
        estimator.rest(robots, [own.robot for own in drawn], batch.blocks[as_slice(robots)])
        reached = np.zeros((len(robots), self._adapter.space))
        target = -1 if self._task.target is None else self._task.target
        found = estimator.kernel.pulls_reach_forces(
            self._arrays,
            np.array(robots, np.int64),
            wanted,
            target,
            commands,
            self._increment_mm,
            self._limit_mm,
            reached,
        )
        return np.array(found, bool), reached


def _limit_mm(settings: AnySettings, adapter: AnyAdapter) -> float:
    """Return the largest cable displacement, of all sections together, that is reached whatever the play [mm]."""
    sensors = settings.sensors
    play = 0.0 if sensors is None else sensors.backlash[1] * adapter.scales.travel_mm
    return max(settings.cable_limit_mm - play, 0.5 * settings.cable_limit_mm) * adapter.actuation.sections


def check_robot(task: AnyTask, robot: AnyRobot) -> None:
    """Raise an error if an obstacle of the task could slip through the robot, or its narrowest obstacles are invalid.

    Raises:
        ValueError: Naming the task, the obstacle, its width and what the robot needs.
    """
    try:
        for scene in task.narrowest_scenes(robot):
            check_core(robot, scene)
    except ValueError as error:
        raise ValueError(f"the narrowest obstacles of {task} are refused: {error}") from error


def _sample_split(task: AnyTask, robot: AnyRobot, generator: np.random.Generator, split: str) -> Assignment:
    """Return the next assignment whose scene is of a split."""
    for _ in range(MAX_SAMPLES):
        wanted = split == "all" or is_test_draw(generator) == (split == "test")
        sampled = task.sample(robot, generator)
        _check_sample(task, robot, sampled)
        if wanted:
            return sampled
    raise RuntimeError(f"none of {MAX_SAMPLES} samples of {task} is a {split} scene; widen the task's ranges")


def is_test_draw(generator: np.random.Generator) -> bool:
    """Return whether what a generator would sample next is a test scene, without drawing from it.

    The uniform numbers that a scene is made of assign a fixed fifth of all scenes, for robots of any size.
    """
    state = generator.bit_generator.state
    draws = generator.random(HASHED)
    generator.bit_generator.state = state
    return zlib.crc32(draws.tobytes()) % TEST_SHARE == 0


def _check_sample(task: AnyTask, robot: AnyRobot, sampled: Assignment) -> None:
    """Raise an error if what a task, which may be a user's, has sampled is not a valid assignment."""
    if _is_plain(task, robot, sampled):
        return
    check_type("what the task samples", sampled, Assignment, "an Assignment")
    check_type("sampled scene", sampled.scene, Scene)
    if len(sampled.scene) != task.obstacles:
        raise refusal("sampled scene", sampled.scene, f"a Scene of {task.obstacles} obstacles, as the task declares")
    check_force("sampled desired_force", sampled.desired_force, Scales.of(robot).force_n)
    check_array("sampled direction", sampled.direction, (task.adapter.space - 1,))
    if sampled.profile is not None:
        profile = check_array("sampled profile", sampled.profile, (PROFILE_STEPS,))
        if not ((profile > 0).all() and (profile <= 1).all()):
            raise refusal("sampled profile", sampled.profile, "above 0 and at most 1 at every step")
    if sampled.motion is not None:
        check_array("sampled motion", sampled.motion, (PROFILE_STEPS, task.adapter.space))


def _is_plain(task: AnyTask, robot: AnyRobot, sampled: Assignment) -> bool:
    """Return whether an assignment is valid, without a profile or motion, by a look that takes less than all checks."""
    if type(sampled) is not Assignment or sampled.profile is not None or sampled.motion is not None:
        return False
    scene, force, direction = sampled.scene, sampled.desired_force, sampled.direction
    if type(scene) is not Scene or type(force) is not float or type(direction) is not tuple:
        return False
    low, high = force_bounds(Scales.of(robot).force_n)
    numbers = len(direction) == task.adapter.space - 1 and all(type(n) is float and isfinite(n) for n in direction)
    return numbers and len(scene.obstacles) == task.obstacles and low <= force <= high
