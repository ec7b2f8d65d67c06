"""The vector environment: a fleet behind Gymnasium's vector interface."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ccr_gym.checks import (
    as_array,
    check_array,
    check_choice,
    check_seed,
    check_type,
    check_whole,
    refusal,
    require,
)
from ccr_gym.env import METADATA, Observation, make_settings, single_spaces
from ccr_gym.episodes import EpisodeBatch, PrivilegedState
from ccr_gym.reward import TERMS
from ccr_gym.tasks import Task
from solver.common.validation import is_listed, shown

Infos = dict[str, Any]
MAX_ENVS = 65_536
MAX_STEPS = 2**31 - 1
THREADS_PER_CORE = 4
ARGUMENTS = ("task", "num_envs", "max_episode_steps", "autoreset_mode", "threads", "render_mode")


class ContactVectorEnv(VectorEnv[Observation, np.ndarray, np.ndarray]):
    """Many :class:`ccr_gym.env.ContactEnv` of one task, moved by one call of the solver.

    Seeded alike, it returns what ``gymnasium.vector.SyncVectorEnv`` of the single environments would.

    Args:
        task: What an episode asks.
        num_envs: Number of environments, up to 65 536.
        max_episode_steps: Steps after which an episode is truncated; ``None`` for those of the task.
        autoreset_mode: What happens after the end of an episode: the next step resets (``"NextStep"``), the last step
            does (``"SameStep"``), or the caller (``"Disabled"``).
        threads: Threads of the solver, up to four for each core of the machine; results do not depend on them.
        render_mode: ``None``; only single environments are rendered.
        **settings: Fields of :class:`ccr_gym.settings.Settings`.

    Raises:
        TypeError: If there is no argument of that name, or one should be an object of another class.
        ValueError: If an argument is out of range; the message names the bound.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        render_mode: None = None,
        **settings: Any,
    ) -> None:
        require(render_mode is None, f"render_mode is {shown(render_mode)}; use vectorization_mode='sync' to render")
        self.task, self.settings = task, make_settings(type(self).__name__, task, settings, ARGUMENTS)
        self.num_envs = num_envs = check_whole("num_envs", num_envs, low=1, high=MAX_ENVS)
        most = THREADS_PER_CORE * (os.cpu_count() or 1)
        reason = f"{THREADS_PER_CORE} for each core of this machine"
        threads = check_whole("threads", threads, low=1, high=most, reason=reason)
        steps = task.steps if max_episode_steps is None else max_episode_steps
        self.max_episode_steps = check_whole("max_episode_steps", steps, low=1, high=MAX_STEPS)
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**METADATA, "autoreset_mode": self.autoreset_mode}
        self._episodes = EpisodeBatch(task, self.settings, num_envs, threads)
        self.single_observation_space, self.single_action_space = single_spaces(self._episodes, self.settings)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._shape = (num_envs, self._episodes.body.actions)
        self._steps = np.zeros(num_envs, int)
        self._ended = np.zeros(num_envs, bool)
        self._started = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Infos]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]``.

        A reset that raises changes nothing: neither the episodes nor the generators.

        Args:
            seed: Seed of the first environment, the others counting on; or one for each; ``None`` goes on drawing.
            options: ``{"reset_mask": (N,) bool}`` or nothing.

        Raises:
            RuntimeError: If the task and the robot do not fit: no draw of many is feasible.
            TypeError: If the options are no mapping.
            ValueError: If there is not one seed for each environment, or the options are something else.
        """
        seeds, mask = self._seeds(seed), self._mask(options)
        generators = list(self._generators)
        for i in np.flatnonzero(mask):
            if generators[i] is None or seeds[i] is not None:
                generators[i], _ = seeding.np_random(seeds[i])
        self._begin(np.flatnonzero(mask), generators)
        self._generators = generators
        self._started = True
        reading = self._episodes.read()
        terms = tuple(np.zeros((len(TERMS), self.num_envs)))
        return self._observation(self._episodes.observe(reading)), _masked(self._episodes.infos(reading, terms), mask)

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, Infos]:
        """Move the cables, and reset as the autoreset mode says.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset, or after the end of an episode if nothing resets it.
            ValueError: If the actions are not finite real numbers of the right shape; the state stays as it was.
        """
        disabled = self.autoreset_mode is AutoresetMode.DISABLED
        if not self._started or (disabled and self._ended.any()):
            raise gymnasium.error.ResetNeeded("call reset() before step(), with a reset_mask after the end of episodes")
        effort = self._episodes.body.effort(check_array("actions", actions, self._shape))
        resetting, everything = self._ended.copy(), np.ones(self.num_envs, bool)
        if resetting.any():
            self._begin(np.flatnonzero(resetting), self._generators)  # first: if no scene is found, nothing has moved
            moving = np.flatnonzero(~resetting)
            self._episodes.step(effort[moving], moving.tolist())
        else:
            self._episodes.step(effort)
        self._steps += ~resetting
        reading = self._episodes.read()
        terms = self._episodes.rewards(reading)
        for term in terms:
            term[resetting] = 0.0
        truncated = self._steps >= self.max_episode_steps
        rows, infos = self._episodes.observe(reading), self._episodes.infos(reading, terms)
        self._ended = truncated.copy()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and truncated.any():
            rows, infos = self._restart(truncated, rows, infos, terms)
        else:
            infos = _masked(infos, everything)
        rewards = sum(terms)
        return self._observation(rows), rewards, np.zeros(self.num_envs, bool), truncated, infos

    @property
    def privileged_state(self) -> PrivilegedState:
        """What no agent sees, of all environments.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("privileged_state")
        return self._episodes.privileged_state()

    def probe(self, places: np.ndarray) -> np.ndarray:
        """As :meth:`ccr_gym.episodes.EpisodeBatch.probe`.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the places are not finite real numbers of the right shape.
        """
        self._check_started("probe")
        return self._episodes.probe(check_array("places", places, self._shape))

    def _check_started(self, asked: str) -> None:
        if not self._started:
            raise gymnasium.error.ResetNeeded(f"call reset() before {asked}")

    def _seeds(self, seed: Any) -> list[int | None]:
        """One seed for each environment, or ``None``."""
        if is_listed(seed):
            require(len(seed) == self.num_envs, f"seed has {len(seed)} entries; it must have {self.num_envs}")
            return [check_seed(f"seed[{i}]", entry) for i, entry in enumerate(seed)]
        first = check_seed("seed", seed)
        return [None if first is None else first + i for i in range(self.num_envs)]

    def _mask(self, options: Any) -> np.ndarray:
        """Which environments to reset."""
        wanted = "None, or a mapping of 'reset_mask' only"
        check_type("options", options, Mapping | None, wanted)
        if not options:
            return np.ones(self.num_envs, bool)
        if set(options) != {"reset_mask"}:
            raise refusal("options", options, wanted)
        mask = as_array(options["reset_mask"])
        if not (mask.shape == (self.num_envs,) and mask.dtype == bool and mask.any()):
            raise refusal("reset_mask", options["reset_mask"], f"an array of {self.num_envs} bools, one of them true")
        require(self._started or bool(mask.all()), "reset_mask is not all true; the first reset must be of all")
        return mask

    def _restart(
        self, ended: np.ndarray, rows: np.ndarray, infos: Infos, terms: tuple[np.ndarray, ...]
    ) -> tuple[np.ndarray, Infos]:
        """Begin new episodes in the place of some that have ended, which are told of in ``final_obs, final_info``."""
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            final[i] = self._observation(rows[i])
        told: Infos = {"final_obs": final, "_final_obs": ended.copy(), "final_info": _masked(infos, ended)}
        told["_final_info"] = ended.copy()
        self._begin(np.flatnonzero(ended), self._generators)
        self._ended = np.zeros(self.num_envs, bool)
        reading, everything = self._episodes.read(), np.ones(self.num_envs, bool)
        fresh = tuple(np.where(ended, 0.0, term) for term in terms)
        return self._episodes.observe(reading), _masked(self._episodes.infos(reading, fresh), everything) | told

    def _begin(self, robots: np.ndarray, generators: list[np.random.Generator | None]) -> None:
        names = robots.tolist()
        self._episodes.draw(names, [generator for i in names if (generator := generators[i]) is not None])
        self._steps[robots] = 0
        self._ended[robots] = False

    def _observation(self, rows: np.ndarray) -> Observation:
        return rows if self.settings.obs_mode == "flat" else self._episodes.observer.entries(rows)


def _autoreset_mode(mode: Any) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    return AutoresetMode(check_choice("autoreset_mode", mode, choices=[known.value for known in AutoresetMode]))


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
