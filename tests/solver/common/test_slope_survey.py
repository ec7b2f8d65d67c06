"""Slopes of sampled states of every family of robots: about 200, and with --long 10,000."""

import pytest
from soak.scenes import MODELS
from soak.slopes import survey


@pytest.mark.parametrize("model", MODELS)
def test_slopes_of_sampled_states(model, many):
    count = many(30, 1430)
    found = survey(model, count)
    assert len(found.dense) == count
    assert max(found.dense) <= 1e-9, found.worst
    assert len(found.differences) >= count
    assert max(found.differences) <= 1e-6, found.worst
