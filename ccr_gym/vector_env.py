"""The vector environment: many episodes of one task behind Gymnasium's vector interface."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import as_array, check_array, check_choice, check_flag, check_seed, check_type, refusal, require
from ccr_gym.contact_env import METADATA, Info, make_settings, single_spaces
from ccr_gym.differentiation import DifferentiableSteps
from ccr_gym.episodes import EpisodeBatch
from ccr_gym.goals import compute_reward
from ccr_gym.observation import Observation
from ccr_gym.pictures import Pictures
from ccr_gym.readings import PrivilegedState
from ccr_gym.shared import SharedAttributes, entry_of, masked
from ccr_gym.state import EnvState, check_state, restored, state_of
from ccr_gym.task import MAX_STEPS, AnyTask
from ccr_gym.tasks import TASKS, make_task
from solver.common.validation import check_sequence, check_whole, is_listed

MAX_ENVS = 65_536
THREADS_PER_CORE = 4
ARGUMENTS = ("task", "num_envs", "max_episode_steps", "autoreset_mode", "threads", "render_mode", "derivatives")


class ContactVectorEnv(SharedAttributes, DifferentiableSteps, VectorEnv[Observation, np.ndarray, np.ndarray]):
    """Many :class:`ccr_gym.ContactEnv` of one task, moved by one call of the solver.

    Results are bit-identical to those of ``gymnasium.vector.SyncVectorEnv``, for any number of threads.

    Args:
        task: What an episode asks.
        num_envs: Number N of environments, up to 65 536.
        max_episode_steps: Steps after which an episode is truncated; ``None`` for those of the task.
        autoreset_mode: When an environment is reset after the end of an episode: in the next step (``"NextStep"``), in
            the last step (``"SameStep"``), or by the caller (``"Disabled"``).
        threads: Threads of the solver, up to four per core.
        render_mode: ``None``, or ``"rgb_array"`` for pictures of all environments.
        derivatives: Whether steps are differentiated, for :attr:`slopes` and :meth:`vjp`.
        **settings: Fields of the task's settings, as :class:`ccr_gym.Settings`.

    Raises:
        TypeError: If an argument is unknown, or an object of the wrong class.
        ValueError: If an argument is out of range; the message names the bound.
    """

    def __init__(
        self,
        task: AnyTask,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        render_mode: str | None = None,
        derivatives: bool = False,
        **settings: object,
    ) -> None:
        if render_mode is not None:
            check_choice("render_mode", render_mode, choices=["rgb_array"])
        self.render_mode = render_mode
        self._pictures: Pictures | None = None
        self.task, self.settings = task, make_settings(type(self).__name__, task, settings, ARGUMENTS)
        self.num_envs = num_envs = check_whole("num_envs", num_envs, 1, MAX_ENVS)
        most, reason = THREADS_PER_CORE * (os.cpu_count() or 1), f"{THREADS_PER_CORE} for each core of this machine"
        threads = check_whole("threads", threads, 1, most, reason)
        steps = task.steps if max_episode_steps is None else max_episode_steps
        self.max_episode_steps = check_whole("max_episode_steps", steps, 1, MAX_STEPS)
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**METADATA, "autoreset_mode": self.autoreset_mode}
        derivatives = check_flag("derivatives", derivatives)
        self._episodes = EpisodeBatch(task, self.settings, num_envs, threads, derivatives=derivatives)
        self.single_observation_space, self.single_action_space = single_spaces(self._episodes, self.settings)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._shape = (num_envs, self.action_spec.size)
        self._steps = np.zeros(num_envs, int)
        self._ended = np.zeros(num_envs, bool)
        self._started = False
        if self.settings.obs_mode == "goal":  # by this method clients tell goal-conditioned environments
            self.compute_reward = compute_reward

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Info | None = None
    ) -> tuple[Observation, Info]:
        """Start episodes in all environments, or in those of ``options["reset_mask"]``.

        A reset that raises changes nothing: neither the episodes nor the generators.

        Args:
            seed: Seed of the first environment, counted up for the others; or one for each; ``None`` to keep the
                generators.
            options: ``{"reset_mask": (N,) bool}``, or nothing.

        Raises:
            RuntimeError: If no feasible scene is found: the task does not suit the robot.
            TypeError: If the options are not a mapping.
            ValueError: If there is not one seed for each environment, or the options are something else.
        """
        seeds, mask = self._seeds(seed), self._mask(options)
        generators = list(self._generators)
        for i in np.flatnonzero(mask):
            if generators[i] is None or seeds[i] is not None:
                generators[i], _ = seeding.np_random(seeds[i])
        self._start(np.flatnonzero(mask), generators)
        self._generators = generators
        self._started = True
        self._film(np.flatnonzero(mask).tolist(), None)
        return self._episodes.observation(), masked(self._episodes.infos(), mask)

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, Info]:
        """Move the cables, and reset environments as the autoreset mode says.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset, or after the end of an episode in the disabled mode.
            ValueError: If the actions are not finite real numbers of the right shape; the state does not change.
        """
        disabled = self.autoreset_mode is AutoresetMode.DISABLED
        if not self._started or (disabled and self._ended.any()):
            raise gymnasium.error.ResetNeeded("call reset() before step(), with a reset_mask after the end of episodes")
        checked = check_array("actions", actions, self._shape)
        resetting = self._ended.copy()
        self._move(checked, resetting)
        truncated = self._steps >= self.max_episode_steps
        rewards = self._episodes.rewards()
        rewards[resetting] = 0.0
        observation, infos = self._episodes.observation(), self._episodes.infos()
        self._ended, started = truncated.copy(), resetting
        if self.autoreset_mode is AutoresetMode.SAME_STEP and truncated.any():
            observation, infos = self._restart(truncated, observation, infos)
            started = truncated
        else:
            infos = masked(infos, np.ones(self.num_envs, bool))
        if self.render_mode is not None:
            self._film(np.flatnonzero(started).tolist(), rewards)
        return observation, rewards, np.zeros(self.num_envs, bool), truncated, infos

    def get_state(self) -> EnvState:
        """Return the state of all episodes and generators, with which :meth:`set_state` goes on."""
        episodes = self._episodes.get_rows(list(range(self.num_envs))) if self._started else None
        states = tuple(state_of(generator) for generator in self._generators)
        return EnvState(episodes, states, self._steps.copy(), self._ended.copy())

    def set_state(self, state: EnvState) -> None:
        """Put all environments into a state of :meth:`get_state`; see :meth:`ccr_gym.ContactEnv.set_state`.

        Raises:
            TypeError: If it is no such state.
            ValueError: If it is of another number of environments, or of another robot.
        """
        check_state(state, self._generators)
        if state.episodes is not None:
            self._episodes.set_rows(list(range(self.num_envs)), state.episodes)
        self._started = state.episodes is not None
        self._generators = [restored(*pair) for pair in zip(self._generators, state.generators, strict=True)]
        self._steps, self._ended = state.steps.copy(), state.ended.copy()
        if self._pictures is not None and self._started:
            self._pictures.start(list(range(self.num_envs)))

    def fork(self, indices: Sequence[int]) -> None:
        """Let every environment go on as a copy of one of them, the generator included.

        Args:
            indices: Environment that each of them becomes a copy of, N of them.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If they are not N whole numbers below N.
        """
        self._check_started("fork")
        wanted = check_array("indices", indices, (self.num_envs,)).astype(int)
        if not ((wanted == np.asarray(indices)) & (wanted >= 0) & (wanted < self.num_envs)).all():
            raise refusal("indices", indices, f"whole numbers from 0 to {self.num_envs - 1}")
        chosen = wanted.tolist()
        states = tuple(state_of(self._generators[i]) for i in chosen)
        self.set_state(EnvState(self._episodes.get_rows(chosen), states, self._steps[wanted], self._ended[wanted]))

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Return a picture of each environment, N of ``(H, W, 3)`` uint8."""
        return self.pictures_of(range(self.num_envs))

    def pictures_of(self, indices: Sequence[int]) -> tuple[np.ndarray, ...] | None:
        """Return pictures of some environments; see :func:`ccr_gym.rendering.tile` for one picture of several."""
        if self.render_mode is None or not self._started:
            gymnasium.logger.warn("render() needs render_mode='rgb_array', and a reset")
            return None
        self._film([], None)
        assert self._pictures is not None
        return tuple(self._pictures.draw(index) for index in indices)

    def close_extras(self, **kwargs: Any) -> None:
        """Free what pictures need."""
        if self._pictures is not None:
            self._pictures.close()
            self._pictures = None

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_pictures": None}  # a canvas is made anew

    def _film(self, started: list[int], rewards: np.ndarray | None) -> None:
        """Note a step, and resets of some environments, for the strip charts."""
        if self.render_mode is None:
            return
        if self._pictures is None:
            title = self.spec.id if self.spec else type(self.task).__name__
            self._pictures = Pictures(self._episodes, title, self.metadata["render_fps"])
            started, rewards = list(range(self.num_envs)), None
        if rewards is not None:
            self._pictures.add(rewards)
        self._pictures.start(started)

    @property
    def action_spec(self) -> ActionSpec:
        """Bounds and increments of what the actions of one environment move."""
        return self._episodes.actions

    @property
    def observation_slices(self) -> dict[str, slice]:
        """Where the named parts of an observation stand in the flat one."""
        return self._episodes.observer.slices

    @property
    def privileged_state(self) -> PrivilegedState:
        """The hidden state of all environments, which agents do not observe.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("privileged_state")
        return self._episodes.privileged_state()

    def probe(self, actuated_mm: np.ndarray) -> np.ndarray:
        """Return contact forces at other actuated coordinates; see :meth:`ccr_gym.episodes.EpisodeBatch.probe`.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the coordinates are not finite real numbers of the right shape.
        """
        self._check_started("probe")
        return self._episodes.probe(check_array("actuated_mm", actuated_mm, self._shape))

    def _check_started(self, asked: str) -> None:
        if not self._started:
            raise gymnasium.error.ResetNeeded(f"call reset() before {asked}")

    def _seeds(self, seed: object) -> list[int | None]:
        """Return one seed for each environment, None to keep its generator."""
        if is_listed(seed):
            seeds = check_sequence("seed", seed, "one for each environment")
            require(len(seeds) == self.num_envs, f"seed has {len(seeds)} entries; it must have {self.num_envs}")
            return [check_seed(f"seed[{i}]", entry) for i, entry in enumerate(seeds)]
        first = check_seed("seed", seed)
        return [None if first is None else first + i for i in range(self.num_envs)]

    def _mask(self, options: Info | None) -> np.ndarray:
        """Return which environments reset options ask to reset, ``(N,)`` bool."""
        wanted = "None, or a mapping of 'reset_mask' only"
        check_type("options", options, Mapping | None, wanted)
        if not options:
            return np.ones(self.num_envs, bool)
        if set(options) != {"reset_mask"}:
            raise refusal("options", options, wanted)
        mask = as_array(options["reset_mask"])
        if not (mask.shape == (self.num_envs,) and mask.dtype == bool and mask.any()):
            raise refusal("reset_mask", options["reset_mask"], f"an array of {self.num_envs} bools, at least one true")
        require(self._started or bool(mask.all()), "reset_mask is not all true; the first reset must be of all")
        return mask

    def _move(self, actions: np.ndarray, resetting: np.ndarray) -> None:
        """Reset some environments and step the others."""
        if not resetting.any():
            self._episodes.step(actions)
            self._steps += 1
            return
        self._start(np.flatnonzero(resetting), self._generators)  # first: if it raises, nothing has moved
        moving = np.flatnonzero(~resetting)
        self._episodes.step(actions[moving], moving)
        self._steps[moving] += 1

    def _restart(self, ended: np.ndarray, observation: Observation, infos: Info) -> tuple[Observation, Info]:
        """Start new episodes where some have ended, whose last observation and info go into the info."""
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            final[i] = entry_of(observation, int(i))
        final_infos = {"final_obs": final, "_final_obs": ended.copy(), "final_info": masked(infos, ended)}
        final_infos["_final_info"] = ended.copy()
        self._start(np.flatnonzero(ended), self._generators)
        self._ended = np.zeros(self.num_envs, bool)
        everything = np.ones(self.num_envs, bool)
        return self._episodes.observation(), masked(self._episodes.infos(), everything) | final_infos

    def _start(self, robots: np.ndarray, generators: list[np.random.Generator | None]) -> None:
        indices = robots.tolist()
        self._episodes.start_sampled(indices, [generator for i in indices if (generator := generators[i]) is not None])
        self._steps[robots] = 0
        self._ended[robots] = False


def make_vector_env(
    task_name: str, task: AnyTask | Mapping[str, object] | None = None, **kwargs: object
) -> ContactVectorEnv:
    """Return a vector environment of a task; the vector entry point of all registered ids.

    Args:
        task_name: Name of the task's class, as ``"PushObstacle"``.
        task: The task, or a mapping of its fields; ``None`` for the defaults.
        **kwargs: Arguments of :class:`ContactVectorEnv`.
    """
    task_class = TASKS[check_choice("task_name", task_name, choices=list(TASKS))]
    make: Callable[..., ContactVectorEnv] = ContactVectorEnv  # which checks the types itself
    return make(make_task(task_class, task), **kwargs)


def _autoreset_mode(mode: object) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    return AutoresetMode(check_choice("autoreset_mode", mode, choices=[known.value for known in AutoresetMode]))
