"""Settings of an environment, validated once."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Generic, Literal, TypeVar

from ccr_gym.checks import (
    check_choice,
    check_fields,
    check_flag,
    check_instance,
    check_number,
    checked,
    nested,
    refusal,
    require,
)
from ccr_gym.reward import RewardWeights
from ccr_gym.sensing import Sensing
from solver import Robot
from solver.common.validation import SMALLEST
from solver.spatial import SpatialRobot

RobotT = TypeVar("RobotT", bound=Robot | SpatialRobot)
MAX_FRICTION = 10.0


def check_sensing(name: str, value: object) -> str | Sensing:
    """Return ``"ideal"``, ``"realistic"`` or a :class:`Sensing`, which may be given as a mapping of its fields.

    Raises:
        TypeError: If it is anything else.
        ValueError: If it is another string, or a field is out of bounds.
    """
    if isinstance(value, str) and value in ("ideal", "realistic"):
        return value
    if not isinstance(value, Sensing | Mapping):
        kind = ValueError if isinstance(value, str) else TypeError
        raise refusal(name, value, "'ideal', 'realistic' or the fields of a Sensing", kind)
    return check_instance(name, value, kind=Sensing)


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseSettings(Generic[RobotT]):
    """Settings that all environments share.

    Attributes:
        robot: The robot, or a mapping of its fields; by default the paper's prototype, in its model.
        obs_mode: Form of the observation: ``"dict"`` or ``"flat"``.
        force_sensor: Whether the measured contact force is observed beside the virtual-work estimate.
        max_increment_mm: Cable displacement of a full action [mm].
        cable_limit_mm: Largest cable displacement that actions can command [mm].
        estimator_friction: Ratio μ of the virtual-work estimator (eq. 11), from 0 to 10.
        force_limit: Contact force above which ``info["cost"]`` is positive [N].
        weights: Weights of the reward terms, or a mapping of names to weights.
        backend: ``"native"``, or ``"casadi"`` for the reference solver, which is slow.
        sensing: ``"ideal"``, ``"realistic"``, or a :class:`ccr_gym.Sensing` or mapping of its fields.
        split: Scenes to sample: ``"train"``, ``"test"``, or ``"all"``; training and test scenes are disjoint.

    Raises:
        TypeError: If an argument is an object of the wrong class.
        ValueError: If an argument is out of range; the message names the bound.
    """

    robot: RobotT
    obs_mode: Literal["dict", "flat"] = checked("dict", check_choice, choices=("dict", "flat"))
    force_sensor: bool = checked(True, check_flag)
    max_increment_mm: float = checked(0.5, check_number, low=SMALLEST)
    cable_limit_mm: float = checked(14.0, check_number, low=SMALLEST)
    estimator_friction: float = checked(0.0, check_number, low=0, high=MAX_FRICTION)
    force_limit: float = checked(0.3, check_number, low=SMALLEST)
    weights: RewardWeights = nested(RewardWeights)
    backend: Literal["native", "casadi"] = checked("native", check_choice, choices=("native", "casadi"))
    sensing: str | Sensing = checked("ideal", check_sensing)
    split: Literal["all", "train", "test"] = checked("all", check_choice, choices=("all", "train", "test"))

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            self.cable_limit_mm <= self.robot.cable_limit_mm,
            f"cable_limit_mm is {self.cable_limit_mm}; it must be at most {self.robot.cable_limit_mm:.6g}, "
            "the max_cable_mm of the robot",
        )
        require(
            self.max_increment_mm <= self.cable_limit_mm,
            f"max_increment_mm is {self.max_increment_mm}; it must be at most {self.cable_limit_mm:.6g}, "
            "the cable_limit_mm",
        )

    @property
    def sensors(self) -> Sensing | None:
        """Ranges of the imperfections, or ``None`` where sensing is ideal."""
        if self.sensing == "realistic":
            return Sensing()
        return self.sensing if isinstance(self.sensing, Sensing) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(BaseSettings[Robot]):
    """Settings in the plane; see :class:`BaseSettings`."""

    robot: Robot = nested(Robot, partial(Robot.prototype, model="paper"), model="paper")

    def __post_init__(self) -> None:
        BaseSettings.__post_init__(self)
        _require_one_cable(self.robot)


def _require_one_cable(robot: Robot) -> None:
    require(
        robot.bends_evenly,
        "robot has several cables, loads, precurvature or unequal segments; environments take one cable to the tip",
    )


def _insertable() -> Robot:
    return Robot(length_mm=160.0, segments=18, offset_mm=8.0, model="rod", length_range_mm=(140.0, 180.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class InsertionSettings(BaseSettings[Robot]):
    """Settings in the plane with a base that inserts the robot; see :class:`BaseSettings`.

    Attributes:
        robot: A robot with a ``length_range_mm``; by default a rod 160 mm long, with lengths from 140 to 180 mm.
        max_insertion_mm: Insertion of a full action [mm].
    """

    robot: Robot = nested(Robot, _insertable, model="paper")
    max_insertion_mm: float = checked(1.0, check_number, low=SMALLEST)

    def __post_init__(self) -> None:
        BaseSettings.__post_init__(self)
        _require_one_cable(self.robot)
        require(self.robot.length_range_mm is not None, "robot has no length_range_mm; give the lengths of insertion")
        require(self.backend == "native", f"backend is {self.backend!r}; with insertion it must be 'native'")


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialSettings(BaseSettings[SpatialRobot]):
    """Settings in space; see :class:`BaseSettings`.

    Attributes:
        robot: A :class:`solver.spatial.SpatialRobot`, or a mapping of its fields; by default the paper's prototype
            with a second pair of cables.
        cable_limit_mm: Largest cable displacement that actions can command, either way [mm].
        backend: ``"native"``; the reference solver does not give all that is observed in space.
    """

    robot: SpatialRobot = nested(SpatialRobot, partial(SpatialRobot.prototype, model="paper"), model="paper")
    cable_limit_mm: float = checked(10.0, check_number, low=SMALLEST)

    def __post_init__(self) -> None:
        BaseSettings.__post_init__(self)
        require(self.backend == "native", f"backend is {self.backend!r}; in space it must be 'native'")
        require(self.robot.model == "paper", "robot is a rod; in space environments take robots of the paper's model")


AnySettings = Settings | InsertionSettings | SpatialSettings
