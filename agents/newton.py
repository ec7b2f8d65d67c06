"""A controller on the exact model, and the oracle: the bound for all that do not know what is hidden."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agents.policy import Observation, Tare, search
from agents.tuned import NEWTON_GAINS
from ccr_gym.fleet import Truth
from ccr_gym.observation import FORCE_SCALE_N
from solver import Equilibrium
from solver.sensitivity import CABLE, LENGTH, sensitivity
from solver.spatial.sensitivity import CABLES, spatial_sensitivity

PROBE_MM = 1e-3  # move of a trial


@dataclass(slots=True)
class NewtonController:
    """Newton steps on the exact slopes of the contact force in what the actions move, at the equilibrium itself.

    It knows the model, the scene and the state of the robot, which no policy sees. Its force is that of the sensor,
    whose zero it takes from before contact, and its robot has the rigidity that is known and motors without play. The
    oracle knows all of it: the true force, the rigidity, the play and the next set-point, a bound for those that do
    not. Where there are two actions the smallest increments are taken that meet the set-point, or come closest to one
    that is a vector.

    Attributes:
        oracle: Whether it knows what is hidden.
        gain: Part of a Newton step that is made.
        damping: Slope of the force below which it is not trusted [N/mm].
        name: Of the policy.
    """

    oracle: bool = False
    gain: float = 1.0
    damping: float = 1e-4
    name: str = "Newton"
    _env: Any = field(default=None, init=False)
    _tare: Tare = field(default_factory=Tare, init=False)

    @classmethod
    def tuned(cls, env_id: str) -> "NewtonController":
        """With the gain of least force error on training scenes with realistic sensing."""
        return cls(gain=NEWTON_GAINS[env_id])

    @classmethod
    def knowing(cls, env_id: str = "") -> "NewtonController":
        """The oracle."""
        return cls(oracle=True, name="Oracle")

    def reset(self, env: Any = None) -> None:
        """Take the environment whose equilibrium is known."""
        self._env = env
        self._tare.forget()

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then step to where the force is that of the set-point."""
        truth: Truth = self._env.get_wrapper_attr("truth")
        task, settings = self._env.get_wrapper_attr("task"), self._env.get_wrapper_attr("settings")
        if not self.oracle:
            truth = self._seen(observation, truth)
        if not truth.force.any():
            return search(observation)
        slopes = self._tried(truth) if self.oracle else self._slopes(task.target, "length" in observation)
        if np.ndim(truth.goal) == 0:  # along the force as it is
            size = float(np.linalg.norm(truth.force))
            slopes, lacking = slopes @ (truth.force / size)[:, None], np.array([truth.goal - size])
        else:
            lacking = truth.goal - truth.force
        (low, high), free = task.body.bounds(settings), np.ones(len(slopes), bool)
        for _ in free:  # a motor at its bound leaves the rest to the other
            damped = slopes @ slopes.T + (truth.stiffness * self.damping) ** 2 * np.eye(len(slopes))
            increments = np.linalg.solve(damped, slopes @ lacking)
            free &= np.where(increments > 0, truth.motors < high, truth.motors > low)
            slopes = slopes * free[:, None]
        play = np.where(increments == 0, 0.0, truth.places + np.copysign(truth.slack, increments) - truth.motors)
        effort = (self.gain * increments + play) / task.body.increments(settings)
        return np.asarray(effort / max(1.0, np.abs(effort).max()), np.float32)

    def _seen(self, observation: Observation, truth: Truth) -> Truth:
        """What it takes for the truth if it does not know what is hidden; no force while nothing is seen to touch."""
        force, goal = self._tare.force(observation), FORCE_SCALE_N * observation["desired_force"].astype(float)
        if force is None:
            force = np.zeros(truth.force.size)
        here, still = truth.motors, np.zeros(truth.motors.size)
        return Truth(force, 1.0, goal.item() if goal.size == 1 else goal, here, here, still)

    def _tried(self, truth: Truth) -> np.ndarray:
        """The same of the true force, from trial moves that are solved exactly, which is faster."""
        probe = self._env.get_wrapper_attr("probe")
        trials = truth.places + PROBE_MM * np.eye(truth.places.size)
        return np.array([(probe(places) - truth.force) / PROBE_MM for places in trials])

    def _slopes(self, target: int | None, insertion: bool) -> np.ndarray:
        """Slopes of the force that counts in what the actions move, ``(actions, d)`` [N/mm]."""
        equilibrium = self._env.get_wrapper_attr("equilibrium")
        counted = slice(None) if target is None else slice(target, target + 1)
        if isinstance(equilibrium, Equilibrium):
            slopes = sensitivity(equilibrium).forces[[CABLE, LENGTH] if insertion else [CABLE]]
        else:
            slopes = spatial_sensitivity(equilibrium).forces[CABLES]
        return np.asarray(slopes[:, counted].sum(axis=1))
