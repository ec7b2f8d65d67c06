"""What is known of a real robot's motors and sensors, in the units it is measured in."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.errors import UserError
from agents.replay.json_files import check_names, check_object, read_json
from agents.replay.robots import AnyRobot, check_robot
from ccr_gym import Scales, Sensing

MOST_LOSS = 0.9
MOST_LATENCY = 7  # rows
POSITION = 0.002  # standard deviation of noise and of constant error of a position, each [L]
FIELDS = (
    "backlash_mm",
    "tendon_loss",
    "tension_noise_n",
    "tension_zero_n",
    "latency_rows",
    "position_noise_mm",
    "position_error_mm",
)


@dataclass(frozen=True, slots=True)
class Instruments:
    """Imperfections of motors and sensors.

    Attributes:
        sensing: Ranges of play, loss, latency and errors of the tensions, in natural units.
        position_noise_mm: Standard deviation of the white noise of a measured position, per axis [mm].
        position_error_mm: Standard deviation of its constant error, that of the camera's frame included [mm].
    """

    sensing: Sensing
    position_noise_mm: float
    position_error_mm: float


def read_instruments(path: Path | str | None, robot: AnyRobot) -> Instruments:
    """Return the imperfections that a JSON file states, without one those of ``sensing="realistic"``.

    Raises:
        TypeError: If the robot or the path is none.
        UserError: If the file states anything else.
    """
    check_robot(robot)
    try:
        return instruments_of({} if path is None else read_json(path), robot)
    except UserError:
        raise
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def instruments_of(value: object, robot: AnyRobot) -> Instruments:
    """Return the imperfections that a JSON value states; what it does not state is as in ``sensing="realistic"``.

    Args:
        value: An object with some of ``FIELDS``. Each is a range ``[low, high]`` or a number; of the noise and errors
            of tensions the upper end counts.
        robot: The robot, which the default ranges are in proportion to.

    Raises:
        ValueError: If a name is unknown or a value out of range.
    """
    given, scales, usual = check_object(value, "sensing"), Scales.of(robot), Sensing()
    check_names(given, FIELDS, "sensing")
    travel, tension, length = scales.travel_mm, scales.tension_n, scales.length_mm

    def natural(name: str, unit: float, default: tuple[float, ...], most: float = 1e6) -> tuple[float, ...]:
        if name not in given:
            return default
        return tuple(end / unit for end in _range(name, given[name], most * unit))

    latency = natural("latency_rows", 1.0, (0, 4), MOST_LATENCY)
    if any(end != int(end) for end in latency):
        raise ValueError(f"latency_rows is {given['latency_rows']!r}; it must be whole numbers")
    sensing = Sensing(
        latency=tuple(map(int, latency)),
        backlash=natural("backlash_mm", travel, usual.backlash, 1.0),
        tendon_loss=natural("tendon_loss", 1.0, usual.tendon_loss, MOST_LOSS),
        tension_noise=natural("tension_noise_n", tension, usual.tension_noise),
        tension_zero=natural("tension_zero_n", tension, usual.tension_zero),
    )
    sizes = (_range(name, given.get(name, POSITION * length), length)[1] for name in FIELDS[-2:])
    return Instruments(sensing, *sizes)


def _range(name: str, value: object, most: float) -> tuple[float, float]:
    """Return a range, which may be given as one number."""
    ends: list[Any] = value if isinstance(value, list) else [value, value]
    numbers = [end for end in ends if type(end) in (int, float) and math.isfinite(end) and 0 <= end <= most]
    if not (len(numbers) == len(ends) == 2 and numbers[0] <= numbers[1]):
        raise ValueError(
            f"{name} is {str(value)[:60]}; it must be a number from 0 to {most:.6g}, or two, the smaller one first"
        )
    return float(numbers[0]), float(numbers[1])
