"""The benchmarks run; what they find is not tested."""

import numpy as np
import pytest

from agents.bench import kernel, report, space, throughput
from agents.bench.kernel import contact_mix as mix
from solver import Robot


@pytest.fixture(autouse=True)
def once(monkeypatch):
    monkeypatch.setattr(throughput, "ROUNDS", 1)


def test_environments(capsys):
    found = throughput.environments((1, 4))
    assert found["single_steps_per_s"] > 0
    assert found["vector_steps_per_s"].keys() == {"1 × 1", "1 × 2", "4 × 1", "4 × 2", "256 × 1", "256 × 2"}
    report.show("environments", found)
    assert "vector_256_ratio 2" in capsys.readouterr().out


def test_learning():
    assert 0 < throughput.learning(2048)["ppo_ratio"] < 2


def test_kernel():
    assert len(list(kernel.contact_mix(200, Robot.prototype()))) == 200
    alone, one_thread, two_threads = kernel.batch_times(4, steps=3)  # alone less the overhead of a call
    assert np.isfinite(alone)
    assert min(one_thread, two_threads) > 0
    assert kernel.cost([kernel.PUSHED, *kernel.FAR], repeats=2) > 0


@pytest.mark.parametrize("model", kernel.MODELS)
def test_the_contact_mix_is_of_the_model_that_it_is_named_after(model, monkeypatch):
    robots = []
    monkeypatch.setattr(kernel, "contact_mix", lambda steps, robot: robots.append(robot) or mix(steps, robot))
    monkeypatch.setitem(kernel.SEGMENTS, model, (18, 36))
    found = kernel.mixed(model, 200, 1)
    assert [robot.model for robot in robots] == [model]
    assert sum(found["statuses"].values()) == found["steps"] == 200
    assert found["ipopt_ratio"] == pytest.approx(1e3 * found["ipopt_median_ms"] / found["ipopt_beside_us"])


def test_kernel_in_space():
    found = space.summary(space.contact_mix(400))
    assert found["steps"] == 400
    assert found["sign_changes"] > 0
    rods = space.summary(space.contact_mix(400, robot=space.rod(4)))
    assert rods["in_contact"] > 0.1
    assert min(space.growth([space.rod(3, 18), space.rod(6, 24)], repeats=1)) > 0
