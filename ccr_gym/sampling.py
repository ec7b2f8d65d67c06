"""Sampling of feasible episodes: scenes that leave the straight robot clear, with set-points that it can reach."""

import zlib
from collections.abc import Sequence

import numpy as np

from ccr_gym.checks import check_array, check_type, refusal
from ccr_gym.scales import FORCE_SCALE_N
from ccr_gym.tasks import PROFILE_STEPS, AnyTask, Assignment, check_force
from solver import Scene
from solver.common.batch import BaseBatch
from solver.common.checks import check_core
from solver.common.robot import AnyRobot

MAX_SAMPLES = 1000
RAMP_INCREMENT_MM = 0.5  # cable displacement between the equilibria of a ramp
TEST_SHARE = 5  # one scene of this many is a test scene


def sample_feasible(
    task: AnyTask,
    batch: BaseBatch,
    robots: Sequence[int],
    generators: Sequence[np.random.Generator],
    cable_limit_mm: float,
    split: str = "all",
) -> tuple[np.ndarray, list[Assignment]]:
    """Return a feasible assignment for each of some robots, sampled by a generator of its own.

    An assignment is feasible if its obstacles leave the straight robot clear and pulling the cables steadily reaches
    the set-point without a stall, block or snap. Infeasible ones are sampled again.

    Args:
        task: The task that samples.
        batch: Robots to try scenes with; those named are left in theirs.
        robots: Indices of k robots in the batch.
        generators: One generator for each of them.
        cable_limit_mm: Largest cable displacement of the ramp [mm].
        split: ``"all"``, ``"train"`` or ``"test"`` scenes.

    Returns:
        Set-points ``(k, 1)``, or ``(k, d)`` where they are vectors [N], and the assignments.

    Raises:
        RuntimeError: If none of many samples is feasible: the task does not suit the robot.
        TypeError: If the task samples something other than an :class:`Assignment`.
        ValueError: If it samples an invalid scene or set-point.
    """
    desired = np.zeros((len(robots), task.adapter.space if task.force_vector else 1))
    assignments: dict[int, Assignment] = {}
    waiting = list(range(len(robots)))
    for _ in range(MAX_SAMPLES):
        sampled = {k: _sample_split(task, batch.robot, generators[k], split) for k in waiting}
        clear = [k for k in waiting if _place(batch, robots[k], sampled[k].scene)]
        if not clear:
            continue
        found, forces = _ramp(task, batch, [robots[k] for k in clear], [sampled[k] for k in clear], cable_limit_mm)
        desired[clear] = forces
        assignments |= {k: sampled[k] for k in clear}
        done = {k for k, success in zip(clear, found, strict=True) if success}
        waiting = [k for k in waiting if k not in done]
        if not waiting:
            return desired, [assignments[k] for k in range(len(robots))]
    raise RuntimeError(
        f"none of {MAX_SAMPLES} samples of {task} can be pushed as desired within {cable_limit_mm} mm of cable; "
        "widen the task's ranges or the cable limit"
    )


def check_robot(task: AnyTask, robot: AnyRobot) -> None:
    """Raise an error if an obstacle of the task could slip through the robot, or its narrowest obstacles are invalid.

    Raises:
        ValueError: Naming the task, the obstacle, its width and what the robot needs.
    """
    try:
        for scene in task.narrowest_scenes():
            check_core(robot, scene)
    except ValueError as error:
        raise ValueError(f"the narrowest obstacles of {task} are refused: {error}") from error


def in_test_split(scene: Scene) -> bool:
    """Return whether a scene is a test scene; the parameters of its obstacles assign a fixed fifth of all scenes."""
    return zlib.crc32(np.array(scene.parameters).tobytes()) % TEST_SHARE == 0


def _place(batch: BaseBatch, robot: int, scene: Scene) -> bool:
    """Put a robot among obstacles if they leave it clear, and return whether they do."""
    clear = batch.leaves_clear(scene)
    if clear:
        batch.assign(robot, scene)
    return clear


def _ramp(
    task: AnyTask, batch: BaseBatch, robots: list[int], assignments: list[Assignment], cable_limit_mm: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return whether ramps reach the set-points, ``(k,)`` bool, and the set-points, ``(k, 1)`` or ``(k, d)`` [N]."""
    forces = np.array([assignment.desired_force for assignment in assignments], float)
    pulls = np.array([assignment.pull for assignment in assignments])
    found, reached = batch.ramp_reaches_force(robots, forces, RAMP_INCREMENT_MM, cable_limit_mm, pulls, task.target)
    if not task.force_vector:
        return found, forces[:, None]
    return found & (np.linalg.norm(reached, axis=1) <= FORCE_SCALE_N), reached


def _sample_split(task: AnyTask, robot: AnyRobot, generator: np.random.Generator, split: str) -> Assignment:
    """Return the next assignment whose scene is of a split."""
    for _ in range(MAX_SAMPLES):
        sampled = task.sample(robot, generator)
        _check_sample(task, sampled)
        if split == "all" or in_test_split(sampled.scene) == (split == "test"):
            return sampled
    raise RuntimeError(f"none of {MAX_SAMPLES} samples of {task} is a {split} scene; widen the task's ranges")


def _check_sample(task: AnyTask, sampled: Assignment) -> None:
    """Raise an error if what a task, which may be a user's, has sampled is not a valid assignment."""
    check_type("what the task samples", sampled, Assignment, "an Assignment")
    check_type("sampled scene", sampled.scene, Scene)
    if len(sampled.scene) != task.obstacles:
        raise refusal("sampled scene", sampled.scene, f"a Scene of {task.obstacles} obstacles, as the task declares")
    check_force("sampled desired_force", sampled.desired_force)
    check_array("sampled pull", sampled.pull, (task.adapter.cables,))
    if sampled.profile is not None:
        profile = check_array("sampled profile", sampled.profile, (PROFILE_STEPS,))
        if not ((profile > 0).all() and (profile <= 1).all()):
            raise refusal("sampled profile", sampled.profile, "above 0 and at most 1 at every step")
