"""The registered environments."""

from typing import Any, TypeVar

from ccr_gym.env import ContactEnv
from ccr_gym.tasks import LoadCell, PushObstacle, SpatialPush
from ccr_gym.vector_env import ContactVectorEnv

TaskType = TypeVar("TaskType")


class LoadCellEnv(ContactEnv):
    """Hold a set-point force on the paper's load cell (Fig. 8–10).

    ## Description
    A flat load cell stands at a random distance from a planar cable-driven continuum robot. Pulling the cable bends
    the robot towards it until node 14, the paper's 15th, meets it (eq. 12); pulling on raises the contact force. The
    agent commands cable increments and is to hold a desired force.

    ## Action Space
    `Box(-1, 1, (1,), float32)`: cable increment as a fraction of `max_increment_mm`; positive pulls. The cable moves
    as far as its tension limit and the obstacles allow, within 0 to `cable_limit_mm`.

    ## Observation Space
    With `obs_mode="dict"` a `Dict` of float32 boxes, with `obs_mode="flat"` their concatenation in this order. Indices
    are of the flat form for the default robot of n = 18 segments; everything is clipped to its bounds.

    | Index | Key | Meaning | Scale | Bounds |
    | --- | --- | --- | --- | --- |
    | 0 | `cable` | cable displacement | `cable_limit_mm` (14 mm) | [0, 1] |
    | 1–19 | `contact` | multiplier > 0 at the backbone point of nodes 0…n | flag | {0, 1} |
    | 20–38 | `contact` | multiplier > 0 at the cable point of nodes 0…n | flag | {0, 1} |
    | 39 | `desired_force` | set-point | 0.5 N | [0, 1] |
    | 40 | `force_error` | set-point minus measured magnitude | 0.5 N | [-1, 1] |
    | 41–42 | `force_est` | virtual-work estimate of the force on the robot, x and y (eq. 11) | 0.5 N | [-1, 1] |
    | 43–44 | `force_measured` | force on the robot from an ideal force sensor, x and y | 0.5 N | [-1, 1] |
    | 45–101 | `nodes` | x, y, disk angle of nodes 0…n, node by node | 180 mm, 180 mm, π rad | [-1, 1] |

    Without `force_sensor` the keys `force_error` and `force_measured` are absent.

    ## Rewards
    The sum of named terms, each in `info["reward_terms"]`; F is the true contact force, F_d the set-point:
    `force_error` −min(|F−F_d|/F_d, 1); `accuracy` exp(−|F−F_d|/(5 % F_d)); `overshoot` −min(max(F/F_d−1, 0), 1) / 2;
    `approach` minus the clearance in units of 100 mm while nothing touches; `effort` −0.02 a².

    ## Starting State
    The straight robot, cable slack. The distance is uniform in 24–51 mm and the set-point in 10–60 mN, drawn again
    until a steady pull reaches the set-point.

    ## Episode End
    No state is terminal. Episodes are truncated after 64 steps.

    ## Info
    `force_true` and `force_est` (force on the robot, (2,) [N]), `desired_force` [N], `cable_mm`, `tension` [N],
    `solver_status` (`solver.Status` as a number), `cost` (force above `force_limit` [N]), `is_success` (within 5 % of
    the set-point), `reward_terms`.

    ## Arguments
    `render_mode`, the fields of `ccr_gym.settings.Settings`, and `task`: `LoadCell` or a mapping of its fields;
    mappings make every argument JSON-able.

    ## Version History
    * v0: initial version.
    """

    def __init__(self, task: LoadCell | dict[str, Any] | None = None, **kwargs: Any) -> None:
        """See the class; `kwargs` are those of `ContactEnv`."""
        super().__init__(_of(LoadCell, task), **kwargs)


class LoadCellVectorEnv(ContactVectorEnv):
    """Many `LoadCellEnv`, moved by one call of the solver."""

    def __init__(self, task: LoadCell | dict[str, Any] | None = None, **kwargs: Any) -> None:
        """See `LoadCellEnv`; `kwargs` are those of `ContactVectorEnv`."""
        super().__init__(_of(LoadCell, task), **kwargs)


