"""The network that acts, and the normalisation of its inputs."""

from itertools import pairwise

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common.policies import ActorCriticPolicy, BasePolicy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.sac.policies import SACPolicy
from torch import nn

from agents.tuned import LearnerSettings, RecurrentPPOSettings, SACSettings

CLIP = 10.0  # of normalised inputs, in standard deviations
EPSILON = 1e-8  # added to their variance
LSTMState = tuple[torch.Tensor, torch.Tensor]


class Network(nn.Module):
    """Maps a normalised input row to the mean action.

    Args:
        inputs: Size of a row.
        actions: Size of an action.
        settings: Settings of the learner, for the number of units.
    """

    def __init__(self, inputs: int, actions: int, settings: LearnerSettings) -> None:
        super().__init__()
        width, self.squashed = settings.width, isinstance(settings, SACSettings)
        self.lstm = nn.LSTM(inputs, settings.hidden) if isinstance(settings, RecurrentPPOSettings) else None
        sizes = [inputs, width, width] if self.lstm is None else [self.lstm.hidden_size, width]
        layers: list[nn.Module] = []
        for before, after in pairwise(sizes):
            layers += [nn.Linear(before, after), nn.ReLU() if self.squashed else nn.Tanh()]
        self.layers = nn.Sequential(*layers, nn.Linear(width, actions))

    def forward(self, row: torch.Tensor, state: LSTMState | None = None) -> tuple[torch.Tensor, LSTMState | None]:
        """Return the action ``(1, actions)`` for a row ``(1, inputs)``, and the state of the LSTM."""
        if self.lstm is not None:
            row, state = self.lstm(row, state)
        action = self.unbounded(row)
        return torch.tanh(action) if self.squashed else action.clip(-1.0, 1.0), state

    def unbounded(self, row: torch.Tensor) -> torch.Tensor:
        """Return the action before it is clipped or squashed to its bounds."""
        return torch.as_tensor(self.layers(row))

    @classmethod
    def of(cls, policy: BasePolicy, settings: LearnerSettings) -> "Network":
        """Return the acting network of a policy of Stable-Baselines3."""
        assert isinstance(policy.observation_space, spaces.Box)
        assert isinstance(policy.action_space, spaces.Box)
        network = cls(policy.observation_space.shape[0], policy.action_space.shape[0], settings)
        for mine, theirs in zip(network.layers, _layers(policy), strict=True):
            mine.load_state_dict(theirs.state_dict())
        if network.lstm is not None:
            assert isinstance(policy, RecurrentActorCriticPolicy)
            network.lstm.load_state_dict(policy.lstm_actor.state_dict())
        return network


def _layers(policy: BasePolicy) -> list[nn.Module]:
    """Return the layers from the input, or the LSTM, to the mean action."""
    if isinstance(policy, SACPolicy):
        assert isinstance(policy.actor.latent_pi, nn.Sequential)
        return [*policy.actor.latent_pi, policy.actor.mu]
    assert isinstance(policy, ActorCriticPolicy)
    return [*policy.mlp_extractor.policy_net, policy.action_net]


def normalized(rows: np.ndarray, mean: np.ndarray, deviation: np.ndarray) -> torch.Tensor:
    """Return rows as the network takes them."""
    return torch.as_tensor(np.clip((rows - mean) / deviation, -CLIP, CLIP), dtype=torch.float32)


def standard_deviation(statistics: RunningMeanStd) -> np.ndarray:
    """Return what rows are divided by."""
    return np.asarray(np.sqrt(statistics.var + EPSILON))
