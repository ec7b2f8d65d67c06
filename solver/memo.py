"""Steps of the solver that need not be computed twice."""

from collections import OrderedDict
from typing import NamedTuple

from solver.equilibrium import Equilibrium
from solver.reference import ReferenceSolver
from solver.solve import Solver, check_command
from solver.validation import instance, whole


class MemoStatistics(NamedTuple):
    """Steps a :class:`TransitionMemo` knew and had to compute since it was cleared, steps it keeps, and their bound."""

    hits: int
    misses: int
    size: int
    capacity: int


class TransitionMemo:
    """Stands in for a solver and remembers its latest steps, for work that repeats them: resets, replays, planners.

    A step is a function of the state's numbers and the command, and these are the key. Not to be shared by threads.

    Args:
        solver: Answers what is not known yet.
        capacity: Steps to keep, about 3 kB each; the least recently used goes first.

    Raises:
        ValueError: If ``capacity`` is not a positive whole number.
        TypeError: If ``solver`` is something else.
    """

    def __init__(self, solver: Solver | ReferenceSolver, capacity: int = 4096) -> None:
        instance("solver", solver, (Solver, ReferenceSolver), "a memo stands in for a solver of the plane")
        self.robot, self.scene, self.rest = solver.robot, solver.scene, solver.rest
        self._step = solver.step
        self._capacity = whole("capacity", capacity, 1, 2**31)
        self.clear()

    def step(self, equilibrium: Equilibrium, cable_mm: float, length_mm: float | None = None) -> Equilibrium:
        """The solver's ``step``, bit for bit.

        Args:
            equilibrium: Where the robot is.
            cable_mm: Commanded cable displacement [mm].
            length_mm: Commanded length of the backbone [mm]; ``None`` keeps it.

        Returns:
            The equilibrium reached, the same object while the step is remembered.

        Raises:
            ValueError: As the solver; the memo stays as it was.
        """
        cable_mm, length_mm = check_command(self.robot, self.scene, equilibrium, cable_mm, length_mm)
        key = equilibrium.block.tobytes(), cable_mm, length_mm
        reached = self._reached.get(key)
        if reached is not None:
            self._reached.move_to_end(key)
            self._hits += 1
            return reached
        reached = self._reached[key] = self._step(equilibrium, cable_mm, length_mm)
        self._misses += 1
        if len(self._reached) > self._capacity:
            self._reached.popitem(last=False)
        return reached

    def clear(self) -> None:
        """Forget all steps and start the statistics anew."""
        self._reached: OrderedDict[tuple[bytes, float, float], Equilibrium] = OrderedDict()
        self._hits = self._misses = 0

    @property
    def statistics(self) -> MemoStatistics:
        """Use since the memo was made or cleared."""
        return MemoStatistics(self._hits, self._misses, len(self._reached), self._capacity)
