"""Slopes of the steps of a vector environment."""

from abc import abstractmethod

import numpy as np

from ccr_gym.arrays import StepSlopes
from ccr_gym.checks import check_array
from ccr_gym.episodes import EpisodeBatch


class DifferentiableSteps:
    """Base class of vector environments whose steps are differentiated, if they are asked for it."""

    num_envs: int
    _episodes: EpisodeBatch

    @abstractmethod
    def _check_started(self, asked: str) -> None:
        """Raise an error before the first reset."""

    def force_slopes(self) -> np.ndarray:
        """Return the slopes of regulated contact forces in the actuated coordinates, ``(N, actions, d)`` [N/mm].

        They are those of :meth:`ccr_gym.ContactVectorEnv.probe` at the present coordinates, and need no
        ``derivatives=True``.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        self._check_started("force_slopes")
        return self._episodes.force_slopes()

    @property
    def delayed_columns(self) -> np.ndarray:
        """Which columns of a flat observation latency delays, ``(columns,)`` bool."""
        return self._episodes.observer.delayed.copy()

    @property
    def slopes(self) -> StepSlopes:
        """Slopes of the last step; zero for environments that it has reset, and after a state was set.

        The next step writes into the same arrays: copy what is to be kept.

        Raises:
            ValueError: If steps are not differentiated.
        """
        slopes = self._episodes.slopes
        if slopes is None:
            raise ValueError("derivatives is False; steps are differentiated by an environment with derivatives=True")
        return slopes

    def vjp(
        self,
        *,
        observation: np.ndarray | None = None,
        reward: np.ndarray | None = None,
        force_true: np.ndarray | None = None,
        force_est: np.ndarray | None = None,
        regulated: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the vector-Jacobian product of the last step: cotangents of the actions, ``(N, actions)``.

        What came before the step is held, also what the estimate has learnt. Columns of the observation that come late
        do not depend on the action.

        Args:
            observation: Cotangents of the flat observation, ``(N, columns)``.
            reward: Of the reward, ``(N,)``.
            force_true: Of the contact force, ``(N, d)``.
            force_est: Of its estimate, ``(N, d)``.
            regulated: Of the one that is desired, ``(N, d)``.

        Raises:
            ValueError: If steps are not differentiated, or cotangents are not finite real numbers of these shapes.
        """
        given = {"observation": observation, "reward": reward, "force_true": force_true}
        given |= {"force_est": force_est, "regulated": regulated}
        slopes, checked = self.slopes, {}
        for name, cotangent in given.items():
            if cotangent is not None:
                shape = (self.num_envs, *getattr(slopes, name).shape[2:])
                checked[name] = check_array(name, cotangent, shape)
        return self._episodes.vjp(checked)
