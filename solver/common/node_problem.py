"""The node-coordinate problem (eq. 5 or 13) as a symbolic problem, and its derivatives."""

from typing import NamedTuple

import casadi as ca


class NodeProblem(NamedTuple):
    """Eq. 5 in node coordinates, symbolic.

    Attributes:
        unknowns: Backbone then cable points of nodes 1…n, then the displacements of the obstacles on springs, each as
            x, y pairs, ``(4n + 2s,)`` [mm].
        parameters: ``(l, L0, a, EI)``, the shapes of the obstacles, one after the other, and ``(kxx, kxy, kyy)`` of
            those on springs.
        objective: Sum of squared disk angles, and the energy of the springs over ``B = EI / 2 l0`` [rad²].
        equalities: Zero when every segment has its shape, ``(3n,)`` [mm]. With a uniform cable: lengths of backbone,
            cable and disk minus their values. With a sliding one, whose segments are arcs: length of the chord minus
            its value, component of the chord along the bisector of the disks, length of the disk minus its value.
        inequalities: Not negative, ``(k,)`` [mm]: with a sliding cable its slack, then what is left between the disks
            of each segment on the cable's side, then on the other; then the gap of every point that can touch, but for
            node 0, to every obstacle, ordered (obstacle, line, position).
    """

    unknowns: ca.MX
    parameters: ca.MX
    objective: ca.MX
    equalities: ca.MX
    inequalities: ca.MX


def norms(columns: ca.MX) -> ca.MX:
    """Lengths of the columns."""
    return ca.sqrt(ca.sum1(columns**2))


def divided(line: ca.MX, between: int) -> ca.MX:
    """The points of a line with as many between every two."""
    pieces = [line[:, :-1] + k / (between + 1) * (line[:, 1:] - line[:, :-1]) for k in range(between + 1)]
    return ca.horzcat(ca.reshape(ca.vertcat(*pieces), line.shape[0], -1), line[:, -1])


def first_derivatives(problem: NodeProblem) -> ca.Function:
    """``(unknowns, parameters) → ∇J, equalities, their Jacobian, inequalities, theirs`` of a problem."""
    outputs = [
        ca.gradient(problem.objective, problem.unknowns),
        problem.equalities,
        ca.jacobian(problem.equalities, problem.unknowns),
        problem.inequalities,
        ca.jacobian(problem.inequalities, problem.unknowns),
    ]
    return ca.Function("first_derivatives", [problem.unknowns, problem.parameters], outputs).expand()


def second_derivatives(problem: NodeProblem, change: ca.MX) -> ca.Function:
    """Derivatives of the optimality conditions of a problem that was built with a change ``v`` of what it is told.

    With the Lagrangian ``L = J − ν·equalities − λ·inequalities``, its conditions ``F = (L_z, equalities,
    inequalities)`` and loads ``L_v``: ``(z, parameters, ν, λ) → F_z, F_v, L_v, L_vv``. The loads' slope in the
    multipliers stands in ``F_v`` already.
    """
    _, _, objective, equalities, inequalities = problem
    tensions, multipliers = ca.MX.sym("tensions", equalities.shape[0]), ca.MX.sym("multipliers", inequalities.shape[0])
    lagrangian = objective - ca.dot(tensions, equalities) - ca.dot(multipliers, inequalities)
    loads = ca.gradient(lagrangian, change)
    conditions = ca.vertcat(ca.gradient(lagrangian, problem.unknowns), equalities, inequalities)
    outputs = [
        ca.jacobian(conditions, problem.unknowns),
        ca.jacobian(conditions, change),
        loads,
        ca.jacobian(loads, change),
    ]
    outputs = [ca.substitute(output, change, ca.MX.zeros(change.shape)) for output in outputs]
    inputs = [problem.unknowns, problem.parameters, tensions, multipliers]
    return ca.Function("kkt_derivatives", inputs, outputs).expand()  # to scalars, which are faster to evaluate
