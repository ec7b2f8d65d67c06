"""What every environment shares: one physical transition, observed and rewarded."""

import math
from typing import Any, Literal, SupportsFloat

import gymnasium
import numpy as np
from gymnasium import spaces

from ccr_gym.observation import FORCE_SCALE_N, Observer, Reading
from ccr_gym.rendering import Frame, Renderer
from ccr_gym.reward import RewardWeights, reward_terms
from ccr_gym.tasks import Assignment, Task, assign
from solver import Equilibrium, Robot, Solver
from solver.forces import Onset, VirtualWork, force_true
from solver.reference import ReferenceSolver

Observation = np.ndarray | dict[str, np.ndarray]


class ContactEnv(gymnasium.Env[Observation, np.ndarray]):
    """Push an obstacle with a desired force; every step is the exact equilibrium after a cable increment.

    Args:
        task: What an episode asks.
        robot: The robot, or a mapping of its fields; the paper's prototype by default.
        obs_mode: ``"dict"`` or ``"flat"``.
        force_sensor: Whether the exact contact force is observed beside the virtual-work estimate.
        max_increment_mm: Cable increment of a full action [mm].
        cable_limit_mm: Largest cable displacement a policy can command [mm].
        friction: Ratio μ of the virtual-work estimator (eq. 11).
        force_limit: Contact force above which ``info["cost"]`` counts [N].
        weights: Weights of the reward terms; a mapping of names to numbers is taken as well.
        backend: ``"native"``, or ``"casadi"`` for the reference solver (slow).
        render_mode: ``None``, ``"rgb_array"`` or ``"human"``.

    Raises:
        ValueError: If an argument is out of range; the message names the bound.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - an instance variable in the base class
        "render_modes": ["human", "rgb_array"],
        "render_fps": 20,
    }

    def __init__(
        self,
        task: Task,
        robot: Robot | dict[str, Any] | None = None,
        obs_mode: Literal["dict", "flat"] = "dict",
        force_sensor: bool = True,
        max_increment_mm: float = 0.5,
        cable_limit_mm: float = 14.0,
        friction: float = 0.0,
        force_limit: float = 0.3,
        weights: RewardWeights | dict[str, float] | None = None,
        backend: Literal["native", "casadi"] = "native",
        render_mode: str | None = None,
    ) -> None:
        self.robot = Robot(**robot) if isinstance(robot, dict) else robot or Robot.prototype()
        _require(obs_mode in ("dict", "flat"), f"obs_mode is {obs_mode!r}; it must be 'dict' or 'flat'")
        _require(backend in ("native", "casadi"), f"backend is {backend!r}; it must be 'native' or 'casadi'")
        _require(
            0 < cable_limit_mm <= self.robot.cable_limit_mm,
            f"cable_limit_mm is {cable_limit_mm}; it must be positive and at most {self.robot.cable_limit_mm:.6g}",
        )
        _require(
            0 < max_increment_mm <= cable_limit_mm,
            f"max_increment_mm is {max_increment_mm}; it must be positive and at most cable_limit_mm",
        )
        _require(force_limit > 0, f"force_limit is {force_limit}; it must be positive")
        _require(
            render_mode is None or render_mode in self.metadata["render_modes"],
            f"render_mode is {render_mode!r}; it must be None or one of {self.metadata['render_modes']}",
        )
        self.task = task
        self.obs_mode = obs_mode
        self.force_sensor = force_sensor
        self.max_increment_mm = max_increment_mm
        self.cable_limit_mm = cable_limit_mm
        self.force_limit = force_limit
        self.weights = RewardWeights(**weights) if isinstance(weights, dict) else weights or RewardWeights()
        self.backend = backend
        self.render_mode = render_mode
        self.estimator = VirtualWork(friction)
        self._observer = Observer(self.robot, force_sensor)
        space: spaces.Space[Any] = self._observer.flat_space if obs_mode == "flat" else self._observer.dict_space
        self.observation_space = space
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self._renderer: Renderer | None = None
        self._solver: Solver | ReferenceSolver | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode with the straight robot and a new scene and set-point.

        Args:
            seed: Seeds the environment's generator.
            options: ``{"scene": Scene, "desired_force": float}`` fixes the assignment instead of drawing it [N].

        Raises:
            ValueError: If the options are incomplete or out of range.
        """
        super().reset(seed=seed)
        assignment = self._assignment(options)
        self._solver = assignment.solver
        if self.backend == "casadi":
            self._solver = ReferenceSolver(self.robot, assignment.solver.scene)
        self._desired = assignment.desired_force
        self._equilibrium = assignment.solver.rest()
        self._onset = Onset()
        self._measure()
        if self.render_mode == "human":
            self.render()
        return self._observe(), self._info({})

    def step(self, action: np.ndarray) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Move the cable by ``action · max_increment_mm``, as far as tension and obstacles allow.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the action has the wrong shape or is not finite; the state stays as it was.
        """
        if self._solver is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        pull = np.asarray(action, dtype=np.float64)
        if pull.shape != (1,) or not math.isfinite(pull[0]):
            raise ValueError(f"action is {action!r}; it must be one finite number in an array of shape (1,)")
        effort = min(max(float(pull[0]), -1.0), 1.0)
        command = self._equilibrium.cable_mm + effort * self.max_increment_mm
        before = self._equilibrium
        self._equilibrium = self._solver.step(before, min(max(command, 0.0), self.cable_limit_mm))
        self._onset = self._onset.after(before, self._equilibrium)
        self._measure()
        touching = self._equilibrium.contact.any()
        terms = reward_terms(
            self.weights,
            np.float64(self._force_size),
            np.float64(self._desired),
            self._equilibrium.gaps.min(initial=np.inf),
            touching,
            np.float64(effort),
        )
        if self.render_mode == "human":
            self.render()
        info = self._info({name: float(value) for name, value in terms.items()})
        return self._observe(), sum(info["reward_terms"].values()), False, False, info

    def render(self) -> np.ndarray | None:
        """The robot, obstacles, contacts, forces and set-point: ``(H, W, 3)`` uint8, or a window in human mode."""
        if self.render_mode is None or self._solver is None:
            gymnasium.logger.warn("render() needs render_mode='rgb_array' or 'human', and a reset")
            return None
        self._renderer = self._renderer or Renderer(self.metadata["render_fps"])
        frame = Frame(self._equilibrium, self._force_true, self._force_est, self._desired, FORCE_SCALE_N)
        if self.render_mode == "rgb_array":
            return self._renderer.draw(frame)
        self._renderer.show(frame)
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    @property
    def equilibrium(self) -> Equilibrium:
        """The present equilibrium; immutable."""
        return self._equilibrium

    def _assignment(self, options: dict[str, Any] | None) -> Assignment:
        if not options:
            return assign(self.task, self.robot, self.cable_limit_mm, self.np_random)
        _require(
            options.keys() == {"scene", "desired_force"},
            f"options has {sorted(options)}; give both 'scene' and 'desired_force', or neither",
        )
        force = options["desired_force"]
        _require(
            0 < force <= FORCE_SCALE_N, f"desired_force is {force}; it must be positive and at most {FORCE_SCALE_N}"
        )
        return Assignment(Solver(self.robot, options["scene"]), float(force))

    def _measure(self) -> None:
        self._force_true = force_true(self._equilibrium).sum(axis=0)
        self._force_est = self.estimator.estimate(self._equilibrium, self._onset).sum(axis=0)
        self._force_size = math.hypot(*self._force_true)

    def _observe(self) -> Observation:
        reading = Reading(self._equilibrium, self._force_true, self._force_est, self._desired, self.cable_limit_mm)
        return self._observer.flat(reading) if self.obs_mode == "flat" else self._observer.entries(reading)

    def _info(self, terms: dict[str, float]) -> dict[str, Any]:
        return {
            "force_true": self._force_true.copy(),
            "force_est": self._force_est.copy(),
            "desired_force": self._desired,
            "cable_mm": self._equilibrium.cable_mm,
            "tension": self._equilibrium.tension,
            "solver_status": int(self._equilibrium.status),
            "cost": max(0.0, self._force_size - self.force_limit),
            "is_success": abs(self._force_size - self._desired) <= 0.05 * self._desired,
            "reward_terms": terms,
        }


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)
