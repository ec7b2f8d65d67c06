"""What a learned policy remembers of an episode beside what it sees now.

Latency and backlash hide the present, and the sensor's bias shows only while nothing touches: an observation alone is
not enough. The memory is fixed and small: a zero of the force sensor, the ratio of its readings to the virtual-work
estimate, which has no noise, past errors at four time scales, the last moves, and the latency and play that explain
where the cables are seen to be.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.controllers.lag import Lag, seen_cables
from ccr_gym import FORCE_SCALE_N, Settings

DECAYS = (0.0, 0.5, 0.8, 0.95)  # of the averages of past errors, per step
TINY = 1e-9
RATIO_DECAY = 0.97  # of readings that the ratio of sensor and estimate is fitted to
MOVES = 6  # last moves of the motors that are remembered
FINE_N = 0.002  # error that the logarithmic scale resolves
MOVE_SCALE = 28.0  # full increments over the whole range of a cable
MOVED = ("cable", "length")
ALL = slice(None)


class Memory:
    """Memories of many episodes side by side.

    Args:
        space: Space of one observation, a dictionary.
        count: Number N of episodes.
        settings: Of their environments.
    """

    def __init__(self, space: spaces.Dict, count: int, settings: Settings) -> None:
        sizes = {key: box.shape[0] for key, box in space.items() if box.shape}
        self._moved = [key for key in MOVED if key in sizes]
        moved, goal = sum(sizes[key] for key in self._moved), sizes["desired_force"]
        self._zero = np.zeros((count, sizes["force_measured"]))  # mean reading while nothing touched
        self._readings = np.zeros((count, 1))
        self._fit = np.zeros((count, 2))  # products of reading and estimate, squares of the estimate
        self._errors = np.zeros((count, len(DECAYS), 2 * goal))
        self._moves = np.zeros((count, MOVES, moved))
        self._places = np.full((count, moved), np.nan)
        self._settings, self._lag = settings, Lag(count, sizes["cable"])
        remembered = (
            sizes["force_measured"] + 1 + goal + len(DECAYS) * 2 * goal + MOVES * moved + 2 + 2 * sizes["cable"]
        )
        self.size = sum(sizes.values()) + remembered

    def forget(self, which: Any = ALL) -> None:
        """Begin new episodes."""
        for part in (self._zero, self._readings, self._fit, self._errors, self._moves):
            part[which] = 0.0
        self._places[which] = np.nan
        self._lag.forget(which)

    def recall(self, observation: Mapping[str, np.ndarray], which: Any = ALL) -> np.ndarray:
        """Take in what some episodes show now; what they show and have shown, ``(k, size)`` float32.

        Args:
            observation: Arrays ``(k, ...)``, one row for each of these episodes.
            which: The episodes, a slice or indices; each of them is at its next step.
        """
        touching = observation["contact"].any(axis=1, keepdims=True)
        measured, estimate = (observation[key].astype(float) for key in ("force_measured", "force_est"))
        desired = observation["desired_force"].astype(float)
        readings, zero, errors = self._readings[which] + ~touching, self._zero[which], self._errors[which]
        zero = zero + np.where(touching, 0.0, (measured - zero) / np.maximum(readings, 1.0))
        read = np.where(touching, measured - zero, 0.0)
        fit = RATIO_DECAY * self._fit[which] + np.stack([_size(read) * _size(estimate), _size(estimate) ** 2], axis=1)
        ratio = fit[:, :1] / np.maximum(fit[:, 1:], TINY)
        force = ratio * estimate
        if desired.shape[1] == 1:
            read, force = _size(read)[:, None], _size(force)[:, None]
        lacking = FORCE_SCALE_N * np.concatenate([desired - read, desired - force], axis=1)
        lacking = np.copysign(np.log1p(np.abs(lacking) / FINE_N), lacking)
        errors = errors + (1 - np.array(DECAYS)[:, None]) * (lacking[:, None] - errors)
        places = np.concatenate([observation[key] for key in self._moved], axis=1).astype(float)
        before = np.where(np.isnan(self._places[which]), places, self._places[which])
        moves = np.concatenate([MOVE_SCALE * (places - before)[:, None], self._moves[which][:, :-1]], axis=1)
        self._zero[which], self._readings[which], self._fit[which] = zero, readings, fit
        self._errors[which], self._places[which], self._moves[which] = errors, places, moves
        remembered = (zero, ratio, force, errors.reshape(len(errors), -1), moves.reshape(len(moves), -1))
        motors, lag = self._settings.cable_limit_mm * observation["cable"].astype(float), self._lag
        lag.see(motors, seen_cables(observation, self._settings.robot), which)
        here = lag.places[which]
        explained = (lag.latency[which][:, None], lag.slack[which][:, None], here - lag.seen[which], here - motors)
        return np.concatenate([*observation.values(), *remembered, *explained], axis=1).astype(np.float32)


def _size(vectors: np.ndarray) -> np.ndarray:
    """Magnitudes ``(k,)`` of ``(k, d)``."""
    return np.asarray(np.linalg.norm(vectors, axis=1))


class MemoryVecEnv(VecEnvWrapper):
    """Environments with dictionary observations, shown as rows that remember (:class:`Memory`).

    Attributes:
        shown: The present observations.
    """

    shown: dict[str, np.ndarray]

    def __init__(self, venv: VecEnv) -> None:
        assert isinstance(venv.observation_space, spaces.Dict)
        self._memory = Memory(venv.observation_space, venv.num_envs, venv.get_attr("settings", [0])[0])
        super().__init__(venv, spaces.Box(-np.inf, np.inf, (self._memory.size,), np.float32))

    def reset(self) -> np.ndarray:
        """Start episodes in all environments."""
        self._memory.forget()
        self.shown = self._dictionary(self.venv.reset())
        return self._memory.recall(self.shown)

    def step_wait(self) -> VecEnvStepReturn:
        """Move; where an episode ends, its last row is in ``terminal_observation`` and the next one begins."""
        told, rewards, dones, infos = self.venv.step_wait()
        self.shown = observation = self._dictionary(told)
        if not dones.any():
            return self._memory.recall(observation), rewards, dones, infos
        ended = np.flatnonzero(dones)
        last = {key: value.copy() for key, value in observation.items()}
        for key, value in last.items():
            value[ended] = [infos[i]["terminal_observation"][key] for i in ended]
        rows = self._memory.recall(last)
        for i in ended:
            infos[i]["terminal_observation"] = rows[i].copy()
        self._memory.forget(ended)
        rows[ended] = self._memory.recall({key: value[ended] for key, value in observation.items()}, ended)
        return rows, rewards, dones, infos

    @staticmethod
    def _dictionary(observation: Any) -> dict[str, np.ndarray]:
        assert isinstance(observation, dict)
        return observation
