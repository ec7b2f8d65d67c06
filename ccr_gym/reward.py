"""The reward: named terms, then their weighted sum. Works on scalars and on arrays over environments alike."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Reals = npt.NDArray[np.float64] | np.float64


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


def reward_terms(
    weights: RewardWeights,
    force: Reals,
    desired: Reals,
    clearance: Reals,
    touching: npt.NDArray[np.bool_] | np.bool_,
    action: Reals,
) -> dict[str, Reals]:
    """Weighted terms whose sum is the reward.

    Args:
        weights: Their weights.
        force: Contact force magnitude [N].
        desired: Desired force [N].
        clearance: Smallest gap [mm].
        touching: Whether anything touches.
        action: Normalised cable increment in [−1, 1].
    """
    error = np.abs(force - desired) / desired
    terms = {
        "force_error": -np.minimum(error, 1.0),
        "accuracy": np.exp(-error / 0.05),
        "overshoot": -np.minimum(np.maximum(force / desired - 1.0, 0.0), 1.0),
        "approach": -np.minimum(np.maximum(clearance, 0.0), 100.0) / 100.0 * ~touching,
        "effort": -action * action,
    }
    return {name: getattr(weights, name) * term for name, term in terms.items()}
