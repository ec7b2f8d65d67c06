"""What an environment is told when it is made, checked once."""

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from ccr_gym.checks import require
from ccr_gym.reward import RewardWeights
from ccr_gym.sensing import Sensing
from solver import Robot
from solver.spatial import SpatialRobot


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What all environments share.

    Attributes:
        robot: The robot, or a mapping of its fields; the paper's prototype by default.
        obs_mode: ``"dict"`` or ``"flat"``.
        force_sensor: Whether the exact contact force is observed beside the virtual-work estimate.
        max_increment_mm: Cable increment of a full action [mm].
        cable_limit_mm: Largest cable displacement a policy can command [mm].
        friction: Ratio μ of the virtual-work estimator (eq. 11).
        force_limit: Contact force above which ``info["cost"]`` counts [N].
        weights: Weights of the reward terms; a mapping of names to numbers is taken as well.
        backend: ``"native"``, or ``"casadi"`` for the reference solver (slow).
        sensing: ``"ideal"``, ``"realistic"``, or the ranges of what is not ideal, as
            :class:`ccr_gym.sensing.Sensing` or a mapping of its fields.
        split: Which scenes are drawn: ``"train"``, ``"test"``, which no training scene is in, or ``"all"``.

    Raises:
        ValueError: If an argument is out of range; the message names the bound.
    """

    kind: ClassVar[type[Any]] = Robot  # of the robot

    robot: Any = field(default_factory=Robot.prototype)
    obs_mode: Literal["dict", "flat"] = "dict"
    force_sensor: bool = True
    max_increment_mm: float = 0.5
    cable_limit_mm: float = 14.0
    friction: float = 0.0
    force_limit: float = 0.3
    weights: RewardWeights = field(default_factory=RewardWeights)
    backend: Literal["native", "casadi"] = "native"
    sensing: Any = "ideal"
    split: Literal["all", "train", "test"] = "all"

    def __post_init__(self) -> None:
        if isinstance(self.sensing, dict):
            object.__setattr__(self, "sensing", Sensing(**self.sensing))
        known = isinstance(self.sensing, Sensing) or self.sensing in ("ideal", "realistic")
        require(known, f"sensing is {self.sensing!r}; it must be 'ideal', 'realistic' or the fields of a Sensing")
        require(self.split in ("all", "train", "test"), f"split is {self.split!r}; it must be 'all', 'train' or 'test'")
        given: Any = self.robot
        if given is None or isinstance(given, dict):
            object.__setattr__(self, "robot", self.kind(**given) if given else self.kind.prototype())
        given = self.weights
        if given is None or isinstance(given, dict):
            object.__setattr__(self, "weights", RewardWeights(**(given or {})))
        require(self.obs_mode in ("dict", "flat"), f"obs_mode is {self.obs_mode!r}; it must be 'dict' or 'flat'")
        require(self.backend in ("native", "casadi"), f"backend is {self.backend!r}; it must be 'native' or 'casadi'")
        require(
            0 < self.cable_limit_mm <= self.robot.cable_limit_mm,
            f"cable_limit_mm is {self.cable_limit_mm}; it must be positive and at most {self.robot.cable_limit_mm:.6g}",
        )
        require(
            0 < self.max_increment_mm <= self.cable_limit_mm,
            f"max_increment_mm is {self.max_increment_mm}; it must be positive and at most cable_limit_mm",
        )
        require(self.force_limit > 0, f"force_limit is {self.force_limit}; it must be positive")

    @property
    def senses(self) -> Sensing | None:
        """What is not ideal, if anything is."""
        if self.sensing == "realistic":
            return Sensing()
        return self.sensing if isinstance(self.sensing, Sensing) else None


def _insertable() -> Robot:
    return Robot(length_mm=160.0, segments=18, offset_mm=8.0, cable="sliding", length_range_mm=(140.0, 180.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class InsertionSettings(Settings):
    """The same with a base that inserts the robot.

    Attributes:
        robot: A robot with a ``length_range_mm``; 160 mm long and inserted to 140–180 mm by default, its cable sliding.
        max_insertion_mm: Insertion of a full action [mm].
    """

    robot: Any = field(default_factory=_insertable)
    max_insertion_mm: float = 1.0

    def __post_init__(self) -> None:
        Settings.__post_init__(self)
        require(self.robot.length_range_mm is not None, "robot has no length_range_mm; give the lengths of insertion")
        require(self.max_insertion_mm > 0, f"max_insertion_mm is {self.max_insertion_mm}; it must be positive")
        require(self.backend == "native", f"backend is {self.backend!r}; with insertion it must be 'native'")


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialSettings(Settings):
    """The same in space.

    Attributes:
        robot: A :class:`solver.spatial.SpatialRobot`, or a mapping of its fields; the paper's prototype with a second
            cable by default.
        cable_limit_mm: Largest cable displacement a policy can command, either way [mm].
        backend: ``"native"``; the reference solver tells too little in space.
    """

    kind: ClassVar[type[Any]] = SpatialRobot

    robot: Any = field(default_factory=SpatialRobot.prototype)
    cable_limit_mm: float = 10.0

    def __post_init__(self) -> None:
        Settings.__post_init__(self)
        require(self.backend == "native", f"backend is {self.backend!r}; in space it must be 'native'")
