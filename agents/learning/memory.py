"""What a learned policy remembers of an episode, besides its present observation.

Latency and backlash hide the present state, and the bias of the force sensor shows only before contact, so a single
observation is not enough. The memory is small and fixed: the zero of the force sensor, the ratio of its readings to the
virtual-work estimate (which has no noise), past force errors at four time scales, the last moves, and the latency and
backlash that explain the observed displacements of the cables.
"""

from collections.abc import Mapping

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from agents.controllers.lag import ALL, LagEstimator, observed_commands
from agents.environment import EnvIndex
from ccr_gym import FORCE_SPAN, Settings, SpatialSettings

DECAYS = (0.0, 0.5, 0.8, 0.95)  # of the averages of past errors, per step
TINY = 1e-9
RATIO_DECAY = 0.97  # per step, of the readings that the ratio of sensor and estimate is fitted to
MOVES = 6  # remembered moves of the motors
FINE = 0.01  # force error that the logarithmic scale resolves [EI/L²]
MOVE_SCALE = 28.0  # full increments in the range of a cable
MOVED = ("cable", "length")


class Memory:
    """Memories of many episodes in parallel.

    Args:
        space: Space of a single observation, a dictionary.
        count: Number N of episodes.
        settings: Settings of the environments.

    Attributes:
        size: Size of a row: an observation and its memory.
    """

    def __init__(self, space: spaces.Dict, count: int, settings: Settings | SpatialSettings) -> None:
        sizes = {key: box.shape[0] for key, box in space.items() if box.shape}
        self._moved = [key for key in MOVED if key in sizes]
        moved, goal = sum(sizes[key] for key in self._moved), sizes["desired_force"]
        self._zero = np.zeros((count, sizes["force_measured"]))  # mean reading before contact
        self._readings = np.zeros((count, 1))  # number of these readings
        self._fit = np.zeros((count, 2))  # sums of reading × estimate and of estimate²
        self._errors = np.zeros((count, len(DECAYS), 2 * goal))
        self._moves = np.zeros((count, MOVES, moved))
        self._motors = np.full((count, moved), np.nan)
        self._robot, self._range = settings.robot, settings.cable_limit_mm / settings.scales.travel_mm
        self._lag = LagEstimator(count, sizes["cable"])
        remembered = (
            sizes["force_measured"] + 1 + goal + len(DECAYS) * 2 * goal + MOVES * moved + 2 + 2 * sizes["cable"]
        )
        self.size = sum(sizes.values()) + remembered

    def reset(self, index: EnvIndex = ALL) -> None:
        """Start new episodes."""
        for part in (self._zero, self._readings, self._fit, self._errors, self._moves):
            part[index] = 0.0
        self._motors[index] = np.nan
        self._lag.reset(index)

    def update(self, observation: Mapping[str, np.ndarray], index: EnvIndex = ALL) -> np.ndarray:
        """Take in the next observations of some episodes; return them with their memory, ``(k, size)`` float32.

        Args:
            observation: Arrays ``(k, ...)``, one row per episode.
            index: The episodes.
        """
        force = self._update_force(observation, index)
        moves = self._update_moves(observation, index)
        lag = self._update_lag(observation, index)
        return np.concatenate([*observation.values(), *force, moves, *lag], axis=1).astype(np.float32)

    def _update_force(self, observation: Mapping[str, np.ndarray], index: EnvIndex) -> tuple[np.ndarray, ...]:
        """Return the zero of the sensor, its ratio to the estimate, the scaled estimate and past errors."""
        touching = observation["contact"].any(axis=1, keepdims=True)
        measured, estimate = (observation[key].astype(float) for key in ("force_measured", "force_est"))
        desired = observation["desired_force"].astype(float)
        readings, zero = self._readings[index] + ~touching, self._zero[index]
        zero = zero + np.where(touching, 0.0, (measured - zero) / np.maximum(readings, 1.0))
        reading = np.where(touching, measured - zero, 0.0)
        fit = RATIO_DECAY * self._fit[index] + np.stack(
            [_size(reading) * _size(estimate), _size(estimate) ** 2], axis=1
        )
        ratio = fit[:, :1] / np.maximum(fit[:, 1:], TINY)
        force = ratio * estimate
        if desired.shape[1] == 1:  # the set-point is a magnitude
            reading, force = _size(reading)[:, None], _size(force)[:, None]
        self._zero[index], self._readings[index], self._fit[index] = zero, readings, fit
        errors = self._averaged(np.concatenate([desired - reading, desired - force], axis=1), index)
        return zero, ratio, force, errors.reshape(len(errors), -1)

    def _averaged(self, missing: np.ndarray, index: EnvIndex) -> np.ndarray:
        """Return decaying averages of the force errors on a logarithmic scale, ``(k, decays, ...)``."""
        missing = FORCE_SPAN * missing
        missing = np.copysign(np.log1p(np.abs(missing) / FINE), missing)
        errors = self._errors[index]
        errors = errors + (1 - np.array(DECAYS)[:, None]) * (missing[:, None] - errors)
        self._errors[index] = errors
        return errors

    def _update_moves(self, observation: Mapping[str, np.ndarray], index: EnvIndex) -> np.ndarray:
        """Return the last moves of the motors, ``(k, MOVES · moved)``."""
        motors = np.concatenate([observation[key] for key in self._moved], axis=1).astype(float)
        before = np.where(np.isnan(self._motors[index]), motors, self._motors[index])
        moves = np.concatenate([MOVE_SCALE * (motors - before)[:, None], self._moves[index][:, :-1]], axis=1)
        self._motors[index], self._moves[index] = motors, moves
        return moves.reshape(len(moves), -1)

    def _update_lag(self, observation: Mapping[str, np.ndarray], index: EnvIndex) -> tuple[np.ndarray, ...]:
        """Return latency, half backlash, and the present cables relative to the observed ones and to the motors."""
        motors, lag = self._range * observation["cable"].astype(float), self._lag
        lag.update(motors, observed_commands(observation, self._robot), index)
        cables, observed = lag.cables[index], lag.observed[index]
        return lag.latency[index][:, None], lag.half_backlash[index][:, None], cables - observed, cables - motors


