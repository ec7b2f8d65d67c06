"""A controller on the exact model, and the oracle: the bound for all that do not know what is hidden."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agents.controllers.lag import Lag, seen_cables
from agents.policy import Observation, Tare, effort, search, set_points
from agents.tuned import NEWTON_GAIN
from ccr_gym import FORCE_SCALE_N, PrivilegedState
from solver import Equilibrium, Sensitivity, sensitivity
from solver.spatial import SpatialSensitivity, spatial_sensitivity

PROBE_MM = 1e-3  # move of a trial
PRIOR = np.full(2, 1e-6)  # a reading of 1 mN that agrees with the model [N²]


@dataclass(slots=True)
class NewtonController:
    """Newton steps on the exact slopes of the contact force in what the actions move, at the equilibrium itself.

    It knows the model, the scene and the state of the robot, which no policy sees, but for the rigidity: that is the
    ratio of what the sensor reads to what the model felt a latency ago. The zero of the sensor is taken from before
    contact, latency and play from where the cables are seen to be (:class:`Lag`). The oracle is told all of it, the
    true force and the next set-point: a bound for those that are not. Where there are two actions the smallest
    increments are taken that meet the set-point, or come closest to one that is a vector.

    Attributes:
        oracle: Whether it knows what is hidden.
        gain: Part of a Newton step that is made.
        damping: Slope of the force below which it is not trusted [N/mm].
        name: Of the policy.
    """

    oracle: bool = False
    gain: float = NEWTON_GAIN
    damping: float = 1e-4
    name: str = "Newton"
    _env: Any = field(default=None, init=False)
    _tare: Tare = field(default_factory=Tare, init=False)
    _lag: Lag = field(default_factory=lambda: Lag(1, 1), init=False)
    _felt: list[float] = field(default_factory=list, init=False)
    _fit: np.ndarray = field(default_factory=PRIOR.copy, init=False)

    @classmethod
    def knowing(cls) -> "NewtonController":
        """The oracle."""
        return cls(oracle=True, gain=1.0, name="Oracle")

    def reset(self, env: Any = None) -> None:
        """Take the environment whose equilibrium is known."""
        self._env, self._fit = env, PRIOR.copy()
        self._lag = Lag(1, env.get_wrapper_attr("task").body.model.cables)
        self._tare.forget()
        self._felt.clear()

    def act(self, observation: Observation) -> np.ndarray:
        """Pull until something touches, then step to where the force is that of the set-point."""
        truth: PrivilegedState = self._env.get_wrapper_attr("privileged_state")
        task, settings = self._env.get_wrapper_attr("task"), self._env.get_wrapper_attr("settings")
        if not self.oracle:
            truth = self._seen(observation, truth, settings)
        if not truth.force.any():
            return search(observation)
        slopes = self._tried(truth) if self.oracle else self._slopes(truth, task.target, "length" in observation)
        if np.ndim(truth.goal) == 0:  # along the force as it is
            size = float(np.linalg.norm(truth.force))
            slopes, lacking = slopes @ (truth.force / size)[:, None], np.array([truth.goal - size])
        else:
            lacking = truth.goal - truth.force
        (low, high), free = task.body.bounds(settings), np.ones(len(slopes), bool)
        for _ in free:  # a motor at its bound leaves the rest to the other
            damped = slopes @ slopes.T + (truth.rigidity_ratio * self.damping) ** 2 * np.eye(len(slopes))
            increments = np.linalg.solve(damped, slopes @ lacking)
            free &= np.where(increments > 0, truth.motors < high, truth.motors > low)
            slopes = slopes * free[:, None]
        return effort(self.gain * increments, truth, task.body.increments(settings))

    def _seen(self, observation: Observation, truth: PrivilegedState, settings: Any) -> PrivilegedState:
        """What it takes for the truth if it does not know what is hidden."""
        force, cables = truth.force / truth.rigidity_ratio, observation["cable"].size  # the force of the model
        vector = FORCE_SCALE_N * observation["desired_force"].astype(float)
        goal: Any = vector if vector.size > 1 else set_points(observation, 1).item()
        self._lag.see(truth.motors[None, :cables], seen_cables(observation, settings.robot)[None])
        self._felt.append(float(np.linalg.norm(force)))
        measured = self._tare.force(observation)
        if measured is not None:
            then = self._felt[max(-1 - self._lag.latency.item(), -len(self._felt))]
            self._fit = self._fit + then * np.array([np.linalg.norm(measured), then])
        ratio = self._fit[0] / self._fit[1]
        slack = np.where(np.arange(truth.slack.size) < cables, self._lag.slack, 0.0)  # an insertion has none
        return PrivilegedState(ratio * force, ratio, goal, truth.places, truth.motors, slack)

    def _slopes(self, truth: PrivilegedState, target: int | None, insertion: bool) -> np.ndarray:
        """Slopes of the force that counts in what the actions move, ``(actions, d)`` [N/mm]."""
        equilibrium = self._env.get_wrapper_attr("equilibrium")
        counted = slice(None) if target is None else slice(target, target + 1)
        if isinstance(equilibrium, Equilibrium):
            slopes = sensitivity(equilibrium).forces[
                [Sensitivity.CABLE, Sensitivity.LENGTH] if insertion else [Sensitivity.CABLE]
            ]
        else:
            slopes = spatial_sensitivity(equilibrium).forces[SpatialSensitivity.CABLES]
        return np.asarray(truth.rigidity_ratio * slopes[:, counted].sum(axis=1))

    def _tried(self, truth: PrivilegedState) -> np.ndarray:
        """The same of the true force, from trial moves that are solved exactly, which is faster."""
        probe = self._env.get_wrapper_attr("probe")
        trials = truth.places + PROBE_MM * np.eye(truth.places.size)
        return np.array([(probe(places) - truth.force) / PROBE_MM for places in trials])
