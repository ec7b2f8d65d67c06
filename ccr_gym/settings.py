"""Settings of an environment, validated once."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Generic, Literal, TypeVar, cast

from ccr_gym.checks import (
    check_choice,
    check_fields,
    check_flag,
    check_instance,
    check_number,
    checked,
    derived,
    nested,
    refusal,
    require,
)
from ccr_gym.randomization import Randomization
from ccr_gym.reward import RewardWeights
from ccr_gym.scales import FORCE_SPAN, TENSION_SPAN, Scales
from ccr_gym.sensing import EXACT, Sensing
from solver import PRESETS, Actuation, Cable, Robot
from solver.common.validation import SMALLEST
from solver.spatial import SpatialRobot

RobotT = TypeVar("RobotT", bound=Robot | SpatialRobot)
SENSINGS = "ideal", "realistic", "sensorless"
MAX_FRICTION = 10.0
INCREMENT = 1 / 16  # cable displacement of a full action [a]
CABLE_LIMIT = 1.75  # largest cable displacement, of all sections together [a]
FORCE_LIMIT = 6.0  # contact force above which there is a cost [EI/L²]
INSERTION = 1 / 180  # of a full action [L]
INSERTED = 7 / 8, 9 / 8  # shortest and longest length [L]
SURROUNDED = tuple(Cable(angle=quarter * math.pi / 2) for quarter in range(4))


def check_sensing(name: str, value: object) -> str | Sensing:
    """Return the name of a sensing, or a :class:`Sensing`, which may be given as a mapping of its fields.

    Raises:
        TypeError: If it is anything else.
        ValueError: If it is another string, or a field is out of bounds.
    """
    if isinstance(value, str) and value in SENSINGS:
        return value
    if not isinstance(value, Sensing | Mapping):
        kind = ValueError if isinstance(value, str) else TypeError
        raise refusal(name, value, f"{', '.join(map(repr, SENSINGS))} or the fields of a Sensing", kind)
    return check_instance(name, value, kind=Sensing)


def _check_robot(name: str, value: object, *, kind: type[Any]) -> object:
    """Return a robot, the name of a preset, or the fields of a robot; which model it has is not settled yet."""
    if value is None or isinstance(value, kind):
        return value
    if isinstance(value, str):
        preset = value.replace("-", "_")
        if preset not in PRESETS:
            raise refusal(name, value, f"a {kind.__name__}, a mapping of its fields, or one of {', '.join(PRESETS)}")
        return preset
    if isinstance(value, Mapping):
        return dict(value)
    raise refusal(name, value, f"a {kind.__name__}, a mapping of its fields, or the name of a preset", TypeError)


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseSettings(Generic[RobotT]):
    """Settings that all environments share.

    Attributes:
        robot: The robot, the name of a preset (:data:`solver.PRESETS`), or a mapping of its fields; by default the
            paper's prototype.
        model: Model of a robot that is given by name, by its fields or not at all: ``"rod"``, or ``"paper"`` for the
            paper's system to the letter.
        obs_mode: Form of the observation: ``"flat"``, ``"dict"`` for its named parts, or ``"goal"`` for a
            goal-conditioned environment with ``observation``, ``achieved_goal`` and ``desired_goal``, whose reward is
            ``−min(|F − F_d| / F_d, 1)``. Its ``achieved_goal`` is the regulated force F without errors of sensors, for
            the reward; a policy that is to run on sensors must read the other two alone.
        force_sensor: Whether the measured contact force is observed beside the estimate.
        max_increment_mm: Cable displacement of a full action [mm]; ``None`` stands for a/16, shared by the sections.
        cable_limit_mm: Largest cable displacement that actions can command [mm]; ``None`` stands for 1.75 a, shared by
            the sections, or the robot's own limit if that is less.
        estimator: Estimate of the contact force that is observed: ``"contact"``, virtual work at the point that
            touches, or ``"paper"``, eq. 11.
        estimator_friction: Ratio μ of eq. 11, from 0 to 10.
        regulate: Force that is desired and rewarded: ``"true"``, or ``"estimate"``.
        force_limit: Contact force above which ``info["cost"]`` is positive [N]; ``None`` stands for 6 EI/L².
        weights: Weights of the reward terms, or a mapping of names to weights.
        backend: ``"native"``, or ``"casadi"`` for the reference solver, which is slow.
        sensing: ``"ideal"``, ``"realistic"``, ``"sensorless"``, the same without a force sensor, or a
            :class:`ccr_gym.Sensing` or mapping of its fields.
        randomize: A :class:`ccr_gym.Randomization` or mapping of its fields: every episode draws its own robot;
            ``None`` for the same robot in all.
        split: Scenes to sample: ``"train"``, ``"test"``, or ``"all"``; training and test scenes are disjoint.

    Raises:
        TypeError: If an argument is an object of the wrong class.
        ValueError: If an argument is out of range; the message names the bound.
    """

    robot_kind: ClassVar[type[Any]]

    robot: RobotT
    model: Literal["rod", "paper"] = checked("rod", check_choice, choices=("rod", "paper"))
    obs_mode: Literal["flat", "dict", "goal"] = checked("flat", check_choice, choices=("flat", "dict", "goal"))
    force_sensor: bool = checked(True, check_flag)
    max_increment_mm: float = derived(check_number, low=SMALLEST)
    cable_limit_mm: float = derived(check_number, low=SMALLEST)
    estimator: Literal["contact", "paper"] = checked("contact", check_choice, choices=("contact", "paper"))
    estimator_friction: float = checked(0.0, check_number, low=0, high=MAX_FRICTION)
    regulate: Literal["true", "estimate"] = checked("true", check_choice, choices=("true", "estimate"))
    force_limit: float = derived(check_number, low=SMALLEST)
    weights: RewardWeights = nested(RewardWeights)
    backend: Literal["native", "casadi"] = checked("native", check_choice, choices=("native", "casadi"))
    sensing: str | Sensing = checked("ideal", check_sensing)
    randomize: Randomization | None = derived(check_instance, kind=Randomization)
    split: Literal["all", "train", "test"] = checked("all", check_choice, choices=("all", "train", "test"))

    def __post_init__(self) -> None:
        check_fields(self)
        self._assign(robot=self._make_robot())
        scales, sections = self.scales, self.actuation.sections
        limit = min(CABLE_LIMIT * scales.travel_mm, self.robot.cable_limit_mm) / sections
        self._derive("cable_limit_mm", limit)
        self._derive("max_increment_mm", min(INCREMENT * scales.travel_mm / sections, self.cable_limit_mm))
        self._derive("force_limit", FORCE_LIMIT * scales.force_n)
        most = self.robot.cable_limit_mm / sections
        require(
            self.cable_limit_mm <= most,
            f"cable_limit_mm is {self.cable_limit_mm}; it must be at most {most:.6g}, the max_cable_mm of the robot"
            + (f" over its {sections} sections" if sections > 1 else ""),
        )
        require(
            self.max_increment_mm <= self.cable_limit_mm,
            f"max_increment_mm is {self.max_increment_mm}; it must be at most {self.cable_limit_mm:.6g}, "
            "the cable_limit_mm",
        )
        self._check_randomized()

    @property
    def scales(self) -> Scales:
        """Natural units of the robot."""
        return Scales.of(self.robot)

    @property
    def actuation(self) -> Actuation:
        """Map from actions to cables."""
        return Actuation.of(self.robot, 2 if isinstance(self.robot, Robot) else 3)

    @property
    def sensors(self) -> Sensing | None:
        """Ranges of the imperfections, or ``None`` where sensing is ideal."""
        if isinstance(self.sensing, Sensing):
            ranges: Sensing | None = self.sensing
        else:
            ranges = None if self.sensing == "ideal" else Sensing()
        loss = None if self.randomize is None else self.randomize.tendon_loss
        return ranges if loss is None else replace(ranges or EXACT, tendon_loss=loss)

    @property
    def force_span(self) -> float:
        """Force that is observed as 1 [EI/L²]: S sections, each of which keeps its bend, are S² times as stiff."""
        return FORCE_SPAN * self.actuation.sections**2

    @property
    def tension_span(self) -> float:
        """Tension that is observed as 1 [EI/(aL)]: each of S sections bends by an angle over an S-th of the length."""
        return TENSION_SPAN * self.actuation.sections

    @property
    def senses_force(self) -> bool:
        """Whether there is a force sensor."""
        return self.force_sensor and self.sensing != "sensorless"

    @property
    def kind(self) -> dict[str, object]:
        """What the arrays of a state depend on, by name, besides robot and task."""
        sensing = "ideal" if self.sensors is None else "realistic" if self.senses_force else "sensorless"
        fields = {"estimator": self.estimator, "regulate": self.regulate, "randomize": self.randomize}
        return {"sensing": sensing, **fields}

    @property
    def reach_mm(self) -> float:
        """Largest length of a robot [mm]."""
        return self.robot.longest_mm * (self.randomize.length[1] if self.randomize else 1.0)

    def _check_randomized(self) -> None:
        """Check that all robots that can be drawn can be made, and carry out all commands."""
        if self.randomize is None:
            return
        require(self.backend == "native", f"backend is {self.backend!r}; with randomize it must be 'native'")
        self._check_insertion(self.randomize.length)
        try:
            for _ in self.randomize.corners(self.robot):
                pass
        except ValueError as error:
            raise ValueError(f"randomize has robots that are refused: {error}") from error

    def _check_insertion(self, ratios: tuple[float, ...]) -> None:
        """Check that random lengths at rest lie in the range of insertion, which is the same for all robots."""
        robot = self.robot
        if isinstance(robot, Robot) and robot.length_range_mm is not None:
            low, high = (end / robot.length_mm for end in robot.length_range_mm)
            require(
                low <= ratios[0] and ratios[1] <= high,
                f"length of randomize is {ratios}; it must lie in ({low:.6g}, {high:.6g}), the length_range_mm of the "
                "robot over its length_mm, which stays as it is",
            )

    def _make_robot(self) -> RobotT:
        """Return the robot, which may be given by name, by its fields, or not at all."""
        kind, given = self.robot_kind, cast("object", self.robot)
        if isinstance(given, kind):
            return cast("RobotT", given)
        if isinstance(given, str):
            robot = self._preset(given)
        elif given:
            assert isinstance(given, dict)
            robot = check_instance("robot", given, kind=kind, usual={"model": self.model})
        else:
            robot = self._preset("prototype")
        return cast("RobotT", robot)

    def _preset(self, name: str) -> object:
        """Return a robot by its name; in the paper's model it keeps its sizes, rigidity and tension limit."""
        if self.model == "rod":
            return self.robot_kind.preset(name)
        row = PRESETS[name]
        kept = ("length_mm", "segments", "offset_mm", "rigidity", "max_tension")
        return self.robot_kind(model="paper", **{field: getattr(row, field) for field in kept})

    def _derive(self, name: str, value: float) -> None:
        """Fill in a field that follows from the robot unless it is given."""
        if getattr(self, name) is None:
            self._assign(**{name: value})

    def _assign(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(BaseSettings[Robot]):
    """Settings in the plane; see :class:`BaseSettings`."""

    robot: Robot = checked(cast("Robot", None), _check_robot, kind=Robot)

    robot_kind: ClassVar[type[Any]] = Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class InsertionSettings(Settings):
    """Settings in the plane with a base that inserts the robot; see :class:`BaseSettings`.

    Attributes:
        robot: As of :class:`BaseSettings`; without a ``length_range_mm`` it is inserted from 7/8 to 9/8 of its length.
        max_insertion_mm: Insertion of a full action [mm]; ``None`` stands for L/180.
    """

    max_insertion_mm: float = derived(check_number, low=SMALLEST)

    def __post_init__(self) -> None:
        Settings.__post_init__(self)
        self._derive("max_insertion_mm", INSERTION * self.scales.length_mm)
        require(self.backend == "native", f"backend is {self.backend!r}; with insertion it must be 'native'")

    def _make_robot(self) -> Robot:
        robot = Settings._make_robot(self)
        if robot.length_range_mm is not None:
            return robot
        shortest, longest = (part * robot.length_mm for part in INSERTED)
        return replace(robot, length_range_mm=(shortest, longest))


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialSettings(BaseSettings[SpatialRobot]):
    """Settings in space; see :class:`BaseSettings`.

    Attributes:
        robot: A :class:`solver.spatial.SpatialRobot`, the name of a preset, or a mapping of its fields; by default the
            paper's prototype with four cables, in the paper's model two pairs of them.
        backend: ``"native"``; the reference solver does not give all that is observed in space.
    """

    robot_kind: ClassVar[type[Any]] = SpatialRobot

    robot: SpatialRobot = checked(cast("SpatialRobot", None), _check_robot, kind=SpatialRobot)

    def __post_init__(self) -> None:
        BaseSettings.__post_init__(self)
        require(self.backend == "native", f"backend is {self.backend!r}; in space it must be 'native'")

    def _preset(self, name: str) -> object:
        if self.model == "rod" and not PRESETS[name].cables:
            return SpatialRobot.preset(name, cables=SURROUNDED)
        return BaseSettings._preset(self, name)


AnySettings = Settings | InsertionSettings | SpatialSettings
