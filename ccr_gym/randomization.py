"""Randomised robots: every episode draws its own, so that one policy learns to control all of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ccr_gym.checks import check_fields, check_flag, check_range, checked, derived
from ccr_gym.sensing import MAX_LOSS

Range = tuple[float, ...]
DRAWN_SIZE = 4  # rigidity, length and offset over the nominal ones, and the share of friction
NOMINAL: Range = (1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Randomization:
    """Ranges of the robots around the nominal one, which every episode draws from.

    Obstacles and set-points suit the robot that is drawn, in its natural units, and the estimator knows it, but for the
    straight lines of ``paper``. Actions, the observation's scales and the number of segments are the nominal robot's.
    Ratios are uniform in their logarithm.

    Attributes:
        rigidity: Flexural rigidity over the nominal one, of every segment.
        length: Length over the nominal one.
        offset: Offset of the cables over the nominal one.
        tendon_loss: Share of the tension that friction takes, as of :class:`ccr_gym.Sensing`, whose range it replaces;
            ``None`` keeps that range.
        observed: Whether the observation tells which robot it is.

    Raises:
        ValueError: If a range is not two numbers within bounds, the smaller one first.
    """

    rigidity: Range = checked(NOMINAL, check_range, low=0.01, high=100)
    length: Range = checked(NOMINAL, check_range, low=0.5, high=2)
    offset: Range = checked(NOMINAL, check_range, low=0.5, high=2)
    tendon_loss: Range | None = derived(check_range, low=0, high=MAX_LOSS)
    observed: bool = checked(True, check_flag)

    def __post_init__(self) -> None:
        check_fields(self)

    def corners(self, robot: Any) -> Iterator[Any]:
        """Return the robots at the ends of all ranges."""
        return (_resized(robot, *ratios) for ratios in product(self.rigidity, self.length, self.offset))

    def sample(self, robot: Any, generator: np.random.Generator) -> "Drawn":
        """Return a robot from the ranges around a nominal one."""
        low, high = self._ends()
        ratios = np.exp(low + generator.random(len(low)) * (high - low)).tolist()
        return Drawn(_resized(robot, *ratios), ratios)

    def features(self, numbers: np.ndarray, losses: Range) -> np.ndarray:
        """Return where robots are in their ranges, from −1 to 1, ``(..., 4)``; 0 where a range is a single number.

        Args:
            numbers: Rigidity, length and offset over the nominal ones, and the share of friction, ``(..., 4)``.
            losses: Range of the share of friction.
        """
        low, high = (np.append(end, loss) for end, loss in zip(self._ends(), losses, strict=True))
        shown = np.concatenate([np.log(numbers[..., :-1]), numbers[..., -1:]], axis=-1)
        spans = np.where(high > low, high - low, np.inf)
        return np.asarray(np.clip((2 * shown - low - high) / spans, -1.0, 1.0))

    def ratios(self, features: np.ndarray) -> np.ndarray:
        """Return rigidity, length and offset over the nominal ones from what :meth:`features` returns, ``(..., 3)``."""
        low, high = self._ends()
        return np.asarray(np.exp((low + high + (high - low) * features[..., :-1]) / 2))

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the logarithms of the ends of the ranges of rigidity, length and offset."""
        low, high = np.log([self.rigidity, self.length, self.offset]).T
        return low, high


class Drawn(NamedTuple):
    """A robot of an episode.

    Attributes:
        robot: The robot; ``None`` for the nominal one.
        ratios: Its rigidity, length and offset over the nominal ones.
    """

    robot: Any = None
    ratios: Sequence[float] = (1.0, 1.0, 1.0)


def _resized(robot: Any, rigidity: float, length: float, offset: float) -> Any:
    """Return a robot with its rigidity, length and offset multiplied; its insertion range stays.

    Raises:
        ValueError: As the robot.
    """
    cables = tuple(
        replace(cable, offset_mm=None if cable.offset_mm is None else cable.offset_mm * offset)
        for cable in robot.cables
    )
    segments = robot.segment_rigidity
    return replace(
        robot,
        rigidity=robot.rigidity * rigidity,
        length_mm=robot.length_mm * length,
        offset_mm=robot.offset_mm * offset,
        max_cable_mm=robot.cable_limit_mm,  # the actions of the nominal robot
        cables=cables,
        segment_rigidity=None if segments is None else tuple(rigidity * own for own in segments),
    )
