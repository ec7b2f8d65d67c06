"""The result of a solve: one equilibrium of a robot, immutable and complete."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self

import casadi as ca
import numpy as np

from solver.common.layout import Layout
from solver.common.scene import Scene
from solver.common.status import Status
from solver.common.validation import instance, shown, whole

STATUSES = tuple(Status)
ROUNDING = 1e-6  # by which a node may be farther from the base than the length, over it


class Optimality(NamedTuple):
    """Optimality of an equilibrium in the coordinates of the solver, without units, each zero at an exact solution.

    Attributes:
        stationarity: Largest slope of the Lagrangian in a coordinate of a segment [rad²].
        gap: Deepest penetration, or what an active gap is open, over the robot's longest length.
        complementarity: Largest product of a multiplier and its gap [rad²].
    """

    stationarity: float
    gap: float
    complementarity: float


class Residuals(NamedTuple):
    """Optimality of an equilibrium in the paper's node coordinates (eq. 5 or 13), each zero at an exact solution.

    Attributes:
        stationarity: Largest entry of the Lagrangian's gradient, equality multipliers by least squares [rad²/mm].
        lengths: Largest violation of a backbone, cable or disk length [mm].
        gaps: Deepest penetration, or what a sliding cable is too short, at least 0 [mm].
        complementarity: Largest product of a multiplier and its gap, or of the tension and the slack [rad²].
        sign: Most negative multiplier's size, at least 0 [rad²/mm].
    """

    stationarity: float
    lengths: float
    gaps: float
    complementarity: float
    sign: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BaseEquilibrium(ABC):
    """What equilibria in the plane and in space have in common.

    Obstacles are counted by m, nodes 0…n from the base. The points that can touch are counted by line and position,
    (p, k): along each line of the robot, ``robot.between`` points between every two nodes, by default none, so that a
    position is a node. Places and forces have d numbers, 2 or 3. All arrays are read-only.

    Attributes:
        robot: The robot.
        scene: The obstacles.
        block: Everything below as one array, as the kernel reads and writes it, and how it has changed on the way,
            from which the search for the next one starts.
        status: How the step that led here ended.
        iterations: Newton iterations of that step.
        factorizations: Factorisations of the Hessian in that step.

    Raises:
        ValueError: If the block is not one of this robot and scene.
        TypeError: If the robot, the scene or the status is something else.
    """

    robot_kind: ClassVar[type]

    robot: Any
    scene: Scene
    block: np.ndarray
    status: Status
    iterations: int
    factorizations: int = 0

    def __post_init__(self) -> None:
        instance("robot", self.robot, self.robot_kind, "the robot that was solved")
        instance("scene", self.scene, Scene, "the scene that was solved")
        instance("status", self.status, Status, "how the step ended")
        object.__setattr__(self, "iterations", whole("iterations", self.iterations, 0, 2**62))
        _check_block(self.block, self._layout, self.robot)
        if self.block.base is not None:  # which others may write
            object.__setattr__(self, "block", self.block.copy())
        self.block.flags.writeable = False

    @classmethod
    def solved(cls, robot: Any, scene: Scene, block: np.ndarray, status: int, *work: int) -> Self:
        """The same without a check, of a block that the kernel has just written."""
        made, assign = object.__new__(cls), object.__setattr__
        block.flags.writeable = False
        assign(made, "robot", robot)
        assign(made, "scene", scene)
        assign(made, "block", block)
        assign(made, "status", STATUSES[status])
        for name, value in zip(("iterations", "factorizations"), work, strict=True):
            assign(made, name, value)
        return made

    def __reduce__(self) -> tuple[type[Self], tuple[Any, ...]]:
        return type(self), (self.robot, self.scene, self.block, self.status, self.iterations, self.factorizations)

    def __repr__(self) -> str:
        cables = ", ".join(f"{cable:.6g}" for cable in self._layout.cables(self.block))
        tensions = ", ".join(f"{tension:.4g}" for tension in self._layout.tensions(self.block))
        return (
            f"<{type(self).__name__} {self.status.name}: {self.robot.segments} segments, {self.length_mm:.6g} mm long, "
            f"{len(self.scene)} obstacles, {int(self.contact.sum())} contacts, cable {cables} mm, tension {tensions} N>"
        )

    @property
    def length_mm(self) -> float:
        """Length of the backbone L0, which insertion changes [mm]."""
        return float(self.block[self._layout.length.at])

    @property
    def objective(self) -> float:
        """Sum of squared disk angles J [rad²]."""
        return float(self.block[self._layout.objective.at])

    @property
    def energy(self) -> float:
        """Elastic energy of the robot and of the springs that obstacles are mounted on [N·mm]."""
        springs = [obstacle.spring_matrix for obstacle in self.scene]
        moved = zip(self.displacements, springs, strict=True)
        return self.energy_scale * self.objective + sum(float(d @ spring @ d) / 2 for d, spring in moved)

    @property
    def energy_scale(self) -> float:
        """B = EI / 2 l0 [N·mm], which turns the objective J into energy."""
        return float(self.robot.rigidity * self.robot.segments / (2 * self.length_mm))

    @property
    def multipliers(self) -> np.ndarray:
        """Lagrange multipliers of the gaps, ``(m, p, k)`` [rad²/mm]."""
        return self._layout.multipliers(self.block)

    @property
    def gaps(self) -> np.ndarray:
        """Signed clearance of each point from each obstacle, infinite where they cannot touch, ``(m, p, k)`` [mm]."""
        return self._layout.gaps(self.block)

    @property
    def displacements(self) -> np.ndarray:
        """How far each obstacle has been pushed from its place, zero for a fixed one, ``(m, d)`` [mm]."""
        return self._layout.displacements(self.block)

    @property
    def forces(self) -> np.ndarray:
        """Force of each obstacle on the robot, by energy, ``(m, d)`` [N]."""
        return self._layout.forces(self.block)

    @property
    def scene_now(self) -> Scene:
        """The obstacles where they have been pushed to."""
        moved = zip(self.scene, self.displacements, strict=True)
        return Scene(obstacle.shifted(shift) for obstacle, shift in moved) if any(self.scene.mounted) else self.scene

    @property
    def contact(self) -> np.ndarray:
        """Which points touch which obstacle: a positive multiplier, ``(m, p, k)`` bool."""
        return self.multipliers > 0

    @property
    def inequality_multipliers(self) -> np.ndarray:
        """Multipliers of the inequalities of the node-coordinate problem, ``(k,)`` [rad²/mm]."""
        return self.multipliers[:, :, 1:].ravel()

    @property
    @abstractmethod
    def points(self) -> np.ndarray:
        """The points that can touch, ``(p, k, d)`` [mm]."""

    @property
    @abstractmethod
    def _layout(self) -> Layout:
        """Where the numbers stand in the block."""

    @property
    @abstractmethod
    def _derivatives(self) -> ca.Function:
        """:func:`~solver.common.node_problem.first_derivatives` of the node-coordinate problem."""

    @abstractmethod
    def _node_point(self) -> tuple[np.ndarray, np.ndarray]:
        """Unknowns and parameters of the node-coordinate problem."""

    def node_solution(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Unknowns, parameters and multipliers of the node-coordinate problem at this equilibrium.

        The multipliers are those of the equalities, by least squares, and of the inequalities.
        """
        unknowns, parameters = self._node_point()
        balance, equality_slopes = self._balance(self._node_derivatives(unknowns, parameters))
        return unknowns, parameters, _tensions(balance, equality_slopes), self.inequality_multipliers

    def _node_derivatives(self, unknowns: np.ndarray, parameters: np.ndarray) -> list[np.ndarray]:
        return [value.full() for value in self._derivatives(unknowns, parameters)]

    def _balance(self, derivatives: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Slope of the objective less the contact forces, and the slopes of the equalities that balance it."""
        slope, _, equality_slopes, _, gap_slopes = derivatives
        inequality_multipliers = self.inequality_multipliers
        return slope.ravel() - (
            gap_slopes.T @ inequality_multipliers if inequality_multipliers.size else 0.0
        ), equality_slopes

    def residuals(self) -> Residuals:
        """Recompute the optimality conditions of eq. 5 or 13 from the nodes and multipliers alone.

        The derivatives are those of the node-coordinate problem, which shares nothing with the reduced coordinates that
        the solver works in.
        """
        derivatives = self._node_derivatives(*self._node_point())
        _, lengths, _, gaps, _ = derivatives
        balance, equality_slopes = self._balance(derivatives)
        tensions, inequality_multipliers = _tensions(balance, equality_slopes), self.inequality_multipliers
        touchable = np.isfinite(self.gaps[:, :, 1:].ravel())
        touchable = np.concatenate([np.ones(inequality_multipliers.size - touchable.size, bool), touchable])
        clearance = gaps.ravel()[touchable]
        return Residuals(
            stationarity=float(np.abs(balance - equality_slopes.T @ tensions).max()),
            lengths=float(np.abs(lengths).max()),
            gaps=float(max(0.0, -clearance.min(initial=0.0))),
            complementarity=float(np.abs(inequality_multipliers[touchable] * clearance).max(initial=0.0)),
            sign=float(max(0.0, -inequality_multipliers.min(initial=0.0))),
        )


def _check_block(block: np.ndarray, places: Layout, robot: Any) -> None:
    """Refuse numbers that no equilibrium of a robot has, and that the kernel could not start from.

    Raises:
        ValueError: Naming what is wrong.
    """
    remedy = "take the block of an equilibrium of an equal robot and scene"
    if not (isinstance(block, np.ndarray) and block.dtype == np.float64 and block.flags.c_contiguous):
        raise ValueError(f"block is {shown(block)}; it must be a contiguous array of float64: {remedy}")
    if block.shape != (places.size,):
        raise ValueError(f"block has shape {block.shape}; it must be ({places.size},): {remedy}")
    clearances = [places.gaps(block), places.clearance(block)]
    if np.isnan(block).any() or np.isinf(block).sum() > sum(np.isposinf(part).sum() for part in clearances):
        raise ValueError(f"block has numbers that are not finite; only gaps may be infinite: {remedy}")
    low, high = robot.shortest_mm, robot.longest_mm
    (length,) = places.length(block)
    if not low <= length <= high:
        raise ValueError(f"length_mm in block is {length}; it must be from {low:.6g} to {high:.6g}: {remedy}")
    for name, part, bound in (
        ("the displacement of a cable", places.cables(block), length),
        ("a coordinate of a segment", places.coordinates(block), np.pi),
        ("the distance of a node", places.nodes(block)[:, :2], (1 + ROUNDING) * length),
    ):
        if np.abs(part).max() > bound:
            raise ValueError(f"{name} in block is {np.abs(part).max():.6g}; it must be at most {bound:.6g}: {remedy}")
    if places.multipliers(block).min(initial=0.0) < 0:
        raise ValueError(f"a multiplier in block is negative; none may be: {remedy}")


def _tensions(balance: np.ndarray, equality_slopes: np.ndarray) -> np.ndarray:
    """Multipliers of the equalities, by least squares."""
    return np.asarray(np.linalg.lstsq(equality_slopes.T, balance, rcond=None)[0])
