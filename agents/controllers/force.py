"""Proportional and proportional-integral control of the contact force."""

from dataclasses import dataclass, field

import numpy as np

from agents.arguments import LARGEST, check_real
from agents.environment import Environment, require_entries, require_env, require_reset
from agents.estimation.robot import RobotEstimator
from agents.policy import Observation, search
from agents.tuned import P_GAINS, PI_GAINS, tuned_gains


@dataclass(slots=True)
class ForceController:
    """Proportional-integral control of the contact force's magnitude, after a search for contact at full speed.

    The force is what :class:`agents.estimation.robot.RobotEstimator` knows of it. The action is the change of the
    controller's output (velocity form), so the integral does not wind up at saturation. All cables move in the
    direction of the search; an insertion stays where it is. A robot of S sections, each of which keeps its bend, is
    about S² times as stiff: the gains are divided by that.

    Attributes:
        proportional: Action per EI/L² of change in the force error.
        integral: Action per EI/L² of force error.
        name: Name of the policy.

    Raises:
        ValueError: If a gain is no finite number.
    """

    proportional: float = 0.3
    integral: float = 0.5
    name: str = "PI"
    _last: float | None = field(default=None, init=False)
    _estimator: RobotEstimator = field(init=False)
    _span: float = field(init=False)  # force that is observed as 1 [EI/L²]

    def __post_init__(self) -> None:
        self.proportional = check_real("proportional", self.proportional, -LARGEST)
        self.integral = check_real("integral", self.integral, -LARGEST)

    @classmethod
    def tuned(cls, env_id: str, sensing: str | None = None) -> "ForceController":
        """Return the controller with the gains that were best on training scenes.

        Args:
            env_id: Id of the environment.
            sensing: Its sensing; ``None`` for the one that it is usually evaluated with.

        Raises:
            ValueError: If nothing was tuned for the environment.
        """
        return cls(*tuned_gains(PI_GAINS, env_id, sensing))

    @classmethod
    def proportional_only(cls, env_id: str, sensing: str | None = None) -> "ForceController":
        """Return the tuned controller whose action is proportional to the force error; see :meth:`tuned`."""
        return cls(0.0, tuned_gains(P_GAINS, env_id, sensing), "P")

    def reset(self, env: Environment | None = None) -> None:
        """Forget the last error and what was known of the robot.

        Raises:
            ValueError: If there is no environment.
            TypeError: If it is none of ccr_gym, or several.
        """
        self._last = None
        settings = require_env(env).get_wrapper_attr("settings")
        self._estimator, self._span = RobotEstimator(settings, 1), settings.force_span

    def act(self, observation: Observation) -> np.ndarray:
        """Return the search action until something touches, then control the force.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
            ValueError: If the observation is none of ``obs_mode="dict"``.
        """
        require_reset(self)
        require_entries(observation)
        force = float(self._estimator.update_one(observation).force)
        if not observation["contact"].any():
            self._last = None
            return search(observation)
        error = self._span * float(np.linalg.norm(observation["desired_force"])) - force
        change = 0.0 if self._last is None else error - self._last
        self._last = error
        wanted = (self.proportional * change + self.integral * error) / _sections(observation) ** 2
        return np.asarray(min(max(wanted, -1.0), 1.0) * search(observation), np.float32)


def _sections(observation: Observation) -> int:
    """Return the number of sections of the robot, each of which has a command, in space two."""
    return observation["cable"].size // (2 if "obstacle" in observation else 1)
