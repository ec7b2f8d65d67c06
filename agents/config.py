"""Settings of the commands: dataclasses that are checked when they are made, and are the command line's help."""

import json
import math
import os
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import tyro

from agents.errors import UserError
from agents.files import write_text
from agents.tuned import LEARNERS, DistilledSettings, LearnerSettings, PPOSettings, RecurrentPPOSettings, SACSettings
from ccr_gym import ENV_IDS
from solver import PRESETS

VALIDATION_SEED = 900_000  # training seeds lie below; learning curves use the seeds from here on
VALIDATION_EPISODES = 64
PER_CORE = 4  # processes, or threads of the solver, that this machine takes
MAX_ENVS = 65_536  # that a vector environment takes
CURVE_POINTS = 15  # of a training run
EVALUATION_SEED = 1_000_000  # first seed of an evaluation

RANGES = {  # of the real-valued settings of learners
    "gamma": (0.0, 1.0),
    "gae_lambda": (0.0, 1.0),
    "tau": (0.0, 1.0),
    "learning_rate": (0.0, 1.0),
    "log_std_init": (-20.0, 2.0),
    "huber": (1e-9, 1e9),
}

POLICIES = ("P", "PI", "MPC", "Harmonic", "Newton", *LEARNERS, "Oracle")
TUNABLE = tuple(name for name in POLICIES if name != "Oracle")
PRETRAINED = Path(__file__).parent / "pretrained"

Learner = (
    Annotated[PPOSettings, tyro.conf.subcommand("ppo")]
    | Annotated[SACSettings, tyro.conf.subcommand("sac")]
    | Annotated[RecurrentPPOSettings, tyro.conf.subcommand("recurrent")]
    | Annotated[DistilledSettings, tyro.conf.subcommand("distilled")]
)


@dataclass(frozen=True, slots=True)
class TrainConfig:
    """Train a policy on an environment, or resume an interrupted run."""

    run: Path = Path("runs/ppo")
    """Run folder: receives the actor, its configuration, the latest checkpoint and the TensorBoard log."""
    env_id: str = "CCR/PushObstacle-v1"
    """Environment to train on."""
    sensing: Literal["ideal", "realistic", "sensorless"] = "realistic"
    """Sensors and motors: perfect, with backlash, latency, noise and unknown rigidity, or so without force sensor."""
    seed: int = 0
    """Seed of the learner and of the first environment's scenes; below 900 000, where validation begins."""
    threads: int = 2
    """Threads of the solver; results do not depend on their number."""
    restart: bool = False
    """Start again from the beginning; deletes what this run has written so far, and nothing else."""
    learner: Annotated[Learner, tyro.conf.arg(name="")] = field(default_factory=PPOSettings)
    """The learner and its settings."""

    def __post_init__(self) -> None:
        _check_choice("env_id", self.env_id, tuple(ENV_IDS))
        _check_choice("sensing", self.sensing, ("ideal", "realistic", "sensorless"))
        _check_counts(self, "threads")
        _check_learner(self.learner)
        last = VALIDATION_SEED - self.learner.envs
        if type(self.seed) is not int or not 0 <= self.seed <= last:
            raise ValueError(
                f"seed is {self.seed!r}; it must be a whole number from 0 to {last}, so that validation scenes stay "
                "unseen"
            )

    def matches(self, other: "TrainConfig") -> bool:
        """Return whether both configurations train the same policy, in whatever folder and on however many threads."""
        return replace(self, run=other.run, threads=other.threads, restart=other.restart) == other

    def dumps(self) -> str:
        """Return the configuration as JSON."""
        learner = {"name": self.learner.name, **asdict(self.learner)}
        values = {**asdict(self), "run": str(self.run), "learner": learner}
        del values["restart"]
        return json.dumps(values, indent=2)

    def save(self, path: Path) -> None:
        """Write the configuration to a JSON file."""
        write_text(path, self.dumps() + "\n")

    @classmethod
    def loads(cls, text: str) -> "TrainConfig":
        """Return a configuration from the JSON of :meth:`dumps`.

        Raises:
            ValueError: If the text is anything else.
        """
        try:
            values = json.loads(text)
            settings = dict(values["learner"])
            learner = LEARNERS[settings.pop("name")](**settings)
            return cls(**values | {"run": Path(values["run"]), "learner": learner})
        except (ValueError, LookupError, TypeError, ArithmeticError, RecursionError) as error:
            raise ValueError(f"not the configuration of a training run: {error!r}") from error

    @classmethod
    def load(cls, path: Path) -> "TrainConfig":
        """Return a configuration from the file of :meth:`save`.

        Raises:
            UserError: If the file holds anything else.
        """
        try:
            return cls.loads(path.read_text())
        except ValueError as error:
            raise UserError(f"{path}: {error}") from error


