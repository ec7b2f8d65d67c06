"""Bend the robot in space: two cables, a sphere and a cylinder, and the force vectors they press with."""

import numpy as np

from solver import Scene
from solver.spatial import Cylinder, SpatialRobot, SpatialSolver, Sphere


def main() -> None:
    """Pull both cables and print tip, tensions and contact forces."""
    obstacles = [  # the rounded edge of the cylinder would slip between two nodes: the robot has a point between them
        Sphere(center=(40, 18, 104), radius=15),
        Cylinder(start=(58, -20, 146), end=(58, 60, 146), radius=8, edge=2),
    ]
    solver = SpatialSolver(SpatialRobot.prototype(between=1), Scene(obstacles))
    equilibrium = solver.rest()
    for pull in range(1, 9):
        equilibrium = solver.step(equilibrium, (pull, 0.4 * pull))  # the cables at 0° (towards +x) and 90° (+y)
        tip, tensions = equilibrium.nodes[-1], equilibrium.tensions
        print(f"pulled {pull} mm: tip {tip.round(1)} mm, tensions {tensions.round(2)} N, {equilibrium.status.name}")
        for obstacle, force in zip(obstacles, equilibrium.forces, strict=True):
            if force.any():
                print(f"    {type(obstacle).__name__} presses with {np.linalg.norm(force):.3f} N, {force.round(3)}")
    print(equilibrium.residuals())


if __name__ == "__main__":
    main()
