"""The registered environments, one class for each task; their docstrings are the reference of the task."""

from collections.abc import Mapping
from typing import ClassVar

from ccr_gym.checks import check_choice
from ccr_gym.contact_env import ContactEnv
from ccr_gym.describe import describe
from ccr_gym.task import AnyTask
from ccr_gym.tasks import (
    BracedPush,
    InsertAndPush,
    LoadCell,
    MovingObstacle,
    PushObstacle,
    SoftObstacle,
    SpatialPush,
    TrackForce,
    make_task,
)

CIRCLE = (
    "The robot is straight, its cable slack. The obstacle's centre is uniform in x {x} L and y {y} L, its "
    "radius in {radius} L, the set-point in {force} EI/L²"
)
FEASIBLE = (
    " Scenes are sampled until the obstacles leave the unstressed robot clear and a steady pull reaches the set-point "
    "without a stall, block or snap."
)


class TaskEnv(ContactEnv):
    """An environment of one class of tasks.

    Args:
        task: The task, or a mapping of its fields; ``None`` for the defaults.
        task_name: Name of the task's class, with which the ids are registered for single and vector environments.
        render_mode: ``None``, ``"rgb_array"`` or ``"human"``.
        **settings: Fields of the task's settings, as :class:`ccr_gym.Settings`.
    """

    task_class: ClassVar[type[AnyTask]]

    def __init__(
        self,
        task: AnyTask | Mapping[str, object] | None = None,
        task_name: str | None = None,
        render_mode: str | None = None,
        **settings: object,
    ) -> None:
        if task_name is not None:
            check_choice("task_name", task_name, choices=[self.task_class.__name__])
        super().__init__(make_task(self.task_class, task), render_mode, **settings)


class LoadCellEnv(TaskEnv):  # noqa: D101 - below
    task_class = LoadCell
    __doc__ = describe(
        LoadCell(),
        "Hold a set-point force on the paper's load cell (Fig. 8–10).",
        "A flat load cell stands at a random distance from a planar cable-driven continuum robot. Pulling the cable "
        "bends the robot towards it until node 14, the paper's 15th, meets it (eq. 12); pulling further raises the "
        "contact force. The agent commands cable increments to hold a desired force.",
        "The robot is straight, its cable slack. The distance is uniform in {distance} L, the set-point in "
        "{force} EI/L²; they are sampled until a steady pull reaches the set-point.",
    )


class PushObstacleEnv(TaskEnv):  # noqa: D101 - below
    task_class = PushObstacle
    __doc__ = describe(
        PushObstacle(),
        "Find a circular obstacle and push it with a desired force.",
        "A circular obstacle of random position and size lies in front of a planar cable-driven continuum robot. "
        "Pulling the cable bends the robot towards it; where and when it touches, and how the force then grows with "
        "the cable displacement, depend on the scene. The agent commands cable increments to hold a desired contact "
        "force.",
        CIRCLE + "." + FEASIBLE,
    )


class TrackForceEnv(TaskEnv):  # noqa: D101 - below
    task_class = TrackForce
    __doc__ = describe(
        TrackForce(),
        "Push a circular obstacle with a force that changes and swings.",
        "As `PushObstacle`, but the set-point moves: it swings about a level that changes several times in an "
        "episode. It is previewed, so that an agent that knows its robot can follow without delay.",
        CIRCLE + ", the largest of the episode. The set-point follows a level that changes {changes} times, at uniform "
        "times and over {ramp} steps each, to values uniform in {levels}; it swings about the level by {swing} of it, "
        "in a period of {period} steps. The whole course is scaled so that its largest value is the one sampled."
        + FEASIBLE,
    )


