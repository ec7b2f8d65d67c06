import numpy as np
import pytest

from agents.policy import set_points
from ccr_gym import AHEAD, FORCE_SPAN


def test_set_points_stay_as_they_are_unless_they_are_previewed():
    now = {"desired_force": np.array([0.3, -0.4])}
    assert set_points(now, 3, FORCE_SPAN) == pytest.approx(np.full(3, 0.5 * FORCE_SPAN))
    previewed = {"desired_force": np.array([0.1]), "desired_ahead": 0.1 + 0.02 * np.array(AHEAD)}
    steps = np.arange(1, max(AHEAD) + 3)
    found = set_points(previewed, len(steps), FORCE_SPAN)
    assert found == pytest.approx(FORCE_SPAN * (0.1 + 0.02 * np.minimum(steps, max(AHEAD))))
