"""Friction between motors and cables: what a load cell at the motor reads of the tension in the robot."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from solver.common.validation import LARGEST, check_array, check_number, check_whole

MOST_LOSS = 0.9
ROUNDING = 1e-12  # of a displacement; a stalled cable that is let rest comes out of a step a last bit away


@dataclass(frozen=True, slots=True, eq=False)
class Transmission:
    """Motors that pull cables with dry friction on the way, of one robot or of many (...), cables along an axis c.

    ``T_robot = (1 − η) T_motor`` while a cable last moved in, and ``T_robot = T_motor / (1 − η)`` while it last moved
    out, so that the motor's tension jumps where the cable reverses. Cables that have not moved yet count as moved in.
    Shapes are those of the robot's tension alone. It is the state of an episode: :meth:`moved` returns the next.

    Attributes:
        loss: Share of the tension that is lost η, ``(...)``, from 0 to 0.9.
        moved_in: Whether each cable last moved in, ``(..., c)`` bool.
    """

    loss: np.ndarray
    moved_in: np.ndarray

    @classmethod
    def at_rest(cls, cables: int, loss: float | np.ndarray = 0.0) -> Self:
        """Return the state before any cable has moved.

        Args:
            cables: Number of cables c.
            loss: Share of the tension that is lost η, one number or ``(...)`` for many robots.

        Raises:
            ValueError: If the loss is not from 0 to 0.9, or the number of cables is not a positive whole number.
        """
        bound = f"from 0 to {MOST_LOSS}"
        if isinstance(loss, list | tuple) or (isinstance(loss, np.ndarray) and loss.ndim):
            losses = check_array("loss", loss, (..., -1), 0.0, MOST_LOSS, bound)
        else:
            losses = np.array(check_number("loss", loss, 0.0, MOST_LOSS, bound))
        return cls(losses, np.ones((*losses.shape, check_whole("cables", cables, 1, 4096)), bool))

    def moved(self, before_mm: np.ndarray, after_mm: np.ndarray) -> Self:
        """Return the state after cables have moved in the robot; one that rests, but for rounding, keeps its direction.

        Args:
            before_mm: Displacements of the cables, as ``Equilibrium.cables_mm``, ``(..., c)`` [mm].
            after_mm: Those after the step, likewise [mm].

        Raises:
            ValueError: If they are not displacements of these cables.
        """
        after, before = self._checked("after_mm", after_mm), self._checked("before_mm", before_mm)
        resting = np.abs(after - before) <= ROUNDING * np.abs(before)
        return replace(self, moved_in=np.where(resting, self.moved_in, after > before))

    def motor_tensions(self, robot_tensions: np.ndarray) -> np.ndarray:
        """Return the tensions at the motors for those in the robot, ``(..., c)`` [N].

        Raises:
            ValueError: If they are not tensions of these cables.
        """
        return np.asarray(self._checked("robot_tensions", robot_tensions) / self._arriving)

    def robot_tensions(self, motor_tensions: np.ndarray) -> np.ndarray:
        """Return the tensions in the robot for those at the motors, ``(..., c)`` [N].

        That of a motor's limit is the ``max_tension`` of the robot that it pulls.

        Raises:
            ValueError: If they are not tensions of these cables.
        """
        return np.asarray(self._checked("motor_tensions", motor_tensions) * self._arriving)

    @property
    def _arriving(self) -> np.ndarray:
        """Tension in the robot over that at the motor, ``(..., c)``."""
        kept = 1 - self.loss[..., None]
        return np.where(self.moved_in, kept, 1 / kept)

    def _checked(self, name: str, value: np.ndarray) -> np.ndarray:
        return check_array(name, value, self.moved_in.shape, -LARGEST, LARGEST, f"finite, at most {LARGEST:.6g}")
