"""The reward: named terms, and their sum."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ccr_gym.checks import check_fields, check_number, checked
from solver.common.operations import Operations

MAX_WEIGHT = 1e6


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the reward terms, all of which are at most 0 but ``accuracy``.

    Attributes:
        force_error: Relative force error ``|F − F_d| / F_d``, of magnitudes or vectors, counted up to 1.
        accuracy: Nearness to the set-point, ``exp(−error / 5 %)``, in [0, 1].
        overshoot: Relative force above the set-point, counted up to 1.
        approach: Clearance per 100 mm while nothing touches.
        effort: Squared action.

    Raises:
        ValueError: If a weight is no number, negative, or beyond 1e6.
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
    weights: RewardWeights, force: Any, desired: Any, error: Any, clearance: Any, effort: Any, operations: Operations
) -> tuple[Any, ...]:
    """Weighted terms in the order of :data:`TERMS`, whose sum is the reward: five numbers, or arrays ``(N,)``.

    Args:
        weights: Their weights.
        force: Magnitude of the contact force, zero where nothing touches [N].
        desired: Magnitude of the desired force [N].
        error: Relative force error.
        clearance: Smallest gap [mm].
        effort: Mean square of the normalised cable increments.
        operations: Those of numbers or those of arrays, as the others are.
    """
    minimum, maximum, where = operations
    excess = force / desired - 1.0
    return (
        -weights.force_error * minimum(error, 1.0),
        weights.accuracy * np.exp(-20.0 * error),
        -weights.overshoot * minimum(maximum(excess, 0.0), 1.0),
        -weights.approach * where(force > 0, 0.0, minimum(maximum(clearance, 0.0) / 100.0, 1.0)),
        -weights.effort * effort,
    )
