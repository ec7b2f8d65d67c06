"""The simulation behind the page: inputs go in by methods, each tick gives a frame. It knows nothing of a browser."""

import traceback
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np

from agents.environment import Environment
from agents.play.choices import Choices
from agents.play.dragging import Dragging
from agents.play.frame import Frame, Numbers
from agents.play.shapes import AnyEquilibrium, contacts_of, shape_of
from agents.play.words import in_words
from agents.policy import Policy
from ccr_gym import ContactEnv
from solver import Obstacle, Status

RESIDUAL_EVERY = 20  # ticks between two certificates, which take up to 90 ms in space
FRESH = 512  # steps after which a policy begins anew, as its memory of an episode grows
LEAST_FORCE, MOST_FORCE = 0.05, 6.0  # of the slider of the set-point [EI/L²]
MESSAGE_TICKS = 160  # for which a message stays


class Session:
    """A robot among obstacles that is driven by hand or by a policy, and can be changed at any time.

    Inputs out of range are refused with a message; no input raises, and neither does :meth:`tick`.

    Args:
        choices: What is played at first.
        seed: Seed of the first scene; the next ones count up.

    Attributes:
        choices: What is played.
        generation: How many environments were made; a page is built anew when it changes.
        episodes: Whether a new scene begins when the task's number of steps is over and a policy drives.
        paused: Whether time stands still; obstacles can still be dragged.
        faults: Errors that no input should cause; each began a new scene and was printed.
    """

    def __init__(self, choices: Choices, seed: int = 0) -> None:
        self.choices, self.generation, self.faults = choices, 0, 0
        self.episodes = self.paused = False
        self._seed, self._ticks, self._message, self._shown_until = seed, 0, "", 0
        self._env = choices.make_env()
        self._begin(choices, self._env, choices.make_policy())

    @property
    def env(self) -> ContactEnv:
        """The environment."""
        return cast("ContactEnv", self._env.unwrapped)

    @property
    def equilibrium(self) -> AnyEquilibrium:
        """The present equilibrium."""
        return self.env.equilibrium

    @property
    def desired(self) -> float:
        """Magnitude of the set-point [N]."""
        return float(np.linalg.norm(self._info["desired_force"]))

    @property
    def force_range(self) -> tuple[float, float]:
        """Bounds of the set-point [N]."""
        unit = self.env.settings.scales.force_n
        return LEAST_FORCE * unit, MOST_FORCE * unit

    @property
    def dragging(self) -> Dragging:
        """Where the obstacles are on their way to."""
        return self._dragging

    @property
    def targets_mm(self) -> np.ndarray:
        """Where the actuated coordinates are on their way to by hand, ``(actions,)`` [mm]."""
        return self._targets_mm.copy()

    def choose(self, name: str, value: str) -> None:
        """Change one of the choices, which begins a new scene unless it is the driver or nothing changes."""
        self._try(lambda: self._choose(self.choices.changed(name, value)))

    def new_scene(self) -> None:
        """Begin in a new scene with a new set-point."""
        self._seed += 1
        self._try(self._reset)

    def straighten(self) -> None:
        """Begin anew with the straight robot, the same obstacles and the same set-point."""
        options = {"scene": self.equilibrium.scene, "desired_force": self._info["desired_force"]}
        self._try(lambda: self._reset(options))

    def pull(self, index: int, target_mm: float) -> None:
        """Set where an actuated coordinate moves to, and take the cables in hand."""
        self._try(lambda: self._pull(index, target_mm))

    def nudge(self, index: int, increments: float) -> None:
        """Move an actuated coordinate by a number of full actions, and take the cables in hand."""
        spec = self.env.action_spec
        if index < spec.size:
            self.pull(index, float(self._targets_mm[index] + increments * spec.increment_mm[index]))

    def drag(self, index: int, center_mm: tuple[float, ...]) -> None:
        """Set where an obstacle's middle moves to [mm]."""
        self._try(lambda: self._dragging.drag(index, center_mm))

    def resize(self, index: int, ratio: float) -> None:
        """Set the size of an obstacle over that at the start of the scene."""
        self._try(lambda: self._dragging.resize(index, ratio))

    def desire(self, force_n: float) -> None:
        """Set the set-point [N]."""
        low, high = self.force_range
        self._try(lambda: self.env.set_desired_force(float(np.clip(force_n, low, high))))

    def picture(self) -> np.ndarray:
        """Return the environment's own picture, ``(H, W, 3)`` uint8."""
        return np.asarray(self.env.render())

    def tick(self) -> Frame:
        """Move obstacles and robot by a step, and return what is to be seen."""
        self._ticks += 1
        try:
            self._move_obstacles()
            if not self.paused:
                self._step()
            return self._frame()
        except Exception:
            self.faults += 1
            traceback.print_exc()
            self._recover()
            return self._frame()

    def pause(self) -> None:
        """Let time stand still, or go on."""
        self.paused = not self.paused

    def say(self, message: str) -> None:
        """Show a message for a while."""
        self._message, self._shown_until = message, self._ticks + MESSAGE_TICKS

    def close(self) -> None:
        """Release the environment."""
        self._env.close()

    def _try(self, action: Callable[[], object]) -> None:
        """Do what an input asks for; where that is impossible, say so."""
        try:
            action()
        except (ValueError, RuntimeError) as error:
            self._say_error(error)

    def _say_error(self, error: Exception, *others: Obstacle) -> None:
        """Say what is wrong, which may be about the present obstacles or others."""
        self.say(in_words(str(error), (*self.equilibrium.scene, *self.equilibrium.scene_now, *others)))

    def _choose(self, choices: Choices) -> None:
        same = replace(choices, driver=self.choices.driver) == self.choices
        policy = choices.make_policy()
        if not same:
            self._begin(choices, choices.make_env(), policy)
        elif choices != self.choices:
            self._drive(choices, policy)

    def _begin(self, choices: Choices, env: Environment, policy: Policy | None) -> None:
        """Put an environment in the place of the present one, once it has been reset."""
        observation, info = env.reset(seed=self._seed)
        if env is not self._env:
            self._env.close()
        self._env, self.choices, self._policy = env, choices, policy
        self.generation += 1
        self.episodes = self.env.task.moving or self.env.task.obstacles_move
        self._began(observation, info)

    def _reset(self, options: dict[str, Any] | None = None) -> None:
        self._began(*self._env.reset(seed=self._seed, options=options))

    def _began(self, observation: Any, info: dict[str, Any]) -> None:
        self._observation, self._info, self._reward, self._steps = observation, info, 0.0, 0
        self._targets_mm = self.env.privileged_state.motor_mm.copy()
        self._dragging = Dragging(self.equilibrium.scene, self.env.settings.scales.length_mm)
        self._certify()
        self._start_policy()

    def _drive(self, choices: Choices, policy: Policy | None) -> None:
        self.choices, self._policy = choices, policy
        self._targets_mm = self.env.privileged_state.motor_mm.copy()
        self._start_policy()

    def _start_policy(self) -> None:
        self._driven = 0
        if self._policy is not None:
            self._policy.reset(self._env)

    def _pull(self, index: int, target_mm: float) -> None:
        spec = self.env.action_spec
        if not 0 <= index < spec.size:
            raise ValueError(f"coordinate {index} is out of range; the robot has {spec.size}")
        if self._policy is not None:
            self._drive(self.choices.changed("driver", "Hand"), None)
        self._targets_mm[index] = np.clip(target_mm, spec.low_mm[index], spec.high_mm[index])

    def _move_obstacles(self) -> None:
        """Move the obstacles part of their way; where the robot stops them, they stay."""
        wanted = self._dragging.next_scene(self.equilibrium.scene) if self._dragging.active else None
        if wanted is None:
            return
        try:
            reached = self.env.move_obstacles(wanted)
        except ValueError as error:
            self._dragging.stop()
            self._say_error(error, *wanted)
            return
        if reached != wanted:
            self._dragging.stop()
            status = self.equilibrium.status.name
            self.say(f"{status}: the robot can give way no further; the obstacle stays where it was stopped")

    def _step(self) -> None:
        action = self._action()
        self._observation, reward, _, _, self._info = self._env.unwrapped.step(action)
        self._reward = float(reward)
        self._steps += 1
        self._driven += 1
        if self._policy is not None and self.episodes and self._steps >= self.env.task.steps:
            self.new_scene()
        elif self._driven >= FRESH:
            self._start_policy()

    def _action(self) -> np.ndarray:
        """Return the action of the policy, or that moves the motors towards the targets."""
        if self._policy is not None:
            try:
                return self._policy.act(self._observation)
            except ValueError as error:
                name = self.choices.driver
                self._drive(self.choices.changed("driver", "Hand"), None)
                self.say(f"{name} cannot drive this robot: {error}")
        missing = self._targets_mm - self.env.privileged_state.motor_mm
        action: np.ndarray = np.clip(missing / self.env.action_spec.increment_mm, -1.0, 1.0)
        return action.astype(np.float32)

    def _recover(self) -> None:
        """Begin a new scene after an error that should not be, with what was played if that still works."""
        choices = replace(self.choices, driver="Hand")
        try:
            self._begin(choices, choices.make_env(), None)
        except Exception:
            self._begin(Choices(), Choices().make_env(), None)
        self.say("an error was met and printed; this is a new scene")

    def _certify(self) -> None:
        self._residual = max(map(float, self.equilibrium.residuals()))

    def _frame(self) -> Frame:
        equilibrium, info, scales = self.equilibrium, self._info, self.env.settings.scales
        if self._ticks % RESIDUAL_EVERY == 0:
            self._certify()
        contacts = contacts_of(equilibrium, info["force_true"], info["force_est"], self.env.task.target, scales)
        now, resting = equilibrium.scene_now.obstacles, equilibrium.scene.obstacles
        return Frame(shape_of(equilibrium, scales), now, resting, contacts, self._numbers(equilibrium))

    def _numbers(self, equilibrium: AnyEquilibrium) -> Numbers:
        info = self._info
        true, estimate = (float(np.linalg.norm(info[name])) for name in ("force_true", "force_est"))
        return Numbers(
            step=self._steps,
            status=Status(equilibrium.status).name,
            desired=self.desired,
            true=true,
            estimate=estimate,
            tensions=tuple(equilibrium.tensions.tolist()),
            residual=self._residual,
            reward=self._reward,
            actuated_mm=tuple(self.env.privileged_state.actuated_mm.tolist()),
            message=self._message if self._ticks < self._shown_until else "",
        )