@dataclass(frozen=True, slots=True)
class RetrainConfig:
    """Train every learned baseline on every environment, as the policies in the package were."""

    out: Path = Path("runs/retrain")
    """Folder for the runs; finished ones are kept, interrupted ones are resumed."""
    learners: tuple[str, ...] = tuple(LEARNERS)
    """Learners to train."""
    env_ids: tuple[str, ...] = tuple(ENV_IDS)
    """Environments to train on."""
    seeds: int = 5
    """Training seeds for every learner and environment."""
    share: float = 1.0
    """Share of the tuned number of steps; less than 1 for a quick look."""
    jobs: int = 2
    """Runs in parallel, on one thread each."""

    def __post_init__(self) -> None:
        _check_names("learners", self.learners, tuple(LEARNERS))
        _check_names("env_ids", self.env_ids, tuple(ENV_IDS))
        if not 0 < self.share <= 1:
            raise ValueError(f"share is {self.share}; it must be above 0 and at most 1")
        _check_counts(self, "seeds")
        check_parallel("jobs", self.jobs)


@dataclass(frozen=True, slots=True)
class EvaluateConfig:
    """Evaluate policies on test scenes that no training or tuning has used: tables, figures, videos and JSON."""

    out: Path = Path("runs/evaluation")
    """Folder for the results."""
    runs: Annotated[tuple[Path, ...], tyro.conf.arg(help_behavior_hint="(default: none)")] = ()
    """Run folders of trained policies, evaluated on their own environments instead of those in `pretrained`."""
    pretrained: Path = PRETRAINED
    """Folder of trained policies, as `ccr-gym retrain` writes it; by default those in the package."""
    env_ids: tuple[str, ...] = tuple(ENV_IDS)
    """Environments to evaluate on, unless `runs` are given."""
    policies: tuple[str, ...] = POLICIES
    """Policies to evaluate; the learned ones come from `pretrained`, or from `runs`."""
    sensing: Annotated[
        Literal["ideal", "realistic", "sensorless"] | None,
        tyro.conf.arg(help_behavior_hint="(default: None, that which each environment is tuned with)"),
    ] = None
    """Sensing of the environments, for which learned policies must have been trained."""
    episodes: int = 100
    """Episodes per policy and environment; all policies play the same scenes."""
    seed: int = EVALUATION_SEED
    """Seed of the first test scene; at least 1 000 000, beyond the seeds of training."""
    video: bool = True
    """Record a video of every policy, in the test scene of each environment where policies differ most."""
    jobs: int = 2
    """Processes in parallel."""

    def __post_init__(self) -> None:
        _check_names("env_ids", self.env_ids, tuple(ENV_IDS))
        _check_names("policies", self.policies, POLICIES)
        _check_counts(self, "episodes")
        check_parallel("jobs", self.jobs)
        if self.seed < EVALUATION_SEED:
            raise ValueError(f"seed is {self.seed}; it must be at least {EVALUATION_SEED}, beyond the training seeds")


@dataclass(frozen=True, slots=True)
class SweepConfig:
    """Tune a controller or a learner on training scenes with Optuna."""

    what: Literal["P", "PI", "MPC", "Harmonic", "Newton", "PPO", "RecurrentPPO", "SAC", "Distilled"] = "PI"
    """Controller or learner to tune: all that `ccr-gym evaluate` plays but the oracle, which has nothing to tune."""
    env_id: str = "CCR/PushObstacle-v1"
    """Environment to tune it on."""
    trials: int = 50
    """Trials to add to the study."""
    episodes: int = 48
    """Episodes that score a trial."""
    steps: int = 300_000
    """Environment steps that a learner trains for in a trial."""
    out: Path = Path("runs/sweep")
    """Folder for the study; an existing study is resumed."""

    def __post_init__(self) -> None:
        _check_choice("what", self.what, TUNABLE)
        _check_choice("env_id", self.env_id, tuple(ENV_IDS))
        _check_counts(self, "trials", "episodes", "steps")


@dataclass(frozen=True, slots=True)
class BenchConfig:
    """Measure the speed of the kernel, the environments and learning, next to other tools in the same run."""

    steps: int = 200_000
    """Steps of the contact mix; a multiple of 1000, as a scene takes 100 or 200."""
    rivals: int = 200
    """How many of these steps IPOPT repeats."""
    seeds: int = 1
    """Seeds to train PPO with."""
    json: Path | None = Path("runs/bench.json")
    """File for the results."""

    def __post_init__(self) -> None:
        _check_counts(self, "rivals", "seeds")
        if self.steps < 1000 or self.steps % 1000:
            raise ValueError(f"steps is {self.steps}; it must be a multiple of 1000, at least 1000")


