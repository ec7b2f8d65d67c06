"""Solve the robot among obstacles without any learning: shapes, contacts, forces and the proof that they are right."""

import numpy as np

from solver import Circle, Robot, Scene, Solver, Status, force_true


def main() -> None:
    """Pull the robot against two circles, those of the paper's Fig. 4b, and print what every equilibrium knows."""
    scene = Scene([Circle(center=(33, 89), radius=12.5), Circle(center=(59, 140), radius=15)])
    solver = Solver(Robot.prototype(), scene)
    equilibrium = solver.rest()
    for cable_mm in np.arange(1.0, 9.0):
        equilibrium = solver.step(equilibrium, cable_mm)  # the way here matters, so the last state is an argument
        x, y, angle = equilibrium.nodes[-1]
        nodes = [sorted({int(node) for _, node in np.argwhere(points)}) for points in equilibrium.contact]
        forces = np.linalg.norm(force_true(equilibrium), axis=1)
        print(
            f"cable {cable_mm:.0f} mm: tip ({x:5.1f}, {y:5.1f}) mm at {np.degrees(angle):6.1f}°, "
            f"tension {equilibrium.tension:.2f} N, {Status(equilibrium.status).name}"
        )
        for circle, (touching, force) in enumerate(zip(nodes, forces, strict=True)):
            if touching:
                print(f"    circle {circle} presses with {force:.3f} N on nodes {touching}")
    print(equilibrium.residuals())  # optimality in the node coordinates of eq. 5, recomputed independently


if __name__ == "__main__":
    main()
