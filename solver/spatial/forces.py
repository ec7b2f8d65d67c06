"""Contact force in space, by energy and by virtual work.

The energy force is that of the model, in any direction. The paper's virtual work is planar: one cable, one angle. Here
it is extended to two cables. The free tip has one virtual displacement for each, and along both the work of the contact
force balances that of the loads, ``c F·x'_k + Σ_j P_j M_jk = 0``, with the cable load P gained since the onset of
contact and M_jk the turn of the free tip towards cable j per displacement of cable k, times the offset. The one unknown
factor c of a known direction F fits both equations by least squares. Only the combination that moves the tip against
the contact matters; in its plane this is eq. 10 of the paper. Friction adds the fraction μ of the normal force in the
direction in which the tip would slide on the surface in that motion.
"""

from dataclasses import dataclass

import numpy as np

from solver.common.operations import ARRAYS
from solver.common.transition_laws import slid, spatial_work
from solver.common.validation import check_alike, check_finite, check_instance, check_numbers
from solver.spatial.equilibrium import SpatialEquilibrium
from solver.spatial.robot import sides


def force_true(equilibrium: SpatialEquilibrium) -> np.ndarray:
    """Return the contact force by energy, ``F_j = EI / 2 l0 · λ_j ∇c_j``, ``(m, 3)`` [N]."""
    check_instance("equilibrium", equilibrium, SpatialEquilibrium, "take one of a solver in space")
    return equilibrium.forces.copy()


def with_friction(forces: np.ndarray, slopes: np.ndarray, friction: float) -> np.ndarray:
    """Return normal forces with friction added in the direction in which the free tip would slide, ``(..., 3)``.

    Args:
        forces: Normal forces, ``(..., 3)``.
        slopes: Slopes of the free tip's position in both displacements, ``(..., 2, 3)``.
        friction: Ratio μ of tangential to normal force.

    Raises:
        ValueError: If a value is no number, or an array not one of them of these shapes.
    """
    forces, slopes = check_numbers("forces", forces, (..., 3)), check_numbers("slopes", slopes, (..., 2, 3))
    check_alike(forces=forces.shape[:-1], slopes=slopes.shape[:-2])
    friction = check_finite("friction", friction)
    return np.stack(slid(_components(forces), [*map(_components, _rows(slopes))], friction, ARRAYS), axis=-1)


def virtual_work(forces: np.ndarray, loads: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Return the factor c for which a force does the virtual work of the cable loads, ``(...,)``.

    It is zero for a force that does no work against the motion.

    Args:
        forces: Forces, ``(..., 3)``.
        loads: Loads of both pairs of cables, signed as their displacements, ``(..., 2)`` [N].
        slopes: Slopes of the free tip in both displacements, as :attr:`SpatialEquilibrium.tip_slopes`, ``(..., 2, 5)``.

    Raises:
        ValueError: If an array is not one of numbers of these shapes.
    """
    forces, loads = check_numbers("forces", forces, (..., 3)), check_numbers("loads", loads, (..., 2))
    slopes = check_numbers("slopes", slopes, (..., 2, 5))
    check_alike(forces=forces.shape[:-1], loads=loads.shape[:-1], slopes=slopes.shape[:-2])
    along = [*map(_components, _rows(slopes))]
    return np.asarray(spatial_work(_components(forces), _components(loads), along, ARRAYS))


@dataclass(frozen=True, slots=True)
class SpatialVirtualWork:
    """The virtual-work estimator in space; several obstacles share one unknown in proportion to their multipliers.

    Attributes:
        friction: Ratio μ of tangential to normal force.

    Raises:
        ValueError: If the ratio is not finite.
    """

    friction: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "friction", check_finite("friction", self.friction))

    def estimate(self, equilibrium: SpatialEquilibrium) -> np.ndarray:
        """Return the estimated contact force, ``(m, 3)`` [N].

        Raises:
            ValueError: If the robot is a rod, whose free tip has no slopes in closed form.
            TypeError: If ``equilibrium`` is not one in space.
        """
        check_instance("equilibrium", equilibrium, SpatialEquilibrium, "take one of a solver in space")
        if equilibrium.robot.model == "rod":
            raise ValueError(
                "model is 'rod'; the slopes of the free tip are those of model=\"paper\": an environment estimates the "
                'force on a rod, info["force_est"]'
            )
        slopes = equilibrium.tip_slopes
        forces = with_friction(equilibrium.forces, slopes[:, :3], self.friction)
        loads = sides(equilibrium.cables_mm) * equilibrium.tensions - equilibrium.onset_tensions
        return np.asarray(virtual_work(forces.sum(axis=0), loads, slopes) * forces)


def _components(vectors: np.ndarray) -> list[np.ndarray]:
    """Return the components of vectors ``(..., k)``, k arrays ``(...)``."""
    return list(np.moveaxis(vectors, -1, 0))


def _rows(matrices: np.ndarray) -> list[np.ndarray]:
    """Return the rows of matrices ``(..., rows, k)``, arrays ``(..., k)``."""
    return list(np.moveaxis(matrices, -2, 0))