class PushObstacleEnv(ContactEnv):
    """Find a circular obstacle and push it with a desired force.

    ## Description
    A circular obstacle of random position and size lies somewhere in front of a planar cable-driven continuum robot.
    Pulling the cable bends the robot towards it; where and when it touches, and how the force then grows with the
    cable, depends on the scene. The agent commands cable increments and is to hold a desired contact force.

    ## Action Space
    `Box(-1, 1, (1,), float32)`: cable increment as a fraction of `max_increment_mm`; positive pulls. The cable moves
    as far as its tension limit and the obstacles allow, within 0 to `cable_limit_mm`.

    ## Observation Space
    With `obs_mode="dict"` a `Dict` of float32 boxes, with `obs_mode="flat"` their concatenation in this order. Indices
    are of the flat form for the default robot of n = 18 segments; everything is clipped to its bounds.

    | Index | Key | Meaning | Scale | Bounds |
    | --- | --- | --- | --- | --- |
    | 0 | `cable` | cable displacement | `cable_limit_mm` (14 mm) | [0, 1] |
    | 1–19 | `contact` | multiplier > 0 at the backbone point of nodes 0…n | flag | {0, 1} |
    | 20–38 | `contact` | multiplier > 0 at the cable point of nodes 0…n | flag | {0, 1} |
    | 39 | `desired_force` | set-point | 0.5 N | [0, 1] |
    | 40 | `force_error` | set-point minus measured magnitude | 0.5 N | [-1, 1] |
    | 41–42 | `force_est` | virtual-work estimate of the force on the robot, x and y (eq. 11) | 0.5 N | [-1, 1] |
    | 43–44 | `force_measured` | force on the robot from an ideal force sensor, x and y | 0.5 N | [-1, 1] |
    | 45–101 | `nodes` | x, y, disk angle of nodes 0…n, node by node | 180 mm, 180 mm, π rad | [-1, 1] |

    Without `force_sensor` the keys `force_error` and `force_measured` are absent.

    ## Rewards
    The sum of named terms, each in `info["reward_terms"]`; F is the true contact force, F_d the set-point:
    `force_error` −min(|F−F_d|/F_d, 1); `accuracy` exp(−|F−F_d|/(5 % F_d)); `overshoot` −min(max(F/F_d−1, 0), 1) / 2;
    `approach` minus the clearance in units of 100 mm while nothing touches; `effort` −0.02 a².

    ## Starting State
    The straight robot, cable slack. The obstacle's centre is uniform in 35–75 × 75–150 mm, its radius in 10–16 mm, the
    set-point in 20–150 mN, drawn again until the straight robot is clear of the obstacle and a steady pull reaches the
    set-point without a stall, jam or snap.

    ## Episode End
    No state is terminal. Episodes are truncated after 64 steps.

    ## Info
    `force_true` and `force_est` (force on the robot, (2,) [N]), `desired_force` [N], `cable_mm`, `tension` [N],
    `solver_status` (`solver.Status` as a number), `cost` (force above `force_limit` [N]), `is_success` (within 5 % of
    the set-point), `reward_terms`.

    ## Arguments
    `render_mode`, the fields of `ccr_gym.settings.Settings`, and `task`: `PushObstacle` or a mapping of its fields;
    mappings make every argument JSON-able.

    ## Version History
    * v0: initial version.
    """

    def __init__(self, task: PushObstacle | dict[str, Any] | None = None, **kwargs: Any) -> None:
        """See the class; `kwargs` are those of `ContactEnv`."""
        super().__init__(_of(PushObstacle, task), **kwargs)


class PushObstacleVectorEnv(ContactVectorEnv):
    """Many `PushObstacleEnv`, moved by one call of the solver."""

    def __init__(self, task: PushObstacle | dict[str, Any] | None = None, **kwargs: Any) -> None:
        """See `PushObstacleEnv`; `kwargs` are those of `ContactVectorEnv`."""
        super().__init__(_of(PushObstacle, task), **kwargs)


