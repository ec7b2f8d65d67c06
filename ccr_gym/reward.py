"""The reward: named terms and their weights; :mod:`solver.common.transition_laws` holds the formula."""

from dataclasses import dataclass, fields

from ccr_gym.checks import check_fields, check_number, checked

MAX_WEIGHT = 1e6
SUCCESS_ERROR = 0.05  # relative force error up to which a step is a success


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the reward terms; all terms but ``accuracy`` are at most 0.

    Attributes:
        force_error: Relative force error ``|F − F_d| / F_d``, of magnitudes or vectors, counted up to 1.
        accuracy: Nearness to the set-point, ``exp(−20 |F − F_d| / F_d)``, in [0, 1].
        overshoot: Relative force above the set-point, counted up to 1.
        approach: Clearance over 5/9 of the robot's length while nothing touches, counted up to 1.
        effort: Mean square of the action.

    Raises:
        ValueError: If a weight is not a number from 0 to 1e6.
    """

    force_error: float = checked(1.0, check_number, low=0, high=MAX_WEIGHT)
    accuracy: float = checked(1.0, check_number, low=0, high=MAX_WEIGHT)
    overshoot: float = checked(0.5, check_number, low=0, high=MAX_WEIGHT)
    approach: float = checked(1.0, check_number, low=0, high=MAX_WEIGHT)
    effort: float = checked(0.02, check_number, low=0, high=MAX_WEIGHT)

    def __post_init__(self) -> None:
        check_fields(self)


TERMS = tuple(field.name for field in fields(RewardWeights))
