"""The reward: named terms and their weights."""

from dataclasses import dataclass, fields

import numpy as np

from ccr_gym.checks import check_fields, check_number, checked
from ccr_gym.quantities import Quantity
from solver.common.operations import Operations

MAX_WEIGHT = 1e6
ACCURACY_RATE = 20.0  # of the decay of ``accuracy``, per relative force error
CLEARANCE_SPAN = 5 / 9  # of ``approach`` [L]
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


def reward_terms(
    weights: RewardWeights,
    force: Quantity,
    desired: Quantity,
    error: Quantity,
    clearance: Quantity,
    effort: Quantity,
    operations: Operations,
) -> tuple[Quantity, ...]:
    """Return the weighted terms in the order of :data:`TERMS`; their sum is the reward.

    Args:
        weights: Their weights.
        force: Magnitude of the contact force, zero without contact [N].
        desired: Magnitude of the desired force [N].
        error: Relative force error.
        clearance: Smallest gap over the robot's length.
        effort: Mean square of the action.
        operations: Operations on numbers or on arrays, as the quantities are.
    """
    minimum, maximum, where = operations
    excess = force / desired - 1.0
    return (
        -weights.force_error * minimum(error, 1.0),
        weights.accuracy * np.exp(-ACCURACY_RATE * error),
        -weights.overshoot * minimum(maximum(excess, 0.0), 1.0),
        -weights.approach * where(force > 0, 0.0, minimum(maximum(clearance, 0.0) / CLEARANCE_SPAN, 1.0)),
        -weights.effort * effort,
    )
