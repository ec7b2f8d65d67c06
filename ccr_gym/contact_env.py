"""The single environment."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any, SupportsFloat, cast

import gymnasium
import numpy as np
from gymnasium import spaces

from ccr_gym.actions import ActionSpec
from ccr_gym.checks import check_array, check_choice, check_names, check_seed, check_type, refusal
from ccr_gym.episodes import EpisodeBatch
from ccr_gym.goals import compute_reward, goal_space
from ccr_gym.observation import Observation
from ccr_gym.pictures import Pictures
from ccr_gym.readings import PrivilegedState
from ccr_gym.scales import Scales
from ccr_gym.settings import AnySettings
from ccr_gym.state import EnvState, check_state, restored, state_of
from ccr_gym.task import AnyTask, Assignment, check_force, check_task
from solver import Equilibrium, Obstacle, Scene
from solver.spatial import SpatialEquilibrium

Info = dict[str, Any]  # Gymnasium's own type of infos and options
RENDER_MODES = ["human", "rgb_array"]
DT_S = 0.05  # time that a step stands for; equilibria know none, so any other is as good where it is slow enough
METADATA: Info = {"render_modes": RENDER_MODES, "render_fps": round(1 / DT_S), "dt": DT_S}
FIRST = np.zeros(1, np.int64)  # index of the only robot
SPACES = {2: "the plane", 3: "space"}


class ContactEnv(gymnasium.Env[Observation, np.ndarray]):
    """An environment in which a robot pushes an obstacle with a desired force.

    Every step is the exact equilibrium after a cable increment.

    Args:
        task: What an episode asks.
        render_mode: ``None``, ``"rgb_array"`` or ``"human"``.
        **settings: Fields of the task's settings, as :class:`ccr_gym.Settings`.

    Raises:
        TypeError: If an argument is unknown, or an object of the wrong class.
        ValueError: If an argument is out of range; the message names the bound.
    """

    metadata = METADATA

    def __init__(self, task: AnyTask, render_mode: str | None = None, **settings: object) -> None:
        if render_mode is not None:
            check_choice("render_mode", render_mode, choices=RENDER_MODES)
        self.task, self.render_mode = task, render_mode
        self.settings = make_settings(type(self).__name__, task, settings, ("task", "render_mode"))
        self._episodes = EpisodeBatch(task, self.settings, 1)
        self._pictures: Pictures | None = None
        self._started = False
        if self.settings.obs_mode == "goal":  # by this method clients tell goal-conditioned environments
            self.compute_reward = compute_reward
        self.observation_space, self.action_space = single_spaces(self._episodes, self.settings)
        self._shape = (self.action_spec.size,)

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Observation, Info]:
        """Start an episode with the straight robot and a new scene and set-point.

        A reset that raises changes nothing: neither the episode nor the generator.

        Args:
            seed: Seed of the environment's generator, a whole number from 0 on; ``None`` to keep the generator.
            options: ``{"scene": Scene, "desired_force": float}`` to give scene, which may be a list of obstacles, and
                set-point instead of sampling them [N]; the force is a vector where the task's set-point is one.

        Raises:
            RuntimeError: If no feasible scene is found: the task does not suit the robot.
            TypeError: If the options are not a mapping, or the scene is not a Scene.
            ValueError: If the seed is not a whole number from 0 on, or the options are incomplete or out of range.
        """
        seed = check_seed("seed", seed)
        given = _given_assignment(options, self.task, self.settings.scales)
        generator = self._np_random, self._np_random_seed
        super().reset(seed=seed)
        try:
            if given is None:
                self._episodes.start_sampled([0], [self.np_random])
            else:
                self._episodes.start_given(0, given, self.np_random)
        except BaseException:
            self._np_random, self._np_random_seed = generator
            raise
        self._started = True
        self._film(None)
        return self._episodes.observation(0), self._episodes.info()

    def step(self, action: np.ndarray) -> tuple[Observation, SupportsFloat, bool, bool, Info]:
        """Move the cables by ``action · max_increment_mm``, as far as tension limit and obstacles allow.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the action is not finite real numbers of the right shape; the state does not change.
        """
        self._check_started("step")
        episodes = self._episodes
        episodes.step(check_array("action", action, self._shape)[None], FIRST)
        reward = float(episodes.rewards(0))
        if self.render_mode is not None:
            self._film(reward)
        return episodes.observation(0), reward, False, False, episodes.info()

    def render(self) -> np.ndarray | None:
        """Return a picture, ``(H, W, 3)`` uint8, or show it in a window: robot, obstacles, forces and set-point."""
        if self.render_mode is None or not self._started:
            gymnasium.logger.warn("render() needs render_mode='rgb_array' or 'human', and a reset")
            return None
        if self._pictures is None:
            self._film(None)
        assert self._pictures is not None
        if self.render_mode == "rgb_array":
            return self._pictures.draw()
        self._pictures.show()
        return None

    def _film(self, reward: float | None) -> None:
        """Note a step, or without a reward a reset, for the strip chart; show it in the window."""
        if self.render_mode is None:
            return
        if self._pictures is None:
            title = self.spec.id if self.spec else type(self.task).__name__
            self._pictures = Pictures(self._episodes, title, self.metadata["render_fps"])
            self._pictures.start([0])
        elif reward is None:
            self._pictures.start([0])
        else:
            self._pictures.add(np.array([reward]))
        if self.render_mode == "human":
            self._pictures.show()

    def get_state(self) -> EnvState:
        """Return the state of the episode and of the generator, with which :meth:`set_state` goes on.

        It holds nothing of the environment's arguments, and of no wrapper around it.
        """
        episodes = self._episodes.get_rows([0]) if self._started else None
        return EnvState(episodes, (state_of(self._np_random),), np.zeros(1, int), np.zeros(1, bool))

    def set_state(self, state: EnvState) -> None:
        """Put the environment into a state of :meth:`get_state` of one with the same arguments.

        From there it goes on with the same bits, in another process too.

        Raises:
            TypeError: If it is no such state.
            ValueError: If it is that of a vector environment, or of another robot.
        """
        check_state(state, [self._np_random])
        if state.episodes is not None:
            self._episodes.set_rows([0], state.episodes)
        self._started = state.episodes is not None
        self._np_random = restored(self._np_random, state.generators[0])
        if self._pictures is not None and self._started:
            self._pictures.start([0])

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_pictures": None}  # a window or canvas is made anew

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._pictures is not None:
            self._pictures.close()
            self._pictures = None

    @property
    def action_spec(self) -> ActionSpec:
        """Bounds and increments of what the actions move."""
        return self._episodes.actions

    @property
    def observation_slices(self) -> dict[str, slice]:
        """Where the named parts of an observation stand in the flat one."""
        return self._episodes.observer.slices

    @property
    def equilibrium(self) -> Equilibrium | SpatialEquilibrium:
        """The present equilibrium; it is immutable.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("equilibrium")
        return self._episodes.equilibrium(0)

    @property
    def privileged_state(self) -> PrivilegedState:
        """The hidden state, which agents do not observe.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("privileged_state")
        return self._episodes.privileged_state(0)

    def move_obstacles(self, scene: Scene | Sequence[Obstacle]) -> Scene:
        """Move and resize the obstacles while the motors stay, and return where they stand then.

        They stop where the robot can give way no further; the status of :attr:`equilibrium` tells. No step passes.

        Args:
            scene: Where to: the present obstacles (``equilibrium.scene``), shifted and with other sizes or not.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If they are other obstacles, turned or too small; nothing has changed then.
        """
        self._check_started("move_obstacles")
        return self._episodes.move_obstacles(0, scene if isinstance(scene, Scene) else Scene(scene))

    def set_desired_force(self, force_n: float) -> None:
        """Set the magnitude of the set-point, the largest one where it changes with time [N].

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If it is not positive, or too large for the robot.
        """
        self._check_started("set_desired_force")
        force = float(check_array("force_n", force_n, ()))
        check_force("force_n", force, self.settings.scales.force_n)
        self._episodes.set_desired_force(0, force)

    def probe(self, actuated_mm: np.ndarray) -> np.ndarray:
        """Return the contact force, ``(d,)`` [N], at other actuated coordinates ``(actions,)`` [mm]; nothing moves.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the coordinates are not finite real numbers of the right shape.
        """
        self._check_started("probe")
        return np.asarray(self._episodes.probe(check_array("actuated_mm", actuated_mm, self._shape)[None])[0])

    def force_slopes(self) -> np.ndarray:
        """Return the slopes of the regulated contact force in the actuated coordinates, ``(actions, d)`` [N/mm].

        They are those of :meth:`probe` at the present coordinates.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("force_slopes")
        return np.asarray(self._episodes.force_slopes()[0])

    def _check_started(self, asked: str) -> None:
        if not self._started:
            raise gymnasium.error.ResetNeeded(f"call reset() before {asked}")


