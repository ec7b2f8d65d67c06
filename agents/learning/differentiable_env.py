"""Steps of a vector environment as functions of torch tensors, with gradients through the exact solve."""

from collections import deque
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from agents.arguments import check_kind
from ccr_gym import ContactVectorEnv, StepSlopes

DTYPES = (torch.float32, torch.float64)
HISTORY = 8  # observations that latency looks back on, the largest latency and one


class StepOutputs(NamedTuple):
    """What a step returns, differentiable in all actions since the last :meth:`DifferentiableVectorEnv.detach`.

    Attributes:
        observation: Observations, ``(N, columns)``.
        reward: Rewards, ``(N,)``.
        force: Contact forces that are regulated, ``(N, d)`` [N].
        force_est: Their estimates, ``(N, d)`` [N].
        truncated: Whether episodes have ended, ``(N,)`` bool.
        infos: As the environment returns them.
    """

    observation: torch.Tensor
    reward: torch.Tensor
    force: torch.Tensor
    force_est: torch.Tensor
    truncated: np.ndarray
    infos: dict[str, Any]


class _Context(torch.autograd.function.FunctionCtx):
    """What the forward pass keeps for the gradients."""

    slopes: StepSlopes


class _Step(torch.autograd.Function):
    """The map ``(actions, motors, coordinates) → observation now, reward, forces, motors, coordinates``."""

    @staticmethod
    def forward(
        ctx: _Context,
        actions: torch.Tensor,
        motors: torch.Tensor,
        actuated: torch.Tensor,
        env: "DifferentiableVectorEnv",
    ) -> tuple[torch.Tensor, ...]:
        """Step the environment."""
        env.play(actions.detach().numpy())
        state = env.env.privileged_state
        ctx.slopes = slopes = StepSlopes(*(array.copy() for array in env.env.slopes))
        outputs = slopes.present, env.reward, state.force, env.infos["force_est"], state.motor_mm, state.actuated_mm
        return tuple(torch.as_tensor(output, dtype=actions.dtype) for output in outputs)

    @staticmethod
    def backward(ctx: _Context, *gradients: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        """Return the gradients with respect to actions, motors and coordinates, ``(N, actions)`` each."""
        slopes = ctx.slopes
        observation, reward, force, force_est, motors, actuated = (gradient.numpy() for gradient in gradients)
        outputs = {"observation": observation, "reward": reward, "regulated": force, "force_est": force_est}
        commanded, moved = slopes.split(slopes.of_inputs(outputs))
        commanded = commanded + slopes.found[:, None] * actuated  # where a robot did not get there it stays where it is
        if slopes.ideal:
            commanded = commanded + slopes.found[:, None] * motors
        else:
            moved = moved + motors
        total = moved + slopes.follows * commanded
        direct = slopes.effort * reward[:, None]
        found = (slopes.motor_per_action * total + direct, slopes.motor_per_motor * total)
        resting = (1 - slopes.follows) * commanded
        dtype = gradients[0].dtype
        return *(torch.as_tensor(gradient, dtype=dtype) for gradient in (*found, resting)), None


class DifferentiableVectorEnv:
    """A vector environment whose steps are differentiable, through backlash and latency.

    What the estimate of the force has learnt before a contact, the rigidity and the tensions at its onset, counts as
    given. Gradients are sub-gradients at the ends of the backlash and of the ranges. Through a snap, stall or block
    they are zero. Environments restart in the step after the end of an episode, through which no gradient goes.

    Attributes:
        env: The environment.
        reward: Rewards of the last step, ``(N,)``.
        infos: Infos of the last step or reset.

    Args:
        env: An environment with ``derivatives=True``, flat observations and the autoreset mode ``NextStep``.
        dtype: Type of the tensors, ``torch.float32`` or ``torch.float64``.

    Raises:
        ValueError: If the environment does not differentiate its steps, or has another form of observations or resets.
        TypeError: If it is no vector environment of this project.
    """

    def __init__(self, env: ContactVectorEnv, dtype: torch.dtype = torch.float32) -> None:
        check_kind("env", env, ContactVectorEnv, "make one by gymnasium.make_vec(…, derivatives=True).unwrapped")
        check_kind("dtype", dtype, torch.dtype, "take torch.float32 or torch.float64")
        if dtype not in DTYPES:
            raise ValueError(f"dtype is {dtype}; it must be torch.float32 or torch.float64")
        if env.settings.obs_mode != "flat":
            raise ValueError(f"obs_mode is {env.settings.obs_mode!r}; it must be 'flat' for observations to be tensors")
        if env.autoreset_mode is not AutoresetMode.NEXT_STEP:
            raise ValueError(f"autoreset_mode is {env.autoreset_mode.value!r}; it must be 'NextStep'")
        if dtype not in (torch.float32, torch.float64):
            raise ValueError(f"dtype is {dtype}; it must be torch.float32 or torch.float64")
        self.env, self._dtype = env, dtype
        self._motors = self._actuated = torch.zeros(env.slopes.effort.shape, dtype=dtype)
        self._late = torch.as_tensor(env.delayed_columns)
        self._robots = torch.arange(env.num_envs)
        self._rows: deque[torch.Tensor] = deque(maxlen=HISTORY)
        self._restarting = self._truncated = np.zeros(env.num_envs, bool)
        self.reward, self.infos = np.zeros(env.num_envs), dict[str, Any]()

    def reset(self, seed: int | None = None) -> torch.Tensor:
        """Start new episodes, and return their observations ``(N, columns)``."""
        observation, self.infos = self.env.reset(seed=seed)
        self._read_state()
        self._restarting = np.zeros(self.env.num_envs, bool)
        present = torch.as_tensor(self.env.slopes.present.copy(), dtype=self._dtype)
        self._rows.extend([present] * HISTORY)
        return torch.as_tensor(observation, dtype=self._dtype)

    def step(self, actions: torch.Tensor) -> StepOutputs:
        """Move the cables by actions ``(N, actions)``; those of environments that restart do not count.

        Raises:
            gymnasium.error.ResetNeeded: Before the first :meth:`reset`, whatever the environment has done before.
            TypeError: If the actions are no tensor.
            ValueError: If the actions are not finite numbers of this shape.
        """
        if not self._rows:
            raise ResetNeeded("call reset() before step()")
        check_kind("actions", actions, torch.Tensor, "it must be a tensor")
        outputs = _Step.apply(actions.to(self._dtype), self._motors, self._actuated, self)  # type: ignore[no-untyped-call]
        present, reward, force, force_est, self._motors, self._actuated = outputs
        restarted = torch.as_tensor(self._restarting)[:, None]
        if self._restarting.any():
            self._rows = deque([torch.where(restarted, present, row) for row in self._rows], maxlen=HISTORY)
        self._rows.append(present)
        self._restarting = self._truncated
        return StepOutputs(self._delayed(present), reward, force, force_est, self._truncated, self.infos)

    def detach(self) -> None:
        """End the graph here: gradients of what follows do not reach back to actions up to now."""
        self._motors, self._actuated = self._motors.detach(), self._actuated.detach()
        self._rows = deque([row.detach() for row in self._rows], maxlen=HISTORY)

    def play(self, actions: np.ndarray) -> None:
        """Step the environment by numbers."""
        _, self.reward, _, self._truncated, self.infos = self.env.step(actions)

    def _read_state(self) -> None:
        state = self.env.privileged_state
        self._motors, self._actuated = (
            torch.as_tensor(at, dtype=self._dtype) for at in (state.motor_mm, state.actuated_mm)
        )

    def _delayed(self, present: torch.Tensor) -> torch.Tensor:
        """Return the observations, of which some columns are those of earlier steps."""
        latency = torch.as_tensor(np.asarray(self.env.privileged_state.latency))
        earlier = torch.stack(list(self._rows))[HISTORY - 1 - latency, self._robots]
        return torch.where(self._late, earlier, present)
