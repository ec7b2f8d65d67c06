"""Steps of the solver that need not be computed twice."""

from collections import OrderedDict
from typing import Any, Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np

from solver.common.validation import instance, whole


class State(Protocol):
    """An equilibrium, as far as a memo is concerned."""

    @property
    def block(self) -> np.ndarray:
        """Its numbers."""


StateT = TypeVar("StateT", bound=State)


@runtime_checkable
class Stepper(Protocol[StateT]):
    """A solver, in the plane or in space."""

    def rest(self) -> StateT:
        """Return the straight, unactuated robot."""

    def step(self, equilibrium: StateT, *command: Any) -> StateT:
        """Move from an equilibrium to a command."""

    def check_command(self, equilibrium: StateT, *command: Any) -> tuple[float, ...]:
        """Return a command as plain numbers; refuse one out of range, or an equilibrium of another solver."""


class MemoStatistics(NamedTuple):
    """Steps a :class:`TransitionMemo` knew and had to compute since it was cleared, steps it keeps, and their bound."""

    hits: int
    misses: int
    size: int
    capacity: int


class TransitionMemo(Generic[StateT]):
    """Stands in for a solver and remembers its latest steps, for work that repeats them: resets, replays, planners.

    A step is a function of the state's numbers and the command, and these are the key. Not to be shared by threads.

    Args:
        solver: Answers what is not known yet.
        capacity: Steps to keep, about 3 kB each; the least recently used goes first.

    Raises:
        ValueError: If ``capacity`` is not a positive whole number.
        TypeError: If ``solver`` is something else.
    """

    def __init__(self, solver: Stepper[StateT], capacity: int = 4096) -> None:
        instance("solver", solver, Stepper, "a memo stands in for a solver")
        self._solver = solver
        self._capacity = whole("capacity", capacity, 1, 2**31)
        self.clear()

    def rest(self) -> StateT:
        """Return the straight, unactuated robot."""
        return self._solver.rest()

    def step(self, equilibrium: StateT, *command: Any) -> StateT:
        """Return what the solver's ``step`` returns, bit for bit.

        Args:
            equilibrium: Where the robot is.
            command: The other arguments of that ``step``.

        Returns:
            The equilibrium reached, the same object while the step is remembered.

        Raises:
            ValueError: As the solver; the memo stays as it was.
        """
        numbers = self._solver.check_command(equilibrium, *command)
        key = equilibrium.block.tobytes(), numbers
        reached = self._reached.get(key)
        if reached is not None:
            self._reached.move_to_end(key)
            self._hits += 1
            return reached
        reached = self._reached[key] = self._solver.step(equilibrium, *command)
        self._misses += 1
        if len(self._reached) > self._capacity:
            self._reached.popitem(last=False)
        return reached

    def clear(self) -> None:
        """Forget all steps and start the statistics anew."""
        self._reached: OrderedDict[tuple[bytes, tuple[float, ...]], StateT] = OrderedDict()
        self._hits = self._misses = 0

    @property
    def statistics(self) -> MemoStatistics:
        """Use since the memo was made or cleared."""
        return MemoStatistics(self._hits, self._misses, len(self._reached), self._capacity)
