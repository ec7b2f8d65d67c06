"""The registered environments."""

from collections.abc import Mapping
from typing import Any, ClassVar

from ccr_gym.checks import check_instance
from ccr_gym.describe import describe
from ccr_gym.env import ContactEnv
from ccr_gym.tasks import (
    BracedPush,
    InsertAndPush,
    LoadCell,
    PushObstacle,
    SoftObstacle,
    SpatialPush,
    Task,
    TrackForce,
)
from ccr_gym.vector_env import ContactVectorEnv

FOUND = (
    "drawn again until the straight robot is clear of it and a steady pull reaches the set-point without a stall, "
    "block or snap."
)
CIRCLE = (
    "The straight robot, cable slack. The obstacle's centre is uniform in 35–75 × 75–150 mm, its radius in 10–16 mm, "
    "the set-point in 20–150 mN, "
)


class TaskEnv(ContactEnv):
    """An environment of one kind of task."""

    kind: ClassVar[type[Task]]

    def __init__(self, task: Task | Mapping[str, Any] | None = None, **kwargs: Any) -> None:
        """See the class; `kwargs` are those of `ContactEnv`."""
        super().__init__(_of(self.kind, task), **kwargs)


class TaskVectorEnv(ContactVectorEnv):
    """Many environments of one kind of task."""

    kind: ClassVar[type[Task]]

    def __init__(self, task: Task | Mapping[str, Any] | None = None, **kwargs: Any) -> None:
        """See the single environment; `kwargs` are those of `ContactVectorEnv`."""
        super().__init__(_of(self.kind, task), **kwargs)


class LoadCellEnv(TaskEnv):  # noqa: D101 - below
    kind = LoadCell
    __doc__ = describe(
        LoadCell(),
        "Hold a set-point force on the paper's load cell (Fig. 8–10).",
        "A flat load cell stands at a random distance from a planar cable-driven continuum robot. Pulling the cable "
        "bends the robot towards it until node 14, the paper's 15th, meets it (eq. 12); pulling on raises the contact "
        "force. The agent commands cable increments and is to hold a desired force.",
        "The straight robot, cable slack. The distance is uniform in 24–51 mm and the set-point in 10–60 mN, drawn "
        "again until a steady pull reaches the set-point.",
    )


class PushObstacleEnv(TaskEnv):  # noqa: D101 - below
    kind = PushObstacle
    __doc__ = describe(
        PushObstacle(),
        "Find a circular obstacle and push it with a desired force.",
        "A circular obstacle of random position and size lies somewhere in front of a planar cable-driven continuum "
        "robot. Pulling the cable bends the robot towards it; where and when it touches, and how the force then grows "
        "with the cable, depends on the scene. The agent commands cable increments and is to hold a desired contact "
        "force.",
        CIRCLE + FOUND,
    )


class TrackForceEnv(TaskEnv):  # noqa: D101 - below
    kind = TrackForce
    __doc__ = describe(
        TrackForce(),
        "Push a circular obstacle with a force that steps and swings.",
        "As `PushObstacle`, but the set-point moves: it swings about a level that changes three times in an episode. "
        "It is seen some steps ahead, so that an agent that knows its robot can follow without delay.",
        CIRCLE
        + "which is the highest of the episode; its levels are 30–100 % of that before they are scaled to it, the "
        "swing 10–40 % of the level with a period of 24–64 steps; " + FOUND,
    )


class BracedPushEnv(TaskEnv):  # noqa: D101 - below
    kind = BracedPush
    __doc__ = describe(
        BracedPush(),
        "Brace on one obstacle and push another with a desired force.",
        "Two circular obstacles as in the paper's Fig. 4b. The robot meets the lower one, leans on it, and reaches "
        "the upper one beyond, whose contact force is to be held; what the lower one carries changes with it. Slips "
        "are within reach.",
        "The straight robot, cable slack. Centre and radius of the lower obstacle are uniform in 27–38 × 75–95 mm and "
        "10–14 "
        "mm, those of the upper one in 52–72 × 125–150 mm and 12–16 mm, the set-point in 20–120 mN, " + FOUND,
    )