@dataclass(frozen=True, slots=True)
class ReproduceConfig:
    """Put each of the paper's claims to the test, and reproduce its figures and Table 1."""

    out: Path = Path("runs/paper")
    """Folder for paper.md, its figures table_1.png and paper.png, and paper.json."""


@dataclass(frozen=True, slots=True)
class EstimateConfig:
    """Estimate shape, contacts and contact force from the log of a real robot."""

    log: tyro.conf.Positional[Path]
    """CSV file with a row for each instant: displacements and tensions of the cables, and positions if measured."""
    robot: Path
    """JSON file of the robot: its fields, or a preset with the fields that differ."""
    scene: Path
    """JSON file of the obstacles: a list."""
    out: Path = Path("runs/estimate")
    """Folder for estimate.csv, shape.csv, estimate.json and estimate.png."""
    sensing: Annotated[
        Path | None, tyro.conf.arg(help_behavior_hint="(default: None, the ranges of realistic sensing)")
    ] = None
    """JSON file of what is known of play, friction and noise."""
    every: int = 1
    """Rows of the log that are averaged to one."""

    def __post_init__(self) -> None:
        _check_counts(self, "every")


@dataclass(frozen=True, slots=True)
class PlayConfig:
    """Play with a robot in the browser: pull cables, drag obstacles, watch forces, let policies drive."""

    robot: str = "prototype"
    """Robot to begin with, a name of `solver.PRESETS`."""
    env_id: str = "CCR/PushObstacle-v1"
    """Environment to begin with."""
    port: int = 8080
    """Port of the page on this machine; the next free one if it is taken."""
    open: bool = True
    """Open the page in the browser."""
    out: Path = Path("runs/play")
    """Folder for recorded GIFs."""

    def __post_init__(self) -> None:
        _check_choice("robot", self.robot, tuple(PRESETS))
        _check_choice("env_id", self.env_id, tuple(ENV_IDS))
        if type(self.port) is not int or not 0 < self.port < 65536:
            raise ValueError(f"port is {self.port!r}; it must be from 1 to 65535")


def _check_choice(field: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"{field} is {value!r}; it must be one of {', '.join(choices)}")


def _check_names(field: str, names: tuple[str, ...], known: tuple[str, ...]) -> None:
    if not names or not set(names) <= set(known) or len(set(names)) < len(names):
        raise ValueError(f"{field} is {list(names)}; it must name some of {', '.join(known)}, each once")


def _check_counts(settings: object, *fields: str) -> None:
    for name in fields:
        value = getattr(settings, name)
        if type(value) is not int or value < 1:
            raise ValueError(f"{name} is {value!r}; it must be a whole number of at least 1")


def check_parallel(name: str, count: int) -> None:
    """Refuse more processes or threads than this machine takes.

    Raises:
        ValueError: Naming the bound.
    """
    most = PER_CORE * (os.cpu_count() or 1)
    if type(count) is not int or not 1 <= count <= most:
        bounds = f"from 1 to {most}, {PER_CORE} for each core of this machine"
        raise ValueError(f"{name} is {count!r}; it must be a whole number {bounds}")


def _check_learner(learner: LearnerSettings) -> None:
    """Refuse settings of another type than their defaults, or out of range."""
    for name, value in asdict(learner).items():
        kind = type(getattr(type(learner)(), name))
        if isinstance(value, bool) or not isinstance(value, (int, kind)):
            raise ValueError(f"{name} is {value!r}; it must be of type {kind.__name__}")
        low, high = RANGES.get(name, (-math.inf, math.inf))
        if not (math.isfinite(value) and low <= value <= high):
            raise ValueError(f"{name} is {value}; it must be from {low} to {high}")
    _check_counts(learner, *(name for name, value in asdict(type(learner)()).items() if isinstance(value, int)))
    if learner.envs > MAX_ENVS:
        raise ValueError(f"envs is {learner.envs}; it must be a whole number from 1 to {MAX_ENVS}")
    _check_batch(learner)


def _check_batch(learner: LearnerSettings) -> None:
    """Refuse batches of one sample where advantages are divided by their standard deviation."""
    if isinstance(learner, PPOSettings | RecurrentPPOSettings):
        samples = learner.envs * learner.rollout
        if min(learner.batch_size, samples) < 2:
            raise ValueError(
                f"batch_size is {learner.batch_size} and envs times rollout is {samples}; both must be at least 2, as "
                "advantages are divided by their standard deviation"
            )
