"""Memo of solver steps: each distinct step is solved once."""

from collections import OrderedDict
from typing import Generic, NamedTuple, ParamSpec, Protocol, TypeVar, runtime_checkable

import numpy as np

from solver.common.validation import check_whole, shown


class State(Protocol):
    """An equilibrium, as far as the memo uses it."""

    @property
    def block(self) -> np.ndarray:
        """All numbers of the equilibrium."""

    @property
    def scene(self) -> object:
        """The obstacles."""


StateT = TypeVar("StateT", bound=State)
Command = ParamSpec("Command")


@runtime_checkable
class Stepper(Protocol[StateT, Command]):
    """A solver, in the plane or in space."""

    @property
    def robot(self) -> object:
        """The robot."""

    @property
    def scene(self) -> object:
        """The obstacles."""

    def rest(self) -> StateT:
        """Return the straight, unactuated robot."""

    def step(self, equilibrium: StateT, *args: Command.args, **kwargs: Command.kwargs) -> StateT:
        """Move from an equilibrium to a command."""

    def check_command(self, equilibrium: StateT, *args: Command.args, **kwargs: Command.kwargs) -> tuple[float, ...]:
        """Return a command as floats; refuse one out of range, or an equilibrium of another solver."""


class MemoStatistics(NamedTuple):
    """Use of a :class:`TransitionMemo` since it was cleared.

    Attributes:
        hits: Steps that were remembered.
        misses: Steps that had to be solved.
        size: Steps in the memo now.
        capacity: Largest number of steps it keeps.
    """

    hits: int
    misses: int
    size: int
    capacity: int


class TransitionMemo(Generic[StateT, Command]):
    """Wraps a solver and remembers its latest steps, for work that repeats them: resets, replays, planners.

    A step depends on the numbers of the state and on the command alone, and on where obstacles move from and to; these
    are the key. Not thread-safe.

    Args:
        solver: Solves the steps that are not in the memo.
        capacity: Steps to keep, the least recently used is dropped first; a step takes about twice the memory of a
            block, 5 kB for a planar robot of 18 segments beside one obstacle.

    Raises:
        ValueError: If ``capacity`` is not a positive whole number.
        TypeError: If ``solver`` is not a solver.
    """

    def __init__(self, solver: Stepper[StateT, Command], capacity: int = 4096) -> None:
        if not isinstance(solver, Stepper):
            raise TypeError(f"solver is {shown(solver)}; it must be a solver: it needs rest(), step(), check_command()")
        self._solver = solver
        self.robot, self.scene = solver.robot, solver.scene
        self._capacity = check_whole("capacity", capacity, 1, 2**31)
        self.clear()

    def rest(self) -> StateT:
        """Return the straight, unactuated robot."""
        return self._solver.rest()

    def step(self, equilibrium: StateT, *args: Command.args, **kwargs: Command.kwargs) -> StateT:
        """Return what the solver's ``step`` returns, bit for bit.

        Args:
            equilibrium: State to start from.
            args: The other arguments of the solver's ``step``.
            kwargs: The same by name.

        Returns:
            The equilibrium reached, the same object as long as the step is remembered.

        Raises:
            ValueError: As the solver; the memo is left unchanged.
        """
        numbers = self._solver.check_command(equilibrium, *args, **kwargs)
        scene = kwargs.get("scene")  # where obstacles move to
        key = equilibrium.block.tobytes(), numbers, None if scene is None else (equilibrium.scene, scene)
        reached = self._reached.get(key)
        if reached is not None:
            self._reached.move_to_end(key)
            self._hits += 1
            return reached
        reached = self._reached[key] = self._solver.step(equilibrium, *args, **kwargs)
        self._misses += 1
        if len(self._reached) > self._capacity:
            self._reached.popitem(last=False)
        return reached

    def clear(self) -> None:
        """Forget all steps and reset the statistics."""
        self._reached: OrderedDict[tuple[bytes, tuple[float, ...], object], StateT] = OrderedDict()
        self._hits = self._misses = 0

    @property
    def statistics(self) -> MemoStatistics:
        """Hits, misses and size since the memo was created or cleared."""
        return MemoStatistics(self._hits, self._misses, len(self._reached), self._capacity)
