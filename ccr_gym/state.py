"""States of environments, taken out and put back: planning on copies, forks, exact continuation elsewhere."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ccr_gym.checks import check_type
from solver import Scene
from solver.common.rows import Rows, as_slice, copies

Arrays = dict[str, np.ndarray]
GENERATORS = ("MT19937", "PCG64", "PCG64DXSM", "Philox", "SFC64")  # NumPy's kinds


@dataclass(frozen=True, slots=True, eq=False)
class EpisodeState:
    """Episodes of k robots: all that their next steps depend on but the generators.

    Attributes:
        kind: Task and settings that its arrays depend on, by name.
        rows: The robots among their obstacles.
        model: What is known of them; ``None`` where sensing is ideal.
        starts: Their scenes at the start of the episodes.
        free: Robots of the estimator that nothing touches; ``None`` where it needs none.
        episode: Set-points, time and actions.
        estimator: What the estimator has learnt.
        sensors: Imperfections and the observations under way; empty where sensing is ideal.
    """

    kind: Mapping[str, object]
    rows: Rows
    model: Rows | None
    starts: tuple[Scene | None, ...]
    free: Rows | None
    episode: Arrays
    estimator: Arrays
    sensors: Arrays


@dataclass(frozen=True, slots=True, eq=False)
class EnvState:
    """State of an environment, or of all of a vector environment; pickle keeps it.

    Attributes:
        episodes: The episodes; ``None`` before the first reset.
        generators: States of the generators, one for each environment, ``None`` where it was not made yet.
        steps: Steps of each episode, ``(N,)``.
        ended: Whether each is to be reset, ``(N,)`` bool.
    """

    episodes: EpisodeState | None
    generators: tuple[Mapping[str, Any] | None, ...]
    steps: np.ndarray
    ended: np.ndarray


def take(arrays: Arrays, names: Sequence[str], robots: list[int]) -> Arrays:
    """Return copies of the rows of some arrays."""
    return dict(zip(names, copies((arrays[name] for name in names), as_slice(robots)), strict=True))


def put(arrays: Arrays, rows: Arrays, robots: list[int]) -> None:
    """Write rows of arrays."""
    at = as_slice(robots)
    for name, given in rows.items():
        arrays[name][at] = given


def check_state(state: object, generators: Sequence[np.random.Generator | None]) -> None:
    """Check that a state is one of environments with these generators.

    Raises:
        TypeError: If it is no state.
        ValueError: If it is of another number of environments, or of generators that cannot be made here.
    """
    check_type("state", state, EnvState, "what get_state() returns")
    assert isinstance(state, EnvState)
    if len(state.generators) != len(generators):
        raise ValueError(f"state is of {len(state.generators)} environments; it must be of {len(generators)}")
    for own, given in zip(generators, state.generators, strict=True):
        if given is not None and given["bit_generator"] not in (*GENERATORS, _kind(own)):
            raise ValueError(
                f"the state is of a generator {given['bit_generator']!r}; it must be one of {', '.join(GENERATORS)}, "
                "or of the same kind as the environment's np_random"
            )


def check_alike(own: Mapping[str, object], given: Mapping[str, object]) -> None:
    """Check that a state is of an environment of the same kind.

    Raises:
        ValueError: Naming what differs.
    """
    different = [name for name in own if own[name] != given[name]]
    if different:
        theirs, ours = (", ".join(f"{name} {kind[name]!r}" for name in different) for kind in (given, own))
        raise ValueError(
            f"the state is of an environment with {theirs}; this one has {ours}: take it from one of equal arguments"
        )


def state_of(generator: np.random.Generator | None) -> Mapping[str, Any] | None:
    """Return the state of a generator, None for none."""
    return None if generator is None else generator.bit_generator.state


def restored(generator: np.random.Generator | None, state: Mapping[str, Any] | None) -> np.random.Generator | None:
    """Return a generator in a state, the given one if it is of the same kind; None for none."""
    if state is None:
        return None
    if generator is None or _kind(generator) != state["bit_generator"]:
        generator = np.random.Generator(getattr(np.random, state["bit_generator"])(0))
    generator.bit_generator.state = state
    return generator


def _kind(generator: np.random.Generator | None) -> str | None:
    return None if generator is None else type(generator.bit_generator).__name__
