"""What the commands are told."""

import json
import math
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from agents.errors import UserError
from agents.files import write_text
from agents.tuned import LEARNERS, DistilledSettings, LearnerSettings, PPOSettings, RecurrentPPOSettings, SACSettings
from ccr_gym import ENV_IDS

VALIDATION_SEED = 900_000  # training seeds stay below; learning curves are of seeds from here on
VALIDATION_EPISODES = 64
CURVE_POINTS = 15  # of a run
EVALUATION_SEED = 1_000_000  # evaluation seeds begin here

RANGES = {  # of settings of learners that are no counts
    "gamma": (0.0, 1.0),
    "gae_lambda": (0.0, 1.0),
    "tau": (0.0, 1.0),
    "learning_rate": (0.0, 1.0),
    "log_std_init": (-20.0, 2.0),
    "huber": (1e-9, 1e9),
}

POLICIES = ("P", "PI", "MPC", "Newton", *LEARNERS, "Oracle")
PRETRAINED = Path(__file__).parent / "pretrained"

Learner = (
    Annotated[PPOSettings, tyro.conf.subcommand("ppo")]
    | Annotated[SACSettings, tyro.conf.subcommand("sac")]
    | Annotated[RecurrentPPOSettings, tyro.conf.subcommand("recurrent")]
    | Annotated[DistilledSettings, tyro.conf.subcommand("distilled")]
)


@dataclass(frozen=True, slots=True)
class TrainConfig:
    """Train a policy on an environment, or go on with a run that was interrupted."""

    run: Path = Path("runs/ppo")
    """Folder for actor, configuration, checkpoints, learning curve and TensorBoard log."""
    env_id: str = "CCR/PushObstacle-v0"
    """Environment to train on."""
    sensing: Literal["ideal", "realistic"] = "realistic"
    """What stands between robot and learner: nothing, or backlash, latency, noise and what is unknown."""
    seed: int = 0
    """Seed of the learner and of the first environment's scenes; below 900 000, where validation begins."""
    threads: int = 2
    """Threads of the solver; results do not depend on them."""
    restart: bool = False
    """Begin again: what this run has written so far is deleted, and nothing else."""
    learner: Annotated[Learner, tyro.conf.arg(name="")] = field(default_factory=PPOSettings)
    """The learner and its settings."""

    def __post_init__(self) -> None:
        learner = self.learner
        _known("env_id", (self.env_id,), tuple(ENV_IDS))
        _known("sensing", (self.sensing,), ("ideal", "realistic"))
        _positive(self, "threads")
        _check_learner(learner)
        if not 0 <= self.seed <= VALIDATION_SEED - learner.envs:
            raise ValueError(f"seed is {self.seed}; it must be from 0 to {VALIDATION_SEED - learner.envs}")

    def matches(self, other: "TrainConfig") -> bool:
        """Whether both make the same policy, wherever and on however many threads."""
        return replace(self, run=other.run, threads=other.threads, restart=other.restart) == other

    def dumps(self) -> str:
        """As JSON."""
        learner = {"name": self.learner.name, **asdict(self.learner)}
        values = {**asdict(self), "run": str(self.run), "learner": learner}
        del values["restart"]
        return json.dumps(values, indent=2)

    def save(self, path: Path) -> None:
        """Write as JSON."""
        write_text(path, self.dumps() + "\n")

    @classmethod
    def loads(cls, text: str) -> "TrainConfig":
        """Read what :meth:`dumps` gave.

        Raises:
            ValueError: If it is something else.
        """
        try:
            values = json.loads(text)
            settings = dict(values["learner"])
            learner = LEARNERS[settings.pop("name")](**settings)
            return cls(**values | {"run": Path(values["run"]), "learner": learner})
        except (ValueError, LookupError, TypeError, RecursionError) as error:
            raise ValueError(f"it is not the configuration of a training run: {error!r}") from error

    @classmethod
    def load(cls, path: Path) -> "TrainConfig":
        """Read what :meth:`save` wrote.

        Raises:
            UserError: If it is something else.
        """
        try:
            return cls.loads(path.read_text())
        except ValueError as error:
            raise UserError(f"{path}: {error}") from error


@dataclass(frozen=True, slots=True)
class RetrainConfig:
    """Train every learned baseline on every environment, as the shipped policies were."""

    out: Path = Path("runs/retrain")
    """Folder for the runs; those that are there are not trained again, and interrupted ones go on."""
    learners: tuple[str, ...] = tuple(LEARNERS)
    """Which learners."""
    env_ids: tuple[str, ...] = tuple(ENV_IDS)
    """Which environments."""
    seeds: int = 5
    """Training seeds of each."""
    share: float = 1.0
    """Share of the tuned number of steps: less for a quick look."""
    jobs: int = 2
    """Runs side by side, each on one thread."""

    def __post_init__(self) -> None:
        _known("learners", self.learners, tuple(LEARNERS))
        _known("env_ids", self.env_ids, tuple(ENV_IDS))
        if not 0 < self.share <= 1:
            raise ValueError(f"share is {self.share}; it must be above 0 and at most 1")
        _positive(self, "seeds", "jobs")