class SoftObstacleEnv(TaskEnv):  # noqa: D101 - below
    kind = SoftObstacle
    __doc__ = describe(
        SoftObstacle(),
        "Push an obstacle on a spring of unknown stiffness with a desired force.",
        "As `PushObstacle`, but the obstacle is mounted on a spring and gives way. The stiffness varies more than "
        "tenfold from episode to episode, and so does how much force a millimetre of cable is worth.",
        CIRCLE + "the stiffness in 0.003–0.1 N/mm, evenly in its logarithm; " + FOUND,
    )


class InsertAndPushEnv(TaskEnv):  # noqa: D101 - below
    kind = InsertAndPush
    __doc__ = describe(
        InsertAndPush(),
        "Push an obstacle with the cable and the insertion of the base.",
        "A circular obstacle in front of a planar robot whose cable slides through its disks, and whose base can "
        "insert it by 20 mm either way. Both actions change the contact force.",
        "The straight robot, 160 mm long, cable slack. The obstacle's centre is uniform in 35–75 × 75–130 mm, its "
        "radius in "
        "10–16 mm, the set-point in 20–150 mN, " + FOUND,
        action="increments of cable and length as fractions of `max_increment_mm` and `max_insertion_mm`; positive "
        "pulls and inserts",
    )


class SpatialPushEnv(TaskEnv):  # noqa: D101 - below
    kind = SpatialPush
    __doc__ = describe(
        SpatialPush(),
        "Push a sphere or a cylinder in space with a desired force.",
        "A sphere or a cylinder of random position and size stands anywhere around a cable-driven continuum robot "
        "with two pairs of opposite cables (eq. 13). Pulling them bends the robot towards any side. The agent "
        "commands both increments and is to hold a desired contact force. Pressed in its middle, a sphere lets the "
        "robot slip to either "
        'side once the force is high enough. With `task={"force_vector": True}` magnitude and direction are asked '
        "for: `desired_force` and `force_error` are vectors of three numbers in [-1, 1], and the indices after them "
        "grow by two or four.",
        "The straight robot, cables slack. The obstacle stands at a uniform azimuth, its centre 35–65 mm off the axis "
        "and 80–150 mm high, its radius uniform in 10–16 mm; half of them are cylinders of 60 mm across the way of "
        "the robot, tilted by up to 30°. The set-point is uniform in 20–150 mN, drawn again until a steady pull "
        "towards the obstacle reaches it without a stall, block or snap. With `force_vector` that pull is up to 0.25 "
        "rad aside of the obstacle, and the force it gets to is the set-point.",
        action="increments of both signed displacements as fractions of `max_increment_mm`; a positive displacement "
        "pulls the first cable of a pair, a negative one the opposite cable",
    )


class LoadCellVectorEnv(TaskVectorEnv):
    """Many `LoadCellEnv`, moved by one call of the solver."""

    kind = LoadCell


class PushObstacleVectorEnv(TaskVectorEnv):
    """Many `PushObstacleEnv`, moved by one call of the solver."""

    kind = PushObstacle


class TrackForceVectorEnv(TaskVectorEnv):
    """Many `TrackForceEnv`, moved by one call of the solver."""

    kind = TrackForce


class BracedPushVectorEnv(TaskVectorEnv):
    """Many `BracedPushEnv`, moved by one call of the solver."""

    kind = BracedPush


class SoftObstacleVectorEnv(TaskVectorEnv):
    """Many `SoftObstacleEnv`, moved by one call of the solver."""

    kind = SoftObstacle


class InsertAndPushVectorEnv(TaskVectorEnv):
    """Many `InsertAndPushEnv`, moved by one call of the solver."""

    kind = InsertAndPush


class SpatialPushVectorEnv(TaskVectorEnv):
    """Many `SpatialPushEnv`, moved by one call of the solver."""

    kind = SpatialPush


def _of(kind: type[Task], task: Any) -> Any:
    """A task, from one of any kind, a mapping of the fields of this kind, or nothing."""
    return task if isinstance(task, Task) else check_instance("task", task, kind=kind, default=kind)
