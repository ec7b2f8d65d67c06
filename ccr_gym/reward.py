"""The reward: named terms, and their sum, in whole arrays over environments."""

from dataclasses import astuple, dataclass, fields
from functools import lru_cache

import numpy as np


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the reward terms, all of which are at most 0 but ``accuracy``.

    Attributes:
        force_error: Relative force error ``|F − F_d| / F_d``, counted up to 1.
        accuracy: Nearness to the set-point, ``exp(−error / 5 %)``, in [0, 1].
        overshoot: Relative force above the set-point, counted up to 1.
        approach: Clearance per 100 mm while nothing touches.
        effort: Squared action.
    """

    force_error: float = 1.0
    accuracy: float = 1.0
    overshoot: float = 0.5
    approach: float = 1.0
    effort: float = 0.02


TERMS = tuple(field.name for field in fields(RewardWeights))


def reward_terms(
    weights: RewardWeights, force: np.ndarray, desired: np.ndarray, clearance: np.ndarray, action: np.ndarray
) -> np.ndarray:
    """Weighted terms in the order of :data:`TERMS`, whose sum is the reward, ``(5, N)``.

    Args:
        weights: Their weights.
        force: Magnitude of the contact force, zero where nothing touches, ``(N,)`` [N].
        desired: Desired force, ``(N,)`` [N].
        clearance: Smallest gap, ``(N,)`` [mm].
        action: Normalised cable increment in [−1, 1], ``(N,)``.
    """
    excess = force / desired - 1.0
    error = np.abs(excess)
    terms = np.empty((len(TERMS), len(force)))
    np.minimum(error, 1.0, out=terms[0])
    np.exp(-20.0 * error, out=terms[1])
    np.minimum(np.maximum(excess, 0.0), 1.0, out=terms[2])
    np.minimum(np.maximum(clearance, 0.0) / 100.0, 1.0, out=terms[3])
    terms[3][force > 0] = 0.0
    np.multiply(action, action, out=terms[4])
    terms *= _signed(weights)
    return terms


@lru_cache(maxsize=16)
def _signed(weights: RewardWeights) -> np.ndarray:
    """The weights with the signs of their terms, ``(5, 1)``."""
    signs = {"accuracy": 1.0}
    return np.array([[signs.get(name, -1.0) * weight] for name, weight in zip(TERMS, astuple(weights), strict=True)])