@dataclass(frozen=True, slots=True)
class EvaluateConfig:
    """Evaluate policies on test scenes they were never trained or tuned on: table, figures, videos, JSON."""

    out: Path = Path("runs/evaluation")
    """Folder for the results."""
    runs: tuple[Path, ...] = ()
    """Folders of training runs, evaluated on their own environments in the place of the shipped policies."""
    pretrained: Path = PRETRAINED
    """Folder of trained policies, as `ccr-gym retrain` fills it; by default those that come with the package."""
    env_ids: tuple[str, ...] = tuple(ENV_IDS)
    """Which environments, where no runs are given."""
    policies: tuple[str, ...] = POLICIES
    """Which policies; learners are the shipped ones, or those of the runs."""
    episodes: int = 100
    """Episodes of every policy and environment, the same scenes for all."""
    seed: int = EVALUATION_SEED
    """Seed of the first evaluation scene; at least 1 000 000, beyond those of training."""
    video: bool = True
    """Whether to render an episode of every policy and environment to a video."""
    jobs: int = 2
    """Processes."""

    def __post_init__(self) -> None:
        _known("env_ids", self.env_ids, tuple(ENV_IDS))
        _known("policies", self.policies, POLICIES)
        _positive(self, "episodes", "jobs")
        if self.seed < EVALUATION_SEED:
            raise ValueError(f"seed is {self.seed}; it must be at least {EVALUATION_SEED}, beyond the training seeds")


@dataclass(frozen=True, slots=True)
class SweepConfig:
    """Search settings of a controller or a learner on training scenes, with Optuna."""

    what: Literal["P", "PI", "MPC", "Newton", "PPO", "SAC", "RecurrentPPO", "Distilled"] = "PI"
    """Whose settings."""
    env_id: str = "CCR/PushObstacle-v0"
    """On which environment."""
    trials: int = 50
    """Trials to add to the study."""
    episodes: int = 48
    """Episodes a trial is judged by."""
    steps: int = 300_000
    """Environment steps a learner is trained for in a trial."""
    out: Path = Path("runs/sweep")
    """Folder for the study, which goes on where it was left."""

    def __post_init__(self) -> None:
        _known("env_id", (self.env_id,), tuple(ENV_IDS))
        _positive(self, "trials", "episodes", "steps")


@dataclass(frozen=True, slots=True)
class BenchConfig:
    """Measure the kernel, the environments and a learner on them, beside peers in the same run."""

    steps: int = 200_000
    """Steps of the contact mix, in thousands: 100 or 200 a scene."""
    rivals: int = 200
    """Of these, how many IPOPT repeats."""
    seeds: int = 1
    """Seeds that PPO is trained with."""
    json: Path | None = Path("runs/bench.json")
    """File the numbers are written to."""

    def __post_init__(self) -> None:
        _positive(self, "rivals", "seeds")
        if self.steps < 1000 or self.steps % 1000:
            raise ValueError(f"steps is {self.steps}; it must be at least 1000, and a multiple of it")


@dataclass(frozen=True, slots=True)
class ReproduceConfig:
    """Regenerate the paper's figures and table, and check its claims in numbers."""

    out: Path = Path("runs/paper")
    """Folder for paper.png and paper.json."""


def _known(name: str, given: tuple[str, ...], known: tuple[str, ...]) -> None:
    unknown = [value for value in given if value not in known]
    if unknown or not given:
        raise ValueError(f"{name} is {list(given)}; it must name some of {', '.join(known)}")


def _check_learner(learner: LearnerSettings) -> None:
    """Raise ``ValueError`` where a setting is of another type than its default, or out of its range."""
    for name, value in asdict(learner).items():
        kind = type(getattr(type(learner)(), name))
        if not isinstance(value, (int, kind)):
            raise ValueError(f"{name} is {value!r}; it must be of type {kind.__name__}")
        low, high = RANGES.get(name, (-math.inf, math.inf))
        if not (math.isfinite(value) and low <= value <= high):
            raise ValueError(f"{name} is {value}; it must be from {low} to {high}")
    _positive(learner, *(name for name, value in asdict(type(learner)()).items() if isinstance(value, int)))
    if getattr(learner, "epochs", 0) and min(learner.batch_size, learner.envs * getattr(learner, "rollout", 1)) < 2:
        raise ValueError("batch_size and envs times rollout must be at least 2: advantages are scaled by their spread")


def _positive(settings: Any, *names: str) -> None:
    for name in names:
        value = getattr(settings, name)
        if value < 1:
            raise ValueError(f"{name} is {value}; it must be at least 1")
