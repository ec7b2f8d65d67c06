"""Episodes of one task side by side: what is read of them, observation, reward and info.

Single and vector environments are both shells around an :class:`EpisodeBatch`, so their results cannot differ.
"""

import numpy as np

from ccr_gym.estimation import TINY, Measured
from ccr_gym.goals import compute_reward
from ccr_gym.observation import Known, Observation
from ccr_gym.quantities import Quantity, as_scalar, norm, operations
from ccr_gym.readings import ForceReading, PrivilegedState
from ccr_gym.reward import SUCCESS_ERROR, TERMS, reward_terms
from ccr_gym.scales import AHEAD
from ccr_gym.task import PROFILE_STEPS
from ccr_gym.transition import ALL, Transition
from solver import Scene
from solver.common.batch import BaseBatch
from solver.common.operations import dot

SHOWN_FORCE = 4.0  # that fills the scale of a picture [EI/L²]


class EpisodeBatch(Transition):
    """Episodes of N robots; see :class:`ccr_gym.transition.Transition`."""

    @property
    def goal_size(self) -> int:
        """Numbers of a set-point, 1 or d."""
        return self.adapter.space if self._vector else 1

    @property
    def target(self) -> int | None:
        """Index of the obstacle whose force is regulated; ``None`` for the sum over all."""
        return self._target

    @property
    def shown_force_n(self) -> float:
        """Force that fills the scale of a picture [N]."""
        return SHOWN_FORCE * self.adapter.scales.force_n

    def steps(self, robot: int) -> int:
        """Return the number of steps of a robot's episode."""
        return int(self._time[robot])

    def read(self, index: int | slice = ALL) -> ForceReading:
        """Return the present contact forces."""
        blocks, estimator = self.batch.blocks[index], self._estimator
        nominal = self.adapter.force(blocks, self._target)
        known = nominal if self._sensors is None else self.adapter.force(self.model.blocks[index], self._target)
        chosen, paper = (
            np.asarray(factors[index])[..., None] * known for factors in (estimator.chosen, estimator.paper)
        )
        ratio = 1.0 if self._sensors is None else np.asarray(self._sensors.rigidity_ratio[index])[..., None]
        force_true = ratio * nominal
        regulated = force_true if self._settings.regulate == "true" else chosen
        force = as_scalar(norm(regulated), index)
        desired = self._desired(0, index)
        if self._vector:
            goal = self._goal_n[index].copy()
            error = as_scalar(norm(goal - regulated), index) / desired
        else:
            goal, error = desired, abs(force - desired) / desired
        return ForceReading(blocks, force_true, chosen, paper, regulated, force, desired, goal, error)

    def _desired(self, ahead: int, index: int | slice) -> Quantity:
        """Return the magnitude of the set-point some steps ahead [N]."""
        if self._profiles is None:
            return as_scalar(self._desired_n[index], index)
        robots, time = np.arange(self.count)[index], np.minimum(self._time[index] + ahead, PROFILE_STEPS - 1)
        return as_scalar(self._desired_n[index] * self._profiles[robots, time], index)

    def observe(self, reading: ForceReading, index: int | slice = ALL) -> np.ndarray:
        """Return flat observations, ``(k,)`` or ``(N, k)`` float32."""
        inputs = {"desired_force": reading.goal, "force_est": reading.force_est}
        if self._profiles is not None:
            inputs["desired_ahead"] = np.stack([self._desired(steps, index) for steps in AHEAD], axis=-1)
        measured, force = reading.regulated, reading.force
        if self._settings.regulate == "estimate":
            inputs["force_measured"] = measured
        if self._sensors is not None:
            measured = inputs["force_measured"] = self._sensors.measured_force(measured, self._time, index)
            force = as_scalar(norm(measured), index)
        inputs["force_error"] = reading.goal - (measured if self._vector else force)
        constants = {"obstacle": self._obstacle_features[index], "robot": self._robot_features[index]}
        rows = self.observer.rows(reading.blocks, inputs, constants)
        if self._sensors is not None:
            estimator = self._estimator
            contact, levers = self._layout.flags(self.model.blocks[index]), estimator.levers[index]
            share = self._target_share(self.model.blocks[index])
            known = Known(contact, self._tensions[index], estimator.free_forces[index], levers, share)
            self.observer.write_sensed(rows, known, self._sensors.pose_errors(self._time, index))
            rows = self._sensors.apply_latency(rows, self._time, index)
        self.observer.write_encoders(rows, self._encoders(index))
        return self.observer.clip(rows)

    def _target_share(self, blocks: np.ndarray) -> Quantity:
        """Return the share of the contact forces that is on the regulated obstacle, 0 where nothing touches."""
        if self._target is None:
            return 1.0
        sizes = norm(self._layout.forces(blocks))
        return np.asarray(sizes[..., self._target] / np.maximum(sizes.sum(axis=-1), TINY))

    def shaped(self, rows: np.ndarray, reading: ForceReading) -> Observation:
        """Return flat observations in the form that the settings ask for."""
        mode = self._settings.obs_mode
        if mode == "flat":
            return rows
        if mode == "dict":
            return self.observer.entries(rows)
        achieved, desired = self.goals(reading)
        return {"achieved_goal": achieved, "desired_goal": desired, "observation": rows}

    def goals(self, reading: ForceReading) -> tuple[np.ndarray, np.ndarray]:
        """Return regulated forces and set-points as goals, ``(..., 1)`` or ``(..., d)`` float32."""
        achieved = reading.regulated if self._vector else np.asarray(reading.force)[..., None]
        desired = reading.goal if self._vector else np.asarray(reading.goal)[..., None]
        return self.observer.as_goal(achieved), self.observer.as_goal(desired)

    def total_reward(self, reading: ForceReading, terms: tuple[Quantity, ...], index: int | slice = ALL) -> Quantity:
        """Return the reward: the sum of the terms, or that of goal-conditioned environments."""
        if self._settings.obs_mode != "goal":
            return sum(terms)
        return as_scalar(compute_reward(*self.goals(reading)), index)

    def rewards(self, reading: ForceReading, index: int | slice = ALL) -> tuple[Quantity, ...]:
        """Return the reward terms of the last step."""
        clearance = as_scalar(self._layout.clearance(reading.blocks)[..., 0], index) / self.adapter.scales.length_mm
        actions = self._last_actions[index]
        effort = as_scalar(dot(actions, actions) / actions.shape[-1], index)
        weights, force, desired = self._settings.weights, reading.force, reading.desired
        return reward_terms(weights, force, desired, reading.error, clearance, effort, operations(index))

    def infos(
        self, reading: ForceReading, terms: tuple[Quantity, ...], index: int | slice = ALL
    ) -> dict[str, Quantity]:
        """Return the info: Python numbers for one robot, arrays for many."""
        return {
            "force_true": reading.force_true,
            "force_est": reading.force_est,
            "force_est_paper": reading.force_paper,
            "desired_force": reading.goal,
            **self.adapter.info(reading.blocks, index),
            "solver_status": as_scalar(self.batch.statuses[index], index),
            "cost": operations(index).maximum(
                0.0, as_scalar(norm(reading.force_true), index) - self._settings.force_limit
            ),
            "is_success": reading.error <= SUCCESS_ERROR,
            **({"robot": self._drawn[index].copy()} if self._settings.randomize else {}),
            **({"obstacle_mm": self.obstacles_moved_mm(index)} if self._task.obstacles_move else {}),
            **{f"reward_{name}": term for name, term in zip(TERMS, terms, strict=True)},
        }

    def privileged_state(self, index: int | slice = ALL) -> PrivilegedState:
        """Return the hidden state."""
        sensors, force = self._sensors, self.read(index).regulated
        goal = self._goal_n[index].copy() if self._vector else self._desired(1, index)
        actuated = self._actuated_mm[index].copy()
        if sensors is None:
            ratio, loss, delay = (as_scalar(np.full(self.count, value)[index], index) for value in (1.0, 0.0, 0))
            return PrivilegedState(force, ratio, goal, actuated, actuated, np.zeros(actuated.shape), loss, delay)
        ratio, loss, delay = (
            as_scalar(entry[index], index) for entry in (sensors.rigidity_ratio, sensors.tendon_loss, sensors.latency)
        )
        motor, half_backlash = sensors.motor_mm(index).copy(), sensors.half_backlash_mm(index)
        return PrivilegedState(force, ratio, goal, actuated, motor, half_backlash, loss, delay)

    def move_obstacles(self, robot: int, scene: Scene) -> Scene:
        """Move the obstacles of a robot whose motors stay, as far as it lets them; return where they stand then.

        Raises:
            ValueError: If the obstacles cannot move there within a step; nothing has changed then.
        """
        batch, adapter = self.batch, self.adapter
        before = self._layout.cables(batch.blocks[robot]).copy()
        adapter.write_command(batch.commands, self._actuated_mm[robot], robot)
        batch.move(robot, [scene])
        blocks, now = batch.blocks[robot], batch.scene(robot)
        self._actuated_mm[robot] = adapter.actuated_mm(blocks, self._actuated_mm[robot])
        if self._sensors is not None:
            self._note_moves(self._sensors, before, blocks, robot)
            self._move_model(robot, now)
        if adapter.obstacle_size:
            self._obstacle_features[robot] = adapter.obstacle_features(now)
        back_mm = -self._motion_mm(robot)
        self._starts[robot] = Scene(obstacle.shifted(back_mm.tolist()) for obstacle in now)
        self._sense(robot)
        self._estimate(robot)
        return now

    def _move_model(self, robot: int, scene: Scene) -> None:
        """Move the obstacles of a robot's model to where those of the robot are.

        A model that cannot give way, as its cable is where the encoder reads it, goes there anew from the robot itself.
        """
        self.model.move(robot, [scene])
        if self.model.scene(robot) != scene:
            self.model.set_rows([robot], self.batch.get_rows([robot]))
            self.adapter.write_command(self.model.commands, self._encoders(robot), robot)
            self.model.move(robot)

    def _motion_mm(self, robot: int) -> np.ndarray:
        """Return how far the task has moved the obstacles of a robot since the start, ``(d,)`` [mm]."""
        if self._motions_mm is None:
            return np.zeros(self.adapter.space)
        return np.asarray(self._motions_mm[robot, min(int(self._time[robot]), PROFILE_STEPS - 1)])

    def set_desired_force(self, robot: int, force_n: float) -> None:
        """Set the magnitude of a robot's set-point, the largest one where it moves; a vector keeps its direction."""
        if self._vector:
            self._goal_n[robot] *= force_n / norm(self._goal_n[robot])
        self._desired_n[robot] = force_n

    def obstacles_moved_mm(self, index: int | slice) -> np.ndarray:
        """Return how far the first obstacle has moved since the start, ``(..., d)`` [mm]."""
        robots = np.arange(self.count)[index]
        moved = np.zeros((self.count, self.adapter.space))
        for robot in np.atleast_1d(robots).tolist():
            start = self._starts[robot]
            if start is not None and len(start):
                now = self.batch.scene(robot).obstacles[0].extent.center
                moved[robot] = np.subtract(now, start.obstacles[0].extent.center)
        return np.asarray(moved[index])

    def probe(self, actuated_mm: np.ndarray) -> np.ndarray:
        """Return the contact forces that all robots would have at other actuated coordinates; nothing moves.

        Args:
            actuated_mm: Actuated coordinates, ``(N, actions)`` [mm]; clipped to their bounds.

        Returns:
            Regulated contact forces, ``(N, d)`` [N].
        """
        adapter, actuated_mm = self.adapter, self.adapter.bounded(actuated_mm)
        blocks = self._probed(self.batch, actuated_mm)
        if self._settings.regulate == "estimate":
            return self._probe_estimate(blocks, actuated_mm)
        ratio = 1.0 if self._sensors is None else self._sensors.rigidity_ratio[:, None]
        return np.asarray(adapter.force(blocks, self._target) * ratio)

    def _probed(self, batch: BaseBatch, actuated_mm: np.ndarray) -> np.ndarray:
        """Return the equilibria of a batch at other actuated coordinates, ``(N, size)``."""
        commands = batch.commands.copy()
        self.adapter.write_command(commands, actuated_mm, ALL)
        return batch.probe(commands)

    def _probe_estimate(self, blocks: np.ndarray, actuated_mm: np.ndarray) -> np.ndarray:
        """Return the estimates for robots in other equilibria, where motors are as far off as now, ``(N, d)`` [N]."""
        tensions, onsets, known, read = self._layout.tensions(blocks), self._layout.onset(blocks), blocks, actuated_mm
        if self._sensors is not None:
            tensions, onsets = self._sensors.measured_tensions(tensions, self._time, ALL), self._onsets
            read = self.adapter.bounded(actuated_mm + (self._encoders(ALL) - self._actuated_mm))
            known = self._probed(self.model, read)
        factors = self._estimator.probe(Measured(known, read, tensions, onsets))
        return np.asarray(factors[:, None] * self.adapter.force(known, self._target))
