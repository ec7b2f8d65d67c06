"""Result of a step: one equilibrium of a robot, immutable and complete."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Generic, NamedTuple, Self, TypeVar

import casadi as ca
import numpy as np

from solver.common.layout import Layout
from solver.common.robot import AnyRobot
from solver.common.scene import Scene
from solver.common.signals import held_signals
from solver.common.status import Status
from solver.common.validation import check_instance, check_whole, refusal

RobotT_co = TypeVar("RobotT_co", bound=AnyRobot, covariant=True)

STATUSES = tuple(Status)
ROUNDING = 1e-6  # by which a node may be farther from the base than the robot's length, over that length


class Optimality(NamedTuple):
    """Optimality residuals of an equilibrium in the solver's coordinates, each zero at an exact solution.

    Attributes:
        stationarity: Largest slope of the Lagrangian in a segment's coordinate [rad²].
        gap: Deepest penetration, or largest opening of an active gap, over the robot's longest length.
        complementarity: Largest product of a multiplier and its gap [rad²].
    """

    stationarity: float
    gap: float
    complementarity: float


class Residuals(NamedTuple):
    """Optimality residuals of an equilibrium in node coordinates (eq. 5 or 13, or the rod's), each zero if exact.

    Attributes:
        stationarity: Largest entry of the Lagrangian's gradient, equality multipliers by least squares [rad²/mm].
        lengths: Largest violation of an equality: of a length of backbone, cable or disk, or of a rod's law [mm].
        gaps: Deepest penetration, or how much too short a cable of a rod is, at least 0 [mm].
        complementarity: Largest product of a multiplier and its gap, or of a tension and the slack [rad²].
        sign: Size of the most negative multiplier, at least 0 [rad²/mm].
    """

    stationarity: float
    lengths: float
    gaps: float
    complementarity: float
    sign: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BaseEquilibrium(ABC, Generic[RobotT_co]):
    """Base class of equilibria in the plane and in space.

    Obstacles are indexed by m, nodes by 0…n from the base. The points that can touch are indexed by line and position,
    (p, k): each line of the robot has ``robot.between`` points between every two nodes, by default none, so that a
    position is a node. Points and forces have d components, 2 or 3. All arrays are read-only.

    Attributes:
        robot: The robot.
        scene: The obstacles.
        block: All numbers of the equilibrium as one array, as the kernel reads and writes it, and how they changed on
            the way, where the search for the next equilibrium starts.
        status: How the step that led here ended.
        iterations: Newton iterations of that step.
        factorizations: Factorisations of the Hessian in that step.

    Raises:
        ValueError: If the block is not one of this robot and scene.
        TypeError: If the robot, the scene or the status is of the wrong class.
    """

    robot_kind: ClassVar[type]

    robot: RobotT_co
    scene: Scene
    block: np.ndarray
    status: Status
    iterations: int
    factorizations: int = 0

    def __post_init__(self) -> None:
        check_instance("robot", self.robot, self.robot_kind, "the robot that was solved")
        check_instance("scene", self.scene, Scene, "the scene that was solved")
        check_instance("status", self.status, Status, "how the step ended")
        object.__setattr__(self, "iterations", check_whole("iterations", self.iterations, 0, 2**62))
        _check_block(self.block, self._layout, self.robot)
        if self.block.base is not None:  # a view of an array that others may write
            object.__setattr__(self, "block", self.block.copy())
        self.block.flags.writeable = False

    @classmethod
    def solved(cls, robot: AnyRobot, scene: Scene, block: np.ndarray, status: int, *work: int) -> Self:
        """Return the equilibrium of a block that the kernel has just written, without checks.

        Args:
            robot: The robot, one of :attr:`robot_kind`.
            scene: The obstacles.
            block: The block, which becomes read-only.
            status: Value of a :class:`solver.Status`.
            work: Iterations and factorisations.
        """
        equilibrium, assign = object.__new__(cls), object.__setattr__
        block.flags.writeable = False
        assign(equilibrium, "robot", robot)
        assign(equilibrium, "scene", scene)
        assign(equilibrium, "block", block)
        assign(equilibrium, "status", STATUSES[status])
        for name, value in zip(("iterations", "factorizations"), work, strict=True):
            assign(equilibrium, name, value)
        return equilibrium

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
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
        """Sum of squared disk angles J; of a rod the elastic energy over ``energy_scale``, without loads [rad²]."""
        return float(self.block[self._layout.objective.at])

    @property
    def energy(self) -> float:
        """Elastic energy of the robot and of the obstacles' springs, and the potential of the loads [N·mm].

        The potential of a force F at x is −F·x, and of a moment M at the angle φ it is −M φ: zero at the base.
        """
        springs = [obstacle.spring_matrix for obstacle in self.scene]
        moved = zip(self.displacements, springs, strict=True)
        elastic = self.energy_scale * self.objective + sum(float(d @ spring @ d) / 2 for d, spring in moved)
        return elastic - self._load_work()

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
        """Gap between each obstacle and each point, infinite where they cannot touch, ``(m, p, k)`` [mm]."""
        return self._layout.gaps(self.block)

    @property
    def displacements(self) -> np.ndarray:
        """How far each obstacle on a spring was pushed, zero for a fixed one, ``(m, d)`` [mm]."""
        return self._layout.displacements(self.block)

    @property
    def forces(self) -> np.ndarray:
        """Force of each obstacle on the robot, by energy, ``(m, d)`` [N]."""
        return self._layout.forces(self.block)

    @property
    def scene_now(self) -> Scene:
        """The obstacles at their present positions, with the displacements of those on springs."""
        moved = zip(self.scene, self.displacements, strict=True)
        return Scene(obstacle.shifted(shift) for obstacle, shift in moved) if any(self.scene.mounted) else self.scene

    @property
    def contact(self) -> np.ndarray:
        """Which points touch which obstacle, by a positive multiplier, ``(m, p, k)`` bool."""
        return self.multipliers > 0

    @property
    def inequality_multipliers(self) -> np.ndarray:
        """Multipliers of the inequalities of the node-coordinate problem, ``(k,)`` [rad²/mm]."""
        return self.multipliers[:, :, 1:].ravel()

    @property
    @abstractmethod
    def points(self) -> np.ndarray:
        """The points that can touch, ``(p, k, d)`` [mm]."""

    @abstractmethod
    def _load_work(self) -> float:
        """Return the work of the loads from the base to the shape, see :func:`~solver.common.loads.load_work`."""

    @property
    @abstractmethod
    def _layout(self) -> Layout:
        """Memory layout of the block."""

    @property
    @abstractmethod
    def _derivatives(self) -> ca.Function:
        """:func:`~solver.common.node_problem.first_derivatives` of the node-coordinate problem."""

    @abstractmethod
    def _node_point(self) -> tuple[np.ndarray, np.ndarray]:
        """Return unknowns and parameters of the node-coordinate problem."""

    @held_signals()
    def node_solution(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the equilibrium as a solution of the node-coordinate problem.

        Returns:
            Unknowns, parameters, multipliers of the equalities, by least squares, and of the inequalities.
        """
        unknowns, parameters = self._node_point()
        balance, equality_slopes = self._balance(self._derivatives(unknowns, parameters))
        return unknowns, parameters, _tensions(balance, equality_slopes), self.inequality_multipliers

    def _balance(self, derivatives: tuple[ca.DM, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Return the objective's slope less the contact forces, and the slopes of the equalities that balance it."""
        slope, _, equality_slopes, _, gap_slopes = derivatives
        pushed = gap_slopes.T @ ca.DM(self.inequality_multipliers)
        return (slope - pushed).full().ravel(), _full(equality_slopes)

    @held_signals()
    def residuals(self) -> Residuals:
        """Recompute the optimality conditions of the node-coordinate problem from the shape and multipliers alone.

        The derivatives are those of the node-coordinate problem, which shares nothing with the solver's reduced
        coordinates. It has no gaps at the clamped base: where that holds up an obstacle on a spring, the stationarity
        of the obstacle lacks the base's force.
        """
        derivatives = self._derivatives(*self._node_point())
        _, lengths, _, gaps, _ = derivatives
        balance, equality_slopes = self._balance(derivatives)
        tensions, multipliers = _tensions(balance, equality_slopes), self.inequality_multipliers
        touchable = np.isfinite(self.gaps[:, :, 1:].ravel())
        touchable = np.concatenate([np.ones(multipliers.size - touchable.size, bool), touchable])
        clearance = gaps.full().ravel()[touchable]
        return Residuals(
            stationarity=float(np.abs(balance - equality_slopes.T @ tensions).max()),
            lengths=float(np.abs(lengths.full()).max()),
            gaps=float(max(0.0, -clearance.min(initial=0.0))),
            complementarity=float(np.abs(multipliers[touchable] * clearance).max(initial=0.0)),
            sign=float(max(0.0, -multipliers.min(initial=0.0))),
        )


def _check_block(block: np.ndarray, layout: Layout, robot: AnyRobot) -> None:
    """Check that a block holds numbers that an equilibrium of a robot can have, and the kernel can start from.

    Raises:
        ValueError: Naming the number and the bound.
    """
    remedy = "take the block of an equilibrium of an equal robot and scene"
    if not (isinstance(block, np.ndarray) and block.dtype == np.float64 and block.flags.c_contiguous):
        raise refusal("block", block, f"a contiguous array of float64: {remedy}")
    if block.shape != (layout.size,):
        raise ValueError(f"block has shape {block.shape}; it must be ({layout.size},): {remedy}")
    clearances = [layout.gaps(block), layout.clearance(block)]
    if np.isnan(block).any() or np.isinf(block).sum() > sum(np.isposinf(part).sum() for part in clearances):
        raise ValueError(f"block has numbers that are not finite; only gaps may be infinite: {remedy}")
    low, high = robot.shortest_mm, robot.longest_mm
    (length,) = layout.length(block)
    if not low <= length <= high:
        raise ValueError(f"length_mm in block is {length}; it must be from {low:.6g} to {high:.6g}: {remedy}")
    for name, part, bound in (
        ("the displacement of a cable", layout.cables(block), length),
        ("a coordinate of a segment", layout.coordinates(block), np.pi),
        ("the distance of a node", layout.nodes(block)[:, :2], (1 + ROUNDING) * length),
    ):
        if np.abs(part).max() > bound:
            raise ValueError(f"{name} in block is {np.abs(part).max():.6g}; it must be at most {bound:.6g}: {remedy}")
    if layout.multipliers(block).min(initial=0.0) < 0:
        raise ValueError(f"a multiplier in block is negative; none may be: {remedy}")


def _full(matrix: ca.DM) -> np.ndarray:
    """Return a sparse matrix as an array; ``matrix.full()`` would take long over its many zeros."""
    full, sparsity = np.zeros(matrix.shape), matrix.sparsity()
    full[sparsity.get_triplet()] = matrix.nonzeros()
    return full


def _tensions(balance: np.ndarray, equality_slopes: np.ndarray) -> np.ndarray:
    """Return the multipliers of the equalities, by least squares."""
    return np.asarray(np.linalg.lstsq(equality_slopes.T, balance, rcond=None)[0])
