"""Settings of a training run."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

EVALUATION_SEED = 1_000_000  # training seeds stay below, evaluation seeds begin here


@dataclass(frozen=True, slots=True)
class TrainConfig:
    """Train PPO on an environment; the defaults solve CCR/PushObstacle-v0."""

    run: Path = Path("runs/ppo")
    """Folder for policy, configuration, normaliser and TensorBoard log."""
    env_id: str = "CCR/PushObstacle-v0"
    """Environment to train on."""
    sensing: Literal["ideal", "realistic"] = "ideal"
    """What stands between robot and learner: nothing, or backlash, latency, noise and what is unknown."""
    seed: int = 0
    """Seed of the learner and of the first environment's scenes; below 1 000 000, where evaluation begins."""
    steps: int = 160_000
    """Environment steps to train for."""
    envs: int = 32
    """Environments stepped side by side."""
    threads: int = 2
    """Threads of the solver; results do not depend on them."""
    rollout: int = 64
    """Steps of each environment between updates."""
    batch_size: int = 512
    """Samples of one gradient step."""
    epochs: int = 8
    """Passes over a rollout."""
    learning_rate: float = 1e-3
    """Of Adam, decaying linearly to zero."""
    gamma: float = 0.9
    """Discount of rewards."""
    gae_lambda: float = 0.9
    """Decay of advantages."""
    log_std_init: float = -0.5
    """Logarithm of the first exploration noise."""
    width: int = 64
    """Units in each of the two hidden layers."""
    frames: int = 1
    """Observations that are seen at once, the latest last."""

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise ValueError(f"steps is {self.steps}; it must be at least 1")
        if not 1 <= self.frames <= 64:
            raise ValueError(f"frames is {self.frames}; it must be from 1 to 64")
        if not 0 <= self.seed <= EVALUATION_SEED - self.envs:
            raise ValueError(f"seed is {self.seed}; it must be from 0 to {EVALUATION_SEED - self.envs}")

    def save(self, path: Path) -> None:
        """Write as JSON."""
        path.write_text(json.dumps(asdict(self) | {"run": str(self.run)}, indent=2) + "\n")

    @classmethod
    def load(cls, path: Path) -> "TrainConfig":
        """Read what :meth:`save` wrote.

        Raises:
            ValueError: If it is something else.
        """
        try:
            values = json.loads(path.read_text())
            return cls(**values | {"run": Path(values["run"])})
        except (ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{path} is not the configuration of a training run: {error!r}") from error


@dataclass(frozen=True, slots=True)
class EvaluateConfig:
    """Evaluate a trained policy beside the classical controllers, on scenes it was never trained on."""

    run: Path = Path("runs/ppo")
    """Folder of the training run; results are written there too."""
    episodes: int = 100
    """Episodes for each policy, the same for all."""
    seed: int = EVALUATION_SEED
    """Seed of the first evaluation scene; at least 1 000 000, beyond those of training."""
    video: bool = True
    """Whether to render the first episodes to a video."""
    video_episodes: int = 4
    """Episodes in the video."""

    def __post_init__(self) -> None:
        if self.episodes < 1:
            raise ValueError(f"episodes is {self.episodes}; it must be at least 1")
        if self.seed < EVALUATION_SEED:
            raise ValueError(f"seed is {self.seed}; it must be at least {EVALUATION_SEED}, beyond the training seeds")


@dataclass(frozen=True, slots=True)
class BenchConfig:
    """Measure the kernel, the environments and a learner on them, beside peers in the same run."""

    steps: int = 200_000
    """Steps of the contact mix."""
    rivals: int = 200
    """Of these, how many IPOPT repeats."""
    seeds: int = 1
    """Seeds that PPO is trained with."""
    json: Path | None = Path("runs/bench.json")
    """File the numbers are written to."""


@dataclass(frozen=True, slots=True)
class ReproduceConfig:
    """Regenerate the paper's figures and table, and check its claims in numbers."""

    out: Path = Path("runs/paper")
    """Folder for paper.png and paper.json."""
