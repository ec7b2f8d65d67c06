"""What a learned policy remembers of an episode, besides its present observation.

Latency and backlash hide the present state, and friction, rigidity and zeros of the sensors show only over time, so a
single observation is not enough. The memory is small and fixed: what is known of the robot and its contact force
(:class:`agents.estimation.robot.RobotEstimator`), past force errors at four time scales, and the last moves.
"""

from collections.abc import Mapping

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from agents.arguments import check_kind
from agents.environment import EnvIndex
from agents.estimation.candidates import ALL
from agents.estimation.robot import Knowledge, RobotEstimator
from ccr_gym import Settings, SpatialSettings

DECAYS = (0.0, 0.5, 0.8, 0.95)  # of the averages of past errors, per step
MOVES = 6  # remembered moves of the motors
FINE = 0.01  # force error that the logarithmic scale resolves [EI/L²]
MOVE_SCALE = 28.0  # full increments in the range of a cable
MOVED = ("cable", "length")
KEPT_OUT = ("share",)  # entries that the known force has in it
KNOWN = ("latency", "half_backlash", "loss", "rigidity", "rigidity_std", "force", "force_std")


class Memory:
    """Memories of many episodes in parallel.

    Args:
        space: Space of a single observation, a dictionary.
        count: Number N of episodes.
        settings: Settings of the environments.

    Attributes:
        size: Size of a row: an observation but for what the known force has in it, and its memory.
    """

    def __init__(self, space: spaces.Dict, count: int, settings: Settings | SpatialSettings) -> None:
        sizes = {key: box.shape[0] for key, box in space.items() if box.shape and key not in KEPT_OUT}
        self._moved = [key for key in MOVED if key in sizes]
        moved = sum(sizes[key] for key in self._moved)
        self._errors = np.zeros((count, len(DECAYS)))
        self._moves = np.zeros((count, MOVES, moved))
        self._motors = np.full((count, moved), np.nan)
        self._estimator, self._span = RobotEstimator(settings, count), settings.force_span
        self._range = settings.cable_limit_mm / settings.scales.travel_mm
        self.size = sum(sizes.values()) + len(KNOWN) + sizes["cable"] + len(DECAYS) + MOVES * moved

    def reset(self, index: EnvIndex = ALL) -> None:
        """Start new episodes."""
        self._errors[index] = self._moves[index] = 0.0
        self._motors[index] = np.nan
        self._estimator.reset(index)

    def update(self, observation: Mapping[str, np.ndarray], index: EnvIndex = ALL) -> np.ndarray:
        """Take in the next observations of some episodes; return them with their memory, ``(k, size)`` float32.

        Args:
            observation: Arrays ``(k, ...)``, one row per episode.
            index: The episodes.
        """
        known = self._estimator.update(observation, index)
        numbers = np.stack([getattr(known, name) for name in KNOWN], axis=1)
        behind = known.cables - self._range * observation["cable"].astype(float)
        errors, moves = self._update_errors(observation, known, index), self._update_moves(observation, index)
        seen = [entry for key, entry in observation.items() if key not in KEPT_OUT]
        return np.concatenate([*seen, numbers, behind, errors, moves], axis=1).astype(np.float32)

    def _update_errors(self, observation: Mapping[str, np.ndarray], known: Knowledge, index: EnvIndex) -> np.ndarray:
        """Return decaying averages of the force errors on a logarithmic scale, ``(k, decays)``."""
        missing = self._span * np.linalg.norm(observation["desired_force"].astype(float), axis=1) - known.force
        missing = np.copysign(np.log1p(np.abs(missing) / FINE), missing)
        errors = self._errors[index]
        errors = errors + (1 - np.array(DECAYS)) * (missing[:, None] - errors)
        self._errors[index] = errors
        return np.asarray(errors)

    def _update_moves(self, observation: Mapping[str, np.ndarray], index: EnvIndex) -> np.ndarray:
        """Return the last moves of the motors, ``(k, MOVES · moved)``."""
        motors = np.concatenate([observation[key] for key in self._moved], axis=1).astype(float)
        before = np.where(np.isnan(self._motors[index]), motors, self._motors[index])
        moves = np.concatenate([MOVE_SCALE * (motors - before)[:, None], self._moves[index][:, :-1]], axis=1)
        self._motors[index], self._moves[index] = motors, moves
        return moves.reshape(len(moves), -1)


class MemoryVecEnv(VecEnvWrapper):
    """Environments with dictionary observations, whose observations become rows with a :class:`Memory`.

    Args:
        venv: The environments, with ``obs_mode="dict"``.

    Attributes:
        shown: The present dictionary observations.
    """

    shown: dict[str, np.ndarray]

    def __init__(self, venv: VecEnv) -> None:
        check_kind("venv", venv, VecEnv, "give environments of Stable-Baselines3, such as SB3VecEnv")
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
