"""The arrays of N episodes that the kernel writes, a row for each: their state, what is read of them, slopes of it."""

from typing import NamedTuple

import numpy as np

from ccr_gym.adapters import AnyAdapter
from ccr_gym.randomization import DRAWN_SIZE
from ccr_gym.reward import TERMS
from ccr_gym.state import Arrays
from ccr_gym.task import PROFILE_STEPS, AnyTask

FORCES = ("force_true", "force_est", "force_est_paper", "regulated")  # that are read, in the kernel's order
NUMBERS = ("force", "desired", "error", "reward", "cost", *(f"reward_{term}" for term in TERMS))  # likewise


class EpisodeArrays(NamedTuple):
    """State of N episodes, a row for each; ``None`` for what the task has not.

    Attributes:
        desired_n: Magnitudes of the set-points, the largest ones where they move, ``(N,)`` [N].
        goal_n: The set-points where they are vectors, ``(N, d)`` [N].
        profiles: Factors of moving set-points at every step, ``(N, PROFILE_STEPS)``.
        motions_mm: Displacements of moving obstacles at every step, ``(N, PROFILE_STEPS, d)`` [mm].
        actuated_mm: Actuated coordinates, ``(N, actions)`` [mm].
        last_actions: Actions of the last steps, ``(N, actions)``.
        obstacle_features: What is observed of the first obstacles, ``(N, k)``.
        drawn: What the robots are, ``(N, 4)``.
        robot_features: The same as it is observed, ``(N, 4)``.
        time: Steps of the episodes, ``(N,)``.
        tensions: Tensions as the motors see them, ``(N, cables)`` [N].
        onsets: Those before the model's present contact, ``(N, cables)`` [N].
    """

    desired_n: np.ndarray
    goal_n: np.ndarray
    profiles: np.ndarray | None
    motions_mm: np.ndarray | None
    actuated_mm: np.ndarray
    last_actions: np.ndarray
    obstacle_features: np.ndarray
    drawn: np.ndarray
    robot_features: np.ndarray
    time: np.ndarray
    tensions: np.ndarray
    onsets: np.ndarray

    @classmethod
    def make(cls, task: AnyTask, adapter: AnyAdapter, count: int) -> "EpisodeArrays":
        """Return the arrays of N episodes that have not begun."""
        space, actions, cables = adapter.space, adapter.actions.size, len(adapter.settings.robot.cables)
        return cls(
            desired_n=np.ones(count),
            goal_n=np.ones((count, space)),
            profiles=np.ones((count, PROFILE_STEPS)) if task.moving else None,
            motions_mm=np.zeros((count, PROFILE_STEPS, space)) if task.obstacles_move else None,
            actuated_mm=np.zeros((count, actions)),
            last_actions=np.zeros((count, actions)),
            obstacle_features=np.zeros((count, adapter.obstacle_size)),
            drawn=np.ones((count, DRAWN_SIZE)),
            robot_features=np.zeros((count, DRAWN_SIZE)),
            time=np.zeros(count, np.int64),
            tensions=np.zeros((count, cables)),
            onsets=np.zeros((count, cables)),
        )

    @property
    def given(self) -> Arrays:
        """The arrays that there are, by name."""
        return {name: array for name, array in self._asdict().items() if array is not None}


class Readings(NamedTuple):
    """What was read of N robots after their last steps, a row for each.

    Attributes:
        forces: The forces of :data:`FORCES`, ``(N, 4, d)`` [N].
        numbers: The numbers of :data:`NUMBERS`, then those of the actuators, ``(N, k)``.
        goal: Set-points, magnitudes ``(N,)`` or vectors ``(N, d)`` [N].
        observation: Flat observations, ``(N, columns)`` float32.
    """

    forces: np.ndarray
    numbers: np.ndarray
    goal: np.ndarray
    observation: np.ndarray

    @classmethod
    def make(cls, task: AnyTask, adapter: AnyAdapter, columns: int, count: int) -> "Readings":
        """Return the arrays before anything was read."""
        goal = (count, adapter.space) if task.force_vector else (count,)
        forces, numbers = (
            np.zeros((count, len(FORCES), adapter.space)),
            np.zeros((count, len(NUMBERS) + adapter.actuator_numbers)),
        )
        return cls(forces, numbers, np.zeros(goal), np.zeros((count, columns), np.float32))

    def number(self, name: str) -> np.ndarray:
        """Return one of the numbers of all robots, ``(N,)``."""
        return self.numbers[:, NUMBERS.index(name)]


