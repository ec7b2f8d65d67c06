"""The node-coordinate problem (eq. 5 or 13, or the rod's) as a symbolic problem, and its derivatives."""

from typing import NamedTuple

import casadi as ca

from solver.common.gap_laws import GapLaw, PointGaps


class NodeProblem(NamedTuple):
    """Problem in node coordinates, symbolic; built by ``node_problem`` of the planar and spatial formulations.

    Attributes:
        unknowns: Points of backbone and disks at nodes 1…n, then displacements of the obstacles on springs [mm].
        parameters: Cable displacements, length and robot constants, then the shapes of the obstacles, one after the
            other, then the stiffness of their springs.
        objective: Sum of squared disk angles, or elastic energy and potential of the loads of a rod over
            ``B = EI / 2 l0``, and the energy of the springs over B [rad²].
        equalities: Zero when every segment has its shape [mm].
        limits: Not negative [mm]: of a rod the slack of each cable, then the gaps between its disks.
        gaps: Gaps of every point that can touch, except node 0, to every obstacle, ordered (obstacle, line, position).
    """

    unknowns: ca.MX
    parameters: ca.MX
    objective: ca.MX
    equalities: ca.MX
    limits: ca.MX
    gaps: list[PointGaps]

    @property
    def inequalities(self) -> ca.MX:
        """Limits, then gaps: not negative [mm]."""
        return ca.vertcat(self.limits, *(gaps.values() for gaps in self.gaps))


def norms(columns: ca.MX) -> ca.MX:
    """Return the lengths of the columns."""
    return ca.sqrt(ca.sum1(columns**2))


def subdivide(line: ca.MX, between: int) -> ca.MX:
    """Return the points of a line with ``between`` evenly spaced ones added between every two."""
    pieces = [line[:, :-1] + k / (between + 1) * (line[:, 1:] - line[:, :-1]) for k in range(between + 1)]
    return ca.horzcat(ca.reshape(ca.vertcat(*pieces), line.shape[0], -1), line[:, -1])


def grow(law: GapLaw, shape: ca.MX, growth: ca.MX) -> ca.MX:
    """Return the shape parameters of an obstacle that grew outwards by a length."""
    return shape + growth * ca.DM([k in law.growth for k in range(law.size)])


def first_derivatives(problem: NodeProblem) -> ca.Function:
    """Return ``(unknowns, parameters) → ∇J, equalities, their Jacobian, inequalities, theirs`` of a problem."""
    outputs = [
        ca.gradient(problem.objective, problem.unknowns),
        problem.equalities,
        ca.jacobian(problem.equalities, problem.unknowns),
        problem.inequalities,
        ca.vertcat(ca.jacobian(problem.limits, problem.unknowns), _gap_slopes(problem)),
    ]
    return ca.Function("first_derivatives", [problem.unknowns, problem.parameters], outputs).expand()


def _gap_slopes(problem: NodeProblem) -> ca.MX:
    """Return the Jacobian of the gaps, by the chain rule, which is far faster to build than by all laws at once."""
    if not problem.gaps:
        return ca.MX(0, problem.unknowns.shape[0])
    points = ca.horzcat(*(gaps.points for gaps in problem.gaps))
    slopes = ca.horzcat(*(gaps.slopes() for gaps in problem.gaps))
    along = ca.horzcat(*(ca.diag(slope) for slope in ca.vertsplit(slopes)))
    return along @ ca.jacobian(ca.vec(points.T), problem.unknowns)


def second_derivatives(problem: NodeProblem, change: ca.MX) -> ca.Function:
    """Return the derivatives of the optimality conditions of a problem in its unknowns and in a change of parameters.

    The Lagrangian ``L = J − ν·equalities − λ·inequalities`` has the conditions ``F = (L_z, equalities, inequalities)``
    and the loads ``L_v``; the result is ``(z, parameters, ν, λ) → F_z, F_v, L_v, L_vv``. The slope of the loads in the
    multipliers is part of ``F_v`` already.

    Args:
        problem: The problem, built with the change.
        change: The symbol ``v`` of the change, which is zero at the solution.
    """
    objective, equalities, inequalities = problem.objective, problem.equalities, problem.inequalities
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