def single_spaces(episodes: EpisodeBatch, settings: AnySettings) -> tuple[spaces.Space[Observation], spaces.Box]:
    """Return the observation and action space of a single environment."""
    observer = episodes.observer
    action_space = spaces.Box(-1.0, 1.0, (episodes.actions.size,), np.float32)
    found: spaces.Space[Any] = observer.flat_space
    if settings.obs_mode == "dict":
        found = observer.dict_space
    elif settings.obs_mode == "goal":
        found = goal_space(observer.flat_space, episodes.goal_size)
    return cast("spaces.Space[Observation]", found), action_space


def make_settings(name: str, task: AnyTask, given: Mapping[str, object], others: Sequence[str]) -> AnySettings:
    """Return the settings of an environment, from its keyword arguments.

    Args:
        name: Name of the environment's class.
        task: Its task.
        given: The keyword arguments.
        others: Its arguments that are not settings, which a message about an unknown argument lists.

    Raises:
        TypeError: If an argument is unknown, or an object of the wrong class.
        ValueError: If an argument is out of range.
    """
    check_task(task)
    settings_class = task.adapter.settings_class
    make: Callable[..., AnySettings] = settings_class  # which checks the types itself
    valid = [*others, *(declared.name for declared in fields(settings_class))]
    check_names(name, given, valid, "got an unexpected keyword argument")  # Python's words, which TorchRL looks for
    return make(**given)


def _given_assignment(options: Info | None, task: AnyTask, scales: Scales) -> Assignment | None:
    """Return scene and set-point of reset options, or None without any."""
    wanted = "None, or a mapping of both 'scene' and 'desired_force'"
    check_type("options", options, Mapping | None, wanted)
    if not options:
        return None
    if set(options) != {"scene", "desired_force"}:
        raise refusal("options", options, wanted)
    scene, space = options["scene"], task.adapter.space
    if isinstance(scene, list | tuple):
        scene = Scene(scene)
    check_type("scene", scene, Scene, "a Scene or a list of obstacles")
    for obstacle in scene:
        if obstacle.space != space:
            raise refusal("scene", scene, f"of obstacles in {SPACES[space]}, not in {SPACES[obstacle.space]}")
    shape = (space,) if task.force_vector else ()
    force = check_array("desired_force", options["desired_force"], shape)
    check_force("desired_force", math.hypot(*force) if shape else float(force), scales.force_n)
    return Assignment(scene, force)