class StepSlopes(NamedTuple):
    """Slopes of the last steps of N episodes, a row for each.

    The inputs are the actuated coordinates that the robot was commanded to, and where sensing is not ideal after them
    those of the motors, q = actions or 2 · actions. Where the robot, or the model that is known of it, did not converge
    but snapped, stalled or was blocked, its own slopes are zero (``found``). Steps of a sensor's resolution count as
    the line through them. Tensions at the onset of a contact count as given, also in the step in which it begins.

    Attributes:
        observation: Slopes of the observation without its delay, zero where it is at a bound, ``(N, q, columns)``.
        force_true: Of the contact force, ``(N, q, d)`` [N/mm].
        force_est: Of its estimate, ``(N, q, d)`` [N/mm].
        regulated: Of the one that is desired, ``(N, q, d)`` [N/mm].
        reward: Of the reward, ``(N, q)``.
        present: The observation without its delay, ``(N, columns)`` float32.
        motor_per_action: Slopes of the motors in the action, zero at a bound, ``(N, actions)`` [mm].
        motor_per_motor: Slopes of the motors in where they were: 1, or 0 at a bound, ``(N, actions)``.
        follows: Slopes of the commanded coordinates in the motors: 1, or 0 amid the backlash, ``(N, actions)``.
        effort: Slopes of the reward in the action itself, ``(N, actions)``.
        found: Whether robot and model converged, ``(N,)`` bool.
    """

    observation: np.ndarray
    force_true: np.ndarray
    force_est: np.ndarray
    regulated: np.ndarray
    reward: np.ndarray
    present: np.ndarray
    motor_per_action: np.ndarray
    motor_per_motor: np.ndarray
    follows: np.ndarray
    effort: np.ndarray
    found: np.ndarray

    @classmethod
    def make(cls, adapter: AnyAdapter, columns: int, count: int) -> "StepSlopes":
        """Return slopes before any step: none."""
        actions, space = adapter.actions.size, adapter.space
        inputs = actions if adapter.settings.sensors is None else 2 * actions
        return cls(
            observation=np.zeros((count, inputs, columns)),
            **{name: np.zeros((count, inputs, space)) for name in ("force_true", "force_est", "regulated")},
            reward=np.zeros((count, inputs)),
            present=np.zeros((count, columns), np.float32),
            **{name: np.zeros((count, actions)) for name in ("motor_per_action", "motor_per_motor")},
            **{name: np.zeros((count, actions)) for name in ("follows", "effort")},
            found=np.zeros(count, bool),
        )

    @property
    def ideal(self) -> bool:
        """Whether the coordinates are those of the motors."""
        return self.reward.shape == self.effort.shape

    def clear(self, robots: np.ndarray) -> None:
        """Set slopes of robots that no step has brought where they are to zero."""
        for name, array in self._asdict().items():
            if name != "present":
                array[robots] = 0

    def of_inputs(self, cotangents: dict[str, np.ndarray]) -> np.ndarray:
        """Return sums of slopes in the inputs times cotangents, by the names of fields, ``(N, q)``."""
        total = np.zeros(self.reward.shape)
        for name, cotangent in cotangents.items():
            slopes = getattr(self, name)
            total += slopes * cotangent[:, None] if slopes.ndim == 2 else np.einsum("npk,nk->np", slopes, cotangent)
        return total

    def split(self, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return cotangents ``(N, q)`` of commanded coordinates and of motors, ``(N, actions)`` each.

        Where sensing is ideal the coordinates are those of the motors.
        """
        actions = self.follows.shape[1]
        commanded = inputs[:, :actions]
        return commanded, inputs[:, actions:] if inputs.shape[1] > actions else np.zeros_like(commanded)