class SpatialPushEnv(ContactEnv):
    """Push a sphere or a cylinder in space with a desired force.

    ## Description
    A sphere or a cylinder of random position and size stands anywhere around a cable-driven continuum robot with two
    pairs of opposite cables (eq. 13). Pulling them bends the robot towards any side. The agent commands both increments
    and is to hold a desired contact force. Pressed in its middle, a sphere lets the robot slip to either side once the
    force is high enough, which two cables can prevent and one cannot.

    ## Action Space
    `Box(-1, 1, (2,), float32)`: increments of both signed displacements as fractions of `max_increment_mm`. A positive
    displacement pulls the first cable of a pair, a negative one the opposite cable. The cables move as far as their
    tension limit and the obstacles allow, within ±`cable_limit_mm`.

    ## Observation Space
    With `obs_mode="dict"` a `Dict` of float32 boxes, with `obs_mode="flat"` their concatenation in this order. Indices
    are of the flat form for the default robot of n = 18 segments; everything is clipped to its bounds.

    | Index | Key | Meaning | Scale | Bounds |
    | --- | --- | --- | --- | --- |
    | 0–1 | `cable` | signed displacements | `cable_limit_mm` (10 mm) | [-1, 1] |
    | 2–20 | `contact` | multiplier > 0 at the backbone point of nodes 0…n | flag | {0, 1} |
    | 21–96 | `contact` | multiplier > 0 at the holes of nodes 0…n: first, second cable, opposites | flag | {0, 1} |
    | 97 | `desired_force` | set-point | 0.5 N | [0, 1] |
    | 98 | `force_error` | set-point minus measured magnitude | 0.5 N | [-1, 1] |
    | 99–101 | `force_est` | virtual-work estimate of the force on the robot, x, y, z | 0.5 N | [-1, 1] |
    | 102–104 | `force_measured` | force on the robot from an ideal force sensor, x, y, z | 0.5 N | [-1, 1] |
    | 105–218 | `frames` | first and last axis of the disk of nodes 0…n, node by node | 1 | [-1, 1] |
    | 219–275 | `nodes` | x, y, z of nodes 0…n, node by node | 180 mm | [-1, 1] |
    | 276–282 | `obstacle` | centre x, y, z; axis of a cylinder, else 0; radius | 180 mm, 1, 20 mm | [-1, 1] |

    Without `force_sensor` the keys `force_error` and `force_measured` are absent. With `task={"force_vector": True}`
    `desired_force` and `force_error` are vectors of three numbers in [-1, 1], and all indices after them grow by two or
    four.

    ## Rewards
    The sum of named terms, each in `info["reward_terms"]`; F is the true contact force, F_d the set-point, both
    magnitudes, or vectors with `force_vector` where their difference is taken: `force_error` −min(|F−F_d|/F_d, 1);
    `accuracy` exp(−|F−F_d|/(5 % F_d)); `overshoot` −min(max(F/F_d−1, 0), 1) / 2; `approach` minus the clearance in
    units of 100 mm while nothing touches; `effort` −0.02 times the mean square of the action.

    ## Starting State
    The straight robot, cables slack. The obstacle stands at a uniform azimuth, its centre 35–65 mm off the axis and
    80–150 mm high, its radius uniform in 10–16 mm; half of them are cylinders of 60 mm across the way of the robot,
    tilted by up to 30°. The set-point is uniform in 20–150 mN, drawn again until a steady pull towards the obstacle
    reaches it without a stall, jam or snap. With `force_vector` that pull is up to 0.25 rad aside of the obstacle, and
    the force it gets to is the set-point.

    ## Episode End
    No state is terminal. Episodes are truncated after 64 steps.

    ## Info
    `force_true` and `force_est` (force on the robot, (3,) [N]), `desired_force` [N], `cable_mm` and `tension` ((2,)
    [mm], [N]), `solver_status` (`solver.Status` as a number), `cost` (force above `force_limit` [N]), `is_success`
    (within 5 % of the set-point), `reward_terms`.

    ## Arguments
    `render_mode`, the fields of `ccr_gym.settings.SpatialSettings`, and `task`: `SpatialPush` or a mapping of its
    fields; mappings make every argument JSON-able.

    ## Version History
    * v0: initial version.
    """

    def __init__(self, task: SpatialPush | dict[str, Any] | None = None, **kwargs: Any) -> None:
        """See the class; `kwargs` are those of `ContactEnv`."""
        super().__init__(_of(SpatialPush, task), **kwargs)


class SpatialPushVectorEnv(ContactVectorEnv):
    """Many `SpatialPushEnv`, moved by one call of the solver."""

    def __init__(self, task: SpatialPush | dict[str, Any] | None = None, **kwargs: Any) -> None:
        """See `SpatialPushEnv`; `kwargs` are those of `ContactVectorEnv`."""
        super().__init__(_of(SpatialPush, task), **kwargs)


def _of(kind: type[TaskType], task: Any) -> TaskType:
    """A task, from one, a mapping of its fields, or nothing."""
    return kind(**task) if isinstance(task, dict) else task or kind()
