"""What an environment is told when it is made, checked once."""

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from ccr_gym.reward import RewardWeights
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

    def __post_init__(self) -> None:
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


def require(condition: bool, message: str) -> None:
    """Refuse what does not meet a condition.

    Raises:
        ValueError: With the message.
    """
    if not condition:
        raise ValueError(message)
