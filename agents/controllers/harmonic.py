"""Model-predictive control of the force on an obstacle that moves periodically, as with breath."""

from dataclasses import dataclass

import numpy as np

from agents.controllers.mpc import PredictiveController

PERIODS = np.arange(14.0, 57.0, 1.0)  # candidates [steps]
OVERTONES = 2  # of the motion
ENOUGH = 20  # readings from which on a period is looked for
CYCLES = 1.2  # of a period that must have been seen
LEAST = 0.3  # share of the variance that a series must explain
SMALLEST_SUM = 1e-12
MEMORY = 1.5  # of which past readings fade, in periods
RIDGE = 0.005  # weight of small amplitudes


@dataclass(slots=True)
class HarmonicController(PredictiveController):
    """Predictive control that also foresees a periodic part of the force.

    What the curve through the forces so far leaves over is taken to be a Fourier series in time, whose period is the
    candidate that explains the latest readings best; as breaths vary, older ones fade. What the series adds over the
    horizon is taken off the set-points, by the share of the variance that it explains.
    """

    name: str = "Harmonic"

    def _forecast(self, cable: float, horizon: int) -> tuple[float, float, np.ndarray]:
        force, slope, ahead = PredictiveController._forecast(self, cable, horizon)
        if len(self._readings) > ENOUGH:
            series = self._series(cable, force, slope, horizon)
            force, ahead = force + series[0], series[1:] - series[0]
        return force, slope, ahead

    def _series(self, cable: float, force: float, slope: float, horizon: int) -> np.ndarray:
        """Return what the series adds to a curve now and in the next steps, ``(horizon + 1,)`` [EI/L²]."""
        since, best = np.array(self._steps) - self._step, (LEAST, np.zeros(horizon + 1))
        away, forces = np.array(self._readings).T - [[cable], [0.0]]
        near, left = self._nearness(away), forces - force - slope * self._bend(away)
        for period in PERIODS[-since[0] > PERIODS * CYCLES]:
            weights, waves = near * np.exp(since / (MEMORY * period)), _waves(since, period)
            inner = (waves.T * weights) @ waves + RIDGE * weights.sum() * np.eye(waves.shape[1])
            amplitudes = np.linalg.solve(inner, waves.T @ (weights * left))
            explained = 1 - weights @ (left - waves @ amplitudes) ** 2 / max(weights @ left**2, SMALLEST_SUM)
            if explained > best[0]:
                best = explained, explained * _waves(np.arange(horizon + 1), period) @ amplitudes
        return best[1]


def _waves(steps: np.ndarray, period: float) -> np.ndarray:
    """Return sines and cosines of a period and its overtones, ``(k, 2 · OVERTONES)``."""
    phases = 2 * np.pi * np.outer(steps, np.arange(1, OVERTONES + 1)) / period
    return np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
