"""Episodes of one task side by side: what is read of them, observation, reward and info.

Single and vector environments are both shells around an :class:`EpisodeBatch`, so their results cannot differ.
"""

import numpy as np

from ccr_gym.arrays import FORCES, NUMBERS
from ccr_gym.estimation import Measured
from ccr_gym.goals import compute_reward
from ccr_gym.observation import Observation
from ccr_gym.quantities import Quantity, norm
from ccr_gym.readings import ForceReading, PrivilegedState
from ccr_gym.reward import SUCCESS_ERROR
from ccr_gym.task import PROFILE_STEPS
from ccr_gym.transition import Transition
from solver import Scene
from solver.common.batch import BaseBatch
from solver.common.transition import Stage

ALL = slice(None)
SHOWN_FORCE = 4.0  # that fills the scale of a picture [EI/L²]
ERROR, REWARD, COST = map(NUMBERS.index, ("error", "reward", "cost"))
ACTUATORS = len(NUMBERS)
INFO_KEYS = (*FORCES[:3], "desired_force", "solver_status", "is_success", *NUMBERS[COST:])


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
        return int(self._state.time[robot])

    def step(self, actions: np.ndarray, robots: np.ndarray | None = None) -> None:
        """Move the actuated coordinates; see :meth:`ccr_gym.transition.Transition.step`."""
        super().step(actions, robots)
        if self.slopes is not None and self._settings.obs_mode == "goal":
            at = self._robots if robots is None else robots
            self.slopes.effort[at] = 0.0
            self.slopes.reward[at] = np.einsum("npk,nk->np", self.slopes.regulated[at], self._goal_slopes()[at])

    def _goal_slopes(self) -> np.ndarray:
        """Return the slopes of the reward of the goal-conditioned form in the regulated forces, ``(N, d)`` [1/N]."""
        found, force = self.readings, self.readings.forces[:, -1]
        desired, (achieved, _) = found.number("desired")[:, None], self._goals(ALL)
        way = force - found.goal if self._vector else force * np.sign(norm(force)[:, None] - desired)
        size, within = norm(way)[:, None], (found.number("error")[:, None] < 1.0) & (np.abs(achieved) < 1.0)
        return np.asarray(-np.divide(way, size * desired, out=np.zeros_like(way), where=within & (size > 0)))

    def read(self, index: int | slice = ALL) -> ForceReading:
        """Return the present contact forces of one robot, or of many."""
        at = self._robots[index if isinstance(index, slice) else slice(index, index + 1)]
        self._run(at, Stage.READ)
        found = self.readings
        true, estimate, _, regulated = (found.forces[index, k].copy() for k in range(len(FORCES)))
        return ForceReading(true, estimate, regulated, found.number("desired")[index].copy())

    def observation(self, index: int | slice = ALL) -> Observation:
        """Return the last observation of one robot, or of all, in the form that the settings ask for."""
        rows, mode = self.readings.observation[index].copy(), self._settings.obs_mode
        if mode == "flat":
            return rows
        if mode == "dict":
            return self.observer.entries(rows)
        achieved, desired = self._goals(index)
        return {"achieved_goal": achieved, "desired_goal": desired, "observation": rows}

    def _goals(self, index: int | slice) -> tuple[np.ndarray, np.ndarray]:
        """Return regulated forces and set-points as goals, ``(..., 1)`` or ``(..., d)`` float32."""
        found = self.readings
        if self._vector:
            return self.observer.as_goal(found.forces[index, -1]), self.observer.as_goal(found.goal[index])
        achieved, desired = (found.numbers[index, k, None] for k in range(2))
        return self.observer.as_goal(achieved), self.observer.as_goal(desired)

    def rewards(self, index: int | slice = ALL) -> Quantity:
        """Return the reward of the last step: the sum of the terms, or that of the goal-conditioned form."""
        if self._settings.obs_mode == "goal":
            return compute_reward(*self._goals(index))
        return self.readings.numbers[index, REWARD].copy()

    def info(self) -> dict[str, Quantity]:
        """Return the info of the first robot; its numbers have a dtype, which some clients look at, but for flags."""
        found = self.readings
        forces, numbers, goal = found.forces[0].copy(), found.numbers[0].copy(), found.goal[0].copy()
        success = bool(numbers[ERROR] <= SUCCESS_ERROR)
        known = forces[0], forces[1], forces[2], goal, self.batch.statuses[0], success, *numbers[COST:ACTUATORS]
        info: dict[str, Quantity] = dict(zip(INFO_KEYS, known, strict=True))
        info.update(self.adapter.info(numbers[ACTUATORS:]))
        return self._add_varied(info, 0) if self._varies else info

    def infos(self) -> dict[str, np.ndarray]:
        """Return the info of all robots, as arrays."""
        found = self.readings
        forces, goal, numbers = found.forces.transpose(1, 0, 2).copy(), found.goal.copy(), found.numbers.T.copy()
        success = numbers[ERROR] <= SUCCESS_ERROR
        known = forces[0], forces[1], forces[2], goal, self.batch.statuses.copy(), success, *numbers[COST:ACTUATORS]
        info: dict[str, np.ndarray] = dict(zip(INFO_KEYS, known, strict=True))
        info.update(self.adapter.info(numbers[ACTUATORS:]))
        return self._add_varied(info, ALL) if self._varies else info

    @property
    def _varies(self) -> bool:
        """Whether an info tells what an episode varies."""
        return self._settings.randomize is not None or self._task.obstacles_move

    def _add_varied(self, info: dict[str, Quantity], index: int | slice) -> dict[str, Quantity]:
        """Add what an episode varies to an info: the robot, and where the first obstacle has moved to."""
        if self._settings.randomize:
            info["robot"] = self._state.drawn[index].copy()
        if self._task.obstacles_move:
            info["obstacle_mm"] = self.obstacles_moved_mm(index)
        return info

    def vjp(self, cotangents: dict[str, np.ndarray]) -> np.ndarray:
        """Return the vector-Jacobian product of the last steps in their actions, ``(N, actions)``.

        Args:
            cotangents: Of fields of :class:`ccr_gym.arrays.StepSlopes`; those of delayed columns of the observation do
                not count, as they do not depend on the last action.
        """
        slopes = self.slopes
        assert slopes is not None
        if self._sensors is not None and "observation" in cotangents:
            late = (self._sensors.latency > 0)[:, None] & self.observer.delayed
            cotangents = cotangents | {"observation": np.where(late, 0.0, cotangents["observation"])}
        commanded, motors = slopes.split(slopes.of_inputs(cotangents))
        direct = slopes.effort * cotangents["reward"][:, None] if "reward" in cotangents else 0.0
        return np.asarray(slopes.motor_per_action * (motors + slopes.follows * commanded) + direct)

    def privileged_state(self, index: int | slice = ALL) -> PrivilegedState:
        """Return the hidden state of one robot, or of many."""
        sensors, state = self._sensors, self._state
        force, actuated = self.read(index).regulated, state.actuated_mm[index].copy()
        goal = (state.goal_n if self._vector else self._desired_next())[index].copy()
        ratio, loss, delay = np.ones(self.count), np.zeros(self.count), np.zeros(self.count, int)
        motor, half_backlash = actuated, np.zeros(actuated.shape)
        if sensors is not None:
            ratio, loss, delay = sensors.rigidity_ratio, sensors.tendon_loss, sensors.latency
            motor, half_backlash = sensors.motor_mm[index].copy(), sensors.half_backlash_mm[index]
        ratio, loss, delay = (entry[index].copy() for entry in (ratio, loss, delay))
        return PrivilegedState(force, ratio, goal, actuated, motor, half_backlash, loss, delay)

    def _desired_next(self) -> np.ndarray:
        """Return the magnitudes of the set-points after the next step, ``(N,)`` [N]."""
        state = self._state
        if state.profiles is None:
            return state.desired_n
        ahead = state.profiles[self._robots, np.minimum(state.time + 1, PROFILE_STEPS - 1)]
        return np.asarray(state.desired_n * ahead)

    def move_obstacles(self, robot: int, scene: Scene) -> Scene:
        """Move the obstacles of a robot whose motors stay, as far as it lets them; return where they stand then.

        Raises:
            ValueError: If the obstacles cannot move there within a step; nothing has changed then.
        """
        batch, adapter, at = self.batch, self.adapter, self._robots[robot : robot + 1]
        self._run(at, Stage.MARK)
        adapter.write_command(batch.commands, self._state.actuated_mm[robot], robot)
        batch.move(robot, [scene])
        now = batch.scene(robot)
        self._run(at, Stage.REACH)
        if self._sensors is not None:
            self._move_model(robot, now)
        if adapter.obstacle_size:
            self._state.obstacle_features[robot] = adapter.obstacle_features(now)
        back_mm = -self._motion_mm(robot)
        self._starts[robot] = Scene(obstacle.shifted(back_mm.tolist()) for obstacle in now)
        self._run(at, Stage.SENSE, Stage.READ)
        return now

    def _move_model(self, robot: int, scene: Scene) -> None:
        """Move the obstacles of a robot's model to where those of the robot are.

        A model that cannot give way, as its cable is where the encoder reads it, goes there anew from the robot itself.
        """
        self.model.move(robot, [scene])
        if self.model.scene(robot) != scene:
            self.model.set_rows([robot], self.batch.get_rows([robot]))
            self.adapter.write_command(self.model.commands, self._encoders()[robot], robot)
            self.model.move(robot)

    def _motion_mm(self, robot: int) -> np.ndarray:
        """Return how far the task has moved the obstacles of a robot since the start, ``(d,)`` [mm]."""
        motions_mm = self._state.motions_mm
        if motions_mm is None:
            return np.zeros(self.adapter.space)
        return np.asarray(motions_mm[robot, min(int(self._state.time[robot]), PROFILE_STEPS - 1)])

    def set_desired_force(self, robot: int, force_n: float) -> None:
        """Set the magnitude of a robot's set-point, the largest one where it moves; a vector keeps its direction."""
        if self._vector:
            self._state.goal_n[robot] *= force_n / norm(self._state.goal_n[robot])
        self._state.desired_n[robot] = force_n

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

    def force_slopes(self) -> np.ndarray:
        """Return the slopes of regulated contact forces in the actuated coordinates, ``(N, actions, d)`` [N/mm].

        They are those of :meth:`probe` where robots are, whatever has brought them there: motors are as far off as now.
        """
        kernel, slopes = self._differentiator()
        kernel.run(self._robots, self._no_actions, Stage.DERIVE_HERE, Stage.DERIVE_HERE)
        found, actions = slopes.regulated, self.adapter.actions.size
        return np.asarray(found.copy() if slopes.ideal else found[:, :actions] + found[:, actions:])

    def _probed(self, batch: BaseBatch, actuated_mm: np.ndarray) -> np.ndarray:
        """Return the equilibria of a batch at other actuated coordinates, ``(N, size)``."""
        commands = batch.commands.copy()
        self.adapter.write_command(commands, actuated_mm, ALL)
        return batch.probe(commands)

    def _probe_estimate(self, blocks: np.ndarray, actuated_mm: np.ndarray) -> np.ndarray:
        """Return the estimates for robots in other equilibria, where motors are as far off as now, ``(N, d)`` [N]."""
        tensions, onsets, known, read = self._layout.tensions(blocks), self._layout.onset(blocks), blocks, actuated_mm
        if self._sensors is not None:
            nominal, tensions, onsets = np.ascontiguousarray(tensions), np.empty(tensions.shape), self._state.onsets
            self._kernel.measure_tensions(self._robots, nominal, tensions)
            read = self.adapter.bounded(actuated_mm + (self._encoders() - self._state.actuated_mm))
            known = self._probed(self.model, read)
        factors = self._estimator.probe(Measured(known, read, *map(np.ascontiguousarray, (tensions, onsets))))
        return np.asarray(factors[:, None] * self.adapter.force(known, self._target))
