"""Your own obstacle as an expression: any smooth shape F(x, y), negative inside and positive outside.

The expression is compiled once with the machine's C compiler (cc, gcc or clang) and kept in the user's cache folder.
"""

import casadi as ca
import gymnasium
import numpy as np

import ccr_gym  # noqa: F401 - registers the ids
from solver import Custom, Family, Robot, Scene, Solver


def petals(point: ca.SX, sizes: ca.SX) -> ca.SX:
    """Return F of a round shape with three petals: distance from the centre less R (1 + h cos 3θ), sizes R and h."""
    x, y, radius, height = point[0], point[1], sizes[0], sizes[1]
    r = ca.sqrt(x**2 + y**2 + 1)  # smooth at the centre, too
    return r - radius * (1 + height * (x**3 - 3 * x * y**2) / r**3)


def main() -> None:
    """Press the robot against the shape, then play an episode in front of it."""
    flower = Custom(
        family=Family.trace(petals, sizes=2), sizes=(16.0, 0.1), center=(48.0, 104.0), axis=(1.0, 0.4), reach=24.0
    )
    solver = Solver(Robot.prototype(), Scene([flower]))
    equilibrium = solver.rest()
    for cable_mm in range(1, 9):
        equilibrium = solver.step(equilibrium, float(cable_mm))
        force, gap = np.linalg.norm(equilibrium.forces[0]), equilibrium.gaps.min()
        print(f"cable {cable_mm} mm: force {force:.3f} N, smallest gap {gap:.1e} mm, {equilibrium.status.name}")
    env = gymnasium.make("CCR/PushObstacle-v1")
    _, info = env.reset(seed=0, options={"scene": [flower], "desired_force": 0.2})
    for _ in range(64):
        error = 1 - np.linalg.norm(info["force_true"]) / info["desired_force"]
        *_, info = env.step(np.array([np.clip(error, -1, 1)], np.float32))
    print(f"in the environment: {np.linalg.norm(info['force_true']):.4f} N of {info['desired_force']} N")


if __name__ == "__main__":
    main()