def _size(vectors: np.ndarray) -> np.ndarray:
    """Return the magnitudes ``(k,)`` of vectors ``(k, d)``."""
    return np.asarray(np.linalg.norm(vectors, axis=1))


class MemoryVecEnv(VecEnvWrapper):
    """Environments with dictionary observations, whose observations become rows with a :class:`Memory`.

    Args:
        venv: The environments, with ``obs_mode="dict"``.

    Attributes:
        shown: The present dictionary observations.
    """

    shown: dict[str, np.ndarray]

    def __init__(self, venv: VecEnv) -> None:
        assert isinstance(venv.observation_space, spaces.Dict)
        settings = venv.get_attr("settings", [0])[0]
        self._memory = Memory(venv.observation_space, venv.num_envs, settings)
        super().__init__(venv, spaces.Box(-np.inf, np.inf, (self._memory.size,), np.float32))

    def reset(self) -> np.ndarray:
        """Start episodes in all environments."""
        self._memory.reset()
        self.shown = _dictionary(self.venv.reset())
        return self._memory.update(self.shown)

    def step_wait(self) -> VecEnvStepReturn:
        """Return the results of a step; at the end of an episode its last row is in ``terminal_observation``."""
        observation, rewards, dones, infos = self.venv.step_wait()
        self.shown = _dictionary(observation)
        if not dones.any():
            return self._memory.update(self.shown), rewards, dones, infos
        ended = np.flatnonzero(dones)
        last = {key: value.copy() for key, value in self.shown.items()}
        for key, value in last.items():
            value[ended] = [infos[i]["terminal_observation"][key] for i in ended]
        rows = self._memory.update(last)
        for i in ended:
            infos[i]["terminal_observation"] = rows[i].copy()
        self._memory.reset(ended)
        rows[ended] = self._memory.update({key: value[ended] for key, value in self.shown.items()}, ended)
        return rows, rewards, dones, infos


def _dictionary(observation: VecEnvObs) -> dict[str, np.ndarray]:
    assert isinstance(observation, dict)
    return observation
