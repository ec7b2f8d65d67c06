"""Settings of controllers and learners, tuned on training scenes with realistic sensing (``ccr-gym sweep``)."""

from dataclasses import dataclass
from typing import ClassVar

PI_GAINS = {  # action per newton of change in the force error; action per newton of force error
    "CCR/LoadCell-v0": (38.9, 28.9),
    "CCR/PushObstacle-v0": (15.7, 10.5),
    "CCR/TrackForce-v0": (26.0, 10.7),
    "CCR/BracedPush-v0": (18.3, 12.3),
    "CCR/SoftObstacle-v0": (18.6, 13.6),
    "CCR/InsertAndPush-v0": (4.6, 2.9),
    "CCR/SpatialPush-v0": (16.6, 12.0),
}
P_GAINS = {  # action per newton of force error
    "CCR/LoadCell-v0": 21.8,
    "CCR/PushObstacle-v0": 8.7,
    "CCR/TrackForce-v0": 10.8,
    "CCR/BracedPush-v0": 9.2,
    "CCR/SoftObstacle-v0": 10.3,
    "CCR/InsertAndPush-v0": 2.3,
    "CCR/SpatialPush-v0": 9.2,
}
NEWTON_GAIN = 0.8  # share of a Newton step


@dataclass(frozen=True, slots=True)
class MPCSettings:
    """Settings of the model-predictive controller."""

    horizon: int = 8
    """Steps of a plan."""
    effort: float = 0.05
    """Weight of the squared force change of each move, relative to the squared force errors."""
    slope: float = 0.03
    """Slope of the force over the cable that is assumed at first [N/mm]."""
    least_slope: float = 0.005
    """Smallest slope that is used [N/mm]."""
    trust: float = 0.05
    """Weight of the assumed slope in the fit, as a squared distance [mm²]."""
    stiffening: float = 0.4
    """Relative growth of the slope per millimetre of cable [1/mm]."""
    width_mm: float = 0.6
    """Standard deviation of the weight of a reading over its distance [mm]."""


MPC = {
    "CCR/LoadCell-v0": MPCSettings(
        effort=0.44, slope=0.032, least_slope=0.022, trust=0.0016, stiffening=0.11, width_mm=0.14
    ),
    "CCR/PushObstacle-v0": MPCSettings(
        effort=0.016, slope=0.0027, least_slope=0.052, trust=0.00058, stiffening=0.64, width_mm=0.17
    ),
    "CCR/TrackForce-v0": MPCSettings(
        effort=0.061, slope=0.028, least_slope=0.0063, trust=0.0022, stiffening=0.71, width_mm=0.21
    ),
    "CCR/BracedPush-v0": MPCSettings(
        effort=0.0035, slope=0.0057, least_slope=0.023, trust=0.00056, stiffening=0.7, width_mm=0.3
    ),
    "CCR/SoftObstacle-v0": MPCSettings(
        effort=0.005, slope=0.0097, least_slope=0.046, trust=0.00013, stiffening=0.2, width_mm=0.14
    ),
    "CCR/InsertAndPush-v0": MPCSettings(
        effort=0.0047, slope=0.29, least_slope=0.032, trust=0.00016, stiffening=0.014, width_mm=0.44
    ),
    "CCR/SpatialPush-v0": MPCSettings(
        effort=0.24, slope=0.021, least_slope=0.0012, trust=0.0076, stiffening=0.26, width_mm=0.19
    ),
}


@dataclass(frozen=True, slots=True)
class OnPolicySettings:
    """Settings of both kinds of proximal policy optimisation."""

    name: ClassVar[str]

    steps: int = 600_000
    """Environment steps to train for."""
    envs: int = 64
    """Environments stepped in parallel."""
    rollout: int = 128
    """Steps of each environment between updates."""
    batch_size: int = 2048
    """Samples of one gradient step."""
    epochs: int = 8
    """Passes over a rollout."""
    learning_rate: float = 1e-3
    """Learning rate of Adam; decays linearly to zero."""
    gamma: float = 0.9
    """Discount factor of rewards."""
    gae_lambda: float = 0.9
    """Decay λ of generalised advantages."""
    log_std_init: float = -0.5
    """Logarithm of the initial standard deviation of actions."""
    width: int = 64
    """Units per hidden layer: two layers, or one after an LSTM."""


@dataclass(frozen=True, slots=True)
class PPOSettings(OnPolicySettings):
    """Proximal policy optimisation (PPO) on observations with a memory."""

    name: ClassVar[str] = "PPO"


PPO_IDEAL = PPOSettings(steps=160_000, envs=32, rollout=64, batch_size=512)  # sufficient with ideal sensing


@dataclass(frozen=True, slots=True)
class RecurrentPPOSettings(OnPolicySettings):
    """Proximal policy optimisation with an LSTM instead of the memory."""

    name: ClassVar[str] = "RecurrentPPO"

    steps: int = 200_000
    """Environment steps to train for."""
    rollout: int = 64
    """Steps of each environment between updates."""
    batch_size: int = 1024
    """Samples of one gradient step."""
    hidden: int = 32
    """Units of the LSTM."""


@dataclass(frozen=True, slots=True)
class SACSettings:
    """Soft actor-critic (SAC) on observations with a memory."""

    name: ClassVar[str] = "SAC"

    steps: int = 100_000
    """Environment steps to train for."""
    envs: int = 32
    """Environments stepped in parallel."""
    gradient_steps: int = 4
    """Gradient steps after each step of all environments."""
    batch_size: int = 256
    """Samples of one gradient step."""
    learning_rate: float = 1e-3
    """Learning rate of Adam; decays linearly to zero."""
    gamma: float = 0.9
    """Discount factor of rewards."""
    tau: float = 0.01
    """Share of the critics that a gradient step blends into the target networks."""
    buffer: int = 100_000
    """Environment steps in the replay buffer."""
    width: int = 64
    """Units per hidden layer of the policy (two layers); the critics have twice as many."""


@dataclass(frozen=True, slots=True)
class DistilledSettings:
    """Imitation (DAgger) of a teacher that sees the hidden state, on observations with a memory."""

    name: ClassVar[str] = "Distilled"

    steps: int = 400_000
    """Environment steps to train for."""
    envs: int = 128
    """Environments stepped in parallel."""
    rollout: int = 64
    """Steps of each environment per round."""
    gradient_steps: int = 400
    """Gradient steps per round."""
    batch_size: int = 1024
    """Samples of one gradient step, from all rounds so far."""
    learning_rate: float = 2e-3
    """Learning rate of Adam; decays linearly to zero."""
    weaning: int = 5
    """Rounds over which the share of environments that the teacher drives falls to zero."""
    huber: float = 0.1
    """Action error beyond which the loss is linear."""
    width: int = 64
    """Units per hidden layer (two layers)."""


LearnerSettings = PPOSettings | RecurrentPPOSettings | SACSettings | DistilledSettings
LEARNERS: dict[str, type[LearnerSettings]] = {
    kind.name: kind for kind in (PPOSettings, RecurrentPPOSettings, SACSettings, DistilledSettings)
}
