"""Scenes and numbers that the paper prints (Ashwin, Mahapatra, Ghosal, MMT 164, 2021)."""

import numpy as np

from solver import Circle, HalfPlane, Scene

FIG_4A = Scene([Circle(center=(44.0, 104.0), radius=15.0)])
FIG_4B = Scene([Circle(center=(33.0, 89.0), radius=12.5), Circle(center=(59.0, 140.0), radius=15.0)])
FIG_5_NODES = (10, 16)  # peaks of the multipliers on each obstacle; the paper counts them as 11 and 17
FIG_10B_NODES = (10, 12, 14, 16, 18)  # disks that touch; the figure's numbers are not printed
CELL_NODE, CELL_HEIGHT_MM = 14, 127.0  # third disk from the top, the paper's 15th node (eq. 12), and Fig. 8
FIG_10A_MM = 26.0  # distance of the load cell in Fig. 8 to 10a, which Table 1 does not have

SECONDS_PER_ITERATION = 2.6  # of fmincon, without obstacles
SECONDS_PER_SOLVE = 4.0  # with one or two obstacles

# Table 1: cable load P_l [g], then the force on the load cell at each distance d [mm], measured six times each.
LOADS_G = (50, 100, 150, 200, 250, 300, 350)
MEASURED_G = {
    24: (3.0, 7.0, 10.2, 13.7, 17.0, 20.2, 23.0),
    31: (4.0, 7.0, 10.8, 14.0, 17.8, 21.0, 24.8),
    36: (3.0, 7.0, 10.0, 14.0, 17.0, 20.5, 23.8),
    51: (3.0, 7.0, 10.0, 14.0, 17.0, 21.0, 24.0),
}
THEORETICAL_G = (3.5, 7.1, 10.7, 14.2, 17.8, 21.3, 24.9)
# Distance [mm] and load [g] of the measurement taken to give μ. The paper does not say which it used; of the 28, this
# one reproduces the theoretical column best, to 0.06 g.
CALIBRATION = (31, 250)
CLAIMED_MEAN_ERROR_G, CLAIMED_MAX_ERROR_G = 0.9, 0.5
CLAIMED_MAX_ERROR = 0.0075  # of the contact force, in the introduction

LOADS = np.array(LOADS_G, float)  # (7,) [g]
MEASURED = np.array(list(MEASURED_G.values()))  # (4, 7) [g]


def is_calibration() -> np.ndarray:
    """Return which measurement μ was calibrated with, ``(4, 7)`` bool."""
    distance, load = CALIBRATION
    return np.asarray(np.logical_and.outer(np.array(list(MEASURED_G)) == distance, load == LOADS))


def load_cell(distance_mm: float, node: int = CELL_NODE) -> Scene:
    """Return the load cell of Fig. 8 at a distance from the unactuated backbone; one node touches it (eq. 12)."""
    return Scene([HalfPlane(point=(distance_mm, CELL_HEIGHT_MM), normal=(-1.0, 0.0), nodes=(node,))])
