"""The vector environment: a fleet behind Gymnasium's vector interface."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ccr_gym.checks import require
from ccr_gym.env import METADATA, Observation, single_spaces
from ccr_gym.fleet import Fleet, Truth
from ccr_gym.reward import TERMS
from ccr_gym.tasks import Task

Infos = dict[str, Any]


class ContactVectorEnv(VectorEnv[Observation, np.ndarray, np.ndarray]):
    """Many :class:`ccr_gym.env.ContactEnv` of one task, moved by one call of the solver.

    Seeded alike, it returns what ``gymnasium.vector.SyncVectorEnv`` of the single environments would.

    Args:
        task: What an episode asks.
        num_envs: Number of environments.
        max_episode_steps: Steps after which an episode is truncated; ``None`` for those of the task.
        autoreset_mode: What happens after the end of an episode: the next step resets (``"NextStep"``), the last step
            does (``"SameStep"``), or the caller (``"Disabled"``).
        threads: Threads of the solver; results do not depend on them.
        **settings: Fields of :class:`ccr_gym.settings.Settings`.

    Raises:
        ValueError: If an argument is out of range; the message names the bound.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        **settings: Any,
    ) -> None:
        max_episode_steps = task.steps if max_episode_steps is None else max_episode_steps
        require(max_episode_steps > 0, f"max_episode_steps is {max_episode_steps}; it must be positive")
        self.task, self.settings, self.num_envs = task, task.body.settings(**settings), num_envs
        self.max_episode_steps = max_episode_steps
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**METADATA, "autoreset_mode": self.autoreset_mode}
        self._fleet = Fleet(task, self.settings, num_envs, threads)
        self.single_observation_space, self.single_action_space = single_spaces(self._fleet, self.settings)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._steps = np.zeros(num_envs, int)
        self._ended = np.zeros(num_envs, bool)
        self._started = False

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Infos]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]``.

        Args:
            seed: Seed of the first environment, the others counting on; or one for each; ``None`` goes on drawing.
            options: ``{"reset_mask": (N,) bool}`` or nothing.

        Raises:
            ValueError: If there is not one seed for each environment, or the options are something else.
        """
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        require(len(seeds) == self.num_envs, f"seed has {len(seeds)} entries; it must have {self.num_envs}")
        mask = np.ones(self.num_envs, bool)
        if options:
            require(options.keys() == {"reset_mask"}, f"options has {sorted(options)}; it may have 'reset_mask' only")
            mask = np.asarray(options["reset_mask"])
            require(
                mask.shape == (self.num_envs,) and mask.dtype == bool and bool(mask.any()),
                f"reset_mask is {mask!r}; it must be an array of {self.num_envs} bools, one of them true",
            )
        require(self._started or bool(mask.all()), "the first reset must be of all environments")
        for i in np.flatnonzero(mask):
            if self._generators[i] is None or seeds[i] is not None:
                self._generators[i], _ = seeding.np_random(seeds[i])
        self._begin(np.flatnonzero(mask))
        self._started = True
        reading = self._fleet.read()
        terms = tuple(np.zeros((len(TERMS), self.num_envs)))
        return self._observation(self._fleet.observe(reading)), _masked(self._fleet.infos(reading, terms), mask)

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, Infos]:
        """Move the cables, and reset as the autoreset mode says.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset, or after the end of an episode if nothing resets it.
            ValueError: If the actions have the wrong shape or one is not finite; the state stays as it was.
        """
        disabled = self.autoreset_mode is AutoresetMode.DISABLED
        if not self._started or (disabled and self._ended.any()):
            raise gymnasium.error.ResetNeeded("call reset() before step(), with a reset_mask after the end of episodes")
        pulls = np.asarray(actions, dtype=float)
        shape = self.action_space.shape
        if pulls.shape != shape or not np.isfinite(pulls).all():
            raise ValueError(f"actions is {actions!r}; it must be finite numbers of shape {shape}")
        effort = self._fleet.body.effort(pulls)
        resetting, everything = self._ended.copy(), np.ones(self.num_envs, bool)
        if resetting.any():
            moving = np.flatnonzero(~resetting)
            self._fleet.step(effort[moving], moving.tolist())
            self._begin(np.flatnonzero(resetting))
        else:
            self._fleet.step(effort)
        self._steps += ~resetting
        reading = self._fleet.read()
        terms = self._fleet.rewards(reading)
        for term in terms:
            term[resetting] = 0.0
        truncated = self._steps >= self.max_episode_steps
        rows, infos = self._fleet.observe(reading), self._fleet.infos(reading, terms)
        self._ended = truncated.copy()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and truncated.any():
            rows, infos = self._restart(truncated, rows, infos, terms)
        else:
            infos = _masked(infos, everything)
        rewards = sum(terms)
        return self._observation(rows), rewards, np.zeros(self.num_envs, bool), truncated, infos

    @property
    def truth(self) -> Truth:
        """What no agent sees, of all environments."""
        return self._fleet.truth()

    def probe(self, places: np.ndarray) -> np.ndarray:
        """As :meth:`ccr_gym.fleet.Fleet.probe`."""
        return self._fleet.probe(places)

    def _restart(
        self, ended: np.ndarray, rows: np.ndarray, infos: Infos, terms: tuple[np.ndarray, ...]
    ) -> tuple[np.ndarray, Infos]:
        """Begin new episodes in the place of some that have ended, which are told of in ``final_obs, final_info``."""
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            final[i] = self._observation(rows[i])
        told: Infos = {"final_obs": final, "_final_obs": ended.copy(), "final_info": _masked(infos, ended)}
        told["_final_info"] = ended.copy()
        self._begin(np.flatnonzero(ended))
        self._ended = np.zeros(self.num_envs, bool)
        reading, everything = self._fleet.read(), np.ones(self.num_envs, bool)
        fresh = tuple(np.where(ended, 0.0, term) for term in terms)
        return self._fleet.observe(reading), _masked(self._fleet.infos(reading, fresh), everything) | told

    def _begin(self, robots: np.ndarray) -> None:
        names = robots.tolist()
        self._fleet.draw(names, [generator for i in names if (generator := self._generators[i]) is not None])
        self._steps[robots] = 0
        self._ended[robots] = False

    def _observation(self, rows: np.ndarray) -> Observation:
        return rows if self.settings.obs_mode == "flat" else self._fleet.observer.entries(rows)


def _masked(infos: Infos, mask: np.ndarray) -> Infos:
    """Gymnasium's form: zero where an environment tells nothing, and a mask beside every entry."""
    told: Infos = {}
    for key, value in infos.items():
        if isinstance(value, dict):
            told[key] = _masked(value, mask)
        else:
            told[key] = (
                value if mask.all() else np.where(mask.reshape(-1, *[1] * (value.ndim - 1)), value, value.dtype.type())
            )
        told[f"_{key}"] = mask.copy()
    return told
