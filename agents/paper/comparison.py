"""Four predictions of Table 1, {paper, rod} × {energy, virtual work}, beside the null model and the paper's column.

P_l is a hung weight whose datum is the onset of contact, so a model is read at the tension ``T = T_onset + P_l``. No
prediction has a constant fitted to the table. Where one factor is fitted, by least squares, it is also judged by the
measurements it has not seen: each of the 28 left out in turn, and each of the four distances.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from agents.paper import published
from agents.paper.model import ROBOT, ROD, STEP_MM
from agents.paper.published import LOADS, MEASURED
from solver import Equilibrium, Robot, Solver, VirtualWork, force_true

GRAM_FORCE = 9.80665e-3  # [N]
MAX_CABLE_MM = 40.0  # for a soft robot to carry the largest load
RIGIDITIES = (1500.0, 2500.0, 5000.0, 10_000.0, 20_000.0)  # [N·mm²]; the paper prints none
NULL, COLUMN = "null model F = c·P_l, no physics", "the paper's column"


@dataclass(frozen=True, slots=True)
class Score:
    """How well a prediction meets the 28 measurements of Table 1.

    Attributes:
        ratio: Mean of F/P_l.
        error: Mean absolute error [gf]; NaN where there is no prediction before a fit.
        factor: Best factor by least squares.
        fitted: Mean absolute error with this factor [gf].
        left_out: The same of each measurement, with the factor of the other 27 [gf].
        left_out_distance: The same of each distance, with the factor of the other three [gf].
    """

    ratio: float
    error: float
    factor: float
    fitted: float
    left_out: float
    left_out_distance: float


def predictions() -> dict[str, np.ndarray]:
    """Return the force on the load cell by every model and estimate, at Table 1's distances and loads, (4, 7) [gf]."""
    return {
        f"{name}, {estimate}": forces
        for name, robot in (("paper model", ROBOT), ("rod", ROD))
        for estimate, forces in read(robot).items()
    }


def read(robot: Robot) -> dict[str, np.ndarray]:
    """Return the energy force of a robot, and its estimate by virtual work with μ = 0, each ``(4, 7)`` [gf]."""
    read_off = np.array([_read_at(robot, distance) for distance in published.MEASURED_G])
    return {"energy force": read_off[:, 0], "virtual work, μ = 0": read_off[:, 1]}


def _read_at(robot: Robot, distance_mm: float) -> list[np.ndarray]:
    """Return both forces at a distance, read at Table 1's loads on the way of a pull, each ``(7,)`` [gf]."""
    states = _touching(robot, distance_mm)
    load = [0.0, *((state.tension - state.onset_tension) / GRAM_FORCE for state in states)]
    estimates = (force_true, VirtualWork().estimate)
    return [
        np.interp(LOADS, load, [0.0, *(-estimate(state)[0, 0] / GRAM_FORCE for state in states)])
        for estimate in estimates
    ]


def _touching(robot: Robot, distance_mm: float) -> list[Equilibrium]:
    """Return the equilibria at the load cell, up to the largest load."""
    solver = Solver(robot, published.load_cell(distance_mm))
    state, states = solver.rest(), list[Equilibrium]()
    limit = LOADS[-1] * GRAM_FORCE
    while not states or states[-1].tension - states[-1].onset_tension < limit:
        state = solver.step(state, state.cable_mm + STEP_MM)
        if state.contact.any():
            states.append(state)
    return states


def scores() -> dict[str, Score]:
    """Return the score of every prediction, of the null model and of the paper's column.

    The column was calibrated with one measurement, which its error leaves out.
    """
    column = np.tile(published.THEORETICAL_G, (len(MEASURED), 1))
    others = ~published.is_calibration()
    return {
        **{name: score(forces) for name, forces in predictions().items()},
        NULL: score(np.tile(LOADS, (len(MEASURED), 1)), is_prediction=False),
        COLUMN: Score(float(np.mean(column / LOADS)), _error(column[others], MEASURED[others]), *4 * [math.nan]),
    }


def energy_scores_by_rigidity(robot: Robot) -> list[Score]:
    """Return the score of a robot's energy force for each of :data:`RIGIDITIES`."""
    robots = [replace(robot, rigidity=rigidity, max_cable_mm=MAX_CABLE_MM) for rigidity in RIGIDITIES]
    return [score(read(robot)["energy force"]) for robot in robots]


def score(forces: np.ndarray, is_prediction: bool = True) -> Score:
    """Return the score of predicted forces ``(4, 7)`` [gf]; without a fit only if they are a prediction as they are."""
    factor = best_factor(forces, MEASURED)
    singles = [np.arange(MEASURED.size).reshape(MEASURED.shape) == k for k in range(MEASURED.size)]
    distances = [np.arange(len(MEASURED)) == k for k in range(len(MEASURED))]
    return Score(
        ratio=float(np.mean(forces / LOADS)) if is_prediction else factor,
        error=_error(forces, MEASURED) if is_prediction else math.nan,
        factor=factor,
        fitted=_error(factor * forces, MEASURED),
        left_out=_left_out(forces, singles),
        left_out_distance=_left_out(forces, distances),
    )


def best_factor(forces: np.ndarray, measured: np.ndarray) -> float:
    """Return the factor c that makes c times the forces meet measurements best, by least squares."""
    return float(np.sum(forces * measured) / np.sum(forces**2))


def _left_out(forces: np.ndarray, parts: Iterable[np.ndarray]) -> float:
    """Return the mean error of parts of the table, each with the factor of all the rest [gf]."""
    return float(
        np.mean([_error(best_factor(forces[~part], MEASURED[~part]) * forces[part], MEASURED[part]) for part in parts])
    )


def _error(forces: np.ndarray, measured: np.ndarray) -> float:
    return float(np.abs(forces - measured).mean())
