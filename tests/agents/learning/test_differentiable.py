"""Gradients of torch against central differences of the solver."""

import pytest
import torch

from agents.learning.differentiable import differentiable
from solver import Circle, Robot, Scene, Sensitivity, Solver, Status


@pytest.fixture
def solver():
    return Solver(Robot.prototype(model="paper"), Scene([Circle(center=(44, 104), radius=15)]))


def answers(solver, cables):
    equilibria = []
    for cable in cables.tolist():
        equilibrium = solver.rest()
        for part in range(1, 11):
            equilibrium = solver.step(equilibrium, cable * part / 10)
        equilibria.append(equilibrium)
    return equilibria


def test_gradients(solver):
    cables = torch.tensor([2.0, 8.0, 9.5], dtype=torch.float64, requires_grad=True)
    outputs = lambda values: differentiable(values, answers(solver, values.detach()))  # noqa: E731
    weights = [torch.randn(o.shape, dtype=o.dtype, generator=torch.Generator().manual_seed(0)) for o in outputs(cables)]
    value = lambda values: sum((w * o).sum() for w, o in zip(weights, outputs(values), strict=True))  # noqa: E731
    value(cables).backward()
    for k, step in enumerate(1e-4 * torch.eye(3, dtype=torch.float64)):
        difference = (value(cables + step) - value(cables - step)).item() / 2e-4
        assert cables.grad[k].item() == pytest.approx(difference, rel=1e-5)


def test_gradients_in_every_command_and_the_place_of_an_obstacle():
    robot = Robot(length_mm=180, segments=18, offset_mm=8, model="rod", length_range_mm=(170, 190))
    parameters = Sensitivity.rows(robot)
    rows = (0, parameters.length, parameters.obstacle(0).start)

    def solved(values):
        cable, length, x = values.tolist()
        solver = Solver(robot, Scene([Circle(center=(x, 104), radius=15, spring=1.0)]))
        equilibrium = solver.rest()
        for part in range(1, 11):
            equilibrium = solver.step(equilibrium, cable * part / 10, 180 + (length - 180) * part / 10)
        return equilibrium

    def value(values):
        nodes, tension, forces = differentiable(values[None], [solved(values.detach())], rows)
        return nodes[0, -1].sum() + tension[0] + 10 * forces[0, 0, 0]

    at = torch.tensor([9.0, 178.0, 44.0], dtype=torch.float64, requires_grad=True)
    value(at).backward()
    for k, step in enumerate(1e-4 * torch.eye(3, dtype=torch.float64)):
        difference = (value(at + step) - value(at - step)).item() / 2e-4
        assert at.grad[k].item() == pytest.approx(difference, rel=1e-5)


def test_a_set_point_is_found_by_gradient_descent(solver):
    """Newton's method on the contact force, through the solver."""
    cable = torch.tensor([8.0], dtype=torch.float64, requires_grad=True)
    for _ in range(8):
        forces = differentiable(cable, answers(solver, cable.detach()))[2]
        error = forces.norm() - 0.1
        (slope,) = torch.autograd.grad(error, cable)
        cable = (cable - error / slope).detach().requires_grad_()
    assert abs(error.item()) < 1e-9


def test_no_gradient_where_the_cable_does_not_follow():
    robot = Robot.prototype(model="paper", max_tension=1.0)
    solver = Solver(robot, Scene())
    cable = torch.tensor([13.0], dtype=torch.float64, requires_grad=True)
    equilibria = answers(solver, cable.detach())
    assert equilibria[0].status is Status.STALLED
    differentiable(cable, equilibria)[1].sum().backward()
    assert cable.grad.item() == 0


def test_shape(solver):
    with pytest.raises(ValueError, match=r"values has shape \(2,\); it must be \(1, 1\)"):
        differentiable(torch.zeros(2), [solver.rest()])
