"""Model-predictive control of the force on an obstacle that moves periodically, as with breath."""

from dataclasses import dataclass

import numpy as np

from agents.controllers.mpc import PredictiveController

PERIODS = np.arange(14.0, 57.0, 1.0)  # candidates [steps]
OVERTONES = 2  # of the motion
WINDOW = 96  # latest readings that count
ENOUGH = 20  # readings from which on a period is looked for
CYCLES = 1.2  # of a period that must have been seen
EXPLAINED = 0.5  # largest share of the variance that may be left
MEMORY = 1.5  # of which past readings fade, in periods
RIDGE = 0.005  # weight of small amplitudes


@dataclass(slots=True)
class HarmonicController(PredictiveController):
    """Predictive control that also foresees a periodic part of the force.

    The force at a place of the cable is taken to be a line in the place and a Fourier series in time, whose period is
    the candidate that explains the latest readings best. What the series adds over the horizon is taken off the
    set-points.
    """

    name: str = "Harmonic"

    def _forecast(self, cable: float, horizon: int) -> tuple[float, float, np.ndarray]:
        series = self._series(cable, horizon) if len(self._readings) > ENOUGH else None
        return PredictiveController._forecast(self, cable, horizon) if series is None else series

    def _series(self, cable: float, horizon: int) -> tuple[float, float, np.ndarray] | None:
        """Return force and slope at a place now, and what the series adds in the next steps, ``(horizon,)``.

        None where no series explains much more than the line alone.
        """
        cables, forces = np.array(self._readings[-WINDOW:]).T
        since = np.array(self._steps[-WINDOW:]) - self._step
        prior = self._curve(cable)[1]
        level, best = forces - prior * (cables - cable), None
        for period in PERIODS[-since[0] > PERIODS * CYCLES]:
            weights = np.exp(since / (MEMORY * period))
            columns = np.column_stack([np.ones(len(since)), cables - cable, _waves(since, period)])
            ridge = np.array([0.0, RIDGE, *[RIDGE] * (columns.shape[1] - 2)]) * weights.sum()
            target = columns.T @ (weights * forces) + ridge * np.array([0.0, prior, *[0.0] * (columns.shape[1] - 2)])
            found = np.linalg.solve(columns.T @ (weights[:, None] * columns) + np.diag(ridge), target)
            left = forces - columns @ found
            alone = weights @ (level - weights @ level / weights.sum()) ** 2
            misfit = float(weights @ left**2 / max(alone, 1e-12))
            if best is None or misfit < best[0]:
                best = misfit, found, period
        if best is None or best[0] > EXPLAINED:
            return None
        _, (force, slope, *amplitudes), period = best
        steps = np.arange(horizon + 1)
        series = _waves(steps, period) @ np.array(amplitudes)
        return float(force + series[0]), float(slope), series[1:] - series[0]


def _waves(steps: np.ndarray, period: float) -> np.ndarray:
    """Return sines and cosines of a period and its overtones, ``(k, 2 · OVERTONES)``."""
    phases = 2 * np.pi * np.outer(steps, np.arange(1, OVERTONES + 1)) / period
    return np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
