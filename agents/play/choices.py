"""What a session can be set to: environment, robot, model, sensing, and who drives."""

from dataclasses import dataclass, replace
from functools import cache

from agents.benchmark.suite import CONTROLLERS, Entry
from agents.environment import Environment, make_env
from agents.learning.pretrained import trained
from agents.policy import Policy
from agents.tuned import LEARNERS, sensing_of
from ccr_gym import ENV_IDS
from solver import PRESETS

HAND = "Hand"  # the cables follow sliders and keys
MODELS = ("rod", "paper")
SENSINGS = ("ideal", "realistic", "sensorless")


@dataclass(frozen=True, slots=True)
class Choices:
    """Settings of a session, any combination of which can be played.

    Attributes:
        env_id: Id of the environment.
        robot: Name of a robot of :data:`solver.PRESETS`.
        model: ``"rod"`` or ``"paper"``.
        sensing: Sensing of the environment.
        driver: ``"Hand"``, or the name of a policy.

    Raises:
        ValueError: If a name is unknown, or there is no such policy for the environment.
    """

    env_id: str = "CCR/PushObstacle-v1"
    robot: str = "prototype"
    model: str = "rod"
    sensing: str = "ideal"
    driver: str = HAND

    def __post_init__(self) -> None:
        _check("env_id", self.env_id, tuple(ENV_IDS))
        _check("robot", self.robot, tuple(PRESETS))
        _check("model", self.model, MODELS)
        _check("sensing", self.sensing, SENSINGS)
        _check("driver", self.driver, drivers(self.env_id))

    def changed(self, name: str, value: str) -> "Choices":
        """Return the choices with one of them changed, and those that must follow it.

        An environment brings its own model, and a policy without training for it is left; a learned policy brings the
        sensing that it was trained with.

        Raises:
            ValueError: As the class.
        """
        changes = {name: value}
        if name == "env_id":
            _check("env_id", value, tuple(ENV_IDS))
            changes["model"] = "paper" if "-Paper-" in value else "rod"
            changes["driver"] = self.driver if self.driver in drivers(value) else HAND
        if changes.get("driver", HAND) in LEARNERS:
            changes["sensing"] = sensing_of(changes.get("env_id", self.env_id))
        return replace(self, **changes)

    def make_env(self) -> Environment:
        """Return the environment."""
        kwargs = {"robot": self.robot, "model": self.model, "sensing": self.sensing, "render_mode": "rgb_array"}
        return make_env(self.env_id, **kwargs)

    def make_policy(self) -> Policy | None:
        """Return the policy that drives, or None where the hand does."""
        if self.driver == HAND:
            return None
        files = trained(self.driver, self.env_id) if self.driver in LEARNERS else ()
        return Entry(self.driver, self.env_id, self.sensing, files).load()[0]


@cache
def drivers(env_id: str) -> tuple[str, ...]:
    """Return the names of all that can drive in an environment: the hand, controllers, policies trained for it."""
    return (HAND, *CONTROLLERS, *(learner for learner in LEARNERS if trained(learner, env_id)))


def _check(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(known)}")
