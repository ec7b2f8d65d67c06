"""The law of one segment of the rod as tests/data/rod/README.md states it, for :class:`truth.kirchhoff.Rod`.

With it, IPOPT solves the robot that the package solves, with nothing of the package in it.
"""

import math

import casadi as ca
import numpy as np

TERMS = 10  # of series in |u|², which are smooth at u = 0


def segment(size: float, holes: list[np.ndarray]) -> ca.Function:
    """Return (r, q) at the end of a segment, its share of the integral of r, and how much each cable is shortened."""
    state, mean, tilt = ca.SX.sym("state", 7), ca.SX.sym("mean", 3), ca.SX.sym("tilt", 3)
    turn = size * mean
    chord = ca.vertcat(0, 0, size * _sinc(ca.sumsqr(turn[:2]) / 4))
    place = state[:3] + _rotate(state[3:], _rotate(_exp(turn / 2), chord))
    ahead = _rotate(_exp(turn / 2), chord)
    shortened = [size - ca.norm_2(ahead + _rotate(_exp(turn), ca.DM(hole)) - hole) for hole in holes]
    ends = ca.vertcat(place, _product(state[3:], _exp(turn)))
    return ca.Function("segment", [state, mean, tilt], [ends, size * (state[:3] + place) / 2, ca.vertcat(*shortened)])


def _sinc(square: ca.SX) -> ca.SX:
    return sum((-square) ** k / math.factorial(2 * k + 1) for k in range(TERMS))


def _exp(turn: ca.SX) -> ca.SX:
    """Return the quaternion of a rotation vector."""
    square = ca.sumsqr(turn) / 4
    cosine = sum((-square) ** k / math.factorial(2 * k) for k in range(TERMS))
    return ca.vertcat(cosine, _sinc(square) * turn / 2)


def _product(p: ca.SX, q: ca.SX) -> ca.SX:
    v, w = p[1:], q[1:]
    return ca.vertcat(p[0] * q[0] - ca.dot(v, w), p[0] * w + q[0] * v + ca.cross(v, w))


def _rotate(q: ca.SX, vector: ca.SX) -> ca.SX:
    across = 2 * ca.cross(q[1:], vector)
    return vector + q[0] * across + ca.cross(q[1:], across)
