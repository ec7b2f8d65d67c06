"""Formulas of a step of an environment: reward terms, and factors of the force estimates.

They are written once, for numbers, for arrays and for CasADi's expressions: the kernel's C code is generated from them.
"""

import math
from collections.abc import Sequence
from typing import Any

import casadi as ca

from solver.common.operations import SYMBOLS, Operations

Number = Any  # a float, an array (...,) or an expression
TINY = 1e-300  # keeps quotients defined where nothing touches
ACCURACY_RATE = 20.0  # of the decay of ``accuracy``, per relative force error
CLEARANCE_SPAN = 5 / 9  # of ``approach`` [L]


def reward_terms(
    weights: Sequence[Number],
    force: Number,
    desired: Number,
    error: Number,
    clearance: Number,
    effort: Number,
    operations: Operations,
) -> tuple[Number, ...]:
    """Return the weighted terms of the reward: force error, accuracy, overshoot, approach and effort.

    Args:
        weights: Their weights, in this order.
        force: Magnitude of the contact force, zero without contact [N].
        desired: Magnitude of the desired force [N].
        error: Relative force error.
        clearance: Smallest gap over the robot's length.
        effort: Mean square of the action.
        operations: Operations on such values.
    """
    low, high, where = operations.minimum, operations.maximum, operations.where
    of_error, of_accuracy, of_overshoot, of_approach, of_effort = weights
    return (
        -of_error * low(error, 1.0),
        of_accuracy * operations.exp(-ACCURACY_RATE * error),
        -of_overshoot * low(high(force / desired - 1.0, 0.0), 1.0),
        -of_approach * where(force > 0, 0.0, low(high(clearance, 0.0) / CLEARANCE_SPAN, 1.0)),
        -of_effort * effort,
    )


def work_factor(product: Number, square: Number, least: Number, operations: Operations) -> Number:
    """Return the factor c ≥ 0 for which the works ``c w`` fit those ``v`` that lack, by least squares.

    Args:
        product: Sum of the products ``w v``.
        square: Sum of the squares of ``w``.
        least: Least size of ``w``; smaller ones are taken for it.
        operations: Operations on such values.
    """
    high = operations.maximum
    return high(product, 0.0) / high(high(square, least * least), TINY)


def planar_work(force: Sequence[Number], load: Number, slopes: Sequence[Number], operations: Operations) -> Number:
    """Return the factor c for which a force does the virtual work of a cable load, ``c F·x' = a P_l φ'`` (eq. 11).

    It is zero for a force that does no work against the motion.

    Args:
        force: Force along x and y [N].
        load: Cable load over its lever ``a P_l`` [N mm].
        slopes: Slopes of the free tip's x, y and angle [mm, mm, rad per mm].
        operations: Operations on such values.
    """
    work = force[0] * slopes[0] + force[1] * slopes[1]
    return load * slopes[2] / operations.where(work < 0, work, -math.inf)


def spatial_work(
    force: Sequence[Number], loads: Sequence[Number], slopes: Sequence[Sequence[Number]], operations: Operations
) -> Number:
    """Return the same in space, of both cable loads; the slopes are those of a free tip in both displacements.

    Args:
        force: Force [N].
        loads: Loads of both pairs of cables, signed as their displacements [N].
        slopes: For each displacement those of x, y and z, and of the turn towards each cable times the offset.
        operations: Operations on such values.
    """
    works = [_dot(force, along[:3]) for along in slopes]
    given = [_dot(loads, along[3:]) for along in slopes]
    return work_factor(-_dot(works, given), _dot(works, works), 0.0, operations)


def turned(force: Sequence[Number], friction: Number) -> tuple[Number, Number]:
    """Return a normal force of the plane with friction μ along the normal turned by +90°."""
    x, y = force
    return x - friction * y, y + friction * x


def slid(
    force: Sequence[Number], slopes: Sequence[Sequence[Number]], friction: Number, operations: Operations
) -> list[Number]:
    """Return a normal force in space with friction μ added in the direction in which the free tip would slide."""
    size = operations.sqrt(_dot(force, force))
    normal = [component / operations.maximum(size, TINY) for component in force]
    against = [-_dot(normal, along[:3]) for along in slopes]  # how each displacement moves the tip into the surface
    motion = [_dot(against, [along[k] for along in slopes]) for k in range(3)]
    inwards = _dot(motion, normal)
    slip = [part - inwards * component for part, component in zip(motion, normal, strict=True)]
    length = operations.maximum(operations.sqrt(_dot(slip, slip)), TINY)
    return [own + friction * size * part / length for own, part in zip(force, slip, strict=True)]


def functions() -> list[ca.Function]:
    """Return the laws, and their slopes in their inputs, as CasADi functions; see ``transition/laws.hpp``."""
    weights, friction = ca.SX.sym("weights", 5), ca.SX.sym("friction")
    inputs = {size: ca.SX.sym("inputs", size) for size in (3, 5, 6, 15)}
    parts = {size: ca.vertsplit(vector) for size, vector in inputs.items()}
    force, desired, error, clearance, effort = parts[5]
    terms = ca.vertcat(*reward_terms(ca.vertsplit(weights), force, desired, error, clearance, effort, SYMBOLS))
    product, square, least = parts[3]
    x, y, load, *slopes = parts[6]
    in_plane = planar_work(turned((x, y), friction), load, slopes, SYMBOLS)
    normal, loads, alongs = parts[15][:3], parts[15][3:5], (parts[15][5:10], parts[15][10:])
    in_space = spatial_work(slid(normal, alongs, friction, SYMBOLS), loads, alongs, SYMBOLS)
    return [
        ca.Function("ccr_reward_terms", [weights, inputs[5]], [terms]),
        ca.Function("ccr_reward_slopes", [weights, inputs[5]], [_slopes(ca.SX(terms), inputs[5])]),
        *_with_slopes("ccr_work_factor", inputs[3], [], work_factor(product, square, least, SYMBOLS)),
        *_with_slopes("ccr_planar_work", inputs[6], [friction], in_plane),
        *_with_slopes("ccr_spatial_work", inputs[15], [friction], in_space),
    ]


def _with_slopes(name: str, inputs: ca.SX, constants: list[ca.SX], law: ca.SX) -> list[ca.Function]:
    """Return a law and its slopes in its inputs."""
    arguments = [inputs, *constants]
    return [ca.Function(name, arguments, [law]), ca.Function(f"{name}_slopes", arguments, [_slopes(law, inputs)])]


def _slopes(law: ca.SX, inputs: ca.SX) -> ca.SX:
    return ca.densify(ca.jacobian(law, inputs))


def _dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    """Return a dot product, added term by term."""
    total = a[0] * b[0]
    for left, right in zip(a[1:], b[1:], strict=True):
        total = total + left * right
    return total