class BracedPushEnv(TaskEnv):  # noqa: D101 - below
    task_class = BracedPush
    __doc__ = describe(
        BracedPush(),
        "Brace on one obstacle and push another with a desired force.",
        "Two circular obstacles as in the paper's Fig. 4b. The robot meets the lower one, leans on it, and reaches "
        "the upper one beyond, whose contact force is regulated; the force on the lower one changes with it. Some "
        "scenes are near a snap.",
        "The robot is straight, its cable slack. The centre of the lower obstacle is uniform in x {brace[0]} L "
        "and y {brace[1]} L, its radius in {brace[2]} L; that of the upper one in x {goal[0]} L and y "
        "{goal[1]} L, its radius in {goal[2]} L; the set-point in {force} EI/L²." + FEASIBLE,
    )


class SoftObstacleEnv(TaskEnv):  # noqa: D101 - below
    task_class = SoftObstacle
    __doc__ = describe(
        SoftObstacle(),
        "Push an obstacle on a spring of unknown stiffness with a desired force.",
        "As `PushObstacle`, but the obstacle is mounted on a spring and yields. The stiffness varies more than "
        "tenfold between episodes, and with it the force that a millimetre of cable adds.",
        CIRCLE + ", the stiffness in {spring} EI/L³, uniform in its logarithm." + FEASIBLE,
    )


class MovingObstacleEnv(TaskEnv):  # noqa: D101 - below
    task_class = MovingObstacle
    __doc__ = describe(
        MovingObstacle(),
        "Hold a force on an obstacle that breathes.",
        "As `PushObstacle`, but the obstacle moves within the episode, as an organ does that breathes: it moves away "
        "and back in one direction, and rests between breaths. `info` says how far it has moved (`obstacle_mm`). Where "
        "it presses so hard that the motor cannot hold the cable, the cable pays out; where that does not help, the "
        "obstacle stops.",
        CIRCLE + ". In an episode breaths are {depth} L deep and take {period} steps; from one to the next the depth "
        "varies by up to {variation[0]} of it either way, the period by {variation[1]}. With `drift`, {drift} L by "
        "default, the obstacle also moves that far over the episode, steadily and in a direction of its own."
        + FEASIBLE,
    )


class InsertAndPushEnv(TaskEnv):  # noqa: D101 - below
    task_class = InsertAndPush
    __doc__ = describe(
        InsertAndPush(),
        "Push an obstacle with the cable and the insertion of the base.",
        "A circular obstacle lies in front of a planar robot whose base can insert and retract it. Both actions "
        "change the contact force.",
        CIRCLE + "." + FEASIBLE,
        action="increments of cable displacement and length as fractions of `max_increment_mm` and "
        "`max_insertion_mm`; positive ones pull and insert",
    )


class SpatialPushEnv(TaskEnv):  # noqa: D101 - below
    task_class = SpatialPush
    __doc__ = describe(
        SpatialPush(),
        "Push a sphere or a cylinder in space with a desired force.",
        "A sphere or a cylinder of random position and size stands anywhere around a cable-driven continuum robot "
        "with two pairs of opposite cables. Pulling them bends the robot in any direction. The agent "
        "commands increments of both pairs to hold a desired contact force. Pressed on its middle, a sphere lets the "
        'robot slip off to either side once the force is high enough. With `task={"force_vector": True}` the '
        "set-point is a force vector: `desired_force` and `force_error` have three components in [-1, 1], and the "
        "indices of later entries grow by two or four.",
        "The robot is straight, its cables slack. The obstacle stands at a uniform azimuth, its centre {distance} L "
        "off the axis and {height} L high, its radius uniform in {radius} L; a fraction of "
        "{cylinder_fraction} are cylinders across the robot's path, tilted by up to {max_tilt} rad. The set-point is "
        "uniform in {force} EI/L². With `force_vector` it is the force that a steady pull ends with, in a direction up "
        "to {max_ramp_angle} rad from the obstacle's." + FEASIBLE,
        action="increments of both signed displacements as fractions of `max_increment_mm`; a positive displacement "
        "pulls the first cable of a pair, a negative one the opposite cable",
    )
