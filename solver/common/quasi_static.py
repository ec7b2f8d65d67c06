"""How fast a robot may be moved for its shape to be that of an equilibrium.

The robot is taken for a cantilever of the smallest rigidity along it, clamped at the base, without damping. Moving its
cable at a rate v turns the tip at v/a and moves it at v L/2a while it is nearly straight. A beam that is set into
motion so, or stopped, swings about its equilibria by at most that over its first natural frequency ω, which the tip
rotation that the cable prescribes only raises. Starting and stopping at the worst instant add up to v L/(aω).
"""

import math

from solver.common.rod import AnyRod, bending_ratios
from solver.common.validation import check_instance, check_number, check_positive

FIRST_ROOT = 1.8751040687119611  # smallest positive root of cos β cosh β = −1
MASS_UNIT = 1e6  # N·mm² over kg/m·mm⁴, in 1/s²


def natural_frequency(robot: AnyRod, mass_per_length: float) -> float:
    """Return the first natural frequency of a robot as a cantilever at its longest, β²·sqrt(EI/(ρA L⁴))/2π [Hz].

    Args:
        robot: The robot, a rod or of the paper's model.
        mass_per_length: Mass of a unit of length ρA, with disks and cables [kg/m, which is g/mm].

    Raises:
        ValueError: If the mass is not positive.
        TypeError: If there is no robot.
    """
    check_instance("robot", robot, AnyRod, "a robot has a frequency")
    mass = check_positive("mass_per_length", mass_per_length)
    stiffness = MASS_UNIT * float(bending_ratios(robot).min()) * robot.rigidity / mass
    return FIRST_ROOT**2 * math.sqrt(stiffness) / robot.longest_mm**2 / (2 * math.pi)


def quasi_static_rate(robot: AnyRod, mass_per_length: float, tip_error: float = 0.01) -> float:
    """Return the largest rate of a cable for which the tip stays near that of the equilibrium, ε·a·2πf [mm/s].

    Args:
        robot: The robot.
        mass_per_length: Mass of a unit of length, as of :func:`natural_frequency` [kg/m].
        tip_error: Distance ε that the tip may have from that of the equilibrium, over the length of the robot.

    Raises:
        ValueError: If the mass is not positive, or the error not between 0 and 0.1.
        TypeError: As :func:`natural_frequency`.
    """
    frequency = natural_frequency(robot, mass_per_length)
    bound = "above 0 and at most 0.1, as larger errors are not small motions"
    error = check_number("tip_error", tip_error, math.nextafter(0.0, 1.0), 0.1, bound)
    return error * robot.offset_mm * 2 * math.pi * frequency
